//! Rows of a stream against rows of the same motion as a log.

#![expect(clippy::unwrap_used, reason = "helpers of tests outside of test functions")]

use std::sync::Arc;

use crate::arm::{JOINTS, RATE_HZ, model, motion};
use dynid_factor::Factor;
use dynid_factor::FactorBuilder;
use dynid_model::{BaseParameters, BaseSettings, EffortModel, MotionBlock, RegressorBlock};
use dynid_motion::live::LiveSettings;
use dynid_rows::conditioning::{LiveRow, LiveRowSettings, LiveRows};
use dynid_words::Transfer;

struct Stream {
    rows: LiveRows,
    samples: Vec<Vec<f64>>,
    truth: Vec<f64>,
}

/// A stream of `seconds`; efforts without noise, later than the motion by `-delay` samples.
fn stream(seconds: f64, least_speed: f64) -> Stream {
    let model = Arc::new(model());
    let base = BaseParameters::of(&*model, model.mechanism(), &[], &BaseSettings::default());
    let samples = (seconds * RATE_HZ) as usize;
    let truth: Vec<f64> = (0..base.len()).map(|k| 1.0 + 0.3 * (k as f64 * 1.7).sin()).collect();
    let mut linear = vec![0.0; model.layout().parameters()];
    base.kept.iter().zip(&truth).for_each(|(c, x)| linear[*c] = *x);
    let (q, dq, ddq) = motion(samples, 3);
    let mut block = RegressorBlock::new(model.layout().clone(), samples);
    model.regressor(&MotionBlock::plain(samples, &q, &dq, &ddq), &[], &mut block);
    let efforts: Vec<Vec<f64>> = (0..JOINTS).map(|j| block.effort(j, &linear)).collect();
    let values = (0..samples)
        .map(|s| {
            let positions = (0..JOINTS).map(|j| q[j * samples + s]);
            positions.chain(efforts.iter().map(|e| e[s])).collect()
        })
        .collect();
    let settings = LiveRowSettings {
        states: LiveSettings { rate_hz: RATE_HZ, state_hz: 40.0, delay_samples: 0.0 },
        kernel_hz: 8.0,
        least_speed: vec![vec![least_speed]; JOINTS],
    };
    let rows = LiveRows::new(model, &[], &base.kept, &settings).unwrap();
    Stream { rows, samples: values, truth }
}

fn all(stream: &mut Stream, pieces: &[usize]) -> Vec<LiveRow> {
    let mut out = Vec::new();
    let mut at = 0;
    for piece in pieces.iter().cycle() {
        for _ in 0..*piece {
            let Some(values) = stream.samples.get(at) else { break };
            stream.rows.push(at as f64 / RATE_HZ, values, at == 0, |row| out.push(row.clone()));
            at += 1;
        }
        stream.rows.drain(|row| out.push(row.clone()));
        if at == stream.samples.len() {
            return out;
        }
    }
    out
}

/// `R x = z` from below.
fn least_squares(factor: &Factor) -> Vec<f64> {
    let z = factor.z();
    let mut x = z.clone();
    for row in (0..x.len()).rev() {
        let known: f64 = (row + 1..x.len()).map(|c| factor.r(row, c) * x[c]).sum();
        x[row] = (z[row] - known) / factor.r(row, row);
    }
    x
}

#[test]
fn truth_comes_out_of_the_rows() {
    let mut stream = stream(20.0, 0.05);
    let rows = all(&mut stream, &[100]);
    let p = stream.truth.len();
    let mut builder = FactorBuilder::new(p);
    let mut used = 0;
    for row in &rows {
        for output in 0..JOINTS {
            if row.usable[output] {
                builder.push_row(&row.columns[output], row.effort[output]).unwrap();
                used += 1;
            }
        }
    }
    assert!(used > 4 * p && used < rows.len() * JOINTS, "{used} of {}", rows.len() * JOINTS);
    let solution = least_squares(&builder.finish());
    for (x, t) in solution.iter().zip(&stream.truth) {
        // What the state filter takes of the motion is all that is left.
        assert!((x - t).abs() < 2e-3 * (1.0 + t.abs()), "{x} {t}");
    }
}

#[test]
fn handing_over_in_pieces_changes_no_bit() {
    let whole = all(&mut stream(6.0, 0.02), &[10_000]);
    assert!(whole.len() > 100);
    for pieces in [&[1][..], &[3, 64, 1, 17]] {
        let rows = all(&mut stream(6.0, 0.02), pieces);
        assert_eq!(rows.len(), whole.len());
        for (row, same) in rows.iter().zip(&whole) {
            // The whole rows would fill the screen.
            assert!(row == same, "pieces {pieces:?}: rows at {} and {} differ", row.time, same.time);
        }
    }
}

#[test]
fn a_checkpoint_goes_on_with_the_same_bits() {
    let whole = all(&mut stream(6.0, 0.02), &[1]);
    let mut first = stream(6.0, 0.02);
    let mut out = Vec::new();
    let cut = 1234;
    for (at, values) in first.samples[..cut].iter().enumerate() {
        first.rows.push(at as f64 / RATE_HZ, values, at == 0, |row| out.push(row.clone()));
        first.rows.drain(|row| out.push(row.clone()));
    }
    let mut words = Vec::new();
    first.rows.transfer(&mut Transfer::Save(&mut words));
    let mut second = stream(6.0, 0.02);
    let mut load = Transfer::load(&words);
    second.rows.transfer(&mut load);
    assert!(load.complete());
    for (at, values) in second.samples.iter().enumerate().skip(cut) {
        second.rows.push(at as f64 / RATE_HZ, values, false, |row| out.push(row.clone()));
        second.rows.drain(|row| out.push(row.clone()));
    }
    assert!(out == whole);
    let mut damaged = Transfer::load(&words[3..]);
    second.rows.transfer(&mut damaged);
    assert!(!damaged.complete());
}

#[test]
fn a_gap_leaves_no_row_over_it() {
    let mut broken = stream(6.0, -1.0);
    let mut times = Vec::new();
    for (at, values) in broken.samples.iter().enumerate() {
        let late = if at >= 1500 { 2.0 } else { 0.0 };
        broken
            .rows
            .push(at as f64 / RATE_HZ + late, values, at == 0 || at == 1500, |row| times.push(row.time));
    }
    broken.rows.drain(|row| times.push(row.time));
    let (edge, half) = (1500.0 / RATE_HZ, 0.93 / 8.0);
    assert!(times.iter().all(|t| *t < edge - half || *t > edge + 2.0 + half), "{times:?}");
    assert!(times.windows(2).all(|w| w[1] > w[0]));
}
