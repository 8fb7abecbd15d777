//! The capture: what can be asked of it, and its live pictures.

use std::time::Duration;

use axum::{
    Json,
    extract::{
        State,
        ws::{Message, WebSocket, WebSocketUpgrade, rejection::WebSocketUpgradeRejection},
    },
    http::StatusCode,
    response::Response,
};
use serde::Deserialize;
use tokio::{sync::broadcast::error::RecvError, time::timeout};
use utoipa::ToSchema;

use super::{blocking::blocking, json::Body};
use crate::{
    capture::{
        NewCapture, NextLayer, Now,
        pictures::{Audience, Kind},
    },
    error::{Refusal, Told},
    metrics::Counted,
    service::Service,
};

/// Viewers of live pictures at the same time.
const MOST_VIEWERS: u64 = 32;
/// A viewer that takes nothing for this long is let go.
const PATIENCE: Duration = Duration::from_secs(10);
/// Bytes of a viewer's message at most.
const LONGEST: usize = 4096;

/// How the capture stands
#[utoipa::path(get, path = "/api/capture", tag = "capture", responses((status = 200, description = "How it stands", body = Now)))]
pub async fn now(State(service): State<Service>) -> Json<Now> {
    Json(service.capture.now())
}

/// Open a camera for a layer of a subject
#[utoipa::path(post, path = "/api/capture", tag = "capture", request_body = NewCapture, responses(
    (status = 200, description = "It is being opened", body = Now),
    (status = 400, description = "The body is not JSON", body = Told),
    (status = 404, description = "There is no such subject", body = Told),
    (status = 409, description = "A camera is open already, or somebody holds the subject", body = Told),
    (status = 413, description = "The body is too large", body = Told),
    (status = 415, description = "The body is not said to be JSON", body = Told),
    (status = 422, description = "Device, name or type cannot be used", body = Told),
    (status = 507, description = "The disk is full", body = Told)))]
pub async fn open(State(service): State<Service>, Body(new): Body<NewCapture>) -> Result<Json<Now>, Refusal> {
    Ok(Json(blocking(&service, move |service| service.capture.open(&new)).await?))
}

/// Record from now on, until the subject has turned once round
#[utoipa::path(post, path = "/api/capture/start", tag = "capture", responses(
    (status = 200, description = "It is recorded", body = Now),
    (status = 409, description = "No camera is ready, or a take is there already", body = Told)))]
pub async fn start(State(service): State<Service>) -> Result<Json<Now>, Refusal> {
    Ok(Json(blocking(&service, |service| service.capture.start()).await?))
}

/// End the recording, whole
#[utoipa::path(post, path = "/api/capture/stop", tag = "capture", responses(
    (status = 200, description = "It is being closed", body = Now),
    (status = 409, description = "Nothing is recorded", body = Told)))]
pub async fn stop(State(service): State<Service>) -> Result<Json<Now>, Refusal> {
    Ok(Json(blocking(&service, |service| service.capture.stop()).await?))
}

/// What follows an accepted take.
#[derive(Debug, Default, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
#[schema(example = json!({ "next": { "name": "trousers", "type": "trousers" } }))]
pub struct Accepted {
    /// The next layer; without, the camera is closed.
    #[serde(default)]
    pub next: Option<NextLayer>,
}

/// Make the recorded take part of the subject
#[utoipa::path(post, path = "/api/capture/accept", tag = "capture", request_body = Accepted, responses(
    (status = 200, description = "It is the subject's", body = Now),
    (status = 400, description = "The body is not JSON", body = Told),
    (status = 409, description = "No take waits", body = Told),
    (status = 413, description = "The body is too large", body = Told),
    (status = 415, description = "The body is not said to be JSON", body = Told),
    (status = 422, description = "The next layer's name or type cannot be used", body = Told),
    (status = 507, description = "The disk is full", body = Told)))]
pub async fn accept(State(service): State<Service>, Body(accepted): Body<Accepted>) -> Result<Json<Now>, Refusal> {
    Ok(Json(blocking(&service, move |service| service.capture.accept(accepted.next.as_ref())).await?))
}

/// Put the recorded take aside and record the layer again
#[utoipa::path(post, path = "/api/capture/retake", tag = "capture", responses(
    (status = 200, description = "Live pictures go on", body = Now),
    (status = 409, description = "No take waits", body = Told)))]
pub async fn retake(State(service): State<Service>) -> Result<Json<Now>, Refusal> {
    Ok(Json(blocking(&service, |service| service.capture.retake()).await?))
}

/// Close the camera; a take that was not accepted is put aside
#[utoipa::path(post, path = "/api/capture/discard", tag = "capture", responses(
    (status = 200, description = "It is closed", body = Now),
    (status = 409, description = "No camera is open, or a take is recorded", body = Told)))]
pub async fn discard(State(service): State<Service>) -> Result<Json<Now>, Refusal> {
    Ok(Json(blocking(&service, |service| service.capture.discard()).await?))
}

/// Live pictures, by WebSocket
///
/// Each message is binary: a byte for its kind, the length of a JSON header (u32, little-endian), the header, the payload.
/// Kind 1 is a picture (JPEG) with guidance in its header, kind 2 a surface (f32 positions, u8 colours padded to four bytes,
/// u32 triangles). The viewer may send `{"want": ["colour", "depth", "cutout", "surface"]}`.
#[utoipa::path(get, path = "/api/capture/live", tag = "capture", responses(
    (status = 101, description = "Pictures follow"),
    (status = 400, description = "It is no request for a WebSocket", body = Told),
    (status = 426, description = "The connection cannot become a WebSocket", body = Told),
    (status = 429, description = "There are too many viewers", body = Told)))]
pub async fn live(
    State(service): State<Service>,
    upgrade: Result<WebSocketUpgrade, WebSocketUpgradeRejection>,
) -> Result<Response, Refusal> {
    let upgrade = upgrade.map_err(|rejection| {
        let status = if rejection.status() == StatusCode::UPGRADE_REQUIRED {
            StatusCode::UPGRADE_REQUIRED
        } else {
            StatusCode::BAD_REQUEST
        };
        Refusal::new(status, rejection.body_text())
    })?;
    let sentence = "too many pages look at the live pictures already; close some";
    let counted = Counted::within(&service.metrics.viewers, MOST_VIEWERS);
    let counted = counted.ok_or_else(|| Refusal::new(StatusCode::TOO_MANY_REQUESTS, sentence))?;
    let audience = service.capture.audience();
    Ok(upgrade.max_message_size(LONGEST).max_frame_size(LONGEST).on_upgrade(move |socket| async move {
        let _counted = counted;
        let mut wishes = Wishes::new(&audience);
        show(socket, &audience, &mut wishes).await;
    }))
}

/// Sends messages as fast as the viewer takes them; what it is too slow for it misses.
async fn show(mut socket: WebSocket, audience: &Audience, wishes: &mut Wishes<'_>) {
    let mut packets = audience.look();
    loop {
        tokio::select! {
            packet = packets.recv() => match packet {
                Ok(packet) if wishes.has(packet.kind) => {
                    let message = Message::Binary(packet.bytes.clone().into());
                    if !matches!(timeout(PATIENCE, socket.send(message)).await, Ok(Ok(()))) {
                        return;
                    }
                }
                Ok(_) | Err(RecvError::Lagged(_)) => {}
                Err(RecvError::Closed) => return,
            },
            heard = socket.recv() => match heard {
                Some(Ok(Message::Text(text))) => wishes.hear(&text),
                Some(Ok(Message::Close(_)) | Err(_)) | None => return,
                Some(Ok(_)) => {}
            },
        }
    }
}

/// What one viewer wants.
struct Wishes<'a> {
    audience: &'a Audience,
    kinds: Vec<Kind>,
}

#[derive(Deserialize)]
struct Wish {
    want: Vec<String>,
}

impl<'a> Wishes<'a> {
    fn new(audience: &'a Audience) -> Self {
        let mut wishes = Self { audience, kinds: Vec::new() };
        wishes.set(vec![Kind::Colour, Kind::Depth, Kind::Surface]);
        wishes
    }

    fn has(&self, kind: Kind) -> bool {
        self.kinds.contains(&kind)
    }

    fn hear(&mut self, text: &str) {
        if let Ok(wish) = serde_json::from_str::<Wish>(text) {
            self.set(Kind::ALL.into_iter().filter(|kind| wish.want.iter().any(|want| want == kind.name())).collect());
        }
    }

    fn set(&mut self, kinds: Vec<Kind>) {
        self.kinds.iter().for_each(|kind| self.audience.want(*kind, false));
        self.kinds = kinds;
        self.kinds.iter().for_each(|kind| self.audience.want(*kind, true));
    }
}

impl Drop for Wishes<'_> {
    fn drop(&mut self) {
        self.set(Vec::new());
    }
}
