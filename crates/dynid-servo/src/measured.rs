//! Which joints have measured efforts.

use crate::channel::Channel;
use crate::log::ServoLog;

/// Which joints have measured efforts in any log.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Measured {
    /// In N m or N.
    pub effort: Vec<bool>,
    /// In A.
    pub current: Vec<bool>,
}

impl Measured {
    /// None of so many joints.
    pub fn none(joints: usize) -> Self {
        Measured { effort: vec![false; joints], current: vec![false; joints] }
    }

    /// What these channels of the logs have.
    pub fn of(logs: &[ServoLog], channels: &[Channel], joints: usize) -> Self {
        let has = |channel: Channel, j: usize| {
            channels.contains(&channel) && logs.iter().any(|log| log.measured(channel, j).is_some())
        };
        let of = |channel: Channel| (0..joints).map(|j| has(channel, j)).collect();
        Measured { effort: of(Channel::Effort), current: of(Channel::Current) }
    }

    /// Whether a joint has one.
    pub fn any(&self, joint: usize) -> bool {
        self.effort[joint] || self.current[joint]
    }
}
