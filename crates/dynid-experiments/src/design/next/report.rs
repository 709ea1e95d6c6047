//! The page of a next motion: that of its design, with intervals.

use dynid_identify::Error;
use dynid_report as report;

use super::super::report::sentence;
use super::{IntervalRecord, NextRecord, NextRun, WantedState};

impl NextRun {
    /// The report as one HTML page.
    ///
    /// # Errors
    /// [`PageError`](dynid_config::fault::PageError), [`Error::UnknownLink`] for a frame that does not exist.
    pub fn report(&self, record: &NextRecord) -> Result<String, Error> {
        let designed = self.design.as_ref().zip(record.design.as_ref());
        let base = match designed {
            Some((run, design)) => run.report_data(&self.config, design)?,
            None => report::DesignReport {
                robot: report::Robot { name: self.robot.clone(), ..report::Robot::default() },
                ..report::DesignReport::default()
            },
        };
        let warning = |message: &String| report::Warning { message: message.clone(), hint: String::new() };
        let data = report::DesignReport {
            title: format!("What to record next with {}", self.robot),
            verdict: report::Verdict {
                status: record.verdict.status.into(),
                headline: sentence(&record.verdict.headline),
                ..base.verdict
            },
            warnings: record.verdict.warnings.iter().map(warning).collect(),
            intervals: record.wanted.iter().chain(&record.others).map(interval).collect(),
            ..base
        };
        dynid_config::fault::page(report::render_design(&data))
    }
}

fn interval(record: &IntervalRecord) -> report::IntervalForecast {
    let missed =
        |state: WantedState| !matches!(state, WantedState::Holds | WantedState::Reached | WantedState::Given);
    report::IntervalForecast {
        name: record.name.clone(),
        unit: record.unit.clone(),
        value: Some(record.value),
        before: record.half_width,
        wanted: record.wanted_half_width,
        after: record.half_width_after,
        state: record.state.map_or_else(String::new, |state| state.to_string()),
        is_missed: record.state.is_some_and(missed),
        note: record.combination.clone().unwrap_or_default(),
    }
}
