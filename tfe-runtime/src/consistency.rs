//! Whether a model is consistent: lengths, indices and ranges that a declaration leaves to the run time, their checks,
//! and the errors of what is requested of models of run-time length.

use crate::element::{Element, ElementError};
use core::fmt;

/// Why a model is inconsistent, or not supported.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum ModelError {
    /// A coordinate array without elements.
    NoElements {
        /// The array as declared, `q[n]`.
        array: &'static str,
    },
    /// A length beyond 2⁴⁰, which no array can have.
    Length {
        /// The field.
        field: &'static str,
        /// Its value.
        length: usize,
    },
    /// A range that ends below its start, or that is empty beyond the ends of the arrays that are summed; or a
    /// constraint without sites.
    EmptyRange {
        /// The range of the sum, `i in 0..n-1`; of a constraint or an output, the declaration, `constraint(rod[i in 0..n-1])`.
        ranges: &'static str,
        /// Its first value.
        start: i64,
        /// One past its last value.
        end: i64,
    },
    /// An index outside its array.
    Index {
        /// The array.
        array: &'static str,
        /// The index as declared, `i+1`.
        index: &'static str,
        /// The ranges of the sums that it depends on, after the constraint or output that it stands in.
        ranges: &'static str,
        /// The first value outside the array.
        value: i64,
        /// The length of the array.
        length: usize,
    },
    /// An entry of a list of indices that leads to an index outside its array.
    ListEntry {
        /// The list.
        list: &'static str,
        /// The place in the list of the first such entry.
        place: usize,
        /// The entry.
        entry: usize,
        /// The array.
        array: &'static str,
        /// The index as declared, `left[k]`.
        index: &'static str,
        /// The ranges of the sums that it depends on, after the constraint or output that it stands in.
        ranges: &'static str,
        /// The length of the array.
        length: usize,
    },
    /// An array field that is shorter or longer than its indices require.
    FieldLength {
        /// The field.
        field: &'static str,
        /// Its length.
        length: usize,
        /// The length required by its largest index.
        expected: i64,
        /// That index as declared.
        index: &'static str,
        /// The ranges of the sums that it depends on, after the constraint or output that it stands in.
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
    /// ∂²/∂z∂z has an entry off its diagonal, which only Lagrangians may have, with the feature
    /// `sparse`.
    MassNotDiagonal {
        /// The row of the entry.
        row: usize,
        /// The column of the entry.
        column: usize,
    },
    /// The kinetic energy does not depend on one of the velocities: no velocity belongs to a momentum.
    SingularMass {
        /// The coordinate.
        coordinate: usize,
    },
    /// No velocity belongs to a momentum, or no momentum to a velocity: ∂²/∂z∂z is singular, or values are not finite.
    NoVelocity,
    /// The equations are not of the form M q̈ = f with a constant diagonal M, which is supported only for Lagrangians,
    /// with the feature `sparse`.
    NotSecondOrder,
    /// The element is invalid.
    Element(ElementError),
    /// The element is not a Runge–Kutta method of at most 16 points for this model.
    ElementNotSupported {
        /// The element.
        element: Element,
    },
    /// Newton's method was requested, but the feature `sparse` is off.
    NoNewton,
    /// The fixed-point iteration was requested, but the model can only be solved by Newton's method.
    NeedsNewton,
    /// There are constraints, but the feature `sparse` is off or the model is a Hamiltonian.
    ConstraintsNotSupported,
    /// The elimination ordering of its equations does not fit into memory.
    TooLarge,
}

/// The words before the place of an index: a declaration has parentheses, ranges of sums have none.
fn sum_over(ranges: &str) -> &'static str {
    match ranges.contains('(') {
        true => "",
        false => "the sum over ",
    }
}

impl fmt::Display for ModelError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoElements { array } => write!(f, "the array `{array}` has no elements"),
            Self::Length { field, length } => {
                write!(f, "`{field}` is {length}, but an array cannot have so many elements")
            }
            Self::EmptyRange { ranges, start, end } => {
                let sum = sum_over(ranges);
                let fault = match end < start {
                    true => "ends below its start",
                    false => "is empty",
                };
                write!(f, "{sum}`{ranges}` {fault}: its range is {start}..{end}")
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
                    let sum = sum_over(ranges);
                    write!(f, " in {sum}`{ranges}`")?;
                }
                write!(f, " becomes {value}, but `{array}` has {length} elements")
            }
            Self::ListEntry {
                list,
                place,
                entry,
                array,
                index,
                ranges,
                length,
            } => {
                write!(
                    f,
                    "`{list}[{place}]` is {entry}, so the index of `{array}[{index}]`"
                )?;
                if !ranges.is_empty() {
                    let sum = sum_over(ranges);
                    write!(f, " in {sum}`{ranges}`")?;
                }
                write!(f, " is out of range: `{array}` has {length} elements")
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
                    let sum = sum_over(ranges);
                    write!(f, " in {sum}`{ranges}`")?;
                }
                write!(f, " needs {expected}")
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
                "the mass matrix has an entry off its diagonal, ({row}, {column}): models of run-time length need a diagonal mass matrix, except Lagrangians with the feature `sparse`"
            ),
            Self::SingularMass { coordinate } => write!(
                f,
                "the kinetic energy does not depend on the velocity of coordinate {coordinate}: give it a mass, or leave the coordinate out"
            ),
            Self::NoVelocity => f.write_str(
                "no velocity belongs to the momentum: is the mass matrix singular there?",
            ),
            Self::NotSecondOrder => f.write_str(
                "models of run-time length need a kinetic energy ½ Σ m v² with constant masses; with the feature `sparse`, a Lagrangian can have any kinetic energy",
            ),
            Self::Element(error) => error.fmt(f),
            Self::ElementNotSupported { element } => write!(
                f,
                "`{element}` is not supported for this model of run-time length: use `Mixed`; with the feature `sparse`, Lagrangians without constraints support every element"
            ),
            Self::NoNewton => f.write_str(
                "Newton's method for models of run-time length needs the feature `sparse`: enable it, or use `Solve::Auto`",
            ),
            Self::NeedsNewton => f.write_str(
                "constraints, and kinetic energies other than ½ Σ m v², need Newton's method, which the fixed-point iteration cannot replace: use `Solve::Auto` or `Solve::Newton`",
            ),
            Self::ConstraintsNotSupported => f.write_str(
                "constraints of models of run-time length need the feature `sparse` and a Lagrangian",
            ),
            Self::TooLarge => f.write_str("the equations do not fit into memory: use a smaller model, or an element with fewer nodes"),
        }
    }
}

impl From<ElementError> for ModelError {
    fn from(error: ElementError) -> Self {
        Self::Element(error)
    }
}

impl core::error::Error for ModelError {
    fn source(&self) -> Option<&(dyn core::error::Error + 'static)> {
        match self {
            Self::Element(error) => Some(error),
            _ => None,
        }
    }
}

/// Checks of lengths, indices and ranges, which generated code calls.
#[doc(hidden)]
pub mod checks {
    use super::ModelError;
    use core::cmp::Ordering;

    /// Longer than any array, and small enough that sums of several such lengths do not overflow.
    const LONGEST: i64 = 1 << 40;

    /// Checks that an array may have this length.
    ///
    /// # Errors
    /// [`ModelError::Length`].
    pub fn length(field: &'static str, length: usize) -> Result<(), ModelError> {
        if i64::try_from(length).is_ok_and(|length| length <= LONGEST) {
            return Ok(());
        }
        Err(ModelError::Length { field, length })
    }

    /// Checks that an array of coordinates is not empty.
    ///
    /// # Errors
    /// [`ModelError::NoElements`].
    pub fn elements(array: &'static str, length: usize) -> Result<(), ModelError> {
        if length == 0 {
            return Err(ModelError::NoElements { array });
        }
        Ok(())
    }

    /// Checks that a range is not empty.
    ///
    /// # Errors
    /// [`ModelError::EmptyRange`].
    pub fn turns(ranges: &'static str, start: i64, end: i64) -> Result<(), ModelError> {
        if start >= end {
            return Err(ModelError::EmptyRange { ranges, start, end });
        }
        Ok(())
    }

    /// Checks that the range of a sum does not end below its start. Where it is empty, loops add zero to the given
    /// places of this many coordinates, which therefore have to exist.
    ///
    /// # Errors
    /// [`ModelError::EmptyRange`].
    pub fn terms(
        ranges: &'static str,
        start: i64,
        end: i64,
        (coordinates, places): (i64, &[i64]),
    ) -> Result<(), ModelError> {
        let exist = || places.iter().all(|place| (0..coordinates).contains(place));
        match start.cmp(&end) {
            Ordering::Less => Ok(()),
            Ordering::Equal if exist() => Ok(()),
            _ => Err(ModelError::EmptyRange { ranges, start, end }),
        }
    }

    /// Checks that an index is within its array.
    ///
    /// # Errors
    /// [`ModelError::Index`].
    pub fn index(
        (array, index, ranges): (&'static str, &'static str, &'static str),
        value: i64,
        length: usize,
    ) -> Result<(), ModelError> {
        if usize::try_from(value).is_ok_and(|value| value < length) {
            return Ok(());
        }
        Err(ModelError::Index {
            array,
            index,
            ranges,
            value,
            length,
        })
    }

    /// Checks that an index computed from an entry of a list (its name, the list, the place) is within its array.
    ///
    /// # Errors
    /// [`ModelError::ListEntry`].
    pub fn entry(
        (array, index, ranges): (&'static str, &'static str, &'static str),
        (list, entries, place): (&'static str, &[usize], usize),
        value: i64,
        length: usize,
    ) -> Result<(), ModelError> {
        if usize::try_from(value).is_ok_and(|value| value < length) {
            return Ok(());
        }
        Err(ModelError::ListEntry {
            list,
            place,
            entry: entries.get(place).copied().unwrap_or(usize::MAX),
            array,
            index,
            ranges,
            length,
        })
    }

    /// An entry of a list as a term of an index; entries larger than any length are limited to that.
    #[must_use]
    pub fn small(entry: usize) -> i64 {
        i64::try_from(entry).map_or(LONGEST, |entry| entry.min(LONGEST))
    }

    /// Checks that an array field is as long as the largest of its indices requires: (length, index, ranges) of each,
    /// with a length below zero where a range ends below its start and needs nothing.
    ///
    /// # Errors
    /// [`ModelError::FieldLength`].
    pub fn field_length(
        field: &'static str,
        length: usize,
        uses: &[(i64, &'static str, &'static str)],
    ) -> Result<(), ModelError> {
        match uses.iter().max_by_key(|(expected, ..)| *expected) {
            Some((expected, index, ranges)) => {
                let expected = (*expected).max(0);
                if usize::try_from(expected) == Ok(length) {
                    return Ok(());
                }
                Err(ModelError::FieldLength {
                    field,
                    length,
                    expected,
                    index,
                    ranges,
                })
            }
            None => Ok(()),
        }
    }
}
