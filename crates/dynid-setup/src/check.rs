//! Names of the checks behind a verdict.

use dynid_record::Status;
use serde::{Deserialize, Serialize};

dynid_record::words! {
    /// Checks behind the verdict of an identification.
    CheckName {
        /// Whether the training logs agree in what the fit holds the same.
        AgreementOfLogs = "agreement of the training logs",
        /// What the logs tell of joints with clearance.
        Clearance = "clearance of the joints",
        /// Least squares against instrumental variables.
        ClosedLoopBias = "closed-loop bias",
        /// Amplification of errors.
        Condition = "condition number (scaled columns)",
        /// The delay that was found.
        Delay = "delay of the effort",
        /// Scale of the efforts against known masses.
        EffortScale = "scale of the efforts",
        /// Base parameters that the logs excite.
        Excitation = "excitation",
        /// Joints whose effort is mostly something else than the model.
        Explained = "joints that the model does not explain",
        /// How instruments came about.
        Instruments = "instruments",
        /// Training logs that share rows.
        OwnLogs = "training logs of their own",
        /// Whether the loads that friction follows came to rest.
        Loads = "loads that friction follows",
        /// Validation logs that share rows with training logs.
        OwnValidation = "validation logs of their own",
        /// What the pre-flight found.
        Preflight = "pre-flight of the logs",
        /// What bodies that can exist cost in fit.
        PriceOfConsistency = "price of physical consistency",
        /// How clearly the structure separates what can be identified.
        RankGap = "structural rank gap",
        /// Doubts of the identification that taught the recipe of factors.
        Recipe = "recipe of the factors",
        /// What is left over against sensor noise.
        Residual = "residual against sensor noise",
        /// What is left over that is a function of the position of a joint.
        Position = "residual that follows the position",
        /// Dependence on rows near reversal.
        ReversalMask = "sensitivity to the reversal mask",
        /// Robots behind standard deviations.
        Robots = "robots behind the standard deviations",
        /// Stiffness of elastic joints.
        Stiffness = "stiffness told by deformation",
        /// What logs have of their own.
        TermsOfLogs = "terms of single logs",
        /// Time blocks behind standard deviations.
        TimeBlocks = "time blocks behind the standard deviations",
        /// Whether the logs bear out what ties say.
        Ties = "ties of the parameters",
        /// Fit on the training logs.
        TrainingFit = "fit on training logs",
        /// Prediction of validation logs.
        ValidationFit = "prediction of validation logs",
        /// Colour of the residuals.
        Whiteness = "whiteness of the residuals",
    }
}

/// One check.
#[derive(Debug, Clone, Serialize, Deserialize, schemars::JsonSchema)]
pub struct CheckResult {
    /// How it came out.
    pub status: Status,
    /// What was checked.
    pub name: CheckName,
    /// Value.
    pub value: Option<f64>,
    /// Unit.
    pub unit: String,
    /// What is expected.
    pub limit: String,
    /// What it means.
    pub meaning: String,
}
