//! Stubs of models made from one whose declaration is wrong.

use super::{Guess, implementations};
use crate::emit::identifier;
use proc_macro2::{Ident, Literal, TokenStream};
use quote::{format_ident, quote};
use std::collections::BTreeSet;
use syn::DeriveInput;
use tfe_symbolic::ast::Pass;

/// What can be told of `model(Name, …)`.
#[derive(Clone)]
pub(super) struct Variant {
    pub(super) name: Ident,
    /// How many coordinates it has less, as far as entries name them one by one.
    gone: usize,
    /// Whether only cyclic coordinates have gone.
    is_projected: bool,
    /// How many fields it has more.
    added: usize,
}

impl Variant {
    pub(super) fn of(name: &str, passes: &[Pass]) -> Self {
        let entries = |word: &'static str| {
            let own = passes.iter().filter(move |pass| pass.word.node == word);
            own.flat_map(|pass| &pass.entries)
        };
        // One stiffness may stand for several springs.
        let added: BTreeSet<String> = entries("elastic")
            .map(|entry| entry.value.to_string())
            .collect();
        Self {
            name: identifier(name),
            gone: entries("frozen").count() + entries("routh").count(),
            is_projected: passes.iter().all(|pass| pass.word.node == "routh"),
            added: added.len() + entries("routh").count(),
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
    let all = guess.dof.clone();
    let guess = Guess {
        dof: left(&guess.dof, variant.gone),
        ..guess.clone()
    };
    let of_state = variant.is_projected.then(|| of_state(item, &all, &guess));
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

            #of_state
        }
    }
}

fn of_state(item: &DeriveInput, all: &TokenStream, guess: &Guess) -> TokenStream {
    let (original, vis) = (&item.ident, &item.vis);
    let (_, type_generics, _) = item.generics.split_for_impl();
    let Guess { path, dof, .. } = guess;
    quote! {
        #vis fn of_state(
            _: &#original #type_generics,
            _: &#path::__private::State<{ #all }>,
        ) -> (Self, #path::__private::State<{ #dof }>) {
            (Self {}, #path::__private::State { q: [0.0; #dof], p: [0.0; #dof] })
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
