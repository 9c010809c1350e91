//! Checks of declarations: what each name stands for, and which arguments are missing, repeated or in conflict.
//!
//! There is one small function for each rule. Formulas are not examined here, but in [`lower`](crate::lower). May
//! import `expr`, `vocabulary`, `diagnostic`, `syntax` and `model`.

mod solver;
mod transformation;
mod variants;

use crate::diagnostic::{Bag, Kind, Role, Span, nearest};
use crate::expr::input::{Affine, IndexSymbol};
use crate::expr::ordered::SortedMap;
use crate::model::declared::{Form, Solver};
use crate::syntax::ast::{Array, Expr, ExprKind, Item, Name, Pass, Range, Spanned};
use crate::syntax::context::{Context, FieldKind, Length};
use crate::vocabulary::{Argument, is_function};

/// The largest number of coordinates in literal arrays: beyond it, tables of the engine become too large.
pub const MAX_COORDINATES: usize = 10_000;

/// The largest number of inputs that a model can have.
pub const MAX_INPUTS: usize = 16;

/// The methods that the macro gives every model; outputs become further methods.
const METHODS: &[&str] = &["state", "structure"];
/// The functions that the macro gives models made from another model.
const VARIANT_METHODS: &[&str] = &["of", "of_state"];
/// A further function, for models with a time transformation.
const CLOCK_METHOD: &str = "state_at";

/// What a name in a formula stands for.
#[derive(Clone, Debug, PartialEq)]
pub enum Symbol {
    /// The coordinate (or array) with this index.
    Coordinate(usize),
    /// The momentum (or array) with this index.
    Momentum(usize),
    /// The input with this index.
    Input(usize),
    /// The `let` with this index.
    Let(usize),
    /// The field with this index.
    Field(usize),
    /// A const parameter.
    ConstParameter,
}

impl Symbol {
    /// The role by which messages refer to it.
    pub fn role(&self) -> Role {
        match self {
            Self::Coordinate(_) => Role::Coordinate,
            Self::Momentum(_) => Role::Momentum,
            Self::Input(_) => Role::Input,
            Self::Let(_) => Role::Let,
            Self::Field(_) => Role::Field,
            Self::ConstParameter => Role::ConstParameter,
        }
    }
}

/// A coordinate or momentum (array) as declared.
#[derive(Clone, Debug, PartialEq)]
pub struct Slots {
    /// The name.
    pub name: Name,
    /// The flat index of its first element: affine in the lengths of the arrays before it.
    pub first: Affine,
    /// The length of an array.
    pub length: Option<Affine>,
}

impl Slots {
    /// Whether a mistake in the length has been reported.
    pub(crate) fn has_wrong_length(&self) -> bool {
        self.length == Some(unknown_length(&self.name.node))
    }
}

/// The arguments of the attribute, sorted by kind, with their names resolved.
#[derive(Clone, Debug, Default)]
pub struct Model {
    /// What the names stand for.
    pub symbols: SortedMap<String, Symbol>,
    /// The coordinates.
    pub coordinates: Vec<Slots>,
    /// The momenta.
    pub momenta: Vec<Slots>,
    /// The number of coordinates.
    pub dof: Affine,
    /// The inputs: numbers given at run time.
    pub inputs: Vec<Name>,
    /// The `let`s, in order.
    pub lets: Vec<(Name, Expr)>,
    /// L or H.
    pub energy: Option<(Form, Expr)>,
    /// Forces: target and value.
    pub forces: Vec<(Expr, Expr)>,
    /// The Rayleigh function.
    pub dissipation: Option<Expr>,
    /// The rate dt/dτ, and the place of the argument.
    pub time_transformation: Option<(Expr, Span)>,
    /// The constraints: name, range of a family, value.
    pub constraints: Vec<(Name, Option<Range>, Expr)>,
    /// The observables: name, range of the sites, value.
    pub outputs: Vec<(Name, Option<Range>, Expr)>,
    /// The parameters by which derivatives are wanted.
    pub sensitivities: Vec<Expr>,
    /// The solvers.
    pub solvers: Vec<Solver>,
    /// The models made from this one: name and passes.
    pub variants: Vec<(Name, Vec<Pass>)>,
    /// The path of the crate `tfe`.
    pub crate_path: Option<String>,
    /// Whether an argument is missing because of a mistake, so that nothing can be reported as unused.
    pub incomplete: bool,
    /// Whether such an argument may have declared names.
    pub names_missing: bool,
    /// Fields of a type that formulas cannot use.
    other_fields: Vec<String>,
    /// The names of all solvers, including those with mistakes.
    solver_names: Vec<String>,
    /// The places of the elements of all solvers, including those with mistakes.
    solver_spans: Vec<Span>,
    /// The elements of `solvers` as written, and their places.
    pub(crate) solver_elements: Vec<(String, Span)>,
}

/// The result of parsing an attribute.
#[derive(Clone, Debug, Default)]
pub struct Arguments {
    /// The arguments that could be read; the spans are those of their first words.
    pub items: Vec<Spanned<Item>>,
    /// The span of the whole text, for mistakes that are omissions.
    pub whole: Span,
    /// Whether some arguments could not be read.
    pub incomplete: bool,
    /// Whether those may have declared names.
    pub names_missing: bool,
}

/// Sorts the arguments of the attribute and checks the declarations among them.
pub fn model(arguments: Arguments, context: &Context, bag: &mut Bag) -> Model {
    let Arguments {
        items,
        whole,
        incomplete,
        names_missing,
    } = arguments;
    let mut model = Model {
        incomplete,
        names_missing,
        ..Model::default()
    };
    model.fields(context, bag);
    let mut seen = Vec::new();
    let mut momenta = Vec::new();
    for Spanned { node: item, span } in items {
        let argument = item.argument();
        if argument.stands_once() && seen.contains(&argument) {
            let argument = argument.word();
            bag.push(span, Kind::RepeatedArgument { argument });
            model.names_missing |= item.argument().declares_names();
            continue;
        }
        seen.push(argument);
        match item {
            Item::Coordinates(arrays) => {
                if arrays.is_empty() {
                    bag.push(span, Kind::NoCoordinates);
                }
                model.coordinates = slots(arrays, context, bag);
            }
            Item::Momenta(arrays) => {
                model.momenta = slots(arrays, context, bag);
                momenta.push(span);
            }
            Item::Input(names) => {
                if names.is_empty() {
                    bag.push(span, Kind::NoInput);
                }
                model.inputs.extend(names);
            }
            Item::Let { name, value } => model.lets.push((name, value)),
            Item::Lagrangian(value) => model.set_energy(Form::Lagrangian, value, span, bag),
            Item::Hamiltonian(value) => model.set_energy(Form::Hamiltonian, value, span, bag),
            Item::Dissipation(value) => model.dissipation = Some(value),
            Item::TimeTransformation(rate) => model.time_transformation = Some((rate, span)),
            Item::Force { target, value } => model.forces.push((target, value)),
            Item::Constraint { name, range, value } => {
                model.constraints.push((name, range, value));
            }
            Item::Output { name, range, value } => model.outputs.push((name, range, value)),
            Item::Sensitivity(parameters) => {
                if parameters.is_empty() {
                    bag.push(span, Kind::NoSensitivity);
                }
                model.sensitivities = parameters;
            }
            Item::Solver { name, element } => model.solver(&name, &element, context, bag),
            Item::Model { name, passes } => model.variants.push((name, passes)),
            Item::Crate(path) => model.crate_path = Some(path.node),
        }
    }
    model.register(bag);
    model.sizes(bag);
    model.inputs(bag);
    model.outputs(bag);
    model.constraint_names(bag);
    model.transformation(bag);
    model.check_variants(context, bag);
    if incomplete {
        // What seems to be missing may be in an argument that could not be read.
        return model;
    }
    if !seen.contains(&Argument::Coordinates) {
        bag.push(whole, Kind::NoCoordinates);
    }
    match (&model.energy, momenta.first()) {
        (None, _) => bag.push(whole, Kind::NoEnergy),
        (Some((Form::Hamiltonian, energy)), None) => bag.push(energy.span, Kind::NoMomenta),
        (Some((Form::Lagrangian, _)), Some(span)) => {
            bag.push(*span, Kind::MomentaWithLagrangian);
        }
        (Some((Form::Hamiltonian, _)), Some(span)) => model.momenta_match(*span, bag),
        (Some((Form::Lagrangian, _)), None) => {}
    }
    model
}

/// Assigns to each array its place in the flat vector.
fn slots(arrays: Vec<Array>, context: &Context, bag: &mut Bag) -> Vec<Slots> {
    let mut first = Affine::default();
    let mut slots = Vec::new();
    for Array { name, length } in arrays {
        let length = length.map(|length| array_length(&name, &length, context, bag));
        let size = match &length {
            None => 1,
            Some(length) => length
                .as_constant()
                .and_then(|n| usize::try_from(n).ok())
                .unwrap_or(0),
        };
        let before = usize::try_from(first.constant).unwrap_or(usize::MAX);
        if size > MAX_COORDINATES || before.saturating_add(size) > MAX_COORDINATES {
            bag.push(
                name.span,
                Kind::TooManyCoordinates {
                    limit: MAX_COORDINATES,
                },
            );
            // Small enough for all later steps, and of unknown length, so that no further messages follow.
            slots.push(Slots {
                length: Some(unknown_length(&name.node)),
                name,
                first: first.clone(),
            });
            continue;
        }
        let next = first.plus_scaled(length.as_ref().unwrap_or(&Affine::constant(1)), 1);
        slots.push(Slots {
            name,
            first: first.clone(),
            length,
        });
        first = next.unwrap_or(first);
    }
    slots
}

/// A length that is never compared with anything, for use after a mistake in the true one.
fn unknown_length(name: &str) -> Affine {
    Affine::symbol(IndexSymbol::Field(format!("length of {name}")))
}

fn array_length(name: &Name, length: &Expr, context: &Context, bag: &mut Bag) -> Affine {
    match &length.node {
        ExprKind::Number(text) => match text.replace('_', "").parse::<i64>() {
            Ok(0) => {
                bag.push(
                    length.span,
                    Kind::ZeroLength {
                        name: name.node.clone(),
                        field: false,
                    },
                );
            }
            Ok(size) => return Affine::constant(size),
            Err(_)
                if text
                    .bytes()
                    .all(|byte| byte.is_ascii_digit() || byte == b'_') =>
            {
                bag.push(
                    length.span,
                    Kind::NumberTooLarge {
                        number: text.clone(),
                    },
                );
            }
            Err(_) => bag.push(length.span, Kind::LengthNotSimple),
        },
        ExprKind::Name(symbol) if context.const_parameters.contains(symbol) => {
            return Affine::symbol(IndexSymbol::ConstParameter(symbol.clone()));
        }
        ExprKind::Name(symbol) => match context.field(symbol).map(|field| &field.kind) {
            Some(FieldKind::Length) => {
                return Affine::symbol(IndexSymbol::Field(symbol.clone()));
            }
            Some(_) => bag.push(length.span, Kind::LengthNotSimple),
            None => {
                let fields = context.fields.iter();
                let fields = fields.filter(|field| field.kind == FieldKind::Length);
                let parameters = context.const_parameters.iter().map(String::as_str);
                let lengths = parameters.chain(fields.map(|field| field.name.as_str()));
                let nearest = nearest(symbol, lengths);
                bag.push(
                    length.span,
                    Kind::UnknownLength {
                        name: symbol.clone(),
                        nearest,
                    },
                );
            }
        },
        _ => bag.push(length.span, Kind::LengthNotSimple),
    }
    unknown_length(&name.node)
}

/// The keywords of Rust that cannot be written as raw identifiers, and therefore cannot be names in generated code.
const KEYWORDS_WITHOUT_RAW_FORM: &[&str] = &["crate", "self", "super", "Self"];

/// Whether Rust refuses the name even in its raw form.
fn keyword(name: &str) -> Option<Kind> {
    KEYWORDS_WITHOUT_RAW_FORM
        .contains(&name)
        .then(|| Kind::Keyword {
            name: name.to_owned(),
        })
}

/// Checks the name of a struct that will be generated: formulas do not see it.
pub(crate) fn unusable_type_name(name: &str) -> Option<Kind> {
    match name {
        "_" => Some(Kind::Keyword {
            name: name.to_owned(),
        }),
        name => keyword(name),
    }
}

/// Checks a new name against the reserved words of the language.
pub(crate) fn reserved(name: &str, field: bool) -> Option<Kind> {
    if let Some(kind) = keyword(name) {
        return Some(kind);
    }
    if name.starts_with("__tfe") {
        Some(Kind::ReservedPrefix {
            name: name.to_owned(),
            field,
        })
    } else if matches!(name, "t" | "pi" | "_") || is_function(name) {
        Some(Kind::ReservedName {
            name: name.to_owned(),
            field,
        })
    } else {
        None
    }
}

impl Model {
    fn fields(&mut self, context: &Context, bag: &mut Bag) {
        for name in &context.const_parameters {
            self.symbols.insert(name.clone(), Symbol::ConstParameter);
        }
        for (at, field) in context.fields.iter().enumerate() {
            if !matches!(field.kind, FieldKind::Other(_))
                && let Some(kind) = reserved(&field.name, true)
            {
                bag.push(Span::default(), kind);
            }
            if field.kind == FieldKind::Array(Length::Literal(0)) {
                let name = field.name.clone();
                bag.push(Span::default(), Kind::ZeroLength { name, field: true });
            }
            self.symbols.insert(field.name.clone(), Symbol::Field(at));
        }
        self.other_fields = context
            .fields
            .iter()
            .filter(|field| matches!(field.kind, FieldKind::Other(_)))
            .map(|field| field.name.clone())
            .collect();
    }

    fn set_energy(&mut self, form: Form, value: Expr, span: Span, bag: &mut Bag) {
        if self.energy.is_some() {
            bag.push(span, Kind::TwoEnergies);
        } else {
            self.energy = Some((form, value));
        }
    }

    /// Enters the names that the attribute declares.
    fn register(&mut self, bag: &mut Bag) {
        let coordinates = self.coordinates.iter().map(|slots| &slots.name);
        let momenta = self.momenta.iter().map(|slots| &slots.name);
        let inputs = self.inputs.iter();
        let lets = self.lets.iter().map(|(name, _)| name);
        let names: Vec<(Name, Symbol)> = coordinates
            .enumerate()
            .map(|(at, name)| (name, Symbol::Coordinate(at)))
            .chain(
                momenta
                    .enumerate()
                    .map(|(at, name)| (name, Symbol::Momentum(at))),
            )
            .chain(
                inputs
                    .enumerate()
                    .map(|(at, name)| (name, Symbol::Input(at))),
            )
            .chain(lets.enumerate().map(|(at, name)| (name, Symbol::Let(at))))
            .map(|(name, symbol)| (name.clone(), symbol))
            .collect();
        for (Spanned { node: name, span }, symbol) in names {
            if let Some(kind) = reserved(&name, false).or_else(|| self.clock_momentum(&name)) {
                bag.push(span, kind);
            }
            match self.symbols.get(&name) {
                // A field that formulas cannot use does not conflict with the name.
                Some(taken) if !self.other_fields.contains(&name) => {
                    bag.push(
                        span,
                        Kind::NameClash {
                            name,
                            taken: taken.role(),
                        },
                    );
                }
                _ => {
                    self.symbols.insert(name, symbol);
                }
            }
        }
    }

    /// Computes the number of coordinates.
    fn sizes(&mut self, bag: &mut Bag) {
        let mut dof = Affine::default();
        for slots in &self.coordinates {
            let length = slots.length.clone().unwrap_or(Affine::constant(1));
            let generic = matches!(
                length.terms.first(),
                Some((IndexSymbol::ConstParameter(_), _))
            );
            if generic && self.coordinates.len() > 1 {
                let name = slots.name.node.clone();
                bag.push(slots.name.span, Kind::FamilyNotAlone { name });
            }
            dof = dof.plus_scaled(&length, 1).unwrap_or(dof);
        }
        if let Some((IndexSymbol::ConstParameter(length) | IndexSymbol::Field(length), _)) =
            dof.terms.first()
        {
            for span in &self.solver_spans {
                bag.push(
                    *span,
                    Kind::SolverOfFamily {
                        length: length.clone(),
                    },
                );
            }
        }
        self.dof = dof;
        self.only_at_fixed_length(bag);
    }

    /// Whether some array of coordinates has a length known at run time only.
    pub(crate) fn is_of_run_time_length(&self) -> bool {
        // A length with a mistake looks like a field, too.
        let known = |slots: &Slots| !slots.has_wrong_length();
        self.dof.is_of_run_time() && self.coordinates.iter().all(known)
    }

    /// Refuses arguments that need a fixed number of coordinates in models of run-time length.
    fn only_at_fixed_length(&self, bag: &mut Bag) {
        if self.is_of_run_time_length()
            && let Some(parameter) = self.sensitivities.first()
        {
            let argument = "sensitivity";
            bag.push(parameter.span, Kind::RunTimeLength { argument });
        }
    }

    /// Refuses arguments that cannot be combined with inputs.
    fn inputs(&self, bag: &mut Bag) {
        let Some(first) = self.inputs.first() else {
            return;
        };
        if let Some(one) = self.inputs.get(MAX_INPUTS) {
            bag.push(one.span, Kind::TooManyInputs { limit: MAX_INPUTS });
        }
        for (argument, is_there) in [
            ("solver", !self.solver_spans.is_empty()),
            ("model", !self.variants.is_empty()),
        ] {
            if is_there {
                bag.push(first.span, Kind::InputWith { argument });
            }
        }
    }

    fn momenta_match(&self, span: Span, bag: &mut Bag) {
        let lengths = |slots: &[Slots]| -> Vec<Option<Affine>> {
            slots.iter().map(|slots| slots.length.clone()).collect()
        };
        if lengths(&self.coordinates) != lengths(&self.momenta) && !self.coordinates.is_empty() {
            let coordinates = listed(&self.coordinates);
            let momenta = listed(&self.momenta);
            bag.push(
                span,
                Kind::MomentaMismatch {
                    coordinates,
                    momenta,
                },
            );
        }
    }

    fn outputs(&self, bag: &mut Bag) {
        let mut names: Vec<&str> = Vec::new();
        for (Spanned { node: name, span }, range, _) in &self.outputs {
            if let Some(range) = range
                && !self.dof.is_of_run_time()
            {
                bag.push(range.variable.span.join(range.end.span), Kind::OutputFamily);
            }
            if let Some(kind) = reserved(name, false).or_else(|| self.clock_momentum(name)) {
                bag.push(*span, kind);
            }
            // An output may have the name of the `let` that it shows; a coordinate or momentum has its column in the
            // results already.
            let taken = match self.symbols.get(name) {
                Some(symbol @ (Symbol::Coordinate(_) | Symbol::Momentum(_))) => Some(symbol.role()),
                _ if self.is_method(name) => Some(Role::Method),
                _ => names.contains(&name.as_str()).then_some(Role::Output),
            };
            if let Some(taken) = taken {
                bag.push(
                    *span,
                    Kind::NameClash {
                        name: name.clone(),
                        taken,
                    },
                );
            }
            names.push(name);
        }
    }

    /// Whether the macro gives the model a method of this name.
    fn is_method(&self, name: &str) -> bool {
        METHODS.contains(&name)
            || (self.time_transformation.is_some() && name == CLOCK_METHOD)
            || (!self.variants.is_empty() && VARIANT_METHODS.contains(&name))
    }

    /// Checks the names of constraints, which do not appear in formulas, but in results beside outputs.
    fn constraint_names(&self, bag: &mut Bag) {
        let mut names: Vec<&str> = Vec::new();
        for (Spanned { node: name, span }, ..) in &self.constraints {
            let taken = if names.contains(&name.as_str()) {
                Some(Role::Constraint)
            } else {
                let mut outputs = self.outputs.iter();
                let output = outputs.any(|(output, ..)| output.node == *name);
                output.then_some(Role::Output)
            };
            if let Some(taken) = taken {
                let name = name.clone();
                bag.push(*span, Kind::NameClash { name, taken });
            } else if let Some(kind) = unusable_type_name(name) {
                bag.push(*span, kind);
            }
            names.push(name);
        }
    }
}

fn listed(slots: &[Slots]) -> String {
    let names: Vec<String> = slots
        .iter()
        .map(|slots| match &slots.length {
            Some(length) => format!("{}[{length}]", slots.name),
            None => slots.name.node.clone(),
        })
        .collect();
    names.join(", ")
}
