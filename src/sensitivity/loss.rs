//! Losses: numbers computed from a motion that are to be minimised, and their gradients.

use crate::differences::{derivative, derivative_of_either, resolved};
use crate::error::{RunError, RunErrorKind};
use crate::evaluate::Evaluate;
use crate::length::{FixedLength, Length};
use crate::motion::{Motion, Node, is_unresolved, looked_at};
use crate::sensitivity::names::place_of;
use std::fmt;
use std::sync::Arc;
use tfe_runtime::CoordinateName;

/// A loss: a number computed from a motion, whose gradient is wanted. It is a sum of functions of the end of the
/// motion, of outputs at the end, of time integrals of outputs, and of squared deviations of outputs from measured
/// values. Used by [`Simulation::gradient`](crate::Simulation::gradient).
///
/// ```
/// use tfe::prelude::*;
/// use tfe::sensitivity::Loss;
///
/// let loss: Loss<1> = Loss::at_end(|node| 0.5 * (node.q[0] - 1.0).powi(2))
///     .and(Loss::output_at_end("energy"))
///     .and(Loss::integral("effort").times(0.1))
///     .and(Loss::squares("height", [0.5, 1.0], [0.3, 0.2]));
/// # let _ = loss;
/// ```
#[derive(Clone)]
pub struct Loss<'l, const N: usize, L: Length<N> = FixedLength> {
    /// The terms with their factors.
    terms: Vec<(f64, Term<'l, N, L>)>,
}

type OfNode<'l, const N: usize, L> = Arc<dyn Fn(&Node<N, L>) -> f64 + Send + Sync + 'l>;

#[derive(Clone)]
enum Term<'l, const N: usize, L: Length<N>> {
    End(OfNode<'l, N, L>),
    Output(String),
    Integral(String),
    Squares(String, Vec<f64>, Vec<f64>),
}

impl<const N: usize, L: Length<N>> Term<'_, N, L> {
    fn name(&self) -> &str {
        match self {
            Self::End(_) => "a function of the end",
            Self::Output(name) | Self::Integral(name) | Self::Squares(name, ..) => name,
        }
    }
}

impl<'l, const N: usize> Loss<'l, N> {
    /// A function of the last node, for models of fixed size; [`of_end`](Self::of_end) is for models of either kind.
    /// Its derivatives are differences of sixth order; an output of the model ([`output_at_end`](Self::output_at_end))
    /// is differentiated exactly.
    pub fn at_end(function: impl Fn(&Node<N>) -> f64 + Send + Sync + 'l) -> Self {
        Self::of(Term::End(Arc::new(function)))
    }
}

impl<'l, const N: usize, L: Length<N>> Loss<'l, N, L> {
    /// A function of the coordinates, momenta and velocities at the end, in this order, for models of either kind of
    /// length. Its derivatives are differences of sixth order; an output of the model
    /// ([`output_at_end`](Self::output_at_end)) is differentiated exactly.
    ///
    /// ```
    /// use tfe::family::Loss;
    ///
    /// let loss: Loss = Loss::of_end(|q, _p, v| 0.5 * q[0] * q[0] + v[1]);
    /// # let _ = loss;
    /// ```
    pub fn of_end(function: impl Fn(&[f64], &[f64], &[f64]) -> f64 + Send + Sync + 'l) -> Self {
        let of_node = move |node: &Node<N, L>| {
            let parts = [&node.q, &node.p, &node.v];
            let [q, p, v] = parts.map(AsRef::as_ref);
            function(q, p, v)
        };
        Self::of(Term::End(Arc::new(of_node)))
    }

    /// The value of an output of the model at the end of the motion.
    pub fn output_at_end(name: impl Into<String>) -> Self {
        Self::of(Term::Output(name.into()))
    }

    /// A running loss ∫ y dt of an output y over the span, by the Gauss points of every element, as
    /// [`Motion::integral`] computes it.
    ///
    /// ```
    /// use tfe::prelude::*;
    /// use tfe::sensitivity::Loss;
    ///
    /// #[dynamics(coordinates(y), lagrangian = m/2*dot(y)^2 - m*g*y, output(height) = y)]
    /// struct Ball { m: f64, g: f64 }
    ///
    /// # fn main() -> Result<(), Box<dyn std::error::Error>> {
    /// let ball = Ball { m: 1.0, g: 9.81 };
    /// let (mean, gradient) = Simulation::new(&ball).step(0.1).gradient(ball.state([1.0], [4.0]), 0.0..1.0, &Loss::integral("height"))?;
    /// assert!((mean - (1.0 + 4.0/2.0 - 9.81/6.0)).abs() < 1e-13);
    /// assert!((gradient.by("g") + 1.0/6.0).abs() < 1e-13);
    /// # Ok(())
    /// # }
    /// ```
    pub fn integral(name: impl Into<String>) -> Self {
        Self::of(Term::Integral(name.into()))
    }

    /// Least squares ½ Σ (y(t_i) − m_i)² of an output y and measured values m_i. Elements end at the times t_i, which
    /// must lie in the span.
    pub fn squares(
        name: impl Into<String>,
        times: impl AsRef<[f64]>,
        values: impl AsRef<[f64]>,
    ) -> Self {
        let (times, values) = (times.as_ref().to_vec(), values.as_ref().to_vec());
        Self::of(Term::Squares(name.into(), times, values))
    }

    /// Multiplies the loss by a factor, for example a weight.
    #[must_use]
    pub fn times(mut self, factor: f64) -> Self {
        for (own, _) in &mut self.terms {
            *own *= factor;
        }
        self
    }

    fn of(term: Term<'l, N, L>) -> Self {
        Self {
            terms: vec![(1.0, term)],
        }
    }

    /// The sum of two losses.
    #[must_use]
    pub fn and(mut self, other: Self) -> Self {
        self.terms.extend(other.terms);
        self
    }

    /// The part of the loss that belongs to a part of the motion between two nodes. The first node is included only in
    /// the first part, and the terms of the end only in the last.
    pub(crate) fn part(&self, (from, to): (f64, f64), (is_first, is_last): (bool, bool)) -> Self {
        let place = |t: f64| (t - from) / (to - from);
        let is_in = |t: f64| (place(t) > 0.0 || is_first) && place(t) <= 1.0;
        let of_term = |(factor, term): &(f64, Term<'l, N, L>)| match term {
            Term::End(_) | Term::Output(_) => is_last.then(|| (*factor, term.clone())),
            Term::Integral(_) => Some((*factor, term.clone())),
            Term::Squares(name, times, values) => {
                let pairs = times.iter().zip(values).filter(|(t, _)| is_in(**t));
                let (times, values) = pairs.unzip();
                Some((*factor, Term::Squares(name.clone(), times, values)))
            }
        };
        Self {
            terms: self.terms.iter().filter_map(of_term).collect(),
        }
    }

    /// Whether the loss contains integrals, which depend on the motion between the nodes.
    pub(crate) fn has_integrals(&self) -> bool {
        let mut terms = self.terms.iter();
        terms.any(|(_, term)| matches!(term, Term::Integral(_)))
    }

    /// The times at which the loss observes the motion, except the end; in addition to the `known` nodes of the run.
    pub(crate) fn nodes(&self, known: &[f64]) -> Vec<f64> {
        let times = self.terms.iter().flat_map(|(_, term)| {
            match term {
                Term::Squares(_, times, _) => times.as_slice(),
                Term::End(_) | Term::Output(_) | Term::Integral(_) => &[],
            }
            .iter()
            .copied()
        });
        looked_at(times, known)
    }

    /// Checks the loss for a model with given outputs, and a span.
    pub(crate) fn check(
        &self,
        outputs: &[CoordinateName],
        (start, end): (f64, f64),
    ) -> Result<(), RunErrorKind> {
        for (factor, term) in &self.terms {
            let refused = |why| RunErrorKind::Loss {
                name: term.name().to_owned(),
                why,
            };
            if !factor.is_finite() {
                return Err(refused("its factor is not finite"));
            }
            let (Term::Output(name) | Term::Integral(name) | Term::Squares(name, ..)) = term else {
                continue;
            };
            if !outputs.iter().any(|own| own.is(name)) {
                return Err(RunErrorKind::NoOutput {
                    name: name.clone(),
                    known: outputs.iter().map(ToString::to_string).collect(),
                });
            }
            let Term::Squares(_, times, values) = term else {
                continue;
            };
            let within = start.min(end)..=start.max(end);
            let why = if times.len() != values.len() {
                "the numbers of times and values differ"
            } else if !times.iter().all(|t| within.contains(t)) {
                "not all times are in the span"
            } else if !values.iter().all(|value| value.is_finite()) {
                "not all values are finite"
            } else {
                continue;
            };
            return Err(refused(why));
        }
        Ok(())
    }

    /// The value of the loss and its derivatives by the motion; an error if they are not finite.
    pub(crate) fn seen<M: Evaluate<N, L>>(
        &self,
        motion: &Motion<N, L>,
        model: &M,
    ) -> Result<(f64, Seen), RunErrorKind> {
        let nodes = motion.states();
        let last = nodes.len() - 1;
        let mut value = 0.0;
        let (mut looks, mut integrals) = (Vec::new(), Vec::new());
        let names = motion.outputs().names();
        let column = |name: &str| names.iter().position(|own| own.is(name));
        let output = |node: usize, column: usize| motion.outputs().row(node).map(|row| row[column]);
        for (factor, term) in &self.terms {
            let (before, first) = (value, looks.len());
            match term {
                Term::End(function) => {
                    value += factor * function(&nodes[last]);
                    // If an event determines the end, its time depends on the start and the parameters.
                    let span = (nodes[last].t - nodes[0].t).abs();
                    let span = (motion.is_stopped() && span > 0.0).then_some(span);
                    let by = partial(&nodes[last], (*factor, span), &**function);
                    looks.push(Look { node: last, by });
                }
                Term::Output(name) => {
                    let Some(column) = column(name) else { continue };
                    value += factor * output(last, column).unwrap_or(f64::NAN);
                    let by = By::Output(column, *factor);
                    looks.push(Look { node: last, by });
                }
                Term::Integral(name) => {
                    let Some(column) = column(name) else { continue };
                    let integral = motion.integral(model, name).ok();
                    let integral = integral.and_then(|all| all.last().copied());
                    value += factor * integral.unwrap_or(f64::NAN);
                    integrals.push((column, *factor));
                }
                Term::Squares(name, times, values) => {
                    let Some(column) = column(name) else { continue };
                    for (t, measured) in times.iter().zip(values) {
                        let node = motion.nearest(*t);
                        if !is_unresolved(nodes[node].t, *t) {
                            return Err(RunErrorKind::Loss {
                                name: name.clone(),
                                why: "an event has stopped the run before all of its times",
                            });
                        }
                        let off = output(node, column).unwrap_or(f64::NAN) - measured;
                        value += factor * 0.5 * off * off;
                        let by = By::Output(column, factor * off);
                        looks.push(Look { node, by });
                    }
                }
            }
            let is_finite = |look: &Look| match &look.by {
                By::Output(_, factor) => factor.is_finite(),
                By::Node { q, p, v, .. } => {
                    let mut all = q.iter().chain(p).chain(v);
                    all.all(|one| one.is_finite())
                }
            };
            if !((value - before).is_finite() && looks[first..].iter().all(is_finite)) {
                return Err(RunErrorKind::Loss {
                    name: term.name().to_owned(),
                    why: "its values or their derivatives are not finite",
                });
            }
        }
        // Sorted in the order of the nodes, in which they are used.
        looks.sort_by_key(|look| look.node);
        Ok((value, Seen { looks, integrals }))
    }
}

impl<const N: usize, L: Length<N>> fmt::Debug for Loss<'_, N, L> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Loss of {} terms", self.terms.len())
    }
}

/// The derivatives of a loss by a motion.
pub(crate) struct Seen {
    /// The derivatives at nodes, in the order of the nodes.
    looks: Vec<Look>,
    /// The integrals of outputs, with their factors.
    pub(crate) integrals: Vec<(usize, f64)>,
}

impl Seen {
    /// The derivatives at a node.
    pub(crate) fn of_node(&self, node: usize) -> &[Look] {
        let first = self.looks.partition_point(|look| look.node < node);
        let own = &self.looks[first..];
        &own[..own.partition_point(|look| look.node == node)]
    }
}

/// A derivative of a loss at a node.
pub(crate) struct Look {
    node: usize,
    pub(crate) by: By,
}

/// The form of such a derivative.
pub(crate) enum By {
    /// By an output, with a factor.
    Output(usize, f64),
    /// By time, coordinates, momenta and velocities.
    Node {
        t: f64,
        q: Vec<f64>,
        p: Vec<f64>,
        v: Vec<f64>,
    },
}

/// The derivatives of a function of a node, by sixth-order differences; for the time derivative, the step is relative
/// to a `span` of time, and zero if there is none.
fn partial<const N: usize, L: Length<N>>(
    node: &Node<N, L>,
    (factor, span): (f64, Option<f64>),
    function: &dyn Fn(&Node<N, L>) -> f64,
) -> By {
    const DISTANCE: f64 = 2e-3;
    /// The step in time relative to the span, in which the function may oscillate many times.
    const DISTANCE_IN_TIME: f64 = 2e-5;

    type Part<const N: usize, L> = fn(&mut Node<N, L>) -> &mut <L as Length<N>>::Vector;
    let by = |part: Part<N, L>| -> Vec<f64> {
        let mut moved = node.clone();
        let still = part(&mut moved).clone();
        let slope = |(a, value): (usize, &f64)| {
            let at = |step: f64| {
                let with = |b: usize| still.as_ref()[b] + if a == b { step } else { 0.0 };
                *part(&mut moved) = L::from_fn(&still, with);
                function(&moved)
            };
            let sizes = [value.abs().max(1.0), value.abs()];
            factor * derivative_of_either(sizes.map(|size| DISTANCE * size), at)
        };
        still.as_ref().iter().enumerate().map(slope).collect()
    };
    let by_time = |span: f64| {
        let mut moved = node.clone();
        let at = |step: f64| {
            moved.t = node.t + step;
            function(&moved)
        };
        factor * derivative(resolved(DISTANCE_IN_TIME * span, node.t), at)
    };
    By::Node {
        t: span.map_or(0.0, by_time),
        q: by(|node| &mut node.q),
        p: by(|node| &mut node.p),
        v: by(|node| &mut node.v),
    }
}

/// A loss of a motion and its gradient, from [`Simulation::gradient`](crate::Simulation::gradient).
#[derive(Clone, Debug)]
pub struct LossGradient<const N: usize, L: Length<N> = FixedLength> {
    motion: Motion<N, L>,
    names: Vec<String>,
    by_parameters: Vec<f64>,
    by_start: L::State,
}

impl<const N: usize, L: Length<N>> LossGradient<N, L> {
    /// From the derivatives by the start, in the order (p, q); an error if one is not finite.
    pub(crate) fn new(
        motion: Motion<N, L>,
        names: Vec<String>,
        by_parameters: Vec<f64>,
        by_start: &[f64],
    ) -> Result<Self, RunError<N, L>> {
        let is_lost = |one: &f64| !one.is_finite();
        let lost = match by_parameters.iter().position(is_lost) {
            Some(at) => Some((
                names[at].clone(),
                "the derivative with respect to this parameter is not finite",
            )),
            None if by_start.iter().any(is_lost) => Some((
                "start".to_owned(),
                "the derivatives with respect to the start are not finite",
            )),
            None => None,
        };
        if let Some((name, why)) = lost {
            return Err(RunError::new(RunErrorKind::Loss { name, why }, motion));
        }
        let like = &motion.last().q;
        let (of_p, of_q) = by_start.split_at(like.as_ref().len());
        let by_start = L::state(L::from_fn(like, |a| of_q[a]), L::from_fn(like, |a| of_p[a]));
        Ok(Self {
            motion,
            names,
            by_parameters,
            by_start,
        })
    }

    /// The derivative with respect to the parameter of this name.
    ///
    /// # Panics
    /// If no parameter has this name; [`get`](Self::get) returns `None` instead.
    #[track_caller]
    pub fn by(&self, name: &str) -> f64 {
        self.by_parameters[place_of(name, &self.names)]
    }

    /// The derivative with respect to a parameter; `None` if no parameter has this name.
    pub fn get(&self, name: &str) -> Option<f64> {
        let place = self.names.iter().position(|own| own == name)?;
        self.by_parameters.get(place).copied()
    }

    /// The derivatives with respect to all parameters, in the order of [`parameters`](Self::parameters).
    pub fn by_parameters(&self) -> &[f64] {
        &self.by_parameters
    }

    /// The names of the parameters, in the order of the fields of the struct.
    pub fn parameters(&self) -> &[String] {
        &self.names
    }

    /// The derivatives with respect to the coordinates q and momenta p of the start.
    pub fn by_start(&self) -> L::State {
        self.by_start.clone()
    }

    /// The motion.
    pub fn motion(&self) -> &Motion<N, L> {
        &self.motion
    }
}
