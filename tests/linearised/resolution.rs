//! Steps of linear models that do not resolve the motion have a warning, as those of other models. No iteration fails
//! there, whatever the step: the equations of an element are linear.

use crate::common::larger;
use tfe::prelude::*;
use tfe::{Motion, Warning};

#[dynamics(coordinates(x), lagrangian = dot(x)^2/2 - x^2/2)]
struct Free;

#[dynamics(coordinates(x), lagrangian = dot(x)^2/2 - x^2/2, force(x) = f*cos(3*t))]
struct Forced {
    f: f64,
}

#[dynamics(coordinates(q[n]), lagrangian = sum(i in 0..n, dot(q[i])^2/2 - q[i]^2/2))]
struct Row {
    n: usize,
}

const FORCED: Forced = Forced { f: 4.0 };

fn elements() -> [Element; 6] {
    [
        Element::mixed(2),
        Element::mixed(4),
        Element::primal(3).reduced(),
        Element::three_field(3),
        Element::energy_conserving(3),
        Element::radau(3),
    ]
}

/// Steps from 0.02, which all elements but those of second order resolve, to 11, which none does.
fn steps() -> impl Iterator<Item = f64> {
    (0..70).map(|k| 0.02 * 1.095_f64.powi(k))
}

fn is_told(warnings: &[Warning]) -> bool {
    let is_unresolved = |one: &Warning| matches!(one, Warning::Unresolved { .. });
    warnings.iter().any(is_unresolved)
}

/// The largest distance of the nodes from the motion, relative to its extent.
fn off(motion: &Motion<1>, exact: impl Fn(f64) -> f64, extent: f64) -> f64 {
    let nodes = motion.states().iter();
    let distances = nodes.map(|node| (node.q[0] - exact(node.t)).abs() / extent);
    distances.fold(0.0, larger)
}

/// Two steps of each length: an error of a fifth of the extent is told, and one of a thousandth is not.
#[test]
fn long_steps_of_linear_models_are_told() {
    let free = |t: f64| t.cos();
    // x″ + x = 4 cos 3t from rest at zero.
    let forced = |t: f64| (t.cos() - (3.0 * t).cos()) / 2.0;
    let mut counts = [0; 2];
    for element in elements() {
        for h in steps() {
            let run = Simulation::new(&Free).element(element).step(h);
            let run = run.run(Free.state([1.0], [0.0]), 0.0..2.0 * h);
            let driven = Simulation::new(&FORCED).element(element).step(h);
            let driven = driven.run(FORCED.state([0.0], [0.0]), 0.0..2.0 * h);
            let runs = [
                (off(run.as_ref().expect("linear"), free, 2.0), run),
                (off(driven.as_ref().expect("linear"), forced, 2.0), driven),
            ];
            for (off, run) in runs {
                let told = is_told(run.expect("linear").warnings());
                assert!(told || off <= 0.2, "{element}, h = {h}: off by {off}");
                assert!(!told || off >= 0.001, "{element}, h = {h}: off by {off}");
                counts[usize::from(told)] += 1;
            }
        }
    }
    assert!(counts.iter().all(|count| *count > 200), "{counts:?}");
}

#[test]
fn steps_without_end_and_rows_of_run_time_length_are_told() {
    let told = |h: f64| {
        let mut steps = Simulation::new(&Free)
            .step(h)
            .steps(Free.state([1.0], [0.0]), 0.0);
        assert!(steps.by_ref().take(5).all(|node| node.is_ok()));
        let row = Row { n: 3 };
        let start = row.state([1.0, 0.5, 0.0], [0.0, 1.0, 0.5]);
        let run = Simulation::new(&row).step(h).run(start, 0.0..5.0 * h);
        // Without Newton's method long steps are an error.
        let row = run.map_or(true, |motion| is_told(motion.warnings()));
        [is_told(&steps.warnings()), row]
    };
    assert_eq!(told(8.0), [true; 2]);
    assert_eq!(told(0.1), [false; 2]);
}

/// A stiff mode that is hardly excited needs no short steps: a slow mode beside one of frequency 10⁴.
#[test]
fn stiff_modes_at_rest_need_no_resolution() {
    #[dynamics(coordinates(x, y), lagrangian = (dot(x)^2 + dot(y)^2)/2 - x^2/2 - k/2*(y - x)^2)]
    struct Stiff {
        k: f64,
    }
    let stiff = Stiff { k: 1e8 };
    for element in [Element::mixed(4), Element::radau(3)] {
        let run = Simulation::new(&stiff).element(element).step(0.1);
        let motion = run.run(stiff.state([1.0, 1.0], [0.0; 2]), 0.0..10.0);
        let motion = motion.expect("linear");
        assert_eq!(motion.warnings(), [], "{element}");
        // Together they are one oscillator of twice the mass.
        let exact = (10.0 / 2.0_f64.sqrt()).cos();
        assert!((motion.last().q[0] - exact).abs() < 1e-3, "{element}");
    }
}
