//! Identities of trajectories: derivatives, ends, limits, joints.

#![expect(clippy::unwrap_used, reason = "helpers of tests")]

use std::f64::consts::TAU;

use dynid_motion::trajectory::{
    BSpline, Form, Fourier, FourierTrajectory, MotionLimits, PaulBlend, PerCoordinate, Phase, Point, Profile,
    Quantity, Quintic, QuinticSegment, RowOrder, Sampled, Sequence, Trajectory, TrajectoryError, Trapezoid,
};
use proptest::prelude::*;

/// Gauss-Legendre nodes and weights of five points on [-1, 1]: exact up to degree 9.
fn gauss() -> [(f64, f64); 5] {
    let (a, b) = (
        (5.0 - 2.0 * (10.0_f64 / 7.0).sqrt()).sqrt() / 3.0,
        (5.0 + 2.0 * (10.0_f64 / 7.0).sqrt()).sqrt() / 3.0,
    );
    let (w, v) = ((322.0 + 13.0 * 70f64.sqrt()) / 900.0, (322.0 - 13.0 * 70f64.sqrt()) / 900.0);
    [(0.0, 128.0 / 225.0), (a, w), (-a, w), (b, v), (-b, v)]
}

/// Each derivative integrates to the difference of the one below, between neighbours of `borders`; inside, the motion is smooth
/// and the pieces are short enough for five points.
#[track_caller]
fn check_derivatives(motion: &dyn Fn(f64) -> Point, borders: &[f64], tolerance: f64) {
    for w in borders.windows(2) {
        let (middle, half) = (0.5 * (w[0] + w[1]), 0.5 * (w[1] - w[0]));
        let mut integral = [0.0; 3];
        let mut scale = [0.0_f64; 3];
        for (node, weight) in gauss() {
            let p = motion(middle + node * half);
            for (k, x) in [p.velocity, p.acceleration, p.jerk].into_iter().enumerate() {
                integral[k] += half * weight * x;
                scale[k] = scale[k].max(half * x.abs());
            }
        }
        let (from, to) = (motion(w[0]), motion(w[1]));
        let below = [
            (from.position, to.position),
            (from.velocity, to.velocity),
            (from.acceleration, to.acceleration),
        ];
        for (k, (from, to)) in below.into_iter().enumerate() {
            let size = scale[k].max(from.abs()).max(to.abs()).max(1e-3);
            let miss = (to - from - integral[k]).abs();
            assert!(miss <= tolerance * size, "order {k} on {w:?}: {miss:e} of {size}");
        }
    }
}

fn pieces(from: f64, to: f64, count: usize) -> Vec<f64> {
    (0..=count).map(|k| from + (to - from) * k as f64 / count as f64).collect()
}

fn only(trajectory: &dyn Trajectory, time: f64) -> Point {
    let mut out = vec![Point::default(); trajectory.coordinates()];
    trajectory.at(time, &mut out);
    out[0]
}

fn amplitudes(n: usize) -> impl Strategy<Value = Vec<f64>> {
    prop::collection::vec(-2.0..2.0, n)
}

fn state() -> impl Strategy<Value = Point> {
    (-3.0..3.0, -1.0..1.0, -1.0..1.0).prop_map(|(position, velocity, acceleration)| Point {
        position,
        velocity,
        acceleration,
        jerk: 0.0,
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn derivatives_of_fourier_series((a, b, base) in (amplitudes(5), amplitudes(5), 0.1..5.0)) {
        let series = Fourier::plain(base, 0.3, a, b).unwrap();
        check_derivatives(&|t| series.at(t), &pieces(0.0, series.period(), 60), 1e-9);
        let slope = series.derivative();
        for t in pieces(0.0, 3.0 * series.period(), 17) {
            let (p, d) = (series.at(t), slope.at(t));
            let size = (5.0 * base).powi(3).max(1.0) * 50.0;
            prop_assert!((p.velocity - d.position).abs() <= 1e-14 * size);
            prop_assert!((p.acceleration - d.velocity).abs() <= 1e-14 * size);
            prop_assert!((p.jerk - d.acceleration).abs() <= 1e-14 * size);
        }
    }

    /// Above a grid of 20 000 points by no more than what the grid bound leaves between its points.
    #[test]
    fn extremes_of_fourier_series((a, b, n) in (amplitudes(7), amplitudes(7), 1usize..=7)) {
        let series = Fourier::plain(1.7, -0.4, a[..n].to_vec(), b[..n].to_vec()).unwrap();
        let found = series.extremes();
        let grid: Vec<f64> = (0..20_000).map(|k| series.at(series.period() * f64::from(k) / 2e4).position).collect();
        let low = grid.iter().copied().fold(f64::INFINITY, f64::min);
        let high = grid.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let swing = f64::max(high + 0.4, -0.4 - low) * 1e-6;
        prop_assert!(found.low.value <= low + 1e-14 && found.low.value >= low - swing);
        prop_assert!(found.high.value >= high - 1e-14 && found.high.value <= high + swing);
        for extreme in [found.low, found.high] {
            prop_assert_eq!(series.at(extreme.time).position, extreme.value);
            prop_assert!(series.at(extreme.time).velocity.abs() < 1e-8);
        }
    }

    #[test]
    fn rows_come_back_in_every_order_and_form(row in amplitudes(11), base in 0.1..5.0) {
        for text in ["q0,a,b", "a,b,q0", "ab,q0", "q0,ba", "b,a,q0"] {
            let order: RowOrder = text.parse().unwrap();
            for form in [Form::Plain, Form::VelocityAmplitudes] {
                let series = Fourier::from_row(base, form, &order, &row).unwrap();
                for (x, y) in row.iter().zip(series.to_row(form, &order).unwrap()) {
                    prop_assert!((x - y).abs() <= 1e-15 * x.abs().max(1.0));
                }
            }
            // Amplitudes of the velocity are what the velocity has at time 0.
            let series = Fourier::from_row(base, Form::VelocityAmplitudes, &order, &row).unwrap();
            let (a, _) = series.coefficients(Form::VelocityAmplitudes);
            prop_assert!((series.at(0.0).velocity - a.iter().sum::<f64>()).abs() < 1e-12);
        }
    }

    #[test]
    fn quintics_meet_their_ends((from, to, duration) in (state(), state(), 0.05..20.0)) {
        let segment = QuinticSegment::new(&[from], &[to], duration).unwrap();
        check_derivatives(&|t| only(&segment, t), &pieces(0.0, duration, 4), 1e-12);
        for (near, end) in [(1e-9, from), (1.0 - 1e-9, to)] {
            let p = only(&segment, near * duration);
            prop_assert!((p.position - end.position).abs() < 1e-7);
            prop_assert!((p.velocity - end.velocity).abs() < 1e-4);
        }
        for (time, end) in [(0.0, from), (-1.0, from), (duration, to), (duration + 1.0, to)] {
            let p = only(&segment, time);
            let ends = (end.position, end.velocity, end.acceleration);
            prop_assert_eq!((p.position, p.velocity, p.acceleration), ends);
        }
        for quantity in Quantity::ALL {
            let (low, high) = segment.range(0, quantity);
            // At the ends stands the state that was asked for, whose jerk does not count: that of the motion has a side there.
            let inside = |t: &f64| quantity != Quantity::Jerk || (*t > 0.0 && *t < duration);
            let values = pieces(0.0, duration, 1000).into_iter().filter(inside).map(|t| {
                let p = only(&segment, t);
                [p.position, p.velocity, p.acceleration, p.jerk][quantity as usize]
            });
            let slack = 1e-9 * low.abs().max(high.abs());
            for x in values {
                prop_assert!(low - slack <= x && x <= high + slack, "{} {} {} {}", quantity, low, x, high);
            }
        }
    }

    /// No limit is broken, and the next shorter motion breaks one.
    #[test]
    fn shortest_quintics_use_their_limits((from, to) in (state(), state())) {
        let limits = MotionLimits { position: (-4.0, 4.0), velocity: 1.5, acceleration: 3.0, jerk: 40.0 };
        let Ok(segment) = QuinticSegment::shortest(&[from], &[to], &[limits]) else {
            // An end near the border may drive out of the range whatever the duration.
            prop_assume!(false);
            unreachable!()
        };
        let excess = |s: &QuinticSegment| Quantity::ALL
            .map(|q| {
                let ((low, high), (least, most)) = (limits.of(q), s.range(0, q));
                (most - high).max(low - least) / (0.5 * (high - low))
            })
            .into_iter()
            .fold(f64::NEG_INFINITY, f64::max);
        prop_assert!(excess(&segment) <= 1.1e-9);
        let shorter = QuinticSegment::new(&[from], &[to], segment.duration() * (1.0 - 1e-6)).unwrap();
        prop_assert!(excess(&shorter) > 0.0);
    }

    #[test]
    fn derivatives_of_b_splines(control in amplitudes(9), degree in 3usize..=6, duration in 0.5..20.0) {
        let curve = BSpline::resting(degree, duration, std::slice::from_ref(&control)).unwrap();
        let spans = control.len() + 4 - degree;
        // Inside the knots: at degree 3 the jerk has a value on either side of each.
        for k in 0..spans {
            let inside = |s: f64| duration * (k as f64 + s) / spans as f64;
            check_derivatives(&|t| only(&curve, t), &[inside(1e-9), inside(0.5), inside(1.0 - 1e-9)], 1e-11);
        }
        let (start, end) = (only(&curve, 0.0), only(&curve, duration));
        prop_assert_eq!((start.position, start.velocity, start.acceleration), (control[0], 0.0, 0.0));
        prop_assert!((end.position - control[8]).abs() < 1e-15 && end.velocity == 0.0 && end.acceleration == 0.0);
        let (low, high) = control.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |m, x| (m.0.min(*x), m.1.max(*x)));
        for k in 0..spans {
            let knot = duration * k as f64 / spans as f64;
            let (left, right) = (only(&curve, knot * (1.0 - 1e-13)), only(&curve, knot));
            prop_assert!((left.acceleration - right.acceleration).abs() < 1e-9 * (1.0 + right.jerk.abs()));
            prop_assert!(right.position >= low - 1e-14 && right.position <= high + 1e-14);
        }
    }

    #[test]
    fn blends_and_ramps((from, to, speed, time) in (-2.0..2.0, -2.0..2.0, 0.05..3.0, 0.1..2.0)) {
        let paul = PaulBlend::point_to_point(from, to, speed, time).unwrap();
        let ramps = Trapezoid::point_to_point(from, to, speed, 1.0 / time).unwrap();
        for (profile, cruise) in [(&paul as &dyn Profile, paul.cruise()), (&ramps, ramps.cruise())] {
            let end = profile.duration();
            prop_assert_eq!(profile.at(-1.0), Point::rest(from));
            prop_assert!((profile.at(end + 1.0).position - to).abs() < 1e-12);
            for t in pieces(0.0, end, 300) {
                prop_assert!(profile.at(t).velocity.abs() <= speed * (1.0 + 1e-12));
            }
            let hair = 1e-10 * end;
            for (a, b) in [(0.0, cruise.0), (cruise.0, cruise.1), (cruise.1, end)] {
                if b - a > 1e-6 {
                    check_derivatives(&|t| profile.at(t), &pieces(a + hair, b - hair, 2), 1e-8);
                }
            }
        }
        for border in [0.0, paul.cruise().0, paul.cruise().1, Profile::duration(&paul)] {
            let (left, right) = (paul.at(border - 1e-9), paul.at(border + 1e-9));
            prop_assert!((left.acceleration - right.acceleration).abs() < 1e-7 * (1.0 + speed / time.powi(2)));
        }
    }
}

/// Rest to rest the shortest duration is `max(15/8 d/v, sqrt(10/sqrt(3) d/a), cbrt(60 d/j))`.
#[test]
fn shortest_rest_to_rest_is_the_closed_form() {
    for (velocity, acceleration, jerk) in [(0.5, 9.0, 1e3), (9.0, 0.7, 1e3), (9.0, 9.0, 2.0)] {
        let limits = MotionLimits { velocity, acceleration, jerk, ..MotionLimits::default() };
        let ends = [Point::rest(-0.4), Point::rest(1.1)];
        let segment = QuinticSegment::shortest(&ends[..1], &ends[1..], &[limits]).unwrap();
        let d: f64 = 1.5;
        let expected = (1.875 * d / velocity)
            .max((10.0 / 3f64.sqrt() * d / acceleration).sqrt())
            .max((60.0 * d / jerk).cbrt());
        assert!((segment.duration() / expected - 1.0).abs() < 2e-9, "{} {expected}", segment.duration());
        let blend = Quintic::new(-0.4, 1.1, segment.duration()).unwrap();
        for t in pieces(0.0, segment.duration(), 50) {
            let (x, y) = (only(&segment, t), blend.at(t));
            for (x, y) in [(x.position, y.position), (x.velocity, y.velocity), (x.jerk, y.jerk)] {
                assert!((x - y).abs() < 1e-12 * (1.0 + y.abs()));
            }
        }
    }
}

#[test]
fn motions_that_no_duration_allows_are_named() {
    let limits =
        MotionLimits { position: (-1.0, 1.0), velocity: 1.0, acceleration: 2.0, ..MotionLimits::default() };
    let beyond = QuinticSegment::shortest(&[Point::rest(0.0)], &[Point::rest(1.2)], &[limits]).unwrap_err();
    assert!(matches!(
        beyond,
        TrajectoryError::EndBeyondLimit { coordinate: 0, quantity: Quantity::Position, found: 1.2, .. }
    ));
    // At the border and still going out: every motion leaves the range.
    let leaving = Point { position: 1.0, velocity: 0.5, ..Point::default() };
    let found = QuinticSegment::shortest(&[leaving], &[Point::rest(0.0)], &[limits]).unwrap_err();
    assert!(matches!(found, TrajectoryError::NoDuration { coordinate: 0, .. }), "{found}");
}

fn record() -> FourierTrajectory {
    let a = |k: f64| vec![0.3 * k, -0.2, 0.1 * k];
    let series = |k: f64| Fourier::plain(TAU / 8.0, 0.2 * k, a(k), vec![0.1, 0.2 * k, -0.1]).unwrap();
    FourierTrajectory::new(vec![series(1.0), series(-0.5)], 3).unwrap()
}

#[test]
fn a_parked_record_is_smooth_and_knows_its_phases() {
    let limits = MotionLimits { velocity: 1.0, acceleration: 2.0, jerk: 20.0, ..MotionLimits::default() };
    let parking = [0.5, -0.4];
    let sequence = Sequence::parked(&parking, Box::new(record()), &[limits; 2]).unwrap();
    let span = sequence.span(Phase::Record).unwrap();
    assert!((span.end - span.start - 24.0).abs() < 1e-12);
    assert_eq!(sequence.span(Phase::Approach).unwrap(), 0.0..span.start);
    assert_eq!(sequence.span(Phase::Return).unwrap().end, sequence.duration());
    for (time, phase) in [
        (-1.0, Phase::Approach),
        (0.5 * span.start, Phase::Approach),
        (span.start, Phase::Record),
        (span.end - 1e-6, Phase::Record),
        (span.end, Phase::Return),
        (sequence.duration() + 5.0, Phase::Return),
    ] {
        assert_eq!(sequence.phase(time), phase, "{time}");
    }
    for time in [0.0, -2.0, sequence.duration(), sequence.duration() + 2.0] {
        let mut out = [Point::default(); 2];
        sequence.at(time, &mut out);
        for (p, rest) in out.iter().zip(parking) {
            assert_eq!((p.position, p.velocity, p.acceleration), (rest, 0.0, 0.0));
        }
    }
    for joint in [span.start, span.end] {
        let (before, after) = (only(&sequence, joint - 1e-9), only(&sequence, joint + 1e-9));
        assert!((before.acceleration - after.acceleration).abs() < 1e-7);
        assert!((before.velocity - after.velocity).abs() < 1e-7);
    }
    let inside = only(&sequence, span.start + 3.3);
    let alone = only(&record(), 3.3);
    assert!((inside.position - alone.position).abs() < 1e-12 && (inside.jerk - alone.jerk).abs() < 1e-12);
    let timed = Sequence::timed(Some((&parking, 2.0)), Box::new(record()), None).unwrap();
    assert!((timed.duration() - 26.0).abs() < 1e-12);
    assert_eq!(timed.span(Phase::Return), None);
}

#[test]
fn jumps_between_segments_are_refused() {
    let rest = |q: f64| -> Box<dyn Trajectory> {
        let from = [Point::rest(q), Point::rest(0.0)];
        Box::new(QuinticSegment::new(&from, &from, 1.0).unwrap())
    };
    let joined = |a, b| Sequence::new(vec![(Phase::Approach, a), (Phase::Record, b)]);
    assert!(joined(rest(0.5), rest(0.5)).is_ok());
    assert!(matches!(
        joined(rest(0.5), rest(0.6)).unwrap_err(),
        TrajectoryError::Discontinuity { segment: 1, coordinate: 0, quantity: Quantity::Position, .. }
    ));
    let found = joined(rest(only(&record(), 0.0).position), Box::new(record())).unwrap_err();
    assert!(matches!(found, TrajectoryError::Discontinuity { quantity: Quantity::Velocity, .. }), "{found}");
    let one = PerCoordinate::new(vec![Quintic::new(0.0, 1.0, 1.0).unwrap()]).unwrap();
    assert!(matches!(joined(rest(0.0), Box::new(one)).unwrap_err(), TrajectoryError::Count { .. }));
    assert!(Sequence::new(vec![]).is_err());
}

#[test]
fn sampling_lays_coordinates_one_after_the_other() {
    let motion = record();
    let sampled = Sampled::at_rate(&motion, 100.0).unwrap();
    assert_eq!((sampled.samples(), sampled.coordinates()), (2401, 2));
    let mut points = [Point::default(); 2];
    for s in [0, 17, 2400] {
        motion.at(s as f64 / 100.0, &mut points);
        for (c, p) in points.iter().enumerate() {
            let k = c * sampled.samples() + s;
            assert_eq!(
                (sampled.q[k], sampled.dq[k], sampled.ddq[k]),
                (p.position, p.velocity, p.acceleration)
            );
        }
    }
    assert!(Sampled::at_rate(&motion, 0.0).is_err());
    assert!(Sampled::at_rate(&motion, 1e9).is_err());
}

#[test]
fn series_that_do_not_belong_together_are_refused() {
    assert!(Fourier::plain(1.0, 0.0, vec![1.0], vec![]).is_err());
    assert!(Fourier::plain(0.0, 0.0, vec![], vec![]).is_err());
    assert!(Fourier::velocity_amplitudes(1.0, 0.0, &[f64::NAN], &[0.0]).is_err());
    let still = Fourier::plain(1.0, 0.4, vec![], vec![]).unwrap();
    assert_eq!(still.at(3.0), Point::rest(0.4));
    let extremes = still.extremes();
    assert_eq!((extremes.low.value, extremes.high.value), (0.4, 0.4));
    let other = Fourier::plain(1.1, 0.4, vec![], vec![]).unwrap();
    assert!(matches!(
        FourierTrajectory::new(vec![still.clone(), other], 1).unwrap_err(),
        TrajectoryError::BaseFrequency { coordinate: 1, expected: 1.0, found: 1.1 }
    ));
    assert!(FourierTrajectory::new(vec![still], 0).is_err());
    assert!(FourierTrajectory::new(vec![], 1).is_err());
    let order = RowOrder::default();
    assert!(
        FourierTrajectory::from_rows(1.0, Form::Plain, &order, &[vec![0.0; 11], vec![0.0; 9]], 1).is_err()
    );
}
