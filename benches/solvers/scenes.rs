//! The models, each with solvers of four and of nine nodes, and how they are run.

#[cfg(target_arch = "x86_64")]
use crate::by_hand::{self, CoupledStepper, SecondOrderStepper};
use crate::{Failure, Run, Scene, Writer};
use std::hint::black_box;
use std::time::Instant;
use tfe::prelude::*;
use tfe::runtime::Model;
use tfe::runtime::step::{Control, Stepper};

/// A pendulum with unit length, mass and gravity.
#[dynamics(
    coordinates(theta),
    lagrangian = dot(theta)^2/2 + cos(theta),
    solver(Pendulum4, Mixed::<4>),
    solver(Pendulum9, Mixed::<9>),
)]
pub struct Pendulum {}

/// Two unit masses on two unit rods.
#[dynamics(
    coordinates(a, b),
    lagrangian = dot(a)^2 + dot(b)^2/2 + dot(a)*dot(b)*cos(a - b) + g*(2*cos(a) + cos(b)),
    solver(DoublePendulum4, Mixed::<4>),
    solver(DoublePendulum9, Mixed::<9>),
)]
pub struct DoublePendulum {
    pub g: f64,
}

#[dynamics(
    coordinates(x, y),
    lagrangian = (dot(x)^2 + dot(y)^2)/2 + 1/sqrt(x^2 + y^2),
    solver(Kepler4, Mixed::<4>),
    solver(Kepler9, Mixed::<9>),
)]
pub struct Kepler {}

#[dynamics(
    coordinates(x, y),
    momenta(px, py),
    hamiltonian = (px^2 + py^2 + x^2 + y^2)/2 + x^2*y - y^3/3,
    solver(HenonHeiles4, Mixed::<4>),
    solver(HenonHeiles9, Mixed::<9>),
)]
pub struct HenonHeiles {}

/// Bodies that attract each other.
#[dynamics(
    coordinates(x[6], y[6], z[6]),
    lagrangian = sum(i in 0..6, m[i]/2*(dot(x[i])^2 + dot(y[i])^2 + dot(z[i])^2))
        + sum(i in 1..6, sum(j in 0..i, g*m[i]*m[j]/sqrt((x[i] - x[j])^2 + (y[i] - y[j])^2 + (z[i] - z[j])^2))),
    solver(Planets4, Mixed::<4>),
    solver(Planets9, Mixed::<9>),
)]
pub struct Planets {
    pub g: f64,
    pub m: [f64; 6],
}

/// Unit masses between walls, with springs of force δ + α δ².
#[dynamics(
    coordinates(q[32]),
    lagrangian = sum(i in 0..32, dot(q[i])^2/2) - sum(i in 0..31, (q[i+1] - q[i])^2/2 + alpha/3*(q[i+1] - q[i])^3)
        - (q[0]^2/2 + alpha/3*q[0]^3) - (q[31]^2/2 - alpha/3*q[31]^3),
    solver(Fput4, Mixed::<4>),
    solver(Fput9, Mixed::<9>),
)]
pub struct Fput {
    pub alpha: f64,
}

#[dynamics(
    coordinates(x),
    lagrangian = dot(x)^2/2 - x^2/2,
    force(x) = mu*(1 - x^2)*dot(x),
    solver(VanDerPol4, Mixed::<4>),
    solver(VanDerPol9, Mixed::<9>),
)]
pub struct VanDerPol {
    pub mu: f64,
}

/// A heavy top about a fixed point: moments of inertia `a`, `a`, `c`, weight times distance `w`, Euler angles.
#[dynamics(
    coordinates(phi, theta, psi),
    lagrangian = a/2*(dot(theta)^2 + (dot(phi)*sin(theta))^2) + c/2*(dot(psi) + dot(phi)*cos(theta))^2 - w*cos(theta),
    solver(HeavyTop4, Mixed::<4>),
    solver(HeavyTop9, Mixed::<9>),
)]
pub struct HeavyTop {
    pub a: f64,
    pub c: f64,
    pub w: f64,
}

/// A run of the general stepper.
fn general<M, const N: usize>(
    model: &M,
    element: Element,
    (start, h): (State<N>, f64),
    steps: u32,
) -> Result<Run, Failure>
where
    M: Model<N>,
{
    let mut stepper = Stepper::new(model, element, Control::default())?.ends_only();
    let mut state = black_box(start);
    let clock = Instant::now();
    for step in 0..steps {
        stepper.advance(h * f64::from(step), h, &mut state, &[])?;
    }
    let time = clock.elapsed();
    Ok(Run {
        end: state.q.to_vec(),
        iterations: stepper.statistics().iterations,
        time,
    })
}

/// A scene: name, model, initial state; the emitted solver, its number of nodes and its step; the stepper written by
/// hand, and whether it starts from velocities or momenta.
macro_rules! scene {
    ($name:literal, $model:expr, $start:expr, $solver:ident $nodes:literal, $h:literal, $stepper:ident of $hand:expr, $second:expr) => {
        Scene {
            name: $name,
            nodes: $nodes,
            run: Box::new(|writer, steps| {
                let (model, start, h) = ($model, $start, $h);
                match writer {
                    Writer::General => {
                        general(&model, Mixed::<$nodes>.into(), (start, h), steps).map(Some)
                    }
                    Writer::Emitted => {
                        let mut solver = $solver::new(&model, h);
                        let mut state = black_box(start);
                        let clock = Instant::now();
                        for _ in 0..steps {
                            solver.advance(&mut state)?;
                        }
                        let time = clock.elapsed();
                        let iterations = solver.statistics().iterations;
                        Ok(Some(Run {
                            end: state.q.to_vec(),
                            iterations,
                            time,
                        }))
                    }
                    #[cfg(target_arch = "x86_64")]
                    Writer::Hand => {
                        const POINTS: usize = $nodes - 1;
                        let Some(isa) = by_hand::V3::try_new() else {
                            return Ok(None);
                        };
                        let second = $second;
                        let mut stepper = $stepper::<_, _, POINTS, { POINTS.div_ceil(4) }>::new(
                            isa,
                            $hand,
                            h,
                            black_box((start.q, second)),
                        );
                        let clock = Instant::now();
                        for _ in 0..steps {
                            if !stepper.advance() {
                                return Err("the stepper written by hand failed".into());
                            }
                        }
                        let time = clock.elapsed();
                        Ok(Some(Run {
                            end: stepper.q.to_vec(),
                            iterations: stepper.iterations,
                            time,
                        }))
                    }
                    #[cfg(not(target_arch = "x86_64"))]
                    Writer::Hand => Ok(None),
                }
            }),
            reference: Box::new(|steps| {
                let (model, start) = ($model, $start);
                Ok(general(&model, Mixed::<12>.into(), (start, 0.5 * $h), 2 * steps)?.end)
            }),
        }
    };
}

const DOUBLE_PENDULUM: DoublePendulum = DoublePendulum { g: 9.81 };
const TOP: HeavyTop = HeavyTop {
    a: 1.4,
    c: 0.6,
    w: 5.0,
};
const FPUT: Fput = Fput { alpha: 0.25 };
const VAN_DER_POL: VanDerPol = VanDerPol { mu: 1.0 };

/// The Sun with the inner planets, Jupiter, Saturn, Uranus, Neptune and Pluto: astronomical units, days, solar masses.
/// [Hairer, Lubich, Wanner, Geometric Numerical Integration, I.2.4]
const PLANETS: Planets = Planets {
    g: 2.959_122_082_86e-4,
    m: [
        1.000_005_976_82,
        0.000_954_786_104_043,
        0.000_285_583_733_151,
        0.000_043_727_316_454_6,
        0.000_051_775_913_844_9,
        1.0 / 1.3e8,
    ],
};
const PLACES: [f64; 18] = [
    0.0,
    -3.502_365_3,
    9.075_531_4,
    8.310_142_0,
    11.470_766_6,
    -15.538_735_7, //
    0.0,
    -3.816_984_7,
    -3.045_835_3,
    -16.290_108_6,
    -25.729_482_9,
    -25.222_559_4, //
    0.0,
    -1.550_796_3,
    -1.648_370_8,
    -7.252_127_8,
    -10.816_945_6,
    -3.190_238_2,
];
const SPEEDS: [f64; 18] = [
    0.0,
    0.005_654_29,
    0.001_683_18,
    0.003_541_78,
    0.002_889_30,
    0.002_767_25, //
    0.0,
    -0.004_124_90,
    0.004_835_25,
    0.001_371_02,
    0.001_145_27,
    -0.001_707_02, //
    0.0,
    -0.001_905_89,
    0.001_924_62,
    0.000_550_29,
    0.000_396_77,
    -0.001_365_04,
];

fn first_mode() -> State<32> {
    let mut q = [0.0; 32];
    for (i, q) in q.iter_mut().enumerate() {
        *q = (std::f64::consts::PI * (i + 1) as f64 / 33.0).sin();
    }
    FPUT.state(q, [0.0; 32])
}

/// All scenes, each with four and with nine nodes.
pub fn all() -> Vec<Scene> {
    macro_rules! both {
        ($($name:literal, $model:expr, $start:expr, [$four:ident $h4:literal, $nine:ident $h9:literal], $stepper:ident of $hand:expr, $second:expr;)*) => {
            vec![$(
                scene!($name, $model, $start, $four 4, $h4, $stepper of $hand, $second),
                scene!($name, $model, $start, $nine 9, $h9, $stepper of $hand, $second),
            )*]
        };
    }
    both! {
        "pendulum", Pendulum {}, Pendulum {}.state([1.5], [0.0]),
            [Pendulum4 0.1, Pendulum9 1.0], SecondOrderStepper of by_hand::Pendulum, [0.0];
        "double-pendulum", DOUBLE_PENDULUM, DOUBLE_PENDULUM.state([0.5, -0.3], [0.0, 0.0]),
            [DoublePendulum4 0.01, DoublePendulum9 0.1], CoupledStepper of by_hand::DoublePendulum { g: 9.81 }, [0.0; 2];
        "kepler", Kepler {}, Kepler {}.state([0.4, 0.0], [0.0, 2.0]),
            [Kepler4 0.02, Kepler9 0.2], SecondOrderStepper of by_hand::Kepler, [0.0, 2.0];
        "henon-heiles", HenonHeiles {}, State { q: [0.1, 0.0], p: [0.0, 0.5] },
            [HenonHeiles4 0.1, HenonHeiles9 1.0], SecondOrderStepper of by_hand::HenonHeiles, [0.0, 0.5];
        "planets", PLANETS, PLANETS.state(PLACES, SPEEDS),
            [Planets4 20.0, Planets9 200.0], SecondOrderStepper of by_hand::Planets { g: PLANETS.g, m: PLANETS.m }, SPEEDS;
        "fput", FPUT, first_mode(),
            [Fput4 0.05, Fput9 0.25], SecondOrderStepper of by_hand::Fput { alpha: 0.25 }, [0.0; 32];
        "van-der-pol", VAN_DER_POL, VAN_DER_POL.state([2.0], [0.0]),
            [VanDerPol4 0.02, VanDerPol9 0.2], SecondOrderStepper of by_hand::VanDerPol { mu: 1.0 }, [0.0];
        "heavy-top", TOP, TOP.state([0.0, 0.7, 0.0], [0.5, 0.0, 12.0]),
            [HeavyTop4 0.01, HeavyTop9 0.1], CoupledStepper of by_hand::HeavyTop { a: 1.4, c: 0.6, w: 5.0 }, TOP.state([0.0, 0.7, 0.0], [0.5, 0.0, 12.0]).p;
    }
}
