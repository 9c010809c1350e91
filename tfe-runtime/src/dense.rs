//! Dense output: the solution between the nodes as the integral of the rates (T-69).

#[cfg(feature = "std")]
pub(crate) mod bounds;

use alloc::boxed::Box;
use alloc::vec;
use alloc::vec::Vec;

use crate::basis::{MAX_NODES, legendre, legendre_integrals};
use crate::condense::add_multiple;
use crate::method::{Interval, Last, rounding_of_times};
use crate::model::State;
use crate::quadrature::Quadrature;
use crate::scheme::{MAX_RATES, SchemeRef};

/// One element of a motion, to be evaluated anywhere inside.
///
/// Coordinates and momenta are polynomials of degree n − 1 that begin and end at the states of the nodes, so that the
/// curve is continuous; between nodes their error is of order hⁿ. Where impulses act at a node, the momenta jump there:
/// the polynomials begin after the impulses at the start and end before those at the end.
#[derive(Clone, Debug, PartialEq)]
pub struct DenseElement<const N: usize> {
    times: (f64, f64),
    /// The length of the step: far from t = 0 it has more correct digits than the difference of the times.
    length: f64,
    /// The state at the start, after the impulses that act there.
    start: State<N>,
    end: State<N>,
    /// Whether impulses act at the end; the polynomials end before them.
    jumps: bool,
    /// The Legendre coefficients of h dq/dt, then those of h dp/dt.
    rates: Box<[[f64; N]]>,
    /// The pieces of an element that was cut; empty otherwise.
    pieces: Box<[Self]>,
}

impl<const N: usize> DenseElement<N> {
    /// An element with a constant state.
    pub(crate) fn constant(start: f64, end: f64, state: State<N>) -> Self {
        Self {
            times: (start, end),
            length: end - start,
            start: state,
            end: state,
            jumps: false,
            rates: Box::new([]),
            pieces: Box::new([]),
        }
    }

    /// An element of which only the ends are known; NaN between them.
    pub(crate) fn unknown(scheme: &SchemeRef<'_>, times: (f64, f64), last: &Last<N>) -> Self {
        Self {
            times,
            length: length(times, last.h),
            start: last.start,
            end: last.end,
            jumps: false,
            rates: vec![[f64::NAN; N]; 2 * scheme.rates()].into_boxed_slice(),
            pieces: Box::new([]),
        }
    }

    /// An element that was cut (T-116), from time `start` to time `end`, made of its pieces.
    pub(crate) fn of_pieces((start, end): (f64, f64), mut pieces: Vec<Self>) -> Option<Self> {
        let last = pieces.last_mut()?;
        // The nodes of a run are exactly those of its mesh.
        last.times.1 = end;
        let after = last.end;
        let before = pieces[0].start;
        pieces[0].times.0 = start;
        Some(Self {
            times: (start, end),
            length: end - start,
            start: before,
            end: after,
            jumps: false,
            rates: Box::new([]),
            pieces: pieces.into_boxed_slice(),
        })
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

    pub(crate) fn of(
        scheme: &SchemeRef<'_>,
        times: (f64, f64),
        last: &Last<N>,
        rates: &[[f64; N]],
        forces: &[[f64; N]],
        interval: &Interval<'_, N>,
        spare: Option<Self>,
    ) -> Self {
        let count = scheme.rates();
        let room = spare.map(|spare| spare.rates);
        let mut coefficients = match room.filter(|room| room.len() == 2 * count) {
            Some(mut room) => {
                room.fill([0.0; N]);
                room
            }
            None => vec![[0.0; N]; 2 * count].into_boxed_slice(),
        };
        let (q, p) = coefficients.split_at_mut(count);
        project(scheme.rate, rates, last.h, q);
        project(scheme.force_rate, forces, last.h, p);
        let (mut start, mut jumps) = (last.start, false);
        for impulse in interval.impulses {
            let tau = interval.node_or_place(impulse);
            let impulse = impulse.along(interval.length);
            if tau == 0.0 {
                for a in 0..N {
                    start.p[a] += impulse[a];
                }
                continue;
            }
            if tau == 1.0 {
                jumps = true;
                continue;
            }
            // One inside is a rate too; its projection has the same integral.
            let mut values = [0.0; MAX_RATES];
            legendre(tau, &mut values);
            for (m, row) in p.iter_mut().enumerate() {
                let weight = (2 * m + 1) as f64 * values[m];
                for a in 0..N {
                    row[a] += weight * impulse[a];
                }
            }
        }
        Self {
            times,
            length: length(times, last.h),
            start,
            end: last.end,
            jumps,
            rates: coefficients,
            pieces: Box::new([]),
        }
    }

    /// The polynomials of an element with constraints. Momenta jump at its nodes, so their polynomial is made from the
    /// momenta at the points; the differences at the ends are distributed by ½(P_s ± P_{s−1}), which vanish (nearly) at
    /// the points (T-79).
    pub(crate) fn constrained(
        scheme: &SchemeRef<'_>,
        times: (f64, f64),
        h: f64,
        (start, end): (&State<N>, &State<N>),
        rates: &[[f64; N]],
        momenta: &[[f64; N]],
    ) -> Self {
        let count = scheme.rates();
        let mut coefficients = vec![[0.0; N]; 2 * count].into_boxed_slice();
        let (q, p) = coefficients.split_at_mut(count);
        project(scheme.rate, rates, h, q);
        let ends = (start.p.as_slice(), end.p.as_slice());
        add_momentum_rates(scheme, ends, momenta.as_flattened(), p.as_flattened_mut());
        Self {
            times,
            length: length(times, h),
            start: *start,
            end: *end,
            jumps: false,
            rates: coefficients,
            pieces: Box::new([]),
        }
    }

    /// The same element, with impulses at its end that lead to the given state.
    pub(crate) fn ending_in(self, end: State<N>) -> Self {
        Self {
            jumps: self.end != end,
            end,
            ..self
        }
    }

    /// The Legendre coefficients of dq/dτ, then those of dp/dτ; empty for an element that was cut, whose
    /// [pieces](Self::pieces) have them.
    #[must_use]
    pub fn coefficients(&self) -> &[[f64; N]] {
        &self.rates
    }

    /// The parts before and after a time inside the element.
    pub(crate) fn split(&self, time: f64) -> (Self, Self) {
        let tau = (time - self.times.0) / (self.times.1 - self.times.0);
        let node = self.at(tau);
        let before = self.part((0.0, tau), (self.times.0, time), (self.start, node));
        let after = self.part((tau, 1.0), (time, self.times.1), (node, self.end));
        (before, after)
    }

    /// The part of the polynomials between two places, with coefficients of its own.
    fn part(
        &self,
        (from, to): (f64, f64),
        times: (f64, f64),
        (start, end): (State<N>, State<N>),
    ) -> Self {
        let (count, part) = (self.degree(), to - from);
        let mut rates = vec![[0.0; N]; 2 * count].into_boxed_slice();
        for half in [0..count, count..2 * count] {
            let old = self.rates[half.clone()].as_flattened();
            add_part(N, old, (from, to), rates[half].as_flattened_mut());
        }
        Self {
            times,
            length: part * self.length,
            start,
            end,
            jumps: self.jumps && to == 1.0,
            rates,
            pieces: Box::new([]),
        }
    }

    /// The degree of the polynomials: the number of points at which a collocation element satisfies the equations of
    /// motion.
    #[must_use]
    pub fn degree(&self) -> usize {
        self.pieces()[0].rates.len() / 2
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

    /// The length of the element: the difference of both times or, where that has lost digits far from t = 0, the step.
    #[must_use]
    pub fn length(&self) -> f64 {
        self.length
    }

    /// The state at τ ∈ [0, 1]. At both ends it is exactly that of the node, with the impulses that act there.
    #[must_use]
    pub fn at(&self, tau: f64) -> State<N> {
        if tau == 1.0 {
            return self.end;
        }
        if !self.pieces.is_empty() {
            return self.at_time(self.times.0 + tau * (self.times.1 - self.times.0));
        }
        let mut integrals = [0.0; MAX_NODES];
        legendre_integrals(tau, &mut integrals);
        let mut state = self.start;
        let (q, p) = self.rates.split_at(self.rates.len() / 2);
        for (m, (rate, force)) in q.iter().zip(p).enumerate() {
            for a in 0..N {
                state.q[a] += integrals[m] * rate[a];
                state.p[a] += integrals[m] * force[a];
            }
        }
        state
    }

    /// dq/dt at a time between start and end: the derivative of the polynomial.
    #[must_use]
    pub fn velocity_at_time(&self, time: f64) -> [f64; N] {
        if let Some(piece) = self.piece_at(time) {
            return piece.velocity_at_time(time);
        }
        let mut values = [0.0; MAX_NODES];
        let tau = (time - self.times.0) / (self.times.1 - self.times.0);
        legendre(tau, &mut values);
        let mut velocity = [0.0; N];
        for (rate, value) in self.rates[..self.rates.len() / 2].iter().zip(values) {
            for a in 0..N {
                velocity[a] += value / self.length * rate[a];
            }
        }
        velocity
    }

    /// The state at a time between start and end.
    #[must_use]
    pub fn at_time(&self, time: f64) -> State<N> {
        if time == self.times.1 {
            return self.end;
        }
        match self.piece_at(time) {
            Some(piece) => piece.at_time(time),
            None => self.at((time - self.times.0) / (self.times.1 - self.times.0)),
        }
    }

    /// The piece of an element that was cut that contains this time.
    fn piece_at(&self, time: f64) -> Option<&Self> {
        piece_at(&self.pieces, |piece| piece.times.0, self.times, time)
    }
}

/// The length of an element between two times that was made by the step `h`. It is the step if the difference of the
/// times agrees with it up to rounding, which is a large part of a short step far from t = 0.
pub(crate) fn length((start, end): (f64, f64), h: f64) -> f64 {
    let between = end - start;
    if (between - h).abs() <= rounding_of_times((start, end), h) {
        h
    } else {
        between
    }
}

/// The piece that contains a time, of an element between two times that was cut; `start` gives the time at which a
/// piece begins.
pub(crate) fn piece_at<P>(
    pieces: &[P],
    start: impl Fn(&P) -> f64,
    (from, to): (f64, f64),
    time: f64,
) -> Option<&P> {
    let begun = |piece: &P| (start(piece) <= time) == (to >= from) || start(piece) == time;
    let after = pieces.partition_point(begun).checked_sub(1)?;
    pieces.get(after)
}

/// Adds the Legendre coefficients of dp/dτ for an element with constraints, from the momenta at its ends and at its
/// points. Compiled once, for any number of coordinates.
fn add_momentum_rates(
    scheme: &SchemeRef<'_>,
    (start, end): (&[f64], &[f64]),
    momenta: &[f64],
    rates: &mut [f64],
) {
    let (count, n) = (scheme.rates(), start.len());
    let width = n.max(1);
    // The Legendre coefficients of the momentum: the polynomial of degree s − 1 through the points, or the best
    // approximation.
    let mut values = vec![0.0; (count + 1) * n];
    let momenta = momenta.chunks_exact(width);
    for ((node, weight), momentum) in scheme.nodes.iter().zip(scheme.weights).zip(momenta) {
        let mut legendre_values = [0.0; MAX_NODES];
        legendre(*node, &mut legendre_values);
        for (m, value) in values.chunks_exact_mut(width).enumerate().take(count) {
            let factor = (2 * m + 1) as f64 * weight * legendre_values[m];
            add_multiple(value, factor, momentum);
        }
    }
    reach_ends(&mut values, (start, end));
    add_derivative(&values, n, rates);
}

/// Makes a polynomial of degree s − 1 one of degree s that has the given values at both ends, by multiples of
/// ½ (P_s ± P_{s−1}) (T-79). `values` are its Legendre coefficients, a row for each; the last one, of P_s, is zero
/// before.
pub(crate) fn reach_ends(values: &mut [f64], (start, end): (&[f64], &[f64])) {
    let n = start.len();
    let width = n.max(1);
    let s = (values.len() / width).saturating_sub(1);
    for a in 0..n {
        let (mut at_start, mut at_end, mut sign) = (start[a], end[a], 1.0);
        for value in values[..s * n].chunks_exact(width) {
            at_start -= sign * value[a];
            at_end -= value[a];
            sign = -sign;
        }
        // P_s(0) = sign, P_{s−1}(0) = −sign.
        values[s * n + a] += 0.5 * (at_end + sign * at_start);
        values[(s - 1) * n + a] += 0.5 * (at_end - sign * at_start);
    }
}

/// Adds the Legendre coefficients of the derivative by τ of a polynomial, from its own; a row of n for each:
///
/// ```text
/// dP_l/dτ = Σ 2 (2k + 1) P_k over k = l − 1, l − 3, …
/// ```
pub(crate) fn add_derivative(values: &[f64], n: usize, rates: &mut [f64]) {
    for (l, value) in values.chunks_exact(n.max(1)).enumerate() {
        for k in (0..l).rev().step_by(2) {
            let factor = 2.0 * (2 * k + 1) as f64;
            add_multiple(&mut rates[k * n..(k + 1) * n], factor, value);
        }
    }
}

/// Adds the Legendre coefficients of the rates in a part of an element, from those in the whole, of n components each.
fn add_part(n: usize, coefficients: &[f64], (from, to): (f64, f64), of_part: &mut [f64]) {
    let width = n.max(1);
    let (count, part) = (coefficients.len() / width, to - from);
    let rule = Quadrature::gauss(count.max(1));
    let mut value = vec![0.0; n];
    for point in 0..rule.len() {
        let (mut here, mut whole) = ([0.0; MAX_NODES], [0.0; MAX_NODES]);
        legendre(rule.node(point), &mut here);
        legendre(from + part * rule.node(point), &mut whole);
        value.fill(0.0);
        for (row, weight) in coefficients.chunks_exact(width).zip(whole) {
            add_multiple(&mut value, part * weight, row);
        }
        for (m, row) in of_part.chunks_exact_mut(width).enumerate() {
            let weight = (2 * m + 1) as f64 * rule.weight(point) * here[m];
            add_multiple(row, weight, &value);
        }
    }
}

fn project<const N: usize>(
    matrix: &[f64],
    values: &[[f64; N]],
    h: f64,
    coefficients: &mut [[f64; N]],
) {
    for (row, weights) in coefficients
        .iter_mut()
        .zip(matrix.chunks_exact(values.len()))
    {
        // A local copy of the row, so that the sum stays in registers.
        let mut sum = *row;
        for (weight, value) in weights.iter().zip(values) {
            for a in 0..N {
                sum[a] += h * weight * value[a];
            }
        }
        *row = sum;
    }
}
