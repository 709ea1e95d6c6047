//! Drive gains from a known payload.

mod record;

pub use record::{GainsFile, JointGain};

use dynid_estimate::drive_gain::{LoadColumn, load_column};
use dynid_estimate::linear::LinearMethod;
use dynid_factor::Factor;
use dynid_model::element::{JointElement, KnownLoad, Payload};
use dynid_model::{
    BaseParameters, BaseSettings, EffortModel, Inertia, Mat3, Output, PerOutput, RobotModel, Vec3,
};
use dynid_rows::conditioning::{LogRows, condition};

use crate::Error;
use crate::config::{Config, LogConfig, Own, PayloadConfig, Route};
use crate::elements::ElementPlan;
use crate::estimate::{InputKind, InputRecord, Provenance};
use crate::fitting::{self, Fitted};
use crate::log::Log;
use crate::log_terms::{LogTerms, known_inertia};
use crate::pipeline::{Step, TrainingLog, held_where_not_logged, plan_elements};
use crate::robot::{Robot, refuse_internal_load};
use crate::settings::{LogSettings, Settings, labels};
use crate::trust::interval_quantile;

/// Drive gains, with the fit that they come from.
#[derive(Debug)]
pub struct GainIdentification {
    /// The fit of all drives, each with parameters of its own.
    pub fitted: Fitted,
    /// Per drive: what was found.
    pub joints: Vec<JointGain>,
    /// The payload.
    pub payload: PayloadConfig,
    /// Warnings, in words.
    pub warnings: Vec<String>,
    robot: String,
    provenance: Provenance,
}

/// Finds the drive gains from logs with and without a payload of known mass.
///
/// Efforts of the logs are `scale · current`. Per drive and for all logs together, `current = W (x/g) + w_L (1/g)`: the noisy
/// current is regressed on exact columns, no drive shares a parameter with another, and `w_L` is the effort of what is known
/// of the payload. What is not known of it (centre of mass, inertia about it) has columns of its own, gated alike. Shape
/// parameters of friction stay where they start; deviations of single logs are those of `own`.
///
/// # Errors
/// [`Error::Setting`] unless there is one payload, with its mass, carried by a log and missing in another;
/// [`Error::Unsupported`] for motor-side logs, the textbook route, and logs with a delay or a factor on friction of their own;
/// as [`crate::identify()`] for logs and robot.
pub fn identify_gains(config: &Config, progress: &mut dyn FnMut(Step)) -> Result<GainIdentification, Error> {
    config.check()?;
    config.demand_inputs()?;
    let asked = config.settings()?;
    // What is wrong with settings is said before logs are read.
    let logs: Vec<LogSettings> = config.log.iter().map(LogConfig::settings).collect();
    known_payload(&asked, &logs.iter().collect::<Vec<_>>())?;
    if config.motor_side.is_some() {
        return Err(behind_a_matrix());
    }
    progress(Step::Read(config.robot.display().to_string()));
    let robot = config.read_robot()?;
    let loaded = config.read_training(&robot, progress)?;
    let found = gains_of_logs(robot, loaded, &asked, progress)?;
    let provenance = config.provenance(found.provenance.inputs);
    Ok(GainIdentification { provenance, ..found })
}

/// Finds the drive gains from logs with and without a payload of known mass, as [`identify_gains`] does; the logs need not come from files.
///
/// # Errors
/// As [`identify_gains`]; [`Error::Setting`] too for no log, and for a log that names what there is not.
pub fn gains_of_logs(
    robot: Robot,
    mut loaded: Vec<Log>,
    asked: &Settings,
    progress: &mut dyn FnMut(Step),
) -> Result<GainIdentification, Error> {
    if loaded.is_empty() {
        return Err(Error::setting("log", "at least one log to identify from", "none"));
    }
    let of_logs: Vec<&LogSettings> = loaded.iter().map(|log| &log.settings).collect();
    let labels = labels(loaded.iter().map(|log| (&log.settings, log.log.name())));
    let payload = known_payload(asked, &of_logs)?;
    if loaded.iter().any(|log| log.source.on_motors) {
        return Err(behind_a_matrix());
    }
    asked.check_logs(&of_logs, &[], &labels)?;
    refuse_internal_load(&robot, "identified")?;
    let robot = held_where_not_logged(robot, &loaded)?;
    let settings = asked.conditioning_settings();
    let training: Vec<TrainingLog> = (loaded.iter().zip(labels))
        .map(|(log, label)| TrainingLog { label, settings: log.settings.clone(), reference: None })
        .collect();
    let scale = common_scale(&loaded)?;
    let mut plan = plan_elements(asked, &robot, &loaded)?;
    let terms = LogTerms::of(asked, &training, &robot)?;
    for (log, TrainingLog { label, settings, .. }) in loaded.iter_mut().zip(&training) {
        log.log = terms.with_gates(log.log.clone(), Some(label), settings.payload.as_deref());
    }
    let body = terms.payloads[0].body;
    plan.log_terms = terms.without_payloads();
    let model = model(&plan, &robot, payload, body)?;
    let prepared = loaded.iter().map(|l| l.prepare(&model, &settings)).collect::<Result<Vec<_>, _>>()?;
    progress(Step::Structure);
    let shape = model.parameters().shape_start();
    let apart = PerOutput::new(&model);
    let base_settings = BaseSettings { seed: asked.seed.unwrap_or(1), ..BaseSettings::default() };
    let base = BaseParameters::of_model(&apart, &shape, &base_settings);
    let choices = condition(&apart, &shape, &base.kept, &prepared, &settings, &mut |stage| {
        progress(Step::Conditioning(stage));
    })?;
    progress(Step::Fit);
    let source = LogRows::new(&apart, &shape, &base.kept, &prepared, &choices, &settings)?;
    let (fit, _) = fitting::fit(asked, base.len(), &LinearMethod::Wls, &source)?;
    let residuals = fitting::residuals(&source, &fit)?;
    drop(source);
    let fitted = fitting::with_precision(fit, &residuals, &prepared, asked.conditioning.block_s.is_some());
    let evidence = Evidence { apart: &apart, base: &base, fitted: &fitted, payload };
    let joints = (0..apart.outputs().len()).map(|output| evidence.gain(output, scale[output])).collect();
    let mut warnings = robot.warnings.clone();
    if !shape.is_empty() {
        warnings.push("shape parameters of friction are held where they start".to_owned());
    }
    let name = model.mechanism().name().to_owned();
    let mut inputs = robot.inputs();
    inputs.extend(loaded.iter().flat_map(|log| log.source.inputs.iter().cloned()));
    inputs.extend(plan.known_source.iter().map(|source| InputRecord::of(InputKind::Friction, source)));
    Ok(GainIdentification {
        fitted,
        joints,
        payload: payload.clone(),
        warnings,
        robot: name,
        provenance: Provenance {
            inputs,
            settings: serde_json::to_value(asked).unwrap_or_else(|e| unreachable!("plain data: {e}")),
            seed: asked.seed.unwrap_or(1),
            ..Provenance::default()
        },
    })
}

/// Columns of motors that joints share have no gain per joint.
fn behind_a_matrix() -> Error {
    Error::Unsupported(
        "drive gains behind a transmission matrix: give currents and positions of the joints".to_owned(),
    )
}

/// The payload that gains are told by; refuses settings that gains cannot go with.
fn known_payload<'a>(asked: &'a Settings, logs: &[&LogSettings]) -> Result<&'a PayloadConfig, Error> {
    let [payload] = &asked.payload[..] else {
        return Err(Error::setting("payload", "one `[[payload]]`", asked.payload.len()));
    };
    let key = |key: &str| format!("payload.{}{key}", payload.name);
    if payload.mass.is_none() {
        return Err(Error::setting(&key(".mass"), "the known mass, kg", "none"));
    }
    if logs.iter().all(|log| log.payload.is_some()) {
        let expected = "a `[[log]]` without it beside those that carry it";
        return Err(Error::setting(&key(""), expected, "it in every log"));
    }
    if asked.conditioning.route == Route::Textbook {
        return Err(Error::Unsupported("drive gains by the textbook route: leave `route` out".to_owned()));
    }
    let own = logs.iter().flat_map(|log| &log.own);
    if let Some(own) = own.into_iter().find(|own| matches!(own, Own::FrictionScale | Own::Delay)) {
        let why = format!("drive gains beside `own = [\"{}\"]`: take `offset` and `friction`", own.word());
        return Err(Error::Unsupported(why));
    }
    Ok(payload)
}

/// Factors from the columns of the drives to efforts, the same in all logs.
fn common_scale(loaded: &[Log]) -> Result<Vec<f64>, Error> {
    let first = &loaded[0];
    let own = first.effort_factors();
    match loaded.iter().find(|l| l.effort_factors() != own) {
        None => Ok(own),
        Some(other) => Err(Error::setting(
            "columns.effort.scale",
            &format!("the same scale in all logs, {own:?} as in {}", first.log.name()),
            format!("{:?} in {}", other.effort_factors(), other.log.name()),
        )),
    }
}

/// The robot's elements, the known part of the payload with a factor per joint, and the unknown rest.
fn model(
    plan: &ElementPlan,
    robot: &Robot,
    payload: &PayloadConfig,
    body: usize,
) -> Result<RobotModel, Error> {
    let mechanism = &robot.mechanism;
    let mut elements: Vec<Box<dyn JointElement>> = plan.build(mechanism)?;
    let mass = payload.mass.unwrap_or_default();
    let (known, unknown) = match (known_inertia(payload), payload.com) {
        (Some(inertia), _) => (inertia, 10..10),
        (None, Some(com)) => (Inertia::from_com(mass, Vec3(com), &(Mat3::identity() * 0.0)), 4..10),
        (None, None) => (Inertia([mass, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]), 1..10),
    };
    elements.push(Box::new(KnownLoad::new(mechanism, body, &payload.name, &known)));
    if !unknown.is_empty() {
        let rest = Payload::with_unknown(mechanism, body, &payload.name, unknown.collect());
        elements.push(Box::new(rest));
    }
    plan.complete(mechanism, elements)
}

/// What the gain of a drive rests on.
struct Evidence<'a> {
    apart: &'a PerOutput<'a, RobotModel>,
    base: &'a BaseParameters,
    fitted: &'a Fitted,
    payload: &'a PayloadConfig,
}

impl Evidence<'_> {
    /// The gain of one drive. `scale`: effort per unit of its column.
    fn gain(&self, output: usize, scale: f64) -> JointGain {
        let Output { name, unit } = &self.apart.outputs()[output];
        let table = &self.apart.parameters().linear;
        let load = format!("{name}: {name}.h");
        let column = self.apart.columns(output).find(|c| table[*c].name == load);
        let place = column.and_then(|c| self.base.kept.binary_search(&c).ok());
        let mut out = JointGain::without(name, unit, scale);
        let Some(place) = place else {
            if column.is_some_and(|c| !self.base.zero.contains(&c)) {
                out.verdict = "what is not known of the load explains the same effort".to_owned();
            }
            return out;
        };
        let estimate = &self.fitted.estimate;
        let beside = self.beside(output, place);
        out.share = beside.share;
        out.plain_least_squares = beside.plain.map(|g| g * scale);
        out.total_least_squares = beside.total.map(|g| g * scale);
        let Some(kept) = estimate.solution.kept.iter().position(|c| *c == place) else { return out };
        let h = estimate.x[place];
        let std = self.fitted.covariance()[(kept, kept)].max(0.0).sqrt();
        let mass = self.payload.mass_std.unwrap_or(0.0) / self.payload.mass.unwrap_or(1.0);
        out.found(scale, h, std, mass, interval_quantile(self.fitted));
        out
    }

    /// Other forms on the weighted rows of the drive.
    fn beside(&self, output: usize, place: usize) -> LoadColumn {
        let estimate = &self.fitted.estimate;
        let own: Vec<usize> =
            self.apart.columns(output).filter_map(|c| self.base.kept.binary_search(&c).ok()).collect();
        let parts: Vec<Factor> = estimate
            .reduced
            .iter()
            .zip(estimate.weights())
            .filter(|(group, _)| group.output == output)
            .map(|(group, weight)| group.merged(self.base.len()).select(&own).scaled(weight))
            .collect();
        let local = own.iter().position(|c| *c == place).unwrap_or_default();
        load_column(&Factor::merge(&parts.iter().collect::<Vec<_>>()), local)
    }
}
