//! The takes of a subject in another order, and under other names.
//!
//! Takes and edits carry their layer's number and name in their own names, so a new order renames many files that may swap
//! names with each other. What is to be done stands in `reorder.toml` before anything is done; every file then moves aside,
//! `subject.toml` is written, and every file moves to its new name. Each of these steps can be repeated, so whoever opens
//! the subject after a process was killed goes on where that one stopped.

use std::{
    fs,
    path::{Path, PathBuf},
};

use super::{
    about::{self, About},
    layer::{Layer, check_name},
    reading::Subject,
    reorder_plan::{Move, Plan, is_reordering, plan_path},
};
use crate::{
    CaptureError,
    files::{atomic_write, sync_parent, with_suffix},
};

/// The extension that a file has between its old name and its new one.
const ASIDE: &str = ".reorder";
/// Facts about the body, in the frame of take 0's scan.
const BODY_EDITS: &str = "body.json";

/// What a layer is called from now on.
#[derive(Debug, Clone, PartialEq)]
pub struct NewName {
    /// Name without the number.
    pub name: String,
    /// Type of the garment, for a name that no layer has had yet.
    pub garment: Option<String>,
}

/// What became of the takes.
#[derive(Debug, Clone, PartialEq)]
pub struct Reordered {
    /// The label of each take before and now, such as `02-trousers` and `01-trousers`, in their new order.
    pub takes: Vec<(String, String)>,
    /// What the operator should know, a sentence each.
    pub remarks: Vec<String>,
}

/// Puts the takes in another order; see [`LockedSubject::reorder`](super::LockedSubject::reorder).
pub(super) fn reorder(
    subject: &Subject,
    order: &[usize],
    names: Option<&[NewName]>,
) -> Result<Reordered, CaptureError> {
    let (plan, done) = plan(subject, order, names)?;
    plan.write(subject.folder())?;
    complete_reorder(subject.folder())?;
    Ok(done)
}

/// What has to be done, and what becomes of the takes by it.
fn plan(subject: &Subject, order: &[usize], names: Option<&[NewName]>) -> Result<(Plan, Reordered), CaptureError> {
    let (folder, old) = (subject.folder(), subject.layers());
    let wrong = |reason| CaptureError::format(folder, reason);
    check_order(order, old.len()).map_err(wrong)?;
    let layers = new_layers(old, order, names).map_err(wrong)?;
    let was = order.iter().map(|&number| old[number].label());
    let takes: Vec<(String, String)> = was.zip(layers.iter().map(Layer::label)).collect();
    let moves = moves(folder, order, &takes)?;
    let now = |layer: usize| layers.iter().position(|new| new.name == old[layer].name);
    let remarks = forgotten(old, now).into_iter().chain(moves.iter().filter_map(said_of_body)).collect();
    let about = About { layers: layers.clone(), ..subject.about.clone() };
    let outdated = takes.iter().filter(|(was, is)| was != is).map(|(was, _)| was.clone()).collect();
    let plan = Plan { set_aside: false, subject: about.text(folder, now)?, outdated, moves };
    Ok((plan, Reordered { takes, remarks }))
}

/// Goes on with a new order that an earlier process could not complete; nothing where there is none.
pub(super) fn complete_reorder(folder: &Path) -> Result<(), CaptureError> {
    if !is_reordering(folder) {
        return Ok(());
    }
    let mut plan = Plan::read(folder)?;
    if !plan.set_aside {
        for step in &plan.moves {
            rename(&folder.join(&step.from), &aside(folder, step))?;
        }
        plan.set_aside = true;
        plan.write(folder)?;
    }
    atomic_write(&about::path(folder), plan.subject.as_bytes())?;
    for step in &plan.moves {
        rename(&aside(folder, step), &folder.join(&step.to))?;
    }
    for label in &plan.outdated {
        remove_folder(&folder.join("build").join(label))?;
    }
    let path = plan_path(folder);
    fs::remove_file(&path).map_err(|error| CaptureError::io(&path, error))
}

fn check_order(order: &[usize], takes: usize) -> Result<(), String> {
    let mut sorted = order.to_vec();
    sorted.sort_unstable();
    if sorted.into_iter().eq(0..takes) {
        return Ok(());
    }
    Err(format!("a new order has to name each of its {takes} takes once"))
}

/// The layers in their new order.
fn new_layers(old: &[Layer], order: &[usize], names: Option<&[NewName]>) -> Result<Vec<Layer>, String> {
    let Some(names) = names else {
        return Ok(order.iter().enumerate().map(|(number, &take)| Layer { number, ..old[take].clone() }).collect());
    };
    if names.len() != old.len() {
        return Err(format!(
            "it has {} takes, but {} names were given; give one for each take",
            old.len(),
            names.len()
        ));
    }
    let mut layers: Vec<Layer> = Vec::new();
    for (number, new) in names.iter().enumerate() {
        check_name(&new.name)?;
        if layers.iter().any(|layer| layer.name == new.name) {
            return Err(format!("two layers would be called `{}`; every layer needs a name of its own", new.name));
        }
        let known = old.iter().find(|layer| layer.name == new.name);
        let made = || Layer::new(number, &new.name, new.garment.as_deref());
        layers.push(known.map_or_else(made, |layer| Layer { number, ..layer.clone() }));
    }
    Ok(layers)
}

/// Facts of layers whose name is not used any more, a sentence each.
fn forgotten(old: &[Layer], now: impl Fn(usize) -> Option<usize>) -> Vec<String> {
    let gone = old.iter().enumerate().filter(|&(number, _)| now(number).is_none()).map(|(_, layer)| layer);
    let said = gone.filter_map(|layer| {
        let garment = layer.garment.as_ref().map(|garment| format!("type {garment}"));
        let thickness = layer.thickness_mm.map(|mm| format!("thickness {mm} mm"));
        let notes = Some(&layer.notes).filter(|notes| !notes.is_empty()).map(|notes| format!("notes \"{notes}\""));
        let others = layer.unknown.iter().map(|(key, value)| format!("{key} = {value}"));
        let facts: Vec<String> = garment.into_iter().chain(thickness).chain(notes).chain(others).collect();
        let label = layer.label();
        (!facts.is_empty())
            .then(|| format!("{label} is no layer any more, and what was known of it is gone: {}", facts.join(", ")))
    });
    said.collect()
}

/// Every file that gets another name: what belongs to a take in `takes/`, and edits by hand.
fn moves(folder: &Path, order: &[usize], takes: &[(String, String)]) -> Result<Vec<Move>, CaptureError> {
    let mut moves = Vec::new();
    for place in ["takes", "edits"] {
        for name in names_in(&folder.join(place))? {
            let new = takes
                .iter()
                .find_map(|(was, is)| name.strip_prefix(was)?.strip_prefix('.').map(|end| format!("{is}.{end}")));
            moves.extend(new.map(|new| Move { from: format!("{place}/{name}"), to: format!("{place}/{new}") }));
        }
    }
    for (number, (&take, (was, is))) in order.iter().zip(takes).enumerate() {
        let step = Move { from: body_edits(take, was), to: body_edits(number, is) };
        moves.extend(fs::symlink_metadata(folder.join(&step.from)).is_ok().then_some(step));
    }
    moves.retain(|step| step.from != step.to);
    let in_the_way =
        |path: &str| fs::symlink_metadata(folder.join(path)).is_ok() && moves.iter().all(|step| step.from != path);
    let aside = |step: &Move| format!("{}{ASIDE}", step.to);
    let blocked = moves.iter().flat_map(|step| [step.to.clone(), aside(step)]).find(|path| in_the_way(path));
    match blocked {
        Some(path) => Err(CaptureError::format(
            &folder.join(path),
            "is in the way of a take or edit that would get its name; move it to another place",
        )),
        None => Ok(moves),
    }
}

/// Where facts about the body are kept that are in the frame of a take's scan: they are used while it is take 0.
fn body_edits(number: usize, label: &str) -> String {
    if number == 0 { format!("edits/{BODY_EDITS}") } else { format!("edits/body-of-{label}.json") }
}

/// What is to be said of facts about the body that are used no more.
fn said_of_body(step: &Move) -> Option<String> {
    let (from, to) = (&step.from, &step.to);
    (*from == format!("edits/{BODY_EDITS}")).then(|| {
        format!("{from} was said of a take that is not the first any more; it is kept as {to} and is not used")
    })
}

/// The names in a folder, in order; none where it is missing.
fn names_in(folder: &Path) -> Result<Vec<String>, CaptureError> {
    let entries = match fs::read_dir(folder) {
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(Vec::new()),
        entries => entries.map_err(|error| CaptureError::io(folder, error))?,
    };
    let names: Result<Vec<_>, _> = entries.map(|entry| entry.map(|entry| entry.file_name())).collect();
    let names = names.map_err(|error| CaptureError::io(folder, error))?;
    let mut names: Vec<String> = names.into_iter().filter_map(|name| name.into_string().ok()).collect();
    names.sort();
    Ok(names)
}

fn aside(folder: &Path, step: &Move) -> PathBuf {
    with_suffix(&folder.join(&step.to), ASIDE)
}

/// Renames where there is something to rename, and never over another file.
fn rename(from: &Path, to: &Path) -> Result<(), CaptureError> {
    if fs::symlink_metadata(from).is_err() {
        // An earlier process did it.
        return Ok(());
    }
    if fs::symlink_metadata(to).is_ok() {
        return Err(CaptureError::format(to, format!("is in the way of {}; move it to another place", from.display())));
    }
    fs::rename(from, to).map_err(|error| CaptureError::io(from, error))?;
    sync_parent(to)
}

fn remove_folder(folder: &Path) -> Result<(), CaptureError> {
    match fs::remove_dir_all(folder) {
        Err(error) if error.kind() != std::io::ErrorKind::NotFound => Err(CaptureError::io(folder, error)),
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::*;
    use crate::subject::LockedSubject;

    /// A subject of three takes with an edit and facts about the body.
    fn make(folder: &Path) -> Subject {
        for place in ["takes", "edits", "build/00-body"] {
            fs::create_dir_all(folder.join(place)).unwrap();
        }
        let names =
            ["takes/00-body.mcap", "takes/01-top.mcap", "takes/02-coat.mcap", "edits/02-coat.json", "edits/body.json"];
        names.iter().for_each(|name| fs::write(folder.join(name), name).unwrap());
        let layers = ["body", "top", "coat"].map(|name| format!("[[layers]]\nname = \"{name}\"\n"));
        fs::write(folder.join("subject.toml"), format!("name = \"anna\"\n{}", layers.concat())).unwrap();
        Subject::open(folder).unwrap()
    }

    fn new_order(subject: &Subject) -> Plan {
        let names = ["body", "vest", "coat"].map(|name| NewName { name: name.into(), garment: None });
        plan(subject, &[2, 1, 0], Some(&names)).unwrap().0
    }

    fn content(folder: &Path) -> BTreeMap<String, String> {
        let names = ["takes", "edits", "."]
            .into_iter()
            .flat_map(|p| names_in(&folder.join(p)).unwrap().into_iter().map(move |n| format!("{p}/{n}")));
        names.map(|name| (name.clone(), fs::read_to_string(folder.join(name)).unwrap_or_default())).collect()
    }

    /// The subject after a process did this much of the plan and was killed, and after it was opened again.
    fn after_a_kill(aside_of: usize, set_aside: bool, placed: usize) -> BTreeMap<String, String> {
        let temp = tempfile::tempdir().unwrap();
        let folder = temp.path();
        let plan = new_order(&make(folder));
        plan.write(folder).unwrap();
        plan.moves[..aside_of].iter().for_each(|step| rename(&folder.join(&step.from), &aside(folder, step)).unwrap());
        if set_aside {
            Plan { set_aside, ..plan.clone() }.write(folder).unwrap();
        }
        if placed > 0 {
            fs::write(folder.join("subject.toml"), &plan.subject).unwrap();
        }
        plan.moves[..placed].iter().for_each(|step| rename(&aside(folder, step), &folder.join(&step.to)).unwrap());
        let read = Subject::open(folder).unwrap();
        assert!(read.remarks().iter().any(|remark| remark.contains("interrupted")), "readers are told");
        drop(LockedSubject::open(folder).unwrap());
        content(folder)
    }

    #[test]
    fn whoever_opens_the_subject_next_completes_the_order() {
        let temp = tempfile::tempdir().unwrap();
        let subject = make(temp.path());
        let count = new_order(&subject).moves.len();
        new_order(&subject).write(temp.path()).unwrap();
        complete_reorder(temp.path()).unwrap();
        let expected = content(temp.path());
        let at = |name: &str| expected[name].as_str();
        assert_eq!((at("takes/00-body.mcap"), at("takes/02-coat.mcap")), ("takes/02-coat.mcap", "takes/00-body.mcap"));
        assert_eq!((at("takes/01-vest.mcap"), at("edits/00-body.json")), ("takes/01-top.mcap", "edits/02-coat.json"));
        assert_eq!((at("edits/body-of-02-coat.json"), expected.len(), count), ("edits/body.json", 9, 5));
        for done in 0..=count {
            assert_eq!(after_a_kill(done, false, 0), expected, "{done} files were aside");
            assert_eq!(after_a_kill(count, true, done), expected, "{done} files were in place");
        }
    }

    #[test]
    fn nothing_is_replaced_and_nothing_outside_is_touched() {
        let temp = tempfile::tempdir().unwrap();
        let subject = make(temp.path());
        let before = content(temp.path());
        fs::write(temp.path().join("takes/01-vest.mcap"), "in the way").unwrap();
        let names = ["body", "vest", "coat"].map(|name| NewName { name: name.into(), garment: None });
        let error = reorder(&subject, &[0, 1, 2], Some(&names)).unwrap_err().to_string();
        assert!(error.contains("01-vest.mcap") && error.contains("in the way"), "{error}");
        for (order, said) in [(vec![0, 1], "each of its 3 takes"), (vec![0, 1, 1], "each of its 3 takes")] {
            assert!(reorder(&subject, &order, None).unwrap_err().to_string().contains(said), "{order:?}");
        }
        for (names, said) in [
            (vec!["body"], "3 takes, but 1"),
            (vec!["body", "a", "a"], "two layers"),
            (vec!["body", "A", "b"], "not a layer"),
        ] {
            let names: Vec<NewName> = names.into_iter().map(|n| NewName { name: n.into(), garment: None }).collect();
            assert!(reorder(&subject, &[0, 1, 2], Some(&names)).unwrap_err().to_string().contains(said), "{names:?}");
        }
        fs::remove_file(temp.path().join("takes/01-vest.mcap")).unwrap();
        assert_eq!(content(temp.path()), before, "what is refused changes nothing");
        for bad in ["../x", "/x", ""] {
            let text =
                format!("set_aside = true\nsubject = \"\"\noutdated = []\n[[moves]]\nfrom = \"a\"\nto = \"{bad}\"\n");
            fs::write(plan_path(temp.path()), text).unwrap();
            assert!(LockedSubject::open(temp.path()).unwrap_err().to_string().contains("not in the subject's folder"));
        }
    }
}
