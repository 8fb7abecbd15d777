//! Bodies of requests as JSON, refused in one sentence.

use axum::{
    Json,
    extract::{FromRequest, Request, rejection::JsonRejection},
    http::StatusCode,
};
use serde::de::DeserializeOwned;

use crate::error::Refusal;

/// A body that is JSON of the right shape.
pub struct Body<T>(pub T);

impl<S: Send + Sync, T: DeserializeOwned> FromRequest<S> for Body<T> {
    type Rejection = Refusal;

    async fn from_request(request: Request, state: &S) -> Result<Self, Refusal> {
        match Json::<T>::from_request(request, state).await {
            Ok(Json(value)) => Ok(Self(value)),
            Err(rejection) => Err(refusal(&rejection)),
        }
    }
}

fn refusal(rejection: &JsonRejection) -> Refusal {
    match rejection {
        JsonRejection::MissingJsonContentType(_) => {
            let sentence = "the body must be JSON, with the header Content-Type: application/json";
            Refusal::new(StatusCode::UNSUPPORTED_MEDIA_TYPE, sentence)
        }
        other if other.status() == StatusCode::PAYLOAD_TOO_LARGE => {
            Refusal::new(StatusCode::PAYLOAD_TOO_LARGE, "the body is larger than what this address takes")
        }
        other => Refusal::new(other.status(), other.body_text().replace('\n', " ")),
    }
}
