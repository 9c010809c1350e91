//! Lowers formulas to expressions of the arena: names are resolved, `dot()` is expanded by the chain rule, vectors
//! become components, and short sums are written out.
//!
//! Sums over long or generic ranges stay loops. In an energy or a dissipation, a loop may appear under sums, and under
//! products with other factors, only, because its derivatives have to be loops over local terms again. Under anything
//! else it is written out, or reported where it is too long for that. Forces and observables may use loops anywhere.
//!
//! May import `check`, `variants`, `derive` for kinds of constraints, and what these may import.

mod affine;
mod constraints;
mod extended;
mod forces;
mod formulas;
mod lets_with_rates;
mod names;
mod passes;
mod rates;
mod requirements;
mod scalar;
mod sensitivity;
mod sites;
mod sums;
mod transformation;
mod usage;
mod vector;

use crate::check::Model;
use crate::diagnostic::{Bag, Kind, Span};
use crate::expr::graph::{ExprId, Graph, SumRange};
use crate::expr::hash::Map;
use crate::expr::input::{Affine, IndexSymbol, LoopVariable};
use crate::expr::ordered::SortedMap;
use crate::model::declared::{CoordinateArray, Declared, Form, Requirement};
use crate::syntax::ast::{Expr, ExprKind};
use crate::syntax::context::Context;
use crate::variants;

/// The longest sum that is written out wherever it stands.
pub const SHORT_SUM: u64 = 16;
/// The longest sum that is written out where it must be.
pub const LONGEST_WRITTEN_OUT: u64 = 512;

/// Lowers a checked model.
///
/// `None` if there is no energy; the reason is in the bag.
pub fn lower(model: &Model, context: &Context, bag: &mut Bag) -> Option<Declared> {
    let mut lowerer = Lowerer::new(model, context, bag);
    let form = model
        .energy
        .as_ref()
        .map_or(Form::Lagrangian, |(form, _)| *form);
    let energy = model
        .energy
        .as_ref()
        .and_then(|(_, value)| lowerer.energy(form, value));
    lowerer.hamiltonian = energy.filter(|_| form == Form::Hamiltonian);
    lowerer.usual_dot = match form {
        Form::Lagrangian => DotRule::Velocity,
        Form::Hamiltonian => DotRule::ByHamiltonian,
    };
    lowerer.setting.dot = lowerer.usual_dot;
    let (dissipation, mut forces) = match &model.dissipation {
        Some(value) => lowerer.dissipation(form, value),
        None => (None, Vec::new()),
    };
    for (target, value) in &model.forces {
        forces.extend(lowerer.force(target, value));
    }
    let rate = lowerer.rate_of_time();
    let observables = lowerer.observables();
    let constraints = lowerer.constraints();
    lowerer.check_solvers(&constraints);
    let sensitivities = lowerer.sensitivities(&constraints);
    // Mistakes in an unused `let` are reported as well.
    for at in 0..model.lets.len() {
        lowerer.named(at);
    }
    let used_fields = lowerer.used_fields();
    let variants = lowerer.variants();
    lowerer.check_usage(form, energy, (&constraints, &forces, dissipation));
    let all_fields = lowerer.used_fields();
    if let Some(pending) = lowerer.turn_by_turn.take()
        && lowerer.bag.is_empty()
    {
        lowerer.nonlinear_sum(pending.span);
    }
    let mut formulas: Vec<ExprId> = energy.into_iter().chain(dissipation).collect();
    formulas.extend(forces.iter().map(|force| force.value));
    formulas.extend(observables.iter().map(|one| one.value));
    lowerer.settle_empty_sums(&formulas);
    let requirements = std::mem::take(&mut lowerer.requirements);
    let remarks = std::mem::take(&mut lowerer.remarks);
    let graph = lowerer.graph;
    let arrays = |slots: &[crate::check::Slots]| {
        let array = |slots: &crate::check::Slots| CoordinateArray {
            name: slots.name.node.clone(),
            first: slots.first.clone(),
            length: slots.length.clone(),
        };
        slots.iter().map(array).collect()
    };
    let mut declared = Declared {
        name: context.struct_name.clone(),
        form,
        dof: model.dof.clone(),
        coordinates: arrays(&model.coordinates),
        momenta: arrays(&model.momenta),
        graph,
        energy: energy?,
        dissipation,
        time_transformation: None,
        forces,
        constraints,
        observables,
        sensitivities,
        inputs: model.inputs.iter().map(|name| name.node.clone()).collect(),
        solvers: model.solvers.clone(),
        variants: Vec::new(),
        crate_path: model.crate_path.clone(),
        used_fields,
        requirements,
        remarks: Vec::new(),
        notation: formulas::formulas(model),
    };
    // A model made from a wrong one would repeat its mistakes.
    if bag.is_empty() {
        for (name, steps) in &variants {
            match variants::variant(&declared, name, steps, &all_fields) {
                Ok(variant) => declared.variants.push(variant),
                Err((span, kind)) => bag.push(span, kind),
            }
        }
    }
    // Models made from this one may lack what the remarks refer to.
    declared.remarks = remarks;
    let Some((rate, (_, span))) = rate.zip(model.time_transformation.as_ref()) else {
        return Some(declared);
    };
    match extended::extended(declared, rate) {
        Ok(declared) => Some(declared),
        Err(kind) => {
            bag.push(*span, kind);
            None
        }
    }
}

/// The value of a formula. `None` in the functions below stands for "already reported".
#[derive(Clone, Debug)]
enum Value {
    Scalar(ExprId),
    Vector(Vec<ExprId>),
    Error,
}

/// The meaning of `dot()` of a coordinate.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum DotRule {
    /// Its velocity.
    Velocity,
    /// A mistake: the formula is the Hamiltonian itself.
    Forbidden,
    /// ∂H/∂p.
    ByHamiltonian,
}

/// The rules that hold in the present formula.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Setting {
    dot: DotRule,
    /// Loops must stay linear: it is an energy or a dissipation.
    linear_loops: bool,
}

/// The index of a sum around the present formula.
#[derive(Clone, Debug)]
struct Index {
    name: String,
    variable: LoopVariable,
    start: Affine,
    end: Affine,
    /// Its difference to its variable, which starts at zero or above: programs have no loops below zero.
    offset: Affine,
    /// Its value, where the sum is unrolled turn by turn while it is lowered.
    at: Option<Affine>,
}

impl Index {
    /// The value of the index in formulas and in other indices.
    fn value(&self) -> Affine {
        match &self.at {
            Some(at) => at.clone(),
            None => {
                let variable = Affine::symbol(IndexSymbol::Loop(self.variable));
                let value = self.offset.plus_scaled(&variable, 1);
                value.unwrap_or(variable)
            }
        }
    }
}

/// A nonlinear expression around a sum that can be unrolled only if outer sums are.
#[derive(Clone, Debug)]
struct TurnByTurn {
    /// The indices of those sums.
    variables: Vec<LoopVariable>,
    /// The sum inside.
    span: Span,
}

/// A declaration whose formula may have an index of its own.
#[derive(Clone, Debug)]
struct DeclaredPlace {
    /// `constraint(rod[i in 0..n-1])`
    text: String,
    /// The number of its own indices among those in scope.
    own: usize,
}

struct Lowerer<'a> {
    model: &'a Model,
    context: &'a Context,
    bag: &'a mut Bag,
    graph: Graph,
    setting: Setting,
    /// The meaning of `dot()` in most formulas; the values of `let`s are kept for this meaning.
    usual_dot: DotRule,
    /// H, once it is known.
    hamiltonian: Option<ExprId>,
    /// The values of `let`s outside any loop.
    lets: Vec<Option<Value>>,
    /// Those inside this many loops and under other rules: each is lowered once, however many formulas use it.
    lets_here: SortedMap<(usize, u32, Setting), Value>,
    /// Which `let`s contain a `dot()`, directly or through other `let`s.
    rates: Vec<bool>,
    /// The number of `let`s that precede the present formula.
    visible_lets: usize,
    /// The sums around it, outermost first.
    indices: Vec<Index>,
    /// The declaration around it, where that is one that messages name.
    place: Option<DeclaredPlace>,
    /// The number of loops around the present `let` that its formula does not see.
    hidden_loops: u32,
    /// The largest number of terms of the sums met since it was last cleared; `None`: generic.
    terms: Option<u64>,
    /// The number of terms of each loop that was made.
    loops: Map<ExprId, Option<u64>>,
    /// Set if the sums around the present formula have to be unrolled turn by turn.
    turn_by_turn: Option<TurnByTurn>,
    /// The lengths of sums of vectors, by the place of their indices.
    vector_sums: Map<Span, usize>,
    /// The smallest and largest value of indices that vary, as far as they are numbers.
    extents: Map<Affine, Option<(i64, i64)>>,
    /// Which fields formulas use.
    fields: Vec<bool>,
    /// Which inputs formulas use.
    inputs: Vec<bool>,
    /// Requirements on lengths and indices that are not known here.
    requirements: Vec<Requirement>,
    /// The sums that may have no terms: the places of their requirements, and their ranges.
    summed: Vec<(usize, SumRange)>,
    /// Unusual properties of the declaration that are not mistakes.
    remarks: Vec<String>,
}

impl<'a> Lowerer<'a> {
    fn new(model: &'a Model, context: &'a Context, bag: &'a mut Bag) -> Self {
        let mut lowerer = Self {
            model,
            context,
            bag,
            graph: Graph::default(),
            setting: Setting {
                dot: DotRule::Velocity,
                linear_loops: false,
            },
            usual_dot: DotRule::Velocity,
            hamiltonian: None,
            lets: vec![None; model.lets.len()],
            lets_here: SortedMap::new(),
            rates: lets_with_rates::lets_with_rates(model),
            visible_lets: model.lets.len(),
            indices: Vec::new(),
            place: None,
            hidden_loops: 0,
            terms: Some(1),
            loops: Map::default(),
            turn_by_turn: None,
            vector_sums: Map::default(),
            extents: Map::default(),
            fields: vec![false; context.fields.len()],
            inputs: vec![false; model.inputs.len()],
            requirements: Vec::new(),
            summed: Vec::new(),
            remarks: Vec::new(),
        };
        // A length is a use of the field.
        for slots in model.coordinates.iter().chain(&model.momenta) {
            for (symbol, _) in slots.length.iter().flat_map(|length| &length.terms) {
                lowerer.use_symbol(symbol);
            }
        }
        lowerer
    }

    fn energy(&mut self, form: Form, value: &Expr) -> Option<ExprId> {
        let dot = match form {
            Form::Lagrangian => DotRule::Velocity,
            Form::Hamiltonian => DotRule::Forbidden,
        };
        self.within(
            Setting {
                dot,
                linear_loops: true,
            },
            |lowerer| lowerer.scalar(value),
        )
    }

    fn within<T>(&mut self, setting: Setting, work: impl FnOnce(&mut Self) -> T) -> T {
        let before = std::mem::replace(&mut self.setting, setting);
        let result = work(self);
        self.setting = before;
        result
    }

    fn report(&mut self, span: Span, kind: Kind) {
        self.bag.push(span, kind);
    }

    /// A number; a vector is a mistake.
    fn scalar(&mut self, expr: &Expr) -> Option<ExprId> {
        match self.value(expr) {
            Value::Scalar(id) => Some(id),
            Value::Vector(components) => {
                self.report(
                    expr.span,
                    Kind::ScalarExpected {
                        length: components.len(),
                    },
                );
                None
            }
            Value::Error => None,
        }
    }

    /// A vector; a number is a mistake.
    fn vector(&mut self, expr: &Expr) -> Option<Vec<ExprId>> {
        match self.value(expr) {
            Value::Vector(components) => Some(components),
            Value::Scalar(_) => {
                self.report(expr.span, Kind::VectorExpected);
                None
            }
            Value::Error => None,
        }
    }

    fn value(&mut self, expr: &Expr) -> Value {
        match &expr.node {
            ExprKind::Number(text) => self.number(text, expr.span),
            ExprKind::Name(name) => self.name(name, expr.span),
            ExprKind::Index { value, index } => self.element(value, index, expr.span),
            ExprKind::Negate(value) => match self.value(value) {
                Value::Scalar(id) => Value::Scalar(self.graph.negate(id)),
                Value::Vector(components) => Value::Vector(
                    components
                        .into_iter()
                        .map(|id| self.graph.negate(id))
                        .collect(),
                ),
                Value::Error => Value::Error,
            },
            ExprKind::Binary { .. } => self.chain(expr),
            ExprKind::Call {
                function,
                arguments,
            } => self.call(function, arguments, expr),
            ExprKind::Select {
                comparison,
                left,
                right,
                then,
                otherwise,
            } => self.select(*comparison, [left, right], [then, otherwise]),
            ExprKind::Sum { range, body } => {
                let value = self.sum(range, body);
                self.finite(&value, expr);
                value
            }
            ExprKind::Vector(components) => {
                if components.is_empty() {
                    self.report(expr.span, Kind::EmptyVector);
                    return Value::Error;
                }
                let row = |part: &&Expr| matches!(part.node, ExprKind::Vector(_));
                if let Some(row) = components.iter().find(row) {
                    self.report(row.span, Kind::Matrix);
                    return Value::Error;
                }
                let values: Vec<_> = components.iter().map(|part| self.scalar(part)).collect();
                values
                    .into_iter()
                    .collect::<Option<Vec<_>>>()
                    .map_or(Value::Error, Value::Vector)
            }
            ExprKind::Error => Value::Error,
        }
    }
}

impl From<Option<ExprId>> for Value {
    fn from(id: Option<ExprId>) -> Self {
        id.map_or(Self::Error, Self::Scalar)
    }
}
