//! Boxes in time and phase space in which nothing that is watched vanishes: motions stay in one for some steps (T-155).

use tfe_runtime::enclosure::Enclosure;

/// Writes bounds of coordinates and velocities along a step, if it can.
type Reach<'a> = dyn FnMut(&mut Vec<(f64, f64)>) -> bool + 'a;

/// Writes the sides of what is watched over a box, if it can.
type Outputs<'a> = dyn FnMut(&[Enclosure], &mut Vec<f64>) -> bool + 'a;

/// Such a box, if one is known.
#[derive(Debug)]
pub(super) struct Clear {
    /// The time, coordinates, velocities (momenta); nothing where none is known.
    bounds: Vec<(f64, f64)>,
    /// On which sides of zero all outputs are in it that are watched.
    sides: Vec<f64>,
    /// How many times as wide the next one is as what a step has reached.
    growth: f64,
    /// The most that it may be.
    most: f64,
    /// Steps that are to pass before one is looked for.
    wait: u32,
    /// What the last step has reached.
    reached: Vec<(f64, f64)>,
    enclosures: Vec<Enclosure>,
}

impl Default for Clear {
    fn default() -> Self {
        Self {
            bounds: Vec::new(),
            sides: Vec::new(),
            growth: Self::FIRST,
            most: Self::MOST,
            wait: 0,
            reached: Vec::new(),
            enclosures: Vec::new(),
        }
    }
}

impl Clear {
    const FIRST: f64 = 8.0;
    const MOST: f64 = 128.0;
    /// By how much what is not tried grows with every box.
    const RECOVERY: f64 = 1.05;
    /// Steps that pass after a box as wide as one of them was not clear.
    const PATIENCE: u32 = 8;

    /// None is known of another model.
    pub(super) fn forget(&mut self) {
        self.bounds.clear();
    }

    /// Whether a step from t on, h long, stays where nothing vanishes: in the box that is known as `within` says of coordinates and velocities.
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

    /// Looks for a box about that step; `reach` writes the bounds of coordinates and velocities along it, if it can, `outputs` the sides of what is watched over a box.
    #[cold]
    pub(super) fn look(
        &mut self,
        (t, h): (f64, f64),
        reach: &mut Reach<'_>,
        outputs: &mut Outputs<'_>,
    ) -> bool {
        self.bounds.clear();
        if self.wait > 0 {
            self.wait -= 1;
            return false;
        }
        self.reached.clear();
        self.reached.push((t.min(t + h), t.max(t + h)));
        if !reach(&mut self.reached) {
            return false;
        }
        while !self.try_growth(h, outputs) {
            if self.growth == 1.0 {
                self.wait = Self::PATIENCE;
                return false;
            }
            // What was too wide is not tried again soon.
            self.most = 0.5 * self.growth;
            self.growth = (0.25 * self.growth).max(1.0);
        }
        self.most *= Self::RECOVERY;
        self.growth = (2.0 * self.growth).min(self.most.clamp(1.0, Self::MOST));
        true
    }

    /// Whether the box is clear that is so many times as wide as what the step has reached.
    fn try_growth(&mut self, h: f64, outputs: &mut Outputs<'_>) -> bool {
        let more = 0.5 * (self.growth - 1.0);
        self.bounds.clear();
        for (low, high) in &self.reached {
            let more = more * (high - low);
            self.bounds.push((low - more, high + more));
        }
        // The time goes one way.
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

    /// Whether no side is known to be another one; those that were not known are known then.
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
