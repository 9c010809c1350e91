//! Constraints evaluated at a point, on the caller's memory.

use crate::model::{ConstraintSecond, Model};

/// The numbers that [`Rows`] need.
pub(crate) const fn rows_len(coordinates: usize, constraints: usize) -> usize {
    constraints * (5 * coordinates + 3) + weights_len(constraints)
}

/// Of these, what is kept from step to step.
const fn weights_len(constraints: usize) -> usize {
    constraints * (2 * constraints + 1)
}

/// The mark of a row that is a combination of all holonomic ones.
const COMBINED: usize = 3;

/// What is left of a row beside the independent ones, relative to the row: below it the row is dependent.
const DEPENDENT: f64 = 1e-10;

/// Functions whose gradients vanish in the middle of an element, and turn there by less than this part of what others do, are not combined with these: the weights would be large.
const STILL: f64 = 0.01;

/// A row that was chosen before stays chosen while it has so much of its own.
const KEPT: f64 = 0.1;

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
    /// The weights of constraints in combined rows, a row for each.
    weights: &'a mut [f64],
    /// U, with which multipliers are combined, a row for each column of it.
    basis: &'a mut [f64],
    /// The squared lengths of the rows of A where they were combined.
    squares: &'a mut [f64],
    is_combined: bool,
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
        let (memory, kept) = memory.split_at_mut(constraints * (5 * N + 3));
        memory.fill(0.0);
        let (weights, kept) = kept.split_at_mut(constraints * constraints);
        let (basis, squares) = kept.split_at_mut(constraints * constraints);
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
            squares,
            is_combined: false,
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

    /// The same for an element whose rows were [combined](Self::combine) before, as the marks tell.
    pub(crate) fn at_start_again<M: Model<N>>(
        memory: &'a mut [f64],
        model: &M,
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
    pub(crate) fn evaluate<M: Model<N>>(&mut self, model: &M, t: f64, q: &[f64; N]) {
        if !self.is_combined {
            return self.evaluate_declared(model, t, q);
        }
        self.evaluate_declared(model, t, q);
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

    /// The same of the constraints as they were declared.
    pub(crate) fn evaluate_declared<M: Model<N>>(&mut self, model: &M, t: f64, q: &[f64; N]) {
        if self.is_combined {
            // Kernels write only what can be non-zero.
            self.rows.fill([0.0; N]);
            self.drift.fill(0.0);
            self.values.fill(0.0);
        }
        model.constraint_rows(t, q, self.rows, self.drift);
        model.constraint_values(t, q, self.values);
    }

    /// Whether rows are combinations.
    pub(crate) fn is_combined(&self) -> bool {
        self.is_combined
    }

    /// The weights of the constraints as declared in the rows, a row for each, where they are combinations.
    #[cfg(feature = "alloc")]
    pub(crate) fn combination(&self) -> Option<&[f64]> {
        self.is_combined.then_some(&*self.weights)
    }

    /// Replaces the rows of holonomic constraints that depend on one another by as many combinations as are independent, functions W φ with W constant in the element
    /// (T-118): for each gradient that the rows span in the middle of the element, of all combinations with this gradient there the one whose gradient turns least on the
    /// way. So the others stay independent for as long as can be, and which rows are given, or how they are scaled or combined, makes no difference.
    ///
    /// `places` are time and position at the start and in the middle, as far as that is known, and `rate` is the velocity there.
    pub(crate) fn combine<M: Model<N>>(
        &mut self,
        model: &M,
        places: [(f64, &[f64; N]); 2],
        rate: &[f64; N],
        active: &mut [usize],
    ) {
        let count = M::CONSTRAINTS.len();
        let holonomic = || (0..count).filter(|&c| M::CONSTRAINTS[c].kind.is_holonomic());
        if holonomic().all(|c| active[c] != 0) {
            return;
        }
        let rank = holonomic().filter(|&c| active[c] != 0).count();
        let [start, (time, middle)] = places;
        // The middle is known but to the order h², and off the constraints there are more independent rows: which are given would be seen.
        let middle = self.nearest(model, (time, middle), rank);
        let middle = (time, &middle);
        self.evaluate_declared(model, middle.0, middle.1);
        self.weights.fill(0.0);
        for c in 0..count {
            let length = norm(&self.rows[c]);
            self.squares[c] = length * length;
            self.spare[c] = [0.0; N];
        }
        for c in holonomic().filter(|&c| self.squares[c] > 0.0) {
            self.spare[c] = scaled(&self.rows[c], self.squares[c]);
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
        self.turn_least(model, middle, rate, active);
        for c in 0..count {
            if !M::CONSTRAINTS[c].kind.is_holonomic() {
                self.weights[c * count + c] = 1.0;
                self.basis[c * count + c] = 1.0;
                self.squares[c] = 1.0;
                continue;
            }
            let length = crate::real::Real::sqrt(self.squares[c]);
            for place in 0..count {
                let weight = &mut self.weights[place * count + c];
                *weight = if length > 0.0 { *weight / length } else { 0.0 };
            }
        }
        self.is_combined = true;
        self.evaluate(model, start.0, start.1);
        self.start.copy_from_slice(self.rows);
    }

    /// The point of the holonomic constraints, `rank` of which are independent there, that is nearest to a position: q ← q₀ − A⁺ (φ + A (q₀ − q)) (T-151).
    ///
    /// The position itself where that leads nowhere.
    fn nearest<M: Model<N>>(
        &mut self,
        model: &M,
        (t, from): (f64, &[f64; N]),
        rank: usize,
    ) -> [f64; N] {
        const MOST: u32 = 12;
        const NEAR: f64 = 4.0 * f64::EPSILON;
        let count = M::CONSTRAINTS.len();
        let mut at = *from;
        for _ in 0..MOST {
            self.evaluate_declared(model, t, &at);
            // Rows of length one, and what they are to take away.
            for c in 0..count {
                let length = norm(&self.rows[c]);
                if !M::CONSTRAINTS[c].kind.is_holonomic() || length == 0.0 {
                    (self.spare[c], self.values[c]) = ([0.0; N], 0.0);
                    continue;
                }
                let mut value = self.values[c];
                for a in 0..N {
                    value += self.rows[c][a] * (from[a] - at[a]);
                }
                self.values[c] = value / length;
                self.spare[c] = scaled(&self.rows[c], length * length);
            }
            let mut next = *from;
            for _ in 0..rank {
                let (mut own, mut best) = (DEPENDENT, None);
                for (c, row) in self.spare.iter().enumerate() {
                    if norm(row) > own {
                        (own, best) = (norm(row), Some(c));
                    }
                }
                let Some(best) = best else { break };
                let direction = scaled(&self.spare[best], own * own);
                let step = -self.values[best] / own;
                for a in 0..N {
                    next[a] += step * direction[a];
                }
                for c in 0..count {
                    let part = dot(&self.spare[c], &direction);
                    self.values[c] += part * step;
                    for a in 0..N {
                        self.spare[c][a] -= part * direction[a];
                    }
                }
            }
            let (mut change, mut size) = (0.0_f64, 0.0_f64);
            for a in 0..N {
                change = change.max((next[a] - at[a]).abs());
                size = size.max(next[a].abs());
            }
            at = next;
            // NaN is not near, and ends the search below.
            if change <= NEAR * size {
                return at;
            }
        }
        *from
    }

    /// Adds combinations of constraints whose gradients vanish in the middle to those that were chosen, so that the gradients of these turn least.
    ///
    /// With B the rates of the scaled rows and R = (1 − U Uᵀ) B, the least |(u + v)ᵀ B| over all v ⊥ U, for each column u of U: v in the space of columns of R.
    fn turn_least<M: Model<N>>(
        &mut self,
        model: &M,
        (t, q): (f64, &[f64; N]),
        rate: &[f64; N],
        active: &[usize],
    ) {
        let count = M::CONSTRAINTS.len();
        let holonomic = |c: usize| M::CONSTRAINTS[c].kind.is_holonomic();
        // Kernels write only what can be non-zero.
        self.is_combined = false;
        self.psi_q.fill([0.0; N]);
        self.rates.fill([0.0; N]);
        self.mu.fill(0.0);
        // At rest any direction will do.
        let is_at_rest = rate.iter().all(|rate| *rate == 0.0);
        let rate = if is_at_rest { &[1.0; N] } else { rate };
        self.differentiate(model, t, q, rate);
        let mut largest = 0.0_f64;
        for c in 0..count {
            let (rates, square) = (&mut self.rates[c], self.squares[c]);
            *rates = if holonomic(c) && square > 0.0 {
                scaled(rates, square)
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
        // In the places of combinations that are left out: what is added, and by how much that turns.
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
            // Twice is enough for orthogonality to rounding.
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

    /// Gram–Schmidt on the columns of `spare`: the one that has most of its own becomes a row of the basis. False where none has anything.
    fn add_basis(&mut self, place: usize) -> bool {
        self.add_column(place, DEPENDENT)
    }

    /// The same where none has more than `least`.
    fn add_column(&mut self, place: usize, least: f64) -> bool {
        let count = self.spare.len();
        let (mut best, mut column) = (least, None);
        for a in 0..N {
            let own: f64 = self.spare.iter().map(|row| row[a] * row[a]).sum();
            let own = crate::real::Real::sqrt(own);
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

    /// Leaves of the columns of `spare` what is orthogonal to a row of weights.
    fn take_from_columns(&mut self, place: usize) {
        let count = self.spare.len();
        let direction = &self.weights[place * count..(place + 1) * count];
        // Twice is enough for orthogonality to rounding.
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

    /// Multipliers of the constraints as declared to those of combined rows, one number for each.
    pub(crate) fn combine_multipliers(&mut self, multipliers: &mut [f64]) {
        let count = multipliers.len();
        for place in 0..count {
            let basis = &self.basis[place * count..(place + 1) * count];
            let mut sum = 0.0;
            for c in 0..count {
                sum += basis[c] * crate::real::Real::sqrt(self.squares[c]) * multipliers[c];
            }
            self.mu[place] = sum;
        }
        multipliers.copy_from_slice(self.mu);
    }

    /// Back again.
    pub(crate) fn declared_multipliers(&mut self, multipliers: &mut [f64]) {
        let count = multipliers.len();
        for c in 0..count {
            self.mu[c] = (0..count)
                .map(|place| self.weights[place * count + c] * multipliers[place])
                .sum();
        }
        multipliers.copy_from_slice(self.mu);
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
        if self.is_combined {
            self.psi_q.fill([0.0; N]);
            self.rates.fill([0.0; N]);
            let count = self.mu.len();
            for (c, spare) in self.spare.iter_mut().enumerate() {
                spare[0] = (0..count)
                    .map(|place| self.weights[place * count + c] * self.mu[place])
                    .sum();
            }
            for (mu, spare) in self.mu.iter_mut().zip(self.spare.iter_mut()) {
                core::mem::swap(mu, &mut spare[0]);
            }
        }
        let mut second = ConstraintSecond {
            psi_q: self.psi_q,
            row_rates: self.rates,
            bend: zero,
            rate_q: zero,
            rate_v: zero,
        };
        model.constraint_second(t, q, v, self.mu, &mut second);
        let bend = Bend {
            bend: second.bend,
            rate_q: second.rate_q,
            rate_v: second.rate_v,
        };
        if self.is_combined {
            for (mu, spare) in self.mu.iter_mut().zip(self.spare.iter_mut()) {
                core::mem::swap(mu, &mut spare[0]);
            }
            combine(self.weights, self.psi_q, self.spare);
            combine(self.weights, self.rates, self.spare);
        }
        bend
    }

    /// How independent the rows are that were evaluated last.
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

/// What rows have of their own.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Independence {
    /// How many are independent.
    pub(crate) rank: usize,
    /// What the last of them has beside those before it, relative to its length; each time that which has most comes next.
    pub(crate) least: f64,
    /// The shortest row relative to the longest one.
    pub(crate) shortest: f64,
}

/// The longest row.
fn longest<const N: usize>(rows: &[[f64; N]]) -> Option<(usize, f64)> {
    let lengths = rows.iter().map(norm).enumerate();
    lengths.max_by(|a, b| a.1.total_cmp(&b.1))
}

/// Leaves what is orthogonal to a direction. Twice is enough for that to rounding.
fn subtract_part<const N: usize>(row: &mut [f64; N], direction: &[f64; N]) {
    for _ in 0..2 {
        let part = dot(row, direction);
        for a in 0..N {
            row[a] -= part * direction[a];
        }
    }
}

/// Adds so much of one row of a square matrix to another.
fn add_row(matrix: &mut [f64], (from, to): (usize, usize), part: f64) {
    let count = matrix.len().isqrt();
    for c in 0..count {
        matrix[to * count + c] += part * matrix[from * count + c];
    }
}

/// A row over the root of `square`.
fn scaled<const N: usize>(row: &[f64; N], square: f64) -> [f64; N] {
    let length = crate::real::Real::sqrt(square);
    let mut scaled = *row;
    for entry in &mut scaled {
        *entry /= length;
    }
    scaled
}

/// weights · rows, with memory for as many.
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
