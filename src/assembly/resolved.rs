//! Detects solutions that exist only because of the discretisation error.
//!
//! At conjugate points, and at resonance without damping, the equations of motion have no solution or many. The
//! discrete equations are then singular up to the discretisation error and have one solution, which grows as that error
//! decreases.

use super::chain::Chain;
use super::error::AssemblyError;
use super::newton::{Assembly, Iterate, Problem};
use super::warning::MeshWarning;
use crate::numbers::{larger, raise, smaller};
use tfe_runtime::Element;

/// Below this pivot ratio a solution is checked: it may be a thousand times as large as the prescribed values.
const DOUBTFUL: f64 = 1e-3;

/// Below this pivot ratio the rounding errors of a solution, about 4e-16, change it by more than the limit for rounding
/// errors.
const ROUNDINGS: f64 = 1e-6;

/// The largest relative change by one correction on a mesh of half the element length. A solution that is due to the
/// discretisation error grows by the factor by which the error decreases, at least four.
const LEFT: f64 = 0.5;

/// The largest change by that correction without a warning, relative to the extent of the motion; runs have the same
/// limit (T-121).
const MAX: f64 = 0.03;

/// The least extent, relative to the whole solution: that of a motion at rest is its rounding errors.
const MIN: f64 = 1e-6;

impl Chain {
    /// Whether the equations are so close to singular that the solution should be checked.
    pub(crate) fn is_doubtful(&self) -> bool {
        self.smallest_pivot() < DOUBTFUL
    }

    /// The error of a failed iteration: the equations are singular if rounding errors alone prevent convergence.
    pub(crate) fn explained(&self, error: AssemblyError) -> AssemblyError {
        match error {
            AssemblyError::Stalled { iterations, .. } if self.smallest_pivot() < ROUNDINGS => {
                AssemblyError::Singular { iterations }
            }
            error => error,
        }
    }
}

/// Momenta and coordinates of a node, and its correction in the order (p, q).
type Corrected<'a> = (&'a [f64], &'a [f64], &'a [f64]);

/// The size of one correction by Newton's method on elements of half the length.
#[derive(Clone, Copy, Debug)]
pub(crate) struct HalvedCorrection {
    /// Relative to the whole solution.
    whole: f64,
    /// Relative to the extent of the motion.
    part: f64,
}

impl HalvedCorrection {
    /// The equations are singular on elements of half the length.
    pub(crate) const SINGULAR: Self = Self {
        whole: f64::INFINITY,
        part: f64::INFINITY,
    };

    /// A correction of nodes, and of global unknowns, which is given relative to their scales. `whole` is its [size](super::size)
    /// relative to the whole solution.
    pub(crate) fn of(
        whole: f64,
        nodes: &[Corrected<'_>],
        globals: impl IntoIterator<Item = f64>,
    ) -> Self {
        Self {
            whole,
            part: smaller(part_of_extent(nodes, globals), whole / MIN),
        }
    }

    /// Whether the solution is confirmed.
    pub(crate) fn confirms(self) -> bool {
        self.whole <= LEFT
    }

    /// The warnings for a solution on this number of elements.
    pub(crate) fn doubts(self, elements: usize) -> Vec<MeshWarning> {
        let change = self.part;
        // A NaN is no solution, which the iteration has reported.
        match change > MAX {
            true => vec![MeshWarning::Unresolved { elements, change }],
            false => Vec::new(),
        }
    }
}

impl<const N: usize> Assembly<N> {
    /// See [`Chain::is_doubtful`].
    pub(crate) fn is_doubtful(&self) -> bool {
        self.chain().is_doubtful()
    }

    /// See [`Chain::explained`].
    pub(crate) fn explained(&self, error: AssemblyError) -> AssemblyError {
        self.chain().explained(error)
    }

    /// Refuses a solution that the correction on elements of half the length does not confirm. If there is no
    /// correction, the solution is accepted.
    pub(crate) fn check_resolved(
        &self,
        halved: Option<HalvedCorrection>,
    ) -> Result<(), AssemblyError> {
        if halved.is_none_or(HalvedCorrection::confirms) {
            return Ok(());
        }
        Err(AssemblyError::Singular {
            iterations: self.corrections(),
        })
    }

    /// The correction of a solution on a mesh of half the element length (`fine`), for a solution given as a curve with
    /// its global unknowns; `None` if there is none.
    pub(crate) fn halved_correction<P: Problem<N>>(
        element: Element,
        (fine, elements): (&P, usize),
        (globals, dense): (Vec<f64>, usize),
        curve: impl FnMut(f64) -> ([f64; N], [f64; N]),
    ) -> Result<Option<HalvedCorrection>, AssemblyError> {
        let mut halves = Self::new::<P::Model>(element, elements, globals.len(), dense)?;
        let Ok(iterate) = halves.along(fine, curve, globals) else {
            return Ok(None);
        };
        Ok(match halves.linearise(fine, &iterate) {
            Ok(()) => Some(halves.correction(fine, &iterate)),
            Err(AssemblyError::Singular { .. }) => Some(HalvedCorrection::SINGULAR),
            Err(_) => None,
        })
    }

    /// The size of the last correction.
    fn correction<P: Problem<N>>(&self, problem: &P, iterate: &Iterate<N>) -> HalvedCorrection {
        let nodes = iterate.nodes.iter().enumerate();
        let nodes = nodes.map(|(e, node)| (&node.p[..], &node.q[..], self.chain().node(e)));
        let nodes: Vec<_> = nodes.collect();
        let globals = self.chain().globals().iter().enumerate();
        let globals = globals.map(|(k, correction)| correction / problem.scale(k));
        HalvedCorrection::of(self.size(problem, iterate).whole(), &nodes, globals)
    }
}

/// The size of a correction relative to the extents of all momenta and of all coordinates of a motion; of global unknowns
/// it is given relative to their scales.
fn part_of_extent(nodes: &[Corrected<'_>], globals: impl IntoIterator<Item = f64>) -> f64 {
    let mut most = 0.0;
    for correction in globals {
        raise(&mut most, correction.abs());
    }
    for kind in 0..2 {
        let (mut extent, mut correction) = (0.0, 0.0);
        let n = nodes.first().map_or(0, |(p, ..)| p.len());
        for a in 0..n {
            let values = || nodes.iter().map(|(p, q, _)| [p, q][kind][a]);
            let high = values().fold(f64::NEG_INFINITY, larger);
            let low = values().fold(f64::INFINITY, smaller);
            raise(&mut extent, high - low);
            for (.., change) in nodes {
                raise(&mut correction, change[kind * n + a].abs());
            }
        }
        if extent > 0.0 {
            raise(&mut most, correction / extent);
        }
    }
    most
}
