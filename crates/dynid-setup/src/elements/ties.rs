//! Ties of a plan, as relations among the parameters of its model.

use dynid_model::element::change_name;
use dynid_model::inertia::{PARAMETER_NAMES, PARAMETERS_PER_BODY};
use dynid_model::ties::Relation;
use dynid_model::{EffortModel, RobotModel, Ties};
use dynid_robots::{MirrorAxis, TieSpec};

use super::ElementPlan;
use crate::Error;

/// A parameter of a model.
#[derive(Clone, Copy, PartialEq)]
enum Place {
    Linear(usize),
    Shape(usize),
    /// The change of a shape parameter from where the model was linearised.
    Change(usize),
}

/// Relations of a model's linear and shape parameters.
#[derive(Default)]
struct Relations {
    linear: Vec<Relation>,
    shape: Vec<Relation>,
}

impl ElementPlan {
    /// Returns a model of the plan with its ties.
    ///
    /// # Errors
    /// [`Error::Tie`].
    pub fn tied(&self, model: RobotModel) -> Result<RobotModel, Error> {
        if self.spec.ties.is_empty() {
            return Ok(model);
        }
        let mut all = Relations::default();
        for tie in &self.spec.ties {
            relations(tie, &model, &mut all).map_err(|fault| Error::Tie { tie: tie.words(), fault })?;
        }
        let tie = |fault: dynid_model::ties::TieError| Error::Tie {
            tie: self.spec.ties.iter().map(TieSpec::words).collect::<Vec<_>>().join("; "),
            fault: fault.to_string(),
        };
        let ties = Ties::new(&all.linear, &all.shape).map_err(tie)?;
        model.with_ties(ties).map_err(tie)
    }

    /// Ties of the plan.
    pub fn ties(&self) -> &[TieSpec] {
        &self.spec.ties
    }

    /// Ties with names that have no part in a model of the plan, and these names: joints that stand still, links that are welded, parameters
    /// of elements that a joint does not have.
    pub fn idle_ties<'a>(&'a self, model: &'a RobotModel) -> impl Iterator<Item = (&'a TieSpec, String)> {
        self.spec.ties.iter().filter_map(|tie| {
            let idle = tie.names().filter(|name| parameters(model, name).is_empty());
            let idle: Vec<String> = idle.map(|name| format!("`{name}`")).collect();
            (!idle.is_empty()).then(|| (tie, idle.join(", ")))
        })
    }

    /// Other joints all of whose parameters are those of a joint.
    pub fn equal_joints<'a>(&'a self, joint: &'a str) -> impl Iterator<Item = &'a String> {
        let of = move |tie: &&TieSpec| tie.equal.iter().any(|name| name == joint);
        self.spec.ties.iter().filter(of).flat_map(|tie| &tie.equal).filter(move |name| *name != joint)
    }
}

/// Relations of one tie. `Err`: why it does not fit the model, in words.
fn relations(tie: &TieSpec, model: &RobotModel, out: &mut Relations) -> Result<(), String> {
    for name in &tie.massless {
        let Some(first) = body(model, name) else { continue };
        for k in 0..PARAMETERS_PER_BODY {
            out.add(&[(Place::Linear(first + k), 1.0)], 0.0, tie.words())?;
        }
    }
    for (name, value) in &tie.known {
        match place(model, name) {
            Some(Place::Change(column)) => out.add(&[(Place::Change(column), 1.0)], 0.0, tie.words())?,
            Some(of) => out.add(&[(of, 1.0)], *value, tie.words())?,
            None => {}
        }
    }
    let shares: Vec<(Place, f64)> =
        tie.ratio.iter().filter_map(|(name, share)| Some((place(model, name)?, *share))).collect();
    for (of, share) in shares.iter().skip(1) {
        let (first, first_share) = shares[0];
        out.add(&[(first, *share), (*of, -first_share)], 0.0, tie.words())?;
    }
    let terms: Vec<Option<(Place, f64)>> =
        tie.sum.iter().map(|(name, factor)| Some((place(model, name)?, *factor))).collect();
    if terms.iter().any(Option::is_some) {
        let missing = tie.sum.keys().zip(&terms).find(|(_, term)| term.is_none());
        if let Some((name, _)) = missing {
            return Err(format!("`{name}` is no parameter of the model, and a sum needs all of its terms"));
        }
        let terms: Vec<(Place, f64)> = terms.into_iter().flatten().collect();
        out.add(&terms, tie.value.unwrap_or(0.0), tie.words())?;
    }
    equal(tie, model, out)
}

/// Relations of `equal`.
fn equal(tie: &TieSpec, model: &RobotModel, out: &mut Relations) -> Result<(), String> {
    let members: Vec<(&String, Vec<(String, Place)>)> = tie
        .equal
        .iter()
        .map(|name| (name, parameters(model, name)))
        // A mirror image is that of a link, whatever joint has its name.
        .map(|(name, own)| match (tie.mirror, body(model, name)) {
            (Some(_), Some(_)) => (name, own.into_iter().take(PARAMETERS_PER_BODY).collect()),
            _ => (name, own),
        })
        .filter(|(_, own)| !own.is_empty())
        .collect();
    let Some((first, of_first)) = members.first() else { return Ok(()) };
    let symbols =
        |own: &[(String, Place)]| own.iter().map(|(s, _)| format!("`{s}`")).collect::<Vec<_>>().join(", ");
    for (name, own) in &members[1..] {
        let same = own.len() == of_first.len() && own.iter().zip(of_first).all(|((a, _), (b, _))| a == b);
        if !same {
            let (a, b) = (symbols(of_first), symbols(own));
            return Err(format!(
                "`{first}` has the parameters {a}, `{name}` has {b}: equal ones need the same elements"
            ));
        }
        for ((symbol, a), (_, b)) in of_first.iter().zip(own) {
            let factor = match tie.mirror {
                None => 1.0,
                Some(_) if body(model, name).is_none() => {
                    return Err(format!(
                        "`{name}` is no link, and links alone have mirror images: tie joints without `mirror`"
                    ));
                }
                Some(axis) => parity(axis, symbol),
            };
            out.add(&[(*a, factor), (*b, -1.0)], 0.0, tie.words())?;
        }
    }
    Ok(())
}

impl Relations {
    fn add(&mut self, terms: &[(Place, f64)], value: f64, words: String) -> Result<(), String> {
        let shapes: Vec<(usize, f64)> = terms
            .iter()
            .filter_map(|(p, f)| if let Place::Shape(k) = p { Some((*k, *f)) } else { None })
            .collect();
        if shapes.len() == terms.len() {
            self.shape.push(Relation { terms: shapes, value, words });
            return Ok(());
        }
        if !shapes.is_empty() {
            return Err("parameters that enter linearly and nonlinearly stand in one tie".to_owned());
        }
        let column = |place: &Place| match place {
            Place::Linear(k) | Place::Shape(k) | Place::Change(k) => *k,
        };
        let terms = terms.iter().map(|(p, f)| (column(p), *f)).collect();
        self.linear.push(Relation { terms, value, words });
        Ok(())
    }
}

/// First of the ten columns of a link.
fn body(model: &RobotModel, name: &str) -> Option<usize> {
    let place = model.mechanism().bodies().iter().position(|body| body.name == name);
    place.map(|b| PARAMETERS_PER_BODY * b)
}

fn place(model: &RobotModel, name: &str) -> Option<Place> {
    let table = model.parameters();
    let shape = || table.shape.iter().position(|s| s.name == name).map(Place::Shape);
    let change = || table.column(&change_name(name)).map(Place::Change);
    table.column(name).map(Place::Linear).or_else(shape).or_else(change)
}

/// Parameters of a joint or link by symbol, or the one parameter of that name; without those of single logs. Empty: none has a part
/// in the model.
fn parameters(model: &RobotModel, name: &str) -> Vec<(String, Place)> {
    if let Some(first) = body(model, name) {
        let ten = PARAMETER_NAMES
            .iter()
            .enumerate()
            .map(|(k, symbol)| ((*symbol).to_owned(), Place::Linear(first + k)));
        let mut out: Vec<(String, Place)> = ten.collect();
        // A joint of the same name goes with it.
        out.extend(of_joint(model, name));
        return out;
    }
    let own = of_joint(model, name);
    match own.is_empty() {
        true => place(model, name).map(|p| (String::new(), p)).into_iter().collect(),
        false => own,
    }
}

fn of_joint(model: &RobotModel, joint: &str) -> Vec<(String, Place)> {
    let table = model.parameters();
    let bodies = model.mechanism().inertial_parameters();
    let of_logs = model.log_columns();
    // A name may hold points: `arm.elbow.fc` is no parameter of `arm`.
    let symbol = |name: &str| {
        let symbol = name.strip_prefix(joint)?.strip_prefix('.')?;
        (!symbol.contains('.')).then(|| symbol.to_owned())
    };
    let linear = (bodies..table.linear.len()).filter(|c| !of_logs.contains(c));
    let linear = linear.filter_map(|c| Some((symbol(&table.linear[c].name)?, Place::Linear(c))));
    let shape = table.shape.iter().enumerate().filter_map(|(k, s)| Some((symbol(&s.name)?, Place::Shape(k))));
    linear.chain(shape).collect()
}

/// Sign of a parameter in the mirror image across an axis: that of the number of its letters that are the axis.
fn parity(axis: MirrorAxis, symbol: &str) -> f64 {
    let letter = match axis {
        MirrorAxis::X => 'x',
        MirrorAxis::Y => 'y',
        MirrorAxis::Z => 'z',
    };
    if symbol.chars().filter(|c| *c == letter).count() % 2 == 1 { -1.0 } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mirror_images_turn_odd_moments() {
        let signs = PARAMETER_NAMES.map(|symbol| parity(MirrorAxis::Y, symbol));
        assert_eq!(signs, [1.0, 1.0, -1.0, 1.0, 1.0, -1.0, 1.0, 1.0, -1.0, 1.0]);
    }
}
