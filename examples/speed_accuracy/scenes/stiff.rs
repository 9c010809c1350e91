//! Two time scales in one motion: a pendulum on a stiff spring.

use super::{Start, steps};
use tfe::prelude::*;

#[dynamics(
    coordinates(r, theta),
    lagrangian = (dot(r)^2 + r^2*dot(theta)^2)/2 + g*r*cos(theta) - k/2*(r - 1)^2,
)]
pub struct ElasticPendulum {
    pub g: f64,
    pub k: f64,
}

pub const ELASTIC: ElasticPendulum = ElasticPendulum { g: 9.81, k: 1e6 };

pub const ELASTIC_START: Start<2> = Start {
    q: [1.0, 1.0],
    v: [0.0, 0.0],
    end: 1.0,
};

/// The spring oscillates 160 times per unit of time, the pendulum once in two. The momentum of the spring is only a
/// small part of the state, but with long steps its phase dominates the error.
pub fn elastic_pendulum() -> WorkPrecision<'static, ElasticPendulum, State<2>> {
    let Start { q, v, end } = ELASTIC_START;
    WorkPrecision::new(&ELASTIC, ELASTIC.state(q, v), 0.0..end).steps(steps(end, 10, 1000))
}
