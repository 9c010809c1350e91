//! Increments relative to the size of each declared array, or single coordinate, for iterations that have converged
//! relative to the largest coordinate.

use super::model::Model;
use super::space::Problem;
use crate::legendre::largest;
use crate::unlike::{ALIKE, Small, raise};
use alloc::vec::Vec;

/// The declarations of the coordinates of a model, as places where they begin; the last place is the end.
#[derive(Clone, Debug)]
pub(super) struct Declarations(Vec<usize>);

impl Declarations {
    pub(super) fn of<M: Model>(model: &M) -> Self {
        let n = model.len();
        let name = |a: usize| model.coordinate_name(a).name;
        let begins = |a: &usize| *a == 0 || name(*a) != name(*a - 1);
        let mut places: Vec<usize> = (0..n).filter(begins).collect();
        places.push(n);
        Self(places)
    }

    /// Whether velocities of one declaration may be small beside the largest one; false if there is only one.
    pub(super) fn may_be_unlike(&self, velocity: &[f64]) -> bool {
        let (mut least, mut most) = (f64::INFINITY, 0.0_f64);
        for places in self.0.windows(2) {
            let size = largest(&velocity[places[0]..places[1]]);
            (least, most) = (least.min(size), most.max(size));
        }
        self.0.len() > 2 && !(least > ALIKE * most)
    }

    /// The largest increment relative to the size of its declaration; `None` where none is small beside the largest
    /// one. `of` gives the size and the increment of a coordinate; sizes up to `noise` are those of rounding errors.
    pub(super) fn own_increment(
        &self,
        noise: f64,
        of: impl Fn(usize) -> (f64, f64),
    ) -> Option<f64> {
        if self.0.len() <= 2 {
            return None;
        }
        let largest_in = |places: &[usize]| {
            let (mut size, mut increment) = (0.0, 0.0);
            for a in places[0]..places[1] {
                let (its_size, its_increment) = of(a);
                raise(&mut size, its_size);
                raise(&mut increment, its_increment);
            }
            (size, increment)
        };
        let all = || self.0.windows(2).map(&largest_in);
        let mut size = 0.0;
        for (its_size, _) in all() {
            raise(&mut size, its_size);
        }
        let small = Small::beside(size, noise);
        let (mut most, mut is_any) = (0.0, false);
        for (its_size, increment) in all() {
            let weight = small.weight(its_size);
            is_any |= weight > 1.0;
            raise(&mut most, weight * increment);
        }
        is_any.then(|| most / size)
    }
}

/// The size of the velocity of a coordinate, and its increment, from the largest of its forces and of their changes.
pub(super) fn in_velocity(
    problem: &Problem,
    (h, a): (f64, usize),
    (force, change): (f64, f64),
) -> (f64, f64) {
    let reach = (h * problem.inertia.inverse[a]).abs();
    let size = problem.velocity[a].abs().max(reach * force);
    (size, reach * change)
}

/// What an iteration for forces keeps.
#[derive(Clone, Debug)]
pub(super) struct Settling {
    pub(super) declarations: Declarations,
    /// The forces before an iteration, those at the points of a coordinate next to each other.
    pub(super) before: Vec<f64>,
}

impl Settling {
    pub(super) fn of<M: Model>(model: &M) -> Self {
        Self {
            declarations: Declarations::of(model),
            before: Vec::new(),
        }
    }
}
