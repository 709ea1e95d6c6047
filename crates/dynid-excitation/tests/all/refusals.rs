//! Problems that cannot be posed are refused with what is wrong.

use crate::problems;
use dynid_excitation::criterion::{ColumnScaling, Criterion, Measure};
use dynid_excitation::*;
use dynid_linalg::Mat;

/// What is wrong with a problem.
type Change = Box<dyn FnOnce(&mut Problem)>;

fn refusal(change: impl FnOnce(&mut Problem)) -> String {
    let mut problem = problems::gantry();
    change(&mut problem);
    let settings = Settings { starts: 1, ..Settings::default() };
    match design(&problem, &settings, Vec::new(), &mut |_| {}) {
        Err(why) => why.to_string(),
        Ok(outcome) => panic!("{outcome:?}"),
    }
}

#[test]
fn trajectories_to_set_out_from() {
    let problem = problems::gantry();
    let refusal = |from: Vec<Vec<f64>>| {
        let settings = Settings { starts: 1, from: Some(from), ..Settings::default() };
        design(&problem, &settings, Vec::new(), &mut |_| {}).err().map(|why| why.to_string())
    };
    let row = vec![0.0; 1 + 2 * problem.harmonics];
    let wrong = [
        ("trajectory to set out from: expected 4 entries, found 3", vec![row.clone(); 3]),
        ("coefficients to set out from: expected 11 entries, found 2", vec![vec![0.0; 2]; 4]),
        ("to set out from: expected a finite number", vec![vec![f64::NAN; row.len()]; 4]),
    ];
    for (expected, from) in wrong {
        let why = refusal(from).unwrap_or_default();
        assert!(why.contains(expected), "{why}");
    }
}

#[test]
fn sizes_and_numbers() {
    let nan = f64::NAN;
    let cases: Vec<(&str, Change)> = vec![
        ("coordinates: expected 4 entries, found 3", Box::new(|p| p.coordinates.truncate(3))),
        ("limits: expected 4 entries, found 3", Box::new(|p| p.limits.truncate(3))),
        ("output weights: expected 4 entries, found 3", Box::new(|p| p.output_weights.truncate(3))),
        ("start pose: expected 4 entries, found 1", Box::new(|p| p.start.pose = Some(vec![0.0]))),
        ("start pose of j2", Box::new(move |p| p.start.pose = Some(vec![0.0, nan, 0.0, 0.0]))),
        ("prior information", Box::new(|p| p.prior = Some(Mat::zeros(3, 3)))),
        (
            "prior information",
            Box::new(move |p| {
                let n = p.model.columns().len();
                p.prior = Some(Mat::from_fn(n, n, |i, _| if i == 1 { nan } else { 0.0 }));
            }),
        ),
        ("base frequency", Box::new(move |p| p.base = nan)),
        ("base frequency", Box::new(|p| p.base = -1.0)),
        ("width of the smoothed sign", Box::new(|p| p.sign_width = 0.0)),
        ("effective samples", Box::new(move |p| p.effective_samples = f64::INFINITY)),
        ("output weight", Box::new(|p| p.output_weights[2] = 0.0)),
        ("harmonics", Box::new(|p| p.harmonics = 0)),
        (
            "harmonics",
            Box::new(|p| {
                p.harmonics = 1;
                p.start.rest = true;
            }),
        ),
        ("samples of a period", Box::new(|p| p.samples = 3)),
        ("samples of a period", Box::new(|p| p.samples = 1_000_000_000)),
        (
            "rows of the search's grid",
            Box::new(|p| {
                p.harmonics = 1;
                p.samples = 4;
            }),
        ),
        ("position range of j3", Box::new(|p| p.limits[2].position = (1.0, 1.0))),
        ("position range of j3", Box::new(move |p| p.limits[2].position.0 = nan)),
        ("velocity limit of j1", Box::new(|p| p.limits[0].velocity = 0.0)),
        ("acceleration limit of j1", Box::new(move |p| p.limits[0].acceleration = nan)),
        ("jerk limit of j4", Box::new(|p| p.limits[3].jerk = -2.0)),
        ("weights of the trace", Box::new(|p| p.criterion = Criterion::raw(Measure::Trace(vec![1.0])))),
        (
            "weight of the trace",
            Box::new(|p| {
                let mut weights = vec![1.0; p.model.columns().len()];
                weights[1] = -1.0;
                p.criterion = Criterion::raw(Measure::Trace(weights));
            }),
        ),
        (
            "weight of the trace",
            Box::new(|p| {
                p.criterion = Criterion::raw(Measure::Trace(vec![0.0; p.model.columns().len()]));
            }),
        ),
        (
            "columns of the combinations",
            Box::new(|p| {
                p.criterion = Criterion::raw(Measure::Largest { of: Mat::zeros(1, 1), order: 4.0 });
            }),
        ),
        (
            "entry of a combination",
            Box::new(move |p| {
                let of = Mat::from_fn(1, p.model.columns().len(), |_, _| nan);
                p.criterion = Criterion::raw(Measure::Largest { of, order: 4.0 });
            }),
        ),
        (
            "combinations",
            Box::new(|p| {
                let of = Mat::zeros(0, p.model.columns().len());
                p.criterion = Criterion::raw(Measure::Largest { of, order: 4.0 });
            }),
        ),
        (
            "order of the largest deviation",
            Box::new(|p| {
                let of = Mat::zeros(1, p.model.columns().len());
                p.criterion = Criterion::raw(Measure::Largest { of, order: 0.5 });
            }),
        ),
        (
            "column scale",
            Box::new(|p| {
                let scale = vec![0.0; p.model.columns().len()];
                p.criterion =
                    Criterion { measure: Measure::Determinant, scaling: ColumnScaling::Given(scale) };
            }),
        ),
        (
            "weight of the condition number",
            Box::new(move |p| {
                p.criterion =
                    Criterion::raw(Measure::ConditionAndSmallest { condition: -1.0, smallest: 1.0 });
            }),
        ),
    ];
    for (wanted, change) in cases {
        let found = refusal(change);
        assert!(found.starts_with(wanted), "{found:?} instead of {wanted:?}");
    }
    let problem = problems::gantry();
    let none = Settings { starts: 0, ..Settings::default() };
    assert!(design(&problem, &none, Vec::new(), &mut |_| {}).is_err());
    let last = Settings { starts: 3, seed: u64::MAX - 1, ..Settings::default() };
    assert!(design(&problem, &last, Vec::new(), &mut |_| {}).is_err());
}

#[test]
fn columns_that_no_motion_tells_apart_are_named() {
    let why = refusal(|p| {
        let robot = problems::gantry_robot();
        // Masses: those of the first two slides differ in the rows they act on, all above the second act alike.
        let columns = vec![0, 10, 20];
        p.model = Box::new(RobotExcitation::of_columns(robot.model.clone(), Vec::new(), columns));
        p.criterion = Criterion::raw(Measure::Condition);
    });
    assert!(why.contains("link2.m, link3.m"), "{why}");
    assert!(!why.contains("link1"), "{why}");
    let why = refusal(|p| {
        let robot = problems::gantry_robot();
        p.model = Box::new(RobotExcitation::of_columns(robot.model.clone(), Vec::new(), vec![0, 1]));
    });
    assert!(why.contains("link1.mx") && !why.contains("link1.m,"), "{why}");
}
