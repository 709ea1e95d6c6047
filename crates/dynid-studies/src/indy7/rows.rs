//! Rows 8 to 11 and what goes beyond the paper, from the estimates.

use serde_json::json;

use super::JOINTS;
use super::friction::JointFriction;
use super::identification::{Identified, margins};
use super::robot::Indy7;
use super::settings::{PerJoint, Settings};
use super::validation::{Ends, NAMES, Realisation, Scored, Table, changed, improvement, known};
use crate::statistics::median;
use crate::{Row, StudyError};
use dynid::model::EffortModel;

/// Row 8.
pub(super) fn friction_row(settings: &Settings, found: &[JointFriction]) -> Row {
    let speeds: Vec<f64> = (0..=40).map(|k| 0.02 * 120f64.powf(f64::from(k) / 40.0)).collect();
    let temperatures: Vec<f64> = (0..=8).map(|k| 19.0 + 4.0 * f64::from(k)).collect();
    let mut curves = Vec::new();
    let (mut stiffness, mut damping) = (Vec::new(), Vec::new());
    for (found, truth) in found.iter().zip(&settings.friction) {
        let (mut worst, mut largest) = (0.0_f64, 0.0_f64);
        for t in &temperatures {
            let own = found.fit.law.friction(&speeds, &vec![*t; speeds.len()]);
            for (own, v) in own.iter().zip(&speeds) {
                let wanted = truth.steady(*v, *t);
                worst = worst.max((own - wanted).abs());
                largest = largest.max(wanted);
            }
        }
        curves.push(worst / largest);
        stiffness.push(found.bristles[0].0 / truth.sigma0 - 1.0);
        damping.push(found.bristles[1].0 / truth.sigma1 - 1.0);
    }
    let most = |x: &[f64]| x.iter().fold(0.0_f64, |m, e| m.max(e.abs()));
    let (curve, s0, s1) = (most(&curves), most(&stiffness), most(&damping));
    Row::new(
        "8",
        "Step 1 from virtual sweeps at 16 speeds and pre-sliding motion: steady friction over 0.02 to 2.4 rad/s and 19 to 51 °C, \
         bristle stiffness and damping, of every joint",
        "curve within 3 % of its maximum, σ0 and σ1 within 5 %",
        json!({ "curve": curves, "sigma0": stiffness, "sigma1": damping }),
        format!("{:.2} %, {:.1} %, {:.1} %", 100.0 * curve, 100.0 * s0, 100.0 * s1),
        curve <= 0.03 && s0 <= 0.05 && s1 <= 0.05,
    )
}

fn flat(table: &Table) -> Vec<f64> {
    table.concat()
}

/// Row 9.
pub(super) fn validation_row(
    settings: &Settings,
    ends: &Ends,
    found: &Realisation,
) -> Result<Row, StudyError> {
    let mut pass = true;
    let mut words = Vec::new();
    let mut measured = serde_json::Map::new();
    let paper = [&settings.paper.cold, &settings.paper.hot];
    for (((name, validation), paper), required) in ends.named().into_iter().zip(paper).zip([0.6, 0.5]) {
        let conventional = validation.table(&found.conventional.found, settings)?;
        let proposed = validation.table(&found.proposed.found, settings)?;
        let gain = improvement(&conventional, &proposed);
        let theirs = improvement(&paper.conventional, &paper.proposed);
        let all = flat(&gain);
        let least = all.iter().copied().fold(f64::INFINITY, f64::min);
        let middle = median(all.clone());
        // Medians over joints of every trajectory.
        let per_trajectory: Vec<f64> = gain.iter().map(|g| median(g.to_vec())).collect();
        let beats = gain.iter().zip(&theirs).all(|(g, t)| median(g.to_vec()) >= median(t.to_vec()));
        pass &= least > 0.0 && beats && per_trajectory.iter().all(|g| *g >= required);
        words.push(format!(
            "{name} {:.0} % in the median (least {:.0} %; paper {:.0} %)",
            100.0 * middle,
            100.0 * least,
            100.0 * median(flat(&theirs))
        ));
        measured.insert(
            name.to_owned(),
            json!({
                "trajectories": NAMES, "conventional": conventional, "proposed": proposed,
                "improvement": gain, "paper_improvement": theirs,
            }),
        );
    }
    Ok(Row::new(
        "9",
        "Tables 3 and 4: identified at 31 °C, validated on A, B, C at 20.5 and 43 °C, the two-step estimate predicts torque better \
         than the conventional one on every joint",
        "better on every joint; median over joints of every trajectory at least the paper's, and 60 % cold, 50 % hot",
        measured.into(),
        words.join("; "),
        pass,
    ))
}

/// The paper's four estimates.
pub(super) struct Four {
    /// Conventional, cold and hot.
    pub(super) conventional: [Identified; 2],
    /// Proposed, cold and hot.
    pub(super) proposed: [Identified; 2],
}

/// Rows 10 and 11.
pub(super) fn robustness_rows(arm: &Indy7, four: &Four, realistic: &[Identified; 4]) -> [Row; 2] {
    let base = |e: &Identified| e.base(arm);
    let count = |pair: &[Identified; 2]| changed(&base(&pair[0]), &base(&pair[1]));
    let counts = [count(&four.conventional), count(&four.proposed)];
    let largest = |pair: &[Identified; 2]| {
        let (a, b) = (base(&pair[0]), base(&pair[1]));
        a.iter().zip(&b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
    };
    let absolute = [largest(&four.conventional), largest(&four.proposed)];
    let tenth = Row::new(
        "10",
        "Table A2: base parameters that change by more than 20 % between cold and hot identification",
        "two-step at most 5 of 40, conventional at least 10",
        json!({
            "conventional": counts[0], "two_step": counts[1],
            "largest_change": { "conventional": absolute[0], "two_step": absolute[1] },
        }),
        format!(
            "{} against {}; largest change {:.3} against {:.3}",
            counts[1], counts[0], absolute[1], absolute[0]
        ),
        counts[1] <= 5 && counts[0] >= 10,
    );
    let spatial: Vec<f64> =
        four.conventional.iter().chain(&four.proposed).map(|e| margins(&e.values)[0]).collect();
    let pseudo: Vec<f64> = realistic.iter().map(|e| margins(&e.values)[1]).collect();
    let feasible = |list: &[f64]| list.iter().all(|m| *m >= -1e-9);
    let least = |list: &[f64]| list.iter().copied().fold(f64::INFINITY, f64::min);
    let eleventh = Row::new(
        "11",
        "All four estimates are feasible: by B_L as in the paper, and by pseudo-inertia, our default",
        "least eigenvalues at least -1e-9",
        json!({ "spatial": spatial, "pseudo_inertia": pseudo }),
        format!("{:.1e} and {:.1e}", least(&spatial), least(&pseudo)),
        feasible(&spatial) && feasible(&pseudo),
    );
    [tenth, eleventh]
}

/// Ratio of RMSE to those of the two-step estimate, per joint: median over realisations and trajectories.
fn ratios<'a>(
    end: usize,
    realisations: &'a [Realisation],
    of: impl Fn(&'a Realisation) -> Option<&'a Scored>,
) -> Option<Vec<f64>> {
    let mut all = vec![Vec::new(); JOINTS];
    for found in realisations {
        let (own, theirs) = (&of(found)?.scores[end], &found.two_step.scores[end]);
        for (own, theirs) in own.iter().zip(theirs) {
            for (j, list) in all.iter_mut().enumerate() {
                list.push(own[j] / theirs[j]);
            }
        }
    }
    Some(all.into_iter().map(median).collect())
}

/// Row b.
pub(super) fn one_shot_row(realisations: &[Realisation]) -> Row {
    let mut measured = serde_json::Map::new();
    let mut worst = [0.0_f64; 2];
    for (end, name) in ["cold", "hot"].into_iter().enumerate() {
        let whole = ratios(end, realisations, |r| Some(&r.one_shot));
        let plain = ratios(end, realisations, |r| r.plain_one_shot.as_ref());
        worst[0] = whole.iter().flatten().copied().fold(worst[0], f64::max);
        worst[1] = plain.iter().flatten().copied().fold(worst[1], f64::max);
        measured.insert(name.to_owned(), json!({ "one_shot": whole, "without_ripple": plain }));
    }
    measured.insert("realisations".to_owned(), realisations.len().into());
    measured.insert("cycles".to_owned(), json!(realisations.iter().map(|r| &r.cycles).collect::<Vec<_>>()));
    Row::new(
        "b",
        "Friction, inertias and the torque ripple that residuals show, all from one fit to the excitation log and the friction \
         points, predict at least as well as the two-step estimate, on every joint, cold and hot",
        "median RMSE over realisations at most that of the two-step estimate, on every joint",
        measured.into(),
        match worst[1] {
            0.0 => format!("at most {:.2} of it", worst[0]),
            plain => format!(
                "at most {:.2} of it ({} realisations; {plain:.2} with the ripple left out of the model)",
                worst[0],
                realisations.len()
            ),
        },
        worst[0] <= 1.0,
    )
}

/// Row c.
pub(super) fn missing_temperature_row(
    arm: &Indy7,
    settings: &Settings,
    ends: &Ends,
    found: &Realisation,
) -> Result<Row, StudyError> {
    let mut measured = serde_json::Map::new();
    let mut words = Vec::new();
    for (end, (name, validation)) in ends.named().into_iter().enumerate() {
        let log = &validation.logs[0];
        let with = found.two_step.scores[end][0];
        let never = found.conventional.scores[end][0];
        let mut without = [0.0; JOINTS];
        for (joint, own) in without.iter_mut().enumerate() {
            let stated = Some((joint, settings.thermal.moderate));
            let blind = Identified {
                model: arm.regression().with_known(known(&found.friction, settings, stated)?),
                values: found.two_step.found.values.clone(),
            };
            *own = blind.filtered_rmse(log, settings)?[joint];
        }
        let most = |of: &PerJoint| (0..JOINTS).map(|j| without[j] / of[j]).fold(0.0, f64::max);
        words.push(format!(
            "{name}: {:.2} instead of {:.2} N m on joint 1, up to {:.0} times; at most {:.2} times the conventional one",
            without[0],
            with[0],
            most(&with),
            most(&never)
        ));
        measured.insert(name.to_owned(), json!({ "with": with, "without": without, "conventional": never }));
    }
    Ok(Row::beside(
        "c",
        "What it costs not to know the temperature of a joint (31 °C stated in its place): RMSE of that joint on trajectory A, beside \
         that of the conventional estimate, which knows no temperature",
        "stated; nothing is claimed of it",
        measured.into(),
        words.join("; "),
    ))
}

/// Row d.
pub(super) fn price_row(found: &Realisation) -> Row {
    let mut worst = 0.0_f64;
    let mut measured = serde_json::Map::new();
    for (end, name) in ["cold", "hot"].into_iter().enumerate() {
        let (ours, paper) = (&found.two_step.scores[end], &found.proposed.scores[end]);
        let ratio: Vec<f64> =
            (0..JOINTS).map(|j| median((0..3).map(|k| ours[k][j] / paper[k][j]).collect())).collect();
        worst = ratio.iter().copied().fold(worst, f64::max);
        measured.insert(name.to_owned(), json!({ "ratio": ratio }));
    }
    Row::new(
        "d",
        "Bodies that can exist and errors of friction of any sign, our defaults, in place of the paper's constraints: what they \
         cost in prediction",
        "median RMSE over trajectories at most 10 % higher on any joint",
        measured.into(),
        format!("at most {:.1} % higher", 100.0 * (worst - 1.0)),
        worst <= 1.1,
    )
}

/// Row e: the same record of a warming arm, with its temperatures and with that of its start.
pub(super) fn drift_row(arm: &Indy7, measured: &Identified, ignored: &Identified, span: [f64; 2]) -> Row {
    let truth = arm.base_values(&arm.standard);
    let error = |e: &Identified| {
        let squares: f64 = e.base(arm).iter().zip(&truth).map(|(a, b)| (a - b) * (a - b)).sum();
        (squares / truth.len() as f64).sqrt()
    };
    let friction = |e: &Identified| {
        let table = &e.model.parameters().linear;
        let errors =
            table.iter().zip(&e.values).filter(|(p, _)| p.name.ends_with(".fc") || p.name.ends_with(".fv"));
        errors.map(|(_, x)| x.abs()).fold(0.0, f64::max)
    };
    let (with, without) = ([error(measured), friction(measured)], [error(ignored), friction(ignored)]);
    Row::new(
        "e",
        "Temperature that drifts within the record (joints warming up): friction at the logged temperature against that at the \
         start; rms error of the 40 base values and largest error of friction left to the columns",
        "errors left to the friction columns at most half",
        json!({
            "temperatures": span,
            "with_temperature": { "base": with[0], "friction": with[1] },
            "without": { "base": without[0], "friction": without[1] },
        }),
        format!(
            "{:.1} to {:.1} °C: base {:.3} against {:.3}, friction {:.2} against {:.2}",
            span[0], span[1], with[0], without[0], with[1], without[1]
        ),
        with[1] <= 0.5 * without[1],
    )
}
