//! The settings of a virtual session.

use serde::{Deserialize, Serialize};

use crate::{
    SyntheticError,
    motion::Motion,
    nuisances::Nuisances,
    rig_settings::{MAX_SENSORS, RigSettings},
    sensor::SensorPreset,
};

/// Which half of the population a person is drawn from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Sex {
    /// Around the mean woman.
    #[default]
    Female,
    /// Around the mean man.
    Male,
}

/// The cut of a garment.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
#[allow(missing_docs)] // the names are the documentation
pub enum GarmentKind {
    Trousers,
    Shorts,
    Skirt,
    Tshirt,
    Blouse,
    Jumper,
    Jacket,
    Coat,
    Dress,
    Scarf,
    Hat,
}

impl GarmentKind {
    /// All kinds.
    pub const ALL: [Self; 11] = [
        Self::Trousers,
        Self::Shorts,
        Self::Skirt,
        Self::Tshirt,
        Self::Blouse,
        Self::Jumper,
        Self::Jacket,
        Self::Coat,
        Self::Dress,
        Self::Scarf,
        Self::Hat,
    ];

    /// The name in folders and files, such as `tshirt`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Trousers => "trousers",
            Self::Shorts => "shorts",
            Self::Skirt => "skirt",
            Self::Tshirt => "tshirt",
            Self::Blouse => "blouse",
            Self::Jumper => "jumper",
            Self::Jacket => "jacket",
            Self::Coat => "coat",
            Self::Dress => "dress",
            Self::Scarf => "scarf",
            Self::Hat => "hat",
        }
    }

    /// The kind of this name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|k| k.name() == name)
    }
}

/// Colours of a surface; lengths in metres.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Pattern {
    /// One colour.
    Plain([u8; 3]),
    /// Level stripes of two colours, each half a `period` high.
    Stripes([u8; 3], [u8; 3], f32),
    /// Crossing bands of two colours.
    Plaid([u8; 3], [u8; 3], f32),
    /// Worn twill: one colour with blotches and fine threads.
    Denim([u8; 3]),
}

/// A garment to put on.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct GarmentSettings {
    /// Its cut.
    pub kind: GarmentKind,
    /// Its colours.
    pub pattern: Pattern,
}

impl GarmentSettings {
    /// A garment in the colours that its kind has by default.
    pub fn of(kind: GarmentKind) -> Self {
        let pattern = match kind {
            GarmentKind::Trousers => Pattern::Denim([44, 62, 112]),
            GarmentKind::Shorts => Pattern::Plain([196, 178, 138]),
            GarmentKind::Skirt => Pattern::Plaid([46, 96, 70], [206, 160, 60], 0.09),
            GarmentKind::Tshirt => Pattern::Stripes([226, 222, 212], [196, 62, 52], 0.08),
            GarmentKind::Blouse => Pattern::Stripes([232, 236, 240], [84, 132, 196], 0.05),
            GarmentKind::Jumper => Pattern::Plain([150, 60, 84]),
            GarmentKind::Jacket => Pattern::Denim([64, 88, 46]),
            GarmentKind::Coat => Pattern::Plaid([88, 78, 70], [140, 122, 96], 0.14),
            GarmentKind::Dress => Pattern::Plaid([122, 34, 48], [196, 150, 140], 0.11),
            GarmentKind::Scarf => Pattern::Stripes([56, 104, 96], [214, 196, 150], 0.04),
            GarmentKind::Hat => Pattern::Plain([46, 52, 96]),
        };
        Self { kind, pattern }
    }
}

/// Settings of a virtual subject and the sessions made of it. Every default gives a usable recording.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct SyntheticSettings {
    /// Name of the subject.
    pub name: String,
    /// Everything random follows from it.
    pub seed: u64,
    /// Which mean the person is drawn around.
    pub sex: Sex,
    /// Standard deviation of the person's shape around that mean, in the body model's units; 0..2, default 0.6.
    pub variety: f64,
    /// Root mean square of smooth bumps on the skin that no body model knows, metres; 0..0.01, default 0.0012.
    pub detail_m: f64,
    /// The addition of take 1, 2, ...; at most five.
    pub garments: Vec<GarmentSettings>,
    /// Edge of the cells that cloth is made on, metres; 0.005..0.03, default 0.008.
    pub cell_m: f32,
    /// Frames of each take; 2 or more, default 100.
    pub frames: usize,
    /// How far the disk turns from the first to the last frame, degrees, default 366.
    pub degrees: f64,
    /// Frames a second, default 5.
    pub fps: f64,
    /// How the disk moves; `twice` goes the degrees twice, `back-and-forth` there and back. Default one turn.
    pub motion: Motion,
    /// How far the disk's axis leans against the vertical, degrees; 0..8, default 0.
    pub tilt_degrees: f64,
    /// The sensors around the disk.
    pub rig: RigSettings,
    /// The camera.
    pub sensor: SensorPreset,
    /// Camera to axis, metres; `None`: what suits the camera.
    pub distance_m: Option<f64>,
    /// Height of the camera over the disk, metres, default 0.95.
    pub height_m: f64,
    /// How far the torso sways, degrees (amplitude); 0 stands rigid, default 0.
    pub sway_degrees: f64,
    /// How far the chest moves with the breath, metres (amplitude), default 0.
    pub breathing_m: f64,
    /// Largest random turn of each joint from take to take, degrees, default 2.
    pub joint_jitter_degrees: f64,
    /// Floor and wall in view, default true.
    pub room: bool,
    /// False gives depth as the geometry is, rounded to units, default true.
    pub noise: bool,
    /// JPEG quality of the colour frames, 1..100, default 85.
    pub jpeg_quality: u8,
    /// What spoils depth beside the sensor's own noise, default nothing.
    #[serde(skip_serializing_if = "Nuisances::are_none")]
    pub nuisances: Nuisances,
}

impl Default for SyntheticSettings {
    fn default() -> Self {
        Self {
            name: "subject".into(),
            seed: 1,
            sex: Sex::Female,
            variety: 0.6,
            detail_m: 0.0012,
            garments: vec![GarmentSettings::of(GarmentKind::Trousers), GarmentSettings::of(GarmentKind::Tshirt)],
            cell_m: 0.008,
            frames: 100,
            degrees: 366.0,
            fps: 5.0,
            motion: Motion::Turn,
            tilt_degrees: 0.0,
            rig: RigSettings::default(),
            sensor: SensorPreset::Kinect2,
            distance_m: None,
            height_m: 0.95,
            sway_degrees: 0.0,
            breathing_m: 0.0,
            joint_jitter_degrees: 2.0,
            room: true,
            noise: true,
            jpeg_quality: 85,
            nuisances: Nuisances::default(),
        }
    }
}

impl SyntheticSettings {
    /// Checks every range.
    ///
    /// # Errors
    /// [`SyntheticError::Setting`] names the first setting that is out of its range.
    pub fn validate(&self) -> Result<(), SyntheticError> {
        let within = |name, value: f64, low: f64, high: f64| {
            if value.is_finite() && (low..=high).contains(&value) {
                return Ok(());
            }
            Err(SyntheticError::setting(name, format!("{value} is not within {low} to {high}")))
        };
        within("variety", self.variety, 0.0, 2.0)?;
        within("detail_m", self.detail_m, 0.0, 0.01)?;
        within("garments", self.garments.len() as f64, 0.0, 5.0)?;
        within("cell_m", f64::from(self.cell_m), 0.005, 0.03)?;
        within("frames", self.frames as f64, 2.0, 100_000.0)?;
        within("degrees", self.degrees, -7200.0, 7200.0)?;
        within("fps", self.fps, 0.01, 1000.0)?;
        within("tilt_degrees", self.tilt_degrees, 0.0, 8.0)?;
        within("sensors", self.rig.sensors as f64, 1.0, MAX_SENSORS as f64)?;
        within("error_m", self.rig.error_m, 0.0, 1.0)?;
        within("error_degrees", self.rig.error_degrees, 0.0, 30.0)?;
        within("clock_drift_ppm", self.rig.clock_drift_ppm, -1e4, 1e4)?;
        within("knock_m", self.rig.knock_m, 0.0, 0.2)?;
        within("interference", self.rig.interference, 0.0, 0.5)?;
        within("shake_degrees", self.rig.shake_degrees, 0.0, 0.3)?;
        within("distance_m", self.distance_m.unwrap_or(2.0), 1.0, 6.0)?;
        within("height_m", self.height_m, 0.1, 2.5)?;
        within("sway_degrees", self.sway_degrees, 0.0, 5.0)?;
        within("breathing_m", self.breathing_m, 0.0, 0.02)?;
        within("joint_jitter_degrees", self.joint_jitter_degrees, 0.0, 10.0)?;
        within("jpeg_quality", f64::from(self.jpeg_quality), 1.0, 100.0)?;
        self.nuisances.validate()
    }

    /// Folder name of take `n`: `00-body`, `01-trousers`, ...
    pub fn take_name(&self, take: usize) -> String {
        match take.checked_sub(1).and_then(|g| self.garments.get(g)) {
            Some(garment) => format!("{take:02}-{}", garment.kind.name()),
            None => format!("{take:02}-body"),
        }
    }
}
