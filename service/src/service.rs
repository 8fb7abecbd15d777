//! The service: one archive, its queue, its capture, and who may use them.

use std::{path::Path, sync::Arc};

use crate::{
    access::Access,
    archive::{Archive, Recordings, Summaries, Summary},
    capture::Capture,
    error::{Refusal, ServiceError},
    events::Events,
    jobs::Jobs,
    metrics::Metrics,
    yielding::Priority,
};

/// An opened service; cheap to clone.
#[derive(Clone)]
pub struct Service(Arc<Parts>);

/// The parts of a service.
pub struct Parts {
    /// The folder of subjects.
    pub archive: Arc<Archive>,
    /// Who may ask.
    pub access: Access,
    /// Where events are told.
    pub events: Events,
    /// The queue.
    pub jobs: Jobs,
    /// The camera and what is recorded from it.
    pub capture: Capture,
    /// What was read of subjects.
    pub summaries: Summaries,
    /// Recordings that were looked at.
    pub recordings: Recordings,
    /// Counts for whoever watches the service.
    pub metrics: Metrics,
}

impl std::ops::Deref for Service {
    type Target = Parts;

    fn deref(&self) -> &Parts {
        &self.0
    }
}

impl Service {
    /// Opens an archive, which is created where it is missing, and goes on with its queue.
    ///
    /// # Errors
    /// [`ServiceError`] where the folder cannot be used, another service has it, or its queue cannot be read.
    pub fn open(root: &Path, access: Access) -> Result<Self, ServiceError> {
        let archive = Arc::new(Archive::open(root)?);
        let (events, priority) = (Events::default(), Arc::new(Priority::default()));
        let jobs = Jobs::open(archive.clone(), events.clone(), priority.clone())?;
        let capture = Capture::new(archive.clone(), events.clone(), priority);
        let (summaries, recordings, metrics) = (Summaries::default(), Recordings::default(), Metrics::default());
        Ok(Self(Arc::new(Parts { archive, access, events, jobs, capture, summaries, recordings, metrics })))
    }

    /// Ends what runs: a recording whole, a job at its next step.
    pub fn end(&self) {
        self.capture.end();
        self.jobs.end();
    }

    /// All subjects, as the list shows them.
    pub fn all_summaries(&self) -> Vec<Summary> {
        let failed = self.jobs.failed_subjects();
        self.summaries.all(&self.archive, &|id| failed.iter().any(|subject| subject == id))
    }

    /// One subject, as the list shows it.
    ///
    /// # Errors
    /// 404 where there is none.
    pub fn summary(&self, id: &str) -> Result<Summary, Refusal> {
        self.archive.subject(id)?;
        let failed = self.jobs.failed_subjects().iter().any(|subject| subject == id);
        Ok(self.summaries.one(&self.archive, id, failed))
    }
}
