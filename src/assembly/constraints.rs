//! Checks that a solution satisfies all constraints as declared.
//!
//! Elements impose only as many constraints as are independent at their start. The others follow from these, unless
//! they contradict each other or the position is singular; only this check detects that.

use super::error::AssemblyError;
use crate::numbers::{larger, norm};
use tfe_runtime::constrained::{self, START_TOLERANCE, Scales};
use tfe_runtime::{Model, State};

/// The body counts as at rest if it moves less than this part of the largest position in one element, as in runs.
const REST: f64 = 1e-5;

/// The violation of a constraint at a node.
struct Violation {
    /// |φ| divided by the norm of its gradient.
    position: f64,
    /// |A v + a| divided by the norm of its row A.
    velocity: f64,
    /// Both relative to the size of the terms of the constraint (T-165).
    own: (f64, f64),
}

/// Refuses a solution that violates a constraint by more than the larger one of `tolerance` and the limit for the start
/// of a run.
///
/// Positions are checked at all nodes, velocities at all but the first: the momentum prescribed at the start may
/// violate the constraints, and the first element removes that part. Violations are relative to all positions and
/// velocities of the motion, and to the size of the terms of the constraint itself.
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
    let scales = Scales {
        h: step,
        extent,
        tolerance: 0.0,
    };
    let still = [0.0; N];
    let mut speed = REST * extent / step;
    let mut left = Vec::with_capacity(nodes.len() * declared.len());
    for (place, (t, node)) in times.iter().zip(nodes).enumerate() {
        model.constraint_rows(*t, &node.q, &mut rows, &mut drift);
        model.constraint_values(*t, &node.q, &mut values);
        // If the velocity does not exist, its users report that.
        let v = constrained::velocity_of(model, *t, &node.q, &node.p, &[0.0; N]);
        let v = v.ok().filter(|_| place > 0);
        if let Some(v) = &v {
            speed = larger(speed, norm(v));
        }
        let at = (&node.q, v.as_ref().unwrap_or(&still));
        let own = constrained::own_residuals(model, *t, at, scales);
        for (c, row) in rows.iter().enumerate() {
            let length = norm(row);
            let length = if length > 0.0 { length } else { 1.0 };
            speed = larger(speed, drift[c].abs() / length);
            let rate = |v: &[f64; N]| {
                let terms = row.iter().zip(v).map(|(a, v)| a * v);
                drift[c] + terms.sum::<f64>()
            };
            left.push(Violation {
                position: values[c].abs() / length,
                velocity: v.as_ref().map_or(0.0, rate).abs() / length,
                own: (own[c].0, v.as_ref().map_or(0.0, |_| own[c].1)),
            });
        }
    }
    let allowed = START_TOLERANCE.max(tolerance);
    for (place, left) in left.iter().enumerate() {
        for (off, scale, position) in [
            (left.position, extent, true),
            (left.velocity, speed, false),
            (left.own.0, 1.0, true),
            (left.own.1, 1.0, false),
        ] {
            // A NaN is a violation.
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
