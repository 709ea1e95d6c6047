//! Base parameters of closed mechanisms: counts and null directions.

use dynid_model::closed::ClosedMechanism;
use dynid_model::*;

use super::{Parts, spec};
use crate::robots::robot;

fn multipliers(model: &ClosedModel) -> Vec<Reaction> {
    (0..model.machine().conditions()).map(|condition| Reaction::Multiplier { condition }).collect()
}

fn check_counts(machine: ClosedMechanism, expected: [usize; 2], what: &str) {
    let model = ClosedModel::new(TreeModel::new(machine.mechanism().clone(), Vec::new()), machine);
    let settings = BaseSettings::default();
    let efforts = BaseParameters::of_model(&model, &[], &settings);
    let whole = BaseParameters::with_reactions(&model, &multipliers(&model), &[], &settings);
    println!("{what}: {} {:?}, {} {:?}", efforts.len(), efforts.gap, whole.len(), whole.gap);
    assert_eq!([efforts.len(), whole.len()], expected, "{what}");
    for gap in [efforts.gap, whole.gap] {
        assert!(gap.ratio() > 1e6, "{what}: {gap:?}");
    }
}

#[test]
fn counts_are_those_of_the_specification() {
    for (name, expected) in
        [("fourbar", [8, 9]), ("fivebar", [11, 12]), ("delta", [37, 43]), ("stewart", [88, 94])]
    {
        check_counts(robot(name).close(), expected, name);
    }
}

#[test]
fn counts_of_efforts_belong_to_the_mechanism_not_to_the_cut() {
    for (name, variant, expected) in [
        ("fourbar", "spatial", [8, 9]),
        ("fourbar", "coupler_as_distance", [6, 6]),
        ("delta", "parallelogram", [37, 73]),
        ("delta", "rods_as_distances", [10, 13]),
    ] {
        let Some(stated) = spec(&format!("robots/{name}.json")) else { return };
        check_counts(Parts::new(&stated, Some(variant)).close(), expected, variant);
    }
}

/// Efforts and multipliers along random states, for given parameters.
fn felt(model: &ClosedModel, reactions: &[Reaction], linear: &[f64]) -> [Vec<f64>; 2] {
    model.random_motion(100, 3).with_block(|block| {
        let reactions = model.reactions(reactions);
        let mut effort = RegressorBlock::new(model.layout().clone(), block.samples);
        let mut rows = RegressorBlock::new(reactions.layout().clone(), block.samples);
        model.reaction_regressor(block, &[], &reactions, &mut effort, &mut rows);
        [effort, rows].map(|b| (0..b.layout().outputs()).flat_map(|o| b.effort(o, linear)).collect())
    })
}

fn largest(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |m, x| if x.abs() <= m { m } else { x.abs() })
}

const M: usize = 0;
const MX: usize = 1;
const IZZ: usize = 9;

#[test]
fn a_mass_moved_across_a_pin_is_felt_by_the_cut_only() {
    let model = robot("fourbar").model();
    let (l1, l2, l3) = (0.12, 0.35, 0.30);
    let at = |entries: &[(usize, usize, f64)]| {
        let mut direction = vec![0.0; 30];
        entries.iter().for_each(|(body, c, x)| direction[10 * body + c] = *x);
        direction
    };
    let tree = at(&[(1, M, 1.0), (0, MX, -l1), (0, IZZ, -l1 * l1)]);
    let cut = at(&[(1, M, 1.0), (1, MX, l2), (1, IZZ, l2 * l2), (2, MX, -l3), (2, IZZ, -l3 * l3)]);
    let known = felt(&model, &multipliers(&model), &model.tree().mechanism().inertia_vector());
    let [size, pressing] = known.map(|v| largest(&v));
    for (direction, seen) in [(tree, false), (cut, true)] {
        let [effort, multipliers] = felt(&model, &multipliers(&model), &direction);
        println!("{:e} of {size}, {:e} of {pressing}", largest(&effort), largest(&multipliers));
        assert!(largest(&effort) < 1e-11 * size);
        assert_eq!(largest(&multipliers) > 1e-3, seen);
        assert!(seen || largest(&multipliers) < 1e-11 * pressing);
    }
}

/// Thirteen parameters move one or more entries of the bodies: three alike sliders, legs and platform about their pins.
#[test]
fn sliders_legs_and_platform_of_the_planar_mechanism_have_nine_base_parameters() {
    let model = robot("prr3").model();
    let body = |name: &str| model.tree().mechanism().joint_index(name).unwrap();
    let place = |name: &str, c: usize| 10 * body(name) + c;
    let legs = ["leg1", "leg2", "leg3"];
    let sliders = ["slider1", "slider2", "slider3"];
    let mut ties: Vec<Vec<usize>> = vec![sliders.iter().map(|s| place(s, M)).collect()];
    for c in [M, MX, IZZ] {
        ties.extend(legs.iter().chain(&["platform"]).map(|b| vec![place(b, c)]));
    }
    let columns = model.parameters().linear.len();
    let vector = |tied: &[f64]| {
        let mut x = vec![0.0; columns];
        ties.iter().zip(tied).for_each(|(places, value)| places.iter().for_each(|p| x[*p] = *value));
        x
    };
    let guides: Vec<Reaction> =
        sliders.iter().map(|s| Reaction::Joint { body: body(s), component: 1 }).collect();
    let rank = |reactions: &[Reaction]| {
        let columns: Vec<Vec<f64>> = (0..13)
            .map(|k| {
                let mut unit = [0.0; 13];
                unit[k] = 1.0;
                felt(&model, reactions, &vector(&unit)).concat()
            })
            .collect();
        super::rank(&columns)
    };
    // The forces of the guideway tell nothing more; those of the pins at the platform do.
    assert_eq!([rank(&[]), rank(&guides), rank(&multipliers(&model))], [9, 9, 12]);

    // m_s | m_L1 m_L2 m_L3 m_p | mu1 mu2 mu3 sigma | I_L1 I_L2 I_L3 I_p
    let (l1, l2, l3, xp): (f64, f64, f64, f64) = (0.6, 0.475, 0.604, 0.28);
    let null = [
        [1.0, 0.0, 0.0, 0.0, -3.0, l1, l2, l3, -2.0 * xp, l1 * l1, l2 * l2, l3 * l3, -2.0 * xp * xp],
        [0.0, 1.0, 0.0, 0.0, -1.0, l1, 0.0, 0.0, -xp, l1 * l1, 0.0, 0.0, -xp * xp],
        [0.0, 0.0, 1.0, 0.0, -1.0, 0.0, l2, 0.0, 0.0, 0.0, l2 * l2, 0.0, 0.0],
        [0.0, 0.0, 0.0, 1.0, -1.0, 0.0, 0.0, l3, -xp, 0.0, 0.0, l3 * l3, -xp * xp],
    ];
    let design = model.tree().mechanism().inertia_vector();
    let [size, pressing] = felt(&model, &guides, &design).map(|v| largest(&v));
    for direction in null {
        let [effort, pressed] = felt(&model, &guides, &vector(&direction));
        println!("{:e} of {size}, {:e} of {pressing}", largest(&effort), largest(&pressed));
        assert!(largest(&effort) < 1e-9 && largest(&pressed) < 1e-9, "{direction:?}");
    }
}

#[test]
fn random_states_are_closed_spread_and_repeatable() {
    for name in ["fourbar", "fivebar", "prr3", "delta", "stewart"] {
        let model = robot(name).model();
        let machine = model.machine();
        let motion = model.random_motion(200, 5);
        assert_eq!(motion, model.random_motion(200, 5));
        motion.with_block(|block| {
            let mut work = machine.workspace();
            let mut q = vec![0.0; machine.mobility()];
            for s in 0..block.samples {
                q.iter_mut().enumerate().for_each(|(k, x)| *x = block.position(k)[s]);
                let direct = machine.reach(&mut work, &q);
                if direct.is_err() {
                    machine.go_home(&mut work);
                    machine.reach(&mut work, &q).unwrap();
                }
                assert!(largest(work.residual()) < 1e-11);
                assert!(machine.singularity(&work).measure > 1e-3);
            }
            let spread = |k: usize| {
                let all = block.position(k);
                let mean = all.iter().sum::<f64>() / all.len() as f64;
                (all.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / all.len() as f64).sqrt()
            };
            let spreads: Vec<f64> = (0..machine.mobility()).map(spread).collect();
            println!("{name}: {spreads:.3?}");
            assert!(spreads.iter().all(|s| *s > 0.03), "{name}: {spreads:?}");
        });
    }
}
