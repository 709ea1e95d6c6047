//! The linear fit of a run: method, weights, covariance.

use dynid_estimate::covariance::{
    BlockLength, BlockLengthSettings, BlockLengthStatus, MIN_BLOCKS, ResidualSignal, block_inflation,
    block_length, output_inflation, variance_inflation,
};
use dynid_estimate::linear::{LinearEstimate, LinearMethod, LinearSettings, VarianceSharing, estimate};
use dynid_estimate::whiteness::{InBandSettings, InBandWhiteness, raw_in_band_whiteness};
use dynid_factor::Factor;
use dynid_factor::rows::{GroupResiduals, RowSource, reduce_rows, row_residuals};
use dynid_linalg::Mat;
use dynid_record::Basis;
use dynid_rows::conditioning::{
    Conditioning, LogMotion, LogRows, PreparedLog, ReducedGroup, motions, parts_of_motions, textbook_rows,
};

use crate::Error;
use crate::agreement::Agreement;
use crate::problem::Problem;
use crate::settings::{Settings, Variances};
use crate::trained_log::TrainedLog;

/// Joints whose variance inflation differs by more than this are deflated one by one.
const UNEQUAL: f64 = 2.0;

/// Variance inflation of rows that count for nothing.
const TRACE: f64 = 1e12;

/// The fit of the base parameters with what its residuals say about its precision.
#[derive(Debug)]
pub struct Fitted {
    /// The estimate in base columns.
    pub estimate: LinearEstimate,
    /// What the covariance rests on.
    pub basis: Basis,
    /// Robots behind the covariance; 0 where it rests on blocks of time.
    pub robots: usize,
    /// Covariance for white residuals, of the kept columns.
    pub white: Mat,
    /// Jackknife covariance over time blocks, if there are enough of them.
    pub jackknife: Option<Mat>,
    /// Of too few blocks for that: `white` times the inflation that their scores tell; `None` of fewer than two.
    pub inflated: Option<Mat>,
    /// Variance inflation `κ`: by how much coloured residuals inflate the variances that white ones would give.
    pub inflation: f64,
    /// The same from blocks of time alone, whether or not motions repeat: what held-out blocks of time differ by.
    pub inflation_in_time: f64,
    /// Whether a motion repeats of which the time blocks hold no parts that could be told: what the model leaves over and comes back with it
    /// does not show in any variance.
    pub repetition_unseen: bool,
    /// Variance inflation joint by joint, where it can be told.
    pub inflation_per_output: Vec<Option<f64>>,
    /// Length of time blocks that the residuals ask for.
    pub block_length: BlockLength,
    /// Length of the time blocks in use, s.
    pub block_s: f64,
    /// How many blocks of the rows make up one of these.
    pub merged_blocks: usize,
}

impl Fitted {
    /// The covariance to report: jackknife; for too few blocks that of white residuals, inflated as the blocks say.
    pub fn covariance(&self) -> &Mat {
        self.jackknife.as_ref().or(self.inflated.as_ref()).unwrap_or(&self.white)
    }

    /// Whether the covariance to report allows for coloured residuals.
    pub fn is_robust(&self) -> bool {
        self.jackknife.is_some() || self.inflated.is_some()
    }

    /// Adds covariances between base parameters that come from elsewhere than the rows: `(base parameter, base parameter, covariance)`. Of
    /// those whose column was dropped nothing is known anyway.
    pub(crate) fn add_covariances(&mut self, entries: &[(usize, usize, f64)]) {
        let kept = self.estimate.solution.kept.clone();
        let to = self.jackknife.as_mut().or(self.inflated.as_mut()).unwrap_or(&mut self.white);
        for (a, b, covariance) in entries {
            let places = [a, b].map(|base| kept.iter().position(|k| k == base));
            if let [Some(i), Some(j)] = places {
                to[(i, j)] += covariance;
            }
        }
    }

    /// Weighted factor of all base columns with every joint's rows deflated by `κ`, joint by joint where joints differ.
    ///
    /// Rows of an output that the model does not explain (`explained[output]` is false) count for nothing: whatever its
    /// effort consists of may pass for a parameter. They keep a trace of weight, so that what they could have shown is "too
    /// noisy", not "not excited".
    pub(crate) fn information(&self, explained: &[bool]) -> Factor {
        let estimate = &self.estimate;
        let known: Vec<f64> = self.inflation_per_output.iter().flatten().copied().collect();
        let least = known.iter().copied().fold(f64::INFINITY, f64::min);
        let most = known.iter().copied().fold(1.0, f64::max);
        let equal = known.len() < 2 || most <= UNEQUAL * least;
        // Rows that others pooled are of all outputs, and free of those that are not explained.
        let pooled = self.basis != Basis::TimeBlocks;
        if pooled || equal && explained.iter().all(|e| *e) {
            return estimate.factor.scaled(1.0 / self.inflation.sqrt());
        }
        self.deflated(&estimate.reduced, estimate.x.len(), explained)
    }

    /// Weighted factor of groups of rows as the fit had them, in whatever columns, deflated as [`Fitted::information`] says.
    pub(crate) fn deflated(&self, groups: &[ReducedGroup], total: usize, explained: &[bool]) -> Factor {
        let inflation = self.row_inflation(explained);
        let parts: Vec<Factor> = groups
            .iter()
            .zip(self.estimate.weights())
            .map(|(group, weight)| group.merged(total).scaled(weight / inflation[group.output].sqrt()))
            .collect();
        Factor::merge(&parts.iter().collect::<Vec<_>>())
    }

    /// Per output: what the variances of its rows count for, beyond those of white residuals. Joint by joint where joints differ, scaled so
    /// that together they make up the inflation found for all; of outputs that the model does not explain a huge one.
    pub(crate) fn row_inflation(&self, explained: &[bool]) -> Vec<f64> {
        let known: Vec<f64> = self.inflation_per_output.iter().flatten().copied().collect();
        let least = known.iter().copied().fold(f64::INFINITY, f64::min);
        let most = known.iter().copied().fold(1.0, f64::max);
        let equal = known.len() < 2 || most <= UNEQUAL * least;
        let mean = known.iter().sum::<f64>() / known.len().max(1) as f64;
        let of_output = |(output, explained): (usize, &bool)| match explained {
            false => TRACE,
            true => match self.inflation_per_output.get(output).copied().flatten().filter(|_| !equal) {
                Some(own) => (own * self.inflation / mean).max(1.0),
                None => self.inflation,
            },
        };
        explained.iter().enumerate().map(of_output).collect()
    }
}

/// Rows of the final fit of a problem, whichever the route.
///
/// # Errors
/// [`Error::Conditioning`].
pub(crate) fn rows<'a>(
    problem: &'a Problem,
    conditioning: Option<&Conditioning>,
) -> Result<Box<dyn RowSource + 'a>, Error> {
    let Problem { model, structure, logs, settings, .. } = problem;
    let (shape, kept) = (&structure.shape, &structure.base.kept);
    let conditioned = settings.conditioning_settings();
    Ok(match conditioning {
        Some(found) => Box::new(LogRows::new(model, shape, kept, logs, found, &conditioned)?),
        None => {
            let route = settings.textbook_route();
            Box::new(textbook_rows(model, shape, kept, logs, &route, &conditioned)?)
        }
    })
}

/// Fits the base parameters; with the estimate come the groups of rows that it was made from.
///
/// # Errors
/// [`Error::TooShort`], [`Error::Linear`].
pub fn fit(
    settings: &Settings,
    columns: usize,
    method: &LinearMethod,
    source: &dyn RowSource,
) -> Result<(LinearEstimate, Vec<ReducedGroup>), Error> {
    let groups = reduce_rows(source).map_err(|e| conditioning_fault(source, e))?;
    let file = || settings.files.logs.first().map_or_else(String::new, |log| log.display().to_string());
    check_rows(&groups, columns, file)?;
    let estimate = estimate(&groups, Some(source), columns, method, &linear_settings(settings))?;
    Ok((estimate, groups))
}

/// Refuses fewer rows than parameters. `file`: a log to name.
pub(crate) fn check_rows(
    groups: &[ReducedGroup],
    columns: usize,
    file: impl Fn() -> String,
) -> Result<(), Error> {
    let rows: usize = groups.iter().map(ReducedGroup::rows).sum();
    if rows > columns {
        return Ok(());
    }
    let message = format!("{rows} usable rows for {columns} parameters, expected more rows than parameters");
    Err(Error::TooShort { file: file(), message })
}

/// Settings of linear estimators that a run asks for.
pub(crate) fn linear_settings(settings: &Settings) -> LinearSettings {
    LinearSettings {
        sharing: match settings.estimator.variances {
            Variances::Group => VarianceSharing::Group,
            Variances::JointAndLog => VarianceSharing::JointAndLog,
            Variances::Joint => VarianceSharing::Joint,
        },
        ..LinearSettings::default()
    }
}

/// Residuals of the widest kernel's rows.
#[derive(Debug)]
pub struct RowResiduals {
    /// Log, output and residuals.
    groups: Vec<(usize, usize, GroupResiduals)>,
}

/// Residuals of the rows of the widest kernel.
///
/// # Errors
/// [`Error::Conditioning`].
pub fn residuals(source: &dyn RowSource, estimate: &LinearEstimate) -> Result<RowResiduals, Error> {
    let all = row_residuals(source, &estimate.x).map_err(|e| conditioning_fault(source, e))?;
    let widest = source.groups().iter().zip(all).filter(|(shape, _)| shape.scale == 0);
    Ok(RowResiduals { groups: widest.map(|(shape, r)| (shape.log, shape.output, r)).collect() })
}

impl RowResiduals {
    /// Log, output and residuals of rows.
    pub(crate) fn of(groups: Vec<(usize, usize, GroupResiduals)>) -> Self {
        RowResiduals { groups }
    }

    /// Of rows that are gone.
    pub(crate) fn none() -> Self {
        RowResiduals { groups: Vec::new() }
    }

    /// Logs and residuals of the rows of an output.
    pub(crate) fn of_output(&self, output: usize) -> impl Iterator<Item = (usize, &GroupResiduals)> {
        self.groups.iter().filter(move |(_, o, _)| *o == output).map(|(log, _, rows)| (*log, rows))
    }

    /// Whether raw residuals of a training log are white below the kernel's cut-off, per output; only samples near a row
    /// count.
    pub(crate) fn whiteness(
        &self,
        log: usize,
        agreement: &Agreement,
        kernel_hz: f64,
    ) -> Vec<Option<InBandWhiteness>> {
        (0..agreement.measured.len())
            .map(|output| {
                let (_, _, rows) = self.groups.iter().find(|(l, o, _)| (*l, *o) == (log, output))?;
                let samples = agreement.counted.len();
                let covered = rows.coverage(samples);
                let residual: Vec<f64> = (0..samples)
                    .map(|s| match covered[s] && agreement.counted[s] {
                        true => agreement.measured[output][s] - agreement.predicted[output][s],
                        false => 0.0,
                    })
                    .collect();
                raw_in_band_whiteness(&residual, agreement.rate_hz, kernel_hz, &InBandSettings::default())
            })
            .collect()
    }
}

/// Per log the number of its time blocks.
fn blocks_of_logs(estimate: &LinearEstimate, logs: usize) -> Vec<usize> {
    let mut blocks = vec![0; logs];
    for group in &estimate.reduced {
        blocks[group.log] = blocks[group.log].max(group.blocks.len());
    }
    blocks
}

/// Covariance from time blocks that are long enough for the residuals found.
///
/// Blocks are merged until they are five correlation times long, but never to fewer than [`MIN_BLOCKS`]; `fixed`: they stay
/// as they are.
pub fn with_precision(
    estimate: LinearEstimate,
    residuals: &RowResiduals,
    logs: &[PreparedLog],
    fixed: bool,
) -> Fitted {
    let grids: Vec<(usize, f64, Vec<f64>)> = residuals
        .groups
        .iter()
        .filter_map(|(log, _, rows)| {
            let (step, grid) = rows.on_grid()?;
            Some((*log, logs[*log].rate_hz / step as f64, grid))
        })
        .collect();
    let signals: Vec<ResidualSignal<'_>> = grids
        .iter()
        .map(|(log, rate_hz, residual)| ResidualSignal { log: *log, rate_hz: *rate_hz, residual })
        .collect();
    let wanted = block_length(&signals, &BlockLengthSettings::default());
    let duration: f64 = logs.iter().map(PreparedLog::duration).sum();
    let block_s = duration / estimate.blocks.len().max(1) as f64;
    let most = (estimate.blocks.len() / MIN_BLOCKS).max(1);
    let factor = if fixed { 1 } else { ((wanted.seconds / block_s).ceil() as usize).clamp(1, most) };
    let motions = motions(logs);
    let blocks = blocks_of_logs(&estimate, logs.len());
    // A period stays a whole number of blocks.
    let divides = |factor: &usize| {
        motions
            .iter()
            .zip(&blocks)
            .all(|(m, blocks)| m.repeats_after.is_none() || m.parts(*blocks).0 % factor == 0)
    };
    let factor = (1..=factor).rev().find(divides).unwrap_or(1);
    Fitted::of(estimate.with_longer_blocks(factor), wanted, block_s * factor as f64, factor, &motions)
}

impl Fitted {
    fn of(
        estimate: LinearEstimate,
        wanted: BlockLength,
        block_s: f64,
        merged_blocks: usize,
        motions: &[LogMotion],
    ) -> Self {
        let white = estimate.model_covariance();
        let blocks = blocks_of_logs(&estimate, motions.len());
        let parts = parts_of_motions(motions, &blocks);
        let mut different: Vec<usize> = parts.concat();
        different.sort_unstable();
        different.dedup();
        let repetition_unseen =
            !motions.iter().zip(&blocks).all(|(motion, blocks)| motion.has_parts(*blocks));
        let in_time = Self::of_blocks(estimate, white.clone(), wanted.clone(), block_s, merged_blocks);
        if different.len() == blocks.iter().sum::<usize>() {
            return Fitted { repetition_unseen, ..in_time };
        }
        let estimate = in_time.estimate.clone().with_repeated_motions(parts);
        let of_parts = Self::of_blocks(estimate, white, wanted, block_s, merged_blocks);
        let fitted = if of_parts.is_robust() { of_parts.at_least(&in_time) } else { in_time };
        Fitted { repetition_unseen, ..fitted }
    }

    /// With no variance below that of another account of the same fit: what changes with time does not show between parts of a motion, what
    /// comes back with a motion not between blocks of time.
    fn at_least(mut self, in_time: &Fitted) -> Self {
        let (own, other) = (self.covariance(), in_time.covariance());
        let ratio = |i: usize| if own[(i, i)] > 0.0 { other[(i, i)] / own[(i, i)] } else { 1.0 };
        let root: Vec<f64> = (0..own.nrows()).map(|i| ratio(i).max(1.0).sqrt()).collect();
        let raised = Mat::from_fn(own.nrows(), own.ncols(), |i, j| own[(i, j)] * root[i] * root[j]);
        match self.jackknife.is_some() {
            true => self.jackknife = Some(raised),
            false => self.inflated = Some(raised),
        }
        self.inflation = self.inflation.max(in_time.inflation);
        self.inflation_in_time = in_time.inflation;
        self
    }

    fn of_blocks(
        estimate: LinearEstimate,
        white: Mat,
        wanted: BlockLength,
        block_s: f64,
        merged_blocks: usize,
    ) -> Self {
        let jackknife = (estimate.blocks.len() >= MIN_BLOCKS).then(|| estimate.jackknife()).flatten();
        let jackknife = jackknife.map(|j| j.covariance);
        let by_scores = match jackknife {
            None => block_inflation(&estimate.kept_blocks(), &estimate.kept_x()),
            Some(_) => None,
        };
        let of_jackknife = jackknife.as_ref().and_then(|v| variance_inflation(v, &white));
        let inflation = of_jackknife.or(by_scores).unwrap_or(1.0);
        let per_output = output_inflation(&estimate.reduced, &estimate.weights(), &estimate.x);
        Fitted {
            inflated: by_scores.map(|inflation| &white * inflation),
            white,
            jackknife,
            inflation,
            inflation_in_time: inflation,
            repetition_unseen: false,
            inflation_per_output: per_output,
            block_length: wanted,
            block_s,
            merged_blocks,
            basis: Basis::TimeBlocks,
            robots: 0,
            estimate,
        }
    }

    /// A fit whose covariance, in all columns, comes with its rows, and the robots behind it. `outputs`: of the model; `duration_s`: length of its logs.
    pub(crate) fn pooled(
        estimate: LinearEstimate,
        covariance: &Mat,
        (basis, robots): (Basis, usize),
        outputs: usize,
        duration_s: f64,
    ) -> Self {
        let kept = &estimate.solution.kept;
        let of_kept = Mat::from_fn(kept.len(), kept.len(), |i, j| covariance[(kept[i], kept[j])]);
        let rows = estimate.model_covariance();
        let (white, jackknife) = match basis {
            Basis::Fleet => (of_kept, None),
            Basis::Robots | Basis::TimeBlocks => (rows, Some(of_kept)),
        };
        let inflation = jackknife.as_ref().and_then(|v| variance_inflation(v, &white)).unwrap_or(1.0);
        let blocks = estimate.blocks.len();
        let block_s = duration_s / blocks.max(1) as f64;
        Fitted {
            basis,
            robots,
            white,
            jackknife,
            inflated: None,
            inflation,
            inflation_in_time: inflation,
            repetition_unseen: false,
            inflation_per_output: vec![None; outputs],
            block_length: BlockLength {
                seconds: block_s,
                blocks,
                correlation_s: Vec::new(),
                worst: None,
                status: if blocks >= MIN_BLOCKS { BlockLengthStatus::Enough } else { BlockLengthStatus::Few },
            },
            block_s,
            merged_blocks: 1,
            estimate,
        }
    }

    /// Covariance from time blocks as they are, of logs of a total length; `wanted_s`: the length that residuals ask for.
    pub(crate) fn with_blocks(estimate: LinearEstimate, wanted_s: f64, logs: &[&TrainedLog]) -> Self {
        let duration_s: f64 = logs.iter().map(|log| log.duration_s).sum();
        let blocks = estimate.blocks.len();
        let wanted = BlockLength {
            seconds: wanted_s,
            blocks,
            correlation_s: Vec::new(),
            worst: None,
            status: if blocks >= MIN_BLOCKS { BlockLengthStatus::Enough } else { BlockLengthStatus::Few },
        };
        let motion = |(k, log): (usize, &&TrainedLog)| LogMotion {
            length: log.duration_s,
            repeats_after: log.repeats_after_s,
            first: k,
            lag: 0.0,
        };
        let motions: Vec<LogMotion> = logs.iter().enumerate().map(motion).collect();
        Fitted::of(estimate, wanted, duration_s / blocks.max(1) as f64, 1, &motions)
    }
}

pub(crate) fn conditioning_fault(source: &dyn RowSource, e: dynid_factor::rows::RowsError) -> Error {
    let output = source.groups()[e.group].output;
    Error::Conditioning(dynid_rows::conditioning::ConditioningError::Rows { output, source: e.source })
}
