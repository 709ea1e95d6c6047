//! Floor and own links of designs: kept without being asked for, checked by other means, turned off when told.

#![expect(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "helpers of tests outside of test functions; what was found is said"
)]

use std::path::{Path, PathBuf};

use dynid::design::{
    CapsuleSource, DesignConfig, DesignRecord, DesignRun, HalfSpaceConfig, KeepConfig, design,
};
use dynid::model::{Dynamics, Placement, Vec3};
use dynid::{Robot, RobotOptions};
use dynid_testing::shared;

const INSTANTS: usize = 10_000;

fn robots() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../robots")
}

/// A quick design of a robot file.
fn quick(robot: &Path) -> DesignConfig {
    let mut config = DesignConfig { robot: robot.to_owned(), ..DesignConfig::default() };
    config.search.starts = 1;
    config.trajectory.sample_rate_hz = Some(50.0);
    config
}

fn run(config: &DesignConfig) -> (DesignRun, DesignRecord) {
    let run = design(config, &mut |_| {}).unwrap();
    let record = run.record(config).unwrap();
    (run, record)
}

/// Position of every joint at a time, from the coefficients `[q0, a.., b..]`.
fn positions(record: &DesignRecord, time: f64) -> Vec<f64> {
    let t = &record.trajectory;
    let omega = std::f64::consts::TAU / t.period_s;
    let joint = |x: &Vec<f64>| {
        let terms = (1..=t.harmonics).map(|k| {
            let (s, c) = (omega * time * k as f64).sin_cos();
            x[k] * s + x[t.harmonics + k] * c
        });
        x[0] + terms.sum::<f64>()
    };
    t.coefficients.iter().map(joint).collect()
}

/// Distance of two segments by looking at ever smaller parts of both: the squared distance is convex in the two shares.
fn distance(a: [Vec3<f64>; 2], b: [Vec3<f64>; 2]) -> f64 {
    const SIDE: usize = 8;
    let at = |e: &[Vec3<f64>; 2], share: f64| (e[1] - e[0]).scale_add(share, e[0]);
    let (mut middle, mut half) = ([0.5, 0.5], 0.5);
    let mut least = f64::INFINITY;
    for _ in 0..12 {
        let around = |m: f64, k: usize| (m + half * (2.0 * k as f64 / SIDE as f64 - 1.0)).clamp(0.0, 1.0);
        let center = middle;
        for (i, j) in (0..=SIDE).flat_map(|i| (0..=SIDE).map(move |j| (i, j))) {
            let shares = [around(center[0], i), around(center[1], j)];
            let found = (at(&a, shares[0]) - at(&b, shares[1])).norm();
            if found < least {
                (least, middle) = (found, shares);
            }
        }
        half *= 0.4;
    }
    least
}

/// Least distance between the links that a design keeps apart, and least height of those that it keeps above its first plane.
fn measured(record: &DesignRecord, robot: &Path) -> (f64, f64) {
    let robot = Robot::load(robot, &RobotOptions::default()).unwrap();
    let mechanism = &robot.mechanism;
    let dynamics = Dynamics::new(mechanism);
    let mut work = dynamics.workspace();
    let capsules = &record.safety.capsules;
    let frames: Vec<_> = capsules.iter().map(|c| mechanism.frame(&c.link).unwrap()).collect();
    let on = |placement: &Placement, x: Vec3<f64>| placement.rotation.mul_vec(x) + placement.translation;
    let is_kept = |a: &str, b: &str| {
        let pairs = &record.safety.pairs;
        pairs.iter().any(|p| (p[0] == a && p[1] == b) || (p[0] == b && p[1] == a))
    };
    let is_near =
        |a: &str, b: &str| record.safety.exempt.iter().any(|e| e.links == [a, b] || e.links == [b, a]);
    let (mut nearest, mut lowest) = (f64::INFINITY, f64::INFINITY);
    for s in 0..INSTANTS {
        let q = positions(record, record.trajectory.period_s * s as f64 / INSTANTS as f64);
        let bodies = dynamics.forward_kinematics(&q, &mut work);
        let ends = |k: usize| {
            let of = |x: [f64; 3]| {
                let local = on(&frames[k].placement, Vec3(x));
                frames[k].body.map_or(local, |b| on(&bodies[b], local))
            };
            [of(capsules[k].from_m), of(capsules[k].to_m)]
        };
        let placed: Vec<[Vec3<f64>; 2]> = (0..capsules.len()).map(ends).collect();
        for a in 0..capsules.len() {
            for b in a + 1..capsules.len() {
                let (first, second) = (&capsules[a], &capsules[b]);
                if is_kept(&first.link, &second.link) && !is_near(&first.link, &second.link) {
                    let gap = distance(placed[a], placed[b]) - first.radius_m - second.radius_m;
                    nearest = nearest.min(gap);
                }
            }
            let Some(plane) = record.safety.planes.first() else { continue };
            let link = &capsules[a].link;
            if plane.links.contains(link) && !plane.always_low.contains(link) {
                let height =
                    |x: &Vec3<f64>| Vec3(plane.normal).dot(*x) - plane.height_m - capsules[a].radius_m;
                lowest = placed[a].iter().map(height).fold(lowest, f64::min);
            }
        }
    }
    (nearest, lowest)
}

/// Holds a design to its margin by other means.
#[track_caller]
fn check(config: &DesignConfig) -> DesignRecord {
    let (_, record) = run(config);
    assert_eq!(record.verdict.status.word(), "pass", "{}", record.verdict.headline);
    let (nearest, lowest) = measured(&record, &config.robot);
    let margin = config.safety.margin_m;
    println!(
        "{}: {} pairs, {} exempt; nearest {:.2} mm, lowest {:.2} mm",
        config.robot.display(),
        record.safety.pairs.len(),
        record.safety.exempt.len(),
        1e3 * nearest,
        1e3 * lowest
    );
    assert!(nearest >= margin - 1e-6 && lowest >= margin - 1e-6, "{nearest} {lowest}");
    // The record's own figures are taken on fewer instants.
    if nearest.is_finite() {
        let own = record.least_distance_m.unwrap();
        assert!(own >= margin - 1e-6 && own <= nearest + 5e-3, "{own} {nearest}");
    }
    record
}

#[test]
fn the_indy7_keeps_its_links_apart_and_above_the_floor() {
    let record = check(&quick(&robots().join("indy7.toml")));
    let headline = &record.verdict.headline;
    for part in ["all limits hold at every instant", "floor (20 mm)", "own links (", "not checked: ", "tools"]
    {
        assert!(headline.contains(part), "{headline}");
    }
    assert!(record.safety.capsules.iter().all(|c| c.source == CapsuleSource::Chain));
    assert_eq!(record.safety.planes[0].normal, [0.0, 0.0, 1.0]);
}

#[test]
#[ignore = "ten seconds; the ordinary run takes the Indy7"]
fn robots_of_public_files_keep_their_links_apart_and_above_the_floor() {
    for file in ["data/ur10e-innopolis/ur10e.urdf", "data/oracles/iiwa14.urdf"] {
        let Some(path) = shared(file) else { return };
        check(&quick(&path));
    }
}

#[test]
fn what_is_turned_off_is_not_kept_and_said() {
    let mut config = quick(&robots().join("indy7.toml"));
    config.safety.floor = false;
    config.safety.self_collision = false;
    let (_, record) = run(&config);
    assert!(
        record
            .verdict
            .headline
            .contains("not checked: the floor (turned off), own links against each other (turned off)")
    );
    assert!(record.safety.planes.is_empty() && record.safety.pairs.is_empty());
    assert!(
        record.limits.iter().all(|l| l.kind != "height above the floor" && l.kind != "distance of own links")
    );
    // Nothing else holds the arm above the floor.
    config.safety.floor = true;
    let (_, floor) = run(&config);
    let (_, lowest) = measured(&floor, &config.robot);
    assert!(lowest >= config.safety.margin_m - 1e-6);
    let with_plane = DesignRecord { safety: floor.safety, ..record };
    let (_, lowest) = measured(&with_plane, &config.robot);
    assert!(lowest < 0.0, "{lowest}");
}

#[test]
fn exempt_pairs_and_other_margins_take_effect() {
    let mut config = quick(&robots().join("indy7.toml"));
    config.safety.margin_m = 0.05;
    let record = check(&config);
    let pair = record.safety.pairs[0].clone();
    config.safety.exempt = vec![pair.clone()];
    let (_, without) = run(&config);
    assert!(!without.safety.pairs.contains(&pair));
    assert!(without.safety.exempt.iter().any(|e| e.links == pair && e.reason == "the configuration says so"));
    config.safety.exempt = vec![["link1".to_owned(), "link2".to_owned()]];
    let error = design(&config, &mut |_| {}).err().unwrap().to_string();
    assert!(error.contains("safety.exempt") && error.contains("link1 and link2"), "{error}");
}

#[test]
fn a_start_pose_below_the_floor_is_named_with_what_to_write() {
    let mut config = quick(&robots().join("indy7.toml"));
    config.trajectory.start_pose = (1..=6).map(|k| (format!("j{k}"), 0.0)).collect();
    config.trajectory.start_pose.insert("j2".to_owned(), 1.7);
    config.trajectory.start_pose.insert("j3".to_owned(), 0.6);
    let (run, record) = run(&config);
    assert!(run.outcome.is_err());
    let headline = &record.verdict.headline;
    for part in
        ["the start pose itself is not allowed", "height above the floor", "start_pose", "floor_height_m"]
    {
        assert!(headline.contains(part), "{headline}");
    }
}

/// The plane of a robot that hangs: what it is mounted on, not one above which it could not be.
#[test]
fn a_robot_under_the_ceiling_stays_below_it() {
    let mut config = quick(&robots().join("indy7.toml"));
    config.gravity = Some([0.0, 0.0, 9.81]);
    let (_, record) = run(&config);
    let plane = &record.safety.planes[0];
    assert_eq!((plane.name.word(), plane.normal), ("mounting plane", [0.0, 0.0, 1.0]));
    let headline = &record.verdict.headline;
    assert!(headline.contains("mounting plane (20 mm)"), "{headline}");
    assert!(headline.contains("not checked: ") && headline.contains("not upright"), "{headline}");
    config.safety.floor_height_m = Some(-1.2);
    let (_, record) = run(&config);
    assert_eq!(record.safety.planes[0].name.word(), "floor");
    assert_eq!(record.safety.planes[0].normal, [0.0, 0.0, -1.0]);
    config.gravity = Some([9.81, 0.0, 0.0]);
    config.safety.floor_height_m = None;
    let (_, record) = run(&config);
    assert_eq!((record.safety.planes.len(), record.safety.planes[0].name.word()), (1, "mounting plane"));
    config.gravity = Some([0.0; 3]);
    let (_, record) = run(&config);
    assert!(record.safety.planes.is_empty());
    assert!(record.verdict.headline.contains("gravity is zero"), "{}", record.verdict.headline);
}

/// An arm of three links whose shapes are a box, a cylinder and a mesh.
const ARM: &str = r#"<robot name="arm">
<link name="base"><collision><origin xyz="0 0 0.05"/><geometry><box size="0.2 0.2 0.1"/></geometry></collision></link>
<link name="upper"><inertial><origin xyz="0 0 0.2"/><mass value="3"/><inertia ixx="0.05" iyy="0.05" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial>
<collision><origin xyz="0 0 0.2"/><geometry><cylinder radius="0.05" length="0.4"/></geometry></collision></link>
<link name="lower"><inertial><origin xyz="0 0 0.2"/><mass value="2"/><inertia ixx="0.03" iyy="0.03" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial>
<collision><geometry><mesh filename="package://arm_description/lower.stl" scale="0.001 0.001 0.001"/></geometry></collision></link>
<joint name="j1" type="revolute"><parent link="base"/><child link="upper"/><origin xyz="0 0 0.2"/><axis xyz="0 1 0"/><limit lower="-2.5" upper="2.5" velocity="2" effort="100"/></joint>
<joint name="j2" type="revolute"><parent link="upper"/><child link="lower"/><origin xyz="0 0 0.4"/><axis xyz="0 1 0"/><limit lower="-2.8" upper="2.8" velocity="2" effort="100"/></joint>
</robot>"#;

/// A slab of 80 x 60 x 450 mm, in millimetres.
fn slab() -> Vec<u8> {
    let corner = |k: usize| {
        [(k & 1, 40.0_f32), (k >> 1 & 1, 30.0)]
            .map(|(side, half)| if side == 1 { half } else { -half })
            .into_iter()
            .chain([if k >> 2 == 1 { 450.0 } else { 0.0 }])
            .collect::<Vec<f32>>()
    };
    let faces = [
        [0, 1, 2],
        [1, 2, 3],
        [4, 5, 6],
        [5, 6, 7],
        [0, 1, 4],
        [1, 4, 5],
        [2, 3, 6],
        [3, 6, 7],
        [0, 2, 4],
        [2, 4, 6],
        [1, 3, 5],
        [3, 5, 7],
    ];
    let mut bytes = vec![0_u8; 80];
    bytes.extend(12_u32.to_le_bytes());
    for face in faces {
        bytes.extend([0_u8; 12]);
        bytes.extend(face.iter().flat_map(|k| corner(*k)).flat_map(f32::to_le_bytes));
        bytes.extend([0_u8; 2]);
    }
    bytes
}

fn arm(folder: &Path, mesh: Option<&[u8]>) -> PathBuf {
    let package = folder.join("packages/arm_description");
    std::fs::create_dir_all(&package).unwrap();
    std::fs::write(folder.join("arm.urdf"), ARM).unwrap();
    if let Some(bytes) = mesh {
        std::fs::write(package.join("lower.stl"), bytes).unwrap();
    }
    folder.join("arm.urdf")
}

#[test]
fn meshes_are_found_in_packages_and_their_corners_lie_in_capsules() {
    let folder = tempfile::tempdir().unwrap();
    let robot = arm(folder.path(), Some(&slab()));
    let mut config = quick(&robot);
    config.package_dirs = vec![folder.path().join("packages")];
    let record = check(&config);
    assert!(record.safety.capsules.iter().all(|c| c.source == CapsuleSource::Collision));
    assert!(record.provenance.inputs.iter().any(|i| i.path.ends_with("lower.stl")));
    let lower: Vec<_> = record.safety.capsules.iter().filter(|c| c.link == "lower").collect();
    for x in [-0.04, 0.04] {
        for (y, z) in [(-0.03, 0.0), (-0.03, 0.45), (0.03, 0.0), (0.03, 0.45)] {
            let corner = Vec3([x, y, z]);
            let is_inside = lower
                .iter()
                .any(|c| distance([Vec3(c.from_m), Vec3(c.to_m)], [corner, corner]) <= c.radius_m + 1e-6);
            assert!(is_inside, "{corner:?}: {lower:?}");
        }
    }
    assert!(!record.verdict.headline.contains("true shape"), "{}", record.verdict.headline);
}

#[test]
fn meshes_that_are_missing_or_damaged_are_named_and_replaced_along_the_chain() {
    let folder = tempfile::tempdir().unwrap();
    let mut cut = slab();
    cut.truncate(300);
    for (mesh, reason) in [
        (None, "package://arm_description/lower.stl is not there"),
        (Some(cut), "expected 12 triangles, as its header says, found 4"),
    ] {
        let robot = arm(folder.path(), mesh.as_deref());
        let mut config = quick(&robot);
        config.package_dirs = vec![folder.path().join("packages")];
        let record = check(&config);
        let sources: Vec<CapsuleSource> =
            record.safety.capsules.iter().filter(|c| c.link == "lower").map(|c| c.source).collect();
        assert_eq!(sources, [CapsuleSource::Chain]);
        assert!(
            record.verdict.warnings.iter().any(|w| w.contains(reason) && w.contains("package_dirs")),
            "{:?}",
            record.verdict.warnings
        );
        assert!(record.verdict.headline.contains("the true shape of lower"), "{}", record.verdict.headline);
    }
}

#[test]
fn poses_of_the_capsules_are_given_for_pictures() {
    let config = quick(&robots().join("indy7.toml"));
    let (run, record) = run(&config);
    let poses = run.capsule_poses(25).unwrap();
    assert_eq!((poses.len(), poses[0].len()), (25, run.capsules().len()));
    // The base does not move; the last link does.
    let last = run.capsules().len() - 1;
    assert_eq!(poses[0][0], poses[12][0]);
    assert!(poses[0][last] != poses[12][last]);
    assert_eq!(record.safety.capsules.len(), run.capsules().len());
}

#[test]
#[ignore = "a dozen seconds; the ordinary run keeps open robots apart, and closed ones in `dynid-excitation`"]
fn drives_of_a_parallel_machine_stay_away_from_singular_poses_and_limits_of_joints_that_follow() {
    let text = std::fs::read_to_string(robots().join("prr3.toml")).unwrap();
    // A leg may turn by a third of a turn about its home, and no faster than 2 rad/s.
    let name = "joint = { kind = \"revolute\", axis = [0, 0, 1]";
    let limited =
        text.replacen(name, &format!("{name}, limits = {{ position = [0.0, 1.5], velocity = 2 }}"), 1);
    assert_ne!(limited, text);
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("prr3.toml");
    std::fs::write(&file, limited).unwrap();
    let mut config = quick(&file);
    config.trajectory.period_s = Some(5.0);
    config.trajectory.harmonics = Some(3);
    config.limits.singularity = Some(0.4);
    config.safety.floor = false;
    config.keep = vec![KeepConfig {
        frames: vec!["platform".to_owned()],
        half_space: Some(HalfSpaceConfig { normal: [0.0, 1.0, 0.0], offset: 0.2 }),
        ..KeepConfig::default()
    }];
    let (run, record) = run(&config);
    assert_eq!(record.verdict.status.to_string(), "pass", "{}", record.verdict.headline);
    let names: Vec<&str> = record.joints.iter().map(String::as_str).collect();
    assert_eq!(names, ["slider1", "slider2", "slider3"]);
    // Checked by the mechanism itself, on a finer grid.
    let robot = Robot::load(&file, &RobotOptions::default()).unwrap();
    let machine = robot.closed.clone().unwrap();
    let home = machine.singularity(&machine.workspace()).measure;
    let mut work = machine.workspace();
    let place = |joint: &str| {
        let rate = robot.mechanism.rate_names().iter().position(|name| name == joint).unwrap();
        machine.position_of(rate)
    };
    let (mut least, mut low, mut high, mut lowest) =
        (f64::INFINITY, f64::INFINITY, f64::NEG_INFINITY, f64::INFINITY);
    for k in 0..2000 {
        machine.reach(&mut work, &positions(&record, 5.0 * f64::from(k) / 2000.0)).unwrap();
        least = least.min(machine.singularity(&work).measure / home);
        let q = work.positions();
        (low, high) = (low.min(q[place("leg1")]), high.max(q[place("leg1")]));
        lowest = lowest.min(q[place("platform_y")]);
    }
    println!(
        "least distance from singular poses {least:.3} of home, leg1 {low:.3} to {high:.3} rad, platform above {lowest:.3} m"
    );
    assert!(least > 0.4 - 1e-4 && low > -1e-4 && high < 1.5 + 1e-4 && lowest > 0.2 - 1e-4);
    assert!(run.outcome.is_ok());
}
