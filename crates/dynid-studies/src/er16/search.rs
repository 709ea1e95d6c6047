//! Rows 6 to 8: the paper's objective, and its three searches over many seeds.

use dynid::estimators::search::{
    Algorithm, Bounds, CuckooSearch, EffortLoss, EffortObjective, HistoryPoint, ImprovedCuckooSearch,
    Objective, ParticleSwarm, SearchResult, Settings as SearchSettings, many, rank_sum,
};
use serde_json::json;

use super::arm::{Arm, JOINTS, Place};
use super::measurement::Measurement;
use super::reference;
use super::settings::Settings;
use crate::statistics::median;
use crate::{Row, RunSettings, Steps, StudyError};

/// A search with the results of all seeds.
#[derive(Debug)]
pub(super) struct Searched {
    pub(super) name: &'static str,
    pub(super) results: Vec<SearchResult>,
}

impl Searched {
    pub(super) fn values(&self) -> Vec<f64> {
        self.results.iter().map(|r| r.value).collect()
    }

    pub(super) fn median(&self) -> f64 {
        median(self.values())
    }

    /// The best of every three runs in a row, as the paper takes them.
    pub(super) fn best_of_three(&self) -> Vec<&SearchResult> {
        self.results
            .chunks_exact(3)
            .filter_map(|three| three.iter().min_by(|a, b| a.value.total_cmp(&b.value)))
            .collect()
    }

    /// Median over seeds of the best value after so many evaluations.
    pub(super) fn median_history(&self, points: usize) -> Vec<[f64; 2]> {
        let last = self.results.iter().map(|r| r.evaluations).max().unwrap_or(0);
        (1..=points)
            .map(|k| {
                let at = last * k as u64 / points as u64;
                let value = |history: &[HistoryPoint]| {
                    let known = history.partition_point(|p| p.evaluations <= at);
                    known.checked_sub(1).map_or(f64::NAN, |k| history[k].value)
                };
                [at as f64, median(self.results.iter().map(|r| value(&r.history)).collect())]
            })
            .collect()
    }
}

/// The three searches on one data set.
#[derive(Debug)]
pub(super) struct Searches {
    pub(super) ics: Searched,
    pub(super) cs: Searched,
    pub(super) pso: Searched,
    /// Median correlation per joint of the best of three.
    pub(super) correlation: [[f64; JOINTS]; 3],
}

impl Searches {
    pub(super) fn all(&self) -> [&Searched; 3] {
        [&self.ics, &self.cs, &self.pso]
    }
}

/// The paper's objective on a motion with measured torque; its unknowns are base values, then shape.
pub(super) fn objective<'a>(arm: &'a Arm, data: &'a Measurement) -> Result<EffortObjective<'a>, StudyError> {
    let effort: Vec<&[f64]> = data.torque.chunks_exact(data.samples).collect();
    EffortObjective::new(arm.model.as_ref(), data.block(), &effort, &arm.base.kept, &[], EffortLoss::Absolute)
        .map_err(|e| StudyError::Data { file: "er16", message: e.to_string() })
}

/// The paper's unknowns in the order of the objective.
pub(super) fn point(arm: &Arm, unknowns: &[f64]) -> Vec<f64> {
    let (base, shape) = arm.split(unknowns);
    [base, shape].concat()
}

/// The paper's unknowns from a point of the objective.
pub(super) fn unknowns(arm: &Arm, point: &[f64]) -> Vec<f64> {
    let (base, shape) = point.split_at(arm.base.len());
    arm.unknowns(base, shape)
}

fn bounds(arm: &Arm, settings: &Settings) -> Result<Bounds, StudyError> {
    let side = |k: usize| {
        let values: Vec<f64> = settings.unknowns.iter().map(|u| u.bounds[k]).collect();
        point(arm, &values)
    };
    debug_assert!(arm.places.iter().any(|p| matches!(p, Place::Shape(_))));
    Bounds::new(side(0), side(1))
        .map_err(|e| StudyError::Data { file: "er16/settings.toml", message: e.to_string() })
}

/// Row 6.
pub(super) fn objective_row(arm: &Arm) -> Result<Row, StudyError> {
    let reference = reference::identification()?;
    let data = Measurement::of_reference(&reference);
    let objective = objective(arm, &data)?;
    let mut worst = 0.0_f64;
    for case in &reference.objective_cases {
        let mut value = [0.0];
        objective.evaluate(&point(arm, &case.x), &mut value);
        worst = worst.max((value[0] - case.objective).abs());
    }
    Ok(Row::new(
        "6",
        "The objective of given parameter vectors agrees with an independent implementation",
        "1e-8 N m",
        json!({ "error": worst, "cases": reference.objective_cases.len() }),
        format!("{worst:.1e} N m over {} vectors", reference.objective_cases.len()),
        worst <= 1e-8,
    ))
}

/// All searches over all seeds.
pub(super) fn searches(
    arm: &Arm,
    settings: &Settings,
    data: &Measurement,
    run: &RunSettings,
    steps: &mut Steps<'_>,
) -> Result<Searches, StudyError> {
    let objective = objective(arm, data)?;
    let bounds = bounds(arm, settings)?;
    let seeds: Vec<u64> = (0..if run.quick { 30 } else { 60 }).map(|k| run.seed + k).collect();
    let mut search = |name: &'static str, algorithm: &Algorithm| -> Result<Searched, StudyError> {
        steps.begin(&format!("{} runs of {name}", seeds.len()));
        let results = many(algorithm, &objective, &bounds, &SearchSettings::default(), &seeds)
            .map_err(|e| StudyError::Data { file: "er16", message: e.to_string() })?;
        Ok(Searched { name, results })
    };
    let ics = search("ICS", &Algorithm::ImprovedCuckooSearch(ImprovedCuckooSearch::default()))?;
    let cs = search("CS", &Algorithm::CuckooSearch(CuckooSearch::default()))?;
    let pso = search("PSO", &Algorithm::ParticleSwarm(ParticleSwarm::published()))?;
    let correlation = [&ics, &cs, &pso].map(|searched| {
        let of_runs: Vec<[f64; JOINTS]> = searched
            .best_of_three()
            .iter()
            .map(|r| {
                let predicted = arm.efforts(&data.block(), &unknowns(arm, &r.point));
                data.correlation(&data.torque, &predicted)
            })
            .collect();
        std::array::from_fn(|j| median(of_runs.iter().map(|c| c[j]).collect()))
    });
    Ok(Searches { ics, cs, pso, correlation })
}

/// Rows 7 and 8. `separable`: correlation per joint of the separable estimate.
pub(super) fn rows(searches: &Searches, separable: [f64; JOINTS], settings: &Settings) -> [Row; 2] {
    let [ics, cs, pso] = searches.all().map(Searched::median);
    let p = rank_sum(&searches.ics.values(), &searches.cs.values()).map_or(1.0, |r| r.less);
    let seeds = searches.ics.results.len();
    let seventh = Row::new(
        "7",
        "With equal iterations ICS is better than CS, and CS better than PSO",
        "median objective ICS < CS < PSO over at least 30 seeds, one-sided rank test of ICS against CS p < 0.05",
        json!({ "median_ics": ics, "median_cs": cs, "median_pso": pso, "p": p, "seeds": seeds }),
        format!("{ics:.2} < {cs:.2} < {pso:.1} N m, p = {p:.1e}, {seeds} seeds"),
        ics < cs && cs < pso && p < 0.05 && seeds >= 30,
    );
    let [of_ics, of_cs, of_pso] = searches.correlation;
    let at_least =
        |found: &[f64; JOINTS], least: &[f64; JOINTS]| found.iter().zip(least).all(|(f, l)| f >= l);
    let three = |c: &[f64; JOINTS]| format!("{:.4}/{:.4}/{:.4}", c[0], c[1], c[2]);
    let paper = &settings.paper;
    let triples = searches.ics.best_of_three().len();
    let eighth = Row::new(
        "8",
        "Best of three runs: correlation of measured and predicted torque, median over triples",
        "ICS at least 0.990/0.9950/0.995; CS at least the paper's; separable least squares at least the paper's ICS",
        json!({ "ics": of_ics, "cs": of_cs, "pso": of_pso, "separable": separable, "triples": triples }),
        format!(
            "ICS {}, CS {}, separable {}; {triples} triples",
            three(&of_ics),
            three(&of_cs),
            three(&separable)
        ),
        at_least(&of_ics, &[0.990, 0.9950, 0.995])
            && at_least(&of_cs, &paper.correlation_cs)
            && at_least(&separable, &paper.correlation_ics)
            && triples >= 10,
    );
    [seventh, eighth]
}
