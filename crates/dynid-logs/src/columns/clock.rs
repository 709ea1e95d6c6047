//! The unit of a time column, told from the size and the steps of its numbers.

use super::column_values::raw_column;
use super::{ColumnMapping, ColumnUse, MappingError, TimeSource};
use crate::csv::Table;

/// Units with what one of them is, s, largest first.
pub(super) const UNITS: [(&str, f64); 4] = [("s", 1.0), ("ms", 1e-3), ("us", 1e-6), ("ns", 1e-9)];
/// Stamps between these count from 1970, s: 2001 to 2065.
const SINCE_1970: [f64; 2] = [1e9, 3e9];
/// Sample rates that logs have, Hz.
const RATES: [f64; 2] = [0.5, 20_000.0];
/// Sample rates of most logs, Hz.
const USUAL_RATES: [f64; 2] = [2.0, 10_000.0];
/// Sample rates that are refused under a unit that was stated, Hz.
const POSSIBLE_RATES: [f64; 2] = [1e-2, 1e6];
/// No joint is faster, rad/s or m/s.
const FASTEST: f64 = 60.0;
/// No motor before its gear is faster, rad/s.
const FASTEST_MOTOR: f64 = 3000.0;
/// Greatest speeds of most logs, rad/s or m/s.
const USUAL_SPEEDS: [f64; 2] = [0.01, 10.0];
/// Logged velocities tell the unit if their ratio to those of the positions is within this factor of a power of 1000.
const AGREES: f64 = 2.0;
/// Stretches over which speeds are taken, at least.
const STRETCHES: usize = 500;

/// The unit of a time column as it was found.
#[derive(Clone, Debug, PartialEq)]
pub struct TimeReading {
    /// `s`, `ms`, `us` or `ns`.
    pub unit: &'static str,
    /// Sample rate that follows, Hz.
    pub rate_hz: f64,
    /// Why, in words.
    pub reason: String,
}

impl ColumnMapping {
    /// Finds the unit of a time column of which none is said, and refuses one under which no log is sampled.
    ///
    /// Stamps since 1970 tell their unit by their size. Else a unit must give a rate of 0.5 Hz to 20 kHz and speeds that joints have; logged
    /// velocities, where there are any, tell it by their ratio to those of the positions. `motors`: positions may be those of
    /// motors before their gears. `None`: the unit was said, there is no time column, or time does not advance.
    ///
    /// # Errors
    /// [`MappingError::TimeUnit`] where several units make sense, [`MappingError::TimeStep`] where none does.
    pub fn settle_time(&mut self, table: &Table, motors: bool) -> Result<Option<TimeReading>, MappingError> {
        let TimeSource::Columns(time) = &self.time else { return Ok(None) };
        let column = time.parts.iter().map(|p| p.name.as_str()).collect::<Vec<_>>().join(", ");
        let Some(first) = time.parts.first() else { return Ok(None) };
        if time.unit_stated {
            let Some(step) = median_step(&self.raw_time(table, true)?) else { return Ok(None) };
            let rate_hz = 1.0 / step;
            if within(rate_hz, POSSIBLE_RATES) {
                return Ok(None);
            }
            let raw = step / first.factor;
            let meant = unit_for(raw, USUAL_RATES);
            return Err(MappingError::TimeStep { column, step: raw, unit: name_of(first.factor), meant });
        }
        let raw = self.raw_time(table, false)?;
        let Some(step) = median_step(&raw) else { return Ok(None) };
        let start = self.start_of(table, first)?;
        let motion = Motion::of(self, table, &raw)?;
        let found = choose(step, start, &motion, motors);
        let (unit, factor, reason) = match found {
            Choice::Unit(unit, factor, reason) => (unit, factor, reason),
            Choice::Several(units) => return Err(MappingError::TimeUnit { column, step, units }),
            Choice::None => {
                let (unit, meant) = ("s".to_owned(), unit_for(step, RATES));
                return Err(MappingError::TimeStep { column, step, unit, meant });
            }
        };
        if let TimeSource::Columns(time) = &mut self.time {
            time.parts[0].factor = factor;
            time.unit_stated = true;
        }
        Ok(Some(TimeReading { unit, rate_hz: 1.0 / (factor * step), reason }))
    }

    /// Time from the first row on: in s as the mapping says, or as it stands in the file.
    fn raw_time(&self, table: &Table, in_seconds: bool) -> Result<Vec<f64>, MappingError> {
        let mut out = vec![0.0; table.rows];
        for part in self.time_columns() {
            let (values, _) = raw_column(table, "time", part)?;
            let first = values.first().copied().unwrap_or(0.0);
            let factor = if in_seconds { part.factor } else { 1.0 };
            out.iter_mut().zip(values).for_each(|(t, x)| *t += factor * (x - first));
        }
        Ok(out)
    }

    /// The first stamp as it stands in the file.
    fn start_of(&self, table: &Table, part: &ColumnUse) -> Result<f64, MappingError> {
        let (values, origin) = raw_column(table, "time", part)?;
        Ok(values.first().copied().unwrap_or(0.0) + origin as f64)
    }
}

/// Median of the steps that go forward; `None` unless most do.
fn median_step(time: &[f64]) -> Option<f64> {
    let mut steps: Vec<f64> =
        time.windows(2).map(|w| w[1] - w[0]).filter(|s| *s > 0.0 && s.is_finite()).collect();
    if steps.is_empty() || 2 * steps.len() < time.len() - 1 {
        return None;
    }
    let middle = steps.len() / 2;
    Some(*steps.select_nth_unstable_by(middle, f64::total_cmp).1)
}

fn within(x: f64, [low, high]: [f64; 2]) -> bool {
    (low..=high).contains(&x)
}

/// The only unit that gives a step a rate within bounds.
fn unit_for(step: f64, rates: [f64; 2]) -> Option<&'static str> {
    let mut units = UNITS.iter().filter(|(_, unit)| within(1.0 / (unit * step), rates));
    let found = units.next()?;
    units.next().is_none().then_some(found.0)
}

fn name_of(factor: f64) -> String {
    let known = UNITS.iter().find(|(_, unit)| *unit == factor);
    known.map_or_else(|| format!("{factor} s"), |(name, _)| (*name).to_owned())
}

/// What positions say of the time.
struct Motion {
    /// Greatest speed of a joint per raw unit of time; 0 where nothing moves.
    speed: f64,
    /// Ratio of logged velocities to those speeds, where both go together.
    ratio: Option<f64>,
}

impl Motion {
    fn of(mapping: &ColumnMapping, table: &Table, time: &[f64]) -> Result<Self, MappingError> {
        let lag = (time.len() / STRETCHES).max(1);
        let mut speed = 0.0_f64;
        let (mut vv, mut dd, mut vd) = (0.0, 0.0, 0.0);
        for (k, column) in mapping.position.iter().enumerate() {
            let Some(column) = column else { continue };
            let (q, _) = raw_column(table, "position", column)?;
            let velocity = mapping.velocity.as_ref().and_then(|v| v[k].as_ref());
            let velocity = velocity.map(|v| Ok((raw_column(table, "velocity", v)?.0, v.factor)));
            let velocity = velocity.transpose()?;
            let mut speeds = Vec::with_capacity(time.len());
            for row in (lag..time.len()).step_by(lag) {
                let step = time[row] - time[row - lag];
                let slope = column.factor * (q[row] - q[row - lag]) / step;
                if step <= 0.0 || !slope.is_finite() {
                    continue;
                }
                speeds.push(slope.abs());
                if let Some((v, factor)) = &velocity {
                    let mean = v[row - lag..=row].iter().sum::<f64>() * factor / (lag + 1) as f64;
                    if mean.is_finite() {
                        vv += mean * mean;
                        dd += slope * slope;
                        vd += mean * slope;
                    }
                }
            }
            // Most of the fastest: single jumps of a counter are no speed.
            if !speeds.is_empty() {
                let place = (speeds.len() * 95 / 100).min(speeds.len() - 1);
                speed = speed.max(*speeds.select_nth_unstable_by(place, f64::total_cmp).1);
            }
        }
        let together = vd > 0.0 && vd * vd > 0.8 * vv * dd;
        Ok(Motion { speed, ratio: together.then(|| (vv / dd).sqrt()) })
    }
}

enum Choice {
    Unit(&'static str, f64, String),
    Several(Vec<(&'static str, f64)>),
    None,
}

fn choose(step: f64, start: f64, motion: &Motion, motors: bool) -> Choice {
    let rate = |unit: f64| 1.0 / (unit * step);
    let possible: Vec<(&'static str, f64)> =
        UNITS.into_iter().filter(|(_, unit)| within(rate(*unit), RATES)).collect();
    let counted = possible.iter().find(|(_, unit)| within(start * unit, SINCE_1970));
    if let Some((name, unit)) = counted {
        let reason = format!("the first stamp, {start:.0}, counts from 1970 in {name}");
        return Choice::Unit(name, *unit, reason);
    }
    // Velocities are per second, speeds per raw unit of time.
    let agreeing = motion
        .ratio
        .and_then(|ratio| UNITS.into_iter().find(|(_, unit)| within(ratio * unit, [1.0 / AGREES, AGREES])));
    if let Some((name, unit)) = agreeing.filter(|found| possible.contains(found)) {
        return Choice::Unit(name, unit, "logged velocities agree with those of the positions".to_owned());
    }
    let fastest = if motors { FASTEST_MOTOR } else { FASTEST };
    let sensible: Vec<(&'static str, f64)> =
        possible.iter().copied().filter(|(_, unit)| motion.speed / unit <= fastest).collect();
    let reason =
        |unit: f64| format!("steps of {step:.6} give {:.6} Hz and speeds that joints have", rate(unit));
    match sensible.as_slice() {
        [(name, unit)] => Choice::Unit(name, *unit, reason(*unit)),
        [] => match possible.as_slice() {
            // Speeds that no joint has: something else is wrong, which is told where it is known.
            [(name, unit)] => {
                Choice::Unit(name, *unit, format!("steps of {step:.6} give {:.6} Hz", rate(*unit)))
            }
            [] => Choice::None,
            several => Choice::Several(several.iter().map(|(name, unit)| (*name, rate(*unit))).collect()),
        },
        several => {
            // One whose rate and speeds are usual, where neither is under the others.
            let usual_rate = |unit: f64| within(rate(unit), USUAL_RATES);
            let usual_speed = |unit: f64| within(motion.speed / unit, USUAL_SPEEDS);
            let still = motion.speed == 0.0;
            let (usual, rest): (Vec<_>, Vec<_>) =
                several.iter().partition(|(_, unit)| usual_rate(*unit) && (still || usual_speed(*unit)));
            let unusual = |unit: f64| !usual_rate(unit) && (still || !usual_speed(unit));
            match usual.as_slice() {
                [(name, unit)] if rest.iter().all(|(_, unit)| unusual(*unit)) => {
                    Choice::Unit(name, *unit, reason(*unit))
                }
                _ => Choice::Several(several.iter().map(|(name, unit)| (*name, rate(*unit))).collect()),
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn chosen(step: f64, start: f64, speed: f64, ratio: Option<f64>) -> String {
        match choose(step, start, &Motion { speed, ratio }, false) {
            Choice::Unit(name, _, _) => name.to_owned(),
            Choice::Several(units) => units.iter().map(|(name, _)| *name).collect::<Vec<_>>().join("|"),
            Choice::None => "none".to_owned(),
        }
    }

    #[test]
    fn stamps_since_1970_tell_their_unit() {
        for (unit, factor) in UNITS {
            assert_eq!(chosen(0.002 / factor, 1.7e9 / factor, 1.0 * factor, None), unit);
        }
        // A counter that happens to be large is judged by its steps.
        assert_eq!(chosen(0.01, 2e12, 1.0, None), "s");
    }

    #[test]
    fn steps_and_speeds_tell_the_unit() {
        for (unit, factor) in UNITS {
            for rate in [50.0, 125.0, 500.0, 1000.0] {
                for speed in [0.1, 2.0] {
                    assert_eq!(chosen(1.0 / rate / factor, 0.0, speed * factor, None), unit, "{rate} Hz");
                }
            }
        }
        assert_eq!(chosen(1.0 / 8000.0, 0.0, 1.0, None), "s");
        // Ten rows per second: in milliseconds the joint would be 1000 times as fast.
        assert_eq!(chosen(0.1, 0.0, 1.0, None), "s");
        // Of a slow joint both make sense, and velocities decide.
        assert_eq!(chosen(0.1, 0.0, 1e-3, None), "s|ms");
        // A joint at rest at 1 kHz in milliseconds, not at 1 Hz.
        assert_eq!(chosen(1.0, 0.0, 0.0, None), "ms");
        assert_eq!(chosen(0.1, 0.0, 0.03, None), "s|ms");
        assert_eq!(chosen(0.1, 0.0, 0.03, Some(1.1)), "s");
        assert_eq!(chosen(0.1, 0.0, 0.03, Some(900.0)), "ms");
        // Degrees per second say nothing.
        assert_eq!(chosen(0.1, 0.0, 0.03, Some(57.3)), "s|ms");
        assert_eq!(chosen(1e12, 0.0, 1.0, None), "none");
    }
}
