//! Where the energy of a mechanism with clearance goes.

use super::system::{Contact, System, power};

/// Energy from start to end of a simulation, J.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct ClearanceEnergy {
    /// Work of the drives.
    pub drives: f64,
    /// Energy with every exchange counted as positive, `∫ Σ|τ q̇| dt`: what errors are held against.
    pub exchanged: f64,
    /// Gain of kinetic and potential energy of the bodies.
    pub bodies: f64,
    /// Gain of elastic energy of the contacts.
    pub contacts: f64,
    /// Taken by damping in the direction of the normal.
    pub damping: f64,
    /// Taken by friction in the bearings.
    pub friction: f64,
    /// Taken by other elements, springs' store included.
    pub elements: f64,
}

impl ClearanceEnergy {
    /// Work in minus stored minus dissipated.
    pub fn unbalanced(&self) -> f64 {
        self.drives - self.bodies - self.contacts - self.damping - self.friction - self.elements
    }

    /// Error of the balance as a share of all that was exchanged; `None` where nothing was.
    pub fn relative_error(&self) -> Option<f64> {
        let exchanged = self.exchanged + self.damping.abs() + self.friction + self.bodies.abs();
        (exchanged > 0.0).then(|| self.unbalanced().abs() / exchanged)
    }
}

/// Powers at one instant, W.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Powers {
    drives: f64,
    exchanged: f64,
    damping: f64,
    friction: f64,
    elements: f64,
}

impl Powers {
    /// Of the motion last placed with accelerations `a` of the free coordinates.
    pub(super) fn of(system: &mut System<'_, '_>, a: &[f64]) -> Self {
        let effort = system.efforts(a);
        let mut out = Powers::default();
        for rate in &system.driven {
            let driven = effort[*rate] * system.dq[*rate];
            out.drives += driven;
            out.exchanged += driven.abs();
        }
        for c in 0..system.contacts.len() {
            let found = system.contact(c);
            let Contact { element, parameters: [k, ..] } = system.contacts[c];
            // An open contact stores nothing, however its journal came out of the bearing.
            let elastic = k * element.law.at(found.penetration, 0.0).elastic;
            let elastic = if system.is_closed(c) { elastic } else { 0.0 };
            out.damping += (found.normal_force - elastic) * found.penetration_rate;
            out.friction -= found.friction_force * found.sliding;
        }
        out.elements = power(&system.element_efforts(), &system.dq);
        out
    }

    pub(super) fn add_to(self, energy: &mut ClearanceEnergy, weight: f64) {
        energy.drives += weight * self.drives;
        energy.exchanged += weight * self.exchanged;
        energy.damping += weight * self.damping;
        energy.friction += weight * self.friction;
        energy.elements += weight * self.elements;
    }
}

/// Energy of the bodies, elastic energy of the contacts, of the motion last placed.
pub(super) fn stored(system: &mut System<'_, '_>) -> [f64; 2] {
    let (q, dq) = (system.q.clone(), system.dq.clone());
    let plant = system.plant();
    let bodies = plant.energy(&q, &dq, system.workspace());
    let contacts = (0..system.contacts.len()).filter(|c| system.is_closed(*c)).map(|c| {
        let Contact { element, parameters: [k, ..] } = system.contacts[c];
        k * element.law.stored_energy(system.contact(c).penetration)
    });
    [bodies.kinetic + bodies.potential, contacts.sum()]
}
