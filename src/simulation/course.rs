//! Step after step until one fails: what the endless sequences of both kinds of models have in common.

use super::times::Endless;
use crate::error::RunErrorKind;

/// A stepper on its way, or the error that it ended with, until that is told.
#[derive(Debug)]
pub(super) struct Course<S> {
    way: Result<(S, Endless), Option<RunErrorKind>>,
    element: usize,
}

/// An element of a course.
pub(super) struct Leg {
    pub(super) number: usize,
    /// Where it begins, to all digits.
    pub(super) begin: f64,
    /// Its length.
    pub(super) h: f64,
    /// The nodes.
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

    /// The same, to be worked with.
    pub(super) fn stepper_mut(&mut self) -> Option<&mut S> {
        self.way.as_mut().ok().map(|(stepper, _)| stepper)
    }

    /// When the next element begins, unless the course has ended.
    pub(super) fn time(&self) -> Option<f64> {
        let (_, elements) = self.way.as_ref().ok()?;
        let (time, ..) = elements.element();
        Some(time)
    }

    /// What `advance` makes of the next element; the stepper goes to `ended` where it fails.
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

    /// The error that the course ended with, until it has been told.
    pub(super) fn failure(&mut self) -> Option<RunErrorKind> {
        self.way.as_mut().err()?.take()
    }

    /// Ends without an error.
    pub(super) fn stop(&mut self, ended: impl FnOnce(&S)) {
        if let Ok((stepper, _)) = &self.way {
            ended(stepper);
            self.way = Err(None);
        }
    }
}
