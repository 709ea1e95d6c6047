//! Estimator and bounds of a run.

use std::collections::BTreeMap;

use dynid_estimate::separable::ShapeSearch;
use dynid_search::{self as search, Algorithm};
use serde::{Deserialize, Serialize};

use super::{SearchConfig, Settings};
use crate::Error;

/// Limits beyond this are a slip or were meant to be infinite, whatever the unit.
const LARGEST_LIMIT: f64 = 1e9;

/// Linear estimator.
#[derive(Debug, Clone, Copy, Default, Deserialize, Serialize, PartialEq, Eq)]
#[serde(rename_all = "lowercase")]
pub enum Method {
    /// Ordinary least squares: all rows alike.
    Ols,
    /// Weighted by residual variances that are estimated along the way, shared as [`EstimatorConfig::variances`] says.
    #[default]
    Wls,
    /// Huber's loss: for some per cent of gross errors.
    Huber,
    /// Tukey's biweight: gross errors lose all influence.
    Tukey,
    /// Weighted, with the robot file as a Gaussian prior.
    Ridge,
    /// Total least squares: columns with errors of their own, see [`EstimatorConfig::column_noise`].
    Tls,
    /// Instrumental variables from simulations of the closed loop, weighted as `wls`; needs the closed loop (`[instruments]`).
    Iv,
    /// Direct and inverse dynamic identification model: efforts on the regressor of simulations of the closed loop, weighted as `wls`; needs the
    /// closed loop (`[instruments]`), which must be the one that the log was recorded in.
    Didim,
    /// Closed-loop output error: positions on their slopes along simulations of the closed loop, weighted as `wls`; needs the closed loop as
    /// `didim` does.
    Cloe,
}

impl Method {
    /// Whether it simulates the closed loop.
    pub fn simulates(self) -> bool {
        matches!(self, Method::Iv | Method::Didim | Method::Cloe)
    }
}

/// Which rows share a residual variance.
#[derive(Debug, Clone, Copy, Default, Deserialize, Serialize, PartialEq, Eq)]
#[serde(rename_all = "kebab-case")]
pub enum Variances {
    /// One per joint, log and kernel scale.
    #[default]
    Group,
    /// One per joint and log.
    JointAndLog,
    /// One per joint.
    Joint,
}

/// Which bodies the standard parameters may describe.
#[derive(Debug, Clone, Copy, Default, Deserialize, Serialize, PartialEq, Eq)]
#[serde(rename_all = "kebab-case")]
pub enum Consistency {
    /// Some mass distribution has them (4 x 4 pseudo-inertia).
    #[default]
    PseudoInertia,
    /// Positive mass and inertia about the centre of mass, triangle inequality or not (6 x 6 spatial inertia).
    SpatialInertia,
    /// Any numbers: base values as identified, split as near as possible to the robot file.
    None,
}

/// How distance from the robot file is measured in directions that the data do not see.
#[derive(Debug, Clone, Copy, Deserialize, Serialize, PartialEq, Eq)]
#[serde(rename_all = "lowercase")]
pub enum PriorDistance {
    /// Squared distance in units of the prior standard deviations (half the mass, and the moments that go with it).
    Quadratic,
    /// Entropic (Bregman log-det) divergence, the same in every frame and unit.
    Entropic,
}

/// How the shape parameters of friction are searched; the best point found is refined by Gauss-Newton either way.
#[derive(Debug, Clone, Default, Deserialize, Serialize, PartialEq)]
#[serde(deny_unknown_fields, default)]
pub struct ShapeConfig {
    /// A search over the whole box of bounds: `abc`, `cs`, `ics`, `pso`, `gps`, `cma-es`, `de` (see
    /// [`Algorithm`](dynid_search::Algorithm)). Default: Gauss-Newton from several starts.
    pub search: Option<String>,
    /// Evaluations of that search. Default 2000.
    pub evaluations: Option<u64>,
    /// Starts of Gauss-Newton without a search. Default 20.
    pub starts: Option<usize>,
}

impl ShapeConfig {
    /// The search asked for, if any.
    ///
    /// # Errors
    /// [`Error::Setting`] for an unknown algorithm or a count of 0.
    pub fn search(&self, seed: u64) -> Result<Option<ShapeSearch>, Error> {
        for (name, count) in
            [("shape.evaluations", self.evaluations), ("shape.starts", self.starts.map(|n| n as u64))]
        {
            if count == Some(0) {
                return Err(Error::setting(name, "at least 1", 0));
            }
        }
        let Some(name) = &self.search else { return Ok(None) };
        let algorithm: Algorithm = name.parse().map_err(|_| {
            Error::setting("shape.search", &format!("one of {}", Algorithm::NAMES.join(", ")), name)
        })?;
        let evaluations = Some(self.evaluations.unwrap_or(SEARCH_EVALUATIONS));
        let settings = search::Settings { evaluations, seed, ..search::Settings::default() };
        Ok(Some(ShapeSearch { algorithm, settings }))
    }
}

/// Evaluations of a search unless stated otherwise: each is a linear fit of all rows.
const SEARCH_EVALUATIONS: u64 = 2000;

/// Settings of the estimator.
#[derive(Debug, Clone, Default, Deserialize, Serialize, PartialEq)]
#[serde(deny_unknown_fields, default)]
pub struct EstimatorConfig {
    /// Method. Default `wls`.
    pub method: Method,
    /// Which rows share a residual variance. Default `group`.
    pub variances: Variances,
    /// Weight of the robot file in `ridge`; 1 means a Gaussian prior. Default 1.
    pub ridge_weight: Option<f64>,
    /// For `tls`: standard deviation of the errors of base columns, by name of the kept parameter, in the column's unit.
    /// Columns not named are exact.
    pub column_noise: BTreeMap<String, f64>,
    /// For `tls`: standard deviation of the effort, in the effort's unit.
    pub effort_noise: Option<f64>,
    /// Which bodies the standard parameters may describe. Default `pseudo-inertia`.
    pub consistency: Consistency,
    /// Distance from the robot file. Default: where it states all bodies, that with the least error on held-out folds; `quadratic` else, where
    /// nothing is held out, beside a `prior_weight` or a payload to be found, and with `spatial-inertia`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub prior: Option<PriorDistance>,
    /// Search of shape parameters.
    pub shape: ShapeConfig,
    /// Searches over all parameters within bounds, beside the least-squares answer. Default: none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub search: Option<SearchConfig>,
    /// Weight of that distance, residual variances per squared deviation or per nat. Default: as large as held-out folds
    /// allow, at most that of a Gaussian prior.
    pub prior_weight: Option<f64>,
}

/// Bounds that the consistent estimate must meet: on the total mass and on the centre of mass of one or more links, or
/// on any parameter. `[lower, upper]`; `-inf` and `inf` leave a side open; finite limits are at most 1e9 in size.
#[derive(Debug, Clone, Default, Deserialize, Serialize, PartialEq)]
#[serde(deny_unknown_fields, default)]
pub struct BoundConfig {
    /// Moving links; a link stands for everything welded to it.
    pub links: Vec<String>,
    /// Sum of their masses, kg.
    #[serde(deserialize_with = "super::lists::pair")]
    pub mass: Option<(f64, f64)>,
    /// Centre of mass of a single link along x of its frame, m.
    #[serde(deserialize_with = "super::lists::pair")]
    pub com_x: Option<(f64, f64)>,
    /// Centre of mass of a single link along y, m.
    #[serde(deserialize_with = "super::lists::pair")]
    pub com_y: Option<(f64, f64)>,
    /// Centre of mass of a single link along z, m.
    #[serde(deserialize_with = "super::lists::pair")]
    pub com_z: Option<(f64, f64)>,
    /// A parameter, by name such as `joint1.fc`.
    pub parameter: Option<String>,
    /// Range of the parameter, in its unit.
    #[serde(deserialize_with = "super::lists::pair")]
    pub range: Option<(f64, f64)>,
}

impl Settings {
    pub(super) fn check_estimator(&self) -> Result<(), Error> {
        let e = &self.estimator;
        let weights = [
            ("ridge_weight", e.ridge_weight),
            ("prior_weight", e.prior_weight),
            ("effort_noise", e.effort_noise),
        ];
        for (name, value) in weights {
            if let Some(x) = value
                && !(x.is_finite() && x > 0.0)
            {
                return Err(Error::setting(name, "a positive number", x));
            }
        }
        for (name, x) in &e.column_noise {
            if !(x.is_finite() && *x >= 0.0) {
                return Err(Error::setting(
                    &format!("column_noise.{name}"),
                    "a number that is not negative",
                    x,
                ));
            }
        }
        e.shape.search(1)?;
        e.search.iter().try_for_each(SearchConfig::check)?;
        if e.method == Method::Tls && e.effort_noise.is_none() {
            return Err(Error::setting(
                "effort_noise",
                "the standard deviation of the effort, which `tls` needs",
                "nothing",
            ));
        }
        if e.prior == Some(PriorDistance::Entropic) && e.consistency == Consistency::SpatialInertia {
            return Err(Error::setting("prior", "`quadratic` with the 6 x 6 form", "`entropic`"));
        }
        if e.consistency == Consistency::None && !self.bound.is_empty() {
            return Err(Error::setting(
                "consistency",
                "`pseudo-inertia` or `spatial-inertia`, as there are bounds",
                "`none`",
            ));
        }
        if e.method.simulates() && self.closed_loop.is_none() {
            let expected =
                "a table with reference and controller, which the methods `iv`, `didim` and `cloe` simulate";
            return Err(Error::setting("instruments", expected, "none"));
        }
        self.bound.iter().try_for_each(BoundConfig::check)
    }
}

impl BoundConfig {
    /// Every range of the entry with its key.
    pub fn ranges(&self) -> impl Iterator<Item = (&'static str, (f64, f64))> {
        let all = [
            ("mass", self.mass),
            ("com_x", self.com_x),
            ("com_y", self.com_y),
            ("com_z", self.com_z),
            ("range", self.range),
        ];
        all.into_iter().filter_map(|(key, range)| Some((key, range?)))
    }

    fn check(&self) -> Result<(), Error> {
        let complete = match (&self.parameter, self.links.len()) {
            (Some(_), 0) => self.ranges().all(|(key, _)| key == "range") && self.range.is_some(),
            (None, 1) => self.range.is_none() && self.ranges().next().is_some(),
            (None, 2..) => self.ranges().all(|(key, _)| key == "mass") && self.mass.is_some(),
            _ => false,
        };
        if !complete {
            let expected = "`links` with `mass` (or, for one link, `com_x`, `com_y`, `com_z`), or `parameter` with `range`";
            return Err(Error::setting("bound", expected, self.keys()));
        }
        let twice = self.links.iter().enumerate().find(|(k, link)| self.links[..*k].contains(link));
        if let Some((_, link)) = twice {
            return Err(Error::setting("bound.links", "every link once", format!("`{link}` twice")));
        }
        for (key, (lower, upper)) in self.ranges() {
            // Infinity as lower limit, or minus infinity as upper one, admits no number.
            let possible = lower <= upper && lower < f64::INFINITY && upper > f64::NEG_INFINITY;
            if !possible || !(lower.is_finite() || upper.is_finite()) {
                let of = self.parameter.as_ref().map_or_else(|| self.links.join("`, `"), Clone::clone);
                let expected = "[lower, upper] with lower not above upper and one of them finite";
                let found = format!("[{lower}, {upper}] for `{of}`");
                return Err(Error::setting(&format!("bound.{key}"), expected, found));
            }
            if let Some(x) = [lower, upper].into_iter().find(|x| x.is_finite() && x.abs() > LARGEST_LIMIT) {
                let expected = format!("limits up to {LARGEST_LIMIT:e}, or `-inf` and `inf`");
                return Err(Error::setting(&format!("bound.{key}"), &expected, format!("{x:e}")));
            }
        }
        Ok(())
    }

    /// The keys that are given, as a user would say it.
    fn keys(&self) -> String {
        let links = match self.links.len() {
            0 => None,
            1 => Some("`links` with one link".to_owned()),
            n => Some(format!("`links` with {n} links")),
        };
        let parameter = self.parameter.as_ref().map(|_| "`parameter`".to_owned());
        let ranges = self.ranges().map(|(key, _)| format!("`{key}`"));
        let keys: Vec<String> = links.into_iter().chain(parameter).chain(ranges).collect();
        if keys.is_empty() { "none of them".to_owned() } else { keys.join(", ") }
    }
}
