//! Whether elements resolve the motion: a second look at some of those whose iteration did not contract quickly (T-121).

use crate::length::{FixedLength, Length};
use crate::motion::Warning;
use tfe_runtime::step::{Control, Stepper};
use tfe_runtime::{Element, Model, Share, Solve, State, Statistics};

/// Compares elements with three of a third of the length, those that were cut with nine of a ninth: halves might be cut into the same pieces as the element.
#[derive(Debug)]
pub struct Resolution<'m, M, const N: usize> {
    again: Again<'m, M>,
    /// The largest ratio of increments that is not doubtful.
    quick: f64,
    /// Made when it is first needed.
    stepper: Option<Stepper<'m, M, N>>,
    /// Elements that were doubtful so far.
    doubtful: usize,
    /// The number among these of the one that is compared next.
    next: usize,
    /// Newton iterations and cuts so far.
    work: (u64, u64),
    /// Where the parts of the element before have ended, if it was compared.
    beside: Option<Beside<N>>,
    compared: Vec<Compared<N>>,
    /// The least and the largest coordinates and momenta that were seen.
    bounds: [State<N>; 2],
}

/// With what elements are stepped over again: as in the run.
#[derive(Debug)]
pub struct Again<'m, M: 'm> {
    pub(in crate::simulation) model: Share<'m, M>,
    pub(in crate::simulation) element: Element,
    pub(in crate::simulation) control: Control,
    pub(in crate::simulation) at_kinks: bool,
}

/// An element that has been passed without an error.
#[derive(Clone, Copy)]
pub struct Examined<'a, const N: usize, L: Length<N> = FixedLength> {
    pub(in crate::simulation) t: f64,
    pub(in crate::simulation) h: f64,
    pub(in crate::simulation) before: &'a L::State,
    pub(in crate::simulation) after: &'a L::State,
}

/// A motion in parts of elements beside that of the run.
#[derive(Clone, Copy, Debug)]
struct Beside<const N: usize> {
    state: State<N>,
    /// Where the run has come to at the same time.
    run: State<N>,
}

/// By how much its end is away from that of its parts; infinite where these fail.
#[derive(Debug)]
struct Compared<const N: usize> {
    t: f64,
    h: f64,
    off: State<N>,
}

impl<'m, M: Model<N>, const N: usize> Resolution<'m, M, N> {
    /// About the error of an element relative to the motion from which on it is looked at. A fixed point contracts by some (hω)², an element of order k is wrong by some (hω)ᵏ.
    const DOUBTFUL: f64 = 0.008;

    /// The part of what the motion extends over that its parts may end elsewhere.
    const MOST: f64 = 0.03;

    pub(in crate::simulation) fn new(again: Again<'m, M>) -> Self {
        Self {
            quick: Self::DOUBTFUL.powf(2.0 / again.element.order() as f64),
            again,
            stepper: None,
            doubtful: 0,
            next: 0,
            work: (0, 0),
            beside: None,
            compared: Vec::new(),
            bounds: nowhere(),
        }
    }

    /// Goes on with another model.
    pub(in crate::simulation) fn set_model(&mut self, model: Share<'m, M>) {
        (self.again.model, self.stepper) = (model, None);
    }

    /// Compares the element if it is the next of those that are to be. Linear models are not looked at: what their elements are wrong by is known.
    #[inline(always)]
    pub(in crate::simulation) fn look(
        &mut self,
        statistics: &Statistics,
        examined: Examined<'_, N>,
    ) {
        if M::FACTS.linear || self.again.control.solve == Solve::Trusting {
            return;
        }
        // An element that was cut has the ratio of its last piece.
        let work = (statistics.newton_iterations, statistics.cuts);
        let (by_newton_or_cut, is_cut) = (work != self.work, work.1 != self.work.1);
        self.work = work;
        let is_due = self.is_due(by_newton_or_cut, statistics);
        if is_due || self.beside.is_some() {
            // Where an element was too long to be proven, a third of it may be, too.
            let parts = if is_cut { 9 } else { 3 };
            self.compare(is_due, parts, examined);
        }
    }

    /// Whether the element is doubtful, and the next of those to be compared.
    #[inline(always)]
    fn is_due(&mut self, by_newton_or_cut: bool, statistics: &Statistics) -> bool {
        // Zero where the last two increments tell nothing.
        let ratio = statistics.contraction.ratio();
        if !by_newton_or_cut && 0.0 < ratio && ratio <= self.quick {
            return false;
        }
        let number = self.doubtful;
        self.doubtful += 1;
        let is_next = number == self.next;
        if is_next {
            self.next = (2 * number).max(1);
        }
        is_next
    }

    /// Compares an element with its parts if it is due, and with parts that begin where those of the element before have ended: they show what the model makes of the error of
    /// that element.
    #[cold]
    #[inline(never)]
    fn compare(&mut self, is_due: bool, parts: u32, examined: Examined<'_, N>) {
        // Not behind an act, which changes the state.
        let continued = |beside: &Beside<N>| beside.run == *examined.before;
        if let Some(beside) = self.beside.take().filter(continued) {
            self.compare_from(beside.state, parts, examined);
        }
        if is_due {
            extend(&mut self.bounds, examined.before);
            let end = self.compare_from(*examined.before, parts, examined);
            let run = *examined.after;
            self.beside = end.map(|state| Beside { state, run });
        }
    }

    /// Where so many parts from `start` end.
    fn compare_from(
        &mut self,
        start: State<N>,
        parts: u32,
        Examined { t, h, after, .. }: Examined<'_, N>,
    ) -> Option<State<N>> {
        let mut off = State {
            q: [f64::INFINITY; N],
            p: [f64::INFINITY; N],
        };
        let end = self.end_of_parts((t, h), parts, start);
        if let Some(end) = &end {
            for a in 0..N {
                off.q[a] = end.q[a] - after.q[a];
                off.p[a] = end.p[a] - after.p[a];
            }
        }
        self.compared.push(Compared { t, h, off });
        end
    }

    /// None where they fail.
    fn end_of_parts(
        &mut self,
        (t, h): (f64, f64),
        parts: u32,
        mut state: State<N>,
    ) -> Option<State<N>> {
        let mut stepper = match self.stepper.take() {
            Some(stepper) => stepper,
            None => self.again.stepper()?,
        };
        let part = h / f64::from(parts);
        for k in 0..parts {
            let start = t + f64::from(k) * part;
            stepper.advance(start, part, &mut state, &[]).ok()?;
            extend(&mut self.bounds, &state);
        }
        self.stepper = Some(stepper);
        Some(state)
    }

    /// What is to be told of the elements of a run that has come to `last`.
    pub(in crate::simulation) fn warning(&self, last: &State<N>) -> Option<Warning> {
        if self.compared.is_empty() {
            return None;
        }
        let mut bounds = self.bounds;
        extend(&mut bounds, last);
        let extent = Extent::between(&bounds);
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

impl<'m, M> Again<'m, M> {
    fn stepper<const N: usize>(&self) -> Option<Stepper<'m, M, N>>
    where
        M: Model<N>,
    {
        let stepper = Stepper::sharing(self.model.clone(), self.element, self.control).ok()?;
        let stepper = stepper.ends_only();
        Some(if self.at_kinks {
            stepper.at_kinks()
        } else {
            stepper
        })
    }
}

/// Room for no state at all.
fn nowhere<const N: usize>() -> [State<N>; 2] {
    let all = |bound: f64| State {
        q: [bound; N],
        p: [bound; N],
    };
    [all(f64::INFINITY), all(f64::NEG_INFINITY)]
}

/// Makes room for a state.
fn extend<const N: usize>([least, largest]: &mut [State<N>; 2], state: &State<N>) {
    for a in 0..N {
        least.q[a] = least.q[a].min(state.q[a]);
        least.p[a] = least.p[a].min(state.p[a]);
        largest.q[a] = largest.q[a].max(state.q[a]);
        largest.p[a] = largest.p[a].max(state.p[a]);
    }
}

/// What a motion extends over.
struct Extent<const N: usize> {
    range: State<N>,
    /// The largest momenta; ones if there are none.
    weights: [f64; N],
}

impl<const N: usize> Extent<N> {
    fn between([least, largest]: &[State<N>; 2]) -> Self {
        let mut weights = [0.0; N];
        let mut range = State {
            q: weights,
            p: weights,
        };
        for a in 0..N {
            range.q[a] = largest.q[a] - least.q[a];
            range.p[a] = largest.p[a] - least.p[a];
            weights[a] = largest.p[a].abs().max(least.p[a].abs());
        }
        if weights == [0.0; N] {
            weights = [1.0; N];
        }
        Self { range, weights }
    }

    /// How large a difference of positions or of momenta is. Positions count with momenta as weights, and momenta with positions, so that units do not matter.
    fn part(&self, off: &State<N>) -> f64 {
        let relative = |weights: &[f64; N], off: &[f64; N], range: &[f64; N]| {
            let (mut distance, mut way) = (0.0, 0.0);
            for a in 0..N {
                distance += weights[a] * off[a].abs();
                way += weights[a] * range[a];
            }
            if distance == 0.0 { 0.0 } else { distance / way }
        };
        let positions = relative(&self.weights, &off.q, &self.range.q);
        positions.max(relative(&self.range.q, &off.p, &self.range.p))
    }
}
