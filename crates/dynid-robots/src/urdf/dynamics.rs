//! `<dynamics>` of joints.

use dynid_files::excerpt::excerpt;

use super::edit::JointDynamics;
use super::xml::{Tag, Tags};
use crate::robot_error::RobotFileError;

/// What the joints of URDF text state in `<dynamics>`, in file order; joints without the element are left out, an
/// attribute that is absent is 0, as URDF says. `source_name` stands in messages.
///
/// # Errors
/// [`RobotFileError`]: the text is not XML, or a value is not a finite number.
pub fn dynamics(text: &str, source_name: &str) -> Result<Vec<JointDynamics>, RobotFileError> {
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let mut tags = Tags::new(text, source_name);
    let mut joint = None;
    let mut out = Vec::new();
    while let Some((range, tag)) = tags.next()? {
        let Tag::Open { start, empty } = tag else { continue };
        let depth = tags.depth() - usize::from(!empty);
        match (depth, start.name().0) {
            (1, "joint") => {
                let attributes = tags.attributes(&start, range.start)?;
                joint = attributes.into_iter().find(|a| a.name == "name").map(|a| a.value);
            }
            (1, _) => joint = None,
            (2, "dynamics") => {
                let Some(name) = &joint else { continue };
                let mut found = JointDynamics { joint: name.clone(), damping: 0.0, friction: 0.0 };
                for a in tags.attributes(&start, range.start)? {
                    let entry = match a.name.as_str() {
                        "damping" => &mut found.damping,
                        "friction" => &mut found.friction,
                        _ => continue,
                    };
                    *entry =
                        a.value.trim().parse().ok().filter(|x: &f64| x.is_finite()).ok_or_else(|| {
                            RobotFileError::Value {
                                at: tags.place(a.offset),
                                owner: format!("joint `{}`", excerpt(name)),
                                field: format!("<dynamics> {}", a.name),
                                expected: "a finite number".to_owned(),
                                found: excerpt(&a.value),
                            }
                        })?;
                }
                out.push(found);
            }
            _ => {}
        }
    }
    Ok(out)
}
