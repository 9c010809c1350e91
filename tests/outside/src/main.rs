//! The code of a typical user, in a crate that depends on nothing but `tfe`: it compiles and runs what the
//! documentation shows.

use std::f64::consts::TAU;
use tfe::prelude::*;

/// A double pendulum of two point masses; angles from the downward vertical, SI units.
#[dynamics(
    coordinates(theta1, theta2),
    let x1 = l1 * sin(theta1),
    let y1 = -l1 * cos(theta1),
    let x2 = x1 + l2 * sin(theta2),
    let y2 = y1 - l2 * cos(theta2),
    lagrangian = m1/2 * (dot(x1)^2 + dot(y1)^2) + m2/2 * (dot(x2)^2 + dot(y2)^2) - g * (m1*y1 + m2*y2),
    force(theta1) = -c * dot(theta1),
    output(tip_x) = x2,
)]
#[derive(Clone, Debug)]
struct DoublePendulum {
    m1: f64,
    m2: f64,
    l1: f64,
    l2: f64,
    g: f64,
    c: f64,
}

#[dynamics(coordinates(x, y), momenta(px, py),
           hamiltonian = (px^2 + py^2)/2 + (x^2 + y^2)/2 + lambda*(x^2*y - y^3/3))]
struct HenonHeiles {
    lambda: f64,
}

#[dynamics(coordinates(x), lagrangian = m/2*dot(x)^2 - k/2*x^2, dissipation = c/2*dot(x)^2,
           solver(FastOscillator, Mixed::<4>))]
struct Oscillator {
    m: f64,
    k: f64,
    c: f64,
}

/// A chain with fixed ends and a number of masses known at compile time.
#[dynamics(coordinates(q[N]),
           lagrangian = sum(i in 0..N, m/2*dot(q[i])^2) - sum(i in 0..N-1, k/2*(q[i+1]-q[i])^2 + a/3*(q[i+1]-q[i])^3)
                      - k/2*(q[0]^2 + q[N-1]^2))]
struct Chain<const N: usize> {
    m: f64,
    k: f64,
    a: f64,
}

/// A chain with free ends and a number of masses known at run time.
#[dynamics(coordinates(q[n]),
           lagrangian = sum(i in 0..n, m/2*dot(q[i])^2) - sum(i in 0..n-1, k/2*(q[i+1]-q[i])^2 + a/3*(q[i+1]-q[i])^3))]
struct LongChain {
    n: usize,
    m: f64,
    k: f64,
    a: f64,
}

#[dynamics(coordinates(x), lagrangian = dot(x)^2/2 - alpha/2*x^2 - beta/4*x^4,
           force(x) = f*cos(omega*t) - delta*dot(x), sensitivity(omega))]
#[derive(Clone)]
struct Duffing {
    alpha: f64,
    beta: f64,
    delta: f64,
    f: f64,
    omega: f64,
}

#[dynamics(coordinates(x, y), lagrangian = m/2*(dot(x)^2 + dot(y)^2) - m*g*y)]
struct Projectile {
    m: f64,
    g: f64,
}

#[dynamics(coordinates(x, y), lagrangian = m/2*(dot(x)^2 + dot(y)^2) - m*g*y, constraint(rod) = x^2 + y^2 - l^2)]
struct RodPendulum {
    m: f64,
    l: f64,
    g: f64,
}

#[dynamics(coordinates(x, y, phi), lagrangian = m/2*(dot(x)^2 + dot(y)^2) + j/2*dot(phi)^2 + m*g*sin(alpha)*x,
           constraint(blade) = dot(x)*sin(phi) - dot(y)*cos(phi))]
struct KnifeEdge {
    m: f64,
    j: f64,
    g: f64,
    alpha: f64,
}

/// A ball above the ground, with an input, an event, an output, and parameters for derivatives.
#[dynamics(
    coordinates(y),
    lagrangian = m/2*dot(y)^2 - m*g*y,
    input(u),
    force(y) = u - c*dot(y),
    event(impact) = y,
    output(height) = y,
    sensitivity(g, c),
)]
struct Ball {
    m: f64,
    g: f64,
    c: f64,
}

/// Uses events, inputs, derivatives, a control loop and a fit.
fn steered() -> Result<(), Box<dyn std::error::Error>> {
    let ball = Ball {
        m: 1.0,
        g: 9.81,
        c: 0.1,
    };
    let start = ball.state([1.0], [0.0]);
    let simulation = Simulation::new(&ball)
        .element(Mixed::<4>)
        .step(0.01)
        .on("impact", Crossing::Falling, |event| {
            Act::Restart(event.state_with_velocity([-0.8 * event.v[0]]))
        })
        .input("u", |t| 0.1 * t.sin());
    let motion = simulation.run(start, 0.0..2.0)?;
    let impact = motion.events().first().ok_or("the ball falls")?;
    assert!(impact.name == "impact" && !impact.rises && impact.v[0] < 0.0);
    assert!((impact.t - 0.45).abs() < 0.02 && impact.q[0].abs() < 1e-12 && impact.p[0] < 0.0);

    let s = simulation.run_sensitive(start, 0.0..2.0)?;
    let by_g = s.by("g").last().q[0];
    assert_eq!(s.by_start().last().nrows(), 2);
    let loss = tfe::sensitivity::Loss::at_end(|node| node.q[0]);
    let (height, gradient) = simulation.gradient(start, 0.0..2.0, &loss)?;
    assert!((height - motion.last().q[0]).abs() < 1e-12);
    assert!((gradient.by("g") - by_g).abs() < 1e-9 * (1.0 + by_g.abs()));

    let mut run = Simulation::new(&ball).step(0.01).hold(start, 0.0)?;
    for _ in 0..100 {
        let (y, v) = (run.node().q[0], run.node().v[0]);
        run.set("u", 9.81 - (y - 1.0) - 2.0 * v);
        run.advance()?;
    }
    assert!((run.node().q[0] - 1.0).abs() < 1e-12 && run.node().output("height").is_some());

    let times: Vec<f64> = (0..=20).map(|k| 0.1 * f64::from(k)).collect();
    let film = Simulation::new(&ball).step(0.1).run(start, 0.0..2.0)?;
    let measured: Vec<f64> = film.states().iter().map(|node| node.q[0]).collect();
    let guess = Ball {
        g: 9.0,
        c: 0.2,
        ..ball
    };
    let fit = Fit::new(&guess)
        .start(start, 0.0)
        .step(0.1)
        .parameters(["g", "c"])
        .output("height", &times, &measured)
        .solve()?;
    assert!((fit.value("g").ok_or("a parameter")? - 9.81).abs() < 1e-8);
    assert!(fit.covariance().nrows() == 2 && fit.residuals().len() == times.len());
    Ok(())
}

/// Uses ensembles, runs with an accuracy, and comparisons.
fn compared(pendulum: &DoublePendulum, start: State<2>) -> Result<(), Box<dyn std::error::Error>> {
    let ends = Ensemble::new(pendulum)
        .element(Mixed::<6>)
        .step(0.1)
        .run(&[start; 10], 0.0..1.0)?;
    assert!(ends.len() == 10 && ends.failures().count() == 0);
    let motion = Simulation::new(pendulum)
        .accuracy(1e-8)
        .run(start, 0.0..1.0)?;
    assert!(motion.error_estimate() < 1e-8);
    let file = std::env::temp_dir().join("tfe-outside-work-precision.svg");
    WorkPrecision::new(pendulum, start, 0.0..1.0)
        .element(Primal::<3>)
        .element(Mixed::<3>)
        .element(Mixed::<6>)
        .steps([0.1, 0.05, 0.02, 0.01])
        .run()?
        .save(file)?;
    Ok(())
}

/// Uses constraints of both kinds.
fn constrained() -> Result<(), Box<dyn std::error::Error>> {
    let pendulum = RodPendulum {
        m: 1.0,
        l: 1.0,
        g: 9.81,
    };
    let start = pendulum.consistent_state([1.0, 0.01], [0.0, 0.0])?;
    assert!(start.position < 0.02 && start.rank == 1);
    let motion = Simulation::new(&pendulum)
        .step(0.01)
        .run(start.state, 0.0..10.0)?;
    assert!(motion.constraint_residual().position < 1e-14);
    assert!(motion.reactions().column("rod").is_some());
    let edge = KnifeEdge {
        m: 1.0,
        j: 1.0,
        g: 9.81,
        alpha: 0.5,
    };
    let motion = Simulation::new(&edge)
        .element(ThreeField::<4>)
        .step(0.01)
        .run(edge.state([0.0; 3], [0.0, 0.0, 1.3]), 0.0..1.0)?;
    let drive = 9.81 * 0.5_f64.sin();
    let exact = drive / (2.0 * 1.3 * 1.3) * 1.3_f64.sin().powi(2);
    assert!((motion.last().q[0] - exact).abs() < 1e-9);
    Ok(())
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    constrained()?;
    steered()?;
    let pendulum = DoublePendulum {
        m1: 1.0,
        m2: 1.0,
        l1: 1.0,
        l2: 1.0,
        g: 9.81,
        c: 0.0,
    };
    let start = pendulum.state([0.5, -0.3], [0.0, 0.0]);
    compared(&pendulum, start)?;
    let motion = Simulation::new(&pendulum)
        .element(Mixed::<4>)
        .step(0.01)
        .run(start, 0.0..10.0)?;
    let end = motion.last();
    let between = motion.at(3.7)?;
    println!(
        "t = {}: q = {:?}, p = {:?}; at 3.7: {:?}",
        end.t, end.q, end.p, between.q
    );
    println!(
        "energy error {:.1e}, {} Newton iterations",
        motion.energy_error(),
        motion.statistics().iterations
    );
    let file = std::env::temp_dir().join("tfe-outside-pendulum.csv");
    motion.write_csv(&file)?;
    assert!((end.q[0] + 0.1075423326224).abs() < 1e-9 && (end.q[1] - 0.3879371483853).abs() < 1e-9);

    for element in [
        Primal::<3>.into(),
        Primal::<3>.reduced(),
        Primal::<3>.lobatto(),
        Primal::<3>.quadrature(5),
        Mixed::<3>.into(),
        Mixed::<3>.quadrature(4),
        EnergyConserving::<3>.into(),
        Radau::<3>.into(),
        Element::mixed(5),
        Element::primal(4),
    ] {
        let motion = Simulation::new(&pendulum)
            .element(element)
            .step(0.005)
            .tolerance(1e-14)
            .max_iterations(50)
            .solver(Solve::Auto)
            .record_every(10)
            .run(start, 0.0..1.0)?;
        println!("{element}: {:?}", motion.last().q);
    }

    let galaxy = HenonHeiles { lambda: 1.0 };
    let motion = Simulation::new(&galaxy)
        .element(Primal::<4>)
        .step(0.05)
        .run(
            State {
                q: [0.1, 0.0],
                p: [0.0, 0.5],
            },
            0.0..100.0,
        )?;
    assert!((motion.last().q[0] + 0.040194237876068817).abs() < 1e-6);

    let oscillator = Oscillator {
        m: 1.0,
        k: 4.0,
        c: 0.1,
    };
    let mut state = oscillator.state([1.0], [0.0]);
    let mut solver = FastOscillator::new(&oscillator, 0.1);
    for _ in 0..100 {
        solver.advance(&mut state)?;
    }
    let generic = Simulation::new(&oscillator)
        .element(Mixed::<4>)
        .step(0.1)
        .run(oscillator.state([1.0], [0.0]), 0.0..10.0)?;
    assert!((generic.last().q[0] - state.q[0]).abs() < 1e-13);
    println!("emitted solver: {} bytes", FastOscillator::BYTES);

    let chain = Chain::<20> {
        m: 1.0,
        k: 1.0,
        a: 0.25,
    };
    let mut q = [0.0; 20];
    q[3] = 0.5;
    let motion = Simulation::new(&chain)
        .step(0.1)
        .run(chain.state(q, [0.0; 20]), 0.0..10.0)?;
    println!("chain: energy error {:.1e}", motion.energy_error());
    let long = LongChain {
        n: 500,
        m: 1.0,
        k: 1.0,
        a: 0.25,
    };
    let mut q = vec![0.0; long.n];
    q[250] = 0.5;
    let motion = Simulation::new(&long)
        .element(Mixed::<4>)
        .step(0.1)
        .run(long.state(q, vec![0.0; long.n]), 0.0..10.0)?;
    println!("500 masses: energy error {:.1e}", motion.energy_error());

    let last = Simulation::new(&pendulum)
        .step(0.01)
        .steps(start, 0.0)
        .take(1000)
        .last();
    println!(
        "thousandth step: {:?}",
        last.transpose()?.map(|node| node.t)
    );

    let a = stability::transition_matrix(
        &oscillator,
        Primal::<3>,
        &oscillator.state([0.0], [0.0]),
        0.0,
        0.5,
    )?;
    println!("spectral radius {}", stability::spectral_radius(&a));
    println!("{}", DoublePendulum::structure());

    let undamped = Oscillator {
        m: 1.0,
        k: 1.0,
        c: 0.0,
    };
    let equilibrium = undamped.state([0.0], [0.0]);
    for gap in stability::unstable_intervals(&undamped, Primal::<3>, &equilibrium, 0.0..30.0)? {
        println!(
            "{} .. {}: radius up to {} at {}",
            gap.start, gap.end, gap.radius, gap.worst
        );
    }
    for mode in stability::modes(&a, 0.5)? {
        println!(
            "{} rad per time, damping {:?}",
            mode.frequency(),
            mode.damping_ratio()
        );
    }

    let (x0, omega) = (-0.3, 1.4);
    let duffing = Duffing {
        alpha: 1.0,
        beta: 1.0,
        delta: 0.2,
        f: 0.3,
        omega,
    };
    let orbit = PeriodicOrbit::of(&duffing)
        .element(Mixed::<6>)
        .elements(40)
        .period(TAU / omega)
        .guess(|t| ([x0 * (omega * t).cos()], [-x0 * omega * (omega * t).sin()]))
        .solve()?;
    println!(
        "period {}, multipliers {:?}, stable: {}, trace {}, {} nodes",
        orbit.period(),
        orbit.multipliers(),
        orbit.is_stable(),
        orbit.monodromy().trace(),
        orbit.motion().states().len(),
    );
    assert!((orbit.monodromy().trace() - 0.1330786602569841).abs() < 1e-10);

    let projectile = Projectile { m: 2.0, g: 9.81 };
    let arc = BoundaryValue::of(&projectile)
        .element(Mixed::<4>)
        .elements(20)
        .from_to([0.0, 0.0], [10.0, 0.0], 0.0..2.0)
        .solve()?;
    assert!((arc.start().p[1] - 2.0 * 9.81).abs() < 1e-12);
    Ok(())
}
