//! Nothing is allocated after construction, in any mode. A test program of its own: its allocator counts.
#![expect(clippy::unwrap_used, reason = "in tests a panic is the report")]
#![allow(dead_code, reason = "modes and streams are shared with the other tests")]

#[path = "online/modes.rs"]
mod modes;
#[path = "online/stream.rs"]
mod stream;

use dynid_online::{Estimator, RowNoise};
use stream::Stream;

#[test]
fn no_mode_allocates_after_construction() {
    for (name, settings) in modes::all_modes(4, 2) {
        let mut estimator = Estimator::new(settings).unwrap();
        let mut stream = Stream::new(1, &[1.0, 2.0, -1.0, 0.5], 2, 0.3);
        let samples: Vec<_> = (0..600)
            .map(|k| {
                stream.truth[1] = if k < 300 { 2.0 } else { 6.0 };
                stream.sample()
            })
            .collect();
        let (mut std, mut covariance) = ([0.0; 4], [0.0; 16]);
        let mut reactions = 0;
        let counted = allocation_counter::measure(|| {
            for (phi, effort) in &samples {
                let noise = RowNoise::Covariance(&[0.09, 0.01, 0.01, 0.09]);
                let step = estimator.step(phi, effort, noise).unwrap();
                reactions += usize::from(step.reaction.is_some());
                estimator.std(&mut std);
                estimator.covariance(&mut covariance);
                assert!(estimator.step(phi, &[f64::NAN, 0.0], noise).is_err());
            }
            let _ = estimator.open(1, 1.0);
            let _ = estimator.reset();
        });
        assert_eq!(counted.count_total, 0, "{name}: {counted:?}");
        assert!(estimator.settings().reaction.is_none() || reactions > 0, "{name}: reactions are part of it");
    }
    let counted = allocation_counter::measure(|| drop(std::hint::black_box(vec![0.0_f64; 10])));
    assert_eq!(counted.count_total, 1, "the counter counts");
}
