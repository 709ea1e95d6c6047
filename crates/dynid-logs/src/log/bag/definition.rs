//! Definitions of messages (`.msg` of ROS 1 and 2), as bags carry them: what stands in a message, in its order.

use std::collections::HashMap;

/// Most messages that a definition may refer to.
const MAX_MESSAGES: usize = 1000;
/// Deepest nesting of messages.
const MAX_DEPTH: usize = 32;

/// A value that is no message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Primitive {
    Bool,
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    I64,
    U64,
    F32,
    F64,
    Text,
    WideText,
    /// Seconds and nanoseconds, as ROS 1 has them; unsigned, or signed of durations.
    Stamp {
        signed: bool,
    },
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    Primitive(Primitive),
    /// Place of the message among those of the definition.
    Message(usize),
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Count {
    One,
    Fixed(usize),
    Sequence,
}

#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Field {
    pub(super) name: String,
    pub(super) kind: Kind,
    pub(super) count: Count,
}

#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Message {
    /// `package/Type`.
    pub(super) name: String,
    pub(super) fields: Vec<Field>,
}

/// A message and those it holds; the first one is the outermost.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Definition {
    pub(super) messages: Vec<Message>,
}

impl Definition {
    /// Parses the text that a bag has for a type such as `sensor_msgs/msg/JointState`: its definition, then one for each type that
    /// occurs in it, under `MSG: package/Type` and set apart by lines of `=`.
    ///
    /// # Errors
    /// What is wrong with the text.
    pub(super) fn parse(name: &str, text: &str) -> Result<Self, String> {
        let mut texts: HashMap<String, &str> = HashMap::new();
        let root = without_msg(name);
        let mut rest = text;
        let mut own = root.clone();
        loop {
            let end = rest.find("\n===").map_or(rest.len(), |k| k + 1);
            texts.entry(own).or_insert(&rest[..end]);
            rest = &rest[end..];
            let Some(at) = rest.find("MSG:") else { break };
            rest = &rest[at + 4..];
            let line = rest.lines().next().unwrap_or_default();
            own = without_msg(line.trim());
            rest = &rest[line.len()..];
        }
        let mut definition = Definition { messages: Vec::new() };
        let mut known = HashMap::new();
        definition.add(&root, &texts, &mut known, 0)?;
        Ok(definition)
    }

    fn add(
        &mut self,
        name: &str,
        texts: &HashMap<String, &str>,
        known: &mut HashMap<String, usize>,
        depth: usize,
    ) -> Result<usize, String> {
        if let Some(place) = known.get(name) {
            return Ok(*place);
        }
        let text = texts.get(name).ok_or_else(|| format!("expected a definition of `{name}`, found none"))?;
        if depth > MAX_DEPTH || self.messages.len() >= MAX_MESSAGES {
            return Err(format!(
                "expected messages in messages {MAX_DEPTH} deep at most, found more in `{name}`"
            ));
        }
        let place = self.messages.len();
        self.messages.push(Message { name: name.to_owned(), fields: Vec::new() });
        let package = name.split('/').next().unwrap_or_default();
        let mut fields = Vec::new();
        for line in text.lines() {
            let Some((kind, field, count)) = field_of(line)? else { continue };
            let kind = match primitive(kind) {
                Some(primitive) => Kind::Primitive(primitive),
                None => {
                    let full = match kind {
                        "Header" => "std_msgs/Header".to_owned(),
                        own if !own.contains('/') => format!("{package}/{own}"),
                        other => without_msg(other),
                    };
                    let inner = self.add(&full, texts, known, depth + 1)?;
                    Kind::Message(inner)
                }
            };
            fields.push(Field { name: field.to_owned(), kind, count });
        }
        self.messages[place].fields = fields;
        // Only what is whole is known: a message that holds itself runs into the bound on the depth.
        known.insert(name.to_owned(), place);
        Ok(place)
    }
}

/// `package/msg/Type` as `package/Type`.
fn without_msg(name: &str) -> String {
    match name.split('/').collect::<Vec<_>>()[..] {
        [package, "msg", kind] => format!("{package}/{kind}"),
        _ => name.to_owned(),
    }
}

/// Type, name and count of a line; `None` for comments and constants.
fn field_of(line: &str) -> Result<Option<(&str, &str, Count)>, String> {
    let line = line.split('#').next().unwrap_or_default().trim();
    if line.is_empty() || line.starts_with("===") {
        return Ok(None);
    }
    let (kind, rest) = line
        .split_once(char::is_whitespace)
        .ok_or_else(|| format!("expected `type name`, found `{line}`"))?;
    let rest = rest.trim_start();
    let end = rest.find(|c: char| !(c.is_alphanumeric() || c == '_')).unwrap_or(rest.len());
    let (name, behind) = rest.split_at(end);
    if behind.trim_start().starts_with('=') {
        return Ok(None);
    }
    // Bounds of strings do not show in messages.
    let (base, brackets) = match kind.find('[') {
        Some(at) => (&kind[..at], Some(&kind[at + 1..])),
        None => (kind, None),
    };
    let base = base.split("<=").next().unwrap_or(base);
    let count = match brackets {
        None => Count::One,
        Some(inner) => match inner.trim_end_matches(']') {
            "" => Count::Sequence,
            bound if bound.starts_with("<=") => Count::Sequence,
            number => Count::Fixed(number.parse().map_err(|_| format!("expected a length, found `{kind}`"))?),
        },
    };
    Ok(Some((base, name, count)))
}

fn primitive(kind: &str) -> Option<Primitive> {
    Some(match kind {
        "bool" => Primitive::Bool,
        "int8" => Primitive::I8,
        "uint8" | "byte" | "char" | "octet" => Primitive::U8,
        "int16" => Primitive::I16,
        "uint16" => Primitive::U16,
        "int32" => Primitive::I32,
        "uint32" => Primitive::U32,
        "int64" => Primitive::I64,
        "uint64" => Primitive::U64,
        "float32" => Primitive::F32,
        "float64" => Primitive::F64,
        "string" => Primitive::Text,
        "wstring" => Primitive::WideText,
        "time" => Primitive::Stamp { signed: false },
        "duration" => Primitive::Stamp { signed: true },
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const JOINT_STATE: &str = "# comment\nstd_msgs/Header header\n\nstring[] name\nfloat64[] position\nfloat64[] velocity\nfloat64[] effort\n\
        ================================================================================\nMSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n\
        ================================================================================\nMSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n";

    #[test]
    fn a_definition_holds_what_it_refers_to() {
        let definition = Definition::parse("sensor_msgs/msg/JointState", JOINT_STATE).unwrap();
        let names: Vec<&str> = definition.messages.iter().map(|m| m.name.as_str()).collect();
        assert_eq!(names, ["sensor_msgs/JointState", "std_msgs/Header", "builtin_interfaces/Time"]);
        let effort = &definition.messages[0].fields[4];
        assert_eq!((effort.name.as_str(), effort.count), ("effort", Count::Sequence));
        assert_eq!(effort.kind, Kind::Primitive(Primitive::F64));
    }

    #[test]
    fn constants_defaults_and_bounds_are_understood() {
        let text = "uint8 OK=0\nint32 X = 5 # five\nfloat64[<=4] a\nfloat32[3] b 1.0\nstring<=8[] names\nwstring w\n";
        let definition = Definition::parse("p/T", text).unwrap();
        let found: Vec<(&str, Count)> =
            definition.messages[0].fields.iter().map(|f| (f.name.as_str(), f.count)).collect();
        assert_eq!(
            found,
            [("a", Count::Sequence), ("b", Count::Fixed(3)), ("names", Count::Sequence), ("w", Count::One)]
        );
    }

    #[test]
    fn broken_definitions_are_refused() {
        for text in ["p/T t", "q/U u", "float64[x] a", "lonely", "U u\n===\nMSG: p/U\nT t\n"] {
            Definition::parse("p/T", text).unwrap_err();
        }
    }
}
