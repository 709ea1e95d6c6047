//! Intervals that are wanted, and what can be done about each.

use std::str::FromStr;

use dynid_identify::Error;
use dynid_identify::knowledge::Knowledge;

/// Least structural limit of a parameter that a motion can show by itself.
const BY_ITSELF: f64 = 0.9;

/// How narrow a 95 % interval is to be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Width {
    /// Half width in the parameter's unit.
    Half(f64),
    /// Half width as a share of the value; where the value is not known to be other than zero, of its interval or of what was known without
    /// logs.
    Share(f64),
}

/// An interval that is wanted: `link2.m=0.05`, `joint1.fc=5%`, `*.fc=10%`.
#[derive(Debug, Clone, PartialEq)]
pub struct Wanted {
    /// Name of a standard parameter; `*` stands for any text.
    pub name: String,
    /// How narrow.
    pub width: Width,
}

impl FromStr for Wanted {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let expected = || format!("expected NAME=WIDTH such as `j1.fc=0.05` or `j1.fc=5%`, found `{text}`");
        let (name, width) = text.split_once('=').ok_or_else(expected)?;
        let (name, width) = (name.trim(), width.trim());
        let (number, share) = match width.strip_suffix('%') {
            Some(number) => (number.trim_end(), true),
            None => (width, false),
        };
        let number: f64 = number.parse().map_err(|_| expected())?;
        if name.is_empty() || !(number > 0.0 && number.is_finite()) {
            return Err(format!("expected a width above zero, found `{text}`"));
        }
        let width = if share { Width::Share(0.01 * number) } else { Width::Half(number) };
        Ok(Wanted { name: name.to_owned(), width })
    }
}

dynid_record::words! {
    /// What comes of an interval that is wanted.
    WantedState {
        /// The logs so far give it.
        Holds = "holds already",
        /// The motion will bring it.
        Reached = "reached",
        /// The motion will not bring it within the longest record.
        NotReached = "not reached",
        /// The parameter acts only together with others: no motion shows it that well by itself.
        OnlyInCombination = "only in combination",
        /// The parameter follows from others, or was given: no log is asked for it.
        Given = "given",
    }
}

/// A parameter of which an interval is wanted.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Goal {
    /// Place among the standard parameters.
    pub(super) parameter: usize,
    /// Half width that is wanted, in the parameter's unit.
    pub(super) half_width: f64,
    /// Standard deviation that gives it.
    pub(super) deviation: f64,
    pub(super) state: WantedState,
}

impl Goal {
    /// Whether a motion is to reach it.
    pub(super) fn is_open(&self) -> bool {
        self.state == WantedState::NotReached
    }
}

/// The parameters of what is wanted, in their order; of several widths the narrowest counts. Names with `*` leave out what no motion shows
/// by itself.
///
/// # Errors
/// [`Error::Setting`] for a name that is no parameter, and for nothing wanted.
pub(super) fn goals(wanted: &[Wanted], known: &Knowledge) -> Result<Vec<Goal>, Error> {
    if wanted.is_empty() {
        return Err(Error::setting("want", "at least one parameter, such as `j1.fc=5%`", "none"));
    }
    let mut out: Vec<Goal> = Vec::new();
    for Wanted { name, width } in wanted {
        let is_pattern = name.contains('*');
        let named: Vec<usize> = (known.parameters.iter().enumerate())
            .filter(|(_, p)| matches(name, &p.name))
            .map(|(j, _)| j)
            .collect();
        if named.is_empty() {
            return Err(unknown(name, known));
        }
        let found: Vec<Goal> = named.into_iter().map(|j| goal(j, *width, known)).collect();
        let shown = |g: &Goal| !matches!(g.state, WantedState::OnlyInCombination | WantedState::Given);
        let some_shown = found.iter().any(shown);
        for goal in found.into_iter().filter(|g| !is_pattern || !some_shown || shown(g)) {
            match out.iter_mut().find(|g| g.parameter == goal.parameter) {
                Some(before) if before.half_width <= goal.half_width => {}
                Some(before) => *before = goal,
                None => out.push(goal),
            }
        }
    }
    out.sort_by_key(|g| g.parameter);
    Ok(out)
}

fn goal(parameter: usize, width: Width, known: &Knowledge) -> Goal {
    let (p, a) = (&known.parameters[parameter], &known.today()[parameter]);
    let half_width = match width {
        Width::Half(width) => width,
        Width::Share(share) => {
            let size = p.value.abs();
            share
                * p.half_width
                    .filter(|w| *w < size)
                    .map_or_else(|| size.max(p.half_width.unwrap_or(a.prior_std)), |_| size)
        }
    };
    let deviation = known.deviation_for(parameter, half_width);
    let state = if p.is_given {
        WantedState::Given
    } else if p.half_width.is_some_and(|w| w <= half_width) {
        WantedState::Holds
    } else if a.structural_limit < BY_ITSELF || known.combination(parameter, deviation).is_none() {
        WantedState::OnlyInCombination
    } else {
        WantedState::NotReached
    };
    Goal { parameter, half_width, deviation, state }
}

/// Whether `pattern` with `*` for any text is `name`.
fn matches(pattern: &str, name: &str) -> bool {
    let mut parts = pattern.split('*');
    let Some(mut rest) = parts.next().and_then(|first| name.strip_prefix(first)) else { return false };
    let mut middle: Vec<&str> = parts.collect();
    let Some(last) = middle.pop() else { return rest.is_empty() };
    for part in middle {
        let Some(at) = rest.find(part) else { return false };
        rest = &rest[at + part.len()..];
    }
    rest.ends_with(last)
}

fn unknown(name: &str, known: &Knowledge) -> Error {
    let end = name.rsplit('.').next().unwrap_or(name);
    let names = || known.parameters.iter().map(|p| p.name.as_str());
    let alike: Vec<&str> = names().filter(|n| n.ends_with(&format!(".{end}"))).collect();
    let some: Vec<&str> = if alike.is_empty() { names().collect() } else { alike };
    let more = if some.len() > 12 { ", .." } else { "" };
    let expected = format!("a standard parameter: {}{more}", some[..some.len().min(12)].join(", "));
    Error::setting("want", &expected, name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stars_stand_for_any_text() {
        for (pattern, name, expected) in [
            ("j1.fc", "j1.fc", true),
            ("j1.fc", "j1.fcp", false),
            ("*.fc", "joint_1.fc", true),
            ("*.fc", "joint_1.fcp", false),
            ("j*.f*", "j1.fv", true),
            ("*", "anything", true),
            ("a*b*c", "a1b2b3c", true),
            ("a*b*c", "abc", true),
            ("a*a", "a", false),
            ("", "", true),
        ] {
            assert_eq!(matches(pattern, name), expected, "{pattern} {name}");
        }
    }

    #[test]
    fn widths_are_numbers_or_shares() {
        let wanted = |text: &str| text.parse::<Wanted>();
        assert_eq!(wanted("j1.fc=0.05").unwrap().width, Width::Half(0.05));
        assert_eq!(
            wanted(" j1.fc = 5 % ").unwrap(),
            Wanted { name: "j1.fc".into(), width: Width::Share(0.05) }
        );
        for bad in ["j1.fc", "j1.fc=", "j1.fc=0", "j1.fc=-1", "=1", "j1.fc=nan", "j1.fc=inf", "j1.fc=5%%"] {
            assert!(wanted(bad).is_err(), "{bad}");
        }
    }
}
