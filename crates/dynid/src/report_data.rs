//! The report's content from an identification and its result file.

mod files;
mod first;
mod friction;
mod searches;
mod trust;

use std::ops::Deref;
use std::sync::Arc;

use dynid_config::pages::{picture, plain, settings_table};
use dynid_estimate::linear::{LinearMethod, OwnEstimator};
use dynid_record::Basis;
use dynid_report as report;
use dynid_report::{Fact, Value};

use crate::Error;
use crate::agreement::Agreement;
use crate::config::{Config, Method, PriorDistance};
use crate::consistency::PriorTrial;
use crate::estimate::short_name;
use crate::estimate::{Choice, Estimate, Provenance};
use crate::pipeline::Identification;

/// What pictures leave out of a prediction.
const AT_REST: &str = " Where a joint stands, friction of velocity is left out of the predicted curve: it may have any value up to \
                       static friction there, and the sign of a speed that is noise would make the curve jump. Errors and residual \
                       statistics count the full prediction there too.";

/// The report of an identification as one HTML page.
///
/// # Errors
/// [`PageError`](crate::fault::PageError); [`Error::Conditioning`] for an effort that cannot be filtered for the first figure.
pub fn report(found: &Identification, estimate: &Estimate) -> Result<String, Error> {
    crate::fault::page(report::render(&Shown(found).report_data(estimate)?))
}

/// An identification as its page shows it.
struct Shown<'a>(&'a Identification);

impl Deref for Shown<'_> {
    type Target = Identification;

    fn deref(&self) -> &Identification {
        self.0
    }
}

impl Shown<'_> {
    /// Kind of the joint behind an output, in words.
    fn joint_kind(&self, output: usize) -> String {
        let (mechanism, joints) = (self.model.mechanism(), self.model.joints());
        if let Some((link, ratio)) = self.model.elastic_link(output) {
            return format!("motor of `{}` behind a spring, ratio {ratio}", joints[link].name);
        }
        match mechanism.rate_bodies().get(self.model.tree_rate(output)) {
            Some(body) => {
                let kind = format!("{:?}", mechanism.bodies()[*body].joint.kind).to_lowercase();
                let driven = self.model.elastic_motor(output);
                driven
                    .map_or(kind.clone(), |(motor, _)| format!("{kind}, driven by `{}`", joints[motor].name))
            }
            None => "torque sensor (its effort is the negative reading)".to_owned(),
        }
    }

    /// The report's content.
    ///
    /// # Errors
    /// [`Error::Conditioning`] for an effort that cannot be filtered for the first figure.
    fn report_data(&self, estimate: &Estimate) -> Result<report::ReportData, Error> {
        use dynid_model::EffortModel;
        let mechanism = self.model.mechanism();
        let own = self.settings.own_estimator.as_ref().map(OwnEstimator::name);
        Ok(report::ReportData {
            title: format!("Identification of {}", estimate.robot),
            verdict: verdict(estimate),
            cautions: first::cautions(estimate),
            counts: first::counts(estimate),
            judged: self.judged()?,
            picture: self.picture(),
            robot: report::Robot {
                name: estimate.robot.clone(),
                file: Some(self.robot.path.display().to_string()),
                facts: vec![
                    Fact::new("moving joints", mechanism.bodies().len(), ""),
                    Fact::new("standard parameters, elements included", estimate.counts.standard.all, ""),
                    Fact::new("base parameters", estimate.counts.base.all, ""),
                    Fact::new("gravity", format!("{:?}", mechanism.gravity().0), "m/s^2"),
                ],
            },
            joints: self
                .model
                .outputs()
                .iter()
                .enumerate()
                .map(|(k, o)| report::Joint {
                    name: o.name.clone(),
                    effort_unit: o.unit.to_owned(),
                    kind: self.joint_kind(k),
                    elements: self.plan.per_rate[self.model.tree_rate(k)].clone(),
                })
                .collect(),
            logs: self
                .training
                .iter()
                .enumerate()
                .map(|(k, a)| self.log_report(a, report::LogRole::Training, Some(k)))
                .chain(self.validation.iter().map(|a| self.log_report(a, report::LogRole::Validation, None)))
                .collect(),
            estimation: vec![
                Fact::new(
                    "estimator",
                    own.unwrap_or(match self.settings.estimator.method {
                        Method::Ols => "ordinary least squares",
                        _ if self.fitted.basis != Basis::TimeBlocks => {
                            "generalised least squares of the mixed model of a fleet"
                        }
                        Method::Wls => "weighted least squares, residual variances found along the way",
                        Method::Huber => "Huber's loss, scales found along the way",
                        Method::Tukey => "Tukey's biweight, scales found along the way",
                        Method::Ridge => "weighted least squares with the robot file as Gaussian prior",
                        Method::Tls => "total least squares",
                        Method::Iv if self.fit().method == LinearMethod::Instrumental => {
                            "instrumental variables from simulations, residual variances found along the way"
                        }
                        Method::Iv => "weighted least squares, since no instruments came about",
                        Method::Didim if self.fit().method == LinearMethod::Didim => {
                            "DIDIM: efforts on the regressor of simulations of the closed loop"
                        }
                        Method::Cloe if self.fit().method == LinearMethod::Cloe => {
                            "closed-loop output error: positions on their slopes along simulations"
                        }
                        Method::Didim | Method::Cloe => {
                            "weighted least squares, since the simulation diverged"
                        }
                    }),
                    "",
                ),
                Fact::new("passes", self.fit().passes, ""),
                Fact::new("converged", self.fit().converged, ""),
                Fact::new(
                    "standard deviations",
                    if self.fitted.basis == Basis::Fleet {
                        "those of the mixed model"
                    } else if self.fitted.basis == Basis::Robots {
                        "jackknife over robots"
                    } else if self.fitted.jackknife.is_some() {
                        "jackknife over time blocks"
                    } else if self.fitted.is_robust() {
                        "white residuals, inflated as few time blocks say"
                    } else {
                        "white residuals (too few time blocks for a jackknife)"
                    },
                    "",
                ),
                match self.fitted.robots {
                    0 => Fact::new("time blocks", self.blocks(), ""),
                    robots => Fact::new("robots", robots, ""),
                },
                Fact::new("every identified body physical", estimate.feasible, ""),
            ],
            base_parameters: trust::base_parameters(estimate),
            standard_parameters: self.standard_parameters(estimate),
            shape_parameters: friction::shape_parameters(estimate),
            friction_laws: self.friction_laws(estimate),
            files: self.file_judgement(estimate),
            motions: estimate.motions_that_would_help.clone(),
            consistency: self.consistency_report(estimate),
            held_out: trust::held_out(estimate),
            precision: Some(self.precision_report(estimate)),
            searches: self.searches.as_ref().map(searches::section),
            pruning: trust::pruning(estimate),
            observation: report::Observation {
                rows: Some(estimate.rows as u64),
                columns: Some(estimate.rank.structural as u64),
                rank: Some(estimate.rank.excited as u64),
                structural_rank: Some(estimate.rank.structural as u64),
                rank_tolerance: Some(self.fit().solution.rank.tolerance),
                condition_number: estimate.condition_number,
                condition_number_scaled: estimate.condition_number_scaled,
            },
            unidentifiable: estimate
                .rank
                .never_seen
                .iter()
                .map(|n| (n, "acts on no effort, whatever the motion"))
                .chain(estimate.rank.not_excited.iter().map(|n| (n, "not excited by these logs")))
                .map(|(name, reason)| report::UnidentifiableColumn {
                    name: name.clone(),
                    reason: reason.to_owned(),
                })
                .collect(),
            conditioning: estimate.conditioning.choices.iter().map(chosen).collect(),
            ladders: self.ladders(),
            friction_trials: self.friction_trials(estimate),
            delays: self.delays(),
            provenance: report::Provenance {
                version: estimate.provenance.version.clone(),
                inputs: estimate
                    .provenance
                    .inputs
                    .iter()
                    .map(|i| report::InputFile {
                        path: i.path.clone(),
                        kind: i.kind.word().to_owned(),
                        sha256: Some(i.sha256.clone()),
                    })
                    .collect(),
                seed: Some(estimate.provenance.seed),
                settings: run_settings(&estimate.provenance),
            },
        })
    }

    fn log_report(&self, a: &Agreement, role: report::LogRole, training: Option<usize>) -> report::LogReport {
        let percent = |x: Option<f64>| x.map(|x| 100.0 * x);
        let quality = |f: &dynid_estimate::metrics::ChannelFit| report::Quality {
            rms: f.rms,
            nrmse_percent: percent(f.nrmse),
            r2: f.r2,
            correlation: f.correlation,
            relative_error_percent: f.relative_error,
        };
        let samples = a.counted.len();
        let facts = training.map_or_else(Vec::new, |k| {
            self.sources[k]
                .columns
                .iter()
                .map(|(s, c)| Fact::new(format!("column of {s}"), c.as_str(), ""))
                .collect()
        });
        report::LogReport {
            name: short_name(&a.name),
            role,
            samples: Some(samples as u64),
            samples_used: Some(a.counted.iter().filter(|c| **c).count() as u64),
            duration_s: Some(samples as f64 / a.rate_hz),
            sample_rate_hz: Some(a.rate_hz),
            facts,
            quality: a
                .raw
                .channels
                .iter()
                .zip(&a.filtered.channels)
                .enumerate()
                .map(|(j, (raw, filtered))| report::JointQuality {
                    raw: quality(raw),
                    filtered: quality(filtered),
                    moving: quality(&a.moving.channels[j]),
                    standing: quality(&a.standing.channels[j]),
                    standing_percent: Some(100.0 * a.standing_share[j]),
                })
                .collect(),
            relative_error_raw_percent: a.raw.relative_error,
            relative_error_filtered_percent: a.filtered.relative_error,
            series: Some(report::LogSeries {
                time_s: (0..samples).map(|s| a.start + s as f64 / a.rate_hz).collect(),
                description: format!(
                    "Measured effort as logged; predicted effort from states filtered at {:.1} Hz, aligned by the \
                     identified delay of {:.2} samples. Filtered figures: both through a zero-phase filter of {:.1} Hz.{}",
                    self.state_hz,
                    self.delay_samples,
                    a.filter_hz,
                    if (0..a.measured.len()).any(|j| a.is_drawn_otherwise(j)) { AT_REST } else { "" }
                ),
                joints: a
                    .measured
                    .iter()
                    .zip(&a.predicted)
                    .enumerate()
                    .map(|(j, (measured, predicted))| report::JointSeries {
                        measured: Arc::clone(measured),
                        predicted: Some(Arc::clone(predicted)),
                        drawn: a.drawn(j),
                        used: Some(a.counted.clone()),
                    })
                    .collect(),
            }),
        }
    }

    fn ladders(&self) -> Vec<report::Ladder> {
        let Some(c) = &self.conditioning else { return Vec::new() };
        let mut out = Vec::new();
        if c.kernel_trials.len() > 1 {
            out.push(report::Ladder {
                title: "Kernel cut-off".to_owned(),
                explanation: "Held-out error with the smaller of the losses for linear and for rich friction. Noise sets the \
                              cut-off; the highest one within the veto is kept."
                    .to_owned(),
                quantity: "cut-off".to_owned(),
                unit: "Hz".to_owned(),
                loss_name: "held-out loss, relative".to_owned(),
                loss_unit: String::new(),
                rungs: c
                    .kernel_trials
                    .iter()
                    .map(|t| report::Rung {
                        value: Value::Number(t.kernel_hz),
                        loss: Some(t.loss.min(t.loss_rich)),
                        chosen: t.kernel_hz == c.kernel_hz,
                        ..Default::default()
                    })
                    .collect(),
            });
        }
        out.extend(self.prior_ladders());
        if c.mask_trials.len() > 1 {
            out.push(report::Ladder {
                title: "Reversal mask (the same for all joints)".to_owned(),
                explanation: "Held-out error when samples slower than a share of the joint's rms speed are left out. Single \
                              joints may then deviate where that pays."
                    .to_owned(),
                quantity: "share of rms speed".to_owned(),
                unit: String::new(),
                loss_name: "held-out loss, relative".to_owned(),
                loss_unit: String::new(),
                rungs: c
                    .mask_trials
                    .iter()
                    .map(|t| report::Rung {
                        value: t.level.map_or_else(|| Value::Text("no mask".to_owned()), Value::Number),
                        loss: Some(t.loss),
                        loss_std_error: Some(t.standard_error),
                        kept_percent: Some(100.0 * t.kept),
                        chosen: c.mask.iter().filter(|m| **m == t.level).count() * 2 > c.mask.len(),
                    })
                    .collect(),
            });
        }
        out
    }

    fn prior_ladders(&self) -> Vec<report::Ladder> {
        let (trials, chosen) = (&self.consistent.prior_trials, self.consistent.chosen);
        let of = |distance: PriorDistance, measured: &str| {
            let trials: Vec<_> = trials.iter().enumerate().filter(|(_, t)| t.distance == distance).collect();
            let rung = |(k, t): &(usize, &PriorTrial)| report::Rung {
                value: Value::Number(t.weight),
                loss: t.loss,
                chosen: *k == chosen,
                ..Default::default()
            };
            (trials.len() > 1).then(|| report::Ladder {
                title: format!("Pull towards the robot file, {measured}"),
                explanation: "Squared held-out error of the physically consistent parameters, relative to that without constraints \
                              (mean over joints), when deviations from the robot file are weighted more or less. Of the distance \
                              with the least error the strongest pull within half a per cent of it is kept."
                    .to_owned(),
                quantity: "weight".to_owned(),
                unit: String::new(),
                loss_name: "held-out loss, relative".to_owned(),
                loss_unit: String::new(),
                rungs: trials.iter().map(rung).collect(),
            })
        };
        let ladders = [
            of(PriorDistance::Quadratic, "squared deviations"),
            of(PriorDistance::Entropic, "entropic divergence"),
        ];
        ladders.into_iter().flatten().collect()
    }

    fn delays(&self) -> Vec<report::JointDelay> {
        let (Some(c), Some(log)) = (&self.conditioning, self.logs.first()) else { return Vec::new() };
        let seconds = |samples: f64| samples / log.rate_hz;
        c.delay
            .per_output
            .iter()
            .map(|(delay, error)| report::JointDelay {
                delay_s: (!c.delay.given && *error < 100.0).then(|| seconds(*delay)),
                interval_s: (!c.delay.given && *error < 100.0)
                    .then(|| [seconds(delay - 1.96 * error), seconds(delay + 1.96 * error)]),
                applied_s: Some(seconds(c.delay.samples)),
            })
            .collect()
    }
}

/// Settings of an identification beside those of a configuration that says nothing.
pub(crate) fn run_settings(of: &Provenance) -> Vec<report::Chosen> {
    settings_table(&of.settings, &Config::default().stated())
}

fn verdict(estimate: &Estimate) -> report::Verdict {
    let v = &estimate.verdict;
    let sentences = v.assumptions.iter().map(|a| format!("Taken for granted: {a}.")).collect();
    report::Verdict {
        status: v.status,
        headline: v.line.clone(),
        sentences,
        checks: v
            .checks
            .iter()
            .map(|c| report::Check {
                status: c.status,
                name: c.name.word().to_owned(),
                value: c.value.map_or(Value::Undefined, Value::Number),
                unit: c.unit.clone(),
                limit: c.limit.clone(),
                meaning: c.meaning.clone(),
            })
            .collect(),
    }
}

fn chosen(choice: &Choice) -> report::Chosen {
    report::Chosen {
        name: choice.name.clone(),
        value: plain(&choice.value),
        unit: choice.unit.clone(),
        origin: choice.origin,
        reason: choice.reason.clone(),
    }
}
