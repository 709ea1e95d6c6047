//! From an identification to `friction.json`.

use std::collections::BTreeMap;

use dynid_estimate::distribution::f_quantile;
use dynid_friction::steady_friction::{LevelFit, SteadyFriction};
use dynid_record::Outcome;
use dynid_sim::presliding::EffortHold;

use super::config::FrictionConfig;
use super::{FrictionIdentification, IdentifiedJoint, PreslidingFit};
use crate::Error;
use crate::estimate::{InputRecord, Provenance};
use crate::friction_model::{
    EffortBetween, FrictionModel, FrictionStatus, FrictionVerdict, JointFrictionModel, LawRecord,
    LevelRecord, LineRecord, PointRecord, PreslidingRecord, PreslidingStatus, SCHEMA, UnpairedRecord,
};
use crate::known_friction::{BristleModel, ViscousModel};

/// Names of coefficients in the file, by symbol.
const NAMES: [(&str, &str); 10] = [
    ("fc", "coulomb"),
    ("fs", "static"),
    ("vs", "stribeck_speed"),
    ("fv", "coefficient"),
    ("sigma2", "sigma2"),
    ("sigma2_slope", "sigma2_slope"),
    ("sigma3", "sigma3"),
    ("sigma3_slope", "sigma3_slope"),
    ("sigma4", "sigma4"),
    ("sigma4_slope", "sigma4_slope"),
];

/// Chance with which points without any friction pass for a law.
const BY_CHANCE: f64 = 0.999;
/// Most of the friction's power that a law may leave.
const MOST_LEFT: f64 = 0.5;

impl FrictionIdentification {
    /// What the identification leaves behind.
    ///
    /// # Errors
    /// [`Error::Read`] if an input cannot be hashed.
    pub fn model(&self, config: &FrictionConfig) -> Result<FrictionModel, Error> {
        let joints: Vec<JointFrictionModel> = self.joints.iter().map(|j| record(j, config)).collect();
        let verdict = verdict(&joints, &self.warnings);
        Ok(FrictionModel {
            schema: SCHEMA,
            robot: self.robot.file.description.name.clone(),
            verdict,
            joints,
            provenance: provenance(config, self.inputs.clone()),
            warnings: self.warnings.clone(),
        })
    }
}

fn record(joint: &IdentifiedJoint, config: &FrictionConfig) -> JointFrictionModel {
    let mut out = JointFrictionModel {
        joint: joint.experiment.joint.clone(),
        status: FrictionStatus::NotIdentified,
        coulomb: None,
        static_: None,
        stribeck_speed: None,
        stribeck_exponent: None,
        viscous: None,
        offset: None,
        bristle: None,
        temperature_range: None,
        speed_range: None,
        std: BTreeMap::new(),
        residual_rms: None,
        largest_error: None,
        chi_squared: None,
        points: points(joint),
        samples: joint.experiment.series.len(),
        levels: Vec::new(),
        lines: BTreeMap::new(),
        laws: Vec::new(),
        unpaired: unpaired(joint),
        presliding: joint.presliding.iter().map(presliding).collect(),
        notes: joint.experiment.notes.clone(),
    };
    out.notes.extend(passes_note(joint));
    match &joint.law {
        Ok(found) => law(&mut out, found, joint, config),
        Err(reason) => {
            if joint.experiment.pairing.one_direction() {
                out.status = FrictionStatus::OneDirection;
                out.notes.push(one_direction_note(joint));
            }
            out.notes.insert(0, reason.clone());
        }
    }
    bristle(&mut out, joint, config);
    out
}

fn points(joint: &IdentifiedJoint) -> Vec<PointRecord> {
    let residuals = joint.law.as_ref().ok().map(|l| &l.residuals);
    let pairing = &joint.experiment.pairing;
    pairing
        .points
        .iter()
        .enumerate()
        .map(|(k, p)| PointRecord {
            speed: p.speed,
            temperature: p.temperature,
            friction: p.friction,
            std: p.std,
            half_sum: p.half_sum,
            passes: p.passes.len(),
            residual: residuals.and_then(|r| r.get(k)).copied(),
        })
        .collect()
}

fn unpaired(joint: &IdentifiedJoint) -> Vec<UnpairedRecord> {
    let list = &joint.experiment.pairing.unpaired;
    list.iter()
        .map(|u| UnpairedRecord {
            log: joint.experiment.passes[u.pass].log.clone(),
            speed: u.summary.speed,
            temperature: u.summary.temperature,
            effort: u.summary.effort,
            spread: u.summary.spread,
            samples: u.summary.samples,
            reason: u.reason.to_string(),
        })
        .collect()
}

fn passes_note(joint: &IdentifiedJoint) -> Option<String> {
    let (all, left) = (joint.experiment.passes.len(), joint.experiment.pairing.unpaired.len());
    let partly = left > 0 && left < all;
    partly.then(|| {
        format!("{left} of {all} passes have no partner and went into no point; `unpaired` says why")
    })
}

fn one_direction_note(joint: &IdentifiedJoint) -> String {
    let unpaired = &joint.experiment.pairing.unpaired;
    let speeds = unpaired.iter().map(|u| u.summary.speed);
    let (low, high) = speeds.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)));
    let mut text = format!(
        "{} at {low:.3} to {high:.3}: the efforts stated hold friction, gravity and offset together",
        if unpaired.len() == 1 { "one pass".to_owned() } else { format!("{} passes", unpaired.len()) },
    );
    if high - low < 0.1 * high.abs() {
        text.push_str("; with one speed, viscous friction is not told from Coulomb friction either");
    }
    let warm = unpaired.iter().filter_map(|u| u.summary.temperature);
    let (cold, hot) = warm.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), t| (a.min(t), b.max(t)));
    if cold <= hot && hot - cold < 5.0 {
        text.push_str(&format!(
            "; temperatures of {cold:.1} to {hot:.1} degC are too close for lines of the coefficients"
        ));
    }
    text
}

fn law(
    out: &mut JointFrictionModel,
    found: &SteadyFriction,
    joint: &IdentifiedJoint,
    config: &FrictionConfig,
) {
    let law = &found.law;
    out.coulomb = law.value("fc");
    out.static_ = law.value("fs");
    out.stribeck_speed = law.value("vs");
    out.stribeck_exponent = out.stribeck_speed.map(|_| 2.0);
    out.offset = law.value("fo");
    out.viscous = ViscousModel::of_law(law);
    for (symbol, name) in NAMES.into_iter().chain([("fo", "offset")]) {
        if let Some(std) = law.std(symbol) {
            out.std.insert(name.to_owned(), std);
        }
    }
    out.residual_rms = Some(found.error.rms);
    out.largest_error = Some(found.error.largest);
    out.chi_squared = Some((found.error.chi_squared, found.error.freedom));
    let speeds = joint.experiment.points();
    out.speed_range = Some(extent(speeds.iter().map(|p| p.speed.abs())));
    let warm: Vec<f64> = speeds.iter().filter_map(|p| p.temperature).collect();
    let experiment = (!warm.is_empty()).then(|| extent(warm.into_iter()));
    out.temperature_range = config.temperature_range.or(experiment);
    out.levels = found.levels.iter().map(level).collect();
    out.lines = found
        .lines
        .iter()
        .map(|line| {
            let record = LineRecord {
                intercept: line.value,
                slope: line.slope,
                intercept_half_width: line.half_width(config.reference_temperature),
                slope_half_width: line.slope_half_width(),
                confidence: config.confidence,
                chi_squared: line.chi_squared,
            };
            (line.symbol.to_owned(), record)
        })
        .collect();
    out.laws = found
        .ladder
        .iter()
        .map(|rung| LawRecord {
            law: rung.form.to_string(),
            rms: rung.error.map(|e| e.rms),
            aicc: rung.aicc,
            refused: rung.refused.clone(),
            chosen: rung.chosen,
        })
        .collect();
    out.notes.insert(0, format!("law: {}", law.form));
    out.notes.extend(found.notes.iter().cloned());
    let simple = law.value("fs").is_none() || law.value("sigma2").is_none() || !law.form.thermal;
    out.status = if simple { FrictionStatus::Simplified } else { FrictionStatus::Identified };
    if let Some(share) = unexplained(found, speeds.iter().map(|p| p.friction)) {
        out.status = FrictionStatus::NotIdentified;
        (out.coulomb, out.static_, out.stribeck_speed, out.stribeck_exponent) = (None, None, None, None);
        (out.offset, out.viscous) = (None, None);
        out.std.clear();
        out.levels.clear();
        out.lines.clear();
        out.notes.push(format!(
            "no law of friction: the best one leaves {:.0} % of the friction of the points unexplained (root mean square), no less than noise would \
             by chance; see whether effort and speed are of this joint",
            100.0 * share
        ));
        return;
    }
    if law.value("fv").is_some_and(|fv| fv < 0.0) {
        out.notes.push(
            "the viscous coefficient is negative: friction falls with speed within the speeds of the test, the law is not to be \
             used beyond them"
                .to_owned(),
        );
    }
    check_range(out, found, experiment);
}

/// Share of the friction (root mean square) that a law leaves, if that is more than half of its power, or no less than chance leaves.
fn unexplained(found: &SteadyFriction, friction: impl Iterator<Item = f64>) -> Option<f64> {
    let all: f64 = friction.map(|f| f * f).sum();
    let left: f64 = found.residuals.iter().map(|r| r * r).sum();
    let freedom = found.error.freedom as f64;
    let terms = found.residuals.len() as f64 - freedom;
    let f = (all - left) / terms / (left / freedom);
    let chance = f_quantile(BY_CHANCE, terms, freedom).is_some_and(|limit| f < limit);
    (chance || left > MOST_LEFT * all).then(|| (left / all).sqrt())
}

/// Refuses a law whose `σ2` vanishes where it was measured, shortens a wider range that was asked for.
fn check_range(out: &mut JointFrictionModel, found: &SteadyFriction, experiment: Option<[f64; 2]>) {
    let Some(zero) = found.law.vanishes_at() else { return };
    let inside = |[a, b]: [f64; 2]| (a..=b).contains(&zero);
    if experiment.is_some_and(inside) {
        out.status = FrictionStatus::Invalid;
        out.notes.insert(
            0,
            format!(
                "sigma2 vanishes at {zero:.1} degC, within the temperatures of the experiment: the law is not to be used; check \
                 the temperatures, or evaluate fewer of them"
            ),
        );
        return;
    }
    let Some([low, high]) = out.temperature_range.filter(|r| inside(*r)) else { return };
    // Keep a tenth of the way between the experiment and the zero: viscous friction stays positive.
    let [cold, hot] = experiment.unwrap_or([low, high]);
    let kept = if zero > hot { [low, hot + 0.9 * (zero - hot)] } else { [cold - 0.9 * (cold - zero), high] };
    out.temperature_range = Some(kept);
    out.notes.push(format!(
        "sigma2 would vanish at {zero:.1} degC: the range asked for, {low} to {high} degC, is cut to {:.1} to {:.1} degC",
        kept[0], kept[1]
    ));
}

fn extent(values: impl Iterator<Item = f64>) -> [f64; 2] {
    values.fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], x| [a.min(x), b.max(x)])
}

fn level(level: &LevelFit) -> LevelRecord {
    let value = |symbol: &str| level.common.as_ref().and_then(|c| c.value(symbol));
    let sigmas = ["sigma2", "sigma3", "sigma4"];
    let std = sigmas
        .iter()
        .filter_map(|s| Some(((*s).to_owned(), level.common.as_ref().and_then(|c| c.std(s))?)))
        .collect();
    let alone = NAMES
        .iter()
        .filter_map(|(symbol, name)| Some(((*name).to_owned(), level.own.as_ref()?.value(symbol)?)))
        .collect();
    LevelRecord {
        temperature: level.temperature,
        points: level.points.len(),
        sigma2: value("sigma2"),
        sigma3: value("sigma3"),
        sigma4: value("sigma4"),
        std,
        alone,
        alone_rms: level.own_error.map(|e| e.rms),
    }
}

fn presliding(fit: &PreslidingFit) -> PreslidingRecord {
    let values = fit.outcome.as_ref().ok();
    PreslidingRecord {
        log: fit.log.clone(),
        status: match values {
            Some(_) => PreslidingStatus::Identified,
            None => PreslidingStatus::NotIdentifiable,
        },
        reason: fit.outcome.as_ref().err().cloned().unwrap_or_default(),
        sigma0: values.map(|v| [v[0].0, v[0].1]),
        sigma1: values.map(|v| [v[1].0, v[1].1]),
        motion: fit.motion,
        resolution: fit.resolution,
        residual_rms: fit.residual_rms,
        effort_hold: fit.hold.map(|h| match h {
            EffortHold::Held => EffortBetween::Held,
            EffortHold::Linear => EffortBetween::Linear,
        }),
        simulations: fit.simulations,
    }
}

/// Bristles of the log that tells most, else the prior, else none.
fn bristle(out: &mut JointFrictionModel, joint: &IdentifiedJoint, config: &FrictionConfig) {
    let share = |v: &[(f64, f64); 2]| v.iter().map(|(x, s)| s / x).fold(0.0, f64::max);
    let best = joint
        .presliding
        .iter()
        .filter_map(|fit| fit.outcome.as_ref().ok())
        .min_by(|a, b| share(a).total_cmp(&share(b)));
    if let Some([(sigma0, std0), (sigma1, std1)]) = best {
        out.bristle = Some(BristleModel { sigma0: *sigma0, sigma1: *sigma1, prior: false });
        out.std.insert("sigma0".to_owned(), *std0);
        out.std.insert("sigma1".to_owned(), *std1);
        return;
    }
    let prior = config.prior.get(&out.joint);
    out.bristle = prior.map(|p| BristleModel { sigma0: p.sigma0, sigma1: p.sigma1, prior: true });
    let kept = if prior.is_some() { "the stated prior is kept" } else { "none are given" };
    match joint.presliding.first().and_then(|fit| fit.outcome.as_ref().err()) {
        Some(reason) => out.notes.push(format!("bristles sigma0, sigma1: {reason}; {kept}")),
        None => out.notes.push(format!(
            "bristles sigma0, sigma1 are not identifiable without a pre-sliding log: constant speeds do not bend them; {kept}"
        )),
    }
}

fn verdict(joints: &[JointFrictionModel], warnings: &[String]) -> FrictionVerdict {
    let of = |status: FrictionStatus| {
        let list: Vec<&str> =
            joints.iter().filter(|j| j.status == status).map(|j| j.joint.as_str()).collect();
        (list.len(), list.join(", "))
    };
    let (invalid, one, without) =
        (of(FrictionStatus::Invalid), of(FrictionStatus::OneDirection), of(FrictionStatus::NotIdentified));
    let mut parts = Vec::new();
    let laws = joints.len() - invalid.0 - one.0 - without.0;
    if laws > 0 {
        parts.push(format!(
            "{laws} of {} {} a friction law",
            joints.len(),
            if joints.len() == 1 { "joint has" } else { "joints have" }
        ));
    }
    for ((count, names), what) in [
        (&invalid, "sigma2 vanishes within the experiment's temperatures"),
        (&one, "one direction only, Coulomb friction and offset cannot be told apart"),
        (&without, "no friction law"),
    ] {
        if *count > 0 {
            parts.push(format!("{names}: {what}"));
        }
    }
    let simple = joints.iter().any(|j| j.status == FrictionStatus::Simplified);
    let status = match () {
        () if laws == 0 || invalid.0 > 0 => Outcome::Fail,
        () if one.0 + without.0 > 0 || simple || !warnings.is_empty() => Outcome::Warn,
        () => Outcome::Pass,
    };
    FrictionVerdict { status, headline: parts.join("; ") }
}

/// Settings of an identification of friction that states nothing.
pub(super) fn default_settings() -> serde_json::Value {
    serde_json::to_value(FrictionConfig::default()).unwrap_or_default()
}

fn provenance(config: &FrictionConfig, inputs: Vec<InputRecord>) -> Provenance {
    let settings = serde_json::to_value(config).unwrap_or_default();
    Provenance { inputs, settings, ..Provenance::default() }
}
