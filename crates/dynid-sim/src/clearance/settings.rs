//! What a simulation of a mechanism with clearance is told.

use dynid_model::EffortModel;

use crate::error::{SimError, demand, demand_length};
use crate::plant::Plant;

/// How the equations are solved.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Method {
    /// Radau IIA of order nine with steps for a tolerance: largest local error in units of the clearances.
    Collocation {
        /// 1e-13 to 1e-3. Default: 1e-10.
        tolerance: f64,
        /// Longest step, s. Default: none.
        longest_step: f64,
    },
    /// Collocation with equal steps, to see its order.
    CollocationSteps {
        /// Step between located instants, s.
        step: f64,
    },
    /// The classical explicit method of order four with equal steps; nothing is located.
    RungeKutta4 {
        /// s.
        step: f64,
    },
}

impl Default for Method {
    fn default() -> Self {
        Method::Collocation { tolerance: 1e-10, longest_step: f64::INFINITY }
    }
}

/// Settings of a simulation.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ClearanceSettings {
    /// How the equations are solved.
    pub method: Method,
    /// Values of the channels that elements read, in the order of the model's; held.
    pub channels: Vec<f64>,
}

/// Offset of a journal's centre, m, and its rate, m/s, in axes that turn with its link.
pub type Offset = ([f64; 2], [f64; 2]);

/// A state to start from.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ClearanceStart {
    /// Per joint with clearance, in the order of the model's contacts: offset of the journal's centre (m) and its rate (m/s)
    /// in axes that turn with its link. Default: all centred and at rest there.
    pub journals: Vec<Offset>,
    /// Positions and rates of the driven joints, unless they are prescribed.
    pub driven: Option<(Vec<f64>, Vec<f64>)>,
}

/// Writes positions, rates and accelerations of the driven joints at a time (s) into three slices.
pub type PrescribedMotion<'a> = &'a dyn Fn(f64, &mut [f64], &mut [f64], &mut [f64]);

/// From time (s), positions and rates of the driven joints to their efforts.
pub type Controller<'a> = &'a mut dyn FnMut(f64, &[f64], &[f64], &mut [f64]);

/// What drives the driven joints, in the order of their rates.
pub enum Driving<'a> {
    /// Joints follow a motion exactly.
    Prescribed(PrescribedMotion<'a>),
    /// Efforts are formed every `period` from the start on, and held.
    Controlled {
        /// s.
        period: f64,
        /// Forms efforts.
        controller: Controller<'a>,
    },
}

/// Refuses what cannot be simulated. `driving`: `None` where efforts are held until others are given.
pub(super) fn check(
    plant: &Plant,
    start: &ClearanceStart,
    driving: Option<&Driving<'_>>,
    times: &[f64],
    settings: &ClearanceSettings,
) -> Result<(), SimError> {
    let model = plant.model();
    let contacts = model.clearances().count();
    demand(contacts > 0, "clearance", "a joint with clearance", "none")?;
    demand_length("channels", model.channels().len(), settings.channels.len())?;
    if !start.journals.is_empty() {
        demand_length("journals", contacts, start.journals.len())?;
    }
    let numbers = start.journals.iter().flat_map(|(e, de)| e.iter().chain(de));
    let finite = numbers.clone().all(|x| x.is_finite());
    demand(finite, "journals", "finite offsets and rates", "others")?;
    let ascending = times.windows(2).all(|w| w[0] < w[1]) && times.iter().all(|t| t.is_finite());
    demand(!times.is_empty() && ascending, "times", "ascending finite times, at least one", times.len())?;
    let positive = |x: f64| x > 0.0 && x.is_finite();
    match settings.method {
        Method::Collocation { tolerance, longest_step } => {
            demand((1e-13..=1e-3).contains(&tolerance), "tolerance", "1e-13 to 1e-3", tolerance)?;
            demand(longest_step > 0.0, "longest_step", "a positive time", longest_step)?;
        }
        Method::CollocationSteps { step } | Method::RungeKutta4 { step } => {
            demand(positive(step), "step", "a positive time", step)?;
        }
    }
    let driven = (0..plant.joints()).filter(|rate| !model.is_undriven(*rate)).count();
    match driving {
        Some(Driving::Prescribed(_)) => return Ok(()),
        Some(Driving::Controlled { period, .. }) => {
            demand(positive(*period), "period", "a positive time", *period)?;
        }
        None => {}
    }
    let (q, dq) = start.driven.as_ref().map_or((0, 0), |(q, dq)| (q.len(), dq.len()));
    demand_length("positions of the driven joints", driven, q)?;
    demand_length("rates of the driven joints", driven, dq)
}
