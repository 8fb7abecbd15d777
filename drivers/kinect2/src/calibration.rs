//! The camera's own numbers: who it is, its lenses, and the tables P0.

use toile_geometry::camera::PinholeCamera;

use crate::{
    Kinect2Error,
    size::{COLUMNS, ROWS},
};

/// Pixels of depth.
const PIXELS: usize = COLUMNS * ROWS;
/// Smallest number of bytes of the answers (libfreenect2 `protocol/response.h`: `P0TablesResponse`, `DepthCameraParamsResponse`,
/// `RgbCameraParamsResponse`).
pub const P0_BYTES: usize = P0_HEADER + 3 * (2 * PIXELS + 4);
/// See [`P0_BYTES`].
pub const DEPTH_BYTES: usize = 23 * 4;
/// See [`P0_BYTES`]. The numbers that are used come first.
pub const COLOR_BYTES: usize = 1 + 25 * 4 + (28 * 23 * 5) * 4;
/// Bytes before the tables; each table stands between two words of unknown meaning.
const P0_HEADER: usize = 32;

/// How colour sees what depth measures: numbers that the camera states, under libfreenect2's names
/// (`ColorCameraParams`).
#[derive(Debug, Clone, PartialEq)]
pub struct ColorMap {
    /// Focal length, pixels.
    pub focal: f64,
    /// Centre, column and row.
    pub center: [f64; 2],
    /// Distance at which the polynomials hold, millimetres.
    pub shift_d: f64,
    /// Distance between the cameras, millimetres.
    pub shift_m: f64,
    /// Polynomials of column and row: x³, y³, x²y, xy², x², y², xy, x, y, 1.
    pub polynomials: [[f64; 10]; 2],
}

/// The camera's statements about itself.
#[derive(Debug, Clone, PartialEq)]
pub struct Calibration {
    /// The depth camera, not mirrored, pixel centres at integers.
    pub depth: PinholeCamera,
    /// The colour camera's numbers, mirrored as they are stated.
    pub color: ColorMap,
    /// Delay of each pixel's electronics at 80, 16 and 120 MHz, row by row, mirrored as stated.
    pub p0: [Vec<u16>; 3],
}

impl Calibration {
    /// Reads the three answers.
    ///
    /// # Errors
    /// [`Kinect2Error::Calibration`] where they are too short or their numbers cannot be true.
    pub fn parse(depth: &[u8], color: &[u8], p0: &[u8]) -> Result<Self, Kinect2Error> {
        let calibration = Self { depth: depth_camera(depth)?, color: color_map(color)?, p0: p0_tables(p0)? };
        calibration.check()?;
        Ok(calibration)
    }

    /// Numbers far from those of every known Kinect v2 (depth: focal length 365 to 368 pixels, centre 250 to 262 and 200
    /// to 213, k1 about 0.09; colour: 1081.37, 52 mm apart) are nonsense of the firmware.
    fn check(&self) -> Result<(), Kinect2Error> {
        let (depth, color) = (&self.depth, &self.color);
        within("the depth camera's focal length", depth.fx, 250.0, 500.0)?;
        within("the depth camera's focal length", depth.fy, 250.0, 500.0)?;
        within("the depth camera's centre", depth.cx, 180.0, 332.0)?;
        within("the depth camera's centre", depth.cy, 140.0, 284.0)?;
        depth.distortion.iter().try_for_each(|k| within("the depth camera's distortion", *k, -0.6, 0.6))?;
        within("the colour camera's focal length", color.focal, 700.0, 1600.0)?;
        within("the colour camera's centre", color.center[0], 600.0, 1320.0)?;
        within("the colour camera's centre", color.center[1], 300.0, 780.0)?;
        within("the distance of the polynomials", color.shift_d, 100.0, 10_000.0)?;
        within("the distance of the cameras", color.shift_m, -200.0, 200.0)?;
        color.polynomials.iter().flatten().try_for_each(|p| within("a coefficient of registration", *p, -100.0, 100.0))
    }
}

fn within(what: &str, value: f64, min: f64, max: f64) -> Result<(), Kinect2Error> {
    // NaN is not within.
    if (min..=max).contains(&value) {
        return Ok(());
    }
    Err(Kinect2Error::Calibration(format!("{what} is {value}, which is not between {min} and {max}")))
}

/// Floats from `start` on.
fn floats<const N: usize>(bytes: &[u8], start: usize) -> Result<[f64; N], Kinect2Error> {
    let short = || Kinect2Error::Calibration(format!("an answer has only {} bytes", bytes.len()));
    let words = bytes.get(start..start + 4 * N).ok_or_else(short)?.as_chunks::<4>().0;
    Ok(std::array::from_fn(|i| f64::from(f32::from_le_bytes(words[i]))))
}

fn depth_camera(bytes: &[u8]) -> Result<PinholeCamera, Kinect2Error> {
    let [fx, fy, _, cx, cy, k1, k2, p1, p2, k3] = floats(bytes, 0)?;
    // Stated for a mirrored image with pixel centres at halves (libfreenect2 `IrCameraTables`): mirroring turns the second
    // tangential coefficient round.
    let (cx, cy) = (COLUMNS as f64 - cx - 0.5, cy - 0.5);
    let ideal = PinholeCamera::ideal(COLUMNS as u32, ROWS as u32, fx, fy, cx, cy);
    Ok(PinholeCamera { distortion: [k1, k2, p1, -p2, k3], ..ideal })
}

fn color_map(bytes: &[u8]) -> Result<ColorMap, Kinect2Error> {
    // One byte before them: the number of the table.
    let stated: [f64; 25] = floats(bytes, 1)?;
    let polynomial = |start: usize| std::array::from_fn(|i| stated[start + i]);
    Ok(ColorMap {
        focal: stated[0],
        center: [stated[1], stated[2]],
        shift_d: stated[3],
        shift_m: stated[4],
        polynomials: [polynomial(5), polynomial(15)],
    })
}

fn p0_tables(bytes: &[u8]) -> Result<[Vec<u16>; 3], Kinect2Error> {
    if bytes.len() < P0_BYTES {
        return Err(Kinect2Error::Calibration(format!(
            "its P0 tables have {} bytes instead of {P0_BYTES}",
            bytes.len()
        )));
    }
    let table = |k: usize| {
        let start = P0_HEADER + k * (2 * PIXELS + 4) + 2;
        let words = bytes[start..start + 2 * PIXELS].as_chunks::<2>().0;
        words.iter().map(|word| u16::from_le_bytes(*word)).collect()
    };
    Ok([table(0), table(1), table(2)])
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    pub(crate) fn answers() -> [Vec<u8>; 3] {
        let depth = [365.4_f32, 365.4, 0.0, 260.1, 205.3, 0.09, -0.27, 0.0, 0.01, 0.1];
        let mut color = vec![0.0_f32; 25];
        color[..5].copy_from_slice(&[1081.37, 959.5, 539.5, 863.0, 52.0]);
        color[12] = 0.64;
        let bytes = |floats: &[f32]| floats.iter().flat_map(|f| f.to_le_bytes()).collect::<Vec<u8>>();
        let mut depth = bytes(&depth);
        depth.resize(DEPTH_BYTES, 0);
        let mut color = [vec![1], bytes(&color)].concat();
        color.resize(COLOR_BYTES, 0);
        let mut p0 = vec![0; P0_BYTES];
        p0[34..38].copy_from_slice(&[0x9a, 0x2c, 1, 0]);
        [depth, color, p0]
    }

    #[test]
    fn numbers_are_where_they_are_stated() {
        let [depth, color, p0] = answers();
        let read = Calibration::parse(&depth, &color, &p0).unwrap();
        assert!((read.depth.cx - (511.5 - 260.1)).abs() < 1e-4 && (read.depth.cy - 204.8).abs() < 1e-4);
        assert!((read.depth.distortion[3] + 0.01).abs() < 1e-6);
        assert_eq!((read.color.shift_m, read.p0[0][0], read.p0[0][1]), (52.0, 0x2c9a, 1));
        assert!((read.color.polynomials[0][7] - 0.64).abs() < 1e-6);
    }

    #[test]
    fn nonsense_is_refused_by_name() {
        let [depth, color, p0] = answers();
        let ones = vec![0xff; P0_BYTES];
        let refused = |d: &[u8], c: &[u8], p: &[u8]| Calibration::parse(d, c, p).unwrap_err().to_string();
        assert!(refused(&ones, &color, &p0).contains("focal length is NaN"));
        assert!(refused(&depth, &ones, &p0).contains("colour camera"));
        assert!(refused(&depth[..30], &color, &p0).contains("30 bytes"));
        assert!(refused(&depth, &color[..99], &p0).contains("99 bytes"));
        assert!(refused(&depth, &color, &p0[..1000]).contains("P0 tables have 1000 bytes"));
    }

    proptest! {
        #[test]
        fn no_bytes_upset_it(depth in prop::collection::vec(any::<u8>(), 0..120), color in prop::collection::vec(any::<u8>(), 0..200)) {
            let _ = Calibration::parse(&depth, &color, &[]);
        }
    }
}
