//! Lists of a given length in TOML.

use serde::de::Error as _;
use serde::{Deserialize, Deserializer};

/// A list of just so many entries; serde's own arrays and tuples pass over surplus ones.
pub fn exactly<'de, D: Deserializer<'de>, T: Deserialize<'de>, const N: usize>(
    deserializer: D,
) -> Result<Option<[T; N]>, D::Error> {
    just(deserializer).map(Some)
}

/// A list of so many numbers that must be given.
pub fn just<'de, D: Deserializer<'de>, T: Deserialize<'de>, const N: usize>(
    deserializer: D,
) -> Result<[T; N], D::Error> {
    let list = Vec::<T>::deserialize(deserializer)?;
    <[T; N]>::try_from(list)
        .map_err(|list| D::Error::custom(format!("expected a list of {N} numbers, found {}", list.len())))
}

/// Two numbers, if they are given.
pub fn pair<'de, D: Deserializer<'de>, T: Deserialize<'de>>(
    deserializer: D,
) -> Result<Option<(T, T)>, D::Error> {
    Ok(exactly(deserializer)?.map(|[lower, upper]| (lower, upper)))
}
