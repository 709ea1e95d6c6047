//! `dynid validate`.

use dynid::estimate::{Estimate, FitValues};
use dynid::validate::{log_fit, validate};

use super::{Reading, table};
use crate::args::ValidateArgs;
use crate::message::{Failure, data, json, note};

pub(crate) fn run(args: &ValidateArgs) -> Result<u8, Failure> {
    let estimate = Estimate::read(&args.estimate)?;
    let reading = Reading::of(&args.reading, &estimate, &args.estimate)?;
    if let Some(hz) = args.filter_hz
        && !(hz.is_finite() && hz > 0.0)
    {
        return Err(Failure::Usage(
            format!("--filter-hz: expected a positive number, found {hz}"),
            "leave it out to use the estimate's kernel cut-off",
        ));
    }
    let logs: Vec<_> = args.log.iter().map(|path| reading.log(path)).collect();
    let split = args.split.of();
    let motor_side = reading.motor_side.as_ref();
    let validation =
        validate(&estimate, split, &args.estimate, &logs, &reading.columns, motor_side, args.filter_hz)
            .map_err(|e| reading.named(e))?;
    for warning in &validation.warnings {
        note(&format!("warning: {warning}"));
    }
    let fits: Vec<_> = validation.agreements.iter().map(log_fit).collect();
    if args.json {
        json(&fits)?;
        return Ok(0);
    }
    let mut out = String::new();
    for fit in &fits {
        out.push_str(&format!(
            "{}: relative error {} % raw, {} % filtered at {:.1} Hz\n",
            fit.log,
            table::number(fit.raw.relative_error),
            table::number(fit.filtered.relative_error),
            fit.filter_hz
        ));
        let (raw, filtered): (&FitValues, &FitValues) = (&fit.raw, &fit.filtered);
        out.push_str(&table::agreement(&estimate.joints, raw, filtered, &fit.by_motion));
    }
    data(&out)?;
    Ok(0)
}
