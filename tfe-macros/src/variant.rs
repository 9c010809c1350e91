//! Models made from the declared one: `model(Name, truncated(2), frozen(r = l))`.

use crate::docs::Docs;
use crate::indices::identifier;
use crate::input::{self, plain};
use crate::parameters::is_copy;
use proc_macro2::{Literal, TokenStream};
use quote::{format_ident, quote};
use syn::parse::Parser;
use syn::punctuated::Punctuated;
use syn::{Attribute, Field, Fields, ItemStruct, Meta, Path, Token, parse_quote};
use tfe_symbolic::model::declared::{Projection, Variant};

/// The derives that are copied from the original to the model made from it.
const DERIVES: [&str; 5] = ["Clone", "Copy", "Debug", "PartialEq", "Default"];

/// The lint attributes that are copied from the original to the model made from it, and to its fields.
const LINTS: [&str; 4] = ["allow", "warn", "deny", "forbid"];

/// The struct, and its methods in addition to those of every model: `of`, which copies the parameters, and `of_state`.
pub(crate) fn expand(
    variant: &Variant,
    original: &ItemStruct,
    path: &TokenStream,
    docs: &Docs,
) -> (ItemStruct, TokenStream) {
    let title = format!(
        " `{}` from [`{}`]: {}.",
        variant.model.name, original.ident, variant.made
    );
    let fields = fields(variant, original);
    let mut item = renamed(&variant.model.name, &title, fields, original);
    let own = docs.attributes("model", &variant.model.name);
    let own = syn::Attribute::parse_outer.parse2(own).unwrap_or_default();
    item.attrs.splice(0..0, own);
    let of = of(variant, &item, original);
    let of_state = of_state(variant, &item, original, path);
    (item, quote!(#of #of_state))
}

/// A struct like the original with another name and other fields.
pub(crate) fn renamed(
    name: &str,
    title: &str,
    fields: Vec<Field>,
    original: &ItemStruct,
) -> ItemStruct {
    let mut attrs: Vec<Attribute> = vec![parse_quote!(#[doc = #title])];
    attrs.extend(derives(original));
    attrs.extend(original.attrs.iter().filter_map(lint));
    let fields: Punctuated<Field, Token![,]> = fields.into_iter().collect();
    let vis = input::visibility(original);
    ItemStruct {
        attrs,
        vis: parse_quote!(#vis),
        struct_token: <Token![struct]>::default(),
        ident: identifier(name),
        fields: Fields::Named(parse_quote!({ #fields })),
        semi_token: None,
        ..original.clone()
    }
}

/// The fields that the model still uses, then those added.
fn fields(variant: &Variant, original: &ItemStruct) -> Vec<Field> {
    let used = &variant.model.used_fields;
    let is_used = |field: &&Field| {
        let name = field.ident.as_ref().map(plain);
        name.is_some_and(|name| used.contains(&name))
    };
    let mut fields: Vec<Field> = original.fields.iter().filter(is_used).cloned().collect();
    for field in &mut fields {
        let attributes = std::mem::take(&mut field.attrs).into_iter();
        let inherited = attributes.filter_map(|one| match one.path().is_ident("doc") {
            true => Some(one),
            false => lint(&one),
        });
        field.attrs = inherited.collect();
    }
    let vis = input::visibility(original);
    for (name, doc) in &variant.added {
        let (name, doc) = (identifier(name), format!(" {doc}."));
        fields.push(parse_quote!(#[doc = #doc] #vis #name: f64));
    }
    fields
}

/// The attribute if it is one of a lint. An `expect` becomes an `allow`, because what is expected of the original may
/// be absent here.
fn lint(attribute: &Attribute) -> Option<Attribute> {
    let path = attribute.path();
    if let (true, Meta::List(list)) = (path.is_ident("expect"), &attribute.meta) {
        let lints = &list.tokens;
        return Some(parse_quote!(#[allow(#lints)]));
    }
    let is_lint = LINTS.iter().any(|name| path.is_ident(name));
    is_lint.then(|| attribute.clone())
}

/// `#[derive(…)]` with those of [`DERIVES`] that the original has; derives above `#[dynamics]` cannot be seen from
/// here.
fn derives(original: &ItemStruct) -> Option<Attribute> {
    let mut paths: Vec<Path> = Vec::new();
    for attribute in &original.attrs {
        let Meta::List(list) = &attribute.meta else {
            continue;
        };
        if !list.path.is_ident("derive") {
            continue;
        }
        let parse = Punctuated::<Path, Token![,]>::parse_terminated;
        // What is no list of paths, rustc reports on the original.
        let own = list.parse_args_with(parse).unwrap_or_default();
        paths.extend(own.into_iter().filter(is_inherited));
    }
    (!paths.is_empty()).then(|| parse_quote!(#[derive(#(#paths),*)]))
}

fn is_inherited(path: &Path) -> bool {
    let last = path.segments.last();
    last.is_some_and(|segment| DERIVES.iter().any(|name| segment.ident == name))
}

/// `Name::of(&original, k)`
fn of(variant: &Variant, item: &ItemStruct, original: &ItemStruct) -> TokenStream {
    let (name, from, vis) = (&item.ident, &original.ident, &item.vis);
    let (impl_generics, type_generics, where_clause) = item.generics.split_for_impl();
    let of_deprecated = input::of_deprecated(original);
    let is_added = |name: &str| variant.added.iter().any(|(own, _)| own == name);
    let added: Vec<_> = variant
        .added
        .iter()
        .map(|(name, _)| identifier(name))
        .collect();
    // A field added may have any name but one with this prefix.
    let argument = if is_added("original") || is_added("_original") {
        format_ident!("__tfe_original")
    } else {
        format_ident!("original")
    };
    let kept = input::context(original).fields;
    let kept = kept.iter().filter(|field| {
        let mut names = item.fields.iter().filter_map(|own| own.ident.as_ref());
        names.any(|name| plain(name) == field.name) && !is_added(&field.name)
    });
    let copied: Vec<_> = kept
        .map(|field| {
            let name = identifier(&field.name);
            match is_copy(&field.kind) {
                true => quote!(#name: #argument.#name),
                false => quote!(#name: ::core::clone::Clone::clone(&#argument.#name)),
            }
        })
        .collect();
    let argument = if copied.is_empty() {
        format_ident!("_{argument}")
    } else {
        argument
    };
    let doc = format!(" The model with the parameters of a [`{from}`].");
    quote! {
        #of_deprecated
        #[automatically_derived]
        #[allow(dead_code)]
        impl #impl_generics #name #type_generics #where_clause {
            #[doc = #doc]
            #vis fn of(#argument: &#from #type_generics #(, #added: f64)*) -> Self {
                Self {
                    #(#copied,)*
                    #(#added,)*
                }
            }
        }
    }
}

/// `Name::of_state(&original, &state)`: the conserved momenta are those of a state.
fn of_state(
    variant: &Variant,
    item: &ItemStruct,
    original: &ItemStruct,
    path: &TokenStream,
) -> Option<TokenStream> {
    let Projection {
        original: all,
        kept,
        held,
    } = variant.projection.as_ref()?;
    let (name, from, vis) = (&item.ident, &original.ident, &item.vis);
    let (impl_generics, type_generics, where_clause) = item.generics.split_for_impl();
    let left = Literal::usize_unsuffixed(kept.len());
    let all = Literal::usize_unsuffixed(*all);
    let [kept, held] = [kept, held].map(|numbers| {
        let numbers = numbers.iter().copied();
        numbers.map(Literal::usize_unsuffixed).collect::<Vec<_>>()
    });
    let doc = format!(
        " The model with the parameters of a [`{from}`] and the momenta of a state of it, and what is left of the state."
    );
    let of_deprecated = input::of_deprecated(original);
    Some(quote! {
        #of_deprecated
        #[automatically_derived]
        #[allow(dead_code)]
        impl #impl_generics #name #type_generics #where_clause {
            #[doc = #doc]
            #vis fn of_state(
                original: &#from #type_generics,
                state: &#path::__private::State<#all>,
            ) -> (Self, #path::__private::State<#left>) {
                let model = Self::of(original #(, state.p[#held])*);
                let left = #path::__private::State {
                    q: [#(state.q[#kept]),*],
                    p: [#(state.p[#kept]),*],
                };
                (model, left)
            }
        }
    })
}
