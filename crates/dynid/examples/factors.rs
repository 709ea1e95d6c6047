//! Two cells reduce their logs to factors, each for itself; whoever gets the bytes merges and solves them. No sample leaves a cell.
//!
//! `cargo run --release -p dynid --example factors`
#![expect(clippy::print_stdout, reason = "the result of a program")]

use dynid::log::Log;
use dynid::reduce::Reduction;
use dynid::settings::Settings;
use dynid::simulate::{SimulateSettings, simulate};
use dynid::{Robot, RobotOptions, pipeline};

/// A log of the arm: here from a simulator, from any source of arrays elsewhere.
fn session(robot: &Robot, seed: u32) -> Result<Log, Box<dyn std::error::Error>> {
    let made =
        simulate(robot, &SimulateSettings::parse(&format!("duration_s = 20\nseed = {seed}"), "here")?)?;
    let joints = made.joints.iter().enumerate().map(|(j, name)| dynid::motion::JointSignals {
        name: name.clone(),
        position: made.position[j].clone(),
        velocity: None,
        effort: made.effort[j].clone(),
    });
    let name = format!("session {seed}");
    Ok(Log::new(robot, dynid::motion::Log::new(&name, made.time.clone(), joints.collect(), Vec::new())?)?)
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../robots/indy7.toml");
    let robot = Robot::load(path.as_ref(), &RobotOptions::default())?;

    // One identification decides how logs are conditioned: the recipe that every cell follows.
    let first = session(&robot, 1)?;
    let learned = pipeline::identify(&robot, [first.clone()], &Settings::default(), &mut |_| {})?;
    let reducer = learned.recipe()?.reducer()?;

    let here = Reduction::of(&reducer, [first, session(&robot, 2)?])?.to_bytes();
    let there = Reduction::of(&reducer, [session(&robot, 3)?, session(&robot, 4)?])?.to_bytes();

    let read = |bytes: &[u8], name: &str| Reduction::from_bytes(bytes, name);
    let all = Reduction::merge([read(&there, "there")?, read(&here, "here")?])?;
    let again = Reduction::merge([read(&here, "here")?, read(&there, "there")?])?;
    assert_eq!(all.to_bytes(), again.to_bytes(), "the order of a merge does not matter");

    for (what, found) in
        [("one log", learned.estimate()), ("all four", all.solve([], &mut |_| {})?.estimate())]
    {
        println!("{what}, {} samples: {}", found.samples, found.verdict.headline);
        for p in found.base_parameters.iter().take(4) {
            println!(
                "{:>12} = {:8.4} ± {:.4} {}",
                p.name,
                p.value.unwrap_or(0.0),
                p.std.unwrap_or(0.0),
                p.unit
            );
        }
    }
    Ok(())
}
