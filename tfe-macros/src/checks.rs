//! The `check` of a model: what it asks of fields that are lengths, indices or vectors.

use crate::indices;
use proc_macro2::TokenStream;
use quote::quote;
use tfe_symbolic::expr::input::{Affine, IndexSymbol};
use tfe_symbolic::expr::ordered::SortedMap;
use tfe_symbolic::model::declared::{Declared, Extent, Requirement};

/// The statements of `check`, which return an error; none where there is nothing to check at run time.
pub(crate) fn statements(declared: &Declared) -> TokenStream {
    // First, so that later checks do not overflow.
    let longest = length_fields(declared).into_iter().map(|name| {
        let field = indices::identifier(name);
        quote!(__tfe::checks::length(#name, self.#field)?;)
    });
    let elements = declared.coordinates.iter().filter_map(|array| {
        let length = array
            .length
            .as_ref()
            .filter(|length| length.is_of_run_time())?;
        let name = format!("{}[{length}]", array.name);
        let length = indices::index(length);
        Some(quote!(__tfe::checks::elements(#name, #length)?;))
    });
    let mut lengths: SortedMap<&str, Vec<TokenStream>> = SortedMap::new();
    // Before the lengths of vectors, which would be below zero for ranges that end below their start.
    let mut turns = Vec::new();
    let mut rest = Vec::new();
    for requirement in of_run_time(declared) {
        match requirement {
            Requirement::FieldLength {
                field,
                text,
                ranges,
                length,
            } => {
                let length = indices::signed(length);
                let one = quote!((#length, #text, #ranges));
                lengths.get_or_default(field).push(one);
            }
            Requirement::Turns {
                empty: Some(places),
                start,
                end,
                ..
            } if places.is_empty() && is_never_below(end, start) => {}
            Requirement::Turns {
                ranges,
                start,
                end,
                empty,
            } => {
                let (start, end) = (indices::signed(start), indices::signed(end));
                turns.push(match empty {
                    None => quote!(__tfe::checks::turns(#ranges, #start, #end)?;),
                    Some(places) => {
                        let coordinates = indices::signed(&declared.dof);
                        let places = places.iter().map(indices::signed);
                        // In parentheses: clippy takes a difference in a list for a forgotten comma.
                        let places = quote!((#coordinates, &[#((#places)),*]));
                        quote!(__tfe::checks::terms(#ranges, #start, #end, #places)?;)
                    }
                });
            }
            Requirement::Index {
                array,
                text,
                ranges,
                nest,
                place,
                length,
            } => {
                let entries: Vec<(&str, &Affine)> = place.entries().collect();
                let value = indices::signed(place);
                let length = match length {
                    Extent::Known(length) => indices::index(length),
                    Extent::OfField(field) => {
                        let field = indices::identifier(field);
                        quote!(self.#field.len())
                    }
                };
                let index = quote!((#array, #text, #ranges));
                let one = match entries[..] {
                    // For a single entry the message names the list and the place.
                    [(list, at)] => {
                        let (field, at) = (indices::identifier(list), indices::index(at));
                        let entry = quote!((#list, &self.#field, #at));
                        quote!(__tfe::checks::entry(#index, #entry, #value, #length)?;)
                    }
                    _ => quote!(__tfe::checks::index(#index, #value, #length)?;),
                };
                let nested = nest.iter().rev().fold(one, |inner, range| {
                    let variable = indices::loop_name(range.variable);
                    let (start, end) = (indices::index(&range.start), indices::index(&range.end));
                    quote!(for #variable in #start..#end { #inner })
                });
                rest.push(nested);
            }
        }
    }
    let lengths = lengths.iter().map(|(name, uses)| {
        let field = indices::identifier(name);
        quote!(__tfe::checks::field_length(#name, self.#field.len(), &[#(#uses),*])?;)
    });
    quote!(#(#longest)* #(#elements)* #(#turns)* #(#lengths)* #(#rest)*)
}

/// `check` of an implementation of `Model`; nothing where any fields will do.
pub(crate) fn member(declared: &Declared) -> TokenStream {
    let statements = statements(declared);
    if statements.is_empty() {
        return statements;
    }
    quote! {
        fn check(&self) -> ::core::result::Result<(), __tfe::ModelError> {
            #statements
            ::core::result::Result::Ok(())
        }
    }
}

/// In a method of a model of fixed size: `otherwise` if the model does not pass its check, and a remark about that for its
/// documentation. Nothing where any fields will do.
pub(crate) fn guard(
    declared: &Declared,
    path: &TokenStream,
    otherwise: &TokenStream,
) -> (TokenStream, &'static str) {
    if of_run_time(declared).next().is_none() {
        return (TokenStream::new(), "");
    }
    let dof = indices::index(&declared.dof);
    let guard = quote! {
        if <Self as #path::__private::Model<#dof>>::check(self).is_err() {
            #otherwise
        }
    };
    (guard, "; NaN if the model does not pass its `check`")
}

/// Whether a range does not end below its start, whatever the lengths.
fn is_never_below(end: &Affine, start: &Affine) -> bool {
    let length = end.plus_scaled(start, -1);
    length.is_some_and(|length| {
        length.constant >= 0 && length.terms.iter().all(|(_, factor)| *factor >= 0)
    })
}

/// The requirements that are checked at run time: all those of a model of run-time length, and those on fields of others.
fn of_run_time(declared: &Declared) -> impl Iterator<Item = &Requirement> {
    let is_of_run_time = declared.is_of_run_time_length();
    let all = declared.requirements.iter();
    all.filter(move |one| is_of_run_time || !one.is_of_const_parameters())
}

/// The fields that appear in lengths, ranges and indices, each once.
fn length_fields(declared: &Declared) -> Vec<&str> {
    let mut affines: Vec<&Affine> = Vec::new();
    let coordinates = declared.coordinates.iter();
    affines.extend(coordinates.filter_map(|array| array.length.as_ref()));
    for requirement in of_run_time(declared) {
        match requirement {
            Requirement::FieldLength { length, .. } => affines.push(length),
            Requirement::Turns {
                start, end, empty, ..
            } => {
                affines.extend([start, end]);
                affines.extend(empty.iter().flatten());
            }
            Requirement::Index {
                nest,
                place,
                length,
                ..
            } => {
                affines.extend(nest.iter().flat_map(|range| [&range.start, &range.end]));
                affines.push(place);
                if let Extent::Known(length) = length {
                    affines.push(length);
                }
            }
        }
    }
    let mut fields: Vec<&str> = Vec::new();
    while let Some(affine) = affines.pop() {
        for (symbol, _) in &affine.terms {
            match symbol {
                IndexSymbol::Field(name) if !fields.contains(&name.as_str()) => {
                    fields.push(name);
                }
                IndexSymbol::Entry(_, place) => affines.push(place),
                _ => {}
            }
        }
    }
    fields.sort_unstable();
    fields
}
