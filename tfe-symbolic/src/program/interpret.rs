//! Runs a program on `f64`, with exactly the operations of the emitted code: the interpreter is the oracle of the
//! emitted code.

use std::fmt;

use crate::expr::input::{Affine, IndexSymbol, Input, LoopVariable};
use crate::expr::ordered::SortedMap;
use crate::program::place::{Array, Place};
use crate::program::{Operand, Operation, Program, Statement, Temporary};

/// What a kernel is given.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Environment {
    /// t
    pub time: f64,
    /// q
    pub q: Vec<f64>,
    /// Velocities of a Lagrangian, momenta of a Hamiltonian; for constraints, velocities
    pub z: Vec<f64>,
    /// Scalar fields by name
    pub parameters: SortedMap<String, f64>,
    /// Array fields by name
    pub arrays: SortedMap<String, Vec<f64>>,
    /// The multipliers of the constraints
    pub mu: Vec<f64>,
    /// Const parameters and lengths by name
    pub sizes: SortedMap<String, i64>,
    /// Lists of indices by name
    pub lists: SortedMap<String, Vec<usize>>,
}

/// What a kernel computes. Entries that a program does not write are zero. There are as many constraints as multipliers.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Results {
    /// L or H
    pub value: f64,
    /// ∂/∂z
    pub z: Vec<f64>,
    /// ∂/∂q
    pub q: Vec<f64>,
    /// Generalized forces
    pub force: Vec<f64>,
    /// ∂²/∂z∂z by rows
    pub zz: Vec<Vec<f64>>,
    /// ∂²/∂z∂q; row z
    pub zq: Vec<Vec<f64>>,
    /// ∂²/∂q∂q
    pub qq: Vec<Vec<f64>>,
    /// ∂Q/∂z; row: the coordinate of the force
    pub force_z: Vec<Vec<f64>>,
    /// ∂Q/∂q
    pub force_q: Vec<Vec<f64>>,
    /// The observables by number
    pub observables: Vec<f64>,
    /// φ of constraints, by number
    pub phi: Vec<f64>,
    /// A, a row for each constraint
    pub rows: Vec<Vec<f64>>,
    /// a of constraints
    pub drift: Vec<f64>,
    /// ∂ψ/∂q, a row for each constraint
    pub psi_q: Vec<Vec<f64>>,
    /// Ȧ, a row for each constraint
    pub row_rates: Vec<Vec<f64>>,
    /// ∂(Aᵀμ)/∂q
    pub bend: Vec<Vec<f64>>,
    /// ∂(Ȧᵀμ)/∂q
    pub rate_q: Vec<Vec<f64>>,
    /// ∂(Ȧᵀμ)/∂v
    pub rate_v: Vec<Vec<f64>>,
}

/// Why a program cannot run.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum InterpretError {
    /// The environment has no parameter, array or size of this name.
    Missing {
        /// The name
        name: String,
    },
    /// An index outside of its array.
    OutOfRange {
        /// The array
        array: String,
        /// The index
        index: i64,
        /// Its length
        length: usize,
    },
    /// An index that leaves the 64-bit integers.
    Overflow,
    /// A temporary or a loop index used where it has no value: the program is not well formed.
    Unassigned,
}

impl fmt::Display for InterpretError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Missing { name } => write!(f, "`{name}` has no value"),
            Self::OutOfRange {
                array,
                index,
                length,
            } => {
                write!(f, "index {index} of `{array}` is outside of 0..{length}")
            }
            Self::Overflow => f.write_str("an index is too large"),
            Self::Unassigned => f.write_str("a value is used before it is computed"),
        }
    }
}

impl std::error::Error for InterpretError {}

/// Runs a program.
///
/// # Errors
/// A name without a value, an index outside of its array, or a program that is not well formed.
pub fn interpret(program: &Program, environment: &Environment) -> Result<Results, InterpretError> {
    let n = environment.q.len();
    let block = || vec![vec![0.0; n]; n];
    let constraints = environment.mu.len();
    let rows = || vec![vec![0.0; n]; constraints];
    let results = Results {
        value: 0.0,
        z: vec![0.0; n],
        q: vec![0.0; n],
        force: vec![0.0; n],
        zz: block(),
        zq: block(),
        qq: block(),
        force_z: block(),
        force_q: block(),
        observables: Vec::new(),
        phi: vec![0.0; constraints],
        rows: rows(),
        drift: vec![0.0; constraints],
        psi_q: rows(),
        row_rates: rows(),
        bend: block(),
        rate_q: block(),
        rate_v: block(),
    };
    let temporaries = vec![None; program.temporaries as usize];
    let mut machine = Machine {
        environment,
        temporaries,
        loops: SortedMap::new(),
        results,
    };
    machine.run(&program.statements)?;
    Ok(machine.results)
}

struct Machine<'a> {
    environment: &'a Environment,
    temporaries: Vec<Option<f64>>,
    loops: SortedMap<LoopVariable, i64>,
    results: Results,
}

impl Machine<'_> {
    /// Recursion is as deep as the loops nest.
    fn run(&mut self, statements: &[Statement]) -> Result<(), InterpretError> {
        for statement in statements {
            match statement {
                Statement::Let { target, operation } => {
                    let value = self.operation(operation)?;
                    self.set(*target, value)?;
                }
                Statement::SineCosine {
                    sine,
                    cosine,
                    argument,
                } => {
                    let (s, c) = self.operand(argument)?.sin_cos();
                    self.set(*sine, s)?;
                    self.set(*cosine, c)?;
                }
                Statement::Accumulator {
                    target,
                    start: value,
                }
                | Statement::Assign { target, value } => {
                    let value = self.operand(value)?;
                    self.set(*target, value)?;
                }
                Statement::Accumulate { target, value } => {
                    let sum = self.temporary(*target)? + self.operand(value)?;
                    self.set(*target, sum)?;
                }
                Statement::Loop {
                    variable,
                    start,
                    end,
                    body,
                } => {
                    let (start, end) = (self.index(start)?, self.index(end)?);
                    let outer = self.loops.get(variable).copied();
                    for i in start..end {
                        self.loops.insert(*variable, i);
                        self.run(body)?;
                    }
                    match outer {
                        Some(outer) => self.loops.insert(*variable, outer),
                        None => self.loops.remove(variable),
                    };
                }
                Statement::Store {
                    output,
                    value,
                    accumulate,
                } => {
                    let value = self.operand(value)?;
                    let place = self.place(output)?;
                    *place = if *accumulate { *place + value } else { value };
                }
                Statement::Balance { output, length } => self.balance(output, length)?,
                Statement::Clear { array } => self.clear(*array),
            }
        }
        Ok(())
    }

    fn operation(&self, operation: &Operation) -> Result<f64, InterpretError> {
        Ok(match operation {
            Operation::Add(a, b) => self.operand(a)? + self.operand(b)?,
            Operation::Subtract(a, b) => self.operand(a)? - self.operand(b)?,
            Operation::Multiply(a, b) => self.operand(a)? * self.operand(b)?,
            Operation::Divide(a, b) => self.operand(a)? / self.operand(b)?,
            Operation::Negate(a) => -self.operand(a)?,
            Operation::IntegerPower(a, n) => self.operand(a)?.powi(*n),
            Operation::Power(a, b) => self.operand(a)?.powf(self.operand(b)?),
            Operation::Call(function, arguments) => {
                let arguments: Result<Vec<f64>, _> = arguments
                    .iter()
                    .map(|argument| self.operand(argument))
                    .collect();
                function.evaluate(&arguments?)
            }
            Operation::Select {
                comparison,
                left,
                right,
                then,
                otherwise,
            } => {
                let chosen = comparison.holds(self.operand(left)?, self.operand(right)?);
                let (then, otherwise) = (self.operand(then)?, self.operand(otherwise)?);
                if chosen { then } else { otherwise }
            }
        })
    }

    fn operand(&self, operand: &Operand) -> Result<f64, InterpretError> {
        match operand {
            Operand::Temporary(temporary) => self.temporary(*temporary),
            Operand::Constant(value) => Ok(*value),
            Operand::Input(input) => self.input(input),
        }
    }

    fn input(&self, input: &Input) -> Result<f64, InterpretError> {
        let missing = |name: &String| InterpretError::Missing { name: name.clone() };
        let environment = self.environment;
        match input {
            Input::Time => Ok(environment.time),
            Input::Coordinate(index) => self.element("q", &environment.q, index),
            Input::Velocity(index) | Input::Momentum(index) => {
                self.element("z", &environment.z, index)
            }
            Input::Multiplier(index) => self.element("mu", &environment.mu, index),
            Input::Control(name) | Input::Parameter(name) => environment
                .parameters
                .get(name)
                .copied()
                .ok_or_else(|| missing(name)),
            Input::ParameterElement(name, index) => {
                let array = environment.arrays.get(name).ok_or_else(|| missing(name))?;
                self.element(name, array, index)
            }
            Input::Integer(index) => Ok(self.index(index)? as f64),
            Input::Placeholder(..) => Err(InterpretError::Unassigned),
        }
    }

    fn element(&self, name: &str, array: &[f64], index: &Affine) -> Result<f64, InterpretError> {
        let index = self.index(index)?;
        let element = usize::try_from(index).ok().and_then(|at| array.get(at));
        element.copied().ok_or_else(|| InterpretError::OutOfRange {
            array: name.to_owned(),
            index,
            length: array.len(),
        })
    }

    fn index(&self, affine: &Affine) -> Result<i64, InterpretError> {
        let mut total = affine.constant;
        for (symbol, factor) in &affine.terms {
            let value = match symbol {
                IndexSymbol::Loop(variable) => {
                    *self.loops.get(variable).ok_or(InterpretError::Unassigned)?
                }
                IndexSymbol::Entry(name, place) => self.entry_of(name, place)?,
                IndexSymbol::Within(_) => 0,
                IndexSymbol::ConstParameter(name) | IndexSymbol::Field(name) => {
                    let size = self.environment.sizes.get(name);
                    *size.ok_or_else(|| InterpretError::Missing { name: name.clone() })?
                }
            };
            let term = value.checked_mul(*factor).ok_or(InterpretError::Overflow)?;
            total = total.checked_add(term).ok_or(InterpretError::Overflow)?;
        }
        Ok(total)
    }

    /// An entry of a list of indices.
    fn entry_of(&self, name: &str, place: &Affine) -> Result<i64, InterpretError> {
        let missing = || InterpretError::Missing {
            name: name.to_owned(),
        };
        let list = self.environment.lists.get(name).ok_or_else(missing)?;
        let index = self.index(place)?;
        let found = usize::try_from(index).ok().and_then(|at| list.get(at));
        let found = found.ok_or_else(|| InterpretError::OutOfRange {
            array: name.to_owned(),
            index,
            length: list.len(),
        })?;
        number(*found)
    }

    fn temporary(&self, temporary: Temporary) -> Result<f64, InterpretError> {
        self.temporaries
            .get(temporary.0 as usize)
            .copied()
            .flatten()
            .ok_or(InterpretError::Unassigned)
    }

    fn set(&mut self, temporary: Temporary, value: f64) -> Result<(), InterpretError> {
        let place = self
            .temporaries
            .get_mut(temporary.0 as usize)
            .ok_or(InterpretError::Unassigned)?;
        *place = Some(value);
        Ok(())
    }

    fn balance(&mut self, output: &Place, length: &Affine) -> Result<(), InterpretError> {
        for k in 0..self.index(length)? {
            let mut sum = 0.0;
            for l in (0..self.index(length)?).filter(|l| *l != k) {
                sum -= *self.place(&output.further(l, k))?;
            }
            *self.place(&output.further(k, k))? = sum;
            *self.place(&output.further(k, k).transposed())? = sum;
        }
        Ok(())
    }

    fn place(&mut self, output: &Place) -> Result<&mut f64, InterpretError> {
        let (row, column) = (self.index(&output.row)?, self.index(&output.column)?);
        let results = &mut self.results;
        match output.array {
            Array::Value => Ok(&mut results.value),
            Array::Observable(number) => Ok(element_of(&mut results.observables, number)),
            Array::SiteObservable => {
                let number = usize::try_from(row).map_err(|_| InterpretError::Overflow)?;
                Ok(element_of(&mut results.observables, number))
            }
            Array::ByZ => entry(&mut results.z, row),
            Array::ByQ => entry(&mut results.q, row),
            Array::Force => entry(&mut results.force, row),
            Array::ZZ => entry(entry(&mut results.zz, row)?, column),
            Array::ZQ => entry(entry(&mut results.zq, row)?, column),
            Array::QQ => entry(entry(&mut results.qq, row)?, column),
            Array::ForceZ => entry(entry(&mut results.force_z, row)?, column),
            Array::ForceQ => entry(entry(&mut results.force_q, row)?, column),
            Array::SitePhi => entry(&mut results.phi, row),
            Array::Phi(k) => entry(&mut results.phi, number(k)?),
            Array::SiteRow => entry(entry(&mut results.rows, row)?, column),
            Array::Row(k) => entry(entry(&mut results.rows, number(k)?)?, row),
            Array::SiteDrift => entry(&mut results.drift, row),
            Array::Drift(k) => entry(&mut results.drift, number(k)?),
            Array::PsiQ(k) => entry(entry(&mut results.psi_q, number(k)?)?, row),
            Array::RowRate(k) => entry(entry(&mut results.row_rates, number(k)?)?, row),
            Array::Bend => entry(entry(&mut results.bend, row)?, column),
            Array::RateQ => entry(entry(&mut results.rate_q, row)?, column),
            Array::RateV => entry(entry(&mut results.rate_v, row)?, column),
        }
    }

    fn clear(&mut self, array: Array) {
        let results = &mut self.results;
        let row = |rows: &mut Vec<Vec<f64>>, number: usize| {
            if let Some(row) = rows.get_mut(number) {
                row.fill(0.0);
            }
        };
        match array {
            Array::Value => results.value = 0.0,
            Array::Observable(_) | Array::SiteObservable => results.observables.fill(0.0),
            Array::ByZ => results.z.fill(0.0),
            Array::ByQ => results.q.fill(0.0),
            Array::Force => results.force.fill(0.0),
            Array::ZZ => results.zz.iter_mut().for_each(|row| row.fill(0.0)),
            Array::ZQ => results.zq.iter_mut().for_each(|row| row.fill(0.0)),
            Array::QQ => results.qq.iter_mut().for_each(|row| row.fill(0.0)),
            Array::ForceZ => results.force_z.iter_mut().for_each(|row| row.fill(0.0)),
            Array::ForceQ => results.force_q.iter_mut().for_each(|row| row.fill(0.0)),
            Array::Phi(_) | Array::SitePhi => results.phi.fill(0.0),
            Array::Drift(_) | Array::SiteDrift => results.drift.fill(0.0),
            Array::SiteRow => results.rows.iter_mut().for_each(|row| row.fill(0.0)),
            Array::Row(number) => row(&mut results.rows, number),
            Array::PsiQ(number) => row(&mut results.psi_q, number),
            Array::RowRate(number) => row(&mut results.row_rates, number),
            Array::Bend => results.bend.iter_mut().for_each(|row| row.fill(0.0)),
            Array::RateQ => results.rate_q.iter_mut().for_each(|row| row.fill(0.0)),
            Array::RateV => results.rate_v.iter_mut().for_each(|row| row.fill(0.0)),
        }
    }
}

/// An element of a list that grows as far as it is written.
fn element_of(list: &mut Vec<f64>, number: usize) -> &mut f64 {
    if list.len() <= number {
        list.resize(number + 1, 0.0);
    }
    &mut list[number]
}

fn number(number: usize) -> Result<i64, InterpretError> {
    i64::try_from(number).map_err(|_| InterpretError::Overflow)
}

fn entry<T>(array: &mut [T], index: i64) -> Result<&mut T, InterpretError> {
    let length = array.len();
    let out_of_range = || InterpretError::OutOfRange {
        array: "the results".to_owned(),
        index,
        length,
    };
    let at = usize::try_from(index).map_err(|_| out_of_range())?;
    array.get_mut(at).ok_or_else(out_of_range)
}
