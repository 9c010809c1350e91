//! Multiple shooting: the unknowns are the nodes of all elements, and each element is solved separately.

use super::super::error::OrbitError;
use super::super::kind::Chained;
use super::super::orbit::sort;
use super::super::phase::Phase;
use super::super::problem::{Global, NEIGHBOURED, check, inertia_of};
use crate::assembly::{
    AssemblyError, Chain, Control, Convergence, HalvedCorrection, Mesh, MeshWarning, Size, sizes,
};
use crate::constraints::allowed::{self, basis_of};
use crate::periodic_schur::{self, Multiplier};
use nalgebra::DMatrix;
use tfe_runtime::family::{self, FamilyState, Gradient};
use tfe_runtime::{Element, Form, Statistics};

/// The chain of elements over one period, closed by periodicity, and its iterate.
#[derive(Clone, Debug)]
pub struct Shooting<'m, M> {
    pub(super) model: &'m M,
    pub(super) element: Element,
    pub(super) mesh: Mesh,
    pub(super) start: f64,
    pub(super) period: f64,
    pub(super) unfolding: f64,
    /// The inertia by which the unfolding force is scaled, as for models of fixed size.
    inertia: f64,
    pub(super) globals: Vec<Global>,
    pub(super) phase: Option<Phase>,
    pub(super) energy: Option<f64>,
    pub(super) nodes: Vec<FamilyState>,
    /// The correction on elements of half the length, once it is made.
    halved: Option<HalvedCorrection>,
    pub(super) transitions: Vec<DMatrix<f64>>,
    /// The flow ẏ at the ends of the elements, in the order (p, q), if there are too few nodes for differences.
    flows: Vec<Vec<f64>>,
    pub(super) statistics: Statistics,
}

impl<'m, M: family::Model> Shooting<'m, M> {
    /// An orbit with a known period, from the nodes of a guess.
    pub(super) fn new(
        model: &'m M,
        element: Element,
        mesh: Mesh,
        (start, period): (f64, f64),
        nodes: Vec<FamilyState>,
    ) -> Self {
        Self {
            model,
            element,
            mesh,
            start,
            period,
            unfolding: 0.0,
            inertia: 1.0,
            globals: Vec::new(),
            phase: None,
            energy: None,
            nodes,
            halved: None,
            transitions: Vec::new(),
            flows: Vec::new(),
            statistics: Statistics::NONE,
        }
    }

    /// Whether the guess is constant: an equilibrium whose multipliers are asked for.
    pub(super) fn is_at_rest(&self) -> bool {
        let first = &self.nodes[0];
        let velocity = family::velocity(self.model, self.start, first);
        velocity.is_ok_and(|v| v.iter().all(|v| *v == 0.0))
            && self.nodes.iter().all(|node| node == first)
    }

    /// The energy at the start; `None` if no velocity belongs to the momentum.
    pub(super) fn energy_of_start(&self) -> Option<f64> {
        let (t, first) = (self.start, &self.nodes[0]);
        let velocity = family::velocity(self.model, t, first).ok()?;
        Some(family::energy(self.model, t, first, &velocity))
    }

    /// The multipliers of the transition matrices, the largest first. With constraints, those of the motions that the
    /// constraints allow at the nodes.
    pub(super) fn floquet_of(
        &self,
        transitions: &[DMatrix<f64>],
        (nodes, period): (&[FamilyState], f64),
        model: &M,
    ) -> Result<Vec<Multiplier>, OrbitError> {
        let floquet = if M::CONSTRAINED {
            let times = self.mesh.times(self.start, period);
            let bases = times.zip(nodes).take(transitions.len());
            let bases = bases
                .map(|(t, node)| basis_of(model, t, node))
                .collect::<Result<Vec<_>, _>>();
            let reduced = bases.and_then(|bases| allowed::reduced(&bases, transitions.iter()));
            periodic_schur::multipliers(&reduced.map_err(OrbitError::Constraints)?)
        } else {
            periodic_schur::multipliers(transitions)
        };
        let mut floquet = floquet.map_err(OrbitError::Multipliers)?;
        sort(&mut floquet);
        Ok(floquet)
    }

    /// The number of trivial multipliers.
    pub(super) fn trivial(&self) -> usize {
        let unfolded = self.globals.contains(&Global::Unfolding);
        usize::from(self.phase.is_some()) * (1 + usize::from(unfolded))
    }

    /// The coefficient γ of the unfolding force, if there is one.
    pub(super) fn unfolding(&self) -> Option<f64> {
        let unfolded = self.globals.contains(&Global::Unfolding);
        unfolded.then_some(self.unfolding)
    }

    /// Newton's method with step halving.
    pub(super) fn solve(&mut self, control: Control) -> Result<(), OrbitError> {
        if self.globals.contains(&Global::Unfolding) {
            let (mut momenta, mut velocities) = (Vec::new(), Vec::new());
            for node in &self.nodes {
                // If there is none, the first linearisation reports it.
                if let Ok(v) = family::velocity(self.model, self.start, node) {
                    momenta.extend_from_slice(&node.p);
                    velocities.extend(v);
                }
            }
            self.inertia = inertia_of(&momenta, &velocities);
        }
        let mut chain = self.chain();
        self.linearise(&mut chain)?;
        let mut convergence = Convergence::new(control, self.size(&chain));
        loop {
            if convergence.is_done() {
                self.correct(&chain, 1.0);
                self.check()?;
                return self.check_resolved(&chain);
            }
            let goes_on = convergence.go_on();
            goes_on.map_err(|error| self.explained(error, &chain))?;
            let before = (self.nodes.clone(), self.period, self.unfolding);
            self.correct(&chain, convergence.fraction());
            let tried = self.linearise(&mut chain);
            let next = self.size(&chain);
            if convergence.accepts(tried.is_ok(), next) {
                continue;
            }
            if let Err(stalled) = convergence.halve() {
                tried?;
                return Err(self.explained(stalled, &chain));
            }
            (self.nodes, self.period, self.unfolding) = before;
            self.linearise(&mut chain)?;
        }
    }

    /// Whether the model depends on time.
    fn is_forced() -> bool {
        M::FACTS.time_dependent || M::MOMENTA_MOVE
    }

    /// The error of a failed iteration; for a forced orbit it may be resonance.
    fn explained(&self, error: AssemblyError, chain: &Chain) -> OrbitError {
        match Self::is_forced() {
            true => chain.explained(error).into(),
            false => error.into(),
        }
    }

    /// Refuses a forced orbit that elements of half the length do not confirm, as for models of fixed size.
    fn check_resolved(&mut self, chain: &Chain) -> Result<(), OrbitError> {
        if !(Self::is_forced() && chain.is_doubtful()) {
            return Ok(());
        }
        self.halved = self.halved_correction();
        // If the check itself fails, the orbit is accepted.
        if self.halved.is_none_or(HalvedCorrection::confirms) {
            return Ok(());
        }
        let iterations = self.corrections();
        Err(AssemblyError::Singular { iterations }.into())
    }

    /// What makes the orbit doubtful.
    pub(super) fn doubts(&self) -> Vec<MeshWarning> {
        let halved = self.halved.or_else(|| self.halved_correction());
        halved.map_or(Vec::new(), |halved| halved.doubts(self.mesh.elements()))
    }

    /// The correction on elements of half the length, if there is one.
    fn halved_correction(&self) -> Option<HalvedCorrection> {
        let (mesh, motion) = (self.mesh.halved(), self.motion());
        let last = motion.last().t;
        let inside = mesh.times(self.start, self.period).enumerate();
        let nodes = inside.map(|(k, t)| match (k % 2, motion.at(t.min(last))) {
            (1, Ok(node)) => node.state(),
            _ => self.nodes[k / 2].clone(),
        });
        let nodes: Vec<FamilyState> = nodes.collect();
        let span = (self.start, self.period);
        let mut halves = Self {
            unfolding: self.unfolding,
            inertia: self.inertia,
            globals: self.globals.clone(),
            phase: self.phase,
            energy: self.energy,
            ..Self::new(self.model, self.element, mesh, span, nodes)
        };
        let mut chain = halves.chain();
        match halves.linearise(&mut chain) {
            Ok(()) => Some(halves.correction(&chain)),
            Err(OrbitError::Assembly(AssemblyError::Singular { .. })) => {
                Some(HalvedCorrection::SINGULAR)
            }
            Err(_) => None,
        }
    }

    /// The size of the correction in a chain.
    fn correction(&self, chain: &Chain) -> HalvedCorrection {
        let nodes: Vec<_> = self.corrected_nodes(chain).collect();
        let globals = self.corrected_globals(chain);
        HalvedCorrection::of(self.size(chain).whole(), &nodes, globals)
    }

    /// The chain of the linearised equations.
    fn chain(&self) -> Chain {
        let dense = usize::from(self.phase == Some(Phase::Orthogonal));
        let (size, globals) = (2 * self.model.len(), self.globals.len());
        Chain::new(size, globals, self.mesh.elements(), dense)
    }

    /// Checks that a solution is an orbit.
    fn check(&self) -> Result<(), OrbitError> {
        check(self.period, self.unfolding, self.inertia)
    }

    /// Solves all elements from their nodes, linearises them, and solves for the correction, which is then in the
    /// chain.
    fn linearise(&mut self, chain: &mut Chain) -> Result<(), OrbitError> {
        let mut transitions = Vec::with_capacity(self.mesh.elements());
        let mut flows = Vec::new();
        let are_few = self.mesh.elements() < NEIGHBOURED;
        let places = self.places(self.period);
        let steps = places.iter().zip(&self.nodes);
        let steps = steps.map(|((t, h), node)| (*t, *h, node));
        let each = |transition: family::TransitionOperator| {
            let e = transitions.len();
            let matrix = self.link(chain, e, &transition);
            let (end, next) = (transition.end(), &self.nodes[e + 1]);
            let right = chain.link_mut(e).right;
            for (row, right) in right.iter_mut().enumerate() {
                *right = component(end, row) - component(next, row);
            }
            if are_few {
                flows.push(transition.by_length().to_vec());
            }
            transitions.push(matrix);
        };
        let stepped = family::TransitionOperator::of_steps(
            self.model,
            self.element,
            self.unfolding,
            steps,
            each,
        );
        stepped.map_err(|failed| step_failed(failed, &places))?;
        (self.transitions, self.flows) = (transitions, flows);
        self.statistics.iterations += 1;
        self.statistics.newton_iterations += 1;
        self.statistics.steps += places.len() as u64;
        self.statistics.factorizations += places.len() as u64;
        self.close(chain)?;
        let iterations = self.corrections();
        chain
            .solve()
            .map_err(|_| AssemblyError::Singular { iterations }.into())
    }

    /// Start times and lengths of the elements, for a period.
    pub(super) fn places(&self, period: f64) -> Vec<(f64, f64)> {
        let elements = 0..self.mesh.elements();
        let places = elements.map(|e| self.mesh.place(e, self.start, period));
        places.collect()
    }

    /// Writes the linearisation of an element into its link; returns its transition matrix.
    pub(super) fn link(
        &self,
        chain: &mut Chain,
        e: usize,
        transition: &family::TransitionOperator,
    ) -> DMatrix<f64> {
        let size = transition.size();
        let matrix = transition.matrix();
        let link = chain.link_mut(e);
        for (row, entries) in link.matrix.chunks_exact_mut(size).enumerate() {
            for (column, entry) in entries.iter_mut().enumerate() {
                *entry = matrix[(row, column)];
            }
        }
        let globals = self.globals.len();
        for row in 0..size {
            for (k, global) in self.globals.iter().enumerate() {
                link.global[row * globals + k] = match global {
                    Global::Period => self.mesh.share(e) * transition.by_length()[row],
                    Global::Unfolding => transition.by_damping()[row],
                };
            }
        }
        matrix
    }

    /// The number of corrections before the last linearisation.
    fn corrections(&self) -> u32 {
        let linearised = self.statistics.newton_iterations;
        u32::try_from(linearised.saturating_sub(1)).unwrap_or(u32::MAX)
    }

    /// Writes the conditions of periodicity, phase and energy.
    pub(super) fn close(&self, chain: &mut Chain) -> Result<(), OrbitError> {
        let n = self.model.len();
        let size = 2 * n;
        let (first, last) = (&self.nodes[0], &self.nodes[self.nodes.len() - 1]);
        let mut closure = chain.closure_mut();
        closure.clear();
        for row in 0..size {
            closure.first[row * size + row] = -1.0;
            closure.last[row * size + row] = 1.0;
            closure.right[row] = component(first, row) - component(last, row);
        }
        let mut row = size;
        let fixed = match self.phase {
            Some(Phase::Coordinate { index, value }) => Some((n + index, value)),
            Some(Phase::Momentum { index, value }) => Some((index, value)),
            Some(Phase::Orthogonal) | None => None,
        };
        if let Some((place, value)) = fixed {
            closure.first[row * size + place] = 1.0;
            closure.right[row] = value - component(first, place);
            row += 1;
        }
        if let Some(energy) = self.energy {
            let (slopes, present) = self.energy_slopes(first)?;
            closure.first[row * size..(row + 1) * size].copy_from_slice(&slopes);
            closure.right[row] = energy - present;
        }
        if self.phase == Some(Phase::Orthogonal) {
            let dense = chain.dense_mut(0);
            let last = self.nodes.len() - 1;
            for e in 0..last {
                // The flow by the difference of the neighbours; a phase condition need not be exact.
                let previous = &self.nodes[if e == 0 { last - 1 } else { e - 1 }];
                // The previous neighbour of the first node is one period later.
                let own = self.flows.get(if e == 0 { last - 1 } else { e - 1 });
                for k in 0..size {
                    dense.nodes[e * size + k] = match own {
                        Some(flow) => self.mesh.share(e) * self.period * flow[k],
                        None => component(&self.nodes[e + 1], k) - component(previous, k),
                    };
                }
            }
            dense.nodes[last * size..].fill(0.0);
            dense.global.fill(0.0);
            *dense.right = 0.0;
        }
        Ok(())
    }

    /// The gradient (H_p, H_q) and H.
    fn energy_slopes(&self, state: &FamilyState) -> Result<(Vec<f64>, f64), OrbitError> {
        let (n, t) = (self.model.len(), self.start);
        let velocity = family::velocity(self.model, t, state)
            .map_err(|error| OrbitError::Family(error.into()))?;
        let energy = family::energy(self.model, t, state, &velocity);
        let (z, sign) = match M::FORM {
            Form::Lagrangian => (&velocity, -1.0),
            Form::Hamiltonian => (&state.p, 1.0),
        };
        let [mut by_z, mut by_q, mut force] = [vec![0.0; n], vec![0.0; n], vec![0.0; n]];
        let first = Gradient {
            z: &mut by_z,
            q: &mut by_q,
            force: &mut force,
        };
        self.model.first(t, &state.q, z, first);
        let mut slopes = velocity;
        slopes.extend(by_q.iter().map(|slope| sign * slope));
        Ok((slopes, energy))
    }

    /// The size of the correction relative to the iterate, as for models of fixed size.
    fn size(&self, chain: &Chain) -> Size {
        let globals = self.corrected_globals(chain);
        sizes(self.corrected_nodes(chain), chain.matrices(), globals)
    }

    /// Momenta, coordinates and corrections of the nodes.
    fn corrected_nodes<'a>(
        &'a self,
        chain: &'a Chain,
    ) -> impl Iterator<Item = (&'a [f64], &'a [f64], &'a [f64])> {
        let nodes = self.nodes.iter().enumerate();
        nodes.map(|(e, node)| (&node.p[..], &node.q[..], chain.node(e)))
    }

    /// The corrections of the global unknowns relative to their scales.
    fn corrected_globals<'a>(&'a self, chain: &'a Chain) -> impl Iterator<Item = f64> + 'a {
        let globals = self.globals.iter().zip(chain.globals());
        globals.map(|(global, correction)| correction / global.scale(self.period, self.inertia))
    }

    /// Adds a fraction of the correction to the iterate.
    fn correct(&mut self, chain: &Chain, fraction: f64) {
        let n = self.model.len();
        for (e, node) in self.nodes.iter_mut().enumerate() {
            let (by_p, by_q) = chain.node(e).split_at(n);
            for a in 0..n {
                node.p[a] += fraction * by_p[a];
                node.q[a] += fraction * by_q[a];
            }
        }
        for (global, correction) in self.globals.iter().zip(chain.globals()) {
            match global {
                Global::Period => self.period += fraction * correction,
                Global::Unfolding => self.unfolding += fraction * correction,
            }
        }
    }
}

/// The error of an element that failed.
pub(super) fn step_failed(
    (element, error): (usize, family::OperatorError),
    places: &[(f64, f64)],
) -> OrbitError {
    match error {
        family::OperatorError::Step(source) => AssemblyError::Linearise {
            element,
            time: places.get(element).map_or(f64::NAN, |(t, _)| *t),
            source,
        }
        .into(),
        other => OrbitError::Family(other),
    }
}

/// A component of a state, in the order (p, q).
pub(super) fn component(state: &FamilyState, k: usize) -> f64 {
    let n = state.p.len();
    if k < n { state.p[k] } else { state.q[k - n] }
}
