//! Tables of samples as trajectories, read back.

use dynid_logs::csv::{self, ReadOptions};
use dynid_logs::trajectory::{TrajectorySamples, write_csv_with_channels};
use dynid_motion::trajectory::{PaulTrack, Phase, Sampled};

#[test]
fn tables_read_back_with_their_channels() {
    let folder = tempfile::tempdir().unwrap();
    let track = PaulTrack::new(vec![vec![0.0, 1.0], vec![1.0, -1.0]], vec![1.5], 0.5).unwrap();
    let sampled = Sampled::at_rate(&track, 50.0).unwrap();
    let joints = ["elbow".to_owned(), "q_lift".to_owned()];
    let load: Vec<f64> = sampled.time.iter().map(|t| 2.0 * t).collect();
    let part = vec![1.0; sampled.samples()];
    let channels = [("load_elbow".to_owned(), load), ("part".to_owned(), part)];
    let phases = vec![Phase::Record; sampled.samples()];
    for name in ["a.csv", "a.csv.gz"] {
        let path = folder.path().join(name);
        write_csv_with_channels(&path, &joints, &sampled, &channels, Some(&phases)).unwrap();
        assert!(TrajectorySamples::is_table(&path));
        let header = csv::read(&path, &ReadOptions::default()).unwrap().header;
        assert_eq!(header[7..], ["load_elbow", "part", "phase"]);
        let read = TrajectorySamples::read(&path).unwrap();
        assert_eq!(read.joints, joints);
        assert_eq!(read.motion.knots(), &sampled);
        assert_eq!(read.channels, channels[..1]);
    }
    assert!(!TrajectorySamples::is_table("trajectory.json".as_ref()));
    let short = [("load_elbow".to_owned(), vec![1.0])];
    assert!(write_csv_with_channels(folder.path().join("no.csv"), &joints, &sampled, &short, None).is_err());
}

#[test]
fn tables_that_are_no_motion_are_refused_with_their_column() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.csv");
    for (text, said) in [
        ("t,q_j,dq_j\n0,0,0\n1,0,0\n", "ddq_j: expected a column of this name"),
        ("q_j,dq_j,ddq_j\n0,0,0\n1,0,0\n", "t: expected a column"),
        ("t,x\n0,0\n1,0\n", "q_<joint>: expected a column"),
        ("t,q_j,dq_j,ddq_j\n0,0,0,0\n", "samples: expected at least 2"),
        ("t,q_j,dq_j,ddq_j\n0,0,0,0\n0,0,0,0\n", "time"),
        ("t,q_j,dq_j,ddq_j\n0,0,0,nan\n1,0,0,0\n", "a.csv"),
    ] {
        std::fs::write(&path, text).unwrap();
        let error = TrajectorySamples::read(&path).unwrap_err();
        assert!(error.to_string().contains(said), "{text}: {error}");
        assert!(error.hint().is_some());
    }
}
