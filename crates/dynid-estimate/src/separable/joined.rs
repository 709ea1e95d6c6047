//! Problems with the same parameters, fitted together.

use super::limit::Bound;
use super::problem::{RowGroup, SeparableProblem, ShapedColumns};
use dynid_model::ShapeParameter;

/// The rows of several problems that share linear and shape parameters: logs of motion and points of a friction
/// experiment, say. Groups are those of the first part, then those of the next.
pub struct JoinedProblem<'a> {
    parts: Vec<&'a dyn SeparableProblem>,
    groups: Vec<RowGroup>,
}

impl std::fmt::Debug for JoinedProblem<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("JoinedProblem").field("parameters", &self.shape()).finish_non_exhaustive()
    }
}

impl<'a> JoinedProblem<'a> {
    /// Joins problems; starts, bounds and limit models of the shape parameters are those of the first.
    ///
    /// # Panics
    /// Without a problem, or if numbers of parameters differ.
    pub fn new(parts: Vec<&'a dyn SeparableProblem>) -> Self {
        let counts = |p: &dyn SeparableProblem| (p.linear(), p.shape().len());
        assert!(parts.iter().all(|p| counts(*p) == counts(parts[0])), "numbers of parameters");
        let groups = parts.iter().flat_map(|p| p.groups().iter().cloned()).collect();
        JoinedProblem { parts, groups }
    }
}

impl SeparableProblem for JoinedProblem<'_> {
    fn linear(&self) -> usize {
        self.parts[0].linear()
    }
    fn shape(&self) -> &[ShapeParameter] {
        self.parts[0].shape()
    }
    fn groups(&self) -> &[RowGroup] {
        &self.groups
    }
    fn shaped(&self, shape: &[f64], out: &mut [ShapedColumns]) {
        let mut rest = out;
        for part in &self.parts {
            let (own, others) = rest.split_at_mut(part.groups().len());
            part.shaped(shape, own);
            rest = others;
        }
    }
    fn limit(&self, parameter: usize, bound: Bound) -> Option<&'static str> {
        self.parts[0].limit(parameter, bound)
    }
}
