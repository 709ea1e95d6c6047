//! Identifies an arm from arrays, without a log file or a configuration, and validates it on the last third of them.
//!
//! `cargo run --release -p dynid --example arrays`
#![expect(clippy::print_stdout, reason = "the result of a program")]

use dynid::log::Log;
use dynid::settings::{LogSettings, Settings};
use dynid::simulate::{SimulateSettings, simulate};
use dynid::{Robot, RobotOptions};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../robots/indy7.toml");
    let robot = Robot::load(path.as_ref(), &RobotOptions::default())?;
    // Any source of arrays will do: a bag, a database, a simulator, a notebook.
    let made =
        simulate(&robot, &SimulateSettings::parse("duration_s = 30\nrate_hz = 200\nseed = 7", "here")?)?;
    let joints = made.joints.iter().enumerate().map(|(j, name)| dynid::motion::JointSignals {
        name: name.clone(),
        position: made.position[j].clone(),
        velocity: None,
        effort: made.effort[j].clone(),
    });
    let all = dynid::motion::Log::new("session 12", made.time.clone(), joints.collect(), Vec::new())?;
    let (end, rows) = (2 * all.rows() / 3, all.rows());
    let training = Log::new(&robot, all.slice(0..end)?)?;
    let validation = Log::new(&robot, all.slice(end..rows)?)?
        .with_settings(LogSettings { validation: true, ..LogSettings::default() });

    let settings = Settings::default().with(|s| s.preferred = vec!["link6.Izz".to_owned()]);
    let found = dynid::pipeline::identify(&robot, [training, validation], &settings, &mut |_| {})?;
    let estimate = found.estimate();
    println!("{}: {}", estimate.verdict.status, estimate.verdict.headline);
    for p in estimate.parameters.iter().filter(|p| p.interval.is_some()).take(12) {
        println!("{:>12} = {:8.4} {:<6} {:.4?}", p.name, p.value, p.unit, p.interval);
    }
    Ok(())
}
