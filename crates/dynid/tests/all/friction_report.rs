//! What an identification says about nonlinear friction: passivity, its warnings, tables and pictures.

#![expect(clippy::unwrap_used, reason = "a test may stop")]

use dynid::Config;
use dynid::estimate::{Estimate, PassivityRecord};
use dynid::identify;

/// Inertia about the joint's axis, kg m².
const INERTIA: f64 = 3.0;
/// Constant effort, N m.
const OFFSET: f64 = 53.0;

/// Robot file, log and configuration of one joint about a vertical axis with a friction law, identified.
fn identified(friction: impl Fn(f64) -> f64, elements: &str, settings: &str) -> (Estimate, String) {
    let folder = tempfile::tempdir().unwrap();
    let robot = "schema = 1\nname = \"turntable\"\n\
        body = [{ name = \"table\", parent = \"ground\", joint = { name = \"j1\", kind = \"revolute\", axis = [0, 0, 1] } }]\n";
    std::fs::write(folder.path().join("turntable.toml"), robot).unwrap();
    let mut log = String::from("t,q1,tau1\n");
    // Amplitudes and angular frequencies: no common period, at most 2 rad/s.
    let waves = [(0.9, 1.1), (0.35, 1.9), (0.08, 4.3)];
    let mut noise = 1_u64;
    for k in 0..8000 {
        let t = 0.005 * f64::from(k);
        let sum = |f: &dyn Fn(f64, f64) -> f64| waves.iter().map(|(a, w)| f(*a, *w)).sum::<f64>();
        let q = sum(&|a, w| a * (w * t).sin());
        let dq = sum(&|a, w| a * w * (w * t).cos());
        let ddq = sum(&|a, w| -a * w * w * (w * t).sin());
        noise = noise.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let error = 0.2 * ((noise >> 11) as f64 / (1_u64 << 53) as f64 - 0.5);
        log.push_str(&format!("{t},{q},{}\n", INERTIA * ddq + OFFSET + friction(dq) + error));
    }
    std::fs::write(folder.path().join("log.csv"), log).unwrap();
    let path = |name: &str| folder.path().join(name).display().to_string();
    let text = format!(
        "robot = \"{}\"\npreflight = \"warn\"\n[elements]\ndefault = {elements}\n{settings}[[log]]\npath = \"{}\"\n",
        path("turntable.toml"),
        path("log.csv")
    );
    let config = Config::parse(&text, "test").unwrap();
    let identification = identify(&config, &mut |_| {}).unwrap();
    let estimate = identification.estimate();
    let page = identification.report(&estimate).unwrap();
    let file = folder.path().join("estimate.json");
    std::fs::write(&file, estimate.to_json()).unwrap();
    let back = Estimate::read(&file).unwrap();
    assert_eq!(back.to_json(), estimate.to_json());
    assert_eq!(back.friction_passivity, estimate.friction_passivity);
    (back, page)
}

fn only(estimate: &Estimate) -> &PassivityRecord {
    let [record] = &estimate.friction_passivity[..] else { panic!("{:?}", estimate.friction_passivity) };
    assert_eq!(record.joint, "j1");
    record
}

fn about_friction(estimate: &Estimate) -> Vec<&String> {
    estimate.verdict.warnings.iter().filter(|w| w.contains("friction of `j1`")).collect()
}

/// The law of the second joint of the ER-16 acts against the motion up to 1.496 rad/s.
#[test]
fn a_law_that_drives_the_motion_is_told_with_a_remedy() {
    let law = |v: f64| -2.8909 * v.signum() - 70.0174 * v + 70.0243 * (19.7363 * v).atan();
    let (estimate, page) = identified(
        law,
        "[\"coulomb\", \"viscous\", \"offset\", \"arctangent\"]\nfriction = \"given\"",
        "[estimator]\nconsistency = \"none\"\n",
    );
    let record = only(&estimate);
    assert_eq!(record.passivity.word(), "passive on");
    let (_, last) = *record.intervals.last().unwrap();
    assert!((last / 1.496 - 1.0).abs() < 0.02, "{record:?}");
    let (low, high) = record.velocity_range;
    assert!((1.99..2.0).contains(&high) && (-2.0..-1.99).contains(&low), "{record:?}");
    let (v, power) = (record.worst_velocity.unwrap(), record.worst_power.unwrap());
    assert!(v == low && -low > high && (power / (-v * law(v)) - 1.0).abs() < 0.1, "{record:?}");

    let [warning] = about_friction(&estimate)[..] else { panic!("{:?}", estimate.verdict.warnings) };
    assert!(warning.contains("drives the motion, most at -2 rad/s") && warning.contains("--friction linear"));
    assert!(warning.contains("`j1.fv`") && warning.contains("consistency and bound"), "{warning}");

    assert!(page.contains("Parameters that enter nonlinearly"));
    let row = page.split("<tr><td>j1.fb</td>").nth(1).unwrap().split("</tr>").next().unwrap();
    assert!(row.contains("seen in the data") && row.contains("s&#x2f;rad"), "{row}");
    assert!(page.contains("<figcaption>j1: coulomb + viscous + arctangent</figcaption>"));
    assert!(page.contains("<svg class=\"chart\"") && page.contains("drives the motion</span>"));
    assert!(page.contains("Passive from -1."), "the passive range in words");
}

#[test]
fn static_friction_below_coulomb_friction_is_told() {
    let law = |v: f64| v.signum() * (9.0 - 4.0 * (-(v / 0.25).powi(2)).exp()) + 2.0 * v;
    let (estimate, page) =
        identified(law, "[\"stribeck\", \"viscous\", \"offset\"]\nfriction = \"given\"", "");
    let record = only(&estimate);
    assert!(record.passivity.word() == "passive" && record.static_below_coulomb, "{record:?}");
    assert_eq!((record.intervals.len(), record.worst_velocity, record.worst_power), (0, None, None));
    let [warning] = about_friction(&estimate)[..] else { panic!("{:?}", estimate.verdict.warnings) };
    assert!(warning.contains("below Coulomb friction") && warning.contains("`j1.fs`"), "{warning}");
    assert!(page.contains("all that the training logs reach. Static friction is identified below Coulomb"));
    assert!(!page.contains("drives the motion</span>"));
}

#[test]
fn linear_friction_leaves_tables_and_pictures_out() {
    let law = |v: f64| 9.0 * v.signum() + 2.0 * v;
    let (estimate, page) =
        identified(law, "[\"coulomb\", \"viscous\", \"offset\"]\nfriction = \"given\"", "");
    let record = only(&estimate);
    assert!(record.passivity.word() == "passive" && !record.static_below_coulomb, "{record:?}");
    assert_eq!(about_friction(&estimate), [] as [&String; 0]);
    assert!(estimate.shape_parameters.is_empty() && estimate.conditioning.friction_trials.is_empty());
    for absent in ["Nonlinear friction", "enter nonlinearly", "Friction shapes tried", "<svg class=\"chart\""]
    {
        assert!(!page.contains(absent), "{absent}");
    }
}

/// Friction that is twice as large at rest, found by itself.
#[test]
fn shapes_that_were_tried_stand_in_the_report() {
    let law = |v: f64| v.signum() * (6.0 + 6.0 * (-(v / 0.25).powi(2)).exp()) + 2.0 * v;
    let (estimate, page) = identified(law, "[\"coulomb\", \"viscous\", \"offset\"]", "");
    let trials = &estimate.conditioning.friction_trials;
    assert!(trials.iter().any(|t| t.accepted) && trials.iter().any(|t| !t.accepted), "{trials:?}");
    let table = page.split("Friction shapes tried").nth(1).unwrap().split("</table>").next().unwrap();
    assert_eq!(table.matches("<tr").count(), 1 + trials.len());
    assert_eq!(table.matches("<tr class=\"chosen\"").count(), trials.iter().filter(|t| t.accepted).count());
    assert_eq!(
        page.matches("<svg class=\"chart\"").count(),
        usize::from(!estimate.shape_parameters.is_empty())
    );
}

#[test]
fn older_result_files_have_no_record_of_passivity() {
    let (estimate, _) =
        identified(|v| 9.0 * v.signum(), "[\"coulomb\", \"offset\"]\nfriction = \"given\"", "");
    let mut json: serde_json::Value = serde_json::from_str(&estimate.to_json()).unwrap();
    json.as_object_mut().unwrap().remove("friction_passivity");
    let older: Estimate = serde_json::from_value(json).unwrap();
    assert!(older.friction_passivity.is_empty());
}
