//! What the wire tier proves with a model behind the kernel: a take compared with what the model sent, the first frame,
//! unplugging. Each proof answers in a sentence, which says what differed where it failed.

use std::{
    fmt::Debug,
    fs, io,
    path::Path,
    thread,
    time::{Duration, Instant},
};

use toile_capture::{Frame, Replay, Source};

use crate::vhci::Plugged;

/// How long a kernel beside much other work may take for what it does at once.
const PATIENCE: Duration = Duration::from_secs(60);
/// How often a condition is looked at.
const LOOK: Duration = Duration::from_millis(20);
/// What the first frame may take, and how often that is tried: other work of the machine must not decide.
const FIRST_LIMIT: Duration = Duration::from_secs(1);
const FIRST_TRIES: u32 = 5;
/// Frames of a cycle before the unplugging.
const CYCLE_FRAMES: u32 = 2;

/// A model and the driver that it is to prove.
pub trait Bench {
    /// Plugs the model in.
    ///
    /// # Errors
    /// Where the kernel does not take it.
    fn plug(&mut self) -> io::Result<Plugged>;

    /// True when all that the driver opens is there.
    fn is_there(&self) -> bool;

    /// True when nothing of the device is left.
    fn is_gone(&self) -> bool;

    /// Opens it with the driver.
    ///
    /// # Errors
    /// What the driver says.
    fn open(&mut self) -> Result<Box<dyn Source>, String>;

    /// How a frame differs from what the model sent; `None` where every pixel is the same.
    fn difference(&mut self, frame: &Frame) -> Option<String>;
}

/// How an image differs from what was sent; `None` where it does not.
pub fn difference<T: PartialEq + Debug>(what: &str, seen: &[T], sent: &[T]) -> Option<String> {
    if seen.len() != sent.len() {
        return Some(format!("{what} has {} pixels instead of {}", seen.len(), sent.len()));
    }
    let at = seen.iter().zip(sent).position(|(a, b)| a != b)?;
    let count = seen.iter().zip(sent).filter(|(a, b)| a != b).count();
    Some(format!("{what} differs in {count} pixels, first in {at}: {:?} instead of {:?}", seen[at], sent[at]))
}

/// Compares the first `count` frames of a take with what the model sent, and its numbers with the losses that it tells.
///
/// # Errors
/// What differs.
pub fn take(file: &Path, count: u64, mut difference: impl FnMut(&Frame) -> Option<String>) -> Result<String, String> {
    let replay = Replay::open(file).map_err(|error| error.to_string())?;
    let (mut identical, mut lost, mut unpaired) = (0, 0, 0);
    let (mut last, mut wrong) = (None, Vec::new());
    for index in 0..replay.len().min(count) {
        let frame = replay.frame(index).map_err(|error| error.to_string())?;
        let Frame { device_frame: number, lost_before, .. } = frame;
        match difference(&frame) {
            None => identical += 1,
            Some(how) => wrong.push(format!("frame {index} (device's {number}): {how}")),
        }
        if last.is_some_and(|last: u64| number != last + 1 + u64::from(lost_before)) {
            wrong.push(format!("frame {index} is the device's {number} and tells {lost_before} lost after {last:?}"));
        }
        last = Some(number);
        lost += u64::from(lost_before);
        unpaired += u64::from(frame.depth.is_none() || frame.color.is_none());
    }
    let said = format!("{identical}/{count} (lost {lost}, unpaired {unpaired})");
    match wrong.first() {
        None if identical == count => Ok(said),
        None => Err(format!("{said}: the take has only {} frames", replay.len())),
        Some(first) => Err(format!("{said}: {first}; {} such in all", wrong.len())),
    }
}

/// Time from opening to the first frame: the best of up to five.
///
/// # Errors
/// Where it is not below a second, or the frame differs.
pub fn first_frame(bench: &mut impl Bench) -> Result<String, String> {
    let mut best = Duration::MAX;
    for _ in 0..FIRST_TRIES {
        let plugged = bench.plug().map_err(|error| error.to_string())?;
        wait("plugging in", || bench.is_there())?;
        let start = Instant::now();
        let mut source = bench.open()?;
        let frame = next(&mut *source)?;
        best = best.min(start.elapsed());
        if let Some(how) = bench.difference(&frame) {
            return Err(format!("first frame: {how}"));
        }
        drop(source);
        plugged.unplug().map_err(|error| error.to_string())?;
        wait("unplugging", || bench.is_gone())?;
        if best < FIRST_LIMIT {
            return Ok(format!("{} ms of guest time", best.as_millis()));
        }
    }
    Err(format!("the first frame takes {} ms of guest time", best.as_millis()))
}

/// Unplugs and replugs the model, each time with frames read.
///
/// # Errors
/// Where a frame differs, the driver does not say what happened, or files stay open.
pub fn cycles(bench: &mut impl Bench, count: u32) -> Result<String, String> {
    let mut before = 0;
    for cycle in 0..count {
        one_cycle(bench).map_err(|error| format!("{cycle}/{count}: {error}"))?;
        let open = fs::read_dir("/proc/self/fd").map_or(0, Iterator::count);
        match cycle {
            0 => before = open,
            _ if open > before => return Err(format!("{cycle}/{count}: {open} open files, {before} at first")),
            _ => {}
        }
    }
    Ok(format!("{count}/{count}"))
}

fn one_cycle(bench: &mut impl Bench) -> Result<(), String> {
    let plugged = bench.plug().map_err(|error| error.to_string())?;
    wait("plugging in", || bench.is_there())?;
    let mut source = bench.open()?;
    for _ in 0..CYCLE_FRAMES {
        let frame = next(&mut *source)?;
        if let Some(how) = bench.difference(&frame) {
            return Err(format!("device's frame {}: {how}", frame.device_frame));
        }
    }
    plugged.unplug().map_err(|error| error.to_string())?;
    let ended = loop {
        match source.next_frame() {
            Ok(Some(_)) => {}
            Ok(None) => return Err("the stream ended without saying why".into()),
            Err(error) => break error.to_string(),
        }
    };
    if !ended.contains("unplugged") {
        return Err(ended);
    }
    drop(source);
    wait("unplugging", || bench.is_gone())
}

fn next(source: &mut dyn Source) -> Result<Frame, String> {
    source.next_frame().map_err(|error| error.to_string())?.ok_or_else(|| "the stream ended".into())
}

fn wait(what: &str, mut is_done: impl FnMut() -> bool) -> Result<(), String> {
    let start = Instant::now();
    while !is_done() {
        if start.elapsed() > PATIENCE {
            return Err(format!("{what} takes more than {} s", PATIENCE.as_secs()));
        }
        thread::sleep(LOOK);
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn differences_are_told_with_their_place() {
        assert_eq!(difference("depth", &[1, 2, 3], &[1, 2, 3]), None);
        let how = difference("depth", &[1, 7, 8], &[1, 2, 3]).unwrap();
        assert_eq!(how, "depth differs in 2 pixels, first in 1: 7 instead of 2");
        assert!(difference("depth", &[1], &[1, 2]).unwrap().contains("1 pixels instead of 2"));
    }
}
