//! The first screen, cautions and counts, and what keeps pages within the width of a phone.

#![expect(clippy::unwrap_used, reason = "helpers of tests outside of test functions")]

use crate::report::synthetic;
use dynid_report::{
    Caution, LineKind, PictureLine, ReportData, ReportError, Status, StudyReport, StudySection, StudyTable,
    render, render_study,
};

fn section<'a>(page: &'a str, id: &str) -> &'a str {
    page.split(&format!("<section id=\"{id}\"")).nth(1).unwrap().split("</section>").next().unwrap()
}

#[test]
fn errors_a_figure_and_the_robot_stand_on_the_first_screen_without_a_script() {
    let mut data = synthetic::report(6, 500);
    let page = render(&data).unwrap();
    let verdict = page.find("<section id=\"verdict\"").unwrap();
    let first = page.find("<section id=\"first\"").unwrap();
    let cautions = page.find("<section id=\"cautions\"").unwrap();
    assert!(verdict < first && first < cautions);
    let first = section(&page, "first");
    assert!(
        first.contains("Error per joint on unseen data")
            && first.contains("the worst predicted of 2 unseen logs")
    );
    assert_eq!(first.matches("<th scope=\"row\">joint_").count(), 6);
    assert!(first.contains("<b>joint_2</b>, effort in N\u{a0}m over time in s"));
    assert!(first.contains("<path class=\"measured\"") && first.contains("<path class=\"predicted\""));
    assert!(first.contains("<svg class=\"robot\"") && first.contains("aria-label=\"The robot as lines"));
    // The player is hidden until a script shows it, and nothing plays by itself here.
    assert!(first.contains("<div class=\"player screen\" hidden>") && !first.contains("data-autoplay"));

    data.judged.as_mut().unwrap().unseen = false;
    let page = render(&data).unwrap();
    assert!(section(&page, "first").contains("Error per joint on training data: a fit, not a test"));
    data.judged = None;
    data.picture = None;
    assert!(!render(&data).unwrap().contains("<section id=\"first\""));
}

#[test]
fn every_caution_shows_what_mends_it_in_the_order_given() {
    let mut data = synthetic::report(2, 100);
    data.cautions.insert(
        0,
        Caution {
            status: Status::Fail,
            name: "Fit".into(),
            message: "the fit explains nothing".into(),
            remedy: "`dynid check run.toml`".into(),
            ..Caution::default()
        },
    );
    let page = render(&data).unwrap();
    let list = section(&page, "cautions");
    assert!(list.contains("4 in all, 1 of which forbids the use of the result"));
    assert_eq!(list.matches("<p class=\"remedy\">").count(), 4);
    assert!(list.contains("<code>dynid check run.toml</code>"));
    let places: Vec<usize> = data.cautions.iter().map(|c| list.find(&c.name).unwrap()).collect();
    assert!(places.windows(2).all(|p| p[0] < p[1]), "{places:?}");
    assert!(section(&page, "verdict").contains("<a href=\"#cautions\">4 cautions</a>"));
    assert!(list.contains("3 of 5 checks passed"));
}

#[test]
fn a_count_that_contradicts_its_list_is_refused() {
    let contradicted = |change: &dyn Fn(&mut ReportData)| {
        let mut data = synthetic::report(3, 100);
        change(&mut data);
        render(&data).unwrap_err().to_string()
    };
    assert_eq!(
        contradicted(&|data| data.counts.base += 2),
        "base parameters: the count says 29, the list has 27"
    );
    assert!(contradicted(&|data| data.counts.base_seen -= 1).starts_with("base parameters seen in the data"));
    assert!(contradicted(&|data| data.counts.shape = 0).starts_with("shape parameters"));
    assert!(
        contradicted(&|data| drop(data.standard_parameters.pop()))
            .starts_with("standard parameters: the count says 39")
    );
}

#[test]
fn pictures_that_name_what_is_not_there_are_refused() {
    let mut data = synthetic::report(3, 100);
    data.picture.as_mut().unwrap().poses[4].points_m.pop();
    assert_eq!(render(&data).unwrap_err().to_string(), "picture of the robot, pose 4: 3 entries, expected 4");
    let mut data = synthetic::report(3, 100);
    data.picture.as_mut().unwrap().lines.push(PictureLine { ends: [0, 9], kind: LineKind::Axis });
    assert!(matches!(render(&data), Err(ReportError::Length { found: 4, expected: 10, .. })));
    let mut data = synthetic::report(3, 100);
    data.picture.as_mut().unwrap().shown = 40;
    assert!(render(&data).is_err());
    let mut data = synthetic::report(3, 100);
    data.judged.as_mut().unwrap().predicted.pop();
    assert!(render(&data).unwrap_err().to_string().starts_with("first screen, predicted effort"));
}

/// What stands between a tag and its end, for every such tag.
fn tags<'a>(page: &'a str, tag: &str) -> Vec<&'a str> {
    page.split(&format!("<{tag}")).skip(1).map(|rest| rest.split('>').next().unwrap()).collect()
}

/// Wide tables scroll by themselves or fold, so that the page itself is never wider than a phone.
#[test]
fn nothing_is_wider_than_its_place() {
    let table = StudyTable {
        caption: "wide".into(),
        head: (0..12).map(|k| format!("column {k}")).collect(),
        rows: vec![(0..12usize).map(Into::into).collect(); 3],
    };
    let study = StudyReport {
        sections: vec![StudySection { tables: vec![table], ..StudySection::default() }],
        ..StudyReport::default()
    };
    for page in [render(&synthetic::report(7, 300)).unwrap(), render_study(&study).unwrap()] {
        // Up to the scripts, which hold tags as text.
        let body = page.split("<body>").nth(1).unwrap().split("<script>").next().unwrap();
        let before: Vec<&str> = body.split("<table").collect();
        for part in &before[..before.len() - 1] {
            let held = ["<div class=\"wide\">", "<div class=\"errors\">", "</figcaption>"];
            assert!(
                held.iter().any(|tag| part.trim_end().ends_with(tag)),
                "{}",
                &part[part.len().saturating_sub(80)..]
            );
        }
        assert!(tags(body, "svg").iter().all(|svg| svg.contains("viewBox") && !svg.contains(" width=")));
        assert!(
            tags(body, "svg").iter().all(|svg| svg.contains("aria-label") || svg.contains("aria-hidden"))
        );
        assert!(page.contains("<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">"));
        assert!(page.contains(".wide { overflow-x: auto;"));
    }
    // Few long rows fold into cards that name their columns.
    let page = render_study(&study).unwrap();
    assert!(page.contains("<table class=\"stack\">") && page.contains("data-label=\"column 11\""));
}
