//! The observables of a model of run-time length: their kernel, their names, and one method for each.

use super::sites::{self, Sites};
use crate::indices;
use proc_macro2::{Ident, TokenStream};
use quote::quote;
use tfe_symbolic::model::declared::Observable;

fn by_site(observables: &[Observable]) -> bool {
    observables.iter().any(|one| !one.ranges.is_empty())
}

/// The kernel of a name, of inputs and a body.
pub(super) fn kernel(
    observables: &[Observable],
    (name, inputs): (&Ident, &TokenStream),
    body: &TokenStream,
) -> TokenStream {
    let cut = by_site(observables).then(|| {
        quote! {
            let values = &mut values[..__tfe::FamilyModel::columns(self)];
        }
    });
    quote! {
        fn #name<R: __tfe::Real>(&self, #inputs t: R, q: &[R], z: &[R], values: &mut [R]) {
            #cut
            #body
        }
    }
}

/// How many observables there are, and what they are called.
pub(super) fn names(observables: &[Observable]) -> TokenStream {
    let names = observables.iter().map(|one| &one.name);
    let by_site = by_site(observables);
    let columns = by_site.then(|| {
        let sites: Vec<Sites> = observables
            .iter()
            .map(|one| (one.name.as_str(), one.ranges.as_slice()))
            .collect();
        let (count, name) = (sites::count(&sites), sites::name(&sites, &quote!(column)));
        quote! {
            fn columns(&self) -> usize {
                #count
            }

            fn column_name(&self, column: usize) -> __tfe::CoordinateName {
                #name
            }
        }
    });
    quote! {
        const OBSERVABLES: &'static [&'static str] = &[#(#names),*];

        #columns
    }
}

/// The method that evaluates an observable; one by site gives a list.
pub(super) fn method(
    one: &Observable,
    vis: &TokenStream,
    second: &TokenStream,
    second_doc: &str,
    path: &TokenStream,
) -> TokenStream {
    let name = &one.name;
    let method = indices::identifier(name);
    let private = quote!(#path::__private);
    // What cannot be written as an index is no place of a result either.
    let first = one.first_column().unwrap_or_default();
    let column = indices::index(&first);
    let sites = one.ranges.first();
    let doc = match sites {
        None => format!(
            " The observable `{name}` at time `t`, coordinates `q` and {second_doc} `{second}`."
        ),
        Some(range) => format!(
            " The observable `{name}` at time `t`, coordinates `q` and {second_doc} `{second}`: one number for each site in `{}..{}`.",
            range.start, range.end,
        ),
    };
    let result = match sites {
        None => quote!(f64),
        Some(_) => quote!(#private::List),
    };
    let value = match sites {
        None if first.as_constant().is_some() => {
            quote!(#private::family_observable(self, t, q, #second, #column))
        }
        None => quote! {
            let values = #private::family_observables(self, t, q, #second, || (#column, 1))?;
            ::core::result::Result::Ok(values.first().copied().unwrap_or(::core::primitive::f64::NAN))
        },
        Some(range) => {
            let length = sites::length(range);
            quote!(#private::family_observables(self, t, q, #second, || (#column, #length)))
        }
    };
    quote! {
        #[doc = #doc]
        ///
        /// # Errors
        /// Vectors of another length than the model's, and lengths of the model that do not fit together.
        #vis fn #method(
            &self,
            t: f64,
            q: &[f64],
            #second: &[f64],
        ) -> ::core::result::Result<#result, #private::FamilyError> {
            #value
        }
    }
}
