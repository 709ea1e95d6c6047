//! `dynid explain`.

use dynid::explain::{Explanation, Kind, all, find, nearest, page};
use dynid_terminal::message::{Failure, data, json};

use crate::args::ExplainArgs;

/// Width of a line of text, characters.
const WIDTH: usize = 100;

pub(crate) fn run(args: &ExplainArgs) -> Result<u8, Failure> {
    if args.markdown {
        data(&page())?;
        return Ok(0);
    }
    let id = args.id.join(" ");
    match (id.is_empty(), args.print.json) {
        (true, true) => json(&all())?,
        (true, false) => data(&list())?,
        (false, as_json) => {
            let found = find(&id).ok_or_else(|| unknown(&id))?;
            match as_json {
                true => json(&found)?,
                false => data(&text(&found))?,
            }
        }
    }
    Ok(0)
}

fn unknown(id: &str) -> Failure {
    Failure::Usage(
        format!("nothing is called `{id}`; the nearest word is `{}`", nearest(id)),
        "`dynid explain` lists all words",
    )
}

/// All words under their sorts, with the first sentence of what they mean.
fn list() -> String {
    let all = all();
    let width = all.iter().map(|e| e.id.len()).max().unwrap_or(0);
    let sorts = [
        (Kind::Finding, "Findings of the pre-flight"),
        (Kind::Check, "Checks of an identification"),
        (Kind::Word, "Verdicts, statuses, severities"),
    ];
    let of_sort = |(kind, title): &(Kind, &str)| {
        let line = |e: &Explanation| {
            let sentence = e.meaning.split_inclusive(['.', ':']).next().unwrap_or_default();
            format!("  {:width$}  {}\n", e.id, sentence.trim_end_matches(':'))
        };
        let lines: String = all.iter().filter(|e| e.kind == *kind).map(line).collect();
        format!("{title}\n{lines}\n")
    };
    sorts.iter().map(of_sort).collect::<String>() + "`dynid explain WORD` says more.\n"
}

fn text(e: &Explanation) -> String {
    let sort = match e.kind {
        Kind::Finding => "finding of the pre-flight",
        Kind::Check => "check of an identification",
        Kind::Word => "verdict, status or severity",
    };
    let mut out =
        format!("{} ({sort})\n\n{}\n\nWhat to do\n{}\n", e.id, wrapped(e.meaning), wrapped(e.remedy));
    if !e.line.is_empty() {
        let lines: String = e.line.lines().map(|line| format!("    {line}\n")).collect();
        out += &format!("\n{lines}");
    }
    out
}

/// A paragraph in lines of bounded width, two characters from the margin.
fn wrapped(text: &str) -> String {
    let mut lines = vec![String::from(" ")];
    for word in text.split_whitespace() {
        let line = lines.last_mut().filter(|line| line.chars().count() + 1 + word.chars().count() <= WIDTH);
        match line {
            Some(line) => *line += &format!(" {word}"),
            None => lines.push(format!("  {word}")),
        }
    }
    lines.join("\n")
}
