//! One take: who stands on the disk, and what the camera records at each moment.

use std::sync::Arc;

use nalgebra::Point3;
use serde_json::Value;
use toile_capture::{ColorImage, DepthImage, DeviceIdentity, Frame, RgbImage, Rig, Sensor};
use toile_character::{Joint, Pose, Skeleton};
use toile_geometry::{Mesh, Rigid, camera::PinholeCamera};

use crate::{
    SyntheticError,
    dirt::{Stage, spoil_depth, spoil_light, whiten_dark_cloth},
    dressing::dress,
    interference::disturb,
    lens::{Picture, smear, through_lens},
    posture::pose_of_take,
    random::Random,
    rig::{Stand, knock, leaning, rig_json, stands},
    sensor::{self, DEPTH_SCALE, NoiseSeed, TrueImage},
    settings::SyntheticSettings,
    subject::Subject,
    surface::Surface,
    turntable::{Bend, Moment, moments},
    view::{Scene, Viewpoint},
};

/// Moments of an exposure that a smeared picture is made of.
const SMEARED: usize = 5;

/// One take of a subject.
#[derive(Debug, Clone)]
pub struct Take {
    /// Its number.
    pub index: usize,
    /// Its name, such as `01-trousers`.
    pub name: String,
    /// How the person stands.
    pub pose: Pose,
    /// The person's joints at rest.
    pub skeleton: Skeleton,
    /// The true surface.
    pub surface: Surface,
    /// The body on the template's topology, posed.
    pub body: Mesh,
    /// The moments of the frames.
    pub moments: Vec<Moment>,
    /// Where the (first) camera stands in the room (disk's axis, disk's top).
    pub room_from_camera: Rigid,
    /// How sway and breath bend the true surface.
    pub bend: Bend,
    settings: SyntheticSettings,
    scene: Scene,
    noise_seed: u64,
    /// The sensors of the rig.
    stands: Vec<Stand>,
    /// How the last of them is pushed aside in the middle of the take.
    knock: Rigid,
}

impl Subject {
    /// The scene of take `index`.
    ///
    /// # Errors
    /// [`SyntheticError::NoTake`] where the subject has fewer takes.
    pub fn take(&self, index: usize) -> Result<Take, SyntheticError> {
        if index >= self.take_count() {
            return Err(SyntheticError::NoTake { take: index, last: self.take_count() - 1 });
        }
        Ok(Take::new(self, index))
    }
}

impl Take {
    fn new(subject: &Subject, index: usize) -> Self {
        let (settings, person) = (&subject.settings, &subject.person);
        let pose = pose_of_take(person, settings, index);
        let pose_0 = pose_of_take(person, settings, 0);
        let posed = dress(person, &subject.garments, index, &pose);
        let posed_0 = dress(person, &subject.garments, index, &pose_0);
        let body = Mesh::new(posed.body.clone(), person.body.mesh.triangles.clone());
        let surface = Surface::new(
            subject,
            &[&[posed.skin][..], &posed.garments].concat(),
            &[&[posed_0.skin][..], &posed_0.garments].concat(),
        );
        let joints = pose.joint_positions(&person.body.skeleton);
        let bend = Bend { hips: joints[Joint::Spine.index()], chest: joints[Joint::UpperChest.index()] };
        let stands = stands(settings);
        let noise_seed = Random::new(settings.seed, &format!("take {index} noise")).seed();
        Self {
            index,
            name: settings.take_name(index),
            pose,
            skeleton: person.body.skeleton.clone(),
            surface,
            body,
            moments: moments(settings, index, &stands),
            room_from_camera: stands[0].room_from_camera,
            bend,
            settings: settings.clone(),
            scene: Scene::new(settings.room.then_some(stands.len() < 2), leaning(settings), noise_seed),
            noise_seed,
            knock: knock(settings, index),
            stands,
        }
    }

    /// The camera.
    pub fn camera(&self) -> PinholeCamera {
        self.settings.sensor.camera()
    }

    /// The camera as the recording's calibration tells it: with its lens, unless that is kept from it.
    pub fn told_camera(&self) -> PinholeCamera {
        self.settings.nuisances.told(&self.camera())
    }

    /// The virtual rig as the recording has it: colour registered to depth; the sensors' places with their error.
    pub fn rig(&self) -> Rig {
        let preset = self.settings.sensor;
        let sensor = |(k, stand): (usize, &Stand)| Sensor {
            name: stand.name.clone(),
            identity: DeviceIdentity {
                model: format!("synthetic {}", preset.name()),
                serial: format!("SYN-{:08x}", (self.settings.seed as u32).wrapping_add(k as u32)),
                firmware: env!("CARGO_PKG_VERSION").into(),
                ..DeviceIdentity::default()
            },
            depth: self.told_camera(),
            depth_scale: DEPTH_SCALE,
            color: Some(self.told_camera()),
            color_from_depth: Rigid::identity(),
            rig_from_depth: stand.recorded,
            fps: self.settings.fps,
        };
        Rig { sensors: self.stands.iter().enumerate().map(sensor).collect() }
    }

    /// What is true of the rig; `None` for a single sensor.
    pub(crate) fn rig_truth(&self) -> Option<Value> {
        let knock = (self.settings.rig.knock_m > 0.0).then_some(self.knock);
        (self.stands.len() > 1).then(|| rig_json(&self.stands, knock))
    }

    /// Where the camera of frame `index` stands in the room at that moment.
    fn room_from_sensor(&self, index: usize) -> Rigid {
        let moment = &self.moments[index];
        let still =
            if moment.sensor == 0 { self.room_from_camera } else { self.stands[moment.sensor].room_from_camera };
        let aside = if moment.is_knocked { still * self.knock } else { still };
        if self.settings.rig.shake_degrees == 0.0 {
            return aside;
        }
        aside * Rigid::new(nalgebra::Vector3::zeros(), moment.shake)
    }

    /// Positions of the joints in the subject's frame at rest (without sway).
    pub fn joint_positions(&self) -> Vec<Point3<f64>> {
        self.pose.joint_positions(&self.skeleton)
    }

    /// Where the camera is for the subject at frame `index`.
    pub fn subject_from_camera(&self, index: usize) -> Rigid {
        self.moments[index].subject_from_camera(&self.room_from_sensor(index))
    }

    /// The picture of frame `index`: true depth and shaded colour, row by row.
    pub fn look(&self, index: usize) -> (TrueImage, Vec<[u8; 3]>) {
        self.look_through(&self.camera(), index)
    }

    /// The picture of frame `index` through another lens in the camera's place.
    pub fn look_through(&self, lens: &PinholeCamera, index: usize) -> (TrueImage, Vec<[u8; 3]>) {
        self.look_at(lens, index, &self.moments[index])
    }

    /// The picture of frame `index` if it were taken at another moment.
    fn look_at(&self, lens: &PinholeCamera, index: usize, moment: &Moment) -> Picture {
        let bent = self.bend.apply(&self.surface.mesh.positions, moment);
        let from = Viewpoint { room_from_camera: self.room_from_sensor(index), angle: moment.angle, frame: index };
        self.scene.look(&self.surface.mesh, bent, lens, &from)
    }

    /// Depth (units of [`DEPTH_SCALE`]) and colours of frame `index`, with everything that spoils them.
    fn measured(&self, index: usize) -> (Vec<u16>, Vec<[u8; 3]>) {
        let nuisances = &self.settings.nuisances;
        let noise = NoiseSeed { seed: self.noise_seed, frame: index as u64 };
        let (mut truth, pixels) = if nuisances.are_none() { self.look(index) } else { self.spoilt(index, noise) };
        let dark = if nuisances.has_dark_cloth { whiten_dark_cloth(&mut truth) } else { Vec::new() };
        let mut values = if self.settings.noise {
            sensor::measure(self.settings.sensor, &truth, noise)
        } else {
            sensor::exact(&truth)
        };
        if !nuisances.are_none() {
            spoil_depth(nuisances, noise, self.camera().width as usize, (&truth, &dark), &mut values);
        }
        if self.stands.len() > 1 {
            let lens = self.camera();
            disturb(&mut values, (lens.width, lens.height), self.settings.rig.interference, noise);
        }
        (values, pixels)
    }

    /// The picture of frame `index` with everything that spoils it before it is measured.
    fn spoilt(&self, index: usize, noise: NoiseSeed) -> Picture {
        let (nuisances, camera) = (&self.settings.nuisances, self.camera());
        let smear_rad = nuisances.smear_degrees.to_radians();
        let mut picture = if smear_rad > 0.0 {
            let at = |k: usize| {
                let part = k as f64 / (SMEARED - 1) as f64 - 0.5;
                let moment = Moment { angle: self.moments[index].angle + part * smear_rad, ..self.moments[index] };
                self.look_at(&camera, index, &moment)
            };
            smear((0..SMEARED).map(at).collect())
        } else {
            self.look(index)
        };
        let top = self.surface.mesh.positions.iter().map(|p| f64::from(p.y)).fold(0.0, f64::max);
        let stage = Stage { camera: &camera, room_from_camera: &self.room_from_sensor(index), top, noise };
        spoil_light(nuisances, &stage, &mut picture.0);
        let bent = nuisances.bent(&camera);
        if bent.is_distorted() { through_lens(&picture, &bent) } else { picture }
    }

    /// Frame `index` as the virtual device gives it.
    ///
    /// # Errors
    /// [`SyntheticError::Encode`] where the colour cannot be encoded.
    pub fn frame(&self, index: usize) -> Result<Frame, SyntheticError> {
        let (values, pixels) = self.measured(index);
        let lens = self.camera();
        let color = RgbImage { width: lens.width, height: lens.height, pixels };
        let jpeg = encode_jpeg(&color, self.settings.jpeg_quality)
            .map_err(|reason| SyntheticError::Encode { index, reason })?;
        let moment = &self.moments[index];
        Ok(Frame {
            sensor: moment.sensor,
            index: index as u64,
            device_frame: (index / self.stands.len()) as u64,
            lost_before: 0,
            device_time_ns: moment.time_ns,
            host_time_ns: moment.host_time_ns,
            depth: Some(Arc::new(DepthImage { width: lens.width, height: lens.height, values })),
            color: Some(ColorImage::Jpeg(jpeg.into())),
        })
    }
}

fn encode_jpeg(image: &RgbImage, quality: u8) -> Result<Vec<u8>, String> {
    let mut bytes = Vec::new();
    let encoder = jpeg_encoder::Encoder::new(&mut bytes, quality);
    let flat: Vec<u8> = image.pixels.iter().flatten().copied().collect();
    let (width, height) = (image.width as u16, image.height as u16);
    encoder.encode(&flat, width, height, jpeg_encoder::ColorType::Rgb).map_err(|e| e.to_string())?;
    Ok(bytes)
}
