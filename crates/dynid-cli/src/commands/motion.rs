//! `dynid motion`.

use std::path::{Path, PathBuf};

use dynid::config::PerJoint;
use dynid::motions::{MotionConfig, MotionPaths, MotionRecord, PartConfig, SweepConfig, motion};
use dynid_terminal::message::{Failure, Notes, data};
use dynid_terminal::outputs;
use dynid_terminal::progress::Progress;

use super::{playback, table};
use crate::args::MotionArgs;

const DEFAULT_OUT: &str = "dynid-motion";

pub(crate) fn run(args: &MotionArgs) -> Result<u8, Failure> {
    let config = configuration(args)?;
    config.check()?;
    let out = config.out.clone().unwrap_or_else(|| PathBuf::from(DEFAULT_OUT));
    let names =
        ["trajectory.csv", "trajectory.ros2.yaml", "trajectory.ros2.json", "motion.json", "report.html"];
    let also = playback::files(&args.also, &out);
    let files: Vec<PathBuf> =
        names.iter().map(|name| out.join(name)).chain(also.iter().map(|(_, path)| path.clone())).collect();
    let inputs: [&Path; 2] = [&args.input, &config.robot];
    let set = outputs::prepare_folder(&files, &inputs, args.force)?;
    let progress = Progress::new(args.print.quiet);
    progress.doing("making the motion");
    let run = motion(&config)?;
    let report = run.report()?;
    drop(progress);

    let [samples, ros_yaml, ros_json] = [0, 1, 2].map(|number| set.staged(number).to_owned());
    run.write(&MotionPaths { samples, ros_yaml, ros_json })?;
    let text = serde_json::to_string_pretty(&run.record).map_err(|e| Failure::Output(e.into()))? + "\n";
    set.write(3, text.as_bytes())?;
    set.write(4, report.as_bytes())?;
    let all = playback::write(&also, (&set, names.len()), |format, file| run.playback(format, file))?;
    let written = set.publish()?;
    let notes = Notes::new(args.print.quiet);
    notes.warnings(&run.record.warnings);
    data(&if args.print.json { text } else { summary(&run.record) })?;
    notes.written(&written);
    Ok(u8::from(!all))
}

/// The motion file, or sweeps of a robot file, with flags over it.
fn configuration(args: &MotionArgs) -> Result<MotionConfig, Failure> {
    let mut config = match args.sweep.is_empty() {
        true => MotionConfig::read(&args.input).map_err(|error| match is_robot(&args.input) {
            true => Failure::Usage(
                format!("{}: expected a motion file, found a robot file", args.input.display()),
                "give `--sweep JOINT --speeds LIST`, or a file with `robot` and `[[part]]`",
            ),
            false => error.into(),
        })?,
        false => sweeps(args)?,
    };
    if args.out.is_some() {
        config.out.clone_from(&args.out);
    }
    config.sample_rate_hz = args.rate_hz.unwrap_or(config.sample_rate_hz);
    if let Some(acceleration) = args.acceleration {
        config.limits.acceleration = PerJoint::All(acceleration);
    }
    config.limits.share = args.share.unwrap_or(config.limits.share);
    config.slower |= args.slower;
    config.locked.extend(args.lock.iter().cloned());
    Ok(config)
}

fn is_robot(path: &Path) -> bool {
    path != Path::new("-") && dynid::io::robot::read(path).is_ok()
}

fn sweeps(args: &MotionArgs) -> Result<MotionConfig, Failure> {
    let range = match args.range[..] {
        [] => None,
        [least, largest] => Some([least, largest]),
        _ => {
            return Err(Failure::Usage(
                format!("--range: expected two positions, found {}", args.range.len()),
                "write the least and the largest, such as `--range -1,1.5`",
            ));
        }
    };
    let part = |joint: &String| {
        let sweep = SweepConfig {
            joint: joint.clone(),
            speeds: args.speeds.clone(),
            range,
            ..SweepConfig::default()
        };
        PartConfig { sweep: Some(sweep), ..PartConfig::default() }
    };
    let part = args.sweep.iter().map(part).collect();
    Ok(MotionConfig { robot: args.input.clone(), part, ..MotionConfig::default() })
}

/// Parts, limits that are used most, and the headline last.
fn summary(record: &MotionRecord) -> String {
    let rows: Vec<Vec<String>> = (record.parts.iter())
        .map(|part| {
            vec![
                part.number.to_string(),
                part.name.clone(),
                part.joint.clone().unwrap_or_else(|| "-".to_owned()),
                format!("{:.3}", part.from_s),
                format!("{:.3}", part.to_s),
                part.passes.len().to_string(),
            ]
        })
        .collect();
    let mut out = table::aligned(&["part", "what", "joint", "from, s", "to, s", "constant speeds"], &rows);
    let most = record.limits.iter().max_by(|a, b| a.used.total_cmp(&b.used));
    if let Some(most) = most {
        out += &format!(
            "\nused most: {} of {}, {:.1} % of its limit\n",
            most.quantity,
            most.joint,
            100.0 * most.used
        );
    }
    out + &format!("{}\n", record.headline)
}
