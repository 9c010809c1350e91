//! The adjoint of a run of a model of run-time length, also across events (T-127).

use super::super::retrace::{moving, operator_failed};
use super::super::sensitive::jump::Jump;
use super::super::sensitive::transposed::Given;
use super::super::trail::{Between, Cut, Element, Trail};
use super::view::View;
use crate::error::RunErrorKind;
use crate::length::RunTimeLength;
use crate::motion::{Motion, Node};
use crate::sensitivity::loss::Seen;
use crate::sensitivity::varied::Varied;
use nalgebra::DMatrix;
use std::iter::{Peekable, Rev};
use std::slice::Iter;
use tfe_runtime::family::{self, OperatorError, TransitionOperator};
use tfe_runtime::step::Control;
use tfe_runtime::{InsideLoss, Partials};

/// The derivatives of a loss on their way back along a run.
pub(super) struct Backward<'a, M> {
    model: &'a M,
    control: Control,
    adjoint: family::Backwards<'a, M>,
    /// The derivatives by parameters through the actions of events.
    by_actions: Vec<f64>,
}

impl<'a, M: family::Model> Backward<'a, M> {
    pub(super) fn new(
        model: &'a M,
        element: tfe_runtime::Element,
        control: Control,
    ) -> Result<Self, RunErrorKind> {
        let adjoint = family::Backwards::new(model, element, control);
        Ok(Self {
            model,
            control,
            adjoint: adjoint.map_err(|error| operator_failed(error, None, CALL))?,
            by_actions: vec![0.0; model.parameters()],
        })
    }

    /// The derivatives by the state at the start, in the order (p, q).
    pub(super) fn by_start(&self) -> &[f64] {
        self.adjoint.by_state()
    }

    pub(super) fn by_parameters(&self) -> Vec<f64> {
        let both = self.adjoint.by_parameters().into_iter();
        let both = both.zip(&self.by_actions);
        both.map(|(own, by_actions)| own + by_actions).collect()
    }

    /// Passes backward over a motion and its trail.
    pub(super) fn pass(
        &mut self,
        (motion, trail): (&Motion<0, RunTimeLength>, &Trail<'_, M>),
        seen: &Seen,
    ) -> Result<(), RunErrorKind> {
        // The elements behind such an event belong to another model.
        let is_set = |(_, record): &(usize, Between<'_, M>)| matches!(record, Between::Set(_));
        if trail.between.iter().any(is_set) {
            return Err(RunErrorKind::SetUnsupported { call: CALL });
        }
        let view: View<'_, M, 0, RunTimeLength> = View::new(self.model, seen, &motion.last().v);
        let last = motion.states().len() - 1;
        // The time of the last node is that of the event that has stopped the run.
        let by_time = match motion.is_stopped() {
            true => view.by_time(last, motion.last()),
            false => 0.0,
        };
        let mut pass = Pass {
            to: self,
            motion,
            elements: &trail.elements,
            view,
            left: trail.elements.len(),
            by_time,
        };
        pass.run(trail).map_err(|failure| match failure {
            Failure::Element(error) => operator_failed(error, trail.elements.get(pass.left), CALL),
            Failure::Kind(kind) => kind,
        })
    }
}

/// The call that the user has made.
const CALL: &str = "gradient";

/// Why there is no gradient.
enum Failure {
    /// An element has no derivative.
    Element(OperatorError),
    /// An event or the loss has no derivative.
    Kind(RunErrorKind),
}

impl From<OperatorError> for Failure {
    fn from(error: OperatorError) -> Self {
        Self::Element(error)
    }
}

impl From<RunErrorKind> for Failure {
    fn from(kind: RunErrorKind) -> Self {
        Self::Kind(kind)
    }
}

/// The records between elements, from the last to the first.
type Records<'t, 'm, M> = Peekable<Rev<Iter<'t, (usize, Between<'m, M>)>>>;

/// One pass over a trail, from its end to its start.
struct Pass<'p, 'a, M> {
    to: &'p mut Backward<'a, M>,
    motion: &'p Motion<0, RunTimeLength>,
    elements: &'p [Element],
    view: View<'p, M, 0, RunTimeLength>,
    /// The number of elements that are left; during the pass over an element its index.
    left: usize,
    /// The derivative of the loss by the time at which the rest of the motion begins, if that is the time of an event.
    by_time: f64,
}

/// An element with an end that moves, solved once more.
struct Solved {
    transition: TransitionOperator,
    /// The derivatives of the integrals by its polynomial, and by the times of its start and its end.
    inside: Option<InsideLoss>,
    by_ends: [f64; 2],
}

/// The index of the direction of the end of an element that an event ends.
fn end_of(element: &Element) -> usize {
    usize::from(element.moves.0)
}

impl Solved {
    /// ẏ at the event that ends the element.
    fn by_end(&self, element: &Element) -> &[f64] {
        &self.transition.by_parameters()[end_of(element)]
    }

    /// The derivative of the loss along a direction of the element, given that by its end.
    fn along(&self, direction: usize, lambda: &[f64]) -> f64 {
        let by_end = product(lambda, &self.transition.by_parameters()[direction]);
        let inside = self.inside.as_ref().map_or(0.0, |inside| {
            let slopes = &self.transition.inside_by_parameters()[direction];
            product(&inside.coefficients, slopes)
        });
        by_end + inside
    }
}

fn product(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

impl<M: family::Model> Pass<'_, '_, M> {
    fn run(&mut self, trail: &Trail<'_, M>) -> Result<(), Failure> {
        let mut records = trail.between.iter().rev().peekable();
        loop {
            while let Some((_, record)) = records.next_if(|(at, _)| *at == self.left) {
                match record {
                    Between::Node(number) => self.look(*number)?,
                    Between::Kicked(kicked) => self.to.adjoint.kick(kicked.t, &kicked.with)?,
                    Between::Acted => self.pass_event(&mut records)?,
                    // A cut is passed with the record of its action; a setting is refused before.
                    Between::Cut(_) | Between::Set(_) => {}
                }
            }
            let Some(left) = self.left.checked_sub(1) else {
                return Ok(());
            };
            self.left = left;
            self.pass_element()?;
        }
    }

    /// Adds the direct derivatives of the loss by a node.
    fn look(&mut self, number: usize) -> Result<(), Failure> {
        let node = &self.motion.states()[number];
        if let Some(partials) = self.view.of_node(number) {
            let at = (&node.state(), &node.v[..]);
            self.to.adjoint.see(node.t, at, &partials)?;
        }
        Ok(())
    }

    /// Passes an element that no event ends.
    fn pass_element(&mut self) -> Result<(), Failure> {
        let element = &self.elements[self.left];
        if element.moves.0 {
            let solved = self.solved(element)?;
            return self.pass_solved(element, &solved);
        }
        let dense = &self.motion.elements()[self.left];
        let inside = self.view.of_element(&mut self.to.adjoint, dense)?;
        let place = (element.t, element.h);
        let end = (self.to.adjoint).pass(place, &element.before, inside.first())?;
        element.check(self.to.model, &end, self.to.control.tolerance)?;
        Ok(())
    }

    /// Solves an element with ends that move once more.
    fn solved(&mut self, element: &Element) -> Result<Solved, Failure> {
        let dense = &self.motion.elements()[self.left];
        let inside = self.view.of_element(&mut self.to.adjoint, dense)?;
        let by_ends = self.view.by_ends(dense)?;
        let directions: Vec<_> = moving(element).collect();
        let place = (element.t, element.h);
        let transition = (self.to.adjoint).linearised(place, &element.before, &directions)?;
        element.check(self.to.model, transition.end(), self.to.control.tolerance)?;
        Ok(Solved {
            transition,
            inside: inside.into_iter().next(),
            by_ends,
        })
    }

    /// Passes it, from the derivatives at its end, which is then at a fixed time.
    fn pass_solved(&mut self, element: &Element, solved: &Solved) -> Result<(), Failure> {
        let adjoint = &mut self.to.adjoint;
        self.by_time = match element.moves.0 {
            true => solved.along(0, adjoint.by_state()) + solved.by_ends[0],
            false => 0.0,
        };
        let place = (element.t, element.h);
        adjoint.pass_linearised(place, &solved.transition, solved.inside.as_ref())?;
        Ok(())
    }

    /// Passes an event from its action, the record of which was the last, and the element that it ends:
    ///
    /// ```text
    /// λ* = λ S_y ,     κ* = κ + λ S_t + λ* ẏ ,     λ_at = λ* − κ* g_y/ġ
    /// ```
    ///
    /// with the derivatives λ by the state and κ by the time of the event.
    fn pass_event(&mut self, records: &mut Records<'_, '_, M>) -> Result<(), Failure> {
        let Some((cut, nodes)) = before_action(records) else {
            return Ok(());
        };
        let severed = cut.severed();
        let failed = |source| RunErrorKind::Transition {
            element: cut.element,
            time: severed.start,
            step: severed.length,
            source,
        };
        let event = severed.event;
        let node = Node::<0, RunTimeLength>::of(event.t, &event.state(), event.v.clone());
        let ended = match severed.inside {
            true => {
                self.left -= 1;
                let element = &self.elements[self.left];
                Some((element, self.solved(element)?))
            }
            false => None,
        };
        let rate = match &ended {
            Some((element, solved)) => solved.by_end(element).to_vec(),
            None => [self.to.model.push(&node), event.v.clone()].concat(),
        };
        let column = DMatrix::from_column_slice(rate.len(), 1, &rate);
        let jump = Jump::at(self.to.model, &severed, &node, &column);
        if severed.goes_on {
            let lambda = self.to.adjoint.take_by_state();
            let given = jump.given(self.to.model, &lambda).map_err(failed)?;
            self.pass_action(&node, &given)?;
        }
        for number in nodes {
            self.look(number)?;
        }
        let by_start = self.by_time;
        self.by_time += match &ended {
            Some((element, solved)) => {
                let lambda = self.to.adjoint.by_state();
                solved.along(end_of(element), lambda) + solved.by_ends[1]
            }
            None => product(self.to.adjoint.by_state(), &rate),
        };
        let of_time = jump.of_time(self.by_time).map_err(failed)?;
        let Some(partials) = of_time else {
            // The event has the time of the start of the element.
            self.by_time = by_start;
            return Ok(());
        };
        let at = (&node.state(), &node.v[..]);
        self.to.adjoint.see(node.t, at, &partials)?;
        match &ended {
            Some((element, solved)) => self.pass_solved(element, solved)?,
            // The state at a fixed time is reached from the start, which may move.
            None => self.by_time = -product(self.to.adjoint.by_state(), &rate),
        }
        Ok(())
    }

    /// Adds the derivatives by what an action was given at a node.
    fn pass_action(&mut self, node: &Node<0, RunTimeLength>, given: &Given) -> Result<(), Failure> {
        self.by_time += given.by_time;
        for (sum, own) in self.to.by_actions.iter_mut().zip(&given.by_parameters) {
            *sum += own;
        }
        let n = node.q.len();
        let (of_p, of_q) = given.by_state.split_at(n);
        let partials = Partials {
            q: of_q.to_vec(),
            p: of_p.to_vec(),
            ..Partials::none(n, self.to.model.columns())
        };
        let at = (&node.state(), &node.v[..]);
        self.to.adjoint.see(node.t, at, &partials)?;
        Ok(())
    }
}

/// The event of an action, the record of which was the last, and the nodes that were recorded between the two.
fn before_action<'t, 'm, M>(records: &mut Records<'t, 'm, M>) -> Option<(&'t Cut<'m>, Vec<usize>)> {
    let mut nodes = Vec::new();
    for (_, record) in records {
        match record {
            Between::Cut(cut) => return Some((&**cut, nodes)),
            Between::Node(number) => nodes.push(*number),
            Between::Acted | Between::Set(_) | Between::Kicked(_) => {}
        }
    }
    None
}
