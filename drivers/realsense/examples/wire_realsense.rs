//! The wire tier's two ends for the RealSense D435 (see `tests/wire/`); within the virtual machine where not said
//! otherwise.
//!
//! `wire_realsense serve bulk|isochronous`: plugs the model into the kernel's virtual host controller and serves it
//! until killed;
//! `wire_realsense check FILE COUNT` (anywhere): compares the first COUNT frames of a take with what the model sent;
//! `wire_realsense first bulk|isochronous`: milliseconds from opening to the first frame;
//! `wire_realsense cycles COUNT`: unplugs and replugs the model, each time with frames read through the kernel.
#![allow(clippy::print_stdout)]

use std::{
    error::Error,
    io,
    path::Path,
    sync::{Arc, Mutex},
    time::Duration,
};

use toile_capture::{ColorImage, Frame, Source};
use toile_driver_realsense::{Realsense, Settings, list};
use toile_driver_simulated::{
    d435::{self, Content, Pattern},
    proof::{self, Bench, Shown, same},
    uvc::Wire,
    vhci::{self, Plugged},
};
use toile_driver_transport::video::kernel::KernelVideo;

const SIZE: (u16, u16) = (640, 480);

type Outcome<T> = Result<T, Box<dyn Error>>;

fn main() -> Outcome<()> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = words.iter().map(String::as_str).collect();
    match words[..] {
        ["serve", name] => {
            // The kernel lets go when it is asked to; what was being written then is of no use to it.
            if let Err(error) = plug(wire(name)?)?.wait() {
                println!("server: {error}");
            }
        }
        ["check", file, count] => println!("{}", proof::take(Path::new(file), count.parse()?, shown)?),
        ["first", name] => println!("{}", proof::first_frame(&mut Kernel::new(&[wire(name)?]))?),
        ["cycles", count] => {
            println!("{}", proof::cycles(&mut Kernel::new(&[Wire::Bulk, Wire::Isochronous]), count.parse()?)?);
        }
        _ => return Err("serve bulk|isochronous | check FILE COUNT | first bulk|isochronous | cycles COUNT".into()),
    }
    Ok(())
}

fn wire(name: &str) -> Outcome<Wire> {
    match name {
        "bulk" => Ok(Wire::Bulk),
        "isochronous" => Ok(Wire::Isochronous),
        other => Err(format!("{other} is neither bulk nor isochronous").into()),
    }
}

fn plug(wire: Wire) -> io::Result<Plugged> {
    vhci::plug(Arc::new(Mutex::new(d435::model(Pattern::default(), wire))))
}

/// The model behind `uvcvideo`, by each of its wires in turn.
struct Kernel {
    video: KernelVideo,
    wires: Vec<Wire>,
}

impl Kernel {
    fn new(wires: &[Wire]) -> Self {
        Self { video: KernelVideo::default(), wires: wires.into() }
    }
}

impl Bench for Kernel {
    fn plug(&mut self) -> io::Result<Plugged> {
        self.wires.rotate_left(1);
        plug(self.wires[self.wires.len() - 1])
    }

    fn is_there(&self) -> bool {
        let found = list(&self.video).unwrap_or_default();
        found.first().is_some_and(|c| c.depth.is_some() && c.color.is_some())
    }

    fn is_gone(&self) -> bool {
        list(&self.video).is_ok_and(|found| found.is_empty())
    }

    fn open(&mut self) -> Result<Box<dyn Source>, String> {
        let settings = Settings { frame_limit: Duration::from_secs(30), ..Settings::default() };
        Ok(Box::new(Realsense::open(&self.video, None, settings).map_err(|error| error.to_string())?))
    }

    fn shown(&mut self, frame: &Frame) -> Shown {
        shown(frame)
    }
}

/// A frame beside what the model sent at its time, no two of its frames being alike: colours by ITU-R BT.601, within one
/// step of rounding.
fn shown(frame: &Frame) -> Shown {
    let number = (frame.device_time_ns as f64 * 30e-9).round() as u64;
    if let Some(depth) = &frame.depth {
        same("depth", &depth.values, &Pattern::default().depth(number, SIZE))?;
    }
    match &frame.color {
        None => Ok(Some(number)),
        Some(ColorImage::Rgb(image)) if is_color(&image.pixels, &Pattern::default().yuyv(number, SIZE)) => {
            Ok(Some(number))
        }
        Some(_) => Err("colour is not what was sent".into()),
    }
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
