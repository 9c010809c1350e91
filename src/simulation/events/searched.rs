//! The run in which events are looked for, without the type of its model: the search is compiled once for a number of
//! coordinates, and not for every model.

use super::model::EventModel;
use crate::length::Length;
use tfe_runtime::dual::Dual;
use tfe_runtime::enclosure::Enclosure;
use tfe_runtime::step::Impulse;

/// A run in which events are looked for.
pub(in crate::simulation) trait Searched<const N: usize, L: Length<N>> {
    /// The model with the parameters set by events so far.
    fn model(&self) -> &dyn EventModel<N, L>;

    /// Makes the model with other values of parameters, given by their indices; false if they cannot be set.
    fn remodel(&mut self, values: &[(usize, f64)]) -> bool;

    /// The model made last, unless the run has continued with it; otherwise the current one.
    fn next_model(&self) -> &dyn EventModel<N, L>;

    /// Appends bounds of coordinates and velocities (momenta) over the last element; false if there are none.
    fn reach(&mut self, bounds: &mut Vec<(f64, f64)>) -> bool;

    /// Whether such bounds contain the last element.
    fn reaches_within(&mut self, bounds: &[(f64, f64)]) -> bool;

    /// Bounds of all outputs over a box of time, coordinates and velocities (momenta); false if there are none.
    fn outputs_within(&self, bounds: &[Enclosure], values: &mut [Enclosure]) -> bool;

    /// Bounds of all outputs over a piece of an element.
    fn outputs_along(&self, piece: &L::Polynomial, values: &mut [Enclosure]);

    /// The same over the part between two fractions of its length, with derivatives by this fraction.
    fn outputs_over(&self, piece: &L::Polynomial, part: (f64, f64), values: &mut [Dual<Enclosure>]);

    /// Solves an element, given by start and length, with a stepper that is separate from that of the run; returns the
    /// state at its end, and its polynomial between `nodes`. `None` if it cannot be solved.
    fn solved(
        &mut self,
        element: (f64, f64),
        before: &L::State,
        impulses: &[Impulse<N>],
        nodes: (f64, f64),
    ) -> Option<(L::State, L::Polynomial)>;
}
