//! What runs ask of models of either kind of length.

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
use tfe_runtime::{CoordinateName, Element, Facts, Form, Statistics, StepError};

/// The settings for the solution of elements.
#[derive(Clone, Copy, Debug)]
pub struct Chosen {
    pub(crate) element: Element,
    pub(crate) control: Control,
    /// Whether steps are cut at kinks.
    pub(crate) at_kinks: bool,
}

/// A model that can be simulated: implemented for every [`Model`] and every [`family::Model`], and for nothing else.
/// Its methods are internal.
pub trait Simulated<const N: usize, L: Length<N>>: Evaluate<N, L> {
    /// What is known of it.
    const FACTS: Facts;
    /// Whether a search for an accuracy may iterate fixed points.
    const MAY_ITERATE: bool;
    /// Whether the energy is kept, and jumps of it tell of steps that are too long.
    const CONSERVES: bool;

    /// The number of coordinates.
    fn coordinates(&self) -> usize;

    /// The number of outputs.
    fn output_count(&self) -> usize;

    /// Whether H is linear in the momenta: q̇ = f(q, t) does not hold them, and ṗ = −(∂f/∂q)ᵀ p is its adjoint.
    fn is_of_first_order(&self, t: f64, start: &L::State) -> bool;

    /// When an impulse acts.
    fn time_of(impulse: &L::Impulse) -> f64;

    /// The impulses that may act inside elements.
    fn inner(impulses: &[L::Impulse]) -> &[Impulse<N>];

    /// Adds the last element of a stepper to a trail, where that is of use.
    fn leave(stepper: &L::Stepper<'_, Self>, trail: &mut Trail);

    /// Has an element of a stepper, its start and length, start from what a trail says.
    fn foresee(stepper: &mut L::Stepper<'_, Self>, trail: &Trail, step: (f64, f64));

    /// Changes what iterations may leave from the next step on.
    fn set_tolerance(stepper: &mut L::Stepper<'_, Self>, tolerance: f64);

    /// What the steps have cost since the last call.
    fn take_statistics(stepper: &mut L::Stepper<'_, Self>) -> Statistics;

    /// Refuses a start, or impulses, that the model cannot have; by their lengths first, before memory is asked for.
    ///
    /// # Errors
    /// What is wrong with them.
    fn check_start(&self, start: &L::State, impulses: &[L::Impulse]) -> Result<(), RunErrorKind>;

    /// Refuses a start that is not on the constraints, for a first element of a length.
    ///
    /// # Errors
    /// By how much it is off.
    fn check_first(&self, element: (f64, f64), start: &L::State) -> Result<(), RunErrorKind>;

    /// The elements of a span.
    ///
    /// # Errors
    /// What is wrong with what was asked for.
    fn mesh(span: &Range<f64>, grid: &Grid<'_, L::Impulse>) -> Result<Mesh<N>, RunErrorKind>;

    /// Of a run that goes on, those impulses at its beginning that have acted already.
    fn leave_behind(impulses: &mut Vec<L::Impulse>, t: f64);

    /// The only node of a motion; of the model nothing is asked where there is no stepper and it may not fit together.
    fn first_node(
        &self,
        at: (f64, &L::State),
        stepper: Option<&mut L::Stepper<'_, Self>>,
    ) -> Motion<N, L>;

    /// A stepper at rest.
    ///
    /// # Errors
    /// Where the model cannot be stepped with the element.
    fn stepper<'m>(
        model: Share<'m, Self>,
        chosen: Chosen,
    ) -> Result<L::Stepper<'m, Self>, RunErrorKind>
    where
        Self: 'm;

    /// A stepper that goes on from where one was suspended; at rest where that had another element.
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

    /// Leaves the model.
    fn suspended(stepper: L::Stepper<'_, Self>) -> L::Suspended;

    /// Whether a stepper that was suspended had this model, as far as can be told.
    fn is_that_of(&self, suspended: &L::Suspended) -> bool;

    /// A stepper whose elements are not looked into.
    fn ends_only<'m>(stepper: L::Stepper<'m, Self>) -> L::Stepper<'m, Self>
    where
        Self: 'm;

    /// Refuses a start to which no velocity belongs, where a run needs one.
    ///
    /// # Errors
    /// Why there is none.
    fn check_velocity(
        stepper: &mut L::Stepper<'_, Self>,
        at: (f64, &L::State),
    ) -> Result<(), RunErrorKind>;

    /// The element and how it is solved.
    fn chosen(stepper: &L::Stepper<'_, Self>) -> (Element, Control);

    /// Goes on with other parameters.
    ///
    /// # Errors
    /// As [`stepper`](Self::stepper).
    fn exchange<'m>(
        stepper: &mut L::Stepper<'m, Self>,
        model: Share<'m, Self>,
    ) -> Result<(), RunErrorKind>
    where
        Self: 'm;

    /// Moves a state over an element.
    ///
    /// # Errors
    /// The state is as it was then.
    fn advance(
        stepper: &mut L::Stepper<'_, Self>,
        element: (f64, f64),
        state: &mut L::State,
        impulses: &[Impulse<N>],
    ) -> Result<(), StepError>;

    /// Appends bounds of coordinates, then of velocities (momenta of a Hamiltonian), all along the last element; false where they are not to be had for less than its polynomial.
    fn reach(stepper: &mut L::Stepper<'_, Self>, bounds: &mut Vec<(f64, f64)>) -> bool;

    /// Whether coordinates and velocities stay within such bounds all along the last element, as far as these tell.
    fn reaches_within(stepper: &mut L::Stepper<'_, Self>, bounds: &[(f64, f64)]) -> bool;

    /// Bounds of all outputs over a box of times, coordinates and velocities (momenta); false where there are none.
    fn outputs_within(&self, bounds: &[Enclosure], values: &mut [Enclosure]) -> bool;

    /// The polynomial of the last element, in memory that is not needed any more.
    fn inside(
        stepper: &mut L::Stepper<'_, Self>,
        spare: Option<L::Polynomial>,
        nodes: (f64, f64),
    ) -> L::Polynomial;

    /// A state with its velocities, looked for from a guess on.
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

    /// What the energy of a node may be rounded by; models that do not conserve it are not asked.
    fn rounding_at(&self, node: &Node<N, L>) -> f64 {
        match const { Self::CONSERVES } {
            true => self.energy_rounding(node.t, (&node.q, &node.p), &node.v),
            false => 0.0,
        }
    }

    /// The velocity that constraints leave of a momentum, looked for from a guess on.
    fn allowed_velocity(&self, t: f64, state: &L::State, guess: &L::Vector) -> Option<L::Vector>;

    /// What the steps so far have cost.
    fn statistics<'s>(stepper: &'s L::Stepper<'_, Self>) -> &'s Statistics;

    /// The impulses that act inside an element.
    fn acting(impulses: &[L::Impulse], nodes: (f64, f64)) -> Vec<Impulse<N>>;

    /// Lets impulses act that do so between elements; whether there are any.
    fn kick(&self, impulses: &[L::Impulse], at: (f64, f64), state: &mut L::State) -> bool;

    /// Lets the first ones of impulses act that may do so inside elements, as far as they act at a time; how many do.
    fn kick_at(&self, impulses: &[Impulse<N>], at: (f64, f64), state: &mut L::State) -> usize;

    /// Refuses a state from which a run cannot go on.
    ///
    /// # Errors
    /// What is wrong with it.
    fn check_restart(&self, t: f64, h: f64, state: &L::State) -> Result<(), RunErrorKind>;

    /// Looks at an element before it is passed, or after it has failed.
    fn look(
        &self,
        watch: &mut Watch,
        number: usize,
        at: (f64, f64),
        state: &L::State,
        failed: bool,
    );

    /// What is wrong with the mass matrix at the start of a run.
    fn weigh(&self, start: &Node<N, L>) -> Option<Warning>;

    /// What bounds of all that outputs are functions of, along a piece of an element, leave for the outputs.
    fn outputs_along(&self, piece: &L::Polynomial, values: &mut [Enclosure]);

    /// The same over a part of it, from fraction to fraction of its length, with derivatives by that fraction.
    fn outputs_over(&self, piece: &L::Polynomial, part: (f64, f64), values: &mut [Dual<Enclosure>]);

    /// The outputs and their derivatives in a direction (δt, δq, δz), z the velocities, or the momenta of a Hamiltonian.
    fn outputs_towards(
        &self,
        t: Dual<f64>,
        q: (&L::Vector, &L::Vector),
        z: (&L::Vector, &L::Vector),
        values: &mut [Dual<f64>],
    );

    /// The momenta of velocities; NaN where there are none.
    fn momenta(&self, t: f64, q: &L::Vector, v: &L::Vector) -> L::Vector;

    /// ∂p/∂(parameter), where the velocity stays.
    fn momenta_by(
        &self,
        t: f64,
        q: &L::Vector,
        second: (&L::Vector, &L::Vector),
        number: usize,
    ) -> L::Vector;

    /// The names of the parameters that can be set.
    fn parameter_names(&self) -> Vec<CoordinateName>;

    /// The same model with another value of a parameter, if one can be made.
    fn with_value(&self, number: usize, value: f64) -> Option<Self>;

    /// The value of a parameter.
    fn parameter_value(&self, number: usize) -> f64;

    /// What `f` gives, in which the model is evaluated; nothing where a function given for an input has panicked.
    fn guarded<T>(&self, f: impl FnOnce() -> T) -> Option<T>;

    /// What the failure of an element is told as: for a function of an input that is not finite within it, if there is one.
    fn failed(&self, element: usize, at: (f64, f64), source: StepError) -> RunErrorKind;
}

/// Outputs are functions of velocities, or of momenta.
fn second<V>(form: Form, v: V, p: V) -> V {
    match form {
        Form::Lagrangian => v,
        Form::Hamiltonian => p,
    }
}
