//! Several samples at a time.

use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub};

use super::sine::sin_cos_lanes;
use super::{Function, FunctionOfTwo, Scalar};

/// Lanes by their index. A loop and no closure: a closure that is not inlined is compiled for any processor, where a fused
/// multiply-add is a call.
macro_rules! lanes {
    ($k:ident => $value:expr) => {{
        let mut out = [0.0; N];
        let mut $k = 0;
        while $k < N {
            out[$k] = $value;
            $k += 1;
        }
        Lanes(out)
    }};
}

/// `N` numbers that move in step, one sample each.
///
/// With `FUSED`, [`Scalar::mul_add`] rounds once. Use it only inside a function compiled for a processor with fused
/// multiply-add: elsewhere every call goes through a slow library routine.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lanes<const N: usize, const FUSED: bool>(pub [f64; N]);

impl<const N: usize, const FUSED: bool> Lanes<N, FUSED> {
    /// Reads `N` consecutive numbers.
    #[inline(always)]
    pub fn load(from: &[f64]) -> Self {
        let from = &from[..N];
        lanes!(k => from[k])
    }

    /// Writes `N` consecutive numbers.
    #[inline(always)]
    pub fn store(self, to: &mut [f64]) {
        to[..N].copy_from_slice(&self.0);
    }
}

impl<const N: usize, const FUSED: bool> Scalar for Lanes<N, FUSED> {
    type Fused = Self;
    #[inline(always)]
    fn fuse(self) -> Self {
        self
    }
    #[inline(always)]
    fn unfuse(fused: Self) -> Self {
        fused
    }
    #[inline(always)]
    fn from_f64(value: f64) -> Self {
        Lanes([value; N])
    }
    #[inline(always)]
    fn recip(self) -> Self {
        lanes!(k => 1.0 / self.0[k])
    }
    #[inline(always)]
    fn is_positive_finite(self) -> bool {
        self.0.iter().all(|x| x.is_positive_finite())
    }
    #[inline(always)]
    fn sin_cos(self) -> (Self, Self) {
        let (s, c) = sin_cos_lanes::<N, FUSED>(self.0);
        (Lanes(s), Lanes(c))
    }
    #[inline(always)]
    fn through(self, function: impl Function) -> Self {
        lanes!(k => function.value(self.0[k]))
    }
    #[inline(always)]
    fn through_two(self, second: Self, function: impl FunctionOfTwo) -> Self {
        lanes!(k => function.value(self.0[k], second.0[k]))
    }
    #[inline(always)]
    fn sin_cos_all(angles: &[Self], out: &mut [(Self, Self)]) {
        if N > 1 {
            for (angle, pair) in angles.iter().zip(out) {
                *pair = angle.sin_cos();
            }
            return;
        }
        // A single sample has no lanes of its own: joints stand in for them.
        for (angles, pairs) in angles.chunks(4).zip(out.chunks_mut(4)) {
            let mut four = [0.0; 4];
            for (x, angle) in four.iter_mut().zip(angles) {
                *x = angle.0[0];
            }
            let (s, c) = sin_cos_lanes::<4, FUSED>(four);
            for (pair, (s, c)) in pairs.iter_mut().zip(s.into_iter().zip(c)) {
                *pair = (Lanes([s; N]), Lanes([c; N]));
            }
        }
    }
    #[inline(always)]
    fn mul_add(self, factor: Self, term: Self) -> Self {
        if FUSED { lanes!(k => self.0[k].mul_add(factor.0[k], term.0[k])) } else { self * factor + term }
    }
    #[inline(always)]
    fn mul_sub(self, factor: Self, term: Self) -> Self {
        if FUSED { lanes!(k => self.0[k].mul_add(factor.0[k], -term.0[k])) } else { self * factor - term }
    }
}

impl<const N: usize, const FUSED: bool> Add for Lanes<N, FUSED> {
    type Output = Self;
    #[inline(always)]
    fn add(self, o: Self) -> Self {
        lanes!(k => self.0[k] + o.0[k])
    }
}

impl<const N: usize, const FUSED: bool> Sub for Lanes<N, FUSED> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, o: Self) -> Self {
        lanes!(k => self.0[k] - o.0[k])
    }
}

impl<const N: usize, const FUSED: bool> Mul for Lanes<N, FUSED> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, o: Self) -> Self {
        lanes!(k => self.0[k] * o.0[k])
    }
}

impl<const N: usize, const FUSED: bool> Div for Lanes<N, FUSED> {
    type Output = Self;
    #[inline(always)]
    fn div(self, o: Self) -> Self {
        lanes!(k => self.0[k] / o.0[k])
    }
}

impl<const N: usize, const FUSED: bool> Neg for Lanes<N, FUSED> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        lanes!(k => -self.0[k])
    }
}

impl<const N: usize, const FUSED: bool> AddAssign for Lanes<N, FUSED> {
    #[inline(always)]
    fn add_assign(&mut self, o: Self) {
        *self = *self + o;
    }
}
