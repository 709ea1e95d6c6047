//! Findings of the pre-flight.

use super::Text;
use crate::check::FindingId as Id;

pub(super) fn text(id: Id) -> Text {
    match id {
        Id::BaseTilt => Text(
            "The efforts show gravity in another direction than the robot file states. The base stands on a slope or hangs from a wall or ceiling, \
             or the robot file has other base axes.",
            "State gravity in base axes, or level the base. The finding gives the direction.",
            "gravity = [0.0, 0.0, -9.81]",
        ),
        Id::ClockBackwards => Text(
            "Some rows have a time that is not after every earlier one. Loggers write such rows when they join buffers or when a clock is set.",
            "Nothing: these rows are dropped. See why the logger writes them.",
            "",
        ),
        Id::ClockGap => Text(
            "Rows are missing: the time jumps by more than a few samples. Samples in gaps and what borders on them are not used.",
            "Nothing, as long as little is missing. Avoid gaps where the motion matters; log with a higher priority.",
            "",
        ),
        Id::ClockJitter => Text(
            "Steps of the clock vary. The times are often those of writing and not those of measuring.",
            "Log the time at which the joints were read. The log is resampled on a uniform grid meanwhile.",
            "",
        ),
        Id::ClockRate => Text(
            "The time does not count seconds, or its rate is off: efforts, or measured velocities, fit only after the times are multiplied by a \
             factor.",
            "State the unit of the time, or the rate that rows really come at. As a warning it is a doubt: numbers that no body can have explain the \
             log as it is, so that something may act that the robot file does not hold (a gravity compensator, a load, motors that turn several joints).",
            "[columns]\ntime = { columns = \"t\", unit = \"ms\" }",
        ),
        Id::CoarseSignal => Text(
            "The effort takes few values and keeps them while the robot moves: it hardly exceeds the resolution of its sensor.",
            "Expect little about this joint. Log the effort before it is rounded, or move with larger accelerations.",
            "",
        ),
        Id::ColumnOrder => Text(
            "Columns go to joints by number alone, and the robot's branches are so alike that no log can tell another order.",
            "Compare the list in the finding with the program that wrote the log, then state columns by the names of joints.",
            "[columns]\nposition = { \"joint_a\" = \"q1\", \"joint_b\" = \"q2\" }",
        ),
        Id::Degrees => Text(
            "Positions are in degrees where radians are expected, or the other way round. Bodies that can exist explain the efforts only after \
             the unit is changed, or positions reach many times the joint's limits.",
            "State the unit of the position.",
            "[columns]\nposition = { columns = \"q_{joint}\", unit = \"deg\" }",
        ),
        Id::Delay => Text(
            "Motion and effort of one row belong to different times. An identification finds and removes a small delay by itself.",
            "Log motion and effort by one clock, or state the delay of the motion behind the effort in samples.",
            "[conditioning]\ndelay_samples = 3.0",
        ),
        Id::DriveGain => Text(
            "Efforts are of another size than the robot asks for: by the masses of the robot file, its effort limits, or what arms of this reach \
             weigh. The unit or a torque constant is wrong, or the masses are. All masses, inertias and friction are then off by the same factor.",
            "State the unit or the gains of the efforts, or put right the masses of the robot file. If the efforts are right, say so.",
            "known_effort_scale = true",
        ),
        Id::DuplicateSamples => Text(
            "Rows repeat the row before in every position and effort although a joint moves: the log was written faster than the drives answer.",
            "Drop these rows, or log at the rate of the drives.",
            "[[log]]\npath = \"log.csv\"\ndrop_repeated = true",
        ),
        Id::EffortSign => Text(
            "An effort counts the other way than its position. Bodies that can exist explain the log only after the sign is reversed.",
            "Reverse the sign of the effort.",
            "[columns]\neffort = { columns = \"tau_{joint}\", scale = [1.0, -1.0] }",
        ),
        Id::FrozenSignal => Text(
            "A signal stays exactly the same while the robot moves: a sensor hangs, a message was lost, or the effort is not logged at all.",
            "Leave these rows out. If the whole column is constant, log the effort of this joint.",
            "[[log]]\npath = \"log.csv\"\nleave_out = [[120, 180]]",
        ),
        Id::GravitySize => Text(
            "Gravity is stated with another size than on Earth, and the log does not bear that out.",
            "State gravity in base axes, m/s²: on Earth it is 9.81 long.",
            "gravity = [0.0, 0.0, -9.81]",
        ),
        Id::IdleJoint => Text(
            "A joint stands still in this log. Its friction, its drive and most of its inertias cannot be seen here.",
            "Add a log in which it moves, or hold the joint if it never does.",
            "dynid identify ROBOT --log LOG --lock JOINT=0",
        ),
        Id::JointPermutation => Text(
            "Columns belong to other joints than they are taken for: bodies that can exist explain the efforts in another order.",
            "Assign the columns in the order of the finding; `dynid check --fix` writes it down.",
            "dynid check LOG --robot ROBOT --fix mended.toml",
        ),
        Id::NotExamined => Text(
            "Order, signs and units of the columns were not tried in other ways, for the reason that is told: loops, springs, missing channels, or \
             too little motion.",
            "Nothing if the columns are known to be right. Otherwise record for longer, with all joints moving.",
            "",
        ),
        Id::PositionRange => Text(
            "Positions are beyond what any joint reaches: encoder counts, or damaged values.",
            "State the scale of the position. Leave single damaged rows out.",
            "[columns]\nposition = { columns = \"q_{joint}\", scale = 1.9174759848570515e-4 }",
        ),
        Id::PositionSign => Text(
            "A position counts the other way than the joint's axis in the robot file.",
            "Reverse the sign of the position, or turn the axis in the robot file if the log is right.",
            "[columns]\nposition = { columns = \"q_{joint}\", scale = [1.0, -1.0] }",
        ),
        Id::PositionWrap => Text(
            "A position jumps by whole turns where the joint passes the end of its encoder.",
            "Nothing: it was unwrapped. See that the logger keeps turns apart where a joint has limits.",
            "",
        ),
        Id::PositionZero => Text(
            "A position counts from another zero than the robot file: bodies that can exist explain the efforts with an angle added.",
            "State the offset of the position, or the zero of the joint in the robot file.",
            "[columns]\nposition = { columns = \"q_{joint}\", offset = [0.0, 1.5708] }",
        ),
        Id::RepeatedLog => Text(
            "Two logs share rows. Rows that count twice make intervals too narrow; a validation on training rows shows nothing.",
            "Leave out one of the two, and validate on a recording of its own.",
            "",
        ),
        Id::Saturation => Text(
            "The effort stays exactly at its largest or smallest value: the drive or its sensor is at its limit, and the true effort is larger than the \
             log says.",
            "Leave these rows out, or record a slower trajectory that keeps within the limits.",
            "dynid design ROBOT --share 0.8",
        ),
        Id::Spikes => Text(
            "Single samples stand out of their neighbours: lost bits, bad contacts. Few are replaced by the running median.",
            "Mend the sensor or its connection. A robust estimator gives many of them no weight.",
            "dynid identify ROBOT --log LOG --estimator tukey",
        ),
        Id::UnexplainedEffort => Text(
            "No order, sign, unit, zero, gravity, clock or delay that was tried lets bodies that can exist explain the efforts.",
            "See whether robot file and log are of the same robot and whether something else acts on it: a tool, a spring, a contact, a person. Several \
             columns may be wrong at once; begin with the names of columns.",
            "dynid check LOG --robot ROBOT --report check.html",
        ),
        Id::VelocityMismatch => Text(
            "A measured velocity is not the derivative of its position: another sign, another unit, or another joint's.",
            "Nothing for an identification, which differentiates positions. Put the column right before it is used elsewhere.",
            "",
        ),
        Id::WeakExcitation => Text(
            "The motion does not show all base parameters, or shows some of them only faintly.",
            "Record a trajectory that is made for identification. Verdicts say which parameters this log still tells.",
            "dynid design ROBOT",
        ),
    }
}
