//! Virtual logs of robots with motors behind springs.

use dynid_model::{EffortModel, Mechanism, RobotModel};
use dynid_motion::trajectory::Fourier;
use dynid_sim::{ElasticInverse, LinkMotion, Profile, fourier_link};

use super::Moved;
use super::trajectory::Reference;
use crate::Error;

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
    let Reference::Series(series) = reference else {
        return Err(Error::Unsupported(
            "a robot with elastic joints follows Fourier series alone: leave out `follow`".to_owned(),
        ));
    };
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
