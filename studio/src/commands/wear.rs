//! `toile wear`: a garment of another subject put on this one.

use std::path::PathBuf;

use serde_json::{Map, json};
use toile_capture::printable_path;
use toile_character::GarmentType;
use toile_pipeline::{Dressed, Place, WearOptions, put_on, take_off};

use crate::{StudioError, commands::reach::must_exist, outcome::Answer, session::Session};

const AFTER: &str = "\
GARMENT is a layer of another subject that is processed (SUBJECT/LAYER), or a generic garment: t-shirt, shirt, jumper, jacket, coat,
trousers, shorts, skirt. It is resized as the one body differs from the other, put
outside of everything below it without crossings, and is from then on a layer like those that were scanned: `process`, `export`,
`animate` and the console take it along. It is kept in SUBJECT/worn/, with the body that it was cut from, so that the other subject
is not needed again. Takes are not changed.

Examples:
  toile wear alder/jacket birch                     over everything that birch wears
  toile wear alder/jacket birch --under 02-blouse
  toile wear t-shirt birch --name summer            a generic garment
  toile wear jacket birch --off                     take it off again";

/// Put a garment of another subject on this one, resized to its body
#[derive(Debug, clap::Args)]
#[command(after_help = AFTER)]
pub struct Wear {
    /// The garment: SUBJECT/LAYER or the name of a generic one; with --off, the name of the layer
    garment: PathBuf,
    /// Who is to wear it
    subject: PathBuf,
    /// Right over this layer; without, over all
    #[arg(long, value_name = "LAYER", conflicts_with = "under")]
    over: Option<String>,
    /// Right under this layer
    #[arg(long, value_name = "LAYER")]
    under: Option<String>,
    /// What the new layer is called; without, as it was called where it is from
    #[arg(long, value_name = "NAME")]
    name: Option<String>,
    /// Type of the garment: top, trousers, skirt, dress, jacket, hat, shoes, other
    #[arg(long = "type", value_name = "TYPE")]
    garment_type: Option<GarmentType>,
    /// Thickness of its cloth, millimetres
    #[arg(long, value_name = "MM")]
    thickness_mm: Option<f32>,
    /// Take off what was put on as the layer GARMENT
    #[arg(long, conflicts_with_all = ["over", "under", "name", "garment_type", "thickness_mm"])]
    off: bool,
    /// Settings of the stages; they win over those of SUBJECT/toile.toml
    #[arg(long, value_name = "FILE")]
    settings: Option<PathBuf>,
}

impl Wear {
    /// Runs the command.
    ///
    /// # Errors
    /// [`StudioError`] where there is no such garment, the subject cannot wear it, or files cannot be read or written.
    pub fn run(&self, session: &Session) -> Result<Answer, StudioError> {
        must_exist(&self.subject)?;
        let observer = session.progress.as_ref();
        let dressed = if self.off {
            take_off(&self.garment.to_string_lossy(), &self.subject, self.settings.as_deref(), observer)?
        } else {
            put_on(&self.garment, &self.subject, &self.options(), observer)?
        };
        Ok(self.answer(dressed))
    }

    fn options(&self) -> WearOptions {
        let place = match (&self.over, &self.under) {
            (Some(layer), _) => Place::Over(layer.clone()),
            (None, Some(layer)) => Place::Under(layer.clone()),
            (None, None) => Place::Outermost,
        };
        WearOptions {
            place,
            name: self.name.clone(),
            garment_type: self.garment_type,
            thickness_mm: self.thickness_mm,
            settings: self.settings.clone(),
        }
    }

    fn answer(&self, dressed: Dressed) -> Answer {
        let Dressed { layer, source, layers, stacked, files, remarks } = dressed;
        let crossing =
            |(name, report): &(String, toile_garments::LayerReport)| (name.clone(), json!(report.crossing_pairs));
        let crossing: Map<_, _> = stacked.iter().map(crossing).collect();
        let files: Vec<String> = files.iter().map(|path| printable_path(path)).collect();
        let first = if self.off {
            format!("{layer} is taken off")
        } else {
            let pairs = crossing.values().filter_map(serde_json::Value::as_u64).sum::<u64>();
            format!("{layer}, from {source}: {pairs} pairs of triangles cross a layer below")
        };
        let text = format!("{first}\n{}\n", files.join("\n"));
        let results = json!({
            "layer": layer, "source": source, "layers": layers, "crossing_pairs": crossing, "files": files,
        });
        let (warnings, lost, failures) = (remarks.warnings, remarks.lost, remarks.failures);
        Answer { text, results, warnings, lost, failures }
    }
}
