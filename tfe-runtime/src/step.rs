//! Steps: one element after the other, on memory of the caller or on its own.

use crate::basis::{MAX_NODES, legendre};
use crate::constrained::rows::Independence;
use crate::double_double::DoubleDouble;
use crate::equations::{Equations, Span};
use crate::error::StepError;
use crate::evidence::{Energy, Evidence, conserves_energy};
use crate::legendre::{largest, velocity};
use crate::lu::Block;
use crate::model::{First, Form, Model, State};
use crate::newton::{Preference, fixed_point, newton};
use crate::phase_form::PhaseForm;
use crate::scheme::{SchemeRef, Tables};
use crate::statistics::Statistics;
use crate::velocity_form::VelocityForm;
use crate::workspace::{Parts, Scratch, Workspace};

#[cfg(feature = "alloc")]
pub use crate::dense::DenseElement;
pub use crate::newton::{Control, Solve};
#[cfg(feature = "alloc")]
pub use crate::stepper::{Stepper, Suspended};

/// A generalized force of the given time integral that acts at one instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Impulse<const N: usize> {
    /// When it acts; a time outside the element counts as its nearer end.
    pub time: f64,
    /// ∫ Q dt, one entry a coordinate.
    pub value: [f64; N],
}

/// Where an element lies in time, and the impulses that act in it.
#[derive(Clone, Copy, Debug)]
pub struct Interval<'a, const N: usize> {
    /// Time at the start.
    pub start: f64,
    /// Length h; negative to go back in time.
    pub length: f64,
    /// Impulses inside, each weighted by the test functions (T-49).
    pub impulses: &'a [Impulse<N>],
}

impl<const N: usize> Interval<'_, N> {
    /// Where in the element an impulse acts, τ ∈ [0, 1].
    pub(crate) fn place(&self, impulse: &Impulse<N>) -> f64 {
        ((impulse.time - self.start) / self.length).clamp(0.0, 1.0)
    }
}

/// What is carried from step to step beside the [`Workspace`].
#[derive(Clone, Debug)]
pub struct Memory<const N: usize> {
    pub(crate) statistics: Statistics,
    /// Start and end of the last step; `None` before the first and after a failure.
    pub(crate) last: Option<Last<N>>,
    /// What the end is more than its rounded numbers.
    pub(crate) low: State<N>,
    pub(crate) mass: Option<Block<N>>,
    /// The step for which the workspace holds factors.
    factored: Option<f64>,
    /// The ratio of steps for which it holds the extrapolation.
    ratio: Option<f64>,
    /// Which iteration a nonlinear step begins with.
    pub(crate) preference: Preference,
    /// Of the rows of constraints at the start and at the end of the last step.
    pub(crate) independence: Option<[Independence; 2]>,
}

/// The last step.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Last<const N: usize> {
    pub(crate) t: f64,
    pub(crate) h: f64,
    pub(crate) start: State<N>,
    pub(crate) start_low: State<N>,
    pub(crate) end: State<N>,
}

impl<const N: usize> State<N> {
    pub(crate) const ZERO: Self = Self {
        q: [0.0; N],
        p: [0.0; N],
    };

    /// Whether all numbers are equal, without a branch for each.
    pub(crate) fn is_same(&self, other: &Self) -> bool {
        let mut same = true;
        for a in 0..N {
            same &= (self.q[a] == other.q[a]) & (self.p[a] == other.p[a]);
        }
        same
    }
}

impl<const N: usize> Memory<N> {
    /// Nothing is known yet.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            statistics: Statistics::NONE,
            last: None,
            low: State::ZERO,
            mass: None,
            factored: None,
            ratio: None,
            preference: Preference::NONE,
            independence: None,
        }
    }

    /// What the steps so far have cost.
    #[must_use]
    pub const fn statistics(&self) -> &Statistics {
        &self.statistics
    }

    /// Says that the workspace no longer holds factors.
    pub(crate) fn forget_factors(&mut self) {
        self.factored = None;
    }
}

impl<const N: usize> Default for Memory<N> {
    fn default() -> Self {
        Self::new()
    }
}

/// A model with the tables of an element: everything about a step that does not change.
///
/// For steps without allocation: [`Memory`] and [`Workspace`] are the caller's. [`Stepper`] owns
/// them.
#[derive(Debug)]
pub struct Method<'a, M, T> {
    /// The model.
    pub model: &'a M,
    /// The tables of the element.
    pub tables: &'a T,
    /// How its equations are solved.
    pub control: Control,
}

// Not derived: model and tables are borrowed, they need not be `Clone`.
impl<M, T> Clone for Method<'_, M, T> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<M, T> Copy for Method<'_, M, T> {}

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
        let Interval {
            start: t,
            length: h,
            impulses,
        } = interval;
        if !(h.is_finite() && h != 0.0) {
            return Err(StepError::InvalidStep { step: h });
        }
        if const { !M::CONSTRAINTS.is_empty() } {
            return crate::constrained::advance(self, memory, workspace, interval, state);
        }
        let scheme = self.tables.view();
        let mut parts = Parts::of(workspace, &scheme.element, M::FORM, M::CONSTRAINTS.len())?;
        let warm = self.prepare(memory, &mut parts, h, state)?;
        set_kicks(&scheme, &interval, parts.kicks);
        let low = if warm { memory.low } else { State::ZERO };
        let kicks: &[[f64; N]] = parts.kicks;
        let span = Span {
            t,
            h,
            start: state,
            low: &low,
            kicks,
            damping: 0.0,
        };
        let known = memory.factored == Some(h);
        // A failure leaves nothing to continue from.
        memory.last = None;
        let mut driver = Driver {
            control: &self.control,
            origin: parts.origin,
            warm,
            known,
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
        memory.factored = None;
        let (end, end_low) = if const { may_be_phase::<M, N>() } && scheme.element.has_phase_form()
        {
            let mut equations = PhaseForm {
                model: self.model,
                scheme,
                span,
                momenta: parts.momenta,
                velocities: parts.forces,
                masses: parts.masses,
                swept: false,
                statistics: &mut memory.statistics,
            };
            let scratch = driver.solve(&mut equations, scratch, |unknowns| {
                cold_phase(self.model, &scheme, t, state, unknowns);
            })?;
            let (pi, kappa) = scratch.unknowns.as_chunks().0.split_at(scheme.points());
            end_of(&scheme, &span, kappa, pi, impulses)
        } else {
            let mut equations = VelocityForm {
                model: self.model,
                scheme,
                span,
                forces: parts.forces,
                momenta: parts.momenta,
                masses: parts.masses,
                mass_pivots: parts.mass_pivots,
                constant_mass: &mut memory.mass,
                statistics: &mut memory.statistics,
            };
            let scratch = driver.solve(&mut equations, scratch, |unknowns| {
                cold_velocity(self.model, t, state, unknowns);
            })?;
            end_of(
                &scheme,
                &span,
                scratch.unknowns.as_chunks().0,
                parts.forces,
                impulses,
            )
        };
        if !(largest(&end.q).is_finite() && largest(&end.p).is_finite()) {
            return Err(StepError::NonFinite);
        }
        // A fixed point that contracts has proven enough, and a step of it is not to cost more.
        if let Some(evidence) = &driver.evidence
            && !M::FACTS.linear
        {
            let energy = (impulses.is_empty() && conserves_energy::<M, N>())
                .then(|| Energy::of(self.model, (t, h), [state, &end]))
                .flatten();
            evidence.check_with(self.control.solve, energy, scheme.element)?;
        }
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

    /// Sets the unknowns to where the iteration starts; true if that continues the last step.
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
        if !(largest(&state.q).is_finite() && largest(&state.p).is_finite()) {
            return Err(StepError::NonFinite);
        }
        let scheme = self.tables.view();
        let Some(last) = memory.last.filter(|last| last.end.is_same(state)) else {
            parts.momenta.fill(state.p);
            parts.unknowns.fill(0.0);
            return Ok(false);
        };
        let fraction = continued_ratio(h / last.h);
        if memory.ratio != Some(fraction) {
            set_extrapolation(&scheme, fraction, parts.extrapolation);
            memory.ratio = Some(fraction);
        }
        let unknowns = scheme.unknowns();
        let halves = if const { M::CONSTRAINTS.is_empty() } {
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
        Ok(true)
    }
}

/// Whether the equations are those of phase space, given an element that has them.
pub(crate) const fn may_be_phase<M, const N: usize>() -> bool
where
    M: Model<N>,
{
    matches!(M::FORM, Form::Hamiltonian) && M::CONSTRAINTS.is_empty()
}

/// ω_i(τ*) J for every row.
pub(crate) fn set_kicks<const N: usize>(
    scheme: &SchemeRef<'_>,
    interval: &Interval<'_, N>,
    kicks: &mut [[f64; N]],
) {
    kicks.fill([0.0; N]);
    for impulse in interval.impulses {
        let tau = interval.place(impulse);
        for (i, kick) in kicks.iter_mut().enumerate() {
            let weight = scheme.impulse_weight(i, tau);
            for a in 0..N {
                kick[a] += weight * impulse.value[a];
            }
        }
    }
}

/// The sum of impulses.
pub(crate) fn total<const N: usize>(impulses: &[Impulse<N>]) -> [f64; N] {
    let mut sum = [0.0; N];
    for impulse in impulses {
        for a in 0..N {
            sum[a] += impulse.value[a];
        }
    }
    sum
}

/// The ratio of steps by which the polynomial of the last element is continued: far outside of it that says nothing, and its end is; backwards it may be reused.
pub(crate) fn continued_ratio(ratio: f64) -> f64 {
    if (-1.5..=3.0).contains(&ratio) {
        ratio
    } else {
        0.0
    }
}

/// Old unknown rates to new ones: the polynomial of the last element, continued (T-65).
pub(crate) const fn set_extrapolation(scheme: &SchemeRef<'_>, ratio: f64, matrix: &mut [f64]) {
    let (unknowns, rates) = (scheme.unknown_nodes.len(), scheme.element.degree());
    let mut i = 0;
    while i < unknowns {
        let mut values = [0.0; MAX_NODES];
        legendre(1.0 + scheme.unknown_nodes[i] * ratio, &mut values);
        let mut j = 0;
        while j < unknowns {
            let (mut entry, mut degree) = (0.0, 0);
            while degree < rates {
                entry += values[degree] * scheme.rate[degree * unknowns + j];
                degree += 1;
            }
            matrix[i * unknowns + j] = entry;
            j += 1;
        }
        i += 1;
    }
}

/// Constant velocity; zero where the momentum belongs to none.
pub(crate) fn cold_velocity<M, const N: usize>(
    model: &M,
    t: f64,
    state: &State<N>,
    unknowns: &mut [f64],
) where
    M: Model<N>,
{
    let v = cold_rate(model, t, state);
    unknowns.as_chunks_mut::<N>().0.fill(v);
}

/// The velocity at the start; zero if there is none, which the iteration then finds out.
pub(crate) fn cold_rate<M, const N: usize>(model: &M, t: f64, state: &State<N>) -> [f64; N]
where
    M: Model<N>,
{
    velocity(model, t, &state.q, &state.p, &[0.0; N]).unwrap_or([0.0; N])
}

/// The rates at the start.
pub(crate) fn cold_phase<M, const N: usize>(
    model: &M,
    scheme: &SchemeRef<'_>,
    t: f64,
    state: &State<N>,
    unknowns: &mut [f64],
) where
    M: Model<N>,
{
    let (force, rate) = cold_rates(model, t, state);
    let (pi, kappa) = unknowns
        .as_chunks_mut::<N>()
        .0
        .split_at_mut(scheme.points());
    kappa.fill(rate);
    pi.fill(force);
}

/// ṗ and q̇ of a Hamiltonian at the start.
pub(crate) fn cold_rates<M, const N: usize>(
    model: &M,
    t: f64,
    state: &State<N>,
) -> ([f64; N], [f64; N])
where
    M: Model<N>,
{
    let mut first = First::ZERO;
    model.first(t, &state.q, &state.p, &mut first);
    for a in 0..N {
        first.force[a] -= first.q[a];
    }
    (first.force, first.z)
}

/// The end of an element and what rounding took from it (T-68).
pub(crate) fn end_of<const N: usize>(
    scheme: &SchemeRef<'_>,
    span: &Span<'_, N>,
    rates: &[[f64; N]],
    forces: &[[f64; N]],
    impulses: &[Impulse<N>],
) -> (State<N>, State<N>) {
    // To more than the working precision: weights and step are the same numbers in every step, and what their products lose is no chance.
    let h = DoubleDouble::new(span.h);
    let (mut end, mut low) = (State::ZERO, State::ZERO);
    for a in 0..N {
        let velocity = integral(scheme.advance, scheme.advance_low, rates, a);
        let force = integral(scheme.weights, scheme.weights_low, forces, a);
        let mut impulse = span.low.p[a];
        for one in impulses {
            impulse += one.value[a];
        }
        let moved = |start: f64, rate: DoubleDouble, low: f64| {
            let change = rate.times(h).plus(DoubleDouble::new(low));
            change.plus(DoubleDouble::new(start))
        };
        let q = moved(span.start.q[a], velocity, span.low.q[a]);
        let p = moved(span.start.p[a], force, impulse);
        (end.q[a], low.q[a]) = (q.high, q.low);
        (end.p[a], low.p[a]) = (p.high, p.low);
    }
    (end, low)
}

/// Σ (high + low) · row of one coordinate.
fn integral<const N: usize>(
    high: &[f64],
    low: &[f64],
    rows: &[[f64; N]],
    coordinate: usize,
) -> DoubleDouble {
    let mut sum = DoubleDouble::ZERO;
    for ((high, low), row) in high.iter().zip(low).zip(rows) {
        let weight = DoubleDouble {
            high: *high,
            low: *low,
        };
        sum = sum.plus(weight.times(DoubleDouble::new(row[coordinate])));
    }
    sum
}

/// a + b, rounded, and what rounding took.
#[cfg(feature = "alloc")]
pub(crate) fn sum(a: f64, b: f64) -> (f64, f64) {
    let high = a + b;
    let part = high - a;
    (high, (a - (high - part)) + (b - part))
}

/// Chooses between the iterations and between their starts.
struct Driver<'a> {
    control: &'a Control,
    origin: &'a mut [f64],
    warm: bool,
    known: bool,
    linear: bool,
    preference: &'a mut Preference,
    /// Whether the tangent holds factors that may serve the next step.
    has_factors: bool,
    /// What Newton's method has to say for its root.
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
            self.known,
            self.linear,
        );
        let proves =
            |evidence: &Evidence| self.linear || evidence.check(self.control.solve).is_ok();
        self.evidence = Some(match first {
            Ok(evidence) if !self.warm || proves(&evidence) => evidence,
            Err(error) if !self.warm => return Err(error),
            Ok(_) | Err(_) => {
                // The continued polynomial may be a worse start than none.
                cold(scratch.unknowns);
                newton(equations, self.control, &mut scratch, false, self.linear)?
            }
        });
        Ok(scratch)
    }
}
