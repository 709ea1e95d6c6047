//! Rows formed from a log on every pass: the factors of the reduction, in memory or not, and robust fits through them.
#![expect(clippy::unwrap_used, reason = "in tests a panic is the report")]

use crate::arm::{self, Arm, JOINTS, RATE_HZ, model, motion};
use dynid_estimate::instruments::measured;
use dynid_estimate::linear::{IrlsSettings, LinearMethod, LinearSettings, estimate};
use dynid_factor::rows::{MemoryRows, RowSource, reduce_rows};
use dynid_model::{BaseParameters, BaseSettings, EffortModel, RegressorBlock, RobotModel};
use dynid_motion::{JointSignals, Log};
use dynid_rows::conditioning::{
    Conditioning, ConditioningSettings, LogRows, PreparedLog, ReducedGroup, TextbookRoute, condition,
    paired_textbook_rows, prepare, reduce, reduce_textbook, textbook_rows,
};

struct Case {
    model: RobotModel,
    base: BaseParameters,
    truth: Vec<f64>,
    logs: Vec<PreparedLog>,
    choices: Conditioning,
}

fn settings() -> ConditioningSettings {
    // Spikes stay in: they are what the robust losses are for.
    ConditioningSettings { remove_spikes: false, delay_samples: Some(0.0), ..ConditioningSettings::default() }
}

/// Logs of 20 s; of every joint's effort `share` of the time is off by a hundred times its noise, in stretches.
fn case(logs: usize, share: f64) -> Case {
    let model = model();
    let base = BaseParameters::of(&model, model.mechanism(), &[], &BaseSettings::default());
    let samples = (20.0 * RATE_HZ) as usize;
    let truth = Arm::new(1.0).truth;
    let mut linear = vec![0.0; model.layout().parameters()];
    base.kept.iter().zip(&truth).for_each(|(c, x)| linear[*c] = *x);
    let prepared = (0..logs)
        .map(|log| {
            let (q, dq, ddq) = motion(samples, log as u64);
            let mut block = RegressorBlock::new(model.layout().clone(), samples);
            let moving = dynid_model::MotionBlock::plain(samples, &q, &dq, &ddq);
            model.regressor(&moving, &[], &mut block);
            let joints = (0..JOINTS)
                .map(|joint| {
                    let noise = arm::noise(joint, samples, 7 + log as u64, 0.0);
                    let effort = (0..samples).zip(block.effort(joint, &linear)).map(|(k, e)| {
                        let stretch = (k + 977 * joint) % 1500 < (1500.0 * share) as usize;
                        e + 0.1 * noise[k] + if stretch { 10.0 * arm::NOISE[joint] } else { 0.0 }
                    });
                    JointSignals {
                        name: format!("j{}", joint + 1),
                        position: q[joint * samples..(joint + 1) * samples].to_vec(),
                        velocity: None,
                        effort: effort.collect(),
                    }
                })
                .collect();
            let time = (0..samples).map(|k| k as f64 / RATE_HZ).collect();
            let log = Log::new(format!("log {log}"), time, joints, vec![]).unwrap();
            prepare(&log, &model, &settings()).unwrap()
        })
        .collect::<Vec<_>>();
    let choices = condition(&model, &[], &base.kept, &prepared, &settings(), &mut |_| {}).unwrap();
    Case { model, base, truth, logs: prepared, choices }
}

#[test]
fn factors_are_those_of_the_reduction_whatever_the_source() {
    let Case { model, base, logs, choices, .. } = case(2, 0.0);
    let groups = reduce(&model, &[], &base.kept, &logs, &choices, &settings()).unwrap();
    let rows = LogRows::new(&model, &[], &base.kept, &logs, &choices, &settings()).unwrap();
    assert_eq!(reduce_rows(&rows).unwrap(), groups);
    let start = std::time::Instant::now();
    assert_eq!(reduce_rows(&rows).unwrap(), groups, "every pass alike");
    let anew = start.elapsed();
    let memory = MemoryRows::collect(&rows, 256 << 20).unwrap().unwrap();
    let start = std::time::Instant::now();
    assert_eq!(reduce_rows(&memory).unwrap(), groups);
    println!("a pass over 40 s: {anew:.1?} anew, {:.1?} from memory", start.elapsed());
    assert!(MemoryRows::collect(&rows, 10_000).unwrap().is_none());

    let route = TextbookRoute::default();
    let thinned = textbook_rows(&model, &[], &base.kept, &logs, &route, &settings()).unwrap();
    let reference = reduce_textbook(&model, &[], &base.kept, &logs, &route, &settings()).unwrap();
    assert_eq!(reduce_rows(&thinned).unwrap(), reference);
    assert_eq!(thinned.groups().len(), 2 * JOINTS);
}

#[test]
fn stretches_of_wrong_efforts_are_survived() {
    let Case { model, base, truth, logs, choices } = case(1, 0.08);
    let rows = LogRows::new(&model, &[], &base.kept, &logs, &choices, &settings()).unwrap();
    let groups = reduce_rows(&rows).unwrap();
    let find = |method, memory| {
        let irls = IrlsSettings { memory, ..IrlsSettings::default() };
        let settings = LinearSettings { irls, ..LinearSettings::default() };
        estimate(&groups, Some(&rows), base.len(), &method, &settings).unwrap()
    };
    let plain = find(LinearMethod::Wls, 0);
    let start = std::time::Instant::now();
    let tukey = find(LinearMethod::Tukey, 256 << 20);
    println!("Tukey in {} passes: {:.2?} in memory", tukey.passes, start.elapsed());
    let error = |x: &[f64]| x.iter().zip(&truth).map(|(x, t)| (x - t).powi(2)).sum::<f64>().sqrt();
    println!("error of all parameters: {:.3} by WLS, {:.3} by Tukey", error(&plain.x), error(&tukey.x));
    assert!(tukey.converged && 5.0 * error(&tukey.x) < error(&plain.x));
    assert_eq!(find(LinearMethod::Tukey, 0), tukey, "rows formed anew on every pass");
}

/// Both halves of paired groups: instruments with the effort, measured rows with the effort.
fn halves(paired: &[ReducedGroup]) -> [Vec<ReducedGroup>; 2] {
    let instruments = paired.iter().map(|group| {
        let own: Vec<usize> = (0..group.columns.len() / 2).collect();
        let blocks = group.blocks.iter().map(|b| b.select(&own)).collect();
        ReducedGroup { columns: group.columns[..own.len()].to_vec(), blocks, ..*group }
    });
    [instruments.collect(), measured(paired)]
}

#[track_caller]
fn assert_same(found: &[ReducedGroup], expected: &[ReducedGroup]) {
    assert_eq!(found.len(), expected.len());
    for (f, e) in found.iter().zip(expected) {
        assert_eq!((f.log, f.output, f.scale, &f.columns), (e.log, e.output, e.scale, &e.columns));
        assert_eq!(f.blocks.len(), e.blocks.len());
        for (f, e) in f.blocks.iter().zip(&e.blocks) {
            assert_eq!(f.rows(), e.rows());
            let (size, x) = (e.effort_norm().max(1e-300), vec![0.1; e.columns()]);
            for (f, e) in f.score(&x).iter().zip(e.score(&x)) {
                assert!((f - e).abs() <= 1e-9 * size * size, "{f} against {e}");
            }
            assert!((f.rss(&x) - e.rss(&x)).abs() <= 1e-9 * size * size);
        }
    }
}

#[test]
fn instruments_pass_through_kernels_centres_and_masks_of_the_measured_rows() {
    let Case { model, base, logs, mut choices, .. } = case(2, 0.0);
    let own: Vec<Vec<Vec<f64>>> = logs.iter().map(|l| l.position.clone()).collect();
    let paired = |choices: &Conditioning, motions: &[Vec<Vec<f64>>]| {
        let rows = LogRows::new(&model, &[], &base.kept, &logs, choices, &settings()).unwrap();
        reduce_rows(&rows.with_instruments(motions, &settings()).unwrap()).unwrap()
    };
    let plain = reduce(&model, &[], &base.kept, &logs, &choices, &settings()).unwrap();
    let [z, w] = halves(&paired(&choices, &own));
    assert_same(&z, &plain);
    assert_same(&w, &plain);

    // Masks are those of the measured motion, so without any the other log's own rows come out.
    choices.rung = vec![0; JOINTS];
    let swapped: Vec<Vec<Vec<f64>>> = own.iter().rev().cloned().collect();
    let exchanged: Vec<PreparedLog> = logs
        .iter()
        .zip(&swapped)
        .map(|(log, position)| PreparedLog { position: position.clone(), ..log.clone() })
        .collect();
    let plain = reduce(&model, &[], &base.kept, &logs, &choices, &settings()).unwrap();
    let other = reduce(&model, &[], &base.kept, &exchanged, &choices, &settings()).unwrap();
    let [z, w] = halves(&paired(&choices, &swapped));
    assert_same(&w, &plain);
    assert_same(&z, &other);

    let route = TextbookRoute { parallel_filter: true, ..TextbookRoute::default() };
    let rows = paired_textbook_rows(&model, &[], &base.kept, &logs, &route, &swapped, &settings()).unwrap();
    let [z, w] = halves(&reduce_rows(&rows).unwrap());
    let thinned = |logs| reduce_textbook(&model, &[], &base.kept, logs, &route, &settings()).unwrap();
    assert_same(&w, &thinned(&logs));
    assert_same(&z, &thinned(&exchanged));
}
