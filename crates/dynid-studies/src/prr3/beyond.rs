//! Rows c and d: the mechanism upright, and shares of the platform's weight fitted with the rest.

use dynid::estimators::Mat;
use dynid::estimators::load_friction::{DriveRows, FitSettings, Problem, Record, fit_bounded, fit_separated};
use rayon::prelude::*;
use serde_json::json;

use super::experiment::Experiment;
use super::fits::{self, Fits, MODELS};
use super::machine::{Machine, Plane};
use super::rank::Rank;
use super::settings::Settings;
use super::{fault, trajectory, worst};
use crate::{Row, RunSettings, StudyError};

/// Residual and error on the circle of the three laws, N rms; means over seeds, and residuals without noise.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Errors {
    pub(super) clean: [f64; 3],
    pub(super) circle: [f64; 3],
}

impl Errors {
    /// How many times larger the constant law's error on the circle is.
    pub(super) fn gain(&self) -> f64 {
        self.circle[2] / self.circle[0]
    }
}

/// The mechanism with its plane upright.
#[derive(Debug)]
pub(super) struct Upright {
    pub(super) horizontal: Errors,
    pub(super) vertical: Errors,
    /// Largest force on the guideway over its mean, of every slider.
    pub(super) normal: Vec<[f64; 3]>,
    pub(super) rank: usize,
    pub(super) motion_forces: Vec<Vec<f64>>,
    /// Mean force on the guideway on the circle over that of identification, horizontal and upright.
    pub(super) carried: [f64; 2],
}

impl Upright {
    pub(super) fn new(
        machine: &Machine,
        settings: &Settings,
        fits: &Fits,
        run: &RunSettings,
    ) -> Result<Self, StudyError> {
        let truth = settings.truth();
        let samples = settings.trajectory.samples;
        let motion = trajectory::identification_motion(settings, samples)?;
        let record = machine.record(&motion, Plane::Vertical)?;
        let circle = machine.record(&trajectory::circle(&settings.circle, samples)?, Plane::Vertical)?;
        let circle = Experiment::new(circle, &truth, 0.0, 0)?;
        let (bounds, start) = (fits::bounds(settings)?, settings.start());
        let fitted = |(seed, model): (Option<u64>, usize)| {
            let noise = if seed.is_some() { settings.noise.force } else { 0.0 };
            let own = Experiment::new(record.clone(), &truth, noise, seed.unwrap_or(0))?;
            let problem = own.problem(fits::law(MODELS[model]))?;
            let fit = fit_bounded(&problem, &bounds, &start, &FitSettings::default()).map_err(fault)?;
            let predicted = problem.predict_on(&circle.record, &fit.theta).map_err(fault)?;
            let error = predicted.rms_error(&circle.clean).map_err(fault)?.unwrap_or(f64::NAN);
            Ok((seed.is_none(), model, fit.rms, error))
        };
        let seeds = if run.quick { 1 } else { 3 };
        let cases: Vec<(Option<u64>, usize)> = std::iter::once(None)
            .chain((run.seed..run.seed + seeds).map(Some))
            .flat_map(|seed| (0..MODELS.len()).map(move |m| (seed, m)))
            .collect();
        let found = cases.into_par_iter().map(fitted).collect::<Result<Vec<_>, StudyError>>()?;
        let mut vertical = Errors::default();
        for (clean, model, rms, error) in found {
            match clean {
                true => vertical.clean[model] = rms,
                false => vertical.circle[model] += error / seeds as f64,
            }
        }
        let mut horizontal = Errors::default();
        for model in 0..MODELS.len() {
            horizontal.clean[model] = fits.clean.fits[model].fit.rms;
            let sum: f64 = fits.noisy.iter().map(|b| b.fits[model].circle[0]).sum();
            horizontal.circle[model] = sum / fits.noisy.len() as f64;
        }
        let forces = trajectory::true_forces(machine, settings, &motion, Plane::Vertical)?;
        let own = Experiment::new(record, &truth, 0.0, 0)?;
        let rank = own.problem(fits::law(MODELS[0]))?.identifiability(&truth, None).map_err(fault)?.rank;
        let range = |values: &Vec<f64>| {
            let mean = values.iter().sum::<f64>() / values.len() as f64;
            let low = values.iter().copied().fold(f64::INFINITY, f64::min);
            [low, mean, values.iter().copied().fold(0.0, f64::max)]
        };
        let round = trajectory::circle(&settings.circle, samples)?;
        let mean = |plane: Plane, on: &dynid::motion::trajectory::Sampled| {
            let forces = trajectory::true_forces(machine, settings, on, plane)?;
            Ok::<_, StudyError>(forces.drives.iter().flat_map(|d| &d.normal).sum::<f64>())
        };
        let share = |plane: Plane| Ok::<_, StudyError>(mean(plane, &round)? / mean(plane, &motion)?);
        let carried = [share(Plane::Horizontal)?, share(Plane::Vertical)?];
        let motion_forces: Vec<Vec<f64>> = forces.drives.into_iter().map(|d| d.normal).collect();
        Ok(Upright {
            horizontal,
            vertical,
            normal: motion_forces.iter().map(range).collect(),
            rank,
            motion_forces,
            carried,
        })
    }

    /// Row c.
    pub(super) fn row(&self) -> Row {
        let (h, v) = (&self.horizontal, &self.vertical);
        let numbers = |e: &Errors| json!({ "clean": e.clean, "circle": e.circle, "gain": e.gain() });
        Row::new(
            "c",
            "Upright, all of the weight is in the forces on the guideway that friction follows: the law of friction matters more in the \
             fit. On the circle frozen forces are less wrong than lying down, where motion alone makes them and a gentler one leaves little",
            "residuals without noise of both other laws larger than those of the horizontal machine; mean force on the guideway of the \
             circle over that of identification nearer to 1",
            json!({ "horizontal": numbers(h), "vertical": numbers(v), "rank": self.rank, "carried_over": self.carried }),
            format!(
                "residual without Stribeck {:.2} N (horizontal {:.2}), constant {:.2} N ({:.2}); on the circle constant {:.2} N against \
                 {:.2} N varying ({:.2} against {:.2}); mean force there {:.2} of identification's ({:.2})",
                v.clean[1],
                h.clean[1],
                v.clean[2],
                h.clean[2],
                v.circle[2],
                v.circle[0],
                h.circle[2],
                h.circle[0],
                self.carried[1],
                self.carried[0]
            ),
            v.clean[1] > h.clean[1]
                && v.clean[2] > h.clean[2]
                && (self.carried[1] - 1.0).abs() < (self.carried[0] - 1.0).abs(),
        )
    }
}

/// Weights with other shares of the platform.
fn with_shares(
    machine: &Machine,
    settings: &Settings,
    record: &Record,
    shares: [f64; 3],
) -> Result<Record, StudyError> {
    let place = settings.place("m_p")?;
    let drives = record.drives().iter().zip(shares).map(|(d, share)| {
        let mut own = d.clone();
        own.weight[place] = machine.gravity_size() * share;
        own
    });
    Record::new(drives.collect()).map_err(fault)
}

/// The platform's weight on two sliders as two more parameters; the third has the rest.
fn with_free_shares(machine: &Machine, settings: &Settings, record: &Record) -> Result<Record, StudyError> {
    let place = settings.place("m_p")?;
    let g = machine.gravity_size();
    let widened = |m: &Mat| {
        let columns = m.ncols();
        Mat::from_fn(m.nrows(), columns + 2, |i, k| if k < columns { m[(i, k)] } else { 0.0 })
    };
    let drives = record.drives().iter().enumerate().map(|(slider, d)| {
        let mut weight = d.weight.clone();
        weight[place] = if slider == 2 { g } else { 0.0 };
        weight.extend(match slider {
            2 => [-g, -g],
            _ => [g * f64::from(u8::from(slider == 0)), g * f64::from(u8::from(slider == 1))],
        });
        DriveRows {
            regressor: widened(&d.regressor),
            reactions: d.reactions.iter().map(&widened).collect(),
            weight,
            speed: d.speed.clone(),
        }
    });
    Record::new(drives.collect()).map_err(fault)
}

/// Fits with assumed shares.
#[derive(Debug, Clone, Copy)]
pub(super) struct Tried {
    pub(super) shares: [f64; 3],
    /// J over that of the true shares, within the bounds of Table 1 and without bounds of inertial parameters.
    pub(super) bounded: f64,
    pub(super) free: f64,
    /// Legs and platform, within the bounds, kg.
    pub(super) masses: [f64; 4],
}

/// Shares of the platform's weight.
#[derive(Debug)]
pub(super) struct Shares {
    /// With the true shares first.
    pub(super) tried: Vec<Tried>,
    pub(super) rank: usize,
    pub(super) free: usize,
    any_determined: bool,
}

impl Shares {
    pub(super) fn new(
        machine: &Machine,
        settings: &Settings,
        fits: &Fits,
        rank: &Rank,
    ) -> Result<Self, StudyError> {
        const OTHERS: [[f64; 3]; 3] = [[0.65, 0.225, 0.125], [0.75, 0.15, 0.1], [0.7, 0.15, 0.15]];
        let batch = &fits.noisy[0];
        let fitted = &batch.fits[0];
        let law = fitted.problem.settings().clone();
        let record = fitted.problem.record();
        let masses = [
            settings.place("m_L1")?,
            settings.place("m_L2")?,
            settings.place("m_L3")?,
            settings.place("m_p")?,
        ];
        let own = |theta: &[f64]| masses.map(|k| theta[k]);
        let tried = OTHERS.into_par_iter().map(|shares| {
            let record = with_shares(machine, settings, record, shares)?;
            let problem = Problem::new(record, &batch.efforts, law.clone()).map_err(fault)?;
            let fit = fit_bounded(&problem, &fits.bounds, &settings.start(), &FitSettings::default())
                .map_err(fault)?;
            let separated = fit_separated(&problem, &fits.bounds, &settings.start(), &FitSettings::default())
                .map_err(fault)?;
            Ok(Tried {
                shares,
                bounded: fit.sum_of_squares / fitted.fit.sum_of_squares,
                free: separated.sum_of_squares / batch.separated.sum_of_squares,
                masses: own(&fit.theta),
            })
        });
        let mut tried = tried.collect::<Result<Vec<_>, StudyError>>()?;
        let masses_of_fit = own(&fitted.fit.theta);
        tried.insert(0, Tried { shares: [0.7, 0.2, 0.1], bounded: 1.0, free: 1.0, masses: masses_of_fit });
        let wide = with_free_shares(machine, settings, record)?;
        let problem = Problem::new(wide, &batch.efforts, law).map_err(fault)?;
        let mut theta = settings.truth();
        let (count, platform) = (settings.parameter.len(), theta[masses[3]]);
        theta.splice(count..count, [0.7 * platform, 0.2 * platform]);
        let found = problem.identifiability(&theta, None).map_err(fault)?;
        let any = masses.iter().copied().chain([count, count + 1]).any(|k| found.determined[k]);
        debug_assert!(found.rank >= rank.whole.rank);
        Ok(Shares { tried, rank: found.rank, free: found.null_directions.ncols(), any_determined: any })
    }

    /// Row d.
    pub(super) fn row(&self) -> Row {
        let largest = |of: fn(&Tried) -> f64| self.tried.iter().map(|t| (of(t) - 1.0).abs()).fold(0.0, worst);
        let (free, bounded) = (largest(|t| t.free), largest(|t| t.bounded));
        Row::new(
            "d",
            "Shares α_w of the platform's weight compete with the masses: forces determine neither",
            "with two shares among the parameters rank 15 of 19, no mass and no share determined; without bounds other shares fit as \
             well (J to 1e-6)",
            json!({ "rank": self.rank, "free_directions": self.free, "largest_change": free, "largest_change_bounded": bounded,
                    "tried": self.tried.iter()
                        .map(|t| json!({ "shares": t.shares, "J_free": t.free, "J_bounded": t.bounded, "masses": t.masses }))
                        .collect::<Vec<_>>() }),
            format!(
                "rank {}, {} free directions; J changes by {free:.0e}, within the bounds of Table 1, which then choose, by {:.1} %",
                self.rank,
                self.free,
                100.0 * bounded
            ),
            self.rank == 15 && self.free == 4 && !self.any_determined && free <= 1e-6,
        )
    }
}
