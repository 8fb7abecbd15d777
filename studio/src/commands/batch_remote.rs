//! `toile batch` on a bucket.

use std::path::Path;

use crate::{StudioError, outcome::Answer, session::Session};

/// True where the archive is a bucket's URL.
pub(super) fn is_url(archive: &Path) -> bool {
    let schemes = ["s3://", "gs://", "az://"];
    archive.to_str().is_some_and(|word| schemes.iter().any(|scheme| word.starts_with(scheme)))
}

#[cfg(feature = "cloud")]
pub(super) use remote::{book, run};

#[cfg(not(feature = "cloud"))]
pub(super) use without::{book, run};

#[cfg(not(feature = "cloud"))]
mod without {
    use std::path::Path;

    use toile_archive::catalog::{Catalog, Synced};

    use super::{Answer, Session, StudioError};
    use crate::commands::batch_options::Batch;

    const REASON: &str = "this toile was built without cloud storage; build it with the cargo feature `cloud`";

    pub(in crate::commands) fn run(batch: &Batch, _: &Session) -> Result<Answer, StudioError> {
        Err(StudioError::refused(&batch.archive, REASON))
    }

    pub(in crate::commands) fn book(url: &Path, _: Option<&Path>, _: bool) -> Result<(Catalog, Synced), StudioError> {
        Err(StudioError::refused(url, REASON))
    }
}

#[cfg(feature = "cloud")]
mod remote {
    use std::{
        env,
        path::{Path, PathBuf},
        sync::atomic::Ordering,
    };

    use serde_json::json;
    use toile_archive::{
        batch::{Outlook, Totals},
        catalog::{Catalog, Synced},
        remote::{Bucket, Cache, Moved, RemoteSubject, Rounds},
    };
    use toile_capture::printable_path;
    use toile_pipeline::{Options, hash_bytes, json::plain};

    use super::{Answer, Session, StudioError};
    use crate::commands::{batch_options::Batch, batch_report, batch_work::Work};

    /// Fetches what is stale, has it processed, and sends the results.
    pub(in crate::commands) fn run(batch: &Batch, session: &Session) -> Result<Answer, StudioError> {
        if batch.keep.is_some() || batch.compare.is_some() {
            let message = "--keep and --compare work on folders; fetch a sample of the bucket and compare that";
            return Err(StudioError::Usage(message.into()));
        }
        let bucket = Bucket::open(&batch.archive.to_string_lossy())?;
        let subjects = bucket.subjects(&batch.options())?;
        let stale: Vec<&RemoteSubject> = subjects.iter().filter(|subject| !subject.up_to_date).collect();
        if batch.dry_run {
            return outlook(&subjects, &stale);
        }
        let cache = Cache::open(&cache_folder(batch.cache.as_deref(), bucket.name()), batch.cache_size)?;
        let seconds = stale.iter().map(|subject| subject.seconds).sum();
        let mut work = Work::begin(batch, session, stale.len(), seconds)?;
        let (mut all, mut prospects) = (Totals::default(), Vec::new());
        let (options, stop, up_to_date) = (work.options.clone(), work.stop.clone(), subjects.len() - stale.len());
        let rounds = Rounds { bucket: &bucket, cache: &cache, options: &options, stop: &stop };
        let moved = rounds.run(stale, &mut |names, done| {
            let outlook = Outlook::of(&cache.folder, names, &options, &batch.choice());
            // Results that a batch made which was killed before it sent them.
            let whole = outlook.prospects.iter().filter(|p| p.plan.as_ref().is_some_and(|plan| !plan.is_due()));
            whole.filter(|p| p.left.is_none()).for_each(|prospect| done(&prospect.subject));
            let totals = work.run(&cache.folder, &outlook, &mut |ended| {
                if ended.has_result() {
                    done(&ended.subject);
                }
            })?;
            // A disk that is full is no better for the next round.
            stop.fetch_or(totals.disk_full, Ordering::Relaxed);
            add(&mut all, totals);
            prospects.extend(outlook.prospects);
            Ok(())
        })?;
        let mut answer = batch_report::totals(&Outlook { prospects }, &all)?;
        answer.warnings.extend(work.unnoted.first().map(ToString::to_string));
        tell_moved(&mut answer, moved, up_to_date);
        Ok(answer)
    }

    /// What would be done.
    fn outlook(subjects: &[RemoteSubject], stale: &[&RemoteSubject]) -> Result<Answer, StudioError> {
        let bytes: u64 = stale.iter().map(|subject| subject.bytes).sum();
        let names: String = stale.iter().map(|subject| format!("{}\n", printable_path(&subject.subject))).collect();
        let (all, due) = (subjects.len(), stale.len());
        let text = format!("{names}{all} subjects: {} up to date, {due} stale ({} MiB)\n", all - due, bytes >> 20);
        let results = json!({ "subjects": plain(&subjects)?, "due": due, "up_to_date": all - due });
        Ok(Answer { text, results, ..Answer::default() })
    }

    /// The catalogue of a bucket, up to date; it lies in the cache.
    pub(in crate::commands) fn book(
        url: &Path,
        cache: Option<&Path>,
        rebuild: bool,
    ) -> Result<(Catalog, Synced), StudioError> {
        let bucket = Bucket::open(&url.to_string_lossy())?;
        let subjects = bucket.subjects(&Options::default())?;
        let folder = cache_folder(cache, bucket.name());
        if rebuild {
            Catalog::discard(&folder);
        }
        let mut book = Catalog::open(&folder)?;
        let synced = book.sync_bucket(&bucket, &subjects)?;
        Ok((book, synced))
    }

    fn tell_moved(answer: &mut Answer, moved: Moved, up_to_date: usize) {
        let Moved { sent, elsewhere, failures } = moved;
        answer.text.push_str(&format!(
            "results of {sent} subjects were sent; {up_to_date} were up to date in the bucket, {elsewhere} more by the time they were to be fetched\n"
        ));
        answer.results["sent"] = sent.into();
        answer.results["up_to_date"] = (up_to_date + elsewhere).into();
        answer.failures.extend(failures);
    }

    fn add(all: &mut Totals, round: Totals) {
        all.ended.extend(round.ended);
        all.seconds += round.seconds;
        all.cpu_seconds += round.cpu_seconds;
        all.most_at_once = all.most_at_once.max(round.most_at_once);
        all.stopped |= round.stopped;
        all.disk_full |= round.disk_full;
    }

    /// The folder that was given, or one of this bucket's own in the user's cache.
    fn cache_folder(given: Option<&Path>, name: &str) -> PathBuf {
        let home = || PathBuf::from(env::var_os("HOME").unwrap_or_else(|| ".".into())).join(".cache");
        let user = || env::var_os("XDG_CACHE_HOME").map_or_else(home, PathBuf::from);
        let own = || user().join("toile").join(&hash_bytes(name.trim_end_matches('/').as_bytes())[..16]);
        given.map_or_else(own, Path::to_path_buf)
    }
}
