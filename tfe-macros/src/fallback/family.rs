//! Stubs of a model of run-time length whose declaration is wrong.

use proc_macro2::{Ident, TokenStream};
use quote::quote;
use syn::{DeriveInput, WhereClause};
use tfe_symbolic::expr::ordered::SortedSet;

/// The implementations that uses of the type need to type-check; `shared` is what models with inputs are asked for.
pub(super) fn stubs(
    (item, shared): (&DeriveInput, Option<&WhereClause>),
    path: &TokenStream,
    form: &TokenStream,
    outputs: &[Ident],
    by_site: &SortedSet<String>,
) -> TokenStream {
    let (name, vis) = (&item.ident, &item.vis);
    let (impl_generics, type_generics, where_clause) = item.generics.split_for_impl();
    let names = outputs.iter().map(crate::input::plain);
    let private = quote!(#path::__private);
    let results =
        outputs.iter().map(
            |output| match by_site.contains(&crate::input::plain(output)) {
                true => quote!(#private::List),
                false => quote!(f64),
            },
        );
    quote! {
        const _: () = {
            use #path::__private as __tfe;

            #[automatically_derived]
            impl #impl_generics __tfe::Declared<0> for #name #type_generics #where_clause {
                type Length = __tfe::RunTimeLength;
            }

            #[automatically_derived]
            #[allow(clippy::all)]
            impl #impl_generics __tfe::FamilyModel for #name #type_generics #where_clause {
                const FORM: __tfe::Form = __tfe::Form::#form;
                const FACTS: __tfe::Facts = __tfe::Facts::UNKNOWN;
                const MOMENTA_MOVE: bool = true;
                const OBSERVABLES: &'static [&'static str] = &[#(#names),*];

                fn len(&self) -> usize {
                    0
                }

                fn check(&self) -> ::core::result::Result<(), __tfe::FamilyError> {
                    ::core::result::Result::Ok(())
                }

                fn energy_function<__R: __tfe::Real>(&self, __tfe_t: __R, _: &[__R], _: &[__R]) -> __R {
                    __tfe_t
                }

                fn first<__R: __tfe::Real>(
                    &self,
                    _: __R,
                    _: &[__R],
                    _: &[__R],
                    _: __tfe::Gradient<'_, __R>,
                ) {
                }

                fn forces_inline<__R: __tfe::Real>(
                    &self,
                    _: __R,
                    _: &[__R],
                    _: &[__R],
                    _: __tfe::Gradient<'_, __R>,
                ) {
                }

                fn mass<__R: __tfe::Real, __E: __tfe::Entries<__R>>(
                    &self,
                    _: __R,
                    _: &[__R],
                    _: &[__R],
                    _: &mut __E,
                ) {
                }

                fn second<__R: __tfe::Real, __E: __tfe::Entries<__R>>(
                    &self,
                    _: __R,
                    _: &[__R],
                    _: &[__R],
                    _: __tfe::Gradient<'_, __R>,
                    _: &mut __E,
                ) {
                }

                fn coordinate_name(&self, _: usize) -> __tfe::CoordinateName {
                    __tfe::CoordinateName::single("")
                }
            }

            #[automatically_derived]
            #[allow(clippy::all)]
            impl #impl_generics __tfe::FamilyControlled for #name #type_generics #shared {
                const INPUTS: &'static [&'static str] = &[];

                fn energy_function_with<__R: __tfe::Real>(
                    &self,
                    _: &[__R; __tfe::MAX_INPUTS],
                    __tfe_t: __R,
                    _: &[__R],
                    _: &[__R],
                ) -> __R {
                    __tfe_t
                }

                fn first_with<__R: __tfe::Real>(
                    &self,
                    _: &[__R; __tfe::MAX_INPUTS],
                    _: __R,
                    _: &[__R],
                    _: &[__R],
                    _: __tfe::Gradient<'_, __R>,
                ) {
                }

                fn forces_inline_with<__R: __tfe::Real>(
                    &self,
                    _: &[__R; __tfe::MAX_INPUTS],
                    _: __R,
                    _: &[__R],
                    _: &[__R],
                    _: __tfe::Gradient<'_, __R>,
                ) {
                }

                fn mass_with<__R: __tfe::Real, __E: __tfe::Entries<__R>>(
                    &self,
                    _: &[__R; __tfe::MAX_INPUTS],
                    _: __R,
                    _: &[__R],
                    _: &[__R],
                    _: &mut __E,
                ) {
                }

                fn second_with<__R: __tfe::Real, __E: __tfe::Entries<__R>>(
                    &self,
                    _: &[__R; __tfe::MAX_INPUTS],
                    _: __R,
                    _: &[__R],
                    _: &[__R],
                    _: __tfe::Gradient<'_, __R>,
                    _: &mut __E,
                ) {
                }
            }
        };

        #[automatically_derived]
        #[allow(dead_code, missing_docs, clippy::all)]
        impl #impl_generics #name #type_generics #where_clause {
            #vis fn state(
                &self,
                __tfe_q: impl ::core::convert::AsRef<[::core::primitive::f64]>,
                __tfe_v: impl ::core::convert::AsRef<[::core::primitive::f64]>,
            ) -> #private::FamilyState {
                #private::family_state(self, 0.0, __tfe_q, __tfe_v)
            }

            #vis fn structure() -> #private::Structure {
                #private::Structure::UNKNOWN
            }

            #(#vis fn #outputs(
                &self,
                _: f64,
                _: &[f64],
                _: &[f64],
            ) -> ::core::result::Result<#results, #private::FamilyError> {
                ::core::result::Result::Ok(::core::default::Default::default())
            })*
        }
    }
}
