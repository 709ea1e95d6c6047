//! Designs of the acceptance table: reached, within all limits.

mod support;

use dynid_excitation::criterion::{Criterion, Measure};
use dynid_excitation::*;
use support::*;

fn indy7(rest: bool) -> Option<Problem> {
    let data = reference("robots/indy7.json")?;
    let mechanism = mechanism(&data);
    let excitation = excitation(model(&mechanism, 2..6, true));
    Some(Problem {
        coordinates: mechanism.rate_names(),
        limits: limits(&data),
        constraints: Vec::new(),
        base: 0.1 * std::f64::consts::PI,
        harmonics: 5,
        start: StartConditions { rest, ..Default::default() },
        criterion: Criterion::raw(Measure::Condition),
        output_weights: vec![1.0; 6],
        effective_samples: 1000.0,
        prior: None,
        sign_width: DEFAULT_SIGN_WIDTH,
        samples: 100,
        model: Box::new(excitation),
    })
}

#[test]
fn indy7_from_every_seed() {
    let Some(problem) = indy7(false) else { return };
    println!("{} columns", problem.model.columns().len());
    let settings = Settings { starts: 10, ..Settings::default() };
    let begun = std::time::Instant::now();
    let outcome = design(&problem, &settings, Vec::new(), &mut |s| {
        println!(
            "seed {} cond {:.2} excess {:.1e} ev {} share {} at {:.2} s",
            s.seed,
            s.criterion.unwrap_or(f64::NAN).exp(),
            s.excess,
            s.evaluations,
            s.share,
            begun.elapsed().as_secs_f64()
        );
    })
    .unwrap();
    let Outcome::Found(found) = outcome else { panic!("{outcome:?}") };
    assert_eq!(found.starts.len(), 10);
}
