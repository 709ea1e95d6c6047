//! Problems without a solution: the limit in the way is named.

#![expect(clippy::unwrap_used, clippy::print_stdout, reason = "helpers of tests outside of test functions")]

use std::time::Instant;

use crate::{problems, support};
use dynid_excitation::constraint::{ConstraintKind, FramePoint, Region};
use dynid_excitation::*;
use dynid_model::Vec3;

const SEEDS: [u64; 3] = [1, 20, 300];

fn refused(problem: &Problem, seed: u64) -> Infeasible {
    let begun = Instant::now();
    let settings = Settings { starts: 2, seed, ..Settings::default() };
    let outcome = design(problem, &settings, Vec::new(), &mut |_| {}).unwrap();
    let Outcome::Infeasible(why) = outcome else { panic!("seed {seed}: {outcome:?}") };
    println!("seed {seed}, {:.2} s: blamed {:?}", begun.elapsed().as_secs_f64(), why.blamed);
    for v in &why.violations {
        println!("   {} of {} near t = {:.2} s by {:.3}", v.kind, v.subject, v.time, v.excess);
    }
    why
}

#[test]
fn a_start_pose_under_the_floor_is_named_before_any_search() {
    let Some(mut problem) = problems::indy7(true) else { return };
    // The upper arm lies down and the forearm hangs from its end.
    problem.start.pose = Some(vec![0.0, -1.7, -1.0, 0.0, 0.0, 0.0]);
    for seed in SEEDS {
        let why = refused(&problem, seed);
        assert!(why.at_start);
        assert_eq!(why.violations[0].kind, LimitKind::Path(ConstraintKind::HalfSpace));
        assert_eq!(why.violations[0].time, 0.0);
    }
}

#[test]
fn an_effort_that_cannot_hold_the_start_pose_is_named() {
    let Some(data) = support::reference("robots/indy7.json") else { return };
    let robot = problems::indy7_robot(&data);
    let mut efforts = support::numbers(&data["limits"]["tau_max"]);
    efforts[1] *= 0.02;
    let mut problem = robot.problem(support::limits(&data));
    problem.constraints.push(robot.efforts(&efforts));
    problem.start =
        StartConditions { rest: true, zero_jerk: false, pose: Some(vec![0.0, 1.5, 0.0, 0.0, 0.0, 0.0]) };
    for seed in SEEDS {
        let why = refused(&problem, seed);
        assert!(why.at_start);
        let worst = &why.violations[0];
        assert_eq!((worst.kind, worst.subject.as_str()), (LimitKind::Path(ConstraintKind::Effort), "j2"));
    }
    // The upper arm may not leave the horizontal: found by the search alone.
    problem.start.pose = None;
    problem.limits[1].position = (1.3, 1.6);
    for seed in SEEDS {
        let why = refused(&problem, seed);
        assert!(!why.at_start);
        let effort = LimitKind::Path(ConstraintKind::Effort);
        assert_eq!(why.blamed, Some(Blame { kind: effort, subject: Some("j2".into()) }));
        assert!(why.violations.iter().any(|v| v.kind == effort && v.subject == "j2"));
    }
}

#[test]
fn a_contradiction_that_only_the_search_finds_is_named() {
    let Some(mut problem) = problems::indy7(false) else { return };
    // The flange cannot be 2 m up.
    let point = FramePoint { frame: "link6".into(), position: Vec3::zero() };
    let shelf = Region::HalfSpace { normal: Vec3([0.0, 0.0, 1.0]), offset: 2.0 };
    let mechanism = support::mechanism(&support::reference("robots/indy7.json").unwrap());
    let shelf = dynid_excitation::constraint::CartesianLimits::new(&mechanism, &[(point, shelf)]).unwrap();
    problem.constraints.push(Box::new(shelf));
    for seed in SEEDS {
        let why = refused(&problem, seed);
        assert!(!why.at_start);
        let plane = LimitKind::Path(ConstraintKind::HalfSpace);
        assert_eq!(why.blamed, Some(Blame { kind: plane, subject: Some("link6".into()) }));
        let worst = &why.violations[0];
        assert_eq!((worst.kind, worst.subject.as_str()), (plane, "link6"));
    }
}
