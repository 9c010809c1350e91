//! Steppers for one model and one element: `solver(Name, Mixed::<4>)`.

use crate::docs::Docs;
use crate::indices::{identifier, index};
use proc_macro2::{Literal, TokenStream};
use quote::{format_ident, quote};
use syn::ItemStruct;
use tfe_symbolic::model::declared::{Declared, Form, Solver};
use tfe_symbolic::vocabulary::element::Rule;

/// The struct `solver.name` with everything that it needs as constants: element, tables, sizes.
pub(crate) fn expand(
    solver: &Solver,
    declared: &Declared,
    (item, docs): (&ItemStruct, &Docs),
    path: &TokenStream,
) -> TokenStream {
    let path = quote!(#path::__private);
    let (model, vis) = (&item.ident, &item.vis);
    let name = identifier(&solver.name);
    let dof = index(&declared.dof);
    let constraints = Literal::usize_unsuffixed(declared.constraints.len());
    let element = element(solver, &path);
    let form = match declared.form {
        Form::Lagrangian => quote!(Lagrangian),
        Form::Hamiltonian => quote!(Hamiltonian),
    };
    let fields: Vec<_> = item
        .fields
        .iter()
        .filter_map(|field| field.ident.as_ref())
        .collect();
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
        #vis struct #name {
            model: #model,
            engine: #path::Specialised<
                #dof,
                #inline,
                { #path::numbers_len(#name::ELEMENT, #path::Form::#form, #dof, #constraints) },
                { #path::pivots_len(#name::ELEMENT, #path::Form::#form, #dof, #constraints) },
            >,
        }

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
                Self {
                    model: #model { #(#fields: ::core::clone::Clone::clone(&model.#fields)),* },
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
