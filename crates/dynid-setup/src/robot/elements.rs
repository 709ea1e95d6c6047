//! Elements of a robot in a run.

use dynid_files::closest;
use dynid_robots::{CouplingSpec, TieSpec, with_laws};

use super::Robot;
use crate::Error;
use crate::elements::ElementPlan;
use crate::known_friction::{FrictionErrors, KnownFriction};
use crate::per_joint::PerJoint;
use crate::settings::{Clearance, Settings, serde_name};

impl ElementPlan {
    /// The plan of a run: elements of the robot file, then of the configuration, known friction with them.
    ///
    /// `moves`: whether the joint of a rate moves.
    ///
    /// # Errors
    /// Fails as [`ElementPlan::new`] and [`KnownLaws::of_joints`](crate::known_friction::KnownLaws) do.
    pub fn of_run(
        settings: &Settings,
        robot: &Robot,
        moves: impl Fn(usize) -> bool,
    ) -> Result<ElementPlan, Error> {
        let mut spec = robot.elements.clone();
        spec.registry =
            with_laws(spec.registry, &settings.law).map_err(|(name, fault)| Error::Law { name, fault })?;
        for (joint, list) in &settings.elements.joint {
            spec.per_joint.retain(|(j, _)| j != joint);
            spec.per_joint.push((joint.clone(), list.clone()));
        }
        spec.couplings.extend(settings.couplings.iter().cloned());
        for tie in &settings.tie {
            robot.check_tie(tie, &spec.couplings)?;
            spec.ties.push(tie.clone());
        }
        let journals = match settings.elements.clearance {
            Some(_) if spec.clearance.is_empty() => {
                let expected = "a robot file with `clearance` at a joint";
                return Err(Error::setting("elements.clearance", expected, "none"));
            }
            Some(Clearance::Ideal) => {
                spec = spec.with_ideal_bearings();
                None
            }
            Some(Clearance::Journals) | None => robot.journals()?,
        };
        let mut plan =
            ElementPlan::new(&robot.mechanism, &spec, settings.elements.default.as_deref(), moves)?
                .with_loops(robot.closed.clone())
                .with_journals(journals);
        let names = plan.names(&robot.mechanism);
        let law = settings.elements.friction;
        if !law.replaces_any(plan.registry(), &plan.per_rate) {
            let found = format!("`{}` where no joint that moves has any", serde_name(&law));
            return Err(Error::setting(
                "elements.friction",
                "a joint with friction, which the law replaces",
                found,
            ));
        }
        plan.per_rate = plan.per_rate.iter().map(|list| law.of_joint(plan.registry(), list)).collect();
        if let Some(idle) =
            settings.law.keys().find(|name| !plan.per_rate.iter().flatten().any(|e| e == *name))
        {
            let expected = "a law that the elements of a joint name";
            return Err(Error::setting("law", expected, format!("`{idle}`, which none does")));
        }
        if let Some(known) = &settings.elements.known {
            plan.known = known.of_joints(&names)?;
            plan.known_source = Some(known.source.clone());
            check_temperature(&known.temperature, &plan.known)?;
            plan.free_errors = known.errors == FrictionErrors::Free;
        }
        Ok(plan)
    }
}

impl Robot {
    /// Refuses a tie that names nothing of the robot.
    fn check_tie(&self, tie: &TieSpec, couplings: &[CouplingSpec]) -> Result<(), Error> {
        let d = &self.file.description;
        let joints = d.joints.iter().map(|j| j.name.as_str());
        let motors = self.file.elements.elastic.iter().map(|e| e.motor.as_str());
        let coupled = couplings.iter().flat_map(|c| c.motors.iter().map(String::as_str));
        let links = d.links.iter().map(|l| l.name.as_str());
        let owners: Vec<&str> = joints.chain(motors).chain(coupled).chain(links).collect();
        tie.unknown(&owners).map_or(Ok(()), |name| {
            let owner = name.rsplit_once('.').map_or(name.as_str(), |(owner, _)| owner);
            let known: Vec<String> = owners.iter().map(|o| (*o).to_owned()).collect();
            Err(Error::UnknownParameter {
                name: name.clone(),
                meant: closest(owner, &known).map(str::to_owned),
            })
        })
    }
}

/// Refuses a temperature that no law reads: of a joint whose known friction does not change with it, or of all joints where
/// none's does.
fn check_temperature(stated: &PerJoint, known: &[KnownFriction]) -> Result<(), Error> {
    let reads = |joint: &str| known.iter().any(|law| law.joint == joint && law.is_thermal());
    let unread = match stated {
        PerJoint::All(t) => (!known.iter().any(KnownFriction::is_thermal)).then(|| t.to_string()),
        PerJoint::Each(map) => {
            map.iter().find(|(joint, _)| !reads(joint)).map(|(joint, t)| format!("{joint} = {t}"))
        }
    };
    let expected = "temperatures of joints whose known friction changes with them";
    unread.map_or(Ok(()), |found| Err(Error::setting("elements.temperature", expected, found)))
}
