//! Bilinear transformation of analogue all-pole low-pass prototypes.

use super::sections::{Section, Sections};

/// One of a conjugate pair of poles in the left half plane, cut-off 1 rad/s.
pub(super) struct Pole {
    pub(super) re: f64,
    pub(super) im: f64,
}

/// Digital filter with the prototype's cut-off prewarped to `cutoff_hz`; all zeros at -1. `gain` is the prototype's
/// numerator. The first section carries the gain; the poles closest to the unit circle come last, which keeps
/// intermediate signals small.
pub(super) fn bilinear(poles: &[Pole], gain: f64, cutoff_hz: f64, rate_hz: f64) -> Sections {
    let warped = 2.0 * (std::f64::consts::PI * cutoff_hz / rate_hz).tan();
    let mut gain = gain;
    // (radius, section) of z = (2 + p) / (2 - p) for the sample time 1.
    let mut pairs: Vec<(f64, Section)> = poles
        .iter()
        .map(|pole| {
            let (re, im) = (pole.re * warped, pole.im * warped);
            let denominator = (2.0 - re) * (2.0 - re) + im * im;
            gain *= warped * warped / denominator;
            let z_re = (4.0 - re * re - im * im) / denominator;
            let squared = ((2.0 + re) * (2.0 + re) + im * im) / denominator;
            (squared, Section { b: [1.0, 2.0, 1.0], a: [-2.0 * z_re, squared] })
        })
        .collect();
    pairs.sort_by(|x, y| x.0.total_cmp(&y.0));
    let mut sections: Vec<Section> = pairs.into_iter().map(|(_, section)| section).collect();
    if let Some(first) = sections.first_mut() {
        first.b = first.b.map(|b| b * gain);
    }
    Sections(sections)
}
