//! Friction that follows reactions, from robot files: simulated, identified, predicted, read again, refused.

#![expect(clippy::unwrap_used, clippy::print_stdout, reason = "a test may stop, and says what it measured")]

use std::path::Path;

use dynid::estimate::Split;
use dynid::model::{EffortModel, MotionBlock};
use dynid::online::Session;
use dynid::simulate::{SimulateSettings, simulate};
use dynid::{Config, Robot, RobotOptions, Run, identify};

use tempfile::TempDir;

use crate::support::write_log;

/// A carriage on a guideway, driven along it, with an arm of two joints: the force on the guideway and the moment about it change.
/// Friction of the first joint of the arm follows the forces across its axis.
const GANTRY: &str = r#"
name = "gantry"
body = [
  { name = "carriage", parent = "ground", joint = { kind = "prismatic", axis = [1, 0, 0], limits = { position = [-0.6, 0.6], velocity = 1, effort = 900 } }, mass = 9, com = [0, 0, 0.02], inertia_com = [0.06, 0, 0, 0.07, 0, 0.08] },
  { name = "upper", parent = "carriage", joint = { xyz = [0, 0, 0.1], axis = [0, 1, 0], limits = { position = [-2.5, 2.5], velocity = 3, effort = 300 } }, mass = 6, com = [0.02, 0.01, 0.3], inertia_com = [0.2, 0, 0, 0.2, 0, 0.02] },
  { name = "fore", parent = "upper", joint = { xyz = [0, 0, 0.6], axis = [0, 1, 0], limits = { position = [-2.5, 2.5], velocity = 4, effort = 100 } }, mass = 4, com = [0.01, 0, 0.25], inertia_com = [0.1, 0, 0, 0.1, 0, 0.01] },
]
[element.carriage]
elements = ["viscous", "reaction_friction"]
viscous = { coefficient = 30 }
reaction_friction = { loads = [{ force = "radial" }, { moment = ["y", "z"], arm = 0.15 }], preload = 20, mu_c = 0.12 }
[element.upper]
elements = ["viscous", "reaction_friction", "rotor"]
viscous = { coefficient = 1 }
rotor = { inertia = 0.3 }
reaction_friction = { loads = [{ force = "radial", radius = 0.03 }], mu_c = 0.2, mu_v = 0.02 }
[element.fore]
elements = ["viscous", "coulomb"]
"#;

/// A log of a minute whose motion is known well.
fn settings(effort_noise: f64) -> SimulateSettings {
    SimulateSettings {
        duration_s: 60.0,
        rate_hz: 250.0,
        effort_noise,
        encoder_bits: 20,
        delay_samples: Some(0.0),
        ..SimulateSettings::default()
    }
}

struct Bench {
    folder: TempDir,
    truth: Vec<(String, f64)>,
    /// Noise of the efforts of the held-out log.
    noise: Vec<f64>,
    /// Its true motion and efforts.
    clean: [Vec<Vec<f64>>; 4],
}

fn rms(x: &[f64]) -> f64 {
    (x.iter().map(|x| x * x).sum::<f64>() / x.len() as f64).sqrt()
}

impl Bench {
    /// A log to learn from and another one.
    fn new(test: &str, robot: &str, settings: &SimulateSettings) -> Self {
        let kept = tempfile::Builder::new().prefix(&format!("dynid-loads-{test}-")).tempdir().unwrap();
        let folder = kept.path();
        std::fs::write(folder.join("robot.toml"), robot).unwrap();
        let robot = Robot::load(&folder.join("robot.toml"), &RobotOptions::default()).unwrap();
        let log = |seed| simulate(&robot, &SimulateSettings { seed, ..settings.clone() }).unwrap();
        let (train, held) = (log(1), log(2));
        write_log(&train, &folder.join("train.csv"));
        write_log(&held, &folder.join("held.csv"));
        let noise = held.clean[3].iter().map(|e| settings.effort_noise * rms(e)).collect();
        Bench { folder: kept, truth: train.truth, noise, clean: held.clean }
    }

    /// A run with more keys of its own and of the log to learn from.
    fn config(&self, more: &str, of_log: &str) -> Config {
        let text = format!(
            "robot = {:?}\n{more}\n[[log]]\npath = {:?}\n{of_log}\n[[validation]]\npath = {:?}\n",
            self.folder.path().join("robot.toml"),
            self.folder.path().join("train.csv"),
            self.folder.path().join("held.csv"),
        );
        Config::parse(&text, &self.folder.path().join("run.toml").display().to_string()).unwrap()
    }

    fn identify(&self, more: &str) -> Run {
        identify(&self.config(more, ""), &mut |_| ()).unwrap()
    }

    /// Error of what the model says along the true motion of the log that was held out, with the noise of its efforts, over that noise.
    fn against_noise(&self, id: &Run) -> Vec<f64> {
        let [q, dq, ddq, clean] = &self.clean;
        let (model, linear) = id.identified_model();
        let n = q[0].len();
        let [q, dq, ddq] = [q, dq, ddq].map(|signal| signal.concat());
        let mut effort = vec![0.0; clean.len() * n];
        let motion = MotionBlock::plain(n, &q, &dq, &ddq);
        model.efforts(&motion, &model.parameters().shape_start(), linear, n, &mut effort);
        let of = |(k, clean): (usize, &Vec<f64>)| {
            let off: Vec<f64> = effort[k * n..][..n].iter().zip(clean).map(|(a, b)| a - b).collect();
            (1.0 + (rms(&off) / self.noise[k]).powi(2)).sqrt()
        };
        clean.iter().enumerate().map(of).collect()
    }

    fn truth(&self, name: &str) -> f64 {
        self.truth.iter().find(|(n, _)| n == name).unwrap().1
    }

    /// Estimates of some parameters with their deviations from the truth, in standard deviations.
    fn check(&self, id: &Run, names: &[&str]) {
        let estimate = id.estimate();
        for name in names {
            let found = estimate.parameters.iter().find(|p| p.name == *name).unwrap();
            let (truth, std) = (self.truth(name), found.std.unwrap());
            println!("{name}: {} ± {std:.1e}, truth {truth}", found.value);
            assert!((found.value - truth).abs() < 3.0 * std, "{name}");
            assert!(std < 0.2 * truth.abs(), "{name}: {std}");
        }
    }
}

/// What is written predicts as what was identified.
fn predicts_when_read_again(id: &Run) {
    let estimate =
        dynid::estimate::Estimate::parse(id.estimate().to_json().as_bytes(), "estimate.json").unwrap();
    let read = estimate.effort_model(Path::new("estimate.json"), Split::Consistent).unwrap();
    let (model, linear) = id.identified_model();
    let efforts = |model: &dyn EffortModel, linear: &[f64], motion: &MotionBlock<'_>| {
        let mut out = vec![0.0; model.outputs().len() * motion.samples];
        model.efforts(motion, &model.parameters().shape_start(), linear, motion.samples, &mut out);
        out
    };
    model.random_motion(100, 5).with_block(|motion| {
        let ours = efforts(model, linear, motion);
        let theirs = efforts(&read, &estimate.values(Split::Consistent), motion);
        let size = ours.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
        for (a, b) in ours.iter().zip(&theirs) {
            assert!((a - b).abs() <= 1e-9 * size, "{a} {b}");
        }
    });
}

#[test]
fn guideway_and_journal_of_an_open_tree() {
    let bench = Bench::new("gantry", GANTRY, &settings(0.01));
    let id = bench.identify("");
    let rounds = id.loads.unwrap();
    println!("{rounds:?}");
    assert!(rounds.change <= 1e-6, "{rounds:?}");
    let (ours, plain) = (
        bench.against_noise(&id),
        bench.against_noise(
            &bench.identify("[elements.joint]\ncarriage = [\"viscous\", \"coulomb\"]\nupper = [\"viscous\", \"coulomb\", \"rotor\"]"),
        ),
    );
    println!("errors over noise: {ours:.2?}, with friction that no load changes {plain:.2?}");
    assert!(ours.iter().all(|r| *r < 1.2), "{ours:?}");
    assert!(plain[0] > 3.0, "{plain:?}");
    bench.check(&id, &["carriage.mu_c", "carriage.fv"]);
    predicts_when_read_again(&id);
}

/// Slow enough for some samples at speeds like that of the Stribeck effect.
#[test]
fn sliders_of_a_parallel_machine() {
    of_sliders("prr3", 0.5);
}

/// Fast motion has few such samples: each slider by itself has static coefficient and Stribeck speed on a ridge, which a tie
/// of the sliders, which are of one make, does away with.
#[test]
#[ignore = "a quarter of a minute; the ordinary run takes the slow machine"]
fn sliders_of_a_fast_parallel_machine() {
    of_sliders("prr3-fast", SimulateSettings::default().acceleration);
}

fn of_sliders(test: &str, acceleration: f64) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/prr3/robot.toml");
    let settings = SimulateSettings { acceleration, ..settings(0.005) };
    let bench = Bench::new(test, &std::fs::read_to_string(path).unwrap(), &settings);
    // Sliders are of one make.
    let id =
        bench.identify("tie = [[\"slider1\", \"slider2\", \"slider3\"]]\n[elements]\nfriction = \"given\"");
    println!("{:?}", id.loads.unwrap());
    assert!(id.loads.unwrap().change <= 1e-6);
    let ours = bench.against_noise(&id);
    let plain = bench.against_noise(&bench.identify("[elements]\nfriction = \"given\"\ndefault = [\"stribeck\", \"viscous\"]\n[elements.joint]\nslider1 = [\"stribeck\", \"viscous\"]\nslider2 = [\"stribeck\", \"viscous\"]\nslider3 = [\"stribeck\", \"viscous\"]"));
    println!("errors over noise: {ours:.2?}, with friction that no load changes {plain:.2?}");
    assert!(ours.iter().all(|r| *r < 1.2), "{ours:?}");
    assert!(plain.iter().all(|r| *r > 3.0), "{plain:?}");
    bench.check(
        &id,
        &["slider1.mu_c", "slider2.mu_c", "slider3.mu_c", "slider1.fv", "slider2.fv", "slider3.fv"],
    );
    predicts_when_read_again(&id);
}

/// A scissor lift that carries a load: the lower foot is driven, each pin and both feet rub by what presses on them.
/// Two pins are cut: that of the two bars, and that of bar and upper foot. Home: bars at 45 degrees.
const LIFT: &str = r#"
name = "lift"
gravity = [0, -9.81, 0]
actuated = ["foot"]
loop = [
  { name = "middle", kind = "planar_revolute", a = "bar1", b = "bar2", a_xyz = [0.4, 0, 0], b_xyz = [0.4, 0, 0] },
  { name = "top", kind = "planar_revolute", a = "bar2", b = "upper_foot", a_xyz = [0.8, 0, 0] },
]
body = [
  { name = "foot", parent = "ground", joint = { kind = "prismatic", axis = [1, 0, 0], limits = { position = [0.35, 0.72], velocity = 0.4, effort = 3000 } }, mass = 4, com = [0, 0, 0], inertia_com = [0.02, 0, 0, 0.02, 0, 0.02] },
  { name = "bar1", parent = "foot", joint = { axis = [0, 0, 1] }, mass = 6, com = [0.4, 0, 0], inertia_com = [0.01, 0, 0, 0.32, 0, 0.32] },
  { name = "table", parent = "bar1", joint = { xyz = [0.8, 0, 0], axis = [0, 0, 1] }, mass = 30, com = [0.3, 0.1, 0], inertia_com = [0.5, 0, 0, 1, 0, 1] },
  { name = "upper_foot", parent = "table", joint = { kind = "prismatic", axis = [1, 0, 0] }, mass = 2, com = [0, 0, 0], inertia_com = [0.01, 0, 0, 0.01, 0, 0.01] },
  { name = "bar2", parent = "ground", joint = { axis = [0, 0, 1] }, mass = 6, com = [0.4, 0, 0], inertia_com = [0.01, 0, 0, 0.32, 0, 0.32] },
]
[home]
foot = 0.5656854249492381
bar1 = 2.356194490192345
table = -2.356194490192345
upper_foot = 0.5656854249492381
bar2 = 0.7853981633974483
[element.foot]
elements = ["viscous", "reaction_friction"]
viscous = { coefficient = 200 }
reaction_friction = { loads = [{ force = ["y"] }], mu_c = 0.15 }
[element.upper_foot]
elements = ["reaction_friction"]
reaction_friction = { loads = [{ force = ["y"] }], mu_c = 0.15 }
[element.bar1]
elements = ["reaction_friction"]
reaction_friction = { loads = [{ force = "radial", radius = 0.02 }], mu_c = 0.2 }
[element.bar2]
elements = ["reaction_friction"]
reaction_friction = { loads = [{ force = "radial", radius = 0.02 }], mu_c = 0.2 }
[element.table]
elements = ["reaction_friction"]
reaction_friction = { loads = [{ force = "radial", radius = 0.02 }], mu_c = 0.2 }
"#;

/// One motion moves five joints: the feet are of one make, and so are the pins. What rubs at which of them stays a guess, what all of
/// them do to the drive does not.
#[test]
fn feet_and_pins_of_a_scissor_lift() {
    let bench = Bench::new("lift", LIFT, &settings(0.005));
    let id = bench.identify("tie = [[\"foot.mu_c\", \"upper_foot.mu_c\"], [\"bar1.mu_c\", \"bar2.mu_c\", \"table.mu_c\"]]\n[elements]\nfriction = \"given\"");
    println!("{:?}", id.loads.unwrap());
    assert!(id.loads.unwrap().change <= 1e-6);
    let ours = bench.against_noise(&id);
    let joints = ["foot", "upper_foot", "bar1", "bar2", "table"];
    let plain: String = joints.map(|j| format!("{j} = [\"coulomb\", \"viscous\"]\n")).concat();
    let plain = bench.against_noise(&bench.identify(&format!("[elements.joint]\n{plain}")));
    println!("errors over noise: {ours:.2?}, with friction that no load changes {plain:.2?}");
    assert!(ours.iter().all(|r| *r < 1.2), "{ours:?}");
    assert!(plain.iter().all(|r| *r > 3.0), "{plain:?}");
    bench.check(&id, &["foot.fv"]);
    predicts_when_read_again(&id);
}

/// Friction of the bearings of the arms, and of the universal joints at the elbows, which nothing drives.
#[test]
#[ignore = "a quarter of a minute; the ordinary run takes sliders, feet and pins"]
fn bearings_and_universal_joints_of_a_delta() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../robots/delta.toml");
    let mut robot = std::fs::read_to_string(path).unwrap();
    for k in 1..=3 {
        robot += &format!(
            "[element.arm{k}]\nelements = [\"viscous\", \"reaction_friction\", \"rotor\"]\nviscous = {{ coefficient = 0.05 }}\n\
             rotor = {{ inertia = 0.01 }}\nreaction_friction = {{ loads = [{{ force = \"radial\", radius = 0.02 }}], mu_c = 0.3 }}\n\
             [element.cross{k}]\nelements = [\"reaction_friction\"]\n\
             reaction_friction = {{ loads = [{{ force = \"radial\", radius = 0.015 }}], mu_c = 0.2 }}\n"
        );
    }
    let bench = Bench::new("delta", &robot, &settings(0.005));
    let id = bench.identify(
        "tie = [[\"cross1.mu_c\", \"cross2.mu_c\", \"cross3.mu_c\"]]\n[elements]\nfriction = \"given\"",
    );
    println!("{:?}", id.loads.unwrap());
    assert!(id.loads.unwrap().change <= 1e-6);
    let ours = bench.against_noise(&id);
    let plain: String = (1..=3)
        .map(|k| {
            format!("arm{k} = [\"coulomb\", \"viscous\", \"rotor\"]\ncross{k} = [\"coulomb\", \"viscous\"]\n")
        })
        .collect();
    let plain = bench.against_noise(&bench.identify(&format!("[elements.joint]\n{plain}")));
    println!("errors over noise: {ours:.2?}, with friction that no load changes {plain:.2?}");
    assert!(ours.iter().all(|r| *r < 1.2), "{ours:?}");
    assert!(plain.iter().all(|r| *r > 3.0), "{plain:?}");
    bench.check(&id, &["arm1.mu_c", "arm2.mu_c", "arm3.mu_c"]);
    predicts_when_read_again(&id);
}

#[test]
fn what_presses_on_no_joint_is_refused() {
    let parse = |from: &str, to: &str| {
        assert!(GANTRY.contains(from), "{from}");
        let robot =
            Robot::parse(&GANTRY.replacen(from, to, 1), Path::new("robot.toml"), &RobotOptions::default());
        let fault =
            robot.map(|robot| simulate(&robot, &SimulateSettings::default()).err().map(|e| e.to_string()));
        fault.map_or_else(|e| e.to_string(), |late| late.unwrap_or_else(|| "accepted".to_owned()))
    };
    let loads = "loads = [{ force = \"radial\" }, { moment = [\"y\", \"z\"], arm = 0.15 }], preload = 20, mu_c = 0.12";
    for (from, to, expected) in [
        (loads, "mu_c = 0.12", "`loads`, `weight` or `preload`"),
        (loads, "loads = [{ force = \"across\" }]", "`\"axial\"` or `\"radial\"`"),
        (loads, "loads = [{ force = [\"x\", \"x\"] }]", "each once"),
        (loads, "loads = [{ force = [\"x\"], arm = 0.1 }]", "`radius` beside `force`"),
        (loads, "loads = [{ force = [\"x\"], joint = \"elbow\" }]", "a joint of the robot"),
        (loads, "loads = [{ force = [\"x\"], radius = 0 }]", "a length above 0"),
        (loads, "loads = [{ moment = [\"x\"], axis = 1 }]", "`joint`, `force`"),
        (loads, "weight = { wrist = 1 }", "a link of the robot"),
        (loads, "preload = -1", "not negative"),
        (loads, "preload = 1, stribeck = false, vs = 0.1", "no such value"),
        (loads, "preload = 1, mu = 0.1", "expected one of"),
        (
            "axis = [0, 1, 0], limits = { position = [-2.5, 2.5], velocity = 3",
            "axis = [0, 0.6, 0.8], limits = { position = [-2.5, 2.5], velocity = 3",
            "components by name",
        ),
        (
            "reaction_friction = { loads = [{ force = \"radial\", radius = 0.03 }], mu_c = 0.2, mu_v = 0.02 }",
            "",
            "what presses on the joint",
        ),
    ] {
        let found = parse(from, to);
        assert!(found.contains(expected), "{to}: expected {expected}, found {found}");
    }
}

/// What takes the loads of the robot file, or knows nothing of what else presses, would answer wrongly.
#[test]
fn work_that_knows_no_loads_is_refused() {
    let robot = GANTRY.replace("preload = 20", "preload = 20, weight = { upper = 1 }");
    let weightless = format!("gravity = [0, 0, 0]\n{robot}");
    let robot = Robot::parse(&weightless, Path::new("robot.toml"), &RobotOptions::default()).unwrap();
    let refused = simulate(&robot, &SimulateSettings::default()).unwrap_err().to_string();
    assert!(refused.contains("no gravity"), "{refused}");
    let settings = SimulateSettings { duration_s: 10.0, rate_hz: 100.0, ..SimulateSettings::default() };
    let bench = Bench::new("refused", GANTRY, &settings);
    for (more, of_log, expected) in [
        ("[[payload]]\nname = \"tool\"", "payload = \"tool\"", "payloads of logs"),
        (
            "",
            &format!(
                "own = [\"friction_scale\"]\n[[log]]\npath = {:?}",
                bench.folder.path().join("held.csv")
            ),
            "beside `reaction_friction`",
        ),
    ] {
        let refused = identify(&bench.config(more, of_log), &mut |_| ()).unwrap_err().to_string();
        assert!(refused.contains(expected), "{of_log}: {refused}");
    }
    let columns =
        ["t", "q_carriage", "q_upper", "q_fore", "tau_carriage", "tau_upper", "tau_fore"].map(str::to_owned);
    let refused = Session::new(&bench.config("", ""), "log", &columns[..], None).unwrap_err().to_string();
    assert!(refused.contains("not followed on line"), "{refused}");
}

#[test]
fn friction_that_is_stated_and_not_listed_is_told() {
    let text = "schema = 1\nname = \"axis\"\n[[body]]\nname = \"table\"\nparent = \"ground\"\n\
        joint = { kind = \"prismatic\", name = \"slide\", axis = [1, 0, 0] }\nphi = [3, 0, 0, 0, 0.1, 0, 0, 0.1, 0, 0.1]\n";
    let friction = "[element.slide]\nreaction_friction = { loads = [{ force = [\"z\"] }] }\n";
    let warnings = |text: &str| {
        Robot::parse(text, std::path::Path::new("axis.toml"), &RobotOptions::default()).unwrap().warnings
    };
    let told = warnings(&format!("{text}{friction}"));
    assert!(told.iter().any(|w| w.contains("does nothing") && w.contains("[element.slide]")), "{told:?}");
    let listed = friction.replace("reaction", "elements = [\"reaction_friction\"]\nreaction");
    assert!(warnings(&format!("{text}{listed}")).iter().all(|w| !w.contains("does nothing")));
}
