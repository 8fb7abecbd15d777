//! Raw depth packets to depth and infrared, pure; one pass over the rows, fast enough for one core.
//!
//! A packet holds ten images of 11-bit measurements: three of each of three frequencies, and one that is not used. The way
//! of a row, a file each: [`lut`] (bits to measurements) → [`phasor`] (three measurements to a delay) → [`smooth`] (joint
//! bilateral filter) → [`unwrap`] (three delays to a distance) → depth along +Z → [`edges`] (edge filter). Rows wait for
//! their neighbours in rings of three, which stay in the cache.
//!
//! The sensor sees the world mirrored (libfreenect2 issue #172) with its second half upside down; what comes out is
//! neither. Each step is plain arithmetic over rows, compiled for the vector units of the machine at hand; no
//! multiplication is fused with an addition, so that the result is the same on every machine.

mod curves;
mod edges;
mod lut;
mod phasor;
mod smooth;
mod unwrap;

use crate::{
    Kinect2Error,
    calibration::Calibration,
    size::{COLUMNS, ROWS},
};
use edges::{DepthRow, edge_row};
use lut::{ROW_BYTES, unpack_row};
use phasor::{PhasorRow, phasor_row};
use smooth::smooth_row;
use unwrap::{Distances, unwrap_row};

/// Bytes of one of a packet's ten images.
pub const IMAGE_BYTES: usize = ROWS * ROW_BYTES;
/// Bytes of a packet.
pub const PACKET_BYTES: usize = 10 * IMAGE_BYTES;

/// One row of an image.
pub type Row<T> = [T; COLUMNS];

/// How much light each frequency's phasors stand for (libfreenect2 `ab_multiplier_per_frq`).
const GAIN: [f64; 3] = [1.322_581, 1.0, 1.612_903];
/// Radians of a unit of P0 (libfreenect2 `fillTrigTable`).
const P0_UNIT: f64 = -0.000_031 * std::f64::consts::PI;
/// Millimetres of the light's way, there and back, that ten thirds of 0.625 m are (libfreenect2 `unambigious_dist`).
const UNIT_MM: f64 = 6250.0 / 3.0;
/// Strength of the parallax between light and lens, millimetres (libfreenect2 `processPixelStage2`).
const PARALLAX: f64 = 90.0;
/// Infrared is given as this many times a third of the light (libfreenect2 `ab_output_multiplier`), and at most as this.
const INFRARED_GAIN: f32 = 16.0 / 3.0;
const MAX_INFRARED: f32 = 65_535.0;

/// The depth that is dropped.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DecodeSettings {
    /// Depth below this is dropped, metres. Default 0.5, as libfreenect2 and the vendor do.
    pub min_depth: f32,
    /// Depth above this is dropped, metres. Default 4.5.
    pub max_depth: f32,
    /// Mean over neighbours of like delay. Default true: half the noise.
    pub smooth: bool,
    /// Drop pixels between two surfaces. Default true.
    pub drop_edges: bool,
}

impl Default for DecodeSettings {
    fn default() -> Self {
        Self { min_depth: 0.5, max_depth: 4.5, smooth: true, drop_edges: true }
    }
}

/// The image of a packet, row by row, not mirrored.
#[derive(Debug, Clone, PartialEq)]
pub struct Decoded {
    /// Depth along +Z, millimetres; 0 where there is none.
    pub depth_mm: Vec<f32>,
    /// Light that came back, 0..65535.
    pub infrared: Vec<f32>,
}

/// Decodes packets of one camera.
pub struct Decoder {
    settings: DecodeSettings,
    tables: Box<Tables>,
    rings: Box<Rings>,
}

/// Tables that are computed once from the calibration.
struct Tables {
    lut: [i16; 2048],
    /// Cosine and sine of P0, times the frequency's gain.
    cos: [Vec<Row<f32>>; 3],
    sin: [Vec<Row<f32>>; 3],
    /// Millimetres along +Z of a unit of range.
    z: Vec<Row<f32>>,
    /// Parallax in units of range.
    parallax: Vec<Row<f32>>,
}

/// Rows that wait for their neighbours: row y at y mod 3.
#[derive(Default)]
struct Rings {
    phasors: [[PhasorRow; 3]; 3],
    depths: [DepthRow; 3],
}

impl Decoder {
    /// For a camera of this calibration.
    pub fn new(calibration: &Calibration, settings: DecodeSettings) -> Self {
        Self { settings, tables: Box::new(Tables::new(calibration)), rings: Box::default() }
    }

    /// Decodes a packet.
    ///
    /// # Errors
    /// [`Kinect2Error::Packet`] where it has another length than `PACKET_BYTES`.
    pub fn decode(&mut self, packet: &[u8]) -> Result<Decoded, Kinect2Error> {
        let (rows, rest) = packet.as_chunks::<ROW_BYTES>();
        if rows.len() != 10 * ROWS || !rest.is_empty() {
            return Err(Kinect2Error::Packet { bytes: packet.len(), expected: PACKET_BYTES });
        }
        let mut out = Decoded { depth_mm: vec![0.0; COLUMNS * ROWS], infrared: vec![0.0; COLUMNS * ROWS] };
        let Self { settings, tables, rings } = self;
        pulp::Arch::new().dispatch(Pass { rows, settings: *settings, tables, rings, out: &mut out });
        Ok(out)
    }
}

/// One pass over a packet, compiled for the vector units at hand.
struct Pass<'a> {
    rows: &'a [[u8; ROW_BYTES]],
    settings: DecodeSettings,
    tables: &'a Tables,
    rings: &'a mut Rings,
    out: &'a mut Decoded,
}

impl pulp::WithSimd for Pass<'_> {
    type Output = ();

    /// Row y is measured, row y − 1 filtered and unwrapped, row y − 2 freed of edges.
    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) {
        let Self { rows, settings, tables, rings, out } = self;
        let (depth_out, _) = out.depth_mm.as_chunks_mut::<COLUMNS>();
        let (infrared_out, _) = out.infrared.as_chunks_mut::<COLUMNS>();
        for y in 0..ROWS + 2 {
            if y < ROWS {
                measure(rows, y, tables, &mut rings.phasors[y % 3], &mut infrared_out[y]);
            }
            if (1..=ROWS).contains(&y) {
                distance(y - 1, settings, tables, rings);
            }
            if y >= 2 {
                finish(y - 2, settings, &rings.depths, &mut depth_out[y - 2]);
            }
        }
    }
}

/// Row of a packet's image that shows row `y`: the lower half stands upside down (libfreenect2
/// `src/opencl_depth_packet_processor.cl`, `processPixelStage1`).
fn packet_row(y: usize) -> usize {
    if y < ROWS / 2 { y } else { ROWS / 2 + ROWS - 1 - y }
}

#[inline(always)]
fn measure(rows: &[[u8; ROW_BYTES]], y: usize, tables: &Tables, out: &mut [PhasorRow; 3], infrared: &mut Row<f32>) {
    for (frequency, out) in out.iter_mut().enumerate() {
        let mut measured = [[0; COLUMNS]; 3];
        for (k, measured) in measured.iter_mut().enumerate() {
            unpack_row(&rows[(3 * frequency + k) * ROWS + packet_row(y)], &tables.lut, measured);
        }
        phasor_row(&measured, (&tables.cos[frequency][y], &tables.sin[frequency][y]), out, infrared);
    }
    infrared.iter_mut().for_each(|light| *light = (*light * INFRARED_GAIN).min(MAX_INFRARED));
}

#[inline(always)]
fn distance(y: usize, settings: DecodeSettings, tables: &Tables, rings: &mut Rings) {
    let (mut a, mut b, mut smooth) = ([[0.0; COLUMNS]; 3], [[0.0; COLUMNS]; 3], [true; COLUMNS]);
    let rows = |y: usize| &rings.phasors[y % 3];
    for f in 0..3 {
        // The first and the last row have no neighbours and stay as they are.
        if settings.smooth && (1..ROWS - 1).contains(&y) {
            let around = [&rows(y - 1)[f], &rows(y)[f], &rows(y + 1)[f]];
            smooth_row(around, &mut a[f], &mut b[f], &mut smooth);
        } else {
            (a[f], b[f]) = (rows(y)[f].a, rows(y)[f].b);
        }
    }
    let row = &mut rings.depths[y % 3];
    let mut range = [0.0; COLUMNS];
    unwrap_row(&a, &b, &mut Distances { range: &mut range, light: &mut row.light });
    let (z, parallax) = (&tables.z[y], &tables.parallax[y]);
    for x in 0..COLUMNS {
        // With the light beside the lens the way is not twice the distance (libfreenect2 `processPixelStage2`).
        let depth = z[x] * range[x] * range[x] / (range[x] - parallax[x]);
        let depth = if range[x] > 0.0 && depth > 0.0 { depth } else { 0.0 };
        row.depth[x] = depth;
        row.smooth[x] = if smooth[x] { depth } else { 0.0 };
    }
}

#[inline(always)]
fn finish(y: usize, settings: DecodeSettings, rows: &[DepthRow; 3], out: &mut Row<f32>) {
    if settings.drop_edges && (1..ROWS - 1).contains(&y) {
        edge_row([&rows[(y + 2) % 3], &rows[y % 3], &rows[(y + 1) % 3]], out);
    } else {
        *out = rows[y % 3].smooth;
    }
    let (min, max) = (settings.min_depth * 1000.0, settings.max_depth * 1000.0);
    for depth in out.iter_mut() {
        *depth = if *depth >= min && *depth <= max { *depth } else { 0.0 };
    }
}

impl Tables {
    fn new(calibration: &Calibration) -> Self {
        // P0 is stated mirrored, as the sensor sees.
        let mirrored = |i: usize| i - i % COLUMNS + COLUMNS - 1 - i % COLUMNS;
        // P0 has fewer values than the image has pixels.
        let turns: Vec<(f64, f64)> = (0..=u16::MAX).map(|p0| (P0_UNIT * f64::from(p0)).sin_cos()).collect();
        let turn = |f: usize, i: usize| turns[usize::from(calibration.p0[f][mirrored(i)])];
        let rays = calibration.depth.rays();
        let slope = |i: usize| rays[i].map(f64::from);
        let z = |i: usize| UNIT_MM / (1.0 + slope(i)[0].powi(2) + slope(i)[1].powi(2)).sqrt();
        Self {
            lut: lut::lut(),
            cos: std::array::from_fn(|f| table(|i| GAIN[f] * turn(f, i).1)),
            sin: std::array::from_fn(|f| table(|i| GAIN[f] * turn(f, i).0)),
            z: table(z),
            parallax: table(|i| -slope(i)[0] * z(i) * PARALLAX / (2.0 * UNIT_MM).powi(2)),
        }
    }
}

/// A table of every pixel.
fn table(value: impl Fn(usize) -> f64) -> Vec<Row<f32>> {
    (0..ROWS).map(|y| std::array::from_fn(|x| value(y * COLUMNS + x) as f32)).collect()
}
