//! Time of a closed-loop simulation per joint and simulated second, without and with slopes, with stiff gears and such that give way:
//! `cargo bench -p dynid-servo --bench rollout`.
//!
//! The baseline is the simulation with stiff gears and without slopes, in the same run.
#![expect(clippy::print_stdout, clippy::unwrap_used, reason = "a benchmark reports to the terminal")]

use std::time::Instant;

use dynid_model::{
    Description, Inertia, JointDescription, JointKind, LinkDescription, Mat3, Mechanism, Placement, Vec3,
};
use dynid_servo::{Chain, Free, Rollout, Scheme, ServoJoint, ServoLog, ServoValues, Term};

const SECONDS: f64 = 10.0;
const PERIOD: f64 = 0.005;

/// An arm of so many joints, axes that lie alternately across and along.
fn arm(joints: usize) -> Mechanism {
    let mut robot = Description::new("arm");
    robot.links.push(LinkDescription { name: "link0".into(), inertia: None });
    for k in 0..joints {
        let mass = 4.0 * 0.7_f64.powi(k as i32);
        let tensor = Mat3::from_rows([[0.01, 0.0, 0.0], [0.0, 0.02, 0.0], [0.0, 0.0, 0.02]]) * mass;
        robot.links.push(LinkDescription {
            name: format!("link{}", k + 1),
            inertia: Some(Inertia::from_com(mass, Vec3([0.1, 0.01, 0.02]), &tensor)),
        });
        robot.joints.push(JointDescription {
            name: format!("joint{}", k + 1),
            parent: format!("link{k}"),
            child: format!("link{}", k + 1),
            kind: JointKind::Revolute,
            placement: Placement::translate(if k == 0 { 0.0 } else { 0.2 }, 0.0, 0.0),
            axis: if k % 2 == 0 { [0.0, 1.0, 0.0] } else { [0.0, 0.0, 1.0] },
            limits: Default::default(),
            mimic: None,
        });
    }
    robot.build().unwrap()
}

fn main() {
    for joints in [3, 6] {
        let mechanism = arm(joints);
        let chain = &Chain::all(&mechanism)[0];
        let rows = (SECONDS / PERIOD) as usize + 1;
        let time: Vec<f64> = (0..rows).map(|k| k as f64 * PERIOD).collect();
        let wave = |j: usize| {
            time.iter().map(|t| 0.3 * (3.0 * t + j as f64).sin() + 0.1 * (17.0 * t).sin()).collect()
        };
        let command: Vec<Vec<f64>> = (0..joints).map(wave).collect();
        let log = ServoLog::new("bench", time, command.clone(), command);
        let drive = |soft: bool| {
            let joint = ServoJoint::default()
                .with(Term::PositionGain, 200.0)
                .with(Term::VelocityGain, 10.0)
                .with(Term::RotorInertia, 0.05)
                .with(Term::Viscous, 1.0)
                .with(Term::Coulomb, 1.0)
                .with(Term::Delay, 0.008);
            if soft { joint.with(Term::Compliance, 5e-4).with(Term::GearDamping, 2.0) } else { joint }
        };
        let terms = [Term::PositionGain, Term::RotorInertia, Term::Viscous, Term::Coulomb, Term::Compliance];
        let mut baseline = None;
        for soft in [false, true] {
            let values =
                ServoValues { joints: vec![drive(soft); joints], inertias: mechanism.inertia_vector() };
            let asked = if soft { &terms[..] } else { &terms[..4] };
            let mut free: Vec<Free> =
                asked.iter().flat_map(|t| (0..joints).map(|j| Free::term(*t, [j]))).collect();
            free.push(Free::term(Term::Delay, 0..joints));
            for free in [&[][..], &free] {
                let rollout = Rollout::new(chain, Scheme { step_s: PERIOD, ..Scheme::default() }, free);
                let once = || {
                    let start = Instant::now();
                    let mut sum = 0.0;
                    rollout.run(&values, &log, |row| sum += row.reading[0]).unwrap();
                    assert!(sum.is_finite());
                    start.elapsed().as_secs_f64() / (joints as f64 * SECONDS)
                };
                let best = (0..15).map(|_| once()).fold(f64::INFINITY, f64::min);
                let base = *baseline.get_or_insert(best);
                println!(
                    "{joints} joints, {} gears, slopes over {:2} parameters: {:.1} us per joint and second ({:.1} of a stiff simulation)",
                    if soft { "soft " } else { "stiff" },
                    free.len(),
                    1e6 * best,
                    best / base
                );
            }
        }
    }
}
