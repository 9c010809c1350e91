//! Transition matrices: those of linear models compared with closed forms, of nonlinear ones with differences of runs,
//! along motions; and the steps at which a method is unstable although the model is not.

#![allow(missing_docs)] // what models and helpers mean is said where they are

#[path = "../common/mod.rs"]
mod common;

mod along;
mod critical_speed;
mod derivative;
#[path = "../common/differences.rs"]
mod differences;
mod resolution;
mod stiff;
mod top;
mod warnings;
