//! Runs of models of fixed size.

use super::super::acting;
use super::super::checks::{
    check_constraints, check_run, check_start, conserves_energy, may_be_of_first_order,
};
use super::super::masses::mass_signs;
use super::super::mesh::{Grid, Mesh};
use super::super::watch::Watch;
use super::{Chosen, Simulated, second};
use crate::error::RunErrorKind;
use crate::evaluate::names;
use crate::length::FixedLength;
use crate::motion::{Motion, Node, Warning};
use crate::sensitivity::slopes::momentum_by;
use std::ops::Range;
use tfe_runtime::constrained::{self, Trail};
use tfe_runtime::dual::{Dual, duals};
use tfe_runtime::enclosure::Enclosure;
use tfe_runtime::step::{Control, DenseElement, Impulse, Stepper, Suspended};
use tfe_runtime::{
    CoordinateName, Element, Facts, First, InputFailure, Model, ModelError, Second, Share, State,
    Statistics, StepError,
};

/// Creates a stepper; it cuts steps at kinks if asked to.
fn cutting<'m, M: Model<N>, const N: usize>(
    stepper: Result<Stepper<'m, M, N>, ModelError>,
    at_kinks: bool,
) -> Result<Stepper<'m, M, N>, RunErrorKind> {
    match stepper {
        Ok(stepper) if at_kinks => Ok(stepper.at_kinks()),
        Ok(stepper) => Ok(stepper),
        Err(error) => Err(RunErrorKind::of_stepper(error)),
    }
}

/// Whether the least and largest numbers that were reached lie within bounds.
#[inline]
fn lie_within(reached: &[(f64, f64)], bounds: &[(f64, f64)]) -> bool {
    let mut are_within = bounds.len() == reached.len();
    for ((low, high), (from, to)) in bounds.iter().zip(reached) {
        are_within &= low <= from && to <= high;
    }
    are_within
}

impl<M: Model<N>, const N: usize> Simulated<N, FixedLength> for M {
    const FACTS: Facts = M::FACTS;
    const MAY_ITERATE: bool = !M::FACTS.linear && M::CONSTRAINTS.is_empty();
    const CONSERVES: bool = conserves_energy::<M, N>();

    fn coordinates(&self) -> usize {
        N
    }

    fn output_count(&self) -> usize {
        self.columns()
    }

    fn is_of_first_order(&self, t: f64, start: &State<N>) -> bool {
        if const { !may_be_of_first_order::<M, N>() } {
            return false;
        }
        let (mut first, mut second) = (First::ZERO, Second::ZERO);
        self.second(t, &start.q, &start.p, &mut first, &mut second);
        second.zz.as_flattened().iter().all(|entry| *entry == 0.0)
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

    fn check_start(&self, start: &State<N>, impulses: &[Impulse<N>]) -> Result<(), RunErrorKind> {
        match self.check() {
            Ok(()) => check_run(start, impulses),
            Err(error) => Err(RunErrorKind::Family(error)),
        }
    }

    fn check_first(&self, (t, h): (f64, f64), start: &State<N>) -> Result<(), RunErrorKind> {
        check_constraints(self, t, h, start)
    }

    fn mesh(span: &Range<f64>, grid: &Grid<'_, Impulse<N>>) -> Result<Mesh<N>, RunErrorKind> {
        grid.mesh(span, grid.impulses)
    }

    fn leave_behind(impulses: &mut Vec<Impulse<N>>, t: f64) {
        // Impulses at the end of a run act in its last element.
        acting::remove_at(impulses, t);
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

    fn is_that_of(&self, suspended: &Suspended<N>) -> bool {
        suspended.is_of(self)
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
        stepper.set_model(model).map_err(RunErrorKind::of_stepper)
    }

    fn advance(
        stepper: &mut Stepper<'_, M, N>,
        (t, h): (f64, f64),
        state: &mut State<N>,
        impulses: &[Impulse<N>],
    ) -> Result<(), StepError> {
        stepper.advance(t, h, state, impulses)
    }

    fn reach(stepper: &mut Stepper<'_, M, N>, bounds: &mut Vec<(f64, f64)>) -> bool {
        let Some(reach) = stepper.reach() else {
            return false;
        };
        bounds.extend(reach.q);
        bounds.extend(reach.z);
        true
    }

    fn reaches_within(stepper: &mut Stepper<'_, M, N>, bounds: &[(f64, f64)]) -> bool {
        match (stepper.reach(), bounds.split_at_checked(N)) {
            (Some(reach), Some((q, z))) => lie_within(&reach.q, q) && lie_within(&reach.z, z),
            _ => false,
        }
    }

    fn outputs_within(&self, bounds: &[Enclosure], values: &mut [Enclosure]) -> bool {
        let [t, rest @ ..] = bounds else { return false };
        let (rest, []) = rest.as_chunks::<N>() else {
            return false;
        };
        let [q, z] = rest else { return false };
        self.observables(*t, q, z, values);
        true
    }

    fn inside(
        stepper: &mut Stepper<'_, M, N>,
        spare: Option<DenseElement<N>>,
        (start, end): (f64, f64),
    ) -> DenseElement<N> {
        stepper.look_inside();
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

    fn acting(impulses: &[Impulse<N>], nodes: (f64, f64)) -> Vec<Impulse<N>> {
        acting::inside(impulses, nodes)
    }

    fn kick(&self, _: &[Impulse<N>], _: (f64, f64), _: &mut State<N>) -> bool {
        false
    }

    fn kick_at(&self, impulses: &[Impulse<N>], (t, h): (f64, f64), state: &mut State<N>) -> usize {
        let count = acting::kick_at(impulses, (t, h), &mut state.p);
        if const { !M::CONSTRAINTS.is_empty() } && count > 0 {
            // Constraints react at once to the part of the impulses that violates them.
            state.p = match self.allowed_velocity(t, state, &[0.0; N]) {
                Some(v) => Simulated::momenta(self, t, &state.q, &v),
                None => [f64::NAN; N],
            };
        }
        count
    }

    fn check_restart(&self, t: f64, h: f64, state: &State<N>) -> Result<(), RunErrorKind> {
        check_start(state)?;
        check_constraints(self, t, h, state)
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
        names(self.parameters(), &|number| self.parameter_name(number))
    }

    fn with_value(&self, number: usize, value: f64) -> Option<Self> {
        self.with_parameter(number, value)
    }

    fn parameter_value(&self, number: usize) -> f64 {
        self.parameter(number)
    }

    fn guarded<T>(&self, f: impl FnOnce() -> T) -> Option<T> {
        Model::guarded(self, f).ok()
    }

    fn input_failure(&self) -> Option<InputFailure> {
        self.failed_input()
    }
}
