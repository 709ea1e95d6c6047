//! Rows 1 to 4: parts, batch and recursive solutions against an independent implementation.

use dynid::estimators::linear::LinearMethod;
use dynid::estimators::online::{
    Estimator, Forgetting, RowNoise, Settings as Recursive, error_driven_factor,
};
use dynid::model::element::CubicSpring;
use dynid::model::{EffortModel, MotionBlock};
use dynid::motion::trajectory::{PaulBlend, Profile};
use serde_json::json;

use super::joint::{Damping, LINK, MOTOR, identified, without_spring};
use super::measurement::Signals;
use super::offline::{Equations, Tables, fit_model};
use super::online::samples;
use super::reference::{self, Measured, Recursion, Sequence};
use super::settings::Settings;
use super::{PARAMETERS, Values};
use crate::{Row, StudyError};

fn largest(errors: impl Iterator<Item = f64>) -> f64 {
    errors.fold(0.0, |worst: f64, e| if e.is_nan() { f64::INFINITY } else { worst.max(e.abs()) })
}

/// Largest relative difference of two lists.
fn relative(found: &[f64], expected: &[f64]) -> f64 {
    if found.len() != expected.len() {
        return f64::INFINITY;
    }
    largest(found.iter().zip(expected).map(|(f, e)| if f == e { 0.0 } else { f / e - 1.0 }))
}

/// Row 1.
pub(super) fn parts_row(settings: &Settings) -> Result<Row, StudyError> {
    let parts = reference::parts()?;
    let path = PaulBlend::constant_velocity(0.0, parts.paul.v, parts.paul.blend, parts.paul.cruise)?;
    let blend = largest(parts.paul.t.iter().enumerate().flat_map(|(k, t)| {
        let point = path.at(*t);
        let (paul, found) = (&parts.paul, [point.position, point.velocity, point.acceleration]);
        [found[0] - paul.theta[k], found[1] - paul.theta_d[k], found[2] - paul.theta_dd[k]]
    }));
    let spring = CubicSpring { k1: parts.spring.k1, k2: parts.spring.k2 };
    let deformations: Vec<f64> =
        parts.spring.torque.iter().map(|t| spring.deformation(*t).unwrap_or(f64::NAN)).collect();
    let inverse = relative(&deformations, &parts.spring.dtheta);
    let forgetting = &parts.forgetting;
    let factor =
        largest(
            forgetting.relative_error.iter().zip(&forgetting.lam).map(|(error, lambda)| {
                error_driven_factor(*error, forgetting.alpha, forgetting.beta) - lambda
            }),
        );
    let (model, linear) = without_spring(settings);
    let shape = model.parameters().shape_start();
    let effort = |q: f64, motor_speed: f64| {
        let (q, dq) = ([q, 0.0], [0.0, motor_speed]);
        let mut out = [0.0; 2];
        model.efforts(&MotionBlock::plain(1, &q, &dq, &[0.0; 2]), &shape, &linear, 1, &mut out);
        out
    };
    let input = parts.friction.theta_in_d.iter().zip(&parts.friction.torque);
    let cyclic = parts.friction.cyclic.theta_out.iter().zip(&parts.friction.cyclic.torque);
    let friction = largest(
        input.map(|(w, t)| effort(0.0, *w)[MOTOR] - t).chain(cyclic.map(|(q, t)| effort(*q, 0.0)[LINK] - t)),
    );
    Ok(Row::new(
        "1",
        "Blends, inverse of the spring, forgetting factor, friction of the input with all its terms and torque once a turn, \
         against an independent implementation",
        "1e-12, 1e-12 relative, 1e-14, 1e-12",
        json!({ "blends": blend, "spring": inverse, "forgetting": factor, "friction": friction }),
        format!("{blend:.1e}, {inverse:.1e}, {factor:.1e}, {friction:.1e}"),
        blend <= 1e-12 && inverse <= 1e-12 && factor <= 1e-14 && friction <= 1e-12,
    ))
}

fn signals(measured: &Measured, motor_acceleration: &[f64]) -> Signals {
    let n = measured.dtheta.len();
    let mut acceleration = motor_acceleration.to_vec();
    acceleration.resize(n, 0.0);
    Signals {
        position: vec![0.0; n],
        deformation: measured.dtheta.clone(),
        motor_speed: measured.theta_in_d.clone(),
        link_speed: measured.theta_out_d.clone(),
        motor_acceleration: acceleration,
        motor_torque: measured.motor_torque.clone(),
        link_torque: measured.link_torque.clone(),
    }
}

/// Rows 2 and 3.
pub(super) fn batch_rows(settings: &Settings) -> Result<[Row; 2], StudyError> {
    let reference = reference::least_squares()?;
    let clean = signals(&reference.clean.measured, &reference.clean.theta_in_dd);
    let model = identified(settings, Damping::Full, true);
    let found = fit_model(settings, &model, &[clean], Equations::Both, &LinearMethod::Ols)?;
    let truth = relative(&found.x, &reference.clean.truth);
    let solution = relative(&found.x, &reference.clean.solution);
    let second = Row::new(
        "2",
        "Least squares on clean rows with the torque of the motor's inertia",
        "truth to 1e-9 relative, reference solution to 1e-7",
        json!({ "truth": truth, "solution": solution, "scaled_condition": found.solution.condition_scaled,
                "raw_condition": found.solution.condition }),
        format!(
            "{truth:.1e}, {solution:.1e}; condition {:.1e} raw, {:.0} in unit columns",
            found.solution.condition, found.solution.condition_scaled
        ),
        truth <= 1e-9 && solution <= 1e-7,
    );
    let noisy = Tables::new(settings, &[signals(&reference.noisy.measured, &[])])?;
    let reference = &reference.noisy;
    let differences = [
        ("eq1_no_damping", relative(&noisy.none[0], &reference.eq1_no_damping)),
        ("eq2_no_damping", relative(&noisy.none[1], &reference.eq2_no_damping)),
        ("coupled_no_damping", relative(&noisy.none[2], &reference.coupled_no_damping)),
        ("eq1_coulomb", relative(&noisy.coulomb[0], &reference.eq1_coulomb)),
        ("eq2_coulomb", relative(&noisy.coulomb[1], &reference.eq2_coulomb)),
        ("full", relative(&noisy.full.x, &reference.solution_coupled_6)),
    ];
    let worst = largest(differences.iter().map(|d| d.1));
    let measured: serde_json::Map<_, _> =
        differences.iter().map(|(n, d)| ((*n).to_owned(), json!(d))).collect();
    let third = Row::new(
        "3",
        "All six nested models on noisy rows, motor's inertia neglected",
        "reference solutions to 1e-7 relative",
        measured.into(),
        format!("{worst:.1e} at worst"),
        worst <= 1e-7,
    );
    Ok([second, third])
}

/// Largest relative difference to both references from the first step that counts on.
fn sequence(
    settings: &Settings,
    reference: &Recursion,
    sequence: &Sequence,
    forgetting: Forgetting,
) -> Result<[f64; 2], StudyError> {
    let column = |k: usize| -> Vec<f64> { reference.rows.iter().map(|r| r[k]).collect() };
    let n = reference.rows.len();
    let signals = Signals {
        position: vec![0.0; n],
        deformation: column(0),
        motor_speed: column(1),
        link_speed: column(2),
        motor_acceleration: vec![0.0; n],
        motor_torque: column(3).iter().map(|y| y / settings.ratio).collect(),
        link_torque: column(4),
    };
    let std = reference.units.map(|u| settings.online.start_std * u);
    let mut recursive = Recursive::new(vec![0.0; PARAMETERS], std.to_vec(), 2);
    recursive.scale = reference.units.to_vec();
    (recursive.detection, recursive.reaction) = (None, None);
    recursive.forgetting = forgetting;
    let mut estimator = Estimator::new(recursive)?;
    let mut worst = [0.0_f64; 2];
    for (k, sample) in
        samples(settings, &identified(settings, Damping::Full, false), &signals).iter().enumerate()
    {
        estimator.step(&sample.regressor, &sample.effort, RowNoise::Std(&[1.0, 1.0]))?;
        if k >= reference.compare_from_step {
            let against = |list: &[Values]| relative(estimator.x(), &list[k]);
            worst[0] = worst[0].max(against(&sequence.exact));
            worst[1] = worst[1].max(against(&sequence.double));
        }
    }
    Ok(worst)
}

/// Row 4.
pub(super) fn recursion_row(settings: &Settings) -> Result<Row, StudyError> {
    let reference = reference::recursion()?;
    let published =
        Forgetting::ErrorDriven { alpha: reference.alpha, beta: reference.beta, floor: reference.floor };
    let variable = sequence(settings, &reference, &reference.variable, published)?;
    let constant = sequence(settings, &reference, &reference.constant, Forgetting::None)?;
    let difference = |s: &Sequence| {
        let steps = s.double.iter().zip(&s.exact).skip(reference.compare_from_step);
        largest(steps.map(|(double, exact)| relative(double, exact)))
    };
    let own = difference(&reference.variable).max(difference(&reference.constant));
    let exact = variable[0].max(constant[0]);
    let double = variable[1].max(constant[1]);
    Ok(Row::new(
        "4",
        "Recursive sequences, the paper's forgetting factor and none, from step 10 on, against the recursion with 60 digits (the \
         reference in double precision is itself off it by 4e-5)",
        "1e-6 relative",
        json!({ "variable": variable[0], "constant": constant[0], "against_double_precision": double,
                "double_precision_against_exact": own }),
        format!(
            "{exact:.1e}; from the reference in double precision {double:.1e}, which is off by {own:.1e}"
        ),
        exact <= 1e-6,
    ))
}
