//! Models of run-time length: the traits that generated families implement, and their stepper.
//!
//! A family is a model whose number of coordinates is a field of its struct. Its kernels are loops over slices,
//! compiled once for all lengths; they report second derivatives entry by entry, so that no dense matrix is stored.
//! [`Stepper`] moves a [`FamilyState`] with four points of an element in each register, as the stepper of fixed-size
//! models does, in time and memory linear in the length. With the feature `sparse`, models with other kinetic energies
//! or with constraints are solved by one sparse matrix for the rates at all points.

#[cfg(feature = "sparse")]
mod allowed;
#[cfg(feature = "sparse")]
mod at_rest;
#[cfg(feature = "sparse")]
mod backwards;
#[cfg(feature = "sparse")]
mod blocked;
mod controlled;
mod dense;
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
mod settling;
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
pub use allowed::{Allowed, nearest};
#[cfg(feature = "sparse")]
pub use backwards::Backwards;
pub use controlled::Controlled;
pub use dense::DenseElement;
#[cfg(feature = "sparse")]
pub use kick::Kick;
pub use model::{Block, Entries, FamilyState, Gradient, Model, STRIDE, Sweep};
pub use pattern::{Pattern, Values};
pub use stepper::{Stepper, Suspended};
#[cfg(feature = "sparse")]
pub use transition::{OperatorError, TransitionOperator};

pub use crate::consistency::ModelError;
#[cfg(feature = "std")]
use crate::enclosure::Enclosure;
use crate::legendre::largest;
use crate::model::Form;
use alloc::vec;
use alloc::vec::Vec;
use inertia::Legendre;
use model::slope;

/// The state that belongs to coordinates and velocities at time `t`.
///
/// If no momenta can be found, the velocities are stored in their place: a run from that state reports the error that
/// [`momenta`] would report.
pub fn state<M: Model>(model: &M, t: f64, q: Vec<f64>, v: Vec<f64>) -> FamilyState {
    match momenta(model, t, &q, &v) {
        Ok(p) => FamilyState { q, p },
        Err(_) => FamilyState { q, p: v },
    }
}

/// The momenta that belong to coordinates and velocities at time `t`.
///
/// # Errors
/// [`ModelError`] if the model is inconsistent, a vector has another length, or no momenta belong to the velocities.
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

/// The velocities that belong to a momentum under constraints: L_v(q, v, t) + Aᵀν = p, A v + a = 0 (T-74). Without
/// constraints, [`velocity`].
///
/// # Errors
/// [`ModelError::NoVelocity`] if none are found, [`ModelError::StateLength`], [`ModelError::ConstraintsNotSupported`]
/// without the feature `sparse`.
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

/// The reactions λ of the constraints at a state with its velocities, one for each row; the forces on the coordinates
/// are Aᵀλ (T-77). `None` where they cannot be computed: where rows are linearly dependent or the kinetic energy is
/// singular for motions that the constraints allow, and always without the feature `sparse`.
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
/// If a vector is shorter than the model.
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

/// The possible rounding error of [`energy_at`]; see [`legendre::energy_rounding`](crate::legendre::energy_rounding).
#[cfg(feature = "std")]
#[must_use]
#[cold]
pub fn energy_rounding<M: Model>(model: &M, t: f64, (q, p): (&[f64], &[f64]), v: &[f64]) -> f64 {
    let z = match M::FORM {
        Form::Lagrangian => v,
        Form::Hamiltonian => p,
    };
    let bounds = model.energy_function(exactly(&t), &exact(q), &exact(z));
    bounds.width()
}

/// A bound of the rounding errors of forces that reactions balance; see
/// [`constrained::reaction_rounding`](crate::constrained::reaction_rounding).
#[must_use]
#[cold]
pub fn reaction_rounding<M: Model>(model: &M, t: f64, q: &[f64], v: &[f64]) -> f64 {
    #[cfg(feature = "sparse")]
    return at_rest::reaction_rounding(model, t, q, v);
    #[cfg(not(feature = "sparse"))]
    {
        let _ = (model, t, q, v);
        0.0
    }
}

/// What rounding errors of the balance of forces may change of the energy in a time h, (t, h) being `times`; see
/// [`constrained::work_of_roundings`](crate::constrained::work_of_roundings).
#[must_use]
#[cold]
pub fn work_of_roundings<M: Model>(model: &M, times: (f64, f64), q: &[f64], v: &[f64]) -> f64 {
    #[cfg(feature = "sparse")]
    return at_rest::work_of_roundings(model, times, q, v);
    #[cfg(not(feature = "sparse"))]
    {
        let _ = (model, times, q, v);
        0.0
    }
}

/// The possible rounding error of forces; see [`legendre::force_rounding`](crate::legendre::force_rounding).
#[cfg(feature = "std")]
#[must_use]
#[cold]
pub fn force_rounding<M: Model>(model: &M, t: f64, (q, p): (&[f64], &[f64]), v: &[f64]) -> f64 {
    let z = match M::FORM {
        Form::Lagrangian => v,
        Form::Hamiltonian => p,
    };
    let zeros = || vec![Enclosure::ZERO; q.len()];
    let (mut by_z, mut by_q, mut force) = (zeros(), zeros(), zeros());
    let first = Gradient {
        z: &mut by_z,
        q: &mut by_q,
        force: &mut force,
    };
    model.first(exactly(&t), &exact(q), &exact(z), first);
    let bounds = by_q.iter().chain(&force);
    bounds.map(|bounds| bounds.width()).fold(0.0, f64::max)
}

#[cfg(feature = "std")]
fn exactly(x: &f64) -> Enclosure {
    Enclosure::between(*x, *x)
}

#[cfg(feature = "std")]
fn exact(values: &[f64]) -> Vec<Enclosure> {
    values.iter().map(exactly).collect()
}

/// The largest |φ| and the largest |A v + a| over all constraints; zeros if there are none.
///
/// # Panics
/// If a vector is shorter than the model.
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
/// [`ModelError`] if the model is inconsistent or a vector has another length.
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

/// Several consecutive observables: `place` gives the first one and their number, once lengths are known to agree.
///
/// # Errors
/// [`ModelError`] if the model is inconsistent or a vector has another length.
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
