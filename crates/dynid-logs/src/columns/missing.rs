//! Rows in which a signal has no value.

use super::column_values::{place_of, raw_column};
use super::{ColumnMapping, ColumnUse, MappingError, Signal};
use crate::csv::Table;
use crate::log::Missing;
use crate::signal::is_held;

/// Share of the rows with positions that must have all signals.
const LEAST_SHARE: f64 = 0.5;
/// Longest silence that is bridged, in usual steps of a signal.
const LONGEST_SILENCE: f64 = 5.0;

/// What became of rows without a value.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Sparse {
    /// Rows that are left out.
    pub left_out: usize,
    /// Values that were interpolated.
    pub interpolated: usize,
    /// Values of commands that were held.
    pub held: usize,
    /// Columns with missing values, each with how many.
    pub columns: Vec<(String, usize)>,
}

/// Rows that are kept, with the table's columns filled up where they are to be.
pub(super) struct Kept {
    /// Places of the rows in the table; `None`: all.
    pub(super) rows: Option<Vec<usize>>,
    pub(super) sparse: Sparse,
}

impl ColumnMapping {
    /// Decides what becomes of missing values, and interpolates them if that is wanted.
    pub(super) fn fill(&self, table: &mut Table) -> Result<Kept, MappingError> {
        let place = |column: &ColumnUse| place_of(table, column);
        let used: Vec<usize> = self.signal_columns().chain(self.time_columns()).filter_map(place).collect();
        let gaps = |k: &usize| table.columns[*k].iter().filter(|x| x.is_nan()).count();
        let mut sparse = Sparse::default();
        for k in &used {
            match gaps(k) {
                0 => {}
                count => sparse.columns.push((table.header[*k].clone(), count)),
            }
        }
        if sparse.columns.is_empty() {
            return Ok(Kept { rows: None, sparse });
        }
        if self.missing == Missing::Error
            && let Some((column, _)) = sparse.columns.first()
        {
            let place = used.iter().find(|k| gaps(k) > 0).copied().unwrap_or_default();
            let row = table.columns[place].iter().position(|x| x.is_nan()).unwrap_or_default();
            return Err(MappingError::NoValue { column: column.clone(), row: table.first_row + row });
        }
        let mut needed: Vec<usize> =
            self.time_columns().iter().chain(self.position.iter().flatten()).filter_map(place).collect();
        let whole = |table: &Table, columns: &[usize], row: usize| {
            columns.iter().all(|k| !table.columns[*k][row].is_nan())
        };
        let mut positioned: Vec<usize> = (0..table.rows).filter(|row| whole(table, &needed, *row)).collect();
        if positioned.is_empty() && self.missing == Missing::Interpolate {
            // Positions of several publishers, an arm and its gripper: those of the one that speaks most say which rows there are.
            let positions = self.position.iter().flatten().filter_map(place);
            let most = positions.min_by_key(|k| gaps(k));
            needed = self.time_columns().iter().filter_map(place).chain(most).collect();
            positioned = (0..table.rows).filter(|row| whole(table, &needed, *row)).collect();
        }
        if self.missing == Missing::Interpolate {
            let time = self.clock(table)?;
            for k in used.iter().filter(|k| !needed.contains(k)) {
                match is_held(&table.header[*k]) {
                    true => sparse.held += hold(&time, &mut table.columns[*k], &positioned),
                    false => sparse.interpolated += interpolate(&time, &mut table.columns[*k], &positioned),
                }
            }
        }
        let rows: Vec<usize> = positioned.iter().copied().filter(|row| whole(table, &used, *row)).collect();
        if (rows.len() as f64) < LEAST_SHARE * positioned.len() as f64 || rows.is_empty() {
            let emptiest = used
                .iter()
                .max_by_key(|k| positioned.iter().filter(|r| table.columns[**k][**r].is_nan()).count());
            return Err(MappingError::Sparse {
                column: emptiest.map_or_else(String::new, |k| table.header[*k].clone()),
                rows: rows.len(),
                positioned: positioned.len(),
                interpolated: self.missing == Missing::Interpolate,
            });
        }
        sparse.left_out = table.rows - rows.len();
        Ok(Kept { rows: Some(rows), sparse })
    }

    /// Time of every row, s from the first; rows without a time are NaN.
    fn clock(&self, table: &Table) -> Result<Vec<f64>, MappingError> {
        let super::TimeSource::Columns(_) = &self.time else {
            return Err(MappingError::Idle {
                key: "missing",
                beside: format!("{} without a time column", Signal::Time),
            });
        };
        let mut out = vec![0.0; table.rows];
        for part in self.time_columns() {
            let (values, _) = raw_column(table, "time", part)?;
            out.iter_mut().zip(values).for_each(|(t, x)| *t += part.factor * x);
        }
        Ok(out)
    }
}

/// Fills gaps of a column at some rows; how many were filled.
fn interpolate(time: &[f64], values: &mut [f64], at: &[usize]) -> usize {
    let known: Vec<usize> =
        (0..values.len()).filter(|k| !values[*k].is_nan() && !time[*k].is_nan()).collect();
    let mut steps: Vec<f64> =
        known.windows(2).map(|w| time[w[1]] - time[w[0]]).filter(|s| *s > 0.0).collect();
    if steps.is_empty() {
        return 0;
    }
    // The lower one of two: a long silence is no usual step.
    let middle = (steps.len() - 1) / 2;
    let longest = LONGEST_SILENCE * *steps.select_nth_unstable_by(middle, f64::total_cmp).1;
    let mut filled = 0;
    for row in at {
        if !values[*row].is_nan() {
            continue;
        }
        let next = known.partition_point(|k| k < row);
        let (Some(before), Some(after)) = (next.checked_sub(1).map(|k| known[k]), known.get(next).copied())
        else {
            continue;
        };
        let span = time[after] - time[before];
        if span > 0.0 && span <= longest {
            let share = (time[*row] - time[before]) / span;
            values[*row] = values[before] + share * (values[after] - values[before]);
            filled += 1;
        }
    }
    filled
}

/// Gives some rows the value that a column had last, however long ago; how many were filled.
fn hold(time: &[f64], values: &mut [f64], at: &[usize]) -> usize {
    let mut filled = 0;
    let (mut last, mut row) = (f64::NAN, 0);
    for place in at {
        while row <= *place {
            if !values[row].is_nan() && !time[row].is_nan() {
                last = values[row];
            }
            row += 1;
        }
        if values[*place].is_nan() && !last.is_nan() {
            values[*place] = last;
            filled += 1;
        }
    }
    filled
}

#[cfg(test)]
mod tests {
    use super::{hold, interpolate};

    #[test]
    fn commands_are_held_until_the_next_one_and_not_before_the_first() {
        let time: Vec<f64> = (0..9).map(f64::from).collect();
        let gap = f64::NAN;
        let mut values = vec![gap, 1.0, gap, gap, 3.0, gap, gap, gap, gap];
        assert_eq!(hold(&time, &mut values, &[0, 2, 3, 8]), 3);
        assert!(values[0].is_nan() && values[5].is_nan());
        assert_eq!([values[2], values[3], values[4], values[8]], [1.0, 1.0, 3.0, 3.0]);
    }

    #[test]
    fn gaps_are_bridged_on_a_line_and_long_ones_are_not() {
        let time: Vec<f64> = (0..12).map(f64::from).collect();
        let gap = f64::NAN;
        let mut values = vec![gap, 1.0, gap, 3.0, gap, 5.0, gap, 7.0, gap, gap, gap, gap];
        assert_eq!(interpolate(&time, &mut values, &(0..12).collect::<Vec<_>>()), 3);
        assert_eq!(values[1..8], [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0]);
        assert!(values[0].is_nan() && values[8].is_nan());
        let mut values = vec![0.0, gap, 2.0, 3.0, 4.0, gap, gap, gap, gap, gap, gap, 11.0];
        assert_eq!(interpolate(&time, &mut values, &(0..12).collect::<Vec<_>>()), 1);
        assert!(values[6].is_nan());
    }
}
