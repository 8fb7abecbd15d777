//! The camera's own numbers, and raw depth to millimetres.

use crate::{Kinect1Error, decode::NO_DEPTH};

/// Bytes of the answers, with two bytes of status before the numbers (libfreenect `src/cameras.c`,
/// `freenect_fetch_reg_info`, `freenect_fetch_reg_pad_info`, `freenect_fetch_reg_const_shift`).
pub const REGISTRATION_BYTES: usize = 118;
/// See [`REGISTRATION_BYTES`].
pub const PADDING_BYTES: usize = 8;
/// See [`REGISTRATION_BYTES`].
pub const SHIFT_BYTES: usize = 4;
/// Where the zero plane stands in the fixed parameters, which are 322 bytes of model 1414 and 334 of later ones
/// (libfreenect `freenect_fetch_zero_plane_info`, `fnusb_open_subdevices`).
const ZERO_PLANE: usize = 94;

/// A pixel is shifted by this many columns without a cause in the scene, and raw values are quarters of a pixel
/// (libfreenect `src/registration.c`, `S2D_CONST_OFFSET` and `parameter_coefficient`).
pub(crate) const OFFSET: f64 = 0.375;
const RAW_PER_PIXEL: f64 = 4.0;
/// Distances are stated in hundredths of metres (libfreenect `shift_scale`).
const MM_PER_CM: f64 = 10.0;
/// Beyond this the sensor's steps are longer than half a metre (libfreenect `FREENECT_DEPTH_MM_MAX_VALUE`).
pub const MAX_MM: u16 = 10_000;
/// The colour camera is this far from the depth camera, centimetres. The device states 2.3; libfreenect (after OpenNI)
/// uses 2.4 whatever it states.
const COLOR_CM: f64 = 2.4;

/// The camera's statements about itself.
#[derive(Debug, Clone, PartialEq)]
pub struct Calibration {
    /// Emitter to depth camera, centimetres.
    pub emitter_cm: f64,
    /// Depth to colour camera, centimetres.
    pub color_cm: f64,
    /// Distance of the zero plane, centimetres; its ratio to twice the pixel size is the focal length in pixels.
    pub reference: f64,
    /// Size of a pixel (of 1280 columns) on the zero plane.
    pub pixel: f64,
    /// Constant shift, pixels.
    pub const_shift: f64,
    /// Registration polynomials, in the order of libfreenect's `freenect_reg_info`.
    pub registration: [i32; 29],
    /// Lines that registered images begin further down.
    pub start_lines: u16,
}

impl Calibration {
    /// Reads the four answers.
    ///
    /// # Errors
    /// [`Kinect1Error::Calibration`] where they are too short or their numbers cannot be true.
    pub fn parse(fixed: &[u8], registration: &[u8], padding: &[u8], shift: &[u8]) -> Result<Self, Kinect1Error> {
        let short = || Kinect1Error::Calibration("an answer is too short".into());
        let float = |i: usize| {
            let bytes = fixed.get(ZERO_PLANE + 4 * i..)?.first_chunk::<4>()?;
            Some(f64::from(f32::from_le_bytes(*bytes)))
        };
        let plane: Vec<f64> = (0..4).map_while(float).collect();
        let [emitter_cm, _, reference, pixel] = plane[..] else { return Err(short()) };
        let words = registration.get(2..).ok_or_else(short)?.as_chunks::<4>().0;
        let mut polynomials = [0; 29];
        if words.len() < polynomials.len() {
            return Err(short());
        }
        polynomials.iter_mut().zip(words).for_each(|(number, bytes)| *number = i32::from_le_bytes(*bytes));
        let word = |bytes: &[u8]| bytes.get(2..4).map(|b| u16::from_le_bytes([b[0], b[1]])).ok_or_else(short);
        let calibration = Self {
            emitter_cm,
            color_cm: COLOR_CM,
            reference,
            pixel,
            const_shift: f64::from(word(shift)?),
            registration: polynomials,
            start_lines: word(padding)?,
        };
        calibration.check()?;
        Ok(calibration)
    }

    /// Focal length of the depth camera, pixels (libfreenect `freenect_camera_to_world`).
    pub fn focal_length(&self) -> f64 {
        self.reference / (2.0 * self.pixel)
    }

    /// Millimetres along +Z of every raw value; 0 where there is no depth or it is beyond `MAX_MM`.
    pub fn mm_from_raw(&self) -> Vec<u16> {
        (0..=NO_DEPTH).map(|raw| if raw == NO_DEPTH { 0 } else { self.mm(raw) }).collect()
    }

    /// By similar triangles over the zero plane (libfreenect `freenect_raw_to_mm`), rounded to the nearest.
    fn mm(&self, raw: u16) -> u16 {
        let pixels = f64::from(raw) / RAW_PER_PIXEL - self.const_shift - OFFSET;
        let on_plane = pixels * self.pixel;
        let mm = MM_PER_CM * (on_plane * self.reference / (self.emitter_cm - on_plane) + self.reference);
        if on_plane < self.emitter_cm && mm > 0.0 && mm < f64::from(MAX_MM) { mm.round() as u16 } else { 0 }
    }

    /// Numbers far from those of every known Kinect (focal length 575 to 595 pixels, emitter at 7.5 cm, constant shift
    /// 200) are nonsense of the firmware, not a calibration.
    fn check(&self) -> Result<(), Kinect1Error> {
        let within = |what: &str, value: f64, min: f64, max: f64| {
            // NaN is not within.
            if (min..=max).contains(&value) {
                return Ok(());
            }
            Err(Kinect1Error::Calibration(format!("{what} is {value}, which is not between {min} and {max}")))
        };
        within("the emitter's distance", self.emitter_cm, 3.0, 15.0)?;
        within("the zero plane's distance", self.reference, 40.0, 300.0)?;
        within("the pixel size", self.pixel, 0.03, 0.3)?;
        within("the focal length", self.focal_length(), 300.0, 1200.0)?;
        within("the constant shift", self.const_shift, 50.0, 800.0)?;
        within("the number of padded lines", f64::from(self.start_lines), 0.0, 479.0)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    pub(crate) fn sample() -> Calibration {
        Calibration {
            emitter_cm: 7.5,
            color_cm: 2.4,
            reference: 120.0,
            pixel: 0.1042,
            const_shift: 200.0,
            registration: [0; 29],
            start_lines: 0,
        }
    }

    #[test]
    fn the_zero_plane_is_at_its_distance_and_depth_grows_with_raw() {
        let table = sample().mm_from_raw();
        // (raw / 4 - 200) - 0.375 = 0 is between 801 and 802.
        assert!(table[801] < 1200 && table[802] >= 1200 && table[802] - table[801] < 5);
        let seen: Vec<u16> = table[300..1080].iter().copied().filter(|mm| *mm > 0).collect();
        assert!(seen.is_sorted() && seen.len() > 700);
        assert_eq!((table[2047], table[1200]), (0, 0));
        assert!((sample().focal_length() - 575.8).abs() < 0.1);
    }

    #[test]
    fn nonsense_is_refused_by_name() {
        let all_ones = vec![0xff; 334];
        let error = Calibration::parse(&all_ones, &all_ones, &all_ones, &all_ones).unwrap_err().to_string();
        assert!(error.contains("emitter"), "{error}");
        let zeros = vec![0; 334];
        assert!(Calibration::parse(&zeros, &zeros, &zeros, &zeros).is_err());
        assert!(Calibration::parse(&zeros[..100], &zeros, &zeros, &zeros).unwrap_err().to_string().contains("short"));
        assert!(Calibration::parse(&zeros, &zeros[..100], &zeros, &zeros).is_err());
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(40))]
        /// Numbers that are in range and polynomials that are anything: tables are made of them all the same.
        #[test]
        fn no_answers_upset_the_calibration_and_its_tables(
            mut fixed in prop::collection::vec(any::<u8>(), 0..340),
            registration in prop::collection::vec(any::<u8>(), 100..130),
            words in prop::collection::vec(any::<u8>(), 0..9),
            plane in prop::option::of((3.0..15.0f32, 40.0..300.0f32, 0.03..0.3f32)),
        ) {
            if let (Some((emitter, reference, pixel)), true) = (plane, fixed.len() >= ZERO_PLANE + 16) {
                let bytes = [emitter, 2.3, reference, pixel].map(f32::to_le_bytes);
                fixed[ZERO_PLANE..ZERO_PLANE + 16].copy_from_slice(bytes.as_flattened());
            }
            let shift = [0, 0, 200, 0];
            for padding in [&words[..], &[0; 4]] {
                if let Ok(calibration) = Calibration::parse(&fixed, &registration, padding, &shift) {
                    let depth = calibration.mm_from_raw();
                    prop_assert!(depth.len() == 2048 && depth.iter().all(|mm| *mm <= MAX_MM));
                    crate::registration::Registration::new(&calibration).register(&depth);
                }
            }
        }
    }
}
