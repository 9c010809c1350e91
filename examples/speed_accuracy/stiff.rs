//! Two times in one motion: a pendulum on a stiff spring.

use crate::Outcome;
use crate::runs::Scene;
use tfe::prelude::*;

#[dynamics(
    coordinates(r, theta),
    lagrangian = (dot(r)^2 + r^2*dot(theta)^2)/2 + g*r*cos(theta) - k/2*(r - 1)^2,
)]
struct ElasticPendulum {
    g: f64,
    k: f64,
}

/// The spring swings 160 times a second, the pendulum once in two. The momentum of the spring is the small part of the state, and its
/// phase is what the errors of long steps are of.
pub fn scene() -> Outcome {
    let model = ElasticPendulum { g: 9.81, k: 1e6 };
    let start = model.state([1.0, 1.0], [0.0, 0.0]);
    let problem = WorkPrecision::new(&model, start, 0.0..1.0)
        .steps([0.1, 0.05, 0.02, 0.01, 5e-3, 2e-3, 1e-3]);
    Ok(Scene::measure("Elastic pendulum, k = 10⁶", problem)?)
}
