//! What a stepper carries from step to step.

use super::piece::{Ahead, Piece};
use super::setup::Stepper;
use crate::constrained::Foreseen;
use crate::element::{Element, ElementError};
use crate::method::{Impulse, Memory};
use crate::model::Model;
use crate::newton::Control;
use crate::points::Points;
use crate::propagator::Propagator;
use crate::registers::storage::Heap;
use crate::scheme::{SchemeTable, Tables};
use crate::share::Share;
use crate::statistics::Statistics;
use alloc::vec::Vec;

/// All that a stepper carries from step to step, without its model: with it the next step is the same to the last bit.
#[derive(Clone, Debug)]
pub struct Suspended<const N: usize> {
    element: Element,
    memory: Memory<N>,
    numbers: Vec<f64>,
    pivots: Vec<usize>,
    impulses: Vec<Impulse<N>>,
    ends_only: bool,
    propagator: Option<Propagator<N>>,
    points: Option<Points<N, Heap>>,
    alike: (f64, usize),
    skipped: bool,
    pieces: Vec<Piece<N>>,
    ahead: Option<Ahead<N>>,
    passes_node: bool,
}

impl<const N: usize> Suspended<N> {
    /// The element of the stepper.
    #[must_use]
    pub fn element(&self) -> Element {
        self.element
    }
}

impl<'m, M, const N: usize> Stepper<'m, M, N>
where
    M: Model<N>,
{
    /// Leaves the model.
    #[must_use]
    pub fn suspend(self) -> Suspended<N> {
        Suspended {
            element: self.table.element(),
            memory: self.memory,
            numbers: self.numbers,
            pivots: self.pivots,
            impulses: self.impulses,
            ends_only: self.ends_only,
            propagator: self.propagator,
            points: self.points,
            alike: self.alike,
            skipped: self.skipped,
            pieces: self.pieces,
            ahead: self.ahead,
            passes_node: self.passes_node,
        }
    }

    /// A stepper that goes on where another one was [suspended](Self::suspend), with nothing counted yet.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn resume(
        model: Share<'m, M>,
        control: Control,
        suspended: Suspended<N>,
    ) -> Result<Self, ElementError> {
        let mut memory = suspended.memory;
        memory.statistics = Statistics::NONE;
        Ok(Self {
            model,
            table: SchemeTable::new(suspended.element)?,
            control,
            memory,
            numbers: suspended.numbers,
            pivots: suspended.pivots,
            impulses: suspended.impulses,
            ends_only: suspended.ends_only,
            propagator: suspended.propagator,
            points: suspended.points,
            alike: suspended.alike,
            weights: None,
            is_of_points: false,
            skipped: suspended.skipped,
            pieces: suspended.pieces,
            ahead: suspended.ahead,
            passes_node: suspended.passes_node,
            at_kinks: false,
            solve: control.solve,
            foreseen: Foreseen::default(),
            extra: Vec::new(),
            backwards: None,
        })
    }
}
