//! Products, sums and multiples of matrices.

use std::ops::{Add, AddAssign, Mul, MulAssign, Sub, SubAssign};

use crate::{AsView, Mat, View};
use faer::Scale;

macro_rules! operators {
    ($($of:ty),*) => {$(
        impl<R: AsView> Mul<R> for $of {
            type Output = Mat;

            fn mul(self, other: R) -> Mat {
                product(self.view(), other.view())
            }
        }

        impl Mul<f64> for $of {
            type Output = Mat;

            fn mul(self, factor: f64) -> Mat {
                Mat(self.view().0 * Scale(factor))
            }
        }

        impl<R: AsView> Add<R> for $of {
            type Output = Mat;

            fn add(self, other: R) -> Mat {
                sum(self.view(), other.view())
            }
        }

        impl<R: AsView> Sub<R> for $of {
            type Output = Mat;

            fn sub(self, other: R) -> Mat {
                difference(self.view(), other.view())
            }
        }
    )*};
}

operators!(Mat, &Mat, View<'_>);

fn product(a: View<'_>, b: View<'_>) -> Mat {
    Mat(a.0 * b.0)
}

fn sum(a: View<'_>, b: View<'_>) -> Mat {
    Mat(a.0 + b.0)
}

fn difference(a: View<'_>, b: View<'_>) -> Mat {
    Mat(a.0 - b.0)
}

fn add(to: &mut Mat, other: View<'_>) {
    to.0 += other.0;
}

fn subtract(from: &mut Mat, other: View<'_>) {
    from.0 -= other.0;
}

impl<R: AsView> AddAssign<R> for Mat {
    fn add_assign(&mut self, other: R) {
        add(self, other.view());
    }
}

impl<R: AsView> SubAssign<R> for Mat {
    fn sub_assign(&mut self, other: R) {
        subtract(self, other.view());
    }
}

impl MulAssign<f64> for Mat {
    fn mul_assign(&mut self, factor: f64) {
        self.0 *= Scale(factor);
    }
}
