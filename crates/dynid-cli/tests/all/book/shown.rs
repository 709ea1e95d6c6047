//! What a page shows against what a command prints.
//!
//! A line `...` stands for any number of lines, `...` within a line for anything. Blanks count as one however many they are. Numbers with a
//! decimal point or an exponent agree to so many significant digits, since the last ones differ between processors; whole numbers agree
//! exactly.

/// Why what is printed is not what is shown; `None`: it is.
pub(super) fn difference(shown: &str, printed: &str, digits: i32) -> Option<String> {
    let printed: Vec<&str> = printed.trim().lines().map(str::trim_end).collect();
    let shown: Vec<&str> = shown.trim().lines().map(str::trim_end).collect();
    let parts: Vec<&[&str]> = shown.split(|line| line.trim() == "...").collect();
    let mut from = 0;
    for (index, part) in parts.iter().enumerate() {
        let (first, last) = (index == 0, index + 1 == parts.len());
        let latest = printed.len().checked_sub(part.len());
        let places: Vec<usize> = match latest {
            Some(latest) if first && last => (from..=latest).filter(|&at| at == 0 && at == latest).collect(),
            Some(latest) if first => (from..=latest).take(1).collect(),
            Some(latest) if last && !part.is_empty() => (latest..=latest).filter(|&at| at >= from).collect(),
            Some(latest) => (from..=latest).collect(),
            None => Vec::new(),
        };
        let fits = |at: &usize| part.iter().zip(&printed[*at..]).all(|(s, p)| line_agrees(s, p, digits));
        match places.iter().find(|at| fits(at)) {
            Some(at) => from = at + part.len(),
            None => return Some(format!("shown, but not printed there:\n{}", part.join("\n"))),
        }
    }
    None
}

#[derive(Debug, Clone, PartialEq)]
enum Token<'a> {
    Anything,
    Blank,
    Number(&'a str),
    Other(char),
}

fn line_agrees(shown: &str, printed: &str, digits: i32) -> bool {
    tokens_agree(&tokens(shown, true), &tokens(printed, false), digits)
}

fn tokens_agree(shown: &[Token<'_>], printed: &[Token<'_>], digits: i32) -> bool {
    match (shown, printed) {
        ([], []) => true,
        ([Token::Anything, rest @ ..], _) => {
            (0..=printed.len()).any(|skipped| tokens_agree(rest, &printed[skipped..], digits))
        }
        ([s, shown @ ..], [p, printed @ ..]) => {
            token_agrees(s, p, digits) && tokens_agree(shown, printed, digits)
        }
        _ => false,
    }
}

fn token_agrees(shown: &Token<'_>, printed: &Token<'_>, digits: i32) -> bool {
    match (shown, printed) {
        (Token::Number(s), Token::Number(p)) => {
            let whole = |n: &str| n.bytes().all(|b| b.is_ascii_digit());
            if s == p || whole(s) || whole(p) {
                return s == p;
            }
            let (s, p): (f64, f64) = (s.parse().unwrap(), p.parse().unwrap());
            (s - p).abs() <= 0.5 * 10f64.powi(1 - digits) * s.abs().max(p.abs())
        }
        _ => shown == printed,
    }
}

fn tokens(line: &str, wildcards: bool) -> Vec<Token<'_>> {
    let mut found = Vec::new();
    let mut rest = line.trim();
    while let Some(c) = rest.chars().next() {
        let (token, length) = if wildcards && rest.starts_with("...") {
            (Token::Anything, 3)
        } else if c.is_whitespace() {
            (Token::Blank, rest.len() - rest.trim_start().len())
        } else if c.is_ascii_digit() {
            let length = number_length(rest.as_bytes());
            (Token::Number(&rest[..length]), length)
        } else {
            (Token::Other(c), c.len_utf8())
        };
        found.push(token);
        rest = &rest[length..];
    }
    found
}

/// Bytes of the number that a text begins with: digits, a fraction, an exponent.
fn number_length(text: &[u8]) -> usize {
    let digits = |from: usize| text[from.min(text.len())..].iter().take_while(|b| b.is_ascii_digit()).count();
    let mut length = digits(0);
    if text.get(length) == Some(&b'.') && digits(length + 1) > 0 {
        length += 1 + digits(length + 1);
    }
    if matches!(text.get(length), Some(b'e' | b'E')) {
        let sign = usize::from(matches!(text.get(length + 1), Some(b'+' | b'-')));
        let exponent = digits(length + 1 + sign);
        if exponent > 0 {
            length += 1 + sign + exponent;
        }
    }
    length
}

#[test]
fn what_agrees_and_what_does_not() {
    let agrees = |shown, printed| difference(shown, printed, 3).is_none();
    assert!(agrees("a\n...\nd", "a\nb\nc\nd"));
    assert!(!agrees("a\n...\nc", "a\nb\nc\nd"));
    assert!(!agrees("a\nb", "a\nb\nc"));
    assert!(!agrees("a\nb\nc", "a\nb"));
    assert!(agrees("a\nb\n...", "a\nb\nc"));
    assert!(agrees("...\nb\n...", "a\nb\nc"));
    assert!(agrees("error 2.135 % raw", "error  2.139 % raw"));
    assert!(!agrees("error 2.135 % raw", "error 2.155 % raw"));
    assert!(!agrees("58 of 58", "57 of 58"));
    assert!(agrees("(gap ... to ...), 3", "(gap 1e-17 to 2.9e-1), 3"));
    assert!(!agrees("(gap ... to ...), 3", "(gap 1e-17 to 2.9e-1), 4"));
    assert!(!agrees("-1.5", "1.5"));
    assert!(agrees("written: 1.234e-5 N m", "written: 1.2345e-5 N m"));
}
