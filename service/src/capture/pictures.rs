//! Live pictures: the newest frame as JPEG with its guidance, and the surface that grows, for everybody who looks.

use std::{
    sync::{
        Arc, Mutex, PoisonError,
        atomic::{AtomicBool, AtomicUsize, Ordering},
    },
    thread::{self, JoinHandle},
    time::{Duration, Instant},
};

use serde_json::json;
use toile_capture::{ColorImage, RgbImage};
use toile_live::{DepthColors, Surface, Surfaces, TurnSeen, Watch};
use tokio::sync::broadcast;

use super::camera::{Newest, Shared};
use crate::pictures::jpeg;

/// Between two pictures: twenty a second.
const EVERY: Duration = Duration::from_millis(50);
/// The same where nobody looks: guidance goes on.
const UNSEEN_EVERY: Duration = Duration::from_millis(200);
/// How long a frame is waited for before the camera's silence is told.
const PATIENCE: Duration = Duration::from_millis(500);
/// Messages that a viewer may be behind before it misses some.
const ROOM: usize = 8;
/// Quality of live pictures.
const QUALITY: u8 = 70;
/// Wider colour pictures are sent at half their size.
const WIDEST: u32 = 1024;

/// What a viewer can ask for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// The camera's colour.
    Colour,
    /// Depth as colours.
    Depth,
    /// Colour with everything but the subject dimmed.
    Cutout,
    /// The surface so far.
    Surface,
}

impl Kind {
    /// All kinds.
    pub const ALL: [Self; 4] = [Self::Colour, Self::Depth, Self::Cutout, Self::Surface];

    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Colour => "colour",
            Self::Depth => "depth",
            Self::Cutout => "cutout",
            Self::Surface => "surface",
        }
    }
}

/// A message to viewers.
pub struct Packet {
    /// What it shows.
    pub kind: Kind,
    /// The message.
    pub bytes: Vec<u8>,
}

/// Where messages to viewers go, and how many viewers want each kind.
pub struct Audience {
    packets: broadcast::Sender<Arc<Packet>>,
    wanted: [AtomicUsize; 4],
}

impl Default for Audience {
    fn default() -> Self {
        Self { packets: broadcast::channel(ROOM).0, wanted: Default::default() }
    }
}

impl Audience {
    /// Messages from now on.
    pub fn look(&self) -> broadcast::Receiver<Arc<Packet>> {
        self.packets.subscribe()
    }

    /// A viewer wants `kind` from now on, or no more.
    pub fn want(&self, kind: Kind, is_wanted: bool) {
        let count = &self.wanted[kind as usize];
        if is_wanted {
            count.fetch_add(1, Ordering::Relaxed);
        } else {
            count.fetch_sub(1, Ordering::Relaxed);
        }
    }

    fn wants(&self, kind: Kind) -> bool {
        self.wanted[kind as usize].load(Ordering::Relaxed) > 0
    }

    fn send(&self, kind: Kind, bytes: Vec<u8>) {
        // That nobody looks is no error.
        drop(self.packets.send(Arc::new(Packet { kind, bytes })));
    }
}

/// How the recording stands, for the guidance.
#[derive(Debug, Default)]
pub struct Take {
    /// Since it began; `None` where nothing is recorded.
    pub began: Option<Instant>,
    /// Counts takes, so that a new one is noticed.
    pub number: u64,
    /// The findings of the preview.
    pub seen: TurnSeen,
}

/// The thread that makes pictures of one camera's frames.
pub struct Pictures {
    ends: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Pictures {
    /// Begins to make pictures.
    ///
    /// # Errors
    /// The system's error where no thread can be had.
    pub fn start(
        camera: Arc<Shared>,
        audience: Arc<Audience>,
        take: Arc<Mutex<Take>>,
        surfaces: Surfaces,
    ) -> std::io::Result<Self> {
        let ends = Arc::new(AtomicBool::new(false));
        let watch = Watch::new(camera.rig.clone());
        let scale = camera.rig.sensors.first().map_or(1e-3, |sensor| sensor.depth_scale);
        let colors = DepthColors::new(scale);
        let mut making =
            Making { camera, audience, take, surfaces, watch, colors, shown: 0, surface: None, take_number: 0 };
        let over = ends.clone();
        let thread = thread::Builder::new().name("pictures".into()).spawn(move || {
            let mut last = 0;
            while !over.load(Ordering::Acquire) {
                last = making.next(last);
            }
        })?;
        Ok(Self { ends, thread: Some(thread) })
    }
}

impl Drop for Pictures {
    fn drop(&mut self) {
        self.ends.store(true, Ordering::Release);
        if let Some(thread) = self.thread.take() {
            drop(thread.join());
        }
    }
}

struct Making {
    camera: Arc<Shared>,
    audience: Arc<Audience>,
    take: Arc<Mutex<Take>>,
    surfaces: Surfaces,
    watch: Watch,
    colors: DepthColors,
    shown: u64,
    surface: Option<Arc<Surface>>,
    take_number: u64,
}

impl Making {
    /// Waits for a frame after number `last` and shows it; gives the number of the one that was shown.
    fn next(&mut self, last: u64) -> u64 {
        let begun = Instant::now();
        let newest = self.camera.newer(last, PATIENCE);
        self.hear_of_take();
        let Some(newest) = newest else {
            self.show_silence();
            // Where the camera has ended nothing waits.
            thread::sleep(EVERY);
            return last;
        };
        self.watch.push(&newest.frame, newest.dropped);
        self.show(&newest);
        self.show_surface();
        let is_looked_at = Kind::ALL.into_iter().any(|kind| self.audience.wants(kind));
        let pause = if is_looked_at { EVERY } else { UNSEEN_EVERY };
        thread::sleep(pause.saturating_sub(begun.elapsed()));
        newest.number
    }

    fn hear_of_take(&mut self) {
        let take = self.take.lock().unwrap_or_else(PoisonError::into_inner);
        if take.number != self.take_number {
            self.take_number = take.number;
            self.watch.begin_take();
        }
        if let Some(began) = take.began {
            self.watch.turned(began.elapsed().as_secs_f64(), &take.seen);
        }
    }

    fn show(&mut self, newest: &Newest) {
        self.shown += 1;
        let frame = &newest.frame;
        if frame.sensor != 0 {
            return;
        }
        if let (Some(depth), true) = (&frame.depth, self.audience.wants(Kind::Depth)) {
            let pixels = self.colors.of(depth, self.watch.is_subject());
            self.send(
                Kind::Depth,
                newest,
                [depth.width, depth.height],
                jpeg(&pixels, [depth.width, depth.height], QUALITY),
            );
        }
        let Some(color) = &frame.color else { return };
        let (wants_colour, wants_cutout) = (self.audience.wants(Kind::Colour), self.audience.wants(Kind::Cutout));
        let size = self.camera.rig.sensors.first().and_then(|s| s.color).map_or([0; 2], |c| [c.width, c.height]);
        if let (ColorImage::Jpeg(bytes), true, true) = (color, wants_colour, size[0] <= WIDEST) {
            self.send(Kind::Colour, newest, size, Ok(bytes.to_vec()));
            if !wants_cutout {
                return;
            }
        }
        if !(wants_colour || wants_cutout) {
            return;
        }
        let Ok(picture) = color.decode(frame.index) else { return };
        let is_sent = matches!(color, ColorImage::Jpeg(_)) && size[0] <= WIDEST;
        if wants_colour && !is_sent {
            let small = halved(&picture);
            self.send(
                Kind::Colour,
                newest,
                [small.width, small.height],
                jpeg(&small.pixels, [small.width, small.height], QUALITY),
            );
        }
        if wants_cutout {
            let cut = dimmed(&picture, self.watch.is_subject());
            self.send(
                Kind::Cutout,
                newest,
                [cut.width, cut.height],
                jpeg(&cut.pixels, [cut.width, cut.height], QUALITY),
            );
        }
    }

    fn send(&self, kind: Kind, newest: &Newest, [width, height]: [u32; 2], picture: Result<Vec<u8>, String>) {
        let Ok(picture) = picture else { return };
        let header = json!({
            "what": kind.name(), "width": width, "height": height, "seq": newest.number,
            "age_ms": (1e4 * newest.at.elapsed().as_secs_f64()).round() / 10.0,
            "fps": (10.0 * self.camera.fps()).round() / 10.0,
            "guidance": self.watch.guidance(newest.at.elapsed().as_secs_f64()),
        });
        self.audience.send(kind, message(1, &header, &[&picture]));
    }

    /// Guidance without a picture: the camera is silent.
    fn show_silence(&self) {
        let silent = self.camera.newer(0, Duration::ZERO).map_or(0.0, |newest| newest.at.elapsed().as_secs_f64());
        let header = json!({
            "what": "depth", "width": 0, "height": 0, "seq": 0, "age_ms": 1e3 * silent, "fps": 0.0,
            "guidance": self.watch.guidance(silent),
        });
        self.audience.send(Kind::Depth, message(1, &header, &[]));
    }

    fn show_surface(&mut self) {
        let Some(surface) = self.surfaces.last().filter(|_| self.audience.wants(Kind::Surface)) else { return };
        if self.surface.as_ref().is_some_and(|shown| Arc::ptr_eq(shown, &surface)) {
            return;
        }
        let header =
            json!({ "vertices": surface.positions.len(), "triangles": surface.triangles.len(), "seq": surface.number });
        let positions: Vec<u8> = surface.positions.as_flattened().iter().flat_map(|c| c.to_le_bytes()).collect();
        let mut colors = surface.colors.as_flattened().to_vec();
        colors.resize(colors.len().next_multiple_of(4), 0);
        let triangles: Vec<u8> = surface.triangles.as_flattened().iter().flat_map(|c| c.to_le_bytes()).collect();
        self.audience.send(Kind::Surface, message(2, &header, &[&positions, &colors, &triangles]));
        self.surface = Some(surface);
    }
}

/// One byte for the kind, the length of the header, the header, the parts.
fn message(kind: u8, header: &serde_json::Value, parts: &[&[u8]]) -> Vec<u8> {
    let header = header.to_string();
    let mut bytes = Vec::with_capacity(5 + header.len() + parts.iter().map(|part| part.len()).sum::<usize>());
    bytes.push(kind);
    bytes.extend((header.len() as u32).to_le_bytes());
    bytes.extend(header.as_bytes());
    parts.iter().for_each(|part| bytes.extend(*part));
    bytes
}

/// Every other pixel of every other row.
fn halved(picture: &RgbImage) -> RgbImage {
    let (width, height) = (picture.width / 2, picture.height / 2);
    let at = |k: u32| (2 * (k / width.max(1)) * picture.width + 2 * (k % width.max(1))) as usize;
    RgbImage { width, height, pixels: (0..width * height).map(|k| picture.pixels[at(k)]).collect() }
}

/// The picture with everything but the subject darker; as it is where the two are not of one size.
fn dimmed(picture: &RgbImage, is_subject: &[bool]) -> RgbImage {
    let mut cut = picture.clone();
    if is_subject.len() == cut.pixels.len() {
        let around = cut.pixels.iter_mut().zip(is_subject).filter(|(_, is_subject)| !**is_subject);
        around.for_each(|(pixel, _)| *pixel = pixel.map(|c| c / 4));
    }
    cut
}
