//! The page as a customer gets it.

#[path = "../examples/demo/synthetic.rs"]
mod synthetic;

use dynid_report::{
    BaseParameter, Check, Chosen, Fact, InputFile, Joint, JointDelay, JointQuality, JointSeries, Ladder,
    LogReport, LogSeries, ReportData, ReportError, Rung, StandardParameter, UnidentifiableColumn, Verdict,
    Warning, render,
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
        warnings: vec![Warning { message: text(), hint: text() }],
        robot: dynid_report::Robot { name: text(), file: None, facts: vec![fact()] },
        joints: vec![Joint { name: text(), effort_unit: text(), kind: text(), elements: vec![text()] }],
        logs: vec![LogReport {
            name: text(),
            facts: vec![fact()],
            quality: vec![JointQuality::default()],
            series: Some(LogSeries {
                time_s: vec![0.0, 1.0],
                description: text(),
                joints: vec![JointSeries { measured: vec![1.0, 2.0], predicted: None, used: None }],
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
        standard_parameters: vec![StandardParameter { owner: text(), name: text(), ..Default::default() }],
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
            settings: vec![fact()],
        },
        ..ReportData::default()
    }
}

#[test]
fn every_section_and_its_numbers_are_there() {
    let page = render(&synthetic::report(6, 500)).unwrap();
    for section in [
        "verdict",
        "warnings",
        "system",
        "quality",
        "effort",
        "residuals",
        "base",
        "standard",
        "identifiability",
        "conditioning",
        "provenance",
    ] {
        assert_eq!(page.matches(&format!("<section id=\"{section}\"")).count(), 1, "{section}");
        assert!(page.contains(&format!("href=\"#{section}\"")), "{section} is not in the contents");
    }
    assert!(page.contains("Izz1 + Ia1 + Iyy2 + 0.2025 (m2 + m3)"));
    assert_eq!(page.matches("<figure class=\"plot\"").count(), 18);
    assert_eq!(page.matches("<svg class=\"small\"").count(), 36);
    assert_eq!(page.matches("<svg class=\"interval").count(), 54);
    assert_eq!(page.matches("aria-label=\"95 % interval").count(), 54);
    for word in ["CAUTION", "held-out RMS", "seen in data", "data (automatic)", "20260401", "0.400 to 0.600"]
    {
        assert!(page.contains(word), "{word}");
    }
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
    assert_eq!(payload["joints"][0]["name"], HOSTILE);
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
    let characters = payload["joints"][0]["measured"]["data"].as_str().unwrap().len();
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
    data.logs[0].series.as_mut().unwrap().joints[1].measured[3..10].fill(f64::NAN);
    assert!(render(&data).unwrap().contains("7 samples are not finite"));
}

#[test]
fn lists_of_the_wrong_length_are_refused_with_their_place() {
    let mut short = synthetic::report(2, 100);
    short.logs[1].series.as_mut().unwrap().joints[1].predicted.as_mut().unwrap().pop();
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
    assert_eq!(json["standard_parameters"][0]["verdict"], "not_identifiable");
}
