//! Links that a robot file sets free.

use dynid_files::excerpt::excerpt;
use dynid_model::{Description, JointKind, Limits};
use toml::Spanned;

use super::Source;
use crate::robot_error::RobotFileError;

const KEY: &str = "floating";

/// Makes the named joints, or the joints that carry the named links, floating ones, without limits and leaders.
pub(super) fn release(
    source: &Source<'_>,
    names: &[Spanned<String>],
    description: &mut Description,
) -> Result<(), RobotFileError> {
    source.unique(KEY, names.iter().map(|n| (n.span().start, n.get_ref().as_str())))?;
    for name in names {
        let (offset, name) = (name.span().start, name.get_ref());
        let named = description.joints.iter().position(|j| j.name == *name);
        let carrying = description.joints.iter().position(|j| j.child == *name);
        let joint = match (named, carrying) {
            (Some(named), Some(carrying)) if named != carrying => {
                let expected = "a name that means one joint, by its own name or by that of its link";
                return Err(source.value(offset, "robot", KEY, expected, name));
            }
            (Some(joint), _) | (None, Some(joint)) => joint,
            (None, None) if description.links.iter().any(|l| l.name == *name) => {
                let expected = "a link that a joint carries (`floating_base = true` frees the root)";
                return Err(source.value(offset, "robot", KEY, expected, name));
            }
            (None, None) => {
                let links = description.links.iter().map(|l| l.name.as_str());
                let joints = description.joints.iter().map(|j| j.name.as_str());
                let known: Vec<&str> = links.chain(joints).collect();
                return source.known(offset, KEY, "link or joint", &excerpt(name), &known);
            }
        };
        let joint = &mut description.joints[joint];
        joint.kind = JointKind::Floating;
        joint.limits = Limits::default();
        joint.mimic = None;
    }
    Ok(())
}
