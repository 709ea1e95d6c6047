//! The design problem: limits of joints, and what a design is worth.

use super::JOINTS;
use super::parameters::Parameters;
use super::pointing::Pointing;
use super::pointing::acting;
use super::settings::Settings;
use crate::StudyError;
use crate::excitation::Excitation;
use dynid::excitation::Problem;
use dynid::excitation::RobotExcitation;
use dynid::excitation::StartConditions;
use dynid::excitation::criterion::Criterion;
use dynid::excitation::criterion::Measure;
use dynid::excitation::information;
use dynid::model::BaseParameters;
use dynid::model::BaseSettings;
use dynid::model::RobotModel;

/// Instants of a period on which limits are checked.
pub(super) const FINE: usize = 8000;

/// The search for a trajectory from rest to rest at zero that shows the 8 columns of the ideal model.
pub(super) fn problem(
    pointing: &Pointing,
    settings: &Settings,
    base_frequency: f64,
    criterion: Criterion,
) -> Result<Problem, StudyError> {
    let mechanism = pointing.mechanism();
    let excitation = Excitation {
        mechanism,
        base: base_frequency,
        samples: settings.samples,
        acceleration: &settings.acceleration,
        regions: &[],
        nominal: (pointing.model.clone(), Vec::new(), pointing.linear_of(&Parameters::of(mechanism)?)),
    };
    let base = BaseParameters::of(pointing.model.as_ref(), mechanism, &[], &BaseSettings::default());
    let acting = acting(pointing, &base);
    let columns = base.kept.iter().zip(acting).filter(|(_, acts)| *acts).map(|(column, _)| *column);
    let shown = RobotExcitation::of_columns(pointing.model.clone(), Vec::new(), columns.collect());
    Ok(Problem {
        model: Box::new(shown),
        start: StartConditions { rest: true, pose: Some(vec![0.0; JOINTS]), ..StartConditions::default() },
        criterion,
        samples: settings.samples,
        ..excitation.problem(RobotModel::new(mechanism.clone(), Vec::new()))?
    })
}

/// Condition numbers of a trajectory: of columns in SI units, and of columns of unit length.
pub(super) fn conditions(problem: &Problem, rows: &[Vec<f64>], samples: usize) -> [f64; 2] {
    let triangle = information(problem, rows, samples);
    [Criterion::raw(Measure::Condition), Criterion::unit_norm(Measure::Condition)]
        .map(|criterion| criterion.value(&triangle).map_or(f64::INFINITY, f64::exp))
}
