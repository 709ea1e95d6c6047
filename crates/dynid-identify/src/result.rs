//! From an identification to its result file.

mod counts;
mod cyclic;
mod friction;
mod instruments;
mod smoothing;
mod trust;

use dynid_model::element::{change_name, scale_name};
use dynid_model::ties::Dependent;
use dynid_model::{EffortModel, Inertia, Owner, Ties};
use dynid_record::{Origin, ParameterVerdict, ShapeVerdict};
use serde_json::json;

use crate::agreement::FitValues;
use crate::estimate::{
    BaseValue, ByMotion, Choice, ConditioningRecord, Estimate, ExportedRecord, FitSummary, LogScale,
    ModelRecord, ParameterValue, Provenance, RankStatus, ReadingRecord, SCHEMA, ShapeValue, by_motion,
    log_fit, pool,
};
use crate::identification::Identification;
use crate::input_record::{InputKind, InputRecord, short_name};
use crate::log::LogSource;
use crate::trust::{ParameterTrust, recorded};
use crate::{shape, verdict};

impl Identification {
    /// The result file of this identification.
    pub fn estimate(&self) -> Estimate {
        let solution = &self.fit().solution;
        let finite = |x: f64| x.is_finite().then_some(x);
        let verdict = verdict::judge(self);
        let mut model = ModelRecord::new(&self.robot.file.description, &self.robot.mechanism, &self.plan);
        model.state_hz = self.state_hz;
        model.kernel_hz = self.kernel_hz;
        let names = |columns: &[usize]| -> Vec<String> {
            let name = |c: &usize| self.model.parameters().linear[*c].name.clone();
            // The change of a shape parameter stands for the parameter itself.
            columns.iter().map(name).map(|n| shape::of_change(&n).unwrap_or(&n).to_owned()).collect()
        };
        let follows = |c: &usize| self.model.ties().is_some_and(|ties| ties.of_column(*c).is_some());
        let never_seen: Vec<usize> = self.base.zero.iter().copied().filter(|c| !follows(c)).collect();
        let not_excited: Vec<usize> = solution.dropped.iter().map(|c| self.base.kept[*c]).collect();
        Estimate {
            schema: SCHEMA,
            robot: self.model.mechanism().name().to_owned(),
            joints: self.model.outputs().iter().map(|o| o.name.clone()).collect(),
            samples: self.samples(),
            rows: self.rows,
            condition_number: finite(solution.condition),
            condition_number_scaled: finite(solution.condition_scaled),
            condition_number_without_shapes: finite(self.condition_without_shapes()),
            rank: RankStatus {
                structural: self.base.len(),
                excited: solution.kept.len(),
                structural_gap: finite(self.base.gap.ratio()),
                not_excited: names(&not_excited),
                never_seen: names(&never_seen),
            },
            counts: self.counts(),
            parameters: self.robot_parameters(),
            log_agreement: self.log_agreement.clone(),
            ties: self.tie_test.clone(),
            searches: self.searches.clone(),
            log_delays: self.own_delays.clone(),
            log_parameters: self.parameter_values(self.model.log_columns()),
            base_parameters: self.base_values(),
            shape_parameters: self.robot_shapes(),
            log_scales: self.log_scales(),
            stiffness: self.stiffness.clone(),
            friction_passivity: self.friction_passivity(),
            feasible: self.unphysical_bodies().is_empty(),
            consistency: self.consistency_record(),
            held_out: self.held_out_record(),
            precision: self.precision_record(),
            exogeneity: self.exogeneity_record(),
            pruning: self.pruning_record(),
            motions_that_would_help: self.trust.motions.clone(),
            fit: self.fit_summary(),
            validation: self.validation.iter().map(log_fit).collect(),
            exported: ExportedRecord::default(),
            preflight: self.findings.iter().map(Into::into).collect(),
            overlaps: self.overlaps.clone(),
            effort_scale: self.effort_scale.clone(),
            verdict,
            conditioning: self.conditioning_record(),
            model,
            provenance: Provenance {
                inputs: self.inputs(),
                reading: Some(ReadingRecord {
                    understood: self.training_sources().map(|source| source.columns.clone()).collect(),
                    ..ReadingRecord::default()
                }),
                settings: serde_json::to_value(&self.settings)
                    .unwrap_or_else(|e| unreachable!("settings hold only plain data: {e}")),
                seed: self.settings.seed.unwrap_or(1),
                ..Provenance::default()
            },
        }
    }

    /// Robot, logs and friction as they were read, with what their bytes hash to; what came as arrays is not among them.
    pub fn inputs(&self) -> Vec<InputRecord> {
        let mut out = self.robot.inputs();
        for (k, source) in self.sources.iter().enumerate() {
            let validates = k >= self.trained.len();
            out.extend(source.inputs.iter().map(|input| match input.kind {
                InputKind::Log if validates => InputRecord { kind: InputKind::Validation, ..input.clone() },
                _ => input.clone(),
            }));
        }
        out.extend(self.plan.known_source.iter().map(|source| InputRecord::of(InputKind::Friction, source)));
        out
    }

    /// Where the training logs come from.
    fn training_sources(&self) -> impl Iterator<Item = &LogSource> {
        self.sources.iter().take(self.trained.len())
    }

    /// Links whose identified inertia no body could have, with the reason; not those that are without mass by a tie.
    pub fn unphysical_bodies(&self) -> Vec<(String, &'static str)> {
        self.model
            .mechanism()
            .bodies()
            .iter()
            .zip(self.inertias())
            .enumerate()
            .filter(|(b, (_, inertia))| {
                let massless = inertia.0.iter().all(|x| *x == 0.0);
                !(massless && self.model.ties().is_some_and(|ties| ties.body_follows(*b)))
            })
            .filter_map(|(_, (body, inertia))| {
                inertia.physical_fault().map(|fault| (body.name.clone(), fault))
            })
            .collect()
    }

    /// Identified inertia of every body, in body order.
    pub fn inertias(&self) -> Vec<Inertia> {
        self.values()
            .chunks_exact(10)
            .take(self.model.mechanism().bodies().len())
            .map(|ten| {
                let mut phi = [0.0; 10];
                phi.copy_from_slice(ten);
                Inertia(phi)
            })
            .collect()
    }

    /// Parameters of some columns as the result file holds them.
    pub fn parameter_values(&self, columns: std::ops::Range<usize>) -> Vec<ParameterValue> {
        self.model
            .parameters()
            .linear
            .iter()
            .zip(&self.trust.parameters)
            .enumerate()
            .filter(|(c, (p, _))| columns.contains(c) && shape::of_change(&p.name).is_none())
            .map(|(c, (p, trust))| {
                let (link, joint) = match &p.owner {
                    Owner::Link(name) => (Some(name.clone()), None),
                    Owner::Joint(name) => (None, Some(name.clone())),
                };
                let value = self.values()[c];
                let (verdict, reason) = recorded(trust.assessment.verdict);
                let asked = verdict != ParameterVerdict::Given;
                ParameterValue {
                    name: p.name.clone(),
                    link,
                    joint,
                    unit: p.unit.to_owned(),
                    value,
                    unconstrained: Some(trust.unconstrained),
                    std: trust.std,
                    rel_std: relative(Some(value), trust.std),
                    interval: trust.interval,
                    wide: trust.wide,
                    at_boundary: trust.at_boundary,
                    verdict,
                    reason,
                    share: asked.then_some(trust.assessment.achieved),
                    possible_share: asked.then_some(trust.assessment.structural_limit),
                    combination: trust.combination.clone(),
                    advice: trust.advice.clone(),
                    tie: trust.tie.clone(),
                    prior: self.stated[c],
                }
            })
            .collect()
    }

    /// Parameters of the robot alone, in the order of the model that the result file records.
    fn robot_parameters(&self) -> Vec<ParameterValue> {
        let table = self.robot_alone().0.parameters();
        let mut out = self.parameter_values(0..self.model.log_columns().start);
        out.sort_by_cached_key(|p| table.column(&p.name));
        out
    }

    fn robot_shapes(&self) -> Vec<ShapeValue> {
        let table = self.robot_alone().0.parameters();
        let all = self.shape_values();
        table.shape.iter().filter_map(|s| all.iter().find(|v| v.name == s.name).cloned()).collect()
    }

    /// Factors on friction of the logs that have one of their own.
    pub(crate) fn log_scales(&self) -> Vec<LogScale> {
        let all = self.shape_values();
        let of = |(log, _): (String, f64)| {
            let found = all.iter().find(|s| s.name == scale_name(&log))?.clone();
            Some(LogScale {
                log,
                value: found.value,
                std: found.std,
                interval: found.interval,
                verdict: found.verdict,
                reason: found.reason,
            })
        };
        self.plan.log_terms.scaled().into_iter().filter_map(of).collect()
    }

    fn base_values(&self) -> Vec<BaseValue> {
        let table = self.model.parameters();
        let expressions = self.base.expressions(table);
        let consistent = self.base.values(self.values());
        self.standard_deviations()
            .into_iter()
            .enumerate()
            .filter(|(k, _)| shape::of_change(&table.linear[self.base.kept[*k]].name).is_none())
            .map(|(k, (std, white))| {
                let p = &table.linear[self.base.kept[k]];
                // The interval of a coefficient of friction is about its value at unconstrained loads.
                let column = self.base.kept[k];
                let own = self.model.journals().is_some_and(|j| j.coefficients().any(|mu| mu == column));
                let found = if own { self.trust.parameters[column].unconstrained } else { self.fit().x[k] };
                let value = std.map(|_| found);
                BaseValue {
                    name: p.name.clone(),
                    expression: expressions[k].clone(),
                    unit: p.unit.to_owned(),
                    value,
                    consistent_value: Some(consistent[k]),
                    half_width: self.trust.base_half_width[k],
                    verdict: Some(recorded(self.trust.base[k].verdict).0),
                    share: Some(self.trust.base[k].achieved),
                    std,
                    std_white: white,
                    rel_std: relative(value, std),
                }
            })
            .collect()
    }

    fn shape_values(&self) -> Vec<ShapeValue> {
        let (model, _) = self.identified_model();
        // What is identified obeys the ties and knows nothing of them.
        let tied = self.shapes.as_ref().map_or(&self.model, |found| &found.model);
        let columns = self.model.parameters();
        let free = self
            .shapes
            .as_ref()
            .map(|found| shape::unfold(&found.model, &self.model, self.unconstrained_values()));
        model
            .parameters()
            .shape
            .iter()
            .enumerate()
            .map(|(k, p)| {
                let finding = self.shapes.as_ref().map(|found| found.finding(k));
                let tie = tied.ties().and_then(|ties| ties.of_shape(k));
                let (lower, upper) = match tie.and_then(Dependent::multiple) {
                    Some((free, factor)) => {
                        let of = &tied.parameters().shape[free];
                        let (a, b) = (factor * of.lower, factor * of.upper);
                        (a.min(b), a.max(b))
                    }
                    None => (p.lower, p.upper),
                };
                let trust = columns.column(&change_name(&p.name)).map(|c| &self.trust.parameters[c]);
                let (verdict, one_sided) = shape::verdict(finding.map(|f| f.verdict));
                let seen = verdict == ShapeVerdict::SeenInData;
                let std = trust.and_then(|t| t.std).filter(|_| seen);
                let at =
                    self.shapes.as_ref().map_or(p.start, |found| found.model.parameters().shape[k].start);
                let around = trust
                    .and_then(|t| t.interval)
                    .filter(|_| seen)
                    .map(|(low, high)| ((at + low).clamp(lower, upper), (at + high).clamp(lower, upper)));
                ShapeValue {
                    name: p.name.clone(),
                    unit: p.unit.to_owned(),
                    value: p.start,
                    unconstrained: free.as_ref().map(|free| free.shape[k]),
                    range: (lower, upper),
                    tie: tie.map(|d| Ties::shape_words(d, model.parameters())),
                    std,
                    interval: around.or(one_sided),
                    verdict,
                    reason: shape::reason(finding, self.conditioning.is_some())
                        .or_else(|| trust.filter(|t| seen && t.std.is_none()).map(without_interval)),
                }
            })
            .collect()
    }

    fn fit_summary(&self) -> FitSummary {
        if let Some(first) = self.row_fits.first() {
            return FitSummary {
                raw: FitValues::unknown(first.fit.channels.len()),
                filtered: pool(self.row_fits.iter().map(|rows| &rows.fit)),
                filter_hz: self.kernel_hz,
                by_motion: ByMotion::default(),
            };
        }
        FitSummary {
            raw: pool(self.training.iter().map(|a| &a.raw)),
            filtered: pool(self.training.iter().map(|a| &a.filtered)),
            filter_hz: self.kernel_hz,
            by_motion: by_motion(&self.training),
        }
    }

    fn conditioning_record(&self) -> ConditioningRecord {
        let delay = self.conditioning.as_ref().map(|c| &c.delay);
        ConditioningRecord {
            route: self.settings.conditioning.route,
            choices: self.choices(),
            delay_samples: self.delay_samples,
            delay_rate_hz: self.delay_rate_hz,
            delay_half_width: delay.map(|d| d.half_width),
            delay_per_joint: delay.map_or_else(Vec::new, |d| d.per_output.clone()),
            kernel_trials: self.conditioning.as_ref().map_or_else(Vec::new, |c| {
                c.kernel_trials.iter().map(|t| (t.kernel_hz, t.loss, t.loss_rich)).collect()
            }),
            mask_trials: self.conditioning.as_ref().map_or_else(Vec::new, |c| {
                c.mask_trials.iter().map(|t| (t.level, t.loss, t.standard_error, t.kept)).collect()
            }),
            friction_trials: friction::trials(self),
            cyclic_efforts: cyclic::records(self),
            row_rms: self.row_rms.clone(),
            residual_ratio: self.residual_ratio.clone(),
        }
    }

    /// Every choice of the conditioning with its reason.
    pub fn choices(&self) -> Vec<Choice> {
        let mut out = Vec::new();
        let mut add = |name: &str, value: serde_json::Value, unit: &str, origin: Origin, reason: String| {
            out.push(Choice { name: name.to_owned(), value, unit: unit.to_owned(), origin, reason });
        };
        let given = |set: bool| if set { Origin::Given } else { Origin::Found };
        for (log, source) in self.logs.iter().zip(self.training_sources()) {
            let name = short_name(&log.name);
            let resampled = if log.clock.resampled { "resampled on a uniform grid" } else { "used as it is" };
            add(
                &format!("sample rate of {name}"),
                json!(log.rate_hz),
                "Hz",
                given(source.rate_given),
                format!(
                    "median step; jitter {:.2e} of a sample, {} gaps: {resampled}",
                    log.clock.jitter,
                    log.clock.gaps.len()
                ),
            );
            let spikes: usize = log.spikes.iter().map(|s| s.0 + s.1).sum();
            add(
                &format!("spikes removed from {name}"),
                json!(spikes),
                "samples",
                Origin::Found,
                "isolated runs far outside the running median; chatter and steps at reversal stay".to_owned(),
            );
        }
        for (log, source) in self.logs.iter().zip(self.training_sources()) {
            let name = short_name(&log.name);
            for note in &source.notes {
                add(
                    &format!("{} of {name}", note.setting),
                    json!(note.value),
                    "",
                    Origin::Found,
                    note.reason.clone(),
                );
            }
        }
        for (log, source) in self.logs.iter().zip(self.training_sources()) {
            let name = short_name(&log.name);
            for (signal, used) in &source.columns {
                add(
                    &format!("{signal} columns of {name}"),
                    json!(used),
                    "",
                    given(source.columns_given),
                    "by the names in the header unless the configuration says otherwise".to_owned(),
                );
            }
        }
        for law in &self.plan.known {
            let name = format!("known friction of {}", law.joint);
            add(&name, json!(law.in_words()), "", Origin::Given, friction::of_known(self, law));
        }
        for log in self.logs.iter() {
            if let Some(motion) = &log.periodic {
                add(
                    &format!("period of {}", short_name(&log.name)),
                    json!(motion.period_s),
                    "s",
                    Origin::Found,
                    smoothing::period(&self.settings, motion),
                );
            }
            if let Some((name, value, unit, set, reason)) = smoothing::averaged(log) {
                add(&name, value, unit, given(set), reason);
            }
        }
        let Some(c) = &self.conditioning else {
            let route = self.settings.textbook_route();
            for (name, value, unit, set, reason) in smoothing::choices(&self.settings, &self.logs) {
                add(&name, value, unit, given(set), reason);
            }
            for log in self.logs.iter() {
                add(
                    "decimation",
                    json!(route.factor(log)),
                    "",
                    given(route.decimation.is_some()),
                    "about five rows per period of the cut-off".to_owned(),
                );
            }
            return out;
        };
        let noise: Vec<f64> = self.trained.iter().flat_map(|l| l.position_noise.iter().copied()).collect();
        let largest_noise = noise.iter().copied().fold(0.0, f64::max);
        add(
            "kernel cut-off",
            json!(c.kernel_hz),
            "Hz",
            given(self.settings.conditioning.kernel_hz.is_some()),
            format!(
                "highest cut-off (limit {:.2} Hz from position noise up to {largest_noise:.1e} rad, crossing {:.1} Hz, excited band {:.2} Hz) that held-out blocks do not speak against",
                c.limit.limit_hz, c.limit.crossing_hz, c.limit.excited_band_hz
            ),
        );
        add(
            "kernels used together",
            json!(c.scales_hz),
            "Hz",
            Origin::Found,
            "narrower kernels fill what the widest cannot reach between reversals".to_owned(),
        );
        let state_given = given(self.settings.conditioning.state_hz.is_some());
        add(
            "state cut-off",
            json!(c.state_hz.iter().copied().fold(f64::INFINITY, f64::min)),
            "Hz",
            state_given,
            format!(
                "states are filtered well above the kernel, so that signs of velocity stay sharp; noise shows in the velocity from {:.2} Hz on",
                c.limit.velocity_hz
            ),
        );
        add(
            "state cut-off of predictions",
            json!(self.state_hz),
            "Hz",
            state_given,
            "no kernel takes the noise of accelerations out of predictions".to_owned(),
        );
        add(
            "delay of the effort",
            json!(c.delay.samples),
            "samples",
            given(c.delay.given),
            match c.delay.chi_squared {
                _ if c.delay.given => "as given".to_owned(),
                Some(chi) => format!(
                    "fitted with the parameters, ± {:.3} (95 %), joints agree with χ²/dof {chi:.2}",
                    c.delay.half_width
                ),
                None => format!("fitted with the parameters, ± {:.3} (95 %)", c.delay.half_width),
            },
        );
        for (output, mask) in self.model.outputs().iter().zip(c.mask.iter().zip(&c.usable)) {
            add(
                &format!("reversal mask of {}", output.name),
                mask.0.map_or(json!(null), |m| json!(m)),
                "of rms speed",
                given(self.settings.conditioning.reversal_mask.is_some()),
                format!(
                    "held-out error over the ladder of masks; {:.0} % of the samples stay",
                    100.0 * mask.1
                ),
            );
        }
        for (output, joint) in self.model.outputs().iter().zip(&self.friction) {
            let (shapes, reason) = friction::in_words(joint);
            add(&format!("friction shapes of {}", output.name), json!(shapes), "", Origin::Found, reason);
        }
        let efforts = cyclic::records(self);
        for of_joint in efforts.chunk_by(|a, b| a.joint == b.joint) {
            let own = |c: &&crate::JointCyclic| self.model.outputs()[c.output].name == of_joint[0].joint;
            let may_be_a_spring = self.cyclic.iter().filter(own).any(|c| c.found.may_be_a_spring());
            let (names, reason) = cyclic::in_words(of_joint, may_be_a_spring);
            let name = format!("cyclic efforts of {}", of_joint[0].joint);
            add(&name, json!(names), "", Origin::Found, reason);
        }
        out
    }
}

/// Why a shape parameter that the search finds in the data has no interval.
fn without_interval(trust: &ParameterTrust) -> String {
    let (verdict, reason) = recorded(trust.assessment.verdict);
    let reason = reason.map_or_else(String::new, |r| format!(" ({r})"));
    format!("no interval: beside all other parameters it is {verdict}{reason}")
}

fn relative(value: Option<f64>, std: Option<f64>) -> Option<f64> {
    let (value, std) = (value?, std?);
    (value.abs() >= 2.0 * std && value != 0.0).then(|| 100.0 * std / value.abs())
}
