//! Questions that people ask of an archive, by name, and any other in SQL.

use rusqlite::{Connection, types::ValueRef};
use serde::Serialize;
use serde_json::Value;

use super::Catalog;
use crate::ArchiveError;

/// A question with a name.
#[derive(Debug, Clone, Copy)]
pub struct Query {
    /// Its name on the command line.
    pub name: &'static str,
    /// What it answers.
    pub about: &'static str,
    /// In SQL; `:since` is a version of the program, or empty.
    pub sql: &'static str,
}

const fn query(name: &'static str, about: &'static str, sql: &'static str) -> Query {
    Query { name, about, sql }
}

/// The questions with a name.
pub const QUERIES: &[Query] = &[
    query(
        "subjects",
        "every subject with its verdict, takes and times",
        "SELECT subject, date, takes, standing, program, verdict, round(seconds, 1) AS seconds, \
         peak_memory_bytes / 1048576 AS peak_mib FROM subjects ORDER BY subject",
    ),
    query(
        "doubted",
        "every fit that is not trusted, with the reasons (--since 0.2: made by that version or a later one)",
        "SELECT subject, folder, step, verdict, program, \
         coalesce(result ->> '$.reasons', result ->> '$.pose.reasons') AS reasons FROM steps \
         WHERE verdict IN ('doubtful', 'failed') AND version_number(program) >= version_number(:since) \
         ORDER BY subject, folder",
    ),
    query(
        "girths",
        "the girths of everybody, centimetres",
        "SELECT subject, name, round(100 * value_m, 1) AS cm, round(100 * uncertainty_m, 1) AS uncertainty_cm, \
         round(seen, 2) AS seen FROM measures WHERE kind = 'girth' ORDER BY subject, name",
    ),
    query(
        "measures",
        "all measures of everybody, centimetres",
        "SELECT subject, name, kind, round(100 * value_m, 1) AS cm, round(100 * uncertainty_m, 1) AS uncertainty_cm \
         FROM measures ORDER BY subject, name",
    ),
    query("takes", "every take", "SELECT subject, number, layer, type, bytes FROM takes ORDER BY subject, number"),
    query(
        "warnings",
        "every warning, loss and failure",
        "SELECT subject, folder, step, kind, sentence FROM remarks ORDER BY subject, folder, step, kind, sentence",
    ),
    query(
        "stale",
        "what is not up to date",
        "SELECT subject, standing, program FROM subjects WHERE standing <> 'up-to-date' ORDER BY subject",
    ),
    query(
        "overdue",
        "who was to be kept only until a day that is over",
        "SELECT subject, retain_over FROM subjects WHERE retain_over IS NOT NULL ORDER BY retain_over",
    ),
    query(
        "times",
        "seconds and memory by step",
        "SELECT step, count(*) AS runs, round(sum(seconds), 1) AS seconds, round(avg(seconds), 2) AS mean_seconds, \
         max(peak_memory_bytes) / 1048576 AS peak_mib FROM steps GROUP BY step ORDER BY sum(seconds) DESC",
    ),
    query(
        "runs",
        "how batches ended with every subject, the last first",
        "SELECT subject, at, outcome, attempts, round(seconds, 1) AS seconds, why FROM runs ORDER BY at DESC, subject",
    ),
];

/// An answer: rows under named columns.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Table {
    /// The columns.
    pub columns: Vec<String>,
    /// Their values, row by row.
    pub rows: Vec<Vec<Value>>,
}

impl Catalog {
    /// Answers a question in SQL. `since` is what `:since` stands for. The catalogue cannot be changed by it.
    ///
    /// # Errors
    /// [`ArchiveError`] with what SQLite says.
    pub fn ask(&self, sql: &str, since: &str) -> Result<Table, ArchiveError> {
        let refused = |error: rusqlite::Error| ArchiveError::refused(self.path(), format!("{error} ({sql})"));
        answer(&self.connection, sql, since).map_err(refused)
    }
}

fn answer(connection: &Connection, sql: &str, since: &str) -> rusqlite::Result<Table> {
    connection.execute_batch("PRAGMA query_only = ON")?;
    let told = ask(connection, sql, since);
    connection.execute_batch("PRAGMA query_only = OFF")?;
    told
}

fn ask(connection: &Connection, sql: &str, since: &str) -> rusqlite::Result<Table> {
    use rusqlite::functions::FunctionFlags;
    let flags = FunctionFlags::SQLITE_UTF8 | FunctionFlags::SQLITE_DETERMINISTIC;
    connection.create_scalar_function("version_number", 1, flags, |context| {
        Ok(version_number(&context.get::<Option<String>>(0)?.unwrap_or_default()))
    })?;
    let mut statement = connection.prepare(sql)?;
    let columns: Vec<String> = statement.column_names().map(String::from).collect();
    // What answers no columns is no question: ATTACH and VACUUM INTO would create files.
    if columns.is_empty() {
        return Err(rusqlite::Error::InvalidQuery);
    }
    if let Some(at) = statement.parameter_index(":since")? {
        statement.raw_bind_parameter(at, since)?;
    }
    let (mut found, mut rows) = (statement.raw_query(), Vec::new());
    while let Some(row) = found.next()? {
        rows.push((0..columns.len()).map(|at| row.get_ref(at).map(value)).collect::<rusqlite::Result<_>>()?);
    }
    Ok(Table { columns, rows })
}

/// `toile 0.12.3` as a number that sorts as versions do; 0 where it is none.
fn version_number(text: &str) -> i64 {
    let parts = text.trim_start_matches("toile ").split('.').map(|part| part.parse::<i64>().unwrap_or(0));
    parts.chain([0, 0, 0]).take(3).fold(0, |sum, part| sum * 1_000_000 + part.clamp(0, 999_999))
}

fn value(found: ValueRef) -> Value {
    match found {
        ValueRef::Null => Value::Null,
        ValueRef::Integer(number) => number.into(),
        ValueRef::Real(number) => number.into(),
        ValueRef::Text(text) | ValueRef::Blob(text) => String::from_utf8_lossy(text).into_owned().into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn versions_sort_by_number() {
        assert!(version_number("toile 0.10.0") > version_number("0.9"));
        assert_eq!((version_number(""), version_number("0.2")), (0, version_number("toile 0.2.0")));
    }

    #[test]
    fn every_question_has_an_answer_and_nothing_can_be_changed() {
        let dir = tempfile::tempdir().unwrap();
        let catalog = Catalog::open(dir.path()).unwrap();
        for query in QUERIES {
            let table = catalog.ask(query.sql, "0.2").unwrap();
            assert!(table.rows.is_empty() && !table.columns.is_empty(), "{}", query.name);
        }
        let file = dir.path().join("other.sqlite");
        let creating = [format!("ATTACH '{}' AS other", file.display()), format!("VACUUM INTO '{}'", file.display())];
        for sql in creating.iter().map(String::as_str).chain(["DELETE FROM subjects"]) {
            let said = catalog.ask(sql, "").unwrap_err().to_string();
            assert!(said.contains("not read-only") && !file.exists(), "{said}");
        }
        let returning = "DELETE FROM subjects RETURNING subject";
        assert!(catalog.ask(returning, "").unwrap_err().to_string().contains("readonly"));
        assert!(catalog.ask("SELECT nothing", "").is_err());
    }
}
