//! Checks behind the verdict of an identification.

use super::Text;
use crate::verdict::CheckName as Name;

pub(super) fn text(name: Name) -> Text {
    match name {
        Name::AgreementOfLogs => Text(
            "The fit holds offsets and friction the same in all training logs. This check asks whether the logs agree: a log whose friction or \
             offset deviates by more than a quarter of the residual contradicts the others.",
            "Give the deviating log terms of its own, or identify from logs of one temperature and one tool.",
            "[[log]]\npath = \"log.csv\"\nown = [\"offset\"]",
        ),
        Name::ClosedLoopBias => Text(
            "A controller feeds noise of the positions back into the efforts, which biases least squares. The check compares least squares with \
             instrumental variables, which are free of this bias.",
            "Lower the cut-off of the kernel, or take the values of the instruments.",
            "[estimator]\nmethod = \"iv\"\n\n[instruments]\nreference = \"q_ref_{joint}\"",
        ),
        Name::Condition => Text(
            "The condition number says how strongly errors of the effort are amplified in the parameters, with all columns at unit length. \
             Standard deviations know of it, so that a large one alone makes no model wrong.",
            "Record a better excitation trajectory.",
            "dynid design ROBOT",
        ),
        Name::Delay => Text(
            "The time by which motion and effort of one row are apart. A value at the end of the search is no measurement; joints that disagree point \
             to a friction shape that is missing.",
            "Log motion and effort by one clock, let friction shapes be found, or state the delay.",
            "[conditioning]\ndelay_samples = 3.0",
        ),
        Name::EffortScale => Text(
            "No motion tells whether all efforts are too large by one factor: all masses, inertias and friction would be too. The check says what \
             speaks for the scale: a weighed mass, the masses of the robot file, or nothing.",
            "Weigh a payload or a link and state its mass, or say that the efforts are right.",
            "known_effort_scale = true",
        ),
        Name::Excitation => Text(
            "Base parameters are the combinations that some motion of the robot can reveal. The check counts how many of them these logs reveal; \
             the others keep the robot file's value.",
            "Record a motion that shows the rest; the report says which motions would help.",
            "dynid design ROBOT",
        ),
        Name::Explained => Text(
            "The effort of these joints is mostly something else than the model: poor sensing of the current, friction at rest, or a wrong column. \
             Their rows count for nothing in the verdicts.",
            "Run the pre-flight; see whether the joint moves and whether its effort is logged in the right column.",
            "dynid check LOG --robot ROBOT",
        ),
        Name::Position => Text(
            "What the model leaves over of these joints is a function of their position, on parts of the motion that it was not fitted to: a gravity \
             compensator, a spring, a cable, a gear that is not round, or an axis that is not where the robot file has it. Efforts of up to three whole \
             repetitions a turn are taken by themselves; this is what remains.",
            "State what acts there: a spring beside the joint by its geometry (`balancer` in the robot file), a torsion spring (`spring`), or a law of the position.",
            "[elements]\njoint = { j2 = [\"coulomb\", \"viscous\", \"offset\", \"rotor\", \"slow\"] }\n\n[law.slow]\nfriction = false\ncolumns = { sa = \"cos(2 * q)\", sb = \"sin(2 * q)\" }",
        ),
        Name::Instruments => Text(
            "The estimators `iv`, `didim` and `cloe` simulate the closed loop. The check says whether the simulations settled, whether instruments \
             resemble the measured motion, and whether the parameters of the other two explain the measured efforts as least squares does.",
            "Put right the reference, the controller or the model in the configuration.",
            "[instruments]\nreference = \"q_ref_{joint}\"\nbandwidth_hz = 5.0",
        ),
        Name::OwnLogs => Text(
            "Training logs share rows. These rows count more than once, so that all intervals are too narrow.",
            "Leave out the log that repeats the other.",
            "",
        ),
        Name::OwnValidation => Text(
            "A validation log shares rows with a training log: the model was fitted to what it is judged on.",
            "Validate on a recording of its own.",
            "dynid identify ROBOT --log LOG --validate OTHER",
        ),
        Name::Preflight => Text(
            "Before anything is identified, the logs are examined: columns, signs, units, clock, gravity. An error there makes nonsense of any model.",
            "Look at the findings one by one, and apply the remedies.",
            "dynid check LOG --robot ROBOT --fix mended.toml",
        ),
        Name::PriceOfConsistency => Text(
            "Parameters are held to bodies that can exist. The check says by how much the error on held-out data rises for it. More than chance means \
             that model, robot file or log is wrong where a limit acts.",
            "Look at the links that are named: an element that is missing, a wrong gain of one joint, a payload that the file does not know.",
            "dynid identify ROBOT --log LOG --consistency none",
        ),
        Name::RankGap => Text(
            "The geometry of the robot decides which combinations of parameters can be identified. The gap says how clearly; a small one is a robot \
             file near a special geometry, such as axes that are parallel up to rounding.",
            "Write angles and lengths of the robot file with more digits, or exactly.",
            "dynid inspect ROBOT",
        ),
        Name::Residual => Text(
            "What the model leaves over, against the noise of the effort's sensor. More than twice the noise means that something acts which the model \
             does not hold: a shape of friction, elasticity, ripple, cables. Standard deviations do not cover that.",
            "Let friction shapes be found, add elements, compare estimators. A model may be good enough for its use all the same: see the errors per joint.",
            "dynid identify ROBOT --log LOG --friction auto",
        ),
        Name::Recipe => Text(
            "Factors hold no samples: what the logs that taught their recipe left in doubt about the delay, the reversal mask and the fit cannot be \
             looked at again when they are solved. The check passes these doubts on.",
            "Mend what they name in the configuration, learn the recipe again, and reduce all logs by it.",
            "dynid reduce dynid.toml --out cell.factors",
        ),
        Name::Clearance => Text(
            "Journals that move in their bearings change the geometry, and their friction follows the load. Probes at the journals (columns \
             `journal_j1_x`, `journal_j1_y`) say where they are; without them they count as resting where their load presses them. The check says \
             how much that adds to the effort, and doubts probes that are far off the stated clearance and loads that may leave a journal free. Efforts \
             see the product of friction and load: a coefficient is known no better than the masses.",
            "Give the probes' unit and zero, state the clearance that there is, weigh the links; or take joints as ideal \
             (`clearance = \"ideal\"` under `[elements]`).",
            "dynid clearance ROBOT ESTIMATE --log LOG",
        ),
        Name::Loads => Text(
            "Friction that follows a load (`reaction_friction`, bearings with `clearance`) makes efforts depend on products of parameters. The fit takes the loads at the \
             parameters that it finds, round by round, until both agree. Where they do not, friction may be so large that it locks the joint, or the logs \
             say too little about what presses on it.",
            "State coefficients and bodies near those of the machine, or friction that no load changes, and compare both on a log that neither has seen.",
            "dynid identify ROBOT --log LOG --validate OTHER",
        ),
        Name::Ties => Text(
            "Ties say that parameters are equal, in proportion, known or add up. The fit is made again with all of them free; where the residual falls \
             further than chance has it (F test at 1 %, colour of the residuals counted), the machine is not as the ties say. Values are then a compromise, \
             and no interval covers that.",
            "Leave out the tie that is named, or tie single parameters in place of whole joints or links.",
            "dynid identify dynid.toml",
        ),
        Name::ReversalMask => Text(
            "Rows near reversal, where friction is least like its law, may be left out. The check says whether the result depends on how many are.",
            "Choose another friction law, or state the mask.",
            "dynid identify ROBOT --log LOG --reversal-mask 0.1",
        ),
        Name::Robots => Text(
            "Of a model that a fleet gives: how many robots tell how robots of the type differ. Standard deviations of the type come from leaving out \
             one robot at a time, those of a robot from the mixed model. Few robots make them uncertain.",
            "Add logs of more robots of the type.",
            "dynid reduce TYPE.factors --manifest MORE.csv --out FOLDER",
        ),
        Name::Stiffness => Text(
            "Joints with springs: their stiffness told a second time, by the deformation between the two encoders.",
            "Record a motion that loads the springs more, or take the joints as stiff ones.",
            "",
        ),
        Name::TermsOfLogs => Text(
            "Offsets and friction that single logs have of their own, and how many of them lie off by more than three standard deviations. It is for \
             information.",
            "Nothing has to be done: the terms are part of the model of their logs and not of the robot.",
            "",
        ),
        Name::TimeBlocks => Text(
            "Standard deviations come from leaving out one block of time at a time, of fewer than ten blocks from one inflation for all parameters. \
             Few blocks, or blocks shorter than the residuals stay correlated, make them uncertain or too small.",
            "Record for longer, or several logs.",
            "[conditioning]\nblock_s = 2.0",
        ),
        Name::TrainingFit => Text(
            "Share of the effort's variance that the model explains on the logs it was fitted to, where the joints move; the worst joint counts.",
            "Below 0.9, look at that joint: its columns, its friction, what else acts on it.",
            "dynid check LOG --robot ROBOT",
        ),
        Name::ValidationFit => Text(
            "Share of the effort's variance that the model explains on logs it has not seen, where the joints move; the worst joint counts. This is the \
             figure to trust.",
            "Where it is much below the fit on training logs, the training motion did not show enough, or the logs differ in load or temperature.",
            "dynid validate ESTIMATE --log LOG",
        ),
        Name::Whiteness => Text(
            "Inside the band of the fit, residuals should look like white noise. Coloured ones come from what the model does not hold; plain standard \
             deviations are then too small. Those that dynid prints are robust.",
            "Look at the frequency that is named: ripple of a gear, an elasticity, a friction shape.",
            "",
        ),
    }
}
