//! The values of the observables of a model at the nodes of a motion.

use crate::numbers::row_of;
use tfe_runtime::CoordinateName;

/// The values of the observables that a model declares by `output(name) = …` or, with one column for each site, by
/// `output(name[i in a..b]) = …`: a table with one row for each recorded node.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Outputs {
    pub(super) names: Vec<CoordinateName>,
    pub(super) values: Vec<f64>,
}

impl Outputs {
    /// The names of the columns, in the order of declaration; outputs with sites are called `strain[0]`, `strain[1]`,
    /// …
    pub fn names(&self) -> &[CoordinateName] {
        &self.names
    }

    /// The values of one output at the recorded nodes; `None` if the model declares no output of this name.
    pub fn column(&self, name: &str) -> Option<Vec<f64>> {
        let is_it = |candidate: &CoordinateName| candidate.to_string() == name;
        let at = self.names.iter().position(is_it)?;
        let values = self.values.iter().skip(at);
        Some(values.step_by(self.names.len()).copied().collect())
    }

    /// A row of zeros for a new node; `None` if the model has no outputs.
    pub(super) fn new_row(&mut self) -> Option<&mut [f64]> {
        let (columns, start) = (self.names.len(), self.values.len());
        self.values.resize(start + columns, 0.0);
        match columns {
            0 => None,
            _ => Some(&mut self.values[start..]),
        }
    }

    /// The values of all outputs at one recorded node, in the order of [`names`](Self::names); `None` if there is no
    /// such node and the model has outputs.
    pub fn row(&self, node: usize) -> Option<&[f64]> {
        row_of(&self.values, self.names.len(), node)
    }
}
