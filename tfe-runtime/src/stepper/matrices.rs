//! Derivatives of the last step by its start and by parameters, in forward and in adjoint mode.

use super::setup::Stepper;
use crate::backwards::are_parameters;
use crate::condense::{Direction, add_multiple};
use crate::error::{ConstraintError, StepError, TransitionError};
use crate::inside::{InsideLoss, InsideSlopes};
use crate::method::{Impulse, Memory, Method};
use crate::model::Model;
use crate::scheme::{SchemeTable, Tables};
use crate::workspace::{Workspace, linearised_len};
use alloc::vec;
use alloc::vec::Vec;

/// The chain rule: multiplies rows of derivatives, by the start of a piece and by directions, by those of the pieces
/// before. All have the columns of the whole step.
fn chain(columns: usize, (rows, before): (&[f64], &[f64]), chained: &mut [f64]) {
    let width = before.len() / columns;
    let rows = rows.chunks_exact(columns);
    for (row, sums) in rows.zip(chained.chunks_exact_mut(columns)) {
        for (column, sum) in sums.iter_mut().enumerate() {
            let own = if column < width { 0.0 } else { row[column] };
            let through = (0..width).map(|k| row[k] * before[k * columns + column]);
            *sum = through.sum::<f64>() + own;
        }
    }
}

/// A matrix, given by rows, times one with as many rows as told.
pub(super) fn product(rows: &[f64], (inner, matrix): (usize, &[f64])) -> Vec<f64> {
    let columns = matrix.len() / inner;
    let mut product = vec![0.0; rows.len() / inner * columns];
    for (row, sums) in rows
        .chunks_exact(inner)
        .zip(product.chunks_exact_mut(columns))
    {
        for (factor, one) in row.iter().zip(matrix.chunks_exact(columns)) {
            add_multiple(sums, *factor, one);
        }
    }
    product
}

/// Writes the matrix of a step to where it was asked for.
fn write(found: &[f64], matrix: &mut [f64]) -> Result<(), TransitionError> {
    let (needed, given) = (found.len(), matrix.len());
    let Some(matrix) = matrix.get_mut(..needed) else {
        return Err(TransitionError::Shape { needed, given });
    };
    matrix.copy_from_slice(found);
    Ok(())
}

/// Adds the direct derivatives by the start of a loss that depends on the inside.
fn add_start(inside: Option<&InsideLoss>, lambda: &mut [f64]) {
    if let Some(InsideLoss { start, .. }) = inside {
        add_multiple(lambda, 1.0, start);
    }
}

impl<M, const N: usize> Stepper<'_, M, N>
where
    M: Model<N>,
{
    /// Writes the transition matrix of the last step, 2N × 2N, row by row, ordered (p, q).
    ///
    /// # Errors
    /// [`TransitionError`] if there is no last step, its tangent
    /// is singular, or `matrix` is too short.
    pub fn transition(&mut self, matrix: &mut [f64]) -> Result<(), TransitionError> {
        self.linearise(&[], matrix)
    }

    /// Writes the derivative of the end of the last step by its start and by g directions, 2N × (2N + g), row by row,
    /// the first columns and all rows ordered (p, q).
    ///
    /// Impulses stay at their times; the crossings of kinks at which the step was cut move with the motion.
    ///
    /// # Errors
    /// As [`transition`](Self::transition).
    pub fn linearise(
        &mut self,
        directions: &[Direction],
        matrix: &mut [f64],
    ) -> Result<(), TransitionError> {
        self.linearise_all(directions, matrix, None)
    }

    /// The same, with the derivatives of the polynomial of the step, or of each of its
    /// [pieces](crate::step::DenseElement::pieces), with the same columns.
    ///
    /// # Errors
    /// As [`transition`](Self::transition).
    pub fn linearise_inside(
        &mut self,
        directions: &[Direction],
        matrix: &mut [f64],
        inside: &mut Vec<InsideSlopes>,
    ) -> Result<(), TransitionError> {
        inside.clear();
        self.linearise_all(directions, matrix, Some(inside))
    }

    fn linearise_all(
        &mut self,
        directions: &[Direction],
        matrix: &mut [f64],
        mut inside: Option<&mut Vec<InsideSlopes>>,
    ) -> Result<(), TransitionError> {
        if self.common.carried.passes_node {
            // Where the rank of the constraints changes, the tangent of the motion is undetermined.
            return Err(StepError::from(ConstraintError::RankChanged).into());
        }
        if self.common.carried.pieces.is_empty() && inside.is_none() {
            return self.linearise_last(directions, matrix, None);
        }
        if self.has_arcs() {
            let ends = self.linearise_arcs(directions, inside)?;
            return write(&ends, matrix);
        }
        let width = 2 * N;
        let columns = width + directions.len();
        let needed = width * columns;
        let mut product = vec![0.0; needed];
        for row in 0..width {
            product[row * columns + row] = 1.0;
        }
        let (mut factor, mut next) = (vec![0.0; needed], vec![0.0; needed]);
        // The last piece leaves the stepper as the step has left it.
        for piece in 0..self.common.carried.pieces.len().max(1) {
            let mut own = directions.to_vec();
            if !self.common.carried.pieces.is_empty() {
                own = self.common.of_piece(directions, piece);
                self.common.recall(piece);
            }
            let mut coefficients = Vec::new();
            let asked = inside.is_some().then_some(&mut coefficients);
            self.linearise_last(&own, &mut factor, asked)?;
            if let Some(inside) = &mut inside {
                if piece > 0 {
                    let own = coefficients.clone();
                    chain(columns, (&own, &product), &mut coefficients);
                }
                inside.push(InsideSlopes {
                    start: product.clone(),
                    coefficients,
                    ends: [Vec::new(), Vec::new()],
                });
            }
            if self.common.carried.pieces.is_empty() {
                core::mem::swap(&mut product, &mut factor);
                break;
            }
            chain(columns, (&factor, &product), &mut next);
            core::mem::swap(&mut product, &mut next);
        }
        write(&product, matrix)
    }

    /// Multiplies the matrix of [`linearise`](Self::linearise) by the row `lambda`, 2N numbers ordered (p, q), from the
    /// left: the result for the columns of the start replaces `lambda`, that for the directions is added to
    /// `by_direction`. Without constraints the cost does not grow with the number of directions, except for their
    /// explicit derivatives.
    ///
    /// # Errors
    /// As [`transition`](Self::transition).
    pub fn adjoint(
        &mut self,
        directions: &[Direction],
        lambda: &mut [f64],
        by_direction: &mut [f64],
    ) -> Result<(), TransitionError> {
        self.adjoint_inside(directions, &[], lambda, by_direction)
    }

    /// The same for a loss that depends on the inside of the step: `inside` has its derivatives by the polynomial, or
    /// by that of each of its [pieces](crate::step::DenseElement::pieces); empty if it does not depend on them.
    ///
    /// # Errors
    /// As [`transition`](Self::transition); [`TransitionError::Shape`] if their number differs from that of the pieces.
    pub fn adjoint_inside(
        &mut self,
        directions: &[Direction],
        inside: &[InsideLoss],
        lambda: &mut [f64],
        by_direction: &mut [f64],
    ) -> Result<(), TransitionError> {
        if self.common.carried.passes_node {
            return Err(StepError::from(ConstraintError::RankChanged).into());
        }
        let (needed, given) = (self.common.carried.pieces.len().max(1), inside.len());
        if !inside.is_empty() && given != needed {
            return Err(TransitionError::Shape { needed, given });
        }
        if self.common.carried.pieces.is_empty() {
            return self.adjoint_of_last(directions, inside.first(), lambda, by_direction);
        }
        if self.has_arcs() {
            return self.adjoint_of_arcs(directions, inside, (lambda, by_direction));
        }
        for piece in (0..self.common.carried.pieces.len()).rev() {
            let own = self.common.of_piece(directions, piece);
            self.common.recall(piece);
            self.adjoint_of_last(&own, inside.get(piece), lambda, by_direction)?;
        }
        // Returns the stepper to where the step has left it.
        self.common.recall(self.common.carried.pieces.len() - 1);
        Ok(())
    }

    pub(super) fn linearise_last(
        &mut self,
        directions: &[Direction],
        matrix: &mut [f64],
        inside: Option<&mut Vec<f64>>,
    ) -> Result<(), TransitionError> {
        self.of_last(
            directions,
            |method, memory, workspace, extra, given| match inside {
                None => method.linearise(memory, workspace, extra, given, matrix),
                Some(inside) => {
                    method.linearise_inside(memory, workspace, extra, given, (matrix, inside))
                }
            },
        )
    }

    fn adjoint_of_last(
        &mut self,
        directions: &[Direction],
        inside: Option<&InsideLoss>,
        lambda: &mut [f64],
        by_direction: &mut [f64],
    ) -> Result<(), TransitionError> {
        let is_free = M::CONSTRAINTS.is_empty();
        if !(is_free && (directions.is_empty() || are_parameters(&*self.model, directions))) {
            self.of_last(directions, |method, memory, workspace, extra, given| {
                let sums = (inside, &mut *lambda, by_direction);
                method.adjoint_inside(memory, workspace, extra, given, sums)
            })?;
            add_start(inside, lambda);
            return Ok(());
        }
        let mut backwards = self.common.backwards.take().unwrap_or_default();
        backwards.begin(match directions {
            [] => 0,
            _ => self.model.parameters(),
        });
        let done = self.of_last(&[], |method, memory, workspace, extra, given| {
            let sums = (inside, &mut *lambda, &mut *backwards);
            method.adjoint_at_once(memory, workspace, extra, given.0, sums)
        });
        if done.is_ok() {
            add_start(inside, lambda);
            backwards.add_to(&*self.model, directions, by_direction);
        }
        self.common.backwards = Some(backwards);
        done
    }

    /// Differentiates the last step with what is known of it.
    fn of_last(
        &mut self,
        directions: &[Direction],
        differentiate: impl FnOnce(
            Method<'_, M, SchemeTable>,
            &mut Memory<N>,
            Workspace<'_>,
            &mut [f64],
            (&[Impulse<N>], &[Direction]),
        ) -> Result<(), TransitionError>,
    ) -> Result<(), TransitionError> {
        let element = self.common.table.element();
        let constraints = M::CONSTRAINTS.len();
        let length = linearised_len(element, M::FORM, N, constraints, directions.len());
        if self.common.extra.len() == length {
            self.common.extra.fill(0.0);
        } else {
            self.common.extra = vec![0.0; length];
        }
        self.common.make_room();
        self.look_inside();
        if let Some(numbers) = self.retrace()? {
            self.common.carried.memory.forget_workspace();
            self.common.carried.numbers = numbers;
            self.common.carried.skipped = false;
        }
        let workspace = Workspace {
            numbers: &mut self.common.carried.numbers,
            pivots: &mut self.common.carried.pivots,
        };
        let method = Method {
            model: &*self.model,
            tables: &self.common.table,
            control: self.common.control,
        };
        let given = (self.common.carried.impulses.as_slice(), directions);
        differentiate(
            method,
            &mut self.common.carried.memory,
            workspace,
            &mut self.common.extra,
            given,
        )
    }
}
