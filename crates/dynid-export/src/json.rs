//! The identified robot as compact JSON.

use dynid_model::element::JointInfo;
use dynid_model::{EffortModel, Inertia, JointKind, Mat3, RobotModel, Vec3};
use serde::{Deserialize, Serialize};

use super::identified::inertias;
use super::read_back::{CheckStates, judge, largest_difference};
use super::{Exported, Identified};
use dynid_identify::Error;
use dynid_identify::known_friction::KnownFriction;

/// Version of the layout of [`RobotJson`]: keys are added but never renamed.
pub const ROBOT_JSON_SCHEMA: u32 = 1;

/// The identified robot for programs that do not want the whole `estimate.json`. SI units, rad.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct RobotJson {
    /// `dynid-robot`.
    pub format: String,
    /// [`ROBOT_JSON_SCHEMA`].
    pub schema: u32,
    /// Robot name.
    pub robot: String,
    /// Acceleration of gravity in base axes, m/s².
    pub gravity: [f64; 3],
    /// Moving links in the order of their joints.
    pub links: Vec<LinkJson>,
    /// Joints in the order of the efforts, then motors behind springs.
    pub joints: Vec<JointJson>,
    /// Springs between motors and joints; their stiffness is among `other`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub elastic: Vec<ElasticJson>,
    /// Parameters of further elements (springs, couplings, asymmetric and nonlinear friction).
    pub other: Vec<OtherJson>,
    /// Shape parameters: those that enter the effort nonlinearly.
    #[serde(default)]
    pub shape: Vec<OtherJson>,
    /// Friction that is known beside `joints`, whose `coulomb`, `viscous` and `offset` are errors of it where it is stated.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub known_friction: Vec<KnownFriction>,
}

/// A moving link together with all that is welded to it, in the axes of its joint frame (the URDF link frame).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct LinkJson {
    /// Link.
    pub name: String,
    /// The joint that moves it.
    pub joint: String,
    /// Links on fixed joints that count as part of it.
    pub welded: Vec<String>,
    /// Mass, kg.
    pub mass: f64,
    /// Centre of mass, m; absent without mass.
    pub com: Option<[f64; 3]>,
    /// Inertia tensor about the centre of mass, entries xx, xy, xz, yy, yz, zz, kg m²; absent without mass.
    pub inertia_com: Option<[f64; 6]>,
    /// Inertia tensor about the origin of the joint frame, same order, kg m².
    pub inertia_frame: [f64; 6],
    /// Standard parameters m, mx, my, mz, Ixx, Ixy, Ixz, Iyy, Iyz, Izz about the joint frame whose rigid effort friction of
    /// the load (`mu`) refers to; absent without such friction.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub load_reference: Option<[f64; 10]>,
    /// Why no body could have these values; absent if one could.
    pub fault: Option<String>,
}

/// A joint. Coefficients that the model has no element for are absent.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct JointJson {
    /// Joint.
    pub name: String,
    /// Unit of its effort, `N m` or `N`.
    pub effort_unit: String,
    /// Coulomb friction `fc`, N m or N.
    pub coulomb: Option<f64>,
    /// Viscous friction `fv`, N m s/rad or N s/m.
    pub viscous: Option<f64>,
    /// Offset `fo`, N m or N.
    pub offset: Option<f64>,
    /// Rotor inertia behind the gear `Ia`, kg m² or kg.
    pub rotor_inertia: Option<f64>,
}

/// A joint that its motor drives through a spring, `k1 Δ + k2 Δ³ + d Δ̇` with `Δ = motor/ratio - joint`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct ElasticJson {
    /// Joint; `<joint>.k1` and so on are its parameters.
    pub joint: String,
    /// Motor.
    pub motor: String,
    /// Travel of the motor over that of the joint with a stiff spring.
    pub ratio: f64,
}

/// A parameter of another element, by the name it has in `estimate.json`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct OtherJson {
    /// Name, `<joint>.<symbol>` or `<motor>.<symbol>`.
    pub name: String,
    /// Value.
    pub value: f64,
    /// Unit.
    pub unit: String,
}

/// Writes an identified robot as JSON and reads it back; see [`RobotJson`].
///
/// # Errors
/// [`ExportError::ReadBack`](super::ExportError::ReadBack).
pub fn json(identified: &Identified<'_>, states: &CheckStates) -> Result<Exported, Error> {
    let Identified { model, values, .. } = *identified;
    let robot = RobotJson::new(identified);
    let mut text = serde_json::to_string_pretty(&robot)
        .unwrap_or_else(|e| unreachable!("a robot holds only plain data: {e}"));
    text.push('\n');
    let read: RobotJson = serde_json::from_str(&text)
        .unwrap_or_else(|e| unreachable!("what was just written has the layout it was written with: {e}"));
    let difference = largest_difference(
        (model, &model.parameters().shape_start(), values),
        (model, &read.shape_values(model), &read.values(model)),
        states,
    );
    let difference = judge("JSON", difference)?;
    Ok(Exported { text, included: Vec::new(), difference, notes: Vec::new() })
}

impl RobotJson {
    fn new(identified: &Identified<'_>) -> Self {
        let Identified { model, values, .. } = *identified;
        let mechanism = model.mechanism();
        let reference = load_reference(identified);
        let links = mechanism
            .bodies()
            .iter()
            .zip(inertias(values))
            .enumerate()
            .map(|(b, (body, inertia))| {
                let split = inertia.about_com();
                LinkJson {
                    name: body.name.clone(),
                    joint: body.joint.name.clone(),
                    welded: body.fixed_links.iter().map(|f| f.name.clone()).collect(),
                    mass: inertia.mass(),
                    com: split.map(|(com, _)| com.0),
                    inertia_com: split.map(|(_, tensor)| six(&tensor)),
                    inertia_frame: six(&inertia.tensor()),
                    load_reference: reference.as_ref().map(|bodies| bodies[b].0),
                    fault: inertia.physical_fault().map(str::to_owned),
                }
            })
            .collect();
        let table = model.parameters();
        let owners = mechanism.rate_bodies();
        let mut told: Vec<usize> = (0..10 * mechanism.bodies().len()).collect();
        let joints = model
            .joints()
            .iter()
            .enumerate()
            .filter(|(rate, _)| {
                let body = owners.get(*rate).map(|body| &mechanism.bodies()[*body]);
                body.is_none_or(|body| body.joint.kind != JointKind::Floating)
            })
            .map(|(rate, joint)| {
                let mut value = |symbol: &str| {
                    let column = element(model, &joint.name, symbol)?;
                    told.push(column);
                    Some(values[column])
                };
                JointJson {
                    name: joint.name.clone(),
                    effort_unit: model.outputs()[rate].unit.to_owned(),
                    coulomb: value("fc"),
                    viscous: value("fv"),
                    offset: value("fo"),
                    rotor_inertia: value("Ia"),
                }
            })
            .collect();
        let other = table.linear.iter().zip(values).enumerate().filter(|(c, _)| !told.contains(c)).map(
            |(_, (p, value))| OtherJson { name: p.name.clone(), value: *value, unit: p.unit.to_owned() },
        );
        RobotJson {
            format: "dynid-robot".to_owned(),
            schema: ROBOT_JSON_SCHEMA,
            robot: mechanism.name().to_owned(),
            gravity: mechanism.gravity().0,
            links,
            joints,
            elastic: elastic(model),
            other: other.collect(),
            shape: table
                .shape
                .iter()
                .map(|s| OtherJson { name: s.name.clone(), value: s.start, unit: s.unit.to_owned() })
                .collect(),
            known_friction: identified.known_friction.to_vec(),
        }
    }

    /// Shape parameters of a model of the same robot; one that is not stated is not a number.
    fn shape_values(&self, model: &RobotModel) -> Vec<f64> {
        let stated = |name: &str| self.shape.iter().find(|s| s.name == name).map_or(f64::NAN, |s| s.value);
        model.parameters().shape.iter().map(|s| stated(&s.name)).collect()
    }

    /// Linear parameters of a model of the same robot, from mass, centre of mass and the tensor about it.
    fn values(&self, model: &RobotModel) -> Vec<f64> {
        let mut values = vec![0.0; model.parameters().linear.len()];
        for (to, link) in values.chunks_exact_mut(10).zip(&self.links) {
            let inertia = match (link.com, &link.inertia_com) {
                (Some(com), Some(tensor)) => Inertia::from_com(link.mass, Vec3(com), &matrix(tensor)),
                _ => Inertia::from_parts(link.mass, Vec3::zero(), &matrix(&link.inertia_frame)),
            };
            to.copy_from_slice(&inertia.0);
        }
        for joint in &self.joints {
            let stated = [
                ("fc", joint.coulomb),
                ("fv", joint.viscous),
                ("fo", joint.offset),
                ("Ia", joint.rotor_inertia),
            ];
            for (symbol, value) in stated {
                if let (Some(column), Some(value)) = (element(model, &joint.name, symbol), value) {
                    values[column] = value;
                }
            }
        }
        for other in &self.other {
            if let Some(column) = model.parameters().column(&other.name) {
                values[column] = other.value;
            }
        }
        values
    }
}

fn elastic(model: &RobotModel) -> Vec<ElasticJson> {
    let joints = model.joints();
    let of = |(motor, j): (usize, &JointInfo)| {
        let (link, ratio) = model.elastic_link(motor)?;
        Some(ElasticJson { joint: joints[link].name.clone(), motor: j.name.clone(), ratio })
    };
    joints.iter().enumerate().filter_map(of).collect()
}

/// Bodies that friction of the load refers to, if the model has such friction.
fn load_reference(identified: &Identified<'_>) -> Option<Vec<Inertia>> {
    let Identified { model, load_reference, .. } = *identified;
    let loaded = model.joints().iter().any(|joint| element(model, &joint.name, "mu").is_some());
    let own = || model.mechanism().inertia_vector();
    loaded.then(|| inertias(&load_reference.map_or_else(own, <[f64]>::to_vec)).collect())
}

/// Column of an element's parameter.
fn element(model: &RobotModel, joint: &str, symbol: &str) -> Option<usize> {
    model.parameters().column(&format!("{joint}.{symbol}"))
}

fn six(tensor: &Mat3<f64>) -> [f64; 6] {
    let [[xx, xy, xz], [_, yy, yz], [_, _, zz]] = tensor.rows();
    [xx, xy, xz, yy, yz, zz]
}

fn matrix([xx, xy, xz, yy, yz, zz]: &[f64; 6]) -> Mat3<f64> {
    Mat3::from_rows([[*xx, *xy, *xz], [*xy, *yy, *yz], [*xz, *yz, *zz]])
}
