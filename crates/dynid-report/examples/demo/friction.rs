//! Made-up friction of one joint.

use dynid_report::{Chart, ChartAxis, ChartCurve, FrictionTrial, ShapeParameter, ShapeVerdict};

pub(super) fn shape_parameters() -> Vec<ShapeParameter> {
    vec![
        ShapeParameter {
            name: "joint_2.vs".into(),
            unit: "rad/s".into(),
            value: Some(0.0412),
            std: Some(0.0031),
            interval: Some([0.0350, 0.0474]),
            range: Some([0.0133, 0.12]),
            verdict: ShapeVerdict::SeenInData,
            reason: String::new(),
        },
        ShapeParameter {
            name: "joint_4.w".into(),
            unit: "rad/s".into(),
            value: Some(0.02),
            std: None,
            interval: Some([0.02, 0.085]),
            range: Some([0.02, 0.18]),
            verdict: ShapeVerdict::OneSided,
            reason: "at its lower bound: the law is then Coulomb friction".into(),
        },
    ]
}

pub(super) fn laws() -> Vec<Chart> {
    let effort = |v: f64| v.signum() * (9.0 + 4.0 * (-(v / 0.0412).powi(2)).exp()) + 3.0 * v;
    let points = (-300..=300)
        .map(|k| (f64::from(k) / 300.0).powi(3))
        .map(|v| [v, if v == 0.0 { 0.0 } else { effort(v) }])
        .collect();
    let axis =
        |label: &str, unit: &str| ChartAxis { label: label.into(), unit: unit.into(), logarithmic: false };
    vec![Chart {
        title: "joint_2: stribeck + viscous".into(),
        note: "Passive from -1 to 1 rad/s, all that the training logs reach.".into(),
        x: axis("velocity", "rad/s"),
        y: axis("friction", "N m"),
        equal_units: false,
        curves: vec![ChartCurve { name: "identified law".into(), points, ..Default::default() }],
    }]
}

pub(super) fn trials() -> Vec<FrictionTrial> {
    let trial = |element: &str, value: Option<f64>, gain: f64, error: f64, accepted: bool| FrictionTrial {
        joint: "joint_2".into(),
        element: element.into(),
        value,
        unit: "rad/s".into(),
        gain_percent: Some(gain),
        standard_error_percent: Some(error),
        accepted,
    };
    vec![
        trial("stribeck", Some(0.04), 12.34, 3.21, true),
        trial("tanh", Some(0.06), 0.4, 0.9, false),
        trial("viscous_magnitude", None, -0.2, 0.6, false),
    ]
}
