//! Residuals of closures, their Jacobian and bias.

use super::closure::{ClosureDescription, Condition, CutKind, LinkFrame};
use super::error::ClosedError;
use super::sweep::{World, WorldBody};
use crate::dynamics::tree::Tree;
use crate::mechanism::Mechanism;
use dynid_algebra::scalar::Scalar;
use dynid_algebra::spatial::{Mat3, Vec3};

/// What one row demands.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Row {
    /// `e_a · d`.
    Translation(usize),
    /// `e_a · f_b`: numbers of the axes.
    Orientation(usize, usize),
    /// `(d·d - L²) / (2 L)`.
    Distance(f64),
}

fn rows_of(kind: CutKind) -> Vec<Row> {
    use Row::{Distance, Orientation, Translation};
    const X: usize = 0;
    const Y: usize = 1;
    const Z: usize = 2;
    let point = [X, Y, Z].map(Translation);
    let (mut rows, orientations): (Vec<Row>, &[(usize, usize)]) = match kind {
        CutKind::Spherical => (point.to_vec(), &[]),
        CutKind::PlanarRevolute => (point[..2].to_vec(), &[]),
        CutKind::Revolute => (point.to_vec(), &[(X, Z), (Y, Z)]),
        CutKind::Universal => (point.to_vec(), &[(X, Y)]),
        CutKind::Cylindrical => (point[..2].to_vec(), &[(X, Z), (Y, Z)]),
        CutKind::Prismatic => (point[..2].to_vec(), &[(X, Y), (Y, Z), (Z, X)]),
        CutKind::PlanarPrismatic => (vec![Translation(Y)], &[(X, Y)]),
        CutKind::Fixed => (point.to_vec(), &[(X, Y), (Y, Z), (Z, X)]),
        CutKind::Distance { length } => (vec![Distance(length)], &[]),
    };
    rows.extend(orientations.iter().map(|(a, b)| Orientation(*a, *b)));
    rows
}

/// Pairs of axes that must not be flipped while all residuals are zero.
fn aligned_axes(kind: CutKind) -> &'static [usize] {
    match kind {
        CutKind::Revolute | CutKind::Cylindrical => &[2],
        CutKind::Prismatic | CutKind::Fixed => &[0, 1, 2],
        _ => &[],
    }
}

/// A frame that moves with a node, in the node's internal axes.
#[derive(Clone, Copy, Debug)]
struct NodeFrame {
    node: Option<usize>,
    rotation: Mat3<f64>,
    origin: Vec3<f64>,
}

/// A frame of a closure in base axes.
struct WorldFrame<S> {
    axes: Mat3<S>,
    origin: Vec3<S>,
}

impl NodeFrame {
    fn new(tree: &Tree, mechanism: &Mechanism, frame: &LinkFrame) -> Result<Self, ClosedError> {
        let carrier = mechanism.frame(&frame.link)?;
        let at = carrier.placement.then(&frame.placement);
        let Some(node) = carrier.body.and_then(|b| tree.nodes.iter().position(|n| n.body == b)) else {
            return Ok(NodeFrame { node: None, rotation: at.rotation, origin: at.translation });
        };
        let axes = tree.nodes[node].axes;
        let renamed = |v: Vec3<f64>| Vec3(axes.map(|k| v.0[k]));
        Ok(NodeFrame {
            node: Some(node),
            rotation: Mat3(at.rotation.0.map(renamed)),
            origin: renamed(at.translation),
        })
    }

    #[inline(always)]
    fn body<S: Scalar>(&self, world: &World<S>) -> WorldBody<S> {
        self.node.map_or_else(WorldBody::ground, |k| world.bodies[k])
    }

    #[inline(always)]
    fn place<S: Scalar>(&self, body: &WorldBody<S>) -> WorldFrame<S> {
        WorldFrame {
            axes: body.rotation.mul_mat(&Mat3::constant(&self.rotation)),
            origin: body.rotation.mul_vec(Vec3::constant(self.origin.0)) + body.origin,
        }
    }
}

/// A coordinate that moves one side of a closure and not the other.
#[derive(Clone, Copy, Debug)]
struct Mover {
    rate: usize,
    /// Whether the rate moves `b`; otherwise it moves `a`.
    moves_b: bool,
}

#[derive(Clone, Debug)]
#[expect(clippy::large_enum_variant, reason = "a mechanism has few closures, nearly all of them joints")]
enum Cut {
    Joint {
        kind: CutKind,
        rows: Vec<Row>,
        a: NodeFrame,
        b: NodeFrame,
        movers: Vec<Mover>,
    },
    /// `(position, rate, factor)`.
    Coordinates {
        terms: Vec<(usize, usize, f64)>,
        constant: f64,
    },
}

/// All closures of a mechanism, compiled.
#[derive(Clone, Debug)]
pub(super) struct Rows {
    cuts: Vec<Cut>,
    /// For every row: its closure.
    pub(super) owner: Vec<usize>,
    /// For every row: whether it is about angles.
    pub(super) angular: Vec<bool>,
    rates: usize,
}

/// A wrench, about the base's origin, that closures exert on a body, base axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct WorldWrench {
    pub(super) force: Vec3<f64>,
    pub(super) moment: Vec3<f64>,
}

impl Rows {
    pub(super) fn new(
        tree: &Tree,
        mechanism: &Mechanism,
        closures: &[ClosureDescription],
    ) -> Result<Rows, ClosedError> {
        let mut rows = Rows { cuts: Vec::new(), owner: Vec::new(), angular: Vec::new(), rates: tree.rates };
        for (index, closure) in closures.iter().enumerate() {
            let name = || closure.name.clone();
            if closures[..index].iter().any(|c| c.name == closure.name) {
                return Err(ClosedError::Duplicate { closure: name() });
            }
            let cut = match &closure.condition {
                Condition::Joint { kind, a, b } => {
                    let joint = cut_joint(tree, mechanism, &closure.name, (*kind, a, b))?;
                    if let Cut::Joint { rows: own, .. } = &joint {
                        rows.angular.extend(own.iter().map(|r| matches!(r, Row::Orientation(..))));
                    }
                    joint
                }
                Condition::Coordinates { terms, constant } => {
                    rows.angular.push(false);
                    coordinates(mechanism, &closure.name, terms, *constant)?
                }
            };
            rows.owner.resize(rows.angular.len(), index);
            rows.cuts.push(cut);
        }
        Ok(rows)
    }

    pub(super) fn len(&self) -> usize {
        self.owner.len()
    }

    /// Residuals and, row-major, their Jacobian by the rates, at positions `q` that `world` was placed at.
    pub(super) fn evaluate<S: Scalar>(
        &self,
        world: &World<S>,
        q: &[S],
        residual: &mut [S],
        jacobian: &mut [S],
    ) {
        jacobian.fill(S::zero());
        let n = self.rates;
        let mut first = 0;
        for cut in &self.cuts {
            match cut {
                Cut::Joint { rows, a, b, movers, .. } => {
                    let (a, b) = (a.place(&a.body(world)), b.place(&b.body(world)));
                    let d = b.origin - a.origin;
                    for (k, row) in rows.iter().enumerate() {
                        residual[first + k] = row.residual(&a, &b, d);
                    }
                    for mover in movers {
                        let screw = &world.screws[mover.rate];
                        let sign = S::from_f64(if mover.moves_b { 1.0 } else { -1.0 });
                        let at_b = screw.at(b.origin);
                        for (k, row) in rows.iter().enumerate() {
                            let entry = match row {
                                Row::Translation(axis) => a.axes.0[*axis].dot(at_b),
                                Row::Orientation(e, f) => b.axes.0[*f].cross(a.axes.0[*e]).dot(screw.turn),
                                Row::Distance(length) => {
                                    let at = if mover.moves_b { at_b } else { screw.at(a.origin) };
                                    d.dot(at) * S::from_f64(1.0 / length)
                                }
                            };
                            jacobian[(first + k) * n + mover.rate] = entry * sign;
                        }
                    }
                    first += rows.len();
                }
                Cut::Coordinates { terms, constant } => {
                    let mut sum = S::from_f64(-constant);
                    for (position, rate, factor) in terms {
                        sum += q[*position] * S::from_f64(*factor);
                        jacobian[first * n + rate] += S::from_f64(*factor);
                    }
                    residual[first] = sum;
                    first += 1;
                }
            }
        }
    }

    /// What remains of the second derivative of the residuals while no coordinate accelerates, after
    /// [`World::drift`].
    pub(super) fn bias<S: Scalar>(&self, world: &World<S>, bias: &mut [S]) {
        let two = S::from_f64(2.0);
        let mut first = 0;
        for cut in &self.cuts {
            let Cut::Joint { rows, a, b, .. } = cut else {
                bias[first] = S::zero();
                first += 1;
                continue;
            };
            let (on_a, on_b) = (a.body(world), b.body(world));
            let (a, b) = (a.place(&on_a), b.place(&on_b));
            let d = b.origin - a.origin;
            for (k, row) in rows.iter().enumerate() {
                bias[first + k] = match row {
                    Row::Translation(axis) => {
                        let relative = on_b.velocity_at(b.origin) - on_a.velocity_at(b.origin);
                        let coriolis = on_a.omega.cross(relative).scale(two);
                        let acceleration =
                            on_b.acceleration_at(b.origin) - on_a.acceleration_at(b.origin) - coriolis;
                        a.axes.0[*axis].dot(acceleration)
                    }
                    Row::Orientation(e, f) => {
                        let (e, f) = (a.axes.0[*e], b.axes.0[*f]);
                        let turning = on_b.omega.cross(f).cross(e) + f.cross(on_a.omega.cross(e));
                        f.cross(e).dot(on_b.alpha - on_a.alpha) + (on_b.omega - on_a.omega).dot(turning)
                    }
                    Row::Distance(length) => {
                        let relative = on_b.velocity_at(b.origin) - on_a.velocity_at(a.origin);
                        let acceleration = on_b.acceleration_at(b.origin) - on_a.acceleration_at(a.origin);
                        (d.dot(acceleration) + relative.dot(relative)) * S::from_f64(1.0 / length)
                    }
                };
            }
            first += rows.len();
        }
    }

    /// Closures in which an axis points the wrong way although all residuals are zero.
    pub(super) fn flipped(&self, world: &World<f64>) -> Option<usize> {
        self.cuts.iter().position(|cut| match cut {
            Cut::Joint { kind, a, b, .. } => {
                let (a, b) = (a.place(&a.body(world)), b.place(&b.body(world)));
                aligned_axes(*kind).iter().any(|k| a.axes.0[*k].dot(b.axes.0[*k]) < 0.0)
            }
            Cut::Coordinates { .. } => false,
        })
    }

    /// Calls `put(node, wrench, sign)` for a unit multiplier of a row: the wrench on `b`'s node with sign 1, on `a`'s
    /// with -1. Rows that couple coordinates act on no body.
    pub(super) fn wrenches(
        &self,
        world: &World<f64>,
        row: usize,
        mut put: impl FnMut(usize, WorldWrench, f64),
    ) {
        let cut = self.owner[row];
        let first = self.owner.partition_point(|o| *o < cut);
        let Cut::Joint { rows, a, b, .. } = &self.cuts[cut] else { return };
        let nodes = [(b.node, 1.0), (a.node, -1.0)];
        let (a, b) = (a.place(&a.body(world)), b.place(&b.body(world)));
        let wrench = |side: f64| match rows[row - first] {
            Row::Translation(axis) => {
                let force = a.axes.0[axis];
                WorldWrench { force, moment: b.origin.cross(force) }
            }
            Row::Orientation(e, f) => {
                WorldWrench { force: Vec3::zero(), moment: b.axes.0[f].cross(a.axes.0[e]) }
            }
            Row::Distance(length) => {
                let force = (b.origin - a.origin).scale(1.0 / length);
                let at = if side > 0.0 { b.origin } else { a.origin };
                WorldWrench { force, moment: at.cross(force) }
            }
        };
        for (node, side) in nodes {
            if let Some(node) = node {
                put(node, wrench(side), side);
            }
        }
    }
}

impl Row {
    #[inline(always)]
    fn residual<S: Scalar>(&self, a: &WorldFrame<S>, b: &WorldFrame<S>, d: Vec3<S>) -> S {
        match self {
            Row::Translation(axis) => a.axes.0[*axis].dot(d),
            Row::Orientation(e, f) => a.axes.0[*e].dot(b.axes.0[*f]),
            Row::Distance(length) => (d.dot(d) - S::from_f64(length * length)) * S::from_f64(0.5 / length),
        }
    }
}

fn cut_joint(
    tree: &Tree,
    mechanism: &Mechanism,
    name: &str,
    (kind, a, b): (CutKind, &LinkFrame, &LinkFrame),
) -> Result<Cut, ClosedError> {
    if let CutKind::Distance { length } = kind
        && !(length.is_finite() && length > 0.0)
    {
        return Err(ClosedError::Length { closure: name.to_owned(), found: length });
    }
    if !(a.placement.is_finite() && b.placement.is_finite()) {
        return Err(ClosedError::NotFinite { closure: name.to_owned() });
    }
    let (links, a, b) =
        ([&a.link, &b.link], NodeFrame::new(tree, mechanism, a)?, NodeFrame::new(tree, mechanism, b)?);
    if a.node == b.node {
        let [a, b] = links.map(String::clone);
        return Err(ClosedError::SameBody { closure: name.to_owned(), a, b });
    }
    let ancestors = |mut node: Option<usize>| {
        let mut out = Vec::new();
        while let Some(k) = node {
            out.push(k);
            node = tree.nodes[k].parent;
        }
        out
    };
    let (above_a, above_b) = (ancestors(a.node), ancestors(b.node));
    let one_sided = |of: &[usize], other: &[usize], moves_b: bool| -> Vec<Mover> {
        of.iter()
            .filter(|k| !other.contains(k))
            .flat_map(|k| {
                let node = &tree.nodes[*k];
                (node.rate..node.rate + node.rates).map(move |rate| Mover { rate, moves_b })
            })
            .collect()
    };
    let mut movers = one_sided(&above_b, &above_a, true);
    movers.extend(one_sided(&above_a, &above_b, false));
    Ok(Cut::Joint { kind, rows: rows_of(kind), a, b, movers })
}

fn coordinates(
    mechanism: &Mechanism,
    name: &str,
    terms: &[(String, f64)],
    constant: f64,
) -> Result<Cut, ClosedError> {
    if !constant.is_finite() || terms.iter().any(|(_, f)| !f.is_finite()) {
        return Err(ClosedError::NotFinite { closure: name.to_owned() });
    }
    if terms.iter().all(|(_, factor)| *factor == 0.0) {
        return Err(ClosedError::NoTerms { closure: name.to_owned() });
    }
    let mut compiled = Vec::with_capacity(terms.len());
    for (joint, factor) in terms {
        let body = &mechanism.bodies()[mechanism.joint_index(joint)?];
        if body.joint.rates() != 1 {
            return Err(ClosedError::FloatingTerm { closure: name.to_owned(), joint: joint.clone() });
        }
        compiled.push((body.position, body.rate, *factor));
    }
    Ok(Cut::Coordinates { terms: compiled, constant })
}

#[cfg(test)]
mod tests;
