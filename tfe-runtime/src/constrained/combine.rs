//! Redundant holonomic constraints in an element: they are replaced by as many combinations as are independent (T-118,
//! T-132).

use super::constrains::Constrains;
use super::layout::Layout;
use super::rows::{
    COMBINED, DEPENDENT, Rows, add_row, dot, has_digits, in_units, longest, norm, scaled,
    scaled_norm, subtract_part, unit,
};
use crate::legendre::largest;

/// Constraints whose gradients vanish in the middle of an element, and change there by less than this fraction of the
/// changes of others, are not combined with these: the weights would be large.
const STILL: f64 = 0.01;

impl<const N: usize> Rows<'_, N> {
    /// Replaces the rows of holonomic constraints, some of which depend on others, by as many combinations as are
    /// independent: functions W φ with W constant in the element (T-118). For each gradient spanned by the rows in the
    /// middle of the element, it chooses, among all combinations with this gradient there, the one whose gradient
    /// changes least along the motion. So the rows stay independent for as long as possible, and the result does not
    /// depend on the choice, scaling or combination of the given rows.
    ///
    /// `places` are time and position at the start and, as far as it is known, in the middle; `rate` is the velocity
    /// there. Lengths and angles are those of coordinates measured in `units`.
    pub(crate) fn combine(
        &mut self,
        model: &dyn Constrains<N>,
        places: [(f64, &[f64; N]); 2],
        (rate, units): (&[f64; N], &[f64; N]),
        active: &mut [usize],
    ) {
        let declared = model.declared();
        let count = declared.len();
        let holonomic = || (0..count).filter(|&c| declared[c].kind.is_holonomic());
        let rank = holonomic().filter(|&c| active[c] != 0).count();
        let [start, (time, middle)] = places;
        // The middle is known only to order h², and away from the constraints more rows are independent: without this
        // correction the result would depend on which rows are given.
        let middle = self.nearest(model, (time, middle), units, rank);
        let middle = (time, &middle);
        self.evaluate_declared(model, middle.0, middle.1);
        self.weights.fill(0.0);
        for c in 0..count {
            self.lengths[c] = norm(&in_units(&self.rows[c], units));
            self.spare[c] = [0.0; N];
        }
        for c in holonomic().filter(|&c| self.lengths[c] > 0.0) {
            self.spare[c] = scaled(&in_units(&self.rows[c], units), self.lengths[c]);
        }
        for c in holonomic() {
            active[c] = 0;
        }
        for place in holonomic().take(rank) {
            if !self.add_basis(place) {
                break;
            }
            active[place] = COMBINED;
        }
        self.basis.copy_from_slice(self.weights);
        self.turn_least(model, middle, (rate, units), active);
        for c in 0..count {
            if !declared[c].kind.is_holonomic() {
                self.weights[c * count + c] = 1.0;
                self.basis[c * count + c] = 1.0;
                self.lengths[c] = 1.0;
                continue;
            }
            let length = self.lengths[c];
            for place in 0..count {
                let weight = &mut self.weights[place * count + c];
                *weight = if length > 0.0 { *weight / length } else { 0.0 };
            }
        }
        self.is_combined = true;
        self.evaluate(model, start.0, start.1);
        self.start.copy_from_slice(self.rows);
    }

    /// The point on the holonomic constraints nearest to a position, where `rank` of them are independent, by the
    /// iteration q ← q₀ − A⁺ (φ + A (q₀ − q)) (T-151).
    ///
    /// If the iteration does not converge, the result is the position itself.
    fn nearest(
        &mut self,
        model: &dyn Constrains<N>,
        (t, from): (f64, &[f64; N]),
        units: &[f64; N],
        rank: usize,
    ) -> [f64; N] {
        const MOST: u32 = 12;
        const NEAR: f64 = 4.0 * f64::EPSILON;
        let mut at = *from;
        for _ in 0..MOST {
            let (mut change, mut place) = (at, at);
            at = self.moved_to_tangents(model, t, [from, &at], units, rank);
            for a in 0..N {
                change[a] = (change[a] - at[a]) / units[a];
                place[a] = at[a] / units[a];
            }
            // A NaN is not near.
            if largest(&change) <= NEAR * largest(&place) {
                return at;
            }
        }
        *from
    }

    /// q₀ − A⁺ (φ + A (q₀ − q)), with `rank` rows.
    fn moved_to_tangents(
        &mut self,
        model: &dyn Constrains<N>,
        t: f64,
        [from, at]: [&[f64; N]; 2],
        units: &[f64; N],
        rank: usize,
    ) -> [f64; N] {
        self.evaluate_declared(model, t, at);
        // The rows are normalised, and the right-hand sides with them.
        for (c, row) in self.rows.iter().enumerate() {
            let measured = in_units(row, units);
            let length = norm(&measured);
            if !model.declared()[c].kind.is_holonomic() || length == 0.0 {
                (self.spare[c], self.values[c]) = ([0.0; N], 0.0);
                continue;
            }
            let back: f64 = (0..N).map(|a| row[a] * (from[a] - at[a])).sum();
            self.values[c] = (self.values[c] + back) / length;
            self.spare[c] = unit(&measured);
        }
        let mut moved = *from;
        for _ in 0..rank {
            let Some((row, own)) = longest(self.spare).filter(|(_, own)| *own > DEPENDENT) else {
                break;
            };
            let direction = unit(&self.spare[row]);
            let step = -self.values[row] / own;
            for a in 0..N {
                moved[a] += step * direction[a] * units[a];
            }
            for (row, value) in self.spare.iter_mut().zip(&mut *self.values) {
                *value += step * dot(row, &direction);
                subtract_part(row, &direction);
            }
        }
        moved
    }

    /// Adds combinations of constraints whose gradients vanish in the middle to the chosen ones, so that the gradients
    /// of these change least.
    ///
    /// With B the rates of the scaled rows and R = (1 − U Uᵀ) B, it minimises |(u + v)ᵀ B| over all v ⊥ U for each
    /// column u of U, with v in the column space of R.
    fn turn_least(
        &mut self,
        model: &dyn Constrains<N>,
        (t, q): (f64, &[f64; N]),
        (rate, units): (&[f64; N], &[f64; N]),
        active: &[usize],
    ) {
        let declared = model.declared();
        let count = declared.len();
        let holonomic = |c: usize| declared[c].kind.is_holonomic();
        // Kernels write only what can be non-zero.
        self.is_combined = false;
        self.psi_q.fill([0.0; N]);
        self.rates.fill([0.0; N]);
        self.mu.fill(0.0);
        // At rest any direction is as good as another.
        let is_at_rest = rate.iter().all(|rate| *rate == 0.0);
        let rate = if is_at_rest { units } else { rate };
        self.differentiate(model, t, q, rate);
        let mut largest = 0.0_f64;
        for c in 0..count {
            let (rates, length) = (&mut self.rates[c], self.lengths[c]);
            *rates = if holonomic(c) && length > 0.0 {
                scaled(&in_units(rates, units), length)
            } else {
                [0.0; N]
            };
            largest = largest.max(norm(rates));
            self.spare[c] = *rates;
        }
        let combined = || (0..count).filter(|&place| active[place] == COMBINED);
        for place in combined() {
            self.take_from_columns(place);
        }
        // The places of omitted combinations hold what is added, and how much that changes the gradient.
        let open = || (0..count).filter(|&c| holonomic(c) && active[c] == 0);
        let mut found = 0;
        for place in open() {
            if !self.add_column(place, STILL * largest) {
                break;
            }
            found += 1;
        }
        let combination = |weights: &[f64], place: usize, rates: &[[f64; N]]| {
            let mut sum = [0.0; N];
            for (weight, rate) in weights[place * count..].iter().zip(rates) {
                for a in 0..N {
                    sum[a] += weight * rate[a];
                }
            }
            sum
        };
        for place in open().take(found) {
            let mut turn = combination(self.weights, place, self.rates);
            // Two passes of orthogonalisation suffice up to rounding.
            for _ in 0..2 {
                for before in open().take_while(|&before| before < place) {
                    let part = dot(&turn, &self.psi_q[before]);
                    for a in 0..N {
                        turn[a] -= part * self.psi_q[before][a];
                    }
                    add_row(self.weights, (before, place), -part);
                }
            }
            let length = norm(&turn);
            for entry in &mut turn {
                *entry /= length;
            }
            for entry in &mut self.weights[place * count..(place + 1) * count] {
                *entry /= length;
            }
            self.psi_q[place] = turn;
        }
        for place in combined() {
            let turn = combination(self.weights, place, self.rates);
            for added in open().take(found) {
                add_row(
                    self.weights,
                    (added, place),
                    -dot(&turn, &self.psi_q[added]),
                );
            }
        }
        for place in open() {
            self.weights[place * count..(place + 1) * count].fill(0.0);
        }
    }

    /// One step of Gram–Schmidt on the columns of `spare`: the column with the largest part orthogonal to the basis
    /// becomes a row of the basis. False if no column has such a part.
    fn add_basis(&mut self, place: usize) -> bool {
        self.add_column(place, DEPENDENT)
    }

    /// The same, which returns false if no such part is larger than `least`.
    fn add_column(&mut self, place: usize, least: f64) -> bool {
        let count = self.spare.len();
        let (mut best, mut column) = (least, None);
        for a in 0..N {
            let own = column_norm(self.spare, a);
            if own > best {
                (best, column) = (own, Some(a));
            }
        }
        let Some(column) = column else { return false };
        let basis = &mut self.weights[place * count..(place + 1) * count];
        for (entry, row) in basis.iter_mut().zip(&*self.spare) {
            *entry = row[column] / best;
        }
        self.take_from_columns(place);
        true
    }

    /// Makes the columns of `spare` orthogonal to a row of weights.
    fn take_from_columns(&mut self, place: usize) {
        let count = self.spare.len();
        let direction = &self.weights[place * count..(place + 1) * count];
        // Two passes of orthogonalisation suffice up to rounding.
        for _ in 0..2 {
            for a in 0..N {
                let part: f64 = (direction.iter().zip(&*self.spare))
                    .map(|(entry, row)| entry * row[a])
                    .sum();
                for (entry, row) in direction.iter().zip(self.spare.iter_mut()) {
                    row[a] -= part * entry;
                }
            }
        }
    }

    /// Converts all multipliers of an element from those of the constraints as declared to those of the rows, if these
    /// are combinations.
    pub(crate) fn combine_multipliers(&mut self, layout: &Layout, unknowns: &mut [f64]) {
        if !self.is_combined {
            return;
        }
        for multipliers in layout.multipliers() {
            let multipliers = &mut unknowns[multipliers];
            let count = multipliers.len();
            for place in 0..count {
                let basis = &self.basis[place * count..(place + 1) * count];
                let mut sum = 0.0;
                for c in 0..count {
                    sum += basis[c] * self.lengths[c] * multipliers[c];
                }
                self.mu[place] = sum;
            }
            multipliers.copy_from_slice(self.mu);
        }
    }

    /// The inverse conversion.
    pub(crate) fn restore_multipliers(&mut self, layout: &Layout, unknowns: &mut [f64]) {
        if !self.is_combined {
            return;
        }
        for multipliers in layout.multipliers() {
            let multipliers = &mut unknowns[multipliers];
            let count = multipliers.len();
            for c in 0..count {
                self.mu[c] = (0..count)
                    .map(|place| self.weights[place * count + c] * multipliers[place])
                    .sum();
            }
            multipliers.copy_from_slice(self.mu);
        }
    }
}

/// The norm of a column.
fn column_norm<const N: usize>(rows: &[[f64; N]], column: usize) -> f64 {
    let entries = rows.iter().map(|row| row[column]);
    let square: f64 = entries.clone().map(|entry| entry * entry).sum();
    if has_digits(square) {
        crate::real::Real::sqrt(square)
    } else {
        scaled_norm(entries)
    }
}
