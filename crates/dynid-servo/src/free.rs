//! Parameters that a fit is free to choose.

use dynid_model::Inertia;

use crate::deviation::{Body, DEVIATIONS};
use crate::joint::ServoJoint;
use crate::term::Term;

/// Farthest that a number of a deviation goes: masses and second moments by a factor of twenty.
const MOST_DEVIATION: f64 = 1.5;

/// What a free parameter is.
#[derive(Debug, Clone, PartialEq)]
pub enum Target {
    /// A term that these joints share.
    Term {
        /// The term.
        term: Term,
        /// Joints of the robot.
        joints: Vec<usize>,
    },
    /// A standard inertial parameter of the robot, by its place in
    /// [`Mechanism::inertia_vector`](dynid_model::Mechanism::inertia_vector). Of regrouped parameters the one that stands for them.
    Inertia(usize),
    /// A number of a body's deviation.
    Body(Body, usize),
}

/// What is known of a parameter beforehand.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Known {
    /// Value.
    pub value: f64,
    /// Standard deviation of the truth about it.
    pub std: f64,
    /// Factor by which a fit takes it for surer than that: rows with errors of one sign outweigh any knowledge.
    pub pull: f64,
}

impl Known {
    /// Its weight in a sum of squares, `(pull/std)²`.
    pub(crate) fn weight(&self) -> f64 {
        (self.pull / self.std).powi(2)
    }
}

/// A free parameter with what is known of it beforehand.
#[derive(Debug, Clone, PartialEq)]
pub struct Free {
    /// What it is.
    pub target: Target,
    /// Least value.
    pub lower: f64,
    /// Greatest value.
    pub upper: f64,
    /// What is known beforehand.
    pub prior: Option<Known>,
}

impl Free {
    /// A term of some joints within what physics allows.
    pub fn term(term: Term, joints: impl IntoIterator<Item = usize>) -> Self {
        let (lower, upper) = term.range();
        Free {
            target: Target::Term { term, joints: joints.into_iter().collect() },
            lower,
            upper,
            prior: None,
        }
    }

    /// An inertial parameter without bounds.
    pub fn inertia(entry: usize) -> Self {
        Free { target: Target::Inertia(entry), lower: f64::NEG_INFINITY, upper: f64::INFINITY, prior: None }
    }

    /// All numbers of a body's deviation, whose mass is known with a relative standard deviation, and that much surer to a fit.
    pub fn body(body: Body, relative: f64, pull: f64) -> impl Iterator<Item = Self> {
        (0..DEVIATIONS).map(move |k| {
            let prior = Some(Known { value: 0.0, std: Body::std(k, relative), pull });
            Free { target: Target::Body(body, k), lower: -MOST_DEVIATION, upper: MOST_DEVIATION, prior }
        })
    }

    /// Returns the parameter with a value known beforehand.
    #[must_use]
    pub fn known(mut self, value: f64, std: f64) -> Self {
        self.prior = Some(Known { value, std, pull: 1.0 });
        self
    }

    /// The term, if it is one.
    pub fn as_term(&self) -> Option<Term> {
        match &self.target {
            Target::Term { term, .. } => Some(*term),
            Target::Inertia(_) | Target::Body(..) => None,
        }
    }

    /// Joints that have the parameter; none for inertias and bodies.
    pub fn joints(&self) -> &[usize] {
        match &self.target {
            Target::Term { joints, .. } => joints,
            Target::Inertia(_) | Target::Body(..) => &[],
        }
    }
}

/// All numbers of a robot behind its drives.
#[derive(Debug, Clone, PartialEq)]
pub struct ServoValues {
    /// Joints in the order of the mechanism's rates.
    pub joints: Vec<ServoJoint>,
    /// Standard inertial parameters.
    pub inertias: Vec<f64>,
}

impl ServoValues {
    /// Value of a free parameter: for a shared one that of its first joint.
    pub fn get(&self, free: &Free) -> f64 {
        match &free.target {
            Target::Term { term, joints } => joints.first().map_or(0.0, |j| self.joints[*j].get(*term)),
            Target::Inertia(entry) => self.inertias[*entry],
            Target::Body(body, k) => body.deviation(&self.body(body.body))[*k],
        }
    }

    /// Sets a free parameter.
    pub fn set(&mut self, free: &Free, value: f64) {
        match &free.target {
            Target::Term { term, joints } => joints.iter().for_each(|j| self.joints[*j].set(*term, value)),
            Target::Inertia(entry) => self.inertias[*entry] = value,
            Target::Body(body, k) => {
                let mut deviation = body.deviation(&self.body(body.body));
                deviation[*k] = value;
                let first = DEVIATIONS * body.body;
                self.inertias[first..first + DEVIATIONS].copy_from_slice(&body.inertia(&deviation).0);
            }
        }
    }

    /// Inertia of a body about its joint frame.
    pub fn body(&self, body: usize) -> Inertia {
        Inertia(std::array::from_fn(|k| self.inertias[DEVIATIONS * body + k]))
    }

    /// Values of free parameters.
    pub fn gather(&self, free: &[Free]) -> Vec<f64> {
        free.iter().map(|f| self.get(f)).collect()
    }

    /// Returns the numbers with other values of free parameters.
    #[must_use]
    pub fn with(&self, free: &[Free], values: &[f64]) -> ServoValues {
        let mut out = self.clone();
        for (f, value) in free.iter().zip(values) {
            out.set(f, *value);
        }
        out
    }
}
