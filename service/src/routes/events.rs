//! Server-sent events: what happens in the archive, the queue and the capture, as it happens.

use std::{convert::Infallible, time::Duration};

use axum::{
    extract::State,
    http::StatusCode,
    response::sse::{Event, KeepAlive, Sse},
};
use futures_util::{Stream, stream};
use serde_json::json;
use tokio::sync::broadcast::error::RecvError;

use super::blocking::blocking;
use crate::{
    error::{Refusal, Told},
    metrics::Counted,
    service::Service,
};

/// Listeners at the same time.
const MOST_LISTENERS: u64 = 64;
/// How often a comment shows that the line is alive.
const ALIVE_EVERY: Duration = Duration::from_secs(10);

/// What happens, as it happens
///
/// Each event is one JSON object with one key: `hello` first, then `job`, `capture`, `archive`. Every open job and the capture
/// are told on connecting.
#[utoipa::path(get, path = "/api/events", tag = "service", responses(
    (status = 200, description = "Server-sent events", content_type = "text/event-stream"),
    (status = 429, description = "There are too many listeners", body = Told)))]
pub async fn events(
    State(service): State<Service>,
) -> Result<Sse<impl Stream<Item = Result<Event, Infallible>>>, Refusal> {
    let listening = Counted::within(&service.metrics.listeners, MOST_LISTENERS)
        .ok_or_else(|| Refusal::new(StatusCode::TOO_MANY_REQUESTS, "too many pages listen already; close some"))?;
    let receiver = service.events.listen();
    let open = blocking(&service, |service| service.jobs.open_jobs()).await?;
    let mut first = vec![json!({ "hello": { "version": env!("CARGO_PKG_VERSION") } })];
    first.extend(open.iter().rev().map(|job| json!({ "job": job })));
    first.push(json!({ "capture": service.capture.now() }));
    let first = stream::iter(first.into_iter().map(|event| Ok(Event::default().data(event.to_string()))));
    let later = stream::unfold((receiver, listening), |(mut receiver, listening)| async move {
        loop {
            match receiver.recv().await {
                Ok(event) => return Some((Ok(Event::default().data(&*event)), (receiver, listening))),
                // A slow listener has missed some; what stands is told with the next one.
                Err(RecvError::Lagged(_)) => {}
                Err(RecvError::Closed) => return None,
            }
        }
    });
    let stream = stream::StreamExt::chain(first, later);
    Ok(Sse::new(stream).keep_alive(KeepAlive::new().interval(ALIVE_EVERY).text("alive")))
}
