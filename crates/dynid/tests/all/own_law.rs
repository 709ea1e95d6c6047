//! A law of friction of a program's own: simulated, identified, recorded, read back, exported, and refused where it is not known.

#![expect(clippy::unwrap_used, reason = "helpers of tests outside of test functions")]

use dynid::config::{Config, Friction, LogConfig};
use dynid::estimate::{Estimate, Split};
use dynid::export::{CheckStates, RobotExport, Source};
use dynid::io::csv;
use dynid::model::Scalar;
use dynid::model::element::{
    ElementKind, ElementRegistry, LinearTerm, RegistryFault, ShapeTerm, Velocity, VelocityLaw, laws, units,
};
use dynid::predict::efforts;
use dynid::simulate::{SimulateSettings, simulate};
use dynid::{Robot, RobotOptions, identify};

/// Friction that falls from `hs` at rest to `hc` as `1 / (1 + (v/hv)²)` (Hess & Soom 1990).
#[derive(Debug, Clone)]
struct HessSoom;

impl VelocityLaw<1, 2> for HessSoom {
    fn linear(&self) -> [LinearTerm; 2] {
        [LinearTerm::effort("hc").friction(), LinearTerm::effort("hs").friction()]
    }
    fn shape(&self) -> [ShapeTerm; 1] {
        [ShapeTerm::speed("hv", 0.001, 0.3)]
    }
    fn columns<S: Scalar>(&self, v: Velocity<S>, [hv]: [S; 1]) -> [S; 2] {
        let x = v.value() / hv;
        let falling = (S::one() + x * x).recip();
        [v.sign() * (S::one() - falling), v.sign() * falling]
    }
}

fn registry() -> ElementRegistry {
    let law = ElementKind::law("hess_soom", HessSoom)
        .equation("sign(q̇) (hc + (hs - hc) / (1 + (q̇/hv)²))")
        .excludes("coulomb", "its columns add up to the sign");
    ElementRegistry::default().with(law).unwrap()
}

const ARM: &str = r#"schema = 1
name = "arm"
dh = "modified"
[[joint]]
name = "j1"
alpha = "-90deg"
limits = { position = [-2.0, 2.0], velocity = 3.0, effort = 100.0 }
phi = [3.0, 0.6, 0.03, 0.0, 0.06, -0.006, 0.0, 0.17, 0.0, 0.18]
[element.j1]
elements = ["hess_soom", "viscous", "offset"]
viscous = { coefficient = 1.2 }
"#;
const VALUES: &str = "hess_soom = { hc = 2.0, hs = 4.0, hv = { start = 0.25, lower = 0.05, upper = 1.0 } }\n";

#[test]
fn an_own_law_goes_the_whole_way() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    std::fs::write(path("truth.toml"), format!("{ARM}{VALUES}")).unwrap();
    std::fs::write(path("arm.toml"), ARM).unwrap();
    let robot = Robot::load(&path("truth.toml"), &RobotOptions::default()).unwrap().with_registry(registry());
    let settings = SimulateSettings::parse("rate_hz = 250\nseed = 3", "simulation").unwrap();
    let log = simulate(&robot, &settings).unwrap();
    assert_eq!(log.truth.iter().find(|(name, _)| name == "j1.hs").map(|(_, x)| *x), Some(4.0));
    let columns: [&[f64]; 3] = [&log.time, &log.position[0], &log.effort[0]];
    csv::write(path("log.csv"), &["t", "q1", "tau1"], &columns).unwrap();

    let log_config = LogConfig { path: path("log.csv"), ..LogConfig::default() };
    let mut config = Config { robot: path("arm.toml"), log: vec![log_config], ..Config::default() };
    config.elements.friction = Friction::Given;
    let unknown = identify(&config, &mut |_| {}).unwrap_err();
    assert!(unknown.to_string().contains("unknown element `hess_soom` for joint `j1`"), "{unknown}");
    config.registry = registry();
    let found = identify(&config, &mut |_| {}).unwrap();
    let estimate = found.estimate();
    let [shape] = &estimate.shape_parameters[..] else { panic!("{:?}", estimate.shape_parameters) };
    assert_eq!((shape.name.as_str(), shape.verdict.word()), ("j1.hv", "seen in the data"));
    assert!((shape.value - 0.25).abs() <= 4.0 * shape.std.unwrap(), "{shape:?}");
    for (name, truth) in [("j1.hc", 2.0), ("j1.hs", 4.0)] {
        let p = estimate.parameters.iter().find(|p| p.name == name).unwrap();
        assert_eq!(p.verdict.word(), "seen in the data");
        assert!((p.value - truth).abs() <= 4.0 * p.std.unwrap(), "{p:?}");
    }
    assert_eq!(estimate.friction_passivity[0].passivity.word(), "passive");

    // Read back, by those who know the law and by those who do not.
    let file = path("estimate.json");
    std::fs::write(&file, estimate.to_json()).unwrap();
    let mut read = Estimate::read(&file).unwrap();
    let fault = read.effort_model(&file, Split::Consistent).unwrap_err().to_string();
    assert!(fault.contains("`hess_soom`") && fault.contains("expected one of"), "{fault}");
    read.model.registry = registry();
    let model = read.effort_model(&file, Split::Consistent).unwrap();
    let states = dynid::io::States {
        rows: log.time.len(),
        position: log.clean[0].clone(),
        velocity: log.clean[1].clone(),
        acceleration: log.clean[2].clone(),
        gravity: None,
        channels: Vec::new(),
        time: None,
    };
    let predicted = efforts(&model, &read.values(Split::Consistent), &states).unwrap();
    let square = |list: &mut dyn Iterator<Item = f64>| list.map(|x| x * x).sum::<f64>();
    let error = square(&mut predicted[0].iter().zip(&log.clean[3][0]).map(|(p, c)| p - c));
    let share = (error / square(&mut log.clean[3][0].iter().copied())).sqrt();
    assert!(share < 0.02, "{:.2} % off the true effort", 100.0 * share);

    // Files of simulators state it as they do every law that they have no place for.
    let robot = dynid::export::IdentifiedRobot::of(&read, &file).unwrap();
    let states = CheckStates::random(robot.identified().model);
    let source = Source::read(&path("arm.toml")).unwrap();
    let export = RobotExport::new(robot.identified(), &source).unwrap();
    for exported in [export.urdf(&states).unwrap(), export.mjcf(&states).unwrap()] {
        let notes = exported.notes.join("\n");
        assert!(notes.contains("friction of `j1` has a form that"), "{notes}");
    }
}

const LAW: &str = "[law.hess_soom]\nshape = { hv = [0.003, 0.9] }\n[law.hess_soom.columns]\n\
    hc = { formula = \"sign(v) * (1 - 1 / (1 + (v / hv)^2))\", least = 0 }\n\
    hs = { formula = \"sign(v) / (1 + (v / hv)^2)\", least = 0 }\n";

#[test]
fn a_law_of_formulas_goes_the_whole_way_without_a_program() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let write = |name: &str, text: &str| std::fs::write(path(name), text).unwrap();
    let searched = format!("{ARM}hess_soom = {{ hv = {{ start = 0.25, lower = 0.05, upper = 1.0 }} }}\n");
    write("truth.toml", &format!("{ARM}{VALUES}{LAW}"));
    write("own.toml", &format!("{searched}{LAW}"));
    write(
        "arm.toml",
        &searched.replace("[\"hess_soom\", \"viscous\", \"offset\"]", "[\"viscous\", \"offset\"]"),
    );
    let robot = Robot::load(&path("truth.toml"), &RobotOptions::default()).unwrap();
    let settings = SimulateSettings::parse("rate_hz = 250\nseed = 3", "simulation").unwrap();
    let log = simulate(&robot, &settings).unwrap();
    let columns: [&[f64]; 3] = [&log.time, &log.position[0], &log.effort[0]];
    csv::write(path("log.csv"), &["t", "q1", "tau1"], &columns).unwrap();

    // The robot file states the law, or the configuration does, or a program has it in code.
    let given = "[[log]]\npath = \"log.csv\"\n[elements]\nfriction = \"given\"\n";
    write("a.toml", &format!("robot = \"own.toml\"\n{given}"));
    write(
        "b.toml",
        &format!(
            "robot = \"arm.toml\"\n{given}joint = {{ j1 = [\"hess_soom\", \"viscous\", \"offset\"] }}\n{LAW}"
        ),
    );
    let [a, b] =
        ["a.toml", "b.toml"].map(|name| identify(&Config::read(&path(name)).unwrap(), &mut |_| {}).unwrap());
    write("plain.toml", &searched);
    write("c.toml", &format!("robot = \"plain.toml\"\n{given}"));
    let config = Config { registry: registry(), ..Config::read(&path("c.toml")).unwrap() };
    let code = identify(&config, &mut |_| {}).unwrap();
    let [a, b, code] = [a, b, code].map(|found| found.estimate());
    for p in ["j1.hc", "j1.hs", "j1.fv", "j1.fo"] {
        let of = |e: &Estimate| e.parameters.iter().find(|q| q.name == p).map(|q| (q.value, q.std)).unwrap();
        assert_eq!(of(&a), of(&b), "{p}");
        let ((x, std), (y, _)) = (of(&a), of(&code));
        assert!((x - y).abs() < 1e-3 * std.unwrap(), "{p}: {x} {y}");
    }
    assert!((a.shape_parameters[0].value - code.shape_parameters[0].value).abs() < 1e-6);
    assert_eq!(a.friction_passivity[0].passivity.word(), "passive");

    // The result file is read by anybody.
    let file = path("estimate.json");
    std::fs::write(&file, a.to_json()).unwrap();
    let read = Estimate::read(&file).unwrap();
    assert_eq!(read.to_json(), a.to_json());
    let states = dynid::io::States {
        rows: log.time.len(),
        position: log.clean[0].clone(),
        velocity: log.clean[1].clone(),
        acceleration: log.clean[2].clone(),
        gravity: None,
        channels: Vec::new(),
        time: None,
    };
    let model = read.effort_model(&file, Split::Consistent).unwrap();
    let predicted = efforts(&model, &read.values(Split::Consistent), &states).unwrap();
    let worst = predicted[0].iter().zip(&log.clean[3][0]).map(|(p, c)| (p - c).abs()).fold(0.0, f64::max);
    assert!(worst < 0.2, "{worst} N m off the true effort");
    let damaged = a.to_json().replace("(v / hv)^2", "(v / hv)^");
    std::fs::write(&file, damaged).unwrap();
    let read = Estimate::read(&file).map(|read| read.effort_model(&file, Split::Consistent).map(drop));
    let said = read.map_or_else(|e| e.to_string(), |model| model.unwrap_err().to_string());
    assert!(said.contains("law `hess_soom`: column `hc`"), "{said}");

    // What is no law is told with its place.
    write("bad.toml", &format!("{ARM}{}", LAW.replace("sign(v) /", "sgn(v) /")));
    let said = Robot::load(&path("bad.toml"), &RobotOptions::default()).unwrap_err();
    let line = 1 + ARM.lines().count();
    assert!(said.to_string().contains(&format!("bad.toml:{line}")), "{said}");
    assert!(
        said.to_string()
            .contains("law `hess_soom`: column `hs`: `sgn(v) / (1 + (v / hv)^2)`, character 1: expected"),
        "{said}"
    );
    assert!(said.hint().unwrap().contains("[law.mine]"));
    write("d.toml", &format!("robot = \"arm.toml\"\n{given}{}", LAW.replace("hs =", "fs =")));
    let said = identify(&Config::read(&path("d.toml")).unwrap(), &mut |_| {}).unwrap_err().to_string();
    assert!(
        said.contains("law `hess_soom`") && said.contains("`fs`") && said.contains("`stribeck`"),
        "{said}"
    );
}

/// A gravity compensator, and friction and a stop that depend on the position: found, and in files of simulators no friction.
#[test]
fn efforts_that_follow_the_position_go_the_whole_way() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let arm = ARM.replace("[\"hess_soom\", \"viscous\", \"offset\"]", "LIST");
    let laws = "[law.worn]\nshape = { wq = { lower = -1, upper = 1, unit = \"position\" } }\n\
                [law.worn.columns]\nwf = \"sign(v) * exp(-(q - wq)^2)\"\n\
                [law.stop]\nfriction = false\n[law.stop.columns]\nst = \"q^3\"\n";
    let list = "[\"coulomb\", \"viscous\", \"offset\", \"balancer\", \"worn\", \"stop\"]";
    let geometry = "balancer = { ba = 0.5, br = 0.2, bphi = 0.3 }\n";
    let values = "coulomb = { effort = 2.0 }\nbalancer = { ba = 0.5, br = 0.2, bphi = 0.3, force = 60, stiffness = 30 }\n\
                  worn = { wf = 3.0, wq = 0.4 }\nstop = { st = 1.5 }\n";
    std::fs::write(path("truth.toml"), format!("{}{values}{laws}", arm.replace("LIST", list))).unwrap();
    std::fs::write(path("arm.toml"), format!("{}{geometry}{laws}", arm.replace("LIST", list))).unwrap();
    let robot = Robot::load(&path("truth.toml"), &RobotOptions::default()).unwrap();
    let settings = SimulateSettings::parse("rate_hz = 250\nseed = 3\nduration_s = 20", "simulation").unwrap();
    let log = simulate(&robot, &settings).unwrap();
    let columns: [&[f64]; 3] = [&log.time, &log.position[0], &log.effort[0]];
    csv::write(path("log.csv"), &["t", "q1", "tau1"], &columns).unwrap();
    let log_config = LogConfig { path: path("log.csv"), ..LogConfig::default() };
    let mut config = Config { robot: path("arm.toml"), log: vec![log_config], ..Config::default() };
    config.elements.friction = Friction::Given;
    let found = identify(&config, &mut |_| {}).unwrap().estimate();
    for (name, truth) in [("j1.fc", 2.0), ("j1.fv", 1.2), ("j1.wf", 3.0), ("j1.st", 1.5), ("j1.bf", 60.0)] {
        let p = found.parameters.iter().find(|p| p.name == name).unwrap();
        let std = p.std.unwrap();
        assert!((p.value - truth).abs() < 4.0 * std && std < 0.1 * truth, "{name}: {} ± {std}", p.value);
    }
    let place = &found.shape_parameters[0];
    assert!(place.name == "j1.wq" && (place.value - 0.4).abs() < 0.05, "{}", place.value);

    let file = path("estimate.json");
    std::fs::write(&file, found.to_json()).unwrap();
    let read = Estimate::read(&file).unwrap();
    assert_eq!(read.to_json(), found.to_json());
    let robot = dynid::export::IdentifiedRobot::of(&read, &file).unwrap();
    let states = CheckStates::random(robot.identified().model);
    let source = Source::read(&path("arm.toml")).unwrap();
    let export = RobotExport::new(robot.identified(), &source).unwrap();
    for exported in [export.urdf(&states).unwrap(), export.mjcf(&states).unwrap()] {
        let notes = exported.notes.join("\n");
        for left_out in ["gravity compensator of j1", "law of the position of j1"] {
            assert!(notes.contains(&format!("has no place for it: {left_out}")), "{notes}");
        }
        // Friction that changes with position is friction still: what it is over all positions.
        let friction = notes.split("stated as friction ").nth(1).and_then(|s| s.split(' ').next()).unwrap();
        let friction: f64 = friction.parse().unwrap();
        assert!((2.0..5.0).contains(&friction), "{friction}: {notes}");
    }
}

#[test]
fn a_registry_refuses_names_and_symbols_that_are_taken() {
    let found = registry().with(ElementKind::law("hess_soom", laws::Coulomb)).unwrap_err();
    assert_eq!(found, RegistryFault::Name { name: "hess_soom" });
    let found = registry().with(ElementKind::law("dry", laws::Coulomb)).unwrap_err();
    assert_eq!(found, RegistryFault::Symbol { name: "dry", symbol: "fc", other: "coulomb" });
    assert!(registry().is_friction("hess_soom") && registry().is_coefficient("hs"));
    assert_ne!(registry(), ElementRegistry::default());
    assert_eq!(LinearTerm::effort("hc").units, units::EFFORT);
}
