//! Derivatives by parameters and by the time.

use super::Kernels;
use crate::controls::Controls;
use crate::page::{self, Formulas};
use crate::{indices, input};
use proc_macro2::{Literal, TokenStream};
use quote::quote;
use tfe_symbolic::model::declared::Parameter;
use tfe_symbolic::model::notation;
use tfe_symbolic::program::By;
use tfe_symbolic::syntax::context::{FieldKind, Length};

impl Kernels<'_> {
    /// The names and values of the parameters of `sensitivity(…)`; the derivatives by them and by the time.
    pub(super) fn sensitivities(&self) -> (TokenStream, TokenStream) {
        let parameters = &self.declared.sensitivities;
        if parameters.is_empty() {
            return Default::default();
        }
        let names = parameters.iter().map(ToString::to_string);
        let values = parameters.iter().enumerate().map(|(k, parameter)| {
            let (k, value) = (Literal::usize_unsuffixed(k), self.parameter(parameter));
            quote!(#k => #value,)
        });
        let values = quote! {
            const SENSITIVITIES: &'static [&'static str] = &[#(#names),*];

            fn sensitivity_parameter(&self, index: usize) -> f64 {
                match index {
                    #(#values)*
                    _ => ::core::primitive::f64::NAN,
                }
            }
        };
        (values, self.first_by())
    }

    /// The value of a parameter; NaN where an array of any length is too short for it.
    fn parameter(&self, parameter: &Parameter) -> TokenStream {
        let field = indices::identifier(&parameter.field);
        let Some(element) = parameter.element.map(Literal::usize_unsuffixed) else {
            return quote!(self.#field);
        };
        let kind = input::context(self.item)
            .field(&parameter.field)
            .map(|field| field.kind.clone());
        match kind {
            Some(FieldKind::Array(Length::Literal(_))) => quote!(self.#field[#element]),
            _ => quote!(self.#field.get(#element).copied().unwrap_or(::core::primitive::f64::NAN)),
        }
    }

    /// `first_by`, with an arm for the time and for each parameter on which anything depends.
    fn first_by(&self) -> TokenStream {
        let dof = &self.dof;
        let arm = |by: By| {
            let program = self.derivation.program_by(by);
            let (pattern, name) = match by {
                By::Time => (quote!(__tfe::By::Time), "t".to_owned()),
                By::Parameter(k) => {
                    let name = notation::element(&self.declared.sensitivities[k].to_string());
                    let k = Literal::usize_unsuffixed(k);
                    (quote!(__tfe::By::Parameter(#k)), name)
                }
            };
            let doc = page::kernel(&format!("∂/∂{name}"), &program);
            let body = self.emitted(&program, TokenStream::new()).statements;
            (!program.statements.is_empty()).then(|| quote!(#[doc = #doc] #pattern => { #body }))
        };
        let parameters = 0..self.declared.sensitivities.len();
        let arms: Vec<_> = std::iter::once(By::Time)
            .chain(parameters.map(By::Parameter))
            .filter_map(arm)
            .collect();
        if arms.is_empty() && self.declared.inputs.is_empty() {
            return TokenStream::new();
        }
        let (given, kernel) = (
            Controls::of(self.declared).parameter,
            self.kernel("first_by"),
        );
        let formulas = Formulas::of(self.declared, self.derivation);
        let doc = format!(
            " Derivatives of {} by the time and by parameters",
            formulas.first
        );
        quote! {
            #[doc = #doc]
            fn #kernel<R: __tfe::Real>(
                &self,
                by: __tfe::By,
                #given
                t: R,
                q: &[R; #dof],
                z: &[R; #dof],
                first: &mut __tfe::First<R, #dof>,
            ) {
                match by {
                    #(#arms)*
                    _ => {}
                }
            }
        }
    }
}
