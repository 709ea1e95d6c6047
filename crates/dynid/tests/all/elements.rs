//! Elements with shape parameters as a robot file states them.

#![expect(clippy::unwrap_used, reason = "helpers of tests outside of test functions")]

use dynid::Error;
use dynid::elements::ElementPlan;
use dynid::io::toml_robot;
use dynid::model::element::ElementRegistry;
use dynid::model::{EffortModel, Mechanism, Parameter, ParameterTable, RobotModel};

/// A joint with a speed limit of 4 rad/s, and what is said about its elements.
fn planned(elements: &str) -> (Mechanism, Result<ElementPlan, Error>) {
    let text = format!(
        "schema = 1\nname = \"one\"\ndh = \"modified\"\n[[joint]]\nname = \"j1\"\nd = 0.3\n\
         limits = {{ velocity = 4.0 }}\nmass = 1.0\n[element.j1]\n{elements}\n"
    );
    let robot = toml_robot::parse(&text, "one.toml").unwrap();
    let mechanism = robot.description.build().unwrap();
    let plan = ElementPlan::new(&mechanism, &robot.elements, None, |_| true);
    (mechanism, plan)
}

fn plan(elements: &str) -> (Mechanism, ElementPlan) {
    let (mechanism, plan) = planned(elements);
    (mechanism, plan.unwrap())
}

fn table(elements: &str) -> ParameterTable {
    let (mechanism, plan) = plan(elements);
    RobotModel::new(mechanism.clone(), plan.build(&mechanism).unwrap()).parameters().clone()
}

fn fault(elements: &str) -> String {
    let (mechanism, plan) = planned(elements);
    plan.and_then(|plan| plan.build(&mechanism)).map(|_| ()).unwrap_err().to_string()
}

#[test]
fn every_name_builds_an_element_with_parameters_of_its_own() {
    for kind in ElementRegistry::default().kinds() {
        let name = kind.name;
        // A transmission has no ratio that could be a default, a joint no load.
        let stated = match name {
            "elastic" => "\nelastic = { ratio = 100 }",
            "reaction_friction" => {
                "\nreaction_friction = { loads = [{ force = [\"x\"] }], stribeck = true, viscous = true }"
            }
            "balancer" => "\nbalancer = { ba = 0.5, br = 0.1, bphi = 0.3 }",
            _ => "",
        };
        let (mechanism, plan) = plan(&format!("elements = [\"{name}\"]{stated}"));
        let model = plan.model(&mechanism).unwrap();
        // The registry says what the element is.
        let table = model.parameters();
        assert!(table.linear.len() > 10, "{name}");
        for term in &kind.linear {
            let optional = name == "elastic" && term.symbol != "k1";
            let found = table.linear.iter().find(|p| p.name == format!("j1.{}", term.symbol));
            let Some(found) = found else {
                assert!(optional, "{name}: no parameter {}", term.symbol);
                continue;
            };
            assert_eq!((found.unit, found.lower), (term.units[0], term.lower), "{name}.{}", term.symbol);
        }
        let motor = |p: &&Parameter| p.name.starts_with("j1.");
        assert!(table.linear.iter().skip(10).filter(motor).count() <= kind.linear.len(), "{name}");
        for term in &kind.shape {
            let held = term.setting(4.0).held;
            let found = table.shape.iter().find(|p| p.name == format!("j1.{}", term.symbol));
            assert_eq!(found.is_none(), held, "{name}.{}", term.symbol);
        }
        // Behind a spring the motor has the friction of all motors.
        if name != "elastic" {
            let friction = plan.build(&mechanism).unwrap().iter().any(|e| e.is_friction());
            assert_eq!(friction, kind.friction, "{name}");
        }
    }
    let apart = ["arctangent", "tanh", "sigmoid", "sigmoid_offset", "power", "viscous_magnitude", "stribeck"];
    let all = table(&format!("elements = {apart:?}"));
    let mut names: Vec<&str> = all.linear.iter().map(|p| p.name.as_str()).collect();
    names.extend(all.shape.iter().map(|p| p.name.as_str()));
    let count = names.len();
    names.sort_unstable();
    names.dedup();
    assert_eq!(names.len(), count, "{names:?}");
}

#[test]
fn settings_reach_the_shape_parameters() {
    let t =
        table("elements = [\"stribeck\"]\nstribeck = { vs = { start = 0.04, lower = 0.01, upper = 0.1 } }");
    let vs = &t.shape[0];
    assert_eq!(t.shape.len(), 1, "delta is held unless stated otherwise");
    assert_eq!((vs.name.as_str(), vs.start, vs.lower, vs.upper), ("j1.vs", 0.04, 0.01, 0.1));
    let t = table(
        "elements = [\"stribeck\"]\nstribeck = { vs = { start = 0.04, held = true }, delta = { held = false } }",
    );
    let delta = &t.shape[0];
    assert_eq!((t.shape.len(), delta.name.as_str(), delta.start), (1, "j1.delta", 2.0));
    // A number alone is the start; bounds follow the speed limit, and hold the start.
    let t = table("elements = [\"arctangent\"]\narctangent = { fb = 7.0 }");
    assert_eq!((t.shape[0].start, t.shape[0].lower, t.shape[0].upper), (7.0, 0.25, 25.0));
    let t = table("elements = [\"arctangent\"]\narctangent = { fb = 30, speed = 1 }");
    assert_eq!((t.shape[0].start, t.shape[0].lower, t.shape[0].upper), (30.0, 1.0, 100.0));
    let t = table("elements = [\"arctangent\"]\narctangent = { fb = 0.1 }");
    assert_eq!((t.shape[0].start, t.shape[0].lower), (0.1, 0.1));
    let t = table("elements = [\"tanh\"]\ntanh = { w = { upper = 0.01 } }");
    assert_eq!((t.shape[0].start, t.shape[0].lower, t.shape[0].upper), (0.01, 0.004, 0.01));
}

#[test]
fn values_of_linear_parameters_are_stated() {
    let (_, plan) = plan(
        "elements = [\"stribeck\", \"arctangent\"]\nstribeck = { coulomb = 9.1, static = 11.8 }\n\
         arctangent = { effort = -2.5, fb = 5.0 }",
    );
    let mut stated = plan.stated_values();
    stated.sort_by(|a, b| a.0.cmp(&b.0));
    let expected = [("j1.fa", -2.5), ("j1.fc", 9.1), ("j1.fs", 11.8)];
    assert_eq!(stated, expected.map(|(name, value)| (name.to_owned(), value)));
}

#[test]
fn wrong_settings_are_told() {
    for (elements, parts) in [
        ("stribeck = { vz = 0.1 }", &["`stribeck` of joint `j1`", "`vs`", "`delta.held`", "found `vz`"][..]),
        ("stribeck = { vs = { begin = 0.1 } }", &["found `vs.begin`"]),
        ("stribeck = { vs = \"slow\" }", &["`vs`", "expected a number", "\"slow\""]),
        ("stribeck = { coulomb = true }", &["`coulomb`", "expected a number", "true"]),
        ("stribeck = { vs = { held = 2 } }", &["`vs.held`", "true or false", "2"]),
        ("stribeck = { vs = { lower = 0.2, start = 0.1 } }", &["`vs`", "between 0.2", "found 0.1"]),
        ("stribeck = { vs = -1 }", &["`vs`", "above 0", "-1"]),
        ("stribeck = { speed = 0 }", &["`speed`", "above 0", "found 0"]),
    ] {
        let found = fault(&format!("elements = [\"stribeck\"]\n{elements}"));
        for part in parts {
            assert!(found.contains(part), "{elements}: {found}");
        }
    }
}

#[test]
fn elements_that_depend_on_each_other_are_refused() {
    for (first, second) in [
        ("offset", "asymmetric"),
        ("coulomb", "asymmetric"),
        ("viscous", "asymmetric"),
        ("coulomb", "stribeck"),
        ("viscous", "viscous"),
    ] {
        let (mechanism, plan) = plan(&format!("elements = [\"{second}\", \"{first}\"]"));
        let found = plan.build(&mechanism).unwrap_err();
        assert!(
            matches!(&found, Error::EqualElements { first: f, second: s, .. } if f == first && s == second)
        );
        assert!(found.hint().unwrap().contains(first), "{found}");
    }
}

#[test]
fn elements_that_only_some_motions_tell_apart_are_named() {
    let of = |list: &str| {
        let (mechanism, plan) = plan(&format!("elements = {list}"));
        plan.alike(&mechanism).iter().map(ToString::to_string).collect::<Vec<_>>()
    };
    assert_eq!(of("[\"coulomb\", \"viscous\", \"offset\", \"rotor\"]"), Vec::<String>::new());
    let found = of("[\"tanh\", \"coulomb\"]");
    assert!(found.len() == 1 && found[0].contains("`coulomb` and `tanh` of joint `j1`"), "{found:?}");
    let found = of("[\"viscous\", \"arctangent\"]");
    assert!(found.len() == 1 && found[0].contains("1/fb"), "{found:?}");
}

/// What stands beside the defaults comes in addition; a spring takes the place of the constant effort, and pulls at a joint that stands still too.
#[test]
fn elements_beside_the_defaults() {
    let of = |elements: &str, moves: bool| {
        let text = format!(
            "schema = 1\nname = \"one\"\ndh = \"modified\"\n[[joint]]\nname = \"j1\"\nd = 0.3\nmass = 1.0\n[element.j1]\n{elements}\n"
        );
        let robot = toml_robot::parse(&text, "one.toml").map_err(|e| e.to_string())?;
        let mechanism = robot.description.build().unwrap();
        let plan = ElementPlan::new(&mechanism, &robot.elements, None, |_| moves).unwrap();
        Ok(plan.per_rate[0].clone())
    };
    let names = |list: &[&str]| Ok::<_, String>(list.iter().map(|n| (*n).to_owned()).collect::<Vec<_>>());
    assert_eq!(of("beside = [\"spring\"]", true), names(&["coulomb", "viscous", "rotor", "spring"]));
    assert_eq!(
        of("beside = [\"stribeck\"]", true),
        names(&["coulomb", "viscous", "offset", "rotor", "stribeck"])
    );
    assert_eq!(of("beside = [\"coulomb\"]", true), names(&["viscous", "offset", "rotor", "coulomb"]));
    assert_eq!(of("beside = [\"spring\", \"stribeck\"]", false), names(&["spring"]));
    assert_eq!(of("beside = [\"balancer\"]", false), names(&["balancer"]));
    let both = of("elements = [\"viscous\"]\nbeside = [\"spring\"]", true).unwrap_err();
    assert!(both.contains("no list of all elements of the joint beside it"), "{both}");
}

#[test]
fn gravity_compensators_have_the_geometry_of_a_drawing() {
    let list = "elements = [\"balancer\"]\nbalancer = ";
    let (_, drawn) =
        plan(&format!("{list}{{ ba = 0.5, br = 0.1, bphi = 0.3, stiffness = 9000, force = -50 }}"));
    let mut stated = drawn.stated_values();
    stated.sort_by(|a, b| a.0.cmp(&b.0));
    assert_eq!(stated, [("j1.bf", -50.0), ("j1.bk", 9000.0)].map(|(name, x)| (name.to_owned(), x)));
    let found = table(&format!(
        "{list}{{ ba = 0.5, br = {{ start = 0.1, lower = 0.08, upper = 0.12, held = false }}, bphi = 0.3 }}"
    ));
    let br = &found.shape[0];
    assert_eq!((found.shape.len(), br.name.as_str(), br.lower, br.upper), (1, "j1.br", 0.08, 0.12));
    for (settings, parts) in [
        (
            "{ br = 0.1, bphi = 0.3 }",
            &["`ba`: expected a value in m, found none", "ba = .., br = .., bphi = .."][..],
        ),
        ("{ ba = 0.1, br = 0.1, bphi = 0 }", &["expected `br` below `ba`", "found `br` up to 0.1"]),
        ("{ ba = 0.1, br = 0.05, bphi = \"20deg\" }", &["`bphi`", "expected a number"]),
        (
            "{ ba = { start = 0.5, lower = 0.4, held = false }, br = { start = 0.1, upper = 0.2, held = false }, bphi = 0 }",
            &["tell their ratio alone"],
        ),
    ] {
        let found = fault(&format!("{list}{settings}"));
        for part in parts {
            assert!(found.contains(part), "{settings}: {found}");
        }
    }
    let slides = "schema = 1\nname = \"one\"\ndh = \"modified\"\n[[joint]]\nname = \"j1\"\nkind = \"prismatic\"\nmass = 1.0\n\
                  [element.j1]\nbeside = [\"balancer\"]\nbalancer = { ba = 0.5, br = 0.1, bphi = 0.3 }\n";
    let robot = toml_robot::parse(slides, "one.toml").unwrap();
    let mechanism = robot.description.build().unwrap();
    let plan = ElementPlan::new(&mechanism, &robot.elements, None, |_| true).unwrap();
    assert!(plan.build(&mechanism).unwrap_err().to_string().contains("this one slides"));
}
