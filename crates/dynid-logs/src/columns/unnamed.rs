//! Columns of a log without a header, told from their numbers.

use super::{ColumnNames, MappingError, MappingSpec, SignalSpec};
use crate::csv::Table;

/// Least correlation of velocities with the slopes of positions.
const AGREES: f64 = 0.9;
/// Least ratio of the two, and its inverse the most.
const RATIO: f64 = 0.5;
/// Stretches over which slopes are taken, at least.
const STRETCHES: usize = 500;

/// Columns of a log without a header, as blocks of one column per joint behind the time.
///
/// There must be `1 + 3 n` columns of which the first advances, and one block must be the rate of another: these are positions
/// and velocities, the third is the effort. Positions may not be a rate as well, nor the effort a rate of the velocities. Nothing else is told from numbers alone, since it might as well be
/// something else.
///
/// # Errors
/// [`MappingError::Unnamed`].
pub fn columns_of_unnamed(table: &Table, joints: usize) -> Result<MappingSpec, MappingError> {
    let columns = table.columns.len();
    let refused = |reason: String| Err(MappingError::Unnamed { columns, joints, reason });
    if columns != 1 + 3 * joints {
        return refused(format!(
            "time, positions, velocities and efforts of {joints} joints are {} columns",
            1 + 3 * joints
        ));
    }
    let time = &table.columns[0];
    if time.len() < 20 || time.windows(2).any(|w| w[1].is_nan() || w[1] <= w[0]) {
        return refused("the first column does not advance in every row".to_owned());
    }
    let block = |k: usize| &table.columns[1 + k * joints..1 + (k + 1) * joints];
    let pairs: Vec<(usize, usize)> = (0..3)
        .flat_map(|of| (0..3).map(move |rate| (of, rate)))
        .filter(|(of, rate)| of != rate && is_rate(time, block(*of), block(*rate)))
        .collect();
    let [(position, velocity)] = pairs.as_slice() else {
        return refused(match pairs.len() {
            0 => "no block of columns is the rate of another".to_owned(),
            _ => "several blocks of columns are rates of others: these may be positions, velocities and accelerations".to_owned(),
        });
    };
    let effort = 3 - position - velocity;
    let names = |k: usize| {
        let list = (0..joints).map(|j| table.header[1 + k * joints + j].clone()).collect();
        Some(SignalSpec::Names(ColumnNames::List(list)))
    };
    Ok(MappingSpec {
        time: Some(SignalSpec::Names(ColumnNames::Pattern(table.header[0].clone()))),
        position: names(*position),
        velocity: names(*velocity),
        effort: names(effort),
        ..MappingSpec::default()
    })
}

/// True if every column of a block goes with the slope of its column in another. The unit of the time is not known yet, so
/// that the ratio may be any power of 1000, the same for all.
fn is_rate(time: &[f64], of: &[Vec<f64>], rate: &[Vec<f64>]) -> bool {
    let mut powers = of.iter().zip(rate).map(|(q, v)| {
        let (mut vv, mut dd, mut vd) = (0.0, 0.0, 0.0);
        // Over several rows, lest the steps of an encoder hide the speed.
        let lag = (time.len() / STRETCHES).max(1);
        for k in (lag..time.len()).step_by(lag) {
            let slope = (q[k] - q[k - lag]) / (time[k] - time[k - lag]);
            let mean = v[k - lag..=k].iter().sum::<f64>() / (lag + 1) as f64;
            (vv, dd, vd) = (vv + mean * mean, dd + slope * slope, vd + mean * slope);
        }
        let ratio = (vv / dd).sqrt();
        let power = (ratio.log10() / 3.0).round();
        let near = ratio / 10f64.powf(3.0 * power);
        (vd > AGREES * (vv * dd).sqrt() && (RATIO..=1.0 / RATIO).contains(&near)).then_some(power)
    });
    let Some(Some(first)) = powers.next() else { return false };
    powers.all(|power| power == Some(first))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Blocks of two joints over 4 s.
    fn table(blocks: [[&dyn Fn(f64) -> f64; 2]; 3], scale: f64) -> Table {
        let time: Vec<f64> = (0..400).map(|k| 0.01 * f64::from(k)).collect();
        let mut columns = vec![time.iter().map(|t| scale * t).collect::<Vec<f64>>()];
        columns.extend(blocks.as_flattened().iter().map(|signal| time.iter().map(|t| signal(*t)).collect()));
        Table {
            source: String::new(),
            header: (1..=columns.len()).map(|k| format!("column{k}")).collect(),
            origin: vec![0; columns.len()],
            rows: 400,
            first_row: 1,
            sha256: String::new(),
            columns,
        }
    }

    const POSITION: [&dyn Fn(f64) -> f64; 2] = [&|t| t.sin(), &|t| (1.7 * t).sin()];
    const VELOCITY: [&dyn Fn(f64) -> f64; 2] = [&|t| t.cos(), &|t| 1.7 * (1.7 * t).cos()];
    const ACCELERATION: [&dyn Fn(f64) -> f64; 2] = [&|t| -t.sin(), &|t| -2.89 * (1.7 * t).sin()];
    const LOAD: [&dyn Fn(f64) -> f64; 2] = [&|t| 3.0 + (0.3 * t).cos(), &|t| (5.0 * t).sin()];

    #[test]
    fn positions_are_what_velocities_are_the_rates_of() {
        for scale in [1.0, 1e9] {
            let spec = columns_of_unnamed(&table([LOAD, POSITION, VELOCITY], scale), 2).unwrap();
            let list = |names: [&str; 2]| {
                Some(SignalSpec::Names(ColumnNames::List(names.map(str::to_owned).to_vec())))
            };
            assert_eq!(spec.position, list(["column4", "column5"]));
            assert_eq!(spec.velocity, list(["column6", "column7"]));
            assert_eq!(spec.effort, list(["column2", "column3"]));
        }
    }

    #[test]
    fn what_numbers_do_not_tell_is_refused() {
        for blocks in [
            // No velocities; accelerations in place of efforts; other numbers of joints.
            [POSITION, LOAD, ACCELERATION],
            [POSITION, VELOCITY, ACCELERATION],
        ] {
            assert!(columns_of_unnamed(&table(blocks, 1.0), 2).is_err());
        }
        assert!(columns_of_unnamed(&table([POSITION, VELOCITY, LOAD], 1.0), 3).is_err());
    }
}
