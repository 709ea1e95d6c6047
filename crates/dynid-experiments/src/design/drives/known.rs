//! What is known of drives before a motion is designed for them, and what is taken for granted.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use dynid_config::config::ElementsConfig;
use dynid_config::nominal::nominal_parameters;
use dynid_drives::config::{BodiesName, DriveConfig};
use dynid_drives::{FoundDrives, stated};
use dynid_excitation::MotionLimits;
use dynid_identify::Error;
use dynid_identify::elements::{DEFAULTS, ElementPlan};
use dynid_identify::robot::Robot;
use dynid_model::{Dynamics, EffortModel, RobotModel};
use dynid_robots::ElementSpec;
use dynid_servo::{Addition, Choice, ServoSettings, Term};

use crate::design::config::{ColumnsName, DesignConfig};
use crate::design::limits::joint_limits;

/// Counts a turn of an encoder about which nothing is said.
const COUNTS: f64 = 4096.0;
/// The same of a joint that slides, m.
const SLIDE_STEP: f64 = 1e-4;
/// Rotor inertia that nothing is said about, as a share of what the bodies have in the mean.
const ROTOR_SHARE: f64 = 0.2;
/// Poses over which inertias are averaged.
const POSES: usize = 32;
/// Peak of friction at rest, as a share of Coulomb friction, and Stribeck velocity, rad/s, about which nothing is said.
const PEAK: f64 = 0.1;
const STRIBECK: f64 = 0.1;

/// Refuses settings of designs for efforts.
pub(super) fn refuse(config: &DesignConfig) -> Result<(), Error> {
    if !config.has_drives() {
        return Ok(());
    }
    let elements = &config.elements;
    let idle = [
        (
            "elements",
            *elements != ElementsConfig::default(),
            "none: `law` under [servo] says what drives have beside rotor inertia, viscous and Coulomb friction",
        ),
        (
            "criterion.columns",
            config.criterion.columns == ColumnsName::Inertial,
            "`all`: the bodies are those of the robot file where no effort is measured",
        ),
        (
            "earlier",
            !config.earlier.is_empty(),
            "none: earlier motions are not counted where no effort is measured",
        ),
        (
            "servo.find_directions",
            config.servo.as_ref().is_some_and(|s| s.find_directions),
            "`direction` of every joint that is not 1: a motion goes where it is sent",
        ),
        (
            "servo.bodies",
            config.servo.as_ref().is_some_and(|s| s.bodies != BodiesName::File),
            "`file`: a design counts bodies as known, those of the robot file or, with `drives`, those that were found",
        ),
        (
            "servo.gain_error",
            config.servo.as_ref().is_some_and(|s| s.gain_error != DriveConfig::default().gain_error),
            "no value: what wrong gains do is found on logs",
        ),
        (
            "servo.fit",
            config.servo.as_ref().is_some_and(|s| s.fit != DriveConfig::default().fit),
            "no value: a design counts on positions alone",
        ),
        (
            "servo.effort_at",
            config.servo.as_ref().is_some_and(|s| s.effort_at != DriveConfig::default().effort_at),
            "no value: a design counts on positions alone",
        ),
        (
            "servo.torque_constant",
            config.servo.as_ref().is_some_and(|s| !s.torque_constant.is_none()),
            "no value: a design counts on positions alone",
        ),
        (
            "servo.blocks",
            config.servo.as_ref().is_some_and(|s| s.blocks != DriveConfig::default().blocks),
            "no value: a design has no blocks of logs",
        ),
    ];
    match idle.iter().find(|(_, found, _)| *found) {
        Some((key, _, expected)) => Err(Error::setting(key, expected, "one")),
        None => Ok(()),
    }
}

/// The effort model of the robot behind its drives: bodies, rotors, viscous and Coulomb friction, offsets.
pub(super) fn model(robot: &Robot) -> Result<(Arc<RobotModel>, ElementPlan), Error> {
    let spec = ElementSpec { ties: Vec::new(), ..ElementSpec::default() };
    let default = DEFAULTS.map(str::to_owned);
    let plan = ElementPlan::new(&robot.mechanism, &spec, Some(&default), |_| true)?;
    Ok((Arc::new(plan.tied_model(&robot.mechanism)?), plan))
}

/// Symbol of a term in the tables of effort models.
pub(super) fn symbol(term: Term) -> Option<&'static str> {
    match term {
        Term::Coulomb => Some("fc"),
        Term::Viscous => Some("fv"),
        Term::RotorInertia => Some("Ia"),
        Term::Offset => Some("fo"),
        _ => None,
    }
}

/// What the law of the drives will have beside rotor inertia, viscous and Coulomb friction: what is stated or was found, else offsets and zeros,
/// which held-out data ask for most often.
pub(super) fn laws(found: Option<&FoundDrives>, settings: &ServoSettings) -> BTreeSet<Addition> {
    let mut out: BTreeSet<Addition> = match (&settings.choice, found) {
        (Choice::Given(given), _) => given.iter().copied().collect(),
        (Choice::HeldOut, Some(found)) => {
            let taken = |a: &Addition| found.file.law.additions.iter().any(|name| name == a.name());
            Addition::ALL.into_iter().filter(taken).collect()
        }
        (Choice::HeldOut, None) => BTreeSet::from([Addition::Offset, Addition::Zero]),
    };
    if settings.own_gains {
        out.insert(Addition::OwnGains);
    }
    out
}

/// Sets friction and rotor inertia that nothing is known of: what the robot file states, else what is typical.
pub(super) fn typical(
    robot: &Robot,
    config: &DesignConfig,
    settings: &mut ServoSettings,
    warnings: &mut Vec<String>,
) -> Result<(), Error> {
    let names = robot.rate_names();
    let (model, plan) = model(robot)?;
    let guess = nominal_parameters(&model, &plan, &BTreeMap::new())?;
    let stated = stated(robot)?;
    let given = |name: &str, term: Term| config.values.contains_key(&format!("{name}.{term}"));
    let mut guessed = Vec::new();
    for (j, (name, joint)) in names.iter().zip(&mut settings.joints).enumerate() {
        for term in [Term::Coulomb, Term::Viscous] {
            let column = symbol(term).and_then(|s| model.parameters().column(&format!("{name}.{s}")));
            column.into_iter().for_each(|c| joint.set(term, guess[c]));
        }
        if let Some(of) = stated.iter().find(|s| s.joint == *name) {
            let found = [
                (Term::Viscous, of.damping),
                (Term::Coulomb, of.friction_loss),
                (Term::RotorInertia, of.armature),
            ];
            found.into_iter().filter(|(_, x)| *x > 0.0).for_each(|(term, x)| joint.set(term, x));
        }
        if joint.get(Term::RotorInertia) <= 0.0 && !given(name, Term::RotorInertia) {
            guessed.push(j);
        }
    }
    if !guessed.is_empty() {
        let inertia = mean_inertias(robot, &joint_limits(robot, config, &names, &mut Vec::new())?);
        guessed.iter().for_each(|j| settings.joints[*j].set(Term::RotorInertia, ROTOR_SHARE * inertia[*j]));
        let names: Vec<&str> = guessed.into_iter().map(|j| names[j].as_str()).collect();
        warnings.push(format!(
            "no rotor inertia is stated for {}: {ROTOR_SHARE} of the mean inertia of the bodies is taken",
            names.join(", ")
        ));
    }
    Ok(())
}

/// Sets what a slope needs to be told from none: a delay, a peak of friction at rest. Refuses joints without a gain.
pub(super) fn complete(
    names: &[String],
    laws: &BTreeSet<Addition>,
    period: f64,
    settings: &mut ServoSettings,
) -> Result<(), Error> {
    for (name, joint) in names.iter().zip(&mut settings.joints) {
        if joint.get(Term::PositionGain) <= 0.0 {
            let expected = format!(
                "a gain of every joint: here if it is known, as `\"{name}.position_gain\" = ...` under [values] if it is a guess, or \
                 `drives = \"servo.json\"` of a first log"
            );
            return Err(Error::setting("servo.position_gain", &expected, format!("none for `{name}`")));
        }
        if joint.get(Term::Delay) <= 0.0 && !settings.known_delay {
            joint.set(Term::Delay, period);
        }
        if settings.find.contains(&Term::Compliance) && joint.get(Term::Compliance) <= 0.0 {
            let expected = format!(
                "`compliance` beside a value to begin from: `\"{name}.compliance\" = ...` under [values], or `drives = \"servo.json\"` of a first log"
            );
            return Err(Error::setting("servo.find", &expected, "none"));
        }
        if laws.contains(&Addition::Stiction) && joint.get(Term::Stiction) <= 0.0 {
            joint.set(Term::Stiction, PEAK * joint.get(Term::Coulomb));
            joint.set(Term::StribeckVelocity, STRIBECK);
        }
    }
    Ok(())
}

/// Standard deviation of the readings' noise by joint.
pub(super) fn noise(
    config: &DesignConfig,
    found: Option<&FoundDrives>,
    joints: &[String],
    slides: &[bool],
    warnings: &mut Vec<String>,
) -> Result<Vec<f64>, Error> {
    let given = config.criterion.noise.positive("criterion.noise", joints)?;
    let rounding = |j: usize| {
        let step = if slides[j] { SLIDE_STEP } else { std::f64::consts::TAU / COUNTS };
        step / 12.0_f64.sqrt()
    };
    let residual = |j: usize| found.and_then(|f| f.file.fit.rms.get(j)).filter(|x| **x > 0.0);
    let guessed: Vec<&str> = (0..joints.len())
        .filter(|j| given[*j].is_none() && residual(*j).is_none())
        .map(|j| joints[j].as_str())
        .collect();
    if !guessed.is_empty() {
        warnings.push(format!(
            "noise of the positions is not stated for {}: the rounding of encoders with 4096 counts a turn is taken (0.1 mm of joints that slide)",
            guessed.join(", ")
        ));
    }
    let of = |j: usize| given[j].or(residual(j).copied()).unwrap_or_else(|| rounding(j));
    Ok((0..joints.len()).map(of).collect())
}

/// Inertia of the bodies that every joint moves alone, mean over poses within the limits.
pub(super) fn mean_inertias(robot: &Robot, limits: &[MotionLimits]) -> Vec<f64> {
    let dynamics = Dynamics::new(&robot.mechanism);
    let inertias = robot.mechanism.inertia_vector();
    let (n, mut work) = (limits.len(), dynamics.workspace());
    let mut mean = vec![0.0; n];
    for pose in 0..POSES {
        // Multiples of square roots spread evenly.
        let at = |(j, limit): (usize, &MotionLimits)| {
            let share = ((pose as f64 + 0.5) * (2.0 + j as f64).sqrt()).fract();
            limit.position.0 + share * (limit.position.1 - limit.position.0)
        };
        let q: Vec<f64> = limits.iter().enumerate().map(at).collect();
        let mass = dynamics.mass_matrix(&q, &inertias, &mut work);
        mean.iter_mut().enumerate().for_each(|(j, m)| *m += mass[j * n + j] / POSES as f64);
    }
    mean
}
