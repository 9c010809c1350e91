//! Steppers for one model and one element: `solver(Name, Mixed::<4>)`.

use crate::docs::Docs;
use crate::indices::{identifier, index};
use crate::parameters::is_copy;
use crate::source_map::SourceMap;
use crate::{fallback, input};
use proc_macro2::{Literal, Span, TokenStream};
use quote::{format_ident, quote, quote_spanned};
use syn::ItemStruct;
use tfe_symbolic::diagnostic::Bag;
use tfe_symbolic::model::declared::{Declared, Form, Solver};
use tfe_symbolic::syntax::ast::Item;
use tfe_symbolic::syntax::context::FieldKind;
use tfe_symbolic::syntax::parse;
use tfe_symbolic::vocabulary::element::Rule;

/// A message for each solver of a struct with const parameters: the memory of a solver has one size, and its code one
/// type.
pub(crate) fn of_many_types(item: &ItemStruct, map: &SourceMap) -> TokenStream {
    let Some(parameter) = item.generics.const_params().next() else {
        return TokenStream::new();
    };
    let [model, parameter] = [&item.ident, &parameter.ident].map(input::plain);
    let message = format!(
        "a solver needs a model without const parameters, but `{model}` has `{parameter}`\nhelp: write a number in place of `{parameter}`, or use `Simulation`"
    );
    let arguments = parse::split_arguments(&map.text).into_iter();
    let elements = arguments.filter_map(|range| {
        let mut bag = Bag::new();
        let argument = parse::parse_item(&map.text[range.clone()], range.start, &mut bag);
        // The engine tells the mistakes; this bag is emptied, not read.
        let _ = bag.finish(());
        match argument?.node {
            Item::Solver { element, .. } => Some(element.span),
            _ => None,
        }
    });
    elements
        .map(|span| fallback::error(map.spans(span.start..span.end), &message))
        .collect()
}

/// The struct `solver.name` with everything that it needs as constants: element, tables, sizes.
pub(crate) fn expand(
    solver: &Solver,
    declared: &Declared,
    (item, docs): (&ItemStruct, &Docs),
    path: &TokenStream,
) -> TokenStream {
    let path = quote!(#path::__private);
    let (model, vis) = (&input::generated(&item.ident), &input::visibility(item));
    let of_deprecated = input::of_deprecated(item);
    let name = identifier(&solver.name);
    let dof = index(&declared.dof);
    let constraints = Literal::usize_unsuffixed(declared.constraints.len());
    let element = element(solver, &path);
    let form = match declared.form {
        Form::Lagrangian => quote!(Lagrangian),
        Form::Hamiltonian => quote!(Hamiltonian),
    };
    let (kept, fields) = fields(item);
    let title = format!(
        " Steps [`{model}`] with one element, `{}`: no generics, no allocation, tables and sizes constant.",
        solver.element
    );
    let text = name.to_string();
    let own = docs.attributes("solver", &solver.name);
    let sizes = (0..7_usize).map(|size| quote!({ #name::SIZES[#size] }));
    let inline = quote!(#path::Inline<#(#sizes),*>);
    quote! {
        #own
        #[doc = #title]
        #of_deprecated
        #vis struct #name {
            model: #model,
            engine: #path::Specialised<
                #dof,
                #inline,
                { #path::numbers_len(#name::ELEMENT, #path::Form::#form, #dof, #constraints) },
                { #path::pivots_len(#name::ELEMENT, #path::Form::#form, #dof, #constraints) },
            >,
        }

        #of_deprecated
        #[automatically_derived]
        #[allow(dead_code)]
        impl #name {
            const ELEMENT: #path::Element = #element;
            const SIZES: [usize; 7] = #path::sizes::<#model, #dof>(#name::ELEMENT);
            const SCHEME: #path::Scheme<{ #name::ELEMENT.points() }, { #name::ELEMENT.unknowns() }> =
                #path::Scheme::new(#name::ELEMENT);
            const TABLES: #path::Fixed<#inline> = #path::Fixed::new(&Self::SCHEME);
            /// The size of the stepper, all its memory included.
            #vis const BYTES: usize = ::core::mem::size_of::<Self>();

            /// A stepper of length `h` that begins at time zero. It keeps a copy of the parameters.
            #vis fn new(model: &#model, h: f64) -> Self {
                #kept
                Self {
                    model: #model { #fields },
                    engine: #path::Specialised::new(model, &Self::TABLES, h),
                }
            }

            /// The time of the next step's start.
            #vis fn time(&self) -> f64 {
                self.engine.time()
            }

            /// Makes the next step start at `time`.
            #vis fn set_time(&mut self, time: f64) {
                self.engine.set_time(time);
            }

            /// What the steps so far have cost.
            #vis fn statistics(&self) -> &#path::Statistics {
                self.engine.statistics()
            }

            /// Moves `state` over one element.
            ///
            /// # Errors
            /// Says why the element could not be solved; `state` is unchanged then.
            #vis fn advance(
                &mut self,
                state: &mut #path::State<#dof>,
            ) -> ::core::result::Result<(), #path::StepError> {
                self.engine.advance(&self.model, &Self::SCHEME, state)
            }
        }

        #[automatically_derived]
        impl ::core::fmt::Debug for #name {
            fn fmt(&self, f: &mut ::core::fmt::Formatter<'_>) -> ::core::fmt::Result {
                f.debug_struct(#text)
                    .field("time", &self.engine.time())
                    .field("step", &self.engine.step())
                    .field("statistics", self.engine.statistics())
                    .finish_non_exhaustive()
            }
        }
    }
}

/// The function that copies fields which may not be `Clone`, if there are any; and the fields of a copy of `model`.
fn fields(item: &ItemStruct) -> (Option<TokenStream>, TokenStream) {
    let context = input::context(item);
    let (mut kept, mut fields) = (None, TokenStream::new());
    for own in item.fields.iter().filter_map(|field| field.ident.as_ref()) {
        let name = input::generated(own);
        let kind = context.field(&input::plain(own)).map(|field| &field.kind);
        fields.extend(match kind {
            Some(kind) if is_copy(kind) => quote!(#name: model.#name,),
            Some(FieldKind::Other(_)) => {
                kept.get_or_insert_with(keep);
                // Under the field, where its type stands.
                let at = Span::call_site().located_at(own.span());
                let mut name = own.clone();
                name.set_span(at);
                quote_spanned!(at=> #name: __TfeKeep::keep(&model.#name),)
            }
            _ => quote!(#name: ::core::clone::Clone::clone(&model.#name),),
        });
    }
    (kept, fields)
}

/// `Clone` for the fields of a model, with a message of its own where a type is not.
fn keep() -> TokenStream {
    quote! {
        #[diagnostic::on_unimplemented(
            message = "a solver keeps a copy of its model, but `{Self}` is not `Clone`",
            label = "this field cannot be copied",
            note = "derive `Clone` for its type, or use `Simulation`, which borrows the model"
        )]
        trait __TfeKeep {
            fn keep(&self) -> Self;
        }

        #[diagnostic::do_not_recommend]
        impl<__T: ::core::clone::Clone> __TfeKeep for __T {
            fn keep(&self) -> Self {
                ::core::clone::Clone::clone(self)
            }
        }
    }
}

fn element(solver: &Solver, path: &TokenStream) -> TokenStream {
    let nodes = Literal::u32_unsuffixed(solver.element.nodes);
    let constructor = format_ident!("{}", solver.element.family.constructor());
    let rule = match solver.element.rule {
        Rule::Default => TokenStream::new(),
        Rule::Reduced => quote!(.reduced()),
        Rule::Lobatto => quote!(.lobatto()),
        Rule::Gauss(points) => {
            let points = Literal::u32_unsuffixed(points);
            quote!(.quadrature(#points))
        }
    };
    quote!(#path::Element::#constructor(#nodes)#rule)
}
