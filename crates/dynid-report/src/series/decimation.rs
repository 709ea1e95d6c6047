//! Thinning a series for drawing without losing its peaks.

use std::ops::Range;

/// How the samples of one log are thinned; the same for all its series, so that they share one time axis.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Decimation {
    samples: usize,
    buckets: Option<usize>,
}

impl Decimation {
    /// Keeps all of `samples` if they are at most `points`, else two of each of `points / 2` buckets.
    pub(crate) fn new(samples: usize, points: usize) -> Self {
        Self { samples, buckets: (samples > points.max(2)).then_some(points.max(2) / 2) }
    }

    /// Samples that stand behind one pair of drawn points, rounded up; `None` if every sample is drawn.
    pub(crate) fn samples_per_bucket(self) -> Option<usize> {
        self.buckets.map(|buckets| self.samples.div_ceil(buckets))
    }

    fn ranges(self, buckets: usize) -> impl Iterator<Item = Range<usize>> {
        (0..buckets).map(move |k| k * self.samples / buckets..(k + 1) * self.samples / buckets)
    }

    /// Time of each drawn point: of each sample, or of the first and the middle sample of each bucket.
    pub(crate) fn times(self, time_s: &[f64]) -> Vec<f64> {
        let Some(buckets) = self.buckets else { return time_s.to_vec() };
        self.ranges(buckets)
            .flat_map(|range| [time_s[range.start], time_s[range.start + range.len() / 2]])
            .collect()
    }

    /// Value of each drawn point: each sample, or the least and the greatest of each bucket in the order in which
    /// they occur. Samples that are not finite are passed over; a bucket without any other gives two NaN, a gap.
    pub(crate) fn values(self, samples: &[f64]) -> Vec<f64> {
        let Some(buckets) = self.buckets else { return samples.to_vec() };
        self.ranges(buckets).flat_map(|range| extremes(&samples[range])).collect()
    }
}

fn extremes(bucket: &[f64]) -> [f64; 2] {
    let mut found: Option<(usize, usize)> = None;
    for (i, &value) in bucket.iter().enumerate().filter(|(_, value)| value.is_finite()) {
        let (least, greatest) = found.unwrap_or((i, i));
        found = Some((
            if value < bucket[least] { i } else { least },
            if value > bucket[greatest] { i } else { greatest },
        ));
    }
    found
        .map_or([f64::NAN; 2], |(least, greatest)| [bucket[least.min(greatest)], bucket[least.max(greatest)]])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn short_series_stay_whole() {
        let decimation = Decimation::new(3, 4);
        assert_eq!(decimation.samples_per_bucket(), None);
        assert_eq!(decimation.values(&[1.0, 3.0, 2.0]), [1.0, 3.0, 2.0]);
    }

    #[test]
    fn each_bucket_keeps_both_extremes_in_order_of_occurrence() {
        let decimation = Decimation::new(8, 4);
        assert_eq!(decimation.samples_per_bucket(), Some(4));
        assert_eq!(decimation.times(&[0., 1., 2., 3., 4., 5., 6., 7.]), [0., 2., 4., 6.]);
        assert_eq!(decimation.values(&[0., 9., -1., 2., 5., -7., 6., 5.]), [9., -1., -7., 6.]);
    }

    #[test]
    fn a_single_spike_survives_and_nan_leaves_a_gap() {
        let mut samples = vec![0.0; 100_000];
        samples[77_777] = 42.0;
        samples[..1000].fill(f64::NAN);
        let values = Decimation::new(samples.len(), 2000).values(&samples);
        assert_eq!(values.len(), 2000);
        assert_eq!(values.iter().filter(|&&v| v == 42.0).count(), 1);
        assert_eq!(values.iter().filter(|v| v.is_nan()).count(), 20);
    }

    #[test]
    fn buckets_cover_every_sample_once() {
        let decimation = Decimation::new(1003, 100);
        let mut next = 0;
        for range in decimation.ranges(50) {
            assert_eq!(range.start, next);
            assert!(!range.is_empty());
            next = range.end;
        }
        assert_eq!(next, 1003);
    }
}
