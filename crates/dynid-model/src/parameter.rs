//! The table of parameters of an effort model.

/// What a parameter belongs to.
#[derive(Debug, Clone, PartialEq)]
pub enum Owner {
    /// A link.
    Link(String),
    /// A joint.
    Joint(String),
}

/// A parameter that enters the effort linearly.
#[derive(Debug, Clone, PartialEq)]
pub struct Parameter {
    /// Full name: `<link>.Izz`, `<joint>.fc`.
    pub name: String,
    /// Short symbol for expressions, numbered by joint order from 1: `Izz3`, `fc3`.
    pub symbol: String,
    /// Unit.
    pub unit: &'static str,
    /// Link or joint.
    pub owner: Owner,
    /// Value stated by the robot file, if any.
    pub prior: Option<f64>,
    /// Smallest value that makes sense, if there is one.
    pub lower: Option<f64>,
    /// Largest value that makes sense, if there is one.
    pub upper: Option<f64>,
    /// True for parameters that a regrouping should fold into others where there is a choice.
    pub fold_first: bool,
}

/// A parameter that enters the effort nonlinearly.
#[derive(Debug, Clone, PartialEq)]
pub struct ShapeParameter {
    /// Full name: `<joint>.vs`.
    pub name: String,
    /// Unit.
    pub unit: &'static str,
    /// Value where nothing else is said: the start of searches; in an identified model the value found.
    pub start: f64,
    /// Lower bound.
    pub lower: f64,
    /// Upper bound.
    pub upper: f64,
    /// Search on a logarithmic scale.
    pub logarithmic: bool,
}

/// All parameters of an effort model: linear ones are the columns of its regressor.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ParameterTable {
    /// Linear parameters in column order.
    pub linear: Vec<Parameter>,
    /// Shape parameters in the order of the shape vector.
    pub shape: Vec<ShapeParameter>,
}

impl ParameterTable {
    /// Column of the linear parameter with this name.
    pub fn column(&self, name: &str) -> Option<usize> {
        self.linear.iter().position(|p| p.name == name)
    }

    /// Start value of the shape parameter with this name.
    pub fn shape_value(&self, name: &str) -> Option<f64> {
        self.shape.iter().find(|s| s.name == name).map(|s| s.start)
    }

    /// Start values of the shape parameters.
    pub fn shape_start(&self) -> Vec<f64> {
        self.shape.iter().map(|s| s.start).collect()
    }

    /// Values stated by the robot file, zero where nothing is stated.
    pub fn prior(&self) -> Vec<f64> {
        self.linear.iter().map(|p| p.prior.unwrap_or(0.0)).collect()
    }
}
