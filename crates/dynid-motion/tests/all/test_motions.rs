//! Motions of experiments: sweeps, tracks, tones, circles, and the spline of their samples.

#![expect(clippy::unwrap_used, reason = "helpers of tests")]

use std::f64::consts::TAU;

use dynid_motion::trajectory::{
    Alone, Circle, FadedTones, PaulBlend, PaulTrack, Point, Profile, Quantity, Quintic, QuinticSegment,
    QuinticSpline, Rest, Sampled, SweepSettings, Tone, Trajectory, TrajectoryError, sweeps,
};

fn at(trajectory: &dyn Trajectory, time: f64) -> Vec<Point> {
    let mut out = vec![Point::default(); trajectory.coordinates()];
    trajectory.at(time, &mut out);
    out
}

/// Each derivative is the limit of differences of the one below, by Richardson's step of fourth order; jumps are kept away from.
#[track_caller]
fn check_derivatives(trajectory: &dyn Trajectory, times: &[f64], tolerance: f64) {
    let h = 1e-3;
    for t in times {
        let [a, b, c, d] = [-2.0, -1.0, 1.0, 2.0].map(|k| at(trajectory, t + k * h));
        for (coordinate, here) in at(trajectory, *t).iter().enumerate() {
            let slope = |of: fn(&Point) -> f64| {
                let [a, b, c, d] = [&a, &b, &c, &d].map(|p| of(&p[coordinate]));
                (a - 8.0 * b + 8.0 * c - d) / (12.0 * h)
            };
            for (found, expected) in [
                (here.velocity, slope(|p| p.position)),
                (here.acceleration, slope(|p| p.velocity)),
                (here.jerk, slope(|p| p.acceleration)),
            ] {
                let size = expected.abs().max(1.0);
                assert!((found - expected).abs() < tolerance * size, "{t}: {found} {expected}");
            }
        }
    }
}

fn settings() -> SweepSettings {
    SweepSettings {
        range: (-0.4, 1.2),
        speeds: vec![0.05, 0.2, 1.0],
        acceleration: 5.0,
        ..SweepSettings::default()
    }
}

#[test]
fn sweeps_run_both_ways_over_the_same_positions_at_exact_speeds() {
    let settings = settings();
    let passes = sweeps(&settings).unwrap();
    assert_eq!(passes.len(), 6);
    for (pair, speed) in passes.chunks(2).zip(&settings.speeds) {
        assert_eq!((pair[0].speed(), pair[1].speed()), (*speed, -*speed));
        for pass in pair {
            let (start, end) = pass.cruise();
            assert_eq!(pass.at(0.5 * (start + end)).velocity, pass.speed());
            // All borders on the grid of samples.
            for t in [start, end, pass.duration()] {
                assert!((t * 500.0 - (t * 500.0).round()).abs() < 1e-9, "{t}");
            }
            assert!(end - start >= settings.least_s && end - start <= settings.longest_s + 1e-12);
            // Area under the trapezoid: speed times blend and cruise.
            let way = pass.at(pass.duration()).position - pass.at(0.0).position;
            assert!((way - pass.speed() * (end - start + start)).abs() < 1e-12);
            for k in 0..=1000 {
                let point = pass.at(pass.duration() * f64::from(k) / 1000.0);
                assert!(point.position > -0.4 - 1e-12 && point.position < 1.2 + 1e-12);
                assert!(point.acceleration.abs() <= settings.acceleration * (1.0 + 1e-12));
            }
        }
        let [forth, back] = [&pair[0], &pair[1]];
        assert!((forth.at(0.0).position - back.at(back.duration()).position).abs() < 1e-12);
        assert!((forth.at(forth.duration()).position - back.at(0.0).position).abs() < 1e-12);
        // About the middle of the range.
        assert!((0.5 * (forth.at(0.0).position + back.at(0.0).position) - 0.4).abs() < 1e-12);
    }
}

#[test]
fn jerk_limits_lengthen_the_blends_of_sweeps() {
    let passes = sweeps(&SweepSettings { jerk: 10.0, ..settings() }).unwrap();
    for pass in passes {
        let (blend, speed) = (pass.cruise().0, pass.speed().abs());
        assert!(6.0 * speed / blend.powi(2) <= 10.0 * (1.0 + 1e-12));
    }
}

#[test]
fn sweeps_that_cannot_be_are_refused_with_the_reason() {
    let refused = |settings: SweepSettings| sweeps(&settings).unwrap_err();
    let short = refused(SweepSettings { speeds: vec![0.1, 3.0], ..settings() });
    let TrajectoryError::ShortSweep { speed, cruise, least, .. } = short else { panic!("{short}") };
    assert_eq!((speed, least), (3.0, 0.6));
    assert_eq!(cruise, 0.0, "the blend alone takes 0.9 s of 0.53 s");
    for bad in [f64::NAN, 0.0, -0.1, f64::INFINITY] {
        assert!(sweeps(&SweepSettings { speeds: vec![bad], ..settings() }).is_err());
        assert!(sweeps(&SweepSettings { acceleration: bad, ..settings() }).is_err());
        assert!(sweeps(&SweepSettings { rate_hz: bad, ..settings() }).is_err());
    }
    assert!(sweeps(&SweepSettings { range: (1.0, f64::NAN), ..settings() }).is_err());
    assert!(sweeps(&SweepSettings { range: (1.0, 1.0), ..settings() }).is_err());
    assert!(sweeps(&SweepSettings { speeds: Vec::new(), ..settings() }).is_err());
    assert!(sweeps(&SweepSettings { jerk: f64::NAN, ..settings() }).is_err());
}

fn track() -> PaulTrack {
    let points = vec![vec![0.0, 1.0], vec![1.0, 1.5], vec![0.4, 1.5], vec![0.4, -1.0]];
    PaulTrack::new(points, vec![1.0, 0.8, 2.5], 0.4).unwrap()
}

#[test]
fn a_track_rests_at_its_ends_and_is_smooth_between() {
    let track = track();
    assert!((track.duration() - 4.7).abs() < 1e-12);
    for (time, ends) in [(0.0, [0.0, 1.0]), (-1.0, [0.0, 1.0]), (4.7, [0.4, -1.0]), (9.0, [0.4, -1.0])] {
        for (point, end) in at(&track, time).iter().zip(ends) {
            assert_eq!((point.position, point.velocity, point.acceleration), (end, 0.0, 0.0), "{time}");
        }
    }
    // Position, velocity and acceleration are the same on both sides of every border of a blend.
    for corner in [0.2, 1.2, 2.0, 4.5] {
        for border in [corner - 0.2, corner + 0.2] {
            let (before, after) = (at(&track, border - 1e-12), at(&track, border + 1e-12));
            for (a, b) in before.iter().zip(&after) {
                assert!((a.position - b.position).abs() < 1e-10);
                assert!((a.velocity - b.velocity).abs() < 1e-10);
                assert!((a.acceleration - b.acceleration).abs() < 1e-9);
            }
        }
    }
    check_derivatives(&track, &[0.1, 0.7, 1.15, 1.3, 1.6, 2.1, 3.0, 4.4, 4.6], 1e-9);
}

#[test]
fn a_track_passes_its_points_as_said_and_peaks_as_said() {
    let track = track();
    // First coordinate about the second point: from 1 to -0.75 per s.
    let change: f64 = -0.6 / 0.8 - 1.0;
    let near = at(&track, 1.2)[0];
    assert!((near.position - (1.0 + 3.0 / 32.0 * 0.4 * change)).abs() < 1e-12);
    assert!((near.acceleration - 1.5 * change / 0.4).abs() < 1e-9);
    // On the line between: the velocity of the line.
    assert!((at(&track, 0.7)[0].velocity - 1.0).abs() < 1e-12);
    assert!((at(&track, 0.7)[0].position - 0.5).abs() < 1e-12);
    let spline = QuinticSpline::new(Sampled::at_rate(&track, 100.0).unwrap()).unwrap();
    let (least, most) = spline.range(0, Quantity::Acceleration);
    assert!((least - 1.5 * change / 0.4).abs() < 1e-9, "{least}");
    assert!((most - 1.5 * 1.0 / 0.4).abs() < 1e-9, "{most}");
    let (least, most) = spline.range(0, Quantity::Velocity);
    assert!((most - 1.0).abs() < 1e-12 && (least + 0.75).abs() < 1e-12);
}

#[test]
fn a_track_of_two_points_is_a_blend_from_point_to_point() {
    let track = PaulTrack::new(vec![vec![0.3], vec![-1.2]], vec![2.0], 0.5).unwrap();
    let blend = PaulBlend::constant_velocity(0.3, -0.75, 0.5, 1.5).unwrap();
    for k in 0..=100 {
        let t = 2.5 * f64::from(k) / 100.0;
        let (a, b) = (at(&track, t)[0], blend.at(t));
        assert!((a.position - b.position).abs() < 1e-14 && (a.velocity - b.velocity).abs() < 1e-14);
        assert!((a.acceleration - b.acceleration).abs() < 1e-13);
    }
    let times = PaulTrack::times(&[vec![0.3], vec![-1.2], vec![-1.2]], &[0.75], 0.5).unwrap();
    assert!((times[0] - 2.0).abs() < 1e-15 && times[1] == 0.5);
}

#[test]
fn tracks_that_cannot_be_are_refused() {
    let two = vec![vec![0.0], vec![1.0]];
    assert!(PaulTrack::new(two.clone(), vec![0.3], 0.4).is_err(), "blends would overlap");
    assert!(PaulTrack::new(two.clone(), vec![1.0, 1.0], 0.4).is_err());
    assert!(PaulTrack::new(vec![vec![0.0]], vec![], 0.4).is_err());
    assert!(PaulTrack::new(vec![vec![0.0], vec![1.0, 2.0]], vec![1.0], 0.4).is_err());
    assert!(PaulTrack::new(vec![vec![0.0], vec![f64::NAN]], vec![1.0], 0.4).is_err());
    assert!(PaulTrack::new(two.clone(), vec![f64::NAN], 0.4).is_err());
    assert!(PaulTrack::times(&two, &[0.0], 0.4).is_err());
    assert!(PaulTrack::times(&two, &[f64::NAN], 0.4).is_err());
}

#[test]
fn tones_rise_from_rest_and_end_there() {
    let tones =
        vec![Tone { frequency_hz: 3.0, amplitude: 1e-3 }, Tone { frequency_hz: 6.9, amplitude: 5e-4 }];
    let tones = FadedTones::new(0.7, tones, 4.0, 0.5).unwrap();
    for time in [-1.0, 0.0, 4.0, 5.0] {
        assert_eq!(tones.at(time), Point::rest(0.7));
    }
    for time in [1e-9, 4.0 - 1e-9] {
        let point = tones.at(time);
        assert!(point.velocity.abs() < 1e-9 && point.acceleration.abs() < 1e-7);
    }
    // In the middle the plain sinusoids.
    let (t, w) = (2.1, TAU * 3.0);
    let wanted = 0.7 + 1e-3 * (w * t).sin() + 5e-4 * (2.3 * w * t).sin();
    assert!((tones.at(t).position - wanted).abs() < 1e-15);
    let motion = Alone::new(vec![0.1, 0.2], 1, tones).unwrap();
    assert_eq!(at(&motion, 2.1)[0], Point::rest(0.1));
    // The steps of the differences are coarse for 7 Hz: (2π 7 h)^4 / 30 of derivatives of a size of 1e2.
    check_derivatives(&motion, &[0.2, 0.47, 1.1, 2.1, 3.6, 3.9], 1e-4);
    let one = |frequency_hz, amplitude| vec![Tone { frequency_hz, amplitude }];
    assert!(FadedTones::new(0.0, one(3.0, f64::NAN), 1.0, 0.2).is_err());
    assert!(FadedTones::new(0.0, one(0.0, 1.0), 1.0, 0.2).is_err());
    assert!(FadedTones::new(0.0, one(3.0, 1.0), 0.3, 0.2).is_err());
    assert!(FadedTones::new(0.0, vec![], 1.0, 0.2).is_err());
}

#[test]
fn a_circle_keeps_its_radius() {
    let circle = Circle::new([0.3, -0.1], 0.25, Quintic::new(0.0, TAU, 3.0).unwrap()).unwrap();
    for k in 0..=200 {
        let points = at(&circle, 3.0 * f64::from(k) / 200.0);
        let (x, y) = (points[0].position - 0.3, points[1].position + 0.1);
        assert!((x.hypot(y) - 0.25).abs() < 1e-15);
        assert!((x * points[0].velocity + y * points[1].velocity).abs() < 1e-15, "velocity is across");
    }
    check_derivatives(&circle, &[0.3, 1.1, 1.5, 2.6], 1e-8);
    assert!(Circle::new([0.0, 0.0], 0.0, Quintic::new(0.0, 1.0, 1.0).unwrap()).is_err());
    assert!(Circle::new([f64::NAN, 0.0], 1.0, Quintic::new(0.0, 1.0, 1.0).unwrap()).is_err());
}

#[test]
fn the_spline_of_samples_is_the_motion_where_its_borders_lie_on_samples() {
    let track = track();
    let spline = QuinticSpline::new(Sampled::at_rate(&track, 10.0).unwrap()).unwrap();
    assert_eq!(spline.coordinates(), 2);
    for k in 0..=2000 {
        let t = 4.7 * f64::from(k) / 2000.0;
        for (a, b) in at(&track, t).iter().zip(at(&spline, t)) {
            assert!((a.position - b.position).abs() < 1e-13);
            assert!((a.velocity - b.velocity).abs() < 1e-12);
            assert!((a.acceleration - b.acceleration).abs() < 1e-11);
        }
    }
    let (from, to) =
        (Point::rest(0.2), Point { position: 1.0, velocity: 0.5, acceleration: -1.0, jerk: 0.0 });
    let quintic = QuinticSegment::new(&[from], &[to], 1.5).unwrap();
    let spline = QuinticSpline::new(Sampled::at_rate(&quintic, 8.0).unwrap()).unwrap();
    for quantity in Quantity::ALL {
        let (a, b) = (quintic.range(0, quantity), spline.range(0, quantity));
        // Jerk of a piece comes from differences of positions over its step.
        let tolerance = 1e-13 * 8f64.powi(quantity as i32);
        assert!((a.0 - b.0).abs() < tolerance && (a.1 - b.1).abs() < tolerance, "{quantity}");
    }
}

#[test]
fn the_error_of_the_spline_falls_with_the_sixth_power_of_the_step() {
    let tones = FadedTones::new(0.0, vec![Tone { frequency_hz: 1.0, amplitude: 1.0 }], 6.0, 1.0).unwrap();
    let motion = Alone::new(vec![0.0], 0, tones).unwrap();
    let error = |rate: f64| {
        let spline = QuinticSpline::new(Sampled::at_rate(&motion, rate).unwrap()).unwrap();
        let miss = |k: i32| {
            let t = 2.0 + f64::from(k) / 1000.0;
            (at(&spline, t)[0].position - at(&motion, t)[0].position).abs()
        };
        (0..2000).map(miss).fold(0.0, f64::max)
    };
    let ratio = error(10.0) / error(20.0);
    assert!((ratio - 64.0).abs() < 4.0, "{ratio}");
}

#[test]
fn ranges_of_a_spline_hold_what_lies_between_samples() {
    // At a rate that misses every peak.
    let tones = FadedTones::new(0.0, vec![Tone { frequency_hz: 2.0, amplitude: 0.1 }], 3.0, 0.5).unwrap();
    let motion = Alone::new(vec![0.0], 0, tones).unwrap();
    let spline = QuinticSpline::new(Sampled::at_rate(&motion, 17.0).unwrap()).unwrap();
    for (order, quantity) in
        [Quantity::Position, Quantity::Velocity, Quantity::Acceleration].iter().enumerate()
    {
        let (low, high) = spline.range(0, *quantity);
        let values = (0..=20_000).map(|k| {
            let p = at(&spline, spline.duration() * f64::from(k) / 20_000.0)[0];
            [p.position, p.velocity, p.acceleration][order]
        });
        let (least, most) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(x), b.max(x)));
        let slack = 1e-9 * (high - low);
        assert!(low <= least + slack && most <= high + slack);
        assert!(least - low < 1e-5 * (high - low) && high - most < 1e-5 * (high - low));
    }
}

#[test]
fn samples_that_are_no_motion_are_refused() {
    let good = Sampled { time: vec![1.0, 2.0], q: vec![0.0, 1.0], dq: vec![0.0; 2], ddq: vec![0.0; 2] };
    let spline = QuinticSpline::new(good.clone()).unwrap();
    assert_eq!((spline.duration(), spline.knots().time[0]), (1.0, 0.0));
    let bad = [
        Sampled { time: vec![1.0, 1.0], ..good.clone() },
        Sampled { time: vec![f64::NAN, 1.0], ..good.clone() },
        Sampled { q: vec![0.0, f64::NAN], ..good.clone() },
        Sampled { dq: vec![f64::INFINITY, 0.0], ..good.clone() },
        Sampled { time: vec![1.0], q: vec![0.0], dq: vec![0.0], ddq: vec![0.0] },
        Sampled { time: vec![0.0, 1.0], q: vec![], dq: vec![], ddq: vec![] },
    ];
    for sampled in bad {
        assert!(QuinticSpline::new(sampled).is_err());
    }
}

#[test]
fn a_pause_rests() {
    let rest = Rest::new(vec![0.1, -0.2], 3.0).unwrap();
    assert_eq!(at(&rest, 1.7), [Point::rest(0.1), Point::rest(-0.2)]);
    assert!(Rest::new(vec![0.1], 0.0).is_err() && Rest::new(vec![f64::NAN], 1.0).is_err());
    assert!(Rest::new(vec![], 1.0).is_err() && Rest::new(vec![0.0], f64::NAN).is_err());
}
