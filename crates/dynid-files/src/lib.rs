//! Files for all readers and writers: bytes in of bounded size, digests of what was read, pieces of foreign text for messages, and
//! outputs that appear whole or not at all.

pub mod digest;
pub mod excerpt;
pub mod input;
mod member;
pub mod output;
pub mod text;

pub use digest::SourceFile;
pub use excerpt::closest;
pub use member::FileMember;
pub use output::OutputError;
