//! Whether elements resolve the motion: a second look at some of those whose iteration did not contract quickly (T-121).

use super::kind::{Chosen, Simulated};
use crate::length::Length;
use crate::motion::Warning;
use std::fmt;
use tfe_runtime::{Share, Solve, Statistics};

/// Compares elements with three of a third of the length, those that were cut with nine of a ninth: halves might be cut into the same pieces as the element.
pub struct Resolution<'m, M: 'm, const N: usize, L: Length<N>> {
    again: Again<'m, M>,
    /// The largest ratio of increments that is not doubtful.
    quick: f64,
    /// Made when it is first needed.
    stepper: Option<L::Stepper<'m, M>>,
    doubtful: Sample,
    /// Those among the doubtful ones that were cut, which are the first to be looked at.
    cut: Sample,
    /// All elements so far.
    passed: usize,
    /// Newton iterations and cuts so far.
    work: (u64, u64),
    /// Where the parts of the element before have ended, if it was compared.
    beside: Option<Beside<L::State>>,
    compared: Vec<Compared<L::State>>,
    /// The least and the largest coordinates and momenta that were seen.
    bounds: Option<[L::State; 2]>,
}

impl<M, const N: usize, L: Length<N>> fmt::Debug for Resolution<'_, M, N, L> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Resolution")
            .field("compared", &self.compared.len())
            .finish_non_exhaustive()
    }
}

/// Takes the numbers 0, 1, 2, 4, 8, … of what there is.
#[derive(Clone, Copy, Debug, Default)]
struct Sample {
    count: usize,
    next: usize,
}

impl Sample {
    /// Whether the next one is among them.
    fn takes(&mut self) -> bool {
        let number = self.count;
        self.count += 1;
        let is_next = number == self.next;
        if is_next {
            self.next = (2 * number).max(1);
        }
        is_next
    }
}

/// With what elements are stepped over again: as in the run.
pub struct Again<'m, M: 'm> {
    pub(super) model: Share<'m, M>,
    pub(super) chosen: Chosen,
}

/// An element that has been passed without an error.
pub struct Examined<'a, const N: usize, L: Length<N>> {
    pub(super) t: f64,
    pub(super) h: f64,
    pub(super) before: &'a L::State,
    pub(super) after: &'a L::State,
}

/// A motion in parts of elements beside that of the run.
#[derive(Clone, Debug)]
struct Beside<S> {
    state: S,
    /// Where the run has come to at the same time.
    run: S,
}

/// By how much its end is away from that of its parts; infinite where these fail.
#[derive(Debug)]
struct Compared<S> {
    t: f64,
    h: f64,
    off: S,
}

impl<'m, M, const N: usize, L> Resolution<'m, M, N, L>
where
    M: Simulated<N, L> + 'm,
    L: Length<N>,
{
    /// About the error of an element relative to the motion from which on it is looked at. A fixed point contracts by some (hω)², an element of order k is wrong by some (hω)ᵏ.
    const DOUBTFUL: f64 = 0.008;

    /// The part of what the motion extends over that its parts may end elsewhere.
    const MOST: f64 = 0.03;

    /// Of models with more coordinates comparisons are to take no more than some tenth of the time of a run, unless elements are cut.
    const MANY: usize = 64;

    /// As many elements pay for one comparison.
    const ELEMENTS_A_COMPARISON: usize = 24;

    pub(super) fn new(again: Again<'m, M>) -> Self {
        Self {
            quick: Self::DOUBTFUL.powf(2.0 / again.chosen.element.order() as f64),
            again,
            stepper: None,
            doubtful: Sample::default(),
            cut: Sample::default(),
            passed: 0,
            work: (0, 0),
            beside: None,
            compared: Vec::new(),
            bounds: None,
        }
    }

    /// Goes on with another model.
    pub(super) fn set_model(&mut self, model: Share<'m, M>) {
        (self.again.model, self.stepper) = (model, None);
    }

    /// Compares the element if it is the next of those that are to be. Linear models are not looked at: what their elements are wrong by is known.
    #[inline(always)]
    pub(super) fn look(&mut self, statistics: &Statistics, examined: Examined<'_, N, L>) {
        if M::FACTS.linear || self.again.chosen.control.solve == Solve::Trusting {
            return;
        }
        // An element that was cut has the ratio of its last piece.
        let work = (statistics.newton_iterations, statistics.cuts);
        let (by_newton_or_cut, is_cut) = (work != self.work, work.1 != self.work.1);
        self.work = work;
        self.passed += 1;
        let is_due = self.is_due((by_newton_or_cut, is_cut), statistics, &examined);
        if is_due || self.beside.is_some() {
            // Where an element was too long to be proven, a third of it may be, too.
            let parts = if is_cut { 9 } else { 3 };
            self.compare(is_due, parts, examined);
        }
    }

    /// Whether the element is doubtful, and the next of those to be compared.
    #[inline(always)]
    fn is_due(
        &mut self,
        (by_newton_or_cut, is_cut): (bool, bool),
        statistics: &Statistics,
        examined: &Examined<'_, N, L>,
    ) -> bool {
        // Zero where the last two increments tell nothing.
        let ratio = statistics.contraction.ratio();
        if !by_newton_or_cut && 0.0 < ratio && ratio <= self.quick {
            return false;
        }
        let takes = self.doubtful.takes();
        (takes && self.is_paid_for(examined)) | (is_cut && self.cut.takes())
    }

    /// Whether a comparison, and one with the element behind, is no great expense.
    fn is_paid_for(&self, examined: &Examined<'_, N, L>) -> bool {
        let coordinates = L::parts(examined.before).0.as_ref().len();
        let comparisons = self.compared.len() + 2;
        coordinates <= Self::MANY || Self::ELEMENTS_A_COMPARISON * comparisons <= self.passed
    }

    /// Compares an element with its parts if it is due, and with parts that begin where those of the element before have ended: they show what the model makes of the error of
    /// that element.
    #[cold]
    #[inline(never)]
    fn compare(&mut self, is_due: bool, parts: u32, examined: Examined<'_, N, L>) {
        // Not behind an act, which changes the state.
        let continued = |beside: &Beside<L::State>| beside.run == *examined.before;
        if let Some(beside) = self.beside.take().filter(continued) {
            self.compare_from(beside.state, parts, &examined);
        }
        if is_due {
            self.extend(examined.before);
            let end = self.compare_from(examined.before.clone(), parts, &examined);
            let run = examined.after.clone();
            self.beside = end.map(|state| Beside { state, run });
        }
    }

    /// Where so many parts from `start` end.
    fn compare_from(
        &mut self,
        start: L::State,
        parts: u32,
        examined: &Examined<'_, N, L>,
    ) -> Option<L::State> {
        let Examined { t, h, after, .. } = *examined;
        let end = self.end_of_parts((t, h), parts, start);
        let off = off::<N, L>(end.as_ref(), after);
        self.compared.push(Compared { t, h, off });
        end
    }

    /// None where they fail.
    fn end_of_parts(
        &mut self,
        (t, h): (f64, f64),
        parts: u32,
        mut state: L::State,
    ) -> Option<L::State> {
        let mut stepper = match self.stepper.take() {
            Some(stepper) => stepper,
            None => M::ends_only(M::stepper(self.again.model.clone(), self.again.chosen).ok()?),
        };
        let part = h / f64::from(parts);
        for k in 0..parts {
            let start = t + f64::from(k) * part;
            M::advance(&mut stepper, (start, part), &mut state, &[]).ok()?;
            self.extend(&state);
        }
        self.stepper = Some(stepper);
        Some(state)
    }

    /// Makes room for a state.
    fn extend(&mut self, state: &L::State) {
        self.bounds = Some(match self.bounds.take() {
            Some(bounds) => extended::<N, L>(&bounds, state),
            None => [state.clone(), state.clone()],
        });
    }

    /// What is to be told of the elements of a run that has come to `last`.
    pub(super) fn warning(&self, last: &L::State) -> Option<Warning> {
        let [least, largest] = extended::<N, L>(self.bounds.as_ref()?, last);
        let extent = Extent::<N, L>::between(&least, &largest);
        let mut found = None;
        for Compared { t, h, off } in &self.compared {
            let part = extent.part(off);
            // NaN tells nothing that others do not.
            if !(part > Self::MOST) {
                continue;
            }
            let (_, _, distance, count, last) = found.get_or_insert((*t, *h, part, 0, f64::NAN));
            *distance = part.max(*distance);
            // One may have been compared twice.
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

/// What a function makes of the numbers of two states.
fn paired<const N: usize, L: Length<N>>(
    one: &L::State,
    other: &L::State,
    of: impl Fn(f64, f64) -> f64,
) -> L::State {
    let ((q, p), (other_q, other_p)) = (L::parts(one), L::parts(other));
    let vector = |one: &L::Vector, other: &L::Vector| {
        let (ones, others) = (one.as_ref(), other.as_ref());
        L::from_fn(one, |a| of(ones[a], others[a]))
    };
    L::state(vector(q, other_q), vector(p, other_p))
}

/// By how much the end of parts is away from that of an element.
fn off<const N: usize, L: Length<N>>(end: Option<&L::State>, after: &L::State) -> L::State {
    match end {
        Some(end) => paired::<N, L>(end, after, |end, after| end - after),
        None => paired::<N, L>(after, after, |_, _| f64::INFINITY),
    }
}

fn extended<const N: usize, L: Length<N>>(
    [least, largest]: &[L::State; 2],
    state: &L::State,
) -> [L::State; 2] {
    [
        paired::<N, L>(least, state, f64::min),
        paired::<N, L>(largest, state, f64::max),
    ]
}

/// What a motion extends over.
struct Extent<const N: usize, L: Length<N>> {
    range: L::State,
    /// The largest momenta; ones if there are none.
    weights: L::Vector,
}

impl<const N: usize, L: Length<N>> Extent<N, L> {
    fn between(least: &L::State, largest: &L::State) -> Self {
        let sizes = paired::<N, L>(least, largest, |least, largest| {
            largest.abs().max(least.abs())
        });
        let (_, p) = L::parts(&sizes);
        let is_moving = p.as_ref().iter().any(|weight| *weight != 0.0);
        Self {
            range: paired::<N, L>(largest, least, |largest, least| largest - least),
            weights: if is_moving {
                p.clone()
            } else {
                L::from_fn(p, |_| 1.0)
            },
        }
    }

    /// How large a difference of positions or of momenta is. Positions count with momenta as weights, and momenta with positions, so that units do not matter.
    fn part(&self, off: &L::State) -> f64 {
        let relative = |weights: &L::Vector, off: &L::Vector, range: &L::Vector| {
            let (mut distance, mut way) = (0.0, 0.0);
            let numbers = off.as_ref().iter().zip(range.as_ref());
            for (weight, (off, range)) in weights.as_ref().iter().zip(numbers) {
                distance += weight * off.abs();
                way += weight * range;
            }
            if distance == 0.0 { 0.0 } else { distance / way }
        };
        let ((q, p), (of_q, of_p)) = (L::parts(off), L::parts(&self.range));
        relative(&self.weights, q, of_q).max(relative(of_q, p, of_p))
    }
}
