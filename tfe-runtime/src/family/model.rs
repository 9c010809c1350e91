//! The interface between a generated model of run-time length and the runtime.

use crate::consistency::ModelError;
use crate::input::{InputFailure, InputPanicked};
use crate::length::{Declared, RunTimeLength};
use crate::model::{CoordinateName, Facts, Form};
use crate::real::Real;
use alloc::vec;
use alloc::vec::Vec;

/// A point of phase space of a family: coordinates and their momenta p = ∂L/∂v, on the heap.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FamilyState {
    /// Generalized coordinates.
    pub q: Vec<f64>,
    /// Generalized momenta.
    pub p: Vec<f64>,
}

/// The memory into which a kernel writes first derivatives: slices as long as the model.
#[derive(Debug)]
pub struct Gradient<'a, R> {
    /// L_v, or H_p.
    pub z: &'a mut [R],
    /// L_q, or H_q.
    pub q: &'a mut [R],
    /// Generalized force Q; written only if [`Facts::forced`].
    pub force: &'a mut [R],
}

/// Lends slices to a kernel of forces, and is told how far the kernel has come.
pub trait Sweep<R> {
    /// Coordinates, velocities or momenta, and the memory for L_q (or H_q) and Q; that for L_v is empty.
    fn slices(&mut self) -> (&[R], &[R], Gradient<'_, R>);

    /// From now on, the kernel neither reads nor writes below this coordinate.
    fn passed(&mut self, below: usize);
}

/// The number of sites between two calls of [`Sweep::passed`]: so few that their slices stay in a cache, so many that
/// the calls cost nothing.
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

/// Receives second derivatives as a kernel computes them: contributions to entries, in an order that depends on lengths
/// alone.
pub trait Entries<R> {
    /// Adds to one entry of one block.
    fn add(&mut self, block: Block, row: usize, column: usize, value: R);
}

/// The kernels of a model of run-time length.
///
/// `#[dynamics]` implements it for models with `coordinates(q[n])`, where n is a field of type `usize`. All slices are
/// as long as the model. Kernels may be called after [`check`](Self::check) has succeeded; before that, they may panic
/// or give incomplete results.
pub trait Model: Declared<0, Length = RunTimeLength> {
    /// The function by which it was declared.
    const FORM: Form;
    /// What is known about its structure.
    const FACTS: Facts;
    /// Whether ∂/∂z of the energy function depends on the time.
    const MOMENTA_MOVE: bool;

    /// The number of coordinates.
    fn len(&self) -> usize;

    /// Whether there is no coordinate.
    fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Checks that lengths, ranges and array fields are consistent.
    ///
    /// # Errors
    /// [`ModelError`], which names the array, the sum and the index.
    fn check(&self) -> Result<(), ModelError>;

    /// L(q, v, t), or H(q, p, t).
    fn energy_function<R: Real>(&self, t: R, q: &[R], z: &[R]) -> R;

    /// Its first derivatives, and the generalized force.
    fn first<R: Real>(&self, t: R, q: &[R], z: &[R], first: Gradient<'_, R>);

    /// Whether [`forces_inline`](Self::forces_inline) assigns every entry of L_q, whatever its value was.
    const ASSIGNS: bool = false;

    /// L_q (or H_q) and Q alone, added to slices that contain zeros (except L_q with [`ASSIGNS`](Self::ASSIGNS)): the
    /// last reader of the slices sets them to zero while they are in the cache. Inlined into its caller, so that it is
    /// compiled for the instruction set of the caller.
    fn forces_inline<R: Real>(&self, t: R, q: &[R], z: &[R], first: Gradient<'_, R>);

    /// The same on lent slices, with a report now and then of how far it has come, for loops over more than [`STRIDE`]
    /// sites.
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

    /// The number of constraints, each of which is a row of A.
    ///
    /// They are numbered in the order of declaration; a constraint declared by site has its rows in the order of the
    /// sites.
    ///
    /// ```text
    /// row = rows of the declarations before it + (i − start)
    /// ```
    fn constraints(&self) -> usize {
        0
    }

    /// The name of a constraint: `rod[0]`, `rod[1]`, …, or `rod` for a single one.
    fn constraint_name(&self, row: usize) -> CoordinateName {
        CoordinateName::element("", row)
    }

    /// φ(q, t), one value for each row.
    fn constraint_values<R: Real>(&self, _t: R, _q: &[R], _values: &mut [R]) {}

    /// The contributions to A = ∂φ/∂q as [`Block::Row`], and a = ∂φ/∂t in `drift`, one value for each row: zero where
    /// the time does not appear.
    fn constraint_rows<R: Real, E: Entries<R>>(
        &self,
        _t: R,
        _q: &[R],
        _drift: &mut [R],
        _entries: &mut E,
    ) {
    }

    /// The contributions to Σ μ ∂²φ/∂q∂q as [`Block::Bend`], on both sides of the diagonal, with one multiplier μ for
    /// each row.
    fn constraint_second<R: Real, E: Entries<R>>(
        &self,
        _t: R,
        _q: &[R],
        _mu: &[R],
        _entries: &mut E,
    ) {
    }

    /// Passes to `values` what kernels read besides the [parameters](Self::parameters), in the order of the struct:
    /// fields that are lengths, lists of indices, and the numbers of entries of lists and vectors. A suspended run
    /// cannot be resumed with a model that differs in these values. Models with hand-written kernels need not pass
    /// anything.
    fn unnumbered<F: FnMut(u64)>(&self, _values: &mut F) {}

    /// The number of parameters: fields that are numbers, and the elements of fields that are arrays or vectors of
    /// numbers, in the order of the struct. Zero for models with hand-written kernels that do not implement it. In
    /// models that do, [`first`](Self::first) and [`observables`](Self::observables) make each parameter by
    /// [`Real::parameter`], so that it may carry a derivative.
    fn parameters(&self) -> usize {
        0
    }

    /// The name of a parameter, `m` or `k[2]`.
    fn parameter_name(&self, index: usize) -> CoordinateName {
        CoordinateName::element("", index)
    }

    /// The value of a parameter; NaN for an index without parameter.
    fn parameter(&self, _index: usize) -> f64 {
        f64::NAN
    }

    /// The same model with another value of a parameter; `None` for models that cannot be copied, and for an index
    /// without parameter.
    #[must_use]
    fn with_parameter(&self, _index: usize, _value: f64) -> Option<Self>
    where
        Self: Sized,
    {
        None
    }

    /// Whether functions or tables give the inputs of this model ([`Controlled`](crate::family::Controlled)); they need not be
    /// defined at times that are not asked for.
    const GIVEN_INPUTS: bool = false;

    /// Calls `f`, in which the model is evaluated, and returns its result. Models that call user functions for their
    /// inputs catch panics of these; all others only call `f`.
    ///
    /// # Errors
    /// [`InputPanicked`]; what `f` was working on must not be used then.
    fn guarded<T>(&self, f: impl FnOnce() -> T) -> Result<T, InputPanicked>
    where
        Self: Sized,
    {
        Ok(f())
    }

    /// The last value of an input function that was not finite; the call also clears it.
    fn failed_input(&self) -> Option<InputFailure> {
        None
    }

    /// The names of the observables as declared.
    const OBSERVABLES: &'static [&'static str] = &[];

    /// The number of observables: one for each name, or for each site of a name that is declared by site.
    fn columns(&self) -> usize {
        Self::OBSERVABLES.len()
    }

    /// The name of an observable: `strain[0]`, `strain[1]`, …, or `extension` for a single one.
    fn column_name(&self, column: usize) -> CoordinateName {
        match Self::OBSERVABLES.get(column) {
            Some(name) => CoordinateName::single(name),
            None => CoordinateName::element("", column),
        }
    }

    /// The observables, in the order of declaration and of sites.
    fn observables<R: Real>(&self, _t: R, _q: &[R], _z: &[R], _values: &mut [R]) {}
}

/// L_v, or H_p.
pub(super) fn slope<M: Model>(model: &M, t: f64, q: &[f64], z: &[f64]) -> Vec<f64> {
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
