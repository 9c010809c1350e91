//! Derivatives of steps that are made of arcs between kinks, whose times change (T-167).

use super::matrices::product;
use super::piece::{Ends, Piece};
use super::setup::Stepper;
use crate::condense::{Direction, add_multiple, check_sums};
use crate::error::{StepError, TransitionError};
use crate::inside::{InsideLoss, InsideSlopes};
use crate::kinks::{Change, Root};
use crate::model::{Model, State};
use alloc::vec;
use alloc::vec::Vec;

/// What the derivatives of a piece are multiplied by: the changes of its start (p, q), of the directions themselves, and of
/// the times of its start and its end, a row for each, by the start of the step and by directions.
struct Before<const N: usize> {
    columns: usize,
    rows: Vec<f64>,
}

impl<const N: usize> Before<N> {
    /// At the start of a step.
    fn new(directions: &[Direction]) -> Self {
        let columns = 2 * N + directions.len();
        let mut rows = vec![0.0; (columns + 2) * columns];
        for row in 0..columns {
            rows[row * columns + row] = 1.0;
        }
        let mut before = Self { columns, rows };
        before
            .start()
            .copy_from_slice(&moved(directions, 2 * N, 0.0));
        before
    }

    fn row(&mut self, row: usize) -> &mut [f64] {
        &mut self.rows[row * self.columns..][..self.columns]
    }

    /// The changes of the time of the start of the piece.
    fn start(&mut self) -> &mut [f64] {
        self.row(self.columns)
    }

    /// The changes of the time of its end.
    fn end(&mut self) -> &mut [f64] {
        self.row(self.columns + 1)
    }

    /// The changes of its start, 2N rows.
    fn state(&self) -> &[f64] {
        &self.rows[..2 * N * self.columns]
    }

    /// Rows of derivatives by all these.
    fn through(&self, rows: &[f64]) -> Vec<f64> {
        product(rows, (self.columns + 2, &self.rows))
    }

    /// Continues behind the piece, from the changes of its end.
    fn pass(&mut self, state: &[f64]) {
        self.rows[..state.len()].copy_from_slice(state);
        let end = self.end().to_vec();
        self.start().copy_from_slice(&end);
    }
}

/// The changes of the time after a part of a step, by the numbers of its start and by directions.
fn moved(directions: &[Direction], numbers: usize, part: f64) -> Vec<f64> {
    let mut moved = vec![0.0; numbers];
    moved.extend(directions.iter().map(|one| one.time + part * one.length));
    moved
}

impl<M, const N: usize> Stepper<'_, M, N>
where
    M: Model<N>,
{
    /// Whether the last step was cut at roots of switching functions.
    pub(super) fn has_arcs(&self) -> bool {
        let is_arc = |piece: &Piece<N>| piece.ends != Ends::Still;
        self.common.carried.pieces.iter().any(is_arc)
    }

    /// As [`linearise`](Self::linearise) and [`linearise_inside`](Self::linearise_inside), for a step with arcs: at the end
    /// y(s) of an arc, where g = 0,
    ///
    /// ```text
    /// δs = −(g_y δy + g_a δa) / ġ ,     δy* = δy + ẏ δs ,                                             (T-167)
    /// ```
    ///
    /// with δy at a fixed time s; the next arc starts at the changed time.
    pub(super) fn linearise_arcs(
        &mut self,
        directions: &[Direction],
        mut inside: Option<&mut Vec<InsideSlopes>>,
    ) -> Result<Vec<f64>, TransitionError> {
        let mut before = Before::<N>::new(directions);
        let mut factor = vec![0.0; 2 * N * (before.columns + 2)];
        for number in 0..self.common.carried.pieces.len() {
            self.common.recall(number);
            let mut coefficients = Vec::new();
            let asked = inside.is_some().then_some(&mut coefficients);
            let own = self.own_directions(number, directions, &mut before);
            self.linearise_last(&own, &mut factor, asked)?;
            let times = self.times_of_end(number, directions, (&mut before, &factor))?;
            before.end().copy_from_slice(&times);
            if let Some(inside) = &mut inside {
                inside.push(InsideSlopes {
                    start: before.state().to_vec(),
                    coefficients: before.through(&coefficients),
                    ends: [before.start().to_vec(), times],
                });
            }
            let state = before.through(&factor);
            before.pass(&state);
        }
        Ok(before.state().to_vec())
    }

    /// The directions of a piece: those of the step at fixed times, and the motions of its start and its end, if they
    /// move: impulses have a place in the element that may not.
    fn own_directions(
        &self,
        number: usize,
        directions: &[Direction],
        before: &mut Before<N>,
    ) -> Vec<Direction> {
        let still = directions.iter().map(|direction| Direction {
            time: 0.0,
            length: 0.0,
            ..*direction
        });
        let moves = |times: &[f64]| times.iter().any(|time| *time != 0.0);
        let pieces = &self.common.carried.pieces;
        let starts = moves(before.start());
        let ends = moves(&moved(directions, 2 * N, 1.0))
            || number + 1 < pieces.len()
                && (starts || matches!(pieces[number].ends, Ends::Root(_)));
        let only = |moves, direction| {
            if moves {
                direction
            } else {
                Direction::default()
            }
        };
        still
            .chain([only(starts, Direction::START), only(ends, Direction::END)])
            .collect()
    }

    /// The changes of the time of the end of a piece, whose derivatives are `factor`.
    fn times_of_end(
        &self,
        number: usize,
        directions: &[Direction],
        (before, factor): (&mut Before<N>, &[f64]),
    ) -> Result<Vec<f64>, TransitionError> {
        let pieces = &self.common.carried.pieces;
        let end = moved(directions, 2 * N, 1.0);
        if number + 1 == pieces.len() {
            return Ok(end);
        }
        let start = before.start().to_vec();
        match pieces[number].ends {
            Ends::Root(switch) => {
                before.end().fill(0.0);
                self.times_of_root((number, switch), directions, (before, factor))
            }
            Ends::Behind => Ok(start),
            // A part of what was left of the step.
            Ends::Still => {
                let part = self.common.part_of_rest(number);
                let times = start.iter().zip(&end);
                Ok(times
                    .map(|(start, end)| start + part * (end - start))
                    .collect())
            }
        }
    }

    /// The changes of the time of a root at the end of a piece, whose derivatives are `factor`; the end of `before` is
    /// still.
    fn times_of_root(
        &self,
        (number, switch): (usize, usize),
        directions: &[Direction],
        (before, factor): (&Before<N>, &[f64]),
    ) -> Result<Vec<f64>, TransitionError> {
        let last = self.common.carried.pieces[number].last;
        let root = Root::new(&*self.model, (last.t + last.h, last.end), switch)?;
        let (columns, state) = (before.columns, before.through(factor));
        let change = |t: f64, parameter, entry: &dyn Fn(usize) -> f64| Change {
            t,
            state: State {
                p: core::array::from_fn(entry),
                q: core::array::from_fn(|a| entry(N + a)),
            },
            parameter,
        };
        let rate = change(1.0, None, &|row| factor[row * (columns + 2) + columns + 1]);
        let slope = root.along(&rate);
        let time = |column: usize| {
            let direction = column.checked_sub(2 * N).map(|at| &directions[at]);
            let parameter = direction.and_then(|one| one.parameter?.any(&*self.model));
            let change = change(0.0, parameter, &|row| state[row * columns + column]);
            -root.along(&change) / slope
        };
        let times: Vec<f64> = (0..columns).map(time).collect();
        match times.iter().all(|time| time.is_finite()) {
            true => Ok(times),
            false => Err(StepError::NonFinite.into()),
        }
    }

    /// As [`adjoint_inside`](Self::adjoint_inside), for a step with arcs: by the matrix, which takes a solution for each of
    /// its columns.
    pub(super) fn adjoint_of_arcs(
        &mut self,
        directions: &[Direction],
        inside: &[InsideLoss],
        (lambda, by_direction): (&mut [f64], &mut [f64]),
    ) -> Result<(), TransitionError> {
        check_sums::<N>(directions, lambda, by_direction)?;
        let mut slopes = Vec::new();
        let asked = (!inside.is_empty()).then_some(&mut slopes);
        let matrix = self.linearise_arcs(directions, asked)?;
        let mut sums = product(lambda, (2 * N, &matrix));
        for (loss, slopes) in inside.iter().zip(&slopes) {
            slopes.add_to(loss, &mut sums);
        }
        let (by_start, others) = sums.split_at(2 * N);
        lambda.copy_from_slice(by_start);
        add_multiple(by_direction, 1.0, others);
        Ok(())
    }
}
