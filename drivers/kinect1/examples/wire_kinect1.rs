//! The wire tier's two ends for the Kinect v1, run inside the virtual machine (see `tests/wire/`).
//!
//! `wire_kinect1 serve`: plugs the model into the kernel's virtual host controller and serves it until killed;
//! `wire_kinect1 check FILE COUNT`: compares the first COUNT frames of a take with what the model sent, pixel by pixel;
//! `wire_kinect1 gspca NODE COUNT`: compares COUNT pictures that the kernel's own driver gives with what the model sent;
//! `wire_kinect1 cycles COUNT`: unplugs and replugs the model, each time with frames read through libusb.
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
use toile_driver_kinect1::{Kinect1, Settings};
use toile_driver_models::{
    kinect1::{CameraModel, Content, Pattern},
    vhci::{self, Plugged},
};
use toile_driver_transport::{
    Bus, TransportError,
    libusb::LibusbBus,
    video::{FourCc, Video, kernel::KernelVideo},
    wait_for,
};

/// Port of the kernel's virtual host controller.
const PORT: u32 = 0;

type Outcome<T> = Result<T, Box<dyn Error>>;

fn main() -> Outcome<()> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = words.iter().map(String::as_str).collect();
    match words[..] {
        ["serve"] => {
            // The kernel lets go when it is told to; what was being written then is of no use to it.
            if let Err(error) = plug()?.wait() {
                println!("server: {error}");
            }
            Ok(())
        }
        ["check", file, count] => check(Path::new(file), count.parse()?),
        ["gspca", node, count] => gspca(Path::new(node), count.parse()?),
        ["cycles", count] => cycles(count.parse()?),
        _ => Err("serve | check FILE COUNT | gspca NODE COUNT | cycles COUNT".into()),
    }
}

fn plug() -> Outcome<Plugged> {
    Ok(vhci::plug(Arc::new(Mutex::new(CameraModel::new(Pattern::default()))), PORT)?)
}

/// True where every pixel of a frame is what the model sent.
fn is_identical(frame: &Frame, mm_from_raw: &[u16]) -> bool {
    let number = first_number(frame);
    let truth: Vec<u16> = Pattern::default().depth(number).iter().map(|raw| mm_from_raw[usize::from(*raw)]).collect();
    let depth = frame.depth.as_ref().is_none_or(|depth| depth.values == truth);
    let filter = |i: usize| [[1, 0], [2, 1]][i / 640 % 2][i % 2];
    let color = match &frame.color {
        Some(ColorImage::Rgb(image)) => {
            let seen: Vec<u8> = image.pixels.iter().enumerate().map(|(i, p)| p[filter(i)]).collect();
            seen == Pattern::default().bayer(number)
        }
        Some(_) => false,
        None => true,
    };
    depth && color
}

/// The model's number of a frame, by its time: 30 a second.
fn first_number(frame: &Frame) -> u64 {
    (frame.device_time_ns as f64 * 30e-9).round() as u64
}

/// Millimetres of every raw value by the model's optics: z = 10·r·e / (e − m).
fn millimetres() -> Vec<u16> {
    let mm = |raw: u16| {
        let m = (f64::from(raw) / 4.0 - 200.375) * f64::from(0.1042_f32);
        (10.0 * 120.0 * 7.5 / (7.5 - m)).round() as u16
    };
    (0..2048).map(|raw| if raw == 2047 { 0 } else { mm(raw) }).collect()
}

fn check(file: &Path, count: u64) -> Outcome<()> {
    let (replay, table) = (Replay::open(file)?, millimetres());
    let found = replay.len().min(count);
    let mut identical = 0;
    let (mut lost, mut unpaired) = (0, 0);
    for index in 0..found {
        let frame = replay.frame(index)?;
        identical += u64::from(is_identical(&frame, &table));
        lost += u64::from(frame.lost_before);
        unpaired += u64::from(frame.depth.is_none() || frame.color.is_none());
    }
    let verdict = if identical == count { "PASS" } else { "FAIL" };
    println!("WIRE kinect1 {verdict} {identical}/{count} (lost {lost}, unpaired {unpaired})");
    if identical == count { Ok(()) } else { Err("not every frame is what the model sent".into()) }
}

/// The kernel's driver (`drivers/media/usb/gspca/kinect.c`) gives colour behind the Bayer filter, as it was sent.
fn gspca(node: &Path, count: u64) -> Outcome<()> {
    let mut opened = KernelVideo::default().open(node)?;
    let format = FourCc(*b"GRBG");
    let layout = opened.set_format(format, 640, 480)?;
    if layout.format != format {
        return Err(format!("the driver gives {} where {format} was asked for", layout.format).into());
    }
    opened.start(4)?;
    let (mut next, mut torn) = (0, 0);
    for _ in 0..count {
        let buffer = opened.next_buffer(Duration::from_secs(60))?;
        // The first pictures after the start may be of a frame that was under way.
        let found = (next..next + 300).find(|k| Pattern::default().bayer(*k) == buffer.bytes);
        torn += u64::from(found.is_none());
        next = found.map_or(next, |k| k + 1);
    }
    println!("{} of {count} pictures {format} {}x{} identical", count - torn, layout.width, layout.height);
    if torn <= 1 { Ok(()) } else { Err(format!("{torn} pictures are not what the model sent").into()) }
}

fn cycles(count: u32) -> Outcome<()> {
    let bus = Arc::new(LibusbBus::new()?);
    let table = millimetres();
    let fds = || fs::read_dir("/proc/self/fd").map_or(0, Iterator::count);
    let mut before = 0;
    for cycle in 0..count {
        let plugged = plug()?;
        wait_for(&*bus, |info| info.product == 0x02ae, Duration::from_secs(30))?;
        // The node appears a moment after the device.
        let start = Instant::now();
        let mut kinect = loop {
            match Kinect1::open(&*bus, None, Settings { frame_limit: Duration::from_secs(20), ..Settings::default() }) {
                Ok(kinect) => break kinect,
                Err(error) if start.elapsed() > Duration::from_secs(20) => return Err(error.into()),
                Err(_) => thread::sleep(Duration::from_millis(200)),
            }
        };
        for _ in 0..2 {
            let frame = kinect.next_frame()?.ok_or("the stream ended")?;
            if !is_identical(&frame, &table) {
                return Err("a frame is not what the model sent".into());
            }
        }
        plugged.unplug()?;
        let ended = loop {
            match kinect.next_frame() {
                Ok(Some(_)) => {}
                Ok(None) => return Err("the stream ended without saying why".into()),
                Err(error) => break error.to_string(),
            }
        };
        if !ended.contains("unplugged") {
            return Err(ended.into());
        }
        drop(kinect);
        let start = Instant::now();
        while bus.list()?.iter().any(|info| info.product == 0x02ae) {
            if start.elapsed() > Duration::from_secs(20) {
                return Err(TransportError::TimedOut { what: "unplugging".into(), waited: start.elapsed() }.into());
            }
            thread::sleep(Duration::from_millis(50));
        }
        match cycle {
            0 => before = fds(),
            _ if fds() > before => return Err(format!("{} open files, {before} at first", fds()).into()),
            _ => {}
        }
    }
    println!("WIRE kinect1 unplug PASS {count}/{count}");
    Ok(())
}
