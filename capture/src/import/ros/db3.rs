//! One file of a ROS 2 bag in SQLite (`.db3`, as rosbag2's storage of that name writes it): a table of topics, one of messages.

use std::{
    fmt::Write,
    path::{Path, PathBuf},
};

use rusqlite::{Connection, ErrorCode, OpenFlags};

use super::{
    log::{Log, LogMessage, Opened, Topic},
    reader::Coding,
};
use crate::{
    CaptureError,
    files::{open_regular, with_suffix},
    printable_path,
};

/// What an SQLite file starts with.
pub(in crate::import) const MAGIC: &[u8] = b"SQLite format 3\0";

/// A file, open.
#[derive(Debug)]
pub(super) struct Db3 {
    connection: Connection,
    /// The row of each message.
    rows: Vec<i64>,
}

/// Opens a file. Messages are read up to the first row that is damaged.
///
/// # Errors
/// [`CaptureError`] where it is not such a bag.
pub(super) fn open(path: &Path) -> Result<Opened<Db3>, CaptureError> {
    let wrong = |error: rusqlite::Error| {
        CaptureError::format(path, format!("is an SQLite file that cannot be read as a ROS 2 bag: {error}"))
    };
    open_regular(path)?;
    let has_log = with_suffix(path, "-wal").metadata().is_ok_and(|log| log.len() > 0);
    let connection = connect(path, has_log).map_err(wrong)?;
    let (topics, ids) = match read_topics(&connection) {
        // SQLite refuses a file that is shorter than it says, unless it is told to repair: then it reads the pages that are there.
        Err(error) if error.sqlite_error_code() == Some(ErrorCode::DatabaseCorrupt) => {
            connection.pragma_update(None, "writable_schema", true).map_err(wrong)?;
            read_topics(&connection).map_err(wrong)?
        }
        topics => topics.map_err(wrong)?,
    };
    let mut messages = Vec::new();
    let mut ending =
        has_log.then(|| format!("{}: its recorder was stopped before it closed the file", printable_path(path)));
    if let Err(error) = read_messages(&connection, &ids, &mut messages) {
        ending = Some(format!("{}: it is damaged ({error}); what stands before was read", printable_path(path)));
    }
    messages.sort_by_key(|(message, row)| (message.time_ns, *row));
    let (messages, rows) = messages.into_iter().unzip();
    Ok(Opened { log: Db3 { connection, rows }, topics, messages, ending })
}

/// A connection that writes nothing: a file that was closed is opened as one that nobody changes, so that nothing is created beside
/// it. Of a recorder that was killed there may be a write-ahead log with the last messages, which SQLite then reads, too.
fn connect(path: &Path, has_log: bool) -> rusqlite::Result<Connection> {
    let flags = OpenFlags::SQLITE_OPEN_READ_ONLY | OpenFlags::SQLITE_OPEN_NO_MUTEX;
    if has_log {
        return Connection::open_with_flags(path, flags);
    }
    let mut address = String::from("file:");
    for byte in path.as_os_str().as_encoded_bytes() {
        if byte.is_ascii_alphanumeric() || b"/._-".contains(byte) {
            address.push(char::from(*byte));
        } else {
            // Writing to a string cannot fail.
            let _ = write!(address, "%{byte:02X}");
        }
    }
    address.push_str("?immutable=1");
    Connection::open_with_flags(PathBuf::from(address), flags | OpenFlags::SQLITE_OPEN_URI)
}

/// The topics in CDR, and which number each has in the table of messages.
fn read_topics(connection: &Connection) -> rusqlite::Result<(Vec<Topic>, Vec<i64>)> {
    let mut query = connection.prepare("SELECT id, name, type, serialization_format FROM topics ORDER BY id")?;
    let mut rows = query.query([])?;
    let (mut topics, mut ids) = (Vec::new(), Vec::new());
    while let Some(row) = rows.next()? {
        if row.get::<_, String>(3)? == "cdr" {
            ids.push(row.get(0)?);
            topics.push(Topic { name: row.get(1)?, kind: row.get(2)?, coding: Coding::Cdr });
        }
    }
    Ok((topics, ids))
}

/// Lists messages with their rows, in the order of the table.
fn read_messages(connection: &Connection, ids: &[i64], list: &mut Vec<(LogMessage, i64)>) -> rusqlite::Result<()> {
    let mut query = connection.prepare("SELECT id, topic_id, timestamp FROM messages")?;
    let mut rows = query.query([])?;
    while let Some(row) = rows.next()? {
        let (id, topic, time_ns) = (row.get(0)?, row.get::<_, i64>(1)?, row.get(2)?);
        if let Some(topic) = ids.iter().position(|id| *id == topic) {
            list.push((LogMessage { topic, time_ns }, id));
        }
    }
    Ok(())
}

impl Log for Db3 {
    fn payload(&mut self, k: usize) -> Result<Vec<u8>, String> {
        let query = self.connection.prepare_cached("SELECT data FROM messages WHERE id = ?1");
        let data = query.and_then(|mut query| query.query_row([self.rows[k]], |row| row.get(0)));
        data.map_err(|error| format!("message cannot be read: {error}"))
    }
}
