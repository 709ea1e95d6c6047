//! `<pose>`: a place and a rotation, and the frame that they are stated in.

use dynid_model::{Mat3, Placement, Vec3};

use super::document::{Document, Element};
use crate::robot_error::RobotFileError;

/// A pose as an element states it.
#[derive(Clone, Debug)]
pub(super) struct Pose {
    pub(super) placement: Placement,
    /// The frame that it is in, where one is named.
    pub(super) relative_to: Option<String>,
}

impl Pose {
    /// The `<pose>` of an element; without one nothing is moved.
    pub(super) fn of(
        document: &Document<'_>,
        element: &Element,
        owner: &str,
    ) -> Result<Pose, RobotFileError> {
        let nowhere = Pose { placement: Placement::identity(), relative_to: None };
        let Some(pose) = document.child(element, owner, "pose")? else { return Ok(nowhere) };
        if let Some(frame) = pose.attribute("frame") {
            let reason =
                format!("the attribute `frame=\"{frame}\"` of its <pose> is no longer defined by SDF");
            return Err(document.refuse(
                pose,
                owner,
                reason,
                "write `relative_to`, with SDF version 1.7 or later",
            ));
        }
        let relative_to = pose.attribute("relative_to").map(str::to_owned);
        let degrees = match pose.attribute("degrees") {
            None | Some("false" | "0") => false,
            Some("true" | "1") => true,
            Some(_) => return Err(document.value(pose, owner, "`degrees` true or false")),
        };
        if pose.text.is_empty() {
            return Ok(Pose { relative_to, ..nowhere });
        }
        let placement = match pose.attribute("rotation_format") {
            None | Some("euler_rpy") => {
                let numbers = document.numbers(pose, owner, 6)?;
                let angle = |k: usize| if degrees { numbers[k].to_radians() } else { numbers[k] };
                Placement::from_xyz_rpy([numbers[0], numbers[1], numbers[2]], [angle(3), angle(4), angle(5)])
            }
            Some("quat_xyzw") => {
                let numbers = document.numbers(pose, owner, 7)?;
                let quaternion = [numbers[3], numbers[4], numbers[5], numbers[6]];
                let Some(rotation) = rotation(quaternion) else {
                    return Err(document.value(pose, owner, "a quaternion other than zero"));
                };
                Placement { rotation, translation: Vec3([numbers[0], numbers[1], numbers[2]]) }
            }
            Some(_) => {
                return Err(document.value(pose, owner, "`rotation_format` euler_rpy or quat_xyzw"));
            }
        };
        Ok(Pose { placement, relative_to })
    }
}

/// The rotation of a quaternion `x y z w`, which need not have length 1; `None` for zero.
fn rotation(quaternion: [f64; 4]) -> Option<Mat3<f64>> {
    let largest = quaternion.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
    if largest == 0.0 {
        return None;
    }
    let scaled = quaternion.map(|x| x / largest);
    let norm = scaled.iter().map(|x| x * x).sum::<f64>().sqrt();
    let [x, y, z, w] = scaled.map(|x| x / norm);
    Some(Mat3::from_rows([
        [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
        [2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)],
        [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)],
    ]))
}

#[cfg(test)]
mod tests {
    use super::rotation;
    use dynid_model::Mat3;

    #[test]
    fn a_quaternion_turns_as_its_axis_and_angle_say() {
        let half = 0.35_f64;
        let quaternion = [0.0, 3.0 * half.sin(), 0.0, 3.0 * half.cos()];
        let (found, expected) = (rotation(quaternion).unwrap(), Mat3::from_rpy([0.0, 2.0 * half, 0.0]));
        let error = (found + expected * -1.0).0.iter().map(|c| c.norm()).fold(0.0, f64::max);
        assert!(error < 1e-15, "{error:e}");
        assert!(rotation([0.0; 4]).is_none());
    }
}
