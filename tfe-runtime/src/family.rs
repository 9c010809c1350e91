//! Models of run-time length: what a generated family gives the runtime, and how it steps.
//!
//! A family is a model whose number of coordinates is a field of its struct. Its kernels are loops over slices, compiled once for all lengths;
//! second derivatives are told entry by entry, so that nobody holds a matrix of zeros. [`FamilyStepper`] moves a [`FamilyState`] with all points
//! of an element four to a register, as the stepper of fixed-size models does, in time and memory linear in the length; with the feature `sparse` it solves
//! other kinetic energies and constraints with one sparse matrix for the rates at all points.

#[cfg(feature = "sparse")]
mod blocked;
mod dense;
mod error;
mod forces;
mod inertia;
mod kernel;
mod lanes;
#[cfg(feature = "sparse")]
mod newton;
#[cfg(feature = "sparse")]
mod node;
mod pattern;
#[cfg(feature = "sparse")]
mod rates;
mod registers;
#[cfg(feature = "sparse")]
mod rows;
mod space;
mod stepper;
#[cfg(feature = "sparse")]
mod tangent;
#[cfg(feature = "sparse")]
mod transition;
#[cfg(feature = "sparse")]
mod view;

pub use dense::FamilyDense;
pub use error::FamilyError;
pub use pattern::{Pattern, Values};
pub use stepper::{FamilyStepper, FamilySuspended};
#[cfg(feature = "sparse")]
pub use transition::{FamilyTransition, FamilyTransitionError};

use crate::model::{CoordinateName, Facts, Form};
use crate::real::Real;
use alloc::vec;
use alloc::vec::Vec;
use inertia::Legendre;

/// A point of phase space of a family: coordinates and their momenta p = ∂L/∂v, on the heap.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FamilyState {
    /// Generalized coordinates.
    pub q: Vec<f64>,
    /// Generalized momenta.
    pub p: Vec<f64>,
}

/// Where a kernel writes first derivatives: slices as long as the model.
#[derive(Debug)]
pub struct Gradient<'a, R> {
    /// L_v, or H_p.
    pub z: &'a mut [R],
    /// L_q, or H_q.
    pub q: &'a mut [R],
    /// Generalized force Q; written only where [`Facts::forced`] says so.
    pub force: &'a mut [R],
}

/// What a kernel of forces works on: it lends slices, and hears how far the kernel has come.
pub trait Sweep<R> {
    /// Coordinates, velocities or momenta, and the places of L_q (or H_q) and Q; that of L_v is empty.
    fn slices(&mut self) -> (&[R], &[R], Gradient<'_, R>);

    /// The kernel neither reads nor writes below this coordinate any more.
    fn passed(&mut self, below: usize);
}

/// Sites between two words of a kernel about how far it has come: so few that slices of so many sites stay in a cache, so many that a word costs nothing.
pub const STRIDE: usize = 1024;

/// The blocks of second derivatives; z stands for velocities or momenta.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Block {
    /// ∂²/∂z∂z
    ZZ,
    /// ∂²/∂z∂q; row: z.
    ZQ,
    /// ∂²/∂q∂q
    QQ,
    /// ∂Q/∂z; row: the coordinate that the force acts on.
    ForceZ,
    /// ∂Q/∂q
    ForceQ,
    /// A = ∂φ/∂q; row: the number of the constraint.
    Row,
    /// Σ μ ∂²φ/∂q∂q
    Bend,
}

/// Takes second derivatives as a kernel computes them: contributions to entries, in an order that depends on lengths alone.
pub trait Entries<R> {
    /// Adds to one entry of one block.
    fn add(&mut self, block: Block, row: usize, column: usize, value: R);
}

/// The kernels of a model of run-time length.
///
/// Implemented by `#[dynamics]` for models with `coordinates(q[n])`, n a field of type `usize`. All slices are as long as the model. Kernels may be
/// called after [`check`](Self::check) has succeeded; before, they may panic or leave results out.
pub trait FamilyModel {
    /// By which function it was declared.
    const FORM: Form;
    /// What is known about its structure.
    const FACTS: Facts;
    /// Whether ∂/∂z of the energy function holds the time.
    const MOMENTA_MOVE: bool;

    /// The number of coordinates.
    fn len(&self) -> usize;

    /// Whether there is no coordinate.
    fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Whether lengths, ranges and array fields belong together.
    ///
    /// # Errors
    /// [`FamilyError`] names the array, the sum and the index.
    fn check(&self) -> Result<(), FamilyError>;

    /// L(q, v, t), or H(q, p, t).
    fn energy_function<R: Real>(&self, t: R, q: &[R], z: &[R]) -> R;

    /// Its first derivatives, and the generalized force.
    fn first<R: Real>(&self, t: R, q: &[R], z: &[R], first: Gradient<'_, R>);

    /// Whether [`forces_inline`](Self::forces_inline) writes every place of L_q, whatever was there.
    const ASSIGNS: bool = false;

    /// L_q (or H_q) and Q alone, into slices that hold zeros (but L_q with [`ASSIGNS`](Self::ASSIGNS)): whoever reads them last sets them to zero while they are at hand. Written into
    /// the place of the call, so that it is compiled for the instruction set of that place.
    fn forces_inline<R: Real>(&self, t: R, q: &[R], z: &[R], first: Gradient<'_, R>);

    /// The same on slices that are lent, with a word now and then about how far it has come: where more sites than [`STRIDE`] are run through in one
    /// loop.
    #[inline(always)]
    fn forces_in_strides<R: Real, S: Sweep<R>>(&self, t: R, sweep: &mut S) {
        let (q, z, first) = sweep.slices();
        self.forces_inline(t, q, z, first);
    }

    /// The contributions to ∂²/∂z∂z.
    fn mass<R: Real, E: Entries<R>>(&self, t: R, q: &[R], z: &[R], entries: &mut E);

    /// First derivatives and the contributions to all second ones.
    fn second<R: Real, E: Entries<R>>(
        &self,
        t: R,
        q: &[R],
        z: &[R],
        first: Gradient<'_, R>,
        entries: &mut E,
    );

    /// The name of a coordinate: `q[0]`, `q[1]`, …
    fn coordinate_name(&self, index: usize) -> CoordinateName;

    /// Whether there are constraints: holonomic ones, φ(q, t) = 0.
    const CONSTRAINED: bool = false;

    /// The number of constraints, each a row of A.
    ///
    /// They are numbered in order of declaration; one by site has its rows in order of the sites.
    ///
    /// ```text
    /// row = rows of the declarations before it + (i − start)
    /// ```
    fn constraints(&self) -> usize {
        0
    }

    /// The name of a constraint: `rod[0]`, `rod[1]`, …, or `rod` of a single one.
    fn constraint_name(&self, row: usize) -> CoordinateName {
        CoordinateName::element("", row)
    }

    /// φ(q, t), one value a row.
    fn constraint_values<R: Real>(&self, _t: R, _q: &[R], _values: &mut [R]) {}

    /// The contributions to A = ∂φ/∂q in [`Block::Row`], and a = ∂φ/∂t in `drift`, one value a row: zero where the time does not appear.
    fn constraint_rows<R: Real, E: Entries<R>>(
        &self,
        _t: R,
        _q: &[R],
        _drift: &mut [R],
        _entries: &mut E,
    ) {
    }

    /// The contributions to Σ μ ∂²φ/∂q∂q in [`Block::Bend`], those on both sides of the diagonal; one multiplier μ a row.
    fn constraint_second<R: Real, E: Entries<R>>(
        &self,
        _t: R,
        _q: &[R],
        _mu: &[R],
        _entries: &mut E,
    ) {
    }

    /// The names of the observables as declared.
    const OBSERVABLES: &'static [&'static str] = &[];

    /// The number of observables: one for each name, or for each site of a name that is declared by site.
    fn columns(&self) -> usize {
        Self::OBSERVABLES.len()
    }

    /// The name of an observable: `strain[0]`, `strain[1]`, …, or `extension` of a single one.
    fn column_name(&self, column: usize) -> CoordinateName {
        match Self::OBSERVABLES.get(column) {
            Some(name) => CoordinateName::single(name),
            None => CoordinateName::element("", column),
        }
    }

    /// The observables, in order of declaration and of sites.
    fn observables<R: Real>(&self, _t: R, _q: &[R], _z: &[R], _values: &mut [R]) {}
}

/// The state of coordinates and velocities at time `t`.
///
/// Where there is none the velocities stand for the momenta: a run from there says what [`momenta`] would say.
pub fn state<M: FamilyModel>(model: &M, t: f64, q: Vec<f64>, v: Vec<f64>) -> FamilyState {
    match momenta(model, t, &q, &v) {
        Ok(p) => FamilyState { q, p },
        Err(_) => FamilyState { q, p: v },
    }
}

/// The momenta of coordinates and velocities at time `t`.
///
/// # Errors
/// [`FamilyError`] where the model does not fit together, a vector has another length, or no momentum belongs to the velocities.
pub fn momenta<M: FamilyModel>(
    model: &M,
    t: f64,
    q: &[f64],
    v: &[f64],
) -> Result<Vec<f64>, FamilyError> {
    model.check()?;
    let expected = model.len();
    for (vector, length) in [("q", q.len()), ("v", v.len())] {
        if length != expected {
            return Err(FamilyError::StateLength {
                vector,
                length,
                expected,
            });
        }
    }
    match M::FORM {
        Form::Lagrangian => Ok(slope(model, t, q, v)),
        Form::Hamiltonian => Legendre::default().other(model, t, q, v),
    }
}

/// The velocities dq/dt at a state.
///
/// # Errors
/// [`FamilyError::MassNotDiagonal`], [`FamilyError::SingularMass`] of a Lagrangian.
pub fn velocity<M: FamilyModel>(
    model: &M,
    t: f64,
    state: &FamilyState,
) -> Result<Vec<f64>, FamilyError> {
    Legendre::default().velocity(model, t, state)
}

/// The energy H = p·v − L, or H itself, at a state with its velocities.
#[must_use]
pub fn energy<M: FamilyModel>(model: &M, t: f64, state: &FamilyState, v: &[f64]) -> f64 {
    match M::FORM {
        Form::Lagrangian => {
            let work: f64 = state.p.iter().zip(v).map(|(p, v)| p * v).sum();
            work - model.energy_function(t, &state.q, v)
        }
        Form::Hamiltonian => model.energy_function(t, &state.q, &state.p),
    }
}

/// The largest |φ| and the largest |A v + a| over the constraints; zeros where there are none.
#[must_use]
pub fn constraint_residual<M: FamilyModel>(model: &M, t: f64, q: &[f64], v: &[f64]) -> (f64, f64) {
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
    (lanes::largest(&values), lanes::largest(&rates.rates))
}

/// L_v, or H_p.
fn slope<M: FamilyModel>(model: &M, t: f64, q: &[f64], z: &[f64]) -> Vec<f64> {
    let n = model.len();
    let (mut by_z, mut by_q, mut force) = (vec![0.0; n], vec![0.0; n], vec![0.0; n]);
    let first = Gradient {
        z: &mut by_z,
        q: &mut by_q,
        force: &mut force,
    };
    model.first(t, q, z, first);
    by_z
}

/// One of the observables.
///
/// # Errors
/// [`FamilyError`] where the model does not fit together or a vector has another length.
#[doc(hidden)]
pub fn observable<M: FamilyModel>(
    model: &M,
    t: f64,
    q: &[f64],
    z: &[f64],
    number: usize,
) -> Result<f64, FamilyError> {
    let values = observables(model, t, q, z, || (number, 1))?;
    Ok(values.first().copied().unwrap_or(f64::NAN))
}

/// Some observables in a row: `place` says from which one on and how many, once lengths are known to fit.
///
/// # Errors
/// [`FamilyError`] where the model does not fit together or a vector has another length.
#[doc(hidden)]
pub fn observables<M: FamilyModel>(
    model: &M,
    t: f64,
    q: &[f64],
    z: &[f64],
    place: impl Fn() -> (usize, usize),
) -> Result<Vec<f64>, FamilyError> {
    model.check()?;
    let second = match M::FORM {
        Form::Lagrangian => "v",
        Form::Hamiltonian => "p",
    };
    let expected = model.len();
    for (vector, length) in [("q", q.len()), (second, z.len())] {
        if length != expected {
            return Err(FamilyError::StateLength {
                vector,
                length,
                expected,
            });
        }
    }
    let mut values = vec![0.0; model.columns()];
    model.observables(t, q, z, &mut values);
    let (first, count) = place();
    Ok(values.into_iter().skip(first).take(count).collect())
}

/// What generated code checks.
#[doc(hidden)]
pub mod checks {
    use super::FamilyError;

    /// A coordinate array has elements.
    ///
    /// # Errors
    /// [`FamilyError::NoElements`].
    pub fn elements(array: &'static str, length: usize) -> Result<(), FamilyError> {
        if length == 0 {
            return Err(FamilyError::NoElements { array });
        }
        Ok(())
    }

    /// A range has turns.
    ///
    /// # Errors
    /// [`FamilyError::EmptyRange`].
    pub fn turns(ranges: &'static str, start: i64, end: i64) -> Result<(), FamilyError> {
        if start >= end {
            return Err(FamilyError::EmptyRange { ranges, start, end });
        }
        Ok(())
    }

    /// An index stays inside its array.
    ///
    /// # Errors
    /// [`FamilyError::Index`].
    pub fn index(
        (array, index, ranges): (&'static str, &'static str, &'static str),
        value: i64,
        length: usize,
    ) -> Result<(), FamilyError> {
        if usize::try_from(value).is_ok_and(|value| value < length) {
            return Ok(());
        }
        Err(FamilyError::Index {
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
    /// [`FamilyError::ListEntry`].
    pub fn entry(
        (array, index, ranges): (&'static str, &'static str, &'static str),
        (list, entries, place): (&'static str, &[usize], usize),
        value: i64,
        length: usize,
    ) -> Result<(), FamilyError> {
        if usize::try_from(value).is_ok_and(|value| value < length) {
            return Ok(());
        }
        Err(FamilyError::ListEntry {
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
        const LONGEST: i64 = 1 << 40;
        i64::try_from(entry).map_or(LONGEST, |entry| entry.min(LONGEST))
    }

    /// An array field is as long as the largest of its indices asks for: (length, index, ranges) of each.
    ///
    /// # Errors
    /// [`FamilyError::FieldLength`].
    pub fn field_length(
        field: &'static str,
        length: usize,
        uses: &[(i64, &'static str, &'static str)],
    ) -> Result<(), FamilyError> {
        match uses.iter().max_by_key(|(expected, ..)| *expected) {
            Some((expected, index, ranges)) if usize::try_from(*expected) != Ok(length) => {
                Err(FamilyError::FieldLength {
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
