//! All tests of the crate from outside, in one program: each program would be linked against everything again.

mod broken_files;
mod log_files;
mod log_formats;
mod logs;
mod playback;
mod trajectory_files;
mod trajectory_tables;
