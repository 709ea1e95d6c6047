//! Identifies a joint whose friction follows a law of one's own, on a log that the program makes.
//!
//! `cargo run --release -p dynid --example own_friction_law`
#![expect(clippy::print_stdout, reason = "the result of a program")]

use std::fmt::Write as _;

use dynid::config::{Config, Friction, LogConfig};
use dynid::model::Scalar;
use dynid::model::element::{ElementKind, ElementRegistry, LinearTerm, ShapeTerm, Velocity, VelocityLaw};

/// Friction that falls from `hs` at rest to `hc` as `1 / (1 + (v/hv)²)` (Hess & Soom 1990).
#[derive(Debug, Clone)]
struct HessSoom;

impl VelocityLaw<1, 2> for HessSoom {
    fn linear(&self) -> [LinearTerm; 2] {
        [LinearTerm::effort("hc").friction(), LinearTerm::effort("hs").friction()]
    }
    fn shape(&self) -> [ShapeTerm; 1] {
        [ShapeTerm::speed("hv", 0.001, 0.3)]
    }
    fn columns<S: Scalar>(&self, v: Velocity<S>, [hv]: [S; 1]) -> [S; 2] {
        let x = v.value() / hv;
        let falling = (S::one() + x * x).recip();
        [v.sign() * (S::one() - falling), v.sign() * falling]
    }
}

const ROBOT: &str = "schema = 1\nname = \"turntable\"\ndh = \"modified\"\n[[joint]]\nname = \"j1\"\n\
    limits = { velocity = 2.0 }\nphi = [1, 0, 0, 0, 0.3, 0, 0, 0.3, 0, 0.3]\n\
    [element.j1]\nelements = [\"hess_soom\", \"viscous\"]\n";

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let folder = std::env::temp_dir().join(format!("own_friction_law-{}", std::process::id()));
    std::fs::create_dir_all(&folder)?;
    // 30 s at 200 Hz: hc 2 N m, hs 3 N m, hv 0.15 rad/s, viscous 0.8 N m s/rad, 0.3 kg m², noise of some 0.02 N m.
    let mut log = String::from("t,q1,tau1\n");
    for t in (0..6000).map(|k| 0.005 * f64::from(k)) {
        let wave = |a: f64, w: f64| [a * (w * t).sin(), a * w * (w * t).cos(), -a * w * w * (w * t).sin()];
        let [q, v, acceleration] = std::array::from_fn(|d| wave(0.5, 1.3)[d] + wave(0.1, 4.7)[d]);
        let friction = v.signum() * (2.0 + 1.0 / (1.0 + (v / 0.15) * (v / 0.15))) + 0.8 * v;
        let noise = 0.035 * ((t * 15_646.6).sin() * 43_758.545).fract();
        writeln!(log, "{t},{q},{}", 0.3 * acceleration + friction + noise)?;
    }
    std::fs::write(folder.join("robot.toml"), ROBOT)?;
    std::fs::write(folder.join("log.csv"), log)?;

    let law = ElementKind::law("hess_soom", HessSoom).reference("Hess & Soom 1990");
    let log = LogConfig { path: folder.join("log.csv"), ..LogConfig::default() };
    let mut config = Config { robot: folder.join("robot.toml"), log: vec![log], ..Config::default() };
    config.registry = ElementRegistry::default().with(law)?;
    config.elements.friction = Friction::Given;
    let estimate = dynid::identify(&config, &mut |_| {})?.estimate();
    for p in estimate.parameters.iter().filter(|p| p.name.starts_with("j1.")) {
        println!("{} = {:.4} in {:.4?} {}, {}", p.name, p.value, p.interval, p.unit, p.verdict);
    }
    for p in &estimate.shape_parameters {
        println!("{} = {:.4} in {:.4?} {}, {}", p.name, p.value, p.interval, p.unit, p.verdict);
    }
    Ok(std::fs::remove_dir_all(folder)?)
}
