//! Steppers as an expert would write them for one model: Gauss elements with all quadrature points in AVX2 registers.
//!
//! They use the crate for the tableau only. The fixed-point iteration starts from the extrapolated polynomial of the
//! last element; products with tables and polynomials for the sine are fused; sums over the steps are compensated; and
//! the iteration stops by the rule and with the tolerance of the crate's own steppers. They check nothing else: neither
//! the energy nor whether the iteration found the right root, and they have no other iteration for when this one does
//! not converge.

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

/// Less than one rounding error; the tolerance of [`Control`](tfe::runtime::step::Control).
const TOLERANCE: f64 = 0.05 * f64::EPSILON;

/// Increments below this are rounding errors if they no longer decrease.
const ROUND_OFF: f64 = 4096.0 * f64::EPSILON;

/// More iterations count as a failure.
const MAX_ITERATIONS: u32 = 50;

/// Whether the estimated remaining error after an increment, `size`²/(`last` − `size`), is below the tolerance; all are
/// multiples of `scale`.
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

/// Adds to a number with compensation: the carry keeps what rounding lost.
#[inline(always)]
fn add((number, low): (&mut f64, &mut f64), change: f64) {
    let change = change + *low;
    let sum = *number + change;
    *low = change - (sum - *number);
    *number = sum;
}
