//! Settings that would do nothing with the robot and logs of a run.

use dynid_model::{EffortModel, RobotModel};

use crate::Error;
use crate::caution::{self, Caution};
use crate::config::{Config, Friction, Own, PayloadConfig, ShapeConfig};
use crate::elements::ElementPlan;

/// Refuses them.
///
/// # Errors
/// [`Error::Setting`].
pub(super) fn check(config: &Config, plan: &ElementPlan, model: &RobotModel) -> Result<(), Error> {
    for own in config.log.iter().flat_map(|log| &log.own) {
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
    let shape = &config.estimator.shape;
    // Friction that is found on the logs may bring some.
    let none = model.parameters().shape.is_empty() && config.elements.friction != Friction::Auto;
    if none && *shape != ShapeConfig::default() {
        let key = match (&shape.search, shape.evaluations) {
            (Some(_), _) => "shape.search",
            (None, Some(_)) => "shape.evaluations",
            (None, None) => "shape.starts",
        };
        let expected = "friction with a shape parameter, such as `stribeck`, to search";
        return Err(Error::setting(key, expected, "none"));
    }
    channels(config, model)
}

/// Settings that turned out to do nothing here, in words. `found`: there were shape parameters to search.
pub(super) fn warnings(config: &Config, found: bool) -> Vec<Caution> {
    let unsearched = !found && config.estimator.shape != ShapeConfig::default();
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
    search.into_iter().chain(config.payload.iter().filter_map(idle)).map(leave_out).collect()
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
fn channels(config: &Config, model: &RobotModel) -> Result<(), Error> {
    let own = config.log.iter().chain(&config.validation).filter_map(|log| log.columns.as_ref());
    let read = |name: &String| {
        model.channels().contains(name)
            || name.starts_with("journal_")
            || (config.instruments.is_some() && name.starts_with("reference_"))
    };
    let mut stated = own.chain([&config.columns]).flat_map(|spec| spec.channels.keys());
    let Some(name) = stated.find(|name| !read(name)) else { return Ok(()) };
    let expected = match model.channels() {
        [] => "no channels: no element of this robot reads one".to_owned(),
        known => format!("channels that elements read: `{}`", known.join("`, `")),
    };
    Err(Error::setting(&format!("columns.channels.{name}"), &expected, name))
}
