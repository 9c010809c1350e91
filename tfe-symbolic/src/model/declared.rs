//! The model after checking and lowering: names resolved, vectors in components, `dot()` expanded.

use crate::vocabulary::element::Element;
use std::fmt;

use crate::expr::graph::{ExprId, Graph, SumRange};
use crate::expr::input::{Affine, IndexSymbol};
use crate::expr::rewrite::substitute;
use crate::model::notation::Notation;

/// Which energy function declares the model.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Form {
    /// L(q, v, t)
    Lagrangian,
    /// H(q, p, t)
    Hamiltonian,
}

impl Form {
    /// `Lagrangian` or `Hamiltonian`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Lagrangian => "Lagrangian",
            Self::Hamiltonian => "Hamiltonian",
        }
    }

    /// `L` or `H`.
    pub fn letter(self) -> char {
        match self {
            Self::Lagrangian => 'L',
            Self::Hamiltonian => 'H',
        }
    }
}

/// A coordinate or momentum, or an array of them, in the flat vector `q` or `p`.
#[derive(Clone, Debug, PartialEq)]
pub struct CoordinateArray {
    /// The name.
    pub name: String,
    /// The flat index of its first element: affine in the lengths of the arrays before it.
    pub first: Affine,
    /// The length of an array; `None` for a single coordinate.
    pub length: Option<Affine>,
}

/// `x`, `q[0]`, `q[1]`, … by number; nothing where the length of an array is not known.
pub fn names(arrays: &[CoordinateArray]) -> Vec<String> {
    let mut names = Vec::new();
    for array in arrays {
        match array.length.as_ref().map(Affine::as_constant) {
            None => names.push(array.name.clone()),
            Some(Some(length)) => {
                names.extend((0..length).map(|at| format!("{}[{at}]", array.name)));
            }
            Some(None) => return Vec::new(),
        }
    }
    names
}

/// A requirement on lengths and indices that is checked before a model is evaluated; `text` and `ranges` are as the user
/// wrote them.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Requirement {
    /// An index stays inside its array on all turns of a nest of loops.
    Index {
        /// The array.
        array: String,
        /// The index as written, `i+1`.
        text: String,
        /// The ranges that it depends on, `i in 0..n-1`.
        ranges: String,
        /// The loops, outermost first.
        nest: Vec<SumRange>,
        /// The index.
        place: Affine,
        /// The length of the array.
        length: Extent,
    },
    /// A field of type `Vec<f64>` or `Vec<usize>` is exactly as long as its largest index requires.
    FieldLength {
        /// The field.
        field: String,
        /// The index as written.
        text: String,
        /// The ranges that it depends on.
        ranges: String,
        /// The length that this index requires; the largest of all decides.
        length: Affine,
    },
    /// A range does not end below its start; where it has to hold something, it is not empty either.
    Turns {
        /// The range, `i in 0..n-1`.
        ranges: String,
        /// Its first value.
        start: Affine,
        /// One past its last value.
        end: Affine,
        /// Of a sum that may have no terms, or sites that may be none: the coordinates to which its loops then add zero, which have to exist. `None`
        /// where the range has to hold something.
        empty: Option<Vec<Affine>>,
    },
}

impl Requirement {
    /// Whether it can be checked as soon as const parameters are known.
    pub fn is_of_const_parameters(&self) -> bool {
        let Self::Index {
            nest,
            place,
            length: Extent::Known(length),
            ..
        } = self
        else {
            return false;
        };
        let bounds = nest.iter().flat_map(|range| [&range.start, &range.end]);
        let mut affines = bounds.chain([place, length]);
        affines.all(|affine| !affine.is_of_run_time() && !affine.holds_entry())
    }
}

/// The length of an array.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Extent {
    /// Of coordinates, or of a field of type `[f64; K]`.
    Known(Affine),
    /// Of a field of type `Vec<f64>` or `Vec<usize>`.
    OfField(String),
}

/// A generalized force on one coordinate, or on each coordinate of a range.
#[derive(Clone, Debug, PartialEq)]
pub struct Force {
    /// The loops around it, outermost first; empty for one coordinate.
    pub ranges: Vec<SumRange>,
    /// The flat index of the coordinate.
    pub target: Affine,
    /// Its value.
    pub value: ExprId,
}

impl Force {
    /// The force on each coordinate that it acts on, where its ranges are literal.
    pub(crate) fn written_out(&self, graph: &mut Graph) -> Vec<(Affine, ExprId)> {
        let mut forces = vec![(self.target.clone(), self.value)];
        for range in &self.ranges {
            let turns = range.start.as_constant().zip(range.end.as_constant());
            let (start, end) = turns.unwrap_or_default();
            let mut each = Vec::new();
            for at in (start..end).map(Affine::constant) {
                for (target, value) in &forces {
                    let target = substitute(target, range.variable, &at);
                    let value = graph.substitute_loop(*value, range.variable, &at);
                    each.push((target, value));
                }
            }
            forces = each;
        }
        forces
    }
}

/// An output that a motion shows in addition to its state; in models of run-time length one number for each site of a
/// range.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Observable {
    /// Its name as declared.
    pub name: String,
    /// The range of the sites; empty for one number.
    pub ranges: Vec<SumRange>,
    /// The place among all numbers: those of the declarations before it come first.
    pub column: Affine,
    /// Its value.
    pub value: ExprId,
}

impl Observable {
    /// The place of its first number.
    pub fn first_column(&self) -> Option<Affine> {
        let Some(sites) = self.ranges.first() else {
            return Some(self.column.clone());
        };
        let site = Affine::symbol(IndexSymbol::Loop(sites.variable));
        self.column
            .plus_scaled(&site, -1)?
            .plus_scaled(&sites.start, 1)
    }
}

/// A parameter by which derivatives are wanted: a field, or one element of an array field.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Parameter {
    /// The field.
    pub field: String,
    /// The element of an array; `None` for a number.
    pub element: Option<usize>,
}

/// `omega` or `k[2]`
impl fmt::Display for Parameter {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.element {
            None => f.write_str(&self.field),
            Some(element) => write!(f, "{}[{element}]", self.field),
        }
    }
}

/// The coordinate that a time transformation adds: the time of the model.
pub const CLOCK: &str = "t";
/// Its momentum.
pub const CLOCK_MOMENTUM: &str = "p_t";

/// Steps in a time τ with dt = g dτ; the model is then the extended one, with the Hamiltonian g (H + p_t).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TimeTransformation {
    /// H(q, p, t) as declared, with t the last coordinate; p_t = −H at the start.
    pub hamiltonian: ExprId,
    /// The flat index of the coordinate t: the number of coordinates as declared.
    pub clock: usize,
}

/// A constraint: one scalar equation; in models of run-time length one for each site of a range.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Constraint {
    /// Its name; with its place where a declaration makes several equations that are written out, `rod[2]`.
    pub name: String,
    /// The range of the sites; empty for one equation.
    pub ranges: Vec<SumRange>,
    /// The number of the equation: of all sites, those of the declarations before it come first.
    pub row: Affine,
    /// What kind of equation it is.
    pub kind: ConstraintKind,
    /// What vanishes: φ(q, t), or ψ(q, v, t) = A(q, t) v + a(q, t). In Hamiltonian models v stands for the velocities too.
    pub value: ExprId,
}

/// What kind of equation a constraint is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ConstraintKind {
    /// φ(q, t) = 0
    Holonomic {
        /// φ is a polynomial of at most second degree in the coordinates.
        quadratic: bool,
    },
    /// A(q, t) v + a(q, t) = 0
    Velocity {
        /// It was found to be the time derivative of some φ(q, t).
        integrable: bool,
    },
}

/// `holonomic, quadratic`
impl fmt::Display for ConstraintKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Holonomic { quadratic: true } => "holonomic, quadratic",
            Self::Holonomic { quadratic: false } => "holonomic",
            Self::Velocity { integrable: true } => "velocity, integrable",
            Self::Velocity { integrable: false } => "velocity",
        })
    }
}

/// A request for a stepper specialised to the model and one element.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Solver {
    /// The name of the struct to emit.
    pub name: String,
    /// The element.
    pub element: Element,
}

/// A model made from another one.
#[derive(Clone, Debug)]
pub struct Variant {
    /// The model; it has no solvers and no variants.
    pub model: Declared,
    /// What was done, in words, with formulas between backticks.
    pub made: String,
    /// The fields that the model has and the original does not, with what they are: scalars, in order.
    pub added: Vec<(String, String)>,
    /// If only cyclic coordinates were removed: how a state of the original determines those fields and a state of the
    /// model.
    pub projection: Option<Projection>,
}

/// The coordinates and momenta of a model that remain in one made from it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Projection {
    /// How many coordinates there were.
    pub original: usize,
    /// The numbers of those that are left, in order.
    pub kept: Vec<usize>,
    /// The numbers of those whose momenta are fields now, in the order of the fields.
    pub held: Vec<usize>,
}

/// A declared model, ready to be differentiated.
#[derive(Clone, Debug)]
pub struct Declared {
    /// The name of the struct.
    pub name: String,
    /// Lagrangian or Hamiltonian.
    pub form: Form,
    /// The number of coordinates, that of a time transformation included: a constant, or exactly one const parameter.
    pub dof: Affine,
    /// The coordinates, in the order of the flat vector `q`.
    pub coordinates: Vec<CoordinateArray>,
    /// The momenta of a Hamiltonian model, in the order of the coordinates; else empty.
    pub momenta: Vec<CoordinateArray>,
    /// The expressions.
    pub graph: Graph,
    /// L or H.
    pub energy: ExprId,
    /// The Rayleigh function D; Q = −∂D/∂v.
    pub dissipation: Option<ExprId>,
    /// The time transformation, if steps are taken in another time than that of the model.
    pub time_transformation: Option<TimeTransformation>,
    /// The generalized forces; several on one coordinate add up.
    pub forces: Vec<Force>,
    /// The constraints, in order.
    pub constraints: Vec<Constraint>,
    /// The observables, in order.
    pub observables: Vec<Observable>,
    /// The parameters by which derivatives are wanted, in the order of `sensitivity(…)`.
    pub sensitivities: Vec<Parameter>,
    /// The numbers given at run time, in the order of `input(…)`.
    pub inputs: Vec<String>,
    /// The specialised steppers asked for.
    pub solvers: Vec<Solver>,
    /// The models made from this one.
    pub variants: Vec<Variant>,
    /// Where the emitted code finds `tfe`, if the user said so.
    pub crate_path: Option<String>,
    /// The fields that formulas use, in the order of the struct.
    pub used_fields: Vec<String>,
    /// Requirements on lengths and indices that are not known here: those of fields, or of const parameters.
    pub requirements: Vec<Requirement>,
    /// Unusual properties of the declaration that are not mistakes: sentences with names between backticks.
    pub remarks: Vec<String>,
    /// The formulas as the user wrote them, in mathematical notation.
    pub notation: Notation,
}

impl Declared {
    /// Whether the number of coordinates is known at run time only.
    pub fn is_of_run_time_length(&self) -> bool {
        self.dof.is_of_run_time()
    }
}

/// The model on one line per formula:
///
/// ```text
/// L = ½ m l² θ̇² + m g l cos θ
/// coordinates: θ      parameters: m, l, g
/// ```
impl fmt::Display for Declared {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for formula in &self.notation.formulas {
            writeln!(f, "{formula}")?;
        }
        write!(f, "coordinates: {}", listed(&self.coordinates))?;
        if !self.momenta.is_empty() {
            write!(f, "      momenta: {}", listed(&self.momenta))?;
        }
        if !self.used_fields.is_empty() {
            let names: Vec<String> = self
                .used_fields
                .iter()
                .map(|name| crate::model::notation::symbol(name))
                .collect();
            write!(f, "      parameters: {}", names.join(", "))?;
        }
        if !self.inputs.is_empty() {
            let names = self.inputs.iter();
            let names: Vec<String> = names
                .map(|name| crate::model::notation::symbol(name))
                .collect();
            write!(f, "      inputs: {}", names.join(", "))?;
        }
        if !self.sensitivities.is_empty() {
            let names: Vec<String> = self
                .sensitivities
                .iter()
                .map(|parameter| Parameter {
                    field: crate::model::notation::symbol(&parameter.field),
                    element: parameter.element,
                })
                .map(|parameter| parameter.to_string())
                .collect();
            write!(f, "      sensitivity: {}", names.join(", "))?;
        }
        Ok(())
    }
}

fn listed(arrays: &[CoordinateArray]) -> String {
    let names: Vec<String> = arrays
        .iter()
        .map(|array| {
            let name = crate::model::notation::symbol(&array.name);
            match &array.length {
                Some(length) => format!("{name}[{length}]"),
                None => name,
            }
        })
        .collect();
    names.join(", ")
}
