//! Where contacts leave the smooth branches of their laws, and where they go.

use super::Run;
use crate::clearance::branch::{Branch, Sliding};
use crate::clearance::record::ContactEventKind;
use crate::collocation::Path;
use crate::error::SimError;

/// Instants of a step at which branches are looked at.
const LOOKS: u32 = 12;

/// What says that a contact leaves its branch.
#[derive(Debug, Clone, Copy)]
enum Measure {
    Depth,
    Sliding,
    Pressing,
}

/// Where it goes.
#[derive(Debug, Clone, Copy)]
enum Next {
    Open,
    Closed,
    Released,
    Sliding(Sliding),
}

/// Past which level, and in which direction, a contact has left its branch.
struct Leaving {
    of: Measure,
    level: f64,
    sign: f64,
    to: Next,
}

/// Where a contact leaves its branch within a step.
pub(super) struct Passage {
    contact: usize,
    /// Share of the step.
    pub(super) tau: f64,
    to: Next,
}

impl Run<'_, '_> {
    /// The first instant of the last attempt at which a contact leaves its branch. Looked for on a grid, so that a branch
    /// left and entered again within a step is not missed.
    pub(super) fn first_passage(&mut self, h: f64) -> Option<Passage> {
        let n = self.x.len();
        let paths: Vec<Path> = (0..n).map(|k| self.collocation.path(k, h, self.x[k], self.v[k])).collect();
        let mut before = 0.0;
        for k in 1..=LOOKS {
            let tau = f64::from(k) / f64::from(LOOKS);
            self.place_on(&paths, h, tau);
            let left: Vec<(usize, Leaving)> =
                (0..self.system.contacts.len()).filter_map(|c| Some((c, self.leaving(c)?))).collect();
            let mut first: Option<Passage> = None;
            for (contact, leaving) in left {
                let tau = self.locate(&paths, h, (before, tau), contact, &leaving);
                if first.as_ref().is_none_or(|f| tau < f.tau) {
                    first = Some(Passage { contact, tau, to: leaving.to });
                }
            }
            if first.is_some() {
                return first;
            }
            before = tau;
        }
        None
    }

    fn place_on(&mut self, paths: &[Path], h: f64, tau: f64) {
        let (x, v): (Vec<f64>, Vec<f64>) =
            paths.iter().map(|path| path.at(tau)).map(|[x, v]| (x, v / h)).unzip();
        self.system.place(self.t + tau * h, &x, &v);
    }

    /// How a contact has left its branch, as last placed.
    fn leaving(&self, contact: usize) -> Option<Leaving> {
        let element = self.system.contacts[contact].element;
        let found = self.system.contact(contact);
        let slow = 1e-4 * element.friction.v_0.max(1e-3 * element.friction.v_m);
        let shallow = 1e-9 * element.law.clearance();
        let weak = 1e-9 * element.law.at(found.penetration, 0.0).elastic;
        let leaving = |of: Measure, level: f64, upwards: bool, to: Next| {
            Some(Leaving { of, level, sign: if upwards { 1.0 } else { -1.0 }, to })
        };
        match self.system.branches[contact] {
            Branch::Open if found.penetration > shallow => leaving(Measure::Depth, 0.0, true, Next::Closed),
            Branch::Open => None,
            _ if found.penetration < -shallow => leaving(Measure::Depth, 0.0, false, Next::Open),
            Branch::Released { .. } if found.pressing > weak => {
                leaving(Measure::Pressing, 0.0, true, Next::Closed)
            }
            Branch::Released { .. } => None,
            Branch::Closed { .. } if found.pressing < -weak => {
                leaving(Measure::Pressing, 0.0, false, Next::Released)
            }
            Branch::Closed { sliding, .. } => {
                let (low, high) = sliding.range(&element.friction);
                if found.sliding > high + slow {
                    leaving(Measure::Sliding, high, true, Next::Sliding(sliding.beyond(true)))
                } else if found.sliding < low - slow {
                    leaving(Measure::Sliding, low, false, Next::Sliding(sliding.beyond(false)))
                } else {
                    None
                }
            }
        }
    }

    /// Where between two shares of a step a contact leaves its branch, by secants and bisection; the first share if it has
    /// left it there.
    fn locate(
        &mut self,
        paths: &[Path],
        h: f64,
        (mut low, mut high): (f64, f64),
        contact: usize,
        leaving: &Leaving,
    ) -> f64 {
        let mut beyond = |tau: f64| {
            self.place_on(paths, h, tau);
            let found = self.system.contact(contact);
            let value = match leaving.of {
                Measure::Depth => found.penetration,
                Measure::Sliding => found.sliding,
                Measure::Pressing => found.pressing,
            };
            leaving.sign * (value - leaving.level)
        };
        let (mut at_low, mut at_high) = (beyond(low), beyond(high));
        if at_low >= 0.0 {
            return low;
        }
        for k in 0..200 {
            if high - low <= 1e-12 || (high - low) * h < 1e-16 {
                break;
            }
            let secant = low - at_low * (high - low) / (at_high - at_low);
            let tau = if k % 3 == 2 { 0.5 * (low + high) } else { secant.clamp(low, high) };
            let value = beyond(tau);
            if value < 0.0 {
                (low, at_low) = (tau, value);
            } else {
                (high, at_high) = (tau, value);
                if value == 0.0 {
                    break;
                }
            }
        }
        high
    }

    /// Takes a contact to its next branch at the present state.
    pub(super) fn pass(&mut self, passage: &Passage, at_start: bool) -> Result<(), SimError> {
        let Passage { contact, to, .. } = *passage;
        self.system.place(self.t, &self.x, &self.v);
        let found = self.system.contact(contact);
        self.record.count.passages += 1;
        let before = self.system.branches[contact];
        let impact_speed = match before {
            Branch::Open => found.penetration_rate.abs(),
            Branch::Closed { impact_speed, .. } | Branch::Released { impact_speed } => impact_speed,
        };
        self.system.branches[contact] = match to {
            Next::Open => Branch::Open,
            Next::Closed => self.system.closed(contact, impact_speed),
            Next::Released => Branch::Released { impact_speed },
            Next::Sliding(sliding) => Branch::Closed { impact_speed, sliding },
        };
        match (before, to) {
            (Branch::Open, _) => self.event(contact, ContactEventKind::Onset(impact_speed)),
            (_, Next::Open) => self.event(contact, ContactEventKind::Loss),
            _ => {}
        }
        if !at_start {
            // Extrapolated over a kink, stages are no better than a constant.
            self.collocation.restart();
        }
        self.refresh()
    }
}
