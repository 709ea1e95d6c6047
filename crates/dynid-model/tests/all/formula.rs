//! Laws of formulas: the numbers of laws in code, and what is no law.

use dynid_model::element::{
    AtJoint, Cyclic, ElementKind, ElementRegistry, FormulaLaw, FormulaLawFault, FormulaTerms, JetMotion,
    JointElement, JointInfo, LinearTerm, Placement as Place, ShapeSetting, ShapeTerm, laws,
    temperature_channel,
};
use dynid_model::scalar::Jet;
use dynid_model::*;

use super::laws::pendulum;

fn terms(columns: &[(&'static str, &str)], shape: &[ShapeTerm]) -> FormulaTerms {
    let columns =
        columns.iter().map(|(symbol, text)| (LinearTerm::effort(symbol), (*text).to_owned())).collect();
    FormulaTerms { columns, shape: shape.to_vec(), is_friction: true }
}

fn element(terms: FormulaTerms, shape: &[ShapeSetting]) -> Box<dyn JointElement> {
    let kind = ElementKind::formula("mine", FormulaLaw::new(terms).unwrap_or_else(|e| panic!("{e}")));
    let placed = kind.place(&Place { rate: 0, shape, options: &[] });
    placed.and_then(Result::ok).unwrap_or_else(|| panic!("a law of velocity"))
}

fn close(a: f64, b: f64) -> bool {
    (a - b).abs() <= 4e-15 * (1.0 + a.abs().max(b.abs()))
}

/// Columns, derivatives by shape, adjoints and jets of two elements with the same columns.
fn compare(of_code: Box<dyn JointElement>, of_formula: Box<dyn JointElement>, shape: &[f64]) {
    let v = [-1.3, -0.2, -0.01, 0.0, 0.05, 0.7, 2.5];
    let (q, zeros) = ([0.4, -0.3, 1.0, 0.0, -2.5, 0.9, 3.2], [0.0; 7]);
    let warm = [20.0, 25.0, 30.0, 35.0, 40.0, 45.0, 50.0];
    let name = temperature_channel("j1");
    let channels: [(&str, &[f64]); 1] = [(&name, &warm)];
    let jet = |element: &dyn JointElement, joints: &[JointInfo], width: f64| {
        let (q, dq, ddq) = ([Jet::new([0.7, 0.3, 1.1])], [Jet::new([0.3, 1.1, -0.4])], [Jet::default()]);
        let channels = [(name.as_str(), Jet::new([30.0, 0.1, 0.0]))];
        let motion = JetMotion { q: &q, dq: &dq, ddq: &ddq, channels: &channels, sign_width: width };
        let mut out = vec![Jet::default(); element.entries().len()];
        assert!(element.jets(joints, &motion, shape, &mut out));
        out
    };
    let joints = pendulum(Vec::new()).joints().to_vec();
    for width in [0.0, 0.05] {
        let both = jet(&*of_code, &joints, width).into_iter().zip(jet(&*of_formula, &joints, width));
        for (a, b) in both.flat_map(|(a, b)| a.derivatives().into_iter().zip(b.derivatives())) {
            assert!((a - b).abs() <= 1e-12 * (1.0 + a.abs()), "{a} {b}");
        }
    }
    let [a, b] = [of_code, of_formula].map(|element| pendulum(vec![element]));
    assert_eq!(a.shape_dependence(), b.shape_dependence());
    for width in [0.0, 0.05] {
        let motion =
            MotionBlock { sign_width: width, channels: &channels, ..MotionBlock::plain(7, &q, &v, &zeros) };
        let block = |model: &RobotModel| {
            let mut block = RegressorBlock::new(model.layout().clone(), 7);
            model.regressor(&motion, shape, &mut block);
            (10..model.layout().columns(0).len())
                .flat_map(|k| block.column(0, k).to_vec())
                .collect::<Vec<f64>>()
        };
        let slopes = |model: &RobotModel| {
            let mut out = vec![0.0; 7 * model.shape_dependence().len()];
            model.shaped(&motion, shape, 7, &mut [], &mut out);
            out
        };
        let adjoint = |model: &RobotModel| {
            let linear: Vec<f64> = (0..model.parameters().linear.len())
                .map(|k| if k < 10 { 0.0 } else { k as f64 - 8.5 })
                .collect();
            let mut out = MotionAdjoint::new(1, 1, 7);
            model.effort_adjoint(&motion, shape, &linear, 7, &[1.0; 7], &mut out);
            [out.q, out.dq].concat()
        };
        for (a, b) in [(block(&a), block(&b)), (slopes(&a), slopes(&b)), (adjoint(&a), adjoint(&b))] {
            assert_eq!(a.len(), b.len());
            for (a, b) in a.iter().zip(&b) {
                assert!(close(*a, *b), "{a} {b}");
            }
        }
    }
}

#[test]
fn formulas_are_what_laws_in_code_are() {
    let free = |start: f64| ShapeSetting { start, lower: 1e-3, upper: 10.0, held: false };
    let speed = |symbol| ShapeTerm::positive(symbol, element::units::SPEED, 1e-3, 10.0);
    let tanh = terms(&[("mft", "tanh(v / mw)")], &[speed("mw")]);
    let code = AtJoint { rate: 0, law: laws::Tanh, shape: [free(0.2)] };
    compare(Box::new(code), element(tanh, &[free(0.2)]), &[0.2]);

    let fall = "exp(-(abs(v) / mvs)**2)";
    let columns = [("mfc", format!("sign(v) * (1 - {fall})")), ("mfs", format!("sign(v) * {fall}"))];
    let columns: Vec<(&str, &str)> = columns.iter().map(|(symbol, text)| (*symbol, text.as_str())).collect();
    let code = AtJoint { rate: 0, law: laws::Stribeck, shape: [free(0.3), ShapeSetting::held(2.0)] };
    compare(Box::new(code), element(terms(&columns, &[speed("mvs")]), &[free(0.3)]), &[0.3]);

    let power = terms(
        &[("mfp", "sign(v) * abs(v)^mp")],
        &[ShapeTerm::positive("mp", element::units::NUMBER, 0.2, 2.0)],
    );
    let free = ShapeSetting { start: 0.7, lower: 0.2, upper: 2.0, held: false };
    let code = AtJoint { rate: 0, law: laws::Power, shape: [free] };
    compare(Box::new(code), element(power, &[free]), &[0.7]);

    let order = [ShapeTerm::positive("mn", element::units::REPETITIONS, 0.1, 100.0)];
    let free = ShapeSetting { start: 3.5, lower: 1.0, upper: 9.0, held: false };
    let ripple = terms(&[("ma", "cos(mn * q)"), ("mb", "sin(mn * q)")], &order);
    compare(Box::new(Cyclic::torque(0, free)), element(ripple, &[free]), &[3.5]);
    let rubs = terms(&[("ma", "sign(v) * cos(mn * q)"), ("mb", "sign(v) * sin(mn * q)")], &order);
    let rubs = element(rubs, &[free]);
    assert!(rubs.opposes_motion() && !rubs.is_friction(), "its effort is not one of the velocity alone");
    compare(Box::new(Cyclic::friction(0, free)), rubs, &[3.5]);
}

#[test]
fn numbers_operators_and_functions_are_those_of_everywhere() {
    let (v, warm) = (0.7_f64, 31.0_f64);
    let sigmoid = 1.0 / (1.0 + (-v).exp());
    for (text, expected) in [
        ("1 + 2*3 - 4/8", 6.5),
        ("-v^2", -v * v),
        ("2^3^2", 512.0),
        ("(-v)**3 * (1 + v^2)**-2", -v.powi(3) / (1.0 + v * v).powi(2)),
        ("2e-3*v + .5 + 1.", 2e-3 * v + 1.5),
        ("--v - +v", 0.0),
        ("ln(exp(v)) + sqrt(1 + v^2)", v + (1.0 + v * v).sqrt()),
        ("atan(v) * 2 / pi", v.atan() * 2.0 / std::f64::consts::PI),
        ("logistic(v) - 0.5", sigmoid - 0.5),
        ("sign( v ) * abs(-3)", 3.0),
        ("v^0.5", f64::NAN),
        ("abs(v)^0.5", v.sqrt()),
        ("cos(q) - q * sin(2*q)", 0.3_f64.cos() - 0.3 * 0.6_f64.sin()),
        ("v * (1 - 0.004*(T - 25))", v * (1.0 - 0.004 * (warm - 25.0))),
    ] {
        let law = match FormulaLaw::new(terms(&[("mk", text)], &[])) {
            Ok(law) => law,
            Err(fault) => {
                assert!(
                    expected.is_nan() && matches!(fault, FormulaLawFault::NotFinite { v, .. } if v < 0.0),
                    "{fault}"
                );
                continue;
            }
        };
        let kind = ElementKind::formula("mine", law);
        let placed = kind.place(&Place { rate: 0, shape: &[], options: &[] }).and_then(Result::ok);
        let model = pendulum(vec![placed.unwrap_or_else(|| panic!("a law"))]);
        let (channel, temperature, speed, zero) = (temperature_channel("j1"), [warm], [v], [0.0]);
        let place = [0.3];
        let channels: [(&str, &[f64]); 1] = [(&channel, &temperature)];
        let motion = MotionBlock { channels: &channels, ..MotionBlock::plain(1, &place, &speed, &zero) };
        let mut block = RegressorBlock::new(model.layout().clone(), 1);
        model.regressor(&motion, &[], &mut block);
        assert!((block.column(0, 10)[0] - expected).abs() < 1e-15 * (1.0 + expected.abs()), "{text}");
        assert_eq!(model.channels() == [channel.clone()], text.contains('T'), "{text}");
    }
}

#[test]
fn what_is_no_law_is_refused_with_the_place() {
    let fault = |columns: &[(&'static str, &str)], shape: &[ShapeTerm]| {
        FormulaLaw::new(terms(columns, shape)).unwrap_err().to_string()
    };
    let speed = |symbol| ShapeTerm::positive(symbol, element::units::SPEED, 1e-3, 10.0);
    for (text, place, expected) in [
        ("", 1, "a number"),
        ("v +", 4, "a number"),
        ("sgn(v)", 1, "a function (sign, abs"),
        ("sign(v + 1)", 8, "`)`"),
        ("sign(w)", 6, "no other sign"),
        ("tanh v", 6, "`(`"),
        ("(v", 3, "`)`"),
        ("v v", 3, "an operator or the end"),
        ("1e999", 1, "a finite number"),
        ("v / vs", 5, "shape parameter (there is none"),
        ("v; drop", 2, "an operator"),
        ("3 * é", 5, "a number"),
    ] {
        let said = fault(&[("mk", text)], &[]);
        assert!(said.contains(&format!("character {place}: ")) && said.contains(expected), "{text}: {said}");
    }
    assert!(fault(&[("mk", &"(".repeat(900))], &[]).contains("less deep"));
    assert!(fault(&[("mk", &"-".repeat(900))], &[]).contains("less deep"));
    assert!(fault(&[("mk", &format!("{}1{}", "(1+".repeat(40), ")".repeat(40)))], &[]).contains("less deep"));
    assert!(fault(&[("mk", &"v*".repeat(900))], &[]).contains("at most 1000"));
    assert!(fault(&[("mk", "sqrt(abs(v))")], &[]).contains("expected a finite slope everywhere, found"));
    assert!(fault(&[("mk", "1 / (1 + exp(-v / vs))")], &[speed("vs")]).contains("a finite slope"));
    assert!(
        FormulaLaw::new(terms(&[("mk", "logistic(v / vs) - 0.5"), ("mj", "abs(v)^0.5")], &[speed("vs")]))
            .is_ok()
    );
    assert!(
        fault(&[("mk", "1 / (q - 1)")], &[])
            .contains("finite number everywhere, found inf at v = 0.0001, q = 1")
    );
    assert!(fault(&[("mk", "1 / v")], &[]).contains("finite number everywhere, found"));
    assert!(
        fault(&[("mk", "v * vs / vs"), ("mj", "v")], &[speed("vs"), speed("vt")])
            .contains("`vt`: no column reads it")
    );
    assert!(fault(&[("v", "1")], &[]).contains("expected a name"));
    assert!(fault(&[("mk", "v"), ("mk", "1")], &[]).contains("two of that name"));
    assert!(fault(&[], &[]).contains("1 to 8 columns, found 0"));
    assert!(
        fault(&[("mk", "v / vs")], &[ShapeTerm { lower: 2.0, upper: 1.0, ..speed("vs") }]).contains("`vs`")
    );
    // Symbols of other elements mean something to files already.
    let coulomb = ElementKind::formula("dry", FormulaLaw::new(terms(&[("fc", "sign(v)")], &[])).unwrap());
    assert!(ElementRegistry::default().with(coulomb).unwrap_err().to_string().contains("`coulomb`"));
    let [one, two] = ["v", "2*v"].map(|text| {
        let law = FormulaLaw::new(terms(&[("mk", text)], &[])).unwrap();
        ElementRegistry::default().with(ElementKind::formula("mine", law)).unwrap()
    });
    assert_ne!(one, two);
}

#[test]
fn only_what_takes_energy_out_is_a_coefficient_of_friction() {
    let columns = ["sign(v)", "-v^3", "v", "abs(v)"].into_iter().zip(["ma", "mb", "mc", "md"]);
    let columns = columns.map(|(text, symbol)| (LinearTerm::effort(symbol).coefficient(), text.to_owned()));
    let terms = FormulaTerms { columns: columns.collect(), shape: Vec::new(), is_friction: true };
    let kind = ElementKind::formula("mine", FormulaLaw::new(terms).unwrap());
    let registry = ElementRegistry::default().with(kind).unwrap();
    assert_eq!(
        ["ma", "mb", "mc", "md"].map(|symbol| registry.is_coefficient(symbol)),
        [true, false, true, false]
    );
}

/// Whatever is put together of the parts of formulas is a law or is refused; a law has as many numbers as samples.
#[test]
fn random_formulas_are_laws_or_refused() {
    let parts = [
        "v",
        "q",
        "T",
        "mw",
        "pi",
        "2",
        "0.5",
        "1e-3",
        "(",
        ")",
        "(",
        ")",
        "+",
        "-",
        "*",
        "/",
        "^",
        "**",
        "sign(v)",
        "abs(",
        "sqrt(",
        "exp(",
        "ln(",
        "sin(",
        "cos(",
        "tanh(",
        "atan(",
        "logistic(",
        " ",
        "é",
        "v",
        "1",
    ];
    let mut state = 7_u64;
    let mut draw = |most: usize| {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as usize % most
    };
    let shape = [ShapeTerm::positive("mw", element::units::SPEED, 0.1, 10.0)];
    let mut laws = 0;
    for _ in 0..100_000 {
        let text: String = (0..1 + draw(9)).map(|_| parts[draw(parts.len())]).collect();
        // The second column reads the parameter in any case.
        let Ok(law) = FormulaLaw::new(terms(&[("mk", &text), ("mj", "v / mw")], &shape)) else { continue };
        laws += 1;
        let kind = ElementKind::formula("mine", law);
        let setting = [ShapeSetting { start: 1.0, lower: 0.1, upper: 10.0, held: false }];
        let placed = kind.place(&Place { rate: 0, shape: &setting, options: &[] }).and_then(Result::ok);
        let model = pendulum(vec![placed.unwrap()]);
        let (channel, warm, zeros) = (temperature_channel("j1"), [25.0; 3], [0.0; 3]);
        let channels: [(&str, &[f64]); 1] = [(&channel, &warm)];
        let motion =
            MotionBlock { channels: &channels, ..MotionBlock::plain(3, &zeros, &[-1.0, 0.0, 3.0], &zeros) };
        let mut block = RegressorBlock::new(model.layout().clone(), 3);
        model.regressor(&motion, &[1.0], &mut block);
        assert!(block.column(0, 10).iter().all(|x| x.is_finite()), "{text}");
    }
    assert!(laws > 1_000, "{laws}");
}
