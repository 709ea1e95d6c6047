//! Rows B1 and B2: the general engine's dynamics of this mechanism.

use dynid::estimators::Mat;
use dynid::excitation::constraint::PathConstraint;
use dynid::model::closed::ClosedDynamics;
use dynid::model::{
    Description, Dynamics, JointDescription, JointKind, Limits, LinkDescription, MotionBlock, Placement,
    State, Vec3,
};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde_json::json;

use super::machine::{Machine, SLIDERS};
use super::reference::{self, StateReference, Tolerance};
use super::settings::Settings;
use super::{fault, problem, worst};
use crate::{Row, RunSettings, StudyError};

/// Where the tree's coordinates stand among the reference's twelve.
const PLACES: [usize; 9] = [0, 1, 2, 6, 7, 8, 9, 10, 11];
/// Legs among the tree's coordinates.
const LEGS: std::ops::Range<usize> = 3..6;

/// Largest differences from the reference, and whether all are within its tolerance.
#[derive(Debug)]
struct Differences {
    tolerance: Tolerance,
    largest: Vec<(&'static str, f64)>,
    within: bool,
}

impl Differences {
    fn take(&mut self, what: &'static str, found: &[f64], expected: &[f64]) {
        let place = match self.largest.iter().position(|(name, _)| *name == what) {
            Some(place) => place,
            None => {
                self.largest.push((what, 0.0));
                self.largest.len() - 1
            }
        };
        self.within &= found.len() == expected.len();
        for (f, e) in found.iter().zip(expected) {
            let off = (f - e).abs();
            self.within &= off <= self.tolerance.abs + self.tolerance.rel * e.abs();
            self.largest[place].1 = worst(self.largest[place].1, off);
        }
    }
}

/// Row B1.
pub(super) fn golden_row(machine: &Machine) -> Result<Row, StudyError> {
    let reference = reference::dynamics()?;
    let mut off = Differences { tolerance: reference.tolerance, largest: Vec::new(), within: true };
    let mut lacking = 0.0_f64;
    for state in &reference.states {
        compare(machine, state, &mut off)?;
        let sum: f64 = state.as_published[..SLIDERS].iter().sum();
        lacking = lacking.max((1.0 - sum / state.check_sum_normals).abs());
    }
    let words: Vec<String> = off.largest.iter().map(|(name, e)| format!("{name} {e:.1e}")).collect();
    let measured: serde_json::Map<_, _> =
        off.largest.iter().map(|(n, e)| ((*n).to_owned(), json!(e))).collect();
    Ok(Row::new(
        "B1",
        "Kinematics, forces, reactions of the guideway, pin forces, compact form and the 13 columns agree with an independent \
         implementation, with and without gravity in the plane",
        "q, q', q'', τ, λ (loops with the sliders' y), M̄, N̄ and W to 1e-8",
        json!({ "states": reference.states.len(), "largest_differences": measured,
                "normal_forces_lacking_as_published": lacking }),
        format!(
            "{} states: {}; as published, without the sliders' y, the normal forces miss up to {:.0} % of the momentum's balance",
            reference.states.len(),
            words.join(", "),
            100.0 * lacking
        ),
        off.within,
    ))
}

fn compare(machine: &Machine, state: &StateReference, off: &mut Differences) -> Result<(), StudyError> {
    let linear = machine.linear(&state.phi);
    let gravity = Some(Vec3([0.0, -state.g, 0.0]));
    let mut dynamics = ClosedDynamics::new(machine.model.machine().clone());
    dynamics.reach(&state.pose).map_err(fault)?;
    let (dq, ddq) = dynamics.motion(&state.pose_d, &state.pose_dd);
    let picked = |of: &[f64; 12]| PLACES.map(|k| of[k]);
    let q = dynamics.pose().positions().to_vec();
    off.take("q", &q, &picked(&state.q));
    off.take("q'", &dq, &picked(&state.qd));
    off.take("q''", &ddq, &picked(&state.qdd));
    let found = dynamics.inverse_dynamics((&dq, &ddq), gravity, &linear);
    off.take("τ", &found.drives, &state.tau_frictionless);
    let mut multipliers = Vec::new();
    for rate in machine.driven() {
        let rows = dynamics.reaction_rows(*rate, (&dq, &ddq), gravity);
        multipliers.push(rows.wrench(&linear, &found.multipliers)[1]);
    }
    // Forces in the cuts are in axes of the legs.
    for (pin, leg) in found.multipliers.chunks_exact(2).zip(LEGS) {
        let (s, c) = q[leg].sin_cos();
        multipliers.extend([c * pin[0] - s * pin[1], s * pin[0] + c * pin[1]]);
    }
    off.take("λ", &multipliers, &state.multipliers);
    let regressor = dynamics.regressor((&dq, &ddq), gravity);
    let columns = linear.len();
    for (row, expected) in regressor.drives.chunks_exact(columns).zip(&state.regressor) {
        let tied = |tie: &Vec<f64>| row.iter().zip(tie).map(|(w, t)| w * t).sum::<f64>();
        off.take("W", &machine.ties.iter().map(tied).collect::<Vec<f64>>(), expected);
    }
    let (mass, bias) = compact(machine, &q, &dq, gravity, &linear)?;
    for (k, expected) in state.mass.iter().enumerate() {
        off.take("M̄", &mass.iter().map(|column| column[k]).collect::<Vec<f64>>(), expected);
    }
    off.take("N̄", &bias, &state.bias);
    Ok(())
}

/// `M̄`, column after column, and `N̄` in coordinates of the sliders.
fn compact(
    machine: &Machine,
    q: &[f64],
    dq: &[f64],
    gravity: Option<Vec3<f64>>,
    linear: &[f64],
) -> Result<(Vec<Vec<f64>>, Vec<f64>), StudyError> {
    let mut dynamics = ClosedDynamics::new(machine.by_sliders.clone());
    dynamics.take(q).map_err(fault)?;
    let rates: Vec<f64> = machine.driven().iter().map(|r| dq[*r]).collect();
    let mut at = |accelerations: &[f64]| {
        let (dq, ddq) = dynamics.motion(&rates, accelerations);
        dynamics.inverse_dynamics((&dq, &ddq), gravity, linear).drives
    };
    let bias = at(&[0.0; SLIDERS]);
    let column = |k: usize| {
        let mut unit = [0.0; SLIDERS];
        unit[k] = 1.0;
        at(&unit).iter().zip(&bias).map(|(t, b)| t - b).collect()
    };
    Ok(((0..SLIDERS).map(column).collect(), bias))
}

/// The tree on a joint along y that carries all of it: its effort is what changes the momentum along y.
fn lifted(description: &Description) -> Result<Dynamics, StudyError> {
    let mut description = description.clone();
    let roots: Vec<String> = description
        .joints
        .iter()
        .map(|j| j.parent.clone())
        .filter(|parent| description.joints.iter().all(|j| j.child != *parent))
        .collect();
    let Some(ground) = roots.first().cloned() else { return Err(fault("no ground")) };
    for joint in description.joints.iter_mut().filter(|j| j.parent == ground) {
        joint.parent = "lift".to_owned();
    }
    description.links.push(LinkDescription { name: "lift".to_owned(), inertia: None });
    description.joints.insert(
        0,
        JointDescription {
            name: "lift".to_owned(),
            parent: ground,
            child: "lift".to_owned(),
            kind: JointKind::Prismatic,
            placement: Placement::identity(),
            axis: [0.0, 1.0, 0.0],
            limits: Limits::default(),
            mimic: None,
        },
    );
    Ok(Dynamics::new(&description.build().map_err(fault)?))
}

/// Largest differences between ways to the same numbers, relative to the largest of them or to one.
#[derive(Debug, Default)]
struct Ways {
    projection: f64,
    compact: f64,
    block: f64,
    closure_rates: f64,
    closure_accelerations: f64,
    momentum: f64,
}

fn apart(a: &[f64], b: &[f64]) -> f64 {
    let size = a.iter().fold(1.0_f64, |m, x| m.max(x.abs()));
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, worst) / size
}

/// Random poses within the limits of sliders and legs, with random rates and accelerations.
fn states(
    machine: &Machine,
    settings: &Settings,
    count: usize,
    seed: u64,
) -> Result<Vec<[[f64; SLIDERS]; 3]>, StudyError> {
    let limits = problem::joints(machine, settings)?;
    let own = &settings.limits;
    let ranges = [own.x, own.y, (-own.angle, own.angle)];
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut found = Vec::with_capacity(count);
    let mut values = vec![0.0; limits.rows().len()];
    while found.len() < count {
        let pose = ranges.map(|(low, high)| rng.random_range(low..=high));
        limits.values(&MotionBlock::plain(1, &pose, &[0.0; SLIDERS], &[0.0; SLIDERS]), 1, &mut values);
        // Where there is no pose, values are not numbers.
        if limits.rows().iter().zip(&values).all(|(row, v)| (row.lower..=row.upper).contains(v)) {
            let mut uniform = |most: f64| [(); SLIDERS].map(|()| rng.random_range(-most..=most));
            found.push([pose, uniform(2.0), uniform(5.0)]);
        }
    }
    Ok(found)
}

/// Row B2.
pub(super) fn ways_row(machine: &Machine, settings: &Settings, run: &RunSettings) -> Result<Row, StudyError> {
    const POSES: usize = 500;
    let truth = settings.truth();
    let linear = machine.linear(&truth[..settings.parameter.len()]);
    let gravity = Vec3([0.0, -settings.gravity, 0.0]);
    let tree = Dynamics::new(machine.model.machine().mechanism());
    let lift = lifted(&machine.description)?;
    let mut dynamics = ClosedDynamics::new(machine.model.machine().clone());
    let mut off = Ways::default();
    for [pose, rates, accelerations] in &states(machine, settings, POSES, run.seed)? {
        dynamics.reach(pose).map_err(fault)?;
        let (dq, ddq) = dynamics.motion(rates, accelerations);
        let found = dynamics.inverse_dynamics((&dq, &ddq), Some(gravity), &linear);
        let q = dynamics.pose().positions().to_vec();

        let mut by_sliders = ClosedDynamics::new(machine.by_sliders.clone());
        by_sliders.take(&q).map_err(fault)?;
        let pick = |of: &[f64]| -> Vec<f64> { machine.driven().iter().map(|r| of[*r]).collect() };
        let (own_dq, own_ddq) = by_sliders.motion(&pick(&dq), &pick(&ddq));
        let projected = by_sliders.inverse_dynamics((&own_dq, &own_ddq), Some(gravity), &linear);
        off.projection = worst(off.projection, apart(&found.drives, &projected.drives));
        off.projection = worst(off.projection, apart(&found.multipliers, &projected.multipliers));

        let (mass, bias) = compact(machine, &q, &dq, Some(gravity), &linear)?;
        let accelerations = pick(&ddq);
        let force = |k: usize| bias[k] + mass.iter().zip(&accelerations).map(|(m, a)| m[k] * a).sum::<f64>();
        off.compact = worst(off.compact, apart(&found.drives, &[force(0), force(1), force(2)]));

        // [M -Jᵀ; J 0] [q''; λ] = [Q - N; -b].
        let (n, m) = (tree.rates(), machine.model.machine().conditions());
        let mut work = tree.workspace();
        let inertia = tree.mass_matrix(&q, &linear, &mut work);
        let mut rest = vec![0.0; n];
        let still = State { q: &q, dq: &dq, ddq: &vec![0.0; n], gravity: Some(gravity) };
        tree.inverse_dynamics(&still, &linear, &mut work, &mut rest);
        let (jacobian, drift) = (dynamics.pose().jacobian(), dynamics.pose().bias());
        let system = Mat::from_fn(n + m, n + m, |i, j| match (i < n, j < n) {
            (true, true) => inertia[i * n + j],
            (true, false) => -jacobian[(j - n) * n + i],
            (false, true) => jacobian[(i - n) * n + j],
            (false, false) => 0.0,
        });
        let drive =
            |rate: usize| machine.driven().iter().position(|r| *r == rate).map_or(0.0, |k| found.drives[k]);
        let right = Mat::from_fn(n + m, 1, |i, _| if i < n { drive(i) - rest[i] } else { -drift[i - n] });
        let solved = system.lu().solve(&right);
        let solution = solved.col(0);
        off.block = worst(off.block, apart(&ddq, &solution[..n]));
        off.block = worst(off.block, apart(&found.multipliers, &solution[n..]));

        let product = |v: &[f64]| -> Vec<f64> {
            jacobian.chunks_exact(n).map(|row| row.iter().zip(v).map(|(j, v)| j * v).sum()).collect()
        };
        off.closure_rates = worst(off.closure_rates, apart(&product(&dq), &vec![0.0; m]));
        let negative: Vec<f64> = drift.iter().map(|b| -b).collect();
        off.closure_accelerations = worst(off.closure_accelerations, apart(&negative, &product(&ddq)));

        let normal = |rate: &usize| {
            dynamics.reaction_rows(*rate, (&dq, &ddq), Some(gravity)).wrench(&linear, &found.multipliers)[1]
        };
        let normals: f64 = machine.driven().iter().map(normal).sum();
        let under = |of: &[f64]| -> Vec<f64> { std::iter::once(0.0).chain(of.iter().copied()).collect() };
        let (q, dq, ddq) = (under(&q), under(&dq), under(&ddq));
        let mut effort = vec![0.0; n + 1];
        let state = State { q: &q, dq: &dq, ddq: &ddq, gravity: Some(gravity) };
        let inertias: Vec<f64> = [0.0; 10].into_iter().chain(linear.iter().copied()).collect();
        lift.inverse_dynamics(&state, &inertias, &mut lift.workspace(), &mut effort);
        off.momentum = worst(off.momentum, apart(&[effort[0]], &[normals]));
    }
    let forces = [off.projection, off.compact, off.block].into_iter().fold(0.0, worst);
    let closures = worst(off.closure_rates, off.closure_accelerations);
    Ok(Row::new(
        "B2",
        "Virtual work in the platform's coordinates, projection onto the sliders, the compact form and the forward solution with \
         multipliers give the same motion and forces; the guideway's reactions balance the momentum across it",
        "1e-9, relative to the largest force, on 500 random poses with gravity in the plane; B q' = 0, B q'' + B'q' = 0; \
         Σ λ1..3 = rate of the y-momentum plus weight",
        json!({ "poses": POSES, "projection": off.projection, "compact": off.compact, "block_solve": off.block,
                "closure_rates": off.closure_rates, "closure_accelerations": off.closure_accelerations,
                "momentum": off.momentum }),
        format!(
            "projection {:.1e}, compact {:.1e}, block solve {:.1e}; closures {closures:.1e}; momentum {:.1e}",
            off.projection, off.compact, off.block, off.momentum
        ),
        forces <= 1e-9 && closures <= 1e-9 && off.momentum <= 1e-9,
    ))
}
