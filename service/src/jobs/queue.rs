//! The worker: takes the next job, does it with the least priority, and writes down how it ended.

use std::{
    any::Any,
    fs::{self, File},
    panic::{AssertUnwindSafe, catch_unwind},
    path::{Path, PathBuf},
    sync::{
        Arc, Condvar, Mutex, MutexGuard, PoisonError,
        atomic::{AtomicBool, Ordering},
    },
    thread::JoinHandle,
    time::{Duration, Instant},
};

use toile_pipeline::{PipelineError, Remarks};

use super::{
    job::{Job, JobState, NewJob},
    progress::{Cancelled, Hearing, Progress},
    store::Store,
    work::work,
};
use crate::{
    archive::Archive,
    clock::now,
    error::{Refusal, ServiceError},
    events::Events,
    yielding::{Priority, step_back},
};

/// Jobs that are listed.
const LISTED: usize = 200;
/// A subject that another program holds is tried again after this long.
const AGAIN: Duration = Duration::from_secs(2);
/// A job that was begun this often and never ended (the service was killed each time) is given up.
const MOST_ATTEMPTS: u64 = 50;

/// The queue, and the thread that works on it.
pub struct Jobs {
    shared: Arc<Shared>,
    worker: Mutex<Option<JoinHandle<()>>>,
}

struct Shared {
    archive: Arc<Archive>,
    events: Events,
    priority: Arc<Priority>,
    queue: Mutex<Queue>,
    changed: Condvar,
}

struct Queue {
    store: Store,
    running: Option<Running>,
    /// Subjects that another program held, and when.
    held: Vec<(String, Instant)>,
    ends: bool,
}

struct Running {
    job: Job,
    cancel: Arc<AtomicBool>,
}

impl Jobs {
    /// Opens the queue of an archive and begins to work.
    ///
    /// # Errors
    /// [`ServiceError`] where the queue cannot be read, or no thread can be had.
    pub fn open(archive: Arc<Archive>, events: Events, priority: Arc<Priority>) -> Result<Self, ServiceError> {
        let store = Store::open(&archive.own("jobs.sqlite"))?;
        let queue = Mutex::new(Queue { store, running: None, held: Vec::new(), ends: false });
        let shared = Arc::new(Shared { archive, events, priority, queue, changed: Condvar::new() });
        let pool = rayon::ThreadPoolBuilder::new()
            .thread_name(|k| format!("job {k}"))
            .start_handler(|_| step_back())
            .build()
            .map_err(std::io::Error::other)?;
        let its = shared.clone();
        let worker = std::thread::Builder::new().name("jobs".into()).spawn(move || {
            step_back();
            while its.work_on_next(&pool) {}
        })?;
        Ok(Self { shared, worker: Mutex::new(Some(worker)) })
    }

    /// Enters a job.
    ///
    /// # Errors
    /// 409 where the same waits or runs already, or 422 where its options are wrong.
    pub fn add(&self, new: &NewJob) -> Result<Job, Refusal> {
        new.check()?;
        let job = self.shared.queue().store.add(new, now())?;
        let job = job.ok_or_else(|| Refusal::conflict(format!("the same is queued for {} already", new.subject)))?;
        self.shared.tell(&job);
        Ok(job)
    }

    /// True where the job at work now works on that subject.
    pub fn works_on(&self, subject: &str) -> bool {
        self.shared.queue().running.as_ref().is_some_and(|running| running.job.subject == subject)
    }

    /// The last jobs, newest first.
    ///
    /// # Errors
    /// 500 where the queue cannot be read.
    pub fn list(&self) -> Result<Vec<Job>, Refusal> {
        let queue = self.shared.queue();
        let jobs = queue.store.last(LISTED)?.into_iter();
        Ok(jobs.map(|job| queue.present(job)).collect())
    }

    /// Jobs that are not over.
    ///
    /// # Errors
    /// 500 where the queue cannot be read.
    pub fn open_jobs(&self) -> Result<Vec<Job>, Refusal> {
        let queue = self.shared.queue();
        let running = queue.running.as_ref().map(|running| running.job.clone());
        Ok(running.into_iter().chain(queue.store.queued()?).collect())
    }

    /// How many jobs are in each state.
    ///
    /// # Errors
    /// 500 where the queue cannot be read.
    pub fn counts(&self) -> Result<Vec<(JobState, u64)>, Refusal> {
        Ok(self.shared.queue().store.counts()?)
    }

    /// The subjects of which the last job has failed.
    pub fn failed_subjects(&self) -> Vec<String> {
        self.shared.queue().store.failed_subjects().unwrap_or_default()
    }

    /// One job.
    ///
    /// # Errors
    /// 404 where there is none of that number.
    pub fn get(&self, id: i64) -> Result<Job, Refusal> {
        let queue = self.shared.queue();
        queue.get(id)
    }

    /// Cancels a job: at once where it waits, at its next step where it runs.
    ///
    /// # Errors
    /// 404 where there is none, 409 where it is over.
    pub fn cancel(&self, id: i64) -> Result<Job, Refusal> {
        let queue = self.shared.queue();
        let mut job = queue.get(id)?;
        if job.state.is_over() {
            return Err(Refusal::conflict(format!("job {id} is over already")));
        }
        if let Some(running) = queue.running.as_ref().filter(|running| running.job.id == id) {
            running.cancel.store(true, Ordering::Release);
            return Ok(job);
        }
        (job.state, job.ended, job.step) = (JobState::Cancelled, Some(now()), None);
        queue.store.save(&job)?;
        drop(queue);
        self.shared.tell(&job);
        Ok(job)
    }

    /// Queues a job again that is over.
    ///
    /// # Errors
    /// 404 where there is none, 409 where it is not over.
    pub fn retry(&self, id: i64) -> Result<Job, Refusal> {
        let queue = self.shared.queue();
        let job = queue.get(id)?;
        if !job.state.is_over() {
            return Err(Refusal::conflict(format!("job {id} is not over; cancel it first")));
        }
        let job = Job { state: JobState::Queued, progress: None, step: None, error: None, ended: None, ..job };
        queue.store.save(&job)?;
        drop(queue);
        self.shared.tell(&job);
        Ok(job)
    }

    /// What a job has said.
    ///
    /// # Errors
    /// 404 where there is none of that number.
    pub fn log(&self, id: i64) -> Result<String, Refusal> {
        self.get(id)?;
        Ok(fs::read_to_string(self.shared.log_path(id)).unwrap_or_default())
    }

    /// Ends the worker: the running job stops at its next step and is queued again when the service comes back.
    pub fn end(&self) {
        let mut queue = self.shared.queue();
        queue.ends = true;
        queue.running.iter().for_each(|running| running.cancel.store(true, Ordering::Release));
        drop(queue);
        self.shared.changed.notify_all();
        let worker = self.worker.lock().unwrap_or_else(PoisonError::into_inner).take();
        worker.into_iter().for_each(|worker| drop(worker.join()));
    }
}

impl Drop for Jobs {
    fn drop(&mut self) {
        self.end();
    }
}

impl Queue {
    fn get(&self, id: i64) -> Result<Job, Refusal> {
        let job = self.store.get(id)?.ok_or_else(|| Refusal::missing(format!("there is no job {id}")))?;
        Ok(self.present(job))
    }

    /// A job with what is known of it only while it runs.
    fn present(&self, job: Job) -> Job {
        match &self.running {
            Some(running) if running.job.id == job.id => running.job.clone(),
            _ => job,
        }
    }

    /// The next job of a subject that nobody holds.
    fn next(&mut self) -> Option<Job> {
        self.held.retain(|(_, since)| since.elapsed() < AGAIN);
        let mut queued = self.store.queued().unwrap_or_default().into_iter();
        queued.find(|job| !self.held.iter().any(|(subject, _)| *subject == job.subject))
    }
}

impl Shared {
    fn queue(&self) -> MutexGuard<'_, Queue> {
        self.queue.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn log_path(&self, id: i64) -> PathBuf {
        self.archive.own("logs").join(format!("{id}.log"))
    }

    /// Tells everybody how a job stands, and the worker that there is something to do.
    fn tell(&self, job: &Job) {
        self.events.job(job);
        self.changed.notify_all();
    }

    /// Waits for a job and does it; false at the end.
    fn work_on_next(&self, pool: &rayon::ThreadPool) -> bool {
        let mut queue = self.queue();
        let (job, cancel) = loop {
            if queue.ends {
                return false;
            }
            if let Some(job) = queue.next() {
                let job = Job {
                    state: JobState::Running,
                    started: Some(now()),
                    step: None,
                    progress: Some(0.0),
                    attempt: job.attempt + 1,
                    ..job
                };
                let cancel = Arc::new(AtomicBool::new(false));
                queue.running = Some(Running { job: job.clone(), cancel: cancel.clone() });
                drop(queue.store.save(&job));
                break (job, cancel);
            }
            queue = self.changed.wait_timeout(queue, AGAIN).unwrap_or_else(PoisonError::into_inner).0;
        };
        drop(queue);
        self.events.job(&job);
        let ended = self.run(&job, &cancel, pool);
        self.end_of(job, ended);
        true
    }

    /// Runs a job; a panic that is not its being cancelled would be our own mistake, and fails this job alone.
    fn run(&self, job: &Job, cancel: &AtomicBool, pool: &rayon::ThreadPool) -> Ended {
        let log = match File::options().create(true).append(true).open(self.log_path(job.id)) {
            Ok(log) => log,
            Err(error) => return Ended::Failed(format!("{}: {error}", self.log_path(job.id).display())),
        };
        let root = match self.archive.subject(&job.subject) {
            Ok(root) => root,
            Err(refusal) => return Ended::Failed(refusal.sentence),
        };
        let tell = |progress: Progress| self.at(job.id, progress);
        let hearing = Hearing::new(cancel, self.priority.clone(), log, &tell);
        if job.attempt > MOST_ATTEMPTS {
            let sentence = format!("given up: it was begun {MOST_ATTEMPTS} times, and the service ended each time");
            hearing.say(&sentence);
            return Ended::Failed(sentence);
        }
        hearing.say(&format!("{:?} of {}, attempt {}", job.kind, job.subject, job.attempt));
        let done = catch_unwind(AssertUnwindSafe(|| pool.install(|| work(job.kind, &root, &job.options, &hearing))));
        let ended = Ended::of(done, &root);
        let is_put_off = matches!(ended, Ended::Cancelled) && self.queue().ends;
        hearing.say(&if is_put_off {
            "the service ends; the job goes on when it is back".into()
        } else {
            ended.sentence()
        });
        ended
    }

    /// Notes how far the running job is, and tells it.
    fn at(&self, id: i64, progress: Progress) {
        let mut queue = self.queue();
        let Some(running) = queue.running.as_mut().filter(|running| running.job.id == id) else { return };
        let job = &mut running.job;
        job.progress = Some(progress.fraction.max(job.progress.unwrap_or(0.0)));
        job.step = Some(progress.step).filter(|step| !step.is_empty());
        (job.seconds_left, job.paused) = (progress.seconds_left, progress.paused);
        let job = job.clone();
        drop(queue);
        self.events.job(&job);
    }

    /// Writes down how a job ended.
    fn end_of(&self, job: Job, ended: Ended) {
        let mut queue = self.queue();
        let mut job = Job { ended: Some(now()), seconds_left: None, step: None, ..job };
        match ended {
            Ended::Done(remarks) => {
                let Remarks { warnings, lost, failures } = remarks;
                job.warnings = (warnings.len() + lost.len() + failures.len()) as u64;
                (job.state, job.progress) = (JobState::Done, Some(1.0));
                if !failures.is_empty() {
                    (job.state, job.error) = (JobState::Failed, Some(failures.join("; ")));
                }
            }
            Ended::Failed(sentence) => (job.state, job.error) = (JobState::Failed, Some(sentence)),
            // The service ends: the job goes on when it comes back.
            Ended::Cancelled if queue.ends => {
                (job.state, job.ended, job.attempt) = (JobState::Queued, None, job.attempt - 1);
            }
            Ended::Cancelled => job.state = JobState::Cancelled,
            Ended::Busy => {
                (job.state, job.ended, job.progress, job.attempt) = (JobState::Queued, None, None, job.attempt - 1);
                job.step = Some(format!("another program works on {}; it is tried again", job.subject));
                queue.held.push((job.subject.clone(), Instant::now()));
            }
        }
        queue.running = None;
        if let Err(error) = queue.store.save(&job) {
            tracing::error!("job {}: how it ended cannot be written: {error}", job.id);
        }
        drop(queue);
        self.events.job(&job);
        self.events.archive_changed();
    }
}

/// How a job ended.
enum Ended {
    Done(Remarks),
    Failed(String),
    Cancelled,
    /// Another program holds the subject.
    Busy,
}

impl Ended {
    fn of(done: Result<Result<Remarks, PipelineError>, Box<dyn Any + Send>>, root: &Path) -> Self {
        match done {
            Ok(Ok(remarks)) => Self::Done(remarks),
            Ok(Err(error)) if error.is_busy() => Self::Busy,
            Ok(Err(error)) => Self::Failed(error.to_string()),
            Err(panic) if panic.is::<Cancelled>() => Self::Cancelled,
            Err(panic) => {
                let said = panic.downcast_ref::<String>().map(String::as_str);
                let said = said.or(panic.downcast_ref::<&str>().copied()).unwrap_or("unknown");
                Self::Failed(format!("{}: a mistake inside Toile ({said}); please report it", root.display()))
            }
        }
    }

    fn sentence(&self) -> String {
        match self {
            Self::Done(remarks) => {
                let all = remarks.failures.iter().chain(&remarks.lost).chain(&remarks.warnings);
                all.cloned().chain(["done".to_string()]).collect::<Vec<_>>().join("; ")
            }
            Self::Failed(sentence) => format!("failed: {sentence}"),
            Self::Cancelled => "cancelled".into(),
            Self::Busy => "another program works on the subject; it is tried again".into(),
        }
    }
}
