//! What people see of a session: a live view on a terminal, plain lines elsewhere.

use std::io::{self, IsTerminal};

use dynid::online::{Event, Moved, ParameterValue};
use dynid_terminal::message::note;
use indicatif::{ProgressBar, ProgressStyle};

use crate::commands::table;

/// Parameters of the live view; more do not fit on a screen.
const SHOWN: usize = 24;
/// Width of a band, characters.
const BAND: usize = 21;

enum Kind {
    /// Nothing, or alarms alone beside JSON lines.
    Alarms,
    Lines,
    Live(ProgressBar),
}

/// The view of a session.
pub(super) struct View {
    kind: Kind,
    quiet: bool,
    joints: Vec<String>,
}

impl View {
    /// `lines`: JSON lines go to stdout.
    pub(super) fn new(quiet: bool, lines: bool) -> View {
        let live = io::stderr().is_terminal() && !(lines && io::stdout().is_terminal());
        let kind = match (quiet, live, lines) {
            (true, ..) | (_, false, true) => Kind::Alarms,
            (_, true, _) => {
                let bar = ProgressBar::new_spinner();
                if let Ok(style) = ProgressStyle::with_template("{msg}") {
                    bar.set_style(style);
                }
                Kind::Live(bar)
            }
            _ => Kind::Lines,
        };
        View { kind, quiet, joints: Vec::new() }
    }

    pub(super) fn begin(&mut self, joints: &[String]) {
        self.joints = joints.to_vec();
        if let Kind::Live(bar) = &self.kind {
            bar.set_message("learning from the first stretch ...");
        }
    }

    /// A line that stays.
    pub(super) fn note(&self, text: &str) {
        match &self.kind {
            _ if self.quiet => {}
            Kind::Live(bar) => bar.suspend(|| note(text)),
            _ => note(text),
        }
    }

    pub(super) fn end(&self) {
        if let Kind::Live(bar) = &self.kind {
            bar.abandon();
        }
    }

    pub(super) fn show(&self, event: &Event) {
        match event {
            Event::Learned { time, kernel_hz, lag_s, parameters, warnings, .. } => {
                for warning in warnings {
                    self.note(&format!("warning: {warning}"));
                }
                self.note(&format!(
                    "{time:.2} s: learned, {} base parameters, kernel {kernel_hz:.2} Hz, estimates {lag_s:.2} s behind",
                    parameters.len()
                ));
            }
            Event::Learning { time, reason } => self.note(&format!("{time:.2} s: still learning: {reason}")),
            Event::Withheld { time, .. } => self.note(&format!(
                "{time:.2} s: the motion leaves the region that was learned: alarms are withheld, learning goes on"
            )),
            Event::Watching { time } => {
                self.note(&format!("{time:.2} s: the region is learned: alarms are given again"));
            }
            Event::Alarm { time, .. } => self.note(&format!("{time:.2} s: alarm")),
            Event::Change { time, confirmed: false, .. } => {
                self.note(&format!("{time:.2} s: the alarm was false: nothing changed"));
            }
            Event::Change { time, moved, alternatives, .. } => {
                for moved in moved {
                    self.note(&format!("{time:.2} s: changed: {}", words(moved)));
                }
                for (what, share) in alternatives {
                    self.note(&format!("    alone explains less: {what} ({} %)", (100.0 * share).round()));
                }
            }
            Event::Estimate { .. } => self.estimate(event),
            Event::End { counts } => self.note(&format!(
                "end: {} samples, {} rows, {} alarms, {} changes; {} samples before the clock, {} gaps",
                counts.samples, counts.rows, counts.alarms, counts.changes, counts.backward, counts.gaps
            )),
        }
    }

    fn estimate(&self, event: &Event) {
        let Event::Estimate { time, parameters, residual_rms, determined, statistic, threshold, .. } = event
        else {
            return;
        };
        let rms = residual_rms.iter().map(|r| table::number(*r)).collect::<Vec<_>>().join(" ");
        let share = (100.0 * determined).round();
        let head = format!("{time:.2} s: residual rms {rms}; {share} % of the parameters determined");
        match &self.kind {
            Kind::Alarms => {}
            Kind::Lines => note(&head),
            Kind::Live(bar) => {
                let mut text = head;
                if let Some(threshold) = threshold {
                    let level = (10.0 * statistic / threshold).round().clamp(0.0, 10.0) as usize;
                    text += &format!("; change {}{}", "#".repeat(level), ".".repeat(10 - level));
                }
                let width = parameters.iter().map(|p| p.name.len()).max().unwrap_or(0);
                for p in parameters.iter().take(SHOWN) {
                    text += &format!(
                        "\n{:width$}  {:>12} ± {:<10} {}",
                        p.name,
                        table::number(Some(p.value)),
                        table::number(Some(p.std)),
                        band(p)
                    );
                }
                if parameters.len() > SHOWN {
                    text += &format!("\n... and {} more", parameters.len() - SHOWN);
                }
                bar.set_message(text);
            }
        }
    }
}

/// Two standard deviations on a scale from zero to twice the value.
fn band(p: &ParameterValue) -> String {
    let half = BAND / 2;
    let relative = if p.value == 0.0 { f64::INFINITY } else { 2.0 * p.std / p.value.abs() };
    let reach = (relative * half as f64).round().clamp(0.0, half as f64) as usize;
    (0..BAND)
        .map(|k| match k.abs_diff(half) {
            0 => 'o',
            d if d <= reach => '-',
            _ => ' ',
        })
        .collect()
}

fn words(moved: &Moved) -> String {
    let jumps: Vec<String> = moved
        .parameters
        .iter()
        .map(|p| format!("{} {} ± {}", p.name, Rounded(p.jump), table::number(Some(p.std))))
        .collect();
    let share = (100.0 * moved.share).round();
    match jumps.is_empty() {
        true => format!("{} ({share} % of the misfit)", moved.what),
        false => format!("{} ({share} % of the misfit): {}", moved.what, jumps.join(", ")),
    }
}

/// A jump with its sign.
struct Rounded(f64);

impl std::fmt::Display for Rounded {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let sign = if self.0 < 0.0 { "-" } else { "+" };
        write!(f, "{sign}{}", table::number(Some(self.0.abs())))
    }
}
