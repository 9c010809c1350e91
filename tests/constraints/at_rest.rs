//! Locked mechanisms.

use crate::common::larger;
use tfe::constraints::tangent_basis;
use tfe::prelude::*;

fn worst(errors: impl IntoIterator<Item = f64>) -> f64 {
    errors.into_iter().fold(0.0, larger)
}

/// Three wheels in a ring, of which none can turn; a torque on the first.
#[dynamics(
    coordinates(a, b, c),
    lagrangian = (dot(a)^2 + 2*dot(b)^2 + 3*dot(c)^2)/2,
    constraint(ab) = a + 2*b,
    constraint(bc) = 2*b + 0.5*c,
    constraint(ca) = 0.5*c + a,
    force(a) = 3,
)]
struct Ring;

/// Starts of which the constraints leave nothing but zeros.
#[test]
fn locked_mechanisms_have_a_consistent_start() {
    for (q, v) in [
        ([0.0; 3], [0.3, 0.2, 0.1]),
        ([0.0; 3], [1.0, 0.0, 0.0]),
        ([1.0, -0.5, -2.0], [0.0; 3]),
        ([1.0, 0.3, -2.0], [0.3, 0.2, 0.1]),
    ] {
        let start = Ring.consistent_state(q, v).expect("the origin at rest");
        let numbers = start.state.q.iter().chain(&start.velocities);
        assert!(worst(numbers.map(|number| number.abs())) <= 1e-15);
        assert_eq!(start.rank, 3);
        let basis = tangent_basis(&Ring, 0.0, &start.state).expect("a basis");
        assert_eq!(basis.shape(), (6, 0));
    }
}
