#![doc = include_str!("../README.md")]

extern crate self as tfe;

pub mod accuracy;
mod assembly;
pub mod boundary;
#[cfg(feature = "charts")]
pub mod charts;
pub mod constraints;
pub mod continuation;
mod csv;
mod differences;
mod driven;
pub mod ensemble;
pub mod error;
mod evaluate;
pub mod family;
pub mod fidelity;
#[cfg(feature = "fit")]
pub mod fit;
pub mod length;
pub mod linearised;
pub mod modal;
pub mod motion;
mod numbers;
pub mod optimal_control;
pub mod periodic;
pub mod periodic_schur;
mod progress;
pub mod sensitivity;
pub mod simulation;
pub mod stability;
mod velocity;
pub mod work_precision;

pub use assembly::{AssemblyError, MeshError, MeshWarning};
pub use boundary::{BoundaryMotion, BoundaryValue};
pub use constraints::{
    Consistent, ConsistentError, ConsistentState, ConstraintResidual, Reactions,
};
pub use continuation::{Branch, Continuation};
pub use driven::{Driven, InputError, Interpolation};
pub use ensemble::Ensemble;
pub use error::{AtError, RunError, RunErrorKind};
pub use fidelity::Fidelity;
#[cfg(feature = "fit")]
pub use fit::Fit;
pub use linearised::Linearised;
pub use modal::Modal;
pub use motion::{Motion, MotionArc, Node, Outputs, Setting};
/// The linear-algebra crate whose matrices this crate takes and returns, in the version that it uses.
pub use nalgebra;
pub use optimal_control::{OptimalControl, Optimum};
pub use periodic::{HybridOrbit, Orbit, PeriodicOrbit};
pub use sensitivity::Sensitive;
pub use simulation::{
    Act, Checkpoint, Crossing, Event, Held, HeldNode, Occurrence, Section, SectionPoint, Settings,
    Simulation, Steps, Warning,
};
pub use tfe_macros::dynamics;
/// The runtime with which generated code is linked: elements, their tables, Newton's method, transition matrices, the
/// nodal forms of the paper.
pub use tfe_runtime as runtime;
/// The elements by name, with the number of nodes as a const parameter: `Mixed::<4>`, `Radau::<3>`, …
pub use tfe_runtime::element::markers::*;
pub use tfe_runtime::{
    Element, Family, Model, ModelError, Rule, Solve, State, Statistics, StepError, Structure,
};
pub use velocity::Velocity;
pub use work_precision::WorkPrecision;

/// The items that most programs need: `use tfe::prelude::*;`.
pub mod prelude {
    #[cfg(feature = "fit")]
    pub use crate::Fit;
    pub use crate::stability::Blocks;
    pub use crate::{
        Act, BoundaryValue, ConsistentState, Continuation, Crossing, Element, Ensemble, Fidelity,
        Interpolation, Modal, Model, Motion, Node, OptimalControl, PeriodicOrbit, Settings,
        Simulation, Solve, State, Velocity, WorkPrecision, dynamics, stability,
    };
    pub use tfe_runtime::element::markers::*;
}

/// The examples on the page of `dynamics`, tested here because its own crate cannot use this one.
#[cfg(doctest)]
#[doc = include_str!("../tfe-macros/language.md")]
mod language {}

/// What generated code refers to. Not part of the public interface.
#[doc(hidden)]
pub use tfe_runtime::__private;
