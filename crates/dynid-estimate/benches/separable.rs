//! Separable fits against a general one: `cargo bench -p dynid-estimate --bench separable`.
//!
//! Three outputs of 200 rows with 24 common and own fixed columns and an arctangent each, 27 linear and 3 shape parameters
//! like the ER-16 arm. The baseline searches all 30 parameters with the same Levenberg-Marquardt and derivatives by
//! forward differences, from one start, at the linear parameters of that start. Prints the ratio of best times first.
#![expect(clippy::unwrap_used, clippy::print_stdout, reason = "a benchmark reports, and stops when it fails")]

use divan::{Bencher, black_box};
use dynid_estimate::separable::{
    RowGroup, SeparableProblem, SeparableSettings, ShapedColumns, Weighting, fit,
};
use dynid_model::ShapeParameter;
use std::time::{Duration, Instant};

const OUTPUTS: usize = 3;
const ROWS: usize = 200;
const COMMON: usize = 15;
/// Offset, sign, speed, arctangent.
const OWN: usize = 4;
const LINEAR: usize = COMMON + OUTPUTS * OWN;
const SLOPES: [f64; OUTPUTS] = [7.0, 19.7, 5.0];

fn main() {
    let (separable, general) = (Arctangents::new(), General::new(&Arctangents::new()));
    let one_start = settings(1);
    let ours = best_of(5, || fit(&separable, &one_start).unwrap().rss);
    let multi = best_of(5, || fit(&separable, &settings(20)).unwrap().rss);
    let theirs = best_of(5, || fit(&general, &one_start).unwrap().rss);
    let (a, b) = (fit(&separable, &one_start).unwrap().rss, fit(&general, &one_start).unwrap().rss);
    println!(
        "one start: separable {ours:.1?} (rss {a:.6}), general {theirs:.1?} (rss {b:.6}), separable/general {:.3}; 20 starts and profiles {multi:.1?}",
        ours.as_secs_f64() / theirs.as_secs_f64()
    );
    divan::main();
}

#[divan::bench(args = [1, 20], sample_count = 10)]
fn separable(bencher: Bencher<'_, '_>, starts: usize) {
    let (problem, settings) = (Arctangents::new(), settings(starts));
    bencher.bench_local(|| fit(&problem, &settings).unwrap());
}

#[divan::bench(sample_count = 5)]
fn general_with_forward_differences(bencher: Bencher<'_, '_>) {
    let problem = General::new(&Arctangents::new());
    bencher.bench_local(|| fit(&problem, &settings(1)).unwrap());
}

fn settings(starts: usize) -> SeparableSettings {
    let profile_points = if starts > 1 { 15 } else { 0 };
    SeparableSettings { weighting: Weighting::Equal, starts, profile_points, ..SeparableSettings::default() }
}

fn best_of(times: usize, mut work: impl FnMut() -> f64) -> Duration {
    let timed = |_| {
        let start = Instant::now();
        black_box(work());
        start.elapsed()
    };
    (0..times).map(timed).min().unwrap_or_default()
}

fn speed(output: usize, row: usize) -> f64 {
    let t = std::f64::consts::TAU * row as f64 / ROWS as f64;
    (0.6 + 0.1 * output as f64) * ((t + output as f64).sin() + 0.4 * (3.0 * t + 0.3).cos())
}

fn common(output: usize, column: usize, row: usize) -> f64 {
    let t = std::f64::consts::TAU * row as f64 / ROWS as f64;
    let harmonic = 1.0 + (column + 2 * output) as f64 % 9.0;
    (harmonic * t + 1.3 * (column * (output + 1)) as f64).sin()
}

struct Arctangents {
    groups: Vec<RowGroup>,
    shape: Vec<ShapeParameter>,
}

impl Arctangents {
    fn new() -> Self {
        let group = |output: usize| {
            let own = COMMON + OWN * output;
            let columns = (0..COMMON + 3).flat_map(|c| {
                (0..ROWS).map(move |i| match c.checked_sub(COMMON) {
                    None => common(output, c, i),
                    Some(0) => 1.0,
                    Some(1) => speed(output, i).signum(),
                    Some(_) => speed(output, i),
                })
            });
            let fixed_values: Vec<f64> = columns.collect();
            let effort = (0..ROWS).map(|i| {
                let v = speed(output, i);
                let fixed: f64 = (0..COMMON + 3).map(|c| (1.0 + c as f64) * fixed_values[c * ROWS + i]).sum();
                let noise = ((i * i * 7 + 31 * output) as f64 * 0.37).sin();
                fixed + 30.0 * (SLOPES[output] * v).atan() + 4.0 * noise
            });
            RowGroup {
                output,
                block_rows: vec![ROWS / 10; 10],
                fixed: (0..COMMON).chain(own..own + 3).collect(),
                effort: effort.collect(),
                fixed_values: fixed_values.clone(),
                shaped: vec![Some(own + 3)],
                dependence: vec![(0, output)],
                ..RowGroup::default()
            }
        };
        let slope = |output: usize| ShapeParameter {
            name: format!("j{output}.fb"),
            unit: "s/rad",
            start: 5.5,
            lower: 1.0,
            upper: 60.0,
            logarithmic: true,
        };
        Arctangents { groups: (0..OUTPUTS).map(group).collect(), shape: (0..OUTPUTS).map(slope).collect() }
    }
}

impl SeparableProblem for Arctangents {
    fn linear(&self) -> usize {
        LINEAR
    }

    fn shape(&self) -> &[ShapeParameter] {
        &self.shape
    }

    fn groups(&self) -> &[RowGroup] {
        &self.groups
    }

    fn shaped(&self, shape: &[f64], out: &mut [ShapedColumns]) {
        for (output, out) in out.iter_mut().enumerate() {
            for i in 0..ROWS {
                let v = speed(output, i);
                out.value_mut(0)[i] = (shape[output] * v).atan();
                out.derivative_mut(0)[i] = v / (1.0 + (shape[output] * v).powi(2));
            }
        }
    }
}

/// The rows of the problem with all parameters searched.
struct General {
    fixed: Vec<RowGroup>,
    groups: Vec<RowGroup>,
    parameters: Vec<ShapeParameter>,
}

impl General {
    fn new(problem: &Arctangents) -> Self {
        let all = LINEAR + OUTPUTS;
        let groups = problem.groups.iter().map(|g| RowGroup {
            fixed: vec![],
            fixed_values: vec![],
            shaped: vec![None],
            dependence: (0..all).map(|s| (0, s)).collect(),
            ..g.clone()
        });
        let parameter = |k: usize| match k.checked_sub(LINEAR) {
            Some(output) => problem.shape[output].clone(),
            None => ShapeParameter {
                name: format!("c{k}"),
                unit: "",
                start: 0.0,
                lower: f64::NEG_INFINITY,
                upper: f64::INFINITY,
                logarithmic: false,
            },
        };
        General {
            fixed: problem.groups.clone(),
            groups: groups.collect(),
            parameters: (0..all).map(parameter).collect(),
        }
    }

    fn efforts(&self, output: usize, x: &[f64], out: &mut [f64]) {
        let group = &self.fixed[output];
        for (i, out) in out.iter_mut().enumerate() {
            let own = COMMON + OWN * output;
            *out = x[own + 3] * (x[LINEAR + output] * speed(output, i)).atan();
            for (k, column) in group.fixed.iter().enumerate() {
                *out += x[*column] * group.fixed_values[k * ROWS + i];
            }
        }
    }
}

impl SeparableProblem for General {
    fn linear(&self) -> usize {
        0
    }

    fn shape(&self) -> &[ShapeParameter] {
        &self.parameters
    }

    fn groups(&self) -> &[RowGroup] {
        &self.groups
    }

    fn shaped(&self, shape: &[f64], out: &mut [ShapedColumns]) {
        let (mut moved, mut other) = (shape.to_vec(), vec![0.0; ROWS]);
        for (output, out) in out.iter_mut().enumerate() {
            self.efforts(output, shape, out.value_mut(0));
            for k in 0..shape.len() {
                let step = 1e-7 * shape[k].abs().max(1.0);
                moved[k] = shape[k] + step;
                self.efforts(output, &moved, &mut other);
                moved[k] = shape[k];
                let base = out.value(0).to_vec();
                let slopes = other.iter().zip(base).map(|(o, b)| (o - b) / step);
                out.derivative_mut(k).iter_mut().zip(slopes).for_each(|(d, s)| *d = s);
            }
        }
    }
}
