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
mod validation;

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
    fn seeds() {
        let settings = settings::Settings::read().unwrap();
        let arm = robot::Indy7::new(&settings).unwrap();
        let run = RunSettings { quick: true, seed: 1 };
        let v: Vec<_> = [20.5, 43.0].iter().map(|t| validation::Validation::new(&arm, &settings, *t, 1).unwrap()).collect();
        for (name, rows) in [("ref", settings.trajectories.excitation.clone()), ("own", excitation::designed(&arm, &settings, &run).unwrap().unwrap().rows)] {
            for seed in 1..4 {
                let r = validation::realisation(&arm, &settings, &rows, &run, seed).unwrap();
                for v in &v {
                    for (n, e) in [("conv", &r.conventional), ("prop", &r.proposed), ("two", &r.two_step), ("one", &r.one_shot)] {
                        let t = v.table(e, &settings).unwrap();
                        let m: Vec<f64> = (0..6).map(|j| validation::median(t.iter().map(|r| r[j]).collect())).collect();
                        println!("SEED {name} {seed} {n} {m:.3?}");
                    }
                }
                let b: Vec<f64> = [&r.conventional, &r.proposed, &r.two_step, &r.one_shot].iter().map(|e| { let t = arm.base_values(&arm.standard); let b = e.base(&arm); (b.iter().zip(&t).map(|(a, b)| (a - b).powi(2)).sum::<f64>() / 40.0).sqrt() }).collect();
                println!("SEED base errors {b:.4?}");
            }
        }
    }
    #[test]
    fn variants() {
        let settings = settings::Settings::read().unwrap();
        let arm = robot::Indy7::new(&settings).unwrap();
        let run = RunSettings { quick: true, seed: 1 };
        let friction = friction::experiment(&arm, &settings, &run, 1).unwrap();
        let make = |rows: &[Vec<f64>], t: f64, ripple: bool, seed: u64| {
            let tr = experiment::trajectory(rows).unwrap();
            let e = experiment::Experiment { trajectory: &tr, temperature: experiment::constant(t).unwrap(), ripple, rate_hz: 4000.0, seed };
            e.prepared("x", &arm, &settings).unwrap()
        };
        let points: Vec<_> = friction.iter().enumerate().flat_map(|(j, f)| f.rows(j)).collect();
        for ripple in [false, true] {
            let val: Vec<_> = settings.trajectories.validation.iter().enumerate().map(|(k, v)| make(v, 20.5, ripple, 40 + k as u64)).collect();
            let id = make(&settings.trajectories.excitation, 31.0, ripple, 1);
            let two = regression(&arm, validation::known(&friction, &settings, None).unwrap(), &id, &settings, OURS).unwrap();
            let prop = regression(&arm, validation::known(&friction, &settings, None).unwrap(), &id, &settings, PAPER).unwrap();
            let mut all = vec![("prop".to_owned(), prop), ("two".to_owned(), two)];
            {
                use dynid::model::*;
                let mut el: Vec<Box<dyn JointElement>> = Vec::new();
                for rate in 0..6 { el.push(Box::new(RotorInertia { rate })); el.push(Box::new(Offset { rate })); }
                let model = RobotModel::new(arm.mechanism.clone(), el).with_known(validation::known(&friction, &settings, None).unwrap());
                all.push(("nofree".to_owned(), regression_of(&arm, model, &id, &settings, OURS).unwrap()));
                let model = RobotModel::new(arm.mechanism.clone(), (0..6).map(|rate| Box::new(RotorInertia { rate }) as Box<dyn JointElement>).collect()).with_known(validation::known(&friction, &settings, None).unwrap());
                let mut values = arm.standard.clone(); values.truncate(66);
                all.push(("truth".to_owned(), Identified { model, values, margins: [0.0; 2] }));
            }
            for k in [0.0, 10.0] {
                let starts: Vec<_> = friction.iter().enumerate().map(|(j, f)| f.start(j, [15.0, 52.0]).unwrap()).collect();
                std::fs::write("/tmp/kernel", format!("{k}")).unwrap();
                all.push((format!("one {k}"), one_shot::one_shot(&arm, starts, &points, &id, OURS).unwrap()));
            }
            for (n, e) in &all {
                let t: Vec<_> = val.iter().map(|l| e.fair_rmse(l, &settings).unwrap()).collect();
                let m: Vec<f64> = (0..6).map(|j| validation::median(t.iter().map(|r| r[j]).collect())).collect();
                let b = e.base(&arm); let tr = arm.base_values(&arm.standard);
                println!("VAR {ripple} {n} {m:.3?} base {:.4}", (b.iter().zip(&tr).map(|(a, b)| (a - b).powi(2)).sum::<f64>() / 40.0).sqrt());
            }
        }
    }
    #[test]
    fn designs() {
        let settings = settings::Settings::read().unwrap();
        let arm = robot::Indy7::new(&settings).unwrap();
        let run = RunSettings { quick: true, seed: 1 };
        let friction = friction::experiment(&arm, &settings, &run, 1).unwrap();
        let points: Vec<_> = friction.iter().enumerate().flat_map(|(j, f)| f.rows(j)).collect();
        let val: Vec<_> = settings.trajectories.validation.iter().map(|v| validation::log(&arm, &settings, v, 20.5, 44).unwrap()).collect();
        for seed in 1..9u64 {
            let rows = excitation::designed(&arm, &settings, &RunSettings { quick: true, seed }).unwrap().unwrap();
            let id = validation::log(&arm, &settings, &rows.rows, 31.0, seed).unwrap();
            let two = regression(&arm, validation::known(&friction, &settings, None).unwrap(), &id, &settings, OURS).unwrap();
            let mut all = vec![("two".to_owned(), two)];
            for k in [0.0, 10.0] {
                let starts: Vec<_> = friction.iter().enumerate().map(|(j, f)| f.start(j, [15.0, 52.0]).unwrap()).collect();
                std::fs::write("/tmp/kernel", format!("{k}")).unwrap();
                all.push((format!("one {k}"), one_shot::one_shot(&arm, starts, &points, &id, OURS).unwrap()));
            }
            for (n, e) in &all {
                let t: Vec<_> = val.iter().map(|l| e.fair_rmse(l, &settings).unwrap()).collect();
                let m: Vec<f64> = (0..6).map(|j| validation::median(t.iter().map(|r| r[j]).collect())).collect();
                println!("DES {seed} {:.2} {n} {m:.3?}", rows.condition);
            }
        }
    }
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
            println!("STEP {:?} {:.4} {:.4}", f.bristles, f.bristles[0].0 / settings.friction[j].sigma0, f.bristles[1].0 / settings.friction[j].sigma1);
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
