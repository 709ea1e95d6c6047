//! Virtual fleets: robots that differ, logs that scatter, wear that grows, faults and broken logs, with the truth beside them.

use std::collections::BTreeMap;

use dynid_identify::Error;
use dynid_identify::reduction::{BACKLASH, DELAY};
use dynid_identify::robot::Robot;
use dynid_model::inertia::PARAMETER_NAMES;
use dynid_model::{Inertia, Mat3, Vec3};
use dynid_motion::shift::shift;
use dynid_robots::ElasticSpec;
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use serde::Serialize;
use sha2::{Digest, Sha256};

use super::fleet_table::FleetTable;
use super::{SimulateMode, SimulateSettings, SimulatedLog, nominal, simulate};

/// Seconds of a day.
const DAY: f64 = 86_400.0;
/// When a virtual fleet begins: 2026-01-01, s since 1970.
const FIRST_DAY: f64 = 1_767_225_600.0;
/// Temperature about which the season swings, degrees Celsius.
const TEMPERATURE: f64 = 25.0;
/// Deviation of a robot that stands out, in standard deviations of its fleet.
const OUTLIER: f64 = 8.0;
/// Spread of delays between robots and between logs, samples.
const DELAY_SPREAD: (f64, f64) = (0.1, 0.03);
/// Symbol of a stiffness.
const STIFFNESS: &str = "k1";
/// Share of the largest deformation within which backlash passes from flank to flank.
const FLANK: f64 = 0.02;
/// Distance of the middle of a payload from the axes of its link at most, m.
const PAYLOAD_REACH: f64 = 0.08;
/// Radius of gyration of a payload about its middle, m.
const PAYLOAD_RADIUS: f64 = 0.04;
/// Deviation of a broken log, in standard deviations of its robot's logs.
const BROKEN: f64 = 15.0;

/// A change that was put into a robot.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PlannedChange {
    /// Robot.
    pub robot: String,
    /// Parameter.
    pub parameter: String,
    /// `step` or `ramp`.
    pub kind: &'static str,
    /// Change at the end, in the unit of the parameter.
    pub size: f64,
    /// When it happens or begins, s since 1970.
    pub date_s: f64,
}

/// A virtual fleet; its logs are made one by one, each alone if need be.
#[derive(Debug, Clone)]
pub struct VirtualFleet {
    settings: SimulateSettings,
    table: FleetTable,
    /// Parameters of the type.
    pub nominal: Vec<(String, f64)>,
    /// Joints with encoders on both sides of their gears.
    springs: Vec<ElasticSpec>,
    /// Per robot: parameters.
    robots: Vec<BTreeMap<String, f64>>,
    /// Changes that were put in.
    pub changes: Vec<PlannedChange>,
    /// Robots that stand out.
    pub outliers: Vec<String>,
}

/// What is known of a virtual log.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct VirtualLog {
    /// Robot.
    pub robot: String,
    /// File name.
    pub file: String,
    /// Start, s since 1970.
    pub start_s: f64,
    /// Temperature, degrees Celsius; absent if the season has no swing.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub temperature: Option<f64>,
    /// Joint in which the log is broken.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub broken: Option<String>,
    /// Parameters of the joints in this log.
    pub parameters: BTreeMap<String, f64>,
    /// Mass that the last link carries, kg; absent if it carries nothing.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub payload: Option<f64>,
}

fn normal(rng: &mut impl Rng) -> f64 {
    StandardNormal.sample(rng)
}

/// Name of a robot.
fn name(r: usize) -> String {
    format!("r{:03}", r + 1)
}

/// Joint and symbol of a parameter.
fn parts(parameter: &str) -> (&str, &str) {
    parameter.rsplit_once('.').unwrap_or(("", parameter))
}

impl VirtualFleet {
    /// Draws robots and changes; `settings.fleet` says which.
    ///
    /// # Errors
    /// As [`simulate`]; [`Error::Setting`] for a symbol that no parameter has.
    pub fn new(robot: &Robot, settings: &SimulateSettings) -> Result<VirtualFleet, Error> {
        let table = settings.fleet.clone().unwrap_or_default();
        table.check()?;
        if settings.mode == SimulateMode::ClosedLoop {
            return Err(Error::setting("mode", "inverse dynamics for a fleet", "closed_loop"));
        }
        let nominal = nominal(robot, settings)?;
        for symbol in
            table.between_robots.keys().chain(table.between_logs.keys()).chain(table.per_kelvin.keys())
        {
            if !nominal.iter().any(|(parameter, _)| parts(parameter).1 == symbol) {
                // What is there by default may be lacking in the robot.
                let usual = FleetTable::default();
                let stated = [
                    (&table.between_robots, &usual.between_robots),
                    (&table.between_logs, &usual.between_logs),
                    (&table.per_kelvin, &usual.per_kelvin),
                ];
                if stated.iter().any(|(own, usual)| own.contains_key(symbol) && own != usual) {
                    return Err(Error::setting("fleet", "symbols of parameters that the robot has", symbol));
                }
            }
        }
        let springs = robot.elements.elastic.clone();
        if table.stiffness > 0 && springs.is_empty() {
            return Err(Error::setting("fleet.stiffness", "0, since no joint is `elastic`", table.stiffness));
        }
        if table.backlash > 0 && springs.iter().all(|spec| spec.sensor) {
            let expected = "0, since no joint is `elastic` without torque sensor";
            return Err(Error::setting("fleet.backlash", expected, table.backlash));
        }
        let mut out = VirtualFleet {
            springs,
            settings: settings.clone(),
            table,
            nominal,
            robots: Vec::new(),
            changes: Vec::new(),
            outliers: Vec::new(),
        };
        out.draw();
        Ok(out)
    }

    /// Size of a parameter that shares count from.
    fn size(&self, parameter: &str) -> f64 {
        let of = |name: &str| self.nominal.iter().find(|(p, _)| p == name).map_or(0.0, |(_, v)| v.abs());
        match parts(parameter) {
            (joint, "fo") => of(&format!("{joint}.fc")),
            _ => of(parameter),
        }
    }

    fn joints(&self) -> Vec<String> {
        let mut out: Vec<String> = Vec::new();
        for (parameter, _) in &self.nominal {
            let (joint, symbol) = parts(parameter);
            if self.table.between_robots.contains_key(symbol) && !out.iter().any(|j| j == joint) {
                out.push(joint.to_owned());
            }
        }
        out
    }

    fn draw(&mut self) {
        let table = self.table.clone();
        let mut rng = ChaCha8Rng::seed_from_u64(self.settings.seed);
        let mut left: Vec<usize> = (0..table.robots).collect();
        let joints = self.joints();
        let mut take = |rng: &mut ChaCha8Rng| left.swap_remove(rng.random_range(0..left.len()));
        let outliers: Vec<(usize, usize)> = match joints.len() {
            0 => Vec::new(),
            n => (0..table.outliers).map(|_| (take(&mut rng), rng.random_range(0..n))).collect(),
        };
        for n in 0..if joints.is_empty() { 0 } else { table.wear + table.faults } {
            let robot = name(take(&mut rng));
            let step = n >= table.wear;
            let joint = &joints[rng.random_range(0..joints.len())];
            let symbols: [&str; 2] = if step { ["fc", "fo"] } else { ["fc", "fv"] };
            let mut parameter = format!("{joint}.{}", symbols[rng.random_range(0..2)]);
            if !self.nominal.iter().any(|(p, _)| *p == parameter) {
                parameter = format!("{joint}.fc");
            }
            let sign = if step && rng.random_bool(0.5) { -1.0 } else { 1.0 };
            let share = if step { rng.random_range(0.2..0.4) } else { rng.random_range(0.3..0.6) };
            let at = if step { rng.random_range(0.25..0.75) } else { rng.random_range(0.2..0.7) };
            let size = sign * share * self.size(&parameter);
            let kind = if step { "step" } else { "ramp" };
            self.changes.push(PlannedChange {
                robot,
                parameter,
                kind,
                size,
                date_s: FIRST_DAY + DAY * table.days * at,
            });
        }
        for _ in 0..if joints.is_empty() { 0 } else { table.delays } {
            let robot = name(take(&mut rng));
            let parameter = format!("{}.{DELAY}", joints[rng.random_range(0..joints.len())]);
            let size = rng.random_range(0.3..1.0) / self.settings.rate_hz;
            let date_s = FIRST_DAY + DAY * table.days * rng.random_range(0.25..0.75);
            self.changes.push(PlannedChange { robot, parameter, kind: "step", size, date_s });
        }
        for n in 0..table.stiffness + table.backlash {
            let robot = name(take(&mut rng));
            let [symbol, kind] = if n < table.stiffness { [STIFFNESS, "step"] } else { [BACKLASH, "ramp"] };
            let may = |spec: &&ElasticSpec| symbol == STIFFNESS || !spec.sensor;
            let joints: Vec<&ElasticSpec> = self.springs.iter().filter(may).collect();
            let parameter = format!("{}.{symbol}", joints[rng.random_range(0..joints.len())].joint);
            let size = match symbol {
                STIFFNESS => -rng.random_range(0.1..0.3) * self.size(&parameter),
                _ => rng.random_range(3e-4..1e-3),
            };
            let at = if kind == "step" { rng.random_range(0.25..0.75) } else { rng.random_range(0.2..0.7) };
            let date_s = FIRST_DAY + DAY * table.days * at;
            self.changes.push(PlannedChange { robot, parameter, kind, size, date_s });
        }
        for r in 0..table.robots {
            let odd =
                outliers.iter().find(|(robot, _)| *robot == r).map(|(_, joint)| joints[*joint].as_str());
            let mut own = BTreeMap::new();
            for (parameter, value) in &self.nominal {
                let (joint, symbol) = parts(parameter);
                let Some(spread) = table.between_robots.get(symbol) else { continue };
                let draw = normal(&mut rng);
                let draw = if odd == Some(joint) { OUTLIER.copysign(draw) } else { draw };
                own.insert(parameter.clone(), value + spread * self.size(parameter) * draw);
            }
            self.robots.push(own);
        }
        self.outliers = outliers.iter().map(|(r, _)| name(*r)).collect();
        self.outliers.sort();
    }

    /// Number of logs.
    pub fn len(&self) -> usize {
        self.table.robots * self.table.logs
    }

    /// Whether there are no logs.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// What is known of log `index`, counted robot by robot.
    ///
    /// # Panics
    /// Unless `index` is below [`Self::len`].
    pub fn about(&self, index: usize) -> VirtualLog {
        assert!(index < self.len(), "log {index} of {}", self.len());
        let (r, l) = (index / self.table.logs, index % self.table.logs);
        let robot = name(r);
        let mut rng = self.rng(&format!("log {r} {l}"));
        let at = (l as f64 + rng.random_range(0.05..0.95)) / self.table.logs as f64;
        // Whole seconds, as a manifest has them.
        let start_s = (FIRST_DAY + DAY * self.table.days * at).round();
        let year = (start_s - FIRST_DAY) / (365.0 * DAY);
        let season = self.table.season;
        let temperature =
            ((TEMPERATURE + season * (std::f64::consts::TAU * year).sin() + normal(&mut rng)) * 10.0).round()
                / 10.0;
        let joints = self.joints();
        let hit = rng.random_range(0.0..1.0) < self.table.broken && !joints.is_empty();
        let broken = hit.then(|| joints[rng.random_range(0..joints.len())].clone());
        let mut parameters = self.robots[r].clone();
        let mut beside: Vec<(String, f64)> = Vec::new();
        if self.table.backlash > 0 {
            beside.extend(self.springs.iter().map(|spec| (format!("{}.{BACKLASH}", spec.joint), 0.0)));
        }
        for joint in joints.iter().filter(|_| self.table.delays > 0) {
            let sample = 1.0 / self.settings.rate_hz;
            let of_robot = DELAY_SPREAD.0 * sample * normal(&mut self.rng(&format!("delay {r} {joint}")));
            let of_log = DELAY_SPREAD.1 * sample * normal(&mut self.rng(&format!("delay {r} {l} {joint}")));
            beside.push((format!("{joint}.{DELAY}"), of_robot));
            parameters.insert(format!("{joint}.{DELAY}"), of_robot + of_log);
        }
        for (parameter, _) in self.nominal.iter().chain(&beside) {
            let (joint, symbol) = parts(parameter);
            let size = self.size(parameter);
            let mut change = 0.0;
            if let Some(spread) = self.table.between_logs.get(symbol) {
                let draw = normal(&mut rng);
                let draw = if broken.as_deref() == Some(joint) { BROKEN } else { draw };
                change += spread * size * draw;
            }
            if season > 0.0 {
                change += self.table.per_kelvin.get(symbol).copied().unwrap_or(0.0)
                    * size
                    * (temperature - TEMPERATURE);
            }
            for planned in self.changes.iter().filter(|c| c.robot == robot && c.parameter == *parameter) {
                let end = FIRST_DAY + DAY * self.table.days;
                let ramp = ((start_s - planned.date_s) / (end - planned.date_s)).max(0.0);
                change += planned.size
                    * if planned.kind == "step" { f64::from(start_s >= planned.date_s) } else { ramp };
            }
            if change != 0.0 {
                *parameters.entry(parameter.clone()).or_insert_with(|| self.value(parameter)) += change;
            }
        }
        let file = format!("{robot}-{:03}.csv.gz", l + 1);
        let temperature = Some(temperature).filter(|_| season > 0.0);
        let payload = self.payload(r, l).map(|body| body.0[0]);
        VirtualLog { robot, file, start_s, temperature, broken, parameters, payload }
    }

    /// What the last link carries in a log, about the frame of its joint.
    fn payload(&self, r: usize, l: usize) -> Option<Inertia> {
        let mut rng = self.rng(&format!("payload {r} {l}"));
        let carries = self.table.payload > 0.0 && rng.random_bool(0.5);
        carries.then(|| {
            let mass = self.table.payload * rng.random_range(0.1..1.0);
            let com = std::array::from_fn(|_| PAYLOAD_REACH * rng.random_range(-1.0..1.0));
            let about_com = Mat3::identity() * (mass * PAYLOAD_RADIUS * PAYLOAD_RADIUS);
            Inertia::from_com(mass, Vec3(com), &about_com)
        })
    }

    fn value(&self, parameter: &str) -> f64 {
        self.nominal.iter().find(|(p, _)| p == parameter).map_or(0.0, |(_, v)| *v)
    }

    /// Random numbers of a thing of the fleet: the same whatever else is made.
    fn rng(&self, what: &str) -> ChaCha8Rng {
        let hash = Sha256::digest(format!("{} {what}", self.settings.seed).as_bytes());
        ChaCha8Rng::from_seed(hash.into())
    }

    /// Simulates log `index`, with a motion of its own.
    ///
    /// # Errors
    /// As [`simulate`].
    pub fn log(&self, robot: &Robot, index: usize) -> Result<SimulatedLog, Error> {
        let VirtualLog { parameters, .. } = self.about(index);
        let seed = self.rng(&format!("motion {index}")).random();
        let mut values = self.settings.values.clone();
        let is = |parameter: &String, symbol: &str| parts(parameter).1 == symbol;
        let of_model = |p: &String| !is(p, DELAY) && !is(p, BACKLASH);
        values.extend(parameters.iter().filter(|(p, _)| of_model(p)).map(|(p, v)| (p.clone(), *v)));
        let carried = self.payload(index / self.table.logs, index % self.table.logs);
        if let (Some(Inertia(carried)), Some(last)) = (carried, robot.mechanism.sweep().last().copied()) {
            let link = &robot.mechanism.bodies()[last].name;
            for (symbol, more) in PARAMETER_NAMES.iter().zip(carried) {
                let parameter = format!("{link}.{symbol}");
                *values.entry(parameter.clone()).or_insert_with(|| self.value(&parameter)) += more;
            }
        }
        let settings = SimulateSettings { values, seed, fleet: None, ..self.settings.clone() };
        let mut log = simulate(robot, &settings)?;
        for spec in &self.springs {
            if let Some(gap) = parameters.get(&format!("{}.{BACKLASH}", spec.joint)) {
                put_backlash(&mut log, spec, *gap);
            }
        }
        for (parameter, delay) in parameters.iter().filter(|(p, _)| is(p, DELAY)) {
            let joint = log.joints.iter().position(|joint| joint == parts(parameter).0);
            if let Some(effort) = joint.map(|j| &mut log.effort[j]) {
                // The effort runs ahead of the motion.
                let led = shift(effort, delay * self.settings.rate_hz);
                *effort = led.map_err(|e| Error::setting("fleet.delays", "finite efforts", e))?.values;
            }
        }
        Ok(log)
    }
}

/// Lets the record of a link lie on the flank that its load presses on, half a gap from where it was.
fn put_backlash(log: &mut SimulatedLog, spec: &ElasticSpec, gap: f64) {
    let place = |name: &String| log.joints.iter().position(|joint| joint == name);
    let (Some(link), Some(motor)) = (place(&spec.joint), place(&spec.motor)) else { return };
    let pairs = log.clean[0][motor].iter().zip(&log.clean[0][link]);
    let deformation: Vec<f64> = pairs.map(|(motor, link)| motor / spec.ratio - link).collect();
    let width = FLANK * deformation.iter().fold(f64::MIN_POSITIVE, |most, x| most.max(x.abs()));
    for (q, x) in log.position[link].iter_mut().zip(&deformation) {
        *q -= 0.5 * gap * (x / width).tanh();
    }
}
