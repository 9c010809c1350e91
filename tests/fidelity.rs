//! Ladders of models: model errors compared with closed forms, the choice of a model, and what is refused.

mod common;

use common::{larger, observed_order};
use std::time::Duration;
use tfe::fidelity::{Choice, FidelityError, Ladder, Rung};
use tfe::prelude::*;
use tfe::runtime::structure::{Operations, Structure};
use tfe::work_precision::{Cost, Reference, SaveError};

#[dynamics(
    coordinates(theta),
    lagrangian = dot(theta)^2/2 - w^2/2*theta^2,
    output(angle) = theta, output(linear_only) = theta,
)]
struct Linear {
    w: f64,
}

#[dynamics(
    coordinates(theta),
    lagrangian = dot(theta)^2/2 - w^2*(theta^2/2 - theta^4/24),
    output(angle) = theta,
)]
struct Cubic {
    w: f64,
}

#[dynamics(
    coordinates(theta),
    lagrangian = dot(theta)^2/2 + w^2*cos(theta),
    output(rate) = dot(theta), output(angle) = theta,
)]
struct Full {
    w: f64,
}

/// The same pendulum in Cartesian coordinates with a rod: two coordinates and a constraint.
#[dynamics(
    coordinates(x, y),
    lagrangian = (dot(x)^2 + dot(y)^2)/2 - w^2*y,
    constraint(rod) = x^2 + y^2 - 1,
    output(x_bob) = x,
)]
struct Bob {
    w: f64,
}

/// A model with the square root of an angle that becomes negative.
#[dynamics(
    coordinates(theta),
    lagrangian = dot(theta)^2/2 + w^2*cos(theta),
    output(angle) = sqrt(theta),
)]
struct Lost {
    w: f64,
}

/// Independent pendulums, of which the first one is observed.
#[dynamics(
    coordinates(theta[n]),
    lagrangian = sum(i in 0..n, dot(theta[i])^2/2 + w^2*cos(theta[i])),
    output(angle) = theta[0],
    output(each[i in 0..n]) = theta[i],
)]
struct Many {
    n: usize,
    w: f64,
}

/// A heavy symmetric top in Euler angles.
#[dynamics(
    coordinates(phi, theta, psi),
    lagrangian = a/2*(dot(theta)^2 + dot(phi)^2*sin(theta)^2) + c/2*(dot(psi) + dot(phi)*cos(theta))^2 - mgl*cos(theta),
    output(height) = cos(theta),
    output(spin) = dot(psi) + dot(phi)*cos(theta),
    model(Nutation, routh(psi, phi)),
)]
struct Top {
    a: f64,
    c: f64,
    mgl: f64,
}

/// A mass on a spring, and on rods.
#[dynamics(
    coordinates(r, theta),
    lagrangian = m/2*(dot(r)^2 + r^2*dot(theta)^2) + m*g*r*cos(theta) - k/2*(r - l)^2,
    output(x) = r*sin(theta), output(y) = -r*cos(theta),
    model(Rod, frozen(r = l)),
    model(LongRod, frozen(r = l + m*g/k)),
)]
struct Spring {
    m: f64,
    l: f64,
    g: f64,
    k: f64,
}

impl Spring {
    const ANGLE: f64 = 0.5;

    fn new(k: f64) -> Self {
        Self {
            m: 1.0,
            l: 1.0,
            g: 9.81,
            k,
        }
    }

    /// At rest, with the length of equilibrium.
    fn start(&self) -> State<2> {
        let length = self.l + self.m * self.g * Self::ANGLE.cos() / self.k;
        self.state([length, Self::ANGLE], [0.0; 2])
    }
}

const W: f64 = 3.0;
const END: f64 = 20.0;

fn amplitude() -> f64 {
    5.0_f64.to_radians()
}

/// The tests check errors and numbers of evaluations, not times.
fn ladder<'m>(span: std::ops::Range<f64>) -> Fidelity<'m> {
    Fidelity::new(span)
        .repeat_for(Duration::ZERO)
        .against(Cost::Evaluations)
}

fn pendulums() -> Ladder {
    let (linear, cubic, full) = (Linear { w: W }, Cubic { w: W }, Full { w: W });
    let a = amplitude();
    ladder(0.0..END)
        .rung("linear", &linear, linear.state([a], [0.0]))
        .rung("cubic", &cubic, cubic.state([a], [0.0]))
        .rung("full", &full, full.state([a], [0.0]))
        .run()
        .unwrap()
}

/// The largest |cos ωt − cos ω't| at the ends of sixteen parts of the span, with ω' = ω (1 − lag).
fn of_phase(lag: f64) -> f64 {
    let times = (1..=16).map(|k| W * END * f64::from(k) / 16.0);
    times
        .map(|phase| (phase.cos() - (phase * (1.0 - lag)).cos()).abs())
        .fold(0.0, larger)
}

#[test]
fn errors_of_models_are_those_of_their_frequencies() {
    let ladder = pendulums();
    assert_eq!(ladder.outputs(), ["angle"]);
    let error = |rung: usize| ladder.rungs()[rung].model_error();
    let a = amplitude();
    // With ω₀ for small amplitudes a, the full pendulum has ω/ω₀ = 1 − a²/16, the linear one 1. The energy that the
    // cubic model neglects, on average ⟨V⟩ = 5/16 ω₀² a⁶/720, shifts its frequency by d⟨V⟩/da/(ω₀ a) = ω₀ a⁴/384.
    let (linear, cubic) = (error(0).unwrap(), error(1).unwrap());
    assert!(
        (linear / of_phase(a.powi(2) / 16.0) - 1.0).abs() < 0.1,
        "{linear:e}"
    );
    assert!(
        (cubic / of_phase(a.powi(4) / 384.0) - 1.0).abs() < 0.1,
        "{cubic:e}"
    );
    assert_eq!(error(2), None);
}

#[test]
fn each_accuracy_takes_the_model_it_needs() {
    let ladder = pendulums();
    let [linear, cubic] = [0, 1].map(|rung: usize| ladder.rungs()[rung].model_error().unwrap());
    let rung = |accuracy| ladder.cheapest(accuracy).map(|choice| choice.rung.as_str());
    assert!(rung(1e-1).is_some());
    // A model that is too inaccurate is not chosen, even if the error of one of its runs is small by chance.
    for k in 0..200 {
        let accuracy = 0.1 * 0.9_f64.powi(k);
        let chosen = rung(accuracy);
        assert!(
            accuracy >= linear || chosen != Some("linear"),
            "{accuracy:e}"
        );
        assert!(accuracy >= cubic || chosen != Some("cubic"), "{accuracy:e}");
    }
    let best = ladder.cheapest(1e-9).unwrap();
    assert!(best.rung == "full" && best.error <= 1e-9);
    // Where the linear model is accurate enough, it is also the cheapest.
    assert_eq!(rung(linear), Some("linear"));
    let cheaper = ladder.cheapest(1e-2).unwrap().evaluations;
    assert!(cheaper < best.evaluations);
    // Accuracies beyond that of the reference are refused.
    assert!(!ladder.is_known(ladder.reference().uncertainty()));
    assert_eq!(ladder.cheapest(1e-30), None);
}

#[test]
fn costs_rise_as_errors_fall_and_tables_say_so() {
    let ladder = pendulums();
    for rung in ladder.rungs() {
        let front = rung.front(Cost::Evaluations);
        assert!(!front.is_empty() && rung.failed() == 0);
        for pair in front.windows(2) {
            assert!(pair[0].error > pair[1].error && pair[0].evaluations < pair[1].evaluations);
        }
    }
    let text = ladder.to_string();
    assert_eq!(text.lines().count(), 1 + 10 + 2 + 1, "{text}");
    assert!(text.contains("error of the model `cubic`"), "{text}");
    let csv = ladder.to_csv();
    let runs: usize = ladder.rungs().iter().map(|rung| rung.points().len()).sum();
    assert_eq!(csv.lines().count(), 1 + runs);
    let columns = |line: &str| line.split(',').count();
    assert!(csv.lines().all(|line| columns(line) == 13), "{csv}");
    let unknown = ladder.save("ladder.txt").unwrap_err();
    assert!(matches!(unknown, SaveError::UnknownEnding { .. }));
    #[cfg(feature = "charts")]
    {
        let svg = ladder.chart().to_svg().unwrap();
        assert!(svg.contains("linear, model error 2.3e-2") && svg.contains("full"));
    }
}

#[test]
fn rungs_may_differ_in_length_and_kind() {
    let (many, full) = (Many { n: 3, w: W }, Full { w: W });
    let ladder = ladder(0.0..4.0)
        .rung("many", &many, many.state([1.0, 0.3, 0.2], [0.0; 3]))
        .rung("full", &full, full.state([1.0], [0.0]))
        .accuracies([1e-4, 1e-8])
        .run()
        .unwrap();
    // Two equal models: the model error must be found to be below the smallest accuracy.
    let many = &ladder.rungs()[0];
    assert!(
        many.model_error().is_none_or(|error| error < 1e-8),
        "{many:?}"
    );
    assert!(many.choices().any(|choice| choice.error < 1e-8));
    assert!(ladder.cheapest(1e-8).is_some());
}

fn total(one: Operations) -> u32 {
    one.additions + one.multiplications + one.divisions + one.sines + one.functions
}

/// The smallest number of operations in kernels with which a model reaches an accuracy.
fn operations(rung: &Rung, structure: &Structure, accuracy: f64) -> u64 {
    let work = |choice: &Choice| {
        choice.statistics.residual_evaluations * u64::from(total(structure.first))
            + choice.statistics.tangent_evaluations * u64::from(total(structure.second))
    };
    let enough = rung.choices().filter(|one| one.error <= accuracy);
    enough.map(work).min().unwrap()
}

#[test]
fn ignored_angles_cost_no_accuracy_and_save_operations() {
    let top = Top {
        a: 1.2,
        c: 0.7,
        mgl: 2.0,
    };
    let start = top.state([0.3, 0.9, -0.2], [0.4, 0.1, 6.0]);
    let (nutation, left) = Nutation::of_state(&top, &start);
    let ladder = ladder(0.0..10.0)
        .rung("nutation", &nutation, left)
        .rung("full", &top, start)
        .run()
        .unwrap();
    assert_eq!(ladder.outputs(), ["height", "spin"]);
    let [reduced, full] = [0, 1].map(|rung: usize| &ladder.rungs()[rung]);
    for rung in [reduced, full] {
        let least = rung.choices().map(|one| one.error);
        assert!(least.fold(1.0, f64::min) < 1e-10, "{rung:?}");
        assert_eq!(rung.model_error(), None);
    }
    // Measured operations of the reduced and the full model: 16 900 and 23 120 for 1e-6, where the full model is
    // accurate enough with steps so long that some of them are cut, and 17 888 and 35 048 for the others. The full
    // model also has to solve for three unknowns instead of one.
    for (accuracy, most) in [(1e-6, 0.75), (1e-8, 2.0 / 3.0), (1e-10, 2.0 / 3.0)] {
        let [reduced, full] = [
            operations(reduced, &Nutation::structure(), accuracy),
            operations(full, &Top::structure(), accuracy),
        ];
        assert!(
            (reduced as f64) < most * full as f64,
            "{accuracy:e}: {reduced} of {full}"
        );
    }
}

#[test]
fn rods_err_by_the_compliance_of_their_springs() {
    let errors = |k: f64| {
        let spring = Spring::new(k);
        let (rod, long) = (Rod::of(&spring), LongRod::of(&spring));
        let ladder = ladder(0.0..6.0)
            .rung("rod", &rod, rod.state([Spring::ANGLE], [0.0]))
            .rung("longer rod", &long, long.state([Spring::ANGLE], [0.0]))
            .rung("spring", &spring, spring.start())
            .elements([Mixed::<5>.into(), Mixed::<9>.into()])
            .accuracies([1e-1, 1e-6])
            .parts(96) // the first steps tried resolve the period of the softest spring, so that the reference does not miss its oscillation
            .run()
            .unwrap();
        assert_eq!(ladder.outputs(), ["x", "y"]);
        assert_eq!(ladder.cheapest(1e-6).unwrap().rung, "spring");
        [0, 1].map(|rung: usize| (1.0 / k, ladder.rungs()[rung].model_error().unwrap()))
    };
    let points = [4e3, 16e3, 64e3, 256e3].map(errors);
    for rung in [0, 1] {
        let points = points.map(|both| both[rung]);
        let order = observed_order(&points, 1e-9, "rod against spring");
        assert!((order - 1.0).abs() < 0.02, "{order} {points:?}");
    }
    // The weight at rest is most of what lengthens the spring.
    assert!(points.iter().all(|[rod, long]| long.1 < rod.1 / 3.0));
}

/// Steps much longer than an oscillation are cut, all of them into the same pieces: runs that agree for that reason
/// must serve neither as a reference nor as a model error.
#[test]
fn runs_that_agree_because_they_are_cut_tell_nothing() {
    let (w, lag) = (200.0, 1e-5);
    let (slow, fast) = (Full { w }, Full { w: w * (1.0 + lag) });
    let found = ladder(0.0..4.0)
        .rung("slow", &slow, slow.state([2.0], [0.0]))
        .rung("fast", &fast, fast.state([2.0], [0.0]))
        .outputs(["angle"])
        .elements([Mixed::<3>.into()])
        .accuracies([1e-4])
        .run()
        .unwrap();
    let Reference::Computed { step, .. } = *found.reference() else {
        panic!("{:?}", found.reference());
    };
    // The period of a small oscillation is 0.031; the first step size tried is 0.25.
    assert!(step < 0.031, "{step}");
    // The reference is from a composition of leapfrogs of order 8, with 8000 and with 16 000 steps.
    let right = 0.005_907_765_687;
    let error = found.rungs()[0].model_error().expect("above 1e-4");
    assert!((error - right).abs() < 0.05 * right, "{error}");
}

#[test]
fn steps_that_miss_the_oscillation_of_a_spring_tell_its_swing() {
    for k in [1e6, 1e8] {
        let spring = Spring::new(k);
        let run = |step: f64| {
            let parts = (0.375 / step).round() as usize;
            let simulation = Simulation::new(&spring).element(Mixed::<9>);
            let simulation = simulation.step(0.375 / parts as f64).record_every(parts);
            simulation.run(spring.start(), 0.0..1.5).unwrap()
        };
        let period = 2.0 * std::f64::consts::PI / (k / spring.m).sqrt();
        let (resolved, long) = (run(period / 4.0), run(0.375));
        let pairs = resolved.states().iter().zip(long.states());
        let apart = pairs.map(|(a, b)| common::distance(&a.q, &b.q));
        let apart = apart.fold(0.0, larger);
        // The length of equilibrium l + (m/k) (g cos θ + l θ̇²) has at rest the acceleration 3 m g² sin² θ/(k l);
        // divided by ω² this is the amplitude of the oscillation. Long steps keep the amplitude but not the phase:
        // hence a difference of at most twice the amplitude, plus rounding errors of ten thousand steps.
        let pull = spring.m * spring.g * Spring::ANGLE.sin() / k;
        let amplitude = 3.0 * pull.powi(2) / spring.l;
        assert!(apart < 2.0 * amplitude + 1e-12, "{k:e}: {apart:e}");
    }
}

#[test]
fn runs_that_fail_are_points_with_reasons() {
    let bob = Bob { w: W };
    let off = State {
        q: [0.5, 0.5],
        p: [0.0; 2],
    };
    let (x, y) = 0.5_f64.sin_cos();
    let ladder = ladder(0.0..2.0)
        .rung("off its rod", &bob, off)
        .rung("bob", &bob, bob.state([x, -y], [0.0; 2]))
        .elements([Mixed::<3>.into()])
        .accuracies([1e-3])
        .run()
        .unwrap();
    let failed = &ladder.rungs()[0];
    assert_eq!((failed.points().len(), failed.failed()), (1, 1));
    let reason = failed.points()[0].outcome.as_ref().unwrap_err();
    assert!(reason.to_string().contains("constraint"), "{reason}");
    assert_eq!(ladder.cheapest(1e-3).unwrap().rung, "bob");
    assert!(
        ladder
            .to_csv()
            .lines()
            .nth(1)
            .unwrap()
            .contains("constraint")
    );
}

#[test]
fn outputs_that_are_no_numbers_are_never_chosen() {
    let (lost, full) = (Lost { w: W }, Full { w: W });
    let start = State { q: [0.1], p: [0.0] };
    let small = || {
        ladder(0.0..2.0)
            .elements([Mixed::<5>.into()])
            .accuracies([1e-3])
            .most_steps(128)
    };
    let found = small()
        .rung("lost", &lost, start)
        .rung("full", &full, start);
    let found = found.run().unwrap();
    assert!(found.rungs()[0].choices().all(|one| one.error.is_nan()));
    assert!(found.rungs()[0].front(Cost::Steps).is_empty());
    assert_eq!(found.cheapest(1e9).unwrap().rung, "full");
    let nothing = small()
        .rung("full", &full, start)
        .rung("lost", &lost, start);
    assert_eq!(nothing.run().unwrap_err(), FidelityError::ReferenceValue);
}

#[test]
fn lines_of_the_table_name_the_accuracies_asked_for() {
    let (linear, full) = (Linear { w: W }, Full { w: W });
    let found = ladder(0.0..2.0)
        .rung("linear", &linear, linear.state([0.1], [0.0]))
        .rung("full", &full, full.state([0.1], [0.0]))
        .elements([Mixed::<5>.into()])
        .accuracies([1.25e-2, 1.2e-2, 1e-3])
        .run()
        .unwrap();
    let text = found.to_string();
    let asked: Vec<&str> = text
        .lines()
        .skip(1)
        .take(3)
        .filter_map(|line| line.split_whitespace().next())
        .collect();
    assert_eq!(asked, ["1.25e-2", "1.2e-2", "1e-3"]);
}

#[test]
fn what_is_no_ladder() {
    let (linear, bob, full) = (Linear { w: W }, Bob { w: W }, Full { w: W });
    let start = || State { q: [0.1], p: [0.0] };
    let two = || {
        ladder(0.0..1.0)
            .rung("linear", &linear, start())
            .rung("full", &full, start())
    };
    #[track_caller]
    fn check(ladder: &Fidelity<'_>, expected: impl Fn(&FidelityError) -> bool, words: &str) {
        let error = ladder.run().unwrap_err();
        assert!(expected(&error), "{error:?}");
        assert!(error.to_string().contains(words), "{error}");
    }
    use FidelityError as E;
    let none = ladder(0.0..1.0);
    check(&none, |one| matches!(one, E::NoRungs), ".rung(");
    let wrong = two().outputs(["linear_only"]);
    let is = |one: &E| matches!(one, E::UnknownOutput { rung, .. } if rung == "full");
    check(&wrong, is, "`rate`, `angle`");
    let apart = two().rung(
        "bob",
        &bob,
        State {
            q: [0.0, -1.0],
            p: [0.0; 2],
        },
    );
    let is = |one: &E| matches!(one, E::NoOutputs { declared } if declared.len() == 3);
    check(&apart, is, "`x_bob`");
    let is = |one: &E| matches!(one, E::NoOutputs { .. });
    check(&two().outputs([""; 0]), is, "output(name)");
    let twice = two().rung("full", &full, start());
    check(&twice, |one| matches!(one, E::SameName { .. }), "`full`");
    check(
        &two().elements([]),
        |one| matches!(one, E::NoElements),
        ".elements(",
    );
    let is = |one: &E| matches!(one, E::Element(_));
    check(&two().elements([Element::mixed(99)]), is, "99");
    let is = |one: &E| matches!(one, E::NoAccuracies);
    check(&two().accuracies([]), is, ".accuracies(");
    for accuracy in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let is = |one: &E| matches!(one, E::Accuracy { .. });
        check(&two().accuracies([accuracy]), is, "accuracy");
    }
    for parts in [0, usize::MAX] {
        check(
            &two().parts(parts),
            |one| matches!(one, E::Parts { .. }),
            "parts",
        );
    }
    for span in [1.0..1.0, 0.0..f64::NAN, 0.0..f64::INFINITY, -1e308..1e308] {
        let bad = ladder(span).rung("full", &full, start());
        check(&bad, |one| matches!(one, E::Span { .. }), "span");
    }
    let nowhere = ladder(0.0..1.0).rung(
        "full",
        &full,
        State {
            q: [f64::NAN],
            p: [0.0],
        },
    );
    check(
        &nowhere,
        |one| matches!(one, E::Reference(_)),
        "nothing to compare with",
    );
    let many = Many { n: 0, w: W };
    let empty = ladder(0.0..1.0).rung("many", &many, many.state([], []));
    check(&empty, |one| matches!(one, E::Model { .. }), "`many`");
}
