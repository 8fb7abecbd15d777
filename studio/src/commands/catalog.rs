//! `toile catalog`: questions to an archive.

use std::path::PathBuf;

use serde_json::{Value, json};
use toile_archive::catalog::{Catalog as Book, QUERIES, Synced, Table};
use toile_capture::printable_path;
use toile_pipeline::json::plain;

use super::{batch_remote, reach::must_exist};
use crate::{StudioError, outcome::Answer, session::Session};

const AFTER: &str = "\
The catalogue is the SQLite file ARCHIVE/.toile/catalog.sqlite. It is brought up to date first: only subjects that changed are read.

Examples:
  toile catalog archive                              # every subject
  toile catalog archive doubted --since 0.2          # all fits doubted since version 0.2
  toile catalog archive girths --csv > girths.csv
  toile catalog archive measures --parquet measures.parquet
  toile catalog archive --sql 'SELECT avg(value_m) FROM measures WHERE name = \"stature\"'
  toile catalog archive --export tables              # a CSV file a table";

/// Ask an archive: subjects, verdicts, measures, warnings, times
#[derive(Debug, clap::Args)]
#[command(after_help = AFTER)]
pub struct Catalog {
    /// Folder that holds subjects, or s3://BUCKET/PREFIX, gs://BUCKET/PREFIX, az://CONTAINER/PREFIX
    #[arg(value_name = "ARCHIVE")]
    archive: PathBuf,
    /// A question by its name (`list` shows all of them)
    #[arg(value_name = "QUESTION", default_value = "subjects")]
    question: String,
    /// For questions that know it: results of this version of the program or a later one
    #[arg(long, value_name = "VERSION", default_value = "")]
    since: String,
    /// Any other question, in SQL
    #[arg(long, value_name = "SELECT")]
    sql: Option<String>,
    /// Answer as CSV
    #[arg(long)]
    csv: bool,
    /// Write the answer as a Parquet file
    #[arg(long, value_name = "FILE")]
    parquet: Option<PathBuf>,
    /// Write every table as CSV into this folder
    #[arg(long, value_name = "DIR")]
    export: Option<PathBuf>,
    /// For an archive in a bucket: the folder that keeps the catalogue (without: in the user's cache)
    #[arg(long, value_name = "DIR")]
    cache: Option<PathBuf>,
    /// Throw the catalogue away and read the whole archive again (how earlier batches went is lost)
    #[arg(long)]
    rebuild: bool,
}

impl Catalog {
    /// Runs the command.
    ///
    /// # Errors
    /// [`StudioError`] where the archive cannot be read, or there is no such question.
    pub fn run(&self, _: &Session) -> Result<Answer, StudioError> {
        if self.question == "list" {
            return Ok(list());
        }
        let sql = match &self.sql {
            Some(sql) => sql.as_str(),
            None => {
                QUERIES.iter().find(|query| query.name == self.question).map(|query| query.sql).ok_or_else(|| {
                    StudioError::Usage(format!(
                        "there is no question `{}`; `toile catalog ARCHIVE list` shows all",
                        self.question
                    ))
                })?
            }
        };
        let (book, synced) = self.book()?;
        let warnings = synced.broken.clone();
        if let Some(folder) = &self.export {
            let files = book.export(folder)?;
            let files: Vec<String> = files.iter().map(|file| printable_path(file)).collect();
            return Ok(Answer {
                text: files.join("\n"),
                results: json!({ "files": files }),
                warnings,
                ..Answer::default()
            });
        }
        let table = book.ask(sql, &self.since)?;
        if let Some(file) = &self.parquet {
            table.write_parquet(file)?;
            let (text, file) = (printable_path(file), file.display().to_string());
            let results = json!({ "files": [file], "rows": table.rows.len(), "synced": plain(&synced)? });
            return Ok(Answer { text, results, warnings, ..Answer::default() });
        }
        let text = if self.csv { table.csv() } else { columns(&table) };
        let file = printable_path(book.path());
        let results = json!({ "table": plain(&table)?, "synced": plain(&synced)?, "file": file });
        Ok(Answer { text, results, warnings, ..Answer::default() })
    }
}

impl Catalog {
    /// The catalogue, up to date.
    fn book(&self) -> Result<(Book, Synced), StudioError> {
        if batch_remote::is_url(&self.archive) {
            return batch_remote::book(&self.archive, self.cache.as_deref(), self.rebuild);
        }
        must_exist(&self.archive)?;
        if self.rebuild {
            Book::discard(&self.archive);
        }
        let mut book = Book::open(&self.archive)?;
        let synced = book.sync()?;
        Ok((book, synced))
    }
}

fn list() -> Answer {
    let line = |query: &toile_archive::catalog::Query| format!("{:<10} {}\n", query.name, query.about);
    let names: Vec<&str> = QUERIES.iter().map(|query| query.name).collect();
    Answer { text: QUERIES.iter().map(line).collect(), results: json!({ "questions": names }), ..Answer::default() }
}

/// The table in columns as wide as they need to be; numbers to the right.
fn columns(table: &Table) -> String {
    let text = |value: &Value| match value {
        Value::Null => "-".to_string(),
        Value::String(text) => text.clone(),
        other => other.to_string(),
    };
    let rows: Vec<Vec<String>> = table.rows.iter().map(|row| row.iter().map(text).collect()).collect();
    let widest = |at: usize| {
        let cells = rows.iter().map(|row| row[at].chars().count());
        cells.chain([table.columns[at].chars().count()]).max().unwrap_or(0)
    };
    let widths: Vec<usize> = (0..table.columns.len()).map(widest).collect();
    let is_number: Vec<bool> = (0..widths.len()).map(|at| table.rows.iter().all(|row| !row[at].is_string())).collect();
    let line = |cells: &[String]| {
        let padded = cells.iter().enumerate().map(|(at, cell)| {
            let width = widths[at];
            if is_number[at] { format!("{cell:>width$}") } else { format!("{cell:<width$}") }
        });
        padded.collect::<Vec<_>>().join("  ").trim_end().to_string() + "\n"
    };
    line(&table.columns) + &rows.iter().map(|row| line(row)).collect::<String>()
}
