//! What an open camera is used for: a subject that is held, a layer, a take.

use std::sync::{Arc, Mutex, PoisonError};

use toile_capture::{LockedSubject, PendingTake, Source};
use toile_character::GarmentType;
use toile_live::{Device, Surfaces};

use super::{
    NewCapture, NextLayer, Now, Shared, Step,
    aside::put_aside,
    camera::Camera,
    pictures::{Audience, Pictures, Take},
    recording::Recording,
};
use crate::error::Refusal;

/// An open camera with its subject.
pub struct Session {
    subject: LockedSubject,
    device: Device,
    is_retake: bool,
    pending: Option<PendingTake>,
    audience: Arc<Audience>,
    opened: Arc<Mutex<Opened>>,
    recording: Option<Recording>,
    take: Arc<Mutex<Take>>,
    surfaces: Surfaces,
}

/// The camera, once it is open. Pictures end before it.
#[derive(Default)]
struct Opened {
    pictures: Option<Pictures>,
    camera: Option<Camera>,
    /// Counts cameras: one that opens too late is closed at once.
    wanted: u64,
}

impl Session {
    /// Holds the subject, and begins to open the camera.
    ///
    /// # Errors
    /// As [`super::Capture::open`].
    pub fn open(shared: &Arc<Shared>, audience: Arc<Audience>, new: &NewCapture) -> Result<Self, Refusal> {
        let device: Device = new.device.parse().map_err(|reason| Refusal::unusable(format!("`device`: {reason}")))?;
        let subject = LockedSubject::open(&shared.archive.subject(&new.subject)?)?;
        let pending = pending(&subject, new)?;
        subject.announce(&pending)?;
        let mut session = Self {
            device,
            is_retake: new.retake,
            pending: None,
            audience,
            opened: Arc::default(),
            recording: None,
            take: Arc::default(),
            surfaces: Surfaces::default(),
            subject,
        };
        shared.set(|now| {
            *now = Now { device: Some(new.device.clone()), subject: Some(new.subject.clone()), ..Now::default() };
        });
        session.begin(shared, pending);
        Ok(session)
    }

    /// Opens the camera for `pending` on a thread of its own: that may take seconds.
    fn begin(&mut self, shared: &Arc<Shared>, pending: PendingTake) {
        let (layer, is_retake) = (pending.layer.clone(), self.is_retake);
        shared.set(|now| {
            let (device, subject) = (now.device.take(), now.subject.take());
            *now = Now { state: Step::Opening, device, subject, ..Now::default() };
            (now.layer, now.name) = (Some(layer.number), Some(layer.name.clone()));
            (now.garment, now.retake) = (layer.garment.clone(), is_retake);
            now.disk_free_bytes = toile_live::disk_left(&pending.path);
        });
        self.pending = Some(pending);
        let wanted = {
            let mut opened = self.opened();
            (opened.pictures, opened.camera) = (None, None);
            opened.wanted += 1;
            opened.wanted
        };
        let (device, subject, slot) = (self.device.clone(), (*self.subject).clone(), self.opened.clone());
        let (shared_too, audience, take, surfaces) =
            (shared.clone(), self.audience.clone(), self.take.clone(), self.surfaces.clone());
        let open = move || {
            let source = device.open(&subject, &layer).map_err(|error| error.to_string());
            let mut opened = slot.lock().unwrap_or_else(PoisonError::into_inner);
            if opened.wanted != wanted {
                return;
            }
            match source.and_then(|source| started(source, audience, take, surfaces)) {
                Ok((camera, pictures)) => {
                    (opened.camera, opened.pictures) = (Some(camera), Some(pictures));
                    shared_too.set(|now| now.state = Step::Preview);
                }
                Err(error) => shared_too.set(|now| (now.state, now.error) = (Step::Failed, Some(error))),
            }
        };
        if let Err(error) = std::thread::Builder::new().name("opening".into()).spawn(open) {
            shared.set(|now| (now.state, now.error) = (Step::Failed, Some(error.to_string())));
        }
    }

    fn opened(&self) -> std::sync::MutexGuard<'_, Opened> {
        self.opened.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Begins to record.
    ///
    /// # Errors
    /// 409 where the camera is not ready or a take is there already.
    pub fn start(&mut self, shared: &Arc<Shared>) -> Result<(), Refusal> {
        if self.recording.is_some() {
            return Err(Refusal::conflict("a take is recorded already; stop, accept or retake it"));
        }
        let (camera, is_over) = {
            let opened = self.opened();
            let camera = opened.camera.as_ref().map(Camera::shared);
            let camera = camera.ok_or_else(|| Refusal::conflict("the camera is not open yet"))?;
            let ended = camera.ended();
            (camera, ended)
        };
        if let Some(why) = is_over {
            return Err(Refusal::conflict(format!("the camera has ended: {why}")));
        }
        let Some(pending) = &mut self.pending else { return Err(Refusal::conflict("there is no layer to record")) };
        let mut models: Vec<String> = camera.rig.sensors.iter().map(|s| s.identity.model.clone()).collect();
        models.dedup();
        pending.rig = models.join(", ");
        self.subject.announce(pending)?;
        shared.set(|now| {
            (now.state, now.error, now.warnings) = (Step::Recording, None, Vec::new());
            (now.seconds, now.frames, now.dropped, now.degrees, now.turned) = (0.0, 0, 0, 0.0, false);
        });
        let (path, take, surfaces) = (pending.path.clone(), self.take.clone(), self.surfaces.clone());
        let started = Recording::start(shared, camera, path, take, surfaces);
        self.recording = Some(started.map_err(|error| Refusal::failure(error.to_string()))?);
        Ok(())
    }

    /// Ends the recording; it is whole when the state is `review`.
    ///
    /// # Errors
    /// 409 where nothing is recorded.
    pub fn stop(&mut self, shared: &Shared) -> Result<(), Refusal> {
        let Some(recording) = self.recording.as_ref().filter(|recording| !recording.is_over()) else {
            return Err(Refusal::conflict("nothing is recorded"));
        };
        shared.set(|now| {
            if now.state == Step::Recording {
                now.state = Step::Finishing;
            }
        });
        recording.stop();
        Ok(())
    }

    /// Makes the take part of the subject.
    ///
    /// # Errors
    /// As [`super::Capture::accept`].
    pub fn accept(&mut self, shared: &Arc<Shared>, next: Option<&NextLayer>) -> Result<(), Refusal> {
        if !self.recording.as_ref().is_some_and(Recording::is_whole) {
            return Err(Refusal::conflict("no take waits to be accepted"));
        }
        let Some(pending) = self.pending.take() else { return Err(Refusal::conflict("no take waits to be accepted")) };
        self.subject.accept(pending)?;
        (self.recording, self.is_retake) = (None, false);
        let Some(next) = next else { return Ok(()) };
        match self.next(next) {
            Ok(pending) => self.begin(shared, pending),
            // The take is the subject's already; only what follows cannot be.
            Err(refusal) => shared.set(|now| (now.state, now.error) = (Step::Failed, Some(refusal.sentence))),
        }
        Ok(())
    }

    fn next(&self, next: &NextLayer) -> Result<PendingTake, Refusal> {
        let garment = garment(&next.name, next.garment.as_deref())?;
        let pending = self.subject.next_take(&next.name, garment.map(GarmentType::name))?;
        self.subject.announce(&pending)?;
        Ok(pending)
    }

    /// Puts a recorded take aside.
    ///
    /// # Errors
    /// 409 where there is none.
    pub fn put_aside(&mut self, shared: &Shared) -> Result<(), Refusal> {
        let is_over = self.recording.as_ref().is_some_and(Recording::is_over);
        let Some(pending) = self.pending.as_ref().filter(|_| is_over) else {
            return Err(Refusal::conflict("no take waits; stop the recording first"));
        };
        if self.recording.as_ref().is_some_and(Recording::is_whole) {
            put_aside(&pending.path, &pending.layer)?;
        }
        self.subject.announce(pending)?;
        self.recording = None;
        let is_open = self.opened().camera.as_ref().is_some_and(|camera| camera.shared().ended().is_none());
        shared.set(|now| {
            now.state = if is_open { Step::Preview } else { Step::Failed };
            (now.take_file, now.warnings, now.seconds, now.frames) = (None, Vec::new(), 0.0, 0);
            (now.degrees, now.turned, now.unseen) = (0.0, false, Vec::new());
            if is_open {
                now.error = None;
            }
        });
        Ok(())
    }

    /// Whether the camera may be closed; a take that waits is put aside.
    ///
    /// # Errors
    /// 409 while a take is recorded.
    pub fn may_close(&mut self, shared: &Shared) -> Result<(), Refusal> {
        match &self.recording {
            Some(recording) if !recording.is_over() => {
                Err(Refusal::conflict("a take is recorded; stop it first, so that nothing is lost by mistake"))
            }
            Some(_) => self.put_aside(shared),
            None => Ok(()),
        }
    }

    /// Closes the camera and lets the subject go.
    pub fn close(self) {
        self.release().give_up();
    }

    /// Closes the camera; a take that waits becomes the subject's when it is opened next.
    pub fn end(self) {
        drop(self.release());
    }

    /// Closes the camera; gives the subject.
    fn release(mut self) -> LockedSubject {
        self.recording = None;
        let mut opened = self.opened();
        opened.wanted += 1;
        (opened.pictures, opened.camera) = (None, None);
        drop(opened);
        self.subject
    }
}

/// A camera and its pictures.
fn started(
    source: Box<dyn Source>,
    audience: Arc<Audience>,
    take: Arc<Mutex<Take>>,
    surfaces: Surfaces,
) -> Result<(Camera, Pictures), String> {
    let camera = Camera::start(source).map_err(|error| error.to_string())?;
    let pictures = Pictures::start(camera.shared(), audience, take, surfaces).map_err(|error| error.to_string())?;
    Ok((camera, pictures))
}

/// The take that is to be recorded.
fn pending(subject: &LockedSubject, new: &NewCapture) -> Result<PendingTake, Refusal> {
    let garment = garment(&new.name, new.garment.as_deref())?.map(GarmentType::name);
    Ok(match (new.retake, new.dressed) {
        (true, _) => subject.retake(&new.name, garment)?,
        (false, true) => subject.dressed_take(&new.name, garment)?,
        (false, false) => subject.next_take(&new.name, garment)?,
    })
}

fn garment(name: &str, given: Option<&str>) -> Result<Option<GarmentType>, Refusal> {
    let given = given.filter(|given| !given.is_empty());
    let parsed = given.map(str::parse::<GarmentType>).transpose();
    let parsed = parsed.map_err(|reason| Refusal::unusable(format!("`type`: {reason}")))?;
    Ok(parsed.or_else(|| GarmentType::from_layer_name(name)))
}
