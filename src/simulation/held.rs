//! Runs step by step, with inputs that are set between the steps.

use super::kind::Simulated;
use super::steps::Steps;
use crate::driven::{Cells, Driven, HasInputs, InputError, place};
use crate::error::RunErrorKind;
use crate::evaluate::Evaluate;
use crate::length::{FixedLength, Length};
use crate::motion::Node;
use crate::numbers::Short;
use std::fmt;
use std::ops::Deref;
use std::sync::Arc;
use tfe_runtime::{CoordinateName, Statistics};

/// A run step by step, in which inputs can be set between the steps; made by
/// [`Simulation::hold`](crate::Simulation::hold).
///
/// An input keeps the value it was [set](Self::set) to over the following steps (zero-order hold). Steps of models of
/// fixed size allocate no memory.
#[derive(Debug)]
pub struct Held<'m, M: 'm, const N: usize, L: Length<N> = FixedLength> {
    steps: Steps<'m, Driven<'m, M, L>, N, L>,
    cells: Arc<Cells>,
    node: HeldNode<N, L>,
    /// The error of an input that cannot be set; the next step returns it.
    refusal: Option<InputError>,
    samplers: Vec<Sampler<'m, N, L>>,
}

/// Sampled feedback with its own period.
struct Sampler<'m, const N: usize, L: Length<N>> {
    /// The index of the input.
    place: usize,
    start: f64,
    period: f64,
    /// The number of calls so far.
    count: u64,
    law: Law<'m, N, L>,
}

type Law<'m, const N: usize, L> = Box<dyn FnMut(&HeldNode<N, L>) -> f64 + Send + 'm>;

impl<const N: usize, L: Length<N>> fmt::Debug for Sampler<'_, N, L> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Sampler")
            .field("input", &self.place)
            .field("period", &self.period)
            .finish_non_exhaustive()
    }
}

/// A node with the values of the model's outputs; dereferences to [`Node`].
#[derive(Clone, Debug, PartialEq)]
pub struct HeldNode<const N: usize, L: Length<N> = FixedLength> {
    node: Node<N, L>,
    outputs: Vec<f64>,
    names: Arc<[CoordinateName]>,
}

impl<const N: usize, L: Length<N>> HeldNode<N, L> {
    /// All outputs, in the order of declaration and of sites, computed with the inputs of the last step.
    pub fn outputs(&self) -> &[f64] {
        &self.outputs
    }

    /// The value of one output, by its name: `stretch`, or `stretch[3]` for a site.
    pub fn output(&self, name: &str) -> Option<f64> {
        let place = self.names.iter().position(|own| own.is(name))?;
        self.outputs.get(place).copied()
    }
}

impl<const N: usize, L: Length<N>> Deref for HeldNode<N, L> {
    type Target = Node<N, L>;

    fn deref(&self) -> &Node<N, L> {
        &self.node
    }
}

impl<'m, M, const N: usize, L> Held<'m, M, N, L>
where
    M: HasInputs<N, L>,
    Driven<'m, M, L>: Simulated<N, L>,
    L: Length<N>,
{
    pub(super) fn new(
        mut steps: Steps<'m, Driven<'m, M, L>, N, L>,
        cells: Arc<Cells>,
    ) -> Result<Self, RunErrorKind> {
        let Some(node) = steps.node() else {
            // A sequence that could not begin still has its error to return.
            return match steps.next() {
                Some(Err(kind)) => Err(kind),
                _ => Err(RunErrorKind::Step { step: f64::NAN }),
            };
        };
        let names = steps.model().output_names();
        steps.keep_outputs(names.len(), &node);
        let node = HeldNode {
            node,
            outputs: vec![0.0; names.len()],
            names: names.into(),
        };
        let mut held = Self {
            steps,
            cells,
            node,
            refusal: None,
            samplers: Vec::new(),
        };
        held.observe();
        Ok(held)
    }

    /// Sets an input, from the current node on. If the model does not declare the name, or the value is not finite,
    /// nothing changes and the next [`advance`](Self::advance) returns an error.
    pub fn set(&mut self, input: &str, value: f64) {
        match place(M::INPUTS, input) {
            Ok(place) if value.is_finite() => {
                self.cells.set(place, value);
                self.steps.set_inputs();
            }
            Ok(_) => {
                let name = input.to_owned();
                self.refusal = Some(InputError::NotFinite { name, value });
            }
            Err(error) => self.refusal = Some(error),
        }
    }

    /// Samples a feedback law at its own rate: from the current node on, `law` is called every `period` (in units of
    /// time) with the node at that time, and its value is held as the input until the next sample.
    ///
    /// Several inputs may be sampled at different rates, and one input by several laws. An input that is
    /// [set](Self::set) by hand between two samples keeps that value until the next sample. Steps must end at the
    /// samples: choose the period as a multiple of the step size.
    ///
    /// ```
    /// use tfe::prelude::*;
    ///
    /// #[dynamics(coordinates(x), lagrangian = dot(x)^2/2, input(u), force(x) = u)]
    /// struct Mass;
    ///
    /// # fn main() -> Result<(), Box<dyn std::error::Error>> {
    /// // Deadbeat: in two samples of half a second the mass is where it is to be, at rest.
    /// let mut run = Simulation::new(&Mass).step(0.05).hold(Mass.state([1.0], [0.0]), 0.0)?;
    /// let period = 0.5;
    /// run.sample("u", period, move |node| -node.q[0] / (period * period) - 1.5 * node.v[0] / period)?;
    /// for _ in 0..20 {
    ///     run.advance()?;
    /// }
    /// assert!(run.node().q[0].abs() < 1e-13 && run.node().v[0].abs() < 1e-13);
    /// # Ok(())
    /// # }
    /// ```
    ///
    /// # Errors
    /// [`RunErrorKind::Input`] if the model does not declare the input, or the period is not positive or below a rounding
    /// of the time. If no step ends at the time of a sample, the step that passes it returns the error.
    pub fn sample(
        &mut self,
        input: &str,
        period: f64,
        law: impl FnMut(&HeldNode<N, L>) -> f64 + Send + 'm,
    ) -> Result<(), RunErrorKind> {
        let place = place(M::INPUTS, input).map_err(RunErrorKind::Input)?;
        let refused = |why: String| {
            let (name, time) = (input.to_owned(), self.node.t);
            RunErrorKind::Input(InputError::Sampling { name, time, why })
        };
        if !(period > 0.0 && period.is_finite()) {
            let period = Short(period);
            return Err(refused(format!(
                "the period is {period}, but must be positive and finite"
            )));
        }
        // No step is as short as a rounding of the time.
        if self.node.t + period == self.node.t || !period.is_normal() {
            let period = Short(period);
            return Err(refused(format!(
                "the period {period} is below a rounding of the time"
            )));
        }
        self.samplers.push(Sampler {
            place,
            start: self.node.t,
            period,
            count: 0,
            law: Box::new(law),
        });
        Ok(())
    }

    /// Calls the sampled feedbacks that are due.
    fn ask_samplers(&mut self) -> Result<(), InputError> {
        /// The tolerance of sampling times, in periods, in addition to the resolution of time.
        const ROUNDING: f64 = 1e-9;
        for sampler in &mut self.samplers {
            let Sampler { start, period, .. } = *sampler;
            #[allow(clippy::cast_precision_loss, reason = "a count of samples")]
            let count = sampler.count as f64;
            let late = (self.node.t - start).abs() / period - count;
            let times = self.node.t.abs().max(start.abs()) / period;
            let rounding = ROUNDING + 4.0 * f64::EPSILON * (times + count);
            if late < -rounding {
                continue;
            }
            let name = || M::INPUTS[sampler.place].to_owned();
            if late > rounding {
                return Err(InputError::Sampling {
                    name: name(),
                    time: self.node.t,
                    why: format!(
                        "a sample lies within the step before, {} before this time: the period must be a multiple of the step",
                        Short(late * period)
                    ),
                });
            }
            let value = (sampler.law)(&self.node);
            if !value.is_finite() {
                return Err(InputError::NotFinite {
                    name: name(),
                    value,
                });
            }
            self.cells.set(sampler.place, value);
            self.steps.set_inputs();
            sampler.count += 1;
        }
        Ok(())
    }

    /// The current node: t, q, v, p and the outputs.
    pub fn node(&self) -> &HeldNode<N, L> {
        &self.node
    }

    /// Makes one step.
    ///
    /// # Errors
    /// [`RunErrorKind::Input`] once, if an input could not be [set](Self::set); the run may continue.
    /// [`RunErrorKind::Solve`] if an element cannot be solved, and [`RunErrorKind::Ended`] from every call after that.
    /// After an error the current node is that before the step.
    pub fn advance(&mut self) -> Result<(), RunErrorKind> {
        if let Some(error) = self.refusal.take() {
            return Err(RunErrorKind::Input(error));
        }
        self.ask_samplers().map_err(RunErrorKind::Input)?;
        match self.steps.next() {
            Some(node) => self.node.node = node?,
            None => return Err(RunErrorKind::Ended { time: self.node.t }),
        }
        self.observe();
        Ok(())
    }

    /// Counts of iterations, evaluations and factorisations of the steps so far.
    pub fn statistics(&self) -> Statistics {
        self.steps.statistics()
    }

    fn observe(&mut self) {
        let HeldNode { node, outputs, .. } = &mut self.node;
        if !outputs.is_empty() {
            self.steps.outputs(node, outputs);
        }
    }
}
