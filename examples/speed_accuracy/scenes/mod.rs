//! The scenes: one module for each kind. Each scene has a model, an initial state and the measurements.

pub mod lattice;
pub mod oscillators;
pub mod planets;
pub mod stiff;

/// The initial coordinates and velocities, and the time at the end.
#[derive(Clone, Copy, Debug)]
pub struct Start<const N: usize> {
    pub q: [f64; N],
    pub v: [f64; N],
    /// The end of the span, which begins at zero.
    pub end: f64,
}

/// Step sizes for `fewest` to `most` equal steps between zero and `end`, with a quarter more steps each time.
pub fn steps(end: f64, fewest: u32, most: u32) -> impl Iterator<Item = f64> {
    let counts = std::iter::successors(Some(fewest), |count| Some(count + count.div_ceil(4)));
    counts
        .take_while(move |count| *count <= most)
        .map(move |count| end / f64::from(count))
}

/// A step size with three digits, for tables.
pub fn short(step: f64) -> String {
    let magnitude = step.abs().log10().floor();
    let unit = 10_f64.powf(magnitude - 2.0);
    if !unit.is_normal() {
        return step.to_string();
    }
    let digits = usize::try_from(2 - magnitude as i64).unwrap_or(0);
    format!("{:.digits$}", (step / unit).round() * unit)
}
