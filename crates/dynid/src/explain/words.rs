//! Verdicts of parameters, statuses, severities.

use super::Text;

dynid_record::words! {
    /// Words of results that are neither findings nor checks.
    Word {
        /// A limit moved the value.
        AtBoundary = "at the boundary",
        /// An interval with one end.
        BoundedOnOneSide = "bounded on one side",
        /// The logs do not tell the value.
        CarriedByPrior = "carried by the prior",
        /// A drive gain that the logs tell.
        Determined = "determined",
        /// A severity.
        Error = "error",
        /// A status.
        Fail = "fail",
        /// Not searched for, or stated by a tie.
        Given = "given",
        /// A whole friction law.
        Identified = "identified",
        /// A severity.
        Info = "info",
        /// A friction law that is not to be used.
        Invalid = "invalid",
        /// These logs hardly move what would show the parameter.
        NotExcited = "not excited",
        /// No motion shows the parameter.
        NotIdentifiable = "not identifiable",
        /// No friction law.
        NotIdentified = "not_identified",
        /// A shape parameter that the logs do not tell.
        NotSeen = "not seen",
        /// Friction in one direction alone.
        OneDirection = "one_direction",
        /// Seen together with others alone.
        OnlyInCombination = "only in combination",
        /// A status.
        Ok = "ok",
        /// A status.
        Pass = "pass",
        /// The logs tell the value.
        Seen = "seen in the data",
        /// A friction law with fewer terms.
        Simplified = "simplified",
        /// Noise hides the parameter.
        TooNoisy = "too noisy",
        /// A status.
        Warn = "warn",
        /// A severity.
        Warning = "warning",
        /// An interval that says little.
        Wide = "wide",
    }
}

pub(super) fn text(word: Word) -> Text {
    match word {
        Word::AtBoundary => Text(
            "A constraint, that the body can exist or a bound of the configuration, moved the value by more than a standard deviation.",
            "Trust the value less than its interval says. See the check `price of physical consistency`.",
            "dynid explain price of physical consistency",
        ),
        Word::BoundedOnOneSide => Text(
            "The logs rule out values on one side of a shape parameter alone: a Stribeck velocity may be any smaller one, for example.",
            "Take the value as a limit, or record slower motion, where the shape shows.",
            "",
        ),
        Word::CarriedByPrior => Text(
            "The logs remove less than nine tenths of the doubt about the parameter. Its value follows the robot file. The reason stands beside it: \
             only in combination, not excited, or too noisy.",
            "Do not quote the value. Efforts that the model predicts are right all the same for motions like those of the logs.",
            "",
        ),
        Word::Determined => Text(
            "The logs with and without the payload tell the gain of this drive, with an interval.",
            "Use the gain for the columns of current.",
            "[columns]\ncurrent_gains = [0.12, 0.12]",
        ),
        Word::Error => Text(
            "A finding of this severity makes nonsense of whatever is identified from the log.",
            "Apply the remedy. `identify` refuses such logs unless it is told to go on.",
            "preflight = \"warn\"",
        ),
        Word::Fail => Text(
            "The result is not to be trusted: exit code 1. The headline names the checks that failed.",
            "Ask for each of these checks, and begin with the pre-flight.",
            "dynid check LOG --robot ROBOT",
        ),
        Word::Given => Text(
            "The value was stated, or held where a search would not have told it. The logs did not judge it.",
            "Leave the statement out of the configuration to have the value found.",
            "",
        ),
        Word::Identified => Text(
            "Friction of this joint has a whole law: Coulomb, Stribeck and viscous friction with their temperatures.",
            "Use the file as known friction of an identification.",
            "dynid identify ROBOT --log LOG --known-friction dynid-friction/friction.json",
        ),
        Word::Info => Text(
            "A finding of this severity is good to know. An identification takes care of it.",
            "Nothing has to be done about it.",
            "",
        ),
        Word::Invalid => Text(
            "The law of this joint is not to be used: viscous friction vanishes within the temperatures of the experiment.",
            "Check the temperatures, or evaluate fewer of them.",
            "",
        ),
        Word::NotExcited => Text(
            "A motion of the robot would show this parameter, and the logs do not hold it.",
            "Record the motion that the report proposes.",
            "dynid design ROBOT",
        ),
        Word::NotIdentifiable => Text(
            "No motion of this robot shows the parameter: it does no work in any measured effort. The mass of the first link on a vertical axis is \
             an example.",
            "Nothing can be done with efforts of the joints. Predictions do not need the value.",
            "dynid inspect ROBOT",
        ),
        Word::NotIdentified => Text(
            "No friction law explains the points of this joint: too few passes at constant speed, or points that scatter as much as they differ.",
            "Record passes at more speeds, in both directions, and see whether effort and speed are of this joint.",
            "",
        ),
        Word::NotSeen => Text(
            "The logs tell nothing of this shape parameter within the range that was searched.",
            "Take a simpler friction law, or record motion where the shape shows.",
            "dynid identify ROBOT --log LOG --friction linear",
        ),
        Word::OneDirection => Text(
            "The joint was moved in one direction alone, so that Coulomb friction and offset cannot be told apart.",
            "Record every speed in both directions.",
            "",
        ),
        Word::OnlyInCombination => Text(
            "The parameter acts on the efforts only together with others, in any motion. The data see the combination that stands beside it.",
            "Compare and quote the combination, not the parameter.",
            "dynid inspect ROBOT",
        ),
        Word::Ok => Text(
            "The check is as it should be; of a whole result: every check is.",
            "Nothing has to be done about it.",
            "",
        ),
        Word::Pass => Text("The result is as it should be.", "Nothing has to be done about it.", ""),
        Word::Seen => Text(
            "The logs remove at least nine tenths of the doubt about the parameter. Its interval holds the true value in 95 of 100 experiments, as \
             far as the model holds all that acts.",
            "Use the value with its interval.",
            "",
        ),
        Word::Simplified => Text(
            "Friction of this joint has a law with fewer terms than were asked for, since the points cannot carry more.",
            "Use it within the speeds and temperatures of the test. Record more speeds for more terms.",
            "",
        ),
        Word::TooNoisy => Text(
            "The logs hold a motion that shows the parameter, and noise hides it.",
            "Record for longer, with larger accelerations, or at a better sensor.",
            "dynid design ROBOT",
        ),
        Word::Warn => Text(
            "The result is usable with a reservation. The headline names the checks that call for a look.",
            "Ask for each of these checks.",
            "dynid explain excitation",
        ),
        Word::Warning => Text(
            "A finding of this severity makes the result worse, or leaves something open.",
            "Apply the remedy where it is easy, and look at the figures per joint.",
            "",
        ),
        Word::Wide => Text(
            "The logs see the parameter, and the interval is still beyond 30 % of the value or of what was thought possible beforehand.",
            "Record for longer, or a motion made for identification.",
            "dynid design ROBOT",
        ),
    }
}
