//! Virtual logs of robots whose joints have clearance.

use dynid_identify::Error;
use dynid_model::element::JointElement;
use dynid_model::{EffortModel, RobotModel, journal_channels};
use dynid_motion::signal::rms;
use dynid_sim::clearance::{
    ClearanceEnergy, ClearanceRecord, ClearanceSettings, ClearanceStart, ContactEvent, ContactEventKind,
    Driving, RunCount,
};
use dynid_sim::{Plant, Profile, clearance};

use super::channels::sampled;
use super::efforts;
use super::settings::SimulateSettings;
use super::trajectory::Reference;

/// Time that is simulated before a log of a periodic motion begins, s.
const SETTLE: f64 = 0.5;

/// What journals did in their bearings, the time before the log included.
#[derive(Debug, Clone, PartialEq)]
pub struct ClearanceSummary {
    /// Time that was simulated before the log began, s.
    pub settle_s: f64,
    /// Joints with clearance.
    pub journals: Vec<JournalSummary>,
    /// Onsets and losses of contact; negative times are before the log.
    pub events: Vec<ContactEvent>,
    /// Where the energy of bodies and contacts went; other elements of the joints stand beside them and are not counted.
    pub energy: ClearanceEnergy,
    /// Work of the integrator.
    pub count: RunCount,
    /// Fastest swing of a journal at the end, Hz.
    pub swing_hz: f64,
    /// Least sample rate that shows it, Hz.
    pub needed_rate_hz: f64,
}

/// What one journal did.
#[derive(Debug, Clone, PartialEq)]
pub struct JournalSummary {
    /// Joint.
    pub joint: String,
    /// Share of the time in contact.
    pub contact_share: f64,
    /// How often contact began.
    pub onsets: usize,
    /// How often it ended.
    pub losses: usize,
    /// Largest penetration, between samples too, m.
    pub largest_penetration: f64,
    /// Largest normal force likewise, N.
    pub largest_normal_force: f64,
    /// RMS of the friction moment that the drive had to overcome, at the samples, N m.
    pub friction_moment_rms: f64,
}

/// Efforts and channels of a log.
pub(super) struct Journals {
    /// Effort per joint at the samples.
    pub(super) effort: Vec<Vec<f64>>,
    /// Effort per joint at the shifted samples.
    pub(super) led: Vec<Vec<f64>>,
    /// Offsets of the journals.
    pub(super) offsets: Vec<(String, Vec<f64>)>,
    /// Forces and penetrations.
    pub(super) contacts: Vec<(String, Vec<f64>)>,
    /// Parameters of the contacts.
    pub(super) parameters: Vec<(String, f64)>,
    pub(super) summary: ClearanceSummary,
}

impl ClearanceSummary {
    /// What a user of the log should know, in words.
    pub(super) fn warnings(&self, rate_hz: f64) -> Vec<String> {
        let slow = rate_hz < self.needed_rate_hz;
        let warning = || {
            format!(
                "journals swing in their bearings at {:.1} Hz, which {rate_hz} Hz do not show: sample with at least {:.0} Hz, or \
                 read single efforts as aliased",
                self.swing_hz,
                self.needed_rate_hz.ceil()
            )
        };
        slow.then(warning).into_iter().collect()
    }
}

/// Forces of bodies and contacts come from a simulation with prescribed joints; the other elements of the joints, which do
/// not move journals, add what they do on an ideal robot.
///
/// `model`: the ideal robot with its elements. `with_clearance`: bodies and contacts. `at`: motion of the joints at times
/// shifted by 0 and by `shift` samples.
///
/// # Errors
/// [`Error::Experiment`].
pub(super) fn along(
    (model, with_clearance): (&RobotModel, RobotModel),
    (reference, profiles): (&Reference, &[Profile]),
    values: &[f64],
    at: [&[Vec<f64>; 3]; 2],
    shift: f64,
    settings: &SimulateSettings,
) -> Result<Journals, Error> {
    let rate_hz = settings.rate_hz;
    let joints = model.joints().len();
    let samples = at[0][0].len() / joints;
    let settle_s = match reference {
        Reference::Series(_) => settings.settle_s.unwrap_or(SETTLE),
        Reference::File(..) => 0.0,
    };
    let instants = |shift: f64| (0..samples).map(move |s| (s as f64 + shift) / rate_hz).collect::<Vec<f64>>();
    let (now, led) = (instants(0.0), instants(shift));
    let start = led[0].min(0.0) - settle_s;
    let mut times: Vec<f64> = std::iter::once(start).chain(now.clone()).chain(led.clone()).collect();
    times.sort_by(f64::total_cmp);
    times.dedup();

    let linear = linear(&with_clearance, model, values);
    let parameters = contact_parameters(&with_clearance, &linear);
    let motion = |time: f64, q: &mut [f64], dq: &mut [f64], ddq: &mut [f64]| {
        for (k, [x, v, a]) in reference.at(time).into_iter().enumerate() {
            (q[k], dq[k], ddq[k]) = (x, v, a);
        }
    };
    // No element besides the contacts is in it, so no sign is smooth.
    let plant = Plant::new(with_clearance, linear, Vec::new(), 1.0)?;
    let record = clearance::simulate(
        plant,
        &ClearanceStart::default(),
        Driving::Prescribed(&motion),
        &times,
        &ClearanceSettings::default(),
    )?;

    let mut others = values.to_vec();
    others[..model.mechanism().inertial_parameters()].fill(0.0);
    let places = |of: &[f64]| -> Vec<usize> {
        of.iter().map(|t| times.partition_point(|known| known.total_cmp(t).is_lt())).collect()
    };
    let (now, led) = (places(&now), places(&led));
    let effort = |places: &[usize], at: &[Vec<f64>; 3], shift: f64| -> Vec<Vec<f64>> {
        let channels = sampled(profiles, shift, (samples, rate_hz));
        let mut out = efforts(model, &others, at, &channels, (samples, rate_hz));
        for (joint, out) in out.iter_mut().enumerate() {
            out.iter_mut().zip(places).for_each(|(e, row)| *e += record.effort[*row][joint]);
        }
        out
    };
    let (effort, led) = (effort(&now, at[0], 0.0), effort(&led, at[1], shift));
    let (offsets, contacts) = contacts(&record, &now);
    Ok(Journals {
        effort,
        led,
        offsets,
        contacts,
        parameters,
        summary: summary(record, settle_s, Some(&now)),
    })
}

/// Bodies with translations of journals and their contacts, with the elements of the ideal robot, whose rates come first.
pub(super) fn with_elements(contacts: &RobotModel, mut elements: Vec<Box<dyn JointElement>>) -> RobotModel {
    elements.extend(contacts.clearances().map(|c| Box::new(c.clone()) as Box<dyn JointElement>));
    RobotModel::new(contacts.mechanism().clone(), elements)
}

/// Linear parameters of a model with clearance: those of the ideal one where it has them, others as stated.
pub(super) fn linear(with_clearance: &RobotModel, ideal: &RobotModel, values: &[f64]) -> Vec<f64> {
    let table = with_clearance.parameters();
    let mut linear = table.prior();
    for (parameter, value) in ideal.parameters().linear.iter().zip(values) {
        if let Some(column) = table.column(&parameter.name) {
            linear[column] = *value;
        }
    }
    linear
}

/// Parameters of the contacts.
pub(super) fn contact_parameters(with_clearance: &RobotModel, linear: &[f64]) -> Vec<Named> {
    let joints = with_clearance.joints();
    let of_contacts = with_clearance.clearances().zip(with_clearance.clearance_contacts(linear));
    let named = of_contacts.flat_map(|(contact, (_, values))| {
        let parameters = contact.parameters(joints);
        parameters.into_iter().zip(values).map(|(p, value)| (p.name, value)).collect::<Vec<_>>()
    });
    named.collect()
}

/// Whether a channel is the offset of a journal of a robot.
pub(super) fn is_offset(channel: &str, model: &RobotModel) -> bool {
    model.joints().iter().flat_map(|joint| journal_channels(&joint.name)).any(|name| name == channel)
}

/// A name and its number.
type Named = (String, f64);

/// A channel of a log.
type Channel = (String, Vec<f64>);

/// Offsets of the journals; forces and penetrations.
fn contacts(record: &ClearanceRecord, rows: &[usize]) -> (Vec<Channel>, Vec<Channel>) {
    let (mut offsets, mut contacts) = (Vec::new(), Vec::new());
    for journal in &record.journals {
        let joint = &journal.joint;
        let pick = |values: &[f64]| rows.iter().map(|row| values[*row]).collect::<Vec<f64>>();
        for (axis, name) in journal_channels(joint).into_iter().enumerate() {
            offsets.push((name, rows.iter().map(|row| journal.offset[*row][axis]).collect()));
        }
        contacts.push((format!("normal_force_{joint}"), pick(&journal.normal_force)));
        contacts.push((format!("friction_force_{joint}"), pick(&journal.friction_force)));
        contacts.push((format!("penetration_{joint}"), pick(&journal.penetration)));
    }
    (offsets, contacts)
}

/// `rows`: samples of the log; `None`: all.
pub(super) fn summary(record: ClearanceRecord, settle_s: f64, rows: Option<&[usize]>) -> ClearanceSummary {
    let counted = |joint: usize, onset: bool| {
        let is =
            |e: &&ContactEvent| e.joint == joint && matches!(e.kind, ContactEventKind::Onset(_)) == onset;
        record.events.iter().filter(is).count()
    };
    let journals = record.journals.iter().enumerate().map(|(k, j)| JournalSummary {
        joint: j.joint.clone(),
        contact_share: j.contact_share,
        onsets: counted(k, true),
        losses: counted(k, false),
        largest_penetration: j.largest_penetration,
        largest_normal_force: j.largest_normal_force,
        friction_moment_rms: match rows {
            Some(rows) => rms(&rows.iter().map(|row| j.friction_moment[*row]).collect::<Vec<_>>()),
            None => rms(&j.friction_moment),
        },
    });
    ClearanceSummary {
        settle_s,
        journals: journals.collect(),
        energy: record.energy,
        count: record.count,
        swing_hz: record.swing_hz,
        needed_rate_hz: record.needed_sample_rate(),
        events: record.events,
    }
}
