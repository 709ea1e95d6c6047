//! From points to the law that they can carry.

use super::form::{LawForm, ViscousForm};
use super::law::{CurveError, FrictionLaw};
use super::levels::{mean, speed_levels, temperature_levels};
use super::lines::{ThermalLine, line};
use super::solve::{Rows, Solved, solve};
use super::{SteadyError, SteadyPoint, SteadySettings};
use dynid_estimate::covariance::{
    BlockLengthSettings, BlockLengthStatus, MIN_BLOCKS, ResidualSignal, block_length,
};

/// Gain of AICc that a law with more coefficients must bring.
const GAIN: f64 = 2.0;
/// Speeds below so many `v_s` show the fall of static friction.
const STRIBECK_REACH: f64 = 3.0;
/// Least speeds in that reach.
const STRIBECK_SPEEDS: usize = 2;
/// Coefficients of lines.
const LINES: [&str; 3] = ["sigma2", "sigma3", "sigma4"];
/// What all temperatures share in the common fit.
const COMMON: [&str; 4] = ["fc", "fs", "vs", "fo"];

/// A law that was tried.
#[derive(Debug, Clone, PartialEq)]
pub struct Rung {
    /// Terms of the law.
    pub form: LawForm,
    /// Fit, if there was one.
    pub error: Option<CurveError>,
    /// Corrected Akaike criterion, smaller is better; `None` without a fit or with too few points for it.
    pub aicc: Option<f64>,
    /// Why it is no candidate.
    pub refused: Option<String>,
    /// Whether it was taken.
    pub chosen: bool,
}

/// What the points of one temperature say.
#[derive(Debug, Clone, PartialEq)]
pub struct LevelFit {
    /// Mean temperature, °C.
    pub temperature: f64,
    /// Points, as indices.
    pub points: Vec<usize>,
    /// Law of this temperature alone; `None` with too few speeds for it.
    pub own: Option<FrictionLaw>,
    /// How far that is from its points.
    pub own_error: Option<CurveError>,
    /// Law of this temperature in the common fit, in which all temperatures share `F_c, F_s, v_s`.
    pub common: Option<FrictionLaw>,
}

/// A friction law and how it came about.
#[derive(Debug, Clone, PartialEq)]
pub struct SteadyFriction {
    /// The law: with lines inside where temperatures allow it (the global fit).
    pub law: FrictionLaw,
    /// How far it is from the points.
    pub error: CurveError,
    /// Residual of every point, N m or N.
    pub residuals: Vec<f64>,
    /// Standard error that every point counted with, N m or N.
    pub std: Vec<f64>,
    /// Laws that were tried, simplest first.
    pub ladder: Vec<Rung>,
    /// Per temperature, coldest first; empty without lines.
    pub levels: Vec<LevelFit>,
    /// How far the common fit is from the points.
    pub common_error: Option<CurveError>,
    /// Lines through the coefficients of the common fit; empty without lines.
    pub lines: Vec<ThermalLine>,
    /// Factor of standard deviations to intervals: Student's quantile of the residuals' degrees of freedom; of a series, of its
    /// blocks of time less one.
    pub quantile: f64,
    /// What the points could not tell, in words.
    pub notes: Vec<String>,
}

/// Finds the law that the points can carry, and its dependence on temperature.
///
/// # Errors
/// [`SteadyError`]: fewer than three distinct speeds, values that are not finite, a law asked for that the points cannot
/// carry. A law that is chosen simpler than hoped for is a result: [`SteadyFriction::notes`] and
/// [`SteadyFriction::ladder`] say why.
pub fn analyse(points: &[SteadyPoint], settings: &SteadySettings) -> Result<SteadyFriction, SteadyError> {
    check(points)?;
    let mut notes = Vec::new();
    let rows = rows(points, settings);
    let levels = match points.iter().map(|p| p.temperature).collect::<Option<Vec<f64>>>() {
        Some(t) => temperature_levels(&t, settings.level_tolerance),
        None => {
            notes.push(
                "no temperature is logged: the law holds for the temperature of the test alone, and what changes between a \
                 cold and a warm joint (up to half of its friction) is not in it"
                    .to_owned(),
            );
            vec![(0..points.len()).collect()]
        }
    };
    let known = notes.is_empty();
    let thermal = known && thermal_levels(&rows, &levels, settings, &mut notes);
    let (mut solved, ladder) = climb(&rows, thermal, settings, &mut notes)?;
    let error = solved.error();
    let mut freedom = error.freedom;
    if settings.series {
        let block = time_block(&solved.residuals[0], &mut notes);
        freedom = rows.len().div_ceil(block).saturating_sub(1);
        let form = solved.laws[0].form;
        solved = solve(std::slice::from_ref(&rows), &form, &[], Some(block), settings)?;
    }
    let law = solved.laws[0].clone();
    let quantile =
        dynid_estimate::distribution::t_quantile(0.5 + 0.5 * settings.confidence, freedom.max(1) as f64)
            .unwrap_or(f64::NAN);
    let mut out = SteadyFriction {
        error,
        residuals: solved.residuals.concat(),
        std: rows.std.clone(),
        ladder,
        levels: Vec::new(),
        common_error: None,
        lines: Vec::new(),
        quantile,
        notes,
        law,
    };
    if out.law.form.has_lines() {
        by_temperature(&mut out, &rows, levels, settings);
    }
    Ok(out)
}

fn check(points: &[SteadyPoint]) -> Result<(), SteadyError> {
    for (index, p) in points.iter().enumerate() {
        let values = [
            ("speed", p.speed),
            ("temperature", p.temperature.unwrap_or(0.0)),
            ("friction", p.friction),
            ("standard error", p.std),
        ];
        for (what, found) in values {
            if !found.is_finite() || (what == "standard error" && found < 0.0) {
                return Err(SteadyError::NotFinite { index, what, found });
            }
        }
    }
    Ok(())
}

fn rows(points: &[SteadyPoint], settings: &SteadySettings) -> Rows {
    let mut sizes: Vec<f64> = points.iter().map(|p| p.friction.abs()).collect();
    sizes.sort_by(f64::total_cmp);
    let floor = (settings.floor * sizes.get(sizes.len() / 2).copied().unwrap_or(0.0)).max(1e-12);
    Rows {
        speed: points.iter().map(|p| p.speed).collect(),
        temperature: points.iter().map(|p| p.temperature.unwrap_or(settings.reference_temperature)).collect(),
        friction: points.iter().map(|p| p.friction).collect(),
        std: points.iter().map(|p| p.std.max(floor)).collect(),
    }
}

/// Whether temperatures allow lines.
fn thermal_levels(
    rows: &Rows,
    levels: &[Vec<usize>],
    settings: &SteadySettings,
    notes: &mut Vec<String>,
) -> bool {
    if !settings.thermal {
        return false;
    }
    let (low, high) = rows.range();
    let enough = levels.len() >= 2 && high - low >= settings.least_span;
    if !enough {
        notes.push(format!(
            "temperatures from {low:.1} to {high:.1} degC: slopes over temperature are not estimable, they are held at zero \
             (a span of {} K is needed)",
            settings.least_span
        ));
    }
    enough
}

/// Fits the laws of the ladder and takes one.
fn climb(
    rows: &Rows,
    thermal: bool,
    settings: &SteadySettings,
    notes: &mut Vec<String>,
) -> Result<(Solved, Vec<Rung>), SteadyError> {
    let parts = [rows.clone()];
    let speeds = speed_levels(rows.speed.iter().copied());
    let simplest = LawForm::LADDER[0].speeds_needed();
    if speeds < simplest {
        return Err(SteadyError::TooFew { expected: simplest, found: speeds });
    }
    let forms: Vec<LawForm> = match settings.form {
        Some(form) => vec![LawForm { thermal: form.thermal && thermal, offset: settings.offset, ..form }],
        None => LawForm::LADDER
            .into_iter()
            .flat_map(|form| {
                let lines = thermal && form.viscous == ViscousForm::Exponential;
                [Some(form), lines.then_some(LawForm { thermal: true, ..form })]
            })
            .flatten()
            .map(|form| LawForm { offset: settings.offset, ..form })
            .collect(),
    };
    let mut ladder = Vec::new();
    let mut best: Option<(f64, usize, Solved)> = None;
    let mut samples = None;
    for form in forms {
        let mut rung = Rung { form, error: None, aicc: None, refused: None, chosen: false };
        if speeds < form.speeds_needed() {
            rung.refused = Some(format!("needs {} speeds, there are {speeds}", form.speeds_needed()));
            ladder.push(rung);
            continue;
        }
        let solved = solve(&parts, &form, &[], None, settings)?;
        let effective = *samples.get_or_insert_with(|| match settings.series {
            true => independent(&solved.residuals[0]),
            false => rows.len() as f64,
        });
        rung.error = Some(solved.error());
        rung.aicc = aicc(&solved, effective);
        rung.refused = refusal(&solved.laws[0], rows, settings.series);
        if let (Some(value), None) = (rung.aicc, &rung.refused)
            && best.as_ref().is_none_or(|(least, ..)| value < least - GAIN)
        {
            best = Some((value, ladder.len(), solved));
        }
        ladder.push(rung);
    }
    let Some((_, chosen, solved)) = best else {
        let reasons: Vec<String> = ladder
            .iter()
            .map(|r| format!("{}: {}", r.form, r.refused.as_deref().unwrap_or("too few points")))
            .collect();
        return Err(SteadyError::Unsupported(reasons.join("; ")));
    };
    ladder[chosen].chosen = true;
    let taken = ladder[chosen].form;
    if !taken.stribeck
        && let Some(reason) = ladder.iter().filter(|r| r.form.stribeck).find_map(|r| r.refused.as_ref())
    {
        notes.push(format!("static friction F_s and Stribeck speed v_s are not estimable: {reason}"));
    }
    if let (Some(fs), Some(fc)) = (solved.laws[0].value("fs"), solved.laws[0].value("fc"))
        && fs <= fc
    {
        notes.push(format!(
            "friction rises from {fs:.3} near rest to {fc:.3}: reversals are smeared (bending bristles, filters, noise of the \
             speed), F_s is no static friction"
        ));
    }
    if thermal && !taken.has_lines() {
        notes.push("the points do not show that friction changes with temperature".to_owned());
    }
    Ok((solved, ladder))
}

fn aicc(solved: &Solved, samples: f64) -> Option<f64> {
    let k = solved.coefficients as f64 + 1.0;
    let left = samples - k - 1.0;
    let variance = (solved.chi_squared / solved.rows as f64).max(1e-12);
    (left > 0.0).then(|| samples * variance.ln() + 2.0 * k + 2.0 * k * (k + 1.0) / left)
}

/// Samples of a block of time after which residuals of a series count as independent, at most a tenth of the series.
fn time_block(residual: &[f64], notes: &mut Vec<String>) -> usize {
    let signal = ResidualSignal { log: 0, rate_hz: 1.0, residual };
    let found = block_length(&[signal], &BlockLengthSettings::default());
    let wanted = found.seconds.ceil() as usize;
    if let BlockLengthStatus::TooShort { .. } = found.status {
        notes.push(format!(
            "the residual stays correlated for so long that a block of time takes {wanted} samples, found {} for {MIN_BLOCKS} blocks: \
             standard deviations are somewhat too small",
            residual.len() / MIN_BLOCKS
        ));
    }
    wanted.min(residual.len() / MIN_BLOCKS).max(1)
}

/// Samples of a series that count as independent: one per correlation time of the residual.
fn independent(residual: &[f64]) -> f64 {
    let n = residual.len() as f64;
    let energy: f64 = residual.iter().map(|r| r * r).sum();
    let mut time = 1.0;
    let mut lag = 1;
    while lag < residual.len() / 4 {
        let r = residual.iter().zip(&residual[lag..]).map(|(a, b)| a * b).sum::<f64>() / energy.max(1e-300);
        if r < 0.05 {
            break;
        }
        // Long correlations are sampled more and more coarsely: it is their order of size that counts.
        let step = (lag / 16).max(1);
        time += 2.0 * r * step as f64;
        lag += step;
    }
    n / time
}

/// Why a fitted law is no candidate.
fn refusal(law: &FrictionLaw, rows: &Rows, series: bool) -> Option<String> {
    if law.value("fc").is_some_and(|fc| fc < 0.0) {
        return Some("its Coulomb friction is negative".to_owned());
    }
    if let (Some(vs), Some(fs), Some(fc)) = (law.value("vs"), law.value("fs"), law.value("fc")) {
        let reach = STRIBECK_REACH * vs;
        let below = speed_levels(rows.speed.iter().copied().filter(|v| v.abs() < reach));
        if below < STRIBECK_SPEEDS {
            return Some(format!(
                "{} below 3 v_s = {reach:.3}",
                if below == 0 { "no points".to_owned() } else { "points at one speed only".to_owned() }
            ));
        }
        // A signal passes through reversals, where friction has yet to build up: it may rise from rest.
        if fs <= fc && !(series && fs >= 0.0) {
            return Some("friction does not fall with speed near rest".to_owned());
        }
    }
    None
}

/// Points of a level as they would be at its mean temperature, by the global law: drift within a level is no scatter.
fn moved_to_mean(law: &FrictionLaw, mut rows: Rows) -> Rows {
    let all: Vec<usize> = (0..rows.len()).collect();
    let level = vec![mean(&rows.temperature, &all); rows.len()];
    let (here, there) = (law.friction(&rows.speed, &rows.temperature), law.friction(&rows.speed, &level));
    rows.friction.iter_mut().zip(here.iter().zip(&there)).for_each(|(f, (here, there))| *f += there - here);
    rows.temperature = level;
    rows
}

/// Fits by temperature, and lines through them.
fn by_temperature(out: &mut SteadyFriction, rows: &Rows, levels: Vec<Vec<usize>>, settings: &SteadySettings) {
    let form = LawForm { thermal: false, ..out.law.form };
    let parts: Vec<Rows> = levels.iter().map(|level| moved_to_mean(&out.law, rows.pick(level))).collect();
    let speeds = |part: &Rows| speed_levels(part.speed.iter().copied());
    // In the common fit, a temperature needs speeds for its own three coefficients only.
    let shared: Vec<usize> = (0..parts.len()).filter(|k| speeds(&parts[*k]) >= 4).collect();
    let picked: Vec<Rows> = shared.iter().map(|k| parts[*k].clone()).collect();
    let common = if picked.len() >= 2 { solve(&picked, &form, &COMMON, None, settings).ok() } else { None };
    for (k, (points, part)) in levels.into_iter().zip(&parts).enumerate() {
        let temperature = mean(&rows.temperature, &points);
        let enough = speeds(part) >= form.speeds_needed();
        let own =
            enough.then(|| solve(std::slice::from_ref(part), &form, &[], None, settings).ok()).flatten();
        if !enough {
            out.notes.push(format!(
                "{temperature:.1} degC: {} speeds are too few for a law of this temperature alone",
                speeds(part)
            ));
        }
        let place = shared.iter().position(|s| *s == k);
        out.levels.push(LevelFit {
            temperature,
            points,
            own_error: own.as_ref().map(Solved::error),
            own: own.map(|o| o.laws[0].clone()),
            common: common.as_ref().zip(place).map(|(c, at)| c.laws[at].clone()),
        });
    }
    let Some(common) = common else { return };
    let temperatures: Vec<f64> = shared.iter().map(|k| out.levels[*k].temperature).collect();
    out.common_error = Some(common.error());
    let freedom = common.error().freedom;
    for symbol in LINES {
        let values: Option<Vec<f64>> = common.laws.iter().map(|law| law.value(symbol)).collect();
        let found = values.zip(common.covariance_of(symbol)).and_then(|(values, errors)| {
            let how = (settings.reference_temperature, settings.confidence, freedom);
            line(symbol, &temperatures, &values, &errors, how)
        });
        match found {
            Some(found) => out.lines.push(found),
            None => out.notes.push(format!(
                "{symbol}: no line with an interval, a temperature leaves it open (at its bound or not seen)"
            )),
        }
    }
}
