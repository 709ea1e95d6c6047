//! The robot of a design against that of the factors.

use dynid_identify::Error;
use dynid_identify::reduction::Recipe;
use dynid_identify::robot::Robot;
use dynid_model::JointDescription;

use super::super::config::DesignConfig;
use super::super::load;

/// Difference of places, axes and gravity that is rounding.
const SAME: f64 = 1e-6;

/// The robot of a configuration, which must be that of the factors. Gravity and mimic joints are taken from these where the configuration
/// says nothing; joints that they do not move are held at zero, as joints without columns are in an identification.
///
/// # Errors
/// [`Error::Setting`] for another robot, and what reading the file refuses.
pub(super) fn robot(config: &DesignConfig, recipe: &Recipe, of_factors: &Robot) -> Result<Robot, Error> {
    let mut config = config.clone();
    config.couple_mimics |= recipe.model.couple_mimics;
    config.gravity = config.gravity.or(Some(recipe.model.gravity));
    let mut robot = load(&config)?;
    let moved = of_factors.mechanism.rate_names();
    let refused = |expected: String| Err(Error::setting("robot", &expected, config.robot.display()));
    let own = robot.mechanism.rate_names();
    if let Some(joint) = moved.iter().find(|joint| !own.contains(joint)) {
        return refused(format!("the robot of the factors, with a joint `{joint}` that moves"));
    }
    let held: Vec<String> =
        robot.mechanism.rate_names().into_iter().filter(|joint| !moved.contains(joint)).collect();
    if robot.closed.is_none() && !held.is_empty() {
        let mut held_too = config.clone();
        held_too.locked.extend(held.into_iter().map(|joint| (joint, 0.0)));
        robot = load(&held_too)?;
    }
    let [own, other] = [&robot, of_factors].map(|r| r.mechanism.gravity().0);
    if differ(&own, &other) {
        return Err(Error::setting("gravity", &format!("{other:?}, that of the logs"), format!("{own:?}")));
    }
    for joint in &of_factors.file.description.joints {
        let name = &joint.name;
        match robot.file.description.joints.iter().find(|j| j.name == *name) {
            None => return refused(format!("the robot of the factors, with a joint `{name}`")),
            Some(own) if !same(own, joint) => {
                return refused(format!(
                    "the robot of the factors: its joint `{name}` is another one there (one that was held in the logs has to be held alike, \
                     `{name} = POSITION` under [locked])"
                ));
            }
            Some(_) => {}
        }
    }
    match robot.mechanism.rate_names() == moved {
        true => Ok(robot),
        false => refused(format!("the robot of the factors, whose joints are {}", moved.join(", "))),
    }
}

fn same(a: &JointDescription, b: &JointDescription) -> bool {
    let rows = |j: &JointDescription| j.placement.rotation.rows().into_iter().flatten().collect::<Vec<f64>>();
    a.kind == b.kind
        && a.parent == b.parent
        && a.child == b.child
        && !differ(&rows(a), &rows(b))
        && !differ(&a.placement.translation.0, &b.placement.translation.0)
        && !differ(&a.axis, &b.axis)
}

fn differ(a: &[f64], b: &[f64]) -> bool {
    a.iter().zip(b).any(|(a, b)| (a - b).abs() > SAME)
}
