//! Closed mechanisms: trees with cut joints that close their loops (spec/mechanisms.md sections 9 to 14).

mod closure;

pub use closure::{ClosureDescription, Condition, CutKind, LinkFrame};
