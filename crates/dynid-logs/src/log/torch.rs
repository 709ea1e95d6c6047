//! `.pt` files of PyTorch: a zip with the tensors of a dictionary and a pickle that says where they lie.
//!
//! A pickle is a program. The one here is not run: its steps are followed as far as they put together dictionaries, lists and tensors, and whatever it
//! would call besides is passed over.

use std::borrow::Cow;
use std::io::Read;
use std::sync::Arc;

use dynid_files::input::Opened;
use zip::ZipArchive;

use super::arrays::{Array, ArrayFile, Holds, Values};
use super::binary::{Kind, Numbers};

/// Largest pickle, bytes.
const MAX_PICKLE: u64 = 16 << 20;
/// Most values of a pickle.
const MAX_VALUES: usize = 1_000_000;
/// Most axes of a tensor.
const MAX_AXES: usize = 16;
/// Deepest nesting of dictionaries.
const MAX_DEPTH: usize = 16;

/// A file of tensors.
pub(super) struct Torch {
    zip: ZipArchive<Opened>,
    /// Folder of the file's entries.
    folder: String,
    tensors: Vec<Tensor>,
    arrays: Vec<Array>,
}

/// Where the numbers of a tensor lie.
#[derive(Clone, Debug, PartialEq)]
struct Tensor {
    kind: Kind,
    /// Name of its storage.
    storage: Arc<str>,
    first: usize,
    shape: Vec<usize>,
    strides: Vec<usize>,
}

impl Torch {
    /// Name of the entry that holds the pickle, if a zip is a file of PyTorch.
    pub(super) fn pickle_of(zip: &ZipArchive<Opened>) -> Option<String> {
        let names = zip.file_names().filter_map(Result::ok).map(Cow::into_owned);
        names.into_iter().find(|name| name.ends_with("/data.pkl") || name == "data.pkl")
    }

    pub(super) fn open(mut zip: ZipArchive<Opened>, pickle: &str) -> Result<Self, String> {
        let mut bytes = Vec::new();
        let entry = zip.by_name(pickle).map_err(|e| e.to_string())?;
        entry.take(MAX_PICKLE + 1).read_to_end(&mut bytes).map_err(|e| e.to_string())?;
        if bytes.len() as u64 > MAX_PICKLE {
            return Err(format!("expected a pickle of at most {MAX_PICKLE} bytes, found more"));
        }
        let folder = pickle.trim_end_matches("data.pkl").to_owned();
        let (mut tensors, mut arrays) = (Vec::new(), Vec::new());
        collect(&read_pickle(&bytes)?, "", 0, &mut |name, tensor| {
            arrays.push(Array {
                name,
                shape: tensor.shape.clone(),
                holds: Holds::Numbers,
                entries: Vec::new(),
            });
            tensors.push(tensor);
        });
        Ok(Torch { zip, folder, tensors, arrays })
    }
}

impl ArrayFile for Torch {
    fn arrays(&self) -> &[Array] {
        &self.arrays
    }

    fn load(&mut self, array: usize) -> Result<Values, String> {
        let Tensor { kind, storage, first, shape, strides } = &self.tensors[array];
        let name = format!("{}data/{storage}", self.folder);
        let mut entry = self.zip.by_name(&name).map_err(|e| format!("`{name}`: {e}"))?;
        // Tensors may share a storage: what lies before and behind is passed over.
        let (rows, columns) = match shape[..] {
            [rows] => (rows, 1),
            [rows, columns] => (rows, columns),
            _ => return Err("expected one or two axes".to_owned()),
        };
        let (down, across) = (strides.first().copied().unwrap_or(1), strides.get(1).copied().unwrap_or(0));
        let place = |r: usize, c: usize| {
            r.checked_mul(down)?.checked_add(c.checked_mul(across)?)?.checked_add(*first)
        };
        let last =
            if rows == 0 || columns == 0 { Some(0) } else { place(rows - 1, columns - 1).map(|k| k + 1) };
        let count = last
            .filter(|n| *n <= entry.size() as usize)
            .ok_or("expected a tensor within its storage, found more")?;
        let numbers = Numbers { kind: *kind, big_endian: false };
        let values = numbers.read(&mut entry, count).map_err(|e| format!("`{name}`: {e}"))?;
        let places = (0..rows).flat_map(|r| (0..columns).map(move |c| r * down + c * across + first));
        Ok(match values {
            Values::Float(x) => Values::Float(places.map(|k| x[k]).collect()),
            Values::Whole(x) => Values::Whole(places.map(|k| x[k]).collect()),
        })
    }
}

/// Tells of the tensors in dictionaries, named by their keys.
fn collect(value: &Value, path: &str, depth: usize, found: &mut impl FnMut(String, Tensor)) {
    let below = |key: &str| if path.is_empty() { key.to_owned() } else { format!("{path}/{key}") };
    match value {
        Value::Tensor(tensor) => {
            found(if path.is_empty() { "tensor".to_owned() } else { path.to_owned() }, tensor.clone())
        }
        Value::Dict(entries) if depth < MAX_DEPTH => {
            for (key, value) in entries {
                if let Value::Text(key) = key {
                    collect(value, &below(key), depth + 1, found);
                }
            }
        }
        _ => {}
    }
}

/// What a pickle puts together. Texts are shared: a pickle may refer to one again and again.
#[derive(Clone, Debug, PartialEq)]
enum Value {
    Mark,
    Number(i64),
    Text(Arc<str>),
    /// Tuples and lists.
    List(Vec<Value>),
    Dict(Vec<(Value, Value)>),
    /// A name of Python, which is not looked up.
    Name(Arc<str>),
    Storage(Kind, Arc<str>),
    Tensor(Tensor),
    /// Whatever does not matter.
    Other,
}

/// Follows a pickle.
fn read_pickle(bytes: &[u8]) -> Result<Value, String> {
    let mut machine = Machine { bytes, at: 0, stack: Vec::new(), memo: Vec::new(), made: 0 };
    loop {
        if let Some(result) = machine.step()? {
            return Ok(result);
        }
    }
}

struct Machine<'a> {
    bytes: &'a [u8],
    at: usize,
    stack: Vec<Value>,
    memo: Vec<Value>,
    made: usize,
}

impl Machine<'_> {
    fn take(&mut self, count: usize) -> Result<&[u8], String> {
        let end = self.at.checked_add(count).filter(|end| *end <= self.bytes.len());
        let end = end.ok_or("expected a pickle, found its end")?;
        let part = &self.bytes[self.at..end];
        self.at = end;
        Ok(part)
    }

    fn number(&mut self, size: usize) -> Result<usize, String> {
        let part = self.take(size)?;
        Ok(part.iter().rev().fold(0, |sum, byte| sum << 8 | usize::from(*byte)))
    }

    fn line(&mut self) -> Result<String, String> {
        let rest = &self.bytes[self.at..];
        let end = rest.iter().position(|b| *b == b'\n').ok_or("expected a pickle, found its end")?;
        let line = String::from_utf8_lossy(&rest[..end]).into_owned();
        self.at += end + 1;
        Ok(line)
    }

    fn text(&mut self, size: usize) -> Result<Value, String> {
        let length = self.number(size)?;
        Ok(Value::Text(String::from_utf8_lossy(self.take(length)?).into()))
    }

    fn push(&mut self, value: Value) -> Result<(), String> {
        self.made += 1;
        if self.made > MAX_VALUES {
            return Err(format!("expected a pickle of at most {MAX_VALUES} values, found more"));
        }
        self.stack.push(value);
        Ok(())
    }

    fn pop(&mut self) -> Value {
        self.stack.pop().unwrap_or(Value::Other)
    }

    /// The values since the last mark.
    fn marked(&mut self) -> Vec<Value> {
        let at = self.stack.iter().rposition(|v| *v == Value::Mark).unwrap_or(0);
        let values = self.stack.split_off(at);
        values.into_iter().filter(|v| *v != Value::Mark).collect()
    }

    fn remember(&mut self, place: usize) -> Result<(), String> {
        if place > MAX_VALUES {
            return Err(format!("expected at most {MAX_VALUES} values, found more"));
        }
        // What is large is not referred to a second time in files of tensors.
        let value = match self.stack.last() {
            Some(Value::Dict(_) | Value::List(_)) | None => Value::Other,
            Some(value) => value.clone(),
        };
        if place >= self.memo.len() {
            self.memo.resize(place + 1, Value::Other);
        }
        self.memo[place] = value;
        Ok(())
    }

    fn recall(&mut self, place: usize) -> Result<(), String> {
        let value = self.memo.get(place).cloned().unwrap_or(Value::Other);
        self.push(value)
    }

    /// Follows one step; the value at the end.
    fn step(&mut self) -> Result<Option<Value>, String> {
        match self.number(1)? as u8 {
            b'.' => return Ok(Some(self.pop())),
            0x80 => {
                self.take(1)?;
            }
            0x95 => {
                self.take(8)?;
            }
            b'(' => self.push(Value::Mark)?,
            b'0' => {
                self.pop();
            }
            b'}' => self.push(Value::Dict(Vec::new()))?,
            b']' | b')' => self.push(Value::List(Vec::new()))?,
            b'N' | 0x88 | 0x89 => self.push(Value::Other)?,
            b'J' => {
                let number = self.number(4)? as u32 as i32;
                self.push(Value::Number(i64::from(number)))?;
            }
            b'K' => {
                let number = self.number(1)? as i64;
                self.push(Value::Number(number))?;
            }
            b'M' => {
                let number = self.number(2)? as i64;
                self.push(Value::Number(number))?;
            }
            0x8a => {
                let length = self.number(1)?;
                let number =
                    if length <= 8 { self.number(length)? as i64 } else { self.take(length).map(|_| -1)? };
                self.push(Value::Number(number))?;
            }
            b'G' => {
                self.take(8)?;
                self.push(Value::Other)?;
            }
            b'X' => {
                let text = self.text(4)?;
                self.push(text)?;
            }
            0x8c => {
                let text = self.text(1)?;
                self.push(text)?;
            }
            b'c' => {
                let name = format!("{}.{}", self.line()?, self.line()?);
                self.push(Value::Name(name.into()))?;
            }
            0x93 => {
                let (name, module) = (self.pop(), self.pop());
                let value = match (module, name) {
                    (Value::Text(module), Value::Text(name)) => {
                        Value::Name(format!("{module}.{name}").into())
                    }
                    _ => Value::Other,
                };
                self.push(value)?;
            }
            b'q' => {
                let place = self.number(1)?;
                self.remember(place)?;
            }
            b'r' => {
                let place = self.number(4)?;
                self.remember(place)?;
            }
            0x94 => self.remember(self.memo.len())?,
            b'h' => {
                let place = self.number(1)?;
                self.recall(place)?;
            }
            b'j' => {
                let place = self.number(4)?;
                self.recall(place)?;
            }
            b't' | b'l' => {
                let values = self.marked();
                self.push(Value::List(values))?;
            }
            count @ 0x85..=0x87 => {
                let from = self.stack.len().saturating_sub(usize::from(count - 0x84));
                let values = self.stack.split_off(from);
                self.push(Value::List(values))?;
            }
            b'Q' => {
                let id = self.pop();
                self.push(storage_of(id))?;
            }
            b'R' => {
                let (arguments, name) = (self.pop(), self.pop());
                self.push(called(&name, arguments))?;
            }
            b'a' => {
                let value = self.pop();
                if let Some(Value::List(list)) = self.stack.last_mut() {
                    list.push(value);
                }
            }
            b'e' => {
                let values = self.marked();
                if let Some(Value::List(list)) = self.stack.last_mut() {
                    list.extend(values);
                }
            }
            b's' => {
                let (value, key) = (self.pop(), self.pop());
                if let Some(Value::Dict(dict)) = self.stack.last_mut() {
                    dict.push((key, value));
                }
            }
            b'u' => {
                let mut values = self.marked().into_iter();
                if let Some(Value::Dict(dict)) = self.stack.last_mut() {
                    while let (Some(key), Some(value)) = (values.next(), values.next()) {
                        dict.push((key, value));
                    }
                }
            }
            // The state of an object, which is none of ours.
            b'b' => {
                self.pop();
            }
            other => return Err(format!("expected a pickle of tensors, found the step {other:#04x}")),
        }
        Ok(None)
    }
}

/// `('storage', type, name, device, length)`.
fn storage_of(id: Value) -> Value {
    let Value::List(parts) = id else { return Value::Other };
    let [Value::Text(what), Value::Name(kind), Value::Text(name), ..] = &parts[..] else {
        return Value::Other;
    };
    let kind = match kind.rsplit('.').next().unwrap_or_default() {
        "FloatStorage" => Kind::Single,
        "DoubleStorage" => Kind::Double,
        "HalfStorage" => Kind::Half,
        "LongStorage" => Kind::Signed(8),
        "IntStorage" => Kind::Signed(4),
        "ShortStorage" => Kind::Signed(2),
        "CharStorage" => Kind::Signed(1),
        "ByteStorage" => Kind::Unsigned(1),
        "BoolStorage" => Kind::Bool,
        _ => return Value::Other,
    };
    if &**what == "storage" { Value::Storage(kind, name.clone()) } else { Value::Other }
}

/// What a call gives, of the calls that put tensors together.
fn called(name: &Value, arguments: Value) -> Value {
    let (Value::Name(name), Value::List(arguments)) = (name, arguments) else { return Value::Other };
    if &**name == "collections.OrderedDict" {
        return Value::Dict(Vec::new());
    }
    let numbers = |value: &Value| match value {
        Value::List(list) => list
            .iter()
            .map(|v| match v {
                Value::Number(n) => usize::try_from(*n).ok(),
                _ => None,
            })
            .collect::<Option<Vec<usize>>>(),
        _ => None,
    };
    match (&**name, &arguments[..]) {
        (
            "torch._utils._rebuild_tensor_v2",
            [Value::Storage(kind, storage), Value::Number(first), shape, strides, ..],
        ) => match (usize::try_from(*first), numbers(shape), numbers(strides)) {
            (Ok(first), Some(shape), Some(strides))
                if shape.len() == strides.len() && shape.len() <= MAX_AXES =>
            {
                Value::Tensor(Tensor { kind: *kind, storage: storage.clone(), first, shape, strides })
            }
            _ => Value::Other,
        },
        // A parameter is the tensor that it holds.
        ("torch._utils._rebuild_parameter", [tensor @ Value::Tensor(_), ..]) => tensor.clone(),
        _ => Value::Other,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_call_of_anything_else_is_passed_over() {
        // cos.system('echo'), beside a text.
        let pickle = b"\x80\x02}q\x00(X\x01\x00\x00\x00acos\nsystem\nX\x04\x00\x00\x00echo\x85RX\x01\x00\x00\x00bK\x07u.";
        let expected = Value::Dict(vec![
            (Value::Text("a".into()), Value::Other),
            (Value::Text("b".into()), Value::Number(7)),
        ]);
        assert_eq!(read_pickle(pickle).unwrap(), expected);
        for end in 0..pickle.len() - 1 {
            read_pickle(&pickle[..end]).unwrap_err();
        }
    }
}
