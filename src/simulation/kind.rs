//! What runs ask of models of either kind of length.

use super::checks::{check_constraints, check_start, conserves_energies, conserves_energy};
use super::mesh::{Grid, Mesh, is_same, within};
use super::watch::resolution::{Again, Examined, Resolution};
use super::watch::{Watch, mass_signs};
use crate::error::RunErrorKind;
use crate::evaluate::Evaluate;
use crate::length::{FixedLength, Length, RunTimeLength};
use crate::motion::{Motion, Node, Warning};
use crate::sensitivity::slopes::momentum_by;
use std::ops::Range;
use tfe_runtime::constrained::{self, Trail};
use tfe_runtime::dual::{Dual, duals};
use tfe_runtime::enclosure::Enclosure;
use tfe_runtime::family::{self, FamilyState};
use tfe_runtime::step::{Control, DenseElement, Impulse, Stepper, Suspended};
use tfe_runtime::{
    CoordinateName, Element, ElementError, Facts, First, Form, Model, Second, Share, State,
    Statistics, StepError,
};

/// How elements are solved.
#[derive(Clone, Copy, Debug)]
pub struct Chosen {
    pub(crate) element: Element,
    pub(crate) control: Control,
    /// Whether steps are cut at kinks.
    pub(crate) at_kinks: bool,
}

/// A model that runs can be made of: every [`Model`] and every [`family::Model`], and nothing else. Not to be called outside.
pub trait Simulated<const N: usize, L: Length<N>>: Evaluate<N, L> {
    /// What is known of it.
    const FACTS: Facts;
    /// Whether a search for an accuracy may iterate fixed points.
    const MAY_ITERATE: bool;
    /// Whether steps can be cut at kinks.
    const CUTS_AT_KINKS: bool;
    /// Whether the energy is kept, and jumps of it tell of steps that are too long.
    const CONSERVES: bool;
    /// Whether parameters have numbers by which they can be set.
    const HAS_PARAMETERS: bool;
    /// Whether outputs are functions of velocities; of a Hamiltonian they are of momenta.
    const OF_VELOCITIES: bool;

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
    fn check_start(
        &self,
        start: &L::State,
        impulses: &[L::Impulse],
        at_kinks: bool,
    ) -> Result<(), RunErrorKind>;

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
        model: L::Held<'m, Self>,
        chosen: Chosen,
    ) -> Result<L::Stepper<'m, Self>, RunErrorKind>
    where
        Self: 'm;

    /// A stepper that goes on from where one was suspended; at rest where that had another element.
    ///
    /// # Errors
    /// As [`stepper`](Self::stepper).
    fn resumed<'m>(
        model: L::Held<'m, Self>,
        chosen: Chosen,
        suspended: L::Suspended,
    ) -> Result<L::Stepper<'m, Self>, RunErrorKind>
    where
        Self: 'm;

    /// Leaves the model.
    fn suspended(stepper: L::Stepper<'_, Self>) -> L::Suspended;

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
        model: L::Held<'m, Self>,
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

    /// The polynomial of the last element, in memory that is not needed any more.
    fn inside(
        stepper: &L::Stepper<'_, Self>,
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

    /// The velocity that constraints leave of a momentum, looked for from a guess on.
    fn allowed_velocity(&self, t: f64, state: &L::State, guess: &L::Vector) -> Option<L::Vector>;

    /// What the steps so far have cost.
    fn statistics<'s>(stepper: &'s L::Stepper<'_, Self>) -> &'s Statistics;

    /// The impulses that act inside an element.
    fn acting(impulses: &[L::Impulse], nodes: (f64, f64)) -> Vec<Impulse<N>>;

    /// Lets impulses act that do so between elements; whether there are any.
    fn kick(&self, impulses: &[L::Impulse], t: f64, state: &mut L::State) -> bool;

    /// Refuses a state from which a run cannot go on.
    ///
    /// # Errors
    /// What is wrong with it.
    fn check_restart(&self, t: f64, h: f64, state: &L::State) -> Result<(), RunErrorKind>;

    /// What an element is examined with a second time, if that is done.
    fn resolution<'m>(again: Again<'m, Self, N, L>) -> Option<Resolution<'m, Self, N>>
    where
        Self: 'm;

    /// Examines an element that was passed.
    fn examine(
        resolution: &mut Option<Resolution<'_, Self, N>>,
        statistics: &Statistics,
        element: Examined<'_, N, L>,
    );

    /// What is doubtful about a run that has come to a state.
    fn doubt(resolution: &Option<Resolution<'_, Self, N>>, last: &L::State) -> Option<Warning>;

    /// Goes on with other parameters.
    fn exchange_in<'m>(resolution: &mut Option<Resolution<'m, Self, N>>, model: L::Held<'m, Self>)
    where
        Self: 'm;

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

/// A stepper that cuts its steps at kinks, if it is to.
fn cutting<'m, M: Model<N>, const N: usize>(
    stepper: Result<Stepper<'m, M, N>, ElementError>,
    at_kinks: bool,
) -> Result<Stepper<'m, M, N>, RunErrorKind> {
    let stepper = stepper.map_err(RunErrorKind::Element)?;
    Ok(match at_kinks {
        true => stepper.at_kinks(),
        false => stepper,
    })
}

impl<M: Model<N>, const N: usize> Simulated<N, FixedLength> for M {
    const FACTS: Facts = M::FACTS;
    const MAY_ITERATE: bool = !M::FACTS.linear && M::CONSTRAINTS.is_empty();
    const CUTS_AT_KINKS: bool = true;
    const CONSERVES: bool = conserves_energy::<M, N>();
    const HAS_PARAMETERS: bool = true;
    const OF_VELOCITIES: bool = matches!(M::FORM, Form::Lagrangian);

    fn coordinates(&self) -> usize {
        N
    }

    fn output_count(&self) -> usize {
        self.columns()
    }

    fn is_of_first_order(&self, t: f64, start: &State<N>) -> bool {
        let (mut first, mut second) = (First::ZERO, Second::ZERO);
        let may_be = M::FORM == Form::Hamiltonian && M::FACTS.quadratic_in_z;
        if may_be {
            self.second(t, &start.q, &start.p, &mut first, &mut second);
        }
        may_be && second.zz.as_flattened().iter().all(|entry| *entry == 0.0)
    }

    fn time_of(impulse: &Impulse<N>) -> f64 {
        impulse.time
    }

    fn inner(impulses: &[Impulse<N>]) -> &[Impulse<N>] {
        impulses
    }

    fn leave(stepper: &Stepper<'_, M, N>, trail: &mut Trail) {
        stepper.leave(trail);
    }

    fn foresee(stepper: &mut Stepper<'_, M, N>, trail: &Trail, step: (f64, f64)) {
        stepper.foresee(trail, step);
    }

    fn set_tolerance(stepper: &mut Stepper<'_, M, N>, tolerance: f64) {
        stepper.set_tolerance(tolerance);
    }

    fn take_statistics(stepper: &mut Stepper<'_, M, N>) -> Statistics {
        stepper.take_statistics()
    }

    fn check_start(&self, start: &State<N>, _: &[Impulse<N>], _: bool) -> Result<(), RunErrorKind> {
        check_start(start)
    }

    fn check_first(&self, (t, h): (f64, f64), start: &State<N>) -> Result<(), RunErrorKind> {
        check_constraints(self, t, h, start)
    }

    fn mesh(span: &Range<f64>, grid: &Grid<'_, Impulse<N>>) -> Result<Mesh<N>, RunErrorKind> {
        grid.mesh(span, grid.impulses)
    }

    fn leave_behind(impulses: &mut Vec<Impulse<N>>, t: f64) {
        // The last element of a run takes those at its end.
        impulses.retain(|impulse| impulse.time != t);
    }

    fn first_node(
        &self,
        (t, start): (f64, &State<N>),
        _: Option<&mut Stepper<'_, M, N>>,
    ) -> Motion<N> {
        Motion::from_start(self, t, start)
    }

    fn stepper<'m>(model: Share<'m, M>, chosen: Chosen) -> Result<Stepper<'m, M, N>, RunErrorKind>
    where
        M: 'm,
    {
        let stepper = Stepper::sharing(model, chosen.element, chosen.control);
        cutting(stepper, chosen.at_kinks)
    }

    fn resumed<'m>(
        model: Share<'m, M>,
        chosen: Chosen,
        suspended: Suspended<N>,
    ) -> Result<Stepper<'m, M, N>, RunErrorKind>
    where
        M: 'm,
    {
        if suspended.element() != chosen.element {
            return M::stepper(model, chosen);
        }
        let stepper = Stepper::resume(model, chosen.control, suspended);
        cutting(stepper, chosen.at_kinks)
    }

    fn suspended(stepper: Stepper<'_, M, N>) -> Suspended<N> {
        stepper.suspend()
    }

    fn ends_only<'m>(stepper: Stepper<'m, M, N>) -> Stepper<'m, M, N>
    where
        M: 'm,
    {
        stepper.ends_only()
    }

    fn check_velocity(_: &mut Stepper<'_, M, N>, _: (f64, &State<N>)) -> Result<(), RunErrorKind> {
        Ok(())
    }

    fn chosen(stepper: &Stepper<'_, M, N>) -> (Element, Control) {
        (stepper.element(), stepper.control())
    }

    fn exchange<'m>(
        stepper: &mut Stepper<'m, M, N>,
        model: Share<'m, M>,
    ) -> Result<(), RunErrorKind>
    where
        M: 'm,
    {
        stepper.set_model(model).map_err(RunErrorKind::Element)
    }

    fn advance(
        stepper: &mut Stepper<'_, M, N>,
        (t, h): (f64, f64),
        state: &mut State<N>,
        impulses: &[Impulse<N>],
    ) -> Result<(), StepError> {
        stepper.advance(t, h, state, impulses)
    }

    fn inside(
        stepper: &Stepper<'_, M, N>,
        spare: Option<DenseElement<N>>,
        (start, end): (f64, f64),
    ) -> DenseElement<N> {
        stepper.dense_in(spare, start, end)
    }

    fn node(
        _: &mut Stepper<'_, M, N>,
        model: &M,
        (t, state): (f64, &State<N>),
        guess: &[f64; N],
    ) -> Node<N> {
        Node::new(model, t, state, guess)
    }

    fn record(
        motion: &mut Motion<N>,
        _: &mut Stepper<'_, M, N>,
        model: &M,
        (t, state): (f64, &State<N>),
    ) {
        motion.record(model, t, state);
    }

    fn allowed_velocity(&self, t: f64, state: &State<N>, guess: &[f64; N]) -> Option<[f64; N]> {
        constrained::velocity(self, t, &state.q, &state.p, guess).ok()
    }

    fn statistics<'s>(stepper: &'s Stepper<'_, M, N>) -> &'s Statistics {
        stepper.statistics()
    }

    fn acting(impulses: &[Impulse<N>], (t, next): (f64, f64)) -> Vec<Impulse<N>> {
        let acts = |impulse: &&Impulse<N>| within(impulse.time, t, next);
        impulses.iter().filter(acts).copied().collect()
    }

    fn kick(&self, _: &[Impulse<N>], _: f64, _: &mut State<N>) -> bool {
        false
    }

    fn check_restart(&self, t: f64, h: f64, state: &State<N>) -> Result<(), RunErrorKind> {
        check_start(state)?;
        check_constraints(self, t, h, state)
    }

    fn resolution<'m>(again: Again<'m, M, N>) -> Option<Resolution<'m, M, N>>
    where
        M: 'm,
    {
        Some(Resolution::new(again))
    }

    #[inline(always)]
    fn examine(
        resolution: &mut Option<Resolution<'_, M, N>>,
        statistics: &Statistics,
        element: Examined<'_, N>,
    ) {
        if let Some(resolution) = resolution {
            resolution.look(statistics, element);
        }
    }

    fn doubt(resolution: &Option<Resolution<'_, M, N>>, last: &State<N>) -> Option<Warning> {
        resolution.as_ref()?.warning(last)
    }

    fn exchange_in<'m>(resolution: &mut Option<Resolution<'m, M, N>>, model: Share<'m, M>)
    where
        M: 'm,
    {
        if let Some(resolution) = resolution {
            resolution.set_model(model);
        }
    }

    fn look(
        &self,
        watch: &mut Watch,
        number: usize,
        at: (f64, f64),
        state: &State<N>,
        failed: bool,
    ) {
        match failed {
            true => watch.examine(self, number, at, state),
            false => watch.look(self, number, at, state),
        }
    }

    fn weigh(&self, start: &Node<N>) -> Option<Warning> {
        mass_signs(self, start)
    }

    fn outputs_along(&self, piece: &DenseElement<N>, values: &mut [Enclosure]) {
        let over = piece.bounds(M::FORM);
        self.observables(over.t, &over.q, second(M::FORM, &over.v, &over.p), values);
    }

    fn outputs_over(
        &self,
        piece: &DenseElement<N>,
        part: (f64, f64),
        values: &mut [Dual<Enclosure>],
    ) {
        let over = piece.bounds_over(part);
        self.observables(over.t, &over.q, second(M::FORM, &over.v, &over.p), values);
    }

    fn outputs_towards(
        &self,
        t: Dual<f64>,
        q: (&[f64; N], &[f64; N]),
        z: (&[f64; N], &[f64; N]),
        values: &mut [Dual<f64>],
    ) {
        self.observables(t, &duals(q.0, q.1), &duals(z.0, z.1), values);
    }

    fn momenta(&self, t: f64, q: &[f64; N], v: &[f64; N]) -> [f64; N] {
        tfe_runtime::__private::state(self, t, *q, *v).p
    }

    fn momenta_by(
        &self,
        t: f64,
        q: &[f64; N],
        (v, p): (&[f64; N], &[f64; N]),
        number: usize,
    ) -> [f64; N] {
        momentum_by(self, t, (q, v, p), number)
    }

    fn parameter_names(&self) -> Vec<CoordinateName> {
        let numbers = 0..self.parameters();
        numbers.map(|number| self.parameter_name(number)).collect()
    }

    fn parameter_value(&self, number: usize) -> f64 {
        self.parameter(number)
    }

    fn guarded<T>(&self, f: impl FnOnce() -> T) -> Option<T> {
        Model::guarded(self, f).ok()
    }

    fn failed(&self, element: usize, at: (f64, f64), source: StepError) -> RunErrorKind {
        RunErrorKind::of_element(self, element, at, source)
    }
}

impl<M: family::Model> Simulated<0, RunTimeLength> for M {
    const FACTS: Facts = M::FACTS;
    // Without sparse factorisations there is nothing else.
    const MAY_ITERATE: bool = M::FACTS.separable && !M::CONSTRAINED;
    const CUTS_AT_KINKS: bool = false;
    const CONSERVES: bool = conserves_energies::<M>();
    const HAS_PARAMETERS: bool = false;
    const OF_VELOCITIES: bool = matches!(M::FORM, Form::Lagrangian);

    fn coordinates(&self) -> usize {
        self.len()
    }

    fn output_count(&self) -> usize {
        self.columns()
    }

    fn is_of_first_order(&self, _: f64, _: &FamilyState) -> bool {
        false
    }

    fn time_of(impulse: &(f64, Vec<f64>)) -> f64 {
        impulse.0
    }

    fn inner(_: &[(f64, Vec<f64>)]) -> &[Impulse<0>] {
        &[]
    }

    fn leave(_: &family::Stepper<'_, M>, _: &mut Trail) {}

    fn foresee(_: &mut family::Stepper<'_, M>, _: &Trail, _: (f64, f64)) {}

    fn set_tolerance(stepper: &mut family::Stepper<'_, M>, tolerance: f64) {
        stepper.set_tolerance(tolerance);
    }

    fn take_statistics(stepper: &mut family::Stepper<'_, M>) -> Statistics {
        stepper.take_statistics()
    }

    fn check_start(
        &self,
        start: &FamilyState,
        impulses: &[(f64, Vec<f64>)],
        at_kinks: bool,
    ) -> Result<(), RunErrorKind> {
        if at_kinks && const { !M::FACTS.smooth } {
            return Err(RunErrorKind::KinksUnsupported { call: "at_kinks" });
        }
        self.check().map_err(RunErrorKind::Family)?;
        check_lengths(self.len(), start)?;
        for (_, impulse) in impulses {
            check_length("of an impulse", impulse.len(), self.len())?;
        }
        Ok(())
    }

    fn check_first(&self, _: (f64, f64), _: &FamilyState) -> Result<(), RunErrorKind> {
        Ok(())
    }

    fn mesh(span: &Range<f64>, grid: &Grid<'_, (f64, Vec<f64>)>) -> Result<Mesh<0>, RunErrorKind> {
        let (first, last) = (span.start.min(span.end), span.start.max(span.end));
        for (time, impulse) in grid.impulses {
            let is_finite = impulse.iter().all(|one| one.is_finite());
            if !(is_finite && first <= *time && *time <= last) {
                return Err(RunErrorKind::Impulse { time: *time });
            }
        }
        // They act between elements, which end at breaks.
        grid.mesh(span, &[])
    }

    fn leave_behind(_: &mut Vec<(f64, Vec<f64>)>, _: f64) {}

    fn first_node(
        &self,
        (t, start): (f64, &FamilyState),
        stepper: Option<&mut family::Stepper<'_, M>>,
    ) -> Motion<0, RunTimeLength> {
        match stepper {
            Some(stepper) => {
                let node = M::node(stepper, self, (t, start), &start.p);
                let reactions = reactions(self, stepper, &node);
                Motion::starting_with(self, node, reactions)
            }
            None => Motion::unasked(t, start),
        }
    }

    fn stepper<'m>(model: &'m M, chosen: Chosen) -> Result<family::Stepper<'m, M>, RunErrorKind>
    where
        M: 'm,
    {
        let stepper = family::Stepper::new(model, chosen.element, chosen.control);
        stepper.map_err(RunErrorKind::Family)
    }

    fn resumed<'m>(
        model: &'m M,
        chosen: Chosen,
        suspended: family::Suspended,
    ) -> Result<family::Stepper<'m, M>, RunErrorKind>
    where
        M: 'm,
    {
        let Chosen {
            element, control, ..
        } = chosen;
        let stepper = family::Stepper::resume(model, element, control, suspended);
        stepper.map_err(RunErrorKind::Family)
    }

    fn suspended(stepper: family::Stepper<'_, M>) -> family::Suspended {
        stepper.suspend()
    }

    fn ends_only<'m>(stepper: family::Stepper<'m, M>) -> family::Stepper<'m, M>
    where
        M: 'm,
    {
        stepper
    }

    fn check_velocity(
        stepper: &mut family::Stepper<'_, M>,
        (t, start): (f64, &FamilyState),
    ) -> Result<(), RunErrorKind> {
        let velocity = stepper.velocity(t, start);
        velocity.map(|_| ()).map_err(RunErrorKind::Family)
    }

    fn chosen(stepper: &family::Stepper<'_, M>) -> (Element, Control) {
        (stepper.element(), stepper.control())
    }

    fn exchange<'m>(_: &mut family::Stepper<'m, M>, _: &'m M) -> Result<(), RunErrorKind>
    where
        M: 'm,
    {
        Err(RunErrorKind::ParametersFixed)
    }

    fn advance(
        stepper: &mut family::Stepper<'_, M>,
        (t, h): (f64, f64),
        state: &mut FamilyState,
        _: &[Impulse<0>],
    ) -> Result<(), StepError> {
        stepper.advance(t, h, state)
    }

    fn inside(
        stepper: &family::Stepper<'_, M>,
        _: Option<family::DenseElement>,
        (start, end): (f64, f64),
    ) -> family::DenseElement {
        stepper.dense(start, end)
    }

    fn node(
        stepper: &mut family::Stepper<'_, M>,
        _: &M,
        (t, state): (f64, &FamilyState),
        _: &Vec<f64>,
    ) -> Node<0, RunTimeLength> {
        let velocity = stepper.velocity(t, state);
        Node::of(
            t,
            state,
            velocity.unwrap_or_else(|_| vec![f64::NAN; state.q.len()]),
        )
    }

    fn record(
        motion: &mut Motion<0, RunTimeLength>,
        stepper: &mut family::Stepper<'_, M>,
        model: &M,
        at: (f64, &FamilyState),
    ) {
        let node = M::node(stepper, model, at, &motion.last().v);
        let reactions = reactions(model, stepper, &node);
        motion.record_all(model, node, reactions);
    }

    fn allowed_velocity(&self, t: f64, state: &FamilyState, _: &Vec<f64>) -> Option<Vec<f64>> {
        family::allowed_velocity(self, t, state).ok()
    }

    fn statistics<'s>(stepper: &'s family::Stepper<'_, M>) -> &'s Statistics {
        stepper.statistics()
    }

    fn acting(_: &[(f64, Vec<f64>)], _: (f64, f64)) -> Vec<Impulse<0>> {
        Vec::new()
    }

    fn kick(&self, impulses: &[(f64, Vec<f64>)], t: f64, state: &mut FamilyState) -> bool {
        let mut is_kicked = false;
        for (_, impulse) in impulses.iter().filter(|(time, _)| is_same(*time, t)) {
            for (p, change) in state.p.iter_mut().zip(impulse) {
                *p += change;
            }
            is_kicked = true;
        }
        if is_kicked && const { M::CONSTRAINED } {
            // What is against the constraints these take up at once.
            let velocity = self.allowed_velocity(t, state, &state.p);
            state.p = match velocity {
                Some(v) => Simulated::momenta(self, t, &state.q, &v),
                None => vec![f64::NAN; state.p.len()],
            };
        }
        is_kicked
    }

    fn check_restart(&self, _: f64, _: f64, state: &FamilyState) -> Result<(), RunErrorKind> {
        check_lengths(self.len(), state)
    }

    fn resolution<'m>(_: Again<'m, M, 0, RunTimeLength>) -> Option<Resolution<'m, M, 0>>
    where
        M: 'm,
    {
        None
    }

    fn examine(
        _: &mut Option<Resolution<'_, M, 0>>,
        _: &Statistics,
        _: Examined<'_, 0, RunTimeLength>,
    ) {
    }

    fn doubt(_: &Option<Resolution<'_, M, 0>>, _: &FamilyState) -> Option<Warning> {
        None
    }

    fn exchange_in<'m>(_: &mut Option<Resolution<'m, M, 0>>, _: &'m M)
    where
        M: 'm,
    {
    }

    fn look(&self, _: &mut Watch, _: usize, _: (f64, f64), _: &FamilyState, _: bool) {}

    fn weigh(&self, _: &Node<0, RunTimeLength>) -> Option<Warning> {
        None
    }

    fn outputs_along(&self, piece: &family::DenseElement, values: &mut [Enclosure]) {
        let over = piece.bounds(M::FORM);
        self.observables(over.t, &over.q, second(M::FORM, &over.v, &over.p), values);
    }

    fn outputs_over(
        &self,
        piece: &family::DenseElement,
        part: (f64, f64),
        values: &mut [Dual<Enclosure>],
    ) {
        let over = piece.bounds_over(M::FORM, part);
        self.observables(over.t, &over.q, second(M::FORM, &over.v, &over.p), values);
    }

    fn outputs_towards(
        &self,
        t: Dual<f64>,
        q: (&Vec<f64>, &Vec<f64>),
        z: (&Vec<f64>, &Vec<f64>),
        values: &mut [Dual<f64>],
    ) {
        let duals = |(values, slopes): (&Vec<f64>, &Vec<f64>)| -> Vec<Dual<f64>> {
            let pairs = values.iter().zip(slopes);
            pairs
                .map(|(value, slope)| Dual::new(*value, *slope))
                .collect()
        };
        self.observables(t, &duals(q), &duals(z), values);
    }

    fn momenta(&self, t: f64, q: &Vec<f64>, v: &Vec<f64>) -> Vec<f64> {
        family::momenta(self, t, q, v).unwrap_or_else(|_| vec![f64::NAN; q.len()])
    }

    fn momenta_by(&self, _: f64, q: &Vec<f64>, _: (&Vec<f64>, &Vec<f64>), _: usize) -> Vec<f64> {
        vec![f64::NAN; q.len()]
    }

    fn parameter_names(&self) -> Vec<CoordinateName> {
        Vec::new()
    }

    fn parameter_value(&self, _: usize) -> f64 {
        f64::NAN
    }

    fn guarded<T>(&self, f: impl FnOnce() -> T) -> Option<T> {
        Some(f())
    }

    fn failed(&self, element: usize, (time, step): (f64, f64), source: StepError) -> RunErrorKind {
        RunErrorKind::Solve {
            element,
            time,
            step,
            source,
        }
    }
}

/// The reactions at a node of a model of run-time length.
fn reactions<M: family::Model>(
    model: &M,
    stepper: &mut family::Stepper<'_, M>,
    node: &Node<0, RunTimeLength>,
) -> Vec<f64> {
    if const { !M::CONSTRAINED } {
        return Vec::new();
    }
    let reactions = stepper.reactions(node.t, &node.q, &node.v);
    reactions.unwrap_or_else(|| vec![f64::NAN; model.constraints()])
}

/// Refuses states that are not as long as the model, or not finite.
fn check_lengths(expected: usize, state: &FamilyState) -> Result<(), RunErrorKind> {
    check_length("q", state.q.len(), expected)?;
    check_length("p", state.p.len(), expected)?;
    for (coordinate, (&q, &p)) in state.q.iter().zip(&state.p).enumerate() {
        if !(q.is_finite() && p.is_finite()) {
            return Err(RunErrorKind::Start { coordinate, q, p });
        }
    }
    Ok(())
}

fn check_length(vector: &'static str, length: usize, expected: usize) -> Result<(), RunErrorKind> {
    if length == expected {
        return Ok(());
    }
    Err(RunErrorKind::Family(family::ModelError::StateLength {
        vector,
        length,
        expected,
    }))
}
