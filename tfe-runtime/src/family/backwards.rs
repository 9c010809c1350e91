//! Gradients of losses by going backwards along a run of a model of run-time length: products of a row with the
//! derivatives of elements, and derivatives by all parameters at once (T-127, T-149).

mod held;
mod iteration;
mod written;

use super::inertia::Inertia;
use super::kick::Kick;
use super::model::{FamilyState, Model};
use super::node::Node;
use super::rates::Rates;
use super::rows::Rows;
use super::stepper::Stepper;
use super::transition::pull::Seeds;
use super::transition::{Ground, OperatorError, TransitionOperator};
use super::view::View;
use crate::condense::{Direction, add_multiple};
use crate::consistency::ModelError;
use crate::element::Element;
use crate::error::StepError;
use crate::inside::{InsideLoss, Seeds as Within};
use crate::lanes::Lanes;
use crate::model::Form;
use crate::newton::Control;
use crate::pull::{Partials, Results};
use crate::scheme::Tables as _;
use crate::tape::Tape;
use alloc::vec;
use alloc::vec::Vec;
use core::fmt;
use iteration::Iteration;
use written::{Points, add_of_place, add_of_points, add_of_rows_at};

/// The adjoint of a run, from its last node to the first: carries the row λ = ∂ℓ/∂(p, q) of a loss ℓ, and accumulates
/// its derivatives by all parameters.
///
/// ```text
/// λ_e = (∂y_{e+1}/∂y_e)ᵀ λ_{e+1} ,     dℓ/da += (∂y_{e+1}/∂a)ᵀ λ_{e+1}                                      (T-127)
/// ```
///
/// Each element is solved once more. Where the equations are M q̈ = f with a constant diagonal M and the iteration
/// contracts, memory and time are linear in the number of coordinates; otherwise a sparse matrix for all points is
/// factored.
pub struct Backwards<'m, M> {
    view: View<'m, M>,
    ground: Ground,
    stepper: Stepper<'m, M>,
    iteration: Option<Iteration>,
    /// Made on first use.
    rates: Option<Rates<()>>,
    /// Solves with L_vv of a Lagrangian at nodes, and with L_vv bordered by the rows of constraints; both are made on
    /// first use.
    node: Option<Node>,
    bordered: Option<(Rows, Node)>,
    tape: Tape,
    lambda: Vec<f64>,
    places: Places,
}

/// The points of an element and the weights λ gives them, a row of n for each group of four points.
#[derive(Clone, Debug, Default)]
struct Places {
    times: Vec<Points>,
    q: Vec<Points>,
    v: Vec<Points>,
    momenta: Vec<Points>,
    forces: Vec<Points>,
    /// The contributions of these weights to those of velocities.
    by_velocities: Vec<Points>,
}

impl<M> fmt::Debug for Backwards<'_, M> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Backwards")
            .field("lambda", &self.lambda)
            .finish_non_exhaustive()
    }
}

impl<'m, M: Model> Backwards<'m, M> {
    /// The adjoint at the end of a run with this element, with λ = 0.
    ///
    /// # Errors
    /// [`OperatorError`] if this model cannot be stepped.
    pub fn new(model: &'m M, element: Element, control: Control) -> Result<Self, OperatorError> {
        let table = TransitionOperator::admitted::<M>(model, element)?;
        let view = View::new(model, 0.0)?;
        let ground = Ground::of(&view, table);
        let scheme = ground.table.view();
        let inertia = Inertia::of(model).ok();
        let inertia = inertia.filter(|_| scheme.collocated && !M::CONSTRAINED);
        let iteration = inertia.map(|inertia| Iteration::new(&scheme, &ground.pattern, inertia));
        let (n, groups) = (model.len(), scheme.points().div_ceil(4));
        let rows = || vec![Lanes([0.0; 4]); groups * n];
        let mut tape = Tape::default();
        tape.begin(model.parameters() + 2 * n);
        Ok(Self {
            places: Places {
                times: vec![Lanes([0.0; 4]); groups],
                q: rows(),
                v: rows(),
                momenta: rows(),
                forces: rows(),
                by_velocities: rows(),
            },
            stepper: Stepper::new(model, element, control)?,
            view,
            ground,
            iteration,
            rates: None,
            node: None,
            bordered: None,
            tape,
            lambda: vec![0.0; 2 * n],
        })
    }

    /// λ, ordered (p, q).
    #[must_use]
    pub fn by_state(&self) -> &[f64] {
        &self.lambda
    }

    /// The derivatives by all parameters so far.
    #[must_use]
    pub fn by_parameters(&self) -> Vec<f64> {
        let all = 0..self.view.model().parameters();
        all.map(|index| self.tape.sum(index)).collect()
    }

    /// Adds the direct derivatives of the loss at a node.
    ///
    /// # Errors
    /// [`OperatorError`] for vectors of other lengths, and for velocities to which no momenta belong.
    pub fn see(
        &mut self,
        t: f64,
        at: (&FamilyState, &[f64]),
        partials: &Partials,
    ) -> Result<(), OperatorError> {
        let by_state = self.pulled(t, at, partials)?;
        let by_state = by_state.p.iter().chain(&by_state.q);
        for (sum, own) in self.lambda.iter_mut().zip(by_state) {
            *sum += own;
        }
        Ok(())
    }

    /// The derivatives of the loss by the state at a place, including those through outputs and velocities; the
    /// derivatives by parameters are added to their sums.
    ///
    /// # Errors
    /// As [`see`](Self::see).
    pub fn pulled(
        &mut self,
        t: f64,
        (state, v): (&FamilyState, &[f64]),
        partials: &Partials,
    ) -> Result<FamilyState, OperatorError> {
        let model = self.view.model();
        let n = model.len();
        for (given, needed) in [
            (state.q.len(), n),
            (state.p.len(), n),
            (v.len(), n),
            (partials.q.len(), n),
            (partials.p.len(), n),
            (partials.v.len(), n),
            (partials.outputs.len(), model.columns()),
        ] {
            if given != needed {
                return Err(OperatorError::Shape { needed, given });
            }
        }
        let parameters = model.parameters();
        let mut by_state = FamilyState {
            q: partials.q.clone(),
            p: partials.p.clone(),
        };
        let (of_p, of_q) = (&mut by_state.p, &mut by_state.q);
        let z = match M::FORM {
            Form::Lagrangian => v,
            Form::Hamiltonian => &state.p,
        };
        let place = (t, &state.q[..], z);
        let mut by_v = partials.v.clone();
        if partials.sees_outputs() {
            let weights = &partials.outputs;
            add_of_place(&mut self.tape, model, place, Results::Observables, weights);
            for a in 0..n {
                of_q[a] += self.tape.take(parameters + a);
                let by_z = self.tape.take(parameters + n + a);
                match M::FORM {
                    Form::Lagrangian => by_v[a] += by_z,
                    Form::Hamiltonian => of_p[a] += by_z,
                }
            }
        }
        if by_v.iter().all(|value| *value == 0.0) {
            return Ok(by_state);
        }
        if M::FORM == Form::Lagrangian {
            // p = L_v(q, v): δv = L_vv⁻¹ (δp − ∂L_v/∂(q, a)).
            if Self::divide_by_mass(&mut self.node, model, place, &mut by_v).is_err() {
                self.divide_by_bordered(place, &state.p, &mut by_v, of_q)?;
            }
            for a in 0..n {
                of_p[a] += by_v[a];
                by_v[a] = -by_v[a];
            }
        }
        add_of_place(&mut self.tape, model, place, Results::Slopes, &by_v);
        for a in 0..n {
            of_q[a] += self.tape.take(parameters + a);
            let by_z = self.tape.take(parameters + n + a);
            if M::FORM == Form::Hamiltonian {
                of_p[a] += by_z;
            }
        }
        Ok(by_state)
    }

    /// Solves with L_vv.
    fn divide_by_mass(
        memory: &mut Option<Node>,
        model: &M,
        at: (f64, &[f64], &[f64]),
        values: &mut [f64],
    ) -> Result<(), OperatorError> {
        let rows = Rows::none();
        let node = match memory {
            Some(made) => made,
            empty => empty.insert(Node::new(model, &rows).ok_or(ModelError::TooLarge)?),
        };
        let sides = values.iter().copied();
        let solution = node.solve_linear(model, at, &rows, sides)?.to_vec();
        if M::CONSTRAINED && !node.is_regular() {
            return Err(StepError::SingularTangent { unknown: 0 }.into());
        }
        values.copy_from_slice(&solution);
        Ok(())
    }

    /// The same where L_vv is singular and the constraints determine the velocity: p = L_v(q, v) + Aᵀη, A v + a = 0
    /// (T-74). Adds the contributions of the rows of constraints to coordinates and parameters.
    ///
    /// # Errors
    /// [`StepError::SingularTangent`] where there are no constraints, or not enough.
    fn divide_by_bordered(
        &mut self,
        (t, q, v): (f64, &[f64], &[f64]),
        p: &[f64],
        by_v: &mut [f64],
        of_q: &mut [f64],
    ) -> Result<(), OperatorError> {
        let singular = StepError::SingularTangent { unknown: 0 };
        if !M::CONSTRAINED {
            return Err(singular.into());
        }
        let model = self.view.model();
        let (rows, node) = match &mut self.bordered {
            Some(made) => made,
            empty => {
                let rows = Rows::new(model);
                let node = Node::new(model, &rows).ok_or(ModelError::TooLarge)?;
                empty.insert((rows, node))
            }
        };
        rows.evaluate(model, t, q);
        node.solve(model, (t, q), p, rows, &mut v.to_vec())?;
        let eta = node.multipliers().to_vec();
        let sides = by_v.iter().copied().chain(eta.iter().map(|_| 0.0));
        let solution = node.solve_linear(model, (t, q, v), rows, sides);
        let (own, taken) = solution.map_err(|_| singular)?.split_at(v.len());
        // Of −(A v + a) and −Aᵀη.
        let places = &self.ground.places.rows;
        let drift: Vec<f64> = taken.iter().map(|taken| -taken).collect();
        let entries = places.places().iter();
        let entries = entries.map(|(_, c, a)| -(taken[*c] * v[*a] + own[*a] * eta[*c]));
        let entries: Vec<f64> = entries.collect();
        by_v.copy_from_slice(own);
        add_of_rows_at(&mut self.tape, model, (t, q), places, (&drift, &entries));
        let parameters = model.parameters();
        for (a, of_q) in of_q.iter_mut().enumerate() {
            *of_q += self.tape.take(parameters + a);
        }
        Ok(())
    }

    /// Goes back over an impulse, of a model with constraints: `kicked` has the momentum with the impulse, before the
    /// constraints take up the part against them.
    ///
    /// # Errors
    /// As [`Kick::of`].
    pub fn kick(&mut self, t: f64, kicked: &FamilyState) -> Result<(), OperatorError> {
        let weights = Kick::of(self.view.model(), t, kicked, &[])?.pull(&mut self.lambda);
        if self.view.model().parameters() > 0 {
            self.take_derivatives_of_node(t, &weights);
        }
        Ok(())
    }

    /// λ, which becomes zero: at an action that changes the state, the caller multiplies it by the derivative of the
    /// action, and adds the product by [`see`](Self::see).
    pub fn take_by_state(&mut self) -> Vec<f64> {
        let none = vec![0.0; self.lambda.len()];
        core::mem::replace(&mut self.lambda, none)
    }

    /// Goes back over the element from t to t + h that begins at `before`, with the derivatives of the loss by its
    /// inside; the element is solved once more.
    ///
    /// # Errors
    /// [`OperatorError`] of the step and of its tangent; [`OperatorError::Cut`] if the step was too long to be made at
    /// once.
    pub fn pass(
        &mut self,
        (t, h): (f64, f64),
        before: &FamilyState,
        inside: Option<&InsideLoss>,
    ) -> Result<FamilyState, OperatorError> {
        self.check_inside(inside)?;
        if let Some(end) = self.pass_by_iteration((t, h), before, inside)? {
            self.add_start(inside);
            return Ok(end);
        }
        let transition = self.linearised((t, h), before, &[])?;
        self.pass_linearised((t, h), &transition, inside)?;
        Ok(transition.end().clone())
    }

    /// Solves the element from t to t + h that begins at `before` once more, with sparse factors and with its
    /// derivatives along directions. [`pass_linearised`](Self::pass_linearised) goes back over it: if an event ends the
    /// element, λ at its end depends on the derivative by its length.
    ///
    /// # Errors
    /// As [`pass`](Self::pass).
    pub fn linearised(
        &mut self,
        (t, h): (f64, f64),
        before: &FamilyState,
        directions: &[Direction],
    ) -> Result<TransitionOperator, OperatorError> {
        let (view, ground) = (&self.view, &self.ground);
        let table = &ground.table;
        let mut rates = match self.rates.take() {
            Some(rates) => rates.hand_over(view),
            None => Rates::new(view, table.clone(), Control::default())?,
        };
        let transition = TransitionOperator::next(view, &mut rates, ground, before, (t, h));
        let transition = transition.map(|mut transition| {
            transition.differentiate_along(view, &rates, (t, h), directions);
            transition
        });
        for (l, point) in rates.points.iter().enumerate() {
            let time = t + h * table.view().nodes[l];
            self.places.set(l, time, &point.q, &point.v);
        }
        self.rates = Some(rates.hand_over(()));
        transition
    }

    /// Goes back over the element from t to t + h that was [linearised](Self::linearised) last.
    ///
    /// # Errors
    /// As [`pass`](Self::pass).
    pub fn pass_linearised(
        &mut self,
        (t, h): (f64, f64),
        transition: &TransitionOperator,
        inside: Option<&InsideLoss>,
    ) -> Result<(), OperatorError> {
        self.check_inside(inside)?;
        let seeds = transition.pull(inside, &mut self.lambda);
        if !self.lambda.iter().all(|one| one.is_finite()) {
            return Err(StepError::SingularTangent { unknown: 0 }.into());
        }
        self.places.weigh(&seeds);
        self.take_derivatives();
        if let Some(weights) = &seeds.held {
            self.take_derivatives_of_constraints((t, t + h), weights);
        }
        self.add_start(inside);
        Ok(())
    }

    /// Refuses derivatives by the inside of an element that are not those of its polynomial.
    fn check_inside(&self, inside: Option<&InsideLoss>) -> Result<(), OperatorError> {
        let degree = self.ground.table.element().degree();
        let needed = 2 * degree * self.view.model().len();
        match inside.map(|inside| inside.coefficients.len()) {
            Some(given) if given != needed => Err(OperatorError::Shape { needed, given }),
            _ => Ok(()),
        }
    }

    /// Adds the derivatives of the loss by the start of an element.
    fn add_start(&mut self, inside: Option<&InsideLoss>) {
        if let Some(inside) = inside {
            add_multiple(&mut self.lambda, 1.0, &inside.start);
        }
    }

    /// Goes back over an element by iteration, and returns its end; `None`, with λ unchanged, where the iteration does
    /// not serve.
    fn pass_by_iteration(
        &mut self,
        (t, h): (f64, f64),
        before: &FamilyState,
        inside: Option<&InsideLoss>,
    ) -> Result<Option<FamilyState>, OperatorError> {
        if self.iteration.is_none() {
            return Ok(None);
        }
        let mut end = before.clone();
        let cuts = self.stepper.statistics().cuts;
        self.stepper.advance(t, h, &mut end)?;
        if self.stepper.statistics().cuts > cuts {
            return Err(OperatorError::Cut);
        }
        let within = Within::of(inside, &self.ground.table.view(), h);
        if !self.iterate(t, h, &within) {
            return Ok(None);
        }
        self.take_derivatives();
        Ok(Some(end))
    }

    /// The adjoint of the step that the stepper has made, by iteration; false where it does not contract.
    fn iterate(&mut self, t: f64, h: f64, within: &Within) -> bool {
        let Some(iteration) = &mut self.iteration else {
            return false;
        };
        let scheme = self.ground.table.view();
        let dense = self.stepper.dense(t, t + h);
        for (l, node) in scheme.nodes.iter().enumerate() {
            let (q, v) = dense.motion_at(*node, h);
            self.places.set(l, t + h * node, &q, &v);
        }
        let places = &mut self.places;
        iteration.linearise(
            &self.view,
            &self.ground.pattern,
            (&places.times, &places.q, &places.v),
        );
        if !iteration.pull(h, within, &mut self.lambda) {
            return false;
        }
        for (momentum, mu) in places.momenta.iter_mut().zip(&iteration.mu) {
            *momentum = -*mu;
        }
        places.forces.copy_from_slice(&iteration.seeds);
        if M::FORM == Form::Hamiltonian {
            iteration.set_by_velocities(&mut places.by_velocities);
        }
        true
    }

    /// Adds the derivatives of momenta and forces at the points by parameters.
    fn take_derivatives(&mut self) {
        let model = self.view.model();
        if model.parameters() == 0 {
            return;
        }
        let (n, places) = (model.len(), &mut self.places);
        let (mut by_z, mut by_q) = (places.momenta.clone(), places.forces.clone());
        if let Some(masses) = self.view.masses() {
            // At fixed v the momentum moves: δp = −M ∂H_p/∂a, and with it the forces.
            for (place, by_z) in by_z.iter_mut().enumerate() {
                let mass = Lanes([masses[place % n]; 4]);
                *by_z = -(mass * *by_z + places.by_velocities[place]);
                by_q[place] = -by_q[place];
                places.v[place] = mass * places.v[place];
            }
        }
        for (group, t) in places.times.iter().enumerate() {
            let own = group * n..(group + 1) * n;
            let weights = [
                &by_z[own.clone()],
                &by_q[own.clone()],
                &places.forces[own.clone()],
            ];
            let place = (*t, &places.q[own.clone()], &places.v[own]);
            add_of_points(&mut self.tape, model, place, weights);
        }
    }
}

impl Places {
    /// Sets a point; unused lanes repeat the first point of their group.
    fn set(&mut self, l: usize, t: f64, q: &[f64], v: &[f64]) {
        let (group, n) = (l / 4, q.len());
        let lanes = match l % 4 {
            0 => 0..4,
            lane => lane..lane + 1,
        };
        self.times[group].0[lanes.clone()].fill(t);
        for a in 0..n {
            self.q[group * n + a].0[lanes.clone()].fill(q[a]);
            self.v[group * n + a].0[lanes.clone()].fill(v[a]);
        }
    }

    /// Sets the weights at the points.
    fn weigh(&mut self, seeds: &Seeds) {
        let n = self.q.len() / self.times.len().max(1);
        for (rows, seeds) in [
            (&mut self.momenta, &seeds.momenta),
            (&mut self.forces, &seeds.forces),
            (&mut self.by_velocities, &seeds.by_velocities),
        ] {
            rows.fill(Lanes([0.0; 4]));
            for (l, seeds) in seeds.chunks_exact(n.max(1)).enumerate() {
                for (a, seed) in seeds.iter().enumerate() {
                    rows[l / 4 * n + a].0[l % 4] = *seed;
                }
            }
        }
    }
}
