//! Integrals of outputs along a motion.

use super::points::Points;
use super::{AtError, Motion};
use crate::evaluate::Evaluate;
use crate::length::{Length, Polynomial};
use crate::numbers::larger;

impl<const N: usize, L: Length<N>> Motion<N, L> {
    /// The integral of an output from the start to every recorded node,
    ///
    /// ```text
    /// ∫ y(t, q, q̇) dt ,     by the s Gauss points of every element, s the degree of its polynomial                   (T-164)
    /// ```
    ///
    /// Elements that collocate at Gauss points (`Mixed`, `ThreeField`, reduced `Primal`) satisfy the equations of
    /// motion there. The integral is therefore as accurate as the nodes, as if it had been one more coordinate; with
    /// other elements it is at least as accurate as their polynomials. Use it for the work of a force, or for the angle
    /// that `model(Name, routh(phi))` eliminates, whose velocity is the output `phi_rate`:
    ///
    /// ```
    /// use tfe::prelude::*;
    ///
    /// /// A planet; without its angle a motion in the radius alone.
    /// #[dynamics(
    ///     coordinates(r, phi),
    ///     lagrangian = (dot(r)^2 + r^2*dot(phi)^2)/2 + mu/r,
    ///     model(Radial, routh(phi)),
    /// )]
    /// struct Planet { mu: f64 }
    ///
    /// # fn main() -> Result<(), Box<dyn std::error::Error>> {
    /// let planet = Planet { mu: 1.0 };
    /// let (radial, start) = Radial::of_state(&planet, &planet.state([1.0, 0.0], [0.0, 1.2]));
    /// let motion = Simulation::new(&radial).element(Mixed::<6>).step(0.1).run(start, 0.0..5.0)?;
    /// let angle = motion.integral(&radial, "phi_rate")?;
    /// // The same as with the angle as a coordinate.
    /// let both = Simulation::new(&planet).element(Mixed::<6>).step(0.1).run(planet.state([1.0, 0.0], [0.0, 1.2]), 0.0..5.0)?;
    /// assert!((angle[50] - both.last().q[1]).abs() < 1e-12);
    /// # Ok(())
    /// # }
    /// ```
    ///
    /// The model is that of the run: after [`Simulation::input`](crate::Simulation::input), a [`Driven`](crate::Driven)
    /// model with the same inputs.
    ///
    /// # Errors
    /// [`AtError::NoOutput`] if the model declares no such output, [`AtError::OtherModel`] if its values differ from
    /// those that the run recorded, [`AtError::NotRecorded`] if `record_every` left out
    /// elements, [`AtError::NoVelocity`] if no velocity belongs to a momentum, [`AtError::Model`] if the model does not
    /// pass its check.
    pub fn integral<M>(&self, model: &M, output: &str) -> Result<Vec<f64>, AtError>
    where
        M: Evaluate<N, L>,
    {
        model.checked().map_err(AtError::Model)?;
        let names: Vec<String> = (model.output_names().iter())
            .map(ToString::to_string)
            .collect();
        let mut values = vec![0.0; names.len()];
        let Some(column) = names.iter().position(|name| name == output) else {
            return Err(AtError::NoOutput {
                output: output.to_owned(),
                known: names,
            });
        };
        let mut own = self.outputs.names.iter();
        let place = OutputPlace {
            column,
            recorded: own.position(|name| name.is(output)),
        };
        let mut points = Points::new(self.nodes[0].v.clone());
        let (mut sum, mut integrals) = (0.0, vec![0.0]);
        let mut elements = self.elements.iter();
        let mut changed = None;
        for (node, pair) in self.nodes.windows(2).enumerate() {
            let (from, to) = (pair[0].t, pair[1].t);
            // The states before and after an event.
            if from == to {
                integrals.push(sum);
                let now = changed.as_ref().unwrap_or(model);
                changed = self.arcs.model_from(now, node + 1).or(changed);
                continue;
            }
            let model = changed.as_ref().unwrap_or(model);
            let Some(element) = elements.next() else {
                break;
            };
            if (element.start(), element.end()) != (from, to) {
                return Err(AtError::NotRecorded { time: from });
            }
            for piece in element.pieces() {
                points.of(model, piece, |point| {
                    let at = L::parts(&point.state);
                    model.outputs(point.t, at, &point.velocity, &mut values);
                    sum += point.weight * values[column];
                    Ok::<_, AtError>(())
                })?;
            }
            self.check_is_recorded(model, (output, place), node + 1, &mut values)?;
            integrals.push(sum);
        }
        if integrals.len() < self.nodes.len() {
            let time = self.nodes[integrals.len() - 1].t;
            return Err(AtError::NotRecorded { time });
        }
        Ok(integrals)
    }

    /// Refuses a model that does not give a recorded value of an output again: that of a run with inputs, without
    /// these, or one with other parameters.
    fn check_is_recorded<M: Evaluate<N, L>>(
        &self,
        model: &M,
        (output, place): (&str, OutputPlace),
        node: usize,
        values: &mut [f64],
    ) -> Result<(), AtError> {
        /// What the output changes in the part [`BESIDE`] of an element.
        const NEAR: f64 = 1e-6;
        /// An input may jump at the node, where the run has recorded its value on either side.
        const BESIDE: f64 = 1e-9;
        let recorded = place
            .recorded
            .and_then(|at| Some(self.outputs.row(node)?[at]));
        let Some(recorded) = recorded.filter(|value| !value.is_nan()) else {
            return Ok(());
        };
        let at = &self.nodes[node];
        let beside = BESIDE * (at.t - self.nodes[node - 1].t);
        let mut output_at = |t: f64| {
            model.outputs(t, (&at.q, &at.p), &at.v, values);
            values[place.column]
        };
        let computed = output_at(at.t);
        let is_recorded = |value: f64| {
            let size = larger(recorded.abs(), value.abs());
            recorded == value || (recorded - value).abs() <= NEAR * size
        };
        if is_recorded(computed)
            || is_recorded(output_at(at.t - beside))
            || is_recorded(output_at(at.t + beside))
        {
            return Ok(());
        }
        Err(AtError::OtherModel {
            output: output.to_owned(),
            time: at.t,
            recorded,
            computed,
        })
    }
}

/// Where an output stands among those of a model, and among those that a motion has recorded.
#[derive(Clone, Copy)]
struct OutputPlace {
    column: usize,
    /// `None` if the model of the run declares no such output.
    recorded: Option<usize>,
}
