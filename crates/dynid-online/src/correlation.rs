//! Size and correlation time of innovations, learned while the estimator runs.

use alloc::vec;
use alloc::vec::Vec;

use dynid_words::Transfer;

/// Autocorrelation that passes for none, beside one standard error.
const NEGLIGIBLE: f64 = 0.1;
/// Learned figures rest on at most this many times the samples first asked for; older ones fade.
const MEMORY: u64 = 64;

/// Autocorrelation of the whitened innovations of each row, from running sums.
///
/// Innovations of real machines are neither white nor of the size that stated noise lets expect, and a
/// detector that takes them so raises alarms without end. What is learned serves innovations whose size and
/// colour stay as they are; where they change with the motion, so does the rate of alarms. The first
/// `settling` samples are passed over, then sums over `samples` are formed and looked at, and again whenever
/// their number has doubled; later on old ones fade.
#[derive(Debug, Clone)]
pub struct InnovationCorrelation {
    rows: usize,
    samples: u64,
    longest: usize,
    settling: u64,
    seen: u64,
    count: u64,
    next_look: u64,
    looks: u64,
    /// Innovations of the last samples, a ring of `longest + 1`.
    ring: Vec<f64>,
    newest: usize,
    /// Sums of products, by lag and row.
    sums: Vec<f64>,
    time: usize,
    inflation: f64,
    variance: Vec<f64>,
}

impl InnovationCorrelation {
    /// For `rows` rows; figures are first given after `samples`, of which the first fifth is passed over.
    /// Correlation times up to a fifth of `samples` are found, at `rows · samples/5` multiplications per
    /// sample.
    pub fn new(rows: usize, samples: usize) -> Self {
        let longest = (samples / 5).max(1);
        let samples = samples as u64;
        Self {
            rows,
            longest,
            samples: samples - samples / 5,
            settling: samples / 5,
            seen: 0,
            count: 0,
            next_look: samples - samples / 5,
            looks: 0,
            ring: vec![0.0; (longest + 1) * rows],
            newest: 0,
            sums: vec![0.0; (longest + 1) * rows],
            time: 1,
            inflation: 1.0,
            variance: vec![1.0; rows],
        }
    }

    /// Takes the innovations of a sample; those with fewer rows than all are passed over.
    pub fn push(&mut self, whitened: &[f64]) {
        if whitened.len() != self.rows {
            return;
        }
        self.seen += 1;
        self.newest = (self.newest + 1) % (self.longest + 1);
        self.ring[self.newest * self.rows..][..self.rows].copy_from_slice(whitened);
        if self.seen <= self.settling {
            return;
        }
        self.count += 1;
        for (lag, sums) in self.sums.chunks_exact_mut(self.rows).enumerate() {
            if lag as u64 >= self.seen {
                break;
            }
            let place = (self.newest + self.longest + 1 - lag) % (self.longest + 1);
            let earlier = &self.ring[place * self.rows..][..self.rows];
            for (sum, (u, v)) in sums.iter_mut().zip(whitened.iter().zip(earlier)) {
                *sum += u * v;
            }
        }
        if self.count == self.next_look {
            self.look();
        }
    }

    fn look(&mut self) {
        let n = self.count as f64;
        let level = NEGLIGIBLE + 1.0 / libm::sqrt(n);
        let longest = (self.count / 5).min(self.longest as u64) as usize;
        self.time = 1;
        self.inflation = 1.0;
        for r in 0..self.rows {
            let own = self.sums[r];
            if own <= 0.0 {
                continue;
            }
            let correlation = |lag: usize| self.sums[lag * self.rows + r] / own;
            let time = (1..longest).find(|lag| correlation(*lag) <= level).unwrap_or(longest.max(1));
            self.time = self.time.max(time);
            self.inflation = self.inflation.max(1.0 + 2.0 * (1..time).map(correlation).sum::<f64>());
        }
        // The upper end of an interval of two standard errors: too large a variance only delays alarms.
        let margin = 1.0 + 2.0 * libm::sqrt(2.0 * self.inflation / n);
        for (variance, sum) in self.variance.iter_mut().zip(&self.sums) {
            *variance = margin * (sum / n).max(f64::MIN_POSITIVE);
        }
        self.looks += 1;
        if self.count >= MEMORY * self.samples {
            self.sums.iter_mut().for_each(|sum| *sum *= 0.5);
            self.count /= 2;
        }
        self.next_look = (2 * self.count).min(MEMORY * self.samples);
    }

    /// Longest correlation time that is looked for, samples.
    pub fn longest(&self) -> usize {
        self.longest
    }

    /// Whether figures have been formed.
    pub fn is_known(&self) -> bool {
        self.looks > 0
    }

    /// Correlation time, samples: the first lag at which no row's autocorrelation exceeds 0.1 by more than a
    /// standard error.
    pub fn time(&self) -> usize {
        self.time
    }

    /// `1 + 2 Σ autocorrelation` up to the correlation time, of the row where it is largest: by so much
    /// information that innovations carry is overstated.
    pub fn inflation(&self) -> f64 {
        self.inflation
    }

    /// Variance of row `row`, with a margin of two standard errors; 1 where the stated noise is right.
    pub fn variance(&self, row: usize) -> f64 {
        self.variance[row]
    }

    /// Mean of [`InnovationCorrelation::variance`] over rows.
    pub fn mean_variance(&self) -> f64 {
        self.variance.iter().sum::<f64>() / self.rows as f64
    }

    pub(crate) fn transfer(&mut self, transfer: &mut Transfer<'_>) {
        for value in [&mut self.seen, &mut self.count, &mut self.next_look, &mut self.looks] {
            transfer.counter(value);
        }
        transfer.finites(&mut self.ring);
        transfer.count(&mut self.newest, self.longest + 1);
        transfer.finites(&mut self.sums);
        transfer.count(&mut self.time, self.longest + 1);
        if self.time == 0 {
            transfer.fail();
        }
        transfer.finite(&mut self.inflation);
        transfer.finites(&mut self.variance);
    }
}
