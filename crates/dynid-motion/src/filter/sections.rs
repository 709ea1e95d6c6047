//! Second-order sections.

/// One section `H(z) = (b0 + b1 z^-1 + b2 z^-2) / (1 + a1 z^-1 + a2 z^-2)`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Section {
    /// Numerator `b0, b1, b2`.
    pub b: [f64; 3],
    /// Denominator `a1, a2` (`a0` is 1).
    pub a: [f64; 2],
}

impl Section {
    /// Gain at zero frequency.
    fn dc_gain(&self) -> f64 {
        self.b.iter().sum::<f64>() / (1.0 + self.a[0] + self.a[1])
    }

    /// State of the transposed direct form II that makes the answer to a unit step constant from the start.
    fn steady_state(&self) -> [f64; 2] {
        let [b0, b1, b2] = self.b;
        let [a1, a2] = self.a;
        let first = (b1 - a1 * b0 + b2 - a2 * b0) / (1.0 + a1 + a2);
        [first, (1.0 + a1) * first - (b1 - a1 * b0)]
    }
}

/// A filter as a chain of second-order sections, in the order in which they are applied.
#[derive(Debug, Clone, PartialEq)]
pub struct Sections(pub(super) Vec<Section>);

impl Sections {
    /// The sections in order.
    pub fn as_slice(&self) -> &[Section] {
        &self.0
    }

    /// Samples by which [`super::forward_backward`] extends a signal at either end: `3 (2 sections + 1)`.
    pub fn padding(&self) -> usize {
        3 * (2 * self.0.len() + 1)
    }

    /// Filters in place, as if the signal had always been at `level` before its first sample.
    pub fn run(&self, signal: &mut [f64], level: f64) {
        let mut run = Run::new(self, [level]);
        run.forward([signal]);
    }
}

/// A filter on its way through `N` signals of one length, which move in step.
///
/// A sample of a recursive filter waits for the one before; the other signals fill that time. Every signal gets the bits that it would
/// have alone.
pub(super) struct Run<'a, const N: usize> {
    sections: &'a [Section],
    /// Per section: the two entries of its state.
    states: Vec<[[f64; N]; 2]>,
}

impl<'a, const N: usize> Run<'a, N> {
    /// As if every signal had always been at its level.
    pub(super) fn new(filter: &'a Sections, levels: [f64; N]) -> Self {
        let mut levels = levels;
        let start = |section: &Section| {
            let state = section.steady_state().map(|z| levels.map(|level| z * level));
            levels = levels.map(|level| level * section.dc_gain());
            state
        };
        Run { sections: &filter.0, states: filter.0.iter().map(start).collect() }
    }

    /// Filters the next samples in place.
    pub(super) fn forward(&mut self, signals: [&mut [f64]; N]) {
        self.run::<false>(signals);
    }

    /// Filters the next samples in place, from the last one to the first.
    pub(super) fn backward(&mut self, signals: [&mut [f64]; N]) {
        self.run::<true>(signals);
    }

    /// Two sections at a time, so that their states stay in registers.
    fn run<const BACKWARD: bool>(&mut self, mut signals: [&mut [f64]; N]) {
        let (pairs, single) = self.sections.as_chunks::<2>();
        let (states, last) = self.states.as_chunks_mut::<2>();
        for (sections, states) in pairs.iter().zip(states) {
            pass::<BACKWARD, 2, N>(sections, states, &mut signals);
        }
        if let ([section], [state]) = (single, last) {
            pass::<BACKWARD, 1, N>(&[*section], std::array::from_mut(state), &mut signals);
        }
    }
}

fn pass<const BACKWARD: bool, const M: usize, const N: usize>(
    sections: &[Section; M],
    states: &mut [[[f64; N]; 2]; M],
    signals: &mut [&mut [f64]; N],
) {
    let samples = signals.first().map_or(0, |signal| signal.len());
    for signal in &*signals {
        assert_eq!(signal.len(), samples, "signals of one length");
    }
    let mut now = *states;
    for k in 0..samples {
        let n = if BACKWARD { samples - 1 - k } else { k };
        let mut x: [f64; N] = std::array::from_fn(|lane| signals[lane][n]);
        for (Section { b, a }, [first, second]) in sections.iter().zip(&mut now) {
            for lane in 0..N {
                let y = b[0] * x[lane] + first[lane];
                first[lane] = b[1] * x[lane] - a[0] * y + second[lane];
                second[lane] = b[2] * x[lane] - a[1] * y;
                x[lane] = y;
            }
        }
        for lane in 0..N {
            signals[lane][n] = x[lane];
        }
    }
    *states = now;
}

#[cfg(test)]
mod tests {
    use super::super::butterworth;

    #[test]
    fn a_constant_passes_from_its_first_sample() {
        let filter = butterworth(4, 10.0, 1000.0).unwrap();
        let mut signal = vec![3.0; 40];
        filter.run(&mut signal, 3.0);
        assert!(signal.iter().all(|x| (x - 3.0).abs() < 1e-9), "{signal:?}");
    }
}
