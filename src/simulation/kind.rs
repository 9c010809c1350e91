//! The interface between runs and the two kinds of length of models.

mod fixed;
mod run_time;

use super::mesh::{Grid, Mesh};
use super::watch::Watch;
use crate::error::RunErrorKind;
use crate::evaluate::Evaluate;
use crate::length::Length;
use crate::motion::{Motion, Node, Warning};
use std::ops::Range;
use tfe_runtime::Share;
use tfe_runtime::constrained::Trail;
use tfe_runtime::dual::Dual;
use tfe_runtime::enclosure::Enclosure;
use tfe_runtime::step::{Control, Impulse};
use tfe_runtime::{CoordinateName, Element, Facts, Form, InputFailure, Statistics, StepError};

/// The settings for the solution of elements.
#[derive(Clone, Copy, Debug)]
pub struct Chosen {
    pub(crate) element: Element,
    pub(crate) control: Control,
    /// Whether steps are cut at kinks of the force.
    pub(crate) at_kinks: bool,
}

/// A model that can be simulated: implemented for every [`Model`] and every [`family::Model`], and for nothing else.
/// Its methods are internal.
pub trait Simulated<const N: usize, L: Length<N>>: Evaluate<N, L> {
    /// The facts about the model known at compile time.
    const FACTS: Facts;
    /// Whether a search for an accuracy may solve elements by fixed-point iteration.
    const MAY_ITERATE: bool;
    /// Whether energy is conserved, so that jumps of it indicate steps that are too long.
    const CONSERVES: bool;

    /// The number of coordinates.
    fn coordinates(&self) -> usize;

    /// The number of outputs.
    fn output_count(&self) -> usize;

    /// Whether H is linear in the momenta: q̇ = f(q, t) does not depend on them, and ṗ = −(∂f/∂q)ᵀ p is its adjoint.
    fn is_of_first_order(&self, t: f64, start: &L::State) -> bool;

    /// The time of an impulse.
    fn time_of(impulse: &L::Impulse) -> f64;

    /// The impulses that act inside elements.
    fn inner(impulses: &[L::Impulse]) -> &[Impulse<N>];

    /// Appends the last element of a stepper to a trail, if this kind of model uses trails as first guesses.
    fn leave(stepper: &L::Stepper<'_, Self>, trail: &mut Trail);

    /// Takes the first guess for the next element, given by its start and length, from a trail.
    fn foresee(stepper: &mut L::Stepper<'_, Self>, trail: &Trail, step: (f64, f64));

    /// Sets the tolerance of the iterations from the next step on.
    fn set_tolerance(stepper: &mut L::Stepper<'_, Self>, tolerance: f64);

    /// The work of the steps since the last call.
    fn take_statistics(stepper: &mut L::Stepper<'_, Self>) -> Statistics;

    /// Refuses a start or impulses that do not fit the model. Lengths are checked first, before memory is allocated.
    ///
    /// # Errors
    /// What is wrong with them.
    fn check_start(&self, start: &L::State, impulses: &[L::Impulse]) -> Result<(), RunErrorKind>;

    /// Refuses a start that violates the constraints, for a first element given by start and length.
    ///
    /// # Errors
    /// The violation.
    fn check_first(&self, element: (f64, f64), start: &L::State) -> Result<(), RunErrorKind>;

    /// Divides a span into elements.
    ///
    /// # Errors
    /// What is wrong with the span, the step or the nodes.
    fn mesh(span: &Range<f64>, grid: &Grid<'_, L::Impulse>) -> Result<Mesh<N>, RunErrorKind>;

    /// Removes the impulses at the beginning of a continued run, which have acted already.
    fn leave_behind(impulses: &mut Vec<L::Impulse>, t: f64);

    /// The only node of a motion. Without a stepper the model is not evaluated, since its lengths may be inconsistent.
    fn first_node(
        &self,
        at: (f64, &L::State),
        stepper: Option<&mut L::Stepper<'_, Self>>,
    ) -> Motion<N, L>;

    /// Creates a stepper without first guesses.
    ///
    /// # Errors
    /// If the model cannot be solved with the element.
    fn stepper<'m>(
        model: Share<'m, Self>,
        chosen: Chosen,
    ) -> Result<L::Stepper<'m, Self>, RunErrorKind>
    where
        Self: 'm;

    /// Resumes a suspended stepper, or creates a new one if that had another element.
    ///
    /// # Errors
    /// As [`stepper`](Self::stepper).
    fn resumed<'m>(
        model: Share<'m, Self>,
        chosen: Chosen,
        suspended: L::Suspended,
    ) -> Result<L::Stepper<'m, Self>, RunErrorKind>
    where
        Self: 'm;

    /// Separates a stepper from its model.
    fn suspended(stepper: L::Stepper<'_, Self>) -> L::Suspended;

    /// Whether a suspended stepper belonged to this model, as far as that can be determined.
    fn is_that_of(&self, suspended: &L::Suspended) -> bool;

    /// A stepper that does not prepare polynomials inside elements.
    fn ends_only<'m>(stepper: L::Stepper<'m, Self>) -> L::Stepper<'m, Self>
    where
        Self: 'm;

    /// Refuses a start for which no velocity can be computed, if the run needs one.
    ///
    /// # Errors
    /// Why there is none.
    fn check_velocity(
        stepper: &mut L::Stepper<'_, Self>,
        at: (f64, &L::State),
    ) -> Result<(), RunErrorKind>;

    /// The element and how it is solved.
    fn chosen(stepper: &L::Stepper<'_, Self>) -> (Element, Control);

    /// Replaces the model by one with other parameters.
    ///
    /// # Errors
    /// As [`stepper`](Self::stepper).
    fn exchange<'m>(
        stepper: &mut L::Stepper<'m, Self>,
        model: Share<'m, Self>,
    ) -> Result<(), RunErrorKind>
    where
        Self: 'm;

    /// Advances a state over an element.
    ///
    /// # Errors
    /// Why the element could not be solved; the state is then unchanged.
    fn advance(
        stepper: &mut L::Stepper<'_, Self>,
        element: (f64, f64),
        state: &mut L::State,
        impulses: &[Impulse<N>],
    ) -> Result<(), StepError>;

    /// Appends bounds of the coordinates, then of the velocities (momenta of a Hamiltonian), over the last element;
    /// false if these would cost as much as its polynomial.
    fn reach(stepper: &mut L::Stepper<'_, Self>, bounds: &mut Vec<(f64, f64)>) -> bool;

    /// Whether such bounds contain coordinates and velocities over the last element; false if this is not proved.
    fn reaches_within(stepper: &mut L::Stepper<'_, Self>, bounds: &[(f64, f64)]) -> bool;

    /// Bounds of all outputs over a box of time, coordinates and velocities (momenta); false if there are none.
    fn outputs_within(&self, bounds: &[Enclosure], values: &mut [Enclosure]) -> bool;

    /// The polynomial of the last element; it reuses the memory of one that is no longer needed.
    fn inside(
        stepper: &mut L::Stepper<'_, Self>,
        spare: Option<L::Polynomial>,
        nodes: (f64, f64),
    ) -> L::Polynomial;

    /// The node of a state; its velocity is found by iteration from a guess.
    fn node(
        stepper: &mut L::Stepper<'_, Self>,
        model: &Self,
        at: (f64, &L::State),
        guess: &L::Vector,
    ) -> Node<N, L>;

    /// Appends a state to a motion.
    fn record(
        motion: &mut Motion<N, L>,
        stepper: &mut L::Stepper<'_, Self>,
        model: &Self,
        at: (f64, &L::State),
    );

    /// The rounding error of the energy of a node, at rest that of a time; zero for models that do not conserve energy.
    fn rounding_at(&self, node: &Node<N, L>, time: f64) -> f64 {
        match const { Self::CONSERVES } {
            true => self.energy_rounding((node.t, time), (&node.q, &node.p), &node.v),
            false => 0.0,
        }
    }

    /// The velocity that belongs to a momentum under the constraints, by iteration from a guess.
    fn allowed_velocity(&self, t: f64, state: &L::State, guess: &L::Vector) -> Option<L::Vector>;

    /// The work of the steps so far.
    fn statistics<'s>(stepper: &'s L::Stepper<'_, Self>) -> &'s Statistics;

    /// The impulses that act inside an element.
    fn acting(impulses: &[L::Impulse], nodes: (f64, f64)) -> Vec<Impulse<N>>;

    /// Applies the impulses between elements; returns whether there are any.
    fn kick(&self, impulses: &[L::Impulse], at: (f64, f64), state: &mut L::State) -> bool;

    /// Applies those of the impulses inside elements, from the first on, that act at a time; returns their number.
    fn kick_at(&self, impulses: &[Impulse<N>], at: (f64, f64), state: &mut L::State) -> usize;

    /// Refuses a state from which a run cannot continue.
    ///
    /// # Errors
    /// What is wrong with it.
    fn check_restart(&self, t: f64, h: f64, state: &L::State) -> Result<(), RunErrorKind>;

    /// Checks an element before it is passed, or after it has failed.
    fn look(
        &self,
        watch: &mut Watch,
        number: usize,
        at: (f64, f64),
        state: &L::State,
        failed: bool,
    );

    /// The warning about the mass matrix at the start of a run, if there is one.
    fn weigh(&self, start: &Node<N, L>) -> Option<Warning>;

    /// Bounds of the outputs over a piece of an element, from the bounds of all their arguments.
    fn outputs_along(&self, piece: &L::Polynomial, values: &mut [Enclosure]);

    /// The same over the part between two fractions of its length, with derivatives by this fraction.
    fn outputs_over(&self, piece: &L::Polynomial, part: (f64, f64), values: &mut [Dual<Enclosure>]);

    /// The outputs and their derivatives in a direction (δt, δq, δz), z the velocities, or the momenta of a
    /// Hamiltonian.
    fn outputs_towards(
        &self,
        t: Dual<f64>,
        q: (&L::Vector, &L::Vector),
        z: (&L::Vector, &L::Vector),
        values: &mut [Dual<f64>],
    );

    /// The momenta of given velocities; NaN if there are none.
    fn momenta(&self, t: f64, q: &L::Vector, v: &L::Vector) -> L::Vector;

    /// ∂p/∂(parameter) at fixed velocity.
    fn momenta_by(
        &self,
        t: f64,
        q: &L::Vector,
        second: (&L::Vector, &L::Vector),
        number: usize,
    ) -> L::Vector;

    /// The names of the parameters that can be set.
    fn parameter_names(&self) -> Vec<CoordinateName>;

    /// The same model with another value of a parameter, if its parameters can be set.
    fn with_value(&self, number: usize, value: f64) -> Option<Self>;

    /// The value of a parameter.
    fn parameter_value(&self, number: usize) -> f64;

    /// Calls `f`, which evaluates the model; `None` if a user function for an input has panicked.
    fn guarded<T>(&self, f: impl FnOnce() -> T) -> Option<T>;

    /// The error of an element that failed; it names a function for an input if that is not finite in the element, and
    /// kinks of forces if steps do not end there, which `at_kinks` tells.
    fn failed(
        &self,
        element: usize,
        at: (f64, f64),
        (at_kinks, source): (bool, StepError),
    ) -> RunErrorKind {
        let crosses_kinks = !Self::FACTS.smooth && !at_kinks;
        let source = match crosses_kinks {
            true => source.across_kinks(),
            false => source,
        };
        RunErrorKind::of_element(self.input_failure(), element, at, source)
    }

    /// The function for an input that was last found not to be finite.
    fn input_failure(&self) -> Option<InputFailure>;
}

/// The second argument of outputs: velocities, or momenta for a Hamiltonian.
fn second<V>(form: Form, v: V, p: V) -> V {
    match form {
        Form::Lagrangian => v,
        Form::Hamiltonian => p,
    }
}
