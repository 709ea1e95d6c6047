//! One joint in a position loop, many logs: bias of least squares and of instruments, and how often the test rejects.
#![expect(clippy::unwrap_used, clippy::print_stdout, reason = "a test may stop, and says what it measured")]

use dynid_estimate::instruments::{
    Exogeneity, ExogeneitySettings, ExogeneityVerdict, InstrumentSettings, crossed, exogeneity, half,
    instrumental, measured,
};
use dynid_estimate::linear::{LinearEstimate, LinearMethod, LinearSettings, estimate};
use dynid_factor::FactorBuilder;
use dynid_factor::groups::ReducedGroup;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;
use std::sync::LazyLock;

const RUNS: u64 = 500;
const RATE_HZ: f64 = 1000.0;
const SECONDS: usize = 40;
/// Inertia, viscous friction, Coulomb friction, offset.
const TRUTH: [f64; 4] = [0.06, 0.3, 0.6, 0.2];
const SIZES: [f64; 4] = [0.03, 0.3, 0.6, 0.6];
/// Position noise at which the power of the test is asked for, rad.
const NOISE: f64 = 3e-4;
const EFFORT_NOISE: f64 = 0.05;
/// Cut-off in Hz and decimation of rows that let noise through, and of rows that do not.
const WIDE: (f64, usize) = (100.0, 5);
const NARROW: (f64, usize) = (20.0, 20);
/// Rows nearer than this many ticks to a speed below this (rad/s) of the noise-free loop are left out: filters smear the reversal
/// of friction.
const SLOWEST: (usize, f64) = (60, 0.1);

/// Where noise of the positions goes.
#[derive(Clone, Copy)]
struct Noise {
    /// Into the readings of the controller, rad.
    loop_: f64,
    /// Whether the log has the noise that the controller reads.
    logged: bool,
    /// Into the logged effort.
    effort: f64,
}

const NONE: Noise = Noise { loop_: 0.0, logged: false, effort: 0.0 };

/// Positions and efforts of a run of the loop.
///
/// The drive holds its effort over a tick; position is read in the middle of it, so that effort and motion of a row belong
/// together. The controller acts a tick later, with velocities from differences of readings.
fn run_loop(x: &[f64; 4], noise: Noise, rng: &mut ChaCha8Rng) -> [Vec<f64>; 2] {
    let [inertia, viscous, coulomb, offset] = *x;
    let omega = std::f64::consts::TAU * 6.0;
    let (kp, kd) = (TRUTH[0] * omega * omega, 1.4 * TRUTH[0] * omega);
    let (step, half) = (1.0 / RATE_HZ, 0.5 / RATE_HZ);
    let decay = (-viscous / inertia * half).exp();
    let (mut q, mut v) = (0.0, 0.0);
    let (mut reading, mut velocity) = (0.0, 0.0);
    let mut draw = |size: f64| -> f64 {
        let z: f64 = if size > 0.0 { StandardNormal.sample(rng) } else { 0.0 };
        size * z
    };
    let mut out = [Vec::new(), Vec::new()];
    for [wanted, speed] in REFERENCE.iter() {
        let effort = kp * (wanted - reading) + kd * (speed - velocity);
        let mut advance = || {
            // Exact for a constant sign of the velocity.
            let free = (effort - offset - coulomb * (v * 1e3_f64).clamp(-1.0, 1.0)) / viscous;
            q += free * half + (v - free) * (1.0 - decay) * inertia / viscous;
            v = free + (v - free) * decay;
            q
        };
        let middle = advance();
        advance();
        let error = draw(noise.loop_);
        let seen = middle + error;
        velocity += 0.5 * ((seen - reading) / step - velocity);
        reading = seen;
        out[0].push(middle + if noise.logged { error } else { 0.0 });
        out[1].push(effort + draw(noise.effort));
    }
    out
}

/// Wanted position and speed at every tick.
static REFERENCE: LazyLock<Vec<[f64; 2]>> = LazyLock::new(|| {
    let at = |t: f64| {
        let mut out = [0.0, 0.0];
        for (amplitude, omega, phase) in [(0.6, 1.9, 0.0), (0.25, 5.3, 1.0), (0.08, 12.7, 2.0)] {
            out[0] += amplitude * f64::sin(omega * t + phase);
            out[1] += amplitude * omega * f64::cos(omega * t + phase);
        }
        out
    };
    (0..SECONDS * RATE_HZ as usize).map(|k| at(k as f64 / RATE_HZ)).collect()
});

/// Ticks at which rows may be, whatever the noise.
static COUNTED: LazyLock<Vec<bool>> = LazyLock::new(|| {
    let [position, _] = run_loop(&TRUTH, NONE, &mut ChaCha8Rng::seed_from_u64(0));
    let speed = central(&position);
    let edge = RATE_HZ as usize / 2;
    let (reach, slowest) = SLOWEST;
    let fast = |k: usize| speed[k - reach..=k + reach].iter().all(|v| v.abs() >= slowest);
    (0..speed.len()).map(|k| k >= edge && k + edge < speed.len() && fast(k)).collect()
});

/// Second-order Butterworth low pass by the bilinear transform, forth and back.
#[derive(Clone, Copy)]
struct LowPass {
    b: [f64; 3],
    a: [f64; 2],
}

impl LowPass {
    fn new(cutoff_hz: f64) -> LowPass {
        let c = 1.0 / (std::f64::consts::PI * cutoff_hz / RATE_HZ).tan();
        let g = 1.0 / (1.0 + std::f64::consts::SQRT_2 * c + c * c);
        let a = [g * 2.0 * (1.0 - c * c), g * (1.0 - std::f64::consts::SQRT_2 * c + c * c)];
        LowPass { b: [g, 2.0 * g, g], a }
    }

    fn forth(&self, signal: &mut [f64]) {
        let (mut s1, mut s2) = (0.0, 0.0);
        for x in signal {
            let y = self.b[0] * *x + s1;
            s1 = self.b[1] * *x - self.a[0] * y + s2;
            s2 = self.b[2] * *x - self.a[1] * y;
            *x = y;
        }
    }

    fn apply(&self, mut signal: Vec<f64>) -> Vec<f64> {
        self.forth(&mut signal);
        signal.reverse();
        self.forth(&mut signal);
        signal.reverse();
        signal
    }
}

/// Central differences per second; zero at the ends.
fn central(signal: &[f64]) -> Vec<f64> {
    let inner = signal.windows(3).map(|w| 0.5 * RATE_HZ * (w[2] - w[0]));
    std::iter::once(0.0).chain(inner).chain([0.0]).collect()
}

/// Filtered columns: acceleration, velocity, its sign, one.
fn columns(filter: LowPass, position: Vec<f64>) -> [Vec<f64>; 4] {
    let q = filter.apply(position);
    let dq = central(&q);
    let ddq = central(&dq);
    let sign = dq.iter().map(|v| v.signum()).collect();
    [ddq, dq, sign, vec![1.0; q.len()]]
}

/// A log as rows.
struct Record {
    filter: LowPass,
    decimation: usize,
    w: [Vec<f64>; 4],
    effort: Vec<f64>,
}

impl Record {
    fn new(seed: u64, noise: Noise, (cutoff_hz, decimation): (f64, usize)) -> Record {
        let [position, effort] = run_loop(&TRUTH, noise, &mut ChaCha8Rng::seed_from_u64(seed));
        let filter = LowPass::new(cutoff_hz);
        Record { w: columns(filter, position), effort: filter.apply(effort), filter, decimation }
    }

    /// Factors of the given columns and the effort in blocks of 1 s; edges and reversals left out.
    fn reduced(&self, columns: &[&Vec<f64>]) -> Vec<ReducedGroup> {
        let mut builder = FactorBuilder::with_chunk_rows(columns.len(), 256);
        let second = RATE_HZ as usize;
        let blocks = (0..SECONDS).map(|block| {
            for k in (block * second..(block + 1) * second).step_by(self.decimation) {
                if COUNTED[k] {
                    let row: Vec<f64> = columns.iter().map(|c| c[k]).collect();
                    builder.push_row(&row, self.effort[k]).unwrap();
                }
            }
            builder.take()
        });
        let blocks = blocks.collect();
        vec![ReducedGroup { log: 0, output: 0, scale: 0, columns: (0..columns.len()).collect(), blocks }]
    }

    fn measured(&self) -> Vec<ReducedGroup> {
        self.reduced(&self.w.each_ref())
    }

    /// `[Z | W | y]` with `Z` from a noise-free loop with parameters `x`.
    fn paired(&self, x: &[f64; 4]) -> Vec<ReducedGroup> {
        let [position, _] = run_loop(x, NONE, &mut ChaCha8Rng::seed_from_u64(0));
        let z = columns(self.filter, position);
        self.reduced(&z.iter().chain(&self.w).collect::<Vec<_>>())
    }

    /// Estimate by instruments from simulations, on some of the blocks; the first simulation with least squares on these.
    fn rounds(&self, of: impl Fn(&[ReducedGroup]) -> Vec<ReducedGroup>, rounds: usize) -> [f64; 4] {
        let mut x = possible(&least_squares(&of(&self.measured())).x);
        for _ in 0..rounds {
            let paired = of(&self.paired(&x));
            x = possible(&instrumental(&paired, 4, &InstrumentSettings::default()).unwrap().linear.x);
        }
        x
    }

    /// The test with instruments of each half from the other.
    fn test(&self) -> Exogeneity {
        let from_first = self.paired(&self.rounds(|g| half(g, false), 1));
        let from_second = self.paired(&self.rounds(|g| half(g, true), 1));
        let paired = crossed(&from_second, &from_first);
        let weights = least_squares(&measured(&paired)).weights();
        exogeneity(&paired, &weights, 4, &SIZES, &ExogeneitySettings::default()).unwrap()
    }
}

fn least_squares(groups: &[ReducedGroup]) -> LinearEstimate {
    estimate(groups, None, 4, &LinearMethod::Wls, &LinearSettings::default()).unwrap()
}

/// Parameters that a joint can have: what a simulation needs.
fn possible(x: &[f64]) -> [f64; 4] {
    [x[0].max(0.01), x[1].max(0.02), x[2].max(0.0), x[3]]
}

fn mean_and_std(values: &[f64]) -> (f64, f64) {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    (mean, (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0)).sqrt())
}

#[test]
fn bias_of_instruments_is_a_fifth_of_least_squares_and_less() {
    let noise = Noise { loop_: NOISE, logged: true, effort: EFFORT_NOISE };
    let found: Vec<[Vec<f64>; 2]> = (0..RUNS)
        .into_par_iter()
        .map(|seed| {
            let record = Record::new(seed, noise, WIDE);
            let x = record.rounds(<[_]>::to_vec, 2);
            [least_squares(&record.measured()).x, x.to_vec()]
        })
        .collect();
    let mut squares = [0.0; 2];
    for (c, truth) in TRUTH.iter().enumerate() {
        let of = |k: usize| mean_and_std(&found.iter().map(|f| f[k][c] / truth - 1.0).collect::<Vec<_>>());
        let ((ls, ls_std), (iv, iv_std)) = (of(0), of(1));
        println!(
            "parameter {c}: bias of least squares {:+.2} % (std {:.2} %), of instruments {:+.3} % (std {:.2} %)",
            100.0 * ls,
            100.0 * ls_std,
            100.0 * iv,
            100.0 * iv_std
        );
        assert!(5.0 * iv.abs() <= ls.abs(), "parameter {c}: {iv} against {ls}");
        // Instruments do not fit the noise, so theirs scatter more; all errors together they are far nearer.
        assert!(iv_std < 6.0 * ls_std, "parameter {c}: {iv_std} against {ls_std}");
        squares[0] += ls.powi(2) + ls_std.powi(2);
        squares[1] += iv.powi(2) + iv_std.powi(2);
    }
    assert!(25.0 * squares[1] < squares[0], "{squares:?}");
}

fn rejections(noise: Noise, route: (f64, usize)) -> (f64, f64, f64) {
    let tests: Vec<Exogeneity> =
        (0..RUNS).into_par_iter().map(|seed| Record::new(1000 + seed, noise, route).test()).collect();
    let share = |wanted: &dyn Fn(&Exogeneity) -> bool| {
        tests.iter().filter(|t| wanted(t)).count() as f64 / RUNS as f64
    };
    let rejected = share(&|t| t.robust.unwrap().p_value < 0.05);
    let naive = share(&|t| t.naive.unwrap().p_value < 0.05);
    let material = share(&|t| t.verdict == ExogeneityVerdict::Material);
    let (blocks, tested) = (tests[0].blocks, tests[0].tested.len());
    println!(
        "{} Hz: rejected {:.1} %, naive F {:.1} %, called material {:.1} %; {blocks} blocks, {tested} columns, V/W {:.1?} %",
        route.0,
        100.0 * rejected,
        100.0 * naive,
        100.0 * material,
        tests[0].unexplained.iter().map(|v| 100.0 * v).collect::<Vec<f64>>()
    );
    assert!(blocks >= 35);
    (rejected, naive, material)
}

/// Noise in the controller's readings alone moves the joint, which the log records exactly: instruments miss that motion, and
/// least squares is right to use it.
#[test]
#[ignore = "four seconds; the ordinary run finds noise that is fed back"]
fn a_true_null_is_rejected_at_the_nominal_rate() {
    let noise = Noise { loop_: NOISE, logged: false, effort: EFFORT_NOISE };
    let (rejected, _, material) = rejections(noise, NARROW);
    assert!((0.03..=0.08).contains(&rejected), "{rejected}");
    assert!(material <= 0.2, "{material}");
}

#[test]
fn noise_that_is_logged_and_fed_back_is_found() {
    let noise = Noise { loop_: NOISE, logged: true, effort: EFFORT_NOISE };
    let (rejected, _, material) = rejections(noise, WIDE);
    assert!(rejected > 0.9 && material > 0.9, "{rejected} {material}");
}
