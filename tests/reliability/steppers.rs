//! What steppers store for a step, and what they refuse.

use super::models::Rod;
use super::*;
use tfe::runtime::step::Impulse;

/// The result of a step does not depend on whether its inside is stored, also where steps are cut and where impulses
/// act: states, polynomials of all pieces and matrices have the same bits.
#[test]
fn the_inside_of_a_step_is_of_the_root_that_was_found() {
    let mut cuts = 0;
    for (start, h) in starts()
        .into_iter()
        .flat_map(|one| [(one, 0.2), (one, 0.5)])
    {
        let control = Control::default();
        let mut kept = Stepper::new(&PENDULUM, Mixed::<4>.into(), control).expect("a stepper");
        let mut left_out = kept.clone().ends_only();
        let (mut one, mut other) = (start, start);
        for step in 0..8 {
            let t = h * f64::from(step);
            let kick = [Impulse {
                time: t + 0.3 * h,
                value: [0.1, -0.2],
            }];
            let impulses: &[_] = if step % 3 == 2 { &kick } else { &[] };
            let done = kept.advance(t, h, &mut one, impulses).is_ok();
            let again = left_out.advance(t, h, &mut other, impulses).is_ok();
            assert_eq!((done, one), (again, other), "step {step} from {start:?}");
            if !done {
                break;
            }
            let inside = left_out.dense(t, t + h);
            assert_eq!(inside, kept.dense(t, t + h), "step {step} from {start:?}");
            if step % 2 == 1 {
                let (mut matrix, mut expected) = ([0.0; 16], [0.0; 16]);
                left_out.transition(&mut matrix).expect("a matrix");
                kept.transition(&mut expected).expect("a matrix");
                assert_eq!(matrix, expected, "step {step} from {start:?}");
            }
        }
        cuts += left_out.statistics().cuts;
    }
    assert!(cuts > 10, "{cuts} cuts");
}

/// A step that fails because of an invalid state says nothing about kinks of the model.
#[test]
fn kinks_are_looked_for_after_a_failure() {
    #[dynamics(coordinates(x), lagrangian = dot(x)^2/2 - g*abs(x))]
    struct Roof {
        g: f64,
    }
    let roof = Roof { g: 1.0 };
    let stepper = Stepper::new(&roof, Mixed::<4>.into(), Control::default());
    let mut stepper = stepper.expect("a stepper").at_kinks();
    let mut nowhere = State {
        q: [1.0],
        p: [f64::NAN],
    };
    let failed = stepper.advance(0.0, 0.1, &mut nowhere, &[]);
    failed.expect_err("no state");
    let mut state = roof.state([1.0], [0.0]);
    for step in 0..20 {
        let t = 0.1 * f64::from(step);
        stepper.advance(t, 0.1, &mut state, &[]).expect("a step");
    }
    assert_eq!(stepper.statistics().kinks, 1);
    // Down to the ridge at √2, and on against the other side.
    let behind = 2.0 - 2.0_f64.sqrt();
    let exact = behind * behind / 2.0 - 2.0_f64.sqrt() * behind;
    assert!((state.q[0] - exact).abs() < 1e-12, "{}", state.q[0]);
}

/// Constraint gradients whose squares overflow or underflow: such a constraint was silently ignored. It must hold, or
/// the run must say why it does not.
#[test]
fn constraints_of_any_size_count() {
    use tfe::runtime::constrained;
    let scaled = |s: f64| {
        let (g, l) = (9.81, 1.0);
        Rod { g, l, s }
    };
    let run = |model: &Rod| {
        let run = Simulation::new(model).element(Mixed::<4>).step(0.01);
        let motion = run.run(model.state([1.0, 0.0], [0.0, 0.0]), 0.0..1.0);
        motion.map(|motion| motion.last().state())
    };
    let residual = |model: &Rod| {
        let residuals = constrained::residuals(model, 0.0, &[0.6, 0.9], &[0.0, 0.3], 1.0);
        [
            residuals[0].relative_position,
            residuals[0].relative_velocity,
        ]
    };
    let one = scaled(1.0);
    let (wanted, off) = (run(&one).expect("a run"), residual(&one));
    assert!(off[0] > 0.05 && off[1] > 0.05, "{off:?}");
    for s in [1e-200, 1e-100, 1e100, 1e200] {
        let model = scaled(s);
        assert_eq!(
            constrained::independent(&model, 0.0, &[0.6, 0.8]),
            [true],
            "{s}"
        );
        for (found, expected) in residual(&model).into_iter().zip(off) {
            let error = (found - expected).abs();
            assert!(error < 1e-14, "{s}: {found} for {expected}");
        }
        let Ok(end) = run(&model) else {
            // Small gradients may be lost in the equations, where their squares are added to masses.
            assert!(s < 1.0, "{s}");
            continue;
        };
        for a in 0..2 {
            assert!((end.q[a] - wanted.q[a]).abs() < 1e-9, "{s}: {end:?}");
            assert!((end.p[a] - wanted.p[a]).abs() < 1e-9, "{s}: {end:?}");
        }
    }
}

/// A momentum that belongs to no velocity is refused as an initial state, even if constraints determine one.
#[test]
fn momenta_without_a_velocity_are_refused() {
    #[dynamics(
        coordinates(x, y),
        lagrangian = sqrt(1 + dot(x)^2) + sqrt(1 + dot(y)^2),
        constraint(line) = y - x/2
    )]
    struct Bounded;
    let stepper = Stepper::new(&Bounded, Mixed::<4>.into(), Control::default());
    let mut stepper = stepper.expect("a stepper");
    // |∂L/∂v| is less than one.
    let start = State {
        q: [0.0, 0.0],
        p: [0.2, 1.5],
    };
    let mut state = start;
    let failed = stepper.advance(0.0, 0.1, &mut state, &[]);
    failed.expect_err("no velocity");
    assert_eq!(state, start);
    let mut state = Bounded.state([0.0, 0.0], [0.8, 0.4]);
    stepper.advance(0.0, 0.1, &mut state, &[]).expect("a step");
    assert!((state.q[0] - 0.08).abs() < 1e-12 && (state.q[1] - 0.04).abs() < 1e-12);
}

/// Derivatives by parameters that a model does not have used to be zeros.
#[test]
fn derivatives_by_nothing_are_refused() {
    use tfe::runtime::transition::TransitionError;
    use tfe::runtime::{ConstraintError, Direction, Parameter, StepError};
    let model = Anharmonic { m: 1.0 };
    let stepper = Stepper::new(&model, Mixed::<4>.into(), Control::default());
    let mut stepper = stepper.expect("a stepper");
    let mut state = model.state([1.0], [0.3]);
    stepper.advance(0.0, 0.1, &mut state, &[]).expect("a step");
    let mut outcomes = |parameter: Parameter| {
        let direction = Direction {
            parameter: Some(parameter),
            ..Direction::default()
        };
        let forwards = stepper.linearise(&[direction], &mut [0.0; 6]);
        let backwards = stepper.adjoint(&[direction], &mut [1.0, 0.0], &mut [0.0]);
        [forwards, backwards]
    };
    let refused = TransitionError::Step(StepError::Constraint(ConstraintError::Parameter));
    assert_eq!(outcomes(Parameter::Any(0)), [Ok(()); 2]);
    assert_eq!(outcomes(Parameter::Any(1)), [Err(refused); 2]);
    assert_eq!(outcomes(Parameter::Named(1)), [Err(refused); 2]);
}
