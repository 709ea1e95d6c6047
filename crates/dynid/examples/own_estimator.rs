//! A robust estimator of one's own, with the prior, the bodies that can exist, the intervals and the verdicts of every other.
//!
//! `cargo run --release -p dynid --example own_estimator`
#![expect(clippy::print_stdout, reason = "the result of a program")]

use dynid::estimators::linear::{OwnEstimator, OwnFit, ols};
use dynid::estimators::{Factor, groups::ReducedGroup};
use dynid::motion::{JointSignals, Log as Recording};
use dynid::simulate::{SimulateSettings, simulate};
use dynid::{Robot, RobotOptions, log::Log, pipeline::identify, settings::Settings};

/// Least squares that weighs down time blocks whose residual stands out: somebody leant on the arm.
fn block_robust(groups: &[ReducedGroup], columns: usize) -> Option<OwnFit> {
    let mut weights: Vec<Vec<f64>> = groups.iter().map(|g| vec![1.0; g.blocks.len()]).collect();
    let mut fit = OwnFit { x: vec![0.0; columns], variances: vec![1.0; groups.len()] };
    for _ in 0..20 {
        let mut rows: Vec<Factor> = Vec::new();
        for ((group, w), variance) in groups.iter().zip(&weights).zip(&fit.variances) {
            let weighted = group.blocks.iter().zip(w).map(|(f, w)| f.scaled(w / variance.sqrt()));
            rows.extend(weighted.map(|f| f.embed(columns, &group.columns)));
        }
        fit.x = ols(&Factor::merge(&rows.iter().collect::<Vec<_>>())).x;
        for ((group, w), variance) in groups.iter().zip(&mut weights).zip(&mut fit.variances) {
            let own: Vec<f64> = group.columns.iter().map(|c| fit.x[*c]).collect();
            let mean_square = |f: &Factor| f.rss(&own) / f.rows().max(1) as f64;
            let squares: Vec<f64> = group.blocks.iter().map(mean_square).collect();
            let mut sorted: Vec<f64> = squares.iter().copied().filter(|s| *s > 0.0).collect();
            sorted.sort_by(f64::total_cmp);
            *variance = *sorted.get(sorted.len() / 2)?;
            *w = squares.iter().map(|s| (2.0 * *variance / s.max(*variance)).sqrt().min(1.0)).collect();
        }
    }
    Some(fit)
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../robots/indy7.toml");
    let robot = Robot::load(path.as_ref(), &RobotOptions::default())?;
    let made = simulate(&robot, &SimulateSettings::parse("duration_s = 30\nseed = 7", "here")?)?;
    let pushed = |(e, t): (&f64, &f64)| if (12.0..13.0).contains(t) { e + 40.0 } else { *e };
    let signals = |j: usize| {
        let effort = made.effort[j].iter().zip(&made.time).map(pushed).collect();
        JointSignals {
            name: made.joints[j].clone(),
            position: made.position[j].clone(),
            velocity: None,
            effort,
        }
    };
    let joints = (0..made.joints.len()).map(signals).collect();
    let log = Log::new(&robot, Recording::new("pushed", made.time.clone(), joints, Vec::new())?)?;
    for own in [None, Some(OwnEstimator::new("block-robust", block_robust))] {
        let settings = Settings::default().with(|s| s.own_estimator = own);
        let found = identify(&robot, [log.clone()], &settings, &mut |_| {})?.estimate();
        let p = found.parameters.iter().find(|p| p.name == "j2.fv").ok_or("no such parameter")?;
        println!("{} = {:.2} {:.2?}: {}", p.name, p.value, p.interval, found.verdict.line);
    }
    Ok(())
}
