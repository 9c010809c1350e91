//! The derivatives of a loss by the states at nodes and inside elements of a motion.

use crate::error::RunErrorKind;
use crate::evaluate::Evaluate;
use crate::length::{FixedLength, Length, Polynomial};
use crate::motion::points::Points;
use crate::motion::{AtError, Node};
use crate::sensitivity::Sensitive;
use crate::sensitivity::loss::{By, Seen};
use crate::sensitivity::slopes::Change;
use crate::sensitivity::varied::Varied;
use crate::simulation::events::value::output_slopes;
use crate::simulation::kind::Simulated;
use crate::simulation::sensitive::jump::VariedModel;
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

/// The derivatives by times that events move.
impl<M, const N: usize, L> View<'_, M, N, L>
where
    M: Simulated<N, L> + Varied<N, L>,
    L: Length<N>,
{
    /// The derivative of the direct contribution of a node by its time, at fixed state.
    pub(super) fn by_time(&self, number: usize, node: &Node<N, L>) -> f64 {
        let Some(partials) = self.of_node(number) else {
            return 0.0;
        };
        let (velocity, outputs) = by_time(self.model, node);
        let explicit = self.seen.of_node(number).iter().map(|look| match &look.by {
            By::Output(..) => 0.0,
            By::Node { t, .. } => *t,
        });
        let by_velocity = partials.v.iter().zip(velocity.as_ref());
        let by_outputs = partials.outputs.iter().zip(&outputs);
        let products = by_velocity.chain(by_outputs);
        let products = products.filter(|(factor, _)| **factor != 0.0);
        explicit.sum::<f64>() + products.map(|(factor, slope)| factor * slope).sum::<f64>()
    }

    /// The derivatives of the integrals over a piece of an element by the times of its start and its end, at a fixed
    /// polynomial: quadrature points move, and the length changes.
    pub(super) fn by_ends(&mut self, piece: &L::Polynomial) -> Result<[f64; 2], RunErrorKind> {
        let (model, factors, length) = (self.model, &self.running.outputs, piece.length());
        let mut by_ends = [0.0; 2];
        if self.seen.integrals.is_empty() {
            return Ok(by_ends);
        }
        self.points.of(model, piece, |point| {
            let node = Node::<N, L>::of(point.t, &point.state, point.velocity);
            let (_, slopes) = by_time(model, &node);
            let mut values = vec![0.0; factors.len()];
            model.outputs(node.t, (&node.q, &node.p), &node.v, &mut values);
            for (factor, (slope, value)) in factors.iter().zip(slopes.iter().zip(&values)) {
                if *factor == 0.0 {
                    continue;
                }
                let weight = point.weight * factor;
                let (moved, stretched) = (weight * slope, weight * value / length);
                by_ends[0] += moved * (1.0 - point.tau) - stretched;
                by_ends[1] += moved * point.tau + stretched;
            }
            Ok::<_, Unseen>(())
        })?;
        Ok(by_ends)
    }
}

impl<M: Model<N>, const N: usize> View<'_, M, N> {
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
                for (by_end, times) in self.by_ends(piece)?.iter().zip(&moved.ends) {
                    for (sum, dt) in all.iter_mut().zip(times) {
                        *sum += by_end * dt;
                    }
                }
            }
        }
        Ok(())
    }
}

/// The derivatives of the velocity and of the outputs by the time, at a fixed state.
fn by_time<L: Length<N>, const N: usize>(
    model: &dyn VariedModel<N, L>,
    node: &Node<N, L>,
) -> (L::Vector, Vec<f64>) {
    let change = Change {
        t: 1.0,
        ..Change::<N, L>::by(None, &node.q)
    };
    let velocity = (model.velocity_along(node))(&change);
    let place = (node.t, &node.q, &node.p, &node.v);
    let outputs = output_slopes(model, place, &change, &velocity);
    (velocity, outputs)
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
