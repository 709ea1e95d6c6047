//! What a log shows of the columns that it was read from, once a model is tried on it.

use dynid_estimate::consistent::Problem;
use dynid_factor::Factor;
use dynid_logs::columns::degrees_suspected;
use dynid_model::EffortModel;
use dynid_motion::UniformLog;
use dynid_rows::preflight::{
    Excitation, Found, GaussianPrior, PreflightError, Rewiring, Samples, Tilt, Trial, Wiring, WiringSearch,
    excitation, tilt,
};

use super::bench::{Bench, UNEXPLAINED};
use super::columns::Velocities;
use super::plausibility::{self, Taken};
use crate::finding::{FindingId, Findings, Fix, Severity};
use crate::{Error, consistency};

impl Bench {
    /// Examines a log on its grid, joints in the order of the outputs.
    pub(super) fn examine(
        &self,
        log: &UniformLog,
        idle: &[String],
        out: &mut Findings<'_>,
    ) -> Result<Examined, Error> {
        let mut found = Examined::default();
        let not_examined = |out: &mut Findings<'_>, reason: String| {
            let remedy = "nothing: order, signs and units of its columns were not examined";
            out.add(FindingId::NotExamined, Severity::Info, None, reason, remedy);
        };
        if let Some(reason) = self.refusal(log) {
            not_examined(out, reason);
            return Ok(found);
        }
        let moves: Vec<bool> = log.joints.iter().map(|j| !idle.contains(&j.name)).collect();
        let Some(samples) = Samples::new(log, &moves).map_err(PreflightError::from)? else {
            let evidence = "too little motion, or too short a log, for a model to be tried".to_owned();
            let remedy = "record for longer: order, signs and units of the columns were not examined";
            out.add(FindingId::NotExamined, Severity::Warning, None, evidence, remedy);
            return Ok(found);
        };
        let prior = self.prior(log)?;
        let problem = |factor: &Factor| -> Problem {
            consistency::problem(&self.model, &self.regrouping, factor, &prior, &[])
        };
        let velocities = Velocities::new(log, &moves, samples.cutoff_hz);
        let trial = Trial {
            model: &self.model,
            shape: &self.shape,
            kept: &self.base.kept,
            log,
            moves: &moves,
            samples: &samples,
            slides: &self.slides,
            problem: &problem,
            prior: GaussianPrior { values: &prior.values, std: &prior.std, weight: PRIOR_WEIGHT },
            gravity: self.gravity,
            delay_s: self.stated_delay / log.rate_hz,
            clock: velocities.clock(),
        };
        let mut search = trial.search(!self.known_effort_scale)?;
        let follow = velocities.follow_positions();
        let told = super::columns::wiring(
            &search,
            follow,
            (log.rate_hz, velocities.clock(), self.gravity),
            &self.names(),
            out,
        );
        self.beyond_limits(log, &mut search.wiring, follow, out);
        velocities.examine(log, &moves, samples.cutoff_hz, &search.wiring, out);
        let mut wiring = search.wiring.clone();
        let (misfit, nothing) = (search.misfit(), search.nothing);
        let explained = search.misfit() < UNEXPLAINED * UNEXPLAINED * search.nothing;
        let of_all = |f: &Found| match f.change {
            Rewiring::AllEffortScales(factor) => factor,
            _ => 1.0,
        };
        let applied: f64 = search.found.iter().map(of_all).product();
        found.wiring = Some(search);
        found.excitation = Some(excitation(&self.model, &self.shape, &self.base.kept, &samples, &wiring)?);
        self.weak_excitation(found.excitation.as_ref(), out);
        if explained && told {
            let taken = Taken {
                velocities: follow,
                known: self.known_effort_scale,
                applied,
                unexplained: (misfit / nothing).sqrt(),
            };
            plausibility::gravity_size(self, &trial, &wiring, misfit, out);
            plausibility::examine(self, &trial, &mut wiring, &prior, &taken, out)?;
        }
        if wiring.delay_s == self.stated_delay / log.rate_hz {
            found.tilt = tilt(&trial, &wiring)?;
        }
        if !explained && told {
            let evidence = format!(
                "whatever column is taken for whose, bodies that can exist leave {:.0} % of the efforts unexplained",
                100.0 * (misfit / nothing).sqrt()
            );
            let remedy =
                "see whether robot file and log are of the same robot, and whether something else acts on it";
            out.add(FindingId::UnexplainedEffort, Severity::Warning, None, evidence, remedy);
            return Ok(found);
        }
        if wiring.gravity.is_none() {
            tilted(found.tilt, out);
        }
        Ok(found)
    }

    /// Positions far beyond the limits of a joint that keep them as degrees: what no effort tells of a symmetric wrist.
    fn beyond_limits(&self, log: &UniformLog, wiring: &mut Wiring, velocities: bool, out: &mut Findings<'_>) {
        for (j, joint) in log.joints.iter().enumerate() {
            let limits = self.model.limits(j);
            let plain = wiring.position[j].factor.abs() == 1.0;
            if self.slides[j] || !plain || limits.position.is_none() {
                continue;
            }
            let source = &log.joints[wiring.position[j].joint].position;
            let Some(found) = degrees_suspected(std::slice::from_ref(source), &[limits.position]) else {
                continue;
            };
            let evidence = format!(
                "positions reach {:.1}, {:.0} times the limit of {:.3} rad that they keep as degrees",
                found.largest,
                found.largest / found.limit.unwrap_or(1.0),
                found.limit.unwrap_or(0.0)
            );
            wiring.position[j].factor *= 1f64.to_radians();
            let remedy = "state the unit of the position";
            out.add(FindingId::Degrees, Severity::Error, Some(&joint.name), evidence, remedy).fixes =
                vec![Fix::Wiring { wiring: wiring.clone(), velocities }];
        }
    }

    fn weak_excitation(&self, excitation: Option<&Excitation>, out: &mut Findings<'_>) {
        let Some(found) = excitation else { return };
        let total = self.base.len();
        if found.excited == total && found.condition <= CONDITION {
            return;
        }
        let table = &self.model.parameters().linear;
        let name = |k: &usize| table[self.base.kept[*k]].name.clone();
        let unseen: Vec<String> = (0..total).filter(|k| found.std[*k].is_none()).map(|k| name(&k)).collect();
        let condition = match found.condition {
            c if c.is_finite() => format!("condition number {c:.0} (unit columns)"),
            _ => "regressor singular".to_owned(),
        };
        let mut evidence = format!("{condition}, {} of {total} base parameters excited", found.excited);
        if !unseen.is_empty() {
            evidence += &format!("; not excited: {}", first_of(&unseen));
        }
        let remedy = "record a trajectory made for identification (`dynid design`); verdicts say which parameters this log still tells";
        out.add(FindingId::WeakExcitation, Severity::Warning, None, evidence, remedy);
    }
}

fn first_of(names: &[String]) -> String {
    let shown = names.iter().take(6).cloned().collect::<Vec<_>>().join(", ");
    if names.len() > 6 { format!("{shown} and {} more", names.len() - 6) } else { shown }
}

fn tilted(tilt: Option<Tilt>, out: &mut Findings<'_>) {
    let Some(found) = tilt.filter(|t| t.angle > TILT && t.angle > SURE * t.error) else { return };
    let g = found.gravity;
    let evidence = format!(
        "efforts show gravity {:.2} ± {:.2} degrees away from the direction stated: ({:.3}, {:.3}, {:.3}) m/s² in base axes",
        found.angle.to_degrees(),
        found.error.to_degrees(),
        g[0],
        g[1],
        g[2]
    );
    let remedy = "state gravity in base axes, or level the base";
    out.add(FindingId::BaseTilt, Severity::Warning, None, evidence, remedy).fixes = vec![Fix::Gravity(g)];
}

/// Weight of the prior: it decides only what the log leaves open.
const PRIOR_WEIGHT: f64 = 0.01;

/// Tilt that is worth a word, rad.
const TILT: f64 = 0.035;

/// A tilt counts beyond this many standard errors.
const SURE: f64 = 6.0;

/// Condition number of the weighted regressor with unit columns that asks for better excitation.
const CONDITION: f64 = 100.0;

/// What a model found in a log.
#[derive(Debug, Clone, Default)]
pub(super) struct Examined {
    pub(super) wiring: Option<WiringSearch>,
    pub(super) tilt: Option<Tilt>,
    pub(super) excitation: Option<Excitation>,
}
