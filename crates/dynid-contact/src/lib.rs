//! Laws of normal contact and sliding friction between a journal and its bearing.
//!
//! A [`ContactLaw`] turns penetration, its rate and the speed of impact into a normal force; [`SlidingFriction`] gives the
//! direction of the tangential one. Neither knows a mechanism. The rough contact starts from a [`FractalSurface`].
//!
//! Source: Sun, Han, Li & Li, *Robotics* 2021, 10(1), 36.

mod bearing;
mod error;
mod friction;
mod law;
mod material;
mod roughness;
mod surface;
mod validity;

pub use bearing::JournalBearing;
pub use error::ContactError;
pub use friction::SlidingFriction;
pub use law::{
    ContactForce, ContactLaw, FractalContact, FractalLankaraniNikravesh, FractalSettings, Hertz,
    HertzStiffness, KelvinVoigt, LankaraniNikravesh,
};
pub use material::Material;
pub use surface::{
    Asperity, AsperityStage, FractalSurface, PressureFactor, SurfaceConstants, SurfaceSettings,
};
pub use validity::{ContactValidity, SpotValidity};
