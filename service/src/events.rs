//! What happens, told to everybody who listens: each event is one JSON object with one key.

use std::sync::Arc;

use serde::Serialize;
use serde_json::{Value, json};
use tokio::sync::broadcast;

/// Events that a slow listener may be behind before it misses some.
const ROOM: usize = 256;

/// Where events are told.
#[derive(Debug, Clone)]
pub struct Events(broadcast::Sender<Arc<str>>);

impl Default for Events {
    fn default() -> Self {
        Self(broadcast::channel(ROOM).0)
    }
}

impl Events {
    /// Listens from now on.
    pub fn listen(&self) -> broadcast::Receiver<Arc<str>> {
        self.0.subscribe()
    }

    /// A job was entered, is somewhere else, or has ended.
    pub fn job(&self, job: &impl Serialize) {
        self.tell(&json!({ "job": job }));
    }

    /// The capture stands otherwise than before.
    pub fn capture(&self, capture: &impl Serialize) {
        self.tell(&json!({ "capture": capture }));
    }

    /// Subjects were made, changed or removed.
    pub fn archive_changed(&self) {
        self.tell(&json!({ "archive": "changed" }));
    }

    fn tell(&self, event: &Value) {
        // That nobody listens is no error.
        drop(self.0.send(event.to_string().into()));
    }
}
