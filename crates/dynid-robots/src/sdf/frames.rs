//! Frames of a model: links, joints, and those that it names.

use std::collections::HashMap;

use dynid_files::excerpt::{closest, excerpt};
use dynid_model::Placement;

use super::document::{Document, Element};
use super::pose::Pose;
use crate::robot_error::RobotFileError;

/// Name of the frame of the model itself.
pub(super) const MODEL: &str = "__model__";
/// Most links, joints and frames of a model: places are worked out one by one.
const MAX_FRAMES: usize = 10_000;
/// Name of what everything stands in.
pub(super) const WORLD: &str = "world";

/// A frame with a name.
struct Frame<'a> {
    element: &'a Element,
    pose: Placement,
    /// Frame that the pose is in.
    within: String,
    /// Frame that it moves with; a link moves with itself.
    moves_with: Option<String>,
}

/// All frames of a model.
pub(super) struct Frames<'a> {
    document: &'a Document<'a>,
    frames: HashMap<String, Frame<'a>>,
    /// Model in the world.
    model: Placement,
    /// The link that the frame of the model moves with.
    canonical: String,
}

impl<'a> Frames<'a> {
    /// Reads the frames of a model.
    pub(super) fn of(document: &'a Document<'a>, model: &'a Element) -> Result<Self, RobotFileError> {
        let mut frames: HashMap<String, Frame<'a>> = HashMap::new();
        let mut first = None;
        for kind in ["link", "joint", "frame"] {
            for element in model.all(kind) {
                if frames.len() == MAX_FRAMES {
                    let (at, what) = (document.place(element), "links, joints and frames");
                    return Err(RobotFileError::TooMany { at, what, limit: MAX_FRAMES });
                }
                let name = document.name(element)?;
                let owner = format!("{kind} `{}`", excerpt(&name));
                if name.contains("::") || [MODEL, WORLD].contains(&name.as_str()) {
                    let reason = "the name has a meaning of its own in SDF";
                    return Err(document.refuse(element, &owner, reason, "rename it"));
                }
                if let Some(known) = frames.get(&name) {
                    // Older versions let a joint be called as its link; who says the name means the link.
                    if kind == "joint" && known.element.name == "link" {
                        continue;
                    }
                    let (at, first_line) = (document.place(element), document.place(known.element).line);
                    let kind = if kind == "link" { "link" } else { "frame" };
                    return Err(RobotFileError::Duplicate { at, kind, name: excerpt(&name), first_line });
                }
                let pose = Pose::of(document, element, &owner)?;
                let moves_with = match kind {
                    "link" => None,
                    "joint" => Some(document.required(element, &owner, "child")?.1.to_owned()),
                    _ => Some(element.attribute("attached_to").unwrap_or(MODEL).to_owned()),
                };
                if kind == "link" {
                    first.get_or_insert_with(|| name.clone());
                }
                let usual = moves_with.clone().unwrap_or_else(|| MODEL.to_owned());
                let within = pose.relative_to.unwrap_or(usual);
                frames.insert(name, Frame { element, pose: pose.placement, within, moves_with });
            }
        }
        let canonical = match (model.attribute("canonical_link"), first) {
            (Some(stated), _) => stated.to_owned(),
            (None, Some(first)) => first,
            (None, None) => {
                let (at, owner) = (document.place(model), "<model>".to_owned());
                return Err(RobotFileError::Missing { at, owner, expected: "a <link>".to_owned() });
            }
        };
        let mut frames = Frames { document, frames, model: Placement::identity(), canonical };
        frames.model = frames.of_model(model)?;
        Ok(frames)
    }

    /// The model in the world.
    fn of_model(&self, model: &Element) -> Result<Placement, RobotFileError> {
        let owner = "<model>";
        let pose = Pose::of(self.document, model, owner)?;
        if pose.relative_to.as_deref().is_some_and(|frame| frame != WORLD) {
            let reason = "its <pose> is relative to something else than the world";
            return Err(self.document.refuse(model, owner, reason, "state its pose in the world"));
        }
        match model.attribute("placement_frame") {
            None => Ok(pose.placement),
            Some(frame) => Ok(pose.placement.then(&self.place(frame, model, owner)?.inverse())),
        }
    }

    /// The frame of the model in the world.
    pub(super) fn model(&self) -> Placement {
        self.model
    }

    fn frame(&self, name: &str, from: &Element, owner: &str) -> Result<&Frame<'a>, RobotFileError> {
        self.frames.get(name).ok_or_else(|| match name.contains("::") {
            true => self.document.refuse(
                from,
                owner,
                format!("`{}` belongs to a model inside this one", excerpt(name)),
                "put its links and joints into the model itself",
            ),
            false => {
                let known: Vec<&String> = self.frames.keys().collect();
                RobotFileError::UnknownName {
                    at: self.document.place(from),
                    context: owner.to_owned(),
                    kind: "frame",
                    name: excerpt(name),
                    meant: closest(name, &known).map(str::to_owned),
                }
            }
        })
    }

    /// A frame in that of the model. `from` and `owner` say who names it.
    pub(super) fn place(&self, name: &str, from: &Element, owner: &str) -> Result<Placement, RobotFileError> {
        let mut chain = Vec::new();
        let mut name = name;
        loop {
            match name {
                MODEL => break,
                WORLD => {
                    chain.push(self.model.inverse());
                    break;
                }
                _ => {}
            }
            let frame = self.frame(name, from, owner)?;
            if chain.len() > self.frames.len() {
                let reason =
                    format!("the poses of frames refer to each other in a circle, `{}`", excerpt(name));
                return Err(self.document.refuse(
                    frame.element,
                    owner,
                    reason,
                    "let one be relative to the model",
                ));
            }
            chain.push(frame.pose);
            name = &frame.within;
        }
        Ok(chain.iter().rev().fold(Placement::identity(), |outer, inner| outer.then(inner)))
    }

    /// The link that a frame moves with, or the world.
    pub(super) fn link(&self, name: &str, from: &Element, owner: &str) -> Result<&str, RobotFileError> {
        let mut steps = 0;
        let (mut at, mut name) = (name, name);
        loop {
            match name {
                WORLD => return Ok(WORLD),
                MODEL => name = &self.canonical,
                _ => {}
            }
            let Some((known, frame)) = self.frames.get_key_value(name) else {
                return self.frame(name, from, owner).map(|_| WORLD);
            };
            let Some(next) = &frame.moves_with else { return Ok(known) };
            if steps > self.frames.len() {
                let reason = format!("`{}` is attached to itself by way of others", excerpt(at));
                return Err(self.document.refuse(
                    frame.element,
                    owner,
                    reason,
                    "attach one of them to a link",
                ));
            }
            steps += 1;
            (at, name) = (known, next);
        }
    }

    /// Whether the frame of a joint is that of its child link.
    pub(super) fn is_at(&self, joint: &str, link: &str) -> bool {
        self.frames.get(joint).is_some_and(|frame| {
            frame.element.name == "joint" && frame.within == link && frame.pose == Placement::identity()
        })
    }
}
