//! Signs of reactions that no solution keeps.

use dynid_friction::load_friction::{
    DriveRows, FitSettings, Model, Problem, Record, Settings, SignStatus, fit_separated,
};
use dynid_linalg::Mat;
use dynid_search::Bounds;

/// Effort `(1, -1, 0)`, regressor `(1, 0, 0)` and friction `(0, ±2, 0)`: with either sign of the reaction the least squares have the
/// other one.
#[test]
fn signs_that_cycle_end_as_a_status_with_the_best_round() {
    let column = |values: [f64; 3]| Mat::from_fn(3, 1, |i, _| values[i]);
    let drive = DriveRows {
        regressor: column([1.0, 0.0, 0.0]),
        reactions: vec![column([0.0, 20.0, 0.0])],
        weight: Vec::new(),
        speed: vec![1e-3, 1e-3, 1.0],
    };
    let record = Record::new(vec![drive]).unwrap();
    let law = Settings { model: Model::CoulombViscous, ..Settings::default() };
    let problem = Problem::new(record, &[vec![1.0, -1.0, 0.0]], law).unwrap();
    // φ, μ_c (0.1, so that 20 φ μ_c = 2 φ), f_v, μ_s, v_s.
    let start = [1.0, 0.1, 0.0, 0.1, 0.1];
    let bounds =
        Bounds::new(vec![-10.0, 0.1, -10.0, 0.1, 0.1], vec![10.0, 0.1 + 1e-9, 10.0, 0.2, 0.2]).unwrap();
    let found = fit_separated(&problem, &bounds, &start, &FitSettings::default()).unwrap();
    assert_eq!(found.signs, SignStatus::Cycling { period: 2, differing: 1 }, "{found:?}");
    assert_eq!(found.rounds, 2);
    // φ = -1/5 leaves 1.2² + 1.4², φ = 3/5 leaves 0.4² + 2.2².
    assert!((found.theta[0] + 0.2).abs() < 1e-3, "{found:?}");
    assert!((found.sum_of_squares - 3.4).abs() < 0.01, "{found:?}");
    let limit = FitSettings { max_rounds: 1, ..FitSettings::default() };
    let found = fit_separated(&problem, &bounds, &start, &limit).unwrap();
    assert_eq!(found.signs, SignStatus::RoundLimit { differing: 1 });
}
