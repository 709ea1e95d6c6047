//! Obstacles in a view: what is forbidden at every depth is filled, what is forbidden at some depths is outlined.

use super::{Sheet, View};
use crate::data::Shape;

/// Sine of the tilt below which a plane counts as seen from its edge.
const EDGE_ON: f64 = 1e-9;

/// Part of each axis that should be visible, m; infinite ends where it does not matter.
pub(super) fn extent(shape: &Shape) -> [[f64; 2]; 3] {
    const ANYWHERE: [f64; 2] = [f64::INFINITY, f64::NEG_INFINITY];
    let around = |center: f64, radius: f64| [center - radius, center + radius];
    match *shape {
        Shape::HalfSpace { normal, offset_m } => {
            let length = norm(normal);
            std::array::from_fn(|k| {
                if (normal[k].abs() / length - 1.0).abs() < EDGE_ON {
                    around(offset_m * normal[k].signum(), 0.0)
                } else {
                    ANYWHERE
                }
            })
        }
        Shape::InsideBox { lower_m, upper_m } | Shape::OutsideBox { lower_m, upper_m } => {
            std::array::from_fn(|k| [lower_m[k], upper_m[k]])
        }
        Shape::OutsideCylinder { center_m: [x, y], radius_m } => {
            [around(x, radius_m), around(y, radius_m), ANYWHERE]
        }
        Shape::OutsideOrAboveColumn { center_m: [x, y], radius_m, height_m } => {
            [around(x, radius_m), around(y, radius_m), around(height_m, 0.0)]
        }
    }
}

pub(super) fn draw(sheet: &Sheet, shape: &Shape, svg: &mut String) {
    let [h, v, _] = sheet.view.axes();
    match *shape {
        Shape::HalfSpace { normal, offset_m } => half_space(sheet, normal, offset_m, svg),
        Shape::InsideBox { lower_m, upper_m } => {
            if let Some(inner) = rectangle(sheet, [lower_m[h], upper_m[h]], [lower_m[v], upper_m[v]]) {
                let outer = polygon(sheet, &corners(sheet));
                svg.push_str(&format!(r#"<path class="forbidden" fill-rule="evenodd" d="{outer}{inner}"/>"#));
            }
        }
        Shape::OutsideBox { lower_m, upper_m } => {
            body(rectangle(sheet, [lower_m[h], upper_m[h]], [lower_m[v], upper_m[v]]), svg);
        }
        Shape::OutsideCylinder { center_m, radius_m } if sheet.view == View::Top => {
            disc(sheet, "forbidden", center_m, radius_m, svg);
        }
        Shape::OutsideOrAboveColumn { center_m, radius_m, .. } if sheet.view == View::Top => {
            disc(sheet, "body", center_m, radius_m, svg);
        }
        Shape::OutsideCylinder { center_m, radius_m } => {
            // Beyond the picture, so that its ends are not seen.
            upright(
                sheet,
                center_m[h] - radius_m,
                center_m[h] + radius_m,
                2.0 * sheet.v[1] - sheet.v[0],
                svg,
            );
        }
        Shape::OutsideOrAboveColumn { center_m, radius_m, height_m } => {
            upright(sheet, center_m[h] - radius_m, center_m[h] + radius_m, height_m, svg);
        }
    }
}

fn norm(a: [f64; 3]) -> f64 {
    a.iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// Only where the plane is seen from its edge: otherwise what is forbidden depends on the depth.
fn half_space(sheet: &Sheet, normal: [f64; 3], offset: f64, svg: &mut String) {
    let [h, v, depth] = sheet.view.axes();
    let length = norm(normal);
    if !(length > 0.0 && length.is_finite() && offset.is_finite()) || normal[depth].abs() > EDGE_ON * length {
        return;
    }
    let beyond = |p: &[f64; 2]| offset - (normal[h] * p[0] + normal[v] * p[1]) / length;
    let corners = corners(sheet);
    let mut forbidden = Vec::new();
    for (k, a) in corners.iter().enumerate() {
        let b = &corners[(k + 1) % corners.len()];
        let (at_a, at_b) = (beyond(a), beyond(b));
        if at_a >= 0.0 {
            forbidden.push(*a);
        }
        if (at_a >= 0.0) != (at_b >= 0.0) {
            let share = at_a / (at_a - at_b);
            forbidden.push([a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1])]);
        }
    }
    if forbidden.len() > 2 {
        svg.push_str(&format!(r#"<path class="forbidden" d="{}"/>"#, polygon(sheet, &forbidden)));
    }
}

/// Corners a little outside the picture, so that outlines along its edge are not seen.
fn corners(sheet: &Sheet) -> [[f64; 2]; 4] {
    let pad = 3.0 / sheet.scale;
    let ([left, right], [low, high]) = (sheet.h, sheet.v);
    [[left - pad, low - pad], [right + pad, low - pad], [right + pad, high + pad], [left - pad, high + pad]]
}

fn polygon(sheet: &Sheet, points: &[[f64; 2]]) -> String {
    let corners: Vec<String> =
        points.iter().map(|[h, v]| sheet.at(*h, *v)).map(|[x, y]| format!("{x:.1} {y:.1}")).collect();
    format!("M{}z", corners.join("L"))
}

/// `None` unless finite and not empty.
fn rectangle(sheet: &Sheet, [left, right]: [f64; 2], [low, high]: [f64; 2]) -> Option<String> {
    let sound = [left, right, low, high].iter().all(|x| x.is_finite()) && left < right && low < high;
    sound.then(|| polygon(sheet, &[[left, low], [right, low], [right, high], [left, high]]))
}

fn body(outline: Option<String>, svg: &mut String) {
    if let Some(d) = outline {
        svg.push_str(&format!(r#"<path class="body" d="{d}"/>"#));
    }
}

/// From below the picture up to `top`.
fn upright(sheet: &Sheet, left: f64, right: f64, top: f64, svg: &mut String) {
    let below = sheet.v[0] - 3.0 / sheet.scale;
    body(rectangle(sheet, [left, right], [below, top]), svg);
}

fn disc(sheet: &Sheet, class: &str, center: [f64; 2], radius: f64, svg: &mut String) {
    let [x, y] = sheet.at(center[0], center[1]);
    if x.is_finite() && y.is_finite() && radius > 0.0 && radius.is_finite() {
        svg.push_str(&format!(
            r#"<circle class="{class}" cx="{x:.1}" cy="{y:.1}" r="{:.1}"/>"#,
            radius * sheet.scale
        ));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sheet(view: View) -> Sheet {
        Sheet { view, h: [-1.0, 1.0], v: [-1.0, 1.0], scale: 100.0 }
    }

    fn drawn(view: View, shape: Shape) -> String {
        let mut svg = String::new();
        draw(&sheet(view), &shape, &mut svg);
        svg
    }

    #[test]
    fn a_floor_fills_what_lies_below_it_in_the_upright_views_only() {
        let floor = Shape::HalfSpace { normal: [0.0, 0.0, 2.0], offset_m: 0.5 };
        assert_eq!(drawn(View::Top, floor), "");
        for view in [View::Front, View::Side] {
            // From the lower edge, 3 pixels outside, up to z = 0.5 m: pixel 18 + 50.
            assert_eq!(
                drawn(view, floor),
                r#"<path class="forbidden" d="M37.0 221.0L243.0 221.0L243.0 68.0L37.0 68.0z"/>"#
            );
        }
    }

    #[test]
    fn a_slanted_wall_is_drawn_where_it_is_seen_from_its_edge() {
        let wall = Shape::HalfSpace { normal: [-1.0, -1.0, 0.0], offset_m: 0.0 };
        // The triangle x + y > 0 of the square.
        assert!(drawn(View::Top, wall).contains("L243.0 15.0L"));
        assert_eq!(drawn(View::Front, wall) + &drawn(View::Side, wall), "");
    }

    #[test]
    fn a_column_ends_at_its_top_and_a_cylinder_nowhere() {
        let (center_m, radius_m) = ([0.2, 0.0], 0.3);
        let column = Shape::OutsideOrAboveColumn { center_m, radius_m, height_m: 0.4 };
        assert!(drawn(View::Top, column).contains(r#"cx="160.0" cy="118.0" r="30.0""#));
        assert!(drawn(View::Side, column).contains("M130.0 221.0L190.0 221.0L190.0 78.0L130.0 78.0z"));
        assert!(drawn(View::Side, Shape::OutsideCylinder { center_m, radius_m }).contains("190.0 -182.0"));
    }

    #[test]
    fn shapes_that_cannot_be_are_not_drawn() {
        for shape in [
            Shape::HalfSpace { normal: [0.0; 3], offset_m: 0.0 },
            Shape::HalfSpace { normal: [0.0, 0.0, 1.0], offset_m: f64::NAN },
            Shape::InsideBox { lower_m: [1.0; 3], upper_m: [0.0; 3] },
            Shape::OutsideCylinder { center_m: [0.0; 2], radius_m: -1.0 },
        ] {
            for view in View::ALL {
                assert_eq!(drawn(view, shape), "", "{shape:?}");
            }
        }
    }
}
