//! Meshes of assembled problems, relative to their span.

use crate::numbers::Short;
use std::fmt;
use tfe_runtime::condenser::Direction;

/// The largest number of elements. A larger one is a mistake: the matrices of so many would need several gigabytes.
const MAX_ELEMENTS: usize = 10_000_000;

/// The nodes of a mesh as fractions of its span, from 0 to 1.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Mesh {
    fractions: Vec<f64>,
}

impl Mesh {
    /// Elements with lengths proportional to weights; equal lengths without weights.
    pub(crate) fn new(elements: usize, weights: &[f64]) -> Result<Self, MeshError> {
        if elements == 0 {
            return Err(MeshError::NoElements);
        }
        if elements > MAX_ELEMENTS {
            return Err(MeshError::TooManyElements { elements });
        }
        if weights.is_empty() {
            let fractions = (0..=elements).map(|e| e as f64 / elements as f64).collect();
            return Ok(Self { fractions });
        }
        let total: f64 = weights.iter().sum();
        let is_wrong = |weight: &f64| !(*weight > 0.0 && weight.is_finite());
        let wrong = weights.iter().position(is_wrong);
        // If only their sum overflows, it is the largest.
        let largest = (0..weights.len()).max_by(|a, b| weights[*a].total_cmp(&weights[*b]));
        if let Some(element) = wrong.or(largest.filter(|_| !total.is_finite())) {
            return Err(MeshError::Weight {
                element,
                weight: weights[element],
            });
        }
        let mut sum = 0.0;
        let mut fractions = vec![0.0];
        for weight in weights {
            sum += weight;
            fractions.push(sum / total);
        }
        // Rounding may leave the sum slightly off 1.
        fractions[elements] = 1.0;
        let mesh = Self { fractions };
        match (0..elements).find(|element| mesh.share(*element) <= 0.0) {
            Some(element) => Err(MeshError::TooShort {
                element,
                weight: weights[element],
                total,
            }),
            None => Ok(mesh),
        }
    }

    /// The mesh with every element halved.
    pub(crate) fn halved(&self) -> Self {
        let pairs = self.fractions.windows(2);
        let starts = pairs.flat_map(|pair| [pair[0], 0.5 * (pair[0] + pair[1])]);
        Self {
            fractions: starts.chain([1.0]).collect(),
        }
    }

    /// The number of elements.
    pub(crate) fn elements(&self) -> usize {
        self.fractions.len() - 1
    }

    /// The length of an element as a fraction of the span.
    pub(crate) fn share(&self, element: usize) -> f64 {
        self.fractions[element + 1] - self.fractions[element]
    }

    /// The start time and the length of an element, for a given span.
    pub(crate) fn place(&self, element: usize, start: f64, length: f64) -> (f64, f64) {
        (
            start + self.fractions[element] * length,
            self.share(element) * length,
        )
    }

    /// The times of all nodes.
    pub(crate) fn times(&self, start: f64, length: f64) -> impl Iterator<Item = f64> {
        self.fractions
            .iter()
            .map(move |fraction| start + fraction * length)
    }

    /// The same with the last time exactly as given, which start and length may miss by rounding.
    pub(crate) fn times_to(&self, end: f64, start: f64, length: f64) -> Vec<f64> {
        let mut times: Vec<f64> = self.times(start, length).collect();
        if let Some(last) = times.last_mut() {
            *last = end;
        }
        times
    }

    /// The direction that lengthens the span by one unit, for one element.
    pub(crate) fn stretched(&self, element: usize) -> Direction {
        Direction {
            time: self.fractions[element],
            length: self.share(element),
            ..Direction::default()
        }
    }

    /// Lengths of elements that divide the solution into equal arc lengths in scaled time and phase space; the nodes
    /// are momenta and coordinates. No more than [`MAX_ELEMENTS`] are made.
    pub(crate) fn equidistributed(&self, nodes: &[[&[f64]; 2]], elements: usize) -> Vec<f64> {
        /// A component that varies less than this, relative to its largest value, is constant up to rounding.
        const CONSERVED: f64 = 1e-9;
        let elements = elements.min(MAX_ELEMENTS);
        let components = nodes.first().map_or(0, |[p, q]| p.len() + q.len());
        let component = |[p, q]: &[&[f64]; 2], k: usize| match k.checked_sub(p.len()) {
            None => p[k],
            Some(k) => q[k],
        };
        let mut inverse_ranges = vec![0.0; components];
        for (k, inverse) in inverse_ranges.iter_mut().enumerate() {
            let values = nodes.iter().map(|node| component(node, k));
            let (low, high) = values
                .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| {
                    (low.min(value), high.max(value))
                });
            // A variation by rounding only: the component is conserved.
            if high - low > CONSERVED * high.abs().max(low.abs()) {
                *inverse = 1.0 / (high - low);
            }
        }
        // The arc length at the nodes.
        let mut lengths = vec![0.0];
        let mut total = 0.0;
        for (element, pair) in nodes.windows(2).enumerate() {
            let mut square = self.share(element).powi(2);
            for (k, inverse) in inverse_ranges.iter().enumerate() {
                let change = component(&pair[1], k) - component(&pair[0], k);
                square += (inverse * change).powi(2);
            }
            total += square.sqrt();
            lengths.push(total);
        }
        // The inverse function at equally spaced arc lengths.
        let times: Vec<f64> = self.times(0.0, 1.0).collect();
        let mut weights = Vec::with_capacity(elements);
        let (mut at, mut last) = (0, 0.0);
        for k in 1..=elements {
            let length = total * k as f64 / elements as f64;
            while at + 2 < lengths.len() && lengths[at + 1] < length {
                at += 1;
            }
            let part = (length - lengths[at]) / (lengths[at + 1] - lengths[at]);
            let time = times[at] + part.min(1.0) * (times[at + 1] - times[at]);
            weights.push(time - last);
            last = time;
        }
        weights
    }
}

/// Why a mesh of elements is invalid.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum MeshError {
    /// The number of elements is zero.
    NoElements,
    /// There are more than ten million elements.
    TooManyElements {
        /// The number asked for.
        elements: usize,
    },
    /// A weight of a graded mesh is so small beside the sum of all that its element has no length: a rounding of the
    /// time is longer.
    TooShort {
        /// The index of the element.
        element: usize,
        /// Its weight.
        weight: f64,
        /// The sum of all weights.
        total: f64,
    },
    /// A weight of a graded mesh is not positive, or the sum of the weights is not finite.
    Weight {
        /// The index of the element.
        element: usize,
        /// Its weight.
        weight: f64,
    },
}

impl fmt::Display for MeshError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoElements => f.write_str("there must be at least one element"),
            Self::TooManyElements { elements } => write!(
                f,
                "{elements} elements are too many: at most {MAX_ELEMENTS} can be solved together"
            ),
            Self::TooShort {
                element,
                weight,
                total,
            } => write!(
                f,
                "element {element} of the graded mesh has the weight {} of {} in all, so that its length vanishes in rounding: give a larger weight, or leave the element out",
                Short(*weight),
                Short(*total)
            ),
            Self::Weight { element, weight } => write!(
                f,
                "element {element} of the graded mesh has the weight {}; weights must be positive, with a finite sum",
                Short(*weight)
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
    fn roundings_of_what_is_conserved_are_no_motion() {
        let p = [1.0, 1.0 + f64::EPSILON, 1.0 + f64::EPSILON];
        let q = [0.0, 1.0, 2.0];
        let nodes: Vec<[&[f64]; 2]> = (0..3).map(|k| [&p[k..=k], &q[k..=k]]).collect();
        let mesh = Mesh::new(2, &[]).expect("a mesh");
        for weight in mesh.equidistributed(&nodes, 2) {
            assert!((weight - 0.5).abs() < 1e-15);
        }
    }

    #[test]
    fn no_more_elements_are_made_than_can_be_solved() {
        let (p, q) = ([0.0, 1.0], [1.0, 0.0]);
        let nodes: Vec<[&[f64]; 2]> = (0..2).map(|k| [&p[k..=k], &q[k..=k]]).collect();
        let mesh = Mesh::new(1, &[]).expect("a mesh");
        let weights = mesh.equidistributed(&nodes, usize::MAX);
        assert_eq!(weights.len(), MAX_ELEMENTS);
        assert!(mesh.equidistributed(&nodes, 0).is_empty());
    }

    #[test]
    fn meshes_without_elements_or_with_bad_weights_are_errors() {
        assert_eq!(Mesh::new(0, &[]), Err(MeshError::NoElements));
        for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            let told = Mesh::new(2, &[1.0, bad]).expect_err("a bad weight");
            assert!(
                matches!(told, MeshError::Weight { element: 1, .. }),
                "{told}"
            );
        }
        let many = Mesh::new(usize::MAX, &[]).expect_err("no memory");
        let told = "elements are too many: at most 10000000 can be solved together";
        assert_eq!(many.to_string(), format!("{} {told}", usize::MAX));
        // A weight that vanishes in the sum.
        for (weights, place) in [([1.0, 1e-20, 1.0], 1), ([1e-320, 1.0, 1e300], 0)] {
            let told = Mesh::new(3, &weights).expect_err("no length");
            assert!(
                matches!(told, MeshError::TooShort { element, .. } if element == place),
                "{told}"
            );
            assert!(!told.to_string().contains("000000"), "{told}");
        }
        assert!(Mesh::new(2, &[1e-20, 1.0]).is_ok());
        // Only the sum overflows.
        let told = Mesh::new(3, &[1.0, 1e308, 9e307]).expect_err("no finite sum");
        assert!(
            matches!(told, MeshError::Weight { element: 1, .. }),
            "{told}"
        );
        assert!(told.to_string().contains("the weight 1e308;"), "{told}");
    }
}
