//! The live line: what an operator looks at while the subject turns.

use std::{
    collections::VecDeque,
    fmt,
    path::Path,
    time::{Duration, Instant},
};

use toile_capture::Frame;

use crate::{preview::TurnSeen, stop::Stop};

/// Rates are of the last two seconds.
const WINDOW: Duration = Duration::from_secs(2);
/// Bytes of a megabyte.
const MB: f64 = 1e6;

/// Counts frames and bytes as they come.
#[derive(Debug, Default)]
pub struct Counter {
    /// When frames came, and how many bytes the file had then.
    recent: VecDeque<(Instant, u64)>,
    /// Frames that came.
    pub frames: u64,
    /// Frames that the device lost.
    pub lost: u64,
    /// Frames without depth, or without colour though there is a colour camera.
    pub unpaired: u64,
}

impl Counter {
    /// Takes a frame; `bytes` is the file's size now.
    pub fn push(&mut self, frame: &Frame, has_color: bool, bytes: u64, now: Instant) {
        self.frames += 1;
        self.lost += u64::from(frame.lost_before);
        self.unpaired += u64::from(frame.depth.is_none() || (has_color && frame.color.is_none()));
        self.recent.push_back((now, bytes));
        while self.recent.front().is_some_and(|(then, _)| now.duration_since(*then) > WINDOW) {
            self.recent.pop_front();
        }
    }

    /// Frames and megabytes a second.
    pub fn rates(&self) -> [f64; 2] {
        let (Some(first), Some(last)) = (self.recent.front(), self.recent.back()) else { return [0.0; 2] };
        let seconds = last.0.duration_since(first.0).as_secs_f64();
        if seconds <= 0.0 {
            return [0.0; 2];
        }
        [(self.recent.len() - 1) as f64 / seconds, last.1.saturating_sub(first.1) as f64 / MB / seconds]
    }
}

/// How a take stands while it is recorded.
#[derive(Debug, Clone, PartialEq)]
pub struct Status {
    /// Frames that came.
    pub frames: u64,
    /// Frames that the device lost.
    pub lost: u64,
    /// Frames a second, of the last two seconds.
    pub frames_per_second: f64,
    /// Bandwidth to the disk of the last two seconds.
    pub megabytes_per_second: f64,
    /// Bytes that may still be written; `None` where the system does not say.
    pub disk_left: Option<u64>,
    /// The findings of the preview.
    pub seen: TurnSeen,
    /// When the take ends.
    pub stop: Stop,
    /// How much of the take is done, 0 to 1.
    pub share: f64,
}

/// The line that an operator reads: rate, losses, bandwidth, room on the disk, angle, and the sides not seen yet.
impl fmt::Display for Status {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let rate = self.megabytes_per_second;
        write!(f, "{} frames, {:.0} fps, {rate:.0} MB/s", self.frames, self.frames_per_second)?;
        if self.lost > 0 {
            write!(f, ", {} LOST", self.lost)?;
        }
        if let Some(left) = self.disk_left {
            write!(f, ", {}", disk(left, rate))?;
        }
        match self.stop {
            Stop::AfterOneTurn if self.seen.fused == 0 => write!(f, ", nobody turns yet")?,
            _ => write!(f, ", turned {:.0}°", self.seen.turn.angle().to_degrees())?,
        }
        let unseen = self.seen.turn.unseen();
        if self.seen.fused > 0 && !unseen.is_empty() {
            write!(f, ", not seen yet: {}", unseen.join(", "))?;
        }
        Ok(())
    }
}

fn disk(left: u64, rate: f64) -> String {
    let minutes = left as f64 / MB / rate / 60.0;
    if rate > 0.0 && minutes < 30.0 {
        return format!("DISK FULL in {minutes:.0} min");
    }
    format!("{:.0} GB left", left as f64 / 1e9)
}

/// Bytes that may still be written beside `path`; `None` where the system does not say.
pub fn disk_left(path: &Path) -> Option<u64> {
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let reported = rustix::fs::statvfs(folder).ok()?;
    Some(reported.f_bavail.saturating_mul(reported.f_frsize))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame(lost_before: u32) -> Frame {
        Frame {
            sensor: 0,
            index: 0,
            device_frame: 0,
            lost_before,
            device_time_ns: 0,
            host_time_ns: 0,
            depth: None,
            color: None,
        }
    }

    #[test]
    fn rates_are_of_the_last_two_seconds_and_losses_of_all() {
        let (mut counter, start) = (Counter::default(), Instant::now());
        for i in 0..100u32 {
            let step = if i < 50 { 1000 } else { 100 };
            let at = if i < 50 { i * step } else { 50_000 + (i - 50) * step };
            let now = start + Duration::from_millis(u64::from(at));
            counter.push(&frame(u32::from(i == 3) * 7), false, u64::from(at) * 1000, now);
        }
        let [fps, rate] = counter.rates();
        assert!((fps - 10.0).abs() < 0.1 && (rate - 1.0).abs() < 0.01, "{fps} {rate}");
        let status = Status {
            frames: counter.frames,
            lost: counter.lost,
            frames_per_second: fps,
            megabytes_per_second: rate,
            disk_left: Some(5_000_000_000),
            seen: TurnSeen::default(),
            stop: Stop::AfterOneTurn,
            share: 0.0,
        };
        let text = status.to_string();
        assert!(text.contains("7 LOST") && text.contains("5 GB left") && text.contains("nobody turns"), "{text}");
        assert!(disk(100_000_000, 10.0).contains("DISK FULL"));
    }

    #[test]
    fn the_disk_of_a_folder_is_reported() {
        assert!(disk_left(&std::env::temp_dir().join("x")).is_some_and(|left| left > 0));
        assert!(disk_left(Path::new("no/such/folder/x")).is_none());
    }
}
