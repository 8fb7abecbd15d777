//! The catalogue as CSV (RFC 4180), a file a table.

use std::path::{Path, PathBuf};

use serde_json::Value;
use toile_capture::files::atomic_write;

use super::{Catalog, query::Table};
use crate::ArchiveError;

/// The tables that are exported.
const TABLES: [&str; 6] = ["subjects", "takes", "steps", "measures", "remarks", "runs"];

impl Catalog {
    /// Writes every table into `folder`, each as `TABLE.csv`.
    ///
    /// # Errors
    /// [`ArchiveError`] where a file cannot be written.
    pub fn export(&self, folder: &Path) -> Result<Vec<PathBuf>, ArchiveError> {
        let write = |table: &str| {
            let path = folder.join(format!("{table}.csv"));
            let rows = self.ask(&format!("SELECT * FROM {table} ORDER BY 1, 2, 3"), "")?;
            atomic_write(&path, rows.csv().as_bytes())?;
            Ok(path)
        };
        TABLES.iter().map(|table| write(table)).collect()
    }
}

impl Table {
    /// As CSV with a line of column names.
    pub fn csv(&self) -> String {
        let line = |cells: Vec<String>| cells.join(",") + "\r\n";
        let head = line(self.columns.iter().map(|name| cell(name)).collect());
        let text = |value: &Value| match value {
            Value::Null => String::new(),
            Value::String(text) => cell(text),
            other => other.to_string(),
        };
        self.rows.iter().fold(head, |all, row| all + &line(row.iter().map(text).collect()))
    }
}

/// Text as a cell. One that a spreadsheet would take for a formula is led by an apostrophe.
fn cell(text: &str) -> String {
    let formula = text.starts_with(['=', '+', '-', '@', '\t', '\r']);
    let text = if formula { format!("'{text}") } else { text.to_string() };
    if text.contains([',', '"', '\n', '\r']) { format!("\"{}\"", text.replace('"', "\"\"")) } else { text }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_are_quoted_where_they_must_be() {
        let table = Table {
            columns: vec!["a".into(), "b".into()],
            rows: vec![vec![Value::Null, 1.5.into()], vec!["x,\"y\"\nz".into(), "=1+1".into()]],
        };
        assert_eq!(table.csv(), "a,b\r\n,1.5\r\n\"x,\"\"y\"\"\nz\",'=1+1\r\n");
    }
}
