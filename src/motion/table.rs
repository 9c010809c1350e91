//! The recorded nodes of a motion as a table.

use super::Motion;
use crate::csv::{self, Column};
use crate::length::Length;
use std::io;
use std::path::Path;

impl<const N: usize, L: Length<N>> Motion<N, L> {
    /// Writes the recorded nodes as CSV: time, coordinates, velocities, momenta, energy, outputs, reactions, with a
    /// header line. Numbers are written so that they read back exactly.
    ///
    /// With a time transformation the first column is `tau`, and `t` is among the coordinates. If the model has an
    /// output called `energy`, that output keeps the name, and the energy is the column `energy_`; the same holds for
    /// other names that a coordinate or an output already has.
    ///
    /// # Errors
    /// Those of the file system.
    pub fn write_csv(&self, path: impl AsRef<Path>) -> io::Result<()> {
        let is_coordinate = self.names.iter().any(|name| name.to_string() == "t");
        let time = if is_coordinate { "tau" } else { "t" };
        let (q, outputs, constraints) = (&self.names, &self.outputs.names, &self.reactions.names);
        let mut header = vec![Column::Table(time.to_owned())];
        header.extend(q.iter().map(|name| Column::Model(name.to_string())));
        header.extend(q.iter().map(|name| Column::Table(format!("{name}_dot"))));
        header.extend(q.iter().map(|name| Column::Table(format!("p_{name}"))));
        header.push(Column::Table("energy".to_owned()));
        header.extend(outputs.iter().map(|name| Column::Model(name.to_string())));
        header.extend(
            constraints
                .iter()
                .map(|name| Column::Table(format!("lambda_{name}"))),
        );
        let rows = self.nodes.iter().enumerate().map(|(k, node)| {
            let mut row = vec![node.t];
            for values in [&node.q, &node.v, &node.p] {
                row.extend(values.as_ref());
            }
            row.extend(self.energies.get(k));
            row.extend(self.outputs.row(k).unwrap_or_default());
            row.extend(self.reactions.row(k).unwrap_or_default());
            row
        });
        csv::write(path.as_ref(), &header, rows)
    }
}
