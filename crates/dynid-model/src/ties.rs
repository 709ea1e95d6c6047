//! Ties: parameters that are known, or known multiples and sums of others.

use crate::parameter::ParameterTable;
use dynid_algebra::inertia::PARAMETERS_PER_BODY;

/// A linear relation among parameters, `Σ factor · parameter = value`.
#[derive(Debug, Clone, PartialEq)]
pub struct Relation {
    /// Parameters by their place in the table, each once, and their factors. Of two that could follow from the others the one named
    /// later does.
    pub terms: Vec<(usize, f64)>,
    /// Right-hand side, in the unit of the terms.
    pub value: f64,
    /// What it says, for messages.
    pub words: String,
}

/// A parameter that follows from others: `constant + Σ factor · parameter`.
#[derive(Debug, Clone, PartialEq)]
pub struct Dependent {
    /// Its place in the table.
    pub index: usize,
    /// Free parameters by their place, and their factors. Empty: the parameter is known.
    pub terms: Vec<(usize, f64)>,
    /// What it is where these are zero.
    pub constant: f64,
}

impl Dependent {
    /// Value of the parameter.
    ///
    /// # Panics
    /// If a term is no place of `values`.
    pub fn value(&self, values: &[f64]) -> f64 {
        self.terms.iter().fold(self.constant, |sum, (k, factor)| sum + factor * values[*k])
    }

    /// The one parameter that it is a multiple of, and the factor.
    pub fn multiple(&self) -> Option<(usize, f64)> {
        match self.terms[..] {
            [term] if self.constant == 0.0 => Some(term),
            _ => None,
        }
    }
}

/// Why relations cannot hold in a model.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum TieError {
    /// Relations exclude each other.
    #[error("{words}: the ties before leave {left} on one side and 0 on the other")]
    Contradiction {
        /// The relation that the ones before exclude.
        words: String,
        /// What is left of it.
        left: f64,
    },
    /// A shape parameter can be known, or a multiple of another one.
    #[error(
        "{words}: a parameter that enters nonlinearly can be known or a multiple of one other, not part of a sum"
    )]
    ShapeSum {
        /// The relation.
        words: String,
    },
    /// Shape parameters have no value in common that the bounds of each allow.
    #[error(
        "`{parameter}` would have to lie between {lower} and {upper}, which its own bounds and those of what it is tied to leave"
    )]
    ShapeRange {
        /// The parameter that follows.
        parameter: String,
        /// Lower end.
        lower: f64,
        /// Upper end, below the lower one.
        upper: f64,
    },
    /// A known part of an effort whose form is searched.
    #[error(
        "`{parameter}` is known to be {constant}, but how it acts depends on `{shape}`, which is not: state that too"
    )]
    KnownShaped {
        /// The parameter.
        parameter: String,
        /// Its known part.
        constant: f64,
        /// The shape parameter.
        shape: String,
    },
}

/// Ties of a model: which of its parameters follow from others, and how.
///
/// A tied model has the columns `W T` and the offset `o + W c` where the parameters of the whole model are `x = T y + c`: free
/// parameters keep their place, columns of the others are gone. So every estimator sees free parameters alone.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Ties {
    linear: Vec<Dependent>,
    shape: Vec<Dependent>,
}

impl Ties {
    /// Solves relations among linear parameters (places are columns), and among shape parameters.
    ///
    /// Relations that say the same count once.
    ///
    /// # Errors
    /// [`TieError::Contradiction`], [`TieError::ShapeSum`].
    pub fn new(linear: &[Relation], shape: &[Relation]) -> Result<Self, TieError> {
        let ties = Ties { linear: solve(linear)?, shape: solve(shape)? };
        let is_plain = |d: &Dependent| d.terms.is_empty() || d.multiple().is_some();
        if let Some(sum) = ties.shape.iter().find(|d| !is_plain(d)) {
            let of = |r: &&Relation| r.terms.iter().any(|(k, _)| *k == sum.index);
            let words = shape.iter().find(of).map_or_else(String::new, |r| r.words.clone());
            return Err(TieError::ShapeSum { words });
        }
        Ok(ties)
    }

    /// Whether nothing is tied.
    pub fn is_empty(&self) -> bool {
        self.linear.is_empty() && self.shape.is_empty()
    }

    /// Linear parameters that follow from others, ascending.
    pub fn linear(&self) -> &[Dependent] {
        &self.linear
    }

    /// Shape parameters that follow from others, ascending.
    pub fn shape(&self) -> &[Dependent] {
        &self.shape
    }

    /// The linear parameter of a column, if it follows from others.
    pub fn of_column(&self, column: usize) -> Option<&Dependent> {
        find(&self.linear, column)
    }

    /// The shape parameter of a place, if it follows from others.
    pub fn of_shape(&self, shape: usize) -> Option<&Dependent> {
        find(&self.shape, shape)
    }

    /// Whether a body, by its place, is another one, or the mirror image of one, or known: then it exists if that one does.
    pub fn body_follows(&self, body: usize) -> bool {
        let first = PARAMETERS_PER_BODY * body;
        let own: Option<Vec<&Dependent>> =
            (first..first + PARAMETERS_PER_BODY).map(|column| self.of_column(column)).collect();
        let Some(own) = own else { return false };
        let other = own[0].multiple().map(|(column, _)| column);
        let twin = |(k, d): (usize, &&Dependent)| {
            d.multiple().is_some_and(|(column, f)| Some(column) == other.map(|o| o + k) && f.abs() == 1.0)
        };
        own.iter().all(|d| d.terms.is_empty()) || own.iter().enumerate().all(twin)
    }

    /// Sets all linear parameters that follow from others.
    ///
    /// # Panics
    /// If `linear` is too short.
    pub fn complete(&self, linear: &mut [f64]) {
        self.linear.iter().for_each(|d| linear[d.index] = d.value(linear));
    }

    /// Sets all shape parameters that follow from others.
    ///
    /// # Panics
    /// If `shape` is too short.
    pub fn complete_shape(&self, shape: &mut [f64]) {
        self.shape.iter().for_each(|d| shape[d.index] = d.value(shape));
    }

    /// A linear parameter that follows from others in words: `j2.fc = 2 j1.fc`.
    ///
    /// # Panics
    /// If the table is that of another model.
    pub fn words(dependent: &Dependent, table: &ParameterTable) -> String {
        let name = |k: usize| table.linear[k].name.as_str();
        format!("{} = {}", name(dependent.index), side(dependent, name))
    }

    /// A shape parameter that follows from others in words.
    ///
    /// # Panics
    /// If the table is that of another model.
    pub fn shape_words(dependent: &Dependent, table: &ParameterTable) -> String {
        let name = |k: usize| table.shape[k].name.as_str();
        format!("{} = {}", name(dependent.index), side(dependent, name))
    }
}

fn find(dependents: &[Dependent], index: usize) -> Option<&Dependent> {
    dependents.binary_search_by_key(&index, |d| d.index).ok().map(|k| &dependents[k])
}

fn side<'a>(dependent: &Dependent, name: impl Fn(usize) -> &'a str) -> String {
    let mut out = String::new();
    if dependent.constant != 0.0 || dependent.terms.is_empty() {
        out = format!("{}", dependent.constant);
    }
    for (k, factor) in &dependent.terms {
        let sign = match (out.is_empty(), *factor < 0.0) {
            (true, false) => "",
            (true, true) => "-",
            (false, false) => " + ",
            (false, true) => " - ",
        };
        let size = if factor.abs() == 1.0 { String::new() } else { format!("{} ", factor.abs()) };
        out.push_str(&format!("{sign}{size}{}", name(*k)));
    }
    out
}

/// Parts of a relation below this share of its largest are rounding.
const ROUNDING: f64 = 1e-12;

/// Elimination, relation by relation: each loses the parameters that already follow, then gives one that follows from the rest.
fn solve(relations: &[Relation]) -> Result<Vec<Dependent>, TieError> {
    let mut out: Vec<Dependent> = Vec::new();
    for relation in relations {
        let size = relation.terms.iter().map(|(_, f)| f.abs()).fold(0.0, f64::max);
        let mut value = relation.value;
        let mut terms: Vec<(usize, f64)> = Vec::new();
        let mut magnitude = value.abs();
        for (k, factor) in &relation.terms {
            match out.iter().find(|d| d.index == *k) {
                None => add(&mut terms, *k, *factor),
                Some(known) => {
                    value -= factor * known.constant;
                    magnitude = magnitude.max((factor * known.constant).abs());
                    known.terms.iter().for_each(|(j, f)| add(&mut terms, *j, factor * f));
                }
            }
        }
        terms.retain(|(_, f)| f.abs() > ROUNDING * size);
        let Some((index, pivot)) = terms.pop() else {
            if value.abs() > ROUNDING * magnitude {
                return Err(TieError::Contradiction { words: relation.words.clone(), left: value });
            }
            continue;
        };
        let terms: Vec<(usize, f64)> = terms.into_iter().map(|(k, f)| (k, -f / pivot)).collect();
        let found = Dependent { index, terms, constant: value / pivot };
        // What followed from it follows from what it follows from.
        for other in &mut out {
            let Some(place) = other.terms.iter().position(|(k, _)| *k == index) else { continue };
            let (_, factor) = other.terms.remove(place);
            other.constant += factor * found.constant;
            found.terms.iter().for_each(|(k, f)| add(&mut other.terms, *k, factor * f));
            other.terms.retain(|(_, f)| *f != 0.0);
        }
        out.push(found);
    }
    out.sort_by_key(|d| d.index);
    Ok(out)
}

fn add(terms: &mut Vec<(usize, f64)>, index: usize, factor: f64) {
    match terms.iter_mut().find(|(k, _)| *k == index) {
        Some((_, sum)) => *sum += factor,
        None => terms.push((index, factor)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn relation(terms: &[(usize, f64)], value: f64) -> Relation {
        Relation { terms: terms.to_vec(), value, words: format!("{terms:?} = {value}") }
    }

    #[test]
    fn relations_are_solved_for_the_parameters_named_last() {
        let ties = Ties::new(
            &[
                relation(&[(0, 1.0), (1, -1.0)], 0.0),
                relation(&[(1, 1.0), (2, 1.0), (3, 2.0)], 7.0),
                relation(&[(2, 1.0)], 3.0),
                // Follows from the ones before.
                relation(&[(0, 1.0), (3, 2.0)], 4.0),
            ],
            &[],
        )
        .unwrap();
        let mut x = [5.0, 0.0, 0.0, 0.0, 9.0];
        ties.complete(&mut x);
        assert_eq!(x, [5.0, 5.0, 3.0, -0.5, 9.0]);
        assert_eq!(ties.of_column(1).unwrap().multiple(), Some((0, 1.0)));
        assert_eq!(ties.of_column(2).unwrap().terms, []);
        assert!(ties.of_column(0).is_none());
    }

    #[test]
    fn contradictions_name_the_relation_that_fails() {
        let relations =
            [relation(&[(0, 1.0), (1, -1.0)], 0.0), relation(&[(0, 1.0)], 2.0), relation(&[(1, 1.0)], 3.0)];
        let found = Ties::new(&relations, &[]).unwrap_err();
        assert_eq!(found, TieError::Contradiction { words: relations[2].words.clone(), left: 1.0 });
        let sum = [relation(&[(0, 1.0), (1, 1.0)], 2.0)];
        assert_eq!(Ties::new(&[], &sum).unwrap_err(), TieError::ShapeSum { words: sum[0].words.clone() });
    }

    #[test]
    fn what_follows_from_a_parameter_that_comes_to_follow_goes_on_with_it() {
        let relations = [relation(&[(1, 1.0), (2, -2.0)], 0.0), relation(&[(0, 1.0), (1, -1.0)], 0.5)];
        let ties = Ties::new(&relations, &[]).unwrap();
        let mut x = [3.0, 0.0, 0.0];
        ties.complete(&mut x);
        assert_eq!(x, [3.0, 2.5, 1.25]);
    }
}
