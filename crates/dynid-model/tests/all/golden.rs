//! Dynamics and base parameters against golden numbers and against each other.

#![expect(clippy::unwrap_used, reason = "helpers of tests outside of test functions")]

use dynid_model::element::{
    Arctangent, AsymmetricFriction, Coulomb, CoupledWrist, Cyclic, ElementRegistry, JointElement, Offset,
    Placement as Place, RotorInertia, ShapeSetting, Spring, Transmission, Viscous,
};
use dynid_model::*;
pub(crate) use dynid_testing::golden;
use serde_json::Value;

pub(crate) fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect()
}

pub(crate) fn flat(value: &Value) -> Vec<f64> {
    match value {
        Value::Array(a) => a.iter().flat_map(flat).collect(),
        other => vec![other.as_f64().unwrap()],
    }
}

pub(crate) fn three(value: &Value) -> [f64; 3] {
    numbers(value).try_into().unwrap()
}

#[track_caller]
pub(crate) fn check_close(found: &[f64], expected: &[f64], absolute: f64, relative: f64, what: &str) {
    assert_eq!(found.len(), expected.len(), "{what}: length");
    let scale = expected.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
    for (k, (f, e)) in found.iter().zip(expected).enumerate() {
        assert!((f - e).abs() <= absolute + relative * scale, "{what}[{k}]: {f} against {e}");
    }
}

pub(crate) fn described(bodies: &[Value], gravity: [f64; 3]) -> Description {
    let mut d = Description::new("golden");
    d.gravity = gravity;
    d.links.push(LinkDescription { name: "ground".into(), inertia: None });
    for body in bodies {
        let name = body["name"].as_str().unwrap();
        let joint = &body["joint"];
        let phi: [f64; 10] = numbers(&body["phi"]).try_into().unwrap();
        d.links.push(LinkDescription { name: name.into(), inertia: Some(Inertia(phi)) });
        let kind = match joint["kind"].as_str().unwrap() {
            "revolute" => JointKind::Revolute,
            "continuous" => JointKind::Continuous,
            "prismatic" => JointKind::Prismatic,
            "helical" => JointKind::Helical { pitch: joint["pitch"].as_f64().unwrap() },
            "floating" => JointKind::Floating,
            other => panic!("{other}"),
        };
        d.joints.push(JointDescription {
            name: name.into(),
            parent: body["parent"].as_str().unwrap().into(),
            child: name.into(),
            kind,
            placement: Placement::from_xyz_rpy(three(&joint["xyz"]), three(&joint["rpy"])),
            axis: if joint["axis"].is_null() { [0.0, 0.0, 1.0] } else { three(&joint["axis"]) },
            limits: Limits::default(),
            mimic: None,
        });
    }
    d
}

fn modified_dh(rows: &[(f64, f64, f64, f64)]) -> Description {
    let mut d = Description::new("arm");
    d.links.push(LinkDescription { name: "base".into(), inertia: None });
    for (k, (a, alpha, dz, offset)) in rows.iter().enumerate() {
        d.links.push(LinkDescription {
            name: format!("link{}", k + 1),
            inertia: Some(Inertia([1.0, 0.1, 0.1, 0.1, 1.0, 0.0, 0.0, 1.0, 0.0, 1.0])),
        });
        d.joints.push(JointDescription {
            name: format!("joint{}", k + 1),
            parent: if k == 0 { "base".into() } else { format!("link{k}") },
            child: format!("link{}", k + 1),
            kind: JointKind::Revolute,
            placement: Placement::rotate([1.0, 0.0, 0.0], *alpha)
                .then(&Placement::translate(*a, 0.0, 0.0))
                .then(&Placement::translate(0.0, 0.0, *dz))
                .then(&Placement::rotate([0.0, 0.0, 1.0], *offset)),
            axis: [0.0, 0.0, 1.0],
            limits: Limits::default(),
            mimic: None,
        });
    }
    d
}

use std::f64::consts::{FRAC_PI_2, PI};
const INDY7: [(f64, f64, f64, f64); 6] = [
    (0.0, 0.0, 0.3, 0.0),
    (0.0, FRAC_PI_2, 0.0, FRAC_PI_2),
    (0.45, 0.0, 0.0035, FRAC_PI_2),
    (0.0, FRAC_PI_2, 0.35, PI),
    (0.0, FRAC_PI_2, 0.1835, 0.0),
    (0.0, -FRAC_PI_2, 0.228, 0.0),
];
const ER16: [(f64, f64, f64, f64); 3] =
    [(0.0, 0.0, 0.45, 0.0), (0.17, -FRAC_PI_2, 0.0, -FRAC_PI_2), (0.70, 0.0, 0.0, 0.0)];

/// The papers' order `Ixx Ixy Ixz Iyy Iyz Izz mx my mz m` → ours.
const PAPER_ORDER: [usize; 10] = [4, 5, 6, 7, 8, 9, 1, 2, 3, 0];

#[test]
fn floating_tree_with_every_joint_kind() {
    let Some(g) = golden("mech_floating.json") else { return };
    let d = described(g["bodies"].as_array().unwrap(), three(&g["gravity"]));
    let mechanism = d.build().unwrap();
    let dynamics = Dynamics::new(&mechanism);
    let phi = mechanism.inertia_vector();
    let mut work = dynamics.workspace();
    let n = dynamics.rates();
    for state in g["states"].as_array().unwrap() {
        let (q, dq, ddq) = (numbers(&state["q"]), numbers(&state["qd"]), numbers(&state["qdd"]));
        let s = State { q: &q, dq: &dq, ddq: &ddq, gravity: None };
        let mut effort = vec![0.0; n];
        dynamics.inverse_dynamics(&s, &phi, &mut work, &mut effort);
        check_close(&effort, &numbers(&state["effort"]), 0.0, 1e-11, "effort");
        let b1 = mechanism.joint_index("b1").unwrap();
        check_close(
            &dynamics.joint_wrench(b1, &work),
            &numbers(&state["reaction_wrench_b1"]),
            0.0,
            1e-11,
            "wrench",
        );
        if state["regressor"].is_array() {
            let mut y = vec![0.0; n * phi.len()];
            dynamics.regressor(&s, &mut work, &mut y);
            check_close(&y, &flat(&state["regressor"]), 0.0, 1e-11, "regressor");
        }
        if state["mass_matrix"].is_array() {
            let mass = dynamics.mass_matrix(&q, &phi, &mut work);
            check_close(&mass, &flat(&state["mass_matrix"]), 0.0, 1e-11, "mass matrix");
        }
        let energy = dynamics.energy(&q, &dq, &phi, &mut work);
        let expected = numbers(&state["energy"]);
        check_close(&[energy.kinetic, energy.potential], &expected, 0.0, 1e-11, "energy");
    }
    let model = RobotModel::new(mechanism, vec![]);
    let base = BaseParameters::of(&model, model.mechanism(), &[], &BaseSettings::default());
    assert_eq!(base.len() as u64, g["base_count"].as_u64().unwrap());
    assert!(base.gap.ratio() > 1e10, "{:?}", base.gap);
}

#[test]
fn indy7_efforts_poses_and_regressor() {
    let Some(g) = golden("indy7_dynamics.json") else { return };
    let mechanism = modified_dh(&INDY7).build().unwrap();
    let given = numbers(&g["phi_standard"]);
    let mut phi = vec![0.0; 60];
    for link in 0..6 {
        for (k, c) in PAPER_ORDER.iter().enumerate() {
            phi[10 * link + c] = given[11 * link + k];
        }
    }
    let dynamics = Dynamics::new(&mechanism);
    let mut work = dynamics.workspace();
    for state in g["states"].as_array().unwrap() {
        let (q, dq, ddq) = (numbers(&state["q"]), numbers(&state["qd"]), numbers(&state["qdd"]));
        let s = State { q: &q, dq: &dq, ddq: &ddq, gravity: None };
        let mut effort = vec![0.0; 6];
        dynamics.inverse_dynamics(&s, &phi, &mut work, &mut effort);
        check_close(&effort, &numbers(&state["tau_without_rotor"]), 1e-9, 0.0, "tau");
        for j in 0..6 {
            effort[j] += given[11 * j + 10] * ddq[j];
        }
        check_close(&effort, &numbers(&state["tau"]), 1e-9, 0.0, "tau with rotor");
        let frame = dynamics.forward_kinematics(&q, &mut work)[5];
        check_close(frame.rotation.rows().as_flattened(), &flat(&state["fk_frame6_R"]), 1e-9, 0.0, "R");
        check_close(&frame.translation.0, &numbers(&state["fk_frame6_p"]), 1e-9, 0.0, "p");
        if state["regressor_6x66"].is_array() {
            let expected = flat(&state["regressor_6x66"]);
            let mut y = vec![0.0; 6 * 60];
            dynamics.regressor(&s, &mut work, &mut y);
            for row in 0..6 {
                for link in 0..6 {
                    for (k, c) in PAPER_ORDER.iter().enumerate() {
                        let (f, e) = (y[row * 60 + 10 * link + c], expected[row * 66 + 11 * link + k]);
                        assert!((f - e).abs() <= 1e-9, "row {row} link {link} {k}: {f} {e}");
                    }
                }
            }
        }
    }
}

fn rotors(n: usize) -> Vec<Box<dyn JointElement>> {
    (0..n).map(|rate| Box::new(RotorInertia { rate }) as Box<dyn JointElement>).collect()
}

#[test]
fn indy7_has_forty_base_parameters_with_the_textbook_regroupings() {
    let Some(g) = golden("indy7_base.json") else { return };
    let model = RobotModel::new(modified_dh(&INDY7).build().unwrap(), rotors(6));
    let base = BaseParameters::of(&model, model.mechanism(), &[], &BaseSettings::default());
    let table = model.parameters();
    let expected: Vec<String> =
        g["independent"].as_array().unwrap().iter().map(|s| s.as_str().unwrap().to_owned()).collect();
    assert_eq!(base.len(), 40);
    assert!(base.gap.ratio() > 1e10);
    let k = base.matrix();
    let expected_k = flat(&g["grouping_matrix"]);
    let names: Vec<&str> =
        g["names_standard"].as_array().unwrap().iter().map(|s| s.as_str().unwrap()).collect();
    for (row, symbol) in expected.iter().enumerate() {
        let own = base.kept.iter().position(|c| table.linear[*c].symbol == *symbol);
        let own = own.unwrap_or_else(|| panic!("{symbol} is not kept"));
        for (column, name) in names.iter().enumerate() {
            let c = table.linear.iter().position(|p| p.symbol == *name).unwrap();
            let (f, e) = (k[own * 66 + c], expected_k[row * 66 + column]);
            assert!((f - e).abs() <= 1e-9, "{symbol} {name}: {f} against {e}");
        }
    }
    let expressions = base.expressions(table);
    assert!(expressions[0].starts_with("Izz1 + Iyy2 + Iyy3 + Ia1"), "{}", expressions[0]);
    let mx2 = expressions.iter().find(|e| e.starts_with("mx2")).unwrap();
    assert_eq!(mx2, "mx2 + 0.45 (m3 + m4 + m5 + m6)");
    // Link 1 turns about a fixed vertical axis: only its Izz acts.
    let silent: Vec<&str> = base.zero.iter().map(|c| table.linear[*c].symbol.as_str()).collect();
    assert_eq!(silent, ["m1", "mx1", "my1", "mz1", "Ixx1", "Ixy1", "Ixz1", "Iyy1", "Iyz1", "m2", "mz2"]);
}

/// Standard parameters of three links in the paper's order → ours.
fn er16_parameters(given: &[f64]) -> Vec<f64> {
    let mut phi = vec![0.0; 30];
    for link in 0..3 {
        for (k, c) in PAPER_ORDER.iter().enumerate() {
            phi[10 * link + c] = given[10 * link + k];
        }
    }
    phi
}

/// For every base parameter of the paper's list, its place among ours.
fn er16_places(g: &Value, model: &RobotModel, base: &BaseParameters) -> Vec<usize> {
    let listed = g["independent"].as_array().unwrap();
    assert_eq!(base.len(), listed.len());
    let symbol = |column: &usize| model.parameters().linear[*column].symbol.as_str();
    listed
        .iter()
        .map(|name| base.kept.iter().position(|c| symbol(c) == name.as_str().unwrap()).unwrap())
        .collect()
}

#[test]
fn er16_has_the_fifteen_base_parameters_of_the_paper() {
    let Some(g) = golden("er16_dynamics.json") else { return };
    let model = RobotModel::new(modified_dh(&ER16).build().unwrap(), vec![]);
    let base = BaseParameters::of(&model, model.mechanism(), &[], &BaseSettings::default());
    assert!(base.gap.ratio() > 1e10, "{:?}", base.gap);
    let places = er16_places(&g, &model, &base);
    let k = base.matrix();
    let expected = flat(&g["grouping_matrix_15x30"]);
    for (row, own) in places.iter().enumerate() {
        for link in 0..3 {
            for (column, c) in PAPER_ORDER.iter().enumerate() {
                let (f, e) = (k[own * 30 + 10 * link + c], expected[row * 30 + 10 * link + column]);
                assert!((f - e).abs() <= 1e-9, "base {row}, link {link}, {column}: {f} against {e}");
            }
        }
    }
    for (phi, beta) in [("phi_random", "phi_b_random"), ("phi_standard_truth", "phi_b_truth")] {
        let values = base.values(&er16_parameters(&numbers(&g[phi])));
        let found: Vec<f64> = places.iter().map(|own| values[*own]).collect();
        check_close(&found, &numbers(&g[beta]), 1e-9, 1e-9, beta);
    }
}

#[test]
fn er16_efforts_friction_regressor_and_poses() {
    let Some(g) = golden("er16_dynamics.json") else { return };
    // f0, fc, fv, fa and fb of every joint of the ER-16.
    let friction = [
        [0.7044, 3.9877, 8.0, 32.3929, 6.9975],
        [53.2922, -2.8909, -70.0174, 70.0243, 19.7363],
        [-3.4499, 30.6465, 4.3297, -2.7533, 5.0],
    ];
    let mut elements: Vec<Box<dyn JointElement>> = Vec::new();
    let mut linear = er16_parameters(&numbers(&g["phi_standard_truth"]));
    for (rate, [f0, fc, fv, fa, _]) in friction.into_iter().enumerate() {
        elements.push(Box::new(Offset { rate }));
        elements.push(Box::new(Coulomb { rate }));
        elements.push(Box::new(Viscous { rate }));
        elements.push(Box::new(Arctangent::new(rate)));
        linear.extend([f0, fc, fv, fa]);
    }
    let shape = friction.map(|[.., fb]| fb);
    let mechanism = modified_dh(&ER16).build().unwrap();
    let rigid = RobotModel::new(mechanism.clone(), vec![]);
    let base = BaseParameters::of(&rigid, &mechanism, &[], &BaseSettings::default());
    let places = er16_places(&g, &rigid, &base);
    let model = RobotModel::new(mechanism, elements);
    let dynamics = Dynamics::new(model.mechanism());
    let mut work = dynamics.workspace();
    for state in g["states"].as_array().unwrap() {
        let (q, dq, ddq) = (numbers(&state["q"]), numbers(&state["qd"]), numbers(&state["qdd"]));
        let motion = MotionBlock::plain(1, &q, &dq, &ddq);
        let mut effort = vec![0.0; 3];
        rigid.efforts(&motion, &[], &linear[..30], 1, &mut effort);
        check_close(&effort, &numbers(&state["tau_rigid_from_standard"]), 1e-9, 0.0, "rigid");
        let mut effort = vec![0.0; 3];
        model.tree().element_efforts(&motion, &shape, &linear, 1, &mut effort, &mut Vec::new());
        check_close(&effort, &numbers(&state["friction"]), 1e-9, 0.0, "friction");
        model.efforts(&motion, &shape, &linear, 1, &mut effort);
        check_close(&effort, &numbers(&state["tau_total"]), 1e-9, 0.0, "total");
        let mut w = RegressorBlock::new(rigid.layout().clone(), 1);
        rigid.regressor(&motion, &[], &mut w);
        let expected = flat(&state["regressor_base_3x15"]);
        for joint in 0..3 {
            for (k, own) in places.iter().enumerate() {
                let acting = rigid.layout().columns(joint).iter().position(|c| *c == base.kept[*own]);
                let (f, e) = (acting.map_or(0.0, |a| w.column(joint, a)[0]), expected[joint * 15 + k]);
                assert!((f - e).abs() <= 1e-9, "joint {joint}, base {k}: {f} against {e}");
            }
        }
        let frame = dynamics.forward_kinematics(&q, &mut work)[2];
        check_close(frame.rotation.rows().as_flattened(), &flat(&state["fk_frame3_R"]), 1e-9, 0.0, "R");
        check_close(&frame.translation.0, &numbers(&state["fk_frame3_p"]), 1e-9, 0.0, "p");
    }
}

#[test]
fn linear_elements_follow_their_laws() {
    let Some(g) = golden("mech_elements.json") else { return };
    let v = numbers(&g["v"]);
    let arm = modified_dh(&ER16[..1]).build().unwrap();
    let effort = |element: Box<dyn JointElement>, q: &[f64], dq: &[f64], ddq: &[f64], values: &[f64]| {
        let model = RobotModel::new(arm.clone().with_gravity([0.0; 3]), vec![element]);
        let mut linear = vec![0.0; 10];
        linear.extend_from_slice(values);
        let n = dq.len();
        let motion = MotionBlock::plain(n, q, dq, ddq);
        let mut block = RegressorBlock::new(model.layout().clone(), n);
        model.regressor(&motion, &[], &mut block);
        block.effort(0, &linear)
    };
    let zero = vec![0.0; v.len()];
    let mut seen = 0;
    for curve in g["curves"].as_array().unwrap() {
        let p = &curve["parameters"];
        let number = |key: &str| p[key].as_f64().unwrap();
        let (element, values): (Box<dyn JointElement>, Vec<f64>) = match curve["element"].as_str().unwrap() {
            "coulomb" => (Box::new(Coulomb { rate: 0 }), vec![number("fc")]),
            "viscous" => (Box::new(Viscous { rate: 0 }), vec![number("fv")]),
            "offset" => (Box::new(Offset { rate: 0 }), vec![number("fo")]),
            "asymmetric" => {
                let keys: Vec<&String> = p.as_object().unwrap().keys().collect();
                let pick = |names: &[&str]| {
                    names.iter().find_map(|n| p[*n].as_f64()).unwrap_or_else(|| panic!("{keys:?}"))
                };
                let values = vec![
                    pick(&["fcp", "fc_plus", "fc+"]),
                    pick(&["fcm", "fcn", "fc_minus", "fc-"]),
                    pick(&["fvp", "fv_plus", "fv+"]),
                    pick(&["fvm", "fvn", "fv_minus", "fv-"]),
                ];
                (Box::new(AsymmetricFriction { rate: 0 }), values)
            }
            _ => continue,
        };
        seen += 1;
        check_close(
            &effort(element, &zero, &v, &zero, &values),
            &numbers(&curve["effort"]),
            0.0,
            1e-12,
            "curve",
        );
    }
    assert!(seen >= 2, "{seen} linear curves");
    let s = &g["spring"];
    let (k, q0) = (s["k"].as_f64().unwrap(), s["q0"].as_f64().unwrap());
    let q = numbers(&s["q"]);
    let zero = vec![0.0; q.len()];
    let e = effort(Box::new(Spring { rate: 0 }), &q, &zero, &zero, &[k, k * q0]);
    check_close(&e, &numbers(&s["effort"]), 0.0, 1e-12, "spring");
    let c = &g["cyclic"];
    let values = [c["a"].as_f64().unwrap(), c["b"].as_f64().unwrap()];
    let element = Cyclic::torque(0, ShapeSetting::held(c["n"].as_f64().unwrap()));
    let e = effort(Box::new(element), &q, &zero, &zero, &values);
    check_close(&e, &numbers(&c["effort"]), 0.0, 1e-12, "cyclic");
    let b = &g["balancer"];
    let [k, radius, distance, phi, free, preload] =
        ["k", "r", "a", "phi", "L0", "F0"].map(|key| b[key].as_f64().unwrap());
    let registry = ElementRegistry::default();
    let shape = [distance, radius, phi].map(ShapeSetting::held);
    let placement = Place { rate: 0, shape: &shape, options: &[] };
    let element = registry.kind("balancer").unwrap().place(&placement).unwrap().unwrap();
    let e = effort(element, &numbers(&b["q"]), &zero, &zero, &[k, preload - k * free]);
    check_close(&e, &numbers(&b["effort"]), 1e-10, 1e-12, "balancer");
}

fn six_joint_effort(
    elements: Vec<Box<dyn JointElement>>,
    dq: &[f64],
    ddq: &[f64],
    values: &[f64],
) -> Vec<f64> {
    let model = RobotModel::new(modified_dh(&INDY7).build().unwrap(), elements);
    let mut linear = vec![0.0; 60];
    linear.extend_from_slice(values);
    let motion = MotionBlock::plain(1, &[0.0; 6], dq, ddq);
    let mut block = RegressorBlock::new(model.layout().clone(), 1);
    model.regressor(&motion, &[], &mut block);
    (0..6).map(|j| block.effort(j, &linear)[0]).collect()
}

#[test]
fn transmission_is_the_transposed_matrix_of_motor_efforts() {
    let Some(g) = golden("mech_elements.json") else { return };
    let t = &g["transmission"];
    let matrix: Vec<Vec<f64>> = t["A"].as_array().unwrap().iter().map(numbers).collect();
    let (dq, ddq) = (numbers(&t["qd"]), numbers(&t["qdd"]));
    let [j, fc, fv] = ["motor_inertia", "motor_coulomb", "motor_viscous"].map(|k| numbers(&t[k]));
    let values: Vec<f64> = (0..6).flat_map(|m| [j[m], fc[m], fv[m]]).collect();
    let element = Transmission {
        joints: (0..6).collect(),
        matrix: matrix.clone(),
        motors: (1..=6).map(|m| format!("m{m}")).collect(),
    };
    let found = six_joint_effort(vec![Box::new(element)], &dq, &ddq, &values);
    check_close(&found, &numbers(&t["joint_effort"]), 0.0, 1e-12, "strict transmission");

    // The three-column form: direct terms on the joints, the motor of joint 6 split off.
    let r = matrix[5][5];
    let mut elements: Vec<Box<dyn JointElement>> = Vec::new();
    let mut values = Vec::new();
    for m in 0..6 {
        let mut ratio = matrix[m][m] * matrix[m][m];
        let mut direct = (ratio * j[m], matrix[m][m].abs() * fc[m], ratio * fv[m]);
        if m == 4 {
            ratio = r * r;
            direct.0 += ratio * j[5];
            direct.2 += ratio * fv[5];
        }
        if m == 5 {
            direct.1 = 0.0;
        }
        elements.push(Box::new(RotorInertia { rate: m }));
        elements.push(Box::new(Coulomb { rate: m }));
        elements.push(Box::new(Viscous { rate: m }));
        values.extend([direct.0, direct.1, direct.2]);
    }
    elements.push(Box::new(CoupledWrist { a: 4, b: 5, ratio: matrix[5][4] / r }));
    values.extend([r * r * j[5], r * r * fv[5], r.abs() * fc[5]]);
    let found = six_joint_effort(elements, &dq, &ddq, &values);
    check_close(&found, &numbers(&t["joint_effort"]), 0.0, 1e-12, "three-column form");
}
