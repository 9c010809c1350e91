//! The output for a wrong declaration: every mistake as a `compile_error!`, and stubs that prevent further errors of
//! rustc.

mod family;
mod variant;

use crate::indices::identifier;
use crate::source_map::SourceMap;
use proc_macro2::{Ident, Literal, Span, TokenStream};
use quote::{quote, quote_spanned};
use syn::{Data, DeriveInput, ItemStruct, Visibility, WhereClause, parse_quote};
use tfe_symbolic::diagnostic::{Bag, Diagnostic};
use tfe_symbolic::expr::ordered::SortedSet;
use tfe_symbolic::syntax::ast::{Array, ExprKind, Item};
use tfe_symbolic::syntax::parse;
use variant::Variant;

/// `compile_error!` under the tokens to which the diagnostic refers.
pub(crate) fn compile_error(
    diagnostic: &Diagnostic,
    map: &SourceMap,
    item: &ItemStruct,
) -> TokenStream {
    let (first, last) = match diagnostic.field() {
        Some(field) => field_span(field, item),
        None => map.spans(diagnostic.span.start..diagnostic.span.end),
    };
    let message = match diagnostic.help() {
        Some(help) => format!("{}\nhelp: {help}", diagnostic.message()),
        None => diagnostic.message(),
    };
    error((first, last), &message)
}

/// `compile_error!` under everything from one token to another.
pub(crate) fn error((first, last): (Span, Span), message: &str) -> TokenStream {
    // The first span on the path and the last on the group make rustc underline everything between them.
    let path = quote_spanned!(first=> ::core::compile_error!);
    let group = quote_spanned!(last=> { #message });
    quote!(#path #group)
}

/// A message for each attribute between arguments, such as a `cfg`; the arguments are read without it.
pub(crate) fn attributes_of_arguments(map: &SourceMap) -> TokenStream {
    let message = "an argument cannot have attributes other than doc comments\nhelp: put a `cfg` on the whole struct, and declare it once for each configuration";
    map.attributes
        .iter()
        .map(|spans| error(*spans, message))
        .collect()
}

fn field_span(name: &str, item: &ItemStruct) -> (Span, Span) {
    let ident = item
        .fields
        .iter()
        .filter_map(|field| field.ident.as_ref())
        .find(|ident| crate::input::plain(ident) == name);
    let span = ident.map_or_else(|| item.ident.span(), syn::Ident::span);
    (span, span)
}

/// Stub implementations for a type whose declaration is wrong: uses of the model type-check, so that only the mistake
/// itself is reported.
///
/// Their arguments have names that no const parameter can have, because a name may be the mistake.
pub(crate) fn stubs(item: &DeriveInput, map: &SourceMap) -> TokenStream {
    let guess = Guess::from(map, item);
    let own = implementations(item, &guess);
    let solvers = guess
        .solvers
        .iter()
        .map(|solver| solver_stub(solver, item, &guess.path));
    let variants = guess
        .variants
        .iter()
        .map(|variant| variant_stubs(variant, item, &guess));
    quote!(#own #(#solvers)* #(#variants)*)
}

/// The stubs of a model made from the one with the mistake.
fn variant_stubs(variant: &Variant, item: &DeriveInput, original: &Guess) -> TokenStream {
    let stub = DeriveInput {
        ident: variant.name.clone(),
        ..item.clone()
    };
    let guess = Guess {
        dof: variant.left(&original.dof),
        ..original.clone()
    };
    let implementations = implementations(&stub, &guess);
    let dofs = (&original.dof, &guess.dof);
    variant::stubs(variant, item, &implementations, &guess.path, dofs)
}

/// The kernels and the methods.
fn implementations(item: &DeriveInput, guess: &Guess) -> TokenStream {
    let (path, dof) = (&guess.path, &guess.extended_dof());
    let (name, vis) = (&item.ident, &item.vis);
    let states = guess.states(vis);
    let (impl_generics, type_generics, where_clause) = item.generics.split_for_impl();
    let shared = shared(item);
    let form = if guess.hamiltonian {
        quote!(Hamiltonian)
    } else {
        quote!(Lagrangian)
    };
    let outputs = &guess.outputs;
    let names = outputs.iter().map(crate::input::plain);
    if guess.run_time {
        let asked = (item, shared.as_ref());
        return family::stubs(asked, path, &form, outputs, &guess.by_site);
    }
    quote! {
        const _: () = {
            use #path::__private as __tfe;

            #[automatically_derived]
            #[allow(clippy::all)]
            impl #impl_generics __tfe::Model<#dof> for #name #type_generics #where_clause {
                const FORM: __tfe::Form = __tfe::Form::#form;
                const FACTS: __tfe::Facts = __tfe::Facts::UNKNOWN;
                const OBSERVABLES: &'static [&'static str] = &[#(#names),*];

                fn energy_function<__R: __tfe::Real>(&self, __tfe_t: __R, _: &[__R; #dof], _: &[__R; #dof]) -> __R {
                    __tfe_t
                }

                fn first<__R: __tfe::Real>(
                    &self,
                    _: __R,
                    _: &[__R; #dof],
                    _: &[__R; #dof],
                    _: &mut __tfe::First<__R, #dof>,
                ) {
                }

                fn first_and_mass<__R: __tfe::Real>(
                    &self,
                    _: __R,
                    _: &[__R; #dof],
                    _: &[__R; #dof],
                    _: &mut __tfe::First<__R, #dof>,
                    _: &mut [[__R; #dof]; #dof],
                ) {
                }

                fn second<__R: __tfe::Real>(
                    &self,
                    _: __R,
                    _: &[__R; #dof],
                    _: &[__R; #dof],
                    _: &mut __tfe::First<__R, #dof>,
                    _: &mut __tfe::Second<__R, #dof>,
                ) {
                }

                fn coordinate_name(_: usize) -> __tfe::CoordinateName {
                    __tfe::CoordinateName ::single("")
                }
            }

            #[automatically_derived]
            #[allow(clippy::all)]
            impl #impl_generics __tfe::Controlled<#dof> for #name #type_generics #shared {
                const INPUTS: &'static [&'static str] = &[];

                fn energy_function_with<__R: __tfe::Real>(
                    &self,
                    _: &[__R; __tfe::MAX_INPUTS],
                    __tfe_t: __R,
                    _: &[__R; #dof],
                    _: &[__R; #dof],
                ) -> __R {
                    __tfe_t
                }

                fn first_with<__R: __tfe::Real>(
                    &self,
                    _: &[__R; __tfe::MAX_INPUTS],
                    _: __R,
                    _: &[__R; #dof],
                    _: &[__R; #dof],
                    _: &mut __tfe::First<__R, #dof>,
                ) {
                }

                fn first_and_mass_with<__R: __tfe::Real>(
                    &self,
                    _: &[__R; __tfe::MAX_INPUTS],
                    _: __R,
                    _: &[__R; #dof],
                    _: &[__R; #dof],
                    _: &mut __tfe::First<__R, #dof>,
                    _: &mut [[__R; #dof]; #dof],
                ) {
                }

                fn second_with<__R: __tfe::Real>(
                    &self,
                    _: &[__R; __tfe::MAX_INPUTS],
                    _: __R,
                    _: &[__R; #dof],
                    _: &[__R; #dof],
                    _: &mut __tfe::First<__R, #dof>,
                    _: &mut __tfe::Second<__R, #dof>,
                ) {
                }
            }
        };

        #[automatically_derived]
        #[allow(dead_code, missing_docs, clippy::all)]
        impl #impl_generics #name #type_generics #where_clause {
            #states

            #vis fn structure() -> #path::__private::Structure {
                #path::__private::Structure::UNKNOWN
            }

            #(#vis fn #outputs(&self, _: f64, _: [f64; #dof], _: [f64; #dof]) -> f64 {
                0.0
            })*
        }
    }
}

/// A stepper that does nothing, for any number of coordinates, because that of the model may be the mistake.
fn solver_stub(solver: &Ident, item: &DeriveInput, path: &TokenStream) -> TokenStream {
    let (name, vis) = (&item.ident, &item.vis);
    let (impl_generics, type_generics, where_clause) = item.generics.split_for_impl();
    quote! {
        #[derive(::core::fmt::Debug)]
        #[allow(dead_code, missing_docs)]
        #vis struct #solver;

        #[automatically_derived]
        #[allow(dead_code, missing_docs, clippy::all)]
        impl #solver {
            #vis const BYTES: usize = 0;

            #vis fn new #impl_generics (_: &#name #type_generics, _: f64) -> Self #where_clause {
                Self
            }

            #vis fn time(&self) -> f64 {
                0.0
            }

            #vis fn set_time(&mut self, _: f64) {}

            #vis fn statistics(&self) -> &#path::__private::Statistics {
                &#path::__private::Statistics::NONE
            }

            #vis fn advance<const __DOF: usize>(
                &mut self,
                _: &mut #path::__private::State<__DOF>,
            ) -> ::core::result::Result<(), #path::__private::StepError> {
                ::core::result::Result::Ok(())
            }
        }
    }
}

/// What can be guessed about a wrong declaration.
#[derive(Clone)]
struct Guess {
    path: TokenStream,
    dof: TokenStream,
    /// The number of coordinates is known at run time only.
    run_time: bool,
    hamiltonian: bool,
    /// Whether the time is an additional coordinate.
    transformed: bool,
    outputs: Vec<Ident>,
    /// Which of them are declared by site.
    by_site: SortedSet<String>,
    solvers: Vec<Ident>,
    variants: Vec<Variant>,
}

impl Guess {
    fn from(map: &SourceMap, item: &DeriveInput) -> Self {
        let text = map.text.as_str();
        let mut guess = Self {
            path: quote!(::tfe),
            dof: quote!(1),
            run_time: false,
            hamiltonian: false,
            transformed: false,
            outputs: Vec::new(),
            by_site: SortedSet::new(),
            solvers: Vec::new(),
            variants: Vec::new(),
        };
        for range in parse::split_arguments(text) {
            let mut bag = Bag::new();
            let argument = parse::parse_item(&text[range.clone()], range.start, &mut bag);
            // The mistakes have been reported; this bag is emptied, not read.
            let _ = bag.finish(());
            match argument.map(|argument| argument.node) {
                Some(Item::Coordinates(arrays)) => {
                    guess.dof = count(&arrays, item);
                    guess.run_time = has_field_as_length(&arrays, item);
                }
                Some(Item::Hamiltonian(_)) => guess.hamiltonian = true,
                Some(Item::TimeTransformation(_)) => guess.transformed = true,
                Some(Item::Output { name, range, .. }) => {
                    guess.outputs.push(identifier(&name.node));
                    if range.is_some() {
                        guess.by_site.insert(name.node);
                    }
                }
                Some(Item::Solver { name, .. }) => guess.solvers.push(identifier(&name.node)),
                Some(Item::Model { name, passes }) => {
                    guess.variants.push(Variant::of(&name.node, &passes));
                }
                Some(Item::Crate(path)) => {
                    if let Some(path) = map.path(&path.node) {
                        guess.path = path;
                    }
                }
                None => {
                    if let Some(count) = named_coordinates(&text[range]) {
                        let count = Literal::usize_unsuffixed(count);
                        guess.dof = quote!(#count);
                    }
                }
                _ => {}
            }
        }
        // A conflicting name has been reported; rustc would report it again.
        let mut seen = SortedSet::from(["state".to_owned(), "structure".to_owned()]);
        if guess.transformed {
            seen.insert("state_at".to_owned());
        }
        guess.outputs.retain(|name| seen.insert(name.to_string()));
        let mut seen = SortedSet::from([item.ident.to_string()]);
        guess.solvers.retain(|name| seen.insert(name.to_string()));
        guess
            .variants
            .retain(|variant| seen.insert(variant.name.to_string()));
        guess
    }

    /// The number of coordinates of a state.
    fn extended_dof(&self) -> TokenStream {
        let dof = &self.dof;
        match dof.to_string().parse::<usize>() {
            Ok(fixed) if self.transformed => {
                let extended = Literal::usize_unsuffixed(fixed + 1);
                quote!(#extended)
            }
            _ => quote!(#dof),
        }
    }

    /// `state`, and `state_at` where the model would have it.
    fn states(&self, vis: &Visibility) -> TokenStream {
        let (path, dof, extended) = (&self.path, &self.dof, self.extended_dof());
        if !self.transformed {
            return quote! {
                #vis fn state(&self, __tfe_q: [f64; #dof], _: [f64; #dof]) -> #path::__private::State<#dof> {
                    #path::__private::State { q: __tfe_q, p: __tfe_q }
                }
            };
        }
        quote! {
            #vis fn state(&self, _: [f64; #dof], _: [f64; #dof]) -> #path::__private::State<#extended> {
                #path::__private::State { q: [0.0; #extended], p: [0.0; #extended] }
            }

            #vis fn state_at(&self, _: f64, _: [f64; #dof], _: [f64; #dof]) -> #path::__private::State<#extended> {
                #path::__private::State { q: [0.0; #extended], p: [0.0; #extended] }
            }
        }
    }
}

/// Whether the length of some array is a field of type `usize`.
fn has_field_as_length(arrays: &[Array], item: &DeriveInput) -> bool {
    let Data::Struct(data) = &item.data else {
        return false;
    };
    let lengths = arrays.iter().filter_map(|array| array.length.as_ref());
    lengths
        .filter_map(|length| match &length.node {
            ExprKind::Name(name) => Some(name),
            _ => None,
        })
        .any(|name| crate::input::is_length(&data.fields, name))
}

/// The number of coordinates, as a const expression.
fn count(arrays: &[Array], item: &DeriveInput) -> TokenStream {
    let is_const = |name: &str| {
        item.generics
            .const_params()
            .any(|parameter| crate::input::plain(&parameter.ident) == name)
    };
    let mut fixed = 0_usize;
    for array in arrays {
        match array.length.as_ref().map(|length| &length.node) {
            None => fixed += 1,
            Some(ExprKind::Number(number)) => fixed += number.parse::<usize>().unwrap_or(1).min(64),
            Some(ExprKind::Name(name)) if arrays.len() == 1 && is_const(name) => {
                let name = identifier(name);
                return quote!(#name);
            }
            Some(_) => fixed += 1,
        }
    }
    let fixed = Literal::usize_unsuffixed(fixed.max(1));
    quote!(#fixed)
}

/// The number of names in an unreadable `coordinates(x, y z)`; of arrays the name alone counts.
fn named_coordinates(argument: &str) -> Option<usize> {
    let is_word = |letter: char| letter.is_alphanumeric() || letter == '_';
    let names = argument.trim_start().strip_prefix("coordinates")?;
    if names.starts_with(is_word) {
        return None;
    }
    let (mut count, mut depth, mut before) = (0_usize, 0_usize, ' ');
    for letter in names.chars() {
        match letter {
            '[' => depth += 1,
            ']' => depth = depth.saturating_sub(1),
            letter if depth == 0 && letter.is_alphabetic() && !is_word(before) => count += 1,
            _ => {}
        }
        before = letter;
    }
    (count > 0).then_some(count)
}

/// The bounds that models with inputs require, so that a type parameter, which is a mistake anyway, causes no further
/// errors.
fn shared(item: &DeriveInput) -> Option<WhereClause> {
    let mut shared = item.generics.clone();
    (shared.make_where_clause().predicates)
        .push(parse_quote!(Self: ::core::marker::Send + ::core::marker::Sync));
    shared.where_clause
}
