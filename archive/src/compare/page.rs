//! The page of a comparison, with pictures of what changed most.

use std::{
    f64::consts::PI,
    fmt::Write,
    path::{Path, PathBuf},
};

use toile_capture::files::{atomic_write, is_there};
use toile_geometry::Mesh;
use toile_pipeline::{Folders, json, read_mesh};
use toile_render::{Drawn, View, picture, png, sheet};

use super::{Change, surfaces::distances};
use crate::{ArchiveError, state};

/// How many subjects have pictures.
const PICTURED: usize = 10;
/// Size of a picture, pixels, and the range of distances that it shows, millimetres.
const SIZE: (u32, u32) = (300, 440);
const RANGE_MM: (f32, f32) = (0.0, 10.0);
const DISTANCE: &str = "distance_mm";

/// Writes `compare.html`, `compare.json` and the pictures of the ten subjects that changed most into `folder`; returns the page.
///
/// # Errors
/// [`ArchiveError`] where a mesh cannot be read or a file not be written.
pub fn write(changes: &[Change], archive: &Path, old: &Path, folder: &Path) -> Result<PathBuf, ArchiveError> {
    atomic_write(&folder.join("compare.json"), &json::pretty(&changes)?)?;
    let mut body = summary(changes) + &table(changes);
    for change in changes.iter().filter(|change| change.size() > 0.0).take(PICTURED) {
        let name = format!("{}.png", state::file_name(&change.subject));
        let image =
            pictures(change, &Folders::new(&archive.join(&change.subject)), &Folders::new(&old.join(&change.subject)))?;
        let Some(image) = image else { continue };
        atomic_write(&folder.join(&name), &image)?;
        let (subject, file) = (escaped(&change.subject.to_string_lossy()), escaped(&name.replace('%', "%25")));
        let _ = writeln!(body, "<h2>{subject}</h2>\n<img src=\"{file}\" alt=\"distance to the earlier result\">");
    }
    let page = folder.join("compare.html");
    let html =
        format!("<!doctype html>\n<meta charset=\"utf-8\">\n<title>Comparison</title>\n<style>{STYLE}</style>\n{body}");
    atomic_write(&page, html.as_bytes())?;
    Ok(page)
}

const STYLE: &str = "body{font:15px/1.5 sans-serif;margin:2em auto;max-width:75em;padding:0 1em}\
table{border-collapse:collapse}td,th{padding:.2em .7em;border-bottom:1px solid #ddd;text-align:left;vertical-align:top}\
td.n{text-align:right;white-space:nowrap}";

fn summary(changes: &[Change]) -> String {
    let same = changes.iter().filter(|change| change.is_none()).count();
    let worse =
        changes.iter().filter(|change| verdict_rank(&change.verdicts[1]) > verdict_rank(&change.verdicts[0])).count();
    let better =
        changes.iter().filter(|change| verdict_rank(&change.verdicts[1]) < verdict_rank(&change.verdicts[0])).count();
    format!(
        "<h1>Comparison of {} subjects</h1>\n<p>{same} are the same to the last digit. Verdicts became worse for {worse} and better \
         for {better}. Distances are between the surfaces before and now, both ways; surface within 4 mm of the other counts as \
         common for the overlap. From scan to body is a proxy of accuracy: nobody knows the truth of a real person.</p>\n",
        changes.len()
    )
}

fn verdict_rank(verdict: &str) -> usize {
    ["trusted", "doubtful", "failed"].iter().position(|word| *word == verdict).unwrap_or(3)
}

fn table(changes: &[Change]) -> String {
    let mut rows = String::from(
        "<table><tr><th>subject<th>layer<th>mean, mm<th>95 %, mm<th>overlap<th>scan to body, mm<th>verdict<th>measures</tr>\n",
    );
    for change in changes {
        let measures: Vec<String> =
            change.measures.iter().map(|(n, was, is)| format!("{n} {:+.1} cm", 100.0 * (is - was))).collect();
        let both = |[was, is]: &[String; 2]| if was == is { was.clone() } else { format!("{was} → {is}") };
        let residual = change.residuals_mm.map(|mm| mm.map_or("-".to_string(), |mm| format!("{mm:.2}")));
        for (at, surface) in change.surfaces.iter().enumerate() {
            let [subject, residual, verdict, measures] = if at == 0 {
                let more = change.only.iter().cloned().chain(measures.iter().cloned()).collect::<Vec<_>>().join(", ");
                [change.subject.to_string_lossy().into_owned(), both(&residual), both(&change.verdicts), more]
            } else {
                std::array::from_fn(|_| String::new())
            };
            let _ = writeln!(
                rows,
                "<tr><td>{}<td>{}<td class=n>{:.3}<td class=n>{:.3}<td class=n>{:.4}<td class=n>{residual}<td>{verdict}<td>{}</tr>",
                escaped(&subject),
                escaped(&surface.layer),
                surface.mean_mm,
                surface.p95_mm,
                surface.iou,
                escaped(&measures),
            );
        }
    }
    rows + "</table>\n"
}

/// Front and back of the layer that changed most, coloured by its distance from what it was; `None` where there is no layer in both.
fn pictures(change: &Change, now: &Folders, before: &Folders) -> Result<Option<Vec<u8>>, ArchiveError> {
    let Some(most) = change.surfaces.iter().max_by(|a, b| a.mean_mm.total_cmp(&b.mean_mm)) else { return Ok(None) };
    let file =
        |folders: &Folders| if most.layer == "body" { folders.body_mesh() } else { folders.garment(&most.layer) };
    let (now, before) = (file(now), file(before));
    if !is_there(&now) || !is_there(&before) {
        return Ok(None);
    }
    let (mut mesh, was): (Mesh, Mesh) = (read_mesh(&now)?, read_mesh(&before)?);
    let mm = distances(&mesh, &was).into_iter().map(|(distance, _)| 1e3 * distance).collect();
    mesh.attributes.insert(DISTANCE.into(), mm);
    let wrong = |error: toile_render::RenderError| ArchiveError::refused(&now, error.to_string());
    let mut tiles = Vec::new();
    for (heading, side) in [(0.0, "front"), (PI, "back")] {
        let drawn = [Drawn::attribute(&mesh, DISTANCE, RANGE_MM)];
        let image = picture(&drawn, &View::around(heading, 0.0), SIZE.0, SIZE.1).map_err(wrong)?;
        tiles.push((format!("{} {side}", most.layer), sheet::scale_bar(&image, RANGE_MM, "mm")));
    }
    let image = sheet::contact_sheet(&tiles, 2).map_err(wrong)?;
    png::encode(&image).map(Some).map_err(wrong)
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}
