//! Robot files in TOML.

use super::harness::{case, check};
use crate::support::indy7;

#[test]
fn are_refused() {
    let sound = indy7();
    let changed = |from: &str, to: &str| {
        assert!(sound.contains(from), "{from}");
        sound.replacen(from, to, 1)
    };
    let coupling = |matrix: &str, joints: &str| {
        format!("{sound}\n[[coupling]]\nmotors = [\"m5\", \"m6\"]\njoints = {joints}\nmatrix = {matrix}\n")
    };
    let coupled = "inspect bad.toml";
    check(&[
        case("bad.toml", "", "inspect bad.toml", &["bad.toml:1:1", "joint"], ""),
        case("bad.toml", "schema = [", "inspect bad.toml", &["bad.toml:1:"], ""),
        case(
            "bad.toml",
            changed("alpha = 0.0", "alpha = \"steep\""),
            "inspect bad.toml",
            &["bad.toml:17:9", "angle", "steep"],
            "",
        ),
        case(
            "bad.toml",
            changed("d = 0.3\n", "d = nan\n"),
            "inspect bad.toml",
            &["bad.toml:18:5", "finite", "NaN"],
            "",
        ),
        case(
            "bad.toml",
            changed("d = 0.3\n", "dd = 0.3\n"),
            "inspect bad.toml",
            &["bad.toml:", "`dd`"],
            "misspelt",
        ),
        case(
            "bad.toml",
            changed("name = \"j2\"", "name = \"j1\""),
            "inspect bad.toml",
            &["bad.toml:", "`j1`"],
            "",
        ),
        case(
            "bad.toml",
            changed("\"coulomb\"", "\"colomb\""),
            "inspect bad.toml",
            &["colomb", "coulomb"],
            "",
        ),
        case(
            "bad.toml",
            format!(
                "{sound}\n[[loop]]\nname = \"rod\"\nkind = \"distance\"\na = \"link6\"\nb = \"base\"\nlength = 100.0\n"
            ),
            "inspect bad.toml",
            &["bad.toml", "loop `rod`", "does not close", "gap"],
            "home",
        ),
        case(
            "bad.toml",
            changed("[element.j6]", "[element.j7]"),
            "inspect bad.toml",
            &["bad.toml", "j7"],
            "",
        ),
        case(
            "bad.toml",
            coupling("[[1, 1], [2, 2]]", "[\"j5\", \"j6\"]"),
            coupled,
            &["coupling", "j5, j6", "singular"],
            "",
        ),
        case("bad.toml", coupling("[[1, 0], [1]]", "[\"j5\", \"j6\"]"), coupled, &["coupling", "matrix"], ""),
        case("bad.toml", coupling("[[1, 0], [1, 1]]", "[\"j5\", \"j9\"]"), coupled, &["j9"], ""),
    ]);
}
