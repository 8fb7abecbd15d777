//! What is to be done in an archive, and how long it will take.

use std::path::{Path, PathBuf};

use rayon::prelude::*;
use serde::Serialize;
use toile_pipeline::{Options, Plan, Standing, plan};

use super::{quarantine::Quarantine, task::memory_of};
use crate::{ArchiveError, find::subjects, keep::forgotten};

/// Which subjects are meant.
#[derive(Debug, Clone, Default)]
pub struct Choice {
    /// Only those whose results a program before this version made (or that have none).
    pub since_version: Option<Version>,
    /// Only those in which this step has to run.
    pub stage: Option<String>,
    /// Those too that failed twice and have not changed since.
    pub quarantined: bool,
}

/// A version of the program: its numbers.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct Version(Vec<u32>);

impl std::str::FromStr for Version {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let numbers = text.trim_start_matches("toile ").split('.').map(str::parse).collect::<Result<Vec<u32>, _>>();
        numbers.map(Self).map_err(|_| format!("`{text}` is not a version such as 0.2 or 0.2.1"))
    }
}

/// A subject and what is to be done with it.
#[derive(Debug, Clone, Serialize)]
pub struct Prospect {
    /// Its path in the archive.
    pub subject: PathBuf,
    /// What a run would do; `None` where the subject cannot be read.
    #[serde(flatten)]
    pub plan: Option<Plan>,
    /// Why it is left out, or cannot be read.
    pub left: Option<String>,
    /// True where it cannot be read.
    pub broken: bool,
}

/// An archive and what is to be done in it.
#[derive(Debug, Clone, Serialize)]
pub struct Outlook {
    /// The subjects in the order of their names.
    pub prospects: Vec<Prospect>,
}

impl Outlook {
    /// Looks at every subject; only small files are read.
    ///
    /// # Errors
    /// [`ArchiveError`] where the archive cannot be listed. A subject that cannot be read is told in its [`Prospect`].
    pub fn new(archive: &Path, options: &Options, choice: &Choice) -> Result<Self, ArchiveError> {
        Ok(Self::of(archive, subjects(archive)?, options, choice))
    }

    /// Looks at these subjects of an archive.
    pub fn of(archive: &Path, subjects: Vec<PathBuf>, options: &Options, choice: &Choice) -> Self {
        let prospects = subjects.into_par_iter().map(|subject| prospect(archive, subject, options, choice));
        Self { prospects: prospects.collect() }
    }

    /// The subjects that have to run.
    pub fn due(&self) -> impl Iterator<Item = (&Path, &Plan)> {
        self.prospects.iter().filter_map(|p| {
            Some((p.subject.as_path(), p.plan.as_ref().filter(|plan| p.left.is_none() && plan.is_due())?))
        })
    }

    /// How many subjects stand so and are not left out.
    pub fn count(&self, standing: Standing) -> usize {
        self.prospects
            .iter()
            .filter(|p| p.left.is_none() && p.plan.as_ref().is_some_and(|plan| plan.standing == standing))
            .count()
    }

    /// Expected seconds of all that is due, one after the other.
    pub fn seconds(&self) -> f64 {
        self.due().fold(0.0, |sum, (_, plan)| sum + plan.seconds)
    }

    /// Expected seconds of all that is due with so many `workers` side by side and so much `memory`, bytes, and the most that will be
    /// under way at once.
    pub fn side_by_side(&self, workers: usize, memory: u64) -> (f64, usize) {
        let seen = self.prospects.iter().filter_map(|p| p.plan.as_ref()?.peak_memory_bytes).max();
        let jobs = self.due().map(|(_, plan)| (plan.seconds, memory_of(plan.peak_memory_bytes, seen)));
        schedule(jobs.collect(), workers, memory)
    }
}

/// When the last of the `jobs` (seconds, bytes) ends if the longest that fits begins whenever there is room, and the most at once. What
/// fits nowhere runs alone.
fn schedule(mut jobs: Vec<(f64, u64)>, workers: usize, memory: u64) -> (f64, usize) {
    jobs.sort_by(|a, b| b.0.total_cmp(&a.0));
    let (mut now, mut most, mut running) = (0.0, 0, Vec::<(f64, u64)>::new());
    while !jobs.is_empty() || !running.is_empty() {
        let kept: u64 = running.iter().map(|r| r.1).sum();
        let room = |job: &(f64, u64)| running.is_empty() || kept + job.1 <= memory;
        let next = jobs.iter().position(room).filter(|_| running.len() < workers.max(1));
        if let Some(at) = next {
            let (seconds, bytes) = jobs.remove(at);
            running.push((now + seconds, bytes));
            most = most.max(running.len());
            continue;
        }
        running.sort_by(|a, b| a.0.total_cmp(&b.0));
        now = running.remove(0).0;
    }
    (now, most)
}

/// One subject as a batch would treat it.
pub(crate) fn prospect(archive: &Path, subject: PathBuf, options: &Options, choice: &Choice) -> Prospect {
    let plan = match plan(&archive.join(&subject), options) {
        Ok(plan) => plan,
        Err(error) => return Prospect { subject, plan: None, left: Some(error.to_string()), broken: true },
    };
    let gone = forgotten(archive, &subject)
        .map(|day| format!("it was forgotten on {day}, and is here again; `toile archive forget` removes it"));
    let left = gone.or_else(|| left_out(&plan, choice)).or_else(|| {
        let failed = Quarantine::holds(archive, &subject, options).filter(|_| !choice.quarantined && plan.is_due())?;
        Some(format!("it failed twice and has not changed since (--again tries it): {failed}"))
    });
    Prospect { subject, plan: Some(plan), left, broken: false }
}

fn left_out(plan: &Plan, choice: &Choice) -> Option<String> {
    if plan.standing == Standing::Withheld {
        return Some(plan.why.join("; "));
    }
    if let Some(wanted) = &choice.since_version
        && let Some(made) = plan.program.as_ref().and_then(|program| program.parse::<Version>().ok())
        && made >= *wanted
    {
        return Some("its results are not older than the version that was named".into());
    }
    let stage = choice.stage.as_ref()?;
    let has = plan.steps.iter().any(|step| step.rsplit('/').next() == Some(stage));
    (!has).then(|| format!("its step {stage} does not have to run"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn memory_limits_what_runs_side_by_side() {
        let jobs = vec![(10.0, 300), (10.0, 300), (10.0, 300), (10.0, 900)];
        assert_eq!(schedule(jobs.clone(), 2, 10_000), (20.0, 2));
        assert_eq!(schedule(jobs.clone(), 4, 10_000), (10.0, 4));
        // The one of 900 has no other beside it, and runs though it is too large.
        assert_eq!(schedule(jobs.clone(), 4, 700), (30.0, 2));
        assert_eq!(schedule(jobs, 4, 100), (40.0, 1));
        assert_eq!(schedule(Vec::new(), 4, 100), (0.0, 0));
    }
}
