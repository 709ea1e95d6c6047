//! One message after its definition: which values it holds, in their order.

use super::definition::{Count, Definition, Field, Kind, Primitive};
use super::wire::{Short, Wire};

/// Longest sequence of numbers that becomes columns; longer ones are no signals of joints.
pub(super) const LONGEST: usize = 1024;
/// Longest sequence of messages that becomes columns.
pub(super) const MOST_MESSAGES: usize = 256;

/// Takes what a message holds, in its order; what a sink has no use for it leaves out.
pub(super) trait Sink {
    /// The stamp of the message's header, ns.
    fn stamp(&mut self, _ns: i64) {}
    /// One time, ns.
    fn time(&mut self, ns: i64) {
        self.number(ns as f64 * 1e-9);
    }
    /// A key that other messages of the topic need not have, or with a value of another kind.
    fn key(&mut self, _name: &str, _kind: u8) {}
    /// A field begins.
    fn field(&mut self, _name: &str) {}
    /// One number.
    fn number(&mut self, _value: f64) {}
    /// As many numbers follow.
    fn numbers(&mut self, _count: usize) {}
    /// One text.
    fn text(&mut self, _text: &[u8]) {}
    /// As many texts follow.
    fn texts(&mut self, _count: usize) {}
    /// As many messages follow, each between [`Sink::open`] and [`Sink::close`].
    fn messages(&mut self, _count: usize) {}
    /// A message begins.
    fn open(&mut self) {}
    /// A message ends.
    fn close(&mut self) {}
}

/// Hands the values of a message to a sink. Bytes, and sequences that are too long for signals, are passed over.
///
/// # Errors
/// [`Short`]: the message ends before its values.
pub(super) fn walk(definition: &Definition, wire: &mut Wire<'_>, sink: &mut impl Sink) -> Result<(), Short> {
    sink.open();
    message(definition, 0, wire, sink, true)?;
    sink.close();
    Ok(())
}

fn message(
    definition: &Definition,
    place: usize,
    wire: &mut Wire<'_>,
    sink: &mut impl Sink,
    outermost: bool,
) -> Result<(), Short> {
    let fields = &definition.messages[place].fields;
    if fields.is_empty() && wire.is_aligned() {
        // A structure without members takes a byte in ROS 2.
        return wire.skip(Primitive::U8, 1);
    }
    for field in fields {
        let inner = match field.kind {
            Kind::Message(inner) => inner,
            Kind::Primitive(kind) => {
                primitives(field, kind, wire, sink)?;
                continue;
            }
        };
        let name = definition.messages[inner].name.as_str();
        match (field.count, name) {
            (Count::One, "std_msgs/Header") => {
                let mut header = Header { stamp: None };
                message(definition, inner, wire, &mut header, false)?;
                if let Some(ns) = header.stamp.filter(|_| outermost) {
                    sink.stamp(ns);
                }
            }
            (Count::One, "builtin_interfaces/Time" | "builtin_interfaces/Duration") => {
                let ns = wire.stamp(true)?;
                sink.field(&field.name);
                sink.time(ns);
            }
            (Count::One, _) => {
                sink.field(&field.name);
                sink.open();
                message(definition, inner, wire, sink, false)?;
                sink.close();
            }
            (count, _) => {
                let length = match count {
                    Count::Fixed(length) => length,
                    _ => wire.length()?,
                };
                if length > MOST_MESSAGES {
                    for _ in 0..length {
                        let before = wire.place();
                        message(definition, inner, wire, &mut Nothing, false)?;
                        if wire.place() == before {
                            // Messages without values: there is nothing to pass over.
                            break;
                        }
                    }
                    continue;
                }
                sink.field(&field.name);
                sink.messages(length);
                for _ in 0..length {
                    sink.open();
                    message(definition, inner, wire, sink, false)?;
                    sink.close();
                }
            }
        }
    }
    Ok(())
}

fn primitives(
    field: &Field,
    kind: Primitive,
    wire: &mut Wire<'_>,
    sink: &mut impl Sink,
) -> Result<(), Short> {
    let is_text = matches!(kind, Primitive::Text);
    let count = match field.count {
        Count::One if is_text => {
            let text = wire.text()?;
            sink.field(&field.name);
            sink.text(text);
            return Ok(());
        }
        Count::One => {
            if let Primitive::Stamp { signed } = kind {
                let ns = wire.stamp(signed)?;
                sink.field(&field.name);
                sink.time(ns);
                return Ok(());
            }
            let value = wire.number(kind)?;
            if kind != Primitive::WideText {
                sink.field(&field.name);
                sink.number(value);
            }
            return Ok(());
        }
        Count::Fixed(count) => count,
        Count::Sequence => wire.length()?,
    };
    let are_bytes = matches!(kind, Primitive::U8 | Primitive::I8 | Primitive::WideText);
    if count > LONGEST || are_bytes {
        return wire.skip(kind, count);
    }
    sink.field(&field.name);
    if is_text {
        sink.texts(count);
        for _ in 0..count {
            sink.text(wire.text()?);
        }
        return Ok(());
    }
    sink.numbers(count);
    for _ in 0..count {
        sink.number(wire.number(kind)?);
    }
    Ok(())
}

/// Takes the stamp of a header alone.
struct Header {
    stamp: Option<i64>,
}

impl Sink for Header {
    fn time(&mut self, ns: i64) {
        self.stamp.get_or_insert(ns);
    }
}

struct Nothing;

impl Sink for Nothing {}
