//! Fixtures from SciPy 1.17 (`butter`, `cheby1`, `sosfiltfilt`, `decimate`, `welch`), all on the signal of [`source`].

use dynid_motion::filter::{
    Alignment, Sections, anti_alias, butterworth, chebyshev, decimate, forward_backward, pick,
};
use dynid_motion::spectrum::{velocity_noise, welch};

fn source(samples: usize) -> Vec<f64> {
    (0..samples).map(|n| n as f64).map(|k| (0.05 * k).sin() + 0.3 * (0.9 * k).cos() + 0.01 * k).collect()
}

#[track_caller]
fn check(found: &[f64], expected: &[f64], relative: f64) {
    assert_eq!(found.len(), expected.len());
    for (n, (found, expected)) in found.iter().zip(expected).enumerate() {
        let tolerance = relative * expected.abs();
        assert!((found - expected).abs() <= tolerance, "{n}: {found} instead of {expected}");
    }
}

/// Poles and gain are products of a few rounded numbers; 1e-12 is some thousand roundings.
#[track_caller]
fn check_sections(found: &Sections, expected: &[[f64; 5]]) {
    let found: Vec<f64> = found.as_slice().iter().flat_map(|s| s.b.into_iter().chain(s.a)).collect();
    check(&found, expected.as_flattened(), 1e-12);
}

#[test]
fn butterworth_sections() {
    check_sections(
        &butterworth(2, 30.0, 100.0).unwrap(),
        &[[
            0.39133577250176854,
            0.7826715450035371,
            0.39133577250176854,
            0.3695273773512411,
            0.19581571265583297,
        ]],
    );
    check_sections(
        &butterworth(4, 10.0, 1000.0).unwrap(),
        &[
            [
                8.984861463970648e-07,
                1.7969722927941296e-06,
                8.984861463970648e-07,
                -1.8866095826215064,
                0.8903397362840242,
            ],
            [1.0, 2.0, 1.0, -1.9492159580258417, 0.9530698953278909],
        ],
    );
    check_sections(
        &butterworth(8, 5.0, 250.0).unwrap(),
        &[
            [
                1.778379388073475e-10,
                3.55675877614695e-10,
                1.778379388073475e-10,
                -1.7670186514632635,
                0.7810628641245774,
            ],
            [1.0, 2.0, 1.0, -1.796966165642348, 0.8112484002721682],
            [1.0, 2.0, 1.0, -1.8550590203998147, 0.8698029753434761],
            [1.0, 2.0, 1.0, -1.9368704016430212, 0.9522645910566718],
        ],
    );
}

#[test]
fn chebyshev_sections() {
    check_sections(
        &chebyshev(8, 0.05, 0.08, 2.0).unwrap(),
        &[
            [
                3.5863243209995223e-09,
                7.172648641999045e-09,
                3.5863243209995223e-09,
                -1.8204968644767618,
                0.8308597403796137,
            ],
            [1.0, 2.0, 1.0, -1.8289505620176847, 0.8553173710387741],
            [1.0, 2.0, 1.0, -1.8517334482627625, 0.9015161055713813],
            [1.0, 2.0, 1.0, -1.8965395961864169, 0.9644245584642932],
        ],
    );
}

#[test]
fn zero_phase_butterworth() {
    let filter = butterworth(4, 5.0, 100.0).unwrap();
    let long = forward_backward(&filter, &source(60)).unwrap();
    check(
        &pick(&long, 6, 0),
        &[
            0.3095028411468355,
            0.3491782305765674,
            0.6474367344434048,
            0.9737614290141311,
            1.1805469529798824,
            1.2965588354582926,
            1.3230444905738088,
            1.2790793601848185,
            1.2006460553296836,
            0.9340705307297731,
        ],
        1e-11,
    );
    let shortest = forward_backward(&filter, &source(16)).unwrap();
    check(
        &pick(&shortest, 3, 0),
        &[
            0.30476957625682255,
            0.27403238487154347,
            0.3142256681601961,
            0.4685565646663919,
            0.725597164922386,
            1.028399862071157,
        ],
        1e-11,
    );
    assert!(forward_backward(&filter, &source(15)).is_err());
}

/// At a cut-off of 0.08 of Nyquist order 8 amplifies rounding of the sections by some 1e4.
#[test]
fn decimation() {
    check(
        &decimate(&source(60), 5, Alignment::First).unwrap(),
        &[
            0.2975570029263504,
            0.2179335575305805,
            0.5995933607218218,
            0.8218659653349861,
            1.0238410448867783,
            1.199429601317489,
            1.2834672726663074,
            1.3216824313391025,
            1.313788550866783,
            1.2023730202053549,
            1.0993961305990427,
            0.9528717391252509,
        ],
        1e-10,
    );
    check(
        &pick(&decimate(&source(300), 10, Alignment::First).unwrap(), 3, 0),
        &[
            0.29472947784552866,
            1.2921173093133176,
            0.7234590543680073,
            -0.08573973193092893,
            0.9094815778948936,
            2.4200141192629054,
            2.191097614930318,
            1.1960159249990436,
            1.8339642911468892,
            3.473484947551835,
        ],
        1e-10,
    );
    assert_eq!(decimate(&source(5), 1, Alignment::First).unwrap(), source(5));
    assert!(decimate(&source(27), 2, Alignment::First).is_err());
    assert!(decimate(&source(60), 0, Alignment::First).is_err());
    let smooth = anti_alias(&source(60), 7).unwrap();
    let last = decimate(&source(60), 7, Alignment::Last).unwrap();
    assert_eq!((last.len(), last[8]), (9, smooth[59]));
}

/// The weakest bins are 1e-7 of the strongest, whose rounding leaks into them.
#[test]
fn welch_density() {
    let even = welch(&source(200), 100.0, 32).unwrap();
    assert_eq!(even.frequency[..3], [0.0, 3.125, 6.25]);
    check(
        &even.density,
        &[
            0.0005950751902314009,
            0.008123417552491095,
            0.0005075664588375219,
            0.00018477980422888999,
            0.006121905623372973,
            0.007661211379890986,
            0.0004465987869285997,
            6.701716056384461e-06,
            7.17662650811647e-07,
            1.531095865182815e-07,
            4.707559487427136e-08,
            1.789326286064023e-08,
            7.667074093458633e-09,
            3.475060473639927e-09,
            1.599290350258745e-09,
            7.735661641925072e-10,
            2.6894059664370095e-10,
        ],
        1e-9,
    );
    let odd = welch(&source(100), 50.0, 25).unwrap();
    check(
        &odd.density,
        &[
            0.00014388513720053978,
            0.006326251323040849,
            0.0009464464068708265,
            0.009110029531952418,
            0.012169892260140758,
            0.0006598237676658539,
            8.507347828415691e-06,
            7.376344470374515e-07,
            1.2707019089196994e-07,
            3.334025519283852e-08,
            1.2178815088135105e-08,
            6.071984334443192e-09,
            4.220814127794277e-09,
        ],
        1e-9,
    );
}

/// The integral of x^2 / (1 + x^8)^2 over the half line is B(3/8, 13/8) / 8.
#[test]
fn velocity_noise_in_closed_form() {
    let (floor, cutoff) = (3e-12, 8.0f64);
    let expected = (floor * std::f64::consts::TAU.powi(2) * cutoff.powi(3) * 0.26565901443292783).sqrt();
    let found = velocity_noise(floor, 4, cutoff, 1000.0).unwrap();
    assert!((found / expected - 1.0).abs() < 1e-7, "{found} {expected}");
    assert_eq!(velocity_noise(0.0, 4, cutoff, 1000.0).unwrap(), 0.0);
    assert!(velocity_noise(floor, 4, 600.0, 1000.0).is_err());
    assert!(velocity_noise(-1.0, 4, cutoff, 1000.0).is_err());
}
