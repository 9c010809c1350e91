//! Comparison of orbits of a branch with those of elements of half the length.
//!
//! Where a branch approaches a homoclinic orbit, its parameter tends to a limit exponentially with the period. Soon the
//! discretisation error changes the parameter from orbit to orbit more than the model does, although every element
//! still has small errors: the sign of dλ/ds is then that of the elements. So what is compared is not elements but
//! test functions, at the orbit of the finer mesh that has the same place on the branch.

use super::arc::Metric;
use super::branch::Frame;
use super::events::{EventKind, ROUND_OFF, Tests};
use super::problem::Continued;
use super::solved::{Solved, solved};
use super::warning::BranchWarning;
use crate::assembly::{Assembly, Control, Iterate, Problem};
use crate::numbers::larger;
use crate::periodic::problem::Periodic;
use crate::periodic::{OrbitError, along_motion};
use tfe_runtime::{Element, Model};

/// The equations of an orbit on elements of half the length, with their workspace.
pub(super) struct Halves<'c, M, const N: usize> {
    problem: Continued<'c, M, N>,
    assembly: Assembly<N>,
    control: Control,
}

/// An orbit of a branch beside that of elements of half the length.
pub(super) struct MeshComparison {
    own: Tests,
    finer: Option<Finer>,
}

/// The orbit of elements of half the length.
struct Finer {
    tests: Tests,
    /// Its distance from the orbit of the branch, at the nodes of that; see [`Metric::relative`].
    distance: f64,
}

impl<'c, M: Model<N> + Clone, const N: usize> Halves<'c, M, N> {
    pub(super) fn new(
        problem: &Continued<'c, M, N>,
        element: Element,
        control: Control,
    ) -> Result<Self, OrbitError> {
        let orbit = Periodic {
            mesh: problem.orbit.mesh.halved(),
            ..problem.orbit.clone()
        };
        let (globals, dense) = (orbit.globals.len() + 1, orbit.dense() + 1);
        let assembly = Assembly::new::<M>(element, orbit.mesh.elements(), globals, dense)
            .map_err(|error| OrbitError::Assembly(error.into()))?
            .with_tangent();
        let problem = Continued {
            model: problem.model.clone(),
            orbit,
            field: problem.field,
            sensitivity: problem.sensitivity,
            period: problem.period,
            rate: problem.rate,
            width: problem.width,
            row: problem.row.clone(),
        };
        Ok(Self {
            problem,
            assembly,
            control,
        })
    }

    /// Compares an orbit whose tangent is of unit length in the metric.
    pub(super) fn compare(
        &mut self,
        frame: &Frame<N>,
        metric: &Metric<N>,
        orbit: &Solved<M, N>,
    ) -> MeshComparison {
        let slope = orbit.tangent.globals.last().copied();
        MeshComparison {
            own: orbit.tests.with_slope(slope.unwrap_or(f64::NAN)),
            finer: self.finer(frame, &metric.on_halves(), orbit).ok(),
        }
    }

    /// The orbit of elements of half the length that differs from a given one by nothing along the branch.
    fn finer(
        &mut self,
        frame: &Frame<N>,
        metric: &Metric<N>,
        orbit: &Solved<M, N>,
    ) -> Result<Finer, OrbitError> {
        let Solved {
            member, floquet, ..
        } = orbit;
        let globals = member.iterate.globals.clone();
        self.problem.set_globals(&globals);
        let motion = frame
            .orbit(member, floquet.clone(), orbit.iterations)
            .motion();
        let along = |t: f64| along_motion(&member.model, &motion, t);
        let guess = self.assembly.along(&self.problem, along, globals)?;
        let direction = on_halves(&orbit.tangent);
        self.problem.row = metric.row(&guess, &direction, 0.0);
        let mut iterate = guess.clone();
        self.assembly
            .solve(&mut self.problem, &mut iterate, self.control)?;
        self.problem.orbit.check()?;
        let mut tangent = metric.unit(self.assembly.tangent());
        if metric.product(&direction, &tangent) < 0.0 {
            tangent.scale(-1.0);
        }
        let distance = metric.relative(&iterate.plus(-1.0, &guess));
        let solved = solved(&self.problem, &self.assembly, iterate, tangent, 1)?;
        Ok(Finer {
            tests: solved.tests,
            distance,
        })
    }
}

/// A tangent on elements of half the length, for products in which the nodes in the middle of elements have no weight.
fn on_halves<const N: usize>(tangent: &Iterate<N>) -> Iterate<N> {
    let nodes = tangent.nodes.iter().flat_map(|node| [*node, *node]);
    Iterate {
        nodes: nodes.take(2 * tangent.nodes.len() - 1).collect(),
        interiors: Vec::new(),
        globals: tangent.globals.clone(),
    }
}

/// The largest difference of a test function that is not an effect of the elements, relative to its values.
const MAX: f64 = 0.5;

/// The largest distance of the orbit of elements of half the length; runs have the same limit (T-121).
const FARTHEST: f64 = 0.03;

/// A test function that is smaller than this part of its value at the other end is zero up to the error of the
/// elements: the event may lie just beyond that end.
const AT_THE_END: f64 = 1e-3;

impl Finer {
    fn is_near(&self) -> bool {
        self.distance <= FARTHEST
    }
}

impl MeshComparison {
    /// Whether dλ/ds is that of the model, up to a part of its values here and at the orbit before.
    pub(super) fn is_direction_left(&self, before: f64) -> bool {
        let own = self.own.value(EventKind::Fold);
        let allowed = (MAX * own.abs().max(before.abs())).max(ROUND_OFF);
        self.finer.as_ref().is_some_and(|finer| {
            let slope = finer.tests.value(EventKind::Fold);
            finer.is_near() && (slope - own).abs() <= allowed
        })
    }

    /// The warning of a point whose direction is not that of the model.
    pub(super) fn warning(&self, point: usize, parameter: f64) -> BranchWarning {
        let finer = self.finer.as_ref();
        BranchWarning::Unresolved {
            point,
            parameter,
            slope: self.own.value(EventKind::Fold),
            halved: finer.map(|finer| finer.tests.value(EventKind::Fold)),
            distance: finer.map_or(f64::INFINITY, |finer| finer.distance),
        }
    }
}

/// Whether elements of half the length confirm that a test function changes its sign between two orbits; of one orbit,
/// that the function has its size there.
pub(super) fn are_confirmed(kind: EventKind, ends: &[MeshComparison]) -> bool {
    let sizes = ends.iter().map(|end| end.own.value(kind).abs());
    let largest = sizes.fold(0.0, larger);
    // The sign of a determinant may depend on the number of elements, so sizes are compared and changes of signs.
    let value = |end: &MeshComparison| {
        let finer = end.finer.as_ref().filter(|finer| finer.is_near())?;
        let value = finer.tests.value(kind);
        let is_left = (value.abs() - end.own.value(kind).abs()).abs() <= MAX * largest;
        is_left.then_some(value)
    };
    let Some(values) = ends.iter().map(value).collect::<Option<Vec<f64>>>() else {
        return false;
    };
    let mut pairs = values.windows(2);
    pairs.all(|pair| {
        let least = pair[0].abs().min(pair[1].abs());
        pair[0] * pair[1] < 0.0 || least <= AT_THE_END * largest
    })
}

#[cfg(test)]
mod tests {
    use super::super::events::Circumstances;
    use super::*;

    fn tests(slope: f64) -> Tests {
        Tests::new(&Circumstances {
            slope,
            sign: 1.0,
            floquet: &[],
            trivial: &[],
            symplectic: true,
        })
    }

    /// An orbit with dλ/ds on its own elements and on those of half the length.
    fn comparison(own: f64, finer: f64) -> MeshComparison {
        MeshComparison {
            own: tests(own),
            finer: Some(Finer {
                tests: tests(finer),
                distance: 1e-6,
            }),
        }
    }

    #[test]
    fn an_event_has_its_values_on_finer_elements() {
        let fold = |ends: [MeshComparison; 2]| are_confirmed(EventKind::Fold, &ends);
        assert!(fold([comparison(0.1, 0.1001), comparison(-0.2, -0.1999)]));
        // The finer elements have it just beside the first orbit.
        assert!(fold([comparison(1e-8, -1e-8), comparison(-0.2, -0.2)]));
        // A rotor on 60 elements towards a homoclinic orbit.
        assert!(!fold([
            comparison(-7.97e-9, -2.7e-10),
            comparison(4.5e-9, -3.5e-10)
        ]));
        // The values of an effect of the elements, with the same changes of sign.
        assert!(!fold([comparison(-8e-9, -3e-11), comparison(4e-9, 2e-11)]));
        // Only the sign of the second is one of the elements.
        assert!(!fold([comparison(1e-3, 1e-3), comparison(-1e-4, 3e-5)]));
        assert!(!fold([comparison(0.1, f64::NAN), comparison(-0.2, -0.2)]));
        let none = MeshComparison {
            own: tests(-0.2),
            finer: None,
        };
        assert!(!fold([comparison(0.1, 0.1), none]));
    }

    #[test]
    fn a_direction_is_left_beside_a_fold_but_not_where_all_are_small() {
        assert!(comparison(0.3, 0.31).is_direction_left(0.3));
        // A point at a fold, after one away from it.
        assert!(comparison(1e-7, -1e-7).is_direction_left(0.1));
        assert!(!comparison(-1.9e-8, -1e-10).is_direction_left(-1.7e-8));
        // A branch along which the parameter is constant, up to rounding errors.
        assert!(comparison(1e-15, -3e-15).is_direction_left(0.0));
        assert!(!comparison(f64::NAN, 0.1).is_direction_left(0.1));
    }
}
