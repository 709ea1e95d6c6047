//! Names of the extra channels that elements read.

/// Name of the channel that holds the motor current of a joint, A.
pub fn current_channel(joint: &str) -> String {
    format!("current_{joint}")
}

/// Name of the channel that holds the temperature of a joint, °C.
pub fn temperature_channel(joint: &str) -> String {
    format!("temperature_{joint}")
}

/// Whether a channel holds a temperature.
pub fn is_temperature(channel: &str) -> bool {
    channel.starts_with("temperature_")
}
