//! Derivatives, and the kernels that compute them: beside closed forms, dual numbers and the formulas as declared.

#[path = "../digits/mod.rs"]
mod digits;
mod kernels;

mod angles;
mod constraints;
mod counts;
mod derivatives;
mod families;
mod kept_digits;
mod kinks;
mod lengths;
mod limits;
mod lists;
mod loops;
mod reduced;
mod rounding;
mod sensitivity;
mod singular;
mod sites;
mod structure;
mod transformation;
