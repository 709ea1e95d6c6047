//! The identified model as a robot file.

use dynid_io::urdf::{self, JointDynamics};
use dynid_model::{EffortModel, Inertia, JointKind};

use crate::Error;
use crate::identify::Identification;

impl Identification {
    /// URDF of the robot with identified inertias, viscous and Coulomb friction.
    ///
    /// A moving link gets the inertia of the whole rigid body that moves with it; links welded to it lose their own
    /// `<inertial>`, so that nothing counts twice. A URDF is edited in place (everything else stays byte for byte); a
    /// robot from TOML is written anew. Joints that were locked for the identification keep their links' inertias in
    /// the body they were merged into.
    ///
    /// # Errors
    /// [`Error::RobotFile`], [`Error::Read`].
    pub fn urdf(&self) -> Result<String, Error> {
        let mechanism = self.model.mechanism();
        let mut links: Vec<(String, Option<Inertia>)> = Vec::new();
        for (body, inertia) in mechanism.bodies().iter().zip(self.inertias()) {
            links.push((body.name.clone(), writable(inertia)));
            for fixed in &body.fixed_links {
                if fixed.inertia.is_some() {
                    links.push((fixed.name.clone(), None));
                }
            }
        }
        let value = |joint: &str, symbol: &str| {
            self.model.parameters().column(&format!("{joint}.{symbol}")).map(|c| self.values()[c])
        };
        let joints: Vec<JointDynamics> = mechanism
            .bodies()
            .iter()
            .filter(|b| b.joint.kind != JointKind::Floating)
            .filter_map(|b| {
                let name = &b.joint.name;
                let (damping, friction) = (value(name, "fv"), value(name, "fc"));
                (damping.is_some() || friction.is_some()).then(|| JointDynamics {
                    joint: name.clone(),
                    damping: damping.unwrap_or(0.0),
                    friction: friction.unwrap_or(0.0),
                })
            })
            .collect();
        let source = match &self.robot.file.urdf {
            Some(path) => {
                std::fs::read_to_string(path).map_err(|source| Error::Read { file: path.into(), source })?
            }
            None => urdf::from_description(&self.robot.file.description)?,
        };
        Ok(urdf::edit(&source, &self.robot.path.display().to_string(), &links, &joints)?)
    }
}

/// URDF states a centre of mass, which a body without mass does not have: first moments of massless bodies are lost, so
/// such a body is written without inertial.
fn writable(inertia: Inertia) -> Option<Inertia> {
    (inertia.mass() != 0.0).then_some(inertia)
}
