//! The data by which two runs are compared: states and outputs at common times.

use std::ops::Range;

/// One row of numbers for each time: coordinates, momenta, outputs.
#[derive(Clone, Debug, Default)]
pub(crate) struct Trace {
    /// The column ranges of each kind: all coordinates, all momenta, each single output.
    kinds: Vec<Range<usize>>,
    rows: Vec<f64>,
    /// The number of events that had changed the motion, for each row.
    acts: Vec<usize>,
    /// The largest finite magnitude of each kind so far, also between the rows.
    sizes: Vec<f64>,
    lost: Option<Lost>,
}

/// An output that is not finite.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Lost {
    /// The index of the output.
    pub(crate) output: usize,
    /// The index of the first row in which it is not finite.
    pub(crate) row: usize,
}

impl Trace {
    /// An empty trace for a number of coordinates and of outputs.
    pub(crate) fn new(coordinates: usize, outputs: usize) -> Self {
        let n = coordinates;
        let outputs = (2 * n..2 * n + outputs).map(|k| k..k + 1);
        let kinds: Vec<_> = [0..n, n..2 * n].into_iter().chain(outputs).collect();
        Self {
            sizes: vec![0.0; kinds.len()],
            kinds,
            rows: Vec::new(),
            acts: Vec::new(),
            lost: None,
        }
    }

    /// The first output that is not finite in a row.
    pub(crate) fn lost(&self) -> Option<Lost> {
        self.lost
    }

    /// Takes the numbers at one time; they become a row if `keeps`.
    pub(crate) fn pass(&mut self, row: &[f64], acts: usize, keeps: bool) {
        for (size, kind) in self.sizes.iter_mut().zip(&self.kinds) {
            *size = largest(*size, &row[kind.clone()]);
        }
        if keeps {
            let outputs = self.kinds.iter().skip(2).map(|kind| row[kind.start]);
            let lost = outputs.map(f64::is_finite).position(|is_finite| !is_finite);
            let number = self.acts.len();
            let here = lost.map(|output| Lost {
                output,
                row: number,
            });
            self.lost = self.lost.or(here);
            self.rows.extend_from_slice(row);
            self.acts.push(acts);
        }
    }

    /// The length of a row.
    pub(crate) fn width(&self) -> usize {
        self.kinds.last().map_or(0, |kind| kind.end)
    }

    /// The largest difference of each kind between two rows.
    pub(crate) fn differences(&self, a: &[f64], b: &[f64], differences: &mut Vec<f64>) {
        differences.clear();
        differences.extend(self.kinds.iter().map(|kind| {
            let pairs = a[kind.clone()].iter().zip(&b[kind.clone()]);
            // Infinite if something is not finite, since `f64::max` would ignore NaN.
            pairs.fold(0.0, |most: f64, (a, b)| most.max(finite((a - b).abs())))
        }));
    }

    /// The largest magnitude of each kind, including those of a row.
    pub(crate) fn sizes_with(&self, row: &[f64], sizes: &mut Vec<f64>) {
        sizes.clear();
        let kinds = self.kinds.iter().zip(&self.sizes);
        sizes.extend(kinds.map(|(kind, size)| largest(*size, &row[kind.clone()])));
    }

    fn rows(&self) -> impl Iterator<Item = &[f64]> {
        self.rows.chunks_exact(self.width().max(1))
    }
}

/// The largest relative difference at each time, for each kind, relative to the largest magnitude of that kind in both
/// runs. Infinite if something is not finite, or if one run is an event ahead of the other for more than one time. At a
/// single such time the difference is left out: the time of the event is as uncertain as the states, which later rows
/// compare.
pub(crate) fn difference(a: &Trace, b: &Trace) -> Vec<Vec<f64>> {
    let is_same = |row: usize| a.acts.get(row) == b.acts.get(row);
    let side = |row: usize| {
        if is_same(row) {
            Side::Same
        } else if row + 1 < a.acts.len().min(b.acts.len()) && is_same(row + 1) {
            Side::Between
        } else {
            Side::Different
        }
    };
    let mut differences = Vec::new();
    for (k, kind) in a.kinds.iter().enumerate() {
        let scale = a.sizes[k].max(b.sizes[k]);
        let relative = |(a, b): (&[f64], &[f64])| {
            let pairs = a[kind.clone()].iter().zip(&b[kind.clone()]);
            let largest = pairs.fold(0.0, |most: f64, (a, b)| most.max(finite((a - b).abs())));
            // The relative difference of zero and zero is zero.
            if largest == 0.0 {
                0.0
            } else {
                finite(largest / scale)
            }
        };
        let at = |(row, pair)| match side(row) {
            Side::Same => relative(pair),
            Side::Between => 0.0,
            Side::Different => f64::INFINITY,
        };
        differences.push(a.rows().zip(b.rows()).enumerate().map(at).collect());
    }
    differences
}

/// Whether two runs have passed the same events.
enum Side {
    Same,
    /// One run has passed an event that the other will pass before the next row.
    Between,
    /// One run has passed an event that the other does not pass.
    Different,
}

/// The largest magnitude including earlier ones. Infinite values, such as 1/x at zero, are skipped: relative to them
/// all errors would vanish.
fn largest(so_far: f64, numbers: &[f64]) -> f64 {
    let finite = numbers.iter().filter(|x| x.is_finite());
    finite.fold(so_far, |largest, x| largest.max(x.abs()))
}

fn finite(x: f64) -> f64 {
    if x.is_finite() { x } else { f64::INFINITY }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn trace(rows: &[[f64; 3]]) -> Trace {
        let mut trace = Trace::new(1, 1);
        for row in rows {
            trace.pass(row, 0, true);
        }
        trace
    }

    #[test]
    fn every_kind_has_a_scale_of_its_own() {
        let a = trace(&[[1.0, 100.0, 0.0], [2.0, 50.0, 0.0]]);
        let b = trace(&[[1.0, 101.0, 0.0], [2.1, 50.0, 0.0]]);
        let expected = [[0.0, 0.1 / 2.1], [1.0 / 101.0, 0.0], [0.0, 0.0]];
        for (found, expected) in difference(&a, &b).iter().zip(expected) {
            for (found, expected) in found.iter().zip(expected) {
                assert!((found - expected).abs() < 1e-15);
            }
        }
    }

    #[test]
    fn numbers_between_the_rows_count_for_the_scale() {
        let (mut a, b) = (trace(&[[1.0, 1e-9, 1.0]]), trace(&[[1.0, 0.0, 1.0]]));
        a.pass(&[1.0, 1.0, 1.0], 0, false);
        assert_eq!(difference(&a, &b)[1], [1e-9]);
    }

    #[test]
    fn what_is_infinite_between_the_rows_is_no_scale() {
        let (mut a, b) = (trace(&[[1.0, 1.0, 2.0]]), trace(&[[1.0, 1.0, 1.0]]));
        a.pass(&[1.0, 1.0, f64::INFINITY], 0, false);
        assert_eq!(difference(&a, &b)[2], [0.5]);
        let mut sizes = Vec::new();
        a.sizes_with(&[1.0, f64::NEG_INFINITY, 3.0], &mut sizes);
        assert_eq!(sizes, [1.0, 1.0, 3.0]);
    }

    #[test]
    fn outputs_that_are_not_finite_are_told() {
        let nan = f64::NAN;
        let trace = trace(&[[1.0, 1.0, 1.0], [1.0, nan, 1.0], [1.0, 1.0, nan]]);
        assert_eq!(trace.lost(), Some(Lost { output: 0, row: 2 }));
    }

    #[test]
    fn what_is_no_number_is_an_infinite_error() {
        let (a, b) = (trace(&[[f64::NAN, 1.0, 1.0]]), trace(&[[1.0, 1.0, 1.0]]));
        assert_eq!(difference(&a, &b)[0], [f64::INFINITY]);
    }

    /// One run meets an event one row earlier than the other: this row is left out, unless the other run never meets
    /// the event.
    #[test]
    fn runs_are_compared_between_the_same_events() {
        let of = |acts: [usize; 4], x: [f64; 4]| {
            let mut trace = Trace::new(1, 0);
            for (acts, x) in acts.into_iter().zip(x) {
                trace.pass(&[x, 1.0], acts, true);
            }
            trace
        };
        let a = of([0, 0, 1, 1], [1.0, 0.5, -0.5, 1.0]);
        let b = of([0, 1, 1, 1], [1.0, -0.5, -0.5, 0.5]);
        assert_eq!(difference(&a, &b)[0], [0.0, 0.0, 0.0, 0.5]);
        let c = of([0, 1, 2, 2], [1.0, 0.5, -0.5, 1.0]);
        let infinite = f64::INFINITY;
        assert_eq!(difference(&a, &c)[0], [0.0, infinite, infinite, infinite]);
    }
}
