//! The rules of sums (the list of all rules is in `simplify.rs`).

use std::collections::BTreeMap;

use crate::expr::constant::Constant;
use crate::expr::function::Function;
use crate::expr::graph::{ExprId, Graph, Node};

impl Graph {
    /// constant + Σ cᵢ xᵢ: all rules of sums are here.
    pub(crate) fn linear(&mut self, constant: Constant, terms: &[(Constant, ExprId)]) -> ExprId {
        let mut sum = Collected {
            constant,
            terms: BTreeMap::new(),
        };
        for (coefficient, x) in terms {
            sum.push(self, *coefficient, *x);
        }
        sum.open_where_terms_cancel(self);
        sum.join_squares_of_sine_and_cosine(self);
        let Collected { constant, terms } = sum;
        let mut terms: Vec<(Constant, ExprId)> = terms
            .into_iter()
            .map(|(x, coefficient)| (coefficient, x))
            .collect();
        let Some((first, only)) = terms.first().copied() else {
            return self.constant(constant);
        };
        if terms.len() == 1 && constant.is_zero() {
            return if first.is_one() {
                only
            } else {
                self.intern(Node::Sum { constant, terms })
            };
        }
        let size = first.abs();
        let same_size = terms
            .iter()
            .all(|(coefficient, _)| coefficient.abs() == size)
            && (constant.is_zero() || constant.abs() == size);
        let out = match (same_size, first.is_negative()) {
            (true, _) => first,
            (false, true) => Constant::MINUS_ONE,
            (false, false) => Constant::ONE,
        };
        if out.is_one() {
            return self.intern(Node::Sum { constant, terms });
        }
        let divided =
            |value: Constant| match (same_size, value.is_negative() == first.is_negative()) {
                _ if value.is_zero() => value,
                (true, true) => Constant::ONE,
                (true, false) => Constant::MINUS_ONE,
                (false, _) => -value,
            };
        for (coefficient, _) in &mut terms {
            *coefficient = divided(*coefficient);
        }
        let inner = self.intern(Node::Sum {
            constant: divided(constant),
            terms,
        });
        self.intern(Node::Sum {
            constant: Constant::ZERO,
            terms: vec![(out, inner)],
        })
    }
}

/// A sum being collected.
struct Collected {
    constant: Constant,
    terms: BTreeMap<ExprId, Constant>,
}

impl Collected {
    fn push(&mut self, graph: &Graph, coefficient: Constant, x: ExprId) {
        let (multiple, x) = graph.as_multiple(x);
        let coefficient = coefficient * multiple;
        if let Some(value) = graph.as_constant(x) {
            self.constant = self.constant + coefficient * value;
            return;
        }
        let total = self.terms.get(&x).copied().unwrap_or(Constant::ZERO) + coefficient;
        if total.is_zero() {
            self.terms.remove(&x);
        } else {
            self.terms.insert(x, total);
        }
    }

    fn open_where_terms_cancel(&mut self, graph: &Graph) {
        loop {
            let cancels = |(x, coefficient): (&ExprId, &Constant)| {
                let (constant, terms) = graph.as_sum(*x)?;
                let cancels = |own: Option<Constant>, inner: Constant| {
                    own.is_some_and(|own| (own + *coefficient * inner).is_zero())
                };
                let constants = !constant.is_zero() && cancels(Some(self.constant), constant);
                let some = terms
                    .iter()
                    .any(|(inner, y)| cancels(self.terms.get(y).copied(), *inner));
                (constants || some).then_some((*x, *coefficient))
            };
            let Some((x, coefficient)) = self.terms.iter().find_map(cancels) else {
                return;
            };
            self.terms.remove(&x);
            if let Some((constant, terms)) = graph.as_sum(x) {
                self.constant = self.constant + coefficient * constant;
                for (inner, y) in terms {
                    self.push(graph, coefficient * *inner, *y);
                }
            }
        }
    }

    fn join_squares_of_sine_and_cosine(&mut self, graph: &mut Graph) {
        if self.terms.len() < 2 {
            return;
        }
        'again: loop {
            for (x, coefficient) in &self.terms {
                let Node::Product(factors) = graph.node(*x) else {
                    continue;
                };
                for (at, (sine, exponent)) in factors.iter().enumerate() {
                    let Node::Call {
                        function: Function::Sin,
                        arguments,
                    } = graph.node(*sine)
                    else {
                        continue;
                    };
                    let cosine = Node::Call {
                        function: Function::Cos,
                        arguments: arguments.clone(),
                    };
                    let Some(cosine) = graph.find(&cosine).filter(|_| *exponent >= 2) else {
                        continue;
                    };
                    let mut rest = factors.clone();
                    rest[at].1 -= 2;
                    let mut partner = rest.clone();
                    match partner.iter_mut().find(|(y, _)| *y == cosine) {
                        Some((_, n)) => *n = n.saturating_add(2),
                        None => partner.push((cosine, 2)),
                    }
                    partner.retain(|(_, n)| *n != 0);
                    partner.sort_unstable();
                    let Some(partner) = graph.find(&Node::Product(partner)) else {
                        continue;
                    };
                    if self.terms.get(&partner) != Some(coefficient) {
                        continue;
                    }
                    let (x, coefficient) = (*x, *coefficient);
                    self.terms.remove(&x);
                    self.terms.remove(&partner);
                    let rest = graph.product(Constant::ONE, &rest);
                    self.push(graph, coefficient, rest);
                    continue 'again;
                }
            }
            return;
        }
    }
}
