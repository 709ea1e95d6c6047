//! Triangles from mesh files: STL (binary or text) and OBJ.

use std::io;
use std::path::Path;

use dynid_files::digest::{SourceFile, sha256};
use dynid_files::input;
use thiserror::Error;

/// Bytes before the triangles of a binary STL, and of each triangle.
const STL_HEADER: usize = 84;
const STL_TRIANGLE: usize = 50;

/// Triangles in the units and axes of their file.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Mesh {
    /// Corners of every triangle.
    pub triangles: Vec<[[f64; 3]; 3]>,
}

/// Why a mesh file is not read.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum MeshError {
    /// The operating system would not give the file, or it is too large.
    #[error("{file}: cannot be read: {error}")]
    Unreadable {
        /// File.
        file: String,
        /// Reason.
        error: io::Error,
    },
    /// A format that this version does not read.
    #[error("{file}: expected STL or OBJ, found {found}")]
    Format {
        /// File.
        file: String,
        /// The extension.
        found: String,
    },
    /// The file breaks its format.
    #[error("{file}: {message}")]
    Damaged {
        /// File.
        file: String,
        /// What is wrong.
        message: String,
    },
    /// A binary STL that is longer or shorter than its header says.
    #[error("{file}: expected {expected} triangles, as its header says, found {found}")]
    Count {
        /// File.
        file: String,
        /// Triangles that the header states.
        expected: usize,
        /// Triangles in the file.
        found: usize,
    },
    /// A corner that is not a finite number.
    #[error("{file}: triangle {triangle}: expected finite coordinates")]
    NotFinite {
        /// File.
        file: String,
        /// Number of the triangle, from 1.
        triangle: usize,
    },
    /// No triangle at all.
    #[error("{file}: expected triangles, found none")]
    Empty {
        /// File.
        file: String,
    },
}

/// Reads a mesh file of at most 256 MiB, STL or OBJ by its extension, and says what was read.
///
/// # Errors
/// [`MeshError`].
pub fn read(path: &Path) -> Result<(Mesh, SourceFile), MeshError> {
    let file = path.display().to_string();
    let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default();
    if !matches!(extension.as_str(), "stl" | "obj") {
        let found = if extension.is_empty() { "no extension".to_owned() } else { format!("`.{extension}`") };
        return Err(MeshError::Format { file, found });
    }
    let bytes = input::read(path).map_err(|error| MeshError::Unreadable { file: file.clone(), error })?;
    let mesh = if extension == "stl" { stl(&bytes, &file) } else { obj(&bytes, &file) }?;
    Ok((mesh, SourceFile { path: file, sha256: sha256(&bytes) }))
}

/// Triangles of an STL, binary or text.
///
/// # Errors
/// [`MeshError`]; `file` stands in messages.
pub fn stl(bytes: &[u8], file: &str) -> Result<Mesh, MeshError> {
    let is_text = bytes.trim_ascii_start().starts_with(b"solid")
        && bytes.windows(5).take(1 << 16).any(|word| word == b"facet" || word == b"endso");
    if !is_text {
        if bytes.len() < STL_HEADER {
            let message = format!("expected the header of an STL, {STL_HEADER} bytes, found {}", bytes.len());
            return Err(MeshError::Damaged { file: file.to_owned(), message });
        }
        let stated = [bytes[80], bytes[81], bytes[82], bytes[83]];
        let (expected, found) =
            (u32::from_le_bytes(stated) as usize, (bytes.len() - STL_HEADER) / STL_TRIANGLE);
        if expected != found {
            return Err(MeshError::Count { file: file.to_owned(), expected, found });
        }
    }
    triangles(mesh_loader::stl::from_slice(bytes), file)
}

/// Triangles of an OBJ; polygons are cut into triangles. Materials are not looked for.
///
/// # Errors
/// [`MeshError`]; `file` stands in messages.
pub fn obj(bytes: &[u8], file: &str) -> Result<Mesh, MeshError> {
    let no_material = |_: &Path| -> io::Result<Vec<u8>> { Err(io::ErrorKind::NotFound.into()) };
    triangles(mesh_loader::obj::from_slice(bytes, None::<&Path>, no_material), file)
}

fn triangles(scene: io::Result<mesh_loader::Scene>, file: &str) -> Result<Mesh, MeshError> {
    let damaged = |message: String| MeshError::Damaged { file: file.to_owned(), message };
    let scene = scene.map_err(|e| damaged(e.to_string()))?;
    let mut mesh = Mesh::default();
    for part in &scene.meshes {
        for face in &part.faces {
            let corner = |k: u32| part.vertices.get(k as usize).map(|v| v.map(f64::from));
            let [Some(a), Some(b), Some(c)] = face.map(corner) else {
                return Err(damaged("a triangle has a corner that does not exist".to_owned()));
            };
            mesh.triangles.push([a, b, c]);
        }
    }
    let is_finite = |t: &[[f64; 3]; 3]| t.iter().flatten().all(|x| x.is_finite());
    match mesh.triangles.iter().position(|t| !is_finite(t)) {
        Some(k) => Err(MeshError::NotFinite { file: file.to_owned(), triangle: k + 1 }),
        None if mesh.triangles.is_empty() => Err(MeshError::Empty { file: file.to_owned() }),
        None => Ok(mesh),
    }
}
