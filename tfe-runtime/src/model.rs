//! The interface between a generated model and the runtime.
//!
//! A model is declared by its Lagrangian L(q, v, t) or by its Hamiltonian H(q, p, t). The generated
//! kernels evaluate that function and its partial derivatives at one instant; everything else
//! (Legendre transform, elements, Newton) lives in this crate. In the names below **z** stands for the velocity v of a
//! Lagrangian and for the momentum p of a Hamiltonian.

use crate::consistency::ModelError;
use crate::input::{InputFailure, InputPanicked};
use crate::real::Real;

/// First derivatives at one instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct First<R, const N: usize> {
    /// L_v, or H_p.
    pub z: [R; N],
    /// L_q, or H_q.
    pub q: [R; N],
    /// Generalized force Q.
    pub force: [R; N],
}

impl<const N: usize> First<f64, N> {
    /// All derivatives zero.
    pub const ZERO: Self = Self {
        z: [0.0; N],
        q: [0.0; N],
        force: [0.0; N],
    };
}

impl<R: Real, const N: usize> First<R, N> {
    /// All derivatives zero, in any scalar.
    #[must_use]
    pub fn zero() -> Self {
        let zero = [R::from_f64(0.0); N];
        Self {
            z: zero,
            q: zero,
            force: zero,
        }
    }
}

/// Second derivatives at one instant: `zq[a][b]` = ∂²/∂z_a ∂q_b.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Second<R, const N: usize> {
    /// L_vv, or H_pp.
    pub zz: [[R; N]; N],
    /// L_vq, or H_pq.
    pub zq: [[R; N]; N],
    /// L_qq, or H_qq.
    pub qq: [[R; N]; N],
    /// ∂Q/∂z; row: the coordinate that the force acts on.
    pub force_z: [[R; N]; N],
    /// ∂Q/∂q.
    pub force_q: [[R; N]; N],
}

impl<const N: usize> Second<f64, N> {
    /// All derivatives zero.
    pub const ZERO: Self = Self {
        zz: [[0.0; N]; N],
        zq: [[0.0; N]; N],
        qq: [[0.0; N]; N],
        force_z: [[0.0; N]; N],
        force_q: [[0.0; N]; N],
    };
}

impl<R: Real, const N: usize> Second<R, N> {
    /// All derivatives zero, in any scalar.
    #[must_use]
    pub fn zero() -> Self {
        let zero = [[R::from_f64(0.0); N]; N];
        Self {
            zz: zero,
            zq: zero,
            qq: zero,
            force_z: zero,
            force_q: zero,
        }
    }
}

/// The function by which a model was declared.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Form {
    /// L(q, v, t)
    Lagrangian,
    /// H(q, p, t)
    Hamiltonian,
}

impl Form {
    /// Whether it is L(q, v, t). In `if const { … }` a model is compiled for its own form alone.
    pub(crate) const fn is_lagrangian(self) -> bool {
        matches!(self, Self::Lagrangian)
    }
}

/// Structural facts about a model that the macro has determined; they allow the runtime cheaper algorithms.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Facts {
    /// The time appears in the energy function or in a force.
    pub time_dependent: bool,
    /// There are generalized forces or dissipation.
    pub forced: bool,
    /// The second derivative by z does not depend on z: one Newton iteration solves the Legendre transform.
    pub quadratic_in_z: bool,
    /// The second derivative by z is constant (over one run).
    pub constant_mass: bool,
    /// All second derivatives, and all derivatives of forces, are constant or depend on the time only: the equations of
    /// motion are linear.
    pub linear: bool,
    /// The mixed second derivatives ∂²/∂z∂q vanish.
    pub separable: bool,
    /// The energy function, the forces and the constraints have no branches: no `select`, `abs`, `sign`, `min` or `max`.
    pub smooth: bool,
}

impl Facts {
    /// Nothing is known: only algorithms that hold in general are used.
    pub const UNKNOWN: Self = Self {
        time_dependent: true,
        forced: true,
        quadratic_in_z: false,
        constant_mass: false,
        linear: false,
        separable: false,
        smooth: false,
    };
}

/// A constraint of a model: one scalar equation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Constraint {
    /// The name as declared.
    pub name: &'static str,
    /// What kind of equation it is.
    pub kind: ConstraintKind,
}

/// What kind of equation a constraint is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ConstraintKind {
    /// φ(q, t) = 0: a constraint on positions, and thereby on velocities, with A = φ_q and a = φ_t.
    Holonomic {
        /// φ is a polynomial of at most second degree in the coordinates.
        quadratic: bool,
    },
    /// A(q, t) v + a(q, t) = 0: a constraint on velocities only.
    Velocity {
        /// Whether it is, without a factor, the time derivative of some φ(q, t): whether the macro has found
        /// ∂A_i/∂q_j = ∂A_j/∂q_i and ∂A_i/∂t = ∂a/∂q_i.
        integrable: bool,
    },
}

impl ConstraintKind {
    /// Whether it constrains positions.
    #[must_use]
    pub const fn is_holonomic(self) -> bool {
        matches!(self, Self::Holonomic { .. })
    }
}

/// The derivatives of the constraints that the tangent needs, with a multiplier μ for each constraint; ψ = A v + a.
///
/// Rows have the order of [`Model::CONSTRAINTS`].
#[derive(Debug)]
pub struct ConstraintSecond<'a, R, const N: usize> {
    /// ∂ψ/∂q, a row for each constraint.
    pub psi_q: &'a mut [[R; N]],
    /// Ȧ = ∂A/∂q · v + ∂A/∂t, a row for each constraint.
    pub row_rates: &'a mut [[R; N]],
    /// ∂(Aᵀμ)/∂q; row: the component of Aᵀμ.
    pub bend: [[R; N]; N],
    /// ∂(Ȧᵀμ)/∂q
    pub rate_q: [[R; N]; N],
    /// ∂(Ȧᵀμ)/∂v
    pub rate_v: [[R; N]; N],
}

/// The kernels of one model with N coordinates.
///
/// Implemented by `#[dynamics]`, or by hand.
///
/// Every method evaluates at one instant, for one `R`: a number, or several numbers in lanes. `first`, `first_and_mass`
/// and `second` write only entries that can be non-zero, and never read what is in the output. So pass [`First::ZERO`]
/// or the like: structurally zero entries keep the value that they had.
#[diagnostic::on_unimplemented(
    message = "`{Self}` is not a model of fixed size",
    label = "not a model of fixed size",
    note = "models are structs with `#[dynamics(...)]`; `docs/calls.md` lists what models with `coordinates(q[n])` support, all else needs a length known at compile time, such as `q[10]`"
)]
pub trait Model<const N: usize> {
    /// The function by which it was declared.
    const FORM: Form;
    /// What is known about its structure.
    const FACTS: Facts;

    /// The ignorable coordinates: no result of [`first`](Self::first) and [`first_and_mass`](Self::first_and_mass)
    /// depends on them, and no force acts on them, so that their momenta are constant. Steppers leave them out of the
    /// iteration of an element (T-162 of `docs/theory.md`). It is always correct to name none.
    const IGNORABLE: [bool; N] = [false; N];

    /// Whether ∂²/∂z∂z is a diagonal matrix that is constant ([`Facts::constant_mass`]), whatever the parameters:
    /// nothing is compiled that serves other mass matrices. It is always correct to say no; of one coordinate it is
    /// known.
    const DIAGONAL_MASS: bool = false;

    /// L(q, v, t), or H(q, p, t).
    fn energy_function<R: Real>(&self, t: R, q: &[R; N], z: &[R; N]) -> R;

    /// Its first derivatives, and the generalized force.
    fn first<R: Real>(&self, t: R, q: &[R; N], z: &[R; N], first: &mut First<R, N>);

    /// The first derivatives and ∂²/∂z∂z.
    fn first_and_mass<R: Real>(
        &self,
        t: R,
        q: &[R; N],
        z: &[R; N],
        first: &mut First<R, N>,
        zz: &mut [[R; N]; N],
    );

    /// Whether [`first_inline`](Self::first_inline) and [`first_and_mass_inline`](Self::first_and_mass_inline) are
    /// implemented, so that a stepper may evaluate them at several points at once in the widest registers of the
    /// processor.
    const LANES: bool = false;

    /// The same as [`first`](Self::first), inlined into its caller, so that it is compiled for the instruction set of
    /// the caller.
    #[inline(always)]
    fn first_inline<R: Real>(&self, t: R, q: &[R; N], z: &[R; N], first: &mut First<R, N>) {
        self.first(t, q, z, first);
    }

    /// The same as [`first_and_mass`](Self::first_and_mass), inlined into its caller.
    #[inline(always)]
    fn first_and_mass_inline<R: Real>(
        &self,
        t: R,
        q: &[R; N],
        z: &[R; N],
        first: &mut First<R, N>,
        zz: &mut [[R; N]; N],
    ) {
        self.first_and_mass(t, q, z, first, zz);
    }

    /// First and second derivatives together.
    fn second<R: Real>(
        &self,
        t: R,
        q: &[R; N],
        z: &[R; N],
        first: &mut First<R, N>,
        second: &mut Second<R, N>,
    );

    /// Checks fields that are lengths, indices or vectors: that every index which the declaration makes of them is
    /// inside its array, and every vector as long as its largest index requires.
    ///
    /// Whatever takes a model and returns an error checks it once. Kernels do not: those of a model that does not pass
    /// panic, and so may functions of the runtime that evaluate them directly. Models with hand-written kernels need
    /// not implement it.
    ///
    /// # Errors
    /// [`ModelError`], which names the array, the sum and the index.
    fn check(&self) -> Result<(), ModelError> {
        Ok(())
    }

    /// The names of the parameters by which the model can be differentiated: those of `sensitivity(…)`.
    const SENSITIVITIES: &'static [&'static str] = &[];

    /// The value of the parameter `SENSITIVITIES[index]`; NaN for larger indices.
    fn sensitivity_parameter(&self, _index: usize) -> f64 {
        f64::NAN
    }

    /// The partial derivatives of all results of [`first`](Self::first) by a parameter or by the time: ∂L_z/∂a,
    /// ∂L_q/∂a, ∂Q/∂a (or the same of H) at fixed (q, z).
    ///
    /// Called only for the parameters of [`SENSITIVITIES`](Self::SENSITIVITIES), and, where there is at least one, for
    /// [`By::Time`].
    fn first_by<R: Real>(
        &self,
        _by: By,
        _t: R,
        _q: &[R; N],
        _z: &[R; N],
        _first: &mut First<R, N>,
    ) {
    }

    /// Whether functions or tables give the inputs of this model ([`Controlled`](crate::Controlled)); they need not be
    /// defined at times that are not asked for.
    const GIVEN_INPUTS: bool = false;

    /// Whether the kernels of this model and of another one of the same type use the same functions for their inputs,
    /// so that runs of both may be made side by side. Only models with given inputs ([`Controlled`](crate::Controlled))
    /// can differ in them.
    fn shares_inputs(&self, _other: &Self) -> bool {
        true
    }

    /// Passes to `report` the times at which [given](Self::GIVEN_INPUTS) inputs have kinks or jumps: elements should end
    /// there.
    fn breaks_of_inputs<F: FnMut(f64)>(&self, _report: &mut F) {}

    /// Passes to `values` the bits of everything that kernels read besides the [parameters](Self::parameters), in the
    /// order of the struct: fields that are lengths, and the elements of vectors of numbers, with their number. Models
    /// that differ in these values cannot be stepped side by side, nor can a suspended run be resumed with a model that
    /// differs in them. Models with hand-written kernels need not pass anything.
    fn unnumbered<F: FnMut(u64)>(&self, _values: &mut F) {}

    /// The number of parameters: fields that are numbers, and the elements of fields that are arrays of numbers, in the
    /// order of the struct. Zero for models with hand-written kernels that do not implement it. Kernels of models that
    /// do make each parameter by [`Real::parameter`], so that it may carry a derivative, or the values of several
    /// models.
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

    /// The same model with another value of one parameter; `None` if a field of some other type cannot be copied, and
    /// for an index without parameter.
    fn with_parameter(&self, _index: usize, _value: f64) -> Option<Self>
    where
        Self: Sized,
    {
        None
    }

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

    /// The index of the parameter of this name.
    fn find_parameter(&self, name: &str) -> Option<usize> {
        (0..self.parameters()).find(|index| self.parameter_name(*index).is(name))
    }

    /// The constraints, in order.
    const CONSTRAINTS: &'static [Constraint] = &[];

    /// φ of every holonomic constraint, at its index in [`CONSTRAINTS`](Self::CONSTRAINTS); entries of others are left
    /// unchanged.
    fn constraint_values<R: Real>(&self, _t: R, _q: &[R; N], _values: &mut [R]) {}

    /// A and a of every constraint; φ_q and φ_t for holonomic ones. Writes only entries that can be non-zero.
    fn constraint_rows<R: Real>(&self, _t: R, _q: &[R; N], _rows: &mut [[R; N]], _drift: &mut [R]) {
    }

    /// The derivatives of the constraints that the tangent needs, at (t, q, v) and for the multipliers μ. Writes only
    /// entries that can be non-zero.
    fn constraint_second<R: Real>(
        &self,
        _t: R,
        _q: &[R; N],
        _v: &[R; N],
        _mu: &[R],
        _second: &mut ConstraintSecond<'_, R, N>,
    ) {
    }

    /// The names of the coordinates, in order (`theta1`, `q[0]`, `q[1]`, …).
    fn coordinate_name(index: usize) -> CoordinateName;

    /// The names of the observables as declared.
    const OBSERVABLES: &'static [&'static str] = &[];

    /// The number of observables: one for each name. Models made from another model at run time may have a different
    /// number.
    fn columns(&self) -> usize {
        Self::OBSERVABLES.len()
    }

    /// The name of an observable.
    fn column_name(&self, column: usize) -> CoordinateName {
        match Self::OBSERVABLES.get(column) {
            Some(name) => CoordinateName::single(name),
            None => CoordinateName::element("", column),
        }
    }

    /// The observables, one for each column.
    fn observables<R: Real>(&self, _t: R, _q: &[R; N], _z: &[R; N], _values: &mut [R]) {}
}

/// The time at which kernels are called for what does not depend on the time, such as a constant mass matrix or the
/// sparsity pattern. It is NaN, for which input functions are not called.
pub(crate) const NO_TIME: f64 = f64::NAN;

/// The variable by which the first derivatives of a model are differentiated once more.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum By {
    /// The time t, at fixed (q, z).
    Time,
    /// The parameter with this index in [`Model::SENSITIVITIES`].
    Parameter(usize),
}

/// The name of a coordinate, `theta1` or `q[3]`; in models of run-time length also of a constraint, `rod[3]`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CoordinateName {
    /// The name as declared.
    pub name: &'static str,
    /// The position in an array of coordinates, or the site of a constraint.
    pub index: Option<usize>,
}

impl CoordinateName {
    /// A scalar coordinate.
    #[must_use]
    pub const fn single(name: &'static str) -> Self {
        Self { name, index: None }
    }

    /// An element of an array of coordinates.
    #[must_use]
    pub const fn element(name: &'static str, index: usize) -> Self {
        Self {
            name,
            index: Some(index),
        }
    }

    /// Whether it is printed as this text.
    #[must_use]
    pub fn is(&self, text: &str) -> bool {
        struct Rest<'a>(&'a str);

        impl core::fmt::Write for Rest<'_> {
            fn write_str(&mut self, part: &str) -> core::fmt::Result {
                self.0 = self.0.strip_prefix(part).ok_or(core::fmt::Error)?;
                Ok(())
            }
        }

        let mut rest = Rest(text);
        core::fmt::write(&mut rest, format_args!("{self}")).is_ok() && rest.0.is_empty()
    }
}

impl core::fmt::Display for CoordinateName {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self.index {
            None => f.write_str(self.name),
            Some(index) => write!(f, "{}[{index}]", self.name),
        }
    }
}

/// A point of phase space: coordinates and their momenta p = ∂L/∂v, in the units of the model. The method `state` that
/// `#[dynamics]` gives a model makes one from coordinates and velocities.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct State<const N: usize> {
    /// Generalized coordinates.
    pub q: [f64; N],
    /// Generalized momenta.
    pub p: [f64; N],
}
