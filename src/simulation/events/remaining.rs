//! The zero crossings of an element that are still to be processed.

use super::search::Root;

/// The roots in an element that are still to be processed.
#[derive(Clone, Debug)]
pub(super) struct Remaining {
    /// In the order of time on the polynomial.
    roots: Vec<Root>,
    /// The signs of the functions after the last root; 0 if unknown.
    ends: Vec<f64>,
}

impl Remaining {
    pub(super) fn new(roots: Vec<Root>, ends: Vec<f64>) -> Self {
        Self { roots, ends }
    }

    pub(super) fn first(&self) -> Option<Root> {
        self.roots.first().copied()
    }

    /// The next root of a function.
    pub(super) fn next(&self, function: usize) -> Option<Root> {
        let mut roots = self.roots.iter();
        roots.find(|root| root.function == function).copied()
    }

    /// The sign of a function before its next root.
    pub(super) fn side(&self, function: usize) -> f64 {
        match self.next(function) {
            Some(root) if root.rises => -1.0,
            Some(_) => 1.0,
            None => self.ends[function],
        }
    }

    /// Removes the next root of a function, which was processed or is not watched. If there is none, the sign of the
    /// function becomes unknown.
    pub(super) fn take(&mut self, function: usize) {
        match self.roots.iter().position(|one| one.function == function) {
            Some(place) => {
                self.roots.remove(place);
            }
            None => self.ends[function] = 0.0,
        }
    }

    /// The signs at the end of the element.
    pub(super) fn into_sides(self) -> Vec<f64> {
        self.ends
    }
}

/// A zero crossing of a function.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Crossed {
    pub(super) function: usize,
    pub(super) rises: bool,
}

impl From<&Root> for Crossed {
    fn from(root: &Root) -> Self {
        Self {
            function: root.function,
            rises: root.rises,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_remains_tells_sides() {
        let root = |function, tau, rises| Root {
            function,
            tau,
            rises,
        };
        let roots = vec![root(1, 0.1, true), root(0, 0.2, false), root(1, 0.3, false)];
        let mut remaining = Remaining::new(roots, vec![-1.0, -1.0, 1.0]);
        let sides = |remaining: &Remaining| [0, 1, 2].map(|function| remaining.side(function));
        assert_eq!(sides(&remaining), [1.0, -1.0, 1.0]);
        remaining.take(1);
        assert_eq!(sides(&remaining), [1.0, 1.0, 1.0]);
        assert_eq!(remaining.first(), Some(root(0, 0.2, false)));
        remaining.take(0);
        remaining.take(1);
        assert_eq!(sides(&remaining), [-1.0, -1.0, 1.0]);
        remaining.take(2);
        assert_eq!(remaining.into_sides(), [-1.0, -1.0, 0.0]);
    }
}
