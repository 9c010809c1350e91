//! Periodic orbits that were found.

use super::error::OrbitError;
use super::kind::{Chained, Closed};
use super::problem::{Global, Periodic};
use crate::assembly::{Assembly, Iterate, MeshWarning};
use crate::constraints::reduced;
use crate::length::FixedLength;
use crate::motion::{Motion, Node};
use crate::numbers::{digits, larger};
use crate::periodic_schur::{self, Multiplier};
use nalgebra::{Complex, DMatrix};
use std::f64::consts::PI;
use std::fmt;
use tfe_runtime::{Element, Model, State, Statistics};

/// A periodic orbit with its Floquet multipliers; made by [`PeriodicOrbit`](super::PeriodicOrbit).
#[derive(Clone, Debug)]
pub struct Orbit<'m, M: 'm, const N: usize, L: Closed<M, N> = FixedLength> {
    pub(crate) solution: L::Solution<'m>,
    floquet: Vec<Multiplier>,
    multipliers: Vec<Complex<f64>>,
    trivial: usize,
    unfolding: Option<f64>,
    warnings: Vec<MeshWarning>,
}

/// The stability of a periodic orbit, by its Floquet multipliers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Verdict {
    /// All multipliers except the trivial ones are inside the unit circle: neighbouring motions approach the orbit.
    Stable {
        /// 1 − max |μ|.
        margin: f64,
    },
    /// The largest multiplier is on the unit circle, within [`Verdict::NEUTRAL`], or all are trivial. An orbit of a
    /// conservative model cannot be more stable than that.
    Neutral {
        /// 1 − max |μ|.
        margin: f64,
    },
    /// At least one multiplier is outside the unit circle: neighbouring motions depart from the orbit.
    Unstable {
        /// 1 − max |μ|, negative.
        margin: f64,
    },
}

impl Verdict {
    /// The distance |1 − |μ|| up to which a modulus counts as one. Multipliers of conservative models are often
    /// multiple, and rounding moves a double one by the square root of the rounding unit.
    ///
    /// A Jordan block of k equal multipliers is moved by the k-th root: by about 10⁻⁵ for k = 3 and 10⁻⁴ for k = 4, as
    /// when a symmetry or a resonance adds ones to the trivial pair. In such a case a verdict with so small a margin
    /// decides nothing.
    pub const NEUTRAL: f64 = 1e-7;

    /// The verdict from all multipliers except the trivial ones, which are given by index. If there are no others, as
    /// for an oscillator with one coordinate, the orbit is neutral.
    pub(crate) fn of(floquet: &[Multiplier], trivial: &[usize]) -> Self {
        let others = (0..floquet.len()).filter(|place| !trivial.contains(place));
        let moduli = others.map(|place| floquet[place].modulus());
        let margin = 1.0 - moduli.reduce(larger).unwrap_or(1.0);
        if margin > Self::NEUTRAL {
            Self::Stable { margin }
        } else if margin >= -Self::NEUTRAL {
            Self::Neutral { margin }
        } else {
            Self::Unstable { margin }
        }
    }
}

/// A Floquet exponent (characteristic exponent) σ + iω = ln μ / T.
///
/// The imaginary part is determined up to multiples of 2π/T only, because ω and ω + 2πk/T give the same multiplier.
/// The value returned is the one of smallest modulus.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Exponent {
    /// Growth rate σ = ln |μ| / T, an inverse time; negative for decay.
    pub growth: f64,
    /// Frequency ω = arg μ / T in (−π/T, π/T], up to multiples of 2π/T.
    pub frequency: f64,
}

impl Exponent {
    /// The damping ratio ζ = −σ / √(σ² + ω²), with the frequency of smallest modulus.
    pub fn damping_ratio(&self) -> f64 {
        let modulus = self.growth.hypot(self.frequency);
        if modulus == 0.0 {
            0.0
        } else {
            -self.growth / modulus
        }
    }
}

impl<'m, M: Model<N>, const N: usize> Orbit<'m, M, N> {
    pub(super) fn new(
        element: Element,
        problem: &Periodic<'m, M, N>,
        iterate: Iterate<N>,
        assembly: &Assembly<N>,
    ) -> Result<Self, OrbitError> {
        let transitions = assembly.transitions().to_vec();
        let floquet = multipliers_of(problem, &iterate.nodes, &transitions)?;
        let solution = problem.solution(element, iterate, transitions, assembly.statistics());
        let unfolded = problem.globals.contains(&Global::Unfolding);
        let (trivial, unfolding) = (problem.trivial(), unfolded.then_some(problem.unfolding));
        Ok(Self::of_solution(solution, floquet, trivial, unfolding))
    }
}

impl<'m, M, const N: usize, L: Closed<M, N>> Orbit<'m, M, N, L> {
    /// The orbit of a solved chain, with its multipliers.
    pub(crate) fn of_solution(
        solution: L::Solution<'m>,
        floquet: Vec<Multiplier>,
        trivial: usize,
        unfolding: Option<f64>,
    ) -> Self {
        Self {
            solution,
            multipliers: floquet.iter().map(Multiplier::to_complex).collect(),
            floquet,
            trivial,
            unfolding,
            warnings: Vec::new(),
        }
    }

    /// The orbit with what makes it doubtful.
    pub(super) fn with_warnings(self, warnings: Vec<MeshWarning>) -> Self {
        Self { warnings, ..self }
    }

    /// What makes the orbit doubtful: whether elements of half the length change it, by one correction of Newton's
    /// method, and, for models of fixed size, whether nodes next to each other lie on both sides of a kink or a jump of a
    /// force. Orbits of a [branch](crate::Branch) have [warnings of their own](crate::Branch::warnings).
    pub fn warnings(&self) -> &[MeshWarning] {
        &self.warnings
    }

    /// The period T, as given or as found.
    pub fn period(&self) -> f64 {
        self.solution.period()
    }

    /// The state at the start of the period.
    pub fn start(&self) -> L::State {
        self.solution.start()
    }

    /// The nodes, in order; the last one is the first one a period later.
    pub fn nodes(&self) -> Vec<Node<N, L>> {
        self.solution.nodes()
    }

    /// The transition matrices A_e of the elements, in order: 2N × 2N each, ordered (p, q).
    pub fn transitions(&self) -> Vec<DMatrix<f64>> {
        self.solution.transitions()
    }

    /// The monodromy matrix A_E ⋯ A_1, 2N × 2N, ordered (p, q): the derivative of the state after a period with
    /// respect to the state at its start.
    ///
    /// The small eigenvalues of this matrix are lost in the rounding errors of the large ones, and entries beyond
    /// 10³⁰⁸ are infinite or NaN. [`multipliers`](Self::multipliers) are not computed from it, and
    /// [`floquet`](Self::floquet) holds multipliers of any size.
    pub fn monodromy(&self) -> DMatrix<f64> {
        let start = self.start();
        let (_, p) = L::parts(&start);
        let size = 2 * p.as_ref().len();
        let transitions = self.transitions();
        (transitions.iter()).fold(DMatrix::identity(size, size), |product, matrix| {
            matrix * product
        })
    }

    /// The Floquet multipliers μ, in order of decreasing modulus, each accurate relative to its own modulus.
    ///
    /// An autonomous model has the trivial multiplier μ = 1, whose direction is the flow. A conservative one has it
    /// twice, as a defective pair, which is accurate to the square root of the rounding unit only. See
    /// [`trivial`](Self::trivial).
    pub fn multipliers(&self) -> &[Complex<f64>] {
        &self.multipliers
    }

    /// The multipliers as logarithm of the modulus and argument, in the same order; valid also if the modulus is
    /// outside the range of `f64`.
    pub fn floquet(&self) -> &[Multiplier] {
        &self.floquet
    }

    /// The Floquet exponents ln μ / T, in the same order.
    pub fn exponents(&self) -> Vec<Exponent> {
        let exponent = |multiplier: &Multiplier| Exponent {
            growth: multiplier.log_modulus / self.period(),
            frequency: multiplier.argument / self.period(),
        };
        self.floquet.iter().map(exponent).collect()
    }

    /// The indices of the trivial multipliers among [`multipliers`](Self::multipliers): the one nearest to 1 for an
    /// autonomous model, the two nearest for a conservative one; none for a forced one.
    ///
    /// Their distance from 1 indicates the accuracy of the other multipliers.
    pub fn trivial(&self) -> Vec<usize> {
        trivial_of(&self.floquet, self.trivial)
    }

    /// Whether the orbit is not unstable, according to [`verdict`](Self::verdict), so that neighbouring motions stay
    /// near.
    pub fn is_stable(&self) -> bool {
        !matches!(self.verdict(), Verdict::Unstable { .. })
    }

    /// The stability of the orbit, from all multipliers except the trivial ones, with its margin.
    pub fn verdict(&self) -> Verdict {
        Verdict::of(&self.floquet, &self.trivial())
    }

    /// The factor γ of the force γ v that was added to the equations of an autonomous model with given period or
    /// energy, to make them regular; it is as small as the discretisation error. `None` for other orbits.
    pub fn unfolding(&self) -> Option<f64> {
        self.unfolding
    }

    /// Element lengths for [`graded`](super::PeriodicOrbit::graded) that give each of `elements` elements the same arc
    /// length of the orbit, where time, every coordinate and every momentum are divided by their range. Use it for
    /// relaxation oscillations, which alternate between fast and slow motion. No more than ten million are made.
    ///
    /// ```
    /// use tfe::prelude::*;
    ///
    /// #[dynamics(coordinates(x), lagrangian = dot(x)^2/2 - x^2/2, force(x) = mu*(1 - x^2)*dot(x))]
    /// struct VanDerPol { mu: f64 }
    ///
    /// # fn main() -> Result<(), Box<dyn std::error::Error>> {
    /// let model = VanDerPol { mu: 5.0 };
    /// let cycle = PeriodicOrbit::of(&model).unknown_period(11.6);
    /// let coarse = cycle.elements(400).guess_from(model.state([2.0], [0.0])).solve()?;
    /// let graded = PeriodicOrbit::of(&model)
    ///     .graded(coarse.equidistributed(80))
    ///     .unknown_period(coarse.period())
    ///     .guess_from(coarse.start())
    ///     .solve()?;
    /// assert!((graded.period() / coarse.period() - 1.0).abs() < 1e-5);
    /// # Ok(())
    /// # }
    /// ```
    pub fn equidistributed(&self, elements: usize) -> Vec<f64> {
        self.solution.equidistributed(elements)
    }

    /// Counts of iterations, evaluations and factorisations of the solution.
    pub fn statistics(&self) -> &Statistics {
        self.solution.statistics()
    }

    /// The motion over one period, with dense output from the polynomials of the elements.
    pub fn motion(&self) -> Motion<N, L> {
        self.solution.motion()
    }
}

/// A summary: period, multipliers, verdict.
///
/// ```text
/// periodic orbit: T = 4.4879895051, 40 elements, 5 iterations
///   μ = 6.6539330e-2 + 6.3491730e-1 i, |μ| = 6.3839451e-1
///   μ = 6.6539330e-2 − 6.3491730e-1 i, |μ| = 6.3839451e-1
///   stable, margin 3.6e-1
/// ```
impl<'m, M, const N: usize, L: Closed<M, N>> fmt::Display for Orbit<'m, M, N, L> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "periodic orbit: T = {}, {} elements, {} iterations",
            digits(self.period(), 10),
            self.solution.transitions().len(),
            self.statistics().newton_iterations
        )?;
        let trivial = self.trivial();
        for (place, multiplier) in self.multipliers.iter().enumerate() {
            let note = if trivial.contains(&place) {
                ", trivial"
            } else {
                ""
            };
            let sign = match multiplier.im {
                0.0 => {
                    writeln!(f, "  μ = {:.7e}{note}", multiplier.re)?;
                    continue;
                }
                im if im > 0.0 => '+',
                _ => '−',
            };
            let (re, im, modulus) = (multiplier.re, multiplier.im.abs(), multiplier.norm());
            writeln!(
                f,
                "  μ = {re:.7e} {sign} {im:.7e} i, |μ| = {modulus:.7e}{note}"
            )?;
        }
        match self.verdict() {
            Verdict::Stable { margin } => write!(f, "  stable, margin {margin:.1e}"),
            Verdict::Neutral { .. } => write!(f, "  neutrally stable"),
            Verdict::Unstable { margin } => write!(f, "  unstable, margin {margin:.1e}"),
        }?;
        (self.warnings.iter()).try_for_each(|warning| write!(f, "\n  {warning}"))
    }
}

/// The multipliers of a chain of transition matrices, the largest first; with constraints, those of the motions that
/// the constraints allow.
pub(crate) fn multipliers_of<M: Model<N>, const N: usize>(
    problem: &Periodic<'_, M, N>,
    nodes: &[State<N>],
    transitions: &[f64],
) -> Result<Vec<Multiplier>, OrbitError> {
    let floquet = if const { M::CONSTRAINTS.is_empty() } {
        periodic_schur::multipliers_of(2 * N, transitions)
    } else {
        let times = problem.mesh.times(problem.start, problem.period);
        let nodes = times.zip(nodes.iter().copied());
        let matrices = transitions.chunks_exact(4 * N * N);
        let matrices: Vec<_> = matrices
            .map(|entries| DMatrix::from_row_slice(2 * N, 2 * N, entries))
            .collect();
        let reduced = reduced(problem.model, nodes, &matrices).map_err(OrbitError::Constraints)?;
        periodic_schur::multipliers(&reduced)
    };
    let mut floquet = floquet.map_err(OrbitError::Multipliers)?;
    sort(&mut floquet);
    Ok(floquet)
}

/// Sorts by modulus, the largest first.
pub(crate) fn sort(floquet: &mut [Multiplier]) {
    floquet.sort_by(|a, b| {
        let by_modulus = b.log_modulus.total_cmp(&a.log_modulus);
        by_modulus.then(b.argument.total_cmp(&a.argument))
    });
}

/// The indices of the `count` multipliers closest to one.
pub(crate) fn trivial_of(floquet: &[Multiplier], count: usize) -> Vec<usize> {
    let mut places: Vec<usize> = (0..floquet.len()).collect();
    let distance = |place: &usize| {
        let multiplier = &floquet[*place];
        multiplier.log_modulus.hypot(multiplier.argument.min(PI))
    };
    places.sort_by(|a, b| distance(a).total_cmp(&distance(b)));
    places.truncate(count);
    places.sort_unstable();
    places
}
