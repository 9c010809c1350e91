//! The structure of a model as the macro has determined it, for people and programs.

use crate::model::{Facts, Form};
use core::fmt;

/// The number of operations of one kernel at one instant.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Operations {
    /// Additions and subtractions.
    pub additions: u32,
    /// Multiplications.
    pub multiplications: u32,
    /// Divisions.
    pub divisions: u32,
    /// Evaluations of a sine, of a cosine, or of both at once.
    pub sines: u32,
    /// Evaluations of other functions, including powers and square roots.
    pub functions: u32,
}

impl Operations {
    /// No operations.
    pub const NONE: Self = Self {
        additions: 0,
        multiplications: 0,
        divisions: 0,
        sines: 0,
        functions: 0,
    };
}

/// The structure of a model: the result of `Name::structure()`. `Display` prints a page.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Structure {
    /// The name of the struct.
    pub name: &'static str,
    /// Lagrangian or Hamiltonian.
    pub form: Form,
    /// Whether the model is linear, separable, smooth or autonomous, and whether its mass matrix is constant.
    pub facts: Facts,
    /// The cyclic coordinates, which do not appear in the energy function: their momenta change only by forces.
    pub cyclic: &'static [&'static str],
    /// Those of them on which no force acts: their momenta are constant, and `model(Name, routh(…))` makes a model
    /// without them.
    pub conserved: &'static [&'static str],
    /// The second derivative by z is diagonal: where it is constant as well, no matrix is inverted.
    pub diagonal_mass: bool,
    /// The energy function alone. Loops count once for each pass through their body where the length is known, once
    /// otherwise.
    pub value: Operations,
    /// First derivatives and forces.
    pub first: Operations,
    /// First and second derivatives together.
    pub second: Operations,
    /// All of this, and the sparsity pattern of the tangent, in words.
    pub page: &'static str,
}

impl Structure {
    /// Nothing is known: the structure of a declaration with mistakes.
    pub const UNKNOWN: Self = Self {
        name: "",
        form: Form::Lagrangian,
        facts: Facts::UNKNOWN,
        cyclic: &[],
        conserved: &[],
        diagonal_mass: false,
        value: Operations::NONE,
        first: Operations::NONE,
        second: Operations::NONE,
        page: "",
    };
}

impl fmt::Display for Operations {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            additions,
            multiplications,
            divisions,
            sines,
            functions,
        } = self;
        write!(
            f,
            "{additions} +−, {multiplications} ×, {divisions} ÷, {sines} sin/cos, {functions} other"
        )
    }
}

impl fmt::Display for Structure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.page)
    }
}
