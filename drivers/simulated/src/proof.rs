//! The proofs of the wire tier, with a model behind the kernel: a take compared with what the model sent, the first frame,
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
const PATIENCE: Duration = Duration::from_mins(1);
/// How often a condition is looked at.
const LOOK: Duration = Duration::from_millis(20);
/// The time limit of the first frame, and how often that is tried: other work of the machine must not decide.
const FIRST_LIMIT: Duration = Duration::from_secs(1);
const FIRST_TRIES: u32 = 5;
/// Frames of a cycle before the unplugging.
const CYCLE_FRAMES: u32 = 2;
/// In a take's second half at least one in this many frames has both depth and colour. A frame that lacks one is not a fault
/// of the driver's: the machine was too slow for that picture, and had the driver only failed to pair it, the model's
/// number of the frame would come twice. But both streams must run.
const PAIRED: u64 = 2;

/// The model's number of what a frame shows, `None` where nothing in it identifies the frame; or how it differs from that.
pub type Shown = Result<Option<u64>, String>;

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
    /// The driver's answer.
    fn open(&mut self) -> Result<Box<dyn Source>, String>;

    /// The picture that the model sent as this frame, where every pixel is the same.
    ///
    /// # Errors
    /// How it differs.
    fn shown(&mut self, frame: &Frame) -> Shown;
}

/// Compares an image with what was sent.
///
/// # Errors
/// How it differs.
pub fn same<T: PartialEq + Debug>(what: &str, seen: &[T], sent: &[T]) -> Result<(), String> {
    if seen.len() != sent.len() {
        return Err(format!("{what} has {} pixels instead of {}", seen.len(), sent.len()));
    }
    let Some(at) = seen.iter().zip(sent).position(|(a, b)| a != b) else { return Ok(()) };
    let count = seen.iter().zip(sent).filter(|(a, b)| a != b).count();
    Err(format!("{what} differs in {count} pixels, first in {at}: {:?} instead of {:?}", seen[at], sent[at]))
}

/// Compares the first `count` frames of a take with what the model sent, and the losses that it reports with the steps of
/// the model's numbers.
///
/// # Errors
/// The difference; where most frames of the second half lack depth or colour.
pub fn take(file: &Path, count: u64, shown: impl FnMut(&Frame) -> Shown) -> Result<String, String> {
    let replay = Replay::open(file).map_err(|error| error.to_string())?;
    let frames = (0..replay.len().min(count)).map(|index| replay.frame(index).map_err(|error| error.to_string()));
    compare(frames, count, shown)
}

fn compare(
    frames: impl Iterator<Item = Result<Frame, String>>,
    count: u64,
    mut shown: impl FnMut(&Frame) -> Shown,
) -> Result<String, String> {
    let (mut seen, mut identical, mut lost, mut unpaired, mut late) = (0, 0, 0, 0, 0);
    // The model's number that was seen last, and what the frames since then make of it.
    let (mut expected, mut wrong) = (None, Vec::new());
    for frame in frames {
        let frame = frame?;
        lost += u64::from(frame.lost_before);
        let lacks = frame.depth.is_none() || frame.color.is_none();
        unpaired += u64::from(lacks);
        late += u64::from(lacks && 2 * seen >= count);
        expected = expected.map(|last: u64| last + 1 + u64::from(frame.lost_before));
        match shown(&frame) {
            Err(how) => wrong.push(format!("frame {seen} (device's {}): {how}", frame.device_frame)),
            Ok(_) if frame.depth.is_none() && frame.color.is_none() => wrong.push(format!("frame {seen} is empty")),
            Ok(number) => {
                identical += 1;
                if let (Some(number), Some(expected)) = (number, expected.filter(|e| number.is_some_and(|n| n != *e))) {
                    wrong.push(format!(
                        "frame {seen} is the model's {number}: by the reported losses it should be {expected}"
                    ));
                }
                expected = number.or(expected);
            }
        }
        seen += 1;
    }
    let said = format!("{identical}/{count} (lost {lost}, unpaired {unpaired})");
    match wrong.first() {
        Some(first) => Err(format!("{said}: {first}; {} such in all", wrong.len())),
        None if seen < count => Err(format!("{said}: the take has only {seen} frames")),
        None if late * PAIRED > count / 2 => Err(format!("{said}: most frames lack depth or colour")),
        None => Ok(said),
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
        bench.shown(&frame).map_err(|how| format!("first frame: {how}"))?;
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
        bench.shown(&frame).map_err(|how| format!("device's frame {}: {how}", frame.device_frame))?;
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
    use std::{ops::Range, sync::Arc};

    use toile_capture::{ColorImage, DepthImage, RgbImage};

    use super::*;

    #[test]
    fn differences_are_reported_with_their_place() {
        assert_eq!(same("depth", &[1, 2, 3], &[1, 2, 3]), Ok(()));
        let how = same("depth", &[1, 7, 8], &[1, 2, 3]).unwrap_err();
        assert_eq!(how, "depth differs in 2 pixels, first in 1: 7 instead of 2");
        assert!(same("depth", &[1], &[1, 2]).unwrap_err().contains("1 pixels instead of 2"));
    }

    /// A take of frames that show these numbers of the model, each with the losses that it reports; those in
    /// `unpaired` have no depth.
    fn compared(numbers: &[(u64, u32)], unpaired: Range<usize>) -> Result<String, String> {
        let depth = DepthImage { width: 1, height: 1, values: vec![1] };
        let color = ColorImage::Rgb(Arc::new(RgbImage { width: 1, height: 1, pixels: vec![[0; 3]] }));
        let frames = numbers.iter().enumerate().map(|(i, (number, lost))| {
            Ok(Frame {
                sensor: 0,
                index: i as u64,
                device_frame: 0,
                lost_before: *lost,
                device_time_ns: *number as i64,
                host_time_ns: 0,
                depth: (!unpaired.contains(&i)).then(|| Arc::new(depth.clone())),
                color: Some(color.clone()),
            })
        });
        compare(frames, numbers.len() as u64, |frame| Ok(frame.depth.as_ref().map(|_| frame.device_time_ns as u64)))
    }

    #[test]
    fn losses_must_be_those_of_the_models_numbers() {
        assert_eq!(compared(&[(7, 0), (8, 0), (11, 2)], 0..0).unwrap(), "3/3 (lost 2, unpaired 0)");
        assert!(compared(&[(7, 0), (8, 0), (11, 0)], 0..0).unwrap_err().contains("is the model's 11"));
        assert!(compared(&[(7, 0), (8, 1), (9, 0)], 0..0).unwrap_err().contains("is the model's 8"));
    }

    #[test]
    fn what_came_of_one_time_must_be_paired() {
        assert!(compared(&[(7, 0), (8, 0), (8, 0), (9, 0)], 1..2).unwrap_err().contains("is the model's 8"));
    }

    #[test]
    fn both_streams_must_run_after_the_start() {
        let numbers: Vec<(u64, u32)> = (0..20).map(|k| (k, 0)).collect();
        assert_eq!(compared(&numbers, 0..15).unwrap(), "20/20 (lost 0, unpaired 15)");
        assert!(compared(&numbers, 14..20).unwrap_err().contains("most frames lack"));
    }
}
