//! Whether a model is the same a period later, with the coordinates grown by the advance: if not, what closes after the
//! period is no periodic orbit.

use super::error::OrbitError;
use crate::length::Length;
use crate::motion::Node;
use crate::numbers::raise;
use crate::simulation::Differentiable;
use nalgebra::DVector;

/// The largest number of places of an orbit that are looked at.
const PLACES: usize = 16;

/// The part of an element, and of the period, after which a place lies: none of the simple fractions at which forces
/// have jumps.
const GOLDEN: f64 = 0.381_966_011_250_105;

/// The largest change after a period, as part of the changes within it. A period that was given with a few digits less
/// than all makes an orbit that is wrong in those digits.
const MAX: f64 = 1e-4;

/// The same as part of the rates themselves, which are rounded.
const ROUNDINGS: f64 = 1e-9;

/// The rounding errors of the largest reaction that the rate of a momentum may have: that of a coordinate without
/// inertia, of which forces and reactions cancel, is nothing else.
const OF_REACTIONS: f64 = 16.0;

/// The rates (dp/dt, dq/dt) at a node.
pub(super) fn rate<M, L, const N: usize>(model: &M, node: &Node<N, L>) -> DVector<f64>
where
    M: Differentiable<N, L>,
    L: Length<N>,
{
    let of_p = model.momentum_rate(node);
    let (of_p, of_q) = (of_p.as_ref(), node.v.as_ref());
    DVector::from_iterator(2 * of_q.len(), of_p.iter().chain(of_q).copied())
}

/// Refuses a period after which the equations of motion are others than at its start; `nodes` are times and states along
/// the orbit, and `grown` is the growth of each coordinate over the period.
pub(crate) fn check_repeats<M, L, const N: usize>(
    model: &M,
    nodes: &[(f64, L::State)],
    period: f64,
    grown: impl Fn(usize) -> f64,
) -> Result<(), OrbitError>
where
    M: Differentiable<N, L>,
    L: Length<N>,
{
    let Some((_, first)) = nodes.first() else {
        return Ok(());
    };
    let n = L::parts(first).0.as_ref().len();
    let grows = (0..n).any(|a| grown(a) != 0.0);
    // Functions of inputs need not be defined beyond the period.
    if M::GIVEN_INPUTS || !(M::DEPENDS_ON_TIME || grows) {
        return Ok(());
    }
    let at = |t: f64, state: &L::State| {
        let still = L::zero(L::parts(state).0);
        Node::new(model, t, state, &still)
    };
    let rates = |t: f64, state: &L::State| rate(model, &at(t, state));
    let mut balance = 0.0;
    let mut seen = Vec::new();
    for pair in nodes.windows(2).step_by(nodes.len().div_ceil(PLACES)) {
        let (t, state) = (pair[0].0 + GOLDEN * (pair[1].0 - pair[0].0), &pair[0].1);
        let (q, p) = L::parts(state);
        let later = L::state(L::from_fn(q, |a| q.as_ref()[a] + grown(a)), p.clone());
        let node = at(t, state);
        if const { M::IS_CONSTRAINED } {
            let rounding = model.force_rounding(t, (&node.q, &node.p), &node.v);
            raise(&mut balance, OF_REACTIONS * rounding);
        }
        let now = rate(model, &node);
        let off = rates(t + period, &later) - &now;
        let varies = rates(t + GOLDEN * period, state) - &now;
        // Where there are no rates, nothing is compared.
        if now.iter().chain(&off).chain(&varies).all(|x| x.is_finite()) {
            seen.push((t, now, off, varies));
        }
    }
    for row in 0..2 * n {
        let (mut size, mut variation, mut worst) = (0.0, 0.0, (f64::NAN, 0.0));
        for (t, now, off, varies) in &seen {
            raise(&mut size, now[row].abs());
            raise(&mut variation, varies[row].abs());
            if off[row].abs() > worst.1 {
                worst = (*t, off[row].abs());
            }
        }
        // Sums of coordinates that have grown are rounded otherwise.
        let rounded = if grows { MAX } else { ROUNDINGS };
        let of_reactions = if row < n { balance } else { 0.0 };
        if worst.1 > MAX * variation + rounded * size + of_reactions {
            return Err(OrbitError::NotRepeated {
                period,
                time: worst.0,
                off: worst.1 / if size > 0.0 { size } else { worst.1 },
            });
        }
    }
    Ok(())
}
