//! The equations by which a motion closes after a period, linearised, and their least-norm solution.

use super::error::OrbitError;
use crate::length::Length;
use crate::motion::{Motion, Node};
use crate::numbers::{larger, largest, raise};
use nalgebra::{DMatrix, DVector};

/// A Newton correction of an orbit.
pub(super) struct Correction {
    /// The change of the start, in the order (p, q), divided by the scales.
    pub(super) start: DVector<f64>,
    /// The change of the period.
    pub(super) stretch: f64,
    /// The largest singular value of the equations: the largest factor from a correction to the residual.
    pub(super) gain: f64,
}

impl Correction {
    /// Its size relative to the motion and its period.
    pub(super) fn size(&self, period: f64) -> f64 {
        larger(largest(self.start.as_slice()), self.stretch.abs() / period)
    }
}

/// The linearised equations of periodicity.
pub(super) struct Closing<'a> {
    /// The derivative of the end by the start, in the order (p, q).
    pub(super) product: DMatrix<f64>,
    /// The derivative of the end by the period, if that is unknown.
    pub(super) rate: Option<DVector<f64>>,
    pub(super) scales: &'a Scales,
    pub(super) period: f64,
}

impl Closing<'_> {
    /// The least-norm correction.
    pub(super) fn shortest(&self, residual: &DVector<f64>) -> Result<Correction, OrbitError> {
        /// Singular values below this, relative to the largest, count as zero; they belong to families of orbits.
        const ZERO: f64 = 1e-9;
        let size = residual.len();
        let scale = |row: usize| self.scales.of(row);
        let columns = size + usize::from(self.rate.is_some());
        let matrix = DMatrix::from_fn(size, columns, |row, column| match &self.rate {
            Some(rate) if column == size => rate[row] * self.period / scale(row),
            _ => {
                let unit = if row == column { 1.0 } else { 0.0 };
                self.product[(row, column)] * scale(column) / scale(row) - unit
            }
        });
        let stalled = OrbitError::Stalled {
            residual: largest(residual.as_slice()),
            iterations: 0,
        };
        // The singular value decomposition would not terminate.
        let mut entries = matrix.iter().chain(residual.iter());
        if !entries.all(|entry| entry.is_finite()) {
            return Err(stalled);
        }
        let svd = matrix.svd(true, true);
        let gain = svd.singular_values.amax();
        let Ok(change) = svd.solve(&-residual, ZERO * gain) else {
            return Err(stalled);
        };
        let stretch = self
            .rate
            .as_ref()
            .map_or(0.0, |_| change[size] * self.period);
        Ok(Correction {
            start: change.rows(0, size).into_owned(),
            stretch,
            gain,
        })
    }
}

/// The scales of coordinates and momenta.
pub(super) struct Scales {
    pub(super) q: f64,
    pub(super) p: f64,
    /// The scale of each component, in the order (p, q).
    own: Vec<f64>,
}

impl Scales {
    /// The scale of a component, in the order (p, q).
    pub(super) fn of(&self, row: usize) -> f64 {
        self.own[row]
    }
}

/// The scale of all components of a kind is the largest of them. Much smaller components, such as an angle beside a
/// distance, have scales of their own, unless they are small enough to be rounding errors of the largest, as components
/// that vanish by symmetry.
pub(super) fn scales<const N: usize, L: Length<N>>(motion: &Motion<N, L>) -> Scales {
    const SMALL: f64 = 1e-3;
    const ROUNDINGS: f64 = 1e-12;

    let n = motion.last().q.as_ref().len();
    let mut own = Vec::with_capacity(2 * n);
    let mut of_kind = |of: fn(&Node<N, L>) -> &L::Vector| {
        let mut sizes = vec![0.0_f64; n];
        for node in motion.states() {
            for (size, value) in sizes.iter_mut().zip(of(node).as_ref()) {
                raise(size, value.abs());
            }
        }
        let largest = largest(&sizes);
        let largest = if largest > 0.0 { largest } else { 1.0 };
        own.extend(sizes.iter().map(|size| {
            let is_small = *size < SMALL * largest && *size > ROUNDINGS * largest;
            if is_small { *size } else { largest }
        }));
        largest
    };
    let p = of_kind(|node| &node.p);
    let q = of_kind(|node| &node.q);
    Scales { q, p, own }
}

/// A state plus a change of its components, which are counted in the order (p, q).
pub(super) fn moved<const N: usize, L: Length<N>>(
    state: &L::State,
    change: impl Fn(usize) -> f64,
) -> L::State {
    let (q, p) = L::parts(state);
    let (old_q, old_p) = (q.as_ref(), p.as_ref());
    let n = old_q.len();
    L::state(
        L::from_fn(q, |a| old_q[a] + change(n + a)),
        L::from_fn(p, |a| old_p[a] + change(a)),
    )
}
