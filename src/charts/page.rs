//! Pages: text, tables and charts in one HTML file.

use super::error::ChartError;
use super::file::{ending, write};
use std::path::Path;

/// A part of a page under a heading: paragraphs, tables and figures, in the order in which they are added.
#[derive(Clone, Debug, PartialEq)]
pub struct Section {
    heading: String,
    parts: Vec<Part>,
}

#[derive(Clone, Debug, PartialEq)]
enum Part {
    Paragraph(String),
    Table {
        header: Vec<String>,
        rows: Vec<Vec<String>>,
    },
    Figure {
        svg: String,
        caption: String,
    },
}

impl Section {
    /// An empty section.
    pub fn new(heading: impl Into<String>) -> Self {
        Self {
            heading: heading.into(),
            parts: Vec::new(),
        }
    }

    /// Adds a paragraph of plain text.
    #[must_use]
    pub fn paragraph(mut self, text: impl Into<String>) -> Self {
        self.parts.push(Part::Paragraph(text.into()));
        self
    }

    /// Adds a table of plain text: its header, then its rows. Rows may differ in length.
    #[must_use]
    pub fn table<H, R>(
        mut self,
        header: impl IntoIterator<Item = H>,
        rows: impl IntoIterator<Item = R>,
    ) -> Self
    where
        H: Into<String>,
        R: IntoIterator,
        R::Item: Into<String>,
    {
        let row = |row: R| row.into_iter().map(Into::into).collect();
        self.parts.push(Part::Table {
            header: header.into_iter().map(Into::into).collect(),
            rows: rows.into_iter().map(row).collect(),
        });
        self
    }

    /// Adds an SVG picture, such as one of [`Chart::to_svg`](super::Chart::to_svg), with a caption.
    ///
    /// The picture must be one `<svg>` element and goes into the page unchanged; a picture from an unknown source may
    /// contain scripts. Pictures of this module have no `id`s, so that they do not interfere with each other.
    #[must_use]
    pub fn figure(mut self, svg: impl Into<String>, caption: impl Into<String>) -> Self {
        self.parts.push(Part::Figure {
            svg: svg.into(),
            caption: caption.into(),
        });
        self
    }
}

/// An HTML page that needs no other file: sections with a table of contents.
///
/// ```
/// use tfe::charts::{Chart, Page, Section};
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let parabola = Chart::new("").x("x").y("y").line("", [(0.0, 0.0), (1.0, 1.0), (2.0, 4.0)]);
/// let html = Page::new("Report")
///     .section(
///         Section::new("Results")
///             .paragraph("Errors are < 1e-9 & falling.")
///             .table(["step", "error"], [["0.1", "1e-9"], ["0.05", "6e-11"]])
///             .figure(parabola.to_svg()?, "A parabola"),
///     )
///     .to_html()?;
/// assert!(html.contains("Errors are &lt; 1e-9 &amp; falling."));
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Page {
    title: String,
    sections: Vec<Section>,
}

const STYLE: &str = "\
:root { color-scheme: light; }
body { max-width: 60rem; margin: 2rem auto; padding: 0 1rem; font: 16px/1.55 system-ui, sans-serif; color: #1b1b1b; background: #fff; }
h1 { font-size: 1.8rem; line-height: 1.2; } h2 { font-size: 1.3rem; margin-top: 2.5rem; border-bottom: 1px solid #ddd; padding-bottom: .2rem; }
nav { background: #f6f6f6; padding: .6rem 1.2rem; border-radius: .3rem; } nav ol { margin: .3rem 0; } a { color: #0b5c8f; }
table { border-collapse: collapse; margin: 1rem 0; display: block; overflow-x: auto; font-variant-numeric: tabular-nums; }
th, td { text-align: left; padding: .25rem .9rem .25rem 0; border-bottom: 1px solid #e4e4e4; } th { border-bottom: 2px solid #999; }
figure { margin: 1.5rem 0; } figure svg { max-width: 100%; height: auto; } figcaption { color: #555; font-size: .92rem; }
";

impl Page {
    /// An empty page.
    pub fn new(title: impl Into<String>) -> Self {
        Self {
            title: title.into(),
            sections: Vec::new(),
        }
    }

    /// Adds a section.
    #[must_use]
    pub fn section(mut self, section: Section) -> Self {
        self.sections.push(section);
        self
    }

    /// The page as HTML.
    ///
    /// # Errors
    /// [`ChartError::NotSvg`] if a figure is not an `<svg>` element from its beginning to its end.
    pub fn to_html(&self) -> Result<String, ChartError> {
        let title = escaped(&self.title);
        let mut html = format!(
            "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
             <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
             <title>{title}</title>\n<style>\n{STYLE}</style>\n</head>\n<body>\n<h1>{title}</h1>\n"
        );
        self.write_contents(&mut html);
        for (k, section) in self.sections.iter().enumerate() {
            let heading = escaped(&section.heading);
            html += &format!("<section id=\"section-{}\">\n<h2>{heading}</h2>\n", k + 1);
            for part in &section.parts {
                part.write(&mut html)?;
            }
            html += "</section>\n";
        }
        html += "</body>\n</html>\n";
        Ok(html)
    }

    /// Writes the page as a file `.html`.
    ///
    /// # Errors
    /// Those of [`Page::to_html`]; [`ChartError::UnknownEnding`] for another ending; [`ChartError::Io`] if the file
    /// cannot be written.
    pub fn save(&self, path: impl AsRef<Path>) -> Result<(), ChartError> {
        let path = path.as_ref();
        ending(path, &[".html", ".htm"])?;
        write(path, self.to_html()?)
    }

    fn write_contents(&self, html: &mut String) {
        if self.sections.len() < 2 {
            return;
        }
        *html += "<nav>\n<ol>\n";
        for (k, section) in self.sections.iter().enumerate() {
            let heading = escaped(&section.heading);
            *html += &format!("<li><a href=\"#section-{}\">{heading}</a></li>\n", k + 1);
        }
        *html += "</ol>\n</nav>\n";
    }
}

impl Part {
    fn write(&self, html: &mut String) -> Result<(), ChartError> {
        match self {
            Self::Paragraph(text) => *html += &format!("<p>{}</p>\n", escaped(text)),
            Self::Table { header, rows } => {
                *html += "<table>\n<thead>\n";
                write_row(html, header, "th");
                *html += "</thead>\n<tbody>\n";
                for row in rows {
                    write_row(html, row, "td");
                }
                *html += "</tbody>\n</table>\n";
            }
            Self::Figure { svg, caption } => {
                let svg = svg.trim();
                if !(svg.starts_with("<svg") && svg.ends_with("</svg>")) {
                    return Err(ChartError::NotSvg {
                        caption: caption.clone(),
                    });
                }
                let caption = escaped(caption);
                *html +=
                    &format!("<figure>\n{svg}\n<figcaption>{caption}</figcaption>\n</figure>\n");
            }
        }
        Ok(())
    }
}

fn write_row(html: &mut String, cells: &[String], tag: &str) {
    *html += "<tr>";
    for cell in cells {
        *html += &format!("<{tag}>{}</{tag}>", escaped(cell));
    }
    *html += "</tr>\n";
}

/// Plain text as HTML.
fn escaped(text: &str) -> String {
    let mut html = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => html += "&amp;",
            '<' => html += "&lt;",
            '>' => html += "&gt;",
            '"' => html += "&quot;",
            '\n' | '\t' => html.push(c),
            c if c.is_control() => html.push(' '),
            c => html.push(c),
        }
    }
    html
}

#[cfg(test)]
mod tests;
