//! Small still pictures, as inline SVG without any text from outside.

mod autocorrelation;
mod axis;
mod bars;
mod by_temperature;
mod chart;
mod histogram;
mod interval;
mod path;
mod ramp;
mod robot;
mod sheet;
mod strip;
mod surface;
mod versus;
mod views;

pub(crate) use autocorrelation::autocorrelation_svg;
pub(crate) use bars::{counts_svg, meter_svg, pair_svg, ranked_svg};
pub(crate) use by_temperature::by_temperature_svg;
pub(crate) use chart::chart_svg;
pub(crate) use histogram::histogram_svg;
pub(crate) use interval::interval_svg;
pub(crate) use path::{PathMarks, PathPoint, ceiling, fewest, path_svg};
pub(crate) use robot::{View as RobotView, mark as robot_mark, robot_svg};
pub(crate) use strip::{StripDot, strip_svg};
pub(crate) use surface::surface_svg;
pub(crate) use versus::versus;
pub(crate) use views::{PathParts, View, view_pictures};

/// Size and margins of the two residual pictures, in pixels at full size.
mod frame {
    pub(super) const WIDTH: f64 = 260.0;
    pub(super) const HEIGHT: f64 = 120.0;
    pub(super) const LEFT: f64 = 30.0;
    pub(super) const RIGHT: f64 = 10.0;
    pub(super) const TOP: f64 = 6.0;
    pub(super) const BOTTOM: f64 = 18.0;

    pub(super) fn open(label: &str) -> String {
        format!(r#"<svg class="small" viewBox="0 0 {WIDTH} {HEIGHT}" role="img" aria-label="{label}">"#)
    }

    /// Text at a tick of the horizontal axis, kept inside the picture.
    pub(super) fn x_label(x: f64, text: &str) -> String {
        let anchor = if x > WIDTH - 30.0 {
            "end"
        } else if x < LEFT + 5.0 {
            "start"
        } else {
            "middle"
        };
        format!(r#"<text x="{x:.1}" y="{:.1}" text-anchor="{anchor}">{text}</text>"#, HEIGHT - 5.0)
    }

    /// Text at a tick of the vertical axis.
    pub(super) fn y_label(y: f64, text: &str) -> String {
        format!(r#"<text x="{:.1}" y="{:.1}" text-anchor="end">{text}</text>"#, LEFT - 4.0, y + 3.0)
    }

    /// Horizontal line across the picture.
    pub(super) fn rule(y: f64, class: &str) -> String {
        format!(r#"<path class="{class}" d="M{LEFT:.1} {y:.1}H{:.1}"/>"#, WIDTH - RIGHT)
    }
}
