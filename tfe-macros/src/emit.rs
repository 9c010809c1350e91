//! Programs of the engine as Rust statements.

mod results;
mod values;

use crate::balance::balance;
use crate::headings::Headings;
use crate::in_place::is_written_in_place;
use crate::indices::{identifier, index, loop_name, unchecked_index};
use crate::parts::{Part, Parts};
use proc_macro2::{Ident, Literal, TokenStream};
use quote::{format_ident, quote};
use tfe_symbolic::expr::function::Function;
use tfe_symbolic::expr::input::{Affine, Input, LoopVariable};
use tfe_symbolic::expr::ordered::{SortedMap, SortedSet};
use tfe_symbolic::program::{Array, Operand, Operation, Program, Statement, Temporary};

/// The arguments and variables of kernels, besides temporaries (`t0`, `sin_x`), indices, and names that begin with two
/// underscores.
pub(crate) const LOCALS: [&str; 16] = [
    "q",
    "z",
    "v",
    "first",
    "second",
    "entries",
    "zz",
    "values",
    "row",
    "rows",
    "drift",
    "mu",
    "psi_q",
    "row_rates",
    "kept",
    "inputs",
];

/// Writes programs of one model.
pub(crate) struct Emitter<'a> {
    /// The names of the coordinates by flat index, for readable temporaries.
    coordinates: &'a [String],
    /// The names of the inputs, in order.
    inputs: &'a [String],
    /// The indices of parameters by their fields; for arrays that of the first element.
    places: &'a SortedMap<String, Affine>,
    /// The same of a model of run-time length.
    run_time_places: SortedMap<String, TokenStream>,
    /// The prefix of second derivatives: `second.`, or empty if the mass matrix is the only one and an argument of its
    /// own.
    second: TokenStream,
    /// Whether second derivatives are reported entry by entry, as in models of run-time length.
    by_entries: bool,
    /// Whether the memory for results contains zeros at the start.
    onto_zeros: bool,
    /// Whether every entry of L_q is written exactly once.
    assigns: bool,
    /// The name of velocities or momenta.
    z: Ident,
    /// The names of results in headings.
    headings: Option<Headings>,
    /// The number of reads of each temporary.
    reads: SortedMap<Temporary, usize>,
    /// The indices of all loops.
    indices: SortedSet<String>,
    /// Those of them whose turns depend on fields of models of fixed size.
    unchecked: SortedSet<LoopVariable>,
    names: SortedMap<Temporary, Ident>,
    taken: SortedSet<String>,
    numbered: usize,
    parameters: SortedMap<String, Ident>,
    /// The places of values that later parts read.
    keeps: SortedMap<Temporary, usize>,
    value: Option<TokenStream>,
}

/// The name and the arguments of the functions into which a long kernel is divided.
pub(crate) struct Signature {
    /// The kernel: its parts are `__tfe_name_1`, ….
    pub(crate) name: &'static str,
    /// After `&self`, with types.
    pub(crate) parameters: TokenStream,
    /// The same without types.
    pub(crate) arguments: TokenStream,
    /// Whether the parts are inlined, as they must be where they are compiled for the instruction set of the caller.
    pub(crate) inline: bool,
}

/// The statements of a kernel and, if it was requested, the expression of the energy function.
pub(crate) struct Body {
    /// The functions that the statements call, members of an `impl` of the model; only for long kernels.
    pub(crate) parts: TokenStream,
    /// `let` statements, loops and assignments.
    pub(crate) statements: TokenStream,
    /// The value of the energy function.
    pub(crate) value: Option<TokenStream>,
}

impl<'a> Emitter<'a> {
    /// An emitter for a model with these coordinates.
    pub(crate) fn new(coordinates: &'a [String], second: TokenStream) -> Self {
        static NONE: SortedMap<String, Affine> = SortedMap::new();
        Self {
            coordinates,
            inputs: &[],
            places: &NONE,
            second,
            by_entries: false,
            onto_zeros: false,
            assigns: false,
            z: format_ident!("z"),
            headings: None,
            reads: SortedMap::new(),
            indices: SortedSet::new(),
            unchecked: SortedSet::new(),
            names: SortedMap::new(),
            taken: SortedSet::new(),
            numbered: 0,
            parameters: SortedMap::new(),
            run_time_places: SortedMap::new(),
            keeps: SortedMap::new(),
            value: None,
        }
    }

    /// The same for a model with these inputs.
    pub(crate) fn with_inputs(mut self, inputs: &'a [String]) -> Self {
        self.inputs = inputs;
        self
    }

    /// The same for a model whose parameters are numbered.
    pub(crate) fn with_parameters(mut self, places: &'a SortedMap<String, Affine>) -> Self {
        self.places = places;
        self
    }

    /// The same for a model of run-time length.
    pub(crate) fn with_run_time_parameters(
        mut self,
        places: SortedMap<String, TokenStream>,
    ) -> Self {
        self.run_time_places = places;
        self
    }

    /// The same with `v` for velocities, as in the kernels of constraints.
    pub(crate) fn with_velocity(mut self) -> Self {
        self.z = format_ident!("v");
        self
    }

    /// The same with headings that name the results.
    pub(crate) fn with_headings(mut self, headings: Headings) -> Self {
        self.headings = Some(headings);
        self
    }

    /// The same with second derivatives reported to `entries`.
    pub(crate) fn by_entries(mut self) -> Self {
        self.by_entries = true;
        self
    }

    /// The same for memory that contains zeros when the kernel begins.
    pub(crate) fn onto_zeros(mut self) -> Self {
        self.onto_zeros = true;
        self
    }

    /// The same if every entry of L_q is written exactly once.
    pub(crate) fn assigning(mut self, assigns: bool) -> Self {
        self.assigns = assigns;
        self
    }

    /// The body of a kernel.
    pub(crate) fn body(mut self, program: &Program) -> Body {
        self.survey(&program.statements);
        let statements = self.statements(&program.statements);
        let parameters = self.parameters();
        Body {
            parts: TokenStream::new(),
            statements: quote!(#parameters #statements),
            value: self.value,
        }
    }

    /// The body of a kernel, which is divided into parts if it is long.
    pub(crate) fn body_in_parts(mut self, program: &Program, signature: &Signature) -> Body {
        let Some(Parts { parts, kept, value }) = Parts::of(&program.statements) else {
            return self.body(program);
        };
        self.survey(&program.statements);
        let count = Literal::usize_unsuffixed(kept);
        let (mut functions, mut calls) = (TokenStream::new(), TokenStream::new());
        for (number, part) in (1_usize..).zip(&parts) {
            let Signature {
                name,
                parameters,
                arguments,
                inline,
            } = signature;
            let doc = format!(" Part {number} of {} of `{name}`.", parts.len());
            let inline = match inline {
                true => quote!(always),
                false => quote!(never),
            };
            let name = format_ident!("__tfe_{name}_{number}");
            let body = self.part(part);
            functions.extend(quote! {
                #[doc = #doc]
                #[inline(#inline)]
                fn #name<R: __tfe::Real>(&self, #parameters, kept: &mut [R; #count]) {
                    #body
                }
            });
            calls.extend(quote!(self.#name(#arguments, &mut kept);));
        }
        self.parameters.clear();
        let value = value.map(
            |(operand, place)| match place.map(Literal::usize_unsuffixed) {
                Some(place) => quote!(kept[#place]),
                None => self.operand(&operand),
            },
        );
        let parameters = self.parameters();
        Body {
            parts: functions,
            statements: quote! {
                #parameters
                let mut kept = [t.like(0.0); #count];
                #calls
            },
            value,
        }
    }

    fn part(&mut self, part: &Part) -> TokenStream {
        self.parameters.clear();
        self.keeps.clone_from(&part.keeps);
        let (names, places): (Vec<_>, Vec<_>) = part
            .reads
            .iter()
            .map(|(temporary, place)| (self.name(*temporary), Literal::usize_unsuffixed(*place)))
            .unzip();
        let reads = (!names.is_empty()).then(|| quote!(let [#(#names),*] = [#(kept[#places]),*];));
        let statements = self.statements(&part.statements);
        // Running sums are kept once they have their final value.
        let sums = part
            .statements
            .iter()
            .filter_map(|statement| match statement {
                Statement::Accumulator { target, .. } => Some(self.kept(*target)),
                _ => None,
            });
        let sums: TokenStream = sums.collect();
        let parameters = self.parameters();
        quote!(#parameters #reads #statements #sums)
    }

    /// Stores a value for later parts, if one of them reads it.
    fn kept(&self, temporary: Temporary) -> TokenStream {
        let Some(place) = self.keeps.get(&temporary) else {
            return TokenStream::new();
        };
        let (name, place) = (self.name(temporary), Literal::usize_unsuffixed(*place));
        quote!(kept[#place] = #name;)
    }

    /// The parameters that have been read so far.
    pub(crate) fn parameters(&self) -> TokenStream {
        let parameters = self.parameters.iter().map(|(field, local)| {
            let place = self.places.get(field).map(index);
            let place = place.or_else(|| self.run_time_places.get(field).cloned());
            let field = identifier(field);
            match place {
                Some(place) => quote!(let #local = t.parameter(#place, self.#field);),
                None => quote!(let #local = t.like(self.#field);),
            }
        });
        quote!(#(#parameters)*)
    }

    /// Counts reads and collects indices.
    pub(crate) fn survey(&mut self, statements: &[Statement]) {
        for statement in statements {
            if let Statement::Loop {
                variable,
                start,
                end,
                body,
            } = statement
            {
                self.indices.insert(variable.to_string());
                if self.is_unchecked(start) || self.is_unchecked(end) {
                    self.unchecked.insert(*variable);
                }
                self.survey(body);
            }
            for operand in statement.operands() {
                if let Operand::Temporary(temporary) = operand {
                    *self.reads.get_or_default(*temporary) += 1;
                }
            }
        }
    }

    /// Whether an index depends on fields that may not have been checked: kernels of models of fixed size may be called
    /// directly.
    fn is_unchecked(&self, index: &Affine) -> bool {
        let varies = || self.unchecked.iter().any(|own| index.depends_on(*own));
        !self.by_entries && (index.is_of_run_time() || index.holds_entry() || varies())
    }

    /// An element of an array. One below zero must not be taken for the first.
    fn at(&self, array: &TokenStream, indices: &[&Affine]) -> TokenStream {
        let indices = indices.iter().map(|a| match self.is_unchecked(a) {
            true => unchecked_index(a),
            false => index(a),
        });
        quote!(#array #([#indices])*)
    }

    pub(crate) fn statements(&mut self, statements: &[Statement]) -> TokenStream {
        let mut tokens = TokenStream::new();
        let headings = self.headings.as_ref();
        let headings = headings.map(|headings| headings.place(statements, &self.reads));
        let mut rest = statements;
        while let [statement, after @ ..] = rest {
            let at = statements.len() - rest.len();
            let heading = headings.as_ref().and_then(|headings| headings.get(&at));
            if let Some(heading) = heading {
                tokens.extend(quote!(#[doc = #heading]));
            }
            // A result that nothing else needs is written directly to its place, without a temporary.
            let in_place = is_written_in_place(rest, &self.reads);
            rest = after;
            if let (true, Statement::Let { operation, .. }, Some(next)) =
                (in_place, statement, after.first())
            {
                let in_place = match operation {
                    Operation::Negate(a) => self.take_away(next, a),
                    operation => self.changed_in_place(next, operation),
                };
                tokens.extend(in_place.unwrap_or_else(|| {
                    let value = self.operation(operation);
                    self.write(next, value)
                }));
                rest = &after[1..];
            } else {
                tokens.extend(self.statement(statement));
            }
        }
        tokens
    }

    fn statement(&mut self, statement: &Statement) -> TokenStream {
        match statement {
            Statement::Let { target, operation } => {
                let value = self.operation(operation);
                let name = match operation {
                    Operation::Call(function @ (Function::Sin | Function::Cos), arguments) => {
                        self.define_of_coordinate(*target, function.method(), arguments.first())
                    }
                    _ => self.define(*target),
                };
                let kept = self.kept(*target);
                quote!(let #name = #value; #kept)
            }
            Statement::SineCosine {
                sine,
                cosine,
                argument,
            } => {
                let of = self.operand(argument);
                let kept = [*sine, *cosine];
                let sine = self.define_of_coordinate(*sine, "sin", Some(argument));
                let cosine = self.define_of_coordinate(*cosine, "cos", Some(argument));
                let kept = kept.map(|one| self.kept(one));
                quote!(let (#sine, #cosine) = #of.sin_cos(); #(#kept)*)
            }
            Statement::Accumulator { target, start } => {
                let start = self.operand(start);
                let name = self.define(*target);
                quote!(let mut #name = #start;)
            }
            Statement::Accumulate { value, .. }
            | Statement::Assign { value, .. }
            | Statement::Store { value, .. } => {
                let value = self.operand(value);
                self.write(statement, value)
            }
            Statement::Loop {
                variable,
                start,
                end,
                body,
            } => {
                let (variable, start, end) = (loop_name(*variable), index(start), index(end));
                let body = self.statements(body);
                quote!(for #variable in #start..#end { #body })
            }
            Statement::Balance { output, length } => balance(&self.second, output, length),
            Statement::Clear { array } => self.clear(*array),
        }
    }

    /// `sum += value` or `sum -= value`, where a running sum becomes itself with something added or subtracted.
    fn changed_in_place(
        &mut self,
        statement: &Statement,
        operation: &Operation,
    ) -> Option<TokenStream> {
        let Statement::Assign { target, .. } = statement else {
            return None;
        };
        let own = Operand::Temporary(*target);
        let (operator, value) = match operation {
            Operation::Add(a, b) if *a == own => (quote!(+=), b),
            Operation::Add(a, b) if *b == own => (quote!(+=), a),
            Operation::Subtract(a, b) if *a == own => (quote!(-=), b),
            _ => return None,
        };
        let (sum, value) = (self.name(*target), self.operand(value));
        Some(quote!(#sum #operator #value;))
    }

    /// `place -= value`, where the negative of `value` is added to a place.
    fn take_away(&mut self, statement: &Statement, value: &Operand) -> Option<TokenStream> {
        let Statement::Store {
            output,
            accumulate: true,
            ..
        } = statement
        else {
            return None;
        };
        let array = output.array;
        let told = array == Array::Value || self.is_entry(array);
        if told || (self.assigns && array == Array::ByQ) {
            return None;
        }
        let (place, value) = (self.place(output), self.operand(value));
        Some(quote!(#place -= #value;))
    }

    /// A store, an accumulation or an assignment of `value`.
    fn write(&mut self, statement: &Statement, value: TokenStream) -> TokenStream {
        match statement {
            Statement::Store { output, .. } if output.array == Array::Value => {
                self.value = Some(value);
                TokenStream::new()
            }
            Statement::Store { output, .. } if self.is_entry(output.array) => {
                self.entry(output, &value)
            }
            Statement::Store {
                output,
                accumulate: false,
                ..
            } => {
                let place = self.place(output);
                quote!(#place = #value;)
            }
            Statement::Store { output, .. } => {
                let place = self.place(output);
                if self.assigns && output.array == Array::ByQ {
                    return quote!(#place = #value;);
                }
                quote!(#place += #value;)
            }
            Statement::Accumulate { target, .. } => {
                let name = self.name(*target);
                quote!(#name += #value;)
            }
            Statement::Assign { target, .. } => {
                let name = self.name(*target);
                quote!(#name = #value;)
            }
            _ => TokenStream::new(),
        }
    }

    fn name(&self, temporary: Temporary) -> Ident {
        self.names
            .get(&temporary)
            .cloned()
            .unwrap_or_else(|| format_ident!("t{}", temporary.0))
    }

    /// The next of `t0`, `t1`, …
    fn define(&mut self, temporary: Temporary) -> Ident {
        let name = format_ident!("t{}", self.numbered);
        self.numbered += 1;
        self.names.insert(temporary, name.clone());
        name
    }

    /// `sin_theta` for the sine of a coordinate.
    fn define_of_coordinate(
        &mut self,
        temporary: Temporary,
        function: &str,
        argument: Option<&Operand>,
    ) -> Ident {
        let coordinate = match argument {
            Some(Operand::Input(Input::Coordinate(a))) => a
                .as_constant()
                .and_then(|k| usize::try_from(k).ok())
                .and_then(|k| self.coordinates.get(k)),
            _ => None,
        };
        let name = coordinate.map(|name| format!("{function}_{}", name.replace(['[', ']'], "")));
        match name {
            Some(name) if !self.is_parameter(&name) && self.taken.insert(name.clone()) => {
                let name = format_ident!("{name}");
                self.names.insert(temporary, name.clone());
                name
            }
            _ => self.define(temporary),
        }
    }

    /// The local variable of a parameter: the name of its field, unless the emitter might use that name itself.
    fn local_name(&self, field: &str) -> Ident {
        let temporary = field
            .strip_prefix('t')
            .is_some_and(|rest| rest.chars().all(|c| c.is_ascii_digit()))
            || field.starts_with("sin_")
            || field.starts_with("cos_")
            || field.starts_with("__");
        // A `let` cannot have the name of a constant around it, such as `G`.
        let constant = field.starts_with(char::is_uppercase);
        let mut local =
            if LOCALS.contains(&field) || temporary || constant || self.indices.contains(field) {
                format_ident!("{field}_")
            } else {
                identifier(field)
            };
        // Beside `q` there may be a field `q_`, and beside a field `sin_x` a coordinate `x_` with its sine.
        while self.is_parameter(&local.to_string()) || self.taken.contains(&local.to_string()) {
            local = format_ident!("{local}_");
        }
        local
    }

    /// Whether the local variable of a parameter has this name.
    fn is_parameter(&self, name: &str) -> bool {
        self.parameters.values().any(|local| local == name)
    }
}
