//! The archive: its list, new subjects, and the bin.

use axum::{
    Json,
    extract::{Path, State},
    http::StatusCode,
};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::{blocking::blocking, json::Body};
use crate::{
    archive::{Binned, Summary, Undo},
    error::{Refusal, Told},
    service::Service,
};

/// The archive and its subjects.
#[derive(Debug, Serialize, ToSchema)]
pub struct ArchiveList {
    /// Name of its folder.
    pub name: String,
    /// Where it is.
    pub path: String,
    /// Version of the program.
    pub version: String,
    /// The subjects, by id.
    pub subjects: Vec<Summary>,
}

/// A subject to create.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
#[schema(example = json!({ "id": "anna", "name": "Anna B." }))]
pub struct NewSubject {
    /// The name of its folder: letters, digits, `.`, `_`, `-`; at most 64.
    #[schema(pattern = "^[A-Za-z0-9_-][A-Za-z0-9._-]{0,63}$")]
    pub id: String,
    /// What the subject is called; without, as the folder.
    #[serde(default)]
    #[schema(max_length = 200)]
    pub name: Option<String>,
}

/// The archive and its subjects
#[utoipa::path(get, path = "/api/archive", tag = "archive", responses((status = 200, description = "All subjects", body = ArchiveList)))]
pub async fn list(State(service): State<Service>) -> Result<Json<ArchiveList>, Refusal> {
    let list = blocking(&service, |service| {
        Ok(ArchiveList {
            name: service.archive.name(),
            path: service.archive.root().to_string_lossy().into_owned(),
            version: env!("CARGO_PKG_VERSION").into(),
            subjects: service.all_summaries(),
        })
    });
    Ok(Json(list.await?))
}

/// Create a subject
#[utoipa::path(post, path = "/api/subjects", tag = "archive", request_body = NewSubject, responses(
    (status = 201, description = "It was created", body = Summary),
    (status = 400, description = "The body is not JSON", body = Told),
    (status = 409, description = "There is a folder of that name", body = Told),
    (status = 413, description = "The body is too large", body = Told),
    (status = 415, description = "The body is not said to be JSON", body = Told),
    (status = 422, description = "No folder can be called so, or a field is wrong", body = Told),
    (status = 507, description = "The disk is full", body = Told)))]
pub async fn create(
    State(service): State<Service>,
    Body(new): Body<NewSubject>,
) -> Result<(StatusCode, Json<Summary>), Refusal> {
    if new.name.as_ref().is_some_and(|name| name.chars().count() > 200) {
        return Err(Refusal::unusable("`name`: at most 200 characters"));
    }
    let summary = blocking(&service, move |service| {
        service.archive.create(&new.id, new.name.as_deref())?;
        service.summary(&new.id)
    });
    let summary = summary.await?;
    service.events.archive_changed();
    Ok((StatusCode::CREATED, Json(summary)))
}

/// Move a subject to the bin
#[utoipa::path(delete, path = "/api/subjects/{id}", tag = "archive", params(("id" = String, Path, description = "Name of the subject's folder", example = "anna")), responses(
    (status = 200, description = "It is in the bin", body = Undo),
    (status = 404, description = "There is none", body = Told),
    (status = 409, description = "Somebody works on it", body = Told)))]
pub async fn remove(State(service): State<Service>, Path(id): Path<String>) -> Result<Json<Undo>, Refusal> {
    let undo = blocking(&service, move |service| service.archive.remove(&id)).await?;
    service.events.archive_changed();
    Ok(Json(undo))
}

/// What is in the bin
#[utoipa::path(get, path = "/api/bin", tag = "archive", responses((status = 200, description = "The last removed first", body = [Binned])))]
pub async fn binned(State(service): State<Service>) -> Result<Json<Vec<Binned>>, Refusal> {
    Ok(Json(blocking(&service, |service| Ok(service.archive.binned())).await?))
}

/// Bring a subject back from the bin
#[utoipa::path(post, path = "/api/bin/{token}/restore", tag = "archive", params(("token" = String, Path, description = "`undo` of the entry", example = "5f3c9a0b11d2e4f6")), responses(
    (status = 200, description = "It is back", body = Summary),
    (status = 404, description = "The bin has no such entry", body = Told),
    (status = 409, description = "Its name is taken again", body = Told)))]
pub async fn restore(State(service): State<Service>, Path(token): Path<String>) -> Result<Json<Summary>, Refusal> {
    let summary = blocking(&service, move |service| service.summary(&service.archive.restore(&token)?)).await?;
    service.events.archive_changed();
    Ok(Json(summary))
}
