//! The EMPS benchmark through filter, differences and decimation, as it was published.

#![expect(clippy::unwrap_used, reason = "helpers of tests")]

use std::io::Read;

use dynid_motion::difference::central;
use dynid_motion::filter::{Alignment, butterworth, decimate, forward_backward};
use dynid_testing::shared;

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
    let filter = butterworth(4, 100.0, 1000.0).unwrap();
    let velocity = central(&forward_backward(&filter, &position).unwrap(), 1000.0).unwrap();
    let acceleration = central(&velocity, 1000.0).unwrap();
    let sign: Vec<f64> = velocity.iter().map(|v| if *v == 0.0 { 0.0 } else { v.signum() }).collect();
    let one = vec![1.0; sign.len()];
    let columns = [acceleration, velocity, sign, one]
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
    assert!(forward_backward(&filter, &[0.0; 15]).is_err());
}
