//! Backlash of a drive from an ordinary log: what a gap would have done to the effort along this motion, against what is left
//! of the effort.
//!
//! Whenever the torque that a transmission carries changes its sign, the flanks part. The link is then free: its distance `x`
//! from the flank left obeys `J ẍ = |T|`, until it has crossed the gap and hits the other flank. Meanwhile the drive misses
//! `T` in its effort, and the impact gives the momentum back at once. The moment of both is `J` times the gap, whatever the
//! time of flight: a gap leaves a dipole in the residual, at an instant that load and friction alone decide. Friction, which
//! changes with the direction of motion, leaves its mark at reversals; they are left out.
//!
//! The trace of every candidate gap is followed along the log and passed through what lies between it and the residual: motion
//! measured at the drive shows what the drive gave way below the cut-off of the states; above it, the position loop answers,
//! `H = S + (1 - S) L`, with a loop `L` of unknown speed, and flanks that are soft spread the impact, `H = (S + (1 - S) L) C`.
//! The log-likelihood ratio against no gap, with the amplitude that physics asks for, decides, in noise as coloured as the residual is. Deviations of load, friction and its reach are regressors.
//!
//! A gap can be told only if its flight lasts longer than the load's zero is uncertain: deviations of the load of slow motion
//! (the residual below the cut-off of the states) move crossings, and smaller gaps are never ruled out.
//!
//! **Placebos.** The same trace with flanks that part at other loads than zero has no reason to be there. Its largest likelihood
//! ratio measures what else in the residual looks like a gap, and a gap counts only beyond that.

mod flight;
mod likelihood;
mod noise;

use dynid_motion::median::median;
use dynid_motion::signal::rms;
use likelihood::{Candidate, Likelihood, Trial};

/// Signals of one joint at equal steps.
#[derive(Debug, Clone, Copy)]
pub struct BacklashSignals<'a> {
    /// Measured minus predicted effort, N m or N.
    pub residual: &'a [f64],
    /// Effort that moves and holds the bodies, without the drive's own inertia and friction, N m or N.
    pub load: &'a [f64],
    /// Effort of the joint's friction.
    pub friction: &'a [f64],
    /// Inertia of what the transmission moves, drive not included, other joints held: kg m² or kg.
    pub inertia: &'a [f64],
    /// Velocity, rad/s or m/s.
    pub velocity: &'a [f64],
    /// Samples that count.
    pub counted: &'a [bool],
    /// Time between samples, s.
    pub step_s: f64,
    /// Cut-off of the zero-phase Butterworth filter of order 4 that the states passed, Hz.
    pub state_hz: f64,
}

/// What may lie between a gap and the residual of the effort.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Path {
    /// Bandwidth of the position loop, Hz: 0 for one that does not answer, infinity for a torque sensor at the joint.
    pub loop_hz: f64,
    /// Bandwidth of the flanks, Hz, above 0: that of the link on the stiffness of the transmission.
    pub flank_hz: f64,
}

/// Settings of [`estimate`].
#[derive(Debug, Clone, PartialEq)]
pub struct BacklashSettings {
    /// Smallest and largest gap, from flank to flank, rad or m. Default: 1e-5 to 0.03.
    pub range: (f64, f64),
    /// Gaps tried, equally spaced in their logarithm. Default: 18.
    pub gaps: usize,
    /// What may lie between gap and residual. Default: loops of 0, 20, 60 Hz and infinity behind stiff flanks; 0 and infinity
    /// behind flanks of 30 and 12 Hz.
    pub paths: Vec<Path>,
    /// Shares of the friction behind the transmission that are tried, equally spaced from 0 to 1. Default: 17.
    pub shares: usize,
    /// Loads on either side of zero at which flanks are let part, up to 1.5 times the root mean square of the load. Default: 20.
    pub levels: usize,
}

impl Default for BacklashSettings {
    fn default() -> Self {
        BacklashSettings {
            range: (1e-5, 3e-2),
            gaps: 18,
            paths: [
                (0.0, f64::INFINITY),
                (20.0, f64::INFINITY),
                (60.0, f64::INFINITY),
                (f64::INFINITY, f64::INFINITY),
                (0.0, 30.0),
                (0.0, 12.0),
                (f64::INFINITY, 30.0),
                (f64::INFINITY, 12.0),
            ]
            .map(|(loop_hz, flank_hz)| Path { loop_hz, flank_hz })
            .to_vec(),
            shares: 17,
            levels: 20,
        }
    }
}

/// Why no gap can be looked for.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum BacklashError {
    /// Lists of other lengths.
    #[error("expected {expected} samples of every signal, found {found}")]
    Lengths {
        /// Samples of the residual.
        expected: usize,
        /// Samples of another signal.
        found: usize,
    },
    /// A number is not finite, or an inertia not above 0.
    #[error("sample {row}: expected finite signals and an inertia above 0")]
    BadSample {
        /// Index from 0.
        row: usize,
    },
    /// A setting that makes no sense.
    #[error("expected {expected}")]
    Setting {
        /// What was expected.
        expected: &'static str,
    },
}

/// What the log says about a gap.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BacklashVerdict {
    /// The residual holds the trace of a gap, beyond what else looks like one.
    Found,
    /// The log does not show a gap.
    NotFound,
    /// The load changes its sign too seldom away from reversals: flanks stay where they are, whatever the gap.
    NoCrossings,
    /// Too few samples away from reversals and gaps of the clock.
    TooShort,
}

/// What the log says, in numbers.
#[derive(Debug, Clone, PartialEq)]
pub struct BacklashEstimate {
    /// Verdict.
    pub verdict: BacklashVerdict,
    /// The most likely gap from flank to flank, rad or m; without meaning unless found.
    pub gap: f64,
    /// Gaps that explain the residual about as well, and 25 % more on either side for what impacts and loop really do.
    pub interval: (f64, f64),
    /// Root of twice the log-likelihood ratio against no gap: standard deviations, if noise were Gaussian. 0 where no gap
    /// beats none.
    pub evidence: f64,
    /// Evidence for flanks that part at other loads; `None` if the load's zero is too uncertain for others to be others.
    pub elsewhere: Option<f64>,
    /// Share of the friction that acts behind the transmission, as the most likely gap has it.
    pub share: f64,
    /// What lies between, as the most likely gap has it.
    pub path: Path,
    /// Crossings of the gap away from reversals.
    pub crossings: usize,
    /// Smallest gap that would have shown, and with it every larger one that was tried, whatever the path, if friction acts
    /// at the drive; `None` if the log rules out none.
    pub would_show: Option<f64>,
    /// Per load at which flanks part, N m or N: largest evidence over gaps.
    pub profile: Vec<(f64, f64)>,
}

/// Fewest samples that count.
const SAMPLES: usize = 400;
/// Loads tried, in root mean squares of the load.
const REACH: f64 = 1.5;
/// Evidence from which a gap is believed: traces at loads where no gap acts reach 6.8 on 45 joints of nine recorded logs, since
/// residuals of real drives are no Gaussian noise.
const BELIEVED: f64 = 10.0;
/// Times the evidence of placebos that a gap must have: recorded residuals have longer tails than Gaussian noise.
const BEYOND_PLACEBOS: f64 = 2.0;
/// Largest uncertainty of the load's zero that is looked over, in root mean squares of the load.
const WIDEST: f64 = 0.25;
/// Placebos are that many tolerances of the load away from zero.
const AWAY: f64 = 3.0;
/// Standard deviations of luck on top of the evidence that a gap would need, before it is ruled out.
const LUCK: f64 = 2.0;
/// Standard deviations within which gaps explain a residual about as well.
const SURE: f64 = 3.0;
/// Factor within which plastic impacts and a loop of two poles get the gap of a simulated drive.
const MODEL_ERROR: f64 = 1.25;
/// Steps to a step of the scan, of shares of friction and of loads at which flanks part.
const STEPS: i32 = 4;
/// Steps of a refined gap.
const FINER: f64 = 1.08;

/// Looks for the trace of a gap in the residual of an effort.
///
/// Flanks part where load plus share of friction passes through zero; the load is known no better than the residual's root mean
/// square below the cut-off of the states, within which its zero is sought. Positions are those of the drive, or the effort that of a torque sensor behind it.
/// Impacts are taken for plastic and other joints for rigid; flanks softer than those of the settings are not reckoned with.
///
/// # Errors
/// [`BacklashError`].
pub fn estimate(
    signals: &BacklashSignals<'_>,
    settings: &BacklashSettings,
) -> Result<BacklashEstimate, BacklashError> {
    check(signals, settings)?;
    let nothing = |verdict| BacklashEstimate {
        verdict,
        gap: 0.0,
        interval: (0.0, 0.0),
        evidence: 0.0,
        elsewhere: None,
        share: 0.0,
        path: settings.paths[0],
        crossings: 0,
        would_show: None,
        profile: Vec::new(),
    };
    let Some(likelihood) = Likelihood::new(signals, &settings.paths, SAMPLES) else {
        return Ok(nothing(BacklashVerdict::TooShort));
    };
    let half = settings.levels as i32;
    let spacing = REACH * rms(signals.load) / f64::from(half);
    let ratio = settings.range.1 / settings.range.0;
    let gaps: Vec<f64> = (0..settings.gaps)
        .map(|k| settings.range.0 * ratio.powf(k as f64 / (settings.gaps - 1) as f64))
        .collect();
    let widest = WIDEST * rms(signals.load);
    let tolerance = likelihood.slow_rms.min(widest).max(spacing) * (1.0 + 1e-9);
    let shares: Vec<f64> = (0..settings.shares).map(|k| k as f64 / (settings.shares - 1) as f64).collect();
    let mut candidates = Vec::new();
    for level in -half..=half {
        let level = spacing * f64::from(level);
        let tried: &[f64] = if level.abs() <= tolerance { &shares } else { &[0.0] };
        for share in tried {
            candidates.extend(gaps.iter().map(|gap| Candidate { share: *share, level, gap: *gap }));
        }
    }
    let trials = likelihood.of(signals, &candidates);
    let at_zero: Vec<Trial> =
        trials.iter().filter(|t| t.candidate.level.abs() <= tolerance).copied().collect();
    let Some(first) = most_likely(&at_zero) else {
        return Ok(nothing(BacklashVerdict::NoCrossings));
    };
    let near = near(&at_zero, &gaps, spacing, shares[1]);
    let near = likelihood.of(signals, &near);
    let best = most_likely(&near).unwrap_or(first);

    // A share of friction moves the parting in one direction to the one side, in the other to the other: loads at which the
    // trace of a true gap would show.
    let moved = if best.evidence() > BELIEVED { best.share() * rms(signals.friction) } else { 0.0 };
    let away = |moved: f64| -> Option<f64> {
        let far = |t: &Trial, m: f64| (t.candidate.level.abs() - m).abs() > AWAY * tolerance;
        let placebos: Vec<Trial> = trials.iter().filter(|t| far(t, 0.0) && far(t, moved)).copied().collect();
        most_likely(&placebos).map(Trial::evidence)
    };
    let elsewhere = away(moved);
    // Without placebos nothing is believed.
    let bar = |e: Option<f64>| e.map_or(f64::INFINITY, |e| BELIEVED.max(BEYOND_PLACEBOS * e));
    let doubt = SURE.max(elsewhere.unwrap_or(0.0)).powi(2);

    let steps = (ratio.ln() / (settings.gaps - 1) as f64 / FINER.ln()).ceil() as i32;
    let mut finer = Vec::new();
    for share in (-2..=2).map(|k| best.share() + shares[1] * f64::from(k) / f64::from(STEPS)) {
        for level in (-1..=1).map(|l| best.candidate.level + spacing * f64::from(l) / f64::from(STEPS)) {
            let gaps = (-steps..=steps).map(|k| best.candidate.gap * FINER.powi(k));
            finer.extend(gaps.map(|gap| Candidate { share: share.clamp(0.0, 1.0), level, gap }));
        }
    }
    let finer = likelihood.of(signals, &finer);
    let best = most_likely(&finer).unwrap_or(best);
    let alike = at_zero.iter().chain(&near).chain(&finer);
    let alike = alike.filter(|t| t.told() && t.ratio >= best.ratio - doubt && t.ratio > 0.0);
    let (low, high) = alike.fold((best.candidate.gap, best.candidate.gap), |(low, high), t| {
        (low.min(t.candidate.gap), high.max(t.candidate.gap))
    });
    let interval = (low / MODEL_ERROR, high * MODEL_ERROR);

    let needed = (bar(away(0.0)) + LUCK).powi(2);
    let ruled_out = |gap: f64| {
        let mut of_gap = at_zero.iter().filter(|t| t.candidate.gap == gap && t.share() == 0.0);
        of_gap.clone().any(Trial::told) && of_gap.all(|t| !t.told() || t.ratio < -needed)
    };
    let timed = smallest_timed(signals, &likelihood, spacing);
    let would_show = gaps.iter().rev().take_while(|gap| **gap >= timed && ruled_out(**gap)).last().copied();
    let evidence = best.evidence();
    let believed = evidence > bar(elsewhere) && best.candidate.gap < settings.range.1;
    let profile = (-half..=half)
        .map(|level| spacing * f64::from(level))
        .map(|level| {
            let here = trials.iter().filter(|t| t.candidate.level == level).copied().collect::<Vec<_>>();
            (level, most_likely(&here).map_or(0.0, Trial::evidence))
        })
        .collect();
    Ok(BacklashEstimate {
        verdict: if believed { BacklashVerdict::Found } else { BacklashVerdict::NotFound },
        gap: best.candidate.gap,
        interval,
        evidence,
        elsewhere,
        share: best.candidate.share,
        path: best.path,
        crossings: best.crossings,
        would_show,
        profile,
    })
}

/// Gap below which the time of flight is shorter than the load's zero is known, `ε³/(6 J s²)`: along a load of slope `s` a gap `g` is
/// crossed in `(6 J g/s)^(1/3)`, and an error `ε` of the load moves the crossing by `ε/s`. Medians over changes of the load's sign.
fn smallest_timed(signals: &BacklashSignals<'_>, likelihood: &Likelihood, spacing: f64) -> f64 {
    let changes: Vec<usize> = (1..signals.load.len())
        .filter(|k| likelihood.used[*k] && signals.load[k - 1] * signals.load[*k] <= 0.0)
        .collect();
    let of = |signal: &dyn Fn(usize) -> f64| median(&changes.iter().map(|k| signal(*k)).collect::<Vec<_>>());
    let slope = of(&|k| (signals.load[k] - signals.load[k - 1]).abs() / signals.step_s);
    match (slope, of(&|k| signals.inertia[k])) {
        (Some(slope), Some(inertia)) if slope > 0.0 => {
            spacing.max(likelihood.slow_rms).powi(3) / (6.0 * inertia * slope * slope)
        }
        _ => f64::INFINITY,
    }
}

/// Candidates beside the likeliest of every gap of a scan: finer shares of friction and finer loads at which flanks part.
fn near(scanned: &[Trial], gaps: &[f64], spacing: f64, share: f64) -> Vec<Candidate> {
    let mut out = Vec::new();
    for gap in gaps {
        let of_gap: Vec<Trial> = scanned.iter().filter(|t| t.candidate.gap == *gap).copied().collect();
        let Some(first) = most_likely(&of_gap) else { continue };
        for k in -STEPS..=STEPS {
            let share = first.share() + share * f64::from(k) / f64::from(STEPS);
            if !(0.0..=1.0).contains(&share) {
                continue;
            }
            out.extend((-STEPS..=STEPS).map(|l| {
                let level = first.candidate.level + spacing * f64::from(l) / f64::from(STEPS);
                Candidate { share, level, gap: *gap }
            }));
        }
    }
    out
}

/// Of those with enough crossings.
fn most_likely(trials: &[Trial]) -> Option<&Trial> {
    trials.iter().filter(|t| t.told()).reduce(|best, t| if t.ratio > best.ratio { t } else { best })
}

fn check(signals: &BacklashSignals<'_>, settings: &BacklashSettings) -> Result<(), BacklashError> {
    let n = signals.residual.len();
    let lengths = [signals.load, signals.friction, signals.inertia, signals.velocity].map(<[f64]>::len);
    if let Some(found) = lengths.into_iter().chain([signals.counted.len()]).find(|length| *length != n) {
        return Err(BacklashError::Lengths { expected: n, found });
    }
    let finite = |k: &usize| {
        let all = [signals.residual, signals.load, signals.friction, signals.velocity];
        all.iter().all(|s| s[*k].is_finite()) && signals.inertia[*k].is_finite() && signals.inertia[*k] > 0.0
    };
    if let Some(row) = (0..n).find(|k| !finite(k)) {
        return Err(BacklashError::BadSample { row });
    }
    let demand =
        |holds: bool, expected| if holds { Ok(()) } else { Err(BacklashError::Setting { expected }) };
    let (low, high) = settings.range;
    demand(low > 0.0 && high > low && high.is_finite(), "a range of gaps above 0")?;
    demand(settings.gaps >= 2 && settings.levels >= 1, "at least two gaps and one level")?;
    let sound = |path: &Path| path.loop_hz >= 0.0 && path.flank_hz > 0.0;
    demand(settings.paths.iter().all(sound), "bandwidths of the loop from 0 on and of the flanks above 0")?;
    demand(!settings.paths.is_empty() && settings.shares >= 2, "a path and two shares of friction")?;
    demand(signals.step_s > 0.0 && signals.step_s.is_finite(), "a time between samples above 0")?;
    let highest = 0.5 / signals.step_s;
    demand(signals.state_hz > 0.0 && signals.state_hz < highest, "states below half the sample rate")
}
