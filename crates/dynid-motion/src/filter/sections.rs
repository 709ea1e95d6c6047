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

    #[inline]
    fn step(&self, state: &mut [f64; 2], x: f64) -> f64 {
        let y = self.b[0] * x + state[0];
        state[0] = self.b[1] * x - self.a[0] * y + state[1];
        state[1] = self.b[2] * x - self.a[1] * y;
        y
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
        let mut input_level = level;
        let mut state: Vec<[f64; 2]> = Vec::with_capacity(self.0.len());
        for section in &self.0 {
            state.push(section.steady_state().map(|z| z * input_level));
            input_level *= section.dc_gain();
        }
        for x in signal {
            *x = self.0.iter().zip(&mut state).fold(*x, |x, (section, state)| section.step(state, x));
        }
    }
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
