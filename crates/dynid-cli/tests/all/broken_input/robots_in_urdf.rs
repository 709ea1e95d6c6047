//! URDF files that are none, or no tree of bodies.

use super::harness::{case, check, robot};
use crate::support::TWO_LINKS;

const INSPECT: &str = "inspect bad.urdf";

#[test]
fn are_refused() {
    let depth = 100_000;
    let deep =
        format!("<robot name=\"r\">{}{}</robot>", "<link name=\"a\">".repeat(depth), "</link>".repeat(depth));
    let mut chain = "<robot name=\"r\"><link name=\"l0\"/>\n".to_owned();
    for k in 1..100_000 {
        chain += &format!(
            "<link name=\"l{k}\"/><joint name=\"j{k}\" type=\"revolute\"><parent link=\"l{}\"/><child link=\"l{k}\"/>\
             <axis xyz=\"0 0 1\"/></joint>\n",
            k - 1
        );
    }
    chain += "</robot>\n";
    let cycle = robot("<parent link=\"base\"/>", "<parent link=\"forearm\"/>");
    let fixed = TWO_LINKS.replace("type=\"revolute\"", "type=\"fixed\"");
    check(&[
        case("bad.urdf", "", INSPECT, &["bad.urdf:1:1", "<robot>", "empty"], "<robot"),
        case("bad.urdf", b"\x00\x01\xff\xfe\x80".repeat(100), INSPECT, &["bad.urdf"], ""),
        case("bad.urdf", &TWO_LINKS[..TWO_LINKS.len() / 2], INSPECT, &["bad.urdf:"], "cut off"),
        case("bad.urdf", "<collada version=\"1.6\"/>", INSPECT, &["bad.urdf:1:1", "<robot>", "<sdf>"], "SDF"),
        case("bad.urdf", deep, INSPECT, &["bad.urdf:1:", "at most", "levels"], "robot"),
        case("bad.urdf", chain, INSPECT, &["bad.urdf"], ""),
        case("bad.urdf", cycle, INSPECT, &["bad.urdf"], "loop"),
        case(
            "bad.urdf",
            robot("</robot>", "<link name=\"stray\"/></robot>"),
            INSPECT,
            &["bad.urdf", "stray"],
            "roots",
        ),
        case(
            "bad.urdf",
            robot("<child link=\"forearm\"/>", "<child link=\"forarm\"/>"),
            INSPECT,
            &["bad.urdf", "forarm"],
            "",
        ),
        case(
            "bad.urdf",
            robot("<axis xyz=\"0 1 0\"/>", "<axis xyz=\"0 0 0\"/>"),
            INSPECT,
            &["bad.urdf", "shoulder", "axis"],
            "0 0 1",
        ),
        case(
            "bad.urdf",
            robot("xyz=\"0 0 0.4\"", "xyz=\"0 nan 0.4\""),
            INSPECT,
            &["bad.urdf:", "shoulder", "origin", "`0 nan 0.4`"],
            "",
        ),
        case(
            "bad.urdf",
            robot("xyz=\"0 0 0.4\"", "xyz=\"0 0,4\""),
            INSPECT,
            &["bad.urdf:", "shoulder", "origin"],
            "spaces",
        ),
        case(
            "bad.urdf",
            robot("<link name=\"forearm\">", "<link name=\"upper_arm\">"),
            INSPECT,
            &["bad.urdf:", "link name once", "`upper_arm`"],
            "rename",
        ),
        case(
            "bad.urdf",
            robot("<joint name=\"elbow\"", "<joint name=\"shoulder\""),
            INSPECT,
            &["bad.urdf:", "joint name once", "`shoulder`"],
            "rename",
        ),
        case(
            "bad.urdf",
            robot("xyz=\"0 0 0.4\"", "xyz=\"0 0 ${height}\""),
            INSPECT,
            &["bad.urdf:", "xacro", "${height}"],
            "xacro",
        ),
        case(
            "bad.urdf",
            robot("<link name=\"base\"/>", "<xacro:base/><link name=\"base\"/>"),
            INSPECT,
            &["bad.urdf:", "`xacro:base`, which is not defined"],
            "xacro bad.urdf > robot.urdf",
        ),
        case(
            "bad.urdf",
            robot("<mass value=\"3\"/>", "<mass value=\"heavy\"/>"),
            INSPECT,
            &["bad.urdf:", "upper_arm", "mass", "`heavy`"],
            "",
        ),
        case(
            "bad.urdf",
            robot("type=\"revolute\"", "type=\"ball\""),
            INSPECT,
            &["bad.urdf:", "shoulder", "`ball`"],
            "type",
        ),
        case("bad.urdf", fixed, INSPECT, &["bad.urdf"], "not fixed"),
        case("other", "", "inspect gone.urdf", &["gone.urdf", "No such file"], "path"),
        case("other", "", "inspect .", &[".: expected one log, found 2: ./log.csv, ./states.csv"], "name it"),
        case("other", "", "inspect robot.urdf --lock wrist=1", &["`wrist`", "shoulder, elbow"], ""),
        case("other", "", "inspect robot.urdf --lock shoulder=0 --lock elbow=0", &["robot.urdf"], ""),
        case(
            "other",
            "",
            "inspect robot.urdf --elements coulomb,viscuos",
            &["`viscuos`", "`shoulder`", "viscous"],
            "elements",
        ),
    ]);
}
