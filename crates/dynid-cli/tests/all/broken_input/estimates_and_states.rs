//! Estimates that `predict` and `validate` read, and tables of states.

use super::csv::{with_field, without};
use super::harness::{Sound, case, check, sound};

#[test]
fn are_refused() {
    let Sound { states, estimate, .. } = sound();
    let predict = "predict bad.json --states states.csv --out effort.csv";
    let at = "predict estimate.json --states bad.csv --out effort.csv";
    let changed = |from: &str, to: &str| {
        assert!(estimate.contains(from), "{from}");
        estimate.replacen(from, to, 1)
    };
    check(&[
        case("other", "", "predict gone.json --states states.csv", &["gone.json", "No such file"], "path"),
        case("bad.json", "", predict, &["bad.json", "not an estimate"], "identify"),
        case("bad.json", "t,q1\n0,1\n", predict, &["bad.json", "not an estimate"], "identify"),
        case("bad.json", b"\xff\xfe\x00".to_vec(), predict, &["bad.json"], "identify"),
        case(
            "bad.json",
            &estimate[..estimate.len() / 2],
            predict,
            &["bad.json", "not an estimate", "line"],
            "identify",
        ),
        case(
            "bad.json",
            changed("\"schema\": 1", "\"schema\": 2"),
            predict,
            &["bad.json", "schema 1", "found 2"],
            "",
        ),
        case(
            "bad.json",
            changed("\"parameters\": [", "\"parameters\": [], \"others\": ["),
            predict,
            &["bad.json", "parameters"],
            "",
        ),
        case(
            "bad.json",
            changed("\"parent\": \"base\"", "\"parent\": \"forearm\""),
            predict,
            &["bad.json"],
            "",
        ),
        case(
            "bad.json",
            changed("\"kind\": \"revolute\"", "\"kind\": \"spiral\""),
            predict,
            &["bad.json", "`shoulder`", "`spiral`"],
            "",
        ),
        case(
            "bad.json",
            changed("\"parent\": \"base\"", "\"parent\": \"nowhere\""),
            "validate bad.json --log log.csv",
            &["bad.json", "nowhere"],
            "",
        ),
        case("bad.csv", without(states, "dq_elbow"), at, &["bad.csv", "velocity", "dq_elbow"], "columns"),
        case(
            "bad.csv",
            without(states, "ddq_shoulder"),
            "regressor robot.urdf --states bad.csv --json",
            &["bad.csv", "acceleration", "ddq_shoulder"],
            "columns",
        ),
        case(
            "bad.csv",
            with_field(states, 4, "ddq_elbow", "x"),
            at,
            &["bad.csv", "row 4", "`ddq_elbow`", "`x`"],
            "",
        ),
        case("bad.csv", states.replacen("q_shoulder", "gx", 1), at, &["bad.csv"], ""),
        case("bad.csv", states.replacen("tau_shoulder", "gx", 1), at, &["bad.csv", "gravity", "gy"], ""),
        case(
            "bad.csv",
            "q1,q2,q3,dq1,dq2,dq3,ddq1,ddq2,ddq3\n0,0,0,0,0,0,0,0,0\n",
            at,
            &["bad.csv", "`q3`", "expected 2"],
            "another robot",
        ),
        case("other", "", "predict estimate.json --states gone.csv", &["gone.csv", "No such file"], "path"),
        case(
            "other",
            "",
            "predict estimate.json --states states.csv --out gone/effort.csv",
            &["gone", "effort.csv"],
            "folder",
        ),
    ]);
}
