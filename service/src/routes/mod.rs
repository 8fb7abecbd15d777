//! The addresses of the service, one file a subject matter.

pub mod archive;
mod blocking;
pub mod capture;
pub mod devices;
pub mod edits;
pub mod events;
pub mod files;
pub mod jobs;
mod json;
pub mod metrics;
pub mod session;
pub mod subject;
