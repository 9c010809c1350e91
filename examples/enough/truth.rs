//! The reference solution that runs are compared with.

use tfe::prelude::*;

/// A motion far more accurate than all others: its steps are so short that only rounding errors are left.
pub struct Truth<const N: usize> {
    pub start: State<N>,
    pub end: f64,
    last: Node<N>,
    /// The largest coordinate and the largest momentum.
    sizes: (f64, f64),
}

impl<const N: usize> Truth<N> {
    pub fn of<M: Model<N>>(model: &M, start: State<N>, end: f64) -> Result<Self, tfe::RunError<N>> {
        let simulation = Simulation::new(model).element(Mixed::<10>);
        let steps = if cfg!(debug_assertions) {
            4000.0
        } else {
            20_000.0
        };
        let fine = simulation
            .step(end / steps)
            .record_every(10)
            .run(start, 0.0..end)?;
        let size = |part: fn(&Node<N>) -> &[f64; N]| {
            let numbers = fine.states().iter().flat_map(part);
            numbers.fold(0.0, |most: f64, x| most.max(x.abs()))
        };
        Ok(Self {
            start,
            end,
            last: *fine.last(),
            sizes: (size(|node| &node.q), size(|node| &node.p)),
        })
    }

    /// The relative error at the end, the larger one of coordinates and momenta. NaN if one of them is: `total_cmp`
    /// treats it as the largest number.
    pub fn error(&self, end: &Node<N>) -> f64 {
        let largest = |a: &[f64; N], b: &[f64; N]| {
            let apart = a.iter().zip(b).map(|(a, b)| (a - b).abs());
            apart.max_by(f64::total_cmp).unwrap_or(f64::NAN)
        };
        let q = largest(&end.q, &self.last.q) / self.sizes.0;
        let p = largest(&end.p, &self.last.p) / self.sizes.1;
        if q.is_nan() || q >= p { q } else { p }
    }
}
