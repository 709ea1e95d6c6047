//! What a next motion leaves behind as JSON.

use dynid_identify::Error;
use dynid_identify::estimate::Provenance;
use dynid_identify::reduction::ReducedLog;
use dynid_record::Outcome;
use serde::Serialize;

use super::super::record::{DesignRecord, DesignVerdict};
use super::{Goal, NextRun, WantedState};

/// Schema of `next.json`.
const SCHEMA: &str = "dynid-next/1";

/// `next.json`: keys are added, never renamed.
#[derive(Debug, Clone, Serialize, schemars::JsonSchema)]
pub struct NextRecord {
    /// Schema and version.
    pub schema: &'static str,
    /// The result in words.
    pub verdict: DesignVerdict,
    /// Time to record, s; `None` without a motion.
    pub recorded_s: Option<f64>,
    /// Parameters of which intervals are wanted.
    pub wanted: Vec<IntervalRecord>,
    /// All other parameters.
    pub others: Vec<IntervalRecord>,
    /// Speeds of motion that were tried.
    pub tried: Vec<TriedRecord>,
    /// Logs so far.
    pub logs: Vec<NextLog>,
    /// The motion, as `dynid design` describes one; `None` if nothing has to be recorded, or no motion would help.
    pub design: Option<DesignRecord>,
    /// Where all this comes from.
    pub provenance: Provenance,
}

/// The interval of a parameter, today and after the motion.
#[derive(Debug, Clone, PartialEq, Serialize, schemars::JsonSchema)]
pub struct IntervalRecord {
    /// Name.
    pub name: String,
    /// Unit.
    pub unit: String,
    /// Value found so far.
    pub value: f64,
    /// Half width of its 95 % interval today; `None` if it is not seen in the data.
    pub half_width: Option<f64>,
    /// Half width that is wanted.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub wanted_half_width: Option<f64>,
    /// Half width that the logs and the motion together are expected to give; `None` without a motion, or if it would not be seen in the data.
    pub half_width_after: Option<f64>,
    /// What comes of what is wanted.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub state: Option<WantedState>,
    /// What data can see of a parameter that acts only together with others.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub combination: Option<String>,
}

/// A speed of motion that was tried.
#[derive(Debug, Clone, PartialEq, Serialize, schemars::JsonSchema)]
pub struct TriedRecord {
    /// Highest frequency of the motion, Hz.
    pub highest_hz: f64,
    /// Time after which such a motion reaches all that is wanted, s; `None`: not within ten thousand times its own.
    pub needed_s: Option<f64>,
}

/// A log so far.
#[derive(Debug, Clone, PartialEq, Serialize, schemars::JsonSchema)]
pub struct NextLog {
    /// Name.
    pub name: String,
    /// Key of its factors.
    pub key: String,
    /// Duration, s.
    pub duration_s: f64,
}

impl NextLog {
    pub(super) fn of(log: &ReducedLog) -> Self {
        NextLog { name: log.facts.name.clone(), key: log.key.clone(), duration_s: log.facts.log.duration_s }
    }
}

impl NextRun {
    /// Everything as JSON keys.
    ///
    /// # Errors
    /// [`Error`] of the figures that the record is made of.
    pub fn record(&self) -> Result<NextRecord, Error> {
        let design = self.design.as_ref().map(|run| run.record(&self.config)).transpose()?;
        let moves = self.design.as_ref().is_some_and(|run| run.outcome.is_ok());
        let recorded_s = moves.then_some(self.config.form().period_s);
        let verdict = self.verdict(design.as_ref(), recorded_s);
        let is_wanted = |j: &usize| self.goals.iter().any(|g| g.parameter == *j);
        let others =
            (0..self.known.parameters.len()).filter(|j| !is_wanted(j)).map(|j| self.interval(j, None));
        let settings = serde_json::to_value(&self.config).unwrap_or_default();
        Ok(NextRecord {
            schema: SCHEMA,
            verdict,
            recorded_s,
            wanted: self.goals.iter().map(|g| self.interval(g.parameter, Some(g))).collect(),
            others: others.collect(),
            tried: (self.tried.iter())
                .map(|t| TriedRecord { highest_hz: t.highest_hz, needed_s: t.needed_s })
                .collect(),
            logs: self.logs.clone(),
            provenance: match &design {
                Some(design) => design.provenance.clone(),
                None => Provenance { settings, seed: self.config.search.seed, ..Provenance::default() },
            },
            design,
        })
    }

    fn interval(&self, parameter: usize, goal: Option<&Goal>) -> IntervalRecord {
        let p = &self.known.parameters[parameter];
        let after = self.after.as_ref().map(|after| &after[parameter]);
        let hidden = goal.is_some_and(|g| g.state == WantedState::OnlyInCombination);
        IntervalRecord {
            name: p.name.clone(),
            unit: p.unit.to_owned(),
            value: p.value,
            half_width: p.half_width,
            wanted_half_width: goal.map(|g| g.half_width),
            half_width_after: after.and_then(|after| self.known.half_width(parameter, after)),
            state: goal.map(|g| g.state),
            combination: p.combination.clone().filter(|_| hidden),
        }
    }

    fn verdict(&self, design: Option<&DesignRecord>, recorded_s: Option<f64>) -> DesignVerdict {
        let count = |state: WantedState| self.goals.iter().filter(|g| g.state == state).count();
        let names = |state: WantedState| {
            let of = self.goals.iter().filter(|g| g.state == state);
            let all: Vec<&str> = of.map(|g| self.known.parameters[g.parameter].name.as_str()).collect();
            match all.len() {
                0..=4 => all.join(", "),
                n => format!("{} and {} more", all[..3].join(", "), n - 3),
            }
        };
        let (wanted, reached) = (self.goals.len(), count(WantedState::Reached));
        let holds = count(WantedState::Holds);
        let left = wanted - reached - holds;
        let mut parts = Vec::new();
        match recorded_s {
            Some(seconds) => parts.push(format!(
                "{seconds} s of motion will bring {reached} of {} wanted intervals",
                wanted - holds
            )),
            None if left == 0 => {
                parts.push("the logs so far give all wanted intervals: nothing has to be recorded".to_owned())
            }
            None if design.is_none() => parts.push("no motion will bring the wanted intervals".to_owned()),
            None => {}
        }
        if holds > 0 && recorded_s.is_some() {
            parts.push(format!("{holds} hold already"));
        }
        for (state, words) in [
            (WantedState::NotReached, "longer records would be needed for"),
            (WantedState::OnlyInCombination, "no motion shows by themselves"),
            (WantedState::Given, "no log is asked for"),
        ] {
            if count(state) > 0 && (recorded_s.is_some() || state != WantedState::NotReached) {
                let seconds = self.tried.iter().filter_map(|t| t.needed_s).reduce(f64::min);
                let time = seconds.filter(|_| state == WantedState::NotReached);
                parts.push(format!(
                    "{words} {}{}",
                    names(state),
                    time.map_or_else(String::new, |s| format!(" (about {s:.0} s)"))
                ));
            }
        }
        let mut status = match (left, reached + holds) {
            (0, _) => Outcome::Pass,
            (_, 0) => Outcome::Fail,
            _ => Outcome::Warn,
        };
        let mut warnings: Vec<String> = self.warnings.iter().chain(&self.notes).cloned().collect();
        if let Some(design) = design {
            parts.push(design.verdict.headline.clone());
            warnings.extend(design.verdict.warnings.iter().cloned());
            status = worse(status, design.verdict.status);
        }
        if !self.warnings.is_empty() {
            status = worse(status, Outcome::Warn);
        }
        DesignVerdict { status, headline: parts.join("; "), warnings }
    }
}

fn worse(a: Outcome, b: Outcome) -> Outcome {
    let rank = |o: Outcome| match o {
        Outcome::Pass => 0,
        Outcome::Warn => 1,
        Outcome::Fail => 2,
    };
    if rank(a) >= rank(b) { a } else { b }
}
