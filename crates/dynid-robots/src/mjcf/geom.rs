//! Inertia of the shapes of a body.

use std::f64::consts::PI;

use dynid_model::{Inertia, Mat3, Placement, Vec3};

use super::compiler::Compiler;
use super::fields::Fields;
use super::mesh::Meshes;
use super::orientation::{from_z, placement};
use super::{FLATTEN, SOLID};
use crate::robot_error::RobotFileError;

/// Density where none is stated, kg/m³.
const DENSITY: f64 = 1000.0;
/// Volumes below this are none, m³ (or m²).
const LEAST_VOLUME: f64 = 1e-14;

/// Volume (of a shell area) and principal second moments per unit mass, about the middle of a shape.
struct Moments {
    volume: f64,
    /// Moments of inertia per mass, m².
    per_mass: [f64; 3],
}

/// Whether the shape counts for inertias.
pub(super) fn counts(fields: &Fields<'_>, compiler: &Compiler<'_>) -> Result<bool, RobotFileError> {
    let group = fields.number("group", 0.0)?;
    Ok(group >= compiler.groups[0] && group <= compiler.groups[1])
}

/// The inertia of a shape in the frame of what holds it.
pub(super) fn inertia(
    fields: &Fields<'_>,
    compiler: &Compiler<'_>,
    meshes: &mut Meshes<'_>,
) -> Result<Inertia, RobotFileError> {
    let mass = fields.numbers("mass")?.map(|[m]| m);
    let density = fields.number("density", DENSITY)?;
    let mass = mass.map(|m| fields.not_negative("mass", m)).transpose()?;
    let density = fields.not_negative("density", density)?;
    if mass == Some(0.0) || (mass.is_none() && density == 0.0) {
        return Ok(Inertia::default());
    }
    let kind = fields.text("type").unwrap_or("sphere");
    let has_mesh = fields.has("mesh");
    let (place, volume, center, per_mass) = match kind {
        "plane" | "hfield" => return Ok(Inertia::default()),
        "mesh" => {
            let shape = meshes.shape(fields)?;
            (placement(fields, compiler)?, shape.volume, shape.center, shape.per_mass)
        }
        "sdf" => {
            let reason = "its inertia would be that of a signed distance field, which is not computed here";
            return Err(fields.refuse("type", reason, SOLID));
        }
        "sphere" | "capsule" | "cylinder" | "ellipsoid" | "box" if has_mesh => {
            let reason = format!("its size is that of a {kind} fitted to a mesh, which is not computed here");
            return Err(fields.refuse("mesh", reason, FLATTEN));
        }
        "sphere" | "capsule" | "cylinder" | "ellipsoid" | "box" => {
            let (place, size) = sized(fields, compiler, kind)?;
            let shell = fields.flag("shellinertia")?.unwrap_or(false);
            let moments = if shell { shell_of(fields, kind, size)? } else { solid(kind, size) };
            let [x, y, z] = moments.per_mass;
            let per_mass = Mat3::from_rows([[x, 0.0, 0.0], [0.0, y, 0.0], [0.0, 0.0, z]]);
            (place, moments.volume, Vec3::zero(), per_mass)
        }
        _ => return Err(fields.value("type", "a kind of geom")),
    };
    let mass = match mass {
        Some(_) if volume <= LEAST_VOLUME => 0.0,
        Some(mass) => mass,
        None => density * volume,
    };
    Ok(Inertia::from_com(mass, center, &(per_mass * mass)).in_frame(&place))
}

/// Place and sizes of a shape that is none of a file; with `fromto` both follow from two points.
fn sized(
    fields: &Fields<'_>,
    compiler: &Compiler<'_>,
    kind: &str,
) -> Result<(Placement, [f64; 3]), RobotFileError> {
    let mut size = fields.filled("size", [0.0; 3])?;
    let mut place = placement(fields, compiler)?;
    if let Some([a, b, c, d, e, f]) = fields.numbers("fromto")? {
        if kind == "sphere" {
            return Err(fields.value("fromto", "no two points of a sphere"));
        }
        let (from, to) = (Vec3([a, b, c]), Vec3([d, e, f]));
        let way = from - to;
        let length = way.norm();
        if length < LEAST_VOLUME {
            return Err(fields.value("fromto", "two points that are apart"));
        }
        place = Placement { rotation: from_z(way.scale(1.0 / length)), translation: (from + to).scale(0.5) };
        size = match kind {
            "box" | "ellipsoid" => [size[0], size[0], 0.5 * length],
            _ => [size[0], 0.5 * length, 0.0],
        };
    }
    let needed = match kind {
        "sphere" => 1,
        "capsule" | "cylinder" => 2,
        _ => 3,
    };
    if size[..needed].iter().any(|x| *x <= 0.0) {
        let plural =
            if needed == 1 { "a positive size".to_owned() } else { format!("{needed} positive sizes") };
        return Err(fields.value("size", plural));
    }
    Ok((place, size))
}

fn solid(kind: &str, [a, b, c]: [f64; 3]) -> Moments {
    let (aa, bb, cc) = (a * a, b * b, c * c);
    let of = |volume, per_mass| Moments { volume, per_mass };
    match kind {
        "sphere" => of(4.0 * PI * a * aa / 3.0, [0.4 * aa; 3]),
        "capsule" => {
            // A cylinder of height 2 b between two halves of a sphere.
            let (ball, rod) = (4.0 * a * aa / 3.0, 2.0 * b * aa);
            let (ball_share, rod_share) = (ball / (ball + rod), rod / (ball + rod));
            let height = 2.0 * b;
            let across = rod_share * (3.0 * aa + height * height) / 12.0
                + ball_share * (0.4 * aa + height * (3.0 * a + 2.0 * height) / 8.0);
            let along = rod_share * aa / 2.0 + ball_share * 0.4 * aa;
            of(PI * (ball + rod), [across, across, along])
        }
        "cylinder" => {
            let across = (3.0 * aa + 4.0 * bb) / 12.0;
            of(2.0 * PI * aa * b, [across, across, aa / 2.0])
        }
        "ellipsoid" => of(4.0 * PI * a * b * c / 3.0, [(bb + cc) / 5.0, (aa + cc) / 5.0, (aa + bb) / 5.0]),
        _ => of(8.0 * a * b * c, [(bb + cc) / 3.0, (aa + cc) / 3.0, (aa + bb) / 3.0]),
    }
}

/// A shape whose mass lies on its surface; the volume is its area.
fn shell_of(fields: &Fields<'_>, kind: &str, [a, b, c]: [f64; 3]) -> Result<Moments, RobotFileError> {
    let (aa, bb, cc) = (a * a, b * b, c * c);
    Ok(match kind {
        "sphere" => Moments { volume: 4.0 * PI * aa, per_mass: [2.0 * aa / 3.0; 3] },
        "capsule" => {
            let (ball, rod) = (4.0 * PI * aa, 4.0 * PI * a * b);
            let (ball_share, rod_share) = (ball / (ball + rod), rod / (ball + rod));
            // Halves of the sphere, each with its centre of mass half a radius from its middle.
            let across = rod_share * (6.0 * aa + 4.0 * bb) / 12.0
                + ball_share * (2.0 * aa / 3.0 + (b + 0.5 * a).powi(2) - 0.25 * aa);
            let along = rod_share * aa + ball_share * 2.0 * aa / 3.0;
            Moments { volume: ball + rod, per_mass: [across, across, along] }
        }
        "cylinder" => {
            let (disks, tube) = (2.0 * PI * aa, 4.0 * PI * a * b);
            let (disk_share, tube_share) = (disks / (disks + tube), tube / (disks + tube));
            let across = tube_share * (6.0 * aa + 4.0 * bb) / 12.0 + disk_share * (aa / 4.0 + bb);
            let along = tube_share * aa + disk_share * aa / 2.0;
            Moments { volume: disks + tube, per_mass: [across, across, along] }
        }
        "box" => {
            // Second moments of three pairs of faces, by the axis that they stand across.
            let faces = [b * c, c * a, a * b];
            let area: f64 = faces.iter().sum();
            let second = |axis: usize, half: f64| {
                faces
                    .iter()
                    .enumerate()
                    .map(|(face, part)| if face == axis { half } else { half / 3.0 } * part / area)
                    .sum::<f64>()
            };
            let [x, y, z] = [second(0, aa), second(1, bb), second(2, cc)];
            Moments { volume: 8.0 * area, per_mass: [y + z, x + z, x + y] }
        }
        _ => {
            let reason = "the shell of an ellipsoid has no inertia in closed form";
            return Err(fields.refuse("shellinertia", reason, SOLID));
        }
    })
}
