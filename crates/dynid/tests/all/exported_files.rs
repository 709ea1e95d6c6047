//! The file that leaves against the model that was judged.

use crate::support::{UR10E, data, run};
use dynid::agreement::{Alignment, compare};
use dynid::export::{CheckStates, RobotExport, Source};
use dynid::io::mjcf;
use dynid::model::element::{Coulomb, JointElement, RotorInertia, Viscous};
use dynid::model::{EffortModel, RobotModel};

/// The MJCF of the UR10e, whose friction takes tanh and load shapes, predicts a log that nobody fitted as its record says, and nearly as well
/// as the model: by its text alone, without what the exporter knows.
#[test]
fn the_file_that_leaves_is_judged_beside_the_model() {
    let Some((config, id)) = run(UR10E) else { return };
    let estimate = id.estimate();
    let record = estimate.exported.judged().unwrap();
    let source = Source::read(&data().unwrap().join("ur10e-innopolis/ur10e.urdf")).unwrap();
    let states = CheckStates::random(&id.model);
    let export =
        RobotExport::new(id.identified(), &source).unwrap().with_projections(&estimate.exported.projections);
    let text = export.mjcf(&states).unwrap().text;

    let read = mjcf::parse(&text, "mjcf").unwrap();
    let mechanism = read.description.build().unwrap();
    let mut values = mechanism.inertia_vector();
    let mut elements: Vec<Box<dyn JointElement>> = Vec::new();
    for p in &read.joints {
        let rate = mechanism.rate_names().iter().position(|n| *n == p.joint).unwrap();
        elements.push(Box::new(Viscous { rate }));
        elements.push(Box::new(Coulomb { rate }));
        elements.push(Box::new(RotorInertia { rate }));
        values.extend([p.damping, p.friction_loss, p.armature]);
    }
    let file = RobotModel::new(mechanism, elements);
    let validation = &config.validation[0];
    let log =
        dynid::logs::load(validation, &id.robot.axes, &config.columns, config.motor_side.as_ref()).unwrap();
    let own = log.prepare(&id.model, &id.conditioning_settings).unwrap();
    // The bodies of the file come in another order.
    let log = log.prepare(&file, &id.conditioning_settings).unwrap();
    let alignment = Alignment {
        state_hz: id.state_hz,
        delay_samples: id.delay_samples,
        delay_rate_hz: id.delay_rate_hz,
        filter_hz: id.kernel_hz,
    };
    let found = compare(&file, &values, &log, &alignment, &id.conditioning_settings).unwrap();
    let model = id.agreement(id.values(), &own).unwrap();
    let [file_error, model_error] = [&found, &model].map(|a| a.filtered.relative_error.unwrap());
    println!(
        "model {model_error:.3} %, MJCF {file_error:.3} %, URDF {:.3} %",
        record.urdf.relative_error.unwrap()
    );
    assert!((file_error / record.mjcf.relative_error.unwrap() - 1.0).abs() < 1e-6);
    assert!(file_error <= 4.0 && model_error < 2.5, "{file_error} {model_error}");
    // A URDF without its rotors loses more, and says so.
    assert!(record.urdf.relative_error.unwrap() > 1.1 * file_error);
    let outputs = id.model.outputs();
    for (output, joint) in file.outputs().iter().zip(&found.filtered.channels) {
        let k = outputs.iter().position(|o| o.name == output.name).unwrap();
        assert!((joint.rms.unwrap() / record.mjcf.rms[k].unwrap() - 1.0).abs() < 1e-6);
    }
}
