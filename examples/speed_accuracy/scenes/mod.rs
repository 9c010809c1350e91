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
