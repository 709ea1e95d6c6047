//! What to record next: forecasts against the logs to come, refusals, what needs no motion.

#![expect(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "helpers of tests outside of test functions; what was found is said"
)]

use std::path::{Path, PathBuf};

use dynid::Error;
use dynid::config::{Config, LogConfig, PerJoint};
use dynid::design::DesignConfig;
use dynid::design::next::{NextRun, NextSettings, Wanted, WantedState, next};
use dynid::io::MappingSpec;
use dynid::record::Outcome;
use dynid::reduce::{self, OwnOfLogs, Reduction};
use dynid::robot::{Robot, RobotOptions};
use dynid::simulate::{SimulateMode, SimulateSettings, SimulatedLog, simulate};

use crate::reduce::learned;
use crate::support::{PANDA, data, geometric_mean, write_log};

/// The robot as it is, and its file with inertias that are off.
fn robots() -> (PathBuf, PathBuf) {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    (root.join("robots/indy7.toml"), root.join("examples/indy7/robot.toml"))
}

fn design(robot: PathBuf) -> DesignConfig {
    let mut config = DesignConfig { robot, ..DesignConfig::default() };
    config.limits.acceleration = PerJoint::All(3.0);
    config.safety.floor = false;
    config.safety.self_collision = false;
    config.search.starts = 2;
    config
}

fn wanted(list: &[&str]) -> NextSettings {
    let wanted = list.iter().map(|text| text.parse::<Wanted>().unwrap()).collect();
    NextSettings { wanted, ..NextSettings::default() }
}

fn asked(list: &[&str], earlier: &Reduction) -> Result<NextRun, Error> {
    next(&design(robots().1), &wanted(list), earlier, &mut |_| {})
}

/// A virtual log in closed loop: a random motion of 12 s, or one that is followed.
fn recorded(seed: u64, follow: Option<PathBuf>) -> SimulatedLog {
    let robot = Robot::load(&robots().0, &RobotOptions::default()).unwrap();
    let plain = SimulateSettings {
        mode: SimulateMode::ClosedLoop,
        rate_hz: 250.0,
        seed,
        ..SimulateSettings::default()
    };
    let settings = match follow {
        Some(_) => SimulateSettings { follow, ..plain },
        None => SimulateSettings { duration_s: 12.0, harmonics: 3, acceleration: 3.0, ..plain },
    };
    simulate(&robot, &settings).unwrap()
}

fn log(path: &Path) -> LogConfig {
    LogConfig { path: path.to_owned(), ..LogConfig::default() }
}

/// A log, what it asks for next, the recorded motion, and all together: ratios of half widths to the forecast by the recipe's factors and by a new
/// identification, and how many intervals of the latter hold the truth, of how many.
fn to_the_end(seed: u64, list: &[&str]) -> ([f64; 2], [usize; 2]) {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let first = recorded(seed, None);
    write_log(&first, &at("first.csv"));
    let config = Config { robot: robots().1, log: vec![log(&at("first.csv"))], ..Config::default() };
    let earlier = reduce::learn(&config, &OwnOfLogs::default(), &mut |_| {}).unwrap().reduction;
    let run = asked(list, &earlier).unwrap();
    let record = run.record().unwrap();
    println!("seed {seed}: {}", record.verdict.headline);
    let is_there = |s: WantedState| matches!(s, WantedState::Reached | WantedState::Holds);
    assert!(record.wanted.iter().all(|w| w.state.is_some_and(is_there)), "{:?}", record.wanted);
    let designed = run.design.as_ref().unwrap().outcome.as_ref().unwrap();
    assert!(designed.broken.is_empty());
    designed.motion.file.write(at("next.json")).unwrap();
    write_log(&recorded(seed + 100, Some(at("next.json"))), &at("second.csv"));

    let recipe = earlier.recipe().clone();
    let second =
        reduce::reduce(recipe, &[log(&at("second.csv"))], &MappingSpec::default(), None, &mut |_| {})
            .unwrap();
    let solved = Reduction::merge([earlier, second]).unwrap().solve([], &mut |_| {}).unwrap();
    let config = Config { log: vec![log(&at("first.csv")), log(&at("second.csv"))], ..config };
    let again = dynid::identify(&config, &mut |_| {}).unwrap().identification;
    let ratio = |known: dynid_identify::knowledge::Knowledge| {
        let of = |w: &dynid::design::next::IntervalRecord| {
            let found = known.parameters.iter().find(|p| p.name == w.name)?.half_width?;
            println!(
                "  {} today {:.3?} wanted {:.3?} forecast {:.3?} found {found:.3}",
                w.name, w.half_width, w.wanted_half_width, w.half_width_after
            );
            Some(found / w.half_width_after?)
        };
        geometric_mean(record.wanted.iter().filter_map(of))
    };
    let (mut inside, mut all) = (0, 0);
    for p in again.knowledge().parameters.iter().zip(&again.trust.parameters) {
        let (Some((low, high)), Some((_, truth))) =
            (p.1.interval, first.truth.iter().find(|t| t.0 == p.0.name))
        else {
            continue;
        };
        all += 1;
        inside += usize::from(low <= *truth && *truth <= high);
    }
    ([ratio(solved.knowledge()), ratio(again.knowledge())], [inside, all])
}

#[test]
fn forecasts_are_those_of_the_logs_to_come() {
    let ([solved, again], [inside, all]) = to_the_end(3, &["j2.fc=2%", "j4.Ia=0.02"]);
    println!(
        "half width over forecast: {solved:.2} by factors, {again:.2} by all logs; {inside} of {all} inside"
    );
    // One draw: the blocks behind either interval are few.
    assert!((0.4..2.0).contains(&solved) && (0.3..1.5).contains(&again), "{solved} {again}");
    assert!(inside as f64 >= 0.8 * all as f64, "{inside} of {all}");
}

#[test]
#[ignore = "a minute; the ordinary run takes one seed"]
fn forecasts_of_many_logs_hold() {
    let list = ["j*.fc=3%", "j*.Ia=0.02", "link6.Izz=0.004"];
    let runs: Vec<([f64; 2], [usize; 2])> = (1..=12).map(|seed| to_the_end(seed, &list)).collect();
    let [solved, again] = [0, 1].map(|k| geometric_mean(runs.iter().map(|r| r.0[k])));
    let [inside, all] = [0, 1].map(|k| runs.iter().map(|r| r.1[k]).sum::<usize>());
    let narrow = runs.iter().filter(|r| r.0[1] <= 1.1).count();
    println!(
        "half width over forecast: {solved:.2} by factors, {again:.2} by all logs, {narrow} of {} at most 1.1; {inside} of {all} inside",
        runs.len()
    );
    assert!((0.7..1.4).contains(&solved) && (0.6..1.1).contains(&again) && narrow >= 10);
    assert!(inside as f64 >= 0.93 * all as f64);
}

/// Of a recorded log in two parts: what the first promises of the second, by the rows of the second, against what both give.
#[test]
fn rows_of_a_recorded_log_bring_what_they_promise() {
    let Some(data) = data() else { return };
    let text = PANDA.replace("{data}", &data.display().to_string());
    let mut config = Config::parse(&text, "test").unwrap();
    config.validation.clear();
    let [early, late] =
        [(0.0, 0.35), (0.35, 0.7)].map(|part| LogConfig { part: Some(part), ..config.log[0].clone() });
    config.log = vec![early];
    let earlier = reduce::learn(&config, &OwnOfLogs::default(), &mut |_| {}).unwrap().reduction;
    let recipe = earlier.recipe().clone();
    let further = reduce::reduce(recipe, &[late], &config.columns, None, &mut |_| {}).unwrap();
    let known = earlier.solve([], &mut |_| {}).unwrap().knowledge();
    let groups: Vec<_> = further.logs().iter().flat_map(|log| log.groups.clone()).collect();
    let rows = known.of_rows(&groups);
    let after = known.assess(&dynid::estimators::Factor::merge(&[known.information(), &rows]));
    let both = Reduction::merge([earlier, further]).unwrap().solve([], &mut |_| {}).unwrap().knowledge();
    let ratios: Vec<f64> = (0..after.len())
        .filter_map(|j| Some(both.parameters[j].half_width? / known.half_width(j, &after[j])?))
        .collect();
    let mean = geometric_mean(ratios.iter().copied());
    println!("half width over forecast: {mean:.2} over {} parameters", ratios.len());
    assert!(ratios.len() > 30 && (0.6..1.7).contains(&mean), "{mean}");
}

#[test]
fn what_holds_already_needs_no_motion() {
    let earlier = &learned().reduction;
    let run = asked(&["j2.fc=500%"], earlier).unwrap();
    let record = run.record().unwrap();
    assert!(run.design.is_none() && record.recorded_s.is_none() && record.design.is_none());
    assert_eq!(record.wanted[0].state, Some(WantedState::Holds));
    assert!(record.verdict.headline.contains("nothing has to be recorded"), "{:?}", record.verdict);
    let page = run.report(&record).unwrap();
    assert!(page.contains("holds already") && !page.contains("<h2>Limits</h2>"));
}

#[test]
fn what_no_motion_shows_is_told_and_the_rest_designed_for() {
    let earlier = &learned().reduction;
    let mut config = design(robots().1);
    config.search.starts = 1;
    let asked = |list: &[&str]| next(&config, &wanted(list), earlier, &mut |_| {});
    let alone = asked(&["link3.m=0.01"]).unwrap();
    let record = alone.record().unwrap();
    assert_eq!(record.wanted[0].state, Some(WantedState::OnlyInCombination));
    assert_eq!(record.verdict.status, Outcome::Fail);
    assert!(alone.design.is_none() && record.verdict.headline.contains("no motion"), "{:?}", record.verdict);

    let both = asked(&["link3.m=0.01", "j3.Ia=2%"]).unwrap();
    let record = both.record().unwrap();
    let state = |name: &str| record.wanted.iter().find(|w| w.name == name).unwrap().state;
    assert_eq!(state("link3.m"), Some(WantedState::OnlyInCombination));
    assert!(matches!(state("j3.Ia"), Some(WantedState::Reached | WantedState::NotReached)));
    assert_ne!(record.verdict.status, Outcome::Pass);
    // A pattern leaves out what no motion shows by itself.
    let patterns = asked(&["*.m=0.001"]);
    let masses = patterns.unwrap().record().unwrap().wanted;
    assert!(masses.iter().all(|w| w.state == Some(WantedState::OnlyInCombination)), "{masses:?}");
}

#[test]
fn a_record_that_is_too_short_says_how_long_it_should_be() {
    let earlier = &learned().reduction;
    let settings = NextSettings { longest_s: 10.0, ..wanted(&["j3.Ia=0.0005"]) };
    let run = next(&design(robots().1), &settings, earlier, &mut |_| {}).unwrap();
    let record = run.record().unwrap();
    assert_eq!(record.wanted[0].state, Some(WantedState::NotReached));
    assert_eq!(record.recorded_s, Some(10.0));
    assert!(
        record.verdict.headline.contains("longer records would be needed for j3.Ia"),
        "{:?}",
        record.verdict
    );
    // More of the same brings it nearer all the same.
    let [today, after] = [record.wanted[0].half_width, record.wanted[0].half_width_after].map(Option::unwrap);
    assert!(after < today);
}

#[test]
fn settings_and_robots_that_cannot_be_are_refused() {
    let earlier = &learned().reduction;
    let refused = |config: &DesignConfig, settings: &NextSettings| {
        let Err(error) = next(config, settings, earlier, &mut |_| {}) else { panic!("no error") };
        error.to_string()
    };
    let plain = design(robots().1);
    let text = refused(&plain, &wanted(&["j9.fc=5%"]));
    assert!(text.contains("j1.fc") && text.contains("j9.fc"), "{text}");
    assert!(refused(&plain, &wanted(&[])).contains("at least one parameter"));
    let settings = NextSettings { longest_s: f64::NAN, ..wanted(&["j1.fc=0.001"]) };
    assert!(refused(&plain, &settings).contains("longest"));
    let settings = NextSettings { longest_s: 0.1, ..wanted(&["j1.fc=0.001"]) };
    assert!(refused(&plain, &settings).contains("longest"));
    let other = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../robots/er16.toml");
    assert!(refused(&design(other), &wanted(&["j1.fc=0.001"])).contains("robot of the factors"));
    let other = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../robots/fivebar.toml");
    assert!(refused(&design(other), &wanted(&["j1.fc=0.001"])).contains("with a joint `j1` that moves"));
    let mut tilted = plain.clone();
    tilted.gravity = Some([9.81, 0.0, 0.0]);
    assert!(refused(&tilted, &wanted(&["j1.fc=0.001"])).contains("that of the logs"));
    let mut held = plain.clone();
    held.locked.insert("j6".to_owned(), 0.3);
    assert!(refused(&held, &wanted(&["j1.fc=0.001"])).contains("`j6`"));
    // What a design's file holds for other designs is told, not refused.
    let mut noisy = plain;
    noisy.criterion.noise = PerJoint::All(0.3);
    let run = next(&noisy, &wanted(&["j2.fc=500%"]), earlier, &mut |_| {}).unwrap();
    assert!(run.record().unwrap().verdict.warnings.iter().any(|w| w.contains("`criterion`")));
}

#[test]
#[ignore = "half a minute; that rooms give the same bits for any number of threads, their own tests say"]
fn the_same_motion_comes_of_any_number_of_threads() {
    let earlier = &learned().reduction;
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let record = pool.install(|| asked(&["j3.Ia=2%"], earlier).unwrap().record().unwrap());
        serde_json::to_string(&record).unwrap()
    };
    assert_eq!(run(1), run(2));
}
