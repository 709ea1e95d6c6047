//! Channels that elements of a virtual robot read: temperatures, loads.

use std::collections::BTreeMap;

use dynid_identify::Error;
use dynid_sim::Profile;

/// Points of a profile: `[time in s, value]`.
type Points = Vec<[f64; 2]>;

/// Profiles of all channels of a model, in its order.
///
/// A stated channel has the name that an element reads (`temperature_j1`), or its beginning (`temperature`), which stands for
/// that of every joint about which nothing else is said.
///
/// `followed`: channels of the trajectory file, by their full names.
///
/// # Errors
/// [`Error::Setting`] for a channel that no element reads, one that both the settings and the trajectory file state, one that elements read and nothing states, and points without
/// order.
pub(super) fn profiles(
    channels: &[String],
    stated: &BTreeMap<String, Points>,
    followed: &BTreeMap<String, Points>,
) -> Result<Vec<Profile>, Error> {
    let of_all =
        |channel: &str, name: &str| channel.strip_prefix(name).is_some_and(|rest| rest.starts_with('_'));
    if let Some(name) =
        stated.keys().find(|name| !channels.iter().any(|channel| channel == *name || of_all(channel, name)))
    {
        let expected = match channels {
            [] => "no channels: no element of this robot reads one".to_owned(),
            _ => format!("channels that elements read: `{}`", channels.join("`, `")),
        };
        return Err(Error::setting(&format!("channels.{name}"), &expected, name));
    }
    if let Some(name) = followed.keys().find(|name| !channels.contains(name)) {
        let expected = "an element that reads this column of the trajectory (of loads `external_load`, with `external_load = { factor = 1 }` under `[element.<joint>]`)";
        return Err(Error::setting(&format!("follow: {name}"), expected, "none"));
    }
    let twice = |name: &&String| followed.keys().any(|f| f == *name || of_all(f, name));
    if let Some(name) = stated.keys().find(twice) {
        let expected = "no value beside `follow`, whose file states this channel";
        return Err(Error::setting(&format!("channels.{name}"), expected, "one"));
    }
    let missing = |channel: &String| {
        let expected = "points `[time in s, value]`, as an element reads this channel";
        Error::setting(&format!("channels.{channel}"), expected, "none")
    };
    channels
        .iter()
        .map(|channel| {
            let all = || stated.iter().find(|(name, _)| of_all(channel, name)).map(|(_, points)| points);
            let points = followed.get(channel).or_else(|| stated.get(channel)).or_else(all);
            let points = points.ok_or_else(|| missing(channel))?;
            Ok(Profile::new(points.iter().map(|[t, x]| (*t, *x)).collect())?)
        })
        .collect()
}

/// Values of channels at the samples of a log, shifted by so many samples.
pub(super) fn sampled(profiles: &[Profile], shift: f64, (samples, rate_hz): (usize, f64)) -> Vec<Vec<f64>> {
    let values = |p: &Profile| (0..samples).map(|s| p.at((s as f64 + shift) / rate_hz)).collect();
    profiles.iter().map(values).collect()
}
