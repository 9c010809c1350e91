//! Flexible bodies with any number of parts: a geometrically exact beam, and a hanging chain described by angles and by
//! rods as constraints. Tables are printed; the path of a page of HTML with charts is printed last.
//!
//! ```text
//! cargo run --release --features sparse --example flexible
//! ```

mod beam;
mod links;

use std::error::Error;
use tfe::charts::Page;

fn main() -> Result<(), Box<dyn Error>> {
    let page = Page::new("Flexible bodies")
        .section(beam::frequencies()?)
        .section(beam::circle()?)
        .section(beam::steps()?)
        .section(beam::whirl()?)
        .section(links::cost()?);
    let path = std::env::temp_dir().join("tfe-flexible.html");
    page.save(&path)?;
    println!("page: {}", path.display());
    Ok(())
}
