//! The solution of a family between the nodes: integrated rates (T-69).

use super::FamilyState;
use crate::basis::{MAX_NODES, legendre_integrals};
use crate::scheme::SchemeRef;
use alloc::vec;
use alloc::vec::Vec;

/// One element of a motion of a family, to be evaluated anywhere inside.
///
/// Coordinates and momenta are polynomials that begin and end at the states of the nodes. 2 s n numbers for s stages and n coordinates.
#[derive(Clone, Debug, PartialEq)]
pub struct FamilyDense {
    times: (f64, f64),
    start: FamilyState,
    end: FamilyState,
    /// Legendre coefficients of h dq/dt, a row of n each, then those of h dp/dt.
    rates: Vec<f64>,
}

impl FamilyDense {
    /// Nothing happens.
    pub(super) fn constant(times: (f64, f64), state: FamilyState) -> Self {
        Self {
            times,
            start: state.clone(),
            end: state,
            rates: Vec::new(),
        }
    }

    /// From rates of coordinates and momenta at the points, as functions of point and coordinate.
    pub(super) fn of(
        scheme: &SchemeRef<'_>,
        times: (f64, f64),
        h: f64,
        (start, end): (FamilyState, FamilyState),
        rate: impl Fn(usize, usize) -> f64,
        force: impl Fn(usize, usize) -> f64,
    ) -> Self {
        let (count, n) = (scheme.rates(), start.q.len());
        let mut rates = vec![0.0; 2 * count * n];
        let (q, p) = rates.split_at_mut(count * n);
        let points = scheme.points();
        for (m, row) in q.chunks_exact_mut(n).enumerate() {
            for point in 0..points {
                let weight = h * scheme.rate[m * points + point];
                for (a, entry) in row.iter_mut().enumerate() {
                    *entry += weight * rate(point, a);
                }
            }
        }
        for (m, row) in p.chunks_exact_mut(n).enumerate() {
            for point in 0..points {
                let weight = h * scheme.force_rate[m * points + point];
                for (a, entry) in row.iter_mut().enumerate() {
                    *entry += weight * force(point, a);
                }
            }
        }
        Self {
            times,
            start,
            end,
            rates,
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

    /// The state at a time between start and end.
    #[must_use]
    pub fn at_time(&self, time: f64) -> FamilyState {
        if time == self.times.1 {
            return self.end.clone();
        }
        let tau = (time - self.times.0) / (self.times.1 - self.times.0);
        let mut integrals = [0.0; MAX_NODES];
        legendre_integrals(tau, &mut integrals);
        let mut state = self.start.clone();
        let n = state.q.len();
        let (q, p) = self.rates.split_at(self.rates.len() / 2);
        for (target, rates) in [(&mut state.q, q), (&mut state.p, p)] {
            for (row, integral) in rates.chunks_exact(n.max(1)).zip(integrals) {
                for (value, rate) in target.iter_mut().zip(row) {
                    *value += integral * rate;
                }
            }
        }
        state
    }
}
