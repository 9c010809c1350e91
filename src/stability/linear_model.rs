//! Models linearised about a state.
//!
//! The second derivatives of H and the first derivatives of the generalized force are held at their values at one (t,
//! q, p); the model then is linear with constant coefficients. Its exact flow over a time h has the eigenvalues
//! e^{λh}, which those of an element should approximate. If one of the element's is larger than the model's own
//! growth, the step size lies in an unstable interval of the linearised model.

use super::eigenvalues::EigenvalueError;
use super::time_scales::TimeScales;
use nalgebra::DMatrix;
use std::error::Error;
use std::fmt;
use tfe_runtime::{
    CoordinateName, Element, Facts, First, Form, Model, ModelError, Real, Second, State, legendre,
    transition,
};

/// Why a model cannot be linearised about a state.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum LinearModelError {
    /// The model has constraints: second derivatives at a state say nothing about the motions that these allow.
    Constrained,
    /// No velocity belongs to the momentum at the state, for example because the mass matrix is singular there.
    NoVelocity,
    /// A second derivative is infinite or not a number.
    NotFinite,
    /// The model does not pass its [check](Model::check).
    Model(ModelError),
}

impl fmt::Display for LinearModelError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Constrained => {
                "a model with constraints has no linear model about a state; `stability::on_constraints` linearises its steps"
            }
            Self::NoVelocity => {
                "no velocity belongs to the momentum of the state: is the mass matrix singular there?"
            }
            Self::NotFinite => "a second derivative of the model is not finite at the state: is it a singular point of the model?",
            Self::Model(error) => return error.fmt(f),
        })
    }
}

impl Error for LinearModelError {
    fn source(&self) -> Option<&(dyn Error + 'static)> {
        match self {
            Self::Model(error) => Some(error),
            _ => None,
        }
    }
}

/// A model linearised about a state, with its second derivatives held at their values there:
///
/// ```text
/// H = ½ pᵀH_pp p + pᵀH_pq q + ½ qᵀH_qq q ,     Q = Q_p p + Q_q q                                       (T-108)
/// ```
///
/// q and p are deviations from the state. About an equilibrium this is the model of small motions; elsewhere it
/// describes motions near the one through the state, for as long as that stays near the state. It is a model like any
/// other, linear with constant coefficients, so that each step is a product with a matrix.
///
/// `model(Name, truncated(2, …))` in `#[dynamics(…)]` declares the same if the state is known beforehand;
/// `Simulation::run_linearised` linearises along a motion.
///
/// ```
/// use tfe::prelude::*;
/// use tfe::stability::LinearModel;
///
/// #[dynamics(coordinates(r, theta), lagrangian = (dot(r)^2 + r^2*dot(theta)^2)/2 + g*r*cos(theta) - k/2*(r - 1)^2)]
/// struct Spring { g: f64, k: f64 }
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let spring = Spring { g: 9.0, k: 9e4 };
/// let hanging = spring.state([1.0001, 0.0], [0.0, 0.0]);
/// let linear = LinearModel::about(&spring, 0.0, &hanging)?;
/// let scales = linear.time_scales()?;
/// // The spring swings a hundred times as fast as the pendulum.
/// assert!((scales.fastest() - 300.0).abs() < 1e-3 && (scales.slowest() - 3.0).abs() < 1e-3);
/// println!("{scales}");
/// let motion = Simulation::new(&linear).step(0.01).run(State { q: [0.0, 1e-3], p: [0.0, 0.0] }, 0.0..1.0)?;
/// assert!((motion.last().q[1] - 1e-3 * (9.0_f64 / 1.0001).sqrt().cos()).abs() < 1e-9);
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct LinearModel<const N: usize> {
    pub(super) second: Second<f64, N>,
}

impl<const N: usize> LinearModel<N> {
    /// Linearises a model about `state` at a given time.
    ///
    /// # Errors
    /// [`LinearModelError::Constrained`] for a model with constraints, [`Model`](LinearModelError::Model) for one that does
    /// not pass its check, [`NoVelocity`](LinearModelError::NoVelocity) if the mass matrix is singular at the state,
    /// [`NotFinite`](LinearModelError::NotFinite) if a second derivative is not finite.
    pub fn about<M: Model<N>>(
        model: &M,
        t: f64,
        state: &State<N>,
    ) -> Result<Self, LinearModelError> {
        if const { !M::CONSTRAINTS.is_empty() } {
            return Err(LinearModelError::Constrained);
        }
        if let Err(error) = model.check() {
            return Err(LinearModelError::Model(error));
        }
        match legendre::hamiltonian_view(model, t, &state.q, &state.p) {
            Ok(view) => Self::of(view.second),
            Err(_) => Err(LinearModelError::NoVelocity),
        }
    }

    fn of(second: Second<f64, N>) -> Result<Self, LinearModelError> {
        let Second {
            zz,
            zq,
            qq,
            force_z,
            force_q,
        } = &second;
        let mut entries = [zz, zq, qq, force_z, force_q]
            .into_iter()
            .flatten()
            .flatten();
        if !entries.all(|entry| entry.is_finite()) {
            return Err(LinearModelError::NotFinite);
        }
        Ok(Self { second })
    }

    /// The time scales of the linear model: the eigenvalues of its equations of motion.
    ///
    /// # Errors
    /// [`EigenvalueError::NotFinite`] if a coefficient is not finite, [`EigenvalueError::NoConvergence`] if the eigenvalues
    /// do not converge.
    pub fn time_scales(&self) -> Result<TimeScales, EigenvalueError> {
        TimeScales::of(&self.generator())
    }

    /// The matrix S of ẏ = S y, y = (p, q):
    ///
    /// ```text
    /// S = [ Q_p − H_qp   Q_q − H_qq ]
    ///     [ H_pp         H_pq       ]
    /// ```
    pub(super) fn generator(&self) -> DMatrix<f64> {
        let s = &self.second;
        DMatrix::from_fn(2 * N, 2 * N, |row, column| {
            match (row < N, column < N, row % N, column % N) {
                (true, true, a, b) => s.force_z[a][b] - s.zq[b][a],
                (true, false, a, b) => s.force_q[a][b] - s.qq[a][b],
                (false, true, a, b) => s.zz[a][b],
                (false, false, a, b) => s.zq[a][b],
            }
        })
    }
    /// The transition matrix of one element; `None` if there is none.
    pub(super) fn transition(&self, element: Element, h: f64) -> Option<DMatrix<f64>> {
        let mut entries = vec![0.0; 4 * N * N];
        transition::of_rest(self, element, h, &mut entries).ok()?;
        let matrix = DMatrix::from_row_slice(2 * N, 2 * N, &entries);
        matrix
            .iter()
            .all(|entry| entry.is_finite())
            .then_some(matrix)
    }
}
/// A x, or Aᵀ x if `transposed`.
fn product<R: Real, const N: usize>(a: &[[f64; N]; N], x: &[R; N], transposed: bool) -> [R; N] {
    std::array::from_fn(|i| {
        let mut sum = R::from_f64(0.0);
        for j in 0..N {
            let entry = if transposed { a[j][i] } else { a[i][j] };
            sum += R::from_f64(entry) * x[j];
        }
        sum
    })
}

fn sum<R: Real, const N: usize>(a: [R; N], b: [R; N]) -> [R; N] {
    std::array::from_fn(|i| a[i] + b[i])
}

impl<const N: usize> Model<N> for LinearModel<N> {
    const FORM: Form = Form::Hamiltonian;
    const FACTS: Facts = Facts {
        time_dependent: false,
        forced: true,
        quadratic_in_z: true,
        constant_mass: true,
        linear: true,
        separable: false,
        smooth: true,
    };

    fn energy_function<R: Real>(&self, _t: R, q: &[R; N], p: &[R; N]) -> R {
        let s = &self.second;
        let half = R::from_f64(0.5);
        let by_p = sum(product(&s.zz, p, false), product(&s.zq, q, false));
        let by_p = sum(by_p, product(&s.zq, q, false));
        let by_q = product(&s.qq, q, false);
        let mut energy = R::from_f64(0.0);
        for i in 0..N {
            energy += half * (p[i] * by_p[i] + q[i] * by_q[i]);
        }
        energy
    }

    fn first<R: Real>(&self, _t: R, q: &[R; N], p: &[R; N], first: &mut First<R, N>) {
        let s = &self.second;
        first.z = sum(product(&s.zz, p, false), product(&s.zq, q, false));
        first.q = sum(product(&s.zq, p, true), product(&s.qq, q, false));
        first.force = sum(product(&s.force_z, p, false), product(&s.force_q, q, false));
    }

    fn first_and_mass<R: Real>(
        &self,
        t: R,
        q: &[R; N],
        p: &[R; N],
        first: &mut First<R, N>,
        zz: &mut [[R; N]; N],
    ) {
        self.first(t, q, p, first);
        *zz = self.second.zz.map(|row| row.map(R::from_f64));
    }

    fn second<R: Real>(
        &self,
        t: R,
        q: &[R; N],
        p: &[R; N],
        first: &mut First<R, N>,
        second: &mut Second<R, N>,
    ) {
        let s = &self.second;
        self.first(t, q, p, first);
        let lift = |a: &[[f64; N]; N]| a.map(|row| row.map(R::from_f64));
        *second = Second {
            zz: lift(&s.zz),
            zq: lift(&s.zq),
            qq: lift(&s.qq),
            force_z: lift(&s.force_z),
            force_q: lift(&s.force_q),
        };
    }

    fn coordinate_name(index: usize) -> CoordinateName {
        CoordinateName::element("q", index)
    }
}
#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_frozen_model_is_its_own_derivative() {
        let frozen = LinearModel {
            second: Second {
                zz: [[2.0, 0.3], [0.3, 1.0]],
                zq: [[0.1, -0.4], [0.7, 0.2]],
                qq: [[3.0, 0.5], [0.5, 2.0]],
                force_z: [[-0.1, 0.2], [0.0, -0.3]],
                force_q: [[0.2, 0.1], [-0.6, 0.4]],
            },
        };
        let (q, p) = ([0.3, -0.7], [1.1, 0.4]);
        let at = |q: [f64; 2], p: [f64; 2]| frozen.energy_function(0.0, &q, &p);
        let mut first = First::ZERO;
        frozen.first(0.0, &q, &p, &mut first);
        for a in 0..2 {
            let moved = |x: [f64; 2], by: f64| {
                let mut x = x;
                x[a] += by;
                x
            };
            // Central differences are exact for a quadratic function.
            let by_p = 0.5 * (at(q, moved(p, 1.0)) - at(q, moved(p, -1.0)));
            let by_q = 0.5 * (at(moved(q, 1.0), p) - at(moved(q, -1.0), p));
            assert!((by_p - first.z[a]).abs() < 1e-14 && (by_q - first.q[a]).abs() < 1e-14);
        }
        // The linearisation of a LinearModel is itself; a short step is 1 + hS with an error of (‖S‖h)² < 10⁻⁹.
        let again = LinearModel::about(&frozen, 0.0, &State { q, p }).expect("regular");
        assert_eq!(again.second, frozen.second);
        let h = 1e-6;
        let a = frozen
            .transition(Element::primal(3), h)
            .expect("a linear step");
        let expected = DMatrix::identity(4, 4) + frozen.generator() * h;
        assert!((a - expected).amax() < 1e-10);
    }
}
