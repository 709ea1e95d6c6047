//! State of a separable fit, and the linear fits that follow from it.

use super::linearised::Linearisation;
use super::problem::SeparableProblem;
use super::projection::Projection;
use super::reduction::GroupReduction;
use super::scale::SearchBox;
use super::settings::{SeparableError, SeparableSettings, Weighting};
use crate::linear::{LinearEstimate, LinearMethod, LinearSettings, estimate};
use dynid_factor::groups::ReducedGroup;
use rayon::prelude::*;

/// State of a fit.
pub(super) struct Work<'a> {
    pub(super) problem: &'a dyn SeparableProblem,
    pub(super) settings: &'a SeparableSettings,
    pub(super) bounds: SearchBox,
    pub(super) reductions: Vec<GroupReduction>,
    pub(super) linearisation: Linearisation<'a>,
    /// `σ_j²` per group.
    pub(super) variances: Vec<f64>,
    pub(super) u: Vec<f64>,
    pub(super) linear: Vec<f64>,
    pub(super) held: Vec<bool>,
}

impl<'a> Work<'a> {
    pub(super) fn new(
        problem: &'a dyn SeparableProblem,
        settings: &'a SeparableSettings,
    ) -> Result<Self, SeparableError> {
        let bounds = SearchBox::new(problem.shape());
        let groups = problem.groups();
        Ok(Work {
            problem,
            settings,
            reductions: groups.par_iter().map(|g| GroupReduction::new(g, None)).collect(),
            linearisation: Linearisation::new(problem)?,
            variances: vec![1.0; groups.len()],
            u: bounds.start.clone(),
            linear: vec![0.0; problem.linear()],
            held: (0..bounds.len()).map(|k| bounds.lower[k] == bounds.upper[k]).collect(),
            bounds,
        })
    }

    pub(super) fn projection(&self) -> Projection<'_> {
        Projection::new(self.problem, &self.reductions, self.weights())
    }

    pub(super) fn weights(&self) -> Vec<f64> {
        self.variances.iter().map(|v| 1.0 / v.sqrt()).collect()
    }

    pub(super) fn shape(&self) -> Vec<f64> {
        self.bounds.natural(&self.u)
    }

    /// Shape parameters that are neither held nor at a bound.
    pub(super) fn active(&self) -> Vec<usize> {
        let inside = |k: usize| !self.bounds.at_lower(k, self.u[k]) && !self.bounds.at_upper(k, self.u[k]);
        (0..self.u.len()).filter(|k| !self.held[*k] && inside(*k)).collect()
    }

    /// Settings of the linear estimators that follow the linearised problem.
    pub(super) fn linear_settings(&self) -> LinearSettings {
        match &self.settings.weighting {
            Weighting::Equal => {
                LinearSettings { irls: self.settings.irls.clone(), ..LinearSettings::default() }
            }
            Weighting::Groups { sharing, wls } => {
                LinearSettings { wls: wls.clone(), sharing: *sharing, irls: self.settings.irls.clone() }
            }
        }
    }

    /// `start`: variances to start from; empty: 1 for all.
    pub(super) fn linear_estimate(
        &self,
        groups: &[ReducedGroup],
        active: usize,
        start: &[f64],
    ) -> Result<LinearEstimate, SeparableError> {
        let method = match self.settings.weighting {
            Weighting::Equal => LinearMethod::Ols,
            Weighting::Groups { .. } => LinearMethod::Wls,
        };
        let mut settings = self.linear_settings();
        settings.wls.start = start.to_vec();
        Ok(estimate(groups, None, self.problem.linear() + active, &method, &settings)?)
    }

    /// Least-squares estimate of the linearised problem with all time blocks.
    pub(super) fn linearised(&self) -> Result<LinearEstimate, SeparableError> {
        let active = self.active();
        let groups = self.linearisation.reduced(&self.linear, &self.shape(), &active)?;
        self.linear_estimate(&groups, active.len(), &[])
    }
}
