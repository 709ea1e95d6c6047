//! Robots behind position-controlled drives as models to design for: what readings of positions tell where nobody measures efforts.

use std::sync::Arc;

use dynid_linalg::Mat;
use dynid_model::{EffortModel, MotionAdjoint, MotionBlock, RegressorBlock, RobotModel};
use dynid_motion::response::PeriodicResponse;

use crate::model::{ColumnInfo, ExcitationModel, Sensitivity};

/// The position loop of one joint, linear: `m q̈ + d q̇ + k_p q = k_p u(t - T)`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PositionLoop {
    /// Position gain `k_p`, N m/rad.
    pub position_gain: f64,
    /// Velocity gain of the drive, N m s/rad.
    pub velocity_gain: f64,
    /// Damping `d`: velocity gain and viscous friction, N m s/rad.
    pub damping: f64,
    /// Inertia `m` that the drive moves: of rotor and bodies, kg m².
    pub inertia: f64,
    /// Time from a command to what it does `T`, s.
    pub delay: f64,
}

impl PositionLoop {
    /// What an effort of amplitude `re + j im` moves at `ω` rad/s.
    fn yields(&self, w: f64, (re, im): (f64, f64)) -> (f64, f64) {
        let (a, b) = (self.position_gain - self.inertia * w * w, self.damping * w);
        let size = a * a + b * b;
        ((re * a + im * b) / size, (im * a - re * b) / size)
    }

    /// Position over command at `ω` rad/s.
    fn follows(&self, w: f64) -> (f64, f64) {
        let (sin, cos) = (w * self.delay).sin_cos();
        self.yields(w, (self.position_gain * cos, -self.position_gain * sin))
    }
}

/// A parameter that readings of positions are to tell.
#[derive(Debug, Clone, PartialEq)]
pub enum ServoColumn {
    /// A linear parameter of the model, by its place in the table: friction, rotor inertia, a constant effort.
    Effort(usize),
    /// The position gain that these joints share.
    PositionGain(Vec<usize>),
    /// The delay that these joints share.
    Delay(Vec<usize>),
    /// The position of this joint where its encoder reads zero.
    Zero(usize),
    /// Friction at rest above Coulomb friction of this joint, `sign(q̇) e^{-(q̇/v_s)²}`.
    Stiction {
        /// Joint.
        joint: usize,
        /// Stribeck velocity `v_s`, rad/s.
        velocity: f64,
    },
    /// The Stribeck velocity of this joint.
    Stribeck {
        /// Joint.
        joint: usize,
        /// Its value `v_s`, rad/s.
        velocity: f64,
        /// Friction at rest above Coulomb friction, N m.
        stiction: f64,
    },
}

/// Efforts of friction per stiction, or per Stribeck velocity, and their slopes by the velocity; `None`: another column.
fn peak(column: &ServoColumn, sign_width: f64) -> Option<(usize, impl Fn(f64) -> (f64, f64))> {
    let (joint, vs, per_velocity) = match *column {
        ServoColumn::Stiction { joint, velocity } => (joint, velocity, None),
        ServoColumn::Stribeck { joint, velocity, stiction } => (joint, velocity, Some(stiction)),
        _ => return None,
    };
    let of = move |v: f64| {
        let (sign, by) = if sign_width > 0.0 {
            let sign = (v / sign_width).tanh();
            (sign, (1.0 - sign * sign) / sign_width)
        } else {
            (if v == 0.0 { 0.0 } else { v.signum() }, 0.0)
        };
        let u = v / vs;
        let bell = (-u * u).exp();
        // Of the Stribeck velocity: stiction · sign · bell · 2 u²/v_s.
        let (factor, slope) =
            per_velocity.map_or((1.0, 0.0), |f| (2.0 * f * u * u / vs, 4.0 * f * u / (vs * vs)));
        (sign * bell * factor, bell * (by * factor + sign * (slope - 2.0 * u / vs * factor)))
    };
    Some((joint, of))
}

/// A robot whose drives are told positions and that logs where its encoders are; the trajectory is the command.
///
/// ```text
/// L = m s² + d s + k_p            q = L⁻¹ k_p e^{-sT} u            by joint, in the steady state of a motion that repeats
/// ∂x/∂θ = -L⁻¹ Y_θ(q, q̇, q̈)       Y_θ: column of the inverse dynamics; of a gain -(τ + k_d q̇)/k_p, of a zero ∂τ/∂q
/// ∂x/∂T = -q̇
/// ```
///
/// That is the closed loop to first order about its own motion, with the inertia of a mean pose and without what friction takes from the
/// motion: smooth in the command, and enough to tell one motion from another. How well parameters will be known is for a simulation to say.
#[derive(Debug, Clone)]
pub struct ServoExcitation {
    model: Arc<RobotModel>,
    /// Values of all linear parameters.
    nominal: Vec<f64>,
    loops: Vec<PositionLoop>,
    period: f64,
    kept: Vec<ServoColumn>,
    columns: Vec<ColumnInfo>,
}

/// Distance over which efforts are differenced by position, rad or m: their own curvature is some 1e-7 of them, rounding 1e-12.
const STEP: f64 = 1e-4;

/// Motion of the robot behind its drives, and the systems that lead to it.
struct Followed {
    /// From command to position, by joint.
    follow: Vec<PeriodicResponse>,
    /// From effort to position, by joint.
    yielding: Vec<PeriodicResponse>,
    /// Positions, rates, accelerations.
    channels: [Vec<f64>; 3],
    samples: usize,
    sign_width: f64,
}

impl Followed {
    fn block(&self) -> MotionBlock<'_> {
        let [q, dq, ddq] = &self.channels;
        MotionBlock { sign_width: self.sign_width, ..MotionBlock::plain(self.samples, q, dq, ddq) }
    }

    /// The motion with a coordinate elsewhere.
    fn moved<T>(&self, joint: usize, by: f64, then: impl FnOnce(&MotionBlock<'_>) -> T) -> T {
        let mut q = self.channels[0].clone();
        q[joint * self.samples..][..self.samples].iter_mut().for_each(|x| *x += by);
        then(&MotionBlock { q: &q, ..self.block() })
    }
}

impl ServoExcitation {
    /// A robot with all linear parameters and the loops of its joints, told motions of this period, s. Shape parameters are those that
    /// searches start from.
    ///
    /// # Panics
    /// If a list has the wrong length, a column names a parameter or a joint that does not exist, or the base floats.
    pub fn new(
        model: Arc<RobotModel>,
        nominal: Vec<f64>,
        loops: Vec<PositionLoop>,
        period: f64,
        columns: Vec<(ServoColumn, ColumnInfo)>,
    ) -> Self {
        let (positions, rates) = model.dimensions();
        assert_eq!(positions, rates, "excitation of a floating base");
        assert_eq!((loops.len(), model.outputs().len()), (rates, rates), "one drive per joint");
        assert_eq!(nominal.len(), model.parameters().linear.len(), "nominal parameters");
        let exists = |column: &ServoColumn| match column {
            ServoColumn::Effort(c) => *c < nominal.len(),
            ServoColumn::PositionGain(joints) | ServoColumn::Delay(joints) => {
                joints.iter().all(|j| *j < rates)
            }
            ServoColumn::Zero(joint)
            | ServoColumn::Stiction { joint, .. }
            | ServoColumn::Stribeck { joint, .. } => *joint < rates,
        };
        assert!(columns.iter().all(|(c, _)| exists(c)), "a column of something that is not there");
        let (kept, columns) = columns.into_iter().unzip();
        ServoExcitation { model, nominal, loops, period, kept, columns }
    }

    fn shape(&self) -> Vec<f64> {
        self.model.parameters().shape_start()
    }

    fn followed(&self, command: &MotionBlock<'_>) -> Followed {
        let samples = command.samples;
        let system = |of: &dyn Fn(&PositionLoop, f64) -> (f64, f64)| -> Vec<PeriodicResponse> {
            self.loops.iter().map(|l| PeriodicResponse::new(samples, self.period, |w| of(l, w))).collect()
        };
        let follow = system(&PositionLoop::follows);
        let yielding = system(&|l, w| l.yields(w, (1.0, 0.0)));
        let channels = [command.q, command.dq, command.ddq].map(|channel| {
            let mut out = Vec::with_capacity(samples * self.loops.len());
            for (joint, response) in follow.iter().enumerate() {
                out.extend_from_slice(&channel[joint * command.stride..][..samples]);
                response.apply(&mut out[joint * samples..]);
            }
            out
        });
        Followed { follow, yielding, channels, samples, sign_width: command.sign_width }
    }

    /// Places of a linear parameter: outputs that it acts on, and its place among their columns.
    fn places(&self, column: usize) -> impl Iterator<Item = (usize, usize)> + '_ {
        let layout = self.model.layout();
        (0..layout.outputs())
            .filter_map(move |o| layout.columns(o).iter().position(|c| *c == column).map(|k| (o, k)))
    }

    fn efforts(&self, motion: &MotionBlock<'_>) -> Vec<f64> {
        let mut out = vec![0.0; self.loops.len() * motion.samples];
        self.model.efforts(motion, &self.shape(), &self.nominal, motion.samples, &mut out);
        out
    }

    /// Adds the derivatives of `Σ weights ∘ W` by the motion of the robot, then goes back to that of the command.
    fn adjoint_of(&self, motion: &MotionBlock<'_>, g: &Mat, out: &mut MotionAdjoint) {
        let followed = self.followed(motion);
        let (n, samples) = (self.loops.len(), followed.samples);
        let back: Vec<PeriodicResponse> =
            followed.yielding.iter().map(PeriodicResponse::transposed).collect();
        // Weights of a column on one output, before its loop yielded.
        let before = |column: usize, output: usize| {
            let mut weights = g.col(column)[output * samples..][..samples].to_vec();
            back[output].apply(&mut weights);
            weights
        };
        let (shape, block) = (self.shape(), followed.block());
        let mut of_robot = MotionAdjoint::new(n, n, samples);
        let mut weights = RegressorBlock::new(self.model.layout().clone(), samples);
        weights.set_samples(samples);
        let mut of_efforts = vec![0.0; n * samples];
        for o in 0..n {
            for k in 0..self.model.layout().columns(o).len() {
                weights.column_mut(o, k).fill(0.0);
            }
        }
        for (c, kept) in self.kept.iter().enumerate() {
            match kept {
                ServoColumn::Effort(column) => {
                    for (o, k) in self.places(*column) {
                        let to = weights.column_mut(o, k);
                        to.iter_mut().zip(before(c, o)).for_each(|(t, w)| *t -= w);
                    }
                }
                ServoColumn::PositionGain(joints) => {
                    for j in joints {
                        let l = &self.loops[*j];
                        let range = j * samples..(j + 1) * samples;
                        for (s, w) in range.zip(before(c, *j)) {
                            of_efforts[s] += w / l.position_gain;
                            of_robot.dq[s] += w * l.velocity_gain / l.position_gain;
                        }
                    }
                }
                ServoColumn::Delay(joints) => {
                    for j in joints {
                        let range = j * samples..(j + 1) * samples;
                        for (s, w) in range.clone().zip(&g.col(c)[range]) {
                            of_robot.dq[s] -= w;
                        }
                    }
                }
                ServoColumn::Stiction { .. } | ServoColumn::Stribeck { .. } => {
                    let Some((j, friction)) = peak(kept, followed.sign_width) else { continue };
                    let range = j * samples..(j + 1) * samples;
                    for (s, w) in range.zip(before(c, j)) {
                        of_robot.dq[s] -= w * friction(block.dq[s]).1;
                    }
                }
                ServoColumn::Zero(joint) => {
                    let all: Vec<f64> = (0..n).flat_map(|o| before(c, o)).collect();
                    for side in [1.0, -1.0] {
                        let weights: Vec<f64> = all.iter().map(|w| -side * w / (2.0 * STEP)).collect();
                        followed.moved(*joint, side * STEP, |moved| {
                            self.model.effort_adjoint(
                                moved,
                                &shape,
                                &self.nominal,
                                samples,
                                &weights,
                                &mut of_robot,
                            );
                        });
                    }
                }
            }
        }
        self.model.regressor_adjoint(&block, &shape, &weights, &mut of_robot);
        self.model.effort_adjoint(&block, &shape, &self.nominal, samples, &of_efforts, &mut of_robot);
        let pairs = [
            (&mut of_robot.q, &mut out.q),
            (&mut of_robot.dq, &mut out.dq),
            (&mut of_robot.ddq, &mut out.ddq),
        ];
        for (from, to) in pairs {
            for (joint, follow) in followed.follow.iter().enumerate() {
                let range = joint * samples..(joint + 1) * samples;
                follow.transposed().apply(&mut from[range.clone()]);
                to[range.clone()].iter_mut().zip(&from[range]).for_each(|(t, f)| *t += f);
            }
        }
    }
}

impl ExcitationModel for ServoExcitation {
    fn coordinates(&self) -> usize {
        self.loops.len()
    }

    fn outputs(&self) -> usize {
        self.loops.len()
    }

    fn columns(&self) -> &[ColumnInfo] {
        &self.columns
    }

    fn response(&self, coordinate: usize, rate: f64) -> Option<(f64, f64)> {
        Some(self.loops[coordinate].follows(rate))
    }

    /// # Panics
    /// If `w` has another size. Samples are those of one period, evenly spread.
    fn observe(&self, motion: &MotionBlock<'_>, w: &mut Mat) {
        let samples = motion.samples;
        let n = self.loops.len();
        assert_eq!((w.nrows(), w.ncols()), (n * samples, self.kept.len()), "size of W");
        let followed = self.followed(motion);
        let block = followed.block();
        let mut regressor = RegressorBlock::new(self.model.layout().clone(), samples);
        self.model.regressor(&block, &self.shape(), &mut regressor);
        let efforts = self.efforts(&block);
        w.fill(0.0);
        for (c, kept) in self.kept.iter().enumerate() {
            let to = w.col_mut(c);
            match kept {
                ServoColumn::Effort(column) => {
                    for (o, k) in self.places(*column) {
                        let to = &mut to[o * samples..][..samples];
                        to.iter_mut().zip(regressor.column(o, k)).for_each(|(t, y)| *t = -y);
                        followed.yielding[o].apply(to);
                    }
                }
                ServoColumn::PositionGain(joints) => {
                    for j in joints {
                        let l = &self.loops[*j];
                        let range = j * samples..(j + 1) * samples;
                        for s in range.clone() {
                            to[s] = (efforts[s] + l.velocity_gain * block.dq[s]) / l.position_gain;
                        }
                        followed.yielding[*j].apply(&mut to[range]);
                    }
                }
                ServoColumn::Delay(joints) => {
                    for j in joints {
                        let range = j * samples..(j + 1) * samples;
                        to[range.clone()].iter_mut().zip(&block.dq[range]).for_each(|(t, v)| *t = -v);
                    }
                }
                ServoColumn::Stiction { .. } | ServoColumn::Stribeck { .. } => {
                    let Some((j, friction)) = peak(kept, followed.sign_width) else { continue };
                    let range = j * samples..(j + 1) * samples;
                    to[range.clone()]
                        .iter_mut()
                        .zip(&block.dq[range.clone()])
                        .for_each(|(t, v)| *t = -friction(*v).0);
                    followed.yielding[j].apply(&mut to[range]);
                }
                ServoColumn::Zero(joint) => {
                    let [ahead, behind] =
                        [STEP, -STEP].map(|by| followed.moved(*joint, by, |moved| self.efforts(moved)));
                    for (s, t) in to.iter_mut().enumerate() {
                        *t = -(ahead[s] - behind[s]) / (2.0 * STEP);
                    }
                    for (o, yielding) in followed.yielding.iter().enumerate() {
                        yielding.apply(&mut to[o * samples..][..samples]);
                    }
                }
            }
        }
    }

    fn adjoint(&self, motion: &MotionBlock<'_>, sensitivity: Sensitivity<'_>, out: &mut MotionAdjoint) {
        match sensitivity {
            Sensitivity::Full(g) => self.adjoint_of(motion, g, out),
            Sensitivity::Outer(terms) => {
                let mut g = Mat::zeros(self.loops.len() * motion.samples, self.kept.len());
                for (u, v) in terms {
                    for (c, v) in v.iter().enumerate() {
                        g.col_mut(c).iter_mut().zip(u).for_each(|(t, u)| *t += u * v);
                    }
                }
                self.adjoint_of(motion, &g, out);
            }
        }
    }
}
