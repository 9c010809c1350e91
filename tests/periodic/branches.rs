//! Branches of periodic orbits that come to rest, and in units of any size.

use crate::continuation::{Pendulum, close};
use std::f64::consts::TAU;
use tfe::continuation::End;
use tfe::prelude::*;

/// Orbits of one energy, or of one period, shrink to the pendulum that hangs still. Beyond it there are none.
#[test]
fn branches_end_where_their_orbits_come_to_rest() {
    let pendulum = Pendulum { k: 1.0 };
    let continuation = || {
        Continuation::of(&pendulum)
            .parameter(|pendulum| &mut pendulum.k)
            .range(1.0..0.1)
            .element(Mixed::<5>)
            .elements(40)
            .guess(|t| ([1.2 * (0.9 * t).cos()], [-1.08 * (0.9 * t).sin()]))
    };
    let of_energy = continuation().unknown_period(7.0);
    let of_period = continuation().period(|_| 7.0);
    // H = −k at rest, and T = 2π/√k.
    for (continuation, rest) in [
        (of_energy, 1.2_f64.cos()),
        (of_period, (TAU / 7.0).powi(2)),
    ] {
        let branch = continuation.run().expect("a branch");
        assert_eq!(branch.end(), Some(End::Rest));
        assert!(branch.events().is_empty());
        let last = branch.points().last().expect("points");
        // Ten of the smallest steps, 1e-5 of the amplitude, squared; elements of eighth order.
        close(last.parameter, rest, 1e-9);
        close(last.period, TAU / rest.sqrt(), 1e-8);
        let mut pairs = branch.points().windows(2);
        assert!(pairs.all(|pair| pair[1].amplitudes[0] < pair[0].amplitudes[0]));
    }
}
