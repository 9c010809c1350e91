//! The constraints of a model of run-time length at one instant: φ, and the entries of A = ∂φ/∂q that can be non-zero.

use super::model::Model;
use super::pattern::Pattern;
use crate::constrained::rows::has_digits;
use alloc::vec;
use alloc::vec::Vec;

/// The rows, which are evaluated anew at every point.
#[derive(Clone, Debug)]
pub(super) struct Rows {
    pattern: Pattern,
    /// A, one value for each place of its pattern.
    pub(super) values: Vec<f64>,
    /// φ
    pub(super) phi: Vec<f64>,
    /// a = ∂φ/∂t
    pub(super) drift: Vec<f64>,
}

impl Rows {
    /// Finds the pattern; the model has been checked.
    pub(super) fn new<M: Model>(model: &M) -> Self {
        let pattern = Pattern::of_rows(model);
        let count = model.constraints();
        Self {
            values: vec![0.0; pattern.places().len()],
            pattern,
            phi: vec![0.0; count],
            drift: vec![0.0; count],
        }
    }

    /// No constraints.
    pub(super) fn none() -> Self {
        Self {
            pattern: Pattern::default(),
            values: Vec::new(),
            phi: Vec::new(),
            drift: Vec::new(),
        }
    }

    /// (constraint, coordinate) of each value.
    pub(super) fn places(&self) -> impl Iterator<Item = (usize, usize)> {
        let places = self.pattern.places().iter();
        places.map(|(_, constraint, coordinate)| (*constraint, *coordinate))
    }

    /// φ, A and a at a time and coordinates.
    pub(super) fn evaluate<M: Model>(&mut self, model: &M, t: f64, q: &[f64]) {
        if self.phi.is_empty() {
            return;
        }
        model.constraint_values(t, q, &mut self.phi);
        let mut entries = self.pattern.scatter(&mut self.values);
        model.constraint_rows(t, q, &mut self.drift, &mut entries);
    }

    /// sum ← sum + factor · Aᵀ μ, with A as `values`.
    pub(super) fn add_reaction(&self, values: &[f64], factor: f64, mu: &[f64], sum: &mut [f64]) {
        self.pattern.add_transposed(values, factor, mu, sum);
    }

    /// A v + a
    pub(super) fn rate(&self, v: &[f64], rate: &mut [f64]) {
        rate.copy_from_slice(&self.drift);
        self.pattern.add_product(&self.values, 1.0, v, rate);
    }

    /// |φ| / |A| of each row: about the distance of the positions from those that it allows.
    pub(super) fn distances(&self) -> Vec<f64> {
        let mut distances = self.lengths();
        for (distance, phi) in distances.iter_mut().zip(&self.phi) {
            let length = if *distance > 0.0 { *distance } else { 1.0 };
            *distance = phi.abs() / length;
        }
        distances
    }

    /// |A| of each row.
    pub(super) fn lengths(&self) -> Vec<f64> {
        let mut lengths = vec![0.0; self.phi.len()];
        for ((constraint, _), value) in self.places().zip(&self.values) {
            lengths[constraint] += value * value;
        }
        let sizes = if lengths.iter().all(|square| has_digits(*square)) {
            vec![0.0; lengths.len()]
        } else {
            self.scale(&mut lengths)
        };
        for (length, size) in lengths.iter_mut().zip(sizes) {
            let root = length.sqrt();
            *length = if size > 0.0 { size * root } else { root };
        }
        lengths
    }

    /// Recomputes sums of squares that have lost their digits, divided by the squares of the largest entries of their
    /// rows. Returns these entries, and zeros for all other rows.
    #[cold]
    fn scale(&self, squares: &mut [f64]) -> Vec<f64> {
        let mut sizes = vec![0.0_f64; squares.len()];
        for ((constraint, _), value) in self.places().zip(&self.values) {
            if !has_digits(squares[constraint]) {
                sizes[constraint] = sizes[constraint].max(value.abs());
            }
        }
        for (square, size) in squares.iter_mut().zip(&sizes) {
            if *size > 0.0 {
                *square = 0.0;
            }
        }
        for ((constraint, _), value) in self.places().zip(&self.values) {
            let size = sizes[constraint];
            if size > 0.0 {
                squares[constraint] += (value / size) * (value / size);
            }
        }
        sizes
    }
}
