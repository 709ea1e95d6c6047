//! What a joint behind a position-controlled drive has of its own.

use std::fmt;

/// A parameter of a joint and its drive.
///
/// Units are those of a joint that turns; for a joint that slides read N for N m and m for rad.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Term {
    /// Position gain `k_p`, N m/rad.
    PositionGain,
    /// Velocity gain `k_d`, N m s/rad.
    VelocityGain,
    /// Rotor inertia as the joint feels it (armature) `I_a`, kg m².
    RotorInertia,
    /// Viscous friction `F_v`, N m s/rad.
    Viscous,
    /// Coulomb friction `F_c`, N m.
    Coulomb,
    /// Friction at rest above Coulomb friction `F_s - F_c`, N m.
    Stiction,
    /// Stribeck velocity `v_s`, rad/s.
    StribeckVelocity,
    /// Friction per load `μ`: N m per N m that the gear carries.
    LoadFriction,
    /// Constant effort against the drive `o`, N m.
    Offset,
    /// Position of the joint where its encoder reads zero `z`, rad.
    Zero,
    /// Time from a command in the log to what it does `d`, s; of command and measurement together.
    Delay,
    /// Largest effort of the drive, N m; infinite: none.
    EffortLimit,
    /// Half width of the dead band of the control error `δ`, rad: of a register, or half the backlash as the loop sees it.
    DeadBand,
    /// Largest speed of the command, rad/s; infinite: none.
    RateLimit,
    /// Time constant of the first-order smoothing of the command `t_c`, s; 0: none.
    SmoothingTime,
    /// Effort per measured current `k_t`, behind the gear, N m/A.
    TorqueConstant,
    /// What a measured effort reads without any, N m.
    EffortZero,
    /// What a measured current reads without any, A.
    CurrentZero,
    /// Time by which measured efforts and currents lie behind the positions of the same rows, s; negative: ahead.
    EffortDelay,
    /// Compliance of the gear between drive and link `1/k`, rad/(N m); 0: stiff.
    Compliance,
    /// Damping of the gear `d`, N m s/rad.
    GearDamping,
    /// Backlash of the gear, rad: the drive turns so far from flank to flank.
    Backlash,
}

impl Term {
    /// Number of terms.
    pub const COUNT: usize = 22;

    /// All terms, in order.
    pub const ALL: [Term; Term::COUNT] = [
        Term::PositionGain,
        Term::VelocityGain,
        Term::RotorInertia,
        Term::Viscous,
        Term::Coulomb,
        Term::Stiction,
        Term::StribeckVelocity,
        Term::LoadFriction,
        Term::Offset,
        Term::Zero,
        Term::Delay,
        Term::EffortLimit,
        Term::DeadBand,
        Term::RateLimit,
        Term::SmoothingTime,
        Term::TorqueConstant,
        Term::EffortZero,
        Term::CurrentZero,
        Term::EffortDelay,
        Term::Compliance,
        Term::GearDamping,
        Term::Backlash,
    ];

    /// Name in files.
    pub fn name(self) -> &'static str {
        match self {
            Term::PositionGain => "position_gain",
            Term::VelocityGain => "velocity_gain",
            Term::RotorInertia => "rotor_inertia",
            Term::Viscous => "viscous",
            Term::Coulomb => "coulomb",
            Term::Stiction => "stiction",
            Term::StribeckVelocity => "stribeck_velocity",
            Term::LoadFriction => "load_friction",
            Term::Offset => "offset",
            Term::Zero => "zero",
            Term::Delay => "delay",
            Term::EffortLimit => "effort_limit",
            Term::DeadBand => "dead_band",
            Term::RateLimit => "rate_limit",
            Term::SmoothingTime => "smoothing_time",
            Term::TorqueConstant => "torque_constant",
            Term::EffortZero => "effort_zero",
            Term::CurrentZero => "current_zero",
            Term::EffortDelay => "effort_delay",
            Term::Compliance => "compliance",
            Term::GearDamping => "gear_damping",
            Term::Backlash => "backlash",
        }
    }

    /// The term with this name.
    pub fn named(name: &str) -> Option<Term> {
        Term::ALL.into_iter().find(|term| term.name() == name)
    }

    /// Unit for a joint that turns or slides.
    pub fn unit(self, slides: bool) -> &'static str {
        match (self, slides) {
            (Term::PositionGain, false) => "N m/rad",
            (Term::PositionGain, true) => "N/m",
            (Term::VelocityGain | Term::Viscous | Term::GearDamping, false) => "N m s/rad",
            (Term::VelocityGain | Term::Viscous | Term::GearDamping, true) => "N s/m",
            (Term::RotorInertia, false) => "kg m^2",
            (Term::RotorInertia, true) => "kg",
            (Term::Coulomb | Term::Stiction | Term::Offset | Term::EffortLimit | Term::EffortZero, false) => {
                "N m"
            }
            (Term::Coulomb | Term::Stiction | Term::Offset | Term::EffortLimit | Term::EffortZero, true) => {
                "N"
            }
            (Term::StribeckVelocity | Term::RateLimit, false) => "rad/s",
            (Term::StribeckVelocity | Term::RateLimit, true) => "m/s",
            (Term::LoadFriction, _) => "1",
            (Term::Zero | Term::DeadBand | Term::Backlash, false) => "rad",
            (Term::Zero | Term::DeadBand | Term::Backlash, true) => "m",
            (Term::Delay | Term::SmoothingTime | Term::EffortDelay, _) => "s",
            (Term::TorqueConstant, false) => "N m/A",
            (Term::TorqueConstant, true) => "N/A",
            (Term::CurrentZero, _) => "A",
            (Term::Compliance, false) => "rad/(N m)",
            (Term::Compliance, true) => "m/N",
        }
    }

    /// Whether the term is an effort per something, so that all such terms of a joint scale together when nothing of known
    /// weight pins them.
    pub fn scales_with_effort(self) -> bool {
        matches!(
            self,
            Term::PositionGain
                | Term::VelocityGain
                | Term::RotorInertia
                | Term::Viscous
                | Term::Coulomb
                | Term::Stiction
                | Term::Offset
                | Term::EffortLimit
                | Term::TorqueConstant
        )
    }

    /// Whether the term is one of a sensor, which no simulator asks for.
    pub fn is_of_sensor(self) -> bool {
        matches!(self, Term::EffortZero | Term::CurrentZero | Term::EffortDelay)
    }

    /// Whether the term is one of a gear that gives way.
    pub fn is_of_gear(self) -> bool {
        matches!(self, Term::Compliance | Term::GearDamping | Term::Backlash)
    }

    /// Values that physics allows.
    pub fn range(self) -> (f64, f64) {
        match self {
            Term::Offset | Term::Zero | Term::EffortZero | Term::CurrentZero | Term::EffortDelay => {
                (f64::NEG_INFINITY, f64::INFINITY)
            }
            // A gear that loses half of what it carries; one that loses all of it locks itself.
            Term::LoadFriction => (0.0, 0.5),
            Term::StribeckVelocity => (1e-3, f64::INFINITY),
            Term::RateLimit | Term::EffortLimit | Term::TorqueConstant => (1e-9, f64::INFINITY),
            _ => (0.0, f64::INFINITY),
        }
    }

    /// Value of a joint that has nothing of the kind.
    pub fn none(self) -> f64 {
        match self {
            Term::EffortLimit | Term::RateLimit => f64::INFINITY,
            Term::StribeckVelocity => 0.1,
            Term::TorqueConstant => 1.0,
            _ => 0.0,
        }
    }
}

impl fmt::Display for Term {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}
