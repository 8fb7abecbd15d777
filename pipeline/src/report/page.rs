//! A page of text, tables and pictures in one HTML file that needs nothing else.

use std::{fmt::Write, path::Path};

use image::RgbImage;
use rayon::prelude::*;
use toile_capture::printable_lines;

use crate::{PipelineError, report::base64};

/// JPEG quality of the pictures.
const QUALITY: u8 = 86;

/// A page that grows from top to bottom.
pub struct Page {
    title: String,
    body: String,
    /// Headings with their anchors, for the links at the top.
    headings: Vec<(String, String)>,
    figures: usize,
}

/// How large pictures stand beside one another.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Width {
    /// Four in a row.
    Small,
    /// Two in a row: hems and seams can be judged.
    Large,
}

/// A picture with the words under it.
pub struct Picture {
    /// Words under the picture.
    pub caption: String,
    /// The picture.
    pub image: RgbImage,
}

impl Page {
    /// An empty page.
    pub fn new(title: &str, subtitle: &str) -> Self {
        let body = format!("<header><h1>{}</h1><p>{}</p></header>\n", escape(title), escape(subtitle));
        Self { title: title.into(), body: body + LINKS_HERE, headings: Vec::new(), figures: 0 }
    }

    /// A heading with an introducing sentence (which may be empty); links at the top of the page lead to it.
    pub fn section(&mut self, heading: &str, introduction: &str) {
        let anchor = anchor(heading);
        let _ = writeln!(self.body, "<h2 id=\"{anchor}\">{}</h2>", escape(heading));
        self.headings.push((heading.into(), anchor));
        if !introduction.is_empty() {
            let _ = writeln!(self.body, "<p class=\"lead\">{}</p>", escape(introduction));
        }
    }

    /// A smaller heading; [`Self::link`] leads to it.
    pub fn subsection(&mut self, heading: &str) {
        let _ = writeln!(self.body, "<h3 id=\"{}\">{}</h3>", anchor(heading), escape(heading));
    }

    /// A list of notes; `class` is `good`, `warn` or `bad`. A note that begins with one of `subjects` and a colon leads
    /// to the heading of that name.
    pub fn notes(&mut self, class: &str, notes: &[String], subjects: &[String]) {
        if notes.is_empty() {
            return;
        }
        let _ = write!(self.body, "<ul class=\"notes {class}\">");
        for note in notes {
            let about = note.split_once(": ").filter(|(name, _)| subjects.iter().any(|s| s == name));
            let _ = match about {
                Some((name, rest)) => write!(self.body, "<li>{}: {}</li>", link(name), escape(rest)),
                None => write!(self.body, "<li>{}</li>", escape(note)),
            };
        }
        self.body.push_str("</ul>\n");
    }

    /// A table; the first column is text, the others are figures. Names in `subjects` lead to their headings.
    pub fn table(&mut self, head: &[&str], rows: &[Vec<String>], subjects: &[String]) {
        if rows.is_empty() {
            return;
        }
        let cell = |text: &str| if subjects.iter().any(|s| s == text) { link(text) } else { escape(text) };
        self.body.push_str("<div class=\"scroll\"><table><thead><tr>");
        for text in head {
            let _ = write!(self.body, "<th>{}</th>", cell(text));
        }
        self.body.push_str("</tr></thead><tbody>");
        for row in rows {
            self.body.push_str("<tr>");
            for text in row {
                let _ = write!(self.body, "<td>{}</td>", cell(text));
            }
            self.body.push_str("</tr>");
        }
        self.body.push_str("</tbody></table></div>\n");
    }

    /// Pictures side by side; each opens alone, as large as the window.
    ///
    /// # Errors
    /// [`PipelineError::Stage`] where a picture cannot be encoded.
    pub fn pictures(&mut self, width: Width, pictures: &[Picture]) -> Result<(), PipelineError> {
        let encoded: Vec<Vec<u8>> = pictures.par_iter().map(|p| jpeg(&p.image)).collect::<Result<_, _>>()?;
        let class = if width == Width::Large { "row large" } else { "row" };
        let _ = write!(self.body, "<div class=\"{class}\">");
        for (Picture { caption, image }, bytes) in pictures.iter().zip(encoded) {
            let (data, caption, id) = (base64::encode(&bytes), escape(caption), self.figures);
            let (width, height) = image.dimensions();
            let _ = write!(
                self.body,
                "<figure id=\"figure-{id}\"><a href=\"#figure-{id}\"><img src=\"data:image/jpeg;base64,{data}\" \
                 alt=\"{caption}\" width=\"{width}\" height=\"{height}\" loading=\"lazy\"></a>\
                 <figcaption>{caption} <a class=\"close\" href=\"#figure-{id}-small\">close</a></figcaption></figure>"
            );
            self.figures += 1;
        }
        self.body.push_str("</div>\n");
        Ok(())
    }

    /// The whole file.
    pub fn finish(self) -> String {
        let links = self.headings.iter().map(|(heading, at)| format!("<a href=\"#{at}\">{}</a>", escape(heading)));
        let links = format!("<nav>{}</nav>\n", links.collect::<Vec<_>>().join(" "));
        let (title, body) = (escape(&self.title), self.body.replacen(LINKS_HERE, &links, 1));
        format!(
            "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
             <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
             <title>{title} · Toile</title>\n<style>{STYLE}</style>\n</head>\n<body>\n<main>\n{body}</main>\n</body>\n</html>\n"
        )
    }
}

/// Where the links to the sections come once all are known.
const LINKS_HERE: &str = "<!-- links -->\n";

/// A heading as the end of a link.
fn anchor(heading: &str) -> String {
    heading.chars().map(|c| if c.is_alphanumeric() { c.to_ascii_lowercase() } else { '-' }).collect()
}

/// A name that leads to the heading of that name.
fn link(name: &str) -> String {
    format!("<a href=\"#{}\">{}</a>", anchor(name), escape(name))
}

fn jpeg(image: &RgbImage) -> Result<Vec<u8>, PipelineError> {
    let mut bytes = Vec::new();
    image::codecs::jpeg::JpegEncoder::new_with_quality(&mut bytes, QUALITY)
        .encode_image(image)
        .map_err(|e| PipelineError::stage(Path::new("report.html"), e))?;
    Ok(bytes)
}

/// Text as it may stand in HTML, control characters escaped.
pub fn escape(text: &str) -> String {
    printable_lines(text).chars().fold(String::with_capacity(text.len()), |mut out, c| {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            c => out.push(c),
        }
        out
    })
}

const STYLE: &str = "
:root { --ink: #26262a; --soft: #6b6b74; --line: #dcdcd8; --page: #fbfbfa; --card: #f4f4f2;
  --good: #2c7a4b; --warn: #a5660b; --bad: #b3261e; }
@media (prefers-color-scheme: dark) { :root { --ink: #e8e8ea; --soft: #a0a0aa; --line: #3a3a40; --page: #1b1b1e;
  --card: #26262a; --good: #6fcf97; --warn: #e6b35a; --bad: #f28b82; } }
* { box-sizing: border-box; }
body { margin: 0; background: var(--page); color: var(--ink); font: 16px/1.5 system-ui, sans-serif; }
main { max-width: 76rem; margin: 0 auto; padding: 2rem 1.25rem 4rem; }
header { border-bottom: 1px solid var(--line); padding-bottom: 1rem; }
h1 { margin: 0; font-size: 2rem; font-weight: 650; }
header p, .lead, figcaption { color: var(--soft); margin: .25rem 0 0; }
h2 { margin: 2.5rem 0 .25rem; font-size: 1.3rem; }
h3 { margin: 1.5rem 0 .25rem; font-size: 1.05rem; }
.row { display: grid; grid-template-columns: repeat(auto-fill, minmax(min(15.5rem, 45%), 1fr)); gap: .75rem;
  margin: .75rem 0; }
.row.large { grid-template-columns: repeat(auto-fill, minmax(min(26rem, 100%), 1fr)); }
figure { margin: 0; }
figure:target { position: fixed; inset: 0; z-index: 1; background: var(--page); display: grid; place-items: center;
  align-content: center; padding: 1rem; }
figure:target img { width: auto; height: calc(100vh - 5rem); max-width: 100%; object-fit: contain; cursor: default; }
.close { display: none; }
figure:target .close { display: inline; }
nav { display: flex; flex-wrap: wrap; gap: .25rem 1.25rem; margin: .75rem 0 0; }
a { color: inherit; text-decoration-color: var(--soft); text-underline-offset: .2em; }
img { display: block; width: 100%; height: auto; cursor: zoom-in; border-radius: 8px; border: 1px solid var(--line); }
figcaption { font-size: .85rem; }
.scroll { overflow-x: auto; }
table { border-collapse: collapse; margin: .75rem 0; font-variant-numeric: tabular-nums; }
th, td { text-align: right; padding: .35rem .9rem .35rem 0; border-bottom: 1px solid var(--line); vertical-align: top; }
th { color: var(--soft); font-weight: 500; }
th:first-child, td:first-child { text-align: left; }
.notes { list-style: none; padding: 0; margin: .75rem 0; }
.notes li { background: var(--card); border-left: 4px solid var(--soft); padding: .5rem .9rem; margin: .4rem 0;
  border-radius: 0 6px 6px 0; }
.good li { border-color: var(--good); }
.warn li { border-color: var(--warn); }
.bad li { border-color: var(--bad); }
";

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_page_holds_its_pictures_and_escapes_its_text() {
        let mut page = Page::new("anna <1>", "two takes");
        page.section("Scans", "");
        page.pictures(Width::Small, &[Picture { caption: "front".into(), image: RgbImage::new(4, 4) }]).unwrap();
        page.table(&["take", "frames"], &[vec!["a & b\u{1b}[2J".into(), "100".into()]], &[]);
        let html = page.finish();
        for part in
            ["anna &lt;1&gt;", "a &amp; b\\u{1b}[2J", "data:image/jpeg;base64,/9j/", "<a href=\"#scans\">Scans</a>"]
        {
            assert!(html.contains(part), "{part} is not in {html}");
        }
        assert!(!html.contains("http"), "the page must work offline");
    }

    #[test]
    fn a_note_leads_to_what_it_is_about() {
        let mut page = Page::new("anna", "");
        page.subsection("01-top");
        page.notes("warn", &["01-top: its hem is unsure".into(), "other: a word".into()], &["01-top".into()]);
        let html = page.finish();
        assert!(html.contains("<h3 id=\"01-top\">") && html.contains("<a href=\"#01-top\">01-top</a>: its hem"));
        assert!(html.contains("<li>other: a word</li>"));
    }
}
