//! The constraints of a family at one instant: φ, and the entries of A = ∂φ/∂q that are not zero.

use super::model::Model;
use super::pattern::Pattern;
use alloc::vec;
use alloc::vec::Vec;

/// Rows that are evaluated anew at every point.
#[derive(Clone, Debug)]
pub(super) struct Rows {
    pattern: Pattern,
    /// A, one value a place.
    pub(super) values: Vec<f64>,
    /// φ
    pub(super) phi: Vec<f64>,
    /// a = ∂φ/∂t
    drift: Vec<f64>,
}

impl Rows {
    /// Where they are; the model has been checked.
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

    /// |A| of each row.
    pub(super) fn lengths(&self) -> Vec<f64> {
        let mut lengths = vec![0.0; self.phi.len()];
        for ((constraint, _), value) in self.places().zip(&self.values) {
            lengths[constraint] += value * value;
        }
        lengths
            .iter_mut()
            .for_each(|length| *length = length.sqrt());
        lengths
    }
}
