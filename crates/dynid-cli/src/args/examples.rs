//! Examples and exit codes at the end of every help text and manual page.

/// The end of a command's help.
struct Ending {
    command: &'static str,
    /// What exit code 1 says; empty if there is none.
    negative: &'static str,
    /// What an example does, and its line without the program's name.
    examples: &'static [(&'static str, &'static str)],
}

const ENDINGS: &[Ending] = &[
    Ending {
        command: "backlash",
        negative: "",
        examples: &[
            ("Look for backlash in two logs", "backlash dynid-out/estimate.json --log a.csv --log b.csv"),
            (
                "The same in the logs of a configuration, for programs",
                "backlash dynid-out/estimate.json --config run.toml --json",
            ),
        ],
    },
    Ending {
        command: "check",
        negative: "a finding makes nonsense of a log",
        examples: &[
            ("Examine a log", "check log.csv --robot arm.urdf"),
            (
                "Examine the logs of a configuration, and write one with the remedies",
                "check run.toml --fix mended.toml",
            ),
            (
                "Examine another log by the same configuration",
                "check run.toml --log other.csv --report check.html",
            ),
        ],
    },
    Ending {
        command: "clearance",
        negative: "",
        examples: &[(
            "Clearances of joints from a log",
            "clearance arm.toml dynid-out/estimate.json --log log.csv",
        )],
    },
    Ending {
        command: "compare",
        negative: "no estimator could be judged",
        examples: &[
            ("Rank estimators on a log", "compare arm.urdf --log log.csv"),
            ("Rank them by a configuration, with a report", "compare run.toml --report compare.html"),
        ],
    },
    Ending {
        command: "completions",
        negative: "",
        examples: &[
            (
                "Complete commands in this bash",
                "completions bash > ~/.local/share/bash-completion/completions/dynid",
            ),
            ("Complete commands in zsh", "completions zsh > ~/.zfunc/_dynid"),
        ],
    },
    Ending {
        command: "convert",
        negative: "",
        examples: &[
            ("All columns of a bag, as a table", "convert log.mcap log.parquet"),
            (
                "The signals of a robot, from an episode of a dataset",
                "convert dataset#12 log.csv --robot arm.urdf",
            ),
        ],
    },
    Ending {
        command: "design",
        negative: "no trajectory within all limits was found, or a format of --also cannot hold it",
        examples: &[
            ("Design a motion of 20 s for a robot file", "design arm.urdf --out motion"),
            (
                "A longer one with more harmonics, from and to the parking pose",
                "design arm.urdf --period 40 --harmonics 8 --park",
            ),
            ("By a configuration", "design design.toml --starts 32"),
        ],
    },
    Ending {
        command: "diff",
        negative: "the models differ",
        examples: &[
            (
                "What changed from one identification to the next",
                "diff before/estimate.json after/estimate.json",
            ),
            (
                "What a robot file has different from what was identified",
                "diff arm.urdf dynid-out/estimate.json --all",
            ),
            ("Difference of the effort at states of one's own", "diff a.json b.json --states states.csv"),
        ],
    },
    Ending {
        command: "explain",
        negative: "",
        examples: &[
            ("What a finding of the pre-flight means", "explain column_order"),
            ("What a check of an identification means", "explain \"residual against sensor noise\""),
            ("All names", "explain"),
        ],
    },
    Ending {
        command: "export",
        negative: "",
        examples: &[
            (
                "The robot file with identified parameters",
                "export dynid-out/estimate.json --urdf arm-identified.urdf",
            ),
            (
                "A model for MuJoCo and one with everything",
                "export dynid-out/estimate.json --mjcf arm.xml --model arm.json",
            ),
            ("To another program", "export dynid-out/estimate.json --urdf - --quiet"),
        ],
    },
    Ending {
        command: "fleet",
        negative: "",
        examples: &[
            ("What the logs of a fleet say together", "fleet factors --out fleet"),
            (
                "Friction that follows the temperature, with a page of one robot",
                "fleet factors --covariates temperature --robot r17 --out fleet",
            ),
        ],
    },
    Ending {
        command: "friction",
        negative: "no joint's friction could be identified",
        examples: &[(
            "Friction laws from constant-speed tests",
            "friction friction.toml --out dynid-friction",
        )],
    },
    Ending {
        command: "gains",
        negative: "no gain could be determined",
        examples: &[("Drive gains from logs with and without a weighed payload", "gains payload.toml")],
    },
    Ending {
        command: "identify",
        negative: "the verdict of the identification is `fail`",
        examples: &[
            (
                "Identify from one log, judge on another",
                "identify arm.urdf --log train.csv --validate valid.csv",
            ),
            ("By a configuration, into a folder", "identify run.toml --out dynid-out"),
            ("The same settings on another log", "identify run.toml --log other.csv --rows 1:5000"),
            ("The estimate to another program", "identify run.toml --json --quiet"),
        ],
    },
    Ending {
        command: "init",
        negative: "the configuration has lines to fill in",
        examples: &[
            ("A configuration for one log, part of which is kept for validation", "init arm.urdf log.csv"),
            ("Of several logs the last one is kept; to standard output", "init arm.urdf a.csv b.csv --out -"),
        ],
    },
    Ending {
        command: "inspect",
        negative: "",
        examples: &[
            ("What can be identified of a robot", "inspect arm.urdf"),
            (
                "With friction and rotors at every joint",
                "inspect arm.urdf --elements coulomb,viscous,offset,rotor --json",
            ),
            ("What a log holds", "inspect log.mcap"),
        ],
    },
    Ending {
        command: "man",
        negative: "",
        examples: &[
            ("Write all manual pages", "man --out ~/.local/share/man/man1"),
            ("Read the page of the program", "man | man -l -"),
        ],
    },
    Ending {
        command: "merge",
        negative: "",
        examples: &[("All factors of a folder as one file", "merge cells/*.factors --out all.factors")],
    },
    Ending {
        command: "motion",
        negative: "a format of --also cannot hold the motion",
        examples: &[
            (
                "Constant speeds of two joints, one after the other, for `friction`",
                "motion arm.urdf --sweep shoulder --sweep elbow --speeds 0.05,0.1,0.2,0.4",
            ),
            (
                "By a motion file, slower where a limit asks for it",
                "motion motion.toml --slower --out motion",
            ),
        ],
    },
    Ending {
        command: "next",
        negative: "no wanted interval can be reached, there is no motion within all limits, or a format of --also cannot hold it",
        examples: &[
            (
                "What to record next, so that a friction is known to 5 %",
                "next arm.urdf --after arm.factors --want joint2.fc=5%",
            ),
            (
                "So that two rotors are known to 0.01 kg m², with limits by a design file and logs of two cells",
                "next design.toml --after cell.factors --after lab.factors --want j3.Ia=0.01 --want j4.Ia=0.01",
            ),
        ],
    },
    Ending {
        command: "online",
        negative: "something changed",
        examples: &[
            ("Follow the logs of a configuration", "online run.toml"),
            ("Follow samples from another program", "online run.toml --stream csv --checkpoint state.json"),
        ],
    },
    Ending {
        command: "payload",
        negative: "no mass could be determined",
        examples: &[("Mass, centre and inertia of a payload", "payload payload.toml --out dynid-payload")],
    },
    Ending {
        command: "predict",
        negative: "",
        examples: &[
            ("Efforts at states, as CSV", "predict dynid-out/estimate.json --states states.csv"),
            (
                "The same of states that another program makes",
                "predict dynid-out/estimate.json --states - --out efforts.csv",
            ),
        ],
    },
    Ending {
        command: "reduce",
        negative: "a check of the identification that teaches the recipe failed",
        examples: &[
            (
                "Learn a recipe on the logs of a configuration, and reduce them",
                "reduce dynid.toml --out cell.factors",
            ),
            (
                "Reduce another log by the same recipe, anywhere",
                "reduce cell.factors --log other.csv --out other.factors",
            ),
            (
                "Reduce the logs of a fleet into a folder, the first of eight processes",
                "reduce type.factors --manifest logs.csv --shard 1/8 --out factors",
            ),
        ],
    },
    Ending {
        command: "regressor",
        negative: "",
        examples: &[
            ("Efforts of a robot file at states", "regressor arm.urdf --states states.csv"),
            (
                "Regressor rows in base parameters",
                "regressor arm.urdf --states states.csv --rows 1:100 --base --json",
            ),
        ],
    },
    Ending {
        command: "schema",
        negative: "",
        examples: &[("What there is", "schema"), ("What `estimate.json` holds", "schema estimate")],
    },
    Ending {
        command: "servo",
        negative: "the simulation predicts no better than the command itself, or the fit did not settle",
        examples: &[
            (
                "Drives of a hobby arm from two logs, judged on a third",
                "servo arm.urdf --log sweep.csv --log steps.csv --validate pick.csv",
            ),
            (
                "Legs in the air with stated gains",
                "servo go2.xml --log chirps.csv --position-gain 20 --velocity-gain 1.5",
            ),
            ("By a configuration, into a folder", "servo servo.toml --out dynid-servo"),
        ],
    },
    Ending {
        command: "simulate",
        negative: "",
        examples: &[
            ("A virtual log of 10 s", "simulate arm.urdf --duration 10 --out log.csv"),
            (
                "Of a controlled robot that follows a designed motion",
                "simulate arm.urdf --closed-loop --follow dynid-design/trajectory.json --out log.csv.gz",
            ),
            ("To another program", "simulate arm.urdf --out - --quiet"),
        ],
    },
    Ending {
        command: "solve",
        negative: "a check failed",
        examples: &[
            ("Estimate from factors that several machines made", "solve a.factors b.factors --out dynid-out"),
            ("Judge the result on a log", "solve all.factors --validate other.csv"),
        ],
    },
    Ending {
        command: "study",
        negative: "a claim does not hold",
        examples: &[("What there is", "study list"), ("One study, in short", "study indy7 --quick")],
    },
    Ending {
        command: "validate",
        negative: "an error is beyond --max-error",
        examples: &[
            ("Compare with a log", "validate dynid-out/estimate.json --log other.csv"),
            (
                "Fail beyond 5 % of the effort",
                "validate dynid-out/estimate.json --log other.csv --max-error 5 --quiet",
            ),
        ],
    },
];

/// The end of the program's help.
const START: &str = "\
First steps:
  # Look for faults in a log
  dynid check log.csv --robot arm.urdf
  # Identify from it, judge on another one
  dynid identify arm.urdf --log log.csv --validate other.csv
  # What a word of the result means
  dynid explain

Results go to standard output, all else to standard error. `-` in the place of a file is standard input or output.
Exit codes: 0 done; 1 done, and the verdict is negative; 2 bad input or usage.";

/// Adds examples and exit codes to the help of every command.
pub(super) fn with_examples(program: clap::Command) -> clap::Command {
    ENDINGS.iter().fold(program.after_help(START), |program, ending| {
        program.mut_subcommand(ending.command, |command| command.after_help(text(ending)))
    })
}

fn text(ending: &Ending) -> String {
    let examples: String =
        ending.examples.iter().map(|(what, line)| format!("  # {what}\n  dynid {line}\n")).collect();
    let negative = match ending.negative {
        "" => String::new(),
        words => format!(" 1 {words};"),
    };
    format!("Examples:\n{examples}\nExit codes: 0 done;{negative} 2 bad input or usage.")
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory;

    use super::*;
    use crate::args::{Cli, definition};

    #[test]
    fn every_command_has_an_example_and_every_example_parses() {
        let commands: Vec<String> =
            Cli::command().get_subcommands().map(|c| c.get_name().to_owned()).collect();
        let named: Vec<&str> = ENDINGS.iter().map(|e| e.command).collect();
        assert_eq!(commands, named, "in the order of the names");
        for ending in ENDINGS {
            assert!(!ending.examples.is_empty(), "{}", ending.command);
            for (_, line) in ending.examples {
                assert_eq!(line.split(' ').next(), Some(ending.command), "{line}");
                let words = words(line);
                let parsed =
                    definition().try_get_matches_from(std::iter::once("dynid".to_owned()).chain(words));
                assert!(parsed.is_ok(), "{line}: {}", parsed.unwrap_err());
            }
        }
    }

    /// Words of a line as a shell splits it, up to a redirection.
    fn words(line: &str) -> Vec<String> {
        let command = line.split(" > ").next().unwrap_or_default();
        let mut words = vec![String::new()];
        let mut quoted = false;
        for c in command.chars() {
            match c {
                '"' => quoted = !quoted,
                ' ' if !quoted => words.push(String::new()),
                c => words.last_mut().unwrap().push(c),
            }
        }
        words
    }
}
