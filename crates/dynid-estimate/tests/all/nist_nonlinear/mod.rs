//! Nonlinear-regression sets of the NIST Statistical Reference Datasets as separable and as general problems.
#![expect(clippy::unwrap_used, reason = "helpers of tests outside of test functions")]
#![expect(clippy::suspicious_arithmetic_impl, reason = "the rules of derivatives mix sums and products")]

mod data;

pub(crate) use data::{Published, SETS};

use dynid_estimate::separable::{RowGroup, SeparableProblem, ShapedColumns};
use dynid_model::ShapeParameter;
use std::f64::consts::PI;
use std::ops::{Add, Div, Mul, Neg, Sub};

/// Most parameters of a set.
const WIDTH: usize = 9;

/// A number with its derivatives by all parameters.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Jet {
    value: f64,
    slope: [f64; WIDTH],
}

impl Jet {
    fn constant(value: f64) -> Self {
        Jet { value, slope: [0.0; WIDTH] }
    }

    fn parameter(value: f64, index: usize) -> Self {
        let mut jet = Jet::constant(value);
        jet.slope[index] = 1.0;
        jet
    }

    /// `f(self)` with `f'(self)`.
    fn map(self, value: f64, derivative: f64) -> Self {
        Jet { value, slope: self.slope.map(|s| s * derivative) }
    }

    fn exp(self) -> Self {
        self.map(self.value.exp(), self.value.exp())
    }

    fn ln(self) -> Self {
        self.map(self.value.ln(), 1.0 / self.value)
    }

    fn sin(self) -> Self {
        self.map(self.value.sin(), self.value.cos())
    }

    fn cos(self) -> Self {
        self.map(self.value.cos(), -self.value.sin())
    }

    fn atan(self) -> Self {
        self.map(self.value.atan(), 1.0 / (1.0 + self.value * self.value))
    }

    fn inverse(self) -> Self {
        self.map(1.0 / self.value, -1.0 / (self.value * self.value))
    }

    fn squared(self) -> Self {
        self * self
    }
}

impl Add for Jet {
    type Output = Jet;
    fn add(self, other: Jet) -> Jet {
        let slope = std::array::from_fn(|k| self.slope[k] + other.slope[k]);
        Jet { value: self.value + other.value, slope }
    }
}

impl Neg for Jet {
    type Output = Jet;
    fn neg(self) -> Jet {
        self * -1.0
    }
}

impl Sub for Jet {
    type Output = Jet;
    fn sub(self, other: Jet) -> Jet {
        self + -other
    }
}

impl Mul for Jet {
    type Output = Jet;
    fn mul(self, other: Jet) -> Jet {
        let slope = std::array::from_fn(|k| self.slope[k] * other.value + self.value * other.slope[k]);
        Jet { value: self.value * other.value, slope }
    }
}

impl Div for Jet {
    type Output = Jet;
    fn div(self, other: Jet) -> Jet {
        self * other.inverse()
    }
}

impl Add<f64> for Jet {
    type Output = Jet;
    fn add(self, other: f64) -> Jet {
        self + Jet::constant(other)
    }
}

impl Mul<f64> for Jet {
    type Output = Jet;
    fn mul(self, factor: f64) -> Jet {
        Jet { value: self.value * factor, slope: self.slope.map(|s| s * factor) }
    }
}

/// Linear parameters of a set, ascending.
fn linear_of(name: &str) -> &'static [usize] {
    match name {
        "Bennett5" | "BoxBOD" | "DanWood" | "Eckerle4" | "MGH09" | "MGH10" | "Misra1a" | "Misra1b"
        | "Misra1c" | "Misra1d" | "Rat42" | "Rat43" => &[0],
        "Gauss1" | "Gauss2" | "Gauss3" => &[0, 2, 5],
        "Lanczos1" | "Lanczos2" | "Lanczos3" => &[0, 2, 4],
        "Nelson" | "Roszman1" => &[0, 1],
        "Kirby2" | "MGH17" => &[0, 1, 2],
        "Hahn1" | "Thurber" => &[0, 1, 2, 3],
        "ENSO" => &[0, 1, 2, 4, 5, 7, 8],
        _ => &[],
    }
}

/// Columns of the linear parameters and, last, what is added to them.
fn terms(name: &str, b: &[Jet], x: &[f64]) -> Vec<Jet> {
    let (c, t) = (Jet::constant, x[0]);
    let (one, zero) = (c(1.0), c(0.0));
    let ratio = |numerator: usize, denominator: usize| {
        let powers = |n: usize| (0..n).map(|k| t.powi(k as i32)).collect::<Vec<f64>>();
        let below = powers(denominator + 1);
        let tail = b[numerator..].iter().zip(&below[1..]);
        let below = tail.fold(one, |sum, (b, p)| sum + *b * *p);
        powers(numerator).into_iter().map(|p| c(p) / below).collect::<Vec<Jet>>()
    };
    let mut columns = match name {
        "Bennett5" => vec![((b[1] + t).ln() * -1.0 / b[2]).exp()],
        "BoxBOD" | "Misra1a" => vec![one - (b[1] * -t).exp()],
        "Chwirut1" | "Chwirut2" => return vec![(b[0] * -t).exp() / (b[1] + b[2] * t)],
        "DanWood" => vec![(b[1] * t.ln()).exp()],
        "ENSO" => {
            let wave = |period: Jet| [(c(2.0 * PI * t) / period).cos(), (c(2.0 * PI * t) / period).sin()];
            [&[one][..], &wave(c(12.0)), &wave(b[3]), &wave(b[6])].concat()
        }
        "Eckerle4" => vec![(((c(t) - b[2]) / b[1]).squared() * -0.5).exp() / b[1]],
        "Gauss1" | "Gauss2" | "Gauss3" => {
            let bell = |centre: usize| (-((c(t) - b[centre]) / b[centre + 1]).squared()).exp();
            vec![(b[1] * -t).exp(), bell(3), bell(6)]
        }
        "Hahn1" | "Thurber" => ratio(4, 3),
        "Kirby2" => ratio(3, 2),
        "Lanczos1" | "Lanczos2" | "Lanczos3" => [1, 3, 5].map(|k| (b[k] * -t).exp()).to_vec(),
        "MGH09" => vec![(b[1] * t + t * t) / (b[2] * t + t * t + b[3])],
        "MGH10" => vec![(b[1] / (b[2] + t)).exp()],
        "MGH17" => vec![one, (b[3] * -t).exp(), (b[4] * -t).exp()],
        "Misra1b" => vec![one - (b[1] * (0.5 * t) + 1.0).squared().inverse()],
        "Misra1c" => vec![one - ((b[1] * (2.0 * t) + 1.0).ln() * -0.5).exp()],
        "Misra1d" => vec![b[1] * t / (b[1] * t + 1.0)],
        "Nelson" => vec![one, -((b[2] * -x[1]).exp() * t)],
        "Rat42" => vec![((b[1] - b[2] * t).exp() + 1.0).inverse()],
        "Rat43" => vec![(-(((b[1] - b[2] * t).exp() + 1.0).ln()) / b[3]).exp()],
        "Roszman1" => vec![one, c(-t), (b[2] / (-b[3] + t)).atan() * (-1.0 / PI)],
        other => panic!("unknown set {other}"),
    };
    if name != "Roszman1" {
        columns.push(zero);
    }
    columns
}

/// A set from one of its starts.
pub(crate) struct NistProblem {
    set: &'static Published,
    /// Parameters treated as linear, and the others.
    linear: Vec<usize>,
    shaped: Vec<usize>,
    parameters: Vec<ShapeParameter>,
    groups: Vec<RowGroup>,
}

impl NistProblem {
    /// `separate`: linear parameters are treated as such; else all are searched.
    pub(crate) fn new(set: &'static Published, start: usize, separate: bool) -> Self {
        let all = set.certified.len();
        let linear: Vec<usize> = if separate { linear_of(set.name).to_vec() } else { vec![] };
        let shaped: Vec<usize> = (0..all).filter(|k| !linear.contains(k)).collect();
        let parameters = shaped.iter().map(|k| ShapeParameter {
            name: format!("b{}", k + 1),
            unit: "",
            start: set.starts[start][*k],
            lower: f64::NEG_INFINITY,
            upper: f64::INFINITY,
            logarithmic: false,
        });
        let response = set.data.chunks(set.predictors + 1).map(|r| r[0]);
        let effort: Vec<f64> = response.map(|y| if set.name == "Nelson" { y.ln() } else { y }).collect();
        let columns = linear.len() + 1;
        let group = RowGroup {
            block_rows: vec![effort.len()],
            effort,
            shaped: (0..linear.len()).map(Some).chain([None]).collect(),
            dependence: (0..columns).flat_map(|k| (0..shaped.len()).map(move |s| (k, s))).collect(),
            ..RowGroup::default()
        };
        NistProblem { set, linear, parameters: parameters.collect(), shaped, groups: vec![group] }
    }

    /// All parameters in their order.
    pub(crate) fn assemble<T: Copy + Default>(&self, linear: &[T], shape: &[T]) -> Vec<T> {
        let mut all = vec![T::default(); self.set.certified.len()];
        self.linear.iter().zip(linear).for_each(|(k, v)| all[*k] = *v);
        self.shaped.iter().zip(shape).for_each(|(k, v)| all[*k] = *v);
        all
    }
}

impl SeparableProblem for NistProblem {
    fn linear(&self) -> usize {
        self.linear.len()
    }

    fn shape(&self) -> &[ShapeParameter] {
        &self.parameters
    }

    fn groups(&self) -> &[RowGroup] {
        &self.groups
    }

    fn shaped(&self, shape: &[f64], out: &mut [ShapedColumns]) {
        let mut b = vec![Jet::constant(0.0); self.set.certified.len()];
        self.shaped.iter().zip(shape).for_each(|(k, v)| b[*k] = Jet::parameter(*v, *k));
        let amplitudes = linear_of(self.set.name);
        for (i, row) in self.set.data.chunks(self.set.predictors + 1).enumerate() {
            let mut columns = terms(self.set.name, &b, &row[1..]);
            if self.linear.is_empty() {
                let known = *columns.last().unwrap();
                let sum = columns.iter().zip(amplitudes).map(|(term, k)| *term * b[*k]);
                columns = vec![sum.fold(known, |a, b| a + b)];
            }
            for (k, column) in columns.iter().enumerate() {
                out[0].value_mut(k)[i] = column.value;
                for (s, parameter) in self.shaped.iter().enumerate() {
                    out[0].derivative_mut(k * self.shaped.len() + s)[i] = column.slope[*parameter];
                }
            }
        }
    }
}
