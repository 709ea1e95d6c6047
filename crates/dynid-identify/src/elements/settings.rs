//! Settings of elements in a robot file: each has a reader.

use dynid_io::{ElementSetting, SettingValue};

use super::{NAMES, friction};
use crate::Error;

/// Keys of elements without shape parameters.
const KEYS: [(&str, &[&str]); 8] = [
    ("coulomb", &["effort"]),
    ("viscous", &["coefficient"]),
    ("offset", &["effort"]),
    ("rotor", &["inertia"]),
    ("cyclic", &["cycles"]),
    ("external_load", &["factor", "brake"]),
    ("viscous_magnitude", &["coefficient"]),
    ("load", &["coefficient"]),
];
/// The keys that are true or false.
const FLAGS: [&str; 1] = ["brake"];

/// Refuses settings of elements that do not exist, and keys and values that no element takes, also of elements that are not in
/// use.
///
/// # Errors
/// [`Error::UnknownElement`], [`Error::ElementSetting`].
pub(super) fn check(settings: &[ElementSetting]) -> Result<(), Error> {
    for setting in settings {
        let ElementSetting { joint, element, key, value } = setting;
        if !NAMES.contains(&element.as_str()) {
            return Err(Error::UnknownElement { name: element.clone(), joint: joint.clone() });
        }
        if friction::check(element, joint, settings)? {
            continue;
        }
        let fault =
            |fault: String| Error::ElementSetting { element: element.clone(), joint: joint.clone(), fault };
        let keys = KEYS.iter().find(|(name, _)| name == element).map_or(&[][..], |(_, keys)| *keys);
        if !keys.contains(&key.as_str()) {
            let expected = match keys {
                [] => "no settings".to_owned(),
                _ => format!("a table with `{}`", keys.join("`, `")),
            };
            let found = if key.is_empty() { "a value" } else { key.as_str() };
            return Err(fault(format!("expected {expected}, found `{found}`")));
        }
        match (FLAGS.contains(&key.as_str()), value) {
            (true, SettingValue::Flag(_)) | (false, SettingValue::Number(_)) => {}
            (true, other) => return Err(fault(format!("`{key}`: expected true or false, found {other:?}"))),
            (false, other) => return Err(fault(format!("`{key}`: expected a number, found {other:?}"))),
        }
    }
    Ok(())
}
