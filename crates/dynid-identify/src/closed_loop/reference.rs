//! What the controller of a recorded motion wanted.

use dynid_model::RobotModel;
use dynid_motion::trajectory::{Point, Sequence, Trajectory};
use dynid_rows::conditioning::PreparedLog;
use dynid_sim::Wanted;

use crate::Error;
use crate::log::LogReference;

/// Name of the channel that holds the reference of a joint.
pub fn reference_channel(joint: &str) -> String {
    format!("reference_{joint}")
}

/// Reference of one log, in the order of the model's joints; time from the first sample of the log on.
pub(super) enum Reference {
    /// Samples on the grid of the log.
    Sampled { rate_hz: f64, position: Vec<Vec<f64>> },
    /// A trajectory file, coordinate of every joint, and where in it the log begins, s.
    File { sequence: Sequence, order: Vec<usize>, from: f64 },
}

impl Reference {
    /// From channels of the log, else from what is stated.
    ///
    /// # Errors
    /// [`Error::Setting`] without any of them, or with channels of some joints only; [`Error::Unsupported`]
    /// for a part of a log with a trajectory file.
    pub(super) fn of(
        stated: Option<&LogReference>,
        model: &RobotModel,
        log: &PreparedLog,
    ) -> Result<Self, Error> {
        let joints: Vec<String> = model.joints().iter().map(|j| j.name.clone()).collect();
        let channel = |joint: &String| log.channels.iter().find(|c| c.name == reference_channel(joint));
        if joints.iter().any(|joint| channel(joint).is_some()) {
            let position = joints.iter().map(|joint| {
                channel(joint).map(|c| c.values.clone()).ok_or_else(|| Error::InFile {
                    file: log.name.clone(),
                    source: Box::new(Error::setting(
                        "instruments.reference",
                        &format!("a reference of every joint, channel `{}`", reference_channel(joint)),
                        "none",
                    )),
                })
            });
            let position = position.collect::<Result<_, _>>()?;
            return Ok(Reference::Sampled { rate_hz: log.rate_hz, position });
        }
        let Some(LogReference { trajectory, file, cut, part }) = stated else {
            return Err(Error::setting(
                "instruments.reference",
                "columns of the reference, or a `trajectory` file",
                "neither",
            ));
        };
        if *part {
            return Err(Error::Unsupported(format!(
                "{}: where in the trajectory a part of the log begins is not known: state the columns of the reference \
                 (`instruments.reference`)",
                log.name
            )));
        }
        let order = trajectory.order_of(&joints).map_err(|joint| Error::InFile {
            file: file.clone(),
            source: Box::new(Error::setting("joints", &format!("a trajectory of joint `{joint}`"), "none")),
        })?;
        let approach = trajectory.approach.as_ref().filter(|_| *cut);
        let from = approach.map_or(0.0, |leg| leg.duration_s);
        Ok(Reference::File { sequence: trajectory.sequence()?, order, from })
    }

    /// Position, velocity and acceleration of all joints at a time.
    pub(super) fn at(&self, time: f64) -> Vec<Wanted> {
        match self {
            Reference::Sampled { rate_hz, position } => {
                position.iter().map(|samples| sampled(samples, *rate_hz, time)).collect()
            }
            Reference::File { sequence, order, from } => {
                let mut points = vec![Point::default(); sequence.coordinates()];
                sequence.at(from + time, &mut points);
                let wanted = |p: Point| [p.position, p.velocity, p.acceleration];
                order.iter().map(|c| wanted(points[*c])).collect()
            }
        }
    }
}

/// Cubic through two samples with the slopes of central differences, its slope, and the central second difference.
fn sampled(samples: &[f64], rate_hz: f64, time: f64) -> Wanted {
    let last = samples.len() - 1;
    let at = |k: isize| samples[k.clamp(0, last as isize) as usize];
    let place = (time * rate_hz).clamp(0.0, last as f64);
    let k = (place.round() as isize - isize::from(place.round() > place)).min(last as isize);
    let u = place - k as f64;
    let slope = |k: isize| 0.5 * (at(k + 1) - at(k - 1));
    let curve = |k: isize| at(k + 1) - 2.0 * at(k) + at(k - 1);
    let (a, b, da, db) = (at(k), at(k + 1), slope(k), slope(k + 1));
    let (second, third) = (3.0 * (b - a) - 2.0 * da - db, 2.0 * (a - b) + da + db);
    [
        a + u * (da + u * (second + u * third)),
        rate_hz * (da + u * (2.0 * second + 3.0 * u * third)),
        rate_hz * rate_hz * ((1.0 - u) * curve(k) + u * curve(k + 1)),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_are_met_and_quadratics_followed_between_them() {
        let samples: Vec<f64> = (0..20).map(|k| 0.3 - 0.2 * f64::from(k) + 0.05 * f64::from(k * k)).collect();
        for place in [3.0, 3.25, 7.999_999_999, 8.5, 17.0] {
            let [q, dq, ddq] = sampled(&samples, 10.0, place / 10.0);
            assert!((q - (0.3 - 0.2 * place + 0.05 * place * place)).abs() < 1e-12);
            assert!((dq - 10.0 * (-0.2 + 0.1 * place)).abs() < 1e-10);
            assert!((ddq - 10.0).abs() < 1e-9);
        }
        assert_eq!(sampled(&samples, 10.0, 99.0)[0], samples[19]);
    }
}
