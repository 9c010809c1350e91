//! Losses: numbers of a motion that are to be small, and their gradients.

use super::slopes::{Along, Change};
use crate::error::RunErrorKind;
use crate::motion::{Motion, Node};
use std::fmt;
use std::sync::Arc;
use tfe_runtime::{Model, State};

/// A number of a motion whose gradient is asked for: a sum of functions of its end, of outputs at the end, and of squares of what outputs are off from values given. For
/// [`Simulation::gradient`](crate::Simulation::gradient).
///
/// The integral of an expression is the end of a coordinate that has it as its velocity.
///
/// ```
/// use tfe::prelude::*;
/// use tfe::sensitivity::Loss;
///
/// let loss: Loss<1> = Loss::at_end(|node| 0.5 * (node.q[0] - 1.0).powi(2))
///     .and(Loss::output_at_end("energy"))
///     .and(Loss::squares("height", [0.5, 1.0], [0.3, 0.2]));
/// # let _ = loss;
/// ```
#[derive(Clone)]
pub struct Loss<'l, const N: usize> {
    terms: Vec<Term<'l, N>>,
}

type OfNode<'l, const N: usize> = Arc<dyn Fn(&Node<N>) -> f64 + Send + Sync + 'l>;

#[derive(Clone)]
enum Term<'l, const N: usize> {
    End(OfNode<'l, N>),
    Output(String),
    Squares(String, Vec<f64>, Vec<f64>),
}

impl<'l, const N: usize> Loss<'l, N> {
    /// A function of the last node. It is differentiated by differences of sixth order; what is an output of the model is differentiated exactly.
    pub fn at_end(function: impl Fn(&Node<N>) -> f64 + Send + Sync + 'l) -> Self {
        Self {
            terms: vec![Term::End(Arc::new(function))],
        }
    }

    /// The value of an output at the end.
    pub fn output_at_end(name: impl Into<String>) -> Self {
        Self {
            terms: vec![Term::Output(name.into())],
        }
    }

    /// ½ Σ (y(t_i) − m_i)² of an output y. Elements end at the times t_i, which lie in the span.
    pub fn squares(
        name: impl Into<String>,
        times: impl AsRef<[f64]>,
        values: impl AsRef<[f64]>,
    ) -> Self {
        let (times, values) = (times.as_ref().to_vec(), values.as_ref().to_vec());
        Self {
            terms: vec![Term::Squares(name.into(), times, values)],
        }
    }

    /// The sum of two.
    #[must_use]
    pub fn and(mut self, other: Self) -> Self {
        self.terms.extend(other.terms);
        self
    }

    /// Where it looks at the motion besides the end.
    pub(crate) fn times(&self) -> impl Iterator<Item = f64> {
        self.terms.iter().flat_map(|term| {
            match term {
                Term::Squares(_, times, _) => times.as_slice(),
                Term::End(_) | Term::Output(_) => &[],
            }
            .iter()
            .copied()
        })
    }

    /// What is wrong with it for a model and a span.
    pub(crate) fn check<M: Model<N>>(
        &self,
        model: &M,
        (start, end): (f64, f64),
    ) -> Result<(), RunErrorKind> {
        for term in &self.terms {
            let (Term::Output(name) | Term::Squares(name, ..)) = term else {
                continue;
            };
            let known = || (0..model.columns()).map(|at| model.column_name(at).to_string());
            if !known().any(|own| own == *name) {
                return Err(RunErrorKind::NoOutput {
                    name: name.clone(),
                    known: known().collect(),
                });
            }
            let Term::Squares(_, times, values) = term else {
                continue;
            };
            let within = start.min(end)..=start.max(end);
            let why = if times.len() != values.len() {
                "there are not as many times as values"
            } else if !times.iter().all(|t| within.contains(t)) {
                "not all times are in the span"
            } else if !values.iter().all(|value| value.is_finite()) {
                "not all values are finite"
            } else {
                continue;
            };
            return Err(RunErrorKind::Loss {
                name: name.clone(),
                why,
            });
        }
        Ok(())
    }

    /// Its value, and where and how it depends on the motion.
    pub(crate) fn looks<M: Model<N>>(&self, model: &M, motion: &Motion<N>) -> (f64, Vec<Look<N>>) {
        let nodes = motion.states();
        let last = nodes.len() - 1;
        let mut value = 0.0;
        let mut looks = Vec::new();
        let column = |name: &str| (0..model.columns()).find(|at| model.column_name(*at).is(name));
        let output = |node: usize, column: usize| motion.outputs().row(node).map(|row| row[column]);
        for term in &self.terms {
            match term {
                Term::End(function) => {
                    value += function(&nodes[last]);
                    looks.push(Look {
                        node: last,
                        by: partial(&nodes[last], &**function),
                    });
                }
                Term::Output(name) => {
                    let Some(column) = column(name) else { continue };
                    value += output(last, column).unwrap_or(f64::NAN);
                    let by = By::Output(column, 1.0);
                    looks.push(Look { node: last, by });
                }
                Term::Squares(name, times, values) => {
                    let Some(column) = column(name) else { continue };
                    for (t, measured) in times.iter().zip(values) {
                        let node = motion.nearest(*t);
                        let off = output(node, column).unwrap_or(f64::NAN) - measured;
                        value += 0.5 * off * off;
                        let by = By::Output(column, off);
                        looks.push(Look { node, by });
                    }
                }
            }
        }
        (value, looks)
    }
}

impl<const N: usize> fmt::Debug for Loss<'_, N> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Loss of {} terms", self.terms.len())
    }
}

/// A look of a loss at a node.
pub(crate) struct Look<const N: usize> {
    pub(crate) node: usize,
    by: By<N>,
}

/// The derivative of what is seen.
enum By<const N: usize> {
    /// By an output, times a factor.
    Output(usize, f64),
    /// By coordinates, momenta and velocities.
    Node {
        q: [f64; N],
        p: [f64; N],
        v: [f64; N],
    },
}

impl<const N: usize> Look<N> {
    /// What a change of the node does to the loss.
    pub(crate) fn slope<M: Model<N>>(&self, along: &Along<'_, M, N>, change: &Change<N>) -> f64 {
        let velocity = along.velocity(change);
        match &self.by {
            By::Output(column, factor) => factor * along.outputs(change, &velocity)[*column],
            By::Node { q, p, v } => (0..N)
                .map(|a| q[a] * change.q[a] + p[a] * change.p[a] + v[a] * velocity[a])
                .sum(),
        }
    }
}

/// The derivative of a function of a node, by differences of sixth order.
fn partial<const N: usize>(node: &Node<N>, function: &dyn Fn(&Node<N>) -> f64) -> By<N> {
    const WEIGHTS: [f64; 3] = [45.0 / 60.0, -9.0 / 60.0, 1.0 / 60.0];
    const DISTANCE: f64 = 2e-3;

    let by = |value: f64, part: &dyn Fn(&mut Node<N>, f64)| {
        let distance = DISTANCE * value.abs().max(1.0);
        let at = |step: f64| {
            let mut moved = *node;
            part(&mut moved, value + step);
            function(&moved)
        };
        let differences = (1..).zip(WEIGHTS).map(|(k, weight)| {
            let step = f64::from(k) * distance;
            weight * (at(step) - at(-step)) / distance
        });
        differences.sum::<f64>()
    };
    By::Node {
        q: std::array::from_fn(|a| by(node.q[a], &|moved, x| moved.q[a] = x)),
        p: std::array::from_fn(|a| by(node.p[a], &|moved, x| moved.p[a] = x)),
        v: std::array::from_fn(|a| by(node.v[a], &|moved, x| moved.v[a] = x)),
    }
}

/// The gradient of a loss, from [`Simulation::gradient`](crate::Simulation::gradient).
#[derive(Clone, Debug)]
pub struct LossGradient<const N: usize> {
    pub(crate) motion: Motion<N>,
    pub(crate) names: Vec<String>,
    pub(crate) by_parameters: Vec<f64>,
    pub(crate) by_start: State<N>,
}

impl<const N: usize> LossGradient<N> {
    /// The derivative by a parameter.
    ///
    /// # Panics
    /// Where no parameter has this name; [`get`](Self::get) does not.
    #[track_caller]
    pub fn by(&self, name: &str) -> f64 {
        self.get(name).unwrap_or_else(|| {
            let known = self.names.join("`, `");
            panic!("the model has no parameter `{name}`, only `{known}`")
        })
    }

    /// The derivative by a parameter; `None` where none has this name.
    pub fn get(&self, name: &str) -> Option<f64> {
        let place = self.names.iter().position(|own| own == name)?;
        self.by_parameters.get(place).copied()
    }

    /// The derivatives by all parameters, in the order of [`parameters`](Self::parameters).
    pub fn by_parameters(&self) -> &[f64] {
        &self.by_parameters
    }

    /// The names of the parameters, in the order of the struct.
    pub fn parameters(&self) -> &[String] {
        &self.names
    }

    /// The derivatives by q and p of the start.
    pub fn by_start(&self) -> State<N> {
        self.by_start
    }

    /// The motion.
    pub fn motion(&self) -> &Motion<N> {
        &self.motion
    }
}
