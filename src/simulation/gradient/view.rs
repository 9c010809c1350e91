//! The derivatives of a loss by the states at nodes and inside elements of a motion.

use crate::error::RunErrorKind;
use crate::evaluate::Evaluate;
use crate::length::{FixedLength, Length, Polynomial};
use crate::motion::points::{Point, Points};
use crate::motion::{AtError, Node};
use crate::sensitivity::Sensitive;
use crate::sensitivity::inside::Moved;
use crate::sensitivity::loss::{By, Seen};
use crate::sensitivity::slopes::{Along, Change, Place};
use tfe_runtime::step::DenseElement;
use tfe_runtime::{InsideLoss, Model, Partials, Pull, Sight, State};
#[cfg(feature = "sparse")]
use {
    crate::length::RunTimeLength,
    tfe_runtime::family::{self, FamilyState},
};

/// A loss evaluated along the nodes and elements of a motion.
pub(super) struct View<'a, M, const N: usize, L: Length<N> = FixedLength> {
    model: &'a M,
    seen: &'a Seen,
    /// The derivatives of the integrand, at a quadrature point of weight one.
    running: Partials,
    points: Points<N, L>,
}

/// Transforms derivatives by outputs and velocities into derivatives by states, and sums the derivatives by parameters.
pub(super) trait Pulls<const N: usize, L: Length<N>> {
    /// The derivatives of the loss by the state, in the order of its components.
    fn pulled(
        &mut self,
        places: &[Sight<'_, L::State, L::Vector>],
        each: impl FnMut(L::State),
    ) -> Result<(), Unseen>;
}

impl<M: Model<N>, const N: usize> Pulls<N, FixedLength> for Pull<'_, M, N> {
    fn pulled(
        &mut self,
        places: &[Sight<'_, State<N>, [f64; N]>],
        each: impl FnMut(State<N>),
    ) -> Result<(), Unseen> {
        self.see_all(places, each).map_err(|_| Unseen)
    }
}

#[cfg(feature = "sparse")]
impl<M: family::Model> Pulls<0, RunTimeLength> for family::Backwards<'_, M> {
    fn pulled(
        &mut self,
        places: &[Sight<'_, FamilyState, Vec<f64>>],
        mut each: impl FnMut(FamilyState),
    ) -> Result<(), Unseen> {
        for place in places {
            let at = (place.state, &place.v[..]);
            let by_state = self.pulled(place.t, at, place.partials);
            each(by_state.map_err(|_| Unseen)?);
        }
        Ok(())
    }
}

impl<'a, M: Evaluate<N, L>, const N: usize, L: Length<N>> View<'a, M, N, L> {
    /// Prepares the evaluation; `velocity` provides the length of vectors.
    pub(super) fn new(model: &'a M, seen: &'a Seen, velocity: &L::Vector) -> Self {
        let columns = model.output_names().len();
        let mut running = Partials::none(velocity.as_ref().len(), columns);
        for (column, factor) in &seen.integrals {
            running.outputs[*column] += factor;
        }
        Self {
            model,
            seen,
            running,
            points: Points::new(velocity.clone()),
        }
    }

    /// The direct derivatives of the loss at a node; `None` if the loss does not depend on it.
    pub(super) fn of_node(&self, number: usize) -> Option<Partials> {
        let looks = self.seen.of_node(number);
        if looks.is_empty() {
            return None;
        }
        let Partials { q, outputs, .. } = &self.running;
        let mut partials = Partials::none(q.len(), outputs.len());
        for look in looks {
            match &look.by {
                By::Output(column, factor) => partials.outputs[*column] += factor,
                By::Node { q, p, v, .. } => {
                    for (sums, own) in [
                        (&mut partials.q, q),
                        (&mut partials.p, p),
                        (&mut partials.v, v),
                    ] {
                        for (sum, own) in sums.iter_mut().zip(own) {
                            *sum += own;
                        }
                    }
                }
            }
        }
        Some(partials)
    }

    /// The derivatives of the integrals over an element, for each of its pieces; empty if there are no integrals.
    pub(super) fn of_element(
        &mut self,
        pull: &mut impl Pulls<N, L>,
        element: &L::Polynomial,
    ) -> Result<Vec<InsideLoss>, RunErrorKind> {
        if self.seen.integrals.is_empty() {
            return Ok(Vec::new());
        }
        let pieces = element.pieces().iter();
        pieces.map(|piece| self.of_piece(pull, piece)).collect()
    }

    fn of_piece(
        &mut self,
        pull: &mut impl Pulls<N, L>,
        piece: &L::Polynomial,
    ) -> Result<InsideLoss, RunErrorKind> {
        let mut inside = InsideLoss::none(self.running.q.len(), piece.degree());
        let mut places = Vec::with_capacity(piece.degree());
        self.points.of(self.model, piece, |point| {
            let mut partials = self.running.clone();
            for output in &mut partials.outputs {
                *output *= point.weight;
            }
            places.push((point, partials));
            Ok::<_, Unseen>(())
        })?;
        let sights = places.iter().map(|(point, partials)| Sight {
            t: point.t,
            state: &point.state,
            v: &point.velocity,
            partials,
        });
        let sights: Vec<_> = sights.collect();
        let (mut seen, mut is_finite) = (places.iter(), true);
        pull.pulled(&sights, |by_state| {
            let (q, p) = L::parts(&by_state);
            let (q, p) = (q.as_ref(), p.as_ref());
            is_finite &= q.iter().chain(p).all(|one| one.is_finite());
            if let Some((point, _)) = seen.next() {
                inside.add(point.tau, (q, p));
            }
        })?;
        match is_finite {
            true => Ok(inside),
            false => Err(Unseen.into()),
        }
    }
}

impl<M: Model<N>, const N: usize> View<'_, M, N> {
    /// The derivative of the direct contribution of a node by its time, at fixed state.
    pub(super) fn by_time(&self, number: usize, node: &Node<N>) -> f64 {
        let Some(partials) = self.of_node(number) else {
            return 0.0;
        };
        let Node { t, q, p, v } = node;
        let place = Place { t: *t, q, p, v };
        let along = Along::new(self.model, place);
        let change = Change {
            t: 1.0,
            ..Change::ZERO
        };
        let velocity = along.velocity(&change);
        let outputs = along.outputs(&change, &velocity);
        let explicit = self.seen.of_node(number).iter().map(|look| match &look.by {
            By::Output(..) => 0.0,
            By::Node { t, .. } => *t,
        });
        let by_velocity = partials.v.iter().zip(&velocity);
        let by_outputs = partials.outputs.iter().zip(&outputs);
        let products = by_velocity.chain(by_outputs);
        let products = products.filter(|(factor, _)| **factor != 0.0);
        explicit.sum::<f64>() + products.map(|(factor, slope)| factor * slope).sum::<f64>()
    }

    /// Adds the derivatives of the integrals over all elements, times the sensitivities along them, by the start, in
    /// the order (p, q), and by parameters. Explicit derivatives by parameters are left to the sums.
    pub(super) fn add_along(
        &mut self,
        pull: &mut Pull<'_, M, N>,
        sensitive: &Sensitive<N>,
        all: &mut [f64],
    ) -> Result<(), RunErrorKind> {
        if self.seen.integrals.is_empty() {
            return Ok(());
        }
        let elements = sensitive.motion().elements().iter();
        let pieces: Vec<_> = elements.flat_map(DenseElement::pieces).collect();
        if pieces.len() != sensitive.inside().len() {
            return Err(Unseen.into());
        }
        for (piece, inside) in pieces.into_iter().zip(sensitive.inside()) {
            let loss = self.of_piece(pull, piece)?;
            for (sum, own) in all.iter_mut().zip(&inside.product(&loss)) {
                *sum += own;
            }
            if let Some(moved) = &inside.moved {
                let length = piece.length();
                let (model, outputs) = (self.model, &self.running.outputs);
                self.points.of(model, piece, |point| {
                    add_moving((model, outputs), &point, (moved, length), all);
                    Ok::<_, Unseen>(())
                })?;
            }
        }
        Ok(())
    }
}

/// Adds the effect of moving quadrature points and element lengths on the integrals.
fn add_moving<M: Model<N>, const N: usize>(
    (model, factors): (&M, &[f64]),
    point: &Point<N, FixedLength>,
    (moved, length): (&Moved, f64),
    all: &mut [f64],
) {
    let Point {
        tau,
        t,
        weight,
        state,
        velocity,
    } = point;
    let place = Place {
        t: *t,
        q: &state.q,
        p: &state.p,
        v: velocity,
    };
    let along = Along::new(model, place);
    let change = Change {
        t: 1.0,
        ..Change::ZERO
    };
    let by_time = along.outputs(&change, &along.velocity(&change));
    let mut values = vec![0.0; factors.len()];
    model.outputs(*t, (&state.q, &state.p), velocity, &mut values);
    let (times, lengths) = (moved.time(*tau), moved.length() / length);
    for (column, sum) in all.iter_mut().enumerate() {
        for (output, factor) in factors.iter().enumerate() {
            let slope = by_time[output] * times[column] + values[output] * lengths[column];
            *sum += weight * factor * slope;
        }
    }
}

/// The loss has no derivatives at a place.
pub(super) struct Unseen;

impl From<AtError> for Unseen {
    fn from(_: AtError) -> Self {
        Self
    }
}

impl From<Unseen> for RunErrorKind {
    fn from(_: Unseen) -> Self {
        Self::Loss {
            name: "the loss".to_owned(),
            why: "its derivatives are not finite",
        }
    }
}
