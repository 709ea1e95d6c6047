//! Time of inverse dynamics and of the joint torque regressor, one thread.
//!
//! `dynid-bench NAME=ROBOT.urdf ...` prints one line per robot, function and way: `NAME regressor lanes NANOSECONDS`,
//! the least of many repetitions. `dynid-bench --tree FILE.urdf` writes the tree of 32 joints for both sides.

#![expect(clippy::print_stdout, reason = "a benchmark prints its figures")]

mod tree;

use std::error::Error;
use std::hint::black_box;
use std::time::{Duration, Instant};

use dynid_model::{Dynamics, EffortModel, Mechanism, RandomMotion, RegressorBlock, RobotModel, State};
use dynid_robots::{robot, urdf};

const SAMPLES: usize = 64;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    if let [flag, path] = arguments.as_slice()
        && flag == "--tree"
    {
        std::fs::write(path, urdf::from_description(&tree::of_32_joints())?)?;
        return Ok(());
    }
    for argument in &arguments {
        let (name, path) =
            argument.split_once('=').ok_or_else(|| format!("expected NAME=FILE, found {argument}"))?;
        measure(name, robot::read(path)?.description.build()?);
    }
    Ok(())
}

/// Time per sample in ns: the least over repetitions of four passes over all samples, for 0.3 s.
fn least_time(mut pass: impl FnMut()) -> f64 {
    let mut least = f64::INFINITY;
    let end = Instant::now() + Duration::from_millis(300);
    while Instant::now() < end {
        let start = Instant::now();
        (0..4).for_each(|_| pass());
        least = least.min(start.elapsed().as_secs_f64() * 1e9 / (4 * SAMPLES) as f64);
    }
    least
}

fn measure(name: &str, mechanism: Mechanism) {
    let model = RobotModel::new(mechanism, vec![]);
    let dynamics = Dynamics::new(model.mechanism());
    let phi = model.mechanism().inertia_vector();
    let (n, positions) = (dynamics.rates(), dynamics.positions());
    let mut work = dynamics.workspace();
    let mut effort = vec![0.0; n * SAMPLES];
    let mut y = vec![0.0; n * phi.len()];
    let mut block = RegressorBlock::new(model.layout().clone(), SAMPLES);
    RandomMotion::new(model.mechanism(), &[], SAMPLES, 1).with_block(|motion| {
        let sample = |values: &[f64], width: usize, s: usize| -> Vec<f64> {
            (0..width).map(|c| values[c * motion.stride + s]).collect()
        };
        let states: Vec<[Vec<f64>; 3]> = (0..SAMPLES)
            .map(|s| [sample(motion.q, positions, s), sample(motion.dq, n, s), sample(motion.ddq, n, s)])
            .collect();
        let time = least_time(|| {
            for [q, dq, ddq] in &states {
                let state = State { q: black_box(q), dq, ddq, gravity: None };
                dynamics.inverse_dynamics(&state, &phi, &mut work, &mut effort[..n]);
                black_box(&effort);
            }
        });
        println!("{name} inverse_dynamics plain {time:.2}");
        let time = least_time(|| {
            dynamics.inverse_dynamics_block(black_box(motion), &phi, SAMPLES, &mut effort);
            black_box(&effort);
        });
        println!("{name} inverse_dynamics lanes {time:.2}");
        let time = least_time(|| {
            for [q, dq, ddq] in &states {
                let state = State { q: black_box(q), dq, ddq, gravity: None };
                dynamics.regressor(&state, &mut work, &mut y);
                black_box(&y);
            }
        });
        println!("{name} regressor plain {time:.2}");
        let time = least_time(|| {
            model.regressor(black_box(motion), &[], &mut block);
            black_box(&block);
        });
        println!("{name} regressor lanes {time:.2}");
    });
}
