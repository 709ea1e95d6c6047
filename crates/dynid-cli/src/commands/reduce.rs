//! `dynid reduce`, `dynid merge`, `dynid solve`.

use std::fmt::Write;
use std::path::Path;

use dynid::config::Config;
use dynid::estimate::{Estimate, Status, Verdict};
use dynid::preflight::Severity;
use dynid::reduce::{self, Learned, OwnOfLogs, Reduction};
use dynid_terminal::message::{Failure, Notes, data, json};
use dynid_terminal::outputs::{self, Outputs};
use dynid_terminal::progress::Progress;
use serde_json::json;

use super::identify::summary;
use super::run::{GivenLogs, configuration};
use super::{Reading, apply_log_args_to, demand_stdout};
use crate::args::{FactorsArgs, MergeArgs, PrintArgs, ReduceArgs, SolveArgs, command_line};

pub(crate) fn run(args: &ReduceArgs) -> Result<u8, Failure> {
    if let Some(manifest) = &args.manifest {
        return super::fleet::reduce(args, manifest);
    }
    let notes = Notes::new(args.to.print.quiet);
    let follows = reduce::is_factor_file(&args.input);
    if follows && args.log.is_empty() {
        return Err(Failure::Usage(
            format!(
                "{}: expected --log beside a factor file, whose recipe is followed, found none",
                args.input.display()
            ),
            "`dynid merge` and `dynid solve` take factor files alone",
        ));
    }
    let learned = [
        (
            "--delays",
            args.delays,
            "a recipe has the columns that it was learned with: learn it with `--delays`",
        ),
        (
            "--payload",
            args.payload.is_some(),
            "a recipe has the columns that it was learned with: learn it with `--payload`",
        ),
    ];
    if let Some((flag, _, hint)) = learned.iter().find(|(_, given, _)| *given && follows) {
        let expected = "expected a robot file or a configuration, found the recipe of";
        return Err(Failure::Usage(format!("{flag}: {expected} {}", args.input.display()), hint));
    }
    if let Some(config) = args.reading.config.as_ref().filter(|_| !follows) {
        return Err(Failure::Usage(
            format!(
                "--config {}: expected a factor file beside it, found a run of its own",
                config.display()
            ),
            "give the configuration in the place of the robot file",
        ));
    }
    let inputs: Vec<&Path> = args.log.iter().chain([&args.input]).map(AsRef::as_ref).collect();
    let set = prepared(&args.to, &inputs)?;
    let progress = Progress::new(args.to.print.quiet);
    let (reduction, verdict) = if follows {
        let recipe = reduce::read(&args.input)?.recipe().clone();
        let reading = Reading::recorded(&args.reading, Some(&recipe.reading), &args.input)?;
        let logs: Vec<_> = args.log.iter().map(|path| reading.log(path)).collect();
        let motor_side = reading.motor_side.as_ref();
        let reduced =
            reduce::reduce(recipe, &logs, &reading.columns, motor_side, &mut |step| progress.step(step));
        (reduced.map_err(|e| reading.named(e))?, None)
    } else {
        let logs = GivenLogs { paths: &args.log, rows: args.reading.rows };
        let mut config: Config = configuration(&args.input, &logs, notes)?;
        apply_log_args_to(&mut config, &args.reading.columns);
        let own = OwnOfLogs { delays: args.delays, payload: args.payload.clone() };
        let Learned { reduction, estimate } = reduce::learn(&config, &own, &mut |step| progress.step(step))?;
        (reduction, Some(estimate.verdict))
    };
    drop(progress);
    let code = u8::from(verdict.as_ref().is_some_and(|v| v.status == Status::Fail));
    written(&reduction, verdict.as_ref(), set, args.to.print)?;
    Ok(code)
}

pub(crate) fn merge(args: &MergeArgs) -> Result<u8, Failure> {
    let inputs: Vec<&Path> = args.factors.iter().map(AsRef::as_ref).collect();
    let set = prepared(&args.to, &inputs)?;
    let merged = reduce::read_all(inputs.iter().copied())?;
    written(&merged, None, set, args.to.print)?;
    Ok(0)
}

pub(crate) fn solve(args: &SolveArgs) -> Result<u8, Failure> {
    let notes = Notes::new(args.print.quiet);
    let factors: Vec<&Path> = args.factors.iter().map(AsRef::as_ref).collect();
    let inputs: Vec<&Path> = args.validate.iter().map(AsRef::as_ref).chain(factors.iter().copied()).collect();
    let files = ["estimate.json", "report.html"].map(|name| args.out.join(name));
    let set = outputs::prepare_folder(&files, &inputs, args.force)?;
    let progress = Progress::new(args.print.quiet);
    progress.doing("reading");
    let reduction = reduce::read_all(factors.iter().copied())?;
    let reading = Reading::recorded(&args.reading, Some(&reduction.recipe().reading), factors[0])?;
    let logs: Vec<_> = args.validate.iter().map(|path| reading.log(path)).collect();
    let side = reading.motor_side.as_ref();
    let solved = reduce::solve(&reduction, &logs, &reading.columns, side, &mut |step| progress.step(step));
    let solved = solved.map_err(|e| reading.named(e))?;
    let mut estimate: Estimate = reduce::estimate(&solved, reduction.recipe());
    estimate.provenance.command_line = command_line();
    estimate.provenance.revision = option_env!("DYNID_REVISION").map(str::to_owned);
    let page = dynid::report_page(&solved, &estimate)?;
    drop(progress);
    let text = estimate.to_json();
    set.write(0, text.as_bytes())?;
    set.write(1, page.as_bytes())?;
    let written = set.publish()?;
    notes.warnings(&estimate.verdict.warnings);
    data(&if args.print.json { text } else { summary(&estimate) })?;
    notes.written(&written);
    notes.tell("`dynid export` puts the result into a robot file, `dynid validate` compares it with a log");
    Ok(u8::from(estimate.verdict.status == Status::Fail))
}

/// The factor file that a command is about to write.
fn prepared(to: &FactorsArgs, inputs: &[&Path]) -> Result<Outputs, Failure> {
    let set = outputs::prepare_files(&[("--out", &to.out)], inputs, to.force)?;
    demand_stdout(to.print, &set)?;
    Ok(set)
}

/// Writes factors and tells what they are of. `verdict`: of the identification that taught their recipe.
fn written(
    reduction: &Reduction,
    verdict: Option<&Verdict>,
    set: Outputs,
    print: PrintArgs,
) -> Result<(), Failure> {
    let notes = Notes::new(print.quiet);
    let taken = set.take_stdout();
    set.write(0, &reduction.to_bytes())?;
    let files = set.publish()?;
    let recipe = reduction.recipe();
    let logs = reduction.logs();
    for log in logs {
        let findings = log.facts.findings.iter().filter(|finding| finding.severity != Severity::Info);
        findings.for_each(|f| notes.tell(&format!("warning: {}: {}", log.facts.name, f.evidence)));
        log.facts.cautions.iter().for_each(|caution| notes.tell(&format!("warning: {}", caution.message)));
    }
    if print.json {
        let rows = |groups: &[dynid::estimators::groups::ReducedGroup]| {
            groups.iter().map(|g| g.rows()).sum::<usize>()
        };
        let logs: Vec<_> = logs
            .iter()
            .map(|log| {
                let facts = &log.facts;
                json!({
                    "log": facts.name, "key": log.key, "samples": facts.log.samples, "duration_s": facts.log.duration_s,
                    "rows": rows(&log.groups), "findings": facts.findings, "cautions": facts.cautions, "inputs": facts.inputs,
                })
            })
            .collect();
        json(&json!({
            "robot": recipe.robot, "recipe": recipe.hash(), "columns": recipe.all_columns(), "choices": recipe.choices,
            "logs": logs, "verdict": verdict,
        }))?;
    } else {
        let mut out = format!(
            "{}: {} columns, kernel {:.2} Hz, recipe {}\n",
            recipe.robot,
            recipe.all_columns().len(),
            recipe.choices.kernel_hz,
            &recipe.hash()[..12]
        );
        for log in logs {
            let (facts, rows) = (&log.facts, log.groups.iter().map(|g| g.rows()).sum::<usize>());
            let _ = writeln!(
                out,
                "  {}: {} samples, {:.1} s, {rows} rows, key {}",
                facts.name,
                facts.log.samples,
                facts.log.duration_s,
                &log.key[..12]
            );
        }
        if let Some(verdict) = verdict {
            let _ = writeln!(out, "learned on these logs: {}: {}", verdict.status, verdict.headline);
        }
        super::result(&out, taken, notes)?;
    }
    notes.written(&files);
    Ok(())
}
