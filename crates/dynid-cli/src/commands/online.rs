//! `dynid online`.

mod view;

use std::io::{self, IsTerminal, Read};

use dynid::config::{Config, LogConfig};
use dynid::io::LogHeader;
use dynid::io::csv::Table;
use dynid::io::stream::{BadLine, LineFormat, LineSource, LinesEnd, StreamRows};
use dynid::online::{Checkpoint, Event, Session};
use serde::Serialize;

use super::run;
use crate::args::{OnlineArgs, StreamArg};
use dynid_terminal::message::{Failure, Notes, json_while_read, note};
use view::View;

/// Bad lines that are told one by one.
const TOLD: u64 = 5;

/// Lines of a stream that were passed over.
#[derive(Debug, Default, Serialize)]
struct Skipped {
    event: &'static str,
    lines: u64,
    /// The first ones: line number, what was wrong.
    first: Vec<(u64, String)>,
}

pub(crate) fn run(args: &OnlineArgs) -> Result<u8, Failure> {
    let mut config = Config::read_for_stream(&args.config)?;
    if !args.log.is_empty() {
        run::replace(&mut config, &args.log, Notes::new(args.quiet));
    }
    if args.stream.is_none() {
        config.find_logs()?;
    }
    if args.rows.is_some() {
        config.log.iter_mut().for_each(|log| log.rows = args.rows);
    }
    if args.checkpoint.is_some() {
        config.online.checkpoint.clone_from(&args.checkpoint);
    }
    let mut run = Run {
        output: Output::new(args),
        replay: args.replay || args.stream.is_none(),
        written: None,
        session: None,
        config,
    };
    let outcome = match args.stream {
        None => run.logs(),
        Some(format) => run.stream(format, args.quiet),
    };
    let outcome = match outcome {
        // Nobody listens any more: what was learned is kept.
        Err(Failure::Closed) => run.write_checkpoint().and(Err(Failure::Closed)),
        outcome => outcome,
    };
    outcome?;
    run.output.view.end();
    let changes = run.session.as_ref().map_or(0, |s| s.counts().changes);
    Ok(u8::from(changes > 0))
}

struct Run {
    config: Config,
    output: Output,
    replay: bool,
    /// Time of the stream at which the last checkpoint was written.
    written: Option<f64>,
    session: Option<Session>,
}

impl Run {
    fn logs(&mut self) -> Result<(), Failure> {
        if self.config.log.is_empty() {
            return Err(Failure::Usage(
                "expected logs in the configuration, or --stream".to_owned(),
                "name logs under [[log]] or with --log, or pipe samples in with --stream csv",
            ));
        }
        for log in self.config.log.clone() {
            let name = log.path.display().to_string();
            let columns = log.columns.as_ref().unwrap_or(&self.config.columns);
            let dynid::logs::WholeTable { table, header, .. } = dynid::logs::table(&log, columns)?;
            self.source(&name, &header, Some(&log))?;
            let mut row = vec![0.0; table.columns.len()];
            for k in part(&log, &table) {
                let cells = table.columns.iter().zip(&table.origin);
                row.iter_mut().zip(cells).for_each(|(x, (column, origin))| *x = column[k] + *origin as f64);
                self.row(&row)?;
            }
            self.flush()?;
        }
        self.finish()
    }

    fn stream(&mut self, format: StreamArg, quiet: bool) -> Result<(), Failure> {
        let format = match format {
            StreamArg::Csv => LineFormat::Csv,
            StreamArg::Json => LineFormat::Json,
        };
        let mut skipped = Skipped { event: "skipped", ..Skipped::default() };
        let outcome = self.lines(&mut LineSource::new(io::stdin().lock()), format, quiet, &mut skipped);
        if skipped.lines > 0 && !matches!(outcome, Err(Failure::Closed)) {
            self.output.plain(&skipped)?;
            if !quiet {
                note(&format!("{} lines skipped", skipped.lines));
            }
        }
        outcome
    }

    fn lines(
        &mut self,
        lines: &mut LineSource<impl Read>,
        format: LineFormat,
        quiet: bool,
        skipped: &mut Skipped,
    ) -> Result<(), Failure> {
        let mut rows = StreamRows::new("stdin", format).with_times(self.config.columns.time_names());
        loop {
            let mut outcome = Ok(());
            let before = lines.overlong_lines();
            let end = lines
                .read(|number, line| {
                    if outcome.is_ok() {
                        outcome = self.line(&mut rows, number, line, quiet, skipped);
                    }
                })
                .map_err(|e| Failure::Usage(format!("stdin: {e}"), "pipe samples in, one per line"))?;
            outcome?;
            skipped.lines += lines.overlong_lines() - before;
            self.flush()?;
            if end == LinesEnd::Ended {
                break;
            }
        }
        if self.session.is_none() {
            return Err(Failure::Usage(
                "stdin: expected a header and rows of numbers, found nothing".to_owned(),
                "pipe samples in, one per line",
            ));
        }
        self.finish()
    }

    fn line(
        &mut self,
        rows: &mut StreamRows,
        number: u64,
        line: &[u8],
        quiet: bool,
        skipped: &mut Skipped,
    ) -> Result<(), Failure> {
        match rows.read(number, line)? {
            None => {}
            Some(Err(bad)) => tell(number, &bad, quiet, skipped),
            Some(Ok(row)) => {
                let row = row.to_vec();
                if self.session.is_none() {
                    let header = LogHeader::of_names(rows.header().unwrap_or_default());
                    self.source("stdin", &header, None)?;
                }
                self.row(&row)?;
            }
        }
        Ok(())
    }

    /// Begins a session, or another source of the one there is.
    fn source(&mut self, name: &str, header: &LogHeader, log: Option<&LogConfig>) -> Result<(), Failure> {
        let columns = log.and_then(|l| l.columns.as_ref());
        let Run { session, output, .. } = self;
        if let Some(session) = session {
            output.passing(|emit| Ok(session.source(name, header.clone(), columns, emit)?))?;
            return Ok(());
        }
        let mut session = Session::new(&self.config, name, header.clone(), columns)?;
        self.output.view.begin(&session.joints());
        if let Some(path) = &self.config.online.checkpoint
            && let Some(found) = Checkpoint::read(path)?
        {
            session.resume(&found, &path.display().to_string(), self.replay)?;
            self.written = session.latest();
            self.output.view.note(&format!("resumed from {}", path.display()));
        }
        self.session = Some(session);
        Ok(())
    }

    fn row(&mut self, row: &[f64]) -> Result<(), Failure> {
        let Run { session: Some(session), output, .. } = self else { return Ok(()) };
        let worked = output.passing(|emit| Ok(session.row(row, emit)?))?;
        if worked { self.checkpoint_if_due() } else { Ok(()) }
    }

    fn flush(&mut self) -> Result<(), Failure> {
        let Run { session: Some(session), output, .. } = self else { return Ok(()) };
        output.passing(|emit| Ok(session.flush(emit)?))?;
        self.checkpoint_if_due()
    }

    fn checkpoint_if_due(&mut self) -> Result<(), Failure> {
        let Some(latest) = self.session.as_ref().and_then(Session::latest) else { return Ok(()) };
        match self.written {
            Some(written) if latest - written < self.config.online.checkpoint_s => Ok(()),
            _ => self.write_checkpoint(),
        }
    }

    fn write_checkpoint(&mut self) -> Result<(), Failure> {
        let (Some(session), Some(path)) = (&mut self.session, &self.config.online.checkpoint) else {
            return Ok(());
        };
        if let Some(checkpoint) = session.checkpoint()? {
            checkpoint.write(path)?;
            self.written = session.latest();
        }
        Ok(())
    }

    /// The state before the end goes to the checkpoint, so that a continued stream finds it.
    fn finish(&mut self) -> Result<(), Failure> {
        self.flush()?;
        self.write_checkpoint()?;
        let Run { session: Some(session), output, .. } = self else { return Ok(()) };
        output.passing(|emit| Ok(session.finish(emit)?))
    }
}

/// Rows of a log that are to be used.
fn part(log: &LogConfig, table: &Table) -> std::ops::Range<usize> {
    let rows = table.rows as f64;
    log.part.map_or(0..table.rows, |(from, to)| (from * rows).round() as usize..(to * rows).round() as usize)
}

fn tell(number: u64, bad: &BadLine, quiet: bool, skipped: &mut Skipped) {
    skipped.lines += 1;
    if skipped.lines <= TOLD {
        skipped.first.push((number, bad.to_string()));
        if !quiet {
            note(&format!("stdin: line {number} skipped: {bad}"));
        }
    }
}

/// Where events go.
struct Output {
    lines: bool,
    view: View,
}

impl Output {
    fn new(args: &OnlineArgs) -> Output {
        let lines = args.json || !io::stdout().is_terminal();
        Output { lines, view: View::new(args.quiet, lines) }
    }

    /// Runs work that emits events; the first event that cannot be written ends it.
    fn passing<T>(
        &mut self,
        work: impl FnOnce(&mut dyn FnMut(Event)) -> Result<T, Failure>,
    ) -> Result<T, Failure> {
        let mut written = Ok(());
        let done = work(&mut |event| {
            self.view.show(&event);
            if self.lines && written.is_ok() {
                written = json_while_read(&event);
            }
        });
        written?;
        done
    }

    fn plain(&self, value: &impl Serialize) -> Result<(), Failure> {
        if self.lines { json_while_read(value) } else { Ok(()) }
    }
}
