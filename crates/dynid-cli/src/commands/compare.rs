//! `dynid compare`.

use std::path::Path;

use super::run::{GivenLogs, configuration};
use super::{apply_log_args_to, demand_stdout, result, table};
use crate::args::CompareArgs;
use dynid::compare::{ComparedEstimator, Comparison, compare};
use dynid_terminal::message::{Failure, Notes, data};
use dynid_terminal::outputs;
use dynid_terminal::progress::Progress;

pub(crate) fn run(args: &CompareArgs) -> Result<u8, Failure> {
    let notes = Notes::new(args.print.quiet);
    let mut config = configuration(&args.input, &GivenLogs { paths: &args.log, rows: args.rows }, notes)?;
    apply_log_args_to(&mut config, &args.columns);
    let outputs: Vec<(&str, &Path)> = args.report.iter().map(|p| ("--report", p.as_path())).collect();
    let logs = config.log.iter().map(|log| log.path.as_path());
    let inputs: Vec<&Path> = logs.chain([args.input.as_path(), &config.robot]).collect();
    let set = outputs::prepare_files(&outputs, &inputs, args.force)?;
    demand_stdout(args.print, &set)?;
    let progress = Progress::new(args.print.quiet);
    let found = compare(&config, &mut |done, of, what| progress.counted(done, of, what))?;
    drop(progress);
    if args.report.is_some() {
        set.write(0, found.report()?.as_bytes())?;
    }
    let taken = set.take_stdout();
    let written = set.publish()?;
    match args.print.json {
        true => data(&(found.to_json() + "\n"))?,
        false => result(&text(&found), taken, notes)?,
    }
    notes.written(&written);
    Ok(u8::from(found.estimators.iter().all(|e| e.rank.is_none())))
}

fn text(found: &Comparison) -> String {
    let row = |e: &ComparedEstimator| -> Vec<String> {
        let pair = |value: Option<[f64; 2]>| {
            value.map_or_else(|| "-".to_owned(), |[value, error]| format!("{value:.3} ± {error:.3}"))
        };
        let joints: Vec<String> = e.joints.iter().map(|j| table::number(j.map(|j| j.rms))).collect();
        vec![
            e.rank.map_or_else(|| "-".to_owned(), |r| r.to_string()),
            e.name.clone(),
            pair(e.error.zip(e.standard_error).map(|(a, b)| [a, b])),
            pair(e.behind),
            e.seconds.map_or_else(|| "-".to_owned(), |s| format!("{s:.2}")),
            e.failure.clone().unwrap_or_else(|| joints.join(" ")),
        ]
    };
    let rows: Vec<Vec<String>> = found.estimators.iter().map(row).collect();
    let head = ["rank", "estimator", "error, %", "behind, %", "s", "rms per joint"];
    let best = found.estimators.first();
    let at_rest =
        best.into_iter().flat_map(|e| found.joints.iter().zip(&e.joints)).filter_map(|(name, joint)| {
            let joint = joint.filter(|j| j.standing_share > table::STANDS)?;
            Some(format!(
                "{name} stands in {:.0} % of the samples: best estimator's rms {} moving, {} standing\n",
                100.0 * joint.standing_share,
                table::number(joint.rms_moving),
                table::number(joint.rms_standing)
            ))
        });
    format!(
        "{}\n{}held-out error through a filter of {:.1} Hz, {} folds of time: {}\n",
        table::aligned(&head, &rows).trim_end(),
        at_rest.collect::<String>(),
        found.filter_hz,
        found.folds,
        found.headline()
    )
}
