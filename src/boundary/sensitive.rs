//! Solutions of boundary-value problems with their derivatives by parameters and prescribed values.

use super::problem::{BoundaryError, BoundaryMotion, BoundaryValue, Component, Condition};
use crate::assembly::{By, derivatives};
use crate::sensitivity::names::place_of;
use tfe_runtime::{Model, State};

impl<'m, M: Model<N>, const N: usize> BoundaryValue<'m, M, N> {
    /// Solves the problem as [`solve`](Self::solve) does, and computes the derivatives of the solution with respect to
    /// each parameter of the model and each value given at the ends.
    ///
    /// They are the derivatives of the discrete solution, exact up to rounding (`docs/theory.md`, (T-156)).
    ///
    /// ```
    /// use tfe::boundary::Component::Coordinate;
    /// use tfe::prelude::*;
    ///
    /// #[dynamics(coordinates(x, y), lagrangian = (dot(x)^2 + dot(y)^2)/2 - g*y)]
    /// struct Projectile { g: f64 }
    ///
    /// # fn main() -> Result<(), Box<dyn std::error::Error>> {
    /// let projectile = Projectile { g: 9.81 };
    /// let arc = BoundaryValue::of(&projectile)
    ///     .from_to([0.0, 0.0], [10.0, 0.0], 0.0..2.0)
    ///     .solve_sensitive()?;
    /// // v_x = x/T,   v_y = y/T + g T/2
    /// assert!((arc.by("g")[0].p[1] - 1.0).abs() < 1e-12);
    /// let farther = arc.by_end(Coordinate(0)).ok_or("it was given")?;
    /// assert!((farther[0].p[0] - 0.5).abs() < 1e-12);
    /// # Ok(())
    /// # }
    /// ```
    ///
    /// # Errors
    /// As from [`solve`](Self::solve).
    pub fn solve_sensitive(&self) -> Result<SensitiveBoundaryMotion<'m, M, N>, BoundaryError> {
        let solved = self.solve()?;
        let indices: Vec<usize> = (0..self.model.parameters()).collect();
        let parameters = indices.iter().copied().map(By::Parameter);
        let by: Vec<By> = parameters
            .chain((0..self.conditions.len()).map(By::Row))
            .collect();
        let iterate = &solved.solution.iterate;
        let changes = derivatives(self.element, &self.problem()?, iterate, 0, &by)?;
        let mut changes: Vec<_> = changes.into_iter().map(|change| change.nodes).collect();
        let names = indices
            .iter()
            .map(|index| self.model.parameter_name(*index));
        Ok(SensitiveBoundaryMotion {
            parameters: names.map(|name| name.to_string()).collect(),
            by_conditions: changes.split_off(indices.len()),
            by_parameters: changes,
            conditions: self.conditions.clone(),
            solved,
        })
    }
}

/// A solution with its derivatives with respect to the parameters of the model and the values at the ends; made by
/// [`BoundaryValue::solve_sensitive`].
#[derive(Clone, Debug)]
pub struct SensitiveBoundaryMotion<'m, M, const N: usize> {
    solved: BoundaryMotion<'m, M, N>,
    parameters: Vec<String>,
    conditions: Vec<Condition>,
    by_parameters: Vec<Vec<State<N>>>,
    by_conditions: Vec<Vec<State<N>>>,
}

impl<'m, M, const N: usize> SensitiveBoundaryMotion<'m, M, N> {
    /// The solution.
    pub fn solved(&self) -> &BoundaryMotion<'m, M, N> {
        &self.solved
    }

    /// The names of the parameters, `m` or `k[2]`, in the order of the fields of the struct.
    pub fn parameters(&self) -> &[String] {
        &self.parameters
    }

    /// The derivatives ∂q/∂θ and ∂p/∂θ with respect to the parameter θ of this name, at the nodes in order.
    ///
    /// # Panics
    /// If no parameter has this name; [`get`](Self::get) returns `None` instead.
    #[track_caller]
    pub fn by(&self, name: &str) -> &[State<N>] {
        &self.by_parameters[place_of(name, &self.parameters)]
    }

    /// The derivatives with respect to a parameter; `None` if no parameter has this name.
    pub fn get(&self, name: &str) -> Option<&[State<N>]> {
        let place = self.parameters.iter().position(|own| own == name)?;
        self.by_parameters.get(place).map(Vec::as_slice)
    }

    /// The derivatives with respect to the value given for a component at the start; `None` if none was given.
    pub fn by_start(&self, component: Component) -> Option<&[State<N>]> {
        self.by_condition(false, component)
    }

    /// The derivatives with respect to the value given for a component at the end; `None` if none was given.
    pub fn by_end(&self, component: Component) -> Option<&[State<N>]> {
        self.by_condition(true, component)
    }

    fn by_condition(&self, at_end: bool, component: Component) -> Option<&[State<N>]> {
        let asked = |one: &Condition| one.at_end == at_end && one.component == component;
        let place = self.conditions.iter().position(asked)?;
        self.by_conditions.get(place).map(Vec::as_slice)
    }
}
