//! MJCF that is refused: by place, reason and remedy, and never by a panic.

use dynid_robots::mjcf;

/// A model with a body of two joints; `@` is put into its body.
const MODEL: &str = "<mujoco>\n<worldbody>\n<body name=\"b\">\n<joint name=\"j\" axis=\"0 1 0\"/><joint name=\"k\" type=\"slide\"/>\n<geom size=\"0.1\"/>\n@\n</body>\n</worldbody>\n</mujoco>";

#[track_caller]
fn check(text: &str, parts: &[&str]) {
    let error = mjcf::parse(text, "m.xml").expect_err(text);
    let whole = format!("{error}\nhint: {}", error.hint().unwrap_or_default());
    assert!(!whole.lines().next().unwrap_or_default().is_empty() && error.hint().is_some(), "{whole}");
    parts.iter().for_each(|part| assert!(whole.contains(part), "expected {part:?} in: {whole}"));
}

#[test]
fn what_a_body_cannot_have() {
    let cases: [(&str, &[&str]); 19] = [
        (
            "<body><joint type=\"ball\"/><geom size=\"1\"/></body>",
            &["m.xml:6:14", "ball joint", "three hinges"],
        ),
        (
            "<body><freejoint/><geom size=\"1\"/></body>",
            &["m.xml:6:7", "stands alone, in a body of the world"],
        ),
        ("<body gravcomp=\"1\"/>", &["m.xml:6:7", "takes weight off", "controller"]),
        ("<composite/>", &["m.xml:6:1", "MuJoCo makes", "mj_saveLastXML"]),
        ("<attach model=\"x\"/>", &["<attach>", "mj_saveLastXML"]),
        ("<plugin/>", &["<plugin>", "forces"]),
        ("<bodey/>", &["<bodey>", "no such element"]),
        ("<body name=\"b\"/>", &["m.xml:6:1", "body name once", "`b`", "line 3"]),
        ("<joint name=\"j\"/>", &["joint name once", "`j`", "line 4"]),
        ("<joint axis=\"0 0 0\"/>", &["m.xml:6:8", "axis", "a direction, not zero"]),
        ("<joint range=\"0 1 2\"/>", &["range", "two numbers"]),
        ("<joint damping=\"1 2\"/>", &["polynomial", "first coefficient"]),
        ("<joint damping=\"-1\"/>", &["damping", "not negative"]),
        ("<joint springdamper=\"1 1\"/>", &["springdamper", "state `stiffness`"]),
        ("<joint class=\"c\"/>", &["<joint> class", "name of a class", "`c`"]),
        ("<geom type=\"mesh\" mesh=\"m\"/>", &["geom", "name of a mesh", "`m`"]),
        ("<geom type=\"box\" size=\"1 2\"/>", &["size", "3 positive sizes"]),
        ("<geom type=\"sdf\"/>", &["signed distance field", "<inertial>"]),
        ("<inertial pos=\"0 0 0\"/>", &["<inertial>", "an attribute `mass`"]),
    ];
    for (inside, parts) in cases {
        check(&MODEL.replace('@', inside), parts);
    }
}

#[test]
fn what_a_model_cannot_have() {
    let cases: [(&str, &[&str]); 12] = [
        ("<option density=\"1.2\"/>", &["m.xml:2:9", "`density` of a medium", "moves in air"]),
        ("<compiler coordinate=\"global\"/>", &["coordinate", "2.3.4"]),
        ("<compiler eulerseq=\"xyw\"/>", &["eulerseq", "three letters"]),
        (
            "<default><joint range=\"0 1\"/></default><compiler autolimits=\"false\"/>",
            &["autolimits", "limited=\"true\""],
        ),
        ("<default><default/></default>", &["<default>", "an attribute `class`"]),
        (
            "<tendon><fixed stiffness=\"2\"/></tendon>",
            &["`stiffness` acts on the joints", "tendons are not known"],
        ),
        ("<deformable><flex/></deformable>", &["bodies that give way"]),
        (
            "<equality><joint joint1=\"j\" joint2=\"k\" polycoef=\"0 1 2\"/></equality>",
            &["polynomial of a higher degree", "active=\"false\""],
        ),
        ("<equality><joint joint1=\"j\"/></equality>", &["holds a joint still", "[locked]"]),
        (
            "<equality><joint joint1=\"j\" joint2=\"kk\"/></equality>",
            &["joint2", "`kk`", "did you mean `k`?"],
        ),
        ("<equality><tendon/></equality>", &["not known here"]),
        (
            "<actuator><motor joint=\"j\" armature=\"1\"/></actuator>",
            &["its own `armature`", "square of the gear"],
        ),
    ];
    for (section, parts) in cases {
        let text = MODEL.replace('@', "").replacen("<mujoco>\n", &format!("<mujoco>\n{section}"), 1);
        check(&text, parts);
    }
}

#[test]
fn sizes_are_bounded() {
    let deep = format!("<mujoco><worldbody>{}", "<body>".repeat(100_000));
    check(&deep, &["at most 256 levels"]);
    let many =
        MODEL.replace('@', "<replicate count=\"50000\"><geom size=\"1\"/><geom size=\"1\"/></replicate>");
    check(&many, &["at most 100000 bodies, joints, shapes and frames"]);
    let nested = format!("{}{}", "<replicate count=\"90000\">".repeat(40), "</replicate>".repeat(40));
    check(&MODEL.replace('@', &nested), &["at most 100000"]);
    check(
        &MODEL.replace('@', "<replicate count=\"4000000000\"/>"),
        &["count", "a whole number from 1 to 100000"],
    );
}

/// Numbers of a linear congruence, the same on every machine.
struct Dice(u64);

impl Dice {
    fn below(&mut self, most: usize) -> usize {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        usize::try_from(self.0 >> 33).unwrap_or(0) % most.max(1)
    }
}

#[test]
fn damaged_models_do_no_harm() {
    let whole = MODEL
        .replace('@', "<frame euler=\"1 2 3\"><body name=\"c\" childclass=\"d\"><joint type=\"slide\" ref=\"1\"/><inertial pos=\"1 2 3\" mass=\"1\" fullinertia=\"1 1 1 0 0 0\"/></body></frame><replicate count=\"2\" offset=\"1 0 0\"><geom fromto=\"0 0 0 1 1 1\" type=\"capsule\"/></replicate>")
        .replacen("<mujoco>\n", "<mujoco><compiler inertiafromgeom=\"true\" boundmass=\"1\"/><default><default class=\"d\"/></default><equality><joint joint1=\"j\" joint2=\"k\"/><weld body1=\"b\"/></equality>\n", 1);
    let mut dice = Dice(11);
    let mut read = 0;
    for _ in 0..20_000 {
        let mut bytes = whole.clone().into_bytes();
        for _ in 0..=dice.below(3) {
            if bytes.is_empty() {
                break;
            }
            let at = dice.below(bytes.len());
            let end = (at + dice.below(40)).min(bytes.len());
            match dice.below(4) {
                0 => bytes[at] = b"0-. \"<>/=ex"[dice.below(11)],
                1 => drop(bytes.drain(at..end)),
                2 => {
                    let piece = bytes[at..end].to_vec();
                    let to = dice.below(bytes.len());
                    drop(bytes.splice(to..to, piece));
                }
                _ => bytes.truncate(at.max(1)),
            }
        }
        let text = String::from_utf8_lossy(&bytes);
        let Ok(robot) = mjcf::parse(&text, "m.xml") else { continue };
        read += 1;
        let links: Vec<_> =
            robot.description.links.iter().filter_map(|l| Some((l.name.clone(), l.inertia?))).collect();
        if let Ok(files) = mjcf::edit(&text, "m.xml".as_ref(), &links, &robot.joints) {
            assert!(mjcf::parse(&files[0].text, "m.xml").is_ok(), "{}", files[0].text);
        }
    }
    assert!(read > 5, "{read}");
}
