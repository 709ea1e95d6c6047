//! Writes the report of a made-up excitation design: `cargo run --example design -- report.html`.

mod synthetic;

use std::error::Error;

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let path = arguments.next().ok_or("usage: design PATH [JOINTS]")?;
    let joints = arguments.next().map_or(Ok(6), |text| text.parse())?;
    std::fs::write(path, dynid_report::render_design(&synthetic::design(joints))?)?;
    Ok(())
}
