//! A picture with two scaled axes: frame, grid and numbers.

use super::chart::Scale;

/// Place of the picture in its SVG.
pub(super) struct Sheet {
    pub(super) x: Scale,
    pub(super) y: Scale,
    pub(super) left: f64,
    pub(super) right: f64,
    pub(super) top: f64,
    pub(super) floor: f64,
}

impl Sheet {
    pub(super) fn px(&self, x: f64) -> f64 {
        self.left + (self.x.of(x) - self.x.low) / (self.x.high - self.x.low) * (self.right - self.left)
    }

    pub(super) fn py(&self, y: f64) -> f64 {
        self.top + (self.y.high - self.y.of(y)) / (self.y.high - self.y.low) * (self.floor - self.top)
    }

    /// Numbers at both axes; lines across with `grid`.
    pub(super) fn axes(&self, svg: &mut String, grid: bool) {
        for (value, text) in self.y.ticks(5.0) {
            let at = self.py(self.y.back(value));
            if grid {
                svg.push_str(&format!(
                    r#"<path class="grid" d="M{:.1} {at:.1}H{:.1}"/>"#,
                    self.left, self.right
                ));
            }
            svg.push_str(&format!(
                r#"<text x="{:.1}" y="{:.1}" text-anchor="end">{text}</text>"#,
                self.left - 6.0,
                at + 3.5
            ));
        }
        for (value, text) in self.x.ticks(6.0) {
            let at = self.px(self.x.back(value));
            if grid {
                svg.push_str(&format!(
                    r#"<path class="grid" d="M{at:.1} {:.1}V{:.1}"/>"#,
                    self.top, self.floor
                ));
            }
            svg.push_str(&format!(
                r#"<text x="{at:.1}" y="{:.1}" text-anchor="middle">{text}</text>"#,
                self.floor + 15.0
            ));
        }
        svg.push_str(&format!(
            r#"<path class="axis" d="M{:.1} {:.1}V{:.1}H{:.1}"/>"#,
            self.left, self.top, self.floor, self.right
        ));
    }
}
