//! Ties from robot file and configuration to results: exact, judged, in every estimator, told when the machine is not like that.

#![expect(clippy::unwrap_used, reason = "a test may stop, and says what it measured")]

use std::path::Path;

use dynid::compare::compare;
use dynid::estimate::{Estimate, Split};
use dynid::model::EffortModel;
use dynid::record::{ParameterVerdict, Status};
use dynid::simulate::{SimulateSettings, simulate};
use dynid::verdict::CheckName;
use dynid::{Config, Robot, RobotOptions, Run, identify};

use tempfile::TempDir;

use crate::support::write_log;

/// Two arms on one column, mirror images of each other but for the drives of the left one, which has a gear twice as stiff.
const TORSO: &str = r#"
name = "torso"
body = [
  { name = "column", parent = "ground", joint = { name = "waist", axis = [0, 0, 1], limits = { position = [-2, 2], velocity = 2, effort = 200 } }, mass = 20, com = [0.02, 0, 0.3], inertia_com = [0.8, 0, 0, 0.7, 0, 0.3] },
  { name = "left_upper", parent = "column", joint = { name = "left_shoulder", xyz = [0, 0.2, 0.5], axis = [0, 1, 0], limits = { position = [-2.5, 2.5], velocity = 3, effort = 80 } }, mass = 3, com = [0.12, 0.03, 0.01], inertia_com = [0.005, 0.001, 0, 0.02, 0.0005, 0.02] },
  { name = "left_fore", parent = "left_upper", joint = { name = "left_elbow", xyz = [0.3, 0, 0], axis = [0, 1, 0], limits = { position = [-2.5, 2.5], velocity = 4, effort = 40 } }, mass = 1.5, com = [0.1, -0.02, 0], inertia_com = [0.002, 0, 0, 0.008, 0, 0.008] },
  { name = "right_upper", parent = "column", joint = { name = "right_shoulder", xyz = [0, -0.2, 0.5], axis = [0, 1, 0], limits = { position = [-2.5, 2.5], velocity = 3, effort = 80 } }, mass = 3, com = [0.12, -0.03, 0.01], inertia_com = [0.005, -0.001, 0, 0.02, -0.0005, 0.02] },
  { name = "right_fore", parent = "right_upper", joint = { name = "right_elbow", xyz = [0.3, 0, 0], axis = [0, 1, 0], limits = { position = [-2.5, 2.5], velocity = 4, effort = 40 } }, mass = 1.5, com = [0.1, 0.02, 0], inertia_com = [0.002, 0, 0, 0.008, 0, 0.008] },
]
[defaults]
elements = ["coulomb", "viscous", "rotor"]
"#;

const TIES: &str = r#"
[[tie]]
equal = ["left_upper", "right_upper"]
mirror = "y"
[[tie]]
equal = ["left_fore", "right_fore"]
mirror = "y"
[[tie]]
equal = ["left_elbow", "right_elbow"]
[[tie]]
ratio = { "left_shoulder.Ia" = 2, "right_shoulder.Ia" = 1 }
[[tie]]
sum = { "left_shoulder.fc" = 1, "right_shoulder.fc" = 1 }
value = 2.4
[[tie]]
known = { "waist.fv" = 1.5 }
"#;

/// What the machine is, as far as the file does not say it.
const TRUTH: &str = r#"
"waist.fc" = 4
"waist.fv" = 1.5
"waist.Ia" = 0.5
"left_shoulder.fc" = 1.5
"left_shoulder.fv" = 0.9
"left_shoulder.Ia" = 0.24
"right_shoulder.fc" = 0.9
"right_shoulder.fv" = 0.6
"right_shoulder.Ia" = 0.12
"left_elbow.fc" = 0.5
"left_elbow.fv" = 0.2
"left_elbow.Ia" = 0.05
"right_elbow.fc" = 0.5
"right_elbow.fv" = 0.2
"right_elbow.Ia" = 0.05
"left_upper.m" = 3.3
"right_upper.m" = 3.3
"left_fore.mx" = 0.18
"right_fore.mx" = 0.18
"#;

/// Friction as the file states it, and no shapes beside.
const GIVEN: &str = "[elements]\nfriction = \"given\"\n";

struct Bench {
    folder: TempDir,
    truth: Vec<(String, f64)>,
}

impl Bench {
    /// Two logs of the machine with some values of its own.
    fn new(test: &str, other: &[(&str, f64)]) -> Self {
        Self::of_seed(test, other, 1)
    }

    fn of_seed(test: &str, other: &[(&str, f64)], seed: u64) -> Self {
        let kept = tempfile::Builder::new().prefix(&format!("dynid-ties-{test}-")).tempdir().unwrap();
        let folder = kept.path();
        std::fs::write(folder.join("robot.toml"), TORSO).unwrap();
        let robot = Robot::load(&folder.join("robot.toml"), &RobotOptions::default()).unwrap();
        let table: toml::Table = TRUTH.parse().unwrap();
        let number = |v: &toml::Value| v.as_float().or(v.as_integer().map(|x| x as f64)).unwrap();
        let mut settings = SimulateSettings {
            duration_s: 40.0,
            rate_hz: 200.0,
            effort_noise: 0.01,
            encoder_bits: 20,
            ..SimulateSettings::default()
        };
        settings.values = table.iter().map(|(name, v)| (name.clone(), number(v))).collect();
        settings.values.extend(other.iter().map(|(name, x)| ((*name).to_owned(), *x)));
        let mut truth = Vec::new();
        for (seed, file) in [(seed, "train.csv"), (seed + 100, "held.csv")] {
            let log = simulate(&robot, &SimulateSettings { seed, ..settings.clone() }).unwrap();
            write_log(&log, &folder.join(file));
            truth = log.truth;
        }
        Bench { folder: kept, truth }
    }

    fn config(&self, more: &str) -> Config {
        let text = format!(
            "robot = {:?}\n{more}\n[[log]]\npath = {:?}\n[[validation]]\npath = {:?}\n",
            self.folder.path().join("robot.toml"),
            self.folder.path().join("train.csv"),
            self.folder.path().join("held.csv"),
        );
        Config::parse(&text, &self.folder.path().join("run.toml").display().to_string()).unwrap()
    }

    fn identify(&self, more: &str) -> Run {
        identify(&self.config(more), &mut |_| ()).unwrap()
    }

    fn truth(&self, name: &str) -> f64 {
        self.truth.iter().find(|(n, _)| n == name).unwrap().1
    }
}

fn value(estimate: &Estimate, name: &str) -> f64 {
    estimate.parameters.iter().find(|p| p.name == name).unwrap_or_else(|| panic!("{name}")).value
}

/// Every tie, to the bit or, of sums, to rounding.
fn obeys(estimate: &Estimate) {
    for p in ["m", "mx", "my", "mz", "Ixx", "Ixy", "Ixz", "Iyy", "Iyz", "Izz"] {
        let sign = if ["my", "Ixy", "Iyz"].contains(&p) { -1.0 } else { 1.0 };
        for link in ["upper", "fore"] {
            let [left, right] = ["left", "right"].map(|side| value(estimate, &format!("{side}_{link}.{p}")));
            assert_eq!(left, sign * right, "{link}.{p}");
        }
    }
    for p in ["fc", "fv", "Ia"] {
        assert_eq!(value(estimate, &format!("left_elbow.{p}")), value(estimate, &format!("right_elbow.{p}")));
    }
    let [left, right] = ["left_shoulder.Ia", "right_shoulder.Ia"].map(|name| value(estimate, name));
    assert_eq!(left, 2.0 * right);
    let sum = value(estimate, "left_shoulder.fc") + value(estimate, "right_shoulder.fc");
    assert!((sum - 2.4).abs() < 1e-14);
    assert_eq!(value(estimate, "waist.fv"), 1.5);
}

#[test]
fn ties_hold_exactly_and_what_they_leave_is_known_better() {
    let bench = Bench::new("exact", &[]);
    let (tied, free) = (bench.identify(&format!("{GIVEN}{TIES}")), bench.identify(GIVEN));
    let (estimate, loose) = (tied.estimate(), free.estimate());
    obeys(&estimate);
    assert!(estimate.feasible);
    println!(
        "base parameters: {} tied, {} free",
        estimate.base_parameters.len(),
        loose.base_parameters.len()
    );
    assert!(estimate.base_parameters.len() + 10 < loose.base_parameters.len());
    for p in &estimate.parameters {
        let (Some(std), Some(free)) =
            (p.std, loose.parameters.iter().find(|q| q.name == p.name).unwrap().std)
        else {
            continue;
        };
        println!(
            "{}: {:.5} ± {std:.5} (free ± {free:.5}), truth {:.5}",
            p.name,
            p.value,
            bench.truth(&p.name)
        );
        assert!(std < 1.1 * free, "{}: {std} {free}", p.name);
    }
    let of = |name: &str| estimate.parameters.iter().find(|p| p.name == name).unwrap();
    assert_eq!(of("waist.fv").verdict, ParameterVerdict::Given);
    assert_eq!((of("waist.fv").std, of("waist.fv").share), (None, None));
    assert_eq!(of("waist.fv").tie.as_deref(), Some("waist.fv = 1.5"));
    assert_eq!(of("right_fore.my").tie.as_deref(), Some("right_fore.my = -left_fore.my"));
    assert_eq!(of("right_elbow.fc").verdict, of("left_elbow.fc").verdict);
    assert_eq!(of("right_elbow.fc").std, of("left_elbow.fc").std);
    assert_eq!(of("right_shoulder.fc").std, of("left_shoulder.fc").std);
    let [low, high] = [of("left_fore.mx").interval.unwrap(), of("right_fore.mx").interval.unwrap()];
    assert_eq!(low, high);
    // A mirrored moment has the mirrored interval.
    let ties = estimate.ties.as_ref().unwrap();
    println!("{ties:?}");
    let check = estimate.verdict.checks.iter().find(|c| c.name == CheckName::Ties).unwrap();
    assert_eq!(check.status, Status::Ok, "{check:?}");
    // The file that was written predicts the same.
    let read = Estimate::parse(estimate.to_json().as_bytes(), "estimate.json").unwrap();
    let model = read.effort_model(Path::new("estimate.json"), Split::Consistent).unwrap();
    let (own, linear) = tied.identified_model();
    model.random_motion(50, 3).with_block(|motion| {
        let efforts = |model: &dyn EffortModel, linear: &[f64]| {
            let mut out = vec![0.0; model.outputs().len() * motion.samples];
            model.efforts(motion, &[], linear, motion.samples, &mut out);
            out
        };
        for (a, b) in efforts(&model, &read.values(Split::Consistent)).iter().zip(efforts(own, linear)) {
            assert!((a - b).abs() < 1e-9, "{a} {b}");
        }
    });
}

/// Deviations from the truth in standard deviations, of parameters that follow from no other.
#[test]
fn intervals_of_tied_parameters_hold() {
    let mut off: Vec<f64> = Vec::new();
    for seed in 1..7 {
        let bench = Bench::of_seed("coverage", &[], seed);
        let estimate = bench.identify(&format!("{GIVEN}{TIES}")).estimate();
        let own = estimate.parameters.iter().filter(|p| p.tie.is_none());
        off.extend(own.filter_map(|p| Some((p.value - bench.truth(&p.name)) / p.std?)));
        assert!(estimate.ties.unwrap().f < 5.0);
    }
    let beyond = |z: f64| off.iter().filter(|x| x.abs() > z).count();
    println!("{} parameters, {} beyond 2, {} beyond 3", off.len(), beyond(2.0), beyond(3.0));
    // 5 % of Gauss's, with room for the t distribution of some twenty blocks.
    assert!(off.len() > 100 && beyond(2.0) * 10 <= off.len() && beyond(3.0) * 50 <= off.len(), "{off:.1?}");
}

#[test]
fn every_estimator_obeys_the_ties() {
    let bench = Bench::new("estimators", &[]);
    for method in ["ols", "huber", "tukey", "ridge", "tls"] {
        let noise = if method == "tls" { "effort_noise = 0.5\n" } else { "" };
        let more = format!("{GIVEN}{TIES}\n[estimator]\nmethod = \"{method}\"\n{noise}");
        obeys(&bench.identify(&more).estimate());
    }
    for more in ["consistency = \"none\"", "consistency = \"spatial-inertia\"", "prior = \"entropic\""] {
        obeys(&bench.identify(&format!("{GIVEN}{TIES}\n[estimator]\n{more}\n")).estimate());
    }
    let found = compare(&bench.config(&format!("{GIVEN}{TIES}")), &mut |_, _, _| ()).unwrap();
    assert!(found.estimators.iter().filter(|e| e.failure.is_none()).count() > 4, "{:?}", found.estimators);
}

#[test]
fn a_machine_that_is_not_as_its_ties_say_is_told() {
    for (what, other, named) in [
        ("friction", [("right_elbow.fc", 0.6), ("right_elbow.fv", 0.2)], "right_elbow.fc = left_elbow.fc"),
        ("body", [("right_fore.mx", 0.2), ("right_fore.Iyy", 0.024)], "right_fore.mx = left_fore.mx"),
        ("value", [("waist.fv", 1.8), ("waist.fc", 4.0)], "waist.fv = 1.5"),
    ] {
        let bench = Bench::new(what, &other);
        let estimate = bench.identify(&format!("{GIVEN}{TIES}")).estimate();
        let check = estimate.verdict.checks.iter().find(|c| c.name == CheckName::Ties).unwrap();
        println!("{what}: {check:?}");
        assert_eq!(check.status, Status::Warn, "{what}");
        let ties = estimate.ties.unwrap();
        assert!(ties.deviations.iter().any(|d| d.tie == named), "{what}: {:?}", ties.deviations);
    }
}

#[test]
fn friction_that_is_found_is_found_for_equal_joints_alike() {
    let bench = Bench::new("auto", &[]);
    let found = bench.identify(TIES);
    obeys(&found.estimate());
    let names = found.plan.names(&found.robot.mechanism);
    let of = |joint: &str| found.plan.per_rate[names.iter().position(|n| n == joint).unwrap()].clone();
    assert_eq!(of("left_elbow"), of("right_elbow"));
}

#[test]
fn ties_that_cannot_hold_are_refused() {
    let bench = Bench::new("refused", &[]);
    let fault = |more: &str| {
        let text = format!(
            "robot = {:?}\n{more}\n[[log]]\npath = {:?}\n",
            bench.folder.path().join("robot.toml"),
            bench.folder.path().join("train.csv")
        );
        let config = Config::parse(&text, "run.toml").map_err(|e| e.to_string());
        config
            .and_then(|config| identify(&config, &mut |_| ()).map_err(|e| e.to_string()))
            .err()
            .unwrap_or_default()
    };
    for (more, expected) in [
        ("[[tie]]\nequal = [\"left_elbow\"]", "at least two names"),
        ("[[tie]]\nequal = [\"left_elbow\", \"left_elbow\"]", "twice"),
        ("[[tie]]\nequal = [\"left_elbow\", \"rigth_elbow\"]", "rigth_elbow"),
        ("[[tie]]\nequal = [\"left_elbow\", \"right_elbow\"]\nmirror = \"y\"", "no link"),
        ("[[tie]]\nequal = [\"left_elbow\", \"right_fore\"]", "need the same elements"),
        ("[[tie]]\nequal = [\"left_elbow\", \"right_elbow\"]\nknown = { \"waist.fv\" = 1 }", "one of"),
        ("[[tie]]\nmirror = \"y\"\nknown = { \"waist.fv\" = 1 }", "`equal`"),
        ("[[tie]]\nsum = { \"waist.fv\" = 1 }", "what the sum is"),
        ("[[tie]]\nsum = { \"waist.fv\" = 1, \"waist.fs\" = 1 }\nvalue = 2", "all of its terms"),
        ("[[tie]]\nratio = { \"waist.fv\" = 1, \"waist.fc\" = 0 }", "not 0"),
        ("[[tie]]\nknown = { \"waist.fv\" = nan }", "finite"),
        ("[[tie]]\nsame = [\"a\"]", "unknown field"),
        ("tie = [3]", "a list of names that are equal, or a table"),
        ("[[tie]]\nknown = { \"waist.fv\" = 1 }\n[[tie]]\nknown = { \"waist.fv\" = 2 }", "the ties before"),
        // No body has such a moment with that mass.
        (
            "[[tie]]\nknown = { \"left_fore.m\" = 0, \"left_fore.mx\" = 0.3 }",
            "no physically consistent parameters",
        ),
    ] {
        let found = fault(more);
        assert!(found.contains(expected), "{more}: expected {expected}, found {found}");
    }
    // What is tied of a robot without it does nothing, and says so.
    let idle = bench.identify("tie = [[\"waist.fs\", \"left_elbow.fs\"]]");
    let warned = idle.estimate().verdict.warnings;
    assert!(warned.iter().any(|w| w.contains("does not tie `waist.fs`, `left_elbow.fs`")), "{warned:?}");
}

#[test]
fn parts_of_a_body_are_tied_without_losing_the_body() {
    let bench = Bench::new("parts", &[]);
    let more = "[[tie]]\nknown = { \"left_fore.m\" = 1.5, \"column.my\" = 0 }\n[[tie]]\nequal = [\"left_fore.m\", \"right_fore.m\"]\n\
                [[tie]]\nsum = { \"left_upper.m\" = 1, \"right_upper.m\" = 1 }\nvalue = 6.6\n";
    let estimate = bench.identify(&format!("{GIVEN}{more}")).estimate();
    assert_eq!([value(&estimate, "left_fore.m"), value(&estimate, "right_fore.m")], [1.5, 1.5]);
    assert_eq!(value(&estimate, "column.my"), 0.0);
    assert!((value(&estimate, "left_upper.m") + value(&estimate, "right_upper.m") - 6.6).abs() < 1e-12);
    assert!(estimate.feasible);
}
