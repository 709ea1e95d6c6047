//! From free unknowns to Fourier coefficients: rest conditions and start pose hold for any value of the unknowns.

use dynid_model::MotionAdjoint;
use dynid_motion::trajectory::FourierBasis;

use dynid_motion::trajectory::MotionLimits;

/// Conditions at the start of every period (by periodicity also at its end).
#[derive(Debug, Clone, PartialEq, Default)]
pub struct StartConditions {
    /// Velocity and acceleration are zero.
    pub rest: bool,
    /// Jerk is zero as well.
    pub zero_jerk: bool,
    /// Position of every coordinate.
    pub pose: Option<Vec<f64>>,
}

/// Map from unknowns `z` to the coefficients `[q0, a.., b..]` of every coordinate, affine and onto all coefficients that
/// meet the start conditions.
///
/// Unknowns of a coordinate: amplitudes in an orthonormal basis of the conditions' null space, harmonic `k` in units of
/// `½ min(r, v/(kω), a/(kω)²)`; then, without a start pose, the offset in units of half the half range from the middle.
///
/// Source: Swevers et al. 1997.
#[derive(Debug, Clone)]
pub struct Parametrisation {
    harmonics: usize,
    joints: Vec<JointMap>,
}

#[derive(Debug, Clone)]
struct JointMap {
    /// First unknown.
    first: usize,
    /// `S`: unit of every harmonic's amplitudes.
    scale: Vec<f64>,
    /// `S N` for the sine and the cosine amplitudes: `L` rows, one column per unknown.
    sine: Vec<Vec<f64>>,
    cosine: Vec<Vec<f64>>,
    offset: Offset,
}

#[derive(Debug, Clone, Copy)]
enum Offset {
    /// `q0 = middle + scale z`.
    Free { middle: f64, scale: f64 },
    /// `q0 = pose - Σ b`.
    ByPose(f64),
}

impl Parametrisation {
    /// For coordinates with the given limits, a fundamental `base` (rad/s) and start conditions.
    pub fn new(limits: &[MotionLimits], base: f64, harmonics: usize, start: &StartConditions) -> Self {
        let mut first = 0;
        let joints = limits
            .iter()
            .enumerate()
            .map(|(j, limit)| {
                let scale: Vec<f64> = (1..=harmonics)
                    .map(|k| {
                        let rate = base * k as f64;
                        let reach = |d: usize| limit.of_derivative(d).map(|x| x / rate.powi(d as i32));
                        0.5 * (0..4).filter_map(reach).fold(f64::INFINITY, f64::min)
                    })
                    .collect();
                let power = |p: i32| -> Vec<f64> {
                    (1..=harmonics).map(|k| (k as f64).powi(p) * scale[k - 1]).collect()
                };
                let mut sine_rows = Vec::new();
                let mut cosine_rows = Vec::new();
                if start.rest {
                    sine_rows.push(power(1));
                    cosine_rows.push(power(2));
                }
                if start.zero_jerk {
                    sine_rows.push(power(3));
                }
                let scaled = |basis: Vec<Vec<f64>>| -> Vec<Vec<f64>> {
                    (0..harmonics).map(|k| basis.iter().map(|v| scale[k] * v[k]).collect()).collect()
                };
                let map = JointMap {
                    first,
                    sine: scaled(null_space(&sine_rows, harmonics)),
                    cosine: scaled(null_space(&cosine_rows, harmonics)),
                    offset: match &start.pose {
                        Some(pose) => Offset::ByPose(pose[j]),
                        None => Offset::Free { middle: limit.middle(), scale: 0.5 * limit.half_range() },
                    },
                    scale,
                };
                first += map.unknowns();
                map
            })
            .collect();
        Parametrisation { harmonics, joints }
    }

    /// Number of unknowns.
    pub fn unknowns(&self) -> usize {
        self.joints.iter().map(JointMap::unknowns).sum()
    }

    /// Number of coordinates.
    pub fn coordinates(&self) -> usize {
        self.joints.len()
    }

    /// Unknowns of a coordinate.
    pub fn range(&self, coordinate: usize) -> std::ops::Range<usize> {
        let joint = &self.joints[coordinate];
        joint.first..joint.first + joint.unknowns()
    }

    /// Index of the unknown that is the offset of a coordinate, if it is free.
    pub fn offset_unknown(&self, coordinate: usize) -> Option<usize> {
        let joint = &self.joints[coordinate];
        matches!(joint.offset, Offset::Free { .. }).then(|| joint.first + joint.unknowns() - 1)
    }

    /// Coefficients `[q0, a.., b..]` of every coordinate.
    pub fn coefficients(&self, z: &[f64]) -> Vec<Vec<f64>> {
        self.joints
            .iter()
            .map(|joint| {
                let z = &z[joint.first..];
                let sines = joint.sine_unknowns();
                let mut x = vec![0.0; 1 + 2 * self.harmonics];
                for k in 0..self.harmonics {
                    x[1 + k] = dot(&joint.sine[k], z);
                    x[1 + self.harmonics + k] = dot(&joint.cosine[k], &z[sines..]);
                }
                x[0] = match joint.offset {
                    Offset::Free { middle, scale } => middle + scale * z[joint.unknowns() - 1],
                    Offset::ByPose(pose) => pose - x[1 + self.harmonics..].iter().sum::<f64>(),
                };
                x
            })
            .collect()
    }

    /// Unknowns of the trajectory that meets the start conditions and is nearest to given coefficients `[q0, a.., b..]`:
    /// every amplitude counts in its harmonic's unit.
    ///
    /// # Panics
    /// If the coefficients do not fit the map.
    pub fn nearest(&self, coefficients: &[Vec<f64>]) -> Vec<f64> {
        let mut z = Vec::with_capacity(self.unknowns());
        for (joint, x) in self.joints.iter().zip(coefficients) {
            assert_eq!(x.len(), 1 + 2 * self.harmonics, "coefficients of a coordinate");
            // N is orthonormal: z = Nᵀ S⁻¹ a, and the map holds S N.
            for (rows, amplitudes) in
                [(&joint.sine, &x[1..=self.harmonics]), (&joint.cosine, &x[1 + self.harmonics..])]
            {
                let unknowns = rows.first().map_or(0, Vec::len);
                z.extend((0..unknowns).map(|u| {
                    let terms = rows.iter().zip(amplitudes).zip(&joint.scale);
                    terms.map(|((row, a), scale)| row[u] * a / (scale * scale)).sum::<f64>()
                }));
            }
            if let Offset::Free { middle, scale } = joint.offset {
                z.push((x[0] - middle) / scale);
            }
        }
        z
    }

    /// Derivatives of coefficients turned into derivatives of unknowns: adds `∂c/∂z` of one coordinate from `∂c/∂x`.
    pub(crate) fn pull_back(&self, coordinate: usize, x: &[f64], z: &mut [f64]) {
        let joint = &self.joints[coordinate];
        let sines = joint.sine_unknowns();
        let free = match joint.offset {
            Offset::Free { scale, .. } => {
                z[joint.unknowns() - 1] += scale * x[0];
                0.0
            }
            Offset::ByPose(_) => x[0],
        };
        for k in 0..self.harmonics {
            for (to, n) in z.iter_mut().zip(&joint.sine[k]) {
                *to += n * x[1 + k];
            }
            let cosine = x[1 + self.harmonics + k] - free;
            for (to, n) in z[sines..].iter_mut().zip(&joint.cosine[k]) {
                *to += n * cosine;
            }
        }
    }

    /// `∂c/∂z` from the derivatives with respect to the motion at the basis' times.
    pub fn gradient(&self, basis: &FourierBasis, adjoint: &MotionAdjoint) -> Vec<f64> {
        let samples = basis.times().len();
        let mut gradient = vec![0.0; self.unknowns()];
        for coordinate in 0..self.joints.len() {
            let mut x = vec![0.0; 1 + 2 * self.harmonics];
            for (derivative, channel) in [&adjoint.q, &adjoint.dq, &adjoint.ddq].into_iter().enumerate() {
                basis.accumulate(derivative, &channel[coordinate * samples..][..samples], &mut x);
            }
            self.pull_back(coordinate, &x, &mut gradient[self.range(coordinate)]);
        }
        gradient
    }

    /// Derivatives of one derivative of one coordinate at one time with respect to the unknowns of that coordinate.
    pub fn row(&self, coordinate: usize, basis: &FourierBasis, derivative: usize, time: usize) -> Vec<f64> {
        let mut z = vec![0.0; self.joints[coordinate].unknowns()];
        self.pull_back(coordinate, basis.row(derivative, time), &mut z);
        z
    }
}

impl JointMap {
    fn sine_unknowns(&self) -> usize {
        self.sine.first().map_or(0, Vec::len)
    }

    fn unknowns(&self) -> usize {
        let offset = usize::from(matches!(self.offset, Offset::Free { .. }));
        self.sine_unknowns() + self.cosine.first().map_or(0, Vec::len) + offset
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}

/// Orthonormal vectors that all rows are orthogonal to, by Householder reflections of the rows.
fn null_space(rows: &[Vec<f64>], n: usize) -> Vec<Vec<f64>> {
    let mut reflectors: Vec<Vec<f64>> = Vec::new();
    let reflect = |v: &[f64], x: &mut [f64]| {
        let factor = 2.0 * dot(v, x);
        x.iter_mut().zip(v).for_each(|(a, b)| *a -= factor * b);
    };
    for row in rows {
        let mut x = row.clone();
        for v in &reflectors {
            reflect(v, &mut x);
        }
        let k = reflectors.len();
        if k >= n {
            break;
        }
        x[..k].fill(0.0);
        let norm = dot(&x, &x).sqrt();
        x[k] += norm.copysign(x[k]);
        let length = dot(&x, &x).sqrt();
        if length > 0.0 {
            x.iter_mut().for_each(|a| *a /= length);
            reflectors.push(x);
        }
    }
    (reflectors.len()..n)
        .map(|j| {
            let mut e = vec![0.0; n];
            e[j] = 1.0;
            for v in reflectors.iter().rev() {
                reflect(v, &mut e);
            }
            e
        })
        .collect()
}
