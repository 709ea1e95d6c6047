//! The colour of a residual, and the way from a trace of a gap to a whitened residual.

use dynid_motion::filter::{butterworth, forward_backward};

use super::Path;
use dynid_estimate::whiteness::counted_autocorrelation;

/// Memory of the noise model, s, and its longest in samples.
const MEMORY: (f64, usize) = (0.06, 80);
/// Partial correlation at which the noise counts as predicted entirely.
const PREDICTED: f64 = 0.9999;

/// Prediction-error filter of an autoregressive model `[1, a_1 .. a_p]` by Levinson's recursion. Samples of exactly zero do not
/// count.
pub(super) fn whitening(residual: &[f64], step_s: f64) -> Vec<f64> {
    let order = ((MEMORY.0 / step_s) as usize).clamp(2, MEMORY.1);
    let mut filter = vec![1.0];
    let Some(correlation) = counted_autocorrelation(residual, order) else { return filter };
    let rho = |lag: usize| if lag == 0 { 1.0 } else { correlation[lag - 1] };
    let mut error = 1.0;
    for m in 1..=order {
        let ahead: f64 = (0..m).map(|i| filter[i] * rho(m - i)).sum();
        let partial = -ahead / error;
        // Pairs are counted lag by lag, so the correlations of a record with holes need not be those of any process.
        if partial.abs() >= PREDICTED {
            break;
        }
        filter.push(0.0);
        let reversed: Vec<f64> = filter.iter().rev().copied().collect();
        for (f, r) in filter.iter_mut().zip(&reversed) {
            *f += partial * r;
        }
        error *= 1.0 - partial * partial;
    }
    filter
}

/// A signal through a filter that looks back.
pub(super) fn filtered(signal: &[f64], filter: &[f64]) -> Vec<f64> {
    (0..signal.len())
        .map(|k| filter.iter().take(k + 1).enumerate().map(|(i, c)| c * signal[k - i]).sum())
        .collect()
}

/// Impulse response from a trace to the whitened residual, `lead` samples of it before the impulse.
pub(super) struct Response {
    pub(super) path: Path,
    pub(super) values: Vec<f64>,
    pub(super) lead: usize,
}

/// Time after which an answer of two poles is over, in their time constants.
const OVER: f64 = 8.0;

impl Response {
    /// `(S + (1 - S) L) C` with the states' zero-phase filter `S`, two poles `L` of a position loop and two `C` of the flanks, then
    /// the whitening filter.
    pub(super) fn new(state_hz: f64, path: Path, step_s: f64, whitening: &[f64]) -> Self {
        let (mut answer, lead) = match path.loop_hz {
            f64::INFINITY => (vec![1.0], 0),
            hz => {
                let lead = (1.5 / state_hz / step_s).ceil() as usize;
                let state = state_kernel(state_hz, step_s, lead);
                let mut answer: Vec<f64> = state.iter().map(|s| -s).collect();
                answer[lead] += 1.0;
                if hz > 0.0 {
                    two_poles(&mut answer, hz, step_s)
                } else {
                    answer.fill(0.0)
                }
                answer.iter_mut().zip(&state).for_each(|(a, s)| *a += s);
                (answer, lead)
            }
        };
        if path.flank_hz.is_finite() {
            two_poles(&mut answer, path.flank_hz, step_s);
        }
        let mut values = vec![0.0; answer.len() + whitening.len() - 1];
        for (k, a) in answer.iter().enumerate() {
            for (v, w) in values[k..].iter_mut().zip(whitening) {
                *v += a * w;
            }
        }
        Response { path, values, lead }
    }

    /// Inner products of a signal with the response to an impulse at every sample.
    pub(super) fn adjoint(&self, signal: &[f64]) -> Vec<f64> {
        let of = |k: usize| {
            let before = self.lead.saturating_sub(k);
            let from = (k + before - self.lead).min(signal.len());
            self.values[before..].iter().zip(&signal[from..]).map(|(v, s)| v * s).sum()
        };
        (0..signal.len()).map(of).collect()
    }

    /// Inner products of the response with itself, per lag.
    pub(super) fn products(&self) -> Vec<f64> {
        let of = |lag: usize| self.values[lag..].iter().zip(&self.values).map(|(a, b)| a * b).sum();
        (0..self.values.len()).map(of).collect()
    }
}

/// A signal through two real poles, longer by what they take to settle.
fn two_poles(signal: &mut Vec<f64>, hz: f64, step_s: f64) {
    let speed = std::f64::consts::TAU * hz;
    signal.resize(signal.len() + (OVER / speed / step_s) as usize, 0.0);
    let pole = 1.0 - (-speed * step_s).exp();
    for _ in 0..2 {
        let mut y = 0.0;
        for v in signal.iter_mut() {
            y += pole * (*v - y);
            *v = y;
        }
    }
}

/// Impulse response of the states' filter over `half` samples on either side, of gain one at rest; an impulse alone where the cut-off is no cut-off.
fn state_kernel(state_hz: f64, step_s: f64, half: usize) -> Vec<f64> {
    // Twice as long, so that the ends that the filter extends stay away.
    let mut impulse = vec![0.0; 4 * half + 1];
    impulse[2 * half] = 1.0;
    let kernel = butterworth(4, state_hz, 1.0 / step_s).and_then(|f| forward_backward(&f, &impulse));
    let mut kernel = kernel.unwrap_or(impulse)[half..=3 * half].to_vec();
    let sum: f64 = kernel.iter().sum();
    kernel.iter_mut().for_each(|x| *x /= sum);
    kernel
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whitening_finds_an_autoregressive_process() {
        let mut state = 7u64;
        let mut white = || {
            (0..12)
                .map(|_| {
                    state =
                        state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                    (state >> 11) as f64 / (1u64 << 53) as f64 - 0.5
                })
                .sum::<f64>()
        };
        let (mut x, mut list) = ([0.0; 2], Vec::new());
        for _ in 0..60_000 {
            let next = 1.6 * x[0] - 0.8 * x[1] + white();
            x = [next, x[0]];
            list.push(next);
        }
        let found = whitening(&list, 0.01);
        assert_eq!(found.len(), 7);
        for (k, expected) in [1.0, -1.6, 0.8, 0.0, 0.0, 0.0, 0.0].into_iter().enumerate() {
            assert!((found[k] - expected).abs() < 0.02, "{found:?}");
        }
        let rest = filtered(&list, &found);
        let variance = rest.iter().map(|r| r * r).sum::<f64>() / rest.len() as f64;
        assert!((variance - 1.0).abs() < 0.02, "{variance}");
    }

    #[test]
    fn a_slow_loop_leaves_the_states_filter_and_a_fast_one_everything() {
        let sum = |r: &Response| r.values.iter().sum::<f64>();
        let of = |loop_hz: f64, flank_hz: f64, whitening: &[f64]| {
            Response::new(20.0, Path { loop_hz, flank_hz }, 1e-3, whitening)
        };
        let still = of(0.0, f64::INFINITY, &[1.0]);
        assert!((sum(&still) - 1.0).abs() < 1e-3, "{}", sum(&still));
        let largest = still.values.iter().copied().fold(0.0, f64::max);
        assert_eq!(still.values[still.lead], largest);
        // Zero phase.
        for k in 1..40 {
            let (before, after) = (still.values[still.lead - k], still.values[still.lead + k]);
            assert!((before - after).abs() < 1e-6, "{k}: {before} {after}");
        }
        let slow = of(5.0, f64::INFINITY, &[1.0]);
        assert!((sum(&slow) - 1.0).abs() < 0.02, "{}", sum(&slow));
        let fast = of(f64::INFINITY, f64::INFINITY, &[1.0, -0.5]);
        assert_eq!((fast.values, fast.lead), (vec![1.0, -0.5], 0));
        let soft = of(f64::INFINITY, 12.0, &[1.0]);
        assert!((sum(&soft) - 1.0).abs() < 5e-3, "{}", sum(&soft));
    }
}
