//! What a generated model gives the runtime.
//!
//! A model is declared by its Lagrangian L(q, v, t) or by its Hamiltonian H(q, p, t). The generated
//! kernels evaluate that function and its partial derivatives at one instant; everything else
//! (Legendre transform, elements, Newton) lives in this crate. In the names below **z** stands for the velocity v of a Lagrangian and for the momentum p of a Hamiltonian.

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

/// What the macro found out about a model; the runtime takes shorter ways where it may.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Facts {
    /// The time appears in the energy function or in a force.
    pub time_dependent: bool,
    /// There are generalized forces or dissipation.
    pub forced: bool,
    /// The second derivative by z does not depend on z: one Newton step solves the Legendre transform.
    pub quadratic_in_z: bool,
    /// The second derivative by z is constant (over one run).
    pub constant_mass: bool,
    /// All second derivatives and all derivatives of forces are constant or depend on the time alone.
    pub linear: bool,
    /// The mixed second derivatives ∂²/∂z∂q vanish.
    pub separable: bool,
    /// Nothing is chosen by a sign: no `select`, `abs`, `sign`, `min` or `max`.
    pub smooth: bool,
}

impl Facts {
    /// Nothing is known: every way that holds in general is taken.
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
    /// φ(q, t) = 0: positions are constrained, and with them velocities, A = φ_q, a = φ_t.
    Holonomic {
        /// φ is a polynomial of at most second degree in the coordinates.
        quadratic: bool,
    },
    /// A(q, t) v + a(q, t) = 0: velocities alone are constrained.
    Velocity {
        /// It is the time derivative of some φ(q, t): the macro found ∂A_i/∂q_j = ∂A_j/∂q_i and ∂A_i/∂t = ∂a/∂q_i.
        integrable: bool,
    },
}

impl ConstraintKind {
    /// Whether positions are constrained.
    #[must_use]
    pub const fn is_holonomic(self) -> bool {
        matches!(self, Self::Holonomic { .. })
    }
}

/// The constraints differentiated once more, with one multiplier μ for each; ψ = A v + a.
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
/// Implemented by `#[dynamics]`; by hand where one wants to.
///
/// Every method evaluates at one instant, for one `R`: a number, or lanes of them. `first`,
/// `first_and_mass` and `second` write only entries that can be non-zero and never read what they
/// are given, so pass [`First::ZERO`]-like values: entries that are structurally zero stay as they
/// were.
#[diagnostic::on_unimplemented(
    message = "`{Self}` is not a model of fixed size",
    label = "not a model of fixed size",
    note = "models are structs with `#[dynamics(...)]`; what those with `coordinates(q[n])` have is listed in `docs/calls.md`, all else needs a length known here, such as `q[10]`"
)]
pub trait Model<const N: usize> {
    /// By which function it was declared.
    const FORM: Form;
    /// What is known about its structure.
    const FACTS: Facts;

    /// The ignorable coordinates: nothing that [`first`](Self::first) and [`first_and_mass`](Self::first_and_mass) give depends on them, and no force acts on them, so that their
    /// momenta are constant. Steppers leave them out of the iteration of an element (T-162 of `docs/theory.md`). It is no error to name none.
    const IGNORABLE: [bool; N] = [false; N];

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

    /// Whether [`first_inline`](Self::first_inline) and [`first_and_mass_inline`](Self::first_and_mass_inline) are there for themselves, so that
    /// a stepper may evaluate them at several points at once in the widest registers of the processor.
    const LANES: bool = false;

    /// The same as [`first`](Self::first), written into the place of its call: only there is it compiled for the instruction set of
    /// that place.
    #[inline(always)]
    fn first_inline<R: Real>(&self, t: R, q: &[R; N], z: &[R; N], first: &mut First<R, N>) {
        self.first(t, q, z, first);
    }

    /// The same as [`first_and_mass`](Self::first_and_mass), written into the place of its call.
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

    /// The names of the parameters by which the model can be differentiated: those of `sensitivity(…)`.
    const SENSITIVITIES: &'static [&'static str] = &[];

    /// The value of the parameter `SENSITIVITIES[index]`; NaN beyond them.
    fn sensitivity_parameter(&self, _index: usize) -> f64 {
        f64::NAN
    }

    /// The partial derivatives of everything that [`first`](Self::first) gives by a parameter or by the time: ∂L_z/∂a, ∂L_q/∂a, ∂Q/∂a
    /// (or of H) at fixed (q, z).
    ///
    /// Called only for the parameters of [`SENSITIVITIES`](Self::SENSITIVITIES), and, where there is at least one, for [`By::Time`].
    fn first_by<R: Real>(
        &self,
        _by: By,
        _t: R,
        _q: &[R; N],
        _z: &[R; N],
        _first: &mut First<R, N>,
    ) {
    }

    /// Whether the kernels ask the same functions for what is not a parameter as those of another model of the type do: runs of both may go side by side. Models whose inputs are given
    /// ([`Controlled`](crate::Controlled)) may differ in them.
    fn shares_inputs(&self, _other: &Self) -> bool {
        true
    }

    /// What kernels read beside the [parameters](Self::parameters), to the bit and in the order of the struct: fields that are lengths, and the elements of vectors of numbers, with how many there are.
    /// Models that differ in it do not go side by side, and none goes on where one was suspended that differs in it. Nothing for models of hand-written kernels that do not say.
    fn unnumbered<F: FnMut(u64)>(&self, _values: &mut F) {}

    /// The number of parameters: fields that are numbers, and the elements of fields that are arrays of numbers, in the order of the struct. Zero for models of hand-written
    /// kernels that do not say. Kernels of those that do make each parameter by [`Real::parameter`], so that numbers may carry derivatives by it, or the values of other models.
    fn parameters(&self) -> usize {
        0
    }

    /// The name of a parameter, `m` or `k[2]`.
    fn parameter_name(&self, index: usize) -> CoordinateName {
        CoordinateName::element("", index)
    }

    /// The value of a parameter; NaN beyond them.
    fn parameter(&self, _index: usize) -> f64 {
        f64::NAN
    }

    /// The same model with another value of one parameter; none where a field of some other type cannot be copied, and beyond the parameters.
    fn with_parameter(&self, _index: usize, _value: f64) -> Option<Self>
    where
        Self: Sized,
    {
        None
    }

    /// What `f` gives, in which the model is evaluated. Models that ask functions given at run time for their inputs catch panics of these; all others do nothing else.
    ///
    /// # Errors
    /// [`InputPanicked`]; what `f` was working on is to be left alone then.
    fn guarded<T>(&self, f: impl FnOnce() -> T) -> Result<T, InputPanicked>
    where
        Self: Sized,
    {
        Ok(f())
    }

    /// The last number of a function given for an input that was not finite, which is forgotten then.
    fn failed_input(&self) -> Option<InputFailure> {
        None
    }

    /// The index of the parameter of this name.
    fn find_parameter(&self, name: &str) -> Option<usize> {
        (0..self.parameters()).find(|index| self.parameter_name(*index).is(name))
    }

    /// The constraints, in order.
    const CONSTRAINTS: &'static [Constraint] = &[];

    /// φ of every holonomic constraint, by its position in [`CONSTRAINTS`](Self::CONSTRAINTS); entries of others stay as they are.
    fn constraint_values<R: Real>(&self, _t: R, _q: &[R; N], _values: &mut [R]) {}

    /// A and a of every constraint; for holonomic ones φ_q and φ_t. Writes only entries that can be non-zero.
    fn constraint_rows<R: Real>(&self, _t: R, _q: &[R; N], _rows: &mut [[R; N]], _drift: &mut [R]) {
    }

    /// The derivatives of the constraints that tangents need, at (t, q, v) and for the multipliers μ. Writes only entries that can be
    /// non-zero.
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

    /// The number of observables: one for each name. More or others where a model is made of another one at run time.
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

/// When kernels are asked for what no time changes, as a constant mass matrix, or the places of second derivatives: at a time that is none, for which functions given for inputs are not asked.
pub(crate) const NO_TIME: f64 = f64::NAN;

/// By what the first derivatives of a model are differentiated once more.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum By {
    /// The time t, at fixed (q, z).
    Time,
    /// The parameter with this index in [`Model::SENSITIVITIES`].
    Parameter(usize),
}

/// The name of a coordinate, `theta1` or `q[3]`, or in models of run-time length of a constraint, `rod[3]`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CoordinateName {
    /// The name as declared.
    pub name: &'static str,
    /// The position in an array of coordinates, or the site of a constraint.
    pub index: Option<usize>,
}

impl CoordinateName {
    /// A coordinate of its own.
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

    /// Whether it is printed like this.
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

/// A point of phase space: coordinates and their momenta p = ∂L/∂v.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct State<const N: usize> {
    /// Generalized coordinates.
    pub q: [f64; N],
    /// Generalized momenta.
    pub p: [f64; N],
}
