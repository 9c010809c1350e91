//! Declarations by site: their total number, and the name of each.

use crate::indices;
use proc_macro2::TokenStream;
use quote::quote;
use tfe_symbolic::expr::graph::SumRange;

/// A name and the range of its sites; of a single one, no range.
pub(super) type Sites<'a> = (&'a str, &'a [SumRange]);

/// The total number, which saturates instead of overflowing.
pub(super) fn count(all: &[Sites]) -> TokenStream {
    let counts = all.iter().map(|(_, ranges)| match ranges.first() {
        None => quote!(1),
        Some(range) => length(range),
    });
    quote!(0usize #(.saturating_add(#counts))*)
}

/// The number of sites of a range.
pub(super) fn length(range: &SumRange) -> TokenStream {
    let length = range.end.plus_scaled(&range.start, -1);
    indices::index(&length.unwrap_or_default())
}

/// The name of one of all, in order of declaration and of sites.
pub(super) fn name(all: &[Sites], number: &TokenStream) -> TokenStream {
    let names = all.iter().map(|(name, ranges)| match ranges.first() {
        None => quote! {
            if #number == 0 {
                return __tfe::CoordinateName::single(#name);
            }
            let #number = #number - 1;
        },
        Some(range) => {
            let (start, length) = (indices::index(&range.start), length(range));
            quote! {
                let length = #length;
                if #number < length {
                    return __tfe::CoordinateName::element(#name, #start + #number);
                }
                let #number = #number - length;
            }
        }
    });
    quote! {
        #(#names)*
        __tfe::CoordinateName::element("", #number)
    }
}
