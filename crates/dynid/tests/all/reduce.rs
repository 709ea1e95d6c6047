//! Logs reduced to factors apart, merged in any order, and solved, against one identification of all logs.

#![expect(clippy::unwrap_used, reason = "helpers of tests outside of test functions")]

use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use dynid::Error;
use dynid::config::{Config, LogConfig};
use dynid::estimate::Estimate;
use dynid::estimators::groups::ReducedGroup;
use dynid::io::MappingSpec;
use dynid::io::digest::sha256_bytes;
use dynid::log::Log;
use dynid::motion::Log as Recording;
use dynid::record::ParameterVerdict;
use dynid::reduce::{FactorFileFault, Learned, OwnOfLogs, Reduction, ReductionError, learn, reduce};
use dynid::settings::Preflight;
use dynid::settings::{LogSettings, Own};

fn example(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/indy7").join(name)
}

/// Two parts of the example's log, and its other log.
pub(crate) fn parts() -> [LogConfig; 3] {
    let part = |path: &str, part| LogConfig { path: example(path), part, ..LogConfig::default() };
    [
        part("train.csv.gz", Some((0.0, 0.6))),
        part("train.csv.gz", Some((0.6, 1.0))),
        part("valid.csv.gz", None),
    ]
}

/// What the first two parts teach.
pub(crate) fn learned() -> &'static Learned {
    static LEARNED: OnceLock<Learned> = OnceLock::new();
    LEARNED.get_or_init(|| {
        let [first, second, _] = parts();
        let robot = example("robot.toml");
        learn(
            &Config { robot, log: vec![first, second], ..Config::default() },
            &OwnOfLogs::default(),
            &mut |_| {},
        )
        .unwrap()
    })
}

fn reduced(logs: &[LogConfig]) -> Reduction {
    let recipe = learned().reduction.recipe().clone();
    reduce(recipe, logs, &MappingSpec::default(), None, &mut |_| {}).unwrap()
}

pub(crate) fn load(log: &LogConfig) -> Log {
    let robot = learned().reduction.recipe().clone().reducer().unwrap().robot().clone();
    dynid::logs::load(log, &robot.axes, &MappingSpec::default(), None).unwrap()
}

/// Largest difference of two estimates of the same model: values in standard deviations, and these themselves; values must agree to 1e-12.
///
/// In standard deviations rounding shows as the ratio of effort to noise times the root of the rows: of 250 and 170 here, 1e-11.
fn apart(a: &Estimate, b: &Estimate) -> (f64, f64) {
    assert_eq!(a.base_parameters.len(), b.base_parameters.len());
    let mut out = (0.0_f64, 0.0_f64);
    for (x, y) in a.base_parameters.iter().zip(&b.base_parameters) {
        assert_eq!(x.name, y.name);
        let (Some(p), Some(q), Some(s), Some(t)) = (x.value, y.value, x.std, y.std) else {
            assert_eq!((x.value, x.std), (y.value, y.std));
            continue;
        };
        assert!((p - q).abs() <= 1e-12 * (1.0 + p.abs()), "{} {p:e} {q:e}", x.name);
        out = (out.0.max((p - q).abs() / s), out.1.max((s / t - 1.0).abs()));
    }
    out
}

#[test]
fn factors_of_the_logs_of_an_identification_give_its_parameters() {
    let solved = learned().reduction.solve([], &mut |_| {}).unwrap().estimate();
    let (values, deviations) = apart(&learned().estimate, &solved);
    assert!(values < 1e-11 && deviations < 1e-11, "{values:e} std, {deviations:e}");
    for (a, b) in learned().estimate.parameters.iter().zip(&solved.parameters) {
        assert_eq!((&a.name, &a.verdict), (&b.name, &b.verdict));
        // What the prior carries comes from iterations that end 1e-6 residual variances from the optimum, where the last bits of the factors
        // show; the entropic distance, which the folds choose here, has no other solution.
        let of_rows = a.verdict == ParameterVerdict::SeenInData;
        assert!(
            (a.value - b.value).abs() <= (1.0 + a.value.abs()) * if of_rows { 1e-11 } else { 1e-8 },
            "{} {} {}",
            a.name,
            a.value,
            b.value
        );
    }
    assert_eq!(solved.samples, learned().estimate.samples);
    assert!(solved.fit.filtered.relative_error.unwrap() < 1.0, "figures are those of the rows");
    assert_eq!(solved.fit.raw.relative_error, None, "no sample was predicted");
}

#[test]
fn any_split_in_any_order_gives_the_same_bytes() {
    let [first, second, third] = parts();
    let all = reduced(&[first.clone(), second.clone(), third.clone()]);
    let each: Vec<Vec<u8>> =
        [&first, &second, &third].map(|log| reduced(std::slice::from_ref(log)).to_bytes()).to_vec();
    for order in [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]] {
        let read = |k: &usize| Reduction::from_bytes(&each[*k], "part").unwrap();
        let merged = Reduction::merge(order.iter().map(read)).unwrap();
        assert_eq!(merged.to_bytes(), all.to_bytes(), "{order:?}");
        let pairs = Reduction::merge([read(&order[0]), read(&order[1])]).unwrap();
        let nested = Reduction::merge([pairs.clone(), read(&order[2]), pairs]).unwrap();
        assert_eq!(nested.to_bytes(), all.to_bytes(), "in steps, and some twice: {order:?}");
    }
    let learned = learned().reduction.to_bytes();
    let again = Reduction::merge([reduced(&[second]), reduced(&[first])]).unwrap();
    assert_eq!(again.to_bytes(), learned, "reduced later, by the recipe alone");
}

#[test]
fn more_logs_narrow_what_is_known_and_a_validation_log_judges_it() {
    let [_, _, third] = parts();
    let more =
        Reduction::merge([learned().reduction.clone(), reduced(std::slice::from_ref(&third))]).unwrap();
    let unseen = load(&third).with_settings(LogSettings { validation: true, ..LogSettings::default() });
    let solved = more.solve([], &mut |_| {}).unwrap().estimate();
    let narrower = |(a, b): (&dynid::estimate::BaseValue, &dynid::estimate::BaseValue)| b.std < a.std;
    let count = learned()
        .estimate
        .base_parameters
        .iter()
        .zip(&solved.base_parameters)
        .filter(|p| narrower(*p))
        .count();
    assert!(4 * count > 3 * solved.base_parameters.len(), "{count} narrower");
    let judged = learned().reduction.solve([unseen], &mut |_| {}).unwrap().estimate();
    let [log] = &judged.validation[..] else { panic!("one validation log") };
    assert!(log.filtered.relative_error.unwrap() < 1.0);
    assert!(judged.verdict.line.contains("predicts logs it has not seen"), "{}", judged.verdict.line);
}

#[test]
fn what_no_recipe_knows_is_refused() {
    let reducer = learned().reduction.recipe().clone().reducer().unwrap();
    let [first, ..] = parts();
    let refused =
        |settings: LogSettings| reducer.reduce(load(&first).with_settings(settings)).unwrap_err().to_string();
    let own = refused(LogSettings { own: vec![Own::Offset], ..LogSettings::default() });
    assert!(own.contains("log.own") && own.contains("offset"), "{own}");
    let payload = refused(LogSettings { payload: Some("tool".to_owned()), ..LogSettings::default() });
    assert!(payload.contains("log.payload"), "{payload}");
    let slow = LogConfig { columns: None, ..first.clone() };
    let rate = MappingSpec { rate_hz: Some(100.0), ..MappingSpec::default() };
    let recipe = || learned().reduction.recipe().clone();
    let found = reduce(recipe(), &[slow], &rate, None, &mut |_| {}).unwrap_err();
    assert!(matches!(found, Error::Reduction(ReductionError::Rate { .. })), "{found}");
    assert!(found.hint().is_some());

    let [first, second, _] = parts();
    let robot = example("robot.toml");
    let refused = |change: &dyn Fn(&mut Config)| {
        let mut config =
            Config { robot: robot.clone(), log: vec![first.clone(), second.clone()], ..Config::default() };
        change(&mut config);
        learn(&config, &OwnOfLogs::default(), &mut |_| {}).unwrap_err().to_string()
    };
    let textbook = refused(&|c| c.conditioning.route = dynid::config::Route::Textbook);
    assert!(textbook.contains("textbook route"), "{textbook}");
    let robust = refused(&|c| c.estimator.method = dynid::config::Method::Huber);
    assert!(robust.contains("method = \"wls\""), "{robust}");
    let single = refused(&|c| c.log[1].own = vec![Own::Offset]);
    assert!(single.contains("terms of single logs"), "{single}");
}

/// What a delay in one log does to factors with columns for it: it is told, and the solution does not move.
#[test]
fn delays_of_single_logs_have_columns_of_their_own() {
    let recipe = learned().reduction.recipe().clone().with_delays();
    assert_ne!(recipe.hash(), learned().reduction.recipe().hash());
    let reducer = recipe.clone().reducer().unwrap();
    let [first, second, _] = parts();
    let rate = recipe.choices.rate_hz;
    let late = 0.4 / rate;
    let shifted = |log: &Log| {
        let (time, mut joints, channels) = log.log.clone().into_parts();
        for joint in &mut joints {
            joint.effort = dynid::motion::shift::shift(&joint.effort, late * rate).unwrap().values;
        }
        Log::new(reducer.robot(), Recording::new(log.log.name(), time, joints, channels).unwrap()).unwrap()
    };
    let (plain, other) = (load(&first), load(&second));
    let moved = shifted(&plain);
    let of = |logs: Vec<Log>| {
        let made = Reduction::of(&reducer, logs).unwrap();
        Reduction::from_bytes(&made.to_bytes(), "delays").unwrap()
    };
    // With all other values as they fit the log before, the efforts of the late one ask for so much more delay.
    let (before, after) = (of(vec![plain.clone()]), of(vec![moved.clone()]));
    for (a, b) in before.logs()[0].groups.iter().zip(&after.logs()[0].groups).filter(|(g, _)| g.scale == 0) {
        let merged =
            |g: &ReducedGroup| dynid::estimators::Factor::merge(&g.blocks.iter().collect::<Vec<_>>());
        let x = dynid::estimators::linear::ols(&merged(a)).x;
        let loss = |more: f64| {
            let mut x = x.clone();
            *x.last_mut().unwrap() += more;
            merged(b).rss(&x)
        };
        let (less, same, more) = (loss(-late), loss(0.0), loss(late));
        let least = 0.5 * late * (less - more) / (less - 2.0 * same + more);
        assert!((least - late).abs() < 0.03 * late, "output {}: {least} of {late}", a.output);
    }
    let solved = |logs| of(logs).solve([], &mut |_| {}).unwrap().estimate();
    let (a, b) = (solved(vec![plain.clone(), other.clone()]), solved(vec![moved.clone(), other.clone()]));
    let fixed = |logs| {
        let reducer = learned().reduction.recipe().clone().reducer().unwrap();
        Reduction::of(&reducer, logs).unwrap().solve([], &mut |_| {}).unwrap().estimate()
    };
    let (c, d) = (fixed(vec![plain, other.clone()]), fixed(vec![moved, other]));
    let far = |a: &Estimate, b: &Estimate| {
        let of = |(x, y): (&dynid::estimate::BaseValue, &dynid::estimate::BaseValue)| {
            Some((x.value? - y.value?).abs() / x.std?)
        };
        a.base_parameters.iter().zip(&b.base_parameters).filter_map(of).fold(0.0, f64::max)
    };
    let (with, without) = (far(&a, &b), far(&c, &d));
    assert!(with < 0.2 * without && with < 0.5, "{with} with columns, {without} without");
    assert_eq!(a.base_parameters.len(), c.base_parameters.len(), "delays are no parameters of the robot");
}

#[test]
fn what_a_pre_flight_found_and_a_recipe_doubts_is_not_lost_with_the_samples() {
    let [first, second, third] = parts();
    let mut config = Config { robot: example("robot.toml"), log: vec![first, second], ..Config::default() };
    config.preflight = Preflight::Warn;
    let learned = learn(&config, &OwnOfLogs::default(), &mut |_| {}).unwrap();
    let recipe = learned.reduction.recipe().clone();
    assert!(recipe.doubts.is_empty(), "{:?}", recipe.doubts);
    let check = |estimate: &Estimate, name: &str| {
        estimate.verdict.checks.iter().find(|c| c.name.word() == name).unwrap().status.word()
    };
    let sound = learned.reduction.solve([], &mut |_| {}).unwrap().estimate();
    for name in ["pre-flight of the logs", "recipe of the factors"] {
        assert_eq!(check(&sound, name), "ok", "{name}");
    }

    // A log whose efforts have the wrong sign, with a pre-flight that only warns.
    let reducer = recipe.reducer().unwrap();
    let (time, mut joints, channels) = load(&third).log.into_parts();
    joints.iter_mut().for_each(|joint| joint.effort.iter_mut().for_each(|e| *e = -*e));
    let turned = Recording::new("turned", time, joints, channels).unwrap();
    let turned = Reduction::of(&reducer, [Log::new(reducer.robot(), turned).unwrap()]).unwrap();
    let turned = Reduction::from_bytes(&turned.to_bytes(), "turned").unwrap();
    let both = Reduction::merge([learned.reduction, turned]).unwrap();
    let found = both.solve([], &mut |_| {}).unwrap().estimate();
    assert_eq!(check(&found, "pre-flight of the logs"), "fail");
    assert!(
        found.preflight.iter().any(|f| f.log == "turned" && f.severity.word() == "error"),
        "{:?}",
        found.preflight
    );
    assert_eq!(found.verdict.status.word(), "fail");
    // The default pre-flight refuses such a log.
    let strict = self::learned().reduction.recipe().clone().reducer().unwrap();
    let (time, mut joints, channels) = load(&third).log.into_parts();
    joints.iter_mut().for_each(|joint| joint.effort.iter_mut().for_each(|e| *e = -*e));
    let turned = Recording::new("turned", time, joints, channels).unwrap();
    let refused = strict.reduce(Log::new(strict.robot(), turned).unwrap()).unwrap_err();
    assert!(matches!(refused, Error::PreflightFault(_)), "{refused}");
}

#[test]
fn doubts_of_a_recipe_are_doubts_of_what_is_solved_by_it() {
    // No friction at all: the fit, and with it what factors keep, is in doubt.
    let [first, second, _] = parts();
    let mut config = Config { robot: example("robot.toml"), log: vec![first, second], ..Config::default() };
    config.elements.default = Some(vec!["offset".to_owned()]);
    config.elements.friction = dynid::config::Friction::Given;
    config.preflight = Preflight::Warn;
    let learned = learn(&config, &OwnOfLogs::default(), &mut |_| {}).unwrap();
    let open: Vec<_> = learned.estimate.verdict.checks.iter().filter(|c| c.status.word() != "ok").collect();
    let doubts = &learned.reduction.recipe().doubts;
    assert!(!doubts.is_empty() && doubts.iter().all(|d| open.iter().any(|c| c.name == d.name)), "{open:?}");
    let solved = learned.reduction.solve([], &mut |_| {}).unwrap().estimate();
    let check = solved.verdict.checks.iter().find(|c| c.name.word() == "recipe of the factors").unwrap();
    assert!(check.status.word() != "ok" && check.meaning.contains(doubts[0].name.word()), "{check:?}");
}

/// A spring that carries most of a link, which the robot file states: without it bodies explain the log better under another clock.
#[test]
fn the_pre_flight_of_a_recipe_knows_the_elements_of_the_robot_file() {
    use dynid::simulate::{SimulateSettings, simulate};
    let folder = tempfile::tempdir().unwrap();
    let geometry = "ba = 0.4, br = 0.25, bphi = 0.4";
    let robot = |values: &str| {
        format!(
            "{}[element.j1]\nbeside = [\"balancer\"]\nbalancer = {{ {geometry}{values} }}\n",
            crate::support::ARM
        )
    };
    let path = |name: &str| folder.path().join(name);
    std::fs::write(path("truth.toml"), robot(", stiffness = 3000, force = -400")).unwrap();
    std::fs::write(path("arm.toml"), robot("")).unwrap();
    let truth = dynid::Robot::load(&path("truth.toml"), &dynid::RobotOptions::default()).unwrap();
    let settings =
        SimulateSettings::parse("duration_s = 10.0\nrate_hz = 500\nseed = 3", "simulation").unwrap();
    crate::support::write_log(&simulate(&truth, &settings).unwrap(), &path("log.csv"));
    let log = LogConfig { path: path("log.csv"), ..LogConfig::default() };
    let config = Config { robot: path("arm.toml"), log: vec![log.clone()], ..Config::default() };
    let learned = learn(&config, &OwnOfLogs::default(), &mut |_| {}).unwrap();
    let recipe = learned.reduction.recipe().clone();
    let reduced = reduce(recipe, &[log], &MappingSpec::default(), None, &mut |_| {}).unwrap();
    let solved = reduced.solve([], &mut |_| {}).unwrap().estimate();
    assert!(apart(&learned.estimate, &solved).0 < 1e-9);
}

#[test]
fn factors_of_another_recipe_do_not_mix() {
    let [first, ..] = parts();
    let mut config = Config { robot: example("robot.toml"), log: vec![first], ..Config::default() };
    config.conditioning.kernel_hz = Some(2.0);
    let other = learn(&config, &OwnOfLogs::default(), &mut |_| {}).unwrap().reduction;
    let found = Reduction::merge([learned().reduction.clone(), other]).unwrap_err();
    assert!(matches!(found, ReductionError::OtherRecipe { .. }), "{found}");
    assert_eq!(Reduction::merge([]).unwrap_err(), ReductionError::Nothing);
}

/// Bytes with the digest that they ought to have, to get behind it.
fn sealed(mut bytes: Vec<u8>) -> Vec<u8> {
    let end = bytes.len() - 32;
    let digest = sha256_bytes(&bytes[..end]);
    bytes[end..].copy_from_slice(&digest);
    bytes
}

fn fault(bytes: &[u8]) -> FactorFileFault {
    match Reduction::from_bytes(bytes, "file").unwrap_err() {
        ReductionError::File { fault, .. } => fault,
        other => panic!("{other}"),
    }
}

#[test]
fn damaged_files_are_refused() {
    let [_, second, _] = parts();
    let good = reduced(&[second]).to_bytes();
    assert!(Reduction::from_bytes(&good, "file").is_ok());
    assert_eq!(fault(b""), FactorFileFault::NotFactors);
    assert_eq!(
        fault(b"dynid factors 99\nrest"),
        FactorFileFault::Version { expected: 1, found: "99".to_owned() }
    );
    for cut in [20, 100, good.len() / 2, good.len() - 1] {
        let found = fault(&good[..cut]);
        assert!(matches!(found, FactorFileFault::Length { .. } | FactorFileFault::Damaged), "{cut}: {found}");
    }
    let mut flipped = good.clone();
    flipped[good.len() / 2] ^= 1;
    assert_eq!(fault(&flipped), FactorFileFault::Damaged);
    // A factor that was changed, with a new digest: the log's key tells.
    let mut changed = good.clone();
    let place = good.len() - 40;
    changed[place] ^= 1;
    assert!(matches!(fault(&sealed(changed)), FactorFileFault::Log { .. }));
    // A recipe that was changed, with a new digest.
    let at = good.windows(12).position(|w| w == b"\"kernel_hz\":".as_slice()).unwrap() + 12;
    let mut changed = good.clone();
    changed[at] = if good[at] == b'9' { b'8' } else { b'9' };
    assert!(matches!(fault(&sealed(changed)), FactorFileFault::Description(_)));
}

#[test]
fn no_damage_behind_the_digest_ends_in_a_panic() {
    let [_, second, _] = parts();
    let good = reduced(&[second]).to_bytes();
    let head = good.iter().position(|b| *b == b'\n').unwrap() + 1;
    let text = u64::from_le_bytes(good[head..head + 8].try_into().unwrap()) as usize;
    let mut state = 0x9e37_79b9_7f4a_7c15_u64;
    let mut next = |below: usize| {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state % below as u64) as usize
    };
    let mut read = 0;
    for case in 0..400 {
        let mut bytes = good.clone();
        // Half of the damage in the description, where it is read as structure, the rest anywhere.
        let (from, span) = if case % 2 == 0 { (head, 8 + text) } else { (0, good.len() - 32) };
        for _ in 0..1 + next(4) {
            let place = from + next(span);
            match next(3) {
                0 => bytes[place] = next(256) as u8,
                1 => {
                    bytes.remove(place);
                }
                _ => bytes.insert(place, b'0' + next(10) as u8),
            }
        }
        if let Ok(reduction) = Reduction::from_bytes(&sealed(bytes), "damaged") {
            read += 1;
            let solved = reduction.solve([], &mut |_| {}).map(|found| found.estimate());
            assert!(
                solved.is_err() || solved.is_ok_and(|e| e.parameters.iter().all(|p| p.value.is_finite()))
            );
        }
    }
    assert!(read < 40, "most damage is seen: {read} of 400 were read");
}
