//! Modal reduction: a small model from the lowest modes of a large linear one.

mod diagonal;
mod eigen;
mod error;
mod full;

use std::fmt;
use std::marker::PhantomData;
use tfe_runtime::family::FamilyState;
use tfe_runtime::{CoordinateName, Facts, First, Form, Model, Real, Second, State};

use crate::work_precision::PhasePoint;
use eigen::Modes;

pub use error::ModalError;
pub use full::Reducible;

/// The reduction of a linear model to its `R` lowest modes: itself a model, whose coordinates are the modal amplitudes
/// a.
///
/// ```text
/// q = q_s + Φ a ,     K Φ = M Φ diag(ω²) ,     Φᵀ M Φ = 1                        (T-112)
///
/// L = ½ Σ (ȧ_k² − ω_k² a_k²) + f·a                                               (T-113)
/// ```
///
/// Here Φ holds the mass-normalised mode shapes and ω the natural frequencies, and q_s is the static equilibrium. If a
/// force acts on a rigid-body mode (ω = 0), there is no equilibrium in that direction; the force is f and accelerates
/// the mode.
///
/// The full model has run-time length, or fixed size with `S` its `State<N>`. Its matrices are dense here: n² numbers,
/// and a computing time of order n³, once.
///
/// The outputs are those of the full model, so that motions of both have the same columns, and both can be compared by
/// [`Fidelity`](crate::Fidelity).
///
/// ```
/// use tfe::prelude::*;
///
/// #[dynamics(
///     coordinates(q[n]),
///     lagrangian = sum(i in 0..n, m/2*dot(q[i])^2)
///         - k/2*q[0]^2 - k/2*q[n-1]^2 - sum(i in 0..n-1, k/2*(q[i+1]-q[i])^2),
///     output(middle) = q[centre],
/// )]
/// struct Row { n: usize, centre: usize, m: f64, k: f64 }
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let row = Row { n: 51, centre: 25, m: 0.5, k: 2.0 };
/// let reduced: Modal<'_, Row, 4> = Modal::of(&row)?;
/// let lowest = 2.0 * (row.k / row.m).sqrt() * (std::f64::consts::PI / 104.0).sin();
/// assert!((reduced.frequencies()[0] / lowest - 1.0).abs() < 1e-12);
///
/// // A parabola is nearly the first mode.
/// let shape: Vec<f64> = (1..=51).map(|i| f64::from(i * (52 - i)) / 676.0).collect();
/// let start = reduced.reduce(&row.state(shape, vec![0.0; 51]));
/// let motion = Simulation::new(&reduced).step(0.5).run(start, 0.0..100.0)?;
/// let middle = motion.outputs().column("middle").ok_or("the row declares it")?;
/// assert!((middle[0] - 1.0).abs() < 0.01);
/// # Ok(())
/// # }
/// ```
pub struct Modal<'m, M, const R: usize, S = FamilyState> {
    full: &'m M,
    /// The squared frequencies ω².
    squares: [f64; R],
    /// The modal forces f.
    load: [f64; R],
    /// The mode shapes φ_k, concatenated.
    shapes: Vec<Vec<f64>>,
    /// The momenta M φ_k.
    momenta: Vec<Vec<f64>>,
    /// The static solution q_s.
    rest: Vec<f64>,
    /// The constant part of the momenta.
    offset: Vec<f64>,
    /// The energy at q_s with zero velocity.
    energy_at_rest: f64,
    state: PhantomData<fn() -> S>,
}

impl<'m, M: Reducible<S>, S: PhasePoint, const R: usize> Modal<'m, M, R, S> {
    /// The reduction to the `R` modes of least ω².
    ///
    /// # Errors
    /// [`ModalError::NotLinear`], [`TimeDependent`](ModalError::TimeDependent), [`Forced`](ModalError::Forced) (forces or
    /// dissipation), [`Constrained`](ModalError::Constrained) or [`VelocityCoupling`](ModalError::VelocityCoupling)
    /// (products of coordinates and velocities) for a model without modes of this kind;
    /// [`MassNotPositive`](ModalError::MassNotPositive), [`NotFinite`](ModalError::NotFinite) or
    /// [`NoEigenvalues`](ModalError::NoEigenvalues) for its matrices; [`Modes`](ModalError::Modes) if `R` is zero or more
    /// than there are coordinates; [`Family`](ModalError::Family) if the model does not pass its check.
    pub fn of(full: &'m M) -> Result<Self, ModalError> {
        let quadratic = full.quadratic()?;
        let coordinates = quadratic.slope_q.len();
        if R == 0 || R > coordinates {
            return Err(ModalError::Modes {
                modes: R,
                coordinates,
            });
        }
        let Modes {
            squares,
            shapes,
            momenta,
            load,
            rest,
        } = quadratic.modes()?;
        let mut lowest = Self {
            full,
            squares: [0.0; R],
            load: [0.0; R],
            shapes: shapes.into_iter().take(R).collect(),
            momenta: momenta.into_iter().take(R).collect(),
            energy_at_rest: full.energy_at(&rest, &quadratic.offset),
            offset: quadratic.offset,
            rest,
            state: PhantomData,
        };
        lowest.squares.copy_from_slice(&squares[..R]);
        lowest.load.copy_from_slice(&load[..R]);
        Ok(lowest)
    }

    /// The modal amplitudes and rates of a state of the full model: a = Φᵀ M (q − q_s) and ȧ = Φᵀ (p − c), with c the
    /// momentum at zero velocity (T-114).
    ///
    /// NaN, with which no run begins, if the lengths of the state and the model differ.
    pub fn reduce(&self, state: &S) -> State<R> {
        let n = self.rest.len();
        if state.q().len() != n || state.p().len() != n {
            return State {
                q: [f64::NAN; R],
                p: [f64::NAN; R],
            };
        }
        let mut reduced = State {
            q: [0.0; R],
            p: [0.0; R],
        };
        for k in 0..R {
            reduced.q[k] = product(&self.momenta[k], state.q(), &self.rest);
            reduced.p[k] = product(&self.shapes[k], state.p(), &self.offset);
        }
        reduced
    }

    /// The state of the full model that belongs to given amplitudes and rates: the inverse of
    /// [`reduce`](Self::reduce).
    pub fn expand(&self, state: &State<R>) -> S {
        let q = combination(&self.rest, &self.shapes, &state.q);
        let p = combination(&self.offset, &self.momenta, &state.p);
        M::state_of(q, p)
    }
}

impl<M, S, const R: usize> Modal<'_, M, R, S> {
    /// The natural frequencies ω, in radians per unit of time, the lowest first; zero for a rigid-body mode, and
    /// −√|ω²| for an unstable mode, ω² < 0.
    pub fn frequencies(&self) -> [f64; R] {
        self.squares
            .map(|square| square.abs().sqrt().copysign(square))
    }

    /// The shape φ_k of a mode, one entry for each coordinate of the full model, normalised to φ_k·M φ_k = 1 and with
    /// its largest entry positive; `None` if there is no such mode.
    pub fn shape(&self, k: usize) -> Option<&[f64]> {
        self.shapes.get(k).map(Vec::as_slice)
    }

    /// The coordinates q_s of the static equilibrium; if there is none, those without the rigid-body modes on which a
    /// force acts.
    pub fn equilibrium(&self) -> &[f64] {
        &self.rest
    }
}

/// a·(x − x₀)
fn product(a: &[f64], x: &[f64], x0: &[f64]) -> f64 {
    let terms = a.iter().zip(x).zip(x0);
    terms.map(|((a, x), x0)| a * (x - x0)).sum()
}

/// x₀ + Σ columns_k a_k
fn combination<T: Real>(x0: &[f64], columns: &[Vec<f64>], a: &[T]) -> Vec<T> {
    let mut x: Vec<T> = x0.iter().map(|x0| T::from_f64(*x0)).collect();
    for (column, a) in columns.iter().zip(a) {
        for (x, entry) in x.iter_mut().zip(column) {
            *x += T::from_f64(*entry) * *a;
        }
    }
    x
}

impl<M: Reducible<S>, S: PhasePoint, const R: usize> Model<R> for Modal<'_, M, R, S> {
    const FORM: Form = Form::Lagrangian;
    const FACTS: Facts = Facts {
        time_dependent: false,
        forced: false,
        quadratic_in_z: true,
        constant_mass: true,
        linear: true,
        separable: true,
        smooth: true,
    };

    fn energy_function<T: Real>(&self, _t: T, a: &[T; R], rates: &[T; R]) -> T {
        let half = T::from_f64(0.5);
        let mut sum = T::from_f64(-self.energy_at_rest);
        for k in 0..R {
            let square = T::from_f64(self.squares[k]);
            sum += half * (rates[k] * rates[k] - square * a[k] * a[k]);
            sum += T::from_f64(self.load[k]) * a[k];
        }
        sum
    }

    fn first<T: Real>(&self, _t: T, a: &[T; R], rates: &[T; R], first: &mut First<T, R>) {
        for k in 0..R {
            first.z[k] = rates[k];
            first.q[k] = T::from_f64(self.load[k]) - T::from_f64(self.squares[k]) * a[k];
        }
    }

    fn first_and_mass<T: Real>(
        &self,
        t: T,
        a: &[T; R],
        rates: &[T; R],
        first: &mut First<T, R>,
        zz: &mut [[T; R]; R],
    ) {
        self.first(t, a, rates, first);
        for (k, row) in zz.iter_mut().enumerate() {
            row[k] = T::from_f64(1.0);
        }
    }

    fn second<T: Real>(
        &self,
        t: T,
        a: &[T; R],
        rates: &[T; R],
        first: &mut First<T, R>,
        second: &mut Second<T, R>,
    ) {
        self.first_and_mass(t, a, rates, first, &mut second.zz);
        for (k, row) in second.qq.iter_mut().enumerate() {
            row[k] = T::from_f64(-self.squares[k]);
        }
    }

    fn unnumbered<F: FnMut(u64)>(&self, values: &mut F) {
        for number in self.squares.iter().chain(&self.load) {
            values(number.to_bits());
        }
    }

    fn coordinate_name(index: usize) -> CoordinateName {
        CoordinateName::element("mode", index)
    }

    fn columns(&self) -> usize {
        self.full.columns_of()
    }

    fn column_name(&self, column: usize) -> CoordinateName {
        self.full.column_name_of(column)
    }

    fn observables<T: Real>(&self, t: T, a: &[T; R], rates: &[T; R], values: &mut [T]) {
        let q = combination(&self.rest, &self.shapes, a);
        let z = match M::DECLARED {
            Form::Lagrangian => {
                let still = vec![0.0; self.rest.len()];
                combination(&still, &self.shapes, rates)
            }
            Form::Hamiltonian => combination(&self.offset, &self.momenta, rates),
        };
        self.full.observables_of(t, &q, &z, values);
    }
}

impl<M, S, const R: usize> fmt::Debug for Modal<'_, M, R, S> {
    /// The frequencies; the model need not be `Debug`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Modal")
            .field("coordinates", &self.rest.len())
            .field("frequencies", &self.frequencies())
            .finish_non_exhaustive()
    }
}
