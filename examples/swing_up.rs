//! Optimal control: a pole on a cart, swung up with the least ∫ u² dt.
//!
//! ```text
//! L = ½ (M + m) ẋ² + m l ẋ θ̇ cos θ + ½ m l² θ̇² + m g l cos θ ,     force on x: u ,     ∫₀² u² dt → min
//! ```
//!
//! The pole hangs at rest and has to stand at rest, one metre further, after two seconds (M. Kelly, *An introduction to
//! trajectory optimization*, SIAM Review 59 (2017), section 6; the bounds given there are not active and are left out).
//! The force is a polynomial in each element. The table shows how the discrete optimum converges with the number of
//! elements: the cost and its relative difference from that of 160 elements, which falls with order six; the energy
//! gained minus the work of the force; and the change of the horizontal momentum minus the impulse of the force.
//! Gravity has no horizontal component, so that the two are equal: discretely, too, and up to rounding even with the
//! coarsest elements.
//!
//! `cargo run --release --example swing_up` writes the chart `swing_up.svg`; give another file name after `--`.

use std::error::Error;
use std::f64::consts::PI;
use tfe::Optimum;
use tfe::charts::{Axis, Chart, Style};
use tfe::prelude::*;

/// A cart with a pole; θ is measured from the downward vertical.
#[dynamics(
    coordinates(x, theta),
    lagrangian = (cart + m)/2*dot(x)^2 + m*l*dot(x)*dot(theta)*cos(theta) + m*l^2/2*dot(theta)^2 + m*g*l*cos(theta),
    input(u),
    force(x) = u,
    output(effort) = u^2,
    output(power) = u*dot(x),
    output(force) = u,
)]
struct CartPole {
    cart: f64, // kg
    m: f64,    // kg
    l: f64,    // m
    g: f64,    // m/s²
}

const CART: CartPole = CartPole {
    cart: 1.0,
    m: 0.3,
    l: 0.5,
    g: 9.81,
};

const END: f64 = 2.0; // s

fn swung_up(elements: usize) -> Result<Optimum<2>, Box<dyn Error>> {
    let (start, end) = (
        CART.state([0.0, 0.0], [0.0, 0.0]),
        CART.state([1.0, PI], [0.0, 0.0]),
    );
    let best = OptimalControl::of(&CART)
        .element(Mixed::<4>)
        .elements(elements)
        .from_to(start, end, 0.0..END)
        .running_cost("effort")
        .solve()?;
    Ok(best)
}

/// The largest differences, over all nodes, between energy gained and work, and between momentum and impulse.
/// `total_cmp` treats a NaN as the largest number, so that it is not lost.
fn defects(best: &Optimum<2>) -> Result<[f64; 2], Box<dyn Error>> {
    let (motion, driven) = (best.motion(), best.steered(&CART));
    let work = motion.integral(&driven, "power")?;
    let impulse = motion.integral(&driven, "force")?;
    let energies = motion.energies();
    let lost = (energies.iter().zip(&work)).map(|(e, work)| (e - energies[0] - work).abs());
    let kicked =
        (motion.states().iter().zip(&impulse)).map(|(node, push)| (node.p[0] - push).abs());
    let lost = lost.max_by(f64::total_cmp).ok_or("no node")?;
    let kicked = kicked.max_by(f64::total_cmp).ok_or("no node")?;
    Ok([lost, kicked])
}

fn main() -> Result<(), Box<dyn Error>> {
    let finest = swung_up(160)?;
    println!(
        "elements   iterations   ∫ u² dt (N² s)      relative error   energy − work (J)   momentum − impulse (N s)"
    );
    for elements in [10, 20, 40, 80] {
        let best = swung_up(elements)?;
        let off = (best.cost() / finest.cost() - 1.0).abs();
        let [energy, momentum] = defects(&best)?;
        println!(
            "{elements:8}   {:10}   {:14.8}   {off:17.1e}   {energy:17.1e}   {momentum:24.1e}",
            best.iterations(),
            best.cost()
        );
        assert!(momentum < 1e-12, "{momentum:e} N s");
        assert!(elements < 40 || off < 1e-6, "{off:e}");
        // The force transfers some ten joules back and forth; with order six, 80 elements have an error below a
        // hundred-thousandth of that.
        assert!(elements < 80 || energy < 1e-4, "{energy:e} J");
    }
    let at = |t: f64| finest.motion().at(t);
    let mut largest = (0.0, 0.0_f64);
    for k in 0..=2000 {
        let t = END * f64::from(k) / 2000.0;
        let u = finest.input("u", t)?;
        if u.abs() > largest.1.abs() {
            largest = (t, u);
        }
    }
    println!(
        "finest: {:.9} N² s; the largest force is {:.3} N, at {:.3} s",
        finest.cost(),
        largest.1,
        largest.0
    );
    let worth = finest.multipliers()[0].q[0];
    println!(
        "starting one centimetre closer would change the cost by {:+.3} N² s",
        0.01 * worth
    );

    let mut chart = Chart::new("The cheapest swing-up of a pole, every tenth of a second")
        .x(Axis::new("x (m)").range(-0.9..1.9))
        .y(Axis::new("y (m)").range(-0.8..0.8))
        .size(1120, 640);
    let tip = |t: f64| {
        let q = at(t)?.q;
        Ok::<_, tfe::AtError>((q[0] + CART.l * q[1].sin(), -CART.l * q[1].cos()))
    };
    let path: Result<Vec<_>, _> = (0..=400).map(|k| tip(END * f64::from(k) / 400.0)).collect();
    chart = chart.series("tip of the pole", Style::Line, path?);
    for k in 0..=20 {
        let t = END * f64::from(k) / 20.0;
        let (pivot, end) = ((at(t)?.q[0], 0.0), tip(t)?);
        chart = chart.series("", Style::Line, [pivot, end]);
    }
    let path = std::env::args().nth(1);
    let path = path.unwrap_or_else(|| "swing_up.svg".to_owned());
    chart.save(&path)?;
    println!("chart of the path of the pole: {path}");
    Ok(())
}
