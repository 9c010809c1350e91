//! Whether elements resolve the motion: a second look at some of those whose iteration did not contract quickly (T-121).

use super::Warning;
use tfe_runtime::step::{Control, Stepper};
use tfe_runtime::{Element, Model, Share, Solve, State, Statistics};

/// Compares elements with three of a third of the length: halves might be cut into the same pieces as the element.
#[derive(Debug)]
pub(in crate::simulation) struct Resolution<'m, M, const N: usize> {
    model: Share<'m, M>,
    element: Element,
    control: Control,
    /// The largest ratio of increments that is not doubtful.
    quick: f64,
    /// Made when it is first needed.
    thirds: Option<Stepper<'m, M, N>>,
    /// Elements that were doubtful so far.
    doubtful: usize,
    /// The number among these of the one that is compared next.
    next: usize,
    /// Newton iterations and cuts so far.
    work: (u64, u64),
    compared: Vec<Compared<N>>,
    /// The least and the largest coordinates and momenta that were seen.
    bounds: [State<N>; 2],
}

/// An element that has been passed without an error.
#[derive(Clone, Copy)]
pub(in crate::simulation) struct Examined<'a, const N: usize> {
    pub(in crate::simulation) t: f64,
    pub(in crate::simulation) h: f64,
    pub(in crate::simulation) before: &'a State<N>,
    pub(in crate::simulation) after: &'a State<N>,
}

/// By how much its end is away from that of three thirds; infinite where these fail.
#[derive(Debug)]
struct Compared<const N: usize> {
    t: f64,
    h: f64,
    off: State<N>,
}

impl<'m, M: Model<N>, const N: usize> Resolution<'m, M, N> {
    /// About the error of an element relative to the motion from which on it is looked at. A fixed point contracts by some (hω)², an element of order k is wrong by some (hω)ᵏ.
    const DOUBTFUL: f64 = 0.008;

    /// The part of what the motion extends over that three thirds may end elsewhere.
    const MOST: f64 = 0.03;

    pub(in crate::simulation) fn new(
        model: Share<'m, M>,
        element: Element,
        control: Control,
    ) -> Self {
        Self {
            model,
            element,
            control,
            quick: Self::DOUBTFUL.powf(2.0 / element.order() as f64),
            thirds: None,
            doubtful: 0,
            next: 0,
            work: (0, 0),
            compared: Vec::new(),
            bounds: [f64::INFINITY, f64::NEG_INFINITY].map(|bound| State {
                q: [bound; N],
                p: [bound; N],
            }),
        }
    }

    /// Goes on with another model.
    pub(in crate::simulation) fn set_model(&mut self, model: Share<'m, M>) {
        (self.model, self.thirds) = (model, None);
    }

    /// Compares the element if it is the next of those that are to be. Linear models are not looked at: what their elements are wrong by is known.
    pub(in crate::simulation) fn look(
        &mut self,
        statistics: &Statistics,
        examined: Examined<'_, N>,
    ) {
        if M::FACTS.linear || self.control.solve == Solve::Trusting {
            return;
        }
        // An element that was cut has the ratio of its last piece.
        let work = (statistics.newton_iterations, statistics.cuts);
        let by_newton_or_cut = work != self.work;
        self.work = work;
        // Zero where the last two increments tell nothing.
        let ratio = statistics.contraction.ratio();
        if !by_newton_or_cut && 0.0 < ratio && ratio <= self.quick {
            return;
        }
        let number = self.doubtful;
        self.doubtful += 1;
        if number == self.next {
            self.next = (2 * number).max(1);
            self.compare(examined);
        }
    }

    #[cold]
    fn compare(&mut self, examined: Examined<'_, N>) {
        let Examined { t, h, .. } = examined;
        self.extend(examined.before);
        let mut off = State {
            q: [f64::INFINITY; N],
            p: [f64::INFINITY; N],
        };
        if let Some(end) = self.end_of_thirds(t, h, *examined.before) {
            for a in 0..N {
                off.q[a] = end.q[a] - examined.after.q[a];
                off.p[a] = end.p[a] - examined.after.p[a];
            }
        }
        self.compared.push(Compared { t, h, off });
    }

    /// None where they fail.
    fn end_of_thirds(&mut self, t: f64, h: f64, mut state: State<N>) -> Option<State<N>> {
        let mut stepper = match self.thirds.take() {
            Some(stepper) => stepper,
            None => Stepper::sharing(self.model.clone(), self.element, self.control)
                .ok()?
                .ends_only(),
        };
        let third = h / 3.0;
        for k in [0.0, 1.0, 2.0] {
            stepper
                .advance(t + k * third, third, &mut state, &[])
                .ok()?;
            self.extend(&state);
        }
        self.thirds = Some(stepper);
        Some(state)
    }

    fn extend(&mut self, state: &State<N>) {
        let [least, largest] = &mut self.bounds;
        for a in 0..N {
            least.q[a] = least.q[a].min(state.q[a]);
            least.p[a] = least.p[a].min(state.p[a]);
            largest.q[a] = largest.q[a].max(state.q[a]);
            largest.p[a] = largest.p[a].max(state.p[a]);
        }
    }

    /// What is to be told of the elements of a run that has come to `last`.
    pub(in crate::simulation) fn warning(mut self, last: &State<N>) -> Option<Warning> {
        if self.compared.is_empty() {
            return None;
        }
        self.extend(last);
        let extent = Extent::between(&self.bounds);
        let mut found = None;
        for Compared { t, h, off } in &self.compared {
            let part = extent.part(off);
            // NaN tells nothing that others do not.
            if !(part > Self::MOST) {
                continue;
            }
            let (_, _, distance, count) = found.get_or_insert((*t, *h, part, 0));
            *distance = part.max(*distance);
            *count += 1;
        }
        found.map(|(time, step, distance, count)| Warning::Unresolved {
            time,
            step,
            distance,
            count,
        })
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
