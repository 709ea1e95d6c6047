//! Settings that would do nothing: each takes effect or is refused.

use super::given::{Given, refuse};
use super::{
    ClosedLoop, ConditioningConfig, Consistency, LogSettings, Method, Route, Settings, SmoothingKind,
    Variances,
};
use crate::Error;

impl Settings {
    /// Refuses settings of an identification that would do nothing beside the others.
    ///
    /// # Errors
    /// [`Error::Setting`].
    pub fn check_effect(&self) -> Result<(), Error> {
        self.conditioning.check_effect()?;
        if let Some(own) = &self.own_estimator
            && self.estimator.method != Method::Wls
        {
            let found = format!("`{}` beside `{}`", serde_name(&self.estimator.method), own.name());
            return Err(Error::setting("estimator.method", "none beside an own estimator", found));
        }
        self.check_estimator_effect()?;
        self.closed_loop.iter().try_for_each(ClosedLoop::check_effect)
    }

    fn check_estimator_effect(&self) -> Result<(), Error> {
        let e = &self.estimator;
        let needs = |key, given, needs| Given { key, given, needs };
        let method = format!("`method = \"{}\"`", serde_name(&e.method));
        if e.method != Method::Ridge {
            refuse(&method, &[needs("ridge_weight", e.ridge_weight.is_some(), "`method = \"ridge\"`")])?;
        }
        if e.method != Method::Tls {
            let tls = "`method = \"tls\"`";
            refuse(
                &method,
                &[
                    needs("effort_noise", e.effort_noise.is_some(), tls),
                    needs("column_noise", !e.column_noise.is_empty(), tls),
                ],
            )?;
        }
        if e.method == Method::Ols {
            let given = e.variances != Variances::default();
            refuse(&method, &[needs("variances", given, "an estimator that weights rows")])?;
        }
        if e.consistency == Consistency::None {
            let form = "`consistency = \"pseudo-inertia\"`";
            refuse(
                "`consistency = \"none\"`",
                &[
                    needs("prior", e.prior.is_some(), form),
                    needs("prior_weight", e.prior_weight.is_some(), form),
                ],
            )?;
        }
        let shape = &e.shape;
        if self.conditioning.route == Route::Textbook {
            let compact = "`route = \"compact\"`, which searches shape parameters,";
            refuse(
                "`route = \"textbook\"`",
                &[
                    needs("shape.search", shape.search.is_some(), compact),
                    needs("shape.evaluations", shape.evaluations.is_some(), compact),
                    needs("shape.starts", shape.starts.is_some(), compact),
                ],
            )?;
        }
        match &shape.search {
            None => refuse(
                "none",
                &[needs(
                    "shape.evaluations",
                    shape.evaluations.is_some(),
                    "`search`, whose evaluations these are,",
                )],
            ),
            Some(search) => refuse(
                &format!("`search = \"{search}\"`"),
                &[needs(
                    "shape.starts",
                    shape.starts.is_some(),
                    "Gauss-Newton from several starts, no `search`,",
                )],
            ),
        }
    }
}

/// Refuses what is said of logs and would do nothing. `files`: of the training logs, `labels`: their names.
///
/// # Errors
/// [`Error::Setting`].
pub fn check_log_effect(
    training: &[&LogSettings],
    validation: &[&LogSettings],
    labels: &[String],
    files: &[&str],
) -> Result<(), Error> {
    if let ([log], [file]) = (training, files)
        && let Some(own) = log.own.first()
    {
        let expected = "a second `[[log]]`, from which this one deviates";
        let found = format!("`own = [\"{}\"]` in the only log, {file}", own.word());
        return Err(Error::setting("log.own", expected, found));
    }
    if let Some(name) = validation.iter().find_map(|log| log.name.as_ref()) {
        let expected = "it in `[[log]]` only: a validation log has no parameters that it could name";
        return Err(Error::setting("validation.name", expected, name));
    }
    for like in validation.iter().filter_map(|log| log.like.as_ref()) {
        let own = |(log, label): (&&LogSettings, &String)| label == like && !log.own.is_empty();
        if !training.iter().zip(labels).any(own) {
            let expected = "the name of a `[[log]]` with `own`, whose own terms this log shares";
            return Err(Error::setting("validation.like", expected, like));
        }
    }
    Ok(())
}

impl ConditioningConfig {
    fn check_effect(&self) -> Result<(), Error> {
        let textbook = "`route = \"textbook\"`";
        let compact = "`route = \"compact\"`";
        let needs = |key, given| (key, given);
        let (found, wanted, keys) = match self.route {
            Route::Compact => (
                compact,
                textbook,
                vec![
                    needs("decimation", self.decimation.is_some()),
                    needs("parallel_filter", self.parallel_filter.is_some()),
                    needs("filter_effort", self.filter_effort.is_some()),
                    needs("trim_s", self.trim_s.is_some()),
                    needs("smoothing", self.smoothing.is_some()),
                    needs("effort_smoothing", self.effort_smoothing.is_some()),
                    needs("passes", self.passes.is_some()),
                    needs("window", self.window.is_some()),
                    needs("order", self.order.is_some()),
                    needs("harmonics", self.harmonics.is_some()),
                    needs("average_periods", self.average_periods.is_some()),
                ],
            ),
            Route::Textbook => (
                textbook,
                compact,
                vec![
                    needs("state_hz", self.state_hz.is_some()),
                    needs("delay_samples", self.delay_samples.is_some()),
                    needs("reversal_mask", self.reversal_mask.is_some()),
                ],
            ),
        };
        let keys: Vec<Given<'_>> =
            keys.into_iter().map(|(key, given)| Given { key, given, needs: wanted }).collect();
        refuse(found, &keys)?;
        match self.route {
            Route::Compact => Ok(()),
            Route::Textbook => self.check_smoothing_effect(),
        }
    }

    /// Refuses keys of one smoothing beside others alone.
    fn check_smoothing_effect(&self) -> Result<(), Error> {
        let positions = self.smoothing.unwrap_or(SmoothingKind::Butterworth);
        let found = match self.effort_smoothing {
            None => format!("`smoothing = \"{}\"`", serde_name(&positions)),
            Some(effort) => {
                format!("`{}` with `effort_smoothing = \"{}\"`", serde_name(&positions), serde_name(&effort))
            }
        };
        let of = |kind| self.smooths(kind);
        let polynomials = of(SmoothingKind::SavitzkyGolay);
        let refused = |key, given, has: bool, needs| Given { key, given: given && !has, needs };
        let cut =
            of(SmoothingKind::Butterworth) || (of(SmoothingKind::Frequency) && self.harmonics.is_none());
        let cut_needs = match of(SmoothingKind::Frequency) {
            true => "the one or the other, `harmonics` or `kernel_hz`,",
            false => "`smoothing = \"butterworth\"` or `\"frequency\"`",
        };
        refuse(
            &found,
            &[
                refused(
                    "passes",
                    self.passes.is_some(),
                    of(SmoothingKind::FivePoint),
                    "`smoothing = \"five-point\"`",
                ),
                refused("window", self.window.is_some(), polynomials, "`smoothing = \"savitzky-golay\"`"),
                refused("order", self.order.is_some(), polynomials, "`smoothing = \"savitzky-golay\"`"),
                refused(
                    "harmonics",
                    self.harmonics.is_some(),
                    of(SmoothingKind::Frequency),
                    "`smoothing = \"frequency\"`",
                ),
                refused("kernel_hz", self.kernel_hz.is_some(), cut, cut_needs),
            ],
        )?;
        if self.effort_smoothing.is_some() && self.filter_effort == Some(false) {
            let expected = "`filter_effort = true` beside it";
            return Err(Error::setting("effort_smoothing", expected, "`filter_effort = false`"));
        }
        if polynomials && self.window.is_none() {
            let expected = "an odd number of samples beside `\"savitzky-golay\"`";
            return Err(Error::setting("window", expected, "none"));
        }
        Ok(())
    }
}

/// The word of an enum in a configuration.
pub fn serde_name(value: &impl serde::Serialize) -> String {
    serde_json::to_value(value).ok().and_then(|v| v.as_str().map(str::to_owned)).unwrap_or_default()
}
