//! How much each property that `structure()` finds in a model is worth: the same model with and without it.

use crate::scenes::Start;
use crate::scenes::lattice::{LATTICE, lattice_start};
use crate::scenes::oscillators::{
    DOUBLE_PENDULUM, DOUBLE_PENDULUM_START, HENON_HEILES_START, HenonHeiles,
};
use crate::scenes::stiff::{ELASTIC, ELASTIC_START};
use std::error::Error;
use std::hint::black_box;
use std::time::{Duration, Instant};
use tfe::charts::Section;
use tfe::prelude::*;
use tfe::runtime::model::{Facts, First, Form, Second};
use tfe::runtime::step::{Control, Stepper};
use tfe::runtime::structure::Operations;
use tfe::runtime::{CoordinateName, Real, legendre};
use tfe::stability::LinearModel;

const LINEAR: u8 = 0;
const AUTONOMOUS: u8 = 1;
const CONSTANT_MASS: u8 = 2;
const SEPARABLE: u8 = 3;
const QUADRATIC: u8 = 4;
const FREE: u8 = 5;

/// A model of which one property is withheld from the runtime.
struct Unaware<'m, M, const WHAT: u8>(&'m M);

const fn without(what: u8, known: Facts) -> Facts {
    Facts {
        linear: known.linear && what != LINEAR,
        time_dependent: known.time_dependent || what == AUTONOMOUS,
        constant_mass: known.constant_mass && what != CONSTANT_MASS,
        separable: known.separable && what != SEPARABLE,
        smooth: known.smooth,
        quadratic_in_z: known.quadratic_in_z && what != QUADRATIC,
        forced: known.forced || what == FREE,
    }
}

impl<M: Model<N>, const N: usize, const WHAT: u8> Model<N> for Unaware<'_, M, WHAT> {
    const FORM: Form = M::FORM;
    const FACTS: Facts = without(WHAT, M::FACTS);
    const LANES: bool = M::LANES;

    fn energy_function<R: Real>(&self, t: R, q: &[R; N], z: &[R; N]) -> R {
        self.0.energy_function(t, q, z)
    }

    fn first<R: Real>(&self, t: R, q: &[R; N], z: &[R; N], first: &mut First<R, N>) {
        self.0.first(t, q, z, first);
    }

    fn first_and_mass<R: Real>(
        &self,
        t: R,
        q: &[R; N],
        z: &[R; N],
        first: &mut First<R, N>,
        zz: &mut [[R; N]; N],
    ) {
        self.0.first_and_mass(t, q, z, first, zz);
    }

    #[inline(always)]
    fn first_inline<R: Real>(&self, t: R, q: &[R; N], z: &[R; N], first: &mut First<R, N>) {
        self.0.first_inline(t, q, z, first);
    }

    #[inline(always)]
    fn first_and_mass_inline<R: Real>(
        &self,
        t: R,
        q: &[R; N],
        z: &[R; N],
        first: &mut First<R, N>,
        zz: &mut [[R; N]; N],
    ) {
        self.0.first_and_mass_inline(t, q, z, first, zz);
    }

    fn second<R: Real>(
        &self,
        t: R,
        q: &[R; N],
        z: &[R; N],
        first: &mut First<R, N>,
        second: &mut Second<R, N>,
    ) {
        self.0.second(t, q, z, first, second);
    }

    fn coordinate_name(index: usize) -> CoordinateName {
        M::coordinate_name(index)
    }
}

/// A row of masses and springs between walls; linear.
#[dynamics(
    coordinates(q[20]),
    lagrangian = sum(i in 0..20, dot(q[i])^2/2) - k/2*(q[0]^2 + q[19]^2) - sum(i in 0..19, k/2*(q[i+1] - q[i])^2),
)]
struct Row {
    k: f64,
}

/// A row of masses with stiffening springs; and the same with a tiny coupling of the inertia of two masses, so that its
/// mass matrix is constant but not diagonal.
#[dynamics(
    coordinates(q[24]),
    lagrangian = sum(i in 0..24, dot(q[i])^2/2) - sum(i in 0..23, (q[i+1] - q[i])^2/2 + (q[i+1] - q[i])^4/4),
)]
struct Diagonal;

#[dynamics(
    coordinates(q[24]),
    lagrangian = sum(i in 0..24, dot(q[i])^2/2) + 1e-12*dot(q[0])*dot(q[1]) - sum(i in 0..23, (q[i+1] - q[i])^2/2 + (q[i+1] - q[i])^4/4),
)]
struct Coupled;

/// A heavy top in Euler angles, with cyclic coordinates and after their elimination.
#[dynamics(
    coordinates(phi, theta, psi),
    lagrangian = a/2*(dot(theta)^2 + dot(phi)^2*sin(theta)^2) + c/2*(dot(psi) + dot(phi)*cos(theta))^2 - mgl*cos(theta),
    model(Nutation, routh(psi, phi)),
)]
struct Top {
    a: f64,
    c: f64,
    mgl: f64,
}

/// Coupled pendulums whose parameters are fields, and the same with numbers as parameters.
#[dynamics(coordinates(x, y), lagrangian = m/2*l^2*(dot(x)^2 + dot(y)^2) + m*g*l*(cos(x) + cos(y)) - k/2*l^2*(x - y)^2)]
#[allow(dead_code, reason = "its operations are counted, it does not run")]
struct ByFields {
    m: f64,
    l: f64,
    g: f64,
    k: f64,
}

#[dynamics(
    coordinates(x, y),
    let m = 1, let l = 2, let g = 9.81, let k = 0.5,
    lagrangian = m/2*l^2*(dot(x)^2 + dot(y)^2) + m*g*l*(cos(x) + cos(y)) - k/2*l^2*(x - y)^2,
)]
struct ByNumbers;

/// A measured quantity with and without a property.
struct Finding {
    found: &'static str,
    scene: &'static str,
    follows: &'static str,
    unit: &'static str,
    with: f64,
    without: f64,
}

impl Finding {
    fn cells(&self) -> [String; 6] {
        let number = |value: f64| format!("{value:.4} {}", self.unit);
        [
            self.found.to_owned(),
            self.scene.to_owned(),
            self.follows.to_owned(),
            number(self.with),
            number(self.without),
            format!("{:.2}", self.without / self.with),
        ]
    }
}

/// Timed runs of a number of steps.
#[derive(Clone, Copy)]
struct Timed {
    element: Element,
    step: f64,
}

impl Timed {
    /// The time per step in microseconds: the smallest of several measurements.
    fn of<M: Model<N>, const N: usize>(
        self,
        model: &M,
        start: State<N>,
    ) -> Result<f64, Box<dyn Error>> {
        const STEPS: u32 = 200;
        let patience = Duration::from_millis(if cfg!(debug_assertions) { 5 } else { 60 });
        let begin = Instant::now();
        let mut least = f64::INFINITY;
        while begin.elapsed() < patience || least.is_infinite() {
            let stepper = Stepper::new(model, self.element, Control::default())?;
            let (mut stepper, mut state) = (stepper.ends_only(), start);
            // The first steps compute what the later ones reuse.
            for k in 0..50 {
                stepper.advance(f64::from(k) * self.step, self.step, &mut state, &[])?;
            }
            let go = Instant::now();
            for k in 50..50 + STEPS {
                stepper.advance(f64::from(k) * self.step, self.step, &mut state, &[])?;
            }
            least = least.min(go.elapsed().as_secs_f64() / f64::from(STEPS));
            black_box(&state);
        }
        Ok(1e6 * least)
    }

    /// Times of the same model with and without one of its properties.
    fn pair<M: Model<N>, const N: usize, const WHAT: u8>(
        self,
        model: &M,
        start: State<N>,
    ) -> Result<[f64; 2], Box<dyn Error>> {
        Ok([
            self.of(model, start)?,
            self.of(&Unaware::<M, WHAT>(model), start)?,
        ])
    }
}

fn total(operations: Operations) -> f64 {
    let Operations {
        additions,
        multiplications,
        divisions,
        sines,
        functions,
    } = operations;
    f64::from(additions + multiplications + divisions + sines + functions)
}

/// The time in nanoseconds to solve for the velocity that belongs to a momentum.
fn velocity_of<M: Model<2>>(model: &M, state: &State<2>) -> f64 {
    const TIMES: u32 = 2000;
    let go = |_| {
        let begin = Instant::now();
        for _ in 0..TIMES {
            let _ = black_box(legendre::velocity(
                model,
                0.0,
                black_box(&state.q),
                &state.p,
                &[0.0; 2],
            ));
        }
        1e9 * begin.elapsed().as_secs_f64() / f64::from(TIMES)
    };
    (0..20).map(go).fold(f64::INFINITY, f64::min)
}

/// The number of non-zero second derivatives at a state, and the number of all entries.
fn filled<M: Model<N>, const N: usize>(model: &M, state: &State<N>) -> [f64; 2] {
    let (mut first, mut second) = (First::ZERO, Second::ZERO);
    model.second(0.0, &state.q, &state.p, &mut first, &mut second);
    let blocks = [&second.zz, &second.zq, &second.qq];
    let entries = blocks.into_iter().flatten().flatten();
    let filled = entries.filter(|entry| **entry != 0.0).count();
    [filled as f64, 3.0 * (N * N) as f64]
}

fn findings() -> Result<Vec<Finding>, Box<dyn Error>> {
    let mut all = Vec::new();
    let mut push = |found, scene, follows, unit, [with, without]: [f64; 2]| {
        all.push(Finding {
            found,
            scene,
            follows,
            unit,
            with,
            without,
        });
    };
    let row = Row { k: 1.0 };
    let mut bent = [0.0; 20];
    bent[3] = 1.0;
    let start = row.state(bent, [0.0; 20]);
    let timed = Timed {
        element: Element::mixed(4),
        step: 0.2,
    };
    let scene = "20 masses in a row";
    let linear = timed.pair::<_, 20, LINEAR>(&row, start)?;
    push(
        "linear",
        scene,
        "a step is one matrix–vector product",
        "µs/step",
        linear,
    );
    let autonomous = timed.pair::<_, 20, AUTONOMOUS>(&row, start)?;
    push(
        "autonomous",
        scene,
        "one matrix for all steps",
        "µs/step",
        autonomous,
    );
    let Start { q, v, .. } = lattice_start();
    let start = LATTICE.state(q, v);
    let timed = Timed {
        element: Element::mixed(5),
        step: 0.5,
    };
    let scene = "lattice of 32";
    let mass = timed.pair::<_, 32, CONSTANT_MASS>(&LATTICE, start)?;
    push(
        "constant mass matrix",
        scene,
        "inverted once; forces are the only unknowns",
        "µs/step",
        mass,
    );
    let separable = timed.pair::<_, 32, SEPARABLE>(&LATTICE, start)?;
    push(
        "separable",
        scene,
        "forces are the only unknowns",
        "µs/step",
        separable,
    );
    let entries = filled(&LATTICE, &start);
    push(
        "sparsity",
        scene,
        "second derivatives computed and stored",
        "entries",
        entries,
    );
    let Start { q, v, .. } = HENON_HEILES_START;
    let start = HenonHeiles {}.state(q, v);
    let free = timed.pair::<_, 2, FREE>(&HenonHeiles {}, start)?;
    push(
        "no forces",
        "Hénon–Heiles",
        "no velocities at the quadrature points",
        "µs/step",
        free,
    );
    let mut bent = [0.0; 24];
    bent[5] = 1.0;
    let timed = Timed { step: 0.3, ..timed };
    let diagonal = [
        timed.of(&Diagonal, Diagonal.state(bent, [0.0; 24]))?,
        timed.of(&Coupled, Coupled.state(bent, [0.0; 24]))?,
    ];
    push(
        "diagonal mass matrix",
        "24 masses, stiffening springs",
        "n multiplications instead of n²",
        "µs/step",
        diagonal,
    );
    let Start { q, v, .. } = DOUBLE_PENDULUM_START;
    let state = DOUBLE_PENDULUM.state(q, v);
    let quadratic = [
        velocity_of(&DOUBLE_PENDULUM, &state),
        velocity_of(&Unaware::<_, QUADRATIC>(&DOUBLE_PENDULUM), &state),
    ];
    push(
        "quadratic in v",
        "double pendulum",
        "the velocity of a momentum from one linear system",
        "ns",
        quadratic,
    );
    let top = Top {
        a: 1.2,
        c: 0.7,
        mgl: 2.0,
    };
    let start = top.state([0.3, 0.9, -0.2], [0.4, 0.1, 6.0]);
    let (nutation, left) = Nutation::of_state(&top, &start);
    let timed = Timed {
        element: Element::mixed(6),
        step: 0.1,
    };
    let cyclic = [timed.of(&nutation, left)?, timed.of(&top, start)?];
    push(
        "cyclic coordinates",
        "heavy top",
        "one unknown of three (`routh`)",
        "µs/step",
        cyclic,
    );
    let operations = [Nutation::structure(), Top::structure()].map(|one| total(one.first));
    push(
        "cyclic coordinates",
        "heavy top",
        "operations of the gradient",
        "operations",
        operations,
    );
    let Start { q, v, .. } = ELASTIC_START;
    let start = ELASTIC.state(q, v);
    let scales = LinearModel::about(&ELASTIC, 0.0, &start)?.time_scales()?;
    println!("\nelastic pendulum: {scales}");
    let by_time = |step: f64| -> Result<f64, Box<dyn Error>> {
        let element = Element::mixed(5);
        Ok(Timed { element, step }.of(&ELASTIC, start)? / step)
    };
    let stiff = [by_time(0.05)?, by_time(scales.newton_from())?];
    push(
        "stiff",
        "elastic pendulum, k = 10⁶",
        "steps beyond 2/|λ|, by Newton's method",
        "µs/unit of time",
        stiff,
    );
    let operations = [ByNumbers::structure(), ByFields::structure()].map(|one| total(one.first));
    push(
        "numbers as parameters",
        "two coupled pendulums",
        "folded into the constants of the gradient",
        "operations",
        operations,
    );
    Ok(all)
}

/// The table of all findings.
pub fn section() -> Result<Section, Box<dyn Error>> {
    let findings = findings()?;
    let head = [
        "property",
        "scene",
        "consequence",
        "with",
        "without",
        "ratio",
    ];
    println!(
        "\n{:27} {:29} {:>24} {:>24} {:>7}",
        head[0], head[1], head[3], head[4], head[5]
    );
    for finding in &findings {
        let [found, scene, _, with, without, ratio] = finding.cells();
        println!("{found:27} {scene:29} {with:>24} {without:>24} {ratio:>7}");
    }
    Ok(Section::new("What the properties of a model are worth")
        .paragraph(
            "Each row compares the same motion with and without a property that the macro finds: it is withheld from the runtime, or (diagonal mass matrix, cyclic coordinates, numbers as parameters) an equivalent model does not have it. For the stiff model, “without” are the steps to which fixed-point iteration is limited.",
        )
        .table(head, findings.iter().map(Finding::cells)))
}
