//! Stubs of models made from one whose declaration is wrong.

use super::{Guess, implementations};
use crate::emit::identifier;
use proc_macro2::{Ident, Literal, TokenStream};
use quote::{format_ident, quote};
use syn::DeriveInput;
use tfe_symbolic::ast::Pass;

/// What can be told of `model(Name, …)`.
#[derive(Clone)]
pub(super) struct Variant {
    pub(super) name: Ident,
    /// How many coordinates it has less, as far as entries name them one by one.
    frozen: usize,
    /// How many fields it has more.
    added: usize,
}

impl Variant {
    pub(super) fn of(name: &str, passes: &[Pass]) -> Self {
        let entries = |word: &str| {
            let own = passes.iter().filter(|pass| pass.word.node == word);
            own.map(|pass| pass.entries.len()).sum()
        };
        Self {
            name: identifier(name),
            frozen: entries("frozen"),
            added: entries("elastic"),
        }
    }
}

/// A struct without fields that can be used like the model.
pub(super) fn stubs(variant: &Variant, item: &DeriveInput, guess: &Guess) -> TokenStream {
    let Variant { name, .. } = variant;
    let vis = &item.vis;
    let original = &item.ident;
    let stub = DeriveInput {
        ident: name.clone(),
        ..item.clone()
    };
    let guess = Guess {
        dof: left(&guess.dof, variant.frozen),
        ..guess.clone()
    };
    let implementations = implementations(&stub, &guess);
    let (impl_generics, type_generics, where_clause) = item.generics.split_for_impl();
    let generics = &item.generics;
    let added = (0..variant.added).map(|at| format_ident!("__{at}"));
    quote! {
        #[derive(Clone, Copy, Debug, PartialEq, Default)]
        #[allow(dead_code, missing_docs)]
        #vis struct #name #generics #where_clause {}

        #implementations

        #[automatically_derived]
        #[allow(dead_code, missing_docs, unused_variables, clippy::all)]
        impl #impl_generics #name #type_generics #where_clause {
            #vis fn of(_: &#original #type_generics #(, #added: f64)*) -> Self {
                Self {}
            }
        }
    }
}

/// The number of coordinates that are left, one at least.
fn left(dof: &TokenStream, frozen: usize) -> TokenStream {
    match dof.to_string().parse::<usize>() {
        Ok(all) => {
            let left = Literal::usize_unsuffixed(all.saturating_sub(frozen).max(1));
            quote!(#left)
        }
        Err(_) => dof.clone(),
    }
}
