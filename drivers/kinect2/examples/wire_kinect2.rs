//! The wire tier's two ends for the Kinect v2 (see `tests/wire/`); within the virtual machine where not said otherwise.
//!
//! `wire_kinect2 write FILE` (before the boot): what the model is to send, and what must arrive, which an emulated
//! processor would compute for minutes;
//! `wire_kinect2 serve FILE`: plugs the model into the kernel's virtual host controller, on a USB 3 port, and serves it
//! until killed;
//! `wire_kinect2 check FILE TAKE COUNT` (anywhere): compares the first COUNT frames of a take with what must arrive;
//! `wire_kinect2 first FILE`: milliseconds from opening to the first frame;
//! `wire_kinect2 cycles FILE COUNT`: unplugs and replugs the model, each time with frames read through libusb.
#![allow(clippy::print_stdout)]

use std::{
    error::Error,
    fs, io,
    path::Path,
    sync::{Arc, Mutex},
    time::Duration,
};

use toile_capture::{ColorImage, Frame, Source};
use toile_driver_kinect2::{Calibration, DecodeSettings, Decoder, Kinect2, Registration, Settings, color};
use toile_driver_simulated::{
    kinect2::{Content, Optics, Pattern, SimulatedCamera},
    proof::{self, Bench, Shown, same},
    vhci::{self, Plugged},
};
use toile_driver_transport::{Bus, libusb::LibusbBus};

/// The model's product id.
const PRODUCT: u16 = 0x02c4;

type Outcome<T> = Result<T, Box<dyn Error>>;

fn main() -> Outcome<()> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = words.iter().map(String::as_str).collect();
    match words[..] {
        ["write", file] => write(Path::new(file))?,
        ["serve", file] => {
            // The kernel lets go when it is asked to; what was being written then is of no use to it.
            if let Err(error) = Images::read(file)?.plug()?.wait() {
                println!("server: {error}");
            }
        }
        ["check", file, take, count] => {
            let images = Images::read(file)?;
            println!("{}", proof::take(Path::new(take), count.parse()?, |frame| images.shown(frame))?);
        }
        ["first", file] => println!("{}", proof::first_frame(&mut Wire::new(file)?)?),
        ["cycles", file, count] => println!("{}", proof::cycles(&mut Wire::new(file)?, count.parse()?)?),
        _ => return Err("write FILE | serve FILE | check FILE TAKE COUNT | first FILE | cycles FILE COUNT".into()),
    }
    Ok(())
}

/// Each frame as the model sends it and as it must arrive: depth packet, JPEG, millimetres, registered colours. Of the
/// pattern's, which come again and again.
#[derive(Clone)]
struct Images(Vec<[Arc<Vec<u8>>; 4]>);

/// Each part of the file stands behind its length.
fn write(file: &Path) -> Outcome<()> {
    let mut pattern = Pattern::default();
    let [depth, color, p0] = pattern.optics().answers();
    let calibration = Calibration::parse(&depth, &color, &p0)?;
    let mut decoder = Decoder::new(&calibration, DecodeSettings::default());
    let registration = Registration::new(&calibration);
    let mut bytes = Vec::new();
    for frame in 0..Pattern::FRAMES {
        let (packet, jpeg) = (pattern.depth(frame), pattern.jpeg(frame));
        let depth_mm = decoder.decode(&packet)?.depth_mm;
        let colors = registration.register(&depth_mm, &color::decode(&jpeg)?);
        let mm: Vec<u8> = depth_mm.iter().flat_map(|mm| ((mm + 0.5) as u16).to_le_bytes()).collect();
        for part in [&packet[..], &jpeg[..], &mm[..], colors.pixels.as_flattened()] {
            bytes.extend(u32::try_from(part.len())?.to_le_bytes());
            bytes.extend(part);
        }
    }
    Ok(fs::write(file, bytes)?)
}

impl Images {
    fn read(file: &str) -> Outcome<Self> {
        let bytes = fs::read(file)?;
        let (mut rest, mut parts) = (&bytes[..], Vec::new());
        while let Some((length, after)) = rest.split_first_chunk() {
            let cut = after.split_at_checked(u32::from_le_bytes(*length) as usize);
            let (part, after) = cut.ok_or("the file of images is cut short")?;
            parts.push(Arc::new(part.to_vec()));
            rest = after;
        }
        let frames: Vec<[_; 4]> = parts.as_chunks().0.to_vec();
        if frames.len() as u64 != Pattern::FRAMES {
            return Err("the file of images is of another version: write it again".into());
        }
        Ok(Self(frames))
    }

    fn frame(&self, number: u64) -> &[Arc<Vec<u8>>; 4] {
        &self.0[(number % Pattern::FRAMES) as usize]
    }

    fn plug(&self) -> io::Result<Plugged> {
        vhci::plug(Arc::new(Mutex::new(SimulatedCamera::new(self.clone()))))
    }

    /// A frame beside what must arrive at its time.
    fn shown(&self, frame: &Frame) -> Shown {
        // The model's number of a frame, by its time: 30 a second.
        let number = (frame.device_time_ns as f64 * 30e-9).round() as u64;
        let [_, _, mm, colors] = self.frame(number);
        let sent: Vec<u16> = mm.as_chunks().0.iter().map(|b| u16::from_le_bytes(*b)).collect();
        // Colour that came alone cannot be registered by this depth.
        let Some(depth) = &frame.depth else { return Ok(None) };
        same("depth", &depth.values, &sent)?;
        match &frame.color {
            None => {}
            Some(ColorImage::Rgb(image)) => same("colour", image.pixels.as_flattened(), colors)?,
            Some(_) => return Err("colour has no pixels".into()),
        }
        Ok(Some(number))
    }
}

impl Content for Images {
    fn depth(&mut self, frame: u64) -> Arc<Vec<u8>> {
        self.frame(frame)[0].clone()
    }

    fn jpeg(&mut self, frame: u64) -> Arc<Vec<u8>> {
        self.frame(frame)[1].clone()
    }

    fn optics(&self) -> Optics {
        Optics::default()
    }
}

struct Wire {
    bus: LibusbBus,
    images: Images,
}

impl Wire {
    fn new(file: &str) -> Outcome<Self> {
        Ok(Self { bus: LibusbBus::new()?, images: Images::read(file)? })
    }
}

impl Bench for Wire {
    fn plug(&mut self) -> io::Result<Plugged> {
        self.images.plug()
    }

    /// The device's node appears a moment after the device.
    fn is_there(&self) -> bool {
        let listed = self.bus.list().unwrap_or_default();
        listed.iter().any(|info| info.product == PRODUCT && self.bus.open(info).is_ok())
    }

    fn is_gone(&self) -> bool {
        self.bus.list().is_ok_and(|listed| listed.iter().all(|info| info.product != PRODUCT))
    }

    fn open(&mut self) -> Result<Box<dyn Source>, String> {
        let limit = Duration::from_secs(20);
        let settings = Settings { frame_limit: limit, command_limit: limit, ready_limit: limit, ..Settings::default() };
        Ok(Box::new(Kinect2::open(&self.bus, None, settings).map_err(|error| error.to_string())?))
    }

    fn shown(&mut self, frame: &Frame) -> Shown {
        self.images.shown(frame)
    }
}
