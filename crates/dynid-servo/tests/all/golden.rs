//! Rollouts and sensitivities against prototypes written elsewhere.

use dynid_model::{
    Description, Inertia, JointDescription, JointKind, LinkDescription, Mat3, Mechanism, Placement, Vec3,
};
use dynid_servo::fit::{Block, Ending, GaussNewton, ServoProblem, deviations, fit};
use dynid_servo::start::{StartSettings, linear_start};
use dynid_servo::{
    Chain, Channel, Free, Hold, LoadOf, Rollout, Scheme, ServoJoint, ServoLog, ServoValues, Term,
};
use dynid_testing::golden;
use serde_json::Value;

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect()
}

fn rows(value: &Value) -> Vec<Vec<f64>> {
    value.as_array().unwrap().iter().map(numbers).collect()
}

fn columns(rows: &[Vec<f64>]) -> Vec<Vec<f64>> {
    (0..rows[0].len()).map(|j| rows.iter().map(|r| r[j]).collect()).collect()
}

/// The planar arm of the golden files.
fn arm(golden: &Value) -> Mechanism {
    let model = &golden["model"];
    let mut robot = Description::new("arm2");
    robot.gravity = [0.0, 0.0, -9.81];
    robot.links.push(LinkDescription { name: "base".into(), inertia: None });
    for i in 0..2 {
        let matrix = |v: &Value| {
            let r = rows(v);
            Mat3::from_rows([
                [r[0][0], r[0][1], r[0][2]],
                [r[1][0], r[1][1], r[1][2]],
                [r[2][0], r[2][1], r[2][2]],
            ])
        };
        let (p, c) = (numbers(&model["p"][i]), numbers(&model["centre"][i]));
        let mass = model["mass"][i].as_f64().unwrap();
        let tensor = matrix(&model["inertia"][i]);
        let name = format!("link{}", i + 1);
        let parent = if i == 0 { "base".to_owned() } else { "link1".to_owned() };
        robot.links.push(LinkDescription {
            name: name.clone(),
            inertia: Some(Inertia::from_com(mass, Vec3([c[0], c[1], c[2]]), &tensor)),
        });
        robot.joints.push(JointDescription {
            name: format!("joint{}", i + 1),
            parent,
            child: name,
            kind: JointKind::Revolute,
            placement: Placement { rotation: matrix(&model["R"][i]), translation: Vec3([p[0], p[1], p[2]]) },
            axis: [0.0, 0.0, 1.0],
            limits: Default::default(),
            mimic: None,
        });
    }
    robot.build().unwrap()
}

const NAMES: [(&str, Term); 15] = [
    ("armature", Term::RotorInertia),
    ("viscous", Term::Viscous),
    ("coulomb", Term::Coulomb),
    ("kp", Term::PositionGain),
    ("kd", Term::VelocityGain),
    ("delay", Term::Delay),
    ("zero", Term::Zero),
    ("stribeck_extra", Term::Stiction),
    ("stribeck_speed", Term::StribeckVelocity),
    ("load_friction", Term::LoadFriction),
    ("torque_limit", Term::EffortLimit),
    ("deadband", Term::DeadBand),
    ("rate_limit", Term::RateLimit),
    ("torque_offset", Term::Offset),
    ("smoothing_time", Term::SmoothingTime),
];

fn values(golden: &Value, mechanism: &Mechanism) -> ServoValues {
    let joints = (0..2)
        .map(|j| {
            let mut joint = ServoJoint::default();
            for (name, term) in NAMES {
                if let Some(of) = golden["parameters"].get(name) {
                    joint.set(term, of[j].as_f64().unwrap());
                }
            }
            joint
        })
        .collect();
    ServoValues { joints, inertias: mechanism.inertia_vector() }
}

/// The log of the rollout file: commands as they are, readings from the state it begins in.
fn log(golden: &Value) -> ServoLog {
    let command = columns(&rows(&golden["command"]));
    let ts = golden["Ts"].as_f64().unwrap();
    let time = (0..command[0].len()).map(|k| k as f64 * ts).collect();
    let start = numbers(&golden["x0"]);
    let mut log = ServoLog::new("golden", time, command.clone(), command);
    log.start = Some(start);
    log
}

#[test]
fn rollout_and_sensitivities_are_those_of_the_prototype() {
    let (Some(golden), Some(slopes)) =
        (golden("servo_arm2_rollout.json"), golden("servo_arm2_sensitivity.json"))
    else {
        return;
    };
    let mechanism = arm(&golden);
    let values = values(&golden, &mechanism);
    let log = log(&golden);
    let chains = Chain::all(&mechanism);
    let scheme = Scheme {
        middle: false,
        step_s: golden["Ts"].as_f64().unwrap() / golden["substeps"].as_f64().unwrap(),
        sign_width: golden["w"].as_f64().unwrap(),
        load: LoadOf::Bodies,
        hold: Hold::Held,
        ..Scheme::default()
    };
    let free: Vec<Free> = NAMES.iter().flat_map(|(_, term)| (0..2).map(|j| Free::term(*term, [j]))).collect();
    let rollout = Rollout::new(&chains[0], scheme, &free);
    let at: Vec<usize> = numbers(&golden["sample_index"]).iter().map(|k| *k as usize).collect();
    let (q, v) = (rows(&golden["q"]), rows(&golden["v"]));
    let (mut worst_q, mut worst_v) = (0.0_f64, 0.0_f64);
    let mut found = vec![Vec::new(); free.len()];
    rollout
        .run(&values, &log, |row| {
            let Some(k) = at.iter().position(|i| *i == row.row) else { return };
            for j in 0..2 {
                // What the file calls q is the encoder's reading.
                let position = row.reading[j];
                worst_q = worst_q.max((position - q[k][j]).abs());
                worst_v = worst_v.max((row.velocity[j] - v[k][j]).abs());
            }
            for (c, found) in found.iter_mut().enumerate() {
                found.push([row.by_parameter[c], row.by_parameter[free.len() + c]]);
            }
        })
        .unwrap();
    for (c, (name, j)) in NAMES.iter().flat_map(|(n, _)| (1..3).map(move |j| (n, j))).enumerate() {
        let wanted = rows(&slopes["sensitivity"][format!("{name}_{j}")]["x"]);
        let largest = wanted.iter().flatten().fold(0.0_f64, |m, x| m.max(x.abs()));
        let worst = wanted
            .iter()
            .zip(&found[c])
            .flat_map(|(w, f)| w.iter().zip(f))
            .fold(0.0_f64, |m, (w, f)| m.max((w - f).abs()));
        let kinked = ["kp_1", "kd_1", "torque_limit_1", "rate_limit_1"];
        let within = if kinked.contains(&format!("{name}_{j}").as_str()) { 5e-3 } else { 1e-5 };
        assert!(worst <= within * largest, "{name}_{j}");
    }
    assert!(worst_q <= 1e-8 && worst_v <= 1e-6, "{worst_q:e} {worst_v:e}");
}

#[test]
fn fit_is_that_of_the_prototype() {
    let (Some(golden), Some(model)) = (golden("servo_arm2_fit.json"), golden("servo_arm2_rollout.json"))
    else {
        return;
    };
    let mechanism = arm(&model);
    let command = columns(&rows(&golden["command"]));
    let step = std::f64::consts::TAU / golden["counts_per_turn"].as_f64().unwrap();
    let position: Vec<Vec<f64>> = columns(&rows(&golden["counts"]))
        .iter()
        .map(|counts| counts.iter().map(|c| c * step).collect())
        .collect();
    let ts = golden["Ts"].as_f64().unwrap();
    let time = (0..command[0].len()).map(|k| k as f64 * ts).collect();
    let mut log = ServoLog::new("golden", time, command.clone(), position);
    log.start = Some(command.iter().map(|c| c[0]).collect());
    let scheme = Scheme {
        step_s: ts / 4.0,
        sign_width: 0.01,
        middle: false,
        load: LoadOf::Bodies,
        hold: Hold::Held,
        ..Scheme::default()
    };
    let names = [
        "kp_1",
        "kp_2",
        "viscous_1",
        "viscous_2",
        "armature_1",
        "armature_2",
        "coulomb_1",
        "coulomb_2",
        "zero_1",
        "zero_2",
        "delay",
    ];
    let mut free = Vec::new();
    for term in [Term::PositionGain, Term::Viscous, Term::RotorInertia, Term::Coulomb, Term::Zero] {
        free.extend((0..2).map(|j| Free::term(term, [j])));
    }
    free.push(Free::term(Term::Delay, 0..2));
    // Some way off the truth.
    let joint = |kp: f64, kd: f64| {
        ServoJoint::default()
            .with(Term::PositionGain, kp)
            .with(Term::VelocityGain, kd)
            .with(Term::Viscous, 0.5)
            .with(Term::RotorInertia, 0.02)
            .with(Term::Coulomb, 0.1)
            .with(Term::Delay, 0.004)
    };
    let known = |kd| ServoJoint::default().with(Term::VelocityGain, kd);
    let linear = ServoValues { joints: vec![known(1.5), known(1.0)], inertias: mechanism.inertia_vector() };
    let chains = Chain::all(&mechanism);
    let logs = [log];
    let mut asked: Vec<Free> = free.iter().filter(|f| f.as_term() != Some(Term::Zero)).cloned().collect();
    asked.extend((0..2).map(|j| Free::term(Term::Offset, [j])));
    let found = linear_start(&chains, &logs, &linear, &asked, scheme, &StartSettings::default()).unwrap();
    // Other filters than the prototype's.
    for j in 0..2 {
        let of = numbers(&golden["linear_start"]["control_error_on_the_left"][j]);
        let gain = found.values.joints[j].get(Term::PositionGain);
        assert!((gain / of[0] - 1.0).abs() < 0.02, "{gain} {of:?}");
    }
    let delay = found.values.joints[0].get(Term::Delay);
    assert!((delay - golden["linear_start"]["delay"].as_f64().unwrap()).abs() < 3e-4, "{delay}");
    let start = ServoValues {
        joints: vec![joint(22.0, 1.5), joint(26.0, 1.0)],
        inertias: mechanism.inertia_vector(),
    };
    // Blocks of a quarter of a second, as the prototype cut them.
    let rows = logs[0].rows();
    let blocks: Vec<Block> =
        (0..24).map(|b| Block { log: 0, rows: b * rows / 24..(b + 1) * rows / 24 }).collect();
    let problem = ServoProblem {
        chains: &chains,
        logs: &logs,
        scheme,
        free: &free,
        channels: &[Channel::Position],
        blocks: &blocks,
    };
    let fitted = fit(&problem, &start, &GaussNewton::default(), &|_| true).unwrap();
    let found = deviations(&problem, &fitted);
    assert_eq!(fitted.ending, Ending::Converged);
    for (k, name) in names.iter().enumerate() {
        let number = |of: &str| golden[of][name].as_f64().unwrap();
        let off = (fitted.estimate[k] - number("estimate")) / number("sd_model");
        assert!(off.abs() < 0.05, "{name}: {off} standard deviations");
        // Ours weighs joints by their residuals, the prototype alike.
        let model = found.model[k].unwrap() / number("sd_model");
        assert!((model - 1.0).abs() < 0.01, "{name}: {model}");
        let jackknife = found.jackknife[k].unwrap() / number("sd_block_jackknife_24");
        assert!((jackknife - 1.0).abs() < 0.02, "{name}: {jackknife}");
    }
    let squares = fitted.evaluation.mean_squares(&|_| true);
    let rms = ((squares[0] + squares[1]) / 2.0).sqrt();
    assert!((rms / golden["rms_rad"].as_f64().unwrap() - 1.0).abs() < 1e-5, "{rms}");
}
