//! What the words of results mean and what to do: one table for the command line, the book and programs.
//!
//! Names that code can print are variants of [`FindingId`], [`CheckName`] and [`Word`]; their texts are exhaustive matches, so that a new
//! name without a text does not compile.

mod checks;
mod findings;
mod page;
mod words;

pub use page::page;
use serde::Serialize;
pub use words::Word;

use crate::check::FindingId;
use crate::verdict::CheckName;

/// What sort of word is explained.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, schemars::JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Kind {
    /// What the pre-flight of a log may find.
    Finding,
    /// A check behind the verdict of an identification.
    Check,
    /// A verdict of a parameter, a status, a severity.
    Word,
}

/// What a word of a result means.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, schemars::JsonSchema)]
pub struct Explanation {
    /// The word as printed.
    pub id: &'static str,
    /// What sort of word it is.
    pub kind: Kind,
    /// What it means.
    pub meaning: &'static str,
    /// What to do.
    pub remedy: &'static str,
    /// The command, or the line of the configuration, that does it; empty if there is none.
    pub line: &'static str,
}

/// Meaning, remedy and line of a word.
struct Text(&'static str, &'static str, &'static str);

impl Text {
    fn of(self, id: &'static str, kind: Kind) -> Explanation {
        Explanation { id, kind, meaning: self.0, remedy: self.1, line: self.2 }
    }
}

/// Every explanation: findings, checks, words, each sort in the order of its names.
pub fn all() -> Vec<Explanation> {
    let findings = FindingId::ALL.iter().map(|id| findings::text(*id).of(id.word(), Kind::Finding));
    let checks = CheckName::ALL.iter().map(|name| checks::text(*name).of(name.word(), Kind::Check));
    let words = Word::ALL.iter().map(|word| words::text(*word).of(word.word(), Kind::Word));
    let mut all: Vec<Explanation> = findings.chain(checks).chain(words).collect();
    all.sort_by_key(|e| (e.kind as u8, e.id));
    all
}

/// The explanation of a word; capitals, underscores, hyphens and quotes do not matter.
pub fn find(id: &str) -> Option<Explanation> {
    all().into_iter().find(|e| plain(e.id) == plain(id))
}

/// The word that is most like an unknown one.
pub fn nearest(id: &str) -> &'static str {
    let likeness = |e: &Explanation| {
        let (name, asked) = (plain(e.id), plain(id));
        let whole = strsim::jaro_winkler(&name, &asked);
        // One word of a name says more than letters alike.
        if asked.len() > 2 && name.contains(&asked) { 1.0 + whole } else { whole }
    };
    let all = all();
    let best = all.iter().max_by(|a, b| likeness(a).total_cmp(&likeness(b)));
    best.map_or("", |e| e.id)
}

fn plain(id: &str) -> String {
    let letters = id.trim().trim_matches(['`', '"', '\'', '[', ']']).chars();
    letters.map(|c| if c == '_' || c == '-' { ' ' } else { c.to_ascii_lowercase() }).collect()
}
