//! Row 4: the paper's Table 3, recomputed.

use serde_json::json;

use super::reference;
use super::settings::{PrintedRow, Settings};
use crate::{Row, StudyError};

/// Error with clearance over error with ideal joints.
pub(super) fn ratio(row: &PrintedRow) -> f64 {
    ((row.clearance - row.system) / (row.ideal - row.system)).abs()
}

/// To three significant digits.
pub(super) fn matches_print(row: &PrintedRow) -> bool {
    (ratio(row) / row.ratio - 1.0).abs() < 5e-3
}

pub(super) fn row(settings: &Settings) -> Result<Row, StudyError> {
    let table = &settings.table3;
    let reference = reference::table()?;
    let alike = table.iter().zip(&reference.rows).map(|(row, wanted)| {
        let same = row.name == wanted.name && matches_print(row) == wanted.matches_3_digits;
        if same { (ratio(row) - wanted.recomputed).abs() } else { f64::INFINITY }
    });
    let error = alike.fold(0.0, f64::max);
    let closer = table.iter().filter(|r| ratio(r) < 1.0).count();
    let unlike: Vec<&str> = table.iter().filter(|r| !matches_print(r)).map(|r| r.name.as_str()).collect();
    let ratios: serde_json::Map<_, _> = table.iter().map(|r| (r.name.clone(), json!(ratio(r)))).collect();
    Ok(Row::new(
        "4",
        "Table 3: with clearance nearly all parameters are closer to the system's; ratios of errors recomputed from the printed values",
        "9 of 11 closer; ratios as printed to 3 digits but for Iyy2; recomputed ones as the reference's to 1e-12",
        json!({ "ratios": ratios, "closer": closer, "not_as_printed": unlike, "error": error }),
        format!(
            "{closer} of {} closer; not as printed: {}; {error:.1e}",
            table.len(),
            table
                .iter()
                .filter(|r| !matches_print(r))
                .map(|r| format!("{} ({:.4} against {:.4})", r.name, ratio(r), r.ratio))
                .collect::<Vec<_>>()
                .join(", ")
        ),
        closer == reference.closer_with_clearance
            && table.len() == reference.rows.len()
            && unlike == ["Iyy2"]
            && error <= 1e-12,
    ))
}
