//! Names and indices of programs as Rust.

use proc_macro2::{Ident, Literal, Span, TokenStream};
use quote::{format_ident, quote};
use tfe_symbolic::expr::input::{Affine, IndexSymbol, LoopVariable};

/// An identifier, raw where necessary, and with a trailing underscore where not even that is a name (which has been
/// reported).
pub(crate) fn identifier(name: &str) -> Ident {
    match name {
        "_" | "crate" | "self" | "super" | "Self" => format_ident!("__{name}"),
        // A keyword of the edition of generated code that `syn` does not know.
        "gen" => Ident::new_raw(name, Span::call_site()),
        name => syn::parse_str::<Ident>(name)
            .unwrap_or_else(|_| Ident::new_raw(name, Span::call_site())),
    }
}

pub(crate) fn loop_name(variable: LoopVariable) -> Ident {
    format_ident!("{}", variable.to_string())
}

/// An index as a `usize` expression that cannot overflow: subtraction saturates at zero.
pub(crate) fn index(affine: &Affine) -> TokenStream {
    less_each(affine, less)
}

/// An index that nothing has checked: where it is below zero it is beyond the end of every array.
pub(crate) fn unchecked_index(affine: &Affine) -> TokenStream {
    less_each(affine, |a, b| method_of(a, &quote!(wrapping_sub(#b))))
}

/// What an index is made of: the sum of all that is added, and then by `less` all that is subtracted.
fn less_each(
    affine: &Affine,
    less: impl Fn(&TokenStream, &TokenStream) -> TokenStream,
) -> TokenStream {
    let affine = &affine.plain();
    let mut sum: Option<TokenStream> = None;
    for (symbol, coefficient) in affine.terms.iter().filter(|(_, c)| *c > 0) {
        let term = scaled(symbol, *coefficient);
        sum = Some(sum.map_or(term.clone(), |sum| quote!(#sum + #term)));
    }
    if affine.constant > 0 || sum.is_none() {
        let size = affine.constant.max(0).unsigned_abs();
        // `9.saturating_sub(i)` would be of an unknown type.
        let subtracted_from = sum.is_none() && affine.terms.iter().any(|(_, c)| *c < 0);
        let constant = match usize::try_from(size) {
            Ok(size) if subtracted_from => Literal::usize_suffixed(size),
            _ => Literal::u64_unsuffixed(size),
        };
        sum = Some(sum.map_or(quote!(#constant), |sum| quote!(#sum + #constant)));
    }
    let mut sum = sum.unwrap_or_default();
    for (symbol, coefficient) in affine.terms.iter().filter(|(_, c)| *c < 0) {
        let term = scaled(symbol, -coefficient);
        sum = less(&sum, &term);
    }
    if affine.constant < 0 {
        let constant = Literal::u64_unsuffixed(affine.constant.unsigned_abs());
        sum = less(&sum, &quote!(#constant));
    }
    sum
}

/// `a - b`, or zero where `b` is larger.
pub(crate) fn less(a: &TokenStream, b: &TokenStream) -> TokenStream {
    method_of(a, &quote!(saturating_sub(#b)))
}

/// `a.call`, with parentheses where `a` is a sum or a product.
fn method_of(a: &TokenStream, call: &TokenStream) -> TokenStream {
    let operators = ["+", "*"];
    if a.clone()
        .into_iter()
        .any(|token| operators.contains(&token.to_string().as_str()))
    {
        quote!((#a).#call)
    } else {
        quote!(#a.#call)
    }
}

fn scaled(symbol: &IndexSymbol, coefficient: i64) -> TokenStream {
    let symbol = symbol_tokens(symbol);
    if coefficient == 1 {
        return symbol;
    }
    let coefficient = Literal::i64_unsuffixed(coefficient);
    quote!(#coefficient * #symbol)
}

fn symbol_tokens(symbol: &IndexSymbol) -> TokenStream {
    match symbol {
        IndexSymbol::Loop(variable) => {
            let name = loop_name(*variable);
            quote!(#name)
        }
        IndexSymbol::ConstParameter(name) => {
            let name = identifier(name);
            quote!(#name)
        }
        IndexSymbol::Field(name) => {
            let name = identifier(name);
            quote!(self.#name)
        }
        IndexSymbol::Entry(list, place) => {
            let list = identifier(list);
            at(&quote!(self.#list), &[place])
        }
        IndexSymbol::Within(_) => quote!(0),
    }
}

/// An integer as an `i64` expression: `i as i64 + 1`.
pub(crate) fn signed(affine: &Affine) -> TokenStream {
    let affine = &affine.plain();
    let mut sum = TokenStream::new();
    for (symbol, coefficient) in &affine.terms {
        let symbol = match symbol {
            // Sums of entries do not overflow, whatever a list contains.
            IndexSymbol::Entry(..) => {
                let entry = symbol_tokens(symbol);
                quote!(__tfe::checks::small(#entry))
            }
            symbol => symbol_tokens(symbol),
        };
        let size = Literal::u64_unsuffixed(coefficient.unsigned_abs());
        let operator = match (*coefficient < 0, sum.is_empty()) {
            (true, _) => quote!(-),
            (false, true) => TokenStream::new(),
            (false, false) => quote!(+),
        };
        sum.extend(match coefficient.unsigned_abs() {
            1 => quote!(#operator (#symbol as i64)),
            _ => quote!(#operator #size * (#symbol as i64)),
        });
    }
    let size = Literal::u64_unsuffixed(affine.constant.unsigned_abs());
    match affine.constant {
        0 if !sum.is_empty() => sum,
        constant if constant < 0 => quote!(#sum - #size),
        _ if sum.is_empty() => quote!(#size),
        _ => quote!(#sum + #size),
    }
}

/// An integer as a number.
pub(crate) fn real(affine: &Affine) -> TokenStream {
    let affine = &affine.plain();
    let constant = number(affine.constant as f64);
    let terms = affine.terms.iter().map(|(symbol, coefficient)| {
        let (symbol, coefficient) = (symbol_tokens(symbol), number(*coefficient as f64));
        quote!(+ #coefficient * (#symbol as f64))
    });
    quote!(#constant #(#terms)*)
}

fn at(array: &TokenStream, indices: &[&Affine]) -> TokenStream {
    let indices = indices.iter().map(|a| index(a));
    quote!(#array #([#indices])*)
}

/// A number as a literal, or as a constant if it has no literal (infinities).
pub(crate) fn number(value: f64) -> TokenStream {
    if value.is_nan() {
        quote!(::core::primitive::f64::NAN)
    } else if value == f64::INFINITY {
        quote!(::core::primitive::f64::INFINITY)
    } else if value == f64::NEG_INFINITY {
        quote!(::core::primitive::f64::NEG_INFINITY)
    } else if value.is_sign_negative() {
        let size = Literal::f64_unsuffixed(-value);
        quote!(-#size)
    } else {
        let literal = Literal::f64_unsuffixed(value);
        quote!(#literal)
    }
}
