//! How far each parameter can be trusted: verdict, interval, what the data see of it, and what would help.

use dynid_estimate::consistent::ActiveConstraint;
use dynid_estimate::distribution::t_quantile;
use dynid_estimate::identifiability::{
    Assessment, Carried, Identifiability, Posterior, Verdict, VisibleSpace, excited_regrouping, posterior,
    visible_combinations, with_half_width,
};
use dynid_linalg::Mat;
use dynid_model::ties::Dependent;
use dynid_model::{BaseParameters, EffortModel, Owner, RobotModel, Ties};
use dynid_record::{CarriedReason, ParameterVerdict};

use crate::advice::{Advice, FitRows, MotionSettings, Present, advise};
use crate::consistency::Consistent;
use crate::fitting::Fitted;
use crate::friction_power::{self, FrictionPower};
use crate::load_doubt::{Doubted, lessen};
use crate::prior::{Prior, link_lengths};

/// Confidence of the intervals.
pub const CONFIDENCE: f64 = 0.95;

/// What a result file says of a verdict: where the value comes from, and why the prior carries it.
pub fn recorded(verdict: Verdict) -> (ParameterVerdict, Option<CarriedReason>) {
    match verdict {
        Verdict::Seen => (ParameterVerdict::SeenInData, None),
        Verdict::CarriedByPrior(why) => {
            let reason = match why {
                Carried::OnlyInCombination => CarriedReason::OnlyInCombination,
                Carried::NotExcited => CarriedReason::NotExcited,
                Carried::TooNoisy => CarriedReason::TooNoisy,
            };
            (ParameterVerdict::CarriedByPrior, Some(reason))
        }
        Verdict::NotIdentifiable => (ParameterVerdict::NotIdentifiable, None),
        Verdict::Given => (ParameterVerdict::Given, None),
    }
}

/// What is known about one standard parameter.
#[derive(Debug, Clone)]
pub struct ParameterTrust {
    /// Shares and verdict.
    pub assessment: Assessment,
    /// Value without constraints, split as near as possible to the prior, in the parameter's unit.
    pub unconstrained: f64,
    /// Standard deviation of that, the prior's doubt about the split included; `None` unless the parameter is seen in the data.
    pub std: Option<f64>,
    /// 95 % interval around it, cut to where the parameter can lie; `None` unless seen in the data.
    pub interval: Option<(f64, f64)>,
    /// The interval is wide: beyond 30 % of the value or of what was known before.
    pub wide: bool,
    /// A constraint moved the value by more than a standard deviation.
    pub at_boundary: bool,
    /// What the data see of a parameter that acts only together with others.
    pub combination: Option<String>,
    /// The motion that would help.
    pub advice: Option<String>,
    /// How it follows from others, `j2.fc = j1.fc`, where it does: verdict, deviation and interval are then theirs.
    pub tie: Option<String>,
}

/// What is known about all parameters.
#[derive(Debug, Clone, Default)]
pub struct Trust {
    /// Standard parameters, in column order.
    pub parameters: Vec<ParameterTrust>,
    /// Shares and verdicts of the base parameters.
    pub base: Vec<Assessment>,
    /// 95 % half widths of the base parameters; `None` where the logs do not excite them.
    pub base_half_width: Vec<Option<f64>>,
    /// Motions that would help, most helpful first, a sentence each.
    pub motions: Vec<String>,
}

/// Everything that a verdict rests on.
pub(crate) struct Evidence<'a> {
    pub model: &'a RobotModel,
    pub base: &'a BaseParameters,
    pub regrouping: &'a Mat,
    pub space: &'a VisibleSpace,
    pub prior: &'a Prior,
    pub fitted: &'a Fitted,
    pub consistent: &'a Consistent,
    pub rows: &'a FitRows,
    /// Per output: whether the model explains its effort.
    pub explained: &'a [bool],
    pub power: &'a FrictionPower,
    /// What loads say of coefficients of friction.
    pub doubts: &'a [Doubted],
}

/// Half width of intervals of [`CONFIDENCE`] in standard deviations.
pub fn interval_quantile(fitted: &Fitted) -> f64 {
    let fit = &fitted.estimate;
    let freedom = match fitted.is_robust() {
        true => fit.blocks.len() as f64 - 1.0,
        false => fit.solution.rows as f64 - fit.solution.kept.len() as f64,
    };
    t_quantile(0.5 + 0.5 * CONFIDENCE, freedom.max(1.0)).unwrap_or(f64::INFINITY)
}

/// Standard parameters of a fit put together with the prior.
pub(crate) fn after(fitted: &Fitted, regrouping: &Mat, prior: &Prior) -> Option<Posterior> {
    let fit = &fitted.estimate;
    posterior(
        &excited_regrouping(&fit.factor, &fit.solution.kept, regrouping),
        &fit.kept_x(),
        &fitted.white,
        0.0,
        fitted.covariance(),
        &prior.values,
        &prior.std,
    )
}

impl Evidence<'_> {
    /// Verdicts of all parameters.
    pub(crate) fn trust(&self) -> Trust {
        let information = &self.fitted.information(self.explained);
        let mut assessed = self.space.assess(information, 1.0);
        for Doubted { column, variance, .. } in self.doubts {
            lessen(&mut assessed.parameters[*column], *variance);
            if let Some(base) = self.base.kept.iter().position(|k| k == column) {
                lessen(&mut assessed.base[base], *variance);
            }
        }
        let present = Present { space: self.space, information, inflation: 1.0, assessed: &assessed };
        let advice = advise(self.model, self.base, &present, self.rows, &MotionSettings::default());
        let quantile = interval_quantile(self.fitted);
        let base_half_width = self.base_deviations().into_iter().map(|s| s.map(|s| quantile * s)).collect();
        let joints: Vec<String> = self.model.outputs().iter().map(|o| o.name.clone()).collect();
        let symbols: Vec<&str> = self.model.parameters().linear.iter().map(|p| p.symbol.as_str()).collect();
        let mut trust = Trust {
            parameters: Vec::new(),
            base: assessed.base.clone(),
            base_half_width,
            motions: advice.by_motion(&joints, &symbols),
        };
        trust.parameters = self.parameters(&assessed, &advice, &joints, &symbols, quantile, &trust);
        trust
    }

    /// Standard deviations of all base parameters; `None` where a column was dropped.
    fn base_deviations(&self) -> Vec<Option<f64>> {
        let mut out = vec![None; self.base.len()];
        let covariance = self.fitted.covariance();
        for (k, c) in self.fitted.estimate.solution.kept.iter().enumerate() {
            out[*c] = Some(covariance[(k, k)].max(0.0).sqrt());
        }
        out
    }

    fn parameters(
        &self,
        assessed: &Identifiability,
        advice: &Advice,
        joints: &[String],
        symbols: &[&str],
        quantile: f64,
        trust: &Trust,
    ) -> Vec<ParameterTrust> {
        let after = after(self.fitted, self.regrouping, self.prior);
        let lengths = link_lengths(self.model.mechanism());
        let table = self.model.parameters();
        // Motions are proposed for the robot alone.
        let of_logs = self.model.log_columns();
        let mut out: Vec<ParameterTrust> = (0..table.linear.len())
            .map(|j| {
                let assessment = assessed.parameters[j].clone();
                let seen = assessment.verdict == Verdict::Seen;
                let own = self.doubts.iter().find(|doubt| doubt.column == j);
                let unconstrained = own.map_or(self.consistent.unconstrained[j], |doubt| doubt.value);
                let std = after.as_ref().map(|a| a.std[j]).filter(|_| seen);
                // Of what no motion separates from others, "no motion would" says nothing new.
                let in_combination = assessment.verdict
                    == Verdict::CarriedByPrior(Carried::OnlyInCombination)
                    && !advice.suggestions.iter().any(|s| s.parameter == j);
                ParameterTrust {
                    combination: (self.moment(j, symbols[j], quantile))
                        .or_else(|| self.combination(j, &assessment, symbols, trust, &lengths)),
                    advice: advice
                        .sentence(j, joints, symbols[j])
                        .filter(|_| !in_combination && !of_logs.contains(&j)),
                    ..self.judged(j, assessment, unconstrained, std, quantile)
                }
            })
            .collect();
        for dependent in self.model.ties().into_iter().flat_map(|ties| ties.linear()) {
            out[dependent.index] = self.dependent(dependent, &out, after.as_ref(), quantile);
        }
        out
    }

    /// What is known about a parameter from its value and deviation.
    fn judged(
        &self,
        column: usize,
        assessment: Assessment,
        unconstrained: f64,
        std: Option<f64>,
        quantile: f64,
    ) -> ParameterTrust {
        let lower = self.model.parameters().linear[column].lower.unwrap_or(f64::NEG_INFINITY);
        let interval = std.map(|s| {
            let (low, high) = (unconstrained - quantile * s, unconstrained + quantile * s);
            (low.max(lower), high.max(lower))
        });
        let value = self.consistent.values[column];
        let moved = (value - unconstrained).abs();
        ParameterTrust {
            wide: std.is_some_and(|s| assessment.is_wide(value, quantile * s)),
            at_boundary: self.constrained(column) && std.is_some_and(|s| moved > s),
            combination: None,
            advice: None,
            tie: None,
            assessment,
            unconstrained,
            std,
            interval,
        }
    }

    /// What is known about a parameter that follows from free ones.
    fn dependent(
        &self,
        dependent: &Dependent,
        free: &[ParameterTrust],
        after: Option<&Posterior>,
        quantile: f64,
    ) -> ParameterTrust {
        let of = |(k, factor): &(usize, f64)| (&free[*k].assessment, *factor);
        let least = |of_term: fn(&Assessment) -> f64| {
            dependent.terms.iter().map(|term| of_term(of(term).0)).fold(1.0, f64::min)
        };
        let root = |of_term: fn(&Assessment) -> f64| {
            dependent.terms.iter().map(|term| (of(term).1 * of_term(of(term).0)).powi(2)).sum::<f64>().sqrt()
        };
        // A sum is seen no better than the worst of its terms, and carried for the same reason.
        let worst = dependent.terms.iter().min_by(|a, b| of(a).0.achieved.total_cmp(&of(b).0.achieved));
        let assessment = Assessment {
            achieved: least(|a| a.achieved),
            log_limit: least(|a| a.log_limit),
            structural_limit: least(|a| a.structural_limit),
            hidden: worst.map_or(0.0, |term| of(term).0.hidden),
            prior_std: root(|a| a.prior_std),
            posterior_std: root(|a| a.posterior_std),
            verdict: worst.map_or(Verdict::Given, |term| of(term).0.verdict),
        };
        let unconstrained = self.consistent.unconstrained[dependent.index];
        let variance = after.map(|after| {
            let row = |(i, f): &(usize, f64)| {
                dependent.terms.iter().map(|(j, g)| f * g * after.covariance[(*i, *j)]).sum::<f64>()
            };
            dependent.terms.iter().map(row).sum::<f64>()
        });
        let std = variance.map(|v| v.max(0.0).sqrt()).filter(|_| assessment.verdict == Verdict::Seen);
        let combination = match dependent.terms[..] {
            [(k, _)] => free[k].combination.clone(),
            _ => None,
        };
        ParameterTrust {
            tie: Some(Ties::words(dependent, self.model.parameters())),
            combination,
            ..self.judged(dependent.index, assessment, unconstrained, std, quantile)
        }
    }

    /// Whether a constraint acts on the parameter or on its link.
    fn constrained(&self, column: usize) -> bool {
        let p = &self.model.parameters().linear[column];
        let Some(estimate) = &self.consistent.estimate else { return false };
        estimate.active.iter().any(|a| match (a, &p.owner) {
            (ActiveConstraint::AtZero { parameter }, _) => *parameter == p.name,
            (ActiveConstraint::AtBound { bound }, Owner::Joint(joint)) => {
                self.power.kept.contains(&p.name) && *bound == friction_power::bound_name(joint)
            }
            (ActiveConstraint::AtBound { .. }, _) => false,
            (on_link, Owner::Link(link)) => on_link.name() == link,
            _ => false,
        })
    }

    /// What the data see of a coefficient of friction whose load goes with masses, in words.
    fn moment(&self, column: usize, symbol: &str, quantile: f64) -> Option<String> {
        let doubt = self.doubts.iter().find(|doubt| doubt.column == column)?;
        let base = self.base.kept.iter().position(|kept| *kept == column)?;
        let place = self.fitted.estimate.solution.kept.iter().position(|kept| *kept == base)?;
        let own = (self.fitted.covariance()[(place, place)] - doubt.variance).max(0.0).sqrt();
        let seen = with_half_width(self.fitted.estimate.x[base], quantile * own);
        Some(format!(
            "the data see its product with the load: {symbol} = {seen} where the masses that press are as found here"
        ))
    }

    /// The base parameter that a parameter is best seen in, in words with its value.
    fn combination(
        &self,
        column: usize,
        assessment: &Assessment,
        symbols: &[&str],
        trust: &Trust,
        lengths: &[(f64, String)],
    ) -> Option<String> {
        if assessment.verdict != Verdict::CarriedByPrior(Carried::OnlyInCombination) {
            return None;
        }
        let all = visible_combinations(self.regrouping, &self.prior.std, &self.base.kept, column);
        // Seen combinations say more than others.
        let seen = |i: usize| trust.base[i].verdict == Verdict::Seen;
        let best = all.iter().find(|c| seen(c.base)).or(all.first())?;
        let value = self.fitted.estimate.x[best.base];
        let measured = trust.base_half_width[best.base].filter(|_| seen(best.base)).map(|h| (value, h));
        let unit = self.model.parameters().linear[self.base.kept[best.base]].unit;
        let mut sentence = best.sentence(symbols, measured, unit);
        let constants = best.constants(lengths);
        if !constants.is_empty() {
            sentence.push_str(&format!(" ({})", constants.join(", ")));
        }
        Some(sentence)
    }
}
