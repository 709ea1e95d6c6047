//! What mends a check that did not pass: the command to type, or the line to write and its place.

use crate::check::CheckName;
use crate::identification::Identification;
use crate::joint_stiffness;
use crate::settings::Preflight;

/// Seconds of a designed motion per harmonic: as slow as the usual 5 harmonics of 20 s.
const SECONDS_PER_HARMONIC: f64 = 4.0;

/// The remedy of a check.
pub(super) fn of(id: &Identification, check: CheckName) -> String {
    let files = &id.settings.files;
    match check {
        CheckName::Preflight if id.settings.preflight == Preflight::Off => {
            "leave out `preflight = \"off\"`, so that the logs are examined".to_owned()
        }
        CheckName::Preflight => format!("`{} --fix fixed.toml` writes the configuration that puts it right", files.check()),
        CheckName::OwnLogs => "leave out the `[[log]]` that repeats the other, or the rows: `leave_out = [[1, 3000]]`".to_owned(),
        CheckName::OwnValidation => "validate on a log that was recorded apart, or on a part of the record that is not trained on: \
                           `part = [0.0, 0.7]` in the `[[log]]`, `part = [0.7, 1.0]` in the `[[validation]]`"
            .to_owned(),
        CheckName::EffortScale => scale(id),
        CheckName::ValidationFit => format!(
            "`{}` looks for columns, signs and units of the training logs; if the validation log carried something else, say so: \
             `payload = \"tool\"` in its `[[validation]]`; another friction law: `friction = \"stribeck\"` under `[elements]`",
            files.check()
        ),
        CheckName::TrainingFit => format!(
            "`{}` looks for wrong columns, signs and units; `{}` tries every estimator; friction beyond the model: \
             `known_friction = \"friction.json\"` of `dynid friction` under `[elements]`",
            files.check(),
            files.compare()
        ),
        CheckName::Excitation => {
            let motion = id.trust.motions.first().map_or_else(String::new, |m| format!(" (most helpful: {m})"));
            format!(
                "record a motion that shows the rest{motion}; `{}` writes one; add its log as a second `[[log]]`",
                files.design()
            )
        }
        CheckName::RankGap => format!(
            "`{}` lists the combinations; a length or an angle of the robot file that is nearly special, such as 1e-6 m in place \
             of 0, wants to be exact",
            files.inspect()
        ),
        CheckName::Explained => format!(
            "`{}` draws the efforts; a joint that does not take part is held: `{} = 0.0` under `[locked]`",
            files.check() + " --report check.html",
            unexplained(id)
        ),
        CheckName::AgreementOfLogs => "give the log that lies off terms of its own in its `[[log]]`: `own = [\"offset\"]`, `own = [\"friction\"]`".to_owned(),
        CheckName::PriceOfConsistency => format!(
            "`consistency = \"none\"` under `[estimator]` shows the numbers without limits; `{}` shows what the robot file states of \
             the links named; `{}` looks at signs and units",
            files.inspect(),
            files.check()
        ),
        CheckName::Stiffness => joint_stiffness::REMEDY.to_owned(),
        CheckName::Instruments => "compare controller gains and reference in `[instruments]` with those of the robot, or leave the table out"
            .to_owned(),
        CheckName::ClosedLoopBias => "`method = \"iv\"` under `[estimator]`, or a lower `kernel_hz` under `[conditioning]`".to_owned(),
        CheckName::Recipe => "mend what the doubts name, and learn again: `dynid reduce CONFIG --out NEW.factors`; then reduce all logs by it"
            .to_owned(),
        CheckName::Loads => "state coefficients near those of the joint (`mu_c = 0.1` beside `loads` of `reaction_friction`), bodies near those of the \
             robot, or friction that no load changes (`elements = [\"coulomb\", \"viscous\"]` of the joint)"
            .to_owned(),
        CheckName::Clearance => "give probes their unit (`[columns.channels] journal_j1_x = { column = \"px\", scale = 1e-6 }` for µm), measure from the \
             centre of the bearing, state the clearance that there is; or take joints as ideal: `clearance = \"ideal\"` under `[elements]`"
            .to_owned(),
        CheckName::Ties => "leave out the tie that is contradicted, or tie less: single parameters (`equal = [\"j1.fc\", \"j2.fc\"]`) in place of \
             whole joints or links"
            .to_owned(),
        CheckName::Residual => format!(
            "`{}` tells whether another estimator does better; friction is measured by `dynid friction friction.toml`, and then \
             `known_friction = \"friction.json\"` under `[elements]`; a joint behind a soft gear: `elastic` in the robot file",
            files.compare()
        ),
        CheckName::Position => format!(
            "a spring that carries the link: `beside = [\"balancer\"]` and its geometry under `[element.{0}]` of the robot file; a torsion spring: \
             `beside = [\"spring\"]`; anything else: a `[law.NAME]` whose columns read `q`; a joint or a load that is not where the file has it: put it right there",
            following(id)
        ),
        CheckName::Delay => "state the delay, if you know it: `delay_samples = 0.5` under `[conditioning]`; a friction law that bends: \
                  `friction = \"stribeck\"` under `[elements]`"
            .to_owned(),
        CheckName::ReversalMask => "measure friction at low speed: `dynid friction friction.toml`, then `known_friction = \"friction.json\"` under \
                 `[elements]`; or fix what is left out: `reversal_mask = 0.1` under `[conditioning]`"
            .to_owned(),
        CheckName::TimeBlocks | CheckName::Whiteness => longer(id),
        CheckName::Robots => "reduce logs of more robots of the type into the folder: `dynid reduce TYPE.factors --manifest MORE.csv --out FOLDER`"
            .to_owned(),
        CheckName::Condition => format!("`{}` writes a motion that lowers it; add its log as a second `[[log]]`", files.design()),
        CheckName::TermsOfLogs => format!(
            "take terms that the logs do not tell out of `own` of the `[[log]]`; `{}` examines the logs",
            files.check()
        ),
    }
}

fn scale(id: &Identification) -> String {
    let known = "`known_effort_scale = true` if the efforts are right";
    match id.effort_scale.ratio.filter(|r| r.is_finite() && *r > 0.0) {
        Some(ratio) if !id.effort_scale.masses.is_empty() => format!(
            "multiply the gains by {:.4}: `current_gains` or `scale` of the effort under `[columns]`; {known}",
            1.0 / ratio
        ),
        _ => format!(
            "weigh something that the arm moves and say so: `tool = 1.35` (kg) under `[known_mass]`; {known}"
        ),
    }
}

/// The first joint that the model does not explain.
fn unexplained(id: &Identification) -> &str {
    let outputs = dynid_model::EffortModel::outputs(&id.model);
    outputs.iter().zip(&id.explained).find(|(_, e)| !**e).map_or("joint", |(o, _)| &o.name)
}

/// The joint whose residual follows its position most.
fn following(id: &Identification) -> &str {
    let outputs = dynid_model::EffortModel::outputs(&id.model);
    let most = id.slow.iter().max_by(|a, b| a.found.share.total_cmp(&b.found.share));
    most.map_or("joint", |s| &outputs[s.output].name)
}

/// A log of the length that blocks want.
fn longer(id: &Identification) -> String {
    let (have, lacking) = (id.distinct_s(), id.lacking_s());
    if lacking == 0.0 {
        return format!("record a longer log of the same kind than {have:.0} s, or add a second `[[log]]`");
    }
    let wanted = (have + lacking).ceil();
    let harmonics = (wanted / SECONDS_PER_HARMONIC).clamp(5.0, 30.0);
    format!(
        "record {wanted:.0} s in place of {have:.0} s, in one log or several `[[log]]`s (`{} --period {wanted:.0} --harmonics {harmonics:.0}` \
         gives a motion of that length; one that repeats tells no more than its period)",
        id.settings.files.design()
    )
}
