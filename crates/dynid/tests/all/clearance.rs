//! Robots whose joints have clearance, from the robot file to the log and back.

#![expect(clippy::unwrap_used, reason = "helpers of tests outside of test functions")]

use std::collections::BTreeMap;
use std::path::Path;

use dynid::agreement::{Agreement, Alignment, compare};
use dynid::estimate::{Estimate, Split};
use dynid::estimators::conditioning::ConditioningSettings;
use dynid::inspect::inspect;
use dynid::io::TieSpec;
use dynid::log::Log;
use dynid::motion::{Channel, JointSignals};
use dynid::pipeline::identify;
use dynid::robot::{Robot, RobotOptions};
use dynid::settings::Settings;
use dynid::simulate::{SeriesSettings, SimulateMode, SimulateSettings, SimulatedLog, simulate};

/// The two-axis mechanism of `robots/xy-pointing.toml`.
fn pointing() -> String {
    std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("../../robots/xy-pointing.toml"))
        .unwrap()
}

fn robot(text: &str) -> Robot {
    Robot::parse(text, Path::new("xy.toml"), &RobotOptions::default()).unwrap()
}

/// The robot without clearance.
fn ideal() -> Robot {
    let text: Vec<String> =
        pointing().lines().filter(|line| !line.starts_with("clearance")).map(str::to_owned).collect();
    robot(&text.join("\n"))
}

/// The published motion, a period of it, exact sensors.
fn published(rate_hz: f64) -> SimulateSettings {
    let series = |offset: f64, sine: &[f64], cosine: &[f64]| SeriesSettings {
        offset,
        sine: sine.to_vec(),
        cosine: cosine.to_vec(),
    };
    let trajectory = BTreeMap::from([
        (
            "j1".to_owned(),
            series(0.111, &[0.243, -6.5e-10, -0.028, -0.033, -0.005], &[-0.113, -0.01, 0.001, 0.013, -0.003]),
        ),
        (
            "j2".to_owned(),
            series(-0.306, &[0.251, -0.029, -0.016, -0.015, -0.017], &[0.372, -0.037, -0.033, 0.003, 0.001]),
        ),
    ]);
    let period = std::f64::consts::TAU / 0.4;
    SimulateSettings {
        duration_s: period,
        period_s: Some(period),
        rate_hz,
        trajectory,
        effort_noise: 0.0,
        encoder_bits: 0,
        ..SimulateSettings::default()
    }
}

fn channel<'a>(log: &'a SimulatedLog, name: &str) -> &'a [f64] {
    &log.channels.iter().find(|(n, _)| n == name).unwrap_or_else(|| panic!("no channel {name}")).1
}

fn rms(x: impl Iterator<Item = f64>) -> f64 {
    let squares: Vec<f64> = x.map(|x| x * x).collect();
    (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
}

#[test]
fn the_log_shows_the_friction_of_the_bearings() {
    let settings = SimulateSettings { delay_samples: Some(0.0), ..published(500.0) };
    let log = simulate(&robot(&pointing()), &settings).unwrap();
    // The bearings have a friction of their own in place of `coulomb`.
    let without =
        pointing().replace("\nclearance", "\nelements = [\"viscous\", \"offset\", \"rotor\"]\n# clearance");
    let without = simulate(&robot(&without), &settings).unwrap();
    assert_eq!(log.joints, ["j1", "j2"]);
    let names: Vec<&str> = log.channels.iter().map(|(n, _)| n.as_str()).collect();
    let expected = ["journal_j1_x", "journal_j1_y", "journal_j2_x", "journal_j2_y"];
    assert_eq!(names[..4], expected);
    assert_eq!(names[4..7], ["normal_force_j1", "friction_force_j1", "penetration_j1"]);
    assert_eq!(log.channels, log.clean_channels);

    // Friction moments of 0.029 and 0.008 N m are what the published study finds; other elements act as on the ideal robot.
    for (joint, moment, load) in [(0, 0.0286, 29.3), (1, 0.0080, 8.1)] {
        let name = &log.joints[joint];
        let friction = channel(&log, &format!("friction_force_{name}"));
        assert!((rms(friction.iter().map(|f| 0.01 * f)) / moment - 1.0).abs() < 0.02);
        let excess: Vec<f64> =
            log.effort[joint].iter().zip(&without.effort[joint]).map(|(a, b)| a - b).collect();
        assert!((rms(excess.iter().copied()) / moment - 1.0).abs() < 0.15, "{}", rms(excess.into_iter()));
        for (x, y) in channel(&log, &format!("journal_{name}_x"))
            .iter()
            .zip(channel(&log, &format!("journal_{name}_y")))
        {
            let offset = x.hypot(*y);
            assert!((5e-5..5.5e-5).contains(&offset), "{offset}");
        }
        let normal = channel(&log, &format!("normal_force_{name}"));
        assert!(normal.iter().all(|f| (f / load - 1.0).abs() < 0.06), "{name}");
    }
    assert_eq!(log.position, without.position);

    let summary = log.clearance.unwrap();
    assert_eq!(summary.settle_s, 0.5);
    assert!(summary.energy.relative_error().unwrap() < 1e-8, "{:?}", summary.energy);
    for journal in &summary.journals {
        assert_eq!((journal.onsets, journal.losses), (1, 0));
        assert!(journal.contact_share > 0.999 && journal.largest_penetration < 1e-5);
    }
    assert!(log.truth.iter().any(|(name, mu)| name == "j2.mu" && *mu == 0.1));
    assert!(log.warnings.is_empty(), "{:?}", log.warnings);
}

#[test]
fn a_lead_of_the_effort_is_that_of_the_true_one() {
    let xy = robot(&pointing());
    let effort = |delay: f64| {
        simulate(&xy, &SimulateSettings { delay_samples: Some(delay), ..published(500.0) }).unwrap().effort
    };
    // Instants of one log are not those of the other, and the swing remembers where steps ended; to its tolerance.
    let (now, led) = (effort(0.0), effort(1.0));
    for (now, led) in now.iter().zip(&led) {
        let n = now.len();
        assert!(rms(now[1..].iter().zip(&led[..n - 1]).map(|(a, b)| a - b)) < 1e-6);
    }
    let half = simulate(&xy, &published(500.0)).unwrap();
    assert!(half.effort[0] != half.clean[3][0] && half.effort[0].iter().all(|x| x.is_finite()));
}

#[test]
fn the_same_seed_gives_the_same_bits_and_noise_is_the_journals() {
    let xy = robot(&pointing());
    let settings = SimulateSettings { duration_s: 2.0, journal_noise: 1e-6, ..SimulateSettings::default() };
    let (one, two) = (simulate(&xy, &settings).unwrap(), simulate(&xy, &settings).unwrap());
    assert_eq!(one.channels, two.channels);
    assert_eq!(one.effort, two.effort);
    assert_eq!(one.position, two.position);
    let noise = rms(one.channels[0].1.iter().zip(&one.clean_channels[0].1).map(|(a, b)| a - b));
    assert!((noise / 1e-6 - 1.0).abs() < 0.1, "{noise}");
    assert_eq!(one.channels[4..], one.clean_channels[4..]);
    let other = simulate(&xy, &SimulateSettings { seed: 2, ..settings }).unwrap();
    assert_ne!(one.clean_channels, other.clean_channels);
}

#[test]
fn a_sample_rate_below_the_swing_is_told() {
    let log = simulate(&robot(&pointing()), &published(100.0)).unwrap();
    let needed = log.clearance.unwrap().needed_rate_hz;
    assert!((330.0..360.0).contains(&needed), "{needed}");
    assert_eq!(log.warnings.len(), 1);
    assert!(log.warnings[0].contains(&format!("at least {:.0} Hz", needed.ceil())), "{}", log.warnings[0]);
}

#[test]
fn every_law_moves_its_journals() {
    let keys = pointing().lines().find(|line| line.starts_with("clearance")).unwrap().to_owned();
    for law in [
        "law = \"lankarani_nikravesh\"",
        "law = \"kelvin_voigt\", stiffness = 1e7, damping = 2000",
        "law = \"hertz\", stiffness = 3e9",
    ] {
        let table = format!("clearance = {{ journal_radius = 0.01, gap = 5e-5, {law} }}");
        let settings = SimulateSettings { duration_s: 0.5, settle_s: Some(0.0), ..published(1000.0) };
        let log = simulate(&robot(&pointing().replace(&keys, &table)), &settings).unwrap();
        let summary = log.clearance.unwrap();
        assert!(summary.journals.iter().all(|j| j.onsets > 0), "{law}");
        // The log begins with the journals in the middle.
        assert_eq!(log.clean_channels[0].1[0], 0.0);
        assert!(summary.energy.relative_error().unwrap() < 1e-6, "{law}: {:?}", summary.energy);
    }
}

#[test]
fn inspection_shows_journals_at_rest() {
    let found = inspect(&robot(&pointing()), None).unwrap();
    assert_eq!(found.clearances.len(), 2);
    let rest: Vec<_> = found.clearances.iter().map(|c| c.at_rest.clone().unwrap()).collect();
    let weights = [(2.1391 + 0.8596) * 9.80665, 0.8596 * 9.80665];
    for ((rest, weight), micrometres) in rest.iter().zip(weights).zip([4.331, 2.227]) {
        assert!((rest.load / weight - 1.0).abs() < 1e-12, "{}", rest.load);
        assert!((rest.penetration * 1e6 - micrometres).abs() < 1e-3, "{}", rest.penetration);
        assert!((60.0..75.0).contains(&rest.swing_hz), "{}", rest.swing_hz);
        assert!(rest.sample_rate_hz == 5.0 * rest.swing_hz && rest.remarks.is_empty());
    }
    // What can be identified is what the ideal robot shows.
    let without = inspect(&ideal(), None).unwrap();
    assert_eq!(found.base_parameter_count, without.base_parameter_count);
    assert_eq!(found.standard_parameters, without.standard_parameters);
    assert!(without.clearances.is_empty());

    // Along gravity nothing presses the journals; a rough law that is loaded beyond its range says so.
    let flat = pointing().replace("gravity = [-9.80665, 0, 0]", "gravity = [0, 0, 0]");
    assert!(inspect(&robot(&flat), None).unwrap().clearances.iter().all(|c| c.at_rest.is_none()));
    let heavy = pointing().replace("gravity = [-9.80665, 0, 0]", "gravity = [-2000, 0, 0]");
    let heavy = inspect(&robot(&heavy), None).unwrap();
    let remarks = &heavy.clearances[0].at_rest.as_ref().unwrap().remarks;
    assert!(remarks.iter().any(|r| r.contains("of the clearance")), "{remarks:?}");
}

/// The mechanism without other friction than that of its bearings.
fn bearings_alone() -> Robot {
    robot(&pointing().replace("\nclearance", "\nelements = []\nclearance"))
}

/// A log with probes, as arrays.
fn probed(log: &SimulatedLog, probes: &[&str]) -> Log {
    let joints = log.joints.iter().zip(&log.position).zip(&log.effort);
    let joints = joints.map(|((name, position), effort)| JointSignals {
        name: name.clone(),
        position: position.clone(),
        velocity: None,
        effort: effort.clone(),
    });
    let channels = log.channels.iter().filter(|(name, _)| probes.contains(&name.as_str()));
    let channels = channels.map(|(name, values)| Channel { name: name.clone(), values: values.clone() });
    let signals =
        dynid::motion::Log::new("probes", log.time.clone(), joints.collect(), channels.collect()).unwrap();
    Log::new(&bearings_alone(), signals).unwrap()
}

const PROBES: [&str; 4] = ["journal_j1_x", "journal_j1_y", "journal_j2_x", "journal_j2_y"];

#[test]
fn closed_loops_start_with_journals_at_rest_and_balance_their_energy() {
    let settings = SimulateSettings {
        mode: SimulateMode::ClosedLoop,
        duration_s: 3.0,
        rate_hz: 1000.0,
        journal_noise: 1e-8,
        perfect: true,
        ..SimulateSettings::default()
    };
    let log = simulate(&bearings_alone(), &settings).unwrap();
    let (summary, experiment) = (log.clearance.as_ref().unwrap(), log.experiment.as_ref().unwrap());
    assert!(summary.events.is_empty() && summary.journals.iter().all(|j| j.contact_share > 0.999_999));
    let exchanged = experiment.energy.drive_work.abs();
    assert!(experiment.energy.residual().abs() < 1e-7 * exchanged, "{:?}", experiment.energy);
    // The controller makes up for bearings that it does not know.
    for joint in 0..2 {
        let wanted = &log.clean[0][joint];
        assert!(rms(wanted.windows(2).map(|w| w[1] - w[0])) > 0.0);
        let friction = summary.journals[joint].friction_moment_rms;
        assert!(friction > 1e-3 && rms(log.effort[joint].iter().copied()) > friction);
    }
    let noise = channel(&log, PROBES[0]).iter().zip(&log.clean_channels[0].1).map(|(a, b)| a - b);
    assert!((rms(noise) / 1e-8 - 1.0).abs() < 0.1);
    let again = simulate(&bearings_alone(), &settings).unwrap();
    assert!(log.effort == again.effort && log.channels == again.channels);
}

#[test]
fn probes_tell_parameters_and_friction_of_the_bearings() {
    let simulated = |seed| {
        let settings = SimulateSettings {
            duration_s: 20.0,
            rate_hz: 1000.0,
            effort_noise: 0.002,
            journal_noise: 1e-8,
            seed,
            ..SimulateSettings::default()
        };
        simulate(&bearings_alone(), &settings).unwrap()
    };
    let (log, other) = (simulated(1), simulated(2));
    let weighed = TieSpec {
        known: BTreeMap::from([("link1.m".to_owned(), 2.1391), ("link2.m".to_owned(), 0.8596)]),
        ..TieSpec::default()
    };
    let identified = |probes: &[&str]| {
        let settings = Settings::default().with(|s| s.tie = vec![weighed.clone()]);
        identify(&bearings_alone(), [probed(&log, probes)], &settings, &mut |_| {}).unwrap()
    };
    let (with, without) = (identified(&PROBES), identified(&[]));
    let estimate = with.estimate();
    let parameter = |name: &str| estimate.parameters.iter().find(|p| p.name == name).unwrap();
    for name in ["j1.mu", "j2.mu"] {
        let (value, std) = (parameter(name).value, parameter(name).std.unwrap());
        assert!((value - 0.1).abs() < 4.0 * std && std < 3e-4, "{name}: {value} ± {std}");
    }
    for (name, truth) in
        [("link1.mx", 0.103_126_011), ("link2.mx", 0.029_389_724), ("link2.Izz", 0.002_814_835)]
    {
        let (value, std) = (parameter(name).value, parameter(name).std.unwrap());
        assert!((value - truth).abs() < 4.0 * std, "{name}: {value} ± {std}, truth {truth}");
    }
    // The swing is in the raw effort, and probes explain it.
    let error = |of: &Agreement| {
        let counted = (0..of.measured[0].len()).filter(|k| of.counted[*k]);
        rms(counted.map(|k| of.measured[0][k] - of.predicted[0][k]))
    };
    let [told, untold] = [&with, &without].map(|of| error(&of.training[0]));
    assert!(told < 0.2 * untold, "{told} {untold}");

    // An estimate that was read again predicts what the one in memory does, with probes among the states.
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("estimate.json");
    std::fs::write(&file, estimate.to_json()).unwrap();
    let read = Estimate::read(&file).unwrap();
    assert_eq!(read.model.clearance.len(), 2);
    let model = read.effort_model(&file, Split::Consistent).unwrap();
    let settings = ConditioningSettings::default();
    let prepared = probed(&other, &PROBES).prepare(&model, &settings).unwrap();
    let alignment = Alignment {
        state_hz: read.model.state_hz,
        delay_samples: read.conditioning.delay_samples,
        delay_rate_hz: read.conditioning.delay_rate_hz,
        filter_hz: read.model.kernel_hz,
    };
    let values = read.values(Split::Consistent);
    let found = compare(&model, &values, &prepared, &alignment, &settings).unwrap();
    assert!(error(&found) < 1.5 * told, "{} {told}", error(&found));
}

#[test]
fn locked_joints_have_no_clearance() {
    let xy = robot(&pointing()).locked(&[("j2".to_owned(), 0.3)]).unwrap();
    assert_eq!(xy.elements.clearance.len(), 1);
    let log = simulate(&xy, &SimulateSettings { duration_s: 1.0, ..SimulateSettings::default() }).unwrap();
    assert_eq!(log.channels.len(), 5);
}

#[test]
fn what_an_identification_has_no_form_for_says_so() {
    let log = simulate(&bearings_alone(), &SimulateSettings { duration_s: 6.0, ..published(500.0) }).unwrap();
    let told = |text: &str, log: Log, settings: &Settings| {
        identify(&robot(text), [log], settings, &mut |_| {}).unwrap_err().to_string()
    };
    let default = Settings::default();
    let text = pointing().replace("\nclearance", "\nelements = []\nclearance");
    let half = told(&text, probed(&log, &PROBES[..3]), &default);
    assert!(half.contains("journal_j2_y"), "{half}");
    let mut micro = log.clone();
    micro.channels.iter_mut().for_each(|(_, values)| values.iter_mut().for_each(|x| *x *= 1e6));
    let micro = told(&text, probed(&micro, &PROBES), &default);
    assert!(micro.contains("below its radius of 0.01 m") && micro.contains("scale = 1e-6"), "{micro}");
    let pressed = text.replacen(
        "elements = []",
        "elements = [\"reaction_friction\"]\nreaction_friction = { preload = 3 }",
        1,
    );
    let pressed = told(&pressed, probed(&log, &PROBES), &default);
    assert!(
        pressed.contains("`reaction_friction`") && pressed.contains("clearance = \"ideal\""),
        "{pressed}"
    );
}

#[test]
fn what_has_no_form_with_clearance_says_so() {
    let told =
        |robot: &Robot, settings: SimulateSettings| simulate(robot, &settings).unwrap_err().to_string();
    let default = SimulateSettings::default;
    let xy = robot(&pointing());
    let closed = SimulateSettings { mode: SimulateMode::ClosedLoop, settle_s: Some(0.5), ..default() };
    let message = told(&xy, closed);
    assert!(message.contains("`settle_s`") && message.contains("closed loop"), "{message}");
    let message = told(&ideal(), SimulateSettings { journal_noise: 1e-6, ..default() });
    assert!(message.contains("`journal_noise`") && message.contains("clearance"), "{message}");
    let message = told(&ideal(), SimulateSettings { settle_s: Some(1.0), ..default() });
    assert!(message.contains("`settle_s`"), "{message}");
    let message = told(&xy, SimulateSettings { settle_s: Some(-1.0), ..default() });
    assert!(message.contains("`settle_s`"), "{message}");
    let elastic = pointing().lines().filter(|l| !l.starts_with("clearance")).collect::<Vec<_>>().join("\n");
    let elastic =
        elastic.replace("[element.j1]", "[element.j1]\nelastic = { ratio = 100, k1 = 1e4 }").replace(
            "[element.j2]",
            "[element.j2]\nclearance = { journal_radius = 0.01, gap = 5e-5, width = 0.02 }",
        );
    assert!(told(&robot(&elastic), default()).contains("elastic"));
}
