//! What an alarm is answered with.

use alloc::vec;
use alloc::vec::Vec;

use crate::distribution::chi_squared_upper_quantile;
use crate::settings::ReactionSettings;
use crate::square_root::{SquareRoot, dot};
use dynid_words::Transfer;

/// Squared share of a column below which a jump of its parameter cannot be told from the other columns.
const LEAST_SHARE: f64 = 1e-24;

/// What the samples after an alarm showed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reaction {
    /// The parameter that alone explains the change; `None` if it takes several, or if nothing changed.
    pub parameter: Option<usize>,
    /// The parameter whose jump explains most.
    pub best: usize,
    /// Share of the total gain that a jump of `best` explains, 0 to 1.
    pub share: f64,
    /// Estimated jump of `best`, in its unit.
    pub jump: f64,
    /// Fall of the residual sum of squares when the samples before and after get parameters of their own
    /// (Chow 1960), in units of the noise variance.
    pub total_gain: f64,
    /// Whether the total gain is more than chance would give; if not, the alarm was false and nothing was
    /// opened.
    pub confirmed: bool,
}

/// Compares the samples after an alarm with what was known before, and opens the covariance of what changed.
///
/// With `(R, z)` of before and `(R_w, z_w)` of the samples after the alarm: the gain of a jump of parameter
/// `j` is what the residual sum of squares of `[[R, 0, z], [R_w, R_w e_j, z_w]]` lies below that of
/// `[[R, z], [R_w, z_w]]`; the total gain is that of two free fits. If the best `j` explains the wanted
/// share, its variance grows by `(opening · unit)²`, else that of all. Then the samples are merged.
///
/// Falling forgetting factors react to the same errors, but recover before old samples are gone; this names
/// the parameter besides.
#[derive(Debug, Clone)]
pub struct TargetedReaction {
    samples: usize,
    share: f64,
    opening: f64,
    significant: f64,
    significant_alone: f64,
    window: SquareRoot,
    none: SquareRoot,
    merged: SquareRoot,
    collected: usize,
    active: bool,
    x: Vec<f64>,
    after: Vec<f64>,
    column: Vec<f64>,
    solution: Vec<f64>,
    before: Vec<f64>,
    scratch: Vec<f64>,
    rows: Vec<f64>,
}

impl TargetedReaction {
    /// For `columns` parameters and up to `rows` rows a sample. Settings must be valid
    /// ([`crate::Settings::validate`]).
    pub fn new(settings: &ReactionSettings, columns: usize, rows: usize) -> Self {
        let p = columns;
        let none = SquareRoot::new(p);
        Self {
            samples: settings.samples,
            share: settings.share,
            opening: settings.opening,
            significant: chi_squared_upper_quantile(settings.level, p as f64),
            significant_alone: chi_squared_upper_quantile(settings.named_level / p as f64, 1.0),
            window: none.clone(),
            merged: none.clone(),
            none,
            collected: 0,
            active: false,
            x: vec![0.0; p],
            after: vec![0.0; p],
            column: vec![0.0; p],
            solution: vec![0.0; p],
            before: vec![0.0; p],
            scratch: vec![0.0; (p + 1) * (p + 1)],
            rows: vec![0.0; rows * (p + 1)],
        }
    }

    /// Starts to collect samples.
    pub fn start(&mut self) {
        self.window.copy_from(&self.none);
        self.collected = 0;
        self.active = true;
    }

    /// Drops what was collected.
    pub fn stop(&mut self) {
        self.active = false;
    }

    /// Whether samples are being collected.
    pub fn is_active(&self) -> bool {
        self.active
    }

    /// Takes a sample after the alarm, weighted rows `[φ y]`; true when there are enough.
    pub fn push(&mut self, rows: &[f64]) -> bool {
        let copy = &mut self.rows[..rows.len()];
        copy.copy_from_slice(rows);
        self.window.push(copy);
        self.collected += 1;
        self.collected >= self.samples
    }

    /// Judges the collected samples, opens what changed in `root` and merges them.
    ///
    /// `inflation`: by how much gains are overstated because innovations are coloured or larger than stated,
    /// at least 1. Parameters count in the units of `root`.
    pub fn finish(&mut self, root: &mut SquareRoot, inflation: f64) -> Reaction {
        self.active = false;
        let p = root.columns();
        self.merged.copy_from(root);
        let total_gain = self.merged.absorb(&self.window, &mut self.scratch[..p * (p + 1)]);
        let mut best = (0, 0.0, 0.0);
        if self.merged.solve(&mut self.x) {
            self.window.times(&self.x, &mut self.after);
            root.times(&self.x, &mut self.before);
            for i in 0..p {
                self.after[i] = self.window.z(i) - self.after[i];
                self.before[i] = root.z(i) - self.before[i];
            }
            for j in 0..p {
                let (gain, jump) = self.jump(root, j);
                if gain > best.1 {
                    best = (j, gain, jump);
                }
            }
        }
        let share = if total_gain > 0.0 { (best.1 / total_gain).min(1.0) } else { 0.0 };
        let alone = share >= self.share && best.1 > self.significant_alone * inflation;
        let confirmed = alone || total_gain > self.significant * inflation;
        let parameter = (confirmed && share >= self.share).then_some(best.0);
        let variance = self.opening * self.opening;
        match parameter {
            _ if !confirmed => {}
            Some(j) => root.open(j, variance, &mut self.scratch),
            None => (0..p).for_each(|j| root.open(j, variance, &mut self.scratch)),
        }
        root.merge(&self.window, &mut self.scratch[..p * (p + 1)]);
        Reaction { parameter, best: best.0, share, jump: best.2, total_gain, confirmed }
    }

    /// Gain and size of a jump of parameter `j`, from what the others leave of its column `[0; R_w e_j]`.
    fn jump(&mut self, root: &SquareRoot, j: usize) -> (f64, f64) {
        let p = root.columns();
        for (i, c) in self.column.iter_mut().enumerate() {
            *c = self.window.r(i, j);
        }
        let whole: f64 = self.column.iter().map(|c| c * c).sum();
        self.window.times_transposed(&self.column, &mut self.scratch[..p + 1]);
        self.solution.copy_from_slice(&self.scratch[..p]);
        self.merged.solve_transposed(&mut self.solution);
        self.merged.solve_upper(&mut self.solution);
        let (mut left, mut along) = (0.0, 0.0);
        for i in 0..p {
            let above = -dot(&root.row(i)[..p - i], &self.solution[i..]);
            let below = self.column[i] - dot(&self.window.row(i)[..p - i], &self.solution[i..]);
            left += above * above + below * below;
            along += above * self.before[i] + below * self.after[i];
        }
        if left <= LEAST_SHARE * whole || whole == 0.0 {
            return (0.0, 0.0);
        }
        (along * along / left, along / left)
    }

    pub(crate) fn transfer(&mut self, transfer: &mut Transfer<'_>) {
        self.window.transfer(transfer);
        transfer.count(&mut self.collected, self.samples + 1);
        transfer.flag(&mut self.active);
    }
}
