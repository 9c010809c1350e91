//! The iterations inside an element: fixed point first, Newton where it must.

use crate::control::POSITION_ROUND_OFF;
use crate::equations::{Equations, Increment};
use crate::error::StepError;
use crate::evidence::Evidence;
use crate::lu;
use crate::real::integer_power;
use crate::statistics::Contraction;
use crate::workspace::Scratch;

pub use crate::control::{Control, Solve};

/// What is asked of an iteration, known when the program runs or when it is compiled.
pub(crate) trait Asked {
    fn control(&self) -> Control;
}

impl Asked for Control {
    #[inline(always)]
    fn control(&self) -> Control {
        *self
    }
}

/// [`Control::default`], known to the compiler.
pub(crate) struct Standard;

impl Asked for Standard {
    #[inline(always)]
    fn control(&self) -> Control {
        Control::DEFAULT
    }
}

/// Increments below it are the rounding of the residual, if they no longer fall.
pub(crate) const ROUND_OFF: f64 = 4096.0 * f64::EPSILON;

/// The same where Newton's method is ill-conditioned, if they have not fallen for some time.
pub(crate) const ROUGH_ROUND_OFF: f64 = 1e-10;

/// The same of large stiff models, where residuals are differences of forces many orders larger.
#[cfg(feature = "sparse")]
const STIFF_ROUND_OFF: f64 = 1e-6;

/// Fixed-point iterations that cost as much as Newton's way.
pub(crate) const PATIENCE: u32 = 24;

/// Which iteration a step begins with.
///
/// Stiff steps come in rows: after a fixed point that did not contract Newton's method stays chosen for some steps, so that not each of them
/// pays for two iterations.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Preference {
    /// Steps for which Newton's method stays chosen.
    newton_steps: u32,
    /// How many it will be after the next failure of the fixed point.
    penalty: u32,
}

impl Preference {
    pub(crate) const NONE: Self = Self {
        newton_steps: 0,
        penalty: 0,
    };

    /// Whether a step is to begin with the fixed point.
    pub(crate) fn is_fixed_point(self) -> bool {
        self.newton_steps == 0
    }

    /// The fixed point was given up.
    pub(crate) fn leave_fixed_point(&mut self) {
        self.penalty = (self.penalty * 2).clamp(1, 1024);
        self.newton_steps = self.penalty;
    }

    /// The fixed point has done a step.
    pub(crate) fn confirm_fixed_point(&mut self) {
        self.penalty /= 2;
    }

    /// Newton's method begins a step.
    pub(crate) fn count_newton(&mut self) {
        self.newton_steps = self.newton_steps.saturating_sub(1);
    }
}

/// Factors of a large sparse matrix serve while increments shrink at least as fast.
#[cfg(feature = "sparse")]
pub(crate) const SERVES: f64 = 0.3;

/// Unknowns of an element up to which factors of its matrix are not worth keeping.
const SMALL: usize = 8;

/// Unknowns of an element from which on factors of its matrix are worth keeping for slower contraction.
const LARGE: usize = 24;

/// Judges a sequence of increments.
pub(crate) struct Monitor {
    tolerance: f64,
    /// How much the rate before counts.
    memory: f64,
    last: f64,
    /// By how much it moves the coordinates.
    position: f64,
    rate: f64,
    /// The largest rate of increments that tell something of the root.
    wildest: f64,
    risen: u32,
    /// Increments in a row that a fresh matrix did not make smaller.
    #[cfg(feature = "sparse")]
    noise: u32,
    /// The smallest increment so far, and for how many iterations it has not been halved.
    best: f64,
    idle: u32,
}

/// One lucky small increment must not end an iteration: it goes on as if the rate before counted that much.
const MEMORY: f64 = 0.1;

/// What a fixed point has to come to, and how much the rate before counts, for a tolerance.
///
/// Above the roundings both are strict: momenta at the end follow from forces at the rates before the last increment, which are off by more than the rates after it.
/// By increments alone some are left off by 170 times the tolerance, with a 16th of it by five times, with a 64th by half of it (`a_tolerance_is_what_an_element_leaves`).
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

/// So many iterations without a smaller increment are noise, if the coordinates do not move any more.
pub(crate) const IDLE: u32 = 6;

/// So many iterations without a smaller increment are a cycle: a contraction by 0.999 halves increments in fewer.
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
        }
    }

    /// For a fixed point.
    #[inline(always)]
    pub(crate) fn of_fixed_point(tolerance: f64) -> Self {
        let (tolerance, memory) = of_fixed_point(tolerance);
        Self {
            memory,
            ..Self::new(tolerance)
        }
    }

    /// By how much the last increment was smaller than the one before.
    pub(crate) fn rate(&self) -> f64 {
        self.rate
    }

    /// What speaks for the root that a fixed point has found; `yielding` says that Newton's method may follow.
    #[inline(always)]
    pub(crate) fn evidence(&self, yielding: bool) -> Evidence {
        Evidence::of_fixed_point(self.wildest, yielding)
    }

    /// What a fixed point that has come to no end ends with.
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
            // Most increments, neither the first nor the last: what follows, without what does not apply.
            (self.rate, self.last) = (size / last, size);
            self.see_rate();
            (self.best, self.idle, self.risen) = (size, 0, 0);
            return Ok(Verdict::GoOn);
        }
        if is_better && last == f64::INFINITY {
            // The first one tells no rate.
            (self.last, self.best) = (size, size);
            return Ok(if size <= self.tolerance {
                Verdict::Converged
            } else {
                Verdict::GoOn
            });
        }
        // What is left is the rest of a geometric series, size · ρ/(1 − ρ). Written without quotients: what follows waits for this decision.
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
        // Near rest the velocities are noise themselves, and increments beside them say nothing.
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

    /// Remembers the rate of the last increment if that tells something of the root.
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

    /// Whether the last increment is the rounding of a stiff residual: with a matrix made just before it, Newton's method would have halved anything else.
    /// Twice in a row, so that one unlucky step does not end the iteration.
    #[cfg(feature = "sparse")]
    pub(crate) fn is_noise(&mut self, fresh: bool) -> bool {
        let idle = fresh && self.rate > 0.5 && self.last <= STIFF_ROUND_OFF;
        self.noise = if idle { self.noise + 1 } else { 0 };
        self.noise >= 2
    }

    /// Whether the last increments are roundings of nearly dependent equations: small, or no longer moving the coordinates, and not halved any more by matrices made for
    /// them. They may go to and fro between two values for ever. Constraints leave roundings of positions, which in velocities are as large as they are over the step.
    fn is_rounding(&self, fresh: bool) -> bool {
        let is_small = self.last <= ROUGH_ROUND_OFF || self.position <= POSITION_ROUND_OFF;
        fresh && self.idle >= IDLE && is_small
    }

    /// Whether the increments have not been halved for so long that they never will be: they go to and fro between some values.
    pub(crate) fn is_stuck(&self) -> bool {
        self.idle >= MAX_IDLE
    }

    /// Whether the last increment is below a rounding of what it adds to: what an iteration that contracts slowly may come to before its increments stop to fall.
    pub(crate) fn is_at_round_off(&self) -> bool {
        self.last <= f64::EPSILON
    }

    /// Whether so many more iterations would not do, at the present rate.
    #[inline(always)]
    pub(crate) fn is_hopeless(&self, remaining: u32) -> bool {
        let target = self.tolerance.max(64.0 * f64::EPSILON);
        if self.last <= target {
            return false;
        }
        if remaining >= 8 && self.rate < 0.05 && self.last <= 1e-4 {
            // The eighth power is less than half of the smallest target, as below.
            return false;
        }
        let exponent = i32::try_from(remaining).unwrap_or(i32::MAX);
        // Few iterations do where increments shrink well: most steps end here, with half of the target for roundings.
        let squared = self.rate * self.rate;
        let eighth = (squared * squared) * (squared * squared);
        if exponent >= 8 && self.rate < 1.0 && self.last * eighth < 0.5 * target {
            return false;
        }
        // It falls all the way, or it never does.
        self.last * integer_power(self.rate, exponent) > target
    }
}

/// Fixed-point iteration. With `yielding` it gives up as soon as Newton's method is the better way.
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
    let (mut refresh, mut iterations) = (true, most);
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
        let verdict = monitor.judge(increment)?;
        equations.statistics().contraction = Contraction::of(monitor.rate());
        if let Verdict::Converged = verdict {
            return monitor.evidence(yielding).check(control.solve);
        }
        // The start is good to a few digits, so one evaluation of mass matrices mostly serves.
        refresh = monitor.rate() > 0.1;
        if (yielding && iteration >= 2 && monitor.is_hopeless(most - iteration))
            || monitor.is_stuck()
        {
            iterations = iteration + 1;
            break;
        }
    }
    if monitor.is_at_round_off() {
        return monitor.evidence(yielding).check(control.solve);
    }
    Err(monitor.stalled(iterations, control))
}

/// Where Newton's method begins.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Beginning {
    /// Where a matrix may be far from that at the root: it is made anew as long as increments do not shrink well.
    Far,
    /// Near the root: the first increment with a new matrix tells nothing of it, and a large one is tried once more.
    Near,
    /// The scratch holds the factors of the last step.
    Known,
}

/// Newton's method; the matrix is kept while it serves, also from step to step.
///
/// Says what speaks for the root. The factors of linear equations are kept throughout.
#[cfg_attr(not(feature = "alloc"), inline(never))] // small programs
pub(crate) fn newton<E>(
    equations: &mut E,
    control: &Control,
    scratch: &mut Scratch<'_>,
    beginning: Beginning,
    linear: bool,
) -> Result<Evidence, StepError>
where
    E: Equations,
{
    let mut monitor = Monitor::new(control.tolerance);
    // A small matrix is cheaper than the iterations that an old one would take more.
    let known = beginning == Beginning::Known && (linear || scratch.unknowns.len() >= SMALL);
    let mut fresh = !known;
    let (mut evidence, mut own) = (Evidence::of_newton(), false);
    // A large matrix costs as much as many iterations with an old one.
    let is_large = scratch.unknowns.len() >= LARGE;
    let good_enough = if is_large { 0.3 } else { 0.05 };
    let is_near = E::BY_NEWTON_ALONE && is_large && beginning == Beginning::Near;
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
            lu::factor(unknowns.len(), tangent, pivots).map_err(|singular| {
                // A NaN of the model shows here first.
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
        own |= fresh;
        evidence.see(increment, own);
        let verdict = monitor.judge(increment)?;
        // Equations that are linear are solved once; a second solution takes away the rounding.
        let refined = linear && iteration > 0 && increment.relative <= ROUND_OFF;
        if refined || matches!(verdict, Verdict::Converged) || monitor.is_rounding(fresh) {
            equations.finish(unknowns, step)?;
            return Ok(evidence);
        }
        // The first increment alone tells no rate: an old matrix may show a second one, and so may a large new one.
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
mod tests {
    use super::*;

    /// The cheap way out decides as the power itself does.
    #[test]
    fn hopeless_is_what_the_rate_never_brings_to_the_target() {
        for remaining in [0, 1, 7, 8, 9, 40, 100] {
            for tenths in 0..=25 {
                let rate = f64::from(tenths) / 20.0;
                for exponent in -60..=10 {
                    let last = 1.7 * 2.0_f64.powi(exponent);
                    let mut monitor = Monitor::new(1e-13);
                    (monitor.last, monitor.rate) = (last, rate);
                    let target = 1e-13;
                    let by_power = last > target && last * integer_power(rate, remaining) > target;
                    assert_eq!(
                        monitor.is_hopeless(remaining as u32),
                        by_power,
                        "{last} · {rate}^{remaining}"
                    );
                }
            }
        }
    }
}
