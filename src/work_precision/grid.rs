//! The mesh of one run.

use super::error::WorkPrecisionError;
use crate::motion::{MAX_STEPS, count_steps};
use std::ops::Range;

/// A span divided into equal steps; the last one may be shorter.
#[derive(Clone, Debug)]
pub(crate) struct Grid {
    start: f64,
    end: f64,
    /// The step that was asked for, positive and at most the span.
    step: f64,
    /// The length of all elements except possibly the last, with sign.
    length: f64,
    steps: usize,
    /// Whether the last step is as long as the others.
    whole: bool,
}

/// A node at which a run is examined.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Look {
    pub(super) node: usize,
    /// Whether the state is compared with the reference, in addition to the check of the energy.
    pub(super) compare: bool,
}

/// The number of nodes, about equally spaced, at which runs are compared with the reference.
const COMPARED: usize = 10;
/// The largest number of nodes at which the energy is evaluated; the time for this is not measured.
const LOOKS: usize = 1000;

impl Grid {
    pub(crate) fn new(span: &Range<f64>, step: f64) -> Result<Self, WorkPrecisionError> {
        let Range { start, end } = *span;
        if !(start.is_finite() && end.is_finite() && start != end && (end - start).is_finite()) {
            return Err(WorkPrecisionError::Span { start, end });
        }
        if !(step.is_finite() && step != 0.0) {
            return Err(WorkPrecisionError::Step { step });
        }
        let ratio = (end - start).abs() / step.abs();
        if !(ratio <= MAX_STEPS) {
            return Err(WorkPrecisionError::TooManySteps {
                span: end - start,
                step,
            });
        }
        let signed = step.abs().copysign(end - start);
        let (steps, whole) = count_steps(span, signed);
        let length = if whole || steps == 1.0 {
            (end - start) / steps
        } else {
            signed
        };
        Ok(Self {
            start,
            end,
            step: step.abs().min((end - start).abs()),
            length,
            steps: steps as usize,
            whole: whole || steps == 1.0,
        })
    }

    /// The step that was asked for, without sign and at most the span.
    pub(crate) fn step(&self) -> f64 {
        self.step
    }

    pub(crate) fn steps(&self) -> usize {
        self.steps
    }

    /// The time of the k-th node: computed by a product, not a sum; the last one is exactly the end.
    pub(crate) fn node(&self, k: usize) -> f64 {
        if k >= self.steps {
            self.end
        } else {
            self.start + k as f64 * self.length
        }
    }

    /// Start, end and length of the k-th element.
    pub(crate) fn element(&self, k: usize) -> (f64, f64, f64) {
        let (t, next) = (self.node(k), self.node(k + 1));
        let h = if self.whole || k + 1 < self.steps {
            self.length
        } else {
            next - t
        };
        (t, next, h)
    }

    /// The nodes at which the run is examined, in the order of time; the last one is the end.
    pub(super) fn looks(&self) -> Vec<Look> {
        let stride = self.steps.div_ceil(LOOKS);
        let mut looks: Vec<Look> = (1..)
            .map(|k| k * stride)
            .take_while(|node| *node < self.steps)
            .map(|node| Look {
                node,
                compare: false,
            })
            .collect();
        // In `f64`, since products of counts may overflow.
        let part = |k: usize| self.steps as f64 * (k as f64 / COMPARED as f64);
        let compared = (1..COMPARED).map(|k| part(k).round() as usize);
        looks.extend(
            compared
                .filter(|node| (1..self.steps).contains(node))
                .chain([self.steps])
                .map(|node| Look {
                    node,
                    compare: true,
                }),
        );
        looks.sort_by_key(|look| (look.node, !look.compare));
        looks.dedup_by_key(|look| look.node);
        looks
    }

    /// The times at which the run is compared with the reference.
    pub(super) fn compared(&self) -> impl Iterator<Item = f64> + '_ {
        let looks = self.looks().into_iter();
        looks
            .filter(|look| look.compare)
            .map(|look| self.node(look.node))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn looks_end_at_the_end_and_are_few() {
        for step in [7.0, 10.0, 3.0, 0.1, 1e-4] {
            let grid = Grid::new(&(0.0..10.0), step).unwrap();
            let looks = grid.looks();
            assert!(looks.len() <= LOOKS + COMPARED);
            assert!(looks.windows(2).all(|pair| pair[0].node < pair[1].node));
            let last = looks.last().unwrap();
            assert!(last.compare && last.node == grid.steps());
            assert_eq!(grid.compared().last(), Some(10.0));
        }
        let grid = Grid::new(&(0.0..10.0), 0.1).unwrap();
        assert_eq!(grid.compared().count(), COMPARED);
    }

    #[test]
    fn lengths_add_up_forwards_and_backwards() {
        for (span, step) in [(0.0..1.0, 0.3), (1.0..-2.0, 0.7), (0.0..1.0, 5.0)] {
            let grid = Grid::new(&span, step).unwrap();
            let sum: f64 = (0..grid.steps()).map(|k| grid.element(k).2).sum();
            // One ulp for each of at most five additions.
            assert!((sum - (span.end - span.start)).abs() < 5.0 * 3.0 * f64::EPSILON);
            assert_eq!(grid.node(grid.steps()), span.end);
            // The step that is plotted is one that was made.
            assert_eq!(grid.step(), step.min((span.end - span.start).abs()));
        }
    }

    /// 9 steps end one ulp before 1e9 + 0.009; a tenth step would have no length.
    #[test]
    fn roundings_of_the_times_are_no_steps() {
        for (start, step) in [(1e9, 1e-3), (-1e9, 1e-3), (1.7e9, 0.01)] {
            for count in 1..100_u32 {
                let end = start + f64::from(count) * step;
                for span in [start..end, end..start] {
                    let grid = Grid::new(&span, step).unwrap();
                    let lengths = (0..grid.steps()).map(|k| grid.element(k).2.abs());
                    assert!(lengths.fold(f64::INFINITY, f64::min) > 0.9 * step);
                    assert_eq!(grid.steps(), count as usize, "{span:?}");
                }
            }
        }
    }

    #[test]
    fn what_is_no_grid() {
        use WorkPrecisionError::{Span, Step, TooManySteps};
        let of = |span, step| Grid::new(&span, step).unwrap_err();
        assert!(matches!(of(0.0..0.0, 0.1), Span { .. }));
        assert!(matches!(of(0.0..f64::NAN, 0.1), Span { .. }));
        assert!(matches!(of(0.0..1.0, 0.0), Step { .. }));
        assert!(matches!(of(0.0..1.0, f64::INFINITY), Step { .. }));
        assert!(matches!(of(0.0..1e300, 1e-300), TooManySteps { .. }));
    }
}
