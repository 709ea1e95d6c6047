//! The page of a designed trajectory as a customer gets it.

#[path = "../../examples/design/synthetic.rs"]
mod synthetic;

use dynid_report::{
    ConfoundedPair, DesignJoint, DesignParameter, DesignReport, DesignStart, Fact, FramePath, JointMotion,
    LimitUse, Obstacle, ParameterShare, RandomMotion, ReportError, Shape, Starts, Trajectory, Verdict,
    Warning, render_design,
};

const HOSTILE: &str = "</script><script>alert('x')</script><img src=\"https://example.org/x.png\">&";

/// Text of `page` between `start` and the next `end`, for every `start`.
fn between<'a>(page: &'a str, start: &str, end: &str) -> Vec<&'a str> {
    page.split(start).skip(1).map(|rest| rest.split(end).next().unwrap_or_default()).collect()
}

fn payload(page: &str) -> serde_json::Value {
    let json = between(page, "<script type=\"application/json\" id=\"log-0\">", "</script>")[0];
    serde_json::from_str(json).expect("the plots have their data")
}

/// A report in which every number is absent but every list has an entry, every text being `text`.
fn hollow(text: &str) -> DesignReport {
    let text = || text.to_owned();
    DesignReport {
        title: text(),
        warnings: vec![Warning { message: text(), hint: text() }],
        criterion: text(),
        criterion_meaning: text(),
        facts: vec![Fact { name: text(), unit: text(), ..Fact::default() }],
        random: Some(RandomMotion::default()),
        parameters: vec![DesignParameter { name: text(), unit: text(), ..Default::default() }],
        confounded: vec![ConfoundedPair { names: [text(), text()], correlation: None }],
        seen_least: vec![ParameterShare { name: text(), share: None }],
        limits: vec![LimitUse {
            kind: text(),
            subject: text(),
            margin_unit: text(),
            acts: true,
            ..Default::default()
        }],
        joints: vec![DesignJoint {
            name: text(),
            unit: text(),
            effort_unit: text(),
            ..DesignJoint::default()
        }],
        trajectory: Some(Trajectory {
            time_s: vec![0.0, 1.0],
            joints: vec![JointMotion {
                q: vec![0.0, 1.0],
                dq: vec![0.0; 2],
                ddq: vec![0.0; 2],
                ..JointMotion::default()
            }],
            frames: vec![FramePath { name: text(), xyz_m: vec![[0.0; 3]; 2] }],
            ..Trajectory::default()
        }),
        obstacles: vec![Obstacle {
            name: text(),
            frames: vec![text()],
            shape: Shape::OutsideBox { lower_m: [0.1; 3], upper_m: [0.2; 3] },
        }],
        starts: Starts { outcomes: vec![DesignStart::default()], ..Starts::default() },
        ..DesignReport::default()
    }
}

#[test]
fn every_section_and_its_numbers_are_there() {
    let page = render_design(&synthetic::design(6)).unwrap();
    for section in [
        "verdict",
        "warnings",
        "trajectory",
        "limits",
        "paths",
        "intervals",
        "forecast",
        "parameters",
        "combinations",
        "starts",
        "motion",
        "provenance",
    ] {
        assert_eq!(page.matches(&format!("<section id=\"{section}\"")).count(), 1, "{section}");
        assert!(page.contains(&format!("href=\"#{section}\"")), "{section} is not in the contents");
    }
    for text in [
        "All limits hold at every instant",
        "<dt>Period</dt><dd>10 s</dd>",
        "<dt>Condition number, columns of unit length</dt><dd>21.90</dd>",
        "<b>3.4 times</b> as large (median of 10 such motions)",
        "<code>fv4</code> and <code>fc4</code>, correlation -0.967: what one gains the other loses",
        "<code>mx6 52 %</code>",
        "15 ended within all limits, <b>6 of them within 5 % of the best</b>",
        "2.183 (seed 3)",
        "<span class=\"flag\">only in combination</span> <span class=\"note\">the data see m3 + m4</span>",
        "<summary>1 other parameter</summary>",
        "5b41362bc82b7f3d",
    ] {
        assert!(page.contains(text), "{text}");
    }
    let weak = between(&page, "<tr class=\"weak\">", "</tr>");
    assert!(page.contains(&format!("<b>{} of 53</b> predicted standard deviations", weak.len())));
    assert!(weak.iter().all(|row| row.contains(">weak</span>")));
}

#[test]
fn joints_are_plotted_against_their_limits() {
    let data = synthetic::design(6);
    let page = render_design(&data).unwrap();
    assert_eq!(page.matches("<figure class=\"plot\"").count(), 24);
    let payload = payload(&page);
    let panels = payload["panels"].as_array().unwrap();
    assert_eq!(panels.len(), 24);
    // Position of joint_3, whose range is not symmetric, and its acceleration.
    assert_eq!(panels[8]["limits"], serde_json::json!([-2.4, 2.7]));
    assert_eq!(panels[10]["limits"], serde_json::json!([-6.0, 6.0]));
    assert_eq!(panels[10]["series"][0]["name"], "acceleration");
    assert!(page.contains("limits -2.4 and 2.7") && page.contains("limit ±431.97, too far to be drawn"));
    // 2.5 s of approach, three periods of 10 s, 2.5 s back.
    assert_eq!(panels[0]["shaded"], serde_json::json!([[0.0, 2.5], [32.5, 35.0]]));

    let mut data = data;
    data.joints[0].jerk = Some(100.0);
    let trajectory = data.trajectory.as_mut().unwrap();
    trajectory.joints[0].jerk = Some(vec![1.0; trajectory.time_s.len()]);
    trajectory.joints[0].q[5..9].fill(f64::NAN);
    let page = render_design(&data).unwrap();
    assert_eq!(page.matches("<figure class=\"plot\"").count(), 25);
    for text in ["s³</span>", "4 samples are not finite"] {
        assert!(page.contains(text), "{text}");
    }
}

#[test]
fn limits_stand_by_joint_and_kind() {
    let page = render_design(&synthetic::design(6)).unwrap();
    let table = between(&page, "<table class=\"uses\">", "</table>")[0];
    for kind in ["position", "velocity", "acceleration", "effort"] {
        assert!(table.contains(&format!("<th>{kind}</th>")), "{kind}");
    }
    assert_eq!(table.matches("<tr>").count(), 7);
    assert_eq!(table.matches("<td class=\"use acts\"").count(), 2);
    // joint_6 has no limit of acceleration.
    assert_eq!(table.matches("<td class=\"use\">-</td>").count(), 1);
    let acting = between(&page, "<h3>Limits that act</h3>", "</table>")[0];
    assert!(acting.contains("<td>velocity</td><td>joint_3</td>") && acting.contains("distance from floor"));

    let mut data = synthetic::design(6);
    data.limits[0].use_percent = Some(100.2);
    let page = render_design(&data).unwrap();
    assert!(between(&page, "<table class=\"uses\">", "</table>")[0].contains("<td class=\"use broken\""));
}

#[test]
fn frames_are_shown_from_three_sides_among_their_obstacles() {
    let mut data = synthetic::design(6);
    data.obstacles[1].frames = vec!["elbow".into()];
    let trajectory = data.trajectory.as_mut().unwrap();
    let aside = trajectory.frames[0].xyz_m.iter().map(|[x, y, z]| [*x, y + 0.2, *z]).collect();
    let elbow = FramePath { name: "elbow".into(), xyz_m: aside };
    trajectory.frames.push(elbow);
    let page = render_design(&data).unwrap();
    assert_eq!(page.matches("<svg class=\"view\"").count(), 6);
    for title in ["From above", "From the front (+x)", "From the side (−y)"] {
        assert_eq!(page.matches(title).count(), 2, "{title}");
    }
    // The wall is the elbow's alone; the other three obstacles are everybody's.
    let lists = between(&page, "<ul class=\"obstacles\">", "</ul>");
    assert_eq!(lists.iter().map(|l| l.matches("<li>").count()).collect::<Vec<_>>(), [3, 4]);
    assert!(lists[1].contains("<b>wall</b>: where y ≤ 0.95 m"));
    // Floor in two views of each; wall in two of the elbow's.
    assert_eq!(page.matches("<path class=\"forbidden\"").count(), 2 + 4);
    let ids = between(&page, "<clipPath id=\"view-", "\"");
    assert_eq!(ids, ["0-0", "0-1", "0-2", "1-0", "1-1", "1-2"]);
}

#[test]
fn the_page_loads_nothing() {
    let page = render_design(&synthetic::design(2)).unwrap();
    assert!(!page.contains("http:") && !page.contains("https:") && !page.contains("@import"));
    for attribute in ["src=\"", "srcset=\"", "action=\"", "data=\"", "poster=\""] {
        assert!(!page.contains(&format!(" {attribute}")), "{attribute}");
    }
    assert!(between(&page, "href=\"", "\"").iter().all(|target| target.starts_with('#')));
    assert!(between(&page, "url(", ")").iter().all(|target| target.starts_with('#')));
    assert!(page.contains("default-src 'none'"));
}

#[test]
fn names_cannot_become_markup() {
    let plain = render_design(&hollow("plain")).unwrap();
    let page = render_design(&hollow(HOSTILE)).unwrap();
    for tag in ["<script", "</script>", "<img", "<figure", "<td"] {
        assert_eq!(page.matches(tag).count(), plain.matches(tag).count(), "{tag}");
    }
    assert_eq!(payload(&page)["panels"][0]["name"], HOSTILE);
}

#[test]
fn a_design_that_failed_keeps_silent_about_its_log() {
    let report = DesignReport {
        verdict: Verdict { headline: "No motion keeps all limits".into(), ..Verdict::default() },
        ..DesignReport::default()
    };
    let page = render_design(&report).unwrap();
    assert!(page.contains("No motion keeps all limits"));
    for heading in ["What the log will tell", "Hard to tell apart", "Motion of the joints"] {
        assert!(!page.contains(heading), "{heading}");
    }
}

#[test]
fn nothing_known_still_makes_a_page_that_says_so() {
    let page = render_design(&DesignReport::default()).unwrap();
    assert!(page.contains(">FAIL</span>") && !page.contains(">OK</span>"));
    for sentence in [
        "No parameters were handed over",
        "No limits were handed over",
        "No motion was handed over",
        "No starts are recorded",
        "Nothing is known about random motion",
    ] {
        assert!(page.contains(sentence), "{sentence}");
    }
    for page in [page, render_design(&hollow("x")).unwrap()] {
        for word in ["none<", "NaN", "undefined<", "None"] {
            assert!(
                !page.split("<main>").nth(1).unwrap().split("<script>").next().unwrap().contains(word),
                "{word}"
            );
        }
        assert!(page.contains("<dt>Harmonics</dt><dd>-</dd>"));
    }
}

#[test]
fn a_search_cut_short_says_so() {
    let mut data = synthetic::design(1);
    assert!(!render_design(&data).unwrap().contains("time was up"));
    data.starts.asked = Some(40);
    let page = render_design(&data).unwrap();
    assert!(page.contains("from 16 random motions of 40 asked for, when its time was up"));
    assert!(page.contains("byte for byte, if as many starts run"));
}

#[test]
fn one_and_thirty_two_joints_are_laid_out_below_four_megabytes() {
    for joints in [1, 32] {
        let page = render_design(&synthetic::design(joints)).unwrap();
        assert_eq!(page.matches("<figure class=\"plot\"").count(), 4 * joints);
        assert!(page.len() < 4_000_000, "{} bytes", page.len());
    }
}

#[test]
fn the_same_data_gives_the_same_bytes() {
    let page = || render_design(&synthetic::design(3)).unwrap();
    assert_eq!(page(), page());
}

#[test]
fn arrays_of_the_wrong_length_are_refused_with_their_place() {
    let broken = |change: &dyn Fn(&mut Trajectory)| {
        let mut data = synthetic::design(2);
        change(data.trajectory.as_mut().unwrap());
        render_design(&data).unwrap_err()
    };
    let error = broken(&|t| t.joints[1].ddq.truncate(3));
    assert!(matches!(error, ReportError::Length { expected: 7001, found: 3, .. }));
    assert_eq!(error.to_string(), "joint \"joint_2\", acceleration: 3 entries, expected 7001");
    for change in [
        &(|t: &mut Trajectory| t.joints.truncate(1)) as &dyn Fn(&mut Trajectory),
        &|t| t.joints[0].q.clear(),
        &|t| t.joints[0].dq.push(0.0),
        &|t| t.joints[0].effort = Some(Vec::new()),
        &|t| t.joints[0].jerk = Some(vec![0.0]),
        &|t| t.frames[0].xyz_m.truncate(9),
    ] {
        assert!(matches!(broken(change), ReportError::Length { .. }));
    }
    assert!(matches!(broken(&|t| t.time_s[7] = -1.0), ReportError::Time { sample: 7, .. }));
    for recorded in [[3.0, 2.0], [f64::NAN, 2.0], [0.0, f64::INFINITY]] {
        let error = broken(&|t| t.recorded_s = Some(recorded));
        assert!(matches!(error, ReportError::Recorded { .. }), "{recorded:?}");
    }
}

#[test]
fn the_data_serialises_to_plain_json() {
    let json = serde_json::to_value(synthetic::design(1)).unwrap();
    assert_eq!(json["verdict"]["status"], "ok");
    assert_eq!(json["obstacles"][0]["shape"]["half_space"]["offset_m"], -0.243);
    assert_eq!(json["joints"][0]["jerk"], serde_json::Value::Null);
}
