//! Bodies that deviate from those of the robot file, and that can still exist.

use dynid_model::Inertia;
use dynid_model::symmetric::{Square, cholesky};

/// Numbers of a deviation.
pub const DEVIATIONS: usize = 10;

/// A body that deviations are counted from.
///
/// With the Cholesky factor `L` of its pseudo-inertia `P₀ = L Lᵀ` (Wensing, Kim & Slotine 2018) the body that deviates by `θ` has `P = L T Tᵀ Lᵀ`, where `T` is lower
/// triangular with `exp θ_ii` on and `θ_ij` below its diagonal: positive definite, a body that can exist, whatever `θ` is. To first order `T Tᵀ = 1 + S` with
/// `S_ii = 2 θ_ii`, `S_ij = θ_ij`, which is the relative deviation of `P` along any axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Body {
    /// Body of the mechanism.
    pub body: usize,
    factor: Square<4>,
}

/// Row and column of a number of a deviation in `T`.
fn place(k: usize) -> (usize, usize) {
    const PLACES: [(usize, usize); DEVIATIONS] =
        [(0, 0), (1, 0), (1, 1), (2, 0), (2, 1), (2, 2), (3, 0), (3, 1), (3, 2), (3, 3)];
    PLACES[k]
}

impl Body {
    /// A body with its inertia about its joint frame; `None` if no body has that inertia.
    pub fn new(body: usize, inertia: &Inertia) -> Option<Self> {
        Some(Body { body, factor: cholesky(&inertia.pseudo_inertia())? })
    }

    /// Standard deviation of number `k` for a body whose mass, and whose second moments along any axes, have a relative standard deviation of
    /// `relative`: the same distribution in all frames.
    pub fn std(k: usize, relative: f64) -> f64 {
        let (i, j) = place(k);
        if i == j { 0.5 * relative } else { relative / 2.0_f64.sqrt() }
    }

    fn deviated(&self, deviation: &[f64; DEVIATIONS]) -> Square<4> {
        let mut t = [[0.0; 4]; 4];
        for (k, x) in deviation.iter().enumerate() {
            let (i, j) = place(k);
            t[i][j] = if i == j { x.exp() } else { *x };
        }
        product(&self.factor, &t)
    }

    /// The inertia of the body that deviates so.
    pub fn inertia(&self, deviation: &[f64; DEVIATIONS]) -> Inertia {
        let lower = self.deviated(deviation);
        Inertia::from_pseudo_inertia(&by_transpose(&lower, &lower))
    }

    /// How an inertia deviates; not finite if no body has it.
    pub fn deviation(&self, inertia: &Inertia) -> [f64; DEVIATIONS] {
        let Some(lower) = cholesky(&inertia.pseudo_inertia()) else { return [f64::NAN; DEVIATIONS] };
        let t = solve_lower(&self.factor, &lower);
        std::array::from_fn(|k| {
            let (i, j) = place(k);
            if i == j { t[i][i].ln() } else { t[i][j] }
        })
    }

    /// Slopes of the standard parameters over the numbers of a deviation: one line per number.
    pub fn slopes(&self, deviation: &[f64; DEVIATIONS]) -> [[f64; DEVIATIONS]; DEVIATIONS] {
        let lower = self.deviated(deviation);
        std::array::from_fn(|k| {
            let (i, j) = place(k);
            let mut t = [[0.0; 4]; 4];
            t[i][j] = if i == j { deviation[k].exp() } else { 1.0 };
            let half = by_transpose(&product(&self.factor, &t), &lower);
            Inertia::from_pseudo_inertia(&std::array::from_fn(|a| {
                std::array::from_fn(|b| half[a][b] + half[b][a])
            }))
            .0
        })
    }
}

fn product(a: &Square<4>, b: &Square<4>) -> Square<4> {
    std::array::from_fn(|i| std::array::from_fn(|j| (0..4).map(|k| a[i][k] * b[k][j]).sum()))
}

fn by_transpose(a: &Square<4>, b: &Square<4>) -> Square<4> {
    std::array::from_fn(|i| std::array::from_fn(|j| (0..4).map(|k| a[i][k] * b[j][k]).sum()))
}

fn solve_lower(l: &Square<4>, b: &Square<4>) -> Square<4> {
    let mut x = *b;
    for j in 0..4 {
        for i in 0..4 {
            let known: f64 = (0..i).map(|k| l[i][k] * x[k][j]).sum();
            x[i][j] = (b[i][j] - known) / l[i][i];
        }
    }
    x
}

#[cfg(test)]
mod tests {
    use dynid_model::{Mat3, Vec3};

    use super::*;

    const FAR: [f64; DEVIATIONS] = [0.2, -0.3, 0.1, 0.05, 0.4, -0.2, 0.1, -0.1, 0.3, 0.15];

    fn link() -> Inertia {
        let tensor = Mat3::from_rows([[0.02, 0.001, 0.0], [0.001, 0.03, -0.002], [0.0, -0.002, 0.025]]);
        Inertia::from_com(2.0, Vec3([0.05, -0.02, 0.2]), &tensor)
    }

    #[test]
    fn deviations_there_and_back_make_bodies_that_can_exist() {
        let body = Body::new(0, &link()).unwrap();
        for (a, b) in body.inertia(&[0.0; DEVIATIONS]).0.iter().zip(link().0) {
            assert!((a - b).abs() < 1e-15);
        }
        let inertia = body.inertia(&FAR);
        assert!(inertia.physical_fault().is_none());
        for (a, b) in body.deviation(&inertia).iter().zip(FAR) {
            assert!((a - b).abs() < 1e-12);
        }
        assert!(Body::new(0, &Inertia::default()).is_none());
    }

    #[test]
    fn slopes_are_those_of_differences() {
        let body = Body::new(0, &link()).unwrap();
        let slopes = body.slopes(&FAR);
        for k in 0..DEVIATIONS {
            let at = |side: f64| {
                let mut x = FAR;
                x[k] += side * 1e-6;
                body.inertia(&x).0
            };
            for ((slope, up), down) in slopes[k].iter().zip(at(1.0)).zip(at(-1.0)) {
                assert!((slope - (up - down) / 2e-6).abs() < 1e-9);
            }
        }
    }

    #[test]
    fn masses_scatter_by_what_is_asked() {
        let body = Body::new(0, &link()).unwrap();
        let slopes = body.slopes(&[0.0; DEVIATIONS]);
        // Mass, and a second moment along an axis that is none of the frame's.
        let along = |phi: &[f64; DEVIATIONS]| {
            let p = Inertia(*phi).pseudo_inertia();
            let a = [0.3, -0.8, 0.5, 0.1];
            (0..4).map(|i| (0..4).map(|j| a[i] * p[i][j] * a[j]).sum::<f64>()).sum::<f64>()
        };
        let std = |of: &dyn Fn(&[f64; DEVIATIONS]) -> f64| {
            let parts = (0..DEVIATIONS).map(|k| (of(&slopes[k]) * Body::std(k, 0.3)).powi(2));
            parts.sum::<f64>().sqrt()
        };
        let phi = link().0;
        assert!((std(&|x| x[0]) / phi[0] - 0.3).abs() < 1e-12);
        assert!((std(&along) / along(&phi) - 0.3).abs() < 1e-12);
    }
}
