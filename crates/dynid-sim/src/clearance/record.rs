//! What a simulation of a mechanism with clearance gives.

use super::energy::ClearanceEnergy;

/// A journal in its bearing, a value per sample.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct JournalRecord {
    /// Name of the joint.
    pub joint: String,
    /// Offset `e` of the journal's centre in axes that turn with the journal's link, m.
    pub offset: Vec<[f64; 2]>,
    /// First time derivative of the offset, m/s.
    pub offset_rate: Vec<[f64; 2]>,
    /// Second time derivative of the offset, m/s².
    pub offset_acceleration: Vec<[f64; 2]>,
    /// Penetration, m; negative without contact.
    pub penetration: Vec<f64>,
    /// Sliding speed, m/s.
    pub sliding: Vec<f64>,
    /// Normal force `F_n`, N.
    pub normal_force: Vec<f64>,
    /// Friction force `F_t` on the journal, N.
    pub friction_force: Vec<f64>,
    /// Friction moment that the drive has to overcome, `-F_t R2`, N m.
    pub friction_moment: Vec<f64>,
    /// Largest penetration at any stage of any step, between samples too, m.
    pub largest_penetration: f64,
    /// Largest normal force likewise, N.
    pub largest_normal_force: f64,
    /// Share of the time in contact.
    pub contact_share: f64,
}

/// A contact begins or ends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ContactEventKind {
    /// With this normal speed, m/s.
    Onset(f64),
    /// The journal leaves the bearing.
    Loss,
}

/// When a contact begins or ends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContactEvent {
    /// s.
    pub time: f64,
    /// Index of the joint among those with clearance.
    pub joint: usize,
    /// What happens.
    pub kind: ContactEventKind,
}

/// How much work a simulation was.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct RunCount {
    /// Steps that were kept.
    pub steps: usize,
    /// Steps that were repeated.
    pub repeated: usize,
    /// Accelerations of the whole mechanism (right-hand sides); not those that only tell of a sample or of powers.
    pub evaluations: usize,
    /// Jacobians of the contacts.
    pub jacobians: usize,
    /// Passages from one branch of a law to another.
    pub passages: usize,
}

/// A simulated mechanism with clearance.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ClearanceRecord {
    /// Times, s.
    pub time: Vec<f64>,
    /// Positions, per sample all rates of the model.
    pub q: Vec<Vec<f64>>,
    /// Rates.
    pub dq: Vec<Vec<f64>>,
    /// Accelerations.
    pub ddq: Vec<Vec<f64>>,
    /// Efforts of the drives, per sample all rates of the model; those of the translations are what the solution leaves
    /// unbalanced.
    pub effort: Vec<Vec<f64>>,
    /// Joints with clearance, in the order of the model's contacts.
    pub journals: Vec<JournalRecord>,
    /// Onsets and losses of contact.
    pub events: Vec<ContactEvent>,
    /// Work.
    pub count: RunCount,
    /// Where the energy went; all zero by [`Method::RungeKutta4`](super::Method::RungeKutta4), which does not ask.
    pub energy: ClearanceEnergy,
    /// Fastest swing of a journal in its bearing at the end, Hz: a pendulum as long as its offset. 0 where all contacts are
    /// open.
    pub swing_hz: f64,
}

impl ClearanceRecord {
    /// Least sample rate that shows the swing of the journals, five samples a period, Hz.
    pub fn needed_sample_rate(&self) -> f64 {
        5.0 * self.swing_hz
    }
}
