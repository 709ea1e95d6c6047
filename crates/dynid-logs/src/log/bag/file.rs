//! What the files of bags have in common, however they are made.

use std::collections::BTreeMap;
use std::ops::ControlFlow;

/// A topic of a bag.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Topic {
    pub(super) name: String,
    /// Type of its messages, such as `sensor_msgs/msg/JointState`.
    pub(super) kind: String,
    /// How messages are written: `cdr`, `ros1`, ..
    pub(super) encoding: String,
    /// How their definition is written: `ros2msg`, `ros1msg`, ..
    pub(super) schema_encoding: String,
    /// Definition of its messages.
    pub(super) schema: String,
}

/// A message as the file has it.
pub(super) struct RawMessage<'a> {
    /// Channel of its topic.
    pub(super) channel: u32,
    /// Time of receipt, ns.
    pub(super) received: i64,
    pub(super) data: &'a [u8],
}

/// How reading ended.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum End {
    Whole,
    /// The file is broken; what came before was read.
    Broken(String),
}

/// Takes messages until it has enough.
pub(super) type Take<'a> = &'a mut dyn FnMut(RawMessage<'_>) -> ControlFlow<()>;

/// A file of a bag.
pub(super) trait BagFile: Send {
    /// Topics by their channels.
    fn topics(&self) -> &BTreeMap<u32, Topic>;

    /// Hands over the messages of some channels in the order of the file.
    ///
    /// # Errors
    /// The operating system's. A broken file is an [`End`].
    fn messages(&self, channels: &[u32], take: Take<'_>) -> Result<End, String>;

    /// The first messages of some channels, until there are enough of each; files with an index pass over what lies between.
    ///
    /// # Errors
    /// As [`BagFile::messages`].
    fn first_messages(
        &self,
        channels: &[u32],
        enough: usize,
        take: &mut dyn FnMut(RawMessage<'_>),
    ) -> Result<End, String> {
        let mut waiting = Waiting::new(channels, enough);
        self.messages(channels, &mut |message| waiting.take(message, take))
    }
}

/// Channels of which messages are still wanted.
pub(super) struct Waiting {
    seen: BTreeMap<u32, usize>,
    enough: usize,
}

impl Waiting {
    pub(super) fn new(channels: &[u32], enough: usize) -> Self {
        Waiting { seen: channels.iter().map(|c| (*c, 0)).collect(), enough }
    }

    /// Whether messages of a channel are wanted.
    pub(super) fn wants(&self, channel: u32) -> bool {
        self.seen.get(&channel).is_some_and(|n| *n < self.enough)
    }

    pub(super) fn is_done(&self) -> bool {
        self.seen.values().all(|n| *n >= self.enough)
    }

    /// Hands a message over if it is wanted.
    pub(super) fn take(
        &mut self,
        message: RawMessage<'_>,
        take: &mut dyn FnMut(RawMessage<'_>),
    ) -> ControlFlow<()> {
        if self.wants(message.channel) {
            *self.seen.entry(message.channel).or_default() += 1;
            take(message);
        }
        if self.is_done() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }
}
