//! The small runtime that generated kernels link into: finite elements in time, Newton's method, time stepping.
//!
//! Every element is described by data: trial degree, test degree, boundary jumps and quadrature rule become a few
//! matrices ([`scheme`]). A [`Model`] declared by its Lagrangian is solved for velocities, one declared by its
//! Hamiltonian for rates in phase space. [`step::Stepper`] moves a [`State`] over one element after the other;
//! [`step::Method`] does the same on memory provided by the caller, without allocation.
//!
//! # Features
//! - `std` (default): elementary functions of the standard library instead of `libm`.
//! - `simd` (default): the points of an element in the widest vector registers of the processor, chosen when the program
//!   runs.
//! - `alloc` (part of both): elements chosen at run time, dense output, models of run-time length, the nodal forms of
//!   [`weak_form`].
//! - `sparse`: for models of run-time length, Newton's method, any kinetic energy, constraints and derivatives.
//!
//! Without features the crate is `no_std` and does not allocate.
#![cfg_attr(not(feature = "std"), no_std)]

#[cfg(feature = "alloc")]
extern crate alloc;

mod arctangent;
#[cfg(feature = "alloc")]
mod backwards;
pub mod basis;
#[cfg(feature = "alloc")]
pub mod bundle;
mod condense;
#[cfg(feature = "alloc")]
pub mod condenser;
mod consistency;
pub mod constrained;
mod constrained_step;
mod control;
mod controlled;
mod cut;
#[cfg(feature = "alloc")]
mod dense;
mod double_double;
pub mod dual;
pub mod element;
#[cfg(feature = "std")]
pub mod enclosure;
mod equations;
pub mod error;
mod evidence;
mod exponential;
#[cfg(feature = "alloc")]
pub mod family;
mod input;
#[cfg(feature = "alloc")]
mod inside;
#[cfg(feature = "alloc")]
mod kinks;
pub mod lanes;
pub mod legendre;
pub mod length;
pub mod lu;
mod method;
pub mod model;
mod newton;
mod phase_form;
mod points;
mod precise;
#[cfg(feature = "alloc")]
mod propagator;
#[cfg(feature = "alloc")]
mod pull;
pub mod quadrature;
pub mod real;
mod registers;
#[cfg(feature = "alloc")]
mod root;
pub mod scheme;
#[cfg(feature = "alloc")]
mod share;
mod specialised;
pub mod statistics;
pub mod step;
#[cfg(feature = "alloc")]
mod stepper;
pub mod structure;
mod tableau;
#[cfg(feature = "alloc")]
mod tape;
pub mod transition;
mod trigonometry;
mod unlike;
mod velocity_form;
#[cfg(feature = "alloc")]
pub mod weak_form;
pub mod workspace;

pub use condense::{Direction, Parameter};
pub use consistency::ModelError;
pub use controlled::{Controlled, MAX_INPUTS};
#[cfg(feature = "std")]
pub use dense::bounds::{Arguments, LongArguments};
pub use element::markers::*;
pub use element::{Element, ElementError, Family, Rule};
pub use error::{ConstraintError, LegendreError, StepError};
pub use input::{InputFailure, InputPanicked};
#[cfg(feature = "alloc")]
pub use inside::{InsideLoss, InsideSlopes};
#[cfg(feature = "alloc")]
pub use kinks::switching_functions;
pub use lanes::Lanes;
pub use model::{
    By, Constraint, ConstraintKind, ConstraintSecond, CoordinateName, Facts, First, Form, Model,
    Second, State,
};
pub use newton::Solve;
#[cfg(feature = "alloc")]
pub use pull::{Partials, Pull, Sight};
pub use real::Real;
#[cfg(feature = "alloc")]
pub use share::Share;
pub use statistics::{Choice, Contraction, Statistics};
pub use structure::{Operations, Structure};

/// Items that generated code refers to. Not part of the public interface.
#[doc(hidden)]
pub mod __private {
    pub use crate::consistency::{ModelError, checks};
    pub use crate::controlled::{Controlled, MAX_INPUTS};
    pub use crate::element::markers::*;
    pub use crate::element::{Element, Rule};
    pub use crate::error::StepError;
    #[cfg(feature = "alloc")]
    pub use crate::family::{
        Block, Controlled as FamilyControlled, Entries, FamilyState, Gradient,
        Model as FamilyModel, ModelError as FamilyError, STRIDE, Sweep,
        observable as family_observable, observables as family_observables,
    };
    pub use crate::length::{Declared, RunTimeLength};
    pub use crate::model::{
        By, Constraint, ConstraintKind, ConstraintSecond, CoordinateName, Facts, First, Form,
        Model, Second, State,
    };
    pub use crate::newton::{Control, Solve};
    pub use crate::real::Real;
    pub use crate::registers::storage::{Fixed, Inline};
    #[cfg(feature = "alloc")]
    pub use crate::root::root;
    pub use crate::scheme::{Scheme, SchemeRef, Tables};
    pub use crate::specialised::{Specialised, sizes};
    pub use crate::statistics::Statistics;
    pub use crate::step::{Impulse, Interval, Memory, Method};
    pub use crate::structure::{Operations, Structure};
    pub use crate::workspace::{Workspace, numbers_len, pivots_len};

    /// Coordinates or velocities of a model of run-time length.
    #[cfg(feature = "alloc")]
    pub type List = alloc::vec::Vec<f64>;

    /// The state of coordinates and velocities of a model of run-time length.
    #[cfg(feature = "alloc")]
    pub fn family_state<M: FamilyModel>(
        model: &M,
        t: f64,
        q: impl AsRef<[f64]>,
        v: impl AsRef<[f64]>,
    ) -> FamilyState {
        crate::family::state(model, t, q.as_ref().to_vec(), v.as_ref().to_vec())
    }

    /// The state that belongs to coordinates and velocities. A momentum that does not exist becomes NaN, which the
    /// first step reports; so do all momenta of a model that does not pass its check.
    pub fn state<M, const N: usize>(model: &M, t: f64, q: [f64; N], v: [f64; N]) -> State<N>
    where
        M: Model<N>,
    {
        let unknown = State {
            q,
            p: [f64::NAN; N],
        };
        match model.check() {
            Ok(()) => crate::legendre::state(model, t, &q, &v).unwrap_or(unknown),
            Err(_) => unknown,
        }
    }
}
