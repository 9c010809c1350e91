//! Newton's method for families: the element's equations by a sparse factorisation.
//!
//! The unknowns are the forces at all points, what is left of them is r = f(q(f), z(f)) − f, and with K = ∂f/∂q and C = ∂f/∂z at each point
//!
//! ```text
//! T = 1 − h² A²_lj K_l M⁻¹ − h A_lj C_l M⁻¹ ,     f ← f + T⁻¹ r
//! ```
//!
//! (C without M⁻¹ where z is the momentum). Places are known from the indices of the sums; ordering and symbolic factorisation are done once, the
//! numeric factorisation only when the old one serves no longer.

use super::space::Problem;
use super::{Block, FamilyModel, Gradient, Pattern};
use crate::error::StepError;
use crate::model::Form;
use crate::scheme::SchemeRef;
use alloc::vec;
use alloc::vec::Vec;
use core::fmt;
use faer::linalg::solvers::Solve as _;
use faer::sparse::linalg::solvers::{Lu, SymbolicLu};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMat};

/// A place of second derivatives in the tangent.
#[derive(Clone, Copy, Debug)]
struct Part {
    /// Where the entry of points (0, 0) stands.
    first: usize,
    /// From one column of a point to the next.
    stride: usize,
    column: usize,
    /// The sign with which it enters the force, and whether by velocities.
    sign: f64,
    by_z: bool,
}

/// The tangent of an element and its factors. Unknowns are ordered by coordinate, the points of one next to each other.
#[derive(Clone)]
pub(super) struct Tangent {
    pattern: Pattern,
    parts: Vec<Option<Part>>,
    points: usize,
    structure: SymbolicSparseColMat<usize>,
    symbolic: SymbolicLu<usize>,
    diagonal: Vec<usize>,
    values: Vec<f64>,
    derivatives: Vec<f64>,
    factors: Option<Lu<usize, f64>>,
    /// The step that the factors belong to.
    step: f64,
    /// Coordinates, velocities (momenta) at all points, a row of n each.
    pub(super) q: Vec<f64>,
    pub(super) z: Vec<f64>,
    /// What is left of the equations; what is added to the forces.
    pub(super) rest: Vec<f64>,
    gradient: [Vec<f64>; 3],
}

impl fmt::Debug for Tangent {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Tangent")
            .field("unknowns", &self.diagonal.len())
            .field("entries", &self.values.len())
            .finish_non_exhaustive()
    }
}

impl Tangent {
    /// Finds the places and orders them; nothing where memory does not suffice.
    pub(super) fn new<M: FamilyModel>(model: &M, points: usize) -> Option<Self> {
        let n = model.len();
        let pattern = Pattern::of(model);
        let enters = |block: &Block| matches!(block, Block::QQ | Block::ForceQ | Block::ForceZ);
        let mut pairs: Vec<(usize, usize)> = pattern
            .places()
            .iter()
            .filter(|(block, ..)| enters(block))
            .map(|(_, row, column)| (*column, *row))
            .chain((0..n).map(|a| (a, a)))
            .collect();
        pairs.sort_unstable();
        pairs.dedup();
        let starts: Vec<usize> = (0..=n)
            .map(|column| pairs.partition_point(|(other, _)| *other < column))
            .collect();
        let rows_of = |column: usize| starts[column + 1] - starts[column];
        let (mut column_starts, mut rows) = (vec![0], Vec::new());
        for column in 0..n {
            for _ in 0..points {
                for (_, row) in &pairs[starts[column]..starts[column + 1]] {
                    rows.extend((0..points).map(|l| row * points + l));
                }
                column_starts.push(rows.len());
            }
        }
        let first = |row: usize, column: usize| {
            let at = pairs.binary_search(&(column, row)).unwrap_or(0);
            starts[column] * points * points + (at - starts[column]) * points
        };
        let sign = |block: &Block| match (M::FORM, block) {
            (Form::Hamiltonian, Block::QQ) => -1.0,
            _ => 1.0,
        };
        let part = |(block, row, column): &(Block, usize, usize)| {
            enters(block).then(|| Part {
                first: first(*row, *column),
                stride: rows_of(*column) * points,
                column: *column,
                sign: sign(block),
                by_z: *block == Block::ForceZ,
            })
        };
        let parts = pattern.places().iter().map(part).collect();
        let diagonal = (0..n * points)
            .map(|k| {
                let (a, l) = (k / points, k % points);
                first(a, a) + l * rows_of(a) * points + l
            })
            .collect();
        let entries = rows.len();
        let size = n * points;
        let structure = SymbolicSparseColMat::new_checked(size, size, column_starts, None, rows);
        let symbolic = SymbolicLu::try_new(structure.as_ref()).ok()?;
        Some(Self {
            derivatives: vec![0.0; pattern.places().len()],
            pattern,
            parts,
            points,
            structure,
            symbolic,
            diagonal,
            values: vec![0.0; entries],
            factors: None,
            step: f64::NAN,
            q: vec![0.0; size],
            z: vec![0.0; size],
            rest: vec![0.0; size],
            gradient: [vec![0.0; n], vec![0.0; n], vec![0.0; n]],
        })
    }

    /// Whether there are factors of a step of this length.
    pub(super) fn serves(&self, h: f64) -> bool {
        self.factors.is_some() && self.step == h
    }

    /// Factors the tangent at the coordinates and velocities `q` and `z`.
    ///
    /// # Errors
    /// [`StepError::NonFinite`], [`StepError::SingularTangent`]; the unknown at which elimination stopped is not told, and stands as the first.
    pub(super) fn factor<M: FamilyModel>(
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
        self.values.fill(0.0);
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
                    let at = part.first + j * part.stride + l;
                    self.values[at] -= part.sign * weight * derivative;
                }
            }
        }
        for at in &self.diagonal {
            self.values[*at] += 1.0;
        }
        self.factors = None;
        if !self.values.iter().all(|value| value.is_finite()) {
            return Err(StepError::NonFinite);
        }
        let matrix = SparseColMatRef::new(self.structure.as_ref(), &self.values);
        let factors = Lu::try_new_with_symbolic(self.symbolic.clone(), matrix);
        self.factors = Some(factors.map_err(|_| StepError::SingularTangent { unknown: 0 })?);
        self.step = h;
        Ok(())
    }

    /// From what is left to what is to be added.
    pub(super) fn solve(&mut self) {
        if let Some(factors) = &self.factors {
            let rest = faer::ColMut::from_slice_mut(&mut self.rest);
            factors.solve_in_place(rest.as_mat_mut());
        }
    }

    /// Says that the factors serve no longer.
    pub(super) fn forget(&mut self) {
        self.factors = None;
    }
}
