//! The kernels of the energy function: its value, its first derivatives, those with the mass matrix, all derivatives.

use super::Kernels;
use crate::controls::Controls;
use crate::emit::Signature;
use crate::lengths::Lengths;
use crate::page::{self, Formulas};
use proc_macro2::TokenStream;
use quote::quote;
use tfe_symbolic::program::Request;

/// Kernels with more operations are not compiled a second time for several points at once: that would take longer to
/// compile than it saves.
const LANES_LIMIT: usize = 4000;

/// Without optimisation, larger kernels are not compiled for lanes: lanes are then no faster, and for the arm of six
/// links in space (2600 operations) they take four of nine seconds. The results are the same.
const UNOPTIMISED_LANES_LIMIT: usize = 500;

/// One kernel.
struct Kernel {
    doc: String,
    parameters: TokenStream,
    statements: TokenStream,
    value: Option<TokenStream>,
    parts: TokenStream,
}

impl Kernels<'_> {
    /// The kernels of the energy function, and an `impl` with the functions into which long ones are divided, empty if
    /// none is. `lanes` is what [`lanes`](Self::lanes) returns.
    pub(super) fn energy_kernels(&self, lanes: Option<&TokenStream>) -> (TokenStream, TokenStream) {
        let dof = &self.dof;
        let first = (quote!(first: &mut __tfe::First<R, #dof>), quote!(first));
        let zz = (quote!(zz: &mut [[R; #dof]; #dof]), quote!(zz));
        let second = (quote!(second: &mut __tfe::Second<R, #dof>), quote!(second));
        let Formulas {
            value: value_formula,
            first: first_formula,
            mass: mass_formula,
            second: second_formula,
            ..
        } = Formulas::of(self.declared, self.derivation);
        let value = self.kernel_for(Request::VALUE, &value_formula, ("value", &[], false));
        let inline = lanes.is_some();
        let added = [first, zz];
        let firsts = ("first", &added[..1], inline);
        let masses = ("first_and_mass", &added[..], inline);
        let firsts = self.kernel_for(Request::FIRST, &first_formula, firsts);
        let mass_formula = format!("{first_formula}, and {mass_formula}");
        let masses = self.kernel_for(Request::FIRST_AND_MASS, &mass_formula, masses);
        let [first, _] = added;
        let added = [first, second];
        let second_formula = format!("{first_formula}, {second_formula}");
        let seconds = ("second", &added[..], false);
        let seconds = self.kernel_for(Request::SECOND, &second_formula, seconds);
        let lengths = Lengths::of(self.declared, self.item).statement;
        let [value_name, second_name] = ["energy_function", "second"].map(|name| self.kernel(name));
        let parts = [&value, &firsts, &masses, &seconds].map(|kernel| &kernel.parts);
        let parts = quote!(#(#parts)*);
        let (value_doc, value_parameters) = (value.doc, value.parameters);
        let (value_statements, value) = (value.statements, value.value);
        let value = value.unwrap_or_else(|| quote!(t.like(0.0)));
        let (second_doc, second_parameters) = (seconds.doc, seconds.parameters);
        let second_statements = seconds.statements;
        let firsts_and_masses = self.firsts_and_masses(&lengths, [firsts, masses], lanes);
        let kernels = quote! {
            #[doc = #value_doc]
            fn #value_name<R: __tfe::Real>(&self, #value_parameters) -> R {
                #lengths
                #value_statements
                #value
            }

            #firsts_and_masses

            #[doc = #second_doc]
            fn #second_name<R: __tfe::Real>(&self, #second_parameters) {
                #lengths
                #second_statements
            }
        };
        (kernels, self.inherent(parts))
    }

    /// The kernels of first derivatives, which are inlined where they are compiled for several points side by side.
    fn firsts_and_masses(
        &self,
        lengths: &TokenStream,
        [firsts, masses]: [Kernel; 2],
        lanes: Option<&TokenStream>,
    ) -> TokenStream {
        let (first_doc, first_parameters) = (firsts.doc, firsts.parameters);
        let (mass_doc, mass_parameters) = (masses.doc, masses.parameters);
        let (first, mass) = (firsts.statements, masses.statements);
        let has_inputs = !self.declared.inputs.is_empty();
        let Some(lanes_here) = lanes.filter(|_| !has_inputs) else {
            let [first_name, mass_name] = ["first", "first_and_mass"].map(|name| self.kernel(name));
            // Those of `Controlled` are written into those of `Model`, which say that they are.
            let inline = lanes.map(|_| quote!(#[inline(always)]));
            return quote! {
                #[doc = #first_doc]
                #inline
                fn #first_name<R: __tfe::Real>(&self, #first_parameters) {
                    #lengths
                    #first
                }

                #[doc = #mass_doc]
                #inline
                fn #mass_name<R: __tfe::Real>(&self, #mass_parameters) {
                    #lengths
                    #mass
                }
            };
        };
        quote! {
            const LANES: bool = #lanes_here;

            #[doc = #first_doc]
            #[inline(always)]
            fn first_inline<R: __tfe::Real>(&self, #first_parameters) {
                #lengths
                #first
            }

            #[doc = #mass_doc]
            #[inline(always)]
            fn first_and_mass_inline<R: __tfe::Real>(&self, #mass_parameters) {
                #lengths
                #mass
            }

            fn first<R: __tfe::Real>(&self, #first_parameters) {
                __tfe::Model::first_inline(self, t, q, z, first);
            }

            fn first_and_mass<R: __tfe::Real>(&self, #mass_parameters) {
                __tfe::Model::first_and_mass_inline(self, t, q, z, first, zz);
            }
        }
    }

    /// Whether the kernels of first derivatives are compiled for several points side by side as well, as an expression;
    /// `None` if they never are.
    ///
    /// Linear models are stepped by a matrix, constrained ones by Newton's method: neither evaluates points side by side.
    pub(super) fn lanes(&self) -> Option<TokenStream> {
        let operations = page::total(&self.derivation.counts(Request::FIRST_AND_MASS));
        let has_lanes = self.declared.constraints.is_empty()
            && !self.derivation.structure().linear
            && operations <= LANES_LIMIT;
        let here = match operations <= UNOPTIMISED_LANES_LIMIT {
            true => quote!(true),
            false => quote!(::core::cfg!(not(debug_assertions))),
        };
        has_lanes.then_some(here)
    }

    /// The kernel that computes what is requested, with parameters beside (t, q, z), each with the argument that passes
    /// it on to the parts of a long kernel.
    fn kernel_for(
        &self,
        request: Request,
        formula: &str,
        (name, added, inline): (&'static str, &[(TokenStream, TokenStream)], bool),
    ) -> Kernel {
        let dof = &self.dof;
        let Controls {
            parameter,
            argument,
        } = Controls::of(self.declared);
        let (added, passed): (Vec<_>, Vec<_>) = added.iter().cloned().unzip();
        let signature = Signature {
            name,
            parameters: quote!(#parameter t: R, q: &[R; #dof], z: &[R; #dof] #(, #added)*),
            arguments: quote!(#argument t, q, z #(, #passed)*),
            inline,
        };
        let second = match request.second {
            true => quote!(second.),
            false => TokenStream::new(),
        };
        let body = self.body_in_parts(request, second, &signature);
        Kernel {
            doc: page::kernel(formula, &self.derivation.program(request)),
            parameters: signature.parameters,
            statements: body.statements,
            value: body.value,
            parts: body.parts,
        }
    }

    /// An `impl` with the parts of kernels, if there are any.
    fn inherent(&self, parts: TokenStream) -> TokenStream {
        if parts.is_empty() {
            return parts;
        }
        let name = &self.item.ident;
        let (impl_generics, type_generics, where_clause) = self.item.generics.split_for_impl();
        quote! {
            #[automatically_derived]
            #[allow(unused_variables, non_snake_case, clippy::too_many_arguments)]
            impl #impl_generics #name #type_generics #where_clause {
                #parts
            }
        }
    }
}
