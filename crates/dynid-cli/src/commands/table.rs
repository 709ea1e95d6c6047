//! Aligned tables of numbers for people.

use dynid::estimate::{ByMotion, FileFit, FitValues};

/// Share of the samples at rest from which on they are shown apart.
pub(super) const STANDS: f64 = 0.05;

/// A number with four significant digits, or a dash; whole numbers without decimals.
pub(super) fn number(x: Option<f64>) -> String {
    match x {
        None => "-".to_owned(),
        Some(x) if x.fract() == 0.0 && x.abs() < 1e6 => format!("{x:.0}"),
        Some(x) => {
            let magnitude = x.abs().log10().floor() as i32;
            if (-4..5).contains(&magnitude) {
                let decimals = (3 - magnitude).max(0) as usize;
                format!("{x:.decimals$}")
            } else {
                format!("{x:.3e}")
            }
        }
    }
}

/// Rows under a header, columns right-aligned but for the first.
pub(super) fn aligned(header: &[&str], rows: &[Vec<String>]) -> String {
    let width = |c: usize| {
        rows.iter().map(|r| r[c].chars().count()).chain([header[c].chars().count()]).max().unwrap_or(0)
    };
    let widths: Vec<usize> = (0..header.len()).map(width).collect();
    let line = |cells: &[String]| {
        let mut out = String::new();
        for (c, (cell, w)) in cells.iter().zip(&widths).enumerate() {
            let pad = " ".repeat(w - cell.chars().count());
            if c == 0 {
                out.push_str(cell);
                out.push_str(&pad);
            } else {
                out.push_str("  ");
                out.push_str(&pad);
                out.push_str(cell);
            }
        }
        out.trim_end().to_owned() + "\n"
    };
    let mut out = line(&header.iter().map(|h| (*h).to_owned()).collect::<Vec<_>>());
    for row in rows {
        out.push_str(&line(row));
    }
    out
}

/// Per-joint figures of a log, raw beside filtered; filtered ones in motion and at rest where a joint stands in more than
/// [`STANDS`] of the samples.
pub(super) fn agreement(
    joints: &[String],
    raw: &FitValues,
    filtered: &FitValues,
    by_motion: &ByMotion,
) -> String {
    let stands = by_motion.standing_share.iter().any(|share| *share > STANDS);
    let percent = |x: Option<f64>| x.map(|x| 100.0 * x);
    let rows: Vec<Vec<String>> = joints
        .iter()
        .enumerate()
        .map(|(j, name)| {
            let mut row = vec![
                name.clone(),
                number(raw.rms[j]),
                number(filtered.rms[j]),
                number(percent(filtered.nrmse[j])),
                number(filtered.r2[j]),
                number(filtered.correlation.get(j).copied().flatten()),
                number(filtered.relative_error_per_joint[j]),
            ];
            if stands {
                row.push(format!("{:.0}", 100.0 * by_motion.standing_share[j]));
                row.push(number(by_motion.moving.rms[j]));
                row.push(number(by_motion.moving.r2[j]));
                row.push(number(by_motion.standing.rms[j]));
            }
            row
        })
        .collect();
    let mut head =
        vec!["joint", "rms raw", "rms filtered", "nrmse %", "R²", "correlation", "relative error %"];
    if stands {
        head.extend(["stands, %", "rms moving", "R² moving", "rms standing"]);
    }
    aligned(&head, &rows)
}

/// What a robot file loses per joint: effort, its share, and the file's own error; `with_rotor`: once rotor inertias are added.
pub(super) fn loss(joints: &[String], file: &FileFit, with_rotor: Option<&FileFit>) -> String {
    let cells = |fit: &FileFit, j: usize| {
        [Some(fit.loss[j]), fit.loss_percent[j], fit.relative_error_per_joint[j]].map(number)
    };
    let row = |(j, name): (usize, &String)| {
        let mut row = vec![format!("    {name}")];
        row.extend(cells(file, j));
        row.extend(with_rotor.iter().flat_map(|fit| cells(fit, j)));
        row
    };
    let rows: Vec<Vec<String>> = joints.iter().enumerate().map(row).collect();
    let mut header = vec!["    joint", "effort lost", "lost %", "error %"];
    if with_rotor.is_some() {
        header.extend(["with rotor: lost", "lost %", "error %"]);
    }
    aligned(&header, &rows).trim_end().to_owned()
}
