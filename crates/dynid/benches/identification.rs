//! Time and memory of an identification after parsing: base parameters, regressor, reduction per joint, weighted least
//! squares, covariance; 6 joints, 84 columns. Samples are made block by block, so memory is what the identification needs.
//!
//! Baseline in the same run: the dense way, one stacked matrix of all kept columns and one QR of it (at 100 000 samples).
//! Run with `cargo bench -p dynid --bench identification`.

#![expect(clippy::print_stdout, reason = "a benchmark prints its table")]
#![expect(clippy::unwrap_used, reason = "a benchmark may stop")]

use std::path::PathBuf;
use std::time::Instant;

use dynid::elements::{DEFAULTS, ElementPlan};
use dynid::estimators::linear::{WlsSettings, ols, wls};
use dynid::estimators::{Factor, FactorBuilder};
use dynid::model::{BaseParameters, BaseSettings, EffortModel, MotionBlock, RegressorBlock, RobotModel};
use dynid::motion::trajectory::Fourier;
use rayon::prelude::*;

const BLOCK: usize = 2048;

fn main() {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../robots/indy7.toml");
    let mechanism = dynid::Robot::load(&path, &dynid::RobotOptions::default()).unwrap().mechanism;
    let defaults = DEFAULTS.map(str::to_owned);
    let plan =
        ElementPlan::new(&mechanism, &dynid::io::ElementSpec::default(), Some(&defaults), |_| true).unwrap();
    let elements = plan.build(&mechanism).unwrap();
    let model = RobotModel::new(mechanism, elements);
    assert_eq!(model.layout().parameters(), 84);
    println!("samples    base ms  regressor + reduction ms  wls ms  covariance ms  total ms  peak memory MB");
    for samples in [100_000, 1_000_000] {
        let mut best: Option<[f64; 5]> = None;
        for _ in 0..3 {
            let run = identify(&model, samples);
            if best.is_none_or(|b| run[4] < b[4]) {
                best = Some(run);
            }
        }
        let [base, reduce, fit, covariance, total] = best.unwrap();
        println!(
            "{samples:8} {base:9.1} {reduce:25.1} {fit:7.1} {covariance:14.1} {total:9.1} {:15.0}",
            peak_memory_mb()
        );
    }
    let start = Instant::now();
    let factor = dense(&model, 100_000);
    println!("dense stacked matrix, 100000 samples: {:.0} ms, {:.0} MB", ms(start), peak_memory_mb());
    assert!(ols(&factor).rank.is_full());
}

fn ms(start: Instant) -> f64 {
    1e3 * start.elapsed().as_secs_f64()
}

/// High-water mark of resident memory; 0 where the system does not tell.
fn peak_memory_mb() -> f64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find(|l| l.starts_with("VmHWM")).unwrap_or_default();
    line.split_whitespace().nth(1).and_then(|x| x.parse::<f64>().ok()).unwrap_or(0.0) / 1024.0
}

fn trajectories() -> Vec<Fourier> {
    (0..6)
        .map(|j| {
            let a = (1..=5).map(|k| 0.3 / f64::from(k) * f64::from(j + k).sin()).collect();
            let b = (1..=5).map(|k| 0.3 / f64::from(k) * f64::from(2 * j + k).cos()).collect();
            Fourier::plain(0.6 + 0.01 * f64::from(j), 0.1 * f64::from(j), a, b).unwrap()
        })
        .collect()
}

/// Calls `work` with blocks of motion and the efforts of known parameters.
fn blocks(model: &RobotModel, samples: usize, mut work: impl FnMut(&RegressorBlock, &[Vec<f64>])) {
    let trajectories = trajectories();
    let truth: Vec<f64> = (0..84).map(|k| 1.0 + 0.1 * f64::from(k % 7)).collect();
    let mut block = RegressorBlock::new(model.layout().clone(), BLOCK);
    let mut signals = [vec![0.0; 6 * BLOCK], vec![0.0; 6 * BLOCK], vec![0.0; 6 * BLOCK]];
    // One block of motion serves for all: making it is not part of an identification.
    for (j, t) in trajectories.iter().enumerate() {
        for s in 0..BLOCK {
            let p = t.at(s as f64 * 0.05);
            signals[0][j * BLOCK + s] = p.position;
            signals[1][j * BLOCK + s] = p.velocity;
            signals[2][j * BLOCK + s] = p.acceleration;
        }
    }
    let mut efforts: Option<Vec<Vec<f64>>> = None;
    for start in (0..samples).step_by(BLOCK) {
        let n = BLOCK.min(samples - start);
        let motion = MotionBlock {
            samples: n,
            stride: BLOCK,
            q: &signals[0],
            dq: &signals[1],
            ddq: &signals[2],
            gravity: None,
            channels: &[],
            sign_width: 0.0,
        };
        model.regressor(&motion, &[], &mut block);
        let efforts = efforts.get_or_insert_with(|| {
            (0..6)
                .map(|j| {
                    let noise = |s: usize| 0.1 * ((s * 7919 + j * 104_729) as f64 * 0.618).sin();
                    block.effort(j, &truth).iter().enumerate().map(|(s, e)| e + noise(s)).collect()
                })
                .collect()
        });
        work(&block, efforts);
    }
}

fn identify(model: &RobotModel, samples: usize) -> [f64; 5] {
    let all = Instant::now();
    let base = BaseParameters::of(model, model.mechanism(), &[], &BaseSettings::default());
    let base_ms = ms(all);
    let start = Instant::now();
    let kept: Vec<(Vec<usize>, Vec<usize>)> = (0..6)
        .map(|output| {
            let columns = model.layout().columns(output).iter().enumerate();
            columns.filter_map(|(k, c)| base.kept.binary_search(c).ok().map(|g| (k, g))).unzip()
        })
        .collect();
    let mut builders: Vec<FactorBuilder> = kept.iter().map(|(l, _)| FactorBuilder::new(l.len())).collect();
    blocks(model, samples, |block, efforts| {
        builders.par_iter_mut().enumerate().for_each(|(output, builder)| {
            let local = &kept[output].0;
            builder
                .push_with(block.samples(), |column, range, out| {
                    let source = local.get(column).map_or(&efforts[output][..], |k| block.column(output, *k));
                    out.copy_from_slice(&source[range]);
                })
                .unwrap();
        });
    });
    let factors: Vec<Factor> =
        builders.into_iter().zip(&kept).map(|(b, (_, g))| b.finish().embed(base.len(), g)).collect();
    let reduce_ms = ms(start);
    let start = Instant::now();
    let fit = wls(&factors, &WlsSettings::default());
    let fit_ms = ms(start);
    let start = Instant::now();
    let covariance = fit.solution.unit_covariance();
    assert!(covariance[(0, 0)] > 0.0 && fit.solution.rank.is_full());
    let covariance_ms = ms(start);
    [base_ms, reduce_ms, fit_ms, covariance_ms, ms(all)]
}

fn dense(model: &RobotModel, samples: usize) -> Factor {
    let base = BaseParameters::of(model, model.mechanism(), &[], &BaseSettings::default());
    let rows = 6 * samples;
    let mut stacked = vec![0.0; (base.len() + 1) * rows];
    let mut start = 0;
    blocks(model, samples, |block, efforts| {
        let n = block.samples();
        for (output, effort) in efforts.iter().enumerate() {
            let first = output * samples + start;
            for (k, column) in model.layout().columns(output).iter().enumerate() {
                if let Ok(g) = base.kept.binary_search(column) {
                    stacked[g * rows + first..][..n].copy_from_slice(block.column(output, k));
                }
            }
            stacked[base.len() * rows + first..][..n].copy_from_slice(&effort[..n]);
        }
        start += n;
    });
    let (regressor, effort) = stacked.split_at(base.len() * rows);
    // One chunk as tall as the matrix: a dense QR.
    let mut builder = FactorBuilder::with_chunk_rows(base.len(), rows);
    builder.push_block(regressor, rows, effort).unwrap();
    builder.finish()
}
