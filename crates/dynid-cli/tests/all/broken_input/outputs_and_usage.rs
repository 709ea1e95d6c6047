//! Places to write to, settings of `simulate` and `validate`, and the command line.

use super::harness::{case, check};

#[test]
fn are_refused() {
    check(&[
        case(
            "taken",
            "a file",
            "identify robot.urdf --log log.csv --out taken",
            &["taken", "not a directory"],
            "",
        ),
        case("taken", "a file", "identify robot.urdf --log log.csv --out taken/deeper", &["taken"], ""),
        case(
            "other",
            "",
            "identify robot.urdf --log log.csv --out .",
            &["--out", "robot.urdf", "overwritten"],
            "another",
        ),
        case("other", "", "identify robot.urdf", &["robot.urdf", "robot file", "--log"], ""),
        case("other", "", "identify indy7.toml", &["indy7.toml", "robot file", "--log"], ""),
        case("other", "", "simulate robot.urdf --out gone/log.csv", &["gone", "log.csv"], "folder"),
        case("other", "", "simulate robot.urdf --out a.csv --clean gone/b.csv", &["gone", "b.csv"], "folder"),
        case(
            "other",
            "",
            "simulate robot.urdf --out a.csv --truth gone/b.json",
            &["gone", "b.json"],
            "folder",
        ),
        case(
            "other",
            "",
            "simulate robot.urdf --out a.csv --clean a.csv",
            &["--clean", "a.csv", "--out"],
            "own",
        ),
        case(
            "other",
            "",
            "simulate robot.urdf --out robot.urdf",
            &["--out", "robot.urdf", "overwritten"],
            "another",
        ),
        case(
            "other",
            "",
            "simulate robot.urdf --duration 0 --out a.csv",
            &["duration_s", "positive", "0"],
            "",
        ),
        case(
            "other",
            "",
            "simulate robot.urdf --rate-hz nan --out a.csv",
            &["rate_hz", "positive", "NaN"],
            "",
        ),
        case("other", "", "simulate robot.urdf --duration 1e9 --out a.csv", &["duration_s", "1e8"], ""),
        case("other", "", "simulate robot.urdf --floating-base --out a.csv", &["floating base"], ""),
        case(
            "bad.toml",
            "seeed = 1\n",
            "simulate robot.urdf --config bad.toml --out a.csv",
            &["bad.toml:1", "`seeed`", "`seed`"],
            "",
        ),
        case(
            "bad.toml",
            "values = { \"wrist.fc\" = 1 }\n",
            "simulate robot.urdf --config bad.toml --out a.csv",
            &["wrist.fc", "values"],
            "",
        ),
        case(
            "bad.toml",
            "values = { \"elbow.fc\" = nan }\n",
            "simulate robot.urdf --config bad.toml --out a.csv",
            &["elbow.fc", "finite", "NaN"],
            "",
        ),
        case(
            "other",
            "",
            "validate estimate.json --log log.csv --filter-hz -3",
            &["filter-hz", "positive", "-3"],
            "",
        ),
        case(
            "other",
            "",
            "validate estimate.json --log log.csv --rows 500:2000",
            &["log.csv", "rows 500 to 2000"],
            "",
        ),
        case(
            "other",
            "",
            "identify robot.urdf --log log.csv --kernel-hz 0 --out out",
            &["kernel_hz", "positive", "0"],
            "",
        ),
        case("other", "", "identify robot.urdf --log log.csv --gains 1,2,3 --out out", &["gains"], ""),
    ]);
}
