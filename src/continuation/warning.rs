//! What makes a branch doubtful.

use super::events::EventKind;
use crate::numbers::Short;
use std::fmt;

/// What makes a branch doubtful although it could be followed: elements of half the length contradict it, or contain
/// kinks of forces. Where the elements do not resolve it, take more elements, or elements of unequal length with
/// [`graded`](super::Continuation::graded), from [`Orbit::equidistributed`](crate::periodic::Orbit::equidistributed).
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum BranchWarning {
    /// Of the points that were compared, this is the first one whose direction dλ/ds is more an effect of the elements
    /// than one of the model, or whose orbit is another one on elements of half the length. All later points are as
    /// doubtful, and so may be points since the one compared before.
    Unresolved {
        /// The index of the point in [`Branch::points`](super::Branch::points).
        point: usize,
        /// The parameter of the point.
        parameter: f64,
        /// The derivative dλ/ds there.
        slope: f64,
        /// The same with elements of half the length; `None` if Newton's method finds no orbit of these.
        halved: Option<f64>,
        /// The distance between both orbits: the root mean square in half ranges of the coordinates and momenta;
        /// infinite if there is only one.
        distance: f64,
    },
    /// An event that elements of half the length do not confirm: its test function does not change its sign there, or
    /// has other values.
    UnresolvedEvent {
        /// The index of the event in [`Branch::events`](super::Branch::events).
        event: usize,
        /// The kind of the event.
        kind: EventKind,
        /// The parameter of the event.
        parameter: f64,
    },
    /// A force has a kink or a jump inside an element of this orbit, the first one of the branch, because a `select`,
    /// `abs`, `sign`, `min` or `max` changes its branch there. Elements then lose their order, and where the force jumps,
    /// directions, multipliers and events of the branch are wrong: the change of the time of the jump is missing.
    KinksCrossed {
        /// The index of the point in [`Branch::points`](super::Branch::points).
        point: usize,
        /// The parameter of the point.
        parameter: f64,
        /// The start of the first such element.
        time: f64,
    },
}

impl fmt::Display for BranchWarning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Unresolved {
                point,
                parameter,
                slope,
                halved,
                distance,
            } => {
                write!(
                    f,
                    "from point {point} on, at the parameter {}, the elements do not resolve the branch: ",
                    Short(*parameter)
                )?;
                match halved {
                    Some(halved) => write!(
                        f,
                        "its direction dλ/ds is {slope:.1e}, with elements of half the length {halved:.1e}, and the orbits differ by {distance:.1e} of their size"
                    )?,
                    None => f.write_str("elements of half the length find no orbit there")?,
                }
                f.write_str("; take more elements, or shorter ones where the motion is fast")
            }
            Self::UnresolvedEvent {
                event,
                kind,
                parameter,
            } => write!(
                f,
                "event {event}, {kind:?} at the parameter {}, may be one of the elements: elements of half the length do not confirm it; \
                 take more elements, or shorter ones where the motion is fast",
                Short(*parameter)
            ),
            Self::KinksCrossed {
                point,
                parameter,
                time,
            } => write!(
                f,
                "from point {point} on, at the parameter {}, a force has a kink or a jump inside an element, first behind t = {}: errors fall more \
                 slowly with the number of elements, and where it jumps, multipliers and events of the branch are wrong",
                Short(*parameter),
                Short(*time)
            ),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_doubtful_is_told_with_its_place() {
        let point = |halved| BranchWarning::Unresolved {
            point: 32,
            parameter: 0.59738,
            slope: -1e-7,
            halved,
            distance: 2e-6,
        };
        let told = point(Some(-4e-10)).to_string();
        assert!(
            told.starts_with("from point 32 on, at the parameter 0.59738,"),
            "{told}"
        );
        assert!(
            told.contains("is -1.0e-7, with elements of half the length -4.0e-10,"),
            "{told}"
        );
        assert!(point(None).to_string().contains("find no orbit there;"));
        let event = BranchWarning::UnresolvedEvent {
            event: 0,
            kind: EventKind::Fold,
            parameter: 0.59738,
        };
        let told = event.to_string();
        assert!(
            told.starts_with("event 0, Fold at the parameter 0.59738, may be"),
            "{told}"
        );
    }
}
