//! Garments put on subjects that were not scanned in them, as files: `SUBJECT/worn/`.

mod source;

use std::{
    fs,
    path::{Path, PathBuf},
};

use toile_capture::{LockedSubject, files::atomic_write_all, files::is_there, subject::Layer};
use toile_character::{BodyModel, GarmentType};
use toile_garments::LayerReport;

use self::source::{Found, find};
use crate::{
    Goal, Observer, Options, PipelineError,
    folders::Folders,
    garment::THICKEST_MM,
    process::process,
    step::Remarks,
    worn::{Place, WornFile, WornGarment, contents, listed},
};

/// How something is put on.
#[derive(Debug, Clone, Default)]
pub struct WearOptions {
    /// Where among the layers.
    pub place: Place,
    /// The name of the layer, without its number; as it was called where it is from.
    pub name: Option<String>,
    /// The type of the garment; without, what it was where it is from.
    pub garment_type: Option<GarmentType>,
    /// The thickness of its cloth, millimetres; without, what it was where it is from.
    pub thickness_mm: Option<f32>,
    /// Settings of the stages.
    pub settings: Option<PathBuf>,
}

/// What was put on or taken off.
#[derive(Debug)]
pub struct Dressed {
    /// Name of the layer: `03-jacket`.
    pub layer: String,
    /// Where it is from.
    pub source: String,
    /// All layers of the avatar now, body first.
    pub layers: Vec<String>,
    /// How each garment was stacked, by its name.
    pub stacked: Vec<(String, LayerReport)>,
    /// The files that were asked for.
    pub files: Vec<PathBuf>,
    /// What the operator should know.
    pub remarks: Remarks,
}

/// Puts the garment `given` (`SUBJECT/LAYER`) on the subject at `root` and builds its avatar anew. Where that fails, it is as if
/// nothing had been put on.
///
/// # Errors
/// [`PipelineError`] where there is no such garment, the subject is not processed or wears it already, or a file cannot be read or
/// written.
pub fn put_on(
    given: &Path,
    root: &Path,
    options: &WearOptions,
    observer: &dyn Observer,
) -> Result<Dressed, PipelineError> {
    let model = BodyModel::load_default()?;
    let folders = Folders::new(root);
    let label = {
        // Let go before the run, which takes it itself.
        let subject = LockedSubject::open(root)?;
        if !is_there(&folders.body_json()) {
            let reason = format!("has no body yet; run `toile process {}` first", root.display());
            return Err(PipelineError::refused(root, reason));
        }
        let labels: Vec<String> = subject.layers().iter().map(Layer::label).collect();
        put_away(find(given, &model)?, &folders, &labels, options)?
    };
    let built = build(&label, &folders, options.settings.as_deref(), observer);
    if built.is_err() {
        remove(&folders, &label)?;
    }
    built
}

/// Takes off what was put on, by the name of its layer, and builds the avatar anew.
///
/// # Errors
/// [`PipelineError`] where nothing of that name was put on, or a file cannot be read or written.
pub fn take_off(
    layer: &str,
    root: &Path,
    settings: Option<&Path>,
    observer: &dyn Observer,
) -> Result<Dressed, PipelineError> {
    let folders = Folders::new(root);
    let label = {
        let _lock = LockedSubject::open(root)?;
        let worn = listed(&folders)?;
        let Some(found) = worn.iter().find(|w| w.label == layer || name_of(&w.label) == layer) else {
            let has = worn.iter().map(|w| &*w.label).collect::<Vec<_>>().join(", ");
            let reason =
                if worn.is_empty() { "nothing was put on it".into() } else { format!("what was put on is {has}") };
            return Err(PipelineError::refused(root, format!("there is no `{layer}` to take off: {reason}")));
        };
        remove(&folders, &found.label)?;
        found.label.clone()
    };
    build(&label, &folders, settings, observer)
}

/// Writes the garment into `worn/`, whole or not at all. Returns the name of its layer.
fn put_away(found: Found, folders: &Folders, takes: &[String], options: &WearOptions) -> Result<String, PipelineError> {
    let worn = listed(folders)?;
    let Found { cloth, source, name, garment_type, thickness_mm } = found;
    let garment = cloth.hash();
    if let Some(same) = worn.iter().find(|w| w.file.garment == garment) {
        let (root, label) = (&folders.root, &same.label);
        let reason = format!("wears {source} already, as {label}; take that off first (`--off`)");
        return Err(PipelineError::refused(root, reason));
    }
    let own = takes.iter().find(|label| hash_of_layer(folders, label).is_some_and(|hash| hash == garment));
    if let Some(label) = own {
        return Err(PipelineError::refused(&folders.root, format!("wears {label} already: it was scanned in it")));
    }
    let label = label(options.name.as_deref().unwrap_or(&name), takes, &worn, folders)?;
    let place = placed(&options.place, takes, &worn, folders)?;
    let thickness_mm = options.thickness_mm.or(thickness_mm);
    if let Some(mm) = thickness_mm.filter(|mm| !(0.0..=THICKEST_MM).contains(mm)) {
        let reason = format!("cloth of {mm} mm: it is between 0 and {THICKEST_MM} millimetres thick");
        return Err(PipelineError::refused(&folders.root, reason));
    }
    let garment_type = options.garment_type.unwrap_or(garment_type);
    let file = WornFile { thickness_mm, ..WornFile::new(&source, &cloth, garment_type, place) };
    atomic_write_all(&contents(folders, &label, &cloth, &file)?)?;
    Ok(label)
}

/// SHA-256 of a layer's garment as [`WornFile`] has it, where there is one.
fn hash_of_layer(folders: &Folders, label: &str) -> Option<String> {
    crate::hash::file(&folders.garment(label)).ok()
}

/// `03-jacket` for the garment called `name`: the first number over all takes and what is worn.
fn label(name: &str, takes: &[String], worn: &[WornGarment], folders: &Folders) -> Result<String, PipelineError> {
    let good = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '-' || c == '_';
    if name.is_empty() || name.len() > 40 || !name.chars().all(good) || name.starts_with('-') {
        let name = toile_capture::printable(name);
        let reason = format!("`{name}` is not a name for a layer: use 1 to 40 of a-z, 0-9, - and _ (`--name`)");
        return Err(PipelineError::refused(&folders.root, reason));
    }
    let numbers = takes.iter().chain(worn.iter().map(|w| &w.label)).filter_map(|l| l.split_once('-')?.0.parse().ok());
    let next: usize = numbers.max().map_or(1, |last: usize| last + 1);
    Ok(format!("{next:02}-{name}"))
}

/// The place with the whole name of the layer that it refers to.
fn placed(place: &Place, takes: &[String], worn: &[WornGarment], folders: &Folders) -> Result<Place, PipelineError> {
    let whole = |name: &String| {
        let garments = || takes.iter().filter(|l| folders.garment(l).is_file()).chain(worn.iter().map(|w| &w.label));
        let found = garments().find(|l| *l == name || name_of(l) == name).cloned();
        let has = || garments().cloned().collect::<Vec<_>>().join(", ");
        found.ok_or_else(|| PipelineError::NoLayer { path: folders.root.clone(), layer: name.clone(), has: has() })
    };
    Ok(match place {
        Place::Outermost => Place::Outermost,
        Place::Over(name) => Place::Over(whole(name)?),
        Place::Under(name) => Place::Under(whole(name)?),
    })
}

fn name_of(label: &str) -> &str {
    label.split_once('-').map_or(label, |(_, name)| name)
}

fn build(
    label: &str,
    folders: &Folders,
    settings: Option<&Path>,
    observer: &dyn Observer,
) -> Result<Dressed, PipelineError> {
    let options = Options { settings: settings.map(Path::to_path_buf), ..Options::default() };
    let worn = listed(folders)?;
    let source = worn.iter().find(|w| w.label == label).map_or_else(String::new, |w| w.file.source.clone());
    let summary = process(&folders.root, Goal::Report, &options, observer)?;
    let reports = summary.decided.stack.map_or_else(Vec::new, |stacked| stacked.layers);
    let stacked = summary.layers.iter().skip(1).cloned().zip(reports).collect();
    let mut remarks = summary.remarks;
    remarks.warnings.extend(summary.notes);
    Ok(Dressed { layer: label.into(), source, layers: summary.layers, stacked, files: summary.files, remarks })
}

/// Removes what was put on as `label` and what was built of it.
fn remove(folders: &Folders, label: &str) -> Result<(), PipelineError> {
    // The record goes first: without it, the rest counts as unfinished.
    let gone = |result: std::io::Result<()>, path: &Path| match result {
        Err(error) if error.kind() != std::io::ErrorKind::NotFound => Err(PipelineError::io(path, error)),
        _ => Ok(()),
    };
    let (record, folder, built) = (folders.worn_json(label), folders.worn(label), folders.layer(label));
    gone(fs::remove_file(&record), &record)?;
    gone(fs::remove_dir_all(&folder), &folder)?;
    gone(fs::remove_dir_all(&built), &built)
}
