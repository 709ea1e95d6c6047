//! Rows 6, a and b: the mechanism with clearance, simulated.

use dynid::motion::trajectory::FourierTrajectory;
use dynid::sim::clearance::{
    ClearanceRecord, ClearanceSettings, ClearanceStart, ContactEventKind, Driving, Method, simulate,
};
use rayon::prelude::*;
use serde_json::json;

use super::bearing::Bearing;
use super::data::{Data, rms};
use super::settings::Settings;
use super::trajectory::trajectory;
use super::{JOINTS, fault, reference};
use crate::{Row, RunSettings, StudyError};

/// Local error of the study's simulations, in units of the clearance.
pub(super) const TOLERANCE: f64 = 1e-10;
/// Tolerance of the reference.
const TIGHT: f64 = 1e-12;
/// Change of torque by finer steps that is asked for, N m rms.
const REQUIRED: f64 = 1e-5;
/// Explicit steps that are tried, s.
const STEPS: [f64; 4] = [7e-5, 5e-5, 3e-5, 2e-5];

pub(super) fn collocation(tolerance: f64, longest_step: f64) -> Method {
    Method::Collocation { tolerance, longest_step }
}

/// Moves the mechanism with centred journals at first.
pub(super) fn along(
    bearing: &Bearing,
    trajectory: &FourierTrajectory,
    times: &[f64],
    method: Method,
) -> Result<ClearanceRecord, StudyError> {
    let series = trajectory.series();
    let motion = |t: f64, q: &mut [f64], dq: &mut [f64], ddq: &mut [f64]| {
        for (joint, series) in series.iter().enumerate() {
            let at = series.at(t);
            (q[joint], dq[joint], ddq[joint]) = (at.position, at.velocity, at.acceleration);
        }
    };
    let settings = ClearanceSettings { method, channels: Vec::new() };
    let start = ClearanceStart::default();
    simulate(bearing.plant()?, &start, Driving::Prescribed(&motion), times, &settings).map_err(fault)
}

/// A trajectory at the rate of the data for as long as a period of the paper's.
pub(super) fn recorded(
    settings: &Settings,
    bearing: &Bearing,
    rows: &[Vec<f64>],
    base_frequency: f64,
) -> Result<ClearanceRecord, StudyError> {
    let samples = settings.data.samples;
    let span = std::f64::consts::TAU / settings.base_frequency;
    let times: Vec<f64> = (0..=samples).map(|k| span * k as f64 / samples as f64).collect();
    let method = collocation(TOLERANCE, f64::INFINITY);
    along(bearing, &trajectory(base_frequency, rows)?, &times, method)
}

/// A period of the paper's trajectory.
pub(super) fn published(settings: &Settings, bearing: &Bearing) -> Result<ClearanceRecord, StudyError> {
    recorded(settings, bearing, &settings.trajectory, settings.base_frequency)
}

/// A short span, finely sampled at its end.
#[derive(Debug)]
pub(super) struct Closeup {
    pub(super) record: ClearanceRecord,
    /// Samples of the span.
    pub(super) samples: usize,
}

impl Closeup {
    /// From start to end, s.
    pub(super) fn new(settings: &Settings, [from, to]: [f64; 2]) -> Result<Self, StudyError> {
        const SAMPLES: usize = 800;
        let fine = (0..SAMPLES).map(|k| from + (to - from) * k as f64 / (SAMPLES - 1) as f64);
        let times: Vec<f64> = std::iter::once(0.0).filter(|_| from > 0.0).chain(fine).collect();
        let trajectory = trajectory(settings.base_frequency, &settings.trajectory)?;
        let method = collocation(TOLERANCE, f64::INFINITY);
        Ok(Closeup { record: along(&settings.bearing, &trajectory, &times, method)?, samples: SAMPLES })
    }
}

/// RMS over time of differences of torques, the largest of both joints, N m.
fn difference(settings: &Settings, a: &ClearanceRecord, b: &ClearanceRecord) -> f64 {
    let of = |joint: usize| {
        let counted = a.time.iter().zip(a.effort.iter().zip(&b.effort));
        let differences =
            counted.filter(|(t, _)| **t > settings.data.discarded).map(|(_, (a, b))| a[joint] - b[joint]);
        rms(differences)
    };
    (0..JOINTS).map(of).fold(0.0, f64::max)
}

/// A period solved in several ways.
#[derive(Debug)]
pub(super) struct Solutions {
    /// Torques with [`TOLERANCE`] against [`TIGHT`], and against half its longest step, N m.
    pub(super) tolerance: f64,
    pub(super) halved: f64,
    /// Explicit solutions: step, evaluations and difference from the reference; `None` where it broke down.
    pub(super) explicit: Vec<(f64, Option<(usize, f64)>)>,
    /// Span of the comparison, s.
    pub(super) span: f64,
    /// Evaluations and difference of collocation over that span.
    pub(super) collocation: (usize, f64),
}

impl Solutions {
    pub(super) fn new(settings: &Settings, run: &RunSettings) -> Result<Self, StudyError> {
        let trajectory = trajectory(settings.base_frequency, &settings.trajectory)?;
        let whole = trajectory.period();
        let span = if run.quick { whole / 8.0 } else { whole };
        let solve = |span: f64, method: Method| {
            let samples = (settings.data.samples as f64 * span / whole).round() as usize;
            let times: Vec<f64> = (0..=samples).map(|k| span * k as f64 / samples as f64).collect();
            along(&settings.bearing, &trajectory, &times, method)
        };
        let own = solve(whole, collocation(TOLERANCE, f64::INFINITY))?;
        let halved = 0.5 * whole / own.count.steps as f64;
        let methods = [
            (whole, collocation(TIGHT, f64::INFINITY)),
            (whole, collocation(TOLERANCE, halved)),
            (span, collocation(TOLERANCE, f64::INFINITY)),
            (span, collocation(TIGHT, f64::INFINITY)),
        ];
        let found: Vec<ClearanceRecord> =
            methods.into_par_iter().map(|(span, method)| solve(span, method)).collect::<Result<_, _>>()?;
        let reference = &found[3];
        let explicit = STEPS
            .into_par_iter()
            .map(|step| {
                let solved = solve(span, Method::RungeKutta4 { step }).ok();
                (step, solved.map(|r| (r.count.evaluations, difference(settings, &r, reference))))
            })
            .collect();
        Ok(Solutions {
            tolerance: difference(settings, &own, &found[0]),
            halved: difference(settings, &own, &found[1]),
            explicit,
            span,
            collocation: (found[2].count.evaluations, difference(settings, &found[2], reference)),
        })
    }

    /// The largest explicit step whose torques are as near the reference as is asked for.
    pub(super) fn as_good(&self) -> Option<(f64, usize, f64)> {
        let good = |(step, found): &(f64, Option<(usize, f64)>)| {
            found.filter(|(_, d)| *d <= REQUIRED).map(|(count, d)| (*step, count, d))
        };
        self.explicit.iter().find_map(good)
    }
}

fn relative(own: f64, wanted: f64) -> f64 {
    (own / wanted - 1.0).abs()
}

/// Row 6.
pub(super) fn row(settings: &Settings, data: &Data, solutions: &Solutions) -> Result<Row, StudyError> {
    let reference = reference::simulation()?;
    let (at, whole) = (&reference.at_0_5s, &reference.full_period);
    let trajectory = trajectory(settings.base_frequency, &settings.trajectory)?;
    let start = along(&settings.bearing, &trajectory, &[0.0, 0.5], collocation(TOLERANCE, f64::INFINITY))?;
    let [mut instant, mut share, mut depth, mut period] = [0.0_f64, 1.0, 0.0, 0.0];
    let record = &data.record;
    let ringing: [f64; JOINTS] = std::array::from_fn(|joint| rms(data.ringing(joint)));
    for joint in 0..JOINTS {
        let (early, journal) = (&start.journals[joint], &record.journals[joint]);
        for k in 0..2 {
            instant = instant.max(relative(early.offset[1][k], at.e[2 * joint + k]));
        }
        instant = instant.max(relative(early.normal_force[1], at.force[joint]));
        instant = instant.max(relative(early.penetration[1], at.penetration[joint]));
        share = share.min(journal.contact_share);
        depth = depth.max(journal.largest_penetration / settings.bearing.clearance);
        let force = data.counted(&journal.normal_force);
        let least = force.iter().copied().fold(f64::INFINITY, f64::min);
        let largest = force.iter().copied().fold(0.0, f64::max);
        for (own, wanted) in [
            (rms(data.ideal_torque(joint)), whole.rms_ideal_torque[joint]),
            (rms(data.friction[joint].iter().copied()), whole.rms_friction_torque[joint]),
            (least, whole.least_force[joint]),
            (largest, whole.largest_force[joint]),
            (journal.largest_penetration, whole.max_penetration_incl_impact[joint]),
        ] {
            period = period.max(relative(own, wanted));
        }
    }
    let impacts = record.events.iter().filter(|e| matches!(e.kind, ContactEventKind::Onset(_))).count();
    let halving = solutions.tolerance.max(solutions.halved);
    Ok(Row::new(
        "6",
        "The mechanism with clearance, simulated: offsets, normal forces and penetrations at 0.5 s as an independent simulation has \
         them, torques, friction, forces and impacts of the whole period too; finer steps do not change the torque",
        "2e-3 relative at 0.5 s, 5 % over the period, 2 impacts; contact above 99 % of the time, penetration below 0.2 of the \
         clearance, change of torque below 1e-5 N m rms",
        json!({
            "at_0.5s": instant,
            "period": period,
            "impacts": impacts,
            "contact_share": share,
            "penetration_over_clearance": depth,
            "change_with_tolerance": solutions.tolerance,
            "change_with_half_steps": solutions.halved,
            "ringing_rms": ringing,
            "ringing_rms_reference": whole.rms_clearance_minus_ideal_no_friction,
            "swing_hz": record.swing_hz,
        }),
        format!(
            "{instant:.1e} at 0.5 s, {:.2} % over the period, {impacts} impacts; contact {:.3} %, penetration {depth:.3} of the \
             clearance; torque changes by {:.1e} N m with a tighter tolerance, {:.1e} with half the steps; ringing {:.4} and \
             {:.5} N m rms (reference {:.4} and {:.5})",
            100.0 * period,
            100.0 * share,
            solutions.tolerance,
            solutions.halved,
            ringing[0],
            ringing[1],
            whole.rms_clearance_minus_ideal_no_friction[0],
            whole.rms_clearance_minus_ideal_no_friction[1],
        ),
        instant <= at.tolerance_rel
            && period <= whole.tolerance_rel
            && impacts == whole.impacts
            && share > 0.99
            && depth < 0.2
            && halving < REQUIRED,
    ))
}

/// Rows a and b.
pub(super) fn cost_rows(data: &Data, solutions: &Solutions) -> [Row; 2] {
    let (evaluations, error) = solutions.collocation;
    let as_good = solutions.as_good();
    let factor = as_good.map_or(f64::NAN, |(_, count, _)| count as f64 / evaluations as f64);
    let tried: Vec<_> = solutions
        .explicit
        .iter()
        .map(|(step, found)| {
            json!({ "step": step, "evaluations": found.map(|f| f.0), "difference": found.map(|f| f.1) })
        })
        .collect();
    let cost = Row::new(
        "a",
        "Implicit steps between located instants of contact and sliding need far fewer evaluations than the largest explicit steps \
         whose torques are within 1e-5 N m rms",
        "at least 5 times fewer than the classical Runge-Kutta method, torques within 1e-5 N m too",
        json!({ "collocation": evaluations, "difference": error, "span": solutions.span, "factor": factor,
                "explicit": tried }),
        match as_good {
            Some((step, count, other)) => format!(
                "{evaluations} evaluations over {:.1} s for {error:.1e} N m rms, explicit {count} with steps of {step:.0e} s for \
                 {other:.1e} N m: {factor:.1} times",
                solutions.span
            ),
            None => {
                format!("{evaluations} evaluations for {error:.1e} N m; no explicit step tried is as good")
            }
        },
        factor >= 5.0 && error <= REQUIRED,
    );
    let energy = &data.record.energy;
    let relative = energy.relative_error().unwrap_or(f64::INFINITY);
    let audit = Row::new(
        "b",
        "The energy of the period balances: work of the drives, gain of bodies and contacts, losses by damping and friction",
        "1e-5 of what was exchanged",
        json!({
            "relative": relative,
            "drives": energy.drives,
            "bodies": energy.bodies,
            "contacts": energy.contacts,
            "damping": energy.damping,
            "friction": energy.friction,
        }),
        format!(
            "{:.1e}: drives {:.4e} J, bodies {:.2e}, contacts {:.2e}, damping {:.2e}, friction {:.4e}",
            relative, energy.drives, energy.bodies, energy.contacts, energy.damping, energy.friction,
        ),
        relative <= 1e-5,
    );
    [cost, audit]
}
