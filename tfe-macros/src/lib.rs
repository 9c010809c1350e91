//! The `#[dynamics(...)]` attribute of [`tfe`](https://docs.rs/tfe).
//!
//! It is a thin shell: tokens become text with a table of places (`source_map`), the engine `tfe-symbolic` derives the
//! model, and `expand` writes the resulting programs as Rust. The language is described in the documentation of `tfe`.

mod balance;
mod checks;
mod constraint;
mod controls;
mod docs;
mod emit;
mod expand;
mod fallback;
mod family;
#[cfg(test)]
mod fuzz;
mod headings;
mod in_place;
mod indices;
mod input;
mod lengths;
mod page;
mod parameters;
mod parts;
mod solver;
mod source_map;
mod state;
#[cfg(test)]
mod tests;
mod variant;

use proc_macro::TokenStream;

// The page of the language. Its examples are tests of the crate `tfe`, on which this one cannot depend.
#[cfg_attr(not(doctest), doc = include_str!("../language.md"))]
#[proc_macro_attribute]
pub fn dynamics(arguments: TokenStream, item: TokenStream) -> TokenStream {
    expand::expand(arguments.into(), item.into()).into()
}
