//! Trees with every kind of joint, and states of them.

use dynid_model::*;
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

pub(crate) fn generator(seed: u64) -> ChaCha8Rng {
    ChaCha8Rng::seed_from_u64(seed)
}

pub(crate) fn numbers<const N: usize>(rng: &mut impl Rng) -> [f64; N] {
    std::array::from_fn(|_| rng.random_range(-1.0..=1.0))
}

fn axis(rng: &mut impl Rng) -> [f64; 3] {
    let mut axis = [0.0; 3];
    match rng.random_range(0..3) {
        0 => return numbers(rng),
        1 => axis[rng.random_range(0..3)] = 1.0,
        _ => axis[rng.random_range(0..3)] = -1.0,
    }
    axis
}

pub(crate) fn placement(rng: &mut impl Rng) -> Placement {
    Placement::from_xyz_rpy(numbers(rng), numbers::<3>(rng).map(|x| 3.0 * x))
}

/// A body of a few point masses: its inertia is physical.
pub(crate) fn inertia(rng: &mut impl Rng) -> Inertia {
    (0..5).fold(Inertia::default(), |sum, _| {
        let at = Placement { rotation: Mat3::identity(), translation: Vec3(numbers(rng)) };
        let mass = 1.0 + numbers::<1>(rng)[0].abs();
        sum.plus(&Inertia::from_com(mass, Vec3::zero(), &Mat3::zero()).in_frame(&at))
    })
}

/// `joints` moving joints of all kinds, hung on any link before them; joint `k` moves link `k + 1`.
pub(crate) fn tree(joints: usize, seed: u64) -> Description {
    let mut rng = generator(seed);
    let rng = &mut rng;
    let mut d = Description::new(format!("tree {seed}"));
    d.gravity = numbers(rng).map(|x| 9.81 * x);
    d.links.push(LinkDescription { name: "l0".into(), inertia: None });
    for k in 1..=joints {
        // Mostly chains, now and then a branch.
        let parent = if rng.random_bool(0.7) { k - 1 } else { rng.random_range(0..k) };
        let kind = match rng.random_range(0..10) {
            0..=3 => JointKind::Revolute,
            4 | 5 => JointKind::Continuous,
            6 | 7 => JointKind::Prismatic,
            8 => JointKind::Helical { pitch: numbers::<1>(rng)[0] },
            _ => JointKind::Floating,
        };
        d.links.push(LinkDescription { name: format!("l{k}"), inertia: Some(inertia(rng)) });
        d.joints.push(JointDescription {
            name: format!("j{k}"),
            parent: format!("l{parent}"),
            child: format!("l{k}"),
            kind,
            placement: placement(rng),
            axis: axis(rng),
            limits: Limits::default(),
            mimic: None,
        });
    }
    d
}

/// Positions, rates and accelerations of one state.
pub(crate) struct Motion {
    pub(crate) q: Vec<f64>,
    pub(crate) dq: Vec<f64>,
    pub(crate) ddq: Vec<f64>,
}

impl Motion {
    pub(crate) fn state(&self) -> State<'_, f64> {
        State { q: &self.q, dq: &self.dq, ddq: &self.ddq, gravity: None }
    }
}

/// Sample `s` of a block.
pub(crate) fn sample(block: &MotionBlock<'_>, s: usize) -> Motion {
    let of = |values: &[f64]| values.chunks_exact(block.stride).map(|c| c[s]).collect::<Vec<f64>>();
    Motion { q: of(block.q), dq: of(block.dq), ddq: of(block.ddq) }
}

pub(crate) fn motion(mechanism: &Mechanism, seed: u64) -> Motion {
    RandomMotion::new(mechanism, &[], 1, seed).with_block(|block| sample(block, 0))
}

pub(crate) fn effort(mechanism: &Mechanism, motion: &Motion) -> Vec<f64> {
    let dynamics = Dynamics::new(mechanism);
    let mut effort = vec![0.0; dynamics.rates()];
    dynamics.inverse_dynamics(
        &motion.state(),
        &mechanism.inertia_vector(),
        &mut dynamics.workspace(),
        &mut effort,
    );
    effort
}

pub(crate) fn regressor(mechanism: &Mechanism, motion: &Motion) -> Vec<f64> {
    let dynamics = Dynamics::new(mechanism);
    let mut y = vec![f64::NAN; dynamics.rates() * dynamics.inertial_parameters()];
    dynamics.regressor(&motion.state(), &mut dynamics.workspace(), &mut y);
    y
}

/// Largest term `|Y[r, c] φ[c]|` of all efforts: what rounding errors are measured by.
pub(crate) fn largest_term(mechanism: &Mechanism, y: &[f64]) -> f64 {
    let phi = mechanism.inertia_vector();
    y.chunks_exact(phi.len()).flat_map(|r| r.iter().zip(&phi)).fold(0.0, |m, (w, p)| m.max((w * p).abs()))
}

#[track_caller]
pub(crate) fn check_close(found: &[f64], expected: &[f64], tolerance: f64, what: &str) {
    assert_eq!(found.len(), expected.len(), "{what}: length");
    for (k, (f, e)) in found.iter().zip(expected).enumerate() {
        assert!((f - e).abs() <= tolerance, "{what}[{k}]: {f} against {e}, {:e}", (f - e).abs());
    }
}
