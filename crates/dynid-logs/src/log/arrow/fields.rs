//! Fields of a table: which columns they make, and where their numbers lie in a batch.

use planus::{Result as Read, Vector};
use polars_arrow_format::ipc::{FieldRef, Precision, TypeRef};

use super::wrong;
use crate::log::arrays::Holds;
use crate::log::binary::Kind;

/// Deepest nesting of fields.
const MAX_DEPTH: usize = 32;
/// Most fields.
const MAX_FIELDS: usize = 100_000;

/// What a column is made of, and where its numbers lie among the buffers of a batch.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kept {
    Numbers(Numbers),
    /// Lists of numbers: `width` where they have one length by their kind, else the buffer of their offsets.
    Lists {
        width: Option<usize>,
        valid: usize,
        offsets: Option<Offsets>,
        inner: Numbers,
    },
    Texts,
    /// Lists of lists, dictionaries, unions.
    Other,
}

/// Numbers of a field.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Numbers {
    pub(super) kind: Kind,
    /// Node that says how many they are.
    pub(super) node: usize,
    /// Buffer of the bits that say which are there; that of the numbers comes next.
    pub(super) valid: usize,
}

/// Where lists begin.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Offsets {
    pub(super) buffer: usize,
    pub(super) long: bool,
}

/// A column.
#[derive(Clone, Debug)]
pub(super) struct Column {
    pub(super) name: String,
    pub(super) kept: Kept,
    /// Columns of texts before it that have more buffers than the two counted for each, batch by batch another number.
    pub(super) views: usize,
}

impl Column {
    pub(super) fn holds(&self) -> Holds {
        if self.kept == Kept::Texts { Holds::Texts } else { Holds::Numbers }
    }
}

/// The walk over the fields, in the order of nodes and buffers of a batch.
#[derive(Default)]
struct Walk {
    columns: Vec<Column>,
    nodes: usize,
    buffers: usize,
    views: usize,
    /// Whether places are unknown: so many buffers as a kind that is not known has are stepped over by nobody.
    lost: bool,
}

/// Columns of a table.
///
/// # Errors
/// The description is damaged, or larger than any log's.
pub(super) fn columns(fields: Option<Vector<'_, Read<FieldRef<'_>>>>) -> Result<Vec<Column>, String> {
    let mut walk = Walk::default();
    for field in fields.into_iter().flatten() {
        walk.field(&field.map_err(wrong)?, "", 0)?;
    }
    Ok(walk.columns)
}

impl Walk {
    /// Steps over so many nodes and buffers; the places of the first ones.
    fn take(&mut self, buffers: usize) -> (usize, usize) {
        let at = (self.nodes, self.buffers);
        self.nodes += 1;
        self.buffers += buffers;
        at
    }

    fn add(&mut self, name: &str, kept: Kept) -> Result<(), String> {
        if self.columns.len() >= MAX_FIELDS {
            return Err(format!("expected at most {MAX_FIELDS} fields, found more"));
        }
        let kept = if self.lost { Kept::Other } else { kept };
        self.columns.push(Column { name: name.to_owned(), kept, views: self.views });
        Ok(())
    }

    fn field(&mut self, field: &FieldRef<'_>, above: &str, depth: usize) -> Result<(), String> {
        let own = field.name().map_err(wrong)?.unwrap_or_default();
        let name = if above.is_empty() { own.to_owned() } else { format!("{above}/{own}") };
        if depth > MAX_DEPTH {
            return Err(format!("expected at most {MAX_DEPTH} levels of fields, found more"));
        }
        let of_type = field.type_().map_err(wrong)?;
        // Numbers of a dictionary stand for what is in it.
        if field.dictionary().map_err(wrong)?.is_some() {
            self.take(2);
            return self.add(&name, Kept::Texts);
        }
        if let Some(kind) = of_type.as_ref().map(kind).transpose()?.flatten() {
            let (node, valid) = self.take(2);
            return self.add(&name, Kept::Numbers(Numbers { kind, node, valid }));
        }
        match of_type {
            Some(TypeRef::Struct(_)) => {
                self.take(1);
                for child in children(field)? {
                    self.field(&child, &name, depth + 1)?;
                }
                Ok(())
            }
            Some(TypeRef::FixedSizeList(list)) => {
                let width = usize::try_from(list.list_size().map_err(wrong)?).map_err(|e| e.to_string())?;
                let (_, valid) = self.take(1);
                self.list(field, &name, depth, (Some(width), valid, None))
            }
            Some(TypeRef::List(_)) => {
                let (_, valid) = self.take(2);
                self.list(
                    field,
                    &name,
                    depth,
                    (None, valid, Some(Offsets { buffer: valid + 1, long: false })),
                )
            }
            Some(TypeRef::LargeList(_)) => {
                let (_, valid) = self.take(2);
                self.list(field, &name, depth, (None, valid, Some(Offsets { buffer: valid + 1, long: true })))
            }
            other => self.passed(field, other, &name, depth),
        }
    }

    /// A list, of numbers if it is one of those.
    fn list(
        &mut self,
        field: &FieldRef<'_>,
        name: &str,
        depth: usize,
        (width, valid, offsets): (Option<usize>, usize, Option<Offsets>),
    ) -> Result<(), String> {
        let before = self.columns.len();
        for child in children(field)? {
            self.field(&child, name, depth + 1)?;
        }
        let inner = self.columns.split_off(before);
        let kept = match inner.as_slice() {
            [Column { kept: Kept::Numbers(inner), .. }] => {
                Kept::Lists { width, valid, offsets, inner: *inner }
            }
            _ => Kept::Other,
        };
        self.add(name, kept)
    }

    /// A field without numbers: what it takes of the nodes and buffers is stepped over.
    fn passed(
        &mut self,
        field: &FieldRef<'_>,
        of_type: Option<TypeRef<'_>>,
        name: &str,
        depth: usize,
    ) -> Result<(), String> {
        let (buffers, kept) = match of_type {
            Some(TypeRef::Null(_)) => (0, Kept::Other),
            Some(TypeRef::Utf8(_) | TypeRef::LargeUtf8(_) | TypeRef::Binary(_) | TypeRef::LargeBinary(_)) => {
                (3, Kept::Texts)
            }
            Some(TypeRef::FixedSizeBinary(_)) => (2, Kept::Texts),
            Some(TypeRef::Decimal(_) | TypeRef::Interval(_)) => (2, Kept::Other),
            Some(TypeRef::Map(_)) => (2, Kept::Other),
            Some(TypeRef::ListView(_) | TypeRef::LargeListView(_)) => (3, Kept::Other),
            Some(TypeRef::RunEndEncoded(_)) => (0, Kept::Other),
            Some(TypeRef::Utf8View(_) | TypeRef::BinaryView(_)) => {
                self.views += 1;
                (2, Kept::Texts)
            }
            _ => {
                self.lost = true;
                (0, Kept::Other)
            }
        };
        self.take(buffers);
        let before = self.columns.len();
        for child in children(field)? {
            self.field(&child, name, depth + 1)?;
        }
        self.columns.truncate(before);
        self.add(name, kept)
    }
}

fn children<'a>(field: &FieldRef<'a>) -> Result<Vec<FieldRef<'a>>, String> {
    let children = field.children().map_err(wrong)?;
    children.into_iter().flatten().map(|child| child.map_err(wrong)).collect()
}

/// How a number of a field is kept; `None`: it holds none. Times are whole numbers of their unit.
fn kind(of_type: &TypeRef<'_>) -> Result<Option<Kind>, String> {
    Ok(Some(match of_type {
        TypeRef::Int(int) => {
            let bytes = match int.bit_width().map_err(wrong)? {
                8 => 1,
                16 => 2,
                32 => 4,
                64 => 8,
                other => return Err(format!("expected whole numbers of 8 to 64 bits, found {other}")),
            };
            if int.is_signed().map_err(wrong)? { Kind::Signed(bytes) } else { Kind::Unsigned(bytes) }
        }
        TypeRef::FloatingPoint(float) => match float.precision().map_err(wrong)? {
            Precision::Half => Kind::Half,
            Precision::Single => Kind::Single,
            Precision::Double => Kind::Double,
        },
        TypeRef::Bool(_) => Kind::Bool,
        TypeRef::Timestamp(_) | TypeRef::Duration(_) => Kind::Signed(8),
        TypeRef::Time(time) => Kind::Signed(if time.bit_width().map_err(wrong)? == 64 { 8 } else { 4 }),
        TypeRef::Date(date) => {
            use polars_arrow_format::ipc::DateUnit;
            Kind::Signed(if date.unit().map_err(wrong)? == DateUnit::Day { 4 } else { 8 })
        }
        _ => return Ok(None),
    }))
}
