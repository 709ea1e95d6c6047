//! Names of the numbers in a message.
//!
//! A number is named by its path, `/topic/wrench/force/x`. Numbers that stand beside names, one for each, are named by them:
//! `/joint_states/<joint>/position`. So are the messages of a sequence that have a `name`.

use super::walk::Sink;

/// A message, taken apart to name what it holds.
#[derive(Debug, Default)]
struct Node {
    /// Values by their fields.
    fields: Vec<(String, Value)>,
}

#[derive(Debug)]
enum Value {
    Number,
    Numbers(usize),
    Text(String),
    Texts(Vec<String>),
    Message(Node),
    Messages(Vec<Node>),
}

/// Collects the names of a message's numbers in the order in which they come.
#[derive(Debug, Default)]
pub(super) struct Names {
    /// Messages that are open, the outermost first.
    open: Vec<Node>,
    field: String,
    /// Entries of a sequence that are still to come.
    entries: usize,
    root: Option<Node>,
}

impl Names {
    /// Names below a topic.
    pub(super) fn below(&self, topic: &str) -> Vec<String> {
        let mut names = Vec::new();
        if let Some(root) = &self.root {
            root.name(topic, &[], &mut names);
        }
        names
    }

    fn put(&mut self, value: Value) {
        let field = self.field.clone();
        if let Some(node) = self.open.last_mut() {
            node.fields.push((field, value));
        }
    }
}

impl Sink for Names {
    fn field(&mut self, name: &str) {
        name.clone_into(&mut self.field);
    }

    fn number(&mut self, _: f64) {
        if self.entries > 0 {
            self.entries -= 1;
        } else {
            self.put(Value::Number);
        }
    }

    fn numbers(&mut self, count: usize) {
        self.put(Value::Numbers(count));
        self.entries = count;
    }

    fn text(&mut self, text: &[u8]) {
        let text = String::from_utf8_lossy(text).into_owned();
        if self.entries > 0 {
            self.entries -= 1;
            if let Some((_, Value::Texts(texts))) =
                self.open.last_mut().and_then(|node| node.fields.last_mut())
            {
                texts.push(text);
            }
        } else {
            self.put(Value::Text(text));
        }
    }

    fn texts(&mut self, count: usize) {
        self.put(Value::Texts(Vec::new()));
        self.entries = count;
    }

    fn messages(&mut self, _: usize) {
        self.put(Value::Messages(Vec::new()));
    }

    fn open(&mut self) {
        // A message of its own field, unless its sequence was begun.
        let in_sequence = self.open.last().and_then(|node| node.fields.last());
        if !matches!(in_sequence, Some((field, Value::Messages(_))) if *field == self.field)
            && !self.open.is_empty()
        {
            self.put(Value::Message(Node::default()));
        }
        self.open.push(Node::default());
    }

    fn close(&mut self) {
        let Some(node) = self.open.pop() else { return };
        match self.open.last_mut().and_then(|outer| outer.fields.last_mut()) {
            Some((field, Value::Messages(list))) => {
                list.push(node);
                // The next message belongs to the same sequence.
                self.field.clone_from(field);
            }
            Some((_, message)) => *message = Value::Message(node),
            None => self.root = Some(node),
        }
    }
}

impl Node {
    /// Names of the numbers, in their order. `keys`: lists of names in the messages around this one, the innermost first.
    fn name(&self, path: &str, keys: &[&[String]], out: &mut Vec<String>) {
        let own = self.fields.iter().filter_map(|(_, value)| match value {
            Value::Texts(texts) if !texts.is_empty() && all_differ(texts) => Some(texts.as_slice()),
            _ => None,
        });
        let keys: Vec<&[String]> = own.chain(keys.iter().copied()).collect();
        let names_for = |count: usize| keys.iter().find(|k| k.len() == count);
        for (field, value) in &self.fields {
            match value {
                Value::Number => out.push(format!("{path}/{field}")),
                Value::Numbers(count) => match names_for(*count) {
                    // What is called `values` is what the names name.
                    Some(names) if field == "values" => {
                        out.extend(names.iter().map(|n| format!("{path}/{n}")))
                    }
                    Some(names) => out.extend(names.iter().map(|n| format!("{path}/{n}/{field}"))),
                    None => out.extend((0..*count).map(|k| format!("{path}/{field}[{k}]"))),
                },
                Value::Text(_) | Value::Texts(_) => {}
                Value::Message(node) => node.name(&format!("{path}/{field}"), &keys, out),
                Value::Messages(list) => {
                    let own: Option<Vec<String>> = list.iter().map(Node::own_name).collect();
                    let own = own.filter(|names| all_differ(names));
                    for (k, node) in list.iter().enumerate() {
                        let inner = match (&own, names_for(list.len())) {
                            (Some(names), _) => format!("{path}/{}", names[k]),
                            (None, Some(names)) => format!("{path}/{}", names[k]),
                            (None, None) => format!("{path}/{field}[{k}]"),
                        };
                        node.name(&inner, &[], out);
                    }
                }
            }
        }
    }

    /// What the message says it is called.
    fn own_name(&self) -> Option<String> {
        self.fields.iter().find_map(|(field, value)| match value {
            Value::Text(text) if !text.is_empty() && is_name(field) => Some(text.clone()),
            _ => None,
        })
    }
}

/// Whether a field of this name says what its message is called.
pub(super) fn is_name(field: &str) -> bool {
    matches!(field, "name" | "joint_name")
}

fn all_differ(names: &[String]) -> bool {
    let mut sorted: Vec<&String> = names.iter().collect();
    sorted.sort_unstable();
    sorted.windows(2).all(|pair| pair[0] != pair[1]) && names.iter().all(|n| !n.is_empty())
}
