//! Forms of friction laws, and what points they need.

use std::fmt;

/// Viscous friction over speed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ViscousForm {
    /// `F_v v`.
    Linear,
    /// `s(v) σ2 (1 - exp(-|σ3 v|^σ4))`.
    Exponential,
}

/// Which terms a friction law has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LawForm {
    /// Friction falls from static `F_s` to Coulomb `F_c`; else Coulomb alone.
    pub stribeck: bool,
    /// Viscous friction.
    pub viscous: ViscousForm,
    /// `σ2, σ3, σ4` are straight lines of the temperature; exponential viscous friction only.
    pub thermal: bool,
    /// A constant.
    pub offset: bool,
}

impl LawForm {
    /// The ladder of laws without temperature, simplest first.
    pub const LADDER: [LawForm; 4] = [
        LawForm { stribeck: false, viscous: ViscousForm::Linear, thermal: false, offset: false },
        LawForm { stribeck: false, viscous: ViscousForm::Exponential, thermal: false, offset: false },
        LawForm { stribeck: true, viscous: ViscousForm::Linear, thermal: false, offset: false },
        LawForm { stribeck: true, viscous: ViscousForm::Exponential, thermal: false, offset: false },
    ];

    /// Number of free coefficients.
    pub fn coefficients(&self) -> usize {
        self.linear().len() + self.shape().len()
    }

    /// Distinct speeds that it needs, one more than it has coefficients at one temperature.
    pub fn speeds_needed(&self) -> usize {
        1 + LawForm { thermal: false, offset: false, ..*self }.coefficients()
    }

    /// Symbols of the linear coefficients.
    pub(super) fn linear(&self) -> Vec<&'static str> {
        let mut list = vec!["fc"];
        if self.stribeck {
            list.push("fs");
        }
        match self.viscous {
            ViscousForm::Linear => list.push("fv"),
            ViscousForm::Exponential => list.push("sigma2"),
        }
        if self.has_lines() {
            list.push("sigma2_slope");
        }
        if self.offset {
            list.push("fo");
        }
        list
    }

    /// Symbols of the free shape parameters, in the order of the model's.
    pub(super) fn shape(&self) -> Vec<&'static str> {
        let mut list = Vec::new();
        if self.stribeck {
            list.push("vs");
        }
        if self.viscous == ViscousForm::Exponential {
            list.push("sigma3");
            if self.has_lines() {
                list.push("sigma3_slope");
            }
            list.push("sigma4");
            if self.has_lines() {
                list.push("sigma4_slope");
            }
        }
        list
    }

    pub(super) fn has_lines(&self) -> bool {
        self.thermal && self.viscous == ViscousForm::Exponential
    }
}

impl fmt::Display for LawForm {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(if self.stribeck { "Stribeck" } else { "Coulomb" })?;
        f.write_str(match self.viscous {
            ViscousForm::Linear => " and linear viscous friction",
            ViscousForm::Exponential => " and exponential viscous friction",
        })?;
        if self.has_lines() {
            f.write_str(" with thermal lines")?;
        }
        if self.offset { f.write_str(" and an offset") } else { Ok(()) }
    }
}
