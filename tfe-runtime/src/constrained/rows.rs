//! Constraints evaluated at a point, on memory provided by the caller.

use crate::constrained::constrains::Constrains;
use crate::model::{Constraint, ConstraintSecond};

/// The number of values that [`Rows`] needs.
pub(crate) const fn rows_len(coordinates: usize, constraints: usize) -> usize {
    constraints * (5 * coordinates + 3) + weights_len(constraints)
}

/// The number of these that are kept from step to step.
const fn weights_len(constraints: usize) -> usize {
    constraints * (2 * constraints + 1)
}

/// The mark of a row that is a combination of holonomic ones.
pub(super) const COMBINED: usize = 3;

/// A row is dependent if its part orthogonal to the independent ones is below this fraction of the row.
pub(super) const DEPENDENT: f64 = 1e-10;

/// A row that was chosen before stays chosen while its orthogonal part is at least this fraction.
const KEPT: f64 = 0.1;

/// The constraints at the point that was evaluated last; one row, or one number, for each.
pub(crate) struct Rows<'a, const N: usize> {
    /// A at the start of the element.
    pub(crate) start: &'a mut [[f64; N]],
    /// A
    pub(crate) rows: &'a mut [[f64; N]],
    /// ψ_q
    pub(crate) psi_q: &'a mut [[f64; N]],
    /// Ȧ
    pub(crate) rates: &'a mut [[f64; N]],
    pub(super) spare: &'a mut [[f64; N]],
    /// a
    pub(crate) drift: &'a mut [f64],
    /// φ of the holonomic constraints.
    pub(crate) values: &'a mut [f64],
    /// The multipliers in derivatives.
    pub(crate) mu: &'a mut [f64],
    /// The weights of constraints in combined rows, a row for each.
    pub(super) weights: &'a mut [f64],
    /// U, by which multipliers are combined; its columns are stored as rows.
    pub(super) basis: &'a mut [f64],
    /// The lengths of the rows of A at the point where they were combined.
    pub(super) lengths: &'a mut [f64],
    pub(super) is_combined: bool,
}

/// The derivatives of Aᵀμ and of Ȧᵀμ.
#[derive(Clone, Copy)]
pub(crate) struct Bend<const N: usize> {
    /// ∂(Aᵀμ)/∂q
    pub(crate) bend: [[f64; N]; N],
    /// ∂(Ȧᵀμ)/∂q
    pub(crate) rate_q: [[f64; N]; N],
    /// ∂(Ȧᵀμ)/∂v
    pub(crate) rate_v: [[f64; N]; N],
}

impl<'a, const N: usize> Rows<'a, N> {
    /// Divides a slice of [`rows_len`] numbers. Kernels write only entries that can be non-zero; the others are set to
    /// zero here, once.
    pub(crate) fn of(memory: &'a mut [f64], constraints: usize) -> Self {
        let (memory, kept) = memory.split_at_mut(constraints * (5 * N + 3));
        memory.fill(0.0);
        let (weights, kept) = kept.split_at_mut(constraints * constraints);
        let (basis, lengths) = kept.split_at_mut(constraints * constraints);
        let matrix = constraints * N;
        let (start, rest) = memory.split_at_mut(matrix);
        let (rows, rest) = rest.split_at_mut(matrix);
        let (psi_q, rest) = rest.split_at_mut(matrix);
        let (rates, rest) = rest.split_at_mut(matrix);
        let (spare, rest) = rest.split_at_mut(matrix);
        let (drift, rest) = rest.split_at_mut(constraints);
        let (values, rest) = rest.split_at_mut(constraints);
        let (mu, _) = rest.split_at_mut(constraints);
        Self {
            start: start.as_chunks_mut().0,
            rows: rows.as_chunks_mut().0,
            psi_q: psi_q.as_chunks_mut().0,
            rates: rates.as_chunks_mut().0,
            spare: spare.as_chunks_mut().0,
            drift,
            values,
            mu,
            weights,
            basis,
            lengths,
            is_combined: false,
        }
    }

    /// Evaluates the rows at the start of an element, and keeps A there.
    pub(crate) fn at_start(
        memory: &'a mut [f64],
        model: &dyn Constrains<N>,
        t: f64,
        q: &[f64; N],
    ) -> Self {
        let mut rows = Self::of(memory, model.declared().len());
        rows.evaluate(model, t, q);
        rows.start.copy_from_slice(rows.rows);
        rows
    }

    /// The same for an element whose rows were already [combined](Self::combine), as the marks tell.
    pub(crate) fn at_start_again(
        memory: &'a mut [f64],
        model: &dyn Constrains<N>,
        (t, q): (f64, &[f64; N]),
        active: &[usize],
    ) -> Self {
        let mut rows = Self::at_start(memory, model, t, q);
        if active.contains(&COMBINED) {
            rows.is_combined = true;
            rows.evaluate(model, t, q);
            rows.start.copy_from_slice(rows.rows);
        }
        rows
    }

    /// Evaluates A, a and φ.
    pub(crate) fn evaluate(&mut self, model: &dyn Constrains<N>, t: f64, q: &[f64; N]) {
        self.evaluate_declared(model, t, q);
        if self.is_combined {
            self.combine_evaluated();
        }
    }

    /// Combines the evaluated rows.
    #[inline(never)]
    fn combine_evaluated(&mut self) {
        combine(self.weights, self.rows, self.spare);
        for numbers in [&mut *self.drift, &mut *self.values] {
            for (spare, weights) in self
                .spare
                .iter_mut()
                .zip(self.weights.chunks_exact(numbers.len()))
            {
                spare[0] = weights.iter().zip(&*numbers).map(|(w, x)| w * x).sum();
            }
            for (number, spare) in numbers.iter_mut().zip(&*self.spare) {
                *number = spare[0];
            }
        }
    }

    /// Evaluates the constraints as declared, without combining them.
    pub(crate) fn evaluate_declared(&mut self, model: &dyn Constrains<N>, t: f64, q: &[f64; N]) {
        if self.is_combined {
            // Kernels write only what can be non-zero.
            self.rows.fill([0.0; N]);
            self.drift.fill(0.0);
            self.values.fill(0.0);
        }
        model.values_at(t, q, self.rows, (self.drift, self.values));
    }

    /// Whether constraints depend on the time, so that they do work.
    pub(crate) fn drifts(&self) -> bool {
        !self.drift.iter().all(|a| *a == 0.0)
    }

    /// Whether rows are combinations.
    pub(crate) fn is_combined(&self) -> bool {
        self.is_combined
    }

    /// The weights of the declared constraints in the rows, a row for each, if the rows are combinations.
    #[cfg(feature = "alloc")]
    pub(crate) fn combination(&self) -> Option<&[f64]> {
        self.is_combined.then_some(&*self.weights)
    }

    /// Evaluates ψ_q and Ȧ, and the second derivatives with the multipliers `mu`.
    pub(crate) fn differentiate(
        &mut self,
        model: &dyn Constrains<N>,
        t: f64,
        q: &[f64; N],
        v: &[f64; N],
    ) -> Bend<N> {
        let zero = [[0.0; N]; N];
        if self.is_combined {
            self.declare_multipliers();
        }
        let mut second = ConstraintSecond {
            psi_q: self.psi_q,
            row_rates: self.rates,
            bend: zero,
            rate_q: zero,
            rate_v: zero,
        };
        model.second_at(t, q, v, self.mu, &mut second);
        let bend = Bend {
            bend: second.bend,
            rate_q: second.rate_q,
            rate_v: second.rate_v,
        };
        if self.is_combined {
            self.combine_differentiated();
        }
        bend
    }

    /// Before the declared constraints are differentiated: computes their multipliers, and clears the output.
    #[inline(never)]
    fn declare_multipliers(&mut self) {
        self.psi_q.fill([0.0; N]);
        self.rates.fill([0.0; N]);
        let count = self.mu.len();
        for (c, spare) in self.spare.iter_mut().enumerate() {
            spare[0] = (0..count)
                .map(|place| self.weights[place * count + c] * self.mu[place])
                .sum();
        }
        self.exchange_multipliers();
    }

    /// Afterwards: restores the multipliers, and combines the derivatives.
    #[inline(never)]
    fn combine_differentiated(&mut self) {
        self.exchange_multipliers();
        combine(self.weights, self.psi_q, self.spare);
        combine(self.weights, self.rates, self.spare);
    }

    fn exchange_multipliers(&mut self) {
        for (mu, spare) in self.mu.iter_mut().zip(self.spare.iter_mut()) {
            core::mem::swap(mu, &mut spare[0]);
        }
    }

    /// The independence of the rows that were evaluated last.
    pub(crate) fn independence(&mut self) -> Independence {
        let (mut shortest, mut longest_row) = (f64::INFINITY, 0.0_f64);
        for (spare, row) in self.spare.iter_mut().zip(&*self.rows) {
            let length = norm(row);
            (shortest, longest_row) = (shortest.min(length), longest_row.max(length));
            *spare = if length > 0.0 { unit(row) } else { *row };
        }
        let mut found = Independence {
            rank: 0,
            least: 1.0,
            shortest: shortest / longest_row,
        };
        while let Some((row, own)) = longest(self.spare)
            && own > DEPENDENT
        {
            found.rank += 1;
            found.least = found.least.min(own);
            let direction = unit(&self.spare[row]);
            for other in self.spare.iter_mut() {
                subtract_part(other, &direction);
            }
            self.spare[row] = [0.0; N];
        }
        found
    }

    /// ψ = A v + a of one constraint.
    pub(crate) fn psi(&self, constraint: usize, v: &[f64; N]) -> f64 {
        dot(&self.rows[constraint], v) + self.drift[constraint]
    }

    /// |φ| / |A| of one constraint: about the distance of the positions from those that it allows.
    pub(crate) fn distance(&self, constraint: usize) -> f64 {
        let length = norm(&self.rows[constraint]);
        self.values[constraint].abs() / if length > 0.0 { length } else { 1.0 }
    }

    /// Marks a largest set of independent rows with ones, and returns their number.
    ///
    /// This is Gram–Schmidt orthogonalisation with pivoting: the row with the largest orthogonal part, relative to its
    /// length, comes next. Holonomic rows come before others, because a constraint on velocities may follow from one on
    /// positions. Rows that were marked stay marked while they can, so that the choice does not alternate from element
    /// to element.
    pub(crate) fn choose(&mut self, declared: &[Constraint], active: &mut [usize]) -> usize {
        for (spare, row) in self.spare.iter_mut().zip(&*self.rows) {
            let length = norm(row);
            for a in 0..N {
                // A row of zeros imposes no constraint.
                spare[a] = if length > 0.0 { row[a] / length } else { 0.0 };
            }
        }
        for mark in active.iter_mut() {
            *mark = usize::from(*mark == 1);
        }
        let mut rank = 0;
        for (holonomic, least) in [
            (true, KEPT),
            (true, DEPENDENT),
            (false, KEPT),
            (false, DEPENDENT),
        ] {
            loop {
                let mut best = (least, None);
                for (c, constraint) in declared.iter().enumerate() {
                    // Marks: 0 dependent, 1 marked before, 2 chosen.
                    let open = if least == KEPT {
                        active[c] == 1
                    } else {
                        active[c] < 2
                    };
                    if constraint.kind.is_holonomic() != holonomic || !open {
                        continue;
                    }
                    let own = norm(&self.spare[c]);
                    if own > best.0 {
                        best = (own, Some(c));
                    }
                }
                let Some(c) = best.1 else { break };
                active[c] = 2;
                rank += 1;
                let direction = unit(&self.spare[c]);
                for other in self.spare.iter_mut() {
                    subtract_part(other, &direction);
                }
            }
        }
        for mark in active.iter_mut() {
            *mark /= 2;
        }
        rank
    }
}

/// How independent rows are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Independence {
    /// The number of independent rows.
    pub(crate) rank: usize,
    /// The orthogonal part of the last independent row, relative to its length, when the row with the largest
    /// orthogonal part comes next each time.
    pub(crate) least: f64,
    /// The length of the shortest row relative to the longest.
    pub(crate) shortest: f64,
}

/// The longest row.
pub(super) fn longest<const N: usize>(rows: &[[f64; N]]) -> Option<(usize, f64)> {
    let lengths = rows.iter().map(norm).enumerate();
    lengths.max_by(|a, b| a.1.total_cmp(&b.1))
}

/// Makes a row orthogonal to a direction; two passes suffice up to rounding.
pub(super) fn subtract_part<const N: usize>(row: &mut [f64; N], direction: &[f64; N]) {
    for _ in 0..2 {
        let part = dot(row, direction);
        for a in 0..N {
            row[a] -= part * direction[a];
        }
    }
}

/// Adds a multiple of one row of a square matrix to another.
pub(super) fn add_row(matrix: &mut [f64], (from, to): (usize, usize), part: f64) {
    let count = matrix.len().isqrt();
    for c in 0..count {
        matrix[to * count + c] += part * matrix[from * count + c];
    }
}

/// A row by coordinates that are measured in these units.
pub(super) fn in_units<const N: usize>(row: &[f64; N], units: &[f64; N]) -> [f64; N] {
    let mut changed = *row;
    for a in 0..N {
        changed[a] *= units[a];
    }
    changed
}

/// A row divided by a length.
pub(super) fn scaled<const N: usize>(row: &[f64; N], length: f64) -> [f64; N] {
    let mut scaled = *row;
    for entry in &mut scaled {
        *entry /= length;
    }
    scaled
}

/// weights · rows, in place, with scratch memory of the same size.
fn combine<const N: usize>(weights: &[f64], rows: &mut [[f64; N]], spare: &mut [[f64; N]]) {
    for (sum, weights) in spare.iter_mut().zip(weights.chunks_exact(rows.len())) {
        *sum = [0.0; N];
        for (weight, row) in weights.iter().zip(&*rows) {
            for a in 0..N {
                sum[a] += weight * row[a];
            }
        }
    }
    rows.copy_from_slice(spare);
}

pub(crate) fn dot<const N: usize>(a: &[f64; N], b: &[f64; N]) -> f64 {
    let mut sum = 0.0;
    for i in 0..N {
        sum += a[i] * b[i];
    }
    sum
}

/// Whether a sum of squares has all its digits: smaller ones have lost some, or all, and larger ones are infinite.
pub(crate) fn has_digits(square: f64) -> bool {
    (1e-290..=f64::MAX).contains(&square)
}

pub(crate) fn norm<const N: usize>(row: &[f64; N]) -> f64 {
    let square = dot(row, row);
    if has_digits(square) {
        crate::real::Real::sqrt(square)
    } else {
        scaled_norm(row.iter().copied())
    }
}

/// The norm of numbers whose squares are too small or too large; NaN if one of them is NaN.
#[cold]
#[inline(never)]
pub(crate) fn scaled_norm(entries: impl Iterator<Item = f64> + Clone) -> f64 {
    let mut size = 0.0_f64;
    for entry in entries.clone() {
        if entry.is_nan() {
            return entry;
        }
        size = size.max(entry.abs());
    }
    if size == 0.0 || size == f64::INFINITY {
        return size;
    }
    let mut sum = 0.0;
    for entry in entries {
        sum += (entry / size) * (entry / size);
    }
    size * crate::real::Real::sqrt(sum)
}

pub(super) fn unit<const N: usize>(row: &[f64; N]) -> [f64; N] {
    scaled(row, norm(row))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn norms_have_all_digits_whatever_the_size() {
        for size in [5e-324, 1e-200, 1e-160, 1e-100, 1.0, 1e100, 1e160, 1e200] {
            let length = norm(&[3.0 * size, 0.0, -4.0 * size]);
            assert!((length / size - 5.0).abs() < 4e-15, "{size}: {length}");
        }
        assert!(norm(&[0.0, 0.0]) == 0.0);
        assert!(norm(&[f64::INFINITY, 1.0]) == f64::INFINITY);
        assert!(norm(&[1e300, f64::NAN]).is_nan());
    }

    /// Lengths are kept where their squares were.
    #[test]
    fn the_root_of_a_square_is_the_number() {
        for k in 1..10_000 {
            let number = f64::from(k).sqrt() * 1.1_f64.powi(k % 700 - 350);
            assert!((number * number).sqrt() == number);
        }
    }
}
