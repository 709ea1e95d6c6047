//! Identifies a joint whose friction follows a law of one's own, on arrays that the program makes.
//!
//! `cargo run --release -p dynid --example own_friction_law`
#![expect(clippy::print_stdout, reason = "the result of a program")]

use dynid::log::Log;
use dynid::model::Scalar;
use dynid::model::element::{ElementKind, ElementRegistry, LinearTerm, ShapeTerm, Velocity, VelocityLaw};
use dynid::motion::{JointSignals, Log as Recording};
use dynid::settings::{Friction, Settings};
use dynid::{Robot, RobotOptions};

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
    // 30 s at 200 Hz: hc 2 N m, hs 3 N m, hv 0.15 rad/s, viscous 0.8 N m s/rad, 0.3 kg m², noise of some 0.02 N m.
    let time: Vec<f64> = (0..6000).map(|k| 0.005 * f64::from(k)).collect();
    let row = |t: f64| {
        let wave = |a: f64, w: f64| [a * (w * t).sin(), a * w * (w * t).cos(), -a * w * w * (w * t).sin()];
        let [q, v, acceleration] = std::array::from_fn(|d| wave(0.5, 1.3)[d] + wave(0.1, 4.7)[d]);
        let friction = v.signum() * (2.0 + 1.0 / (1.0 + (v / 0.15) * (v / 0.15))) + 0.8 * v;
        let noise = 0.035 * ((t * 15_646.6).sin() * 43_758.545).fract();
        (q, 0.3 * acceleration + friction + noise)
    };
    let (position, effort) = time.iter().map(|t| row(*t)).unzip();
    let joint = JointSignals { name: "j1".to_owned(), position, velocity: None, effort };
    let law = ElementKind::law("hess_soom", HessSoom).reference("Hess & Soom 1990");
    let robot = Robot::parse(ROBOT, "turntable.toml".as_ref(), &RobotOptions::default())?
        .with_registry(ElementRegistry::default().with(law)?);
    let log = Log::new(&robot, Recording::new("made here", time, vec![joint], Vec::new())?)?;
    let settings = Settings::default().with(|s| s.elements.friction = Friction::Given);
    let estimate = dynid::pipeline::identify(&robot, [log], &settings, &mut |_| {})?.estimate();
    for p in estimate.parameters.iter().filter(|p| p.name.starts_with("j1.")) {
        println!("{} = {:.4} in {:.4?} {}, {}", p.name, p.value, p.interval, p.unit, p.verdict);
    }
    let hv = &estimate.shape_parameters[0];
    println!("{} = {:.4} in {:.4?} {}, {}", hv.name, hv.value, hv.interval, hv.unit, hv.verdict);
    Ok(())
}
