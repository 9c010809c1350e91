//! Valid and invalid initial states: errors that name the constraint, and projections.

use crate::models::{BeadRates, KnifeEdge, MovingWire, QuaternionTop, RodPendulum};
use tfe::RunErrorKind;
use tfe::prelude::*;

/// The error of a run that cannot start, as text.
#[track_caller]
fn inconsistent<M: Model<N>, const N: usize>(model: &M, start: State<N>) -> String {
    let error = Simulation::new(model)
        .step(0.01)
        .run(start, 0.0..1.0)
        .expect_err("the start violates a constraint");
    assert!(
        matches!(error.kind(), RunErrorKind::Inconsistent { .. }),
        "{error:?}"
    );
    assert_eq!(error.partial().states().len(), 1);
    error.to_string()
}

/// The numbers in a text.
fn numbers_in(text: &str) -> Vec<f64> {
    text.split(|c: char| c.is_whitespace() || "`,;()=|".contains(c))
        .filter_map(|word| word.trim_end_matches('.').parse().ok())
        .collect()
}

#[track_caller]
fn assert_says(text: &str, name: &str, residual: f64) {
    assert!(text.contains(name), "`{name}` is missing in: {text}");
    assert!(
        numbers_in(text)
            .iter()
            .any(|number| (number.abs() / residual - 1.0).abs() < 0.06),
        "{residual:e} is missing in: {text}"
    );
}

#[test]
fn starts_off_the_constraints_are_refused_by_name() {
    let rod = RodPendulum::UNIT;
    // φ = ½ (1.1² − 1)
    let text = inconsistent(&rod, rod.state([1.1, 0.0], [0.0, 0.3]));
    assert_says(&text, "rod", 0.105);
    // A v = x vx
    let text = inconsistent(&rod, rod.state([1.0, 0.0], [0.25, 0.3]));
    assert_says(&text, "rod", 0.25);
    let blade = KnifeEdge::TABLE;
    let text = inconsistent(&blade, blade.state([0.0; 3], [1.0, 0.5, 0.0]));
    assert_says(&text, "blade", 0.5);
    // With a constraint on velocities all positions are valid, and only velocities can be wrong.
    let bead = BeadRates { g: 9.81 };
    let off = bead.state([1.0, 3.0], [1.0, 1.0]);
    assert!(Simulation::new(&bead).step(0.01).run(off, 0.0..0.1).is_ok());
    let text = inconsistent(&bead, bead.state([1.0, 3.0], [1.0, 0.0]));
    assert_says(&text, "wire", 1.0);
}

#[test]
fn round_off_is_not_a_violation() {
    let rod = RodPendulum {
        m: 1.0,
        l: 1.7,
        g: 9.81,
    };
    for k in 0..100 {
        let angle = 0.0628 * f64::from(k);
        let (x, y) = (1.7 * angle.cos(), 1.7 * angle.sin());
        let start = rod.state([x, y], [-2.0 * y, 2.0 * x]);
        let motion = Simulation::new(&rod).step(0.01).run(start, 0.0..0.05);
        assert!(motion.is_ok(), "angle {angle}: {:?}", motion.err());
    }
}

/// A run may be continued from any of its states. The kinetic energy of the quaternion is singular in the direction
/// across the sphere: the rounding error of the pivot there must not be taken for a mass.
#[test]
fn states_of_a_motion_are_starts() {
    let top = QuaternionTop::TABLE;
    let simulation = Simulation::new(&top).element(Mixed::<3>).step(0.02);
    let motion = simulation.run(top.tilted(), 0.0..40.0).expect("the top");
    for node in motion.states() {
        let further = simulation.run(node.state(), node.t..node.t + 0.02);
        assert!(further.is_ok(), "t = {}: {:?}", node.t, further.err());
    }
}

#[test]
fn projections_go_the_shortest_way() {
    let rod = RodPendulum {
        m: 0.7,
        l: 1.3,
        g: 9.81,
    };
    let (q, v) = ([1.1, 0.9], [0.4, 1.5]);
    let found = rod.consistent_state(q, v).expect("a circle is near");
    let length = q[0].hypot(q[1]);
    let unit = [q[0] / length, q[1] / length];
    let across = v[0] * unit[0] + v[1] * unit[1];
    for i in 0..2 {
        let expected = 0.7 * (v[i] - across * unit[i]);
        assert!((found.state.q[i] - 1.3 * unit[i]).abs() < 1e-12);
        assert!((found.state.p[i] - expected).abs() < 1e-12);
    }
    assert!((found.position - (length - 1.3).abs()).abs() < 1e-12);
    assert!((found.velocity - across.abs()).abs() < 1e-12);
    assert_eq!(found.rank, 1);
    // What is valid remains unchanged.
    let v = found.state.p.map(|p| p / 0.7);
    let again = rod.consistent_state(found.state.q, v).expect("it is");
    assert!(again.position < 1e-15 && again.velocity < 1e-15);
    let exact = rod.consistent_state([1.3, 0.0], [0.0, 2.0]).expect("it is");
    assert_eq!((exact.position, exact.velocity), (0.0, 0.0));
    assert_eq!(exact.state, rod.state([1.3, 0.0], [0.0, 2.0]));
    assert!(
        Simulation::new(&rod)
            .step(0.01)
            .run(found.state, 0.0..1.0)
            .is_ok()
    );
}

#[test]
fn projections_at_a_time_and_of_rates() {
    let wire = MovingWire { g: 2.0, c: 0.0 };
    let t = 0.7_f64;
    let found = wire
        .consistent_state_at(t, [1.0, 0.4], [0.5, 0.5])
        .expect("the wire is near");
    let [x, y] = found.state.q;
    let stretch = 1.0 + t.sin() / 5.0;
    assert!((y - x.powi(4) / 4.0 * stretch).abs() < 1e-13);
    let rate = x.powi(3) * stretch * found.state.p[0] + x.powi(4) / 20.0 * t.cos();
    assert!((found.state.p[1] - rate).abs() < 1e-13);
    assert!(found.position > 0.0 && found.position < 0.5);
    let run = Simulation::new(&wire).step(0.01).run(found.state, t..2.0);
    assert!(run.is_ok(), "{:?}", run.err());
    // A constraint on velocities does not change positions.
    let blade = KnifeEdge::TABLE;
    let found = blade
        .consistent_state([1.0, 2.0, 0.0], [3.0, 0.5, 0.2])
        .expect("a blade can always stop");
    assert_eq!(found.state.q, [1.0, 2.0, 0.0]);
    assert!((found.velocity - 0.5).abs() < 1e-14 && found.position == 0.0);
    assert!((found.state.p[0] - 3.0).abs() < 1e-14 && found.state.p[1].abs() < 1e-14);
}

/// A rod beside a coordinate that is far away.
#[dynamics(
    coordinates(x, y, z),
    lagrangian = (dot(x)^2 + dot(y)^2 + dot(z)^2)/2 - g*y,
    constraint(rod) = x^2 + y^2 - 1,
)]
struct RodBeside {
    g: f64,
}

/// A stepper without a run checks its start itself: beside 1e9 a rod that was too long by a tenth was accepted, and one
/// whose length changed.
#[test]
fn steppers_check_their_starts_in_mixed_units() {
    use tfe::StepError;
    use tfe::runtime::ConstraintError;
    use tfe::runtime::step::{Control, Stepper};
    let model = RodBeside { g: 9.81 };
    let step = |q: [f64; 3], v: [f64; 3]| {
        let stepper = Stepper::new(&model, Mixed::<4>.into(), Control::default());
        let mut state = model.state(q, v);
        let mut stepper = stepper.expect("an element");
        stepper.advance(0.0, 0.01, &mut state, &[])
    };
    for far in [0.0, 1e9, 1.5e11] {
        let long = ([1.1, 0.0, far], [0.0; 3]);
        let growing = ([1.0, 0.0, far], [1e-3, 0.5, 0.0]);
        for ((q, v), of_position) in [(long, true), (growing, false)] {
            let error = step(q, v).expect_err("a start beside the constraint");
            let StepError::Constraint(ConstraintError::Start {
                constraint,
                position,
                ..
            }) = error
            else {
                panic!("{far:e}: {error}");
            };
            assert!(constraint.is("rod"), "{far:e}: {error}");
            assert_eq!(position, of_position, "{far:e}: {error}");
        }
        let good = step([1.0, 0.0, far], [0.0, 0.5, 0.0]);
        assert_eq!(good, Ok(()), "{far:e}");
    }
}

/// On the unit circle and at x = 2: no solution.
#[dynamics(
    coordinates(x, y),
    lagrangian = (dot(x)^2 + dot(y)^2)/2,
    constraint(circle) = x^2 + y^2 - 1,
    constraint(line) = x - 2,
)]
struct Nowhere {}

#[test]
fn constraints_that_contradict_each_other() {
    let nowhere = Nowhere {};
    let error = nowhere
        .consistent_state([1.5, 0.1], [0.0; 2])
        .expect_err("there is no such place");
    let text = error.to_string();
    assert!(
        text.contains("circle") || text.contains("line"),
        "which constraints: {text}"
    );
    let text = inconsistent(&nowhere, nowhere.state([1.0, 0.0], [0.0; 2]));
    assert_says(&text, "line", 1.0);
    assert!(!text.contains("circle"), "the circle holds: {text}");
}

#[test]
fn starts_that_are_no_numbers() {
    let rod = RodPendulum::UNIT;
    assert!(rod.consistent_state([f64::NAN, 0.0], [0.0; 2]).is_err());
    assert!(
        rod.consistent_state([1.0, 0.0], [f64::INFINITY, 0.0])
            .is_err()
    );
    let start = State {
        q: [1.0, 0.0],
        p: [f64::NAN, 0.0],
    };
    let error = Simulation::new(&rod)
        .step(0.01)
        .run(start, 0.0..1.0)
        .expect_err("no number");
    assert!(
        matches!(error.kind(), RunErrorKind::Start { .. }),
        "{error}"
    );
    // At the centre of the circle, all directions are equally near.
    assert!(rod.consistent_state([0.0, 0.0], [0.0; 2]).is_err());
}
