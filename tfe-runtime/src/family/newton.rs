//! Newton's method for models of run-time length whose forces are the unknowns, with a sparse factorisation.
//!
//! The unknowns are the forces at all points, the residual is r = f(q(f), z(f)) − f, and with K = ∂f/∂q and C = ∂f/∂z
//! at each point
//!
//! ```text
//! T = 1 − h² A²_lj K_l M⁻¹ − h A_lj C_l M⁻¹ ,     f ← f + T⁻¹ r
//! ```
//!
//! (C without M⁻¹ where z is the momentum). The sparsity pattern is known from the indices of the sums. The ordering
//! and the symbolic factorisation are computed once; the numeric factorisation is repeated only when the old factors no
//! longer contract well enough.

use super::blocked::{Blocked, Place};
use super::model::{Block, Gradient, Model};
use super::pattern::Pattern;
use super::space::Problem;
use crate::error::StepError;
use crate::model::Form;
use crate::scheme::SchemeRef;
use alloc::vec;
use alloc::vec::Vec;

/// The place in the tangent of a second derivative.
#[derive(Clone, Copy, Debug)]
struct Part {
    place: Place,
    column: usize,
    /// The sign with which it enters the force, and whether it is a derivative by velocities.
    sign: f64,
    by_z: bool,
}

/// The tangent of an element and its sparse factors. Unknowns are ordered by coordinate, with the points of a
/// coordinate next to each other.
#[derive(Clone, Debug)]
pub(super) struct Tangent {
    pattern: Pattern,
    parts: Vec<Option<Part>>,
    points: usize,
    matrix: Blocked,
    diagonal: Vec<Place>,
    derivatives: Vec<f64>,
    /// The length of the step for which it was factored.
    step: f64,
    /// Coordinates, and velocities (momenta), at all points; a row of n for each.
    pub(super) q: Vec<f64>,
    pub(super) z: Vec<f64>,
    /// The residual; after the solution, the increment of the forces.
    pub(super) rest: Vec<f64>,
    gradient: [Vec<f64>; 3],
}

impl Tangent {
    /// Finds the sparsity pattern and its ordering; `None` where memory does not suffice.
    pub(super) fn new<M: Model>(model: &M, points: usize) -> Option<Self> {
        Self::of(Pattern::of(model), M::FORM, model.len(), points)
    }

    fn of(pattern: Pattern, form: Form, n: usize, points: usize) -> Option<Self> {
        let enters = |block: &Block| matches!(block, Block::QQ | Block::ForceQ | Block::ForceZ);
        let entering = pattern.places().iter().filter(|(block, ..)| enters(block));
        let blocks = entering.map(|(_, row, column)| (*row, *column));
        let places: Vec<(usize, usize)> = blocks.chain((0..n).map(|a| (a, a))).collect();
        let matrix = Blocked::new(n, points, &places)?;
        let sign = |block: &Block| match (form, block) {
            (Form::Hamiltonian, Block::QQ) => -1.0,
            _ => 1.0,
        };
        let part = |(block, row, column): &(Block, usize, usize)| {
            enters(block).then(|| Part {
                place: matrix.place(*row, *column),
                column: *column,
                sign: sign(block),
                by_z: *block == Block::ForceZ,
            })
        };
        let parts = pattern.places().iter().map(part).collect();
        let diagonal = (0..n).map(|a| matrix.place(a, a)).collect();
        let size = n * points;
        Some(Self {
            derivatives: vec![0.0; pattern.places().len()],
            pattern,
            parts,
            points,
            matrix,
            diagonal,
            step: f64::NAN,
            q: vec![0.0; size],
            z: vec![0.0; size],
            rest: vec![0.0; size],
            gradient: [vec![0.0; n], vec![0.0; n], vec![0.0; n]],
        })
    }

    /// Whether there are factors for a step of this length.
    pub(super) fn serves(&self, h: f64) -> bool {
        self.matrix.is_factored() && self.step == h
    }

    /// Factors the tangent at the coordinates and velocities `q` and `z`.
    ///
    /// # Errors
    /// As [`Blocked::factor`].
    pub(super) fn factor<M: Model>(
        &mut self,
        model: &M,
        scheme: &SchemeRef<'_>,
        problem: &Problem,
        t: f64,
        h: f64,
    ) -> Result<(), StepError> {
        let (points, n) = (self.points, self.gradient[0].len());
        let once = |l: usize, j: usize| scheme.position[l * points + j];
        let inverse = &problem.inertia.inverse;
        self.matrix.values.fill(0.0);
        for l in 0..points {
            let weights: Vec<(f64, f64)> = (0..points)
                .map(|j| {
                    let twice: f64 = (0..points).map(|k| once(l, k) * once(k, j)).sum();
                    (h * h * twice, h * once(l, j))
                })
                .collect();
            let range = l * n..(l + 1) * n;
            let [z, q, force] = &mut self.gradient;
            let mut entries = self.pattern.scatter(&mut self.derivatives);
            let time = t + h * scheme.nodes[l];
            let first = Gradient { z, q, force };
            model.second(
                time,
                &self.q[range.clone()],
                &self.z[range],
                first,
                &mut entries,
            );
            for (part, derivative) in self.parts.iter().zip(&self.derivatives) {
                let Some(part) = part else { continue };
                for (j, (twice, once)) in weights.iter().enumerate() {
                    let weight = match (part.by_z, M::FORM) {
                        (false, _) => twice * inverse[part.column],
                        (true, Form::Lagrangian) => once * inverse[part.column],
                        (true, Form::Hamiltonian) => *once,
                    };
                    let at = part.place.first + j * part.place.stride + l;
                    self.matrix.values[at] -= part.sign * weight * derivative;
                }
            }
        }
        for place in &self.diagonal {
            for l in 0..points {
                self.matrix.values[place.first + l * (place.stride + 1)] += 1.0;
            }
        }
        self.matrix.factor()?;
        self.step = h;
        Ok(())
    }

    /// Replaces the residual by the increment.
    pub(super) fn solve(&mut self) {
        self.matrix.solve(&mut self.rest);
    }

    /// Declares the factors out of date.
    pub(super) fn forget(&mut self) {
        self.matrix.forget();
    }
}
