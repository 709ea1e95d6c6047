//! The report page of friction experiments.

use dynid_config::pages::settings_table;
use dynid_friction::steady_friction::{SteadyFriction, ThermalLine};
use dynid_report as report;
use dynid_report::{Chart, ChartAxis, ChartCurve, CurveStyle, Fact, StudyTable, Value};

use super::{FrictionIdentification, IdentifiedJoint, PreslidingFit};
use crate::Error;
use crate::friction_model::{FrictionModel, FrictionStatus, JointFrictionModel};
use crate::known_friction::ViscousModel;

/// Points along a drawn curve.
const CURVE: usize = 120;
/// Grid of the surface: speeds, temperatures.
const GRID: [usize; 2] = [72, 40];
/// Speeds that span more than this are drawn on a logarithmic axis.
const WIDE: f64 = 20.0;

impl FrictionIdentification {
    /// The report as one HTML page.
    ///
    /// # Errors
    /// [`PageError`](crate::fault::PageError).
    pub fn report(&self, model: &FrictionModel) -> Result<String, Error> {
        let p = &model.provenance;
        crate::fault::page(report::render_joints(&report::JointsReport {
            kind: "Friction experiments".to_owned(),
            title: format!("Friction of {}", model.robot),
            verdict: report::Verdict {
                status: model.verdict.status.into(),
                headline: model.verdict.headline.clone(),
                ..report::Verdict::default()
            },
            warnings: model
                .warnings
                .iter()
                .map(|w| report::Warning { message: w.clone(), hint: String::new() })
                .collect(),
            robot: report::Robot {
                name: model.robot.clone(),
                file: Some(self.robot.path.display().to_string()),
                ..report::Robot::default()
            },
            introduction: introduction(),
            counted: None,
            overview: None,
            joints: self.joints.iter().zip(&model.joints).map(|(j, record)| self.test(j, record)).collect(),
            provenance: report::Provenance {
                version: p.version.clone(),
                inputs: p
                    .inputs
                    .iter()
                    .map(|i| report::InputFile {
                        path: i.path.clone(),
                        kind: i.kind.word().to_owned(),
                        sha256: Some(i.sha256.clone()),
                    })
                    .collect(),
                seed: None,
                settings: settings_table(&p.settings, &super::record::default_settings()),
            },
        }))
    }

    fn test(&self, joint: &IdentifiedJoint, record: &JointFrictionModel) -> report::JointSection {
        let units = self.units(&record.joint);
        let mut charts = Vec::new();
        if let Ok(found) = &joint.law {
            charts.extend(found.lines.iter().map(|line| line_chart(line, found, record, &units)));
        }
        charts.extend(joint.presliding.iter().filter(|p| !p.curves.is_empty()).map(|p| motion(p, &units)));
        report::JointSection {
            name: record.joint.clone(),
            status: match record.status {
                FrictionStatus::Identified => report::Status::Ok,
                FrictionStatus::Simplified => report::Status::Warn,
                FrictionStatus::Invalid | FrictionStatus::OneDirection | FrictionStatus::NotIdentified => {
                    report::Status::Fail
                }
            },
            state: match record.status {
                FrictionStatus::Identified => "identified",
                FrictionStatus::Simplified => "identified, simplified",
                FrictionStatus::Invalid => "not to be used",
                FrictionStatus::OneDirection => "one direction only",
                FrictionStatus::NotIdentified => "not identified",
            }
            .to_owned(),
            facts: facts(record, &units),
            notes: record.notes.clone(),
            tables: tables(record, &units),
            curves: curves(joint, record, &units),
            surface: surface(joint, record, &units),
            charts,
        }
    }

    fn units(&self, joint: &str) -> Units {
        let mechanism = &self.robot.mechanism;
        let at = mechanism.rate_names().iter().position(|n| n == joint);
        let effort = at.and_then(|k| mechanism.effort_units().get(k).copied()).unwrap_or("N m");
        match effort {
            "N" => Units { effort: "N", speed: "m/s", position: "m", per_speed: "s/m", stiffness: "N/m" },
            _ => Units {
                effort: "N m",
                speed: "rad/s",
                position: "rad",
                per_speed: "s/rad",
                stiffness: "N m/rad",
            },
        }
    }
}

struct Units {
    effort: &'static str,
    speed: &'static str,
    position: &'static str,
    per_speed: &'static str,
    stiffness: &'static str,
}

fn introduction() -> Vec<String> {
    vec![
        "Friction is half the difference of the efforts forth and back at equal speed and position; gravity and offset cancel."
            .to_owned(),
        "Law: `s(v) (F_c + (F_s - F_c) exp(-(v/v_s)²) + σ2 (1 - exp(-|σ3 v|^σ4)))`, each `σ` a line of the temperature. `σ3` and \
         `σ4` stand in for each other: judge the curve, not the coefficients."
            .to_owned(),
    ]
}

fn facts(record: &JointFrictionModel, units: &Units) -> Vec<Fact> {
    let range = |r: Option<[f64; 2]>, digits: usize| {
        r.map_or(Value::Undefined, |[a, b]| Value::Text(format!("{a:.digits$} to {b:.digits$}")))
    };
    let mut facts = vec![
        Fact::new("points", record.points.len(), ""),
        Fact::new("speeds", range(record.speed_range, 3), units.speed),
        Fact::new("valid temperatures", range(record.temperature_range, 1), "degC"),
        Fact::new("residual, RMS", record.residual_rms, units.effort),
        Fact::new(
            "largest residual, share of the largest friction",
            record.largest_error.map(|e| 100.0 * e),
            "%",
        ),
    ];
    if record.samples > 0 {
        facts[0] = Fact::new("samples of friction signals", record.samples, "");
    }
    if let Some((chi, freedom)) = record.chi_squared.filter(|_| record.samples == 0) {
        facts.push(Fact::new("χ² over degrees of freedom", format!("{chi:.1} / {freedom}"), ""));
    }
    facts
}

fn tables(record: &JointFrictionModel, units: &Units) -> Vec<StudyTable> {
    let mut out = Vec::new();
    let mut rows: Vec<Vec<Value>> = Vec::new();
    let mut add = |name: &str, key: &str, value: Option<f64>, unit: &str| {
        if let Some(value) = value {
            let std = record.std.get(key).copied();
            rows.push(vec![name.into(), value.into(), std.into(), unit.into()]);
        }
    };
    add("Coulomb friction F_c", "coulomb", record.coulomb, units.effort);
    add("static friction F_s", "static", record.static_, units.effort);
    add("Stribeck speed v_s", "stribeck_speed", record.stribeck_speed, units.speed);
    match record.viscous {
        Some(ViscousModel::Linear { coefficient }) => {
            add(
                "viscous coefficient",
                "coefficient",
                Some(coefficient),
                &format!("{}·{}", units.effort, units.per_speed),
            );
        }
        Some(ViscousModel::Exponential(v)) => {
            let at = format!("at {} degC", v.reference_temperature);
            let per_kelvin = |unit: &str| format!("{unit}/K");
            add(&format!("σ2 {at}"), "sigma2", Some(v.sigma2), units.effort);
            add("σ2, slope", "sigma2_slope", Some(v.sigma2_slope), &per_kelvin(units.effort));
            add(&format!("σ3 {at}"), "sigma3", Some(v.sigma3), units.per_speed);
            add("σ3, slope", "sigma3_slope", Some(v.sigma3_slope), &per_kelvin(units.per_speed));
            add(&format!("σ4 {at}"), "sigma4", Some(v.sigma4), "");
            add("σ4, slope", "sigma4_slope", Some(v.sigma4_slope), "1/K");
        }
        None => {}
    }
    add("offset", "offset", record.offset, units.effort);
    let bristle = record.bristle;
    let origin = if bristle.is_some_and(|b| b.prior) { " (prior)" } else { "" };
    add(&format!("bristle stiffness σ0{origin}"), "sigma0", bristle.map(|b| b.sigma0), units.stiffness);
    add(
        &format!("bristle damping σ1{origin}"),
        "sigma1",
        bristle.map(|b| b.sigma1),
        &format!("{}·s", units.stiffness),
    );
    let table = |caption: &str, head: &[&str], rows: Vec<Vec<Value>>| StudyTable {
        caption: caption.to_owned(),
        head: head.iter().map(|h| (*h).to_owned()).collect(),
        rows,
    };
    if !rows.is_empty() {
        out.push(table("Coefficients", &["coefficient", "value", "std", "unit"], rows));
    }
    if !record.levels.is_empty() {
        let rows = record
            .levels
            .iter()
            .map(|l| {
                let std = |s: &str| Value::from(l.std.get(s).copied());
                vec![
                    l.temperature.into(),
                    l.points.into(),
                    l.sigma2.into(),
                    std("sigma2"),
                    l.sigma3.into(),
                    std("sigma3"),
                    l.sigma4.into(),
                    std("sigma4"),
                    l.alone_rms.into(),
                ]
            })
            .collect();
        let head =
            ["temperature, degC", "points", "σ2", "std", "σ3", "std", "σ4", "std", "RMS of a law of its own"];
        out.push(table(
            "By temperature (Coulomb, static friction and Stribeck speed in common)",
            &head,
            rows,
        ));
    }
    if !record.laws.is_empty() {
        let rows = record
            .laws
            .iter()
            .map(|l| {
                let verdict = match (&l.refused, l.chosen) {
                    (_, true) => "taken",
                    (Some(reason), _) => reason,
                    (None, false) => "",
                };
                vec![l.law.as_str().into(), l.rms.into(), l.aicc.into(), verdict.into()]
            })
            .collect();
        out.push(table("Laws that were tried", &["law", "RMS", "AICc", ""], rows));
    }
    if !record.unpaired.is_empty() {
        let rows = record
            .unpaired
            .iter()
            .map(|u| {
                vec![
                    u.log.as_str().into(),
                    u.speed.into(),
                    u.temperature.into(),
                    u.effort.into(),
                    u.spread.into(),
                    u.reason.as_str().into(),
                ]
            })
            .collect();
        let head =
            ["log", "speed", "temperature, degC", "effort, mean", "effort, std", "why it went into no point"];
        out.push(table("Passes without a partner", &head, rows));
    }
    out
}

fn speed_axis(record: &JointFrictionModel, units: &Units) -> ChartAxis {
    let wide = record.speed_range.is_some_and(|[a, b]| a > 0.0 && b / a > WIDE) && record.samples == 0;
    ChartAxis { label: "speed".to_owned(), unit: units.speed.to_owned(), logarithmic: wide }
}

fn effort_axis(units: &Units) -> ChartAxis {
    ChartAxis { label: "friction".to_owned(), unit: units.effort.to_owned(), logarithmic: false }
}

/// Speeds along a curve.
fn speeds(record: &JointFrictionModel, count: usize) -> Vec<f64> {
    let [low, high] = record.speed_range.unwrap_or([0.0, 1.0]);
    let share = |k: usize| k as f64 / (count - 1) as f64;
    if record.samples == 0 && low > 0.0 && high / low > WIDE {
        return (0..count).map(|k| low * (high / low).powf(share(k))).collect();
    }
    // From just above rest: a sign is part of the law.
    (0..count).map(|k| (share(k) * high).max(1e-4 * high)).collect()
}

fn curves(
    joint: &IdentifiedJoint,
    record: &JointFrictionModel,
    units: &Units,
) -> Option<report::CurvesByTemperature> {
    let found = joint.law.as_ref().ok()?;
    let along = speeds(record, CURVE);
    let curve = |temperature: f64| {
        let friction = found.law.friction(&along, &vec![temperature; along.len()]);
        along.iter().zip(friction).map(|(v, f)| [*v, f]).collect::<Vec<[f64; 2]>>()
    };
    let points = joint.experiment.points();
    let place = |k: &usize| [points[*k].speed, points[*k].friction, points[*k].std];
    let levels = if found.levels.is_empty() {
        let warm: Vec<f64> = points.iter().filter_map(|p| p.temperature).collect();
        let mean = (!warm.is_empty()).then(|| warm.iter().sum::<f64>() / warm.len() as f64);
        // Samples of a signal are a cloud: some hundreds of them show it.
        let every = points.len().div_ceil(600);
        let shown: Vec<usize> = (0..points.len()).step_by(every).collect();
        let offset = found.law.value("fo").unwrap_or(0.0);
        let folded = |k: &usize| {
            let p = &points[*k];
            let sign = if p.speed < 0.0 { -1.0 } else { 1.0 };
            [sign * p.speed, sign * (p.friction - offset), if record.samples > 0 { 0.0 } else { p.std }]
        };
        let shifted = curve(mean.unwrap_or(found.law.reference_temperature));
        vec![report::TemperatureLevel {
            temperature: mean,
            curve: shifted.into_iter().map(|[v, f]| [v, f - offset]).collect(),
            points: shown.iter().map(folded).collect(),
        }]
    } else {
        found
            .levels
            .iter()
            .map(|level| report::TemperatureLevel {
                temperature: Some(level.temperature),
                curve: curve(level.temperature),
                points: level.points.iter().map(place).collect(),
            })
            .collect()
    };
    Some(report::CurvesByTemperature {
        title: "Friction over speed".to_owned(),
        note: if record.samples > 0 {
            "Dots: samples, both directions folded together, offset taken off; line: the law.".to_owned()
        } else {
            "Dots: measured, with standard errors; lines: the law at the mean temperature of each level."
                .to_owned()
        },
        x: speed_axis(record, units),
        y: effort_axis(units),
        levels,
    })
}

fn surface(joint: &IdentifiedJoint, record: &JointFrictionModel, units: &Units) -> Option<report::Surface> {
    let found = joint.law.as_ref().ok().filter(|f| f.law.form.thermal)?;
    let [cold, hot] = record.temperature_range?;
    let law =
        dynid_friction::steady_friction::FrictionLaw { temperature_range: (cold, hot), ..found.law.clone() };
    let xs = speeds(record, GRID[0]);
    let ys: Vec<f64> = (0..GRID[1]).map(|k| cold + (hot - cold) * k as f64 / (GRID[1] - 1) as f64).collect();
    let values = ys.iter().map(|t| law.friction(&xs, &vec![*t; xs.len()])).collect();
    Some(report::Surface {
        title: "Friction over speed and temperature".to_owned(),
        note: format!("Lines of equal friction in {}; dots: where it was measured.", units.effort),
        x: speed_axis(record, units),
        y: ChartAxis { label: "temperature".to_owned(), unit: "°C".to_owned(), logarithmic: false },
        value: effort_axis(units),
        values,
        points: joint
            .experiment
            .pairing
            .points
            .iter()
            .filter_map(|p| Some([p.speed, p.temperature?]))
            .collect(),
        xs,
        ys,
    })
}

fn line_chart(
    line: &ThermalLine,
    found: &SteadyFriction,
    record: &JointFrictionModel,
    units: &Units,
) -> Chart {
    let [cold, hot] = record.temperature_range.unwrap_or([0.0, 50.0]);
    let along: Vec<f64> = (0..=40).map(|k| cold + (hot - cold) * f64::from(k) / 40.0).collect();
    let edge = |sign: f64| along.iter().map(move |t| [*t, line.at(*t) + sign * line.half_width(*t)]);
    let gap = std::iter::once([f64::NAN, f64::NAN]);
    let global = |t: f64| {
        found
            .law
            .line(line.symbol)
            .map_or(f64::NAN, |(value, slope)| value + slope * (t - line.reference_temperature))
    };
    let curve = |name: &str, points: Vec<[f64; 2]>, style: CurveStyle| ChartCurve {
        name: name.to_owned(),
        points,
        style,
    };
    let (name, unit) = match line.symbol {
        "sigma2" => ("σ2", units.effort),
        "sigma3" => ("σ3", units.per_speed),
        _ => ("σ4", ""),
    };
    let dots =
        found.levels.iter().filter_map(|l| Some([l.temperature, l.common.as_ref()?.value(line.symbol)?]));
    Chart {
        title: format!("{name} over temperature"),
        note: format!(
            "Slope {:.5} ± {:.5} per K, {name} = {:.4} ± {:.4} at {} °C ({:.0} % intervals).",
            line.slope,
            line.slope_half_width(),
            line.value,
            line.half_width(line.reference_temperature),
            line.reference_temperature,
            100.0 * record.lines.get(line.symbol).map_or(0.95, |l| l.confidence)
        ),
        x: ChartAxis { label: "temperature".to_owned(), unit: "°C".to_owned(), logarithmic: false },
        y: ChartAxis { label: name.to_owned(), unit: unit.to_owned(), logarithmic: false },
        equal_units: false,
        curves: vec![
            curve(
                "line through the levels",
                along.iter().map(|t| [*t, line.at(*t)]).collect(),
                CurveStyle::Line,
            ),
            curve("its interval", edge(1.0).chain(gap).chain(edge(-1.0)).collect(), CurveStyle::Dashed),
            curve("global fit", along.iter().map(|t| [*t, global(*t)]).collect(), CurveStyle::Line),
            curve("levels, common fit", dots.collect(), CurveStyle::Dots),
        ],
    }
}

fn motion(fit: &PreslidingFit, units: &Units) -> Chart {
    let part = |k: usize| fit.curves.iter().map(move |c| [c[0], 1e3 * c[k]]).collect();
    let curve = |name: &str, k: usize, style: CurveStyle| ChartCurve {
        name: name.to_owned(),
        points: part(k),
        style,
    };
    let said = match &fit.outcome {
        Ok([(s0, d0), (s1, d1)]) => format!("σ0 = {s0:.0} ± {d0:.1} (std), σ1 = {s1:.1} ± {d1:.2} (std)."),
        Err(reason) => format!("{reason}."),
    };
    Chart {
        title: "Pre-sliding motion".to_owned(),
        note: said,
        x: ChartAxis { label: "time".to_owned(), unit: "s".to_owned(), logarithmic: false },
        y: ChartAxis {
            label: "position".to_owned(),
            unit: format!("m{}", units.position),
            logarithmic: false,
        },
        equal_units: false,
        curves: vec![curve("measured", 1, CurveStyle::Line), curve("simulated", 2, CurveStyle::Dashed)],
    }
}
