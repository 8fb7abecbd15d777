//! Toile over HTTP: an archive of subjects, jobs, capture with live pictures, and the console in the browser.
//!
//! No algorithm lives here, and nothing that the command line does is done otherwise: [`toile_pipeline`] works on subjects,
//! [`toile_live`] records. This crate says who may ask for what, when it is done, and how it stands:
//!
//! - [`Service`]: an opened archive; [`app`]: all its addresses, as a value that tests can ask without a server;
//! - [`Server`]: the same on a port, with limits, optionally encrypted; [`Access`]: who may ask;
//! - `archive`: subjects, their files, the bin; `jobs`: the queue and its worker; `capture`: camera, pictures, recording;
//! - `routes`: the addresses one by one; [`description`]: all of them in OpenAPI;
//! - `yielding`: capture comes before heavy work.

mod access;
mod app;
mod archive;
mod capture;
mod clock;
mod console;
mod error;
mod events;
mod jobs;
mod limits;
mod metrics;
mod pictures;
mod routes;
mod server;
mod service;
mod yielding;

pub use access::{Access, random_hex};
pub use app::{app, description};
pub use console::is_built as has_console;
pub use error::ServiceError;
pub use server::{Listening, Server, serve};
pub use service::Service;
