//! A made-up identification with the look of a real one: nothing here was measured.

use std::f64::consts::TAU;

use dynid_report::{
    BaseParameter, Caution, Check, Chosen, Fact, InputFile, Joint, JointDelay, JointQuality, JointSeries,
    Judged, Ladder, LineKind, LogReport, LogRole, LogSeries, Observation, Origin, ParameterVerdict,
    PictureLine, PointKind, Pose, Provenance, Quality, ReportData, Robot, RobotPicture, Rung, Status,
    UnidentifiableColumn, Verdict,
};

#[path = "friction.rs"]
mod friction;
#[path = "trust.rs"]
mod trust;

/// A report of `joints` joints, its training log having `samples` samples at 1 kHz.
pub(crate) fn report(joints: usize, samples: usize) -> ReportData {
    ReportData {
        title: "Identification of demo-arm".into(),
        verdict: verdict(),
        cautions: cautions(),
        counts: trust::counts(joints),
        judged: Some(judged(joints, samples)),
        picture: Some(picture(joints)),
        robot: Robot {
            name: "demo-arm".into(),
            file: Some("robots/demo-arm.toml".into()),
            facts: vec![
                Fact::new("Degrees of freedom", joints, ""),
                Fact::new("Gravity", "0, 0, -9.81", "m/s^2"),
                Fact::new("Link frames", "modified Denavit-Hartenberg (Craig)", ""),
                Fact::new("Standard parameters", 13 * joints, ""),
            ],
        },
        joints: (1..=joints).map(joint).collect(),
        logs: vec![
            log("fourier-a", LogRole::Training, joints, samples, 1),
            log("fourier-b", LogRole::Validation, joints, samples * 3 / 4, 2),
            log("pick-and-place", LogRole::Validation, joints, samples / 2, 3),
        ],
        estimation: vec![
            Fact::new("Method", "weighted least squares, then projection onto consistent inertias", ""),
            Fact::new("Iterations of the weights", 3usize, ""),
            Fact::new("Physically consistent", true, ""),
            Fact::new("Least eigenvalue of the pseudo-inertias", 3.2e-6, "kg m^2"),
        ],
        base_parameters: base_parameters(joints),
        standard_parameters: trust::standard_parameters(joints),
        shape_parameters: friction::shape_parameters(),
        friction_laws: friction::laws(),
        files: None,
        motions: trust::motions(),
        consistency: Some(trust::consistency()),
        held_out: trust::held_out(joints),
        precision: Some(trust::precision(joints)),
        searches: None,
        pruning: Some(trust::pruning(joints)),
        observation: Observation {
            rows: Some((joints * samples) as u64 * 9 / 10),
            columns: Some(9 * joints as u64 + 2),
            rank: Some(9 * joints as u64 + 2),
            structural_rank: Some(9 * joints as u64 + 2),
            rank_tolerance: Some(2.3e-11),
            condition_number: Some(214.7),
            condition_number_scaled: Some(38.21),
        },
        unidentifiable: ["m1", "mx1", "my1", "mz1", "Ixx1", "Ixy1", "Ixz1", "Iyy1", "Iyz1", "m2", "mz2"]
            .map(|name| UnidentifiableColumn { name: name.into(), reason: String::new() })
            .into(),
        conditioning: conditioning(),
        ladders: ladders(),
        friction_trials: friction::trials(),
        delays: (0..joints)
            .map(|j| JointDelay {
                delay_s: Some(0.0005 + 0.0001 * j as f64),
                interval_s: Some([0.0004 + 0.0001 * j as f64, 0.0006 + 0.0001 * j as f64]),
                applied_s: Some(0.0005),
            })
            .collect(),
        provenance: Provenance {
            version: "0.1.0".into(),
            inputs: [
                ("demo.toml", "configuration"),
                ("robots/demo-arm.toml", "robot"),
                ("logs/fourier-a.csv.gz", "training log"),
                ("logs/fourier-b.csv.gz", "validation log"),
                ("logs/pick-and-place.csv.gz", "validation log"),
            ]
            .map(|(path, kind)| InputFile {
                path: path.into(),
                kind: kind.into(),
                sha256: Some("5a0c7e21d94b".repeat(6)[..64].into()),
            })
            .into(),
            seed: Some(20_260_401),
            settings: vec![
                Chosen::given("estimator.method", "wls", ""),
                Chosen { origin: Origin::Default, ..Chosen::given("bootstrap.blocks", 200usize, "") },
                Chosen::given("bootstrap.block", 0.5, "s"),
            ],
        },
    }
}

fn verdict() -> Verdict {
    let check = |status, name: &str, value: f64, unit: &str, limit: &str, meaning: &str| Check {
        status,
        name: name.into(),
        value: value.into(),
        unit: unit.into(),
        limit: limit.into(),
        meaning: meaning.into(),
    };
    Verdict {
        status: Status::Warn,
        headline: "The model predicts unseen motion within 5.1 % of the effort; joint_4's friction needs care".into(),
        sentences: vec![
            "All base parameters of the arm were excited by the training log, and 48 of 54 are seen and known to better than 10 %.".into(),
            "On two validation logs the predicted effort differs from the measured one by 5.1 % (norm over all joints), much like on the training log, so the model is not fitted to noise.".into(),
            "The residual of joint_4 is correlated over 0.1 s: its friction changes with something the model does not contain, most likely temperature. For feed-forward control this does not matter; for contact detection on joint_4 set the threshold above 0.9 N m.".into(),
        ],
        checks: vec![
            check(Status::Ok, "Prediction of validation logs", 5.1, "%", "below 10 %", "Relative error on motion that was not used for fitting."),
            check(Status::Ok, "Excitation", 38.21, "", "below 100", "Condition number with unit columns: every parameter left a clear trace in the log."),
            check(Status::Ok, "Physical consistency", 3.2e-6, "kg m^2", "above 0", "Least eigenvalue of all pseudo-inertias: masses and inertias could be real, simulation will not blow up."),
            check(Status::Warn, "Whiteness of the residual", 0.41, "", "below 0.3", "Autocorrelation of joint_4's residual after 0.1 s: a slow effect is missing from its friction model."),
            check(Status::Warn, "Velocity coverage of joint_6", 31.0, "%", "above 50 %", "The log reached 31 % of the joint's rated speed: its viscous friction is extrapolated beyond that."),
        ],
    }
}

fn cautions() -> Vec<Caution> {
    vec![
        Caution {
            status: Status::Warn,
            name: "Whiteness of the residual".into(),
            value: 0.41.into(),
            limit: "below 0.3".into(),
            message: "autocorrelation of joint_4's residual after 0.1 s: a slow effect is missing from its friction model".into(),
            remedy: "`known_friction = \"friction.json\"` of `dynid friction` under `[elements]`".into(),
            ..Caution::default()
        },
        Caution {
            status: Status::Warn,
            name: "Velocity coverage of joint_6".into(),
            value: 31.0.into(),
            unit: "%".into(),
            limit: "above 50 %".into(),
            message: "the log reached 31 % of the joint's rated speed".into(),
            remedy: "`dynid design demo-arm.toml` writes a faster motion; add its log as a second `[[log]]`".into(),
        },
        Caution {
            status: Status::Warn,
            name: "Reading of a log".into(),
            message: "pick-and-place: 212 samples of joint_2 stand at the drive's current limit (87.0 N m)".into(),
            remedy: "record at lower payload or acceleration".into(),
            ..Caution::default()
        },
    ]
}

/// The second joint of the second log.
fn judged(joints: usize, samples: usize) -> Judged {
    let joint = joints.min(2) - 1;
    let time_s: Vec<f64> = (0..samples * 3 / 4).map(|i| i as f64 * 0.001).collect();
    let series = effort(&time_s, joint, 2);
    Judged {
        log: 1,
        unseen: true,
        others: 1,
        joint,
        why: "the joint that is predicted worst".into(),
        predicted: series.predicted.map_or_else(Vec::new, |p| p.to_vec()),
        measured: series.measured.to_vec(),
        time_s,
        description: "Both curves passed a zero-phase filter of 15.0 Hz.".into(),
    }
}

/// A chain of links that folds and unfolds.
fn picture(joints: usize) -> RobotPicture {
    let pose = |k: usize| {
        let time_s = k as f64 / 8.0;
        let mut points_m = vec![[0.0; 3], [0.0, 0.0, 0.3]];
        let mut at = [0.0, 0.0, 0.3];
        for j in 1..joints {
            let angle = 0.9 - 0.5 * j as f64 + 0.4 * (TAU * 0.2 * time_s + j as f64).sin();
            at = [at[0] + 0.3 * angle.cos(), at[1] + 0.05, at[2] + 0.3 * angle.sin()];
            points_m.push(at);
        }
        Pose { time_s, points_m }
    };
    RobotPicture {
        caption: "Poses of fourier-a".into(),
        points: std::iter::once(PointKind::Base).chain(vec![PointKind::Turns; joints]).collect(),
        lines: (0..joints).map(|k| PictureLine { ends: [k, k + 1], kind: LineKind::Link }).collect(),
        up: [0.0, 0.0, 9.81],
        poses: (0..40).map(pose).collect(),
        shown: 20,
        ..RobotPicture::default()
    }
}

fn joint(number: usize) -> Joint {
    Joint {
        name: format!("joint_{number}"),
        effort_unit: "N m".into(),
        kind: "revolute".into(),
        elements: ["Coulomb friction", "viscous friction", "rotor inertia"].map(String::from).into(),
    }
}

/// Noise of unit variance: sum of twelve uniforms of a linear congruential generator (Knuth's MMIX constants).
struct Noise(u64);

impl Noise {
    fn next(&mut self) -> f64 {
        (0..12)
            .map(|_| {
                self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
                (self.0 >> 11) as f64 / (1u64 << 53) as f64 - 0.5
            })
            .sum()
    }
}

fn log(name: &str, role: LogRole, joints: usize, samples: usize, seed: u64) -> LogReport {
    let time_s: Vec<f64> = (0..samples).map(|i| i as f64 * 0.001).collect();
    let series: Vec<JointSeries> = (0..joints).map(|j| effort(&time_s, j, seed)).collect();
    let quality: Vec<JointQuality> = series.iter().map(quality).collect();
    LogReport {
        name: name.into(),
        role,
        samples: Some(samples as u64 + 400),
        samples_used: Some(samples as u64),
        duration_s: Some(samples as f64 * 0.001),
        sample_rate_hz: Some(1000.0),
        facts: vec![Fact::new("Payload", 0.0, "kg")],
        relative_error_raw_percent: Some(6.9 + 0.1 * seed as f64),
        relative_error_filtered_percent: Some(4.8 + 0.1 * seed as f64),
        quality,
        series: Some(LogSeries {
            time_s,
            description: "Effort after the same zero-phase low-pass at 15 Hz on both curves".into(),
            joints: series,
        }),
    }
}

fn effort(time_s: &[f64], j: usize, seed: u64) -> JointSeries {
    let mut noise = Noise(seed * 1000 + j as u64);
    let size = [28.0, 55.0, 30.0, 8.0, 6.0, 3.0][j % 6];
    let phase = seed as f64 + 0.7 * j as f64;
    let velocity = |t: f64| {
        (TAU * 0.1 * t + phase).cos()
            + 0.6 * (TAU * 0.3 * t - phase).cos()
            + 0.4 * (TAU * 0.5 * t + 2.0 * phase).cos()
    };
    let predicted: Vec<f64> = time_s
        .iter()
        .map(|&t| {
            let gravity = if j % 6 == 1 {
                0.7 * (TAU * 0.1 * t).sin() + 0.5
            } else {
                0.1 * (TAU * 0.1 * t + phase).sin()
            };
            size * (gravity
                + 0.25 * (velocity(t) * 20.0).tanh()
                + 0.2 * velocity(t)
                + 0.1 * (TAU * 1.1 * t).sin())
        })
        .collect();
    let memory: f64 = if j == 3 { 0.98 } else { 0.7 };
    let mut coloured: f64 = 0.0;
    let measured: Vec<f64> = predicted
        .iter()
        .map(|p| {
            coloured = memory * coloured + (1.0 - memory * memory).sqrt() * noise.next();
            p + 0.035 * size * coloured
        })
        .collect();
    let used = time_s.iter().map(|&t| velocity(t).abs() > 0.06).collect();
    JointSeries {
        measured: measured.into(),
        predicted: Some(predicted.into()),
        drawn: None,
        used: Some(used),
    }
}

fn quality(series: &JointSeries) -> JointQuality {
    let measured = &series.measured;
    let samples = measured.len().max(1) as f64;
    let mean = measured.iter().sum::<f64>() / samples;
    let errors = series
        .predicted
        .iter()
        .flat_map(|p| p.iter())
        .zip(measured.iter())
        .map(|(p, m)| (m - p).powi(2))
        .sum::<f64>();
    let spread = measured.iter().map(|m| (m - mean).powi(2)).sum::<f64>();
    let energy = measured.iter().map(|m| m * m).sum::<f64>();
    let scaled = |factor: f64| Quality {
        rms: Some(factor * (errors / samples).sqrt()),
        nrmse_percent: Some(100.0 * factor * (errors / spread).sqrt()),
        r2: Some(1.0 - factor * factor * errors / spread),
        // Errors that are independent of the prediction.
        correlation: Some((1.0 - factor * factor * errors / spread).max(0.0).sqrt()),
        relative_error_percent: Some(100.0 * factor * (errors / energy).sqrt()),
    };
    JointQuality { raw: scaled(1.4), filtered: scaled(1.0), ..JointQuality::default() }
}

fn base_parameters(joints: usize) -> Vec<BaseParameter> {
    let rows = [
        ("Izz", "Izz{n} + Ia{n} + Iyy{k} + 0.2025 (m{k} + m{l})", "kg m^2", 1.234, 0.8),
        ("mx", "mx{n} + 0.45 (m{k} + m{l} + m_tool)", "kg m", 3.871, 0.4),
        ("my", "my{n} - mz{k}", "kg m", -0.0412, 21.0),
        ("Ixx", "Ixx{n} - Iyy{n} + Iyy{k} + 0.9 mz{k} + 0.2025 (m{k} + m{l})", "kg m^2", -0.3126, 4.0),
        ("Ixy", "Ixy{n}", "kg m^2", 0.00213, 73.0),
        ("Ixz", "Ixz{n} - 0.45 my{k}", "kg m^2", 0.0187, 9.0),
        ("fc", "fc{n}", "N m", 6.412, 0.6),
        ("fv", "fv{n}", "N m s", 9.22, 1.1),
        ("f0", "f0{n}", "N m", -0.0121, 140.0),
    ];
    let mut noise = Noise(7);
    (1..=joints)
        .flat_map(|n| rows.map(|row| (n, row)))
        .map(|(n, (name, expression, unit, value, relative))| {
            let value = value * (1.0 + 0.3 * noise.next()) / n as f64;
            BaseParameter {
                name: format!("{name}{n}"),
                expression: expression
                    .replace("{n}", &n.to_string())
                    .replace("{k}", &(n + 1).to_string())
                    .replace("{l}", &(n + 2).to_string()),
                unit: unit.into(),
                value: Some(value),
                std: Some(relative / 100.0 * value.abs()),
                half_width: Some(2.05 * relative / 100.0 * value.abs()),
                relative_std_percent: Some(relative),
                consistent_value: Some(value * (1.0 + relative / 400.0)),
                verdict: Some(if relative < 100.0 {
                    ParameterVerdict::SeenInData
                } else {
                    ParameterVerdict::CarriedByPrior
                }),
                share: Some(if relative < 100.0 { 0.97 } else { 0.71 }),
            }
        })
        .collect()
}

fn conditioning() -> Vec<Chosen> {
    let chosen = |name: &str, value: dynid_report::Value, unit: &str, origin, reason: &str| Chosen {
        name: name.into(),
        value,
        unit: unit.into(),
        origin,
        reason: reason.into(),
    };
    vec![
        chosen(
            "Low-pass cut-off",
            15.0.into(),
            "Hz",
            Origin::Found,
            "Five times the highest frequency (3.0 Hz) holding 99 % of the position's energy.",
        ),
        chosen("Low-pass order", 4usize.into(), "", Origin::Default, "Butterworth, forward and backward."),
        chosen(
            "Samples cut at each end",
            0.2.into(),
            "s",
            Origin::Found,
            "Three time constants of the filter, whose edges are not to be trusted.",
        ),
        chosen(
            "Mask around velocity reversal",
            0.06.into(),
            "rad/s",
            Origin::Found,
            "Least held-out loss of the mask ladder below.",
        ),
        chosen("Decimation", 10usize.into(), "", Origin::Given, "Given as decimate = 10."),
        chosen(
            "Delay compensation",
            true.into(),
            "",
            Origin::Found,
            "The interval of every joint's delay excludes zero.",
        ),
    ]
}

fn ladders() -> Vec<Ladder> {
    let rungs = |values: &[(f64, f64, f64)], chosen: usize| {
        values
            .iter()
            .enumerate()
            .map(|(i, &(value, loss, kept))| Rung {
                value: value.into(),
                loss: Some(loss),
                loss_std_error: Some(0.04 * loss),
                kept_percent: Some(kept),
                chosen: i == chosen,
            })
            .collect()
    };
    vec![
        Ladder {
            title: "Mask ladder".into(),
            explanation:
                "Loss on held-out blocks; the narrowest mask within one standard error of the least.".into(),
            quantity: "half width".into(),
            unit: "rad/s".into(),
            loss_name: "held-out RMS".into(),
            loss_unit: "N m".into(),
            rungs: rungs(
                &[
                    (0.0, 1.912, 100.0),
                    (0.02, 1.204, 97.8),
                    (0.06, 0.913, 93.1),
                    (0.12, 0.921, 87.4),
                    (0.25, 0.984, 76.0),
                ],
                2,
            ),
        },
        Ladder {
            title: "Kernel ladder".into(),
            explanation: "Smoothing kernel of the sign function.".into(),
            quantity: "kernel width".into(),
            unit: "ms".into(),
            loss_name: "held-out RMS".into(),
            loss_unit: "N m".into(),
            rungs: rungs(
                &[(0.0, 0.987, 93.1), (5.0, 0.931, 93.1), (10.0, 0.913, 93.1), (20.0, 0.955, 93.1)],
                2,
            ),
        },
    ]
}
