//! A prior body for every moving link: as stated, repaired, or invented.

use dynid_model::symmetric::{Square, raise_eigenvalues};
use dynid_model::{Body, Inertia, Mat3, Mechanism, Vec3};

use super::PriorError;

/// Eigenvalues of the scaled pseudo-inertia up to this share of the largest count as zero.
const ZERO: f64 = 1e-9;
/// What they are raised to.
const RAISED: f64 = 1e-3;
/// Mass of a body of a robot that states none at all, kg.
const DEFAULT_MASS: f64 = 5.0;
/// Mass of a body for which zeros are stated, as a share of the mean of those with a mass.
const MASSLESS_SHARE: f64 = 1e-3;
/// Least size of a body, m.
const LEAST_SIZE: f64 = 0.05;
/// Rounding of a link's own mass, taken from that of the merged body, relative to the masses involved.
const MASS_ROUNDING: f64 = 1e-9;

/// Where the inertia of a prior body comes from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Origin {
    /// The robot file, as it is.
    Stated,
    /// The robot file, with eigenvalues of the scaled pseudo-inertia raised.
    Repaired {
        /// How many of the four were raised.
        raised: usize,
        /// Least eigenvalue before, as a share of the largest.
        least: f64,
    },
    /// Nothing or no mass is stated (or nothing that could be repaired): a uniform sphere.
    Invented,
    /// The robot file states zeros beside bodies with a mass (carriers, crosses of universal joints): a sphere of 0.1 % of
    /// their mean mass.
    Massless,
}

/// Prior of one body: a moving link and what is welded to it.
#[derive(Debug, Clone, PartialEq)]
pub struct BodyPrior {
    /// The links that make up the body, the moving one first.
    pub links: Vec<String>,
    /// Inertia about the joint frame; its pseudo-inertia is positive definite.
    pub inertia: Inertia,
    /// Size `ℓ`, m: the largest of the distance of the centre of mass from the joint frame, `√(tr Σ/m)` with the second
    /// moment `Σ`, the distance to the next joint, 0.05 m.
    pub size: f64,
    /// Where the inertia comes from.
    pub origin: Origin,
}

impl BodyPrior {
    /// Prior standard deviations in the order of [`dynid_model::inertia::PARAMETER_NAMES`].
    pub fn standard_deviations(&self) -> [f64; 10] {
        let (mass, size) = (0.5 * self.inertia.mass(), self.size);
        let mut std = [mass * size * size; 10];
        std[0] = mass;
        std[1..4].fill(mass * size);
        std
    }

    /// What was done to the body, in words; `None` if it is as stated.
    pub fn warning(&self) -> Option<String> {
        let link = &self.links[0];
        let welded = match &self.links[1..] {
            [] => String::new(),
            more => format!(
                " (with {} welded to it)",
                more.iter().map(|l| format!("`{l}`")).collect::<Vec<_>>().join(", ")
            ),
        };
        match self.origin {
            Origin::Stated | Origin::Massless => None,
            Origin::Repaired { least, .. } => Some(format!(
                "link `{link}`{welded}: no body has the inertia that the robot file states (least eigenvalue of its \
                 pseudo-inertia {:.1} % of the largest); the prior is the nearest body with at least {} %",
                100.0 * least,
                100.0 * RAISED
            )),
            Origin::Invented => Some(format!(
                "link `{link}`{welded}: the robot file states no inertia to start from; the prior is a uniform sphere of \
                 {:.2} kg",
                self.inertia.mass()
            )),
        }
    }
}

/// Priors of all bodies of a mechanism. `stated`: values of the linear parameters, links first.
pub(super) fn bodies(
    mechanism: &Mechanism,
    stated: &[Option<f64>],
    file: &str,
) -> Result<Vec<BodyPrior>, PriorError> {
    for body in mechanism.bodies() {
        check_masses(body, file)?;
    }
    let written = |b: usize| {
        let mut phi = [0.0; 10];
        for (to, from) in phi.iter_mut().zip(&stated[10 * b..]) {
            *to = (*from)?;
        }
        Some(Inertia(phi))
    };
    let written: Vec<Option<Inertia>> = (0..mechanism.bodies().len()).map(written).collect();
    let stated: Vec<Option<Inertia>> = written.iter().map(|i| i.filter(|i| i.mass() > 0.0)).collect();
    let total: f64 = stated.iter().flatten().map(Inertia::mass).sum();
    let share = if total > 0.0 { total / stated.len() as f64 } else { DEFAULT_MASS };
    let massless = |b: usize| {
        let zeros = written[b] == Some(Inertia::default());
        (zeros && total > 0.0).then(|| MASSLESS_SHARE * total / stated.iter().flatten().count() as f64)
    };
    Ok(mechanism
        .bodies()
        .iter()
        .enumerate()
        .map(|(b, body)| {
            let next = farthest_joint(mechanism, b);
            let links = std::iter::once(&body.name).chain(body.fixed_links.iter().map(|l| &l.name));
            let (inertia, origin) = stated[b]
                .and_then(|inertia| repaired(inertia, next.norm()))
                .or_else(|| massless(b).map(|mass| (sphere(mass, next), Origin::Massless)))
                .unwrap_or_else(|| (sphere(share, next), Origin::Invented));
            BodyPrior { links: links.cloned().collect(), size: size(&inertia, next.norm()), inertia, origin }
        })
        .collect())
}

/// A link's own mass must not be negative, even where the merged body's is not.
fn check_masses(body: &Body, file: &str) -> Result<(), PriorError> {
    let welded = || body.fixed_links.iter().filter_map(|l| Some((&l.name, l.inertia?.mass())));
    let size = body.inertia.mass().abs() + welded().map(|(_, m)| m.abs()).sum::<f64>();
    let own = body.inertia.mass() - welded().map(|(_, m)| m).sum::<f64>();
    for (link, mass) in std::iter::once((&body.name, own)).chain(welded()) {
        if mass < -MASS_ROUNDING * size {
            return Err(PriorError::NegativeMass { file: file.to_owned(), link: link.clone(), mass });
        }
    }
    Ok(())
}

/// Where the farthest joint on a body sits in its frame; zero on the last body.
fn farthest_joint(mechanism: &Mechanism, body: usize) -> Vec3<f64> {
    let children = mechanism.bodies().iter().filter(|c| c.parent == Some(body));
    children
        .map(|c| c.joint.placement.translation)
        .fold(Vec3::zero(), |far, at| if at.norm() > far.norm() { at } else { far })
}

fn size(inertia: &Inertia, next_joint: f64) -> f64 {
    let mass = inertia.mass();
    let [xx, yy, zz] = [inertia.0[4], inertia.0[7], inertia.0[9]];
    let spread = (0.5 * (xx + yy + zz) / mass).max(0.0).sqrt();
    LEAST_SIZE.max(next_joint).max(spread).max(inertia.first_moment().norm() / mass)
}

/// Uniform sphere half way to the next joint, radius half the distance (at least 0.05 m).
fn sphere(mass: f64, next_joint: Vec3<f64>) -> Inertia {
    let radius = LEAST_SIZE.max(0.5 * next_joint.norm());
    let about_com = Mat3::identity() * (0.4 * mass * radius * radius);
    Inertia::from_com(mass, next_joint.scale(0.5), &about_com)
}

/// The inertia if its pseudo-inertia is positive definite, else the repaired one; `None` if there is nothing to repair.
fn repaired(inertia: Inertia, next_joint: f64) -> Option<(Inertia, Origin)> {
    let size = size(&inertia, next_joint);
    let raised = raise_eigenvalues(&scaled_pseudo_inertia(&inertia, size), ZERO, RAISED)?;
    if raised.raised == 0 {
        return Some((inertia, Origin::Stated));
    }
    let least = raised.eigenvalues[0] / raised.eigenvalues[3];
    let repaired = from_scaled_pseudo_inertia(&raised.matrix, size);
    (repaired.mass() > 0.0).then_some((repaired, Origin::Repaired { raised: raised.raised, least }))
}

/// Pseudo-inertia `[[Σ, h], [hᵀ, m]]`, `Σ = ½ tr(I) 1 - I`, with lengths divided by `size` (kg).
fn scaled_pseudo_inertia(inertia: &Inertia, size: f64) -> Square<4> {
    let (p, scale) = (inertia.pseudo_inertia(), [size, size, size, 1.0]);
    std::array::from_fn(|i| std::array::from_fn(|j| p[i][j] / (scale[i] * scale[j])))
}

fn from_scaled_pseudo_inertia(p: &Square<4>, size: f64) -> Inertia {
    let scale = [size, size, size, 1.0];
    let whole = std::array::from_fn(|i| std::array::from_fn(|j| p[i][j] * (scale[i] * scale[j])));
    Inertia::from_pseudo_inertia(&whole)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_pseudo_inertia_goes_there_and_back() {
        let inertia = Inertia([2.0, 0.1, -0.2, 0.3, 0.5, 0.01, -0.02, 0.6, 0.03, 0.7]);
        let back = from_scaled_pseudo_inertia(&scaled_pseudo_inertia(&inertia, 0.3), 0.3);
        for (a, b) in back.0.iter().zip(inertia.0) {
            assert!((a - b).abs() < 1e-15);
        }
    }

    #[test]
    fn a_repair_moves_no_more_than_it_must() {
        // A flat plate with its three moments violating the triangle inequality by 10 %.
        let bad = Inertia([1.0, 0.0, 0.0, 0.0, 0.01, 0.0, 0.0, 0.01, 0.0, 0.022]);
        let (good, origin) = repaired(bad, 0.0).unwrap();
        assert!(matches!(origin, Origin::Repaired { raised: 1, least } if least < 0.0), "{origin:?}");
        assert_eq!(good.physical_fault(), None);
        // Σzz was (0.01 + 0.01 - 0.022)/2 = -0.001; in units of size² = 0.021 the largest eigenvalue is the mass.
        assert!((good.mass() - 1.0).abs() < 1e-14);
        let sigma_zz = 1e-3 * 0.021;
        assert!((good.0[4] - (0.011 + sigma_zz)).abs() < 1e-14, "{good:?}");
        assert!((good.0[9] - 0.022).abs() < 1e-14);
        assert_eq!(repaired(good, 0.0).unwrap(), (good, Origin::Stated));
    }
}
