//! Signing in: the token that was printed, for a cookie.

use axum::{
    extract::State,
    http::{HeaderValue, StatusCode, header},
    response::{IntoResponse, Response},
};
use serde::Deserialize;
use utoipa::ToSchema;

use super::json::Body;
use crate::{
    error::{Refusal, Told},
    service::Service,
};

/// What somebody signs in with.
#[derive(Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
#[schema(example = json!({ "token": "9f0c5a…" }))]
pub struct Login {
    /// The token that `toile serve` printed.
    #[schema(max_length = 200)]
    pub token: String,
}

/// Sign in
#[utoipa::path(post, path = "/api/login", tag = "service", request_body = Login, responses(
    (status = 204, description = "The cookie is set; a service on loopback needs none and takes any token"),
    (status = 400, description = "The body is not JSON", body = Told),
    (status = 401, description = "It is not the token", body = Told),
    (status = 413, description = "The body is too large", body = Told),
    (status = 415, description = "The body is not said to be JSON", body = Told),
    (status = 422, description = "The token is missing", body = Told)))]
pub async fn login(State(service): State<Service>, Body(login): Body<Login>) -> Result<Response, Refusal> {
    let cookie = service.access.cookie(&login.token)?;
    let value = HeaderValue::from_str(&cookie).map_err(|error| Refusal::failure(error.to_string()))?;
    Ok((StatusCode::NO_CONTENT, [(header::SET_COOKIE, value)]).into_response())
}
