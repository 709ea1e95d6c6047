//! A journal in its bearing: contact and friction of a joint with clearance.

use super::{ElementColumns, ElementWeights, JointElement, JointInfo};
use crate::dynamics::{MotionAdjoint, MotionBlock};
use crate::parameter::{Owner, Parameter};
use dynid_contact::{ContactLaw, SlidingFriction};

/// Name of the signal that holds the normal speed at the start of the contact of a joint, m/s.
pub fn impact_speed_signal(joint: &str) -> String {
    format!("impact_speed_{joint}")
}

/// Contact of the journal of a revolute joint with its bearing, on the rates of a
/// [clearance](crate::Description::with_clearance): two translations `p` of the journal's centre in bearing axes and the
/// rotation `q`.
///
/// ```text
/// r = |p|, n = p/r, t = (-n_y, n_x)            n = (1, 0) where p = 0
/// penetration   δ  = r - c,  δ̇ = ṗ·n           in contact iff δ > 0
/// sliding speed v_t = ṗ·t + q̇ R2
/// normal force  F_n = K E(δ) + D B(δ; v0) δ̇     where E + B δ̇ > 0, else 0
/// friction      F_t = -mu c_d(v_t) (E + B δ̇)    there, else 0
/// journal feels F  = -F_n n + F_t t,  and the moment F_t R2 about its centre
/// ```
///
/// `E` and `B` are the elastic force and the damping of the [`ContactLaw`], `c_d` the direction of [`SlidingFriction`].
/// Efforts of drives: translations are not driven, `0 = rigid bodies - F`; the drive of the rotation has the friction
/// moment `-F_t R2` to overcome. With `p = R(q) e` and `e` in axes that turn with the journal's link, `ṗ = R (ė + q̇ × e)`.
///
/// Linear parameters: factors `<joint>.contact_stiffness` (`K`) and `<joint>.contact_damping` (`D`) of the law, 1 where it
/// holds, and the friction coefficient `<joint>.mu` (with the normal force as the law states it), all from 0 on and without
/// unit. The speed `v0` at the start of a contact is a signal; where it is missing, the law's floor stands in.
///
/// Degenerate: where the load does not change, nor the penetration, `K` cannot be told from the clearance. Stiff: forces
/// grow by 1e7 N/m. Sources: Sun, Han, Li & Li 2021, Eqs. 1 to 30, as written in the chapter *Joints with clearance* of the book; Ambrósio 2003 for `c_d`.
#[derive(Debug, Clone)]
pub struct ClearanceContact {
    /// Rate of the rotation.
    pub rotation: usize,
    /// Rates of the two translations.
    pub translations: [usize; 2],
    /// Law of the normal force.
    pub law: ContactLaw,
    /// Friction; its coefficient is the prior of `mu`.
    pub friction: SlidingFriction,
    /// Journal radius `R2`, m.
    pub journal_radius: f64,
}

/// How a journal moves in its bearing.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct JournalMotion {
    /// Centre in bearing axes, m.
    pub position: [f64; 2],
    /// Rate of the centre, m/s.
    pub rate: [f64; 2],
    /// Rate of the rotation, rad/s.
    pub spin: f64,
    /// Normal speed at the start of the contact, m/s; the law puts its floor under it.
    pub impact_speed: f64,
}

/// Contact of a journal at one instant.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct JournalContact {
    /// Direction from the bearing's centre to the journal's.
    pub normal: [f64; 2],
    /// Penetration `δ`, m; negative without contact.
    pub penetration: f64,
    /// Rate of the penetration, m/s.
    pub penetration_rate: f64,
    /// Sliding speed `v_t`, m/s.
    pub sliding: f64,
    /// What the law itself presses with, `E + B δ̇`, N; there is no force where it is negative.
    pub pressing: f64,
    /// Normal force `F_n`, N.
    pub normal_force: f64,
    /// Friction force `F_t` on the journal, N.
    pub friction_force: f64,
}

/// How the direction of friction depends on the sliding speed: `c_d sign v = offset + slope · v`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FrictionLine {
    /// At rest.
    pub offset: f64,
    /// Per m/s.
    pub slope: f64,
}

/// Entries: rate among (x, y, rotation) and parameter among `K, D, mu`.
const ENTRIES: [(usize, usize); 7] = [(0, 0), (1, 0), (0, 1), (1, 1), (0, 2), (1, 2), (2, 2)];

/// Efforts of the drives per unit of each parameter, one per entry, with derivatives by position and by (rate, spin).
#[derive(Debug, Clone, Copy, Default)]
struct Columns {
    values: [f64; 7],
    by_position: [[f64; 2]; 7],
    by_rate: [[f64; 3]; 7],
}

impl ClearanceContact {
    /// Contact at one instant for factors `[K, D]` of the law and the friction coefficient `mu`.
    pub fn contact(&self, motion: &JournalMotion, [k, d, mu]: [f64; 3]) -> JournalContact {
        let (normal, radius) = direction(motion.position);
        let penetration = radius - self.law.clearance();
        let across = [-normal[1], normal[0]];
        let penetration_rate = dot(motion.rate, normal);
        let sliding = dot(motion.rate, across) + motion.spin * self.journal_radius;
        let force = self.law.at(penetration, motion.impact_speed);
        let pressing = force.elastic + force.damping * penetration_rate;
        JournalContact {
            normal,
            penetration,
            penetration_rate,
            sliding,
            pressing,
            normal_force: if pressing > 0.0 {
                k * force.elastic + d * force.damping * penetration_rate
            } else {
                0.0
            },
            friction_force: -mu * self.friction.direction(sliding).0 * pressing.max(0.0),
        }
    }

    /// Efforts of the drives at the translations and the rotation.
    ///
    /// `line`: as for [`ClearanceContact::efforts_with_slopes`].
    pub fn efforts(
        &self,
        motion: &JournalMotion,
        [k, d, mu]: [f64; 3],
        line: Option<FrictionLine>,
    ) -> [f64; 3] {
        let (normal, radius) = direction(motion.position);
        let penetration = radius - self.law.clearance();
        if penetration <= 0.0 {
            return [0.0; 3];
        }
        let across = [-normal[1], normal[0]];
        let sliding = dot(motion.rate, across) + motion.spin * self.journal_radius;
        let value = line.map_or_else(|| self.friction.direction(sliding).0, |l| l.offset + l.slope * sliding);
        let law = self.law.at(penetration, motion.impact_speed);
        let damping = law.damping * dot(motion.rate, normal);
        let pressing = law.elastic + damping;
        if pressing <= 0.0 && line.is_none() {
            return [0.0; 3];
        }
        let (push, rub) = (k * law.elastic + d * damping, mu * value * pressing);
        [push * normal[0] + rub * across[0], push * normal[1] + rub * across[1], rub * self.journal_radius]
    }

    /// Efforts of the drives at the translations and the rotation, with their derivatives by the journal's position
    /// (`[effort][x, y]`) and by its rates (`[effort][x, y, spin]`).
    ///
    /// `line`: what stands in for the direction of friction and its slope; the contact is then taken to press, even if the law
    /// would have it pull. `None`: what speed and law say.
    pub fn efforts_with_slopes(
        &self,
        motion: &JournalMotion,
        parameters: [f64; 3],
        line: Option<FrictionLine>,
    ) -> ([f64; 3], [[f64; 2]; 3], [[f64; 3]; 3]) {
        let columns = self.columns(motion, line);
        let (mut efforts, mut by_position, mut by_rate) = ([0.0; 3], [[0.0; 2]; 3], [[0.0; 3]; 3]);
        for (e, (rate, parameter)) in ENTRIES.into_iter().enumerate() {
            let factor = parameters[parameter];
            efforts[rate] += factor * columns.values[e];
            (0..2).for_each(|k| by_position[rate][k] += factor * columns.by_position[e][k]);
            (0..3).for_each(|k| by_rate[rate][k] += factor * columns.by_rate[e][k]);
        }
        (efforts, by_position, by_rate)
    }

    fn columns(&self, motion: &JournalMotion, line: Option<FrictionLine>) -> Columns {
        let (normal, radius) = direction(motion.position);
        let penetration = radius - self.law.clearance();
        if penetration <= 0.0 {
            return Columns::default();
        }
        let across = [-normal[1], normal[0]];
        let penetration_rate = dot(motion.rate, normal);
        let around = dot(motion.rate, across);
        let sliding = around + motion.spin * self.journal_radius;
        let (value, slope) = match line {
            Some(line) => (line.offset + line.slope * sliding, line.slope),
            None => self.friction.direction(sliding),
        };
        let law = self.law.at(penetration, motion.impact_speed);
        let damping = law.damping * penetration_rate;
        if law.elastic + damping <= 0.0 && line.is_none() {
            return Columns::default();
        }
        // Derivatives of δ, δ̇ and v_t by (x, y, ẋ, ẏ, q̇).
        let turn = 1.0 / radius;
        let by = |px: [f64; 2], pv: [f64; 2], spin: f64| [px[0], px[1], pv[0], pv[1], spin];
        let of_depth = by(normal, [0.0; 2], 0.0);
        let of_rate = by(across.map(|t| around * turn * t), normal, 0.0);
        let of_sliding = by(across.map(|t| -penetration_rate * turn * t), across, self.journal_radius);
        let of_elastic = of_depth.map(|d| law.elastic_slope * d);
        let of_damping: [f64; 5] = std::array::from_fn(|k| {
            law.damping_slope * penetration_rate * of_depth[k] + law.damping * of_rate[k]
        });
        let pressing = law.elastic + damping;
        let rubbing = value * pressing;
        let of_rubbing: [f64; 5] = std::array::from_fn(|k| {
            slope * of_sliding[k] * pressing + value * (of_elastic[k] + of_damping[k])
        });

        let mut out = Columns::default();
        let mut put = |entry: usize, size: f64, of_size: [f64; 5], along: f64, turned: f64| {
            out.values[entry] = size * along;
            for k in 0..2 {
                out.by_position[entry][k] = of_size[k] * along + size * turned * across[k] * turn;
            }
            for k in 0..3 {
                out.by_rate[entry][k] = of_size[2 + k] * along;
            }
        };
        for axis in 0..2 {
            // dn = t (t·dp)/r and dt = -n (t·dp)/r.
            put(axis, law.elastic, of_elastic, normal[axis], across[axis]);
            put(2 + axis, damping, of_damping, normal[axis], across[axis]);
            put(4 + axis, rubbing, of_rubbing, across[axis], -normal[axis]);
        }
        put(6, rubbing, of_rubbing, self.journal_radius, 0.0);
        out
    }

    fn rate(&self, place: usize) -> usize {
        [self.translations[0], self.translations[1], self.rotation][place]
    }

    /// Motions of the journal over a block.
    fn motions(&self, joints: &[JointInfo], motion: &MotionBlock<'_>) -> impl Iterator<Item = JournalMotion> {
        let [x, y] = self.translations.map(|r| motion.position(joints[r].position));
        let [dx, dy] = self.translations.map(|r| motion.rate(r));
        let spin = motion.rate(self.rotation);
        let speeds = motion.channel(&impact_speed_signal(&joints[self.rotation].name));
        (0..motion.samples).map(move |s| JournalMotion {
            position: [x[s], y[s]],
            rate: [dx[s], dy[s]],
            spin: spin[s],
            impact_speed: speeds.map_or(0.0, |speeds| speeds[s]),
        })
    }
}

fn dot(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

/// Direction and length; an arbitrary direction at the centre.
fn direction(p: [f64; 2]) -> ([f64; 2], f64) {
    let radius = p[0].hypot(p[1]);
    if radius > 0.0 { (p.map(|x| x / radius), radius) } else { ([1.0, 0.0], 0.0) }
}

impl JointElement for ClearanceContact {
    fn rates(&self) -> Vec<usize> {
        (0..3).map(|place| self.rate(place)).collect()
    }
    fn parameters(&self, joints: &[JointInfo]) -> Vec<Parameter> {
        let joint = &joints[self.rotation];
        let of = |symbol: &str, prior: f64| Parameter {
            prior: Some(prior),
            owner: Owner::Joint(joint.name.clone()),
            ..joint.parameter(symbol, ["1", "1"], Some(0.0))
        };
        vec![of("contact_stiffness", 1.0), of("contact_damping", 1.0), of("mu", self.friction.coefficient)]
    }
    fn entries(&self) -> Vec<(usize, usize)> {
        ENTRIES.iter().map(|(place, parameter)| (self.rate(*place), *parameter)).collect()
    }
    fn clearance(&self) -> Option<&ClearanceContact> {
        Some(self)
    }
    fn signals(&self, joints: &[JointInfo]) -> Vec<String> {
        vec![impact_speed_signal(&joints[self.rotation].name)]
    }
    /// The speed with which a contact is first seen, until it opens.
    fn remember(
        &self,
        joints: &[JointInfo],
        motion: &MotionBlock<'_>,
        _step_s: f64,
        _shape: &[f64],
        state: &mut Vec<f64>,
        out: &mut [&mut [f64]],
    ) {
        state.resize(1, 0.0);
        let [x, y] = self.translations.map(|r| motion.position(joints[r].position));
        let [dx, dy] = self.translations.map(|r| motion.rate(r));
        for (s, to) in out[0].iter_mut().enumerate() {
            let (normal, radius) = direction([x[s], y[s]]);
            let closed = radius > self.law.clearance();
            if !closed {
                state[0] = 0.0;
            } else if state[0] == 0.0 {
                state[0] = dot([dx[s], dy[s]], normal).abs().max(self.law.impact_speed_floor());
            }
            *to = state[0];
        }
    }
    fn fill(&self, joints: &[JointInfo], motion: &MotionBlock<'_>, _: &[f64], out: &mut ElementColumns<'_>) {
        for (s, journal) in self.motions(joints, motion).enumerate() {
            let columns = self.columns(&journal, None);
            for (entry, value) in columns.values.into_iter().enumerate() {
                out.column(entry)[s] = value;
            }
        }
    }
    fn adjoint(
        &self,
        joints: &[JointInfo],
        motion: &MotionBlock<'_>,
        _: &[f64],
        weights: &ElementWeights<'_>,
        out: &mut MotionAdjoint,
    ) {
        let n = motion.samples;
        for (s, journal) in self.motions(joints, motion).enumerate() {
            let columns = self.columns(&journal, None);
            for entry in 0..ENTRIES.len() {
                let weight = weights.column(entry)[s];
                for k in 0..2 {
                    let position = joints[self.rate(k)].position;
                    out.q[position * n + s] += weight * columns.by_position[entry][k];
                }
                for k in 0..3 {
                    out.dq[self.rate(k) * n + s] += weight * columns.by_rate[entry][k];
                }
            }
        }
    }
}
