//! The loop of an endless sequence of steps, for both kinds of length; it ends at the first error.

use super::times::Endless;
use crate::error::RunErrorKind;

/// A stepper with the elements to come.
#[derive(Debug)]
pub(super) struct ElementSequence<S> {
    /// `None` once the sequence has ended.
    stepper: Option<S>,
    upcoming: Upcoming,
}

/// The elements to come, or the error at which the sequence ended, until that has been returned.
#[derive(Debug)]
struct Upcoming {
    elements: Result<Endless, Option<RunErrorKind>>,
    element: usize,
}

/// One element of the sequence.
pub(super) struct SequenceElement {
    pub(super) number: usize,
    /// The start from which the times of points are counted.
    pub(super) begin: f64,
    /// The length.
    pub(super) h: f64,
    /// The times of its two nodes.
    pub(super) nodes: (f64, f64),
}

impl Upcoming {
    fn next(&self) -> Option<SequenceElement> {
        let elements = self.elements.as_ref().ok()?;
        let (time, next, h, begin) = elements.element();
        Some(SequenceElement {
            number: self.element,
            begin,
            h,
            nodes: (time, next),
        })
    }

    fn advance(&mut self) {
        if let Ok(elements) = &mut self.elements {
            elements.advance();
            self.element += 1;
        }
    }
}

impl<S> ElementSequence<S> {
    pub(super) fn new(way: Result<(S, Endless), RunErrorKind>) -> Self {
        let (stepper, elements) = match way {
            Ok((stepper, elements)) => (Some(stepper), Ok(elements)),
            Err(kind) => (None, Err(Some(kind))),
        };
        let upcoming = Upcoming {
            elements,
            element: 0,
        };
        Self { stepper, upcoming }
    }

    /// The stepper, unless the sequence has ended.
    pub(super) fn stepper(&self) -> Option<&S> {
        self.stepper.as_ref()
    }

    /// The stepper, mutable.
    pub(super) fn stepper_mut(&mut self) -> Option<&mut S> {
        self.stepper.as_mut()
    }

    /// The start of the next element, unless the sequence has ended.
    pub(super) fn time(&self) -> Option<f64> {
        Some(self.upcoming.next()?.nodes.0)
    }

    /// The stepper and the next element, unless the sequence has ended.
    pub(super) fn begin(&mut self) -> Option<(&mut S, SequenceElement)> {
        match (&mut self.stepper, self.upcoming.next()) {
            (Some(stepper), Some(element)) => Some((stepper, element)),
            _ => None,
        }
    }

    /// Goes on to the element after this one, or ends the sequence.
    pub(super) fn end(&mut self, goes_on: bool) {
        match goes_on {
            true => self.upcoming.advance(),
            false => {
                self.stepper = None;
                self.upcoming.elements = Err(None);
            }
        }
    }

    /// Takes the error at which the sequence ended.
    pub(super) fn failure(&mut self) -> Option<RunErrorKind> {
        self.upcoming.elements.as_mut().err()?.take()
    }
}
