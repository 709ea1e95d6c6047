//! A stream from its first row to its end.

use dynid_logs::{LogHeader, MappingSpec};
use dynid_model::EffortModel;

use super::asked::Asked;
use super::checkpoint::{Checkpoint, Place};
use super::event::{Counts, Event};
use super::learning::{Learned, Structure};
use super::running::Running;
use super::samples::{Sample, Samples};
use crate::Error;
use crate::config::Config;

/// Time between records that follow each other, s.
const BETWEEN_RECORDS: f64 = 1.0;
/// Shortest stretch at the end of a stream that is learned from, in parts of the one asked for.
const SHORTEST: f64 = 0.25;
/// By how much a stretch grows that does not suffice.
const GROWTH: f64 = 1.5;
/// Longest stretch that is held while nothing can be learned, in parts of the first one.
const LONGEST: f64 = 30.0;

#[derive(Debug)]
enum Phase {
    Learning {
        samples: Vec<Sample>,
        /// Length at which learning is tried next, s.
        wanted_s: f64,
    },
    Running(Box<Running>),
}

/// On-line identification of one robot.
///
/// Call [`Session::source`] for every record or stream, [`Session::row`] for every row, [`Session::flush`] whenever no further row is
/// at hand, and [`Session::finish`] at the end. Events do not depend on when `flush` is called, but for when they come.
#[derive(Debug)]
pub struct Session {
    asked: Asked,
    structure: Structure,
    samples: Samples,
    phase: Phase,
    /// What is added to the times of the present source.
    offset: f64,
    latest: Option<f64>,
    begins: bool,
    /// Rows of all sources so far.
    rows: u64,
    /// Rows of a replayed stream that a checkpoint has seen.
    seen: u64,
    counts: Counts,
}

impl Session {
    /// A session on a stream with these columns. `name` stands in messages; `columns` say which is which, by default the
    /// configuration's.
    ///
    /// # Errors
    /// [`Error`]: bad configuration, robot or columns.
    pub fn new(
        config: &Config,
        name: &str,
        header: impl Into<LogHeader>,
        columns: Option<&MappingSpec>,
    ) -> Result<Session, Error> {
        let asked = Asked::of(config)?;
        let axes = Structure::new(&asked, &[])?.axes();
        let samples = Samples::new(name, &header.into(), &axes, columns.unwrap_or(&asked.columns))?;
        let structure = Structure::new(&asked, &samples.not_logged())?;
        Ok(Session {
            phase: Phase::Learning { samples: Vec::new(), wanted_s: asked.online.learn_s },
            asked,
            structure,
            samples,
            offset: 0.0,
            latest: None,
            begins: false,
            rows: 0,
            seen: 0,
            counts: Counts::default(),
        })
    }

    /// What follows comes from another record or stream, a second after the last one.
    ///
    /// # Errors
    /// [`Error`]: columns of other joints than before.
    pub fn source(
        &mut self,
        name: &str,
        header: impl Into<LogHeader>,
        columns: Option<&MappingSpec>,
        emit: &mut dyn FnMut(Event),
    ) -> Result<(), Error> {
        self.flush(emit)?;
        let still = self.samples.not_logged();
        let axes = Structure::new(&self.asked, &[])?.axes();
        let samples = Samples::new(name, &header.into(), &axes, columns.unwrap_or(&self.asked.columns))?;
        if samples.not_logged() != still {
            return Err(Error::Unsupported(format!(
                "{name}: expected columns of the same joints as before, not logged: {still:?}, found {:?}",
                samples.not_logged()
            )));
        }
        self.samples = samples;
        self.begins = true;
        Ok(())
    }

    /// Joints in the order of all figures.
    pub fn joints(&self) -> Vec<String> {
        self.structure.joints()
    }

    /// Takes a row of the stream; whether the rows taken so far were worked off.
    ///
    /// # Errors
    /// [`Error`]: what cannot be learned from or estimated.
    pub fn row(&mut self, row: &[f64], emit: &mut dyn FnMut(Event)) -> Result<bool, Error> {
        let due = self.samples.push(row);
        if due {
            self.flush(emit)?;
        }
        Ok(due)
    }

    /// Works off the rows taken so far.
    ///
    /// # Errors
    /// Fails as [`Session::row`] does.
    pub fn flush(&mut self, emit: &mut dyn FnMut(Event)) -> Result<(), Error> {
        let samples = self.samples.drain(&self.asked, self.structure.model.channels())?;
        for mut sample in samples {
            self.rows += 1;
            if self.rows <= self.seen {
                self.counts.already_seen += 1;
                self.begins = false;
                continue;
            }
            if std::mem::take(&mut self.begins) {
                self.offset = self.latest.map_or(0.0, |t| t + BETWEEN_RECORDS - sample.time);
                if let Phase::Running(running) = &mut self.phase {
                    running.interrupt();
                }
            }
            sample.time += self.offset;
            self.latest = Some(sample.time);
            self.sample(sample, emit)?;
        }
        if let Phase::Running(running) = &mut self.phase {
            running.drain(&self.asked, &self.structure, emit)?;
        }
        Ok(())
    }

    fn sample(&mut self, sample: Sample, emit: &mut dyn FnMut(Event)) -> Result<(), Error> {
        match &mut self.phase {
            Phase::Running(running) => running.sample(&sample),
            Phase::Learning { samples, wanted_s } => {
                let started = samples.first().map_or(sample.time, |s| s.time);
                let length = sample.time - started;
                samples.push(sample);
                if length >= *wanted_s {
                    self.learn(emit)?;
                }
            }
        }
        Ok(())
    }

    /// Tries to learn from what has come.
    fn learn(&mut self, emit: &mut dyn FnMut(Event)) -> Result<(), Error> {
        let Phase::Learning { samples, wanted_s } = &mut self.phase else { return Ok(()) };
        let time = samples.last().map_or(0.0, |s| s.time);
        match Learned::from_samples(&self.asked, &self.structure, "the first stretch", samples)? {
            Err(reason) => {
                if *wanted_s >= LONGEST * self.asked.online.learn_s {
                    let half = samples.len() / 2;
                    samples.drain(..half);
                } else {
                    *wanted_s *= GROWTH;
                }
                emit(Event::Learning { time, reason });
            }
            Ok(learned) => {
                let mut running = Running::new(&self.asked, &self.structure, learned)?;
                running.absorb(&self.asked, samples)?;
                emit(running.introduction(&self.structure, time));
                self.phase = Phase::Running(Box::new(running));
            }
        }
        Ok(())
    }

    /// Ends the session: learns from what there is if nothing was learned yet, reports the estimate.
    ///
    /// # Errors
    /// Fails as [`Session::row`] does; [`Error::TooShort`] if nothing could be learned.
    pub fn finish(&mut self, emit: &mut dyn FnMut(Event)) -> Result<(), Error> {
        self.flush(emit)?;
        if let Phase::Learning { samples, .. } = &self.phase {
            let length = samples.last().map_or(0.0, |s| s.time - samples[0].time);
            let least = SHORTEST * self.asked.online.learn_s;
            let mut reason = format!("expected at least {least:.2} s, found {length:.2} s");
            if length >= least {
                self.learn(&mut |event| match event {
                    Event::Learning { reason: why, .. } => reason = why,
                    event => emit(event),
                })?;
            }
            if matches!(self.phase, Phase::Learning { .. }) {
                return Err(Error::TooShort {
                    file: "the stream".to_owned(),
                    message: format!("it ended before anything could be learned: {reason}"),
                });
            }
        }
        if let Phase::Running(running) = &mut self.phase {
            running.finish(&self.asked, &self.structure, emit)?;
        }
        emit(Event::End { counts: self.counts() });
        Ok(())
    }

    /// Time of the latest sample, s.
    pub fn latest(&self) -> Option<f64> {
        self.latest
    }

    /// Rows and samples so far.
    pub fn counts(&self) -> Counts {
        match &self.phase {
            Phase::Running(running) => Counts { already_seen: self.counts.already_seen, ..running.counts },
            Phase::Learning { samples, .. } => Counts { samples: samples.len() as u64, ..self.counts },
        }
    }

    /// The state, once something was learned; what was pushed must have been flushed.
    ///
    /// # Errors
    /// [`Error::Read`] if the robot file has gone.
    pub fn checkpoint(&mut self) -> Result<Option<Checkpoint>, Error> {
        let (Phase::Running(running), Some(latest)) = (&mut self.phase, self.latest) else { return Ok(None) };
        let place = Place { offset: self.offset, latest, rows: self.rows.max(self.seen) };
        Checkpoint::of(&self.asked, &mut self.samples, running, place).map(Some)
    }

    /// Goes on from a checkpoint, before any row.
    ///
    /// `replay`: the stream begins again from its start; as many rows as the checkpoint has seen are passed over. `file`
    /// stands in messages.
    ///
    /// # Errors
    /// [`Error::Checkpoint`]: of another configuration, robot or stream, or damaged.
    pub fn resume(&mut self, checkpoint: &Checkpoint, file: &str, replay: bool) -> Result<(), Error> {
        let (running, place) =
            checkpoint.restore(&self.asked, &self.structure, &mut self.samples, file, replay)?;
        self.phase = Phase::Running(Box::new(running));
        (self.offset, self.latest) = (place.offset, Some(place.latest));
        (self.rows, self.seen) = if replay { (0, place.rows) } else { (place.rows, place.rows) };
        Ok(())
    }
}
