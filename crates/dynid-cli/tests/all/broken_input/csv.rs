//! Tables with a fault.

#![expect(clippy::unwrap_used, reason = "helpers of tests outside of test functions")]

/// A CSV with one field of a data row (from 1) replaced.
pub(crate) fn with_field(csv: &str, row: usize, column: &str, value: &str) -> String {
    let mut lines: Vec<String> = csv.lines().map(str::to_owned).collect();
    let at = lines[0].split(',').position(|name| name == column).unwrap();
    let mut fields: Vec<&str> = lines[row].split(',').collect();
    fields[at] = value;
    lines[row] = fields.join(",");
    lines.join("\n") + "\n"
}

/// A CSV with a column mapped from row number (from 0) and value.
pub(crate) fn with_column(csv: &str, column: &str, value: impl Fn(usize, f64) -> f64) -> String {
    let at = csv.lines().next().unwrap().split(',').position(|name| name == column).unwrap();
    let mut out = csv.lines().next().unwrap().to_owned() + "\n";
    for (row, line) in csv.lines().skip(1).enumerate() {
        let mut fields: Vec<String> = line.split(',').map(str::to_owned).collect();
        fields[at] = value(row, fields[at].parse().unwrap()).to_string();
        out += &(fields.join(",") + "\n");
    }
    out
}

/// A CSV without a column.
pub(crate) fn without(csv: &str, column: &str) -> String {
    let at = csv.lines().next().unwrap().split(',').position(|name| name == column).unwrap();
    let keep = |line: &str| {
        let kept: Vec<&str> = line.split(',').enumerate().filter(|(k, _)| *k != at).map(|(_, f)| f).collect();
        kept.join(",") + "\n"
    };
    csv.lines().map(keep).collect()
}

/// The header and as many rows.
pub(crate) fn first_rows(csv: &str, rows: usize) -> String {
    csv.lines().take(rows + 1).map(|line| line.to_owned() + "\n").collect()
}

/// A log of `t, q1.., tau1..` with sines, 200 rows at 100 Hz.
pub(crate) fn sines(joints: usize) -> String {
    let names = |prefix: &str| (1..=joints).map(|j| format!(",{prefix}{j}")).collect::<String>();
    let mut out = format!("t{}{}\n", names("q"), names("tau"));
    for row in 0..200 {
        let t = f64::from(row) * 0.01;
        out += &t.to_string();
        for k in 0..2 * joints {
            out += &format!(",{}", (t * (1.0 + k as f64)).sin());
        }
        out += "\n";
    }
    out
}
