//! Detects solutions that exist only because of the discretisation error.
//!
//! At conjugate points, and at resonance without damping, the equations of motion have no solution or many. The
//! discrete equations are then singular up to the discretisation error and have one solution, which grows as that error
//! decreases.

use super::chain::Chain;
#[cfg(feature = "sparse")]
use super::convergence::Size;
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

/// The least extent, relative to the values themselves: that of a motion at rest is its rounding errors.
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

    /// A correction of nodes, given by their momenta, coordinates and corrections, and of global unknowns, given relative
    /// to their scales.
    pub(crate) fn of(
        size: Size,
        nodes: &[(&[f64], &[f64], &[f64])],
        globals: impl IntoIterator<Item = f64>,
    ) -> Self {
        Self {
            whole: size.whole(),
            part: part_of_extent(nodes, globals),
        }
    }

    /// Whether the solution is confirmed.
    pub(crate) fn confirms(self) -> bool {
        self.whole <= LEFT
    }

    /// The warnings for a solution on this number of elements.
    pub(crate) fn doubts(self, elements: usize) -> Vec<MeshWarning> {
        MeshWarning::unless_resolved(elements, self.part)
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
        HalvedCorrection::of(self.size(problem, iterate), &nodes, globals)
    }
}

/// The size of a correction of nodes, given by their momenta, coordinates and corrections: of coordinates and momenta
/// relative to their extents; that of global unknowns is given relative to their scales.
pub(crate) fn part_of_extent(
    nodes: &[(&[f64], &[f64], &[f64])],
    globals: impl IntoIterator<Item = f64>,
) -> f64 {
    let mut most = 0.0;
    for kind in 0..2 {
        let (mut extent, mut largest) = (0.0, 0.0);
        let values = nodes.iter().map(|(p, q, _)| [*p, *q][kind]);
        let n = values.clone().next().map_or(0, <[f64]>::len);
        for a in 0..n {
            let values = || values.clone().map(|node| node[a]);
            let high = values().fold(f64::NEG_INFINITY, larger);
            let low = values().fold(f64::INFINITY, smaller);
            raise(&mut extent, high - low);
            raise(&mut extent, MIN * larger(high.abs(), low.abs()));
            for (_, _, correction) in nodes {
                raise(&mut largest, correction[kind * n + a].abs());
            }
        }
        if extent > 0.0 {
            raise(&mut most, largest / extent);
        }
    }
    for correction in globals {
        raise(&mut most, correction.abs());
    }
    most
}
