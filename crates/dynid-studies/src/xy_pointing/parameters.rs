//! The paper's parameters and what a model that is linear sees of them.

use dynid::model::inertia::PARAMETERS_PER_BODY;
use dynid::model::{Inertia, Mat3, Mechanism, Vec3};

use super::{JOINTS, fault};
use crate::StudyError;

/// Parameters of the paper.
pub(super) const PARAMETERS: usize = 11;
/// Names of the parameters.
pub(super) const NAMES: [&str; PARAMETERS] =
    ["Ixx2", "Ixy2", "Ixz2", "Iyy2", "Iyz2", "Izz2", "m2", "Ls2", "Izz1", "Ls1", "m1"];
/// Combinations of them that ideal joints show.
pub(super) const BASE: usize = 8;
/// Standard parameters of the base ones as [`dynid::model::BaseParameters`] keeps them, with the rest folded in.
pub(super) const KEPT: [&str; BASE] = ["Izz1", "Ixx2", "Ixy2", "Ixz2", "Iyz2", "Izz2", "mx2", "mx1"];
/// Standard parameters of both links, those of link 1 first.
pub(super) const STANDARD: usize = JOINTS * PARAMETERS_PER_BODY;

/// Standard parameters whose columns add up to the columns of
/// `θ = [Ixx2, Ixy2, Ixz2, Iyy2, Iyz2, Izz2, m2, m2 Ls2, m2 Ls2², Izz1 + m1 Ls1², m1 Ls1]`: `W_θ = W T` with ones here.
pub(super) const THETA: [&[usize]; PARAMETERS] =
    [&[14], &[15], &[16], &[17], &[18], &[19], &[10], &[11], &[17, 19], &[9], &[1]];

/// Entries of `θ` whose columns stand for the base parameters, in the order of [`KEPT`].
pub(super) const BASE_COLUMNS: [usize; BASE] = [9, 0, 1, 2, 4, 5, 7, 10];

/// Entries `m2`, `Izz1 + m1 Ls1²` and `m1 Ls1` of `θ`.
pub(super) const MASS_2: usize = 6;
pub(super) const INERTIA_1: usize = 9;
pub(super) const MOMENT_1: usize = 10;

/// Values in the paper's order, see [`NAMES`]: inertias about centres of mass, which lie on the axes X of the links.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Parameters(pub(super) [f64; PARAMETERS]);

impl Parameters {
    /// Parameters of a mechanism.
    pub(super) fn of(mechanism: &Mechanism) -> Result<Self, StudyError> {
        let link = |k: usize| {
            let body =
                mechanism.bodies().get(k).and_then(|b| Some((b.inertia.mass(), b.inertia.about_com()?)));
            body.ok_or_else(|| fault("two links with mass expected"))
        };
        let ((m1, (c1, i1)), (m2, (c2, i2))) = (link(0)?, link(1)?);
        let (i1, i2) = (i1.rows(), i2.rows());
        Ok(Parameters([
            i2[0][0], i2[0][1], i2[0][2], i2[1][1], i2[1][2], i2[2][2], m2, c2.0[0], i1[2][2], c1.0[0], m1,
        ]))
    }

    /// Standard parameters of both links about their joint frames. Of link 1 only what acts has a meaning.
    pub(super) fn standard(&self) -> [Inertia; JOINTS] {
        let [xx, xy, xz, yy, yz, zz, m2, l2, izz1, l1, m1] = self.0;
        let along = |x| Vec3([x, 0.0, 0.0]);
        let second = Mat3::from_rows([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]);
        let first = Mat3::from_rows([[0.0; 3], [0.0; 3], [0.0, 0.0, izz1]]);
        [Inertia::from_com(m1, along(l1), &first), Inertia::from_com(m2, along(l2), &second)]
    }

    /// Combinations that act linearly, see [`THETA`].
    pub(super) fn theta(&self) -> [f64; PARAMETERS] {
        let [xx, xy, xz, yy, yz, zz, m2, l2, izz1, l1, m1] = self.0;
        [xx, xy, xz, yy, yz, zz, m2, m2 * l2, m2 * l2 * l2, izz1 + m1 * l1 * l1, m1 * l1]
    }

    /// `∂θ/∂p`, row by row.
    pub(super) fn theta_jacobian(&self) -> [[f64; PARAMETERS]; PARAMETERS] {
        let [.., m2, l2, _, l1, m1] = self.0;
        let mut rows = [[0.0; PARAMETERS]; PARAMETERS];
        for (k, row) in rows.iter_mut().enumerate().take(7) {
            row[k] = 1.0;
        }
        (rows[7][6], rows[7][7]) = (l2, m2);
        (rows[8][6], rows[8][7]) = (l2 * l2, 2.0 * m2 * l2);
        (rows[9][8], rows[9][9], rows[9][10]) = (1.0, 2.0 * m1 * l1, l1 * l1);
        (rows[10][9], rows[10][10]) = (m1, l1);
        rows
    }

    /// What ideal joints show, in the order of [`KEPT`]; `length`: from axis 1 to axis 2, m.
    pub(super) fn base(&self, length: f64) -> [f64; BASE] {
        let [xx, xy, xz, yy, yz, zz, m2, l2, izz1, l1, m1] = self.0;
        let second = m2 * l2 * l2;
        [
            izz1 + m1 * l1 * l1 + m2 * length * length + yy + second,
            xx - yy - second,
            xy,
            xz,
            yz,
            zz + second,
            m2 * l2,
            m1 * l1 + m2 * length,
        ]
    }
}
