//! Runs step by step, with inputs that are set between steps.

use super::steps::Steps;
use crate::driven::{Cells, Driven, InputError, place};
use crate::error::RunErrorKind;
use crate::motion::Node;
use std::ops::Deref;
use std::sync::Arc;
use tfe_runtime::{Controlled, Form, Model, Statistics};

/// A run that goes on step by step, made by [`Simulation::hold`](crate::Simulation::hold).
///
/// An input keeps what it was [set](Self::set) to over the steps that follow: zero-order hold. No step allocates memory.
#[derive(Debug)]
pub struct Held<'m, M: Controlled<N>, const N: usize> {
    steps: Steps<'m, Driven<'m, M>, N>,
    cells: Arc<Cells>,
    node: HeldNode<N>,
    /// An input that cannot be set, to be told by the next step.
    refusal: Option<InputError>,
}

/// A node with its outputs; a [`Node`] by dereference.
#[derive(Clone, Debug, PartialEq)]
pub struct HeldNode<const N: usize> {
    node: Node<N>,
    outputs: Vec<f64>,
    names: &'static [&'static str],
}

impl<const N: usize> HeldNode<N> {
    /// All outputs, in the order of the declaration, with the inputs as they were over the last step.
    pub fn outputs(&self) -> &[f64] {
        &self.outputs
    }

    /// The output of a name.
    pub fn output(&self, name: &str) -> Option<f64> {
        let place = self.names.iter().position(|own| *own == name)?;
        self.outputs.get(place).copied()
    }
}

impl<const N: usize> Deref for HeldNode<N> {
    type Target = Node<N>;

    fn deref(&self) -> &Node<N> {
        &self.node
    }
}

impl<'m, M: Controlled<N>, const N: usize> Held<'m, M, N> {
    pub(super) fn new(
        mut steps: Steps<'m, Driven<'m, M>, N>,
        cells: Arc<Cells>,
    ) -> Result<Self, RunErrorKind> {
        let Some(node) = steps.node() else {
            // Not begun, it has an error to tell.
            return match steps.next() {
                Some(Err(kind)) => Err(kind),
                _ => Err(RunErrorKind::Step { step: f64::NAN }),
            };
        };
        let node = HeldNode {
            node,
            outputs: vec![0.0; M::OBSERVABLES.len()],
            names: M::OBSERVABLES,
        };
        let mut held = Self {
            steps,
            cells,
            node,
            refusal: None,
        };
        held.observe();
        Ok(held)
    }

    /// Sets an input from the node reached on. A name that the model does not declare, or a number that is not finite, changes nothing and stops the next step.
    pub fn set(&mut self, input: &str, value: f64) {
        match place::<M, N>(input) {
            Ok(place) if value.is_finite() => self.cells.set(place, value),
            Ok(_) => {
                let name = input.to_owned();
                self.refusal = Some(InputError::NotFinite { name, value });
            }
            Err(error) => self.refusal = Some(error),
        }
    }

    /// The node reached: t, q, v, p and outputs.
    pub fn node(&self) -> &HeldNode<N> {
        &self.node
    }

    /// Goes on by one step.
    ///
    /// # Errors
    /// [`RunErrorKind::Input`] once for what could not be [set](Self::set), and the run may go on; [`RunErrorKind::Solve`] where an element cannot be solved, and
    /// [`RunErrorKind::Ended`] after that. The node stays that before the step.
    pub fn advance(&mut self) -> Result<(), RunErrorKind> {
        if let Some(error) = self.refusal.take() {
            return Err(RunErrorKind::Input(error));
        }
        match self.steps.next() {
            Some(node) => self.node.node = node?,
            None => return Err(RunErrorKind::Ended { time: self.node.t }),
        }
        self.observe();
        Ok(())
    }

    /// What the steps so far have cost.
    pub fn statistics(&self) -> Statistics {
        self.steps.statistics()
    }

    fn observe(&mut self) {
        let HeldNode { node, outputs, .. } = &mut self.node;
        if let Some(model) = self.steps.model().filter(|_| !outputs.is_empty()) {
            let z = match M::FORM {
                Form::Lagrangian => &node.v,
                Form::Hamiltonian => &node.p,
            };
            model.observables(node.t, &node.q, z, outputs);
        }
    }
}
