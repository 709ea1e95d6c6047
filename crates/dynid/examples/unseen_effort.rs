//! Draws the picture of the README: effort of a joint on a log that the model has not seen, measured, predicted, and their difference.
//!
//! `cargo run --release -p dynid --example unseen_effort` from the root of the repository.

use std::fmt::Write as _;
use std::path::Path;

use dynid::{Config, identify};

const OUT: &str = "docs/book/src/images/unseen-effort.svg";
/// Joint that is drawn, from 0.
const JOINT: usize = 1;
/// Seconds of the log that are drawn.
const SECONDS: f64 = 8.0;
/// Samples between two points of a curve.
const STRIDE: usize = 2;

const OPENING: &str = r##"<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 800 340" font-family="sans-serif" font-size="13" fill="#333">
<rect width="800" height="340" fill="#fff"/>
"##;

/// Place of a panel, in pixels.
struct Panel {
    top: f64,
    bottom: f64,
    /// Efforts at bottom and top, N m.
    range: [f64; 2],
}

const LEFT: f64 = 64.0;
const RIGHT: f64 = 784.0;

impl Panel {
    fn y(&self, effort: f64) -> f64 {
        let [low, high] = self.range;
        self.bottom - (effort - low) / (high - low) * (self.bottom - self.top)
    }

    fn grid(&self, svg: &mut String, marks: &[f64]) {
        for mark in marks {
            let y = self.y(*mark);
            let _ = writeln!(
                svg,
                r##"<line x1="{LEFT}" x2="{RIGHT}" y1="{y:.1}" y2="{y:.1}" stroke="#d8dde3"/>"##
            );
            let _ = writeln!(
                svg,
                r#"<text x="{}" y="{:.1}" text-anchor="end">{mark}</text>"#,
                LEFT - 8.0,
                y + 4.0
            );
        }
    }

    fn curve(&self, svg: &mut String, values: &[f64], rate_hz: f64, style: &str) {
        let points = values.iter().enumerate().step_by(STRIDE).map(|(i, effort)| {
            let x = LEFT + i as f64 / rate_hz / SECONDS * (RIGHT - LEFT);
            format!("{x:.1},{:.1}", self.y(*effort))
        });
        let points: Vec<String> = points.collect();
        let _ = writeln!(svg, r#"<polyline fill="none" {style} points="{}"/>"#, points.join(" "));
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let config = Config::read(Path::new("examples/indy7/identify.toml"))?;
    let identification = identify(&config, &mut |_step| ())?;
    let log = identification.validation.first().ok_or("the example has a validation log")?;
    let from = log.counted.iter().position(|&counted| counted).unwrap_or(0);
    let to = log.measured[JOINT].len().min(from + (SECONDS * log.rate_hz) as usize);
    let (measured, predicted) = (&log.measured[JOINT][from..to], &log.predicted[JOINT][from..to]);
    let difference: Vec<f64> = measured.iter().zip(predicted).map(|(m, p)| m - p).collect();

    let mut svg = String::from(OPENING);
    let largest = measured.iter().fold(1.0_f64, |a, b| a.max(b.abs()));
    let round = (largest / 50.0).ceil() * 50.0;
    let effort = Panel { top: 34.0, bottom: 200.0, range: [-round, round] };
    effort.grid(&mut svg, &[-round, 0.0, round]);
    effort.curve(&mut svg, measured, log.rate_hz, r##"stroke="#f0a35e" stroke-width="4""##);
    effort.curve(&mut svg, predicted, log.rate_hz, r##"stroke="#17375e" stroke-width="1.4""##);
    let left = Panel { top: 234.0, bottom: 300.0, range: [-15.0, 15.0] };
    left.grid(&mut svg, &[-15.0, 0.0, 15.0]);
    left.curve(&mut svg, &difference, log.rate_hz, r##"stroke="#8a8f98" stroke-width="1""##);
    for second in 0..=SECONDS as usize {
        let x = LEFT + second as f64 / SECONDS * (RIGHT - LEFT);
        let _ = writeln!(svg, r#"<text x="{x:.1}" y="317" text-anchor="middle">{second}</text>"#);
    }
    let _ = writeln!(
        svg,
        r#"<text x="{LEFT}" y="20">effort of joint 2, N m, on a log that the model has not seen</text>"#
    );
    let _ = writeln!(
        svg,
        r##"<text x="{RIGHT}" y="20" text-anchor="end"><tspan fill="#c9711d">measured</tspan>, <tspan fill="#17375e">predicted</tspan></text>"##
    );
    let _ = writeln!(
        svg,
        r#"<text x="{LEFT}" y="226">difference, N m</text><text x="{RIGHT}" y="333" text-anchor="end">time, s</text>"#
    );
    svg.push_str("</svg>\n");
    std::fs::create_dir_all(Path::new(OUT).parent().ok_or("a folder")?)?;
    std::fs::write(OUT, svg)?;
    Ok(())
}
