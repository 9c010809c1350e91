//! Models of run-time length: kernels over slices.

mod constraint;
mod observable;
mod sites;
pub(crate) mod strides;
mod zero;

use crate::checks;
use crate::controls::{self, Controls};
use crate::docs::Docs;
use crate::emit::{Body, Emitter};
use crate::headings::Headings;
use crate::indices;
use crate::input;
use crate::page::{self, Formulas};
use crate::parameters::RunTimeParameters;
use proc_macro2::{Ident, Literal, TokenStream};
use quote::quote;
use strides::Strides;
use syn::ItemStruct;
use tfe_symbolic::derive::derivation::Derivation;
use tfe_symbolic::expr::input::Affine;
use tfe_symbolic::model::declared::{Declared, Form};
use tfe_symbolic::program::{Program, Request};

/// `impl FamilyModel for Name`, and the methods.
pub(crate) fn expand(
    declared: &Declared,
    derivation: &Derivation,
    (item, docs): (&ItemStruct, &Docs),
    path: &TokenStream,
) -> TokenStream {
    let kernels = Kernels {
        declared,
        derivation,
        parameters: RunTimeParameters::of(item),
        dof: length(&declared.dof),
    };
    let implementation = kernels.implementation(item, path);
    let methods = kernels.methods(item, docs, path);
    quote!(#implementation #methods)
}

struct Kernels<'a> {
    declared: &'a Declared,
    derivation: &'a Derivation,
    parameters: RunTimeParameters,
    /// The number of coordinates.
    dof: TokenStream,
}

/// The slices that a kernel receives.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Given {
    Nothing,
    /// Derivatives by coordinates, and forces.
    Forces,
    /// All first derivatives.
    First,
}

impl Kernels<'_> {
    /// The body of a kernel, with its slices cut to the length of the model, so that the compiler knows their lengths.
    fn body(&self, program: &Program, given: Given) -> Body {
        self.body_by(self.emitter(), program, given)
    }

    /// The same for a kernel that can be differentiated by parameters.
    fn sensitive_body(&self, program: &Program, given: Given) -> Body {
        let places = self.parameters.places();
        let emitter = self.emitter().with_run_time_parameters(places);
        self.body_by(emitter, program, given)
    }

    fn body_by(&self, emitter: Emitter<'_>, program: &Program, given: Given) -> Body {
        let cut = self.cut(given);
        let emitter = match given {
            Given::Forces => {
                let strides = self.strides(program);
                let assigns = strides.is_some_and(|strides| strides.assigns);
                emitter.onto_zeros().assigning(assigns)
            }
            Given::Nothing | Given::First => emitter,
        };
        let body = emitter.body(program);
        let statements = body.statements;
        Body {
            statements: quote! {
                #cut
                #statements
            },
            ..body
        }
    }

    fn emitter(&self) -> Emitter<'_> {
        Emitter::new(&[], TokenStream::new())
            .by_entries()
            .with_inputs(&self.declared.inputs)
            .with_headings(Headings::of(self.declared))
    }

    /// Cuts the slices to the length of the model.
    fn cut(&self, given: Given) -> TokenStream {
        let dof = &self.dof;
        // Parameters may have any name; a model cannot have this one.
        let length = quote!(__tfe_length);
        let forced = self.derivation.structure().forced;
        let cut = |array: TokenStream, is_written: bool| match is_written {
            true => quote!(&mut first.#array[..#length]),
            false => quote!(first.#array),
        };
        let (z, force) = (
            cut(quote!(z), given == Given::First),
            cut(quote!(force), forced),
        );
        let cut = match given {
            Given::Nothing => TokenStream::new(),
            _ => quote! {
                let first = __tfe::Gradient { z: #z, q: &mut first.q[..#length], force: #force };
            },
        };
        quote! {
            let #length = #dof;
            let (q, z) = (&q[..#length], &z[..#length]);
            #cut
        }
    }

    /// The only loop of a kernel over the sites of the only array of coordinates.
    fn strides(&self, program: &Program) -> Option<Strides> {
        match &self.declared.coordinates[..] {
            [array] => strides::of(program, array.length.as_ref()?),
            _ => None,
        }
    }

    /// The kernel of forces with its loop over sites in strides; nothing if there is no such loop.
    fn in_strides(&self, program: &Program) -> Option<TokenStream> {
        let strides = self.strides(program)?;
        let cut = self.cut(Given::Forces);
        let lend = quote! {
            let (q, z, first) = __sweep.slices();
            #cut
        };
        let [forces, name] = ["forces_inline", "forces_in_strides"].map(|name| self.kernel(name));
        let Controls {
            parameter,
            argument,
        } = Controls::of(self.declared);
        let kernels = match self.declared.inputs.is_empty() {
            true => quote!(__tfe::FamilyModel),
            false => quote!(__tfe::FamilyControlled),
        };
        // Not as a method: an output may have this name.
        let all_at_once = quote!(#kernels::#forces(self, #argument t, q, z, first));
        let body = self
            .emitter()
            .onto_zeros()
            .assigning(strides.assigns)
            .in_strides(program, strides, &lend, &all_at_once)?;
        Some(quote! {
            /// The same, several sites at a time.
            #[inline(always)]
            fn #name<R: __tfe::Real, __S: __tfe::Sweep<R>>(
                &self,
                #parameter
                t: R,
                __sweep: &mut __S,
            ) {
                #body
            }
        })
    }

    fn program(&self, request: Request) -> Program {
        self.derivation.program(request)
    }

    /// The names of the observables, and their kernel; nothing if there are none.
    fn observables(&self) -> Option<(TokenStream, TokenStream)> {
        let observables = &self.declared.observables;
        let request = Request {
            observables: true,
            ..Request::default()
        };
        (!observables.is_empty()).then(|| {
            let program = self.program(request);
            let body = self.sensitive_body(&program, Given::Nothing).statements;
            let name = self.kernel("observables");
            let inputs = Controls::of(self.declared).parameter;
            let kernel = observable::kernel(observables, (&name, &inputs), &body);
            (observable::names(observables), kernel)
        })
    }

    fn kernel(&self, name: &str) -> Ident {
        controls::kernel(self.declared, name)
    }

    fn implementation(&self, item: &ItemStruct, path: &TokenStream) -> TokenStream {
        let name = &item.ident;
        let (impl_generics, type_generics, where_clause) = item.generics.split_for_impl();
        let formulas = Formulas::of(self.declared, self.derivation);
        let value = self.program(Request::VALUE);
        let value_doc = page::kernel(&formulas.value, &value);
        let value = self.sensitive_body(&value, Given::Nothing);
        let (value_statements, value) = (value.statements, value.value);
        let value = value.unwrap_or_else(|| quote!(t.like(0.0)));
        let first = self.program(Request::FIRST);
        let first_doc = page::kernel(&formulas.first, &first);
        let first = self.sensitive_body(&first, Given::First).statements;
        let mass = self.program(Request {
            mass: true,
            ..Request::default()
        });
        let mass_doc = page::kernel(&formulas.mass, &mass);
        let mass = self.body(&mass, Given::Nothing).statements;
        let second = self.program(Request::SECOND);
        let seconds = format!("{}, {}", formulas.first, formulas.second);
        let second_doc = page::kernel(&seconds, &second);
        let second = self.body(&second, Given::First).statements;
        let forces = self.derivation.forces();
        let assigns = self.strides(&forces).filter(|strides| strides.assigns);
        let assigns = assigns.map(|_| {
            quote!(
                const ASSIGNS: bool = true;
            )
        });
        let in_strides = self.in_strides(&forces);
        let forces_doc = page::kernel(&formulas.forces, &forces);
        let forces = self.body(&forces, Given::Forces).statements;
        let form = match self.declared.form {
            Form::Lagrangian => quote!(Lagrangian),
            Form::Hamiltonian => quote!(Hamiltonian),
        };
        let facts = page::facts(self.derivation, &quote!(__tfe));
        let momenta_move = self.derivation.momenta_move();
        let (dof, check) = (&self.dof, checks::statements(self.declared));
        let coordinate_name = self.coordinate_name();
        let (observable_names, observables) = self.observables().unzip();
        let parameters = self.parameters.members();
        let constraints =
            constraint::members(self.declared, self.derivation, &self.parameters, &self.dof);
        let [value_name, first_name, forces_name, mass_name, second_name] = [
            "energy_function",
            "first",
            "forces_inline",
            "mass",
            "second",
        ]
        .map(|name| self.kernel(name));
        let inputs = Controls::of(self.declared).parameter;
        let kernels = quote! {
            #[doc = #value_doc]
            fn #value_name<R: __tfe::Real>(&self, #inputs t: R, q: &[R], z: &[R]) -> R {
                #value_statements
                #value
            }

            #[doc = #first_doc]
            fn #first_name<R: __tfe::Real>(
                &self,
                #inputs
                t: R,
                q: &[R],
                z: &[R],
                first: __tfe::Gradient<'_, R>,
            ) {
                #first
            }

            #[doc = #forces_doc]
            #[inline(always)]
            fn #forces_name<R: __tfe::Real>(
                &self,
                #inputs
                t: R,
                q: &[R],
                z: &[R],
                first: __tfe::Gradient<'_, R>,
            ) {
                #forces
            }

            #in_strides

            #[doc = #mass_doc]
            fn #mass_name<R: __tfe::Real, __E: __tfe::Entries<R>>(
                &self,
                #inputs
                t: R,
                q: &[R],
                z: &[R],
                entries: &mut __E,
            ) {
                #mass
            }

            #[doc = #second_doc]
            fn #second_name<R: __tfe::Real, __E: __tfe::Entries<R>>(
                &self,
                #inputs
                t: R,
                q: &[R],
                z: &[R],
                first: __tfe::Gradient<'_, R>,
                entries: &mut __E,
            ) {
                #second
            }

            #observables
        };
        let (kernels, controlled) = match &self.declared.inputs[..] {
            [] => (kernels, None),
            names => {
                let controlled = quote! {
                    #[automatically_derived]
                    #[allow(unused, non_snake_case, clippy::too_many_arguments)]
                    impl #impl_generics __tfe::FamilyControlled for #name #type_generics #where_clause {
                        const INPUTS: &'static [&'static str] = &[#(#names),*];

                        #kernels
                    }
                };
                let zero = zero::kernels(in_strides.is_some(), observables.is_some());
                (zero, Some(controlled))
            }
        };
        let of_deprecated = input::of_deprecated(item);
        quote! {
            #of_deprecated
            const _: () = {
                use #path::__private as __tfe;

                #[automatically_derived]
                impl #impl_generics __tfe::Declared<0> for #name #type_generics #where_clause {
                    type Length = __tfe::RunTimeLength;
                }

                #[automatically_derived]
                #[allow(unused, non_snake_case)]
                impl #impl_generics __tfe::FamilyModel for #name #type_generics #where_clause {
                    const FORM: __tfe::Form = __tfe::Form::#form;
                    const FACTS: __tfe::Facts = #facts;
                    const MOMENTA_MOVE: bool = #momenta_move;
                    #assigns

                    fn len(&self) -> usize {
                        #dof
                    }

                    fn check(&self) -> ::core::result::Result<(), __tfe::FamilyError> {
                        #check
                        ::core::result::Result::Ok(())
                    }

                    #kernels

                    #coordinate_name
                    #constraints
                    #observable_names
                    #parameters
                }

                #controlled
            };
        }
    }

    fn coordinate_name(&self) -> TokenStream {
        let arrays = self.declared.coordinates.iter().map(|array| {
            let name = &array.name;
            match &array.length {
                None => quote! {
                    if index == 0 {
                        return __tfe::CoordinateName::single(#name);
                    }
                    let index = index - 1;
                },
                Some(array_length) => {
                    let end = length(array_length);
                    quote! {
                        let end = #end;
                        if index < end {
                            return __tfe::CoordinateName::element(#name, index);
                        }
                        let index = index - end;
                    }
                }
            }
        });
        quote! {
            fn coordinate_name(&self, index: usize) -> __tfe::CoordinateName {
                #(#arrays)*
                __tfe::CoordinateName::element("", index)
            }
        }
    }

    /// `state`, `structure`, and one method for each observable.
    fn methods(&self, item: &ItemStruct, docs: &Docs, path: &TokenStream) -> TokenStream {
        let (name, vis) = (&item.ident, &input::visibility(item));
        let (impl_generics, type_generics, where_clause) = item.generics.split_for_impl();
        let (second, second_doc) = match self.declared.form {
            Form::Lagrangian => (quote!(v), "velocities"),
            Form::Hamiltonian => (quote!(p), "momenta"),
        };
        let observables = self.declared.observables.iter();
        let observables = observables.map(|one| {
            let own = docs.attributes("output", &one.name);
            let method = observable::method(one, vis, &second, second_doc, path);
            quote!(#own #method)
        });
        let structure = page::structure(self.declared, self.derivation, path);
        let of_deprecated = input::of_deprecated(item);
        quote! {
            #of_deprecated
            #[automatically_derived]
            #[allow(dead_code)]
            impl #impl_generics #name #type_generics #where_clause {
                /// The state with coordinates `q` and velocities `v` = dq/dt at time zero; its momenta are p = ∂L/∂v.
                ///
                /// Vectors of another length than the model's, and lengths of the model that do not fit together, are errors of the run.
                #vis fn state(
                    &self,
                    q: impl ::core::convert::AsRef<[::core::primitive::f64]>,
                    v: impl ::core::convert::AsRef<[::core::primitive::f64]>,
                ) -> #path::__private::FamilyState {
                    #path::__private::family_state(self, 0.0, q, v)
                }

                /// What was derived from the declaration: a page when printed.
                #vis fn structure() -> #path::__private::Structure {
                    #structure
                }

                #(#observables)*
            }
        }
    }
}

/// A number of coordinates, which saturates instead of overflowing.
fn length(affine: &Affine) -> TokenStream {
    if affine.constant == 0 && affine.terms.len() == 1 {
        return indices::index(affine);
    }
    let constant = Literal::usize_suffixed(usize::try_from(affine.constant).unwrap_or(0));
    // Each array brings its length once, so that a factor counts arrays of one length.
    affine
        .terms
        .iter()
        .fold(quote!(#constant), |sum, (symbol, factor)| {
            let symbol = indices::index(&Affine::symbol(symbol.clone()));
            if *factor == 1 {
                return quote!(#sum.saturating_add(#symbol));
            }
            let factor = Literal::usize_unsuffixed(usize::try_from(*factor).unwrap_or(0));
            quote!(#sum.saturating_add(#symbol.saturating_mul(#factor)))
        })
}
