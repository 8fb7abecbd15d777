//! One subject: what is known of it, its picture, the frames of its takes, and the next layer.

use axum::{
    Json,
    extract::{Path, Query, State},
    http::{HeaderMap, HeaderValue, StatusCode, header},
    response::{IntoResponse, Response},
};
use serde::{Deserialize, Serialize};
use toile_capture::{Subject, subject::BODY};
use toile_character::GarmentType;
use utoipa::{IntoParams, ToSchema};

use super::blocking::blocking;
use crate::{
    archive::{Detail, detail},
    error::{Refusal, Told},
    pictures::{What, of_frame, of_subject},
    service::Service,
};

/// Everything about a subject
#[utoipa::path(get, path = "/api/subjects/{id}", tag = "subjects", params(("id" = String, Path, description = "Name of the subject's folder", example = "anna")), responses(
    (status = 200, description = "What is known of it", body = Detail),
    (status = 404, description = "There is none", body = Told)))]
pub async fn subject(State(service): State<Service>, Path(id): Path<String>) -> Result<Json<Detail>, Refusal> {
    let found = blocking(&service, move |service| {
        let summary = service.summary(&id)?;
        Ok(detail(&service.archive.subject(&id)?, summary, &service.recordings))
    });
    Ok(Json(found.await?))
}

/// A picture of a subject: its avatar, or its last scan
#[utoipa::path(get, path = "/api/subjects/{id}/picture", tag = "subjects", params(("id" = String, Path, description = "Name of the subject's folder", example = "anna")), responses(
    (status = 200, description = "The picture", content_type = "image/jpeg"),
    (status = 404, description = "There is no such subject, or nothing was made of it yet", body = Told),
    (status = 422, description = "A mesh of it cannot be read", body = Told)))]
pub async fn picture(State(service): State<Service>, Path(id): Path<String>) -> Result<Response, Refusal> {
    let made = blocking(&service, move |service| of_subject(&service.archive, &id)).await?;
    let headers = [(header::CONTENT_TYPE, "image/jpeg"), (header::CACHE_CONTROL, "private, max-age=31536000")];
    Ok((headers, made).into_response())
}

/// Which picture of a frame is wanted.
#[derive(Debug, Deserialize, IntoParams)]
#[into_params(parameter_in = Query)]
pub struct FrameWanted {
    /// Depth as colours, or the camera's colour.
    #[serde(default)]
    pub what: What,
    /// The number of the sensor.
    #[serde(default)]
    #[param(minimum = 0, maximum = 63)]
    pub sensor: usize,
}

/// A frame of a take as a picture
///
/// `frame` counts the frames of that sensor, from 0.
#[utoipa::path(get, path = "/api/subjects/{id}/takes/{take}/frames/{frame}", tag = "subjects", params(
    ("id" = String, Path, description = "Name of the subject's folder", example = "anna"),
    ("take" = usize, Path, description = "Number of the take", example = 0),
    ("frame" = String, Path, description = "Number of the frame; `.jpg` may stand behind it", example = "0"),
    FrameWanted), responses(
    (status = 200, description = "The picture; `X-Frame-Time` is its time in seconds since the take's first frame", content_type = "image/jpeg"),
    (status = 304, description = "It is what `If-None-Match` names"),
    (status = 400, description = "A number is none", body = Told),
    (status = 404, description = "There is no such frame, or it has no such picture", body = Told),
    (status = 422, description = "The recording or the frame cannot be read", body = Told)))]
pub async fn frame(
    State(service): State<Service>,
    Path((id, take, frame)): Path<(String, usize, String)>,
    Query(wanted): Query<FrameWanted>,
    asked: HeaderMap,
) -> Result<Response, Refusal> {
    let number = frame.strip_suffix(".jpg").or(frame.strip_suffix(".png")).unwrap_or(&frame);
    let number: u64 = number.parse().map_err(|_| Refusal::malformed(format!("`{frame}` is no number of a frame")))?;
    let known = asked.get(header::IF_NONE_MATCH).and_then(|value| value.to_str().ok()).map(String::from);
    let made = blocking(&service, move |service| {
        let subject = Subject::open(&service.archive.subject(&id)?)?;
        let layer = subject.layers().get(take).ok_or_else(|| Refusal::missing(format!("there is no take {take}")))?;
        let path = subject.take_path(layer);
        let replay = service.recordings.open(&path)?;
        let length = std::fs::metadata(&path).map_or(0, |about| about.len());
        let tag = format!("\"{length:x}-{take}-{number}-{}-{:?}\"", wanted.sensor, wanted.what);
        if known.as_ref() == Some(&tag) {
            return Ok((tag, None));
        }
        of_frame(&replay, wanted.sensor, number, wanted.what).map(|picture| (tag, Some(picture)))
    });
    let (tag, picture) = made.await?;
    let mut answer = match picture {
        None => StatusCode::NOT_MODIFIED.into_response(),
        Some((seconds, picture)) => {
            let mut answer = ([(header::CONTENT_TYPE, "image/jpeg")], picture).into_response();
            if let Ok(value) = HeaderValue::from_str(&format!("{seconds:.6}")) {
                answer.headers_mut().insert("x-frame-time", value);
            }
            answer
        }
    };
    answer.headers_mut().insert(header::CACHE_CONTROL, HeaderValue::from_static("private, max-age=86400"));
    if let Ok(tag) = HeaderValue::from_str(&tag) {
        answer.headers_mut().insert(header::ETAG, tag);
    }
    Ok(answer)
}

/// What could be scanned next.
#[derive(Debug, Serialize, ToSchema)]
#[schema(example = json!({ "layer": 1, "name": "trousers", "type": "trousers", "say": "Put on the trousers." }))]
pub struct Next {
    /// The number that the layer will get.
    pub layer: usize,
    /// A name for it.
    pub name: String,
    /// The type of the garment.
    #[serde(rename = "type")]
    pub garment: Option<String>,
    /// What to say to the person.
    pub say: String,
}

/// A proposal for the next layer of a subject
#[utoipa::path(get, path = "/api/subjects/{id}/next", tag = "capture", params(("id" = String, Path, description = "Name of the subject's folder", example = "anna")), responses(
    (status = 200, description = "The proposal", body = Next),
    (status = 404, description = "There is no such subject", body = Told),
    (status = 422, description = "The subject cannot be read", body = Told)))]
pub async fn next(State(service): State<Service>, Path(id): Path<String>) -> Result<Json<Next>, Refusal> {
    let next = blocking(&service, move |service| Ok(propose(&Subject::open(&service.archive.subject(&id)?)?)));
    Ok(Json(next.await?))
}

/// Garments in the order in which most people put them on, each once.
fn propose(subject: &Subject) -> Next {
    let usual = ["trousers", "tshirt", "jumper", "jacket", "coat", "hat", "scarf"];
    let layer = subject.layers().len();
    if layer == 0 {
        let say = "Stand on the disk in underwear, arms away from the body.".into();
        return Next { layer, name: BODY.into(), garment: None, say };
    }
    let is_free = |name: &&str| subject.layer(name).is_none();
    let name = usual.into_iter().find(is_free).map_or_else(|| format!("layer-{layer}"), String::from);
    let garment = GarmentType::from_layer_name(&name).map(|garment| garment.name().to_string());
    let say = format!("Put on the {}.", if name == "tshirt" { "T-shirt" } else { &name });
    Next { layer, name, garment, say }
}

/// A motion that ships with Toile.
#[derive(Debug, Serialize, ToSchema)]
#[schema(example = json!({ "name": "walk", "seconds": 1.2, "fps": 30.0 }))]
pub struct KnownMotion {
    /// Its name.
    pub name: String,
    /// How long it is.
    pub seconds: f64,
    /// Frames a second.
    pub fps: f64,
}

/// Motions that ship with Toile
#[utoipa::path(get, path = "/api/motions", tag = "subjects", responses((status = 200, description = "The motions", body = [KnownMotion])))]
pub async fn motions() -> Json<Vec<KnownMotion>> {
    let (seconds, fps) = toile_pipeline::walk_length();
    Json(vec![KnownMotion { name: "walk".into(), seconds, fps }])
}
