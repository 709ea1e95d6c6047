//! A made-up excitation design with the look of a real one: a Fourier motion of an arm with gravity on its second and
//! third joint, kept within its limits by scaling; the forecast is invented.

use std::f64::consts::TAU;

use dynid_report::{
    Check, Chosen, ConfoundedPair, DesignJoint, DesignParameter, DesignQuality, DesignReport, DesignStart,
    Fact, FramePath, InputFile, IntervalForecast, JointMotion, LimitUse, Obstacle, ParameterShare,
    Provenance, RandomMotion, Robot, Shape, Starts, Status, Trajectory, Value, Verdict, Warning,
};

const PERIOD_S: f64 = 10.0;
const PERIODS: u64 = 3;
const APPROACH_S: f64 = 2.5;
const RATE_HZ: f64 = 200.0;

/// A report of `joints` joints.
pub(crate) fn design(joints: usize) -> DesignReport {
    let joints: Vec<DesignJoint> = (0..joints).map(joint).collect();
    let trajectory = trajectory(&joints);
    DesignReport {
        title: "Excitation for demo-arm".into(),
        verdict: verdict(),
        warnings: vec![Warning {
            message: "`joint_6`: the predicted standard deviation of `mx6` exceeds its nominal value".into(),
            hint: "Mount a known payload, or accept that small first moments are not seen.".into(),
        }],
        robot: Robot {
            name: "demo-arm".into(),
            file: Some("robots/demo-arm.toml".into()),
            facts: vec![Fact::new("Gravity", "0, 0, -9.81", "m/s^2")],
        },
        criterion: "relative standard deviations (A-optimal)".into(),
        criterion_meaning:
            "the logarithm of the mean square of predicted standard deviations, each in shares of \
            its parameter's nominal value. One less means standard deviations smaller by a factor of 1.6."
                .into(),
        period_s: Some(PERIOD_S),
        harmonics: Some(5),
        periods_recorded: Some(PERIODS),
        approach_s: Some(APPROACH_S),
        return_s: Some(APPROACH_S),
        sample_rate_hz: Some(RATE_HZ),
        evaluations: Some(5872),
        seed: Some(1),
        facts: vec![Fact::new("Start", "at rest, from the parking pose", "")],
        quality: DesignQuality {
            criterion_search: Some(2.1874),
            criterion_exact: Some(2.1831),
            sigma_largest: Some(812.4),
            sigma_smallest: Some(17.02),
            condition: Some(47.73),
            condition_unit_norm: Some(21.9),
        },
        random: Some(RandomMotion {
            trajectories: Some(10),
            mean_ratio: Some(3.41),
            geometric_ratio: Some(2.63),
            condition: Some(187.2),
        }),
        intervals: vec![
            IntervalForecast {
                name: "joint_1.fc".into(),
                unit: "N m".into(),
                value: Some(3.1),
                before: Some(0.4),
                wanted: Some(0.1),
                after: Some(0.09),
                state: "reached".into(),
                ..IntervalForecast::default()
            },
            IntervalForecast {
                name: "link3.m".into(),
                unit: "kg".into(),
                value: Some(4.0),
                wanted: Some(0.01),
                state: "only in combination".into(),
                is_missed: true,
                note: "the data see m3 + m4".into(),
                ..IntervalForecast::default()
            },
            IntervalForecast {
                name: "joint_1.fv".into(),
                unit: "N m s/rad".into(),
                value: Some(0.8),
                before: Some(0.05),
                after: Some(0.02),
                ..IntervalForecast::default()
            },
        ],
        parameters: parameters(joints.len()),
        confounded: vec![
            ConfoundedPair { names: ["fv4".into(), "fc4".into()], correlation: Some(-0.967) },
            ConfoundedPair { names: ["Iyy5".into(), "Ia5".into()], correlation: Some(0.953) },
        ],
        seen_least: [("mx6", 0.52), ("my6", 0.24), ("Ixx5", 0.11), ("Ixy5", 0.05)]
            .map(|(name, share)| ParameterShare { name: name.into(), share: Some(share) })
            .into(),
        limits: limits(&joints, &trajectory),
        joints,
        trajectory: Some(trajectory),
        picture: None,
        obstacles: obstacles(),
        starts: starts(),
        provenance: Provenance {
            version: "0.1.0".into(),
            inputs: vec![InputFile {
                path: "robots/demo-arm.toml".into(),
                kind: "robot".into(),
                sha256: Some("5b41362bc82b7f3d56edc5a306db22105707d01ff4819e26faef9724a2d406c9".into()),
            }],
            seed: Some(1),
            settings: vec![Chosen::given("starts", 16usize, ""), Chosen::given("samples", 100usize, "")],
        },
    }
}

fn verdict() -> Verdict {
    Verdict {
        status: Status::Ok,
        headline: "All limits hold at every instant; standard deviations 3.4 times smaller than of random motion"
            .into(),
        sentences: vec![
            "The trajectory keeps every limit between samples too, on its way to the start and back.".into(),
            "Of 58 parameters 51 will be known to better than 30 % of their nominal value after three periods."
                .into(),
        ],
        checks: vec![Check {
            status: Status::Ok,
            name: "limits on 10 000 instants".into(),
            value: Value::Number(-3.7e-7),
            unit: String::new(),
            limit: "at most 0".into(),
            meaning: "Largest excess over a limit, in shares of the limit.".into(),
        }],
    }
}

fn joint(k: usize) -> DesignJoint {
    DesignJoint {
        name: format!("joint_{}", k + 1),
        unit: "rad".into(),
        effort_unit: "N m".into(),
        position_low: Some(if k == 2 { -2.4 } else { -2.967 }),
        position_high: Some(if k == 2 { 2.7 } else { 2.967 }),
        velocity: Some(if k < 3 { 2.618 } else { 3.0 }),
        acceleration: (k < 5).then_some(6.0),
        jerk: None,
        effort: Some([431.97, 431.97, 197.23, 79.79, 79.79, 79.79][k.min(5)]),
    }
}

/// Value and first three derivatives of a Fourier series that starts and ends at rest.
fn fourier(k: usize, t: f64) -> [f64; 4] {
    let mut out = [0.0; 4];
    for l in 1..=5usize {
        let w = TAU * l as f64 / PERIOD_S;
        let seed = (7 * k + 3 * l) as f64;
        let (a, b) = (0.5 * (1.7 * seed).sin() / l as f64, 0.6 * (2.3 * seed).cos() / l as f64);
        let (s, c) = (w * t).sin_cos();
        out[0] += a * s + b * c;
        out[1] += w * (a * c - b * s);
        out[2] -= w * w * (a * s + b * c);
        out[3] -= w * w * w * (a * c - b * s);
    }
    // Blended to rest at both ends of the period by the square of a sine, through the product rule.
    let w = 0.5 * TAU / PERIOD_S;
    let (s2, c2) = (2.0 * w * t).sin_cos();
    let g = [0.5 - 0.5 * c2, w * s2, 2.0 * w * w * c2, -4.0 * w * w * w * s2];
    [
        out[0] * g[0],
        out[1] * g[0] + out[0] * g[1],
        out[2] * g[0] + 2.0 * out[1] * g[1] + out[0] * g[2],
        out[3] * g[0] + 3.0 * out[2] * g[1] + 3.0 * out[1] * g[2] + out[0] * g[3],
    ]
}

/// Quintic from 0 to 1 in unit time with two derivatives.
fn quintic(u: f64) -> [f64; 3] {
    [
        u * u * u * (10.0 + u * (6.0 * u - 15.0)),
        30.0 * u * u * (1.0 + u * (u - 2.0)),
        60.0 * u * (1.0 + u * (2.0 * u - 3.0)),
    ]
}

/// Position, velocity and acceleration of joint `k`: from the parking pose to the start, the periods, and back.
fn motion(k: usize, scale: f64, t: f64) -> [f64; 3] {
    let park = [0.0, -0.6, 1.9, 0.0, 0.9, 0.0][k.min(5)];
    let start = [0.2, 0.1, 1.0, -0.4, 0.3, 0.5][k.min(5)];
    let back = t - APPROACH_S - PERIODS as f64 * PERIOD_S;
    let blend = if t < APPROACH_S {
        quintic(t / APPROACH_S)
    } else if back > 0.0 {
        let [value, slope, curvature] = quintic(1.0 - back / APPROACH_S);
        [value, -slope, curvature]
    } else {
        let [q, dq, ddq, _] = fourier(k, (t - APPROACH_S) % PERIOD_S);
        return [start + scale * q, scale * dq, scale * ddq];
    };
    let way = start - park;
    [park + way * blend[0], way * blend[1] / APPROACH_S, way * blend[2] / (APPROACH_S * APPROACH_S)]
}

/// Largest amplitude of joint `k` within its limits.
fn scale(joint: &DesignJoint, k: usize) -> f64 {
    let peak = |order: usize| {
        (0..2000).map(|i| fourier(k, f64::from(i) / 2000.0 * PERIOD_S)[order].abs()).fold(1e-9, f64::max)
    };
    let bounds = [Some(1.7), joint.velocity, joint.acceleration];
    (0..3).filter_map(|order| Some(bounds[order]? / peak(order))).fold(f64::INFINITY, f64::min)
}

fn trajectory(joints: &[DesignJoint]) -> Trajectory {
    let duration = 2.0 * APPROACH_S + PERIODS as f64 * PERIOD_S;
    let time_s: Vec<f64> = (0..=(duration * RATE_HZ) as usize).map(|i| i as f64 / RATE_HZ).collect();
    let mut motions: Vec<JointMotion> = joints
        .iter()
        .enumerate()
        .map(|(k, joint)| {
            let scale = scale(joint, k);
            let states: Vec<[f64; 3]> = time_s.iter().map(|t| motion(k, scale, *t)).collect();
            JointMotion {
                q: states.iter().map(|s| s[0]).collect(),
                dq: states.iter().map(|s| s[1]).collect(),
                ddq: states.iter().map(|s| s[2]).collect(),
                jerk: None,
                effort: None,
            }
        })
        .collect();
    for k in 0..motions.len() {
        let inertia = [8.0, 14.0, 5.0, 0.8, 0.5, 0.2][k.min(5)];
        let m = &motions[k];
        let effort = (0..time_s.len())
            .map(|i| {
                let raised: f64 =
                    motions[1..(k + 1).clamp(1, 3).min(motions.len())].iter().map(|m| m.q[i]).sum();
                let gravity = if (1..3).contains(&k) { [0.0, 160.0, 55.0][k] * raised.sin() } else { 0.0 };
                inertia * m.ddq[i] + 0.15 * inertia * (m.dq[i] / 0.02).tanh() + inertia * m.dq[i] + gravity
            })
            .collect();
        motions[k].effort = Some(effort);
    }
    let tool = (0..time_s.len()).map(|i| tool(&motions, i)).collect();
    Trajectory {
        recorded_s: Some([APPROACH_S, duration - APPROACH_S]),
        frames: vec![FramePath { name: "tool".into(), xyz_m: tool }],
        joints: motions,
        time_s,
    }
}

/// Tip of an arm with an upright first axis and two level ones.
fn tool(motions: &[JointMotion], i: usize) -> [f64; 3] {
    let q = |k: usize| motions.get(k).map_or(0.0, |m| m.q[i]);
    let (shoulder, elbow, wrist) = (q(1), q(1) + q(2), q(1) + q(2) + q(4));
    let reach = 0.45 * shoulder.sin() + 0.4 * elbow.sin() + 0.2 * wrist.sin() * q(3).cos();
    let height = 0.35 + 0.45 * shoulder.cos() + 0.4 * elbow.cos() + 0.2 * wrist.cos();
    let aside = 0.2 * wrist.sin() * q(3).sin();
    let (s, c) = q(0).sin_cos();
    [c * reach - s * aside, s * reach + c * aside, height]
}

fn limits(joints: &[DesignJoint], trajectory: &Trajectory) -> Vec<LimitUse> {
    let mut uses = Vec::new();
    for (joint, motion) in joints.iter().zip(&trajectory.joints) {
        let middle = 0.5 * (joint.position_low.unwrap_or(0.0) + joint.position_high.unwrap_or(0.0));
        let half = joint.position_high.map(|high| high - middle);
        let from_middle: Vec<f64> = motion.q.iter().map(|q| q - middle).collect();
        for (kind, values, limit) in [
            ("position", Some(&from_middle), half),
            ("velocity", Some(&motion.dq), joint.velocity),
            ("acceleration", Some(&motion.ddq), joint.acceleration),
            ("effort", motion.effort.as_ref(), joint.effort),
        ] {
            let (Some(values), Some(limit)) = (values, limit) else { continue };
            let (at, peak) = values
                .iter()
                .enumerate()
                .map(|(i, v)| (i, v.abs()))
                .max_by(|a, b| a.1.total_cmp(&b.1))
                .unwrap_or((0, 0.0));
            uses.push(LimitUse {
                kind: kind.into(),
                subject: joint.name.clone(),
                use_percent: Some(100.0 * peak / limit),
                at_s: Some(in_period(trajectory.time_s[at])),
                acts: peak / limit > 0.999,
                ..LimitUse::default()
            });
        }
    }
    for obstacle in obstacles() {
        let distances = trajectory.frames[0].xyz_m.iter().map(|p| distance(&obstacle.shape, *p));
        let (at, least) = distances.enumerate().min_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or((0, 0.0));
        uses.push(LimitUse {
            kind: format!("distance from {}", obstacle.name),
            subject: "tool".into(),
            use_percent: None,
            margin: Some(least),
            margin_unit: "m".into(),
            at_s: Some(in_period(trajectory.time_s[at])),
            acts: least.abs() < 1e-3,
        });
    }
    uses
}

fn in_period(t: f64) -> f64 {
    (t - APPROACH_S).rem_euclid(PERIOD_S)
}

/// Positive where a point is allowed.
fn distance(shape: &Shape, p: [f64; 3]) -> f64 {
    match *shape {
        Shape::HalfSpace { normal, offset_m } => (0..3).map(|k| normal[k] * p[k]).sum::<f64>() - offset_m,
        Shape::OutsideBox { lower_m, upper_m } => {
            (0..3).map(|k| (lower_m[k] - p[k]).max(p[k] - upper_m[k])).fold(f64::NEG_INFINITY, f64::max)
        }
        Shape::OutsideOrAboveColumn { center_m, radius_m, height_m } => {
            ((p[0] - center_m[0]).hypot(p[1] - center_m[1]) - radius_m).max(p[2] - height_m)
        }
        _ => f64::NAN,
    }
}

fn obstacles() -> Vec<Obstacle> {
    let of_all = |name: &str, shape| Obstacle { name: name.into(), frames: Vec::new(), shape };
    vec![
        of_all("floor", Shape::HalfSpace { normal: [0.0, 0.0, 1.0], offset_m: -0.243 }),
        of_all("wall", Shape::HalfSpace { normal: [0.0, -1.0, 0.0], offset_m: -0.95 }),
        of_all(
            "pillar",
            Shape::OutsideOrAboveColumn { center_m: [0.75, 0.5], radius_m: 0.12, height_m: 0.9 },
        ),
        of_all("rack", Shape::OutsideBox { lower_m: [0.55, -0.95, -0.25], upper_m: [0.95, -0.5, 0.35] }),
    ]
}

fn parameters(joints: usize) -> Vec<DesignParameter> {
    let names = ["Ixx", "Ixy", "Ixz", "Iyz", "Izz", "mx", "my", "Ia", "fv", "fc"];
    let units = ["kg m^2"; 5].into_iter().chain(["kg m"; 2]).chain(["kg m^2", "N m s", "N m"]);
    (1..=joints)
        .flat_map(|j| names.into_iter().zip(units.clone()).enumerate().map(move |(k, (n, u))| (j, k, n, u)))
        .filter(|(j, k, ..)| *j > 1 || [4, 8, 9].contains(k))
        .map(|(j, k, name, unit)| {
            let wobble = (3.7 * (10 * j + k) as f64).sin();
            let nominal = [0.4, -0.02, 0.01, -0.03, 0.9, 1.3, -0.1, 0.6, 4.0, 6.5][k] / (j * j) as f64
                * (1.0 + 0.3 * wobble);
            let std = nominal.abs() * (0.004 + 0.35 * wobble.abs().powi(5) + 0.002 * (j * k) as f64);
            let known = !(name == "Ixy" && j == 6);
            DesignParameter {
                name: format!("{name}{j}"),
                unit: unit.into(),
                nominal: known.then_some(nominal),
                std: Some(std),
                relative_std_percent: known.then_some(100.0 * std / nominal.abs()),
            }
        })
        .collect()
}

fn starts() -> Starts {
    let ends = [
        2.231, 2.402, 2.183, 2.299, 2.214, 2.226, 2.511, 2.274, 2.19, 2.338, 2.251, 2.205, 2.24, 2.26, 2.72,
        2.3,
    ];
    Starts {
        asked: Some(16),
        near_best: Some(2.183 + 1.05f64.ln()),
        outcomes: (1..)
            .zip(ends)
            .map(|(seed, criterion)| DesignStart { seed, criterion: Some(criterion), feasible: seed != 15 })
            .collect(),
    }
}
