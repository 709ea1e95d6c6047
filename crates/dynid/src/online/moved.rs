//! What may move, in words and as directions of the base parameters.

use std::collections::BTreeMap;

use dynid_estimate::online::{ChangeHypothesis, ChangeJudgement};
use dynid_linalg::Mat;
use dynid_model::{EffortModel, Owner};

use super::event::{Moved, MovedParameter};
use super::learning::Structure;
use crate::prior::Prior;

/// Directions shorter than this share of the longest one do not act.
const SILENT: f64 = 1e-9;
/// A jump is told if it is known to this share of what was possible.
const KNOWN: f64 = 0.3;
/// Hypotheses reported beside those that moved.
const ALTERNATIVES: usize = 3;
/// A body that is picked up or lost: its share of the robot's mass, and its size, m.
const CARRIED: f64 = 0.1;
const ACROSS: f64 = 0.15;

/// Hypotheses with the standard parameters behind their jumps.
#[derive(Debug)]
pub(super) struct Hypotheses {
    pub(super) list: Vec<ChangeHypothesis>,
    /// Per hypothesis: columns of the standard parameters that jump; empty: the base parameters themselves.
    columns: Vec<Vec<usize>>,
}

impl Hypotheses {
    /// Every link, the elements of every joint, every single parameter, and everything at once. Jumps may go as far as [`reaches`]
    /// says. `scale`: units of the base parameters.
    pub(super) fn new(structure: &Structure, prior: &Prior, scale: &[f64]) -> Hypotheses {
        let parameters = &structure.model.parameters().linear;
        let reach = reaches(structure, prior);
        let acting: Vec<usize> =
            (0..parameters.len()).filter(|c| acts(&structure.regrouping, *c, scale)).collect();
        let mut groups: BTreeMap<(u8, String), Vec<usize>> = BTreeMap::new();
        let mut order = Vec::new();
        for c in &acting {
            let key = match &parameters[*c].owner {
                Owner::Link(link) => (0, format!("link `{link}`")),
                Owner::Joint(joint) => (1, format!("joint `{joint}`")),
            };
            if !groups.contains_key(&key) {
                order.push(key.clone());
            }
            groups.entry(key).or_default().push(*c);
        }
        let mut out = Hypotheses { list: Vec::new(), columns: Vec::new() };
        let mut add = |name: String, columns: Vec<usize>| {
            let entry = |row: usize, c: usize| structure.regrouping[(row, c)] / scale[row];
            out.list.push(ChangeHypothesis {
                name,
                directions: columns.iter().flat_map(|c| (0..scale.len()).map(|row| entry(row, *c))).collect(),
                std: columns.iter().map(|c| reach[*c]).collect(),
            });
            out.columns.push(columns);
        };
        for key in order {
            if groups[&key].len() > 1 {
                add(key.1.clone(), groups[&key].clone());
            }
        }
        for c in acting {
            add(parameters[c].name.clone(), vec![c]);
        }
        let p = scale.len();
        out.list.push(ChangeHypothesis {
            name: "several things".to_owned(),
            directions: (0..p * p).map(|k| f64::from(u8::from(k % (p + 1) == 0))).collect(),
            std: vec![1.0; p],
        });
        out.columns.push(Vec::new());
        out
    }

    /// What a judgement says in words, and what else would explain it alone.
    pub(super) fn tell(
        &self,
        structure: &Structure,
        judgement: &ChangeJudgement,
    ) -> (Vec<Moved>, Vec<(String, f64)>) {
        let table = structure.model.parameters();
        let mut jumps = judgement.jumps.iter();
        let moved = judgement.moved.iter().map(|judged| {
            let hypothesis = &self.list[judged.hypothesis];
            let own: Vec<&(f64, f64)> = jumps.by_ref().take(hypothesis.std.len()).collect();
            let known = self.columns[judged.hypothesis].iter().zip(own).zip(&hypothesis.std);
            let parameters = known
                .filter(|((_, (_, std)), possible)| *std < KNOWN * **possible)
                .map(|((column, (jump, std)), _)| MovedParameter {
                    name: table.linear[*column].name.clone(),
                    jump: *jump,
                    std: *std,
                })
                .collect();
            Moved { what: hypothesis.name.clone(), share: judged.share, parameters }
        });
        let moved: Vec<Moved> = moved.collect();
        let others =
            judgement.alone.iter().filter(|a| judgement.moved.iter().all(|m| m.hypothesis != a.hypothesis));
        let others = others.take(ALTERNATIVES).map(|a| (self.list[a.hypothesis].name.clone(), a.share));
        let others = if judgement.confirmed { others.collect() } else { Vec::new() };
        (moved, others)
    }
}

/// How far a parameter may jump: as far as was not known of it, and what belongs to a body as far as something
/// of a tenth of the robot's mass, 0.15 m across, would move it.
fn reaches(structure: &Structure, prior: &Prior) -> Vec<f64> {
    let bodies = structure.model.mechanism().bodies().len();
    let total: f64 = (0..bodies).map(|b| prior.values[10 * b]).sum();
    let mass = CARRIED * total;
    let carried = [mass, mass * ACROSS, mass * ACROSS * ACROSS];
    let of_body = |c: usize| carried[[0, 1, 1, 1, 2, 2, 2, 2, 2, 2][c % 10]];
    prior
        .std
        .iter()
        .enumerate()
        .map(|(c, std)| if c < 10 * bodies { std.max(of_body(c)) } else { *std })
        .collect()
}

fn acts(regrouping: &Mat, column: usize, scale: &[f64]) -> bool {
    let length = |c: usize| -> f64 {
        (0..scale.len()).map(|row| (regrouping[(row, c)] / scale[row]).powi(2)).sum::<f64>().sqrt()
    };
    let longest = (0..regrouping.ncols()).map(length).fold(0.0, f64::max);
    length(column) > SILENT * longest
}
