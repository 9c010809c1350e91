//! The structure of a model, found without evaluating it.

use std::fmt;

use crate::derive::entry::Entry;
use crate::expr::function::Function;
use crate::expr::graph::{ExprId, Graph, Node};
use crate::expr::input::{Affine, Input};
use crate::expr::ordered::SortedSet;
use crate::expr::sorting::sort;
use crate::model::declared::Form;
use crate::program::Array;

/// Where a block of second derivatives can be non-zero.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Pattern {
    /// These entries (row, column), sorted.
    Entries(Vec<(usize, usize)>),
    /// Entries with these indices, for all values of the loop indices that occur in them.
    Indexed(Vec<(Affine, Affine)>),
}

/// The structure of a model; z is the velocity of a Lagrangian, the momentum of a Hamiltonian.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Structure {
    /// By which function the model is declared.
    pub form: Form,
    /// The number of coordinates.
    pub dof: Affine,
    /// The time or an input appears in the energy function, in a force or in a constraint.
    pub time_dependent: bool,
    /// There are forces or dissipation.
    pub forced: bool,
    /// ∂²/∂z∂z does not depend on z.
    pub quadratic_in_z: bool,
    /// ∂²/∂z∂z depends on parameters only.
    pub constant_mass: bool,
    /// ∂²/∂z∂z is diagonal.
    pub diagonal_mass: bool,
    /// All second derivatives and derivatives of forces depend on parameters and time only, and there are no constraints.
    pub linear: bool,
    /// ∂²/∂z∂q vanishes.
    pub separable: bool,
    /// There are no branches: no `select`, `abs`, `sign`, `min` or `max`.
    pub smooth: bool,
    /// ∂Q/∂q is symmetric and ∂Q/∂z vanishes: the forces have a potential at every time.
    pub symmetric_forces: bool,
    /// Coordinates that the energy function does not depend on and no constraint acts on; empty where indices are not literal.
    pub cyclic: Vec<usize>,
    /// Those of them on which no force acts: their momenta are constant.
    pub conserved: Vec<usize>,
    /// Those of them on which no force depends either, so that the other equations do not contain them. None if there
    /// are constraints.
    pub ignorable: Vec<usize>,
    /// Pattern of ∂²/∂z∂z
    pub zz: Pattern,
    /// Pattern of ∂²/∂z∂q; row z
    pub zq: Pattern,
    /// Pattern of ∂²/∂q∂q
    pub qq: Pattern,
    /// Pattern of ∂Q/∂z
    pub force_z: Pattern,
    /// Pattern of ∂Q/∂q
    pub force_q: Pattern,
}

/// The leaves on which an expression depends.
#[derive(Clone, Copy, Debug, Default)]
struct Dependence {
    time: bool,
    q: bool,
    z: bool,
}

impl Dependence {
    fn of(graph: &Graph, values: &[ExprId]) -> Self {
        let mut found = Self::default();
        for id in graph.reachable(values) {
            if let Node::Input(input) = graph.node(id) {
                match input {
                    Input::Time | Input::Control(_) => found.time = true,
                    Input::Coordinate(_) => found.q = true,
                    Input::Velocity(_) | Input::Momentum(_) => found.z = true,
                    Input::Multiplier(_)
                    | Input::Placeholder(..)
                    | Input::Parameter(_)
                    | Input::ParameterElement(..)
                    | Input::Integer(_) => {}
                }
            }
        }
        found
    }

    /// The same for what decides the choices in these expressions: conditions, and arguments of functions with a kink.
    fn of_choices(graph: &Graph, values: &[ExprId]) -> Self {
        let nodes = graph.reachable(values).into_iter();
        let deciding: Vec<ExprId> = nodes.flat_map(|id| deciding(graph.node(id))).collect();
        Self::of(graph, &deciding)
    }
}

/// The expressions whose signs choose the value of a node.
pub(crate) fn deciding(node: &Node) -> Vec<ExprId> {
    match node {
        Node::Select { left, right, .. } => vec![*left, *right],
        Node::Call {
            function: Function::Abs | Function::Sign | Function::Min | Function::Max,
            arguments,
        } => arguments.clone(),
        _ => Vec::new(),
    }
}

impl Structure {
    /// Determines the structure from the derivatives.
    pub(crate) fn of(graph: &Graph, form: Form, dof: &Affine, entries: &[Entry]) -> Self {
        let of = |array: Array| {
            entries
                .iter()
                .filter(move |entry| entry.place.array == array)
        };
        let values = |arrays: &[Array]| -> Vec<ExprId> {
            let wanted = entries
                .iter()
                .filter(|entry| arrays.contains(&entry.place.array));
            wanted.map(|entry| entry.value).collect()
        };
        let depends = |arrays: &[Array]| Dependence::of(graph, &values(arrays));
        // Conditions appear in the first derivatives only: the derivatives of a step function are zero.
        let chosen = |arrays: &[Array]| Dependence::of_choices(graph, &values(arrays));
        let (constraints, constraints_vary) = constraints(graph, entries);
        let chosen_momenta = chosen(&[Array::ByZ]);
        let chosen_forces = chosen(&[Array::Force]);
        let chosen_rates = chosen(&[Array::ByZ, Array::ByQ, Array::Force]);
        let mass = depends(&[Array::ZZ]);
        let tangent = depends(&[
            Array::ZZ,
            Array::ZQ,
            Array::QQ,
            Array::ForceZ,
            Array::ForceQ,
        ]);
        let pattern = |array: Array| Pattern::of(of(array));
        let zz = pattern(Array::ZZ);
        let cyclic = cyclic(dof, entries);
        let conserved = conserved(&cyclic, entries);
        let ignorable = match constraints {
            true => Vec::new(),
            false => ignorable(graph, &conserved, entries),
        };
        Self {
            form,
            dof: dof.clone(),
            time_dependent: depends(&[Array::Value, Array::Force]).time || constraints_vary,
            forced: of(Array::Force).next().is_some(),
            quadratic_in_z: !(mass.z || chosen_momenta.z),
            constant_mass: !(mass.z || mass.q || mass.time || chosen_momenta.z),
            linear: !(tangent.z || tangent.q || chosen_rates.z || chosen_rates.q || constraints),
            separable: of(Array::ZQ).next().is_none() && !chosen_momenta.q,
            smooth: is_smooth(graph, entries),
            symmetric_forces: of(Array::ForceZ).next().is_none()
                && !(chosen_forces.z || chosen_forces.q)
                && is_symmetric(entries),
            cyclic,
            conserved,
            ignorable,
            diagonal_mass: zz.is_diagonal(),
            zz,
            zq: pattern(Array::ZQ),
            qq: pattern(Array::QQ),
            force_z: pattern(Array::ForceZ),
            force_q: pattern(Array::ForceQ),
        }
    }
}

/// Whether no value is chosen by a sign.
fn is_smooth(graph: &Graph, entries: &[Entry]) -> bool {
    let values: Vec<ExprId> = entries.iter().map(|entry| entry.value).collect();
    (graph.reachable(&values).into_iter()).all(|id| deciding(graph.node(id)).is_empty())
}

/// Whether there are constraints, and whether they depend on the time.
fn constraints(graph: &Graph, entries: &[Entry]) -> (bool, bool) {
    let rows = entries.iter().filter(|entry| {
        matches!(
            entry.place.array,
            Array::Phi(_)
                | Array::Row(_)
                | Array::Drift(_)
                | Array::SitePhi
                | Array::SiteRow
                | Array::SiteDrift
        )
    });
    let values: Vec<ExprId> = rows.map(|entry| entry.value).collect();
    let time = Dependence::of(graph, &values).time;
    (!values.is_empty(), time)
}

/// Whether every entry of ∂Q/∂q has its mirror image.
fn is_symmetric(entries: &[Entry]) -> bool {
    let own = |entry: &Entry| {
        (
            entry.nest.clone(),
            entry.place.row.clone(),
            entry.place.column.clone(),
            entry.value,
        )
    };
    let found: SortedSet<_> = entries
        .iter()
        .filter(|entry| entry.place.array == Array::ForceQ)
        .map(own)
        .collect();
    found.iter().all(|(nest, row, column, value)| {
        found.contains(&(nest.clone(), column.clone(), row.clone(), *value))
    })
}

fn cyclic(dof: &Affine, entries: &[Entry]) -> Vec<usize> {
    let Some(count) = dof
        .as_constant()
        .and_then(|count| usize::try_from(count).ok())
    else {
        return Vec::new();
    };
    let rows = entries
        .iter()
        .filter(|entry| matches!(entry.place.array, Array::ByQ | Array::Row(_)))
        .map(|entry| entry.place.row.as_constant());
    without(0..count, rows)
}

/// The coordinates that are not among these indices; none if one of the indices is not literal.
fn without(
    coordinates: impl Iterator<Item = usize>,
    indices: impl Iterator<Item = Option<i64>>,
) -> Vec<usize> {
    let Some(indices) = indices.collect::<Option<SortedSet<i64>>>() else {
        return Vec::new();
    };
    coordinates
        .filter(|index| i64::try_from(*index).is_ok_and(|index| !indices.contains(&index)))
        .collect()
}

/// The cyclic coordinates on which no force acts; none where indices of forces are not literal.
fn conserved(cyclic: &[usize], entries: &[Entry]) -> Vec<usize> {
    let forces = entries
        .iter()
        .filter(|entry| entry.place.array == Array::Force);
    let pushed = forces.map(|entry| entry.place.row.as_constant());
    without(cyclic.iter().copied(), pushed)
}

/// The conserved coordinates on which no first derivative, force or entry of the mass matrix depends, not even in a
/// condition; none if one depends on a coordinate whose index is not literal.
fn ignorable(graph: &Graph, conserved: &[usize], entries: &[Entry]) -> Vec<usize> {
    let roots: Vec<ExprId> = entries
        .iter()
        .filter(|entry| {
            matches!(
                entry.place.array,
                Array::ByZ | Array::ByQ | Array::Force | Array::ZZ
            )
        })
        .map(|entry| entry.value)
        .collect();
    let held = (graph.reachable(&roots).into_iter()).filter_map(|id| match graph.node(id) {
        Node::Input(Input::Coordinate(index)) => Some(index.as_constant()),
        _ => None,
    });
    without(conserved.iter().copied(), held)
}

impl Pattern {
    fn of<'a>(entries: impl Iterator<Item = &'a Entry>) -> Self {
        let places: SortedSet<(Affine, Affine)> = entries
            .map(|entry| (entry.place.row.clone(), entry.place.column.clone()))
            .collect();
        let literal = |index: &Affine| {
            index
                .as_constant()
                .and_then(|value| usize::try_from(value).ok())
        };
        let numbers: Option<Vec<_>> = places
            .iter()
            .map(|(row, column)| literal(row).zip(literal(column)))
            .collect();
        match numbers {
            Some(mut numbers) => {
                sort(&mut numbers);
                Self::Entries(numbers)
            }
            None => Self::Indexed(places.into_iter().collect()),
        }
    }

    /// Whether the block vanishes.
    pub fn is_empty(&self) -> bool {
        match self {
            Self::Entries(entries) => entries.is_empty(),
            Self::Indexed(entries) => entries.is_empty(),
        }
    }

    /// Whether all entries are known to lie on the diagonal.
    pub fn is_diagonal(&self) -> bool {
        match self {
            Self::Entries(entries) => entries.iter().all(|(row, column)| row == column),
            Self::Indexed(entries) => entries.iter().all(|(row, column)| row == column),
        }
    }

    /// Whether the entry can be non-zero.
    pub fn contains(&self, row: usize, column: usize) -> bool {
        match self {
            Self::Entries(entries) => entries.binary_search(&(row, column)).is_ok(),
            Self::Indexed(_) => true,
        }
    }
}

impl fmt::Display for Pattern {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let entries: Vec<String> = match self {
            Self::Entries(entries) => entries
                .iter()
                .map(|(row, column)| format!("({row},{column})"))
                .collect(),
            Self::Indexed(entries) => entries
                .iter()
                .map(|(row, column)| format!("({row},{column})"))
                .collect(),
        };
        if entries.is_empty() {
            f.write_str("zero")
        } else {
            f.write_str(&entries.join(" "))
        }
    }
}

fn listed(indices: &[usize], letter: char) -> String {
    let names: Vec<String> = indices
        .iter()
        .map(|index| format!("{letter}[{index}]"))
        .collect();
    if names.is_empty() {
        "none".to_owned()
    } else {
        names.join(" ")
    }
}

/// A page for people.
impl fmt::Display for Structure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (letter, z) = match self.form {
            Form::Lagrangian => ('L', 'v'),
            Form::Hamiltonian => ('H', 'p'),
        };
        let yes = |condition: bool| if condition { "yes" } else { "no" };
        let coordinates = match self.dof.as_constant() {
            Some(1) => "coordinate",
            _ => "coordinates",
        };
        writeln!(
            f,
            "declared by             {}, {} {coordinates}",
            self.form.name(),
            self.dof
        )?;
        writeln!(f, "depends on time         {}", yes(self.time_dependent))?;
        writeln!(f, "forces                  {}", yes(self.forced))?;
        writeln!(f, "linear                  {}", yes(self.linear))?;
        writeln!(f, "quadratic in {z}          {}", yes(self.quadratic_in_z))?;
        writeln!(
            f,
            "constant {letter}_{z}{z}           {}",
            match (self.constant_mass, self.diagonal_mass) {
                (true, true) => "yes, diagonal",
                (true, false) => "yes",
                (false, true) => "no, diagonal",
                (false, false) => "no",
            }
        )?;
        writeln!(
            f,
            "separable ({letter}_{z}q = 0)    {}",
            yes(self.separable)
        )?;
        writeln!(f, "smooth                  {}", yes(self.smooth))?;
        writeln!(f, "cyclic coordinates      {}", listed(&self.cyclic, 'q'))?;
        if !self.cyclic.is_empty() {
            writeln!(
                f,
                "conserved momenta       {}",
                listed(&self.conserved, 'p')
            )?;
        }
        writeln!(f, "pattern {letter}_{z}{z}            {}", self.zz)?;
        writeln!(f, "pattern {letter}_{z}q            {}", self.zq)?;
        write!(f, "pattern {letter}_qq            {}", self.qq)?;
        if self.forced {
            writeln!(f)?;
            writeln!(f, "pattern Q_{z}             {}", self.force_z)?;
            write!(f, "pattern Q_q             {}", self.force_q)?;
        }
        Ok(())
    }
}
