//! Prior standard deviations of element parameters, by what their columns do.

use dynid_model::element::is_temperature;
use dynid_model::{Dynamics, EffortModel, MotionBlock, RandomMotion, RegressorBlock, RobotModel, State};

/// Random states behind the figures.
const STATES: usize = 64;
const SEED: u64 = 1;
/// Share of the effort that friction, an offset or a ripple may have.
const EFFORT_SHARE: f64 = 0.1;
/// Share of the mass matrix that a rotor may have.
const ROTOR_SHARE: f64 = 0.2;
/// A drive reaches the velocity limit against its own rotor in about this time with all its effort, s (0.003 to 0.04 on
/// robots whose rotors are known). Behind large ratios the rotor is many times the links that the joint moves, so that the
/// mass matrix says nothing about it.
const STARTING_S: f64 = 0.03;
/// Effort limits count up to this multiple of the logged effort.
const LIMIT_OF_LOGGED: f64 = 10.0;

/// Deformation of a spring under all the effort where no stiffness is stated: a few minutes of arc, as harmonic drives
/// have; rad and m.
const WIND_UP: [f64; 2] = [1e-3, 1e-4];
/// Damping of a spring over its stiffness, s: some per cent of the critical one at the frequencies of drives.
const SETTLING_S: f64 = 0.01;

/// Shares of the velocity limits at which columns are looked at: some friction acts at low speeds only, Stribeck friction of
/// a small speed next to rest alone.
const SPEEDS: [f64; 6] = [1.0, 0.25, 0.0625, 0.015625, 0.00390625, 1e-9];

/// Channels that a model reads for motions without a log: currents of one ampere, the temperature of a warm joint, 35 °C,
/// every payload and every log's own terms.
pub fn typical_channels(model: &RobotModel, samples: usize) -> Vec<(String, Vec<f64>)> {
    let value = |name: &str| if is_temperature(name) { 35.0 } else { 1.0 };
    model.channels().iter().map(|name| (name.clone(), vec![value(name); samples])).collect()
}

/// Speed limit of a joint for priors and motions: as stated, at most 4π rad/s (2 m/s); 2 rad/s (0.5 m/s) by default.
pub fn speed_limit(slides: bool, stated: Option<f64>) -> f64 {
    let (default, most) = if slides { (0.5, 2.0) } else { (2.0, 4.0 * std::f64::consts::PI) };
    stated.filter(|v| v.is_finite() && *v > 0.0).map_or(default, |v| v.min(most))
}

/// Standard deviations of the parameters behind the links'. `inertias`: ten prior values per body.
pub(super) fn standard_deviations(
    model: &RobotModel,
    inertias: &[f64],
    stated: &[Option<f64>],
    logged: &[f64],
) -> Vec<f64> {
    let table = &model.parameters().linear;
    if table.len() == inertias.len() {
        return Vec::new();
    }
    let probe = Probe::new(model, inertias);
    let efforts: Vec<f64> = (0..logged.len()).map(|j| probe.effort(model, j, logged[j])).collect();
    let springs = Spring::of(model, stated, &efforts, logged);
    let starting: Vec<f64> = efforts.iter().zip(&probe.limits).map(|(e, v)| STARTING_S * e / v).collect();
    (inertias.len()..table.len())
        .map(|column| {
            let known = stated[column].unwrap_or(0.0).abs();
            if let (Some(low), Some(high)) = (table[column].lower, table[column].upper)
                && high > low
            {
                return (high - low) / 3.0;
            }
            let inertial = probe.least(column, &probe.accelerated, &probe.mass);
            if let Some(mass) = inertial {
                let starting = probe.least(column, &probe.accelerated, &starting).unwrap_or(0.0);
                return known.max(ROTOR_SHARE * mass).max(starting);
            }
            if let Some(spring) = springs.iter().find_map(|s| s.deviation(column)) {
                return spring;
            }
            let largest = probe.least(column, &probe.moving, &efforts).unwrap_or(1.0);
            (0.5 * known).max(EFFORT_SHARE * largest)
        })
        .collect()
}

/// Speed limits of all rates, motors behind springs as fast as their joints allow.
fn speed_limits(model: &RobotModel) -> Vec<f64> {
    let joints = model.joints();
    let own = |rate: usize| speed_limit(joints[rate].slides, model.limits(rate).velocity);
    let limit = |rate: usize| match model.elastic_link(rate) {
        Some((link, ratio)) => own(link) * ratio.abs(),
        None => own(rate),
    };
    (0..joints.len()).map(limit).collect()
}

/// Prior deviations of a spring: it carries all of the effort over a deformation of [`WIND_UP`], or of that which the
/// stated stiffness gives.
struct Spring {
    /// Column and deviation of `k1`, `k2`, `d`.
    deviations: Vec<(usize, f64)>,
}

impl Spring {
    fn of(model: &RobotModel, stated: &[Option<f64>], efforts: &[f64], logged: &[f64]) -> Vec<Spring> {
        let table = model.parameters();
        let spring = |(link, (motor, ratio)): (usize, (usize, f64))| {
            let name = &model.joints()[link].name;
            let column = |symbol: &str| table.column(&format!("{name}.{symbol}"));
            let torque = if logged[motor] > 0.0 { ratio.abs() * logged[motor] } else { efforts[link] };
            let known = column("k1").and_then(|c| stated[c]).filter(|k| *k > 0.0);
            let typical = WIND_UP[usize::from(model.joints()[link].slides)];
            let wind_up = known.map_or(typical, |k| torque / k);
            let k1 = torque / wind_up;
            let all = [("k1", k1), ("k2", k1 / wind_up.powi(2)), ("d", SETTLING_S * k1)];
            let of_stated = |c: usize| 0.5 * stated[c].unwrap_or(0.0).abs();
            let deviations =
                all.iter().filter_map(|(s, std)| column(s).map(|c| (c, std.max(of_stated(c))))).collect();
            Spring { deviations }
        };
        let links = (0..model.joints().len()).filter_map(|link| Some((link, model.elastic_motor(link)?)));
        links.map(spring).collect()
    }

    fn deviation(&self, column: usize) -> Option<f64> {
        self.deviations.iter().find(|(c, _)| *c == column).map(|(_, std)| *std)
    }
}

/// What random states say about a model.
struct Probe {
    /// Per output and parameter: largest entry of the column at unit accelerations, at rest entries taken away.
    accelerated: Vec<Vec<f64>>,
    /// Per output and parameter: largest entry of the column at the velocity limits and at shares of them.
    moving: Vec<Vec<f64>>,
    /// Per rate: mean diagonal entry of the mass matrix of the prior bodies.
    mass: Vec<f64>,
    /// Per rate: largest effort of the prior bodies.
    rigid: Vec<f64>,
    /// Per rate: velocity limit.
    limits: Vec<f64>,
}

impl Probe {
    fn new(model: &RobotModel, inertias: &[f64]) -> Self {
        let limits = speed_limits(model);
        let channels = typical_channels(model, STATES);
        let channels: Vec<(&str, &[f64])> =
            channels.iter().map(|(name, values)| (name.as_str(), values.as_slice())).collect();
        let motion = match model.closed() {
            None => RandomMotion::new(model.mechanism(), &[], STATES, SEED).with_coordinates(model, SEED),
            Some(closed) => closed.random_motion(STATES, SEED),
        };
        motion.with_block(|motion| {
            let zero = vec![0.0; motion.dq.len()];
            let sign = |x: &f64| if *x < 0.0 { -1.0 } else { 1.0 };
            let unit: Vec<f64> = motion.ddq.iter().map(sign).collect();
            let fast: Vec<f64> =
                motion.dq.iter().enumerate().map(|(k, x)| sign(x) * limits[k / motion.stride]).collect();
            let columns = |dq: &[f64], ddq: &[f64]| -> RegressorBlock {
                let mut block = RegressorBlock::new(model.layout().clone(), STATES);
                let motion = MotionBlock { dq, ddq, channels: &channels, ..*motion };
                model.regressor(&motion, &model.parameters().shape_start(), &mut block);
                block
            };
            let (rest, accelerated) = (columns(&zero, &zero), columns(&zero, &unit));
            let moving: Vec<RegressorBlock> = SPEEDS
                .iter()
                .map(|share| columns(&fast.iter().map(|v| share * v).collect::<Vec<f64>>(), &zero))
                .collect();
            let (mass, rigid) = match model.closed() {
                None => rigid_bodies(model, motion, inertias),
                Some(_) => closed_bodies(model, motion, inertias),
            };
            let [mass, rigid] =
                [(mass, 2), (rigid, 1)].map(|(sizes, power)| with_motors(model, sizes, power));
            Probe {
                accelerated: largest(model, |output, k, s| {
                    accelerated.column(output, k)[s] - rest.column(output, k)[s]
                }),
                moving: largest(model, |output, k, s| {
                    moving.iter().map(|b| b.column(output, k)[s].abs()).fold(0.0, f64::max)
                }),
                mass,
                rigid,
                limits: limits.clone(),
            }
        })
    }

    /// `min_j scale_j / c_j` over the outputs on which a column acts.
    fn least(&self, column: usize, entries: &[Vec<f64>], scale: &[f64]) -> Option<f64> {
        let ratios = entries.iter().zip(scale).filter(|(e, _)| e[column] > 0.0).map(|(e, s)| s / e[column]);
        ratios.reduce(f64::min)
    }

    /// Size of the effort of an output, N m or N; positive.
    fn effort(&self, model: &RobotModel, output: usize, logged: f64) -> f64 {
        let positive = |x: &f64| x.is_finite() && *x > 0.0;
        let limit = model.limits(output).effort.filter(positive);
        let logged = Some(logged).filter(positive);
        let effort = match (limit, logged) {
            (Some(limit), Some(logged)) => limit.min(LIMIT_OF_LOGGED * logged),
            (Some(limit), None) => limit,
            (None, Some(logged)) => logged,
            (None, None) => self.rigid[output],
        };
        if positive(&effort) { effort } else { 1.0 }
    }
}

/// Per output and parameter the largest size over the states of an entry `(output, place, state)`.
fn largest(model: &RobotModel, entry: impl Fn(usize, usize, usize) -> f64) -> Vec<Vec<f64>> {
    let layout = model.layout();
    (0..layout.outputs())
        .map(|output| {
            let mut sizes = vec![0.0; layout.parameters()];
            for (k, column) in layout.columns(output).iter().enumerate() {
                sizes[*column] = (0..STATES).map(|s| entry(output, k, s).abs()).fold(0.0, f64::max);
            }
            sizes
        })
        .collect()
}

/// Sizes per joint of the mechanism, extended to motors behind springs: those of their joints over a power of the ratio. Loads
/// that a sensor measures count as 0.
fn with_motors(model: &RobotModel, mut sizes: Vec<f64>, power: i32) -> Vec<f64> {
    for rate in sizes.len()..model.joints().len() {
        let link = model.elastic_link(rate).filter(|(link, _)| *link < rate);
        sizes.push(link.map_or(0.0, |(link, ratio)| sizes[link] / ratio.abs().powi(power)));
    }
    sizes
}

/// Mean diagonal of the mass matrix, and largest efforts over the states.
fn rigid_bodies(model: &RobotModel, motion: &MotionBlock<'_>, inertias: &[f64]) -> (Vec<f64>, Vec<f64>) {
    let dynamics = Dynamics::new(model.mechanism());
    let mut work = dynamics.workspace::<f64>();
    let (n, positions) = (dynamics.rates(), model.mechanism().positions());
    let (mut mass, mut rigid) = (vec![0.0; n], vec![0.0_f64; n]);
    let mut effort = vec![0.0; n];
    // Bodies move with the first coordinates.
    let at = |signal: &[f64], count: usize, s: usize| -> Vec<f64> {
        signal.chunks(motion.stride).take(count).map(|channel| channel[s]).collect()
    };
    for s in 0..motion.samples {
        let (q, dq, ddq) = (at(motion.q, positions, s), at(motion.dq, n, s), at(motion.ddq, n, s));
        let matrix = dynamics.mass_matrix(&q, inertias, &mut work);
        let state = State { q: &q, dq: &dq, ddq: &ddq, gravity: None };
        dynamics.inverse_dynamics(&state, inertias, &mut work, &mut effort);
        for j in 0..n {
            mass[j] += matrix[j * n + j] / motion.samples as f64;
            rigid[j] = rigid[j].max(effort[j].abs());
        }
    }
    (mass, rigid)
}

/// Inertias that drives of a mechanism with loops feel; elements play no part.
fn closed_bodies(model: &RobotModel, motion: &MotionBlock<'_>, inertias: &[f64]) -> (Vec<f64>, Vec<f64>) {
    let (n, samples) = (model.outputs().len(), motion.samples);
    let mut linear = inertias.to_vec();
    linear.resize(model.parameters().linear.len(), 0.0);
    let shape = model.parameters().shape_start();
    let channels = typical_channels(model, samples);
    let channels: Vec<(&str, &[f64])> =
        channels.iter().map(|(name, values)| (name.as_str(), values.as_slice())).collect();
    let efforts = |dq: &[f64], ddq: &[f64], gravity: Option<&[f64]>| {
        let mut effort = vec![0.0; n * samples];
        let motion = MotionBlock { dq, ddq, gravity, channels: &channels, ..*motion };
        model.efforts(&motion, &shape, &linear, samples, &mut effort);
        effort
    };
    let mean = |x: &[f64]| x.iter().map(|e| e.abs()).sum::<f64>() / samples as f64;
    let rest = vec![0.0; motion.dq.len()];
    let weightless = vec![0.0; 3 * motion.stride];
    let all = efforts(motion.dq, motion.ddq, None);
    let rigid = all.chunks_exact(samples).map(|e| e.iter().fold(0.0, |m: f64, x| m.max(x.abs())));
    let mass = (0..n).map(|k| {
        let mut unit = rest.clone();
        if let Some(own) = unit.get_mut(k * motion.stride..(k + 1) * motion.stride) {
            own.fill(1.0);
        }
        mean(&efforts(&rest, &unit, Some(&weightless))[k * samples..(k + 1) * samples])
    });
    (mass.collect(), rigid.collect())
}
