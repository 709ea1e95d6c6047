//! The state of a session, to be written and taken up again.

use std::path::Path;

use dynid_config::sealed;
use dynid_model::EffortModel;
use dynid_motion::live::LiveSettings;
use dynid_rows::conditioning::LiveRowSettings;
use dynid_words::Transfer;
use serde::{Deserialize, Serialize};

use super::asked::Asked;
use super::learning::{Learned, Structure};
use super::running::Running;
use super::samples::Samples;
use super::usual::Innovations;
use crate::Error;

const SCHEMA: &str = "dynid-online-checkpoint/3";

/// State of a session after whole rows. Goes on with the same bits as a session that was never interrupted.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct Checkpoint {
    schema: String,
    /// What the state depends on: program, robot, configuration, columns.
    fingerprint: String,
    /// Words of 64 bits, 16 hexadecimal digits each.
    state: String,
}

/// Where a session stands in its stream.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Place {
    /// What is added to the times of the present source, s.
    pub(super) offset: f64,
    /// Latest time, s.
    pub(super) latest: f64,
    /// Rows of all sources.
    pub(super) rows: u64,
}

impl Place {
    fn transfer(&mut self, transfer: &mut Transfer<'_>) {
        transfer.real(&mut self.offset);
        transfer.real(&mut self.latest);
        transfer.integer(&mut self.rows);
    }
}

impl Checkpoint {
    pub(super) fn of(
        asked: &Asked,
        samples: &mut Samples,
        running: &mut Running,
        mut place: Place,
    ) -> Result<Checkpoint, Error> {
        let mut words = Vec::new();
        let mut save = Transfer::Save(&mut words);
        place.transfer(&mut save);
        transfer_clock(samples, &mut save);
        transfer_learned(&mut running.learned, &mut save);
        running.transfer(&mut save);
        let mut state = String::with_capacity(16 * words.len());
        for word in &words {
            state.push_str(&format!("{word:016x}"));
        }
        Ok(Checkpoint { schema: SCHEMA.to_owned(), fingerprint: fingerprint(asked, samples), state })
    }

    /// `file` stands in messages. `replay`: the stream's clock begins again.
    pub(super) fn restore(
        &self,
        asked: &Asked,
        structure: &Structure,
        samples: &mut Samples,
        file: &str,
        replay: bool,
    ) -> Result<(Running, Place), Error> {
        let fault = |message: &str| Error::Checkpoint { file: file.to_owned(), message: message.to_owned() };
        if self.schema != SCHEMA {
            return Err(fault(&format!("expected schema `{SCHEMA}`, found `{}`", self.schema)));
        }
        if self.fingerprint != fingerprint(asked, samples) {
            return Err(fault(
                "it belongs to another robot, configuration or stream; delete it to begin anew",
            ));
        }
        let damaged = || fault("it is damaged; delete it to begin anew");
        let digits = self.state.as_bytes();
        let word = |w: &[u8]| {
            std::str::from_utf8(w)
                .ok()
                .filter(|w| w.len() == 16)
                .and_then(|w| u64::from_str_radix(w, 16).ok())
        };
        let words = digits.chunks(16).map(word).collect::<Option<Vec<u64>>>().ok_or_else(damaged)?;
        let mut load = Transfer::load(&words);
        let mut place = Place { offset: 0.0, latest: 0.0, rows: 0 };
        place.transfer(&mut load);
        let (origin, taken) = samples.clock();
        let before = (*origin, *taken);
        transfer_clock(samples, &mut load);
        if replay {
            let (origin, taken) = samples.clock();
            (*origin, *taken) = before;
        }
        let mut learned = blank(structure);
        transfer_learned(&mut learned, &mut load);
        if !learned.fits(structure) {
            return Err(damaged());
        }
        let mut running = Running::new(asked, structure, learned)?;
        running.transfer(&mut load);
        if !load.complete() {
            return Err(damaged());
        }
        Ok((running, place))
    }

    /// Reads a checkpoint; `None` if the file does not exist yet.
    ///
    /// # Errors
    /// [`Error::Read`], [`Error::Checkpoint`].
    pub fn read(path: &Path) -> Result<Option<Checkpoint>, Error> {
        let Some(text) = sealed::read(path, SCHEMA)? else { return Ok(None) };
        let fault = |e: serde_json::Error| Error::Checkpoint {
            file: path.display().to_string(),
            message: e.to_string(),
        };
        Ok(Some(serde_json::from_str(&text).map_err(fault)?))
    }

    /// Writes the checkpoint; a reader sees the old one or the new one, never a part.
    ///
    /// # Errors
    /// [`Error::Output`].
    pub fn write(&self, path: &Path) -> Result<(), Error> {
        let fault = |e: serde_json::Error| Error::Checkpoint {
            file: path.display().to_string(),
            message: e.to_string(),
        };
        let text = serde_json::to_string(self).map_err(fault)?;
        sealed::write(path, &text)
    }
}

/// Differs between runs whose states differ.
fn fingerprint(asked: &Asked, samples: &Samples) -> String {
    let text = format!("{} {} {:?}", crate::VERSION, asked.identity, samples.header());
    dynid_files::digest::sha256(text.as_bytes())
}

fn transfer_clock(samples: &mut Samples, transfer: &mut Transfer<'_>) {
    let (origin, taken) = samples.clock();
    let mut known = origin.is_some();
    let mut value = origin.unwrap_or(0.0);
    transfer.flag(&mut known);
    transfer.real(&mut value);
    *origin = known.then_some(value);
    transfer.integer(taken);
}

fn transfer_learned(learned: &mut Learned, transfer: &mut Transfer<'_>) {
    let LiveRowSettings { states, kernel_hz, least_speed } = &mut learned.rows;
    for value in [&mut states.rate_hz, &mut states.state_hz, &mut states.delay_samples, kernel_hz] {
        transfer.real(value);
    }
    least_speed.iter_mut().for_each(|list| transfer.list(list, 1));
    for list in [&mut learned.start, &mut learned.prior_std, &mut learned.efforts, &mut learned.noise] {
        transfer.list(list, 1);
    }
    let Innovations { size, every, inflation } = &mut learned.innovations;
    transfer.list(size, 1);
    transfer.count(every, MOST_ROWS);
    transfer.real(inflation);
}

/// Longest correlation time that a checkpoint is believed, rows.
const MOST_ROWS: usize = 1 << 40;

fn blank(structure: &Structure) -> Learned {
    Learned {
        rows: LiveRowSettings {
            states: LiveSettings { rate_hz: 0.0, state_hz: 0.0, delay_samples: 0.0 },
            kernel_hz: 0.0,
            least_speed: vec![Vec::new(); structure.model.outputs().len()],
        },
        start: Vec::new(),
        prior_std: Vec::new(),
        efforts: Vec::new(),
        noise: Vec::new(),
        innovations: Innovations::stated(structure.model.outputs().len()),
    }
}
