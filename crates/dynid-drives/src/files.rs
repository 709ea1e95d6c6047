//! What simulators and firmware take: the robot file with what was found, tables of actuators, a C header.

use std::fmt::Write;
use std::path::Path;

use dynid_export::{LinkFault, LinkInertias, Source};
use dynid_files::FileMember;
use dynid_identify::Error;
use dynid_identify::robot::Robot;
use dynid_model::Inertia;
use dynid_robots::mjcf::{self, JointParameters, PositionActuator};
use dynid_robots::robot;
use dynid_robots::urdf::{self, JointDynamics};
use dynid_servo::identify::EffortUse;
use dynid_servo::{Channel, EncoderAt, ServoJoint, Term};
use serde_json::{Value, json};

use super::{ServoResult, gears};

/// Files of an identification, by name.
#[derive(Debug, Clone, PartialEq)]
pub struct ServoFiles {
    /// Name and text.
    pub files: Vec<(String, String)>,
    /// What they cannot hold, in words.
    pub notes: Vec<String>,
}

/// Friction and rotors that the robot file states.
pub fn stated(robot: &Robot) -> Result<Vec<JointParameters>, Error> {
    let Some(text) = &robot.file.xml else { return Ok(Vec::new()) };
    if robot.file.mjcf.is_some() {
        return Ok(mjcf::parse(text, FileMember::of(&robot.path).path)?.joints);
    }
    let Some(file) = &robot.file.urdf else { return Ok(Vec::new()) };
    let of = |d: JointDynamics| JointParameters {
        joint: d.joint,
        damping: d.damping,
        friction_loss: d.friction,
        ..JointParameters::default()
    };
    Ok(urdf::dynamics(text, file)?.into_iter().map(of).collect())
}

/// Position loops that the robot file states.
pub(super) fn position_actuators(robot: &Robot) -> Result<Vec<PositionActuator>, Error> {
    match (&robot.file.xml, &robot.file.mjcf) {
        (Some(text), Some(_)) => Ok(mjcf::parse(text, FileMember::of(&robot.path).path)?.position_actuators),
        _ => Ok(Vec::new()),
    }
}

impl ServoFiles {
    /// Names of the files of [`ServoResult::files`], in their order.
    ///
    /// # Errors
    /// [`Error::RobotFile`], [`Error::Read`].
    pub fn names(path: &Path) -> Result<Vec<String>, Error> {
        let source = Source::read(path)?;
        let stem = robot::stem(path);
        let mut out = Vec::new();
        if source.is_mjcf() {
            out.push(format!("{stem}.xml"));
            out.extend(source.included().into_iter().map(str::to_owned));
        } else {
            if source.urdf_text().is_some() {
                out.push(format!("{stem}.urdf"));
            }
            out.push(format!("{stem}.mujoco.xml"));
        }
        out.extend(["actuators.xml", "actuators.json", "actuators.h"].map(str::to_owned));
        Ok(out)
    }
}

impl ServoResult {
    /// The files that other programs take:
    ///
    /// | file | what |
    /// |---|---|
    /// | `NAME.urdf`, `NAME.xml` (MJCF) | the robot file with `damping`, `frictionloss` (URDF: `friction`) and `armature`, inertias where they were found, else byte for byte; in MJCF gears that give way as joints `<joint>_gear`, and dry friction that sticks |
    /// | `NAME.mujoco.xml` | for robots that are no MJCF: the robot in MJCF with its actuators |
    /// | `actuators.xml` | MJCF `<actuator>`: one affine actuator per joint, for `<include>` |
    /// | `actuators.json` | stiffness, damping, armature, friction, limits, delay, zero and direction by joint, for simulators of many robots |
    /// | `actuators.h` | the same as C arrays |
    ///
    /// # Errors
    /// [`Error::RobotFile`] if the robot cannot be stated.
    pub fn files(&self) -> Result<ServoFiles, Error> {
        let source = Source::read(&self.robot.path)?;
        let names = self.robot.rate_names();
        // Springs were no part of the fit: they stay as they are.
        let before = stated(&self.robot)?;
        let spring = |name: &String| before.iter().find(|p| p.joint == *name).cloned().unwrap_or_default();
        let joints: Vec<JointParameters> = names
            .iter()
            .zip(&self.found.values.joints)
            .map(|(name, j)| JointParameters {
                joint: name.clone(),
                damping: j.get(Term::Viscous),
                friction_loss: j.get(Term::Coulomb),
                armature: j.get(Term::RotorInertia),
                sticks: true,
                gear: gears::gear(j, 0.0),
                ..spring(name)
            })
            .collect();
        let LinkInertias { links, faults, mut notes } = self.links(&source)?;
        let of_fault =
            |f: &LinkFault| format!("link `{}` of the files is no possible body: {}", f.link, f.fault);
        notes.extend(faults.iter().map(of_fault));
        let mut files = Vec::new();
        let own = FileMember::of(&self.robot.path).path;
        let name = own.file_name().map_or_else(String::new, |n| n.to_string_lossy().into_owned());
        let stem = robot::stem(&self.robot.path);
        let actuators = self.actuators_xml(&names);
        if let Some(text) = source.mjcf_text() {
            let joints = gears::placed(
                joints,
                |joints| Ok(mjcf::edit(text, &own, &links, joints)?.remove(0).text),
                &own,
            )?;
            let mut edited = mjcf::edit(text, &own, &links, &joints)?;
            files.push((format!("{stem}.xml"), edited.remove(0).text));
            let folder = own.parent().unwrap_or(Path::new(""));
            for included in source.included() {
                let text = match edited.iter().find(|f| f.name == included) {
                    Some(file) => file.text.clone(),
                    None => {
                        let path = folder.join(included);
                        dynid_files::input::read_text(&path)
                            .map_err(|source| Error::Read { file: path, source })?
                    }
                };
                files.push((included.to_owned(), text));
            }
        } else {
            if let Some(text) = source.urdf_text() {
                let dynamics: Vec<JointDynamics> = joints
                    .iter()
                    .map(|p| JointDynamics {
                        joint: p.joint.clone(),
                        damping: p.damping,
                        friction: p.friction_loss,
                    })
                    .collect();
                let links: Vec<(String, Option<Inertia>)> =
                    links.iter().map(|(link, inertia)| (link.clone(), Some(*inertia))).collect();
                files.push((format!("{stem}.urdf"), urdf::edit(text, &name, &links, &dynamics)?));
            }
            let mut description = source.description().clone();
            for (name, inertia) in &links {
                let link = description.links.iter_mut().find(|l| l.name == *name);
                link.into_iter().for_each(|l| l.inertia = Some(*inertia));
            }
            let write = |joints: &[JointParameters]| mjcf::from_description(&description, joints);
            let text = write(&gears::placed(joints, write, Path::new(""))?)?;
            files.push((format!("{stem}.mujoco.xml"), with_actuators(&text, &actuators, &names)));
        }
        files.push(("actuators.xml".to_owned(), format!("<mujoco>\n{actuators}</mujoco>\n")));
        let table = serde_json::to_string_pretty(&self.table(&names)).unwrap_or_default();
        files.push(("actuators.json".to_owned(), table + "\n"));
        files.push(("actuators.h".to_owned(), self.header(&names)));
        notes.extend(self.left_out(&names));
        Ok(ServoFiles { files, notes })
    }

    /// Links whose inertia was found; none where bodies are those of the robot file.
    fn links(&self, source: &Source) -> Result<LinkInertias, Error> {
        if self.found.bodies.is_empty() {
            return Ok(LinkInertias::default());
        }
        let mechanism = &self.robot.mechanism;
        let bodies: Vec<Inertia> = (0..mechanism.bodies().len()).map(|b| self.found.values.body(b)).collect();
        LinkInertias::of(source, mechanism, &self.robot.file.description, &bodies)
    }

    /// What damping, friction loss, armature and affine actuators cannot say.
    fn left_out(&self, names: &[String]) -> Vec<String> {
        let mut notes = Vec::new();
        let mut note = |term: Term, what: &str| {
            let has = |(name, j): (&String, &ServoJoint)| (j.get(term) != term.none()).then(|| name.clone());
            let with: Vec<String> = names.iter().zip(&self.found.values.joints).filter_map(has).collect();
            if !with.is_empty() {
                notes.push(format!("{what}: {}", with.join(", ")));
            }
        };
        note(
            Term::LoadFriction,
            "friction that grows with the load has no place in MJCF and URDF, Coulomb friction alone is written",
        );
        note(
            Term::Stiction,
            "friction at rest has no place in MJCF and URDF, Coulomb friction alone is written",
        );
        note(Term::Delay, "delay the commands by the seconds that actuators.json states");
        note(
            Term::Compliance,
            "gears that give way have no place in URDF; MJCF has a joint `<joint>_gear` of their own behind the drive's",
        );
        note(Term::DeadBand, "dead bands are in actuators.json alone");
        note(Term::RateLimit, "rate limits of commands are in actuators.json alone");
        note(Term::SmoothingTime, "smoothing of commands is in actuators.json alone");
        let named = |is: &dyn Fn(&ServoJoint) -> bool| -> Vec<String> {
            let all = names.iter().zip(&self.found.values.joints);
            all.filter(|(_, j)| is(j)).map(|(name, _)| name.clone()).collect()
        };
        let bare = named(&|j| j.get(Term::Compliance) > 0.0 && j.get(Term::RotorInertia) == 0.0);
        if !bare.is_empty() {
            notes.push(format!(
                "a gear needs a rotor on its other side, and is stiff in MJCF without one: {}",
                bare.join(", ")
            ));
        }
        let link = named(&reads_link);
        if !link.is_empty() {
            notes.push(format!(
                "an actuator of MJCF does not read the link behind a gear: those of these joints are efforts, close their loops with the sum of both joints as actuators.json says: {}",
                link.join(", ")
            ));
        }
        notes
    }

    /// `<actuator>` with one affine actuator per joint: `force = gain · ctrl + bias`, `ctrl` the command as it stands in the log; the effort itself for drives that read
    /// a link behind a gear.
    fn actuators_xml(&self, names: &[String]) -> String {
        let mut out = String::from("  <actuator>\n");
        for (name, j) in names.iter().zip(&self.found.values.joints) {
            let (kp, kd) = (j.get(Term::PositionGain), j.get(Term::VelocityGain));
            let constant = kp * j.get(Term::Zero) - j.get(Term::Offset);
            let limit = j.get(Term::EffortLimit);
            let range = match limit.is_finite() {
                true => format!(" forcelimited=\"true\" forcerange=\"{} {limit}\"", -limit),
                false => String::new(),
            };
            let (low, high) = j.command_limits;
            let taken = match low.is_finite() {
                true => format!(" ctrllimited=\"true\" ctrlrange=\"{low} {high}\""),
                false => String::new(),
            };
            let delay = match j.get(Term::Delay) {
                0.0 => String::new(),
                d => format!(" <!-- delay {d} s -->"),
            };
            let name = dynid_robots::mjcf::escaped(name);
            if reads_link(j) {
                let _infallible = writeln!(
                    out,
                    "    <motor name=\"servo_{name}\" joint=\"{name}\"{}/> <!-- reads its link: close the loop outside, `ctrl` is the effort -->",
                    range.replace("force", "ctrl")
                );
                continue;
            }
            let _infallible = writeln!(
                out,
                "    <general name=\"servo_{name}\" joint=\"{name}\" gaintype=\"fixed\" biastype=\"affine\" gainprm=\"{}\" \
                 biasprm=\"{constant} {} {}\"{range}{taken}/>{delay}",
                kp * j.direction,
                -kp,
                -kd
            );
        }
        out + "  </actuator>\n"
    }

    fn table(&self, names: &[String]) -> Value {
        let told_constant = |name: &str| {
            let told = |e: &&EffortUse| e.channel == Channel::Current && e.verdict.is_taken();
            self.found.efforts.iter().filter(told).any(|e| names[e.joint] == name)
        };
        let rows: Vec<Value> = names
            .iter()
            .zip(&self.found.values.joints)
            .map(|(name, j)| {
                let finite = |term: Term| Some(j.get(term)).filter(|x| x.is_finite());
                json!({
                    "joint": name,
                    "stiffness": j.get(Term::PositionGain),
                    "damping": j.get(Term::VelocityGain),
                    "armature": j.get(Term::RotorInertia),
                    "friction": j.get(Term::Coulomb),
                    "static_friction": j.get(Term::Coulomb) + j.get(Term::Stiction),
                    "stribeck_velocity": (j.get(Term::Stiction) > 0.0).then(|| j.get(Term::StribeckVelocity)),
                    "load_friction": j.get(Term::LoadFriction),
                    "viscous_friction": j.get(Term::Viscous),
                    "effort_offset": j.get(Term::Offset),
                    "effort_limit": finite(Term::EffortLimit),
                    "command_limits": j.command_limits.0.is_finite().then_some(j.command_limits),
                    "delay": j.get(Term::Delay),
                    "dead_band": j.get(Term::DeadBand),
                    "rate_limit": finite(Term::RateLimit),
                    "smoothing_time": j.get(Term::SmoothingTime),
                    "gear_stiffness": (j.get(Term::Compliance) > 0.0).then(|| 1.0 / j.get(Term::Compliance)),
                    "gear_damping": j.get(Term::GearDamping),
                    "backlash": j.get(Term::Backlash),
                    "encoder": match j.encoder {
                        EncoderAt::Motor => "motor",
                        EncoderAt::Link => "link",
                    },
                    "torque_constant": told_constant(name).then(|| j.get(Term::TorqueConstant)),
                    "zero": j.get(Term::Zero),
                    "direction": j.direction,
                })
            })
            .collect();
        json!({
            "schema": 1,
            "robot": self.robot.file.description.name,
            "about": "effort = stiffness (direction command + zero - q) - damping dq; friction, armature and offset act against it; command \
                      delayed; with a gear_stiffness the drive moves a rotor behind a spring, and q is what the encoder reads; units N m, rad, s, for joints that slide N, m, s; torque_constant in N m/A",
            "joints": rows,
        })
    }

    fn header(&self, names: &[String]) -> String {
        let joints = &self.found.values.joints;
        let mut out = String::from(
            "/* Drives as identified from commands and positions. Units: N m, rad, s; for joints that slide N, m, s.\n \
             * effort = position_gain (direction command + zero - q) - velocity_gain dq, command delayed;\n \
             * rotor_inertia, viscous, coulomb and offset act against it. */\n#ifndef DYNID_ACTUATORS_H\n#define DYNID_ACTUATORS_H\n\n",
        );
        let _infallible = writeln!(out, "#define DYNID_JOINTS {}\n", names.len());
        let quoted: Vec<String> = names.iter().map(|n| format!("\"{}\"", n.escape_default())).collect();
        let _infallible =
            writeln!(out, "static const char *const dynid_joint[DYNID_JOINTS] = {{{}}};", quoted.join(", "));
        let terms = [
            Term::PositionGain,
            Term::VelocityGain,
            Term::RotorInertia,
            Term::Viscous,
            Term::Coulomb,
            Term::Stiction,
            Term::StribeckVelocity,
            Term::LoadFriction,
            Term::Offset,
            Term::Zero,
            Term::Delay,
            Term::Compliance,
            Term::GearDamping,
            Term::Backlash,
        ];
        for term in terms {
            let values: Vec<String> = joints.iter().map(|j| format!("{:?}", j.get(term))).collect();
            let _infallible = writeln!(
                out,
                "static const double dynid_{}[DYNID_JOINTS] = {{{}}};",
                term.name(),
                values.join(", ")
            );
        }
        let directions: Vec<String> = joints.iter().map(|j| format!("{:?}", j.direction)).collect();
        let _infallible = writeln!(
            out,
            "static const double dynid_direction[DYNID_JOINTS] = {{{}}};",
            directions.join(", ")
        );
        out + "\n#endif\n"
    }
}

/// Whether a drive follows the link behind a gear that gives way.
fn reads_link(joint: &ServoJoint) -> bool {
    joint.get(Term::Compliance) > 0.0 && joint.encoder == EncoderAt::Link
}

/// An MJCF of ours with other actuators: motors of joints that have one give way to it.
fn with_actuators(text: &str, actuators: &str, names: &[String]) -> String {
    let joints: Vec<String> =
        names.iter().map(|n| format!("joint=\"{}\"", dynid_robots::mjcf::escaped(n))).collect();
    let mut out = String::with_capacity(text.len() + actuators.len());
    let mut placed = false;
    for line in text.lines() {
        if line.trim_start().starts_with("<motor ") && joints.iter().any(|j| line.contains(j)) {
            continue;
        }
        if line.trim() == "</mujoco>" && !placed {
            out += actuators;
            placed = true;
        }
        out += line;
        out.push('\n');
    }
    out
}
