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
pub mod ensemble;
pub mod error;
pub mod family;
pub mod fidelity;
pub mod linearised;
pub mod modal;
pub mod motion;
pub mod periodic;
pub mod periodic_schur;
pub mod simulation;
pub mod stability;
pub mod work_precision;

pub use assembly::{AssemblyError, MeshError};
pub use boundary::{BoundaryMotion, BoundaryValue};
pub use constraints::{
    Consistent, ConsistentError, ConsistentState, ConstraintResidual, Reactions,
};
pub use continuation::{Branch, Continuation};
pub use ensemble::Ensemble;
pub use error::{AtError, RunError, RunErrorKind};
pub use fidelity::Fidelity;
pub use linearised::Linearised;
pub use modal::Modal;
pub use motion::{Motion, Node, Outputs};
pub use periodic::{Orbit, PeriodicOrbit};
pub use simulation::{Simulation, Steps, Warning};
/// # Models made from models
/// A pendulum, linear and to the fourth degree:
/// ```
/// use tfe::prelude::*;
///
/// #[dynamics(
///     coordinates(theta),
///     lagrangian = m/2*l^2*dot(theta)^2 + m*g*l*cos(theta),
///     model(Linear, truncated(2)),
///     model(Cubic, truncated(4)),
/// )]
/// struct Pendulum { m: f64, l: f64, g: f64 }
///
/// let pendulum = Pendulum { m: 1.0, l: 1.0, g: 9.81 };
/// assert!(Linear::structure().facts.linear && !Pendulum::structure().facts.linear);
/// let (linear, cubic) = (Linear::of(&pendulum), Cubic::of(&pendulum));
/// let end = |motion: Motion<1>| motion.last().q[0];
/// let full = end(Simulation::new(&pendulum).run(pendulum.state([0.3], [0.0]), 0.0..2.0)?);
/// let second = end(Simulation::new(&linear).run(linear.state([0.3], [0.0]), 0.0..2.0)?);
/// let fourth = end(Simulation::new(&cubic).run(cubic.state([0.3], [0.0]), 0.0..2.0)?);
/// assert!((fourth - full).abs() < 0.02 * (second - full).abs());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub use tfe_macros::dynamics;
/// The runtime that generated code links into: elements, schemes, Newton, transition matrices, the paper's nodal forms.
pub use tfe_runtime as runtime;
pub use tfe_runtime::{
    Element, EnergyConserving, Family, Mixed, Model, Primal, Radau, Rule, Solve, State, Statistics,
    StepError, Structure, ThreeField,
};
pub use work_precision::WorkPrecision;

/// What a program that simulates needs: `use tfe::prelude::*;`.
pub mod prelude {
    pub use crate::{
        BoundaryValue, ConsistentState, Continuation, Element, EnergyConserving, Ensemble,
        Fidelity, Mixed, Modal, Model, Motion, Node, PeriodicOrbit, Primal, Radau, Simulation,
        Solve, State, ThreeField, WorkPrecision, dynamics, stability,
    };
}

/// What generated code refers to. Not part of the public interface.
#[doc(hidden)]
pub use tfe_runtime::__private;
