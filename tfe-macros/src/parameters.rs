//! The numbering of the parameters of a model: fields that are numbers, and the elements of fields that are arrays of
//! numbers. Those of models of run-time length are numbered at run time.

use crate::indices::{identifier, index};
use crate::input;
use proc_macro2::{Literal, TokenStream};
use quote::quote;
use syn::ItemStruct;
use tfe_symbolic::expr::input::{Affine, IndexSymbol};
use tfe_symbolic::expr::ordered::SortedMap;
use tfe_symbolic::syntax::context::{Field, FieldKind, Length};

/// Whether fields of this kind are `Copy`.
pub(crate) fn is_copy(kind: &FieldKind) -> bool {
    matches!(
        kind,
        FieldKind::Scalar | FieldKind::Array(_) | FieldKind::Length
    )
}

/// `name: from.name` for each field, or a clone of it where it is not `Copy`; nothing if a field has a type that may
/// not be `Clone`.
fn copies(item: &ItemStruct, from: &TokenStream) -> Option<TokenStream> {
    let fields = input::context(item).fields;
    let copied = fields.iter().map(|field| {
        let name = identifier(&field.name);
        match &field.kind {
            FieldKind::Other(_) => None,
            kind if is_copy(kind) => Some(quote!(#name: #from.#name)),
            _ => Some(quote!(#name: ::core::clone::Clone::clone(&#from.#name))),
        }
    });
    let copied = copied.collect::<Option<Vec<_>>>()?;
    Some(quote!(#(#copied),*))
}

/// The indices of parameters: for each field that of the field itself or of its first element.
#[derive(Clone, Debug, Default)]
pub(crate) struct Parameters {
    fields: Vec<Place>,
    /// Whether every field is `Copy`.
    all_copies: bool,
}

#[derive(Clone, Debug)]
struct Place {
    name: String,
    is_array: bool,
    first: Affine,
    /// One past the last parameter.
    end: Affine,
}

impl Parameters {
    pub(crate) fn of(item: &ItemStruct) -> Self {
        let context = input::context(item);
        let mut first = Affine::constant(0);
        let mut fields = Vec::new();
        for Field { name, kind } in &context.fields {
            let length = match kind {
                FieldKind::Scalar => Some(Affine::constant(1)),
                FieldKind::Array(Length::Literal(length)) => {
                    i64::try_from(*length).ok().map(Affine::constant)
                }
                FieldKind::Array(Length::ConstParameter(name)) => {
                    Some(Affine::symbol(IndexSymbol::ConstParameter(name.clone())))
                }
                _ => None,
            };
            let end = length.and_then(|length| first.plus_scaled(&length, 1));
            if let Some(end) = end {
                fields.push(Place {
                    name: name.clone(),
                    is_array: *kind != FieldKind::Scalar,
                    first: std::mem::replace(&mut first, end.clone()),
                    end,
                });
            }
        }
        Self {
            fields,
            all_copies: context.fields.iter().all(|field| is_copy(&field.kind)),
        }
    }

    /// The indices of the first elements by the names of their fields.
    pub(crate) fn places(&self) -> SortedMap<String, Affine> {
        let place = |one: &Place| (one.name.clone(), one.first.clone());
        self.fields.iter().map(place).collect()
    }

    /// `parameters`, `parameter_name`, `parameter`, `with_parameter` and `unnumbered` of an implementation of `Model`.
    pub(crate) fn members(&self, item: &ItemStruct) -> TokenStream {
        let unnumbered = unnumbered(item, false);
        let Some(last) = self.fields.last() else {
            return unnumbered;
        };
        let count = index(&last.end);
        let arms = |of: &dyn Fn(&Place) -> TokenStream| -> TokenStream {
            self.fields
                .iter()
                .map(|one| {
                    let (end, value) = (index(&one.end), of(one));
                    quote!(if index < #end { return #value; })
                })
                .collect()
        };
        let element = |one: &Place| {
            let first = index(&one.first);
            match one.first.as_constant() {
                Some(0) => quote!(index),
                Some(_) => quote!(index - #first),
                None => quote!(index - (#first)),
            }
        };
        let names = arms(&|one| {
            let name = &one.name;
            if !one.is_array {
                return quote!(__tfe::CoordinateName::single(#name));
            }
            let element = element(one);
            quote!(__tfe::CoordinateName::element(#name, #element))
        });
        let place = |one: &Place| {
            let field = identifier(&one.name);
            if !one.is_array {
                return quote!(#field);
            }
            let element = element(one);
            quote!(#field[#element])
        };
        let values = arms(&|one| {
            let place = place(one);
            quote!(self.#place)
        });
        let with_parameter = copies(item, &quote!(self)).map(|copies| {
            let made = match self.all_copies {
                true => quote!(Self { ..*self }),
                false => quote!(Self { #copies }),
            };
            let set: TokenStream = self
                .fields
                .iter()
                .map(|one| {
                    let (end, place) = (index(&one.end), place(one));
                    quote!(if index < #end { made.#place = value; } else)
                })
                .collect();
            quote! {
                fn with_parameter(&self, index: usize, value: f64) -> ::core::option::Option<Self> {
                    let mut made = #made;
                    #set { return ::core::option::Option::None; }
                    ::core::option::Option::Some(made)
                }
            }
        });
        let numbered = numbered(&count, &names, &values);
        quote! {
            #numbered
            #with_parameter
            #unnumbered
        }
    }
}

/// `unnumbered`: what kernels read besides the numbered parameters, including the elements of vectors in models of
/// run-time length; nothing if there is nothing.
fn unnumbered(item: &ItemStruct, of_run_time: bool) -> TokenStream {
    let read = |Field { name, kind }: &Field| {
        let name = identifier(name);
        let count = quote!(values(self.#name.len() as u64););
        match kind {
            FieldKind::Length => Some(quote!(values(self.#name as u64);)),
            FieldKind::Vector if of_run_time => Some(count),
            FieldKind::Vector => {
                Some(quote!(#count for row in &self.#name { values(row.to_bits()); }))
            }
            FieldKind::Indices if of_run_time => {
                Some(quote!(#count for row in &self.#name { values(*row as u64); }))
            }
            _ => None,
        }
    };
    let context = input::context(item);
    let all: Vec<TokenStream> = context.fields.iter().filter_map(read).collect();
    if all.is_empty() {
        return TokenStream::new();
    }
    quote! {
        fn unnumbered<__F: ::core::ops::FnMut(u64)>(&self, values: &mut __F) {
            #(#all)*
        }
    }
}

/// `parameters`, `parameter_name` and `parameter`, by statements that return names and values of those that there are.
fn numbered(count: &TokenStream, names: &TokenStream, values: &TokenStream) -> TokenStream {
    quote! {
        fn parameters(&self) -> usize {
            #count
        }

        fn parameter_name(&self, index: usize) -> __tfe::CoordinateName {
            #names
            __tfe::CoordinateName::element("", index)
        }

        fn parameter(&self, index: usize) -> f64 {
            #values
            ::core::primitive::f64::NAN
        }
    }
}

/// The parameters of a model of run-time length, in the order of the struct.
pub(crate) struct RunTimeParameters {
    /// Names, and how many there are; of single numbers nothing.
    fields: Vec<(String, Option<TokenStream>)>,
    /// Copies of all fields of the struct, unless one is of a type that may not be `Clone`.
    copies: Option<TokenStream>,
    /// The member of that name.
    unnumbered: TokenStream,
}

impl RunTimeParameters {
    pub(crate) fn of(item: &ItemStruct) -> Self {
        let size = |field: Field| {
            let name = identifier(&field.name);
            let size = match field.kind {
                FieldKind::Scalar => None,
                FieldKind::Vector => Some(quote!(self.#name.len())),
                FieldKind::Array(Length::Literal(length)) => {
                    let length = Literal::usize_unsuffixed(length);
                    Some(quote!(#length))
                }
                FieldKind::Array(Length::ConstParameter(length)) => {
                    let length = identifier(&length);
                    Some(quote!(#length))
                }
                _ => return None,
            };
            Some((field.name, size))
        };
        let context = input::context(item);
        Self {
            fields: context.fields.into_iter().filter_map(size).collect(),
            copies: copies(item, &quote!(self)),
            unnumbered: unnumbered(item, true),
        }
    }

    /// The number of the first parameter of each field.
    pub(crate) fn places(&self) -> SortedMap<String, TokenStream> {
        let (mut singles, mut sizes) = (0_usize, Vec::new());
        let mut places = SortedMap::new();
        for (name, size) in &self.fields {
            let count = Literal::usize_unsuffixed(singles);
            let place = match (&sizes[..], singles) {
                ([], _) => quote!(#count),
                (sizes, 0) => quote!(#(#sizes)+*),
                (sizes, _) => quote!(#(#sizes)+* + #count),
            };
            places.insert(name.clone(), place);
            match size {
                None => singles += 1,
                Some(size) => sizes.push(size.clone()),
            }
        }
        places
    }

    /// `parameters`, `parameter_name`, `parameter`, `with_parameter` and `unnumbered` of an implementation of `FamilyModel`.
    pub(crate) fn members(&self) -> TokenStream {
        let unnumbered = &self.unnumbered;
        if self.fields.is_empty() {
            return unnumbered.clone();
        }
        let one = quote!(1);
        let sizes = (self.fields.iter()).map(|(_, size)| size.as_ref().unwrap_or(&one));
        let count = quote!(#(#sizes)+*);
        let names = arms_of(&self.fields, |name, is_single| match is_single {
            true => quote!({ return __tfe::CoordinateName::single(#name); }),
            false => quote!({ return __tfe::CoordinateName::element(#name, index); }),
        });
        let values = arms_of(&self.fields, |name, is_single| {
            let name = identifier(name);
            match is_single {
                true => quote!({ return self.#name; }),
                false => quote!({ return self.#name[index]; }),
            }
        });
        let numbered = numbered(&count, &names, &values);
        let with_parameter = self.copies.as_ref().map(|copies| {
            let return_made = quote!(return ::core::option::Option::Some(made););
            let set = arms_of(&self.fields, |name, is_single| {
                let name = identifier(name);
                match is_single {
                    true => quote!({ made.#name = value; #return_made }),
                    false => quote!({ made.#name[index] = value; #return_made }),
                }
            });
            quote! {
                fn with_parameter(&self, index: usize, value: f64) -> ::core::option::Option<Self> {
                    let mut made = Self { #copies };
                    #set
                    ::core::option::Option::None
                }
            }
        });
        quote! {
            #numbered
            #with_parameter
            #unnumbered
        }
    }
}

/// An arm for each field, for what is done with the parameter of an index, with the name of the field and whether it is
/// a single number.
fn arms_of(
    fields: &[(String, Option<TokenStream>)],
    arm: impl Fn(&str, bool) -> TokenStream,
) -> TokenStream {
    let arm = |(name, size): &(String, Option<TokenStream>)| {
        let done = arm(name, size.is_none());
        match size {
            None => quote! {
                if index == 0 #done
                let index = index - 1;
            },
            Some(size) => quote! {
                if index < #size #done
                let index = index - #size;
            },
        }
    };
    fields.iter().map(arm).collect()
}
