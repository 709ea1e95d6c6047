//! `dynid design`.

use std::path::{Path, PathBuf};

use dynid::config::PerJoint;
use dynid::design::{
    ColumnsName, CriterionName, DesignConfig, DesignRecord, DesignedMotion, MotionPaths, design,
};
use dynid::io::trajectory::Playback;
use dynid::record::Outcome;
use dynid_terminal::message::{Failure, Notes, data};
use dynid_terminal::outputs::{self, Outputs};
use dynid_terminal::progress::Progress;

use super::{element_names, playback, table};
use crate::args::{ColumnsArg, CriterionArg, DesignArgs, DesignedArgs, ForceArgs};

const DEFAULT_OUT: &str = "dynid-design";

pub(crate) fn run(args: &DesignArgs) -> Result<u8, Failure> {
    let config = configuration(args)?;
    config.check()?;
    let out = config.out.clone().unwrap_or_else(|| PathBuf::from(DEFAULT_OUT));
    let mut files = MotionFiles::new(&out, "design.json", &args.designed);
    if config.has_drives() {
        files.all.push(out.join("commands.csv"));
    }
    let earlier = config.earlier.iter().chain(&config.drives).map(PathBuf::as_path);
    let inputs: Vec<&Path> = earlier.chain([args.input.as_path(), &config.robot]).collect();
    if let Some(checkpoint) = &config.search.checkpoint {
        let results = files.all.iter().map(|file| ("--out", file.as_path()));
        outputs::check(
            &results.chain([("--checkpoint", checkpoint.as_path())]).collect::<Vec<_>>(),
            &inputs,
        )?;
        drop(outputs::prepare_files(&[("--checkpoint", checkpoint)], &[], ForceArgs { force: true })?);
        if std::path::absolute(checkpoint).ok() == std::path::absolute(&out).ok() {
            let text = format!("--checkpoint: {} is the output folder", checkpoint.display());
            return Err(Failure::Usage(text, "give the checkpoint a file of its own"));
        }
    }
    let DesignedArgs { force, print, .. } = &args.designed;
    let set = outputs::prepare_folder(&files.all, &inputs, *force)?;
    let progress = Progress::new(print.quiet);
    let run = design(&config, &mut |step| progress.design(step))?;
    let record = run.record(&config)?;
    let report = run.report(&config, &record)?;
    drop(progress);

    let motion = run.outcome.as_ref().ok().map(|designed| &designed.motion);
    let text = serde_json::to_string_pretty(&record).map_err(|e| Failure::Output(e.into()))? + "\n";
    let all = files.write(&set, motion, &text, &report)?;
    if config.has_drives() {
        run.write_commands(set.staged(files.all.len() - 1))?;
    }
    let written = set.publish()?;
    let notes = Notes::new(print.quiet);
    notes.warnings(&record.verdict.warnings);
    data(&if print.json { text } else { summary(&record) })?;
    notes.written(&written);
    Ok(u8::from(record.verdict.status == Outcome::Fail || !all))
}

/// Files of a designed motion, its record and its page among them.
pub(super) struct MotionFiles {
    /// All of them; the first are those of the motion, record and page.
    pub(super) all: Vec<PathBuf>,
    also: Vec<(Playback, PathBuf)>,
}

/// Files beside those for what plays a motion.
const OWN_FILES: usize = 6;

impl MotionFiles {
    pub(super) fn new(out: &Path, record: &str, args: &DesignedArgs) -> Self {
        let own: [&str; OWN_FILES] = [
            "trajectory.json",
            "trajectory.csv",
            "trajectory.ros2.yaml",
            "trajectory.ros2.json",
            record,
            "report.html",
        ];
        let also = playback::files(&args.also, out);
        let own = own.iter().map(|name| out.join(name));
        MotionFiles { all: own.chain(also.iter().map(|(_, path)| path.clone())).collect(), also }
    }

    /// Writes them; gives whether the motion was written for all that play it.
    pub(super) fn write(
        &self,
        set: &Outputs,
        motion: Option<&DesignedMotion>,
        record: &str,
        report: &str,
    ) -> Result<bool, Failure> {
        let mut all = true;
        if let Some(motion) = motion {
            all =
                playback::write(&self.also, (set, OWN_FILES), |format, file| motion.playback(format, file))?;
            let staged = |number: usize| set.staged(number).to_owned();
            let [coefficients, samples, ros_yaml, ros_json] = [0, 1, 2, 3].map(staged);
            motion.write(&MotionPaths { coefficients, samples, ros_yaml, ros_json })?;
        }
        set.write(4, record.as_bytes())?;
        set.write(5, report.as_bytes())?;
        Ok(all)
    }
}

/// The configuration file, or one made of a robot file, with flags over it.
fn configuration(args: &DesignArgs) -> Result<DesignConfig, Failure> {
    let mut config = designed(&args.input, &args.designed)?;
    if args.out.is_some() {
        config.out.clone_from(&args.out);
    }
    let t = &mut config.trajectory;
    t.period_s = args.period.or(t.period_s);
    t.periods = args.periods.unwrap_or(t.periods);
    match args.criterion {
        Some(CriterionArg::RelativeStd) => config.criterion.name = Some(CriterionName::RelativeStd),
        Some(CriterionArg::UnitCondition) => config.criterion.name = Some(CriterionName::UnitCondition),
        Some(CriterionArg::Condition) => config.criterion.name = Some(CriterionName::Condition),
        Some(CriterionArg::Mix) => config.criterion.name = Some(CriterionName::Mix),
        Some(CriterionArg::A) => config.criterion.name = Some(CriterionName::A),
        Some(CriterionArg::D) => config.criterion.name = Some(CriterionName::D),
        Some(CriterionArg::E) => config.criterion.name = Some(CriterionName::E),
        None => {}
    }
    match args.columns {
        Some(ColumnsArg::All) => config.criterion.columns = ColumnsName::All,
        Some(ColumnsArg::Inertial) => config.criterion.columns = ColumnsName::Inertial,
        None => {}
    }
    if let Some(noise) = args.noise {
        config.criterion.noise = PerJoint::All(noise);
    }
    config.earlier.extend(args.earlier.iter().cloned());
    if args.drives.is_some() {
        config.drives.clone_from(&args.drives);
    }
    if args.elements.is_some() {
        config.elements.default = element_names(args.elements.as_deref());
    }
    config.search.time_budget_s = args.time_budget.or(config.search.time_budget_s);
    if args.checkpoint.is_some() {
        config.search.checkpoint.clone_from(&args.checkpoint);
    }
    Ok(config)
}

/// The configuration of a designed motion from its file, or from a robot file, with flags over it.
pub(super) fn designed(input: &Path, args: &DesignedArgs) -> Result<DesignConfig, Failure> {
    let is_xml = input.extension().is_some_and(|e| e == "sdf" || e == "urdf" || e == "xml");
    let robot = || DesignConfig { robot: input.to_owned(), ..DesignConfig::default() };
    let mut config = if is_xml {
        robot()
    } else {
        match DesignConfig::read(input) {
            Ok(config) => config,
            Err(error) => match dynid::io::robot::read(input) {
                Ok(_) => robot(),
                Err(fault) if is_robot(input) => return Err(fault.into()),
                Err(_) => return Err(error.into()),
            },
        }
    };
    let t = &mut config.trajectory;
    t.harmonics = args.harmonics.or(t.harmonics);
    t.sample_rate_hz = args.rate_hz.or(t.sample_rate_hz);
    t.rest &= !args.no_rest;
    if args.park && t.parking.is_none() {
        t.parking = Some(std::collections::BTreeMap::new());
    }
    if let Some(acceleration) = args.acceleration {
        config.limits.acceleration = PerJoint::All(acceleration);
    }
    config.limits.share = args.share.unwrap_or(config.limits.share);
    config.locked.extend(args.lock.iter().cloned());
    let safety = &mut config.safety;
    safety.floor &= !args.no_floor;
    safety.floor_height_m = args.floor_height.or(safety.floor_height_m);
    safety.self_collision &= !args.no_self_collision;
    safety.margin_m = args.margin.unwrap_or(safety.margin_m);
    config.package_dirs.extend(args.package_dir.iter().cloned());
    config.search.starts = args.starts.unwrap_or(config.search.starts);
    config.search.seed = args.seed.unwrap_or(config.search.seed);
    Ok(config)
}

/// Whether a TOML file, sound or not, means to be a robot: no configuration of a design has such a table.
fn is_robot(path: &Path) -> bool {
    let table = |line: &str| matches!(line.trim(), "[[joint]]" | "[[body]]");
    dynid::io::input::read_text(path).is_ok_and(|text| text.lines().any(table))
}

/// Parameters that the summary shows, worst first.
const SHOWN: usize = 8;

/// What the design promises, and the verdict last.
fn summary(record: &DesignRecord) -> String {
    let mut out: Vec<String> = Vec::new();
    if let Some(value) = record.criterion.value {
        out.push(format!("{}: {}", record.criterion.meaning, table::number(Some(value))));
        out.push(format!(
            "condition number: {} raw, {} with columns of unit length",
            table::number(record.condition_number),
            table::number(record.condition_number_scaled)
        ));
    }
    if let Some(random) = &record.random {
        out.push(format!(
            "standard deviations are {} times smaller than on random motion within the same limits (mean; geometric {})",
            table::number(Some(random.mean_ratio)),
            table::number(Some(random.geometric_ratio))
        ));
    }
    let mut worst: Vec<_> = record.parameters.iter().filter(|p| p.rel_std.is_some()).collect();
    worst.sort_by(|a, b| b.rel_std.unwrap_or(0.0).total_cmp(&a.rel_std.unwrap_or(0.0)));
    if !worst.is_empty() {
        out.push("\nparameters that the log will tell least about:".to_owned());
        let rows: Vec<Vec<String>> = worst
            .iter()
            .take(SHOWN)
            .map(|p| {
                vec![
                    p.name.clone(),
                    table::number(p.nominal),
                    table::number(Some(p.std)),
                    p.unit.clone(),
                    table::number(p.rel_std.map(|r| 100.0 * r)),
                ]
            })
            .collect();
        let header = ["parameter", "nominal", "std", "unit", "std, %"];
        out.push(table::aligned(&header, &rows).trim_end().to_owned());
    }
    // Of drives the warnings name groups.
    for pair in record.confounded.iter().filter(|_| record.followed.is_none()) {
        out.push(format!(
            "hardly told apart: {} and {} (correlation {:.3})",
            pair.names[0], pair.names[1], pair.correlation
        ));
    }
    let acting = record.limits.iter().filter(|l| l.excess > -1e-3).count();
    if record.infeasible.is_none() {
        out.push(format!("\n{acting} of {} limits act (used to 99.9 % or more)", record.limits.len()));
    }
    if let Some(infeasible) = record.infeasible.as_ref().filter(|i| !i.violations.is_empty()) {
        out.push("\nlimits that stay broken:".to_owned());
        for v in &infeasible.violations {
            out.push(format!("  {} of {} at {:.2} s", v.kind, v.subject, v.time_s));
        }
    }
    for (what, figure) in [
        ("least distance between links that are kept apart", record.least_distance_m),
        ("least distance of links from the floor or mounting plane", record.least_height_m),
    ] {
        out.extend(figure.map(|x| format!("{what}: {:.1} mm", 1e3 * x)));
    }
    out.push(format!("\n{}\n", verdict(record)));
    out.join("\n")
}

fn verdict(record: &DesignRecord) -> String {
    format!("{}: {}", record.verdict.status, record.verdict.headline)
}
