//! What the report tells, and in which order.

use std::{collections::BTreeMap, path::Path};

use toile_fitting::ScanLandmark;
use toile_garments::GAP_BINS_MM;
use toile_geometry::Mesh;
use toile_render::RenderError;

use crate::{
    PipelineError,
    report::{
        page::{Page, Picture},
        pictures,
    },
};

/// Everything that the report shows.
pub struct Contents {
    /// Name of the subject.
    pub name: String,
    /// Date, number of takes and the like, in one line.
    pub subtitle: String,
    /// One row a take.
    pub takes: Vec<TakeRow>,
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
    /// What to worry about.
    pub warnings: Vec<String>,
    /// Recorded data that was lost.
    pub lost: Vec<String>,
    /// What failed.
    pub failures: Vec<String>,
    /// Scan of each take by layer name.
    pub scans: Vec<(String, Mesh)>,
    /// The conformed body in scan 0's pose and frame.
    pub body: Mesh,
    /// The garments in the same pose and frame by layer name.
    pub garments: Vec<(String, Mesh)>,
    /// Of each garment, the share of its vertices by their gap to the layers below (bins as in stacking's report).
    pub gaps: Vec<(String, Vec<f64>)>,
    /// Cells of the table of what stacking moved, by garment.
    pub stacked: Vec<Vec<String>>,
    /// All layers at some times of the motion, with a caption each.
    pub motion: Vec<(String, Vec<Mesh>)>,
    /// Seconds by stage name.
    pub seconds: BTreeMap<String, f64>,
}

/// What the report says of a take in a line.
pub struct TakeRow {
    /// Name of the layer.
    pub layer: String,
    /// Column and value, the same columns in every row.
    pub cells: Vec<(&'static str, String)>,
}

/// The page as HTML.
///
/// # Errors
/// [`PipelineError::Stage`] where a picture cannot be drawn.
pub fn write(contents: &Contents, at: &Path, progress: &(dyn Fn(f32) + Sync)) -> Result<String, PipelineError> {
    let drawn = |pictures: Result<Vec<Picture>, RenderError>| pictures.map_err(|e| PipelineError::stage(at, e));
    let mut page = Page::new(&contents.name, &contents.subtitle);
    worries(&mut page, contents);
    page.section("The avatar", "All layers in the pose of the first scan, then in motion.");
    let layers: Vec<&Mesh> = std::iter::once(&contents.body).chain(contents.garments.iter().map(|g| &g.1)).collect();
    page.pictures(&drawn(pictures::dressed(&layers))?)?;
    page.pictures(&drawn(pictures::motion(&contents.motion))?)?;
    progress(0.3);
    page.section("Takes", "One turn of the table each; every take adds a layer.");
    takes_table(&mut page, &contents.takes);
    for (layer, scan) in &contents.scans {
        page.subsection(layer);
        page.pictures(&drawn(pictures::scan(scan))?)?;
    }
    progress(0.6);
    page.section("Body", "The body fitted to the first scan. Dark is close, bright is far from it.");
    if let Some((_, scan)) = contents.scans.first() {
        page.pictures(&drawn(pictures::body_over_scan(scan, &contents.body))?)?;
        page.subsection("Landmarks: found (green), set by hand (blue), estimated (ochre)");
        page.pictures(&drawn(pictures::landmarks(scan, &contents.landmarks))?)?;
        page.subsection("Sections of scan (blue) and body (red)");
        page.pictures(&drawn(pictures::sections(scan, &contents.body, &contents.sections))?)?;
    }
    page.section("Measurements", "ISO 8559-1, standing straight; the red lines show where each was taken.");
    page.pictures(&drawn(pictures::measured(&contents.standing, &contents.tapes))?)?;
    let rows: Vec<Vec<String>> = contents.measurements.iter().map(|(k, v)| vec![k.clone(), v.clone()]).collect();
    page.table(&["measurement", "value"], &rows);
    progress(0.8);
    page.section("Garments", "Each as it was cut out, alone and on the body; how sure its border is; what was filled.");
    page.pictures(&drawn(pictures::exploded(&layers))?)?;
    gaps_table(&mut page, &contents.gaps);
    page.table(&STACKED, &contents.stacked);
    for (layer, garment) in &contents.garments {
        page.subsection(layer);
        page.pictures(&drawn(pictures::garment(garment, &contents.body))?)?;
        page.pictures(&drawn(pictures::doubts(garment))?)?;
    }
    page.section("Time", "Seconds of each stage when it last ran.");
    let rows: Vec<Vec<String>> = contents.seconds.iter().map(|(k, v)| vec![k.clone(), format!("{v:.1}")]).collect();
    page.table(&["stage", "seconds"], &rows);
    Ok(page.finish())
}

fn worries(page: &mut Page, contents: &Contents) {
    page.section("What to worry about", "");
    let quiet = contents.failures.is_empty() && contents.lost.is_empty() && contents.warnings.is_empty();
    page.notes("bad", &contents.failures);
    page.notes("bad", &contents.lost);
    page.notes("warn", &contents.warnings);
    if quiet {
        page.notes("good", &["Nothing: every take is whole, every stage trusts its result.".into()]);
    }
}

/// What is told of stacking; "seen" is where the scan saw the garment.
const STACKED: [&str; 11] = [
    "stacking",
    "moved where seen, mean mm",
    "p95 mm",
    "gap aimed at, mm",
    "least gap, mm",
    "crossing pairs",
    "self-crossings added",
    "poking through in the walk, pairs",
    "limbs that meet in the walk, pairs",
    "largest stretch in the walk",
    "hangs free, %",
];

/// Per cent of each garment's vertices by their gap to what is below.
fn gaps_table(page: &mut Page, gaps: &[(String, Vec<f64>)]) {
    let ends = GAP_BINS_MM.map(|end| format!("below {end} mm"));
    let head: Vec<&str> =
        ["gap, % of vertices"].into_iter().chain(ends.iter().map(String::as_str)).chain(["more"]).collect();
    let cells = |shares: &[f64]| shares.iter().map(|s| format!("{:.1}", 100.0 * s)).collect::<Vec<_>>();
    let rows: Vec<Vec<String>> = gaps.iter().map(|(l, s)| [vec![l.clone()], cells(s)].concat()).collect();
    page.table(&head, &rows);
}

fn takes_table(page: &mut Page, takes: &[TakeRow]) {
    let Some(first) = takes.first() else { return };
    let head: Vec<&str> = std::iter::once("take").chain(first.cells.iter().map(|c| c.0)).collect();
    let rows: Vec<Vec<String>> = takes
        .iter()
        .map(|t| std::iter::once(t.layer.clone()).chain(t.cells.iter().map(|c| c.1.clone())).collect())
        .collect();
    page.table(&head, &rows);
}
