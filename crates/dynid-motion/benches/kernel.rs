//! Kernel over 100 000 samples of 200 columns, against one pass that only sums the same samples.

use divan::{Bencher, black_box};
use dynid_motion::Kernel;

const SAMPLES: usize = 100_000;
const COLUMNS: usize = 200;
const RATE_HZ: f64 = 1000.0;

fn main() {
    divan::main();
}

fn columns() -> Vec<f64> {
    (0..SAMPLES * COLUMNS).map(|n| (n % 8191) as f64 * 1e-3).collect()
}

#[divan::bench(sample_count = 10)]
fn sum_of_all_samples(bencher: Bencher) {
    let columns = columns();
    bencher.bench_local(|| {
        let mut sums = [0.0; 8];
        for lanes in black_box(&columns).as_chunks::<8>().0 {
            for (sum, x) in sums.iter_mut().zip(lanes) {
                *sum += x;
            }
        }
        sums
    });
}

#[divan::bench(args = [80.0, 20.0, 5.0], sample_count = 10)]
fn apply_columns(bencher: Bencher, cutoff_hz: f64) {
    let columns = columns();
    let kernel = Kernel::new(cutoff_hz, RATE_HZ).expect("valid cut-off");
    let centres = kernel.centres(SAMPLES);
    let mut out = vec![0.0; COLUMNS * centres.len()];
    bencher.bench_local(|| {
        kernel.apply_columns(black_box(&columns), SAMPLES, COLUMNS, 0, &centres, &mut out);
    });
}
