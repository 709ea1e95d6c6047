//! Words of result files: states as enumerations with serde and JSON Schema.
//!
//! One enumeration per idea. Its words are those of the files, stand in one place, and never change: files that were written before are
//! read. What pages and messages say of a state in other words is theirs.
//!
//! ```
//! use dynid_record::Status;
//!
//! assert_eq!(Status::Warn.word(), "warn");
//! assert_eq!(Status::of_word("fail"), Some(Status::Fail));
//! assert!(Status::Ok < Status::Fail);
//! ```

/// An enumeration of the words of a result file.
///
/// Each variant stands with its word. The enumeration is read and written as its word, lists its words in JSON Schemas, prints its word, and
/// has `ALL`, `word` and `of_word`. Further derives stand before its name. The crate that uses it depends on `serde` and `schemars`.
///
/// ```
/// dynid_record::words! {
///     /// Ends of a search.
///     End {
///         /// Nothing changed any more.
///         Settled = "settled",
///         /// Rounds ran out.
///         Limit = "limit",
///     }
/// }
///
/// assert_eq!(End::Settled.to_string(), "settled");
/// assert_eq!(End::ALL.len(), 2);
/// ```
#[macro_export]
macro_rules! words {
    ($(#[$doc:meta])* $kind:ident { $($(#[$text:meta])* $variant:ident = $word:tt,)+ }) => {
        $(#[$doc])*
        #[derive(
            Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash,
            serde::Serialize, serde::Deserialize, schemars::JsonSchema,
        )]
        pub enum $kind {
            $($(#[$text])* #[serde(rename = $word)] $variant,)+
        }

        impl $kind {
            /// Every variant once.
            pub const ALL: &'static [$kind] = &[$($kind::$variant,)+];

            /// The variant of a word.
            pub fn of_word(word: &str) -> Option<Self> {
                Self::ALL.iter().copied().find(|known| known.word() == word)
            }

            /// The word as written and printed.
            pub const fn word(self) -> &'static str {
                match self {
                    $($kind::$variant => $word,)+
                }
            }
        }

        impl std::fmt::Display for $kind {
            fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.pad(self.word())
            }
        }
    };
}

words! {
    /// How bad a check, or a whole result, came out.
    #[derive(Default)]
    Status {
        /// All is as it should be.
        Ok = "ok",
        /// Usable, with a reservation.
        Warn = "warn",
        /// Not to be relied on; the default, so that a verdict nobody filled in never reads as passed.
        #[default]
        Fail = "fail",
    }
}

words! {
    /// How a whole result came out, in files that say `pass` where others say `ok`.
    Outcome {
        /// All is as it should be.
        Pass = "pass",
        /// Usable, with a reservation.
        Warn = "warn",
        /// Not to be relied on.
        Fail = "fail",
    }
}

impl From<Outcome> for Status {
    fn from(outcome: Outcome) -> Self {
        match outcome {
            Outcome::Pass => Status::Ok,
            Outcome::Warn => Status::Warn,
            Outcome::Fail => Status::Fail,
        }
    }
}

words! {
    /// What standard deviations rest on.
    #[derive(Default)]
    Basis {
        /// Blocks of time, left out one at a time; of few of them the scores of their residuals.
        #[default]
        TimeBlocks = "time blocks",
        /// Robots of a type, left out one at a time.
        Robots = "robots",
        /// A mixed model of a fleet: the logs of one robot, and how robots of its type differ.
        Fleet = "fleet",
    }
}

words! {
    /// Where the value of a parameter comes from.
    ParameterVerdict {
        /// The logs determine it.
        SeenInData = "seen in the data",
        /// Determined mostly by the prior.
        CarriedByPrior = "carried by the prior",
        /// No motion of the mechanism determines it.
        NotIdentifiable = "not identifiable",
        /// Known by a tie: no log is asked.
        Given = "given",
    }
}

words! {
    /// Why the prior carries a parameter.
    CarriedReason {
        /// It acts only together with others, in any motion.
        OnlyInCombination = "only in combination",
        /// A motion would show it, and the logs do not hold it.
        NotExcited = "not excited",
        /// The logs hold a motion that shows it, and noise hides it.
        TooNoisy = "too noisy",
    }
}

words! {
    /// What the logs say of a parameter that enters the effort nonlinearly.
    #[derive(Default)]
    ShapeVerdict {
        /// The logs determine it.
        SeenInData = "seen in the data",
        /// They bound it on one side.
        OneSided = "bounded on one side",
        /// Any value of its range fits alike.
        NotSeen = "not seen",
        /// Not searched.
        #[default]
        Given = "given",
    }
}

words! {
    /// Which bodies count as such that can exist.
    ConsistencyForm {
        /// Their pseudo-inertia (4 × 4) is positive definite.
        PseudoInertia = "pseudo-inertia",
        /// Their spatial inertia (6 × 6) is positive definite.
        SpatialInertia = "spatial-inertia",
    }
}

words! {
    /// How distance from the robot file is measured in directions that the logs do not show.
    PriorDistance {
        /// Squared, in units of the prior's standard deviations.
        Quadratic = "quadratic",
        /// Entropic (Bregman log-det) divergence of pseudo-inertias.
        Entropic = "entropic",
    }
}

words! {
    /// How the search for consistent parameters ended.
    ConsistencyStatus {
        /// No constraint matters: the best fit is consistent by itself.
        Unconstrained = "unconstrained",
        /// The best consistent parameters were found, up to the gap.
        Optimal = "optimal",
        /// Consistent, but the gap is above the tolerance of the search.
        Stalled = "stalled",
    }
}

words! {
    /// Where a setting comes from.
    #[derive(Default)]
    Origin {
        /// Found from the data.
        #[default]
        Found = "found",
        /// Stated by the user.
        Given = "given",
        /// Of the program, where nothing was stated.
        Default = "default",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_written_and_read_as_they_are_printed() {
        for verdict in ParameterVerdict::ALL {
            let text = serde_json::to_string(verdict).unwrap();
            assert_eq!(text, format!("\"{verdict}\""));
            assert_eq!(serde_json::from_str::<ParameterVerdict>(&text).unwrap(), *verdict);
            assert_eq!(ParameterVerdict::of_word(verdict.word()), Some(*verdict));
        }
    }

    #[test]
    fn an_unknown_word_is_answered_with_the_known_ones() {
        let said = serde_json::from_str::<Status>("\"good\"").unwrap_err().to_string();
        assert!(said.contains("unknown variant `good`, expected one of `ok`, `warn`, `fail`"), "{said}");
    }

    #[test]
    fn schemas_list_the_words() {
        let schema = schemars::schema_for!(Status).to_value().to_string();
        for status in Status::ALL {
            assert!(schema.contains(&format!("\"const\":\"{status}\"")), "{schema}");
        }
    }

    #[test]
    fn words_keep_to_the_width_that_is_asked_for() {
        assert_eq!(format!("[{:>4}]", Status::Ok), "[  ok]");
    }
}
