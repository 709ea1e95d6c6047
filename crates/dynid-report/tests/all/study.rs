//! The page of a study.

use dynid_report::{
    Chart, ChartAxis, ChartCurve, CurveStyle, ReportError, StudyReport, StudyRow, StudySection, StudyTable,
    Value, render_kind, render_study,
};

fn study() -> StudyReport {
    StudyReport {
        title: "A study of <b>nothing</b>".into(),
        introduction: vec!["One paragraph.".into()],
        rows: vec![
            StudyRow {
                id: "1".into(),
                claim: "Two is more than one".into(),
                required: "2 > 1".into(),
                measured: "2 & 1".into(),
                pass: Some(true),
                ..StudyRow::default()
            },
            StudyRow {
                id: "2".into(),
                claim: "One is more than two".into(),
                pass: Some(false),
                depends_on_seed: true,
                cause: Some("Two was drawn too large.".into()),
                ..StudyRow::default()
            },
            StudyRow { id: "3".into(), claim: "Three is odd".into(), ..StudyRow::default() },
        ],
        sections: vec![StudySection {
            title: "Numbers".into(),
            tables: vec![StudyTable {
                caption: "Paper and ours".into(),
                head: vec!["joint".into(), "paper".into(), "ours".into()],
                rows: vec![vec![Value::from("1"), Value::from(0.97654321), Value::from(0.99)]],
            }],
            charts: vec![Chart {
                title: "Objective".into(),
                x: ChartAxis { label: "evaluations".into(), ..ChartAxis::default() },
                y: ChartAxis { label: "objective".into(), unit: "N m".into(), logarithmic: true },
                curves: vec![
                    ChartCurve {
                        name: "search".into(),
                        points: vec![[0.0, 100.0], [10.0, 10.0]],
                        style: CurveStyle::Line,
                    },
                    ChartCurve {
                        name: "truth".into(),
                        points: vec![[0.0, 9.0], [10.0, 9.0]],
                        style: CurveStyle::Dashed,
                    },
                ],
                ..Chart::default()
            }],
            ..StudySection::default()
        }],
        ..StudyReport::default()
    }
}

#[test]
fn claims_tables_and_charts_are_on_the_page() {
    let page = render_study(&study()).unwrap();
    assert!(page.contains("A study of &lt;b&gt;nothing"), "text is escaped");
    assert!(page.contains("Two is more than one") && page.contains("2 &amp; 1"));
    assert_eq!(
        page.matches("<span class=\"badge fail\"").count(),
        2,
        "the verdict and the row that does not hold"
    );
    assert!(page.contains("0.9765") && page.contains("0.99"));
    assert_eq!(page.matches("class=\"curve").count(), 2);
    let picture = page.split("<svg class=\"chart\"").nth(1).unwrap().split("</svg>").next().unwrap();
    assert!(picture.contains("c1 dashed") && !picture.contains("NaN"), "{picture}");
    assert_eq!(page, render_study(&study()).unwrap());
}

#[test]
fn a_row_shows_what_the_seed_enters_why_it_fails_and_that_it_is_not_graded() {
    let page = render_study(&study()).unwrap();
    assert_eq!(page.matches("title=\"depends on the seed\"").count(), 1);
    assert!(page.contains("Two was drawn too large."));
    assert_eq!(page.matches("not graded").count(), 1);
    assert!(page.contains("2 claims"), "a row that is not graded is no claim");
}

#[test]
fn a_result_without_claims_goes_by_its_own_kind() {
    let result = StudyReport { rows: Vec::new(), ..study() };
    let page = render_kind("Payload", &result).unwrap();
    assert!(page.contains("<p class=\"kind\">Payload</p>") && !page.contains("id=\"claims\""));
    assert!(render_study(&study()).unwrap().contains("<p class=\"kind\">Study</p>"));
}

#[test]
fn an_empty_study_is_a_page() {
    assert!(render_study(&StudyReport::default()).unwrap().contains("</html>"));
}

#[test]
fn a_row_longer_than_its_head_is_refused() {
    let mut study = study();
    study.sections[0].tables[0].rows[0].push(Value::from(1.0));
    let error = render_study(&study).unwrap_err();
    assert!(matches!(error, ReportError::Length { expected: 3, found: 4, .. }), "{error}");
}
