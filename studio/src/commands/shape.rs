//! `toile shape`: a body by its measures.

use std::path::{Path, PathBuf};

use serde_json::json;
use toile_capture::{files::is_there, printable_path};
use toile_fitting::Wanted;
use toile_pipeline::{Remarks, SHAPE_FILES, ShapeOptions, ShapedAvatar, shape};

use crate::{
    StudioError,
    commands::{output::check_stage, reach::must_exist},
    outcome::Answer,
    session::Session,
};

const AFTER: &str = "\
Writes into the folder OUT: avatar.glb (with skeleton, weights and the walk), body.ply (at rest), measurements.json and .csv, and
shape.json (what was asked for and what the body has). Measures are those of `toile measure`, in metres; the ones that are not given
are the most common beside those that are. A measure that nobody has is refused; two that no body has together are named.
With --from, a subject's own body is changed as little as the measures ask, and its garments go along.

Examples:
  toile shape --stature 1.72 --waist 0.80 --sex woman anna-by-measures
  toile shape --chest 1.02 --waist 0.90 --measure \"calf girth=0.39\" --sex man by-measures
  toile shape --from anna --waist 0.75 anna-slimmer";

/// Whether the body is a woman's or a man's.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub(super) enum Sex {
    Woman,
    Man,
}

/// A body by its measures, without any scan; or a subject with other measures, its garments with it
#[derive(Debug, clap::Args)]
#[command(after_help = AFTER)]
pub struct Shape {
    /// Folder of the result
    out: PathBuf,
    /// Start from this subject instead of from the mean person
    #[arg(long, value_name = "SUBJECT", conflicts_with = "sex")]
    from: Option<PathBuf>,
    /// Where nothing is said, whichever has the measures more commonly
    #[arg(long, value_enum)]
    sex: Option<Sex>,
    /// Height from the soles to the top of the head, metres
    #[arg(long, value_name = "M")]
    stature: Option<f64>,
    /// Largest girth of the trunk below the armpits, metres
    #[arg(long, value_name = "M")]
    chest: Option<f64>,
    /// Girth at the bust points, metres
    #[arg(long, value_name = "M")]
    bust: Option<f64>,
    /// Girth midway between the lowest rib and the hip bone, metres
    #[arg(long, value_name = "M")]
    waist: Option<f64>,
    /// Girth at the greatest prominence of the buttocks, metres
    #[arg(long, value_name = "M")]
    hip: Option<f64>,
    /// Inside leg length: from the soles to the crotch, metres
    #[arg(long, value_name = "M")]
    inseam: Option<f64>,
    /// Straight distance between the shoulder points, metres
    #[arg(long, value_name = "M")]
    shoulder_breadth: Option<f64>,
    /// Smallest girth of the neck, metres
    #[arg(long, value_name = "M")]
    neck: Option<f64>,
    /// Any other measure of `toile measure`, metres; without `left` or `right` both sides
    #[arg(long, value_name = "NAME=M", value_parser = named)]
    measure: Vec<Wanted>,
    /// Settings of the stages; they win over those of SUBJECT/toile.toml
    #[arg(long, value_name = "FILE")]
    settings: Option<PathBuf>,
}

fn named(text: &str) -> Result<Wanted, String> {
    let wrong = || format!("`{text}` is not NAME=METRES, such as \"calf girth=0.39\"");
    let (name, value) = text.split_once('=').ok_or_else(wrong)?;
    Ok(Wanted { name: name.trim().to_lowercase(), value_m: value.trim().parse().map_err(|_| wrong())? })
}

impl Shape {
    fn wanted(&self) -> Vec<Wanted> {
        let given = [
            ("stature", self.stature),
            ("chest", self.chest),
            ("bust", self.bust),
            ("waist", self.waist),
            ("hip", self.hip),
            ("inseam", self.inseam),
            ("shoulder breadth", self.shoulder_breadth),
            ("neck", self.neck),
        ];
        let own = given.into_iter().filter_map(|(name, value)| Some(Wanted { name: name.into(), value_m: value? }));
        own.chain(self.measure.iter().cloned()).collect()
    }

    /// Runs the command.
    ///
    /// # Errors
    /// [`StudioError`] where nobody has such measures, or files cannot be read or written.
    pub fn run(&self, session: &Session) -> Result<Answer, StudioError> {
        if let Some(subject) = &self.from {
            must_exist(subject)?;
        }
        check_out(&self.out)?;
        let options = ShapeOptions {
            wanted: self.wanted(),
            is_woman: self.sex.map(|sex| sex == Sex::Woman),
            from: self.from.clone(),
            settings: self.settings.clone(),
        };
        let ShapedAvatar { files, shaped, crossing, remarks } = shape(&self.out, &options, session.progress.as_ref())?;
        let paths: Vec<String> = files.iter().map(|path| printable_path(path)).collect();
        let mut text: String = paths.iter().map(|path| format!("{path}\n")).collect();
        let width = shaped.reached.iter().map(|r| r.name.len()).max().unwrap_or(0);
        for r in &shaped.reached {
            let cm = |metres: f64| format!("{:.1}", 100.0 * metres);
            let note = if r.is_met() { "" } else { "   not met" };
            text += &format!("{:width$}  {:>6} cm, asked for {:>6}{note}\n", r.name, cm(r.reached_m), cm(r.wanted_m));
        }
        let reached: serde_json::Map<_, _> =
            shaped.reached.iter().map(|r| (r.name.clone(), json!(r.reached_m))).collect();
        let results = json!({
            "files": paths,
            "measurements_m": reached,
            "conflict": shaped.conflict.as_ref().map(|c| &c.names),
            "deviations_from_start": shaped.distance,
            "crossing_pairs": crossing.into_iter().map(|(name, pairs)| (name, json!(pairs))).collect::<serde_json::Map<_, _>>(),
        });
        let Remarks { warnings, lost, failures } = remarks;
        Ok(Answer { text, results, warnings, lost, failures })
    }
}

/// Files of an earlier shape may be replaced, others not.
fn check_out(out: &Path) -> Result<(), StudioError> {
    let is_ours = std::fs::read_to_string(out.join(SHAPE_FILES[0])).is_ok_and(|text| text.contains("\"toile shape\""));
    let kept: Vec<&str> = SHAPE_FILES.into_iter().filter(|name| !is_ours || !is_there(&out.join(name))).collect();
    check_stage(out, "shape", &kept, out)
}
