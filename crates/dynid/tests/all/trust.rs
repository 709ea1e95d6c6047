//! Verdicts against the truth of a simulated log, and physically consistent parameters on recorded logs.

#![expect(clippy::unwrap_used, clippy::print_stdout, reason = "a test may stop, and says what it measured")]

use crate::support::{self, PANDA, TX40, UR10, data, run};
use dynid::Run;
use dynid::estimators::distribution::t_quantile;
use dynid::estimators::identifiability::Verdict;
use dynid::model::EffortModel;

/// True value of every linear parameter: bodies of `truth.urdf`, elements of `truth.json`.
fn truth(id: &Run, folder: &str) -> Vec<f64> {
    let folder = data().unwrap().join("oracles/logs").join(folder);
    let robot = dynid::Robot::load(&folder.join("truth.urdf"), &dynid::RobotOptions::default()).unwrap();
    let mut values = robot.mechanism.inertia_vector();
    let text = std::fs::read_to_string(folder.join("truth.json")).unwrap();
    let json: serde_json::Value = serde_json::from_str(&text).unwrap();
    let table = id.model.parameters();
    for p in &table.linear[values.len()..] {
        let (joint, symbol) = p.name.rsplit_once('.').unwrap();
        let number = id.model.outputs().iter().position(|o| o.name == joint).unwrap();
        let key = match symbol {
            "fc" => "frictionloss",
            "fv" => "damping",
            "fo" => "offset",
            "Ia" => "armature",
            other => panic!("no truth for {other}"),
        };
        values.push(json[key][number].as_f64().unwrap());
    }
    values
}

/// "Seen in the data" is a promise: the truth lies in the 99 % interval of at least 95 % of these parameters, and nothing is
/// called seen that no motion reveals.
#[test]
fn what_is_called_seen_is_right() {
    let Some((_, id)) = run(r#"
robot = "{data}/oracles/logs/ur5_dev/nominal.urdf"
[[log]]
path = "{data}/oracles/logs/ur5_dev/train.csv.gz"
"#)
    else {
        return;
    };
    let truth = truth(&id, "ur5_dev");
    let table = id.model.parameters();
    let quantile = t_quantile(0.995, id.blocks() as f64 - 1.0).unwrap();
    let (mut seen, mut right) = (0, 0);
    for (c, trust) in id.trust.parameters.iter().enumerate() {
        assert!(trust.assessment.achieved <= trust.assessment.structural_limit + 1e-9);
        if trust.assessment.verdict != Verdict::Seen {
            assert_eq!(trust.std, None, "{}", table.linear[c].name);
            continue;
        }
        assert!(
            !id.base.zero.contains(&c) && trust.assessment.structural_limit >= 0.9,
            "{}",
            table.linear[c].name
        );
        let std = trust.std.unwrap();
        let distance = (trust.unconstrained - truth[c]).abs() / std;
        seen += 1;
        right += usize::from(distance <= quantile);
        if distance > quantile {
            println!(
                "outside: {} {:.5} truth {:.5}, {distance:.1} standard deviations",
                table.linear[c].name, trust.unconstrained, truth[c]
            );
        }
    }
    let beta = id.base.values(&truth);
    let (mut base_seen, mut base_right) = (0, 0);
    for (k, assessment) in id.trust.base.iter().enumerate() {
        if assessment.verdict == Verdict::Seen {
            let std = id.standard_deviations()[k].0.unwrap();
            let distance = (id.fit().x[k] - beta[k]).abs() / std;
            base_seen += 1;
            base_right += usize::from(distance <= quantile);
            if distance > quantile {
                println!(
                    "outside: base {} {distance:.1} standard deviations",
                    table.linear[id.base.kept[k]].name
                );
            }
        }
    }
    println!(
        "standard parameters: {right} of {seen} seen; base parameters: {base_right} of {base_seen} seen"
    );
    assert!(seen >= 40 && right as f64 >= 0.95 * f64::from(seen));
    assert!(base_seen >= 55 && base_right as f64 >= 0.95 * f64::from(base_seen));
}

/// Ratio of the consistent to the unconstrained error on held-out folds and on the validation part.
fn price(name: &str, id: &Run) -> (f64, f64) {
    let held_out = &id.consistent.held_out;
    let folds = held_out.relative(id.consistent.consistent()).unwrap() / held_out.relative(0).unwrap();
    let part = id.validation[0].filtered.relative_error.unwrap()
        / id.validation_unconstrained[0].filtered.relative_error.unwrap();
    let estimate = id.consistent.estimate.as_ref().unwrap();
    println!(
        "{name}: consistent over unconstrained error {folds:.3} on held-out folds, {part:.3} on the last part; gap {:.1e}, {} iterations",
        estimate.gap, estimate.iterations
    );
    (folds, part)
}

#[test]
fn recorded_logs_give_bodies_that_can_exist_at_a_stated_price() {
    for (name, text) in [("panda-gaz2019", PANDA), ("staubli-tx40", TX40), ("ur10-unisa", UR10)] {
        let Some((_, id)) = run(text) else { return };
        assert_eq!(id.unphysical_bodies(), [], "{name}");
        for (c, p) in id.model.parameters().linear.iter().enumerate() {
            assert!(p.lower.is_none_or(|l| id.values()[c] > l), "{name}: {}", p.name);
        }
        let (folds, part) = price(name, &id);
        // The UR10's own fit asks for negative rotor inertias at four joints, and friction does not hide it any more: with friction that gives way
        // its error on folds is 3.9 % without limits and 4.1 % with them, 5.9 and 4.7 % without such friction.
        let (most, most_of_part) = if name == "ur10-unisa" { (1.07, 1.07) } else { (1.02, 1.05) };
        assert!(folds < most && part < most_of_part, "{name}: {folds} {part}");
    }
}

/// Wrist currents of TIAGo are a few milliamperes, coarsely quantised: its README finds R² of 0.06 to 0.43 on joints 5 to 7. The torso,
/// of which it finds 0.38 over all samples, is explained where it moves (0.66, on the test part 0.93): what is left over is friction at rest.
#[test]
fn poor_wrist_currents_are_named_and_nothing_rests_on_them() {
    let locked = [
        "suspension_right_joint",
        "wheel_right_joint",
        "suspension_left_joint",
        "wheel_left_joint",
        "caster_front_right_1_joint",
        "caster_front_right_2_joint",
        "caster_front_left_1_joint",
        "caster_front_left_2_joint",
        "caster_back_right_1_joint",
        "caster_back_right_2_joint",
        "caster_back_left_1_joint",
        "caster_back_left_2_joint",
        "head_1_joint",
        "head_2_joint",
        "gripper_finger_joint",
        "gripper_right_finger_joint",
    ];
    let locked: String = locked.map(|joint| format!("{joint} = 0.0\n")).concat();
    let text = r#"
robot = "{data}/tiago/tiago_48_schunk.urdf"
[locked]
{locked}
[columns]
position = { columns = ["q_torso", "q_arm1", "q_arm2", "q_arm3", "q_arm4", "q_arm5", "q_arm6", "q_arm7"] }
[columns.effort]
columns = ["effort_torso", "effort_arm1", "effort_arm2", "effort_arm3", "effort_arm4", "effort_arm5", "effort_arm6", "effort_arm7"]
unit = "A"
scale = [1, 13.6, 13.6, -8.7, -8.7, -20.5968, -20.5968, -20.5968]
[[log]]
path = "{data}/tiago/dynamic_trajectory.csv.gz"
part = [0.0, 0.7]
[[validation]]
path = "{data}/tiago/dynamic_trajectory.csv.gz"
part = [0.7, 1.0]
"#;
    let Some((_, id)) = run(&text.replace("{locked}", &locked)) else { return };
    let names: Vec<&str> = id.model.outputs().iter().map(|o| o.name.as_str()).collect();
    for joint in ["arm_5_joint", "arm_6_joint", "arm_7_joint"] {
        assert!(!id.explained[names.iter().position(|n| *n == joint).unwrap()], "{joint}");
    }
    let table = id.model.parameters();
    for (p, trust) in table.linear.iter().zip(&id.trust.parameters) {
        let own = ["arm_5_joint.", "arm_6_joint.", "arm_7_joint."].iter().any(|j| p.name.starts_with(j));
        assert!(!own || trust.assessment.verdict != Verdict::Seen, "{}", p.name);
    }
    let seen = id.trust.base.iter().filter(|a| a.verdict == Verdict::Seen).count();
    println!("{seen} of {} base parameters seen", id.base.len());
    let verdict = dynid::verdict::judge(&id);
    let check =
        verdict.checks.iter().find(|c| c.name.word() == "joints that the model does not explain").unwrap();
    assert!(check.status.word() == "warn" && check.meaning.contains("arm_7_joint"), "{}", check.meaning);
    assert_eq!(id.unphysical_bodies(), []);
}

/// A row of the published tables: name, penalty-based set, set by linear matrix inequalities.
fn published(folder: &std::path::Path) -> Vec<(String, [f64; 2])> {
    let text = std::fs::read_to_string(folder.join("published_feasible_parameters.csv")).unwrap();
    let number = |field: &str| field.parse().unwrap_or(0.0);
    text.lines()
        .skip(1)
        .map(|line| {
            let fields: Vec<&str> = line.split(',').collect();
            (fields[0].to_owned(), [number(fields[1]), number(fields[2])])
        })
        .collect()
}

/// Effort predicted by the two published sets of link parameters with the published friction, filtered like ours and on the
/// same part of the record, against the consistent estimate's.
#[test]
fn panda_beats_both_published_parameter_sets() {
    use dynid::model::{Inertia, Mat3, RobotModel, Vec3};
    const FRICTION: [[f64; 7]; 3] = [
        [0.54615, 0.87224, 0.64068, 1.2794, 0.83904, 0.30301, 0.56489],
        [5.1181, 9.0657, 10.136, 5.5903, 8.3469, 17.133, 10.336],
        [0.039533, 0.025882, -0.04607, 0.036194, 0.026226, -0.021047, 0.0035526],
    ];
    let Some((config, id)) = run(PANDA) else { return };
    let ours = support::on_validation(&config, &id, 5.0);
    let table = published(&data().unwrap().join("panda-gaz2019"));
    let rigid = RobotModel::new(id.robot.mechanism.clone(), Vec::new());
    for (set, name) in [(0, "penalty-based"), (1, "linear matrix inequalities")] {
        let get = |key: String| table.iter().find(|(n, _)| *n == key).map_or(0.0, |(_, v)| v[set]);
        let values: Vec<f64> = (1..=7)
            .flat_map(|i| {
                let entry = |a: &str| get(format!("I{i}{a}"));
                let tensor = Mat3::from_rows([
                    [entry("xx"), entry("xy"), entry("xz")],
                    [entry("xy"), entry("yy"), entry("yz")],
                    [entry("xz"), entry("yz"), entry("zz")],
                ]);
                let com = ["x", "y", "z"].map(|a| get(format!("c{i}{a}")));
                Inertia::from_com(get(format!("m{i}")), Vec3(com), &tensor).0
            })
            .collect();
        let log = &config.validation[0];
        let loaded = dynid::logs::load(log, &id.robot.axes, &config.columns, None).unwrap();
        let mut prepared =
            dynid::estimators::conditioning::prepare(&loaded.log, &rigid, &id.conditioning_settings).unwrap();
        let filter = dynid::motion::filter::butterworth(4, 5.0, prepared.rate_hz).unwrap();
        for (j, effort) in prepared.effort.iter_mut().enumerate() {
            let [a, b, c] = FRICTION.map(|row| row[j]);
            let q = dynid::motion::filter::forward_backward(&filter, &prepared.position[j]).unwrap();
            let sigmoid = |v: f64| a / (1.0 + (-b * (v + c)).exp()) - a / (1.0 + (-b * c).exp());
            for (s, e) in std::sync::Arc::make_mut(effort).iter_mut().enumerate() {
                let (before, after) = (s.saturating_sub(1), (s + 1).min(q.len() - 1));
                let speed = (q[after] - q[before]) * prepared.rate_hz / (after - before) as f64;
                *e -= sigmoid(speed);
            }
        }
        let alignment = dynid::agreement::Alignment {
            state_hz: id.state_hz,
            delay_samples: 0.0,
            delay_rate_hz: id.delay_rate_hz,
            filter_hz: 5.0,
        };
        let theirs =
            dynid::agreement::compare(&rigid, &values, &prepared, &alignment, &id.conditioning_settings)
                .unwrap();
        let (a, b) = (support::rms(&ours.filtered), support::rms(&theirs.filtered));
        println!("{name}: ours {a:.3?}, theirs {b:.3?}");
        assert!(a.iter().zip(&b).all(|(ours, theirs)| ours < theirs), "{name}");
    }
}
