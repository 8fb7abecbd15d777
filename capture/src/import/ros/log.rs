//! A log of messages by topic, whatever file it lies in.

use super::reader::Coding;

/// A topic.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Topic {
    pub(super) name: String,
    /// The type of its messages, such as `sensor_msgs/Image`; ROS 2 has `/msg/` in between.
    pub(super) kind: String,
    pub(super) coding: Coding,
}

impl Topic {
    /// True where its messages are of a type, by its name without the package's folder.
    pub(super) fn is(&self, kind: &str) -> bool {
        self.kind == kind || self.kind.replace("/msg/", "/") == kind
    }
}

/// A message of a log, without its content.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct LogMessage {
    /// Its topic, by index.
    pub(super) topic: usize,
    /// When it was recorded, nanoseconds.
    pub(super) time_ns: i64,
}

/// A log that was opened, with what is in it.
pub(super) struct Opened<L> {
    pub(super) log: L,
    pub(super) topics: Vec<Topic>,
    pub(super) messages: Vec<LogMessage>,
    /// A sentence where the file is torn.
    pub(super) ending: Option<String>,
}

/// Where messages are read from.
pub(super) trait Log: Send + std::fmt::Debug {
    /// The content of message `k`.
    ///
    /// # Errors
    /// What is wrong with it.
    fn payload(&mut self, k: usize) -> Result<Vec<u8>, String>;
}
