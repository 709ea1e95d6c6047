//! The textbook route from a log to states, and the EMPS benchmark through its pieces.

#![expect(clippy::unwrap_used, reason = "helpers of tests")]

use std::io::Read;

use dynid_motion::clock::{ClockSettings, uniform};
use dynid_motion::filter::{Alignment, decimate, forward_backward};
use dynid_motion::textbook::{TextbookSettings, low_pass, states, textbook};
use dynid_motion::{Channel, JointSignals, Log, SignalError};
use dynid_testing::shared;

fn log_of(samples: usize, rate: f64, position: impl Fn(f64) -> f64) -> Log {
    let time: Vec<f64> = (0..samples).map(|n| n as f64 / rate).collect();
    let position: Vec<f64> = time.iter().map(|t| position(*t)).collect();
    let joint = JointSignals { name: "j".into(), effort: position.clone(), velocity: None, position };
    let temperature = Channel { name: "temperature".into(), values: vec![20.5; samples] };
    Log::new("log", time, vec![joint], vec![temperature]).unwrap()
}

/// At 0.5 Hz a 10 Hz zero-phase filter changes the amplitude by 6e-11 and central differences by (w h)^2 / 6.
#[test]
fn a_slow_sine_keeps_its_derivatives() {
    let (rate, w) = (500.0, std::f64::consts::PI);
    let grid = uniform(&log_of(5000, rate, |t| (w * t).sin()), &ClockSettings::default()).unwrap();
    let settings = TextbookSettings { decimation: Some(10), ..TextbookSettings::default() };
    let result = textbook(&grid, &settings).unwrap();
    assert!((result.rate_hz - 50.0).abs() < 1e-9);
    assert!((result.start - 1.0).abs() < 1e-12);
    let joint = &result.joints[0];
    assert_eq!(joint.effort.len(), 400);
    assert_eq!((result.usable.len(), result.channels[0].values.len()), (400, 400));
    for n in 0..400 {
        let (sin, cos) = (w * (result.start + n as f64 / result.rate_hz)).sin_cos();
        let smear = 2.0 * (w / rate).powi(2);
        assert!((joint.states.position[n] - sin).abs() < 1e-6);
        assert!((joint.states.velocity[n] - w * cos).abs() < w * smear);
        assert!((joint.states.acceleration[n] + w * w * sin).abs() < w * w * smear);
        assert!((result.channels[0].values[n] - 20.5).abs() < 1e-9);
    }
    let clean = TextbookSettings { anti_alias: true, ..settings };
    assert_eq!(textbook(&grid, &clean).unwrap().joints[0].effort.len(), 400);
}

#[test]
fn short_or_constant_logs_are_defined() {
    let settings = TextbookSettings::default();
    let rest = uniform(&log_of(3000, 500.0, |_| 0.7), &ClockSettings::default()).unwrap();
    let joint = &textbook(&rest, &settings).unwrap().joints[0];
    assert!(joint.states.velocity.iter().all(|v| v.abs() < 1e-8));
    let short = uniform(&log_of(40, 500.0, |t| t), &ClockSettings::default()).unwrap();
    assert!(matches!(textbook(&short, &settings), Err(SignalError::TooShort { expected: 1001, found: 40 })));
    let no_factor = TextbookSettings { decimation: Some(0), ..settings.clone() };
    assert!(matches!(textbook(&rest, &no_factor), Err(SignalError::Setting { .. })));
    let negative = TextbookSettings { trim_s: -1.0, ..settings };
    assert!(textbook(&rest, &negative).is_err());
}

fn emps() -> Option<[Vec<f64>; 2]> {
    let file = std::fs::File::open(shared("data/emps/emps_identification.csv.gz")?).unwrap();
    let mut text = String::new();
    flate2::read::GzDecoder::new(file).read_to_string(&mut text).unwrap();
    let mut columns = [vec![], vec![]];
    for record in csv::Reader::from_reader(text.as_bytes()).records() {
        let record = record.unwrap();
        columns[0].push(record[1].parse().unwrap());
        columns[1].push(35.15065188 * record[3].parse::<f64>().unwrap());
    }
    Some(columns)
}

/// Least squares by the normal equations of four well-scaled columns.
fn solve(columns: &[Vec<f64>; 4], right: &[f64]) -> [f64; 4] {
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(x, y)| x * y).sum::<f64>();
    let mut rows: [[f64; 5]; 4] = std::array::from_fn(|i| {
        std::array::from_fn(|j| dot(&columns[i], if j < 4 { &columns[j] } else { right }))
    });
    for pivot in 0..4 {
        for i in 0..4 {
            if i != pivot {
                let factor = rows[i][pivot] / rows[pivot][pivot];
                let eliminator = rows[pivot];
                for (x, p) in rows[i].iter_mut().zip(eliminator) {
                    *x -= factor * p;
                }
            }
        }
    }
    std::array::from_fn(|i| rows[i][4] / rows[i][i])
}

/// Janot, Gautier & Brunot 2019: 100 Hz, central differences, columns decimated by 10, least squares. Expected values
/// are those of the same pipeline in SciPy with MATLAB's alignment, printed to eight decimals; published (MATLAB's own
/// padding): 95.1089, 203.5034, 20.3935, -3.1648, 4.0834 %.
#[test]
fn emps_parameters_by_the_published_pipeline() {
    let Some([position, force]) = emps() else { return };
    let settings = TextbookSettings { cutoff_hz: 100.0, ..TextbookSettings::default() };
    let found = states(&position, 1000.0, &settings).unwrap();
    let sign: Vec<f64> = found.velocity.iter().map(|v| if *v == 0.0 { 0.0 } else { v.signum() }).collect();
    let one = vec![1.0; sign.len()];
    let columns = [found.acceleration, found.velocity, sign, one]
        .map(|column| decimate(&column[49..], 10, Alignment::Last).unwrap());
    let force = decimate(&force[49..], 10, Alignment::Last).unwrap();
    let parameters = solve(&columns, &force);
    let residual: f64 = (0..force.len())
        .map(|n| (force[n] - (0..4).map(|k| parameters[k] * columns[k][n]).sum::<f64>()).powi(2))
        .sum();
    let relative = (residual / force.iter().map(|f| f * f).sum::<f64>()).sqrt();
    println!("EMPS {parameters:?}, relative error {relative}");
    for (found, expected) in parameters.iter().zip([95.10188311, 203.09874714, 20.44161094, -3.18088173]) {
        assert!((found - expected).abs() < 1e-7, "{found} instead of {expected}");
    }
    assert!((relative - 0.0413928685).abs() < 1e-9);
    assert!(forward_backward(&low_pass(1000.0, &settings).unwrap(), &[0.0; 15]).is_err());
}
