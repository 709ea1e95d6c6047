//! Virtual experiments with closed mechanisms.

use dynid_model::closed::PoseError;
use dynid_model::{EffortModel, MotionBlock};
use dynid_sim::*;

use super::{robot, rough, worst};

/// Sines about the home positions of the drives.
fn sines(plant: &ClosedPlant, amplitude: f64) -> impl Fn(f64) -> Vec<Wanted> + use<> {
    let machine = plant.machine();
    let home: Vec<f64> = machine.driven().iter().map(|r| machine.home()[machine.position_of(*r)]).collect();
    move |t| {
        let wave = |(k, home): (usize, &f64)| {
            let w = 3.0 + 0.7 * k as f64;
            let (s, c) = (w * t + k as f64).sin_cos();
            [home + amplitude * s, amplitude * w * c, -amplitude * w * w * s]
        };
        home.iter().enumerate().map(wave).collect()
    }
}

fn settings(duration_s: f64, imperfections: Imperfections) -> ExperimentSettings {
    ExperimentSettings { duration_s, log_rate_hz: 500.0, imperfections, ..Default::default() }
}

/// Largest difference between true effort and the effort model of the true motion, relative to the largest effort.
fn disagreement(plant: &ClosedPlant, log: &VirtualLog) -> f64 {
    let rows = log.time.len();
    let [q, dq, ddq] = [&log.truth.q, &log.truth.dq, &log.truth.ddq].map(|s| s.concat());
    let motion = MotionBlock { sign_width: plant.sign_width(), ..MotionBlock::plain(rows, &q, &dq, &ddq) };
    let mut effort = vec![0.0; plant.drives() * rows];
    plant.model().efforts(&motion, plant.shape(), plant.linear(), rows, &mut effort);
    worst(&effort, &log.truth.effort.concat())
}

#[test]
fn the_truth_of_the_drives_obeys_the_effort_model() {
    for (name, amplitude, friction) in
        [("fourbar", 0.4, 0.3), ("fivebar", 0.3, 0.3), ("delta", 0.2, 0.1), ("stewart", 0.04, 10.0)]
    {
        let Some(machine) = robot(name, None, None) else { return };
        let mut plant = rough(machine.clone(), friction, 1e-3);
        let nominal = rough(machine, friction, 1e-3);
        let reference = sines(&nominal, amplitude);
        let clean = settings(0.5, Imperfections::none());
        let found = run_closed(&mut plant, &nominal, &reference, &clean).unwrap();
        let log = &found.log;
        assert_eq!((log.position.len(), log.time.len()), (plant.drives(), 251));
        assert_eq!((&log.position, &log.effort), (&log.truth.q, &log.truth.effort));
        let off: f64 = log
            .time
            .iter()
            .enumerate()
            .flat_map(|(row, t)| {
                reference(*t).into_iter().zip(&log.position).map(move |(w, q)| (w[0] - q[row]).abs())
            })
            .fold(0.0, f64::max);
        let wrong = disagreement(&plant, log);
        let scale = found.energy.drive_work.abs() + found.energy.element_work.abs();
        let missing = found.energy.residual().abs() / scale;
        println!(
            "{name}: efforts off by {wrong:.1e}, off the reference by {off:.1e}, energy {missing:.1e}, {:?}",
            found.integration
        );
        assert!(wrong < 1e-9 && off < 0.1 * amplitude && missing < 1e-6);

        let faulty = settings(0.3, Imperfections { dropped_share: 0.02, ..Imperfections::default() });
        let found = run_closed(&mut plant, &nominal, &reference, &faulty).unwrap();
        let again = run_closed(&mut plant, &nominal, &reference, &faulty).unwrap();
        assert_eq!(found.log, again.log);
        assert!(found.log.dropped_rows > 0 && found.ripple.len() == plant.drives());
        assert_ne!(found.log.effort, found.log.truth.effort);
        assert!(found.ripple.iter().all(|r| r.amplitude > 0.0));
        assert!(disagreement(&plant, &found.log) < 1e-9, "{name}: with imperfections");
    }
}

/// Three drives for two motions: a reference of one motion works, one that pulls the drives apart is refused.
#[test]
fn over_actuated_machines_follow_references_of_one_motion() {
    let drives = ["left_crank", "right_crank", "left_distal"];
    let Some(machine) = robot("fivebar", None, Some(&drives)) else { return };
    let mut plant = rough(machine.clone(), 0.1, 1e-3);
    let nominal = rough(machine.clone(), 0.1, 1e-3);
    let independent: Vec<usize> =
        machine.independent().iter().map(|r| machine.driven().iter().position(|d| d == r).unwrap()).collect();
    let sines = sines(&nominal, 0.2);
    let together = |t: f64| {
        let mut wanted = sines(t);
        let of = |k: usize| independent.iter().map(|d| wanted[*d][k]).collect::<Vec<f64>>();
        let (q, v, a) = (of(0), of(1), of(2));
        let mut dynamics = super::dynamics_at(&nominal, &q);
        let (dq, ddq) = dynamics.motion(&v, &a);
        for (w, rate) in wanted.iter_mut().zip(machine.driven()) {
            let position = dynamics.pose().positions()[machine.position_of(*rate)];
            *w = [position, dq[*rate], ddq[*rate]];
        }
        wanted
    };
    let clean = settings(0.2, Imperfections::none());
    let found = run_closed(&mut plant, &nominal, &together, &clean).unwrap();
    assert_eq!(found.log.effort.len(), 3);
    let apart = run_closed(&mut plant, &nominal, &sines, &clean).unwrap_err();
    println!("{apart}");
    assert!(matches!(apart, SimError::Reference { .. }), "{apart}");
}

#[test]
fn references_out_of_the_workspace_or_next_to_singular_poses_are_refused() {
    let Some(machine) = robot("fivebar", None, None) else { return };
    let nominal = rough(machine.clone(), 0.1, 1e-3);
    let mut plant = rough(machine, 0.1, 1e-3);
    let clean = settings(2.0, Imperfections::none());
    let home = nominal.machine().home_independent();
    // Both cranks turn outwards until the distals are stretched.
    let outwards = |t: f64| vec![[home[0] + 0.8 * t, 0.8, 0.0], [home[1] - 0.8 * t, -0.8, 0.0]];
    let fault = run_closed(&mut plant, &nominal, &outwards, &clean).unwrap_err();
    println!("{fault}");
    let SimError::Pose { time, .. } = &fault else { panic!("{fault}") };
    assert!(*time > 0.0 && *time < 2.0, "{time}");
    assert!(fault.to_string().starts_with(&format!("at {time:.4} s the reference cannot be followed")));

    // A rocker that is driven loses control where crank and coupler are in one line.
    let Some(machine) = robot("fourbar", None, Some(&["rocker"])) else { return };
    let strict = machine.with_least_measure(0.005);
    let nominal = rough(strict.clone(), 0.1, 1e-3);
    let mut plant = rough(strict, 0.1, 1e-3);
    let home = nominal.machine().home_independent()[0];
    let forwards = |t: f64| vec![[home + 0.5 * t, 0.5, 0.0]];
    let fault = run_closed(&mut plant, &nominal, &forwards, &clean).unwrap_err();
    println!("{fault}");
    assert!(
        matches!(fault, SimError::Pose { time, source: PoseError::Singular { .. } } if time > 0.0),
        "{fault}"
    );

    let short = run_closed(&mut plant, &nominal, &|_| Vec::new(), &clean).unwrap_err();
    assert!(matches!(short, SimError::Length { .. }), "{short}");
    let lost = run_closed(
        &mut plant,
        &nominal,
        &|t| vec![[if t > 0.1 { f64::NAN } else { home }, 0.0, 0.0]],
        &clean,
    );
    assert!(matches!(lost.unwrap_err(), SimError::Pose { source: PoseError::NotFinite { .. }, .. }));
}

/// A brief look at the far end of the workspace and back: samples for the gains are further apart than the way is straight.
#[test]
fn a_controller_without_feed_forward_follows_too() {
    let Some(machine) = robot("fourbar", None, None) else { return };
    let nominal = rough(machine.clone(), 0.1, 1e-3);
    let mut plant = rough(machine, 0.1, 1e-3);
    // The crank turns round and round: the way between samples of a whole turn is not straight.
    let home = nominal.machine().home_independent()[0];
    let turning = |t: f64| vec![[home + 6.0 * t, 6.0, 0.0]];
    let mut blind = settings(3.0, Imperfections::none());
    blind.control.feed_forward = false;
    blind.control.bandwidth_hz = 10.0;
    let found = run_closed(&mut plant, &nominal, &turning, &blind).unwrap();
    let end = found.log.position[0].last().copied().unwrap();
    assert!((end - home - 18.0).abs() < 0.5, "{end}");
}
