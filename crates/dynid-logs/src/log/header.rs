//! Columns of a log as they can be asked for.

use super::format::LogFormat;

/// Columns of a log as they can be asked for.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct LogHeader {
    /// Names, each once. Cells with lists count as a column per entry, `positions[0]`, `positions[1]`, ...
    pub names: Vec<String>,
    /// Per column, the name that the file has for it where that differs; else empty.
    pub in_file: Vec<String>,
    /// Per column, whether it holds texts and no numbers.
    pub text: Vec<bool>,
    /// The tool that wrote the log, if it was recognised.
    pub format: Option<LogFormat>,
    /// Columns that the format has for the time; empty: found by name.
    pub time: Vec<usize>,
    /// The file has no header and no names were stated for it.
    pub unnamed: bool,
}

impl From<&[String]> for LogHeader {
    fn from(names: &[String]) -> Self {
        LogHeader::of_names(names)
    }
}

impl From<&Vec<String>> for LogHeader {
    fn from(names: &Vec<String>) -> Self {
        LogHeader::of_names(names)
    }
}

impl LogHeader {
    /// A header of names alone, whose format is recognised by them.
    pub fn of_names(names: &[String]) -> Self {
        let format = LogFormat::of_names(names);
        let mut header = LogHeader {
            names: names.to_vec(),
            in_file: vec![String::new(); names.len()],
            text: vec![false; names.len()],
            format,
            time: Vec::new(),
            unnamed: false,
        };
        let known = format.map_or(&[][..], LogFormat::time_names);
        header.time = known.iter().find_map(|n| header.column(n)).into_iter().collect();
        header
    }

    /// The column with a name, its own or that of the file.
    pub fn column(&self, name: &str) -> Option<usize> {
        let own = self.names.iter().position(|n| n == name);
        own.or_else(|| self.in_file.iter().position(|n| !n.is_empty() && n == name))
    }

    /// The header without some of its columns, and the places that the others had.
    #[must_use]
    pub fn without(&self, ignored: &[String]) -> Self {
        let is_ignored = |k: &usize| {
            ignored.contains(&self.names[*k])
                || (!self.in_file[*k].is_empty() && ignored.contains(&self.in_file[*k]))
        };
        let kept: Vec<usize> = (0..self.names.len()).filter(|k| !is_ignored(k)).collect();
        let place = |k: &usize| kept.iter().position(|other| other == k);
        LogHeader {
            names: kept.iter().map(|k| self.names[*k].clone()).collect(),
            in_file: kept.iter().map(|k| self.in_file[*k].clone()).collect(),
            text: kept.iter().map(|k| self.text[*k]).collect(),
            time: self.time.iter().filter_map(place).collect(),
            ..*self
        }
    }
}
