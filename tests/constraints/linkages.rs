//! A four-bar linkage with equal cranks that passes through the flat position, where its constraints lose rank. There
//! the parallelogram could fold into its mirror image; only the motion before the position determines that it does not.

use crate::common::{distance, larger};
use crate::models::Pendulum;
use crate::runs::run;
use tfe::prelude::*;
use tfe::runtime::ConstraintError;
use tfe::{RunErrorKind, StepError};

/// Two cranks of length r on the ground at distance d, and a coupler of length d between their tips; angles from the
/// ground.
#[dynamics(
    coordinates(left, coupler, right),
    let x = r*cos(left) + d/2*cos(coupler),
    let y = r*sin(left) + d/2*sin(coupler),
    lagrangian = j/2*(dot(left)^2 + dot(right)^2) + m/2*(dot(x)^2 + dot(y)^2) + jc/2*dot(coupler)^2
        - m*g*y - mc*g*r/2*(sin(left) + sin(right)),
    constraint(loop_x) = r*cos(left) + d*cos(coupler) - r*cos(right) - d,
    constraint(loop_y) = r*sin(left) + d*sin(coupler) - r*sin(right),
)]
#[derive(Clone, Copy)]
pub struct Parallelogram {
    r: f64,
    d: f64,
    m: f64,
    mc: f64,
    j: f64,
    jc: f64,
    g: f64,
}

pub const LINKAGE: Parallelogram = Parallelogram {
    r: 0.5,
    d: 1.2,
    m: 1.0,
    mc: 0.6,
    j: 0.05,
    jc: 0.12,
    g: 9.81,
};

/// As long as it remains a parallelogram, it moves as a pendulum.
pub const ONE_ANGLE: Pendulum = Pendulum {
    inertia: 2.0 * LINKAGE.j + LINKAGE.m * LINKAGE.r * LINKAGE.r,
    weight: (LINKAGE.m + LINKAGE.mc) * LINKAGE.g * LINKAGE.r,
};

pub fn parallel(angle: f64, rate: f64) -> State<3> {
    LINKAGE.state([angle, 0.0, angle], [rate, 0.0, rate])
}

/// The largest difference from the pendulum at nodes.
pub fn error(motion: &Motion<3>, step: f64, angle: f64, rate: f64) -> f64 {
    let end = motion.last().t;
    let exact = run(
        &ONE_ANGLE,
        Mixed::<8>,
        step,
        ONE_ANGLE.state([angle], [rate]),
        end,
    );
    assert_eq!(motion.states().len(), exact.states().len());
    motion
        .states()
        .iter()
        .zip(exact.states())
        .map(|(node, exact)| {
            let angle = exact.q[0];
            distance(&node.q, &[angle, 0.0, angle])
        })
        .fold(0.0, larger)
}

#[test]
fn through_the_flat_position() {
    // Fast enough for full turns: both flat positions are passed, and no node lies in them.
    let (angle, rate) = (0.6, -14.0);
    for (nodes, step) in [(4, 0.002), (5, 0.005), (6, 0.005), (6, 0.0037)] {
        let motion = run(
            &LINKAGE,
            Element::mixed(nodes),
            step,
            parallel(angle, rate),
            100.0 * step,
        );
        let turned = angle - motion.last().q[0];
        assert!(turned > 2.0, "through both: {turned}");
        let error = error(&motion, step, angle, rate);
        assert!(error < 1e-8, "{nodes} nodes, h = {step}: {error:e}");
        assert!(motion.constraint_residual().position < 1e-13);
    }
}

/// Asserts the right motion, or an error that names a constraint and says that the constraints are dependent.
#[track_caller]
fn right_or_refused(element: Element, step: f64, angle: f64, rate: f64) -> Option<Motion<3>> {
    let what = format!("{element}, h = {step}, from {angle:e} at {rate}");
    let result = Simulation::new(&LINKAGE)
        .element(element)
        .step(step)
        .run(parallel(angle, rate), 0.0..100.0 * step);
    match result {
        Ok(motion) => {
            let error = error(&motion, step, angle, rate);
            assert!(error < 1e-8, "{what}: {error:e}");
            Some(motion)
        }
        Err(error) => {
            let source = match error.kind() {
                RunErrorKind::Solve { source, .. } => source,
                _ => panic!("{what}: {error}"),
            };
            assert!(
                matches!(
                    source,
                    StepError::Constraint(ConstraintError::Dependent { .. })
                ),
                "{what}: {error}"
            );
            assert!(error.to_string().contains("`loop_"), "{what}: {error}");
            None
        }
    }
}

/// With a node in the flat position it is undetermined whether the parallelogram folds: an error that says so is right,
/// too.
#[test]
fn starting_flat() {
    for (element, step) in [
        (Element::mixed(4), 0.002),
        (Element::mixed(6), 0.005),
        (Element::primal(5), 0.002),
    ] {
        for rate in [-9.0, 3.0] {
            if let Some(motion) = right_or_refused(element, step, 0.0, rate) {
                assert_eq!(motion.constraint_residual().rank, 1);
            }
            right_or_refused(element, step, std::f64::consts::PI, rate);
        }
    }
}

/// A node very close to the flat position, where the rows are nearly dependent.
#[test]
fn starting_all_but_flat() {
    for angle in [1e-2, 1e-4, 1e-6, 1e-8, 1e-10, 1e-12, 1e-14] {
        for rate in [-9.0, 9.0] {
            let motion = right_or_refused(Element::mixed(5), 0.002, angle, rate);
            // A thousandth of a radian is far enough for all elements.
            assert!(angle < 1e-3 || motion.is_some(), "from {angle}");
        }
    }
}
