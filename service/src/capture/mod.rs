//! The capture: one camera, its live pictures, and the take that is recorded from it.
//!
//! - `now`: how it stands, for everybody;
//! - `aside`: takes that were not accepted;
//! - `camera`: the camera's thread;
//! - `pictures`: live pictures and guidance;
//! - `recording`: a take from its first frame to a whole file;
//! - `session`: what an open camera is used for: a subject, a layer, a take;
//! - [`Capture`]: what can be asked of it.

mod aside;
mod camera;
mod now;
pub mod pictures;
mod recording;
mod session;

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

pub use self::now::{Now, Step};
use self::{pictures::Audience, session::Session};
use crate::{archive::Archive, error::Refusal, events::Events, yielding::Priority};

/// A camera to open, and what is to be recorded.
#[derive(Debug, Clone, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
#[schema(example = json!({ "device": "virtual", "subject": "anna", "name": "body" }))]
pub struct NewCapture {
    /// The camera, as `GET /api/devices` lists it and `toile capture --device` takes it.
    #[schema(max_length = 300)]
    pub device: String,
    /// The name of the subject's folder.
    pub subject: String,
    /// The name of the layer, without a number.
    #[serde(alias = "layer")]
    #[schema(max_length = 64)]
    pub name: String,
    /// The type of the garment; without, as the name says.
    #[serde(default, rename = "type")]
    pub garment: Option<String>,
    /// The layer has a take, which the new one replaces.
    #[serde(default)]
    pub retake: bool,
    /// The first take shows the person dressed.
    #[serde(default)]
    pub dressed: bool,
}

/// The next layer, after a take was accepted.
#[derive(Debug, Clone, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct NextLayer {
    /// Its name, without a number.
    #[serde(alias = "layer")]
    #[schema(max_length = 64)]
    pub name: String,
    /// The type of the garment; without, as the name says.
    #[serde(default, rename = "type")]
    pub garment: Option<String>,
}

/// The one camera that may be open, and who looks.
pub struct Capture {
    audience: Arc<Audience>,
    shared: Arc<Shared>,
}

/// What the threads of a capture have in common.
pub struct Shared {
    pub(crate) archive: Arc<Archive>,
    pub(crate) events: Events,
    pub(crate) priority: Arc<Priority>,
    now: Mutex<Now>,
    session: Mutex<Option<Session>>,
}

impl Shared {
    /// How the capture stands.
    pub fn now(&self) -> Now {
        self.now.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// Changes how it stands, and tells everybody.
    pub fn set(&self, change: impl FnOnce(&mut Now)) {
        let mut now = self.now.lock().unwrap_or_else(PoisonError::into_inner);
        change(&mut now);
        let told = now.clone();
        drop(now);
        self.events.capture(&told);
    }

    fn session(&self) -> MutexGuard<'_, Option<Session>> {
        self.session.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Capture {
    /// No camera is open yet.
    pub fn new(archive: Arc<Archive>, events: Events, priority: Arc<Priority>) -> Self {
        let (now, session) = (Mutex::new(Now::default()), Mutex::new(None));
        Self { audience: Arc::default(), shared: Arc::new(Shared { archive, events, priority, now, session }) }
    }

    /// How it stands.
    pub fn now(&self) -> Now {
        self.shared.now()
    }

    /// Live messages.
    pub fn audience(&self) -> Arc<Audience> {
        self.audience.clone()
    }

    /// Opens a camera for a layer of a subject; the subject is held until the capture is over.
    ///
    /// # Errors
    /// 404 where there is no such subject, 409 where a camera is open or somebody holds the subject, 422 where device, name or
    /// type cannot be used.
    pub fn open(&self, new: &NewCapture) -> Result<Now, Refusal> {
        let mut session = self.shared.session();
        if session.is_some() {
            return Err(Refusal::conflict("a camera is open already; discard that capture first"));
        }
        *session = Some(Session::open(&self.shared, self.audience.clone(), new)?);
        Ok(self.now())
    }

    /// Records from now on.
    ///
    /// # Errors
    /// 409 where no camera is ready.
    pub fn start(&self) -> Result<Now, Refusal> {
        self.with(session::Session::start)
    }

    /// Ends the recording, whole.
    ///
    /// # Errors
    /// 409 where nothing is recorded.
    pub fn stop(&self) -> Result<Now, Refusal> {
        self.with(|session, shared| session.stop(shared))
    }

    /// Makes the recorded take part of the subject, and goes on with `next` or closes the camera.
    ///
    /// # Errors
    /// 409 where no take waits, 422 where the next layer's name cannot be used.
    pub fn accept(&self, next: Option<&NextLayer>) -> Result<Now, Refusal> {
        let goes_on = next.is_some();
        self.with(|session, shared| session.accept(shared, next))?;
        self.shared.events.archive_changed();
        if !goes_on {
            self.close();
        }
        Ok(self.now())
    }

    /// Puts the recorded take aside; the camera stays open for the same layer.
    ///
    /// # Errors
    /// 409 where no take waits.
    pub fn retake(&self) -> Result<Now, Refusal> {
        self.with(|session, shared| session.put_aside(shared))
    }

    /// Closes the camera; a take that was not accepted is put aside.
    ///
    /// # Errors
    /// 409 where no camera is open, or a take is recorded.
    pub fn discard(&self) -> Result<Now, Refusal> {
        self.with(|session, shared| session.may_close(shared))?;
        self.close();
        self.shared.events.archive_changed();
        Ok(self.now())
    }

    /// Ends what runs: a recording whole, so that it becomes a take when the subject is opened next.
    pub fn end(&self) {
        drop(self.stop());
        let session = self.shared.session().take();
        session.into_iter().for_each(Session::end);
    }

    fn with(&self, act: impl FnOnce(&mut Session, &Arc<Shared>) -> Result<(), Refusal>) -> Result<Now, Refusal> {
        let mut session = self.shared.session();
        let open = session.as_mut().ok_or_else(|| Refusal::conflict("no camera is open; open one first"))?;
        act(open, &self.shared)?;
        Ok(self.now())
    }

    fn close(&self) {
        let session = self.shared.session().take();
        session.into_iter().for_each(Session::close);
        self.shared.set(|now| *now = Now::default());
    }
}
