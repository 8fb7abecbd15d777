//! The wire tier's two ends for the Kinect v2, run inside the virtual machine (see `tests/wire/`).
//!
//! `wire_kinect2 serve`: plugs the model into the kernel's virtual host controller, on a USB 3 port, and serves it until
//! killed; `wire_kinect2 check FILE COUNT`: compares the first COUNT frames of a take with what the model sent, pixel by
//! pixel; `wire_kinect2 cycles COUNT`: unplugs and replugs the model, each time with frames read through libusb.
#![allow(clippy::print_stdout)]

use std::{
    collections::BTreeMap,
    error::Error,
    fs,
    os::{fd::AsRawFd, unix::net::UnixStream},
    path::Path,
    sync::{Arc, Mutex},
    thread::{self, JoinHandle},
    time::{Duration, Instant},
};

use toile_capture::{ColorImage, Frame, Replay, RgbImage, Source};
use toile_driver_kinect2::{
    Calibration, DecodeSettings, Decoder, Kinect2, Settings, color, registration::Registration,
};
use toile_driver_models::{
    kinect2::{CameraModel, Content, Pattern},
    usbip,
};
use toile_driver_transport::{Bus, libusb::LibusbBus, wait_for};

/// The kernel's virtual host controller.
const CONTROLLER: &str = "/sys/devices/platform/vhci_hcd.0";
/// A device id of our choice, and super speed (Linux `include/uapi/linux/usb/ch9.h`).
const DEVICE: u32 = 0x1_0003;
const SUPER_SPEED: u32 = 5;
/// The model's product id.
const PRODUCT: u16 = 0x02c4;

type Outcome<T> = Result<T, Box<dyn Error>>;

fn main() -> Outcome<()> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = words.iter().map(String::as_str).collect();
    match words[..] {
        ["serve"] => {
            let served = plug(&Pattern::default())?.thread.join();
            served.map_err(|_| "the server panicked")?;
            Ok(())
        }
        ["check", file, count] => check(Path::new(file), count.parse()?),
        ["cycles", count] => cycles(count.parse()?),
        _ => Err("serve | check FILE COUNT | cycles COUNT".into()),
    }
}

/// A model that the kernel sees.
struct Plugged {
    line: UnixStream,
    thread: JoinHandle<()>,
}

fn plug(pattern: &Pattern) -> Outcome<Plugged> {
    // Made before anybody waits for them.
    let mut pattern = pattern.clone();
    (0..Pattern::FRAMES).for_each(|frame| drop((pattern.depth(frame), pattern.jpeg(frame))));
    let (kernel, ours) = UnixStream::pair()?;
    let port = free_port()?;
    let about = format!("{port} {} {DEVICE} {SUPER_SPEED}", kernel.as_raw_fd());
    fs::write(format!("{CONTROLLER}/attach"), about)?;
    let mut line = ours.try_clone()?;
    let thread = thread::spawn(move || {
        let model = Mutex::new(CameraModel::new(pattern));
        if let Err(error) = usbip::serve(&model, &mut line) {
            println!("server: {error}");
        }
    });
    Ok(Plugged { line: ours, thread })
}

/// The first USB 3 port of the controller that is free: "ss 0015 004 ...".
fn free_port() -> Outcome<u32> {
    let status = fs::read_to_string(format!("{CONTROLLER}/status"))?;
    let ports = status.lines().map(|line| line.split_whitespace().collect::<Vec<_>>());
    let free =
        ports.filter(|words| words.len() > 2 && words[0] == "ss" && words[2] == "004").find_map(|w| w[1].parse().ok());
    Ok(free.ok_or("the virtual host controller has no free USB 3 port")?)
}

fn unplug(plugged: Plugged) -> Outcome<()> {
    plugged.line.shutdown(std::net::Shutdown::Both)?;
    plugged.thread.join().map_err(|_| "the server panicked")?;
    Ok(())
}

/// What each frame of the pattern must give: depth in millimetres and the registered colours.
struct Truth(BTreeMap<u64, (Vec<u16>, RgbImage)>);

impl Truth {
    fn new(pattern: &Pattern) -> Outcome<Self> {
        let mut pattern = pattern.clone();
        let [depth, color, p0] = pattern.optics().answers();
        let calibration = Calibration::parse(&depth, &color, &p0)?;
        let mut decoder = Decoder::new(&calibration, DecodeSettings::default());
        let registration = Registration::new(&calibration);
        let mut frames = BTreeMap::new();
        for frame in 0..Pattern::FRAMES {
            let decoded = decoder.decode(&pattern.depth(frame))?;
            let colors = registration.register(&decoded.depth_mm, &color::decode(&pattern.jpeg(frame))?);
            let mm = decoded.depth_mm.iter().map(|mm| (mm + 0.5) as u16).collect();
            frames.insert(frame, (mm, colors));
        }
        Ok(Self(frames))
    }

    /// True where every pixel of a frame is what the model sent.
    fn is(&self, frame: &Frame) -> bool {
        // The model's number of a frame, by its time: 30 a second.
        let number = (frame.device_time_ns as f64 * 30e-9).round() as u64 % Pattern::FRAMES;
        let Some((mm, colors)) = self.0.get(&number) else { return false };
        let depth = frame.depth.as_ref().is_none_or(|depth| depth.values == *mm);
        // Colour that came alone is not registered by this depth.
        depth && (frame.depth.is_none() || is_color(&frame.color, colors))
    }
}

fn is_color(color: &Option<ColorImage>, truth: &RgbImage) -> bool {
    match color {
        Some(ColorImage::Rgb(image)) => **image == *truth,
        Some(_) => false,
        None => true,
    }
}

fn check(file: &Path, count: u64) -> Outcome<()> {
    let (replay, truth) = (Replay::open(file)?, Truth::new(&Pattern::default())?);
    let found = replay.len().min(count);
    let (mut identical, mut lost, mut unpaired) = (0, 0, 0);
    for index in 0..found {
        let frame = replay.frame(index)?;
        identical += u64::from(truth.is(&frame));
        lost += u64::from(frame.lost_before);
        unpaired += u64::from(frame.depth.is_none() || frame.color.is_none());
    }
    let verdict = if identical == count { "PASS" } else { "FAIL" };
    println!("WIRE kinect2 {verdict} {identical}/{count} (lost {lost}, unpaired {unpaired})");
    if identical == count { Ok(()) } else { Err("not every frame is what the model sent".into()) }
}

fn cycles(count: u32) -> Outcome<()> {
    let bus = Arc::new(LibusbBus::new()?);
    let pattern = Pattern::default();
    let truth = Truth::new(&pattern)?;
    let fds = || fs::read_dir("/proc/self/fd").map_or(0, Iterator::count);
    let mut before = 0;
    for cycle in 0..count {
        let plugged = plug(&pattern)?;
        wait_for(&*bus, |info| info.product == PRODUCT, Duration::from_secs(30))?;
        let mut kinect = open(&bus)?;
        for _ in 0..2 {
            if !truth.is(&kinect.next_frame()?.ok_or("the stream ended")?) {
                return Err("a frame is not what the model sent".into());
            }
        }
        unplug(plugged)?;
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
        while bus.list()?.iter().any(|info| info.product == PRODUCT) {
            if start.elapsed() > Duration::from_secs(20) {
                return Err("the device stays on the bus after its unplugging".into());
            }
            thread::sleep(Duration::from_millis(50));
        }
        match cycle {
            0 => before = fds(),
            _ if fds() > before => return Err(format!("{} open files, {before} at first", fds()).into()),
            _ => {}
        }
    }
    println!("WIRE kinect2 unplug PASS {count}/{count}");
    Ok(())
}

/// The node appears a moment after the device.
fn open(bus: &LibusbBus) -> Outcome<Kinect2> {
    let start = Instant::now();
    let limits = Duration::from_secs(20);
    let settings = Settings { frame_limit: limits, command_limit: limits, ..Settings::default() };
    loop {
        match Kinect2::open(bus, None, settings.clone()) {
            Ok(kinect) => return Ok(kinect),
            Err(error) if start.elapsed() > limits => return Err(error.into()),
            Err(_) => thread::sleep(Duration::from_millis(200)),
        }
    }
}
