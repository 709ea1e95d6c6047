//! Settings that would do nothing with the robot and logs of a run.

use dynid_model::{EffortModel, RobotModel};

use crate::Error;
use crate::caution::{self, Caution};
use crate::elements::ElementPlan;
use crate::settings::{Friction, LogSettings, Own, PayloadConfig, Settings, ShapeConfig};

/// Refuses them.
///
/// # Errors
/// [`Error::Setting`].
pub(super) fn check(
    settings: &Settings,
    logs: &[&LogSettings],
    stated: &[String],
    plan: &ElementPlan,
    model: &RobotModel,
) -> Result<(), Error> {
    for own in logs.iter().flat_map(|log| &log.own) {
        let acts = |element: &String| match own {
            Own::Offset => element == "offset",
            Own::Friction | Own::FrictionScale => plan.registry().is_friction(element),
            Own::Delay => true,
        };
        if !matches!(own, Own::Delay) && !plan.per_rate.iter().flatten().any(acts) {
            let expected =
                format!("a joint that has {}", if *own == Own::Offset { "an `offset`" } else { "friction" });
            return Err(Error::setting("log.own", &expected, format!("`{}` where none has", own.word())));
        }
    }
    let shape = &settings.estimator.shape;
    // Friction that is found on the logs may bring some.
    let none = model.parameters().shape.is_empty() && settings.elements.friction != Friction::Auto;
    if none && *shape != ShapeConfig::default() {
        let key = match (&shape.search, shape.evaluations) {
            (Some(_), _) => "shape.search",
            (None, Some(_)) => "shape.evaluations",
            (None, None) => "shape.starts",
        };
        let expected = "friction with a shape parameter, such as `stribeck`, to search";
        return Err(Error::setting(key, expected, "none"));
    }
    channels(settings, stated, model)
}

/// Settings that turned out to do nothing here, in words. `found`: there were shape parameters to search.
pub(super) fn warnings(settings: &Settings, found: bool) -> Vec<Caution> {
    let unsearched = !found && settings.estimator.shape != ShapeConfig::default();
    let search = unsearched.then(|| {
        "held-out blocks asked for no friction with a shape parameter, so there was nothing to search: `shape` (`--search`) \
         did nothing"
            .to_owned()
    });
    let leave_out = |message: String| {
        Caution::warn(
            caution::SETTING,
            message,
            "leave the setting out, so that nothing seems to depend on it",
        )
    };
    search.into_iter().chain(settings.payload.iter().filter_map(idle)).map(leave_out).collect()
}

/// What is stated of a payload and not used by an identification.
fn idle(payload: &PayloadConfig) -> Option<String> {
    let number = |key: &str, x: Option<f64>| x.map(|x| format!("`{key} = {x}`"));
    let com = payload.com.map(|c| format!("`com = {c:?}`"));
    let (keys, why) = match payload.is_known() {
        true => (
            vec![number("mass_std", payload.mass_std), number("rated_mass", payload.rated_mass)],
            "it counts as known exactly",
        ),
        false => (
            vec![number("mass", payload.mass), number("mass_std", payload.mass_std), com],
            "without `mass`, `com` and `inertia` it counts as unknown",
        ),
    };
    let keys: Vec<String> = keys.into_iter().flatten().collect();
    (!keys.is_empty()).then(|| {
        format!(
            "payload `{}`: {why}, so that {} did nothing here (`dynid payload` and `dynid gains` use them)",
            payload.name,
            keys.join(", ")
        )
    })
}

/// Channels that the columns state have a reader: this model, instruments, or `dynid clearance`.
fn channels(settings: &Settings, stated: &[String], model: &RobotModel) -> Result<(), Error> {
    let read = |name: &String| {
        model.channels().contains(name)
            || name.starts_with("journal_")
            || (settings.closed_loop.is_some() && name.starts_with("reference_"))
    };
    let Some(name) = stated.iter().find(|name| !read(name)) else { return Ok(()) };
    let expected = match model.channels() {
        [] => "no channels: no element of this robot reads one".to_owned(),
        known => format!("channels that elements read: `{}`", known.join("`, `")),
    };
    Err(Error::setting(&format!("columns.channels.{name}"), &expected, name))
}
