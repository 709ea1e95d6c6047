//! Values of the columns that a mapping names.

use super::{ColumnUse, MappingError};

use crate::csv::Table;

/// A column as it was read, and what was taken off its values. The table may hold some of the header's columns alone.
pub(super) fn raw_column<'t>(
    table: &'t Table,
    signal: &str,
    column: &ColumnUse,
) -> Result<(&'t [f64], i64), MappingError> {
    let in_place = table.header.get(column.column).is_some_and(|name| *name == column.name);
    let place = if in_place { Some(column.column) } else { place_of(table, column) };
    match place {
        Some(k) => Ok((&table.columns[k], table.origin[k])),
        None => Err(MappingError::UnknownColumn {
            signal: signal.to_owned(),
            column: column.name.clone(),
            header: table.header.clone(),
            nearest: Vec::new(),
        }),
    }
}

/// Place of a column in a table.
pub(super) fn place_of(table: &Table, column: &ColumnUse) -> Option<usize> {
    table.header.iter().position(|name| *name == column.name)
}
