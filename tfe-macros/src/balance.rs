//! The diagonals of blocks of second derivatives, as negative sums of the entries off the diagonal, in Rust statements.

use crate::indices::index;
use proc_macro2::TokenStream;
use quote::quote;
use tfe_symbolic::expr::input::Affine;
use tfe_symbolic::program::{Array, Place};

/// The sums of all columns at once if their number is known, otherwise one by one.
///
/// Methods of iterators are not used: their traits are in scope only with the prelude of Rust.
pub(crate) fn balance(second: &TokenStream, output: &Place, length: &Affine) -> TokenStream {
    let entry = |output: &Place, row: &TokenStream, column: &TokenStream| {
        let array = match output.array {
            Array::ZZ => quote!(#second zz),
            Array::QQ => quote!(#second qq),
            _ => return TokenStream::new(),
        };
        let from = |first: &Affine, steps: &TokenStream| match first.as_constant() {
            Some(0) => steps.clone(),
            _ => {
                let first = index(first);
                quote!(#first + #steps)
            }
        };
        let (row, column) = (from(&output.row, row), from(&output.column, column));
        quote!(#array[#row][#column])
    };
    let (k, l) = (quote!(column), quote!(row));
    let (off, on) = (entry(output, &l, &k), entry(output, &k, &k));
    let transposed = output.transposed();
    let other = (transposed != *output).then(|| {
        let other = entry(&transposed, &k, &k);
        quote!(#other = sum;)
    });
    match length
        .as_constant()
        .and_then(|length| usize::try_from(length).ok())
    {
        // In braces: parameters may be called like the sums.
        Some(length) => quote! {
            {
                let mut sums = [t.like(0.0); #length];
                for row in 0..#length {
                    for column in 0..#length {
                        if row != column {
                            sums[column] -= #off;
                        }
                    }
                }
                for column in 0..#length {
                    let sum = sums[column];
                    #on = sum;
                    #other
                }
            }
        },
        None => {
            let length = index(length);
            quote! {
                for column in 0..#length {
                    let mut sum = t.like(0.0);
                    for row in 0..#length {
                        if row != column {
                            sum -= #off;
                        }
                    }
                    #on = sum;
                    #other
                }
            }
        }
    }
}
