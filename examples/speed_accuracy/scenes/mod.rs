//! The scenes: a module for each kind. Each scene is a model, a start and what is measured.

pub mod lattice;
pub mod oscillators;
pub mod planets;
pub mod stiff;

/// Where a motion starts, and when it ends.
#[derive(Clone, Copy, Debug)]
pub struct Start<const N: usize> {
    pub q: [f64; N],
    pub v: [f64; N],
    /// From zero.
    pub end: f64,
}

/// So many equal steps from zero to `end`, each time a quarter more or less.
pub fn steps(end: f64, fewest: u32, most: u32) -> impl Iterator<Item = f64> {
    let counts = std::iter::successors(Some(fewest), |count| Some(count + count.div_ceil(4)));
    counts
        .take_while(move |count| *count <= most)
        .map(move |count| end / f64::from(count))
}

/// A step for people: three digits.
pub fn short(step: f64) -> String {
    let magnitude = step.abs().log10().floor();
    let unit = 10_f64.powf(magnitude - 2.0);
    if !unit.is_normal() {
        return step.to_string();
    }
    let digits = usize::try_from(2 - magnitude as i64).unwrap_or(0);
    format!("{:.digits$}", (step / unit).round() * unit)
}
