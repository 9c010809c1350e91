//! What makes the solution of an assembled problem doubtful.

use crate::numbers::Short;
use std::fmt;

/// What makes an orbit or a boundary-value motion doubtful although its equations are solved.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum MeshWarning {
    /// The elements do not resolve the motion: one correction by Newton's method on elements of half the length changes
    /// the solution by more than 3 % of its extent.
    Unresolved {
        /// The number of elements.
        elements: usize,
        /// The largest change of a coordinate or a momentum, relative to the extent (largest minus smallest value) of
        /// all coordinates or all momenta, or of an unknown period relative to it; infinite if the equations are
        /// singular on elements of half the length.
        change: f64,
    },
    /// A force has a kink or a jump inside an element, because a `select`, `abs`, `sign`, `min` or `max` changes its
    /// branch there. Elements then lose their order, and where the force jumps, multipliers and derivatives are wrong: the
    /// change of the time of the jump is missing. Of orbits,
    /// [`PeriodicOrbit::of_simulation`](crate::PeriodicOrbit::of_simulation) ends elements there.
    KinksCrossed {
        /// The start of the first such element.
        time: f64,
    },
}

impl fmt::Display for MeshWarning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (elements, change) = match self {
            Self::Unresolved { elements, change } => (elements, change),
            Self::KinksCrossed { time } => {
                return write!(
                    f,
                    "a force has a kink or a jump inside an element, first behind t = {}: errors fall more slowly with the number of elements, and \
                     where it jumps, multipliers and derivatives are wrong; for orbits, `PeriodicOrbit::of_simulation(&simulation)` ends elements there",
                    Short(*time)
                );
            }
        };
        let noun = if *elements == 1 {
            "element does"
        } else {
            "elements do"
        };
        write!(f, "{elements} {noun} not resolve the motion: ")?;
        if change.is_infinite() {
            f.write_str("the equations are singular on elements of half the length")?;
        } else {
            write!(
                f,
                "elements of half the length change it by {change:.1e} of its extent"
            )?;
        }
        f.write_str("; take more elements, or an element with more nodes")
    }
}
