//! The result of an optimal control problem.

use super::problem::{Iterate, Problem};
use super::search::Iteration;
use crate::assembly::{Iterate as ChainIterate, Mesh, MeshWarning, Solution};
use crate::driven::{Driven, InputError};
use crate::motion::Motion;
use nalgebra::DVector;
use std::fmt;
use std::ops::Range;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use tfe_runtime::basis::{MAX_NODES, legendre};
use tfe_runtime::condenser::Condenser;
use tfe_runtime::scheme::SchemeRef;
use tfe_runtime::{Controlled, Element, Form, State, Statistics};

/// The solution of an optimal-control problem: the inputs of least cost, and the motion that they cause.
#[derive(Clone)]
pub struct Optimum<const N: usize> {
    pub(super) cost: f64,
    pub(super) motion: Motion<N>,
    pub(super) names: &'static [&'static str],
    pub(super) pieces: Arc<Pieces>,
    pub(super) costates: Vec<Costate<N>>,
    pub(super) history: Vec<Iteration>,
    pub(super) warnings: Vec<MeshWarning>,
}

impl<const N: usize> fmt::Debug for Optimum<N> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Optimum")
            .field("cost", &self.cost)
            .field("motion", &self.motion)
            .field("inputs", &self.names)
            .field("iterations", &self.iterations())
            .finish_non_exhaustive()
    }
}

/// The costate (multiplier) of a node: the derivatives of the least cost with respect to a change of its state.
///
/// At the start these are the derivatives with respect to the state that was given; at other nodes those with respect
/// to a jump of the state there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Costate<const N: usize> {
    /// The time of the node.
    pub t: f64,
    /// The derivatives with respect to the coordinates.
    pub q: [f64; N],
    /// The derivatives with respect to the momenta.
    pub p: [f64; N],
}

impl<const N: usize> Optimum<N> {
    /// The value of the cost.
    pub fn cost(&self) -> f64 {
        self.cost
    }

    /// The motion, with dense output; its nodes are the ends of the elements. At a node, an output that depends on an
    /// input has the value of the element that ends there.
    pub fn motion(&self) -> &Motion<N> {
        &self.motion
    }

    /// The value of an input at a time. Where two elements meet, it is that of the element that begins there. Before
    /// the start and after the end, the polynomials are extrapolated.
    ///
    /// # Errors
    /// [`InputError::Unknown`] if the model has no input of this name.
    pub fn input(&self, name: &str, t: f64) -> Result<f64, InputError> {
        let place = self.names.iter().position(|own| *own == name);
        let place = place.ok_or_else(|| InputError::Unknown {
            name: name.to_owned(),
            known: self.names.to_vec(),
        })?;
        Ok(self.pieces.at(self.pieces.element(t), place, t))
    }

    /// The model with these inputs, for runs with other steps, elements and starts, for integrals of outputs along the
    /// motion, and everything else that takes a model.
    ///
    /// `model` must have the type of the model of the problem; its parameters may differ.
    pub fn steered<'m, M: Controlled<N>>(&self, model: &'m M) -> Driven<'m, M> {
        let pieces = Arc::clone(&self.pieces);
        steered(model, |input| {
            let pieces = Arc::clone(&pieces);
            move |t| pieces.at(pieces.element(t), input, t)
        })
    }

    /// The multipliers of the equations of motion (costates), one for each node.
    pub fn multipliers(&self) -> &[Costate<N>] {
        &self.costates
    }

    /// The iterations of the search, in order.
    pub fn history(&self) -> &[Iteration] {
        &self.history
    }

    /// What makes the motion doubtful: whether elements of half the length, on which inputs have twice as many
    /// coefficients, change it, by one correction.
    pub fn warnings(&self) -> &[MeshWarning] {
        &self.warnings
    }

    pub(super) fn with_warnings(self, warnings: Vec<MeshWarning>) -> Self {
        Self { warnings, ..self }
    }

    /// The number of iterations.
    pub fn iterations(&self) -> usize {
        self.history.len()
    }
}

/// Inputs that are polynomials in each element.
#[derive(Debug)]
pub(super) struct Pieces {
    /// The ends of the elements.
    pub(super) times: Vec<f64>,
    pub(super) inputs: usize,
    /// For each element the coefficients of the Legendre polynomials; for each polynomial those of all inputs.
    pub(super) coefficients: Vec<Vec<f64>>,
}

impl Pieces {
    /// The element that contains a time.
    fn element(&self, t: f64) -> usize {
        let inner = &self.times[1..self.times.len() - 1];
        inner.partition_point(|end| *end <= t)
    }

    /// The value of an input in an element.
    pub(super) fn at(&self, element: usize, input: usize, t: f64) -> f64 {
        let (start, end) = (self.times[element], self.times[element + 1]);
        let mut basis = [0.0; MAX_NODES];
        legendre((t - start) / (end - start), &mut basis);
        let coefficients = self.coefficients[element].chunks_exact(self.inputs);
        (coefficients.zip(basis))
            .map(|(all, value)| all[input] * value)
            .sum()
    }
}

/// A model whose inputs are given functions.
fn steered<'m, M: Controlled<N>, F: Fn(f64) -> f64 + Send + Sync + 'm, const N: usize>(
    model: &'m M,
    function: impl Fn(usize) -> F,
) -> Driven<'m, M> {
    let names = M::INPUTS.iter().enumerate();
    names.fold(Driven::new(model), |driven, (input, name)| {
        // The names are those of the model, so they exist.
        let with = driven.clone().input(name, function(input));
        with.unwrap_or(driven)
    })
}

/// The final iterate, with the model.
pub(super) struct Found<'m, M> {
    pub(super) model: &'m M,
    pub(super) element: Element,
    pub(super) span: Range<f64>,
    pub(super) mesh: Mesh,
    pub(super) pieces: Arc<Pieces>,
    pub(super) iterations: usize,
}

fn state<const N: usize>(node: &DVector<f64>) -> State<N> {
    State {
        p: std::array::from_fn(|a| node[a]),
        q: std::array::from_fn(|a| node[N + a]),
    }
}

impl<M> Found<'_, M> {
    pub(super) fn costates<const N: usize>(&self, iterate: &Iterate) -> Vec<Costate<N>> {
        let nodes = self.pieces.times.iter().zip(&iterate.costates);
        nodes
            .map(|(t, costate)| {
                let State { p, q } = state(costate);
                Costate { t: *t, q, p }
            })
            .collect()
    }

    /// The motion with the polynomials of the elements, without integrating again.
    pub(super) fn motion<const N: usize>(
        &self,
        problem: &Problem<'_>,
        scheme: &SchemeRef<'_>,
        iterate: &Iterate,
    ) -> Motion<N>
    where
        M: Controlled<N>,
    {
        // At a node, the inputs are those of the element that is evaluated.
        let current = Arc::new(AtomicUsize::new(0));
        let driven = steered(self.model, |input| {
            let (pieces, element) = (Arc::clone(&self.pieces), Arc::clone(&current));
            move |t| pieces.at(element.load(Ordering::Relaxed), input, t)
        });
        let interiors = self.interiors::<N>(&driven, problem, scheme, iterate);
        let statistics = Statistics {
            newton_iterations: self.iterations as u64,
            iterations: self.iterations as u64,
            ..Statistics::default()
        };
        Solution {
            model: &driven,
            element: self.element,
            mesh: self.mesh.clone(),
            start: self.span.start,
            length: self.span.end - self.span.start,
            end: self.span.end,
            damping: 0.0,
            iterate: ChainIterate {
                nodes: iterate.nodes.iter().map(state).collect(),
                interiors,
                globals: Vec::new(),
            },
            transitions: Vec::new(),
            statistics,
        }
        .motion_told(|element| current.store(element, Ordering::Relaxed))
    }

    /// The interior unknowns in the order of the element's own equations: rates; in phase space, the rates of the
    /// momenta, then those of the coordinates.
    fn interiors<const N: usize>(
        &self,
        driven: &Driven<'_, M>,
        problem: &Problem<'_>,
        scheme: &SchemeRef<'_>,
        iterate: &Iterate,
    ) -> Vec<f64>
    where
        M: Controlled<N>,
    {
        fn interior<D: tfe_runtime::Model<N>, const N: usize>(_: &D, element: Element) -> usize {
            Condenser::<N>::new::<D>(element).map_or(0, |condenser| condenser.interior())
        }
        let rates = scheme.unknowns() * N;
        let in_phase_space = interior(driven, self.element) != rates;
        let mut all = Vec::new();
        for (element, block) in problem.blocks.iter().enumerate() {
            let own = &iterate.interiors[element].as_slice()[..rates];
            if in_phase_space && M::FORM == Form::Hamiltonian {
                let values = block.values(problem.model, &problem.variables(iterate, element));
                for said in &values.said {
                    all.extend_from_slice(&said.as_slice()[N..]);
                }
            }
            all.extend_from_slice(own);
        }
        all
    }
}
