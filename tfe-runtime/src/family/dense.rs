//! Dense output of models of run-time length: the solution between the nodes as the integral of the rates (T-69).

use super::model::FamilyState;
use crate::basis::{MAX_NODES, legendre, legendre_integrals};
#[cfg(feature = "std")]
use crate::dense::bounds::{LongArguments, Rows};
#[cfg(feature = "sparse")]
use crate::dense::{add_derivative, reach_ends};
use crate::dense::{length, piece_at};
#[cfg(feature = "std")]
use crate::dual::Dual;
#[cfg(feature = "std")]
use crate::enclosure::Enclosure;
#[cfg(feature = "std")]
use crate::model::Form;
use crate::scheme::SchemeRef;
use alloc::vec;
use alloc::vec::Vec;

/// One element of a motion of a family, to be evaluated anywhere inside.
///
/// Coordinates and momenta are polynomials that begin and end at the states of the nodes. They take 2 s n numbers for s
/// stages and n coordinates.
#[derive(Clone, Debug, PartialEq)]
pub struct DenseElement {
    times: (f64, f64),
    /// The length of the step: far from t = 0 it has more correct digits than the difference of the times.
    length: f64,
    start: FamilyState,
    end: FamilyState,
    /// Legendre coefficients of h dq/dt, a row of n each.
    rates: Vec<f64>,
    momenta: Momenta,
    /// The pieces of an element that was cut; empty otherwise.
    pieces: Vec<Self>,
}

/// Legendre coefficients, a row of n each.
#[derive(Clone, Debug, PartialEq)]
enum Momenta {
    /// Of h dp/dt.
    Rates(Vec<f64>),
    /// Of p itself.
    #[cfg(feature = "sparse")]
    Values(Vec<f64>),
}

impl DenseElement {
    /// An element with a constant state.
    pub(super) fn constant(times: (f64, f64), state: FamilyState) -> Self {
        Self {
            times,
            length: times.1 - times.0,
            start: state.clone(),
            end: state,
            rates: Vec::new(),
            momenta: Momenta::Rates(Vec::new()),
            pieces: Vec::new(),
        }
    }

    /// An element that was cut (T-116), from time `start` to time `end`, made of its pieces.
    pub(super) fn of_pieces((start, end): (f64, f64), mut pieces: Vec<Self>) -> Option<Self> {
        pieces.first_mut()?.times.0 = start;
        pieces.last_mut()?.times.1 = end;
        let before = pieces.first()?.start.clone();
        let after = pieces.last()?.end.clone();
        Some(Self {
            times: (start, end),
            length: end - start,
            start: before,
            end: after,
            rates: Vec::new(),
            momenta: Momenta::Rates(Vec::new()),
            pieces,
        })
    }

    /// An element from the rates of coordinates at the unknown nodes and of momenta at the points, given as functions
    /// of unknown (or point) and coordinate.
    pub(super) fn of(
        scheme: &SchemeRef<'_>,
        times: (f64, f64),
        h: f64,
        (start, end): (FamilyState, FamilyState),
        rate: &dyn Fn(usize, usize) -> f64,
        force: &dyn Fn(usize, usize) -> f64,
    ) -> Self {
        let n = start.q.len();
        let force_rates = coefficients(scheme.force_rate, scheme.points(), (h, n), force);
        Self {
            times,
            length: length(times, h),
            start,
            end,
            rates: coefficients(scheme.rate, scheme.unknowns(), (h, n), rate),
            momenta: Momenta::Rates(force_rates),
            pieces: Vec::new(),
        }
    }

    /// An element from rates and momenta at the points of a collocated element whose momenta jump at its ends (T-79).
    #[cfg(feature = "sparse")]
    pub(super) fn with_jumps(
        scheme: &SchemeRef<'_>,
        times: (f64, f64),
        h: f64,
        (start, end): (FamilyState, FamilyState),
        rate: &dyn Fn(usize, usize) -> f64,
        momentum: &dyn Fn(usize, usize) -> f64,
    ) -> Self {
        let n = start.q.len();
        let mut values = coefficients(scheme.rate, scheme.unknowns(), (1.0, n), momentum);
        values.resize(values.len() + n, 0.0);
        reach_ends(&mut values, (&start.p[..], &end.p[..]));
        Self {
            times,
            length: length(times, h),
            start,
            end,
            rates: coefficients(scheme.rate, scheme.unknowns(), (h, n), rate),
            momenta: Momenta::Values(values),
            pieces: Vec::new(),
        }
    }

    /// The Legendre coefficients of dq/dτ, a row of n each, followed by those of dp/dτ; empty for an element that was
    /// [cut](crate::Statistics::cuts).
    #[must_use]
    pub fn coefficients(&self) -> Vec<f64> {
        match &self.momenta {
            Momenta::Rates(rates) => [&self.rates[..], rates].concat(),
            #[cfg(feature = "sparse")]
            Momenta::Values(values) => {
                let rates = rates_of(values, self.start.q.len());
                [&self.rates[..], &rates].concat()
            }
        }
    }

    /// The pieces of the element: the element itself, unless the step was [cut](crate::Statistics::cuts).
    #[must_use]
    pub fn pieces(&self) -> &[Self] {
        if self.pieces.is_empty() {
            core::slice::from_ref(self)
        } else {
            &self.pieces
        }
    }

    /// The degree of the coordinates: the number of points at which a collocation element satisfies the equations of
    /// motion.
    #[must_use]
    pub fn degree(&self) -> usize {
        let piece = &self.pieces()[0];
        piece.rates.len() / piece.start.q.len().max(1)
    }

    /// Bounds of the arguments of outputs of a `form`, along the whole of an element of one [piece](Self::pieces), as
    /// [`DenseElement::bounds`](crate::step::DenseElement::bounds).
    #[must_use]
    #[cfg(feature = "std")]
    pub fn bounds(&self, form: Form) -> LongArguments<Enclosure> {
        self.rows().bounds(form)
    }

    /// Bounds of the arguments of outputs, and of their derivatives by τ, over a part from τ to τ of an element of one
    /// [piece](Self::pieces).
    #[must_use]
    #[cfg(feature = "std")]
    pub fn bounds_over(&self, form: Form, part: (f64, f64)) -> LongArguments<Dual<Enclosure>> {
        let centre = self.at(0.5 * (part.0 + part.1));
        self.rows().bounds_over(form, part, [&centre.q, &centre.p])
    }

    #[cfg(feature = "std")]
    fn rows(&self) -> Rows<'_> {
        let forces = match &self.momenta {
            Momenta::Rates(rates) => &rates[..],
            // Only for Lagrangians, whose outputs do not depend on momenta.
            #[cfg(feature = "sparse")]
            Momenta::Values(_) => &[],
        };
        Rows {
            times: self.times,
            length: self.length,
            rates: &self.rates,
            forces,
            start: [&self.start.q, &self.start.p],
            end: [&self.end.q, &self.end.p],
        }
    }

    /// Time at the start.
    #[must_use]
    pub fn start(&self) -> f64 {
        self.times.0
    }

    /// Time at the end.
    #[must_use]
    pub fn end(&self) -> f64 {
        self.times.1
    }

    /// The length of the element, as [`DenseElement::length`](crate::step::DenseElement::length).
    #[must_use]
    pub fn length(&self) -> f64 {
        self.length
    }

    /// The state at a time between start and end.
    #[must_use]
    pub fn at_time(&self, time: f64) -> FamilyState {
        if time == self.times.1 {
            return self.end.clone();
        }
        if let Some(piece) = self.piece_at(time) {
            return piece.at_time(time);
        }
        self.at((time - self.times.0) / (self.times.1 - self.times.0))
    }

    /// The state at τ ∈ [0, 1]: exactly that of the nodes at both ends.
    #[must_use]
    pub fn at(&self, tau: f64) -> FamilyState {
        if tau == 1.0 {
            return self.end.clone();
        }
        if !self.pieces.is_empty() {
            return self.at_time(self.times.0 + tau * (self.times.1 - self.times.0));
        }
        let mut integrals = [0.0; MAX_NODES];
        legendre_integrals(tau, &mut integrals);
        let mut state = self.start.clone();
        add(&self.rates, &integrals, &mut state.q);
        match &self.momenta {
            Momenta::Rates(rates) => add(rates, &integrals, &mut state.p),
            #[cfg(feature = "sparse")]
            Momenta::Values(values) => {
                let mut polynomials = [0.0; MAX_NODES];
                legendre(tau, &mut polynomials);
                state.p.fill(0.0);
                add(values, &polynomials, &mut state.p);
            }
        }
        state
    }

    /// Coordinates and velocities at a place τ of an element of length h that was not cut.
    #[cfg(feature = "sparse")]
    pub(super) fn motion_at(&self, tau: f64, h: f64) -> (Vec<f64>, Vec<f64>) {
        let (mut values, mut integrals) = ([0.0; MAX_NODES], [0.0; MAX_NODES]);
        legendre(tau, &mut values);
        legendre_integrals(tau, &mut integrals);
        let (mut q, mut v) = (self.start.q.clone(), vec![0.0; self.start.q.len()]);
        add(&self.rates, &integrals, &mut q);
        add(&self.rates, &values, &mut v);
        for rate in &mut v {
            *rate /= h;
        }
        (q, v)
    }

    /// dq/dt at a time between start and end: the derivative of the polynomial.
    #[must_use]
    pub fn velocity_at_time(&self, time: f64) -> Vec<f64> {
        if let Some(piece) = self.piece_at(time) {
            return piece.velocity_at_time(time);
        }
        let mut values = [0.0; MAX_NODES];
        let tau = (time - self.times.0) / (self.times.1 - self.times.0);
        legendre(tau, &mut values);
        let mut velocity = vec![0.0; self.start.q.len()];
        add(&self.rates, &values, &mut velocity);
        for rate in &mut velocity {
            *rate /= self.length;
        }
        velocity
    }

    /// The piece of an element that was cut that contains this time.
    fn piece_at(&self, time: f64) -> Option<&Self> {
        piece_at(&self.pieces, |piece| piece.times.0, self.times, time)
    }
}

/// factor · Σ_l matrix_ml value(l, a): a row of n for each row of the matrix.
fn coefficients(
    matrix: &[f64],
    columns: usize,
    (factor, n): (f64, usize),
    value: &dyn Fn(usize, usize) -> f64,
) -> Vec<f64> {
    let mut rows = vec![0.0; matrix.len() / columns * n];
    for (row, weights) in rows.chunks_exact_mut(n).zip(matrix.chunks_exact(columns)) {
        for (l, weight) in weights.iter().enumerate() {
            for (a, entry) in row.iter_mut().enumerate() {
                *entry += factor * weight * value(l, a);
            }
        }
    }
    rows
}

/// The matrix from momenta at the points, at the start and at the end to the Legendre coefficients of dp/dτ of the
/// polynomial through them, where momenta jump at the ends (T-79): a row of points + 2 for each coefficient.
#[cfg(feature = "sparse")]
pub(super) fn jumps(scheme: &SchemeRef<'_>) -> Vec<f64> {
    let (points, s) = (scheme.points(), scheme.rates());
    let mut weights = vec![0.0; s * (points + 2)];
    for column in 0..points + 2 {
        let unit = |place: usize| if place == column { 1.0 } else { 0.0 };
        let state = |p: f64| FamilyState {
            q: vec![0.0],
            p: vec![p],
        };
        let ends = (state(unit(points)), state(unit(points + 1)));
        let momentum = |point: usize, _: usize| unit(point);
        let polynomial =
            DenseElement::with_jumps(scheme, (0.0, 1.0), 1.0, ends, &|_, _| 0.0, &momentum);
        let Momenta::Values(values) = polynomial.momenta else {
            return weights;
        };
        for (k, rate) in rates_of(&values, 1).into_iter().enumerate() {
            weights[k * (points + 2) + column] = rate;
        }
    }
    weights
}

/// The Legendre coefficients of the derivative by τ of a polynomial, from its own; a row of n for each.
#[cfg(feature = "sparse")]
fn rates_of(values: &[f64], n: usize) -> Vec<f64> {
    let mut rates = vec![0.0; values.len().saturating_sub(n)];
    add_derivative(values, n, &mut rates);
    rates
}

/// Adds Σ_m weights_m rows_m.
fn add(rows: &[f64], weights: &[f64], sum: &mut [f64]) {
    for (row, weight) in rows.chunks_exact(sum.len().max(1)).zip(weights) {
        for (value, entry) in sum.iter_mut().zip(row) {
            *value += weight * entry;
        }
    }
}
