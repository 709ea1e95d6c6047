//! Rows 4 to 6 and 12: estimators against an independent implementation, and without noise.

use dynid::estimators::consistent::{
    Form, LinkPrior, Margin, Problem, ScalarPrior, Settings as ConsistentSettings, estimate,
};
use dynid::estimators::linear::ols;
use dynid::estimators::{Factor, FactorBuilder, Mat};
use dynid::model::{
    BaseParameters, BaseSettings, EffortModel, History, Inertia, KnownElement, MotionBlock, RegressorBlock,
    RobotModel,
};
use dynid::motion::trajectory::Sampled;
use serde_json::json;

use super::experiment::trajectory;
use super::identification::margins;
use super::reference;
use super::robot::Indy7;
use super::settings::Settings;
use super::{JOINTS, fault};
use crate::{Row, StudyError};

pub(super) fn rows(arm: &Indy7, settings: &Settings) -> Result<Vec<Row>, StudyError> {
    Ok(vec![least_squares(arm)?, projection(arm)?, table_a2(arm, settings)?, noise_free(arm, settings)?])
}

/// Factors of the rows of a block, one per joint, in base columns.
fn factors(
    model: &RobotModel,
    base: &BaseParameters,
    block: &RegressorBlock,
    effort: &[f64],
    every: usize,
) -> Result<Vec<Factor>, StudyError> {
    let samples = block.samples();
    (0..JOINTS)
        .map(|output| {
            let mut builder = FactorBuilder::new(base.len());
            for s in (0..samples).step_by(every) {
                let mut row = vec![0.0; base.len()];
                for (k, column) in model.layout().columns(output).iter().enumerate() {
                    if let Ok(i) = base.kept.binary_search(column) {
                        row[i] = block.column(output, k)[s];
                    }
                }
                let known = block.offset(output)[s];
                builder.push_row(&row, effort[output * samples + s] - known).map_err(fault)?;
            }
            Ok(builder.finish())
        })
        .collect()
}

fn merged(factors: &[Factor]) -> Factor {
    Factor::merge(&factors.iter().collect::<Vec<_>>())
}

fn least_squares(arm: &Indy7) -> Result<Row, StudyError> {
    let reference = reference::least_squares()?;
    let base_reference = reference::base()?;
    let model = arm.regression();
    let base = BaseParameters::of(&model, &arm.mechanism, &[], &BaseSettings::default());
    let table = &model.parameters().linear;
    let friction = ["fc", "fv", "fo"].iter().flat_map(|s| (1..=JOINTS).map(move |j| format!("{s}{j}")));
    let order: Vec<usize> = base_reference
        .independent
        .iter()
        .cloned()
        .chain(friction)
        .filter_map(|symbol| base.kept.iter().position(|c| table[*c].symbol == symbol))
        .collect();
    let states = [&reference.q, &reference.qd, &reference.qdd, &reference.tau];
    let [q, dq, ddq, tau] = states.map(|rows| reference::transposed(rows));
    let samples = reference.q.len();
    let mut block = RegressorBlock::new(model.layout().clone(), samples);
    model.regressor(&MotionBlock::plain(samples, &q, &dq, &ddq), &[], &mut block);
    let factors = factors(&model, &base, &block, &tau, 1)?;
    let plain = ols(&merged(&factors));
    // The reference weights once, by σ_i² = rss_i / (M - 58/6) of the unweighted solution.
    let freedom = samples as f64 - 58.0 / JOINTS as f64;
    let weighted: Vec<Factor> =
        factors.iter().map(|f| f.scaled(1.0 / (f.rss(&plain.x) / freedom).sqrt())).collect();
    let once = ols(&merged(&weighted));
    let relative = |x: &[f64], wanted: &[f64]| {
        let scale = wanted.iter().fold(0.0_f64, |m, e| m.max(e.abs()));
        let errors = order.iter().zip(wanted).map(|(k, e)| (x[*k] - e).abs() / scale);
        errors.fold(0.0, f64::max)
    };
    let found = [relative(&plain.x, &reference.ols), relative(&once.x, &reference.wls)];
    Ok(Row::new(
        "4",
        "Ordinary and weighted least squares on 60 random states agree with an independent implementation",
        "1e-7 relative",
        json!({ "ols": found[0], "wls": found[1] }),
        format!("{:.1e}, {:.1e}", found[0], found[1]),
        order.len() == 58 && found.iter().all(|e| *e <= 1e-7),
    ))
}

/// Standard parameters nearest to base values (rows of Table A1) among feasible ones.
fn nearest(arm: &Indy7, target: &[f64], form: Form) -> Result<Vec<f64>, StudyError> {
    // The problem has no noise level; with one of 1e-4 the default weights mean what they should.
    let weight = 1e4;
    let columns = 11 * JOINTS;
    let mut r = Mat::zeros(target.len(), columns);
    for column in 0..columns {
        let mut unit = vec![0.0; columns];
        unit[column] = weight;
        for (row, value) in arm.base_values(&unit).into_iter().enumerate() {
            r[(row, column)] = value;
        }
    }
    let ball = Inertia([4.0, 0.0, 0.0, 0.0, 0.04, 0.0, 0.0, 0.04, 0.0, 0.04]);
    let links =
        (0..JOINTS).map(|i| LinkPrior { name: format!("link{}", i + 1), first_column: 10 * i, prior: ball });
    let scalars = (0..JOINTS).map(|i| ScalarPrior {
        name: format!("Ia{}", i + 1),
        column: 10 * JOINTS + i,
        prior: 0.5,
        scale: 0.5,
        nonnegative: true,
    });
    let problem = Problem {
        r,
        z: target.iter().map(|t| weight * t).collect(),
        links: links.collect(),
        scalars: scalars.collect(),
        bounds: Vec::new(),
        equalities: Vec::new(),
        prior_std: vec![1.0; columns],
    };
    let settings =
        ConsistentSettings { form, margin: Margin::Absolute(1e-6), ..ConsistentSettings::default() };
    Ok(estimate(&problem, &settings).map_err(fault)?.x)
}

fn projection(arm: &Indy7) -> Result<Row, StudyError> {
    let reference = reference::feasible()?;
    let (mut objective, mut solution, mut least) = (0.0_f64, 0.0_f64, f64::INFINITY);
    for case in &reference.cases {
        for (form, wanted, vector) in [
            (Form::SpatialInertia, case.objective_bl, &case.solution_bl),
            (Form::PseudoInertia, case.objective_pseudo_inertia, &case.solution_pseudo_inertia),
        ] {
            let found = nearest(arm, &case.target, form)?;
            least = least.min(margins(&found)[usize::from(form == Form::PseudoInertia)]);
            let base = arm.base_values(&found);
            let own: f64 = base.iter().zip(&case.target).map(|(b, t)| (b - t).powi(2)).sum();
            if let Some(wanted) = wanted {
                // A distance of zero has no relative error; 1e-10 is (1e-5)².
                objective = objective.max((own - wanted).abs() / (wanted + 1e-7));
            }
            for (own, wanted) in base.iter().zip(vector.iter().flatten()) {
                solution = solution.max((own - wanted).abs());
            }
        }
    }
    Ok(Row::new(
        "5",
        "Projections onto feasible bodies, by B_L and by pseudo-inertia, agree with a conic solver",
        "objective 1e-3 relative, solution 5e-4, every result feasible to -1e-9",
        json!({ "objective_relative": objective, "solution": solution, "least_eigenvalue": least }),
        format!("{objective:.1e}, {solution:.1e}, least eigenvalue {least:.1e}"),
        objective <= 1e-3 && solution <= 5e-4 && least >= -1e-9,
    ))
}

fn table_a2(arm: &Indy7, settings: &Settings) -> Result<Row, StudyError> {
    let target = &settings.table_a2.proposed_cold;
    let deviation = |form: Form| -> Result<(f64, f64), StudyError> {
        let base = arm.base_values(&nearest(arm, target, form)?);
        let errors: Vec<f64> = base.iter().zip(target).map(|(b, t)| (b - t).abs()).collect();
        Ok((errors.iter().fold(0.0, |m: f64, e| m.max(*e)), errors.iter().map(|e| e * e).sum::<f64>().sqrt()))
    };
    let (spatial, pseudo) = (deviation(Form::SpatialInertia)?, deviation(Form::PseudoInertia)?);
    let standard = reference::standard(&settings.table_a2.standard);
    let given = arm.base_values(&standard);
    let reproduces = given.iter().zip(target).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    let feasible = spatial.1 < 1e-5;
    Ok(Row::new(
        "6",
        "Table A2 (proposed, cold) is feasible in the paper's sense (B_L), and no density can have it: the nearest bodies that \
         can exist lie 0.067 kg m² off",
        "distance below 1e-5; largest deviation of the nearest realisable values 0.067",
        json!({
            "distance_spatial": spatial.1, "largest_pseudo": pseudo.0, "stated_vector": reproduces,
        }),
        format!(
            "{} by B_L ({:.1e}), not realisable: {:.3} off (a stated vector reproduces the table to {reproduces:.0e})",
            if feasible { "feasible" } else { "not feasible" },
            spatial.1,
            pseudo.0
        ),
        feasible && (pseudo.0 - 0.067).abs() <= 0.003,
    ))
}

/// Row 12: true states at 4 kHz, friction run along and taken off, every 80th row.
fn noise_free(arm: &Indy7, settings: &Settings) -> Result<Row, StudyError> {
    let simulation = &settings.simulation;
    let known: Vec<KnownElement> = settings
        .friction
        .iter()
        .zip(arm.mechanism.rate_names())
        .enumerate()
        .flat_map(|(rate, (f, name))| f.known(&name, settings.thermal.valid).elements(rate))
        .collect();
    let model = arm.regression().with_known(known);
    let base = BaseParameters::of(&model, &arm.mechanism, &[], &BaseSettings::default());
    let motion = Sampled::at_rate(&trajectory(&settings.trajectories.excitation)?, simulation.rate_hz)
        .map_err(fault)?;
    let samples = motion.samples();
    let warm = vec![settings.thermal.moderate; samples];
    let plain = MotionBlock::plain(samples, &motion.q, &motion.dq, &motion.ddq);
    let mut signals = vec![0.0; model.signals().len() * samples];
    let step = 1.0 / simulation.rate_hz;
    model.remember(&plain, step, &[], &mut History::default(), samples, &mut signals);
    let channels: Vec<(&str, &[f64])> = model
        .channels()
        .iter()
        .map(|name| (name.as_str(), warm.as_slice()))
        .chain(model.signals().iter().map(String::as_str).zip(signals.chunks_exact(samples)))
        .collect();
    let motion = MotionBlock { channels: &channels, ..plain };
    let mut effort = vec![0.0; JOINTS * samples];
    arm.model.efforts(&motion, &[], &arm.linear, samples, &mut effort);
    let mut block = RegressorBlock::new(model.layout().clone(), samples);
    model.regressor(&motion, &[], &mut block);
    let found = ols(&merged(&factors(&model, &base, &block, &effort, simulation.decimation)?)).x;
    let own = arm.base_values(&super::identification::standard_of(&model, &base.expanded(&found)));
    let truth = arm.base_values(&arm.standard);
    let error = own.iter().zip(&truth).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    Ok(Row::new(
        "12",
        "Without noise and with the friction known, the 40 base parameters are exact",
        "1e-7",
        json!({ "largest_error": error }),
        format!("{error:.1e}"),
        error <= 1e-7,
    ))
}
