//! Derivatives of formulas by the chain rule, forwards and in reverse.

use std::collections::HashMap;

use super::super::scalar::Function;
use super::{Formulas, Id, Input, Node};

impl Formulas {
    /// ∂/∂input
    pub fn slope(&mut self, root: Id, by: Input) -> Id {
        for id in self.reachable(&[root]) {
            if !self.slopes.contains_key(&(id, by)) {
                let one = |formulas: &mut Self, input: Input| {
                    formulas.integer(i64::from(u8::from(input == by)))
                };
                let slope = self.derived(id, &one, |formulas, part| formulas.slopes[&(part, by)]);
                self.slopes.insert((id, by), slope);
            }
        }
        self.slopes[&(root, by)]
    }

    /// All first derivatives that do not vanish, in reverse mode.
    pub fn gradient(&mut self, root: Id) -> HashMap<Input, Id> {
        let mut slopes = HashMap::new();
        let mut adjoints: HashMap<Id, Id> = HashMap::new();
        adjoints.insert(root, self.integer(1));
        for id in self.reachable(&[root]).into_iter().rev() {
            let Some(adjoint) = adjoints.get(&id).copied() else {
                continue;
            };
            let node = self.node(id);
            if let Node::Input(input) = node {
                slopes.insert(input, adjoint);
            }
            for (part, share) in self.shares(id, adjoint) {
                let sum = match adjoints.get(&part) {
                    Some(known) => self.add(*known, share),
                    None => share,
                };
                adjoints.insert(part, sum);
            }
        }
        slopes
    }

    /// What the parts of an operation get of its adjoint.
    fn shares(&mut self, id: Id, adjoint: Id) -> Vec<(Id, Id)> {
        match self.node(id) {
            Node::Number { .. } | Node::Input(_) => Vec::new(),
            Node::Add(a, b) => vec![(a, adjoint), (b, adjoint)],
            Node::Subtract(a, b) => vec![(a, adjoint), (b, self.negate(adjoint))],
            Node::Multiply(a, b) => {
                let (left, right) = (self.multiply(adjoint, b), self.multiply(adjoint, a));
                vec![(a, left), (b, right)]
            }
            Node::Divide(a, b) => {
                let above = self.divide(adjoint, b);
                let below = self.multiply(above, id);
                vec![(a, above), (b, self.negate(below))]
            }
            Node::Negate(a) => vec![(a, self.negate(adjoint))],
            Node::Power(a, n) => {
                let (number, lower) = (self.integer(i64::from(n)), self.power(a, n - 1));
                let slope = self.multiply(number, lower);
                vec![(a, self.multiply(slope, adjoint))]
            }
            Node::Call(function, a) => vec![(a, self.called(id, function, a, adjoint))],
            Node::Select {
                comparison,
                left,
                right,
                then,
                otherwise,
            } => {
                let zero = self.integer(0);
                let mut branch = |then: Id, otherwise: Id| {
                    self.intern(Node::Select {
                        comparison,
                        left,
                        right,
                        then,
                        otherwise,
                    })
                };
                vec![
                    (then, branch(adjoint, zero)),
                    (otherwise, branch(zero, adjoint)),
                ]
            }
        }
    }

    /// d/dt with q̇ = v; velocities stay as they are.
    pub fn rate(&mut self, root: Id) -> Id {
        for id in self.reachable(&[root]) {
            if !self.rates.contains_key(&id) {
                let flow = |formulas: &mut Self, input: Input| match input {
                    Input::Time => formulas.integer(1),
                    Input::Coordinate(at) => formulas.input(Input::Velocity(at)),
                    _ => formulas.integer(0),
                };
                let rate = self.derived(id, &flow, |formulas, part| formulas.rates[&part]);
                self.rates.insert(id, rate);
            }
        }
        self.rates[&root]
    }

    /// The formula with all velocities zero.
    pub fn at_rest(&mut self, root: Id) -> Id {
        let mut new: HashMap<Id, Id> = HashMap::new();
        for id in self.reachable(&[root]) {
            let node = self.node(id);
            let at = |part: Id| new[&part];
            let moved = match node {
                Node::Number { .. } => id,
                Node::Input(Input::Velocity(_)) => self.integer(0),
                Node::Input(_) => id,
                Node::Add(a, b) => self.add(at(a), at(b)),
                Node::Subtract(a, b) => self.subtract(at(a), at(b)),
                Node::Multiply(a, b) => self.multiply(at(a), at(b)),
                Node::Divide(a, b) => self.divide(at(a), at(b)),
                Node::Negate(a) => self.negate(at(a)),
                Node::Power(a, n) => self.power(at(a), n),
                Node::Call(function, a) => self.call(function, at(a)),
                Node::Select {
                    comparison,
                    left,
                    right,
                    then,
                    otherwise,
                } => self.intern(Node::Select {
                    comparison,
                    left: at(left),
                    right: at(right),
                    then: at(then),
                    otherwise: at(otherwise),
                }),
            };
            new.insert(id, moved);
        }
        new[&root]
    }

    /// The chain rule for one operation.
    fn derived(
        &mut self,
        id: Id,
        of_input: &dyn Fn(&mut Self, Input) -> Id,
        of_part: impl Fn(&Self, Id) -> Id,
    ) -> Id {
        match self.node(id) {
            Node::Number { .. } => self.integer(0),
            Node::Input(input) => of_input(self, input),
            Node::Add(a, b) => {
                let (da, db) = (of_part(self, a), of_part(self, b));
                self.add(da, db)
            }
            Node::Subtract(a, b) => {
                let (da, db) = (of_part(self, a), of_part(self, b));
                self.subtract(da, db)
            }
            Node::Multiply(a, b) => {
                let (da, db) = (of_part(self, a), of_part(self, b));
                let (left, right) = (self.multiply(da, b), self.multiply(a, db));
                self.add(left, right)
            }
            Node::Divide(a, b) => {
                // (a′ − (a/b) b′)/b
                let (da, db) = (of_part(self, a), of_part(self, b));
                let back = self.multiply(id, db);
                let above = self.subtract(da, back);
                self.divide(above, b)
            }
            Node::Negate(a) => {
                let da = of_part(self, a);
                self.negate(da)
            }
            Node::Power(a, n) => {
                let (da, lower) = (of_part(self, a), self.power(a, n - 1));
                let number = self.integer(i64::from(n));
                let slope = self.multiply(number, lower);
                self.multiply(slope, da)
            }
            Node::Call(function, a) => {
                let da = of_part(self, a);
                self.called(id, function, a, da)
            }
            Node::Select {
                comparison,
                left,
                right,
                then,
                otherwise,
            } => {
                let (then, otherwise) = (of_part(self, then), of_part(self, otherwise));
                if then == otherwise {
                    return then;
                }
                self.intern(Node::Select {
                    comparison,
                    left,
                    right,
                    then,
                    otherwise,
                })
            }
        }
    }

    /// f′(a) a′
    fn called(&mut self, value: Id, function: Function, a: Id, da: Id) -> Id {
        match function {
            Function::Sin => {
                let cosine = self.call(Function::Cos, a);
                self.multiply(cosine, da)
            }
            Function::Cos => {
                let sine = self.call(Function::Sin, a);
                let product = self.multiply(sine, da);
                self.negate(product)
            }
            Function::Exp => self.multiply(value, da),
            Function::Ln => self.divide(da, a),
            Function::Sqrt => {
                let two = self.integer(2);
                let below = self.multiply(two, value);
                self.divide(da, below)
            }
            Function::Abs => {
                let sign = self.call(Function::Sign, a);
                self.multiply(sign, da)
            }
            Function::Sign => self.integer(0),
        }
    }
}
