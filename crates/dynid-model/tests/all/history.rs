//! Elements that depend on the motion before, on temperature, and elements that are known.

#![expect(clippy::unwrap_used, reason = "helpers of tests outside of test functions")]

use dynid_model::element::{
    Coulomb, ExponentialViscous, JointElement, Linearised, LuGre, MaxwellSlip, ShapeSetting, Stribeck,
    Viscous,
};
use dynid_model::*;
use dynid_testing::golden;
use serde_json::Value;

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect()
}

/// Joints `j1`, `j2`, .. one after the other.
fn row(joints: usize) -> Mechanism {
    let mut d = Description::new("row");
    d.links.push(LinkDescription { name: "base".into(), inertia: None });
    for k in 1..=joints {
        d.links.push(LinkDescription { name: format!("link{k}"), inertia: None });
        d.joints.push(JointDescription {
            name: format!("j{k}"),
            parent: if k == 1 { "base".into() } else { format!("link{}", k - 1) },
            child: format!("link{k}"),
            kind: JointKind::Revolute,
            placement: Placement::translate(0.1, 0.0, 0.0),
            axis: [0.0, 0.0, 1.0],
            limits: Limits::default(),
            mimic: None,
        });
    }
    d.build().unwrap()
}

/// Motion of which only velocities matter, with a temperature of every joint.
struct Motion {
    samples: usize,
    dq: Vec<f64>,
    rest: Vec<f64>,
    channels: Vec<(String, Vec<f64>)>,
}

impl Motion {
    fn new(dq: Vec<Vec<f64>>, temperature: Option<f64>) -> Self {
        let samples = dq[0].len();
        let channels = temperature
            .map(|t| (1..=dq.len()).map(|j| (format!("temperature_j{j}"), vec![t; samples])).collect())
            .unwrap_or_default();
        let dq = dq.concat();
        Motion { samples, rest: vec![0.0; dq.len()], dq, channels }
    }

    fn with<T>(
        &self,
        range: std::ops::Range<usize>,
        signals: &[(String, Vec<f64>)],
        work: impl FnOnce(&MotionBlock<'_>) -> T,
    ) -> T {
        let channels: Vec<(&str, &[f64])> = self
            .channels
            .iter()
            .chain(signals)
            .map(|(name, values)| (name.as_str(), &values[range.clone()]))
            .collect();
        work(&MotionBlock {
            samples: range.len(),
            stride: self.samples,
            q: &self.rest[range.start..],
            dq: &self.dq[range.start..],
            ddq: &self.rest[range.start..],
            gravity: None,
            channels: &channels,
            sign_width: 0.0,
        })
    }

    /// Signals of a model, formed in blocks that end at the cuts and at the end.
    fn signals(
        &self,
        model: &RobotModel,
        step: f64,
        shape: &[f64],
        cuts: &[usize],
    ) -> Vec<(String, Vec<f64>)> {
        let mut all = vec![f64::NAN; model.signals().len() * self.samples];
        let mut history = History::default();
        let mut start = 0;
        for end in cuts.iter().copied().chain([self.samples]) {
            let mut part = vec![f64::NAN; model.signals().len() * self.samples];
            self.with(start..end, &[], |block| {
                model.remember(block, step, shape, &mut history, self.samples, &mut part);
            });
            for k in 0..model.signals().len() {
                let from = &part[k * self.samples..][..end - start];
                all[k * self.samples + start..][..end - start].copy_from_slice(from);
            }
            start = end;
        }
        model.signals().iter().cloned().zip(all.chunks(self.samples).map(<[f64]>::to_vec)).collect()
    }

    fn efforts(
        &self,
        model: &RobotModel,
        shape: &[f64],
        linear: &[f64],
        signals: &[(String, Vec<f64>)],
    ) -> Vec<f64> {
        let mut effort = vec![0.0; self.dq.len()];
        self.with(0..self.samples, signals, |block| {
            model.efforts(block, shape, linear, self.samples, &mut effort);
        });
        effort
    }
}

fn held(value: f64) -> ShapeSetting {
    ShapeSetting::held(value)
}

/// `F_c`, `F_s`, `v_s`, `σ0`, `σ1`.
fn lugre(rate: usize, [fc, fs, vs, s0, _]: [f64; 5]) -> LuGre {
    LuGre { rate, kappa: held(s0 / fc), rho: held(fs / fc), vs: held(vs), delta: held(2.0) }
}

#[test]
fn bristles_follow_the_golden_sequence_from_both_starts() {
    let Some(g) = golden("mech_elements.json") else { return };
    let g = &g["lugre"];
    let p = ["fc", "fs", "vs", "s0", "s1"].map(|key| g["parameters"][key].as_f64().unwrap());
    let model = RobotModel::new(row(1), vec![Box::new(lugre(0, p))]);
    let linear: Vec<f64> = [0.0; 10].into_iter().chain([p[0], p[4]]).collect();
    let step = g["dt"].as_f64().unwrap();
    let v = numbers(&g["v"]);
    // A sample at rest before the record leaves the bristles straight.
    for (before, key) in [(vec![], "effort"), (vec![0.0], "effort_from_rest")] {
        let motion = Motion::new(vec![[before.clone(), v.clone()].concat()], None);
        let signals = motion.signals(&model, step, &[], &[]);
        let effort = motion.efforts(&model, &[], &linear, &signals);
        let expected = numbers(&g[key]);
        let scale = expected.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
        for (found, wanted) in effort[before.len()..].iter().zip(&expected) {
            assert!((found - wanted).abs() <= 1e-12 * scale, "{key}: {found} {wanted}");
        }
        let bent = &signals[0].1[before.len()..];
        if key == "effort" {
            for (w, z) in bent.iter().zip(numbers(&g["z"])) {
                assert!((w * p[0] / p[3] - z).abs() <= 1e-12 * z.abs().max(1e-3), "{w} {z}");
            }
        }
    }
}

/// Elements of the Indy7's friction, and their linear parameters.
fn indy7(joints: &[Value]) -> (Vec<Box<dyn JointElement>>, Vec<f64>) {
    let mut elements: Vec<Box<dyn JointElement>> = Vec::new();
    let mut linear = Vec::new();
    for (rate, joint) in joints.iter().enumerate() {
        let p = ["Fc", "Fs", "vs", "sigma0", "sigma1"].map(|key| joint[key].as_f64().unwrap());
        let line = |key: &str| numbers(&joint[key]);
        elements.push(Box::new(lugre(rate, p)));
        elements.push(Box::new(ExponentialViscous {
            sigma3: held(line("sigma3")[0]),
            sigma3_slope: held(line("sigma3")[1]),
            sigma4: held(line("sigma4")[0]),
            sigma4_slope: held(line("sigma4")[1]),
            reference_temperature: 0.0,
            ..ExponentialViscous::new(rate)
        }));
        linear.extend([p[0], p[4], line("sigma2")[0], line("sigma2")[1]]);
    }
    (elements, linear)
}

#[test]
fn friction_of_the_indy7_is_that_of_the_reference() {
    let Some(g) = golden("indy7_friction.json") else { return };
    let (elements, friction) = indy7(g["parameters"].as_array().unwrap());
    let model = RobotModel::new(row(6), elements);
    let linear: Vec<f64> = [0.0; 60].into_iter().chain(friction).collect();
    for case in g["steady"].as_array().unwrap() {
        let v = case["qd"].as_f64().unwrap();
        let motion = Motion::new(vec![vec![v]; 6], Some(case["T"].as_f64().unwrap()));
        let effort = motion.efforts(&model, &[], &linear, &[]);
        for (found, wanted) in effort.iter().zip(numbers(&case["tau_f"])) {
            assert!((found - wanted).abs() <= 1e-9, "{v}: {found} {wanted}");
        }
    }
    let g = &g["lugre"];
    let rows: Vec<Vec<f64>> = g["qd"].as_array().unwrap().iter().map(numbers).collect();
    let dq = (0..6).map(|j| rows.iter().map(|r| r[j]).collect()).collect();
    let motion = Motion::new(dq, g["T"].as_f64());
    let signals = motion.signals(&model, g["dt"].as_f64().unwrap(), &[], &[]);
    let effort = motion.efforts(&model, &[], &linear, &signals);
    for (k, wanted) in g["tau_f"].as_array().unwrap().iter().enumerate() {
        for (j, wanted) in numbers(wanted).into_iter().enumerate() {
            let found = effort[j * rows.len() + k];
            assert!((found - wanted).abs() <= 1e-9, "sample {k}, joint {j}: {found} {wanted}");
        }
    }
}

/// Slow and fast, with a stop and a start in motion.
fn velocities(samples: usize) -> Vec<f64> {
    (0..samples)
        .map(|k| if (40..44).contains(&k) { 0.0 } else { 0.3 * (0.071 * k as f64 + 0.4).sin().powi(3) })
        .collect()
}

fn free(start: f64) -> ShapeSetting {
    ShapeSetting { start, lower: 0.3 * start, upper: 3.0 * start, held: false }
}

fn shaped() -> RobotModel {
    let law = LuGre { rate: 1, kappa: free(700.0), rho: free(1.4), vs: free(0.05), delta: free(1.4) };
    RobotModel::new(row(2), vec![Box::new(lugre(0, [2.0, 3.0, 0.04, 1500.0, 90.0])), Box::new(law)])
}

#[test]
fn cuts_between_blocks_leave_no_trace() {
    let model = shaped();
    let motion = Motion::new(vec![velocities(300), velocities(300)], None);
    let shape = model.parameters().shape_start();
    let whole = motion.signals(&model, 1e-3, &shape, &[]);
    for cuts in [vec![1, 2, 40, 41], vec![128, 256], (1..300).collect()] {
        assert_eq!(whole, motion.signals(&model, 1e-3, &shape, &cuts), "bit for bit");
    }
    assert!(whole.iter().all(|(_, values)| values.iter().all(|x| x.is_finite())));
}

#[test]
fn derivatives_of_remembered_signals_are_those_of_central_differences() {
    let model = shaped();
    let motion = Motion::new(vec![velocities(300), velocities(300)], None);
    let shape = model.parameters().shape_start();
    let signals = |shape: &[f64]| motion.signals(&model, 1e-3, shape, &[]);
    let exact = signals(&shape);
    let derived = ["kappa", "rho", "vs", "delta"];
    for (parameter, name) in derived.into_iter().enumerate() {
        let h = 1e-6 * shape[parameter];
        let moved = |change: f64| {
            let mut shape = shape.clone();
            shape[parameter] += change;
            signals(&shape)
        };
        let (above, below) = (moved(h), moved(-h));
        for kind in ["bristle", "bristle_rate"] {
            let of = |list: &[(String, Vec<f64>)], name: String| {
                list.iter().find(|(n, _)| *n == name).unwrap().1.clone()
            };
            let plain = format!("j2.{kind}");
            let found = of(&exact, format!("j2.{kind}_by_{name}"));
            let scale = found.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
            for (k, (a, b)) in of(&above, plain.clone()).iter().zip(of(&below, plain)).enumerate() {
                let difference = (a - b) / (2.0 * h);
                assert!(
                    (found[k] - difference).abs() <= 2e-6 * scale,
                    "{kind} by {name}, sample {k}: {} {difference}",
                    found[k]
                );
            }
        }
    }
}

#[test]
fn away_from_reversals_bristles_are_stribeck_friction() {
    let p = [9.1, 11.83, 0.04, 16804.0, 270.0];
    let bristles = RobotModel::new(row(1), vec![Box::new(lugre(0, p))]);
    let stribeck = Stribeck { vs: held(p[2]), ..Stribeck::new(0) };
    let stribeck = RobotModel::new(row(1), vec![Box::new(stribeck)]);
    let v: Vec<f64> = (0..4000).map(|k| 0.2 + 0.1 * (1e-3 * k as f64).sin()).collect();
    let motion = Motion::new(vec![v], None);
    let signals = motion.signals(&bristles, 2.5e-4, &[], &[]);
    let linear = |values: [f64; 2]| [0.0; 10].into_iter().chain(values).collect::<Vec<f64>>();
    let dynamic = motion.efforts(&bristles, &[], &linear([p[0], p[4]]), &signals);
    let steady = motion.efforts(&bristles, &[], &linear([p[0], p[4]]), &[]);
    let plain = motion.efforts(&stribeck, &[], &linear([p[0], p[1]]), &[]);
    for ((d, s), p) in dynamic.iter().zip(&steady).zip(&plain) {
        assert!((s - p).abs() <= 1e-13 * p, "{s} {p}");
        assert!((d - p).abs() <= 1e-3 * p, "{d} {p}");
    }
}

#[test]
fn known_elements_are_offset_and_part_of_every_effort() {
    let p = [9.1, 11.83, 0.04, 16804.0, 270.0];
    let viscous =
        || ExponentialViscous { sigma3: held(1.3), sigma4: held(0.8), ..ExponentialViscous::new(0) };
    let known = vec![
        KnownElement { element: Box::new(lugre(0, p)), linear: vec![p[0], p[4]], shape: vec![] },
        KnownElement { element: Box::new(viscous()), linear: vec![30.0, -1.0], shape: vec![] },
    ];
    let rest: fn() -> Vec<Box<dyn JointElement>> =
        || vec![Box::new(Coulomb { rate: 0 }), Box::new(Viscous { rate: 0 })];
    let model = RobotModel::new(row(1), rest()).with_known(known);
    let mut all: Vec<Box<dyn JointElement>> = vec![Box::new(lugre(0, p)), Box::new(viscous())];
    all.extend(rest());
    let whole = RobotModel::new(row(1), all);
    assert_eq!(model.channels(), ["temperature_j1"]);
    assert_eq!(model.signals(), whole.signals());
    let motion = Motion::new(vec![velocities(300)], Some(33.0));
    let signals = motion.signals(&model, 1e-3, &[], &[]);
    assert_eq!(signals, motion.signals(&whole, 1e-3, &[], &[]));
    let (own, theirs) = ([0.3, 0.2], [p[0], p[4], 30.0, -1.0, 0.3, 0.2]);
    let linear = |values: &[f64]| [0.0; 10].iter().chain(values).copied().collect::<Vec<f64>>();
    let found = motion.efforts(&model, &[], &linear(&own), &signals);
    let wanted = motion.efforts(&whole, &[], &linear(&theirs), &signals);
    let mut block = RegressorBlock::new(model.layout().clone(), 300);
    motion.with(0..300, &signals, |m| model.regressor(m, &[], &mut block));
    let by_rows = block.effort(0, &linear(&own));
    for ((a, b), c) in found.iter().zip(&wanted).zip(&by_rows) {
        assert!((a - b).abs() <= 1e-12 && (c - b).abs() <= 1e-12, "{a} {b} {c}");
    }
    // Friction of the joint is known and own together.
    let law = |model: &RobotModel, linear: &[f64]| {
        model.friction_effort(0, &[], linear, &[-1.0, 0.02, 0.5], &[("temperature_j1", 33.0)])
    };
    for (a, b) in law(&model, &linear(&own)).iter().zip(law(&whole, &linear(&theirs))) {
        assert!((a - b).abs() <= 1e-12 * b.abs(), "{a} {b}");
    }
    // Without the motion before, the adjoint of the steady state.
    let moving = Motion::new(vec![velocities(30)], Some(33.0));
    let slope = |model: &RobotModel, linear: &[f64]| {
        let mut out = MotionAdjoint::new(1, 1, 30);
        moving.with(0..30, &[], |m| model.effort_adjoint(m, &[], linear, 30, &[1.0; 30], &mut out));
        out.dq
    };
    for (a, b) in slope(&model, &linear(&own)).iter().zip(slope(&whole, &linear(&theirs))) {
        assert!((a - b).abs() <= 1e-12 * b.abs().max(1.0), "{a} {b}");
    }
    // Errors of what is known have any sign where that is asked for.
    let lowest = |model: &RobotModel| model.parameters().linear.iter().map(|p| p.lower).collect::<Vec<_>>();
    let before = lowest(&model);
    let after = lowest(&model.with_free_sign(|p| p.name == "j1.fc"));
    let changed: Vec<usize> = (0..before.len()).filter(|k| before[*k] != after[*k]).collect();
    assert_eq!((changed, before[10], after[10]), (vec![10], Some(0.0), None));
}

#[test]
fn linearised_bristles_change_as_the_bristles_do() {
    let motion = Motion::new(vec![velocities(300)], None);
    let law = || LuGre { rate: 0, kappa: free(700.0), rho: free(1.4), vs: free(0.05), delta: held(2.0) };
    let plain = RobotModel::new(row(1), vec![Box::new(law())]);
    let at = plain.parameters().shape_start();
    let own = vec![5.0, 40.0];
    let linearised = Linearised::new(Box::new(law()), plain.joints(), at.clone(), own.clone(), vec![true; 3]);
    let linearised = RobotModel::new(row(1), vec![Box::new(linearised)]);
    let linear: Vec<f64> = [0.0; 10].into_iter().chain(own).collect();
    let moved: Vec<f64> = at.iter().map(|x| 1e-5 * x).collect();
    let effort = |factor: f64| {
        let shape: Vec<f64> = at.iter().zip(&moved).map(|(x, d)| x + factor * d).collect();
        motion.efforts(&plain, &shape, &linear, &motion.signals(&plain, 1e-3, &shape, &[]))
    };
    let (above, below) = (effort(1.0), effort(-1.0));
    let signals = motion.signals(&linearised, 1e-3, &[], &[]);
    let with = |changes: &[f64]| {
        let linear: Vec<f64> = linear.iter().chain(changes).copied().collect();
        motion.efforts(&linearised, &[], &linear, &signals)
    };
    let (start, end) = (with(&[0.0; 3]), with(&moved));
    let scale = above.iter().zip(&below).fold(0.0_f64, |m, (a, b)| m.max((a - b).abs()));
    for k in 0..300 {
        let (found, wanted) = (end[k] - start[k], 0.5 * (above[k] - below[k]));
        assert!((found - wanted).abs() <= 1e-5 * scale, "{k}: {found} {wanted}");
    }
}

#[test]
fn temperatures_outside_of_the_valid_range_count_as_its_end() {
    let law = ExponentialViscous {
        temperature_range: (15.0, 52.0),
        sigma3: held(1.3),
        sigma4: held(0.8),
        ..ExponentialViscous::new(0)
    };
    let model = RobotModel::new(row(1), vec![Box::new(law)]);
    let linear: Vec<f64> = [0.0; 10].into_iter().chain([40.0, -1.0]).collect();
    let at = |t: f64| Motion::new(vec![vec![0.5]], Some(t)).efforts(&model, &[], &linear, &[])[0];
    assert_eq!(at(70.0), at(52.0));
    assert_eq!(at(-5.0), at(15.0));
    assert!(at(15.0) > at(30.0) && at(30.0) > at(52.0) && at(52.0) > 0.0);
}

#[test]
fn least_passive_viscosity_of_the_indy7() {
    assert!((LuGre::least_passive_viscosity(270.0, 9.1, 11.83) - 81.0).abs() <= 1e-9);
}

#[test]
#[should_panic(expected = "temperature_j1")]
fn a_missing_temperature_is_named() {
    let model = RobotModel::new(row(1), vec![Box::new(ExponentialViscous::new(0))]);
    Motion::new(vec![vec![0.5]], None).efforts(&model, &[1.3, 0.8], &[0.0; 12], &[]);
}

/// Positions to and fro, fast and slow, with a stand in the middle at which the position still creeps.
fn to_and_fro() -> (Vec<f64>, Vec<f64>) {
    let q = |k: usize| 0.02 * (0.031 * k as f64).sin() + 0.011 * (0.0173 * k as f64 + 0.4).sin();
    let q: Vec<f64> = (0..600)
        .map(|k| if (200..260).contains(&k) { q(200) + 1e-6 * (k % 3) as f64 } else { q(k) })
        .collect();
    let stands = |k: usize| (200..260).contains(&k);
    let dq = (0..600)
        .map(|k| if stands(k) { 0.0 } else { (q[(k + 1).min(599)] - q[k.saturating_sub(1)]) * 500.0 });
    let dq = dq.collect();
    (q, dq)
}

/// Signals of one joint along [`to_and_fro`], formed in blocks that end at the cuts and at the end.
fn slip_signals(model: &RobotModel, shape: &[f64], cuts: &[usize]) -> Vec<Vec<f64>> {
    let ((q, dq), rest) = (to_and_fro(), vec![0.0; 600]);
    let count = model.signals().len();
    let mut all = vec![Vec::new(); count];
    let (mut history, mut start) = (History::default(), 0);
    for end in cuts.iter().copied().chain([600]) {
        let n = end - start;
        let mut part = vec![f64::NAN; count * n];
        let block = MotionBlock::plain(n, &q[start..end], &dq[start..end], &rest[..n]);
        // Displacements alone count, whatever the time between samples.
        model.remember(&block, 0.7, shape, &mut history, n, &mut part);
        all.iter_mut().zip(part.chunks(n)).for_each(|(to, from)| to.extend_from_slice(from));
        start = end;
    }
    all
}

/// The stop operator is what the play operator leaves of the position: `w = (q - p)/travel` with `p` dragged along.
#[test]
fn a_maxwell_slip_element_is_what_play_leaves_of_the_position() {
    let travel = 0.004;
    let model = RobotModel::new(row(1), vec![Box::new(MaxwellSlip { rate: 0, travel: held(travel) })]);
    assert_eq!(model.signals(), ["j1.slip_spring"]);
    let signals = slip_signals(&model, &[], &[]);
    let (q, dq) = to_and_fro();
    let (mut dragged, mut crept) = (q[0] - travel * dq[0].signum(), 0.0);
    let mut reached = [0; 3];
    for (k, w) in signals[0].iter().enumerate() {
        if dq[k] == 0.0 {
            // What the position does at rest moves the play along with it.
            crept += q[k] - q[k - 1];
        }
        let position = q[k] - crept;
        dragged = dragged.clamp(position - travel, position + travel);
        assert!((w - (position - dragged) / travel).abs() < 1e-12, "sample {k}: {w}");
        reached[if w.abs() < 1.0 {
            0
        } else if *w > 0.0 {
            1
        } else {
            2
        }] += 1;
    }
    assert!(reached.iter().all(|n| *n > 50), "{reached:?}");
    for cuts in [vec![1, 2, 40, 230], (1..600).collect()] {
        assert_eq!(signals, slip_signals(&model, &[], &cuts), "bit for bit");
    }
}

#[test]
fn derivatives_of_a_slip_spring_are_those_of_central_differences() {
    let model = RobotModel::new(row(1), vec![Box::new(MaxwellSlip { rate: 0, travel: free(0.004) })]);
    let [spring, by_travel] = &slip_signals(&model, &[0.004], &[])[..] else { panic!("two signals") };
    let h = 1e-9;
    let [above, below] = [h, -h].map(|h| slip_signals(&model, &[0.004 + h], &[]));
    let scale = by_travel.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
    let mut compared = 0;
    for (k, found) in by_travel.iter().enumerate() {
        // Where it slips there is a kink.
        if spring[k].abs() > 1.0 - 1e-4 {
            assert_eq!(*found == 0.0, spring[k].abs() == 1.0, "sample {k}");
            continue;
        }
        let difference = (above[0][k] - below[0][k]) / (2.0 * h);
        assert!((found - difference).abs() < 1e-5 * scale, "sample {k}: {found} {difference}");
        compared += 1;
    }
    assert!(compared > 100 && scale > 100.0, "{compared} samples, {scale}");
}

/// Without the motion before it is Coulomb friction, in values and in derivatives by the motion.
#[test]
fn without_the_motion_before_a_slip_spring_is_the_sign() {
    let springs = RobotModel::new(row(1), vec![Box::new(MaxwellSlip::new(0))]);
    let coulomb = RobotModel::new(row(1), vec![Box::new(Coulomb { rate: 0 })]);
    let motion = Motion::new(vec![velocities(60)], None);
    let linear: Vec<f64> = [0.0; 10].into_iter().chain([0.7]).collect();
    let shape = springs.parameters().shape_start();
    let found = motion.efforts(&springs, &shape, &linear, &[]);
    assert_eq!(found, motion.efforts(&coulomb, &[], &linear, &[]));
    let slope = |model: &RobotModel, shape: &[f64]| {
        let mut out = MotionAdjoint::new(1, 1, 60);
        motion.with(0..60, &[], |m| {
            let smooth = MotionBlock { sign_width: 0.1, ..*m };
            model.effort_adjoint(&smooth, shape, &linear, 60, &[1.0; 60], &mut out);
        });
        out.dq
    };
    assert_eq!(slope(&springs, &shape), slope(&coulomb, &[]));
    let table = springs.parameters();
    assert_eq!((table.shape[0].name.as_str(), table.shape[0].unit), ("j1.travel", "rad"));
    assert_eq!(table.linear[10].lower, Some(0.0));
}
