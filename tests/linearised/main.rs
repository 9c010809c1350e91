//! Transition matrices: of linear models against closed forms, of nonlinear ones against differences of runs, along motions, and the steps
//! at which a method grows although the model does not.

#![allow(missing_docs)] // what models and helpers mean is said where they are

#[path = "../common/mod.rs"]
mod common;

mod along;
mod critical_speed;
mod derivative;
mod stiff;
mod top;
mod warnings;
