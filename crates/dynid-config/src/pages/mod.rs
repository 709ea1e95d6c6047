//! Parts of pages that several jobs show.

mod picture;
mod settings;

pub use picture::picture;
pub use settings::{plain, settings_table};
