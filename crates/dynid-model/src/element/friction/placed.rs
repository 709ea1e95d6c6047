//! Laws of velocity at a joint, with a name for each of their shape parameters.

use crate::element::law::{AtJoint, stands_for_a_law};
use crate::element::{ShapeSetting, laws};

/// A struct that places a law with named settings of its shape parameters.
macro_rules! placed {
    ($(#[$doc:meta])* $name:ident, $law:expr, $kind:ty, $columns:literal) => {
        $(#[$doc])*
        #[derive(Debug, Clone, PartialEq)]
        pub struct $name {
            /// Rate it acts on.
            pub rate: usize,
        }

        impl $name {
            fn at_joint(&self) -> AtJoint<$kind, 0, $columns> {
                AtJoint { rate: self.rate, law: $law, shape: [] }
            }
        }

        stands_for_a_law!($name);
    };
    ($(#[$doc:meta])* $name:ident, $law:expr, $kind:ty, $columns:literal, $shapes:literal {
        $($(#[$field_doc:meta])* $field:ident),+
    }) => {
        $(#[$doc])*
        #[derive(Debug, Clone, PartialEq)]
        pub struct $name {
            /// Rate it acts on.
            pub rate: usize,
            $($(#[$field_doc])* pub $field: ShapeSetting,)+
        }

        impl $name {
            /// With the law's own settings, for speeds up to about 1 rad/s or m/s.
            pub fn new(rate: usize) -> Self {
                Self::scaled(rate, 1.0)
            }

            /// With the law's own settings, for speeds up to `v_max`, rad/s or m/s, above 0.
            pub fn scaled(rate: usize, v_max: f64) -> Self {
                let [$($field),+] = AtJoint::<$kind, $shapes, $columns>::new(rate, $law, v_max).shape;
                $name { rate, $($field),+ }
            }

            fn at_joint(&self) -> AtJoint<$kind, $shapes, $columns> {
                AtJoint { rate: self.rate, law: $law, shape: [$(self.$field),+] }
            }
        }

        stands_for_a_law!($name);
    };
}

placed!(
    /// [`laws::Coulomb`] at a joint.
    Coulomb, laws::Coulomb, laws::Coulomb, 1
);
placed!(
    /// [`laws::Viscous`] at a joint.
    Viscous, laws::Viscous, laws::Viscous, 1
);
placed!(
    /// [`laws::ViscousMagnitude`] at a joint.
    ViscousMagnitude, laws::ViscousMagnitude, laws::ViscousMagnitude, 1
);
placed!(
    /// [`laws::Offset`] at a joint.
    Offset, laws::Offset, laws::Offset, 1
);
placed!(
    /// [`laws::Asymmetric`] at a joint.
    AsymmetricFriction, laws::Asymmetric, laws::Asymmetric, 4
);
placed!(
    /// [`laws::Arctangent`] at a joint.
    Arctangent, laws::Arctangent, laws::Arctangent, 1, 1 {
        /// Slope parameter `f_b`, positive.
        fb
    }
);
placed!(
    /// [`laws::Tanh`] at a joint.
    TanhFriction, laws::Tanh, laws::Tanh, 1, 1 {
        /// Width `w`, positive.
        w
    }
);
placed!(
    /// [`laws::Power`] at a joint.
    PowerLaw, laws::Power, laws::Power, 1, 1 {
        /// Exponent `p`, positive.
        p
    }
);
placed!(
    /// [`laws::Sigmoid`] at a joint.
    Sigmoid, laws::Sigmoid, laws::Sigmoid, 1, 2 {
        /// Slope `φ₂`, positive.
        phi2,
        /// Shift `φ₃`.
        phi3
    }
);
placed!(
    /// [`laws::SigmoidOffset`] at a joint.
    SigmoidOffset, laws::SigmoidOffset, laws::SigmoidOffset, 1, 2 {
        /// Slope `α`, positive.
        alpha,
        /// Shift `ν`.
        nu
    }
);
placed!(
    /// [`laws::Stribeck`] at a joint.
    Stribeck, laws::Stribeck, laws::Stribeck, 2, 2 {
        /// Stribeck speed `v_s`, positive.
        vs,
        /// Exponent `δ`, positive.
        delta
    }
);
placed!(
    /// [`laws::StribeckViscous`] at a joint.
    StribeckViscous, laws::StribeckViscous, laws::StribeckViscous, 1, 2 {
        /// Stribeck speed `v_s`, positive.
        vs,
        /// Exponent `δ`, positive.
        delta
    }
);

/// [`laws::ExponentialViscous`] at a joint.
#[derive(Debug, Clone, PartialEq)]
pub struct ExponentialViscous {
    /// Rate it acts on.
    pub rate: usize,
    /// Rate `σ3` at `T0`, s/rad or s/m, positive.
    pub sigma3: ShapeSetting,
    /// Change of `σ3` per kelvin.
    pub sigma3_slope: ShapeSetting,
    /// Exponent `σ4` at `T0`, positive.
    pub sigma4: ShapeSetting,
    /// Change of `σ4` per kelvin.
    pub sigma4_slope: ShapeSetting,
    /// `T0`, °C. Default 25.
    pub reference_temperature: f64,
    /// Temperatures for which the law holds, °C, ascending. Default: all.
    pub temperature_range: (f64, f64),
    /// A constant temperature in place of the channel, °C. Default: none.
    pub temperature: Option<f64>,
}

impl ExponentialViscous {
    /// Friction of a rate with both slopes of the shape held at 0.
    pub fn new(rate: usize) -> Self {
        let AtJoint { law, shape: [sigma3, sigma3_slope, sigma4, sigma4_slope], .. } =
            AtJoint::new(rate, laws::ExponentialViscous::default(), 1.0);
        let laws::ExponentialViscous { reference_temperature, temperature_range, temperature } = law;
        ExponentialViscous {
            rate,
            sigma3,
            sigma3_slope,
            sigma4,
            sigma4_slope,
            reference_temperature,
            temperature_range,
            temperature,
        }
    }
}

impl ExponentialViscous {
    fn at_joint(&self) -> AtJoint<laws::ExponentialViscous, 4, 2> {
        let law = laws::ExponentialViscous {
            reference_temperature: self.reference_temperature,
            temperature_range: self.temperature_range,
            temperature: self.temperature,
        };
        let shape = [self.sigma3, self.sigma3_slope, self.sigma4, self.sigma4_slope];
        AtJoint { rate: self.rate, law, shape }
    }
}

stands_for_a_law!(ExponentialViscous);
