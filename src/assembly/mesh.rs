//! Meshes of assembled problems.

use std::fmt;
use tfe_runtime::condenser::Direction;

/// The ends of elements as fractions of a span, from 0 to 1.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Mesh {
    fractions: Vec<f64>,
}

impl Mesh {
    /// Elements as long as their weights say; without weights all alike.
    pub(crate) fn new(elements: usize, weights: &[f64]) -> Result<Self, MeshError> {
        if elements == 0 {
            return Err(MeshError::NoElements);
        }
        if weights.is_empty() {
            let fractions = (0..=elements).map(|e| e as f64 / elements as f64).collect();
            return Ok(Self { fractions });
        }
        let total: f64 = weights.iter().sum();
        for (element, weight) in weights.iter().enumerate() {
            if !(*weight > 0.0 && total.is_finite()) {
                return Err(MeshError::Weight {
                    element,
                    weight: *weight,
                });
            }
        }
        let mut sum = 0.0;
        let mut fractions = vec![0.0];
        for weight in weights {
            sum += weight;
            fractions.push(sum / total);
        }
        // The sums need not agree to the last bit.
        fractions[elements] = 1.0;
        Ok(Self { fractions })
    }

    /// The number of elements.
    pub(crate) fn elements(&self) -> usize {
        self.fractions.len() - 1
    }

    /// The part of the span that an element takes.
    pub(crate) fn share(&self, element: usize) -> f64 {
        self.fractions[element + 1] - self.fractions[element]
    }

    /// Start time and length of an element of a span.
    pub(crate) fn place(&self, element: usize, start: f64, length: f64) -> (f64, f64) {
        (
            start + self.fractions[element] * length,
            self.share(element) * length,
        )
    }

    /// The times of all ends.
    pub(crate) fn times(&self, start: f64, length: f64) -> impl Iterator<Item = f64> {
        self.fractions
            .iter()
            .map(move |fraction| start + fraction * length)
    }

    /// What a unit of the length of the span changes in an element.
    pub(crate) fn stretched(&self, element: usize) -> Direction {
        Direction {
            time: self.fractions[element],
            length: self.share(element),
            ..Direction::default()
        }
    }
}

/// Why a mesh is none.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum MeshError {
    /// There is not a single element.
    NoElements,
    /// A weight of a graded mesh is not positive, or the weights have no finite sum.
    Weight {
        /// Which element.
        element: usize,
        /// Its weight.
        weight: f64,
    },
}

impl fmt::Display for MeshError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoElements => f.write_str("there must be at least one element"),
            Self::Weight { element, weight } => write!(
                f,
                "element {element} of the graded mesh has the weight {weight}; weights must be positive, with a finite sum"
            ),
        }
    }
}

impl std::error::Error for MeshError {}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_and_graded_elements_fill_the_span() {
        let equal = Mesh::new(4, &[]).expect("a mesh");
        assert_eq!(equal.place(3, 1.0, 8.0), (7.0, 2.0));
        let graded = Mesh::new(3, &[1.0, 2.0, 0.7]).expect("a mesh");
        assert_eq!(graded.elements(), 3);
        assert_eq!(graded.times(0.0, 3.7).last(), Some(3.7));
        assert!((graded.place(1, 0.0, 3.7).1 - 2.0).abs() < 1e-15);
    }

    #[test]
    fn meshes_without_elements_or_with_bad_weights_are_errors() {
        assert_eq!(Mesh::new(0, &[]), Err(MeshError::NoElements));
        for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert!(Mesh::new(2, &[1.0, bad]).is_err());
        }
    }
}
