//! The wire tier's two ends for the RealSense D435, run inside the virtual machine (see `tests/wire/`).
//!
//! `wire_realsense serve bulk|isochronous`: plugs the model into the kernel's virtual host controller and serves it
//! until killed;
//! `wire_realsense check NAME FILE COUNT`: compares the first COUNT frames of a take with what the model sent;
//! `wire_realsense first bulk|isochronous`: milliseconds from opening to the first frame;
//! `wire_realsense cycles COUNT`: unplugs and replugs the model, each time with frames read through the kernel.
#![allow(clippy::print_stdout)]

use std::{
    error::Error,
    fs,
    path::Path,
    sync::{Arc, Mutex},
    thread,
    time::{Duration, Instant},
};

use toile_capture::{ColorImage, Frame, Replay, Source};
use toile_driver_models::{
    d435::{self, Content, Pattern},
    uvc::Wire,
    vhci::{self, Plugged},
};
use toile_driver_realsense::{Realsense, Settings, list};
use toile_driver_transport::video::kernel::KernelVideo;

const SIZE: (u16, u16) = (640, 480);
/// Port of the controller: beside the Kinect's.
const PORT: u32 = 1;

type Outcome<T> = Result<T, Box<dyn Error>>;

fn main() -> Outcome<()> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = words.iter().map(String::as_str).collect();
    match words[..] {
        ["serve", name] => {
            // The kernel lets go when it is told to; what was being written then is of no use to it.
            if let Err(error) = plug(wire(name)?)?.wait() {
                println!("server: {error}");
            }
            Ok(())
        }
        ["check", name, file, count] => check(name, Path::new(file), count.parse()?),
        ["first", name] => first(name),
        ["cycles", count] => cycles(count.parse()?),
        _ => Err("serve bulk|isochronous | check NAME FILE COUNT | first bulk|isochronous | cycles COUNT".into()),
    }
}

fn wire(name: &str) -> Outcome<Wire> {
    match name {
        "bulk" => Ok(Wire::Bulk),
        "isochronous" => Ok(Wire::Isochronous),
        other => Err(format!("{other} is neither bulk nor isochronous").into()),
    }
}

fn plug(wire: Wire) -> Outcome<Plugged> {
    let model = d435::model(Pattern::default(), wire);
    Ok(vhci::plug(Arc::new(Mutex::new(model)), PORT)?)
}

/// True where every pixel of a frame is what the model sent: colours by ITU-R BT.601, within one step of rounding.
fn is_identical(frame: &Frame) -> bool {
    let number = (frame.device_time_ns as f64 * 30e-9).round() as u64;
    let depth = frame.depth.as_ref().is_none_or(|depth| depth.values == Pattern::default().depth(number, SIZE));
    let color = match &frame.color {
        Some(ColorImage::Rgb(image)) => is_color(&image.pixels, &Pattern::default().yuyv(number, SIZE)),
        Some(_) => false,
        None => true,
    };
    depth && color
}

fn is_color(pixels: &[[u8; 3]], bytes: &[u8]) -> bool {
    let near = |seen: u8, truth: f64| (f64::from(seen) - truth.clamp(0.0, 255.0)).abs() <= 1.0;
    pixels.len() * 2 == bytes.len()
        && pixels.iter().enumerate().all(|(i, pixel)| {
            let at = i / 2 * 4;
            let y = 1.164_383 * (f64::from(bytes[at + i % 2 * 2]) - 16.0);
            let (u, v) = (f64::from(bytes[at + 1]) - 128.0, f64::from(bytes[at + 3]) - 128.0);
            let truth = [y + 1.596_027 * v, y - 0.391_762 * u - 0.812_968 * v, y + 2.017_232 * u];
            pixel.iter().zip(truth).all(|(seen, truth)| near(*seen, truth))
        })
}

fn check(name: &str, file: &Path, count: u64) -> Outcome<()> {
    let replay = Replay::open(file)?;
    let found = replay.len().min(count);
    let (mut identical, mut lost, mut unpaired, mut numbers) = (0, 0, 0, None);
    for index in 0..found {
        let frame = replay.frame(index)?;
        identical += u64::from(is_identical(&frame));
        lost += u64::from(frame.lost_before);
        unpaired += u64::from(frame.depth.is_none() || frame.color.is_none());
        let first = numbers.map_or(frame.device_frame, |(first, _)| first);
        numbers = Some((first, frame.device_frame));
    }
    let (first, last) = numbers.unwrap_or((1, 0));
    let all_counted = (last + 1).wrapping_sub(first) == found + lost;
    let passed = identical == count && all_counted;
    let verdict = if passed { "PASS" } else { "FAIL" };
    println!("WIRE {name} {verdict} {identical}/{count} (lost {lost}, unpaired {unpaired})");
    if passed { Ok(()) } else { Err("not every frame is what the model sent, or a loss was not counted".into()) }
}

/// Waits for the camera's nodes, or until they are gone.
fn wait(is_there: bool) -> Outcome<KernelVideo> {
    let (video, start) = (KernelVideo::default(), Instant::now());
    loop {
        let found = list(&video)?;
        let is_complete = found.first().is_some_and(|c| c.depth.is_some() && c.color.is_some());
        if is_complete == is_there && (is_there || found.is_empty()) {
            return Ok(video);
        }
        if start.elapsed() > Duration::from_secs(60) {
            return Err(format!("waiting for nodes (there: {is_there}): {found:?}").into());
        }
        thread::sleep(Duration::from_millis(200));
    }
}

fn settings() -> Settings {
    Settings { frame_limit: Duration::from_secs(30), ..Settings::default() }
}

fn first(name: &str) -> Outcome<()> {
    let plugged = plug(wire(name)?)?;
    let video = wait(true)?;
    let start = Instant::now();
    let mut camera = Realsense::open(&video, None, settings())?;
    let opened = start.elapsed().as_millis();
    let frame = camera.next_frame()?.ok_or("the stream ended")?;
    let all = start.elapsed().as_millis();
    let verdict = if is_identical(&frame) { "PASS" } else { "FAIL" };
    println!("WIRE realsense-{name} first frame {verdict} {all} ms of guest time (opened after {opened} ms)");
    drop(camera);
    plugged.unplug()?;
    wait(false)?;
    Ok(())
}

fn cycles(count: u32) -> Outcome<()> {
    let fds = || fs::read_dir("/proc/self/fd").map_or(0, Iterator::count);
    let mut before = 0;
    for cycle in 0..count {
        let plugged = plug(if cycle % 2 == 0 { Wire::Bulk } else { Wire::Isochronous })?;
        let video = wait(true)?;
        let mut camera = Realsense::open(&video, None, settings())?;
        for _ in 0..2 {
            let frame = camera.next_frame()?.ok_or("the stream ended")?;
            if !is_identical(&frame) {
                return Err("a frame is not what the model sent".into());
            }
        }
        plugged.unplug()?;
        let ended = loop {
            match camera.next_frame() {
                Ok(Some(_)) => {}
                Ok(None) => return Err("the stream ended without saying why".into()),
                Err(error) => break error.to_string(),
            }
        };
        if !ended.contains("unplugged") {
            return Err(ended.into());
        }
        drop(camera);
        wait(false)?;
        match cycle {
            0 => before = fds(),
            _ if fds() > before => return Err(format!("{} open files, {before} at first", fds()).into()),
            _ => {}
        }
    }
    println!("WIRE realsense unplug PASS {count}/{count}");
    Ok(())
}
