//! Solves the elements of a recorded run once more, for their derivatives.

use super::setup::Simulation;
use super::trail::{Between, Element, Kicked, LONG_STEPS, Trail};
use crate::error::RunErrorKind;
use crate::length::RunTimeLength;
use tfe_runtime::family::{self, OperatorError, TransitionOperator};
use tfe_runtime::{Direction, Parameter};

/// Receives the elements of a recorded run with their derivatives, and the records between them, in the order of the
/// run.
pub(super) trait Retrace<'m, M> {
    /// Processes an element with its derivatives by the parameters, followed by those by its start time, if an event
    /// precedes it, and by its end time, if an event ends it.
    fn element(
        &mut self,
        model: &M,
        element: &Element,
        transition: &TransitionOperator,
    ) -> Result<(), OperatorError>;

    /// Processes the impulses at the start of the next element.
    fn kicked(&mut self, model: &M, kicked: &Kicked) -> Result<(), OperatorError>;

    /// Processes another record between elements; `model` has the parameters that were set before.
    fn between(&mut self, model: &M, between: &Between<'m, M>) -> Result<(), RunErrorKind>;
}

impl<'m, M: family::Model> Simulation<'m, M, 0, RunTimeLength> {
    /// Solves the elements of a trail once more and passes them to `follower`, with the derivatives by parameters of
    /// given indices. Errors name `call`, the method that the user has called.
    ///
    /// # Errors
    /// If an element or an event has no derivative.
    pub(super) fn retrace(
        &self,
        call: &'static str,
        trail: &Trail<'m, M>,
        parameters: &[usize],
        follower: &mut dyn Retrace<'m, M>,
    ) -> Result<(), RunErrorKind> {
        let by = |&index: &usize| Direction {
            parameter: Some(Parameter::Any(index)),
            ..Direction::default()
        };
        let named: Vec<Direction> = parameters.iter().map(by).collect();
        let directions = |element: &Element| {
            let all = named.iter().copied().chain(moving(element));
            all.collect::<Vec<_>>()
        };
        let elements = &trail.elements;
        let mut between = trail.between.iter().peekable();
        let mut model = self.model.clone();
        let mut passed = 0;
        loop {
            while let Some((_, one)) = between.next_if(|(at, _)| *at == passed) {
                if let Between::Set(other) = one {
                    model = other.clone();
                }
                tell(follower, &*model, one, (elements.get(passed), call))?;
            }
            if passed == elements.len() {
                return Ok(());
            }
            // The elements up to the next change of parameters, all of one model.
            let sets = |(_, one): &&(usize, Between<'m, M>)| matches!(one, Between::Set(_));
            let end = between
                .clone()
                .find(sets)
                .map_or(elements.len(), |(at, _)| *at);
            let mut refusal = None;
            let steps = elements[passed..end].iter();
            let steps = steps.map(|one| ((one.t, one.h, &one.before), directions(one)));
            let each = |transition: TransitionOperator| {
                let element = &elements[passed];
                element.check(&*model, transition.end(), self.control.tolerance)?;
                follower.element(&*model, element, &transition)?;
                passed += 1;
                if passed == end {
                    return Ok(());
                }
                while let Some((_, one)) = between.next_if(|(at, _)| *at == passed) {
                    let next = elements.get(passed);
                    if let Err(kind) = tell(follower, &*model, one, (next, call)) {
                        refusal = Some(kind);
                        return Err(OperatorError::Cut);
                    }
                }
                Ok(())
            };
            let element = self.chosen_element();
            let found = TransitionOperator::of_steps_towards(&*model, element, 0.0, steps, each);
            if let Err((_, error)) = found {
                return Err(
                    refusal.unwrap_or_else(|| operator_failed(error, elements.get(passed), call))
                );
            }
        }
    }
}

/// Passes a record to a follower, given the element that follows, if there is one.
fn tell<'m, M>(
    follower: &mut dyn Retrace<'m, M>,
    model: &M,
    record: &Between<'m, M>,
    (next, call): (Option<&Element>, &'static str),
) -> Result<(), RunErrorKind> {
    match record {
        Between::Kicked(kicked) => {
            let done = follower.kicked(model, kicked);
            done.map_err(|error| operator_failed(error, next, call))
        }
        _ => follower.between(model, record),
    }
}

/// The directions in which events move the ends of an element: its start, then its end.
pub(super) fn moving(element: &Element) -> impl Iterator<Item = Direction> {
    let (starts, ends) = element.moves;
    let start = starts.then_some(Direction::START);
    start.into_iter().chain(ends.then_some(Direction::END))
}

/// The error of a run one of whose elements has no derivative.
pub(super) fn operator_failed(
    error: OperatorError,
    at: Option<&Element>,
    call: &'static str,
) -> RunErrorKind {
    match error {
        OperatorError::Family(error) => RunErrorKind::Family(error),
        OperatorError::Step(source) => {
            let (element, time, step) = at.map_or((0, f64::NAN, f64::NAN), |element| {
                (element.number, element.t, element.h)
            });
            RunErrorKind::Solve {
                element,
                time,
                step,
                source,
            }
        }
        OperatorError::Cut => RunErrorKind::Unsupported {
            call,
            of: LONG_STEPS,
        },
        _ => RunErrorKind::Unsupported {
            call,
            of: "models of run-time length",
        },
    }
}
