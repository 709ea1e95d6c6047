//! `dynid diff`.

use dynid::diff::{At, ModelDiff, ParameterDiff, Side, diff};
use dynid::io::ReadOptions;
use dynid_terminal::message::{Failure, Notes, data, json};
use dynid_terminal::progress::Progress;

use super::table;
use crate::args::DiffArgs;

pub(crate) fn run(args: &DiffArgs) -> Result<u8, Failure> {
    let progress = Progress::new(args.print.quiet);
    progress.doing("comparing");
    let (a, b) = (Side::read(&args.a)?, Side::read(&args.b)?);
    let options = ReadOptions { rows: args.rows, ..ReadOptions::default() };
    let at = args.states.as_deref().map_or(At::Random, |states| At::Table(states, &options));
    let found = diff((&args.a, &a), (&args.b, &b), args.split.of(), at)?;
    drop(progress);
    match args.print.json {
        true => json(&found)?,
        false => {
            Notes::new(args.print.quiet).warnings(&found.remarks);
            data(&text(&found, args.all))?;
        }
    }
    Ok(u8::from(found.differ))
}

fn text(found: &ModelDiff, all: bool) -> String {
    let mut out = format!("a: {}\nb: {}\n\n", found.a, found.b);
    let shown: Vec<&ParameterDiff> = found.parameters.iter().filter(|p| all || p.beyond_interval).collect();
    if !shown.is_empty() {
        out += &parameters(&shown);
        out += "*: beyond its 95 % interval, as one of twenty is by chance; **: beyond what chance makes of all together\n\n";
    }
    if all && !found.not_compared.is_empty() {
        out += "not compared:\n";
        for p in &found.not_compared {
            out += &format!("  {}: {}\n", p.name, p.reason);
        }
        out += "\n";
    }
    for (names, which) in [(&found.only_in_a, "a"), (&found.only_in_b, "b")] {
        if !names.is_empty() {
            out += &format!("only in {which}: {}\n\n", names.join(", "));
        }
    }
    out += &format!("effort over {}:\n", found.effort.states);
    let rows: Vec<Vec<String>> = found
        .effort
        .joints
        .iter()
        .map(|j| {
            let numbers = [Some(j.rms_a), Some(j.rms_b), Some(j.rms_difference), j.percent, Some(j.largest)];
            std::iter::once(j.joint.clone()).chain(numbers.map(table::number)).collect()
        })
        .collect();
    out += &table::aligned(&["joint", "rms a", "rms b", "rms b - a", "%", "largest"], &rows);
    let told = match found.not_compared.len() {
        0 => String::new(),
        n => format!("; {n} parameters are told by one alone or by none"),
    };
    out + &format!(
        "\n{}: {}{told}\n",
        if found.differ { "they differ" } else { "no difference" },
        found.headline
    )
}

fn parameters(shown: &[&ParameterDiff]) -> String {
    let row = |p: &&ParameterDiff| {
        let mark = match (p.differs, p.beyond_interval) {
            (true, _) => "**",
            (false, true) => "*",
            (false, false) => "",
        };
        vec![
            p.expression.clone().unwrap_or_else(|| p.name.clone()),
            table::number(Some(p.a)),
            table::number(Some(p.b)),
            table::number(Some(p.difference)),
            table::number(Some(p.half_width)),
            p.unit.clone(),
            mark.to_owned(),
        ]
    };
    let rows: Vec<Vec<String>> = shown.iter().map(row).collect();
    table::aligned(&["parameter", "a", "b", "b - a", "± 95 %", "unit", ""], &rows)
}
