//! What a program is to compute.

/// What one kernel computes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Default)]
pub struct Request {
    /// L or H
    pub value: bool,
    /// First derivatives and forces
    pub first: bool,
    /// ∂²/∂z∂z (the mass matrix of a Lagrangian)
    pub mass: bool,
    /// All second derivatives and the derivatives of the forces
    pub second: bool,
    /// The observables
    pub observables: bool,
    /// φ of the holonomic constraints
    pub constraint_values: bool,
    /// A and a of the constraints
    pub constraint_rows: bool,
    /// The derivatives of the constraints, with velocities and multipliers
    pub constraint_second: bool,
}

impl Request {
    /// Nothing at all.
    pub const NOTHING: Self = Self {
        value: false,
        first: false,
        mass: false,
        second: false,
        observables: false,
        constraint_values: false,
        constraint_rows: false,
        constraint_second: false,
    };

    /// The energy function alone.
    pub const VALUE: Self = Self {
        value: true,
        ..Self::NOTHING
    };

    /// First derivatives and forces alone.
    pub const FIRST: Self = Self {
        first: true,
        ..Self::NOTHING
    };

    /// The same with the mass matrix.
    pub const FIRST_AND_MASS: Self = Self {
        mass: true,
        ..Self::FIRST
    };

    /// First and second derivatives.
    pub const SECOND: Self = Self {
        second: true,
        ..Self::FIRST
    };
}

/// By what the first derivatives and forces are differentiated once more, at fixed (q, z).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum By {
    /// The time
    Time,
    /// The parameter of this number in `sensitivity(…)`
    Parameter(usize),
}
