//! Public robots against numbers of an independent library (`data/oracles`: conventions, order, licences).

#![expect(clippy::unwrap_used, reason = "helpers of tests outside of test functions")]

use std::path::Path;

use dynid_model::*;
use dynid_robots::robot;
use dynid_testing::shared;
use serde_json::Value;

/// Our parameter `c` is the oracle's parameter `ORACLE_ORDER[c]`: there Iyy comes before Ixz.
const ORACLE_ORDER: [usize; 10] = [0, 1, 2, 3, 4, 5, 7, 6, 8, 9];

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect()
}

struct OracleState {
    q: Vec<f64>,
    dq: Vec<f64>,
    ddq: Vec<f64>,
    gravity: [f64; 3],
    effort: Vec<f64>,
    /// Row-major, our order of rows and columns.
    regressor: Vec<f64>,
    kinetic: f64,
    potential: f64,
    mass: Option<Vec<f64>>,
}

/// An oracle in our order: joints of the file, parameters of [`ORACLE_ORDER`].
struct Oracle {
    mechanism: Mechanism,
    /// Ten per body.
    parameters: Vec<f64>,
    base_parameters: usize,
    zero_columns: Vec<usize>,
    states: Vec<OracleState>,
}

fn description(folder: &Path, urdf: &str, floating: bool) -> Description {
    let mut description = robot::read(folder.join(urdf)).unwrap().description;
    description.floating_base = floating;
    description
}

fn oracle(folder: &Path, name: &str) -> Oracle {
    let text = std::fs::read_to_string(folder.join(format!("{name}_oracle.json"))).unwrap();
    let json: Value = serde_json::from_str(&text).unwrap();
    let floating = json["floating_base"].as_bool().unwrap();
    let mechanism = description(folder, json["urdf"].as_str().unwrap(), floating).build().unwrap();
    let joints = json["joints"].as_array().unwrap();
    assert_eq!(joints.len(), mechanism.bodies().len());
    let (n, bodies) = (mechanism.rates(), joints.len());

    // Where our rates, positions and columns are in the oracle.
    let (mut rate_at, mut position_at, mut column_at) = (Vec::new(), Vec::new(), Vec::new());
    let mut parameters = Vec::new();
    for body in mechanism.bodies() {
        let their = joints.iter().position(|j| j["name"] == body.joint.name.as_str()).unwrap();
        let v = joints[their]["v_index"].as_u64().unwrap() as usize;
        let quaternion = usize::from(floating && their > 0);
        rate_at.extend(v..v + body.joint.rates());
        position_at.extend((v..v + body.joint.positions()).map(|p| p + quaternion));
        column_at.extend(ORACLE_ORDER.map(|c| 10 * their + c));
        let given = numbers(&joints[their]["params"]);
        parameters.extend(ORACLE_ORDER.map(|c| given[c]));
    }
    let pick = |from: &Value, at: &[usize]| {
        let from = numbers(from);
        at.iter().map(|k| from[*k]).collect::<Vec<f64>>()
    };
    let rows = |from: &Value, columns: &[usize]| {
        rate_at.iter().flat_map(|r| pick(&from[*r], columns)).collect::<Vec<f64>>()
    };
    let states = json["states"].as_array().unwrap().iter().map(|s| OracleState {
        q: pick(&s["q"], &position_at),
        dq: pick(&s["qd"], &rate_at),
        ddq: pick(&s["qdd"], &rate_at),
        gravity: numbers(&s["gravity"]).try_into().unwrap(),
        effort: pick(&s["tau"], &rate_at),
        regressor: rows(&s["Y"], &column_at),
        kinetic: s["kinetic_energy"].as_f64().unwrap(),
        potential: s["potential_energy"].as_f64().unwrap(),
        mass: s["mass_matrix"].is_array().then(|| rows(&s["mass_matrix"], &rate_at)),
    });
    let states: Vec<OracleState> = states.collect();
    assert!(!states.is_empty() && states.iter().all(|s| s.regressor.len() == n * 10 * bodies));
    let zero = numbers(&json["zero_columns"]);
    let zero_columns = (0..10 * bodies).filter(|c| zero.contains(&(column_at[*c] as f64))).collect();
    let base_parameters = json["base_param_count"].as_u64().unwrap() as usize;
    Oracle { mechanism, parameters, base_parameters, zero_columns, states }
}

/// Largest difference over the largest expected number.
fn relative(found: &[f64], expected: &[f64]) -> f64 {
    assert_eq!(found.len(), expected.len());
    let scale = expected.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
    let worst = found.iter().zip(expected).fold(0.0_f64, |m, (f, e)| m.max((f - e).abs()));
    if worst == 0.0 { 0.0 } else { worst / scale }
}

fn check_parameters(oracle: &Oracle, name: &str) {
    for (body, expected) in oracle.mechanism.bodies().iter().zip(oracle.parameters.chunks_exact(10)) {
        // Of the scale of mass, first moments and tensor: single entries are differences of larger ones.
        for range in [0..1, 1..4, 4..10] {
            let error = relative(&body.inertia.0[range.clone()], &expected[range]);
            assert!(error <= 1e-12, "{name} {}: {error:e}", body.name);
        }
    }
}

fn check_states(oracle: &Oracle, name: &str) {
    let phi = &oracle.parameters;
    let n = oracle.mechanism.rates();
    for (k, s) in oracle.states.iter().enumerate() {
        let dynamics = Dynamics::new(&oracle.mechanism.clone().with_gravity(s.gravity));
        let mut work = dynamics.workspace();
        let check = |found: &[f64], expected: &[f64], what: &str| {
            let error = relative(found, expected);
            assert!(error <= 1e-11, "{name} state {k}, {what}: {error:e}");
        };
        // Gravity of the mechanism and gravity of the state are two ways to the same number.
        for gravity in [None, Some(Vec3(s.gravity))] {
            let state = State { q: &s.q, dq: &s.dq, ddq: &s.ddq, gravity };
            let mut effort = vec![0.0; n];
            dynamics.inverse_dynamics(&state, phi, &mut work, &mut effort);
            check(&effort, &s.effort, "effort");
            let loaded = LoadedState { q: &s.q, dq: &s.dq, effort: &s.effort, gravity };
            let mut ddq = vec![0.0; n];
            let mut forward = dynamics.forward_workspace();
            dynamics.forward_dynamics(&loaded, phi, AddedInertia::None, &mut forward, &mut ddq).unwrap();
            // Rounding of the efforts, divided by the smallest inertia of the robot.
            let error = relative(&ddq, &s.ddq);
            assert!(error <= 1e-10, "{name} state {k}, acceleration: {error:e}");
            let mut y = vec![f64::NAN; n * phi.len()];
            dynamics.regressor(&state, &mut work, &mut y);
            check(&y, &s.regressor, "regressor");
        }
        if let Some(mass) = &s.mass {
            check(&dynamics.mass_matrix(&s.q, phi, &mut work), mass, "mass matrix");
        }
        let energy = dynamics.energy(&s.q, &s.dq, phi, &mut work);
        check(&[energy.kinetic], &[s.kinetic], "kinetic energy");
        let scale = s.potential.abs().max(s.kinetic);
        assert!((energy.potential - s.potential).abs() <= 1e-11 * scale, "{name} state {k}: potential");
    }
}

/// Channel after channel, as blocks want it.
fn channels<'a>(of: impl Iterator<Item = &'a [f64]> + Clone) -> Vec<f64> {
    let width = of.clone().next().map_or(0, <[f64]>::len);
    (0..width).flat_map(|c| of.clone().map(move |v| v[c])).collect()
}

fn check_blocks(oracle: &Oracle, name: &str) {
    let phi = &oracle.parameters;
    let (n, samples) = (oracle.mechanism.rates(), oracle.states.len());
    let gravity = channels(oracle.states.iter().map(|s| s.gravity.as_slice()));
    let q = channels(oracle.states.iter().map(|s| s.q.as_slice()));
    let dq = channels(oracle.states.iter().map(|s| s.dq.as_slice()));
    let ddq = channels(oracle.states.iter().map(|s| s.ddq.as_slice()));
    let motion = MotionBlock {
        samples,
        stride: samples,
        q: &q,
        dq: &dq,
        ddq: &ddq,
        gravity: Some(&gravity),
        channels: &[],
        sign_width: 0.0,
    };
    let model = RobotModel::new(oracle.mechanism.clone(), vec![]);
    let mut block = RegressorBlock::new(model.layout().clone(), samples);
    model.regressor(&motion, &[], &mut block);
    let dynamics = Dynamics::new(&oracle.mechanism);
    let mut block_effort = vec![0.0; n * samples];
    dynamics.inverse_dynamics_block(&motion, phi, samples, &mut block_effort);

    let mut work = dynamics.workspace();
    for (k, s) in oracle.states.iter().enumerate() {
        let state = State { q: &s.q, dq: &s.dq, ddq: &s.ddq, gravity: Some(Vec3(s.gravity)) };
        let mut y = vec![0.0; n * phi.len()];
        dynamics.regressor(&state, &mut work, &mut y);
        let mut dense = vec![0.0; n * phi.len()];
        for row in 0..n {
            for (c, column) in block.layout().columns(row).iter().enumerate() {
                dense[row * phi.len() + column] = block.column(row, c)[k];
            }
        }
        assert!(relative(&dense, &y) <= 1e-14, "{name} state {k}: {:e}", relative(&dense, &y));
        let mut effort = vec![0.0; n];
        dynamics.inverse_dynamics(&state, phi, &mut work, &mut effort);
        let found: Vec<f64> = (0..n).map(|r| block_effort[r * samples + k]).collect();
        let largest = y
            .chunks_exact(phi.len())
            .flat_map(|row| row.iter().zip(phi).map(|(w, p)| (w * p).abs()))
            .fold(0.0, f64::max);
        for (f, e) in found.iter().zip(&effort) {
            assert!((f - e).abs() <= 1e-14 * largest, "{name} state {k}: {f} {e} of {largest}");
        }
    }
}

fn check_base_parameters(oracle: &Oracle, name: &str) {
    let model = RobotModel::new(oracle.mechanism.clone(), vec![]);
    let base = BaseParameters::of(&model, model.mechanism(), &[], &BaseSettings::default());
    assert_eq!(base.len(), oracle.base_parameters, "{name}: {:?}", base.gap);
    assert!(base.gap.ratio() > 1e6, "{name}: {:?}", base.gap);
    assert_eq!(base.zero, oracle.zero_columns, "{name}");
}

fn check(name: &str, base_parameters: usize) {
    let Some(folder) = shared("data/oracles") else { return };
    let oracle = oracle(&folder, name);
    assert_eq!(oracle.base_parameters, base_parameters);
    check_parameters(&oracle, name);
    check_states(&oracle, name);
    check_blocks(&oracle, name);
    check_base_parameters(&oracle, name);
}

#[test]
fn ur5() {
    check("ur5", 36);
}

#[test]
fn panda() {
    check("panda", 51);
}

#[test]
fn iiwa14() {
    check("iiwa14", 43);
}

#[test]
fn tiago() {
    check("tiago", 58);
}

#[test]
fn solo12_with_a_floating_base() {
    check("solo12_ff", 94);
}

#[test]
fn coupled_fingers_of_the_panda_add_their_efforts() {
    let Some(folder) = shared("data/oracles") else { return };
    let oracle = oracle(&folder, "panda");
    let mut coupled = description(&folder, "panda.urdf", false);
    coupled.couple_mimics = true;
    let coupled = coupled.build().unwrap();
    assert_eq!(coupled.rates(), 8);
    let follows = coupled.follows().unwrap();
    assert_eq!(follows[8], mechanism::Follow { coordinate: 7, ratio: 1.0, offset: 0.0 });
    let phi = &oracle.parameters;
    let (independent, dynamics) = (Dynamics::new(&oracle.mechanism), Dynamics::new(&coupled));
    let (mut work, mut coupled_work) = (independent.workspace(), dynamics.workspace());
    for s in &oracle.states {
        let own = |v: &[f64]| v[..8].to_vec();
        let spread = |v: &[f64], offset: f64| -> Vec<f64> {
            follows.iter().map(|f| f.ratio * v[f.coordinate] + offset * f.offset).collect()
        };
        let (q, dq, ddq) = (own(&s.q), own(&s.dq), own(&s.ddq));
        let (all_q, all_dq, all_ddq) = (spread(&q, 1.0), spread(&dq, 0.0), spread(&ddq, 0.0));
        let gravity = Some(Vec3(s.gravity));
        let mut joint_effort = vec![0.0; 9];
        let state = State { q: &all_q, dq: &all_dq, ddq: &all_ddq, gravity };
        independent.inverse_dynamics(&state, phi, &mut work, &mut joint_effort);
        let mut expected = vec![0.0; 8];
        for (e, f) in joint_effort.iter().zip(follows) {
            expected[f.coordinate] += f.ratio * e;
        }
        let mut effort = vec![0.0; 8];
        let state = State { q: &q, dq: &dq, ddq: &ddq, gravity };
        dynamics.inverse_dynamics(&state, phi, &mut coupled_work, &mut effort);
        assert!(relative(&effort, &expected) <= 1e-14);
    }
}
