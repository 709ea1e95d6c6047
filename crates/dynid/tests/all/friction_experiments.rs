//! Friction experiments from log files: synthetic sweeps made from the closed form.

#![expect(clippy::unwrap_used, reason = "helpers of tests outside of test functions")]

use std::fmt::Write;
use std::path::Path;

use dynid::friction::model::ViscousModel;
use dynid::friction::{FrictionConfig, FrictionModel, identify_friction};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// `F_c, F_s, v_s`, values at 0 °C and slopes of `σ2, σ3, σ4`, `σ0, σ1`, inertia, noise of the effort.
struct Truth {
    joint: &'static str,
    fc: f64,
    fs: f64,
    vs: f64,
    sigma: [(f64, f64); 3],
    bristle: [f64; 2],
    inertia: f64,
    noise: f64,
}

const J1: Truth = Truth {
    joint: "j1",
    fc: 9.1,
    fs: 11.83,
    vs: 0.04,
    sigma: [(63.818, -1.00172), (1.0267, 0.013333), (0.7589, 0.004444)],
    bristle: [16804.0, 270.0],
    inertia: 1.4,
    noise: 0.6,
};
const J3: Truth = Truth {
    joint: "j3",
    fc: 2.5,
    fs: 3.25,
    vs: 0.05,
    sigma: [(13.049, -0.19429), (1.1267, 0.013333), (0.7589, 0.004444)],
    bristle: [1820.0, 105.0],
    inertia: 0.6,
    noise: 0.4,
};
const TEMPERATURES: [f64; 7] = [19.0, 25.0, 30.0, 35.0, 40.0, 45.0, 51.0];
const ENCODER: f64 = std::f64::consts::TAU / 65536.0;

const ROBOT: &str = r#"schema = 1
name = "pair"
dh = "modified"
[[joint]]
name = "j1"
a = 0.0
alpha = 0.0
d = 0.3
offset = 0.0
[[joint]]
name = "j3"
a = 0.45
alpha = "90deg"
d = 0.0
offset = 0.0
"#;

impl Truth {
    fn viscous(&self, v: f64, t: f64) -> f64 {
        let [s2, s3, s4] = self.sigma.map(|(value, slope)| value + slope * t);
        s2 * (1.0 - (-(s3 * v).powf(s4)).exp())
    }

    fn bristles(&self, v: f64) -> f64 {
        self.fc + (self.fs - self.fc) * (-(v / self.vs).powi(2)).exp()
    }

    fn friction(&self, v: f64, t: f64) -> f64 {
        self.bristles(v) + self.viscous(v, t)
    }

    /// A log at one temperature: every speed forth and back, ramps between, the other joint at rest.
    fn sweep(&self, temperature: f64, speeds: &[f64], directions: &[f64], seed: u64) -> String {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
        let rate = 100.0;
        let other = if self.joint == "j1" { "j3" } else { "j1" };
        let (a, b) = (self.joint, other);
        let mut text = format!("t,q_{a},q_{b},effort_{a},effort_{b},temp_{a},temp_{b}\n");
        let (mut t, mut q, mut v) = (0.0, 0.2, 0.0_f64);
        let mut row = |v: f64, acceleration: f64, t: &mut f64, q: &mut f64| {
            let warm = temperature + 0.3 * (*t / 40.0).sin();
            let friction = if v == 0.0 { 0.0 } else { v.signum() * self.friction(v.abs(), warm) };
            let effort =
                8.0 * (*q + 0.3).cos() + 0.5 + friction + self.inertia * acceleration + self.noise * normal();
            let measured = (*q / ENCODER).round() * ENCODER;
            writeln!(text, "{t:.3},{measured:.8},0.1,{effort:.5},1.5,{warm:.3},24.0").unwrap();
            *t += 1.0 / rate;
            *q += v / rate + 0.5 * acceleration / rate / rate;
        };
        for speed in speeds {
            let duration = (2.4 / speed).clamp(1.2, 4.0);
            for direction in directions {
                let target = direction * speed;
                let acceleration = 12.0_f64.max(4.0 * speed) * (target - v).signum();
                while (target - v).abs() > acceleration.abs() / rate {
                    row(v, acceleration, &mut t, &mut q);
                    v += acceleration / rate;
                }
                v = target;
                for _ in 0..(duration * rate) as usize {
                    row(v, 0.0, &mut t, &mut q);
                }
            }
            v = 0.0;
            (0..30).for_each(|_| row(0.0, 0.0, &mut t, &mut q));
        }
        text
    }

    /// A pre-sliding log at 2 kHz of the closed form: bristles advanced exactly at held speed, in steps of 5 µs.
    fn presliding(&self, temperature: f64, resolution: f64, seed: u64) -> String {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
        let (rate, substeps) = (2000.0, 100);
        let h = 1.0 / rate / f64::from(substeps);
        let other = if self.joint == "j1" { "j3" } else { "j1" };
        let (a, b) = (self.joint, other);
        let mut text = format!("t,q_{a},q_{b},effort_{a},effort_{b},temp_{a},temp_{b}\n");
        let [sigma0, sigma1] = self.bristle;
        let (mut q, mut v, mut z) = (0.0_f64, 0.0_f64, 0.0_f64);
        for k in 0..4000 {
            let t = f64::from(k) / rate;
            let w = std::f64::consts::TAU * 3.0;
            let effort = 0.7 * self.fs * ((w * t).sin() + 0.5 * (2.3 * w * t).sin());
            let measured = q + 2e-6 * normal();
            let measured =
                if resolution > 0.0 { (measured / resolution).round() * resolution } else { measured };
            writeln!(text, "{t:.4},{measured:.9},0.1,{effort:.9},0.0,{temperature},24.0").unwrap();
            for _ in 0..substeps {
                let g = self.bristles(v.abs());
                let bend = v - sigma0 * v.abs() * z / g;
                let friction = sigma0 * z + sigma1 * bend + self.viscous(v.abs(), temperature).copysign(v);
                v += h * (effort - friction) / self.inertia;
                q += h * v;
                let still = g * v.signum() / sigma0;
                z = if v == 0.0 { z } else { still + (z - still) * (-sigma0 * v.abs() * h / g).exp() };
            }
        }
        text
    }
}

fn speeds(low: f64, high: f64, count: u32) -> Vec<f64> {
    (0..count).map(|k| low * (high / low).powf(f64::from(k) / f64::from(count - 1))).collect()
}

fn config(folder: &Path, text: &str) -> FrictionConfig {
    std::fs::write(folder.join("robot.toml"), ROBOT).unwrap();
    std::fs::write(folder.join("friction.toml"), format!("robot = \"robot.toml\"\n{text}")).unwrap();
    FrictionConfig::read(&folder.join("friction.toml")).unwrap()
}

fn model(config: &FrictionConfig) -> FrictionModel {
    identify_friction(config, &mut |_| {}).unwrap().model(config).unwrap()
}

fn message(folder: &Path, text: &str) -> String {
    let error = identify_friction(&config(folder, text), &mut |_| {}).unwrap_err();
    format!("{error} / {}", error.hint().unwrap_or_default())
}

#[test]
fn sweeps_over_temperatures_give_the_law_and_presliding_the_bristles() {
    let folder = tempfile::tempdir().unwrap();
    let mut text = String::from("temperature_range = [15, 52]\n");
    for truth in [&J1, &J3] {
        for (k, t) in TEMPERATURES.iter().enumerate() {
            let name = format!("{}_{k}.csv", truth.joint);
            let log = truth.sweep(*t, &speeds(0.01, 2.4, 16), &[1.0, -1.0], k as u64);
            std::fs::write(folder.path().join(&name), log).unwrap();
            writeln!(text, "[[log]]\npath = \"{name}\"").unwrap();
        }
        let name = format!("{}_presliding.csv", truth.joint);
        std::fs::write(folder.path().join(&name), truth.presliding(31.0, 0.0, 9)).unwrap();
        writeln!(
            text,
            "[[presliding]]\npath = \"{name}\"\njoint = \"{}\"\ninertia = {}",
            truth.joint, truth.inertia
        )
        .unwrap();
    }
    let config = config(folder.path(), &text);
    let start = std::time::Instant::now();
    let found = identify_friction(&config, &mut |_| {}).unwrap();
    println!("identified in {:.2} s", start.elapsed().as_secs_f64());
    let model = found.model(&config).unwrap();
    println!("{:?} {:?}", model.verdict, model.warnings);
    for joint in &model.joints {
        println!("{}: {} {:?}", joint.joint, joint.status, joint.notes);
    }
    assert_eq!((model.verdict.status.word(), model.joints.len()), ("pass", 2), "{:?}", model.verdict);
    for (truth, (joint, inside)) in [&J1, &J3].into_iter().zip(model.joints.iter().zip(&found.joints)) {
        assert_eq!((joint.joint.as_str(), joint.status.word()), (truth.joint, "identified"));
        assert_eq!(
            (joint.points.len(), joint.levels.len(), joint.lines.len()),
            (112, 7, 3),
            "{:?}",
            joint.notes
        );
        let law = &inside.law.as_ref().unwrap().law;
        let (mut worst, mut peak) = (0.0_f64, 0.0_f64);
        for t in (0..=32).map(|k| 19.0 + f64::from(k)) {
            for v in speeds(0.02, 2.4, 60) {
                let exact = truth.friction(v, t);
                worst = worst.max((law.friction(&[v], &[t])[0] - exact).abs());
                peak = peak.max(exact);
            }
        }
        println!("{}: curve {:.2} % of its largest value", truth.joint, 100.0 * worst / peak);
        assert!(worst < 0.03 * peak, "{worst} of {peak}");
        let bristle = joint.bristle.unwrap();
        println!("{}: {bristle:?} {:?}", truth.joint, joint.presliding);
        for (found, exact) in [bristle.sigma0, bristle.sigma1].into_iter().zip(truth.bristle) {
            assert!((found / exact - 1.0).abs() < 0.05, "{found} {exact}");
        }
        for (symbol, (value, slope)) in ["sigma2", "sigma3", "sigma4"].into_iter().zip(truth.sigma) {
            let line = &joint.lines[symbol];
            println!(
                "{symbol}: {:.4} ± {:.4} ({:.4}), slope {:.5} ± {:.5} ({slope})",
                line.intercept,
                line.intercept_half_width,
                value + 25.0 * slope,
                line.slope,
                line.slope_half_width
            );
            // 95 % intervals of two joints: doubled, a miss is one in ten thousand.
            assert!(
                (line.intercept - value - 25.0 * slope).abs() < 2.0 * line.intercept_half_width,
                "{symbol}"
            );
            assert!((line.slope - slope).abs() < 2.0 * line.slope_half_width, "{symbol}");
        }
        assert!(matches!(joint.viscous, Some(ViscousModel::Exponential(_))));
    }
    // The file reads back as it was, and a second run gives the same bytes.
    let path = folder.path().join("friction.json");
    std::fs::write(&path, model.to_json()).unwrap();
    assert_eq!(FrictionModel::load(&path).unwrap().to_json(), model.to_json());
    let again = identify_friction(&config, &mut |_| {}).unwrap();
    assert_eq!(again.model(&config).unwrap().to_json(), model.to_json());
}

#[test]
fn one_direction_alone_is_a_result_that_says_so() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("a.csv"), J1.sweep(30.0, &[0.4, 0.8], &[1.0], 1)).unwrap();
    let model = model(&config(folder.path(), "[[log]]\npath = \"a.csv\"\n"));
    assert_eq!(model.verdict.status.word(), "fail");
    assert!(
        model.verdict.headline.contains("Coulomb friction and offset cannot be told apart"),
        "{}",
        model.verdict.headline
    );
    let joint = &model.joints[0];
    assert_eq!((joint.status.word(), joint.coulomb, joint.unpaired.len()), ("one_direction", None, 2));
    assert!(
        joint.notes.iter().any(|n| n.contains("friction, gravity and offset together")),
        "{:?}",
        joint.notes
    );
}

#[test]
fn without_temperature_what_is_lost_is_said_and_required_lines_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let log = J1.sweep(30.0, &speeds(0.01, 2.4, 16), &[1.0, -1.0], 1).replace("temp_", "extra_");
    std::fs::write(folder.path().join("a.csv"), log).unwrap();
    let found = model(&config(folder.path(), "[[log]]\npath = \"a.csv\"\n"));
    assert_eq!((found.joints[0].status.word(), found.joints[0].temperature_range), ("simplified", None));
    assert!(
        found.joints[0].notes.iter().any(|n| n.contains("no temperature is logged")),
        "{:?}",
        found.joints[0].notes
    );
    let said = message(folder.path(), "thermal_lines = \"required\"\n[[log]]\npath = \"a.csv\"\n");
    assert!(said.contains("a.csv: joint `j1`: expected a temperature column"), "{said}");
    std::fs::write(folder.path().join("b.csv"), J1.sweep(30.0, &speeds(0.01, 2.4, 16), &[1.0, -1.0], 1))
        .unwrap();
    let said = message(folder.path(), "thermal_lines = \"required\"\n[[log]]\npath = \"b.csv\"\n");
    assert!(said.contains("slopes over temperature are not estimable"), "{said}");
}

#[test]
fn implausible_temperatures_are_refused_and_doubtful_ones_are_said() {
    let folder = tempfile::tempdir().unwrap();
    let log = |t: f64| J1.sweep(30.0, &[0.4, 0.8, 1.2], &[1.0, -1.0], 1).replace(",30.", &format!(",{t}."));
    std::fs::write(folder.path().join("a.csv"), log(303.0)).unwrap();
    let said = message(folder.path(), "[[log]]\npath = \"a.csv\"\n");
    assert!(said.contains("between -40 and 120 °C") && said.contains("unit = \"K\""), "{said}");
    std::fs::write(folder.path().join("a.csv"), log(86.0).replace(",29.", ",85.")).unwrap();
    let found = model(&config(folder.path(), "[[log]]\npath = \"a.csv\"\n"));
    assert!(found.warnings.iter().any(|w| w.contains("Fahrenheit")), "{:?}", found.warnings);
}

#[test]
fn a_log_without_constant_speed_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let mut log = String::from("t,q_j1,q_j3,effort_j1,effort_j3\n");
    for k in 0..2000 {
        let t = f64::from(k) / 100.0;
        writeln!(log, "{t},{},0.1,{},0.0", (4.0 * t).sin(), (4.0 * t).cos()).unwrap();
    }
    std::fs::write(folder.path().join("a.csv"), log).unwrap();
    let said = message(folder.path(), "[[log]]\npath = \"a.csv\"\n");
    assert!(
        said.contains("a.csv: expected stretches of constant speed of 0.3 s or more, found none"),
        "{said}"
    );
    assert!(said.contains("forth and back"), "{said}");
}

#[test]
fn a_vanishing_sigma2_is_flagged() {
    let folder = tempfile::tempdir().unwrap();
    let cold = Truth { sigma: [(40.0, -1.0), J1.sigma[1], J1.sigma[2]], noise: 0.1, ..J1 };
    let mut text = String::new();
    for (k, t) in [10.0, 20.0, 30.0, 45.0].into_iter().enumerate() {
        std::fs::write(
            folder.path().join(format!("{k}.csv")),
            cold.sweep(t, &speeds(0.01, 2.4, 16), &[1.0, -1.0], k as u64),
        )
        .unwrap();
        writeln!(text, "[[log]]\npath = \"{k}.csv\"").unwrap();
    }
    let found = model(&config(folder.path(), &text));
    assert_eq!(
        (found.verdict.status.word(), found.joints[0].status.word()),
        ("fail", "invalid"),
        "{:?}",
        found.joints[0].notes
    );
    assert!(found.joints[0].notes[0].contains("sigma2 vanishes at 40"), "{:?}", found.joints[0].notes);
    assert!(found.joint("j1").is_none());
}

#[test]
fn a_coarse_encoder_keeps_the_prior() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("a.csv"), J1.sweep(30.0, &speeds(0.01, 2.4, 16), &[1.0, -1.0], 1))
        .unwrap();
    std::fs::write(folder.path().join("p.csv"), J1.presliding(30.0, ENCODER, 1)).unwrap();
    let text = "[[log]]\npath = \"a.csv\"\n[[presliding]]\npath = \"p.csv\"\njoint = \"j1\"\ninertia = 1.4\n\
                [prior.j1]\nsigma0 = 15000\nsigma1 = 245\n";
    let found = model(&config(folder.path(), text));
    let joint = &found.joints[0];
    assert!(joint.bristle.is_some_and(|b| b.prior && b.sigma0 == 15000.0), "{:?}", joint.presliding);
    assert_eq!(joint.presliding[0].status.word(), "not_identifiable");
    assert!(
        joint.notes.iter().any(|n| n.contains("too coarse") && n.contains("prior is kept")),
        "{:?}",
        joint.notes
    );
}
