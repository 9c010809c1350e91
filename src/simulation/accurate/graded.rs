//! Which steps a run may have, and where they have to be short.

use super::pilots;
use super::repeatable::Repeatable;
use crate::accuracy::{
    Asked, Course, Graded, Grading, damping_element_for, element_for, explore, factor_for,
};
use tfe_runtime::{Element, Facts, Statistics};

/// Given nodes as a grading, with the factor 1 the nodes themselves.
pub(super) fn graded_by(nodes: &[f64], element: Element) -> Option<Graded> {
    let lengths = nodes.windows(2).map(|pair| (pair[1] - pair[0]).abs());
    Some(Graded {
        grading: Grading::new(nodes, &lengths.collect::<Vec<_>>())?,
        element,
        factor: 1.0,
    })
}

/// Where steps have to be short, by a pilot run that begins with the step `first`; `None` where equal steps are as good.
///
/// Elements that damp what is fast, or those of Gauss points where nothing is: where the fixed point contracted in nearly all steps.
pub(super) fn graded<R: Repeatable<N>, const N: usize>(
    run: &R,
    start: &R::State,
    asked: &Asked,
    damps: bool,
    first: f64,
    work: &mut Statistics,
) -> Option<Graded> {
    /// The part of steps that Newton's method may have made.
    const FEW: f64 = 0.1;
    /// What a step may be off by: with less of it the pilot run is longer than those that follow, with more it may step over what is fast.
    const LOCAL: f64 = 1e-7;
    let smooth = asked.element.unwrap_or_else(|| element_for(asked.accuracy));
    let element = match asked.element {
        Some(element) => element,
        None if damps => damping_element_for(asked.accuracy),
        None => smooth,
    };
    let length = (asked.span.end - asked.span.start).abs();
    let course = Course {
        span: asked.span.clone(),
        breaks: asked.breaks.clone(),
        longest: asked.longest.map_or(length, |step| step.abs().min(length)),
        power: element.order() as f64 + 1.0,
        first,
        local: LOCAL,
    };
    let mut pair = pilots::Pilots::new(run, element, &course, start).ok()?;
    let grading = explore(&course, &mut pair);
    *work = pair.work();
    let grading = grading?;
    let element = if asked.element.is_none() && pair.by_newton() < FEW {
        smooth
    } else {
        element
    };
    let steps = grading.sum(asked.span.end);
    Some(Graded {
        grading,
        element,
        factor: factor_for(asked.accuracy, element, course.local, steps),
    })
}

/// Which steps a run may have.
#[derive(Clone, Copy, Debug)]
pub(super) enum Steps {
    Equal,
    /// Short ones where the motion is fast, where that pays; with elements that damp, if the model runs with them.
    Varying {
        damps: bool,
    },
}

impl Steps {
    /// Equal ones keep the structure of models that are conservative and do not depend on time, and step linear ones by a matrix.
    pub(super) fn of(facts: &Facts, are_equal: bool, is_constrained: bool) -> Self {
        let may_vary = facts.time_dependent || (facts.forced && !facts.linear);
        if may_vary && !are_equal {
            Self::Varying {
                damps: !is_constrained,
            }
        } else {
            Self::Equal
        }
    }
}
