//! Orders in which publications print the coefficients of Fourier series.

use std::fmt;
use std::str::FromStr;

use super::TrajectoryError;
use super::error::check_count;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Part {
    Offset,
    Sines,
    Cosines,
    /// `a1, b1, a2, b2, ..`
    SinesAndCosines,
    /// `b1, a1, b2, a2, ..`
    CosinesAndSines,
}

impl Part {
    fn name(self) -> &'static str {
        match self {
            Part::Offset => "q0",
            Part::Sines => "a",
            Part::Cosines => "b",
            Part::SinesAndCosines => "ab",
            Part::CosinesAndSines => "ba",
        }
    }

    fn entries(self, harmonics: usize) -> usize {
        match self {
            Part::Offset => 1,
            Part::Sines | Part::Cosines => harmonics,
            Part::SinesAndCosines | Part::CosinesAndSines => 2 * harmonics,
        }
    }
}

/// Order of the `2 L + 1` coefficients of a row: offset `q0`, sine amplitudes `a`, cosine amplitudes `b`.
///
/// Parsed from text: parts separated by commas, in any order. A block is `a`, `a..` or `a1..a5`; pairs are `ab` or
/// `a1,b1,..,a5,b5`; likewise `b` and `ba`. Examples: `q0,a,b` (default), `a1..a5,b1..b5,q0`, `a1,b1,..,a5,b5,q0`,
/// `q0,ab`. A number of harmonics that the text states is checked against the rows.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RowOrder {
    parts: Vec<Part>,
    harmonics: Option<usize>,
}

impl Default for RowOrder {
    fn default() -> Self {
        RowOrder { parts: vec![Part::Offset, Part::Sines, Part::Cosines], harmonics: None }
    }
}

impl fmt::Display for RowOrder {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let names: Vec<&str> = self.parts.iter().map(|p| p.name()).collect();
        f.write_str(&names.join(","))
    }
}

/// A piece of the text between commas: `a3`, or dots.
#[derive(Clone, Copy, PartialEq)]
enum Piece {
    Numbered(char, usize),
    Dots,
}

impl FromStr for RowOrder {
    type Err = TrajectoryError;

    fn from_str(text: &str) -> Result<Self, TrajectoryError> {
        parse(text).ok_or_else(|| TrajectoryError::Order { found: text.chars().take(60).collect() })
    }
}

fn parse(text: &str) -> Option<RowOrder> {
    let tokens: Vec<String> =
        text.split(',').map(|t| t.replace(char::is_whitespace, "").replace('…', "..")).collect();
    let mut parts = Vec::new();
    let mut counts = Vec::new();
    let mut k = 0;
    while k < tokens.len() {
        let token = tokens[k].as_str();
        k += 1;
        parts.push(match token {
            "q0" => Part::Offset,
            "a" | "a.." => Part::Sines,
            "b" | "b.." => Part::Cosines,
            "ab" | "ab.." => Part::SinesAndCosines,
            "ba" | "ba.." => Part::CosinesAndSines,
            _ => {
                let (part, last) = if let Some((first, last)) = token.split_once("..") {
                    block(numbered(first)?, numbered(last)?)?
                } else {
                    let run = listed(&tokens[k - 1..]);
                    k += run.len().checked_sub(1)?;
                    run_of(&run)?
                };
                counts.push(last);
                part
            }
        });
    }
    let harmonics = counts.first().copied();
    let complete = |one: Part| {
        let has = |p: Part| parts.iter().filter(|x| **x == p).count();
        has(one) + has(Part::SinesAndCosines) + has(Part::CosinesAndSines) == 1
    };
    let once = parts.iter().filter(|p| **p == Part::Offset).count() == 1;
    (once && complete(Part::Sines) && complete(Part::Cosines) && counts.iter().all(|c| Some(*c) == harmonics))
        .then_some(RowOrder { parts, harmonics })
}

fn numbered(token: &str) -> Option<Piece> {
    let letter = token.chars().next().filter(|c| matches!(c, 'a' | 'b'))?;
    let number = token[1..].parse().ok().filter(|n| *n > 0)?;
    Some(Piece::Numbered(letter, number))
}

fn block(first: Piece, last: Piece) -> Option<(Part, usize)> {
    match (first, last) {
        (Piece::Numbered('a', 1), Piece::Numbered('a', n)) => Some((Part::Sines, n)),
        (Piece::Numbered('b', 1), Piece::Numbered('b', n)) => Some((Part::Cosines, n)),
        _ => None,
    }
}

/// The numbered tokens at the start, up to where `a1, a2, ..` turns to `b1, b2, ..` (or the other way round).
fn listed(tokens: &[String]) -> Vec<Piece> {
    let pieces: Vec<Piece> =
        tokens.iter().map_while(|t| if t == ".." { Some(Piece::Dots) } else { numbered(t) }).collect();
    let letter = |p: &Piece| match p {
        Piece::Numbered(letter, _) => Some(*letter),
        Piece::Dots => None,
    };
    let paired = pieces.get(1).is_some_and(|p| letter(p).is_some() && letter(p) != letter(&pieces[0]));
    if paired {
        return pieces;
    }
    let first = pieces.first().and_then(letter);
    pieces.iter().take_while(|p| letter(p).is_none() || letter(p) == first).copied().collect()
}

/// What a run of numbered tokens says: every entry follows from the one before, except after dots.
fn run_of(run: &[Piece]) -> Option<(Part, usize)> {
    let (first, second) = (*run.first()?, run.get(1));
    let paired = matches!((first, second), (Piece::Numbered(x, _), Some(Piece::Numbered(y, _))) if x != *y);
    let Piece::Numbered(lead, 1) = first else { return None };
    let other = if lead == 'a' { 'b' } else { 'a' };
    let (mut letter, mut number, mut skipped) = (lead, 1, false);
    for piece in &run[1..] {
        match *piece {
            Piece::Dots => skipped = true,
            Piece::Numbered(l, n) => {
                let next = match (paired, letter == lead) {
                    (true, true) => (other, number),
                    (true, false) => (lead, number + 1),
                    (false, _) => (lead, number + 1),
                };
                let follows = (l, n) == next || skipped && l == next.0 && n >= next.1;
                if !follows {
                    return None;
                }
                (letter, number, skipped) = (l, n, false);
            }
        }
    }
    let part = match (paired, lead) {
        (true, 'a') => Part::SinesAndCosines,
        (true, _) => Part::CosinesAndSines,
        (false, 'a') => Part::Sines,
        (false, _) => Part::Cosines,
    };
    (!skipped && (!paired || letter == other)).then_some((part, number))
}

impl RowOrder {
    /// Offset, sine and cosine amplitudes of a row.
    pub(super) fn split(&self, row: &[f64]) -> Result<(f64, Vec<f64>, Vec<f64>), TrajectoryError> {
        if row.len().is_multiple_of(2) {
            return Err(TrajectoryError::RowLength { found: row.len() });
        }
        let harmonics = row.len() / 2;
        self.check(harmonics)?;
        let (mut offset, mut a, mut b) = (0.0, Vec::new(), Vec::new());
        let mut rest = row;
        for part in &self.parts {
            let (own, others) = rest.split_at(part.entries(harmonics));
            rest = others;
            let every_second = |from: usize| own.iter().skip(from).step_by(2).copied();
            match part {
                Part::Offset => offset = own[0],
                Part::Sines => a.extend(own),
                Part::Cosines => b.extend(own),
                Part::SinesAndCosines => {
                    a.extend(every_second(0));
                    b.extend(every_second(1));
                }
                Part::CosinesAndSines => {
                    b.extend(every_second(0));
                    a.extend(every_second(1));
                }
            }
        }
        Ok((offset, a, b))
    }

    /// The row that [`Self::split`] takes apart; `a` and `b` are of one length.
    pub(super) fn join(&self, offset: f64, a: &[f64], b: &[f64]) -> Result<Vec<f64>, TrajectoryError> {
        self.check(a.len())?;
        let mut row = Vec::with_capacity(2 * a.len() + 1);
        let pairs = |row: &mut Vec<f64>, x: &[f64], y: &[f64]| {
            row.extend(x.iter().zip(y).flat_map(|(x, y)| [*x, *y]));
        };
        for part in &self.parts {
            match part {
                Part::Offset => row.push(offset),
                Part::Sines => row.extend(a),
                Part::Cosines => row.extend(b),
                Part::SinesAndCosines => pairs(&mut row, a, b),
                Part::CosinesAndSines => pairs(&mut row, b, a),
            }
        }
        Ok(row)
    }

    fn check(&self, harmonics: usize) -> Result<(), TrajectoryError> {
        check_count("harmonics in a row of coefficients", self.harmonics.unwrap_or(harmonics), harmonics)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_ways_to_write_an_order_are_understood() {
        let row = [1.0, 2.0, 3.0, 4.0, 5.0];
        let cases: [(&str, f64, [f64; 2], [f64; 2]); 10] = [
            ("q0,a,b", 1.0, [2.0, 3.0], [4.0, 5.0]),
            ("q0, a.., b..", 1.0, [2.0, 3.0], [4.0, 5.0]),
            ("a1..a2,b1..b2,q0", 5.0, [1.0, 2.0], [3.0, 4.0]),
            ("a1,a2,b1,b2,q0", 5.0, [1.0, 2.0], [3.0, 4.0]),
            ("a1,b1,..,a2,b2,q0", 5.0, [1.0, 3.0], [2.0, 4.0]),
            ("a1,b1,a2,b2,q0", 5.0, [1.0, 3.0], [2.0, 4.0]),
            ("q0,ab", 1.0, [2.0, 4.0], [3.0, 5.0]),
            ("ba,q0", 5.0, [2.0, 4.0], [1.0, 3.0]),
            ("b,q0,a", 3.0, [4.0, 5.0], [1.0, 2.0]),
            ("b1…b2,a1…a2,q0", 5.0, [3.0, 4.0], [1.0, 2.0]),
        ];
        for (text, offset, a, b) in cases {
            let order: RowOrder = text.parse().unwrap();
            let split = order.split(&row).unwrap();
            assert_eq!(split, (offset, a.to_vec(), b.to_vec()), "{text}");
            assert_eq!(order.join(split.0, &split.1, &split.2).unwrap(), row, "{text}");
            assert_eq!(order.to_string().parse::<RowOrder>().unwrap().split(&row).unwrap(), split, "{text}");
        }
    }

    #[test]
    fn orders_without_sense_are_refused() {
        for text in [
            "",
            "q0",
            "q0,a",
            "q0,a,b,b",
            "q0,a,ab",
            "a,b",
            "q0,q0,a,b",
            "q0,a2..a5,b1..b5",
            "q0,a1..a5,b1..b4",
            "q0,a1,b2",
            "q0,a1,b1,a2",
            "q0,a1,a3,b1,b3",
            "q0,a1,..,b1",
            "q0,x,b",
            "q0,a0..a5,b",
            "q0,a1..b5",
            "q0,a1..a99999999999999999999,b",
        ] {
            assert!(text.parse::<RowOrder>().is_err(), "{text}");
        }
        let five: RowOrder = "q0,a1..a5,b1..b5".parse().unwrap();
        assert!(matches!(five.split(&[0.0; 5]), Err(TrajectoryError::Count { expected: 5, found: 2, .. })));
        assert!(matches!(five.split(&[0.0; 10]), Err(TrajectoryError::RowLength { found: 10 })));
        assert!(matches!(RowOrder::default().split(&[]), Err(TrajectoryError::RowLength { found: 0 })));
    }
}
