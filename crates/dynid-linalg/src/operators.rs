//! Products, sums and multiples of matrices.

use std::ops::{Add, AddAssign, Mul, MulAssign, Sub, SubAssign};

use crate::{AsView, Mat, View};
use faer::Scale;

macro_rules! operators {
    ($($of:ty),*) => {$(
        impl<R: AsView> Mul<R> for $of {
            type Output = Mat;

            fn mul(self, other: R) -> Mat {
                Mat(self.view().0 * other.view().0)
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
                Mat(self.view().0 + other.view().0)
            }
        }

        impl<R: AsView> Sub<R> for $of {
            type Output = Mat;

            fn sub(self, other: R) -> Mat {
                Mat(self.view().0 - other.view().0)
            }
        }
    )*};
}

operators!(Mat, &Mat, View<'_>);

impl<R: AsView> AddAssign<R> for Mat {
    fn add_assign(&mut self, other: R) {
        self.0 += other.view().0;
    }
}

impl<R: AsView> SubAssign<R> for Mat {
    fn sub_assign(&mut self, other: R) {
        self.0 -= other.view().0;
    }
}

impl MulAssign<f64> for Mat {
    fn mul_assign(&mut self, factor: f64) {
        self.0 *= Scale(factor);
    }
}
