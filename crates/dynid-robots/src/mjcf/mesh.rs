//! Inertia of meshes, by the ways that MJCF has for it.

use std::collections::HashMap;
use std::path::Path;

use dynid_files::digest::SourceFile;
use dynid_files::excerpt::closest;
use dynid_model::{Mat3, Placement, Vec3};

use super::compiler::Compiler;
use super::defaults::Defaults;
use super::document::Document;
use super::fields::Fields;
use super::orientation::rotation;
use super::{FLATTEN, SOLID};
use crate::mesh::{self, Mesh};
use crate::robot_error::RobotFileError;

/// Least volume (of a shell area) of a mesh, m³ or m².
const LEAST: f64 = 1e-15;

/// What a mesh weighs.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shape {
    /// Volume, m³; of a shell its area, m².
    pub(super) volume: f64,
    pub(super) center: Vec3<f64>,
    /// Tensor about the centre per unit mass, m².
    pub(super) per_mass: Mat3<f64>,
}

/// How a mesh is filled.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Filling {
    /// Pyramids from a point inside to every face, with their sign.
    Exact,
    /// The same without signs.
    Legacy,
    /// Mass on the faces.
    Shell,
}

/// Meshes of a model, read when a body needs them.
pub(super) struct Meshes<'a> {
    compiler: &'a Compiler<'a>,
    folder: &'a Path,
    assets: HashMap<String, Fields<'a>>,
    known: HashMap<String, Shape>,
    pub(super) sources: Vec<SourceFile>,
}

impl<'a> Meshes<'a> {
    pub(super) fn of(
        document: &'a Document,
        compiler: &'a Compiler<'a>,
        defaults: &Defaults<'a>,
        folder: &'a Path,
    ) -> Result<Self, RobotFileError> {
        let mut assets = HashMap::new();
        let all = document.sections("asset").flat_map(|s| &s.children).filter(|e| e.name == "mesh");
        for element in all {
            let fields = Fields::new(document, element, defaults.behind(element, None)?);
            let stem = || {
                let file = Path::new(element.text("file")?);
                Some(file.file_stem()?.to_string_lossy().into_owned())
            };
            if let Some(name) = element.text("name").map(str::to_owned).or_else(stem) {
                assets.insert(name, fields);
            }
        }
        Ok(Meshes { compiler, folder, assets, known: HashMap::new(), sources: Vec::new() })
    }

    /// What the mesh of a geom weighs.
    pub(super) fn shape(&mut self, geom: &Fields<'_>) -> Result<Shape, RobotFileError> {
        let Some(name) = geom.text("mesh") else {
            return Err(geom.missing("an attribute `mesh`".to_owned()));
        };
        if let Some(shape) = self.known.get(name) {
            return Ok(*shape);
        }
        let Some(asset) = self.assets.get(name).cloned() else {
            let known: Vec<&String> = self.assets.keys().collect();
            return Err(geom.unknown("mesh", "mesh", closest(name, &known)));
        };
        let shape = self.weigh(&asset)?;
        self.known.insert(name.to_owned(), shape);
        Ok(shape)
    }

    fn weigh(&mut self, asset: &Fields<'a>) -> Result<Shape, RobotFileError> {
        let filling = match asset.text("inertia") {
            None | Some("legacy") => Filling::Legacy,
            Some("exact") => Filling::Exact,
            Some("shell") => Filling::Shell,
            Some("convex") => {
                let reason = "its inertia is that of its convex hull, which is not computed here";
                return Err(asset.refuse("inertia", reason, SOLID));
            }
            Some(_) => return Err(asset.value("inertia", "convex, exact, legacy or shell")),
        };
        let Mesh { mut triangles } = self.triangles(asset)?;
        let scale = asset.numbers("scale")?.unwrap_or([1.0; 3]);
        let reference = Placement {
            rotation: rotation(asset.numbers("refquat")?.unwrap_or([1.0, 0.0, 0.0, 0.0])),
            translation: asset.vector("refpos")?,
        };
        if !reference.is_finite() {
            return Err(asset.value("refquat", "a quaternion other than zero"));
        }
        let turned = scale.iter().product::<f64>() < 0.0;
        for triangle in &mut triangles {
            for corner in triangle.iter_mut() {
                let moved = reference.rotation.tr_mul_vec(Vec3(*corner) - reference.translation);
                *corner = std::array::from_fn(|k| moved.0[k] * scale[k]);
            }
            if turned {
                triangle.swap(1, 2);
            }
        }
        weigh(&triangles, filling).ok_or_else(|| {
            let reason = "its faces enclose no volume";
            asset.refuse("inertia", reason, "write `inertia=\"shell\"`, or state an <inertial> in the body")
        })
    }

    /// Triangles of the file of a mesh, or of its own attributes.
    fn triangles(&mut self, asset: &Fields<'a>) -> Result<Mesh, RobotFileError> {
        if asset.has("builtin") {
            let reason = "it is made by MuJoCo, and not read from a file";
            return Err(asset.refuse("builtin", reason, FLATTEN));
        }
        let Some(file) = asset.text("file") else { return self.own_triangles(asset) };
        let name = match Path::new(file).file_name() {
            Some(name) if self.compiler.strip_path => Path::new(name),
            _ => Path::new(file),
        };
        let path = self.folder.join(self.compiler.mesh_folder).join(name);
        let (mesh, source) = mesh::read(&path).map_err(|error| {
            asset.refuse(
                "file",
                format!("its inertia is needed, and {error}"),
                "state an <inertial> in the body, or give the mesh as STL or OBJ",
            )
        })?;
        self.sources.push(source);
        Ok(mesh)
    }

    /// Triangles that stand in the model.
    fn own_triangles(&self, asset: &Fields<'a>) -> Result<Mesh, RobotFileError> {
        let list = |key: &str| -> Result<Vec<f64>, RobotFileError> {
            let words = asset.text(key).unwrap_or_default().split_ascii_whitespace();
            let numbers: Option<Vec<f64>> =
                words.map(|w| w.parse().ok().filter(|x: &f64| x.abs() < 1e30)).collect();
            numbers
                .filter(|n| n.len() % 3 == 0)
                .ok_or_else(|| asset.value(key, "finite numbers, three by three"))
        };
        if !asset.has("face") {
            let reason = "it has corners without faces: its inertia is that of their convex hull, which is not computed here";
            return Err(asset.refuse("vertex", reason, SOLID));
        }
        // MuJoCo holds corners in single precision.
        #[expect(clippy::cast_possible_truncation, reason = "as the model is compiled")]
        let corners: Vec<[f64; 3]> = list("vertex")?
            .chunks_exact(3)
            .map(|c| [c[0], c[1], c[2]].map(|x| f64::from(x as f32)))
            .collect();
        let corner = |k: f64| {
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "checked")]
            let known = (k >= 0.0 && k.fract() == 0.0 && k < corners.len() as f64).then_some(k as usize);
            known.map(|k| corners[k]).ok_or_else(|| asset.value("face", "numbers of corners, from 0"))
        };
        let faces = list("face")?;
        let triangles = faces.chunks_exact(3).map(|f| Ok([corner(f[0])?, corner(f[1])?, corner(f[2])?]));
        Ok(Mesh { triangles: triangles.collect::<Result<_, RobotFileError>>()? })
    }
}

/// Volume, centre and tensor of triangles; `None` if they enclose nothing.
fn weigh(triangles: &[[[f64; 3]; 3]], filling: Filling) -> Option<Shape> {
    let corners = |t: &[[f64; 3]; 3]| t.map(Vec3);
    let area = |[a, b, c]: [Vec3<f64>; 3]| 0.5 * (b - a).cross(c - a).norm();
    let middle = |[a, b, c]: [Vec3<f64>; 3]| (a + b + c).scale(1.0 / 3.0);
    let mut surface = 0.0;
    let mut inside = Vec3::zero();
    for t in triangles {
        let t = corners(t);
        surface += area(t);
        inside = inside + middle(t).scale(area(t));
    }
    if !(surface.is_finite() && surface >= LEAST) {
        return None;
    }
    let inside = inside.scale(1.0 / surface);
    // Weight of a triangle seen from a point: the pyramid's volume, or the area of the triangle itself.
    let weight = |[a, b, c]: [Vec3<f64>; 3]| {
        let signed = a.dot(b.cross(c)) / 6.0;
        match filling {
            Filling::Exact => signed,
            Filling::Legacy => signed.abs(),
            Filling::Shell => area([a, b, c]),
        }
    };
    let (mut total, mut sum) = (0.0, Vec3::zero());
    for t in triangles {
        let t = corners(t).map(|x| x - inside);
        let w = weight(t);
        total += w;
        // The centre of a pyramid is three quarters of the way to its face.
        sum = sum + middle(t).scale(w * if filling == Filling::Shell { 1.0 } else { 0.75 });
    }
    if !(total.is_finite() && total >= LEAST) {
        return None;
    }
    let center = inside + sum.scale(1.0 / total);
    let mut second = [[0.0; 3]; 3];
    let mut volume = 0.0;
    let share = if filling == Filling::Shell { 12.0 } else { 20.0 };
    for t in triangles {
        let t = corners(t).map(|x| x - center);
        let w = weight(t);
        volume += w;
        let whole = (t[0] + t[1] + t[2]).0;
        for (i, row) in second.iter_mut().enumerate() {
            for (j, entry) in row.iter_mut().enumerate() {
                // Σ over pairs of corners, each square counted twice.
                let squares: f64 = t.iter().map(|x| x.0[i] * x.0[j]).sum();
                *entry += w / share * (squares + whole[i] * whole[j]);
            }
        }
    }
    let trace = second[0][0] + second[1][1] + second[2][2];
    let per_mass = (Mat3::identity() * trace + Mat3::from_rows(second) * -1.0) * (1.0 / volume);
    (volume >= LEAST && per_mass.0.iter().all(|c| c.norm().is_finite())).then_some(Shape {
        volume,
        center,
        per_mass,
    })
}
