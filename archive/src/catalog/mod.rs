//! The catalogue: an SQLite file about everything in an archive. It can be built again from the archive at any time.

#[cfg(feature = "cloud")]
mod bucket;
mod export;
mod facts;
mod parquet;
mod query;

use std::{
    fs,
    path::{Path, PathBuf},
    time::Duration,
};

use rayon::prelude::*;
use rusqlite::{Connection, Transaction, TransactionBehavior, params};
use serde::Serialize;

use crate::{ArchiveError, batch::Ended, find::subjects, state};
use facts::{Facts, StepFacts, stamp};

pub use query::{QUERIES, Query, Table};

/// Version of the tables.
const VERSION: i64 = 1;
const SCHEMA: &str = include_str!("schema.sql");
/// How long another program may write the file before we give up.
const PATIENCE: Duration = Duration::from_secs(30);

/// The catalogue of an archive: `ARCHIVE/.toile/catalog.sqlite`.
pub struct Catalog {
    archive: PathBuf,
    path: PathBuf,
    connection: Connection,
}

/// What bringing the catalogue up to date did.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize)]
pub struct Synced {
    /// Subjects in the archive.
    pub subjects: usize,
    /// Subjects that were read.
    pub read: usize,
    /// Subjects that are no more.
    pub removed: usize,
    /// Subjects that cannot be read, with the reason.
    pub broken: Vec<String>,
}

impl Catalog {
    /// Opens the catalogue of an archive, or makes an empty one. One of another version, or a damaged one, is made anew.
    ///
    /// # Errors
    /// [`ArchiveError`] where the archive cannot be written.
    pub fn open(archive: &Path) -> Result<Self, ArchiveError> {
        let folder = state::folder(archive);
        fs::create_dir_all(&folder).map_err(|error| ArchiveError::io(&folder, error))?;
        let path = folder.join("catalog.sqlite");
        let connection = match connect(&path) {
            Ok(connection) => connection,
            Err(error) if is_damaged(&error) => {
                remove(&path);
                connect(&path).map_err(|source| ArchiveError::Catalog { path: path.clone(), source })?
            }
            Err(source) => return Err(ArchiveError::Catalog { path, source }),
        };
        Ok(Self { archive: archive.to_path_buf(), path, connection })
    }

    /// Throws the catalogue away.
    pub fn discard(archive: &Path) {
        remove(&state::folder(archive).join("catalog.sqlite"));
    }

    /// Where it is.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Reads every subject whose files changed since it was read last, and forgets those that are no more.
    ///
    /// # Errors
    /// [`ArchiveError`] where the archive cannot be listed or the catalogue not be written.
    pub fn sync(&mut self) -> Result<Synced, ArchiveError> {
        let archive = self.archive.clone();
        let stamped = subjects(&archive)?.into_par_iter().map(|subject| {
            let stamp = stamp(&archive.join(&subject));
            (subject, stamp)
        });
        let found: Vec<(PathBuf, String)> = stamped.collect();
        self.bring(&found, |subject| Facts::read(&archive.join(subject)))
    }

    /// Reads the subjects whose stamps are others than those that are known.
    fn bring(
        &mut self,
        found: &[(PathBuf, String)],
        read: impl Fn(&Path) -> Result<Facts, ArchiveError> + Sync,
    ) -> Result<Synced, ArchiveError> {
        let known = self.stamps()?;
        let changed: Vec<_> = found
            .par_iter()
            .filter_map(|(subject, stamp)| {
                let name = subject.to_string_lossy().into_owned();
                (known.get(&name) != Some(stamp)).then(|| (name, stamp, read(subject)))
            })
            .collect();
        let mut synced = Synced { subjects: found.len(), ..Synced::default() };
        let names: std::collections::BTreeSet<_> = found.iter().map(|(subject, _)| subject.to_string_lossy()).collect();
        let gone: Vec<&String> = known.keys().filter(|name| !names.contains(name.as_str())).collect();
        synced.removed = gone.len();
        self.write(|transaction| {
            gone.iter().try_for_each(|name| forget(transaction, name))?;
            for (name, stamp, facts) in &changed {
                match facts {
                    Ok(facts) => {
                        synced.read += 1;
                        put(transaction, name, stamp, facts)?;
                    }
                    Err(error) => synced.broken.push(format!("{name}: {error}")),
                }
            }
            Ok(())
        })?;
        Ok(synced)
    }

    /// Reads one subject, and notes how a batch ended with it.
    ///
    /// # Errors
    /// [`ArchiveError`] where the catalogue cannot be written.
    pub fn note(&mut self, ended: &Ended) -> Result<(), ArchiveError> {
        let root = self.archive.join(&ended.subject);
        let (name, stamp) = (ended.subject.to_string_lossy().into_owned(), stamp(&root));
        // A subject that cannot be read is told by the batch.
        let facts = Facts::read(&root).ok();
        self.write(|transaction| {
            if let Some(facts) = &facts {
                put(transaction, &name, &stamp, facts)?;
            }
            let run = "INSERT INTO runs VALUES (?1, strftime('%Y-%m-%dT%H:%M:%SZ', 'now'), ?2, ?3, ?4, ?5, ?6, ?7)";
            let of = params![
                name,
                ended.word(),
                ended.why,
                ended.attempts,
                ended.seconds,
                ended.cpu_seconds,
                ended.peak_memory_bytes as i64
            ];
            transaction.execute(run, of).map(drop)
        })
    }

    /// Removes every line about a subject.
    ///
    /// # Errors
    /// [`ArchiveError`] where the catalogue cannot be written.
    pub fn forget(&mut self, subject: &Path) -> Result<(), ArchiveError> {
        let name = subject.to_string_lossy().into_owned();
        self.write(|transaction| {
            transaction.execute("DELETE FROM runs WHERE subject = ?1", [&name])?;
            forget(transaction, &name)
        })?;
        // So that no freed page of the file still holds the name.
        self.connection.execute_batch("VACUUM").map_err(|source| self.wrong(source))
    }

    fn stamps(&self) -> Result<std::collections::BTreeMap<String, String>, ArchiveError> {
        let read = || -> rusqlite::Result<_> {
            let mut statement = self.connection.prepare("SELECT subject, stamp FROM subjects")?;
            statement.query_map([], |row| Ok((row.get(0)?, row.get(1)?)))?.collect()
        };
        read().map_err(|source| self.wrong(source))
    }

    fn write(&mut self, work: impl FnOnce(&Transaction) -> rusqlite::Result<()>) -> Result<(), ArchiveError> {
        let path = self.path.clone();
        let go = || -> rusqlite::Result<()> {
            let transaction = self.connection.transaction_with_behavior(TransactionBehavior::Immediate)?;
            work(&transaction)?;
            transaction.commit()
        };
        go().map_err(|source| ArchiveError::Catalog { path, source })
    }

    fn wrong(&self, source: rusqlite::Error) -> ArchiveError {
        ArchiveError::Catalog { path: self.path.clone(), source }
    }
}

fn connect(path: &Path) -> rusqlite::Result<Connection> {
    let connection = Connection::open(path)?;
    connection.busy_timeout(PATIENCE)?;
    // What is lost with the power is read from the archive again.
    connection.execute_batch("PRAGMA journal_mode = TRUNCATE; PRAGMA synchronous = OFF; PRAGMA secure_delete = ON;")?;
    let version: i64 = connection.query_row("PRAGMA user_version", [], |row| row.get(0))?;
    match version {
        VERSION => connection.query_row("SELECT count(*) FROM subjects", [], |row| row.get::<_, i64>(0)).map(drop)?,
        0 => {
            connection.execute_batch(&format!("BEGIN IMMEDIATE; {SCHEMA} PRAGMA user_version = {VERSION}; COMMIT;"))?;
        }
        _ => return Err(rusqlite::Error::InvalidQuery),
    }
    Ok(connection)
}

/// True where a file is of another version, or no catalogue at all.
fn is_damaged(error: &rusqlite::Error) -> bool {
    use rusqlite::ErrorCode::{DatabaseCorrupt, NotADatabase};
    let torn = matches!(error.sqlite_error_code(), Some(DatabaseCorrupt | NotADatabase));
    torn || matches!(error, rusqlite::Error::InvalidQuery)
}

fn remove(path: &Path) {
    drop(fs::remove_file(path));
    drop(fs::remove_file(path.with_extension("sqlite-journal")));
}

fn forget(transaction: &Transaction, subject: &str) -> rusqlite::Result<()> {
    ["subjects", "takes", "steps", "measures", "remarks"].iter().try_for_each(|table| {
        transaction.execute(&format!("DELETE FROM {table} WHERE subject = ?1"), [subject]).map(drop)
    })
}

/// Writes all lines about a subject anew.
fn put(transaction: &Transaction, name: &str, stamp: &str, facts: &Facts) -> rusqlite::Result<()> {
    forget(transaction, name)?;
    let (subject, plan) = (&facts.subject, &facts.plan);
    let (verdict, estimated) = facts.fit();
    let standing = serde_json::to_value(plan.standing).ok().and_then(|word| word.as_str().map(String::from));
    let (seconds, peak) = facts.steps.iter().fold((0.0, None), |(seconds, peak), step| {
        (seconds + step.times["seconds"].as_f64().unwrap_or(0.0), peak.max(step.times["peak_memory_bytes"].as_i64()))
    });
    transaction.execute(
        "INSERT INTO subjects VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9, ?10, ?11, ?12, ?13)",
        params![
            name,
            subject.name(),
            subject.date(),
            subject.rig(),
            facts.takes.len() as i64,
            standing,
            plan.program,
            verdict,
            estimated,
            seconds,
            peak,
            subject.overdue(),
            stamp
        ],
    )?;
    let mut takes = transaction.prepare("INSERT INTO takes VALUES (?1, ?2, ?3, ?4, ?5)")?;
    for take in &facts.takes {
        takes.execute(params![name, take.number as i64, take.layer, take.garment, take.bytes as i64])?;
    }
    facts.steps.iter().try_for_each(|step| put_step(transaction, name, step))?;
    let mut measures = transaction.prepare("INSERT OR IGNORE INTO measures VALUES (?1, ?2, ?3, ?4, ?5, ?6)")?;
    for measure in &facts.measures {
        let text = |key: &str| measure[key].as_str();
        let number = |key: &str| measure[key].as_f64();
        let of = params![name, text("name"), text("kind"), number("value_m"), number("uncertainty_m"), number("seen")];
        measures.execute(of)?;
    }
    Ok(())
}

fn put_step(transaction: &Transaction, name: &str, step: &StepFacts) -> rusqlite::Result<()> {
    let result = &step.record["result"];
    let verdict = result["verdict"].as_str().or(result["pose"]["verdict"].as_str());
    let mut steps = transaction.prepare("INSERT INTO steps VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9)")?;
    steps.execute(params![
        name,
        step.folder,
        step.step,
        step.record["version"].as_i64(),
        step.program,
        verdict,
        step.times["seconds"].as_f64(),
        step.times["peak_memory_bytes"].as_i64(),
        result.to_string()
    ])?;
    let mut remarks = transaction.prepare("INSERT INTO remarks VALUES (?1, ?2, ?3, ?4, ?5)")?;
    for (kind, key) in [("warning", "warnings"), ("lost", "lost"), ("failure", "failures")] {
        for sentence in step.record[key].as_array().into_iter().flatten().filter_map(serde_json::Value::as_str) {
            remarks.execute(params![name, step.folder, step.step, kind, sentence])?;
        }
    }
    Ok(())
}
