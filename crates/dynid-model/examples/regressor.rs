//! Effort and regressor of a two-joint arm at a state, and which combinations of its parameters any log can show.
//!
//! `cargo run --release -p dynid-model --example regressor`
#![expect(clippy::print_stdout, reason = "the result of a program")]

use dynid_model::element::{Coulomb, JointElement, Viscous};
use dynid_model::{
    BaseParameters, BaseSettings, Description, EffortModel, Inertia, JointDescription, JointKind, Limits,
    LinkDescription, MotionBlock, Placement, RegressorBlock, TreeModel,
};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arm = Description::new("two joints");
    arm.links.push(LinkDescription { name: "ground".to_owned(), inertia: None });
    for (child, parent, x) in [("upper", "ground", 0.0), ("fore", "upper", 0.4)] {
        // 2 kg at 0.2 m along x, and a tensor about the joint.
        let phi = Inertia([2.0, 0.4, 0.0, 0.0, 0.002, 0.0, 0.0, 0.1, 0.0, 0.1]);
        arm.links.push(LinkDescription { name: child.to_owned(), inertia: Some(phi) });
        arm.joints.push(JointDescription {
            name: format!("to_{child}"),
            parent: parent.to_owned(),
            child: child.to_owned(),
            kind: JointKind::Revolute,
            placement: Placement::from_xyz_rpy([x, 0.0, 0.0], [0.0; 3]),
            axis: [0.0, 1.0, 0.0],
            limits: Limits::default(),
            mimic: None,
        });
    }
    let friction =
        |rate| -> [Box<dyn JointElement>; 2] { [Box::new(Coulomb { rate }), Box::new(Viscous { rate })] };
    let model = TreeModel::new(arm.build()?, [friction(0), friction(1)].into_iter().flatten().collect());
    let table = model.parameters();

    // One state; a block may hold any number, joint after joint.
    let (q, dq, ddq) = ([0.3, -0.8], [1.2, 0.5], [0.0, 2.0]);
    let mut rows = RegressorBlock::new(model.layout().clone(), 1);
    model.regressor(&MotionBlock::plain(1, &q, &dq, &ddq), &[], &mut rows);
    let values: Vec<f64> = table.linear.iter().map(|p| p.prior.unwrap_or(0.5)).collect();
    for (output, joint) in model.outputs().iter().enumerate() {
        println!("{}: {:.4} {}", joint.name, rows.effort(output, &values)[0], joint.unit);
    }

    let base = BaseParameters::of_model(&model, &[], &BaseSettings::default());
    println!("{} of {} parameters act apart:", base.len(), table.linear.len());
    for expression in base.expressions(table) {
        println!("  {expression}");
    }
    Ok(())
}
