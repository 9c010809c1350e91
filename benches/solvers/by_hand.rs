//! Steppers as an expert writes them for one model: Gauss elements with all points in AVX2 registers.
//!
//! They take the tableau from the crate and nothing else of it. The iteration is a fixed point from the polynomial of the last element, products with tables and polynomials of sines are fused,
//! sums from step to step are compensated, and an iteration ends by the rule of the crate's own steppers at the same tolerance. They check nothing else: no energy, no evidence for the root, no
//! other iteration where this one does not contract.

mod coupled;
mod lanes;
mod models;
mod second_order;
mod side_by_side;
mod tables;

pub use coupled::CoupledStepper;
pub use models::{
    DoublePendulum, Fput, HeavyTop, HenonHeiles, Kepler, Pendulum, Planets, VanDerPol,
};
pub use pulp::x86::V3;
pub use second_order::{SecondOrder, SecondOrderStepper};
pub use side_by_side::{LANES, SideBySide};

/// Below one rounding, as [`Control`](tfe::runtime::step::Control) has it.
const TOLERANCE: f64 = 0.05 * f64::EPSILON;

/// Increments below it are roundings, if they no longer fall.
const ROUND_OFF: f64 = 4096.0 * f64::EPSILON;

/// More iterations are a failure.
const MAX_ITERATIONS: u32 = 50;

/// Whether what an increment leaves, `size`²/(`last` − `size`), is below the tolerance; all are multiples of `scale`.
#[inline(always)]
fn is_converged(size: f64, last: f64, scale: f64) -> bool {
    if last.is_infinite() {
        size <= TOLERANCE * scale
    } else if size < last {
        size * size <= TOLERANCE * scale * (last - size)
    } else {
        size <= ROUND_OFF * scale
    }
}

/// Adds to a number that carries what rounding took from it.
#[inline(always)]
fn add((number, low): (&mut f64, &mut f64), change: f64) {
    let change = change + *low;
    let sum = *number + change;
    *low = change - (sum - *number);
    *number = sum;
}
