//! Writes the report of a synthetic six-joint identification: `cargo run --example demo -- report.html`.

mod synthetic;

use std::error::Error;

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let path = arguments.next().ok_or("usage: demo PATH [JOINTS [SAMPLES]]")?;
    let joints = arguments.next().map_or(Ok(6), |text| text.parse())?;
    let samples = arguments.next().map_or(Ok(8000), |text| text.parse())?;
    std::fs::write(path, dynid_report::render(&synthetic::report(joints, samples))?)?;
    Ok(())
}
