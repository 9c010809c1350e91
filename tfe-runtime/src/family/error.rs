//! What is wrong with a model of run-time length, or with what it was asked for.

use crate::element::{Element, ElementError};
use core::fmt;

/// Lengths that do not belong together, and what families cannot do yet.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum FamilyError {
    /// A coordinate array without elements.
    NoElements {
        /// The array as declared, `q[n]`.
        array: &'static str,
    },
    /// A sum over nothing.
    EmptyRange {
        /// The range of the sum, `i in 0..n-1`.
        ranges: &'static str,
        /// Its first value.
        start: i64,
        /// One past its last value.
        end: i64,
    },
    /// An index outside of its array.
    Index {
        /// The array.
        array: &'static str,
        /// The index as declared, `i+1`.
        index: &'static str,
        /// The ranges of the sums that it depends on.
        ranges: &'static str,
        /// The first value that is outside.
        value: i64,
        /// The length of the array.
        length: usize,
    },
    /// An array field that is not as long as its indices ask for.
    FieldLength {
        /// The field.
        field: &'static str,
        /// Its length.
        length: usize,
        /// The length that its largest index asks for.
        expected: i64,
        /// That index as declared.
        index: &'static str,
        /// The ranges of the sums that it depends on.
        ranges: &'static str,
    },
    /// A vector of a state that is not as long as the model.
    StateLength {
        /// `q`, `v` or `p`.
        vector: &'static str,
        /// Its length.
        length: usize,
        /// The number of coordinates.
        expected: usize,
    },
    /// ∂²/∂z∂z has an entry off its diagonal, or varies: not supported yet.
    MassNotDiagonal {
        /// The row of the entry.
        row: usize,
        /// The column of the entry.
        column: usize,
    },
    /// The kinetic energy does not hold one of the velocities: no velocity belongs to a momentum.
    SingularMass {
        /// The coordinate.
        coordinate: usize,
    },
    /// The equations are not of the form M q̈ = f with a constant diagonal M: not supported yet.
    NotSecondOrder,
    /// The element does not exist.
    Element(ElementError),
    /// The element is not a Runge–Kutta method of at most 16 points for this model.
    ElementNotSupported {
        /// The element.
        element: Element,
    },
    /// Newton's method was asked for, but the feature `sparse` is off.
    NoNewton,
}

impl fmt::Display for FamilyError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoElements { array } => write!(f, "the array `{array}` has no elements"),
            Self::EmptyRange { ranges, start, end } => {
                write!(f, "the sum over `{ranges}` is empty: its range is {start}..{end}")
            }
            Self::Index {
                array,
                index,
                ranges,
                value,
                length,
            } => {
                write!(f, "the index of `{array}[{index}]`")?;
                if !ranges.is_empty() {
                    write!(f, " in the sum over `{ranges}`")?;
                }
                write!(f, " becomes {value}, but `{array}` has {length} elements")
            }
            Self::FieldLength {
                field,
                length,
                expected,
                index,
                ranges,
            } => {
                write!(f, "`{field}` has {length} elements, but `{field}[{index}]`")?;
                if !ranges.is_empty() {
                    write!(f, " in the sum over `{ranges}`")?;
                }
                write!(f, " asks for {expected}")
            }
            Self::StateLength {
                vector,
                length,
                expected,
            } => write!(
                f,
                "the vector {vector} has {length} elements, but the model has {expected} coordinates"
            ),
            Self::MassNotDiagonal { row, column } => write!(
                f,
                "the mass matrix has an entry off its diagonal, ({row}, {column}); models of run-time length need a diagonal one so far"
            ),
            Self::SingularMass { coordinate } => write!(
                f,
                "the kinetic energy does not depend on the velocity of coordinate {coordinate}"
            ),
            Self::NotSecondOrder => f.write_str(
                "models of run-time length need a kinetic energy ½ Σ m v² with constant masses so far",
            ),
            Self::Element(error) => error.fmt(f),
            Self::ElementNotSupported { element } => write!(
                f,
                "`{element}` is not available for models of run-time length; `Mixed` is"
            ),
            Self::NoNewton => f.write_str(
                "Newton's method for models of run-time length needs the feature `sparse`",
            ),
        }
    }
}

impl core::error::Error for FamilyError {
    fn source(&self) -> Option<&(dyn core::error::Error + 'static)> {
        match self {
            Self::Element(error) => Some(error),
            _ => None,
        }
    }
}
