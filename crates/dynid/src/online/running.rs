//! The estimate that follows the stream.

use dynid_estimate::consistent::{Settings as ConsistentSettings, estimate};
use dynid_estimate::online::{
    Estimator, Forgetting, JudgeSettings, RowNoise, Settings, SquareRoot, after_change, factor_from_root,
    judge_change,
};
use dynid_model::EffortModel;
use dynid_motion::live::LiveGrid;
use dynid_rows::conditioning::{LiveRow, LiveRows};
use dynid_words::Transfer;

use super::asked::Asked;
use super::event::{Counts, Event, ParameterValue, PlainValue};
use super::ground::Ground;
use super::learning::{Learned, Structure};
use super::moved::Hypotheses;
use super::rules::settings;
use super::samples::Sample;
use super::usual::UsualInnovations;
use crate::Error;
use crate::config::ForgettingRule;
use crate::consistency;
use crate::prior::Prior;

/// Weight of the prior where bodies are made possible, as a share of that of a Gaussian prior: it fills what rows do not
/// see, and hardly moves what they do.
const PRIOR_SHARE: f64 = 0.01;
/// Prior of a stretch on its own, in prior deviations of the run.
const NO_PRIOR: f64 = 1e9;
/// After the last row outside the region that was learned alarms are withheld for this part of the stretch that is learned from.
const SETTLING: f64 = 0.25;
/// A parameter is determined if its deviation is below this share of that before any sample.
const DETERMINED: f64 = 0.1;

/// Samples after an alarm on their own.
#[derive(Debug)]
struct Hold {
    alarm: f64,
    left: u64,
}

/// The running phase of a session.
#[derive(Debug)]
pub(super) struct Running {
    pub(super) learned: Learned,
    prior: Prior,
    grid: LiveGrid,
    rows: LiveRows,
    estimator: Estimator,
    hypotheses: Hypotheses,
    /// Information when the sum of change detection was last zero: a change, if any, came later.
    unchanged: SquareRoot,
    /// The samples since, on their own.
    since: Estimator,
    empty: SquareRoot,
    hold: Option<Hold>,
    /// Where the motion has been.
    ground: Ground,
    /// Time of the newest row.
    newest: f64,
    next_report: Option<f64>,
    /// Per output: sum of squared prediction errors since the last report, and their number.
    errors: Vec<(f64, u64)>,
    regressor: Vec<f64>,
    std: Vec<f64>,
    pub(super) counts: Counts,
    /// Rows that have come but were not taken yet; emptied within every call.
    waiting: Vec<LiveRow>,
}

impl Running {
    pub(super) fn new(asked: &Asked, structure: &Structure, learned: Learned) -> Result<Running, Error> {
        let outputs = structure.model.outputs().len();
        let rows = learned.live_rows(structure)?;
        let in_rows = |seconds: f64| (seconds / rows.spacing_s()).ceil().max(1.0) as u64;
        let (settling, block) = (in_rows(SETTLING * asked.online.learn_s), in_rows(asked.online.reaction_s));
        let names = &structure.model.parameters().linear;
        let speed_of = |joint: &str| {
            let name = format!("{joint}.fv");
            structure.base.kept.iter().position(|column| names[*column].name == name)
        };
        // A column whose part in the effort is below the noise whatever its parameter.
        let unseen = |o: usize| {
            let noise = learned.noise[o * outputs + o].sqrt().max(f64::MIN_POSITIVE);
            learned.prior_std.iter().map(|std| noise / std).collect::<Vec<f64>>()
        };
        let axes = structure.model.outputs().iter().enumerate();
        let axes = axes.map(|(o, output)| (speed_of(&output.name), unseen(o))).collect();
        let settings = settings(asked, &learned, outputs, rows.spacing_s(), true);
        let window = Settings {
            prior_std: learned.prior_std.iter().map(|s| NO_PRIOR * s).collect(),
            start: vec![0.0; learned.start.len()],
            forgetting: Forgetting::None,
            bounded_covariance: None,
            detection: None,
            ..settings.clone()
        };
        let prior = structure.prior(&learned.efforts, &asked.robot.path)?;
        let estimator = Estimator::new(settings)?;
        let since = Estimator::new(window)?;
        Ok(Running {
            grid: learned.grid(structure)?,
            hypotheses: Hypotheses::new(structure, &prior, &learned.prior_std),
            unchanged: estimator.information().clone(),
            empty: since.information().clone(),
            std: vec![0.0; learned.start.len()],
            errors: vec![(0.0, 0); outputs],
            regressor: Vec::new(),
            newest: f64::NEG_INFINITY,
            next_report: None,
            hold: None,
            ground: Ground::new(axes, settling, block),
            counts: Counts::default(),
            waiting: Vec::new(),
            estimator,
            since,
            prior,
            rows,
            learned,
        })
    }

    /// The event that tells what was learned.
    pub(super) fn introduction(&self, structure: &Structure, time: f64) -> Event {
        let outputs = self.errors.len();
        let table = structure.model.parameters();
        let expressions = structure.base.expressions(table);
        let parameters = structure.base.kept.iter().zip(expressions);
        Event::Learned {
            time,
            rate_hz: self.learned.rows.states.rate_hz,
            kernel_hz: self.learned.rows.kernel_hz,
            state_hz: self.learned.rows.states.state_hz,
            delay_samples: self.learned.rows.states.delay_samples,
            lag_s: self.rows.lag_s(),
            rows_per_s: 1.0 / self.rows.spacing_s(),
            noise: (0..outputs).map(|o| self.learned.noise[o * outputs + o].sqrt()).collect(),
            parameters: parameters
                .map(|(column, expression)| super::LearnedParameter {
                    name: table.linear[*column].name.clone(),
                    unit: table.linear[*column].unit.to_owned(),
                    expression,
                })
                .collect(),
            warnings: structure.warnings.clone(),
        }
    }

    /// The next sample comes from another record.
    pub(super) fn interrupt(&mut self) {
        self.grid.interrupt();
    }

    /// Takes the learned stretch itself: no alarms yet, for what is usual is learned from it too.
    pub(super) fn absorb(&mut self, asked: &Asked, samples: &[Sample]) -> Result<(), Error> {
        let outputs = self.errors.len();
        let calm = settings(asked, &self.learned, outputs, self.rows.spacing_s(), false);
        self.estimator = Estimator::new(calm)?;
        samples.iter().for_each(|sample| self.sample(sample));
        let Running { rows, waiting, .. } = self;
        rows.drain(|row| waiting.push(row.clone()));
        let mut usual = UsualInnovations::new(outputs);
        let mut taken = Vec::new();
        for row in std::mem::take(&mut self.waiting) {
            let Some((used, effort)) = self.load(&row) else { continue };
            let noise = self.noise(&used);
            self.ground.learn_from(&used, &self.regressor);
            self.estimator.step(&self.regressor, &effort, RowNoise::Covariance(&noise))?;
            usual.push(&used, self.estimator.innovation().whitened());
            taken.push((used, effort, self.regressor.clone()));
        }
        let block = (asked.online.reaction_s / self.rows.spacing_s()).ceil().max(1.0) as usize;
        self.learned.innovations = usual.learned(block);
        let armed = settings(asked, &self.learned, outputs, self.rows.spacing_s(), true);
        self.estimator = Estimator::new(armed)?;
        for (used, effort, regressor) in taken {
            let noise = self.noise(&used);
            self.estimator.step(&regressor, &effort, RowNoise::Covariance(&noise))?;
        }
        self.unchanged.copy_from(self.estimator.information());
        Ok(())
    }

    /// Puts the usable rows of a sample into place; their outputs and efforts.
    fn load(&mut self, row: &LiveRow) -> Option<(Vec<usize>, Vec<f64>)> {
        self.newest = row.time;
        let used: Vec<usize> = (0..row.usable.len()).filter(|o| row.usable[*o]).collect();
        if used.is_empty() {
            return None;
        }
        self.regressor.clear();
        used.iter().for_each(|o| self.regressor.extend_from_slice(&row.columns[*o]));
        self.ground.enter(&used, &self.regressor);
        let effort = used.iter().map(|o| row.effort[*o]).collect();
        self.counts.rows += 1;
        Some((used, effort))
    }

    /// Covariance of the rows of some outputs, of the size that is usual.
    fn noise(&self, used: &[usize]) -> Vec<f64> {
        let outputs = self.errors.len();
        let size = |output: usize| self.learned.innovations.size(output, self.ground.extent(output));
        let of = |i: usize, j: usize| self.learned.noise[i * outputs + j] * (size(i) * size(j)).sqrt();
        used.iter().flat_map(|i| used.iter().map(move |j| of(*i, *j))).collect()
    }

    /// Takes a sample; rows appear some samples later.
    pub(super) fn sample(&mut self, sample: &Sample) {
        let Running { grid, rows, waiting, .. } = self;
        grid.push(sample.time, &sample.values, |s| {
            rows.push(s.time, s.values, s.first, |row| waiting.push(row.clone()));
        });
        self.counts.samples += 1;
    }

    /// Takes the rows that have come.
    pub(super) fn drain(
        &mut self,
        asked: &Asked,
        structure: &Structure,
        emit: &mut dyn FnMut(Event),
    ) -> Result<(), Error> {
        let Running { rows, waiting, .. } = self;
        rows.drain(|row| waiting.push(row.clone()));
        let clock = self.grid.counts();
        (self.counts.backward, self.counts.gaps, self.counts.set_back) =
            (clock.backward, clock.gaps, clock.set_back);
        for row in std::mem::take(&mut self.waiting) {
            self.row(asked, structure, &row, emit)?;
        }
        Ok(())
    }

    fn row(
        &mut self,
        asked: &Asked,
        structure: &Structure,
        row: &LiveRow,
        emit: &mut dyn FnMut(Event),
    ) -> Result<(), Error> {
        if let Some((used, effort)) = self.load(row) {
            let noise = self.noise(&used);
            self.update(asked, structure, &used, &effort, &noise, emit)?;
        }
        let due = *self.next_report.get_or_insert(row.time + asked.online.report_s);
        if row.time >= due {
            let missed = ((row.time - due) / asked.online.report_s).floor();
            self.next_report = Some(due + (1.0 + missed) * asked.online.report_s);
            emit(self.report(asked, structure)?);
        }
        Ok(())
    }

    fn update(
        &mut self,
        asked: &Asked,
        structure: &Structure,
        used: &[usize],
        effort: &[f64],
        noise: &[f64],
        emit: &mut dyn FnMut(Event),
    ) -> Result<(), Error> {
        if self.hold.is_none() && self.statistic() == 0.0 {
            self.unchanged.copy_from(self.estimator.information());
            self.since.set_information(&self.empty)?;
        }
        self.since.step(&self.regressor, effort, RowNoise::Covariance(noise))?;
        if let Some(hold) = &mut self.hold {
            let p = self.learned.start.len();
            for ((o, y), phi) in used.iter().zip(effort).zip(self.regressor.chunks_exact(p)) {
                let e = y - phi.iter().zip(self.estimator.x()).map(|(f, x)| f * x).sum::<f64>();
                self.errors[*o] = (self.errors[*o].0 + e * e, self.errors[*o].1 + 1);
            }
            hold.left -= 1;
            if hold.left == 0 {
                let alarm = hold.alarm;
                self.hold = None;
                emit(self.judge(structure, alarm)?);
            }
            return Ok(());
        }
        let (ground, inflation) = (&mut self.ground, self.learned.innovations.inflation);
        let was_known = ground.is_known();
        let is_new = ground.visit(used, &self.regressor);
        let step = self.estimator.step_where(
            &self.regressor,
            effort,
            RowNoise::Covariance(noise),
            |innovation| ground.watches(innovation, inflation, is_new),
        )?;
        ground.learn(used, self.estimator.innovation().whitened(), &mut self.learned.innovations);
        if asked.online.alarms && was_known != self.ground.is_known() {
            let leverage = inflation * self.estimator.innovation().leverage();
            emit(match was_known {
                true => Event::Withheld { time: self.newest, leverage },
                false => Event::Watching { time: self.newest },
            });
        }
        for (o, e) in used.iter().zip(self.estimator.prediction_error()) {
            self.errors[*o] = (self.errors[*o].0 + e * e, self.errors[*o].1 + 1);
        }
        if step.alarm {
            self.counts.alarms += 1;
            let threshold = self.estimator.detection().map_or(0.0, |d| d.threshold());
            emit(Event::Alarm { time: self.newest, threshold });
            if asked.online.forgetting != ForgettingRule::Window {
                let samples = (asked.online.reaction_s / self.rows.spacing_s()).ceil().max(1.0) as u64;
                self.hold = Some(Hold { alarm: self.newest, left: samples });
            } else {
                self.counts.changes += 1;
            }
        }
        Ok(())
    }

    /// Judges the samples since the change and takes over what is known after it.
    fn judge(&mut self, structure: &Structure, alarm: f64) -> Result<Event, Error> {
        let after = self.since.information();
        let settings =
            JudgeSettings { inflation: self.learned.innovations.inflation, ..JudgeSettings::default() };
        let judgement = judge_change(&self.unchanged, after, &self.hypotheses.list, &settings);
        let moved = judgement.moved.iter().map(|m| &self.hypotheses.list[m.hypothesis]);
        let known = after_change(&self.unchanged, after, moved);
        self.counts.changes += u64::from(judgement.confirmed);
        if !judgement.confirmed {
            // Innovations were as large without a change: from now on that is usual.
            let size = remaining_variance(after);
            self.learned.innovations.size.iter_mut().for_each(|own| *own *= size);
        }
        self.estimator.set_information(&known)?;
        let (moved, alternatives) = self.hypotheses.tell(structure, &judgement);
        Ok(Event::Change { time: self.newest, alarm, confirmed: judgement.confirmed, moved, alternatives })
    }

    fn statistic(&self) -> f64 {
        self.estimator.detection().map_or(0.0, |d| d.statistic())
    }

    /// The estimate as it is.
    pub(super) fn report(&mut self, asked: &Asked, structure: &Structure) -> Result<Event, Error> {
        let coloured = self.learned.innovations.inflation.sqrt();
        self.estimator.std(&mut self.std);
        let names = &structure.model.parameters().linear;
        let value = |(k, column): (usize, &usize)| ParameterValue {
            name: names[*column].name.clone(),
            value: self.estimator.x()[k],
            std: coloured * self.std[k],
        };
        let parameters: Vec<ParameterValue> = structure.base.kept.iter().enumerate().map(value).collect();
        let determined = parameters
            .iter()
            .zip(&self.learned.prior_std)
            .filter(|(p, prior)| p.std < DETERMINED * **prior)
            .count();
        let residual_rms = self
            .errors
            .iter()
            .map(|(sum, count)| (*count > 0).then(|| (sum / *count as f64).sqrt()))
            .collect();
        self.errors.fill((0.0, 0));
        Ok(Event::Estimate {
            time: self.newest,
            standard: self.standard(asked, structure)?,
            determined: determined as f64 / parameters.len() as f64,
            parameters,
            residual_rms,
            statistic: self.statistic(),
            threshold: self.estimator.detection().map(|d| d.threshold()),
            watching: self.estimator.detection().is_some() && self.ground.is_known(),
            rows: self.counts.rows,
            alarms: self.counts.alarms,
        })
    }

    /// Standard parameters of bodies that can exist.
    fn standard(&self, asked: &Asked, structure: &Structure) -> Result<Vec<PlainValue>, Error> {
        let bodies = structure.model.mechanism().bodies().len();
        let Some(form) = consistency::form(asked.settings.estimator.consistency)
            .filter(|_| asked.online.consistent && bodies > 0)
        else {
            return Ok(Vec::new());
        };
        let factor = factor_from_root(self.estimator.information(), &self.learned.prior_std);
        let problem = consistency::problem(
            &structure.model,
            &structure.regrouping,
            &factor,
            &self.prior,
            &structure.bounds,
        );
        let settings = ConsistentSettings {
            form,
            gaussian_weight: PRIOR_SHARE * self.learned.innovations.inflation,
            ..ConsistentSettings::default()
        };
        let mut found = estimate(&problem, &settings)?;
        structure.model.complete(&mut found.x);
        let names = structure.model.parameters().linear.iter();
        Ok(names.zip(found.x).map(|(p, value)| PlainValue { name: p.name.clone(), value }).collect())
    }

    /// Whether something is waiting for more samples that the end of the stream would lose.
    pub(super) fn finish(
        &mut self,
        asked: &Asked,
        structure: &Structure,
        emit: &mut dyn FnMut(Event),
    ) -> Result<(), Error> {
        self.drain(asked, structure, emit)?;
        if let Some(hold) = self.hold.take() {
            emit(self.judge(structure, hold.alarm)?);
        }
        emit(self.report(asked, structure)?);
        Ok(())
    }

    /// Carries the state to or from a checkpoint.
    pub(super) fn transfer(&mut self, transfer: &mut Transfer<'_>) {
        self.grid.transfer(transfer);
        self.rows.transfer(transfer);
        transfer_estimator(&mut self.estimator, transfer);
        transfer_estimator(&mut self.since, transfer);
        transfer_root(&mut self.unchanged, transfer);
        self.ground.transfer(transfer);
        let mut held = self.hold.is_some();
        transfer.flag(&mut held);
        let hold = self.hold.get_or_insert(Hold { alarm: 0.0, left: 1 });
        transfer.real(&mut hold.alarm);
        transfer.integer(&mut hold.left);
        if !held {
            self.hold = None;
        }
        transfer.real(&mut self.newest);
        let mut due = self.next_report.unwrap_or(f64::NAN);
        transfer.real(&mut due);
        self.next_report = (!due.is_nan()).then_some(due);
        for (sum, count) in &mut self.errors {
            transfer.real(sum);
            transfer.integer(count);
        }
        let Counts { samples, rows, backward, gaps, set_back, already_seen, alarms, changes } =
            &mut self.counts;
        for count in [samples, rows, backward, gaps, set_back, already_seen, alarms, changes] {
            transfer.integer(count);
        }
    }
}

/// Variance of the rows of a stretch about its own fit, in units of what is usual, at least 1.
fn remaining_variance(stretch: &SquareRoot) -> f64 {
    let freedom = stretch.weight() - stretch.columns() as f64;
    if freedom > 0.0 { (stretch.rss() / freedom).max(1.0) } else { 1.0 }
}

fn transfer_estimator(estimator: &mut Estimator, transfer: &mut Transfer<'_>) {
    let mut words = estimator.save();
    let mut length = words.len();
    transfer.count(&mut length, MOST_WORDS);
    words.resize(length, 0);
    words.iter_mut().for_each(|w| transfer.integer(w));
    if matches!(transfer, Transfer::Load { .. }) && estimator.load(&words).is_err() {
        transfer.fail();
    }
}

/// Most words of an estimator that a checkpoint is believed.
const MOST_WORDS: usize = 1 << 28;

fn transfer_root(root: &mut SquareRoot, transfer: &mut Transfer<'_>) {
    for i in 0..root.columns() {
        let mut row = root.row(i).to_vec();
        transfer.reals(&mut row);
        if row[0].is_nan() || row[0] < 0.0 {
            transfer.fail();
            return;
        }
        root.set_row(i, &row);
    }
    let (mut rss, mut weight) = (root.rss(), root.weight());
    transfer.real(&mut rss);
    transfer.real(&mut weight);
    root.set_remainder(rss, weight);
}
