//! Identified parameters back into a robot file: URDF, MJCF, JSON, each read back before it is handed out.
//!
//! | identified | URDF | MJCF |
//! |---|---|---|
//! | inertia of a link | `<inertial>`: centre of mass, tensor about it, link axes | `<inertial>` with `fullinertia` |
//! | viscous friction `fv` | `<dynamics damping>` | `damping` |
//! | Coulomb friction `fc` | `<dynamics friction>` | `frictionloss` |
//! | rotor inertia `Ia` | no place, printed | `armature` |
//! | spring `k`, `kq0` | no place, printed | `stiffness`, `springref` |
//! | friction of any other form, known friction | projected onto both: [`FrictionProjection`] | the same |
//! | offset, spring, cyclic effort | no place | left out |
//! | gravity | no place | `<option gravity>` |
//!
//! What is left out is named in [`Exported::notes`]; what that costs is judged on the logs of the identification
//! ([`ExportedRecord`](dynid_identify::estimate::ExportedRecord)). A rotor is not folded into its link: that would turn with the link and
//! add to the efforts of other joints, and would count twice once the simulator is given an armature. The JSON holds everything: all parameters, shape parameters, and what
//! friction of the load refers to.
//!
//! A robot from URDF or MJCF is edited in place: everything that does not change stays byte for byte.
//!
//! **Welded links.** A log shows the body that moves as one: a moving link with everything on fixed joints behind it.
//! Links on fixed joints keep the inertia of the robot file and the moving link gets the difference, as long as that is a
//! possible body; so a tool or sensor can be taken off later with the mass the file states. Where the difference is
//! impossible (the file's values are too far off), the moving link carries the whole body and the others state mass 0.
//! They do not lose their `<inertial>`: loaders make up what is missing (MuJoCo fills in a body of water's density from
//! the link's geometry, PyBullet 1 kg). Efforts are the same either way. Joints that were held still for the
//! identification stay joints, and the links behind them keep the robot file's inertia.
//!
//! **Check.** What is handed out has been read back from its text, and the efforts of the two models differ by at most
//! [`READ_BACK_LIMIT`] of the joint's largest effort.

mod bodies;
mod error;
mod identified;
mod joints;
mod json;
mod judged;
mod links;
mod projection;
mod read_back;

use dynid_identify::Error;
use dynid_model::mechanism::ROOT_JOINT;
use dynid_model::{Description, EffortModel, Inertia, JointKind};
use dynid_robots::mjcf::{self, JointParameters};
use dynid_robots::urdf::{self, JointDynamics};

/// Largest difference that passes: text, centres of mass and frames cost a few digits of sixteen, an error far more.
pub const READ_BACK_LIMIT: f64 = 1e-9;

pub use error::{ExportError, LinkFault};
use identified::inertias;
pub use identified::{Identified, IdentifiedRobot, Source};
use joints::{Format, JointValues};
pub use json::{ElasticJson, JointJson, LinkJson, OtherJson, ROBOT_JSON_SCHEMA, RobotJson, json};
pub use judged::exported;
pub use links::LinkInertias;
pub use projection::FrictionProjection;
pub use read_back::CheckStates;
pub use read_back::with_slipping_bristles;

/// Text that is ready to be written.
#[derive(Debug, Clone, PartialEq)]
pub struct Exported {
    /// The file's text.
    pub text: String,
    /// Files that the robot file includes and that change with it: path from its folder, and text.
    pub included: Vec<(String, String)>,
    /// Largest difference of effort after reading the text back, relative to the joint's largest effort.
    pub difference: f64,
    /// What a user should know: shares of welded links, what was left out, negative friction.
    pub notes: Vec<String>,
}

/// Identified parameters laid out on the links and joints of a robot file.
#[derive(Debug)]
pub struct RobotExport<'a> {
    identified: Identified<'a>,
    source: &'a Source,
    /// The robot file's tree with identified inertias; held joints move.
    description: Description,
    held: Vec<(String, f64)>,
    links: Vec<(String, Inertia)>,
    faults: Vec<LinkFault>,
    notes: Vec<String>,
    projected: Vec<FrictionProjection>,
}

impl<'a> RobotExport<'a> {
    /// Lays parameters out on a robot file.
    ///
    /// # Errors
    /// [`ExportError`]: the file is another robot's; [`Error::Mechanism`]: it is none.
    pub fn new(identified: Identified<'a>, source: &'a Source) -> Result<Self, Error> {
        let mechanism = identified.model.mechanism();
        let mut description = source.file.description.clone();
        description.gravity = mechanism.gravity().0;
        description.couple_mimics = mechanism.follows().is_some();
        description.floating_base = mechanism.bodies().iter().any(|b| b.joint.name == ROOT_JOINT);
        let file = source.path.display().to_string();
        let other = |fault: String| ExportError::OtherRobot { file: file.clone(), fault };
        let held = held_joints(&description, identified.description).map_err(other)?;

        let all = inertias(identified.values).collect::<Vec<_>>();
        // Where sensors measure all loads, no body was identified.
        let measured = mechanism.bodies().is_empty();
        if measured {
            let (links, faults) = (Vec::new(), Vec::new());
            let notes = vec!["sensors measure the load of the joints: no body was identified, links are those of the robot file".to_owned()];
            let projected = Vec::new();
            return Ok(RobotExport {
                identified,
                source,
                description,
                held,
                links,
                faults,
                notes,
                projected,
            });
        }
        let bodies = (mechanism, all.as_slice());
        let LinkInertias { links, faults, notes } =
            LinkInertias::shared(source, &description, &held, bodies)?;
        for (name, inertia) in &links {
            if let Some(link) = description.links.iter_mut().find(|l| l.name == *name) {
                link.inertia = Some(*inertia);
            }
        }
        let projected = Vec::new();
        Ok(RobotExport { identified, source, description, held, links, faults, notes, projected })
    }

    /// Returns the export with projections that were formed when the robot was identified, over the states of its logs. They are used
    /// where they stand for the very parameters of this robot; else friction is projected over the states of the check.
    #[must_use]
    pub fn with_projections(mut self, projected: &[FrictionProjection]) -> Self {
        if projection::fits(projected, self.identified.model, self.identified.values, self.known()) {
            self.projected = projected.to_vec();
        }
        self
    }

    /// Whether a joint has known friction.
    fn known(&self) -> impl Fn(&str) -> bool + use<'a> {
        let laws = self.identified.known_friction;
        move |joint| laws.iter().any(|law| law.joint == joint)
    }

    fn joint_values(&self, format: Format, states: &CheckStates) -> JointValues {
        let Identified { model, values, .. } = self.identified;
        if model.mechanism().bodies().is_empty() || !self.projected.is_empty() {
            return joints::split(&self.identified, format, &self.projected);
        }
        let projected = projection::project(model, values, self.known(), states);
        joints::split(&self.identified, format, &projected)
    }

    /// Links that no body could be: simulators refuse them.
    pub fn faults(&self) -> &[LinkFault] {
        &self.faults
    }

    /// Refuses a robot with impossible links.
    ///
    /// # Errors
    /// [`ExportError::Unphysical`].
    pub fn require_physical(&self) -> Result<(), ExportError> {
        if self.faults.is_empty() {
            return Ok(());
        }
        Err(ExportError::Unphysical { links: self.faults.clone() })
    }

    /// URDF: a URDF is edited in place, so comments, meshes, order and unknown elements stay byte for byte; a robot from
    /// TOML, MJCF or SDF is written anew.
    ///
    /// # Errors
    /// [`Error::RobotFile`]: URDF cannot state the robot; [`ExportError`]: see [`ExportError::ReadBack`].
    pub fn urdf(&self, states: &CheckStates) -> Result<Exported, Error> {
        let JointValues { joints, notes } = self.joint_values(Format::Urdf, states);
        let source = match self.source.urdf_text() {
            Some(text) => text.to_owned(),
            None => urdf::from_description(&self.description)?,
        };
        let name = self.source.path.display().to_string();
        let links: Vec<_> = self.links.iter().map(|(link, i)| (link.clone(), Some(*i))).collect();
        let dynamics: Vec<_> = joints
            .iter()
            .map(|p| JointDynamics { joint: p.joint.clone(), damping: p.damping, friction: p.friction_loss })
            .collect();
        let text = urdf::edit(&source, &name, &links, &dynamics)?;

        let mut read = urdf::parse(&text, "exported URDF")?;
        read.gravity = self.description.gravity;
        read.floating_base = self.description.floating_base;
        let stated = urdf::dynamics(&text, "exported URDF")?;
        let ours = |d: &&JointDynamics| joints.iter().any(|p| p.joint == d.joint);
        let found: Vec<JointParameters> = stated
            .iter()
            .filter(ours)
            .map(|d| JointParameters {
                joint: d.joint.clone(),
                damping: d.damping,
                friction_loss: d.friction,
                ..JointParameters::default()
            })
            .collect();
        let mut notes = [self.notes.clone(), notes].concat();
        let others = stated.iter().filter(|d| !ours(d) && (d.damping != 0.0 || d.friction != 0.0));
        let others: Vec<&str> = others.map(|d| d.joint.as_str()).collect();
        if !others.is_empty() {
            notes.push(format!("friction not identified, left as in the file: {}", others.join(", ")));
        }
        if self.description.gravity != dynid_model::description::STANDARD_GRAVITY {
            notes.push(format!(
                "left out, URDF has no place for it: gravity {:?} m/s²",
                self.description.gravity
            ));
        }
        if self.identified.model.closed().is_some() {
            notes.push(
                "left out, URDF has no place for them: loops; they are in the file beside it".to_owned(),
            );
        }
        if self.source.file.sdf {
            notes.push(
                "SDF is read and not written: this is a new URDF, without the shapes of the SDF".to_owned(),
            );
        }
        let between = self.links.iter().map(|(link, _)| link).filter(|link| self.source.is_between(link));
        let between: Vec<&str> = between.map(String::as_str).collect();
        if !between.is_empty() {
            notes.push(format!(
                "links without mass between joints of one body, which simulators refuse in a URDF: {}",
                between.join(", ")
            ));
        }
        self.checked(Format::Urdf, text, (read, &found), &joints, notes, states)
    }

    /// The robot file itself with identified values: MJCF in place for a robot from MJCF, URDF for any other.
    ///
    /// # Errors
    /// Fails as [`RobotExport::mjcf`] and [`RobotExport::urdf`] do.
    pub fn robot_file(&self, states: &CheckStates) -> Result<Exported, Error> {
        if self.source.is_mjcf() { self.mjcf(states) } else { self.urdf(states) }
    }

    /// MJCF: that of the robot is edited in place (see [`dynid_robots::mjcf::edit`]); other robots are written anew, see
    /// [`dynid_robots::mjcf::from_description`], and [`dynid_robots::mjcf::from_closed`] for mechanisms with loops.
    ///
    /// # Errors
    /// [`Error::RobotFile`]: MJCF cannot state the robot; [`ExportError`]: see [`ExportError::ReadBack`].
    pub fn mjcf(&self, states: &CheckStates) -> Result<Exported, Error> {
        let JointValues { joints, mut notes } = self.joint_values(Format::Mjcf, states);
        if let Some(text) = self.source.mjcf_text() {
            return self.mjcf_in_place(text, &joints, notes, states);
        }
        let text = match self.identified.model.closed() {
            Some(closed) => {
                let machine = closed.machine();
                let (driven, home) = (machine.driven_names(), machine.home_by_joint());
                let loops = mjcf::Loops { closures: machine.closures(), driven: &driven, home: &home };
                notes.push(
                    "loops are soft constraints (`<equality>`), which give way by micrometres: begin with the key `home`, a closed pose"
                        .to_owned(),
                );
                mjcf::from_closed(&self.description, &joints, &loops)?
            }
            None => mjcf::from_description(&self.description, &joints)?,
        };
        let read = mjcf::parse(&text, "exported MJCF")?;
        notes = [self.notes.clone(), notes].concat();
        self.checked(Format::Mjcf, text, (read.description, &read.joints), &joints, notes, states)
    }

    fn mjcf_in_place(
        &self,
        text: &str,
        joints: &[JointParameters],
        notes: Vec<String>,
        states: &CheckStates,
    ) -> Result<Exported, Error> {
        let path = &self.source.path;
        let mut files = mjcf::edit(text, path, &self.links, joints)?;
        let main = files.remove(0);
        let mut read = mjcf::parse_edited(&main.text, path, &files)?;
        let mut notes = [self.notes.clone(), notes].concat();
        let ours = |p: &&JointParameters| joints.iter().any(|j| j.joint == p.joint);
        let found: Vec<JointParameters> = read.joints.iter().filter(ours).cloned().collect();
        let acts = |p: &JointParameters| {
            [p.damping, p.friction_loss, p.armature, p.stiffness].iter().any(|x| *x != 0.0)
        };
        let others = read.joints.iter().filter(|p| !ours(p) && acts(p));
        let others: Vec<&str> = others.map(|p| p.joint.as_str()).collect();
        if !others.is_empty() {
            notes.push(format!(
                "friction, rotor and spring not identified, left as in the file: {}",
                others.join(", ")
            ));
        }
        if read.description.gravity != self.description.gravity {
            notes.push(format!(
                "gravity is left as in the file, {:?} m/s²; the identification had {:?} m/s²",
                read.description.gravity, self.description.gravity
            ));
            read.description.gravity = self.description.gravity;
        }
        read.description.floating_base = self.description.floating_base;
        let back = (read.description, found.as_slice());
        let checked = self.checked(Format::Mjcf, main.text, back, joints, notes, states)?;
        Ok(Exported { included: files.into_iter().map(|f| (f.name, f.text)).collect(), ..checked })
    }

    /// What its URDF cannot state of a mechanism with loops: a robot in TOML that names the URDF, by the file name `urdf`.
    /// `None` for other robots.
    pub fn loops(&self, urdf: &str) -> Option<String> {
        let closed = self.identified.model.closed()?;
        let machine = closed.machine();
        let (driven, home) = (machine.driven_names(), machine.home_by_joint());
        let loops = dynid_robots::toml_robot::Loops {
            name: &self.description.name,
            urdf,
            gravity: self.description.gravity,
            closures: machine.closures(),
            driven: &driven,
            home: &home,
        };
        Some(loops.to_toml())
    }

    /// Compares what was read back with the identified bodies and with `stated`, what the file is to say of the joints.
    fn checked(
        &self,
        format: Format,
        text: String,
        (read, joints): (Description, &[JointParameters]),
        stated: &[JointParameters],
        notes: Vec<String>,
        states: &CheckStates,
    ) -> Result<Exported, Error> {
        let model = self.identified.model;
        let other = |fault| ExportError::OtherRobot { file: format!("exported {}", format.name()), fault };
        let back = read_back::compile(read, joints, &self.held, model).map_err(other)?;
        if model.mechanism().bodies().is_empty() {
            return Ok(Exported { text, included: Vec::new(), difference: 0.0, notes });
        }
        let bodies = self.identified.values[..10 * model.mechanism().bodies().len()].to_vec();
        let meant =
            read_back::with_joints(model.mechanism().clone(), bodies, stated, model).map_err(other)?;
        let difference = read_back::largest_difference(
            (&meant.0, &meant.0.parameters().shape_start(), &meant.1),
            (&back.0, &back.0.parameters().shape_start(), &back.1),
            states,
        );
        let difference = read_back::judge(format.name(), difference)?;
        Ok(Exported { text, included: Vec::new(), difference, notes })
    }
}

/// Joints of a robot file that were held for the identification, and where; `Err` names a joint that is not the same.
pub fn held_joints(file: &Description, recorded: &Description) -> Result<Vec<(String, f64)>, String> {
    let mut held = Vec::new();
    for joint in file.joints.iter().filter(|j| j.kind != JointKind::Fixed) {
        match recorded.joints.iter().find(|j| j.name == joint.name) {
            None => return Err(format!("the estimate knows no joint `{}`", joint.name)),
            Some(r) if r.kind == JointKind::Fixed => {
                held.push((joint.name.clone(), bodies::held_position(joint, r)));
            }
            Some(_) => {}
        }
    }
    Ok(held)
}
