//! Row e: the whole way from encoders and noisy forces.

use dynid::estimators::load_friction::{FitSettings, Problem, fit_bounded};
use dynid::motion::difference::central;
use dynid::motion::filter::{butterworth, forward_backward};
use dynid::motion::harmonics::Harmonics;
use dynid::motion::trajectory::Sampled;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use serde_json::json;

use super::fits::{self, Fits, MODELS};
use super::machine::{Coordinates, Machine, Plane, SLIDERS};
use super::rank::Rank;
use super::settings::Settings;
use super::{fault, trajectory, worst};
use crate::{Row, RunSettings, StudyError};

/// Periods logged; the first and the last only lead filters in and out.
const PERIODS: usize = 3;
/// Cut-off of the filter, Hz, and its order.
const CUTOFF: f64 = 20.0;
const ORDER: usize = 4;
/// Harmonics of the period in the sliders' motion.
const HARMONICS: usize = 30;
/// Speed below which a measured slider counts as at rest, m/s.
const REST: f64 = 1e-3;

/// How speeds and accelerations are made from positions.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Conditioning {
    /// Zero-phase low-pass and central differences.
    Filter,
    /// Harmonics of the period by least squares.
    Periodic,
}

/// An identification from measured signals.
#[derive(Debug)]
pub(super) struct Measured {
    pub(super) conditioning: Conditioning,
    /// Errors of speed and acceleration, m/s and m/s² rms.
    pub(super) motion: [f64; 2],
    /// Residual and error on the circle, N rms.
    pub(super) rms: f64,
    pub(super) circle: f64,
    /// Base parameters: largest error relative to the value.
    pub(super) base: f64,
    /// Friction parameters.
    pub(super) friction: Vec<f64>,
}

/// Speed and acceleration of a slider over a period: differences of the encoder as it is, and filtered.
#[derive(Debug)]
pub(super) struct Signals {
    pub(super) raw: [Vec<f64>; 2],
    pub(super) filtered: [Vec<f64>; 2],
}

#[derive(Debug)]
pub(super) struct Encoders {
    pub(super) found: Vec<Measured>,
    /// Slider after slider.
    pub(super) signals: Vec<Signals>,
    /// With exact motion.
    exact_circle: f64,
    /// Residual of the fit with exact motion to the same forces, N.
    exact_rms: f64,
}

/// One period of position, speed and acceleration of a slider from its encoder.
fn conditioned(
    conditioning: Conditioning,
    position: &[f64],
    rate_hz: f64,
) -> Result<[Vec<f64>; 3], StudyError> {
    let samples = position.len() / PERIODS;
    let middle = |signal: Vec<f64>| signal[samples..2 * samples].to_vec();
    match conditioning {
        Conditioning::Filter => {
            let filter = butterworth(ORDER, CUTOFF, rate_hz).map_err(fault)?;
            let smooth = forward_backward(&filter, position).map_err(fault)?;
            let speed = central(&smooth, rate_hz).map_err(fault)?;
            let acceleration = central(&speed, rate_hz).map_err(fault)?;
            Ok([smooth, speed, acceleration].map(middle))
        }
        Conditioning::Periodic => {
            let step = std::f64::consts::TAU / samples as f64;
            let series = Harmonics::fit(position, &vec![true; position.len()], step, HARMONICS);
            let speed = series.derivative(rate_hz);
            let acceleration = speed.derivative(rate_hz);
            Ok([series, speed, acceleration].map(|s| middle(s.values(position.len()))))
        }
    }
}

impl Encoders {
    pub(super) fn new(
        machine: &Machine,
        settings: &Settings,
        fits: &Fits,
        rank: &Rank,
        run: &RunSettings,
    ) -> Result<Self, StudyError> {
        let samples = settings.trajectory.samples;
        let rate_hz = samples as f64 / settings.trajectory.period;
        let motion = trajectory::identification_motion(settings, samples)?;
        let joints = machine.joints(&motion);
        let forces = trajectory::true_forces(machine, settings, &motion, Plane::Horizontal)?;
        let step = settings.noise.encoder;
        let mut rng = ChaCha8Rng::seed_from_u64(run.seed);
        let mut noisy = |f: &f64| {
            let e: f64 = StandardNormal.sample(&mut rng);
            f + settings.noise.force * e
        };
        let efforts: Vec<Vec<f64>> =
            forces.drives.iter().map(|d| d.effort.iter().map(&mut noisy).collect()).collect();
        let truth = settings.truth();
        let count = settings.parameter.len();
        let (mut found, mut signals) = (Vec::new(), Vec::new());
        for conditioning in [Conditioning::Filter, Conditioning::Periodic] {
            let mut measured =
                Sampled { time: motion.time.clone(), q: Vec::new(), dq: Vec::new(), ddq: Vec::new() };
            let mut off = [0.0, 0.0];
            for rate in machine.driven() {
                let own = |of: &[f64]| of[rate * samples..][..samples].to_vec();
                let quantised = own(&joints.q).into_iter().map(|x| step * (x / step).round());
                let position: Vec<f64> = quantised.cycle().take(PERIODS * samples).collect();
                let [q, dq, ddq] = conditioned(conditioning, &position, rate_hz)?;
                for (sum, (a, b)) in off.iter_mut().zip([(&dq, own(&joints.dq)), (&ddq, own(&joints.ddq))]) {
                    *sum += a.iter().zip(&b).map(|(a, b)| (a - b).powi(2)).sum::<f64>();
                }
                if conditioning == Conditioning::Filter {
                    let speed = central(&position, rate_hz).map_err(fault)?;
                    let acceleration = central(&speed, rate_hz).map_err(fault)?;
                    let raw = [speed, acceleration].map(|s| s[samples..2 * samples].to_vec());
                    signals.push(Signals { raw, filtered: [dq.clone(), ddq.clone()] });
                }
                measured.q.extend(q);
                measured.dq.extend(dq);
                measured.ddq.extend(ddq);
            }
            let record = machine.record_of(&measured, Coordinates::Sliders, Plane::Horizontal)?;
            let law = dynid::estimators::load_friction::Settings { rest_speed: REST, ..fits::law(MODELS[0]) };
            let problem = Problem::new(record, &efforts, law).map_err(fault)?;
            let fit = fit_bounded(&problem, &fits.bounds, &settings.start(), &FitSettings::default())
                .map_err(fault)?;
            let predicted = problem.predict_on(&fits.circle.record, &fit.theta).map_err(fault)?;
            let base = (0..rank.base.nrows()).map(|i| {
                let of = |theta: &[f64]| (0..count).map(|k| rank.base[(i, k)] * theta[k]).sum::<f64>();
                (of(&fit.theta) / of(&truth) - 1.0).abs()
            });
            found.push(Measured {
                conditioning,
                motion: off.map(|sum| (sum / (SLIDERS * samples) as f64).sqrt()),
                rms: fit.rms,
                circle: predicted.rms_error(&fits.circle.clean).map_err(fault)?.unwrap_or(f64::NAN),
                base: base.fold(0.0, worst),
                friction: fit.theta[count..].to_vec(),
            });
        }
        let exact = &fits.noisy[0].fits[0];
        Ok(Encoders { found, signals, exact_circle: exact.circle[0], exact_rms: exact.fit.rms })
    }

    /// Row e.
    pub(super) fn row(&self) -> Row {
        let numbers = |m: &Measured| {
            json!({ "conditioning": format!("{:?}", m.conditioning), "speed_error": m.motion[0],
                    "acceleration_error": m.motion[1], "rms": m.rms, "circle": m.circle, "base": m.base,
                    "friction": m.friction })
        };
        let told = |m: &Measured| {
            let name = match m.conditioning {
                Conditioning::Filter => "filter and differences",
                Conditioning::Periodic => "harmonics of the period",
            };
            format!(
                "{name}: acceleration to {:.1e} m/s², residual {:.3} N, base parameters to {:.1} %, circle {:.2} N",
                m.motion[1],
                m.rms,
                100.0 * m.base,
                m.circle
            )
        };
        Row::new(
            "e",
            "From encoders of the sliders and noisy forces, speeds and accelerations included, the estimate is as good as with exact motion",
            "1 µm steps at 250 Hz, 2 N of noise: residual within 2 % of that with exact motion, base parameters to 10 %, circle below 0.5 N, both ways",
            json!({ "found": self.found.iter().map(numbers).collect::<Vec<_>>(), "exact_motion_circle": self.exact_circle, "exact_motion_rms": self.exact_rms }),
            format!(
                "{}; exact motion: residual {:.3} N, circle {:.2} N",
                self.found.iter().map(told).collect::<Vec<_>>().join("; "),
                self.exact_rms,
                self.exact_circle
            ),
            self.found
                .iter()
                .all(|m| (m.rms / self.exact_rms - 1.0).abs() <= 0.02 && m.base <= 0.1 && m.circle <= 0.5),
        )
    }
}
