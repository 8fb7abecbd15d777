//! The contents of the report, in their order.

use std::{collections::BTreeMap, path::Path};

use toile_fitting::ScanLandmark;
use toile_garments::GAP_BINS_MM;
use toile_geometry::Mesh;
use toile_render::RenderError;

use crate::{
    PipelineError,
    report::{
        page::{Page, Picture, Width},
        pictures,
    },
    step::Remarks,
};

/// Everything that the report shows.
pub struct Contents {
    /// Name of the subject.
    pub name: String,
    /// Date, number of takes and the like, in one line.
    pub subtitle: String,
    /// Figures of the takes.
    pub takes: Figures,
    /// Figures of the garments.
    pub stacked: Figures,
    /// Measurements: what, and its value with unit.
    pub measurements: Vec<(String, String)>,
    /// Where the tapes lay on the standing body: corners in metres.
    pub tapes: Vec<Vec<[f64; 3]>>,
    /// Landmarks on the first scan.
    pub landmarks: Vec<ScanLandmark>,
    /// Heights (metres) at which scan and body are cut, with their names.
    pub sections: Vec<(String, f64)>,
    /// The body standing straight.
    pub standing: Mesh,
    /// The remarks.
    pub remarks: Remarks,
    /// Scan of each take by layer name.
    pub scans: Vec<(String, Mesh)>,
    /// The conformed body in scan 0's pose and frame.
    pub body: Mesh,
    /// The garments in the same pose and frame by layer name.
    pub garments: Vec<(String, Mesh)>,
    /// Of each garment, the share of its vertices by their gap to the layers below (bins as in stacking's report).
    pub gaps: Vec<(String, Vec<f64>)>,
    /// All layers at some times of the motion and in the T-pose, with a caption each.
    pub motion: Vec<(String, Vec<Mesh>)>,
    /// Seconds by stage name.
    pub seconds: BTreeMap<String, f64>,
}

/// Figures of several layers: a column each, so that the table is never wider than a page.
#[derive(Debug, Default)]
pub struct Figures {
    /// Names of the layers.
    pub layers: Vec<String>,
    /// A name, and its value for each layer.
    pub rows: Vec<(&'static str, Vec<String>)>,
}

impl Figures {
    /// Adds a row: what, and its value for each of the layers.
    pub fn row(&mut self, what: &'static str, values: Vec<String>) {
        self.rows.push((what, values));
    }
}

/// The page as HTML.
///
/// # Errors
/// [`PipelineError::Stage`] where a picture cannot be drawn.
pub fn write(contents: &Contents, at: &Path, progress: &(dyn Fn(f32) + Sync)) -> Result<String, PipelineError> {
    let drawn = |pictures: Result<Vec<Picture>, RenderError>| pictures.map_err(|e| PipelineError::stage(at, e));
    let mut page = Page::new(&contents.name, &contents.subtitle);
    let layers: Vec<String> = contents.scans.iter().map(|s| s.0.clone()).chain(["body".into()]).collect();
    worries(&mut page, &contents.remarks, &layers);
    let meshes: Vec<&Mesh> = std::iter::once(&contents.body).chain(contents.garments.iter().map(|g| &g.1)).collect();
    page.section("The avatar", "All layers in the pose of the first scan, then in motion and in the T-pose.");
    page.pictures(Width::Small, &drawn(pictures::dressed(&meshes))?)?;
    page.pictures(Width::Small, &drawn(pictures::motion(&contents.motion))?)?;
    progress(0.3);
    garments(&mut page, contents, &meshes, &layers, &drawn)?;
    progress(0.6);
    page.section("Takes", "One turn of the table each; every take adds a layer.");
    figures_table(&mut page, "take", &contents.takes, &layers);
    for (layer, scan) in &contents.scans {
        let is_worn = contents.garments.iter().any(|(garment, _)| garment == layer);
        // Links lead to the garment where there is one.
        page.subsection(&if is_worn { format!("{layer} as scanned") } else { layer.clone() });
        page.pictures(Width::Small, &drawn(pictures::scan(scan))?)?;
    }
    progress(0.8);
    body(&mut page, contents, &drawn)?;
    page.section("Time", "Seconds of each stage when it last ran.");
    let rows: Vec<Vec<String>> = contents.seconds.iter().map(|(k, v)| vec![k.clone(), format!("{v:.1}")]).collect();
    page.table(&["stage", "seconds"], &rows, &[]);
    Ok(page.finish())
}

type DrawnPictures<'a> = &'a dyn Fn(Result<Vec<Picture>, RenderError>) -> Result<Vec<Picture>, PipelineError>;

fn worries(page: &mut Page, remarks: &Remarks, layers: &[String]) {
    page.section("What to worry about", "");
    let Remarks { warnings, lost, failures } = remarks;
    if failures.is_empty() && lost.is_empty() && warnings.is_empty() {
        page.notes("good", &["Nothing: every take is whole, every stage trusts its result.".into()], &[]);
        return;
    }
    for (class, heading, notes) in [
        ("bad", "Failed: do it again", failures),
        ("bad", "Lost while recording", lost),
        ("warn", "Look at it", warnings),
    ] {
        if !notes.is_empty() {
            page.subsection(heading);
            page.notes(class, notes, layers);
        }
    }
}

fn garments(
    page: &mut Page,
    contents: &Contents,
    meshes: &[&Mesh],
    layers: &[String],
    drawn: DrawnPictures,
) -> Result<(), PipelineError> {
    page.section("Garments", "Each as it was cut out, alone and on the body. In the maps, bright places want a look.");
    page.pictures(Width::Large, &drawn(pictures::exploded(meshes))?)?;
    figures_table(page, "garment", &contents.stacked, layers);
    gaps_table(page, &contents.gaps, layers);
    for (layer, garment) in &contents.garments {
        page.subsection(layer);
        page.pictures(Width::Large, &drawn(pictures::garment(garment))?)?;
        page.pictures(Width::Small, &drawn(pictures::garment_worn(garment, &contents.body))?)?;
    }
    Ok(())
}

fn body(page: &mut Page, contents: &Contents, drawn: DrawnPictures) -> Result<(), PipelineError> {
    page.section("Body", "The body fitted to the first scan. In the map, bright places are far from it.");
    page.subsection("body");
    if let Some((_, scan)) = contents.scans.first() {
        page.pictures(Width::Small, &drawn(pictures::body_over_scan(scan, &contents.body))?)?;
        page.subsection("Landmarks: found (green), set by hand (blue), estimated (ochre)");
        page.pictures(Width::Small, &drawn(pictures::landmarks(scan, &contents.landmarks))?)?;
        page.subsection("Sections of scan (blue) and body (red)");
        page.pictures(Width::Small, &drawn(pictures::sections(scan, &contents.body, &contents.sections))?)?;
    }
    page.section(
        "Measurements",
        "By the definitions of ISO 8559-1, standing straight; the red lines show where each was taken.",
    );
    page.pictures(Width::Small, &drawn(pictures::measured(&contents.standing, &contents.tapes))?)?;
    let rows: Vec<Vec<String>> = contents.measurements.iter().map(|(k, v)| vec![k.clone(), v.clone()]).collect();
    page.table(&["measurement", "value"], &rows, &[]);
    Ok(())
}

/// Per cent of each garment's vertices by their gap to what is below.
fn gaps_table(page: &mut Page, gaps: &[(String, Vec<f64>)], layers: &[String]) {
    let ends = GAP_BINS_MM.map(|end| format!("below {end} mm"));
    let head: Vec<&str> =
        ["gap, % of vertices"].into_iter().chain(ends.iter().map(String::as_str)).chain(["more"]).collect();
    let cells = |shares: &[f64]| shares.iter().map(|s| format!("{:.1}", 100.0 * s)).collect::<Vec<_>>();
    let rows: Vec<Vec<String>> = gaps.iter().map(|(l, s)| [vec![l.clone()], cells(s)].concat()).collect();
    page.table(&head, &rows, layers);
}

fn figures_table(page: &mut Page, corner: &str, figures: &Figures, layers: &[String]) {
    if figures.layers.is_empty() {
        return;
    }
    let head: Vec<&str> = std::iter::once(corner).chain(figures.layers.iter().map(String::as_str)).collect();
    let row = |(what, values): &(&'static str, Vec<String>)| [vec![what.to_string()], values.clone()].concat();
    page.table(&head, &figures.rows.iter().map(row).collect::<Vec<_>>(), layers);
}

#[cfg(test)]
mod tests {
    use toile_garments::PosedReport;

    use super::*;
    use crate::look::Look;

    #[test]
    fn crossings_in_the_motion_stand_under_what_to_worry_about() {
        let calm = PosedReport::default();
        let crossed = PosedReport { crossing_pairs_most: 45, ..calm.clone() };
        let look = Look {
            motion: "walk".into(),
            layers: vec!["01-trousers".into()],
            in_motion: vec![crossed],
            in_t_pose: vec![calm],
        };
        let mut page = Page::new("anna", "");
        let remarks = Remarks { warnings: look.warnings(), ..Remarks::default() };
        worries(&mut page, &remarks, &["01-trousers".into()]);
        let html = page.finish();
        let (_, below) = html.split_once("What to worry about</h2>").unwrap();
        assert!(
            below.contains("Look at it</h3>") && below.contains("in the motion `walk` a layer below pokes through it")
        );
        assert!(below.contains("up to 45 pairs") && !below.contains("Nothing: every take is whole"), "{below}");
    }
}
