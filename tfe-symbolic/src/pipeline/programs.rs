//! The programs of a derivation.

use crate::derive::derivation::Derivation;
use crate::derive::entry::Entry;
use crate::derive::limits::take_limits;
use crate::derive::sensitivity::{Leaf, entries_by};
use crate::model::declared::Declared;
use crate::optimise::passes::Passes;
use crate::pipeline::select_plan::Draft;
use crate::program::count::Counts;
use crate::program::{Array, By, Place, Program, Request};

impl Derivation {
    /// The program of a kernel. It is kept, and returned again on the next request.
    pub fn program(&self, request: Request) -> Program {
        if let Some(program) = self.programs.borrow().get(&request) {
            return program.clone();
        }
        let program = self.program_of(|array| array.is_wanted(request));
        self.programs.borrow_mut().insert(request, program.clone());
        program
    }

    /// The program of ∂/∂q and of the forces alone: what the equations M q̈ = f ask for.
    pub fn forces(&self) -> Program {
        self.program_of(|array| matches!(array, Array::ByQ | Array::Force))
    }

    /// The program of H as declared, as the value of the energy function, of a model with a time transformation; the time is its last
    /// coordinate.
    ///
    /// Nothing for models without one.
    ///
    /// ```
    /// use tfe_symbolic::compile::declare;
    /// use tfe_symbolic::syntax::context::Context;
    /// use tfe_symbolic::derive::derivation::Derivation;
    /// use tfe_symbolic::program::Request;
    ///
    /// let text = "coordinates(q), momenta(p), hamiltonian = p^2 - q*t, time_transformation = 2 + q";
    /// let declared = declare(text, &Context::default()).expect("no mistakes in it");
    /// let hamiltonian = Derivation::hamiltonian(&declared).expect("a time transformation");
    /// assert_eq!(
    ///     hamiltonian.to_string(),
    ///     "t0 = q[0] * q[1]\n\
    ///      t1 = p[0] * p[0]\n\
    ///      t2 = t1 - t0\n\
    ///      E = t2\n"
    /// );
    /// ```
    pub fn hamiltonian(declared: &Declared) -> Option<Program> {
        let transformation = declared.time_transformation?;
        let mut graph = declared.graph.clone();
        let mut entries = vec![Entry {
            nest: Vec::new(),
            place: Place::scalar(Array::Value),
            value: transformation.hamiltonian,
        }];
        take_limits(&mut graph, [&mut entries]);
        Some(Draft::best(&graph, vec![entries], Passes::ALL))
    }

    fn program_of(&self, is_wanted: impl Fn(Array) -> bool) -> Program {
        let wanted = |entries: &Vec<Entry>| {
            let wanted = entries.iter().filter(|entry| is_wanted(entry.place.array));
            wanted.cloned().collect()
        };
        let plain = std::iter::once(&self.entries);
        let written = plain.chain(&self.written).map(wanted).collect();
        Draft::best(&self.graph, written, self.passes)
    }

    /// The program of the first derivatives and forces differentiated once more, partially at fixed (q, z):
    ///
    /// ```text
    /// ∂E_z/∂a, ∂E_q/∂a, ∂Q/∂a     in the places of E_z, E_q, Q;  a: a parameter of `sensitivity(…)`, or the time
    /// ```
    ///
    /// Empty for the number of no such parameter.
    ///
    /// ```
    /// use tfe_symbolic::compile::declare;
    /// use tfe_symbolic::syntax::context::{Context, Field, FieldKind};
    /// use tfe_symbolic::derive::derivation::Derivation;
    /// use tfe_symbolic::program::By;
    ///
    /// let k = Field { name: "k".to_owned(), kind: FieldKind::Scalar };
    /// let context = Context { fields: vec![k], ..Context::default() };
    /// let text = "coordinates(x), lagrangian = dot(x)^2/2 - k^2*x^2/2, force(x) = k*cos(t), sensitivity(k)";
    /// let derivation = Derivation::of(&declare(text, &context).expect("no mistakes in it"));
    /// assert_eq!(
    ///     derivation.program_by(By::Parameter(0)).to_string(),
    ///     "t0 = cos(t)\n\
    ///      Q[0] = t0\n\
    ///      t1 = 2 * q[0]\n\
    ///      t2 = k * t1\n\
    ///      t3 = -t2\n\
    ///      E_q[0] = t3\n"
    /// );
    /// ```
    pub fn program_by(&self, by: By) -> Program {
        let leaf = match by {
            By::Time => Leaf::Time,
            By::Parameter(number) => match self.sensitivities.get(number) {
                Some(parameter) => Leaf::Parameter(parameter),
                None => return Program::default(),
            },
        };
        let mut graph = self.graph.clone();
        let mut entries = entries_by(&mut graph, &self.entries, leaf);
        take_limits(&mut graph, [&mut entries]);
        Draft::best(&graph, vec![entries], self.passes)
    }

    /// The operations of [`Derivation::program`].
    pub fn counts(&self, request: Request) -> Counts {
        Counts::of(&self.program(request))
    }
}
