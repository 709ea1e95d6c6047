//! `dynid validate`.

use dynid::estimate::{Estimate, FitValues, LogFit};
use dynid::validate::{log_fit, validate};
use dynid_terminal::message::{Failure, Notes, data, json};
use dynid_terminal::progress::Progress;

use super::{Reading, table};
use crate::args::ValidateArgs;

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
    let progress = Progress::new(args.print.quiet);
    progress.doing("predicting logs");
    let validation =
        validate(&estimate, split, &args.estimate, &logs, &reading.columns, motor_side, args.filter_hz)
            .map_err(|e| reading.named(e))?;
    drop(progress);
    Notes::new(args.print.quiet).warnings(&validation.warnings);
    let fits: Vec<_> = validation.agreements.iter().map(log_fit).collect();
    let beyond: Vec<&LogFit> = fits.iter().filter(|fit| is_beyond(fit, args.max_error)).collect();
    let code = u8::from(!beyond.is_empty());
    if args.print.json {
        json(&fits)?;
        return Ok(code);
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
    if let Some(limit) = args.max_error {
        out.push_str(&match beyond.as_slice() {
            [] => format!("ok: no filtered error above {limit} %\n"),
            beyond => {
                let logs: Vec<&str> = beyond.iter().map(|fit| fit.log.as_str()).collect();
                format!("fail: filtered error above {limit} % on {}\n", logs.join(", "))
            }
        });
    }
    data(&out)?;
    Ok(code)
}

/// Whether the error on a log does not keep within the limit; one that cannot be told does not.
fn is_beyond(fit: &LogFit, limit: Option<f64>) -> bool {
    limit.is_some_and(|limit| fit.filtered.relative_error.is_none_or(|error| error > limit))
}
