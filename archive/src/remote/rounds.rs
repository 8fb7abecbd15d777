//! A batch over a bucket: fetched, processed and sent in rounds that fit into the cache, the next one fetched meanwhile.

use std::{
    collections::BTreeSet,
    panic::resume_unwind,
    path::{Path, PathBuf},
    sync::{
        atomic::{AtomicBool, Ordering},
        mpsc::{Receiver, channel},
    },
    thread::{self, ScopedJoinHandle},
};

use toile_pipeline::Options;

use super::{bucket::Bucket, cache::Cache, subject::RemoteSubject};
use crate::ArchiveError;

/// A batch over a bucket.
pub struct Rounds<'a> {
    /// Where the subjects are.
    pub bucket: &'a Bucket,
    /// Where they are processed.
    pub cache: &'a Cache,
    /// The options of every run.
    pub options: &'a Options,
    /// Set when the batch is to end.
    pub stop: &'a AtomicBool,
}

/// What was moved.
#[derive(Debug, Default)]
pub struct Moved {
    /// Subjects whose results are in the bucket now.
    pub sent: usize,
    /// Subjects that another batch had done before they were fetched.
    pub elsewhere: usize,
    /// What could not be fetched or sent, a sentence each.
    pub failures: Vec<String>,
}

/// Processes subjects in the cache, and calls back with each that has results.
pub type Here<'a> = dyn FnMut(Vec<PathBuf>, &mut dyn FnMut(&Path)) -> Result<(), ArchiveError> + 'a;

/// A subject, as it is in the bucket when it is fetched, and whether it came.
type Fetched = (RemoteSubject, Result<(), ArchiveError>);

impl Rounds<'_> {
    /// Fetches `subjects`, has them processed by `here`, and sends each one's results as soon as it has some.
    ///
    /// # Errors
    /// [`ArchiveError`] where the cache cannot be written, or from `here`; a subject that cannot be fetched or sent is told in
    /// [`Moved`].
    pub fn run(&self, subjects: Vec<&RemoteSubject>, here: &mut Here) -> Result<Moved, ArchiveError> {
        let (rounds, mut moved) = (split(subjects, self.cache.bytes / 2), Moved::default());
        let mut ahead = None;
        for (number, round) in rounds.iter().enumerate() {
            if self.stop.load(Ordering::Relaxed) {
                break;
            }
            let fetched = match ahead.take() {
                Some(fetched) => fetched,
                None => self.fetch(round, &[])?,
            };
            // What is too large to lie beside this round is fetched after it.
            let next = rounds.get(number + 1).filter(|next| room(round) + room(next) <= self.cache.bytes);
            ahead = thread::scope(|scope| {
                let fetching = next.map(|next| scope.spawn(move || self.fetch(next, round)));
                self.round(fetched, here, &mut moved)?;
                fetching.map(joined).transpose()
            })?;
        }
        Ok(moved)
    }

    /// Brings a round into the cache while the subjects of another are `at_work` there.
    fn fetch(&self, round: &[&RemoteSubject], at_work: &[&RemoteSubject]) -> Result<Vec<Fetched>, ArchiveError> {
        let kept: BTreeSet<&Path> = round.iter().chain(at_work).map(|subject| subject.subject.as_path()).collect();
        self.cache.make_room(&kept, room(round) + room(at_work))?;
        let mut fetched = Vec::new();
        for subject in round.iter().take_while(|_| !self.stop.load(Ordering::Relaxed)) {
            let now = match self.bucket.look_again(subject, self.options) {
                Ok(now) => now,
                Err(error) => {
                    fetched.push(((*subject).clone(), Err(error)));
                    continue;
                }
            };
            let came = if now.up_to_date { Ok(()) } else { self.bucket.fetch(&now, &self.cache.folder) };
            match came {
                Err(error) if error.is_full_disk() => return Err(error),
                came => fetched.push((now, came)),
            }
        }
        Ok(fetched)
    }

    fn round(&self, fetched: Vec<Fetched>, here: &mut Here, moved: &mut Moved) -> Result<(), ArchiveError> {
        let mut ready = Vec::new();
        for (subject, came) in fetched {
            match came {
                Ok(()) if subject.up_to_date => moved.elsewhere += 1,
                Ok(()) => ready.push(subject),
                Err(error) => moved.failures.push(error.to_string()),
            }
        }
        let names = ready.iter().map(|subject| subject.subject.clone()).collect();
        let (send, receive) = channel();
        let (done, sent) = thread::scope(|scope| {
            let sending = scope.spawn(|| self.send(receive, &ready));
            let done = here(names, &mut |subject| drop(send.send(subject.to_path_buf())));
            drop(send);
            (done, joined(sending))
        });
        for result in sent {
            match result {
                Ok(()) => moved.sent += 1,
                Err(error) => moved.failures.push(error.to_string()),
            }
        }
        done
    }

    /// Sends the results of every subject that is told, until nobody tells any more.
    fn send(&self, told: Receiver<PathBuf>, ready: &[RemoteSubject]) -> Vec<Result<(), ArchiveError>> {
        let known = told.into_iter().filter_map(|path| ready.iter().find(|subject| subject.subject == path));
        known.map(|subject| self.bucket.send_results(subject, &self.cache.folder, self.options)).collect()
    }
}

fn joined<T>(thread: ScopedJoinHandle<'_, T>) -> T {
    thread.join().unwrap_or_else(|panic| resume_unwind(panic))
}

fn room(round: &[&RemoteSubject]) -> u64 {
    round.iter().map(|subject| subject.room()).sum()
}

/// Rounds of at most so many bytes; a subject that is larger gets a round of its own.
fn split(subjects: Vec<&RemoteSubject>, bytes: u64) -> Vec<Vec<&RemoteSubject>> {
    let mut rounds: Vec<Vec<&RemoteSubject>> = Vec::new();
    for subject in subjects {
        match rounds.last_mut() {
            Some(round) if room(round) + subject.room() <= bytes => round.push(subject),
            _ => rounds.push(vec![subject]),
        }
    }
    rounds
}

#[cfg(test)]
mod tests {
    use super::{super::bucket::Object, *};

    #[test]
    fn rounds_fit_and_what_is_larger_stands_alone() {
        // Results are counted with two and a half times the takes.
        let subject = |bytes: u64| RemoteSubject {
            subject: PathBuf::new(),
            up_to_date: false,
            bytes,
            seconds: 1.0,
            objects: [("takes/00-body.mcap".to_string(), Object { bytes, mark: String::new() })].into(),
        };
        let all: Vec<RemoteSubject> = [10, 20, 30, 1000, 5].map(subject).into();
        let shape: Vec<usize> = split(all.iter().collect(), 110).iter().map(Vec::len).collect();
        assert_eq!(shape, [2, 1, 1, 1]);
        assert_eq!(split(all.iter().collect(), 100_000).len(), 1);
    }
}
