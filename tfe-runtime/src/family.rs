//! Models of run-time length: what a generated family gives the runtime, and how it steps.
//!
//! A family is a model whose number of coordinates is a field of its struct. Its kernels are loops over slices, compiled once for all lengths;
//! second derivatives are told entry by entry, so that nobody holds a matrix of zeros. [`Stepper`] moves a [`FamilyState`] with all points
//! of an element four to a register, as the stepper of fixed-size models does, in time and memory linear in the length; with the feature `sparse` it solves
//! other kinetic energies and constraints with one sparse matrix for the rates at all points.

#[cfg(feature = "sparse")]
mod backwards;
#[cfg(feature = "sparse")]
mod blocked;
mod controlled;
mod dense;
mod error;
mod forces;
#[cfg(feature = "sparse")]
mod held;
mod inertia;
#[cfg(feature = "sparse")]
mod instant;
mod kernel;
#[cfg(feature = "sparse")]
mod kick;
mod lanes;
mod model;
#[cfg(feature = "sparse")]
mod newton;
#[cfg(feature = "sparse")]
mod node;
mod pattern;
#[cfg(feature = "sparse")]
mod point;
#[cfg(feature = "sparse")]
mod projection;
#[cfg(feature = "sparse")]
mod rates;
mod registers;
#[cfg(feature = "sparse")]
mod rows;
mod running;
mod scale;
mod space;
#[cfg(feature = "sparse")]
mod start;
mod stepper;
#[cfg(feature = "sparse")]
mod tangent;
#[cfg(feature = "sparse")]
mod transition;
#[cfg(feature = "sparse")]
mod view;

#[cfg(feature = "sparse")]
pub use backwards::Backwards;
pub use controlled::Controlled;
pub use dense::DenseElement;
pub use error::ModelError;
#[cfg(feature = "sparse")]
pub use kick::Kick;
pub use model::{Block, Entries, FamilyState, Gradient, Model, STRIDE, Sweep};
pub use pattern::{Pattern, Values};
pub use stepper::{Stepper, Suspended};
#[cfg(feature = "sparse")]
pub use transition::{OperatorError, TransitionOperator};

#[cfg(feature = "std")]
use crate::enclosure::Enclosure;
use crate::legendre::largest;
use crate::model::Form;
use alloc::vec;
use alloc::vec::Vec;
use inertia::Legendre;
use model::slope;

/// The state of coordinates and velocities at time `t`.
///
/// Where there is none the velocities stand for the momenta: a run from there says what [`momenta`] would say.
pub fn state<M: Model>(model: &M, t: f64, q: Vec<f64>, v: Vec<f64>) -> FamilyState {
    match momenta(model, t, &q, &v) {
        Ok(p) => FamilyState { q, p },
        Err(_) => FamilyState { q, p: v },
    }
}

/// The momenta of coordinates and velocities at time `t`.
///
/// # Errors
/// [`ModelError`] where the model does not fit together, a vector has another length, or no momentum belongs to the velocities.
pub fn momenta<M: Model>(model: &M, t: f64, q: &[f64], v: &[f64]) -> Result<Vec<f64>, ModelError> {
    model.check()?;
    check_lengths(model, [("q", q.len()), ("v", v.len())])?;
    match M::FORM {
        Form::Lagrangian => Ok(slope(model, t, q, v)),
        Form::Hamiltonian => Legendre::default().other(model, t, q, v),
    }
}

/// The velocities dq/dt at a state of a model that has been [checked](Model::check).
///
/// # Errors
/// [`ModelError::StateLength`]; of a Lagrangian [`ModelError::MassNotDiagonal`], [`ModelError::SingularMass`], [`ModelError::NoVelocity`].
pub fn velocity<M: Model>(model: &M, t: f64, state: &FamilyState) -> Result<Vec<f64>, ModelError> {
    check_lengths(model, [("q", state.q.len()), ("p", state.p.len())])?;
    Legendre::default().velocity(model, t, state)
}

/// Refuses vectors that are not as long as the model.
fn check_lengths<M: Model>(
    model: &M,
    vectors: [(&'static str, usize); 2],
) -> Result<(), ModelError> {
    let expected = model.len();
    match vectors.into_iter().find(|(_, length)| *length != expected) {
        None => Ok(()),
        Some((vector, length)) => Err(ModelError::StateLength {
            vector,
            length,
            expected,
        }),
    }
}

/// The velocities that constraints leave of a momentum: L_v(q, v, t) + Aᵀν = p, A v + a = 0 (T-74). Without constraints, [`velocity`].
///
/// # Errors
/// [`ModelError::NoVelocity`] where there are none, [`ModelError::StateLength`], [`ModelError::ConstraintsNotSupported`] without the feature `sparse`.
pub fn allowed_velocity<M: Model>(
    model: &M,
    t: f64,
    state: &FamilyState,
) -> Result<Vec<f64>, ModelError> {
    check_lengths(model, [("q", state.q.len()), ("p", state.p.len())])?;
    if !M::CONSTRAINED {
        return velocity(model, t, state);
    }
    #[cfg(feature = "sparse")]
    return match instant::Instant::new(model) {
        Some(mut instant) => instant.velocity(model, t, state),
        None => Err(ModelError::TooLarge),
    };
    #[cfg(not(feature = "sparse"))]
    Err(ModelError::ConstraintsNotSupported)
}

/// The reactions λ of the constraints at a state with its velocities, one for each row; the forces on the coordinates are Aᵀλ (T-77). None where there are none to be had: rows that depend on
/// each other, a kinetic energy that is singular for motions that the constraints allow, and always without the feature `sparse`.
#[must_use]
pub fn reactions<M: Model>(model: &M, t: f64, q: &[f64], v: &[f64]) -> Option<Vec<f64>> {
    #[cfg(feature = "sparse")]
    return instant::Instant::new(model)?
        .reactions(model, (t, q), v)
        .ok();
    #[cfg(not(feature = "sparse"))]
    {
        let _ = (model, t, q, v);
        None
    }
}

/// The energy H = p·v − L, or H itself, at a state with its velocities.
///
/// # Panics
/// Where a vector is shorter than the model.
#[must_use]
pub fn energy<M: Model>(model: &M, t: f64, state: &FamilyState, v: &[f64]) -> f64 {
    energy_at(model, t, (&state.q, &state.p), v)
}

/// The same at coordinates and momenta.
#[must_use]
pub fn energy_at<M: Model>(model: &M, t: f64, (q, p): (&[f64], &[f64]), v: &[f64]) -> f64 {
    match M::FORM {
        Form::Lagrangian => {
            let work: f64 = p.iter().zip(v).map(|(p, v)| p * v).sum();
            work - model.energy_function(t, q, v)
        }
        Form::Hamiltonian => model.energy_function(t, q, p),
    }
}

/// What [`energy_at`] may be rounded by, as [`legendre::energy_rounding`](crate::legendre::energy_rounding).
#[cfg(feature = "std")]
#[must_use]
#[cold]
pub fn energy_rounding<M: Model>(model: &M, t: f64, (q, p): (&[f64], &[f64]), v: &[f64]) -> f64 {
    let z = match M::FORM {
        Form::Lagrangian => v,
        Form::Hamiltonian => p,
    };
    let exactly = |x: &f64| Enclosure::between(*x, *x);
    let exact = |values: &[f64]| -> Vec<Enclosure> { values.iter().map(exactly).collect() };
    let bounds = model.energy_function(exactly(&t), &exact(q), &exact(z));
    bounds.width()
}

/// The largest |φ| and the largest |A v + a| over the constraints; zeros where there are none.
///
/// # Panics
/// Where a vector is shorter than the model.
#[must_use]
pub fn constraint_residual<M: Model>(model: &M, t: f64, q: &[f64], v: &[f64]) -> (f64, f64) {
    struct Rates<'a> {
        v: &'a [f64],
        rates: Vec<f64>,
    }
    impl Entries<f64> for Rates<'_> {
        fn add(&mut self, _: Block, row: usize, column: usize, value: f64) {
            self.rates[row] += value * self.v[column];
        }
    }
    let count = model.constraints();
    let (mut values, mut drift) = (vec![0.0; count], vec![0.0; count]);
    let rates = vec![0.0; count];
    let mut rates = Rates { v, rates };
    model.constraint_values(t, q, &mut values);
    model.constraint_rows(t, q, &mut drift, &mut rates);
    for (rate, drift) in rates.rates.iter_mut().zip(&drift) {
        *rate += drift;
    }
    (largest(&values), largest(&rates.rates))
}

/// One of the observables.
///
/// # Errors
/// [`ModelError`] where the model does not fit together or a vector has another length.
#[doc(hidden)]
pub fn observable<M: Model>(
    model: &M,
    t: f64,
    q: &[f64],
    z: &[f64],
    number: usize,
) -> Result<f64, ModelError> {
    let values = observables(model, t, q, z, || (number, 1))?;
    Ok(values.first().copied().unwrap_or(f64::NAN))
}

/// Some observables in a row: `place` says from which one on and how many, once lengths are known to fit.
///
/// # Errors
/// [`ModelError`] where the model does not fit together or a vector has another length.
#[doc(hidden)]
pub fn observables<M: Model>(
    model: &M,
    t: f64,
    q: &[f64],
    z: &[f64],
    place: impl Fn() -> (usize, usize),
) -> Result<Vec<f64>, ModelError> {
    model.check()?;
    let second = match M::FORM {
        Form::Lagrangian => "v",
        Form::Hamiltonian => "p",
    };
    check_lengths(model, [("q", q.len()), (second, z.len())])?;
    let mut values = vec![0.0; model.columns()];
    model.observables(t, q, z, &mut values);
    let (first, count) = place();
    Ok(values.into_iter().skip(first).take(count).collect())
}

/// What generated code checks.
#[doc(hidden)]
pub mod checks {
    use super::ModelError;

    /// Longer than any array: sums of some such lengths do not overflow.
    const LONGEST: i64 = 1 << 40;

    /// A length is one that an array may have.
    ///
    /// # Errors
    /// [`ModelError::Length`].
    pub fn length(field: &'static str, length: usize) -> Result<(), ModelError> {
        if i64::try_from(length).is_ok_and(|length| length <= LONGEST) {
            return Ok(());
        }
        Err(ModelError::Length { field, length })
    }

    /// A coordinate array has elements.
    ///
    /// # Errors
    /// [`ModelError::NoElements`].
    pub fn elements(array: &'static str, length: usize) -> Result<(), ModelError> {
        if length == 0 {
            return Err(ModelError::NoElements { array });
        }
        Ok(())
    }

    /// A range has turns.
    ///
    /// # Errors
    /// [`ModelError::EmptyRange`].
    pub fn turns(ranges: &'static str, start: i64, end: i64) -> Result<(), ModelError> {
        if start >= end {
            return Err(ModelError::EmptyRange { ranges, start, end });
        }
        Ok(())
    }

    /// An index stays inside its array.
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

    /// An index made of an entry of a list (its name, the list, the place) stays inside its array.
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

    /// An entry of a list as a summand: larger ones than any array is long count as that.
    #[must_use]
    pub fn small(entry: usize) -> i64 {
        i64::try_from(entry).map_or(LONGEST, |entry| entry.min(LONGEST))
    }

    /// An array field is as long as the largest of its indices asks for: (length, index, ranges) of each.
    ///
    /// # Errors
    /// [`ModelError::FieldLength`].
    pub fn field_length(
        field: &'static str,
        length: usize,
        uses: &[(i64, &'static str, &'static str)],
    ) -> Result<(), ModelError> {
        match uses.iter().max_by_key(|(expected, ..)| *expected) {
            Some((expected, index, ranges)) if usize::try_from(*expected) != Ok(length) => {
                Err(ModelError::FieldLength {
                    field,
                    length,
                    expected: *expected,
                    index,
                    ranges,
                })
            }
            _ => Ok(()),
        }
    }
}
