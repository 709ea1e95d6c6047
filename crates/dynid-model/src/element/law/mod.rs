//! Laws of velocity: one function gives an element's columns, their derivatives, adjoints and time derivatives.

mod at_joint;
mod named;
mod terms;

pub use at_joint::AtJoint;
pub(super) use named::stands_for_a_law;
pub use terms::{LinearTerm, ShapeScale, ShapeTerm, units};

use std::fmt::Debug;

use dynid_algebra::scalar::Scalar;
use dynid_algebra::scalar::SmoothSign;

/// The velocity of a joint, as a law reads it.
#[derive(Clone, Copy, Debug)]
pub struct Velocity<S> {
    pub(super) value: S,
    pub(super) sign_width: f64,
    pub(super) temperature: S,
}

impl<S: Scalar> Velocity<S> {
    /// A velocity with an exact sign, rad/s or m/s.
    pub fn new(value: S) -> Self {
        Velocity { value, sign_width: 0.0, temperature: S::zero() }
    }

    /// The velocity itself, rad/s or m/s.
    #[inline(always)]
    pub fn value(self) -> S {
        self.value
    }

    /// Its sign with `s(0) = 0`, smooth where designs and simulations ask for that
    /// ([`MotionBlock::sign_width`](crate::MotionBlock::sign_width)).
    #[inline(always)]
    pub fn sign(self) -> S {
        if self.sign_width > 0.0 {
            self.value.through(SmoothSign { width: self.sign_width })
        } else {
            self.value.sign()
        }
    }

    /// Its magnitude.
    #[inline(always)]
    pub fn speed(self) -> S {
        self.value.magnitude()
    }

    /// The joint's temperature, °C, of a law that [reads it](VelocityLaw::THERMAL); 0 otherwise.
    #[inline(always)]
    pub fn temperature(self) -> S {
        self.temperature
    }
}

/// An effort at a joint that depends on the joint's velocity (and perhaps its temperature) alone:
/// `effort = Σ coefficient · column(velocity; shape)`, with `COLUMNS` coefficients to be estimated and `SHAPES` parameters
/// that enter the columns nonlinearly.
///
/// [`VelocityLaw::columns`] is the whole law. It runs over plain numbers for columns of samples, over dual numbers for
/// derivatives by velocity and shape, over jets for time derivatives: none is written by hand, and
/// [`AtJoint`] makes a [`JointElement`](super::JointElement) of it. So write it with the operations of [`Scalar`], and
/// `#[inline(always)]` where speed matters: then it runs in wide registers.
///
/// At rest columns must be finite. Where one has a kink or a jump, its derivative is the mean of both sides; an infinite
/// derivative counts as 0 ([`Scalar::power`]).
///
/// ```
/// use dynid_model::Scalar;
/// use dynid_model::element::{LinearTerm, ShapeTerm, Velocity, VelocityLaw};
///
/// /// Friction that falls from `fs` at rest to `fc` as `1 / (1 + (v/vs)²)` (Hess & Soom 1990).
/// #[derive(Debug, Clone)]
/// struct HessSoom;
///
/// impl VelocityLaw<1, 2> for HessSoom {
///     fn linear(&self) -> [LinearTerm; 2] {
///         [LinearTerm::effort("fc").friction(), LinearTerm::effort("fs").friction()]
///     }
///     fn shape(&self) -> [ShapeTerm; 1] {
///         [ShapeTerm::speed("vs", 0.001, 0.3)]
///     }
///     fn columns<S: Scalar>(&self, v: Velocity<S>, [vs]: [S; 1]) -> [S; 2] {
///         let x = v.value() / vs;
///         let falling = (S::one() + x * x).recip();
///         [v.sign() * (S::one() - falling), v.sign() * falling]
///     }
/// }
/// ```
pub trait VelocityLaw<const SHAPES: usize, const COLUMNS: usize>: Debug + Send + Sync {
    /// Whether the law reads the temperature of its joint. False by default.
    const THERMAL: bool = false;
    /// The shape parameter that is the exponent of a [power](Scalar::power), if there is one: where it is 1 or 2 (and most often it
    /// is held there), columns take loops without powers. It changes no result. None by default.
    const EXPONENT: Option<usize> = None;
    /// The coefficients of the columns, in their order.
    fn linear(&self) -> [LinearTerm; COLUMNS];
    /// The shape parameters, in the order that [`VelocityLaw::columns`] takes them in.
    fn shape(&self) -> [ShapeTerm; SHAPES];
    /// The columns at one velocity.
    fn columns<S: Scalar>(&self, v: Velocity<S>, shape: [S; SHAPES]) -> [S; COLUMNS];
    /// Whether the effort is friction, which reports on passivity, limits on power and factors of logs then count in. True by
    /// default.
    fn is_friction(&self) -> bool {
        true
    }
    /// A constant temperature, °C, in place of the channel [`temperature_channel`](super::temperature_channel) of the log, for a
    /// law that reads one; none by default.
    fn constant_temperature(&self) -> Option<f64> {
        None
    }
}
