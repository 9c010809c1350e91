//! Steps down to the resolution of positions: an iteration that has reached the rounding errors of its constraints must
//! end. Also steps that are far too long.

use crate::common::{distance, larger};
use crate::models::{
    Andrews, Bead, BeadRates, KnifeEdge, MovingGround, MovingWire, ON_WIRE, QuaternionTop,
    RodPendulum, RodPendulumRates, SliderCrank,
};
use crate::moves::{Moves, Scene, Shown, show};
use crate::overconstrained::plate;
use std::cell::{Cell, RefCell};
use tfe::prelude::*;
use tfe::runtime::Statistics;
use tfe::runtime::constrained::Trail;

const STEPS: [f64; 9] = [1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9];

/// Runs with three to eight nodes. Formerly eight nodes failed below steps of 1e-5, or took more than a hundred
/// iterations per step.
fn runs<const N: usize>(mechanism: &dyn Moves<N>) {
    for nodes in 3..=8 {
        for step in STEPS {
            let motion = mechanism.run(Element::mixed(nodes), step, 40.0 * step);
            let motion = motion.unwrap_or_else(|error| panic!("{nodes} {step:e}: {error}"));
            let iterations = motion.statistics().newton_iterations;
            assert!(iterations <= 16 * 40, "{nodes} {step:e}: {iterations}");
            let energies = motion.energies();
            let off = energies[40] - energies[0];
            // The error is of order 2(n − 1) unless it is rounding.
            let most = 1e-13 + (2.0 * step).powi(2 * nodes as i32 - 2);
            assert!(
                off.abs() < most,
                "{nodes} {step:e}: energy off by {off:.1e}"
            );
        }
    }
}

#[test]
fn a_rod_takes_steps_of_any_size() {
    let model = &RodPendulum::UNIT;
    let start = model.state([0.6, -0.8], [0.4, 0.3]);
    runs(Scene { model, start }.moves());
}

const CRANK: SliderCrank = SliderCrank {
    j: 0.5,
    k: 0.2,
    m: 1.0,
    g: 3.0,
};

#[test]
fn a_slider_crank_takes_steps_of_any_size() {
    let (model, start) = (&CRANK, CRANK.turning(0.7, 1.3));
    runs(Scene { model, start }.moves());
}

/// Elements of three to seven nodes compared with eight: errors fall with the order 2(n − 1) of the element until they
/// reach rounding, and then remain there.
fn falls<const N: usize>(name: &str, mechanism: &dyn Moves<N>, largest: f64) {
    const COUNT: u32 = 20;
    const ROUNDINGS: f64 = 4e-15;
    let mut before = [f64::INFINITY; 5];
    for step in STEPS.into_iter().skip_while(|step| *step > largest) {
        let end = |nodes: usize| {
            let motion = mechanism.run(Element::mixed(nodes), step, f64::from(COUNT) * step);
            let motion = motion.unwrap_or_else(|error| panic!("{name}, {nodes} {step:e}: {error}"));
            let iterations = motion.statistics().newton_iterations;
            assert!(
                iterations <= 64 * u64::from(COUNT),
                "{name}, {nodes} {step:e}: {iterations}"
            );
            motion.last().q
        };
        let exact = end(8);
        let size = exact.iter().fold(1.0, |size: f64, q| size.max(q.abs()));
        for (before, nodes) in before.iter_mut().zip(3..) {
            let off = distance(&end(nodes), &exact) / size;
            // The time is shorter, too.
            let expected = *before * 0.1_f64.powi(2 * nodes as i32 - 3);
            assert!(
                off <= expected + ROUNDINGS,
                "{name}, {nodes} {step:e}: {off:.1e} after {before:.1e}"
            );
            *before = off;
        }
    }
}

/// Andrews' mechanism, which turns a thousand times per second.
const SQUEEZER: &str = "Andrews";

/// The mechanisms of one mass point.
const POINTS: [&str; 6] = [
    "rod",
    "rod by rates",
    "bead",
    "bead by rates",
    "moving wire",
    "fast rod",
];

/// Twelve mechanisms.
fn each(shown: &impl Shown) {
    let rod = RodPendulum::UNIT;
    show(shown, "rod", (&rod, rod.horizontal()), 3.0);
    let rates = RodPendulumRates::UNIT;
    show(shown, "rod by rates", (&rates, rates.horizontal()), 3.0);
    let bead = Bead { g: 9.81 };
    show(shown, "bead", (&bead, bead.state(ON_WIRE, [0.0; 2])), 3.0);
    let bead = BeadRates { g: 9.81 };
    show(
        shown,
        "bead by rates",
        (&bead, bead.state(ON_WIRE, [0.0; 2])),
        3.0,
    );
    let wire = MovingWire { g: 9.81, c: 0.3 };
    let v = [0.1, 0.1 * 1.2_f64.powi(3) + 1.2_f64.powi(4) / 20.0];
    show(shown, "moving wire", (&wire, wire.state(ON_WIRE, v)), 3.0);
    let top = QuaternionTop::TABLE;
    show(shown, "top", (&top, top.tilted()), 1.0);
    let blade = KnifeEdge::TABLE;
    show(shown, "blade", (&blade, blade.turning(1.0)), 3.0);
    let ground = MovingGround { c: 0.1 };
    let start = ground.state([0.0; 3], [1.0, 0.0, 0.5]);
    show(shown, "ground", (&ground, start), 3.0);
    let (plate, start) = plate();
    show(shown, "plate", (&plate, start), 3.0);
    show(shown, SQUEEZER, (&Andrews, Andrews.at_rest()), 0.01);
    let start = CRANK.turning(0.7, 1.3);
    show(shown, "slider-crank", (&CRANK, start), 3.0);
    let start = rod.state([0.6, -0.8], [4.0, 3.0]);
    show(shown, "fast rod", (&rod, start), 3.0);
}

#[test]
fn errors_fall_until_they_are_roundings() {
    struct Falls;
    impl Shown for Falls {
        fn of<const N: usize>(&self, name: &str, mechanism: &dyn Moves<N>, _: f64) {
            let largest = if name == SQUEEZER { 1e-4 } else { 0.1 };
            falls(name, mechanism, largest);
        }
    }
    each(&Falls);
}

/// Steps that are far too long: the run is close to the motion, or warns that it may not be, or ends with an error if
/// the mechanism rotates by more than half a radian within the shortest piece into which a step is cut.
fn long_steps_run_or_are_too_long(which: fn(&str) -> bool) {
    /// The number of steps in each run; one for Andrews' squeezer, which rotates a thousand times per second.
    const COUNT: u32 = 4;
    /// Relative to the largest coordinate: the error that an element with few nodes may have with a step of a third of
    /// a period. Wrong roots differ by the size of the mechanism.
    const NEAR: f64 = 0.2;
    /// Relative to the step size.
    const SHORTEST_PIECE: f64 = 1.0 / 1024.0;
    #[derive(Default)]
    struct Counts {
        runs: u32,
        cut: u32,
        warned: u32,
        refused: u32,
    }
    struct Long {
        which: fn(&str) -> bool,
        counts: RefCell<Counts>,
    }
    impl Shown for Long {
        fn of<const N: usize>(&self, name: &str, mechanism: &dyn Moves<N>, span: f64) {
            if !(self.which)(name) {
                return;
            }
            let is_fast = name == SQUEEZER;
            // The squeezer has turned fast enough for errors long before the end of the shorter of its steps.
            let (count, known, short) = if is_fast {
                (1, 0.1, 1e-4)
            } else {
                (COUNT, f64::from(COUNT), span / 300.0)
            };
            // Steps of the squeezer are cut into a thousand pieces each: use only two of them, with four elements.
            let (all, few) = ([1.0, 0.7, 0.5, 0.3, 0.2, 0.1], [1.0, 0.1]);
            let steps = if is_fast { &few[..] } else { &all };
            let (all, few) = ([3, 4, 5, 6, 7, 8], [3, 5, 6, 8]);
            let elements = if is_fast { &few[..] } else { &all };
            let exact = mechanism.run(Element::mixed(5), short, known);
            let exact = exact.expect("a run");
            // The largest rotation within a time, as far as the motion is known.
            let turns = |within: f64, step: f64| {
                let nodes = exact.states().iter().filter(|node| node.t <= step);
                let pairs = nodes.clone().zip(nodes.skip(1));
                let speeds = pairs.map(|(from, to)| distance(&from.q, &to.q) / (to.t - from.t));
                within * speeds.fold(0.0, larger)
            };
            let mut counts = self.counts.borrow_mut();
            for &step in steps {
                for &nodes in elements {
                    counts.runs += 1;
                    let run = mechanism.run(Element::mixed(nodes), step, f64::from(count) * step);
                    let motion = match run {
                        Ok(motion) => motion,
                        Err(error) => {
                            counts.refused += 1;
                            let turned = turns(SHORTEST_PIECE * step, step);
                            assert!(
                                turned > 0.5,
                                "{name}, {nodes} {step}: {error}, {turned} a piece"
                            );
                            continue;
                        }
                    };
                    let recorded = || motion.states().iter();
                    let size = recorded().flat_map(|node| node.q);
                    let size = size.fold(0.0, |size: f64, q| larger(size, q.abs()));
                    let off = recorded().map(|node| {
                        let there = exact.at(node.t).expect("in the span");
                        distance(&node.q, &there.q)
                    });
                    let off = off.fold(0.0, larger) / size;
                    let (is_cut, is_warned) =
                        (motion.statistics().cuts > 0, !motion.warnings().is_empty());
                    assert!(
                        off < NEAR || is_warned,
                        "{name}, {nodes} {step}: off by {off:.1e} without a word, cut: {is_cut}"
                    );
                    counts.cut += u32::from(is_cut);
                    counts.warned += u32::from(is_warned);
                }
            }
        }
    }
    let all = Long {
        which,
        counts: RefCell::default(),
    };
    each(&all);
    let Counts {
        runs,
        cut,
        warned,
        refused,
    } = all.counts.into_inner();
    println!(
        "{runs} runs, {cut} with steps that were cut, {warned} with a warning, {refused} errors"
    );
    assert!(runs > 0);
}

// Parts of one test, so that they run in parallel: by mechanisms, so that the motion of each is computed once.
#[test]
fn long_steps_of_points_run_or_are_too_long() {
    long_steps_run_or_are_too_long(|name| POINTS.contains(&name));
}

#[test]
fn long_steps_of_bodies_run_or_are_too_long() {
    long_steps_run_or_are_too_long(|name| name != SQUEEZER && !POINTS.contains(&name));
}

#[test]
fn long_steps_of_the_squeezer_run_or_are_too_long() {
    long_steps_run_or_are_too_long(|name| name == SQUEEZER);
}

/// The cost of all runs for an accuracy, in evaluations of kernels, compared with a run with the fewest equal steps of
/// the same element that meets the accuracy from there on. It is at most three times that on six mechanisms, and a
/// little more on others, where a pair of runs had to be abandoned shortly before its end.
#[test]
fn accuracies_take_a_few_times_the_best_by_hand() {
    /// Only a few steps are enough there, which a search cannot know.
    const SHORT: [&str; 2] = ["top", "blade"];
    const THRICE: [&str; 6] = ["rod", "bead", "moving wire", "ground", "plate", "fast rod"];
    /// A run that was nearly accurate enough is repeated.
    const MAX: f64 = 4.0;
    struct Work {
        /// The number of estimates within a factor of two, and of all.
        sharp: Cell<(u32, u32)>,
        /// The number of runs with at most three times the least work.
        good: Cell<u32>,
    }
    impl Shown for Work {
        fn of<const N: usize>(&self, name: &str, mechanism: &dyn Moves<N>, span: f64) {
            let exact = mechanism.run(Element::mixed(8), span / 400.0, span);
            let exact = exact.expect("a run");
            let work = |statistics: &Statistics| {
                statistics.residual_evaluations + statistics.tangent_evaluations
            };
            let is_thrice = THRICE.contains(&name);
            let mut worst = 0.0;
            for accuracy in [1e-3, 1e-6, 1e-9] {
                let what = format!("{name:14} {accuracy:e}");
                let motion = mechanism.run_accurately(accuracy, span);
                let motion = motion.unwrap_or_else(|error| panic!("{what}: {error}"));
                let error = largest_error(motion.motion(), &exact);
                let estimate = motion.error_estimate();
                assert!(
                    error < accuracy && estimate <= accuracy,
                    "{what}: {error:e}, {estimate:e}"
                );
                assert!(error < 2.0 * estimate, "{what}: {error:e}, {estimate:e}");
                assert!(
                    !is_thrice || estimate < 2.0 * error,
                    "{what}: {error:e}, {estimate:e}"
                );
                let (sharp, all) = self.sharp.get();
                self.sharp
                    .set((sharp + u32::from(estimate < 2.0 * error), all + 1));
                let picked = motion.picked().expect("picked");
                let made = |count: u64| {
                    let how = (picked.element, span / count as f64);
                    let motion = mechanism.run_within(1e-3 * accuracy, how, span).ok()?;
                    (largest_error(&motion, &exact) < accuracy).then(|| work(motion.statistics()))
                };
                let (enough, least) = fewest(&made);
                let ratio = work(&picked.work) as f64 / least as f64;
                println!(
                    "{what}: {} steps of {}, all runs {:.2} of {enough} steps; error {error:.1e}, estimate {estimate:.1e}",
                    motion.statistics().steps,
                    picked.element,
                    ratio
                );
                worst = larger(worst, ratio);
                self.good.set(self.good.get() + u32::from(ratio <= 3.0));
            }
            let most = if is_thrice { 3.0 } else { MAX };
            assert!(worst <= most || SHORT.contains(&name), "{name}: {worst}");
        }
    }
    let all = Work {
        sharp: Cell::new((0, 0)),
        good: Cell::new(0),
    };
    each(&all);
    let (good, (sharp, all)) = (all.good.get(), all.sharp.get());
    println!("{sharp} sharp estimates and {good} cheap runs of {all}");
    assert!(3 * good >= 2 * all, "{good} of {all}");
    assert!(10 * sharp >= 9 * all, "{sharp} of {all}");
}

/// The error at all nodes, relative to the largest coordinate or momentum.
fn largest_error<const N: usize>(motion: &Motion<N>, exact: &Motion<N>) -> f64 {
    let largest = |part: fn(&Node<N>) -> [f64; N]| {
        let size = |numbers: [f64; N]| {
            numbers
                .iter()
                .fold(0.0, |size: f64, x| larger(size, x.abs()))
        };
        let nodes = motion.states().iter();
        let off = nodes.clone().map(|node| {
            let there = exact.at(node.t).expect("in the span");
            distance(&part(node), &part(&there))
        });
        off.fold(0.0, larger) / nodes.map(|node| size(part(node))).fold(0.0, larger)
    };
    larger(largest(|node| node.q), largest(|node| node.p))
}

/// The fewest steps of a run that is good, as are those of one and of two steps more, and its work.
fn fewest(made: &dyn Fn(u64) -> Option<u64>) -> (u64, u64) {
    // Three successive numbers of steps must meet the accuracy: not only by chance.
    let meets = |count: u64| (count..count + 3).all(|count| made(count).is_some());
    let (mut too_few, mut enough) = (0, 1);
    while !meets(enough) {
        (too_few, enough) = (enough, 2 * enough);
    }
    while enough - too_few > 1 {
        let middle = u64::midpoint(too_few, enough);
        if meets(middle) {
            enough = middle;
        } else {
            too_few = middle;
        }
    }
    (enough, made(enough).expect("it was made"))
}

/// An iteration that starts from the result of another one for the same step ends after two increments, at the same
/// state; from the result of another number of nodes, it ends sooner than by itself.
#[test]
fn what_one_element_has_found_serves_another() {
    struct Serves;
    impl Shown for Serves {
        fn of<const N: usize>(&self, name: &str, mechanism: &dyn Moves<N>, span: f64) {
            let step =
                |nodes: usize, trail: &Trail| mechanism.second_step(nodes, span / 60.0, trail);
            let alone = step(5, &Trail::new());
            let trail = &alone.trail;
            let off = |one: &State<N>, other: &State<N>| {
                distance(&one.q, &other.q) + distance(&one.p, &other.p)
            };
            let again = step(5, trail);
            let apart = off(&again.end, &alone.end);
            assert!(apart < 1e-10, "{name}: {apart:e}");
            let (few, many) = (again.iterations, alone.iterations);
            assert!(few <= 2, "{name}: {few} of {many}");
            let (alone, again) = (step(6, &Trail::new()), step(6, trail));
            let apart = off(&again.end, &alone.end);
            assert!(apart < 1e-10, "{name}: {apart:e}");
            let (few, many) = (again.iterations, alone.iterations);
            assert!(few <= many, "{name}: {few} of {many}");
            println!("{name:14} {many} iterations, {few} with what was found");
        }
    }
    each(&Serves);
}
