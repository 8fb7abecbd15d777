//! What spoils the depth of a synthetic subject, as options.

use toile_synthetic::{GarmentKind, GarmentSettings, Nuisances, Pattern};

use crate::StudioError;

/// Black cloth.
const BLACK: Pattern = Pattern::Plain([10, 10, 11]);

/// One switch for each nuisance; without any, depth has the sensor's own noise alone.
#[derive(Debug, clap::Args)]
#[command(next_help_heading = "Nuisances")]
pub struct NuisanceOptions {
    /// Lens distortion, k1,k2,p1,p2,k3 (fewer: the rest is 0), told by the calibration; a Kinect v2's is about 0.09,-0.27,0,0,0.095
    #[arg(long, value_delimiter = ',', allow_negative_numbers = true, value_name = "COEFFICIENTS")]
    lens: Vec<f64>,
    /// The calibration does not tell of the lens
    #[arg(long, requires = "lens")]
    lens_untold: bool,
    /// Depth comes as this many times what it is
    #[arg(long, default_value_t = 1.0, value_name = "FACTOR")]
    depth_scale: f64,
    /// Noise in blotches of nine pixels: its standard deviation at 2 m, millimetres
    #[arg(long, default_value_t = 0.0, value_name = "MM")]
    blotches: f64,
    /// Makes this garment black: its depth is four times as noisy, and a seventh of it is missing
    #[arg(long, value_name = "KIND")]
    dark: Option<String>,
    /// Light by way of the floor makes the floor and feet this much too far, millimetres
    #[arg(long, default_value_t = 0.0, value_name = "MM")]
    multipath: f64,
    /// The disk turns by this much while a picture is exposed, degrees
    #[arg(long, default_value_t = 0.0, value_name = "DEGREES")]
    smear: f64,
    /// Hair has a brim of flying pixels as wide as this, pixels
    #[arg(long, default_value_t = 0, value_name = "PIXELS")]
    brim: usize,
    /// The disk seems to rise by this much at the rim of the feet, millimetres
    #[arg(long, default_value_t = 0.0, value_name = "MM")]
    plates: f64,
    /// Threads are seen across gaps between the legs of up to this width, pixels
    #[arg(long, default_value_t = 0, value_name = "PIXELS")]
    strings: usize,
}

impl NuisanceOptions {
    /// The settings; a dark garment becomes black.
    ///
    /// # Errors
    /// [`StudioError::Usage`] for too many coefficients, and for a dark garment that is not put on.
    pub fn resolve(&self, garments: &mut [GarmentSettings]) -> Result<Nuisances, StudioError> {
        let mut lens = [0.0; 5];
        if self.lens.len() > lens.len() {
            return Err(StudioError::Usage(format!("--lens: {} coefficients; at most five", self.lens.len())));
        }
        lens.iter_mut().zip(&self.lens).for_each(|(k, told)| *k = *told);
        if let Some(name) = &self.dark {
            let dark = garments.iter_mut().find(|g| Some(g.kind) == GarmentKind::from_name(name));
            let missing = || StudioError::Usage(format!("--dark: there is no `{name}` among --garments"));
            dark.ok_or_else(missing)?.pattern = BLACK;
        }
        Ok(Nuisances {
            lens,
            is_lens_untold: self.lens_untold,
            depth_scale: self.depth_scale,
            blotches_m: 1e-3 * self.blotches,
            has_dark_cloth: self.dark.is_some(),
            multipath_m: 1e-3 * self.multipath,
            smear_degrees: self.smear,
            brim_pixels: self.brim,
            plates_m: 1e-3 * self.plates,
            strings_pixels: self.strings,
        })
    }
}
