//! Whether a solution fulfils all constraints as they are declared.
//!
//! Elements keep as many constraints as are independent where they begin. The others follow from these, unless they contradict them or the position is singular, and nothing else looks
//! at what they leave.

use super::error::AssemblyError;
use crate::numbers::{larger, norm};
use tfe_runtime::constrained::{self, START_TOLERANCE};
use tfe_runtime::{Model, State};

/// Velocities that move so small a part of the positions in one element are rest, as in runs.
const REST: f64 = 1e-5;

/// What a constraint leaves at a node.
struct Left {
    /// |φ| over the length of its row.
    position: f64,
    /// |A v + a| over the length of its row.
    velocity: f64,
}

/// Refuses a solution that violates a constraint: by more than a start of a run may, or by more than `tolerance` where that is larger.
///
/// Positions are looked at at all nodes, velocities where elements end: a momentum that is given at the very start may point off the constraints, and the first element takes away what does.
pub(super) fn check<M: Model<N>, const N: usize>(
    model: &M,
    (times, nodes): (&[f64], &[State<N>]),
    tolerance: f64,
) -> Result<(), AssemblyError> {
    let declared = M::CONSTRAINTS;
    let mut rows = vec![[0.0; N]; declared.len()];
    let (mut drift, mut values) = (vec![0.0; declared.len()], vec![0.0; declared.len()]);
    let extent = nodes.iter().map(|node| norm(&node.q)).fold(0.0, larger);
    let step = (times[nodes.len() - 1] - times[0]).abs() / (nodes.len() - 1) as f64;
    let mut speed = REST * extent / step;
    let mut left = Vec::with_capacity(nodes.len() * declared.len());
    for (place, (t, node)) in times.iter().zip(nodes).enumerate() {
        model.constraint_rows(*t, &node.q, &mut rows, &mut drift);
        model.constraint_values(*t, &node.q, &mut values);
        // Who needs the velocity of a momentum that has none says so.
        let v = constrained::velocity_of(model, *t, &node.q, &node.p, &[0.0; N]);
        let v = v.ok().filter(|_| place > 0);
        if let Some(v) = &v {
            speed = larger(speed, norm(v));
        }
        for (c, row) in rows.iter().enumerate() {
            let length = norm(row);
            let length = if length > 0.0 { length } else { 1.0 };
            speed = larger(speed, drift[c].abs() / length);
            let rate = |v: &[f64; N]| {
                let terms = row.iter().zip(v).map(|(a, v)| a * v);
                drift[c] + terms.sum::<f64>()
            };
            left.push(Left {
                position: values[c].abs() / length,
                velocity: v.as_ref().map_or(0.0, rate).abs() / length,
            });
        }
    }
    let allowed = START_TOLERANCE.max(tolerance);
    for (place, left) in left.iter().enumerate() {
        for (off, scale, position) in [(left.position, extent, true), (left.velocity, speed, false)]
        {
            // What is not a number does not hold.
            if !(off <= allowed * scale) {
                return Err(AssemblyError::Violated {
                    constraint: declared[place % declared.len()].name,
                    time: times[place / declared.len()],
                    position,
                    residual: off / scale,
                });
            }
        }
    }
    Ok(())
}
