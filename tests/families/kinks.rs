//! Models of run-time length whose steps are cut at kinks and jumps of forces.

use super::inputs::assert_alike;
use crate::common::larger;
use tfe::prelude::*;
use tfe::runtime::StepError;
use tfe::{RunErrorKind, Warning};

/// Beads on springs above a soft floor.
#[dynamics(
    coordinates(q[n]),
    lagrangian = sum(i in 0..n, dot(q[i])^2/2 - g*q[i] - k/2*min(q[i], 0)^2) - sum(i in 0..n-1, (q[i+1] - q[i])^2/2),
    event(top) = dot(q[0]),
)]
struct Beads {
    n: usize,
    k: f64,
    g: f64,
}

/// The same four with fixed size.
#[dynamics(
    coordinates(q[4]),
    lagrangian = sum(i in 0..4, dot(q[i])^2/2 - g*q[i] - k/2*min(q[i], 0)^2) - sum(i in 0..3, (q[i+1] - q[i])^2/2),
    event(top) = dot(q[0]),
)]
struct FourBeads {
    k: f64,
    g: f64,
}

/// Driven, with friction that jumps with the direction of motion, and a force during some time.
#[dynamics(
    coordinates(x[n]),
    lagrangian = sum(i in 0..n, dot(x[i])^2/2 - x[i]^2/2) - sum(i in 0..n-1, (x[i+1] - x[i])^4/4),
    force(x[i]) = -c*sign(dot(x[i])) + a*sin(w*t) + select(t < 0.55, 0.3, 0),
)]
struct Rubbing {
    n: usize,
    c: f64,
    a: f64,
    w: f64,
}

#[dynamics(
    coordinates(x[3]),
    lagrangian = sum(i in 0..3, dot(x[i])^2/2 - x[i]^2/2) - sum(i in 0..2, (x[i+1] - x[i])^4/4),
    force(x[i]) = -c*sign(dot(x[i])) + a*sin(w*t) + select(t < 0.55, 0.3, 0),
)]
struct ThreeRubbing {
    c: f64,
    a: f64,
    w: f64,
}

/// A Hamiltonian: magnets on one side.
#[dynamics(
    coordinates(q[n]),
    momenta(p[n]),
    hamiltonian = sum(i in 0..n, p[i]^2/2 + q[i]^2/2 + b*max(q[i], 0)*q[i]) + sum(i in 0..n-1, q[i]^2*q[i+1]^2/2),
)]
struct HalfSprings {
    n: usize,
    b: f64,
}

#[dynamics(
    coordinates(q[3]),
    momenta(p[3]),
    hamiltonian = sum(i in 0..3, p[i]^2/2 + q[i]^2/2 + b*max(q[i], 0)*q[i]) + sum(i in 0..2, q[i]^2*q[i+1]^2/2),
)]
struct ThreeHalfSprings {
    b: f64,
}

/// The motion of a model of run-time length is that of the model of fixed size, with as many crossings. Elements with
/// quadrature points at their ends stop up to 1e-6 of a step before a jump.
macro_rules! assert_same_motion {
    ($long:expr, $fixed:expr, $q:expr, $v:expr, $step:expr, $end:expr, $at_ends:expr) => {{
        let (long, fixed) = (&$long, &$fixed);
        for element in [
            Element::from(Mixed::<4>),
            Mixed::<7>.into(),
            Radau::<3>.into(),
        ] {
            let a = Simulation::new(long).element(element).step($step);
            let a = a.at_kinks(true).run(long.state($q, $v), 0.0..$end);
            let b = Simulation::new(fixed).element(element).step($step);
            let b = b.at_kinks(true).run(fixed.state($q, $v), 0.0..$end);
            let (a, b) = (a.expect("a run"), b.expect("a run"));
            assert!(
                a.statistics().kinks > 3,
                "{element}: {}",
                a.statistics().kinks
            );
            assert_eq!(a.statistics().kinks, b.statistics().kinks, "{element}");
            assert_eq!(a.states().len(), b.states().len());
        }
    }};
}

#[test]
fn kinks_are_those_of_models_of_fixed_size() {
    let (k, g) = (900.0, 9.81);
    let q = [0.5, 0.8, 0.2, 0.4];
    assert_same_motion!(
        Beads { n: 4, k, g },
        FourBeads { k, g },
        q,
        [0.0; 4],
        0.02,
        2.0,
        1e-12
    );
    let (c, a, w) = (0.2, 1.5, 1.3);
    let (long, fixed) = (Rubbing { n: 3, c, a, w }, ThreeRubbing { c, a, w });
    assert_same_motion!(
        long,
        fixed,
        [0.5, 1.0, -0.3],
        [0.2, 0.0, 0.4],
        0.1,
        10.0,
        1e-5
    );
    let (long, fixed) = (HalfSprings { n: 3, b: 4.0 }, ThreeHalfSprings { b: 4.0 });
    assert_same_motion!(
        long,
        fixed,
        [0.5, 1.0, -0.3],
        [0.2, 0.1, 0.4],
        0.1,
        10.0,
        1e-12
    );
}

/// Forty beads fall onto the floor: with cut steps the energy is conserved up to rounding, with steps across kinks it
/// is not.
#[test]
fn elements_keep_their_order_at_every_site() {
    let beads = Beads {
        n: 40,
        k: 400.0,
        g: 9.81,
    };
    let heights: Vec<f64> = (0..40).map(|i| 0.3 + 0.1 * f64::from(i).sin()).collect();
    let start = || beads.state(heights.clone(), vec![0.0; 40]);
    let run = Simulation::new(&beads).element(Mixed::<7>).step(0.02);
    let cut = run.clone().at_kinks(true).run(start(), 0.0..1.0);
    let cut = cut.expect("a run");
    let across = run.run(start(), 0.0..1.0).expect("a run");
    assert!(cut.statistics().kinks >= 80, "{}", cut.statistics().kinks);
    assert_eq!(cut.states().len(), across.states().len());
    let (with, without) = (cut.energy_error(), across.energy_error());
    assert!(with < 1e-13 && without > 1e-9, "{with:e} {without:e}");
    // Between the nodes as well, on both sides of a kink.
    let fine = Simulation::new(&beads).element(Mixed::<7>).step(0.01);
    let fine = fine.at_kinks(true).run(start(), 0.0..1.0).expect("a run");
    for k in 0..100 {
        let t = 0.01 * f64::from(k) + 0.0037;
        let (a, b) = (cut.at(t).expect("within"), fine.at(t).expect("within"));
        assert_alike(&a.q, &b.q, 1e-8);
    }
}

/// A plate that lands almost flat: many sites cross at almost the same time, or shortly after each other.
#[test]
fn many_sites_cross_in_one_step() {
    for (n, apart) in [(60, 0.0), (60, 1e-14), (60, 1e-9), (100, 1e-3)] {
        let (k, g) = (1e-3, 10.0);
        let plate = Beads { n, k, g };
        let heights = (0..n).map(|i| 0.45 + apart * i as f64);
        let start = plate.state(heights.collect::<Vec<_>>(), vec![0.0; n]);
        let run = Simulation::new(&plate).element(Mixed::<4>).step(0.5);
        let motion = run.at_kinks(true).run(start, 0.0..0.5);
        let motion = motion.unwrap_or_else(|error| panic!("{n} {apart:e}: {error}"));
        assert_eq!(motion.statistics().steps, 1);
        let error = motion.energy_error();
        assert!(error < 1e-11, "{n} {apart:e}: {error:e}");
    }
}

/// An accuracy is met across kinks, and the estimate of runs with steps across kinks has a warning.
#[test]
fn accuracies_are_met_across_kinks() {
    let (long, fixed) = (
        Beads {
            n: 4,
            k: 400.0,
            g: 1.0,
        },
        FourBeads { k: 400.0, g: 1.0 },
    );
    let q = [0.5, 0.8, 0.2, 0.4];
    let fine = Simulation::new(&fixed).element(Mixed::<8>).step(0.002);
    let fine = fine.at_kinks(true).run(fixed.state(q, [0.0; 4]), 0.0..5.0);
    let fine = fine.expect("a run");
    let start = || long.state(q, [0.0; 4]);
    for accuracy in [1e-4, 1e-8] {
        let run = Simulation::new(&long).accuracy(accuracy);
        let run = run.run(start(), 0.0..5.0).expect("a run");
        let off = run.last().q.iter().zip(&fine.last().q);
        let off = off.fold(0.0, |off, (a, b)| larger(off, (a - b).abs()));
        assert!(off < accuracy && run.error_estimate() < accuracy, "{off:e}");
        assert!(run.statistics().kinks > 3 && run.warnings().is_empty());
    }
    let across = Simulation::new(&long).step(0.05);
    let across = across.run_estimated(start(), 0.0..5.0).expect("a run");
    assert!(across.warnings().contains(&Warning::KinksCrossed));
    let cut = Simulation::new(&long).step(0.05).at_kinks(true);
    let cut = cut.run_estimated(start(), 0.0..5.0).expect("a run");
    assert!(!cut.warnings().contains(&Warning::KinksCrossed));
}

/// Events, checkpoints, ensembles and steps, compared with those of the model of fixed size.
#[test]
fn whatever_steps_is_cut() {
    let (long, fixed) = (
        Beads {
            n: 4,
            k: 900.0,
            g: 9.81,
        },
        FourBeads { k: 900.0, g: 9.81 },
    );
    let q = [0.5, 0.8, 0.2, 0.4];
    let start = || long.state(q, [0.0; 4]);
    let run = Simulation::new(&long).element(Mixed::<7>).step(0.02);
    let run = run.at_kinks(true);
    let whole = run.run(start(), 0.0..2.0).expect("a run");
    let half = run.run(start(), 0.0..1.0).expect("a run");
    let rest = run.resume(half.checkpoint().expect("one"), 2.0);
    assert_eq!(rest.expect("a run").last(), whole.last());
    let node = run.steps(start(), 0.0).nth(99).expect("a step");
    assert_alike(&node.expect("a step").q, &whole.last().q, 1e-12);
    let ends = Ensemble::new(&long).element(Mixed::<7>).step(0.02);
    let ends = ends.at_kinks(true).run(&[start(), start()], 0.0..2.0);
    for end in ends.expect("runs").nodes() {
        assert_alike(&end.q, &whole.last().q, 1e-12);
    }
    let watched = run.on("top", Crossing::Falling, |_| Act::Record);
    let watched = watched.run(start(), 0.0..2.0).expect("a run");
    let other = Simulation::new(&fixed).element(Mixed::<7>).step(0.02);
    let other = other
        .at_kinks(true)
        .on("top", Crossing::Falling, |_| Act::Record);
    let other = other.run(fixed.state(q, [0.0; 4]), 0.0..2.0);
    let other = other.expect("a run");
    let a: Vec<f64> = watched.events().iter().map(|event| event.t).collect();
    let b: Vec<f64> = other.events().iter().map(|event| event.t).collect();
    assert!(!a.is_empty());
    assert_alike(&a, &b, 1e-10);
}

/// A motion that would slide along a jump is an error, as for models of fixed size.
#[test]
fn sliding_is_told() {
    let (c, a, w) = (2.0, 0.1, 1.0);
    let stuck = Rubbing { n: 2, c, a, w };
    let run = Simulation::new(&stuck).step(0.05).at_kinks(true);
    let error = run.run(stuck.state([0.5, 0.1], [0.4, 0.1]), 0.0..5.0);
    let error = error.expect_err("it comes to rest");
    let kind = error.kind();
    assert!(
        matches!(
            kind,
            RunErrorKind::Solve {
                source: StepError::Slides,
                ..
            }
        ),
        "{kind}"
    );
    assert!(error.partial().last().t > 0.0);
    // For a model without kinks the option has no effect, and states of another length are errors.
    let run = Simulation::new(&stuck).step(0.05).at_kinks(true);
    let wrong = Beads {
        n: 3,
        k: 1.0,
        g: 1.0,
    };
    let short = run.run(wrong.state([0.0; 3], [0.0; 3]), 0.0..1.0);
    assert!(matches!(
        short.expect_err("too long").kind(),
        RunErrorKind::Family(_)
    ));
}

/// With coupled masses and with constraints; derivatives across kinks are refused.
#[cfg(feature = "sparse")]
mod sparse {
    use super::{Beads, assert_alike};
    use tfe::RunErrorKind;
    use tfe::prelude::*;
    use tfe::sensitivity::Loss;

    /// Pendulums that swing against a soft wall.
    #[dynamics(
        coordinates(x[n], y[n]),
        lagrangian = sum(i in 0..n, (dot(x[i])^2 + dot(y[i])^2)/2 - 9.81*y[i] - k/2*max(x[i] - 0.3, 0)^2),
        constraint(first) = x[0]^2 + y[0]^2 - 1,
        constraint(rod[i in 0..n-1]) = (x[i+1] - x[i])^2 + (y[i+1] - y[i])^2 - 1,
    )]
    struct Walled {
        n: usize,
        k: f64,
    }

    #[dynamics(
        coordinates(x[2], y[2]),
        lagrangian = sum(i in 0..2, (dot(x[i])^2 + dot(y[i])^2)/2 - 9.81*y[i] - k/2*max(x[i] - 0.3, 0)^2),
        constraint(first) = x[0]^2 + y[0]^2 - 1,
        constraint(rod) = (x[1] - x[0])^2 + (y[1] - y[0])^2 - 1,
    )]
    struct TwoWalled {
        k: f64,
    }

    /// Masses coupled by the mass matrix.
    #[dynamics(
        coordinates(q[n]),
        lagrangian = sum(i in 0..n, dot(q[i])^2/2 - g*q[i] - k/2*min(q[i], 0)^2) + sum(i in 0..n-1, b*dot(q[i])*dot(q[i+1])*cos(q[i])),
    )]
    struct Coupled {
        n: usize,
        k: f64,
        g: f64,
        b: f64,
    }

    #[dynamics(
        coordinates(q[3]),
        lagrangian = sum(i in 0..3, dot(q[i])^2/2 - g*q[i] - k/2*min(q[i], 0)^2) + sum(i in 0..2, b*dot(q[i])*dot(q[i+1])*cos(q[i])),
    )]
    struct ThreeCoupled {
        k: f64,
        g: f64,
        b: f64,
    }

    #[test]
    fn kinks_with_constraints_and_coupled_masses() {
        let (k, g, b) = (900.0, 9.81, 0.3);
        let (long, fixed) = (Coupled { n: 3, k, g, b }, ThreeCoupled { k, g, b });
        let (q, v) = ([0.5, 0.3, 0.2], [0.0; 3]);
        assert_same_motion!(long, fixed, q, v, 0.02, 1.0, 1e-11);
        let (long, fixed) = (Walled { n: 2, k: 400.0 }, TwoWalled { k: 400.0 });
        let (q, v) = ([-1.0, -1.0, 0.0, -1.0], [0.0; 4]);
        let a = Simulation::new(&long).step(0.02).at_kinks(true);
        let a = a.run(long.state(q, v), 0.0..2.0).expect("a run");
        let b = Simulation::new(&fixed).step(0.02).at_kinks(true);
        let b = b.run(fixed.state(q, v), 0.0..2.0).expect("a run");
        assert!(a.statistics().kinks > 1);
        assert_eq!(a.statistics().kinks, b.statistics().kinks);
        assert_alike(&a.last().q, &b.last().q, 1e-8);
        assert!(a.constraint_residual().position < 1e-13);
    }

    #[test]
    fn derivatives_across_kinks_are_refused() {
        let beads = Beads {
            n: 3,
            k: 900.0,
            g: 9.81,
        };
        let start = || beads.state([0.5, 0.3, 0.2], [0.0; 3]);
        let run = Simulation::new(&beads).step(0.02).at_kinks(true);
        let refused = |kind: &RunErrorKind| {
            assert!(matches!(kind, RunErrorKind::Unsupported { .. }), "{kind}");
        };
        let error = run.run_linearised(start(), 0.0..1.0);
        refused(error.expect_err("kinks").kind());
        let error = run.run_sensitive(start(), 0.0..1.0);
        refused(error.expect_err("kinks").kind());
        let loss = Loss::of_end(|q, _, _| q[0]);
        let error = run.gradient(start(), 0.0..1.0, &loss);
        refused(error.expect_err("kinks").kind());
        // Before the first kink there is nothing to refuse.
        run.run_linearised(start(), 0.0..0.1).expect("a run");
        run.gradient(start(), 0.0..0.1, &loss).expect("a gradient");
        // Where steps are not cut, the change of the time of a jump is missing: this is told.
        let across = Simulation::new(&beads).step(0.02);
        let across = across
            .run_sensitive(start(), 0.0..1.0)
            .expect("derivatives");
        assert!(
            across
                .motion()
                .warnings()
                .contains(&tfe::Warning::KinksCrossed)
        );
    }
}
