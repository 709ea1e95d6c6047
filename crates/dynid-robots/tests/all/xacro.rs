//! Robots in xacro: what expands to what, arguments, packages, YAML, and files that are at fault.

#![expect(clippy::unwrap_used, reason = "helpers of tests outside of test functions")]

use std::fs;
use std::path::Path;

use dynid_robots::{RobotFileError, XacroFault, robot};

use crate::broken_files::check;

const HEAD: &str = "<robot name=\"r\" xmlns:xacro=\"http://www.ros.org/wiki/xacro\">";

/// The expanded text of what stands in a robot.
fn expanded(inner: &str) -> String {
    let text = format!("{HEAD}{inner}<link name=\"base\"/></robot>");
    robot::parse(&text, "r.urdf.xacro").unwrap_or_else(|e| panic!("{inner}: {e}")).xml.unwrap().to_string()
}

/// The value of the attribute `v` of the first `<a>`.
fn value(inner: &str) -> String {
    let text = expanded(inner);
    let (_, behind) = text.split_once("<a v=\"").unwrap_or_else(|| panic!("{text}"));
    behind.split_once('"').unwrap().0.to_owned()
}

fn fault(inner: &str) -> (String, XacroFault) {
    let text = format!("{HEAD}\n{inner}<link name=\"base\"/></robot>");
    match robot::parse(&text, "r.urdf.xacro") {
        Err(RobotFileError::Xacro { at, fault }) => (at.to_string(), *fault),
        other => panic!("{inner}: {other:?}"),
    }
}

#[test]
fn expressions_are_those_of_python() {
    for (expression, expected) in [
        ("1 + 2 * 3", "7"),
        ("-2 ** 2", "-4"),
        ("2 ** -1", "0.5"),
        ("7 // 2", "3"),
        ("-7 // 2", "-4"),
        ("7 // -2", "-4"),
        ("-7 % 3", "2"),
        ("-7.5 % 3", "1.5"),
        ("8 // 0.002", "3999.0"),
        ("1 / 2", "0.5"),
        ("4 / 2", "2.0"),
        ("pi / 2", "1.5707963267948966"),
        ("radians(90)", "1.5707963267948966"),
        ("math.degrees(math.pi)", "180.0"),
        ("sqrt(2) * sin(0.5) - cos(0)", "-0.32198990115791026"),
        ("1e-5", "1e-05"),
        ("round(2.5)", "2"),
        ("round(2.675, 2)", "2.67"),
        ("max(1, 2.5, 2)", "2.5"),
        ("1 if 2 &gt; 1 else 0", "1"),
        ("1 &lt; 2 &lt;= 2 != 3", "True"),
        ("not 0 and 'a' or 'b'", "a"),
        ("'left' in ['left', 'right']", "True"),
        ("'x' not in 'axle'", "False"),
        ("None == 0", "False"),
        ("True + 1", "2"),
        ("'a' + str(1.0) + 'b' * 2", "a1.0bb"),
        ("'%s_%d' % ('arm', 3)", "arm_3"),
        ("'Left_Arm'.lower().split('_')[-1]", "arm"),
        ("[1, 2, 3][1:][0]", "2"),
        ("[x * 2 for x in range(4) if x % 2 == 1]", "[2, 6]"),
        ("sum([x * y for x, y in [(1, 2), (3, 4)]])", "14"),
        ("dict(a=1, b=2)['b']", "2"),
        ("dict(a=[1, 2]).get('c', 5)", "5"),
        ("len('abc') + len([1])", "4"),
        ("0x10 + 1_000", "1016"),
        ("int('12') + float('0.5')", "12.5"),
    ] {
        assert_eq!(value(&format!("<a v=\"${{{expression}}}\"/>")), expected, "{expression}");
    }
}

#[test]
fn properties_wait_until_they_are_used() {
    let text = "<xacro:property name=\"area\" value=\"${width * height}\"/><xacro:property name=\"width\" value=\"2\"/>\
                <xacro:property name=\"height\" value=\"0.5\"/><xacro:property name=\"unused\" value=\"${nowhere}\"/>";
    assert_eq!(value(&format!("{text}<a v=\"${{area}} $${{area}} $x\"/>")), "1.0 ${area} $x");
    let once = "<xacro:property name=\"a\" default=\"1\"/><xacro:property name=\"a\" default=\"2\"/>";
    assert_eq!(value(&format!("{once}<a v=\"${{a}}\"/>")), "1");
    // Of macros: what is set inside stays inside unless it says otherwise.
    let scopes = "<xacro:property name=\"a\" value=\"1\"/><xacro:property name=\"b\" value=\"1\"/>\
                  <xacro:macro name=\"m\"><xacro:property name=\"a\" value=\"2\"/>\
                  <xacro:property name=\"b\" value=\"${a + 1}\" scope=\"parent\"/></xacro:macro><xacro:m/>";
    assert_eq!(value(&format!("{scopes}<a v=\"${{a}} ${{b}}\"/>")), "1 3");
}

#[test]
fn macros_have_defaults_blocks_and_conditions() {
    let text = "<xacro:property name=\"side\" value=\"left\"/>\
        <xacro:macro name=\"leg\" params=\"name mass:=${2 * 0.5} side:=^|right n:='x y' *origin **more\">\
          <b n=\"${side}_${name}\" m=\"${mass}\" o=\"${n}\"><xacro:insert_block name=\"origin\"/>\
          <xacro:insert_block name=\"more\"/></b>\
          <xacro:if value=\"${mass &gt; 1}\"><heavy/></xacro:if><xacro:unless value=\"${mass &gt; 1}\"><light/></xacro:unless>\
        </xacro:macro>\
        <xacro:leg name=\"hip\"><o xyz=\"${3 - 1} 0 0\"/><any><c/><d/></any></xacro:leg>\
        <xacro:leg name=\"knee\" mass=\"3\" side=\"right\"><o/><any/></xacro:leg>";
    let plain: String = expanded(text).lines().map(str::trim).collect();
    assert!(
        plain.contains("<b n=\"left_hip\" m=\"1.0\" o=\"x y\"><o xyz=\"2 0 0\"/><c/><d/></b><light/>"),
        "{plain}"
    );
    assert!(plain.contains("<b n=\"right_knee\" m=\"3\" o=\"x y\"><o/></b><heavy/>"), "{plain}");
}

/// A block means what it means where the call stands, though the macro has a parameter of the same name; and it may be handed on.
#[test]
fn blocks_are_of_the_place_of_their_call() {
    let text = "<xacro:property name=\"x\" value=\"1\"/>\
        <xacro:macro name=\"inner\" params=\"x *origin\"><a v=\"${x}\"/><xacro:insert_block name=\"origin\"/></xacro:macro>\
        <xacro:macro name=\"outer\" params=\"*origin\"><xacro:inner x=\"7\"><xacro:insert_block name=\"origin\"/></xacro:inner></xacro:macro>\
        <xacro:outer><o v=\"${x}\"/></xacro:outer>";
    let plain: String = expanded(text).lines().map(str::trim).collect();
    assert!(plain.contains("<a v=\"7\"/><o v=\"1\"/>"), "{plain}");
}

#[test]
fn names_elements_and_attributes_may_be_computed() {
    let text = "<xacro:macro name=\"m_1\" params=\"v\"><a v=\"${v}\"/></xacro:macro>\
                <xacro:call macro=\"m_${1}\" v=\"5\"/>\
                <xacro:element xacro:name=\"b${2}\"><xacro:attribute name=\"k\" value=\"${1 + 1}\"/></xacro:element>";
    let plain: String = expanded(text).lines().map(str::trim).collect();
    assert!(plain.contains("<a v=\"5\"/><b2 k=\"2\"/>"), "{plain}");
}

#[test]
fn files_arguments_packages_and_yaml_are_read() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str, text: &str| {
        let path = folder.path().join(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(&path, text).unwrap();
        path
    };
    at("arm_description/package.xml", "<package><name>arm_description</name></package>");
    at(
        "arm_description/config/arm.yaml",
        "masses: {upper: 2.5, lower: 1}\nangle: !degrees 180\ntilt: !radians pi/4\n",
    );
    at(
        "arm_description/urdf/parts.xacro",
        "<robot xmlns:xacro=\"x\"><xacro:property name=\"half\" value=\"${whole / 2}\"/><xacro:property name=\"whole\" value=\"3\"/>\
         <xacro:macro name=\"body\" params=\"name mass\"><link name=\"$(arg prefix)${name}\"><inertial><mass value=\"${mass}\"/>\
         <inertia ixx=\"1\" ixy=\"0\" ixz=\"0\" iyy=\"1\" iyz=\"0\" izz=\"1\"/></inertial></link></xacro:macro></robot>",
    );
    let main = at(
        "bringup/robots/arm.urdf.xacro",
        "<robot name=\"$(arg prefix)arm\" xmlns:xacro=\"x\"><xacro:arg name=\"prefix\" default=\"my_\"/>\
         <xacro:include filename=\"$(find arm_description)/urdf/parts.xacro\" ns=\"parts\"/>\
         <xacro:include filename=\"nowhere.xacro\" optional=\"true\"/>\
         <xacro:property name=\"data\" value=\"${xacro.load_yaml('../../arm_description/config/arm.yaml')}\"/>\
         <xacro:parts.body name=\"upper\" mass=\"${data.masses.upper}\"/>\
         <xacro:parts.body name=\"lower\" mass=\"${data['masses']['lower'] * parts.half}\"/>\
         <joint name=\"elbow\" type=\"revolute\"><parent link=\"$(arg prefix)upper\"/><child link=\"$(arg prefix)lower\"/>\
         <origin rpy=\"0 0 ${data['angle'] + data.tilt}\"/><limit lower=\"-1\" upper=\"1\" effort=\"9\" velocity=\"9\"/></joint></robot>",
    );
    let read = robot::read(&main).unwrap();
    let masses: Vec<(String, f64)> =
        read.description.links.iter().map(|l| (l.name.clone(), l.inertia.unwrap().0[0])).collect();
    assert_eq!(masses, [("my_upper".to_owned(), 2.5), ("my_lower".to_owned(), 1.5)]);
    let names: Vec<&str> = read.sources.iter().map(|s| s.path.rsplit('/').next().unwrap()).collect();
    assert_eq!(names, ["arm.urdf.xacro", "parts.xacro", "arm.yaml"]);
    assert_eq!(robot::stem(Path::new("a/arm.urdf.xacro#prefix:=x")), "arm");

    let stated = robot::read(format!("{}#prefix:=left_", main.display())).unwrap();
    assert_eq!(stated.description.links[0].name, "left_upper");
    let error = robot::read(format!("{}#prefx:=left_", main.display())).unwrap_err();
    check(&error.to_string(), error.hint().as_deref(), &["`prefx`; it has prefix"], "correct");
    let error = robot::read(format!("{}#left_", main.display())).unwrap_err();
    check(&error.to_string(), error.hint().as_deref(), &["`name:=value`", "`left_`"], "prefix:=left_");
}

#[test]
fn data_of_any_size_is_refused_beyond_its_bounds() {
    let folder = tempfile::tempdir().unwrap();
    let laughs = (1..30).fold("a0: &a0 [1, 2, 3, 4]\n".to_owned(), |text, k| {
        let below = format!("*a{}, ", k - 1).repeat(4);
        format!("{text}a{k}: &a{k} [{below}]\n")
    });
    let wide: String = (0..10_000).map(|k| format!("k{k}: {k}\n")).collect();
    let main = folder.path().join("arm.xacro");
    let text = format!(
        "{HEAD}<xacro:property name=\"d\" value=\"${{xacro.load_yaml('data.yaml')}}\"/><link name=\"${{d}}\"/></robot>"
    );
    fs::write(&main, text).unwrap();
    for data in [laughs, wide] {
        fs::write(folder.path().join("data.yaml"), data).unwrap();
        let error = robot::read(&main).unwrap_err().to_string();
        assert!(error.contains("at most"), "{error}");
    }
}

/// A robot whose comments or texts speak of xacro is no xacro: it is edited byte for byte.
#[test]
fn a_comment_makes_no_xacro() {
    let text =
        "<robot name=\"r\"><!-- made from <xacro:arm prefix=\"${x}\"/> --><link name=\"base\"/></robot>";
    let read = robot::parse(text, "r.urdf").unwrap();
    assert_eq!(read.xml.unwrap().to_string(), text);
}

#[test]
fn faults_have_places_and_hints() {
    for (inner, place, message) in [
        ("<a v=\"${x}\"/>", "r.urdf.xacro:2:1", "`x`: `x` is not defined"),
        ("<a v=\"${1 +}\"/>", "r.urdf.xacro:2:1", "`1 +`: expected a value, found the end"),
        ("<a v=\"${1 / 0}\"/>", "r.urdf.xacro:2:1", "a division by zero"),
        ("<a v=\"${sqrt(-1)}\"/>", "r.urdf.xacro:2:1", "`sqrt` has no value at -1"),
        ("<a v=\"${lambda x: x}\"/>", "r.urdf.xacro:2:1", "`lambda`, which is not read"),
        ("<a v=\"${'a' + 1}\"/>", "r.urdf.xacro:2:1", "`+` does not take a str and a int"),
        ("<a v=\"${2 ** 70}\"/>", "r.urdf.xacro:2:1", "64 bits"),
        ("<a v=\"${1\"/>", "r.urdf.xacro:2:1", "closing `}`"),
        ("<a v=\"$(arg x)\"/>", "r.urdf.xacro:2:1", "expected a value of the argument `x`"),
        ("<a v=\"$(find nowhere)\"/>", "r.urdf.xacro:2:1", "expected the package `nowhere`"),
        ("<a v=\"$(env DYNID_NO_SUCH)\"/>", "r.urdf.xacro:2:1", "not set"),
        ("<a/>\n <xacro:leg/>", "r.urdf.xacro:3:2", "`xacro:leg`, which is not defined"),
        ("<xacro:if value=\"maybe\"/>", "r.urdf.xacro:2:1", "`maybe`"),
        ("<xacro:if/>", "r.urdf.xacro:2:1", "expected value, found none"),
        ("<xacro:property name=\"a b\" value=\"1\"/>", "r.urdf.xacro:2:1", "`a b`"),
        ("<xacro:property name=\"a\" value=\"1\" valeu=\"2\"/>", "r.urdf.xacro:2:1", "`valeu`"),
        (
            "<xacro:property name=\"a\" value=\"${a}\"/><a v=\"${a}\"/>",
            "r.urdf.xacro:2:40",
            "by way of itself",
        ),
        ("<xacro:include filename=\"nowhere.xacro\"/>", "r.urdf.xacro:2:1", "`nowhere.xacro` cannot be read"),
        ("<xacro:insert_block name=\"b\"/>", "r.urdf.xacro:2:1", "name of a block"),
        ("<xacro:macro name=\"m\" params=\"a\"/><xacro:m b=\"1\"/>", "r.urdf.xacro:2:35", "found `b`"),
        ("<xacro:macro name=\"m\" params=\"a\"/><xacro:m/>", "r.urdf.xacro:2:35", "a value of `a`"),
        ("<xacro:macro name=\"m\" params=\"*a\"/><xacro:m/>", "r.urdf.xacro:2:36", "the block `*a`"),
        ("<xacro:macro name=\"m\"/><xacro:m><c/></xacro:m>", "r.urdf.xacro:2:24", "no further block"),
    ] {
        let (at, fault) = fault(inner);
        assert_eq!(at, place, "{inner}: {fault}");
        assert!(fault.to_string().contains(message), "{inner}: {fault}");
        assert!(!fault.hint("r.urdf.xacro").is_empty());
    }
    let definitions =
        robot::parse(&format!("{HEAD}<xacro:macro name=\"m\"/></robot>"), "r.xacro").unwrap_err();
    check(
        &definitions.to_string(),
        definitions.hint().as_deref(),
        &["definitions alone"],
        "calls its macros",
    );
    // Lines of what was expanded are not those of the file, and the message says so.
    let text =
        format!("{HEAD}<link name=\"a\"><inertial><mass value=\"${{'heavy'}}\"/></inertial></link></robot>");
    let error = robot::parse(&text, "r.xacro").unwrap_err().to_string();
    assert!(error.contains("r.xacro (expanded):"), "{error}");
}

/// Files that would grow without end are refused soon, and with little memory.
#[test]
fn growth_has_bounds() {
    let endless = "<xacro:macro name=\"m\"><xacro:m/></xacro:macro><xacro:m/>";
    let doubling = (0..60).fold("<xacro:macro name=\"m0\"><a/></xacro:macro>".to_owned(), |text, k| {
        format!("{text}<xacro:macro name=\"m{}\"><xacro:m{k}/><xacro:m{k}/></xacro:macro>", k + 1)
    }) + "<xacro:m60/>";
    let silent = doubling.replace("<a/>", "");
    let texts = (0..60).fold("<xacro:property name=\"t0\" value=\"0123456789\"/>".to_owned(), |text, k| {
        format!("{text}<xacro:property name=\"t{}\" value=\"${{t{k}}}${{t{k}}}\"/>", k + 1)
    }) + "<a v=\"${t60}\"/>";
    let nested = format!("<a v=\"${{{}1{}}}\"/>", "(".repeat(5_000), ")".repeat(5_000));
    let long = format!("<a v=\"${{1{}}}\"/>", "+1".repeat(5_000));
    let lists = "<a v=\"${[0] * 1000000000}\"/>";
    let loops = "<a v=\"${[1 for x in range(100000) for y in range(2)]}\"/>";
    let work = "<a v=\"${len([[x for x in range(100000)] for y in range(100000)])}\"/>";
    let chained = (0..3_000).fold("<xacro:property name=\"t0\" value=\"1\"/>".to_owned(), |text, k| {
        format!("{text}<xacro:property name=\"t{}\" value=\"${{t{k} + 1}}\"/>", k + 1)
    }) + "<a v=\"${t3000}\"/>";
    // What is small to write and large to hold.
    let rows = "<a v=\"${len([[0] * 100000 for y in range(100000)])}\"/>";
    let shown = "<a v=\"${len(str([[0] * 1000] * 100000))}\"/>";
    let words = "<a v=\"${len(['x' * 1000000 for y in range(100000)])}\"/>";
    let shared = (0..60).fold("<xacro:property name=\"l0\" value=\"${[1, 2]}\"/>".to_owned(), |text, k| {
        format!("{text}<xacro:property name=\"l{}\" value=\"${{[l{k}, l{k}]}}\"/>", k + 1)
    }) + "<a v=\"${l60 == [l59, l59]}\"/>";
    for inner in [
        endless, &doubling, &silent, &texts, &nested, &long, lists, loops, work, &chained, rows, shown,
        words, &shared,
    ] {
        let (_, fault) = fault(inner);
        let text = fault.to_string();
        assert!(text.contains("at most") || text.contains("expected one `for`"), "{text}");
    }
    // What is deep and not endless is expanded.
    let counted = "<xacro:macro name=\"m\" params=\"n\"><xacro:if value=\"${n &gt; 0}\"><xacro:m n=\"${n - 1}\"/></xacro:if>\
                   <xacro:unless value=\"${n &gt; 0}\"><a v=\"${n}\"/></xacro:unless></xacro:macro><xacro:m n=\"200\"/>";
    assert_eq!(value(counted), "0");
}
