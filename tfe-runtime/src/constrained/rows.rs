//! Constraints evaluated at a point, on the caller's memory.

use crate::model::{ConstraintSecond, Model};

/// The numbers that [`Rows`] need.
pub(crate) const fn rows_len(coordinates: usize, constraints: usize) -> usize {
    constraints * (5 * coordinates + 3)
}

/// What is left of a row beside the independent ones, relative to the row: below it the row is dependent.
const DEPENDENT: f64 = 1e-10;

/// A row that was chosen before stays chosen while it has so much of its own.
const KEPT: f64 = 1e-3;

/// The constraints at the point that was evaluated last; a row, or a number, for each.
pub(crate) struct Rows<'a, const N: usize> {
    /// A at the start of the element.
    pub(crate) start: &'a mut [[f64; N]],
    /// A
    pub(crate) rows: &'a mut [[f64; N]],
    /// ψ_q
    pub(crate) psi_q: &'a mut [[f64; N]],
    /// Ȧ
    pub(crate) rates: &'a mut [[f64; N]],
    spare: &'a mut [[f64; N]],
    /// a
    pub(crate) drift: &'a mut [f64],
    /// φ of holonomic ones.
    pub(crate) values: &'a mut [f64],
    /// Multipliers to differentiate with.
    pub(crate) mu: &'a mut [f64],
}

/// What multipliers bend: the derivatives of Aᵀμ and of Ȧᵀμ.
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
    /// In memory of [`rows_len`] numbers. Kernels write only what can be non-zero: the rest is cleared here once.
    pub(crate) fn of(memory: &'a mut [f64], constraints: usize) -> Self {
        memory.fill(0.0);
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
        }
    }

    /// Evaluated at the start of an element, with A kept as that of the start.
    pub(crate) fn at_start<M: Model<N>>(
        memory: &'a mut [f64],
        model: &M,
        t: f64,
        q: &[f64; N],
    ) -> Self {
        let mut rows = Self::of(memory, M::CONSTRAINTS.len());
        rows.evaluate(model, t, q);
        rows.start.copy_from_slice(rows.rows);
        rows
    }

    /// Evaluates A, a and φ.
    pub(crate) fn evaluate<M: Model<N>>(&mut self, model: &M, t: f64, q: &[f64; N]) {
        model.constraint_rows(t, q, self.rows, self.drift);
        model.constraint_values(t, q, self.values);
    }

    /// Evaluates ψ_q and Ȧ, and what the multipliers `mu` bend.
    pub(crate) fn differentiate<M: Model<N>>(
        &mut self,
        model: &M,
        t: f64,
        q: &[f64; N],
        v: &[f64; N],
    ) -> Bend<N> {
        let zero = [[0.0; N]; N];
        let mut second = ConstraintSecond {
            psi_q: self.psi_q,
            row_rates: self.rates,
            bend: zero,
            rate_q: zero,
            rate_v: zero,
        };
        model.constraint_second(t, q, v, self.mu, &mut second);
        Bend {
            bend: second.bend,
            rate_q: second.rate_q,
            rate_v: second.rate_v,
        }
    }

    /// ψ = A v + a of one constraint.
    pub(crate) fn psi(&self, constraint: usize, v: &[f64; N]) -> f64 {
        dot(&self.rows[constraint], v) + self.drift[constraint]
    }

    /// Marks a largest set of independent rows with ones; returns how many they are.
    ///
    /// Gram–Schmidt with the row next that has most of its own, relative to its length; holonomic rows come before others, because a
    /// constraint on velocities may follow from one on positions. Rows that were marked stay so while they can, so that the choice does not
    /// flicker from element to element.
    pub(crate) fn choose<M: Model<N>>(&mut self, active: &mut [usize]) -> usize {
        for (spare, row) in self.spare.iter_mut().zip(&*self.rows) {
            let length = norm(row);
            for a in 0..N {
                // A row of zeros constrains nothing.
                spare[a] = if length > 0.0 { row[a] / length } else { 0.0 };
            }
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
                for (c, constraint) in M::CONSTRAINTS.iter().enumerate() {
                    // Marks: 0 dependent, 1 marked before, 2 chosen.
                    let open = if least == KEPT {
                        active[c] == 1
                    } else {
                        active[c] < 2
                    };
                    let own = norm(&self.spare[c]);
                    if constraint.kind.is_holonomic() == holonomic && open && own > best.0 {
                        best = (own, Some(c));
                    }
                }
                let Some(c) = best.1 else { break };
                active[c] = 2;
                rank += 1;
                let direction = unit(&self.spare[c]);
                for other in self.spare.iter_mut() {
                    // Twice is enough for orthogonality to rounding.
                    for _ in 0..2 {
                        let part = dot(other, &direction);
                        for a in 0..N {
                            other[a] -= part * direction[a];
                        }
                    }
                }
            }
        }
        for mark in active.iter_mut() {
            *mark /= 2;
        }
        rank
    }
}

pub(crate) fn dot<const N: usize>(a: &[f64; N], b: &[f64; N]) -> f64 {
    let mut sum = 0.0;
    for i in 0..N {
        sum += a[i] * b[i];
    }
    sum
}

pub(crate) fn norm<const N: usize>(row: &[f64; N]) -> f64 {
    crate::real::Real::sqrt(dot(row, row))
}

fn unit<const N: usize>(row: &[f64; N]) -> [f64; N] {
    let length = norm(row);
    let mut unit = *row;
    for entry in &mut unit {
        *entry /= length;
    }
    unit
}
