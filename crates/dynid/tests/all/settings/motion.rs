//! Keys of test motions.

use dynid::motions::{MotionConfig, motion};

use super::identification::folder;
use super::{Case, Changes, Refused, Text, beside, keys, table, top, walk};

/// The motion of a configuration, its own words left out.
fn moved(text: &Text) -> Result<String, String> {
    let robot = if text.top.contains("robot") { "" } else { "robot = \"arm.toml\"\n" };
    let rate = if text.top.contains("sample_rate_hz") { "" } else { "sample_rate_hz = 100\n" };
    let part = if text.tables.contains("[[part]]") { "" } else { SWEEP };
    let path = folder().path().join("motion.toml");
    std::fs::write(&path, format!("{robot}{rate}{}\n{part}\n{}\n", text.top, text.tables)).unwrap();
    let run = || {
        let config = MotionConfig::read(&path)?;
        let run = motion(&config)?;
        let r = &run.record;
        Ok(format!(
            "{:?} {:?} {:?} {:?} {:?} {:?} {:?}",
            run.sampled, run.channels, r.parts, r.limits, r.loads, r.warnings, config.out
        ))
    };
    run().map_err(|e: dynid::Error| e.to_string())
}

const SWEEP: &str = "[[part]]\nsweep = { joint = \"j1\", speeds = [0.5, 1] }\n";
const SMALL: &str = "[[part]]\npresliding = { joint = \"j1\", tones = [[3, 1e-3]] }\n";
const TRACK: &str = "[[part]]\ntrack = { points = [{ j1 = 0 }, { j1 = 1 }, { j1 = 0.5, j2 = 1 }] }\n";
const CIRCLE: &str = "start = { j1 = 0.3, j2 = 1.2 }\n[[part]]\ncircle = { link = \"link2\", point = [0.3, 0, 0], radius = 0.1, turn_s = 4, hold_orientation = false }\n";
const LOAD: &str = "[[part]]\npause_s = 2\n[[load]]\njoint = \"j1\"\npoints = [[0, 1], [1, 2]]\n";

#[test]
fn every_key_of_a_motion_takes_effect_or_is_refused() {
    /// A text with one thing said otherwise; cases live as long as the test.
    fn with(text: &'static str, from: &str, to: &str) -> &'static str {
        assert!(text.contains(from), "{from}");
        Box::leak(text.replacen(from, to, 1).into_boxed_str())
    }
    let tops = |key, before, after| {
        let text = |top| Text { top, ..Text::default() };
        Case { key, before: text(before), after: text(after), expect: Changes }
    };
    let sweep = |key, more| beside(key, SWEEP, with(SWEEP, " }", more), Changes);
    let small = |key, more| beside(key, SMALL, with(SMALL, "1e-3]] }", more), Changes);
    let track = |key, more| beside(key, TRACK, with(TRACK, "j2 = 1 }] }", more), Changes);
    let circle = |key, from, to| beside(key, CIRCLE, with(CIRCLE, from, to), Changes);
    let load = |key, from, to| beside(key, LOAD, with(LOAD, from, to), Changes);
    let cases = vec![
        top("robot", "robot = \"none.toml\"", Refused("none.toml")),
        top("out", "out = \"elsewhere\"", Changes),
        top("sample_rate_hz", "sample_rate_hz = 125", Changes),
        tops("couple_mimics", "robot = \"mimic.urdf\"", "robot = \"mimic.urdf\"\ncouple_mimics = true"),
        top("locked", "locked = { j2 = 0.3 }", Changes),
        top("start", "start = { j2 = 0.3 }", Changes),
        top("start", "start = { j2 = 3 }", Refused("start.j2")),
        top("start", "start = { j3 = 0 }", Refused("j3")),
        top("limits.position", "limits.position = { j1 = [-1, 1.5] }", Changes),
        top("limits.position", "limits.position = { j1 = [-1, 1.5, 2] }", Refused("2 numbers")),
        top("limits.velocity", "limits.velocity = 0.7", Refused("velocity of joint `j1`")),
        top("limits.acceleration", "limits.acceleration = 1", Changes),
        top("limits.acceleration", "limits.acceleration = nan", Refused("limits.acceleration")),
        top("limits.jerk", "limits.jerk = 5", Changes),
        top("limits.share", "limits.share = 0.7", Changes),
        top("limits.share", "limits.share = 1.7", Refused("limits.share")),
        tops("slower", "limits.velocity = 0.7", "slower = true\nlimits.velocity = 0.7"),
        table(
            "part.name",
            "[[part]]\nname = \"first\"\nsweep = { joint = \"j1\", speeds = [0.5, 1] }",
            Changes,
        ),
        table("part.repeat", "[[part]]\nrepeat = 2\nsweep = { joint = \"j1\", speeds = [0.5, 1] }", Changes),
        table("part.pause_s", "[[part]]\npause_s = 1", Changes),
        beside("part.sweep.joint", SWEEP, with(SWEEP, "j1", "j2"), Changes),
        beside("part.sweep.speeds", SWEEP, with(SWEEP, "0.5", "0.6"), Changes),
        sweep("part.sweep.range", ", range = [0, 1.5] }"),
        sweep("part.sweep.acceleration", ", acceleration = 2 }"),
        sweep("part.sweep.longest_s", ", longest_s = 2 }"),
        beside("part.sweep.least_s", SWEEP, with(SWEEP, " }", ", least_s = 9 }"), Refused("at least 9 s")),
        sweep("part.sweep.pause_s", ", pause_s = 0 }"),
        beside("part.presliding.joint", SMALL, with(SMALL, "j1", "j2"), Changes),
        beside("part.presliding.tones", SMALL, with(SMALL, "[3,", "[4,"), Changes),
        small("part.presliding.about", "1e-3]], about = 0.2 }"),
        small("part.presliding.duration_s", "1e-3]], duration_s = 3 }"),
        small("part.presliding.fade_s", "1e-3]], fade_s = 1 }"),
        beside("part.track.points", TRACK, with(TRACK, "0.5", "0.6"), Changes),
        track("part.track.times_s", "j2 = 1 }], times_s = [3, 3] }"),
        track("part.track.speed", "j2 = 1 }], speed = 0.2 }"),
        track("part.track.speed", "j2 = 1 }], speed = { j2 = 0.2 } }"),
        beside(
            "part.track.speed",
            TRACK,
            with(TRACK, "j2 = 1 }] }", "j2 = 1 }], times_s = [3, 3], speed = 1 }"),
            Refused("times_s"),
        ),
        track("part.track.blend_s", "j2 = 1 }], blend_s = 1.2 }"),
        beside(
            "part.circle.link",
            CIRCLE,
            with(CIRCLE, "link2", "link1"),
            Refused("the start pose is singular"),
        ),
        circle("part.circle.point", "0.3, 0, 0", "0.35, 0, 0"),
        circle("part.circle.centre", "radius", "centre = [0.35, 0.4, 0], radius"),
        circle("part.circle.normal", "radius", "normal = [0, 0, -2], radius"),
        circle("part.circle.radius", "0.1,", "0.05,"),
        circle("part.circle.turns", "turn_s", "turns = -2, turn_s"),
        circle("part.circle.turn_s", "turn_s = 4", "turn_s = 5"),
        circle("part.circle.blend_s", "turn_s = 4", "turn_s = 4, blend_s = 2"),
        beside(
            "part.circle.hold_orientation",
            CIRCLE,
            with(CIRCLE, "= false", "= true"),
            Refused("free motions"),
        ),
        beside(
            "part.circle.hold",
            CIRCLE,
            with(CIRCLE, "turn_s", "hold = [\"j2\"], turn_s"),
            Refused("free motions"),
        ),
        load("load.joint", "\"j1\"", "\"j2\""),
        load("load.brake", "points", "brake = true\npoints"),
        load("load.points", "[1, 2]", "[1, 3]"),
        load("load.by_part", "points = [[0, 1], [1, 2]]", "by_part = [3]"),
    ];
    let parse = |text: &str| MotionConfig::parse(text, "motion.toml").err().map(|e| e.to_string());
    walk("motion", &keys(&parse), &cases, &moved);
}
