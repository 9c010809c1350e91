//! References given by the user, for models of either kind of length.

use super::WorkPrecision;
use super::reference::Source;
use tfe_runtime::family::{self, FamilyState};
use tfe_runtime::{Model, State};

impl<'m, M: Model<N>, const N: usize> WorkPrecision<'m, M, State<N>> {
    /// Sets the reference: the exact (q, p) at any time of the span. Its relative error is assumed to be the rounding
    /// unit, unless [`reference_uncertainty`](Self::reference_uncertainty) is called.
    #[must_use]
    pub fn reference(mut self, exact: impl Fn(f64) -> ([f64; N], [f64; N]) + 'm) -> Self {
        self.source = Source::Function(Box::new(move |time| {
            let (q, p) = exact(time);
            State { q, p }
        }));
        self
    }

    /// Sets the reference: the exact state at the end of the span only.
    #[must_use]
    pub fn reference_end(mut self, q: [f64; N], p: [f64; N]) -> Self {
        self.source = Source::End(State { q, p });
        self
    }
}

impl<'m, M: family::Model> WorkPrecision<'m, M, FamilyState> {
    /// Sets the reference: the exact (q, p) at any time of the span, as vectors of the model's length. Its relative
    /// error is assumed to be the rounding unit, unless [`reference_uncertainty`](Self::reference_uncertainty) is
    /// called.
    ///
    /// If a vector has another length, the run returns
    /// [`WorkPrecisionError::ReferenceLength`](super::WorkPrecisionError::ReferenceLength).
    ///
    /// ```
    /// use tfe::prelude::*;
    ///
    /// #[dynamics(coordinates(q[n]), lagrangian = sum(i in 0..n, dot(q[i])^2/2 - w[i]^2/2*q[i]^2))]
    /// struct Oscillators { n: usize, w: Vec<f64> }
    ///
    /// # fn main() -> Result<(), Box<dyn std::error::Error>> {
    /// let model = Oscillators { n: 3, w: vec![1.0, 1.5, 2.0] };
    /// let exact = |t: f64| {
    ///     let q = model.w.iter().map(|w| (w * t).cos()).collect();
    ///     let p = model.w.iter().map(|w| -w * (w * t).sin()).collect();
    ///     (q, p)
    /// };
    /// let measured = WorkPrecision::new(&model, model.state([1.0; 3], [0.0; 3]), 0.0..5.0)
    ///     .element(Mixed::<4>)
    ///     .steps([0.2, 0.1, 0.05])
    ///     .reference(exact)
    ///     .run()?;
    /// let slope = measured.curves()[0].slope().ok_or("no slope")?;
    /// assert!((slope.exponent - 6.0).abs() < 0.1);
    /// # Ok(())
    /// # }
    /// ```
    #[must_use]
    pub fn reference(mut self, exact: impl Fn(f64) -> (Vec<f64>, Vec<f64>) + 'm) -> Self {
        self.source = Source::Function(Box::new(move |time| {
            let (q, p) = exact(time);
            FamilyState { q, p }
        }));
        self
    }

    /// Sets the reference: the exact state at the end of the span only, as vectors of the model's length.
    ///
    /// If a vector has another length, the run returns
    /// [`WorkPrecisionError::ReferenceLength`](super::WorkPrecisionError::ReferenceLength).
    #[must_use]
    pub fn reference_end(mut self, q: impl Into<Vec<f64>>, p: impl Into<Vec<f64>>) -> Self {
        let (q, p) = (q.into(), p.into());
        self.source = Source::End(FamilyState { q, p });
        self
    }
}
