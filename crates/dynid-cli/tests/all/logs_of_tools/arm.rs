//! A simulated arm, whose log every tool writes in its own way.

use std::sync::OnceLock;

use crate::support::{TWO_LINKS, run};

/// Signals of the arm; lists are joint by joint, the shoulder first.
pub(super) struct Arm {
    pub(super) time: Vec<f64>,
    pub(super) q: [Vec<f64>; 2],
    pub(super) dq: [Vec<f64>; 2],
    pub(super) tau: [Vec<f64>; 2],
    /// True states as a table.
    pub(super) clean: String,
    /// True efforts.
    pub(super) effort: [Vec<f64>; 2],
}

/// Columns of a plain table by name.
pub(super) fn columns<const N: usize>(csv: &str, names: &[&str; N]) -> [Vec<f64>; N] {
    let header: Vec<&str> = csv.lines().next().unwrap().split(',').collect();
    names.map(|name| {
        let at = header.iter().position(|h| *h == name).unwrap_or_else(|| panic!("{name} in {header:?}"));
        csv.lines().skip(1).map(|line| line.split(',').nth(at).unwrap().parse().unwrap()).collect()
    })
}

/// The arm, simulated once.
pub(super) fn arm() -> &'static Arm {
    static ARM: OnceLock<Arm> = OnceLock::new();
    ARM.get_or_init(|| {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("robot.urdf"), TWO_LINKS).unwrap();
        let arguments = "simulate robot.urdf --duration 20 --rate-hz 100 --out log.csv --clean clean.csv";
        run(folder.path(), &arguments.split(' ').collect::<Vec<_>>(), 0);
        let read = |name: &str| std::fs::read_to_string(folder.path().join(name)).unwrap();
        let (log, clean) = (read("log.csv"), read("clean.csv"));
        let [time] = columns(&log, &["t"]);
        Arm {
            time,
            q: columns(&log, &["q_shoulder", "q_elbow"]),
            dq: columns(&clean, &["dq_shoulder", "dq_elbow"]),
            tau: columns(&log, &["tau_shoulder", "tau_elbow"]),
            effort: columns(&clean, &["tau_shoulder", "tau_elbow"]),
            clean,
        }
    })
}

impl Arm {
    /// Rows of `row(k, t)`, each with an end of line, under a header line unless that is empty.
    pub(super) fn rows(&self, header: &str, mut row: impl FnMut(usize, f64) -> String) -> String {
        let mut out = if header.is_empty() { String::new() } else { format!("{header}\n") };
        for (k, t) in self.time.iter().enumerate() {
            out += &row(k, *t);
            out.push('\n');
        }
        out
    }

    /// Positions, velocities and efforts of a row, between separators.
    pub(super) fn signals(&self, k: usize, separator: &str) -> String {
        let lists = [&self.q, &self.dq, &self.tau];
        let cells: Vec<String> =
            lists.iter().flat_map(|l| l.iter()).map(|list| list[k].to_string()).collect();
        cells.join(separator)
    }
}

/// Nanoseconds since 1970 of a time of the arm.
pub(super) fn nanoseconds(t: f64) -> i64 {
    1_700_000_000_123_456_789 + (t * 1e9).round() as i64
}
