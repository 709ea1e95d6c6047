//! A period of the pointing mechanism with clearance, by collocation and by the classical Runge-Kutta method:
//! `cargo bench -p dynid-sim --bench clearance`.
//!
//! The reference is collocation with a thousandth of the tolerance.
#![expect(clippy::print_stdout, clippy::unwrap_used, reason = "a benchmark reports to the terminal")]

use std::time::Instant;

use dynid_sim::SimError;
use dynid_sim::clearance::{ClearanceRecord, ClearanceSettings, ClearanceStart, Driving, Method, simulate};

#[path = "../tests/all/pointing.rs"]
mod pointing;

/// The published period, s.
const PERIOD: f64 = 5.0 * std::f64::consts::PI;

fn run(method: Method, times: &[f64]) -> Result<(ClearanceRecord, f64), SimError> {
    let start = Instant::now();
    let settings = ClearanceSettings { method, channels: Vec::new() };
    let driving = Driving::Prescribed(&pointing::excitation);
    let record = simulate(pointing::plant(), &ClearanceStart::default(), driving, times, &settings)?;
    Ok((record, start.elapsed().as_secs_f64()))
}

/// Root of the mean square of differences of torques, after half a second.
fn difference(a: &ClearanceRecord, b: &ClearanceRecord) -> [f64; 2] {
    [0, 1].map(|joint| {
        let (mut sum, mut count) = (0.0, 0);
        for (k, t) in a.time.iter().enumerate() {
            if *t >= a.time[a.time.len() - 1].min(1.0) / 2.0 {
                sum += (a.effort[k][joint] - b.effort[k][joint]).powi(2);
                count += 1;
            }
        }
        (sum / f64::from(count)).sqrt()
    })
}

fn main() {
    let span: f64 = std::env::args().find_map(|a| a.parse().ok()).unwrap_or(PERIOD);
    let samples = (1571.0 * span / PERIOD).round() as usize;
    let times: Vec<f64> = (0..=samples).map(|k| span * k as f64 / samples as f64).collect();
    let collocation = |tolerance| Method::Collocation { tolerance, longest_step: f64::INFINITY };
    let (reference, _) = run(collocation(1e-11), &times).unwrap();
    let mut methods: Vec<(String, Method)> = [1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10]
        .map(|t| (format!("collocation {t:.0e}"), collocation(t)))
        .into();
    methods.extend(
        [7e-5, 5e-5, 3e-5, 2e-5, 1e-5]
            .map(|step| (format!("Runge-Kutta {step:.0e} s"), Method::RungeKutta4 { step })),
    );
    println!("{span:.3} s, {} samples; differences of torques from the reference, N m", times.len());
    for (name, method) in methods {
        let (record, seconds) = match run(method, &times) {
            Ok(found) => found,
            Err(error) => {
                println!("{name:24} {error}");
                continue;
            }
        };
        let [a, b] = difference(&record, &reference);
        let c = record.count;
        println!(
            "{name:24} {a:8.1e} {b:8.1e}  {:8} evaluations {:7} steps {:6} repeated {:6} jacobians {:5} passages \
             {:2} events, energy {:.1e}, {seconds:.3} s",
            c.evaluations,
            c.steps,
            c.repeated,
            c.jacobians,
            c.passages,
            record.events.len(),
            record.energy.relative_error().unwrap_or(f64::NAN),
        );
    }
}
