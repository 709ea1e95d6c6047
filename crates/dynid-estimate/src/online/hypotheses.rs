//! What moved: hypotheses on a change, judged by the samples after an alarm.

use dynid_online::SquareRoot;

use crate::distribution::chi_squared_quantile;

/// Something that may have changed: a body that was picked up, the friction of a joint, a single parameter.
#[derive(Debug, Clone, PartialEq)]
pub struct ChangeHypothesis {
    /// What it is.
    pub name: String,
    /// `E`, direction after direction, `p` entries each: unit jump `k` moves the parameters by direction `k`. In the units of the
    /// factors.
    pub directions: Vec<f64>,
    /// Prior standard deviation of each jump, positive.
    pub std: Vec<f64>,
}

/// A hypothesis against the samples, beside those selected before it.
#[derive(Debug, Clone, PartialEq)]
pub struct JudgedHypothesis {
    /// Index among the hypotheses.
    pub hypothesis: usize,
    /// Share of the total gain that all jumps so far explain, 0 to 1.
    pub share: f64,
    /// Logarithm of the Bayes factor of all jumps so far against "nothing changed".
    pub evidence: f64,
}

/// What the samples after an alarm say.
#[derive(Debug, Clone, PartialEq)]
pub struct ChangeJudgement {
    /// Fall of the residual sum of squares when the samples before and after get parameters of their own (Chow 1960), in
    /// units of the noise variance.
    pub total_gain: f64,
    /// Whether that is more than chance would give, and what moved explains it: errors of the model, and noise that grows with the
    /// motion, give gains too, which no jump of parameters accounts for.
    pub confirmed: bool,
    /// What moved, the most telling first; empty unless confirmed.
    pub moved: Vec<JudgedHypothesis>,
    /// Jumps of everything in `moved`, in that order, and their standard deviations.
    pub jumps: Vec<(f64, f64)>,
    /// All hypotheses on their own, the largest evidence first.
    pub alone: Vec<JudgedHypothesis>,
}

/// Settings of [`judge_change`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JudgeSettings {
    /// By how much squares of rows are overstated because rows are coloured, at least 1. Default 1.
    pub inflation: f64,
    /// Probability with which chance alone is called a change. Default 1e-6.
    pub level: f64,
    /// Gain in the logarithm of the Bayes factor that a further hypothesis must bring. Default 5.
    pub least_gain: f64,
    /// Most hypotheses that are selected. Default 6.
    pub most: usize,
}

impl Default for JudgeSettings {
    fn default() -> Self {
        JudgeSettings { inflation: 1.0, level: 1e-6, least_gain: 5.0, most: 6 }
    }
}

/// Hypotheses that come second are sought among so many, the best on their own.
const CANDIDATES: usize = 24;

/// Judges hypotheses on what moved between the samples behind `before` and those behind `after`.
///
/// For hypotheses with directions `E` and jumps `δ ~ N(0, diag(std²))` the rows are
/// `[[-R E, R, z], [0, R_a, z_a]]` in `(δ, x)`, with `x` the parameters after the change. The Bayes factor weighs what the jumps explain
/// against how many there are and how far they might have gone, so a body that explains as much as several single parameters wins
/// over them, and a single parameter over the body. Hypotheses are selected one after the other, each beside those before it, while
/// the Bayes factor grows.
///
/// A change is confirmed if the gain is above the quantile of `χ²_p` at `level`, and if the Bayes factor of what was selected
/// is above `H/level` for `H` hypotheses: without change the mean of each Bayes factor is 1, so by Markov's inequality one of them comes
/// as far with a probability of `level` at most.
///
/// # Panics
/// If factors or hypotheses have different numbers of parameters.
pub fn judge_change(
    before: &SquareRoot,
    after: &SquareRoot,
    hypotheses: &[ChangeHypothesis],
    settings: &JudgeSettings,
) -> ChangeJudgement {
    let p = before.columns();
    let (before, after) = (deflated(before, settings.inflation), deflated(after, settings.inflation));
    let mut together = before.clone();
    together.merge(&after, &mut vec![0.0; p * (p + 1)]);
    // What remains of both fits is in all of them.
    let total_gain = (together.rss() - before.rss() - after.rss()).max(0.0);
    let still = log_diagonal(&together);
    let judged = |selected: &ChangeHypothesis, hypothesis: usize| {
        let candidate = combined(selected, &hypotheses[hypothesis]);
        let joint = joined(&before, &after, &candidate);
        let gain = (together.rss() - joint.rss()).max(0.0);
        let prior: f64 = candidate.std.iter().map(|s| -s.ln()).sum();
        let occam = log_diagonal(&joint) - still - prior;
        JudgedHypothesis {
            hypothesis,
            share: if total_gain > 0.0 { (gain / total_gain).min(1.0) } else { 0.0 },
            evidence: 0.5 * gain - occam,
        }
    };
    let nothing = ChangeHypothesis { name: String::new(), directions: Vec::new(), std: Vec::new() };
    let mut alone: Vec<JudgedHypothesis> = (0..hypotheses.len()).map(|h| judged(&nothing, h)).collect();
    let by_evidence = |a: &JudgedHypothesis, b: &JudgedHypothesis| {
        b.evidence.total_cmp(&a.evidence).then(a.hypothesis.cmp(&b.hypothesis))
    };
    alone.sort_by(by_evidence);
    let significant = chi_squared_quantile(1.0 - settings.level, p as f64).unwrap_or(f64::INFINITY);
    let significant = total_gain > significant;
    let (mut selected, mut moved) = (nothing, Vec::<JudgedHypothesis>::new());
    while significant && moved.len() < settings.most {
        let reached = moved.last().map_or(0.0, |m| m.evidence);
        let left = alone.iter().take(CANDIDATES).map(|a| a.hypothesis);
        let left = left.filter(|h| moved.iter().all(|m| m.hypothesis != *h));
        let mut next: Vec<JudgedHypothesis> = left.map(|h| judged(&selected, h)).collect();
        next.sort_by(by_evidence);
        match next.into_iter().next() {
            Some(best) if best.evidence > reached + settings.least_gain || moved.is_empty() => {
                selected = combined(&selected, &hypotheses[best.hypothesis]);
                moved.push(best);
            }
            _ => break,
        }
    }
    let least_evidence = (hypotheses.len() as f64 / settings.level).ln();
    let confirmed = moved.last().is_some_and(|m| m.evidence > least_evidence);
    if !confirmed {
        moved.clear();
    }
    let jumps = match moved.is_empty() {
        true => Vec::new(),
        false => jumps(&joined(&before, &after, &selected), selected.std.len()),
    };
    ChangeJudgement { total_gain, confirmed, moved, jumps, alone }
}

/// Jumps and their standard deviations.
fn jumps(joint: &SquareRoot, count: usize) -> Vec<(f64, f64)> {
    let (mut x, mut scratch) = (vec![0.0; joint.columns()], vec![0.0; joint.columns()]);
    match joint.solve(&mut x) {
        true => (0..count).map(|k| (x[k], joint.variance(k, &mut scratch).sqrt())).collect(),
        false => Vec::new(),
    }
}

/// Two hypotheses together.
fn combined(first: &ChangeHypothesis, second: &ChangeHypothesis) -> ChangeHypothesis {
    ChangeHypothesis {
        name: format!("{}, {}", first.name, second.name),
        directions: [&first.directions[..], &second.directions].concat(),
        std: [&first.std[..], &second.std].concat(),
    }
}

/// What is known of the parameters after a change of everything that is named: the samples before count as far as its jumps leave
/// them.
///
/// # Panics
/// If a hypothesis has another number of parameters.
pub fn after_change<'a>(
    before: &SquareRoot,
    after: &SquareRoot,
    moved: impl IntoIterator<Item = &'a ChangeHypothesis>,
) -> SquareRoot {
    let nothing = ChangeHypothesis { name: String::new(), directions: Vec::new(), std: Vec::new() };
    let all = moved.into_iter().fold(nothing, |all, one| combined(&all, one));
    let joint = joined(before, after, &all);
    let (p, jumps) = (before.columns(), all.std.len());
    let mut out = SquareRoot::new(p);
    for i in 0..p {
        out.set_row(i, joint.row(jumps + i));
    }
    out.set_remainder(joint.rss(), joint.weight());
    out
}

/// Factor of `(δ, x)`.
fn joined(before: &SquareRoot, after: &SquareRoot, hypothesis: &ChangeHypothesis) -> SquareRoot {
    let (p, jumps) = (before.columns(), hypothesis.std.len());
    assert_eq!(hypothesis.directions.len(), p * jumps, "directions of a hypothesis");
    let width = jumps + p + 1;
    let mut joint = SquareRoot::new(jumps + p);
    let mut rows = vec![0.0; jumps * width];
    for (k, (row, std)) in rows.chunks_exact_mut(width).zip(&hypothesis.std).enumerate() {
        row[k] = 1.0 / std;
    }
    joint.push(&mut rows);
    let mut rows = vec![0.0; 2 * p * width];
    let (first, second) = rows.split_at_mut(p * width);
    for (i, row) in first.chunks_exact_mut(width).enumerate() {
        let known = before.row(i);
        for (k, direction) in hypothesis.directions.chunks_exact(p).enumerate() {
            row[k] = -known[..p - i].iter().zip(&direction[i..]).map(|(r, e)| r * e).sum::<f64>();
        }
        row[jumps + i..].copy_from_slice(known);
    }
    for (i, row) in second.chunks_exact_mut(width).enumerate() {
        row[jumps + i..].copy_from_slice(after.row(i));
    }
    joint.push(&mut rows);
    joint.set_remainder(joint.rss() + before.rss() + after.rss(), before.weight() + after.weight());
    joint
}

fn deflated(root: &SquareRoot, inflation: f64) -> SquareRoot {
    let mut out = root.clone();
    out.discount(1.0 / inflation.max(1.0));
    out
}

fn log_diagonal(root: &SquareRoot) -> f64 {
    (0..root.columns()).map(|j| root.r(j, j).ln()).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rows of four parameters with unit noise that depends on nothing but the row.
    fn factor(x: &[f64; 4], rows: std::ops::Range<u32>) -> SquareRoot {
        noisy_factor(x, rows, 1.0)
    }

    fn noisy_factor(x: &[f64; 4], rows: std::ops::Range<u32>, size: f64) -> SquareRoot {
        let mut root = SquareRoot::new(4);
        for n in rows {
            let t = f64::from(n);
            let phi = [(0.7 * t).sin(), (1.3 * t).cos(), (0.31 * t).sin() * (1.9 * t).cos(), 1.0];
            let noise = (12.9898 * t).sin() * 43758.5453;
            let noise = size * ((noise - noise.floor()) - 0.5) * 12f64.sqrt();
            let y = phi.iter().zip(x).map(|(a, b)| a * b).sum::<f64>() + noise;
            root.push(&mut [phi[0], phi[1], phi[2], phi[3], y]);
        }
        root
    }

    fn hypotheses() -> Vec<ChangeHypothesis> {
        let mut out: Vec<ChangeHypothesis> = (0..4)
            .map(|j| {
                let mut directions = vec![0.0; 4];
                directions[j] = 1.0;
                ChangeHypothesis { name: format!("x{j}"), directions, std: vec![3.0] }
            })
            .collect();
        out.push(ChangeHypothesis {
            name: "body".into(),
            directions: vec![1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.5, 0.0],
            std: vec![3.0; 2],
        });
        out
    }

    fn judge(before: &SquareRoot, after: &SquareRoot) -> ChangeJudgement {
        judge_change(before, after, &hypotheses(), &JudgeSettings::default())
    }

    #[test]
    fn the_smallest_hypothesis_that_explains_all_wins() {
        let before = factor(&[1.0, 2.0, -1.0, 0.5], 0..4000);
        let single = judge(&before, &factor(&[1.0, 3.0, -1.0, 0.5], 5000..5400));
        assert!(single.confirmed && single.moved.len() == 1, "{single:?}");
        assert_eq!(single.moved[0].hypothesis, 1);
        assert!(single.moved[0].share > 0.9);
        let (jump, std) = single.jumps[0];
        assert!((jump - 1.0).abs() < 3.0 * std && std < 0.15, "{jump} {std}");
        // Two parameters, in the proportion of a body.
        let body = judge(&before, &factor(&[0.2, 3.0, -0.5, 0.5], 5000..5400));
        assert_eq!((body.moved.len(), body.moved[0].hypothesis), (1, 4));
        assert!(body.moved[0].share > 0.9);
        assert!((body.jumps[0].0 + 0.8).abs() < 0.3 && (body.jumps[1].0 - 1.0).abs() < 0.3, "{body:?}");
        // The body and a parameter of its own.
        let both = judge(&before, &factor(&[0.2, 3.0, -0.5, 2.0], 5000..5400));
        let mut named: Vec<usize> = both.moved.iter().map(|m| m.hypothesis).collect();
        named.sort_unstable();
        assert_eq!(named, [3, 4], "{both:?}");
    }

    /// Noise that is larger than before gains with parameters of its own, and no jump accounts for it.
    #[test]
    fn what_no_hypothesis_explains_is_no_change() {
        let truth = [1.0, 2.0, -1.0, 0.5];
        let before = factor(&truth, 0..4000);
        let mut after = noisy_factor(&truth, 5500..5540, 4.0);
        let judgement = judge(&before, &after);
        // More than chance would give: χ² of 4 at 1e-6 is 33.4.
        assert!(judgement.total_gain > 33.4, "{judgement:?}");
        assert!(
            !judgement.confirmed && judgement.moved.is_empty() && judgement.jumps.is_empty(),
            "{judgement:?}"
        );
        // Of its true size it is no gain at all.
        after.discount(1.0 / 16.0);
        assert!(judge(&before, &after).total_gain < 10.0);
    }

    #[test]
    fn nothing_is_called_nothing_and_what_is_known_after_is_the_fit_with_jumps() {
        let truth = [1.0, 2.0, -1.0, 0.5];
        let before = factor(&truth, 0..4000);
        let quiet = judge(&before, &factor(&truth, 5000..5400));
        assert!(!quiet.confirmed && quiet.moved.is_empty() && quiet.alone[0].evidence < 3.0);
        let after = factor(&[1.0, 3.0, -1.0, 0.5], 5000..5400);
        let known = after_change(&before, &after, [&hypotheses()[1]]);
        let mut x = [0.0; 4];
        assert!(known.solve(&mut x));
        let mut scratch = [0.0; 4];
        let std: Vec<f64> = (0..4).map(|j| known.variance(j, &mut scratch).sqrt()).collect();
        // What did not move is known from both stretches, what did from the second.
        assert!(std[0] < 0.03 && std[1] > 0.05, "{std:?}");
        assert!((x[1] - 3.0).abs() < 3.0 * std[1] && (x[0] - 1.0).abs() < 4.0 * std[0]);
        let merged = after_change(&before, &after, []);
        let mut together = before.clone();
        together.merge(&after, &mut [0.0; 20]);
        assert!((merged.rss() - together.rss()).abs() < 1e-9 * together.rss());
    }
}
