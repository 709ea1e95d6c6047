//! Prior of a payload: a body of which only a largest mass is known.

use dynid_model::element::Payload;
use dynid_model::{Inertia, Mat3, Vec3};

/// Size of an unknown payload, m.
pub const PAYLOAD_SIZE: f64 = 0.15;

/// Prior of one payload of unknown inertia, with the rated mass `M` and the size `ℓ` of [`PAYLOAD_SIZE`]: `M/2` about the
/// joint frame of the link that carries it, alike in all directions with `tr Σ = ℓ² M/2`; standard deviations `M/2` of the
/// mass, `ℓ M/2` of first moments, `ℓ² M/2` of moments of inertia.
#[derive(Debug, Clone, PartialEq)]
pub struct PayloadPrior {
    /// Name.
    pub name: String,
    /// Column of the mass; the other nine follow.
    pub first_column: usize,
    /// Inertia about the joint frame of the link.
    pub inertia: Inertia,
}

impl PayloadPrior {
    pub(super) fn new(payload: &Payload, first_column: usize) -> Self {
        let mass = 0.5 * payload.rated_mass();
        let moment = 2.0 / 3.0 * mass * PAYLOAD_SIZE * PAYLOAD_SIZE;
        let inertia = Inertia::from_com(mass, Vec3([0.0; 3]), &(Mat3::identity() * moment));
        PayloadPrior { name: payload.name().to_owned(), first_column, inertia }
    }

    /// Writes values and standard deviations where they belong.
    pub(super) fn fill(&self, values: &mut [f64], std: &mut [f64]) {
        let (mass, size) = (self.inertia.mass(), PAYLOAD_SIZE);
        let own = self.first_column..self.first_column + 10;
        values[own.clone()].copy_from_slice(&self.inertia.0);
        let deviations = &mut std[own];
        deviations.fill(mass * size * size);
        deviations[0] = mass;
        deviations[1..4].fill(mass * size);
    }
}
