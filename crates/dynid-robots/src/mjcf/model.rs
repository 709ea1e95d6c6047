//! What is read of a model: its description, and which element says what.

use std::collections::HashMap;

use dynid_model::closed::ClosureDescription;
use dynid_model::{Description, Inertia, LinkDescription, Placement, Vec3};

use super::document::Element;
use super::{JointParameters, PositionActuator};
use crate::ElementSpec;

/// Name of the body that every MJCF has.
pub(super) const WORLD: &str = "world";

/// A body and the elements that state it.
#[derive(Debug)]
pub(super) struct BodyPart<'a> {
    /// The link that carries its frame; the body's name.
    pub(super) link: String,
    pub(super) element: &'a Element,
    /// Its `<inertial>`, and where frames around that put it.
    pub(super) inertial: Option<(&'a Element, Placement)>,
    /// Origin of the body's frame in the frame of its link, m.
    pub(super) shift: Vec3<f64>,
    /// Whether it is one of the copies of a `<replicate>`.
    pub(super) copied: bool,
}

/// A joint with one coordinate and its element.
#[derive(Debug)]
pub(super) struct JointPart<'a> {
    pub(super) element: &'a Element,
    pub(super) parameters: JointParameters,
    /// Its position where the body is as drawn.
    pub(super) zero: f64,
    /// Radians, or metres, of the numbers of its element.
    pub(super) unit: f64,
    pub(super) copied: bool,
}

/// Where a body is, for what refers to it by name.
#[derive(Clone, Debug)]
pub(super) struct BodyFrame {
    pub(super) link: String,
    /// Frame of the body in that of its link.
    pub(super) in_link: Placement,
    /// Frame of the body in the world, as drawn.
    pub(super) drawn: Placement,
    pub(super) moves: bool,
    /// Whether a user moves it by hand.
    pub(super) mocap: bool,
}

/// A model that has been read.
#[derive(Debug)]
pub(super) struct Model<'a> {
    pub(super) description: Description,
    pub(super) elements: ElementSpec,
    pub(super) bodies: Vec<BodyPart<'a>>,
    pub(super) joints: Vec<JointPart<'a>>,
    /// Bodies by name.
    pub(super) frames: HashMap<String, BodyFrame>,
    /// Sites by name: body and place in its frame.
    pub(super) sites: HashMap<String, (String, Placement)>,
    pub(super) closures: Vec<ClosureDescription>,
    /// Joints that actuators drive, in the order of the actuators.
    pub(super) driven: Vec<String>,
    /// Position loops that actuators close.
    pub(super) position_actuators: Vec<PositionActuator>,
    pub(super) home: Vec<(String, Vec<f64>)>,
    /// What a user should know.
    pub(super) warnings: Vec<String>,
}

impl Model<'_> {
    pub(super) fn new(name: &str) -> Self {
        let world = BodyFrame {
            link: WORLD.to_owned(),
            in_link: Placement::identity(),
            drawn: Placement::identity(),
            moves: false,
            mocap: false,
        };
        let mut description = Description::new(name);
        description.links.push(LinkDescription { name: WORLD.to_owned(), inertia: None });
        Model {
            description,
            elements: ElementSpec::default(),
            bodies: Vec::new(),
            joints: Vec::new(),
            frames: HashMap::from([(WORLD.to_owned(), world)]),
            sites: HashMap::new(),
            closures: Vec::new(),
            driven: Vec::new(),
            position_actuators: Vec::new(),
            home: Vec::new(),
            warnings: Vec::new(),
        }
    }

    /// The inertia of a link.
    pub(super) fn inertia(&self, link: &str) -> Option<Inertia> {
        self.description.links.iter().find(|l| l.name == link)?.inertia
    }
}
