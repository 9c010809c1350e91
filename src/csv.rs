//! Tables of numbers as CSV files.

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::Path;

/// Writes a header and rows; numbers in the shortest form that reads back exactly.
pub(crate) fn write(
    path: &Path,
    header: &[String],
    rows: impl Iterator<Item = Vec<f64>>,
) -> io::Result<()> {
    let mut file = BufWriter::new(File::create(path)?);
    writeln!(file, "{}", header.join(","))?;
    for row in rows {
        for (k, value) in row.iter().enumerate() {
            let separator = if k == 0 { "" } else { "," };
            write!(file, "{separator}{value:?}")?;
        }
        writeln!(file)?;
    }
    file.flush()
}
