//! Counts for whoever watches the service.

use axum::{
    extract::State,
    http::header,
    response::{IntoResponse, Response},
};

use super::blocking::blocking;
use crate::{capture::Step, error::Refusal, metrics::Lines, service::Service};

/// Counts in the text format of Prometheus
#[utoipa::path(get, path = "/metrics", tag = "service", responses((status = 200, description = "The counts", content_type = "text/plain", body = String)))]
pub async fn metrics(State(service): State<Service>) -> Result<Response, Refusal> {
    let text = blocking(&service, |service| {
        let mut lines = Lines::default();
        service.metrics.write(&mut lines);
        let states = service.jobs.counts()?.into_iter();
        let named = |state| serde_json::to_string(&state).unwrap_or_default();
        let counts: Vec<(String, f64)> =
            states.map(|(state, count)| (format!("{{state={}}}", named(state)), count as f64)).collect();
        lines.family("jobs", "gauge", "Jobs by state.", &counts);
        let now = service.capture.now();
        let is_recording = f64::from(u8::from(now.state == Step::Recording));
        lines.value("subjects", "gauge", "Subjects in the archive.", service.archive.subjects().len() as f64);
        lines.value("recording", "gauge", "1 while a take is recorded.", is_recording);
        lines.value("recorded_frames", "gauge", "Frames of the take.", now.frames as f64);
        lines.value("lost_frames", "gauge", "Frames of the take that were lost.", now.dropped as f64);
        Ok(lines.text())
    });
    Ok(([(header::CONTENT_TYPE, "text/plain; version=0.0.4; charset=utf-8")], text.await?).into_response())
}
