//! The end of an element, to more than the working precision.

use super::four::{Four, Precise};
use super::{Leg, Points};
use crate::model::State;

/// A number for every coordinate, and what rounding took from it.
type Exact<const N: usize> = ([f64; N], [f64; N]);

impl<const N: usize> Points<N> {
    /// Start plus h times the integrals of the rates of first-order equations.
    #[inline(always)]
    pub(super) fn end<V: Four>(&self, like: V, leg: &Leg<'_, N>) -> (State<N>, State<N>) {
        let velocity = self.integral(like, &self.tables.weights, &self.rates);
        let force = self.integral(like, &self.tables.weights, &self.forces);
        let (start, low) = (leg.start, leg.low);
        ends(
            moved(like, leg.h, &velocity, (&start.q, &low.q)),
            moved(like, leg.h, &force, (&start.p, &low.p)),
        )
    }

    /// p₁ = p₀ + h Σ b f and q₁ = q₀ + h (v₀ + h Σ (bᵀA) M⁻¹ f) of second-order equations.
    #[inline(always)]
    pub(super) fn end_second_order<V: Four>(
        &mut self,
        like: V,
        leg: &Leg<'_, N>,
    ) -> (State<N>, State<N>) {
        let groups = self.tables.groups;
        if let Some(mass) = &self.inertia.diagonal {
            // Rounded for itself at every point, not with the one rounding of 1/m.
            for a in 0..N {
                let mass = like.like(mass[a]);
                for k in a * groups..(a + 1) * groups {
                    self.momenta[k] = (like.with(self.forces[k]) / mass).lanes();
                }
            }
        } else {
            self.accelerate(like);
        }
        let force = self.integral(like, &self.tables.weights, &self.forces);
        let lever = self.integral(like, &self.tables.lever, &self.momenta);
        let start = (&self.velocity, &self.velocity_low);
        let velocity = moved(like, leg.h, &lever, start);
        let (start, low) = (leg.start, leg.low);
        ends(
            moved(like, leg.h, &velocity, (&start.q, &low.q)),
            moved(like, leg.h, &force, (&start.p, &low.p)),
        )
    }

    #[inline(always)]
    fn integral<V: Four>(
        &self,
        like: V,
        weights: &super::tables::Weights,
        rows: &[[f64; 4]],
    ) -> Exact<N> {
        let (mut high, mut low) = ([0.0; N], [0.0; N]);
        for (a, row) in rows.chunks_exact(self.tables.groups).enumerate() {
            (high[a], low[a]) = weights.sum(like, row);
        }
        (high, low)
    }
}

/// start + h · rate
#[inline(always)]
fn moved<V: Four, const N: usize>(
    like: V,
    h: f64,
    (rate, rate_low): &Exact<N>,
    (start, start_low): (&[f64; N], &[f64; N]),
) -> Exact<N> {
    let (mut end, mut end_low) = (*start, *start_low);
    let h = like.like(h);
    for at in (0..N).step_by(4) {
        let rate = (of(like, rate, at), of(like, rate_low, at));
        let start = (of(like, start, at), of(like, start_low, at));
        let (high, low) = moved_exactly(h, rate, start);
        let (high, low) = (high.lanes(), low.lanes());
        for a in at..N.min(at + 4) {
            (end[a], end_low[a]) = (high[a - at], low[a - at]);
        }
    }
    (end, end_low)
}

/// start + h · rate, each a number and what rounding took from it.
#[inline(always)]
pub(crate) fn moved_exactly<V: Precise>(h: V, rate: (V, V), start: (V, V)) -> (V, V) {
    let (product, rest) = h.product(rate.0);
    let rest = (rest + h * rate.1) + start.1;
    let (sum, lost) = start.0.exact_sum(product);
    sum.exact_sum(lost + rest)
}

/// Four of the numbers; zeros beyond the last.
#[inline(always)]
fn of<V: Four, const N: usize>(like: V, numbers: &[f64; N], at: usize) -> V {
    let mut four = [0.0; 4];
    let end = N.min(at + 4);
    four[..end - at].copy_from_slice(&numbers[at..end]);
    like.with(four)
}

#[inline(always)]
fn ends<const N: usize>((q, q_low): Exact<N>, (p, p_low): Exact<N>) -> (State<N>, State<N>) {
    (State { q, p }, State { q: q_low, p: p_low })
}
