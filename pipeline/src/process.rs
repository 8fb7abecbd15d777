//! All stages in their order: from recorded takes to a dressed avatar and its report.

use std::{fs, path::Path};

use toile_capture::printable_path;
use toile_character::BodyModel;

use crate::{
    Observer, PipelineError, Run, Settings,
    avatar_choice::AvatarChoice,
    body_file::Body,
    exchange,
    garment::{self, Garment},
    json,
    options::{Goal, MotionChoice, Options},
    outfit, record, settings, stale,
    step::Step,
    steps::{
        cut::Cut,
        export::{Export, Exported},
        fit::Fit,
        fuse::Fuse,
        generic::Generic,
        layer_texture::LayerTexturing,
        page::Page,
        pose::PoseUnder,
        read_scan::ReadScan,
        stack::Stack,
        texture::Texturing,
        wear::Wear,
    },
    summary::{Measured, Summary, TakeSummary},
    take_order,
    ticket::Ticket,
    worn,
};

/// Takes the subject at `root` to `goal`, doing whatever is missing.
///
/// # Errors
/// [`PipelineError`] where a stage has no answer or a file cannot be read or written; what was done stays.
pub fn process(root: &Path, goal: Goal, options: &Options, observer: &dyn Observer) -> Result<Summary, PipelineError> {
    let settings = settings::read(Some(root), options.settings.as_deref())?;
    let mut settings = Settings { fusion: options.fusion.over(&settings.fusion), ..settings };
    settings.texture.size = options.texture.unwrap_or(settings.texture.size);
    Texturing::check(root, &settings.texture)?;
    let mut run = Run::open(root, options.last_layer.as_deref(), settings, observer)?;
    if options.dressed && !run.is_first_dressed() {
        run.say_dressed()?;
    }
    // What would fail only after a long time.
    (run.first_garment()..run.layers.len()).try_for_each(|n| garment::given_thickness(&run, n).map(drop))?;
    if goal > Goal::Scans {
        take_order::check_first(&run)?;
    }
    observer.plan(seconds(&run, goal));
    let mut summary = Summary { layers: vec!["body".into()], ..Summary::default() };
    for layer in &run.layers {
        let take = to_scan(&run, layer, &mut summary)?;
        summary.decided.takes.push(take);
    }
    if goal == Goal::Scans {
        summary.files = run.layers.iter().map(|l| run.folders.scan(l)).collect();
    } else {
        let taken_off = take_order::taken_off(&run)?;
        // What comes after it may have no answer just because of the order.
        let because = |error| match &taken_off {
            Some(sentence) => PipelineError::refused(root, format!("{error} (perhaps because of this: {sentence})")),
            None => error,
        };
        summary.remarks.warnings.extend(taken_off.clone());
        to_body(&run, goal, options, &mut summary).map_err(because)?;
    }
    summary.notes.extend(stale::note(&run.folders, goal));
    summary.notes.extend(run.remarks());
    if goal == Goal::Report && options.last_layer.is_none() {
        Ticket::write(&run)?;
    }
    Ok(summary)
}

/// The scan of one take: fused from its recording, or read from a finished one.
fn to_scan(run: &Run, layer: &str, summary: &mut Summary) -> Result<TakeSummary, PipelineError> {
    let mut take = TakeSummary::of(layer);
    match ReadScan::of_layer(run, layer) {
        None => {
            take.fuse = Some(summary.hear(run.step(&Fuse::of_layer(run, layer))?));
            take.texture =
                Texturing::of_layer(run, layer)?.map(|step| run.step(&step)).transpose()?.map(|r| summary.hear(r));
        }
        Some(step) => {
            take.read = Some(summary.hear(run.step(&step)?));
            // Of a recording that the scan replaced.
            remove(&run.folders.trajectory(layer))?;
            Texturing::remove(run, layer)?;
        }
    }
    Ok(take)
}

/// From the scans to the body, and on.
fn to_body(run: &Run, goal: Goal, options: &Options, summary: &mut Summary) -> Result<(), PipelineError> {
    let (model, folders) = (BodyModel::load_default()?, &run.folders);
    let fit = summary.hear(run.step(&Fit::of_subject(run, &model)?)?);
    summary.decided.body = Some(fit);
    let part = summary.decided.body.as_ref().and_then(|fit| fit.part.as_ref());
    summary.measurements = Some(Measured::of(json::read(&folders.body_json())?, part));
    summary.files = vec![folders.body_mesh(), folders.body_json()];
    if goal == Goal::Body {
        return Ok(());
    }
    let body = Body::load(folders, run.first_layer(), &model)?;
    let choice = AvatarChoice::choose_cloth(folders, options)?;
    let garments = dress(run, &model, &body, &choice, summary)?;
    for step in LayerTexturing::of_layers(run, &model, &garments)? {
        summary.hear(run.step(&step)?);
    }
    summary.files = garments.iter().map(|g| folders.garment(&g.layer)).collect();
    if goal == Goal::Garments { Ok(()) } else { deliver(run, &body, &garments, goal, options, summary) }
}

/// The garments of all takes, stacked; a take in which nothing new is worn gives none.
fn dress(
    run: &Run,
    model: &BodyModel,
    body: &Body,
    choice: &AvatarChoice,
    summary: &mut Summary,
) -> Result<Vec<Garment>, PipelineError> {
    let mut garments = Vec::new();
    for number in run.first_garment()..run.layers.len() {
        let pose = match number {
            0 => None,
            _ => Some(summary.hear(run.step(&PoseUnder { run, number, body, model })?)),
        };
        let worn_as = pose.as_ref().map_or(run.first_layer(), |pose| &pose.worn_as_in);
        let record = run.step(&Cut { run, number, worn_as, body })?;
        let is_worn = record.failures.is_empty();
        let cut = summary.hear(record);
        if is_worn {
            garments.push(Garment::new(run, number, &cut)?);
        } else {
            // Also what an earlier run made of it.
            remove(&run.folders.garment(&run.layers[number]))?;
        }
        (summary.decided.takes[number].pose, summary.decided.takes[number].cut) = (pose, Some(cut));
    }
    if choice.generic {
        for garment in &mut garments {
            summary.hear(run.step(&Generic { run, garment, body, model })?);
            garment.is_generic = true;
        }
    }
    let garments = put_on(run, model, body, garments, summary)?;
    let stacked = summary.hear(run.step(&Stack { run, body, garments: &garments, part: choice.part })?);
    summary.decided.stack = Some(stacked);
    summary.layers.extend(garments.iter().map(|g| g.name.clone()));
    Ok(garments)
}

/// The garments with those that were put on from elsewhere among them.
fn put_on(
    run: &Run,
    model: &BodyModel,
    body: &Body,
    garments: Vec<Garment>,
    summary: &mut Summary,
) -> Result<Vec<Garment>, PipelineError> {
    if run.is_whole() {
        for worn in &worn::listed(&run.folders)? {
            summary.hear(run.step(&Wear { run, worn, body, model })?);
        }
    }
    outfit::with_worn(run, garments)
}

/// The avatar's files, and the page.
fn deliver(
    run: &Run,
    body: &Body,
    garments: &[Garment],
    goal: Goal,
    options: &Options,
    summary: &mut Summary,
) -> Result<(), PipelineError> {
    let folders = &run.folders;
    let before = AvatarChoice::read(folders)?;
    let choice = AvatarChoice::choose(folders, options)?;
    if let (MotionChoice::File(given), Some(kept)) = (&options.motion, &choice.motion)
        && given.file_name().is_some_and(|name| name.to_string_lossy() != *kept)
    {
        let name = printable_path(given);
        summary.notes.push(format!("{name} is kept as edits/motion/{kept}: another motion has its name there already"));
    }
    if choice == before {
        summary.notes.extend(choice.in_words().into_iter().map(|what| format!("the avatar keeps {what}")));
    }
    let export = Export { run, body, garments, choice: &choice };
    let earlier = record::read::<Exported>(&export.folder(), Export::NAME).ok().flatten();
    let record = run.step(&export)?;
    let written = earlier.map_or_else(Default::default, |earlier| earlier.outputs);
    exchange::left_over(&folders.root, &written, &record.outputs).iter().try_for_each(|path| remove(path))?;
    summary.decided.avatar = Some(summary.hear(record));
    summary.files = export.outputs();
    if goal == Goal::Report {
        run.step(&Page { run, body, garments, choice: &choice, summary })?;
        summary.files.push(folders.report());
    }
    Ok(())
}

fn remove(path: &Path) -> Result<(), PipelineError> {
    match fs::remove_file(path) {
        Err(error) if error.kind() != std::io::ErrorKind::NotFound => Err(PipelineError::io(path, error)),
        _ => Ok(()),
    }
}

/// Expected seconds to `goal`.
fn seconds(run: &Run, goal: Goal) -> f64 {
    let takes = run.layers.len() as f64;
    let garments = takes - run.first_garment() as f64;
    let costs = [
        (Goal::Scans, takes * (Fuse::SECONDS + Texturing::SECONDS)),
        (Goal::Body, Fit::SECONDS),
        (
            Goal::Garments,
            garments * (PoseUnder::SECONDS + Cut::SECONDS + Stack::SECONDS) + takes * LayerTexturing::SECONDS,
        ),
        (Goal::Avatar, Export::SECONDS),
        (Goal::Report, Page::SECONDS),
    ];
    costs.iter().filter(|c| c.0 <= goal).map(|c| c.1).sum()
}
