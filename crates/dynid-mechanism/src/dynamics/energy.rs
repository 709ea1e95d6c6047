//! Kinetic and potential energy.

use super::{Dynamics, DynamicsWorkspace, State};
use dynid_algebra::inertia::Inertia;

/// Energies in J; the potential is zero at the base origin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Energy {
    /// `½ q̇ᵀ M q̇`.
    pub kinetic: f64,
    /// `-Σ g · (m p + R h)`.
    pub potential: f64,
}

impl Dynamics {
    /// Energies of a state. `inertias`: ten standard parameters per body in file order.
    pub fn energy(
        &self,
        q: &[f64],
        dq: &[f64],
        inertias: &[f64],
        work: &mut DynamicsWorkspace<f64>,
    ) -> Energy {
        let n = self.rates();
        let mass = self.mass_matrix(q, inertias, work);
        let kinetic = (0..n)
            .map(|i| 0.5 * dq[i] * mass[i * n..(i + 1) * n].iter().zip(dq).map(|(m, v)| m * v).sum::<f64>())
            .sum();
        let zero = vec![0.0; n];
        let gravity = self.gravity_of(&State { q, dq: &zero, ddq: &zero, gravity: None });
        let potential = self
            .forward_kinematics(q, work)
            .iter()
            .zip(inertias.chunks_exact(10))
            .map(|(frame, phi)| {
                let mut ten = [0.0; 10];
                ten.copy_from_slice(phi);
                let body = Inertia(ten);
                let moment =
                    frame.translation.scale(body.mass()) + frame.rotation.mul_vec(body.first_moment());
                -gravity.dot(moment)
            })
            .sum();
        Energy { kinetic, potential }
    }
}
