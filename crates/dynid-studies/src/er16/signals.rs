//! Row 3: smoothing, differentiation and chaotic map against an independent implementation.

use dynid::estimators::search::TentMap;
use dynid::motion::frequency::differentiate;
use dynid::motion::smoothing::five_point_cubic;
use serde_json::json;

use super::chain::signal;
use super::reference;
use crate::{Row, StudyError};

pub(super) fn row() -> Result<Row, StudyError> {
    let worst = |own: &[f64], wanted: &[f64]| {
        let longest = own.len() == wanted.len();
        let error = own.iter().zip(wanted).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        if longest { error } else { f64::INFINITY }
    };
    let smoothing = reference::smoothing()?;
    let smooth = |input: &[f64], passes: usize| five_point_cubic(input, passes).map_err(signal);
    let of_smoothing = worst(&smooth(&smoothing.input, 1)?, &smoothing.pass1)
        .max(worst(&smooth(&smoothing.input, 3)?, &smoothing.pass3))
        .max(worst(&smooth(&smoothing.cubic_input, 1)?, &smoothing.cubic_output));

    let wanted = reference::differentiation()?;
    let rate_hz = 1.0 / wanted.sample_time;
    let states = differentiate(&wanted.input, rate_hz, wanted.period, wanted.harmonics).map_err(signal)?;
    let of_differentiation = worst(&states.position, &wanted.position)
        .max(worst(&states.velocity, &wanted.velocity))
        .max(worst(&states.acceleration, &wanted.acceleration));

    let wanted = reference::tent()?;
    let mut map = TentMap { slope: wanted.gamma, value: wanted.sequence[0] };
    let own: Vec<f64> = std::iter::once(map.value)
        .chain(std::iter::repeat_with(|| map.advance()))
        .take(wanted.compare_first)
        .collect();
    let of_map = worst(&own, &wanted.sequence[..wanted.compare_first]);
    Ok(Row::new(
        "3",
        "Five-point cubic smoothing, frequency-domain differentiation and tent map agree with an independent implementation",
        "1e-12, 1e-10, 1e-9 (first 25)",
        json!({ "smoothing": of_smoothing, "differentiation": of_differentiation, "tent_map": of_map }),
        format!("{of_smoothing:.1e}, {of_differentiation:.1e}, {of_map:.1e}"),
        of_smoothing <= 1e-12 && of_differentiation <= 1e-10 && of_map <= 1e-9,
    ))
}
