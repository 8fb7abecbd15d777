//! A subject that this process may change.

use std::{
    fs,
    ops::Deref,
    path::{Path, PathBuf},
};

use super::{
    about::About,
    date::today,
    layer::{BODY, Layer, check_name, split_number},
    lock::SubjectLock,
    pending::{Note, PendingTake},
    reading::{RECORDING, Subject},
    reorder::{NewName, Reordered, complete_reorder, reorder},
    scan_take::ScanTake,
};
use crate::{CaptureError, files::sync_parent};

/// A subject that this process alone may change, until the value is dropped. It reads like a [`Subject`].
///
/// A take becomes part of it in four steps: [`Self::next_take`] (or [`Self::retake`]), [`Self::announce`], recording,
/// [`Self::accept`]. A process that is killed in between loses nothing: the next one that opens the subject completes
/// what was recorded whole.
#[derive(Debug)]
pub struct LockedSubject {
    subject: Subject,
    is_new: bool,
    /// The take that an interrupted run had recorded, and that was completed on opening.
    completed: Option<Note>,
    /// What was being recorded when an earlier run was killed.
    interrupted: Option<Note>,
    _lock: SubjectLock,
}

impl Deref for LockedSubject {
    type Target = Subject;

    fn deref(&self) -> &Subject {
        &self.subject
    }
}

impl LockedSubject {
    /// Opens a subject for writing. A take that was recorded but not yet entered in `subject.toml` when the program was
    /// killed is entered; a retake that was interrupted is completed.
    ///
    /// # Errors
    /// [`CaptureError::Busy`] where another process writes it; as [`Subject::open`].
    pub fn open(folder: &Path) -> Result<Self, CaptureError> {
        About::read(folder)?;
        Self::repaired(folder, SubjectLock::acquire(folder)?)
    }

    /// Creates a subject that is called like its folder, dated today.
    ///
    /// # Errors
    /// [`CaptureError`] where it exists already or cannot be written.
    pub fn create(folder: &Path) -> Result<Self, CaptureError> {
        let (lock, exists) = lock_folder(folder)?;
        if exists {
            return Err(CaptureError::format(folder, "the subject exists already"));
        }
        Self::new(folder, lock)
    }

    /// Opens a subject, or creates it where it is missing.
    ///
    /// # Errors
    /// As [`Self::open`] and [`Self::create`].
    pub fn open_or_create(folder: &Path) -> Result<Self, CaptureError> {
        let (lock, exists) = lock_folder(folder)?;
        if exists { Self::repaired(folder, lock) } else { Self::new(folder, lock) }
    }

    /// Sets what the rig is called and saves.
    ///
    /// # Errors
    /// [`CaptureError`] where `subject.toml` cannot be written.
    pub fn set_rig(&mut self, rig: &str) -> Result<(), CaptureError> {
        self.subject.about.rig = rig.to_string();
        self.save()
    }

    /// Sets what the subject is called and saves.
    ///
    /// # Errors
    /// [`CaptureError`] where `subject.toml` cannot be written.
    pub fn set_name(&mut self, name: &str) -> Result<(), CaptureError> {
        self.subject.about.name = name.to_string();
        self.save()
    }

    /// The next take, of a garment of type `garment`. `name` comes without a number, or with the number that the take will
    /// get.
    ///
    /// # Errors
    /// [`CaptureError`] where the name is unusable or taken, or carries another number.
    pub fn next_take(&self, name: &str, garment: Option<&str>) -> Result<PendingTake, CaptureError> {
        let wrong = |reason: String| Err(CaptureError::format(self.folder(), reason));
        let number = self.layers().len();
        let (given, name) = split_number(name);
        check_name(name).map_err(|reason| CaptureError::format(self.folder(), reason))?;
        if self.layer(name).is_some() {
            return wrong(format!(
                "there is a layer `{name}` already; replace its take with --retake or choose another name"
            ));
        }
        if let Some(given) = given.filter(|given| *given != number) {
            return wrong(format!(
                "`{given:02}-{name}` has the number {given}, but the next take is number {number}; give the name without \
                 a number"
            ));
        }
        Ok(self.pending(Layer::new(number, name, garment)))
    }

    /// The first take of a subject that was never recorded undressed: it shows the person in what `name` says, of type
    /// `garment`.
    ///
    /// # Errors
    /// [`CaptureError`] where the name is unusable or `body`, or there are takes already.
    pub fn dressed_take(&self, name: &str, garment: Option<&str>) -> Result<PendingTake, CaptureError> {
        let wrong = |reason: String| Err(CaptureError::format(self.folder(), reason));
        let (_, name) = split_number(name);
        check_name(name).map_err(|reason| CaptureError::format(self.folder(), reason))?;
        if !self.layers().is_empty() {
            return wrong(
                "--dressed is of the first take only, and the subject has takes already: leave it out".into(),
            );
        }
        if name == BODY {
            return wrong(
                "a dressed take is not called `body`: name it after what is worn, such as --layer clothes".into(),
            );
        }
        Ok(self.pending(Layer::new(0, name, garment)))
    }

    fn pending(&self, layer: Layer) -> PendingTake {
        let path = self.take_path(&layer);
        PendingTake { layer, path, rig: String::new(), source: String::new(), retake: false }
    }

    /// A new take of an existing layer: only when it is accepted does the old one move to `takes/rejected/`.
    ///
    /// # Errors
    /// [`CaptureError`] where there is no such layer.
    pub fn retake(&self, name: &str, garment: Option<&str>) -> Result<PendingTake, CaptureError> {
        let Some(layer) = self.layer(name) else {
            let names: Vec<_> = self.layers().iter().map(|layer| layer.name.as_str()).collect();
            let reason = format!("there is no layer `{name}` to retake; there are: {}", names.join(", "));
            return Err(CaptureError::format(self.folder(), reason));
        };
        let mut layer = layer.clone();
        layer.garment = garment.filter(|_| layer.name != BODY).map(String::from).or(layer.garment);
        if let Some(path) = self.whole_retake(&layer) {
            // Recorded, but never accepted (the program ended between): nothing that was captured is lost.
            self.reject(&path, &layer)?;
        }
        let path = self.retake_path(&layer);
        Ok(PendingTake { layer, path, rig: String::new(), source: String::new(), retake: true })
    }

    /// Notes on disk that `take` is being recorded, so that it can be completed with its type and rig by whoever opens
    /// the subject next, should this process be killed.
    ///
    /// # Errors
    /// [`CaptureError`] where the note cannot be written.
    pub fn announce(&self, take: &PendingTake) -> Result<(), CaptureError> {
        Note::of(take).write(self.folder())
    }

    /// Makes a finished recording part of the subject; returns where a replaced take was kept.
    ///
    /// # Errors
    /// [`CaptureError`] where the recording is missing or the files cannot be moved.
    pub fn accept(&mut self, take: PendingTake) -> Result<Option<PathBuf>, CaptureError> {
        if !take.path.is_file() && !ScanTake::is_at(&take.path) {
            return Err(CaptureError::format(&take.path, "the take was not recorded"));
        }
        self.enter(take.layer, take.rig, take.retake)
    }

    /// The take of layer `name` where an interrupted run had recorded it from `source`, and opening has just completed
    /// it: the same work need not be done again.
    pub fn completed(&self, name: &str, source: &str) -> Option<&Layer> {
        let note = self.completed.as_ref().filter(|note| !note.retake && note.source == source)?;
        self.layer(split_number(name).1).filter(|layer| layer.number == note.number)
    }

    /// True where the half recording of layer `name` that an interrupted run left is an import's, which can be repeated.
    pub fn was_importing(&self, name: &str) -> bool {
        let is_import = |note: &Note| !note.source.is_empty() && note.layer.name == split_number(name).1;
        self.interrupted.as_ref().is_some_and(is_import)
    }

    /// Forgets a take that will not be recorded. A subject that was created for it is removed, unless its folder holds
    /// anything else.
    pub fn give_up(self) {
        let folder = self.folder();
        drop(Note::remove(folder));
        let has_takes = fs::read_dir(self.takes_folder()).is_ok_and(|mut entries| entries.next().is_some());
        if self.is_new && !has_takes {
            drop(fs::remove_file(folder.join("subject.toml")));
            drop(fs::remove_dir(self.takes_folder()));
            drop(fs::remove_dir(folder));
        }
    }

    /// Puts the takes in another order, and gives them other names where `names` has them.
    ///
    /// Take `order[i]` becomes take i; `names[i]` is what its layer is then called. Without `names` each take keeps its name,
    /// type and other facts. A name that a layer has already brings that layer's facts with it, whichever take it had. Takes
    /// and edits by hand are renamed, never changed; what was built of takes that got another name is removed. A process
    /// that is killed meanwhile loses nothing: the next one that opens the subject completes the work.
    ///
    /// # Errors
    /// [`CaptureError`] where `order` does not name every take once, a name is unusable or stands twice, a file is in the way
    /// (nothing is changed then), or a file cannot be renamed.
    pub fn reorder(&mut self, order: &[usize], names: Option<&[NewName]>) -> Result<Reordered, CaptureError> {
        let done = reorder(&self.subject, order, names)?;
        self.subject = Subject::open(self.folder())?;
        Ok(done)
    }

    fn new(folder: &Path, lock: SubjectLock) -> Result<Self, CaptureError> {
        let absolute = std::path::absolute(folder).map_err(|error| CaptureError::io(folder, error))?;
        let name = absolute.file_name().map_or_else(|| "subject".into(), |name| name.to_string_lossy().into_owned());
        let about = About { name, date: today(), ..About::default() };
        let subject = Subject { folder: folder.to_path_buf(), about };
        let locked = Self { subject, is_new: true, completed: None, interrupted: None, _lock: lock };
        locked.save()?;
        Ok(locked)
    }

    /// Opens a subject and completes what an interrupted run left.
    fn repaired(folder: &Path, lock: SubjectLock) -> Result<Self, CaptureError> {
        complete_reorder(folder)?;
        let entered = About::read(folder)?;
        let subject = Subject::open(folder)?;
        let interrupted = Note::read(folder);
        let mut locked = Self { subject, is_new: false, completed: None, interrupted, _lock: lock };
        locked.complete_pending()?;
        locked.complete_retakes()?;
        if locked.about != entered {
            locked.save()?;
        }
        Note::remove(folder)?;
        Ok(locked)
    }

    /// Completes the take that `pending.toml` names, where its recording is whole.
    fn complete_pending(&mut self) -> Result<(), CaptureError> {
        let Some(note) = Note::read(self.folder()) else { return Ok(()) };
        if note.retake && note.number < self.layers().len() && self.whole_retake(&note.layer).is_some() {
            self.enter(note.layer.clone(), note.rig.clone(), true)?;
        }
        let is_entered = self.layers().get(note.number).is_some_and(|layer| layer.name == note.layer.name);
        if is_entered && self.take_path(&note.layer).exists() {
            self.completed = Some(note);
        }
        Ok(())
    }

    fn complete_retakes(&self) -> Result<(), CaptureError> {
        for layer in self.layers() {
            if !self.take_path(layer).exists() && self.whole_retake(layer).is_some() {
                self.replace_take(layer)?;
            }
        }
        Ok(())
    }

    fn enter(&mut self, layer: Layer, rig: String, retake: bool) -> Result<Option<PathBuf>, CaptureError> {
        let kept = if retake { self.replace_take(&layer)? } else { None };
        let about = &mut self.subject.about;
        match about.layers.get_mut(layer.number) {
            Some(old) => *old = layer,
            None => about.layers.push(layer),
        }
        if about.rig.is_empty() {
            about.rig = rig;
        }
        self.save()?;
        Note::remove(self.folder())?;
        Ok(kept)
    }

    fn save(&self) -> Result<(), CaptureError> {
        self.about.write(self.folder())
    }

    /// Moves the old take away and the new one to its place.
    fn replace_take(&self, layer: &Layer) -> Result<Option<PathBuf>, CaptureError> {
        let old = self.take_path(layer);
        let new = self.whole_retake(layer).unwrap_or_else(|| self.retake_path(layer));
        let kept = if old.exists() { Some(self.reject(&old, layer)?) } else { None };
        let name = format!("{}.{}", layer.label(), extension(&new));
        let path = self.takes_folder().join(name);
        fs::rename(&new, &path).map_err(|error| CaptureError::io(&new, error))?;
        sync_parent(&path)?;
        Ok(kept)
    }

    fn reject(&self, old: &Path, layer: &Layer) -> Result<PathBuf, CaptureError> {
        let folder = self.takes_folder().join("rejected");
        fs::create_dir_all(&folder).map_err(|error| CaptureError::io(&folder, error))?;
        let name = |n: u32| format!("{}.{n}.{}", layer.label(), extension(old));
        let free = (1_u32..).map(|n| folder.join(name(n))).find(|path| !path.exists());
        let free = free.ok_or_else(|| CaptureError::format(&folder, "there is no free name left"))?;
        fs::rename(old, &free).map_err(|error| CaptureError::io(old, error))?;
        sync_parent(&free)?;
        Ok(free)
    }
}

/// The extension of a take's path.
fn extension(path: &Path) -> &str {
    path.extension().and_then(|extension| extension.to_str()).unwrap_or(RECORDING)
}

/// Locks a subject's folder, which is created where it is missing; true where there is a subject in it.
fn lock_folder(folder: &Path) -> Result<(SubjectLock, bool), CaptureError> {
    fs::create_dir_all(folder).map_err(|error| CaptureError::io(folder, error))?;
    let lock = SubjectLock::acquire(folder)?;
    Ok((lock, Subject::exists(folder)))
}
