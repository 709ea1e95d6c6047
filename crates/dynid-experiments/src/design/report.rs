//! The report page of a design.

use dynid_config::pages::{picture, settings_table};
use dynid_excitation::constraint::{ConstraintKind, Region};
use dynid_excitation::{LimitKind, LimitPoint};
use dynid_identify::Error;
use dynid_model::{BodyPoint, Dynamics, EffortModel, MotionBlock, Vec3};
use dynid_motion::trajectory::{Phase, Sampled};
use dynid_report as report;
use dynid_report::Fact;

use super::config::{ColumnsName, CriterionName, DesignConfig};
use super::limits::regions;
use super::loops;
use super::record::NEAR_BEST;
use super::{DesignRecord, DesignRun, DesignedTrajectory};

/// A limit acts if it is used to this share.
const ACTS: f64 = 0.999;

impl DesignRun {
    /// The report as one HTML page.
    ///
    /// # Errors
    /// [`PageError`](dynid_config::fault::PageError), [`Error::UnknownLink`] for a frame that does not exist.
    pub fn report(&self, config: &DesignConfig, record: &DesignRecord) -> Result<String, Error> {
        dynid_config::fault::page(report::render_design(&self.report_data(config, record)?))
    }

    pub(super) fn report_data(
        &self,
        config: &DesignConfig,
        record: &DesignRecord,
    ) -> Result<report::DesignReport, Error> {
        let set = &self.set;
        let designed = self.outcome.as_ref().ok();
        let name = &self.robot.file.description.name;
        let mut warnings: Vec<report::Warning> = Vec::new();
        for warning in &record.verdict.warnings {
            warnings.push(report::Warning { message: warning.clone(), hint: String::new() });
        }
        let t = &record.trajectory;
        Ok(report::DesignReport {
            title: format!("Excitation for {name}"),
            verdict: report::Verdict {
                status: record.verdict.status.into(),
                headline: sentence(&record.verdict.headline),
                sentences: sentences(record),
                checks: Vec::new(),
            },
            warnings,
            robot: report::Robot {
                name: name.clone(),
                file: Some(record.robot.clone()),
                facts: vec![
                    Fact::new("moving joints", record.joints.len(), ""),
                    Fact::new("parameters to be made visible", set.problem.model.columns().len(), ""),
                ],
            },
            criterion: criterion_name(set.criterion).to_owned(),
            criterion_meaning: sentence(record.criterion.meaning),
            period_s: Some(t.period_s),
            harmonics: Some(t.harmonics as u64),
            periods_recorded: Some(t.periods as u64),
            approach_s: t.approach_s,
            return_s: t.return_s,
            sample_rate_hz: Some(t.sample_rate_hz),
            evaluations: Some(record.starts.iter().map(|s| s.evaluations as u64).sum()),
            seed: Some(config.search.seed),
            facts: facts(config, record),
            quality: report::DesignQuality {
                criterion_search: None,
                criterion_exact: record.criterion.value,
                sigma_largest: record.singular_values.map(|s| s[0]),
                sigma_smallest: record.singular_values.map(|s| s[1]),
                condition: record.condition_number,
                condition_unit_norm: record.condition_number_scaled,
            },
            random: record.random.as_ref().map(|r| report::RandomMotion {
                trajectories: Some(r.trajectories as u64),
                mean_ratio: Some(r.mean_ratio),
                geometric_ratio: Some(r.geometric_ratio),
                condition: Some(r.condition_number),
            }),
            intervals: Vec::new(),
            parameters: record
                .parameters
                .iter()
                .map(|p| report::DesignParameter {
                    name: p.name.clone(),
                    unit: p.unit.clone(),
                    nominal: p.nominal,
                    std: Some(p.std),
                    relative_std_percent: p.rel_std.map(|r| 100.0 * r),
                })
                .collect(),
            confounded: record
                .confounded
                .iter()
                .map(|p| report::ConfoundedPair { names: p.names.clone(), correlation: Some(p.correlation) })
                .collect(),
            seen_least: record
                .weakest
                .iter()
                .map(|s| report::ParameterShare { name: s.name.clone(), share: Some(s.share) })
                .collect(),
            limits: self.limit_uses(),
            joints: self.joints(),
            trajectory: designed.map(|d| self.trajectory(config, d)).transpose()?,
            picture: designed.map(|d| self.picture(d)).transpose()?.flatten(),
            obstacles: obstacles(config, record),
            starts: self.starts(config, record),
            provenance: report::Provenance {
                version: record.provenance.version.clone(),
                inputs: record
                    .provenance
                    .inputs
                    .iter()
                    .map(|i| report::InputFile {
                        path: i.path.clone(),
                        kind: i.kind.word().to_owned(),
                        sha256: Some(i.sha256.clone()),
                    })
                    .collect(),
                seed: Some(record.provenance.seed),
                settings: settings_table(&record.provenance.settings, &super::record::default_settings()),
            },
        })
    }

    fn joints(&self) -> Vec<report::DesignJoint> {
        let set = &self.set;
        set.model
            .joints()
            .iter()
            .zip(&set.problem.limits)
            .zip(&set.effort_limits)
            .map(|((joint, limits), effort)| report::DesignJoint {
                name: joint.name.clone(),
                unit: if joint.slides { "m" } else { "rad" }.to_owned(),
                effort_unit: if joint.slides { "N" } else { "N m" }.to_owned(),
                position_low: Some(limits.position.0),
                position_high: Some(limits.position.1),
                velocity: limits.of_derivative(1),
                acceleration: limits.of_derivative(2),
                jerk: limits.of_derivative(3),
                effort: *effort,
            })
            .collect()
    }

    fn limit_uses(&self) -> Vec<report::LimitUse> {
        let points: &[LimitPoint] = match &self.outcome {
            Ok(designed) => &designed.uses,
            Err(infeasible) => &infeasible.violations,
        };
        points
            .iter()
            .map(|p| {
                // Limits that are none of a size: what is left to them.
                let left = p.scale.filter(|_| p.kind != LimitKind::Path(ConstraintKind::Effort));
                report::LimitUse {
                    kind: p.kind.to_string(),
                    subject: p.subject.clone(),
                    use_percent: left.is_none().then_some(100.0 * (1.0 + p.excess)),
                    margin: left.map(|(scale, _)| -p.excess * scale),
                    margin_unit: left.map_or_else(String::new, |(_, unit)| unit.to_owned()),
                    at_s: Some(p.time),
                    acts: p.excess > ACTS - 1.0,
                }
            })
            .collect()
    }

    /// The robot on its way through the trajectory, with the path of the point farthest out.
    fn picture(&self, designed: &DesignedTrajectory) -> Result<Option<report::RobotPicture>, Error> {
        let sampled = designed.motion.sampled()?;
        let n = sampled.samples();
        let position: Vec<&[f64]> = sampled.q.chunks_exact(n.max(1)).collect();
        let caption = "The motion as it is commanded".to_owned();
        let poses = self.set.poses.as_deref();
        let drawn = picture(self.set.model.mechanism(), poses, &sampled.time, &position, caption);
        Ok(drawn.map(|drawn| report::RobotPicture {
            trail: drawn.points.iter().rposition(|kind| *kind != report::PointKind::Base),
            plays: true,
            ..drawn
        }))
    }

    fn trajectory(
        &self,
        config: &DesignConfig,
        designed: &DesignedTrajectory,
    ) -> Result<report::Trajectory, Error> {
        let sampled = designed.motion.sampled()?;
        let n = sampled.samples();
        let block = block(&sampled);
        let effort = self.set.nominal.as_ref().map(|nominal| {
            let mut effort = vec![0.0; self.set.model.outputs().len() * n];
            let shape = self.set.model.parameters().shape_start();
            self.set.model.efforts(&block, &shape, nominal, n, &mut effort);
            effort
        });
        let row = |signal: &[f64], k: usize| signal[k * n..(k + 1) * n].to_vec();
        let joints = (0..sampled.coordinates())
            .map(|k| report::JointMotion {
                q: row(&sampled.q, k),
                dq: row(&sampled.dq, k),
                ddq: row(&sampled.ddq, k),
                jerk: None,
                effort: effort.as_ref().map(|e| row(e, k)),
            })
            .collect();
        let frames = self.frames(config, &block)?;
        let span = designed.motion.sequence.span(Phase::Record);
        Ok(report::Trajectory {
            recorded_s: span.map(|s| [s.start, s.end]),
            joints,
            frames,
            time_s: sampled.time,
        })
    }

    /// Paths of the frames that are asked for, else of the last link of every branch.
    fn frames(
        &self,
        config: &DesignConfig,
        block: &MotionBlock<'_>,
    ) -> Result<Vec<report::FramePath>, Error> {
        let mechanism = self.set.model.mechanism();
        let bodies = mechanism.bodies();
        let names: Vec<String> = if config.trajectory.frames.is_empty() {
            let is_last = |b: &usize| bodies.iter().all(|other| other.parent != Some(*b));
            (0..bodies.len()).filter(is_last).map(|b| bodies[b].name.clone()).collect()
        } else {
            config.trajectory.frames.clone()
        };
        let points = names
            .iter()
            .map(|name| {
                let frame = mechanism.frame(name).map_err(|source| Error::Mechanism {
                    file: config.robot.display().to_string(),
                    source,
                })?;
                Ok(BodyPoint { body: frame.body, position: frame.placement.translation })
            })
            .collect::<Result<Vec<_>, Error>>()?;
        let n = block.samples;
        let mut positions = vec![0.0; 3 * points.len() * n];
        loops::with_all_joints(self.set.poses.as_ref(), block, |all| {
            Dynamics::new(mechanism).points(all, &points, n, &mut positions);
        });
        Ok(names
            .into_iter()
            .zip(positions.chunks_exact((3 * n).max(1)))
            .map(|(name, xyz)| report::FramePath {
                name,
                xyz_m: (0..n).map(|s| [xyz[s], xyz[n + s], xyz[2 * n + s]]).collect(),
            })
            .collect())
    }

    fn starts(&self, config: &DesignConfig, record: &DesignRecord) -> report::Starts {
        report::Starts {
            asked: Some(config.search.starts as u64),
            near_best: record.criterion.value.map(|best| (1.0 + NEAR_BEST) * best),
            outcomes: record
                .starts
                .iter()
                .map(|s| report::DesignStart { seed: s.seed, criterion: s.value, feasible: s.feasible })
                .collect(),
        }
    }
}

fn block(sampled: &Sampled) -> MotionBlock<'_> {
    MotionBlock::plain(sampled.samples(), &sampled.q, &sampled.dq, &sampled.ddq)
}

fn criterion_name(name: CriterionName) -> &'static str {
    match name {
        CriterionName::RelativeStd => "relative standard deviations",
        CriterionName::UnitCondition => "condition number, columns of unit length",
        CriterionName::Condition => "condition number",
        CriterionName::Mix => "condition number and smallest singular value",
        CriterionName::A => "mean variance (A-optimal)",
        CriterionName::D => "determinant of the information (D-optimal)",
        CriterionName::E => "smallest singular value (E-optimal)",
        CriterionName::Intervals => "wanted intervals",
    }
}

/// First letter in capitals, a full stop at the end.
pub(super) fn sentence(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| format!("{}{}.", first.to_uppercase(), letters.as_str()))
}

fn sentences(record: &DesignRecord) -> Vec<String> {
    let mut out = Vec::new();
    if let Some(random) = &record.random {
        out.push(format!(
            "The log is predicted to tell parameters {:.1} times more precisely than random motion within the same limits \
             (mean over parameters).",
            random.mean_ratio
        ));
    }
    if record.followed.is_some() {
        out.push(
            "The forecast is a simulation of the drives: it holds if they are as they are taken to be, and for errors of readings that are independent \
             from sample to sample (or after the stated correlation time); friction of another law, elasticity and backlash come on top."
                .to_owned(),
        );
    } else if record.infeasible.is_none() {
        out.push(
            "The forecast holds for noise that is independent from sample to sample (or after the stated correlation time) \
             and a model that fits; friction that the model does not hold, elasticity and delay come on top."
                .to_owned(),
        );
    }
    out
}

fn facts(config: &DesignConfig, record: &DesignRecord) -> Vec<Fact> {
    let t = &config.trajectory;
    let start = match (t.rest, t.zero_jerk) {
        (true, true) => "at rest, without jerk",
        (true, false) => "at rest",
        _ => "at speed",
    };
    let columns = match config.criterion.columns {
        _ if config.has_drives() => "those of the drives",
        ColumnsName::All => "all base parameters",
        ColumnsName::Inertial => "base parameters of the rigid bodies",
    };
    let (what, scale, unit) = match config.has_drives() {
        true => ("noise of the positions, standard deviation", 1e3, "mrad, mm"),
        false => ("noise of the effort, standard deviation", 1.0, "N m, N"),
    };
    let noise: Vec<String> =
        record.joints.iter().zip(&record.noise).map(|(j, s)| format!("{j} {:.3}", scale * s)).collect();
    let mut facts = vec![
        Fact::new("periods start and end", start, ""),
        Fact::new("parameters that count", columns, ""),
        Fact::new(what, noise.join(", "), unit),
        Fact::new("noise is independent after", config.criterion.correlation_time_s, "s"),
    ];
    if let Some(followed) = &record.followed {
        let each = |of: &dyn Fn(&super::FollowedJoint) -> String| {
            followed.joints.iter().map(|j| format!("{} {}", j.joint, of(j))).collect::<Vec<_>>().join(", ")
        };
        facts.push(Fact::new(
            "command less simulated reading, rms",
            each(&|j| format!("{:.1}", 1e3 * j.behind_rms)),
            "mrad, mm",
        ));
        facts.push(Fact::new("largest simulated speed", each(&|j| format!("{:.2}", j.speed)), "rad/s, m/s"));
        facts.push(Fact::new("largest simulated effort", each(&|j| format!("{:.2}", j.effort)), "N m, N"));
    }
    let pairs: Vec<String> = record.safety.pairs.iter().map(|[a, b]| format!("{a} and {b}")).collect();
    if !pairs.is_empty() {
        facts.push(Fact::new("links that are kept apart", pairs.join(", "), ""));
    }
    let distances = [
        ("least distance between them", record.least_distance_m),
        ("least distance from the floor or mounting plane", record.least_height_m),
    ];
    for (name, distance) in distances {
        facts.extend(distance.map(|x| Fact::new(name, format!("{:.1}", 1e3 * x), "mm")));
    }
    facts.push(Fact::new("not checked", record.safety.not_checked.join(", "), ""));
    if !config.earlier.is_empty() {
        facts.push(Fact::new("trajectories recorded as well", config.earlier.len(), ""));
    }
    facts
}

fn obstacles(config: &DesignConfig, record: &DesignRecord) -> Vec<report::Obstacle> {
    let plane = |p: &super::PlaneRecord| report::Obstacle {
        name: p.name.word().to_owned(),
        frames: p.links.clone(),
        shape: report::Shape::HalfSpace { normal: p.normal, offset_m: p.height_m },
    };
    let mut out: Vec<report::Obstacle> = record.safety.planes.iter().map(plane).collect();
    for (point, region) in regions(config) {
        let Some(shape) = shape(region) else { continue };
        match out.iter_mut().find(|o| o.shape == shape) {
            Some(obstacle) => obstacle.frames.push(point.frame),
            None => out.push(report::Obstacle { name: String::new(), frames: vec![point.frame], shape }),
        }
    }
    out
}

fn shape(region: Region) -> Option<report::Shape> {
    let plain = |v: Vec3<f64>| v.0;
    Some(match region {
        Region::HalfSpace { normal, offset } => {
            report::Shape::HalfSpace { normal: plain(normal), offset_m: offset }
        }
        Region::InsideBox { lower, upper } => {
            report::Shape::InsideBox { lower_m: plain(lower), upper_m: plain(upper) }
        }
        Region::OutsideCylinder { center, radius } => {
            report::Shape::OutsideCylinder { center_m: center, radius_m: radius }
        }
        Region::OutsideOrAboveColumn { center, radius, height } => {
            report::Shape::OutsideOrAboveColumn { center_m: center, radius_m: radius, height_m: height }
        }
        _ => return None,
    })
}
