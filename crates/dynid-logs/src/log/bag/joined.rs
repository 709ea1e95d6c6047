//! Messages of several topics as the rows of one table.

use std::collections::BTreeMap;

use super::clock::{Clock, Times};
use crate::log::arrays::Values;

/// What was read of a topic.
#[derive(Debug, Default)]
pub(super) struct TopicRows {
    pub(super) times: Times,
    /// Numbers of the wanted columns, message by message; NaN where a message has none.
    pub(super) columns: Vec<Vec<f64>>,
}

/// What was read, by topic.
pub(super) type Topics = BTreeMap<usize, TopicRows>;

/// The rows that topics share.
pub(super) struct Joined<'a> {
    read: &'a Topics,
    pub(super) rows: usize,
    /// Per topic, the row of each message.
    row_of: BTreeMap<usize, Vec<usize>>,
}

impl<'a> Joined<'a> {
    /// Every message of a topic alone is a row, as they come: whether stamps may run backwards is for others to say. Of several topics all that
    /// has one stamp is a row.
    pub(super) fn of(read: &'a Topics, clock: Clock) -> Self {
        if let [(topic, only)] = read.iter().collect::<Vec<_>>()[..] {
            let rows = only.times.receipt.len();
            return Joined { read, rows, row_of: [(*topic, (0..rows).collect())].into() };
        }
        let mut stamps: Vec<i64> = read.values().flat_map(|topic| topic.times.of(clock)).copied().collect();
        stamps.sort_unstable();
        stamps.dedup();
        let rows = |topic: &TopicRows| {
            topic.times.of(clock).iter().map(|stamp| stamps.partition_point(|s| s < stamp)).collect()
        };
        let row_of = read.iter().map(|(k, topic)| (*k, rows(topic))).collect();
        Joined { read, rows: stamps.len(), row_of }
    }

    /// Stamps of a clock; of rows that several messages share, those of the first topic.
    pub(super) fn stamps(&self, clock: Clock) -> Values {
        let mut out = vec![None; self.rows];
        for (topic, rows) in &self.row_of {
            for (stamp, row) in self.read[topic].times.of(clock).iter().zip(rows) {
                out[*row].get_or_insert(*stamp);
            }
        }
        Values::Whole(out.into_iter().map(Option::unwrap_or_default).collect())
    }

    /// A column of a topic. Messages of one stamp fill each other up: publishers may share a topic, each with joints of its own.
    pub(super) fn column(&self, topic: usize, slot: usize) -> Values {
        let mut out = vec![f64::NAN; self.rows];
        for (value, row) in self.read[&topic].columns[slot].iter().zip(&self.row_of[&topic]) {
            if !value.is_nan() {
                out[*row] = *value;
            }
        }
        Values::Float(out)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn messages_of_one_stamp_fill_each_other_up() {
        let gap = f64::NAN;
        let times = |stamps: &[i64]| Times { header: stamps.to_vec(), receipt: stamps.to_vec() };
        let arm_and_hand = TopicRows {
            times: times(&[10, 10, 20, 20]),
            columns: vec![vec![1.0, gap, 2.0, gap], vec![gap, 7.0, gap, 8.0]],
        };
        let force = TopicRows { times: times(&[10, 15]), columns: vec![vec![5.0, 6.0]] };
        let read: Topics = [(0, arm_and_hand), (1, force)].into();
        let joined = Joined::of(&read, Clock::Header);
        assert_eq!(joined.stamps(Clock::Receipt), Values::Whole(vec![10, 15, 20]));
        let column = |topic, slot| match joined.column(topic, slot) {
            Values::Float(x) => x.into_iter().map(|x| (!x.is_nan()).then_some(x)).collect::<Vec<_>>(),
            Values::Whole(_) => Vec::new(),
        };
        assert_eq!(column(0, 0), [Some(1.0), None, Some(2.0)]);
        assert_eq!(column(0, 1), [Some(7.0), None, Some(8.0)]);
        assert_eq!(column(1, 0), [Some(5.0), Some(6.0), None]);
    }
}
