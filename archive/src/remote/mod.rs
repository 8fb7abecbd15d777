//! Archives in S3, Google Cloud Storage and Azure: fetched once into a bounded local cache, processed there, sent back whole.
//!
//! The cache is an archive of its own, so that everything else works on it as on any folder. A subject in the bucket has a
//! manifest, `toile-manifest.json`, which is written last and removed first: where it is there, the files that it names are whole,
//! have the hashes that it tells, and are of the takes, the program and the settings that it tells.
//!
//! - [`Bucket::subjects`]: what is there, and how it stands;
//! - [`Rounds`]: fetching, having processed, sending.
//!
//! Credentials come from the environment, as the providers' own tools read it (`AWS_*`, `GOOGLE_*`, `AZURE_*`). They are
//! neither written nor logged. All waiting for the network is inside [`Bucket`].

mod bucket;
mod cache;
mod fetch;
mod manifest;
mod open;
mod rounds;
mod send;
mod subject;
mod told;

pub use bucket::Bucket;
pub use cache::Cache;
pub use rounds::{Here, Moved, Rounds};
pub use subject::RemoteSubject;
