//! `.parquet`: a column each, compressed with snappy.

use std::path::Path;
use std::sync::Arc;

use dynid_files::output::{AtomicFile, OutputError};
use parquet::basic::{Compression, Repetition, Type as Physical};
use parquet::data_type::{DoubleType, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::types::Type;

use super::{Column, unwritable};
use crate::csv::GZIP_COMMENT;

/// Rows of a group.
const GROUP: usize = 1 << 20;

pub(super) fn write(path: &Path, names: &[String], columns: &[Column]) -> Result<(), OutputError> {
    let file = AtomicFile::create(path)?;
    fill(file, names, columns).map_err(|e| unwritable(path, e))?.finish()
}

fn fill(file: AtomicFile, names: &[String], columns: &[Column]) -> Result<AtomicFile, ParquetError> {
    let field = |(name, column): (&String, &Column)| {
        let (physical, repetition) = match column {
            Column::Float(x) if x.iter().any(|x| x.is_nan()) => (Physical::DOUBLE, Repetition::OPTIONAL),
            Column::Float(_) => (Physical::DOUBLE, Repetition::REQUIRED),
            Column::Whole(_) => (Physical::INT64, Repetition::REQUIRED),
        };
        Type::primitive_type_builder(name, physical).with_repetition(repetition).build().map(Arc::new)
    };
    let fields: Vec<_> = names.iter().zip(columns).map(field).collect::<Result<_, _>>()?;
    let optional: Vec<bool> = fields.iter().map(|f| f.is_optional()).collect();
    let schema = Arc::new(Type::group_type_builder("log").with_fields(fields).build()?);
    let properties = WriterProperties::builder()
        .set_compression(Compression::SNAPPY)
        .set_dictionary_enabled(false)
        .set_created_by(GZIP_COMMENT.to_owned())
        .build();
    let mut writer = SerializedFileWriter::new(file, schema, Arc::new(properties))?;
    let rows = columns.first().map_or(0, Column::rows);
    for start in (0..rows).step_by(GROUP) {
        let end = (start + GROUP).min(rows);
        let mut group = writer.next_row_group()?;
        for (column, optional) in columns.iter().zip(&optional) {
            let Some(mut into) = group.next_column()? else { break };
            match column {
                Column::Whole(x) => {
                    into.typed::<Int64Type>().write_batch(&x[start..end], None, None)?;
                }
                Column::Float(x) if *optional => {
                    let levels: Vec<i16> = x[start..end].iter().map(|x| i16::from(!x.is_nan())).collect();
                    let present: Vec<f64> = x[start..end].iter().copied().filter(|x| !x.is_nan()).collect();
                    into.typed::<DoubleType>().write_batch(&present, Some(&levels), None)?;
                }
                Column::Float(x) => {
                    into.typed::<DoubleType>().write_batch(&x[start..end], None, None)?;
                }
            }
            into.close()?;
        }
        group.close()?;
    }
    writer.into_inner()
}
