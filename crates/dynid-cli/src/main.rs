//! The command line program `dynid`.

fn main() {}
