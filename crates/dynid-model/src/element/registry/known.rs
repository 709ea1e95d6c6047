//! The kinds of elements that come with the crate.

use super::kind::{Build, Candidate, ElementKind, OptionTerm, Placement};
use crate::element::law::units::{NUMBER, PER_SPEED, STIFFNESS, VISCOUS};
use crate::element::{
    AtJoint, Cyclic, DriveGain, ExternalLoad, JointElement, LinearTerm, LuGre, MaxwellSlip, ReactionFriction,
    RotorInertia, Spring, Stribeck, VelocityLaw, balancer, laws,
};

/// What tells elements apart that differ next to rest alone.
const SLOW: &str = "many samples close to rest";
const FAST: &str = "speeds far above 1/sigma3";

/// All of them, in the order in which they are listed.
pub(super) fn kinds() -> Vec<ElementKind> {
    let mut out = linear();
    out.extend(others());
    out.extend(shaped());
    out.extend([
        load(),
        exponential_viscous(),
        lugre(),
        maxwell_slip(),
        stribeck_viscous(),
        external_load(),
        elastic(),
    ]);
    out.push(reaction_friction());
    out
}

/// Friction without shape parameters, and the offset.
fn linear() -> Vec<ElementKind> {
    let offset = ElementKind::law("offset", laws::Offset)
        .equation("fo")
        .help("zero of the sensor, constant load")
        .keys(&["effort"]);
    vec![
        ElementKind::law("coulomb", laws::Coulomb)
            .equation("fc sign(q̇)")
            .keys(&["effort"])
            .alike("tanh", SLOW)
            .alike("sigmoid", SLOW)
            .alike("sigmoid_offset", SLOW)
            .alike("load", "loads that vary"),
        ElementKind::law("viscous", laws::Viscous)
            .equation("fv q̇")
            .keys(&["coefficient"])
            .alike("arctangent", "speeds far above 1/fb")
            .alike("exponential_viscous", FAST)
            .alike("power", "speeds that differ by an order of magnitude"),
        ElementKind { gives_way: true, ..offset },
        ElementKind::law("asymmetric", laws::Asymmetric)
            .equation("fcp + fvp q̇ forward, -fcn + fvn q̇ backward")
            .help("in place of the first three")
            .keys(&[])
            .excludes("offset", "its Coulomb columns differ by a constant")
            .excludes("coulomb", "its Coulomb columns add up to the sign")
            .excludes("viscous", "its viscous columns add up to the velocity")
            .excludes("viscous_magnitude", "its viscous columns differ by the speed")
            .excludes("stribeck", "the columns of both add up to the sign"),
    ]
}

/// An element of a function.
fn of(
    name: &'static str,
    linear: &[LinearTerm],
    build: fn(&Placement<'_>) -> Result<Box<dyn JointElement>, String>,
) -> ElementKind {
    ElementKind { linear: linear.to_vec(), ..ElementKind::bare(name, Build::Element(build)) }
}

fn others() -> Vec<ElementKind> {
    let cyclic = of("cyclic", &Cyclic::TORQUE, |p| Ok(Box::new(Cyclic::torque(p.rate, p.shape[0]))));
    let friction =
        of("cyclic_friction", &Cyclic::FRICTION, |p| Ok(Box::new(Cyclic::friction(p.rate, p.shape[0]))));
    vec![
        of("rotor", &[LinearTerm::new("Ia", ["kg m²", "kg"]).at_least(0.0)], |p| {
            Ok(Box::new(RotorInertia { rate: p.rate }))
        })
        .equation("Ia q̈")
        .help("rotor behind the gear, `Ia = n² J`")
        .keys(&["inertia"]),
        of(
            "spring",
            &[LinearTerm::new("k", STIFFNESS).at_least(0.0), LinearTerm::effort("kq0")],
            |p| Ok(Box::new(Spring { rate: p.rate })),
        )
        .equation("k (q - q0)")
        .help("`kq0 = k q0`")
        .keys(&["stiffness", "kq0"]),
        balancer(),
        ElementKind { shape: vec![Cyclic::TORQUE_CYCLES], ..cyclic }
            .equation("ca cos(n q) + cb sin(n q)")
            .help("torque ripple: `n` repetitions per turn, set by `cyclic = { cycles = n }`"),
        ElementKind { shape: vec![Cyclic::FRICTION_CYCLES], ..friction }
            .equation("sign(q̇) (fca cos(n q) + fcb sin(n q))")
            .help("friction that changes over a turn: `cyclic_friction = { friction_cycles = n }`; beside `coulomb`"),
        of("drive_gain", &[LinearTerm::new("K", ["N m/A", "N/A"]).at_least(0.0)], |p| {
            Ok(Box::new(DriveGain { rate: p.rate }))
        })
        .equation("-K i")
        .help("see [currents](../questions/currents.md#the-gains-are-unknown)"),
    ]
}

fn balancer() -> ElementKind {
    let kind = of("balancer", &balancer::LINEAR, |p| balancer::place(p.rate, p.shape));
    ElementKind { shape: balancer::SHAPE.to_vec(), turns: true, ..kind }
        .equation("(bf + bk L) ba br sin(q + bphi)/L, L² = ba² + br² - 2 ba br cos(q + bphi)")
        .help("a coil or gas spring that carries a link: [Gravity compensators](#gravity-compensators)")
        .keys(&["stiffness", "force"])
        .alike("spring", "positions over most of a turn")
}

/// Friction of velocity with shape parameters that takes the place of Coulomb or viscous friction, or joins them.
fn shaped() -> Vec<ElementKind> {
    let stribeck = ElementKind::law("stribeck", laws::Stribeck)
        .equation("sign(q̇) (fc + (fs - fc) E), E = exp(-abs(q̇/vs)^delta)")
        .help("in place of `coulomb`")
        .keys(&["coulomb", "static"])
        .excludes("coulomb", "its columns add up to the sign")
        .excludes("stribeck_viscous", "both have a Stribeck speed `vs`")
        .alike("tanh", SLOW)
        .alike("sigmoid", SLOW)
        .alike("sigmoid_offset", SLOW)
        .alike("load", "loads that vary");
    let falls = Candidate {
        beside: &["coulomb"],
        unless_shaped: true,
        instead_of: Some("coulomb"),
        value: Some("vs"),
    };
    let tanh = ElementKind::law("tanh", laws::Tanh)
        .equation("ft tanh(q̇/w)")
        .help("in place of `coulomb`")
        .keys(&["effort"])
        .alike("arctangent", SLOW)
        .alike("sigmoid", SLOW)
        .alike("sigmoid_offset", SLOW);
    let saturates = Candidate {
        beside: &["coulomb", "viscous", "asymmetric"],
        unless_shaped: true,
        instead_of: None,
        value: Some("w"),
    };
    let magnitude = ElementKind::law("viscous_magnitude", laws::ViscousMagnitude)
        .equation("fva abs(q̇)")
        .help("beside `viscous`, other coefficients forward and backward")
        .keys(&["coefficient"]);
    let directed = Candidate { beside: &["viscous"], unless_shaped: false, instead_of: None, value: None };
    let power = ElementKind::law("power", laws::Power)
        .equation("fp sign(q̇) abs(q̇)^p")
        .keys(&["coefficient"])
        .alike("exponential_viscous", FAST);
    let bends = Candidate {
        beside: &["viscous"],
        unless_shaped: true,
        instead_of: Some("viscous"),
        value: Some("p"),
    };
    vec![
        ElementKind { candidate: Some(falls), ..stribeck },
        ElementKind::law("arctangent", laws::Arctangent)
            .equation("fa atan(fb q̇)")
            .reference("ER-16, 2018")
            .keys(&["effort"])
            .alike("sigmoid", SLOW)
            .alike("sigmoid_offset", SLOW),
        ElementKind { candidate: Some(saturates), ..tanh },
        ElementKind::law("sigmoid", laws::Sigmoid)
            .equation("fg [S(phi2 (q̇ + phi3)) - S(phi2 phi3)], S(x) = 1/(1 + e^-x)")
            .help("zero at rest; in place of `coulomb`")
            .reference("Gaz et al. 2019")
            .keys(&["effort"]),
        ElementKind::law("sigmoid_offset", laws::SigmoidOffset)
            .equation("fl S(alpha (q̇ + nu))")
            .help("beside `offset`, in place of `coulomb`")
            .keys(&["effort"]),
        ElementKind { candidate: Some(bends), ..power },
        ElementKind { candidate: Some(directed), ..magnitude },
    ]
}

fn load() -> ElementKind {
    let candidate =
        Candidate { beside: &["coulomb", "stribeck"], unless_shaped: false, instead_of: None, value: None };
    ElementKind {
        linear: vec![LinearTerm::new("mu", NUMBER).at_least(0.0)],
        gives_way: true,
        candidate: Some(candidate),
        ..ElementKind::bare("load", Build::Robot)
    }
    .equation("mu abs(τ) sign(q̇)")
    .help("`τ` the rigid effort with reference inertias: gears under load; beside `coulomb`")
    .keys(&["coefficient"])
}

fn exponential_viscous() -> ElementKind {
    let number =
        |key, default| OptionTerm::Number { key, default, expected: "a number", holds: |x| !x.is_nan() };
    let degrees = |key, default| OptionTerm::Number {
        key,
        default,
        expected: "degrees Celsius",
        holds: |t| (-40.0..=120.0).contains(&t),
    };
    let law = ElementKind::law("exponential_viscous", laws::ExponentialViscous::default())
        .equation(
            "sign(q̇) σ2(T) (1 - exp(-abs(σ3(T) q̇)^σ4(T))), σ_j(T) = sigma_j + sigma_j_slope (T - reference_temperature)",
        )
        .help("in place of `viscous`")
        .reference("Tadese et al. 2022");
    ElementKind {
        gives_way: false,
        options: vec![
            degrees("reference_temperature", "25"),
            degrees("temperature", "the log's"),
            number("temperature_min", "none"),
            number("temperature_max", "none"),
        ],
        build: Build::Element(|p| {
            let default = laws::ExponentialViscous::default();
            let (lowest, highest) = default.temperature_range;
            let low = p.number("temperature_min").unwrap_or(lowest);
            let high = p.number("temperature_max").unwrap_or(highest);
            if low >= high {
                return Err(format!(
                    "expected `temperature_min` below `temperature_max`, found {low} and {high}"
                ));
            }
            let law = laws::ExponentialViscous {
                reference_temperature: p
                    .number("reference_temperature")
                    .unwrap_or(default.reference_temperature),
                temperature_range: (low, high),
                temperature: p.number("temperature"),
            };
            let shape = std::array::from_fn(|k| p.shape[k]);
            Ok(Box::new(AtJoint { rate: p.rate, law, shape }))
        }),
        ..law
    }
}

fn lugre() -> ElementKind {
    let [kappa, rho, vs, delta] = LuGre::TERMS;
    ElementKind {
        linear: vec![LinearTerm::effort("fc").friction(), LinearTerm::viscous("sigma1").at_least(0.0)],
        shape: vec![kappa, rho, vs, delta],
        friction: true,
        ..ElementKind::bare(
            "lugre",
            Build::Element(|p| {
                let [kappa, rho, vs, delta] = std::array::from_fn(|k| p.shape[k]);
                Ok(Box::new(LuGre { rate: p.rate, kappa, rho, vs, delta }))
            }),
        )
    }
    .equation("fc w + sigma1 ẇ/kappa, ẇ = kappa (q̇ - abs(q̇) w/γ), γ = 1 + (rho - 1) E")
    .help("bristles, `kappa` = σ0/fc, `rho` = fs/fc; in place of `coulomb`")
    .reference("Canudas de Wit et al. 1995")
    .keys(&["coulomb", "sigma1"])
    .excludes("coulomb", "its bristles, once bent, are the sign")
    .excludes("stribeck", "its bristles, once bent, are Stribeck friction")
    .excludes("stribeck_viscous", "both have a Stribeck speed `vs`")
    .excludes("asymmetric", "its bristles, once bent, are the sign")
    .alike("tanh", SLOW)
}

fn maxwell_slip() -> ElementKind {
    let kind = of("maxwell_slip", &[MaxwellSlip::FRICTION], |p| {
        Ok(Box::new(MaxwellSlip { rate: p.rate, travel: p.shape[0] }))
    });
    let gives = Candidate {
        beside: &["coulomb", "stribeck", "asymmetric"],
        unless_shaped: false,
        instead_of: None,
        value: Some("travel"),
    };
    ElementKind { shape: vec![MaxwellSlip::TRAVEL], friction: true, candidate: Some(gives), ..kind }
        .equation("fm w, ẇ = q̇/travel, abs(w) ≤ 1")
        .help("dry friction that gives way over `travel` after a reversal; beside `coulomb` or `stribeck`: [Motion before](#motion-before)")
        .reference("Al-Bender et al. 2005")
        .keys(&["friction"])
        .excludes("lugre", "both remember the motion before as one friction")
}

fn stribeck_viscous() -> ElementKind {
    ElementKind::law("stribeck_viscous", laws::StribeckViscous)
        .equation("fvs q̇ exp(-abs(q̇/vs)^delta)")
        .help("viscous friction that fades with speed; not beside `stribeck`")
        .reference("Sun et al., Eqs. 14, 15")
        .keys(&["coefficient"])
}

fn external_load() -> ElementKind {
    let kind = of("external_load", &[LinearTerm::new("load", NUMBER)], |p| {
        Ok(Box::new(ExternalLoad { rate: p.rate, brake: p.flag("brake") }))
    });
    ElementKind { options: vec![OptionTerm::Flag { key: "brake" }], ..kind }
        .equation("load T(t)")
        .help(
            "or `load T(t) sign(q̇)` with `external_load = { brake = true }`, `T` the channel `load_<joint>` of the log",
        )
        .keys(&["factor"])
}

fn reaction_friction() -> ElementKind {
    let number = |symbol| LinearTerm::new(symbol, NUMBER).at_least(0.0);
    let linear = [number("mu_c"), number("mu_s"), LinearTerm::new("mu_v", PER_SPEED).at_least(0.0)];
    let kind = of("reaction_friction", &linear, |p| {
        let law = Stribeck { vs: p.shape[0], delta: p.shape[1], ..Stribeck::new(p.rate) };
        Ok(Box::new(ReactionFriction { law, falls: p.flag("stribeck"), viscous: p.flag("viscous") }))
    });
    let options = ["stribeck", "viscous"].map(|key| OptionTerm::Flag { key }).to_vec();
    ElementKind { shape: laws::Stribeck.shape().to_vec(), options, ..kind }
        .equation("[mu_c + (mu_s - mu_c) exp(-abs(q̇/vs)^delta)] F sign(q̇) + mu_c F_w sign(q̇) + mu_v (F + F_w) q̇")
        .help(
            "friction that follows the reaction `F` in a joint and a steady force `F_w`: [Friction that follows loads](../questions/loads.md)",
        )
        .reference("Rosyid and El-Khasawneh 2020")
        .keys(&["mu_c", "mu_s", "mu_v"])
        .excludes("load", "both follow the load of the joint")
        .alike("coulomb", "reactions that vary")
        .alike("stribeck", "reactions that vary")
}

fn elastic() -> ElementKind {
    ElementKind {
        linear: vec![
            LinearTerm::new("k1", STIFFNESS).at_least(0.0),
            LinearTerm::new("k2", ["N m/rad³", "N/m³"]),
            LinearTerm::new("d", VISCOUS).at_least(0.0),
        ],
        ..ElementKind::bare("elastic", Build::Robot)
    }
    .equation("k1 Δ + k2 Δ³ + d Δ̇")
    .help("a spring between a motor and its joint: [Elastic joints](elastic.md)")
}
