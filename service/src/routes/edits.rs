//! Corrections by hand: the files of `edits/`, the same as the command line's.

use std::{fs, path::PathBuf};

use axum::{
    Json,
    extract::{Path, State},
    http::{HeaderMap, HeaderValue, StatusCode, header},
    response::{IntoResponse, Response},
};
use serde_json::{Value, json};
use toile_capture::{
    Layer, Subject, SubjectLock,
    files::{atomic_write, is_there},
    subject::BODY,
};
use toile_garments::Edits;
use toile_pipeline::{BodyEdits, Folders, json, read_mesh};

use super::{blocking::blocking, json::Body};
use crate::{
    archive::open_inside,
    error::{Refusal, Told},
    service::Service,
};

/// The corrections of a layer
///
/// Those of a garment are strokes and hem lines (docs/edits.md); those of layer 0, the body, are landmarks.
#[utoipa::path(get, path = "/api/subjects/{id}/layers/{layer}/edit", tag = "edits", params(
    ("id" = String, Path, description = "Name of the subject's folder", example = "anna"),
    ("layer" = usize, Path, description = "Number of the layer", example = 1)), responses(
    (status = 200, description = "The file's content; an empty one where there is none", body = Value, example = json!({ "version": 1, "strokes": [], "hems": [] })),
    (status = 400, description = "The number is none", body = Told),
    (status = 404, description = "There is no such subject or layer", body = Told),
    (status = 422, description = "The file cannot be read", body = Told)))]
pub async fn get(
    State(service): State<Service>,
    Path((id, layer)): Path<(String, usize)>,
) -> Result<Response, Refusal> {
    let found = blocking(&service, move |service| Ok(Place::of(service, &id, layer)?.read())).await??;
    Ok(told(&found))
}

/// Replace the corrections of a layer
///
/// They are checked as `toile edit` does, kept, and applied at the next rebuild. Without a stroke, a hem line or a landmark
/// the file is removed.
#[utoipa::path(put, path = "/api/subjects/{id}/layers/{layer}/edit", tag = "edits", params(
    ("id" = String, Path, description = "Name of the subject's folder", example = "anna"),
    ("layer" = usize, Path, description = "Number of the layer", example = 1)),
    request_body(content = Value, example = json!({ "version": 1, "strokes": [{ "mark": "belongs", "points": [[0.1, 1.2, 0.13]], "radius": 0.03 }], "hems": [] })), responses(
    (status = 200, description = "What is kept now", body = Value),
    (status = 400, description = "The number is none, or the body is not JSON", body = Told),
    (status = 404, description = "There is no such subject or layer, or no scan of it yet", body = Told),
    (status = 409, description = "Somebody works on the subject", body = Told),
    (status = 412, description = "The file is not what `If-Match` names any more", body = Told),
    (status = 413, description = "The body is too large", body = Told),
    (status = 415, description = "The body is not said to be JSON", body = Told),
    (status = 422, description = "The edits cannot be used; the sentence says which and why", body = Told),
    (status = 507, description = "The disk is full", body = Told)))]
pub async fn put(
    State(service): State<Service>,
    Path((id, layer)): Path<(String, usize)>,
    asked: HeaderMap,
    Body(given): Body<Value>,
) -> Result<Response, Refusal> {
    let known = asked.get(header::IF_MATCH).and_then(|value| value.to_str().ok()).map(String::from);
    let kept = blocking(&service, move |service| {
        let place = Place::of(service, &id, layer)?;
        let _lock = SubjectLock::acquire(&place.folders.root)?;
        let now = tag(&place.read()?);
        if known.is_some_and(|known| known != "*" && known != now) {
            let sentence = "somebody else has changed these edits; load them again";
            return Err(Refusal::new(StatusCode::PRECONDITION_FAILED, sentence));
        }
        place.keep(&given)?;
        place.read()
    });
    let kept = kept.await?;
    service.events.archive_changed();
    Ok(told(&kept))
}

/// The file of a layer's edits.
struct Place {
    folders: Folders,
    layer: Layer,
    is_body: bool,
}

impl Place {
    fn of(service: &Service, id: &str, layer: usize) -> Result<Self, Refusal> {
        let root = service.archive.subject(id)?;
        let subject = Subject::open(&root)?;
        let layer = subject.layers().get(layer).cloned();
        let layer = layer.ok_or_else(|| Refusal::missing("the subject has no such layer"))?;
        let is_body = layer.number == 0 && layer.name == BODY;
        Ok(Self { folders: Folders::new(&root), is_body, layer })
    }

    fn way(&self) -> String {
        if self.is_body { format!("edits/{BODY}.json") } else { format!("edits/{}.json", self.layer.label()) }
    }

    fn path(&self) -> PathBuf {
        self.folders.root.join(self.way())
    }

    fn read(&self) -> Result<Value, Refusal> {
        let path = self.path();
        if !is_there(&path) {
            let nothing = json!({ "version": 1, "strokes": [], "hems": [] });
            return Ok(if self.is_body { json!({ "version": 1, "landmarks": {} }) } else { nothing });
        }
        // A link could lead out of the archive.
        open_inside(&self.folders.root, &self.way()).map_err(|_| Refusal::missing("the edits are no regular file"))?;
        Ok(json::read(&path)?)
    }

    fn keep(&self, given: &Value) -> Result<(), Refusal> {
        let text = serde_json::to_vec(given).map_err(|error| Refusal::unusable(error.to_string()))?;
        if self.is_body {
            let wrong = |error: toile_pipeline::PipelineError| Refusal::unusable(error.to_string());
            json::from_slice::<BodyEdits>(&self.path(), &text).map_err(wrong)?;
            let says_nothing = given.as_object().is_some_and(|said| {
                said.iter()
                    .all(|(key, value)| key == "version" || value.as_object().is_some_and(serde_json::Map::is_empty))
            });
            return self.write(says_nothing, given);
        }
        let edits = Edits::from_json(&text).map_err(|error| Refusal::unusable(error.to_string()))?;
        let is_empty = edits.strokes.is_empty() && edits.hems.is_empty();
        if !is_empty {
            let scan = self.folders.scan(&self.layer.label());
            if !scan.exists() {
                let sentence = "this layer has no scan yet; process the subject first";
                return Err(Refusal::missing(sentence));
            }
            edits.check_on(&read_mesh(&scan)?).map_err(|error| Refusal::unusable(error.to_string()))?;
        }
        let written = serde_json::to_value(&edits).map_err(|error| Refusal::failure(error.to_string()))?;
        self.write(is_empty, &written)
    }

    fn write(&self, is_empty: bool, content: &Value) -> Result<(), Refusal> {
        let path = self.path();
        if is_empty {
            return match fs::remove_file(&path) {
                Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
                    Err(toile_capture::CaptureError::io(&path, error).into())
                }
                _ => Ok(()),
            };
        }
        let folder = self.folders.root.join("edits");
        if fs::symlink_metadata(&folder).is_ok_and(|about| !about.is_dir()) {
            return Err(Refusal::unusable("`edits` is no folder of the subject's own"));
        }
        fs::create_dir_all(&folder).map_err(|error| toile_capture::CaptureError::io(&folder, error))?;
        Ok(atomic_write(&path, &json::pretty(content)?)?)
    }
}

fn tag(content: &Value) -> String {
    use std::hash::{DefaultHasher, Hash, Hasher};
    let mut hasher = DefaultHasher::new();
    content.to_string().hash(&mut hasher);
    format!("\"{:016x}\"", hasher.finish())
}

fn told(content: &Value) -> Response {
    let mut answer = Json(content).into_response();
    if let Ok(tag) = HeaderValue::from_str(&tag(content)) {
        answer.headers_mut().insert(header::ETAG, tag);
    }
    answer
}
