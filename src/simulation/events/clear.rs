//! Skips the search for events where none can be: a box in time and phase space in which no watched function vanishes
//! covers several steps (T-155).

use tfe_runtime::enclosure::Enclosure;

/// Writes bounds of coordinates and velocities over a step; returns false if there are none.
type Reach<'a> = dyn FnMut(&mut Vec<(f64, f64)>) -> bool + 'a;

/// Writes the signs of the watched functions over a box; returns false if there are no bounds.
type Outputs<'a> = dyn FnMut(&[Enclosure], &mut Vec<f64>) -> bool + 'a;

/// A box in which no watched function vanishes, if one is known.
#[derive(Debug)]
pub(super) struct Clear {
    /// The bounds of time, coordinates and velocities (or momenta); empty if no box is known.
    bounds: Vec<(f64, f64)>,
    /// The signs of the watched functions in the box.
    sides: Vec<f64>,
    /// The size of the next box relative to the range of a step.
    growth: f64,
    /// The largest such size that is tried.
    most: f64,
    /// The number of steps before the next attempt.
    wait: u32,
    /// The range of the last step.
    reached: Vec<(f64, f64)>,
    enclosures: Vec<Enclosure>,
}

impl Default for Clear {
    fn default() -> Self {
        Self {
            bounds: Vec::new(),
            sides: Vec::new(),
            growth: Self::FIRST,
            most: Self::MAX,
            wait: 0,
            reached: Vec::new(),
            enclosures: Vec::new(),
        }
    }
}

impl Clear {
    const FIRST: f64 = 8.0;
    const MAX: f64 = 128.0;
    /// The factor by which the largest size recovers with each box.
    const RECOVERY: f64 = 1.05;
    /// The number of steps without an attempt after not even the range of one step was free of zeros.
    const PATIENCE: u32 = 8;

    /// Discards the box, since the model has changed.
    pub(super) fn forget(&mut self) {
        self.bounds.clear();
    }

    /// Whether the step from t to t + h stays inside the known box; `within` compares coordinates and velocities.
    #[inline(always)]
    pub(super) fn holds(
        &self,
        (t, h): (f64, f64),
        within: impl FnOnce(&[(f64, f64)]) -> bool,
    ) -> bool {
        let [(low, high), rest @ ..] = &self.bounds[..] else {
            return false;
        };
        *low <= t.min(t + h) && t.max(t + h) <= *high && within(rest)
    }

    /// Begins the search for a box around the step, the bounds over which `reach` writes; false if it is not to be
    /// looked for now.
    #[cold]
    pub(super) fn begin(&mut self, (t, h): (f64, f64), reach: &mut Reach<'_>) -> bool {
        self.bounds.clear();
        if self.wait > 0 {
            self.wait -= 1;
            return false;
        }
        self.reached.clear();
        self.reached.push((t.min(t + h), t.max(t + h)));
        reach(&mut self.reached)
    }

    /// Tries to find a box around the step whose search has begun; `outputs` writes the signs of the watched functions
    /// over a box.
    #[cold]
    pub(super) fn look(&mut self, (_, h): (f64, f64), outputs: &mut Outputs<'_>) -> bool {
        while !self.try_growth(h, outputs) {
            if self.growth == 1.0 {
                self.wait = Self::PATIENCE;
                return false;
            }
            // Sizes that failed are not tried again soon.
            self.most = 0.5 * self.growth;
            self.growth = (0.25 * self.growth).max(1.0);
        }
        self.most *= Self::RECOVERY;
        self.growth = (2.0 * self.growth).min(self.most.clamp(1.0, Self::MAX));
        true
    }

    /// Whether no watched function vanishes in a box of the size `growth` relative to the range of the step.
    fn try_growth(&mut self, h: f64, outputs: &mut Outputs<'_>) -> bool {
        let more = 0.5 * (self.growth - 1.0);
        self.bounds.clear();
        for (low, high) in &self.reached {
            let more = more * (high - low);
            self.bounds.push((low - more, high + more));
        }
        // Time grows in one direction only.
        let (ahead, (low, high)) = (self.growth * h, self.reached[0]);
        self.bounds[0] = (low.min(low + ahead), high.max(high + ahead));
        self.enclosures.clear();
        let bounds = self.bounds.iter();
        (self.enclosures).extend(bounds.map(|(low, high)| Enclosure::between(*low, *high)));
        self.sides.clear();
        if outputs(&self.enclosures, &mut self.sides) && !self.sides.contains(&0.0) {
            return true;
        }
        self.bounds.clear();
        false
    }

    /// Whether the signs in the box agree with those already known. Signs that were unknown are then known.
    #[inline(always)]
    pub(super) fn agree(&self, sides: &mut [f64]) -> bool {
        let mut pairs = sides.iter_mut().zip(&self.sides);
        pairs.all(|(known, side)| {
            let agrees = *known != -side;
            if agrees {
                *known = *side;
            }
            agrees
        })
    }
}
