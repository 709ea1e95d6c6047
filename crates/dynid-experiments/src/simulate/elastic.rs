//! Virtual logs of robots with motors behind springs.

use std::cell::RefCell;

use dynid_identify::Error;
use dynid_identify::robot::Robot;
use dynid_model::{EffortModel, Mechanism, RobotModel};
use dynid_motion::trajectory::Fourier;
use dynid_sim::{ElasticInverse, LinkMotion, Profile, SimError, Wanted, fourier_link};

use super::Moved;
use super::trajectory::Reference;

/// Width of smooth signs, as a share of the rms speed of the slowest joint that moves.
const SIGN_SHARE: f64 = 0.01;

/// Motion and efforts of all coordinates along a reference of the joints: signals as `[q, dq, ddq]`, coordinate after
/// coordinate, and the effort per output. `load`: the bodies behind torque sensors.
///
/// # Errors
/// [`Error::Unsupported`] for a trajectory file, which says nothing of the third and fourth derivative that motors follow;
/// [`Error::Experiment`].
pub(super) fn along(
    (model, load): (&RobotModel, Option<&Mechanism>),
    (reference, profiles): (&Reference, &[Profile]),
    values: &[f64],
    shift: f64,
    (samples, rate_hz): (usize, f64),
) -> Result<Moved, Error> {
    let series = fourier(reference)?;
    let shape = model.parameters().shape_start();
    let mut inverse = ElasticInverse::new(model, values, &shape, sign_width(series))?;
    if let Some(mechanism) = load {
        inverse = inverse.with_load(mechanism)?;
    }
    let links: Vec<_> = series.iter().map(fourier_link).collect();
    let n = model.joints().len();
    let mut signals = [vec![0.0; n * samples], vec![0.0; n * samples], vec![0.0; n * samples]];
    let mut efforts = vec![vec![0.0; samples]; n];
    for s in 0..samples {
        let time = (s as f64 + shift) / rate_hz;
        let wanted: Vec<LinkMotion> = links.iter().map(|link| link(time)).collect();
        let channels: Vec<[f64; 3]> = profiles.iter().map(|p| [p.at(time), p.slope(time), 0.0]).collect();
        let found = inverse.at(&wanted, &channels)?;
        for j in 0..n {
            signals[0][j * samples + s] = found.q[j];
            signals[1][j * samples + s] = found.dq[j];
            signals[2][j * samples + s] = found.ddq[j];
            efforts[j][s] = if model.is_undriven(j) { 0.0 } else { found.effort[j] };
        }
    }
    Ok((signals, efforts))
}

fn fourier(reference: &Reference) -> Result<&[Fourier], Error> {
    match reference {
        Reference::Series(series) => Ok(series),
        Reference::File(..) => Err(Error::Unsupported(
            "a robot with elastic joints follows Fourier series alone: leave out `follow`".to_owned(),
        )),
    }
}

/// Wanted motion of all coordinates in closed loop: that of the links is the reference, and motors go where the springs of the model that
/// the controller believes in ask for ([`ElasticInverse`]), their damping left out.
pub(super) struct Follower<'a> {
    inverse: ElasticInverse<'a>,
    links: Vec<Box<dyn Fn(f64) -> LinkMotion>>,
    profiles: &'a [Profile],
    /// Why there is nothing more to follow.
    fault: RefCell<Option<SimError>>,
}

impl<'a> Follower<'a> {
    /// `believed`: linear parameters of the controller's model.
    ///
    /// # Errors
    /// [`Error::Unsupported`] for a trajectory file, as [`along`]; [`Error::Experiment`] where the springs have no inverse.
    pub(super) fn new(
        model: &'a RobotModel,
        believed: &'a [f64],
        shape: &'a [f64],
        reference: &Reference,
        profiles: &'a [Profile],
    ) -> Result<Self, Error> {
        let series = fourier(reference)?;
        Ok(Follower {
            inverse: ElasticInverse::new(model, believed, shape, sign_width(series))?,
            links: series
                .iter()
                .map(|s| Box::new(fourier_link(s)) as Box<dyn Fn(f64) -> LinkMotion>)
                .collect(),
            profiles,
            fault: RefCell::new(None),
        })
    }

    /// Position, velocity and acceleration of all coordinates at a time; of none where motors cannot follow, which ends the experiment
    /// and leaves its reason in [`Follower::fault`].
    pub(super) fn at(&self, time: f64) -> Vec<Wanted> {
        let links: Vec<LinkMotion> = self.links.iter().map(|link| link(time)).collect();
        let channels: Vec<[f64; 3]> =
            self.profiles.iter().map(|p| [p.at(time), p.slope(time), 0.0]).collect();
        match self.inverse.at(&links, &channels) {
            Ok(motion) => motion.wanted(),
            Err(fault) => {
                *self.fault.borrow_mut() = Some(fault);
                Vec::new()
            }
        }
    }

    /// Why the motors could not follow, if they could not.
    pub(super) fn fault(self) -> Option<SimError> {
        self.fault.into_inner()
    }
}

/// Refuses torque sensors where a controller moves the robot.
pub(super) fn refuse_sensors(robot: &Robot) -> Result<(), Error> {
    match robot.elements.elastic.iter().find(|e| e.sensor) {
        None => Ok(()),
        Some(e) => Err(Error::Unsupported(format!(
            "joint `{}` is elastic with a torque sensor, which measures what moves the bodies: no model of the joint alone has them, \
             as a closed loop needs: leave out `sensor`, or simulate by inverse dynamics",
            e.joint
        ))),
    }
}

/// Parameters with undamped springs: with damping the deformation depends on the motion before, which no reference has.
pub(super) fn undamped(model: &RobotModel, linear: &[f64]) -> Vec<f64> {
    let mut out = linear.to_vec();
    for (element, _) in model.elastic_transmissions(linear) {
        let name = format!("{}.d", model.joints()[element.link].name);
        if let Some(column) = model.parameters().column(&name) {
            out[column] = 0.0;
        }
    }
    out
}

/// What a user should know where no body loads the torque sensors.
pub(super) fn unloaded(load: &Mechanism) -> Option<String> {
    let bodies = load.bodies();
    bodies.iter().all(|b| b.inertia.mass() == 0.0).then(|| {
        format!(
            "no body loads the torque sensors, so that friction alone winds up the springs: state the inertia of `{}` \
             (`mass`, `com`, `inertia_com`) in the robot file",
            bodies.iter().map(|b| b.name.as_str()).collect::<Vec<_>>().join("`, `")
        )
    })
}

/// Speed over which signs of velocities are smooth, rad/s or m/s.
fn sign_width(series: &[Fourier]) -> f64 {
    const INSTANTS: u32 = 1000;
    let rms = |f: &Fourier| {
        let period = std::f64::consts::TAU / f.base();
        let squares =
            (0..INSTANTS).map(|k| f.at(period * f64::from(k) / f64::from(INSTANTS)).velocity.powi(2));
        (squares.sum::<f64>() / f64::from(INSTANTS)).sqrt()
    };
    SIGN_SHARE * series.iter().map(rms).filter(|v| *v > 0.0).reduce(f64::min).unwrap_or(0.0)
}
