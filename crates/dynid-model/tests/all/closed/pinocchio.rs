//! Accelerations and forces of another library: tests/data/closed_chains.py.

use std::path::Path;

use dynid_model::closed::{ClosedDynamics, Condition, CutKind};
use dynid_model::{Dynamics, Vec3};
use serde_json::Value;

use crate::golden::numbers;
use crate::robots::robot;

const TOLERANCE: f64 = 1e-8;

#[test]
fn efforts_and_forces_of_closures_are_those_of_pinocchio() {
    for name in ["fourbar", "stewart", "delta"] {
        let file = format!("tests/data/pinocchio_{name}.json");
        let text = std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join(file)).unwrap();
        let data: Value = serde_json::from_str(&text).unwrap();
        let machine = robot(name).close();
        let closures = machine.closures().to_vec();
        let phi = machine.mechanism().inertia_vector();
        let tree = Dynamics::new(machine.mechanism());
        let mechanism = machine.mechanism().clone();
        let mut dynamics = ClosedDynamics::new(machine);
        let states = data["states"].as_array().unwrap();
        assert_eq!(states.len(), 100);
        let mut worst = [0.0_f64; 3];
        for state in states {
            let [q, dq, ddq] = ["q", "dq", "ddq"].map(|k| numbers(&state[k]));
            dynamics.take(&q).unwrap();
            let found = dynamics.inverse_dynamics((&dq, &ddq), None, &phi);
            let expected = numbers(&state["effort"]);
            let size = expected.iter().fold(1.0_f64, |m, x| m.max(x.abs()));
            for (f, e) in found.drives.iter().zip(&expected) {
                worst[0] = worst[0].max((f - e).abs() / size);
            }
            let bodies = tree.forward_kinematics(&q, &mut tree.workspace());
            let mut multipliers = found.multipliers.iter();
            for (closure, stated) in closures.iter().zip(state["closures"].as_array().unwrap()) {
                let Condition::Joint { kind, a, b } = &closure.condition else { panic!("a joint") };
                let axes = |end: &dynid_model::closed::LinkFrame| {
                    let frame = mechanism.frame(&end.link).unwrap();
                    let inside = frame.placement.then(&end.placement);
                    frame.body.map_or(inside, |k| bodies[k].then(&inside)).rotation
                };
                let (at_a, at_b) = (axes(a), axes(b));
                let mut force = Vec3([0.0; 3]);
                let points = if *kind == CutKind::PlanarRevolute { 2 } else { 3 };
                for axis in &at_a.0[..points] {
                    force = force + axis.scale(*multipliers.next().unwrap());
                }
                let size = numbers(&stated["force"]).iter().fold(1.0_f64, |m, x| m.max(x.abs()));
                for (f, e) in force.0.iter().zip(numbers(&stated["force"])) {
                    worst[1] = worst[1].max((f - e).abs() / size);
                }
                if *kind == CutKind::Universal {
                    let moment = at_b.0[1].cross(at_a.0[0]).scale(*multipliers.next().unwrap());
                    for (f, e) in moment.0.iter().zip(numbers(&stated["moment"])) {
                        worst[2] = worst[2].max((f - e).abs());
                    }
                }
            }
            assert_eq!(multipliers.next(), None);
        }
        println!("{name}: efforts {:.1e}, forces {:.1e}, moments {:.1e}", worst[0], worst[1], worst[2]);
        assert!(worst.iter().all(|w| *w < TOLERANCE), "{name}: {worst:?}");
    }
}
