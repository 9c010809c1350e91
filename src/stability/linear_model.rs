//! A model frozen at a state, and whether an element moves it faster than it moves itself.
//!
//! With the second derivatives of H and the first ones of the generalized force held at their values at one (t, q, p), a model becomes
//! linear with constant coefficients. Its exact flow over a time h has the eigenvalues e^{λh}; those of an element should be close to them.
//! Where one is larger, and the model does not account for it, the step lies in an unstable interval of the linearised model.

use super::eigenvalues::{EigenvalueError, balanced, eigenvalues, eigenvalues_of_finite};
use super::sign_functions::Measure;
use nalgebra::{Complex, DMatrix};
use std::error::Error;
use std::f64::consts::TAU;
use std::fmt;
use tfe_runtime::{
    CoordinateName, Element, Facts, Family, First, Form, Model, Real, Rule, Second, State,
    legendre, transition,
};

/// Whether an element never lets a linear model with constant coefficients grow that does not grow itself, at any step.
///
/// Mixed elements and energy-conserving ones integrate such models exactly by every rule that they accept, and are the diagonal Padé
/// approximant (T-53) then; reduced primal ones are by definition. Radau's are subdiagonal ones. All map the left half plane of λh into the
/// unit disk, so there is nothing to look for. What is left are the primal elements with other rules.
pub(crate) fn is_a_stable(element: Element) -> bool {
    match (element.family(), element.rule()) {
        (Family::Mixed | Family::EnergyConserving | Family::Radau, _) => true,
        (Family::ThreeField, Rule::Default) => true,
        (Family::Primal | Family::ThreeField, Rule::Gauss(points)) => points == element.degree(),
        (Family::Primal, Rule::Default) | (_, Rule::Lobatto(_)) => false,
    }
}

/// A mode that an element makes grow although the frozen model does not.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Growth {
    /// The modulus of its eigenvalue in the transition matrix of the element.
    pub(crate) radius: f64,
    /// The modulus |e^{λh}| of its eigenvalue in the flow of the frozen model.
    pub(crate) exact: f64,
}

/// Why there is no linear model about a state.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum LinearModelError {
    /// Constraints act: second derivatives at a state say nothing about the motions that they allow.
    Constrained,
    /// The momentum belongs to no velocity.
    NoVelocity,
    /// A second derivative is infinite or not a number.
    NotFinite,
}

impl fmt::Display for LinearModelError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Constrained => {
                "a model with constraints has no linear model about a state; `stability::on_constraints` linearises its steps"
            }
            Self::NoVelocity => "the momentum of the state belongs to no velocity",
            Self::NotFinite => "a second derivative of the model is not finite at the state",
        })
    }
}

impl Error for LinearModelError {}

/// A model linearised about a state: its second derivatives held at their values there.
///
/// ```text
/// H = ½ pᵀH_pp p + pᵀH_pq q + ½ qᵀH_qq q ,     Q = Q_p p + Q_q q                                       (T-108)
/// ```
///
/// q and p are deviations from the state. About an equilibrium it is the model of small motions; elsewhere that of motions beside the one through the state, as long as
/// that stays near. It is a model as any other, linear with constant coefficients, so that it steps by a matrix.
/// `model(Name, truncated(2, …))` in `#[dynamics(…)]` declares the same where the state is known beforehand; `Simulation::run_linearised` linearises along a motion.
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
    second: Second<f64, N>,
}

impl<const N: usize> LinearModel<N> {
    /// The model as it is at `state`.
    ///
    /// # Errors
    /// [`LinearModelError`]
    pub fn about<M: Model<N>>(
        model: &M,
        t: f64,
        state: &State<N>,
    ) -> Result<Self, LinearModelError> {
        if const { !M::CONSTRAINTS.is_empty() } {
            return Err(LinearModelError::Constrained);
        }
        let view = legendre::hamiltonian_view(model, t, &state.q, &state.p)
            .map_err(|_| LinearModelError::NoVelocity)?;
        let Second {
            zz,
            zq,
            qq,
            force_z,
            force_q,
        } = &view.second;
        let mut entries = [zz, zq, qq, force_z, force_q]
            .into_iter()
            .flatten()
            .flatten();
        if !entries.all(|entry| entry.is_finite()) {
            return Err(LinearModelError::NotFinite);
        }
        Ok(Self {
            second: view.second,
        })
    }

    /// How fast it moves: the eigenvalues of its equations.
    ///
    /// # Errors
    /// [`EigenvalueError`]
    pub fn time_scales(&self) -> Result<TimeScales, EigenvalueError> {
        let rates = eigenvalues(&self.generator())?;
        Ok(TimeScales { rates })
    }

    /// The matrix S of ẏ = S y, y = (p, q):
    ///
    /// ```text
    /// S = [ Q_p − H_qp   Q_q − H_qq ]
    ///     [ H_pp         H_pq       ]
    /// ```
    fn generator(&self) -> DMatrix<f64> {
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

    /// The mode that one step of `element` amplifies most beyond what the frozen model does; none where the growth is the model's own, or
    /// where there is no transition matrix.
    ///
    /// The moduli of both spectra are compared in the order of size, so that a slow unstable mode of the model does not hide a fast mode
    /// that grows by the method. With μ the eigenvalues of the element, mode k counts if
    ///
    /// ```text
    /// ln |μ_k| > 1.5 max(0, Re λ_k h) + 10⁻⁷ .
    /// ```
    ///
    /// Where the model itself grows, an element is inaccurate before it is wrong, hence the factor. Double eigenvalues in one Jordan
    /// block, as every free coordinate has, are known to √ε = 1.5·10⁻⁸ in units of the matrix, hence the summand; blocks that are larger
    /// or worse conditioned show in what small perturbations of the matrix do, which the excess must exceed as well.
    ///
    /// A step that resolves all modes, ‖S‖ h < 1, is not looked at: modes of an oscillator are unstable from λh = 2 on at the earliest (two
    /// Lobatto points), so that neither eigenvalues nor an element are computed for the usual run.
    pub(crate) fn growth(&self, element: Element, h: f64) -> Option<Growth> {
        const RATE: f64 = 1.5;
        const DEFECTIVE: f64 = 1e-7;
        /// Four random perturbations may miss the worst direction.
        const TRUST: f64 = 4.0;
        let generator = self.generator() * h;
        if !(1.0..f64::INFINITY).contains(&row_sum_norm(&balanced(&generator).0)) {
            return None;
        }
        let matrix = self.transition(element, h)?;
        let logarithms = logarithms(&matrix)?;
        if !(logarithms.first()? > &DEFECTIVE) {
            return None;
        }
        let values = eigenvalues_of_finite(&generator)?;
        let rates = descending(values.iter().map(|value| value.re));
        let excess = |k: usize| logarithms[k] - RATE * rates[k].max(0.0) - DEFECTIVE;
        let worst = (0..2 * N).max_by(|&i, &j| excess(i).total_cmp(&excess(j)))?;
        if !(excess(worst) > 0.0) {
            return None;
        }
        let noise = Measure::noise(&matrix, &backward_error(&matrix), |a| {
            Some(self::logarithms(a)?[worst])
        });
        (excess(worst) > TRUST * noise).then(|| Growth {
            radius: logarithms[worst].exp(),
            exact: rates[worst].exp(),
        })
    }

    fn transition(&self, element: Element, h: f64) -> Option<DMatrix<f64>> {
        let mut entries = vec![0.0; 4 * N * N];
        let rest = State {
            q: [0.0; N],
            p: [0.0; N],
        };
        transition::of_step(self, element, &rest, 0.0, h, &mut entries).ok()?;
        let matrix = DMatrix::from_row_slice(2 * N, 2 * N, &entries);
        matrix
            .iter()
            .all(|entry| entry.is_finite())
            .then_some(matrix)
    }
}

/// The rates λ of a linear model, whose motions are sums of e^{λt}: whether it is stiff, and what steps see of it.
#[derive(Clone, Debug, PartialEq)]
pub struct TimeScales {
    rates: Vec<Complex<f64>>,
}

impl TimeScales {
    /// Rates that are smaller, relative to the largest, are those of free coordinates and rounding.
    const FREE: f64 = 1e-6;
    /// Beyond such a ratio of rates a model is called stiff.
    const STIFF: f64 = 100.0;

    /// All λ.
    pub fn rates(&self) -> &[Complex<f64>] {
        &self.rates
    }

    /// The largest |λ|, in radians per unit of time; zero if nothing moves.
    pub fn fastest(&self) -> f64 {
        self.rates
            .iter()
            .map(|rate| rate.norm())
            .fold(0.0, f64::max)
    }

    /// The smallest |λ| that is not zero; zero if all are.
    pub fn slowest(&self) -> f64 {
        let least = Self::FREE * self.fastest();
        let sizes = self.rates.iter().map(|rate| rate.norm());
        let moving = sizes.filter(|size| *size > least);
        moving.reduce(f64::min).unwrap_or(0.0)
    }

    /// fastest/slowest; one if nothing moves.
    pub fn stiffness(&self) -> f64 {
        if self.slowest() == 0.0 {
            1.0
        } else {
            self.fastest() / self.slowest()
        }
    }

    /// The step from which on Newton's method has to solve the elements: longer ones do not contract as a fixed point, 2/|λ|.
    pub fn newton_from(&self) -> f64 {
        2.0 / self.fastest()
    }
}

/// What it means for steps, in one sentence.
impl fmt::Display for TimeScales {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (fastest, slowest) = (self.fastest(), self.slowest());
        if fastest == 0.0 {
            return f.write_str("nothing swings, grows or decays");
        }
        write!(
            f,
            "times from {:.3e} to {:.3e} (2π/|λ|), ratio {:.3e}: ",
            TAU / fastest,
            TAU / slowest,
            self.stiffness()
        )?;
        if self.stiffness() > Self::STIFF {
            write!(
                f,
                "stiff; steps beyond {:.3e} need Newton's method, and serve where the fast motion need not be seen",
                self.newton_from()
            )
        } else {
            write!(
                f,
                "not stiff; steps up to {:.3e} contract",
                self.newton_from()
            )
        }
    }
}

/// The logarithms of the moduli of all eigenvalues, the largest first.
fn logarithms(matrix: &DMatrix<f64>) -> Option<Vec<f64>> {
    let values = eigenvalues_of_finite(matrix)?;
    Some(descending(values.iter().map(|value| value.norm().ln())))
}

/// max_i Σ_j |a_ij|, a bound of every |λ|.
fn row_sum_norm(a: &DMatrix<f64>) -> f64 {
    a.row_iter().fold(0.0, |most: f64, row| {
        most.max(row.iter().map(|entry| entry.abs()).sum())
    })
}

/// The size that the round-off of QR is relative to: in balanced units the largest entry, at each place, zeros included.
fn backward_error(a: &DMatrix<f64>) -> DMatrix<f64> {
    let (balanced, units) = balanced(a);
    let largest = balanced.amax();
    DMatrix::from_fn(a.nrows(), a.ncols(), |row, column| {
        largest * units[row] / units[column]
    })
}

fn descending(values: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(|a, b| b.total_cmp(a));
    values
}

/// A x, or Aᵀ x where `transposed`.
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
    use crate::stability::{spectral_radius, transition_matrix};

    /// H = ½ p² + ½ ω² q² with the force −2ξω p.
    fn oscillator(omega: f64, xi: f64) -> LinearModel<1> {
        LinearModel {
            second: Second {
                zz: [[1.0]],
                zq: [[0.0]],
                qq: [[omega * omega]],
                force_z: [[-2.0 * xi * omega]],
                force_q: [[0.0]],
            },
        }
    }

    /// H = ½ p² − ½ q².
    fn saddle() -> LinearModel<1> {
        let mut frozen = oscillator(1.0, 0.0);
        frozen.second.qq = [[-1.0]];
        frozen
    }

    fn every_rule(nodes: usize) -> Vec<Element> {
        let mut all = vec![
            Element::primal(nodes),
            Element::primal(nodes).reduced(),
            Element::primal(nodes).lobatto(),
            Element::mixed(nodes),
            Element::energy_conserving(nodes),
            Element::radau(nodes),
            Element::radau(nodes).with_rule(Rule::Lobatto(nodes.max(3) - 1)),
        ];
        for points in nodes - 1..nodes + 3 {
            for element in [
                Element::mixed(nodes),
                Element::energy_conserving(nodes),
                Element::radau(nodes),
            ] {
                all.push(element.quadrature(points));
                all.push(element.with_rule(Rule::Lobatto(points + 1)));
            }
        }
        all
    }

    #[test]
    fn a_stable_elements_are() {
        let rest = State { q: [0.0], p: [0.0] };
        for element in (2..=6).flat_map(every_rule) {
            let mut largest = 0.0_f64;
            for xi in [0.0, 0.01, 1.0] {
                // Not finer than the bubbles of six nodes: one of them is enough.
                for rho in (1..80).map(|k| 0.5 * f64::from(k)) {
                    // Backwards in time, a negative damping decays.
                    for (xi, h) in [(xi, rho), (-xi, -rho)] {
                        let a = transition_matrix(&oscillator(1.0, xi), element, &rest, 0.0, h)
                            .expect("a linear step");
                        largest = largest.max(spectral_radius(&a));
                    }
                }
            }
            // Undamped ones have radius one; the entries are of the size of ρ, times some roundings.
            assert_eq!(
                largest <= 1.0 + 1e-11,
                is_a_stable(element),
                "{element}: {largest}"
            );
        }
    }

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
            // Central differences of a quadratic function are exact.
            let by_p = 0.5 * (at(q, moved(p, 1.0)) - at(q, moved(p, -1.0)));
            let by_q = 0.5 * (at(moved(q, 1.0), p) - at(moved(q, -1.0), p));
            assert!((by_p - first.z[a]).abs() < 1e-14 && (by_q - first.q[a]).abs() < 1e-14);
        }
        // LinearModel again, it is itself; and a short step is 1 + hS, with an error of (‖S‖h)² < 10⁻⁹.
        let again = LinearModel::about(&frozen, 0.0, &State { q, p }).expect("regular");
        assert_eq!(again.second, frozen.second);
        let h = 1e-6;
        let a = frozen
            .transition(Element::primal(3), h)
            .expect("a linear step");
        let expected = DMatrix::identity(4, 4) + frozen.generator() * h;
        assert!((a - expected).amax() < 1e-10);
    }

    #[test]
    fn free_coordinates_have_no_time_scale() {
        let mut model = LinearModel::<2> {
            second: Second::ZERO,
        };
        model.second.zz = [[1.0, 0.0], [0.0, 1.0]];
        let scales = model.time_scales().expect("eigenvalues");
        assert_eq!((scales.fastest(), scales.stiffness()), (0.0, 1.0));
        assert_eq!(scales.to_string(), "nothing swings, grows or decays");
        model.second.qq = [[0.0, 0.0], [0.0, 4.0]];
        let scales = model.time_scales().expect("eigenvalues");
        // A frequency of two beside a coordinate that drifts.
        assert!((scales.fastest() - 2.0).abs() < 1e-14 && (scales.slowest() - 2.0).abs() < 1e-14);
        assert!((scales.newton_from() - 1.0).abs() < 1e-14);
        model.second.qq = [[1e-6, 0.0], [0.0, 4.0]];
        let scales = model.time_scales().expect("eigenvalues");
        assert!((scales.stiffness() / 2e3 - 1.0).abs() < 1e-9);
        assert!(scales.to_string().contains("ratio 2.000e3: stiff"));
    }

    #[test]
    fn growth_is_seen_in_the_bubbles_and_only_there() {
        let at = |rho: f64| oscillator(1.0, 0.0).growth(Element::primal(3), rho);
        for rho in [1e-6, 0.1, 1.0, 3.16, 3.465, 7.74] {
            assert_eq!(at(rho), None, "ρ = {rho}");
        }
        // Both ways in time: √10 < ρ < √12, and beyond √60.
        for rho in [3.163, 3.3112897574651194, 3.464, 7.75, -3.3, -8.0] {
            let growth = at(rho).unwrap_or_else(|| panic!("ρ = {rho}"));
            assert!(growth.radius > 1.0 + 1e-3, "ρ = {rho}: {growth:?}");
            assert_eq!(growth.exact, 1.0);
        }
        // stability_bubbles.json; the radius has a square root in it, but is flat at its maximum.
        let worst = at(3.3112897574651194).expect("the worst of the bubble");
        assert!((worst.radius - 1.129817690854696).abs() < 1e-12);
    }

    #[test]
    fn the_growth_of_the_model_is_not_the_methods() {
        for nodes in 2..=5 {
            for element in [Element::primal(nodes), Element::primal(nodes).lobatto()] {
                for h in [1e-4, 1e-2, 0.1, 1.0, -0.1, -1.0] {
                    assert_eq!(saddle().growth(element, h), None, "{element}, h = {h}");
                }
            }
        }
        // T-59 with ρ² → −σ: the matrix of two nodes has a pole at h = √6, and no likeness to e^h near it.
        assert!(saddle().growth(Element::primal(2), 2.4).is_some());
    }

    #[test]
    fn an_unstable_model_does_not_hide_a_bubble() {
        // A saddle that grows by e^{0.33} beside an oscillator in its bubble, where the radius is 1.13 < e^{0.33}.
        let mut both = LinearModel::<2> {
            second: Second::ZERO,
        };
        both.second.zz = [[1.0, 0.0], [0.0, 1.0]];
        both.second.qq = [[-0.01, 0.0], [0.0, 1.0]];
        let growth = both
            .growth(Element::primal(3), 3.3)
            .expect("the oscillator is in its bubble");
        assert!(growth.radius > 1.12 && growth.radius < 1.13, "{growth:?}");
        both.second.qq[1][1] = 0.9;
        assert_eq!(both.growth(Element::primal(3), 3.3), None);
    }

    #[test]
    fn free_coordinates_are_no_growth() {
        // Four eigenvalues in one Jordan block, H = ½ p₁² + q₁ p₂: round-off spreads them by its fourth root.
        let mut chain = LinearModel::<2> {
            second: Second::ZERO,
        };
        chain.second.zz = [[1.0, 0.0], [0.0, 1e-3]];
        chain.second.zq = [[0.0, 0.0], [1.0, 0.0]];
        for nodes in 2..=6 {
            for h in [1e-3, 0.1, 10.0] {
                assert_eq!(
                    chain.growth(Element::primal(nodes), h),
                    None,
                    "{nodes}, {h}"
                );
            }
        }
    }
}
