//! Backlash from the effort of a simulated drive: two masses with a stiff, damped dead zone between them, in a position loop.

#![expect(clippy::unwrap_used, reason = "helpers of tests outside of test functions")]
#![expect(clippy::print_stdout, reason = "says what was measured")]

use dynid_clearance::backlash::{
    BacklashError, BacklashEstimate, BacklashSettings, BacklashSignals, BacklashVerdict, Path, estimate,
};
use dynid_motion::difference::central;
use dynid_motion::filter::{butterworth, forward_backward};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// Inertia of link and motor, kg m².
const LINK: f64 = 1.0;
const MOTOR: f64 = 0.5;
const STATE_HZ: f64 = 25.0;

#[derive(Clone, Copy)]
struct Drive {
    gap: f64,
    gravity: f64,
    /// Coulomb friction of motor and link, N m.
    friction: [f64; 2],
    /// Friction of the motor per torque of the transmission.
    load_friction: f64,
    /// Ripple of the motor's effort, N m, twelve to a turn.
    ripple: f64,
    noise: f64,
    /// Of the flanks, N m/rad.
    stiffness: f64,
    rate_hz: f64,
    loop_hz: f64,
    seed: u64,
}

const DRIVE: Drive = Drive {
    gap: 0.0,
    gravity: 0.0,
    friction: [3.0, 0.0],
    load_friction: 0.0,
    ripple: 0.0,
    noise: 0.3,
    stiffness: 3e5,
    rate_hz: 1000.0,
    loop_hz: 20.0,
    seed: 1,
};

fn sliding(v: f64) -> f64 {
    (v / 1e-3).tanh()
}

/// Signals of the drive as an identification has them: motor positions of 5 µrad, efforts with noise, known parameters.
struct Signals {
    residual: Vec<f64>,
    load: Vec<f64>,
    friction: Vec<f64>,
    inertia: Vec<f64>,
    velocity: Vec<f64>,
    counted: Vec<bool>,
    step_s: f64,
}

impl Signals {
    fn of(drive: &Drive) -> Self {
        let (q, effort) = run(drive);
        let rate = drive.rate_hz;
        let q = forward_backward(&butterworth(4, STATE_HZ, rate).unwrap(), &q).unwrap();
        let velocity = central(&q, rate).unwrap();
        let acceleration = central(&velocity, rate).unwrap();
        let n = q.len();
        let load: Vec<f64> = (0..n).map(|k| LINK * acceleration[k] + drive.gravity * q[k].cos()).collect();
        let friction: Vec<f64> =
            velocity.iter().map(|v| drive.friction.iter().sum::<f64>() * sliding(*v)).collect();
        let residual = (0..n).map(|k| effort[k] - load[k] - MOTOR * acceleration[k] - friction[k]).collect();
        let margin = (0.2 * rate) as usize;
        let counted = (0..n).map(|k| k > margin && k + margin < n).collect();
        Signals { residual, load, friction, inertia: vec![LINK; n], velocity, counted, step_s: 1.0 / rate }
    }

    fn borrowed(&self) -> BacklashSignals<'_> {
        BacklashSignals {
            residual: &self.residual,
            load: &self.load,
            friction: &self.friction,
            inertia: &self.inertia,
            velocity: &self.velocity,
            counted: &self.counted,
            step_s: self.step_s,
            state_hz: STATE_HZ,
        }
    }
}

/// Position of the motor and its effort, 30 s.
fn run(drive: &Drive) -> (Vec<f64>, Vec<f64>) {
    let mut random = ChaCha8Rng::seed_from_u64(drive.seed);
    let harmonics: Vec<[f64; 3]> = (1..=5)
        .map(|k| {
            let k = f64::from(k);
            [0.5 / k, std::f64::consts::TAU * 0.1 * k, random.random_range(0.0..std::f64::consts::TAU)]
        })
        .collect();
    let mut white = move || -> f64 { StandardNormal.sample(&mut random) };
    let reference = |t: f64| {
        harmonics.iter().fold([0.0; 3], |[q, v, a], [size, w, phase]| {
            let (sine, cosine) = (w * t + phase).sin_cos();
            [q + size * sine, v + size * w * cosine, a - size * w * w * sine]
        })
    };
    let (stiffness, total) = (drive.stiffness, LINK + MOTOR);
    let damping = 0.3 * (stiffness * LINK * MOTOR / total).sqrt();
    let w = std::f64::consts::TAU * drive.loop_hz;
    let [q0, v0, _] = reference(0.0);
    let mut state = [q0, v0, q0, v0];
    let h = 2.5e-5;
    let per = (1.0 / drive.rate_hz / h).round() as usize;
    let (mut positions, mut efforts) = (Vec::new(), Vec::new());
    for k in 0..(30.0 * drive.rate_hz) as usize {
        let [q, v, a] = reference(k as f64 / drive.rate_hz);
        let effort = total * (w * w * (q - state[0]) + 1.4 * w * (v - state[1]) + a)
            + drive.gravity * q.cos()
            + drive.friction.iter().sum::<f64>() * sliding(v);
        positions.push(((state[0] + 1e-6 * white()) / 5e-6).round() * 5e-6);
        efforts.push(effort + drive.noise * white());
        let rates = |s: [f64; 4]| {
            let twist = s[0] - s[2];
            let beyond = twist - twist.clamp(-0.5 * drive.gap, 0.5 * drive.gap);
            let torque = match beyond {
                0.0 => 0.0,
                b if b > 0.0 => (stiffness * b + damping * (s[1] - s[3])).max(0.0),
                b => (stiffness * b + damping * (s[1] - s[3])).min(0.0),
            };
            let rubbing = (drive.friction[0] + drive.load_friction * torque.abs()) * sliding(s[1]);
            let motor = effort - torque - rubbing - drive.ripple * (12.0 * s[0]).sin();
            let link = torque - drive.gravity * s[2].cos() - drive.friction[1] * sliding(s[3]);
            [s[1], motor / MOTOR, s[3], link / LINK]
        };
        for _ in 0..per {
            let at = |d: [f64; 4], h: f64| std::array::from_fn(|i| state[i] + h * d[i]);
            let k1 = rates(state);
            let k2 = rates(at(k1, 0.5 * h));
            let k3 = rates(at(k2, 0.5 * h));
            let k4 = rates(at(k3, h));
            state = std::array::from_fn(|i| state[i] + h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]));
        }
    }
    (positions, efforts)
}

fn look(drive: &Drive) -> BacklashEstimate {
    let found = estimate(&Signals::of(drive).borrowed(), &BacklashSettings::default()).unwrap();
    println!(
        "gap {:.1e}: {:?} {:.2e} ({:.1e} to {:.1e}) evidence {:.1} elsewhere {:?} share {} {:?} crossings {} would show {:?}",
        drive.gap,
        found.verdict,
        found.gap,
        found.interval.0,
        found.interval.1,
        found.evidence,
        found.elsewhere,
        found.share,
        found.path,
        found.crossings,
        found.would_show
    );
    found
}

#[test]
fn gaps_are_found_and_their_size() {
    find_gaps(&[(3e-4, 2), (3e-3, 4)]);
}

#[test]
#[ignore = "ten seconds; the ordinary run takes two gaps"]
fn gaps_of_a_hundredfold_range_are_found_and_their_size() {
    find_gaps(&[(1e-4, 1), (1e-3, 3), (1e-2, 5)]);
}

fn find_gaps(gaps: &[(f64, u64)]) {
    for (gap, seed) in gaps.iter().copied() {
        let found = look(&Drive { gap, seed, ..DRIVE });
        assert_eq!(found.verdict, BacklashVerdict::Found);
        assert!((found.gap / gap).ln().abs() < 0.25, "{}", found.gap);
        assert!(found.interval.0 < gap && gap < found.interval.1, "{:?}", found.interval);
    }
}

#[test]
fn a_gap_is_found_in_a_slow_log_and_behind_friction_that_follows_the_load() {
    find_behind(&[
        ("slow log", Drive { rate_hz: 200.0, loop_hz: 8.0, ..DRIVE }),
        ("friction that follows the load", Drive { load_friction: 0.1, ..DRIVE }),
    ]);
}

#[test]
#[ignore = "ten seconds; the ordinary run takes two drives"]
fn a_gap_is_found_behind_other_loops_friction_and_noise() {
    find_behind(&[
        ("slow loop", Drive { loop_hz: 8.0, ..DRIVE }),
        ("friction at the link", Drive { friction: [2.0, 1.0], ..DRIVE }),
        ("noise", Drive { noise: 1.5, ..DRIVE }),
        ("ripple", Drive { ripple: 0.5, ..DRIVE }),
        ("soft flanks", Drive { stiffness: 2e4, ..DRIVE }),
    ]);
}

fn find_behind(drives: &[(&str, Drive)]) {
    let gap = 1e-3;
    for (name, drive) in drives {
        println!("{name}");
        let found = look(&Drive { gap, seed: 11, ..*drive });
        assert_eq!(found.verdict, BacklashVerdict::Found, "{name}");
        assert!((found.gap / gap).ln().abs() < 0.5, "{name}: {}", found.gap);
    }
}

/// Drives without a gap, those first that are most like one with.
const WITHOUT: [(&str, Drive); 7] = [
    ("friction that follows the load", Drive { load_friction: 0.15, ..DRIVE }),
    ("soft flanks", Drive { stiffness: 5e3, ..DRIVE }),
    ("friction at the link", Drive { friction: [0.5, 2.5], ..DRIVE }),
    ("plain", DRIVE),
    ("ripple", Drive { ripple: 0.5, ..DRIVE }),
    ("noise", Drive { noise: 2.0, ..DRIVE }),
    ("slow loop", Drive { loop_hz: 8.0, ..DRIVE }),
];

fn show_no_gap(drives: &[(&str, Drive)], seeds: std::ops::Range<u64>) {
    for seed in seeds {
        for (name, drive) in drives {
            let found = look(&Drive { seed, rate_hz: 500.0, ..*drive });
            assert_eq!(found.verdict, BacklashVerdict::NotFound, "{name}, seed {seed}: {found:?}");
        }
    }
}

#[test]
fn drives_without_a_gap_show_none() {
    show_no_gap(&WITHOUT[..3], 0..1);
}

#[test]
#[ignore = "a minute; the ordinary run takes three drives and one seed"]
fn drives_without_a_gap_show_none_with_other_seeds() {
    show_no_gap(&WITHOUT[3..], 0..1);
    show_no_gap(&WITHOUT, 1..4);
}

/// What it rules out is ruled out: gaps that large are found.
#[test]
fn what_would_show_does_show() {
    shows_what_would_show(&DRIVE);
}

#[test]
#[ignore = "twelve seconds; the ordinary run takes one drive"]
fn what_would_show_does_show_on_other_drives() {
    shows_what_would_show(&Drive { load_friction: 0.1, ..DRIVE });
    shows_what_would_show(&Drive { loop_hz: 8.0, noise: 1.0, ..DRIVE });
}

fn shows_what_would_show(drive: &Drive) {
    let without = look(&Drive { seed: 20, ..*drive });
    let gap = without.would_show.unwrap();
    assert!(gap < 5e-3, "{gap}");
    let with = look(&Drive { gap, seed: 20, ..*drive });
    assert_eq!(with.verdict, BacklashVerdict::Found, "{gap}");
}

/// Gravity that never lets go holds the flanks together: nothing can be said.
#[test]
fn a_load_of_one_sign_says_nothing() {
    for gap in [0.0, 1e-3] {
        let found = look(&Drive { gap, gravity: 15.0, ..DRIVE });
        assert_eq!(found.verdict, BacklashVerdict::NoCrossings);
        assert_eq!((found.evidence, found.would_show), (0.0, None));
    }
}

#[test]
fn the_same_bits_every_time() {
    let signals = Signals::of(&Drive { gap: 1e-3, rate_hz: 500.0, ..DRIVE });
    let once = estimate(&signals.borrowed(), &BacklashSettings::default()).unwrap();
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    let again = one.install(|| estimate(&signals.borrowed(), &BacklashSettings::default()).unwrap());
    assert_eq!(once, again);
}

#[test]
fn nonsense_is_an_error() {
    let mut signals = Signals::of(&Drive { rate_hz: 200.0, loop_hz: 8.0, ..DRIVE });
    let settings = BacklashSettings::default();
    let bad = |settings: &BacklashSettings| {
        matches!(estimate(&signals.borrowed(), settings), Err(BacklashError::Setting { .. }))
    };
    assert!(bad(&BacklashSettings { range: (0.0, 1.0), ..settings.clone() }));
    assert!(bad(&BacklashSettings { gaps: 1, ..settings.clone() }));
    assert!(bad(&BacklashSettings {
        paths: vec![Path { loop_hz: -1.0, flank_hz: 1.0 }],
        ..settings.clone()
    }));
    assert!(bad(&BacklashSettings { shares: 1, ..settings.clone() }));
    let short = BacklashSignals { load: &signals.load[1..], ..signals.borrowed() };
    assert!(matches!(estimate(&short, &settings), Err(BacklashError::Lengths { .. })));
    let few = vec![false; signals.load.len()];
    let uncounted = BacklashSignals { counted: &few, ..signals.borrowed() };
    assert_eq!(estimate(&uncounted, &settings).unwrap().verdict, BacklashVerdict::TooShort);
    signals.inertia[7] = 0.0;
    assert_eq!(estimate(&signals.borrowed(), &settings), Err(BacklashError::BadSample { row: 7 }));
}
