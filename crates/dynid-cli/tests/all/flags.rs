//! Every flag of every command takes effect or is refused with a reason.
//!
//! Commands and flags are read off the program's own help, so that a new flag without a case fails. A case is a command line
//! without and with the flag; what the program prints and writes must differ, or the flag must be refused.

#![expect(clippy::unwrap_used, reason = "helpers of tests outside of test functions")]

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use crate::support::{TWO_LINKS, dynid, run};

/// Flags of all commands, as `command --flag`.
fn flags() -> BTreeSet<String> {
    let help = |args: &[&str]| {
        let text = String::from_utf8(dynid().args(args).output().unwrap().stdout).unwrap();
        text.lines().map(str::to_owned).collect::<Vec<String>>()
    };
    let commands: Vec<String> = help(&["--help"])
        .into_iter()
        .skip_while(|line| line != "Commands:")
        .skip(1)
        .take_while(|line| !line.is_empty())
        .filter_map(|line| line.strip_prefix("  ")?.split(' ').next().map(str::to_owned))
        .filter(|command| !command.is_empty() && command != "help")
        .collect();
    assert!(commands.len() >= 15, "{commands:?}");
    let of = |command: &String| {
        let lines = help(&[command, "--help"]);
        let flags = lines.iter().filter_map(|line| {
            let flag = line
                .trim_start()
                .trim_start_matches("-q, ")
                .trim_start_matches("-h, ")
                .trim_start_matches("-V, ");
            let name = flag.strip_prefix("--")?.split([' ', '.']).next()?;
            Some(format!("{command} --{name}"))
        });
        flags.collect::<Vec<String>>()
    };
    commands.iter().flat_map(of).filter(|f| !f.ends_with("--help") && !f.ends_with("--version")).collect()
}

/// Flags of which another test, or nothing, can show the effect.
const ELSEWHERE: [(&str, &str); 33] = [
    ("fleet --false-discoveries", "needs robots in which something changes: `fleet`"),
    ("init ", "writes a configuration: `logs_of_tools`"),
    ("backlash --missing", "columns are read alike by all commands: `logs_of_tools`"),
    ("backlash --names", "columns are read alike by all commands: `logs_of_tools`"),
    ("check --missing", "columns are read alike by all commands: `logs_of_tools`"),
    ("check --names", "columns are read alike by all commands: `logs_of_tools`"),
    ("compare --missing", "columns are read alike by all commands: `logs_of_tools`"),
    ("compare --names", "columns are read alike by all commands: `logs_of_tools`"),
    ("convert --missing", "columns are read alike by all commands: `logs_of_tools`"),
    ("convert --names", "columns are read alike by all commands: `logs_of_tools`"),
    ("export --missing", "columns are read alike by all commands: `logs_of_tools`"),
    ("export --names", "columns are read alike by all commands: `logs_of_tools`"),
    ("identify --missing", "`logs_of_tools`"),
    ("identify --names", "`logs_of_tools`"),
    ("reduce --names", "columns are read alike by all commands: `logs_of_tools`"),
    ("reduce --missing", "columns are read alike by all commands: `logs_of_tools`"),
    ("solve --names", "columns are read alike by all commands: `logs_of_tools`"),
    ("solve --missing", "columns are read alike by all commands: `logs_of_tools`"),
    ("schema --quiet", "is there for all commands alike"),
    ("validate --names", "columns are read alike by all commands: `logs_of_tools`"),
    ("validate --missing", "columns are read alike by all commands: `logs_of_tools`"),
    ("study ", "studies are run by another program, whose tests are its own"),
    ("clearance ", "needs a robot with clearance: `clearance`"),
    ("friction ", "needs constant speeds: `friction`"),
    ("backlash --quiet", "hides progress, which terminals alone show"),
    ("diff --quiet", "hides progress, which terminals alone show"),
    ("explain --quiet", "is there for all commands alike"),
    ("gains --quiet", "hides progress, which terminals alone show"),
    ("regressor --quiet", "hides progress, which terminals alone show"),
    ("validate --quiet", "hides progress, and warnings of temperatures: `friction`"),
    ("online --json", "changes what a terminal shows"),
    ("online --replay", "needs a stream that begins again: `online`"),
    ("online --checkpoint", "needs a run that is interrupted: `online`"),
];

struct Case {
    flag: &'static str,
    before: &'static str,
    after: &'static str,
    /// Words of a refusal; none: the outcome differs.
    refused: Option<&'static str>,
}

/// What a command printed and wrote, times and provenance left out.
fn outcome(files: &Path, line: &str) -> (Option<i32>, String) {
    let folder = tempfile::tempdir().unwrap();
    copy(files, folder.path());
    let before: BTreeSet<String> = names(folder.path());
    let output = dynid().current_dir(folder.path()).args(line.split(' ')).output().unwrap();
    let mut text = format!(
        "{}\n{}\n",
        without_clock(&String::from_utf8_lossy(&output.stdout)),
        without_clock(&String::from_utf8_lossy(&output.stderr))
    );
    for name in names(folder.path()).difference(&before) {
        text += name;
        text += &written(&folder.path().join(name));
    }
    (output.status.code(), text)
}

/// Outcomes of commands, two of them at a time.
fn outcomes<'a>(files: &Path, lines: &[&'a str]) -> BTreeMap<&'a str, (Option<i32>, String)> {
    let half = |first: usize| -> Vec<(&'a str, (Option<i32>, String))> {
        lines.iter().skip(first).step_by(2).map(|line| (*line, outcome(files, line))).collect()
    };
    std::thread::scope(|scope| {
        let second = scope.spawn(|| half(1));
        half(0).into_iter().chain(second.join().unwrap()).collect()
    })
}

/// Copies what a folder holds.
fn copy(from: &Path, to: &Path) {
    for name in names(from) {
        let (source, target) = (from.join(&name), to.join(&name));
        if source.is_dir() {
            std::fs::create_dir(&target).unwrap();
            copy(&source, &target);
        } else {
            std::fs::copy(source, target).unwrap();
        }
    }
}

fn names(folder: &Path) -> BTreeSet<String> {
    std::fs::read_dir(folder)
        .unwrap()
        .map(|e| e.unwrap().file_name().to_string_lossy().into_owned())
        .collect()
}

/// What a file says, or the files of a folder with their names.
fn written(path: &Path) -> String {
    if path.is_dir() {
        return names(path).iter().map(|name| name.clone() + &written(&path.join(name))).collect();
    }
    let bytes = std::fs::read(path).unwrap();
    let Ok(serde_json::Value::Object(mut map)) = serde_json::from_slice(&bytes) else {
        // A page says which command made it.
        let page = path.extension().is_some_and(|e| e == "html");
        return if page { String::new() } else { String::from_utf8_lossy(&bytes).into_owned() };
    };
    // What was asked for is no effect.
    for echo in ["provenance", "config", "conditioning", "preflight"] {
        map.remove(echo);
    }
    without_clock(&serde_json::to_string_pretty(&map).unwrap())
}

/// Lines without times of a clock.
fn without_clock(text: &str) -> String {
    let clock = |line: &&str| !["seconds", "_s\":", " s)", "time"].iter().any(|word| line.contains(word));
    text.lines().filter(clock).collect::<Vec<_>>().join("\n")
}

/// Robots, logs, an estimate and configurations.
fn prepared() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let write = |name: &str, text: &str| std::fs::write(at.join(name), text).unwrap();
    write("arm.urdf", TWO_LINKS);
    let mimic = TWO_LINKS.replacen(
        "<limit lower=\"-2\" upper=\"2\" velocity=\"3\" effort=\"100\"/>\n  </joint>\n</robot>",
        "<limit lower=\"-2\" upper=\"2\" velocity=\"3\" effort=\"100\"/>\n    <mimic joint=\"shoulder\"/>\n  </joint>\n</robot>",
        1,
    );
    assert!(mimic.contains("<mimic"));
    write("mimic.urdf", &mimic);
    let simulate = |out: &str, seed: &str, more: &[&str]| {
        let args =
            ["simulate", "arm.urdf", "--duration", "8", "--rate-hz", "100", "--seed", seed, "--out", out];
        run(at, &[&args[..], more].concat(), 0);
    };
    simulate("log.csv", "1", &["--clean", "clean.csv"]);
    simulate("other.csv", "2", &[]);
    let log = std::fs::read_to_string(at.join("log.csv")).unwrap();
    let columns = |keep: &dyn Fn(&str) -> bool, rename: &dyn Fn(&str) -> String| {
        let header: Vec<&str> = log.lines().next().unwrap().split(',').collect();
        let rows = log.lines().enumerate().map(|(row, line)| {
            let cells = line.split(',').zip(&header).filter(|(_, name)| keep(name));
            let cell = |(x, _): (&str, &&str)| if row == 0 { rename(x) } else { x.to_owned() };
            cells.map(cell).collect::<Vec<String>>().join(",")
        });
        rows.collect::<Vec<String>>().join("\n") + "\n"
    };
    let same = |name: &str| name.to_owned();
    write("currents.csv", &columns(&|_| true, &|name| name.replace("tau_", "current_")));
    write("no-elbow.csv", &columns(&|name| !name.ends_with("elbow"), &same));
    write("no-time.csv", &columns(&|name| name != "t", &same));
    run(at, &["identify", "arm.urdf", "--log", "log.csv", "--out", "out", "--quiet"], 0);
    std::fs::copy(at.join("out/estimate.json"), at.join("estimate.json")).unwrap();
    run(at, &["reduce", "arm.urdf", "--log", "log.csv", "--out", "cell.factors", "--quiet"], 0);
    run(at, &["reduce", "cell.factors", "--log", "other.csv", "--out", "other.factors", "--quiet"], 0);
    write(
        "bounded.toml",
        "robot = \"arm.urdf\"\nout = \"out\"\n[[bound]]\nparameter = \"shoulder.fc\"\nrange = [8, 9]\n[[log]]\npath = \"log.csv\"\n",
    );
    dynid().current_dir(at).args(["identify", "bounded.toml", "--quiet"]).output().unwrap();
    std::fs::copy(at.join("out/estimate.json"), at.join("bounded.json")).unwrap();
    std::fs::remove_dir_all(at.join("out")).unwrap();
    write("heavy.urdf", &TWO_LINKS.replace("mass value=\"", "mass value=\"2"));
    write("longer.urdf", &TWO_LINKS.replace("0 0 0.35", "0 0 0.6"));
    let law = "[element.shoulder]\nstribeck = { coulomb = 2, static = 5, vs = 0.3 }\n[element.elbow]\nstribeck = { coulomb = 1, static = 2, vs = 0.3 }\n";
    write(
        "stribeck.toml",
        &format!(
            "urdf = \"arm.urdf\"\n[defaults]\nelements = [\"stribeck\", \"viscous\", \"offset\"]\n{law}"
        ),
    );
    run(
        at,
        &["simulate", "stribeck.toml", "--duration", "8", "--rate-hz", "100", "--out", "stribeck.csv"],
        0,
    );
    let logs = "[[log]]\npath = \"log.csv\"\n[[log]]\npath = \"other.csv\"\npayload = \"tool\"\n";
    let tool = "[[payload]]\nname = \"tool\"\nmass = 1.0\n";
    write("payload.toml", &format!("robot = \"arm.urdf\"\npreflight = \"off\"\n{tool}{logs}"));
    write(
        "turned.toml",
        "robot = \"arm.urdf\"\n[columns]\nposition = { columns = \"q_{joint}\", scale = 1.5 }\n[[log]]\npath = \"log.csv\"\n",
    );
    write("run.toml", "robot = \"arm.urdf\"\n[online]\nlearn_s = 4\n[[log]]\npath = \"log.csv\"\n");
    write(
        "scaled.toml",
        "robot = \"arm.urdf\"\n[columns]\neffort = { columns = \"tau_{joint}\", scale = 1.5 }\n[[log]]\npath = \"log.csv\"\n",
    );
    write(
        "small.toml",
        "robot = \"arm.urdf\"\n[trajectory]\nperiod_s = 4\nharmonics = 3\nsample_rate_hz = 50\n[search]\nstarts = 1\n",
    );
    write("sim.toml", "harmonics = 2\n");
    // A drive that lags its command by 30 ms.
    let text = std::fs::read_to_string(at.join("log.csv")).unwrap();
    let head: Vec<&str> = text.lines().next().unwrap().split(',').collect();
    let rows: Vec<Vec<&str>> = text.lines().skip(1).map(|line| line.split(',').collect()).collect();
    let place = |name: &str| head.iter().position(|h| *h == name).unwrap();
    let [time, shoulder, elbow] = ["t", "q_shoulder", "q_elbow"].map(place);
    let mut told = "t,cmd_shoulder,cmd_elbow,q_shoulder,q_elbow\n".to_owned();
    for (now, later) in rows.iter().zip(&rows[3..]).take(200) {
        let cells = [now[time], later[shoulder], later[elbow], now[shoulder], now[elbow]];
        told += &(cells.join(",") + "\n");
    }
    write("told.csv", &told);
    let half: String = told.lines().take(120).map(|line| format!("{line}\n")).collect();
    write("half-told.csv", &half);
    // Beside the robot: a file that refers to it, whose own name is free.
    write("two.toml", "name = \"two\"\nurdf = \"arm.urdf\"\n");
    write("servo-here.toml", "robot = \"two.toml\"\n[[log]]\npath = \"told.csv\"\n[servo]\nlaw = []\n");
    write("servo.toml", "robot = \"arm.urdf\"\n[[log]]\npath = \"told.csv\"\n[servo]\nlaw = []\n");
    let fleet = [
        "simulate",
        "arm.urdf",
        "--fleet",
        "3x7",
        "--duration",
        "6",
        "--rate-hz",
        "100",
        "--seed",
        "3",
        "--out",
        "made",
        "--quiet",
    ];
    run(at, &fleet, 0);
    let manifest = std::fs::read_to_string(at.join("made/manifest.csv")).unwrap();
    let load = |(k, line): (usize, &str)| match k {
        0 => format!("{line},load\n"),
        _ => format!("{line},{}\n", k % 4),
    };
    let manifest: String = manifest.lines().enumerate().map(load).collect();
    write("made/manifest.csv", &manifest);
    run(at, &["reduce", "cell.factors", "--manifest", "made/manifest.csv", "--out", "factors", "--quiet"], 0);
    write("made/few.csv", &manifest.lines().take(9).map(|line| format!("{line}\n")).collect::<String>());
    std::fs::create_dir_all(at.join("mine")).unwrap();
    write("mine/report.html", "not of this program\n");
    write("virtual.toml", "rate_hz = 100\nduration_s = 5\n[fleet]\nrobots = 2\nlogs = 2\n");
    for mine in ["report.html", "payload.html", "dynid.1"] {
        write(mine, "not of this program\n");
    }
    folder
}

fn cases() -> Vec<Case> {
    let case = |flag, before, after| Case { flag, before, after, refused: None };
    let refused = |flag, after, words| Case { flag, before: "inspect arm.urdf", after, refused: Some(words) };
    let mut out = vec![
        case("servo --log", "servo servo.toml --out s", "servo arm.urdf --log half-told.csv --out s"),
        case("fleet --out", "fleet factors --out f", "fleet factors --out g"),
        case(
            "reduce --manifest",
            "reduce cell.factors --log log.csv --out f.factors",
            "reduce cell.factors --manifest made/few.csv --out few",
        ),
        case(
            "reduce --shard",
            "reduce cell.factors --manifest made/few.csv --out few --json",
            "reduce cell.factors --manifest made/few.csv --out few --json --shard 2/3",
        ),
        case(
            "simulate --fleet",
            "simulate arm.urdf --config virtual.toml --out virtual",
            "simulate arm.urdf --config virtual.toml --out virtual --fleet 2x3",
        ),
    ];
    let plain: &[(&str, &str, &[&str])] = &[
        (
            "fleet",
            "fleet factors --out f",
            &["--between-robots fc", "--between-logs fv", "--robot r002", "--all-robots", "--json"],
        ),
        (
            "fleet",
            "fleet factors --out f --between-robots fc --between-logs fc",
            &["--covariates temperature", "--quiet"],
        ),
        ("fleet", "fleet factors --out mine", &["--force"]),
        ("reduce", "reduce arm.urdf --log log.csv --out f.factors", &["--delays", "--payload forearm"]),
        (
            "inspect",
            "inspect arm.urdf",
            &["--floating-base", "--lock elbow=0.3", "--gravity 0,0,-3", "--elements viscous", "--json"],
        ),
        ("inspect", "inspect arm.urdf --lock elbow=0.3", &["--quiet"]),
        ("convert", "convert log.csv out.csv", &["--rows 3:50", "--quiet"]),
        ("convert", "convert currents.csv out.csv", &["--robot arm.urdf"]),
        ("convert", "convert log.csv other.csv", &["--force"]),
        ("convert", "convert log.csv out.csv --robot arm.urdf", &["--config turned.toml"]),
        ("convert", "convert no-time.csv out.csv --robot arm.urdf", &["--rate-hz 100"]),
        ("convert", "convert currents.csv out.csv --robot arm.urdf", &["--gains 2,3"]),
        ("convert", "convert no-elbow.csv out.csv --robot arm.urdf", &["--allow-unlogged"]),
        ("explain", "explain", &["--json", "--markdown"]),
        ("servo", "servo servo.toml", &["--out s", "--json"]),
        ("servo", "servo servo.toml --out s", &["--quiet"]),
        ("servo", "servo servo-here.toml --out .", &["--force"]),
        (
            "servo",
            "servo arm.urdf --log half-told.csv --out s",
            &["--lock elbow=0.3", "--position-gain 200", "--velocity-gain 3", "--validate told.csv"],
        ),
        ("man", "man", &["--out pages"]),
        ("man", "man --out pages", &["--quiet"]),
        ("diff", "diff arm.urdf estimate.json", &["--states clean.csv", "--all", "--json"]),
        (
            "regressor",
            "regressor arm.urdf --states clean.csv",
            &["--lock elbow=0.3", "--gravity 0,0,-3", "--rows 3:5", "--json"],
        ),
        (
            "check",
            "check log.csv --robot arm.urdf",
            &[
                "--fix f.toml",
                "--report r.html",
                "--lock elbow=0.3",
                "--gravity 0,0,9.81",
                "--rows 1:500",
                "--json",
            ],
        ),
        ("check", "check log.csv --robot arm.urdf --report r.html", &["--quiet"]),
        ("compare", "compare arm.urdf --log log.csv", &["--report r.html", "--rows 1:500", "--json"]),
        ("compare", "compare arm.urdf --log log.csv --report r.html", &["--quiet"]),
        (
            "identify",
            "identify arm.urdf --log log.csv",
            &[
                "--validate other.csv",
                "--rows 1:600",
                "--out elsewhere",
                "--elements viscous",
                "--friction stribeck",
                "--lock elbow=0.3",
                "--gravity 0,0,-9.5",
                "--route textbook",
                "--estimator huber",
                "--consistency none",
                "--kernel-hz 5",
                "--state-hz 25",
                "--delay-samples 2",
                "--reversal-mask 0.3",
                "--prefer upper_arm.m,forearm.m",
                "--json",
                "--quiet",
            ],
        ),
        ("reduce", "reduce arm.urdf --log log.csv --out f.factors", &["--rows 1:600", "--json", "--quiet"]),
        ("reduce", "reduce cell.factors --log no-time.csv --out f.factors", &["--rate-hz 100"]),
        ("reduce", "reduce arm.urdf --log currents.csv --out f.factors", &["--gains 2,3"]),
        ("reduce", "reduce arm.urdf --log no-elbow.csv --out f.factors", &["--allow-unlogged"]),
        ("reduce", "reduce cell.factors --log other.csv --out f.factors", &["--config turned.toml"]),
        ("reduce", "reduce cell.factors --log other.csv --out report.html", &["--force"]),
        ("merge", "merge cell.factors other.factors --out f.factors", &["--json", "--quiet"]),
        ("merge", "merge cell.factors other.factors --out report.html", &["--force"]),
        (
            "solve",
            "solve cell.factors other.factors",
            &["--validate other.csv", "--out elsewhere", "--json", "--quiet"],
        ),
        ("solve", "solve cell.factors --validate other.csv", &["--rows 1:500", "--config turned.toml"]),
        ("solve", "solve cell.factors --validate no-time.csv", &["--rate-hz 100"]),
        ("solve", "solve cell.factors --validate currents.csv", &["--gains 2,3"]),
        ("solve", "solve cell.factors --validate no-elbow.csv", &["--allow-unlogged"]),
        ("solve", "solve cell.factors --out .", &["--force"]),
        (
            "next",
            "next small.toml --after cell.factors --want *.fc=1% --starts 1 --longest 6",
            &[
                "--no-floor",
                "--floor-height -0.1",
                "--no-self-collision",
                "--margin 0.05",
                "--out elsewhere",
                "--period 10",
                "--harmonics 4",
                "--rate-hz 60",
                "--no-rest",
                "--park",
                "--acceleration 2",
                "--share 0.5",
                "--seed 5",
                "--also mujoco",
                "--json",
                "--quiet",
            ],
        ),
        ("predict", "predict estimate.json --states clean.csv", &["--out p.csv", "--rows 3:5", "--json"]),
        ("predict", "predict estimate.json --states clean.csv --out p.csv", &["--quiet"]),
        (
            "design",
            "design small.toml",
            &[
                "--no-floor",
                "--floor-height -0.1",
                "--no-self-collision",
                "--margin 0.05",
                "--out elsewhere",
                "--period 5",
                "--harmonics 4",
                "--periods 2",
                "--rate-hz 60",
                "--no-rest",
                "--park",
                "--acceleration 2",
                "--share 0.5",
                "--criterion condition",
                "--columns inertial",
                "--noise 5",
                "--elements viscous",
                "--lock elbow=0.3",
                "--starts 2",
                "--seed 5",
                "--checkpoint c.json",
                "--json",
                "--quiet",
            ],
        ),
        (
            "motion",
            "motion arm.urdf --sweep shoulder --speeds 0.5,1",
            &[
                "--out elsewhere",
                "--range -1,1",
                "--rate-hz 100",
                "--acceleration 2",
                "--share 0.5",
                "--lock elbow=0.3",
                "--json",
                "--quiet",
            ],
        ),
        (
            "simulate",
            "simulate arm.urdf --out s.csv",
            &[
                "--lock elbow=0.3",
                "--gravity 0,0,-3",
                "--config sim.toml",
                "--closed-loop",
                "--duration 5",
                "--rate-hz 90",
                "--effort-noise 0.2",
                "--encoder-bits 9",
                "--seed 5",
                "--clean c.csv",
                "--truth t.json",
                "--json",
                "--quiet",
            ],
        ),
        (
            "validate",
            "validate estimate.json --log other.csv",
            &["--rows 1:400", "--config scaled.toml", "--filter-hz 3", "--max-error 0.001", "--json"],
        ),
        (
            "backlash",
            "backlash estimate.json --log other.csv",
            &["--rows 1:700", "--config scaled.toml", "--json"],
        ),
        (
            "export",
            "export estimate.json --urdf e.urdf",
            &["--mjcf e.xml", "--model e.json", "--log other.csv", "--robot mimic.urdf", "--json", "--quiet"],
        ),
        ("export", "export estimate.json --urdf e.urdf --log other.csv", &["--rows 1:400"]),
        ("payload", "payload payload.toml", &["--out elsewhere", "--json", "--quiet"]),
        ("gains", "gains payload.toml", &["--json"]),
        ("online", "online run.toml", &["--log other.csv", "--rows 1:700", "--quiet"]),
    ];
    for (command, base, flags) in plain {
        for flag in *flags {
            let name = flag.split(' ').next().unwrap();
            out.push(case(leak(format!("{command} {name}")), base, leak(format!("{base} {flag}"))));
        }
    }
    // Flags that say how logs are read.
    for (command, base) in [
        ("check", "check {log} --robot arm.urdf"),
        ("compare", "compare arm.urdf --log {log}"),
        ("identify", "identify arm.urdf --log {log}"),
        ("validate", "validate estimate.json --log {log}"),
        ("backlash", "backlash estimate.json --log {log}"),
        ("export", "export estimate.json --urdf e.urdf --log {log}"),
    ] {
        for (flag, log) in [
            ("--rate-hz 100", "no-time.csv"),
            ("--gains 1,1", "currents.csv"),
            ("--allow-unlogged", "no-elbow.csv"),
        ] {
            let name = flag.split(' ').next().unwrap();
            let before = base.replace("{log}", log);
            let after = format!("{before} {flag}");
            out.push(case(leak(format!("{command} {name}")), leak(before), leak(after)));
        }
        let after = leak(format!("{} --gains 1,1", base.replace("{log}", "log.csv")));
        out.push(refused(leak(format!("{command} --gains")), after, "current_gains"));
    }
    for (command, base) in [
        ("inspect", "inspect mimic.urdf"),
        ("regressor", "regressor mimic.urdf --states clean.csv"),
        ("simulate", "simulate mimic.urdf --out s.csv"),
        ("identify", "identify mimic.urdf --log log.csv"),
    ] {
        out.push(case(
            leak(format!("{command} --couple-mimics")),
            base,
            leak(format!("{base} --couple-mimics")),
        ));
    }
    out.extend([
        case(
            "regressor --base",
            "regressor arm.urdf --states clean.csv --json",
            "regressor arm.urdf --states clean.csv --json --base",
        ),
        refused("regressor --base", "regressor arm.urdf --states clean.csv --base", "--json"),
        case("check --log", "check arm.urdf --log log.csv", "check arm.urdf --log other.csv"),
        case(
            "diff --unconstrained",
            "diff arm.urdf bounded.json",
            "diff arm.urdf bounded.json --unconstrained",
        ),
        case(
            "diff --rows",
            "diff arm.urdf estimate.json --states clean.csv",
            "diff arm.urdf estimate.json --states clean.csv --rows 3:50",
        ),
        case(
            "predict --force",
            "predict estimate.json --states clean.csv --out log.csv",
            "predict estimate.json --states clean.csv --out log.csv --force",
        ),
        case(
            "simulate --force",
            "simulate arm.urdf --out log.csv",
            "simulate arm.urdf --out log.csv --force",
        ),
        case(
            "export --force",
            "export estimate.json --urdf heavy.urdf",
            "export estimate.json --urdf heavy.urdf --force",
        ),
        case(
            "check --force",
            "check log.csv --robot arm.urdf --fix run.toml",
            "check log.csv --robot arm.urdf --fix run.toml --force",
        ),
        case(
            "compare --force",
            "compare arm.urdf --log log.csv --report run.toml",
            "compare arm.urdf --log log.csv --report run.toml --force",
        ),
        case(
            "identify --force",
            "identify stribeck.toml --log stribeck.csv --out .",
            "identify stribeck.toml --log stribeck.csv --out . --force",
        ),
        case(
            "motion --force",
            "motion arm.urdf --sweep elbow --speeds 1 --out .",
            "motion arm.urdf --sweep elbow --speeds 1 --out . --force",
        ),
        case(
            "motion --sweep",
            "motion arm.urdf --sweep elbow --speeds 1",
            "motion arm.urdf --sweep elbow --speeds 1 --sweep shoulder",
        ),
        case(
            "motion --speeds",
            "motion arm.urdf --sweep elbow --speeds 1",
            "motion arm.urdf --sweep elbow --speeds 0.5",
        ),
        case(
            "motion --slower",
            "motion arm.urdf --sweep elbow --speeds 3.2 --acceleration 40",
            "motion arm.urdf --sweep elbow --speeds 3.2 --acceleration 40 --slower",
        ),
        case(
            "motion --also",
            "motion arm.urdf --sweep elbow --speeds 1",
            "motion arm.urdf --sweep elbow --speeds 1 --also mujoco,moveit",
        ),
        case(
            "next --want",
            "next small.toml --after cell.factors --want *.fc=1% --starts 1 --longest 6",
            "next small.toml --after cell.factors --want *.fc=2% --starts 1 --longest 6",
        ),
        case(
            "next --after",
            "next small.toml --after cell.factors --want *.fc=1% --starts 1 --longest 6",
            "next small.toml --after cell.factors --after other.factors --want *.fc=1% --starts 1 --longest 6",
        ),
        case(
            "next --longest",
            "next small.toml --after cell.factors --want *.fc=0.01% --starts 1 --longest 6",
            "next small.toml --after cell.factors --want *.fc=0.01% --starts 1 --longest 7",
        ),
        case(
            "next --starts",
            "next small.toml --after cell.factors --want *.fc=1% --starts 1 --longest 6",
            "next small.toml --after cell.factors --want *.fc=1% --starts 2 --longest 6",
        ),
        case(
            "next --force",
            "next small.toml --after cell.factors --want *.fc=500% --out .",
            "next small.toml --after cell.factors --want *.fc=500% --out . --force",
        ),
        case("design --also", "design small.toml", "design small.toml --also ur"),
        case("design --force", "design small.toml --out .", "design small.toml --out . --force"),
        case("payload --force", "payload payload.toml --out .", "payload payload.toml --out . --force"),
        case("man --force", "man --out .", "man --out . --force"),
        case(
            "regressor --states",
            "regressor arm.urdf --states clean.csv",
            "regressor arm.urdf --states log.csv",
        ),
        case(
            "regressor --floating-base",
            "regressor arm.urdf --states clean.csv",
            "regressor arm.urdf --states clean.csv --floating-base",
        ),
        refused("simulate --floating-base", "simulate arm.urdf --out s.csv --floating-base", "floating"),
        case(
            "check --known-effort-scale",
            "check log.csv --robot heavy.urdf",
            "check log.csv --robot heavy.urdf --known-effort-scale",
        ),
        case(
            "identify --known-effort-scale",
            "identify heavy.urdf --log log.csv",
            "identify heavy.urdf --log log.csv --known-effort-scale",
        ),
        case("check --robot", "check log.csv --robot arm.urdf", "check log.csv --robot longer.urdf"),
        case(
            "validate --unconstrained",
            "validate bounded.json --log other.csv",
            "validate bounded.json --log other.csv --unconstrained",
        ),
        case(
            "predict --unconstrained",
            "predict bounded.json --states clean.csv",
            "predict bounded.json --states clean.csv --unconstrained",
        ),
        case("compare --log", "compare arm.urdf --log log.csv", "compare arm.urdf --log other.csv"),
        case("identify --log", "identify arm.urdf --log log.csv", "identify arm.urdf --log other.csv"),
        refused(
            "identify --known-friction",
            "identify arm.urdf --log log.csv --known-friction none.json",
            "none.json",
        ),
        refused(
            "identify --search",
            "identify arm.urdf --log log.csv --friction given --search ics",
            "shape parameter",
        ),
        case(
            "identify --search",
            "identify arm.urdf --log stribeck.csv --friction stribeck",
            "identify arm.urdf --log stribeck.csv --friction stribeck --search de",
        ),
        refused(
            "identify --decimation",
            "identify arm.urdf --log log.csv --decimation 4",
            "route = \"textbook\"",
        ),
        case(
            "identify --decimation",
            "identify arm.urdf --log log.csv --route textbook",
            "identify arm.urdf --log log.csv --route textbook --decimation 7",
        ),
        case(
            "identify --seed",
            "identify arm.urdf --log stribeck.csv --friction stribeck --search de",
            "identify arm.urdf --log stribeck.csv --friction stribeck --search de --seed 9",
        ),
        case(
            "predict --states",
            "predict estimate.json --states clean.csv",
            "predict estimate.json --states none.csv",
        ),
        refused("design --package-dir", "design small.toml --package-dir none", "none"),
        refused(
            "next --package-dir",
            "next small.toml --after cell.factors --want *.fc=1% --package-dir none",
            "none",
        ),
        refused(
            "next --lock",
            "next small.toml --after cell.factors --want *.fc=1% --lock elbow=0.3",
            "elbow",
        ),
        refused("design --earlier", "design small.toml --earlier none.json", "none.json"),
        refused("design --drives", "design small.toml --drives none.json", "none.json"),
        refused("simulate --drives", "simulate arm.urdf --out s.csv --drives none.json", "none.json"),
        case(
            "design --time-budget",
            "design small.toml --starts 3",
            "design small.toml --starts 3 --time-budget 0",
        ),
        refused("simulate --follow", "simulate arm.urdf --out s.csv --follow none.json", "none.json"),
        refused(
            "simulate --journal-noise",
            "simulate arm.urdf --out s.csv --journal-noise 1e-6",
            "clearance",
        ),
        case("simulate --out", "simulate arm.urdf --out s.csv", "simulate arm.urdf --out z.csv"),
        case(
            "reduce --log",
            "reduce cell.factors --log log.csv --out f.factors",
            "reduce cell.factors --log other.csv --out f.factors",
        ),
        case(
            "reduce --out",
            "reduce cell.factors --log log.csv --out f.factors",
            "reduce cell.factors --log log.csv --out g.factors",
        ),
        refused(
            "reduce --config",
            "reduce arm.urdf --log log.csv --config turned.toml --out f.factors",
            "--config",
        ),
        case("merge --out", "merge cell.factors --out f.factors", "merge cell.factors --out g.factors"),
        case(
            "validate --log",
            "validate estimate.json --log other.csv",
            "validate estimate.json --log log.csv",
        ),
        case(
            "backlash --log",
            "backlash estimate.json --log other.csv",
            "backlash estimate.json --log log.csv",
        ),
        case(
            "export --urdf",
            "export estimate.json --model e.json",
            "export estimate.json --model e.json --urdf e.urdf",
        ),
        case(
            "export --config",
            "export estimate.json --urdf e.urdf --log other.csv",
            "export estimate.json --urdf e.urdf --log other.csv --config turned.toml",
        ),
        refused("export --config", "export estimate.json --urdf e.urdf --config scaled.toml", "--log"),
        refused("export --rate-hz", "export estimate.json --urdf e.urdf --rate-hz 100", "--log"),
        refused(
            "validate --config",
            "validate estimate.json --log other.csv --config none.toml",
            "none.toml",
        ),
        case(
            "export --allow-unphysical",
            "export flat.json --robot arm.urdf --urdf e.urdf",
            "export flat.json --robot arm.urdf --urdf e.urdf --allow-unphysical",
        ),
        refused("online --stream", "online run.toml --stream csv --log log.csv", "--log"),
    ]);
    out
}

/// Arguments live as long as the test.
fn leak(text: String) -> &'static str {
    Box::leak(text.into_boxed_str())
}

#[test]
fn every_flag_takes_effect_or_is_refused() {
    let files = prepared();
    // An estimate with a link that no body could be.
    let estimate = std::fs::read_to_string(files.path().join("estimate.json")).unwrap();
    let mut flat: serde_json::Value = serde_json::from_str(&estimate).unwrap();
    for parameter in flat["parameters"].as_array_mut().unwrap() {
        if parameter["name"] == "forearm.m" {
            parameter["value"] = (-1.0).into();
        }
    }
    std::fs::write(files.path().join("flat.json"), flat.to_string()).unwrap();

    let mut faults: Vec<String> = Vec::new();
    let cases = cases();
    let flags = flags();
    for flag in &flags {
        let elsewhere = ELSEWHERE.iter().any(|(start, _)| flag.starts_with(start));
        if !elsewhere && !cases.iter().any(|case| case.flag == flag) {
            faults.push(format!("{flag}: no case"));
        }
    }
    let unknown = cases.iter().filter(|case| !flags.contains(case.flag));
    faults.extend(unknown.map(|case| format!("{}: a case, but no such flag", case.flag)));
    let unchanged = cases.iter().filter(|case| case.refused.is_none()).map(|case| case.before);
    let lines: BTreeSet<&str> = cases.iter().map(|case| case.after).chain(unchanged).collect();
    let outcomes = outcomes(files.path(), &lines.into_iter().collect::<Vec<_>>());
    for case in &cases {
        let after = &outcomes[case.after];
        let what = match case.refused {
            Some(words) if after.0 == Some(2) && after.1.contains(words) => continue,
            Some(_) => "not refused",
            None if outcomes[case.before] != *after => continue,
            None => "changes nothing",
        };
        faults.push(format!("{}: {what}: {:?} {}", case.after, after.0, start(&after.1)));
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

fn start(text: &str) -> String {
    text.trim().chars().take(200).collect()
}
