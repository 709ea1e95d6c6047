//! Validation logs of which nothing is left.

use super::csv::first_rows;
use super::harness::{CONFIG, RUN, case, check, config, sound};

#[test]
fn are_refused() {
    let header = || first_rows(&sound().log, 0);
    let by_flag = "identify robot.urdf --log log.csv --validate bad.csv --out out";
    let validation = |more: &str| config(&format!("[[validation]]\npath = \"log.csv\"\n{more}\n"));
    check(&[
        case("bad.csv", header(), by_flag, &["bad.csv", "after the header", "found none"], "recording"),
        case("bad.csv", "", by_flag, &["bad.csv", "empty file"], "first line"),
        case(
            "bad.csv",
            header(),
            "identify config.toml",
            &["bad.csv", "after the header", "found none"],
            "recording",
        )
        .beside("config.toml", format!("{CONFIG}[[validation]]\npath = \"bad.csv\"\n")),
        case(
            "bad.csv",
            header(),
            "validate estimate.json --log bad.csv",
            &["bad.csv", "found none"],
            "recording",
        ),
        case("bad.toml", validation("part = [0.0, 0.0001]"), RUN, &["log.csv", "rows", "found 0"], "`part`"),
        case("bad.toml", validation("part = [0.9999, 1.0]"), RUN, &["log.csv", "at least 2 rows"], "`part`"),
        case(
            "bad.toml",
            validation("part = [0.5, 0.5]"),
            RUN,
            &["bad.toml", "`part`", "increasing", "[0.5, 0.5]"],
            "",
        ),
        case(
            "bad.toml",
            validation("rows = [5000, 6000]"),
            RUN,
            &["log.csv", "rows 5000 to 6000"],
            "counted",
        ),
        case("bad.toml", validation("rows = [20, 10]"), RUN, &["log.csv", "rows 20 to 10"], "counted"),
        case("bad.toml", validation("rows = [0, 10]"), RUN, &["log.csv", "rows 0 to 10"], "counted"),
        case("bad.toml", validation("rows = [10, 10]"), RUN, &["log.csv", "at least 2 rows"], "`part`"),
        case("bad.toml", config("[[validation]]\nrows = [1, 10]\n"), RUN, &["bad.toml", "`path`"], ""),
    ]);
}
