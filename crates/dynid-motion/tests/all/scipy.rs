//! Fixtures from SciPy 1.17 (`butter`, `cheby1`, `sosfiltfilt`, `decimate`, `welch`, `savgol_filter`, `savgol_coeffs`), all on the signal of [`source`].

use dynid_motion::filter::{
    Alignment, Sections, anti_alias, butterworth, chebyshev, decimate, forward_backward, pick,
};
use dynid_motion::savitzky_golay::SavitzkyGolay;
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

/// `savgol_filter(x, window, order, deriv, delta=1/50)`: sums of some ten products, whose rounding the derivatives magnify by the rate.
#[test]
fn savitzky_golay_filters() {
    let source = source(24);
    let cases: [(usize, usize, usize, &[f64]); 3] = [
        (
            7,
            3,
            0,
            &[
                0.324918731197457,
                0.19106745486998142,
                0.05172205272675151,
                -0.03640814321309899,
                0.024569064468129953,
                0.2470761144244344,
                0.5070513935645234,
                0.6516116483641997,
                0.6146602694360104,
                0.46681856661484133,
                0.36189326428799035,
                0.420392768468582,
                0.6382449870393985,
                0.8897974464635079,
                1.022829480308113,
                0.9736733572259326,
                0.815323164909179,
                0.7021237896907283,
                0.7528984456583417,
                0.9609616775254085,
                1.1991183625169173,
                1.359971332689117,
                1.3396931880042233,
                1.038350606040253,
            ],
        ),
        (
            9,
            4,
            1,
            &[
                3.0883646440174983,
                -8.443874807686324,
                -8.642770807871093,
                -1.9339729900947549,
                7.256869012084664,
                12.435823324770865,
                10.40905651283314,
                2.6847852428520937,
                -4.921518774985498,
                -6.688086595461974,
                -1.3168863960392958,
                7.084149076577253,
                12.110031877517851,
                9.906004151977452,
                2.0848701773665126,
                -5.493403888909382,
                -7.156248320326869,
                -1.71122123890947,
                6.651740024423221,
                11.531353056449149,
                10.908221534823198,
                5.095637628295818,
                -6.783674149184432,
                -25.606989283669012,
            ],
        ),
        (
            11,
            3,
            2,
            &[
                605.7421369916668,
                486.77281758912824,
                367.80349818658954,
                248.8341787840509,
                129.86485938151228,
                10.895539978973515,
                -39.2747211815318,
                -61.108572060698805,
                -38.304778678718705,
                11.661033112088028,
                50.76212817927426,
                49.19907103796885,
                7.951865685258689,
                -41.961184776364064,
                -62.95701973280204,
                -39.329456801679726,
                10.8651399896208,
                49.472995165671136,
                47.1173571045702,
                -10.426018754930919,
                -67.96939461443219,
                -125.51277047393351,
                -183.05614633343487,
                -240.59952219293612,
            ],
        ),
    ];
    for (window, order, derivative, expected) in cases {
        let filter = SavitzkyGolay::new(window, order).unwrap();
        let found = filter.filter(&source, derivative, 50.0).unwrap();
        assert_eq!(found.len(), expected.len());
        let scale = expected.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
        for (n, (found, expected)) in found.iter().zip(expected).enumerate() {
            let tolerance = 1e-12 * scale;
            assert!((found - expected).abs() <= tolerance, "{n}: {found} instead of {expected}");
        }
    }
}

/// `savgol_coeffs(13, 5, deriv=2, use="dot")`.
#[test]
fn savitzky_golay_weights() {
    let found = SavitzkyGolay::new(13, 5).unwrap().weights(6, 2);
    check(
        &found,
        &[
            -0.03789592760181031,
            0.05090497737556623,
            0.06005758946935465,
            0.02766351295763021,
            -0.016642671054437078,
            -0.05169340463458307,
            -0.06478815302344931,
            -0.05169340463458298,
            -0.01664267105443699,
            0.02766351295763027,
            0.06005758946935462,
            0.05090497737556623,
            -0.0378959276018103,
        ],
        1e-11,
    );
}
