//! Formulas as they are written, and their derivatives by the chain rule in forward mode, without any simplification but for zeros and ones.
//!
//! This is the reference that kernels are judged against: nothing of the engine is used in it. A derivative is a formula too, so that one
//! loop evaluates everything, in any kind of number.

mod derivatives;
mod schedule;

pub use schedule::{Schedule, ulp};

use std::collections::HashMap;

use super::scalar::Function;

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
}
