//! The page of the book that holds all explanations.

use super::{Kind, all};

/// Head of the page.
const HEAD: &str = "\
# Findings, checks and verdicts

<!-- Made by `dynid explain --markdown > docs/book/src/reference/findings.md`; edit crates/dynid/src/explain instead. -->

Every word that a result is judged by, what it means and what to do. `dynid explain WORD` prints the same.
";

/// Every explanation as a page in Markdown, with its heading per word.
pub fn page() -> String {
    let mut out = HEAD.to_owned();
    for (kind, title, text) in [
        (
            Kind::Finding,
            "Findings of the pre-flight",
            "`dynid check` and `dynid identify` look for these faults in logs.",
        ),
        (
            Kind::Check,
            "Checks of an identification",
            "The verdict of `dynid identify` rests on these checks.",
        ),
        (
            Kind::Word,
            "Verdicts, statuses, severities",
            "What stands beside parameters, joints and whole results.",
        ),
    ] {
        out += &format!("\n## {title}\n\n{text}\n");
        for e in all().iter().filter(|e| e.kind == kind) {
            out += &format!("\n### `{}`\n\n{}\n\n**What to do.** {}\n", e.id, e.meaning, e.remedy);
            out += &match e.line {
                "" => String::new(),
                line if line.starts_with("dynid ") => format!("\n    {line}\n"),
                lines => format!("\n```toml run part\n{lines}\n```\n"),
            };
        }
    }
    out
}
