//! Constrained minimisation: sequential quadratic programming over an elastic quadratic program.

mod quadratic;
mod sequential;

pub(crate) use quadratic::{Elastic, QuadraticProgram, Row};
pub(crate) use sequential::{Curvature, NearRow, Point, Program, Settings, minimise};
