//! Configurations of `design`: keys, limits, regions, criteria, places.

use super::harness::{Case, case, check};
use super::trajectories::trajectory;
use crate::support::TWO_LINKS;

const DESIGN: &str = "design bad.toml";
/// A design that would be quick if it were not refused.
const ROBOT: &str = "design robot.urdf --starts 1 --out out";

/// A sound configuration with more lines.
fn design(more: &str, message: &'static [&'static str], hint: &'static str) -> Case {
    let text = format!("robot = \"robot.urdf\"\nout = \"out\"\n{more}\n");
    case("bad.toml", text, DESIGN, message, hint)
}

/// The robot with a text replaced wherever it is.
fn robot(from: &str, to: &str, message: &'static [&'static str], hint: &'static str) -> Case {
    assert!(TWO_LINKS.contains(from), "{from}");
    case("robot.urdf", TWO_LINKS.replace(from, to), ROBOT, message, hint)
}

#[test]
fn with_broken_keys_are_refused() {
    check(&[
        case("other", "", "design gone.toml", &["gone.toml", "No such file"], "path"),
        case("bad.toml", "", DESIGN, &["bad.toml", "robot"], ""),
        case("bad.toml", "robot = \"gone.urdf\"\n", DESIGN, &["gone.urdf", "No such file"], "path"),
        case("bad.toml", "[[joint]\n", DESIGN, &["bad.toml:1"], ""),
        case("bad.urdf", "<robot", "design bad.urdf", &["bad.urdf:1:1"], "damaged"),
        case("bad.json", "{}", "design bad.json", &["bad.json"], ""),
        design("[trajectory]\nperiod = 20", &["bad.toml:4", "`period`", "`period_s`"], ""),
        design("[trajectory]\nperiod_s = \"long\"", &["bad.toml:4", "long"], ""),
        design("[trajectory]\nperiod_s = nan", &["bad.toml", "period_s", "positive", "NaN"], ""),
        design("[trajectory]\nharmonics = 0", &["bad.toml", "harmonics", "2 to 50", "0"], ""),
        design("[trajectory]\nharmonics = -1", &["bad.toml:4", "-1"], ""),
        design("[trajectory]\nperiods = 0", &["bad.toml", "periods", "1 to 10000", "0"], ""),
        design("[trajectory]\nsample_rate_hz = 0.5", &["bad.toml", "sample_rate_hz", "1 Hz", "0.5"], ""),
        design("[trajectory]\nsample_rate_hz = 1e9", &["bad.toml", "sample_rate_hz", "1e7"], ""),
        design("[search]\nstarts = 0", &["bad.toml", "search.starts", "1 to 100000", "0"], ""),
        design("[search]\ntime_budget_s = -1", &["search.time_budget_s", "not negative", "-1"], ""),
        design("[search]\nseed = -1", &["bad.toml:4", "-1"], ""),
        case(
            "other",
            "",
            "design robot.urdf --out out --seed 18446744073709551615",
            &["search.seed", "at most", "18446744073709551615"],
            "",
        ),
        design("[criterion]\nname = \"best\"", &["bad.toml:4", "best", "`relative-std`"], ""),
        design("[criterion]\ncolumns = \"some\"", &["bad.toml:4", "some", "`inertial`"], ""),
        design("[criterion]\nmix = [1, 2, 3]", &["bad.toml:4", "2 numbers", "found 3"], ""),
        design("[criterion]\nmix = [0, 1]", &["criterion.mix", "positive", "0"], ""),
        design("[criterion]\ncorrelation_time_s = -1", &["correlation_time_s", "not negative", "-1"], ""),
        design("[criterion]\nnoise = -1", &["criterion.noise", "positive", "-1"], ""),
        design("[criterion]\nnoise = { wrist = 1 }", &["`wrist`", "shoulder, elbow"], ""),
        design("gravity = [0, 0, 0, -9.81]", &["bad.toml:3", "3 numbers", "found 4"], ""),
        design("gravity = [0, 0, inf]", &["gravity", "finite", "inf"], ""),
        design("values = { \"wrist.fc\" = 1 }", &["values", "wrist.fc"], ""),
        design("[locked]\nelbow = nan", &["locked.elbow", "finite", "NaN"], ""),
        design("[locked]\nwrist = 0", &["`wrist`", "shoulder, elbow"], ""),
        design("[locked]\nelbow = 0\nshoulder = 0", &["robot.urdf", "no moving joint"], "not fixed"),
        design("[elements]\ndefault = [\"drive_gain\"]", &["channels", "currents"], ""),
    ]);
}

#[test]
fn with_broken_limits_are_refused() {
    check(&[
        design("[limits]\nvelocity = \"fast\"", &["bad.toml:4", "a number", "by joint"], ""),
        design("[limits]\nvelocity = { wrist = 1 }", &["`wrist`", "shoulder, elbow"], ""),
        design("[limits]\nvelocity = { elbow = -1 }", &["limits.velocity.elbow", "positive", "-1"], ""),
        design("[limits]\nacceleration = nan", &["limits.acceleration", "positive", "NaN"], ""),
        design("[limits]\njerk = inf", &["limits.jerk", "positive", "inf"], ""),
        design("[limits]\neffort = 0", &["limits.effort", "positive", "0"], ""),
        design("[limits]\nshare = 1.5", &["bad.toml", "limits.share", "at most 1", "1.5"], ""),
        design("[limits]\nposition = { elbow = [1, 1] }", &["limits.position.elbow", "1 to 1"], "limits"),
        design("[limits]\nposition = { elbow = [1, nan] }", &["limits.position.elbow", "NaN"], ""),
        design("[limits]\nposition = { elbow = [0, 1, 2] }", &["bad.toml:4", "2 numbers", "found 3"], ""),
        design("[limits]\nposition = { wrist = [0, 1] }", &["`wrist`", "shoulder, elbow"], ""),
        design("[limits]\nacceleration = 1e-9", &["upper_arm.mx", "told apart"], "widen"),
        design(
            "[trajectory]\nstart_pose = { elbow = 0.5 }",
            &["start_pose", "`shoulder`", "none"],
            "every joint",
        ),
        design("[trajectory]\nstart_pose = { wrist = 0.5 }", &["`wrist`", "shoulder, elbow"], ""),
        design("[trajectory]\nparking = { elbow = 7 }", &["parking.elbow", "-2 to 2", "7"], "within"),
        design("[trajectory]\nparking = { elbow = nan }", &["parking.elbow", "-2 to 2", "NaN"], ""),
        design("[trajectory]\nframes = [\"gripper\"]", &["`gripper`", "base, upper_arm, forearm"], ""),
        robot("velocity=\"3\" ", "", &["limits.velocity.shoulder", "states none"], "[limits]"),
        robot(
            "<joint name=\"elbow\" type=\"revolute\">",
            "<joint name=\"elbow\" type=\"floating\">",
            &["floating base"],
            "",
        ),
        case(
            "robot.urdf",
            TWO_LINKS
                .replace("type=\"revolute\"", "type=\"prismatic\"")
                .replace("lower=\"-2\" upper=\"2\" ", ""),
            ROBOT,
            &["limits.position.shoulder", "range", "states none"],
            "[limits]",
        ),
        robot("type=\"revolute\"", "type=\"fixed\"", &["robot.urdf", "no moving joint"], "not fixed"),
        case(
            "bare.urdf",
            TWO_LINKS.replace("<inertial>", "<!--").replace("</inertial>", "-->"),
            "design bare.urdf --criterion relative-std --out out",
            &["criterion.name", "no inertias", "relative-std"],
            "`name`",
        ),
    ]);
}

#[test]
fn with_broken_regions_are_refused() {
    let keep = |more: &str, message: &'static [&'static str]| {
        design(&format!("[[keep]]\nframes = [\"forearm\"]\n{more}"), message, "")
    };
    let capsules = |frame: &str, radius: &str| {
        let one = |frame: &str, radius: &str| {
            format!(
                "[[capsule]]\nframe = \"{frame}\"\nfrom = [0, 0, 0]\nto = [0, 0, 0.1]\nradius = {radius}\n"
            )
        };
        one("base", "0.1") + &one(frame, radius)
    };
    check(&[
        design("[[keep]]\nframes = []\nabove = 0.1", &["keep.frames", "at least one link"], ""),
        design("[[keep]]\nframes = [\"gripper\"]\nabove = 0.1", &["`gripper`", "base, upper_arm"], ""),
        keep("", &["bad.toml", "`above`", "no region"]),
        keep("above = nan", &["half-space of `forearm`", "NaN"]),
        keep("above = 0.1\npoint = [0, 0, 0, 1]", &["bad.toml:6", "3 numbers", "found 4"]),
        keep("half_space = { normal = [0, 0, 0], offset = 0 }", &["normal", "`forearm`", "positive"]),
        keep("half_space = { normal = [0, 0, 1] }", &["bad.toml:5", "offset"]),
        keep("inside = { lower = [0, 0, 0], upper = [1, -1, 1] }", &["box of `forearm`", "-1"]),
        keep("outside_cylinder = { radius = 0 }", &["cylinder of `forearm`", "positive"]),
        keep("outside_cylinder = { radius = 1, center = [0] }", &["bad.toml:5", "2 numbers", "found 1"]),
        keep("outside_column = { radius = 0.1, height = inf }", &["column of `forearm`", "finite"]),
        design(&capsules("forearm", "0"), &["capsule of `forearm`", "positive"], ""),
        design(&capsules("gripper", "0.1"), &["`gripper`", "base, upper_arm"], ""),
        design(
            "[safety]\nfloor = false\nself_collision = false\n[[capsule]]\nframe = \"forearm\"\nfrom = [0, 0, 0]\nto = [0, 0, 0.1]\n\
             radius = 0.1",
            &["capsule", "two or more", "one"],
            "base",
        ),
        design(
            "[[capsule]]\nframe = \"forearm\"\nfrom = [0, 0, 0]\nradius = 0.1",
            &["bad.toml:3", "`to`"],
            "",
        ),
    ]);
}

#[test]
fn with_unusable_files_are_refused() {
    let checkpoint = "design robot.urdf --starts 1 --out out --checkpoint c.json";
    let earlier = "design robot.urdf --starts 1 --out out --earlier t.json";
    check(&[
        case("taken", "a file", "design robot.urdf --out taken", &["taken", "not a directory"], ""),
        case("taken", "a file", "design robot.urdf --out taken/deeper", &["taken"], ""),
        case(
            "trajectory.json",
            trajectory("rad", "rad"),
            "design robot.urdf --out . --earlier trajectory.json",
            &["--out", "trajectory.json", "overwritten"],
            "another",
        ),
        case("c.json", "", checkpoint, &["c.json", "not a checkpoint"], "delete"),
        case("c.json", b"\xff\xfe".to_vec(), checkpoint, &["c.json"], "text file"),
        case("c.json", trajectory("rad", "rad"), checkpoint, &["c.json", "not a checkpoint"], "delete"),
        case(
            "c.json",
            r#"{"schema": "dynid-design-checkpoint/9", "problem": "", "starts": []}"#,
            checkpoint,
            &["c.json", "dynid-design-checkpoint/2", "checkpoint/9"],
            "delete",
        ),
        design("[search]\ncheckpoint = \"gone/c.json\"", &["gone/c.json", "cannot be written"], "folder"),
        design(
            "[search]\ncheckpoint = \"robot.urdf\"",
            &["--checkpoint", "robot.urdf", "overwritten"],
            "another",
        ),
        design("[search]\ncheckpoint = \"out\"", &["--checkpoint", "output folder"], "its own"),
        case(
            "other",
            "",
            "design robot.urdf --out . --checkpoint design.json",
            &["--checkpoint", "design.json", "--out"],
            "own",
        ),
        case("other", "", earlier, &["t.json", "No such file"], "path"),
        case("t.json", "robot", earlier, &["t.json:1:1"], "JSON"),
        case("t.json", trajectory("elbow", "wrist"), earlier, &["t.json", "joints", "`elbow`"], ""),
        // A robot file with a slip in it is told so, and not what a configuration may hold.
        case(
            "bad.toml",
            crate::support::indy7().replace("a = 0.45", "aa = 0.45"),
            DESIGN,
            &["bad.toml:34", "`aa`", "`alpha`"],
            "misspelt",
        ),
    ]);
}

#[test]
fn trajectories_that_cannot_be_followed_are_refused() {
    const FOLLOW: &str = "simulate robot.urdf --follow t.json --out a.csv";
    let follow = |from: &str, to: &str, message: &'static [&'static str], hint: &'static str| {
        case("t.json", trajectory(from, to), FOLLOW, message, hint)
    };
    let whole = trajectory("rad", "rad");
    check(&[
        case("other", "", FOLLOW, &["t.json", "No such file"], "path"),
        case("t.json", "", FOLLOW, &["t.json:1"], "JSON"),
        case("t.json", &whole[..whole.len() / 2], FOLLOW, &["t.json:", "EOF"], "JSON"),
        case("t.json", "{}", FOLLOW, &["t.json", "schema", "none"], "version"),
        case("t.json", b"\xff\xfe\x00".to_vec(), FOLLOW, &["t.json", "UTF-8"], ""),
        follow("dynid-trajectory/1", "dynid-trajectory/9", &["t.json", "trajectory/9"], "version"),
        follow("\"elbow\"", "\"wrist\"", &["t.json", "joints", "`elbow`"], ""),
        follow("\"elbow\"", "\"shoulder\"", &["t.json", "joints[1].name", "shoulder"], "field"),
        follow("\"a\": [0.2]", "\"a\": [0.2, 0.1]", &["t.json", "joints[1].b", "found 1"], "field"),
        follow("\"a\": [0.2]", "\"a\": [1e999]", &["t.json:", "range"], "JSON"),
        follow("\"q0\": 0", "\"q0\": null", &["t.json:", "null"], "JSON"),
        follow("\"form\"", "\"speed\": 3, \"form\"", &["t.json:", "`speed`"], "misspelt"),
        follow("0.5235987755982988", "-1", &["t.json", "base_frequency_rad_s", "-1"], ""),
        follow("\"periods\": 1", "\"periods\": 0", &["t.json", "periods", "0"], ""),
        follow("\"periods\": 1", "\"periods\": 1000000000000", &["t.json", "periods", "3.2e7"], ""),
        follow(
            "\"approach\": null",
            "\"approach\": {\"from\": [0], \"duration_s\": 3}",
            &["t.json", "approach.from", "2 positions", "found 1"],
            "field",
        ),
        follow(
            "\"return\": null",
            "\"return\": {\"to\": [0, 0], \"duration_s\": -1}",
            &["t.json", "return.duration_s", "-1"],
            "field",
        ),
        case(
            "t.json",
            whole.clone(),
            "simulate robot.urdf --follow t.json --out t.json",
            &["--out", "t.json", "overwritten"],
            "another",
        ),
        case(
            "bad.toml",
            "follow = \"gone.json\"\n",
            "simulate robot.urdf --config bad.toml --out a.csv",
            &["gone.json", "No such file"],
            "path",
        ),
        case(
            "bad.toml",
            "follow = 3\n",
            "simulate robot.urdf --config bad.toml --out a.csv",
            &["bad.toml:1", "3"],
            "",
        ),
    ]);
}
