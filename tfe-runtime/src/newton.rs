//! The nonlinear iterations of an element: fixed-point iteration first, simplified Newton iteration where it is needed.

use crate::control::{POSITION_ROUND_OFF, ROUGH_ROUND_OFF};
use crate::equations::{Equations, Increment};
use crate::error::StepError;
use crate::evidence::Evidence;
use crate::lu;
use crate::real::integer_power;
use crate::statistics::Contraction;
use crate::workspace::Scratch;

pub use crate::control::{Control, Solve};

/// The settings of an iteration, known at run time or at compile time.
pub(crate) trait Asked {
    /// Whether the start of the last step is kept, as dense output and derivatives of steps need it.
    const KEEPS_START: bool;

    fn control(&self) -> Control;
}

impl Asked for Control {
    const KEEPS_START: bool = true;

    #[inline(always)]
    fn control(&self) -> Control {
        *self
    }
}

/// [`Control::default`] as compile-time constants, for emitted solvers.
pub(crate) struct Standard;

impl Asked for Standard {
    const KEEPS_START: bool = false;

    #[inline(always)]
    fn control(&self) -> Control {
        Control::DEFAULT
    }
}

/// Increments below this size are rounding errors of the residual, if they no longer decrease.
pub(crate) const ROUND_OFF: f64 = 4096.0 * f64::EPSILON;

/// The same for large stiff models, whose residuals are differences of forces that are many orders of magnitude larger.
#[cfg(feature = "sparse")]
const STIFF_ROUND_OFF: f64 = 1e-6;

/// The number of fixed-point iterations that cost as much as Newton's method.
pub(crate) const PATIENCE: u32 = 24;

/// The iteration with which a step begins.
///
/// Stiff steps come in sequences: after a fixed-point iteration that did not contract, Newton's method stays chosen for
/// some steps, so that not each of them pays for both iterations.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Preference {
    /// The number of steps for which Newton's method stays chosen.
    newton_steps: u32,
    /// What that number will be after the next failure of the fixed-point iteration.
    penalty: u32,
}

impl Preference {
    pub(crate) const NONE: Self = Self {
        newton_steps: 0,
        penalty: 0,
    };

    /// Whether a step is to begin with the fixed-point iteration.
    pub(crate) fn is_fixed_point(self) -> bool {
        self.newton_steps == 0
    }

    /// Called when the fixed-point iteration is given up.
    pub(crate) fn leave_fixed_point(&mut self) {
        self.penalty = (self.penalty * 2).clamp(1, 1024);
        self.newton_steps = self.penalty;
    }

    /// Called when the fixed-point iteration has solved a step.
    pub(crate) fn confirm_fixed_point(&mut self) {
        self.penalty /= 2;
    }

    /// Called when Newton's method begins a step.
    pub(crate) fn count_newton(&mut self) {
        self.newton_steps = self.newton_steps.saturating_sub(1);
    }
}

/// LU factors of a large sparse matrix are kept while increments shrink at least by this factor.
#[cfg(feature = "sparse")]
pub(crate) const SERVES: f64 = 0.3;

/// Up to this number of unknowns, it is not worth keeping the LU factors of an element.
const SMALL: usize = 8;

/// From this number of unknowns on, LU factors are worth keeping even at slower contraction.
const LARGE: usize = 24;

/// Monitors the convergence of a sequence of increments.
#[derive(Clone, Copy)]
pub(crate) struct Monitor {
    tolerance: f64,
    /// The weight of the previous rate.
    memory: f64,
    last: f64,
    /// The last increment of the coordinates alone.
    position: f64,
    rate: f64,
    /// The largest rate among increments that are large enough to be evidence about the root.
    wildest: f64,
    risen: u32,
    /// The number of successive increments that a newly factored matrix did not make smaller.
    #[cfg(feature = "sparse")]
    noise: u32,
    /// The smallest increment so far; `idle` counts the iterations since it was last halved.
    best: f64,
    idle: u32,
    /// The last increment relative to the size of each coordinate.
    own: f64,
    /// Whether increments are measured beside what reactions would move.
    #[cfg(feature = "alloc")]
    rests: bool,
}

/// One accidentally small increment must not end an iteration: the convergence estimate uses at least this fraction of
/// the previous rate.
const MEMORY: f64 = 0.1;

/// The target of a fixed-point iteration for a tolerance, and the weight of the previous rate.
///
/// Above round-off both are strict, because the momenta at the end follow from forces at the rates before the last
/// increment, whose error is larger than that of the rates after it. Judged by increments alone, some results are off
/// by 170 times the tolerance; with a 16th of it as target, by five times; with a 64th, by half of it
/// (`a_tolerance_is_what_an_element_leaves`).
pub(crate) fn of_fixed_point(tolerance: f64) -> (f64, f64) {
    if tolerance > Control::DEFAULT.tolerance {
        (tolerance / 64.0, 1.0)
    } else {
        (tolerance, MEMORY)
    }
}

pub(crate) enum Verdict {
    Converged,
    GoOn,
}

/// After this many iterations without a smaller increment, increments are rounding errors, if the coordinates no longer
/// change.
pub(crate) const IDLE: u32 = 6;

/// After this many iterations without a smaller increment, the iteration is a cycle: even a contraction by 0.999 halves
/// increments in fewer.
pub(crate) const MAX_IDLE: u32 = 1000;

impl Monitor {
    pub(crate) fn new(tolerance: f64) -> Self {
        Self {
            tolerance,
            memory: MEMORY,
            last: f64::INFINITY,
            position: f64::INFINITY,
            rate: 1.0,
            wildest: 0.0,
            risen: 0,
            #[cfg(feature = "sparse")]
            noise: 0,
            best: f64::INFINITY,
            idle: 0,
            own: f64::INFINITY,
            #[cfg(feature = "alloc")]
            rests: false,
        }
    }

    /// The monitor of a fixed-point iteration.
    #[inline(always)]
    pub(crate) fn of_fixed_point(tolerance: f64) -> Self {
        let (tolerance, memory) = of_fixed_point(tolerance);
        Self {
            memory,
            ..Self::new(tolerance)
        }
    }

    /// The ratio of the last increment to the one before.
    pub(crate) fn rate(&self) -> f64 {
        self.rate
    }

    /// The evidence for the root that a fixed-point iteration has found; `yielding` tells whether Newton's method can
    /// take over.
    #[inline(always)]
    pub(crate) fn evidence(&self, yielding: bool) -> Evidence {
        Evidence::of_fixed_point(self.wildest, yielding)
    }

    /// The error with which a fixed-point iteration that did not converge ends.
    #[cold]
    pub(crate) fn stalled(&self, iterations: u32, control: &Control) -> StepError {
        // Without an iteration there is no increment.
        if iterations > 0 && !self.last.is_finite() {
            return StepError::NonFinite;
        }
        StepError::FixedPointStalled {
            iterations,
            residual: self.last,
            tolerance: control.tolerance,
        }
    }

    /// The last increment.
    pub(crate) fn last(&self) -> f64 {
        self.last
    }

    /// # Errors
    /// [`StepError::NonFinite`].
    #[cfg_attr(feature = "alloc", inline(always))]
    #[cfg_attr(not(feature = "alloc"), inline(never))] // small programs
    pub(crate) fn judge(&mut self, increment: Increment) -> Result<Verdict, StepError> {
        let (size, last) = (increment.relative, self.last);
        self.position = increment.position;
        if !(size < f64::INFINITY) {
            return Err(StepError::NonFinite);
        }
        let is_better = size < 0.5 * self.best;
        if is_better && size * size > self.tolerance * last {
            // The common case: neither the first nor the last increment. The rest of the function without what does not
            // apply here.
            (self.rate, self.last) = (size / last, size);
            self.see_rate();
            (self.best, self.idle, self.risen) = (size, 0, 0);
            return Ok(Verdict::GoOn);
        }
        if is_better && last == f64::INFINITY {
            // The first increment gives no rate.
            (self.last, self.best) = (size, size);
            return Ok(if size <= self.tolerance {
                Verdict::Converged
            } else {
                Verdict::GoOn
            });
        }
        // The remaining error is the rest of a geometric series, size · ρ/(1 − ρ). It is written without divisions,
        // because everything else waits for this decision.
        let converged = if size >= last {
            size <= self.tolerance
        } else {
            let memory = self.memory * self.rate;
            size * size <= self.tolerance * (last - size)
                && size * memory <= self.tolerance * (1.0 - memory)
        };
        self.rate = if size == 0.0 { 0.0 } else { size / last };
        self.last = size;
        self.see_rate();
        if converged {
            return Ok(Verdict::Converged);
        }
        if is_better {
            (self.best, self.idle, self.risen) = (size, 0, 0);
            return Ok(Verdict::GoOn);
        }
        self.risen = if size >= last { self.risen + 1 } else { 0 };
        self.idle += 1;
        // Near rest the velocities are rounding errors themselves, and increments relative to them mean nothing.
        let settled = increment.position <= 4.0 * f64::EPSILON;
        let stalled = (self.risen >= 1 && size <= ROUND_OFF)
            || (self.risen >= 3 && (size <= ROUGH_ROUND_OFF || settled))
            || (self.idle >= IDLE && settled);
        Ok(if stalled {
            Verdict::Converged
        } else {
            Verdict::GoOn
        })
    }

    /// The increment, or, of a mechanism that constraints hold at rest, the one that `beside` measures beside what the
    /// reactions would move (T-168): the velocities are rounding errors of the balance of forces there.
    #[cfg(feature = "alloc")]
    pub(crate) fn beside_reactions(
        &mut self,
        increment: Increment,
        iteration: u32,
        beside: &dyn Fn() -> Option<Increment>,
    ) -> Increment {
        // Infinite where the step leads to zero velocities.
        let is_far = increment.relative > Evidence::FAR;
        let is_doubtful = is_far && (iteration > 0 || increment.relative == f64::INFINITY);
        if !(self.rests || is_doubtful || self.idle >= IDLE) {
            return increment;
        }
        let Some(beside) = beside() else {
            return increment;
        };
        if !self.rests {
            // Sizes relative to the state say nothing of those that follow.
            *self = Self {
                rests: true,
                ..Self::new(self.tolerance)
            };
        }
        beside
    }

    /// Judges an increment, and, once increments relative to the largest coordinate have converged, what `own`
    /// computes: the same relative to the size of each coordinate, where one is small beside the largest. From then on
    /// only these count, which `settles` remembers: a local variable, so that models without small coordinates compile
    /// nothing of this. Rough tolerances stay relative to the largest coordinate.
    ///
    /// # Errors
    /// [`StepError::NonFinite`].
    #[inline(always)]
    pub(crate) fn judge_each(
        &mut self,
        (increment, control): (Increment, &Control),
        settles: &mut bool,
        own: impl FnOnce() -> Option<f64>,
    ) -> Result<Verdict, StepError> {
        let verdict = match *settles {
            true => Verdict::Converged,
            false => self.judge(increment)?,
        };
        if matches!(verdict, Verdict::Converged)
            && !control.is_rough()
            && let Some(own) = own()
        {
            *settles = true;
            return self.settle(own);
        }
        Ok(verdict)
    }

    /// Declares that from now on increments are those relative to the size of each coordinate.
    pub(crate) fn begin_to_settle(&mut self) {
        // Nothing is known of them yet.
        self.last = 1.0;
    }

    /// Judges an increment relative to the size of each coordinate. Rounding errors of larger coordinates may keep it
    /// above the tolerance: the iteration ends where such increments do not shrink.
    ///
    /// # Errors
    /// [`StepError::NonFinite`].
    #[cold]
    #[inline(never)]
    pub(crate) fn settle(&mut self, own: f64) -> Result<Verdict, StepError> {
        /// Increments of an iteration that contracts, even if slowly.
        const SHRINKS: f64 = 0.9;

        let before = core::mem::replace(&mut self.own, own);
        self.last = own;
        if !(own < f64::INFINITY) {
            return Err(StepError::NonFinite);
        }
        let goes_on = if before == f64::INFINITY {
            own > self.tolerance
        } else {
            own < SHRINKS * before && own * own > self.tolerance * (before - own)
        };
        Ok(if goes_on {
            Verdict::GoOn
        } else {
            Verdict::Converged
        })
    }

    /// Records the rate of the last increment if it is evidence about the root.
    #[inline(always)]
    fn see_rate(&mut self) {
        let rate = if self.last > Evidence::FAR {
            self.rate
        } else {
            0.0
        };
        if self.wildest < rate {
            self.wildest = rate;
        }
    }

    /// Whether the last increment is the rounding error of a stiff residual: with a matrix factored just before it,
    /// Newton's method would have halved any true error. It has to happen twice in succession, so that one unlucky step
    /// does not end the iteration.
    #[cfg(feature = "sparse")]
    pub(crate) fn is_noise(&mut self, fresh: bool) -> bool {
        let idle = fresh && self.rate > 0.5 && self.last <= STIFF_ROUND_OFF;
        self.noise = if idle { self.noise + 1 } else { 0 };
        self.noise >= 2
    }

    /// Whether the last increments are rounding errors of nearly dependent equations: small, or no longer changing the
    /// coordinates, and no longer halved by newly factored matrices. Such increments may alternate between two values
    /// for ever. The rounding errors of positions under constraints appear in the velocities divided by the step.
    fn is_rounding(&self, fresh: bool) -> bool {
        let is_small = self.last <= ROUGH_ROUND_OFF || self.position <= POSITION_ROUND_OFF;
        fresh && self.idle >= IDLE && is_small
    }

    /// Whether the increments have not been halved for so long that they never will be: they cycle.
    pub(crate) fn is_stuck(&self) -> bool {
        self.idle >= MAX_IDLE
    }

    /// Whether the last increment is below one rounding of what it is added to: a slowly contracting iteration may
    /// reach this before its increments cease to decrease.
    pub(crate) fn is_at_round_off(&self) -> bool {
        self.last <= f64::EPSILON
    }

    /// Whether the present rate is too slow to converge in the remaining iterations.
    #[inline(always)]
    pub(crate) fn is_hopeless(&self, remaining: u32) -> bool {
        let target = self.tolerance.max(64.0 * f64::EPSILON);
        if self.last <= target {
            return false;
        }
        if remaining >= 8 && self.rate < 0.05 && self.last <= 1e-4 {
            // The eighth power of such a rate is less than half of the smallest target, as below.
            return false;
        }
        let exponent = i32::try_from(remaining).unwrap_or(i32::MAX);
        // At a good rate few iterations suffice: most steps return here. Half of the target is left for rounding
        // errors.
        let squared = self.rate * self.rate;
        let eighth = (squared * squared) * (squared * squared);
        if exponent >= 8 && self.rate < 1.0 && self.last * eighth < 0.5 * target {
            return false;
        }
        // Either the power falls below the target or it never does.
        self.last * integer_power(self.rate, exponent) > target
    }
}

/// Fixed-point iteration. With `yielding` it gives up as soon as Newton's method is cheaper.
pub(crate) fn fixed_point<E>(
    equations: &mut E,
    control: &Control,
    scratch: &mut Scratch<'_>,
    yielding: bool,
) -> Result<(), StepError>
where
    E: Equations,
{
    let mut monitor = Monitor::of_fixed_point(control.tolerance);
    let most = if yielding {
        control.max_iterations.min(PATIENCE)
    } else {
        control.max_iterations
    };
    let (mut refresh, mut settles, mut iterations) = (true, false, most);
    for iteration in 0..most {
        let Scratch { unknowns, step, .. } = scratch;
        equations.sweep(unknowns, step, refresh)?;
        for (unknown, step) in unknowns.iter_mut().zip(step.iter()) {
            *unknown += step;
        }
        let statistics = equations.statistics();
        statistics.iterations += 1;
        statistics.fixed_point_iterations += 1;
        let increment = equations.measure(unknowns, step);
        let own_increment = || equations.measure_own(unknowns, step);
        let verdict = monitor.judge_each((increment, control), &mut settles, own_increment)?;
        equations.statistics().contraction = Contraction::of(monitor.rate());
        if let Verdict::Converged = verdict {
            return monitor.evidence(yielding).check(control.solve);
        }
        // The initial guess is accurate to a few digits, so that one evaluation of the mass matrices usually suffices.
        refresh = monitor.rate() > 0.1;
        let is_hopeless =
            yielding && iteration >= 2 && !settles && monitor.is_hopeless(most - iteration);
        if is_hopeless || monitor.is_stuck() {
            iterations = iteration + 1;
            break;
        }
    }
    if monitor.is_at_round_off() {
        return monitor.evidence(yielding).check(control.solve);
    }
    Err(monitor.stalled(iterations, control))
}

/// From where Newton's method starts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Beginning {
    /// From a guess whose tangent may differ much from that at the root: the tangent is evaluated anew as long as
    /// increments do not shrink well.
    Far,
    /// From a guess near the root: the first increment with a new tangent says nothing about the rate, and after a
    /// large one the tangent is tried once more.
    Near,
    /// The scratch memory holds the LU factors of the last step.
    Known,
}

/// Simplified Newton iteration: the LU factors are kept while they contract well enough, also from step to step.
///
/// Returns the evidence for the root. For linear equations the factors are always kept.
///
/// The equations are passed without their type, so that this is compiled once and not for every model.
#[cfg_attr(not(feature = "alloc"), inline(never))] // small programs
pub(crate) fn newton(
    equations: &mut dyn Equations,
    control: &Control,
    scratch: &mut Scratch<'_>,
    beginning: Beginning,
    linear: bool,
) -> Result<Evidence, StepError> {
    let mut monitor = Monitor::new(control.tolerance);
    // Factoring a small matrix is cheaper than the additional iterations that old factors would need.
    let known = beginning == Beginning::Known && (linear || scratch.unknowns.len() >= SMALL);
    let mut fresh = !known;
    let (mut evidence, mut own, mut settles) = (Evidence::of_newton(), false, false);
    // Factoring a large matrix costs as much as many iterations with old factors.
    let is_large = scratch.unknowns.len() >= LARGE;
    let good_enough = if is_large { 0.3 } else { 0.05 };
    let is_near = equations.is_by_newton_alone() && is_large && beginning == Beginning::Near;
    let mut uses = 0;
    let mut iterations = control.max_iterations;
    for iteration in 0..control.max_iterations {
        let Scratch {
            unknowns,
            step,
            tangent,
            pivots,
        } = scratch;
        if fresh {
            equations.tangent(unknowns, step, tangent)?;
            let factored = equations.factor(unknowns.len(), tangent, pivots);
            factored.map_err(|singular| {
                // A NaN in the model shows up here first.
                if tangent.iter().all(|entry| entry.is_finite()) {
                    StepError::SingularTangent {
                        unknown: singular.column,
                    }
                } else {
                    StepError::NonFinite
                }
            })?;
            equations.statistics().factorizations += 1;
            uses = 0;
        } else {
            equations.residual(unknowns, step)?;
        }
        uses += 1;
        lu::solve(unknowns.len(), tangent, pivots, step);
        for (unknown, step) in unknowns.iter_mut().zip(step.iter()) {
            *unknown -= step;
        }
        let statistics = equations.statistics();
        statistics.iterations += 1;
        statistics.newton_iterations += 1;
        let increment = equations.measure(unknowns, step);
        #[cfg(feature = "alloc")]
        let increment = monitor.beside_reactions(increment, iteration, &|| {
            equations.measure_at_rest(unknowns, step)
        });
        own |= fresh;
        evidence.see(increment, own);
        let own_increment = || equations.measure_own(unknowns, step);
        let verdict = monitor.judge_each((increment, control), &mut settles, own_increment)?;
        // Linear equations are solved once; a second solution removes the rounding error.
        let refined = linear && iteration > 0 && increment.relative <= ROUND_OFF;
        if refined || matches!(verdict, Verdict::Converged) || monitor.is_rounding(fresh) {
            equations.finish(unknowns, step)?;
            return Ok(evidence);
        }
        // The first increment alone gives no rate: old factors, and new factors of a large matrix, are allowed a second
        // one.
        let is_tried = if is_near {
            uses > 1
        } else {
            iteration > 0 || !known
        };
        fresh = !linear && is_tried && monitor.rate() > good_enough;
        if monitor.is_stuck() {
            iterations = iteration + 1;
            break;
        }
    }
    Err(StepError::NewtonStalled {
        iterations,
        residual: monitor.last(),
        tolerance: control.tolerance,
    })
}

#[cfg(test)]
mod tests;
