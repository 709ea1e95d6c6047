//! Steps from pose to pose.

/// How far the last step led off its tangent: along a smooth path the next one does the same.
#[derive(Clone, Debug)]
pub(super) struct Bend {
    /// The step of the independent coordinates.
    pub(super) by: Vec<f64>,
    /// What was added to the step of the dependent coordinates along the tangent.
    pub(super) sum: Vec<f64>,
    /// Squared length of the step; `None` while there is none.
    pub(super) known: Option<f64>,
}

impl Bend {
    /// Square of how many times as long as the last step the next one is, if it goes on the same way.
    pub(super) fn ratio(&self, next: impl Iterator<Item = f64> + Clone) -> Option<f64> {
        let squared = self.known?;
        let along = next.clone().zip(&self.by).map(|(a, b)| a * b).sum::<f64>() / squared;
        let off: f64 = next.zip(&self.by).map(|(a, b)| (a - along * b).powi(2)).sum();
        ((0.3..3.0).contains(&along) && off < 0.1 * squared).then_some(along * along)
    }
}

/// Moves a floating joint by body rates over a unit of time; the quaternion stays of length one.
pub(super) fn float(q: &mut [f64], rates: &[f64; 6]) {
    let [x, y, z, w] = [q[3], q[4], q[5], q[6]];
    let rotate = |v: [f64; 3]| {
        let cross = |a: [f64; 3], b: [f64; 3]| {
            [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
        };
        let t = cross([x, y, z], v).map(|c| 2.0 * c);
        let u = cross([x, y, z], t);
        [v[0] + w * t[0] + u[0], v[1] + w * t[1] + u[1], v[2] + w * t[2] + u[2]]
    };
    let moved = rotate([rates[0], rates[1], rates[2]]);
    q.iter_mut().zip(moved).for_each(|(q, m)| *q += m);
    let turn = [rates[3], rates[4], rates[5]];
    let angle = turn.iter().map(|t| t * t).sum::<f64>().sqrt();
    // sin(a/2)/a, by its series near zero.
    let half = if angle > 1e-4 { (0.5 * angle).sin() / angle } else { 0.5 - angle * angle / 48.0 };
    let ([a, b, c], d) = (turn.map(|t| t * half), (0.5 * angle).cos());
    let product = [
        w * a + x * d + y * c - z * b,
        w * b - x * c + y * d + z * a,
        w * c + x * b - y * a + z * d,
        w * d - x * a - y * b - z * c,
    ];
    let norm = product.iter().map(|p| p * p).sum::<f64>().sqrt();
    q[3..].iter_mut().zip(product).for_each(|(q, p)| *q = p / norm);
}
