//! Steps over one element after the other, on memory of the caller or of the stepper.

use crate::equations::{Equations, Span};
use crate::error::StepError;
use crate::evidence::{Energy, Evidence, conserves_energy, rounding};
use crate::method::{
    Last, cold_phase, cold_velocity, continued_ratio, end_of, may_be_phase, set_extrapolation,
    set_kicks,
};
use crate::model::{Model, State};
use crate::newton::{Beginning, Preference, fixed_point, newton};
use crate::phase_form::PhaseForm;
use crate::scheme::Tables;
use crate::velocity_form::VelocityForm;
use crate::workspace::{Parts, Scratch, Workspace};

pub use crate::control::{Control, Solve};
#[cfg(feature = "alloc")]
pub use crate::dense::DenseElement;
pub use crate::method::{Impulse, Interval, Memory, Method};
#[cfg(feature = "alloc")]
pub use crate::points::reach::Reach;
#[cfg(feature = "alloc")]
pub use crate::stepper::{Stepper, Suspended};

impl<M, T> Method<'_, M, T>
where
    T: Tables,
{
    /// Moves `state` over one element.
    ///
    /// # Errors
    /// [`StepError`]; `state` is unchanged then.
    pub fn advance<const N: usize>(
        &self,
        memory: &mut Memory<N>,
        workspace: Workspace<'_>,
        interval: Interval<'_, N>,
        state: &mut State<N>,
    ) -> Result<(), StepError>
    where
        M: Model<N>,
    {
        let step = interval.length;
        if !(step.is_finite() && step != 0.0) {
            return Err(StepError::InvalidStep { step });
        }
        if const { !M::CONSTRAINTS.is_empty() } {
            return crate::constrained_step::advance(self, memory, workspace, interval, state);
        }
        self.advance_free(memory, workspace, interval, state)
    }

    /// The same without constraints.
    fn advance_free<const N: usize>(
        &self,
        memory: &mut Memory<N>,
        workspace: Workspace<'_>,
        interval: Interval<'_, N>,
        state: &mut State<N>,
    ) -> Result<(), StepError>
    where
        M: Model<N>,
    {
        let Interval {
            start: t,
            length: h,
            impulses,
        } = interval;
        let scheme = self.tables.view();
        let mut parts = Parts::of(workspace, &scheme.element, M::FORM, M::CONSTRAINTS.len())?;
        let warm = self.prepare(memory, &mut parts, h, state)?;
        set_kicks(&scheme, &interval, parts.kicks);
        let low = if warm { memory.low } else { State::ZERO };
        let span = Span {
            t,
            h,
            start: state,
            low: &low,
            kicks: &*parts.kicks,
            damping: 0.0,
        };
        // After a failure there is no polynomial to continue from.
        memory.last = None;
        let mut driver = Driver {
            control: &self.control,
            origin: parts.origin,
            warm,
            known: memory.factored.take() == Some(h),
            linear: M::FACTS.linear,
            preference: &mut memory.preference,
            has_factors: false,
            evidence: None,
        };
        let scratch = Scratch {
            unknowns: parts.unknowns,
            step: parts.step,
            tangent: parts.tangent,
            pivots: parts.tangent_pivots,
        };
        let (end, end_low) = if const { may_be_phase::<M, N>() } && scheme.element.has_phase_form()
        {
            let mut equations = PhaseForm::new(
                self.model,
                (scheme, span),
                parts.kept,
                &mut memory.statistics,
            );
            let scratch = driver.solve(&mut equations, scratch, |unknowns| {
                cold_phase(self.model, &scheme, t, state, unknowns);
            })?;
            let (pi, kappa) = scratch.unknowns.as_chunks().0.split_at(scheme.points());
            end_of(&scheme, &span, kappa, pi, impulses)
        } else {
            let mut equations = VelocityForm::new(
                self.model,
                (scheme, span),
                parts.kept,
                (&mut memory.mass, &mut memory.statistics),
            );
            let scratch = driver.solve(&mut equations, scratch, |unknowns| {
                cold_velocity(self.model, t, state, unknowns);
            })?;
            end_of(
                &scheme,
                &span,
                scratch.unknowns.as_chunks().0,
                equations.forces,
                impulses,
            )
        };
        self.check_end(driver.evidence.as_ref(), &interval, [state, &end])?;
        if driver.has_factors && !(M::FACTS.linear && M::FACTS.time_dependent) {
            memory.factored = Some(h);
        }
        memory.last = Some(Last {
            t,
            h,
            start: *state,
            start_low: low,
            end,
        });
        memory.low = end_low;
        memory.statistics.steps += 1;
        *state = end;
        Ok(())
    }

    /// Refuses an end that is not finite, and one that Newton's method does not show to continue the motion.
    #[inline(always)]
    fn check_end<const N: usize>(
        &self,
        evidence: Option<&Evidence>,
        interval: &Interval<'_, N>,
        [start, end]: [&State<N>; 2],
    ) -> Result<(), StepError>
    where
        M: Model<N>,
    {
        if !end.is_finite() {
            return Err(StepError::NonFinite);
        }
        // A contracting fixed-point iteration is proof enough, and such a step is to have no additional cost.
        let Some(evidence) = evidence.filter(|_| !M::FACTS.linear) else {
            return Ok(());
        };
        let times = (interval.start, interval.length);
        let energy = (interval.impulses.is_empty() && conserves_energy::<M, N>())
            .then(|| Energy::of(self.model, times, [start, end]))
            .flatten();
        let rounding = || rounding(self.model, times, [start, end]);
        let element = self.tables.view().element;
        evidence.check_with(self.control.solve, energy, element, &rounding)
    }

    /// Sets the initial guess of the unknowns; true if it continues the last step.
    pub(crate) fn prepare<const N: usize>(
        &self,
        memory: &mut Memory<N>,
        parts: &mut Parts<'_, N>,
        h: f64,
        state: &State<N>,
    ) -> Result<bool, StepError>
    where
        M: Model<N>,
    {
        if !state.is_finite() {
            return Err(StepError::NonFinite);
        }
        let is_free = const { M::CONSTRAINTS.is_empty() };
        Ok(continue_last(
            self.tables,
            memory,
            parts,
            (h, state),
            is_free,
        ))
    }
}

/// Extrapolates the unknowns of the last step if that has ended at `state`; otherwise they are set to zero, and the
/// result is false. Without constraints, all unknowns are rates.
fn continue_last<T, const N: usize>(
    tables: &T,
    memory: &mut Memory<N>,
    parts: &mut Parts<'_, N>,
    (h, state): (f64, &State<N>),
    is_free: bool,
) -> bool
where
    T: Tables,
{
    let Some(last) = memory.last.filter(|last| last.end.is_same(state)) else {
        parts.kept.momenta.fill(state.p);
        parts.unknowns.fill(0.0);
        return false;
    };
    let scheme = tables.view();
    let fraction = continued_ratio(h / last.h);
    if memory.ratio != Some(fraction) {
        set_extrapolation(&scheme, fraction, parts.extrapolation);
        memory.ratio = Some(fraction);
    }
    let unknowns = scheme.unknowns();
    let halves = if is_free {
        parts.unknowns.len() / (unknowns * N)
    } else {
        1
    };
    for half in 0..halves {
        let range = half * unknowns * N..(half + 1) * unknowns * N;
        let old = parts.unknowns[range.clone()].as_chunks::<N>().0;
        let new = parts.origin[range].as_chunks_mut::<N>().0;
        for (row, weights) in new
            .iter_mut()
            .zip(parts.extrapolation.chunks_exact(unknowns))
        {
            *row = [0.0; N];
            for (weight, old) in weights.iter().zip(old) {
                for a in 0..N {
                    row[a] += weight * old[a];
                }
            }
        }
    }
    let continued = halves * unknowns * N;
    parts.unknowns[..continued].copy_from_slice(&parts.origin[..continued]);
    true
}

/// Chooses between the iterations and between their initial guesses.
struct Driver<'a> {
    control: &'a Control,
    origin: &'a mut [f64],
    warm: bool,
    known: bool,
    linear: bool,
    preference: &'a mut Preference,
    /// Whether the tangent holds LU factors that may serve the next step.
    has_factors: bool,
    /// The evidence that Newton's method gives for its root.
    evidence: Option<Evidence>,
}

impl Driver<'_> {
    fn solve<'s, E>(
        &mut self,
        equations: &mut E,
        mut scratch: Scratch<'s>,
        cold: impl Fn(&mut [f64]),
    ) -> Result<Scratch<'s>, StepError>
    where
        E: Equations,
    {
        if !self.warm {
            cold(scratch.unknowns);
            self.origin.copy_from_slice(scratch.unknowns);
        }
        match self.control.solve {
            Solve::FixedPoint => {
                fixed_point(equations, self.control, &mut scratch, false)?;
                return Ok(scratch);
            }
            Solve::Auto | Solve::Trusting if !self.linear && self.preference.is_fixed_point() => {
                if fixed_point(equations, self.control, &mut scratch, true).is_ok() {
                    self.preference.confirm_fixed_point();
                    return Ok(scratch);
                }
                self.preference.leave_fixed_point();
                equations.statistics().fallbacks += 1;
                scratch.unknowns.copy_from_slice(self.origin);
            }
            Solve::Auto | Solve::Trusting | Solve::Newton => {}
        }
        self.preference.count_newton();
        self.has_factors = true;
        let first = newton(
            equations,
            self.control,
            &mut scratch,
            if self.known {
                Beginning::Known
            } else {
                Beginning::Far
            },
            self.linear,
        );
        let proves =
            |evidence: &Evidence| self.linear || evidence.check(self.control.solve).is_ok();
        self.evidence = Some(match first {
            Ok(evidence) if !self.warm || proves(&evidence) => evidence,
            Err(error) if !self.warm => return Err(error),
            Ok(_) | Err(_) => {
                // The extrapolated polynomial may be a worse initial guess than a cold start.
                cold(scratch.unknowns);
                newton(
                    equations,
                    self.control,
                    &mut scratch,
                    Beginning::Far,
                    self.linear,
                )?
            }
        });
        Ok(scratch)
    }
}
