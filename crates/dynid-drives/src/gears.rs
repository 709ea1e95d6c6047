//! What is known of gears that give way, of the configuration, then of the robot file; what MJCF says of them.

use std::collections::BTreeSet;
use std::path::Path;

use dynid_identify::Error;
use dynid_identify::robot::Robot;
use dynid_model::{AddedInertia, Description, Dynamics, JointKind, Mechanism};
use dynid_robots::RobotFileError;
use dynid_robots::mjcf::{self, GearJoint, JointParameters};
use dynid_servo::{ServoJoint, Term};

/// Stated numbers of gears, by joint.
pub(crate) struct Gears {
    pub(crate) stiffness: Vec<Option<f64>>,
    pub(crate) damping: Vec<Option<f64>>,
    pub(crate) backlash: Vec<Option<f64>>,
}

impl Gears {
    /// With what the robot file states beside; `find`: terms that are to be found, `reads_link`: encoders sit on links.
    ///
    /// # Errors
    /// [`Error::Setting`] for what is said of gears that are stiff, and joints that the robot file calls elastic without their stiffness.
    pub(crate) fn beside(
        mut self,
        robot: &Robot,
        names: &[String],
        find: &[Term],
        reads_link: bool,
    ) -> Result<Self, Error> {
        for elastic in &robot.elements.elastic {
            let Some(j) = names.iter().position(|n| *n == elastic.joint) else { continue };
            self.stiffness[j] = self.stiffness[j].or(elastic.k1);
            self.damping[j] = self.damping[j].or(elastic.d);
        }
        let soft = |j: usize| self.stiffness[j].is_some() || find.contains(&Term::Compliance);
        for elastic in &robot.elements.elastic {
            let at = names.iter().position(|n| *n == elastic.joint);
            if at.is_some_and(|j| !soft(j)) {
                let key = format!("servo.gear_stiffness.{}", elastic.joint);
                let expected = "a stiffness, `k1` in the robot file, or `find = [\"compliance\"]`, for the joint is elastic";
                return Err(Error::setting(&key, expected, "none"));
            }
        }
        let any = (0..names.len()).any(soft);
        let expected =
            "`gear_stiffness` beside it, or `find = [\"compliance\"]`: it acts on gears that give way";
        for (key, stated) in [("gear_damping", &self.damping), ("backlash", &self.backlash)] {
            if let Some(j) = (0..names.len()).find(|j| stated[*j].is_some_and(|x| x > 0.0) && !soft(*j)) {
                return Err(Error::setting(&format!("servo.{key}.{}", names[j]), expected, "none"));
            }
        }
        let finds = find.contains(&Term::GearDamping) || find.contains(&Term::Backlash);
        match [("servo.encoder", reads_link), ("servo.find", finds)]
            .into_iter()
            .find(|(_, said)| *said && !any)
        {
            Some((key, _)) => Err(Error::setting(key, expected, "none")),
            None => Ok(self),
        }
    }

    /// Sets what is stated of a joint, and returns the terms of it.
    pub(crate) fn set(&self, joint: &mut ServoJoint, j: usize) -> BTreeSet<Term> {
        let stated = [
            (Term::Compliance, self.stiffness[j].map(|k| 1.0 / k)),
            (Term::GearDamping, self.damping[j]),
            (Term::Backlash, self.backlash[j]),
        ];
        let mut out = BTreeSet::new();
        for (term, value) in stated {
            if let Some(x) = value {
                joint.set(term, x);
                out.insert(term);
            }
        }
        out
    }
}

/// The gear of a joint as MJCF has it, if it gives way; a motor without a rotor would have no inertia there.
pub(crate) fn gear(joint: &ServoJoint, mobility: f64) -> Option<GearJoint> {
    let compliance = joint.get(Term::Compliance);
    (compliance > 0.0 && joint.get(Term::RotorInertia) > 0.0).then(|| GearJoint {
        stiffness: 1.0 / compliance,
        damping: joint.get(Term::GearDamping),
        backlash: joint.get(Term::Backlash),
        mobility,
    })
}

/// Joints whose gears know the mobility that they have in the model that `write` makes of stiff ones.
pub(crate) fn placed(
    mut joints: Vec<JointParameters>,
    write: impl Fn(&[JointParameters]) -> Result<String, RobotFileError>,
    path: &Path,
) -> Result<Vec<JointParameters>, Error> {
    if joints.iter().all(|j| j.gear.is_none_or(|g| g.backlash == 0.0)) {
        return Ok(joints);
    }
    let stiff: Vec<JointParameters> =
        joints.iter().map(|j| JointParameters { gear: None, ..j.clone() }).collect();
    let robot = mjcf::parse(&write(&stiff)?, path)?;
    let named = |source| Error::Mechanism { file: path.display().to_string(), source };
    // Constraints between joints are none of the inertia that MuJoCo takes.
    let description = Description { couple_mimics: false, ..robot.file.description };
    let mechanism = description.build().map_err(named)?;
    // Rotors of joints that no drive was found of are in the model too.
    let all: Vec<(JointParameters, f64)> = robot
        .joints
        .into_iter()
        .zip(robot.drawn)
        .map(|(p, drawn)| (joints.iter().find(|own| own.joint == p.joint).cloned().unwrap_or(p), drawn))
        .collect();
    let mobility: Vec<f64> = joints.iter().map(|j| mobility(&mechanism, &all, &j.joint)).collect();
    for (joint, mobility) in joints.iter_mut().zip(mobility) {
        joint.gear.iter_mut().for_each(|gear| gear.mobility = mobility);
    }
    Ok(joints)
}

/// Acceleration of the link of a gear that gives way against its motor per effort between them, all other joints and gears free, where the model is as drawn;
/// `joints`: those of the model with their positions there.
fn mobility(mechanism: &Mechanism, joints: &[(JointParameters, f64)], joint: &str) -> f64 {
    let dynamics = Dynamics::new(mechanism);
    let mut q = Vec::with_capacity(mechanism.joint_positions());
    let mut rotors = vec![0.0; mechanism.joint_rates()];
    let mut own = None;
    for body in mechanism.bodies() {
        if body.joint.kind == JointKind::Floating {
            q.extend([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]);
            continue;
        }
        let Some((p, drawn)) = joints.iter().find(|(p, _)| p.joint == body.joint.name) else {
            q.extend(std::iter::repeat_n(0.0, body.joint.positions()));
            continue;
        };
        q.push(*drawn);
        // The rotor of a gear that gives way is on its other side.
        rotors[body.rate] = if p.gear.is_none() { p.armature } else { 0.0 };
        if p.joint == joint {
            own = Some((body.rate, p.armature));
        }
    }
    let Some((own, rotor)) = own else { return f64::NAN };
    let added = AddedInertia::Diagonal(&rotors);
    dynamics.mobility(&q, &mechanism.inertia_vector(), added, own).map_or(f64::NAN, |link| link + 1.0 / rotor)
}
