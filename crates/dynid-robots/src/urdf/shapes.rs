//! Shapes of links: what a URDF says about collision and looks.

use dynid_files::excerpt::excerpt;
use dynid_model::Placement;

use super::read::{Element, Reader};
use crate::robot_error::RobotFileError;

/// What a shape is meant for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum ShapeRole {
    /// `<collision>`.
    Collision,
    /// `<visual>`.
    Visual,
}

/// A shape about its own origin.
#[derive(Debug, Clone, PartialEq)]
pub enum Shape {
    /// A box with these edge lengths, m.
    Box {
        /// Lengths along x, y, z.
        size: [f64; 3],
    },
    /// A cylinder about z.
    Cylinder {
        /// Radius, m.
        radius: f64,
        /// Length along z, m.
        length: f64,
    },
    /// A sphere.
    Sphere {
        /// Radius, m.
        radius: f64,
    },
    /// Triangles in a file.
    Mesh {
        /// File name as it stands in the URDF: a path, `file://...` or `package://...`.
        file: String,
        /// Factors of the file's coordinates along x, y, z.
        scale: [f64; 3],
    },
}

/// A shape of a link.
#[derive(Debug, Clone, PartialEq)]
pub struct LinkShape {
    /// Link.
    pub link: String,
    /// What it is meant for.
    pub role: ShapeRole,
    /// Its origin in the frame of the link.
    pub placement: Placement,
    /// The shape.
    pub shape: Shape,
}

/// Reads the shapes of the links of a URDF text, in the order of the file; `source_name` stands in messages.
///
/// Boxes, cylinders, spheres and capsules count as shapes, and meshes by the name of their file, which is not opened. A
/// `<capsule>` (radius and length between the centres of its ends, about z) becomes a cylinder and two spheres.
///
/// # Errors
/// [`RobotFileError`] with line and column: a size that is not positive, a number that is none, another geometry.
pub fn parse_shapes(text: &str, source_name: &str) -> Result<Vec<LinkShape>, RobotFileError> {
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let reader = Reader { text, file: source_name, wanted: is_read };
    let robot = reader.tree()?;
    let mut shapes = Vec::new();
    for link in &robot.children {
        let Some(name) = link.text("name").map(|a| a.value.clone()) else { continue };
        let owner = format!("link `{}`", excerpt(&name));
        for element in &link.children {
            let role = if element.name == "collision" { ShapeRole::Collision } else { ShapeRole::Visual };
            let (xyz, rpy) = reader.origin(element, &owner)?;
            let placement = Placement::from_xyz_rpy(xyz, rpy);
            let Some(geometry) = reader.child(element, &owner, "geometry")? else { continue };
            for child in &geometry.children {
                for (offset, shape) in reader.shapes(child, &owner)? {
                    let placement = placement.then(&Placement::translate(0.0, 0.0, offset));
                    shapes.push(LinkShape { link: name.clone(), role, placement, shape });
                }
            }
        }
    }
    Ok(shapes)
}

/// Whether an element inside `parent` says something about shapes.
fn is_read(depth: usize, parent: &str, name: &str) -> bool {
    match depth {
        1 => name == "link",
        2 => matches!(name, "collision" | "visual"),
        3 => matches!(name, "origin" | "geometry"),
        4 => parent == "geometry",
        _ => false,
    }
}

impl Reader<'_> {
    /// Shapes of one element, each with the height of its origin along z.
    fn shapes(&self, element: &Element, owner: &str) -> Result<Vec<(f64, Shape)>, RobotFileError> {
        let size = |name: &str| self.size(element, owner, name);
        Ok(match element.name.as_str() {
            "box" => {
                let a = self.required(element, owner, "size")?;
                let size = self.vector(element, owner, "size")?.unwrap_or_default();
                if size.iter().any(|x| *x <= 0.0) {
                    return Err(self.value(element, owner, a, "three positive numbers"));
                }
                vec![(0.0, Shape::Box { size })]
            }
            "cylinder" => {
                vec![(0.0, Shape::Cylinder { radius: size("radius")?, length: size("length")? })]
            }
            "sphere" => vec![(0.0, Shape::Sphere { radius: size("radius")? })],
            "capsule" => {
                let (radius, length) = (size("radius")?, size("length")?);
                vec![
                    (0.0, Shape::Cylinder { radius, length }),
                    (0.5 * length, Shape::Sphere { radius }),
                    (-0.5 * length, Shape::Sphere { radius }),
                ]
            }
            "mesh" => {
                let file = self.required(element, owner, "filename")?.value.trim().to_owned();
                let scale = self.vector(element, owner, "scale")?.unwrap_or([1.0; 3]);
                vec![(0.0, Shape::Mesh { file, scale })]
            }
            other => {
                return Err(RobotFileError::Value {
                    at: self.place(element.offset),
                    owner: owner.to_owned(),
                    field: "<geometry>".to_owned(),
                    expected: "<box>, <cylinder>, <sphere>, <capsule> or <mesh>".to_owned(),
                    found: format!("<{}>", excerpt(other)),
                });
            }
        })
    }

    fn size(&self, element: &Element, owner: &str, name: &str) -> Result<f64, RobotFileError> {
        let a = self.required(element, owner, name)?;
        let x = self.number(element, owner, a)?;
        if x > 0.0 { Ok(x) } else { Err(self.value(element, owner, a, "a positive number")) }
    }
}
