//! MCAP files with messages of ROS: `ros1` as they stand in bags, `cdr` as ROS 2 writes them.

use std::path::Path;

use super::{
    log::{Log, LogMessage, Opened, Topic},
    reader::Coding,
};
use crate::{
    CaptureError,
    recording::log::{MessageLog, Place},
};

/// True where a file is MCAP and has topics of ROS with pictures.
pub(in crate::import) fn holds_ros(path: &Path) -> bool {
    MessageLog::open(path).is_ok_and(|(_, channels, _)| {
        let topics = channels.iter().filter_map(|c| topic(&c.topic, &c.schema, &c.encoding));
        topics.into_iter().any(|topic| topic.is("sensor_msgs/Image") || topic.is("sensor_msgs/CompressedImage"))
    })
}

fn topic(name: &str, kind: &str, encoding: &str) -> Option<Topic> {
    let coding = match encoding {
        "ros1" => Coding::Ros1,
        "cdr" => Coding::Cdr,
        _ => return None,
    };
    Some(Topic { name: name.to_string(), kind: kind.to_string(), coding })
}

/// Opens a file.
///
/// # Errors
/// [`CaptureError`] where it cannot be read.
pub(super) fn open(path: &Path) -> Result<Opened<McapLog>, CaptureError> {
    let (mut log, channels, messages) = MessageLog::open(path)?;
    let mut topics = Vec::new();
    let mut index = vec![None; channels.len()];
    for (channel, slot) in channels.iter().zip(&mut index) {
        if let Some(topic) = topic(&channel.topic, &channel.schema, &channel.encoding) {
            *slot = Some(topics.len());
            topics.push(topic);
        }
    }
    let ours = messages.iter().filter_map(|m| Some((index[m.channel]?, m)));
    let (messages, places): (Vec<LogMessage>, Vec<Place>) = ours
        .map(|(topic, m)| (LogMessage { topic, time_ns: i64::try_from(m.log_time).unwrap_or(i64::MAX) }, m.place))
        .unzip();
    let ending = log.take_loss().map(|loss| format!("{}: {loss}", crate::printable_path(path)));
    Ok(Opened { log: McapLog { log, places }, topics, messages, ending })
}

/// An MCAP file, open.
#[derive(Debug)]
pub(super) struct McapLog {
    log: MessageLog,
    places: Vec<Place>,
}

impl Log for McapLog {
    fn payload(&mut self, k: usize) -> Result<Vec<u8>, String> {
        self.log.read(self.places[k]).map_err(|error| error.reason())
    }
}
