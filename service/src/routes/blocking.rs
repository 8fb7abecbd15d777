//! Work that waits for the disk, away from the threads that answer requests.

use crate::{error::Refusal, service::Service};

/// Runs `work` on a thread that may wait.
///
/// # Errors
/// Those of the work.
pub async fn blocking<T: Send + 'static>(
    service: &Service,
    work: impl FnOnce(&Service) -> Result<T, Refusal> + Send + 'static,
) -> Result<T, Refusal> {
    let service = service.clone();
    tokio::task::spawn_blocking(move || work(&service)).await?
}
