//! Data inside a `<script>` element.

use serde::Serialize;

/// JSON that cannot end the element it stands in, nor open a comment in it.
pub(super) fn script_json<T: Serialize>(data: &T) -> Result<String, serde_json::Error> {
    // Outside strings JSON has none of these characters, and inside them the escape means the same.
    Ok(serde_json::to_string(data)?
        .replace('<', "\\u003c")
        .replace('>', "\\u003e")
        .replace('&', "\\u0026")
        .replace('\u{2028}', "\\u2028")
        .replace('\u{2029}', "\\u2029"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_cannot_leave_the_script_and_comes_back_unchanged() {
        let text = "</script><!--<script>&amp;\u{2028}\\\"";
        let json = script_json(&text).unwrap();
        assert!(!json.contains(['<', '>', '&', '\u{2028}']));
        assert_eq!(serde_json::from_str::<String>(&json).unwrap(), text);
    }
}
