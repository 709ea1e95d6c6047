//! Keys of an identification.

use std::fmt::Write as _;
use std::path::Path;
use std::sync::OnceLock;

use dynid::simulate::{SimulateSettings, SimulatedLog, simulate};
use dynid::{Config, Robot, RobotOptions, identify};
use tempfile::TempDir;

use super::{Case, Changes, Expect, Refused, Text, beside, keys, log, table, top, valid, walk};

/// Two links in the vertical plane; the second has a brother that may follow it.
pub(super) const ARM: &str = r#"
schema = 1
name = "arm"
gravity = [0, -9.81, 0]
dh = "modified"
[[joint]]
name = "j1"
link = "link1"
limits = { position = [-2, 2], velocity = 3, effort = 100 }
phi = [3, 0.6, 0.03, 0.02, 0.1, 0, 0, 0.2, 0, 0.22]
[[joint]]
name = "j2"
link = "link2"
a = 0.4
limits = { position = [-2, 2], velocity = 3, effort = 100 }
phi = [1.5, 0.25, 0.02, 0.01, 0.02, 0, 0, 0.06, 0, 0.07]
[defaults]
elements = ["coulomb", "viscous", "offset"]
"#;

const STRIBECK_LAW: &str = "[element.j1]\nstribeck = { coulomb = 2, static = 5, vs = 0.3 }\n\
                            [element.j2]\nstribeck = { coulomb = 1, static = 2, vs = 0.3 }\n";

/// The two-joint arm as a URDF in which the second joint follows the first where it is coupled.
const MIMIC: &str = r#"<robot name="arm"><link name="base"/>
<link name="link1"><inertial><origin xyz="0.2 0 0"/><mass value="3"/><inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/></inertial></link>
<link name="link2"><inertial><origin xyz="0.2 0 0"/><mass value="1"/><inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/></inertial></link>
<joint name="j1" type="revolute"><parent link="base"/><child link="link1"/><axis xyz="0 0 1"/><limit lower="-2" upper="2" velocity="3" effort="100"/></joint>
<joint name="j2" type="revolute"><parent link="link1"/><child link="link2"/><origin xyz="0.4 0 0"/><axis xyz="0 0 1"/><limit lower="-2" upper="2" velocity="3" effort="100"/><mimic joint="j1"/></joint>
</robot>"#;

pub(super) fn csv(log: &SimulatedLog) -> String {
    let mut columns: Vec<(String, &[f64])> = vec![("t".to_owned(), &log.time)];
    let signals = [("q", &log.position), ("tau", &log.effort), ("qref", &log.clean[0])];
    for (name, signal) in signals {
        columns.extend(log.joints.iter().zip(signal).map(|(j, x)| (format!("{name}_{j}"), x.as_slice())));
    }
    let mut text = columns.iter().map(|(name, _)| name.as_str()).collect::<Vec<_>>().join(",") + "\n";
    for row in 0..log.time.len() {
        let cells: Vec<String> = columns.iter().map(|(_, x)| x[row].to_string()).collect();
        writeln!(text, "{}", cells.join(",")).unwrap();
    }
    text
}

/// Cells of a table changed by row and column.
fn edited(text: &str, edit: impl Fn(usize, usize, &str) -> Option<String>) -> String {
    let rows = text.lines().enumerate().map(|(row, line)| {
        let cells = line.split(',').enumerate();
        cells.filter_map(|(k, cell)| edit(row, k, cell)).collect::<Vec<String>>().join(",")
    });
    rows.collect::<Vec<String>>().join("\n") + "\n"
}

/// A folder with robots and logs.
pub(super) fn folder() -> &'static TempDir {
    static FOLDER: OnceLock<TempDir> = OnceLock::new();
    FOLDER.get_or_init(|| {
        let folder = tempfile::tempdir().unwrap();
        let robot = Robot::parse(ARM, Path::new("arm.toml"), &RobotOptions::default()).unwrap();
        let simulated = |seed| {
            let settings = SimulateSettings {
                duration_s: 6.0,
                rate_hz: 100.0,
                period_s: Some(3.0),
                seed,
                ..Default::default()
            };
            csv(&simulate(&robot, &settings).unwrap())
        };
        let (a, b, v) = (simulated(1), simulated(2), simulated(3));
        let whole = |cell: &str| Some(cell.to_owned());
        let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
        let settings = SimulateSettings { duration_s: 6.0, rate_hz: 100.0, ..Default::default() };
        let stribeck = ARM.replace("\"coulomb\"", "\"stribeck\"") + STRIBECK_LAW;
        let stribeck = Robot::parse(&stribeck, Path::new("arm.toml"), &RobotOptions::default()).unwrap();
        write("stribeck.csv", &csv(&simulate(&stribeck, &settings).unwrap()));
        write("arm.toml", ARM);
        let bearing = "clearance = { journal_radius = 0.02, gap = 1e-4, width = 0.03 }";
        write("loose.toml", &format!("{ARM}\n[element.j1]\n{bearing}\n"));
        write("longer.toml", &ARM.replace("a = 0.4", "a = 0.5"));
        let heavy =
            ARM.replace("phi = [3, 0.6, ", "phi = [60, 12, ").replace("phi = [1.5, 0.25, ", "phi = [30, 5, ");
        write("heavy.toml", &heavy);
        write("mimic.urdf", MIMIC);
        write("a.csv", &a);
        write("b.csv", &b);
        write("v.csv", &v);
        write("no-j2.csv", &edited(&a, |_, k, cell| if [2, 4, 6].contains(&k) { None } else { whole(cell) }));
        write(
            "no-effort.csv",
            &edited(&a, |_, k, cell| if [3, 4].contains(&k) { None } else { whole(cell) }),
        );
        let spike = |row, k, cell: &str| whole(if (row, k) == (300, 3) { "90.0" } else { cell });
        write("spike.csv", &edited(&a, spike));
        // An effort is missing in a row.
        let hole = |row, k, cell: &str| whole(if (row, k) == (200, 3) { "" } else { cell });
        write("hole.csv", &edited(&a, hole));
        write("headless.csv", a.split_once('\n').unwrap().1);
        let semicolons = a.replace(',', ";").replace('.', ",");
        write("commas.csv", &semicolons);
        let mut last: Vec<String> = Vec::new();
        let repeated = a.lines().enumerate().map(|(row, line)| {
            let mut cells: Vec<String> = line.split(',').map(str::to_owned).collect();
            // Every tenth row repeats the one before.
            if row > 1 && row % 10 == 0 {
                cells[1..].clone_from_slice(&last[1..]);
            }
            last.clone_from(&cells);
            cells.join(",")
        });
        let repeated: Vec<String> = repeated.collect();
        write("repeated.csv", &(repeated.join("\n") + "\n"));
        folder
    })
}

/// What an identification found, without what only repeats the configuration.
fn outcome(file: &str, text: &str) -> Result<String, String> {
    let path = folder().path().join(file);
    std::fs::write(&path, text).unwrap();
    let run = || {
        let config = Config::read(&path)?;
        Ok(identify(&config, &mut |_| {})?.estimate())
    };
    let estimate: dynid::Estimate = run().map_err(|e: dynid::Error| e.to_string())?;
    let mut json: serde_json::Value = serde_json::from_str(&estimate.to_json()).unwrap();
    for echo in ["provenance", "conditioning", "model", "preflight"] {
        json.as_object_mut().unwrap().remove(echo);
    }
    Ok(json.to_string())
}

fn run(text: &Text) -> Result<String, String> {
    let Text { top, log, valid, tables } = text;
    let default = |given: &str, key: &str, value: &str| match given.contains(key) {
        true => String::new(),
        false => format!("{key} = \"{value}\"\n"),
    };
    outcome(
        "run.toml",
        &format!(
            "{}{top}\n{tables}\n[[log]]\n{}{log}\n[[log]]\npath = \"b.csv\"\n[[validation]]\n{}{valid}\n",
            default(top, "robot", "arm.toml"),
            default(log, "path", "a.csv"),
            default(valid, "path", "v.csv"),
        ),
    )
}

const LOOP: &str = "[instruments]\nreference = \"qref_{joint}\"\n";
const STRIBECK: &str = "[elements]\nfriction = \"stribeck\"\n";
const SEARCHED: &str =
    "[elements]\nfriction = \"stribeck\"\n[estimator.shape]\nsearch = \"pso\"\nevaluations = 50";
const TOOL: &str = "[[payload]]\nname = \"tool\"\n";
const COUPLING: &str =
    "[[coupling]]\nmotors = [\"m1\", \"m2\"]\njoints = [\"j1\", \"j2\"]\nmatrix = [[50, 0], [40, 40]]\n";

fn cases() -> Vec<Case> {
    let with = |key, before, after, expect| Case { key, before, after, expect };
    let text = |top, log, valid, tables| Text { top, log, valid, tables };
    let loops = |key, after, expect| beside(key, LOOP, after, expect);
    let carried = |key, before, after, expect| {
        let of = |tables| text("", "payload = \"tool\"", "", tables);
        with(key, of(before), of(after), expect)
    };
    let shaped = |key, after, expect| beside(key, STRIBECK, after, expect);
    vec![
        top("robot", "robot = \"longer.toml\"", Changes),
        with("seed", text("", "", "", STRIBECK), text("seed = 7", "", "", STRIBECK), Changes),
        top("gravity", "gravity = [0, -9.7, 0]", Changes),
        with(
            "known_effort_scale",
            text("robot = \"heavy.toml\"", "", "", ""),
            text("robot = \"heavy.toml\"\nknown_effort_scale = true", "", "", ""),
            Changes,
        ),
        carried("known_mass", TOOL, "[[payload]]\nname = \"tool\"\n[known_mass]\ntool = 1.2", Changes),
        table("known_mass", "[known_mass]\nlink2 = -1", Refused("known_mass.link2")),
        table("known_mass", "[known_mass]\nlink9 = 1", Refused("a link: link1, link2")),
        with(
            "couple_mimics",
            text("robot = \"mimic.urdf\"", "", "", ""),
            text("robot = \"mimic.urdf\"\ncouple_mimics = true", "", "", ""),
            Changes,
        ),
        table("locked", "[locked]\nj2 = 0.1", Changes),
        table("elements.default", "[elements]\ndefault = [\"viscous\"]", Changes),
        table("elements.joint", "[elements.joint]\nj1 = [\"viscous\"]", Changes),
        table("elements.friction", STRIBECK, Changes),
        beside(
            "elements.friction",
            "[elements]\ndefault = [\"rotor\"]",
            "[elements]\ndefault = [\"rotor\"]\nfriction = \"stribeck\"",
            Refused("a joint with friction"),
        ),
        table("elements.known_friction", "[elements]\nknown_friction = \"none.json\"", Refused("none.json")),
        table(
            "elements.friction_errors",
            "[elements]\nfriction_errors = \"nonnegative\"",
            Refused("known_friction"),
        ),
        table("elements.temperature", "[elements]\ntemperature = 30.0", Refused("known_friction")),
        table("elements.clearance", "[elements]\nclearance = \"ideal\"", Refused("`clearance` at a joint")),
        with(
            "elements.clearance",
            text("robot = \"loose.toml\"", "", "", ""),
            text("robot = \"loose.toml\"", "", "", "[elements]\nclearance = \"ideal\""),
            Changes,
        ),
        table("coupling.motors", COUPLING, Changes),
        table(
            "coupling.joints",
            "[[coupling]]\nmotors = [\"m1\"]\njoints = [\"j9\"]\nmatrix = [[50]]",
            Refused("j9"),
        ),
        beside(
            "coupling.matrix",
            COUPLING,
            "[[coupling]]\nmotors = [\"m1\", \"m2\"]\njoints = [\"j1\", \"j2\"]\nmatrix = [[50, 0], [30, 40]]",
            Changes,
        ),
        beside(
            "coupling.form",
            COUPLING,
            "[[coupling]]\nmotors = [\"m1\", \"m2\"]\njoints = [\"j1\", \"j2\"]\nmatrix = [[50, 0], [40, 40]]\nform = \"columns\"",
            Changes,
        ),
        with(
            "columns.time",
            text("preflight = \"off\"", "", "", ""),
            text("preflight = \"off\"", "", "", "[columns]\ntime = { columns = \"t\", scale = 2.0 }"),
            Changes,
        ),
        beside(
            "columns.time",
            "[columns]\nrate_hz = 100",
            "[columns]\nrate_hz = 100\ntime = \"t\"",
            Refused("time"),
        ),
        with(
            "columns.rate_hz",
            text("preflight = \"off\"", "", "", ""),
            text("preflight = \"off\"", "", "", "[columns]\nrate_hz = 90"),
            Changes,
        ),
        with(
            "columns.position",
            text("preflight = \"off\"", "", "", ""),
            text(
                "preflight = \"off\"",
                "",
                "",
                "[columns]\nposition = { columns = \"q_{joint}\", scale = 1.1 }",
            ),
            Changes,
        ),
        table("columns.velocity", "[columns]\nvelocity = \"v{}\"", Refused("v1")),
        table("columns.acceleration", "[columns]\nacceleration = \"a{}\"", Refused("a1")),
        table("columns.effort", "[columns]\neffort = { columns = \"tau_{joint}\", scale = 1.1 }", Changes),
        table("columns.temperature", "[columns]\ntemperature = \"T{}\"", Refused("T1")),
        table(
            "columns.channels.column",
            "[columns.channels]\nfan = { column = \"qref_j1\" }",
            Refused("no element of this robot reads one"),
        ),
        table(
            "columns.channels.scale",
            "[columns.channels]\nfan = { column = \"t\", scale = 2 }",
            Refused("reads one"),
        ),
        table(
            "columns.channels.offset",
            "[columns.channels]\nfan = { column = \"t\", offset = 2 }",
            Refused("reads one"),
        ),
        table("columns.current_gains", "[columns]\ncurrent_gains = [10, 10]", Refused("current_gains")),
        with(
            "columns.allow_unlogged",
            text("", "path = \"no-j2.csv\"", "", ""),
            text("", "path = \"no-j2.csv\"", "", "[columns]\nallow_unlogged = true"),
            Changes,
        ),
        with(
            "columns.allow_no_effort",
            text("", "path = \"no-effort.csv\"", "", ""),
            text("", "path = \"no-effort.csv\"", "", "[columns]\nallow_no_effort = true"),
            Changes,
        ),
        table("columns.ignore", "[columns]\nignore = [\"q_j1\"]", Refused("j1")),
        table("columns.names", "[columns]\nnames = [\"t\", \"q_j1\"]", Refused("names")),
        with(
            "columns.names",
            text("", "path = \"headless.csv\"", "", "[columns]\nrate_hz = 100"),
            text(
                "",
                "path = \"headless.csv\"",
                "",
                "[columns]\nnames = [\"t\", \"q_j1\", \"q_j2\", \"tau_j1\", \"tau_j2\", \"x\", \"y\"]",
            ),
            Changes,
        ),
        with(
            "columns.decimal",
            text("", "path = \"commas.csv\"", "", ""),
            text("", "path = \"commas.csv\"", "", "[columns]\ndecimal = \".\""),
            Refused("expected a number, found `0,"),
        ),
        with(
            "columns.missing",
            text("", "path = \"hole.csv\"", "", ""),
            text("", "path = \"hole.csv\"", "", "[columns]\nmissing = \"drop\""),
            Changes,
        ),
        table("motor_side.matrix", "[motor_side]\nmatrix = [[2, 0], [0, 2]]", Changes),
        beside(
            "motor_side.offset",
            "[motor_side]\nmatrix = [[1, 0], [0, 1]]",
            "[motor_side]\nmatrix = [[1, 0], [0, 1]]\noffset = [0.05, 0]",
            Changes,
        ),
        table("conditioning.route", "[conditioning]\nroute = \"textbook\"", Changes),
        table("conditioning.kernel_hz", "[conditioning]\nkernel_hz = 6", Changes),
        table("conditioning.state_hz", "[conditioning]\nstate_hz = 30", Changes),
        beside(
            "conditioning.state_hz",
            "",
            "[conditioning]\nroute = \"textbook\"\nstate_hz = 30",
            Refused("route = \"compact\""),
        ),
        table("conditioning.delay_samples", "[conditioning]\ndelay_samples = 1", Changes),
        beside(
            "conditioning.delay_samples",
            "",
            "[conditioning]\nroute = \"textbook\"\ndelay_samples = 1",
            Refused("compact"),
        ),
        table("conditioning.reversal_mask", "[conditioning]\nreversal_mask = 0.2", Changes),
        beside(
            "conditioning.reversal_mask",
            "",
            "[conditioning]\nroute = \"textbook\"\nreversal_mask = 0.2",
            Refused("compact"),
        ),
        with(
            "conditioning.remove_spikes",
            text("preflight = \"off\"", "path = \"spike.csv\"", "", ""),
            text("preflight = \"off\"", "path = \"spike.csv\"", "", "[conditioning]\nremove_spikes = false"),
            Changes,
        ),
        table("conditioning.block_s", "[conditioning]\nblock_s = 0.5", Changes),
        table("conditioning.decimation", "[conditioning]\ndecimation = 3", Refused("route = \"textbook\"")),
        table("conditioning.parallel_filter", "[conditioning]\nparallel_filter = true", Refused("textbook")),
        table("conditioning.filter_effort", "[conditioning]\nfilter_effort = false", Refused("textbook")),
        table("conditioning.trim_s", "[conditioning]\ntrim_s = 0.4", Refused("textbook")),
        beside(
            "conditioning.decimation",
            TEXTBOOK,
            "[conditioning]\nroute = \"textbook\"\ndecimation = 3",
            Changes,
        ),
        beside(
            "conditioning.parallel_filter",
            "[conditioning]\nroute = \"textbook\"\ndecimation = 3",
            "[conditioning]\nroute = \"textbook\"\ndecimation = 3\nparallel_filter = true",
            Changes,
        ),
        beside(
            "conditioning.filter_effort",
            TEXTBOOK,
            "[conditioning]\nroute = \"textbook\"\nfilter_effort = false",
            Changes,
        ),
        beside(
            "conditioning.smoothing",
            TEXTBOOK,
            "[conditioning]\nroute = \"textbook\"\nsmoothing = \"five-point\"",
            Changes,
        ),
        beside("conditioning.smoothing", TEXTBOOK, POLYNOMIALS, Changes),
        with(
            "conditioning.smoothing",
            text("period_s = 3", "", "", TEXTBOOK),
            text("period_s = 3", "", "", FREQUENCY),
            Changes,
        ),
        table("conditioning.smoothing", "[conditioning]\nsmoothing = \"butterworth\"", Refused("textbook")),
        table("conditioning.smoothing", FREQUENCY, Refused("log.period_s")),
        beside(
            "conditioning.effort_smoothing",
            TEXTBOOK,
            "[conditioning]\nroute = \"textbook\"\neffort_smoothing = \"five-point\"",
            Changes,
        ),
        table(
            "conditioning.effort_smoothing",
            "[conditioning]\nroute = \"textbook\"\neffort_smoothing = \"five-point\"\nfilter_effort = false",
            Refused("filter_effort = true"),
        ),
        table(
            "conditioning.effort_smoothing",
            "[conditioning]\neffort_smoothing = \"five-point\"",
            Refused("textbook"),
        ),
        beside(
            "conditioning.passes",
            "[conditioning]\nroute = \"textbook\"\nsmoothing = \"five-point\"",
            "[conditioning]\nroute = \"textbook\"\nsmoothing = \"five-point\"\npasses = 5",
            Changes,
        ),
        table(
            "conditioning.passes",
            "[conditioning]\nroute = \"textbook\"\nsmoothing = \"five-point\"\npasses = 0",
            Refused("1 or more"),
        ),
        table(
            "conditioning.passes",
            "[conditioning]\nroute = \"textbook\"\npasses = 3",
            Refused("smoothing = \"five-point\""),
        ),
        table("conditioning.passes", "[conditioning]\npasses = 3", Refused("textbook")),
        beside(
            "conditioning.window",
            POLYNOMIALS,
            "[conditioning]\nroute = \"textbook\"\nsmoothing = \"savitzky-golay\"\nwindow = 15",
            Changes,
        ),
        table(
            "conditioning.window",
            "[conditioning]\nroute = \"textbook\"\nsmoothing = \"savitzky-golay\"\nwindow = 10",
            Refused("an odd number of samples, 3 to 100001, found 10"),
        ),
        table(
            "conditioning.window",
            "[conditioning]\nroute = \"textbook\"\nsmoothing = \"savitzky-golay\"",
            Refused("found none"),
        ),
        table(
            "conditioning.window",
            "[conditioning]\nroute = \"textbook\"\nsmoothing = \"savitzky-golay\"\nwindow = 9001",
            Refused("expected at least 9001 samples"),
        ),
        table(
            "conditioning.window",
            "[conditioning]\nroute = \"textbook\"\nsmoothing = \"five-point\"\nwindow = 11",
            Refused("smoothing = \"savitzky-golay\""),
        ),
        table("conditioning.window", "[conditioning]\nwindow = 11", Refused("textbook")),
        beside(
            "conditioning.order",
            POLYNOMIALS,
            "[conditioning]\nroute = \"textbook\"\nsmoothing = \"savitzky-golay\"\nwindow = 11\norder = 4",
            Changes,
        ),
        table(
            "conditioning.order",
            "[conditioning]\nroute = \"textbook\"\nsmoothing = \"savitzky-golay\"\nwindow = 11\norder = 11",
            Refused("less than `window`, 11 samples, found 11"),
        ),
        table(
            "conditioning.order",
            "[conditioning]\nroute = \"textbook\"\nsmoothing = \"savitzky-golay\"\nwindow = 11\norder = 1",
            Refused("2 or more"),
        ),
        table(
            "conditioning.order",
            "[conditioning]\nroute = \"textbook\"\norder = 4",
            Refused("smoothing = \"savitzky-golay\""),
        ),
        table("conditioning.order", "[conditioning]\norder = 4", Refused("textbook")),
        with(
            "conditioning.harmonics",
            text("period_s = 3", "", "", FREQUENCY),
            text(
                "period_s = 3",
                "",
                "",
                "[conditioning]\nroute = \"textbook\"\nsmoothing = \"frequency\"\nharmonics = 12",
            ),
            Changes,
        ),
        with(
            "conditioning.harmonics",
            Text::default(),
            text(
                "period_s = 3",
                "",
                "",
                "[conditioning]\nroute = \"textbook\"\nsmoothing = \"frequency\"\nharmonics = 0",
            ),
            Refused("1 or more"),
        ),
        with(
            "conditioning.harmonics",
            Text::default(),
            text(
                "period_s = 3",
                "",
                "",
                "[conditioning]\nroute = \"textbook\"\nsmoothing = \"frequency\"\nharmonics = 150",
            ),
            Refused("less than half the samples of a period, found 150"),
        ),
        table(
            "conditioning.harmonics",
            "[conditioning]\nroute = \"textbook\"\nsmoothing = \"frequency\"\nharmonics = 9\nkernel_hz = 9",
            Refused("the one or the other"),
        ),
        table(
            "conditioning.harmonics",
            "[conditioning]\nroute = \"textbook\"\nharmonics = 9",
            Refused("smoothing = \"frequency\""),
        ),
        table("conditioning.harmonics", "[conditioning]\nharmonics = 9", Refused("textbook")),
        with(
            "conditioning.kernel_hz",
            text("period_s = 3", "", "", FREQUENCY),
            text(
                "period_s = 3",
                "",
                "",
                "[conditioning]\nroute = \"textbook\"\nsmoothing = \"frequency\"\nkernel_hz = 6",
            ),
            Changes,
        ),
        table(
            "conditioning.kernel_hz",
            "[conditioning]\nroute = \"textbook\"\nsmoothing = \"five-point\"\nkernel_hz = 6",
            Refused("smoothing = \"butterworth\""),
        ),
        with(
            "conditioning.average_periods",
            text("period_s = 3", "", "", TEXTBOOK),
            text("period_s = 3", "", "", AVERAGED),
            Changes,
        ),
        table("conditioning.average_periods", AVERAGED, Refused("log.period_s")),
        with(
            "conditioning.average_periods",
            Text::default(),
            text("period_s = 4", "", "", AVERAGED),
            Refused("expected two whole periods of 4 s"),
        ),
        with(
            "conditioning.average_periods",
            Text::default(),
            text("period_s = 2.996", "", "", AVERAGED),
            Refused("a whole number of samples to average, found 299.6"),
        ),
        table("conditioning.average_periods", "[conditioning]\naverage_periods = true", Refused("textbook")),
        beside(
            "conditioning.trim_s",
            TEXTBOOK,
            "[conditioning]\nroute = \"textbook\"\ntrim_s = 0.4",
            Changes,
        ),
        with(
            "preflight",
            text("", "", "", "[columns]\neffort = { columns = \"tau_{joint}\", scale = [-1, 1] }"),
            text(
                "preflight = \"warn\"",
                "",
                "",
                "[columns]\neffort = { columns = \"tau_{joint}\", scale = [-1, 1] }",
            ),
            Changes,
        ),
        table("estimator.method", "[estimator]\nmethod = \"huber\"", Changes),
        table("estimator.variances", "[estimator]\nvariances = \"joint\"", Changes),
        beside(
            "estimator.variances",
            "",
            "[estimator]\nmethod = \"ols\"\nvariances = \"joint\"",
            Refused("weights rows"),
        ),
        table("estimator.ridge_weight", "[estimator]\nridge_weight = 0.5", Refused("method = \"ridge\"")),
        beside(
            "estimator.ridge_weight",
            "[estimator]\nmethod = \"ridge\"",
            "[estimator]\nmethod = \"ridge\"\nridge_weight = 0.5",
            Changes,
        ),
        table("estimator.column_noise", "[estimator]\ncolumn_noise = { \"j1.fv\" = 0.1 }", Refused("tls")),
        beside(
            "estimator.column_noise",
            "[estimator]\nmethod = \"tls\"\neffort_noise = 0.5",
            "[estimator]\nmethod = \"tls\"\neffort_noise = 0.5\ncolumn_noise = { \"j1.fv\" = 0.1 }",
            Changes,
        ),
        table("estimator.effort_noise", "[estimator]\neffort_noise = 0.5", Refused("tls")),
        table("estimator.consistency", "[estimator]\nconsistency = \"none\"", Changes),
        table("estimator.prior", "[estimator]\nprior = \"entropic\"", Changes),
        beside(
            "estimator.prior",
            "",
            "[estimator]\nconsistency = \"none\"\nprior = \"entropic\"",
            Refused("consistency"),
        ),
        table("estimator.prior_weight", "[estimator]\nprior_weight = 5", Changes),
        with(
            "estimator.shape.evaluations",
            text("", "path = \"stribeck.csv\"", "", SEARCHED),
            text(
                "",
                "path = \"stribeck.csv\"",
                "",
                "[elements]\nfriction = \"stribeck\"\n[estimator.shape]\nsearch = \"pso\"\nevaluations = 400",
            ),
            Changes,
        ),
        table(
            "estimator.shape.evaluations",
            "[elements]\nfriction = \"stribeck\"\n[estimator.shape]\nevaluations = 50",
            Refused("search"),
        ),
        table(
            "estimator.shape.search",
            "[elements]\nfriction = \"given\"\n[estimator.shape]\nsearch = \"ics\"",
            Refused("shape parameter"),
        ),
        // Nothing to search is found on this log, which a warning says.
        table("estimator.shape.search", "[estimator.shape]\nsearch = \"ics\"\nevaluations = 50", Changes),
        with(
            "estimator.shape.search",
            text("", "path = \"stribeck.csv\"", "", STRIBECK),
            text("", "path = \"stribeck.csv\"", "", SEARCHED),
            Changes,
        ),
        shaped(
            "estimator.shape.starts",
            "[elements]\nfriction = \"stribeck\"\n[estimator.shape]\nstarts = 1",
            Changes,
        ),
        beside(
            "estimator.shape.starts",
            "",
            "[elements]\nfriction = \"stribeck\"\n[estimator.shape]\nsearch = \"pso\"\nstarts = 3",
            Refused("search"),
        ),
        table("estimator.search.algorithms", QUICK_SEARCH, Changes),
        table(
            "estimator.search.algorithms",
            "[estimator.search]\nruns = 2",
            Refused("at least one algorithm"),
        ),
        table("estimator.search.algorithms", "[estimator.search]\nalgorithms = [\"sa\"]", Refused("cma-es")),
        searched("over = \"standard\"", Changes),
        searched("loss = \"squared\"", Changes),
        searched("weights = { j1 = 3 }", Changes),
        searched("weights = { j9 = 3 }", Refused("j9")),
        searched("iterations = 3", Changes),
        searched("evaluations = 70", Changes),
        searched("population = 20", Changes),
        searched("runs = 2", Changes),
        searched("range = 2", Changes),
        searched("range = 0", Refused("a positive number")),
        searched("bounds = { \"j1.fc\" = [0, 2] }", Changes),
        searched("bounds = { \"j1.fc\" = [2, 0] }", Refused("in this order")),
        searched("bounds = { \"j9.fc\" = [0, 2] }", Refused("one of the unknowns")),
        searched("samples = 100", Changes),
        searched("samples = 0", Refused("at least 1")),
        table("instruments.reference", LOOP, Changes),
        table("instruments.reference_scale", "[instruments]\nreference_scale = 2.0", Refused("reference")),
        loops(
            "instruments.reference_scale",
            "[instruments]\nreference = \"qref_{joint}\"\nreference_scale = 1.05",
            Changes,
        ),
        table("instruments.trajectory", "[instruments]\ntrajectory = \"none.json\"", Refused("none.json")),
        loops(
            "instruments.trajectory",
            "[instruments]\nreference = \"qref_{joint}\"\ntrajectory = \"none.json\"",
            Refused("takes its place"),
        ),
        loops(
            "instruments.reference_velocity",
            "[instruments]\nreference = \"qref_{joint}\"\nreference_velocity = false",
            Changes,
        ),
        loops("instruments.rate_hz", "[instruments]\nreference = \"qref_{joint}\"\nrate_hz = 2000", Changes),
        loops(
            "instruments.bandwidth_hz",
            "[instruments]\nreference = \"qref_{joint}\"\nbandwidth_hz = 8",
            Changes,
        ),
        loops("instruments.damping", "[instruments]\nreference = \"qref_{joint}\"\ndamping = 0.7", Changes),
        beside(
            "instruments.damping",
            "",
            "[instruments]\nreference = \"qref_{joint}\"\nvelocity_gain = [50, 20]\ndamping = 0.7",
            Refused("velocity_gain"),
        ),
        loops(
            "instruments.position_gain",
            "[instruments]\nreference = \"qref_{joint}\"\nposition_gain = [900, 300]",
            Changes,
        ),
        loops(
            "instruments.velocity_gain",
            "[instruments]\nreference = \"qref_{joint}\"\nvelocity_gain = [50, 20]",
            Changes,
        ),
        loops(
            "instruments.velocity_cutoff_hz",
            "[instruments]\nreference = \"qref_{joint}\"\nvelocity_cutoff_hz = 40",
            Changes,
        ),
        loops(
            "instruments.feed_forward",
            "[instruments]\nreference = \"qref_{joint}\"\nfeed_forward = true",
            Changes,
        ),
        loops(
            "instruments.nominal",
            "[instruments]\nreference = \"qref_{joint}\"\nnominal = \"identified\"",
            Changes,
        ),
        loops(
            "instruments.delay_ticks",
            "[instruments]\nreference = \"qref_{joint}\"\ndelay_ticks = 2",
            Changes,
        ),
        loops(
            "instruments.effort_limit",
            "[instruments]\nreference = \"qref_{joint}\"\neffort_limit = [5, 5]",
            Changes,
        ),
        loops(
            "instruments.sign_width",
            "[instruments]\nreference = \"qref_{joint}\"\nsign_width = 0.05",
            Changes,
        ),
        loops("instruments.settled", "[instruments]\nreference = \"qref_{joint}\"\nsettled = 0.5", Changes),
        loops(
            "instruments.max_rounds",
            "[instruments]\nreference = \"qref_{joint}\"\nmax_rounds = 1",
            Changes,
        ),
        loops(
            "instruments.divergence",
            "[instruments]\nreference = \"qref_{joint}\"\ndivergence = 0.001",
            Changes,
        ),
        table("law.columns", RISING, Changes),
        table(
            "law.columns",
            "[law.mine]\ncolumns = { mk = \"sgn(v)\" }",
            Refused("law `mine`: column `mk`: `sgn(v)`, character 1: expected"),
        ),
        table(
            "law.columns",
            "[law.mine]\ncolumns = { mk = \"v\" }",
            Refused("found `mine`, which none does"),
        ),
        beside("law.shape", RISING, HELD, Changes),
        beside("law.friction", ALONE, NO_FRICTION, Changes),
        table("tie.equal", "[[tie]]\nequal = [\"j1.fc\", \"j2.fc\"]", Changes),
        table("tie.equal", "[[tie]]\nequal = [\"j1.fc\", \"j9.fc\"]", Refused("j9.fc")),
        beside(
            "tie.mirror",
            "[[tie]]\nequal = [\"link1\", \"link2\"]",
            "[[tie]]\nequal = [\"link1\", \"link2\"]\nmirror = \"x\"",
            Changes,
        ),
        table("tie.mirror", "[[tie]]\nmirror = \"x\"\nknown = { \"j1.fc\" = 1 }", Refused("equal")),
        table("tie.ratio", "[[tie]]\nratio = { \"j1.fc\" = 1, \"j2.fc\" = 2 }", Changes),
        table("tie.sum", "[[tie]]\nsum = { \"j1.fc\" = 1, \"j2.fc\" = 1 }\nvalue = 3", Changes),
        table("tie.sum", "[[tie]]\nsum = { \"j1.fc\" = 1, \"j2.fc\" = 1 }", Refused("what the sum is")),
        beside(
            "tie.value",
            "[[tie]]\nsum = { \"j1.fc\" = 1, \"j2.fc\" = 1 }\nvalue = 3",
            "[[tie]]\nsum = { \"j1.fc\" = 1, \"j2.fc\" = 1 }\nvalue = 4",
            Changes,
        ),
        table("tie.known", "[[tie]]\nknown = { \"j1.fc\" = 1 }", Changes),
        table("tie.massless", "[[tie]]\nmassless = [\"link2\"]", Changes),
        table("bound.links", "[[bound]]\nlinks = [\"link9\"]\nmass = [0, 1]", Refused("link9")),
        table("bound.mass", "[[bound]]\nlinks = [\"link2\"]\nmass = [0, 1]", Changes),
        table("bound.com_x", "[[bound]]\nlinks = [\"link2\"]\ncom_x = [0.3, 0.4]", Changes),
        table("bound.com_y", "[[bound]]\nlinks = [\"link2\"]\ncom_y = [0.3, 0.4]", Changes),
        table("bound.com_z", "[[bound]]\nlinks = [\"link2\"]\ncom_z = [0.3, 0.4]", Changes),
        table("bound.parameter", "[[bound]]\nparameter = \"j9.fc\"\nrange = [0, 1]", Refused("j9.fc")),
        table("bound.range", "[[bound]]\nparameter = \"j1.fc\"\nrange = [5, 6]", Changes),
        top("preferred", "preferred = [\"link1.m\", \"link2.m\"]", Changes),
        top("stiff_joints", "stiff_joints = true", Refused("elastic joints without torque sensors")),
        top("trajectory", "trajectory = \"none.json\"", Refused("none.json")),
        top("period_s", "period_s = 3.0", Changes),
        table("payload.name", TOOL, Refused("payload")),
        carried("payload.link", TOOL, "[[payload]]\nname = \"tool\"\nlink = \"link1\"", Changes),
        carried("payload.rated_mass", TOOL, "[[payload]]\nname = \"tool\"\nrated_mass = 1.0", Changes),
        carried("payload.mass", TOOL, "[[payload]]\nname = \"tool\"\nmass = 1.0", Changes),
        carried(
            "payload.mass_std",
            "[[payload]]\nname = \"tool\"\nmass = 1.0",
            "[[payload]]\nname = \"tool\"\nmass = 1.0\nmass_std = 0.1",
            Changes,
        ),
        carried(
            "payload.com",
            "[[payload]]\nname = \"tool\"\nmass = 1.0",
            "[[payload]]\nname = \"tool\"\nmass = 1.0\ncom = [0, 0, 0]",
            Changes,
        ),
        carried(
            "payload.inertia",
            "[[payload]]\nname = \"tool\"\nmass = 1.0\ncom = [0, 0, 0]",
            "[[payload]]\nname = \"tool\"\nmass = 1.0\ncom = [0, 0, 0]\ninertia = [0.01, 0, 0, 0.01, 0, 0.01]",
            Changes,
        ),
        log("log.path", "path = \"v.csv\"", Changes),
        log("log.rows", "rows = [1, 400]", Changes),
        log("log.part", "part = [0.0, 0.7]", Changes),
        log("log.leave_out", "leave_out = [[100, 200]]", Changes),
        with(
            "log.drop_repeated",
            text("preflight = \"off\"", "path = \"repeated.csv\"", "", ""),
            text("preflight = \"off\"", "path = \"repeated.csv\"\ndrop_repeated = true", "", ""),
            Changes,
        ),
        log(
            "log.columns.effort",
            "columns = { effort = { columns = \"tau_{joint}\", scale = 1.1 } }",
            Changes,
        ),
        log("log.trajectory", "trajectory = \"none.json\"", Refused("none.json")),
        log("log.period_s", "period_s = 3.0", Changes),
        with(
            "log.name",
            text("", "own = [\"offset\"]", "", ""),
            text("", "own = [\"offset\"]\nname = \"cold\"", "", ""),
            Changes,
        ),
        log("log.payload", "payload = \"tool\"", Refused("payload")),
        log("log.temperature", "temperature = 30.0", Refused("temperature")),
        log("log.own", "own = [\"offset\", \"friction\"]", Changes),
        with(
            "log.own",
            text("", "own = [\"offset\"]", "", ""),
            text("", "own = [\"offset\"]", "", "[elements]\ndefault = [\"coulomb\"]"),
            Refused("an `offset`"),
        ),
        log("log.like", "like = \"b\"", Refused("like")),
        valid("validation.path", "path = \"b.csv\"", Changes),
        valid("validation.rows", "rows = [1, 400]", Changes),
        valid("validation.part", "part = [0.0, 0.7]", Changes),
        valid("validation.leave_out", "leave_out = [[100, 200]]", Changes),
        with(
            "validation.drop_repeated",
            text("", "", "path = \"repeated.csv\"", ""),
            text("", "", "path = \"repeated.csv\"\ndrop_repeated = true", ""),
            Changes,
        ),
        valid(
            "validation.columns.effort",
            "columns = { effort = { columns = \"tau_{joint}\", scale = 1.1 } }",
            Changes,
        ),
        valid("validation.trajectory", "trajectory = \"none.json\"", Refused("none.json")),
        valid("validation.period_s", "period_s = 3.0", Changes),
        valid("validation.name", "name = \"cold\"", Refused("[[log]]")),
        valid("validation.payload", "payload = \"tool\"", Refused("payload")),
        valid("validation.temperature", "temperature = 30.0", Refused("temperature")),
        valid("validation.own", "own = [\"offset\"]", Refused("like")),
        with(
            "validation.like",
            text("", "own = [\"offset\"]", "", ""),
            text("", "own = [\"offset\"]", "like = \"a\"", ""),
            Changes,
        ),
        valid("validation.like", "like = \"a\"", Refused("own")),
    ]
}

const QUICK_SEARCH: &str = "[estimator.search]\nalgorithms = [\"de\"]\nevaluations = 60";

/// A line of a search against the search without it.
fn searched(line: &'static str, expect: Expect) -> Case {
    let (name, _) = line.split_once(' ').unwrap_or((line, ""));
    let budget = ["evaluations", "iterations"].contains(&name);
    let plain = QUICK_SEARCH.replace(if budget { "\nevaluations = 60" } else { "none" }, "");
    let key = format!("estimator.search.{name}");
    beside(key.leak(), QUICK_SEARCH, format!("{plain}\n{line}").leak(), expect)
}

const TEXTBOOK: &str = "[conditioning]\nroute = \"textbook\"\n";
const POLYNOMIALS: &str = "[conditioning]\nroute = \"textbook\"\nsmoothing = \"savitzky-golay\"\nwindow = 11";
const FREQUENCY: &str = "[conditioning]\nroute = \"textbook\"\nsmoothing = \"frequency\"";
const AVERAGED: &str = "[conditioning]\nroute = \"textbook\"\naverage_periods = true";

const RISING: &str = "[law.mine]\ncolumns = { mk = \"sign(v) * (1 - exp(-abs(v) / mv))\" }\nshape = { mv = [0.01, 2] }\n\
    [elements]\ndefault = [\"mine\", \"viscous\"]\nfriction = \"given\"";
const HELD: &str = "[law.mine]\ncolumns = { mk = \"sign(v) * (1 - exp(-abs(v) / mv))\" }\n\
    shape = { mv = { lower = 0.01, upper = 2, start = 1, held = true } }\n\
    [elements]\ndefault = [\"mine\", \"viscous\"]\nfriction = \"given\"";
const ALONE: &str = "[law.mine]\ncolumns = { mk = \"sign(v) * (1 - exp(-abs(v) / mv))\" }\nshape = { mv = [0.01, 2] }\n\
    [elements]\ndefault = [\"mine\"]\nfriction = \"given\"";
const NO_FRICTION: &str = "[law.mine]\ncolumns = { mk = \"sign(v) * (1 - exp(-abs(v) / mv))\" }\nshape = { mv = [0.01, 2] }\n\
    friction = false\n[elements]\ndefault = [\"mine\"]\nfriction = \"given\"";

#[test]
fn every_key_of_an_identification_takes_effect_or_is_refused() {
    let parse = |text: &str| Config::parse(text, "run.toml").err().map(|e| e.to_string());
    let mut found = keys(&parse);
    // The place of files, and what `dynid online` alone looks at (in `others`).
    found.retain(|key| key != "out" && !key.starts_with("online."));
    // Columns of single logs are read by the same code as those of the run.
    for log in ["log", "validation"] {
        let of_columns = format!("{log}.columns.");
        assert!(found.iter().any(|key| key.starts_with(&of_columns)), "{found:?}");
        found.retain(|key| !key.starts_with(&of_columns) || key.ends_with(".effort"));
    }
    walk("identify", &found, &cases(), &run);
}

#[test]
fn an_identification_without_logs_is_refused_by_the_library() {
    let robot = folder().path().join("arm.toml");
    let error = identify(&Config { robot, ..Config::default() }, &mut |_| {}).unwrap_err();
    assert!(matches!(&error, dynid::Error::Setting { name, .. } if name == "log"), "{error}");
    assert!(error.hint().unwrap().contains("[[log]]"));
    let error = identify(&Config::default(), &mut |_| {}).unwrap_err();
    assert!(matches!(&error, dynid::Error::Setting { name, .. } if name == "robot"), "{error}");
}

#[test]
fn settings_of_elements_that_nothing_reads_are_refused() {
    let slips = [
        ("coulmb = { effort = 3 }", "coulmb"),
        ("coulomb = { efort = 3 }", "efort"),
        ("coulomb = 3", "`effort`"),
        ("stribeck = { vss = 0.1 }", "vss"),
        ("rotor = { inertia = true }", "expected a number"),
        ("cyclic = { cycle = 3 }", "`cycles`"),
        ("spring = { k = 3 }", "`stiffness`"),
        ("drive_gain = { k = 3 }", "no settings"),
        ("external_load = { brake = 1 }", "true or false"),
    ];
    for (slip, words) in slips {
        let text = format!("{ARM}[element.j1]\n{slip}\n");
        let robot = Robot::parse(&text, Path::new("arm.toml"), &RobotOptions::default()).unwrap();
        let error = simulate(&robot, &SimulateSettings::default()).unwrap_err().to_string();
        assert!(error.contains(words), "{slip}: {error}");
    }
}

#[test]
fn a_bound_below_zero_takes_the_place_of_the_sign_of_friction() {
    let robot = Robot::parse(ARM, Path::new("arm.toml"), &RobotOptions::default()).unwrap();
    let settings = SimulateSettings {
        duration_s: 10.0,
        rate_hz: 200.0,
        values: [("j2.fv".to_owned(), -0.1), ("j2.fc".to_owned(), 0.5)].into(),
        ..Default::default()
    };
    std::fs::write(folder().path().join("driving.csv"), csv(&simulate(&robot, &settings).unwrap())).unwrap();
    let text = "robot = \"arm.toml\"\n[elements]\nfriction = \"given\"\n[[bound]]\nparameter = \"j2.fv\"\nrange = [-5, 5]\n\
                [[log]]\npath = \"driving.csv\"\n";
    let found: serde_json::Value = serde_json::from_str(&outcome("driving.toml", text).unwrap()).unwrap();
    let parameters = found["parameters"].as_array().unwrap();
    let value = parameters.iter().find(|p| p["name"] == "j2.fv").unwrap()["value"].as_f64().unwrap();
    assert!((value + 0.1).abs() < 0.02, "{value}");
}
