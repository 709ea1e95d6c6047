//! Friction experiments on recorded logs: what they tell and what they cannot.

#![expect(clippy::unwrap_used, reason = "a test may stop, and says what it measured")]

use dynid::friction::{FrictionConfig, FrictionModel, identify_friction};
use dynid_testing::shared;

fn model(text: &str) -> FrictionModel {
    let config = FrictionConfig::parse(text, "test").unwrap();
    identify_friction(&config, &mut |_| {}).unwrap().model(&config).unwrap()
}

/// Single joints of a Gen3 run in one direction at one speed: effort is all that can be stated.
#[test]
fn one_direction_of_the_gen3() {
    let Some(data) = shared("data/kinova-gen3") else { return };
    let mut text = format!("robot = \"{}/gen3.urdf\"\n", data.display());
    text += "[columns]\ntime = { columns = [\"Time\"], unit = \"ms\" }\nposition = \"Position{}\"\n\
             velocity = \"Velocity{}\"\neffort = \"TorqueCur{}\"\ntemperature = \"Temp{}\"\n";
    for k in 1..=7 {
        text += &format!("[[log]]\npath = \"{}/joint_{k}_trapez.csv.gz\"\n", data.display());
        if k == 5 {
            // Row 5847 holds a position of 9e149, which is refused.
            text += "rows = [1, 5846]\n";
        }
    }
    let model = model(&text);
    println!("{:?}\n{:?}", model.verdict, model.warnings);
    assert_eq!((model.verdict.status.word(), model.joints.len()), ("fail", 7), "{:?}", model.warnings);
    for joint in &model.joints {
        let pass = &joint.unpaired[0];
        println!(
            "{}: {} passes, {:.3} rad/s, {:.1} degC, effort {:.2} ± {:.2}",
            joint.joint,
            joint.unpaired.len(),
            pass.speed,
            pass.temperature.unwrap(),
            pass.effort,
            pass.spread
        );
        assert_eq!((joint.status.word(), joint.coulomb, joint.bristle), ("one_direction", None, None));
        assert!(pass.speed > 0.3 && pass.speed < 0.6 && pass.temperature.unwrap() > 30.0);
        let said = joint.notes.join("\n");
        for words in [
            "Coulomb friction and offset or gravity cannot be told apart",
            "viscous friction is not told from Coulomb",
            "too close for lines",
            "sigma0, sigma1 are not identifiable",
        ] {
            assert!(said.contains(words), "{words}: {said}");
        }
    }
}

/// Friction signals of two Franka joints at changing speed: RMS against the plain fits of the data's README (Stribeck friction
/// with an offset) and the published LuGre models.
#[test]
fn friction_signals_of_a_franka() {
    let Some(data) = shared("data/franka-friction") else { return };
    let folder = tempfile::tempdir().unwrap();
    let robot = folder.path().join("robot.toml");
    let joint = "schema = 1\nname = \"one\"\ndh = \"modified\"\n[[joint]]\nname = \"j\"\na = 0.0\nalpha = 0.0\nd = 0.0\noffset = 0.0\n";
    std::fs::write(&robot, joint).unwrap();
    for (file, plain, published) in [
        ("case3_slow", 0.158, 0.280),
        ("case4_slow", 0.083, 0.260),
        ("case4_middle", 0.124, 0.256),
        ("case4_high", 0.175, 0.269),
    ] {
        let text = format!(
            "robot = \"{}\"\n[constant_speed]\nuse_velocity = true\n[columns]\ntime = [\"t\"]\nposition = [\"q\"]\nvelocity = [\"dq\"]\n\
             effort = [\"tau_f\"]\n[[log]]\npath = \"{}/{file}.csv.gz\"\nsignal = \"friction\"\n",
            robot.display(),
            data.display()
        );
        let start = std::time::Instant::now();
        let model = model(&text);
        let joint = &model.joints[0];
        let rms = joint.residual_rms.unwrap();
        println!(
            "{file}: RMS {rms:.4} (plain {plain}, published {published}), {:?} {:.1} s",
            joint.notes,
            start.elapsed().as_secs_f64()
        );
        println!(
            "  F_c {:?} F_s {:?} v_s {:?} {:?} offset {:?}",
            joint.coulomb, joint.static_, joint.stribeck_speed, joint.viscous, joint.offset
        );
        // The README's figures have three digits.
        assert!(rms <= plain + 5e-4, "{file}: {rms} above {plain}");
        assert!(rms < published);
        assert!(joint.notes.iter().any(|n| n.contains("no temperature")), "{:?}", joint.notes);
    }
}
