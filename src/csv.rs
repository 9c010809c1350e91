//! Writes tables of numbers as CSV files.

use std::collections::HashSet;
use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::Path;

/// The name of a column.
pub(crate) enum Column {
    /// A name from the model, which is kept.
    Model(String),
    /// A name from the table; underscores are appended if a name of the model is the same.
    Table(String),
}

/// Writes a header and rows, with numbers in the shortest form that reads back exactly.
pub(crate) fn write(
    path: &Path,
    header: &[Column],
    rows: impl Iterator<Item = Vec<f64>>,
) -> io::Result<()> {
    let mut file = BufWriter::new(File::create(path)?);
    writeln!(file, "{}", distinct(header).join(","))?;
    for row in rows {
        for (k, value) in row.iter().enumerate() {
            let separator = if k == 0 { "" } else { "," };
            write!(file, "{separator}{value:?}")?;
        }
        writeln!(file)?;
    }
    file.flush()
}

/// Column names without duplicates.
fn distinct(header: &[Column]) -> Vec<String> {
    let of_model = |column: &Column| match column {
        Column::Model(name) => Some(name.clone()),
        Column::Table(_) => None,
    };
    let mut taken: HashSet<String> = header.iter().filter_map(of_model).collect();
    let name = |column: &Column| match column {
        Column::Model(name) => name.clone(),
        Column::Table(name) => {
            let mut name = name.clone();
            while !taken.insert(name.clone()) {
                name.push('_');
            }
            name
        }
    };
    header.iter().map(name).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_two_columns_have_one_name() {
        let model = |name: &str| Column::Model(name.to_owned());
        let table = |name: &str| Column::Table(name.to_owned());
        let header = [
            table("t"),
            model("x"),
            model("x_dot"),
            table("x_dot"),
            table("x_dot_dot"),
            table("energy"),
            model("energy"),
            model("energy_"),
        ];
        let expected = [
            "t",
            "x",
            "x_dot",
            "x_dot_",
            "x_dot_dot",
            "energy__",
            "energy",
            "energy_",
        ];
        assert_eq!(distinct(&header), expected);
    }
}
