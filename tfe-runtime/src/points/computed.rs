//! Tables of the iterations of `points` that are computed at run time.

use super::tables::{ProjectionTarget, Tables, Target};
use crate::registers::storage::{Fixed, Heap, Matrix, Projection, Weights};
use crate::scheme::SchemeRef;
use alloc::sync::Arc;
use alloc::vec;

/// The tables computed so far.
#[cfg(feature = "std")]
static KNOWN: std::sync::Mutex<std::vec::Vec<(crate::Element, Arc<Fixed<Heap>>)>> =
    std::sync::Mutex::new(std::vec::Vec::new());

impl Tables<Heap> {
    /// The tables of an element with at most 16 points; clones share the tables that no step changes. With the feature
    /// `std` they are computed once in a program.
    pub(crate) fn of(scheme: &SchemeRef<'_>) -> Self {
        Self::new(Self::shared(scheme))
    }

    #[cfg(feature = "std")]
    fn shared(scheme: &SchemeRef<'_>) -> Arc<Fixed<Heap>> {
        // The list is valid even if another thread has panicked.
        let mut known = KNOWN
            .lock()
            .unwrap_or_else(std::sync::PoisonError::into_inner);
        if let Some((_, fixed)) = known.iter().find(|(of, _)| *of == scheme.element) {
            return fixed.clone();
        }
        let fixed = Arc::new(Fixed::computed(scheme));
        known.push((scheme.element, fixed.clone()));
        fixed
    }

    #[cfg(not(feature = "std"))]
    fn shared(scheme: &SchemeRef<'_>) -> Arc<Fixed<Heap>> {
        Arc::new(Fixed::computed(scheme))
    }
}

impl Matrix<Heap> {
    fn empty(points: usize) -> Self {
        let groups = points.div_ceil(4);
        Self {
            groups,
            columns: vec![[0.0; 4]; points * groups],
        }
    }
}

impl Fixed<Heap> {
    fn computed(scheme: &SchemeRef<'_>) -> Self {
        let points = scheme.points();
        let groups = points.div_ceil(4);
        let (row, matrix) = (vec![[0.0; 4]; groups], Matrix::empty(points));
        let weights = Weights(vec![[[0.0; 4]; 2]; groups]);
        let projection = Projection {
            position: matrix.clone(),
            position_low: matrix.clone(),
            onto_rates: matrix.clone(),
        };
        let mut fixed = Self {
            points,
            groups,
            nodes: row.clone(),
            reach: row.clone(),
            reach_low: row,
            once: matrix.clone(),
            once_low: matrix.clone(),
            twice: matrix.clone(),
            twice_low: matrix.clone(),
            weights: weights.clone(),
            lever: weights,
            projected: vec![projection; usize::from(!scheme.collocated)],
            continued: matrix,
        };
        let mut target = Target {
            nodes: &mut fixed.nodes,
            reach: &mut fixed.reach,
            reach_low: &mut fixed.reach_low,
            once: &mut fixed.once.columns,
            once_low: &mut fixed.once_low.columns,
            twice: &mut fixed.twice.columns,
            twice_low: &mut fixed.twice_low.columns,
            weights: &mut fixed.weights.0,
            lever: &mut fixed.lever.0,
            continued: &mut fixed.continued.columns,
            projection: fixed.projected.first_mut().map(|one| ProjectionTarget {
                position: &mut one.position.columns,
                position_low: &mut one.position_low.columns,
                onto_rates: &mut one.onto_rates.columns,
            }),
        };
        target.fill(scheme);
        fixed
    }
}
