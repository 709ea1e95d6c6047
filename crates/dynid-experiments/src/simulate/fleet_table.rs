//! Settings of virtual fleets.

use std::collections::BTreeMap;

use dynid_identify::Error;
use serde::Deserialize;

/// Keys of `[fleet]`: what a virtual fleet is made of.
///
/// Spreads are standard deviations by symbol, as shares of the value that the parameter has otherwise; those of offsets (`fo`) are shares of
/// the Coulomb friction of the joint.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct FleetTable {
    /// Robots. Default 20.
    pub robots: usize,
    /// Logs of every robot. Default 10.
    pub logs: usize,
    /// Time over which the logs are spread, d. Default 365.
    pub days: f64,
    /// Spread between robots. Default: `fc` 0.2, `fv` 0.25, `fo` 0.1.
    pub between_robots: BTreeMap<String, f64>,
    /// Spread between logs of a robot. Default: `fc` 0.04, `fv` 0.06, `fo` 0.03.
    pub between_logs: BTreeMap<String, f64>,
    /// Swing of the temperature over the year, K; 0: no temperature is stated. Default 8.
    pub season: f64,
    /// Change with temperature by symbol, share per K. Default: `fv` -0.01.
    pub per_kelvin: BTreeMap<String, f64>,
    /// Robots one joint of which stands out by 8 standard deviations. Default 0.
    pub outliers: usize,
    /// Robots with a parameter that grows by 30 to 60 % until the end, evenly from 20 to 70 % of the time on. Default 0.
    pub wear: usize,
    /// Robots with a step of 20 to 40 % of Coulomb friction, in it or the offset of a joint. Default 0.
    pub faults: usize,
    /// Robots in which the delay of the motion behind the effort of a joint grows at once by 0.3 to 1 samples. The delays of all joints then differ
    /// by 0.1 samples between robots, and by 0.03 between logs. Default 0.
    pub delays: usize,
    /// Robots in which the stiffness `k1` of an elastic joint falls at once by 10 to 30 %. Default 0.
    pub stiffness: usize,
    /// Robots in which backlash of 0.3 to 1 mrad (mm where it slides) grows in the gear of an elastic joint without torque sensor until the end, evenly from
    /// 20 to 70 % of the time on: the record of the link holds it, on one flank or the other as the load presses. Default 0.
    pub backlash: usize,
    /// Largest mass that the last link carries, kg: in half of the logs nothing, in the others a body of a mass of its own, up to this one. Default 0.
    pub payload: f64,
    /// Share of the logs in which one joint is off by 15 standard deviations. Default 0.
    pub broken: f64,
}

impl Default for FleetTable {
    fn default() -> Self {
        let map = |pairs: &[(&str, f64)]| pairs.iter().map(|(k, v)| ((*k).to_owned(), *v)).collect();
        FleetTable {
            robots: 20,
            logs: 10,
            days: 365.0,
            between_robots: map(&[("fc", 0.2), ("fv", 0.25), ("fo", 0.1)]),
            between_logs: map(&[("fc", 0.04), ("fv", 0.06), ("fo", 0.03)]),
            season: 8.0,
            per_kelvin: map(&[("fv", -0.01)]),
            outliers: 0,
            wear: 0,
            faults: 0,
            delays: 0,
            stiffness: 0,
            backlash: 0,
            payload: 0.0,
            broken: 0.0,
        }
    }
}

impl FleetTable {
    pub(super) fn check(&self) -> Result<(), Error> {
        let FleetTable { outliers, wear, faults, delays, stiffness, backlash, .. } = self;
        let special = outliers + wear + faults + delays + stiffness + backlash;
        let counts = [
            ("fleet.robots", self.robots >= 1, "at least 1", self.robots),
            ("fleet.logs", self.logs >= 1, "at least 1", self.logs),
            (
                "fleet.outliers",
                special <= self.robots,
                "as many robots as outliers, wear, faults, delays, stiffness and backlash need",
                special,
            ),
        ];
        for (name, good, expected, found) in counts {
            if !good {
                return Err(Error::setting(name, expected, found));
            }
        }
        let spreads = self.between_robots.values().chain(self.between_logs.values());
        let numbers = [
            ("fleet.days", self.days, self.days > 0.0),
            ("fleet.season", self.season, self.season >= 0.0),
            ("fleet.payload", self.payload, self.payload >= 0.0),
        ];
        let shares = [("fleet.broken", self.broken, (0.0..=1.0).contains(&self.broken))];
        let spreads = spreads.map(|x| ("fleet.between_robots", *x, *x >= 0.0));
        let slopes = self.per_kelvin.values().map(|x| ("fleet.per_kelvin", *x, true));
        for (name, found, good) in numbers.into_iter().chain(shares).chain(spreads).chain(slopes) {
            if !(found.is_finite() && good) {
                return Err(Error::setting(name, "a number that makes sense", found));
            }
        }
        Ok(())
    }
}
