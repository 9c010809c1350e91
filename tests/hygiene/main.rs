//! Hygiene of the generated code: it compiles whatever names, lints and items surround it.

#![deny(missing_docs, warnings)]
#![allow(non_camel_case_types)]

pub mod shadowed;
pub mod strict;
pub mod without_prelude;

use tfe::prelude::*;

/// Fields named like variables of the generated code.
#[dynamics(
    coordinates(x),
    lagrangian = q/2*dot(x)^2 - z*x^2/2 - t1*cos(x) - first*x^4 - second*sin(2*x) - sin_x*x^3,
    output(values) = x*q,
)]
pub struct Taken {
    /// Named like the coordinates.
    pub q: f64,
    /// Named like the velocities.
    pub z: f64,
    /// Named like a temporary.
    pub t1: f64,
    /// Named like the results.
    pub first: f64,
    /// Named like other results.
    pub second: f64,
    /// Named like the sine of the coordinate.
    pub sin_x: f64,
}

/// Raw identifiers.
#[dynamics(coordinates(x), lagrangian = r#type/2*dot(x)^2 - x^2/2)]
pub struct Raw {
    /// A keyword.
    pub r#type: f64,
}

/// Keywords of different editions.
#[dynamics(coordinates(r#dyn), lagrangian = r#gen/2*dot(r#dyn)^2 - r#async*sin(r#dyn), output(r#try) = r#dyn)]
pub struct Keywords {
    /// A keyword since 2024.
    pub r#gen: f64,
    /// A keyword since 2018.
    pub r#async: f64,
}

/// Outputs named like kernels.
#[dynamics(
    coordinates(x),
    lagrangian = dot(x)^2/2 - cos(x),
    output(first_inline) = 2*x,
    output(first_and_mass_inline) = 3*x,
    output(energy_function) = 4*x,
)]
pub struct Kernels {}

/// Fields of a packed struct, which cannot be borrowed.
#[dynamics(
    coordinates(x),
    lagrangian = m/2*dot(x)^2 - k*cos(x),
    solver(PackedSolver, Mixed::<2>),
    model(PackedNear, truncated(2)),
)]
#[repr(C, packed)]
pub struct Packed {
    /// Mass.
    pub m: f64,
    /// Stiffness.
    pub k: f64,
}

/// A struct with a trait bound and a destructor.
#[dynamics(coordinates(x), lagrangian = dot(x)^2/2 - sum(i in 0..N, w[i]*x^2))]
pub struct Bounded<const N: usize>
where
    [f64; N]: Copy,
{
    /// Weights.
    pub w: [f64; N],
}

impl<const N: usize> Drop for Bounded<N>
where
    [f64; N]: Copy,
{
    fn drop(&mut self) {}
}

/// A deprecated model with a deprecated field.
#[deprecated]
#[dynamics(
    coordinates(x),
    lagrangian = m/2*dot(x)^2 - k*cos(x),
    output(twice) = 2*x,
    solver(OldSolver, Mixed::<2>),
    model(OldNear, truncated(2)),
)]
pub struct Old {
    /// Mass.
    #[deprecated]
    pub m: f64,
    /// Stiffness.
    pub k: f64,
}

macro_rules! oscillator {
    ($name:ident, $potential:expr) => {
        /// A model declared by a macro.
        #[dynamics(coordinates(x), lagrangian = dot(x)^2/2 - 2*$potential)]
        pub struct $name {}
    };
}

oscillator!(Soft, x ^ 2 + x ^ 4);

mod elsewhere {
    //! The crate under another name.
    pub use tfe as dynamics_engine;
}

/// The path of the crate is given as an argument.
#[dynamics(crate = elsewhere::dynamics_engine, coordinates(x), lagrangian = dot(x)^2/2 - x^2/2)]
pub struct Renamed {}

macro_rules! renamed {
    ($name:ident, $path:path) => {
        /// The path of the crate is relative to where the macro is defined.
        #[dynamics(crate = $crate::elsewhere::dynamics_engine, coordinates(x), lagrangian = dot(x)^2/2 - x^2/2)]
        pub struct $name {}

        /// The path of the crate is an argument of the macro.
        pub mod at_path {
            use super::elsewhere;

            /// A model declared there.
            #[tfe::dynamics(crate = $path, coordinates(x), lagrangian = dot(x)^2/2 - x^2/2)]
            pub struct AtPath {}
        }
    };
}

renamed!(FromMacro, elsewhere::dynamics_engine);

macro_rules! spring {
    ($vis:vis $name:ident { $mass:ident, $stiffness:ident } $solver:ident) => {
        /// Names of fields passed to a macro.
        #[dynamics(coordinates(x), lagrangian = $mass/2*dot(x)^2 - $stiffness/2*x^2, solver($solver, Mixed::<2>))]
        $vis struct $name {
            /// Mass.
            $vis $mass: f64,
            /// Stiffness.
            $vis $stiffness: f64,
        }
    };
}

spring!(pub Spring { out, self_ } SpringSolver);

/// A constant with the name of a parameter.
pub mod constants {
    #![allow(non_snake_case)]

    /// Has the name of the parameter.
    pub const G: u8 = 0;

    /// A model next to it.
    #[tfe::dynamics(coordinates(x), lagrangian = dot(x)^2/2 - G*x)]
    pub struct Falling {
        /// The parameter.
        pub G: f64,
    }
}

macro_rules! chain {
    ($name:ident, $length:expr, $masses:ty) => {
        /// A length and a type passed to a macro.
        #[dynamics(coordinates(q[$length]), lagrangian = sum(i in 0..$length, m[i]/2*dot(q[i])^2 - q[i]^2/2))]
        pub struct $name {
            /// Masses.
            pub m: $masses,
        }
    };
}

chain!(Three, 3, [f64; 3]);

/// Greek letters as names.
#[dynamics(coordinates(θ), lagrangian = μ/2*dot(θ)^2 + μ*cos(θ), output(sinus) = sin(θ))]
pub struct Greek {
    /// Mass.
    pub μ: f64,
}

/// A field named like the cosine of a coordinate whose name ends in an underscore, as clashing fields are renamed.
#[dynamics(coordinates(phi_), lagrangian = dot(phi_)^2/2 - cos_phi*sin(phi_))]
pub struct Underscored {
    /// Named like the cosine.
    pub cos_phi: f64,
}

#[test]
fn they_all_move() {
    let first = shadowed::First { m: 1.0, k: 1.0 };
    let motion = Simulation::new(&first)
        .step(0.1)
        .run(first.state([0.5], [0.0]), 0.0..1.0)
        .expect("a run");
    let mut state = first.state([0.5], [0.0]);
    let mut solver = shadowed::Solver::new(&first, 0.1);
    for _ in 0..10 {
        solver.advance(&mut state).expect("a step");
    }
    let generic = Simulation::new(&first)
        .element(Mixed::<3>)
        .step(0.1)
        .run(first.state([0.5], [0.0]), 0.0..1.0)
        .expect("a run");
    assert!((state.q[0] - generic.last().q[0]).abs() < 1e-15);
    assert_eq!(first.elongation(0.0, [0.5], [0.0]), 0.5);
    assert!(motion.energy_error().is_finite());

    let second = shadowed::Second {
        m: 2.0,
        w: [1.0; 3],
    };
    assert_eq!(second.state([0.0; 2], [1.0; 2]).p, [2.0; 2]);
    assert_eq!(shadowed::Soft::of(&second, 3.0).k, 3.0);
    let third = shadowed::Third { n: 3 };
    assert_eq!(third.last(0.0, &[1.0, 2.0, 3.0], &[0.0; 3]), Ok(3.0));
    assert_eq!(
        shadowed::Fourth::<3> {}.state([0.0; 3], [1.0; 3]).p,
        [1.0; 3]
    );

    let taken = Taken {
        q: 2.0,
        z: 1.0,
        t1: 0.0,
        first: 0.0,
        second: 0.0,
        sin_x: 0.0,
    };
    assert_eq!(taken.state([0.0], [3.0]).p, [6.0]);
    assert_eq!(taken.values(0.0, [3.0], [0.0]), 6.0);
    let raw = Raw { r#type: 4.0 };
    assert_eq!(raw.state([0.0], [3.0]).p, [12.0]);
    let greek = Greek { μ: 2.0 };
    assert_eq!(greek.state([0.0], [1.0]).p, [2.0]);
    assert_eq!(Renamed {}.state([0.0], [1.0]).p, [1.0]);

    assert_eq!(constants::Falling { G: 9.81 }.state([0.0], [1.0]).p, [1.0]);
    assert_eq!(constants::G, 0);
    let three = Three { m: [1.0, 2.0, 3.0] };
    assert_eq!(three.state([0.0; 3], [1.0; 3]).p, [1.0, 2.0, 3.0]);

    let underscored = Underscored { cos_phi: 3.0 };
    let mut derivatives = tfe::runtime::First::<f64, 1>::ZERO;
    Model::first(&underscored, 0.0, &[1.0], &[0.0], &mut derivatives);
    assert_eq!(derivatives.q, [-3.0 * 1.0_f64.cos()]);

    // The substituted expression must be treated as one operand: L_q = −2 (2x + 4x³) = −12 at x = 1.
    let soft = Soft {};
    let mut derivatives = tfe::runtime::First::<f64, 1>::ZERO;
    Model::first(&soft, 0.0, &[1.0], &[0.0], &mut derivatives);
    assert_eq!(derivatives.q, [-12.0]);
}

#[test]
fn they_move_without_a_prelude() {
    use without_prelude::{AnyRing, Bare, Chain, Held, Ring, Soft};

    let ring = Ring {
        sums: 2.0,
        sum_: 3.0,
        column: 0.5,
        row: 4.0,
    };
    let mut q = [0.0; 18];
    (q[0], q[17]) = (0.1, 0.3);
    assert_eq!(ring.state(q, [1.0; 18]).p, [2.0; 18]);
    assert!((ring.spread(0.0, q, [0.0; 18]) - 0.8).abs() < 1e-15);
    // The forces between pairs cancel, so that the sum of each row of derivatives by all angles is zero; in both kinds
    // of loops.
    let mut derivatives = tfe::runtime::First::<f64, 18>::ZERO;
    let mut second = tfe::runtime::Second::<f64, 18>::ZERO;
    let any = AnyRing::<18> { k: 1.5 };
    Model::second(&ring, 0.0, &q, &[0.0; 18], &mut derivatives, &mut second);
    let of_ring = second.qq;
    Model::second(&any, 0.0, &q, &[0.0; 18], &mut derivatives, &mut second);
    for (row, other) in of_ring.iter().zip(&second.qq) {
        assert!(row.iter().sum::<f64>().abs() < 1e-12);
        let differ = |(a, b): (&f64, &f64)| (a - b).abs() > 1e-12;
        assert!(!row.iter().zip(other).any(differ));
    }

    let chain = Chain {
        n: 3,
        __to: 1.0,
        __end: 0.0,
    };
    assert_eq!(
        chain.forces_inline(0.0, &[1.0, 2.0, 3.0], &[0.0; 3]),
        Ok(3.0)
    );
    let motion = Simulation::new(&chain)
        .step(0.1)
        .run(chain.state([0.0, 0.1, 0.2], [0.0; 3]), 0.0..1.0)
        .expect("a run");
    assert!(motion.energy_error() < 1e-9);

    let held = Held { k: 2.0 };
    let mut state = held.state([1.0, 0.5], [0.0, 0.0]);
    let mut solver = Bare::new(&held, 0.1);
    solver.advance(&mut state).expect("a step");
    assert!((state.q[0] - 1.0).abs() < 1e-12);
    let soft = Soft::of(&held, 5.0);
    assert_eq!((soft.k, soft.original), (2.0, 5.0));
}

#[test]
fn names_and_attributes_are_theirs() {
    let keywords = Keywords {
        r#gen: 3.0,
        r#async: 1.0,
    };
    assert_eq!(keywords.state([0.0], [2.0]).p, [6.0]);
    assert_eq!(keywords.r#try(0.0, [0.5], [0.0]), 0.5);

    let kernels = Kernels {};
    assert_eq!(kernels.first_inline(0.0, [1.0], [0.0]), 2.0);
    assert_eq!(kernels.first_and_mass_inline(0.0, [1.0], [0.0]), 3.0);
    let mut derivatives = tfe::runtime::First::<f64, 1>::ZERO;
    Model::first(&kernels, 0.0, &[1.0], &[0.5], &mut derivatives);
    assert_eq!(derivatives.z, [0.5]);
    assert!((derivatives.q[0] - 1.0_f64.sin()).abs() < 1e-15);

    let packed = Packed { m: 2.0, k: 1.0 };
    let mut state = packed.state([0.0], [1.0]);
    assert_eq!(state.p, [2.0]);
    let mut solver = PackedSolver::new(&packed, 0.1);
    solver.advance(&mut state).expect("a step");
    assert_eq!(PackedNear::of(&packed).m, 2.0);

    let bounded = Bounded { w: [1.0, 2.0] };
    let changed = <Bounded<2> as Model<1>>::with_parameter(&bounded, 1, 5.0);
    let changed = changed.expect("numbers can be copied");
    assert_eq!(changed.w, [1.0, 5.0]);

    assert_eq!(strict::momenta(), [2.0, 3.0]);
    let pendulum = strict::Pendulum { m: 1.0, g: 9.81 };
    assert_eq!(pendulum.height(0.0, [0.0, -1.0], [0.0; 2]), -1.0);
    let _ = (strict::Stepper::BYTES, strict::Soft::of(&pendulum, 1e3).k);

    assert_eq!(FromMacro {}.state([0.0], [1.0]).p, [1.0]);
    assert_eq!(at_path::AtPath {}.state([0.0], [1.0]).p, [1.0]);
    let spring = Spring {
        out: 2.0,
        self_: 1.0,
    };
    let mut state = spring.state([0.0], [1.0]);
    assert_eq!(state.p, [2.0]);
    let mut solver = SpringSolver::new(&spring, 0.1);
    solver.advance(&mut state).expect("a step");
}

#[test]
#[allow(deprecated)]
fn a_deprecated_model_still_moves() {
    let old = Old { m: 2.0, k: 1.0 };
    let mut state = old.state([0.0], [1.0]);
    assert_eq!(state.p, [2.0]);
    OldSolver::new(&old, 0.1)
        .advance(&mut state)
        .expect("a step");
    assert_eq!(OldNear::of(&old).m, 2.0);
    assert_eq!(old.twice(0.0, [1.0], [0.0]), 2.0);
}

#[test]
fn several_models_in_one_function() {
    /// One.
    #[dynamics(coordinates(x), lagrangian = m/2*dot(x)^2 - cos(x), output(twice) = 2*x, solver(Fast, Mixed::<2>), model(Near, truncated(2)))]
    struct One {
        m: f64,
    }

    /// Another.
    #[dynamics(coordinates(q[n]), lagrangian = sum(i in 0..n, dot(q[i])^2/2) - q[0]^2/2)]
    struct Other {
        n: usize,
    }

    let one = One { m: 2.0 };
    let mut state = one.state([0.0], [1.0]);
    assert_eq!(one.twice(0.0, [1.0], [0.0]), 2.0);
    Fast::new(&one, 0.1).advance(&mut state).expect("a step");
    assert_eq!(Near::of(&one).m, 2.0);
    assert_eq!(Other { n: 2 }.state([0.0; 2], [1.0; 2]).p.len(), 2);
}
