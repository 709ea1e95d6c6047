//! An identified model with the files that it comes from.

use std::ops::Deref;

use crate::Error;
use crate::config::Config;
use crate::estimate::{Estimate, ExportedRecord, InputRecord, Provenance, ReadingRecord};
use crate::pipeline::Identification;
use crate::report_data::report as report_page;

/// An identification from files: the result, and where it comes from.
#[derive(Debug)]
pub struct Run {
    /// The result.
    pub identification: Identification,
    /// The configuration.
    pub config: Config,
    /// Files that were read, with what their bytes hash to.
    pub inputs: Vec<InputRecord>,
    /// How the training logs were read, for logs of the same kind to be read alike.
    pub reading: ReadingRecord,
    /// Robot files beside the identified model.
    pub exported: ExportedRecord,
}

impl Deref for Run {
    type Target = Identification;

    fn deref(&self) -> &Identification {
        &self.identification
    }
}

impl Run {
    /// The report as one HTML page.
    ///
    /// # Errors
    /// As [`report`](crate::report_page).
    pub fn report(&self, estimate: &Estimate) -> Result<String, Error> {
        report_page(&self.identification, estimate)
    }

    /// The result file.
    pub fn estimate(&self) -> Estimate {
        let estimate = self.identification.estimate();
        Estimate {
            exported: self.exported.clone(),
            provenance: Provenance {
                inputs: self.inputs.clone(),
                reading: Some(self.reading.clone()),
                settings: self.config.stated(),
                ..estimate.provenance.clone()
            },
            ..estimate
        }
    }
}
