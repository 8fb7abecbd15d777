//! Whether the avatar is older than what it was made from.

use crate::{
    PipelineError,
    folders::Folders,
    hash,
    options::Goal,
    record,
    step::Step,
    steps::export::{Export, Exported},
};

/// A sentence where a run to `goal` left an avatar that is older than its body or garments.
pub fn note(folders: &Folders, goal: Goal) -> Option<String> {
    if goal >= Goal::Avatar || !folders.glb().exists() {
        return None;
    }
    // An avatar whose record cannot be read is built again by the next export, which then says so.
    is_stale(folders).unwrap_or(true).then(|| {
        let name = folders.root.display();
        format!("{name}/avatar.glb is older than what it is made from; `toile process {name}` builds it again")
    })
}

fn is_stale(folders: &Folders) -> Result<bool, PipelineError> {
    let Some(record) = record::read::<Exported>(&folders.avatar(), Export::NAME)? else { return Ok(true) };
    let has_changed = |(path, was): (&String, &String)| hash::file(&folders.root.join(path)).ok().as_ref() != Some(was);
    Ok(record.inputs.iter().any(has_changed))
}
