//! Who takes part.

use dynid_model::EffortModel;

use crate::pipeline::Problem;
use crate::settings::{Consistency, Friction, Method, Route, Settings};

/// Evaluations of a search within a comparison.
const EVALUATIONS: u64 = 150;

/// An estimator, as the settings that make a run use it.
#[derive(Debug, Clone)]
pub(super) struct Contestant {
    pub(super) name: &'static str,
    pub(super) what: &'static str,
    pub(super) settings: Settings,
}

/// Estimators that apply: total least squares where errors of columns are stated, instruments where the closed loop is,
/// searches where friction is not given.
pub(super) fn contestants(asked: &Settings, problem: &Problem) -> Vec<Contestant> {
    let free = problem.model.parameters().shape.is_empty();
    let auto = asked.elements.friction == Friction::Auto;
    let with = |name, what, change: &dyn Fn(&mut Settings)| {
        let mut own = asked.clone();
        own.conditioning.route = Route::Compact;
        own.elements.friction = if auto { Friction::Given } else { own.elements.friction };
        own.estimator.consistency = Consistency::None;
        own.estimator.shape.search = None;
        change(&mut own);
        Contestant { name, what, settings: own }
    };
    let method = |method: Method| move |c: &mut Settings| c.estimator.method = method;
    let mut out = vec![
        with(
            "textbook",
            "10 Hz Butterworth, central differences, decimation, ordinary least squares",
            &|c| {
                c.conditioning.route = Route::Textbook;
                c.estimator.method = Method::Ols;
            },
        ),
        with("ols", "ordinary least squares", &method(Method::Ols)),
        with("wls", "least squares weighted by joint, log and kernel", &method(Method::Wls)),
        with("huber", "Huber's loss", &method(Method::Huber)),
        with("tukey", "Tukey's biweight", &method(Method::Tukey)),
        with("ridge", "weighted, with the robot file as a Gaussian prior", &method(Method::Ridge)),
        with("consistent", "weighted, bodies that can exist", &|c| {
            c.estimator.method = Method::Wls;
            c.estimator.consistency = Consistency::PseudoInertia;
        }),
    ];
    if !asked.estimator.column_noise.is_empty() {
        out.push(with("tls", "total least squares with the stated errors", &method(Method::Tls)));
    }
    if asked.closed_loop.is_some() {
        out.push(with("iv", "instruments simulated in closed loop", &method(Method::Iv)));
        out.push(with(
            "didim",
            "efforts on the regressor of simulations in closed loop",
            &method(Method::Didim),
        ));
        out.push(with("cloe", "positions along simulations in closed loop", &method(Method::Cloe)));
    }
    if auto || !free {
        let shapes = |c: &mut Settings| {
            c.elements.friction = asked.elements.friction;
            c.estimator.method = Method::Wls;
        };
        out.push(with("separable", "friction shapes by variable projection, weighted", &shapes));
        out.push(with("separable, consistent", "the same, bodies that can exist: the default", &|c| {
            shapes(c);
            c.estimator.consistency = Consistency::PseudoInertia;
        }));
        out.push(with("search: cma-es", "friction shapes by covariance matrix adaptation", &|c| {
            shapes(c);
            c.estimator.shape.search = Some("cma-es".to_owned());
            c.estimator.shape.evaluations = Some(EVALUATIONS);
        }));
        out.push(with("search: de", "friction shapes by differential evolution", &|c| {
            shapes(c);
            c.estimator.shape.search = Some("de".to_owned());
            c.estimator.shape.evaluations = Some(EVALUATIONS);
        }));
    }
    out
}
