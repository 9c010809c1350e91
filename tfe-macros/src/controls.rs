//! The names and the additional arguments of kernels in models with inputs.

use proc_macro2::{Ident, TokenStream};
use quote::{format_ident, quote};
use tfe_symbolic::model::declared::Declared;

/// The inputs among the parameters and the arguments of kernels; empty if there are none.
pub(crate) struct Controls {
    pub(crate) parameter: TokenStream,
    pub(crate) argument: TokenStream,
}

impl Controls {
    pub(crate) fn of(declared: &Declared) -> Self {
        if declared.inputs.is_empty() {
            return Self {
                parameter: TokenStream::new(),
                argument: TokenStream::new(),
            };
        }
        Self {
            parameter: quote!(inputs: &[R; __tfe::MAX_INPUTS],),
            argument: quote!(inputs,),
        }
    }
}

/// The name of a kernel: that of the trait of models, or of the trait of those with inputs.
pub(crate) fn kernel(declared: &Declared, name: &str) -> Ident {
    match declared.inputs.is_empty() {
        true => format_ident!("{name}"),
        false => format_ident!("{name}_with"),
    }
}

/// All inputs zero.
pub(crate) fn zeros() -> TokenStream {
    quote!(&[t.like(0.0); __tfe::MAX_INPUTS])
}
