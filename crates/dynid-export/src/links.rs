//! Inertias of links, from those of the bodies of a mechanism.

use dynid_identify::Error;
use dynid_model::{Description, Inertia, Mechanism};

use super::bodies::{self, Shares};
use super::{ExportError, LinkFault, Source, held_joints};

/// Inertias of links, from those of the bodies that they make up.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct LinkInertias {
    /// Links whose inertia changes, about their own frame.
    pub links: Vec<(String, Inertia)>,
    /// Links that no body could be: simulators refuse them.
    pub faults: Vec<LinkFault>,
    /// What welded links and moving ones got, in words.
    pub notes: Vec<String>,
}

impl LinkInertias {
    /// Gives the inertias of a mechanism's bodies to the links of the robot file that it was made of. `described`: the robot as the mechanism has it, joints that were
    /// held fixed.
    ///
    /// # Errors
    /// [`ExportError::OtherRobot`]; [`Error::Mechanism`]: the file is no robot.
    pub fn of(
        source: &Source,
        mechanism: &Mechanism,
        described: &Description,
        bodies: &[Inertia],
    ) -> Result<Self, Error> {
        let mut description = source.file.description.clone();
        description.couple_mimics = mechanism.follows().is_some();
        let file = source.path.display().to_string();
        let other = |fault: String| ExportError::OtherRobot { file: file.clone(), fault };
        let held = held_joints(&description, described).map_err(other)?;
        Self::shared(source, &description, &held, (mechanism, bodies))
    }

    pub(crate) fn shared(
        source: &Source,
        description: &Description,
        held: &[(String, f64)],
        (mechanism, bodies): (&Mechanism, &[Inertia]),
    ) -> Result<Self, Error> {
        let file = source.path.display().to_string();
        let other = |fault: String| ExportError::OtherRobot { file: file.clone(), fault };
        let mut still = description.clone();
        let named = |source| Error::Mechanism { file: file.clone(), source };
        still.lock(held).map_err(named)?;
        let target = still.build().map_err(named)?;
        let shared = target
            .bodies()
            .iter()
            .map(|body| {
                let found = mechanism.bodies().iter().position(|b| b.joint.name == body.joint.name);
                let same = found.filter(|b| mechanism.bodies()[*b].name == body.name);
                same.map(|b| bodies[b])
                    .ok_or_else(|| other(format!("joint `{}` was not identified", body.joint.name)))
            })
            .collect::<Result<Vec<_>, _>>()?;
        if let Some(missing) = mechanism.bodies().iter().find(|b| target.joint_index(&b.joint.name).is_err())
        {
            return Err(other(format!("it has no moving joint `{}`", missing.joint.name)).into());
        }
        let Shares { links, mut faults, notes } = bodies::share(&target, &still, held, &shared);
        // MJCF has several joints in one body, and no link between them.
        faults.retain(|fault| !source.is_between(&fault.link));
        Ok(LinkInertias { links, faults, notes })
    }
}
