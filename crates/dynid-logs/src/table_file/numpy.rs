//! `.npz`: a zip of arrays of NumPy.

use std::io::{BufWriter, Write};
use std::path::Path;

use dynid_files::output::{AtomicFile, OutputError};
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipWriter};

use super::{Column, unwritable};
use crate::csv::GZIP_COMMENT;

/// The header of an array takes a multiple of this, bytes.
const ALIGNMENT: usize = 64;

pub(super) fn write(path: &Path, names: &[String], columns: &[Column]) -> Result<(), OutputError> {
    let mut file = BufWriter::new(AtomicFile::create(path)?);
    let mut fill = || {
        let mut zip = ZipWriter::new_stream(&mut file);
        zip.set_comment(GZIP_COMMENT)?;
        let options =
            SimpleFileOptions::default().compression_method(CompressionMethod::Deflated).large_file(true);
        for (name, column) in names.iter().zip(columns) {
            zip.start_file(format!("{name}.npy"), options)?;
            let kind = if matches!(column, Column::Float(_)) { "f8" } else { "i8" };
            let head =
                format!("{{'descr': '<{kind}', 'fortran_order': False, 'shape': ({},), }}", column.rows());
            // Ten bytes stand before it, a line end behind it.
            let length = (10 + head.len() + 1).next_multiple_of(ALIGNMENT) - 10;
            zip.write_all(b"\x93NUMPY\x01\x00")?;
            zip.write_all(&(length as u16).to_le_bytes())?;
            zip.write_all(format!("{head:<width$}\n", width = length - 1).as_bytes())?;
            match column {
                Column::Float(x) => x.iter().try_for_each(|x| zip.write_all(&x.to_le_bytes()))?,
                Column::Whole(x) => x.iter().try_for_each(|x| zip.write_all(&x.to_le_bytes()))?,
            }
        }
        zip.finish().map(|_| ())
    };
    fill().map_err(|e: zip::result::ZipError| unwritable(path, e))?;
    file.into_inner().map_err(|e| unwritable(path, e.into_error()))?.finish()
}
