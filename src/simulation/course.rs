//! The loop of an endless sequence of steps, for both kinds of length; it ends at the first error.

use super::times::Endless;
use crate::error::RunErrorKind;

/// A stepper with the elements to come, or the error at which it ended, until that has been returned.
#[derive(Debug)]
pub(super) struct Course<S> {
    way: Result<(S, Endless), Option<RunErrorKind>>,
    element: usize,
}

/// One element of the sequence.
pub(super) struct Leg {
    pub(super) number: usize,
    /// The start, to the full digits of the step; the nodes may be rounded.
    pub(super) begin: f64,
    /// The length.
    pub(super) h: f64,
    /// The times of its two nodes.
    pub(super) nodes: (f64, f64),
}

impl<S> Course<S> {
    pub(super) fn new(way: Result<(S, Endless), RunErrorKind>) -> Self {
        Self {
            way: way.map_err(Some),
            element: 0,
        }
    }

    /// The stepper, unless the course has ended.
    pub(super) fn stepper(&self) -> Option<&S> {
        self.way.as_ref().ok().map(|(stepper, _)| stepper)
    }

    /// The stepper, mutable.
    pub(super) fn stepper_mut(&mut self) -> Option<&mut S> {
        self.way.as_mut().ok().map(|(stepper, _)| stepper)
    }

    /// The start of the next element, unless the sequence has ended.
    pub(super) fn time(&self) -> Option<f64> {
        let (_, elements) = self.way.as_ref().ok()?;
        let (time, ..) = elements.element();
        Some(time)
    }

    /// Calls `advance` on the next element; if that fails, the stepper is passed to `ended`.
    pub(super) fn next<T>(
        &mut self,
        advance: impl FnOnce(&mut S, &Leg) -> Result<T, RunErrorKind>,
        ended: impl FnOnce(&S),
    ) -> Option<Result<T, RunErrorKind>> {
        let (stepper, elements) = match &mut self.way {
            Ok(way) => way,
            Err(failure) => return failure.take().map(Err),
        };
        let (time, next, h, begin) = elements.element();
        let leg = Leg {
            number: self.element,
            begin,
            h,
            nodes: (time, next),
        };
        match advance(stepper, &leg) {
            Ok(found) => {
                elements.advance();
                self.element += 1;
                Some(Ok(found))
            }
            Err(kind) => {
                ended(stepper);
                self.way = Err(None);
                Some(Err(kind))
            }
        }
    }

    /// Takes the error at which the sequence ended.
    pub(super) fn failure(&mut self) -> Option<RunErrorKind> {
        self.way.as_mut().err()?.take()
    }

    /// Ends the sequence without an error.
    pub(super) fn stop(&mut self, ended: impl FnOnce(&S)) {
        if let Ok((stepper, _)) = &self.way {
            ended(stepper);
            self.way = Err(None);
        }
    }
}
