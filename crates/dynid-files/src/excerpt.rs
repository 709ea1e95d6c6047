//! Pieces of foreign text made fit for a one-line message.

/// Longest piece of foreign text repeated in a message, characters.
const LONGEST: usize = 60;

/// `text` on one line, control characters escaped, cut after 60 characters.
pub fn excerpt(text: &str) -> String {
    let mut out = String::new();
    for (k, c) in text.chars().enumerate() {
        if k == LONGEST {
            out.push('…');
            break;
        }
        if c.is_control() {
            out.extend(c.escape_default());
        } else {
            out.push(c);
        }
    }
    out
}

/// Like [`excerpt`], for bytes that need not be UTF-8.
pub fn excerpt_bytes(bytes: &[u8]) -> String {
    excerpt(&String::from_utf8_lossy(&bytes[..bytes.len().min(8 * LONGEST)]))
}

/// Names in a list, `a, b, c`, cut after `most`.
pub fn listed<S: AsRef<str>>(names: &[S], most: usize) -> String {
    let mut out = names.iter().take(most).map(|n| excerpt(n.as_ref())).collect::<Vec<_>>().join(", ");
    if names.len() > most {
        out.push_str(&format!(", … ({} in all)", names.len()));
    }
    if names.is_empty() {
        out.push_str("nothing");
    }
    out
}

/// The entry of `known` that is closest to `name`, if it is close enough to be a slip of the pen.
pub fn closest<'a, S: AsRef<str>>(name: &str, known: &'a [S]) -> Option<&'a str> {
    let most = (name.chars().count() / 3).clamp(1, 3);
    known
        .iter()
        .map(AsRef::as_ref)
        .map(|k| (edit_distance(name, k), k))
        .filter(|(d, _)| *d <= most)
        .min_by_key(|(d, _)| *d)
        .map(|(_, k)| k)
}

/// The entries of `known` that look most like `name`, at most three, the most alike first: slips of the pen, then names that
/// hold it or are held by it.
pub fn nearest(name: &str, known: &[String]) -> Vec<String> {
    let most = (name.chars().count() / 3).clamp(1, 3);
    let wanted = name.to_lowercase();
    let mut found: Vec<(usize, &String)> = known
        .iter()
        .filter_map(|k| {
            let other = k.to_lowercase();
            let distance = edit_distance(&wanted, &other);
            let holds = other.contains(&wanted) || (other.len() > 2 && wanted.contains(&other));
            (distance <= most || holds).then_some((distance, k))
        })
        .collect();
    found.sort_by_key(|(distance, _)| *distance);
    found.into_iter().take(3).map(|(_, k)| k.clone()).collect()
}

/// Levenshtein distance of two names, capped by their first 64 characters.
fn edit_distance(a: &str, b: &str) -> usize {
    let a: Vec<char> = a.chars().take(64).collect();
    let b: Vec<char> = b.chars().take(64).collect();
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, x) in a.iter().enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, y) in b.iter().enumerate() {
            let substituted = diagonal + usize::from(x != y);
            diagonal = row[j + 1];
            row[j + 1] = substituted.min(row[j] + 1).min(diagonal + 1);
        }
    }
    row[b.len()]
}
