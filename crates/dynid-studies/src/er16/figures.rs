//! The paper's figures, redone.

use dynid::model::{BodyPoint, Dynamics, EffortModel, MotionBlock, RobotModel, Vec3};
use dynid::motion::trajectory::Sampled;
use dynid::report::{Chart, ChartCurve, CurveStyle};

use super::arm::{Arm, INERTIAL, JOINTS};
use super::excitation::WRIST;
use super::measurement::{Measurement, trajectory};
use super::search::Searches;
use super::settings::Settings;
use crate::StudyError;
use crate::page::{axis, curve, logarithmic};

/// Figure 5: how the objective falls. `levels`: objectives to mark across.
pub(super) fn convergence(searches: &Searches, levels: &[(&str, f64)]) -> Chart {
    let mut curves: Vec<ChartCurve> =
        searches.all().iter().map(|s| curve(s.name, s.median_history(300), CurveStyle::Line)).collect();
    let last = curves.iter().flat_map(|c| &c.points).map(|p| p[0]).fold(0.0, f64::max);
    for (name, level) in levels {
        curves.push(curve(name, vec![[0.0, *level], [last, *level]], CurveStyle::Dashed));
    }
    Chart {
        title: "Objective against evaluations, median over seeds".into(),
        note: "The separable solver needs no more than a few hundred evaluations of three unknowns; its level is drawn for comparison.".into(),
        x: axis("evaluations", ""),
        y: logarithmic("objective", "N m"),
        curves,
        ..Chart::default()
    }
}

/// Measured and predicted torque of every joint.
pub(super) fn torque(data: &Measurement, rate_hz: f64, predicted: &[(&str, &[f64])]) -> Vec<Chart> {
    (0..JOINTS)
        .map(|j| {
            let points = |signal: &[f64]| -> Vec<[f64; 2]> {
                data.joint(signal, j).iter().enumerate().map(|(k, x)| [k as f64 / rate_hz, *x]).collect()
            };
            let mut curves = vec![curve("measured", points(&data.torque), CurveStyle::Dots)];
            curves.extend(predicted.iter().map(|(name, p)| curve(name, points(p), CurveStyle::Line)));
            Chart {
                title: format!("Torque of joint {}", j + 1),
                x: axis("time", "s"),
                y: axis("torque", "N m"),
                curves,
                ..Chart::default()
            }
        })
        .collect()
}

/// Error of predicted against true torque of every joint.
pub(super) fn errors(data: &Measurement, rate_hz: f64, predicted: &[(&str, &[f64])]) -> Vec<Chart> {
    (0..JOINTS)
        .map(|j| {
            let clean = data.joint(&data.clean, j);
            let last = (data.samples - 1) as f64 / rate_hz;
            let zero = curve("truth", vec![[0.0, 0.0], [last, 0.0]], CurveStyle::Dashed);
            let curves = std::iter::once(zero).chain(predicted.iter().map(|(name, p)| {
                let difference = data.joint(p, j).iter().zip(clean).enumerate();
                let points = difference.map(|(k, (p, c))| [k as f64 / rate_hz, p - c]).collect();
                curve(name, points, CurveStyle::Line)
            }));
            Chart {
                title: format!("Error of the torque of joint {} against the noise-free torque", j + 1),
                x: axis("time", "s"),
                y: axis("error", "N m"),
                curves: curves.collect(),
                ..Chart::default()
            }
        })
        .collect()
}

/// Friction of `(joint, velocity)`.
pub(super) type FrictionLaw<'a> = &'a dyn Fn(usize, f64) -> f64;

/// Friction of every joint over its velocity, by laws with their names.
pub(super) fn friction(data: &Measurement, laws: &[(&str, FrictionLaw<'_>)]) -> Vec<Chart> {
    const POINTS: i32 = 400;
    (0..JOINTS)
        .map(|j| {
            let most = data.joint(&data.dq, j).iter().fold(0.0_f64, |m, v| m.max(v.abs()));
            let curves = laws.iter().enumerate().map(|(k, (name, law))| {
                let mut points: Vec<[f64; 2]> = Vec::new();
                for i in -POINTS..=POINTS {
                    if i == 0 {
                        // The law jumps at rest.
                        points.push([0.0, f64::NAN]);
                        continue;
                    }
                    let v = most * f64::from(i) / f64::from(POINTS);
                    points.push([v, law(j, v)]);
                }
                curve(name, points, if k == 0 { CurveStyle::Dashed } else { CurveStyle::Line })
            });
            Chart {
                title: format!("Friction of joint {} over the excited speeds", j + 1),
                x: axis("velocity", "rad/s"),
                y: axis("friction", "N m"),
                curves: curves.collect(),
                ..Chart::default()
            }
        })
        .collect()
}

/// Friction of a joint at a velocity, from the paper's unknowns.
pub(super) fn friction_law(arm: &Arm, unknowns: &[f64], joint: usize, velocity: f64) -> f64 {
    let friction: Vec<f64> =
        unknowns.iter().enumerate().map(|(k, x)| if k < INERTIAL { 0.0 } else { *x }).collect();
    let (base, shape) = arm.split(&friction);
    effort_at_velocity(&arm.model, &shape, &arm.base.expanded(&base), joint, velocity)
}

/// Effort of a joint that alone moves, at a constant velocity, all joints at zero.
pub(super) fn effort_at_velocity(
    model: &RobotModel,
    shape: &[f64],
    linear: &[f64],
    joint: usize,
    velocity: f64,
) -> f64 {
    let (zero, mut dq) = ([0.0; JOINTS], [0.0; JOINTS]);
    dq[joint] = velocity;
    let block = MotionBlock::plain(1, &zero, &dq, &zero);
    let mut effort = [0.0; JOINTS];
    model.efforts(&block, shape, linear, 1, &mut effort);
    effort[joint]
}

/// Paths of the wrist centre, from the side and from above.
pub(super) fn paths(
    arm: &Arm,
    settings: &Settings,
    trajectories: &[(&str, &[Vec<f64>])],
) -> Result<Vec<Chart>, StudyError> {
    const SAMPLES: usize = 800;
    let dynamics = Dynamics::new(&arm.mechanism);
    let point = [BodyPoint { body: Some(JOINTS - 1), position: Vec3(WRIST) }];
    let mut named = Vec::new();
    for (name, rows) in trajectories {
        let time = (0..=SAMPLES).map(|k| k as f64 / (SAMPLES as f64 * settings.fundamental_hz)).collect();
        let motion = Sampled::at_times(&trajectory(settings, rows)?, time);
        let n = motion.samples();
        let block = MotionBlock::plain(n, &motion.q, &motion.dq, &motion.ddq);
        let mut at = vec![0.0; 3 * n];
        dynamics.points(&block, &point, n, &mut at);
        named.push((*name, at, n));
    }
    let view = |title: &str, labels: [&str; 2], place: &dyn Fn([f64; 3]) -> [f64; 2]| Chart {
        title: title.into(),
        x: axis(labels[0], "m"),
        y: axis(labels[1], "m"),
        equal_units: true,
        curves: named
            .iter()
            .map(|(name, at, n)| {
                let points = (0..*n).map(|s| place([at[s], at[n + s], at[2 * n + s]])).collect();
                curve(name, points, CurveStyle::Line)
            })
            .collect(),
        ..Chart::default()
    };
    Ok(vec![
        view("Wrist centre from above", ["x", "y"], &|[x, y, _]| [x, y]),
        view(
            "Wrist centre in the plane of the arm",
            ["distance from the axis of joint 1", "height"],
            &|[x, y, z]| [x.hypot(y), z],
        ),
    ])
}
