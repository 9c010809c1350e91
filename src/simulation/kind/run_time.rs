//! Runs of models of run-time length.

use super::super::acting;
use super::super::checks::{check_finite, check_impulse, conserves_energies};
use super::super::masses::mass_signs_by_entries;
use super::super::mesh::{Grid, Mesh};
use super::super::watch::Watch;
use super::{Chosen, Simulated, second};
use crate::error::RunErrorKind;
use crate::evaluate::names;
use crate::length::RunTimeLength;
use crate::motion::{Motion, Node, Warning};
use std::ops::Range;
use tfe_runtime::constrained::Trail;
use tfe_runtime::dual::Dual;
use tfe_runtime::enclosure::Enclosure;
use tfe_runtime::family::{self, FamilyState};
use tfe_runtime::step::{Control, Impulse};
use tfe_runtime::{CoordinateName, Element, Facts, InputFailure, Share, Statistics, StepError};

impl<M: family::Model> Simulated<0, RunTimeLength> for M {
    const FACTS: Facts = M::FACTS;
    // Without sparse factorisations, fixed-point iteration is the only method.
    const MAY_ITERATE: bool = M::FACTS.separable && !M::CONSTRAINED;
    const CONSERVES: bool = conserves_energies::<M>();

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
    ) -> Result<(), RunErrorKind> {
        self.check().map_err(RunErrorKind::Family)?;
        check_lengths(self.len(), start)?;
        for (time, impulse) in impulses {
            check_length("of an impulse", impulse.len(), self.len())?;
            check_impulse(*time, impulse)?;
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
        // Impulses act between elements, which end at breaks.
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

    fn stepper<'m>(
        model: Share<'m, M>,
        chosen: Chosen,
    ) -> Result<family::Stepper<'m, M>, RunErrorKind>
    where
        M: 'm,
    {
        let stepper = family::Stepper::sharing(model, chosen.element, chosen.control);
        cutting(stepper, chosen.at_kinks)
    }

    fn resumed<'m>(
        model: Share<'m, M>,
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
        cutting(stepper, chosen.at_kinks)
    }

    fn suspended(stepper: family::Stepper<'_, M>) -> family::Suspended {
        stepper.suspend()
    }

    fn is_that_of(&self, suspended: &family::Suspended) -> bool {
        suspended.is_of(self)
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

    fn exchange<'m>(
        stepper: &mut family::Stepper<'m, M>,
        model: Share<'m, M>,
    ) -> Result<(), RunErrorKind>
    where
        M: 'm,
    {
        stepper.set_model(model).map_err(RunErrorKind::Family)
    }

    fn advance(
        stepper: &mut family::Stepper<'_, M>,
        (t, h): (f64, f64),
        state: &mut FamilyState,
        _: &[Impulse<0>],
    ) -> Result<(), StepError> {
        stepper.advance(t, h, state)
    }

    fn reach(_: &mut family::Stepper<'_, M>, _: &mut Vec<(f64, f64)>) -> bool {
        false
    }

    fn reaches_within(_: &mut family::Stepper<'_, M>, _: &[(f64, f64)]) -> bool {
        false
    }

    fn outputs_within(&self, _: &[Enclosure], _: &mut [Enclosure]) -> bool {
        false
    }

    fn inside(
        stepper: &mut family::Stepper<'_, M>,
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

    fn kick(
        &self,
        impulses: &[(f64, Vec<f64>)],
        (t, h): (f64, f64),
        state: &mut FamilyState,
    ) -> bool {
        let is_kicked = acting::kick(impulses, (t, h), &mut state.p);
        if is_kicked && const { M::CONSTRAINED } {
            // Constraints react at once to the part of the impulses that violates them.
            let velocity = self.allowed_velocity(t, state, &state.p);
            state.p = match velocity {
                Some(v) => Simulated::momenta(self, t, &state.q, &v),
                None => vec![f64::NAN; state.p.len()],
            };
        }
        is_kicked
    }

    fn kick_at(&self, _: &[Impulse<0>], _: (f64, f64), _: &mut FamilyState) -> usize {
        0
    }

    fn check_restart(&self, _: f64, _: f64, state: &FamilyState) -> Result<(), RunErrorKind> {
        check_lengths(self.len(), state)
    }

    fn look(&self, _: &mut Watch, _: usize, _: (f64, f64), _: &FamilyState, _: bool) {}

    fn weigh(&self, start: &Node<0, RunTimeLength>) -> Option<Warning> {
        mass_signs_by_entries(self, start)
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
        names(self.parameters(), &|number| self.parameter_name(number))
    }

    fn with_value(&self, number: usize, value: f64) -> Option<Self> {
        self.with_parameter(number, value)
    }

    fn parameter_value(&self, number: usize) -> f64 {
        self.parameter(number)
    }

    fn guarded<T>(&self, f: impl FnOnce() -> T) -> Option<T> {
        family::Model::guarded(self, f).ok()
    }

    fn input_failure(&self) -> Option<InputFailure> {
        self.failed_input()
    }
}

/// Creates a stepper; it cuts steps at kinks if asked to.
fn cutting<'m, M: family::Model>(
    stepper: Result<family::Stepper<'m, M>, family::ModelError>,
    at_kinks: bool,
) -> Result<family::Stepper<'m, M>, RunErrorKind> {
    let stepper = stepper.map_err(RunErrorKind::Family)?;
    Ok(match at_kinks {
        true => stepper.at_kinks(),
        false => stepper,
    })
}

/// The reactions of constraints at a node.
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

/// Refuses states of the wrong length or with components that are not finite.
fn check_lengths(expected: usize, state: &FamilyState) -> Result<(), RunErrorKind> {
    check_length("q", state.q.len(), expected)?;
    check_length("p", state.p.len(), expected)?;
    check_finite(&state.q, &state.p)
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
