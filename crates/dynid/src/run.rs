//! An identified model with the files that it comes from.

use std::ops::Deref;

use crate::Error;
use crate::config::Config;
use crate::estimate::{Estimate, ExportedRecord, InputRecord, Provenance, ReadingRecord};
use crate::export::{CheckStates, Exported, Identified, RobotExport, Source};
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

    /// The identified robot alone, for [`RobotExport`](RobotExport) and [`json`](crate::export::json()).
    pub fn identified(&self) -> Identified<'_> {
        Identified::of(&self.identification)
    }

    /// The robot file with identified inertias and friction, an MJCF in place, else a URDF ([`RobotExport::robot_file`]), checked on the
    /// training logs; links that no body could be are written as they are and named in the notes.
    ///
    /// # Errors
    /// Fails as [`Source::read`], [`RobotExport::new`] and [`RobotExport::robot_file`] do.
    pub fn robot_file(&self) -> Result<Exported, Error> {
        let source = Source::read(&self.robot.path)?;
        let export =
            RobotExport::new(self.identified(), &source)?.with_projections(&self.exported.projections);
        let states = CheckStates::logs(&self.logs, self.state_hz, &self.conditioning_settings)?;
        let mut exported = export.robot_file(&states)?;
        exported.notes.extend(
            export
                .faults()
                .iter()
                .map(|f| format!("link `{}` {}: simulators refuse such a robot", f.link, f.fault)),
        );
        Ok(exported)
    }

    /// The loops beside the URDF of a mechanism that has some, as [`RobotExport::loops`].
    ///
    /// # Errors
    /// Fails as [`Source::read`] and [`RobotExport::new`] do.
    pub fn loops(&self, urdf: &str) -> Result<Option<String>, Error> {
        let source = Source::read(&self.robot.path)?;
        Ok(RobotExport::new(self.identified(), &source)?.loops(urdf))
    }
}
