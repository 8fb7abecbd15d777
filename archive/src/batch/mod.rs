//! Processing an archive: what is to be done, and doing it side by side.

mod event;
mod ledger;
mod metrics;
mod metrics_port;
mod outlook;
mod quarantine;
mod ray;
mod resources;
mod run;
mod task;
mod worker;

pub use event::{Ended, Event, Fate};
pub use ledger::Totals;
pub use metrics::Metrics;
pub use metrics_port::MetricsPort;
pub use outlook::{Choice, Outlook, Prospect, Version};
pub use ray::{Ray, run_on_ray};
pub use resources::{Memory, cores, memory};
pub use run::{Limits, run};
pub use worker::Program;
