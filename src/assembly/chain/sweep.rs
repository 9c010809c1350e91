//! The elimination of the interior nodes and the back substitution.

use super::equations::{Equations, Shape};
use crate::periodic_schur::{balancing, exponent, power_of_two, reflection};

/// The rows of the elimination; nodes are scaled, ŷ = D⁻¹ y.
///
/// A row has the coefficients of ŷ_e, ŷ_{e+1}, ŷ_0 and γ and then its right sides.
#[derive(Clone, Debug)]
pub(super) struct Sweep {
    /// The length of a row, 3m + g + the number of right sides.
    width: usize,
    /// The relation (m rows), the link (m rows) and the dense rows of the current stage.
    rows: Vec<f64>,
    /// The rows (R, T, S, G, right sides) of the eliminated nodes, m for each.
    stages: Vec<f64>,
    /// The diagonal of D.
    scales: Vec<f64>,
    /// The largest modulus of a coefficient of each dense row, as given.
    dense_sizes: Vec<f64>,
    /// The largest modulus of a coefficient of each global unknown in the links.
    global_sizes: Vec<f64>,
    /// The vector of a Householder reflection.
    reflector: Vec<f64>,
    /// Its product with the rows.
    projections: Vec<f64>,
    /// The largest |A_e| over all links, entry by entry.
    most: Vec<f64>,
    exponents: Vec<i64>,
}

impl Sweep {
    pub(super) fn new(shape: &Shape) -> Self {
        let m = shape.block;
        let width = 3 * m + shape.globals + shape.rights;
        Self {
            width,
            rows: vec![0.0; (2 * m + shape.dense) * width],
            stages: vec![0.0; (shape.links - 1) * m * width],
            scales: vec![1.0; m],
            dense_sizes: vec![0.0; shape.dense],
            global_sizes: vec![0.0; shape.globals],
            reflector: vec![0.0; 2 * m],
            projections: vec![0.0; width],
            most: vec![0.0; m * m],
            exponents: vec![0; m],
        }
    }

    /// Eliminates ŷ₁, …, ŷ_{E−1}; returns the sign of the determinant collected so far.
    ///
    /// The remaining rows are given by [`relation`](Self::relation) and [`dense`](Self::dense).
    pub(super) fn eliminate(&mut self, shape: &Shape, equations: &Equations) -> f64 {
        self.balance(equations);
        self.eliminate_scaled(shape, equations)
    }

    /// Repeats the elimination in other scales, after the closing system was singular; `None` if there are no others.
    pub(super) fn eliminate_again(&mut self, shape: &Shape, equations: &Equations) -> Option<f64> {
        let is_raised = self.raise();
        is_raised.then(|| self.eliminate_scaled(shape, equations))
    }

    fn eliminate_scaled(&mut self, shape: &Shape, equations: &Equations) -> f64 {
        let m = shape.block;
        self.start(shape, equations);
        let mut flips = 0;
        for e in 1..shape.links {
            self.load_link(shape, equations, e);
            self.load_weights(shape, equations, e + 1);
            flips += self.reduce(m);
            self.reduce_dense(m);
            let stage = (e - 1) * m * self.width;
            self.stages[stage..stage + m * self.width]
                .copy_from_slice(&self.rows[..m * self.width]);
            self.advance(m);
        }
        // Sign of the permutation: the columns of y_0 pass those of the E − 1 eliminated nodes, m for each.
        flips += m * (shape.links - 1);
        if flips % 2 == 0 { 1.0 } else { -1.0 }
    }

    /// The rows of the relation between ŷ_E and ŷ_0: the coefficients of ŷ_E, m zeros, those of ŷ_0 and γ, right sides.
    pub(super) fn relation(&self, row: usize) -> &[f64] {
        &self.rows[row * self.width..(row + 1) * self.width]
    }

    /// A dense row after the elimination, in the same form, and the largest modulus that it had before.
    pub(super) fn dense(&self, shape: &Shape, k: usize) -> (&[f64], f64) {
        (self.relation(2 * shape.block + k), self.dense_sizes[k])
    }

    /// The number of stored coefficients of the eliminated nodes.
    #[cfg(test)]
    pub(super) fn length(&self) -> usize {
        self.stages.len()
    }

    /// The largest modulus of a coefficient of each global unknown in the scaled links.
    pub(super) fn global_sizes(&self) -> &[f64] {
        &self.global_sizes
    }

    /// The diagonal of D.
    pub(super) fn scales(&self) -> &[f64] {
        &self.scales
    }

    /// Chooses D so that the rows and columns of D⁻¹ A_e D are of similar size where they are above one.
    fn balance(&mut self, equations: &Equations) {
        let m = self.scales.len();
        self.most.fill(0.0);
        if m > 0 {
            for matrix in equations.matrices.chunks_exact(m * m) {
                for (most, x) in self.most.iter_mut().zip(matrix) {
                    *most = most.max(x.abs());
                }
            }
        }
        // The identity matrix of each link is included: coupling that is small relative to it needs no balancing.
        balancing(&mut self.most, 1.0, &mut self.exponents);
        for (scale, &exponent) in self.scales.iter_mut().zip(&self.exponents) {
            // The exponents are those of the transpose. The bound keeps D and D⁻¹ normal numbers.
            *scale = power_of_two(-exponent.clamp(-500, 500));
        }
    }

    /// Enlarges the scales of components that hardly affect others and are affected even less, such as momenta of free
    /// bodies over a short time, so that their effect is of the size of the components. Returns whether there are any.
    fn raise(&mut self) -> bool {
        /// The largest such effect; with a larger one the first scales lose few digits.
        const HARDLY: f64 = 1e-10;

        let m = self.scales.len();
        let mut is_raised = false;
        for j in 0..m {
            let others = || (0..m).filter(|i| *i != j);
            let moves = others().map(|i| self.most[i * m + j]);
            let moves = moves.fold(0.0_f64, f64::max);
            let moved = others().map(|i| self.most[j * m + i]);
            let moved = moved.fold(0.0_f64, f64::max);
            if moves > 0.0 && moves < HARDLY && moved < moves {
                self.scales[j] *= power_of_two((-exponent(moves)).min(400));
                is_raised = true;
            }
        }
        is_raised
    }

    /// Takes the first link as the relation, and begins the dense rows.
    fn start(&mut self, shape: &Shape, equations: &Equations) {
        let (m, width) = (shape.block, self.width);
        self.global_sizes.fill(0.0);
        self.load_link(shape, equations, 0);
        let (relation, link) = self.rows[..2 * m * width].split_at_mut(m * width);
        for (to, from) in relation
            .chunks_exact_mut(width)
            .zip(link.chunks_exact(width))
        {
            to[..m].copy_from_slice(&from[m..2 * m]);
            to[m..2 * m].fill(0.0);
            to[2 * m..3 * m].copy_from_slice(&from[..m]);
            to[3 * m..].copy_from_slice(&from[3 * m..]);
        }
        let g = shape.globals;
        self.dense_sizes.fill(0.0);
        for (k, row) in self.rows[2 * m * width..]
            .chunks_exact_mut(width)
            .enumerate()
        {
            let nodes = &equations.dense_nodes[k * shape.nodes()..];
            for j in 0..m {
                row[2 * m + j] = nodes[j] * self.scales[j];
                self.dense_sizes[k] = self.dense_sizes[k].max(row[2 * m + j].abs());
            }
            row[3 * m..3 * m + g].copy_from_slice(&equations.dense_globals[k * g..(k + 1) * g]);
            for (x, right) in row[3 * m + g..].iter_mut().zip(&equations.rights) {
                *x = right.dense[k];
            }
        }
        self.load_weights(shape, equations, 1);
        self.shift_dense(m);
    }

    /// Writes link `e` into the lower rows.
    fn load_link(&mut self, shape: &Shape, equations: &Equations, e: usize) {
        let (m, g, width) = (shape.block, shape.globals, self.width);
        let rows = &mut self.rows[m * width..2 * m * width];
        for (i, row) in rows.chunks_exact_mut(width).enumerate() {
            let at = e * m + i;
            let inverse = 1.0 / self.scales[i];
            let matrix = &equations.matrices[at * m..(at + 1) * m];
            for ((x, a), scale) in row.iter_mut().zip(matrix).zip(&self.scales) {
                *x = -a * scale * inverse;
            }
            row[m..3 * m].fill(0.0);
            row[m + i] = 1.0;
            let globals = &equations.link_globals[at * g..(at + 1) * g];
            for ((x, c), size) in row[3 * m..]
                .iter_mut()
                .zip(globals)
                .zip(&mut self.global_sizes)
            {
                *x = -c * inverse;
                *size = size.max(x.abs());
            }
            for (x, right) in row[3 * m + g..].iter_mut().zip(&equations.rights) {
                *x = right.links[at] * inverse;
            }
        }
    }

    /// Writes the weights of node `e` into the dense rows, in the columns of ŷ_{e+1}.
    fn load_weights(&mut self, shape: &Shape, equations: &Equations, e: usize) {
        let (m, width) = (shape.block, self.width);
        let rows = self.rows[2 * m * width..].chunks_exact_mut(width);
        for (k, (row, size)) in rows.zip(&mut self.dense_sizes).enumerate() {
            let weights = &equations.dense_nodes[k * shape.nodes() + e * m..];
            for ((x, w), scale) in row[m..2 * m].iter_mut().zip(weights).zip(&self.scales) {
                *x = w * scale;
                *size = size.max(x.abs());
            }
        }
    }

    /// Reduces the columns of ŷ_e in the relation and the link to a triangle.
    ///
    /// Returns the number of sign changes of the determinant: one for each reflection and each negative pivot.
    fn reduce(&mut self, m: usize) -> usize {
        let width = self.width;
        let rows = &mut self.rows[..2 * m * width];
        let mut flips = 0;
        for j in 0..m {
            let v = &mut self.reflector[j..];
            for (v, row) in v.iter_mut().zip(rows[j * width..].chunks_exact(width)) {
                *v = row[j];
            }
            let (tau, beta) = reflection(v);
            flips += usize::from(beta < 0.0);
            if tau == 0.0 {
                continue;
            }
            flips += 1;
            let projections = &mut self.projections[j + 1..];
            projections.fill(0.0);
            for (v, row) in v.iter().zip(rows[j * width..].chunks_exact(width)) {
                for (p, x) in projections.iter_mut().zip(&row[j + 1..]) {
                    *p += v * x;
                }
            }
            for (v, row) in v.iter().zip(rows[j * width..].chunks_exact_mut(width)) {
                row[j] = 0.0;
                let factor = tau * v;
                for (p, x) in projections.iter().zip(&mut row[j + 1..]) {
                    *x -= factor * p;
                }
            }
            rows[j * width + j] = beta;
        }
        flips
    }

    /// Eliminates ŷ_e from the dense rows.
    fn reduce_dense(&mut self, m: usize) {
        let width = self.width;
        let (rows, dense) = self.rows.split_at_mut(2 * m * width);
        for row in dense.chunks_exact_mut(width) {
            for (j, pivot) in rows[..m * width].chunks_exact(width).enumerate() {
                let factor = row[j] / pivot[j];
                for (x, p) in row[j + 1..].iter_mut().zip(&pivot[j + 1..]) {
                    *x -= factor * p;
                }
            }
        }
    }

    /// Moves the lower rows up, and the columns of ŷ_{e+1} to those of ŷ_e.
    fn advance(&mut self, m: usize) {
        let width = self.width;
        let (relation, link) = self.rows[..2 * m * width].split_at_mut(m * width);
        for (to, from) in relation
            .chunks_exact_mut(width)
            .zip(link.chunks_exact(width))
        {
            to[..m].copy_from_slice(&from[m..2 * m]);
            to[m..2 * m].fill(0.0);
            to[2 * m..].copy_from_slice(&from[2 * m..]);
        }
        self.shift_dense(m);
    }

    /// Moves the columns of ŷ_{e+1} to those of ŷ_e in the dense rows.
    fn shift_dense(&mut self, m: usize) {
        for row in self.rows[2 * m * self.width..].chunks_exact_mut(self.width) {
            row.copy_within(m..2 * m, 0);
            row[m..2 * m].fill(0.0);
        }
    }

    /// Computes the interior nodes from ŷ_0, ŷ_E and γ, and removes the scaling of all nodes.
    pub(super) fn substitute(
        &self,
        shape: &Shape,
        side: usize,
        nodes: &mut [f64],
        globals: &[f64],
    ) {
        let (m, g, width) = (shape.block, shape.globals, self.width);
        for e in (1..shape.links).rev() {
            let stage = &self.stages[(e - 1) * m * width..e * m * width];
            let (before, from) = nodes.split_at_mut(e * m);
            let (first, here) = (&before[..m], &mut from[..2 * m]);
            for (i, row) in stage.chunks_exact(width).enumerate().rev() {
                let known = dot(&row[i + 1..2 * m], &here[i + 1..])
                    + dot(&row[2 * m..3 * m], first)
                    + dot(&row[3 * m..3 * m + g], globals);
                here[i] = (row[3 * m + g + side] - known) / row[i];
            }
        }
        if m > 0 {
            for node in nodes.chunks_exact_mut(m) {
                for (y, scale) in node.iter_mut().zip(&self.scales) {
                    *y *= scale;
                }
            }
        }
    }
}

/// The scalar product.
fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
