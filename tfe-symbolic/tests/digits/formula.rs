//! Formulas as they are written, and their derivatives by the chain rule in forward mode, without any simplification but for zeros and ones.
//!
//! This is the reference that kernels are judged against: nothing of the engine is used in it. A derivative is a formula too, so that one
//! loop evaluates everything, in any kind of number.

use std::collections::HashMap;

use super::scalar::{Function, Scalar};

/// What a formula is evaluated at.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Input {
    Time,
    Coordinate(usize),
    /// A velocity or a momentum.
    Velocity(usize),
    Multiplier(usize),
    Parameter(usize),
}

/// The number of a formula; parts have smaller numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Id(u32);

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Comparison {
    Less,
    Greater,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Node {
    /// digits / 10^decimals
    Number {
        digits: i64,
        decimals: u32,
    },
    Input(Input),
    Add(Id, Id),
    Subtract(Id, Id),
    Multiply(Id, Id),
    Divide(Id, Id),
    Negate(Id),
    Power(Id, i32),
    Call(Function, Id),
    Select {
        comparison: Comparison,
        left: Id,
        right: Id,
        then: Id,
        otherwise: Id,
    },
}

/// Where the inputs stand.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct State {
    pub time: f64,
    pub q: Vec<f64>,
    pub z: Vec<f64>,
    pub mu: Vec<f64>,
    pub parameters: Vec<f64>,
}

impl State {
    pub fn get(&self, input: Input) -> f64 {
        match input {
            Input::Time => self.time,
            Input::Coordinate(at) => self.q[at],
            Input::Velocity(at) => self.z[at],
            Input::Multiplier(at) => self.mu[at],
            Input::Parameter(at) => self.parameters[at],
        }
    }
}

/// All formulas of a model, equal ones once.
#[derive(Clone, Debug, Default)]
pub struct Formulas {
    nodes: Vec<Node>,
    known: HashMap<Node, Id>,
    /// Derivatives by an input that have been asked for.
    slopes: HashMap<(Id, Input), Id>,
    rates: HashMap<Id, Id>,
}

impl Node {
    fn parts(self) -> Vec<Id> {
        match self {
            Self::Number { .. } | Self::Input(_) => Vec::new(),
            Self::Negate(a) | Self::Power(a, _) | Self::Call(_, a) => vec![a],
            Self::Add(a, b) | Self::Subtract(a, b) | Self::Multiply(a, b) | Self::Divide(a, b) => {
                vec![a, b]
            }
            Self::Select {
                left,
                right,
                then,
                otherwise,
                ..
            } => vec![left, right, then, otherwise],
        }
    }
}

impl Formulas {
    pub fn node(&self, id: Id) -> Node {
        self.nodes[id.0 as usize]
    }

    pub fn intern(&mut self, node: Node) -> Id {
        if let Some(id) = self.known.get(&node) {
            return *id;
        }
        let id = Id(self.nodes.len() as u32);
        self.nodes.push(node);
        self.known.insert(node, id);
        id
    }

    pub fn integer(&mut self, value: i64) -> Id {
        self.intern(Node::Number {
            digits: value,
            decimals: 0,
        })
    }

    pub fn input(&mut self, input: Input) -> Id {
        self.intern(Node::Input(input))
    }

    fn is(&self, id: Id, value: i64) -> bool {
        self.node(id)
            == Node::Number {
                digits: value,
                decimals: 0,
            }
    }

    pub fn is_zero(&self, id: Id) -> bool {
        self.is(id, 0)
    }

    pub fn add(&mut self, a: Id, b: Id) -> Id {
        match (self.is(a, 0), self.is(b, 0)) {
            (true, _) => b,
            (_, true) => a,
            _ => self.intern(Node::Add(a, b)),
        }
    }

    pub fn subtract(&mut self, a: Id, b: Id) -> Id {
        match (self.is(a, 0), self.is(b, 0)) {
            (_, true) => a,
            (true, _) => self.negate(b),
            _ => self.intern(Node::Subtract(a, b)),
        }
    }

    pub fn multiply(&mut self, a: Id, b: Id) -> Id {
        if self.is(a, 0) || self.is(b, 0) {
            return self.integer(0);
        }
        match (self.is(a, 1), self.is(b, 1)) {
            (true, _) => b,
            (_, true) => a,
            _ => self.intern(Node::Multiply(a, b)),
        }
    }

    pub fn divide(&mut self, a: Id, b: Id) -> Id {
        if self.is(a, 0) || self.is(b, 1) {
            return a;
        }
        self.intern(Node::Divide(a, b))
    }

    pub fn negate(&mut self, a: Id) -> Id {
        if self.is(a, 0) {
            return a;
        }
        self.intern(Node::Negate(a))
    }

    pub fn power(&mut self, a: Id, n: i32) -> Id {
        match n {
            0 => self.integer(1),
            1 => a,
            _ => self.intern(Node::Power(a, n)),
        }
    }

    pub fn call(&mut self, function: Function, a: Id) -> Id {
        self.intern(Node::Call(function, a))
    }

    /// The formulas that some are made of, those included, parts first.
    pub fn reachable(&self, roots: &[Id]) -> Vec<Id> {
        let mut is_needed = vec![false; self.nodes.len()];
        for root in roots {
            is_needed[root.0 as usize] = true;
        }
        for at in (0..self.nodes.len()).rev() {
            if is_needed[at] {
                for part in self.nodes[at].parts() {
                    is_needed[part.0 as usize] = true;
                }
            }
        }
        let ids = (0..self.nodes.len() as u32).map(Id);
        ids.filter(|id| is_needed[id.0 as usize]).collect()
    }

    pub fn inputs_of(&self, root: Id) -> Vec<Input> {
        let input = |id: Id| match self.node(id) {
            Node::Input(input) => Some(input),
            _ => None,
        };
        self.reachable(&[root])
            .into_iter()
            .filter_map(input)
            .collect()
    }

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
