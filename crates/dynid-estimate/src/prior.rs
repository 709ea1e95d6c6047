//! What is known about a robot before any log: a body for every link that could exist, and how far off every parameter
//! may be.

mod bodies;
mod payload;
mod scalars;

pub use bodies::{BodyPrior, Origin};
pub use payload::{PAYLOAD_SIZE, PayloadPrior};
pub use scalars::{speed_limit, typical_channels};

use dynid_model::{EffortModel, Mechanism, RobotModel};
use thiserror::Error;

/// A robot file whose inertias cannot serve as a prior.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum PriorError {
    /// A link with a negative mass.
    #[error("{file}: link `{link}`: expected a mass of at least 0, found {mass} kg")]
    NegativeMass {
        /// Robot file.
        file: String,
        /// The link.
        link: String,
        /// Mass of the link, kg.
        mass: f64,
    },
}

/// Prior values and standard deviations of all linear parameters of a model.
///
/// Deviations with `m0` and `ℓ` of [`BodyPrior`]: mass `0.5 m0`, first moments `0.5 m0 ℓ`,
/// moments of inertia `0.5 m0 ℓ²`. Parameters of elements, by what their columns do (so couplings and new elements need
/// no rule of their own), with the largest entry `c_j` of the column in the row of joint `j`:
///
/// - those that act with acceleration (rotor and motor inertias): `max(|stated|, 0.2 min_j M_jj/c_j, 0.03 s min_j
///   e_j/(v_j c_j))`, `c_j` at unit accelerations, `M_jj` the entry of the mass matrix averaged over random postures, `v_j`
///   the velocity limit: a drive takes about 0.03 s to start its own rotor;
/// - one with both bounds: a third of its range;
/// - the stiffness of a spring between motor and joint: `e/Δ` with a deformation `Δ` of 1e-3 rad (1e-4 m), or that under
///   `e` which the stated stiffness gives; of its cubic part `e/Δ³`, of its damping 0.01 s times the former;
/// - all others: `max(0.5 |stated|, 0.1 min_j e_j/c_j)`, `c_j` the largest at the velocity limits and at 1/4, 1/16, 1/64 and 1/256 of
///   them and next to rest, anywhere in the position range.
///   For Coulomb friction, offset, cyclic torques and the preload of a spring that is a tenth of the effort `e_j`; for viscous
///   friction the same divided by the velocity limit; for a spring, divided by the largest position; for motors behind a
///   transmission, carried through its matrix; for a drive gain, the effort per ampere.
///
/// Payloads have the prior of [`PayloadPrior`], deviations of single logs that of the element that they deviate in.
///
/// `e_j` is the effort limit, but at most ten times the effort of the logs, since many robot files state limits that no
/// drive has; without a limit, the effort of the logs; without that, the effort that the prior bodies need over random
/// states. Velocity limits count up to 4π rad/s (2 m/s); where none is stated, 2 rad/s (0.5 m/s).
#[derive(Debug, Clone, PartialEq)]
pub struct Prior {
    /// Values `x0` in parameter order: the repaired bodies, stated values of elements, zero where nothing is stated.
    pub values: Vec<f64>,
    /// Standard deviations `C0^½` in parameter order, all positive. Those of element parameters also serve as their scales.
    pub std: Vec<f64>,
    /// One entry per body of the mechanism.
    pub bodies: Vec<BodyPrior>,
    /// One entry per payload that is estimated.
    pub payloads: Vec<PayloadPrior>,
    /// Repairs and inventions, in words, each naming its link; none of bodies that follow from others.
    pub warnings: Vec<String>,
}

impl Prior {
    /// Whether the robot file states bodies of its own: not none, and not the same numbers for all, which files of kinematics have in place of some.
    pub fn states_bodies(&self) -> bool {
        let first = self.bodies.first().map(|b| b.inertia);
        let alike = self.bodies.len() > 1 && self.bodies.iter().all(|b| Some(b.inertia) == first);
        !alike && self.bodies.iter().all(|b| b.origin != Origin::Invented)
    }
}

/// Prior of a model.
///
/// - `stated`: per linear parameter the value that the robot file (or the configuration) states.
/// - `efforts`: per output the size of its logged effort (99 % of `|effort|` lies below), N m or N; 0 if unknown.
/// - `file`: the robot file, for messages.
///
/// # Errors
/// [`PriorError::NegativeMass`].
///
/// # Panics
/// If `stated` or `efforts` have the wrong length.
pub fn of(
    model: &RobotModel,
    stated: &[Option<f64>],
    efforts: &[f64],
    file: &str,
) -> Result<Prior, PriorError> {
    let table = model.parameters();
    assert_eq!(stated.len(), table.linear.len(), "one stated value per linear parameter");
    assert_eq!(efforts.len(), model.outputs().len(), "one effort per output");
    let bodies = bodies::bodies(model.mechanism(), stated, file)?;
    let mut values: Vec<f64> = bodies.iter().flat_map(|b| b.inertia.0).collect();
    let mut std: Vec<f64> = bodies.iter().flat_map(BodyPrior::standard_deviations).collect();
    let inertias = values.clone();
    let first = values.len();
    values.extend(stated[first..].iter().map(|v| v.unwrap_or(0.0)));
    std.extend(scalars::standard_deviations(model, &inertias, stated, efforts));
    let payloads: Vec<PayloadPrior> =
        model.payloads().map(|(p, column)| PayloadPrior::new(p, column)).collect();
    for payload in &payloads {
        payload.fill(&mut values, &mut std);
    }
    let follows = |body: usize| model.ties().is_some_and(|ties| ties.body_follows(body));
    let own = bodies.iter().enumerate().filter(|(b, _)| !follows(*b));
    let warnings = own.filter_map(|(_, body)| body.warning()).collect();
    Ok(Prior { values, std, bodies, payloads, warnings })
}

/// Lengths of a robot with their words, to name constants of regroupings: `(0.45, "distance joint 2-3")`.
///
/// Numbers are those of parameter symbols. A distance that has parts along several axes of its frame counts part by
/// part, `"distance joint 2-3 along x"`, since these are what regroupings hold; a part above 99.9 % of the distance is the
/// distance, and parts below 0.1 % do not count.
pub fn link_lengths(mechanism: &Mechanism) -> Vec<(f64, String)> {
    let mut lengths = Vec::new();
    for (b, body) in mechanism.bodies().iter().enumerate() {
        let Some(parent) = body.parent else { continue };
        let offset = body.joint.placement.translation;
        let words = format!("distance joint {}-{}", parent + 1, b + 1);
        let parts: Vec<(usize, f64)> =
            offset.0.iter().map(|x| x.abs()).enumerate().filter(|(_, x)| *x > 1e-3 * offset.norm()).collect();
        lengths.extend(parts.into_iter().map(|(axis, x)| {
            let whole = x > 0.999 * offset.norm();
            let along = if whole { String::new() } else { format!(" along {}", ["x", "y", "z"][axis]) };
            (x, words.clone() + &along)
        }));
    }
    lengths
}
