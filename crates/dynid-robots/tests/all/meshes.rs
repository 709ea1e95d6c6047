//! Mesh files and the shapes of URDFs: what is read, and how faults are told.

use dynid_robots::mesh::{self, MeshError};
use dynid_robots::urdf::{Shape, ShapeRole, parse_shapes};

/// Corners of a tetrahedron's four faces.
const FACES: [[[f32; 3]; 3]; 4] = [
    [[0.0, 0.0, 0.0], [0.5, 0.0, 0.0], [0.0, 0.25, 0.0]],
    [[0.0, 0.0, 0.0], [0.5, 0.0, 0.0], [0.0, 0.0, -0.125]],
    [[0.0, 0.0, 0.0], [0.0, 0.25, 0.0], [0.0, 0.0, -0.125]],
    [[0.5, 0.0, 0.0], [0.0, 0.25, 0.0], [0.0, 0.0, -0.125]],
];

fn binary_stl() -> Vec<u8> {
    // Many programs begin the header of a binary file with the word that text files begin with.
    let mut bytes = b"solid but binary".to_vec();
    bytes.resize(80, b' ');
    bytes.extend(4_u32.to_le_bytes());
    for face in FACES {
        bytes.extend([0_u8; 12]);
        bytes.extend(face.iter().flatten().flat_map(|x| x.to_le_bytes()));
        bytes.extend([0_u8; 2]);
    }
    bytes
}

fn text_stl() -> String {
    let vertex = |[x, y, z]: &[f32; 3]| format!("      vertex {x} {y} {z}\n");
    let facet = |face: &[[f32; 3]; 3]| {
        let vertices: String = face.iter().map(vertex).collect();
        format!("  facet normal 0 0 1\n    outer loop\n{vertices}    endloop\n  endfacet\n")
    };
    format!("solid tetrahedron\n{}endsolid tetrahedron\n", FACES.iter().map(facet).collect::<String>())
}

const OBJ: &str = "mtllib none.mtl\no tetrahedron\nv 0 0 0\nv 0.5 0 0\nv 0 0.25 0\nv 0 0 -0.125\n\
                   f 1 2 3\nf 1 2 4\nf 1 3 4\nf 2 3 4\n";

fn expected() -> Vec<[[f64; 3]; 3]> {
    FACES.iter().map(|face| face.map(|p| p.map(f64::from))).collect()
}

#[test]
fn binary_and_text_stl_and_obj_give_the_same_triangles() {
    let folder = tempfile::tempdir().unwrap();
    let files =
        [("a.stl", binary_stl()), ("b.STL", text_stl().into_bytes()), ("c.obj", OBJ.as_bytes().to_vec())];
    for (name, bytes) in files {
        let path = folder.path().join(name);
        std::fs::write(&path, &bytes).unwrap();
        let (mesh, source) = mesh::read(&path).unwrap();
        assert_eq!(mesh.triangles, expected(), "{name}");
        assert_eq!(source.sha256, dynid_files::digest::sha256(&bytes), "{name}");
    }
}

#[test]
fn damaged_meshes_are_told_by_kind() {
    let mut short = binary_stl();
    short.truncate(84 + 3 * 50);
    assert!(matches!(mesh::stl(&short, "m"), Err(MeshError::Count { expected: 4, found: 3, .. })));
    let mut long = binary_stl();
    long.extend([0_u8; 50]);
    assert!(matches!(mesh::stl(&long, "m"), Err(MeshError::Count { expected: 4, found: 5, .. })));
    assert!(matches!(mesh::stl(b"", "m"), Err(MeshError::Damaged { .. })));
    let mut without_number = binary_stl();
    without_number[84 + 50 + 12..][..4].copy_from_slice(&f32::NAN.to_le_bytes());
    assert!(matches!(mesh::stl(&without_number, "m"), Err(MeshError::NotFinite { triangle: 2, .. })));
    let cut = text_stl().replace("endloop", "");
    assert!(matches!(mesh::stl(cut.as_bytes(), "m"), Err(MeshError::Damaged { .. })));
    let mut none = binary_stl();
    none.truncate(84);
    none[80] = 0;
    assert!(matches!(mesh::stl(&none, "m"), Err(MeshError::Empty { .. })));
    assert!(matches!(mesh::obj(b"v 0 0 0\nf 1 2 3\n", "m"), Err(MeshError::Damaged { .. })));
    let error = mesh::read(std::path::Path::new("arm.dae")).unwrap_err();
    assert_eq!(error.to_string(), "arm.dae: expected STL or OBJ, found `.dae`");
    assert!(matches!(mesh::read(std::path::Path::new("none.stl")), Err(MeshError::Unreadable { .. })));
}

/// Whatever the bytes, there is an answer.
#[test]
fn cut_and_changed_meshes_do_not_panic() {
    for (bytes, read) in [
        (binary_stl(), mesh::stl as fn(&[u8], &str) -> Result<mesh::Mesh, MeshError>),
        (text_stl().into_bytes(), mesh::stl),
        (OBJ.as_bytes().to_vec(), mesh::obj),
    ] {
        for at in 0..bytes.len() {
            drop(read(&bytes[..at], "m"));
            for other in [0, b'-', b'9', b' ', b'\n', 0xFF] {
                let mut changed = bytes.clone();
                changed[at] = other;
                drop(read(&changed, "m"));
            }
        }
    }
}

const URDF: &str = r#"<robot name="r">
  <link name="a">
    <collision><origin xyz="1 2 3"/><geometry><box size="0.1 0.2 0.3"/></geometry></collision>
    <visual><geometry><mesh filename="package://p/a.dae" scale="0.001 0.001 0.001"/></geometry><material name="m"/></visual>
  </link>
  <link name="b">
    <collision><geometry><capsule radius="0.1" length="0.4"/></geometry></collision>
    <collision><geometry><cylinder radius="0.2" length="0.5"/></geometry></collision>
  </link>
  <joint name="j" type="fixed"><parent link="a"/><child link="b"/></joint>
</robot>"#;

#[test]
fn shapes_of_links_are_read_with_their_role_and_place() {
    let shapes = parse_shapes(URDF, "r.urdf").unwrap();
    assert_eq!(shapes.iter().filter(|s| s.link == "b").count(), 4);
    assert_eq!(shapes[0].shape, Shape::Box { size: [0.1, 0.2, 0.3] });
    assert_eq!(shapes[0].role, ShapeRole::Collision);
    assert_eq!(shapes[0].placement.translation.0, [1.0, 2.0, 3.0]);
    let mesh = Shape::Mesh { file: "package://p/a.dae".to_owned(), scale: [0.001; 3] };
    assert_eq!((shapes[1].role, &shapes[1].shape), (ShapeRole::Visual, &mesh));
    // A capsule: the cylinder between its ends, and the spheres about them.
    assert_eq!(shapes[2].shape, Shape::Cylinder { radius: 0.1, length: 0.4 });
    assert_eq!(shapes[3].placement.translation.0, [0.0, 0.0, 0.2]);
    assert_eq!(shapes[5].shape, Shape::Cylinder { radius: 0.2, length: 0.5 });
}

#[test]
fn shapes_that_mean_nothing_are_refused_with_their_place() {
    for (good, bad, says) in [
        ("0.1 0.2 0.3", "0.1 0 0.3", "r.urdf:3:52: link `a`: <box> size: expected three positive numbers"),
        ("radius=\"0.2\"", "radius=\"-0.2\"", "<cylinder> radius: expected a positive number, found `-0.2`"),
        ("radius=\"0.2\" ", "", "expected an attribute `radius` of <cylinder>"),
        (
            "<capsule radius",
            "<cone radius",
            "expected <box>, <cylinder>, <sphere>, <capsule> or <mesh>, found `<cone>`",
        ),
    ] {
        let error = parse_shapes(&URDF.replace(good, bad), "r.urdf").unwrap_err().to_string();
        assert!(error.contains(says), "{error}");
    }
}
