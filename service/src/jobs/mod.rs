//! Jobs: heavy work, one piece at a time, in a queue that survives whatever ends the service.
//!
//! - `job`: what is asked for, and how it stands;
//! - `store`: the queue on disk;
//! - `queue`: the worker, cancelling and retrying;
//! - `work`: the calls of the pipeline;
//! - `progress`: how far it is, and where it can stop or wait.

pub mod job;
mod progress;
mod queue;
mod store;
mod work;

pub use queue::Jobs;
