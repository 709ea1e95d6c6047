//! What is to be estimated, and what may be wrong with asking for it.

use dynid_linalg::Mat;
use dynid_model::Inertia;
use dynid_model::symmetric::cholesky;

/// Which bodies are allowed.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Form {
    /// Pseudo-inertia `P ⪰ 0`: some mass distribution has these parameters.
    #[default]
    PseudoInertia,
    /// Spatial inertia `[[I, S(h)ᵀ], [S(h), m 1]] ⪰ 0`: mass and tensor about the centre of mass are positive, but the
    /// triangle inequality may fail (Sousa & Cortesão 2014).
    SpatialInertia,
}

/// How far inside the boundary an estimate stays.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Margin {
    /// `P ⪰ ε P0`, scalars `≥ ε` times their scale. Independent of frames and units.
    Relative(f64),
    /// `P ⪰ ε 1`, scalars `≥ ε`, in SI units.
    Absolute(f64),
}

/// Settings of [`super::estimate`].
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    /// Which bodies are allowed. Default: pseudo-inertia.
    pub form: Form,
    /// Weight `δ` of the squared whitened distance to the prior. Default 1e-8: fills what the data do not see, costs
    /// nothing that they do.
    pub prior_weight: f64,
    /// Weight `w` of a Gaussian prior `Σ ((x_j - x0_j)/σ0_j)²` with the deviations of [`Problem::prior_std`]; 1 takes them
    /// at their word. Default 0.
    pub gaussian_weight: f64,
    /// Weight `γ` of the entropic distance to the prior, residual variances per nat. Default 0.
    pub entropic_weight: f64,
    /// Margin. Default `Relative(1e-6)`.
    pub margin: Margin,
}

impl Default for Settings {
    fn default() -> Self {
        Settings {
            form: Form::PseudoInertia,
            prior_weight: 1e-8,
            gaussian_weight: 0.0,
            entropic_weight: 0.0,
            margin: Margin::Relative(1e-6),
        }
    }
}

/// A link: ten consecutive columns `m, mx, my, mz, Ixx, Ixy, Ixz, Iyy, Iyz, Izz` and a body to measure against.
#[derive(Debug, Clone, PartialEq)]
pub struct LinkPrior {
    /// Name.
    pub name: String,
    /// Column of the mass.
    pub first_column: usize,
    /// Prior body; its pseudo-inertia is positive definite.
    pub prior: Inertia,
}

/// A parameter that is no link's.
#[derive(Debug, Clone, PartialEq)]
pub struct ScalarPrior {
    /// Name.
    pub name: String,
    /// Column.
    pub column: usize,
    /// Prior value, in the parameter's unit.
    pub prior: f64,
    /// Scale, in the parameter's unit: a deviation of this size is ordinary.
    pub scale: f64,
    /// Whether it must stay positive (by the margin).
    pub nonnegative: bool,
}

/// A linear bound `Σ factor · x[column] ≤ upper`.
#[derive(Debug, Clone, PartialEq)]
pub struct Bound {
    /// What it says, for messages.
    pub name: String,
    /// `(column, factor)`.
    pub terms: Vec<(usize, f64)>,
    /// Right-hand side.
    pub upper: f64,
}

/// An equality `Σ factor · x[column] = value`.
#[derive(Debug, Clone, PartialEq)]
pub struct Equality {
    /// What it says, for messages.
    pub name: String,
    /// `(column, factor)`.
    pub terms: Vec<(usize, f64)>,
    /// Right-hand side.
    pub value: f64,
}

/// Data, priors, bounds and equalities. Every column belongs to one link or one scalar.
#[derive(Debug, Clone, PartialEq)]
pub struct Problem {
    /// Weighted regressor or its triangular factor: any number of rows, one column per standard parameter.
    pub r: Mat,
    /// Weighted effort of the rows of `r`.
    pub z: Vec<f64>,
    /// Links.
    pub links: Vec<LinkPrior>,
    /// Other parameters.
    pub scalars: Vec<ScalarPrior>,
    /// Bounds.
    pub bounds: Vec<Bound>,
    /// Equalities that hold exactly, independent of each other.
    pub equalities: Vec<Equality>,
    /// Prior standard deviations, one per column, positive; needed with a [`Settings::gaussian_weight`] only. Infinite: nothing is known.
    pub prior_std: Vec<f64>,
}

/// Why a problem has no consistent estimate.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ProblemError {
    /// A number is not finite, or a weight is out of range.
    #[error("{what}: expected {expected}, found {found}")]
    Number {
        /// Name of the number.
        what: String,
        /// What it should be.
        expected: &'static str,
        /// What it is.
        found: f64,
    },
    /// Sizes do not fit.
    #[error("{what}: expected {expected}, found {found}")]
    Shape {
        /// Name of the size.
        what: String,
        /// What it should be.
        expected: usize,
        /// What it is.
        found: usize,
    },
    /// A column is claimed twice or by nobody.
    #[error("column {column}: expected to belong to one link or one scalar, found {found}")]
    Column {
        /// Column.
        column: usize,
        /// Number of claims.
        found: usize,
    },
    /// A prior body that is none.
    #[error(
        "prior of link `{link}`: expected a body with positive definite pseudo-inertia, found one that {fault}"
    )]
    Prior {
        /// Link.
        link: String,
        /// What is wrong with it.
        fault: &'static str,
    },
    /// The entropic distance needs positive definite pseudo-inertias.
    #[error("an entropic prior needs the pseudo-inertia form")]
    EntropicForm,
    /// Two bounds exclude each other.
    #[error("{first} contradicts {second}")]
    Contradiction {
        /// One of them.
        first: String,
        /// The second of the two.
        second: String,
    },
    /// No consistent parameters meet all bounds.
    #[error("no physically consistent parameters meet these together: {}", conflict.join("; "))]
    Infeasible {
        /// Bounds (and links) that exclude each other.
        conflict: Vec<String>,
        /// Least violation of all that is possible, in whitened units.
        violation: f64,
    },
}

impl Problem {
    /// Number of columns.
    pub fn columns(&self) -> usize {
        self.r.ncols()
    }

    pub(super) fn check(&self, settings: &Settings) -> Result<(), ProblemError> {
        let number = |what: &str, expected, found: f64, good: bool| match good {
            true => Ok(()),
            false => Err(ProblemError::Number { what: what.to_owned(), expected, found }),
        };
        let finite = |what: &str, found: f64| number(what, "a finite number", found, found.is_finite());
        let (delta, gamma) = (settings.prior_weight, settings.entropic_weight);
        number("prior weight", "a positive number", delta, delta.is_finite() && delta > 0.0)?;
        number("entropic weight", "a number that is not negative", gamma, gamma.is_finite() && gamma >= 0.0)?;
        let w = settings.gaussian_weight;
        number("Gaussian weight", "a number that is not negative", w, w.is_finite() && w >= 0.0)?;
        if w > 0.0 && self.prior_std.len() != self.columns() {
            let what = "prior standard deviations".to_owned();
            return Err(ProblemError::Shape { what, expected: self.columns(), found: self.prior_std.len() });
        }
        for (j, s) in self.prior_std.iter().enumerate() {
            let what = format!("prior standard deviation of column {j}");
            number(&what, "a positive number", *s, *s > 0.0)?;
        }
        let (Margin::Relative(margin) | Margin::Absolute(margin)) = settings.margin;
        number("margin", "a number in [0, 1)", margin, (0.0..1.0).contains(&margin))?;
        if gamma > 0.0 && settings.form != Form::PseudoInertia {
            return Err(ProblemError::EntropicForm);
        }
        if self.r.nrows() != self.z.len() {
            let what = "entries of z".to_owned();
            return Err(ProblemError::Shape { what, expected: self.r.nrows(), found: self.z.len() });
        }
        for (j, column) in self.r.col_iter().enumerate() {
            column.iter().try_for_each(|x| finite(&format!("column {j} of R"), *x))?;
        }
        self.z.iter().try_for_each(|z| finite("z", *z))?;
        self.check_columns()?;
        for link in &self.links {
            let fault = link.prior.physical_fault().unwrap_or("has a singular pseudo-inertia");
            if cholesky(&link.prior.pseudo_inertia()).is_none() {
                return Err(ProblemError::Prior { link: link.name.clone(), fault });
            }
        }
        for scalar in &self.scalars {
            finite(&format!("prior of `{}`", scalar.name), scalar.prior)?;
            let what = format!("scale of `{}`", scalar.name);
            number(&what, "a positive number", scalar.scale, scalar.scale.is_finite() && scalar.scale > 0.0)?;
        }
        let bounds = self.bounds.iter().map(|b| (&b.name, &b.terms, b.upper));
        for (name, terms, right) in bounds.chain(self.equalities.iter().map(|e| (&e.name, &e.terms, e.value)))
        {
            finite(&format!("right-hand side of `{name}`"), right)?;
            let mut size = 0.0_f64;
            for (column, factor) in terms {
                finite(&format!("factor of `{name}`"), *factor)?;
                size = size.max(factor.abs());
                if *column >= self.columns() {
                    let what = format!("column in `{name}`");
                    return Err(ProblemError::Shape { what, expected: self.columns() - 1, found: *column });
                }
            }
            number(&format!("factors of `{name}`"), "one that is not zero", size, size > 0.0)?;
        }
        Ok(())
    }

    fn check_columns(&self) -> Result<(), ProblemError> {
        let mut claims = vec![0usize; self.columns()];
        let of_links = self.links.iter().flat_map(|l| l.first_column..l.first_column + 10);
        for column in of_links.chain(self.scalars.iter().map(|s| s.column)) {
            match claims.get_mut(column) {
                Some(claim) => *claim += 1,
                None => {
                    let what = "largest column of a link or scalar".to_owned();
                    let expected = self.columns().saturating_sub(1);
                    return Err(ProblemError::Shape { what, expected, found: column });
                }
            }
        }
        match claims.iter().position(|c| *c != 1) {
            Some(column) => Err(ProblemError::Column { column, found: claims[column] }),
            None => Ok(()),
        }
    }
}
