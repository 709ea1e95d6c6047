//! Settings under `[estimator]`, and robot files that cannot serve as a prior.

use super::harness::{RUN, case, check, config, robot};

fn estimator(keys: &str) -> String {
    config(&format!("[estimator]\n{keys}\n"))
}

#[test]
fn names_are_refused() {
    check(&[
        case(
            "bad.toml",
            estimator("method = \"lasso\""),
            RUN,
            &["bad.toml:6", "`lasso`", "`wls`", "`tls`"],
            "",
        ),
        case(
            "bad.toml",
            estimator("consistency = \"spatial\""),
            RUN,
            &["bad.toml:6", "`spatial`", "`spatial-inertia`"],
            "",
        ),
        case("bad.toml", estimator("prior = \"cubic\""), RUN, &["bad.toml:6", "`cubic`", "`entropic`"], ""),
        case(
            "bad.toml",
            estimator("variances = \"log\""),
            RUN,
            &["bad.toml:6", "`log`", "`joint-and-log`"],
            "",
        ),
        case("bad.toml", estimator("weight = 1"), RUN, &["bad.toml:6", "`weight`", "`ridge_weight`"], ""),
    ]);
}

#[test]
fn weights_are_refused() {
    let ridge = |weight: &str| estimator(&format!("method = \"ridge\"\nridge_weight = {weight}"));
    let prior = |weight: &str| estimator(&format!("prior_weight = {weight}"));
    check(&[
        case(
            "bad.toml",
            ridge("0"),
            RUN,
            &["bad.toml", "`ridge_weight`", "positive", "found 0"],
            "leave it out",
        ),
        case("bad.toml", ridge("-1"), RUN, &["`ridge_weight`", "positive", "found -1"], "leave it out"),
        case("bad.toml", ridge("nan"), RUN, &["`ridge_weight`", "positive", "found NaN"], "leave it out"),
        case(
            "bad.toml",
            prior("0"),
            RUN,
            &["bad.toml", "`prior_weight`", "positive", "found 0"],
            "leave it out",
        ),
        case("bad.toml", prior("-0.5"), RUN, &["`prior_weight`", "positive", "found -0.5"], "leave it out"),
        case("bad.toml", prior("inf"), RUN, &["`prior_weight`", "positive", "found inf"], "leave it out"),
    ]);
}

#[test]
fn total_least_squares_without_its_noise_is_refused() {
    let tls = |keys: &str| estimator(&format!("method = \"tls\"\n{keys}"));
    check(&[
        case("bad.toml", tls(""), RUN, &["bad.toml", "`effort_noise`", "`tls` needs"], "[estimator]"),
        case("bad.toml", tls("effort_noise = 0"), RUN, &["`effort_noise`", "positive", "0"], "[estimator]"),
        case(
            "bad.toml",
            tls("effort_noise = 0.1\ncolumn_noise = { \"forearm.mz\" = -1 }"),
            RUN,
            &["bad.toml", "`column_noise.forearm.mz`", "not negative", "-1"],
            "standard deviation",
        ),
        case(
            "bad.toml",
            tls("effort_noise = 0.1\ncolumn_noise = { \"forearm.mzz\" = 1 }"),
            RUN,
            &["no parameter", "`forearm.mzz`", "did you mean `forearm.mz`?"],
            "dynid inspect",
        ),
        // It acts only as part of the first moment and inertia of the upper arm.
        case(
            "bad.toml",
            tls("effort_noise = 0.1\ncolumn_noise = { \"forearm.m\" = 1 }"),
            RUN,
            &["`column_noise.forearm.m`", "base parameter", "only together with others"],
            "dynid inspect",
        ),
        // It acts on no effort at all.
        case(
            "bad.toml",
            tls("effort_noise = 0.1\ncolumn_noise = { \"upper_arm.m\" = 1 }"),
            RUN,
            &["`column_noise.upper_arm.m`", "base parameter", "not at all"],
            "dynid inspect",
        ),
    ]);
}

#[test]
fn combinations_are_refused() {
    let bounded = "[[bound]]\nlinks = [\"forearm\"]\nmass = [1, 2]";
    check(&[
        case(
            "bad.toml",
            estimator("prior = \"entropic\"\nconsistency = \"spatial-inertia\""),
            RUN,
            &["bad.toml", "`prior`", "`quadratic`", "`entropic`"],
            "pseudo-inertia",
        ),
        case(
            "bad.toml",
            estimator("prior = \"entropic\""),
            "identify bad.toml --consistency spatial-inertia",
            &["`prior`", "`quadratic`", "`entropic`"],
            "pseudo-inertia",
        ),
        case(
            "bad.toml",
            estimator(&format!("consistency = \"none\"\n{bounded}")),
            RUN,
            &["bad.toml", "`consistency`", "bounds", "`none`"],
            "drop the bounds",
        ),
        case(
            "bad.toml",
            config(&format!("{bounded}\n")),
            "identify bad.toml --consistency none",
            &["`consistency`", "bounds", "`none`"],
            "drop the bounds",
        ),
        // Noise that large leaves nothing of the column that could bear on the effort.
        case(
            "bad.toml",
            estimator("method = \"tls\"\neffort_noise = 0.1\ncolumn_noise = { \"forearm.mz\" = 1e15 }"),
            RUN,
            &["estimator: ", "total least squares"],
            "column_noise",
        ),
    ]);
}

#[test]
fn robot_files_that_are_no_prior_are_refused() {
    let by_flags = "identify bad.urdf --log log.csv --out out";
    let negative = || robot("<mass value=\"3\"/>", "<mass value=\"-3\"/>");
    check(&[
        case(
            "bad.urdf",
            negative(),
            by_flags,
            &["bad.urdf", "link `upper_arm`", "at least 0", "-3 kg"],
            "correct the mass",
        ),
        case(
            "bad.urdf",
            negative(),
            "identify bad.urdf --log log.csv --consistency none --estimator ols --out out",
            &["bad.urdf", "link `upper_arm`", "at least 0", "-3 kg"],
            "correct the mass",
        ),
        case(
            "bad.urdf",
            robot("<mass value=\"3\"/>", "<mass value=\"inf\"/>"),
            by_flags,
            &["bad.urdf:", "upper_arm", "mass", "`inf`"],
            "",
        ),
    ]);
}
