//! Estimates by the paper's regression, and what every estimate must obey.

use dynid::estimators::conditioning::{
    ConditioningSettings, PreparedLog, TextbookRoute, predict, reduce_textbook, textbook_rows,
};
use dynid::estimators::consistent::{
    Form, LinkPrior, Margin, Problem, ScalarPrior, Settings as ConsistentSettings, estimate,
};
use dynid::estimators::linear::{WlsSettings, wls};
use dynid::estimators::rows::row_residuals;
use dynid::estimators::{Factor, Mat};
use dynid::model::symmetric::least_eigenvalue;
use dynid::model::{BaseParameters, BaseSettings, EffortModel, Inertia, KnownElement, RobotModel};
use dynid::motion::filter::{butterworth, forward_backward};
use dynid::motion::signal::rms;

use super::robot::Indy7;
use super::settings::{PerJoint, Settings};
use super::{JOINTS, fault};
use crate::StudyError;

/// How much heavier than the robot file prior bodies are: feasibility must come from the data, not from the truth.
const PRIOR_SCALE: f64 = 1.3;

/// What an estimate must obey.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Constraints {
    pub(super) form: Form,
    /// Coulomb and viscous columns are not negative, even where they stand for errors of known friction.
    pub(super) friction_not_negative: bool,
}

/// Constraints of the paper.
pub(super) const PAPER: Constraints = Constraints { form: Form::SpatialInertia, friction_not_negative: true };
/// Bodies that can exist, errors of friction of any sign.
pub(super) const OURS: Constraints = Constraints { form: Form::PseudoInertia, friction_not_negative: false };

/// Margin of the paper's constraints.
const MARGIN: f64 = 1e-6;

/// An identified arm.
#[derive(Debug)]
pub(super) struct Identified {
    /// Model without free shape, known friction included.
    pub(super) model: RobotModel,
    /// All its linear parameters.
    pub(super) values: Vec<f64>,
}

impl Identified {
    /// The 40 inertial base values, in the order of Table A1.
    pub(super) fn base(&self, arm: &Indy7) -> Vec<f64> {
        arm.base_values(&standard_of(&self.model, &self.values))
    }

    /// RMSE per joint over the filtered, thinned rows of a log, N m.
    pub(super) fn rmse(&self, log: &PreparedLog, settings: &Settings) -> Result<PerJoint, StudyError> {
        let residuals = self.residuals(log, settings)?;
        Ok(std::array::from_fn(|j| rms(&residuals[j])))
    }

    /// Residuals per joint over those rows, N m.
    pub(super) fn residuals(
        &self,
        log: &PreparedLog,
        settings: &Settings,
    ) -> Result<Vec<Vec<f64>>, StudyError> {
        let all: Vec<usize> = (0..self.values.len()).collect();
        let rows = textbook_rows(
            &self.model,
            &[],
            &all,
            std::slice::from_ref(log),
            &route(settings, log.rate_hz),
            &ConditioningSettings::default(),
        )
        .map_err(fault)?;
        let residuals = row_residuals(&rows, &self.values).map_err(fault)?;
        Ok(residuals.into_iter().map(|g| g.residuals).collect())
    }
}

/// Error of a joint's prediction over a log, where prediction and measurement have passed the same low-pass filter.
#[derive(Debug)]
pub(super) struct Filtered {
    pub(super) position: Vec<f64>,
    pub(super) measured: Vec<f64>,
    pub(super) predicted: Vec<f64>,
}

impl Filtered {
    pub(super) fn error(&self) -> Vec<f64> {
        self.measured.iter().zip(&self.predicted).map(|(m, p)| m - p).collect()
    }
}

impl Identified {
    /// Per joint, prediction and measurement through the same low-pass filter, 50 a second: what friction does at a reversal
    /// then counts alike on both sides. States up to four times its cut-off; a second is cut from either end.
    pub(super) fn filtered(
        &self,
        log: &PreparedLog,
        settings: &Settings,
    ) -> Result<Vec<Filtered>, StudyError> {
        let cutoff = settings.simulation.cutoff_hz;
        let conditioning = ConditioningSettings::default();
        let predicted =
            predict(&self.model, &[], &self.values, log, 4.0 * cutoff, 0.0, &conditioning).map_err(fault)?;
        let filter = butterworth(4, cutoff, log.rate_hz).map_err(fault)?;
        let step = route(settings, log.rate_hz).factor(log);
        let cut = log.rate_hz as usize;
        let thin = |signal: &[f64]| -> Result<Vec<f64>, StudyError> {
            let smooth = forward_backward(&filter, signal).map_err(fault)?;
            Ok(smooth[cut..smooth.len() - cut].iter().step_by(step).copied().collect())
        };
        (0..JOINTS)
            .map(|joint| {
                Ok(Filtered {
                    position: thin(&log.position[joint])?,
                    measured: thin(&log.effort[joint])?,
                    predicted: thin(&predicted[joint])?,
                })
            })
            .collect()
    }

    /// RMSE per joint of [`Self::filtered`], N m.
    pub(super) fn filtered_rmse(
        &self,
        log: &PreparedLog,
        settings: &Settings,
    ) -> Result<PerJoint, StudyError> {
        let filtered = self.filtered(log, settings)?;
        Ok(std::array::from_fn(|j| rms(&filtered[j].error())))
    }
}

/// Ten parameters per link, then rotor inertias, out of the linear parameters of a model.
pub(super) fn standard_of(model: &RobotModel, values: &[f64]) -> Vec<f64> {
    let table = &model.parameters().linear;
    let mut out = values[..10 * JOINTS].to_vec();
    out.extend((1..=JOINTS).map(|j| {
        let name = format!("Ia{j}");
        table.iter().position(|p| p.symbol == name).map_or(0.0, |column| values[column])
    }));
    out
}

/// The paper's processing: zero-phase Butterworth at 10 Hz, 50 rows a second (every 80th sample at 4 kHz), a second cut from
/// either end.
fn route(settings: &Settings, rate_hz: f64) -> TextbookRoute {
    let simulation = &settings.simulation;
    let rows_hz = simulation.rate_hz / simulation.decimation as f64;
    TextbookRoute {
        cutoff_hz: simulation.cutoff_hz,
        decimation: Some((rate_hz / rows_hz).round() as usize),
        trim_s: 1.0,
        ..TextbookRoute::default()
    }
}

/// Weighted least squares on 58 base columns, then the nearest feasible parameters in the metric of the data. `known`:
/// friction that is taken off beforehand; none for the conventional estimate.
pub(super) fn regression(
    arm: &Indy7,
    known: Vec<KnownElement>,
    log: &PreparedLog,
    settings: &Settings,
    constraints: Constraints,
) -> Result<Identified, StudyError> {
    regression_of(arm, arm.regression().with_known(known), log, settings, constraints)
}

/// The regression for any model with friction columns.
pub(super) fn regression_of(
    arm: &Indy7,
    model: RobotModel,
    log: &PreparedLog,
    settings: &Settings,
    constraints: Constraints,
) -> Result<Identified, StudyError> {
    let base = BaseParameters::of(&model, &arm.mechanism, &[], &BaseSettings::default());
    let groups = reduce_textbook(
        &model,
        &[],
        &base.kept,
        std::slice::from_ref(log),
        &route(settings, log.rate_hz),
        &ConditioningSettings::default(),
    )
    .map_err(fault)?;
    let factors: Vec<Factor> = groups.iter().map(|g| g.merged(base.len())).collect();
    let weighted = wls(&factors, &WlsSettings::default()).factor;
    let values = feasible(arm, &model, &base, &weighted, constraints)?;
    Ok(Identified { model, values })
}

/// Standard parameters of least weighted residual among those that the constraints allow, and after them the changes of
/// shape parameters, if the rows have columns for such beyond the base parameters.
pub(super) fn feasible(
    arm: &Indy7,
    model: &RobotModel,
    base: &BaseParameters,
    weighted: &Factor,
    constraints: Constraints,
) -> Result<Vec<f64>, StudyError> {
    let table = &model.parameters().linear;
    let (linear, rows) = (table.len(), weighted.columns());
    let columns = linear + rows - base.len();
    let mut regrouping = Mat::zeros(rows, columns);
    for column in 0..linear {
        let mut unit = vec![0.0; linear];
        unit[column] = 1.0;
        for (row, value) in base.values(&unit).into_iter().enumerate() {
            regrouping[(row, column)] = value;
        }
    }
    for change in 0..columns - linear {
        regrouping[(base.len() + change, linear + change)] = 1.0;
    }
    let scalars = (10 * JOINTS..columns).map(|column| {
        let name =
            table.get(column).map_or_else(|| format!("change {}", column - linear), |p| p.name.clone());
        let symbol = name.rsplit('.').next().unwrap_or_default();
        let friction = constraints.friction_not_negative && ["fc", "fv"].contains(&symbol);
        ScalarPrior {
            column,
            prior: 0.0,
            scale: if column < linear { 10.0 } else { 1.0 },
            nonnegative: friction || ["Ia", "sigma1", "sigma2"].contains(&symbol),
            name,
        }
    });
    let problem = Problem {
        r: weighted.r_matrix() * regrouping,
        z: weighted.z(),
        links: links(arm),
        scalars: scalars.collect(),
        bounds: Vec::new(),
        equalities: Vec::new(),
        prior_std: vec![1.0; columns],
    };
    let margin = match constraints.form {
        Form::SpatialInertia => Margin::Absolute(MARGIN),
        Form::PseudoInertia => Margin::Relative(MARGIN),
    };
    let settings = ConsistentSettings { form: constraints.form, margin, ..ConsistentSettings::default() };
    Ok(estimate(&problem, &settings).map_err(fault)?.x)
}

pub(super) fn links(arm: &Indy7) -> Vec<LinkPrior> {
    let bodies = arm.mechanism.bodies().iter().enumerate();
    bodies
        .map(|(b, body)| LinkPrior {
            name: body.name.clone(),
            first_column: 10 * b,
            prior: Inertia(body.inertia.0.map(|x| PRIOR_SCALE * x)),
        })
        .collect()
}

/// Least eigenvalues over all links of `B_L` and of the pseudo-inertia.
pub(super) fn margins(values: &[f64]) -> [f64; 2] {
    let mut least = [f64::INFINITY; 2];
    for ten in values[..10 * JOINTS].chunks_exact(10) {
        let [m, x, y, z, xx, xy, xz, yy, yz, zz] = std::array::from_fn(|k| ten[k]);
        let half = 0.5 * (xx + yy + zz);
        let pseudo =
            [[half - xx, -xy, -xz, x], [-xy, half - yy, -yz, y], [-xz, -yz, half - zz, z], [x, y, z, m]];
        let spatial = [
            [xx, xy, xz, 0.0, -z, y],
            [xy, yy, yz, z, 0.0, -x],
            [xz, yz, zz, -y, x, 0.0],
            [0.0, z, -y, m, 0.0, 0.0],
            [-z, 0.0, x, 0.0, m, 0.0],
            [y, -x, 0.0, 0.0, 0.0, m],
        ];
        least[0] = least[0].min(least_eigenvalue(&spatial));
        least[1] = least[1].min(least_eigenvalue(&pseudo));
    }
    least
}
