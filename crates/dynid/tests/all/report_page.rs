//! What the page of an identification says, beside the result file and the verdict in words.

#![expect(clippy::unwrap_used, reason = "a test may stop")]

use std::path::Path;

use dynid::Config;
use dynid::estimate::Estimate;
use dynid::{Run, identify};

const EXAMPLE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../examples/indy7/identify.toml");

/// Friction of the table, N m.
const COULOMB: f64 = 9.0;

fn all_of(config: &Config) -> (Run, Estimate, String) {
    let id = identify(config, &mut |_| {}).unwrap();
    let estimate = id.estimate();
    let page = id.report(&estimate).unwrap();
    (id, estimate, page)
}

/// The page without its styles and scripts.
fn shown(page: &str) -> String {
    let mut out = page.to_owned();
    for tag in ["style", "script"] {
        while let Some(start) = out.find(&format!("<{tag}")) {
            let end = out[start..].find(&format!("</{tag}>")).unwrap();
            out.replace_range(start..start + end + tag.len() + 3, "");
        }
    }
    out
}

#[track_caller]
fn cautions_have_remedies(estimate: &Estimate, page: &str) {
    let verdict = &estimate.verdict;
    for caution in &verdict.cautions {
        assert!(!caution.remedy.trim().is_empty() && !caution.message.is_empty(), "{caution:?}");
    }
    let fails: Vec<bool> = verdict.cautions.iter().map(|c| c.status.word() == "fail").collect();
    assert!(fails.windows(2).all(|p| p[0] >= p[1]), "failures come first: {:?}", verdict.cautions);
    assert_eq!(page.matches("<p class=\"remedy\">").count(), verdict.cautions.len());
    let said = match verdict.cautions.len() {
        0 => "None: every check passed".to_owned(),
        n => format!("<p class=\"note\">{n} in all"),
    };
    assert!(page.contains(&said), "{said}");
    let passed = verdict.checks.iter().filter(|c| c.status.word() == "ok").count();
    assert!(page.contains(&format!("{passed} of {} checks passed", verdict.checks.len())));
}

#[track_caller]
fn counts_agree(id: &Run, estimate: &Estimate, page: &str) {
    let counts = &estimate.counts;
    assert_eq!(*counts, id.counts());
    let seen = |verdict: &str| estimate.parameters.iter().filter(|p| p.verdict.word() == verdict).count();
    assert_eq!(counts.standard.all, estimate.parameters.len());
    assert_eq!(counts.standard.seen, seen("seen in the data"));
    assert_eq!(counts.standard.carried, seen("carried by the prior"));
    assert_eq!(counts.standard.not_identifiable, seen("not identifiable"));
    assert_eq!(counts.base.all, estimate.base_parameters.len());
    assert_eq!(counts.base.excited, estimate.base_parameters.iter().filter(|b| b.value.is_some()).count());
    let base_seen =
        estimate.base_parameters.iter().filter(|b| b.verdict.is_some_and(|v| v.word() == "seen in the data"));
    assert_eq!(counts.base.seen, base_seen.count());
    assert_eq!(counts.shape.all, estimate.shape_parameters.len());
    // The fit has a column for each of both kinds.
    assert_eq!(estimate.rank.structural, counts.base.all + counts.shape.all);
    let words = counts.base_in_words();
    assert_eq!(
        words,
        format!("{} of {} base parameters seen in the data", counts.base.seen, counts.base.all)
    );
    assert!(estimate.verdict.headline.starts_with(&estimate.verdict.line), "{}", estimate.verdict.headline);
    assert!(estimate.verdict.line.starts_with(&words), "{}", estimate.verdict.line);
    assert!(page.contains(&words), "{words}");
    let excitation = estimate.verdict.checks.iter().find(|c| c.name.word() == "excitation").unwrap();
    assert_eq!(excitation.value, Some(counts.base.excited as f64));
    assert_eq!(excitation.limit, format!("all {} base parameters", counts.base.all));
    assert!(page.contains(&format!(">all {}</button>", counts.standard.all)));
    assert!(page.contains(&format!(">seen {}</button>", counts.standard.seen)));
    assert!(page.contains(&format!("Any effort depends on {} combinations of them", counts.base.all)));
}

#[test]
fn the_first_screen_shows_unseen_data_and_all_counts_agree() {
    let config = Config::read(Path::new(EXAMPLE)).unwrap();
    let (id, estimate, page) = all_of(&config);
    counts_agree(&id, &estimate, &page);
    cautions_have_remedies(&estimate, &page);
    let first = page.split("<section id=\"first\"").nth(1).unwrap().split("</section>").next().unwrap();
    assert!(
        first.contains("Error per joint on unseen data") && first.contains("<b>valid.csv.gz</b>"),
        "{first}"
    );
    // Six joints, each with its error.
    let rows = first.split("<tbody>").nth(1).unwrap().split("</tbody>").next().unwrap();
    assert_eq!(rows.matches("<th scope=\"row\">j").count(), 6);
    let percent = estimate.validation[0].filtered.relative_error_per_joint[0].unwrap();
    assert!(rows.contains(&format!("{percent:.2} %")), "{percent} in {rows}");
    assert!(first.contains("effort in N\u{a0}m over time in s") && first.contains("class=\"measured\""));
    assert!(first.contains("<svg class=\"robot\"") && first.contains("Poses of train.csv.gz"));
    // The first screen needs no script: it stands before all of them but the data of the motion.
    assert!(!first.contains("<noscript>"));

    let shown = shown(&page);
    assert!(!shown.contains("{&quot;") && !shown.contains("&quot;:") && !shown.contains("[{"), "raw JSON");
    assert!(shown.contains("<td>estimator.method</td>") && shown.contains("<td>log.path</td>"));
    assert_eq!(page, all_of(&config).2, "the same run gives the same page");
}

/// A table that turns for twenty seconds and then stands, its angle measured with noise, with friction and an offset.
fn turntable(folder: &Path) -> Config {
    let robot = "schema = 1\nname = \"turntable\"\n\
        body = [{ name = \"table\", parent = \"ground\", mass = 20.0, com = [0.05, 0.0, 0.1], \
        inertia_com = [2.0, 2.0, 3.0, 0.0, 0.0, 0.0], joint = { name = \"j1\", kind = \"revolute\", axis = [0, 0, 1] } }]\n";
    std::fs::write(folder.join("turntable.toml"), robot).unwrap();
    let waves = [(0.9, 1.1), (0.35, 1.9), (0.08, 4.3)];
    let mut log = String::from("t,q1,tau1\n");
    let mut state = 1_u64;
    let mut noise = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
    };
    for k in 0..6000 {
        let t = 0.005 * f64::from(k);
        // A clock that slows down to nothing between 18 s and 20 s.
        let (s, ds, dds) = match t {
            t if t < 18.0 => (t, 1.0, 0.0),
            t if t < 20.0 => {
                let u = t - 18.0;
                (18.0 + u - u * u / 4.0, 1.0 - u / 2.0, -0.5)
            }
            _ => (19.0, 0.0, 0.0),
        };
        let sum = |f: &dyn Fn(f64, f64) -> f64| waves.iter().map(|(a, w)| f(*a, *w)).sum::<f64>();
        let q = sum(&|a, w| a * (w * s).sin());
        let dq = sum(&|a, w| a * w * (w * s).cos()) * ds;
        let ddq =
            sum(&|a, w| -a * w * w * (w * s).sin()) * ds * ds + sum(&|a, w| a * w * (w * s).cos()) * dds;
        let friction = if dq == 0.0 { 0.0 } else { COULOMB * dq.signum() + 2.0 * dq };
        log.push_str(&format!("{t},{},{}\n", q + 4e-5 * noise(), 3.05 * ddq + friction + 0.2 * noise()));
    }
    std::fs::write(folder.join("log.csv"), log).unwrap();
    let path = |name: &str| folder.join(name).display().to_string();
    let text = format!(
        "robot = \"{}\"\npreflight = \"warn\"\n[elements]\ndefault = [\"coulomb\", \"viscous\", \"offset\"]\nfriction = \"given\"\n\
         [[log]]\npath = \"{}\"\n",
        path("turntable.toml"),
        path("log.csv")
    );
    Config::parse(&text, "test").unwrap()
}

/// Largest step between neighbours.
fn jump(signal: &[f64]) -> f64 {
    signal.windows(2).map(|p| (p[1] - p[0]).abs()).fold(0.0, f64::max)
}

#[test]
fn the_predicted_curve_does_not_chatter_where_a_joint_stands() {
    let folder = tempfile::tempdir().unwrap();
    let config = turntable(folder.path());
    let (id, estimate, page) = all_of(&config);
    let log = &id.training[0];
    let drawn_curve = log.drawn(0).unwrap();
    let stands = 4200..5900;
    assert!(log.motion.samples[0][stands.clone()].iter().all(|moves| !moves), "the table stands");
    let (predicted, drawn) = (&log.predicted[0][stands.clone()], &drawn_curve[stands]);
    // The sign of noise turns friction round; the drawn curve has none, and what inertia makes of noise alone.
    assert!(jump(predicted) > COULOMB, "{}", jump(predicted));
    assert!(jump(drawn) < 0.1 * COULOMB, "{}", jump(drawn));
    // In motion both are the same but for the delay's interpolation near the places where motion ends.
    let moves = 0..3000;
    let differ =
        log.predicted[0][moves.clone()].iter().zip(&drawn_curve[moves]).filter(|(p, d)| p != d).count();
    let standing = log.motion.samples[0][..3000].iter().filter(|moves| !**moves).count();
    assert!(differ <= 200 * standing.max(1), "{differ} of {standing}");
    // Figures are those of the full prediction.
    let residual = |signal: &[f64]| {
        let counted = log.measured[0].iter().zip(signal).zip(&log.counted).filter(|(_, counts)| **counts);
        let squares: Vec<f64> = counted.map(|((m, p), _)| (m - p).powi(2)).collect();
        (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
    };
    let rms = estimate.fit.raw.rms[0].unwrap();
    assert!((rms / residual(&log.predicted[0]) - 1.0).abs() < 1e-9, "{rms}");
    assert!((rms / residual(&drawn_curve) - 1.0).abs() > 1e-3, "{rms}");
    assert!(page.contains("Where a joint stands, friction of velocity is left out of the predicted curve"));
    // Without a log that it has not seen the page says what the errors are of.
    assert!(page.contains("Error per joint on training data: a fit, not a test"));
    counts_agree(&id, &estimate, &page);
    cautions_have_remedies(&estimate, &page);
    assert!(!estimate.verdict.cautions.is_empty());
}
