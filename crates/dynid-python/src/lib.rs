//! Python bindings: arrays in, verdicts out. The package is `dynid`; this crate is its module `dynid._native`, built by maturin with the
//! feature `extension`. What is written for users stands in the docstrings of the package.
#![cfg(feature = "extension")]

mod arrays;
mod commands;
mod error;
mod estimate;
mod factor;
mod fleet;
mod log;
mod robot;
mod settings;
mod states;
mod work;

use pyo3::prelude::*;

#[pymodule]
mod _native {
    #[pymodule_export]
    use super::command_line;
    #[pymodule_export]
    use super::commands::{Online, check, compare, design, friction, gains, next_motion, servo};
    #[pymodule_export]
    use super::error::{
        DynidError, DynidWarning, EstimateError, LogError, RobotError, SettingError, UnsupportedError,
    };
    #[pymodule_export]
    use super::estimate::{Estimate, identify, identify_file};
    #[pymodule_export]
    use super::factor::Factor;
    #[pymodule_export]
    use super::fleet::{FactorStore, Fleet, LogReducer, date, fleet, read_manifest};
    #[pymodule_export]
    use super::log::{Log, find_logs, read_columns, simulate};
    #[pymodule_export]
    use super::robot::Robot;

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("__version__", dynid::VERSION)
    }

    use pyo3::prelude::*;
}

/// Runs the program `dynid` with arguments, the program's name first; gives its exit code.
#[pyfunction]
fn command_line(py: Python<'_>, arguments: Vec<String>) -> u8 {
    py.detach(|| dynid_cli::run_with(arguments.into_iter().map(Into::into)))
}
