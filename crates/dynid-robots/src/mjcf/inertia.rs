//! The inertia of a body as it states it, or as its shapes have it, with what `<compiler>` makes of it.

use dynid_model::{Inertia, Mat3, Placement, Vec3, symmetric};

use super::compiler::{Compiler, FromGeoms};
use super::fields::Fields;
use super::orientation::orientation;
use super::{geom, mesh::Meshes};
use crate::robot_error::RobotFileError;

/// A body about its centre of mass, in axes of the body.
#[derive(Clone, Copy, Debug)]
struct Central {
    mass: f64,
    com: Vec3<f64>,
    tensor: Mat3<f64>,
}

/// What a body has that says something about its inertia; every element with the frame that frames around it make.
pub(super) struct Matter<'m, 'a> {
    pub(super) inertial: Option<(&'m Fields<'a>, Placement)>,
    pub(super) geoms: &'m [(Fields<'a>, Placement)],
    /// Where the body is in its parent.
    pub(super) place: Placement,
    /// Whether shapes are to be weighed: not of bodies that stand still, whose shapes may be of any kind.
    pub(super) weigh: bool,
}

/// The inertia of a body about its frame; `None` if nothing says what it is.
pub(super) fn of_body(
    matter: &Matter<'_, '_>,
    compiler: &Compiler<'_>,
    meshes: &mut Meshes<'_>,
) -> Result<Option<Inertia>, RobotFileError> {
    let stated = matter.inertial.map(|(fields, frame)| stated(fields, &frame, compiler)).transpose()?;
    let from_shapes = match compiler.from_geoms {
        FromGeoms::Never => false,
        FromGeoms::Missing => stated.is_none(),
        FromGeoms::Always => true,
    };
    let mut sum: Option<Inertia> = None;
    if from_shapes && matter.weigh {
        for (fields, frame) in matter.geoms {
            if geom::counts(fields, compiler)? {
                let one = geom::inertia(fields, compiler, meshes)?.in_frame(frame);
                sum = Some(sum.unwrap_or_default().plus(&one));
            }
        }
    }
    let central = match (sum, stated) {
        (Some(sum), _) => match sum.about_com() {
            Some((com, tensor)) => Some(Central { mass: sum.mass(), com, tensor }),
            None => Some(Central { mass: 0.0, com: Vec3::zero(), tensor: Mat3::zero() }),
        },
        (None, stated) => stated,
    };
    if compiler.takes_inertias_as_stated() {
        return Ok(central.map(|c| Inertia::from_com(c.mass, c.com, &c.tensor)));
    }
    // A body of which nothing is said is raised to the bounds as well, at the place where it stands in its parent.
    let bounded = compiler.least_mass > 0.0 || compiler.least_inertia > 0.0;
    let nothing = Central { mass: 0.0, com: matter.place.translation, tensor: Mat3::zero() };
    let central = central.or((bounded && matter.weigh).then_some(nothing));
    Ok(central.map(|c| adjusted(&c, compiler)))
}

/// What `<inertial>` states.
fn stated(
    fields: &Fields<'_>,
    frame: &Placement,
    compiler: &Compiler<'_>,
) -> Result<Central, RobotFileError> {
    let required = |key: &str| fields.missing(format!("an attribute `{key}`"));
    let com = Vec3(fields.numbers("pos")?.ok_or_else(|| required("pos"))?);
    let [mass] = fields.numbers("mass")?.ok_or_else(|| required("mass"))?;
    // Whether a body can have this mass is decided where bodies are put together, as of a URDF.
    let tensor = match (fields.numbers("fullinertia")?, fields.numbers("diaginertia")?) {
        (Some(_), Some(_)) => return Err(fields.value("fullinertia", "no `diaginertia` beside it")),
        (Some([xx, yy, zz, xy, xz, yz]), None) => {
            if fields.first(&["quat", "axisangle", "xyaxes", "zaxis", "euler"]).is_some() {
                return Err(fields.value("fullinertia", "no orientation beside it"));
            }
            Mat3::from_rows([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        }
        (None, principal) => {
            let [x, y, z] = principal.unwrap_or_default();
            let r = orientation(fields, compiler)?;
            let about = Mat3::from_rows([[x, 0.0, 0.0], [0.0, y, 0.0], [0.0, 0.0, z]]);
            r.mul_mat(&about).mul_mat(&r.transpose())
        }
    };
    let r = frame.rotation;
    let turned = if r == Mat3::identity() { tensor } else { r.mul_mat(&tensor).mul_mat(&r.transpose()) };
    Ok(Central { mass, com: r.mul_vec(com) + frame.translation, tensor: turned })
}

/// Bounds from below, and equal moments where the stated ones are impossible.
fn adjusted(central: &Central, compiler: &Compiler<'_>) -> Inertia {
    let Central { mass, com, tensor } = *central;
    let (moments, axes) = symmetric::eigen(&tensor.rows());
    let mut raised = moments.map(|x| x.max(compiler.least_inertia));
    let sum: f64 = raised.iter().sum();
    if compiler.balance && raised.iter().any(|x| 2.0 * x > sum) {
        raised = [sum / 3.0; 3];
    }
    let tensor = if raised == moments {
        tensor
    } else {
        let diagonal = std::array::from_fn(|i| std::array::from_fn(|j| if i == j { raised[i] } else { 0.0 }));
        Mat3::from_rows(symmetric::congruence(&axes, &diagonal))
    };
    Inertia::from_com(mass.max(compiler.least_mass), com, &tensor)
}
