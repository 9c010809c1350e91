//! One arc of a step: its end is the end of the step or the first root of a switching function (T-119).

use super::kinked::{BEYOND, Effort, Kinked, SHORTEST, is_later};
use super::search::{Crossing, begins_on_root, first_crossing};
use crate::cut::is_of_newton;
use crate::error::StepError;
use alloc::vec::Vec;

/// The largest number of lengths tried for one arc.
const MAX_TRIALS: u32 = 100;

/// Arcs shorter than this, relative to the step, are assumed to have no further roots.
const SHORT: f64 = 0.02;

/// How an arc ended.
pub(super) enum Arc {
    /// At the end of the step, or as far as the step could be made at once, without a root.
    Smooth { length: f64 },
    /// At a root of a switching function, or `margin` before it.
    Crossing {
        length: f64,
        switch: usize,
        margin: f64,
    },
}

/// An arc that ends before a root.
#[derive(Clone, Copy)]
struct Landing {
    length: f64,
    switch: usize,
    /// The distance to the root.
    change: f64,
}

impl Landing {
    /// Whether that distance is small relative to the step.
    fn is_near(&self, h: f64) -> bool {
        self.change.abs() < SHORTEST * h.abs()
    }

    /// Ends the arc earlier, each time by twice as much: beside a jump an iteration may converge in one trial and not in
    /// the next one of the same length. False if it would not be near the root any more.
    fn retreats(&mut self, by: &mut f64, h: f64) -> bool {
        self.length -= *by;
        self.change += *by;
        *by *= 2.0;
        self.length > 0.0 && self.is_near(h)
    }

    fn arc(&self, h: f64, margin: f64) -> Arc {
        let margin = if margin > 0.0 || self.is_near(h) && self.change > 0.0 {
            self.change.max(margin)
        } else {
            0.0
        };
        Arc::Crossing {
            length: self.length.copysign(h),
            switch: self.switch,
            margin,
        }
    }
}

/// Computes one arc, to the end of the step or to the first root of a switching function.
///
/// Lengths are tried until an arc ends at a root. Each trial that crosses a root tells where it is; each trial that
/// ends before one gives an estimate from the slope there. Where the iteration for a long arc fails, because forces
/// jump within it, a shorter arc is extended to the root.
pub(super) fn arc<S: Kinked + ?Sized>(
    stepper: &mut S,
    (now, begins_at_root): (f64, bool),
    (end, rest, h): (f64, f64, f64),
    state: &mut S::State,
    kicks: &[S::Kick],
    effort: &mut Effort,
) -> Result<Arc, StepError> {
    let mut search = LengthSearch::new(stepper.points(), (now, begins_at_root), (end, rest, h));
    let start = state.clone();
    for trial in 0..MAX_TRIALS {
        effort.trials += 1;
        if trial > 0 {
            *state = start.clone();
            stepper.forget();
        }
        if search.target.is_some() {
            stepper.trust(true);
        }
        if let Some(landing) = search.settled() {
            search.length = landing.length;
        }
        let (length, signed) = (search.length, search.signed());
        let inner: Vec<S::Kick> = (kicks.iter())
            .filter(|kick| length == search.rest || !is_later(*kick, now + signed, h))
            .cloned()
            .collect();
        if let Err(error) = stepper.whole(now, signed, state, &inner) {
            effort.failed.get_or_insert(error);
            search.shorten(error)?;
            if search.length < SHORT * h.abs() {
                stepper.trust(true);
            }
            continue;
        }
        if let Some(arc) = search.accepted() {
            return Ok(arc);
        }
        let inside = stepper.inside();
        let mut values = |tau: f64, row: &mut Vec<f64>| {
            let here = stepper.at(&inside, tau);
            stepper.switches(now + tau * signed, &here, row);
        };
        if let Some(arc) = search.judge(trial, &mut values) {
            return Ok(arc);
        }
    }
    // The result is no worse than any other step across a kink.
    *state = start;
    stepper.forget();
    let length = rest.abs().copysign(h);
    stepper.whole(now, length, state, kicks)?;
    Ok(Arc::Smooth { length })
}

/// The search for the length of an arc. Lengths have no sign.
struct LengthSearch {
    /// The length of the step, with its sign.
    h: f64,
    /// What is left of the step.
    rest: f64,
    begins_at_root: bool,
    /// Whether points of the element lie at its ends.
    has_ends: bool,
    /// The number of parts of an arc between which signs are compared.
    samples: usize,
    /// The error of times.
    resolution: f64,
    /// How far before a root an arc ends: points at the ends of an element have to lie on the same side of the root as
    /// its inside.
    margin: f64,
    /// The length of the next trial.
    length: f64,
    /// The function at whose root the arc is to end.
    target: Option<usize>,
    /// The last correction of the length.
    last_change: f64,
    /// The longest arc without a root.
    good: f64,
    /// The shortest arc that failed.
    bad: f64,
    /// The arc that came nearest to a root without crossing it; it is used if none comes nearer.
    nearest: Option<Landing>,
    is_to_settle: bool,
    /// How much earlier it ends if it fails when it is solved again.
    retreat: f64,
    /// A length that is accepted without a search.
    only: Option<f64>,
}

impl LengthSearch {
    fn new(
        (points, has_ends): (usize, bool),
        (now, begins_at_root): (f64, bool),
        (end, rest, h): (f64, f64, f64),
    ) -> Self {
        let rest = rest.abs();
        let resolution = 4.0 * f64::EPSILON * now.abs().max(end.abs()).max(rest);
        Self {
            h,
            rest,
            begins_at_root,
            has_ends,
            samples: (2 * points).clamp(8, 24),
            resolution,
            margin: if has_ends { 4.0 * resolution } else { 0.0 },
            length: rest,
            target: None,
            last_change: f64::INFINITY,
            good: 0.0,
            bad: f64::INFINITY,
            nearest: None,
            is_to_settle: false,
            retreat: resolution,
            only: None,
        }
    }

    /// The length of the next trial, with its sign.
    fn signed(&self) -> f64 {
        self.length.copysign(self.h)
    }

    /// The whole arc, without a root.
    fn smooth(&self) -> Arc {
        Arc::Smooth {
            length: self.signed(),
        }
    }

    /// The arc that is used because none comes nearer to the root.
    fn settled(&self) -> Option<Landing> {
        self.nearest.filter(|_| self.is_to_settle)
    }

    /// The arc of the present length, if it needs no comparison with roots.
    fn accepted(&self) -> Option<Arc> {
        match self.settled() {
            Some(landing) => Some(landing.arc(self.h, self.margin)),
            None => (self.only == Some(self.length)).then(|| self.smooth()),
        }
    }

    /// Chooses a shorter length after a step that failed.
    ///
    /// # Errors
    /// The `error`, if no shorter arc may succeed.
    fn shorten(&mut self, error: StepError) -> Result<(), StepError> {
        if let Some(landing) = self.nearest.as_mut().filter(|_| self.is_to_settle)
            && is_of_the_iteration(&error)
            && landing.retreats(&mut self.retreat, self.h)
        {
            return Ok(());
        }
        self.bad = self.length;
        let Self { good, bad, .. } = *self;
        let least = 2.0 * self.resolution;
        if !is_of_the_iteration(&error) || bad < least || self.is_to_settle {
            return Err(error);
        }
        self.is_to_settle = self.nearest.is_some() && bad - good < least;
        self.length = if bad <= good {
            0.5 * bad
        } else if good > 0.0 {
            self.bisected()
        } else {
            let factor = if bad > SHORTEST * self.h.abs() {
                0.5
            } else {
                0.1
            };
            factor * bad
        };
        Ok(())
    }

    /// The middle between the longest arc without a root and the shortest one that failed.
    fn bisected(&self) -> f64 {
        self.good + 0.5 * (self.bad - self.good)
    }

    /// Compares an arc with the root at which it is to end: returns the arc that is accepted, or sets the next length.
    /// `values` gives the switching functions at τ.
    fn judge(&mut self, trial: u32, values: &mut dyn FnMut(f64, &mut Vec<f64>)) -> Option<Arc> {
        let resolution = self.resolution / self.length;
        // A root at the end of a step that has a point there: on which side it lies is decided by rounding.
        let is_whole = self.has_ends && self.length == self.rest;
        let until = 1.0 + if is_whole { resolution } else { 0.0 };
        let crossed = first_crossing(0.0..until, self.samples, resolution, values);
        if crossed.is_none() {
            self.good = self.good.max(self.length);
        }
        let distance = |root: Crossing| (root.switch, (root.tau - 1.0) * self.length);
        let root = match (&crossed, self.target) {
            (None, Some(switch)) => Some((switch, self.extrapolated(switch, values))),
            (None, None) => self.crossing_ahead(values).map(distance),
            (Some(_), _) => crossed.map(distance),
        };
        let Some((switch, change)) = root else {
            return self.without_root(trial, values);
        };
        self.target = Some(switch);
        let landing = Landing {
            length: self.length,
            switch,
            change,
        };
        self.approach(trial, landing, crossed.is_none())
    }

    /// The distance to the root of a function beyond the end of the arc, from its slope there.
    fn extrapolated(&self, switch: usize, values: &mut dyn FnMut(f64, &mut Vec<f64>)) -> f64 {
        let mut value = |tau: f64| {
            let mut row = Vec::new();
            values(tau, &mut row);
            row.get(switch).copied().unwrap_or(f64::NAN)
        };
        let at_end = value(1.0);
        let slope = (at_end - value(1.0 - BEYOND)) / (BEYOND * self.length);
        -at_end / slope
    }

    /// The first root between the arc and the shortest one that failed, by the polynomial of the arc.
    fn crossing_ahead(&self, values: &mut dyn FnMut(f64, &mut Vec<f64>)) -> Option<Crossing> {
        if !self.bad.is_finite() {
            return None;
        }
        let resolution = self.resolution / self.length;
        // The step that failed may have a point on a root at its end.
        let behind = if self.has_ends { resolution } else { 0.0 };
        let until = (self.bad / self.length).min(2.0) + behind;
        first_crossing(1.0..until, 4, resolution, values)
    }

    /// Accepts an arc without a root. If the step begins on a root, a short arc is made first that leaves it.
    fn without_root(
        &mut self,
        trial: u32,
        values: &mut dyn FnMut(f64, &mut Vec<f64>),
    ) -> Option<Arc> {
        let is_first = trial == 0 && !self.begins_at_root && self.length == self.rest;
        if is_first && self.has_ends && begins_on_root(self.resolution / self.length, values) {
            // The point at the start may lie on the other side.
            self.length = self.margin;
            self.only = Some(self.margin);
            return None;
        }
        Some(self.smooth())
    }

    /// Accepts an arc that ends at its root, or sets the next length.
    fn approach(&mut self, trial: u32, here: Landing, is_before: bool) -> Option<Arc> {
        let Landing { length, change, .. } = here;
        if is_before && change < -4.0 * self.resolution {
            // The motion has turned away from the root again.
            return Some(self.smooth());
        }
        let is_right = if self.has_ends {
            is_before && change.abs() <= 4.0 * self.margin
        } else {
            // No better than in the trial before: the rest is the rounding error of the function.
            change.abs() <= self.resolution || trial > 4 && change.abs() >= 0.5 * self.last_change
        };
        if is_right || !change.is_finite() {
            return Some(here.arc(self.h, self.margin));
        }
        if is_before {
            match self.nearest {
                Some(one) if one.change <= change => {
                    self.is_to_settle = one.is_near(self.h) || trial > MAX_TRIALS / 2;
                }
                _ => self.nearest = Some(here),
            }
        }
        self.last_change = change.abs();
        let wanted = length + change - self.margin;
        self.length = if wanted >= self.bad {
            self.bisected()
        } else if wanted >= self.rest {
            // The root is not in this step.
            self.target = None;
            self.rest
        } else {
            wanted.max(self.resolution)
        };
        None
    }
}

/// Whether a shorter arc may succeed.
pub(super) fn is_of_the_iteration(error: &StepError) -> bool {
    is_of_newton(error)
        || matches!(
            error,
            StepError::FixedPointStalled { .. } | StepError::Legendre(_)
        )
}
