//! A resumed run has the bits of an uninterrupted one.

use crate::modes::all_modes;
use crate::stream::Stream;
use dynid_online::{Estimator, RowNoise, SquareRoot, StateError};

#[test]
fn a_resumed_run_is_bit_equal() {
    for (name, settings) in all_modes(4, 2) {
        let mut whole = Estimator::new(settings.clone()).unwrap();
        let mut stream = Stream::new(11, &[1.0, 2.0, -1.0, 0.5], 2, 0.3);
        let (mut reactions, mut alarms) = (0, 0);
        for k in 0..600 {
            if k == 300 {
                stream.truth[1] = 6.0;
            }
            if k % 37 == 5 {
                let mut resumed = Estimator::new(settings.clone()).unwrap();
                resumed.load(&whole.save()).unwrap();
                assert_eq!(resumed.save(), whole.save(), "{name} {k}");
                assert_eq!(resumed.x(), whole.x(), "{name} {k}");
                whole = resumed;
            }
            let step = stream.feed(&mut whole);
            reactions += usize::from(step.reaction.is_some());
            alarms += usize::from(step.alarm);
        }
        let mut straight = Estimator::new(settings.clone()).unwrap();
        let mut stream = Stream::new(11, &[1.0, 2.0, -1.0, 0.5], 2, 0.3);
        for k in 0..600 {
            if k == 300 {
                stream.truth[1] = 6.0;
            }
            stream.feed(&mut straight);
        }
        assert_eq!(whole.save(), straight.save(), "{name}");
        assert!(settings.detection.is_none() || alarms > 0, "{name}: alarms are part of what is tested");
        assert!(settings.reaction.is_none() || reactions > 0, "{name}: so are reactions");
    }
}

/// What a run started from is part of its state where it keeps counting.
#[test]
fn a_run_that_started_from_information_resumes_without_it() {
    for (name, settings) in all_modes(3, 2) {
        let known = SquareRoot::from_prior(&[1.0, 2.0, 3.0], &[0.5, 0.2, 0.1]);
        let mut whole = Estimator::starting_from(settings.clone(), known).unwrap();
        let mut stream = Stream::new(15, &[1.0, 2.0, -1.0], 2, 0.3);
        stream.feed_all(&mut whole, 100);
        let mut resumed = Estimator::new(settings).unwrap();
        resumed.load(&whole.save()).unwrap();
        for _ in 0..100 {
            let (phi, effort) = stream.sample();
            for run in [&mut whole, &mut resumed] {
                run.step(&phi, &effort, RowNoise::Std(&[0.3, 0.3])).unwrap();
            }
            assert_eq!(whole.x(), resumed.x(), "{name}");
        }
        assert_eq!(whole.save(), resumed.save(), "{name}");
    }
}

#[test]
fn foreign_and_damaged_states_are_refused() {
    let modes = all_modes(3, 2);
    for (k, (name, settings)) in modes.iter().enumerate() {
        let mut estimator = Estimator::new(settings.clone()).unwrap();
        let mut stream = Stream::new(12, &[1.0, 2.0, -1.0], 2, 0.3);
        stream.feed_all(&mut estimator, 100);
        let words = estimator.save();
        let foreign = &modes[(k + 1) % modes.len()].1;
        let mut other = Estimator::new(foreign.clone()).unwrap();
        let before = other.save();
        assert_eq!(other.load(&words), Err(StateError::OtherSettings), "{name}");
        assert_eq!(other.save(), before, "{name}");
        let mut fresh = Estimator::new(settings.clone()).unwrap();
        for cut in [0, 1, 2, 10, words.len() - 1] {
            assert!(fresh.load(&words[..cut]).is_err(), "{name} {cut}");
        }
        let longer: Vec<u64> = words.iter().copied().chain([0]).collect();
        assert_eq!(fresh.load(&longer), Err(StateError::Damaged), "{name}");
        let mut broken = words.clone();
        broken[4] = f64::NAN.to_bits();
        assert_eq!(fresh.load(&broken), Err(StateError::Damaged), "{name}");
        fresh.load(&words).unwrap();
    }
}

/// Any words either are refused or give an estimator that runs on without panic.
#[test]
fn arbitrary_words_do_no_harm() {
    use rand::RngExt;
    let mut random = crate::stream::random(13);
    for (name, settings) in all_modes(3, 2) {
        let mut estimator = Estimator::new(settings.clone()).unwrap();
        let mut stream = Stream::new(14, &[1.0, 2.0, -1.0], 2, 0.3);
        stream.feed_all(&mut estimator, 100);
        let words = estimator.save();
        let mut accepted = 0;
        for _ in 0..300 {
            let mut broken = words.clone();
            let place = random.random_range(2..words.len());
            broken[place] = match random.random_range(0..3) {
                0 => random.random(),
                1 => random.random_range(0..70),
                _ => u64::MAX - random.random_range(0..70),
            };
            let mut loaded = Estimator::new(settings.clone()).unwrap();
            if loaded.load(&broken).is_ok() {
                accepted += 1;
                stream.feed_all(&mut loaded, 150);
            }
        }
        println!("{name}: {accepted} of 300 accepted");
    }
}
