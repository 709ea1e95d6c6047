//! Recorded logs with default settings, against the plain fits of the data's READMEs on the same metric: RMS of effort and
//! prediction through the same filter on a part of the record (or another record) that was not fitted.

#![expect(clippy::print_stdout, reason = "a test may stop, and says what it measured")]

use crate::support::{PANDA, TX40, UR10, UR10E, data, emps_robot, geometric_mean, on_validation, rms, run};
use dynid::estimators::conditioning::{JointFriction, ShapeKind};
use dynid::model::EffortModel;

/// Runs a set and requires the geometric mean over joints of the RMS ratio to the baseline to stay below `limit`.
/// Prediction and effort are not aligned by the delay here, as in the baseline.
fn check(
    name: &str,
    text: &str,
    parameters: usize,
    filter_hz: f64,
    baseline: &[f64],
    limit: f64,
) -> Option<dynid::Run> {
    let (config, id) = run(text)?;
    // A power stands in place of viscous friction, the other shapes beside what is there.
    let adds =
        |joint: &JointFriction| joint.accepted.iter().filter(|t| t.shape.kind != ShapeKind::Power).count();
    let shaped: usize = id.friction.iter().map(adds).sum();
    let table = &id.model.parameters().linear;
    let cyclic = 2 * id.cyclic.len();
    let searched = id.base.kept.iter().filter(|c| table[**c].name.ends_with("(change)")).count();
    assert_eq!(id.base.len(), parameters + shaped + cyclic + searched, "{name}: base parameters");
    let agreement = on_validation(&config, &id, filter_hz);
    let ratio = |fit| geometric_mean(rms(fit).iter().zip(baseline).map(|(r, b)| r / b));
    let (plain, aligned) = (ratio(&agreement.filtered_unaligned), ratio(&agreement.filtered));
    let short: Vec<String> = rms(&agreement.filtered_unaligned).iter().map(|r| format!("{r:.3}")).collect();
    println!(
        "{name}: rms {} ratio {plain:.3}, aligned {aligned:.3}; kernel {:.1} Hz, delay {:.2} samples",
        short.join(" "),
        id.kernel_hz,
        id.delay_samples
    );
    for (output, joint) in id.model.outputs().iter().zip(&id.friction) {
        for taken in &joint.accepted {
            let (kind, percent) = (taken.shape.kind, 100.0 * taken.gain);
            let errors = taken.gain / taken.standard_error;
            println!(
                "  {}: {kind:?} {:.3}, held-out mean square falls by {percent:.0} %, {errors:.1} standard errors",
                output.name, taken.shape.value
            );
        }
    }
    for joint in &id.cyclic {
        let (found, name) = (&joint.found, &id.model.outputs()[joint.output].name);
        let kind = if found.is_friction { "friction" } else { "torque" };
        println!(
            "  {name}: cyclic {kind}, {:.2} a turn, {:.3}, held-out mean square falls by {:.0} ± {:.0} %",
            found.cycles,
            found.amplitude,
            100.0 * found.gain,
            100.0 * found.standard_error
        );
    }
    assert!(plain <= limit, "{name}: {plain} above {limit}");
    Some(id)
}

#[test]
fn panda() {
    check("panda-gaz2019", PANDA, 64, 5.0, &[0.139, 0.162, 0.121, 0.176, 0.077, 0.047, 0.057], 0.75);
}

#[test]
fn ur10e() {
    check("ur10e-innopolis", UR10E, 58, 8.0, &[2.74, 4.22, 1.87, 0.376, 0.471, 0.407], 0.55);
}

/// Logs of one joint at a time, six times as long as the others together, in which the rest holds still by friction.
#[test]
fn ur10e_with_logs_of_single_joints() {
    let single =
        |joint| format!("[[log]]\npath = \"{{data}}/ur10e-innopolis/20_01_22-joint_{joint}.csv.gz\"\n");
    let singles: String = (1..=6).map(single).collect();
    let text = UR10E.replace("[[validation]]", &format!("{singles}[[validation]]"));
    let baseline = [2.74, 4.22, 1.87, 0.376, 0.471, 0.407];
    let Some(id) = check("ur10e-innopolis with single joints", &text, 58, 8.0, &baseline, 0.75) else {
        return;
    };
    assert_ne!(id.estimate().verdict.status.word(), "fail");
    let doubts: Vec<_> = id.findings.iter().filter(|f| f.id.word() == "drive_gain").collect();
    assert!(doubts.is_empty(), "arms at rest show no gravity: {doubts:?}");
}

#[test]
fn staubli_tx40_with_its_coupled_wrist() {
    check("staubli-tx40", TX40, 61, 40.0, &[4.15, 5.69, 3.69, 1.40, 2.15, 1.29], 0.65);
}

#[test]
fn ur10_unisa() {
    check("ur10-unisa", UR10, 58, 5.0, &[3.57, 3.78, 2.34, 0.907, 0.481, 1.08], 0.55);
}

#[test]
fn rokae_run_b() {
    check(
        "rokae-xmate run_b",
        r#"
robot = "{data}/rokae-xmate/xmate_kinematics.urdf"
[columns]
rate_hz = 1000
[[log]]
path = "{data}/rokae-xmate/run_b.csv.gz"
part = [0.0, 0.7]
[[validation]]
path = "{data}/rokae-xmate/run_b.csv.gz"
part = [0.7, 1.0]
"#,
        69,
        5.0,
        &[0.289, 0.416, 0.181, 0.301, 0.134, 0.132, 0.181],
        1.0,
    );
}

/// One sliding axis; its robot file has no inertia, so the moving mass is the only rigid parameter.
const EMPS: &str = r#"
robot = "{robot}"
[columns]
position = ["qm"]
effort = { columns = ["vir"], scale = 35.15065188 }
[elements]
default = ["coulomb", "viscous", "offset"]
"#;

#[test]
fn emps_with_default_settings() {
    let robot = emps_robot();
    let text = EMPS.replace("{robot}", &robot.path().display().to_string())
        + r#"
[[log]]
path = "{data}/emps/emps_identification.csv.gz"
part = [0.0, 0.5]
[[validation]]
path = "{data}/emps/emps_identification.csv.gz"
part = [0.5, 1.0]
"#;
    check("emps", &text, 4, 100.0, &[2.38], 0.9);
}

/// The benchmark's own pipeline: published IDIM-LS values within their printed standard deviations.
#[test]
fn emps_by_the_textbook_route_gives_the_published_values() {
    let robot = emps_robot();
    let text = EMPS.replace("{robot}", &robot.path().display().to_string())
        + r#"
[conditioning]
route = "textbook"
kernel_hz = 100
decimation = 10
parallel_filter = true
filter_effort = false
trim_s = 0.049
remove_spikes = false
[estimator]
method = "ols"
[[log]]
path = "{data}/emps/emps_identification.csv.gz"
"#;
    let Some((_, id)) = run(&text) else { return };
    let estimate = id.estimate();
    let published = [
        ("carriage.m", 95.1089, 0.1085),
        ("x.fc", 20.3935, 0.1012),
        ("x.fv", 203.5034, 1.1460),
        ("x.fo", -3.1648, 0.0444),
    ];
    for (name, value, spread) in published {
        let found = estimate.parameters.iter().find(|p| p.name == name).unwrap().value;
        println!("{name}: {found:.4} published {value} ± {spread}");
        assert!((found - value).abs() <= spread, "{name}: {found} against {value} ± {spread}");
    }
}

/// The three coupling columns are what the wrist needs: without them joint 5 is three times worse.
#[test]
fn staubli_tx40_without_coupling_is_worse() {
    let text = |coupling: &str| {
        format!(
            r#"
robot = "{{data}}/staubli-tx40/tx40.urdf"
[columns]
rate_hz = 5000
position = "qm{{}}"
effort = {{ columns = "im{{}}" }}
[motor_side]
matrix = [
  [32.0, 0, 0, 0, 0, 0], [0, 32.0, 0, 0, 0, 0], [0, 0, 45.0, 0, 0, 0],
  [0, 0, 0, -48.0, 0, 0], [0, 0, 0, 0, 45.0, 0], [0, 0, 0, 0, 32.0, 32.0],
]
offset = [0, -1.5707963267948966, 1.5707963267948966, 0, 0, 0]
{coupling}
[conditioning]
route = "textbook"
kernel_hz = 40
decimation = 50
trim_s = 0.1
remove_spikes = false
[estimator]
method = "ols"
[[log]]
path = "{{data}}/staubli-tx40/motor_log.csv.gz"
"#
        )
    };
    let coupling = r#"
[[coupling]]
motors = ["m5", "m6"]
joints = ["joint_5", "joint_6"]
matrix = [[45.0, 0.0], [32.0, 32.0]]
form = "columns"
"#;
    if data().is_none() {
        return;
    }
    let (_, with) = run(&text(coupling)).unwrap();
    let (_, without) = run(&text("")).unwrap();
    let rows = |id: &dynid::Run| id.row_rms.iter().map(|r| r.unwrap()).collect::<Vec<f64>>();
    let (with, without) = (rows(&with), rows(&without));
    println!("with {with:.3?}, without {without:.3?}");
    // README, same pipeline: 2.63 3.30 2.30 0.940 1.48 0.874 with the three terms, joint 5 4.44 without. One-sided: signs
    // of velocity during standstill are chance on this route, and joints 2 and 3 come out a tenth lower here.
    for (found, expected) in with.iter().zip([2.63, 3.30, 2.30, 0.940, 1.48, 0.874]) {
        assert!(found / expected <= 1.05, "{found} against {expected}");
    }
    assert!(without[4] > 2.5 * with[4]);
}
