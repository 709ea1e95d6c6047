//! `dynid clearance`.

use dynid::clearance::{JointClearance, Valued, clearance};
use dynid::estimate::Estimate;
use dynid::{Robot, RobotOptions};
use dynid_terminal::message::{Failure, data, json};
use dynid_terminal::progress::Progress;

use super::Reading;
use crate::args::ClearanceArgs;

pub(crate) fn run(args: &ClearanceArgs) -> Result<u8, Failure> {
    let robot = Robot::load(&args.robot, &RobotOptions::default())?;
    let estimate = Estimate::read(&args.estimate)?;
    let reading = Reading::of(&args.reading, &estimate, &args.estimate)?;
    let log = reading.log(&args.log);
    let motor_side = reading.motor_side.as_ref();
    let progress = Progress::new(args.print.quiet);
    progress.doing("searching clearances");
    let found = clearance(&robot, (&estimate, &args.estimate), &log, &reading.columns, motor_side)
        .map_err(|e| reading.named(e))?;
    drop(progress);
    if args.print.json {
        json(&found)?;
        return Ok(0);
    }
    data(&found.iter().map(text).collect::<String>())?;
    Ok(0)
}

/// A length in micrometres.
fn micro(of: Valued) -> String {
    format!("{:.2} ± {:.2} µm", 1e6 * of.value, 1e6 * of.std)
}

fn text(found: &JointClearance) -> String {
    let mut out = format!(
        "{}: stated gap {:.2} µm, mean load {:.2} N\n",
        found.joint,
        1e6 * found.stated_gap,
        found.load
    );
    let mut line = |text: String| out.push_str(&format!("  {text}\n"));
    if let Some(p) = &found.probed {
        line(format!(
            "probes   gap {}, friction {:.4} ± {:.4}",
            micro(p.gap),
            p.friction.value,
            p.friction.std
        ));
        line(format!(
            "         offset {} whatever the stiffness; stiffness {:.2} ± {:.2} of the law's, {:.0} % of its prior variance removed",
            micro(p.offset),
            p.stiffness.value,
            p.stiffness.value * p.stiffness.std,
            100.0 * p.stiffness_seen
        ));
        line(format!("         residual {:.2} µm over {} samples", 1e6 * p.residual, p.samples));
    }
    match &found.swing {
        Some(s) if s.found => {
            let gap = s.gap.map_or_else(|| "no gap".to_owned(), |gap| format!("gap {}", micro(gap)));
            line(format!(
                "effort   {gap}, offset {} from a swing of {:.2} Hz, {:.2e} N m rms",
                micro(s.offset),
                s.frequency_hz,
                s.amplitude
            ));
        }
        Some(_) => line("effort   no swing of the journal stands out of the noise".to_owned()),
        None => {}
    }
    if let Some(friction) = found.friction_of_fit {
        line(format!(
            "fit      Coulomb friction is {friction:.4} of load times journal radius: the friction coefficient, if all of it is the bearing's"
        ));
    }
    for remark in &found.remarks {
        line(format!("note     {remark}"));
    }
    out
}
