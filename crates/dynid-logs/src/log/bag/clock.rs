//! Two clocks of a bag: the stamps in the headers of messages, and the times of their receipt.

use crate::log::ReadingNote;

/// Clocks that differ by more than this between topics are not one clock, ns.
const SAME_CLOCK_NS: f64 = 1e8;
/// Share of messages that may be out of order.
const MOST_OUT_OF_ORDER: f64 = 1e-3;

/// A clock of a bag.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Clock {
    /// Stamps in the headers of messages.
    Header,
    /// Times at which the recorder received them.
    Receipt,
}

/// Times of the messages of a topic.
#[derive(Clone, Debug, Default)]
pub(super) struct Times {
    /// Stamps of headers, ns; empty unless every message has one.
    pub(super) header: Vec<i64>,
    /// Times of receipt, ns.
    pub(super) receipt: Vec<i64>,
}

/// Stamps that are collected one by one without more memory than they take in the end: a list that grows holds them twice while it moves.
#[derive(Debug, Default)]
pub(super) struct Stamps(Vec<Vec<i64>>);

impl Stamps {
    /// Stamps that lie together.
    const TOGETHER: usize = 1 << 16;

    pub(super) fn push(&mut self, stamp: i64) {
        match self.0.last_mut().filter(|last| last.len() < Self::TOGETHER) {
            Some(last) => last.push(stamp),
            None => {
                let mut next = Vec::with_capacity(Self::TOGETHER);
                next.push(stamp);
                self.0.push(next);
            }
        }
    }

    pub(super) fn finish(self) -> Vec<i64> {
        let mut all = Vec::with_capacity(self.0.iter().map(Vec::len).sum());
        // Each part is given back once it has been moved.
        self.0.into_iter().for_each(|part| all.extend(part));
        all
    }
}

impl Times {
    pub(super) fn of(&self, clock: Clock) -> &[i64] {
        match clock {
            Clock::Header => &self.header,
            Clock::Receipt => &self.receipt,
        }
    }

    fn has_headers(&self) -> bool {
        self.header.len() == self.receipt.len() && self.header.iter().any(|t| *t != 0)
    }
}

/// How the stamps of a topic follow each other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Steps {
    /// Median of the steps, ns.
    pub(super) usual: f64,
    /// Root mean square of the steps around their median, those beyond ten times it left out, ns.
    pub(super) jitter: f64,
    /// Stamps that are not later than those before them.
    pub(super) out_of_order: usize,
}

impl Steps {
    pub(super) fn of(stamps: &[i64]) -> Option<Self> {
        let steps = || stamps.windows(2).map(|pair| pair[1].saturating_sub(pair[0]));
        // One list of them at a time: logs may be long.
        let mut all: Vec<i64> = steps().collect();
        if all.is_empty() {
            return None;
        }
        let middle = all.len() / 2;
        let usual = *all.select_nth_unstable(middle).1 as f64;
        drop(all);
        let near = || steps().map(|s| s as f64).filter(|s| s.abs() <= 10.0 * usual.max(1.0));
        let squares: f64 = near().map(|s| (s - usual) * (s - usual)).sum();
        let jitter = (squares / near().count().max(1) as f64).sqrt();
        Some(Steps { usual, jitter, out_of_order: steps().filter(|s| *s <= 0).count() })
    }
}

/// A clock, and why it is taken.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Choice {
    pub(super) clock: Clock,
    pub(super) reason: String,
}

impl Choice {
    pub(super) fn note(&self) -> ReadingNote {
        let clock = match self.clock {
            Clock::Header => "stamps of headers",
            Clock::Receipt => "times of receipt",
        };
        ReadingNote::new("clock", clock, self.reason.clone())
    }
}

/// Which clock to use for some topics: stamps of headers, which do not know of the way to the recorder, unless they fail.
pub(super) fn choose(topics: &[(&str, &Times)]) -> Choice {
    let receipt = |reason: &str| Choice { clock: Clock::Receipt, reason: reason.to_owned() };
    if let Some((name, _)) = topics.iter().find(|(_, times)| !times.has_headers()) {
        return receipt(&format!("`{name}` has no stamps in its headers"));
    }
    let mut about = Vec::new();
    for (name, times) in topics {
        let (Some(header), Some(received)) = (Steps::of(&times.header), Steps::of(&times.receipt)) else {
            return receipt(&format!("`{name}` has a single message"));
        };
        if header.usual <= 0.0 || header.out_of_order as f64 > MOST_OUT_OF_ORDER * times.header.len() as f64 {
            return receipt(&format!(
                "{} stamps of headers are not later than those before them",
                header.out_of_order
            ));
        }
        about.push(format!(
            "`{name}`: steps of {:.3} ms with jitter {:.3} ms (received: {:.3} ms), drift {:.1} ppm, {} out of order (received: {})",
            header.usual * 1e-6,
            header.jitter * 1e-6,
            received.jitter * 1e-6,
            drift(times) * 1e6,
            header.out_of_order,
            received.out_of_order
        ));
    }
    let delays: Vec<f64> = topics.iter().map(|(_, times)| delay(times)).collect();
    let spread =
        delays.iter().fold(f64::MIN, |a, b| a.max(*b)) - delays.iter().fold(f64::MAX, |a, b| a.min(*b));
    if spread > SAME_CLOCK_NS {
        return receipt(&format!(
            "headers of the topics are of clocks that differ by {:.3} s",
            spread * 1e-9
        ));
    }
    Choice { clock: Clock::Header, reason: about.join("; ") }
}

/// Median of the time from the stamp to the receipt, ns.
fn delay(times: &Times) -> f64 {
    let mut delays: Vec<i64> =
        times.header.iter().zip(&times.receipt).map(|(h, r)| r.saturating_sub(*h)).collect();
    delays.sort_unstable();
    delays.get(delays.len() / 2).map_or(0.0, |d| *d as f64)
}

/// How much faster the clock of the headers runs than that of the recorder, from the first and the last tenth of the messages.
fn drift(times: &Times) -> f64 {
    let tenth = (times.header.len() / 10).max(1);
    let mean = |list: &[i64], first: i64| {
        list.iter().map(|t| (t.saturating_sub(first)) as f64).sum::<f64>() / list.len() as f64
    };
    let span = |list: &[i64]| {
        let first = list.first().copied().unwrap_or(0);
        mean(&list[list.len() - tenth..], first) - mean(&list[..tenth], first)
    };
    let (header, received) = (span(&times.header), span(&times.receipt));
    if received > 0.0 { header / received - 1.0 } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn times(header: impl Fn(i64) -> i64, receipt: impl Fn(i64) -> i64) -> Times {
        Times { header: (0..1000).map(header).collect(), receipt: (0..1000).map(receipt).collect() }
    }

    #[test]
    fn headers_are_taken_unless_they_fail() {
        let good = times(|k| 5_000 + 1_000_000 * k, |k| 5_000_000 + 1_000_100 * k + 300_000 * (k % 3));
        let choice = choose(&[("/a", &good)]);
        assert_eq!(choice.clock, Clock::Header);
        assert!(choice.reason.contains("drift -"), "{}", choice.reason);
        assert_eq!(choose(&[("/a", &times(|_| 0, |k| k))]).clock, Clock::Receipt);
        assert_eq!(choose(&[("/a", &times(|_| 7, |k| k))]).clock, Clock::Receipt);
        assert_eq!(choose(&[("/a", &times(|k| (k - 500).abs(), |k| k))]).clock, Clock::Receipt);
        let other = times(|k| 3_000_000_000 + 1_000_000 * k, |k| 5_000_000 + 1_000_000 * k);
        assert_eq!(choose(&[("/a", &good), ("/b", &other)]).clock, Clock::Receipt);
    }
}
