//! A page of text, tables and pictures in one HTML file that needs nothing else.

use std::fmt::Write;

use image::RgbImage;

use crate::{PipelineError, report::base64};

/// JPEG quality of the pictures.
const QUALITY: u8 = 86;

/// A page that grows from top to bottom.
pub struct Page {
    title: String,
    body: String,
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
        Self { title: title.into(), body }
    }

    /// A heading with an introducing sentence (which may be empty).
    pub fn section(&mut self, heading: &str, introduction: &str) {
        let _ = writeln!(self.body, "<h2>{}</h2>", escape(heading));
        if !introduction.is_empty() {
            let _ = writeln!(self.body, "<p class=\"lead\">{}</p>", escape(introduction));
        }
    }

    /// A smaller heading.
    pub fn subsection(&mut self, heading: &str) {
        let _ = writeln!(self.body, "<h3>{}</h3>", escape(heading));
    }

    /// A list of notes; `class` is `good`, `warn` or `bad`.
    pub fn notes(&mut self, class: &str, notes: &[String]) {
        if notes.is_empty() {
            return;
        }
        let _ = write!(self.body, "<ul class=\"notes {class}\">");
        for note in notes {
            let _ = write!(self.body, "<li>{}</li>", escape(note));
        }
        self.body.push_str("</ul>\n");
    }

    /// A table; the first column is text, the others are figures.
    pub fn table(&mut self, head: &[&str], rows: &[Vec<String>]) {
        if rows.is_empty() {
            return;
        }
        self.body.push_str("<div class=\"scroll\"><table><thead><tr>");
        for cell in head {
            let _ = write!(self.body, "<th>{}</th>", escape(cell));
        }
        self.body.push_str("</tr></thead><tbody>");
        for row in rows {
            self.body.push_str("<tr>");
            for cell in row {
                let _ = write!(self.body, "<td>{}</td>", escape(cell));
            }
            self.body.push_str("</tr>");
        }
        self.body.push_str("</tbody></table></div>\n");
    }

    /// Pictures side by side.
    ///
    /// # Errors
    /// [`PipelineError::Stage`] where a picture cannot be encoded.
    pub fn pictures(&mut self, pictures: &[Picture]) -> Result<(), PipelineError> {
        self.body.push_str("<div class=\"row\">");
        for Picture { caption, image } in pictures {
            let (data, caption) = (base64::encode(&jpeg(image)?), escape(caption));
            let (width, height) = image.dimensions();
            let _ = write!(
                self.body,
                "<figure><img src=\"data:image/jpeg;base64,{data}\" alt=\"{caption}\" width=\"{width}\" \
                 height=\"{height}\" loading=\"lazy\"><figcaption>{caption}</figcaption></figure>"
            );
        }
        self.body.push_str("</div>\n");
        Ok(())
    }

    /// The whole file.
    pub fn finish(self) -> String {
        let (title, body) = (escape(&self.title), self.body);
        format!(
            "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
             <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
             <title>{title} · Toile</title>\n<style>{STYLE}</style>\n</head>\n<body>\n<main>\n{body}</main>\n</body>\n</html>\n"
        )
    }
}

fn jpeg(image: &RgbImage) -> Result<Vec<u8>, PipelineError> {
    let mut bytes = Vec::new();
    image::codecs::jpeg::JpegEncoder::new_with_quality(&mut bytes, QUALITY)
        .encode_image(image)
        .map_err(|e| PipelineError::stage(std::path::Path::new("report.html"), e))?;
    Ok(bytes)
}

/// Text as it may stand in HTML.
pub fn escape(text: &str) -> String {
    text.chars().fold(String::with_capacity(text.len()), |mut out, c| {
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
figure { margin: 0; max-width: 300px; }
img { display: block; max-width: 100%; height: auto; border-radius: 8px; border: 1px solid var(--line); }
figcaption { font-size: .85rem; }
.scroll { overflow-x: auto; }
table { border-collapse: collapse; margin: .75rem 0; font-variant-numeric: tabular-nums; }
th, td { text-align: right; padding: .35rem .9rem .35rem 0; border-bottom: 1px solid var(--line); white-space: nowrap; }
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
        page.pictures(&[Picture { caption: "front".into(), image: RgbImage::new(4, 4) }]).unwrap();
        page.table(&["take", "frames"], &[vec!["a & b".into(), "100".into()]]);
        page.notes("warn", &["the turn is not closed".into()]);
        let html = page.finish();
        assert!(
            html.contains("anna &lt;1&gt;")
                && html.contains("a &amp; b")
                && html.contains("data:image/jpeg;base64,/9j/")
        );
        assert!(!html.contains("http"), "the page must work offline");
    }
}
