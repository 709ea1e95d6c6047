//! Two steps, then maximum likelihood.

use super::solve::{Placed, combine, factor, gain, rms, solution, with_prior};
use super::spread::{State, long_run, spread_of_blocks};
use super::{Coefficients, Deformation, DeformationError, Fit, Rows, Settings};

/// Rounds of weights or Gauss-Newton steps until they must have settled.
const ROUNDS: usize = 60;
/// Relative change of weights and compliances that counts as settled.
const SETTLED: f64 = 1e-9;
/// Steps of the likelihood in a refit without a block of time, which starts next to its end.
const REFIT_SETTLED: f64 = 1e-6;

/// Fits sum rows and deformation rows.
///
/// # Errors
/// [`DeformationError`]: rows of unequal length or with numbers that are not finite; a row without a residual.
pub fn fit(rows: &Rows, settings: &Settings) -> Result<Deformation, DeformationError> {
    check(rows)?;
    let all = |_: usize| true;
    let bare = Problem { rows, once_per_turn: false };
    let start = bare.two_step(&all)?;
    let found = bare.likelihood(&start, &all, SETTLED)?;
    let converged = found.is_some();
    let best = found.unwrap_or_else(|| start.clone());
    let n = rows.samples();
    let blocks = settings.blocks.clamp(2, n.max(2));
    let mut refits = Vec::with_capacity(blocks);
    for b in 0..blocks {
        let (from, to) = (b * n / blocks, (b + 1) * n / blocks);
        let kept = |t: usize| !(from..to).contains(&t);
        let without = match converged {
            true => bare.likelihood(&best, &kept, REFIT_SETTLED)?,
            false => None,
        };
        refits.push(match without {
            Some(state) => state,
            None => bare.two_step(&kept)?,
        });
    }
    let checked = Problem { rows, once_per_turn: true };
    let turned = checked.two_step(&all)?;
    let turned = checked.likelihood(&turned, &all, SETTLED)?.unwrap_or(turned);
    let two_step = bare.finished(&start, settings, false)?;
    let likelihood = bare.finished(&best, settings, converged)?;
    let jackknife: Vec<Vec<f64>> =
        (0..rows.joints.len()).map(|j| spread_of_blocks(&refits, &best, j)).collect();
    let once_per_turn: Vec<Option<f64>> = turned
        .joints
        .iter()
        .zip(&rows.joints)
        .map(|(b, joint)| (!joint.once_per_turn.is_empty() && b[0] != 0.0).then_some(b[0]))
        .collect();
    let std_total = (0..rows.joints.len())
        .map(|j| {
            let moved = once_per_turn[j].map_or(0.0, |c| c - likelihood.joints[j].compliance);
            likelihood.joints[j].std[0].max(jackknife[j][0]).hypot(moved)
        })
        .collect();
    Ok(Deformation { two_step, likelihood, converged, jackknife, once_per_turn, std_total })
}

fn check(rows: &Rows) -> Result<(), DeformationError> {
    let (p, n) = (rows.parameters, rows.samples());
    let long = |columns: &[Vec<f64>]| columns.iter().all(|c| c.len() == n);
    let sums = rows.sums.iter().all(|s| s.regressor.len() == p && long(&s.regressor) && s.effort.len() == n);
    let joints = rows.joints.iter().all(|j| {
        j.load.len() == p
            && long(&j.load)
            && long(&j.nuisances)
            && long(&j.once_per_turn)
            && j.deformation.len() == n
    });
    let known = rows.prior.is_empty() || rows.prior.len() == p;
    let stated = rows.prior.iter().all(|(mean, std)| mean.is_finite() && *std > 0.0);
    if sums && joints && known && stated && n > 0 {
        return Ok(());
    }
    Err(DeformationError::Rows { expected: "rows, columns of one length, and priors with positive spreads" })
}

struct Problem<'a> {
    rows: &'a Rows,
    once_per_turn: bool,
}

impl<'a> Problem<'a> {
    fn nuisances(&self, j: usize) -> impl Iterator<Item = &'a Vec<f64>> + use<'a> {
        let joint = &self.rows.joints[j];
        let more: &[Vec<f64>] = if self.once_per_turn { &joint.once_per_turn } else { &[] };
        joint.nuisances.iter().chain(more)
    }

    /// Position of the first unknown of a joint's row among all unknowns, and the number of all.
    fn places(&self) -> (Vec<usize>, usize) {
        let mut at = self.rows.parameters;
        let first = (0..self.rows.joints.len())
            .map(|j| {
                let first = at;
                at += 1 + self.nuisances(j).count();
                first
            })
            .collect();
        (first, at)
    }

    fn sum_residuals(&self, beta: &[f64]) -> Vec<Vec<f64>> {
        let n = self.rows.samples();
        let residual = |s: &super::SumRows| {
            let modelled = combine(&s.regressor, beta, n);
            s.effort.iter().zip(modelled).map(|(e, m)| e - m).collect()
        };
        self.rows.sums.iter().map(residual).collect()
    }

    fn load(&self, j: usize, beta: &[f64]) -> Vec<f64> {
        combine(&self.rows.joints[j].load, beta, self.rows.samples())
    }

    fn joint_residual(&self, j: usize, load: &[f64], b: &[f64]) -> Vec<f64> {
        let mut out = self.rows.joints[j].deformation.clone();
        out.iter_mut().zip(load).for_each(|(o, t)| *o -= b[0] * t);
        for (column, b) in self.nuisances(j).zip(&b[1..]) {
            out.iter_mut().zip(column).for_each(|(o, v)| *o -= b * v);
        }
        out
    }

    fn sums_placed<'b>(&'b self, rhs: &'b [Vec<f64>], weights: &[f64]) -> Vec<Placed<'b>> {
        let placed = self.rows.sums.iter().zip(rhs).zip(weights);
        placed
            .map(|((s, rhs), sigma)| Placed {
                columns: s.regressor.iter().enumerate().map(|(k, c)| (k, c.as_slice())).collect(),
                rhs,
                weight: 1.0 / sigma,
            })
            .collect()
    }

    /// `β` from the sum rows alone, weighted by their own residuals; then every deformation on its load.
    fn two_step(&self, used: &dyn Fn(usize) -> bool) -> Result<State, DeformationError> {
        let p = self.rows.parameters;
        let mut beta = vec![0.0; p];
        let mut sigma = vec![1.0; self.rows.sums.len()];
        if let Some(largest) = (!self.rows.prior.is_empty())
            .then(|| self.rows.sums.iter().map(|s| rms(&s.effort, used)).fold(0.0, f64::max))
        {
            // Beside a prior the first round takes a tenth of the effort for noise.
            sigma.fill((0.1 * largest).max(f64::MIN_POSITIVE));
        }
        for _ in 0..ROUNDS {
            let residuals = self.sum_residuals(&beta);
            let factor = factor(p, &self.sums_placed(&residuals, &sigma), used)?;
            let step = solution(&with_prior(factor, self.rows, &beta));
            beta.iter_mut().zip(&step).for_each(|(b, s)| *b += s);
            let next: Vec<f64> = self.sum_residuals(&beta).iter().map(|r| rms(r, used)).collect();
            if next.iter().any(|s| *s <= 0.0) {
                return Err(DeformationError::Exact);
            }
            let settled = change(&sigma, &next) < SETTLED;
            sigma = next;
            if settled {
                break;
            }
        }
        let (mut joints, mut joints_rms) = (Vec::new(), Vec::new());
        for j in 0..self.rows.joints.len() {
            let load = self.load(j, &beta);
            let columns: Vec<&[f64]> =
                std::iter::once(load.as_slice()).chain(self.nuisances(j).map(Vec::as_slice)).collect();
            let row = Placed {
                columns: columns.iter().copied().enumerate().collect(),
                rhs: &self.rows.joints[j].deformation,
                weight: 1.0,
            };
            let b = solution(&factor(columns.len(), &[row], used)?);
            joints_rms.push(rms(&self.joint_residual(j, &load, &b), used));
            joints.push(b);
        }
        Ok(State { beta, joints, sums_rms: sigma, joints_rms })
    }

    /// Gauss-Newton over all rows with weights from their own residuals; `None` if it does not settle.
    fn likelihood(
        &self,
        start: &State,
        used: &dyn Fn(usize) -> bool,
        settled: f64,
    ) -> Result<Option<State>, DeformationError> {
        let mut state = start.clone();
        if state.joints_rms.iter().any(|s| *s <= 0.0) {
            return Ok(None);
        }
        for _ in 0..ROUNDS {
            let factor = self.linearised(&state, used)?;
            let step = solution(&with_prior(factor, self.rows, &state.beta));
            let before = state.clone();
            state.beta.iter_mut().zip(&step).for_each(|(b, s)| *b += s);
            let mut rest = step[self.rows.parameters..].iter();
            state.joints.iter_mut().flatten().zip(&mut rest).for_each(|(b, s)| *b += s);
            state.sums_rms = self.sum_residuals(&state.beta).iter().map(|r| rms(r, used)).collect();
            state.joints_rms = (0..state.joints.len())
                .map(|j| rms(&self.joint_residual(j, &self.load(j, &state.beta), &state.joints[j]), used))
                .collect();
            let finite = state.sums_rms.iter().chain(&state.joints_rms).all(|s| s.is_finite() && *s > 0.0);
            if !finite {
                return Ok(None);
            }
            let compliances = |s: &State| s.joints.iter().map(|b| b[0]).collect::<Vec<_>>();
            let moved = change(&before.sums_rms, &state.sums_rms)
                .max(change(&before.joints_rms, &state.joints_rms))
                .max(change(&compliances(&before), &compliances(&state)));
            if moved < settled {
                return Ok(Some(state));
            }
        }
        Ok(None)
    }

    /// Triangle of all rows, linearised at a state, with its residuals on the right.
    fn linearised(
        &self,
        state: &State,
        used: &dyn Fn(usize) -> bool,
    ) -> Result<dynid_factor::Factor, DeformationError> {
        let (first, unknowns) = self.places();
        let residuals = self.sum_residuals(&state.beta);
        let mut rows = self.sums_placed(&residuals, &state.sums_rms);
        let loads: Vec<_> = (0..state.joints.len()).map(|j| self.load(j, &state.beta)).collect();
        let rhs: Vec<_> =
            (0..loads.len()).map(|j| self.joint_residual(j, &loads[j], &state.joints[j])).collect();
        let scaled: Vec<Vec<Vec<f64>>> = self
            .rows
            .joints
            .iter()
            .zip(&state.joints)
            .map(|(joint, b)| joint.load.iter().map(|c| c.iter().map(|v| b[0] * v).collect()).collect())
            .collect();
        for j in 0..loads.len() {
            let mut columns: Vec<(usize, &[f64])> =
                scaled[j].iter().enumerate().map(|(k, c)| (k, c.as_slice())).collect();
            columns.push((first[j], &loads[j]));
            columns.extend(self.nuisances(j).enumerate().map(|(k, c)| (first[j] + 1 + k, c.as_slice())));
            rows.push(Placed { columns, rhs: &rhs[j], weight: 1.0 / state.joints_rms[j] });
        }
        factor(unknowns, &rows, used)
    }

    /// A fit with its spreads, `joint` if it is the likelihood's.
    fn finished(&self, state: &State, settings: &Settings, joint: bool) -> Result<Fit, DeformationError> {
        let all = |_: usize| true;
        let std = match joint {
            true => self.likelihood_std(state, settings)?,
            false => self.two_step_std(state, settings)?,
        };
        let mut joints = Vec::new();
        for (j, std) in std.into_iter().enumerate() {
            let load = self.load(j, &state.beta);
            let columns: Vec<Vec<f64>> = self.nuisances(j).cloned().collect();
            let row = Placed {
                columns: columns.iter().enumerate().map(|(k, c)| (k, c.as_slice())).collect(),
                rhs: &load,
                weight: 1.0,
            };
            let explained = combine(&columns, &solution(&factor(columns.len(), &[row], &all)?), load.len());
            let alone: Vec<f64> = load.iter().zip(explained).map(|(t, e)| t - e).collect();
            joints.push(Coefficients {
                compliance: state.joints[j][0],
                nuisances: state.joints[j][1..].to_vec(),
                std,
                rms: state.joints_rms[j],
                load_alone: rms(&alone, &all),
                load,
            });
        }
        Ok(Fit { parameters: state.beta.clone(), rms: state.sums_rms.clone(), joints })
    }

    /// Spread of the likelihood's coefficients: scores of an instant, summed over all rows.
    fn likelihood_std(&self, state: &State, settings: &Settings) -> Result<Vec<Vec<f64>>, DeformationError> {
        let (first, unknowns) = self.places();
        let factor = with_prior(self.linearised(state, &|_| true)?, self.rows, &state.beta);
        let residuals = self.sum_residuals(&state.beta);
        let (n, p) = (self.rows.samples(), self.rows.parameters);
        let loads: Vec<_> = (0..state.joints.len()).map(|j| self.load(j, &state.beta)).collect();
        let wanted: Vec<usize> = (p..unknowns).collect();
        let gains = gain(&factor, &wanted);
        let influence = |g: &Vec<f64>| {
            let mut out = vec![0.0; n];
            for (s, (rows, residual)) in self.rows.sums.iter().zip(&residuals).enumerate() {
                let along = combine(&rows.regressor, &g[..p], n);
                let weight = state.sums_rms[s].powi(-2);
                out.iter_mut().zip(along.iter().zip(residual)).for_each(|(o, (a, r))| *o += weight * a * r);
            }
            for (j, b) in state.joints.iter().enumerate() {
                let residual = self.joint_residual(j, &loads[j], b);
                let through = combine(&self.rows.joints[j].load, &g[..p], n);
                let mut along: Vec<f64> = through.iter().map(|t| b[0] * t).collect();
                along.iter_mut().zip(&loads[j]).for_each(|(a, t)| *a += g[first[j]] * t);
                for (k, column) in self.nuisances(j).enumerate() {
                    let share = g[first[j] + 1 + k];
                    along.iter_mut().zip(column).for_each(|(a, v)| *a += share * v);
                }
                let weight = state.joints_rms[j].powi(-2);
                out.iter_mut().zip(along.iter().zip(&residual)).for_each(|(o, (a, r))| *o += weight * a * r);
            }
            long_run(&out, settings.lag)
        };
        let flat: Vec<f64> = gains.iter().map(influence).collect();
        let ends = first[1..].iter().copied().chain([unknowns]);
        Ok(first.iter().zip(ends).map(|(from, to)| flat[from - p..to - p].to_vec()).collect())
    }

    /// Spread of the two steps: scores of the deformation, less what the error of `β` moves the load.
    fn two_step_std(&self, state: &State, settings: &Settings) -> Result<Vec<Vec<f64>>, DeformationError> {
        let (n, p) = (self.rows.samples(), self.rows.parameters);
        let residuals = self.sum_residuals(&state.beta);
        let sums = factor(p, &self.sums_placed(&residuals, &state.sums_rms), &|_| true)?;
        let sums = with_prior(sums, self.rows, &state.beta);
        let all: Vec<usize> = (0..p).collect();
        let covariance = gain(&sums, &all);
        let mut out = Vec::new();
        for (j, b) in state.joints.iter().enumerate() {
            let load = self.load(j, &state.beta);
            let mut columns = vec![load.clone()];
            columns.extend(self.nuisances(j).cloned());
            let residual = self.joint_residual(j, &load, b);
            let row = Placed {
                columns: columns.iter().enumerate().map(|(k, c)| (k, c.as_slice())).collect(),
                rhs: &residual,
                weight: 1.0,
            };
            let own = factor(columns.len(), &[row], &|_| true)?;
            let wanted: Vec<usize> = (0..columns.len()).collect();
            let spreads = gain(&own, &wanted).into_iter().map(|g| {
                let along = combine(&columns, &g, n);
                let mut score: Vec<f64> = along.iter().zip(&residual).map(|(a, r)| a * r).collect();
                // ∂(score)/∂β of this coefficient through the load in the residual; that through the load in the column has the
                // residual as a factor, and no mean.
                let slope: Vec<f64> = self.rows.joints[j]
                    .load
                    .iter()
                    .map(|column| column.iter().zip(&along).map(|(v, a)| -b[0] * v * a).sum())
                    .collect();
                let through: Vec<f64> =
                    covariance.iter().map(|row| row.iter().zip(&slope).map(|(c, s)| c * s).sum()).collect();
                for (s, (rows, residual)) in self.rows.sums.iter().zip(&residuals).enumerate() {
                    let along = combine(&rows.regressor, &through, n);
                    let weight = state.sums_rms[s].powi(-2);
                    score
                        .iter_mut()
                        .zip(along.iter().zip(residual))
                        .for_each(|(o, (a, r))| *o += weight * a * r);
                }
                long_run(&score, settings.lag)
            });
            out.push(spreads.collect());
        }
        Ok(out)
    }
}

/// Largest relative change.
fn change(from: &[f64], to: &[f64]) -> f64 {
    let relative = |(a, b): (&f64, &f64)| match a.abs().max(b.abs()) {
        0.0 => 0.0,
        size => (a - b).abs() / size,
    };
    from.iter().zip(to).map(relative).fold(0.0, f64::max)
}
