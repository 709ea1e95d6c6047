//! Bounds of a run as rows of the consistent estimate.

use dynid_estimate::consistent::Bound;
use dynid_files::closest;
use dynid_model::{EffortModel, RobotModel};

use crate::Error;
use crate::settings::BoundConfig;

/// A range that leaves no room is given this much, relative to its size: the interior-point method needs an interior.
const ROOM: f64 = 1e-6;

/// Rows `Σ factor x ≤ upper` of all bounds, each named as the user would say it.
///
/// The centre of mass of a link is bounded through its first moment, `mx ≤ upper · m`, which is linear.
///
/// # Errors
/// [`Error::UnknownLink`], [`Error::UnknownParameter`].
pub fn rows(bounds: &[BoundConfig], model: &RobotModel) -> Result<Vec<Bound>, Error> {
    let mut out = Vec::new();
    for bound in bounds {
        let bodies: Vec<usize> = bound.links.iter().map(|l| body(l, model)).collect::<Result<_, _>>()?;
        for (key, range) in bound.ranges() {
            match (key, &bound.parameter) {
                ("mass", _) => {
                    let masses: Vec<(usize, f64)> = bodies.iter().map(|b| (10 * b, 1.0)).collect();
                    let what = match &bound.links[..] {
                        [link] => format!("mass of `{link}`"),
                        several => format!("total mass of `{}`", several.join("`, `")),
                    };
                    both(&mut out, &what, "kg", range, |_| masses.clone(), |limit| limit);
                }
                ("range", Some(name)) => {
                    let column = parameter(name, model)?;
                    let unit = model.parameters().linear[column].unit;
                    both(&mut out, &format!("`{name}`"), unit, range, |_| vec![(column, 1.0)], |limit| limit);
                }
                (axis, _) => {
                    let (k, axis) = [(1, "x"), (2, "y"), (3, "z")][usize::from(axis.as_bytes()[4] - b'x')];
                    let mass = 10 * bodies[0];
                    let what = format!("centre of mass of `{}` along {axis}", bound.links[0]);
                    both(&mut out, &what, "m", range, |limit| vec![(mass + k, 1.0), (mass, -limit)], |_| 0.0);
                }
            }
        }
    }
    Ok(out)
}

/// Adds `terms(upper) ≤ right(upper)` and `-terms(lower) ≤ -right(lower)` where these are finite.
fn both(
    out: &mut Vec<Bound>,
    what: &str,
    unit: &str,
    range: (f64, f64),
    terms: impl Fn(f64) -> Vec<(usize, f64)>,
    right: impl Fn(f64) -> f64,
) {
    let (lower, upper) = with_room(range);
    if upper.is_finite() {
        let name = format!("{what} ≤ {} {unit}", number(range.1));
        out.push(Bound { name, terms: terms(upper), upper: right(upper) });
    }
    if lower.is_finite() {
        let name = format!("{what} ≥ {} {unit}", number(range.0));
        let terms = terms(lower).into_iter().map(|(column, factor)| (column, -factor)).collect();
        out.push(Bound { name, terms, upper: -right(lower) });
    }
}

/// The number as the user may have written it, but never with hundreds of digits.
fn number(x: f64) -> String {
    if x == 0.0 || (1e-4..1e6).contains(&x.abs()) { x.to_string() } else { format!("{x:e}") }
}

fn with_room((lower, upper): (f64, f64)) -> (f64, f64) {
    let room = ROOM * lower.abs().max(upper.abs()).max(1e-3);
    if upper - lower < 2.0 * room { (lower - room, upper + room) } else { (lower, upper) }
}

fn body(link: &str, model: &RobotModel) -> Result<usize, Error> {
    let bodies = model.mechanism().bodies();
    bodies.iter().position(|b| b.name == link).ok_or_else(|| Error::UnknownLink {
        name: link.to_owned(),
        welded_to: bodies
            .iter()
            .find(|b| b.fixed_links.iter().any(|f| f.name == link))
            .map(|b| b.name.clone()),
        known: bodies.iter().map(|b| b.name.clone()).collect(),
    })
}

/// Column of a parameter by name or symbol.
pub(crate) fn parameter(name: &str, model: &RobotModel) -> Result<usize, Error> {
    let table = model.parameters();
    let by_symbol = || table.linear.iter().position(|p| p.symbol == name);
    table.column(name).or_else(by_symbol).ok_or_else(|| {
        let names: Vec<String> = table.linear.iter().map(|p| p.name.clone()).collect();
        Error::UnknownParameter { name: name.to_owned(), meant: closest(name, &names).map(str::to_owned) }
    })
}
