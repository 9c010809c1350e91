//! The recorded cases: models, elements and ways to solve, runs of all kinds, ensembles, orbits, boundary-value
//! problems, models of run-time length.

mod models;
mod runs;

#[cfg(feature = "sparse")]
use models::HangingChain;
use models::{
    BLADE, Chain, Curved, DOUBLE, DUFFING, DoublePendulum, Gyroscopic, HenonHeiles, Kepler,
    PENDULUM, ROD, TOP, VanDerPol,
};
use runs::{emitted, ways_to_run};
use std::f64::consts::{PI, TAU};
use tfe::ensemble::{Ends, EnsembleError};
use tfe::prelude::*;
use tfe::{Statistics, stability};

/// The numbers computed by one case, and its cost.
#[derive(Default)]
pub struct Outcome {
    pub numbers: Vec<f64>,
    pub counts: Vec<u64>,
}

impl Outcome {
    fn with(numbers: impl IntoIterator<Item = f64>, statistics: &Statistics) -> Self {
        Self {
            numbers: numbers.into_iter().collect(),
            counts: vec![
                statistics.steps,
                statistics.fixed_point_iterations,
                statistics.newton_iterations,
                statistics.residual_evaluations,
                statistics.tangent_evaluations,
                statistics.factorizations,
                statistics.fallbacks,
                statistics.cuts,
                statistics.kinks,
                statistics.products,
            ],
        }
    }

    fn of<const N: usize>(motion: &Motion<N>) -> Self {
        let end = motion.last();
        let numbers = [end.t].into_iter().chain(end.q).chain(end.p).chain(end.v);
        let energy = motion.energies().last().copied();
        Self::with(numbers.chain(energy), motion.statistics())
    }
}

/// A case: a computation with a name.
pub struct Case {
    pub name: String,
    pub run: Box<dyn Fn() -> Outcome>,
}

/// All families of elements, with few and with many nodes.
fn elements() -> Vec<Element> {
    vec![
        Element::mixed(2),
        Element::mixed(4),
        Element::mixed(6),
        Element::mixed(9),
        Element::primal(3),
        Element::primal(4).reduced(),
        Element::primal(4).lobatto(),
        Element::from(ThreeField::<4>),
        Element::energy_conserving(3),
        Element::radau(3),
        Element::radau(5),
    ]
}

/// The elements that support constraints.
fn elements_with_constraints() -> Vec<Element> {
    vec![
        Element::mixed(3),
        Element::mixed(6),
        Element::primal(4).reduced(),
        Element::from(ThreeField::<4>),
    ]
}

/// The list of cases, filled group by group.
#[derive(Default)]
struct List(Vec<Case>);

impl List {
    fn add(&mut self, name: impl Into<String>, run: impl Fn() -> Outcome + 'static) {
        self.0.push(Case {
            name: name.into(),
            run: Box::new(run),
        });
    }

    /// Twenty steps with each element, and the transition matrix of one step.
    fn runs<M: Model<N> + 'static, const N: usize>(
        &mut self,
        name: &str,
        model: &'static M,
        start: State<N>,
        h: f64,
        elements: Vec<Element>,
    ) {
        for element in elements {
            let simulation = Simulation::new(model).element(element).step(h);
            for (how, solve) in [("", Solve::Auto), (", Newton", Solve::Newton)] {
                let simulation = simulation.clone().solver(solve);
                self.add(format!("{name}, {element}{how}"), move || {
                    Outcome::of(&ran(simulation.run(start, 0.0..20.0 * h)))
                });
            }
            self.add(format!("{name}, {element}, transition matrix"), move || {
                let matrix = stability::transition_matrix(model, element, &start, 0.0, h);
                let entries = matrix.map_or_else(|_| Vec::new(), |a| a.iter().copied().collect());
                Outcome::with(entries, &Statistics::default())
            });
        }
    }
}

/// The numbers of a motion, or of the part of it before a failure.
fn ran<const N: usize>(run: Result<Motion<N>, tfe::RunError<N>>) -> Motion<N> {
    run.unwrap_or_else(tfe::RunError::into_partial)
}

/// The same for a model of run-time length.
fn ran_family(run: Result<tfe::family::Motion, tfe::family::RunError>) -> Outcome {
    let motion = run.unwrap_or_else(tfe::family::RunError::into_partial);
    let end = motion.last();
    let numbers = [end.t]
        .into_iter()
        .chain(end.q.clone())
        .chain(end.p.clone());
    Outcome::with(
        numbers.chain(motion.energies().last().copied()),
        motion.statistics(),
    )
}

/// All cases.
pub fn all() -> Vec<Case> {
    let mut list = List::default();
    models(&mut list);
    ways_to_run(&mut list);
    emitted(&mut list);
    ensembles(&mut list);
    assembled(&mut list);
    families(&mut list);
    list.0
}

fn models(list: &mut List) {
    let start = PENDULUM.state([1.2], [0.3]);
    list.runs("pendulum", &PENDULUM, start, 0.05, elements());
    let start = DOUBLE.state([0.9, -0.4], [0.2, 0.5]);
    list.runs("double pendulum", &DOUBLE, start, 0.03, elements());
    let start = State {
        q: [0.1, 0.2],
        p: [0.3, 0.1],
    };
    list.runs("Hénon–Heiles", &HenonHeiles, start, 0.2, elements());
    let start = Kepler.state([0.7, 0.0], [0.0, 1.3]);
    list.runs("Kepler", &Kepler, start, 0.05, elements());
    let start = DUFFING.state([0.5], [0.1]);
    list.runs("Duffing", &DUFFING, start, 0.1, elements());
    static CURVED: Curved = Curved { a: 0.3 };
    let start = State {
        q: [0.4, -0.2],
        p: [0.5, 0.3],
    };
    list.runs("curved", &CURVED, start, 0.1, elements());
    static GYROSCOPIC: Gyroscopic = Gyroscopic { w: 0.4 };
    let start = GYROSCOPIC.state([1.0, 0.2], [0.0, -0.3]);
    list.runs("gyroscopic", &GYROSCOPIC, start, 0.1, elements());
    static STIFF: VanDerPol = VanDerPol { mu: 100.0 };
    let start = STIFF.state([2.0], [0.0]);
    let stable = vec![Element::mixed(3), Element::radau(3), Element::radau(5)];
    list.runs("stiff van der Pol", &STIFF, start, 0.5, stable);
    let start = ROD.state([0.6, -0.8], [0.4, 0.3]);
    list.runs("rod", &ROD, start, 0.05, elements_with_constraints());
    let start = BLADE.state([0.0, 0.0, 0.3], [0.3_f64.cos(), 0.3_f64.sin(), 0.7]);
    list.runs("blade", &BLADE, start, 0.1, elements_with_constraints());
    let start = TOP.state([0.8, 0.6, 0.0, 0.0], [0.0, 0.0, 0.9, 1.2]);
    list.runs("top", &TOP, start, 0.05, elements_with_constraints());
}

fn ends<const N: usize>(run: Result<Ends<N>, EnsembleError>) -> Outcome {
    match run {
        Ok(ends) => {
            let nodes = ends
                .nodes()
                .flat_map(|node| node.q.into_iter().chain(node.p));
            Outcome::with(nodes.collect::<Vec<_>>(), ends.statistics())
        }
        Err(_) => Outcome::default(),
    }
}

fn ensembles(list: &mut List) {
    for element in [Element::mixed(4), Element::mixed(8), Element::radau(4)] {
        list.add(format!("ensemble of pendulums, {element}"), move || {
            let starts: Vec<_> = (0..11)
                .map(|k| PENDULUM.state([0.2 * f64::from(k)], [0.1]))
                .collect();
            ends(
                Ensemble::new(&PENDULUM)
                    .element(element)
                    .step(0.05)
                    .run(&starts, 0.0..1.0),
            )
        });
        list.add(
            format!("ensemble of double pendulums, {element}"),
            move || {
                let starts: Vec<_> = (0..11)
                    .map(|k| DOUBLE.state([0.1 * f64::from(k), -0.3], [0.1, 0.2]))
                    .collect();
                ends(
                    Ensemble::new(&DOUBLE)
                        .element(element)
                        .step(0.03)
                        .run(&starts, 0.0..0.6),
                )
            },
        );
        list.add(
            format!("ensemble of Hénon–Heiles, {element}"),
            move || {
                let start = |k: u32| State {
                    q: [0.02 * f64::from(k), 0.1],
                    p: [0.2, 0.1],
                };
                let starts: Vec<_> = (0..11).map(start).collect();
                ends(
                    Ensemble::new(&HenonHeiles)
                        .element(element)
                        .step(0.2)
                        .run(&starts, 0.0..4.0),
                )
            },
        );
        list.add(format!("ensemble of curved, {element}"), move || {
            let start = |k: u32| State {
                q: [0.05 * f64::from(k), 0.1],
                p: [0.2, 0.1],
            };
            let starts: Vec<_> = (0..11).map(start).collect();
            let model = Curved { a: 0.3 };
            ends(
                Ensemble::new(&model)
                    .element(element)
                    .step(0.1)
                    .run(&starts, 0.0..2.0),
            )
        });
    }
    list.add("ensemble of parameter sets", || {
        let models: Vec<_> = (0..11)
            .map(|k| DoublePendulum {
                m2: 0.5 + 0.1 * f64::from(k),
                ..DOUBLE
            })
            .collect();
        let start = DOUBLE.state([0.9, -0.4], [0.0, 0.0]);
        ends(
            Ensemble::of_models(&models)
                .element(Mixed::<4>)
                .step(0.03)
                .run(&[start], 0.0..0.6),
        )
    });
}

/// Orbits and boundary-value problems.
fn assembled(list: &mut List) {
    list.add("orbit of a driven oscillator", || {
        let orbit = PeriodicOrbit::of(&DUFFING)
            .element(Mixed::<5>)
            .elements(20)
            .period(TAU / DUFFING.w)
            .guess(|t| {
                (
                    [0.5 * (DUFFING.w * t).cos()],
                    [-0.5 * DUFFING.w * (DUFFING.w * t).sin()],
                )
            })
            .solve();
        orbit.map_or_else(
            |_| Outcome::default(),
            |orbit| {
                let monodromy = orbit.monodromy();
                let numbers = monodromy.iter().copied().chain([orbit.period()]);
                Outcome::with(numbers.collect::<Vec<_>>(), &Statistics::default())
            },
        )
    });
    list.add("limit cycle", || {
        let model = VanDerPol { mu: 1.0 };
        let orbit = PeriodicOrbit::of(&model)
            .element(Mixed::<6>)
            .elements(30)
            .unknown_period(6.6)
            .guess(|t| ([2.0 * t.cos()], [-2.0 * t.sin()]))
            .solve();
        orbit.map_or_else(
            |_| Outcome::default(),
            |orbit| {
                let monodromy = orbit.monodromy();
                let numbers = monodromy.iter().copied().chain([orbit.period()]);
                Outcome::with(numbers.collect::<Vec<_>>(), &Statistics::default())
            },
        )
    });
    list.add("boundary values", || {
        let arc = BoundaryValue::of(&PENDULUM)
            .element(Mixed::<6>)
            .elements(20)
            .from_to([0.0], [PI / 2.0], 0.0..0.4)
            .solve();
        arc.map_or_else(
            |_| Outcome::default(),
            |arc| {
                let numbers = arc.start().p.into_iter().chain(arc.motion().last().p);
                Outcome::with(numbers.collect::<Vec<_>>(), &Statistics::default())
            },
        )
    });
}

fn families(list: &mut List) {
    static CHAIN: Chain = Chain {
        n: 41,
        m: 1.2,
        k: 1.0,
        a: 0.25,
    };
    let q: Vec<f64> = (0..CHAIN.n).map(|i| 0.4 * (0.3 * i as f64).cos()).collect();
    let start = CHAIN.state(q, vec![0.0; CHAIN.n]);
    let mut elements = vec![
        Element::mixed(3),
        Element::mixed(4),
        Element::mixed(9),
        Element::radau(3),
    ];
    if cfg!(feature = "sparse") {
        elements.extend([Element::primal(4).lobatto(), Element::energy_conserving(3)]);
    }
    for element in elements {
        let simulation = Simulation::new(&CHAIN).element(element).step(0.1);
        let (run, start) = (simulation.clone(), start.clone());
        list.add(format!("chain, {element}"), move || {
            ran_family(run.run(start.clone(), 0.0..2.0))
        });
    }
    #[cfg(feature = "sparse")]
    {
        let simulation = Simulation::new(&CHAIN).element(Mixed::<4>).step(0.1);
        let simulation = simulation.solver(Solve::Newton);
        list.add("chain, sparse Newton", move || {
            ran_family(simulation.run(start.clone(), 0.0..2.0))
        });
        static HANGING: HangingChain = HangingChain { n: 12, g: 9.81 };
        let x: Vec<f64> = (1..=HANGING.n).map(|i| i as f64).collect();
        let y = vec![0.0; HANGING.n];
        let q = [x, y].concat();
        let start = HANGING.state(q, vec![0.0; 2 * HANGING.n]);
        for element in [Element::mixed(3), Element::mixed(5)] {
            let simulation = Simulation::new(&HANGING).element(element).step(0.02);
            let start = start.clone();
            list.add(format!("hanging chain, {element}"), move || {
                ran_family(simulation.run(start.clone(), 0.0..0.4))
            });
        }
    }
}
