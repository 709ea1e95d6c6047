//! Nonlinear friction, as the report shows it.

use dynid_model::EffortModel;
use dynid_report as report;

use super::Shown;
use crate::estimate::{Estimate, FrictionPassivity, PassivityRecord};
use crate::passivity;

/// Velocities drawn on each side of rest.
const POINTS: usize = 200;

impl Shown<'_> {
    /// Friction over velocity of joints that have a law with shape parameters, or whose friction is known.
    pub(super) fn friction_laws(&self, estimate: &Estimate) -> Vec<report::Chart> {
        let outputs = estimate.joints.iter().enumerate();
        outputs
            .filter_map(|(rate, joint)| {
                let record = estimate.friction_passivity.iter().find(|r| r.joint == *joint)?;
                let known = self.plan.known_friction(joint).is_some();
                let shaped = self.plan.per_rate[self.model.tree_rate(rate)]
                    .iter()
                    .any(|name| self.plan.registry().is_shaped(name));
                (known || shaped).then(|| self.law(record, rate))
            })
            .collect()
    }

    fn law(&self, record: &PassivityRecord, rate: usize) -> report::Chart {
        let (model, linear) = self.robot_alone();
        let shape = model.parameters().shape_start();
        let (low, high) = record.velocity_range;
        // Denser towards rest, where laws bend.
        let side = |k: usize| (k as f64 / POINTS as f64).powi(3);
        let backward = (1..=POINTS).rev().map(|k| low * side(k));
        let mut velocities: Vec<f64> =
            backward.chain(std::iter::once(0.0)).chain((1..=POINTS).map(|k| high * side(k))).collect();
        velocities.dedup();
        // The coldest state logged, where channels make a difference.
        let held = self.held_channels().swap_remove(0);
        let efforts = model.friction_effort(rate, &shape, linear, &velocities, &held);
        let points: Vec<[f64; 2]> = velocities.into_iter().zip(efforts).map(|(v, e)| [v, e]).collect();
        let mut curves = vec![report::ChartCurve {
            name: "identified law".to_owned(),
            points: points.clone(),
            style: report::CurveStyle::Line,
        }];
        if record.passivity != FrictionPassivity::Passive {
            let drives = |[v, e]: [f64; 2]| [v, if v * e < 0.0 { e } else { f64::NAN }];
            curves.push(report::ChartCurve {
                name: "drives the motion".to_owned(),
                points: points.into_iter().map(drives).collect(),
                style: report::CurveStyle::Line,
            });
        }
        let unit = self.speed_unit(&record.joint);
        let axis = |label: &str, unit: &str| report::ChartAxis {
            label: label.to_owned(),
            unit: unit.to_owned(),
            logarithmic: false,
        };
        let known = self.plan.known_friction(&record.joint).map(|law| law.in_words());
        let own = self.plan.per_rate[self.model.tree_rate(rate)]
            .iter()
            .map(String::as_str)
            .filter(|name| self.plan.registry().is_friction(name));
        let laws: Vec<String> = match known {
            Some(law) => {
                let errors: Vec<&str> = own.collect();
                let errors = (!errors.is_empty()).then(|| format!("errors ({})", errors.join(", ")));
                std::iter::once(format!("known {law}")).chain(errors).collect()
            }
            None => own.map(str::to_owned).collect(),
        };
        report::Chart {
            title: format!("{}: {}", record.joint, laws.join(" + ")),
            note: passivity::sentence(record, unit),
            x: axis("velocity", unit),
            y: axis("friction", if unit == "m/s" { "N" } else { "N m" }),
            equal_units: false,
            curves,
        }
    }

    pub(super) fn friction_trials(&self, estimate: &Estimate) -> Vec<report::FrictionTrial> {
        estimate
            .conditioning
            .friction_trials
            .iter()
            .map(|t| report::FrictionTrial {
                joint: t.joint.clone(),
                element: t.element.clone(),
                value: t.value,
                unit: t.unit.clone(),
                gain_percent: Some(100.0 * t.gain),
                standard_error_percent: Some(100.0 * t.standard_error),
                accepted: t.accepted,
            })
            .collect()
    }
}

pub(super) fn shape_parameters(estimate: &Estimate) -> Vec<report::ShapeParameter> {
    estimate
        .shape_parameters
        .iter()
        .map(|p| report::ShapeParameter {
            name: p.name.clone(),
            unit: p.unit.clone(),
            value: Some(p.value),
            std: p.std,
            interval: p.interval.map(|(low, high)| [low, high]),
            range: Some([p.range.0, p.range.1]),
            verdict: p.verdict,
            reason: p.reason.clone().unwrap_or_default(),
        })
        .collect()
}
