//! Work–precision diagrams for models of run-time length with constraints.

#[cfg(feature = "sparse")]
use super::measure;
use crate::rods::Rods;
use tfe::RunErrorKind;
use tfe::family::FamilyState;
use tfe::prelude::*;
use tfe::work_precision::WorkPrecisionError;

/// Straight, at an angle, and at rest.
fn hanging(rods: &Rods) -> FamilyState {
    let length = |i: usize| rods.l * (i as f64 + 1.0);
    let x = (0..rods.n).map(|i| length(i) * 0.6);
    let y = (0..rods.n).map(|i| -length(i) * 0.8);
    rods.state(x.chain(y).collect::<Vec<_>>(), vec![0.0; 2 * rods.n])
}

#[cfg(feature = "sparse")]
#[test]
fn constrained_families_have_their_residual() {
    use tfe::StepError;
    use tfe::runtime::ConstraintError;
    let rods = Rods {
        n: 6,
        g: 9.81,
        l: 0.5,
    };
    let start = hanging(&rods);
    let problem = WorkPrecision::new(&rods, start.clone(), 0.0..0.5)
        .element(Mixed::<3>)
        .element(Mixed::<4>)
        .element(Element::radau(3))
        .steps([0.05, 0.025, 0.0125]);
    let measured = measure(problem);
    assert!(measured.reference().uncertainty() < 1e-11);
    let [three, four, radau] = measured.curves() else {
        panic!("{measured:?}");
    };
    for (curve, order) in [(three, 4.0), (four, 6.0)] {
        for (_, one) in curve.measured() {
            // Solved up to rounding; lengths are one half, and velocities below ten.
            assert!(one.constraint_position < 1e-12, "{one:?}");
            assert!(one.constraint_velocity < 1e-12, "{one:?}");
            assert!(one.constraint_position + one.constraint_velocity > 0.0);
            assert!(one.statistics.newton_iterations > 0);
        }
        assert_eq!(curve.failed(), 0);
        let slope = curve.slope().expect("a power");
        assert!((slope.exponent - order).abs() < 0.5, "{slope:?}");
    }
    // This element does not support multipliers.
    assert_eq!(radau.failed(), 3);
    let mut off = start;
    off.q[3] += 1e-3;
    let problem = WorkPrecision::new(&rods, off, 0.0..0.5).element(Mixed::<3>);
    let error = problem.steps([0.05]).run().unwrap_err();
    assert!(
        matches!(
            error,
            WorkPrecisionError::Start(RunErrorKind::Solve {
                source: StepError::Constraint(ConstraintError::Start { .. }),
                ..
            })
        ),
        "{error}"
    );
}

#[cfg(not(feature = "sparse"))]
#[test]
fn constraints_need_the_feature_sparse() {
    let rods = Rods {
        n: 6,
        g: 9.81,
        l: 0.5,
    };
    let problem = WorkPrecision::new(&rods, hanging(&rods), 0.0..0.5).element(Mixed::<3>);
    let error = problem.steps([0.05]).run().unwrap_err();
    let kind = RunErrorKind::Family(tfe::family::ModelError::ConstraintsNotSupported);
    assert_eq!(error, WorkPrecisionError::Start(kind));
}
