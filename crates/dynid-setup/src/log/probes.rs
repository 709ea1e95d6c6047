//! Offsets of journals from probes, and their derivatives.

use dynid_model::{JournalModel, derivative_channels, journal_channels};
use dynid_motion::filter::{butterworth, forward_backward};
use dynid_motion::savitzky_golay::SavitzkyGolay;
use dynid_motion::spectrum::position_noise;
use dynid_motion::{Channel, SignalError};
use dynid_rows::conditioning::{ConditioningError, ConditioningSettings, PreparedLog};

use crate::Error;

/// Window and order of the derivatives, of fourth order in the time step: journals swing at a tenth of usual sample rates, where central
/// differences of second order lose some parts of a hundred.
const STENCIL: (usize, usize) = (5, 4);

/// Filters the offsets of journals that a log has and adds channels with their first and second derivative. Logs without them stay as they
/// are.
///
/// The filter passes what stands above the noise of the probes: a zero-phase Butterworth at the crossing of signal and noise, as the states
/// of joints have one.
///
/// # Errors
/// [`ConditioningError::MissingChannel`] for one offset without the other; [`Error::Setting`] for offsets beyond the journal's radius.
pub(super) fn derive(
    log: &mut PreparedLog,
    model: &JournalModel,
    settings: &ConditioningSettings,
) -> Result<(), Error> {
    for (joint, contact) in model.journal_joints().zip(model.contacts()) {
        let names = journal_channels(joint);
        let places = names.each_ref().map(|name| log.channels.iter().position(|c| c.name == *name));
        let missing = |channel: &String| ConditioningError::MissingChannel {
            log: log.name.clone(),
            channel: channel.clone(),
        };
        match places {
            [None, None] => {}
            [Some(x), Some(y)] => {
                for place in [x, y] {
                    check(&log.channels[place], contact.journal_radius)?;
                    let [rate, acceleration] = derivative_channels(&log.channels[place].name);
                    let [offset, first, second] =
                        derivatives(&log.channels[place].values, log.rate_hz, settings)
                            .map_err(ConditioningError::from)?;
                    log.channels[place].values = offset;
                    log.channels.push(Channel { name: rate, values: first });
                    log.channels.push(Channel { name: acceleration, values: second });
                }
            }
            [None, Some(_)] => return Err(missing(&names[0]).into()),
            [Some(_), None] => return Err(missing(&names[1]).into()),
        }
    }
    Ok(())
}

/// Refuses offsets that no journal has.
fn check(offset: &Channel, radius: f64) -> Result<(), Error> {
    let largest = offset.values.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
    if largest <= radius {
        return Ok(());
    }
    let expected = format!(
        "offsets of the journal in m, below its radius of {radius} m: give the unit, `{} = {{ column = \"{}\", scale = 1e-6 }}` for µm",
        offset.name, offset.name
    );
    Err(Error::setting(&format!("columns.channels.{}", offset.name), &expected, format!("{largest} m")))
}

/// A signal through its filter, with both derivatives.
fn derivatives(
    signal: &[f64],
    rate_hz: f64,
    settings: &ConditioningSettings,
) -> Result<[Vec<f64>; 3], SignalError> {
    let cutoffs = &settings.cutoff;
    let noise = position_noise(signal, rate_hz, &settings.noise)?;
    let cutoff_hz = noise.crossing_hz.map(|hz| (cutoffs.crossings * hz).min(cutoffs.state_rate * rate_hz));
    let clean = match cutoff_hz {
        Some(hz) => forward_backward(&butterworth(settings.state_order, hz, rate_hz)?, signal)?,
        None => signal.to_vec(),
    };
    let (window, order) = STENCIL;
    let stencil = SavitzkyGolay::new(window, order)?;
    Ok([stencil.filter(&clean, 1, rate_hz)?, stencil.filter(&clean, 2, rate_hz)?])
        .map(|[first, second]| [clean, first, second])
}
