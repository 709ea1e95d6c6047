//! The mechanism in the form that the recursions read: constants per body, parents first.
//!
//! Joints that turn about a coordinate axis of their frame (nearly all of them) are described in frames whose axes are
//! renamed so that the joint turns about z. Renaming is exact and is undone where parameters enter and leave.

use crate::description::JointKind;
use crate::mechanism::Mechanism;
use dynid_algebra::spatial::{Mat3, Vec3};

/// How a body moves relative to its parent, in internal axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Motion {
    /// Turns about internal +z by `sign · q`.
    RevoluteZ {
        /// 1, or -1 where renaming turned the axis round.
        sign: f64,
    },
    /// Turns about a general axis.
    Revolute,
    /// Slides along the axis.
    Prismatic,
    /// Turns about and slides along the axis.
    Helical {
        /// Travel per angle, m/rad.
        pitch: f64,
    },
    /// Moves freely.
    Floating,
}

/// One body.
#[derive(Clone, Debug)]
pub struct Node {
    /// Index of the parent node.
    pub parent: Option<usize>,
    /// How it moves relative to its parent.
    pub motion: Motion,
    /// Rotation parent ← body at position zero.
    pub fixed: Mat3<f64>,
    /// `fixed` minus its part along the axis, and `fixed` times the cross-product matrix of the axis.
    pub around: [Mat3<f64>; 3],
    /// Origin in parent axes at position zero.
    pub origin: Vec3<f64>,
    /// Unit axis.
    pub axis: Vec3<f64>,
    /// First of its positions.
    pub position: usize,
    /// First of its rates.
    pub rate: usize,
    /// Number of its rates.
    pub rates: usize,
    /// Body index in file order.
    pub body: usize,
    /// Internal parameter → parameter of the file's frame.
    pub columns: [usize; 10],
    /// Internal axis → axis of the file's frame.
    pub axes: [usize; 3],
    /// Place of its angle in [`Tree::turns`], if it turns by one.
    pub turn: usize,
    /// First carried axis in the workspace; ancestors' rates from the root on, own rates last.
    pub first_axis: usize,
    /// Number of rates of all ancestors.
    pub inherited: usize,
}

/// All bodies, parents first.
#[derive(Clone, Debug)]
pub struct Tree {
    /// Bodies.
    pub nodes: Vec<Node>,
    /// Number of rates.
    pub rates: usize,
    /// Number of positions.
    pub positions: usize,
    /// For each carried axis of each node: the joint rate that it belongs to.
    pub axis_rate: Vec<usize>,
    /// Position entry and sign of every angle.
    pub turns: Vec<(usize, f64)>,
}

impl Node {
    /// Places of the axes that this node carries: ancestors' first, own last.
    pub fn carried(&self) -> std::ops::Range<usize> {
        self.first_axis..self.first_axis + self.inherited + self.rates
    }
}

impl Tree {
    /// The tree of a mechanism.
    pub fn new(mechanism: &Mechanism) -> Self {
        let bodies = mechanism.bodies();
        let mut node_of_body = vec![usize::MAX; bodies.len()];
        let mut nodes: Vec<Node> = Vec::with_capacity(bodies.len());
        let mut axis_rate = Vec::new();
        let mut turns = Vec::new();
        for &b in mechanism.sweep() {
            let body = &bodies[b];
            let joint = &body.joint;
            let parent = body.parent.map(|p| node_of_body[p]);
            // A component of 1e-8 beside 1 is lost in the length, and turns bodies all the same.
            let alone = |k: usize| (0..3).all(|i| i == k || joint.axis.0[i] == 0.0);
            let aligned = (joint.kind == JointKind::Revolute || joint.kind == JointKind::Continuous)
                .then(|| (0..3).find(|k| joint.axis.0[*k].abs() == 1.0 && alone(*k)))
                .flatten();
            let axes = aligned.map_or([0, 1, 2], |k| [(k + 1) % 3, (k + 2) % 3, k]);
            let parent_axes = parent.map_or([0, 1, 2], |p| nodes[p].axes);
            let motion = match (joint.kind, aligned) {
                (_, Some(k)) => Motion::RevoluteZ { sign: joint.axis.0[k] },
                (JointKind::Revolute | JointKind::Continuous, None) => Motion::Revolute,
                (JointKind::Prismatic, _) => Motion::Prismatic,
                (JointKind::Helical { pitch }, _) => Motion::Helical { pitch },
                (JointKind::Floating, _) => Motion::Floating,
                (JointKind::Fixed, _) => unreachable!("fixed joints are merged when a mechanism is built"),
            };
            let rows = joint.placement.rotation.rows();
            let fixed = Mat3::from_rows(parent_axes.map(|r| axes.map(|c| rows[r][c])));
            let origin = Vec3(parent_axes.map(|r| joint.placement.translation.0[r]));
            let axis = Vec3(axes.map(|k| joint.axis.0[k]));
            let along = Mat3::outer(fixed.mul_vec(axis), axis);
            let first_axis = axis_rate.len();
            if let Some(p) = parent {
                let parent: &Node = &nodes[p];
                axis_rate.extend_from_within(
                    parent.first_axis..parent.first_axis + parent.inherited + parent.rates,
                );
            }
            let inherited = axis_rate.len() - first_axis;
            axis_rate.extend(body.rate..body.rate + joint.rates());
            node_of_body[b] = nodes.len();
            let turn = turns.len();
            match motion {
                Motion::RevoluteZ { sign } => turns.push((body.position, sign)),
                Motion::Revolute | Motion::Helical { .. } => turns.push((body.position, 1.0)),
                Motion::Prismatic | Motion::Floating => {}
            }
            nodes.push(Node {
                parent,
                motion,
                fixed,
                around: [along, fixed + along * -1.0, fixed.mul_mat(&Mat3::skew(axis))],
                origin,
                axis,
                position: body.position,
                rate: body.rate,
                rates: joint.rates(),
                body: b,
                columns: renamed_columns(axes),
                axes,
                turn,
                first_axis,
                inherited,
            });
        }
        Tree {
            nodes,
            rates: mechanism.joint_rates(),
            positions: mechanism.joint_positions(),
            axis_rate,
            turns,
        }
    }
}

fn renamed_columns(axes: [usize; 3]) -> [usize; 10] {
    const TENSOR: [[usize; 3]; 3] = [[4, 5, 6], [5, 7, 8], [6, 8, 9]];
    let [x, y, z] = axes;
    [
        0,
        1 + x,
        1 + y,
        1 + z,
        TENSOR[x][x],
        TENSOR[x][y],
        TENSOR[x][z],
        TENSOR[y][y],
        TENSOR[y][z],
        TENSOR[z][z],
    ]
}
