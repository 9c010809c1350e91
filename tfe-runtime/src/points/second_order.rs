//! The iteration for equations of second order, M q̈ = f(q, q̇), whose only unknowns are the forces: one text for four
//! points of a trajectory side by side and for eight trajectories.

use super::arrangement::{Arrangement, Magnitude, Row};
use super::evaluation::Evaluation;
use super::forms::acting;
use crate::model::{Form, Model};
use crate::precise::Precise;
use crate::registers::side::{Side, each_coordinate};

/// The unknowns and the working memory of their iteration; rows for each point or each group of points.
pub(crate) struct Forces<'a, X, const L: usize, const N: usize> {
    /// L_q + Q, or π: rates of the momenta.
    pub(crate) forces: &'a mut [Row<L, N>],
    /// A² f
    pub(crate) products: &'a mut [Row<L, N>],
    pub(crate) more_products: &'a mut [Row<L, N>],
    /// The contribution of the velocity at the start.
    pub(crate) drift: &'a mut [Row<L, N>],
    /// The velocity at the start, and its rounding error.
    pub(crate) velocity: &'a [X; N],
    pub(crate) velocity_low: &'a [X; N],
}

impl<X: Copy, const L: usize, const N: usize> Forces<'_, X, L, N> {
    /// Computes the contribution of the velocity at the start, in working precision.
    #[inline(always)]
    pub(crate) fn set_drift<V, A, M>(self, like: V, at: &A)
    where
        V: Side<L>,
        A: Arrangement<V, L, N, Number = X>,
        M: Model<N>,
    {
        let h = like.like(at.h());
        let reach = A::entries(&at.tables().reach);
        for (drift, reach) in self.drift.iter_mut().zip(reach) {
            let reach = h * A::entry(like, *reach);
            each_coordinate!(a, N, {
                if M::IGNORABLE[a] {
                    continue;
                }
                drift[a] = (reach * at.number(like, self.velocity[a])).lanes();
            });
        }
    }

    /// The same with the contributions of the low words of state and tables. The products have to be A² f; those with
    /// the low part of A² are computed here.
    #[inline(always)]
    pub(crate) fn set_exact_drift<V, A, M>(self, like: V, at: &A)
    where
        V: Side<L>,
        A: Arrangement<V, L, N, Number = X>,
        M: Model<N>,
    {
        let (tables, inertia) = (at.tables(), at.inertia());
        let is_diagonal = inertia.is_diagonal::<M>();
        let acting = &const { acting::<M, N>() };
        at.apply(
            like,
            &tables.twice_low,
            acting,
            self.forces,
            self.more_products,
        );
        let h = like.like(at.h());
        // The rounding error of h², which is the same in every step.
        let (square, square_low) = h.product(h);
        let count = self.drift.len();
        let drift = &mut self.drift[..count];
        let products = &self.products[..count];
        let products_low = &self.more_products[..count];
        let reach = &A::entries(&tables.reach)[..count];
        let reach_low = &A::entries(&tables.reach_low)[..count];
        each_coordinate!(a, N, {
            if M::IGNORABLE[a] {
                continue;
            }
            let v = at.number(like, self.velocity[a]);
            let v_low = at.number(like, self.velocity_low[a]);
            let start_low = at.low(like, a).0;
            for c in 0..count {
                let low = if is_diagonal {
                    let by_square = like.like(inertia.reach_low[a]) * like.with(products[c][a]);
                    let more = like.with(products_low[c][a]);
                    like.like(inertia.reach[a]).times_plus(more, by_square)
                } else {
                    let rate_low = inertia.row::<M, _, L>(like, &products_low[c], a);
                    let rate = inertia.row::<M, _, L>(like, &products[c], a);
                    square.times_plus(rate_low, square_low * rate)
                };
                let (reach, reach_low) = (A::entry(like, reach[c]), A::entry(like, reach_low[c]));
                let v_low = reach.times_plus(v_low, reach_low * v);
                let low = start_low + h.times_plus(v_low, low);
                drift[c][a] = h.times_plus(reach * v, low).lanes();
            }
        });
    }

    /// One iteration: coordinates from products with the forces, then forces at the coordinates. Returns how much
    /// accelerations have changed, and how large they are.
    #[inline(always)]
    pub(crate) fn sweep<V, A, M>(
        self,
        like: V,
        model: &M,
        at: &A,
        evaluation: &mut Evaluation<V, N>,
    ) -> (Magnitude<V>, Magnitude<V>)
    where
        V: Side<L>,
        A: Arrangement<V, L, N, Number = X>,
        M: Model<N>,
    {
        let inertia = at.inertia();
        let is_diagonal = inertia.is_diagonal::<M>();
        if const { M::FACTS.forced } {
            let acting = &const { acting::<M, N>() };
            let once = &at.tables().once;
            at.apply(like, once, acting, self.forces, self.more_products);
        }
        let h = like.like(at.h());
        let (mut changed, mut size) = (Magnitude::none(like), Magnitude::none(like));
        let forces = self.forces;
        let count = forces.len();
        let products = &self.products[..count];
        let more_products = &self.more_products[..count];
        let drift = &self.drift[..count];
        let nodes = &A::entries(&at.tables().nodes)[..count];
        for c in 0..count {
            let Evaluation { q, z, first } = evaluation;
            let far = (&products[c], &drift[c]);
            if is_diagonal {
                positions::<V, A, M, true, L, N>(like, at, far, q);
            } else {
                positions::<V, A, M, false, L, N>(like, at, far, q);
            }
            if const { M::FACTS.forced } {
                each_coordinate!(a, N, {
                    z[a] = match M::FORM {
                        Form::Lagrangian => {
                            let rate = inertia.row::<M, _, L>(like, &more_products[c], a);
                            h.times_plus(rate, at.number(like, self.velocity[a]))
                        }
                        Form::Hamiltonian => {
                            let rate = like.with(more_products[c][a]);
                            h.times_plus(rate, at.start(like, a).1)
                        }
                    };
                });
            }
            A::first(model, at.time(like, nodes[c]), (q, z), first, None);
            each_coordinate!(a, N, {
                if M::IGNORABLE[a] {
                    continue;
                }
                let given = match M::FORM {
                    Form::Lagrangian => first.q[a],
                    Form::Hamiltonian => -first.q[a],
                };
                let force = if const { M::FACTS.forced } {
                    given + first.force[a]
                } else {
                    given
                };
                let factor = at.factor(like, a);
                changed.raise(factor * (force - like.with(forces[c][a])));
                size.raise(factor * force);
                at.set(&mut forces[c][a], force);
            });
        }
        (changed, size)
    }
}

/// Coordinates: start + drift + h² M⁻¹ · products.
#[inline(always)]
fn positions<V, A, M, const DIAGONAL: bool, const L: usize, const N: usize>(
    like: V,
    at: &A,
    (products, drift): (&Row<L, N>, &Row<L, N>),
    q: &mut [V; N],
) where
    V: Side<L>,
    A: Arrangement<V, L, N>,
    M: Model<N>,
{
    let (inertia, square) = (at.inertia(), like.like(at.h() * at.h()));
    each_coordinate!(a, N, {
        if M::IGNORABLE[a] {
            continue;
        }
        let drift = like.with(drift[a]);
        let moved = if const { DIAGONAL } {
            like.like(inertia.reach[a])
                .times_plus(like.with(products[a]), drift)
        } else {
            square.times_plus(inertia.row::<M, _, L>(like, products, a), drift)
        };
        q[a] = at.start(like, a).0 + moved;
    });
}

/// The velocity that belongs to a momentum, and its rounding error: no floating-point velocity belongs exactly to the
/// momentum.
#[inline(always)]
pub(crate) fn velocity_of<V: Precise>((p, p_low): (V, V), mass: V, inverse: V) -> (V, V) {
    let v = p * inverse;
    let (product, rest) = v.product(mass);
    let missing = p_low + ((p - product) - rest);
    (v, missing * inverse)
}
