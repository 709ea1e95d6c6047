//! What a gap takes from an effort and gives back.

/// Steps per sample while the flanks are apart.
const SUBSTEPS: usize = 4;

/// Trace of a gap: samples with the effort that is missing (or, at impacts, more), and the samples of crossings.
pub(super) struct Trace {
    /// Index and value; ascending, zeros left out.
    pub(super) samples: Vec<(usize, f64)>,
    /// Samples in which the gap was crossed.
    pub(super) crossings: Vec<usize>,
}

/// Follows a gap along the torque `T` of a transmission: from the flank that a torque pushes against, the link flies off when
/// the torque changes its sign, `J ẍ = |T|`, and hits the other flank, or comes back to its own. Impacts are plastic; their
/// momentum is spread over one sample.
pub(super) fn follow(torque: &[f64], inertia: &[f64], step_s: f64, gap: f64) -> Trace {
    let mut out = Trace { samples: Vec::new(), crossings: Vec::new() };
    let dt = step_s / SUBSTEPS as f64;
    let mut side = if torque.first().is_none_or(|t| *t >= 0.0) { 1.0 } else { -1.0 };
    // Distance from the flank left, and its rate.
    let mut flight: Option<(f64, f64)> = None;
    for (k, pair) in torque.windows(2).enumerate() {
        if flight.is_none() && pair[0] * side >= 0.0 && pair[1] * side >= 0.0 {
            continue;
        }
        let (mut missing, mut impulse) = (0.0, 0.0);
        for i in 0..SUBSTEPS {
            let part = (i as f64 + 0.5) / SUBSTEPS as f64;
            let pushing = side * ((1.0 - part) * pair[0] + part * pair[1]);
            if flight.is_none() && pushing < 0.0 {
                flight = Some((0.0, 0.0));
            }
            let Some((x, v)) = flight else { continue };
            let a = -pushing / inertia[k];
            let (x, v) = (x + v * dt + 0.5 * a * dt * dt, v + a * dt);
            missing -= side * pushing / SUBSTEPS as f64;
            let hits = x >= gap;
            if hits || (x <= 0.0 && v <= 0.0) {
                // At the other flank the link is stopped by a torque of that side's sign, `-side`; at its own by `side`.
                impulse -= side * inertia[k] * v;
                flight = None;
            } else {
                flight = Some((x, v));
            }
            if hits {
                side = -side;
                out.crossings.push(k);
            }
        }
        let value = missing + impulse / step_s;
        if value != 0.0 {
            out.samples.push((k, value));
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Along `T = -s t` the gap is crossed at `(6 J g/s)^(1/3)`; what is missing and the impact cancel, and their moment is the
    /// inertia times the gap.
    #[test]
    fn the_moment_of_a_crossing_is_inertia_times_gap() {
        let (slope, inertia, step) = (-40.0, 0.7, 1e-4);
        let torque: Vec<f64> = (0..4000).map(|k| slope * (f64::from(k) - 2000.0) * step).collect();
        for gap in [1e-4, 1e-3, 1e-2] {
            let trace = follow(&torque, &vec![inertia; 4000], step, gap);
            assert_eq!(trace.crossings.len(), 1);
            let flight = (6.0 * inertia * gap / 40.0_f64).cbrt();
            let found = (trace.crossings[0] as f64 - 2000.0) * step;
            assert!((found - flight).abs() < 2.0 * step, "{found} {flight}");
            let area: f64 = trace.samples.iter().map(|(_, v)| v * step).sum();
            let size: f64 = trace.samples.iter().map(|(_, v)| v.abs() * step).sum();
            assert!(area.abs() < 1e-9 * size, "{area}");
            let moment: f64 = trace.samples.iter().map(|(k, v)| v * step * (*k as f64 - 2000.0) * step).sum();
            assert!((moment.abs() / (inertia * gap) - 1.0).abs() < 0.05, "{moment} {}", inertia * gap);
            // The effort lacks what it would have to pull with: it stays too high at first, then falls behind.
            assert!(trace.samples[trace.samples.len() / 2].1 > 0.0 && trace.samples.last().unwrap().1 < 0.0);
        }
    }

    #[test]
    fn a_torque_of_one_sign_leaves_no_trace() {
        let torque: Vec<f64> = (0..500).map(|k| 1.0 + (0.1 * f64::from(k)).sin()).collect();
        let trace = follow(&torque, &[1.0; 500], 1e-3, 1e-3);
        assert!(trace.samples.is_empty() && trace.crossings.is_empty());
    }

    #[test]
    fn a_short_change_of_sign_comes_back_to_its_own_flank() {
        let torque: Vec<f64> = (0..400).map(|k| if (100..110).contains(&k) { -0.5 } else { 1.0 }).collect();
        let trace = follow(&torque, &[1.0; 400], 1e-3, 1e-2);
        assert!(trace.crossings.is_empty() && !trace.samples.is_empty());
        let area: f64 = trace.samples.iter().map(|(_, v)| v).sum();
        let size: f64 = trace.samples.iter().map(|(_, v)| v.abs()).sum();
        assert!(area.abs() < 1e-9 * size, "{area} {size}");
    }
}
