//! Motion of a mechanism over a run of samples.

use dynid_algebra::scalar::sign;

/// A run of consecutive samples of motion, channel after channel.
///
/// Coordinate `c` of sample `s` is `q[c * stride + s]`, with `s < samples <= stride`; likewise `dq`, `ddq`, gravity
/// (three channels: x, y, z in base axes) and the extra channels.
#[derive(Clone, Copy, Debug)]
pub struct MotionBlock<'a> {
    /// Number of samples.
    pub samples: usize,
    /// Distance between channels.
    pub stride: usize,
    /// Positions, rad or m.
    pub q: &'a [f64],
    /// Rates.
    pub dq: &'a [f64],
    /// Accelerations.
    pub ddq: &'a [f64],
    /// Gravity per sample, m/s²; `None`: the mechanism's constant gravity.
    pub gravity: Option<&'a [f64]>,
    /// Extra channels by name, each at least `samples` long: motor current, temperature.
    pub channels: &'a [(&'a str, &'a [f64])],
    /// Speed over which elements smooth the sign of a velocity: `s(v) = tanh(v / sign_width)`; 0: the sign itself.
    ///
    /// A smooth sign is for design and simulation, where derivatives are wanted; measured motion is taken as it is.
    pub sign_width: f64,
}

impl<'a> MotionBlock<'a> {
    /// Packed motion (`stride = samples`) with the mechanism's constant gravity, no extra channels, and the sign of a
    /// velocity itself.
    pub fn plain(samples: usize, q: &'a [f64], dq: &'a [f64], ddq: &'a [f64]) -> Self {
        MotionBlock { samples, stride: samples, q, dq, ddq, gravity: None, channels: &[], sign_width: 0.0 }
    }

    /// Samples of one rate.
    pub fn rate(&self, rate: usize) -> &'a [f64] {
        &self.dq[rate * self.stride..][..self.samples]
    }

    /// Samples of one acceleration.
    pub fn acceleration(&self, rate: usize) -> &'a [f64] {
        &self.ddq[rate * self.stride..][..self.samples]
    }

    /// Samples of one position entry.
    pub fn position(&self, position: usize) -> &'a [f64] {
        &self.q[position * self.stride..][..self.samples]
    }

    /// The sign that elements take of a velocity, `s(v)`.
    pub fn sign(&self, v: f64) -> f64 {
        if self.sign_width > 0.0 { (v / self.sign_width).tanh() } else { sign(v) }
    }

    /// [`MotionBlock::sign`] of every speed.
    pub fn fill_signs(&self, speeds: &[f64], out: &mut [f64]) {
        // The choice outside of the loop leaves one without branches.
        if self.sign_width > 0.0 {
            out.iter_mut().zip(speeds).for_each(|(s, v)| *s = self.sign(*v));
        } else {
            out.iter_mut().zip(speeds).for_each(|(s, v)| *s = sign(*v));
        }
    }

    /// Derivative of [`MotionBlock::sign`]: `(1 - s²) / sign_width`; 0 for the exact sign.
    pub fn sign_slope(&self, v: f64) -> f64 {
        let s = self.sign(v);
        if self.sign_width > 0.0 { (1.0 - s * s) / self.sign_width } else { 0.0 }
    }

    /// Samples of an extra channel.
    pub fn channel(&self, name: &str) -> Option<&'a [f64]> {
        self.channels.iter().find(|(n, _)| *n == name).map(|(_, v)| &v[..self.samples])
    }
}
