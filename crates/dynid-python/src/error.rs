//! Errors of the library as Python exceptions: text and hint of the command line.

use std::ffi::CString;

use dynid::friction::FrictionError;
use pyo3::exceptions::{PyException, PyUserWarning};
use pyo3::prelude::*;
use pyo3::{PyTypeInfo, create_exception};

create_exception!(
    dynid,
    DynidError,
    PyException,
    "What dynid cannot do, and in `hint` what can be done about it."
);
create_exception!(dynid, RobotError, DynidError, "A robot that cannot be read or cannot be.");
create_exception!(dynid, LogError, DynidError, "A log that cannot be read, or holds what no joint does.");
create_exception!(
    dynid,
    SettingError,
    DynidError,
    "A setting that is unknown, out of range or without effect."
);
create_exception!(
    dynid,
    EstimateError,
    DynidError,
    "An estimate or factor that cannot be read, merged or solved."
);
create_exception!(dynid, UnsupportedError, DynidError, "What there is no form for.");

create_exception!(
    dynid,
    DynidWarning,
    PyUserWarning,
    "What a user should know about a robot, a log or a file that was made."
);

/// An error of the library as an exception.
pub(crate) fn raise(py: Python<'_>, error: &dynid::Error) -> PyErr {
    use dynid::Error as E;
    let kind = match error {
        E::RobotFile(_) | E::Mechanism { .. } | E::Loops { .. } | E::Prior(_) | E::Elastic { .. } => {
            RobotError::type_object(py)
        }
        E::LogFile(_)
        | E::Columns { .. }
        | E::RecordedColumns { .. }
        | E::Log(_)
        | E::States(_)
        | E::StatesChannel { .. }
        | E::Degrees { .. }
        | E::Temperature { .. }
        | E::FarPosition { .. }
        | E::SurplusColumn { .. }
        | E::PreflightFault(_)
        | E::NotComparable { .. }
        | E::Preflight(_)
        | E::Conditioning(_)
        | E::TooShort { .. }
        | E::Pose { .. } => LogError::type_object(py),
        E::Config { .. }
        | E::Setting { .. }
        | E::UnknownElement { .. }
        | E::ElementSetting { .. }
        | E::EqualElements { .. }
        | E::Coupling { .. }
        | E::UnknownJoint { .. }
        | E::UnknownLink { .. }
        | E::UnknownParameter { .. }
        | E::Tie { .. }
        | E::Law { .. }
        | E::Cutoff { .. } => SettingError::type_object(py),
        E::EstimateFile { .. } | E::Reduction(_) | E::Checkpoint { .. } => EstimateError::type_object(py),
        E::Unsupported(_) => UnsupportedError::type_object(py),
        _ => match error.job::<FrictionError>() {
            Some(FrictionError::Law { .. }) => SettingError::type_object(py),
            Some(FrictionError::File { .. }) => EstimateError::type_object(py),
            Some(_) => LogError::type_object(py),
            None => DynidError::type_object(py),
        },
    };
    with_hint(py, kind, error.to_string(), error.hint())
}

/// Tells a doubt.
pub(crate) fn warn(py: Python<'_>, text: &str) -> PyResult<()> {
    let text = CString::new(text.replace('\0', " "))?;
    PyErr::warn(py, DynidWarning::type_object(py).as_any(), &text, 1)
}

/// An exception with its hint.
pub(crate) fn with_hint(
    py: Python<'_>,
    kind: Bound<'_, pyo3::types::PyType>,
    text: String,
    hint: Option<String>,
) -> PyErr {
    let whole = hint.as_ref().map_or_else(|| text.clone(), |hint| format!("{text}\nhint: {hint}"));
    let error = PyErr::from_type(kind, whole);
    // Without it the hint stands in the text alone.
    let _ = error.value(py).setattr("hint", hint);
    error
}

/// A setting that is refused.
pub(crate) fn setting(py: Python<'_>, text: impl Into<String>, hint: &str) -> PyErr {
    with_hint(py, SettingError::type_object(py), text.into(), Some(hint.to_owned()))
}

/// What there is no form for.
pub(crate) fn unsupported(py: Python<'_>, text: impl Into<String>, hint: &str) -> PyErr {
    with_hint(py, UnsupportedError::type_object(py), text.into(), Some(hint.to_owned()))
}
