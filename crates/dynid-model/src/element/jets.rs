//! Elements over signals that carry their time derivatives.

use dynid_algebra::scalar::SmoothSign;
use dynid_algebra::scalar::{Jet, Scalar};

/// Motion at one instant with time derivatives of every signal.
#[derive(Clone, Copy, Debug)]
pub struct JetMotion<'a> {
    /// Positions: the jet of a position holds position, rate and acceleration.
    pub q: &'a [Jet],
    /// Rates.
    pub dq: &'a [Jet],
    /// Accelerations.
    pub ddq: &'a [Jet],
    /// Extra channels by name.
    pub channels: &'a [(&'a str, Jet)],
    /// Speed over which signs are smooth, see [`MotionBlock::sign_width`](crate::MotionBlock::sign_width).
    pub sign_width: f64,
}

impl JetMotion<'_> {
    /// The sign that elements take of a velocity; the exact one is constant in time.
    pub fn sign(&self, v: Jet) -> Jet {
        let w = self.sign_width;
        if w > 0.0 { v.through(SmoothSign { width: w }) } else { v.sign() }
    }

    /// An extra channel.
    pub fn channel(&self, name: &str) -> Option<Jet> {
        self.channels.iter().find(|(n, _)| *n == name).map(|(_, jet)| *jet)
    }
}
