//! A simulated quadruped of twelve joints, held in the air.

use dynid_model::{
    Description, Inertia, JointDescription, JointKind, LinkDescription, Mat3, Mechanism, Placement, Vec3,
};
use dynid_servo::identify::identify;
use dynid_servo::{Bodies, Body, DEVIATIONS, Scheme, ServoJoint, ServoSettings, Term};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::arm::{PERIOD, held, log_about, machines, share};

/// A link of a leg.
struct Part {
    name: &'static str,
    mass: f64,
    centre: [f64; 3],
    /// Moment of inertia about the centre, across the link.
    inertia: f64,
    /// From its joint to the next.
    next: [f64; 3],
}

const LEG: [Part; 3] = [
    Part { name: "hip", mass: 0.68, centre: [0.005, 0.004, 0.0], inertia: 8e-4, next: [0.0, 0.1, 0.0] },
    Part {
        name: "thigh",
        mass: 1.15,
        centre: [-0.004, -0.02, -0.03],
        inertia: 6e-3,
        next: [0.0, 0.0, -0.21],
    },
    Part { name: "calf", mass: 0.24, centre: [0.006, 0.0, -0.12], inertia: 3e-3, next: [0.0, 0.0, 0.0] },
];

/// Where the legs hang.
const POSTURE: [f64; 3] = [0.0, 0.8, -1.6];

fn quadruped() -> Mechanism {
    let mut robot = Description::new("quadruped");
    robot.links.push(LinkDescription { name: "trunk".into(), inertia: None });
    for (leg, x, y) in [("FL", 0.19, 0.05), ("FR", 0.19, -0.05), ("RL", -0.19, 0.05), ("RR", -0.19, -0.05)] {
        let mut parent = "trunk".to_owned();
        let mut at = [x, y, 0.0];
        for (k, part) in LEG.iter().enumerate() {
            let name = format!("{leg}_{}", part.name);
            let mirrored = |v: [f64; 3]| [v[0], v[1] * f64::signum(y), v[2]];
            let across = part.inertia;
            let tensor = Mat3::from_rows([[across, 0.0, 0.0], [0.0, across, 0.0], [0.0, 0.0, 0.3 * across]]);
            robot.links.push(LinkDescription {
                name: name.clone(),
                inertia: Some(Inertia::from_com(part.mass, Vec3(mirrored(part.centre)), &tensor)),
            });
            robot.joints.push(JointDescription {
                name: format!("{name}_joint"),
                parent: std::mem::replace(&mut parent, name.clone()),
                child: name,
                kind: JointKind::Revolute,
                placement: Placement::translate(at[0], at[1], at[2]),
                axis: if k == 0 { [1.0, 0.0, 0.0] } else { [0.0, 1.0, 0.0] },
                limits: Default::default(),
                mimic: None,
            });
            at = mirrored(part.next);
        }
    }
    robot.build().unwrap()
}

/// Drives about nominal ones by factors of up to `e^0.4`; every leg has a delay of its own.
fn drives(random: &mut ChaCha8Rng, rich: bool) -> Vec<ServoJoint> {
    let mut out = Vec::new();
    for _ in 0..4 {
        let delay = random.random_range(0.3..3.7) * PERIOD;
        for (gain, rotor, viscous, coulomb) in
            [(40.0, 0.012, 0.1, 0.3), (40.0, 0.012, 0.1, 0.25), (40.0, 0.025, 0.15, 0.4)]
        {
            let mut about = |x: f64| x * random.random_range(-0.4..0.4_f64).exp();
            let coulomb = about(coulomb);
            let joint = ServoJoint::default()
                .with(Term::PositionGain, about(gain))
                .with(Term::VelocityGain, 1.0)
                .with(Term::RotorInertia, about(rotor))
                .with(Term::Viscous, about(viscous))
                .with(Term::Coulomb, coulomb)
                .with(Term::Delay, delay);
            out.push(match rich {
                true => joint
                    .with(Term::Stiction, 0.5 * coulomb)
                    .with(Term::StribeckVelocity, 0.1)
                    .with(Term::LoadFriction, 0.08),
                false => joint,
            });
        }
    }
    out
}

/// What is simulated and what is known of it.
#[derive(Debug, Clone, Copy)]
struct Case {
    /// Friction has a Stribeck peak and grows with the load.
    rich: bool,
    /// Position gains are known.
    gains: bool,
    /// Bodies are those of the robot file, else they scatter about them by 20 %.
    bodies: bool,
}

/// Intervals that hold the truth, and all.
#[derive(Debug, Default)]
struct Coverage {
    /// Of drives, by term.
    drives: Vec<(Term, usize, usize)>,
    /// Of what is told of the bodies.
    bodies: (usize, usize),
}

fn coverage(case: Case, machines: u64) -> Coverage {
    let mechanism = quadruped();
    let mut count = Coverage::default();
    for seed in 0..machines {
        let mut random = ChaCha8Rng::seed_from_u64(100 + seed);
        let truth = drives(&mut random, case.rich);
        let mut inertias = mechanism.inertia_vector();
        for (b, inertia) in inertias.as_chunks_mut::<DEVIATIONS>().0.iter_mut().enumerate() {
            // Sum of twelve uniform numbers: normal enough.
            let mut normal = || (0..12).map(|_| random.random_range(-0.5..0.5_f64)).sum::<f64>();
            let deviation = std::array::from_fn(|k| Body::std(k, 0.2) * normal());
            if !case.bodies {
                *inertia = Body::new(b, &Inertia(*inertia)).unwrap().inertia(&deviation).0;
            }
        }
        let scheme = Scheme { step_s: PERIOD / 16.0 * (1.0 + 1e-6), ..Scheme::default() };
        let log = log_about(&POSTURE.repeat(4), &mechanism, (&truth, &inertias), scheme, (3200, seed));
        let mut settings = ServoSettings::new(truth.len());
        for (j, (joint, truth)) in settings.joints.iter_mut().zip(&truth).enumerate() {
            joint.set(Term::VelocityGain, truth.get(Term::VelocityGain));
            if case.gains {
                joint.set(Term::PositionGain, truth.get(Term::PositionGain));
                settings.known_gain[j] = true;
            }
        }
        settings.own_gains = true;
        settings.gain_error = 0.0;
        if !case.bodies {
            settings.bodies = Bodies::Found;
            settings.body_error = 0.4;
        }
        let found = identify(&mechanism, &[log], &settings).unwrap();
        assert!(found.misfit < 1.1, "{case:?} {seed}: {}", found.misfit);
        assert_eq!(found.bodies.len(), if case.bodies { 0 } else { 12 });
        held(&found, &truth, &mut count.drives);
        for body in &found.bodies {
            assert!(body.inertia.physical_fault().is_none(), "{body:?}");
            for (k, half) in body.half_width.iter().enumerate().filter(|(k, _)| body.told[*k]) {
                let error = (body.inertia.0[k] - inertias[DEVIATIONS * body.body + k]).abs();
                count.bodies.0 += usize::from(half.is_some_and(|half| error <= half));
                count.bodies.1 += 1;
            }
        }
    }
    count
}

#[test]
fn intervals_hold_in_the_air() {
    let case = |rich, gains, bodies| Case { rich, gains, bodies };
    let all = [
        case(false, false, true),
        case(false, true, false),
        case(false, true, true),
        case(false, false, false),
        case(true, true, true),
        case(true, false, true),
        case(true, true, false),
        case(true, false, false),
    ];
    // All of them where they are to be counted.
    let counted = machines() > 12;
    // Joints of one machine are not independent.
    let cases = if counted { &all[..] } else { &all[..2] };
    for case in cases {
        let share_of_machines = if case.bodies { 4 } else { 12 };
        let Coverage { drives: count, bodies: of_bodies } =
            coverage(*case, (machines() / share_of_machines) as u64);
        println!("{case:?}: {:.3} {count:?} bodies {of_bodies:?}", share(&count));
        // Where gains are unknown too, the scale leans on the file, whose bodies the true ones exceed on the average.
        let least = match (counted, case.bodies || case.gains) {
            (false, _) => 0.8,
            (true, true) => 0.93,
            (true, false) => 0.88,
        };
        assert!(share(&count) >= least, "{case:?}: {count:?}");
        assert!(of_bodies.0 * 10 >= of_bodies.1 * 9, "{case:?}: {of_bodies:?}");
    }
}
