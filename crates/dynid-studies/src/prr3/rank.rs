//! Row B6: what forces tell about Table 1.

use dynid::estimators::Mat;
use dynid::estimators::load_friction::{DriveRows, Identifiability, Problem, Record, Settings as Law};
use serde_json::json;

use super::experiment::Experiment;
use super::machine::{Machine, Plane};
use super::reference::{self, IdentifiabilityReference};
use super::settings::Settings;
use super::{fault, trajectory, worst};
use crate::{Row, StudyError};

/// Samples of the reference's singular values.
const SAMPLES: usize = 400;

/// What the reference trajectory determines.
#[derive(Debug)]
pub(super) struct Rank {
    /// Of all parameters, at the true ones.
    pub(super) whole: Identifiability,
    /// Base parameters as sums of Table 1's.
    pub(super) base: Mat,
    /// Free directions of all parameters with the mass of a slider, or of the platform, changed by one and the other held.
    pub(super) free: Vec<Vec<f64>>,
    /// Ranks of the columns of forces without friction.
    inertial: usize,
    null: [f64; 2],
    singular: f64,
    tolerance: f64,
    expected: usize,
    base_error: f64,
}

/// `matrix` with rows over the inertial parameters.
fn base_matrix(reference: &IdentifiabilityReference) -> Mat {
    let rows = &reference.base_matrix;
    Mat::from_fn(rows.len(), rows.first().map_or(0, |r| r.len()), |i, k| rows[i][k])
}

impl Rank {
    pub(super) fn new(machine: &Machine, settings: &Settings) -> Result<Self, StudyError> {
        let reference = reference::identifiability()?;
        let motion = trajectory::identification_motion(settings, SAMPLES)?;
        let record = machine.record(&motion, Plane::Horizontal)?;
        let truth = settings.truth();
        let mut null = [0.0, 0.0];
        for direction in reference.null_directions() {
            for drive in record.drives() {
                for (largest, matrix) in null.iter_mut().zip([&drive.regressor, &drive.reactions[0]]) {
                    for k in 0..matrix.nrows() {
                        let sum: f64 = matrix.row(k).zip(&direction).map(|(w, d)| w * d).sum();
                        *largest = worst(*largest, sum.abs());
                    }
                }
            }
        }
        let experiment = Experiment::new(record.clone(), &truth, 0.0, 0)?;
        let whole = experiment.problem(Law::default())?.identifiability(&truth, None).map_err(fault)?;

        // Without friction only the viscous coefficient remains beside the inertial columns.
        let bare = |d: &DriveRows| DriveRows { reactions: Vec::new(), weight: Vec::new(), ..d.clone() };
        let bare = Record::new(record.drives().iter().map(bare).collect()).map_err(fault)?;
        let bare = Problem::new(bare, &experiment.efforts, Law::default()).map_err(fault)?;
        let count = settings.parameter.len();
        let mut frictionless = truth.clone();
        frictionless[count..count + 3].fill(0.0);
        let inertial = bare.identifiability(&frictionless, None).map_err(fault)?.rank - 1;

        let share = |(found, expected): (&f64, &f64)| (found / expected - 1.0).abs();
        let base = base_matrix(&reference);
        let values = whole.combinations(&base).map_err(fault)?;
        let base_error = values.iter().zip(&reference.base_values).map(|(v, e)| (v.value - e).abs());
        let pivots = [settings.place("m_s")?, settings.place("m_p")?];
        Ok(Rank {
            singular: whole
                .singular_values
                .iter()
                .zip(&reference.singular_values)
                .take(reference.rank)
                .map(share)
                .fold(0.0, worst),
            base_error: base_error.fold(0.0, worst),
            free: directions(&whole.null_directions, pivots)?,
            expected: reference.rank,
            tolerance: reference.tolerance_rel,
            inertial,
            null,
            base,
            whole,
        })
    }

    /// Row B6.
    pub(super) fn row(&self, settings: &Settings) -> Row {
        let alone: Vec<&str> = settings
            .names()
            .iter()
            .zip(&self.whole.determined)
            .filter(|(_, d)| **d)
            .map(|((name, _), _)| *name)
            .collect();
        let inertial_none = alone.iter().all(|name| settings.place(name).is_err());
        Row::new(
            "B6",
            "Forces determine 9 combinations of the 13 inertial parameters, with the weight's friction 11, and the four friction \
             parameters: Table 1's values are not determined one by one",
            "ranks 9 and 15; the four null directions leave τ and the normal forces unchanged to 1e-9; singular values of the \
             reference to 2 %",
            json!({ "inertial_rank": self.inertial, "rank": self.whole.rank, "gap": self.whole.gap,
                    "null_effort": self.null[0], "null_reaction": self.null[1],
                    "singular_values": self.singular, "base_values": self.base_error, "determined_alone": alone }),
            format!(
                "{} and {}; {:.1e} and {:.1e} N; singular values {:.2} %; determined one by one: {}",
                self.inertial,
                self.whole.rank,
                self.null[0],
                self.null[1],
                100.0 * self.singular,
                alone.join(", ")
            ),
            self.inertial == 9
                && self.whole.rank == self.expected
                && self.null.iter().all(|n| *n <= 1e-9)
                && self.singular <= self.tolerance
                && self.base_error <= 1e-9
                && inertial_none,
        )
    }

    /// The free directions in words.
    pub(super) fn free_in_words(&self, settings: &Settings) -> Vec<String> {
        let names = settings.names();
        let told = |direction: &Vec<f64>| {
            let terms = direction.iter().zip(&names).filter(|(d, _)| d.abs() > 1e-6);
            let term = |(d, (name, unit)): (&f64, &(&str, &str))| format!("{name} {d:+.3} {unit}");
            terms.map(term).collect::<Vec<_>>().join(", ")
        };
        self.free.iter().map(told).collect()
    }
}

/// The two columns of a null space, combined so that one pivot is 1 and the other 0.
fn directions(null: &Mat, pivots: [usize; 2]) -> Result<Vec<Vec<f64>>, StudyError> {
    if null.ncols() != 2 {
        return Err(fault(format!("{} free directions, expected 2", null.ncols())));
    }
    let at = |pivot: usize, column: usize| null[(pivots[pivot], column)];
    let determinant = at(0, 0) * at(1, 1) - at(0, 1) * at(1, 0);
    let [first, second] = [[at(1, 1), -at(1, 0)], [-at(0, 1), at(0, 0)]];
    let combined = |factors: [f64; 2]| {
        (0..null.nrows())
            .map(|k| (factors[0] * null[(k, 0)] + factors[1] * null[(k, 1)]) / determinant)
            .collect()
    };
    Ok(vec![combined(first), combined(second)])
}
