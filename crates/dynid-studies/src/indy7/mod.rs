//! Indy7: friction of speed and temperature first, rigid bodies second. See `README.md` in this folder.

mod dynamics;
mod estimators;
mod excitation;
mod experiment;
mod friction;
mod identification;
mod one_shot;
mod reference;
mod robot;
mod settings;
mod sweep;

use crate::{Progress, RunSettings, StudyError, StudyRecord, StudyRun};

/// Joints of the arm.
const JOINTS: usize = 6;

/// A fault of this study's data or of the rooms below.
fn fault(error: impl std::fmt::Display) -> StudyError {
    StudyError::Data { file: "indy7", message: error.to_string() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use identification::*;
    use dynid::estimators::separable::SteadyFrictionRow;
    use dynid::model::element::*;
    #[test]
    fn steps() {
        let settings = settings::Settings::read().unwrap();
        let arm = robot::Indy7::new(&settings).unwrap();
        let s = std::time::Instant::now();
        let found = friction::experiment(&arm, &settings, &RunSettings { quick: true, seed: 1 }, 1).unwrap();
        println!("STEP {:?}", s.elapsed());
        for (j, f) in found.iter().enumerate() {
            let mut worst = 0.0f64; let mut top = 0.0f64;
            for t in [19.0, 31.0, 43.0, 51.0] { for v in [0.02, 0.05, 0.1, 0.3, 0.7, 1.2, 2.0, 2.4] {
                let own = f.fit.law.friction(&[v], &[t])[0];
                let truth = settings.friction[j].steady(v, t);
                worst = worst.max((own - truth).abs()); top = top.max(truth);
            }}
            println!("STEP {j}: {} points worst {:.4} {:?} rms {:.3} {:?}", f.points.len(), worst / top, f.fit.law.form, f.fit.error.rms, f.fit.notes);
        }
    }
    #[test]
    fn golden() {
        let settings = settings::Settings::read().unwrap();
        let arm = robot::Indy7::new(&settings).unwrap();
        let mut rows = dynamics::rows(&arm, &settings).unwrap();
        rows.extend(estimators::rows(&arm, &settings).unwrap());
        let d = excitation::designed(&arm, &settings, &RunSettings { quick: true, seed: 1 }).unwrap();
        rows.extend(excitation::rows(d.as_ref()));
        for r in rows { println!("ROW {} {} {}", r.id, r.pass, r.words); }
    }
    #[test]
    fn speed() {
        let settings = settings::Settings::read().unwrap();
        let arm = robot::Indy7::new(&settings).unwrap();
        let clock = |what: &str, s: std::time::Instant| println!("{what}: {:.2?}", s.elapsed());
        let run = |rows: &[Vec<f64>], t: f64, seed: u64| {
            let tr = experiment::trajectory(rows).unwrap();
            let e = experiment::Experiment { trajectory: &tr, temperature: experiment::constant(t).unwrap(), ripple: true, rate_hz: 4000.0, seed };
            e.prepared("x", &arm, &settings).unwrap()
        };
        let s = std::time::Instant::now();
        let id = run(&settings.trajectories.excitation, 31.0, 1);
        clock("log", s);
        let s = std::time::Instant::now();
        let conv = regression(&arm, vec![], &id, &settings, PAPER).unwrap();
        clock("conventional", s);
        let known = || settings.friction.iter().enumerate().flat_map(|(j, f)| f.known(j, settings.thermal.valid)).collect::<Vec<_>>();
        let s = std::time::Instant::now();
        let prop = regression(&arm, known(), &id, &settings, PAPER).unwrap();
        clock("proposed", s);
        let ours = regression(&arm, known(), &id, &settings, OURS).unwrap();
        let mut points = Vec::new();
        for (j, f) in settings.friction.iter().enumerate() {
            for t in &settings.thermal.levels {
                for k in 0..16 {
                    let v = 0.01 * 240f64.powf(k as f64 / 15.0);
                    points.push(SteadyFrictionRow { output: j, speed: v, temperature: *t, friction: f.steady(v, *t) + 0.02 * (12.9898 * (k as f64 + 7.1 * t + 31.0 * j as f64)).sin(), std: 0.02 });
                }
            }
        }
        let start = settings.friction.iter().enumerate().map(|(rate, f)| {
            let free = |x: f64| ShapeSetting { start: x, lower: x / 4.0, upper: x * 4.0, held: false };
            let at = |l: [f64; 2]| l[0] + 25.0 * l[1];
            let slope = ShapeSetting { start: 0.0, lower: -0.05, upper: 0.05, held: false };
            one_shot::FrictionStart {
            bristles: LuGre { rate, kappa: ShapeSetting::held(f.sigma0 / f.coulomb), rho: free(f.fixed / f.coulomb * 0.95), vs: free(f.stribeck_speed * 1.2), delta: ShapeSetting::held(2.0) },
            viscous: ExponentialViscous { sigma3: free(at(f.sigma3)), sigma3_slope: slope, sigma4: free(at(f.sigma4)), sigma4_slope: slope, temperature_range: (15.0, 52.0), ..ExponentialViscous::new(rate) },
        }}).collect();
        let s = std::time::Instant::now();
        let shot = one_shot::one_shot(&arm, start, &points, &id, OURS).unwrap();
        clock("one shot", s);
        for t in [20.5, 43.0] {
            for v in &settings.trajectories.validation {
                let log = run(v, t, 5);
                for (n, e) in [("conv", &conv), ("prop", &prop), ("ours", &ours), ("shot", &shot)] {
                    println!("{t} {n} {:.3?} {:?}", e.rmse(&log, &settings).unwrap(), e.margins);
                }
            }
        }
    }
}
