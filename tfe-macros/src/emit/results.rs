//! The places to which results of kernels are written.

use super::Emitter;
use crate::indices::index;
use proc_macro2::{Literal, TokenStream};
use quote::{format_ident, quote};
use tfe_symbolic::program::{Array, Place};

impl Emitter<'_> {
    /// Whether the results of an array are reported entry by entry.
    pub(super) fn is_entry(&self, array: Array) -> bool {
        self.by_entries && block(array).is_some()
    }

    pub(super) fn entry(&self, output: &Place, value: &TokenStream) -> TokenStream {
        let Some(block) = block(output.array) else {
            return TokenStream::new();
        };
        let block = format_ident!("{block}");
        let (row, column) = (index(&output.row), index(&output.column));
        quote!(entries.add(__tfe::Block::#block, #row, #column, #value);)
    }

    pub(super) fn place(&self, output: &Place) -> TokenStream {
        let second = &self.second;
        let vector = |array: &TokenStream| self.at(array, &[&output.row]);
        let matrix = |array: &TokenStream| self.at(array, &[&output.row, &output.column]);
        match output.array {
            Array::Value => quote!(value),
            Array::ByZ => vector(&quote!(first.z)),
            Array::ByQ => vector(&quote!(first.q)),
            Array::Force => vector(&quote!(first.force)),
            Array::ZZ => matrix(&quote!(#second zz)),
            Array::ZQ => matrix(&quote!(#second zq)),
            Array::QQ => matrix(&quote!(#second qq)),
            Array::ForceZ => matrix(&quote!(#second force_z)),
            Array::ForceQ => matrix(&quote!(#second force_q)),
            Array::Observable(k) => {
                let k = Literal::usize_unsuffixed(k);
                quote!(values[#k])
            }
            Array::Phi(k) => one(&quote!(values), k),
            Array::Drift(k) => one(&quote!(drift), k),
            Array::Row(_) | Array::PsiQ(_) | Array::RowRate(_) => vector(&row(output.array)),
            Array::Bend => matrix(&quote!(#second bend)),
            Array::RateQ => matrix(&quote!(#second rate_q)),
            Array::RateV => matrix(&quote!(#second rate_v)),
            Array::SitePhi | Array::SiteObservable => vector(&quote!(values)),
            Array::SiteDrift => vector(&quote!(drift)),
            // Told entry by entry.
            Array::SiteRow => TokenStream::new(),
        }
    }

    pub(super) fn clear(&self, cleared: Array) -> TokenStream {
        let second = &self.second;
        let vector = |array: TokenStream| quote!(#array.fill(t.like(0.0)););
        let matrix = |array: TokenStream| quote!(for row in &mut #array { row.fill(t.like(0.0)); });
        match cleared {
            _ if self.onto_zeros => TokenStream::new(),
            // Entries that are sums of reported contributions need not be cleared.
            _ if self.is_entry(cleared) => TokenStream::new(),
            Array::ByZ => vector(quote!(first.z)),
            Array::ByQ => vector(quote!(first.q)),
            Array::Force => vector(quote!(first.force)),
            // The mass matrix alone is passed by reference, the blocks of all second derivatives are fields.
            Array::ZZ if second.is_empty() => {
                quote!(for row in zz.iter_mut() {
                    row.fill(t.like(0.0));
                })
            }
            Array::ZZ => matrix(quote!(#second zz)),
            Array::ZQ => matrix(quote!(#second zq)),
            Array::QQ => matrix(quote!(#second qq)),
            Array::ForceZ => matrix(quote!(#second force_z)),
            Array::ForceQ => matrix(quote!(#second force_q)),
            Array::Row(_) | Array::PsiQ(_) | Array::RowRate(_) => vector(row(cleared)),
            Array::Bend => matrix(quote!(#second bend)),
            Array::RateQ => matrix(quote!(#second rate_q)),
            Array::RateV => matrix(quote!(#second rate_v)),
            Array::SitePhi | Array::SiteObservable => vector(quote!(values)),
            Array::SiteDrift => vector(quote!(drift)),
            Array::SiteRow => TokenStream::new(),
            Array::Value | Array::Observable(_) | Array::Phi(_) | Array::Drift(_) => {
                TokenStream::new()
            }
        }
    }
}

/// The block of a second derivative.
fn block(array: Array) -> Option<&'static str> {
    match array {
        Array::ZZ => Some("ZZ"),
        Array::ZQ => Some("ZQ"),
        Array::QQ => Some("QQ"),
        Array::ForceZ => Some("ForceZ"),
        Array::ForceQ => Some("ForceQ"),
        Array::SiteRow => Some("Row"),
        Array::Bend => Some("Bend"),
        _ => None,
    }
}

/// The row of a constraint.
fn row(array: Array) -> TokenStream {
    match array {
        Array::PsiQ(k) => one(&quote!(psi_q), k),
        Array::RowRate(k) => one(&quote!(row_rates), k),
        Array::Row(k) => one(&quote!(rows), k),
        _ => TokenStream::new(),
    }
}

/// The element of an array that this number names.
fn one(array: &TokenStream, number: usize) -> TokenStream {
    let number = Literal::usize_unsuffixed(number);
    quote!(#array[#number])
}
