//! The entries of the results of all kernels, each with its formula.

use tfe_symbolic::program::interpret::Results;

use super::formula::{Id, Input};
use super::writer::Model;

/// The arrays of results, named as in [`Results`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Array {
    Value,
    ByZ,
    ByQ,
    Force,
    ZZ,
    ZQ,
    QQ,
    ForceZ,
    ForceQ,
    Observable,
    Phi,
    Row,
    Drift,
    PsiQ,
    RowRate,
    Bend,
    RateQ,
    RateV,
}

/// One number among the results.
#[derive(Clone, Debug)]
pub struct Entry {
    pub name: String,
    pub array: Array,
    pub row: usize,
    pub column: usize,
    /// By the chain rule in forward mode.
    pub formula: Id,
    /// Of derivatives of an energy, the same with the first derivative in reverse mode.
    pub reverse: Id,
}

impl Entry {
    /// Its value; entries that a program does not write are zero.
    pub fn of(&self, results: &Results) -> f64 {
        let (row, column) = (self.row, self.column);
        let vector = |vector: &Vec<f64>| vector.get(row).copied().unwrap_or(0.0);
        let matrix = |matrix: &Vec<Vec<f64>>| {
            let row = matrix.get(row);
            row.and_then(|row| row.get(column)).copied().unwrap_or(0.0)
        };
        match self.array {
            Array::Value => results.value,
            Array::ByZ => vector(&results.z),
            Array::ByQ => vector(&results.q),
            Array::Force => vector(&results.force),
            Array::Observable => vector(&results.observables),
            Array::Phi => vector(&results.phi),
            Array::Drift => vector(&results.drift),
            Array::ZZ => matrix(&results.zz),
            Array::ZQ => matrix(&results.zq),
            Array::QQ => matrix(&results.qq),
            Array::ForceZ => matrix(&results.force_z),
            Array::ForceQ => matrix(&results.force_q),
            Array::Row => matrix(&results.rows),
            Array::PsiQ => matrix(&results.psi_q),
            Array::RowRate => matrix(&results.row_rates),
            Array::Bend => matrix(&results.bend),
            Array::RateQ => matrix(&results.rate_q),
            Array::RateV => matrix(&results.rate_v),
        }
    }
}

/// All entries; those that vanish identically, too.
pub fn entries(model: &mut Model) -> Vec<Entry> {
    let mut list = List {
        model,
        entries: Vec::new(),
    };
    list.energy();
    list.forces();
    for (number, value) in list.model.outputs.clone().into_iter().enumerate() {
        list.push(Array::Observable, number, 0, value);
    }
    list.constraints();
    list.entries
}

struct List<'a> {
    model: &'a mut Model,
    entries: Vec<Entry>,
}

impl List<'_> {
    fn push(&mut self, array: Array, row: usize, column: usize, formula: Id) {
        self.push_both(array, row, column, [formula; 2]);
    }

    fn push_both(&mut self, array: Array, row: usize, column: usize, formulas: [Id; 2]) {
        let [formula, reverse] = formulas;
        let name = match array {
            Array::Value => "Value".to_owned(),
            Array::ByZ
            | Array::ByQ
            | Array::Force
            | Array::Observable
            | Array::Phi
            | Array::Drift => format!("{array:?}[{row}]"),
            _ => format!("{array:?}[{row}, {column}]"),
        };
        self.entries.push(Entry {
            name,
            array,
            row,
            column,
            formula,
            reverse,
        });
    }

    fn slope(&mut self, of: Id, by: Input) -> Id {
        self.model.formulas.slope(of, by)
    }

    fn energy(&mut self) {
        let (energy, n) = (self.model.energy, self.model.dof);
        self.push(Array::Value, 0, 0, energy);
        let zero = self.model.formulas.integer(0);
        let gradient = self.model.formulas.gradient(energy);
        for i in 0..n {
            let by = [Input::Velocity(i), Input::Coordinate(i)];
            let [by_z, by_q] = by.map(|by| {
                let reverse = gradient.get(&by).copied().unwrap_or(zero);
                [self.slope(energy, by), reverse]
            });
            self.push_both(Array::ByZ, i, 0, by_z);
            self.push_both(Array::ByQ, i, 0, by_q);
            for j in 0..n {
                let (z, q) = (Input::Velocity(j), Input::Coordinate(j));
                let second = by_z.map(|first| self.slope(first, q));
                self.push_both(Array::ZQ, i, j, second);
                let second = by_z.map(|first| self.slope(first, z));
                self.push_both(Array::ZZ, i, j, second);
                let second = by_q.map(|first| self.slope(first, q));
                self.push_both(Array::QQ, i, j, second);
            }
        }
    }

    fn forces(&mut self) {
        let zero = self.model.formulas.integer(0);
        for i in 0..self.model.dof {
            let mut force = zero;
            for (at, value) in self.model.forces.clone() {
                if at == i {
                    force = self.model.formulas.add(force, value);
                }
            }
            if let Some(dissipation) = self.model.dissipation {
                let slope = self.slope(dissipation, Input::Velocity(i));
                force = self.model.formulas.subtract(force, slope);
            }
            self.push(Array::Force, i, 0, force);
            for j in 0..self.model.dof {
                let by_z = self.slope(force, Input::Velocity(j));
                let by_q = self.slope(force, Input::Coordinate(j));
                self.push(Array::ForceZ, i, j, by_z);
                self.push(Array::ForceQ, i, j, by_q);
            }
        }
    }

    fn constraints(&mut self) {
        let n = self.model.dof;
        let constraints = self.model.constraints.clone();
        if constraints.is_empty() {
            return;
        }
        let zero = self.model.formulas.integer(0);
        // Aᵀμ and Ȧᵀμ
        let (mut reaction, mut rate) = (vec![zero; n], vec![zero; n]);
        for (number, value) in constraints.into_iter().enumerate() {
            let of_velocity = |input: &Input| matches!(input, Input::Velocity(_));
            let inputs = self.model.formulas.inputs_of(value);
            let holonomic = !inputs.iter().any(of_velocity);
            let psi = if holonomic {
                let drift = self.slope(value, Input::Time);
                self.push(Array::Phi, number, 0, value);
                self.push(Array::Drift, number, 0, drift);
                self.model.formulas.rate(value)
            } else {
                let drift = self.model.formulas.at_rest(value);
                self.push(Array::Drift, number, 0, drift);
                value
            };
            let mu = self.model.formulas.input(Input::Multiplier(number));
            for i in 0..n {
                let by_q = Input::Coordinate(i);
                let by = if holonomic { by_q } else { Input::Velocity(i) };
                let row = self.slope(value, by);
                let row_rate = self.model.formulas.rate(row);
                let psi_q = self.slope(psi, by_q);
                self.push(Array::Row, number, i, row);
                self.push(Array::RowRate, number, i, row_rate);
                self.push(Array::PsiQ, number, i, psi_q);
                let formulas = &mut self.model.formulas;
                let weighted = formulas.multiply(mu, row);
                reaction[i] = formulas.add(reaction[i], weighted);
                let weighted = formulas.multiply(mu, row_rate);
                rate[i] = formulas.add(rate[i], weighted);
            }
        }
        for i in 0..n {
            for j in 0..n {
                let bend = self.slope(reaction[i], Input::Coordinate(j));
                let rate_q = self.slope(rate[i], Input::Coordinate(j));
                let rate_v = self.slope(rate[i], Input::Velocity(j));
                self.push(Array::Bend, i, j, bend);
                self.push(Array::RateQ, i, j, rate_q);
                self.push(Array::RateV, i, j, rate_v);
            }
        }
    }
}
