//! Declarations written together with their formulas: text for the engine, nodes for the reference.

use super::formula::{Comparison, Formulas, Id, Input, Node};
use super::scalar::Function;

/// How strongly the outermost operation of a text binds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Level {
    Sum,
    Product,
    Sign,
    Power,
    Name,
}

/// A formula and its text.
#[derive(Clone, Debug)]
pub struct Piece {
    pub text: String,
    pub id: Id,
    level: Level,
}

impl Piece {
    fn at(&self, level: Level) -> String {
        if self.level >= level {
            self.text.clone()
        } else {
            format!("({})", self.text)
        }
    }
}

/// Which energy is declared.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Form {
    Lagrangian,
    Hamiltonian,
}

/// A declared model.
#[derive(Clone, Debug)]
pub struct Model {
    /// What kind of model it is, for the report.
    pub kind: &'static str,
    /// The arguments of the attribute.
    pub text: String,
    pub dof: usize,
    /// The fields, all of them numbers.
    pub parameters: Vec<String>,
    pub formulas: Formulas,
    pub energy: Id,
    pub dissipation: Option<Id>,
    pub forces: Vec<(usize, Id)>,
    pub outputs: Vec<Id>,
    pub constraints: Vec<Id>,
}

impl Model {
    /// The fields that formulas hold.
    pub fn used_parameters(&self) -> Vec<String> {
        let forces = self.forces.iter().map(|(_, value)| *value);
        let mut roots: Vec<Id> = vec![self.energy];
        roots.extend(forces.chain(self.dissipation));
        roots.extend(self.outputs.iter().chain(&self.constraints));
        let mut used = vec![false; self.parameters.len()];
        for root in roots {
            for input in self.formulas.inputs_of(root) {
                if let Input::Parameter(at) = input {
                    used[at] = true;
                }
            }
        }
        let names = self.parameters.iter().zip(used);
        names
            .filter(|(_, used)| *used)
            .map(|(name, _)| name.clone())
            .collect()
    }
}

/// Writes a model.
pub struct Writer {
    kind: &'static str,
    form: Form,
    formulas: Formulas,
    coordinates: Vec<String>,
    parameters: Vec<String>,
    arguments: Vec<String>,
    dissipation: Option<Id>,
    forces: Vec<(usize, Id)>,
    outputs: Vec<Id>,
    constraints: Vec<Id>,
}

impl Writer {
    /// Names of coordinates: each one a number.
    pub fn new(kind: &'static str, form: Form, names: &[&str]) -> Self {
        let coordinates: Vec<String> = names.iter().map(|name| (*name).to_owned()).collect();
        let mut arguments = vec![format!("coordinates({})", coordinates.join(", "))];
        if form == Form::Hamiltonian {
            let momenta: Vec<String> = names.iter().map(|name| format!("p{name}")).collect();
            arguments.push(format!("momenta({})", momenta.join(", ")));
        }
        Self::with(kind, form, coordinates, arguments)
    }

    /// One array of coordinates, or `e[4]` and `x[3]`.
    pub fn with_arrays(kind: &'static str, arrays: &[(&str, usize)]) -> Self {
        let elements = arrays
            .iter()
            .flat_map(|(name, length)| (0..*length).map(move |at| format!("{name}[{at}]")));
        let declared: Vec<String> = arrays
            .iter()
            .map(|(name, length)| format!("{name}[{length}]"))
            .collect();
        let arguments = vec![format!("coordinates({})", declared.join(", "))];
        Self::with(kind, Form::Lagrangian, elements.collect(), arguments)
    }

    fn with(
        kind: &'static str,
        form: Form,
        coordinates: Vec<String>,
        arguments: Vec<String>,
    ) -> Self {
        Self {
            kind,
            form,
            formulas: Formulas::default(),
            coordinates,
            parameters: Vec::new(),
            arguments,
            dissipation: None,
            forces: Vec::new(),
            outputs: Vec::new(),
            constraints: Vec::new(),
        }
    }

    pub fn form(&self) -> Form {
        self.form
    }

    pub fn dof(&self) -> usize {
        self.coordinates.len()
    }

    fn named(&self, text: String, id: Id) -> Piece {
        Piece {
            text,
            id,
            level: Level::Name,
        }
    }

    pub fn q(&mut self, at: usize) -> Piece {
        let id = self.formulas.input(Input::Coordinate(at));
        self.named(self.coordinates[at].clone(), id)
    }

    /// `dot(x)`, or `px`
    pub fn z(&mut self, at: usize) -> Piece {
        let id = self.formulas.input(Input::Velocity(at));
        let name = &self.coordinates[at];
        let text = match self.form {
            Form::Lagrangian => format!("dot({name})"),
            Form::Hamiltonian => format!("p{name}"),
        };
        self.named(text, id)
    }

    /// `dot(x)` in models of both forms, for constraints.
    pub fn velocity(&mut self, at: usize) -> Piece {
        let id = self.formulas.input(Input::Velocity(at));
        self.named(format!("dot({})", self.coordinates[at]), id)
    }

    pub fn time(&mut self) -> Piece {
        let id = self.formulas.input(Input::Time);
        self.named("t".to_owned(), id)
    }

    pub fn parameter(&mut self, name: &str) -> Piece {
        let known = self.parameters.iter().position(|known| known == name);
        let at = known.unwrap_or_else(|| {
            self.parameters.push(name.to_owned());
            self.parameters.len() - 1
        });
        let id = self.formulas.input(Input::Parameter(at));
        self.named(name.to_owned(), id)
    }

    /// digits / 10^decimals
    pub fn decimal(&mut self, digits: i64, decimals: u32) -> Piece {
        let id = self.formulas.intern(Node::Number { digits, decimals });
        let text = if decimals == 0 {
            digits.to_string()
        } else {
            let scale = 10i64.pow(decimals);
            let (whole, rest) = (digits / scale, digits % scale);
            format!("{whole}.{rest:0width$}", width = decimals as usize)
        };
        self.named(text, id)
    }

    pub fn integer(&mut self, value: i64) -> Piece {
        self.decimal(value, 0)
    }

    pub fn add(&mut self, a: &Piece, b: &Piece) -> Piece {
        Piece {
            text: format!("{} + {}", a.at(Level::Sum), b.at(Level::Product)),
            id: self.formulas.intern(Node::Add(a.id, b.id)),
            level: Level::Sum,
        }
    }

    pub fn subtract(&mut self, a: &Piece, b: &Piece) -> Piece {
        Piece {
            text: format!("{} - {}", a.at(Level::Sum), b.at(Level::Product)),
            id: self.formulas.intern(Node::Subtract(a.id, b.id)),
            level: Level::Sum,
        }
    }

    pub fn multiply(&mut self, a: &Piece, b: &Piece) -> Piece {
        Piece {
            text: format!("{}*{}", a.at(Level::Product), b.at(Level::Sign)),
            id: self.formulas.intern(Node::Multiply(a.id, b.id)),
            level: Level::Product,
        }
    }

    pub fn divide(&mut self, a: &Piece, b: &Piece) -> Piece {
        Piece {
            text: format!("{}/{}", a.at(Level::Product), b.at(Level::Sign)),
            id: self.formulas.intern(Node::Divide(a.id, b.id)),
            level: Level::Product,
        }
    }

    pub fn negate(&mut self, a: &Piece) -> Piece {
        Piece {
            text: format!("-{}", a.at(Level::Sign)),
            id: self.formulas.intern(Node::Negate(a.id)),
            level: Level::Sign,
        }
    }

    pub fn power(&mut self, a: &Piece, n: i32) -> Piece {
        Piece {
            text: format!("{}^{n}", a.at(Level::Name)),
            id: self.formulas.power(a.id, n),
            level: Level::Power,
        }
    }

    pub fn call(&mut self, function: Function, a: &Piece) -> Piece {
        let id = self.formulas.call(function, a.id);
        self.named(format!("{}({})", function.name(), a.text), id)
    }

    /// `dot(a)`
    pub fn rate(&mut self, a: &Piece) -> Piece {
        let id = self.formulas.rate(a.id);
        self.named(format!("dot({})", a.text), id)
    }

    /// `select(left > right, then, otherwise)`
    pub fn select(
        &mut self,
        comparison: Comparison,
        (left, right): (&Piece, &Piece),
        (then, otherwise): (&Piece, &Piece),
    ) -> Piece {
        let id = self.formulas.intern(Node::Select {
            comparison,
            left: left.id,
            right: right.id,
            then: then.id,
            otherwise: otherwise.id,
        });
        let sign = match comparison {
            Comparison::Less => "<",
            Comparison::Greater => ">",
        };
        let text = format!(
            "select({} {sign} {}, {}, {})",
            left.text, right.text, then.text, otherwise.text
        );
        self.named(text, id)
    }

    /// The left-to-right sum of some.
    pub fn sum(&mut self, terms: &[Piece]) -> Piece {
        let mut sum = terms[0].clone();
        for term in &terms[1..] {
            sum = self.add(&sum, term);
        }
        sum
    }

    /// `let name = value`; the name from then on.
    pub fn binding(&mut self, name: &str, value: &Piece) -> Piece {
        self.arguments.push(format!("let {name} = {}", value.text));
        self.named(name.to_owned(), value.id)
    }

    /// `let name = text`, a vector of formulas: its elements.
    pub fn vector(&mut self, name: &str, text: &str, elements: &[Piece]) -> Vec<Piece> {
        self.arguments.push(format!("let {name} = {text}"));
        (0..)
            .zip(elements)
            .map(|(at, element)| self.named(format!("{name}[{at}]"), element.id))
            .collect()
    }

    pub fn dissipation(&mut self, value: &Piece) {
        self.arguments.push(format!("dissipation = {}", value.text));
        self.dissipation = Some(value.id);
    }

    pub fn force(&mut self, at: usize, value: &Piece) {
        let target = &self.coordinates[at];
        self.arguments
            .push(format!("force({target}) = {}", value.text));
        self.forces.push((at, value.id));
    }

    pub fn output(&mut self, value: &Piece) {
        let number = self.outputs.len();
        self.arguments
            .push(format!("output(out{number}) = {}", value.text));
        self.outputs.push(value.id);
    }

    pub fn constraint(&mut self, value: &Piece) {
        let number = self.constraints.len();
        self.arguments
            .push(format!("constraint(con{number}) = {}", value.text));
        self.constraints.push(value.id);
    }

    pub fn is_zero(&self, a: &Piece) -> bool {
        self.formulas.is_zero(a.id)
    }

    /// Whether a formula holds this coordinate.
    pub fn holds_coordinate(&self, a: &Piece, at: usize) -> bool {
        let inputs = self.formulas.inputs_of(a.id);
        inputs.contains(&Input::Coordinate(at))
    }

    /// The sum of those that are not zero; its text is not meant to be read.
    pub fn hidden_sum(&mut self, terms: &[Piece]) -> Piece {
        let ids: Vec<Id> = terms.iter().map(|term| term.id).collect();
        let mut sum = self.formulas.integer(0);
        for id in ids {
            sum = self.formulas.add(sum, id);
        }
        self.named(String::new(), sum)
    }

    /// The same of a difference.
    pub fn hidden_difference(&mut self, a: &Piece, b: &Piece) -> Piece {
        let id = self.formulas.subtract(a.id, b.id);
        self.named(String::new(), id)
    }

    /// The same of a product.
    pub fn hidden_product(&mut self, a: &Piece, b: &Piece) -> Piece {
        let id = self.formulas.multiply(a.id, b.id);
        self.named(String::new(), id)
    }

    /// The model with this energy.
    pub fn finish(mut self, energy: &Piece) -> Model {
        let name = match self.form {
            Form::Lagrangian => "lagrangian",
            Form::Hamiltonian => "hamiltonian",
        };
        self.arguments.push(format!("{name} = {}", energy.text));
        Model {
            kind: self.kind,
            text: self.arguments.join(", "),
            dof: self.coordinates.len(),
            parameters: self.parameters,
            formulas: self.formulas,
            energy: energy.id,
            dissipation: self.dissipation,
            forces: self.forces,
            outputs: self.outputs,
            constraints: self.constraints,
        }
    }
}
