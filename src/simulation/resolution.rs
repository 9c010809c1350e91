//! Checks whether elements resolve the motion: some of those whose iteration did not contract quickly are compared with
//! shorter elements (T-121).

use super::follow::Passed;
use super::kind::{Chosen, Simulated};
use super::rounding::roundings;
use crate::length::Length;
use crate::motion::Warning;
use crate::numbers::{larger, largest};
use std::fmt;
use tfe_runtime::{Element, Share, Solve, Statistics};

/// Compares elements with three of a third of their length. Elements that were cut are compared with nine of a ninth:
/// halves might be cut into the same pieces as the element.
pub struct Resolution<'m, M: 'm, const N: usize, L: Length<N>> {
    again: Again<'m, M>,
    /// The stepper of comparisons; created when first needed.
    stepper: Option<L::Stepper<'m, M>>,
    comparisons: Comparisons<N, L>,
}

/// The comparisons so far, and which elements are compared next.
struct Comparisons<const N: usize, L: Length<N>> {
    choice: Choice,
    /// The end of the shorter elements in the previous element, if it was compared.
    continued: Option<StatePair<L::State>>,
    found: Found,
}

/// Which elements are compared.
struct Choice {
    /// The largest contraction ratio of an element that needs no comparison.
    quick: f64,
    doubtful: Sample,
    /// Counts those among the doubtful elements that were cut, which are compared first.
    cut: Sample,
    /// The number of elements so far.
    passed: usize,
    /// The numbers of Newton iterations and of cuts so far.
    work: (u64, u64),
}

/// What comparisons have found. States are lists of numbers: coordinates, then momenta.
#[derive(Default)]
struct Found {
    compared: Vec<Compared>,
    bounds: Option<Bounds>,
}

impl<M, const N: usize, L: Length<N>> fmt::Debug for Resolution<'_, M, N, L> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Resolution")
            .field("compared", &self.comparisons.found.compared.len())
            .finish_non_exhaustive()
    }
}

/// Selects the numbers 0, 1, g, g², … of a sequence.
#[derive(Clone, Copy, Debug)]
struct Sample {
    count: usize,
    next: usize,
    /// g
    growth: usize,
}

impl Sample {
    fn new(growth: usize) -> Self {
        Self {
            count: 0,
            next: 0,
            growth,
        }
    }

    /// Counts an item; returns whether it is selected.
    fn takes(&mut self) -> bool {
        let number = self.count;
        self.count += 1;
        let is_next = number == self.next;
        if is_next {
            self.next = (self.growth * number).max(1);
        }
        is_next
    }
}

/// The model and the solver for the shorter elements; those of the run.
pub struct Again<'m, M: 'm> {
    pub(super) model: Share<'m, M>,
    pub(super) chosen: Chosen,
}

/// The states of the shorter elements and of the run, at the same time.
#[derive(Clone, Debug)]
struct StatePair<S> {
    state: S,
    /// The state of the run.
    run: S,
}

/// An element and the difference of its end from that of the shorter elements; infinite if these fail.
#[derive(Debug)]
struct Compared {
    t: f64,
    h: f64,
    off: Vec<f64>,
}

/// Advances a state over an element, given by start and length; returns false if it fails.
type Advance<'a, S> = dyn FnMut((f64, f64), &mut S) -> bool + 'a;

impl<'m, M, const N: usize, L> Resolution<'m, M, N, L>
where
    M: Simulated<N, L> + 'm,
    L: Length<N>,
{
    /// The factor between the numbers of elements that are compared. One matrix makes all elements of a linear model that
    /// does not depend on time: fewer are enough.
    const GROWTH: usize = if M::FACTS.linear && !M::FACTS.time_dependent {
        16
    } else {
        2
    };

    pub(super) fn new(again: Again<'m, M>) -> Self {
        Self {
            comparisons: Comparisons::new(again.chosen.element, Self::GROWTH),
            again,
            stepper: None,
        }
    }

    /// Replaces the model.
    pub(super) fn set_model(&mut self, model: Share<'m, M>) {
        self.again.model = model;
        self.stepper = None;
    }

    /// The settings of the steps of the run.
    pub(super) fn chosen(&self) -> &Chosen {
        &self.again.chosen
    }

    /// Compares the element if it is due, unless impulses act in it.
    #[inline(always)]
    pub(super) fn look(&mut self, statistics: &Statistics, passed: &Passed<'_, N, L>) {
        if passed.has_impulses || self.again.chosen.control.solve == Solve::Trusting {
            return;
        }
        // Parts of such an element have lost digits of their length, or are of length zero.
        if !(passed.h / f64::from(MAX_PARTS)).is_normal() {
            return;
        }
        if let Some(asked) = self.comparisons.asked(statistics, passed) {
            self.compare(asked, passed);
        }
    }

    #[cold]
    #[inline(never)]
    fn compare(&mut self, asked: Asked, passed: &Passed<'_, N, L>) {
        let (again, stepper) = (&self.again, &mut self.stepper);
        let mut advance = |element: (f64, f64), state: &mut L::State| {
            Self::advance(again, stepper, element, state)
        };
        let before = self.comparisons.found.compared.len();
        self.comparisons.compare(asked, passed, &mut advance);
        if const { M::IS_CONSTRAINED } {
            let at = (passed.t, passed.h);
            let roundings = || roundings::<M, N, L>(&again.model, at, passed.before);
            let found = &mut self.comparisons.found;
            found.ignore_roundings(before, halves::<N, L>(passed.after), &roundings);
        }
    }

    /// Advances a state over an element with the stepper of comparisons. One that has failed is not used again.
    fn advance(
        again: &Again<'m, M>,
        stepper: &mut Option<L::Stepper<'m, M>>,
        element: (f64, f64),
        state: &mut L::State,
    ) -> bool {
        if stepper.is_none() {
            let Ok(made) = M::stepper(again.model.clone(), again.chosen) else {
                return false;
            };
            *stepper = Some(M::ends_only(made));
        }
        let Some(made) = stepper else { return false };
        let is_passed = M::advance(made, element, state, &[]).is_ok();
        if !is_passed {
            *stepper = None;
        }
        is_passed
    }

    /// The warning of a run whose last state is `last`, if elements do not resolve the motion.
    pub(super) fn warning(&self, last: &L::State) -> Option<Warning> {
        self.comparisons.found.warning(halves::<N, L>(last))
    }
}

/// The numbers of shorter elements that an element is compared with, and one that was cut.
const PARTS: u32 = 3;
const MAX_PARTS: u32 = 9;

/// A comparison that is to be made.
#[derive(Clone, Copy)]
struct Asked {
    /// Whether the element itself is compared, and not only the continuation of the one before.
    is_due: bool,
    /// The number of shorter elements.
    parts: u32,
}

impl Choice {
    /// The approximate relative error of an element from which on it is compared. A fixed-point iteration contracts by
    /// about (hω)²; the error of an element of order k is about (hω)ᵏ.
    const DOUBTFUL: f64 = 0.008;

    /// The number of coordinates above which comparisons are limited to about a tenth of the time of the run, unless
    /// elements are cut.
    const MANY: usize = 64;

    /// The number of elements passed for each comparison in such models.
    const ELEMENTS_A_COMPARISON: usize = 24;

    fn new(element: Element, growth: usize) -> Self {
        Self {
            quick: Self::DOUBTFUL.powf(2.0 / element.order() as f64),
            doubtful: Sample::new(growth),
            cut: Sample::new(2),
            passed: 0,
            work: (0, 0),
        }
    }

    /// Counts the element, of so many coordinates and after so many comparisons; returns how it is compared, and
    /// whether it is at all.
    fn asked(&mut self, statistics: &Statistics, coordinates: usize, compared: usize) -> Asked {
        // The contraction ratio of an element that was cut is that of its last piece.
        let work = (statistics.newton_iterations, statistics.cuts);
        let (by_newton_or_cut, is_cut) = (work != self.work, work.1 != self.work.1);
        self.work = work;
        self.passed += 1;
        // Zero if the last two increments gave no ratio.
        let ratio = statistics.contraction.ratio();
        let is_quick = !by_newton_or_cut && 0.0 < ratio && ratio <= self.quick;
        Asked {
            is_due: !is_quick && self.takes(is_cut, coordinates, compared),
            // If an element was too long for its solution to be verified, a third of it may be, too.
            parts: if is_cut { MAX_PARTS } else { PARTS },
        }
    }

    /// Whether a doubtful element is selected.
    fn takes(&mut self, is_cut: bool, coordinates: usize, compared: usize) -> bool {
        let takes = self.doubtful.takes();
        (takes && self.is_paid_for(coordinates, compared)) | (is_cut && self.cut.takes())
    }

    /// Whether a comparison, and one of the next element, would not cost too much.
    fn is_paid_for(&self, coordinates: usize, compared: usize) -> bool {
        let comparisons = compared + 2;
        coordinates <= Self::MANY || Self::ELEMENTS_A_COMPARISON * comparisons <= self.passed
    }
}

impl<const N: usize, L: Length<N>> Comparisons<N, L> {
    fn new(element: Element, growth: usize) -> Self {
        Self {
            choice: Choice::new(element, growth),
            continued: None,
            found: Found::default(),
        }
    }

    /// Counts the element; returns the comparison that it asks for.
    fn asked(&mut self, statistics: &Statistics, passed: &Passed<'_, N, L>) -> Option<Asked> {
        let coordinates = L::parts(passed.before).0.as_ref().len();
        let compared = self.found.compared.len();
        let asked = self.choice.asked(statistics, coordinates, compared);
        (asked.is_due || self.continued.is_some()).then_some(asked)
    }

    /// Compares an element with shorter ones if it is due. After a compared element, the shorter elements are also
    /// continued over this one: this shows how the error of the previous element develops.
    fn compare(
        &mut self,
        Asked { is_due, parts }: Asked,
        passed: &Passed<'_, N, L>,
        advance: &mut Advance<'_, L::State>,
    ) {
        // Not after an action, which changes the state.
        let continued = |continued: &StatePair<L::State>| continued.run == *passed.before;
        if let Some(continued) = self.continued.take().filter(continued) {
            self.compare_from(continued.state, parts, passed, advance);
        }
        if is_due {
            self.found.extend(halves::<N, L>(passed.before));
            let end = self.compare_from(passed.before.clone(), parts, passed, advance);
            let run = passed.after.clone();
            self.continued = end.map(|state| StatePair { state, run });
        }
    }

    /// Compares the end of the element with that of `parts` shorter elements from `start`, and returns the latter.
    fn compare_from(
        &mut self,
        start: L::State,
        parts: u32,
        passed: &Passed<'_, N, L>,
        advance: &mut Advance<'_, L::State>,
    ) -> Option<L::State> {
        let Passed {
            t, begin, h, after, ..
        } = *passed;
        let end = self.end_of_parts((begin, h), parts, start, advance);
        let reached = end.as_ref().map(halves::<N, L>);
        let off = off(reached, halves::<N, L>(after));
        self.found.compared.push(Compared { t, h, off });
        end
    }

    /// The end of the shorter elements; `None` if one fails.
    fn end_of_parts(
        &mut self,
        (t, h): (f64, f64),
        parts: u32,
        mut state: L::State,
        advance: &mut Advance<'_, L::State>,
    ) -> Option<L::State> {
        let part = h / f64::from(parts);
        for k in 0..parts {
            let start = t + f64::from(k) * part;
            if !advance((start, part), &mut state) {
                return None;
            }
            self.found.extend(halves::<N, L>(&state));
        }
        Some(state)
    }
}

impl Found {
    /// The largest acceptable difference relative to the extent of the motion.
    const MAX: f64 = 0.03;

    /// Extends the bounds to include a state.
    fn extend(&mut self, state: Halves<'_>) {
        match &mut self.bounds {
            Some(bounds) => bounds.include(state),
            None => self.bounds = Some(Bounds::of(state)),
        }
    }

    /// Ignores, from the comparison of a number on, differences that are rounding errors of coordinates and momenta:
    /// where constraints hold a mechanism at rest, all its motion is.
    fn ignore_roundings(
        &mut self,
        first: usize,
        after: Halves<'_>,
        roundings: &dyn Fn() -> (f64, f64),
    ) {
        /// Differences below this part of the state itself are small beside the motion, or the state is at rest away
        /// from the origin.
        const SMALL: f64 = 1e-9;
        /// Differences of so many roundings of a state are nothing else.
        const ROUNDED: f64 = 64.0 * f64::EPSILON;

        for Compared { off, .. } in self.compared.iter_mut().skip(first) {
            let (of_q, of_p) = off.split_at(after[0].len());
            let sizes = [largest(of_q), largest(of_p)];
            let mut pairs = sizes.iter().zip(after);
            if pairs.all(|(size, after)| *size <= SMALL * largest(after)) {
                continue;
            }
            let (q, p) = roundings();
            let [q, p] = [
                larger(q, ROUNDED * largest(after[0])),
                larger(p, ROUNDED * largest(after[1])),
            ];
            if sizes[0] <= q && sizes[1] <= p {
                off.fill(0.0);
            }
        }
    }

    /// The warning of a run whose last state is `last`, if elements do not resolve the motion.
    fn warning(&self, last: Halves<'_>) -> Option<Warning> {
        let mut bounds = self.bounds.clone()?;
        bounds.include(last);
        let extent = Extent::of(&bounds);
        let mut found = None;
        for Compared { t, h, off } in &self.compared {
            let part = extent.part(off);
            // A NaN has other warnings.
            if !(part > Self::MAX) {
                continue;
            }
            let (_, _, distance, count, last) = found.get_or_insert((*t, *h, part, 0, f64::NAN));
            *distance = part.max(*distance);
            // The same element may have been compared twice.
            *count += usize::from(last != t);
            *last = *t;
        }
        found.map(|(time, step, distance, count, _)| Warning::Unresolved {
            time,
            step,
            distance,
            count,
        })
    }
}

/// The coordinates and the momenta of a state.
type Halves<'a> = [&'a [f64]; 2];

fn halves<const N: usize, L: Length<N>>(state: &L::State) -> Halves<'_> {
    let (q, p) = L::parts(state);
    [q.as_ref(), p.as_ref()]
}

/// The difference between the end of the shorter elements, if these reach one, and that of the element.
fn off(end: Option<Halves<'_>>, after: Halves<'_>) -> Vec<f64> {
    let mut off = after.concat();
    let Some(end) = end else {
        off.fill(f64::INFINITY);
        return off;
    };
    for (off, end) in off.iter_mut().zip(end.into_iter().flatten()) {
        *off = end - *off;
    }
    off
}

/// The least and the largest coordinates and momenta so far.
#[derive(Clone)]
struct Bounds {
    least: Vec<f64>,
    largest: Vec<f64>,
}

impl Bounds {
    fn of(state: Halves<'_>) -> Self {
        Self {
            least: state.concat(),
            largest: state.concat(),
        }
    }

    fn include(&mut self, state: Halves<'_>) {
        let ends = self.least.iter_mut().zip(&mut self.largest);
        for ((least, largest), number) in ends.zip(state.into_iter().flatten()) {
            *least = least.min(*number);
            *largest = largest.max(*number);
        }
    }
}

/// The extent of a motion in phase space.
struct Extent {
    range: Vec<f64>,
    /// The largest momenta; ones if all are zero.
    weights: Vec<f64>,
}

impl Extent {
    /// The least range of a number relative to its size: differences of a few roundings are no motion.
    const ROUNDINGS: f64 = 256.0 * f64::EPSILON;

    fn of(Bounds { least, largest }: &Bounds) -> Self {
        let ends = || least.iter().zip(largest);
        let range = |(least, largest): (&f64, &f64)| {
            let size = largest.abs().max(least.abs());
            (largest - least).max(Self::ROUNDINGS * size)
        };
        let momenta = ends().skip(least.len() / 2);
        let mut weights: Vec<f64> = momenta
            .map(|(least, largest)| largest.abs().max(least.abs()))
            .collect();
        if weights.iter().all(|weight| *weight == 0.0) {
            weights.fill(1.0);
        }
        Self {
            range: ends().map(range).collect(),
            weights,
        }
    }

    /// A difference relative to the extent; infinite only if there is no end to compare with. Differences of positions
    /// are weighted with momenta, and those of momenta with positions, so that units do not matter.
    fn part(&self, off: &[f64]) -> f64 {
        if off.contains(&f64::INFINITY) {
            return f64::INFINITY;
        }
        let relative = |weights: &[f64], off: &[f64], range: &[f64]| {
            let (mut distance, mut way) = (0.0, 0.0);
            for (weight, (off, range)) in weights.iter().zip(off.iter().zip(range)) {
                distance += weight * off.abs();
                way += weight * range;
            }
            // An extent below all normal numbers has no digits to compare with.
            if way < f64::MIN_POSITIVE {
                return 0.0;
            }
            let part: f64 = distance / way;
            if part.is_infinite() { f64::MAX } else { part }
        };
        let coordinates = off.len() / 2;
        let ((q, p), (of_q, of_p)) = (off.split_at(coordinates), self.range.split_at(coordinates));
        relative(&self.weights, q, of_q).max(relative(of_q, p, of_p))
    }
}

#[cfg(test)]
mod tests {
    use super::{Bounds, Extent, Found};

    /// The extent of a motion between two states, of one coordinate.
    fn extent([q, p]: [[f64; 2]; 2]) -> Extent {
        let mut bounds = Bounds::of([&q[..1], &p[..1]]);
        bounds.include([&q[1..], &p[1..]]);
        Extent::of(&bounds)
    }

    /// Where the range of a coordinate is a rounding of it, a difference of two roundings is no motion; by a tenth of
    /// the range it is one.
    #[test]
    fn differences_are_compared_with_the_motion_and_not_with_roundings() {
        let still = extent([[1.0, 1.0], [2.0, 2.0]]);
        assert!(still.part(&[2.0 * f64::EPSILON, 0.0]) < Found::MAX);
        assert!(still.part(&[0.0, 4.0 * f64::EPSILON]) < Found::MAX);
        let moving = extent([[-1.0, 1.0], [0.0, 2.0]]);
        assert!((moving.part(&[0.2, 0.0]) - 0.1).abs() < 1e-15);
        // 5e-324 weighted with 5e-324 is zero.
        let least = f64::from_bits(1);
        let tiny = extent([[0.0, least], [0.0, least]]);
        assert_eq!(tiny.part(&[least, least]), 0.0);
    }

    /// Also beside a momentum that is zero, and a difference too large for a ratio is not told as a failure.
    #[test]
    fn only_shorter_elements_that_fail_differ_by_infinity() {
        let moving = extent([[-1.0, 1.0], [0.0, 0.0]]);
        assert_eq!(moving.part(&[f64::INFINITY; 2]), f64::INFINITY);
        let small = extent([[0.0, 1e-150], [0.0, 1e-150]]);
        assert_eq!(small.part(&[1e300, 0.0]), f64::MAX);
        assert!(small.part(&[f64::NAN, f64::NAN]).is_nan());
    }
}
