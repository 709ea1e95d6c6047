//! The page as a customer gets it.

#[path = "../../examples/demo/synthetic.rs"]
pub(crate) mod synthetic;

use std::sync::Arc;

use dynid_report::{
    BaseParameter, CarriedReason, Caution, Chart, ChartAxis, ChartCurve, Check, Chosen, Consistency,
    ConsistencyForm, Counts, Fact, FileJoint, FileJudgement, FrictionTrial, HeldOut, HeldOutJoint, InputFile,
    Joint, JointDelay, JointQuality, JointSeries, Judged, Ladder, Limit, LineKind, LogReport, LogSeries,
    LogWhiteness, PictureLine, PointKind, Pose, Precision, Pruning, PruningStep, ReportData, ReportError,
    RobotPicture, Rung, ShapeParameter, ShapeVerdict, StandardParameter, UnidentifiableColumn,
    ValidationPrice, Verdict, render,
};

const HOSTILE: &str = "</script><script>alert('x')</script><img src=\"https://example.org/x.png\">&";

/// Text of `page` between `start` and the next `end`, for every `start`.
fn between<'a>(page: &'a str, start: &str, end: &str) -> Vec<&'a str> {
    page.split(start).skip(1).map(|rest| rest.split(end).next().unwrap_or_default()).collect()
}

/// A report in which every optional value is absent but every list has an entry, every text being `text`.
fn hollow(text: &str) -> ReportData {
    let text = || text.to_owned();
    let fact = || Fact { name: text(), unit: text(), ..Fact::default() };
    ReportData {
        title: text(),
        verdict: Verdict {
            headline: text(),
            sentences: vec![text()],
            checks: vec![Check {
                name: text(),
                unit: text(),
                limit: text(),
                meaning: text(),
                ..Check::default()
            }],
            ..Verdict::default()
        },
        cautions: vec![Caution {
            name: text(),
            unit: text(),
            limit: text(),
            message: text(),
            remedy: text(),
            ..Caution::default()
        }],
        counts: Counts { base: 1, standard: 1, shape: 1, ..Counts::default() },
        judged: Some(Judged {
            why: text(),
            time_s: vec![0.0, 1.0],
            measured: vec![1.0, 2.0],
            predicted: vec![1.0, 1.5],
            description: text(),
            ..Judged::default()
        }),
        picture: Some(RobotPicture {
            caption: text(),
            points: vec![PointKind::Base, PointKind::Turns],
            lines: vec![PictureLine { ends: [0, 1], kind: LineKind::Link }],
            poses: [0.0, 1.0].map(|z| Pose { time_s: z, points_m: vec![[0.0; 3], [0.5, 0.0, z]] }).into(),
            ..RobotPicture::default()
        }),
        robot: dynid_report::Robot { name: text(), file: None, facts: vec![fact()] },
        joints: vec![Joint { name: text(), effort_unit: text(), kind: text(), elements: vec![text()] }],
        logs: vec![LogReport {
            name: text(),
            facts: vec![fact()],
            quality: vec![JointQuality::default()],
            series: Some(LogSeries {
                time_s: vec![0.0, 1.0],
                description: text(),
                joints: vec![JointSeries { measured: vec![1.0, 2.0].into(), ..JointSeries::default() }],
            }),
            ..LogReport::default()
        }],
        estimation: vec![fact()],
        base_parameters: vec![BaseParameter {
            name: text(),
            expression: text(),
            unit: text(),
            ..Default::default()
        }],
        standard_parameters: vec![StandardParameter {
            owner: text(),
            name: text(),
            unit: text(),
            reason: Some(CarriedReason::NotExcited),
            combination: text(),
            advice: text(),
            tie: text(),
            ..Default::default()
        }],
        shape_parameters: vec![ShapeParameter {
            name: text(),
            unit: text(),
            reason: text(),
            ..Default::default()
        }],
        friction_laws: vec![Chart {
            title: text(),
            note: text(),
            x: ChartAxis { label: text(), unit: text(), ..Default::default() },
            y: ChartAxis { label: text(), unit: text(), ..Default::default() },
            curves: vec![ChartCurve { name: text(), ..Default::default() }; 2],
            ..Default::default()
        }],
        files: Some(FileJudgement {
            log: text(),
            joints: vec![FileJoint { joint: text(), effort_unit: text(), ..Default::default() }],
            ..Default::default()
        }),
        friction_trials: vec![FrictionTrial {
            joint: text(),
            element: text(),
            unit: text(),
            ..Default::default()
        }],
        motions: vec![text()],
        consistency: Some(Consistency {
            form: Some(ConsistencyForm::PseudoInertia),
            limits: vec![Limit { owner: text(), text: text(), ..Default::default() }],
            validation: vec![ValidationPrice { log: text(), ..Default::default() }],
            ..Default::default()
        }),
        held_out: HeldOut { folds: 1, joints: vec![HeldOutJoint::default()], ..Default::default() },
        precision: Some(Precision {
            variance_inflation_per_joint: vec![None],
            whiteness: vec![LogWhiteness { log: text(), joints: vec![None] }],
            ..Default::default()
        }),
        pruning: Some(Pruning {
            path: vec![PruningStep { parameters: 1, next: text(), ..Default::default() }],
            essential_parameters: vec![text()],
            ..Default::default()
        }),
        unidentifiable: vec![UnidentifiableColumn { name: text(), reason: text() }],
        conditioning: vec![Chosen { name: text(), reason: text(), ..Default::default() }],
        ladders: vec![Ladder {
            title: text(),
            explanation: text(),
            quantity: text(),
            unit: text(),
            loss_name: text(),
            loss_unit: text(),
            rungs: vec![Rung { value: text().into(), ..Default::default() }],
        }],
        delays: vec![JointDelay::default()],
        provenance: dynid_report::Provenance {
            version: text(),
            inputs: vec![InputFile { path: text(), kind: text(), sha256: None }],
            seed: None,
            settings: vec![Chosen {
                name: text(),
                value: text().into(),
                unit: text(),
                reason: text(),
                ..Default::default()
            }],
        },
        ..ReportData::default()
    }
}

#[test]
fn every_section_and_its_numbers_are_there() {
    let page = render(&synthetic::report(6, 500)).unwrap();
    for section in [
        "verdict",
        "first",
        "cautions",
        "trust",
        "motions",
        "system",
        "quality",
        "consistency",
        "precision",
        "effort",
        "residuals",
        "base",
        "essential",
        "identifiability",
        "conditioning",
        "provenance",
    ] {
        assert_eq!(page.matches(&format!("<section id=\"{section}\"")).count(), 1, "{section}");
        // What follows the verdict at once needs no way to it.
        let linked = page.contains(&format!("href=\"#{section}\""));
        assert!(linked || section == "first", "{section} is not in the contents");
    }
    assert!(page.contains("Izz1 + Ia1 + Iyy2 + 0.2025 (m2 + m3)"));
    assert_eq!(page.matches("<figure class=\"plot\"").count(), 18);
    assert_eq!(page.matches("<svg class=\"small\"").count(), 36);
    assert_eq!(page.matches("<svg class=\"interval").count(), 54);
    assert_eq!(page.matches("aria-label=\"95 % interval").count(), 54);
    for word in ["CAUTION", "held-out RMS", "from the data", "20260401", "0.400 to 0.600"] {
        assert!(page.contains(word), "{word}");
    }
}

/// The row of a parameter of `owner` in the table of standard parameters, with what is said below it.
fn standard_row<'a>(page: &'a str, owner: &str, name: &str) -> &'a str {
    let table = between(page, "<table id=\"standard-table\"", "</table>")[0];
    let group = between(table, "<tr class=\"owner\">", "</tbody>");
    let group = group.iter().find(|g| g.contains(&format!(">{owner} <span>"))).expect("the owner has rows");
    let rows = between(group, "<tr data-verdict=", "<tr data-verdict=");
    rows.iter().find(|r| r.contains(&format!("<td>{name}</td>"))).expect("the parameter has a row")
}

#[test]
fn every_parameter_says_how_far_it_can_be_trusted() {
    let page = render(&synthetic::report(6, 500)).unwrap();
    // 9 + 6 * 3 + 3 * 5 of 78: all of the first link but Izz, and three of the other links.
    for text in ["all 78", "seen 54", "carried 15", "not identifiable 9"] {
        assert!(page.contains(&format!(">{text}</button>")), "{text}");
    }
    assert!(page.contains("aria-label=\"54 seen in the data, 15 carried by the prior, 9 not identifiable\""));

    let seen = standard_row(&page, "link_2", "mx");
    for text in ["\"seen_in_data\"", "0.293 to 0.317", "data 96 %"] {
        assert!(seen.contains(text), "{text} in {seen}");
    }
    assert!(!seen.contains("class=\"more\"") && !seen.contains("class=\"flag\""));
    let carried = standard_row(&page, "link_3", "m");
    for text in
        ["\"carried_by_prior\"", "only in combination", "data 37 %", "The data see mx3 + 0.45·m4 = 3.87"]
    {
        assert!(carried.contains(text), "{text} in {carried}");
    }
    assert!(standard_row(&page, "link_3", "Iyy").contains("Fast motion of joint joint_3 would raise Iyy3"));
    assert!(standard_row(&page, "link_1", "m").contains("\"not_identifiable\""));
    assert!(standard_row(&page, "link_3", "Ixy").contains(">wide</span>"));
    let held = standard_row(&page, "joint_2", "fv");
    for text in [
        ">at the boundary</span>",
        ">outside</span>",
        "Without limits, data and robot file together say 4.23",
    ] {
        assert!(held.contains(text), "{text} in {held}");
    }
}

#[test]
fn motions_consistency_and_precision_are_told_in_words() {
    let mut data = synthetic::report(6, 500);
    let page = render(&data).unwrap();
    assert!(page.contains("<li>Fast motion of joints joint_4 and joint_5 together"));
    assert!(
        page.contains("<b>It costs next to nothing on held-out stretches.</b>") && page.contains("(+0.8 %)")
    );
    assert!(
        page.contains(
            "<dt>link_5</dt><dd>no thickness along its x axis; no thickness along (0.19, 0.94, 0.30)"
        )
    );
    assert_eq!(page.matches("<svg class=\"pairbar\"").count(), 6 + 2);
    assert!(page.contains("as strongly as held-out folds of the log allow"));
    assert!(page.contains("<b>6.20 times</b>") && page.contains("are 2.5 times as large"));
    assert!(page.contains("(2 of 6 residuals are coloured). Those shown are robust."));

    data.held_out.consistent_percent = Some(6.0);
    data.precision.as_mut().unwrap().wanted_block_s = Some(4.0);
    let page = render(&data).unwrap();
    assert!(
        page.contains("<b>It is dear.</b>")
            && page.contains("too narrow: the residuals ask for blocks of 4.0 s")
    );

    data.precision.as_mut().unwrap().robust = false;
    data.consistency = None;
    let page = render(&data).unwrap();
    assert!(page.contains("The standard deviations shown are not to be believed"));
    assert!(page.contains("No consistency was asked for") && !page.contains("<svg class=\"pairbar\""));
}

#[test]
fn the_path_of_smaller_models_is_drawn_with_its_choice() {
    let page = render(&synthetic::report(6, 500)).unwrap();
    assert_eq!(page.matches("<svg class=\"path\"").count(), 2);
    assert_eq!(page.matches("<circle class=\"chosen\"").count(), 2);
    assert!(page.contains("<b>36 of 54 are essential:</b>"));
    assert!(page.contains("<title>36 parameters: 1.300 ± 0.10</title>"));
    assert!(between(&page, "Essential parameters</h3>", "</p>")[0].contains("<code>Izz1</code>"));
    assert_eq!(page.matches("<tr class=\"chosen\"><td class=\"n\">36</td>").count(), 1);
}

#[test]
fn nonlinear_friction_is_shown_where_there_is_any() {
    let mut data = synthetic::report(6, 500);
    let page = render(&data).unwrap();
    let rows = between(&page, "Parameters that enter nonlinearly</h3>", "</table>")[0];
    assert!(
        rows.contains("<td>joint_2.vs</td><td class=\"n\">0.0412</td><td class=\"n\">0.0031</td>"),
        "{rows}"
    );
    assert!(
        rows.contains("0.0350 to 0.0474")
            && rows.contains("0.0200 to 0.0850")
            && rows.contains("bounded on one side"),
        "{rows}"
    );
    assert_eq!(page.matches("<svg class=\"chart\"").count(), 1);
    let trials = between(&page, "Friction shapes tried</h3>", "</table>")[0];
    assert!(
        trials.contains("<td>stribeck</td><td class=\"n\">0.0400 rad&#x2f;s</td><td class=\"n\">12.3</td>"),
        "{trials}"
    );
    assert!(page.contains("href=\"#friction\""));

    data.shape_parameters.clear();
    (data.counts.shape, data.counts.shape_seen) = (0, 0);
    data.friction_laws.clear();
    data.friction_trials.clear();
    let page = render(&data).unwrap();
    for absent in ["#friction", "id=\"friction\"", "Friction shapes tried", "<svg class=\"chart\""] {
        assert!(!page.contains(absent), "{absent}");
    }

    data.counts.shape = 1;
    data.shape_parameters = vec![ShapeParameter { verdict: ShapeVerdict::NotSeen, ..Default::default() }];
    let page = render(&data).unwrap();
    assert!(page.contains("Parameters that enter nonlinearly") && !page.contains("Friction over velocity"));
}

#[test]
fn the_page_loads_nothing() {
    let page = render(&synthetic::report(2, 100)).unwrap();
    assert!(!page.contains("http:") && !page.contains("https:") && !page.contains("@import"));
    for attribute in ["src=\"", "srcset=\"", "action=\"", "data=\"", "poster=\""] {
        assert!(!page.contains(&format!(" {attribute}")), "{attribute}");
    }
    assert!(!page.contains("<link") && !page.contains("<base"));
    assert!(between(&page, "href=\"", "\"").iter().all(|target| target.starts_with('#')));
    assert!(between(&page, "url(", ")").iter().all(|target| target.starts_with('#')));
    assert!(page.contains("default-src 'none'"));
}

#[test]
fn names_cannot_become_markup() {
    let plain = render(&hollow("plain")).unwrap();
    let page = render(&hollow(HOSTILE)).unwrap();
    for tag in ["<script", "</script>", "<img", "<figure", "<td"] {
        assert_eq!(page.matches(tag).count(), plain.matches(tag).count(), "{tag}");
    }
    // The joint's name also stands in the plots' data, where it must come back unchanged.
    let json = between(&page, "<script type=\"application/json\" id=\"log-0\">", "</script>")[0];
    let payload: serde_json::Value = serde_json::from_str(json).unwrap();
    assert_eq!(payload["panels"][0]["name"], HOSTILE);
}

#[test]
fn the_same_data_gives_the_same_bytes() {
    assert_eq!(render(&synthetic::report(3, 1000)).unwrap(), render(&synthetic::report(3, 1000)).unwrap());
}

#[test]
fn a_long_log_of_a_seven_axis_robot_stays_below_four_megabytes() {
    let page = render(&synthetic::report(7, 100_000)).unwrap();
    assert!(page.len() < 4_000_000, "{} bytes", page.len());
    let json = between(&page, "<script type=\"application/json\" id=\"log-0\">", "</script>")[0];
    let payload: serde_json::Value = serde_json::from_str(json).unwrap();
    let characters = payload["panels"][0]["series"][0]["values"]["data"].as_str().unwrap().len();
    assert!(characters * 3 / 8 >= 2000, "{} points", characters * 3 / 8);
}

#[test]
fn one_and_thirty_two_joints_are_laid_out() {
    for joints in [1, 32] {
        let page = render(&synthetic::report(joints, 400)).unwrap();
        assert_eq!(page.matches("<figure class=\"plot\"").count(), 3 * joints);
    }
}

#[test]
fn nothing_known_still_makes_a_page_that_says_so() {
    let page = render(&ReportData::default()).unwrap();
    assert!(page.contains(">FAIL</span>") && !page.contains(">OK</span>"));
    for sentence in
        ["No logs are recorded", "No validation log was given", "No base parameters were handed over"]
    {
        assert!(page.contains(sentence), "{sentence}");
    }
}

#[test]
fn undefined_numbers_are_dashes_and_wrong_ones_are_named() {
    let mut data = hollow("x");
    let page = render(&data).unwrap();
    assert!(!page.contains("none<") && !page.contains("NaN<") && !page.contains("undefined<"));
    assert!(page.contains("No prediction to subtract") || page.contains("No residuals"));
    let standard = page.split("id=\"standard-table\"").nth(1).unwrap().split("</table>").next().unwrap();
    // Value, interval, verdict with its reason, share, robot file.
    assert_eq!(standard.matches(">-</td>").count(), 4);

    data.standard_parameters[0].value = Some(f64::NAN);
    data.logs[0].quality[0].raw.rms = Some(f64::INFINITY);
    assert_eq!(render(&data).unwrap().matches("not finite").count(), 2);
}

#[test]
fn a_very_long_name_is_kept_whole() {
    let name = "j".repeat(5000);
    assert!(render(&hollow(&name)).unwrap().contains(&name));
}

#[test]
fn samples_that_are_not_finite_are_counted_beside_the_plot() {
    let mut data = synthetic::report(2, 100);
    Arc::make_mut(&mut data.logs[0].series.as_mut().unwrap().joints[1].measured)[3..10].fill(f64::NAN);
    assert!(render(&data).unwrap().contains("7 samples are not finite"));
}

#[test]
fn lists_of_the_wrong_length_are_refused_with_their_place() {
    let mut short = synthetic::report(2, 100);
    Arc::make_mut(short.logs[1].series.as_mut().unwrap().joints[1].predicted.as_mut().unwrap()).pop();
    let error = render(&short).unwrap_err();
    assert_eq!(
        error.to_string(),
        "log \"fourier-b\", joint \"joint_2\", predicted effort: 74 entries, expected 75"
    );

    let mut few = synthetic::report(2, 100);
    few.delays.pop();
    assert!(matches!(render(&few), Err(ReportError::Length { expected: 2, found: 1, .. })));
    few.delays.clear();
    assert!(render(&few).is_ok());
    few.precision.as_mut().unwrap().whiteness[0].joints.pop();
    assert_eq!(render(&few).unwrap_err().to_string(), "log \"fourier-a\", whiteness: 1 entries, expected 2");
    few.held_out.joints.pop();
    assert!(render(&few).unwrap_err().to_string().starts_with("held-out errors: 1 entries"));
}

#[test]
fn time_that_runs_backwards_is_refused() {
    for wrong in [0.0005, f64::NAN] {
        let mut data = synthetic::report(1, 100);
        data.logs[0].series.as_mut().unwrap().time_s[7] = wrong;
        assert!(matches!(render(&data), Err(ReportError::Time { sample: 7, .. })));
    }
}

#[test]
fn the_data_serialises_to_plain_json() {
    let json = serde_json::to_value(synthetic::report(1, 3)).unwrap();
    assert_eq!(json["verdict"]["status"], "warn");
    assert_eq!(json["conditioning"][0]["value"], 15.0);
    assert_eq!(json["standard_parameters"][0]["verdict"], "not identifiable");
}
