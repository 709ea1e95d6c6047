//! Sections of the report on what goes beyond the paper, and on trajectories.

use dynid::report::{StudySection, Value};

use super::report::Contents;
use super::{figures, fits, trajectory};
use crate::StudyError;
use crate::page::{table, text};

impl Contents<'_> {
    pub(super) fn upright_section(&self) -> StudySection {
        let (h, v) = (&self.upright.horizontal, &self.upright.vertical);
        let rows = fits::MODELS.iter().enumerate().map(|(k, model)| {
            vec![
                text(fits::name(*model)),
                Value::from(h.clean[k]),
                Value::from(v.clean[k]),
                Value::from(h.circle[k]),
                Value::from(v.circle[k]),
            ]
        });
        let forces = self.upright.normal.iter().enumerate().map(|(k, [low, mean, high])| {
            vec![text((k + 1).to_string()), Value::from(*low), Value::from(*mean), Value::from(*high)]
        });
        StudySection {
            title: "The mechanism upright".into(),
            text: vec![
                "With gravity in the plane no weight rests on the guideway beside the reactions, and all of the friction follows them."
                    .into(),
            ],
            tables: vec![
                table(
                    "N rms: residual without noise, and error on the circle after 2 N of noise",
                    &["law", "residual, horizontal", "residual, upright", "circle, horizontal", "circle, upright"],
                    rows.collect(),
                ),
                table("Forces on the guideway, upright, N", &["slider", "least", "mean", "largest"], forces.collect()),
            ],
            ..StudySection::default()
        }
    }

    pub(super) fn shares_section(&self) -> StudySection {
        let rows = self.weights.tried.iter().map(|tried| {
            let shares = tried.shares.map(|s| s.to_string()).join(" / ");
            let mut row = vec![text(&shares), Value::from(tried.free), Value::from(tried.bounded)];
            row.extend(tried.masses.map(Value::from));
            row
        });
        StudySection {
            title: "Shares of the platform's weight".into(),
            text: vec![
                "The paper tried shares of the platform's weight on the sliders by hand. Forces tell the weight on every slider, not what it \
                 is made of: with other shares other masses fit as well. What little J changes within bounds is the bounds' doing."
                    .into(),
            ],
            tables: vec![table(
                "Least squares with other shares, 2 N of noise",
                &["shares", "J without bounds, ratio", "J within bounds, ratio", "m_L1, kg", "m_L2, kg", "m_L3, kg", "m_p, kg"],
                rows.collect(),
            )],
            ..StudySection::default()
        }
    }

    pub(super) fn design_section(&self) -> Result<StudySection, StudyError> {
        let mut rows =
            vec![vec![text("reference"), text("-"), Value::from(self.designs.reference), text("-")]];
        for d in &self.designs.found {
            rows.push(vec![
                text(format!("random, seed {}", d.seed)),
                text(format!("{:.2e}", d.start)),
                Value::from(d.end),
                Value::from(d.force),
            ]);
        }
        let mut charts = Vec::new();
        if let Some(best) = self.designs.best() {
            let motion = trajectory::designed_motion(self.settings, &best.rows, 500)?;
            for mut chart in figures::motion(self.machine, &motion) {
                chart.note = "The best trajectory of ours.".into();
                charts.push(chart);
            }
        }
        Ok(StudySection {
            title: "Trajectories of our own".into(),
            text: vec![
                "Fourier series of the platform's pose, designed for G = cond + 10/σ_min of the nine base columns. Limits are those of the \
                 sliders and legs, which follow from the pose; gradients are exact."
                    .into(),
            ],
            tables: vec![table("G", &["", "at the start", "at the end", "largest force, N"], rows)],
            charts,
            ..StudySection::default()
        })
    }
}
