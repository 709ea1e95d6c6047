//! Inverse simulation of elastic joints: from the motion of links to that of their motors.
//!
//! The link's row of the equation of motion gives the torque of its transmission, `T_k = rigid_j + e_out + load`. The spring
//! inverted, `Δ` follows, and the motor's motion `θ = N (q + Δ)`, then the drive's effort from the motor's row. No stiff
//! equation is integrated. For the motor's acceleration the torque is needed with two time derivatives, hence the motion of
//! the links with four (Spong 1987):
//!
//! ```text
//! S = k1 + 3 k2 Δ²        Δ̇ = Ṫ/S        Δ̈ = (T̈ - 6 k2 Δ Δ̇²)/S
//! ```
//!
//! Time derivatives are exact: the recursion of the bodies and the laws of the elements run over [`Jet`]s.
//!
//! With the exact sign, friction on the link's side is constant between reversals and jumps at them, and with it `T_k`, `Δ`
//! and the motor's position: leave rows next to reversals out, or smooth the sign; accelerations of motors then have peaks
//! there.

use dynid_model::element::{CubicSpring, JetMotion};
use dynid_model::scalar::Jet;
use dynid_model::{Dynamics, EffortModel, Mechanism, MotionBlock, RobotModel, State};

use dynid_motion::trajectory::Fourier;

use crate::controller::Wanted;
use crate::error::{SimError, demand, demand_length};

/// Position of a link and its first four derivatives by time. Without the fourth the motor's acceleration is wrong, without
/// the third its rate too; its position needs the first two alone.
pub type LinkMotion = [f64; 5];

/// A link that follows a Fourier series, as a function of time.
pub fn fourier_link(series: &Fourier) -> impl Fn(f64) -> LinkMotion + use<> {
    let (series, second) = (series.clone(), series.derivative().derivative());
    move |time| {
        let (low, high) = (series.at(time), second.at(time));
        [low.position, low.velocity, high.position, high.velocity, high.acceleration]
    }
}

/// An elastic robot with values of its parameters, to be inverted.
#[derive(Debug)]
pub struct ElasticInverse<'a> {
    model: &'a RobotModel,
    linear: &'a [f64],
    shape: &'a [f64],
    sign_width: f64,
    dynamics: Dynamics,
    inertias: Vec<Jet>,
    /// Per joint of the bodies: its rate in the model.
    carried: Vec<usize>,
    transmissions: Vec<Transmission>,
    /// Rates that are no motor of a transmission.
    links: Vec<usize>,
}

#[derive(Debug)]
struct Transmission {
    link: usize,
    motor: usize,
    ratio: f64,
    spring: CubicSpring,
}

/// Motion, torques and efforts of an elastic robot at one instant.
#[derive(Debug, Clone, PartialEq)]
pub struct ElasticMotion {
    /// Positions of all coordinates of the model.
    pub q: Vec<f64>,
    /// Rates.
    pub dq: Vec<f64>,
    /// Accelerations.
    pub ddq: Vec<f64>,
    /// Per transmission: torque `T_k` with its first and second time derivative, N m or N.
    pub torque: Vec<[f64; 3]>,
    /// Per transmission: deformation `Δ` with its first and second time derivative, rad or m.
    pub deformation: Vec<[f64; 3]>,
    /// Efforts of the model's outputs; of links behind a transmission zero up to rounding.
    pub effort: Vec<f64>,
}

impl ElasticMotion {
    /// What a controller is to follow, for all coordinates: the reference of motors that goes with that of the links.
    pub fn wanted(&self) -> Vec<Wanted> {
        (0..self.q.len()).map(|c| [self.q[c], self.dq[c], self.ddq[c]]).collect()
    }
}

impl<'a> ElasticInverse<'a> {
    /// Joins a model with its parameters.
    ///
    /// `sign_width`: rad/s or m/s, as [`MotionBlock::sign_width`]; 0: the sign itself.
    ///
    /// # Errors
    /// [`SimError::FloatingBase`]; [`SimError::Length`]; [`SimError::Setting`] for a transmission with damping (its
    /// deformation then depends on the motion before), one whose motor is no coordinate without bodies, a motor or a link of
    /// two transmissions, or a motor that is a link too.
    pub fn new(
        model: &'a RobotModel,
        linear: &'a [f64],
        shape: &'a [f64],
        sign_width: f64,
    ) -> Result<Self, SimError> {
        let (positions, rates) = model.dimensions();
        if positions != rates {
            return Err(SimError::FloatingBase);
        }
        demand_length("linear parameters", model.parameters().linear.len(), linear.len())?;
        demand_length("shape parameters", model.parameters().shape.len(), shape.len())?;
        demand(sign_width >= 0.0 && sign_width.is_finite(), "sign_width", "a number from 0 on", sign_width)?;
        let name = |rate: usize| model.joints()[rate].name.clone();
        let joints = rates - model.coordinates().len();
        let mut transmissions: Vec<Transmission> = Vec::new();
        for (element, values) in model.elastic_transmissions(linear) {
            let (link, motor) = (element.link, element.motor);
            let damping = values.last().copied().filter(|_| element.damping).unwrap_or(0.0);
            demand(damping == 0.0, "damping of a transmission", "0 in an inverse simulation", damping)?;
            demand(motor >= joints, "motor", "a coordinate without bodies", name(motor))?;
            let taken = |rate: usize| transmissions.iter().any(|t| t.link == rate || t.motor == rate);
            demand(!taken(link) && link != motor, "link", "a joint of one transmission", name(link))?;
            demand(!taken(motor), "motor", "a coordinate of one transmission", name(motor))?;
            let spring = element.spring(&values);
            transmissions.push(Transmission { link, motor, ratio: element.ratio, spring });
        }
        let dynamics = Dynamics::new(model.mechanism());
        let inertias = linear[..dynamics.inertial_parameters()].iter().map(|x| Jet::new([*x, 0.0, 0.0]));
        Ok(ElasticInverse {
            inertias: inertias.collect(),
            carried: (0..joints).collect(),
            links: (0..rates).filter(|rate| transmissions.iter().all(|t| t.motor != *rate)).collect(),
            model,
            linear,
            shape,
            sign_width,
            dynamics,
            transmissions,
        })
    }

    /// Bodies behind torque sensors, which a model without bodies does not have: joints of `mechanism` are links of the model by
    /// name, and what its bodies ask for is the load of their transmissions.
    ///
    /// # Errors
    /// [`SimError::Setting`] for a model that has bodies, or a joint that is no link of it.
    pub fn with_load(mut self, mechanism: &Mechanism) -> Result<Self, SimError> {
        let none = self.dynamics.rates() == 0;
        demand(none, "load", "a model whose sensors measure all loads", "one with bodies")?;
        let joints = self.model.joints();
        let rate = |name: String| match self.links.iter().find(|rate| joints[**rate].name == name) {
            Some(rate) => Ok(*rate),
            None => Err(SimError::Setting { name: "load", expected: "links of the model", found: name }),
        };
        self.carried = mechanism.rate_names().into_iter().map(rate).collect::<Result<_, _>>()?;
        self.dynamics = Dynamics::new(mechanism);
        self.inertias = mechanism.inertia_vector().into_iter().map(|x| Jet::new([x, 0.0, 0.0])).collect();
        Ok(self)
    }

    /// The rates whose motion is to be given, ascending: all but the motors of transmissions.
    pub fn links(&self) -> &[usize] {
        &self.links
    }

    /// Motion of the whole robot and efforts of its drives.
    ///
    /// `links`: one per entry of [`ElasticInverse::links`]. `channels`: value, first and second time derivative of every
    /// channel of the model. Elements that remember the motion before are in their steady state.
    ///
    /// # Errors
    /// [`SimError::Length`]; [`SimError::Overloaded`] where a spring cannot carry the torque;
    /// [`SimError::NoTimeDerivatives`] for an element at a link behind a transmission that does not offer them.
    pub fn at(&self, links: &[LinkMotion], channels: &[[f64; 3]]) -> Result<ElasticMotion, SimError> {
        demand_length("motion of links", self.links.len(), links.len())?;
        demand_length("channels", self.model.channels().len(), channels.len())?;
        let torques = self.link_torques(links, channels)?;
        let rates = self.model.joints().len();
        let mut motion = ElasticMotion {
            q: vec![0.0; rates],
            dq: vec![0.0; rates],
            ddq: vec![0.0; rates],
            torque: torques.iter().map(|t| t.derivatives()).collect(),
            deformation: Vec::with_capacity(torques.len()),
            effort: vec![0.0; rates],
        };
        for (rate, link) in self.links.iter().zip(links) {
            [motion.q[*rate], motion.dq[*rate], motion.ddq[*rate]] = [link[0], link[1], link[2]];
        }
        for (t, torque) in self.transmissions.iter().zip(torques) {
            let deformation = t.spring.deformation_jet(torque).ok_or_else(|| SimError::Overloaded {
                joint: self.model.joints()[t.link].name.clone(),
                torque: torque.value,
            })?;
            let deformation = deformation.derivatives();
            let signals = [&mut motion.q, &mut motion.dq, &mut motion.ddq];
            for (signal, x) in signals.into_iter().zip(deformation) {
                signal[t.motor] = t.ratio * (signal[t.link] + x);
            }
            motion.deformation.push(deformation);
        }
        let names = self.model.channels().iter().map(String::as_str);
        let channels: Vec<(&str, &[f64])> = names.zip(channels).map(|(n, c)| (n, &c[..1])).collect();
        let block = MotionBlock {
            channels: &channels,
            sign_width: self.sign_width,
            ..MotionBlock::plain(1, &motion.q, &motion.dq, &motion.ddq)
        };
        self.model.efforts(&block, self.shape, self.linear, 1, &mut motion.effort);
        Ok(motion)
    }

    /// Torques of all transmissions.
    fn link_torques(&self, links: &[LinkMotion], channels: &[[f64; 3]]) -> Result<Vec<Jet>, SimError> {
        let rates = self.model.joints().len();
        let signal = |order: usize| {
            let mut jets = vec![Jet::default(); rates];
            for (rate, link) in self.links.iter().zip(links) {
                jets[*rate] = Jet::new([link[order], link[order + 1], link[order + 2]]);
            }
            jets
        };
        let (q, dq, ddq) = (signal(0), signal(1), signal(2));
        let of_bodies = |signal: &[Jet]| self.carried.iter().map(|rate| signal[*rate]).collect::<Vec<Jet>>();
        let carried = [of_bodies(&q), of_bodies(&dq), of_bodies(&ddq)];
        let state = State { q: &carried[0], dq: &carried[1], ddq: &carried[2], gravity: None };
        let mut rigid = vec![Jet::default(); self.carried.len()];
        self.dynamics.inverse_dynamics(&state, &self.inertias, &mut self.dynamics.workspace(), &mut rigid);
        let mut effort = vec![Jet::default(); rates];
        self.carried.iter().zip(rigid).for_each(|(rate, own)| effort[*rate] = own);
        let names = self.model.channels().iter().map(String::as_str);
        let channels: Vec<(&str, Jet)> = names.zip(channels).map(|(n, c)| (n, Jet::new(*c))).collect();
        let motion =
            JetMotion { q: &q, dq: &dq, ddq: &ddq, channels: &channels, sign_width: self.sign_width };
        let behind = |rate: usize| self.transmissions.iter().any(|t| t.link == rate);
        self.model
            .element_jets(&motion, self.shape, self.linear, behind, &mut effort)
            .map_err(|parameter| SimError::NoTimeDerivatives { parameter })?;
        Ok(self.transmissions.iter().map(|t| effort[t.link]).collect())
    }
}
