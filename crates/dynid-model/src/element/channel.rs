//! Names of the extra channels that elements read.

/// Name of the channel that holds the motor current of a joint, A.
pub fn current_channel(joint: &str) -> String {
    format!("current_{joint}")
}

const TEMPERATURE: &str = "temperature_";

/// Name of the channel that holds the temperature of a joint, °C.
pub fn temperature_channel(joint: &str) -> String {
    format!("{TEMPERATURE}{joint}")
}

/// Whether a channel holds a temperature.
pub fn is_temperature(channel: &str) -> bool {
    channel.starts_with(TEMPERATURE)
}

/// The temperatures of a joint among channels.
pub(super) fn temperature_of<'a>(channels: &[(&str, &'a [f64])], joint: &str) -> Option<&'a [f64]> {
    let of_joint = |name: &str| name.strip_prefix(TEMPERATURE) == Some(joint);
    channels.iter().find(|(name, _)| of_joint(name)).map(|(_, values)| *values)
}
