//! Journals in their bearings: against reference numbers, closed forms, the classical method, and their own energy.

#![expect(clippy::unwrap_used, reason = "helpers of tests outside of test functions")]

use dynid_model::contact::{
    ContactLaw, Hertz, HertzStiffness, KelvinVoigt, LankaraniNikravesh, SlidingFriction,
};
use dynid_model::element::{ClearanceContact, JointElement, JournalFriction};
use dynid_model::{
    Description, EffortModel, Inertia, JointDescription, JointKind, JournalModel, Limits, LinkDescription,
    LoadReference, Mat3, MotionBlock, Placement, RegressorBlock, RobotModel, TreeModel, Vec3,
    derivative_channels, journal_channels,
};
use dynid_sim::clearance::{
    ClearanceRecord, ClearanceSettings, ClearanceStart, ContactEventKind, Driving, Method, simulate,
};
use dynid_sim::{Plant, SimError};
use dynid_testing::golden;

use crate::pointing::{self, CLEARANCE, JOURNAL_RADIUS};

fn settings(method: Method) -> ClearanceSettings {
    ClearanceSettings { method, channels: Vec::new() }
}

fn prescribed(times: &[f64], method: Method) -> ClearanceRecord {
    let driving = Driving::Prescribed(&pointing::excitation);
    let start = ClearanceStart::default();
    simulate(pointing::plant(), &start, driving, times, &settings(method)).unwrap()
}

fn rms(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0.0), |(s, n), x| (s + x * x, n + 1.0));
    (sum / count).sqrt()
}

#[test]
fn half_a_second_of_the_published_mechanism_agrees_with_the_reference() {
    let Some(golden) = golden("xy_sim.json") else { return };
    let record = prescribed(&[0.0, 0.5], Method::default());
    let at = &golden["at_0_5s"];
    let tolerance = at["tolerance_rel"].as_f64().unwrap();
    let close = |found: f64, expected: &serde_json::Value, what: &str| {
        let expected = expected.as_f64().unwrap();
        assert!((found - expected).abs() <= tolerance * expected.abs(), "{what}: {found} {expected}");
    };
    for (joint, journal) in record.journals.iter().enumerate() {
        close(journal.offset[1][0], &at["e"][2 * joint], "offset x");
        close(journal.offset[1][1], &at["e"][2 * joint + 1], "offset y");
        close(journal.normal_force[1], &at["F_n"][joint], "normal force");
        close(journal.penetration[1], &at["penetration"][joint], "penetration");
    }
    let onsets: Vec<(usize, f64)> = record.events.iter().map(|e| (e.joint, e.time)).collect();
    assert!(
        matches!(onsets[..], [(0, a), (1, b)] if (a - 3.2e-3).abs() < 5e-5 && (b - 4.6e-3).abs() < 5e-5),
        "{onsets:?}"
    );
    // Peaks of the impacts as seen every 10 µs.
    let peaks: Vec<f64> = record.journals.iter().map(|j| j.largest_normal_force).collect();
    assert!((peaks[0] / 984.0 - 1.0).abs() < 0.05 && (peaks[1] / 864.0 - 1.0).abs() < 0.05, "{peaks:?}");
}

#[test]
fn two_seconds_balance_their_energy_at_a_tenth_of_the_classical_effort() {
    let times: Vec<f64> = (0..=200).map(|k| 0.01 * f64::from(k)).collect();
    let record = prescribed(&times, Method::default());
    let tighter = prescribed(&times, Method::Collocation { tolerance: 1e-11, longest_step: f64::INFINITY });
    for joint in 0..2 {
        let journal = &record.journals[joint];
        assert!(journal.largest_penetration < 0.2 * CLEARANCE && journal.contact_share > 0.99);
        let late = |k: &usize| record.time[*k] > 0.5;
        let change =
            rms((0..times.len()).filter(late).map(|k| record.effort[k][joint] - tighter.effort[k][joint]));
        assert!(change < 1e-5, "{change}");
    }
    assert_eq!(record.events.len(), 2);
    assert!(record.energy.relative_error().unwrap() < 1e-8, "{:?}", record.energy);
    assert!(record.energy.friction > 0.0 && record.energy.damping > 0.0);
    // sqrt(g/|e|) of both journals.
    assert!((record.swing_hz - 68.5).abs() < 1.5, "{}", record.swing_hz);
    // The classical method needs 80,000 a second at its largest step that follows this motion.
    assert!(record.count.evaluations < 160_000 / 5, "{:?}", record.count);
}

#[test]
fn the_classical_method_tells_the_same_through_both_impacts() {
    let times: Vec<f64> = (0..=100).map(|k| 1e-3 * f64::from(k)).collect();
    let ours = prescribed(&times, Method::default());
    let other = prescribed(&times, Method::RungeKutta4 { step: 4e-6 });
    for joint in 0..2 {
        let late = |k: &usize| *k >= 10;
        let gap = rms((0..times.len()).filter(late).map(|k| ours.effort[k][joint] - other.effort[k][joint]));
        // It sees an onset up to a step late.
        assert!(gap < 1e-6, "{gap}");
    }
}

#[test]
fn a_model_with_journals_needs_the_efforts_of_the_simulation() {
    let times: Vec<f64> = (0..=400).map(|k| 0.5 + 2.5e-3 * f64::from(k)).collect();
    let record = prescribed(&[&[0.0], &times[..]].concat(), Method::default());
    let n = times.len();
    let plant = pointing::plant();
    let ideal = pointing::description().build().unwrap();
    let frictions: Vec<Box<dyn JointElement>> =
        (0..2).map(|rate| Box::new(JournalFriction { rate }) as Box<dyn JointElement>).collect();
    let ideal = TreeModel::new(ideal, frictions);
    let truth = [&plant.linear()[..20], &[0.1, 0.1]].concat();
    let reference = LoadReference { linear: truth.clone(), shape: Vec::new(), linearised: false };
    let contacts = plant.model().clearances().cloned().collect();
    let model = JournalModel::new(ideal, plant.model().mechanism().clone(), contacts, reference).unwrap();
    let column = |of: &[Vec<f64>], rate: usize| (1..=n).map(move |k| of[k][rate]).collect::<Vec<f64>>();
    let flat = |of: &[Vec<f64>]| [column(of, 0), column(of, 1)].concat();
    let (q, dq, ddq) = (flat(&record.q), flat(&record.dq), flat(&record.ddq));
    let mut channels: Vec<(String, Vec<f64>)> = Vec::new();
    for journal in &record.journals {
        for (axis, name) in journal_channels(&journal.joint).into_iter().enumerate() {
            let [rate, acceleration] = derivative_channels(&name);
            let of = |of: &[[f64; 2]]| of[1..].iter().map(|pair| pair[axis]).collect::<Vec<f64>>();
            channels.push((name, of(&journal.offset)));
            channels.push((rate, of(&journal.offset_rate)));
            channels.push((acceleration, of(&journal.offset_acceleration)));
        }
    }
    let error = |channels: &[(&str, &[f64])]| {
        let motion = MotionBlock { channels, ..MotionBlock::plain(n, &q, &dq, &ddq) };
        let mut effort = vec![0.0; 2 * n];
        model.efforts(&motion, &[], &truth, n, &mut effort);
        // The regressor says the same.
        let mut rows = RegressorBlock::new(model.layout().clone(), n);
        model.regressor(&motion, &[], &mut rows);
        [0, 1].map(|joint| {
            let (own, again) = (&effort[joint * n..][..n], rows.effort(joint, &truth));
            assert!(own.iter().zip(&again).all(|(a, b)| (a - b).abs() < 1e-12));
            own.iter().zip(column(&record.effort, joint)).map(|(a, b)| a - b).collect::<Vec<f64>>()
        })
    };
    let told: Vec<(&str, &[f64])> = channels.iter().map(|(n, v)| (n.as_str(), v.as_slice())).collect();
    for error in error(&told) {
        assert!(error.iter().all(|e| e.abs() < 1e-9), "{:?}", error.iter().copied().fold(0.0, f64::max));
    }
    // Without probes the swing is missing, and nothing else.
    for (error, swing) in error(&[]).iter().zip([0.02, 0.002]) {
        let mean = error.iter().sum::<f64>() / n as f64;
        assert!(rms(error.iter().copied()) < swing && mean.abs() < 0.02 * swing, "{mean}");
    }
}

/// A disc of mass 1 about its journal, without gravity, or with some along `-x`.
fn disc(law: ContactLaw, gravity: f64) -> Plant {
    let tensor = Mat3::from_rows([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]);
    let description = Description {
        gravity: [-gravity, 0.0, 0.0],
        links: vec![
            LinkDescription { name: "base".into(), inertia: None },
            LinkDescription {
                name: "disc".into(),
                inertia: Some(Inertia::from_com(1.0, Vec3::zero(), &tensor)),
            },
        ],
        joints: vec![JointDescription {
            name: "hinge".into(),
            parent: "base".into(),
            child: "disc".into(),
            kind: JointKind::Revolute,
            placement: Placement::identity(),
            axis: [0.0, 0.0, 1.0],
            limits: Limits::default(),
            mimic: None,
        }],
        ..Description::new("disc")
    };
    let mechanism = description.with_clearance(&["hinge"]).unwrap().build().unwrap();
    let contact = ClearanceContact {
        rotation: 0,
        translations: [1, 2],
        law,
        friction: SlidingFriction::new(0.1, 1e-5, 1e-4).unwrap(),
        journal_radius: JOURNAL_RADIUS,
    };
    let model = RobotModel::new(mechanism, vec![Box::new(contact) as Box<dyn JointElement>]);
    let linear = model.parameters().prior();
    Plant::new(model, linear, Vec::new(), 1e-3).unwrap()
}

fn at_rest(_: f64, q: &mut [f64], dq: &mut [f64], ddq: &mut [f64]) {
    (q[0], dq[0], ddq[0]) = (0.0, 0.0, 0.0);
}

/// Thrown at the bearing from its centre with 0.1 m/s, until it is back there.
fn throw(law: ContactLaw, method: Method) -> ClearanceRecord {
    let start = ClearanceStart { journals: vec![([0.0; 2], [0.1, 0.0])], driven: None };
    let times: Vec<f64> = (0..=10).map(|k| 2e-4 * f64::from(k)).collect();
    simulate(disc(law, 0.0), &start, Driving::Prescribed(&at_rest), &times, &settings(method)).unwrap()
}

#[test]
fn bouncing_journals_return_with_the_restitution_of_their_law() {
    for (restitution, expected) in [(0.9, 0.9132), (0.7, 0.7960), (0.5, 0.7252)] {
        let stiffness = HertzStiffness::given(1e9, CLEARANCE).unwrap();
        let law = LankaraniNikravesh::new(stiffness, restitution).unwrap();
        let record = throw(law.into(), Method::default());
        let [onset, loss] = record.events[..] else { panic!("{:?}", record.events) };
        assert!(
            matches!(onset.kind, ContactEventKind::Onset(v) if (v - 0.1).abs() < 1e-12)
                && (onset.time - 5e-4).abs() < 1e-12
                && loss.kind == ContactEventKind::Loss,
            "{:?}",
            record.events
        );
        let back = -record.journals[0].offset_rate[10][0] / 0.1;
        assert!((back - expected).abs() < 1e-4, "{back} {expected}");
        assert!(record.energy.relative_error().unwrap() < 1e-7, "{:?}", record.energy);
    }
}

#[test]
fn elastic_impacts_have_their_closed_forms() {
    // Hertz: deepest (5 m v²/(4 K))^(2/5), duration 2.943 δ/v.
    let record = throw(Hertz::new(HertzStiffness::given(1e9, CLEARANCE).unwrap()).into(), Method::default());
    let deepest = (1.25 * 0.01 / 1e9_f64).powf(0.4);
    let journal = &record.journals[0];
    assert!((journal.largest_penetration / deepest - 1.0).abs() < 1e-3, "{journal:?}");
    let duration = record.events[1].time - record.events[0].time;
    assert!((duration / (2.943_275 * deepest / 0.1) - 1.0).abs() < 1e-6, "{duration}");
    assert!((journal.offset_rate[10][0] + 0.1).abs() < 1e-8, "{}", journal.offset_rate[10][0]);

    // Spring and damper: the force vanishes where K δ + D δ̇ does; speed there, from the closed form.
    let (k, d) = (1e7_f64, 1500.0_f64);
    let record = throw(KelvinVoigt::new(k, d, CLEARANCE).unwrap().into(), Method::default());
    let (decay, w) = (d / 2.0, (k - d * d / 4.0).sqrt());
    // δ = (v/w) e^(-decay t) sin wt; released at tan wt = -2 decay w/(w² - decay²), in the second quadrant.
    let t = (std::f64::consts::PI - (2.0 * decay * w).atan2(w * w - decay * decay)) / w;
    let speed = 0.1 * (-decay * t).exp() * ((w * t).cos() - decay / w * (w * t).sin());
    let found = record.journals[0].offset_rate[10][0];
    assert!((found / speed - 1.0).abs() < 1e-6, "{found} {speed}");
    assert!(record.energy.relative_error().unwrap() < 1e-7, "{:?}", record.energy);
}

#[test]
fn equal_steps_converge_with_order_nine_while_contact_lasts() {
    // Pressed into the bearing and swinging there; steps resolve the normal direction too.
    let run = |step: f64| {
        let start =
            ClearanceStart { journals: vec![([-CLEARANCE - 9.81e-6, 0.0], [0.0, 4e-3])], driven: None };
        let plant = disc(KelvinVoigt::new(1e6, 1.5e3, CLEARANCE).unwrap().into(), 9.81);
        // Without friction, whose branches would be passed.
        let mut linear = plant.linear().to_vec();
        linear.last_mut().into_iter().for_each(|mu| *mu = 0.0);
        let plant = plant.with_linear(linear).unwrap();
        let driving = Driving::Prescribed(&at_rest);
        let times = [0.0, 0.032];
        simulate(plant, &start, driving, &times, &settings(Method::CollocationSteps { step })).unwrap()
    };
    let reference = run(0.032 / 256.0).journals[0].offset[1];
    let error = |steps: f64| {
        let found = run(0.032 / steps).journals[0].offset[1];
        (found[0] - reference[0]).hypot(found[1] - reference[1])
    };
    let (coarse, fine) = (error(20.0), error(40.0));
    let order = (coarse / fine).log2();
    assert!(order > 8.0, "{order}: {coarse} {fine}");
}

#[test]
fn driven_joints_keep_the_energy_that_their_controller_gives() {
    let mut work_seen = 0;
    let mut controller = |t: f64, q: &[f64], dq: &[f64], effort: &mut [f64]| {
        work_seen += 1;
        let (mut want, mut rate, mut acceleration) = ([0.0; 2], [0.0; 2], [0.0; 2]);
        pointing::excitation(t, &mut want, &mut rate, &mut acceleration);
        for k in 0..2 {
            effort[k] = 40.0 * (want[k] - q[k]) + 1.2 * (rate[k] - dq[k]);
        }
    };
    let (mut q, mut dq, mut ddq) = ([0.0; 2], [0.0; 2], [0.0; 2]);
    pointing::excitation(0.0, &mut q, &mut dq, &mut ddq);
    let start = ClearanceStart { journals: Vec::new(), driven: Some((q.to_vec(), dq.to_vec())) };
    let times: Vec<f64> = (0..=50).map(|k| 0.01 * f64::from(k)).collect();
    let driving = Driving::Controlled { period: 1e-3, controller: &mut controller };
    let record = simulate(pointing::plant(), &start, driving, &times, &settings(Method::default())).unwrap();
    assert!((500..=502).contains(&work_seen), "{work_seen}");
    assert!(record.energy.relative_error().unwrap() < 1e-6, "{:?}", record.energy);
    let (mut want, mut rate, mut acceleration) = ([0.0; 2], [0.0; 2], [0.0; 2]);
    pointing::excitation(0.5, &mut want, &mut rate, &mut acceleration);
    for k in 0..2 {
        assert!((record.q[50][k] - want[k]).abs() < 0.02, "{:?} {want:?}", record.q[50]);
    }
    // The drives' efforts are what was asked for, up to what the solution leaves.
    assert!(record.journals.iter().all(|j| j.penetration[50] > 0.0));
}

#[test]
fn what_cannot_be_simulated_is_refused() {
    let refused = |times: &[f64], method: Method, start: ClearanceStart| {
        let driving = Driving::Prescribed(&at_rest);
        let law = KelvinVoigt::new(1e7, 10.0, CLEARANCE).unwrap().into();
        simulate(disc(law, 0.0), &start, driving, times, &settings(method)).unwrap_err()
    };
    let name = |error: SimError| match error {
        SimError::Setting { name, .. } | SimError::Length { name, .. } => name,
        other => panic!("{other}"),
    };
    let none = ClearanceStart::default;
    assert_eq!(name(refused(&[], Method::default(), none())), "times");
    assert_eq!(name(refused(&[0.0, 0.0], Method::default(), none())), "times");
    assert_eq!(name(refused(&[0.0, f64::NAN], Method::default(), none())), "times");
    let loose = Method::Collocation { tolerance: 1.0, longest_step: 1.0 };
    assert_eq!(name(refused(&[0.0, 1.0], loose, none())), "tolerance");
    assert_eq!(name(refused(&[0.0, 1.0], Method::RungeKutta4 { step: 0.0 }, none())), "step");
    let two = ClearanceStart { journals: vec![Default::default(); 2], driven: None };
    assert_eq!(name(refused(&[0.0, 1.0], Method::default(), two)), "journals");
    let nan = ClearanceStart { journals: vec![([f64::NAN, 0.0], [0.0; 2])], driven: None };
    assert_eq!(name(refused(&[0.0, 1.0], Method::default(), nan)), "journals");
    // An explicit step far too long for the contact.
    let fails = simulate(
        pointing::plant(),
        &none(),
        Driving::Prescribed(&pointing::excitation),
        &[0.0, 0.1],
        &settings(Method::RungeKutta4 { step: 1e-3 }),
    );
    assert!(matches!(fails, Err(SimError::TooFast { .. })), "{fails:?}");
}
