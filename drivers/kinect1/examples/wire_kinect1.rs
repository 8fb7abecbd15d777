//! The wire tier's two ends for the Kinect v1 (see `tests/wire/`); within the virtual machine where not said otherwise.
//!
//! `wire_kinect1 serve`: plugs the model into the kernel's virtual host controller and serves it until killed;
//! `wire_kinect1 check FILE COUNT` (anywhere): compares the first COUNT frames of a take with what the model sent;
//! `wire_kinect1 gspca NODE COUNT`: compares COUNT pictures that the kernel's own driver gives with what the model sent;
//! `wire_kinect1 first`: milliseconds from opening to the first frame;
//! `wire_kinect1 cycles COUNT`: unplugs and replugs the model, each time with frames read through libusb.
#![allow(clippy::print_stdout)]

use std::{
    error::Error,
    io,
    path::Path,
    sync::{Arc, Mutex},
    time::Duration,
};

use toile_capture::{ColorImage, Frame, Source};
use toile_driver_kinect1::{Kinect1, Settings};
use toile_driver_simulated::{
    kinect1::{Content, Pattern, SimulatedCamera},
    proof::{self, Bench, Shown, same},
    vhci::{self, Plugged},
};
use toile_driver_transport::{
    Bus,
    libusb::LibusbBus,
    video::{FourCc, Video, kernel::KernelVideo},
};

type Outcome<T> = Result<T, Box<dyn Error>>;

fn main() -> Outcome<()> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = words.iter().map(String::as_str).collect();
    match words[..] {
        ["serve"] => {
            // The kernel lets go when it is asked to; what was being written then is of no use to it.
            if let Err(error) = plug()?.wait() {
                println!("server: {error}");
            }
        }
        ["check", file, count] => {
            let table = millimetres();
            println!("{}", proof::take(Path::new(file), count.parse()?, |frame| shown(frame, &table))?);
        }
        ["gspca", node, count] => gspca(Path::new(node), count.parse()?)?,
        ["first"] => println!("{}", proof::first_frame(&mut Wire::new()?)?),
        ["cycles", count] => println!("{}", proof::cycles(&mut Wire::new()?, count.parse()?)?),
        _ => return Err("serve | check FILE COUNT | gspca NODE COUNT | first | cycles COUNT".into()),
    }
    Ok(())
}

fn plug() -> io::Result<Plugged> {
    vhci::plug(Arc::new(Mutex::new(SimulatedCamera::new(Pattern::default()))))
}

struct Wire {
    bus: LibusbBus,
    mm_from_raw: Vec<u16>,
}

impl Wire {
    fn new() -> Outcome<Self> {
        Ok(Self { bus: LibusbBus::new()?, mm_from_raw: millimetres() })
    }
}

impl Bench for Wire {
    fn plug(&mut self) -> io::Result<Plugged> {
        plug()
    }

    /// The device's node appears a moment after the device.
    fn is_there(&self) -> bool {
        let listed = self.bus.list().unwrap_or_default();
        listed.iter().any(|info| info.product == 0x02ae && self.bus.open(info).is_ok())
    }

    fn is_gone(&self) -> bool {
        self.bus.list().is_ok_and(|listed| listed.iter().all(|info| info.product != 0x02ae))
    }

    fn open(&mut self) -> Result<Box<dyn Source>, String> {
        let limit = Duration::from_secs(20);
        let settings = Settings { frame_limit: limit, command_limit: limit, ..Settings::default() };
        Ok(Box::new(Kinect1::open(&self.bus, None, settings).map_err(|error| error.to_string())?))
    }

    fn shown(&mut self, frame: &Frame) -> Shown {
        shown(frame, &self.mm_from_raw)
    }
}

/// A frame beside what the model sent at its time: no two of its frames are alike.
fn shown(frame: &Frame, mm_from_raw: &[u16]) -> Shown {
    // The model's number of a frame, by its time: 30 a second.
    let number = (frame.device_time_ns as f64 * 30e-9).round() as u64;
    if let Some(depth) = &frame.depth {
        let sent = Pattern::default().depth(number);
        let sent: Vec<u16> = sent.iter().map(|raw| mm_from_raw[usize::from(*raw)]).collect();
        same("depth", &depth.values, &sent)?;
    }
    let filter = |i: usize| [[1, 0], [2, 1]][i / 640 % 2][i % 2];
    match &frame.color {
        None => {}
        Some(ColorImage::Rgb(image)) => {
            let seen: Vec<u8> = image.pixels.iter().enumerate().map(|(i, p)| p[filter(i)]).collect();
            same("colour", &seen, &Pattern::default().bayer(number))?;
        }
        Some(_) => return Err("colour has no pixels".into()),
    }
    Ok(Some(number))
}

/// Millimetres of every raw value by the model's optics: z = 10·r·e / (e − m).
fn millimetres() -> Vec<u16> {
    let mm = |raw: u16| {
        let m = (f64::from(raw) / 4.0 - 200.375) * f64::from(0.1042_f32);
        (10.0 * 120.0 * 7.5 / (7.5 - m)).round() as u16
    };
    (0..2048).map(|raw| if raw == 2047 { 0 } else { mm(raw) }).collect()
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
        let buffer = opened.next_buffer(Duration::from_mins(1))?;
        // The first pictures after the start may be of a frame that was under way.
        let found = (next..next + 300).find(|k| Pattern::default().bayer(*k) == buffer.bytes);
        torn += u64::from(found.is_none());
        next = found.map_or(next, |k| k + 1);
    }
    println!("{} of {count} pictures {format} {}x{} identical", count - torn, layout.width, layout.height);
    if torn <= 1 { Ok(()) } else { Err(format!("{torn} pictures are not what the model sent").into()) }
}
