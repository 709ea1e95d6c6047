//! Virtual logs of drives that are told positions: commands and positions, no effort.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use dynid_drives::{FoundDrives, ServoFault, set_terms};
use dynid_identify::Error;
use dynid_identify::elements::ElementPlan;
use dynid_model::RobotModel;
use dynid_servo::{Chain, Rollout, Scheme, ServoJoint, ServoLog, ServoValues, Term};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use super::trajectory::Reference;
use super::{SimulateMode, SimulateSettings, SimulatedLog};

/// Steps of the simulation in one of the identification: what steps do to the motion is then no part of both alike.
const FINER: f64 = 4.0;

/// Makes a virtual log of commands and positions: the trajectory is what the drives are told, [`SimulateSettings::drives`] what they are, with
/// `values` (`j1.coulomb`) over it. `lock` and `gravity` stand before what that file says. Joints stick, commands are held between samples or not as the file says, and encoders round.
///
/// Of the log `command` and `position` are in the numbers of the encoders; `clean` holds positions of joints, velocities, accelerations (zeros) and
/// efforts of the drives.
///
/// # Errors
/// [`Error::Setting`], [`Error::Unsupported`]; what is wrong with the file of drives or the robot; [`ServoFault::Fit`] if the loop is unstable.
pub fn simulate_drives(
    robot: &Path,
    lock: &BTreeMap<String, f64>,
    gravity: Option<[f64; 3]>,
    settings: &SimulateSettings,
) -> Result<SimulatedLog, Error> {
    settings.check()?;
    settings.check_effect()?;
    refuse(settings)?;
    let drives = settings.drives.as_deref();
    let drives =
        drives.ok_or_else(|| Error::setting("drives", "the `servo.json` of `dynid servo`", "none"))?;
    let found = FoundDrives::read(drives, robot, lock, gravity)?;
    let joints = found.robot.rate_names();
    let mut known = found.settings(1.0 / settings.rate_hz)?;
    set_terms(&joints, &settings.values, &mut known.joints)?;
    let mechanism = &found.robot.mechanism;
    let bare = ElementPlan::new(mechanism, &dynid_robots::ElementSpec::default(), Some(&[]), |_| true)?;
    let model: Arc<RobotModel> = Arc::new(bare.model(mechanism)?);
    let mut rng = ChaCha8Rng::seed_from_u64(settings.seed);
    let (reference, channels) = Reference::new(&model, settings, &mut rng)?;
    if let Some(channel) = channels.keys().next() {
        let expected = "a motion without channels beside `drives`, which read none";
        return Err(Error::setting("follow", expected, channel));
    }
    let duration_s = reference.duration().unwrap_or(settings.duration_s);
    let rows = (duration_s * settings.rate_hz + 1e-6).floor() as usize + 1;
    let time: Vec<f64> = (0..rows).map(|s| s as f64 / settings.rate_hz).collect();
    let mut command = vec![Vec::with_capacity(rows); joints.len()];
    for t in &time {
        for ((told, joint), [q, ..]) in command.iter_mut().zip(&known.joints).zip(reference.at(*t)) {
            told.push(joint.reading(q));
        }
    }
    let mut log = ServoLog::new("simulated", time.clone(), command.clone(), command.clone());
    let first = |(u, joint): (&Vec<f64>, &ServoJoint)| joint.taken(u.first().copied().unwrap_or(0.0));
    log.start = Some(command.iter().zip(&known.joints).map(first).collect());
    let scheme = Scheme {
        step_s: found.file.simulation.step_s.min(1.0 / settings.rate_hz) / FINER,
        sign_width: 0.0,
        middle: true,
        load: known.load,
        hold: known.hold,
        effort_at: known.effort_at,
        effort_span_s: 1e-3 / settings.rate_hz,
    };
    let values = ServoValues { joints: known.joints, inertias: mechanism.inertia_vector() };
    let still = || vec![vec![0.0; rows]; joints.len()];
    let (mut reading, mut q, mut dq, mut effort) = (still(), still(), still(), still());
    for chain in Chain::all(mechanism) {
        let run = Rollout::new(&chain, scheme, &[]).run(&values, &log, |row| {
            for (k, j) in chain.joints.iter().enumerate() {
                reading[*j][row.row] = row.reading[k];
                q[*j][row.row] = values.joints[*j].position(row.reading[k]);
                dq[*j][row.row] = row.velocity[k];
                effort[*j][row.row] = row.effort[k];
            }
        });
        run.map_err(|lost| ServoFault::Fit(lost.into()))?;
    }
    let units = mechanism.effort_units();
    for (reading, unit) in reading.iter_mut().zip(units).filter(|_| settings.encoder_bits > 0) {
        let turn = if unit == "N" { 1.0 } else { std::f64::consts::TAU };
        let step = turn / 2f64.powi(settings.encoder_bits as i32);
        reading.iter_mut().for_each(|x| *x = (*x / step).round() * step);
    }
    let of_joint = |(name, joint): (&String, &dynid_servo::ServoJoint)| -> Vec<(String, f64)> {
        let terms = Term::ALL.into_iter().filter(|term| joint.get(*term) != term.none());
        let terms = terms.map(|term| (format!("{name}.{term}"), joint.get(term)));
        terms.chain([(format!("{name}.direction"), joint.direction)]).collect()
    };
    Ok(SimulatedLog {
        undriven: vec![true; joints.len()],
        truth: joints.iter().zip(&values.joints).flat_map(of_joint).collect(),
        clean: [q, dq, still(), effort],
        command: Some(command),
        position: reading,
        velocity: None,
        effort: still(),
        channels: Vec::new(),
        clean_channels: Vec::new(),
        experiment: None,
        clearance: None,
        warnings: found.warnings,
        joints,
        time,
    })
}

/// Refuses what a log without efforts has no use for.
fn refuse(settings: &SimulateSettings) -> Result<(), Error> {
    let usual = SimulateSettings::default();
    let idle = [
        (
            "mode",
            settings.mode != SimulateMode::InverseDynamics,
            "no mode beside `drives`, whose loops are simulated",
        ),
        (
            "effort_noise",
            settings.effort_noise != usual.effort_noise,
            "no value beside `drives`, whose logs hold no effort",
        ),
        (
            "delay_samples",
            settings.delay_samples.is_some(),
            "`delay` of the joints under [values], which is that of the drives, in s",
        ),
        ("channels", !settings.channels.is_empty(), "none beside `drives`"),
        ("fleet", settings.fleet.is_some(), "no table beside `drives`"),
        ("settle_s", settings.settle_s.is_some(), "no value beside `drives`: the robot begins at rest"),
        ("journal_noise", settings.journal_noise > 0.0, "no value beside `drives`"),
    ];
    match idle.iter().find(|(_, found, _)| *found) {
        Some((key, _, expected)) => Err(Error::setting(key, expected, "one")),
        None => Ok(()),
    }
}
