//! Loose tolerances and accuracies: iteration errors are small compared with them, and constraints hold.

use crate::common::larger;
use crate::moves::{Moves, Shown, show};
use tfe::prelude::*;

#[dynamics(coordinates(x, y), lagrangian = (dot(x)^2 + dot(y)^2)/2 - g*y, constraint(rod) = x^2 + y^2 - 1)]
struct Rod {
    g: f64,
}

#[dynamics(
    coordinates(x[2], y[2]),
    lagrangian = (inner(dot(x), dot(x)) + inner(dot(y), dot(y)))/2 - g*(y[0] + y[1]),
    constraint(upper) = x[0]^2 + y[0]^2 - 1,
    constraint(lower) = (x[1] - x[0])^2 + (y[1] - y[0])^2 - 1,
)]
struct TwoRods {
    g: f64,
}

#[dynamics(
    coordinates(a, b, x),
    lagrangian = (0.3*dot(a)^2 + 0.7*dot(b)^2 + dot(x)^2)/2 - g*sin(a),
    constraint(cx) = cos(a) + 2*cos(b) - x,
    constraint(cy) = sin(a) - 2*sin(b),
)]
struct SliderCrank {
    g: f64,
}

#[dynamics(
    coordinates(x, y, phi),
    lagrangian = (dot(x)^2 + dot(y)^2 + dot(phi)^2)/2 + g*x,
    constraint(blade) = dot(x)*sin(phi) - dot(y)*cos(phi),
)]
struct Knife {
    g: f64,
}

#[dynamics(
    coordinates(x, y, a),
    lagrangian = (dot(x)^2 + dot(y)^2)/2 + dot(a)^2/20 - g*y,
    constraint(cx) = x - cos(a),
    constraint(cy) = y - sin(a),
    constraint(circle) = x^2 + y^2 - 1,
)]
struct Redundant {
    g: f64,
}

#[dynamics(coordinates(x, y), lagrangian = (dot(x)^2 + dot(y)^2)/2 - g*y, constraint(rod) = x^2 + y^2 - (1 + sin(t)/10)^2)]
struct Pulled {
    g: f64,
}

/// Six mechanisms.
fn each(shown: &impl Shown) {
    let g = 9.81;
    let model = Rod { g };
    show(
        shown,
        "rod",
        (&model, model.state([1.0, 0.0], [0.0; 2])),
        END,
    );
    let model = TwoRods { g };
    let start = model.state([1.0, 1.0, 0.0, -1.0], [0.0, 0.5, 0.0, 0.0]);
    show(shown, "two rods", (&model, start), END);
    let model = SliderCrank { g };
    let (a, w) = (0.5_f64, 4.0);
    let b = (0.5 * a.sin()).asin();
    let rate = 0.5 * a.cos() * w / b.cos();
    let start = model.state(
        [a, b, a.cos() + 2.0 * b.cos()],
        [w, rate, -a.sin() * w - 2.0 * b.sin() * rate],
    );
    show(shown, "slider-crank", (&model, start), END);
    let model = Knife { g };
    show(
        shown,
        "knife",
        (&model, model.state([0.0; 3], [0.0, 0.0, 1.3])),
        END,
    );
    let model = Redundant { g };
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
