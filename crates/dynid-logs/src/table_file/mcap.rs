//! `.mcap`: joint states of ROS 2.

use std::collections::BTreeMap;
use std::io::{Cursor, Write};
use std::path::Path;

use dynid_files::output::{AtomicFile, OutputError};
use mcap::records::MessageHeader;
use mcap::{McapResult, WriteOptions};

use super::{JointStates, unwritable};
use crate::csv::GZIP_COMMENT;

/// The definition of `sensor_msgs/msg/JointState`, and of what it holds.
const DEFINITION: &str = "std_msgs/Header header\nstring[] name\nfloat64[] position\nfloat64[] velocity\nfloat64[] effort\n\
    ================================================================================\nMSG: std_msgs/Header\n\
    builtin_interfaces/Time stamp\nstring frame_id\n\
    ================================================================================\nMSG: builtin_interfaces/Time\n\
    int32 sec\nuint32 nanosec\n";

pub(super) fn write(path: &Path, states: &JointStates) -> Result<(), OutputError> {
    let mut bytes = Cursor::new(Vec::new());
    fill(&mut bytes, states).map_err(|e| unwritable(path, e))?;
    let mut file = AtomicFile::create(path)?;
    file.write_all(bytes.get_ref()).map_err(|e| unwritable(path, e))?;
    file.finish()
}

fn fill(bytes: &mut Cursor<Vec<u8>>, states: &JointStates) -> McapResult<()> {
    // Compressors would need C.
    let options = WriteOptions::new().profile("ros2").library(GZIP_COMMENT).compression(None);
    let mut writer = options.create(bytes)?;
    let schema = writer.add_schema("sensor_msgs/msg/JointState", "ros2msg", DEFINITION.as_bytes())?;
    let channel = writer.add_channel(schema, "/joint_states", "cdr", &BTreeMap::new())?;
    let mut message = Vec::new();
    for (row, stamp) in states.stamps.iter().enumerate() {
        message.clear();
        message.extend([0, 1, 0, 0]);
        let mut cdr = Cdr { bytes: &mut message };
        cdr.word(stamp.div_euclid(1_000_000_000) as u32);
        cdr.word(stamp.rem_euclid(1_000_000_000) as u32);
        cdr.text("");
        cdr.word(states.joints.len() as u32);
        states.joints.iter().for_each(|joint| cdr.text(joint));
        for signal in [&states.position, &states.velocity, &states.effort] {
            cdr.doubles(signal.iter().map(|joint| joint[row]));
        }
        // Times of receipt count from 1970; those before have none.
        let time = u64::try_from(*stamp).unwrap_or(0);
        let header =
            MessageHeader { channel_id: channel, sequence: row as u32, log_time: time, publish_time: time };
        writer.write_to_known_channel(&header, &message)?;
    }
    writer.finish().map(|_| ())
}

/// Values in CDR, little end first; they stand at multiples of their size from behind the first four bytes.
struct Cdr<'a> {
    bytes: &'a mut Vec<u8>,
}

impl Cdr<'_> {
    fn align(&mut self, size: usize) {
        let length = 4 + (self.bytes.len() - 4).next_multiple_of(size);
        self.bytes.resize(length, 0);
    }

    fn word(&mut self, word: u32) {
        self.align(4);
        self.bytes.extend(word.to_le_bytes());
    }

    fn text(&mut self, text: &str) {
        self.word(text.len() as u32 + 1);
        self.bytes.extend(text.as_bytes());
        self.bytes.push(0);
    }

    fn doubles(&mut self, values: impl ExactSizeIterator<Item = f64>) {
        self.word(values.len() as u32);
        if values.len() > 0 {
            self.align(8);
            values.for_each(|x| self.bytes.extend(x.to_le_bytes()));
        }
    }
}
