//! The whole expansion, from tokens to tokens; it can be read from top to bottom.

mod kernels;
mod sensitivities;
mod without_inputs;

use crate::controls::{self, Controls};
use crate::docs::Docs;
use crate::emit::{self, Emitter, Signature};
use crate::headings::Headings;
use crate::indices;
use crate::lengths::Lengths;
use crate::page;
use crate::parameters::Parameters;
use crate::source_map::SourceMap;
use crate::{checks, constraint, fallback, family, input, solver, state, variant};
use proc_macro2::{Ident, Literal, TokenStream};
use quote::quote;
use syn::ItemStruct;
use tfe_symbolic::compile;
use tfe_symbolic::derive::derivation::Derivation;
use tfe_symbolic::diagnostic::Kind;
use tfe_symbolic::expr::input::Affine;
use tfe_symbolic::expr::ordered::SortedMap;
use tfe_symbolic::model::declared::{Declared, Form, Observable, names};
use tfe_symbolic::program::{Program, Request};

/// Expands `#[dynamics(arguments)] item`.
pub(crate) fn expand(arguments: TokenStream, item: TokenStream) -> TokenStream {
    let map = SourceMap::new(arguments);
    let wrong = |item: TokenStream, errors: TokenStream| {
        // For an item that is not a type, only the error can be reported.
        let stubs = syn::parse2(item.clone())
            .map(|item| fallback::stubs(&item, &map))
            .unwrap_or_default();
        quote!(#item #stubs #errors)
    };
    let mut item_struct = match input::parse(item.clone()) {
        Ok(item) => item,
        Err(error) => return wrong(item, error.to_compile_error()),
    };
    let mut misplaced = input::take_repeated(&mut item_struct);
    misplaced.extend(fallback::attributes_of_arguments(&map));
    let item = quote!(#item_struct);
    if let Err(error) = input::check(&item_struct) {
        misplaced.extend(error.to_compile_error());
        return wrong(item, misplaced);
    }
    let solvers = solver::of_many_types(&item_struct, &map);
    match compile::declare(&map.text, &input::context(&item_struct)) {
        Ok(declared) if solvers.is_empty() => {
            let model = model(
                &declared,
                item_struct,
                &Docs::of(&map),
                &runtime_path(&declared, &map),
            );
            quote!(#model #misplaced)
        }
        Ok(_) => wrong(item, quote!(#solvers #misplaced)),
        Err(diagnostics) => {
            let messages = diagnostics
                .iter()
                .map(|d| fallback::compile_error(d, &map, &item_struct));
            // For coordinates whose number is a const parameter, the engine has reported it.
            let is_said = diagnostics
                .iter()
                .any(|d| matches!(d.kind, Kind::SolverOfFamily { .. }));
            let solvers = (!is_said).then_some(solvers);
            wrong(item, quote!(#(#messages)* #solvers #misplaced))
        }
    }
}

/// The struct with the derived model in its documentation, the kernels, the methods, and the specialised solvers.
fn model(
    declared: &Declared,
    mut item: ItemStruct,
    docs: &Docs,
    path: &TokenStream,
) -> TokenStream {
    let derivation = Derivation::of(declared);
    let variants: Vec<_> = declared
        .variants
        .iter()
        .map(|one| {
            let (made, methods) = variant::expand(one, &item, path, docs);
            let model = model(&one.model, made, &docs.of_outputs(), path);
            quote!(#model #methods)
        })
        .collect();
    for line in docs.others() {
        item.attrs.push(syn::parse_quote!(#[doc = #line]));
    }
    let documented = item
        .attrs
        .iter()
        .any(|attribute| attribute.path().is_ident("doc"));
    for line in page::lines(declared, &derivation, documented) {
        item.attrs.push(syn::parse_quote!(#[doc = #line]));
    }
    if declared.is_of_run_time_length() {
        let family = family::expand(declared, &derivation, (&item, docs), path);
        return quote!(#item #family #(#variants)*);
    }
    let kernels = Kernels::new(declared, &derivation, &item, path);
    let implementation = kernels.implementation();
    let methods = kernels.methods(docs);
    let solvers = declared
        .solvers
        .iter()
        .map(|solver| solver::expand(solver, declared, (&item, docs), path));
    quote! {
        #item
        #implementation
        #methods
        #(#solvers)*
        #(#variants)*
    }
}

/// The path of the runtime in emitted code: `::tfe`, or that of `crate = path`.
fn runtime_path(declared: &Declared, map: &SourceMap) -> TokenStream {
    let path = declared.crate_path.as_deref();
    path.and_then(|path| map.path(path))
        .unwrap_or_else(|| quote!(::tfe))
}

/// Everything that the emitted implementations have in common.
struct Kernels<'a> {
    declared: &'a Declared,
    derivation: &'a Derivation,
    item: &'a ItemStruct,
    path: &'a TokenStream,
    /// The number of coordinates, as a const expression.
    dof: TokenStream,
    /// The names of the coordinates where their number is known.
    coordinates: Vec<String>,
    parameters: Parameters,
    /// The numbers of the parameters.
    places: SortedMap<String, Affine>,
}

impl<'a> Kernels<'a> {
    fn new(
        declared: &'a Declared,
        derivation: &'a Derivation,
        item: &'a ItemStruct,
        path: &'a TokenStream,
    ) -> Self {
        let parameters = Parameters::of(item);
        Self {
            declared,
            derivation,
            item,
            path,
            dof: indices::index(&declared.dof),
            coordinates: names(&declared.coordinates),
            places: parameters.places(),
            parameters,
        }
    }

    /// The body of a kernel; second derivatives are written to fields of `second`, or to an argument.
    fn body(&self, request: Request, second: TokenStream) -> emit::Body {
        self.emitted(&self.derivation.program(request), second)
    }

    /// The body of a kernel, which is divided into parts if it is long.
    fn body_in_parts(
        &self,
        request: Request,
        second: TokenStream,
        signature: &Signature,
    ) -> emit::Body {
        Emitter::new(&self.coordinates, second)
            .with_inputs(&self.declared.inputs)
            .with_parameters(&self.places)
            .with_headings(Headings::of(self.declared))
            .body_in_parts(&self.derivation.program(request), signature)
    }

    fn emitted(&self, program: &Program, second: TokenStream) -> emit::Body {
        Emitter::new(&self.coordinates, second)
            .with_inputs(&self.declared.inputs)
            .with_parameters(&self.places)
            .body(program)
    }

    /// `impl Model<N> for Name`.
    fn implementation(&self) -> TokenStream {
        let Self {
            path, dof, item, ..
        } = self;
        let name = &item.ident;
        let (impl_generics, type_generics, where_clause) = item.generics.split_for_impl();
        let lanes = self.lanes();
        let (kernels, parts) = self.energy_kernels(lanes.as_ref());
        let (observable_names, observables) = self.observables();
        let (sensitivity_values, first_by) = self.sensitivities();
        let kernels = quote!(#kernels #observables #first_by);
        let (kernels, controlled) = match self.declared.inputs.is_empty() {
            true => (kernels, TokenStream::new()),
            false => (self.without_inputs(lanes), self.controlled(&kernels)),
        };
        let form = match self.declared.form {
            Form::Lagrangian => quote!(Lagrangian),
            Form::Hamiltonian => quote!(Hamiltonian),
        };
        let facts = page::facts(self.derivation, &quote!(__tfe));
        let ignorable = page::ignorable(self.derivation, dof);
        let diagonal_mass = page::diagonal_mass(self.derivation);
        let coordinate_name = self.coordinate_name();
        let names = (self.coordinates.as_slice(), &self.places);
        let constraints = constraint::members(self.declared, self.derivation, names);
        let parameters = self.parameters.members(item);
        let check = checks::member(self.declared);
        let lengths = Lengths::of(self.declared, item).constant;
        let of_deprecated = input::of_deprecated(item);
        quote! {
            #of_deprecated
            const _: () = {
                use #path::__private as __tfe;

                #lengths

                #[automatically_derived]
                #[allow(unused, non_snake_case)]
                impl #impl_generics __tfe::Model<#dof> for #name #type_generics #where_clause {
                    const FORM: __tfe::Form = __tfe::Form::#form;
                    const FACTS: __tfe::Facts = #facts;
                    #ignorable
                    #diagonal_mass

                    #check

                    #kernels

                    #coordinate_name
                    #observable_names
                    #constraints
                    #parameters
                    #sensitivity_values
                }

                #controlled

                #parts
            };
        }
    }

    /// `impl Controlled<N> for Name`: the kernels of a model with inputs.
    fn controlled(&self, kernels: &TokenStream) -> TokenStream {
        let (name, dof, names) = (&self.item.ident, &self.dof, &self.declared.inputs);
        let (impl_generics, type_generics, where_clause) = self.item.generics.split_for_impl();
        quote! {
            #[automatically_derived]
            #[allow(unused, non_snake_case, clippy::too_many_arguments)]
            impl #impl_generics __tfe::Controlled<#dof> for #name #type_generics #where_clause {
                const INPUTS: &'static [&'static str] = &[#(#names),*];

                #kernels
            }
        }
    }

    fn kernel(&self, name: &str) -> Ident {
        controls::kernel(self.declared, name)
    }

    fn coordinate_name(&self) -> TokenStream {
        let mut open_end = false;
        let arms: Vec<_> = self
            .declared
            .coordinates
            .iter()
            .map(|array| {
                let first = array.first.as_constant().unwrap_or(0);
                let start = usize::try_from(first).unwrap_or(0);
                let (name, first) = (&array.name, Literal::usize_unsuffixed(start));
                let element = match start {
                    0 => quote!(index),
                    _ => quote!(index - #first),
                };
                let element = quote!(__tfe::CoordinateName::element(#name, #element));
                match array.length.as_ref().map(Affine::as_constant) {
                    None => quote!(#first => __tfe::CoordinateName::single(#name),),
                    Some(Some(length)) => {
                        let end = start + usize::try_from(length).unwrap_or(0);
                        let end = Literal::usize_unsuffixed(end);
                        quote!(#first..#end => #element,)
                    }
                    Some(None) => {
                        open_end = true;
                        quote!(#first.. => #element,)
                    }
                }
            })
            .collect();
        let otherwise =
            (!open_end).then(|| quote!(_ => __tfe::CoordinateName::element("", index),));
        quote! {
            fn coordinate_name(index: usize) -> __tfe::CoordinateName {
                match index {
                    #(#arms)*
                    #otherwise
                }
            }
        }
    }

    /// The names of the observables, and their kernel.
    fn observables(&self) -> (TokenStream, TokenStream) {
        if self.declared.observables.is_empty() {
            return Default::default();
        }
        let (given, kernel) = (
            Controls::of(self.declared).parameter,
            self.kernel("observables"),
        );
        let dof = &self.dof;
        let names = self.declared.observables.iter().map(|one| &one.name);
        let request = Request {
            observables: true,
            ..Request::default()
        };
        let body = self.body(request, TokenStream::new()).statements;
        let names = quote!(const OBSERVABLES: &'static [&'static str] = &[#(#names),*];);
        let kernel = quote! {
            fn #kernel<R: __tfe::Real>(&self, #given t: R, q: &[R; #dof], z: &[R; #dof], values: &mut [R]) {
                #body
            }
        };
        (names, kernel)
    }

    /// `state`, `structure`, and one method for each observable.
    fn methods(&self, docs: &Docs) -> TokenStream {
        let Self {
            path, dof, item, ..
        } = self;
        let (name, vis) = (&item.ident, &input::visibility(item));
        let (impl_generics, type_generics, where_clause) = item.generics.split_for_impl();
        let (second, second_doc) = match self.declared.form {
            Form::Lagrangian => (quote!(v), "velocities"),
            Form::Hamiltonian => (quote!(p), "momenta"),
        };
        // If there is a coordinate `t`, the time of the steps has another name.
        let time = match self.declared.time_transformation {
            None => quote!(t),
            Some(_) => quote!(tau),
        };
        let count = Literal::usize_unsuffixed(self.declared.observables.len());
        let unknown = quote!(return ::core::primitive::f64::NAN;);
        let (guard, remark) = checks::guard(self.declared, path, &unknown);
        let observables = self.declared.observables.iter().enumerate().map(|(k, Observable { name, .. })| {
            let (method, k) = (indices::identifier(name), Literal::usize_unsuffixed(k));
            let inputs = match self.declared.inputs.is_empty() {
                true => "",
                false => "; all inputs are zero",
            };
            let doc = format!(" The observable `{name}` at time `{time}`, coordinates `q` and {second_doc} `{second}`{inputs}{remark}.");
            let own = docs.attributes("output", name);
            quote! {
                #own
                #[doc = #doc]
                #vis fn #method(&self, #time: f64, q: [f64; #dof], #second: [f64; #dof]) -> f64 {
                    #guard
                    let mut values = [0.0; #count];
                    #path::__private::Model::observables(self, #time, &q, &#second, &mut values);
                    values[#k]
                }
            }
        });
        let structure = page::structure(self.declared, self.derivation, path);
        let state = state::methods(self.declared, vis, path);
        let of_deprecated = input::of_deprecated(item);
        quote! {
            #of_deprecated
            #[automatically_derived]
            #[allow(dead_code)]
            impl #impl_generics #name #type_generics #where_clause {
                #state

                /// What was derived from the declaration: a page when printed.
                #vis fn structure() -> #path::__private::Structure {
                    #structure
                }

                #(#observables)*
            }
        }
    }
}
