//! Whether efforts have the size that a robot like this one asks for. No log tells the unit of all efforts together: bodies of any
//! mass move alike. The robot file, effort limits and the arms that exist do.

use dynid_model::{EffortModel, Mechanism};
use dynid_rows::preflight::{AgainstStated, GaussianPrior, Trial, Wiring, against_stated, efforts_at_rest};

use super::bench::Bench;
use crate::Error;
use crate::effort_scale::{G, GRAVITY_SHARE};
use crate::finding::{FindingId, Findings, Fix, Severity};
use crate::prior::Prior;

/// Efforts this many times larger or smaller than expected are worth a word ...
const WARN: f64 = 2.5;
/// ... and from here on in another unit.
const OTHER_UNIT: f64 = 8.0;
/// Share of the samples in which a joint has to move for its gravity to be called too small.
const MOVES: f64 = 0.5;
/// Stated inertias that leave more of the efforts' variance unexplained say nothing where gravity does not act.
const STATED: f64 = 0.3;
/// Mass over the cube of the reach that gravity shows on arms, kg/m³, with room to either side: six arms of 0.9 to 1.4 m, from 18 to 34 kg,
/// show 3 to 19 on their logs.
const ARMS: (f64, f64) = (1.5, 40.0);
/// Factors of all efforts at which bodies are looked for.
const SIZES: [f64; 6] = [0.1, 10.0, 1e-2, 1e2, 1e-3, 1e3];
/// A misfit is clearly less if it falls to this share, and by so much.
const CLEARLY: (f64, f64) = (0.6, 40.0);
/// Least share of the largest effort that gravity must have to tell of the arm.
const GRAVITY_OF_EFFORT: f64 = 0.05;
/// Gravity is upside down if its efforts correlate like this with those that are expected.
const OPPOSITE: f64 = -0.5;
/// Bodies tell of gravity where they leave at most this share of the efforts (root mean square) unexplained.
const EXPLAINED: f64 = 0.1;
/// Gravity whose size deviates from that on Earth by more than this is in question.
const OTHER_SIZE: f64 = 0.02;
/// Bodies as they are known speak for another gravity from this difference of misfits on: natural logarithms of odds, twice.
const BETTER: f64 = 8.0;
/// Fewest joints that carry each other in an arm.
const ARM_JOINTS: usize = 3;
/// A ratio this close to a power of ten (its decimal logarithm) is a unit.
const A_UNIT: f64 = 0.15;

/// How the search took a log, and what it left open.
pub(super) struct Taken {
    /// Velocities go with positions.
    pub(super) velocities: bool,
    /// The configuration states that the efforts are right.
    pub(super) known: bool,
    /// The factor of all efforts that the wiring has already.
    pub(super) applied: f64,
    /// Share of the efforts (root mean square) that is left unexplained.
    pub(super) unexplained: f64,
}

/// Efforts against what one source expects of them.
struct Evidence {
    /// Logged over expected; 1 within the range of a source that states one.
    ratio: f64,
    words: String,
}

impl Evidence {
    fn off(&self) -> f64 {
        self.ratio.max(1.0 / self.ratio)
    }
}

/// Compares efforts with the bodies of the robot file; where it has none that count, with effort limits and with arms that exist.
///
/// # Errors
/// [`Error`] if a regressor is not finite.
pub(super) fn examine(
    bench: &Bench,
    trial: &Trial<'_>,
    wiring: &mut Wiring,
    prior: &Prior,
    taken: &Taken,
    out: &mut Findings<'_>,
) -> Result<(), Error> {
    let Taken { velocities, known, applied, unexplained } = *taken;
    let Some(mut identified) = at_any_size(trial, wiring) else { return Ok(()) };
    identified.iter_mut().for_each(|x| *x /= applied);
    let bodies = 10 * prior.bodies.len();
    identified[bodies..].fill(0.0);
    let mut stated = prior.values.clone();
    stated[bodies..].fill(0.0);
    let at_rest = |values: &[f64]| efforts_at_rest(trial, wiring, values);
    let (identified, stated) = (at_rest(&identified), at_rest(&stated));
    // A model that leaves much may have its bodies anywhere; other efforts were taken already for another size.
    let tells_gravity = unexplained < EXPLAINED && applied == 1.0;
    if tells_gravity
        && is_opposite(prior, &identified, &stated)
        && upside_down(bench, trial, wiring, prior, out)
    {
        return Ok(());
    }
    let file = match prior.states_bodies() {
        true => from_file(bench, trial, (wiring, applied), prior, (&identified, &stated))?,
        false => None,
    };
    let limits = from_limits(bench, trial, wiring, applied);
    // What stands still, or for most of the time, may stand where gravity does not act.
    let all_move = trial.moves.iter().all(|m| *m);
    let passes_gravity =
        |joint: usize| all_move && trial.samples.sliding_share(wiring.position[joint].joint) >= MOVES;
    let efforts = trial.samples.efforts(wiring);
    let arm = density(bench, &identified).and_then(|(found, joint)| {
        // Springs, offsets, or an axis that stands upright may leave gravity nothing to do.
        let of_gravity = peak(&identified[joint]) * applied.abs() > GRAVITY_OF_EFFORT * peak(&efforts[joint]);
        let least = if passes_gravity(joint) { ARMS.0 } else { 0.0 };
        of_gravity.then(|| Evidence {
            ratio: if found < least { found / least } else { (found / ARMS.1).max(1.0) },
            words: format!(
                "gravity at `{}` asks for {found:.3e} kg per cube of the reach in m, arms that exist for {} to {}",
                bench.model.outputs()[joint].name,
                ARMS.0,
                ARMS.1
            ),
        })
    });
    let judged = match &file {
        Some(file) => Some(file),
        None => limits.iter().chain(&arm).max_by(|a, b| a.off().total_cmp(&b.off())),
    };
    let Some(judged) = judged.filter(|e| e.off() >= WARN) else { return Ok(()) };
    let (ratio, off) = (judged.ratio, judged.off());
    if tells_gravity && file.is_some() && other_gravity(bench, trial, wiring, prior, out) {
        return Ok(());
    }
    let words: Vec<&str> = [&file, &limits, &arm].into_iter().flatten().map(|e| e.words.as_str()).collect();
    let evidence = words.join("; ");
    if known {
        let remedy =
            "nothing: the configuration states that the size of the efforts is right (`known_effort_scale`)";
        out.add(FindingId::DriveGain, Severity::Info, None, evidence, remedy);
        return Ok(());
    }
    let severity = if off >= OTHER_UNIT { Severity::Error } else { Severity::Warning };
    let remedy = "state the unit or the drive gains of the efforts, or put right the masses of the robot file (efforts without gravity are \
                  no efforts of the joints either); if the efforts are right, say so: `known_effort_scale = true` (`--known-effort-scale`)";
    let finding = out.add(FindingId::DriveGain, severity, None, evidence, remedy);
    let order = ratio.log10().round();
    if severity == Severity::Error && file.is_some() && order != 0.0 && (ratio.log10() - order).abs() < A_UNIT
    {
        wiring.effort.iter_mut().for_each(|e| e.factor *= 10f64.powf(-order) / applied);
        finding.fixes = vec![Fix::Wiring { wiring: wiring.clone(), velocities }];
    }
    Ok(())
}

/// Whether bodies pull the other way than those of the robot file do: bodies mirrored at their joints explain gravity that is upside down.
fn is_opposite(prior: &Prior, identified: &[Vec<f64>], stated: &[Vec<f64>]) -> bool {
    let weight: f64 = prior.bodies.iter().map(|b| G * b.inertia.mass() * b.size).sum();
    let (found, expected) = (rms(identified), rms(stated));
    let count = stated.iter().map(Vec::len).sum::<usize>() as f64;
    let product: f64 = identified.iter().flatten().zip(stated.iter().flatten()).map(|(a, b)| a * b).sum();
    expected > GRAVITY_SHARE * weight && product < OPPOSITE * count * found * expected
}

/// Whether the log is a better one of the bodies that are known under another gravity. Offsets may stand for gravity where little moves: then bodies
/// may as well be those of the file.
fn is_clearly_better(trial: &Trial<'_>, wiring: &Wiring, gravity: [f64; 3]) -> bool {
    let believing = Trial { prior: GaussianPrior { weight: 1.0, ..trial.prior }, ..*trial };
    let misfit = |wiring: &Wiring| believing.parameters(wiring).map(|(_, misfit)| misfit);
    let other = Wiring { gravity: Some(gravity), ..wiring.clone() };
    misfit(wiring).zip(misfit(&other)).is_some_and(|(stated, other)| other < stated - BETTER)
}

fn upside_down(
    bench: &Bench,
    trial: &Trial<'_>,
    wiring: &Wiring,
    prior: &Prior,
    out: &mut Findings<'_>,
) -> bool {
    let gravity = wiring.gravity.unwrap_or(bench.gravity).map(|g| -g);
    if !is_clearly_better(trial, wiring, gravity) {
        return false;
    }
    let told = prior.states_bodies();
    let bodies = if told { "that the robot file states" } else { "half way along its links" };
    let evidence = format!(
        "gravity pulls the other way than on bodies {bodies}: gravity points the other way, or all efforts and positions count the other way"
    );
    let remedy =
        "state gravity in base axes (`gravity`): the robot is mounted another way than the file says";
    let severity = if told { Severity::Error } else { Severity::Warning };
    let finding = out.add(FindingId::BaseTilt, severity, None, evidence, remedy);
    if told {
        finding.fixes = vec![Fix::Gravity(gravity)];
    }
    true
}

/// Whether efforts have the size that the robot file asks for under gravity that points the other way, or is as strong as on Earth.
fn other_gravity(
    bench: &Bench,
    trial: &Trial<'_>,
    wiring: &Wiring,
    prior: &Prior,
    out: &mut Findings<'_>,
) -> bool {
    let stated = wiring.gravity.unwrap_or(bench.gravity);
    let size = stated.iter().map(|g| g * g).sum::<f64>().sqrt();
    if size == 0.0 {
        return false;
    }
    let mut others = vec![(FindingId::BaseTilt, stated.map(|g| -g))];
    if (size / G - 1.0).abs() > OTHER_SIZE {
        others.push((FindingId::GravitySize, stated.map(|g| g * G / size)));
    }
    let bodies = 10 * prior.bodies.len();
    let told = others.into_iter().find_map(|(id, gravity)| {
        let changed = Wiring { gravity: Some(gravity), ..wiring.clone() };
        let of_bodies = |values: &[f64]| {
            let mut values = values.to_vec();
            values[bodies..].fill(0.0);
            efforts_at_rest(trial, &changed, &values)
        };
        let (found, expected) = (of_bodies(&at_any_size(trial, &changed)?), of_bodies(&prior.values));
        let ratio = rms(&found) / rms(&expected);
        let told = ratio.max(1.0 / ratio) < WARN && is_clearly_better(trial, wiring, gravity);
        told.then_some((id, gravity, ratio))
    });
    let Some((id, gravity, ratio)) = told else { return false };
    let evidence = format!(
        "under gravity ({:.2}, {:.2}, {:.2}) m/s² efforts are {ratio:.2} times those of the bodies that the robot file states; as stated, they are not",
        gravity[0], gravity[1], gravity[2]
    );
    out.add(id, Severity::Error, None, evidence, "state gravity in base axes (`gravity`), m/s²").fixes =
        vec![Fix::Gravity(gravity)];
    true
}

/// Doubts gravity of another size than on Earth, unless the log bears it out against that of the Earth.
pub(super) fn gravity_size(
    bench: &Bench,
    trial: &Trial<'_>,
    wiring: &Wiring,
    misfit: f64,
    out: &mut Findings<'_>,
) {
    let size = bench.gravity.iter().map(|g| g * g).sum::<f64>().sqrt();
    if size == 0.0 || (size / G - 1.0).abs() <= OTHER_SIZE || wiring.gravity.is_some() {
        return;
    }
    let on_earth = Wiring { gravity: Some(bench.gravity.map(|g| g * G / size)), ..wiring.clone() };
    let borne_out = trial.parameters(&on_earth).is_some_and(|(_, other)| other > misfit + CLEARLY.1);
    if !borne_out {
        let evidence = format!(
            "gravity is stated as {size:.3} m/s²; the log explains as well by the {G} m/s² of the Earth"
        );
        out.add(
            FindingId::GravitySize,
            Severity::Warning,
            None,
            evidence,
            "state gravity in base axes (`gravity`), m/s²",
        );
    }
}

/// Parameters that explain a wiring best, its efforts of any size: a prior of bodies would keep those of another unit small.
fn at_any_size(trial: &Trial<'_>, wiring: &Wiring) -> Option<Vec<f64>> {
    let explained = trial.parameters_by_size(wiring)?;
    let (x, misfit) = explained(1.0)?;
    if misfit <= CLEARLY.1 {
        // Nothing can be so much better.
        return Some(x);
    }
    let sized = |factor: f64| {
        let (mut x, misfit) = explained(factor)?;
        x.iter_mut().for_each(|x| *x /= factor);
        Some((x, misfit))
    };
    let other = SIZES.into_iter().filter_map(sized).min_by(|a, b| a.1.total_cmp(&b.1));
    // As large a gain as a difference of columns must have: friction alone is of any size.
    let better = other.filter(|(_, other)| *other < CLEARLY.0 * misfit && misfit - other > CLEARLY.1);
    Some(better.map_or(x, |(x, _)| x))
}

fn rms(signals: &[Vec<f64>]) -> f64 {
    let count = signals.iter().map(Vec::len).sum::<usize>().max(1) as f64;
    (signals.iter().flatten().map(|x| x * x).sum::<f64>() / count).sqrt()
}

/// Gravity of the identified bodies against that of the stated ones, over all joints; without gravity, all their efforts.
fn from_file(
    bench: &Bench,
    trial: &Trial<'_>,
    (wiring, applied): (&Wiring, f64),
    prior: &Prior,
    (identified, stated): (&[Vec<f64>], &[Vec<f64>]),
) -> Result<Option<Evidence>, Error> {
    let (found, expected) = (rms(identified), rms(stated));
    let weight: f64 = prior.bodies.iter().map(|b| G * b.inertia.mass() * b.size).sum();
    if expected > GRAVITY_SHARE * weight && found > 0.0 {
        let ratio = found / expected;
        let words = format!(
            "gravity asks for {ratio:.3e} times the effort of the bodies that the robot file states (root mean square over all joints \
             {found:.3e} against {expected:.3e})"
        );
        return Ok(Some(Evidence { ratio, words }));
    }
    let each = against_stated(
        &bench.model,
        &bench.shape,
        trial.samples,
        wiring,
        10 * prior.bodies.len(),
        &prior.values,
    )?;
    let explains =
        |f: &AgainstStated| f.ratio > 0.0 && f.unexplained < STATED && f.unexplained < 0.5 * f.elements_alone;
    let mut told: Vec<f64> = each.into_iter().flatten().filter(explains).map(|f| f.ratio / applied).collect();
    if told.len() < 2.min(wiring.effort.len()) {
        return Ok(None);
    }
    told.sort_by(f64::total_cmp);
    let ratio = told[told.len() / 2];
    let words = format!(
        "efforts of {} joints are {:.3e} to {:.3e} times those of the bodies that the robot file states",
        told.len(),
        told[0],
        told[told.len() - 1]
    );
    Ok(Some(Evidence { ratio, words }))
}

/// Largest efforts against effort limits, the median over the joints; limits that are all alike are placeholders.
fn from_limits(bench: &Bench, trial: &Trial<'_>, wiring: &Wiring, applied: f64) -> Option<Evidence> {
    let efforts = trial.samples.efforts(wiring);
    let mut shares: Vec<(f64, f64)> = efforts
        .iter()
        .enumerate()
        .filter_map(|(j, effort)| {
            let limit = bench.model.limits(j).effort.filter(|l| l.is_finite() && *l > 0.0)?;
            Some((effort.iter().fold(0.0_f64, |m, x| m.max(x.abs())) / limit, limit))
        })
        .collect();
    let alike = shares.len() > 1 && shares.iter().all(|(_, limit)| *limit == shares[0].1);
    if shares.is_empty() || alike {
        return None;
    }
    shares.sort_by(|a, b| a.0.total_cmp(&b.0));
    let middle = shares[shares.len() / 2].0 / applied;
    let words = format!(
        "efforts reach {middle:.3e} times the effort limits of the robot file (median over {} joints)",
        shares.len()
    );
    // A robot may move as slowly and lightly as it likes.
    Some(Evidence { ratio: middle.max(1.0), words })
}

/// Mass over the cube of the reach that the largest effort of gravity asks for if the mass sits half way out, kg/m³, and the joint.
fn density(bench: &Bench, at_rest: &[Vec<f64>]) -> Option<(f64, usize)> {
    let tree = bench.tree()?;
    let depth = |mut body: usize| {
        let mut joints = 1;
        while let Some(parent) = tree.bodies()[body].parent {
            (body, joints) = (parent, joints + 1);
        }
        joints
    };
    if (0..tree.bodies().len()).map(depth).max().is_none_or(|joints| joints < ARM_JOINTS) {
        return None;
    }
    let (joint, effort) = at_rest
        .iter()
        .map(|signal| peak(signal))
        .enumerate()
        .filter(|(j, _)| !bench.slides[*j])
        .max_by(|a, b| a.1.total_cmp(&b.1))?;
    let reach = reach(tree, *tree.rate_bodies().get(joint)?);
    (reach > 0.0 && effort > 0.0).then(|| (effort / (G * 0.5 * reach) / reach.powi(3), joint))
}

fn peak(signal: &[f64]) -> f64 {
    signal.iter().fold(0.0, |m, x| m.max(x.abs()))
}

/// Way from a body's joint to the end of what it carries, m: to the farthest joint, and once more the last part of that way, since no robot
/// file states how long the last link is.
fn reach(tree: &Mechanism, body: usize) -> f64 {
    fn farthest(tree: &Mechanism, body: usize) -> (f64, f64) {
        let carried = tree.bodies().iter().enumerate().filter(|(_, b)| b.parent == Some(body));
        let ways = carried.map(|(k, b)| {
            let own = b.joint.placement.translation.norm();
            let (way, last) = farthest(tree, k);
            (own + way, if last > 0.0 { last } else { own })
        });
        ways.fold((0.0, 0.0), |far, way| if way.0 > far.0 { way } else { far })
    }
    let (way, last) = farthest(tree, body);
    way + last
}
