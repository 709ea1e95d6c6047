//! Logs whose numbers are no motion, or too few.

use super::csv::{first_rows, with_column};
use super::harness::{IDENTIFY, case, check, sound};

#[test]
fn are_refused() {
    let log = &sound().log;
    let degrees =
        with_column(&with_column(log, "q_shoulder", |_, q| q.to_degrees()), "q_elbow", |_, q| q.to_degrees());
    let still = with_column(&with_column(log, "q_shoulder", |_, _| 0.5), "q_elbow", |_, _| -0.5);
    let dead = with_column(&with_column(log, "tau_shoulder", |_, _| 0.0), "tau_elbow", |_, _| 0.0);
    let constant = with_column(log, "tau_elbow", |_, _| 2.0);
    let huge = with_column(&with_column(log, "q_shoulder", |_, q| 1e11 * q), "q_elbow", |_, q| 1e11 * q);
    check(&[
        case("bad.csv", degrees, IDENTIFY, &["bad.csv", "joint `", "degrees"], "deg"),
        case("bad.csv", still, IDENTIFY, &["bad.csv", "joint"], "motion"),
        case("bad.csv", dead, IDENTIFY, &["bad.csv", "effort", "shoulder"], "effort column"),
        case("bad.csv", constant, IDENTIFY, &["bad.csv", "effort", "elbow"], "effort column"),
        case("bad.csv", huge, IDENTIFY, &["bad.csv", "joint `shoulder`", "1e6"], "scale"),
        case("bad.csv", first_rows(log, 1), IDENTIFY, &["bad.csv"], ""),
        case("bad.csv", first_rows(log, 5), IDENTIFY, &["bad.csv"], "longer"),
        case(
            "bad.csv",
            first_rows(log, 5),
            "identify robot.urdf --log bad.csv --route textbook --out out",
            &["bad.csv"],
            "longer",
        ),
        case(
            "bad.csv",
            first_rows(log, 5),
            "identify robot.urdf --log log.csv --validate bad.csv --out out",
            &["bad.csv"],
            "longer",
        ),
        case("bad.csv", first_rows(log, 5), "validate estimate.json --log bad.csv", &["bad.csv"], "longer"),
    ]);
}
