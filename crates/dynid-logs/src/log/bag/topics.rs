//! The topics of a bag whose messages can be taken apart, and the columns that they give.

use std::collections::HashMap;

use super::definition::Definition;
use super::json;
use super::names::{Names, is_name};
use super::walk::{Sink, walk};
use super::wire::Wire;
use crate::csv::MAX_COLUMNS;

/// Most kinds of messages of a topic, told apart by the lengths of their sequences and the names in them.
const MAX_SHAPES: usize = 256;

/// How values stand in a message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Encoding {
    Cdr,
    Ros1,
    /// Messages that say by themselves what they hold.
    Json,
}

impl Encoding {
    /// The encoding of messages whose definitions are known, by the names that MCAP has for both.
    pub(super) fn of(message: &str, schema: &str) -> Option<Self> {
        match (message, schema) {
            ("cdr", "ros2msg") => Some(Encoding::Cdr),
            ("ros1", "ros1msg") => Some(Encoding::Ros1),
            ("json", _) => Some(Encoding::Json),
            _ => None,
        }
    }
}

/// A topic, and the columns that its messages gave so far.
#[derive(Debug)]
pub(super) struct Decoded {
    pub(super) name: String,
    pub(super) kind: String,
    encoding: Encoding,
    /// What its messages hold; those in JSON have none.
    definition: Option<Definition>,
    /// Columns of the topic.
    pub(super) columns: Vec<String>,
    places: HashMap<String, usize>,
    /// Per kind of message, the columns of its numbers.
    shapes: HashMap<Vec<u8>, Vec<usize>>,
    scratch: Scratch,
}

/// What a message holds.
#[derive(Debug, Default)]
struct Scratch {
    numbers: Vec<f64>,
    /// Lengths of sequences and texts that name numbers: messages that agree in them have the same columns.
    shape: Vec<u8>,
    stamp: Option<i64>,
    /// Whether a text in this place may name numbers: as one of a sequence of which as many are to come, or by its field. Others, such as
    /// messages of errors, change without a meaning for columns.
    entries: usize,
    names: bool,
}

/// The numbers of a message.
pub(super) struct Values<'a> {
    /// Stamp of its header, ns.
    pub(super) stamp: Option<i64>,
    pub(super) numbers: &'a [f64],
    /// Column of the topic per number.
    pub(super) columns: &'a [usize],
}

impl Decoded {
    pub(super) fn new(name: &str, kind: &str, encoding: Encoding, schema: &str) -> Result<Self, String> {
        Ok(Decoded {
            name: name.to_owned(),
            kind: kind.to_owned(),
            encoding,
            definition: match encoding {
                Encoding::Json => None,
                _ => Some(Definition::parse(kind, schema)?),
            },
            columns: Vec::new(),
            places: HashMap::new(),
            shapes: HashMap::new(),
            scratch: Scratch::default(),
        })
    }

    /// Hands what a message holds to a sink.
    fn walk(&self, data: &[u8], sink: &mut impl Sink) -> Result<(), String> {
        let Some(definition) = &self.definition else {
            json::walk(&json::parse(data)?, sink, true);
            return Ok(());
        };
        let mut wire = match self.encoding {
            Encoding::Cdr => Wire::cdr(data)?,
            _ => Wire::ros1(data),
        };
        walk(definition, &mut wire, sink)
            .map_err(|_| format!("expected a message of `{}`, found the end of it", self.kind))
    }

    /// Takes a message apart.
    ///
    /// # Errors
    /// What is wrong with it.
    pub(super) fn decode(&mut self, data: &[u8]) -> Result<Values<'_>, String> {
        let mut scratch = std::mem::take(&mut self.scratch);
        scratch.numbers.clear();
        scratch.shape.clear();
        (scratch.stamp, scratch.entries) = (None, 0);
        let walked = self.walk(data, &mut scratch);
        self.scratch = scratch;
        walked?;
        if !self.shapes.contains_key(&self.scratch.shape) {
            let mut names = Names::default();
            self.walk(data, &mut names)?;
            let columns = names.below(&self.name);
            if self.shapes.len() >= MAX_SHAPES {
                return Err(format!(
                    "expected at most {MAX_SHAPES} kinds of messages in the topic, found more"
                ));
            }
            let places = columns.iter().map(|name| self.place_of(name)).collect::<Result<_, _>>()?;
            self.shapes.insert(self.scratch.shape.clone(), places);
        }
        let columns = self.shapes.get(&self.scratch.shape).map_or(&[][..], Vec::as_slice);
        Ok(Values { stamp: self.scratch.stamp, numbers: &self.scratch.numbers, columns })
    }

    fn place_of(&mut self, name: &str) -> Result<usize, String> {
        if let Some(place) = self.places.get(name) {
            return Ok(*place);
        }
        if self.columns.len() >= MAX_COLUMNS {
            return Err(format!("expected at most {MAX_COLUMNS} columns, found more"));
        }
        self.columns.push(name.to_owned());
        self.places.insert(name.to_owned(), self.columns.len() - 1);
        Ok(self.columns.len() - 1)
    }
}

impl Sink for Scratch {
    fn key(&mut self, name: &str, kind: u8) {
        // Behind its length: keys one after the other are no other keys.
        self.shape.push(kind);
        self.shape.extend((name.len() as u32).to_le_bytes());
        self.shape.extend(name.as_bytes());
    }

    fn stamp(&mut self, ns: i64) {
        self.stamp = Some(ns);
    }

    fn number(&mut self, value: f64) {
        self.numbers.push(value);
    }

    fn numbers(&mut self, count: usize) {
        self.shape.extend((count as u32).to_le_bytes());
    }

    fn field(&mut self, name: &str) {
        self.names = is_name(name);
    }

    fn text(&mut self, text: &[u8]) {
        let is_entry = self.entries > 0;
        self.entries = self.entries.saturating_sub(1);
        if is_entry || self.names {
            self.shape.extend((text.len() as u32).to_le_bytes());
            self.shape.extend(text);
        }
    }

    fn texts(&mut self, count: usize) {
        self.numbers(count);
        self.entries = count;
    }

    fn messages(&mut self, count: usize) {
        self.numbers(count);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A message of ROS 1, whose values stand close.
    #[derive(Default)]
    struct Bytes(Vec<u8>);

    impl Bytes {
        fn text(mut self, text: &str) -> Self {
            self.0.extend((text.len() as u32).to_le_bytes());
            self.0.extend(text.as_bytes());
            self
        }
        fn count(mut self, count: u32) -> Self {
            self.0.extend(count.to_le_bytes());
            self
        }
        fn number(mut self, x: f64) -> Self {
            self.0.extend(x.to_le_bytes());
            self
        }
    }

    fn columns(kind: &str, schema: &str, bytes: Bytes) -> Vec<(String, f64)> {
        let mut topic = Decoded::new("/t", kind, Encoding::Ros1, schema).unwrap();
        let values = topic.decode(&bytes.0).unwrap();
        let (numbers, places) = (values.numbers.to_vec(), values.columns.to_vec());
        assert_eq!(numbers.len(), places.len());
        numbers.iter().zip(places).map(|(x, k)| (topic.columns[k].clone(), *x)).collect()
    }

    fn named(pairs: &[(&str, f64)]) -> Vec<(String, f64)> {
        pairs.iter().map(|(name, x)| ((*name).to_owned(), *x)).collect()
    }

    #[test]
    fn numbers_beside_names_are_named_by_them() {
        let bytes = Bytes::default()
            .count(2)
            .text("a")
            .text("b")
            .count(2)
            .number(1.0)
            .number(2.0)
            .count(0)
            .count(1)
            .number(5.0);
        let schema = "string[] name\nfloat64[] position\nfloat64[] velocity\nfloat64[] effort";
        let expected = named(&[("/t/a/position", 1.0), ("/t/b/position", 2.0), ("/t/effort[0]", 5.0)]);
        assert_eq!(columns("sensor_msgs/JointState", schema, bytes), expected);
    }

    #[test]
    fn interfaces_of_joints_are_named_by_joint_and_interface() {
        let schema = "string[] joint_names\nInterfaceValue[] interface_values\n===\nMSG: c/InterfaceValue\nstring[] interface_names\nfloat64[] values";
        let one = |bytes: Bytes, x: f64| {
            bytes.count(2).text("position").text("effort").count(2).number(x).number(-x)
        };
        let bytes = Bytes::default().count(2).text("a").text("b").count(2);
        let expected = named(&[
            ("/t/a/position", 1.0),
            ("/t/a/effort", -1.0),
            ("/t/b/position", 2.0),
            ("/t/b/effort", -2.0),
        ]);
        assert_eq!(columns("c/DynamicJointState", schema, one(one(bytes, 1.0), 2.0)), expected);
    }

    #[test]
    fn states_of_controllers_and_of_single_axes_are_named() {
        let schema = "string[] joint_names\nPoint feedback\nState[] dof_states\n===\nMSG: c/Point\nfloat64[] positions\n===\nMSG: c/State\nstring name\nfloat64 reference\nfloat64 output";
        let bytes = Bytes::default().count(1).text("a").count(1).number(1.0).count(2);
        let bytes = bytes.text("x").number(3.0).number(4.0).text("y").number(5.0).number(6.0);
        let expected = named(&[
            ("/t/feedback/a/positions", 1.0),
            ("/t/x/reference", 3.0),
            ("/t/x/output", 4.0),
            ("/t/y/reference", 5.0),
            ("/t/y/output", 6.0),
        ]);
        assert_eq!(columns("c/ControllerState", schema, bytes), expected);
    }

    #[test]
    fn texts_that_name_nothing_make_no_columns_of_their_own() {
        let schema = "string status\nfloat64 x\nPart part\n===\nMSG: c/Part\nstring note\nfloat64 y";
        let mut topic = Decoded::new("/t", "c/Status", Encoding::Ros1, schema).unwrap();
        for k in 0..2 * MAX_SHAPES {
            let bytes =
                Bytes::default().text(&k.to_string()).number(1.0).text(&"n".repeat(k)).number(k as f64);
            assert_eq!(topic.decode(&bytes.0).unwrap().numbers, [1.0, k as f64]);
        }
        assert_eq!((topic.shapes.len(), topic.columns), (1, vec!["/t/x".to_owned(), "/t/part/y".to_owned()]));
    }

    #[test]
    fn a_topic_with_messages_of_several_joints_has_the_columns_of_all() {
        let schema = "string[] name\nfloat64[] position";
        let mut topic = Decoded::new("/t", "s/J", Encoding::Ros1, schema).unwrap();
        let arm = Bytes::default().count(1).text("arm").count(1).number(1.0).0;
        let hand = Bytes::default().count(1).text("hand").count(1).number(2.0).0;
        for (bytes, column, value) in [(&arm, 0, 1.0), (&hand, 1, 2.0), (&arm, 0, 1.0)] {
            let values = topic.decode(bytes).unwrap();
            assert_eq!((values.columns, values.numbers), (&[column][..], &[value][..]));
        }
        assert_eq!(topic.columns, ["/t/arm/position", "/t/hand/position"]);
        assert!(topic.decode(&arm[..6]).is_err());
    }
}
