//! Prior, verdicts and advice on robots: closed forms, the table of an industrial arm, behaviour.

#![expect(clippy::unwrap_used, reason = "helpers of tests outside of test functions")]

use std::path::PathBuf;

use dynid::advice::{Advice, FitRows, MotionSettings, NoAdvice, Present, advise, regrouping};
use dynid::elements::ElementPlan;
use dynid::estimators::identifiability::{
    Carried, Identifiability, Verdict, VisibleSpace, visible_combinations,
};
use dynid::estimators::{Factor, FactorBuilder};
use dynid::model::element::{
    Coulomb, DriveGain, JointElement, Offset, RotorInertia, Spring, Transmission, Viscous,
};
use dynid::model::{
    BaseParameters, BaseSettings, Description, EffortModel, Inertia, JointDescription, JointKind, Limits,
    LinkDescription, Mat3, Placement, RandomMotion, RegressorBlock, RobotModel, Vec3,
};
use dynid::prior::{self, Origin, Prior, PriorError};
use dynid::{Robot, RobotOptions};

fn body(mass: f64, com: [f64; 3]) -> Inertia {
    let about_com = Mat3::from_rows([[0.02, 0.0, 0.0], [0.0, 0.03, 0.0], [0.0, 0.0, 0.04]]);
    Inertia::from_com(mass, Vec3(com), &about_com)
}

fn joint(k: usize, at: [f64; 3], limits: Limits) -> JointDescription {
    JointDescription {
        name: format!("j{}", k + 1),
        parent: if k == 0 { "base".into() } else { format!("l{k}") },
        child: format!("l{}", k + 1),
        kind: JointKind::Revolute,
        placement: Placement::translate(at[0], at[1], at[2]),
        axis: [0.0, 0.0, 1.0],
        limits,
        mimic: None,
    }
}

const LENGTH: f64 = 0.6;

/// Two parallel horizontal axes, links `LENGTH` apart.
fn planar(inertias: [Option<Inertia>; 2]) -> Description {
    let mut d = Description::new("planar");
    d.gravity = [0.0, -9.81, 0.0];
    d.links.push(LinkDescription { name: "base".into(), inertia: None });
    for (k, inertia) in inertias.into_iter().enumerate() {
        d.links.push(LinkDescription { name: format!("l{}", k + 1), inertia });
        let at = if k == 0 { [0.0; 3] } else { [LENGTH, 0.0, 0.0] };
        let limits = Limits { position: Some((-2.5, 2.5)), velocity: Some(3.0), effort: Some(50.0) };
        d.joints.push(joint(k, at, limits));
    }
    d
}

fn good_planar() -> Description {
    planar([Some(body(4.0, [0.3, 0.02, 0.0])), Some(body(2.0, [0.2, 0.0, 0.01]))])
}

fn model_of(d: &Description, elements: Vec<Box<dyn JointElement>>) -> RobotModel {
    RobotModel::new(d.build().unwrap(), elements)
}

fn stated(model: &RobotModel) -> Vec<Option<f64>> {
    model.parameters().linear.iter().map(|p| p.prior).collect()
}

fn prior_of(model: &RobotModel) -> Prior {
    prior::of(model, &stated(model), &vec![0.0; model.outputs().len()], "robot.toml").unwrap()
}

fn base_of(model: &RobotModel) -> BaseParameters {
    BaseParameters::of(model, model.mechanism(), &[], &BaseSettings::default())
}

fn column(model: &RobotModel, name: &str) -> usize {
    model.parameters().column(name).unwrap_or_else(|| panic!("no parameter {name}"))
}

/// Factor of rows of random states in base columns with residual deviation `sigma`, joints in `still` excepted.
fn random_information(model: &RobotModel, base: &BaseParameters, sigma: f64, still: &[usize]) -> Factor {
    let samples = 300;
    let mut builder = FactorBuilder::new(base.len());
    RandomMotion::new(model.mechanism(), &[], samples, 5).with_block(|motion| {
        let freeze = |signal: &[f64]| -> Vec<f64> {
            signal
                .iter()
                .enumerate()
                .map(|(k, x)| if still.contains(&(k / samples)) { 0.0 } else { *x })
                .collect()
        };
        let (q, dq, ddq) = (freeze(motion.q), freeze(motion.dq), freeze(motion.ddq));
        let motion = dynid::model::MotionBlock { q: &q, dq: &dq, ddq: &ddq, ..*motion };
        let mut block = RegressorBlock::new(model.layout().clone(), samples);
        model.regressor(&motion, &[], &mut block);
        for output in (0..model.outputs().len()).filter(|j| !still.contains(j)) {
            for s in 0..samples {
                let mut row = vec![0.0; base.len()];
                for (k, c) in model.layout().columns(output).iter().enumerate() {
                    if let Ok(place) = base.kept.binary_search(c) {
                        row[place] = block.column(output, k)[s] / sigma;
                    }
                }
                builder.push_row(&row, 0.0).unwrap();
            }
        }
    });
    builder.finish()
}

struct Study {
    model: RobotModel,
    base: BaseParameters,
    prior: Prior,
    space: VisibleSpace,
}

impl Study {
    fn new(model: RobotModel) -> Self {
        let (base, prior) = (base_of(&model), prior_of(&model));
        let space = VisibleSpace::new(&regrouping(&base), &prior.std);
        Study { model, base, prior, space }
    }

    fn advise(&self, information: &Factor, sigma: f64) -> (Identifiability, Advice) {
        let assessed = self.space.assess(information, 2.0);
        let present = Present { space: &self.space, information, inflation: 2.0, assessed: &assessed };
        let outputs = self.model.outputs().len();
        let rows = FitRows {
            scales_hz: vec![5.0, 10.0],
            sigma: vec![Some(sigma); outputs],
            mask: vec![Some(0.06); outputs],
        };
        let advice = advise(&self.model, &self.base, &present, &rows, &MotionSettings::default());
        (assessed, advice)
    }

    fn names(&self) -> Vec<String> {
        self.model.outputs().iter().map(|o| o.name.clone()).collect()
    }

    fn symbols(&self) -> Vec<&str> {
        self.model.parameters().linear.iter().map(|p| p.symbol.as_str()).collect()
    }
}

/// `Izz1 + l² m2`, `mx1 + l m2`, `my1`, `Izz2`, `mx2`, `my2` is all that acts. In units of the prior the hidden direction of
/// `(Izz1, mx1, m2)` is `(-l² σ_m/σ_I, -l σ_m/σ_x, 1)`.
#[test]
fn a_planar_arm_shows_what_its_equations_say() {
    let study = Study::new(model_of(&good_planar(), Vec::new()));
    let found = study.space.assess(&random_information(&study.model, &study.base, 0.1, &[]), 1.0);
    let at = |name: &str| {
        (&found.parameters[column(&study.model, name)], study.prior.std[column(&study.model, name)])
    };
    for name in ["l1.my", "l2.Izz", "l2.mx", "l2.my"] {
        assert_eq!(at(name).0.verdict, Verdict::Seen, "{name}");
        assert!(at(name).0.hidden < 1e-20);
    }
    for name in ["l1.m", "l1.mz", "l1.Ixx", "l1.Ixy", "l1.Iyy", "l2.mz", "l2.Ixz", "l2.Ixx"] {
        assert_eq!(at(name).0.verdict, Verdict::NotIdentifiable, "{name}");
        assert!(at(name).0.structural_limit < 1e-20);
    }
    let m = at("l2.m").1;
    let direction = [-LENGTH * LENGTH * m / at("l1.Izz").1, -LENGTH * m / at("l1.mx").1, 1.0];
    let norm: f64 = direction.iter().map(|x| x * x).sum();
    for (name, x) in ["l1.Izz", "l1.mx", "l2.m"].into_iter().zip(direction) {
        let a = at(name).0;
        assert!((a.hidden - x * x / norm).abs() < 1e-9, "{name}: {} against {}", a.hidden, x * x / norm);
        if a.structural_limit < 0.9 {
            assert_eq!(a.verdict, Verdict::CarriedByPrior(Carried::OnlyInCombination), "{name}");
        }
    }
    assert!(found.base.iter().all(|b| b.verdict == Verdict::Seen));
}

#[test]
fn prior_deviations_follow_mass_size_and_limits() {
    let elements: Vec<Box<dyn JointElement>> = vec![
        Box::new(Coulomb { rate: 0 }),
        Box::new(Viscous { rate: 0 }),
        Box::new(Offset { rate: 0 }),
        Box::new(RotorInertia { rate: 1 }),
        Box::new(Spring { rate: 1 }),
    ];
    let model = model_of(&good_planar(), elements);
    let prior = prior_of(&model);
    let std = |name: &str| prior.std[column(&model, name)];
    let close = |a: f64, b: f64| assert!((a / b - 1.0).abs() < 1e-12, "{a} against {b}");
    // Size of link 1: the distance to joint 2.
    for (name, expected) in [
        ("l1.m", 2.0),
        ("l1.my", 2.0 * LENGTH),
        ("l1.Ixy", 2.0 * LENGTH * LENGTH),
        ("l1.Izz", 2.0 * LENGTH * LENGTH),
    ] {
        close(std(name), expected);
    }
    // Link 2: √(tr I/2m) with tr I = 0.09 + 2·(0.2² + 0.01²)·2 is more than the centre of mass is away.
    let size2: f64 = (0.5 * (0.09 + 4.0 * 0.0401) / 2.0f64).sqrt();
    close(std("l2.m"), 1.0);
    close(std("l2.mx"), size2);
    close(std("j1.fc"), 5.0);
    close(std("j1.fo"), 5.0);
    close(std("j1.fv"), 5.0 / 3.0);
    // The entry of the mass matrix of the last joint does not depend on the posture.
    // 0.03 s at 50 N m up to the velocity limit is more than a fifth of the mass matrix.
    close(std("j2.Ia"), 0.03 * 50.0 / 3.0);
    close(std("j2.kq0"), 5.0);
    assert!((2.0..2.1).contains(&std("j2.k")), "{}: a tenth of 50 N m at up to 2.5 rad", std("j2.k"));
    assert_eq!(prior.bodies.iter().map(|b| b.origin).collect::<Vec<_>>(), [Origin::Stated; 2]);
    assert!(prior.warnings.is_empty());
    assert_eq!(prior.values[..20], *model.mechanism().inertia_vector());

    // A logged effort of 1 N m: the limit of 50 N m counts up to ten times that; without a limit the log alone counts.
    let logged = prior::of(&model, &stated(&model), &[1.0, 1.0], "robot.toml").unwrap();
    close(logged.std[column(&model, "j1.fc")], 1.0);
    let mut unlimited = good_planar();
    unlimited.joints.iter_mut().for_each(|j| j.limits = Limits::default());
    let model = model_of(&unlimited, vec![Box::new(Coulomb { rate: 0 }), Box::new(Viscous { rate: 0 })]);
    let found = prior::of(&model, &stated(&model), &[7.0, 7.0], "robot.toml").unwrap();
    close(found.std[column(&model, "j1.fc")], 0.7);
    close(found.std[column(&model, "j1.fv")], 0.35);
    let unknown = prior_of(&model);
    assert!(unknown.std.iter().all(|s| s.is_finite() && *s > 0.0));
}

#[test]
fn motors_behind_a_transmission_are_scaled_through_its_matrix() {
    let matrix = vec![vec![100.0, 0.0], vec![50.0, 80.0]];
    let motors = vec!["m1".to_owned(), "m2".to_owned()];
    let transmission = Transmission { joints: vec![0, 1], matrix, motors };
    let model = model_of(&good_planar(), vec![Box::new(transmission), Box::new(DriveGain { rate: 0 })]);
    let prior = prior_of(&model);
    let std = |name: &str| prior.std[column(&model, name)];
    let close = |a: f64, b: f64| assert!((a / b - 1.0).abs() < 1e-12, "{a} against {b}");
    close(std("m1.fc"), 5.0 / 100.0);
    close(std("m2.fc"), 5.0 / 80.0);
    close(std("m1.fv"), 5.0 / (100.0 * 100.0 * 3.0));
    // Both joints at 3 rad/s turn motor 2 by (50 + 80)·3 rad/s, which joint 2 feels 80 times.
    close(std("m2.fv"), 5.0 / (80.0 * 130.0 * 3.0));
    assert!(std("m1.J") > 0.0 && std("m1.J") < 1e-3);
    close(std("j1.K"), 5.0);
}

#[test]
fn bad_priors_are_repaired_and_missing_ones_invented() {
    // No mass distribution has moments 1, 1, 5 about its centre of mass.
    let flat = Inertia::from_com(
        2.0,
        Vec3([0.1, 0.0, 0.0]),
        &Mat3::from_rows([[0.01, 0.0, 0.0], [0.0, 0.01, 0.0], [0.0, 0.0, 0.05]]),
    );
    let model = model_of(&planar([None, Some(flat)]), Vec::new());
    let found = prior_of(&model);
    assert_eq!(found.bodies[0].origin, Origin::Invented);
    assert!(matches!(found.bodies[1].origin, Origin::Repaired { raised: 1, .. }), "{:?}", found.bodies[1]);
    assert!(found.bodies.iter().all(|b| b.inertia.physical_fault().is_none()));
    // Half of the stated total; a sphere half way to joint 2.
    let sphere = &found.bodies[0].inertia;
    assert!((sphere.mass() - 1.0).abs() < 1e-15);
    let (com, about_com) = sphere.about_com().unwrap();
    assert!((com.0[0] - LENGTH / 2.0).abs() < 1e-15 && com.0[1] == 0.0);
    for axis in 0..3 {
        assert!((about_com.rows()[axis][axis] - 0.4 * 0.09).abs() < 1e-15);
    }
    assert_eq!(found.warnings.len(), 2);
    assert!(found.warnings[0].contains("link `l1`") && found.warnings[0].contains("sphere of 1.00 kg"));
    assert!(found.warnings[1].contains("link `l2`"), "{}", found.warnings[1]);

    // Nothing stated at all: 5 kg each, at least 5 cm in radius.
    let blank = prior_of(&model_of(&planar([None, Some(Inertia::default())]), Vec::new()));
    assert!(blank.bodies.iter().all(|b| b.origin == Origin::Invented && b.inertia.mass() == 5.0));
    assert!((blank.bodies[1].inertia.0[9] - 0.4 * 5.0 * 0.0025).abs() < 1e-15);
}

/// Files of kinematics often have one body for all links; none of them is a body of the robot.
#[test]
fn the_same_numbers_for_all_links_are_no_statement() {
    let of = |first, second| prior_of(&model_of(&planar([first, second]), Vec::new())).states_bodies();
    let placeholder = Some(body(1.0, [0.0; 3]));
    assert!(!of(placeholder, placeholder) && !of(None, placeholder));
    assert!(of(placeholder, Some(body(2.0, [0.0; 3]))));
}

#[test]
fn a_carrier_that_states_zeros_gets_no_invented_body() {
    let found = prior_of(&model_of(
        &planar([Some(body(3.0, [0.1, 0.0, 0.0])), Some(Inertia::default())]),
        Vec::new(),
    ));
    assert_eq!(found.bodies.iter().map(|b| b.origin).collect::<Vec<_>>(), [Origin::Stated, Origin::Massless]);
    assert!(
        (found.bodies[1].inertia.mass() - 3e-3).abs() < 1e-15
            && found.bodies[1].inertia.physical_fault().is_none()
    );
    assert!(found.warnings.is_empty(), "{:?}", found.warnings);
}

#[test]
fn a_negative_mass_is_refused_by_name_even_behind_a_weld() {
    let mut d = good_planar();
    d.links.push(LinkDescription { name: "tool".into(), inertia: Some(body(-0.5, [0.0; 3])) });
    let mut weld = joint(2, [0.1, 0.0, 0.0], Limits::default());
    (weld.kind, weld.parent, weld.child) = (JointKind::Fixed, "l2".into(), "tool".into());
    d.joints.push(weld);
    let model = model_of(&d, Vec::new());
    let refused = |model: &RobotModel| prior::of(model, &stated(model), &[0.0, 0.0], "arm.urdf").unwrap_err();
    let expected = PriorError::NegativeMass { file: "arm.urdf".into(), link: "tool".into(), mass: -0.5 };
    assert_eq!(refused(&model), expected);
    assert_eq!(expected.to_string(), "arm.urdf: link `tool`: expected a mass of at least 0, found -0.5 kg");
    let own = model_of(&planar([Some(body(-4.0, [0.0; 3])), None]), Vec::new());
    assert!(matches!(refused(&own), PriorError::NegativeMass { link, .. } if link == "l1"));
}

#[test]
fn welded_links_are_named_with_the_link_that_moves_them() {
    let mut d = good_planar();
    d.links.push(LinkDescription { name: "tool".into(), inertia: Some(body(0.5, [0.0; 3])) });
    let mut weld = joint(2, [0.1, 0.0, 0.0], Limits::default());
    (weld.kind, weld.parent, weld.child) = (JointKind::Fixed, "l2".into(), "tool".into());
    d.joints.push(weld);
    let found = prior_of(&model_of(&d, Vec::new()));
    assert_eq!(found.bodies[1].links, ["l2", "tool"]);
    assert_eq!(found.bodies[1].inertia.mass(), 2.5);
}

fn indy7() -> Study {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../robots/indy7.toml");
    let robot = Robot::load(&path, &RobotOptions::default()).unwrap();
    let plan = ElementPlan::new(&robot.mechanism, &robot.elements, None, |_| true).unwrap();
    let elements = plan.build(&robot.mechanism).unwrap();
    Study::new(RobotModel::new(robot.mechanism, elements))
}

/// Rows of the table of base parameters of the Indy7 (Tadese et al. 2022).
#[test]
fn the_combinations_of_an_industrial_arm_read_as_in_its_table() {
    let study = indy7();
    let k = regrouping(&study.base);
    let symbols = study.symbols();
    let combination = |parameter: &str, base: &str| {
        let all =
            visible_combinations(&k, &study.prior.std, &study.base.kept, column(&study.model, parameter));
        let place = study.base.kept.binary_search(&column(&study.model, base)).unwrap();
        all.into_iter().find(|c| c.base == place).unwrap()
    };
    let m3 = visible_combinations(&k, &study.prior.std, &study.base.kept, column(&study.model, "link3.m"));
    assert_eq!(m3[0].expression(&symbols), "mx2 + 0.45·(m3 + m4 + m5 + m6)");
    assert!(m3.windows(2).all(|w| w[0].share >= w[1].share));
    for (parameter, base, expected) in [
        ("link5.m", "link4.my", "my4 - mz5 - 0.184·(m5 + m6)"),
        ("link4.m", "link3.my", "my3 - mz4 - 0.35·(m4 + m5 + m6)"),
        ("link6.m", "link5.my", "my5 + mz6 + 0.228·m6"),
        ("link6.Iyy", "link6.Ixx", "Ixx6 - Iyy6"),
        ("link2.mx", "link2.mx", "mx2 + 0.45·(m3 + m4 + m5 + m6)"),
    ] {
        assert_eq!(combination(parameter, base).expression(&symbols), expected);
    }
    let lengths = prior::link_lengths(study.model.mechanism());
    assert_eq!(m3[0].constants(&lengths), ["0.45 = distance joint 2-3"]);
    assert_eq!(combination("link6.m", "link5.my").constants(&lengths), ["0.228 = distance joint 5-6"]);
    assert_eq!(
        combination("link3.m", "link2.Izz").constants(&lengths),
        ["0.203 = square of the distance joint 2-3"]
    );
    assert_eq!(
        m3[0].sentence(&symbols, Some((4.8149, 0.0212)), "kg m"),
        "the data see mx2 + 0.45·(m3 + m4 + m5 + m6) = 4.81 ± 0.02 kg m; the split follows the prior"
    );
}

#[test]
fn advice_moves_the_joint_that_stood_still() {
    let elements: Vec<Box<dyn JointElement>> = (0..2)
        .flat_map(|rate| -> [Box<dyn JointElement>; 2] {
            [Box::new(Coulomb { rate }), Box::new(Viscous { rate })]
        })
        .collect();
    let study = Study::new(model_of(&good_planar(), elements));
    let sigma = 0.2;
    let still = random_information(&study.model, &study.base, sigma, &[1]);
    let (assessed, advice) = study.advise(&still, sigma);
    let izz2 = column(&study.model, "l2.Izz");
    assert_eq!(assessed.parameters[izz2].verdict, Verdict::CarriedByPrior(Carried::NotExcited));
    let suggestion = advice.suggestions.iter().find(|s| s.parameter == izz2).unwrap();
    assert!(advice.motions[suggestion.motion].rates.contains(&1));
    assert!(suggestion.to >= 0.9 && suggestion.from < 0.7, "{suggestion:?}");
    let sentence = advice.sentence(izz2, &study.names(), "Izz2").unwrap();
    assert!(sentence.contains("of joint j2 would raise Izz2 from"), "{sentence}");
    // What no motion can reveal is not advised on, what is seen neither.
    for j in advice.suggestions.iter().map(|s| s.parameter).chain(advice.without.iter().copied()) {
        let a = &assessed.parameters[j];
        assert!(a.verdict != Verdict::Seen && a.structural_limit >= 0.2);
    }
    for s in &advice.suggestions {
        assert!(s.to - s.from >= 0.2 && s.to <= assessed.parameters[s.parameter].structural_limit + 1e-12);
    }
    // Friction shows on the joint that moves and on no other.
    for (name, rate) in [("j2.fc", 1), ("j2.fv", 1)] {
        let friction = advice.suggestions.iter().find(|s| s.parameter == column(&study.model, name)).unwrap();
        assert!(advice.motions[friction.motion].rates.contains(&rate), "{friction:?}");
    }
}

#[test]
fn nothing_is_advised_where_everything_is_seen_or_too_noisy() {
    let study = Study::new(model_of(&good_planar(), Vec::new()));
    let (_, done) = study.advise(&random_information(&study.model, &study.base, 1e-3, &[]), 1e-3);
    assert!(done.suggestions.is_empty() && done.without.is_empty(), "{done:?}");
    let (_, hopeless) = study.advise(&Factor::empty(study.base.len()), 1e6);
    assert!(hopeless.suggestions.is_empty());
    let izz2 = column(&study.model, "l2.Izz");
    assert_eq!(
        hopeless.sentence(izz2, &study.names(), "Izz2").unwrap(),
        "no motion of one or two neighbouring joints would raise Izz2 by 20 % or more"
    );
}

#[test]
fn a_model_that_reads_currents_gets_no_advice() {
    let study = Study::new(model_of(&good_planar(), vec![Box::new(DriveGain { rate: 0 })]));
    let (_, advice) = study.advise(&Factor::empty(study.base.len()), 1.0);
    assert_eq!(advice.unavailable, Some(NoAdvice::Channels(vec!["current_j1".into()])));
}

#[test]
fn advice_for_an_arm_does_not_depend_on_threads() {
    let study = indy7();
    let information = random_information(&study.model, &study.base, 2.0, &[3, 4, 5]);
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| study.advise(&information, 2.0))
    };
    let one = run(1);
    assert_eq!(one, run(2));
    assert_eq!(one, run(7));
    assert!(!one.1.suggestions.is_empty());
    let sentences = one.1.by_motion(&study.names(), &study.symbols());
    assert!(sentences.iter().all(|s| s.contains(" would raise ")), "{sentences:?}");
    assert_eq!(sentences.iter().map(|s| s.matches(" % to ").count()).sum::<usize>(), one.1.suggestions.len());
}
