//! Forces that press on joints with friction, and the channels by which elements read them.

use dynid_model::element::{reaction_channel, weight_channel};
use dynid_model::{ClosedModel, EffortModel, LoadGroup, Reaction};

/// Loads on joints, and where elements read them.
#[derive(Debug, Clone, Default)]
pub(super) struct Loads {
    pub(super) joints: Vec<Pressed>,
    /// Where every channel of the tree comes from.
    sources: Vec<Source>,
    /// Bodies whose joint wrenches are asked for.
    pub(super) bodies: Vec<usize>,
}

/// A joint that forces press on.
#[derive(Debug, Clone)]
pub(super) struct Pressed {
    pub(super) name: String,
    pub(super) groups: Vec<LoadGroup>,
    /// Steady force.
    weight: f64,
}

#[derive(Debug, Clone, Copy)]
enum Source {
    Given(usize),
    Force(usize),
    Weight(usize),
}

impl Loads {
    pub(super) fn new(model: &ClosedModel, linear: &[f64]) -> Loads {
        let names = model.tree().joints();
        let joints: Vec<Pressed> = model
            .loads()
            .iter()
            .map(|load| {
                let steady: f64 = load.weight.iter().map(|(column, factor)| factor * linear[*column]).sum();
                Pressed {
                    name: names[load.rate].name.clone(),
                    groups: load.reactions.clone(),
                    weight: (load.constant + steady).max(0.0),
                }
            })
            .collect();
        let mut given = 0;
        let mut source = |channel: &String| {
            for (k, joint) in joints.iter().enumerate() {
                if *channel == reaction_channel(&joint.name) {
                    return Source::Force(k);
                }
                if *channel == weight_channel(&joint.name) {
                    return Source::Weight(k);
                }
            }
            given += 1;
            Source::Given(given - 1)
        };
        let sources = model.tree().channels().iter().map(&mut source).collect();
        let mut bodies: Vec<usize> = joints
            .iter()
            .flat_map(|j| j.groups.iter().flat_map(|g| &g.components))
            .filter_map(|c| match c {
                Reaction::Joint { body, .. } => Some(*body),
                Reaction::Multiplier { .. } => None,
            })
            .collect();
        bodies.sort_unstable();
        bodies.dedup();
        Loads { joints, sources, bodies }
    }

    /// Channels of the tree, then signals, from those of the model, then signals, and forces.
    pub(super) fn channels(&self, given: &[f64], forces: &[f64]) -> Vec<f64> {
        let own = self.sources.iter().map(|source| match source {
            Source::Given(k) => given[*k],
            Source::Force(k) => forces[*k],
            Source::Weight(k) => self.joints[*k].weight,
        });
        let before = self.sources.iter().filter(|s| matches!(s, Source::Given(_))).count();
        own.chain(given[before..].iter().copied()).collect()
    }
}
