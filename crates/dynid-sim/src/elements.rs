//! What joint elements add to the equation of motion, whatever mechanism they sit on.

use dynid_model::element::JointElement;
use dynid_model::{EffortModel, History, MotionAdjoint, MotionBlock, TreeModel};

use crate::error::{SimError, demand, demand_length};

/// Elements of a model at given parameters.
#[derive(Clone, Copy)]
pub(crate) struct Elements<'a> {
    pub(crate) model: &'a TreeModel,
    pub(crate) linear: &'a [f64],
    pub(crate) shape: &'a [f64],
    pub(crate) sign_width: f64,
    /// Contacts of journals in their bearings are left out.
    pub(crate) without_contacts: bool,
}

/// Memory of [`Elements`].
#[derive(Debug, Clone)]
pub(crate) struct ElementMemory {
    scratch: Vec<f64>,
    pub(crate) still: Vec<f64>,
    /// One copy of the state per rate: positions, rates, accelerations.
    copies: [Vec<f64>; 3],
    /// Copy `k` asks for the effort of rate `k`.
    asked: Vec<f64>,
    slopes: MotionAdjoint,
}

/// Fails unless parameters fit the model and are finite, and the width is positive.
pub(crate) fn check_parameters(
    model: &TreeModel,
    linear: &[f64],
    shape: &[f64],
    sign_width: f64,
) -> Result<(), SimError> {
    demand_length("linear parameters", model.parameters().linear.len(), linear.len())?;
    demand_length("shape parameters", model.parameters().shape.len(), shape.len())?;
    demand(sign_width > 0.0 && sign_width.is_finite(), "sign_width", "a positive number", sign_width)?;
    match linear.iter().chain(shape).find(|x| !x.is_finite()) {
        None => Ok(()),
        Some(x) => demand(false, "parameters", "finite numbers", x),
    }
}

impl Elements<'_> {
    pub(crate) fn memory(&self) -> ElementMemory {
        let (positions, n) = self.model.dimensions();
        let mut asked = vec![0.0; n * n];
        (0..n).for_each(|k| asked[k * n + k] = 1.0);
        ElementMemory {
            scratch: Vec::new(),
            still: vec![0.0; n],
            copies: [positions, n, n].map(|k| vec![0.0; k * n]),
            asked,
            slopes: MotionAdjoint::new(positions, n, n),
        }
    }

    fn counts(&self, element: &dyn JointElement) -> bool {
        !(self.without_contacts && element.clearance().is_some())
    }

    fn channel_names(&self) -> impl Iterator<Item = &str> {
        self.model.channels().iter().chain(self.model.signals()).map(String::as_str)
    }

    /// Whether elements remember the motion before.
    pub(crate) fn remember(&self) -> bool {
        !self.model.signals().is_empty()
    }

    /// Values of the model's signals at positions and velocities, a time `step` (s) after what `history` remembers, with velocities
    /// `between` on the way; at that instant itself without a step.
    pub(crate) fn signals(
        &self,
        history: &History,
        step: Option<(f64, &[f64])>,
        (q, dq): (&[f64], &[f64]),
    ) -> Vec<f64> {
        match step {
            None => self.form(&mut history.clone(), q, &[dq], 1.0),
            Some((step, between)) => {
                let both = self.form(&mut history.clone(), q, &[between, dq], step);
                both.into_iter().skip(1).step_by(2).collect()
            }
        }
    }

    /// Takes what elements remember on by `step` seconds at velocities `dq` to positions `q`.
    pub(crate) fn pass(&self, history: &mut History, step: f64, (q, dq): (&[f64], &[f64])) {
        if self.remember() {
            self.form(history, q, &[dq], step);
        }
    }

    /// Channels followed by the signals of an instant.
    pub(crate) fn with_signals(
        &self,
        channels: &[f64],
        history: &History,
        step: Option<(f64, &[f64])>,
        state: (&[f64], &[f64]),
    ) -> Vec<f64> {
        let mut all = channels.to_vec();
        if self.remember() {
            all.extend(self.signals(history, step, state));
        }
        all
    }

    /// Signals of some instants at the same positions, signal after signal.
    fn form(&self, history: &mut History, q: &[f64], velocities: &[&[f64]], step: f64) -> Vec<f64> {
        let ((positions, rates), samples) = (self.model.dimensions(), velocities.len());
        let q: Vec<f64> = (0..positions).flat_map(|j| std::iter::repeat_n(q[j], samples)).collect();
        let dq: Vec<f64> = (0..rates).flat_map(|j| velocities.iter().map(move |v| v[j])).collect();
        let rest = vec![0.0; rates * samples];
        let mut out = vec![0.0; self.model.signals().len() * samples];
        let motion = MotionBlock::plain(samples, &q, &dq, &rest);
        self.model.remember(&motion, step, self.shape, history, samples, &mut out);
        out
    }

    /// Efforts at one state.
    pub(crate) fn effort(
        &self,
        [q, dq, ddq]: [&[f64]; 3],
        channels: &[f64],
        memory: &mut ElementMemory,
        to: &mut [f64],
    ) {
        self.effort_into([q, dq, ddq], channels, &mut memory.scratch, to);
    }

    /// Efforts at one state without accelerations.
    pub(crate) fn still_effort(
        &self,
        (q, dq): (&[f64], &[f64]),
        channels: &[f64],
        memory: &mut ElementMemory,
        to: &mut [f64],
    ) {
        self.effort_into([q, dq, &memory.still], channels, &mut memory.scratch, to);
    }

    fn effort_into(
        &self,
        [q, dq, ddq]: [&[f64]; 3],
        channels: &[f64],
        scratch: &mut Vec<f64>,
        to: &mut [f64],
    ) {
        let channels: Vec<(&str, &[f64])> = self
            .channel_names()
            .zip(channels)
            .map(|(name, value)| (name, std::slice::from_ref(value)))
            .collect();
        let motion = MotionBlock {
            samples: 1,
            stride: 1,
            q,
            dq,
            ddq,
            gravity: None,
            channels: &channels,
            sign_width: self.sign_width,
        };
        to.fill(0.0);
        self.model.efforts_of(|e| self.counts(e), &motion, (self.shape, self.linear), 1, to, scratch);
    }

    /// Effort per acceleration, row-major: the same at some states of no special kind.
    ///
    /// # Errors
    /// [`SimError::VaryingInertia`].
    pub(crate) fn added_inertia(&self) -> Result<Vec<f64>, SimError> {
        let (positions, n) = self.model.dimensions();
        let mut memory = self.memory();
        let channels = vec![1.0; self.model.channels().len()];
        let mut found: Option<Vec<f64>> = None;
        for state in 0..3 {
            let at = |k: usize, scale: f64| scale * (1.0 + k as f64 + 2.7 * f64::from(state)).sin();
            let q: Vec<f64> = (0..positions).map(|k| at(k, 1.0)).collect();
            let dq: Vec<f64> = (0..n).map(|k| at(k + 17, f64::from(state))).collect();
            self.form_slopes((&q, &dq), &channels, &mut memory);
            let added: Vec<f64> = (0..n * n).map(|k| memory.slopes.ddq[k % n * n + k / n]).collect();
            match &found {
                None => found = Some(added),
                Some(first) => {
                    let scale = first.iter().fold(1e-3_f64, |m, x| m.max(x.abs()));
                    let differs = (0..n * n).find(|k| (first[*k] - added[*k]).abs() > 1e-9 * scale);
                    if let Some(k) = differs {
                        return Err(SimError::VaryingInertia { rate: k / n });
                    }
                }
            }
        }
        Ok(found.unwrap_or_default())
    }

    /// Derivatives of the efforts by the motion: of effort `row` by position `k` at `q[k * n + row]`, by rate `k` at
    /// `dq[k * n + row]`.
    pub(crate) fn slopes<'m>(
        &self,
        state: (&[f64], &[f64]),
        channels: &[f64],
        memory: &'m mut ElementMemory,
    ) -> &'m MotionAdjoint {
        self.form_slopes(state, channels, memory);
        &memory.slopes
    }

    fn form_slopes(&self, (q, dq): (&[f64], &[f64]), channels: &[f64], memory: &mut ElementMemory) {
        let n = dq.len();
        let ElementMemory { scratch, copies: [copied_q, copied_dq, copied_ddq], asked, slopes, .. } = memory;
        for (copied, from) in [(&mut *copied_q, q), (&mut *copied_dq, dq)] {
            for (to, x) in copied.chunks_exact_mut(n.max(1)).zip(from) {
                to.fill(*x);
            }
        }
        let repeated: Vec<Vec<f64>> = channels.iter().map(|c| vec![*c; n]).collect();
        let channels: Vec<(&str, &[f64])> =
            self.channel_names().zip(&repeated).map(|(n, v)| (n, v.as_slice())).collect();
        let motion = MotionBlock {
            samples: n,
            stride: n,
            q: copied_q,
            dq: copied_dq,
            ddq: copied_ddq,
            gravity: None,
            channels: &channels,
            sign_width: self.sign_width,
        };
        slopes.clear();
        let parameters = (self.shape, self.linear);
        self.model.adjoint_of(|e| self.counts(e), &motion, parameters, (n, asked), slopes, scratch);
    }
}
