//! Block length from residuals, and the HAC covariance from rows of an estimate.

use crate::simulated::{ACTING, COLUMNS, NOISE, Normal, TRUTH, regressor, rows};
use dynid_estimate::covariance::{
    BlockLengthSettings, BlockLengthStatus, ResidualSignal, block_length, hac_bartlett,
};
use dynid_estimate::linear::{LinearMethod, LinearSettings, VarianceSharing, estimate, row_scores};
use dynid_factor::Factor;
use dynid_factor::rows::{GroupShape, MemoryRows, Rows, reduce_rows};
use dynid_linalg::Mat;

fn coloured(seed: u64, pole: f64, samples: usize) -> Vec<f64> {
    let mut normal = Normal::new(seed, 0);
    let mut state = 0.0;
    let draw = |_| {
        state = pole * state + (1.0 - pole * pole).sqrt() * normal.draw();
        state
    };
    (0..samples).map(draw).collect()
}

fn signal(residual: &[f64], log: usize) -> ResidualSignal<'_> {
    ResidualSignal { log, rate_hz: 100.0, residual }
}

#[test]
fn blocks_are_five_correlation_times_of_the_worst_joint() {
    // exp(-t/0.2 s): below a tenth after 0.46 s.
    let slow = coloured(1, (-0.05_f64).exp(), 20_000);
    let white = coloured(2, 0.0, 20_000);
    let found = block_length(&[signal(&white, 0), signal(&slow, 0)], &BlockLengthSettings::default());
    assert_eq!((found.worst, found.correlation_s[0]), (Some(1), Some(0.01)));
    assert!((found.seconds / 2.3 - 1.0).abs() < 0.2, "{found:?}");
    assert_eq!(found.blocks, (200.0 / found.seconds) as usize);
    assert_eq!(found.status, BlockLengthStatus::Enough);
    // Stretches that do not count do not shorten it.
    let mut holes = slow.clone();
    holes.chunks_mut(130).for_each(|c| c.iter_mut().take(50).for_each(|v| *v = 0.0));
    let with_holes = block_length(&[signal(&holes, 0)], &BlockLengthSettings::default());
    assert!((with_holes.seconds / found.seconds - 1.0).abs() < 0.25, "{with_holes:?}");

    let quick = block_length(&[signal(&white, 0)], &BlockLengthSettings::default());
    assert_eq!((quick.seconds, quick.blocks), (1.0, 200));
}

#[test]
fn short_logs_are_said_to_be_too_short() {
    // exp(-t/0.5 s) over 15 s: some six seconds a block.
    let slow = coloured(3, (-0.02_f64).exp(), 1_500);
    let found = block_length(&[signal(&slow, 0)], &BlockLengthSettings::default());
    let BlockLengthStatus::TooShort { expected_s } = found.status else { panic!("{found:?}") };
    assert!((expected_s - 10.0 * found.seconds).abs() < 1e-12 && expected_s > 15.0);
    let white = coloured(4, 0.0, 700);
    let both = block_length(&[signal(&white, 0), signal(&white, 1)], &BlockLengthSettings::default());
    assert_eq!((both.blocks, both.status), (14, BlockLengthStatus::Few));
    let none = block_length(&[signal(&[0.0; 3_000], 0)], &BlockLengthSettings::default());
    assert_eq!((none.worst, none.seconds, none.blocks), (None, 1.0, 30));
}

/// One log without gaps: the scores are the textbook's, joint by joint.
#[test]
fn scores_of_rows_give_the_textbook_hac() {
    let mut normal = Normal::new(5, 0);
    let mut state = [0.0; 2];
    let mut errors = vec![[0.0; 2]; 600];
    let source = rows(1, 15, 40, |joint, k| {
        state[joint] = 0.6 * state[joint] + normal.draw();
        errors[k][joint] = NOISE[joint] * state[joint];
        errors[k][joint]
    });
    let groups = reduce_rows(&source).unwrap();
    let found = estimate(&groups, None, COLUMNS, &LinearMethod::Wls, &LinearSettings::default()).unwrap();
    let scores = row_scores(&source, &found).unwrap();
    assert_eq!((scores.step.as_slice(), scores.logs[0].nrows()), (&[1][..], 600));
    let expected = Mat::from_fn(600, COLUMNS, |k, column| {
        (0..2)
            .map(|joint| {
                let w = |c: usize| regressor(0, joint, c, k);
                let own = ACTING[joint].iter().enumerate();
                let residual: f64 =
                    own.map(|(c, &p)| w(c) * (TRUTH[p] - found.x[p])).sum::<f64>() + errors[k][joint];
                let entry = ACTING[joint].iter().position(|&p| p == column).map_or(0.0, w);
                entry * residual / found.groups[joint].variance
            })
            .sum()
    });
    let difference = (&expected - &scores.logs[0]).norm_l2();
    assert!(difference < 1e-9 * expected.norm_l2(), "{difference}");
    // 100 Hz and a cut-off of 20 Hz: ten steps.
    let hac = scores.covariance(&found, &[100.0], 20.0).unwrap();
    let direct = hac_bartlett(&expected, &found.solution.unit_covariance(), 10).unwrap();
    assert!((&hac - &direct).norm_l2() < 1e-9 * direct.norm_l2());
    let jackknife = found.jackknife().unwrap().covariance;
    for i in 0..COLUMNS {
        assert!((0.3..2.0).contains(&(hac[(i, i)] / jackknife[(i, i)])));
    }
    // Scores of the whole log sum to zero at the estimate, whatever the loss.
    for method in [LinearMethod::Wls, LinearMethod::Huber, LinearMethod::Tukey] {
        let found = estimate(&groups, Some(&source), COLUMNS, &method, &LinearSettings::default()).unwrap();
        let scores = row_scores(&source, &found).unwrap();
        let total = |c: usize| scores.logs[0].col(c).iter().sum::<f64>();
        let size = |c: usize| scores.logs[0].col(c).iter().map(|v| v.abs()).sum::<f64>();
        assert!((0..COLUMNS).all(|c| total(c).abs() < 2e-4 * size(c)), "{method:?}");
    }
}

/// Two kernels over one joint: the narrow one's rows lie twice as close and fall into the steps of the wide one.
#[test]
fn rows_of_narrow_kernels_are_summed_within_steps() {
    let mut source = MemoryRows::new();
    let shape = |scale| GroupShape { log: 3, output: 0, scale, columns: vec![0], blocks: 1 };
    for (scale, samples) in [(0, vec![100, 108, 116, 140]), (1, vec![120, 124, 128, 132])] {
        let group = source.add_group(shape(scale));
        let ones = vec![1.0; 4];
        let effort: Vec<f64> = samples.iter().map(|k| *k as f64 % 7.0).collect();
        source
            .push(group, &Rows { block: 0, samples: &samples, regressor: &ones, stride: 4, effort: &effort });
    }
    let groups = reduce_rows(&source).unwrap();
    let settings = LinearSettings { sharing: VarianceSharing::Joint, ..LinearSettings::default() };
    let found = estimate(&groups, None, 1, &LinearMethod::Wls, &settings).unwrap();
    let scores = row_scores(&source, &found).unwrap();
    assert_eq!((scores.step.as_slice(), scores.logs[0].nrows()), (&[8][..], 6));
    let residual = |k: usize| (k as f64 % 7.0 - found.x[0]) / found.groups[0].variance;
    for (step, samples) in
        [(0, vec![100]), (2, vec![116, 120]), (3, vec![124, 128]), (4, vec![132]), (5, vec![140])]
    {
        let expected: f64 = samples.into_iter().map(residual).sum();
        assert!((scores.logs[0][(step, 0)] - expected).abs() < 1e-12);
    }
    assert_eq!(Factor::merge(&found.blocks.iter().collect::<Vec<_>>()).rows(), 8);
}
