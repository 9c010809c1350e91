use super::*;
use crate::charts::{Axis, Chart, HeatMap};
use std::collections::BTreeSet;

fn page() -> Page {
    let chart = Chart::new("A")
        .x(Axis::from("x"))
        .line("l", [(0.0, 0.0), (1.0, 1.0)]);
    let map = HeatMap::new("B", (2, 2), |i, j| Some((i + j) as f64));
    Page::new("<Report>")
        .section(
            Section::new("One & \"two\"")
                .paragraph("<script>alert(1)</script>")
                .table(["a < b", "c"], vec![vec!["1", "<2>"], vec!["3"]]),
        )
        .section(
            Section::new("Pictures")
                .figure(chart.to_svg().unwrap(), "f < g")
                .figure(chart.to_svg().unwrap(), "again")
                .figure(map.to_svg().unwrap(), "a map"),
        )
}

/// The body; the HTML that we write is also valid XML.
fn body(html: &str) -> String {
    let start = html.find("<body>").unwrap();
    let end = html.find("</body>").unwrap() + "</body>".len();
    html[start..end].to_owned()
}

#[test]
fn the_page_is_well_formed_and_its_text_escaped() {
    let html = page().to_html().unwrap();
    let body = body(&html);
    let document = roxmltree::Document::parse(&body).unwrap();
    let texts: Vec<_> = document
        .descendants()
        .filter_map(|node| node.text())
        .collect();
    for text in [
        "<Report>",
        "<script>alert(1)</script>",
        "a < b",
        "<2>",
        "f < g",
    ] {
        assert!(texts.contains(&text), "{text}");
    }
    assert!(!html.contains("<script"));
    assert!(html.contains("<title>&lt;Report&gt;</title>"));
    assert_eq!(html.matches("<figure>").count(), 3);
}

#[test]
fn ids_are_unique_and_the_contents_lead_to_them() {
    let html = page().to_html().unwrap();
    let body = body(&html);
    let document = roxmltree::Document::parse(&body).unwrap();
    let ids: Vec<_> = document
        .descendants()
        .filter_map(|node| node.attribute("id"))
        .collect();
    assert_eq!(ids.iter().collect::<BTreeSet<_>>().len(), ids.len());
    let links: Vec<_> = document
        .descendants()
        .filter(|node| node.has_tag_name("a"))
        .map(|node| node.attribute("href").unwrap().trim_start_matches('#'))
        .collect();
    assert_eq!(links, ids);
}

#[test]
fn errors() {
    let page = Page::new("").section(Section::new("").figure("<p>no picture</p>", "mine"));
    assert!(matches!(page.to_html(), Err(ChartError::NotSvg { caption }) if caption == "mine"));
    let error = Page::new("").save("page.txt").unwrap_err();
    assert!(error.to_string().contains(".html"));
}
