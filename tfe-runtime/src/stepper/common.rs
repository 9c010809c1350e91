//! What steppers of all models with one number of coordinates have in common.

use super::carried::Carried;
use super::piece::{Ends, Piece};
use crate::backwards::Backwards;
use crate::condense::Direction;
use crate::constrained::Foreseen;
use crate::constrained::trail::Of;
use crate::control::{Control, Solve};
use crate::dense::DenseElement;
use crate::error::StepError;
use crate::method::{Impulse, Interval, Last};
use crate::model::{Form, Model, State};
use crate::points::reach::Weights;
use crate::scheme::{SchemeTable, Tables};
use crate::workspace::{interior_len, numbers_len, pivots_len, width};
use alloc::boxed::Box;
use alloc::vec;
use alloc::vec::Vec;

/// The facts about a model on which the memory of a step depends, and whether a step that fails is divided.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shape {
    form: Form,
    constraints: usize,
    pub(super) linear: bool,
}

impl Shape {
    pub(super) const fn of<M, const N: usize>() -> Self
    where
        M: Model<N>,
    {
        Self {
            form: M::FORM,
            constraints: M::CONSTRAINTS.len(),
            linear: M::FACTS.linear,
        }
    }
}

/// A stepper without its model: what is done with it alone is compiled for a number of coordinates, not for every
/// model.
#[derive(Debug)]
pub(super) struct Common<const N: usize> {
    pub(super) shape: Shape,
    pub(super) table: SchemeTable,
    pub(super) control: Control,
    pub(super) carried: Carried<N>,
    /// The weights for the reach of a step, computed on first use.
    pub(super) weights: Option<Weights>,
    /// Whether the last step was made with all points at once.
    pub(super) is_of_points: bool,
    /// Whether steps are cut at kinks, if there are any.
    pub(super) at_kinks: bool,
    /// Whether constraints have branches.
    pub(super) has_constraint_kinks: bool,
    /// The requested kind of iteration; the one in use may accept more roots.
    pub(super) solve: Solve,
    /// The initial guess of the next step from another run of the same motion.
    pub(super) foreseen: Foreseen,
    /// The memory that derivatives of the last step need in addition to its workspace.
    pub(super) extra: Vec<f64>,
    /// The memory of the adjoint of elements, once it has been used.
    pub(super) backwards: Option<Box<Backwards<N>>>,
}

// Not derived: the memory of derivatives is left out.
impl<const N: usize> Clone for Common<N> {
    fn clone(&self) -> Self {
        Self {
            shape: self.shape,
            table: self.table.clone(),
            control: self.control,
            carried: self.carried.clone(),
            weights: self.weights.clone(),
            is_of_points: self.is_of_points,
            at_kinks: self.at_kinks,
            has_constraint_kinks: self.has_constraint_kinks,
            solve: self.solve,
            foreseen: self.foreseen.clone(),
            extra: Vec::new(),
            backwards: None,
        }
    }
}

impl<const N: usize> Common<N> {
    /// Memory for Newton's method is allocated at once where steps with all points at once are not possible.
    pub(super) fn new(
        shape: Shape,
        table: SchemeTable,
        control: Control,
        carried: Carried<N>,
    ) -> Self {
        let mut common = Self {
            shape,
            table,
            control,
            carried,
            weights: None,
            is_of_points: false,
            at_kinks: false,
            has_constraint_kinks: false,
            solve: control.solve,
            foreseen: Foreseen::default(),
            extra: Vec::new(),
            backwards: None,
        };
        if common.carried.points.is_none() {
            common.make_room();
        }
        common
    }

    /// The control as it was requested.
    pub(super) fn control(&self) -> Control {
        Control {
            solve: self.solve,
            ..self.control
        }
    }

    /// Takes the place of the stepper of another model: options and counts are kept.
    pub(super) fn replaced_by(&mut self, mut other: Self) {
        (other.carried.ends_only, other.at_kinks) = (self.carried.ends_only, self.at_kinks);
        other.carried.memory.statistics = self.carried.memory.statistics;
        *self = other;
    }

    /// Allocates the tangent of an element on first use: it takes megabytes for thirty coordinates, and is not needed
    /// while the fixed-point iteration contracts.
    pub(super) fn make_room(&mut self) {
        if self.carried.numbers.is_empty() {
            (self.carried.numbers, self.carried.pivots) = self.room();
        }
    }

    pub(super) fn room(&self) -> (Vec<f64>, Vec<usize>) {
        let (
            element,
            Shape {
                form, constraints, ..
            },
        ) = (self.table.element(), self.shape);
        let numbers = numbers_len(element, form, N, constraints);
        let pivots = pivots_len(element, form, N, constraints);
        (vec![0.0; numbers], vec![0; pivots])
    }

    /// Writes the initial guess from another run to where the next step expects it, if there is one.
    pub(super) fn take_foreseen(&mut self, of: Of<'_>, step: (f64, f64)) {
        let (scheme, numbers) = (self.table.view(), &mut self.carried.numbers);
        self.carried.memory.is_foreseen = self.foreseen.take(&scheme, of, step, numbers);
    }

    /// The element of the last step, with its impulses.
    fn interval(&self, last: &Last<N>) -> Interval<'_, N> {
        Interval {
            start: last.t,
            length: last.h,
            impulses: &self.carried.impulses,
        }
    }

    /// The polynomial of the last step of a model without constraints, whose workspace may have been `retraced`.
    pub(super) fn dense_without_constraints(
        &self,
        retraced: Result<Option<Vec<f64>>, StepError>,
        spare: Option<DenseElement<N>>,
        times: (f64, f64),
    ) -> DenseElement<N> {
        let scheme = self.table.view();
        let Some(last) = self.carried.memory.last else {
            return DenseElement::constant(times.0, times.1, State::ZERO);
        };
        let Ok(retraced) = retraced else {
            return DenseElement::unknown(&scheme, times, &last);
        };
        let numbers = retraced.as_ref().unwrap_or(&self.carried.numbers);
        // The workspace begins with the unknowns, their start and the increments.
        let m = scheme.unknowns() * width(&scheme.element, self.shape.form, N);
        let unknowns = numbers[..m].as_chunks().0;
        let is_phase =
            matches!(self.shape.form, Form::Hamiltonian) && scheme.element.has_phase_form();
        let (rates, forces) = if is_phase {
            let (pi, kappa) = unknowns.split_at(scheme.points());
            (kappa, pi)
        } else {
            (
                unknowns,
                numbers[3 * m..3 * m + scheme.points() * N].as_chunks().0,
            )
        };
        let interval = self.interval(&last);
        DenseElement::of(&scheme, times, &last, rates, forces, &interval, spare)
    }

    /// The polynomial of the last step of a model with constraints.
    pub(super) fn dense_with_constraints(&self, times: (f64, f64)) -> DenseElement<N> {
        let scheme = self.table.view();
        let Some(last) = self.carried.memory.last else {
            return DenseElement::constant(times.0, times.1, State::ZERO);
        };
        let (
            numbers,
            Shape {
                form, constraints, ..
            },
        ) = (&self.carried.numbers, self.shape);
        let m = interior_len(&scheme.element, form, N, constraints);
        let points = scheme.points() * N;
        let momenta = &numbers[3 * m + points..3 * m + 2 * points];
        let rates = &numbers[..scheme.unknowns() * N];
        let (rates, momenta) = (rates.as_chunks().0, momenta.as_chunks().0);
        // Constraints take up a part of impulses at the ends, which is distributed like their own impulses there.
        let (mut start, mut end) = (last.start, last.end);
        let interval = self.interval(&last);
        for impulse in interval.impulses {
            let tau = interval.node_or_place(impulse);
            let impulse = impulse.along(interval.length);
            for a in 0..N {
                if tau == 0.0 {
                    start.p[a] += impulse[a];
                } else if tau == 1.0 {
                    end.p[a] -= impulse[a];
                }
            }
        }
        let ends = (&start, &end);
        let dense = DenseElement::constrained(&scheme, times, last.h, ends, rates, momenta);
        dense.ending_in(last.end)
    }

    /// Adds the last step, of which this is the polynomial, to the pieces of a step that is cut.
    pub(super) fn keep_piece(&mut self, dense: DenseElement<N>, impulses: Vec<Impulse<N>>) {
        debug_assert!(
            !self.carried.skipped,
            "steps of linear models have no pieces"
        );
        if let Some(last) = self.carried.memory.last {
            self.carried.pieces.push(Piece {
                last,
                ends: Ends::Still,
                impulses,
                dense,
                independence: self.carried.memory.independence,
                numbers: self.carried.numbers.clone(),
                pivots: self.carried.pivots.clone(),
            });
        }
    }

    /// Tells what determines the time of the end of the last piece.
    pub(super) fn last_piece_ends(&mut self, ends: Ends) {
        if let Some(piece) = self.carried.pieces.last_mut() {
            piece.ends = ends;
        }
    }

    /// Restores the stepper to the end of a piece of the last step.
    pub(super) fn recall(&mut self, piece: usize) {
        let piece = &self.carried.pieces[piece];
        self.carried.memory.last = Some(piece.last);
        self.carried.memory.forget_workspace();
        self.carried.numbers.clone_from(&piece.numbers);
        self.carried.pivots.clone_from(&piece.pivots);
        self.carried.impulses.clone_from(&piece.impulses);
        self.carried.skipped = false;
    }

    /// The length of the last step from the start of a piece on.
    fn length_from(&self, piece: usize) -> f64 {
        self.carried.pieces[piece..]
            .iter()
            .map(|one| one.last.h)
            .sum()
    }

    /// The length of a piece as a part of what is left of the step at its start.
    pub(super) fn part_of_rest(&self, piece: usize) -> f64 {
        self.carried.pieces[piece].last.h / self.length_from(piece)
    }

    /// The directions of a piece of the last step, as fractions of those of the whole step.
    pub(super) fn of_piece(&self, directions: &[Direction], piece: usize) -> Vec<Direction> {
        let (begin, length) = (self.carried.pieces[0].last.t, self.length_from(0));
        let Last { t, h, .. } = self.carried.pieces[piece].last;
        let own = |direction: &Direction| Direction {
            time: direction.time + (t - begin) / length * direction.length,
            length: h / length * direction.length,
            ..*direction
        };
        directions.iter().map(own).collect()
    }
}
