//! Jobs: the queue, and what can be done with one of them.

use axum::{
    Json,
    extract::{Path, State},
    http::{StatusCode, header},
    response::{IntoResponse, Response},
};
use toile_capture::SubjectLock;

use super::{blocking::blocking, json::Body};
use crate::{
    error::{Refusal, Told},
    jobs::job::{Job, JobOptions, Kind, NewJob},
    service::Service,
};

/// The last 200 jobs, newest first
#[utoipa::path(get, path = "/api/jobs", tag = "jobs", responses((status = 200, description = "The jobs", body = [Job])))]
pub async fn list(State(service): State<Service>) -> Result<Json<Vec<Job>>, Refusal> {
    Ok(Json(blocking(&service, |service| service.jobs.list()).await?))
}

/// Queue a job
#[utoipa::path(post, path = "/api/jobs", tag = "jobs", request_body = NewJob, responses(
    (status = 202, description = "It is queued", body = Job),
    (status = 400, description = "The body is not JSON", body = Told),
    (status = 404, description = "There is no such subject", body = Told),
    (status = 409, description = "The same is queued already, or another program works on the subject", body = Told),
    (status = 413, description = "The body is too large", body = Told),
    (status = 415, description = "The body is not said to be JSON", body = Told),
    (status = 422, description = "A field is missing, unknown or out of range", body = Told)))]
pub async fn add(State(service): State<Service>, Body(new): Body<NewJob>) -> Result<(StatusCode, Json<Job>), Refusal> {
    let job = blocking(&service, move |service| enter(service, &new)).await?;
    Ok((StatusCode::ACCEPTED, Json(job)))
}

/// Build a layer again, such as after an edit
#[utoipa::path(post, path = "/api/subjects/{id}/layers/{layer}/rebuild", tag = "jobs", params(
    ("id" = String, Path, description = "Name of the subject's folder", example = "anna"),
    ("layer" = usize, Path, description = "Number of the layer, 1 or more", example = 1)), responses(
    (status = 202, description = "It is queued, before all jobs that nobody waits for", body = Job),
    (status = 400, description = "The number is none", body = Told),
    (status = 404, description = "There is no such subject", body = Told),
    (status = 409, description = "The same is queued already, or another program works on the subject", body = Told),
    (status = 422, description = "The body has no border to rebuild", body = Told)))]
pub async fn rebuild(
    State(service): State<Service>,
    Path((subject, layer)): Path<(String, usize)>,
) -> Result<(StatusCode, Json<Job>), Refusal> {
    let options = JobOptions { layer: Some(layer), ..JobOptions::default() };
    let new = NewJob { kind: Kind::Rebuild, subject, options };
    let job = blocking(&service, move |service| enter(service, &new)).await?;
    Ok((StatusCode::ACCEPTED, Json(job)))
}

fn enter(service: &Service, new: &NewJob) -> Result<Job, Refusal> {
    let path = service.archive.subject(&new.subject)?;
    // What another program holds is told at once; our own job in front of this one is no reason to wait.
    if !service.jobs.works_on(&new.subject) {
        drop(SubjectLock::acquire(&path)?);
    }
    service.jobs.add(new)
}

/// One job
#[utoipa::path(get, path = "/api/jobs/{job}", tag = "jobs", params(("job" = i64, Path, description = "Its number", example = 1)), responses(
    (status = 200, description = "How it stands", body = Job),
    (status = 400, description = "The number is none", body = Told),
    (status = 404, description = "There is none of that number", body = Told)))]
pub async fn get(State(service): State<Service>, Path(id): Path<i64>) -> Result<Json<Job>, Refusal> {
    Ok(Json(blocking(&service, move |service| service.jobs.get(id)).await?))
}

/// Cancel a job: at once where it waits, at its next step where it runs
#[utoipa::path(post, path = "/api/jobs/{job}/cancel", tag = "jobs", params(("job" = i64, Path, description = "Its number", example = 1)), responses(
    (status = 200, description = "How it stands now", body = Job),
    (status = 400, description = "The number is none", body = Told),
    (status = 404, description = "There is none of that number", body = Told),
    (status = 409, description = "It is over already", body = Told)))]
pub async fn cancel(State(service): State<Service>, Path(id): Path<i64>) -> Result<Json<Job>, Refusal> {
    Ok(Json(blocking(&service, move |service| service.jobs.cancel(id)).await?))
}

/// Queue a job again that is over
#[utoipa::path(post, path = "/api/jobs/{job}/retry", tag = "jobs", params(("job" = i64, Path, description = "Its number", example = 1)), responses(
    (status = 202, description = "It is queued again", body = Job),
    (status = 400, description = "The number is none", body = Told),
    (status = 404, description = "There is none of that number", body = Told),
    (status = 409, description = "It is not over", body = Told)))]
pub async fn retry(State(service): State<Service>, Path(id): Path<i64>) -> Result<(StatusCode, Json<Job>), Refusal> {
    Ok((StatusCode::ACCEPTED, Json(blocking(&service, move |service| service.jobs.retry(id)).await?)))
}

/// What a job has said, line by line with its seconds
#[utoipa::path(get, path = "/api/jobs/{job}/log", tag = "jobs", params(("job" = i64, Path, description = "Its number", example = 1)), responses(
    (status = 200, description = "The lines", content_type = "text/plain", body = String),
    (status = 400, description = "The number is none", body = Told),
    (status = 404, description = "There is none of that number", body = Told)))]
pub async fn log(State(service): State<Service>, Path(id): Path<i64>) -> Result<Response, Refusal> {
    let log = blocking(&service, move |service| service.jobs.log(id)).await?;
    Ok(([(header::CONTENT_TYPE, "text/plain; charset=utf-8")], log).into_response())
}
