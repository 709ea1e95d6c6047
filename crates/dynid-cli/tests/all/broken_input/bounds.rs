//! Bounds under `[[bound]]` that say nothing, exclude each other, or bound what is not there.

use super::harness::{RUN, case, check, config};
use crate::support::TWO_LINKS;

fn bound(keys: &str) -> String {
    config(&format!("[[bound]]\n{keys}\n"))
}

fn bounds(all: &[&str]) -> String {
    config(&all.iter().map(|keys| format!("[[bound]]\n{keys}\n")).collect::<String>())
}

#[test]
fn ranges_are_refused() {
    let forearm = |range: &str| bound(&format!("links = [\"forearm\"]\n{range}"));
    check(&[
        case(
            "bad.toml",
            forearm("mass = [3, 2]"),
            RUN,
            &["bad.toml", "`bound.mass`", "lower not above upper", "[3, 2] for `forearm`"],
            "one side open",
        ),
        case("bad.toml", forearm("mass = [nan, 2]"), RUN, &["`bound.mass`", "[NaN, 2]"], "one side open"),
        case("bad.toml", forearm("mass = [1, nan]"), RUN, &["`bound.mass`", "[1, NaN]"], "one side open"),
        case(
            "bad.toml",
            forearm("mass = [-inf, inf]"),
            RUN,
            &["`bound.mass`", "finite", "[-inf, inf]"],
            "one side open",
        ),
        case(
            "bad.toml",
            forearm("com_x = [inf, inf]"),
            RUN,
            &["`bound.com_x`", "[inf, inf]"],
            "one side open",
        ),
        case(
            "bad.toml",
            forearm("com_z = [-inf, -inf]"),
            RUN,
            &["`bound.com_z`", "[-inf, -inf]"],
            "one side open",
        ),
        case(
            "bad.toml",
            bound("parameter = \"elbow.fc\"\nrange = [0.5, 0.1]"),
            RUN,
            &["`bound.range`", "[0.5, 0.1] for `elbow.fc`"],
            "one side open",
        ),
        case(
            "bad.toml",
            forearm("mass = [1, 1e300]"),
            RUN,
            &["`bound.mass`", "up to 1e9", "`inf`", "1e300"],
            "one side open",
        ),
        case("bad.toml", forearm("mass = 2.0"), RUN, &["bad.toml:7", "2.0"], ""),
        case("bad.toml", forearm("mass = [1, 2, 3]"), RUN, &["bad.toml:7", "2 numbers", "found 3"], ""),
        case("bad.toml", forearm("mas = [1, 2]"), RUN, &["bad.toml:7", "`mas`", "`mass`"], ""),
    ]);
}

#[test]
fn sets_of_keys_are_refused() {
    let two = "links = [\"upper_arm\", \"forearm\"]";
    check(&[
        case(
            "bad.toml",
            bound(&format!("{two}\ncom_z = [0.1, 0.2]")),
            RUN,
            &["bad.toml", "`bound`", "for one link, `com_x`", "`links` with 2 links, `com_z`"],
            "[[bound]]",
        ),
        case("bad.toml", bound(two), RUN, &["`bound`", "found `links` with 2 links"], "[[bound]]"),
        case("bad.toml", bound(""), RUN, &["`bound`", "`links` with `mass`", "none of them"], "[[bound]]"),
        case("bad.toml", bound("mass = [1, 2]"), RUN, &["`bound`", "found `mass`"], "[[bound]]"),
        case(
            "bad.toml",
            bound("parameter = \"elbow.fc\""),
            RUN,
            &["`parameter` with `range`", "found `parameter`"],
            "[[bound]]",
        ),
        case(
            "bad.toml",
            bound("parameter = \"elbow.fc\"\nmass = [1, 2]"),
            RUN,
            &["`parameter` with `range`", "`parameter`, `mass`"],
            "[[bound]]",
        ),
        case(
            "bad.toml",
            bound("links = [\"forearm\", \"forearm\"]\nmass = [1, 2]"),
            RUN,
            &["bad.toml", "`bound.links`", "every link once", "`forearm` twice"],
            "total mass",
        ),
    ]);
}

#[test]
fn unknown_names_are_refused() {
    let welded = TWO_LINKS.replace(
        "</robot>",
        "<link name=\"tool\"><inertial><mass value=\"0.2\"/><inertia ixx=\"1e-3\" ixy=\"0\" ixz=\"0\" iyy=\"1e-3\" \
         iyz=\"0\" izz=\"1e-3\"/></inertial></link><joint name=\"flange\" type=\"fixed\"><parent link=\"forearm\"/>\
         <child link=\"tool\"/></joint></robot>",
    );
    check(&[
        case(
            "bad.toml",
            bound("links = [\"forarm\"]\nmass = [1, 2]"),
            RUN,
            &["no moving link", "`forarm`", "did you mean `forearm`?", "upper_arm, forearm"],
            "[[bound]]",
        ),
        case(
            "bad.toml",
            bound("links = [\"base\"]\nmass = [1, 2]"),
            RUN,
            &["no moving link", "`base`", "upper_arm, forearm"],
            "[[bound]]",
        ),
        case(
            "robot.urdf",
            welded,
            "identify config.toml",
            &["no moving link", "`tool`", "welded to `forearm`"],
            "everything welded to it",
        )
        .beside("config.toml", bound("links = [\"tool\"]\nmass = [0.1, 0.3]")),
        case(
            "bad.toml",
            bound("parameter = \"elbow.fcc\"\nrange = [0, 1]"),
            RUN,
            &["`elbow.fcc`", "did you mean `elbow.fc`?"],
            "dynid inspect",
        ),
        case(
            "bad.toml",
            bound("parameter = \"wrist.backlash\"\nrange = [0, 1]"),
            RUN,
            &["no parameter", "`wrist.backlash`"],
            "dynid inspect",
        ),
    ]);
}

#[test]
fn contradictions_are_refused() {
    let contradiction = "widen one of the bounds";
    check(&[
        case(
            "bad.toml",
            bounds(&["links = [\"forearm\"]\nmass = [3, inf]", "links = [\"forearm\"]\nmass = [-inf, 2]"]),
            RUN,
            &["mass of `forearm` ≥ 3 kg", "contradicts", "mass of `forearm` ≤ 2 kg"],
            contradiction,
        ),
        case(
            "bad.toml",
            bounds(&[
                "parameter = \"elbow.fv\"\nrange = [0.5, 1]",
                "parameter = \"elbow.fv\"\nrange = [0.1, 0.2]",
            ]),
            RUN,
            &["`elbow.fv` ≥ 0.5", "contradicts", "`elbow.fv` ≤ 0.2"],
            contradiction,
        ),
        case(
            "bad.toml",
            bounds(&[
                "links = [\"forearm\"]\ncom_z = [0.3, inf]",
                "links = [\"forearm\"]\ncom_z = [-inf, 0.1]",
            ]),
            RUN,
            &["centre of mass of `forearm` along z ≥ 0.3 m", "centre of mass of `forearm` along z ≤ 0.1 m"],
            contradiction,
        ),
        case(
            "bad.toml",
            bounds(&[
                "links = [\"upper_arm\"]\nmass = [0.6, inf]",
                "links = [\"forearm\"]\nmass = [0.7, inf]",
                "links = [\"upper_arm\", \"forearm\"]\nmass = [-inf, 1]",
            ]),
            RUN,
            &[
                "no physically consistent parameters",
                "mass of `upper_arm` ≥ 0.6 kg",
                "mass of `forearm` ≥ 0.7 kg",
                "total mass of `upper_arm`, `forearm` ≤ 1 kg",
            ],
            contradiction,
        ),
        case(
            "bad.toml",
            bound("links = [\"forearm\"]\nmass = [-inf, -1]"),
            RUN,
            &["no physically consistent parameters", "mass of `forearm` ≤ -1 kg"],
            contradiction,
        ),
        // As if it had been given in another unit.
        case(
            "bad.toml",
            bound("links = [\"forearm\"]\nmass = [-inf, 1e-12]"),
            RUN,
            &["mass of `forearm` ≤ 1e-12 kg", "link `forearm` is a physical body"],
            "limits are in kg",
        ),
        // No body has a moment of inertia above the sum of the other two.
        case(
            "bad.toml",
            bounds(&[
                "parameter = \"forearm.Ixx\"\nrange = [3, inf]",
                "parameter = \"forearm.Iyy\"\nrange = [-inf, 1]",
                "parameter = \"forearm.Izz\"\nrange = [-inf, 1]",
            ]),
            RUN,
            &["`forearm.Ixx` ≥ 3", "`forearm.Iyy` ≤ 1", "`forearm.Izz` ≤ 1", "link `forearm`"],
            contradiction,
        ),
        case(
            "bad.toml",
            bounds(&[
                "parameter = \"elbow.fc\"\nrange = [-inf, -0.1]",
                "parameter = \"elbow.fv\"\nrange = [-inf, 0]",
            ]),
            RUN,
            &["`elbow.fc` ≤ -0.1", "`elbow.fv` ≤ 0", "power of the friction of elbow ≥ 0"],
            contradiction,
        ),
    ]);
}
