//! The parts of a step: intervals with impulses, the memory carried from step to step, the model with the tables of its
//! element, initial guesses of the iteration, and the end of an element.

use crate::basis::{MAX_NODES, legendre};
use crate::constrained::rows::Independence;
use crate::control::Control;
use crate::double_double::DoubleDouble;
use crate::equations::Span;
use crate::legendre::{largest, velocity};
use crate::lu::Block;
use crate::model::{First, Form, Model, State};
use crate::newton::Preference;
use crate::quadrature::MAX_POINTS;
use crate::scheme::SchemeRef;
use crate::statistics::Statistics;

/// An impulse: a generalized force of given time integral that acts at one instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Impulse<const N: usize> {
    /// The time at which it acts; a time outside the element is moved to its nearer end.
    pub time: f64,
    /// ∫ Q dt, one entry for each coordinate.
    pub value: [f64; N],
}

impl<const N: usize> Impulse<N> {
    /// What it adds to the momenta in an element of length `h`; backwards in time, h < 0, it is subtracted.
    pub(crate) fn along(&self, h: f64) -> [f64; N] {
        self.value.map(|value| h.signum() * value)
    }
}

/// The position of an element in time, and the impulses that act in it.
#[derive(Clone, Copy, Debug)]
pub struct Interval<'a, const N: usize> {
    /// Time at the start.
    pub start: f64,
    /// Length h; negative to go backwards in time.
    pub length: f64,
    /// The impulses inside, each weighted by the test functions (T-49); subtracted where the element goes backwards in
    /// time.
    pub impulses: &'a [Impulse<N>],
}

impl<const N: usize> Interval<'_, N> {
    /// The place τ ∈ [0, 1] in the element at which an impulse acts.
    pub(crate) fn place(&self, impulse: &Impulse<N>) -> f64 {
        ((impulse.time - self.start) / self.length).clamp(0.0, 1.0)
    }

    /// The same, but exactly 0 or 1 if the impulse differs from a node only by rounding of the times.
    #[cfg(feature = "alloc")]
    pub(crate) fn node_or_place(&self, impulse: &Impulse<N>) -> f64 {
        let (end, tau) = (self.start + self.length, self.place(impulse));
        let rounding = rounding_of_times((self.start, end), self.length) / self.length.abs();
        let rounding = rounding.min(0.25);
        if tau <= rounding {
            0.0
        } else if 1.0 - tau <= rounding {
            1.0
        } else {
            tau
        }
    }
}

/// The bound of the rounding errors of the times of an element. Steps may begin and end a few rounding errors before
/// breakpoints.
#[cfg(feature = "alloc")]
pub(crate) fn rounding_of_times((start, end): (f64, f64), h: f64) -> f64 {
    16.0 * f64::EPSILON * start.abs().max(end.abs()).max(h.abs())
}

/// What is carried from step to step in addition to the [`Workspace`](crate::workspace::Workspace).
#[derive(Clone, Debug)]
pub struct Memory<const N: usize> {
    pub(crate) statistics: Statistics,
    /// Start and end of the last step; `None` before the first and after a failure.
    pub(crate) last: Option<Last<N>>,
    /// The rounding error of the end of the last step (compensated summation).
    pub(crate) low: State<N>,
    pub(crate) mass: Option<Block<N>>,
    /// The length of the step whose LU factors the workspace holds.
    pub(crate) factored: Option<f64>,
    /// The ratio of step lengths for which the workspace holds the extrapolation matrix.
    pub(crate) ratio: Option<f64>,
    /// The iteration with which a nonlinear step begins.
    pub(crate) preference: Preference,
    /// The independence of the rows of constraints at the start and at the end of the last step.
    pub(crate) independence: Option<[Independence; 2]>,
    /// Whether the workspace already holds the initial guess of the next step, in addition to the velocity at the end
    /// of the last one.
    pub(crate) is_foreseen: bool,
    /// Whether the state lies shortly behind a kink of constraints, where its velocity may be one that they only allowed
    /// before.
    pub(crate) is_behind_kink: bool,
}

/// The last step.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Last<const N: usize> {
    pub(crate) t: f64,
    pub(crate) h: f64,
    /// The start and its rounding error, which emitted solvers do not keep.
    pub(crate) start: State<N>,
    pub(crate) start_low: State<N>,
    pub(crate) end: State<N>,
}

impl<const N: usize> Last<N> {
    /// A placeholder, to be filled.
    pub(crate) const NONE: Self = Self {
        t: 0.0,
        h: 0.0,
        start: State::ZERO,
        start_low: State::ZERO,
        end: State::ZERO,
    };
}

impl<const N: usize> State<N> {
    pub(crate) const ZERO: Self = Self {
        q: [0.0; N],
        p: [0.0; N],
    };

    /// Whether all numbers are equal, without a branch for each of them.
    pub(crate) fn is_same(&self, other: &Self) -> bool {
        let mut same = true;
        for a in 0..N {
            same &= (self.q[a] == other.q[a]) & (self.p[a] == other.p[a]);
        }
        same
    }

    /// Whether all numbers are finite.
    #[inline(always)]
    pub(crate) fn is_finite(&self) -> bool {
        largest(&self.q).is_finite() && largest(&self.p).is_finite()
    }
}

impl<const N: usize> Memory<N> {
    /// Memory before the first step.
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
            is_foreseen: false,
            is_behind_kink: false,
        }
    }

    /// The cost of all steps so far.
    #[must_use]
    pub const fn statistics(&self) -> &Statistics {
        &self.statistics
    }

    /// Whether the last step ended at `state`.
    pub(crate) fn has_reached(&self, state: &State<N>) -> bool {
        self.last.is_some_and(|last| last.end.is_same(state))
    }

    /// Declares that the workspace no longer holds LU factors.
    pub(crate) fn forget_factors(&mut self) {
        self.factored = None;
    }

    /// Declares that the workspace has been replaced, so that its factors and extrapolation matrix are unknown.
    #[cfg(feature = "alloc")]
    pub(crate) fn forget_workspace(&mut self) {
        (self.factored, self.ratio) = (None, None);
    }
}

impl<const N: usize> Default for Memory<N> {
    fn default() -> Self {
        Self::new()
    }
}

/// A model with the tables of an element: everything about a step that does not change.
///
/// This is for stepping without allocation: [`Memory`] and [`Workspace`](crate::workspace::Workspace) belong to the
/// caller, whereas a `Stepper` owns them.
#[derive(Debug)]
pub struct Method<'a, M, T> {
    /// The model.
    pub model: &'a M,
    /// The tables of the element.
    pub tables: &'a T,
    /// How its equations are solved.
    pub control: Control,
}

// Not derived: model and tables are borrowed and need not be `Clone`.
impl<M, T> Clone for Method<'_, M, T> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<M, T> Copy for Method<'_, M, T> {}

/// Whether the equations are those of phase space, for elements that have a phase-space form.
pub(crate) const fn may_be_phase<M, const N: usize>() -> bool
where
    M: Model<N>,
{
    matches!(M::FORM, Form::Hamiltonian) && M::CONSTRAINTS.is_empty()
}

/// Writes ω_i(τ*) J for every row; −ω_i(τ*) J backwards in time.
pub(crate) fn set_kicks<const N: usize>(
    scheme: &SchemeRef<'_>,
    interval: &Interval<'_, N>,
    kicks: &mut [[f64; N]],
) {
    kicks.fill([0.0; N]);
    for impulse in interval.impulses {
        let (tau, value) = (interval.place(impulse), impulse.along(interval.length));
        for (i, kick) in kicks.iter_mut().enumerate() {
            let weight = scheme.impulse_weight(i, tau);
            for a in 0..N {
                kick[a] += weight * value[a];
            }
        }
    }
}

/// What the impulses in an element of length `h` add to the momenta.
pub(crate) fn total<const N: usize>(impulses: &[Impulse<N>], h: f64) -> [f64; N] {
    let mut sum = [0.0; N];
    for impulse in impulses {
        let value = impulse.along(h);
        for a in 0..N {
            sum[a] += value[a];
        }
    }
    sum
}

/// The ratio of step lengths by which the polynomial of the last element is extrapolated. Far outside its element the
/// polynomial is useless, and its end value is used; backwards in time it may be reused.
pub(crate) fn continued_ratio(ratio: f64) -> f64 {
    if (-1.5..=3.0).contains(&ratio) {
        ratio
    } else {
        0.0
    }
}

/// The matrix from the old unknown rates to the new ones: extrapolation of the polynomial of the last element (T-65).
pub(crate) const fn set_extrapolation(scheme: &SchemeRef<'_>, ratio: f64, matrix: &mut [f64]) {
    let degrees = scheme.element.degree();
    extrapolate(scheme.unknown_nodes, (scheme.rate, degrees), ratio, matrix);
}

/// The same for values at the points. Where there are more than s points, the polynomial of the forces has one degree
/// more than that of the rates of the coordinates.
pub(crate) const fn set_extrapolation_at_points(
    scheme: &SchemeRef<'_>,
    ratio: f64,
    matrix: &mut [f64],
) {
    let (points, degrees) = (scheme.nodes.len(), scheme.element.degree());
    extrapolate(scheme.nodes, (scheme.force_rate, degrees), ratio, matrix);
    if points == degrees {
        return;
    }
    let (mut values, mut norm, mut l) = ([0.0; MAX_POINTS], 0.0, 0);
    while l < points {
        let value = legendre_of(degrees, scheme.nodes[l]);
        values[l] = scheme.weights[l] * value;
        norm += values[l] * value;
        l += 1;
    }
    let mut i = 0;
    while i < points {
        let ahead = legendre_of(degrees, 1.0 + scheme.nodes[i] * ratio) / norm;
        let mut j = 0;
        while j < points {
            matrix[i * points + j] += ahead * values[j];
            j += 1;
        }
        i += 1;
    }
}

/// P_degree(τ) on the unit interval.
const fn legendre_of(degree: usize, tau: f64) -> f64 {
    let mut values = [0.0; MAX_NODES];
    legendre(tau, &mut values);
    values[degree]
}

/// The matrix from values at the places of one element to those at the places of the next, by way of the given number
/// of Legendre coefficients.
const fn extrapolate(
    places: &[f64],
    (coefficients, degrees): (&[f64], usize),
    ratio: f64,
    matrix: &mut [f64],
) {
    let count = places.len();
    let mut i = 0;
    while i < count {
        let mut values = [0.0; MAX_NODES];
        legendre(1.0 + places[i] * ratio, &mut values);
        let mut j = 0;
        while j < count {
            let (mut entry, mut degree) = (0.0, 0);
            while degree < degrees {
                entry += values[degree] * coefficients[degree * count + j];
                degree += 1;
            }
            matrix[i * count + j] = entry;
            j += 1;
        }
        i += 1;
    }
}

/// A constant velocity as initial guess; zero where no velocity belongs to the momentum.
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

/// The velocity at the start; zero if there is none, which the iteration then reports.
pub(crate) fn cold_rate<M, const N: usize>(model: &M, t: f64, state: &State<N>) -> [f64; N]
where
    M: Model<N>,
{
    velocity(model, t, &state.q, &state.p, &[0.0; N]).unwrap_or([0.0; N])
}

/// The rates of phase space at the start, as initial guess.
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

/// The end of an element, and its rounding error (T-68).
pub(crate) fn end_of<const N: usize>(
    scheme: &SchemeRef<'_>,
    span: &Span<'_, N>,
    rates: &[[f64; N]],
    forces: &[[f64; N]],
    impulses: &[Impulse<N>],
) -> (State<N>, State<N>) {
    // In more than working precision: weights and step are the same numbers in every step, so that the rounding errors
    // of their products are systematic.
    let h = DoubleDouble::new(span.h);
    let (mut end, mut low) = (State::ZERO, State::ZERO);
    for a in 0..N {
        let velocity = integral(scheme.advance, scheme.advance_low, rates, a);
        let force = integral(scheme.weights, scheme.weights_low, forces, a);
        let mut impulse = span.low.p[a];
        for one in impulses {
            impulse += one.along(span.h)[a];
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
#[cfg_attr(not(feature = "alloc"), inline(never))] // small programs
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
