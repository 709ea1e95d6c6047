//! Keys of virtual logs, designs, friction experiments and on-line identification.

use std::fmt::Write as _;
use std::path::Path;

use dynid::design::{DesignConfig, design};
use dynid::io::csv::{ReadOptions, read};
use dynid::online::Session;
use dynid::servo::{ServoConfig, identify_servo};
use dynid::simulate::{SimulateSettings, VirtualFleet, simulate};
use dynid::{Config, FrictionConfig, Robot, RobotOptions, identify_friction};

use super::identification::{ARM, folder};
use super::{Case, Changes, Expect, Refused, Text, beside, keys, table, top, walk};

/// Lines of defaults for keys that a case does not state itself.
fn defaults(given: &str, lines: &[(&str, &str)]) -> String {
    let stated =
        |key: &str| given.lines().any(|line| line.split('=').next().is_some_and(|k| k.trim() == key));
    lines.iter().filter(|(key, _)| !stated(key)).fold(String::new(), |mut out, (key, value)| {
        writeln!(out, "{key} = {value}").unwrap();
        out
    })
}

fn simulated(text: &Text) -> Result<String, String> {
    let head = defaults(text.top, &[("duration_s", "1.0"), ("rate_hz", "100")]);
    let head = if text.top.contains("follow") { String::new() } else { head };
    let settings = SimulateSettings::parse(&format!("{head}{}\n{}\n", text.top, text.tables), "sim.toml");
    let thermal =
        ARM.replace("elements = [", "elements = [\"exponential_viscous\", ").replace("\"viscous\", ", "");
    let weak = ARM.replace("effort = 100", "effort = 12");
    let arm = match text.top {
        top if top.contains("temperature") => &thermal,
        top if top.contains("weak") => &weak,
        _ => ARM,
    };
    let robot = Robot::parse(arm, Path::new("arm.toml"), &RobotOptions::default()).unwrap();
    if let Some(settings) = settings.as_ref().ok().filter(|settings| settings.fleet.is_some()) {
        let told = |fleet: VirtualFleet| {
            let logs = (0..fleet.len()).map(|k| fleet.about(k));
            format!("{:?} {:?} {:?}", fleet.changes, fleet.outliers, logs.collect::<Vec<_>>())
        };
        return VirtualFleet::new(&robot, settings).map(told).map_err(|e| e.to_string());
    }
    let log = settings.and_then(|settings| simulate(&robot, &settings));
    log.map(|log| format!("{log:?}")).map_err(|e| e.to_string())
}

const CLOSED: &str = "mode = \"closed_loop\"";
/// On a robot with weak drives.
const WEAK: &str = "mode = \"closed_loop\" # weak drives";

#[test]
fn every_key_of_a_virtual_log_takes_effect_or_is_refused() {
    let both = |key, before: [&'static str; 2], after: [&'static str; 2], expect| {
        let text = |[top, tables]: [&'static str; 2]| Text { top, tables, ..Text::default() };
        Case { key, before: text(before), after: text(after), expect }
    };
    // A table of the controlled robot: refused without it, in effect with it.
    let closed = |key, tables: &'static str| both(key, [CLOSED, ""], [CLOSED, tables], Changes);
    let idle = |key, tables: &'static str, words| both(key, [CLOSED, ""], [CLOSED, tables], Refused(words));
    let open = |key, tables: &'static str| table(key, tables, Refused("closed_loop"));
    let stated =
        "[trajectory.j1]\nsine = [0.5]\ncosine = [0.0]\n[trajectory.j2]\nsine = [0.4]\ncosine = [0.0]\n";
    let cases = vec![
        top("duration_s", "duration_s = 1.2", Changes),
        top("rate_hz", "rate_hz = 120", Changes),
        top("harmonics", "harmonics = 2", Changes),
        both("harmonics", ["", stated], ["harmonics = 2", stated], Refused("at random")),
        top("period_s", "period_s = 0.5", Changes),
        top("share", "share = 0.3", Changes),
        both("share", ["", stated], ["share = 0.3", stated], Refused("at random")),
        top("mode", CLOSED, Changes),
        top("effort_noise", "effort_noise = 0.1", Changes),
        top("effort_noise", "mode = \"closed_loop\"\nperfect = true\neffort_noise = 0.1", Refused("perfect")),
        top("encoder_bits", "encoder_bits = 8", Changes),
        top("encoder_bits", "mode = \"closed_loop\"\nperfect = true\nencoder_bits = 8", Refused("perfect")),
        top("delay_samples", "delay_samples = 2", Changes),
        top("delay_samples", "mode = \"closed_loop\"\nperfect = true\ndelay_samples = 2", Refused("perfect")),
        top("acceleration", "acceleration = 2", Changes),
        both("acceleration", ["", stated], ["acceleration = 2", stated], Refused("at random")),
        top("values", "values = { \"j1.fc\" = 3.0 }", Changes),
        top("values", "values = { \"j9.fc\" = 3.0 }", Refused("names of parameters")),
        top("seed", "seed = 2", Changes),
        table("trajectory.offset", "[trajectory.j1]\noffset = 0.3", Changes),
        table("trajectory.sine", "[trajectory.j1]\nsine = [0.3]\ncosine = [0.0]", Changes),
        table("trajectory.cosine", "[trajectory.j1]\nsine = [0.0]\ncosine = [0.3]", Changes),
        beside("fleet.robots", "[fleet]", "[fleet]\nrobots = 3", Changes),
        beside("fleet.logs", "[fleet]", "[fleet]\nlogs = 3", Changes),
        beside("fleet.days", "[fleet]", "[fleet]\ndays = 30", Changes),
        beside("fleet.between_robots", "[fleet]", "[fleet]\nbetween_robots = { fv = 0.5 }", Changes),
        beside(
            "fleet.between_robots",
            "[fleet]",
            "[fleet]\nbetween_robots = { fq = 0.5 }",
            Refused("symbols"),
        ),
        beside("fleet.between_logs", "[fleet]", "[fleet]\nbetween_logs = { fv = 0.5 }", Changes),
        beside("fleet.season", "[fleet]", "[fleet]\nseason = 2", Changes),
        beside("fleet.per_kelvin", "[fleet]", "[fleet]\nper_kelvin = { fc = 0.1 }", Changes),
        beside("fleet.outliers", "[fleet]", "[fleet]\noutliers = 1", Changes),
        beside("fleet.wear", "[fleet]", "[fleet]\nwear = 1", Changes),
        beside("fleet.wear", "[fleet]", "[fleet]\nwear = 99", Refused("as many robots")),
        beside("fleet.faults", "[fleet]", "[fleet]\nfaults = 1", Changes),
        beside("fleet.delays", "[fleet]", "[fleet]\ndelays = 1", Changes),
        beside("fleet.stiffness", "[fleet]", "[fleet]\nstiffness = 1", Refused("no joint is `elastic`")),
        beside("fleet.backlash", "[fleet]", "[fleet]\nbacklash = 1", Refused("without torque sensor")),
        beside("fleet.payload", "[fleet]", "[fleet]\npayload = 2", Changes),
        beside("fleet.payload", "[fleet]", "[fleet]\npayload = -2", Refused("makes sense")),
        beside("fleet.broken", "[fleet]", "[fleet]\nbroken = 0.3", Changes),
        both("fleet.robots", [CLOSED, ""], [CLOSED, "[fleet]\nrobots = 3"], Refused("inverse dynamics")),
        top("drives", "drives = \"none.json\"", Refused("simulate --drives")),
        top("follow", "follow = \"none.json\"", Refused("none.json")),
        top("follow", "follow = \"none.json\"\nshare = 0.3", Refused("follow")),
        top("settle_s", "settle_s = 0.2", Refused("clearance")),
        top("journal_noise", "journal_noise = 1e-6", Refused("clearance")),
        top("perfect", "perfect = true", Refused("closed_loop")),
        top("perfect", "mode = \"closed_loop\"\nperfect = true", Changes),
        both(
            "perfect",
            ["", ""],
            ["mode = \"closed_loop\"\nperfect = true", "[imperfections]\noutlier_share = 0.1"],
            Refused("perfect"),
        ),
        top("log_velocity", "log_velocity = true", Refused("closed_loop")),
        both("log_velocity", [CLOSED, ""], ["mode = \"closed_loop\"\nlog_velocity = true", ""], Changes),
        both(
            "channels",
            ["channels = { temperature = [[0, 20]] }", ""],
            ["channels = { temperature = [[0, 40]] }", ""],
            Changes,
        ),
        both(
            "channels",
            ["channels = { temperature = [[0, 20]] }", ""],
            ["channels = { temperature = [[0, 20]], temperature_j2 = [[0, 40]] }", ""],
            Changes,
        ),
        top("channels", "channels = { wind = [[0, 1]] }", Refused("no element of this robot reads one")),
        open("control.rate_hz", "[control]\nrate_hz = 2000"),
        closed("control.rate_hz", "[control]\nrate_hz = 2000"),
        closed("control.bandwidth_hz", "[control]\nbandwidth_hz = 9"),
        idle(
            "control.bandwidth_hz",
            "[control]\nbandwidth_hz = 9\nposition_gain = [90, 30]\nvelocity_gain = [9, 3]",
            "gains",
        ),
        closed("control.damping", "[control]\ndamping = 0.6"),
        idle("control.damping", "[control]\ndamping = 0.6\nvelocity_gain = [9, 3]", "gains"),
        closed("control.position_gain", "[control]\nposition_gain = [90, 30]"),
        closed("control.velocity_gain", "[control]\nvelocity_gain = [9, 3]"),
        closed("control.feed_forward", "[control]\nfeed_forward = false"),
        closed("control.model_error", "[control]\nmodel_error = 0.3"),
        idle(
            "control.model_error",
            "[control]\nmodel_error = 0.3\nfeed_forward = false\nposition_gain = [90, 30]\nvelocity_gain = [9, 3]",
            "gains",
        ),
        closed("control.velocity_cutoff_hz", "[control]\nvelocity_cutoff_hz = 30"),
        closed("control.delay_ticks", "[control]\ndelay_ticks = 2"),
        both("control.effort_limits", [WEAK, ""], [WEAK, "[control]\neffort_limits = false"], Changes),
        closed("control.passive", "[control]\npassive = [\"j2\"]"),
        open("imperfections.encoder_noise", "[imperfections]\nencoder_noise = 1e-3"),
        closed("imperfections.encoder_noise", "[imperfections]\nencoder_noise = 1e-3"),
        idle("imperfections.velocity_noise", "[imperfections]\nvelocity_noise = 0.1", "log_velocity"),
        both(
            "imperfections.velocity_noise",
            ["mode = \"closed_loop\"\nlog_velocity = true", ""],
            ["mode = \"closed_loop\"\nlog_velocity = true", "[imperfections]\nvelocity_noise = 0.1"],
            Changes,
        ),
        closed("imperfections.effort_noise_absolute", "[imperfections]\neffort_noise_absolute = 1.0"),
        closed("imperfections.ripple_share", "[imperfections]\nripple_share = 0.1"),
        closed("imperfections.ripple_cycles", "[imperfections]\nripple_cycles = 7"),
        idle(
            "imperfections.ripple_cycles",
            "[imperfections]\nripple_share = 0\nripple_cycles = 7",
            "a share above 0",
        ),
        closed("imperfections.outlier_share", "[imperfections]\noutlier_share = 0.2"),
        both(
            "imperfections.outlier_size",
            [CLOSED, "[imperfections]\noutlier_share = 0.2"],
            [CLOSED, "[imperfections]\noutlier_share = 0.2\noutlier_size = 9"],
            Changes,
        ),
        idle(
            "imperfections.outlier_size",
            "[imperfections]\noutlier_share = 0\noutlier_size = 9",
            "a share above 0",
        ),
        closed("imperfections.dropped_share", "[imperfections]\ndropped_share = 0.2"),
        closed("imperfections.clock_jitter_s", "[imperfections]\nclock_jitter_s = 1e-3"),
        open("plant.sign_width", "[plant]\nsign_width = 0.01"),
        closed("plant.sign_width", "[plant]\nsign_width = 0.01"),
        closed("plant.tolerance", "[plant]\ntolerance = 1e-5"),
    ];
    let parse = |text: &str| SimulateSettings::parse(text, "sim.toml").err().map(|e| e.to_string());
    walk("simulate", &keys(&parse), &cases, &simulated);
}

/// Two capsules, which must not touch.
const CAPSULES: &str = "[[capsule]]\nframe = \"base\"\nfrom = [0, 0, 0]\nto = [0.25, 0, 0]\nradius = 0.15\n[[capsule]]\nframe = \"link2\"\nfrom = [0.3, 0, 0]\nto = [0.5, 0, 0]\nradius = 0.15";

fn designed(text: &Text) -> Result<String, String> {
    let head = defaults(text.top, &[("robot", "\"arm.toml\"")]);
    let of = |table: &str| {
        let start = text.tables.find(&format!("[{table}]\n"));
        start.map_or("", |at| text.tables[at..].split("\n[").next().unwrap_or_default())
    };
    let small = [
        (
            "trajectory",
            defaults(of("trajectory"), &[("period_s", "4"), ("harmonics", "3"), ("sample_rate_hz", "50")]),
        ),
        ("search", defaults(of("search"), &[("starts", "1")])),
    ];
    let mut tables = text.tables.to_owned();
    for (name, lines) in small {
        let header = format!("[{name}]\n");
        match tables.contains(&header) {
            true => tables = tables.replacen(&header, &format!("{header}{lines}"), 1),
            false => write!(tables, "\n{header}{lines}").unwrap(),
        }
    }
    let path = folder().path().join("design.toml");
    std::fs::write(&path, format!("{head}{}\n{tables}\n", text.top)).unwrap();
    let run = || {
        let config = DesignConfig::read(&path)?;
        design(&config, &mut |_| {})?.record(&config)
    };
    let record = run().map_err(|e: dynid::Error| e.to_string())?;
    let mut json = serde_json::to_value(&record).unwrap();
    let echoes: Vec<String> = json
        .as_object()
        .unwrap()
        .keys()
        .filter(|key| ["config", "provenance"].contains(&key.as_str()))
        .cloned()
        .collect();
    echoes.iter().for_each(|key| drop(json.as_object_mut().unwrap().remove(key)));
    // Times of a clock are no outcome.
    let mut text = String::new();
    without_clock(&json, &mut text);
    Ok(text)
}

/// All numbers and words but those of clocks.
fn without_clock(json: &serde_json::Value, out: &mut String) {
    match json {
        serde_json::Value::Object(map) => {
            for (key, value) in
                map.iter().filter(|(key, _)| *key != "seconds" && *key != "time_s" && *key != "elapsed_s")
            {
                write!(out, "{key}:").unwrap();
                without_clock(value, out);
            }
        }
        serde_json::Value::Array(list) => list.iter().for_each(|value| without_clock(value, out)),
        other => writeln!(out, "{other}").unwrap(),
    }
}

#[test]
fn every_key_of_a_design_takes_effect_or_is_refused() {
    let criterion = |text| table("criterion.name", text, Changes);
    let region = |key, text| table(key, text, Changes);
    // Beside what gives the key something to act on.
    let told = |key: &'static str, line: &'static str| {
        let guesses = ["servo.gains", "servo.position_gain"].contains(&key);
        let beside = match key {
            "servo.gains" | "servo.position_gain" => "",
            "servo.load" => "position_gain = 4000.0\nlaw = [\"load_friction\"]\n",
            "servo.limited" => "position_gain = 4000.0\nvelocity_gain = 100.0\neffort_limit = 15.0\n",
            "servo.gear_damping" | "servo.backlash" | "servo.encoder" => {
                "position_gain = 4000.0\ngear_stiffness = { j2 = 20000.0 }\n"
            }
            _ => "position_gain = 4000.0\n",
        };
        let text = |more: &str, guesses: bool| Text {
            top: if guesses {
                "values = { \"j1.position_gain\" = 4000.0, \"j2.position_gain\" = 3000.0 }"
            } else {
                ""
            },
            tables: Box::leak(format!("[servo]\n{beside}{more}\n").into_boxed_str()),
            ..Text::default()
        };
        let after = guesses && key != "servo.position_gain";
        Case { key, before: text("", guesses), after: text(line, after), expect: Changes }
    };
    let cases = vec![
        top("robot", "robot = \"longer.toml\"", Changes),
        top("gravity", "gravity = [0, -5, 0]", Changes),
        Case {
            key: "couple_mimics",
            before: Text { top: "robot = \"mimic.urdf\"", ..Text::default() },
            after: Text { top: "robot = \"mimic.urdf\"\ncouple_mimics = true", ..Text::default() },
            expect: Changes,
        },
        table("locked", "[locked]\nj2 = 0.1", Changes),
        table("elements.default", "[elements]\ndefault = [\"viscous\"]", Changes),
        table("elements.joint", "[elements.joint]\nj1 = [\"viscous\"]", Changes),
        table("elements.friction", "[elements]\nfriction = \"stribeck\"", Refused("a design has no logs")),
        table(
            "elements.known_friction",
            "[elements]\nknown_friction = \"none.json\"",
            Refused("known_friction"),
        ),
        table(
            "elements.friction_errors",
            "[elements]\nfriction_errors = \"nonnegative\"",
            Refused("a design has no logs"),
        ),
        table("elements.temperature", "[elements]\ntemperature = 30.0", Refused("a design has no logs")),
        table("elements.clearance", "[elements]\nclearance = \"ideal\"", Refused("joints as ideal")),
        table("limits.singularity", "[limits]\nsingularity = 0.2", Refused("a mechanism with loops")),
        table("limits.singularity", "[limits]\nsingularity = 1.2", Refused("below 1")),
        top("values", "values = { \"j1.fc\" = 30.0 }", Changes),
        table("trajectory.period_s", "[trajectory]\nperiod_s = 5", Changes),
        table("trajectory.harmonics", "[trajectory]\nharmonics = 2", Changes),
        table("trajectory.periods", "[trajectory]\nperiods = 3", Changes),
        table("trajectory.rest", "[trajectory]\nrest = false", Changes),
        table("trajectory.zero_jerk", "[trajectory]\nharmonics = 4\nzero_jerk = true", Changes),
        table("trajectory.zero_jerk", "[trajectory]\nrest = false\nzero_jerk = true", Refused("rest")),
        table("trajectory.start_pose", "[trajectory]\nstart_pose = { j1 = 0.1, j2 = 0.2 }", Changes),
        table("trajectory.parking", "[trajectory]\nparking = { j1 = 0.5 }", Changes),
        table("trajectory.sample_rate_hz", "[trajectory]\nsample_rate_hz = 60", Changes),
        table("trajectory.frames", "[trajectory]\nframes = [\"link9\"]", Refused("link9")),
        table("limits.position", "[limits]\nposition = { j1 = [-1, 1] }", Changes),
        table("limits.velocity", "[limits]\nvelocity = 1.0", Changes),
        table("limits.acceleration", "[limits]\nacceleration = 2.0", Changes),
        table("limits.jerk", "[limits]\njerk = 20.0", Changes),
        table("limits.effort", "[limits]\neffort = 30.0", Changes),
        table("limits.effort", "[limits]\neffort = 30.0\nefforts = false", Refused("efforts")),
        table("limits.share", "[limits]\nshare = 0.5", Changes),
        table("limits.efforts", "[limits]\nefforts = false", Changes),
        table("keep.frames", "[[keep]]\nframes = [\"link9\"]\nabove = -1", Refused("link9")),
        beside(
            "keep.point",
            "[[keep]]
frames = [\"link2\"]
half_space = { normal = [1, 0, 0], offset = 0.1 }",
            "[[keep]]
frames = [\"link2\"]
point = [0.2, 0, 0]
half_space = { normal = [1, 0, 0], offset = 0.1 }",
            Changes,
        ),
        region("keep.above", "[[keep]]\nframes = [\"link2\"]\nabove = -0.5"),
        region(
            "keep.half_space.normal",
            "[[keep]]\nframes = [\"link2\"]\nhalf_space = { normal = [1, 0, 0], offset = 0.1 }",
        ),
        region(
            "keep.half_space.offset",
            "[[keep]]\nframes = [\"link2\"]\nhalf_space = { normal = [1, 0, 0], offset = 0.2 }",
        ),
        region(
            "keep.inside.lower",
            "[[keep]]\nframes = [\"link2\"]\ninside = { lower = [0, -1, -1], upper = [1, 1, 1] }",
        ),
        region(
            "keep.inside.upper",
            "[[keep]]\nframes = [\"link2\"]\ninside = { lower = [-1, -1, -1], upper = [1, 0.2, 1] }",
        ),
        region(
            "keep.outside_cylinder.center",
            "[[keep]]\nframes = [\"link2\"]\noutside_cylinder = { center = [0.4, 0.3], radius = 0.1 }",
        ),
        region(
            "keep.outside_cylinder.radius",
            "[[keep]]\nframes = [\"link2\"]\noutside_cylinder = { radius = 0.2 }",
        ),
        region(
            "keep.outside_column.center",
            "[[keep]]\nframes = [\"link2\"]\noutside_column = { center = [0.4, 0.3], radius = 0.1, height = 1 }",
        ),
        region(
            "keep.outside_column.radius",
            "[[keep]]\nframes = [\"link2\"]\noutside_column = { radius = 0.2, height = 1 }",
        ),
        region(
            "keep.outside_column.height",
            "[[keep]]\nframes = [\"link2\"]\noutside_column = { radius = 0.2, height = 2 }",
        ),
        table(
            "capsule.frame",
            "[safety]\nfloor = false\nself_collision = false\n[[capsule]]\nframe = \"base\"\nfrom = [0, 0, 0]\nto = [0, 0, 0]\nradius = 0.1",
            Refused("two or more"),
        ),
        table("safety.floor", "[safety]\nfloor = false", Changes),
        table("safety.floor_height_m", "[safety]\nfloor_height_m = -0.5", Changes),
        table(
            "safety.floor_height_m",
            "[safety]\nfloor = false\nfloor_height_m = -0.5",
            Refused("floor = true"),
        ),
        table("safety.self_collision", "[safety]\nself_collision = false", Changes),
        table("safety.margin_m", "[safety]\nmargin_m = 0.05", Changes),
        table(
            "safety.margin_m",
            "[safety]\nmargin_m = 0.05\nfloor = false\nself_collision = false",
            Refused("`floor` or `self_collision`"),
        ),
        table("safety.exempt", "[safety]\nexempt = [[\"base\", \"link1\"]]", Refused("kept apart")),
        top("package_dirs", "package_dirs = [\".\"]", Refused("a URDF with meshes")),
        beside(
            "capsule.from",
            CAPSULES,
            "[[capsule]]\nframe = \"base\"\nfrom = [0, 0, 0]\nto = [0.25, 0, 0]\nradius = 0.15\n[[capsule]]\nframe = \"link2\"\nfrom = [0.2, 0, 0]\nto = [0.5, 0, 0]\nradius = 0.15",
            Changes,
        ),
        beside(
            "capsule.to",
            CAPSULES,
            "[[capsule]]\nframe = \"base\"\nfrom = [0, 0, 0]\nto = [0.3, 0, 0]\nradius = 0.15\n[[capsule]]\nframe = \"link2\"\nfrom = [0.3, 0, 0]\nto = [0.5, 0, 0]\nradius = 0.15",
            Changes,
        ),
        beside(
            "capsule.radius",
            CAPSULES,
            "[[capsule]]\nframe = \"base\"\nfrom = [0, 0, 0]\nto = [0.25, 0, 0]\nradius = 0.15\n[[capsule]]\nframe = \"link2\"\nfrom = [0.3, 0, 0]\nto = [0.5, 0, 0]\nradius = 0.12",
            Changes,
        ),
        criterion("[criterion]\nname = \"condition\""),
        table("criterion.columns", "[criterion]\ncolumns = \"inertial\"", Changes),
        table("criterion.noise", "[criterion]\nnoise = 3.0", Changes),
        table("criterion.correlation_time_s", "[criterion]\ncorrelation_time_s = 0.1", Changes),
        table("criterion.mix", "[criterion]\nmix = [1, 5]", Refused("name = \"mix\"")),
        beside(
            "criterion.mix",
            "[criterion]\nname = \"mix\"",
            "[criterion]\nname = \"mix\"\nmix = [1, 500]",
            Changes,
        ),
        top("earlier", "earlier = [\"none.json\"]", Refused("none.json")),
        top("drives", "drives = \"none.json\"", Refused("none.json")),
        table("servo.position_gain", "[servo]\nvelocity_gain = 1.0", Refused("servo.position_gain")),
        table("servo.position_gain", "[servo]\nposition_gain = 4000.0", Changes),
        told("servo.position_gain", "position_gain = 5000.0"),
        table(
            "servo.gain_error",
            "[servo]\nposition_gain = 4000.0\ngain_error = 0.2",
            Refused("servo.gain_error"),
        ),
        told("servo.gains", "gains = \"own\""),
        told("servo.velocity_gain", "velocity_gain = 300.0"),
        told("servo.effort_limit", "effort_limit = 15.0"),
        told("servo.command_limits", "command_limits = { j1 = [-1.0, 1.0] }"),
        told("servo.limited", "limited = \"proportional\""),
        told("servo.direction", "direction = { j2 = -1 }"),
        table(
            "servo.find_directions",
            "[servo]\nposition_gain = 4000.0\nfind_directions = true",
            Refused("servo.find_directions"),
        ),
        told("servo.zero", "zero = { j2 = 0.1 }"),
        told("servo.zero_std", "zero_std = 0.001"),
        told("servo.delay", "delay = 0.03"),
        told("servo.delays", "delays = \"own\""),
        told("servo.hold", "hold = \"line\""),
        told("servo.law", "law = [\"stiction\"]"),
        table("servo.bodies", "[servo]\nposition_gain = 4000.0\nbodies = \"found\"", Refused("servo.bodies")),
        table(
            "servo.body_error",
            "[servo]\nposition_gain = 4000.0\nbody_error = 0.3",
            Refused("servo.body_error"),
        ),
        told("servo.find", "find = [\"smoothing_time\"]"),
        table(
            "servo.find",
            "[servo]\nposition_gain = 4000.0\nfind = [\"compliance\"]",
            Refused("a value to begin from"),
        ),
        told("servo.gear_stiffness", "gear_stiffness = { j2 = 2000.0 }"),
        told("servo.gear_damping", "gear_damping = { j2 = 1.0 }"),
        told("servo.backlash", "backlash = { j2 = 0.01 }"),
        told("servo.encoder", "encoder = \"link\""),
        told("servo.load", "load = \"bodies\""),
        told("servo.step_s", "step_s = 0.001"),
        table("servo.blocks", "[servo]\nposition_gain = 4000.0\nblocks = 30", Refused("servo.blocks")),
        table("servo.fit", "[servo]\nposition_gain = 4000.0\nfit = []", Refused("servo.fit")),
        table(
            "servo.effort_at",
            "[servo]\nposition_gain = 4000.0\neffort_at = \"link\"",
            Refused("servo.effort_at"),
        ),
        table(
            "servo.torque_constant",
            "[servo]\nposition_gain = 4000.0\ntorque_constant = 2.0",
            Refused("servo.torque_constant"),
        ),
        table("search.starts", "[search]\nstarts = 2", Changes),
        table("search.seed", "[search]\nseed = 3", Changes),
        beside(
            "search.time_budget_s",
            "[search]\nstarts = 3",
            "[search]\nstarts = 3\ntime_budget_s = 0",
            Changes,
        ),
        table("search.checkpoint", "[search]\ncheckpoint = \"arm.toml\"", Refused("arm.toml")),
    ];
    let parse = |text: &str| DesignConfig::parse(text, "design.toml").err().map(|e| e.to_string());
    let mut found = keys(&parse);
    found.remove("out");
    walk("design", &found, &cases, &designed);
}

/// A motor that runs at constant speeds forth and back, and one that rests.
fn sweep(rows: usize) -> String {
    let mut text = String::from("t,q_j1,q_j2,v_j1,v_j2,tau_j1,tau_j2,temp_j1,temp_j2\n");
    let mut q = 0.0;
    for row in 0..rows {
        // A second each way, ten speeds one after the other, at two temperatures.
        let (second, half) = (row / 100, (row / 2000) % 2);
        let speed = 0.15 * (1 + (second / 2) % 10) as f64 * if second % 2 == 0 { 1.0 } else { -1.0 };
        let noise = f64::from(u32::try_from(row * 7919 % 101).unwrap()) / 50.0 - 1.0;
        let warm = 20.0 + 20.0 * half as f64;
        let stribeck = 3.0 * (-(speed / 0.2_f64).powi(2)).exp();
        let viscous = (6.0 - 0.08 * warm) * speed.abs().powf(0.8);
        let tau = speed.signum() * (4.0 + stribeck + viscous) + 0.1 * noise;
        let other = 0.1 + 0.0005 * (row as f64 / 300.0).sin();
        writeln!(text, "{},{q},{other},{},0,{tau},0.5,{warm},24", row as f64 / 100.0, speed + 0.002 * noise)
            .unwrap();
        q += speed / 100.0;
    }
    text
}

fn of_friction(text: &Text) -> Result<String, String> {
    let dir = folder().path();
    for (name, rows) in [("sweep.csv", 4000), ("short.csv", 2000)] {
        if !dir.join(name).is_file() {
            std::fs::write(dir.join(name), sweep(rows)).unwrap();
        }
    }
    let path = dir.join("friction.toml");
    let head = defaults(text.top, &[("robot", "\"arm.toml\"")]);
    let log = defaults(
        text.log,
        &[
            ("path", "\"sweep.csv\""),
            ("columns", "{ velocity = \"v_{joint}\", temperature = \"temp_{joint}\" }"),
        ],
    );
    let whole = format!("{head}{}\n{}\n[[log]]\n{log}{}\n", text.top, text.tables, text.log);
    std::fs::write(&path, whole).unwrap();
    let run = || {
        let config = FrictionConfig::read(&path)?;
        let found = identify_friction(&config, &mut |_| {})?;
        let joints: String = found.joints.iter().fold(String::new(), |mut out, j| {
            write!(out, "{:?} {:?} {:?}", j.experiment.pairing, j.law, j.presliding).unwrap();
            out
        });
        let mut json = serde_json::to_value(found.model(&config)?).unwrap();
        json.as_object_mut().unwrap().remove("provenance");
        Ok(format!("{joints}{json}{:?}", found.warnings))
    };
    run().map_err(|e: dynid::Error| e.to_string())
}

fn friction_keys() -> Vec<(&'static str, &'static str, &'static str, Expect)> {
    vec![
        ("robot", "robot = \"none.toml\"", "", Refused("none.toml")),
        ("reference_temperature", "reference_temperature = 35", "", Changes),
        ("temperature_range", "temperature_range = [10, 60]", "", Changes),
        ("thermal_lines", "thermal_lines = \"none\"", "", Changes),
        ("law", "law = \"coulomb_viscous\"", "", Changes),
        ("confidence", "confidence = 0.5", "", Changes),
        (
            "constant_speed.least_duration_s",
            "",
            "[constant_speed]\nleast_duration_s = 5",
            Refused("5 s or more"),
        ),
        (
            "constant_speed.speed_tolerance",
            "",
            "[constant_speed]\nspeed_tolerance = 1e-6\nnoise_tolerance = 0.01",
            Changes,
        ),
        (
            "constant_speed.noise_tolerance",
            "",
            "[constant_speed]\nspeed_tolerance = 1e-6\nnoise_tolerance = 0.02",
            Changes,
        ),
        ("constant_speed.trim_s", "", "[constant_speed]\ntrim_s = 0.2", Changes),
        ("constant_speed.window_s", "", "[constant_speed]\nwindow_s = 0.2", Changes),
        ("constant_speed.least_speed", "", "[constant_speed]\nleast_speed = 0.4", Changes),
        ("constant_speed.use_velocity", "", "[constant_speed]\nuse_velocity = true", Changes),
        ("constant_speed.rest_tolerance", "", "[constant_speed]\nrest_tolerance = 0.0001", Changes),
        ("pairs.speed_tolerance", "", "[pairs]\nspeed_tolerance = 0.6", Changes),
        ("pairs.temperature_tolerance", "", "[pairs]\ntemperature_tolerance = 50", Changes),
        ("pairs.bins", "", "[pairs]\nbins = 6", Changes),
        ("pairs.level_tolerance", "", "[pairs]\nlevel_tolerance = 50", Changes),
        ("prior.sigma0", "", "[prior.j9]\nsigma0 = 1e4\nsigma1 = 10", Refused("j9")),
        ("prior.sigma1", "", "[prior.j1]\nsigma0 = 1e4\nsigma1 = 10", Changes),
    ]
}

#[test]
fn every_key_of_a_friction_experiment_takes_effect_or_is_refused() {
    let mut cases: Vec<Case> = friction_keys()
        .into_iter()
        .map(|(key, top, tables, expect)| Case {
            key,
            before: Text::default(),
            after: Text { top, tables, ..Text::default() },
            expect,
        })
        .collect();
    let log = |key, log, expect| Case {
        key,
        before: Text::default(),
        after: Text { log, ..Text::default() },
        expect,
    };
    cases.extend([
        log("log.path", "path = \"short.csv\"", Changes),
        log("log.joint", "joint = \"j9\"", Refused("j9")),
        log("log.signal", "joint = \"j1\"\nsignal = \"friction\"", Changes),
        log("log.rows", "rows = [1, 2500]", Changes),
        log("log.part", "part = [0.0, 0.6]", Changes),
        log(
            "log.columns.effort",
            "columns = { velocity = \"v_{joint}\", effort = { columns = \"tau_{joint}\", scale = 2.0 } }",
            Changes,
        ),
    ]);
    let presliding = |key, text, expect| table(key, text, expect);
    cases.extend([
        presliding(
            "presliding.path",
            "[[presliding]]\npath = \"none.csv\"\njoint = \"j1\"\ninertia = 1",
            Refused("none.csv"),
        ),
        presliding(
            "presliding.joint",
            "[[presliding]]\npath = \"short.csv\"\njoint = \"j9\"\ninertia = 1",
            Refused("j9"),
        ),
    ]);
    let parse = |text: &str| FrictionConfig::parse(text, "friction.toml").err().map(|e| e.to_string());
    let mut found = keys(&parse);
    // Logs of pre-sliding motion and their keys are those of `bristles`; columns as in an identification.
    found.retain(|key| {
        !key.starts_with("columns.")
            && (!key.starts_with("log.columns.") || key == "log.columns.effort")
            && (!key.starts_with("presliding.")
                || ["presliding.path", "presliding.joint"].contains(&key.as_str()))
    });
    found.remove("out");
    walk("friction", &found, &cases, &of_friction);
}

/// What drives an arm of two joints has, by a configuration.
fn of_servo(files: &Path, text: &Text) -> Result<String, String> {
    let path = files.join("servo.toml");
    let head = defaults(text.top, &[("robot", "\"arm.urdf\"")]);
    let log = defaults(text.log, &[("path", "\"a.csv\"")]);
    // The law is given, so that a key costs one fit.
    let stated = text.tables.strip_prefix("[servo]\n").unwrap_or("");
    let servo = defaults(stated, &[("law", "[\"offset\"]"), ("velocity_gain", "1.0")]);
    let others = if stated.is_empty() { text.tables } else { "" };
    let whole =
        format!("{head}{}\n[[log]]\n{log}{}\n[servo]\n{servo}{stated}\n{others}\n", text.top, text.log);
    std::fs::write(&path, whole).unwrap();
    let run = || {
        let config = ServoConfig::read(&path)?;
        let found = identify_servo(&config, &mut |_| {})?;
        let mut json = serde_json::to_value(found.file(&config, &[])).unwrap();
        json.as_object_mut().unwrap().remove("provenance");
        Ok(json.to_string())
    };
    run().map_err(|e: dynid::Error| e.to_string())
}

#[test]
fn every_key_of_drives_takes_effect_or_is_refused() {
    let folder = crate::servo::folder();
    let files = folder.path();
    let of = |key, top, log, tables, expect| {
        let after = Text { top, log, tables, ..Text::default() };
        Case { key, before: Text::default(), after, expect }
    };
    let servo = |key, tables, expect| of(key, "", "", tables, expect);
    let beside = |key, before, tables| Case {
        key,
        before: Text { tables: before, ..Text::default() },
        after: Text { tables, ..Text::default() },
        expect: Changes,
    };
    // On a log that measures efforts and currents.
    let efforts = |key, top, before: &'static str, after: &'static str| {
        let text = |more: &str| Text {
            top,
            log: "path = \"tau.csv\"",
            tables: Box::leak(format!("[servo]\n{more}\n").into_boxed_str()),
            ..Text::default()
        };
        Case { key, before: text(before), after: text(after), expect: Changes }
    };
    let cases = vec![
        of("robot", "robot = \"none.urdf\"", "", "", Refused("none.urdf")),
        of("lock", "lock = { finger = 0.5 }", "", "", Changes),
        of("gravity", "gravity = [0, 0, -1.62]", "", "", Changes),
        of("log.path", "", "path = \"b.csv\"", "", Changes),
        of("log.rows", "", "rows = [1, 1000]", "", Changes),
        of("log.part", "", "part = [0.0, 0.6]", "", Changes),
        of("validation.path", "", "", "[[validation]]\npath = \"b.csv\"", Changes),
        of("validation.rows", "", "", "[[validation]]\npath = \"b.csv\"\nrows = [1, 600]", Changes),
        of(
            "validation.part",
            "",
            "",
            "[[validation]]\npath = \"b.csv\"\npart = [0.5, 0.2]",
            Refused("two shares"),
        ),
        of("command.position", "", "", "[command]\nposition = \"q_{joint}\"", Changes),
        of("command.velocity", "", "", "[command]\nvelocity = \"cmd_{joint}\"", Changes),
        of("command.effort", "", "", "[command]\neffort = \"cmd_{joint}\"", Changes),
        servo("servo.position_gain", "[servo]\nposition_gain = 25.0", Changes),
        beside(
            "servo.gain_error",
            "[servo]\nposition_gain = 25.0",
            "[servo]\nposition_gain = 25.0\ngain_error = 0.02",
        ),
        servo("servo.gains", "[servo]\ngains = \"own\"", Changes),
        servo("servo.velocity_gain", "[servo]\nvelocity_gain = 0.5", Changes),
        servo("servo.effort_limit", "[servo]\neffort_limit = 6.0", Changes),
        servo("servo.command_limits", "[servo]\ncommand_limits = { elbow = [0.2, 0.7] }", Changes),
        beside(
            "servo.limited",
            "[servo]\neffort_limit = 6.0",
            "[servo]\neffort_limit = 6.0\nlimited = \"proportional\"",
        ),
        servo("servo.direction", "[servo]\ndirection = 2", Refused("1 or -1")),
        servo("servo.find_directions", "[servo]\nfind_directions = true", Changes),
        servo("servo.zero", "[servo]\nzero = { lift = 0.1 }", Changes),
        beside("servo.zero_std", "[servo]\nlaw = [\"zero\"]", "[servo]\nlaw = [\"zero\"]\nzero_std = 0.001"),
        servo("servo.delay", "[servo]\ndelay = 0.004", Changes),
        servo("servo.delays", "[servo]\ndelays = \"own\"", Changes),
        servo("servo.hold", "[servo]\nhold = \"line\"", Changes),
        servo("servo.law", "[servo]\nlaw = []", Changes),
        servo("servo.bodies", "[servo]\nbodies = \"found\"", Changes),
        servo("servo.body_error", "[servo]\nbody_error = 0.3", Refused("servo.body_error")),
        servo("servo.body_error", "[servo]\nbodies = \"found\"\nbody_error = 2.5", Refused("below 2")),
        beside(
            "servo.body_error",
            "[servo]\nbodies = \"found\"",
            "[servo]\nbodies = \"found\"\nbody_error = 0.1",
        ),
        servo("servo.find", "[servo]\nfind = [\"dead_band\"]", Changes),
        servo("servo.gear_stiffness", "[servo]\ngear_stiffness = { lift = 500.0 }", Changes),
        beside(
            "servo.gear_damping",
            "[servo]\ngear_stiffness = { lift = 500.0 }",
            "[servo]\ngear_stiffness = { lift = 500.0 }\ngear_damping = { lift = 0.5 }",
        ),
        beside(
            "servo.backlash",
            "[servo]\ngear_stiffness = { lift = 500.0 }",
            "[servo]\ngear_stiffness = { lift = 500.0 }\nbacklash = { lift = 0.01 }",
        ),
        beside(
            "servo.encoder",
            "[servo]\ngear_stiffness = { lift = 5000.0 }",
            "[servo]\ngear_stiffness = { lift = 5000.0 }\nencoder = \"link\"",
        ),
        beside(
            "servo.load",
            "[servo]\nlaw = [\"load_friction\"]",
            "[servo]\nlaw = [\"load_friction\"]\nload = \"bodies\"",
        ),
        of("current", "current = \"none_{joint}\"", "", "", Refused("none_lift")),
        efforts("servo.fit", "", "", "fit = []"),
        efforts("servo.effort_at", "", "", "effort_at = \"link\""),
        efforts(
            "servo.torque_constant",
            "current = \"i_{joint}\"",
            "fit = [\"current\"]",
            "fit = [\"current\"]\ntorque_constant = 2.5",
        ),
        servo("servo.step_s", "[servo]\nstep_s = 0.002", Changes),
        servo("servo.blocks", "[servo]\nblocks = 8", Changes),
    ];
    let parse = |text: &str| ServoConfig::parse(text, "servo.toml").err().map(|e| e.to_string());
    let mut found = keys(&parse);
    // Columns are those of an identification.
    found.retain(|key| !key.contains("columns"));
    found.remove("out");
    walk("servo", &found, &cases, &|text| of_servo(files, text));
}

/// Events of a stream.
fn streamed(text: &Text) -> Result<String, String> {
    let stated = text.tables.strip_prefix("[online]\n").unwrap_or("");
    let head = defaults(stated, &[("learn_s", "2.0"), ("report_s", "0.5")]);
    let path = folder().path().join("stream.toml");
    let whole = format!(
        "robot = \"arm.toml\"\n[elements]\nfriction = \"given\"\n[online]\n{head}{stated}\n[[log]]\npath = \"a.csv\"\n"
    );
    std::fs::write(&path, whole).unwrap();
    let run = || {
        let config = Config::read(&path)?;
        let table = read(&config.log[0].path, &ReadOptions::default()).unwrap();
        let mut session = Session::new(&config, "a.csv", &table.header, None)?;
        let mut events = String::new();
        for k in 0..table.rows {
            let row: Vec<f64> = table.columns.iter().map(|c| c[k]).collect();
            session.row(&row, &mut |e| writeln!(events, "{e:?}").unwrap())?;
        }
        session.finish(&mut |e| writeln!(events, "{e:?}").unwrap())?;
        Ok(events)
    };
    run().map_err(|e: dynid::Error| e.to_string())
}

#[test]
fn every_key_of_on_line_identification_takes_effect_or_is_refused() {
    let forgets = "[online]\nforgetting = \"constant\"";
    let cases = vec![
        table("online.learn_s", "[online]\nlearn_s = 3.0", Changes),
        table("online.forgetting", forgets, Changes),
        table("online.memory_s", "[online]\nmemory_s = 5", Refused("forgetting")),
        beside("online.memory_s", forgets, "[online]\nforgetting = \"constant\"\nmemory_s = 5", Changes),
        table("online.alarms", "[online]\nalarms = false", Changes),
        table(
            "online.false_alarm_rate",
            "[online]\nalarms = false\nfalse_alarm_rate = 0.5",
            Refused("alarms"),
        ),
        table(
            "online.false_alarm_hours",
            "[online]\nalarms = false\nfalse_alarm_hours = 5",
            Refused("alarms"),
        ),
        table("online.reaction_s", "[online]\nalarms = false\nreaction_s = 1", Refused("alarms")),
        table("online.report_s", "[online]\nreport_s = 1.0", Changes),
        table("online.consistent", "[online]\nconsistent = false", Changes),
        table("online.checkpoint_s", "[online]\ncheckpoint_s = 3", Refused("checkpoint")),
    ];
    let parse = |text: &str| Config::parse(text, "run.toml").err().map(|e| e.to_string());
    let mut found = keys(&parse);
    // The file of the state is written by the program, and tested there.
    found.retain(|key| key.starts_with("online.") && key != "online.checkpoint");
    walk("online", &found, &cases, &streamed);
}
