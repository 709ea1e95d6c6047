//! Slopes of controlled positions against differences between simulations.

use crate::arm::{arm, plant};
use crate::experiment::reference;
use dynid_model::EffortModel;
use dynid_model::element::{Coulomb, JointElement, RotorInertia, Viscous};
use dynid_sim::*;

fn machine() -> Plant {
    let mut elements: Vec<Box<dyn JointElement>> = Vec::new();
    let mut values = Vec::new();
    for rate in 0..3 {
        elements.push(Box::new(Coulomb { rate }));
        elements.push(Box::new(Viscous { rate }));
        elements.push(Box::new(RotorInertia { rate }));
        values.extend([1.5, 2.0, 0.1]);
    }
    plant(arm(), elements, &values, 1e-4)
}

/// A fast controller hardly filters or delays what it reads.
fn settings() -> ExperimentSettings {
    let control = ControlSettings {
        rate_hz: 10_000.0,
        velocity_cutoff_hz: 5_000.0,
        bandwidth_hz: 3.0,
        feed_forward: false,
        effort_limit: Some(vec![1e6; 3]),
        ..ControlSettings::default()
    };
    let imperfections = Imperfections::none();
    ExperimentSettings { duration_s: 1.6, log_rate_hz: 500.0, control, imperfections, ..Default::default() }
}

#[test]
fn they_are_those_of_two_simulations_through_every_reversal() {
    let mut settings = settings();
    let nominal = machine();
    let found = run(&mut machine(), &nominal, &reference, &settings).unwrap();
    let [position_gain, velocity_gain]: [Vec<f64>; 2] =
        [found.gains.iter().map(|g| g.0).collect(), found.gains.iter().map(|g| g.1).collect()];
    settings.control.position_gain = Some(position_gain.clone());
    settings.control.velocity_gain = Some(velocity_gain.clone());
    let truth = &found.log.truth;
    let motion = DrivenMotion {
        step_s: 1.0 / settings.log_rate_hz,
        q: &truth.q,
        dq: &truth.dq,
        ddq: &truth.ddq,
        channels: &[],
        position_gain: &position_gain,
        velocity_gain: &velocity_gain,
        sign_width: nominal.sign_width(),
    };
    let model = nominal.model();
    let columns: Vec<usize> = (0..model.parameters().linear.len()).collect();
    let mut slopes: Vec<Vec<f64>> = Vec::new();
    let parameters = (nominal.linear(), nominal.shape());
    position_slopes(model, parameters, &columns, &motion, &mut |row, s| {
        assert_eq!(row, slopes.len());
        slopes.push(s.to_vec());
    })
    .unwrap();
    assert_eq!(slopes.len(), truth.q[0].len());

    let mut reversals = 0;
    for joint in 0..3 {
        reversals += truth.dq[joint].windows(2).filter(|w| w[0] * w[1] < 0.0).count();
    }
    assert!(reversals >= 3, "{reversals}");
    let mut compared = 0;
    for (c, parameter) in model.parameters().linear.iter().enumerate().filter(|(c, _)| c % 3 != 1) {
        let step = 1e-3 * nominal.linear()[c].abs().max(0.1);
        let moved = |sign: f64| {
            let mut linear = nominal.linear().to_vec();
            linear[c] += sign * step;
            let mut plant = machine().with_linear(linear).ok()?;
            Some(run(&mut plant, &nominal, &reference, &settings).ok()?.log.truth.q)
        };
        // Bodies that no mass distribution has are not simulated.
        let (Some(up), Some(down)) = (moved(1.0), moved(-1.0)) else { continue };
        let largest = slopes.iter().flat_map(|s| &s[3 * c..3 * c + 3]).fold(0.0_f64, |m, x| m.max(x.abs()));
        if largest < 1e-9 {
            continue;
        }
        let mut worst = 0.0_f64;
        for (row, s) in slopes.iter().enumerate() {
            for joint in 0..3 {
                let difference = (up[joint][row] - down[joint][row]) / (2.0 * step);
                worst = worst.max((s[3 * c + joint] - difference).abs());
            }
        }
        println!("{}: largest {largest:.2e}, off by {:.4}", parameter.name, worst / largest);
        assert!(worst < 0.02 * largest, "{}", parameter.name);
        compared += 1;
    }
    assert!(compared > 12, "{compared}");
}

#[test]
fn a_motion_of_other_joints_is_refused() {
    let nominal = machine();
    let signals = vec![vec![0.0; 5]; 3];
    let motion = DrivenMotion {
        step_s: 0.01,
        q: &signals,
        dq: &signals,
        ddq: &signals,
        channels: &[],
        position_gain: &[1.0, 1.0],
        velocity_gain: &[1.0; 3],
        sign_width: 1e-4,
    };
    let parameters = (nominal.linear(), nominal.shape());
    let refused = position_slopes(nominal.model(), parameters, &[0], &motion, &mut |_, _| {});
    assert!(refused.unwrap_err().to_string().contains("position gains"));
}
