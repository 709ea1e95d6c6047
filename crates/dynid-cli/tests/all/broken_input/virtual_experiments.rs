//! Settings of `simulate` in closed loop.

use super::harness::{Case, case, check};

const ARGS: &str = "simulate robot.urdf --config bad.toml --out a.csv";

/// A closed loop with more lines.
fn closed_loop(more: &str, message: &'static [&'static str]) -> Case {
    case("bad.toml", format!("mode = \"closed_loop\"\nduration_s = 0.5\n{more}\n"), ARGS, message, "")
}

#[test]
fn are_refused() {
    check(&[
        case("bad.toml", "mode = \"open_loop\"\n", ARGS, &["bad.toml:1", "open_loop", "closed_loop"], ""),
        case("bad.toml", "[control]\nrate_hz = 500\n", ARGS, &["control", "closed_loop"], ""),
        case("bad.toml", "perfect = true\n", ARGS, &["perfect", "closed_loop"], ""),
        closed_loop("[imperfections]\nripple = 1", &["bad.toml:4", "`ripple`", "ripple_share"]),
        closed_loop("[imperfections]\noutlier_share = 2", &["outlier_share", "0 to 0.5", "2"]),
        closed_loop("[imperfections]\nencoder_noise = -1", &["encoder_noise", "not negative", "-1"]),
        closed_loop("[imperfections]\nclock_jitter_s = nan", &["clock_jitter_s", "finite", "NaN"]),
        closed_loop("[control]\nrate_hz = 750", &["log rate", "whole number", "500 Hz", "750 Hz"]),
        closed_loop("[control]\nbandwidth_hz = 300", &["bandwidth", "tenth", "300"]),
        closed_loop("[control]\nposition_gain = [1]", &["position gain", "expected 2", "found 1"]),
        closed_loop("[control]\nmodel_error = 7", &["control.model_error", "0 to 1", "7"]),
        closed_loop("[control]\npassive = [\"wrist\"]", &["wrist"]),
        closed_loop("[plant]\nsign_width = 0", &["sign_width", "positive", "0"]),
        closed_loop("[plant]\ntolerance = 1", &["tolerance", "1e-2", "1"]),
        closed_loop("delay_samples = 1e3", &["effort_delay_samples", "100", "1000"]),
        closed_loop("channels = { temperature = [[0, 20]] }", &["channels.temperature", "element"]),
        closed_loop("trajectory = { wrist = { offset = 1 } }", &["wrist"]),
        closed_loop(
            "trajectory = { elbow = { sine = [1, 2], cosine = [1] } }",
            &["trajectory.elbow", "2", "1"],
        ),
        // Gains beyond what a sampled loop bears.
        closed_loop(
            "[control]\neffort_limits = false\nposition_gain = [1e9, 1e9]\nvelocity_gain = [1e7, 1e7]",
            &["control loop stable"],
        ),
    ]);
}
