//! Formulas in the order in which they are evaluated, in any kind of number.

use std::collections::HashMap;

use super::super::scalar::{Function, Scalar};
use super::{Comparison, Formulas, Id, Node, State};

/// Formulas in the order in which they are evaluated.
#[derive(Clone, Debug)]
pub struct Schedule {
    steps: Vec<Step>,
    place: HashMap<Id, usize>,
}

/// A node whose parts are places among the results.
#[derive(Clone, Copy, Debug)]
struct Step {
    node: Node,
    parts: [usize; 4],
}

/// An argument of sines and cosines that moves a little, by an amount of each state.
pub type Shift = Option<(usize, f64)>;

impl Schedule {
    pub fn of(formulas: &Formulas, roots: &[Id]) -> Self {
        let order = formulas.reachable(roots);
        let place: HashMap<Id, usize> = order.iter().copied().zip(0..).collect();
        let step = |id: &Id| {
            let node = formulas.node(*id);
            let mut parts = [0; 4];
            for (to, part) in parts.iter_mut().zip(node.parts()) {
                *to = place[&part];
            }
            Step { node, parts }
        };
        let steps = order.iter().map(step).collect();
        Self { steps, place }
    }

    /// Where the value of a formula stands among the results.
    pub fn place(&self, id: Id) -> usize {
        self.place[&id]
    }

    /// The arguments of functions with a jump or a kink, and the two sides of comparisons.
    pub fn switches(&self) -> Vec<(usize, Option<usize>)> {
        let switch = |step: &Step| match step.node {
            Node::Call(Function::Abs | Function::Sign, _) => Some((step.parts[0], None)),
            Node::Select { .. } => Some((step.parts[0], Some(step.parts[1]))),
            _ => None,
        };
        let mut found: Vec<_> = self.steps.iter().filter_map(switch).collect();
        found.sort_unstable();
        found.dedup();
        found
    }

    /// The arguments of sines and cosines.
    pub fn angles(&self) -> Vec<usize> {
        let angle = |step: &Step| match step.node {
            Node::Call(Function::Sin | Function::Cos, _) => Some(step.parts[0]),
            _ => None,
        };
        let mut found: Vec<usize> = self.steps.iter().filter_map(angle).collect();
        found.sort_unstable();
        found.dedup();
        found
    }

    /// Half an ulp of each part of an angle, times its coefficient: what is not known of it.
    ///
    /// The parts of a sum are the terms that are sums no more; a numeric factor is the coefficient of its term.
    pub fn uncertainty(&self, angle: usize, values: &[f64]) -> f64 {
        let Step { node, parts } = self.steps[angle];
        let number = |at: usize| matches!(self.steps[at].node, Node::Number { .. });
        match node {
            Node::Add(..) | Node::Subtract(..) => {
                self.uncertainty(parts[0], values) + self.uncertainty(parts[1], values)
            }
            Node::Negate(_) => self.uncertainty(parts[0], values),
            Node::Multiply(..) if number(parts[0]) => {
                values[parts[0]].abs() * self.uncertainty(parts[1], values)
            }
            Node::Multiply(..) if number(parts[1]) => {
                values[parts[1]].abs() * self.uncertainty(parts[0], values)
            }
            Node::Divide(..) if number(parts[1]) => {
                self.uncertainty(parts[0], values) / values[parts[1]].abs()
            }
            _ => ulp(values[angle]) / 2.0,
        }
    }

    pub fn evaluate<S: Scalar>(&self, state: &State, shift: Shift) -> Vec<S> {
        let mut values: Vec<S> = Vec::with_capacity(self.steps.len());
        // Sines and cosines by their angles.
        let mut waves: Vec<(usize, (S, S))> = Vec::new();
        for Step { node, parts } in &self.steps {
            let [a, b, c, d] = parts.map(|part| values.get(part).copied());
            let value = match (node, a, b) {
                (Node::Number { digits, decimals }, ..) => S::decimal(*digits, *decimals),
                (Node::Input(input), ..) => S::from_f64(state.get(*input)),
                (Node::Add(..), Some(a), Some(b)) => a.add(b),
                (Node::Subtract(..), Some(a), Some(b)) => a.subtract(b),
                (Node::Multiply(..), Some(a), Some(b)) => a.multiply(b),
                (Node::Divide(..), Some(a), Some(b)) => a.divide(b),
                (Node::Negate(_), Some(a), _) => a.negate(),
                (Node::Power(_, n), Some(a), _) => a.power(*n),
                (Node::Call(function @ (Function::Sin | Function::Cos), _), Some(a), _) => {
                    let angle = parts[0];
                    let known = waves.iter().find(|(known, _)| *known == angle);
                    let (sine, cosine) = match (known, shift) {
                        (Some((_, pair)), _) => *pair,
                        (None, Some((shifted, amount))) if shifted == angle => {
                            a.add(S::from_f64(amount)).sin_cos()
                        }
                        (None, _) => a.sin_cos(),
                    };
                    if known.is_none() {
                        waves.push((angle, (sine, cosine)));
                    }
                    match function {
                        Function::Sin => sine,
                        _ => cosine,
                    }
                }
                (Node::Call(function, _), Some(a), _) => a.call(*function),
                (Node::Select { comparison, .. }, Some(a), Some(b)) => {
                    let difference = a.subtract(b).to_f64();
                    let holds = match comparison {
                        Comparison::Less => difference < 0.0,
                        Comparison::Greater => difference > 0.0,
                    };
                    let (then, otherwise) = (c.unwrap_or(a), d.unwrap_or(a));
                    if holds { then } else { otherwise }
                }
                _ => S::from_f64(f64::NAN),
            };
            values.push(value);
        }
        values
    }
}

/// The distance to the next number.
pub fn ulp(x: f64) -> f64 {
    let x = x.abs();
    if x.is_finite() {
        x.next_up() - x
    } else {
        f64::NAN
    }
}
