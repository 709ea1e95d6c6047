//! Linear-regression sets of the NIST Statistical Reference Datasets through the reduction and least squares.
//!
//! Data and certified values: NIST/ITL StRD (<https://www.itl.nist.gov/div898/strd/>), a work of the United States
//! Government in the public domain. The tables were checked by solving each problem in rational arithmetic:
//! all certified values agree to the digits NIST gives.
#![expect(clippy::unwrap_used, clippy::print_stdout, reason = "in tests a panic is the report")]

use dynid_estimate::FactorBuilder;
use dynid_estimate::linear::ols;

enum Model {
    /// `y = b0 + b1 x1 + ...`
    Intercept,
    /// `y = b1 x1 + ...`
    NoIntercept,
    /// `y = b0 + b1 x + ... + bd x^d`
    Polynomial(i32),
}

impl Model {
    fn row(&self, predictors: &[f64]) -> Vec<f64> {
        match self {
            Model::Intercept => std::iter::once(1.0).chain(predictors.iter().copied()).collect(),
            Model::NoIntercept => predictors.to_vec(),
            Model::Polynomial(degree) => (0..=*degree).map(|k| predictors[0].powi(k)).collect(),
        }
    }
}

struct Dataset {
    model: Model,
    predictors_per_row: usize,
    x: Vec<f64>,
    y: &'static [f64],
    certified: &'static [f64],
    certified_std: &'static [f64],
    residual_std: f64,
}

/// Requires `digits` agreeing digits, `-log10` of the relative deviation, of every certified figure.
#[track_caller]
fn check(data: &Dataset, digits: f64) {
    let p = data.certified.len();
    let mut builder = FactorBuilder::new(p);
    for (predictors, &y) in data.x.chunks(data.predictors_per_row).zip(data.y) {
        builder.push_row(&data.model.row(predictors), y).unwrap();
    }
    let factor = builder.finish();
    assert_eq!(factor.rows(), data.y.len());
    let solution = ols(&factor);
    assert!(solution.rank.is_full(), "{:?}", solution.rank);

    let tolerance = 10_f64.powf(-digits);
    let agreeing = |found: f64, certified: f64| -((found / certified - 1.0).abs().max(1e-16)).log10();
    let worst = solution.x.iter().zip(data.certified).map(|(f, c)| agreeing(*f, *c)).fold(16.0, f64::min);
    println!("{worst:.2} digits, scaled condition {:.1e}", solution.condition_scaled);
    for (found, certified) in solution.x.iter().zip(data.certified) {
        let found_digits = agreeing(*found, *certified);
        assert!(found_digits >= digits, "{found} against {certified}: {found_digits:.2} digits");
    }
    let variance = solution.residual_variance().unwrap();
    if data.residual_std > 0.0 {
        assert!(agreeing(variance.sqrt(), data.residual_std) >= digits.min(9.0), "{}", variance.sqrt());
        for (std, certified) in solution.standard_deviations(variance).iter().zip(data.certified_std) {
            let std = std.unwrap();
            assert!(agreeing(std, *certified) >= digits, "{std} against {certified}");
        }
    } else {
        // An exact fit leaves only rounding of the efforts.
        let size = data.y.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
        assert!(variance.sqrt() <= tolerance * size, "{}", variance.sqrt());
        assert!(data.certified_std.iter().all(|s| *s == 0.0));
    }
}

fn wampler(
    y: &'static [f64],
    certified: &'static [f64],
    certified_std: &'static [f64],
    residual_std: f64,
) -> Dataset {
    Dataset {
        model: Model::Polynomial(5),
        predictors_per_row: 1,
        x: (0..21).map(f64::from).collect(),
        y,
        certified,
        certified_std,
        residual_std,
    }
}

#[test]
fn norris() {
    let data = Dataset {
        model: Model::Intercept,
        predictors_per_row: 1,
        x: NORRIS_X.to_vec(),
        y: NORRIS_Y,
        certified: NORRIS_BETA,
        certified_std: NORRIS_STD,
        residual_std: 0.884796396144373,
    };
    check(&data, 9.0);
}

#[test]
fn pontius() {
    let data = Dataset {
        model: Model::Polynomial(2),
        predictors_per_row: 1,
        x: (0..40).map(|i| 150_000.0 * f64::from(i % 20 + 1)).collect(),
        y: PONTIUS_Y,
        certified: PONTIUS_BETA,
        certified_std: PONTIUS_STD,
        residual_std: 0.205177424076185e-3,
    };
    check(&data, 9.0);
}

#[test]
fn longley() {
    let data = Dataset {
        model: Model::Intercept,
        predictors_per_row: 6,
        x: LONGLEY_X.to_vec(),
        y: LONGLEY_Y,
        certified: LONGLEY_BETA,
        certified_std: LONGLEY_STD,
        residual_std: 304.854073561965,
    };
    check(&data, 9.0);
}

#[test]
fn filip() {
    let data = Dataset {
        model: Model::Polynomial(10),
        predictors_per_row: 1,
        x: FILIP_X.to_vec(),
        y: FILIP_Y,
        certified: FILIP_BETA,
        certified_std: FILIP_STD,
        residual_std: 0.334801051324544e-2,
    };
    check(&data, 7.0);
}

#[test]
fn no_intercept_1() {
    let data = Dataset {
        model: Model::NoIntercept,
        predictors_per_row: 1,
        x: NOINT1_X.to_vec(),
        y: NOINT1_Y,
        certified: NOINT1_BETA,
        certified_std: NOINT1_STD,
        residual_std: 3.56753034006338,
    };
    check(&data, 9.0);
}

#[test]
fn no_intercept_2() {
    let data = Dataset {
        model: Model::NoIntercept,
        predictors_per_row: 1,
        x: NOINT2_X.to_vec(),
        y: NOINT2_Y,
        certified: NOINT2_BETA,
        certified_std: NOINT2_STD,
        residual_std: 0.369274472937998,
    };
    check(&data, 9.0);
}

#[test]
fn wampler_1() {
    check(&wampler(WAMPLER1_Y, WAMPLER1_BETA, WAMPLER1_STD, 0.0), 9.0);
}

#[test]
fn wampler_2() {
    check(&wampler(WAMPLER2_Y, WAMPLER2_BETA, WAMPLER2_STD, 0.0), 9.0);
}

#[test]
fn wampler_3() {
    check(&wampler(WAMPLER3_Y, WAMPLER3_BETA, WAMPLER3_STD, 2360.14502379268), 9.0);
}

/// Residuals are 1e5 times the constant to be found: rounding the efforts at `ε ‖y‖ = 2e-10` alone, amplified by a
/// scaled condition number of 2e3, costs the ninth digit of any reduction in double precision.
#[test]
fn wampler_4() {
    check(&wampler(WAMPLER4_Y, WAMPLER4_BETA, WAMPLER4_STD, 236014.502379268), 7.0);
}

/// As [`wampler_4`], with residuals 1e7 times the constant.
#[test]
fn wampler_5() {
    check(&wampler(WAMPLER5_Y, WAMPLER5_BETA, WAMPLER5_STD, 23601450.2379268), 5.0);
}

const NORRIS_Y: &[f64] = &[
    0.1, 338.8, 118.1, 888.0, 9.2, 228.1, 668.5, 998.5, 449.1, 778.9, 559.2, 0.3, 0.1, 778.1, 668.8, 339.3,
    448.9, 10.8, 557.7, 228.3, 998.0, 888.8, 119.6, 0.3, 0.6, 557.6, 339.3, 888.0, 998.5, 778.9, 10.2, 117.6,
    228.9, 668.4, 449.2, 0.2,
];
const NORRIS_X: &[f64] = &[
    0.2, 337.4, 118.2, 884.6, 10.1, 226.5, 666.3, 996.3, 448.6, 777.0, 558.2, 0.4, 0.6, 775.5, 666.9, 338.0,
    447.5, 11.6, 556.0, 228.1, 995.8, 887.6, 120.2, 0.3, 0.3, 556.8, 339.1, 887.2, 999.0, 779.0, 11.1, 118.3,
    229.2, 669.1, 448.9, 0.5,
];
const NORRIS_BETA: &[f64] = &[-0.262323073774029, 1.00211681802045];
const NORRIS_STD: &[f64] = &[0.232818234301152, 0.429796848199937e-03];

const PONTIUS_Y: &[f64] = &[
    0.11019, 0.21956, 0.32949, 0.43899, 0.54803, 0.65694, 0.76562, 0.87487, 0.98292, 1.09146, 1.20001,
    1.30822, 1.41599, 1.52399, 1.63194, 1.73947, 1.84646, 1.95392, 2.06128, 2.16844, 0.11052, 0.22018,
    0.32939, 0.43886, 0.54798, 0.65739, 0.76596, 0.87474, 0.98300, 1.09150, 1.20004, 1.30818, 1.41613,
    1.52408, 1.63159, 1.73965, 1.84696, 1.95445, 2.06177, 2.16829,
];
const PONTIUS_BETA: &[f64] = &[0.673565789473684e-03, 0.732059160401003e-06, -0.316081871345029e-14];
const PONTIUS_STD: &[f64] = &[0.107938612033077e-03, 0.157817399981659e-09, 0.486652849992036e-16];

const LONGLEY_Y: &[f64] = &[
    60323.0, 61122.0, 60171.0, 61187.0, 63221.0, 63639.0, 64989.0, 63761.0, 66019.0, 67857.0, 68169.0,
    66513.0, 68655.0, 69564.0, 69331.0, 70551.0,
];
const LONGLEY_X: &[f64] = &[
    83.0, 234289.0, 2356.0, 1590.0, 107608.0, 1947.0, 88.5, 259426.0, 2325.0, 1456.0, 108632.0, 1948.0, 88.2,
    258054.0, 3682.0, 1616.0, 109773.0, 1949.0, 89.5, 284599.0, 3351.0, 1650.0, 110929.0, 1950.0, 96.2,
    328975.0, 2099.0, 3099.0, 112075.0, 1951.0, 98.1, 346999.0, 1932.0, 3594.0, 113270.0, 1952.0, 99.0,
    365385.0, 1870.0, 3547.0, 115094.0, 1953.0, 100.0, 363112.0, 3578.0, 3350.0, 116219.0, 1954.0, 101.2,
    397469.0, 2904.0, 3048.0, 117388.0, 1955.0, 104.6, 419180.0, 2822.0, 2857.0, 118734.0, 1956.0, 108.4,
    442769.0, 2936.0, 2798.0, 120445.0, 1957.0, 110.8, 444546.0, 4681.0, 2637.0, 121950.0, 1958.0, 112.6,
    482704.0, 3813.0, 2552.0, 123366.0, 1959.0, 114.2, 502601.0, 3931.0, 2514.0, 125368.0, 1960.0, 115.7,
    518173.0, 4806.0, 2572.0, 127852.0, 1961.0, 116.9, 554894.0, 4007.0, 2827.0, 130081.0, 1962.0,
];
const LONGLEY_BETA: &[f64] = &[
    -3482258.63459582,
    15.0618722713733,
    -0.358191792925910e-01,
    -2.02022980381683,
    -1.03322686717359,
    -0.511041056535807e-01,
    1829.15146461355,
];
const LONGLEY_STD: &[f64] = &[
    890420.383607373,
    84.9149257747669,
    0.334910077722432e-01,
    0.488399681651699,
    0.214274163161675,
    0.226073200069370,
    455.478499142212,
];

const WAMPLER1_Y: &[f64] = &[
    1.0, 6.0, 63.0, 364.0, 1365.0, 3906.0, 9331.0, 19608.0, 37449.0, 66430.0, 111111.0, 177156.0, 271453.0,
    402234.0, 579195.0, 813616.0, 1118481.0, 1508598.0, 2000719.0, 2613660.0, 3368421.0,
];
const WAMPLER1_BETA: &[f64] = &[1.0, 1.0, 1.0, 1.0, 1.0, 1.0];
const WAMPLER1_STD: &[f64] = &[0.0, 0.0, 0.0, 0.0, 0.0, 0.0];

const WAMPLER2_Y: &[f64] = &[
    1.00000, 1.11111, 1.24992, 1.42753, 1.65984, 1.96875, 2.38336, 2.94117, 3.68928, 4.68559, 6.00000,
    7.71561, 9.92992, 12.75603, 16.32384, 20.78125, 26.29536, 33.05367, 41.26528, 51.16209, 63.00000,
];
const WAMPLER2_BETA: &[f64] = &[1.0, 0.1, 0.01, 0.001, 0.0001, 0.00001];
const WAMPLER2_STD: &[f64] = &[0.0, 0.0, 0.0, 0.0, 0.0, 0.0];

const WAMPLER3_Y: &[f64] = &[
    760.0, -2042.0, 2111.0, -1684.0, 3888.0, 1858.0, 11379.0, 17560.0, 39287.0, 64382.0, 113159.0, 175108.0,
    273291.0, 400186.0, 581243.0, 811568.0, 1121004.0, 1506550.0, 2002767.0, 2611612.0, 3369180.0,
];
const WAMPLER3_BETA: &[f64] = &[1.0, 1.0, 1.0, 1.0, 1.0, 1.0];
const WAMPLER3_STD: &[f64] = &[
    2152.32624678170,
    2363.55173469681,
    779.343524331583,
    101.475507550350,
    5.64566512170752,
    0.112324854679312,
];

const WAMPLER4_Y: &[f64] = &[
    75901.0, -204794.0, 204863.0, -204436.0, 253665.0, -200894.0, 214131.0, -185192.0, 221249.0, -138370.0,
    315911.0, -27644.0, 455253.0, 197434.0, 783995.0, 608816.0, 1370781.0, 1303798.0, 2205519.0, 2408860.0,
    3444321.0,
];
const WAMPLER4_BETA: &[f64] = &[1.0, 1.0, 1.0, 1.0, 1.0, 1.0];
const WAMPLER4_STD: &[f64] = &[
    215232.624678170,
    236355.173469681,
    77934.3524331583,
    10147.5507550350,
    564.566512170752,
    11.2324854679312,
];

const WAMPLER5_Y: &[f64] = &[
    7590001.0,
    -20479994.0,
    20480063.0,
    -20479636.0,
    25231365.0,
    -20476094.0,
    20489331.0,
    -20460392.0,
    18417449.0,
    -20413570.0,
    20591111.0,
    -20302844.0,
    18651453.0,
    -20077766.0,
    21059195.0,
    -19666384.0,
    26348481.0,
    -18971402.0,
    22480719.0,
    -17866340.0,
    10958421.0,
];
const WAMPLER5_BETA: &[f64] = &[1.0, 1.0, 1.0, 1.0, 1.0, 1.0];
const WAMPLER5_STD: &[f64] = &[
    21523262.4678170,
    23635517.3469681,
    7793435.24331583,
    1014755.07550350,
    56456.6512170752,
    1123.24854679312,
];

const FILIP_Y: &[f64] = &[
    0.8116, 0.9072, 0.9052, 0.9039, 0.8053, 0.8377, 0.8667, 0.8809, 0.7975, 0.8162, 0.8515, 0.8766, 0.8885,
    0.8859, 0.8959, 0.8913, 0.8959, 0.8971, 0.9021, 0.909, 0.9139, 0.9199, 0.8692, 0.8872, 0.89, 0.891,
    0.8977, 0.9035, 0.9078, 0.7675, 0.7705, 0.7713, 0.7736, 0.7775, 0.7841, 0.7971, 0.8329, 0.8641, 0.8804,
    0.7668, 0.7633, 0.7678, 0.7697, 0.77, 0.7749, 0.7796, 0.7897, 0.8131, 0.8498, 0.8741, 0.8061, 0.846,
    0.8751, 0.8856, 0.8919, 0.8934, 0.894, 0.8957, 0.9047, 0.9129, 0.9209, 0.9219, 0.7739, 0.7681, 0.7665,
    0.7703, 0.7702, 0.7761, 0.7809, 0.7961, 0.8253, 0.8602, 0.8809, 0.8301, 0.8664, 0.8834, 0.8898, 0.8964,
    0.8963, 0.9074, 0.9119, 0.9228,
];
const FILIP_X: &[f64] = &[
    -6.860120914,
    -4.324130045,
    -4.358625055,
    -4.358426747,
    -6.955852379,
    -6.661145254,
    -6.355462942,
    -6.118102026,
    -7.115148017,
    -6.815308569,
    -6.519993057,
    -6.204119983,
    -5.853871964,
    -6.109523091,
    -5.79832982,
    -5.482672118,
    -5.171791386,
    -4.851705903,
    -4.517126416,
    -4.143573228,
    -3.709075441,
    -3.499489089,
    -6.300769497,
    -5.953504836,
    -5.642065153,
    -5.031376979,
    -4.680685696,
    -4.329846955,
    -3.928486195,
    -8.56735134,
    -8.363211311,
    -8.107682739,
    -7.823908741,
    -7.522878745,
    -7.218819279,
    -6.920818754,
    -6.628932138,
    -6.323946875,
    -5.991399828,
    -8.781464495,
    -8.663140179,
    -8.473531488,
    -8.247337057,
    -7.971428747,
    -7.676129393,
    -7.352812702,
    -7.072065318,
    -6.774174009,
    -6.478861916,
    -6.159517513,
    -6.835647144,
    -6.53165267,
    -6.224098421,
    -5.910094889,
    -5.598599459,
    -5.290645224,
    -4.974284616,
    -4.64454848,
    -4.290560426,
    -3.885055584,
    -3.408378962,
    -3.13200249,
    -8.726767166,
    -8.66695597,
    -8.511026475,
    -8.165388579,
    -7.886056648,
    -7.588043762,
    -7.283412422,
    -6.995678626,
    -6.691862621,
    -6.392544977,
    -6.067374056,
    -6.684029655,
    -6.378719832,
    -6.065855188,
    -5.752272167,
    -5.132414673,
    -4.811352704,
    -4.098269308,
    -3.66174277,
    -3.2644011,
];
const FILIP_BETA: &[f64] = &[
    -1467.48961422980,
    -2772.17959193342,
    -2316.37108160893,
    -1127.97394098372,
    -354.478233703349,
    -75.1242017393757,
    -10.8753180355343,
    -1.06221498588947,
    -0.670191154593408e-01,
    -0.246781078275479e-02,
    -0.402962525080404e-04,
];
const FILIP_STD: &[f64] = &[
    298.084530995537,
    559.779865474950,
    466.477572127796,
    227.204274477751,
    71.6478660875927,
    15.2897178747400,
    2.23691159816033,
    0.221624321934227,
    0.142363763154724e-01,
    0.535617408889821e-03,
    0.896632837373868e-05,
];

const NOINT1_Y: &[f64] = &[130.0, 131.0, 132.0, 133.0, 134.0, 135.0, 136.0, 137.0, 138.0, 139.0, 140.0];
const NOINT1_X: &[f64] = &[60.0, 61.0, 62.0, 63.0, 64.0, 65.0, 66.0, 67.0, 68.0, 69.0, 70.0];
const NOINT1_BETA: &[f64] = &[2.07438016528926];
const NOINT1_STD: &[f64] = &[0.165289256198347e-01];

const NOINT2_Y: &[f64] = &[3.0, 4.0, 4.0];
const NOINT2_X: &[f64] = &[4.0, 5.0, 6.0];
const NOINT2_BETA: &[f64] = &[0.727272727272727];
const NOINT2_STD: &[f64] = &[0.420827318078432e-01];
