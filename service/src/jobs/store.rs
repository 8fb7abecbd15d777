//! The queue on disk: an SQLite database that survives whatever ends the service.

use std::path::Path;

use rusqlite::{Connection, OptionalExtension, Row, params, types::Type};
use serde::{Serialize, de::DeserializeOwned};

use super::job::{Job, JobState, Kind, NewJob};
use crate::error::ServiceError;

/// The version of the tables.
const VERSION: i64 = 1;
const TABLES: &str = "
    CREATE TABLE IF NOT EXISTS jobs (
        id INTEGER PRIMARY KEY AUTOINCREMENT,
        kind TEXT NOT NULL, subject TEXT NOT NULL, options TEXT NOT NULL, state TEXT NOT NULL,
        step TEXT, error TEXT, created REAL NOT NULL, started REAL, ended REAL,
        warnings INTEGER NOT NULL DEFAULT 0, attempt INTEGER NOT NULL DEFAULT 0);
    CREATE INDEX IF NOT EXISTS by_state ON jobs (state);
    CREATE INDEX IF NOT EXISTS by_subject ON jobs (subject);";
const COLUMNS: &str = "id, kind, subject, options, state, step, error, created, started, ended, warnings, attempt";

/// The database.
pub struct Store(Connection);

type Result<T> = std::result::Result<T, rusqlite::Error>;

impl Store {
    /// Opens the file; a job that was running when the service ended is queued again.
    ///
    /// # Errors
    /// [`ServiceError::Queue`] where it is no database of ours.
    pub fn open(path: &Path) -> std::result::Result<Self, ServiceError> {
        let wrong = |reason: String| ServiceError::Queue { path: path.to_path_buf(), reason };
        let opened = Connection::open(path).and_then(|db| {
            db.pragma_update(None, "journal_mode", "WAL")?;
            db.pragma_update(None, "synchronous", "FULL")?;
            let version: i64 = db.query_row("PRAGMA user_version", [], |row| row.get(0))?;
            Ok((db, version))
        });
        let (db, version) = opened.map_err(|error| wrong(error.to_string()))?;
        if version > VERSION {
            return Err(wrong(format!("it is of version {version}, and this program knows version {VERSION}")));
        }
        let prepared = db.execute_batch(TABLES).and_then(|()| db.pragma_update(None, "user_version", VERSION));
        let again = prepared.and_then(|()| {
            let step = "the service was ended meanwhile; it begins again";
            db.execute("UPDATE jobs SET state = 'queued', step = ?1 WHERE state = 'running'", [step])
        });
        again.map_err(|error| wrong(error.to_string()))?;
        Ok(Self(db))
    }

    /// Enters a job at the end of the queue; `None` where the same waits or runs already.
    pub fn add(&self, new: &NewJob, now: f64) -> Result<Option<Job>> {
        let options = text(&new.options)?;
        let (kind, state) = (text(&new.kind)?, text(&JobState::Queued)?);
        let same =
            "SELECT 1 FROM jobs WHERE kind = ?1 AND subject = ?2 AND options = ?3 AND state IN ('queued', 'running')";
        if self.0.query_row(same, params![kind, new.subject, options], |_| Ok(())).optional()?.is_some() {
            return Ok(None);
        }
        let entry = "INSERT INTO jobs (kind, subject, options, state, created) VALUES (?1, ?2, ?3, ?4, ?5)";
        self.0.execute(entry, params![kind, new.subject, options, state, now])?;
        self.get(self.0.last_insert_rowid())
    }

    /// The job of that number.
    pub fn get(&self, id: i64) -> Result<Option<Job>> {
        self.0.query_row(&format!("SELECT {COLUMNS} FROM jobs WHERE id = ?1"), [id], job).optional()
    }

    /// The last jobs, newest first.
    pub fn last(&self, most: usize) -> Result<Vec<Job>> {
        self.query(&format!("SELECT {COLUMNS} FROM jobs ORDER BY id DESC LIMIT {most}"))
    }

    /// Jobs that are queued: those that somebody waits for at the screen first, then as they came.
    pub fn queued(&self) -> Result<Vec<Job>> {
        self.query(&format!(
            "SELECT {COLUMNS} FROM jobs WHERE state = 'queued' ORDER BY kind != 'rebuild', id LIMIT 1000"
        ))
    }

    /// How many jobs are in each state.
    pub fn counts(&self) -> Result<Vec<(JobState, u64)>> {
        let mut statement = self.0.prepare_cached("SELECT state, COUNT(*) FROM jobs GROUP BY state")?;
        let rows = statement.query_map([], |row| Ok((named(row, 0)?, row.get::<_, i64>(1)?.unsigned_abs())))?;
        rows.collect()
    }

    /// The subjects of which the last job that ended has failed.
    pub fn failed_subjects(&self) -> Result<Vec<String>> {
        let last = "SELECT subject FROM jobs WHERE state = 'failed' AND id IN
            (SELECT MAX(id) FROM jobs WHERE state IN ('done', 'failed') GROUP BY subject)";
        let mut statement = self.0.prepare_cached(last)?;
        let rows = statement.query_map([], |row| row.get(0))?;
        rows.collect()
    }

    /// Writes how a job stands.
    pub fn save(&self, job: &Job) -> Result<()> {
        let entry =
            "UPDATE jobs SET state = ?2, step = ?3, error = ?4, started = ?5, ended = ?6, warnings = ?7, attempt = ?8
            WHERE id = ?1";
        let (state, warnings, attempt) = (text(&job.state)?, job.warnings as i64, job.attempt as i64);
        self.0
            .execute(entry, params![job.id, state, job.step, job.error, job.started, job.ended, warnings, attempt])?;
        Ok(())
    }

    fn query(&self, words: &str) -> Result<Vec<Job>> {
        let mut statement = self.0.prepare_cached(words)?;
        let rows = statement.query_map([], job)?;
        rows.collect()
    }
}

/// A value as the text that a column holds: names without their quotation marks.
fn text(value: &impl Serialize) -> Result<String> {
    let wrong = |error: serde_json::Error| rusqlite::Error::ToSqlConversionFailure(Box::new(error));
    Ok(serde_json::to_string(value).map_err(wrong)?.trim_matches('"').to_string())
}

/// The value that a column names.
fn named<T: DeserializeOwned>(row: &Row, column: usize) -> Result<T> {
    let name: String = row.get(column)?;
    serde_json::from_value(serde_json::Value::String(name)).map_err(|error| unreadable(column, error))
}

fn unreadable(column: usize, error: serde_json::Error) -> rusqlite::Error {
    rusqlite::Error::FromSqlConversionFailure(column, Type::Text, Box::new(error))
}

fn job(row: &Row) -> Result<Job> {
    let options: String = row.get(3)?;
    let kind: Kind = named(row, 1)?;
    let state: JobState = named(row, 4)?;
    Ok(Job {
        id: row.get(0)?,
        kind,
        subject: row.get(2)?,
        options: serde_json::from_str(&options).map_err(|error| unreadable(3, error))?,
        state,
        progress: (state == JobState::Done).then_some(1.0),
        step: row.get(5)?,
        seconds_left: None,
        error: row.get(6)?,
        created: row.get(7)?,
        started: row.get(8)?,
        ended: row.get(9)?,
        paused: false,
        warnings: row.get::<_, i64>(10)?.unsigned_abs(),
        attempt: row.get::<_, i64>(11)?.unsigned_abs(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::jobs::job::JobOptions;

    fn new(kind: Kind, subject: &str) -> NewJob {
        NewJob { kind, subject: subject.into(), options: JobOptions { layer: Some(1), ..JobOptions::default() } }
    }

    #[test]
    fn the_queue_survives_a_restart_and_a_running_job_begins_again() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("jobs.sqlite");
        let store = Store::open(&path).unwrap();
        let first = store.add(&new(Kind::Process, "anna"), 1.0).unwrap().unwrap();
        store.add(&new(Kind::Process, "ben"), 2.0).unwrap().unwrap();
        store.add(&new(Kind::Rebuild, "ben"), 3.0).unwrap().unwrap();
        assert_eq!(store.add(&new(Kind::Process, "ben"), 4.0).unwrap(), None, "the same is not queued twice");
        store.save(&Job { state: JobState::Running, attempt: 1, ..first }).unwrap();
        drop(store);
        let store = Store::open(&path).unwrap();
        let queued = store.queued().unwrap();
        let order: Vec<(i64, u64)> = queued.iter().map(|job| (job.id, job.attempt)).collect();
        assert_eq!(order, [(3, 0), (1, 1), (2, 0)], "what somebody waits for comes first");
        assert!(queued[1].step.as_deref().unwrap().contains("begins again"));
        store.save(&Job { state: JobState::Failed, error: Some("no".into()), ..queued[1].clone() }).unwrap();
        assert_eq!(store.failed_subjects().unwrap(), ["anna"]);
        assert_eq!(store.last(10).unwrap().iter().map(|job| job.id).collect::<Vec<_>>(), [3, 2, 1]);
    }

    #[test]
    fn a_file_that_is_no_queue_is_told() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("jobs.sqlite");
        std::fs::write(&path, "not a database, not at all: much too plain for that").unwrap();
        assert!(matches!(Store::open(&path), Err(ServiceError::Queue { .. })));
    }
}
