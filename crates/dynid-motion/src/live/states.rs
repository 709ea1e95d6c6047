//! States of a stream on a uniform grid.

use super::LocalPolynomial;
use crate::shift::lagrange;
use crate::signal::SignalError;
use dynid_words::Transfer;

/// How states of a stream are formed.
#[derive(Debug, Clone, PartialEq)]
pub struct LiveSettings {
    /// Sample rate of the grid, Hz.
    pub rate_hz: f64,
    /// Cut-off of the state filter, Hz ([`LocalPolynomial::with_cutoff`]).
    pub state_hz: f64,
    /// Delay of the motion behind the effort, samples of the grid: the motion at a time goes with the effort so much earlier.
    pub delay_samples: f64,
}

/// Weights over a run of samples, the first of them `first` samples after the wanted one.
#[derive(Debug, Clone)]
struct Taps {
    first: isize,
    weights: Vec<f64>,
}

impl Taps {
    /// Taps of smoothing a signal that is taken `samples` later, by 6-point Lagrange interpolation.
    fn shifted(weights: &[f64], samples: f64) -> Taps {
        let half = (weights.len() / 2) as isize;
        let whole = samples.floor();
        let part = samples - whole;
        if part == 0.0 {
            return Taps { first: whole as isize - half, weights: weights.to_vec() };
        }
        let nodes = lagrange(part);
        let mut out = vec![0.0; weights.len() + nodes.len() - 1];
        for (k, w) in weights.iter().enumerate() {
            for (m, node) in nodes.iter().enumerate() {
                out[k + m] += w * node;
            }
        }
        Taps { first: whole as isize - half - 2, weights: out }
    }

    fn last(&self) -> isize {
        self.first + self.weights.len() as isize - 1
    }

    fn apply(&self, signal: &[f64], at: usize) -> f64 {
        let start = at.wrapping_add_signed(self.first);
        self.weights.iter().zip(&signal[start..start + self.weights.len()]).map(|(w, x)| w * x).sum()
    }
}

/// States of a run of grid samples: sample `s` of coordinate (or channel) `c` at `c * samples + s`.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct LiveBlock {
    /// Number of samples.
    pub samples: usize,
    /// Times, s.
    pub time: Vec<f64>,
    /// Positions.
    pub q: Vec<f64>,
    /// Velocities.
    pub dq: Vec<f64>,
    /// Accelerations.
    pub ddq: Vec<f64>,
    /// Efforts through the filter of the positions, each at the time that its motion goes with.
    pub effort: Vec<f64>,
    /// Extra channels as they are.
    pub channels: Vec<f64>,
}

/// Forms states from grid samples of `coordinates` positions, as many efforts, and `channels` extra values, in this order.
///
/// The state of a sample appears [`LiveStates::lag`] samples after it.
#[derive(Debug, Clone)]
pub struct LiveStates {
    coordinates: usize,
    motion: [Taps; 3],
    effort: Taps,
    /// Samples needed before and after a state.
    before: usize,
    after: usize,
    time: Vec<f64>,
    /// Signal after signal: recent samples.
    signals: Vec<Vec<f64>>,
}

impl LiveStates {
    /// States of signals on a grid.
    ///
    /// # Errors
    /// [`SignalError`] for a rate, a cut-off or a delay without sense.
    pub fn new(
        coordinates: usize,
        channels: usize,
        settings: &LiveSettings,
    ) -> Result<LiveStates, SignalError> {
        let delay = settings.delay_samples;
        if !(delay.is_finite() && delay.abs() <= 1e4) {
            return Err(SignalError::Setting {
                name: "delay_samples",
                expected: "a number of moderate size",
                found: delay,
            });
        }
        let local = LocalPolynomial::with_cutoff(settings.state_hz, settings.rate_hz)?;
        let motion = [0, 1, 2].map(|order| Taps::shifted(local.weights(order), 0.0));
        let effort = Taps::shifted(local.weights(0), -delay);
        let half = local.half_width();
        Ok(LiveStates {
            coordinates,
            before: half.max(effort.first.min(0).unsigned_abs()),
            after: half.max(effort.last().max(0).unsigned_abs()),
            motion,
            effort,
            time: Vec::new(),
            signals: vec![Vec::new(); 2 * coordinates + channels],
        })
    }

    /// Samples by which states lie behind.
    pub fn lag(&self) -> usize {
        self.after
    }

    /// Takes a grid sample; `first`: what came before does not connect to it.
    ///
    /// # Panics
    /// If the sample has another number of values.
    pub fn push(&mut self, time: f64, values: &[f64], first: bool) {
        assert_eq!(values.len(), self.signals.len(), "values of a sample");
        if first {
            self.clear();
        }
        self.time.push(time);
        for (signal, x) in self.signals.iter_mut().zip(values) {
            signal.push(*x);
        }
    }

    /// Forgets what came before.
    pub fn clear(&mut self) {
        self.time.clear();
        self.signals.iter_mut().for_each(Vec::clear);
    }

    /// States that can be formed now; each appears once.
    pub fn drain(&mut self, out: &mut LiveBlock) {
        let held = self.time.len();
        let samples = held.saturating_sub(self.before + self.after);
        out.samples = samples;
        for list in [&mut out.time, &mut out.q, &mut out.dq, &mut out.ddq, &mut out.effort, &mut out.channels]
        {
            list.clear();
        }
        if samples == 0 {
            return;
        }
        let centres = self.before..self.before + samples;
        out.time.extend_from_slice(&self.time[centres.clone()]);
        let (positions, rest) = self.signals.split_at(self.coordinates);
        let (efforts, channels) = rest.split_at(self.coordinates);
        for signal in positions {
            for (taps, list) in self.motion.iter().zip([&mut out.q, &mut out.dq, &mut out.ddq]) {
                list.extend(centres.clone().map(|c| taps.apply(signal, c)));
            }
        }
        for signal in efforts {
            out.effort.extend(centres.clone().map(|c| self.effort.apply(signal, c)));
        }
        for signal in channels {
            out.channels.extend_from_slice(&signal[centres.clone()]);
        }
        self.time.drain(..samples);
        self.signals.iter_mut().for_each(|signal| drop(signal.drain(..samples)));
    }

    /// Carries the state to or from a checkpoint.
    pub fn transfer(&mut self, transfer: &mut Transfer<'_>) {
        transfer.list(&mut self.time, 1);
        for signal in &mut self.signals {
            transfer.list(signal, 1);
        }
        if self.signals.iter().any(|s| s.len() != self.time.len()) {
            transfer.fail();
            self.clear();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn settings(delay_samples: f64) -> LiveSettings {
        LiveSettings { rate_hz: 200.0, state_hz: 30.0, delay_samples }
    }

    /// One coordinate, its effort earlier by the delay, one channel.
    fn sample(n: u32, delay: f64) -> (f64, [f64; 3]) {
        let t = f64::from(n) / 200.0;
        let motion = |t: f64| (3.0 * t).sin() + 0.2 * (7.0 * t).cos();
        (t, [motion(t), motion(t + delay / 200.0), f64::from(n)])
    }

    #[test]
    fn states_are_those_of_the_motion_and_efforts_line_up() {
        for delay in [0.0, 0.5, 2.3, -1.7] {
            let mut live = LiveStates::new(1, 1, &settings(delay)).unwrap();
            let mut block = LiveBlock::default();
            let mut seen = 0;
            for n in 0..400 {
                let (t, values) = sample(n, delay);
                live.push(t, &values, n == 0);
                live.drain(&mut block);
                assert!(block.samples <= 1);
                if block.samples == 0 {
                    continue;
                }
                seen += 1;
                let t = block.time[0];
                assert_eq!(block.channels[0], f64::from(n) - live.lag() as f64);
                let exact = [
                    (3.0 * t).sin() + 0.2 * (7.0 * t).cos(),
                    3.0 * (3.0 * t).cos() - 1.4 * (7.0 * t).sin(),
                    -9.0 * (3.0 * t).sin() - 9.8 * (7.0 * t).cos(),
                ];
                for (x, y) in [block.q[0], block.dq[0], block.ddq[0]].iter().zip(exact) {
                    assert!((x - y).abs() < 2e-4 * (1.0 + y.abs()), "delay {delay}, t {t}: {x} {y}");
                }
                assert!((block.effort[0] - exact[0]).abs() < 2e-6, "delay {delay}, t {t}");
            }
            assert!(seen > 370);
        }
    }

    #[test]
    fn handing_over_in_pieces_changes_no_bit() {
        let feed = |pieces: &[usize]| {
            let mut live = LiveStates::new(1, 1, &settings(0.4)).unwrap();
            let (mut block, mut out) = (LiveBlock::default(), Vec::new());
            let mut n = 0;
            for piece in pieces {
                for _ in 0..*piece {
                    let (t, values) = sample(n, 0.4);
                    live.push(t, &values, n == 0);
                    n += 1;
                }
                live.drain(&mut block);
                for k in 0..block.samples {
                    out.push([block.q[k], block.dq[k], block.ddq[k], block.effort[k]]);
                }
            }
            out
        };
        assert_eq!(feed(&[300]), feed(&[1, 7, 60, 2, 130, 100]));
    }

    #[test]
    fn a_new_run_does_not_see_the_old_one() {
        let mut live = LiveStates::new(1, 1, &settings(0.0)).unwrap();
        let mut block = LiveBlock::default();
        for n in 0..100 {
            live.push(f64::from(n) / 200.0, &[1e6, 0.0, 0.0], n == 0);
        }
        live.drain(&mut block);
        for n in 0..100 {
            live.push(5.0 + f64::from(n) / 200.0, &[2.0, 0.0, 0.0], n == 0);
        }
        live.drain(&mut block);
        assert!(block.samples > 0 && block.q.iter().all(|q| (q - 2.0).abs() < 1e-12));
    }

    #[test]
    fn a_checkpoint_goes_on_with_the_same_bits() {
        let mut live = LiveStates::new(1, 1, &settings(0.4)).unwrap();
        let mut block = LiveBlock::default();
        let push = |live: &mut LiveStates, n: u32| {
            let (t, values) = sample(n, 0.4);
            live.push(t, &values, n == 0);
        };
        (0..50).for_each(|n| push(&mut live, n));
        live.drain(&mut block);
        let mut words = Vec::new();
        live.transfer(&mut Transfer::Save(&mut words));
        let mut resumed = LiveStates::new(1, 1, &settings(0.4)).unwrap();
        let mut load = Transfer::load(&words);
        resumed.transfer(&mut load);
        assert!(load.complete());
        let mut other = LiveBlock::default();
        for n in 50..80 {
            push(&mut live, n);
            push(&mut resumed, n);
            live.drain(&mut block);
            resumed.drain(&mut other);
            assert_eq!(block, other);
        }
        let mut short = Transfer::load(&words[..words.len() - 1]);
        resumed.transfer(&mut short);
        assert!(!short.complete());
    }
}
