//! Joints with clearance in robot files: what is read, and what is told about bad ones.

#![expect(clippy::unwrap_used, reason = "helpers of tests outside of test functions")]

use dynid_model::contact::{ContactLaw, SlidingFriction};
use dynid_robots::{ClearanceSpec, RobotFileError, toml_robot};

/// One joint, a link of 2 kg, and a table of clearance.
fn file(joint: &str, clearance: &str) -> String {
    format!(
        "[[joint]]\nname = \"j1\"\n{joint}\n[[joint]]\nname = \"j2\"\n[element.j1]\nclearance = {clearance}\n"
    )
}

const BODY: &str = "mass = 2.0";

fn read(clearance: &str) -> Result<ClearanceSpec, RobotFileError> {
    let robot = toml_robot::parse(&format!("dh = \"modified\"\n{}", file(BODY, clearance)), "arm.toml")?;
    Ok(robot.elements.clearance[0].clone())
}

/// The message about a table: names the file, the line of the element and the joint.
#[track_caller]
fn refused(clearance: &str, parts: &[&str]) {
    let message = read(clearance).unwrap_err().to_string();
    assert!(message.starts_with("arm.toml:7:1: element.j1: "), "{message}");
    assert!(!message.contains('\n'), "{message}");
    for part in parts {
        assert!(message.contains(part), "expected `{part}`: {message}");
    }
}

#[test]
fn defaults_are_those_of_the_laws() {
    let spec = read("{ journal_radius = 0.01, gap = 5e-5, width = 0.02 }").unwrap();
    assert_eq!(spec.joint, "j1");
    assert_eq!((spec.journal_radius, spec.gap()), (0.01, 5e-5));
    assert_eq!(spec.friction, SlidingFriction::default());
    let ContactLaw::Fractal(law) = &spec.law else { panic!("{:?}", spec.law) };
    let settings = law.settings();
    assert_eq!((settings.mass, settings.restitution, settings.force_index), (2.0, 0.9, 1.5));
    assert_eq!(law.surface().settings().roughness_um, 0.8);
    assert_eq!(law.bearing().width(), 0.02);
}

#[test]
fn every_key_reaches_its_law() {
    let spec = read(
        "{ journal_radius = 0.01, bearing_radius = 0.0101, width = 0.03, law = \"rough\", roughness_um = 1.2, mass = 3, \
         area_ratio = 0.02, restitution = 0.8, exponent = 1, yield_strength = 4e8, youngs_modulus = [2e11, 1.1e11], \
         poisson_ratio = [0.3, 0.34], hardness_ratio = 2.5, pressure_factor = 0.577, profile_constant = 1.6, \
         impact_speed_floor = 0.02, friction = 0.2, v_0 = 2e-5, v_m = 3e-4 }",
    )
    .unwrap();
    let ContactLaw::Fractal(law) = &spec.law else { panic!("{:?}", spec.law) };
    let (settings, surface) = (law.settings(), law.surface().settings());
    assert_eq!((settings.mass, settings.area_ratio, settings.restitution), (3.0, 0.02, 0.8));
    assert_eq!((settings.force_index, settings.impact_speed_floor), (1.0, 0.02));
    assert_eq!((surface.roughness_um, surface.friction, surface.yield_strength), (1.2, 0.2, 4e8));
    assert_eq!((surface.hardness_ratio, surface.profile_constant), (2.5, 1.6));
    // The bearing yields first.
    assert_eq!((surface.softer.youngs_modulus, surface.softer.poisson_ratio), (1.1e11, 0.34));
    assert_eq!(law.surface().constants().pressure_factor, 0.577);
    assert_eq!(spec.friction, SlidingFriction::new(0.2, 2e-5, 3e-4).unwrap());
    assert!((spec.gap() - 1e-4).abs() < 1e-17, "{}", spec.gap());

    let law = |text: &str| read(&format!("{{ journal_radius = 0.01, gap = 5e-5, {text} }}")).unwrap().law;
    let ContactLaw::LankaraniNikravesh(given) =
        law("law = \"lankarani_nikravesh\", stiffness = 1e9, restitution = 0.7, impact_speed_floor = 0.03")
    else {
        panic!("another law")
    };
    assert_eq!((given.stiffness().coefficient(), given.restitution()), (1e9, 0.7));
    assert_eq!(given.impact_speed_floor(), 0.03);
    // 4/3 E* sqrt(R1 R2/(R1 - R2)) of steel on steel.
    let ContactLaw::Hertz(steel) = law("law = \"hertz\"") else { panic!("another law") };
    let expected = 4.0 / 3.0 * 207e9 / (2.0 * 0.91) * (0.01005_f64 * 0.01 / 5e-5).sqrt();
    assert!((steel.stiffness().coefficient() / expected - 1.0).abs() < 1e-12);
    let ContactLaw::KelvinVoigt(linear) = law("law = \"kelvin_voigt\", stiffness = 1e7, damping = 300")
    else {
        panic!("another law")
    };
    assert_eq!((linear.stiffness(), linear.damping()), (1e7, 300.0));
}

#[test]
fn bad_numbers_are_told_with_field_and_range() {
    let with = |text: &str| format!("{{ journal_radius = 0.01, width = 0.02, {text} }}");
    for gap in ["0", "-1e-5"] {
        refused(&with(&format!("gap = {gap}")), &["clearance.gap: ", "above 0 m"]);
    }
    refused(&with("gap = nan"), &["clearance.gap: ", "finite number", "nan"]);
    refused(&with("gap = 5e-5, mass = inf"), &["clearance.mass: ", "finite number"]);
    refused(&with("gap = 5e-5, mass = -1"), &["clearance.mass: ", "above 0 kg", "`-1`"]);
    refused(&with("bearing_radius = 0.009"), &["clearance.bearing_radius: ", "above that of the journal"]);
    refused(&with("gap = 5e-5, bearing_radius = 0.01005"), &["clearance.bearing_radius: ", "beside `gap`"]);
    refused(&with("friction = 0.1"), &["clearance: ", "`gap`", "`bearing_radius`", "found none"]);
    for restitution in ["0", "1.5", "-0.2"] {
        let text = with(&format!("gap = 5e-5, restitution = {restitution}"));
        refused(&text, &["clearance.restitution: ", "in (0, 1]", restitution]);
    }
    // Fractal dimensions beyond 3 and below 2.
    for roughness in ["0.001", "20000"] {
        let text = with(&format!("gap = 5e-5, roughness_um = {roughness}"));
        refused(&text, &["clearance.roughness_um: ", "fractal dimension in (2, 3)", "D = "]);
    }
    refused(&with("gap = 5e-5, exponent = 3"), &["clearance.exponent: ", "in [1, 2]"]);
    refused(&with("gap = 5e-5, friction = -0.1"), &["clearance.friction: ", "at least 0"]);
    refused(&with("gap = 5e-5, v_0 = 1e-3"), &["clearance.v_m: ", "above `v_0`"]);
    refused(
        &with("gap = 5e-5, youngs_modulus = [2e11]"),
        &["clearance.youngs_modulus: ", "[journal, bearing]"],
    );
    refused(&with("gap = 5e-5, poisson_ratio = 0.6"), &["clearance.poisson_ratio: ", "(-1, 0.5]"]);
    refused(&with("gap = \"wide\""), &["clearance.gap: ", "finite number", "wide"]);
    refused("{ gap = 5e-5, width = 0.02 }", &["clearance: ", "`journal_radius`", "found none"]);
    refused("{ gap = 5e-5, journal_radius = 0.01 }", &["clearance: ", "`width`", "found none"]);
    refused("5e-5", &["clearance: ", "a table"]);
}

#[test]
fn keys_that_the_law_does_not_use_are_slips() {
    let with = |text: &str| format!("{{ journal_radius = 0.01, gap = 5e-5, {text} }}");
    refused(&with("width = 0.02, law = \"soft\""), &["clearance.law: ", "kelvin_voigt", "`soft`"]);
    refused(&with("width = 0.02, wdth = 1"), &["clearance: ", "journal_radius", "`wdth`"]);
    refused(&with("width = 0.02, damping = 3"), &["clearance.damping: ", "law `rough`"]);
    refused(&with("law = \"hertz\", restitution = 0.9"), &["clearance.restitution: ", "law `hertz`"]);
    refused(&with("law = \"hertz\", width = 0.02"), &["clearance.width: ", "law `hertz`"]);
    let both = "law = \"hertz\", stiffness = 1e9, poisson_ratio = 0.3";
    refused(&with(both), &["clearance.poisson_ratio: ", "beside `stiffness`"]);
    refused(&with("law = \"kelvin_voigt\", damping = 3"), &["clearance: ", "`stiffness`", "found none"]);
    refused(&with("law = \"kelvin_voigt\", stiffness = 1e7"), &["clearance: ", "`damping`", "found none"]);
}

#[test]
fn joints_that_cannot_have_a_journal_are_refused() {
    let good = "{ journal_radius = 0.01, gap = 5e-5, width = 0.02, mass = 1 }";
    let refused = |text: &str, parts: &[&str]| {
        let message = toml_robot::parse(text, "arm.toml").unwrap_err().to_string();
        for part in parts.iter().chain(&["arm.toml:", "element.j1: clearance: ", "a joint that turns"]) {
            assert!(message.contains(part), "expected `{part}`: {message}");
        }
    };
    let dh = format!("dh = \"modified\"\n{}", file("kind = \"prismatic\"", good));
    refused(&dh, &["a joint that slides"]);
    for (kind, found) in
        [("fixed", "a fixed joint"), ("floating", "a floating joint"), ("helical", "a screw")]
    {
        let pitch = if kind == "helical" { ", axis = [0, 0, 1], pitch = 0.01" } else { "" };
        let body = format!(
            "[[body]]\nname = \"a\"\nparent = \"base\"\njoint = {{ name = \"j1\", kind = \"{kind}\"{pitch} }}\n\
             [element.j1]\nclearance = {good}\n"
        );
        refused(&body, &[found]);
    }
    let folder = tempfile::tempdir().unwrap();
    let urdf = "<robot name=\"r\"><link name=\"b\"/><link name=\"l\"/><link name=\"m\"/>\
        <joint name=\"j1\" type=\"revolute\"><parent link=\"b\"/><child link=\"l\"/><axis xyz=\"0 0 1\"/>\
        <limit lower=\"-1\" upper=\"1\" velocity=\"1\" effort=\"1\"/></joint>\
        <joint name=\"j2\" type=\"revolute\"><parent link=\"l\"/><child link=\"m\"/><axis xyz=\"0 0 1\"/>\
        <limit lower=\"-1\" upper=\"1\" velocity=\"1\" effort=\"1\"/><mimic joint=\"j1\"/></joint></robot>";
    std::fs::write(folder.path().join("r.urdf"), urdf).unwrap();
    let path = folder.path().join("arm.toml");
    std::fs::write(&path, format!("urdf = \"r.urdf\"\n[element.j1]\nclearance = {good}\n")).unwrap();
    let message = toml_robot::read(&path).unwrap_err().to_string();
    assert!(message.contains("coupled to others") && message.contains("arm.toml:2:1"), "{message}");

    // Neither beside a spring, nor at its motor.
    let dh = |more: &str| format!("dh = \"modified\"\n{}{more}", file(BODY, good));
    let message = toml_robot::parse(&dh("elastic = { ratio = 10 }\n"), "arm.toml").unwrap_err().to_string();
    assert!(message.contains("element.j1: clearance: ") && message.contains("`elastic`"), "{message}");
    let motor = format!("[element.j2]\nelastic = {{ ratio = 9 }}\n[element.j2_motor]\nclearance = {good}\n");
    let message = toml_robot::parse(&dh(&motor), "arm.toml").unwrap_err().to_string();
    assert!(message.contains("element.j2_motor: clearance: "), "{message}");
}

#[test]
fn a_rough_contact_needs_the_mass_of_its_link() {
    let good = "{ journal_radius = 0.01, gap = 5e-5, width = 0.02 }";
    let text = format!("dh = \"modified\"\n{}", file("link = \"arm\"", good));
    let message = toml_robot::parse(&text, "arm.toml").unwrap_err().to_string();
    assert!(message.contains("`mass` in kg") && message.contains("link `arm`"), "{message}");
    let other = "{ journal_radius = 0.01, gap = 5e-5, law = \"hertz\" }";
    let text = format!("dh = \"modified\"\n{}", file("link = \"arm\"", other));
    assert_eq!(toml_robot::parse(&text, "arm.toml").unwrap().elements.clearance.len(), 1);
}
