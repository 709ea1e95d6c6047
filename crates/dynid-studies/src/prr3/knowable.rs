//! Rows a and b: what forces say with their uncertainty, and design values where they say nothing.

use dynid::estimators::load_friction::{
    CombinationValue, Design, DesignStatus, NearestDesign, PlanarBody, SeparatedFit, SignStatus, Verdict,
    nearest_to_design, verdicts,
};
use serde_json::json;

use super::fits::Fits;
use super::rank::Rank;
use super::settings::Settings;
use super::{fault, worst};
use crate::{Row, StudyError};

/// Standard deviations that an estimate may be off.
const SIGMAS: f64 = 4.0;

/// What the first set of noisy forces tells.
#[derive(Debug)]
pub(super) struct Knowable {
    pub(super) base: Vec<CombinationValue>,
    pub(super) base_truth: Vec<f64>,
    /// Of all parameters at the fit.
    pub(super) verdicts: Vec<Verdict>,
    pub(super) deviations: Vec<Option<f64>>,
    pub(super) near: NearestDesign,
    /// Residual of the fit and of the nearest to the design, N rms.
    pub(super) rms: [f64; 2],
}

pub(super) fn design(settings: &Settings) -> Result<Design, StudyError> {
    let values: Vec<f64> = settings.parameter.iter().map(|p| p.design).collect();
    let body = |b: &super::settings::BodyNames| {
        Ok(PlanarBody {
            name: b.name.clone(),
            mass: settings.place(&b.mass)?,
            moments: vec![settings.place(&b.moment)?],
            inertia: settings.place(&b.inertia)?,
            centre: vec![(0.0, b.length)],
        })
    };
    Ok(Design {
        scales: values.clone(),
        values,
        bodies: settings.body.iter().map(body).collect::<Result<_, StudyError>>()?,
        margin: settings.body_margin,
    })
}

impl Knowable {
    pub(super) fn new(settings: &Settings, rank: &Rank, fits: &Fits) -> Result<Self, StudyError> {
        let Some(batch) = fits.noisy.first() else { return Err(fault("no noisy forces")) };
        let fitted = &batch.fits[0];
        let theta = &fitted.fit.theta;
        let found = fitted.problem.identifiability(theta, None).map_err(fault)?;
        let truth = settings.truth();
        let near =
            nearest_to_design(&fitted.problem, &fits.bounds, theta, &design(settings)?).map_err(fault)?;
        let misfit = fitted.problem.sum_of_squares(&near.theta).map_err(fault)?;
        let base_truth = (0..rank.base.nrows())
            .map(|i| (0..rank.base.ncols()).map(|k| rank.base[(i, k)] * truth[k]).sum())
            .collect();
        Ok(Knowable {
            base: found.combinations(&rank.base).map_err(fault)?,
            base_truth,
            verdicts: verdicts(&fitted.problem, &fits.bounds, &found).map_err(fault)?,
            deviations: found.standard_deviations(),
            rms: [fitted.fit.rms, (misfit / fitted.rows()).sqrt()],
            near,
        })
    }

    /// Row a.
    pub(super) fn row(&self, settings: &Settings, fits: &Fits) -> Row {
        let off =
            |value: f64, truth: f64, std: Option<f64>| std.map_or(f64::NAN, |s| (value - truth).abs() / s);
        let base =
            self.base.iter().zip(&self.base_truth).map(|(b, t)| off(b.value, *t, b.std)).fold(0.0, worst);
        let (truth, count) = (settings.truth(), settings.parameter.len());
        let theta = &fits.noisy[0].fits[0].fit.theta;
        let friction =
            (count..truth.len()).map(|k| off(theta[k], truth[k], self.deviations[k])).fold(0.0, worst);
        let exist = self.near.central_inertias.iter().copied().fold(f64::INFINITY, f64::min);
        let change = self.rms[1] / self.rms[0] - 1.0;
        Row::new(
            "a",
            "Base parameters and friction come with standard deviations; where forces leave a choice, the values nearest to the design \
             belong to bodies that can exist, at no cost",
            "2 N of noise: 13 values within 4 standard deviations; fit unchanged along 2 free directions (1e-9), inertias about \
             centres of mass positive, bounds kept",
            json!({ "base_sigmas": base, "friction_sigmas": friction, "free_directions": self.near.free_directions,
                    "fit_change": change, "central_inertias": self.near.central_inertias, "distance": self.near.distance }),
            format!(
                "at most {base:.1} and {friction:.1} standard deviations; fit changed by {change:.0e} along {} directions, least \
                 inertia {exist:.2} kg m²",
                self.near.free_directions
            ),
            base <= SIGMAS
                && friction <= SIGMAS
                && self.near.status == DesignStatus::FreeDirections
                && change.abs() <= 1e-9
                && exist > 0.0
                && fits.bounds.contain(&self.near.theta),
        )
    }
}

/// Row b.
pub(super) fn separated_row(fits: &Fits) -> Row {
    let of = |b: &super::fits::Batch| b.separated.sum_of_squares / b.fits[0].fit.sum_of_squares - 1.0;
    let gaps: Vec<f64> = fits.noisy.iter().map(of).collect();
    let largest = gaps.iter().map(|g| g.abs()).fold(0.0, worst);
    let ended: Vec<String> = fits.noisy.iter().map(|b| how_signs_ended(&b.separated)).collect();
    let signs = fits.noisy.iter().map(|b| match b.separated.signs {
        SignStatus::Settled => json!({ "status": "settled", "rounds": b.separated.rounds }),
        SignStatus::Cycling { period, differing } => {
            json!({ "status": "cycling", "rounds": b.separated.rounds, "period": period, "differing": differing })
        }
        SignStatus::RoundLimit { differing } => {
            json!({ "status": "round_limit", "rounds": b.separated.rounds, "differing": differing })
        }
    });
    Row::new(
        "b",
        "For given μ_c, μ_s and v_s all else is linear: searching these three alone ends at the same J",
        "2 N of noise: J of both within 1e-6, however the signs of the normal forces end",
        json!({ "gaps": gaps, "signs": signs.collect::<Vec<_>>() }),
        format!("{largest:.0e} apart; signs {}", ended.join(", ")),
        largest <= 1e-6,
    )
}

/// How the rounds of signs ended, in words.
fn how_signs_ended(fit: &SeparatedFit) -> String {
    match fit.signs {
        SignStatus::Settled => format!("settled after {} rounds", fit.rounds),
        SignStatus::Cycling { period, differing } => {
            format!("of {differing} samples come back every {period} rounds")
        }
        SignStatus::RoundLimit { differing } => {
            format!("of {differing} samples still differ after {} rounds", fit.rounds)
        }
    }
}

/// A verdict in words.
pub(super) fn told(verdict: &Verdict, names: &[(&str, &str)]) -> String {
    match verdict {
        Verdict::Determined { std } => {
            std.map_or_else(|| "determined".to_owned(), |s| format!("determined, ± {s:.2e}"))
        }
        Verdict::NotEstimated => "no effect: not estimated".to_owned(),
        Verdict::AtBound { .. } => "at its bound".to_owned(),
        Verdict::OnlyInCombination { terms, sum } => {
            let term = |(k, f): &(usize, f64)| match *f {
                f if (f - 1.0).abs() < 1e-9 => format!("+ {}", names[*k].0),
                f => format!("{} {:.4} {}", if f < 0.0 { "-" } else { "+" }, f.abs(), names[*k].0),
            };
            let words = terms.iter().map(term).collect::<Vec<_>>().join(" ");
            let std = sum.std.map_or_else(String::new, |s| format!(" ± {s:.3}"));
            format!("only in {} = {:.3}{std}", words.trim_start_matches("+ "), sum.value)
        }
    }
}
