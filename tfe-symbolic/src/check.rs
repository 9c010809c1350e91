//! Checks of declarations: what each name stands for, and which arguments are missing, repeated or in conflict.
//!
//! There is one small function for each rule. Formulas are not examined here, but in [`lower`](crate::lower). May
//! import `expr`, `vocabulary`, `diagnostic`, `syntax` and `model`.

mod arrays;
mod results;
mod solver;
mod transformation;
mod variants;
mod words;

pub use arrays::{MAX_COORDINATES, Slots};
pub(crate) use words::{reserved, unusable_type_name};

use crate::diagnostic::{Bag, Kind, Role, Span};
use crate::expr::input::{Affine, IndexSymbol};
use crate::expr::ordered::SortedMap;
use crate::model::declared::{Form, Solver};
use crate::syntax::ast::{Expr, Item, Name, Pass, Range, Spanned};
use crate::syntax::context::{Context, FieldKind, Length};
use crate::vocabulary::Argument;
use arrays::{listed, slots};

/// The largest number of inputs that a model can have.
pub const MAX_INPUTS: usize = 16;

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
}
