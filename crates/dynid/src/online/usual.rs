//! What innovations are usual: their size, and for how long they are alike.

/// Autocorrelation that passes for none, beside one standard error.
const NEGLIGIBLE: f64 = 0.1;
/// Share of the stretch that is passed over: the estimate has to settle first.
const SETTLING: f64 = 0.3;
/// Fewest innovations of an output that say anything.
const FEWEST: usize = 20;

/// How far motions go, in steps: within what was learned from, then by half octaves beyond it.
pub(super) const EXTENTS: usize = 17;

/// Usual innovations of a stream, relative to the noise of its rows.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Innovations {
    /// Output by output, by how far the motion goes ([`EXTENTS`]): mean square of the whitened innovations in the worst block, at least 1.
    pub(super) size: Vec<f64>,
    /// Correlation time, samples of rows: first lag at which no output's autocorrelation is more than negligible.
    pub(super) every: usize,
    /// `1 + 2 Σ autocorrelation` of the output where it is largest: by so much information is overstated.
    pub(super) inflation: f64,
}

impl Innovations {
    /// White, and of the size that was stated.
    pub(super) fn stated(outputs: usize) -> Innovations {
        Innovations { size: vec![1.0; outputs * EXTENTS], every: 1, inflation: 1.0 }
    }

    /// Size of an output's innovations where the motion goes so far.
    pub(super) fn size(&self, output: usize, extent: usize) -> f64 {
        self.size[output * EXTENTS + extent]
    }

    /// A block of an output's innovations was `factor` times as large as usual. Where the motion goes further they are no smaller.
    pub(super) fn grow(&mut self, output: usize, extent: usize, factor: f64) {
        let sizes = &mut self.size[output * EXTENTS..][..EXTENTS];
        let found = sizes[extent] * factor.max(1.0);
        sizes[extent..].iter_mut().for_each(|size| *size = size.max(found));
    }
}

/// Whitened innovations of a stretch, output by output; none where an output had no row.
#[derive(Debug)]
pub(super) struct UsualInnovations {
    values: Vec<Vec<Option<f64>>>,
}

impl UsualInnovations {
    pub(super) fn new(outputs: usize) -> Self {
        UsualInnovations { values: vec![Vec::new(); outputs] }
    }

    /// Innovations of a sample and the outputs that they belong to.
    pub(super) fn push(&mut self, used: &[usize], whitened: &[f64]) {
        self.values.iter_mut().for_each(|v| v.push(None));
        for (output, u) in used.iter().zip(whitened) {
            if let Some(last) = self.values[*output].last_mut() {
                *last = Some(*u);
            }
        }
    }

    /// What is usual. Motions differ, and so do their innovations: the size is that of the worst `block` samples.
    pub(super) fn learned(&self, block: usize) -> Innovations {
        let mut out = Innovations::stated(self.values.len());
        for (output, all) in self.values.iter().enumerate() {
            let settled = &all[(SETTLING * all.len() as f64) as usize..];
            let present = settled.iter().flatten().count();
            if present < FEWEST {
                continue;
            }
            let worst = settled
                .chunks(block)
                .filter_map(|chunk| mean_square(chunk, FEWEST.min(block.div_ceil(2))))
                .chain(mean_square(settled, 1))
                .fold(1.0, f64::max);
            out.grow(output, 0, worst);
            let (time, inflation) = correlation(settled, present);
            out.every = out.every.max(time);
            out.inflation = out.inflation.max(inflation);
        }
        out
    }
}

fn mean_square(values: &[Option<f64>], fewest: usize) -> Option<f64> {
    let count = values.iter().flatten().count();
    (count >= fewest.max(1)).then(|| values.iter().flatten().map(|u| u * u).sum::<f64>() / count as f64)
}

/// Correlation time and inflation; pairs with a missing member are passed over.
fn correlation(values: &[Option<f64>], present: usize) -> (usize, f64) {
    let level = NEGLIGIBLE + 1.0 / (present as f64).sqrt();
    let Some(own) = mean_square(values, 1).filter(|own| *own > 0.0) else { return (1, 1.0) };
    let longest = (values.len() / 5).max(1);
    let mut inflation = 1.0;
    for lag in 1..longest {
        let pairs = values.iter().zip(&values[lag..]).filter_map(|(a, b)| Some(a.as_ref()? * b.as_ref()?));
        let (sum, count) = pairs.fold((0.0, 0u32), |(sum, count), product| (sum + product, count + 1));
        if count == 0 || sum / f64::from(count) <= level * own {
            return (lag, inflation);
        }
        inflation += 2.0 * sum / f64::from(count) / own;
    }
    (longest, inflation)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colour_and_the_worst_block_are_found() {
        let mut usual = UsualInnovations::new(2);
        let (mut state, mut random) = (0.0, 1u64);
        let mut draw = || {
            // Twelve uniform numbers make a good enough normal one.
            (0..12)
                .map(|_| {
                    random = random
                        .wrapping_mul(6_364_136_223_846_793_005)
                        .wrapping_add(1_442_695_040_888_963_407);
                    (random >> 11) as f64 / (1u64 << 53) as f64
                })
                .sum::<f64>()
                - 6.0
        };
        for k in 0..4000 {
            state = 0.8 * state + 0.6 * draw();
            let white = draw() * if k / 100 == 30 { 3.0 } else { 1.0 };
            let used: &[usize] = if k % 7 == 0 { &[1] } else { &[0, 1] };
            let both = [state, white];
            usual.push(used, &both[2 - used.len()..]);
        }
        let found = usual.learned(100);
        assert!((6..=14).contains(&found.every), "{found:?}");
        assert!((found.inflation - 9.0).abs() < 2.5, "{found:?}");
        assert!(found.size(1, 0) > 6.0 && found.size(0, 0) < 2.5, "{found:?}");
        assert_eq!(found.size(1, EXTENTS - 1), found.size(1, 0));
        assert_eq!(UsualInnovations::new(1).learned(10), Innovations::stated(1));
    }
}
