//! Steppers whose steps can be cut at kinks, and what arcs of a step have in common.

use crate::cut::{Halving, Instant};
use crate::error::StepError;
use alloc::vec::Vec;

/// An arc shorter than this, relative to the step, only moves the state to the other side of a root nearby.
pub(super) const SHORTEST: f64 = 1e-6;

/// How far beyond an arc its polynomial is used, relative to the length of the arc.
pub(super) const BEYOND: f64 = 1e-3;

/// A stepper whose elements can be evaluated inside.
pub(crate) trait Kinked:
    Halving<State: Clone, Kicks = Vec<<Self as Halving>::Kick>>
{
    /// Dense output of one step.
    type Inside;

    /// Dense output of the last step.
    fn inside(&self) -> Self::Inside;

    /// The state inside a step, or slightly beyond its end.
    fn at(&self, inside: &Self::Inside, tau: f64) -> Self::State;

    /// Makes the next step start without continuing the last polynomial.
    fn forget(&mut self);

    /// Appends the values of all switching functions; false, with nothing appended, where the velocity that they need
    /// does not exist.
    fn switches(&mut self, t: f64, state: &Self::State, values: &mut Vec<f64>) -> bool;

    /// The number of points of an element, and whether something with branches is evaluated at its ends.
    fn points(&self) -> (usize, bool);

    /// Counts a crossing of a kink, at the end of the last piece: the root of a switching function, given by its index.
    fn crossed(&mut self, switch: usize);

    /// Called after a piece that leads over such a root.
    fn stepped_over(&mut self) {}

    /// Whether constraints have branches.
    fn has_constraint_kinks(&self) -> bool;

    /// The end of a piece moved along its polynomial by a small part of its length.
    fn ahead(&self, inside: &Self::Inside, part: f64, end: &Self::State) -> Self::State;

    /// Says whether the next step begins shortly behind a kink of constraints, where it may have a velocity that they only
    /// allowed before.
    fn begin_behind(&mut self, is_behind: bool);

    /// Whether steps that fail are cut, whether or not there are kinks.
    fn cuts(&self) -> bool;

    /// With `all`, accept any root to which an iteration converges.
    fn trust(&mut self, all: bool);
}

/// The trials that all arcs of a step have taken.
#[derive(Default)]
pub(super) struct Effort {
    pub(super) trials: usize,
    /// Why the first failing arc failed.
    pub(super) failed: Option<StepError>,
}

/// Whether something acts after a time.
pub(super) fn is_later<K: Instant>(kick: &K, time: f64, h: f64) -> bool {
    if h > 0.0 {
        kick.time() >= time
    } else {
        kick.time() <= time
    }
}
