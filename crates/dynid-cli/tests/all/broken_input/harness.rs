//! One broken input: how it is put beside sound files, and what its refusal must look like.

#![expect(clippy::unwrap_used, reason = "helpers of tests outside of test functions")]

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::OnceLock;

use crate::support::{TWO_LINKS, dynid, indy7, run};

/// Sound files beside which the broken ones are put.
pub(crate) struct Sound {
    /// A log of 12 s at 100 Hz.
    pub(crate) log: String,
    /// The true states behind it.
    pub(crate) states: String,
    /// `estimate.json` of the two.
    pub(crate) estimate: String,
}

/// A sound configuration.
pub(crate) const CONFIG: &str = "robot = \"robot.urdf\"\nout = \"out\"\n[[log]]\npath = \"log.csv\"\n";

/// Identifies from the broken log.
pub(crate) const IDENTIFY: &str = "identify robot.urdf --log bad.csv --out out";

/// Identifies by the broken configuration.
pub(crate) const RUN: &str = "identify bad.toml";

/// Made once for all cases.
pub(crate) fn sound() -> &'static Sound {
    static SOUND: OnceLock<Sound> = OnceLock::new();
    SOUND.get_or_init(|| {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("robot.urdf"), TWO_LINKS).unwrap();
        run(
            folder.path(),
            &[
                "simulate",
                "robot.urdf",
                "--duration",
                "12",
                "--rate-hz",
                "100",
                "--out",
                "log.csv",
                "--clean",
                "states.csv",
            ],
            0,
        );
        run(folder.path(), &["identify", "robot.urdf", "--log", "log.csv", "--out", "out"], 0);
        let read = |name: &str| std::fs::read_to_string(folder.path().join(name)).unwrap();
        Sound { log: read("log.csv"), states: read("states.csv"), estimate: read("out/estimate.json") }
    })
}

/// One broken input.
pub(crate) struct Case {
    /// Name and bytes of the broken file.
    file: (&'static str, Vec<u8>),
    /// Name and bytes of a file that the broken one needs.
    beside: Option<(&'static str, Vec<u8>)>,
    /// Arguments, separated by spaces.
    args: &'static str,
    /// What the message must hold.
    message: &'static [&'static str],
    /// What the hint must hold; empty: a hint is not required.
    hint: &'static str,
}

/// Names the five parts of a case.
pub(crate) fn case(
    name: &'static str,
    bytes: impl Into<Vec<u8>>,
    args: &'static str,
    message: &'static [&'static str],
    hint: &'static str,
) -> Case {
    Case { file: (name, bytes.into()), beside: None, args, message, hint }
}

impl Case {
    /// Puts another file beside the broken one.
    pub(crate) fn beside(self, name: &'static str, bytes: impl Into<Vec<u8>>) -> Case {
        Case { beside: Some((name, bytes.into())), ..self }
    }
}

/// Every file and folder below a folder with its bytes.
fn listing(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut out = BTreeMap::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(next) = folders.pop() {
        for entry in std::fs::read_dir(&next).unwrap() {
            let path = entry.unwrap().path();
            let name = path.strip_prefix(folder).unwrap().display().to_string();
            if path.is_dir() {
                out.insert(name + "/", Vec::new());
                folders.push(path);
            } else {
                out.insert(name, std::fs::read(&path).unwrap());
            }
        }
    }
    out
}

/// Faults of one refusal, in words; empty if it is as it should be.
fn faults(case: &Case) -> Vec<String> {
    let folder = tempfile::tempdir().unwrap();
    let put = |name: &str, bytes: &[u8]| std::fs::write(folder.path().join(name), bytes).unwrap();
    put("robot.urdf", TWO_LINKS.as_bytes());
    put("indy7.toml", indy7().as_bytes());
    put("log.csv", sound().log.as_bytes());
    put("states.csv", sound().states.as_bytes());
    put("estimate.json", sound().estimate.as_bytes());
    put("config.toml", CONFIG.as_bytes());
    for (name, bytes) in std::iter::once(&case.file).chain(&case.beside) {
        put(name, bytes);
    }
    let before = listing(folder.path());
    let output = dynid().current_dir(folder.path()).args(case.args.split(' ')).output().unwrap();
    let mut faults = Vec::new();
    let mut expect = |holds: bool, fault: String| {
        if !holds {
            faults.push(fault);
        }
    };
    let stderr = String::from_utf8_lossy(&output.stderr);
    let lines: Vec<&str> = stderr.lines().collect();
    let message = lines.first().copied().unwrap_or_default();
    let hint = lines.get(1).copied().unwrap_or_default();
    expect(output.status.code() == Some(2), format!("exit code {:?}", output.status.code()));
    expect(message.starts_with("error: "), "the first line is no message".to_owned());
    expect(lines.len() <= 2, format!("{} lines", lines.len()));
    expect(hint.is_empty() || hint.starts_with("hint: "), "the second line is no hint".to_owned());
    expect(stderr.len() < 1500, format!("{} bytes of message", stderr.len()));
    expect(!stderr.contains("panicked"), "panic".to_owned());
    for part in case.message {
        expect(message.contains(part), format!("`{part}` is not in the message"));
    }
    expect(hint.contains(case.hint), format!("`{}` is not in the hint", case.hint));
    expect(output.stdout.is_empty(), "something on stdout".to_owned());
    let after = listing(folder.path());
    expect(after == before, format!("left behind or changed: {:?}", changed(&before, &after)));
    if faults.is_empty() {
        return faults;
    }
    faults.insert(0, format!("dynid {} ({}): {}", case.args, case.file.0, stderr.trim_end()));
    faults
}

fn changed<'a>(before: &BTreeMap<String, Vec<u8>>, after: &'a BTreeMap<String, Vec<u8>>) -> Vec<&'a String> {
    after.iter().filter(|(name, bytes)| before.get(*name) != Some(bytes)).map(|(name, _)| name).collect()
}

/// Runs every case and tells the faults of all.
#[track_caller]
pub(crate) fn check(cases: &[Case]) {
    let faults: Vec<String> =
        cases.iter().map(faults).filter(|f| !f.is_empty()).map(|f| f.join("\n    ")).collect();
    assert!(faults.is_empty(), "{} of {} cases:\n{}", faults.len(), cases.len(), faults.join("\n"));
}

/// The robot with a text replaced.
pub(crate) fn robot(from: &str, to: &str) -> String {
    assert!(TWO_LINKS.contains(from), "{from}");
    TWO_LINKS.replacen(from, to, 1)
}

/// The configuration with more lines at its end.
pub(crate) fn config(more: &str) -> String {
    CONFIG.to_owned() + more
}
