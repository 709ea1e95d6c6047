//! What keeps a line from being a row.

/// What is wrong with a row; numbers are those of cells.
pub(super) enum Fault {
    FieldCount(usize),
    NotANumber(usize, String),
    NotFinite(usize, String),
    TooBig(usize, String),
    ListLength(usize, usize),
    OtherName(usize, String),
    OtherJoints(String),
    NoMessage(String),
}
