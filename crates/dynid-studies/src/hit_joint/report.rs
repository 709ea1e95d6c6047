//! The study's report: the paper's tables and figures again.

use dynid::estimators::online::error_driven_factor;
use dynid::model::element::CubicSpring;
use dynid::report::{Chart, CurveStyle, Fact, StudyReport, StudySection, Value};

use super::joint::{Damping, identified};
use super::measurement::Signals;
use super::offline::Tables;
use super::online::{CYCLES, samples};
use super::realisations::{Interval, Realisation, errors, spread};
use super::settings::Settings;
use super::tracking::{OneWay, Point, Tracks, dropped};
use super::{NAMES, PARAMETERS, STUDY, Values};
use crate::page::{axis, curve, table, text};
use crate::{StudyError, StudyRecord};

const UNITS: [&str; PARAMETERS] = ["N m/rad", "N m/rad³", "N m s/rad", "N m", "N m s/rad", "N m"];

/// From when on errors of predictions are drawn, s.
const START_S: f64 = 12.0;

/// What the report is made of.
pub(super) struct Contents<'a> {
    pub(super) settings: &'a Settings,
    /// The noisy data set, decimated.
    pub(super) data: &'a [Signals],
    pub(super) tables: &'a Tables,
    pub(super) all: &'a [Realisation],
    pub(super) tracks: &'a Tracks,
    pub(super) one_way: &'a [OneWay],
}

fn in_per_cent(x: f64) -> Value {
    text(format!("{:+.2} %", 100.0 * x))
}

impl Contents<'_> {
    pub(super) fn report(&self, record: &StudyRecord) -> Result<StudyReport, StudyError> {
        let introduction = [
            "One joint of a large space manipulator: a motor, a harmonic drive of ratio 290 and a torque sensor. The paper finds \
             the spring `k1 Δ + k2 Δ³` and the damping of both sides by least squares on constant-speed tests, with models that \
             have more and more damping, then follows the same six parameters on line by recursive least squares whose \
             forgetting factor falls with the relative error.",
            "The joint here is simulated with the values of the paper's Table III, so the truth is known. Inertias, speeds, load \
             and noise are not printed; decisions are listed in the study's `README.md`.",
        ];
        let sections = vec![
            self.spring_section(),
            self.table_section(),
            self.noise_section(),
            self.residual_section(),
            self.forgetting_section(),
            self.track_section(),
            self.one_way_section(),
        ];
        Ok(record.page(STUDY, &introduction, sections))
    }

    fn truth(&self) -> Values {
        self.settings.truth.values()
    }

    fn spring_section(&self) -> StudySection {
        let (x, catalogue) = (&self.tables.full.x, &self.settings.catalogue);
        let spring = CubicSpring { k1: x[0], k2: x[1] };
        let none = CubicSpring { k1: self.tables.none[0][0], k2: self.tables.none[0][1] };
        let largest = spring.deformation(catalogue.largest).unwrap_or(1e-3);
        let grid: Vec<f64> = (-100..=100).map(|k| largest * f64::from(k) / 100.0).collect();
        let law = |torque: &dyn Fn(f64) -> f64| grid.iter().map(|d| [1e3 * d, torque(*d)]).collect();
        let measured = self.data.iter().flat_map(|cruise| {
            (0..cruise.len()).step_by(12).map(|k| {
                let v = cruise.link_speed[k];
                [1e3 * cruise.deformation[k], cruise.link_torque[k] + x[4] * v + x[5] * v.signum()]
            })
        });
        let mut curves = vec![
            curve("measured, friction taken off", measured.collect(), CurveStyle::Dots),
            curve("identified", law(&|d| spring.torque(d)), CurveStyle::Line),
            curve("input row, no damping", law(&|d| none.torque(d)), CurveStyle::Dashed),
        ];
        let mut facts = Vec::new();
        let mut differences = Vec::new();
        if let Some(fit) = spring.piecewise(catalogue.torques, catalogue.largest) {
            curves.push(curve("maker's three stiffnesses", law(&|d| fit.spring.torque(d)), CurveStyle::Line));
            for (k, stiffness) in fit.spring.stiffness.iter().enumerate() {
                facts.push(Fact::new(format!("K{}", k + 1), *stiffness, "N m/rad"));
            }
            let torques = (-200..=200).map(|k| catalogue.largest * f64::from(k) / 200.0);
            let points =
                torques.filter_map(|t| Some([t, 1e6 * (fit.spring.deformation(t) - spring.deformation(t)?)]));
            differences.push(curve("three lines less cubic", points.collect(), CurveStyle::Line));
        }
        let truth = self.truth();
        let exact = CubicSpring { k1: truth[0], k2: truth[1] };
        let torques = (-200..=200).map(|k| catalogue.largest * f64::from(k) / 200.0);
        let points =
            torques.filter_map(|t| Some([t, 1e6 * (spring.deformation(t)? - exact.deformation(t)?)]));
        differences.push(curve("identified less truth", points.collect(), CurveStyle::Line));
        StudySection {
            title: "The spring".into(),
            text: vec![
                "Measured: reading of the torque sensor with the identified friction of the output added, over the measured deformation. \
                 The maker's table has three stiffnesses, nearest in deformation."
                    .into(),
            ],
            facts,
            charts: vec![
                Chart {
                    title: "Torque over deformation".into(),
                    x: axis("deformation", "mrad"),
                    y: axis("torque", "N m"),
                    curves,
                    ..Chart::default()
                },
                Chart {
                    title: "Differences of deformation at the same torque".into(),
                    x: axis("torque", "N m"),
                    y: axis("difference", "µrad"),
                    curves: differences,
                    ..Chart::default()
                },
            ],
            ..StudySection::default()
        }
    }

    fn table_section(&self) -> StudySection {
        let (truth, paper, tables) = (self.truth(), &self.settings.paper, self.tables);
        let names = ["input row", "output row", "coupled"];
        let theirs: [&[f64]; 3] = [&paper.eq1_none, &paper.eq2_none, &paper.coupled_none];
        let mut nested = Vec::new();
        let mut push = |model: &str, rows: &str, theirs: &[f64], ours: &[f64]| {
            let damping = |list: &[f64]| list.get(2).map_or_else(|| text("-"), |x| Value::from(*x));
            nested.push(vec![
                text(model),
                text(rows),
                Value::from(theirs[0]),
                Value::from(ours[0]),
                in_per_cent(theirs[0] / paper.full[0] - 1.0),
                in_per_cent(ours[0] / truth[0] - 1.0),
                Value::from(theirs[1]),
                Value::from(ours[1]),
                damping(theirs),
                damping(ours),
            ]);
        };
        for ((name, theirs), ours) in names.iter().zip(theirs).zip(&tables.none) {
            push("I, no damping", name, theirs, ours);
        }
        push("II, Coulomb", "input row", &paper.eq1_coulomb, &tables.coulomb[0]);
        push("II, Coulomb", "output row", &paper.eq2_coulomb, &tables.coulomb[1]);
        let interval = Interval::of(&tables.full);
        let found = errors(&interval.x, &truth);
        let full = (0..PARAMETERS).map(|k| {
            vec![
                text(NAMES[k]),
                text(UNITS[k]),
                Value::from(paper.full[k]),
                Value::from(interval.x[k]),
                Value::from(interval.half[k]),
                in_per_cent(found[k]),
            ]
        });
        StudySection {
            title: "Tables I to III".into(),
            text: vec![
                "Errors are against each one's own full model: the paper's Table III, our truth (the same numbers). With the signs of \
                 the equations, a braking load and friction that is left out, the input row must come out too stiff and the output row \
                 too soft. The paper's output row is too stiff as well."
                    .into(),
            ],
            tables: vec![
                table(
                    "Tables I and II: models without damping, and with Coulomb friction alone (b_inD, b_outC)",
                    &[
                        "model", "rows", "paper k1", "ours k1", "paper error", "our error", "paper k2", "ours k2",
                        "paper friction", "our friction",
                    ],
                    nested,
                ),
                table(
                    "Table III: the full model, both rows",
                    &["", "unit", "paper (truth)", "ours", "half width of 95 %", "error"],
                    full.collect(),
                ),
            ],
            ..StudySection::default()
        }
    }

    fn noise_section(&self) -> StudySection {
        let truth = self.truth();
        let row = |name: &str, list: Vec<Values>| {
            let (mean, deviation) = spread(&list, &truth);
            let cells = (0..PARAMETERS)
                .map(|k| text(format!("{:+.2} ± {:.2} %", 100.0 * mean[k], 100.0 * deviation[k])));
            std::iter::once(text(name)).chain(cells).collect::<Vec<Value>>()
        };
        let of = |pick: &dyn Fn(&Realisation) -> Values| self.all.iter().map(pick).collect::<Vec<_>>();
        let rows = vec![
            row("6 µrad", of(&|r| r.plain.x)),
            row("6 µrad, filtered", of(&|r| r.filtered.x)),
            row("20 µrad", of(&|r| r.strong[0][0])),
            row("20 µrad, filtered", of(&|r| r.strong[0][1])),
            row("60 µrad", of(&|r| r.strong[1][0])),
            row("60 µrad, filtered", of(&|r| r.strong[1][1])),
        ];
        let head = ["noise of the deformation", "k1", "k2", "b_in", "b_inD", "b_out", "b_outC"];
        StudySection {
            title: "Noise of the measured deformation".into(),
            text: vec![
                "The regressor is measured. Noise shrinks the columns' share of signal, and its cube has a mean of its own. A low-pass \
                 of 2 Hz without phase goes over all signals before the deformation is cubed."
                    .into(),
            ],
            tables: vec![table(
                &format!("Error against the truth, mean ± standard deviation over {} realisations", self.all.len()),
                &head,
                rows,
            )],
            ..StudySection::default()
        }
    }

    fn residual_section(&self) -> StudySection {
        let full = identified(self.settings, Damping::Full, false);
        let rate = self.settings.programme.decimated_rate_hz();
        // Slow and fast, forwards.
        let charts = [0, self.data.len() - 2].into_iter().flat_map(|cruise| {
            let signals = &self.data[cruise];
            let rows = samples(self.settings, &full, signals);
            let residual = move |row: usize, x: &[f64]| -> Vec<[f64; 2]> {
                let of = |s: &super::online::Sample| {
                    let phi = &s.regressor[row * PARAMETERS..][..PARAMETERS];
                    s.effort[row] - phi.iter().zip(x).map(|(phi, x)| phi * x).sum::<f64>()
                };
                rows.iter().enumerate().step_by(4).map(|(k, s)| [k as f64 / rate, of(s)]).collect()
            };
            let speed = self.settings.programme.speeds()[cruise].to_degrees();
            ["input", "output"].into_iter().enumerate().map(move |(row, name)| {
                let mut none = vec![0.0; PARAMETERS];
                none[..2].copy_from_slice(&self.tables.none[row]);
                Chart {
                    title: format!("Residual of the {name} row at {speed:.2} °/s"),
                    x: axis("time of the cruise", "s"),
                    y: axis("residual on the joint's side", "N m"),
                    curves: vec![
                        curve("no damping, this row", residual(row, &none), CurveStyle::Dots),
                        curve("full model", residual(row, &self.tables.full.x), CurveStyle::Dots),
                    ],
                    ..Chart::default()
                }
            })
        });
        StudySection {
            title: "Residuals".into(),
            text: vec![
                "Every fourth sample. What a model without damping leaves swings with the load, since its spring has taken friction in."
                    .into(),
            ],
            charts: charts.collect(),
            ..StudySection::default()
        }
    }

    fn forgetting_section(&self) -> StudySection {
        let online = &self.settings.online;
        let points = (0..=200).map(|k| f64::from(k) / 100.0);
        let law = points.map(|e| [e, error_driven_factor(e, online.alpha, online.beta)]);
        StudySection {
            title: "Forgetting factor".into(),
            charts: vec![
                Chart {
                    title: "Forgetting factor over relative error (Figure 5)".into(),
                    x: axis("relative error", ""),
                    y: axis("λ", ""),
                    curves: vec![curve("α = 0.05, β = -4.68", law.collect(), CurveStyle::Line)],
                    ..Chart::default()
                },
                self.along("Forgetting factor along the stream", "λ", "", |p| p.lambda, false),
            ],
            ..StudySection::default()
        }
    }

    /// A figure of the first stream over time.
    fn along(
        &self,
        title: &str,
        label: &str,
        unit: &str,
        of: impl Fn(&Point) -> f64,
        reacting: bool,
    ) -> Chart {
        let rate = self.settings.programme.online_rate_hz;
        let seconds = |p: &Point| p.sample as f64 / rate;
        // Until it has seen something an estimator predicts nothing.
        let start = if reacting { START_S } else { 0.0 };
        let points = |list: &[Point]| {
            list.iter().filter(|p| seconds(p) >= start).map(|p| [seconds(p), of(p)]).collect()
        };
        let mut curves =
            vec![curve("paper's factor", points(&self.tracks.published[0].points), CurveStyle::Line)];
        if reacting {
            curves.push(curve("alarm and reaction", points(&self.tracks.stated[0].points), CurveStyle::Line));
        }
        Chart { title: title.into(), x: axis("time", "s"), y: axis(label, unit), curves, ..Chart::default() }
    }

    /// Figures 6 to 8.
    fn track_section(&self) -> StudySection {
        let rate = self.settings.programme.online_rate_hz;
        let seconds = |p: &Point| p.sample as f64 / rate;
        let truth = self.truth();
        let figures = ["Figure 6", "Figure 6", "Figure 7", "Figure 7", "Figure 8", "Figure 8"];
        let end = self.tracks.none[0].points.last().map_or(0.0, seconds);
        let change = 0.5 * end;
        let mut charts: Vec<Chart> = (0..PARAMETERS)
            .map(|k| {
                let after = if k == 0 { dropped(self.settings) } else { truth[k] };
                // Beyond this an estimator has not seen enough yet; the axis would show nothing else.
                let (low, high) = (truth[k] - 0.5 * truth[k].abs(), truth[k] + 0.5 * truth[k].abs());
                let points = |list: &[Point], of: &dyn Fn(&Point) -> f64| -> Vec<[f64; 2]> {
                    let inside = |y: f64| if (low..=high).contains(&y) { y } else { f64::NAN };
                    list.iter().map(|p| [seconds(p), inside(of(p))]).collect()
                };
                let ours = &self.tracks.stated[0].points;
                let mut band = points(ours, &|p| p.x[k] + 2.0 * p.std[k]);
                band.push([f64::NAN; 2]);
                band.extend(points(ours, &|p| p.x[k] - 2.0 * p.std[k]));
                Chart {
                    title: format!("{} along the stream ({})", NAMES[k], figures[k]),
                    note: String::new(),
                    x: axis("time", "s"),
                    y: axis(NAMES[k], UNITS[k]),
                    equal_units: false,
                    curves: vec![
                        curve(
                            "paper's factor",
                            points(&self.tracks.published[0].points, &|p| p.x[k]),
                            CurveStyle::Line,
                        ),
                        curve(
                            "no forgetting",
                            points(&self.tracks.none[0].points, &|p| p.x[k]),
                            CurveStyle::Line,
                        ),
                        curve("alarm and reaction", points(ours, &|p| p.x[k]), CurveStyle::Line),
                        curve("± 2 deviations", band, CurveStyle::Dashed),
                        curve(
                            "truth",
                            vec![[0.0, truth[k]], [change, truth[k]], [change, after], [end, after]],
                            CurveStyle::Dashed,
                        ),
                    ],
                }
            })
            .collect();
        charts.push(self.along("Prediction error of the input row", "error", "N m", |p| p.error[0], true));
        charts.push(self.along("Prediction error of the output row", "error", "N m", |p| p.error[1], true));
        let percent = |x: f64| format!("{:.2} %", 100.0 * x);
        let row = |name: &str, list: &[super::tracking::Track], alarms: bool| {
            let worst = |of: fn(&super::tracking::Track) -> f64| list.iter().map(of).fold(0.0, f64::max);
            let false_alarms = list.iter().map(|t| t.false_alarms).sum::<usize>();
            vec![
                text(name),
                text(percent(worst(|t| t.before))),
                text(percent(worst(|t| t.end))),
                Value::from(worst(|t| t.settled as f64)),
                if alarms { Value::from(false_alarms) } else { text("-") },
            ]
        };
        let tracks = self.tracks;
        StudySection {
            title: "On line".into(),
            text: vec![format!(
                "Six shuffled cycles of the ten cruises at 50 Hz; after {CYCLES} of them, at {change:.0} s, k1 drops by 15 %. Figures show \
                 the first stream; values more than half off are left out. The paper's factor reacts to errors that are large \
                 beside the torque, so it hardly forgets; an alarm on innovations in units of their noise finds the change within \
                 a few samples, and opens k1 alone."
            )],
            tables: vec![table(
                &format!("Worst of {} streams", tracks.published.len()),
                &[
                    "",
                    "error of k1 before",
                    "at the end",
                    "samples until within 2 % for good",
                    "false alarms, all streams",
                ],
                vec![
                    row("paper's factor", &tracks.published, false),
                    row("no forgetting", &tracks.none, false),
                    row("noise-normalised factor", &tracks.normalised, false),
                    row("alarm and reaction, noise stated", &tracks.stated, true),
                    row("alarm and reaction, noise learned", &tracks.learned, true),
                ],
            )],
            charts,
            ..StudySection::default()
        }
    }

    fn one_way_section(&self) -> StudySection {
        let rows = self
            .one_way
            .iter()
            .map(|o| {
                let percent = |x: f64| text(format!("{:.1} %", 100.0 * x));
                vec![text(o.name), Value::from(o.growth), percent(o.error), percent(o.back)]
            })
            .collect();
        StudySection {
            title: "One direction for long".into(),
            text: vec![
                "At one speed in one direction only sums of viscous and Coulomb friction are seen. An estimator that forgets meanwhile \
                 loses what it knew of the difference."
                    .into(),
            ],
            tables: vec![table(
                "50 cruises in one direction after the programme",
                &["", "growth of the worst deviation", "worst error of a parameter", "error of torque in the cruise back"],
                rows,
            )],
            ..StudySection::default()
        }
    }
}
