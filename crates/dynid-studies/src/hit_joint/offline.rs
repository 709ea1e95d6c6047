//! Batch identification: the paper's nested models from rows on the joint's side.

use dynid::estimators::Factor;
use dynid::estimators::groups::ReducedGroup;
use dynid::estimators::linear::{
    LinearEstimate, LinearMethod, LinearSettings, TlsNoise, VarianceSharing, estimate,
};
use dynid::estimators::rows::{GroupShape, MemoryRows, Rows, reduce_rows};
use dynid::model::{EffortModel, RobotModel};

use super::fault;
use super::joint::{Damping, LINK, MOTOR, identified};
use super::measurement::Signals;
use super::settings::Settings;
use crate::StudyError;

/// Length of a time block of the jackknife, s.
const BLOCK_S: f64 = 2.0;

/// Which rows are used.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Equations {
    /// The motor's, times the ratio.
    Input,
    /// The link's.
    Output,
    /// Both, row by row.
    Both,
    /// Half the sum of both, in which the motor's torque and the sensor's reading stand on one side.
    Coupled,
}

/// Rows of one equation of a cruise, column after column, on the joint's side: effort over torque.
struct Equation {
    columns: Vec<usize>,
    regressor: Vec<f64>,
    effort: Vec<f64>,
}

fn equation(settings: &Settings, model: &RobotModel, signals: &Signals, which: Equations) -> Equation {
    let block = signals.regressor(settings, model);
    let n = signals.len();
    let half = if which == Equations::Coupled { 0.5 } else { 1.0 };
    // The link's row is that of the negative reading.
    let mut parts: Vec<(usize, f64)> = Vec::new();
    if which != Equations::Output {
        parts.push((MOTOR, half * settings.ratio));
    }
    if which != Equations::Input {
        parts.push((LINK, -half));
    }
    let mut columns: Vec<usize> =
        parts.iter().flat_map(|(output, _)| model.layout().columns(*output)).copied().collect();
    columns.sort_unstable();
    columns.dedup();
    let mut out = Equation { regressor: vec![0.0; n * columns.len()], effort: vec![0.0; n], columns };
    for (output, factor) in parts {
        for (k, column) in model.layout().columns(output).iter().enumerate() {
            let place = out.columns.iter().position(|c| c == column).unwrap_or_default();
            let to = &mut out.regressor[place * n..][..n];
            to.iter_mut().zip(block.column(output, k)).for_each(|(to, from)| *to += factor * from);
        }
        let reading =
            if output == MOTOR { (&signals.motor_torque, 1.0) } else { (&signals.link_torque, -1.0) };
        let known = block.offset(output).iter().zip(reading.0);
        out.effort.iter_mut().zip(known).for_each(|(to, (o, y))| *to += factor * (reading.1 * y - o));
    }
    out
}

/// Factors of a model's rows over all cruises, a log each, in time blocks.
pub(super) fn groups(
    settings: &Settings,
    model: &RobotModel,
    cruises: &[Signals],
    which: Equations,
) -> Result<Vec<ReducedGroup>, StudyError> {
    let per_block = (BLOCK_S * settings.programme.decimated_rate_hz()).round() as usize;
    let equations = match which {
        Equations::Both => vec![Equations::Input, Equations::Output],
        one => vec![one],
    };
    let mut rows = MemoryRows::new();
    for (log, signals) in cruises.iter().enumerate() {
        let samples: Vec<usize> = (0..signals.len()).collect();
        let blocks = (signals.len() / per_block).max(1);
        for (output, which) in equations.iter().enumerate() {
            let Equation { columns, regressor, effort } = equation(settings, model, signals, *which);
            let group = rows.add_group(GroupShape { log, output, scale: 0, columns, blocks });
            for block in 0..blocks {
                let end = if block + 1 == blocks { signals.len() } else { (block + 1) * per_block };
                let from = block * per_block;
                rows.push(
                    group,
                    &Rows {
                        block,
                        samples: &samples[from..end],
                        regressor: &regressor[from..],
                        stride: signals.len(),
                        effort: &effort[from..end],
                    },
                );
            }
        }
    }
    reduce_rows(&rows).map_err(fault)
}

/// All rows of the full model merged.
pub(super) fn factor(settings: &Settings, cruises: &[Signals]) -> Result<Factor, StudyError> {
    let model = identified(settings, Damping::Full, false);
    let total = model.parameters().linear.len();
    let factors: Vec<Factor> =
        groups(settings, &model, cruises, Equations::Both)?.iter().map(|group| group.merged(total)).collect();
    Ok(Factor::merge(&factors.iter().collect::<Vec<_>>()))
}

/// An estimate of a nested model: `(damping, rows, estimator)`, the motor's inertia neglected unless said.
pub(super) fn fit(
    settings: &Settings,
    cruises: &[Signals],
    damping: Damping,
    which: Equations,
    method: &LinearMethod,
) -> Result<LinearEstimate, StudyError> {
    fit_model(settings, &identified(settings, damping, false), cruises, which, method)
}

/// Fits any model of the joint.
pub(super) fn fit_model(
    settings: &Settings,
    model: &RobotModel,
    cruises: &[Signals],
    which: Equations,
    method: &LinearMethod,
) -> Result<LinearEstimate, StudyError> {
    let groups = groups(settings, model, cruises, which)?;
    let sharing = LinearSettings { sharing: VarianceSharing::Joint, ..LinearSettings::default() };
    Ok(estimate(&groups, None, model.parameters().linear.len(), method, &sharing)?)
}

/// Values that rows of this kind see, in column order.
pub(super) fn seen(estimate: &LinearEstimate) -> Vec<f64> {
    estimate.kept_x()
}

/// Tables I to III on one set of cruises.
#[derive(Debug, Clone)]
pub(super) struct Tables {
    /// Without damping: input row, output row, both coupled.
    pub(super) none: [Vec<f64>; 3],
    /// With Coulomb friction: input row, output row.
    pub(super) coulomb: [Vec<f64>; 2],
    /// With viscous friction as well, both rows.
    pub(super) full: LinearEstimate,
}

impl Tables {
    pub(super) fn new(settings: &Settings, cruises: &[Signals]) -> Result<Self, StudyError> {
        use Equations::{Both, Coupled, Input, Output};
        let one = |damping, which| -> Result<Vec<f64>, StudyError> {
            Ok(seen(&fit(settings, cruises, damping, which, &LinearMethod::Ols)?))
        };
        Ok(Tables {
            none: [one(Damping::None, Input)?, one(Damping::None, Output)?, one(Damping::None, Coupled)?],
            coulomb: [one(Damping::Coulomb, Input)?, one(Damping::Coulomb, Output)?],
            full: fit(settings, cruises, Damping::Full, Both, &LinearMethod::Ols)?,
        })
    }
}

/// Errors of the columns and efforts as total least squares take them: independent, alike in all rows. Those of `Δ³` are
/// neither, nor are those of `Δ` in the two rows.
pub(super) fn stated_noise(settings: &Settings, cruises: &[Signals], deformation: f64) -> TlsNoise {
    let noise = &settings.noise;
    let all = cruises.iter().flat_map(|c| &c.deformation);
    let (count, sum) = all.fold((0.0, 0.0), |(n, s), d| (n + 1.0, s + (3.0 * d * d).powi(2)));
    let cubed = deformation * (sum / f64::max(count, 1.0)).sqrt();
    let motor = settings.ratio * noise.motor_speed;
    TlsNoise {
        columns: vec![deformation, cubed, motor, 0.0, noise.link_speed, 0.0],
        // One figure for both rows: the mean of squares.
        effort: (0.5 * ((settings.ratio * noise.motor_torque).powi(2) + noise.link_torque.powi(2))).sqrt(),
    }
}
