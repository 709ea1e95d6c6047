//! From a problem to the best of several optimised trajectories.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc;
use std::time::{Duration, Instant};

use dynid_linalg::Mat;

use crate::criterion::{Criterion, Measure, Smoothing};
use crate::feasibility::{Infeasible, diagnose, violated_at_start};
use crate::grid::Grid;
use crate::optimiser::{Curvature, Point, Settings as Steps, minimise};
use crate::parametrisation::Parametrisation;
use crate::problem::{Problem, ProblemError, count, finite, value};
use crate::restoration::Restoration;
use crate::search::{Observation, Search};
use crate::start::{feasible_share, feasible_start, generator, shrunk};

/// Settings of a design.
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    /// Most starts. Default 16.
    pub starts: usize,
    /// Seed of the first start; start `k` has seed `seed + k`. Default 1.
    pub seed: u64,
    /// No start begins after this time, and those that began end at their next iteration, s; the first one gets a trajectory in any case.
    /// `None` (default): all starts run, so that the result does not depend on the speed of the machine.
    pub time_budget_s: Option<f64>,
    /// Samples of a period on which the reported criterion is taken, with exact signs. Default 1000.
    pub report_samples: usize,
    /// A trajectory that the first start sets out from instead of random ones: `[q0, a.., b..]` of every coordinate, plain
    /// amplitudes. It need not keep the start conditions or the limits: the nearest that keeps the conditions is taken, and
    /// its amplitudes are shrunk into the limits. Default `None`.
    pub from: Option<Vec<Vec<f64>>>,
}

impl Default for Settings {
    fn default() -> Self {
        Settings { starts: 16, seed: 1, time_budget_s: None, report_samples: 1000, from: None }
    }
}

impl Settings {
    fn check(&self, problem: &Problem) -> Result<(), ProblemError> {
        if self.starts == 0 || self.seed.checked_add(self.starts as u64).is_none() {
            return Err(value("starts", "at least one, seeds within 64 bits", self.starts as f64));
        }
        if self.report_samples > 1_000_000 {
            return Err(value("samples of the report", "at most 1000000", self.report_samples as f64));
        }
        if let Some(from) = &self.from {
            count("trajectory to set out from", problem.coordinates.len(), from.len())?;
            for (name, row) in problem.coordinates.iter().zip(from) {
                count("coefficients to set out from", 1 + 2 * problem.harmonics, row.len())?;
                let what = format!("coefficient of {name} to set out from");
                row.iter().try_for_each(|x| finite(&what, *x))?;
            }
        }
        Ok(())
    }
}

/// One start's end.
#[derive(Debug, Clone, PartialEq)]
pub struct StartOutcome {
    /// Seed of the start.
    pub seed: u64,
    /// Unknowns at the end; see [`Parametrisation`].
    pub unknowns: Vec<f64>,
    /// Criterion on the report's samples with exact signs; `None` if the matrix is singular.
    pub criterion: Option<f64>,
    /// Largest excess over a limit at any instant, normalised; limits hold if it is at most 0.
    pub excess: f64,
    /// Evaluations of criterion and limits.
    pub evaluations: usize,
    /// Share of the amplitudes left after the last resort of scaling them down; 1 as a rule.
    pub share: f64,
    /// Whether the time budget ended it before its last iteration.
    pub cut: bool,
}

impl StartOutcome {
    /// Whether all limits hold and the criterion is defined.
    pub fn is_feasible(&self) -> bool {
        self.excess <= 0.0 && self.criterion.is_some()
    }
}

/// Outcome of a design.
#[derive(Debug, Clone, PartialEq)]
pub enum Outcome {
    /// At least one start ended within all limits.
    Found(Design),
    /// No start did, and the search for any motion within the limits failed too.
    Infeasible(Infeasible),
}

/// The best trajectory and how it came about.
#[derive(Debug, Clone, PartialEq)]
pub struct Design {
    /// All starts that ran, by seed.
    pub starts: Vec<StartOutcome>,
    /// Index of the best.
    pub best: usize,
    /// Fourier coefficients `[q0, a.., b..]` of every coordinate, plain amplitudes.
    pub coefficients: Vec<Vec<f64>>,
}

impl Design {
    /// The best start.
    pub fn best(&self) -> &StartOutcome {
        &self.starts[self.best]
    }
}

/// One stage of the schedule of a start.
struct Stage {
    criterion: Criterion,
    smoothing: Smoothing,
    iterations: usize,
    radius: f64,
    /// On the grid with twice the samples.
    fine: bool,
}

/// Warm start with the determinant, which is smooth and pulls up all small values; then smooth stand-ins for measures of
/// extremes, ever closer (with more and smaller steps).
fn schedule(criterion: &Criterion) -> Vec<Stage> {
    let stage = |smoothing, iterations, radius, fine| Stage {
        criterion: criterion.clone(),
        smoothing,
        iterations,
        radius,
        fine,
    };
    let warm = Stage {
        criterion: Criterion { measure: Measure::Determinant, scaling: criterion.scaling.clone() },
        smoothing: None,
        iterations: 10,
        radius: 0.5,
        fine: false,
    };
    let mut stages = vec![warm];
    if criterion.is_extremal() {
        stages.extend([5.0, 15.0, 50.0, 150.0].map(|order| stage(Some(order), 60, 0.5, false)));
        stages.push(stage(Some(150.0), 20, 0.1, true));
    } else {
        stages.push(stage(None, 120, 0.5, false));
        stages.push(stage(None, 20, 0.1, true));
    }
    stages
}

/// Random start points that one start compares.
const CANDIDATES: usize = 4;
/// Iterations, after the warm start, on which they are compared.
const TRIAL_ITERATIONS: usize = 10;

/// Optimises from several starts and keeps the best.
///
/// `done`: starts of an earlier run with the same problem and settings, which are not repeated. `observe` hears of every
/// start as it ends. Results do not depend on the number of threads; with a time budget the number of starts, and those that it cuts, depend on
/// the machine.
///
/// # Errors
/// [`ProblemError`] if the problem is not well posed.
pub fn design(
    problem: &Problem,
    settings: &Settings,
    done: Vec<StartOutcome>,
    observe: &mut dyn FnMut(&StartOutcome),
) -> Result<Outcome, ProblemError> {
    let begun = Instant::now();
    problem.check()?;
    settings.check(problem)?;
    let map = Parametrisation::new(&problem.limits, problem.base, problem.harmonics, &problem.start);
    let deadline =
        settings.time_budget_s.map(|budget| begun + Duration::from_secs_f64(budget.clamp(0.0, 1e9)));
    let optimiser = StartOptimiser::new(problem, &map, settings, deadline);
    refuse_rank_deficient(problem, &optimiser.search)?;
    let at_start = violated_at_start(problem, &map);
    if !at_start.is_empty() {
        return Ok(Outcome::Infeasible(Infeasible { violations: at_start, blamed: None, at_start: true }));
    }
    let mut starts = done;
    starts.retain(|s| (settings.seed..settings.seed + settings.starts as u64).contains(&s.seed));
    let missing: Vec<u64> = (settings.seed..settings.seed + settings.starts as u64)
        .filter(|seed| starts.iter().all(|s| s.seed != *seed))
        .collect();
    // Starts differ in length: threads take the next one as they get free, in the order of seeds.
    let next = AtomicUsize::new(0);
    let had_some = !starts.is_empty();
    let take = || {
        let k = next.fetch_add(1, Ordering::Relaxed);
        missing.get(k).filter(|_| !optimiser.is_over() || (k == 0 && !had_some))
    };
    let threads = rayon::current_num_threads().clamp(1, missing.len().max(1));
    let (send, ended) = mpsc::channel();
    std::thread::scope(|scope| {
        for _ in 0..threads {
            let send = send.clone();
            scope.spawn(|| {
                let send = send;
                while let Some(seed) = take() {
                    // The receiver lives as long as this scope.
                    let _ = send.send(optimiser.run(*seed));
                }
            });
        }
        drop(send);
        for outcome in ended.iter().flatten() {
            observe(&outcome);
            starts.push(outcome);
        }
    });
    starts.sort_by_key(|s| s.seed);
    let best = (0..starts.len()).filter(|k| starts[*k].is_feasible()).min_by(|a, b| {
        let value = |k: &usize| starts[*k].criterion.unwrap_or(f64::INFINITY);
        value(a).total_cmp(&value(b))
    });
    Ok(match best {
        Some(best) => {
            let coefficients = map.coefficients(&starts[best].unknowns);
            Outcome::Found(Design { starts, best, coefficients })
        }
        None => Outcome::Infeasible(diagnose(problem, &map, settings.seed)),
    })
}

/// Everything that starts share.
struct StartOptimiser<'a> {
    problem: &'a Problem,
    /// Seed and unknowns of the start that sets out from a given trajectory.
    given: Option<(u64, Vec<f64>)>,
    search: Grid<'a>,
    finer: Grid<'a>,
    restoration: Restoration<'a>,
    report: Grid<'a>,
    deadline: Option<Instant>,
}

impl<'a> StartOptimiser<'a> {
    fn new(
        problem: &'a Problem,
        map: &'a Parametrisation,
        settings: &Settings,
        deadline: Option<Instant>,
    ) -> Self {
        StartOptimiser {
            problem,
            given: settings.from.as_ref().map(|from| (settings.seed, map.nearest(from))),
            search: Grid::search(problem, map, problem.samples),
            finer: Grid::exact(problem, map, 2 * problem.samples),
            restoration: Restoration::new(problem, map),
            report: Grid::exact(problem, map, settings.report_samples.max(4 * problem.harmonics)),
            deadline,
        }
    }

    fn is_over(&self) -> bool {
        self.deadline.is_some_and(|deadline| Instant::now() >= deadline)
    }

    /// `None` if no start point within the limits was found or the criterion is not defined there.
    fn run(&self, seed: u64) -> Option<StartOutcome> {
        let stages = schedule(&self.problem.criterion);
        let (warm, rest) = stages.split_at(1);
        let mut rng = generator(seed);
        let mut best: Option<Candidate> = None;
        let mut evaluations = 0;
        let given = self.given.as_ref().filter(|(first, _)| *first == seed);
        // Some start points lead to far worse optima than others, which a few iterations tell.
        for _ in 0..if given.is_some() { 1 } else { CANDIDATES } {
            if best.is_some() && self.is_over() {
                break;
            }
            let start = match given {
                Some((_, z)) => feasible_share(&self.search, z).map(|share| shrunk(&self.search, z, share)),
                None => feasible_start(&self.search, &mut rng),
            };
            let Some(z) = start else { continue };
            let mut candidate = Candidate { z, point: Point::default(), curvature: None, evaluations: 0 };
            if self.advance(&mut candidate, &warm[0], warm[0].iterations).is_none() {
                continue;
            }
            candidate.curvature = None;
            if self.advance(&mut candidate, &rest[0], TRIAL_ITERATIONS).is_none() {
                continue;
            }
            evaluations += std::mem::take(&mut candidate.evaluations);
            if best.as_ref().is_none_or(|b| candidate.merit() < b.merit()) {
                best = Some(candidate);
            }
        }
        let mut candidate = best?;
        for stage in rest.iter().take_while(|_| !self.is_over()) {
            self.advance(&mut candidate, stage, stage.iterations)?;
        }
        let cut = self.is_over();
        let restored = self.restoration.restore(candidate.z);
        Some(StartOutcome {
            seed,
            criterion: exact_criterion(self.problem, &self.report, &restored.z),
            excess: restored.excess,
            share: restored.share,
            unknowns: restored.z,
            evaluations: evaluations + candidate.evaluations,
            cut,
        })
    }

    fn advance(&self, candidate: &mut Candidate, stage: &Stage, iterations: usize) -> Option<()> {
        let grid = if stage.fine { &self.finer } else { &self.search };
        let mut search = Search::new(grid, stage.criterion.clone(), stage.smoothing);
        let steps = Steps { iterations, radius: stage.radius, stall: 1e-4, deadline: self.deadline };
        let z = std::mem::take(&mut candidate.z);
        let outcome = minimise(&mut search, z, candidate.curvature.take(), steps)?;
        candidate.evaluations += search.evaluations;
        (candidate.z, candidate.point, candidate.curvature) =
            (outcome.z, outcome.point, Some(outcome.curvature));
        Some(())
    }
}

/// Trajectory on its way through the stages.
struct Candidate {
    z: Vec<f64>,
    point: Point,
    /// Later stages minimise nearly the same function and go on with what the earlier learned.
    curvature: Option<Curvature>,
    evaluations: usize,
}

impl Candidate {
    fn merit(&self) -> f64 {
        self.point.objective + self.point.violation
    }
}

/// Criterion with exact signs.
fn exact_criterion(problem: &Problem, grid: &Grid<'_>, z: &[f64]) -> Option<f64> {
    problem.criterion.value(&exact_triangle(problem, grid, z))
}

/// Triangle of the weighted observation matrix with exact signs.
pub(crate) fn exact_triangle(problem: &Problem, grid: &Grid<'_>, z: &[f64]) -> Mat {
    Observation::new(problem, &grid.motion(z), 0.0).triangle
}

/// Columns that no motion tells apart would make every criterion infinite: find out on one random motion.
fn refuse_rank_deficient(problem: &Problem, grid: &Grid<'_>) -> Result<(), ProblemError> {
    const HALVINGS: usize = 10;
    let mut share = 1.0;
    let z = crate::start::draw(grid, &mut generator(1));
    let mut triangle = exact_triangle(problem, grid, &z);
    for _ in 0..HALVINGS {
        if triangle.col_iter().all(|c| c.iter().all(|x| x.is_finite())) {
            break;
        }
        // Mechanisms with loops have no pose where a large motion leads.
        share *= 0.5;
        triangle = exact_triangle(problem, grid, &crate::start::shrunk(grid, &z, share));
    }
    let columns = problem.model.columns();
    let n = triangle.ncols();
    let lengths: Vec<f64> = (0..n).map(|j| triangle.col_norm(j)).collect();
    let silent: Vec<String> =
        (0..n).filter(|j| lengths[*j] == 0.0).map(|j| columns[j].name.clone()).collect();
    if !silent.is_empty() {
        return Err(ProblemError::RankDeficient { columns: silent });
    }
    let scaled = Mat::from_fn(n, n, |i, j| triangle[(i, j)] / lengths[j]);
    let Some((sigma, v)) = crate::criterion::singular_values(&scaled, true) else { return Ok(()) };
    if sigma.last().is_some_and(|last| *last > 1e-9 * sigma[0]) {
        return Ok(());
    }
    let direction = v.col(n - 1);
    let largest = direction.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
    let columns = (0..n).filter(|j| direction[*j].abs() > 0.1 * largest).map(|j| columns[j].name.clone());
    Err(ProblemError::RankDeficient { columns: columns.collect() })
}
