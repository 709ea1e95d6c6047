//! `dynid regressor`.

use dynid::io::{ReadOptions, states};
use dynid::model::{BaseParameters, BaseSettings, EffortModel};
use dynid::predict::{efforts, regressors};
use dynid_terminal::message::{Failure, data, json};
use dynid_terminal::progress::Progress;
use serde::Serialize;

use super::load_robot;
use super::predict::csv_text;
use crate::args::RegressorArgs;

#[derive(Serialize)]
struct Output {
    joints: Vec<String>,
    columns: Vec<String>,
    effort: Vec<Vec<f64>>,
    regressor: Vec<Vec<Vec<f64>>>,
}

pub(crate) fn run(args: &RegressorArgs) -> Result<u8, Failure> {
    let robot = load_robot(&args.robot)?;
    let options = ReadOptions { rows: args.rows, ..ReadOptions::default() };
    let states = states::read(&args.states, &robot.state_joints(), &options)?;
    let model = robot.skeleton()?;
    let values = robot.skeleton_values(&model);
    let progress = Progress::new(args.quiet);
    progress.doing("computing efforts");
    let effort = efforts(&model, &values, &states)?;
    let joints: Vec<String> = model.outputs().iter().map(|o| o.name.clone()).collect();
    if !args.json {
        drop(progress);
        data(&csv_text(&joints, &effort)?)?;
        return Ok(0);
    }
    let base = args.base.then(|| {
        BaseParameters::of_model(&model, &model.parameters().shape_start(), &BaseSettings::default())
    });
    let table = &model.parameters().linear;
    let columns = match &base {
        None => table.iter().map(|p| p.name.clone()).collect(),
        Some(base) => base.kept.iter().map(|c| table[*c].name.clone()).collect(),
    };
    let output = Output {
        columns,
        effort: (0..states.rows).map(|s| effort.iter().map(|e| e[s]).collect()).collect(),
        regressor: regressors(&model, base.as_ref(), &states)?,
        joints,
    };
    drop(progress);
    json(&output)?;
    Ok(0)
}
