//! A humanoid-like tree: a trunk of two joints, five limbs of six.

use dynid_model::{
    Description, Inertia, JointDescription, JointKind, Limits, LinkDescription, Mat3, Placement, Vec3,
};

/// 32 revolute joints about coordinate axes, with general placements and inertias.
pub(crate) fn of_32_joints() -> Description {
    let mut description = Description::new("tree32");
    description.links.push(LinkDescription { name: "l0".into(), inertia: None });
    for k in 1..=32_usize {
        let parent = if k > 2 && (k - 3) % 6 == 0 { 2 } else { k - 1 };
        let size = 0.1 + 0.01 * k as f64;
        let tensor = Mat3::from_rows([[0.03, 0.001, 0.002], [0.001, 0.04, 0.003], [0.002, 0.003, 0.05]]);
        description.links.push(LinkDescription {
            name: format!("l{k}"),
            inertia: Some(Inertia::from_com(3.0 + size, Vec3([0.03, -0.02, size]), &tensor)),
        });
        description.joints.push(JointDescription {
            name: format!("j{k}"),
            parent: format!("l{parent}"),
            child: format!("l{k}"),
            kind: JointKind::Revolute,
            placement: Placement::from_xyz_rpy(
                [0.1, 0.02 * k as f64, 0.3],
                [[0.0, 1.57, -1.57][k % 3], 0.3, 0.1],
            ),
            axis: [[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]][k % 3],
            limits: Limits { position: Some((-3.0, 3.0)), velocity: Some(2.0), effort: Some(100.0) },
            mimic: None,
        });
    }
    description
}
