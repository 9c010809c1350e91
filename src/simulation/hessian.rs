//! Second derivatives of losses: difference quotients of exact gradients (T-158).

use super::setup::Simulation;
use crate::differences::{NEARER, PART, WELL_KNOWN, is_next_to_zero, places};
use crate::error::{RunError, RunErrorKind};
use crate::length::{Length, RunTimeLength};
use crate::sensitivity::{Loss, LossGradient, LossHessian};
use nalgebra::{DMatrix, DVector};
use std::ops::Range;
use tfe_runtime::family::{self, FamilyState};
use tfe_runtime::{Model, State};

impl<'m, M: Model<N> + Send + Sync + 'm, const N: usize> Simulation<'m, M, N> {
    /// Runs over the span and returns a loss with its [gradient](Self::gradient) and its matrix of second derivatives
    /// ∂²ℓ/∂θᵢ∂θⱼ with respect to the parameters θ named.
    ///
    /// The second derivatives are differences of eighth order of gradients that are exact for the run (T-158); their
    /// error is about 1e-11 of the change of the gradient. [`LossHessian::errors`] estimates it. Each parameter costs
    /// eight gradients; sixteen or twenty-four if the loss is so curved that the differences have to be taken over
    /// shorter distances; and as many again if the loss does not depend on the magnitude of the parameter, because that
    /// is close to zero. (A least-squares [`Fit`](crate::Fit) needs first derivatives only.)
    ///
    /// ```
    /// use tfe::prelude::*;
    /// use tfe::sensitivity::Loss;
    ///
    /// #[dynamics(coordinates(y), lagrangian = m/2*dot(y)^2 - m*g*y, force(y) = f)]
    /// struct Ball { m: f64, g: f64, f: f64 }
    ///
    /// # fn main() -> Result<(), Box<dyn std::error::Error>> {
    /// let ball = Ball { m: 2.0, g: 9.81, f: 3.0 };
    /// let loss = Loss::at_end(|node| 0.5 * node.q[0] * node.q[0]);
    /// let start = State { q: [1.0], p: [0.0] };
    /// let hessian = Simulation::new(&ball).step(0.1).hessian(start, 0.0..2.0, &loss, ["g", "f"])?;
    /// // y = 1 − 2 g + 2 f/m
    /// assert!((hessian.by("g", "g") - 4.0).abs() < 1e-9);
    /// assert!((hessian.by("g", "f") + 2.0).abs() < 1e-9);
    /// assert!((hessian.by("f", "f") - 1.0).abs() < 1e-9);
    /// # Ok(())
    /// # }
    /// ```
    ///
    /// # Errors
    /// As [`gradient`](Self::gradient). [`RunErrorKind::NoParameter`] if the model has no parameter of a given name,
    /// [`RunErrorKind::ParametersFixed`] if the model cannot be copied with other parameters.
    pub fn hessian<S: Into<String>>(
        &self,
        start: State<N>,
        span: Range<f64>,
        loss: &Loss<'_, N>,
        parameters: impl IntoIterator<Item = S>,
    ) -> Result<LossHessian<N>, RunError<N>> {
        let own = self.gradient(start, span.clone(), loss).map_err(named)?;
        let own = Own::new(own, |index| self.model.parameter(index));
        own.differentiated(parameters, |index, value| {
            let other = self.with_parameter(index, value)?;
            Some(other.gradient(start, span.clone(), loss))
        })
    }
}

impl<'m, M: family::Model + Send + Sync + 'm> Simulation<'m, M, 0, RunTimeLength> {
    /// Runs over the span and returns a loss with its [gradient](Self::gradient) and its matrix of second derivatives
    /// with respect to the parameters named, as for models of fixed size.
    ///
    /// # Errors
    /// As [`gradient`](Self::gradient). [`RunErrorKind::NoParameter`] if the model has no parameter of a given name,
    /// [`RunErrorKind::ParametersFixed`] if the model cannot be copied with other parameters.
    pub fn hessian<S: Into<String>>(
        &self,
        start: FamilyState,
        span: Range<f64>,
        loss: &Loss<'_, 0, RunTimeLength>,
        parameters: impl IntoIterator<Item = S>,
    ) -> Result<LossHessian<0, RunTimeLength>, RunError<0, RunTimeLength>> {
        let own = self.gradient(start.clone(), span.clone(), loss);
        let own = own.map_err(named)?;
        let own = Own::new(own, |index| self.model.parameter(index));
        own.differentiated(parameters, |index, value| {
            let other = self.with_parameter(index, value)?;
            Some(other.gradient(start.clone(), span.clone(), loss))
        })
    }
}

/// Attributes an error of a gradient to the call of the user.
fn named<const N: usize, L: Length<N>>(error: RunError<N, L>) -> RunError<N, L> {
    error.of_call("gradient", "hessian")
}

/// A loss with its gradient.
type Found<const N: usize, L> = (f64, LossGradient<N, L>);

/// The loss and the gradient at the given parameters, and the parameters.
struct Own<const N: usize, L: Length<N>> {
    found: Found<N, L>,
    values: Vec<f64>,
}

/// The derivatives of a gradient by one parameter; the error estimate of each, which is the difference of two orders
/// plus the rounding error of the gradient; and the largest relative error.
struct Column {
    slopes: DVector<f64>,
    errors: DVector<f64>,
    off: f64,
}

impl Column {
    /// Takes each entry with the smaller error estimate.
    fn take_better(&mut self, other: &Self) {
        for (i, error) in other.errors.iter().enumerate() {
            if *error < self.errors[i] {
                (self.slopes[i], self.errors[i]) = (other.slopes[i], *error);
            }
        }
    }
}

/// The difference step for a scale; for the scale 1 if there is none.
fn part_of(scale: f64) -> f64 {
    let is_scale = scale.is_finite() && scale > 0.0;
    PART * if is_scale { scale } else { 1.0 }
}

impl<const N: usize, L: Length<N>> Own<N, L> {
    fn new(found: Found<N, L>, value: impl Fn(usize) -> f64) -> Self {
        let values = (0..found.1.parameters().len()).map(value).collect();
        Self { found, values }
    }

    fn differentiated<S: Into<String>>(
        self,
        parameters: impl IntoIterator<Item = S>,
        at: impl Fn(usize, f64) -> Option<Result<Found<N, L>, RunError<N, L>>>,
    ) -> Result<LossHessian<N, L>, RunError<N, L>> {
        let names: Vec<String> = parameters.into_iter().map(Into::into).collect();
        let known = self.found.1.parameters();
        let index = |name: &String| known.iter().position(|own| own == name);
        let refused = |kind| RunError::new(kind, self.found.1.motion().clone());
        let mut indices = Vec::with_capacity(names.len());
        for name in &names {
            indices.push(index(name).ok_or_else(|| {
                refused(RunErrorKind::NoParameter {
                    name: name.clone(),
                    known: known.to_vec(),
                })
            })?);
        }
        let size = names.len();
        let (mut columns, mut errors) = (DMatrix::zeros(size, size), DMatrix::zeros(size, size));
        for (j, index) in indices.iter().enumerate() {
            let gradient = |shift: f64| match at(*index, self.values[*index] + shift) {
                Some(found) => {
                    let (_, gradient) = found.map_err(named)?;
                    let all = gradient.by_parameters();
                    Ok(DVector::from_fn(size, |i, _| all[indices[i]]))
                }
                None => Err(refused(RunErrorKind::ParametersFixed)),
            };
            let mut best = self.known_column(&indices, self.distance(*index), &gradient)?;
            if !best.slopes.iter().all(|slope| slope.is_finite()) {
                return Err(refused(RunErrorKind::Loss {
                    name: names[j].clone(),
                    why: "second derivatives by this parameter are not finite",
                }));
            }
            if self.is_next_to_zero(*index) {
                let distance = self.distance_of_loss(*index);
                // If the run fails at this distance, the first estimates stay.
                if let Ok(other) = self.known_column(&indices, distance, &gradient) {
                    best.take_better(&other);
                }
            }
            columns.set_column(j, &best.slopes);
            errors.set_column(j, &best.errors);
        }
        Ok(LossHessian::new(self.found, names, &columns, &errors))
    }

    /// The largest difference step: relative to the parameter, or, if that is zero, to the change that would change the
    /// loss by its own size.
    fn distance(&self, index: usize) -> f64 {
        match self.values[index] == 0.0 {
            true => self.distance_of_loss(index),
            false => part_of(self.values[index].abs()),
        }
    }

    /// A difference step relative to the change of the parameter that would change the loss by its own size.
    fn distance_of_loss(&self, index: usize) -> f64 {
        part_of((self.found.0 / self.slope(index)).abs())
    }

    /// Whether the loss does not respond to changes of the size of the parameter.
    fn is_next_to_zero(&self, index: usize) -> bool {
        let value = self.values[index];
        let moved = (value * self.slope(index)).abs();
        is_next_to_zero(value, (moved, self.found.0.abs()))
    }

    fn slope(&self, index: usize) -> f64 {
        self.found.1.by_parameters()[index]
    }

    /// The column for a difference step, or for shorter ones if the estimated error is too large.
    fn known_column(
        &self,
        indices: &[usize],
        distance: f64,
        gradient: &impl Fn(f64) -> Result<DVector<f64>, RunError<N, L>>,
    ) -> Result<Column, RunError<N, L>> {
        let [first, others @ ..] = NEARER;
        let mut best = self.column(indices, (distance, first), gradient)?;
        for nearer in others {
            if best.off < WELL_KNOWN {
                break;
            }
            let found = self.column(indices, (distance, nearer), gradient)?;
            if found.off < best.off || best.off.is_nan() {
                best = found;
            }
        }
        Ok(best)
    }

    fn column(
        &self,
        indices: &[usize],
        (distance, nearer): (f64, f64),
        gradient: impl Fn(f64) -> Result<DVector<f64>, RunError<N, L>>,
    ) -> Result<Column, RunError<N, L>> {
        let size = indices.len();
        let (mut eighth, mut sixth) = (DVector::<f64>::zeros(size), DVector::<f64>::zeros(size));
        for place in places(nearer * distance) {
            let at = gradient(place.shift)?;
            eighth += &at * place.eighth;
            sixth += at * place.sixth;
        }
        let own = self.found.1.by_parameters();
        let errors = DVector::from_fn(size, |i, _| {
            let roundings = f64::EPSILON * own[indices[i]].abs() / (nearer * distance);
            (eighth[i] - sixth[i]).abs() + roundings
        });
        // Relative to the loss and to its change over the first step, so that shorter steps are not judged less
        // strictly.
        let part = distance / PART;
        let off = (0..size).map(|i| {
            let sizes = (eighth[i] * part).abs().max(own[indices[i]].abs());
            if errors[i] == 0.0 {
                0.0
            } else {
                errors[i] * part / sizes
            }
        });
        Ok(Column {
            off: off.fold(0.0, crate::numbers::larger),
            slopes: eighth,
            errors,
        })
    }
}
