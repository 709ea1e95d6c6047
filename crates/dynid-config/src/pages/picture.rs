//! The robot as lines along its kinematic chain, in the poses of a motion.

use dynid_model::closed::{ClosedMechanism, Condition};
use dynid_model::{BodyPoint, ClosedModel, Dynamics, JointKind, Mechanism, MotionBlock, Vec3};
use dynid_report::{LineKind, PictureLine, PointKind, Pose, RobotPicture};

/// Longest stretch of a log that is shown, s.
const STRETCH_S: f64 = 20.0;
/// Poses per second, as long as there are not too many.
const RATE_HZ: f64 = 8.0;
/// Most poses of a picture.
const MOST: f64 = 160.0;
/// Length of the strokes along joint axes, in parts of the distance between joints.
const AXIS: f64 = 0.6;
/// Ends nearer to a joint than this part of the distance between joints are not drawn.
const NEAR: f64 = 0.02;

/// Points of the robot, each fixed to a body, and lines between them.
struct Skeleton {
    kinds: Vec<PointKind>,
    points: Vec<BodyPoint>,
    lines: Vec<PictureLine>,
}

impl Skeleton {
    fn of(mechanism: &Mechanism, closed: Option<&ClosedMechanism>) -> Self {
        let mut skeleton = Skeleton { kinds: Vec::new(), points: Vec::new(), lines: Vec::new() };
        skeleton.add(PointKind::Base, None, Vec3([0.0; 3]));
        let length = mechanism.characteristic_length();
        for (b, body) in mechanism.bodies().iter().enumerate() {
            let kind = match body.joint.kind {
                JointKind::Prismatic => PointKind::Slides,
                JointKind::Floating => PointKind::End,
                _ => PointKind::Turns,
            };
            skeleton.add(kind, Some(b), Vec3([0.0; 3]));
        }
        // Point 0 is the base, point b + 1 the joint of body b.
        for (b, body) in mechanism.bodies().iter().enumerate() {
            skeleton.line([body.parent.map_or(0, |p| p + 1), b + 1], LineKind::Link);
        }
        for b in 0..mechanism.bodies().len() {
            skeleton.axis(mechanism, b, AXIS * length);
            skeleton.end(mechanism, b, NEAR * length);
        }
        for closure in closed.map_or(&[][..], ClosedMechanism::closures) {
            let Condition::Joint { a, b, .. } = &closure.condition else { continue };
            for end in [a, b] {
                let Ok(frame) = mechanism.frame(&end.link) else { continue };
                let at = frame.placement.then(&end.placement).translation;
                let point = skeleton.add(PointKind::Turns, frame.body, at);
                skeleton.line([frame.body.map_or(0, |b| b + 1), point], LineKind::Link);
            }
        }
        skeleton
    }

    fn add(&mut self, kind: PointKind, body: Option<usize>, position: Vec3<f64>) -> usize {
        self.kinds.push(kind);
        self.points.push(BodyPoint { body, position });
        self.points.len() - 1
    }

    fn line(&mut self, ends: [usize; 2], kind: LineKind) {
        self.lines.push(PictureLine { ends, kind });
    }

    /// A stroke along the axis of a joint.
    fn axis(&mut self, mechanism: &Mechanism, b: usize, length: f64) {
        let joint = &mechanism.bodies()[b].joint;
        if joint.kind == JointKind::Floating {
            return;
        }
        let half = 0.5 * length;
        let ends = [-half, half].map(|by| self.add(PointKind::End, Some(b), joint.axis.scale(by)));
        self.line(ends, LineKind::Axis);
    }

    /// The end of a branch: the frame that is welded farthest out, else the centre of mass as the file states it.
    fn end(&mut self, mechanism: &Mechanism, b: usize, near: f64) {
        let bodies = mechanism.bodies();
        let body = &bodies[b];
        if bodies.iter().any(|other| other.parent == Some(b)) {
            return;
        }
        let away = |v: &Vec3<f64>| v.norm() > near && v.0.iter().all(|x| x.is_finite());
        let welded = body.fixed_links.iter().map(|l| l.placement.translation).filter(away);
        let farthest = welded.max_by(|a, b| a.norm().total_cmp(&b.norm()));
        let mass = body.inertia.mass();
        let [_, x, y, z, ..] = body.inertia.0;
        let centre = (mass > 0.0).then(|| Vec3([x, y, z]).scale(1.0 / mass)).filter(away);
        let (at, point, line) = match (farthest, centre) {
            (Some(at), _) => (at, PointKind::End, LineKind::Link),
            (None, Some(at)) => (at, PointKind::Mass, LineKind::Mass),
            (None, None) => return,
        };
        let end = self.add(point, Some(b), at);
        self.line([b + 1, end], line);
    }

    /// Poses along a motion; `q`: positions of all joints of the tree, one after the other, at each time.
    fn poses(&self, mechanism: &Mechanism, times: &[f64], q: &[f64]) -> Vec<Pose> {
        let n = times.len();
        let still = vec![0.0; q.len()];
        let mut out = vec![0.0; 3 * self.points.len() * n];
        let block = MotionBlock::plain(n, q, &still, &still);
        Dynamics::new(mechanism).points(&block, &self.points, n, &mut out);
        let point = |p: usize, s: usize| [0, 1, 2].map(|c| out[(3 * p + c) * n + s]);
        times
            .iter()
            .enumerate()
            .map(|(s, time)| Pose {
                time_s: *time,
                points_m: (0..self.points.len()).map(|p| point(p, s)).collect(),
            })
            .collect()
    }
}

/// The robot along a motion.
///
/// `time_s`: of each sample; `position`: per coordinate of logs, one entry per time. `closed`: the loops, if there are some;
/// `None` where a pose cannot be reached.
pub fn picture(
    mechanism: &Mechanism,
    closed: Option<&ClosedModel>,
    time_s: &[f64],
    position: &[&[f64]],
    caption: String,
) -> Option<RobotPicture> {
    let chosen = chosen(time_s);
    let times: Vec<f64> = chosen.iter().map(|k| time_s[*k]).collect();
    let mut q: Vec<f64> = position.iter().flat_map(|signal| chosen.iter().map(|k| signal[*k])).collect();
    if let Some(model) = closed {
        q = tree_positions(model, times.len(), &q)?;
    }
    // Coordinates beyond those of the tree are motors behind springs.
    q.truncate(mechanism.positions() * times.len());
    if times.is_empty() || q.len() != mechanism.positions() * times.len() || mechanism.bodies().is_empty() {
        return None;
    }
    let skeleton = Skeleton::of(mechanism, closed.map(|model| &**model.machine()));
    let poses = skeleton.poses(mechanism, &times, &q);
    Some(RobotPicture {
        caption,
        shown: stretched(&poses),
        poses,
        points: skeleton.kinds,
        lines: skeleton.lines,
        up: mechanism.gravity().0.map(|g| -g),
        trail: None,
        plays: false,
    })
}

/// The pose in which some point lies farthest from the base.
fn stretched(poses: &[Pose]) -> usize {
    let reach = |pose: &Pose| {
        let squares = pose.points_m.iter().map(|p| p.iter().map(|x| x * x).sum::<f64>());
        squares.fold(0.0, f64::max)
    };
    (0..poses.len()).max_by(|a, b| reach(&poses[*a]).total_cmp(&reach(&poses[*b]))).unwrap_or(0)
}

/// Samples whose poses are shown.
fn chosen(time_s: &[f64]) -> Vec<usize> {
    let (Some(first), Some(last)) = (time_s.first(), time_s.last()) else { return Vec::new() };
    let stretch = (last - first).min(STRETCH_S);
    let poses = (stretch * RATE_HZ).clamp(1.0, MOST).ceil() as usize;
    let mut out: Vec<usize> = (0..=poses)
        .map(|k| first + stretch * k as f64 / poses as f64)
        .map(|t| time_s.partition_point(|x| *x < t - 1e-9).min(time_s.len() - 1))
        .collect();
    out.dedup();
    out
}

/// Positions of all joints of the tree in the poses that drives state; `None` where one is out of reach.
fn tree_positions(model: &ClosedModel, samples: usize, q: &[f64]) -> Option<Vec<f64>> {
    let still = vec![0.0; q.len()];
    let mut all: Vec<Vec<f64>> = Vec::with_capacity(samples);
    model
        .follow(&MotionBlock::plain(samples, q, &still, &still), |_, pose| {
            all.push(pose.positions().to_vec())
        })
        .ok()?;
    let coordinates = all.first()?.len();
    Some((0..coordinates).flat_map(|k| all.iter().map(move |pose| pose[k]).collect::<Vec<_>>()).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn poses_are_of_a_stretch_and_in_order() {
        let time: Vec<f64> = (0..60_000).map(|k| 5.0 + f64::from(k) * 1e-3).collect();
        let chosen = chosen(&time);
        assert_eq!(chosen.len(), 161);
        assert!((time[chosen[160]] - 25.0).abs() < 2e-3 && chosen.windows(2).all(|p| p[0] < p[1]));
        assert_eq!(super::chosen(&[3.0]), [0]);
        assert!(super::chosen(&[]).is_empty());
    }
}
