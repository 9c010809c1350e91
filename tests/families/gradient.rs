//! Gradients of losses of models of run-time length by the adjoint (backward) method, compared with forward
//! derivatives.

use super::sensitive::{LongPendula, pair, pendula};
use crate::composed::{self, TIMES, compare_rows};
use crate::lengths::{Seen, of_heap};
use tfe::RunErrorKind;
use tfe::family::{FamilyState, Loss, Model, RunError};
use tfe::length::RunTimeLength;
use tfe::prelude::*;

/// The largest difference between a backward gradient and the one composed of forward derivatives, relative to the
/// largest derivative.
fn off<M: Model>(
    run: &Simulation<'_, M, 0, RunTimeLength>,
    start: &FamilyState,
    output: &str,
) -> f64 {
    let gradient = |loss: &Loss<'_>| {
        let found = run.gradient(start.clone(), 0.0..1.0, loss);
        found.expect("a gradient")
    };
    let all = gradient(&composed::of_all(output));
    let of_states = gradient(&composed::of_states(output));
    let forwards = TIMES.iter().fold(run.clone(), |run, t| run.break_at(*t));
    let forwards = forwards.run_sensitive(start.clone(), 0.0..1.0);
    let s = forwards.expect("derivatives");
    assert_eq!(all.1.motion().states(), s.motion().states());
    assert_eq!(all.1.parameters(), s.parameters());
    let pairs = composed::pairs(&all, &of_states, &s, output);
    let [value, expected] = pairs.value;
    assert!((value - expected).abs() < 1e-13 * value.abs().max(1.0));
    let mut seen = Seen::NOTHING;
    for [found, expected] in pairs.by_parameters.iter().chain(&pairs.by_start) {
        seen.see(&[*found], &[*expected]);
    }
    seen.part()
}

/// Springs each with its own stiffness as a parameter and friction: M q̈ = f with a constant diagonal M.
#[dynamics(
    coordinates(q[n]),
    lagrangian = sum(i in 0..n, m[i]/2*dot(q[i])^2) - sum(i in 0..n-1, k[i]*((q[i+1] - q[i])^2/2 + b*(q[i+1] - q[i])^4/4)),
    dissipation = sum(i in 0..n-1, c*q[i]^2*(dot(q[i+1]) - dot(q[i]))^2/2),
    force(q[0]) = f*sin(omega*t)*k[1],
    output(middle) = q[2]*k[1] + c*dot(q[3])^2,
)]
pub(super) struct Chain {
    pub(super) n: usize,
    pub(super) m: Vec<f64>,
    pub(super) k: Vec<f64>,
    pub(super) b: f64,
    pub(super) c: f64,
    pub(super) f: f64,
    pub(super) omega: f64,
}

pub(super) fn chain(n: usize) -> (Chain, FamilyState) {
    let swing = |a: usize| (a as f64).sin();
    let chain = Chain {
        n,
        m: (0..n).map(|a| 1.0 + 0.3 * swing(a)).collect(),
        k: (0..n - 1).map(|a| 1.5 + 0.5 * swing(2 * a)).collect(),
        b: 0.3,
        c: 0.2,
        f: 0.7,
        omega: 1.3,
    };
    let q: Vec<f64> = (0..n).map(|a| 0.5 * swing(3 * a)).collect();
    let v: Vec<f64> = (0..n).map(|a| 0.2 * swing(5 * a)).collect();
    let start = chain.state(q, v);
    (chain, start)
}

fn needs_newton<M: Model>(run: &Simulation<'_, M, 0, RunTimeLength>, start: &FamilyState) -> bool {
    let motion = run.run(start.clone(), 0.0..1.0).expect("a good run");
    motion.statistics().newton_iterations > 0
}

#[test]
fn gradients_backwards_are_derivatives_forwards() {
    // The rounding errors of twenty steps and of both solutions.
    const ROUNDING: f64 = 1e-12;
    let elements = [
        Element::mixed(2),
        Element::mixed(4),
        Element::mixed(9),
        Element::radau(3),
        Element::primal(4).lobatto(),
        Element::primal(3),
        Element::primal(4).reduced(),
    ];
    let (model, start) = chain(12);
    let mut kick = vec![0.0; 12];
    kick[3] = 0.4;
    for element in elements {
        let run = Simulation::new(&model).element(element).step(0.05);
        let off = off(&run.impulse(0.42, kick.clone()), &start, "middle");
        assert!(off < ROUNDING, "{element}: {off:.1e}");
    }
    // So stiff that the iteration converges slowly, and the matrix is factorised.
    let stiff = Chain {
        k: vec![700.0; 11],
        b: 0.0,
        c: 1e-3,
        f: 1e-3,
        ..chain(12).0
    };
    let run = Simulation::new(&stiff).step(0.05);
    assert!(needs_newton(&run, &start));
    let off_stiff = off(&run, &start, "middle");
    assert!(off_stiff < 10.0 * ROUNDING, "{off_stiff:.1e}");
    // Masses that depend on coordinates, and products of velocities.
    let (long, _, start) = pair();
    let start = of_heap(&start);
    for element in elements {
        let run = Simulation::new(&long).element(element).step(0.05);
        let off = off(&run, &start, "power");
        assert!(off < ROUNDING, "{element}: {off:.1e}");
    }
    // A Hamiltonian with momentum-dependent friction.
    let (pendula, _, start) = pendula();
    let start = of_heap(&start);
    for element in [Element::mixed(4), Element::mixed(9), Element::radau(4)] {
        let run = Simulation::new(&pendula).element(element).step(0.05);
        let off = off(&run, &start, "energy");
        assert!(off < ROUNDING, "{element}: {off:.1e}");
    }
    let stiff = LongPendula {
        k: vec![500.0; 2],
        ..pendula
    };
    let start = FamilyState {
        q: vec![4e-3, -3e-3, 9e-3],
        ..start
    };
    let run = Simulation::new(&stiff).step(0.05);
    assert!(needs_newton(&run, &start));
    let off_stiff = off(&run, &start, "energy");
    assert!(off_stiff < 10.0 * ROUNDING, "{off_stiff:.1e}");
}

/// Two heavy sites with a spring of their own, next to light ones on weak springs: their part of the gradient is
/// smaller by their mass, and must have as many digits.
#[test]
fn gradients_of_heavy_sites_keep_their_digits() {
    let model = Chain {
        n: 5,
        m: vec![1e15, 1e15, 1.0, 1.0, 1.0],
        k: vec![1e15, 1e-6, 1e-6, 1e-6],
        b: 0.0,
        c: 0.0,
        f: 0.0,
        omega: 1.3,
    };
    let start = model.state([0.4, -0.2, 0.1, 0.4, -0.5], [0.3, 0.0, -0.3, 0.2, 0.4]);
    let run = Simulation::new(&model).element(Element::mixed(4)).step(0.5);
    let loss = Loss::of_end(|q, _, _| q[0] + q[4]);
    let gradient = run.gradient(start.clone(), 0.0..3.0, &loss);
    let (_, gradient) = gradient.expect("a gradient");
    let s = run.run_sensitive(start, 0.0..3.0).expect("derivatives");
    let matrix = s.by_start().last();
    let by = |name: &str| {
        let last = s.by(name).last();
        (gradient.by(name), last.q[0] + last.q[4])
    };
    let of_start = gradient.by_start();
    for (found, expected) in [
        by("k[0]"),
        by("m[0]"),
        by("k[3]"),
        (of_start.p[0], matrix[(5, 0)] + matrix[(9, 0)]),
        (of_start.q[0], matrix[(5, 5)] + matrix[(9, 5)]),
    ] {
        let off = (found / expected - 1.0).abs();
        assert!(off < 1e-9, "{found:e} {expected:e}: {off:e}");
    }
}

/// With a loose tolerance, elements end within that tolerance of their exact ends; derivatives have the same accuracy.
#[test]
fn runs_with_a_tolerance_have_derivatives() {
    let (model, start) = chain(12);
    let loss: Loss<'_> = Loss::output_at_end("middle");
    let found = |tolerance: Option<f64>| {
        let run = Simulation::new(&model).step(0.25);
        let run = match tolerance {
            Some(tolerance) => run.tolerance(tolerance),
            None => run,
        };
        let gradient = run.gradient(start.clone(), 0.0..1.0, &loss);
        let (_, gradient) = gradient.expect("a gradient");
        let kept = run.clone().record_every(2);
        let kept = kept.gradient(start.clone(), 0.0..1.0, &loss);
        let (_, kept) = kept.expect("a gradient");
        let s = run.run_sensitive(start.clone(), 0.0..1.0);
        let slopes = s.expect("derivatives").by("c").output("middle");
        let slope = slopes.and_then(|all| all.last().copied());
        [gradient.by("c"), kept.by("c"), slope.expect("declared")]
    };
    for (rough, fine) in found(Some(1e-4)).into_iter().zip(found(None)) {
        assert!((rough - fine).abs() < 1e-3 * fine.abs(), "{rough} {fine}");
    }
}

/// A hundred sites and two hundred parameters.
#[test]
fn a_hundred_sites_backwards_and_forwards() {
    let (model, start) = chain(100);
    let run = Simulation::new(&model).step(0.1).element(Element::mixed(4));
    let off = off(&run, &start, "middle");
    assert!(off < 1e-12, "{off:.1e}");
}

/// Nodes that are not stored are computed again during the backward sweep: the same gradient with less memory.
#[test]
fn runs_that_keep_some_nodes_have_the_gradients_of_those_that_keep_all() {
    fn all_of<M: Model>(
        run: &Simulation<'_, M, 0, RunTimeLength>,
        start: &FamilyState,
        span: std::ops::Range<f64>,
        loss: &Loss<'_>,
    ) -> Vec<f64> {
        let found = run.gradient(start.clone(), span, loss);
        composed::row(&found.expect("a gradient"))
    }
    let (model, start) = chain(12);
    let mut kick = vec![0.0; 12];
    kick[3] = 0.4;
    for (element, span) in [
        (Element::mixed(4), 0.0..1.0),
        (Element::radau(3), 0.0..1.0),
        (Element::primal(4).lobatto(), 0.0..1.0),
        (Element::mixed(3), 1.0..0.0),
        (Element::mixed(3), 0.5..0.5),
    ] {
        let loss = composed::of_span("middle", &span);
        // One impulse inside, and one at a node that is stored.
        let run = Simulation::new(&model).element(element).step(0.05);
        let run = match span.start == span.end {
            true => run,
            false => {
                let kicked = run.impulse(0.42, kick.clone());
                kicked.impulse(0.35, kick.clone()).break_at(0.77)
            }
        };
        let expected = all_of(&run, &start, span.clone(), &loss);
        for every in [2, 7, usize::MAX] {
            let run = run.clone().record_every(every);
            let found = all_of(&run, &start, span.clone(), &loss);
            compare_rows(&found, &expected, &format!("{element}, every {every}"));
        }
    }
    let loss = Loss::output_at_end("middle");
    let most = |every: usize| {
        let run = Simulation::new(&model).step(0.01).record_every(every);
        let run = run.impulse(0.42, kick.clone()).impulse(0.3, kick.clone());
        let run = || {
            all_of(&run, &start, 0.0..9.0, &loss);
        };
        allocation_counter::measure(run).bytes_max
    };
    let (all, some) = (most(1), most(30));
    assert!(8 * some < all, "{some} bytes beside {all}");
}

/// Compared with the same model of fixed size, by a mass, springs and a friction.
#[test]
fn second_derivatives_are_those_of_fixed_size() {
    let (long, five, start) = pair();
    let names = ["m[1]", "s[2]", "c"];
    let loss = tfe::sensitivity::Loss::output_at_end("power");
    let fixed = Simulation::new(&five).step(0.05);
    let fixed = fixed.hessian(start, 0.0..1.0, &loss, names);
    let fixed = fixed.expect("second derivatives");
    let loss = Loss::output_at_end("power");
    let run = Simulation::new(&long).step(0.05);
    let found = run.hessian(of_heap(&start), 0.0..1.0, &loss, names);
    let found = found.expect("second derivatives");
    let off = (found.matrix() - fixed.matrix()).amax();
    assert!(off < 1e-9 * fixed.matrix().amax(), "{off:e}");
    assert!(found.errors().amax() < 1e-8 * fixed.matrix().amax());
}

/// A force that jumps at a break where the element has a quadrature point: the value after the break is used, also when
/// elements are solved once more.
#[test]
fn forces_that_jump_at_breaks() {
    #[dynamics(
        coordinates(q[n]),
        lagrangian = sum(i in 0..n, dot(q[i])^2/2 - q[i]^2/2),
        force(q[0]) = f*select(t <= 0.55, 1, -2),
    )]
    struct Pushed {
        n: usize,
        f: f64,
    }
    let start = FamilyState {
        q: vec![0.3, 0.2],
        p: vec![0.1, -0.4],
    };
    let element = Element::primal(3).lobatto();
    let simulation = |pushed: &'static Pushed| {
        let run = Simulation::new(pushed).element(element);
        run.step(0.1).break_at(0.55)
    };
    static PUSHED: [Pushed; 2] = [Pushed { n: 2, f: 1.5 }, Pushed { n: 2, f: 0.5 }];
    let ends = PUSHED.each_ref().map(|pushed| {
        let motion = simulation(pushed).run(start.clone(), 0.0..1.0);
        motion.expect("a good run").last().q[0]
    });
    // The equations are linear.
    let expected = ends[0] - ends[1];
    let run = simulation(&PUSHED[0]);
    let forwards = run.run_sensitive(start.clone(), 0.0..1.0).expect("a run");
    let loss = Loss::of_end(|q, _, _| q[0]);
    let backwards = run.gradient(start, 0.0..1.0, &loss).expect("a run").1;
    for found in [forwards.by("f").last().q[0], backwards.by("f")] {
        assert!((found - expected).abs() < 1e-14, "{found} {expected}");
    }
}

#[test]
fn losses_that_do_not_belong_are_told() {
    let (model, start) = chain(5);
    let run = Simulation::new(&model).step(0.1);
    let error = |loss: Loss<'_>| -> RunErrorKind {
        let error: RunError = run
            .gradient(start.clone(), 0.0..1.0, &loss)
            .expect_err("a loss that does not belong");
        error.kind().clone()
    };
    let unknown = error(Loss::output_at_end("midle"));
    assert!(
        matches!(&unknown, RunErrorKind::NoOutput { name, known } if name == "midle" && known == &["middle"]),
        "{unknown}"
    );
    let undefined = error(Loss::of_end(|q, _, _| (-1.0 - q[0].abs()).sqrt()));
    assert!(
        matches!(undefined, RunErrorKind::Loss { .. }),
        "{undefined}"
    );
    for (times, values) in [
        (&[0.5, 2.0][..], &[0.0, 0.0][..]),
        (&[0.5], &[]),
        (&[0.5], &[f64::NAN]),
    ] {
        let kind = error(Loss::squares("middle", times, values));
        assert!(matches!(kind, RunErrorKind::Loss { .. }), "{kind}");
    }
    // Models that are inconsistent with each other.
    let short = Chain {
        k: vec![1.0],
        ..chain(5).0
    };
    let broken = Simulation::new(&short).step(0.1);
    let kind = broken.gradient(start.clone(), 0.0..1.0, &Loss::output_at_end("middle"));
    let kind = kind.expect_err("too few springs").kind().clone();
    assert!(matches!(kind, RunErrorKind::Family(_)), "{kind}");
}
