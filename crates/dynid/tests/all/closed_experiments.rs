//! Experiments on mechanisms with loops: what they carry, friction of their drives.

#![expect(clippy::unwrap_used, reason = "helpers of tests outside of test functions")]

use std::path::Path;

use dynid::friction_model::ViscousModel;
use dynid::model::{Inertia, Mat3, Vec3};
use dynid::motions::config::MotionConfig;
use dynid::motions::{MotionPaths, motion};
use dynid::payload::identify_payloads;
use dynid::simulate::{SimulateSettings, simulate};
use dynid::{Config, FrictionConfig, FrictionModel, Robot, RobotOptions, identify, identify_friction};

use crate::support::write_log;

fn robot(name: &str) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../robots").join(format!("{name}.toml"));
    std::fs::read_to_string(path).unwrap()
}

/// A virtual log of a robot file's text.
fn log(folder: &Path, text: &str, settings: SimulateSettings, file: &str) {
    let robot = Robot::parse(text, Path::new("robot.toml"), &RobotOptions::default()).unwrap();
    let settings =
        SimulateSettings { encoder_bits: 20, delay_samples: Some(0.0), effort_noise: 0.01, ..settings };
    write_log(&simulate(&robot, &settings).unwrap(), &folder.join(file));
}

/// A delta whose platform carries an object. The platform does not turn: the weight shows, and nothing else of the object.
#[test]
fn a_delta_weighs_what_its_platform_carries() {
    let folder = tempfile::tempdir().unwrap();
    let mut bare = robot("delta");
    for k in 1..=3 {
        bare += &format!(
            "[element.arm{k}]\nelements = [\"viscous\", \"coulomb\", \"rotor\"]\nviscous = {{ coefficient = 0.05 }}\n\
             coulomb = {{ effort = 0.3 }}\nrotor = {{ inertia = 0.01 }}\n"
        );
    }
    let object = {
        let about = Mat3::from_rows([[5e-4, 0.0, 0.0], [0.0, 6e-4, 0.0], [0.0, 0.0, 4e-4]]);
        Inertia::from_com(0.5, Vec3([0.01, -0.02, -0.05]), &about)
    };
    let platform =
        [0.62, 0.00248, -0.00186, -0.0124, 0.00135358, 1.744e-05, 2.96e-05, 0.00145792, -2.72e-05, 0.0019155];
    let both: Vec<f64> = platform.iter().zip(object.0).map(|(a, b)| a + b).collect();
    let stated = "phi = [0.62, 0.00248, -0.00186, -0.0124, 0.00135358, 1.744e-05, 2.96e-05, 0.00145792, -2.72e-05, 0.0019155]";
    assert!(bare.contains(stated));
    let loaded = bare.replace(stated, &format!("phi = {both:?}"));
    let settings = |seed| SimulateSettings { duration_s: 30.0, rate_hz: 250.0, seed, ..Default::default() };
    log(folder.path(), &bare, settings(1), "bare.csv");
    log(folder.path(), &loaded, settings(2), "loaded.csv");
    std::fs::write(folder.path().join("robot.toml"), &bare).unwrap();
    let config = |object: &str| {
        let text = format!(
            "robot = \"robot.toml\"\n[[payload]]\nname = \"object\"\n{object}\n[[log]]\npath = \"bare.csv\"\n\
             [[log]]\npath = \"loaded.csv\"\npayload = \"object\"\n"
        );
        std::fs::write(folder.path().join("run.toml"), text).unwrap();
        Config::read(&folder.path().join("run.toml")).unwrap()
    };
    let found = identify_payloads(&config("link = \"platform\"\nrated_mass = 1"), &mut |_| {}).unwrap();
    let record = &found.payloads[0];
    let (mass, std) = (record.mass.value, record.mass.std);
    println!("{}: ± {std:.1e} kg", record.sentence);
    assert!((mass - 0.5).abs() < 3.0 * std && std < 2e-3, "{mass} ± {std}");
    assert!(record.com.iter().chain(&record.inertia).all(|q| q.interval.is_none()));
    assert!(record.sentence.ends_with("of its centre of mass the logs show nothing"), "{}", record.sentence);

    // Known altogether, it is taken off, and what is left is the robot.
    let known =
        "link = \"platform\"\nmass = 0.5\ncom = [0.01, -0.02, -0.05]\ninertia = [5e-4, 0, 0, 6e-4, 0, 4e-4]";
    let run = identify(&config(known), &mut |_| {}).unwrap();
    let doubled = identify(&config(&known.replace("mass = 0.5", "mass = 1")), &mut |_| {}).unwrap();
    let residual = |run: &dynid::Run| run.estimate().fit.filtered.relative_error.unwrap();
    println!("relative error {} %, with twice the mass {} %", residual(&run), residual(&doubled));
    assert!(residual(&doubled) > 3.0 * residual(&run));

    let refused = identify_payloads(&config(""), &mut |_| {}).unwrap_err().to_string();
    assert!(refused.contains("payload.object.link") && refused.contains("platform"), "{refused}");
}

/// Friction of the drives of a five-bar, from sweeps of one crank at a time; with friction in a passive joint the drives show that too.
#[test]
fn friction_of_drives_in_a_loop() {
    let folder = tempfile::tempdir().unwrap();
    let limits = |low: f64, high: f64| {
        format!("limits = {{ position = [{low}, {high}], velocity = 2, effort = 100 }}, axis = [0, 0, 1] }}")
    };
    let mut text = robot("fivebar");
    for (joint, range) in [("", limits(1.5, 2.6)), ("xyz = [0.25, 0, 0], ", limits(0.5, 1.3))] {
        let from = format!("kind = \"revolute\", {joint}axis = [0, 0, 1] }}");
        assert!(text.contains(&from));
        text = text.replace(&from, &format!("kind = \"revolute\", {joint}{range}"));
    }
    for crank in ["left_crank", "right_crank"] {
        text += &format!(
            "[element.{crank}]\nelements = [\"viscous\", \"coulomb\"]\nviscous = {{ coefficient = 0.2 }}\ncoulomb = {{ effort = 0.3 }}\n"
        );
    }
    let model = |text: &str, joint: &str| -> Result<FrictionModel, dynid::Error> {
        let at = |file: &str| folder.path().join(file);
        std::fs::write(at("robot.toml"), text).unwrap();
        let sweep = |crank: &str| {
            format!("[[part]]\nsweep = {{ joint = \"{crank}\", speeds = [0.05, 0.1, 0.2, 0.4, 0.8] }}\n")
        };
        let parts = format!(
            "robot = \"robot.toml\"\nsample_rate_hz = 250\n{}{}",
            sweep("left_crank"),
            sweep("right_crank")
        );
        std::fs::write(at("motion.toml"), parts).unwrap();
        let run = motion(&MotionConfig::read(&at("motion.toml"))?)?;
        run.write(&MotionPaths { samples: at("sweep.csv"), ros_yaml: at("s.yaml"), ros_json: at("s.json") })?;
        log(
            folder.path(),
            text,
            SimulateSettings { follow: Some(at("sweep.csv")), ..Default::default() },
            "log.csv",
        );
        std::fs::write(
            at("friction.toml"),
            format!("robot = \"robot.toml\"\n[[log]]\npath = \"log.csv\"\n{joint}"),
        )
        .unwrap();
        let config = FrictionConfig::read(&at("friction.toml"))?;
        identify_friction(&config, &mut |_| {})?.model(&config)
    };
    let drives = model(&text, "").unwrap();
    assert_eq!(drives.joints.len(), 2);
    for joint in &drives.joints {
        let coulomb = joint.coulomb.unwrap();
        let Some(ViscousModel::Linear { coefficient: viscous }) = joint.viscous else { panic!("{joint:?}") };
        println!("{}: {coulomb} {viscous}", joint.joint);
        assert!((coulomb - 0.3).abs() < 3e-3 && (viscous - 0.2).abs() < 4e-3, "{}", joint.joint);
        assert!(joint.notes.iter().any(|n| n.contains("in a loop")), "{:?}", joint.notes);
    }
    let passive =
        format!("{text}[element.left_distal]\nelements = [\"coulomb\"]\ncoulomb = {{ effort = 0.2 }}\n");
    let shown = model(&passive, "").unwrap().joints[0].coulomb.unwrap();
    println!("with friction in a passive joint {shown}");
    assert!(shown > 0.4);
    let refused = model(&text, "joint = \"left_distal\"").unwrap_err().to_string();
    assert!(refused.contains("left_distal") && refused.contains("right_crank"), "{refused}");
}
