//! Sentences from outside as markup.

use crate::markup::escape;

/// `text` escaped, from a capital letter to a full stop, with what stands between back-ticks as code.
pub(super) fn sentence(text: &str) -> String {
    let text = text.trim();
    let Some(first) = text.chars().next() else { return String::new() };
    // A symbol at the start keeps its case: `mx2` is not `Mx2`.
    let word = text.split(|c: char| c.is_whitespace()).next().unwrap_or_default();
    let plain = word.trim_end_matches([',', ':', ';']).chars().all(|c| c.is_lowercase() || c == '-');
    let mut sentence = if plain { first.to_uppercase().to_string() } else { first.to_string() };
    sentence.push_str(&text[first.len_utf8()..]);
    if !sentence.ends_with(['.', '!', '?']) {
        sentence.push('.');
    }
    prose(&sentence)
}

/// `text` escaped, with what stands between back-ticks as code.
pub(super) fn prose(text: &str) -> String {
    let parts: Vec<&str> = text.split('`').collect();
    // A back-tick without its partner is a character like any other.
    let paired = parts.len() % 2 == 1;
    let mut out = String::new();
    for (k, part) in parts.iter().enumerate() {
        let code = paired && k % 2 == 1;
        if k > 0 && !paired {
            out.push('`');
        }
        out.push_str(if code { "<code>" } else { "" });
        // A number stays on the line of its percent sign.
        out.push_str(&escape(&part.replace(" %", "\u{a0}%")));
        out.push_str(if code { "</code>" } else { "" });
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sentence_starts_with_a_capital_and_ends_with_a_stop() {
        assert_eq!(sentence("the data see mx2"), "The data see mx2.");
        assert_eq!(sentence("mx2 is seen."), "mx2 is seen.");
        assert_eq!(sentence(" R² < 1? "), "R² &lt; 1?");
        assert_eq!(sentence("from 3 % on"), "From 3\u{a0}% on.");
        assert_eq!(sentence(""), "");
    }

    #[test]
    fn back_ticks_make_code_and_nothing_else_makes_markup() {
        assert_eq!(prose("link `a<b>`: thin"), "link <code>a&lt;b&gt;</code>: thin");
        assert_eq!(prose("one ` alone & 'x'"), "one ` alone &amp; &#39;x&#39;");
    }
}
