//! Generated code lives with whatever surrounds it.

#![deny(missing_docs, warnings)]
#![allow(non_camel_case_types)]

use tfe::prelude::*;

/// Names of the standard library that mean something else here.
pub mod shadowed {
    #![allow(dead_code)]

    /// Not `core::result::Result`.
    pub struct Result;
    /// Not `core::option::Option`.
    pub struct Option;
    /// Not `f64`, in the namespace of modules.
    pub mod core {}
    /// Nor `std`.
    pub mod std {}
    /// A trait with the methods of the scalar.
    pub trait Real {
        /// Not the sine.
        fn sin(&self) {}
    }
    impl Real for f64 {}
    /// Not the constructor.
    pub struct Ok;
    /// Not the scalar parameter.
    pub struct R;
    /// Not the constructor.
    pub struct Some;
    /// Nor this one.
    pub struct None;
    /// Nor this one.
    pub struct Err;
    /// Not `alloc::vec::Vec`.
    pub struct Vec;
    /// Not `alloc::string::String`.
    pub struct String;
    /// Not `alloc::boxed::Box`.
    pub struct Box;
    /// Not `core::default::Default`.
    pub struct Default;
    /// Not `core::clone::Clone`.
    pub struct Clone;
    /// Not `core::convert::Into`.
    pub struct Into;
    /// Not `core::iter::Iterator`.
    pub struct Iterator;
    /// Not the primitive type, in the namespace of modules.
    pub mod f64 {}

    #[tfe::dynamics(
        coordinates(x),
        lagrangian = m/2*dot(x)^2 - k*(1 - cos(x)),
        force(x) = select(x < 1, -x, sqrt(abs(x))),
        output(elongation) = x,
        solver(Solver, Mixed::<3>),
        model(Small, truncated(2)),
    )]
    /// A model among them.
    pub struct First {
        /// Mass.
        pub m: f64,
        /// Stiffness.
        pub k: f64,
    }

    /// Constraints on positions and velocities, and derivatives by parameters.
    #[tfe::dynamics(
        coordinates(x, y),
        lagrangian = m/2*(dot(x)^2 + dot(y)^2) - w[1]*y,
        constraint(rod) = x^2 + y^2 - 1,
        constraint(blade) = dot(x)*sin(t) - dot(y)*cos(t),
        sensitivity(m, w[1]),
        model(Soft, elastic(rod = k)),
    )]
    pub struct Second {
        /// Mass.
        pub m: f64,
        /// Weights.
        pub w: [f64; 3],
    }

    /// A model of run-time length with constraints and outputs by site.
    #[tfe::dynamics(
        coordinates(q[n]),
        lagrangian = sum(i in 0..n, dot(q[i])^2/2) - q[n-2]^2/2,
        constraint(rod[i in 0..n-1]) = (q[i+1] - q[i])^2 - 1,
        output(gap[i in 0..n-1]) = q[i+1] - q[i],
        output(last) = q[n-1],
    )]
    pub struct Third {
        /// Length.
        pub n: usize,
    }

    /// A model of a length known to the compiler, with an index that it checks.
    #[tfe::dynamics(coordinates(q[N]), lagrangian = sum(i in 0..N, dot(q[i])^2/2) - q[N-2]^2/2)]
    pub struct Fourth<const N: usize> {}
}

/// Fields named like the emitter's own variables.
#[dynamics(
    coordinates(x),
    lagrangian = q/2*dot(x)^2 - z*x^2/2 - t1*cos(x) - first*x^4 - second*sin(2*x) - sin_x*x^3,
    output(values) = x*q,
)]
pub struct Taken {
    /// Like the coordinates.
    pub q: f64,
    /// Like the velocities.
    pub z: f64,
    /// Like a temporary.
    pub t1: f64,
    /// Like the results.
    pub first: f64,
    /// Like more of them.
    pub second: f64,
    /// Like the sine of the coordinate.
    pub sin_x: f64,
}

/// Raw identifiers.
#[dynamics(coordinates(x), lagrangian = r#type/2*dot(x)^2 - x^2/2)]
pub struct Raw {
    /// A keyword.
    pub r#type: f64,
}

macro_rules! oscillator {
    ($name:ident, $potential:expr) => {
        /// From a macro.
        #[dynamics(coordinates(x), lagrangian = dot(x)^2/2 - 2*$potential)]
        pub struct $name {}
    };
}

oscillator!(Soft, x ^ 2 + x ^ 4);

mod elsewhere {
    //! The crate under another name.
    pub use tfe as dynamics_engine;
}

/// Finds the crate where it is told to.
#[dynamics(crate = elsewhere::dynamics_engine, coordinates(x), lagrangian = dot(x)^2/2 - x^2/2)]
pub struct Renamed {}

/// A constant called like a parameter.
pub mod constants {
    #![allow(non_snake_case)]

    /// Not the parameter.
    pub const G: u8 = 0;

    /// A model beside it.
    #[tfe::dynamics(coordinates(x), lagrangian = dot(x)^2/2 - G*x)]
    pub struct Falling {
        /// The parameter.
        pub G: f64,
    }
}

macro_rules! chain {
    ($name:ident, $length:expr, $masses:ty) => {
        /// Length and type from a macro.
        #[dynamics(coordinates(q[$length]), lagrangian = sum(i in 0..$length, m[i]/2*dot(q[i])^2 - q[i]^2/2))]
        pub struct $name {
            /// Masses.
            pub m: $masses,
        }
    };
}

chain!(Three, 3, [f64; 3]);

/// Greek letters.
#[dynamics(coordinates(θ), lagrangian = μ/2*dot(θ)^2 + μ*cos(θ), output(sinus) = sin(θ))]
pub struct Greek {
    /// Mass.
    pub μ: f64,
}

/// A field like the cosine of a coordinate whose name ends in an underscore, as fields of such names are renamed.
#[dynamics(coordinates(phi_), lagrangian = dot(phi_)^2/2 - cos_phi*sin(phi_))]
pub struct Underscored {
    /// Not the cosine.
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

    // The substituted expression binds as a whole: L_q = −2 (2x + 4x³) = −12 at x = 1.
    let soft = Soft {};
    let mut derivatives = tfe::runtime::First::<f64, 1>::ZERO;
    Model::first(&soft, 0.0, &[1.0], &[0.0], &mut derivatives);
    assert_eq!(derivatives.q, [-12.0]);
}
