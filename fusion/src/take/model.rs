//! The model that frames are tracked against and fused into.

use toile_geometry::Rigid;

use crate::{
    FusionError,
    field::{Touched, Tsdf, integrate},
    frame::{CutDepth, DepthView, depth_noise, is_measured, window_for},
    settings::FusionSettings,
    timings::Stopwatch,
};

/// The band is at least this many standard deviations of the noise wide to either side.
pub(crate) const NOISE_BAND: f64 = 4.5;
/// And at most this many times as wide as set.
const WIDEST_BAND: f64 = 3.0;
/// Averaging window of normals before the noise is known, pixels.
const FIRST_WINDOW: usize = 2;

/// The distance field, and how it suits the sensor's noise.
pub(crate) struct Model {
    voxel_size: f64,
    truncation: f64,
    pub field: Tsdf,
    /// Standard deviation of the depth noise, metres.
    pub noise: f64,
    /// Least half width of the band, metres; `None`: as the noise asks for.
    band: Option<f64>,
    /// Half width of the averaging of normals, pixels.
    pub window: usize,
    /// Sums over all integrations.
    pub touched: Touched,
}

impl Model {
    pub(crate) fn new(settings: &FusionSettings) -> Self {
        Self {
            voxel_size: settings.voxel_size,
            truncation: settings.truncation,
            field: Tsdf::new(settings.voxel_size, settings.truncation, false),
            noise: 0.0,
            band: None,
            window: FIRST_WINDOW,
            touched: Touched::default(),
        }
    }

    /// Takes the depth noise from the first frame: noisy depth needs wider normals and a wider band.
    pub(crate) fn adapt(&mut self, first: &CutDepth) {
        let depth = first.meters();
        self.noise = depth_noise(&first.camera, &depth).unwrap_or(0.0);
        let (sum, count) =
            depth.iter().filter(|d| is_measured(**d)).fold((0.0, 0), |(s, n), d| (s + f64::from(*d), n + 1));
        self.window = window_for(&first.camera, self.noise, sum / f64::from(count.max(1)));
        self.field = self.empty_field(false);
    }

    /// Sets how wide the band must be, whatever single frames' noise asks for, metres; it is not less than as set.
    pub(crate) fn set_band(&mut self, least: f64) {
        self.band = Some(least);
    }

    /// A field without anything in it.
    pub(crate) fn empty_field(&self, with_color: bool) -> Tsdf {
        let least = self.band.unwrap_or(NOISE_BAND * self.noise);
        let truncation = self.truncation.max(least).min(WIDEST_BAND * self.truncation);
        Tsdf::new(self.voxel_size, truncation, with_color)
    }

    /// Fuses a view.
    ///
    /// # Errors
    /// [`FusionError::TooLarge`] where the field outgrows its index.
    pub(crate) fn integrate(
        &mut self,
        view: &DepthView,
        model_from_camera: &Rigid,
        clock: &mut Stopwatch,
    ) -> Result<(), FusionError> {
        let touched = clock.time("integrate", || integrate(&mut self.field, view, model_from_camera))?;
        self.touched = self.touched.plus(touched);
        Ok(())
    }
}
