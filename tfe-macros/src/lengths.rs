//! Requirements on const parameters: a constant that is evaluated when kernels are compiled for their values.

use crate::indices;
use proc_macro2::TokenStream;
use quote::quote;
use syn::ItemStruct;
use tfe_symbolic::model::declared::{Declared, Extent, Requirement};

/// The constant, and the statement by which a kernel evaluates it; empty if the engine could decide everything.
pub(crate) struct Lengths {
    /// An inherent `impl` with the constant.
    pub(crate) constant: TokenStream,
    /// Evaluates it.
    pub(crate) statement: TokenStream,
}

impl Lengths {
    pub(crate) fn of(declared: &Declared, item: &ItemStruct) -> Self {
        let requirements = declared.requirements.iter();
        let requirements = requirements.filter(|one| one.is_of_const_parameters());
        let checks: Vec<TokenStream> = requirements.filter_map(check).collect();
        if checks.is_empty() {
            return Self {
                constant: TokenStream::new(),
                statement: TokenStream::new(),
            };
        }
        let name = &item.ident;
        let (impl_generics, type_generics, where_clause) = item.generics.split_for_impl();
        Self {
            constant: quote! {
                #[automatically_derived]
                // Bounds stand as they follow from the declaration: `i + 1 <= n` beside others like it.
                #[allow(clippy::int_plus_one)]
                impl #impl_generics #name #type_generics #where_clause {
                    const __TFE_LENGTHS: () = {
                        #(#checks)*
                    };
                }
            },
            statement: quote!(let () = Self::__TFE_LENGTHS;),
        }
    }
}

/// The assertion that an index stays inside its array on all turns of its loops.
fn check(requirement: &Requirement) -> Option<TokenStream> {
    let Requirement::Index {
        array,
        text,
        ranges,
        nest,
        place,
        length: Extent::Known(length),
    } = requirement
    else {
        return None;
    };
    let turns = match ranges.as_str() {
        "" => String::new(),
        ranges => format!(" for `{ranges}`"),
    };
    let message = format!("index `{text}`{turns} is outside `{array}` of length {length}");
    let (value, length) = (indices::signed(place), indices::signed(length));
    let is_positive = place.as_constant().is_some_and(|place| place >= 0);
    let from_zero = (!is_positive).then(|| quote!(::core::assert!(0 <= #value, #message);));
    let assertion = quote! {
        #from_zero
        ::core::assert!(#value < #length, #message);
    };
    let nested = nest.iter().rev().fold(assertion, |inner, range| {
        let variable = indices::loop_name(range.variable);
        let (start, end) = (indices::index(&range.start), indices::index(&range.end));
        quote! {
            let mut #variable: usize = #start;
            while #variable < #end {
                #inner
                #variable += 1;
            }
        }
    });
    Some(quote!({ #nested }))
}
