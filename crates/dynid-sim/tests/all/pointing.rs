//! A two-axis pointing mechanism with clearance in both joints (Sun, Han, Li & Li 2021).

#![expect(clippy::unwrap_used, reason = "helpers of tests outside of test functions")]

use dynid_model::contact::{
    ContactLaw, FractalLankaraniNikravesh, FractalSettings, FractalSurface, JournalBearing, Material,
    PressureFactor, SlidingFriction, SurfaceSettings,
};
use dynid_model::element::{ClearanceContact, JointElement};
use dynid_model::{
    Description, EffortModel, Inertia, JointDescription, JointKind, Limits, LinkDescription, Mat3, Placement,
    RobotModel, Vec3,
};
use dynid_sim::Plant;

pub(crate) const CLEARANCE: f64 = 5e-5;
pub(crate) const JOURNAL_RADIUS: f64 = 0.01;
pub(crate) const MASSES: [f64; 2] = [2.1391, 0.8596];
pub(crate) const LEVERS: [f64; 2] = [0.04821, 0.03419];
const ARM: f64 = 0.1;
const BASE: f64 = 0.4;
const OFFSET: [f64; 2] = [0.111, -0.306];
const SINES: [[f64; 5]; 2] =
    [[0.243, -6.5e-10, -0.028, -0.033, -0.005], [0.251, -0.029, -0.016, -0.015, -0.017]];
const COSINES: [[f64; 5]; 2] = [[-0.113, -0.01, 0.001, 0.013, -0.003], [0.372, -0.037, -0.033, 0.003, 0.001]];

/// Without clearance.
pub(crate) fn description() -> Description {
    let link = |name: &str, inertia: Option<Inertia>| LinkDescription { name: name.into(), inertia };
    let joint = |name: &str, parent: &str, child: &str, placement: Placement| JointDescription {
        name: name.into(),
        parent: parent.into(),
        child: child.into(),
        kind: JointKind::Revolute,
        placement,
        axis: [0.0, 0.0, 1.0],
        limits: Limits::default(),
        mimic: None,
    };
    let about = |xx: f64, yy: f64, zz: f64| Mat3::from_rows([[xx, 0.0, 0.0], [0.0, yy, 0.0], [0.0, 0.0, zz]]);
    let com = |x: f64| Vec3([x, 0.0, 0.0]);
    let quarter = std::f64::consts::FRAC_PI_2;
    let second = Placement {
        translation: Vec3([ARM, 0.0, 0.0]),
        ..Placement::rotate(Vec3([1.0, 0.0, 0.0]).0, quarter)
    };
    Description {
        gravity: [-9.80665, 0.0, 0.0],
        links: vec![
            link("base", None),
            link("x", Some(Inertia::from_com(MASSES[0], com(LEVERS[0]), &about(0.01, 0.0175, 0.0175)))),
            link("y", Some(Inertia::from_com(MASSES[1], com(LEVERS[1]), &about(0.00467, 0.00533, 0.00181)))),
        ],
        joints: vec![joint("alpha", "base", "x", Placement::identity()), joint("beta", "x", "y", second)],
        ..Description::new("pointing")
    }
}

/// The published law for a link's mass.
pub(crate) fn rough(mass: f64) -> ContactLaw {
    let surface = FractalSurface::new(SurfaceSettings {
        roughness_um: 0.8,
        friction: 0.1,
        softer: Material::STEEL,
        harder: Material::STEEL,
        pressure_factor: PressureFactor::Given(0.577),
        ..SurfaceSettings::default()
    });
    let bearing = JournalBearing::with_gap(JOURNAL_RADIUS, CLEARANCE, 0.02);
    FractalLankaraniNikravesh::new(surface.unwrap(), bearing.unwrap(), FractalSettings::new(mass))
        .unwrap()
        .into()
}

/// With clearance in both joints under given laws.
pub(crate) fn plant_with(description: &Description, laws: [ContactLaw; 2]) -> Plant {
    let joints: Vec<String> = description.joints.iter().map(|j| j.name.clone()).collect();
    let mechanism = description.with_clearance(&joints).unwrap().build().unwrap();
    let contacts = laws.into_iter().enumerate().map(|(k, law)| {
        let contact = ClearanceContact {
            rotation: k,
            translations: [2 + 2 * k, 3 + 2 * k],
            law,
            friction: SlidingFriction::new(0.1, 1e-5, 1e-4).unwrap(),
            journal_radius: JOURNAL_RADIUS,
        };
        Box::new(contact) as Box<dyn JointElement>
    });
    let model = RobotModel::new(mechanism, contacts.collect());
    let linear = model.parameters().prior();
    Plant::new(model, linear, Vec::new(), 1e-3).unwrap()
}

/// The published mechanism.
pub(crate) fn plant() -> Plant {
    plant_with(&description(), MASSES.map(rough))
}

/// The published excitation.
pub(crate) fn excitation(t: f64, q: &mut [f64], dq: &mut [f64], ddq: &mut [f64]) {
    for joint in 0..2 {
        (q[joint], dq[joint], ddq[joint]) = (OFFSET[joint], 0.0, 0.0);
        for (k, (a, b)) in SINES[joint].iter().zip(&COSINES[joint]).enumerate() {
            let w = BASE * (k + 1) as f64;
            let (sine, cosine) = (w * t).sin_cos();
            q[joint] += a * sine + b * cosine;
            dq[joint] += w * (a * cosine - b * sine);
            ddq[joint] -= w * w * (a * sine + b * cosine);
        }
    }
}
