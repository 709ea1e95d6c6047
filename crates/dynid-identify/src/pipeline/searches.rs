//! Searches over all bounded parameters, beside the least-squares answer.

use std::ops::ControlFlow;
use std::time::Instant;

use dynid_estimate::effort_objective::{EffortLoss, EffortObjective};
use dynid_estimate::identifiability::VisibleSpace;
use dynid_model::{BaseParameters, BaseSettings, EffortModel, MotionBlock, RobotModel};
use dynid_motion::filter::{butterworth, forward_backward};
use dynid_motion::shift::shift;
use dynid_rows::conditioning::{PreparedLog, States};
use dynid_search::{self as search, Algorithm, Bounds, Objective, SearchResult};

use super::model_fit::{ModelFit, state_hz};
use crate::problem::Problem;
use crate::searches::{SearchEnd, SearchRun, SearchedBy, Searches};
use crate::settings::{SearchConfig, SearchLoss, SearchOver};
use crate::structure::{preferred_columns, stated_values};
use crate::{Error, advice, prior};

/// Bounds of linear parameters about the robot file, in standard deviations.
const RANGE: f64 = 3.0;
/// Most samples.
const SAMPLES: usize = 2000;
/// Huber's threshold in rms residuals.
const HUBER: f64 = 1.345;
/// Periods of the state cut-off that are left out at both ends of a log.
const EDGE_PERIODS: f64 = 1.0;

/// Samples of all logs, one after the other.
struct Samples {
    count: usize,
    q: Vec<f64>,
    dq: Vec<f64>,
    ddq: Vec<f64>,
    /// Per output.
    effort: Vec<Vec<f64>>,
    channels: Vec<(String, Vec<f64>)>,
}

/// Runs the searches that the settings ask for; `None` if they ask for none.
///
/// # Errors
/// [`Error::Setting`], [`Error::Unsupported`], [`Error::Conditioning`].
pub(crate) fn run(problem: &Problem, fit: &ModelFit) -> Result<Option<Searches>, Error> {
    let settings = &problem.settings;
    let Some(config) = &settings.estimator.search else { return Ok(None) };
    let algorithms = config.algorithms()?;
    // The nonlinear model with its ties: what a search moves has to obey them.
    let (_, consistent) = fit.nonlinear(problem)?;
    let own = fit.shapes.as_ref().map_or(&problem.model, |found| &found.model);
    // Loads stay those of the least-squares answer, whatever a search moves.
    let held = match problem.plan.follows_loads() {
        true => {
            let model = problem.plan.tied_model(&problem.robot.mechanism)?;
            Some(model.with_shape(&own.parameters().shape_start()))
        }
        false => None,
    };
    let model = held.as_ref().unwrap_or(own);
    if !model.signals().is_empty() {
        return Err(Error::Unsupported(
            "friction with memory, whose signals depend on its shape, has no form in a search: leave out `[estimator.search]`"
                .to_owned(),
        ));
    }
    let unknowns = Unknowns::new(problem, fit, model, &consistent, config)?;
    let samples = samples(problem, fit, config.samples.unwrap_or(SAMPLES))?;
    let channels: Vec<(&str, &[f64])> =
        samples.channels.iter().map(|(n, v)| (n.as_str(), v.as_slice())).collect();
    let motion = MotionBlock {
        channels: &channels,
        ..MotionBlock::plain(samples.count, &samples.q, &samples.dq, &samples.ddq)
    };
    let effort: Vec<&[f64]> = samples.effort.iter().map(Vec::as_slice).collect();
    let weights = weights(model, config)?;
    let loss = match config.loss {
        SearchLoss::Absolute => EffortLoss::Absolute,
        SearchLoss::Squared => EffortLoss::Squared,
        SearchLoss::Huber => EffortLoss::Huber(thresholds(model, &unknowns, &motion, &effort)),
    };
    let objective = EffortObjective::new(model, motion, &effort, &unknowns.columns, &weights, loss)
        .map_err(|e| Error::Unsupported(format!("search: {e}")))?;
    let mut least_squares = [0.0];
    objective.evaluate(&unknowns.least_squares, &mut least_squares);
    let seeds: Vec<u64> =
        (0..config.runs.unwrap_or(1)).map(|k| settings.seed.unwrap_or(1) + k as u64).collect();
    let mut found = Vec::with_capacity(algorithms.len());
    for (algorithm, name) in algorithms.iter().zip(&config.algorithms) {
        let begun = Instant::now();
        let results = runs(algorithm, &objective, &unknowns.bounds, config, &seeds)?;
        found.push(searched(name, &seeds, results, begun.elapsed().as_secs_f64()));
    }
    found.sort_by(|a, b| a.value.total_cmp(&b.value));
    let limits: Vec<(f64, f64)> =
        unknowns.bounds.lower().iter().copied().zip(unknowns.bounds.upper().iter().copied()).collect();
    let beyond = |(x, (low, high)): (&f64, &(f64, f64))| x < low || x > high;
    let outside = unknowns.least_squares.iter().zip(&limits).map(beyond).zip(&unknowns.names);
    Ok(Some(Searches {
        over: config.over,
        loss: config.loss,
        outside: outside.filter(|(out, _)| *out).map(|(_, name)| name.clone()).collect(),
        unknowns: unknowns.names,
        bounds: limits,
        samples: samples.count,
        least_squares: least_squares[0],
        least_squares_point: unknowns.least_squares,
        found,
    }))
}

/// What a search moves.
struct Unknowns {
    names: Vec<String>,
    /// Linear columns.
    columns: Vec<usize>,
    bounds: Bounds,
    /// The least-squares answer.
    least_squares: Vec<f64>,
}

impl Unknowns {
    fn new(
        problem: &Problem,
        fit: &ModelFit,
        model: &RobotModel,
        consistent: &[f64],
        config: &SearchConfig,
    ) -> Result<Self, Error> {
        let Problem { plan, structure, settings, robot, .. } = problem;
        let table = model.parameters();
        let shape = table.shape_start();
        let settings_of_base = BaseSettings {
            seed: settings.seed.unwrap_or(1),
            preferred: preferred_columns(&settings.preferred, model)?,
            ..BaseSettings::default()
        };
        let base = BaseParameters::of_model(model, &shape, &settings_of_base);
        let stated = stated_values(model, plan);
        let mut known =
            prior::of(model, &stated, &structure.effort_sizes, &robot.path.display().to_string())?;
        model.complete(&mut known.values);
        let found = fit.unconstrained_values(problem);
        let (columns, centre, width, answer) = match config.over {
            SearchOver::Base => {
                let space = VisibleSpace::new(&advice::regrouping(&base), &known.std);
                let centre = base.values(&known.values);
                (base.kept.clone(), centre, space.base_std().to_vec(), base.values(&found))
            }
            SearchOver::Standard => {
                let acts = |c: &usize| !base.zero.contains(c);
                let columns: Vec<usize> = (0..table.linear.len()).filter(acts).collect();
                let of = |values: &[f64]| columns.iter().map(|c| values[*c]).collect::<Vec<f64>>();
                let (centre, width, answer) = (of(&known.values), of(&known.std), of(consistent));
                (columns, centre, width, answer)
            }
        };
        let range = config.range.unwrap_or(RANGE);
        let mut lower: Vec<f64> = centre.iter().zip(&width).map(|(x, w)| x - range * w).collect();
        let mut upper: Vec<f64> = centre.iter().zip(&width).map(|(x, w)| x + range * w).collect();
        let alone = |k: usize| base.factors.iter().all(|factors| factors[k] == 0.0);
        for (k, column) in columns.iter().enumerate() {
            // What has limits of its own keeps them where it stands for itself.
            if config.over == SearchOver::Standard || alone(k) {
                lower[k] = table.linear[*column].lower.map_or(lower[k], |low| lower[k].max(low));
                upper[k] = table.linear[*column].upper.map_or(upper[k], |high| upper[k].min(high));
            }
        }
        let first_shape = columns.len();
        lower.extend(table.shape.iter().map(|s| s.lower));
        upper.extend(table.shape.iter().map(|s| s.upper));
        let names = columns.iter().map(|c| table.linear[*c].name.clone());
        let names: Vec<String> = names.chain(table.shape.iter().map(|s| s.name.clone())).collect();
        for (name, range) in &config.bounds {
            let follows = |k: usize| {
                let shape = k.checked_sub(first_shape);
                shape.is_some_and(|s| model.ties().is_some_and(|ties| ties.of_shape(s).is_some()))
            };
            let Some(k) = names.iter().position(|own| own == name).filter(|k| !follows(*k)) else {
                let expected = format!("one of the unknowns {}", names.join(", "));
                return Err(Error::setting("estimator.search.bounds", &expected, name));
            };
            // Settings have been checked: there are two.
            if let [low, high] = range[..] {
                (lower[k], upper[k]) = (low, high);
            }
        }
        let fault =
            |e: search::BoundsError| Error::setting("estimator.search", "bounds of all parameters", e);
        let logarithmic = table.shape.iter().enumerate().filter(|(_, s)| s.logarithmic && s.lower < s.upper);
        let logarithmic: Vec<usize> = logarithmic.map(|(k, _)| first_shape + k).collect();
        let bounds =
            Bounds::new(lower, upper).and_then(|b| b.with_logarithmic(&logarithmic)).map_err(fault)?;
        let least_squares = answer.into_iter().chain(shape).collect();
        Ok(Unknowns { names, columns, bounds, least_squares })
    }
}

/// Weights of the outputs.
fn weights(model: &RobotModel, config: &SearchConfig) -> Result<Vec<f64>, Error> {
    let names: Vec<String> = model.outputs().iter().map(|o| o.name.clone()).collect();
    match config.weights.keys().find(|name| !names.contains(name)) {
        Some(name) => Err(Error::UnknownJoint { name: name.clone(), known: names }),
        None => Ok(names.iter().map(|name| config.weights.get(name).copied().unwrap_or(1.0)).collect()),
    }
}

/// Huber's thresholds from the residuals of least squares.
fn thresholds(
    model: &RobotModel,
    unknowns: &Unknowns,
    motion: &MotionBlock<'_>,
    effort: &[&[f64]],
) -> Vec<f64> {
    let n = motion.samples;
    let mut linear = vec![0.0; model.parameters().linear.len()];
    unknowns.columns.iter().zip(&unknowns.least_squares).for_each(|(c, x)| linear[*c] = *x);
    let shape = &unknowns.least_squares[unknowns.columns.len()..];
    let mut predicted = vec![0.0; effort.len() * n];
    model.efforts(motion, shape, &linear, n, &mut predicted);
    let of = |(measured, predicted): (&&[f64], &[f64])| {
        let square: f64 = measured.iter().zip(predicted).map(|(a, b)| (a - b).powi(2)).sum();
        HUBER * (square / n as f64).sqrt().max(f64::MIN_POSITIVE)
    };
    effort.iter().zip(predicted.chunks_exact(n)).map(of).collect()
}

fn runs(
    algorithm: &Algorithm,
    objective: &dyn Objective,
    bounds: &Bounds,
    config: &SearchConfig,
    seeds: &[u64],
) -> Result<Vec<SearchResult>, Error> {
    let SearchConfig { iterations, evaluations, population, .. } = *config;
    let plain = search::Settings { iterations, evaluations, population, ..search::Settings::default() };
    let one = |seed: &u64| {
        let settings = search::Settings { seed: *seed, ..plain.clone() };
        search::run(algorithm, objective, bounds, &settings, &mut |_| ControlFlow::Continue(()))
    };
    // Candidates are evaluated side by side already.
    let found: Result<_, _> = seeds.iter().map(one).collect();
    found.map_err(|e| {
        Error::setting("estimator.search", "a search that can run", format!("`{}`: {e}", algorithm.name()))
    })
}

fn searched(name: &str, seeds: &[u64], results: Vec<SearchResult>, seconds: f64) -> SearchedBy {
    let mut values: Vec<f64> = results.iter().map(|r| r.value).collect();
    values.sort_by(f64::total_cmp);
    let best = results.iter().min_by(|a, b| a.value.total_cmp(&b.value));
    let run = |(seed, r): (&u64, &SearchResult)| SearchRun {
        seed: *seed,
        value: r.value,
        evaluations: r.evaluations,
        end: match r.status {
            search::Status::BudgetUsed => SearchEnd::BudgetUsed,
            search::Status::Converged => SearchEnd::Converged,
            _ => SearchEnd::Stopped,
        },
        history: r.history.iter().map(|p| (p.evaluations, p.value)).collect(),
    };
    let (middle, odd) = (values.len() / 2, values.len() % 2 == 1);
    SearchedBy {
        algorithm: name.to_owned(),
        value: values[0],
        median: if odd { values[middle] } else { 0.5 * (values[middle - 1] + values[middle]) },
        point: best.map_or_else(Vec::new, |r| r.point.clone()),
        runs: seeds.iter().zip(&results).map(run).collect(),
        seconds,
    }
}

/// Samples of all logs: states and efforts through the same filter, the delay of the efforts taken off, evenly thinned.
fn samples(problem: &Problem, fit: &ModelFit, most: usize) -> Result<Samples, Error> {
    let settings = problem.conditioning_settings();
    let state_hz = state_hz(&problem.settings, fit.conditioning.as_ref());
    let delay = fit.conditioning.as_ref().map_or(0.0, |c| c.delay.samples);
    let total: usize = problem.logs.iter().map(PreparedLog::samples).sum();
    let every = total.div_ceil(most).max(1);
    let outputs = problem.model.outputs().len();
    let names = problem.model.channels();
    let offsets = offset_channels(problem)?;
    let mut parts: [Vec<Vec<f64>>; 3] = std::array::from_fn(|_| Vec::new());
    let mut effort = vec![Vec::new(); outputs];
    let mut channels: Vec<(String, Vec<f64>)> =
        names.iter().chain(&offsets).map(|n| (n.clone(), Vec::new())).collect();
    for log in problem.logs.iter() {
        let states = States::of_motion(log, state_hz, &settings)?;
        let hz = state_hz.min(settings.cutoff.state_rate * log.rate_hz);
        let margin = (EDGE_PERIODS * log.rate_hz / hz).ceil() as usize;
        let mut bad: Vec<bool> = log.usable.iter().map(|u| !u).collect();
        bad = dynid_motion::mask::dilate(&bad, margin);
        dynid_motion::mask::merge(&mut bad, &dynid_motion::mask::edges(log.samples(), margin));
        let used: Vec<usize> = (0..log.samples()).step_by(every).filter(|s| !bad[*s]).collect();
        let filter = butterworth(settings.state_order, hz, log.rate_hz).map_err(signal)?;
        let block = states.block(0..log.samples());
        let n = log.samples();
        for (all, signal) in parts.iter_mut().zip([&block.q, &block.dq, &block.ddq]) {
            all.resize(signal.len() / n, Vec::new());
            for (to, from) in all.iter_mut().zip(signal.chunks_exact(n)) {
                to.extend(used.iter().map(|s| from[*s]));
            }
        }
        for (to, measured) in effort.iter_mut().zip(&log.effort) {
            let smooth = forward_backward(&filter, measured).map_err(signal)?;
            let led = if delay == 0.0 { smooth } else { shift(&smooth, -delay).map_err(signal)?.values };
            to.extend(used.iter().map(|s| led[*s]));
        }
        for (name, to) in &mut channels {
            let Some(channel) = log.channels.iter().find(|c| c.name == *name) else {
                return Err(Error::Unsupported(format!("search: {} has no channel `{name}`", log.name)));
            };
            match offsets.contains(name) {
                false => to.extend(used.iter().map(|s| channel.values[*s])),
                // Journals swing faster than the filter of the efforts passes.
                true => {
                    let slow = forward_backward(&filter, &channel.values).map_err(signal)?;
                    to.extend(used.iter().map(|s| slow[*s]));
                }
            }
        }
    }
    let count = effort.first().map_or(0, Vec::len);
    if count == 0 {
        return Err(Error::Unsupported("no sample is left to search on: the logs are too short".to_owned()));
    }
    let [q, dq, ddq] = parts.map(|signal| signal.concat());
    Ok(Samples { count, q, dq, ddq, effort, channels })
}

/// Channels of the offsets of journals that the logs have: all of them or none.
fn offset_channels(problem: &Problem) -> Result<Vec<String>, Error> {
    let Some(journals) = problem.model.journals() else { return Ok(Vec::new()) };
    let has = |log: &PreparedLog, name: &String| log.channels.iter().any(|c| c.name == *name);
    let named: Vec<String> = journals.offset_channels().flatten().flatten().cloned().collect();
    let some: Vec<String> =
        named.into_iter().filter(|name| problem.logs.iter().any(|log| has(log, name))).collect();
    for log in problem.logs.iter() {
        if let Some(name) = some.iter().find(|name| !has(log, name)) {
            return Err(Error::Unsupported(format!(
                "search: {} has no channel `{name}`, which another log has: search on logs that all have probes, or none",
                log.name
            )));
        }
    }
    Ok(some)
}

fn signal(e: dynid_motion::SignalError) -> Error {
    Error::Conditioning(e.into())
}
