//! Loose tolerances and accuracies: iteration errors are small compared with them, and constraints hold.

use crate::common::larger;
use crate::models::{KnifeEdge, RodPendulum, SliderCrank};
use crate::moves::{Moves, Shown, show};
use crate::redundant::ThreeRows;
use tfe::prelude::*;

#[dynamics(
    coordinates(x[2], y[2]),
    lagrangian = (inner(dot(x), dot(x)) + inner(dot(y), dot(y)))/2 - g*(y[0] + y[1]),
    constraint(upper) = x[0]^2 + y[0]^2 - 1,
    constraint(lower) = (x[1] - x[0])^2 + (y[1] - y[0])^2 - 1,
)]
struct TwoRods {
    g: f64,
}

#[dynamics(coordinates(x, y), lagrangian = (dot(x)^2 + dot(y)^2)/2 - g*y, constraint(rod) = x^2 + y^2 - (1 + sin(t)/10)^2)]
struct Pulled {
    g: f64,
}

/// Six mechanisms.
fn each(shown: &impl Shown) {
    let g = 9.81;
    let model = RodPendulum::UNIT;
    show(shown, "rod", (&model, model.horizontal()), END);
    let model = TwoRods { g };
    let start = model.state([1.0, 1.0, 0.0, -1.0], [0.0, 0.5, 0.0, 0.0]);
    show(shown, "two rods", (&model, start), END);
    let (j, k, m) = (0.3, 0.7, 1.0);
    let model = SliderCrank { j, k, m, g };
    let start = model.turning(0.5, 4.0);
    show(shown, "slider-crank", (&model, start), END);
    let model = KnifeEdge {
        alpha: std::f64::consts::FRAC_PI_2,
        ..KnifeEdge::TABLE
    };
    show(shown, "knife", (&model, model.turning(1.3)), END);
    let model = ThreeRows { j: 0.1, g };
    let start = model.state([0.0, 1.0, std::f64::consts::FRAC_PI_2], [-1.0, 0.0, 1.0]);
    show(shown, "three rows", (&model, start), END);
    let model = Pulled { g };
    show(
        shown,
        "pulled",
        (&model, model.state([1.0, 0.0], [0.1, 0.0])),
        END,
    );
}

const END: f64 = 4.0;

/// The largest error at the end, relative to the largest number there.
fn off<const N: usize>(motion: &Motion<N>, exact: &Motion<N>) -> f64 {
    let (a, b) = (motion.last(), exact.last());
    let (mut off, mut scale) = (0.0_f64, 0.0_f64);
    for k in 0..N {
        off = larger(off, (a.q[k] - b.q[k]).abs());
        off = larger(off, (a.p[k] - b.p[k]).abs());
        scale = scale.max(b.q[k].abs()).max(b.p[k].abs());
    }
    off / scale
}

/// The same in the sense of accuracies: coordinates relative to the largest coordinate of the motion, momenta relative
/// to the largest momentum.
fn off_by_kind<const N: usize>(motion: &Motion<N>, exact: &Motion<N>) -> f64 {
    let of = |part: fn(&tfe::Node<N>) -> &[f64; N]| {
        let (a, b) = (part(motion.last()), part(exact.last()));
        let off = a
            .iter()
            .zip(b)
            .fold(0.0, |off, (a, b)| larger(off, (a - b).abs()));
        let all = motion.states().iter().flat_map(part);
        off / all.fold(0.0, |size, x| larger(size, x.abs()))
    };
    larger(of(|node| &node.q), of(|node| &node.p))
}

fn exact<const N: usize>(mechanism: &dyn Moves<N>) -> Motion<N> {
    let run = mechanism.run(Element::mixed(8), 0.01, END);
    run.expect("a run")
}

/// Loose tolerances used to end with the error "the constraints are dependent", which was false.
#[test]
fn loose_tolerances_are_no_contradictions() {
    struct Tolerances;
    impl Shown for Tolerances {
        fn of<const N: usize>(&self, name: &str, mechanism: &dyn Moves<N>, _: f64) {
            let exact = exact(mechanism);
            for nodes in [3, 4, 6] {
                let element = Element::mixed(nodes);
                let tight = mechanism.run(element, 0.02, END).expect("a run");
                for tolerance in [1e-1, 1e-2, 1e-3, 1e-4, 1e-6, 1e-8] {
                    let loose = mechanism.run_within(tolerance, (element, 0.02), END);
                    let what = format!("{name}, {nodes} nodes, {tolerance:e}");
                    let loose = loose.unwrap_or_else(|error| panic!("{what}: {error}"));
                    let (off, best) = (off(&loose, &exact), off(&tight, &exact));
                    assert!(off < 2.0 * best + 1e-6, "{what}: {off:e}, {best:e}");
                    assert!(
                        loose.warnings().is_empty(),
                        "{what}: {:?}",
                        loose.warnings()
                    );
                }
            }
        }
    }
    each(&Tolerances);
}

#[test]
fn accuracies_are_met_with_constraints() {
    struct Accuracies;
    impl Shown for Accuracies {
        fn of<const N: usize>(&self, name: &str, mechanism: &dyn Moves<N>, _: f64) {
            let exact = exact(mechanism);
            for accuracy in [1e-2, 1e-3, 1e-4, 1e-6, 1e-8, 1e-10] {
                let motion = mechanism.run_accurately(accuracy, END);
                let what = format!("{name}, {accuracy:e}");
                let motion = motion.unwrap_or_else(|error| panic!("{what}: {error}"));
                let off = off_by_kind(&motion, &exact);
                assert!(off < accuracy, "{what}: {off:e}");
                let estimate = motion.error_estimate();
                // The accuracy of the reference.
                assert!(
                    off < 2.0 * estimate + 1e-14,
                    "{what}: {off:e}, {estimate:e}"
                );
                // Thousands of steps were taken for 1e-2, since longer ones ended with errors.
                let steps = motion.statistics().steps;
                assert!(steps < 500, "{what}: {steps}");
            }
        }
    }
    each(&Accuracies);
}
