//! Stubs of models made from one whose declaration is wrong.

use crate::indices::identifier;
use crate::input::plain;
use proc_macro2::{Ident, Literal, TokenStream};
use quote::{format_ident, quote};
use syn::{Data, DeriveInput, Field, Type};
use tfe_symbolic::expr::ordered::SortedSet;
use tfe_symbolic::syntax::ast::{Entry, Pass};

/// What can be guessed about `model(Name, …)`.
#[derive(Clone)]
pub(super) struct Variant {
    pub(super) name: Ident,
    /// The number of coordinates that it loses, as far as entries name them one by one.
    gone: usize,
    /// Whether only cyclic coordinates are removed.
    is_projected: bool,
    /// The fields that it has in addition.
    added: SortedSet<String>,
}

impl Variant {
    pub(super) fn of(name: &str, passes: &[Pass]) -> Self {
        let entries = |word: &'static str| {
            let own = passes.iter().filter(move |pass| pass.word.node == word);
            own.flat_map(|pass| &pass.entries)
        };
        let name_of = |entry: &Entry| entry.value.to_string().replace('[', "_").replace(']', "");
        let momenta = entries("routh").map(|entry| format!("p_{}", name_of(entry)));
        // One stiffness may stand for several springs.
        let added = entries("elastic").map(name_of).chain(momenta).collect();
        Self {
            name: identifier(name),
            gone: entries("frozen").count() + entries("routh").count(),
            is_projected: passes.iter().all(|pass| pass.word.node == "routh"),
            added,
        }
    }

    /// The number of remaining coordinates of the original, at least one.
    pub(super) fn left(&self, dof: &TokenStream) -> TokenStream {
        match dof.to_string().parse::<usize>() {
            Ok(all) => {
                let left = Literal::usize_unsuffixed(all.saturating_sub(self.gone).max(1));
                quote!(#left)
            }
            Err(_) => dof.clone(),
        }
    }
}

/// The number fields that it may have: those of the original, and those added.
fn fields(variant: &Variant, item: &DeriveInput) -> SortedSet<Ident> {
    let own = match &item.data {
        Data::Struct(data) => data.fields.iter().collect(),
        _ => Vec::new(),
    };
    let is_number =
        |field: &&Field| matches!(&field.ty, Type::Path(path) if path.path.is_ident("f64"));
    let own = own.into_iter().filter(is_number);
    let own = own.filter_map(|field| field.ident.as_ref().map(plain));
    let all: SortedSet<String> = own.chain(variant.added.iter().cloned()).collect();
    all.iter().map(|name| identifier(name)).collect()
}

/// A struct with the fields that are numbers, which can be used like the model with these implementations; of `all` coordinates of the
/// original it has `left`.
pub(super) fn stubs(
    variant: &Variant,
    item: &DeriveInput,
    implementations: &TokenStream,
    path: &TokenStream,
    (all, left): (&TokenStream, &TokenStream),
) -> TokenStream {
    let Variant { name, .. } = variant;
    let vis = &item.vis;
    let original = &item.ident;
    let of_state = variant
        .is_projected
        .then(|| of_state(item, path, (all, left)));
    let (impl_generics, type_generics, where_clause) = item.generics.split_for_impl();
    let generics = &item.generics;
    let fields = fields(variant, item);
    let fields = fields.iter();
    let added = (0..variant.added.len()).map(|at| format_ident!("__{at}"));
    quote! {
        #[derive(
            ::core::clone::Clone,
            ::core::marker::Copy,
            ::core::fmt::Debug,
            ::core::cmp::PartialEq,
            ::core::default::Default,
        )]
        #[allow(dead_code, missing_docs)]
        #vis struct #name #generics #where_clause { #(pub #fields: f64),* }

        #implementations

        #[automatically_derived]
        #[allow(dead_code, missing_docs, unused_variables, clippy::all)]
        impl #impl_generics #name #type_generics #where_clause {
            #vis fn of(_: &#original #type_generics #(, #added: f64)*) -> Self {
                ::core::default::Default::default()
            }

            #of_state
        }
    }
}

fn of_state(
    item: &DeriveInput,
    path: &TokenStream,
    (all, left): (&TokenStream, &TokenStream),
) -> TokenStream {
    let (original, vis) = (&item.ident, &item.vis);
    let (_, type_generics, _) = item.generics.split_for_impl();
    quote! {
        #vis fn of_state(
            _: &#original #type_generics,
            _: &#path::__private::State<{ #all }>,
        ) -> (Self, #path::__private::State<{ #left }>) {
            (::core::default::Default::default(), #path::__private::State { q: [0.0; #left], p: [0.0; #left] })
        }
    }
}
