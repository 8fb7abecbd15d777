//! The scene of one take: who stands on the disk, and what the camera sees of it at each moment.

use std::sync::Arc;

use nalgebra::{Isometry3, Matrix3, Point3, Rotation3, UnitQuaternion, Vector3};
use rayon::prelude::*;
use toile_capture::{ColorImage, DepthImage, DeviceIdentity, Frame, RgbImage, Rig, Sensor};
use toile_character::{Joint, Pose, Region, Skeleton};
use toile_geometry::{Mesh, Rigid, camera::PinholeCamera};
use toile_render::{
    Camera, Raster, rasterize,
    shade::{Lights, linear, srgb},
};

use crate::{
    SyntheticError,
    dressing::dress,
    posture::pose_of_take,
    random::{Random, normal_at},
    room,
    sensor::{self, DEPTH_SCALE, NoiseSeed, TrueImage},
    settings::SyntheticSettings,
    subject::Subject,
    turntable::{Bend, Moment, moments},
};

/// Colour where nothing is in view.
const DARK: [u8; 3] = [13, 13, 15];
/// Host time minus device time of the virtual device, nanoseconds.
const LATENCY_NS: i64 = 8_000_000;

/// All layers that take `n` shows, in one mesh, in the subject's frame (+Y up, origin on the disk's axis at its top).
#[derive(Debug, Clone)]
pub struct Surface {
    /// Vertices of all layers, coloured, with normals.
    pub mesh: Mesh,
    /// The same vertices in take 0's pose and frame.
    pub in_take_0: Vec<Point3<f32>>,
    /// Layer of each triangle: 0 body, n garment n.
    pub layer: Vec<u8>,
    /// Region of each triangle: 0 torso, 1 arms, 2 legs, 3 hands, feet, head, 255 cloth.
    pub region: Vec<u8>,
}

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
    /// Where the camera stands in the room (disk's axis, disk's top).
    pub room_from_camera: Rigid,
    /// How sway and breath bend the true surface.
    pub bend: Bend,
    settings: SyntheticSettings,
    disk: Mesh,
    room: Option<Mesh>,
    noise_seed: u64,
}

impl Take {
    pub(crate) fn new(subject: &Subject, index: usize) -> Self {
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
        Self {
            index,
            name: settings.take_name(index),
            pose,
            skeleton: person.body.skeleton.clone(),
            surface,
            body,
            moments: moments(settings, index),
            room_from_camera: camera_stand(settings),
            bend,
            settings: settings.clone(),
            disk: with_normals(room::disk()),
            room: settings.room.then(|| with_normals(room::floor_and_wall())),
            noise_seed: Random::new(settings.seed, &format!("take {index} noise")).seed(),
        }
    }

    /// The camera.
    pub fn camera(&self) -> PinholeCamera {
        self.settings.sensor.camera()
    }

    /// The virtual rig: one sensor, colour registered to depth.
    pub fn rig(&self) -> Rig {
        let preset = self.settings.sensor;
        let identity = DeviceIdentity {
            model: format!("synthetic {}", preset.name()),
            serial: format!("SYN-{:08x}", self.settings.seed as u32),
            firmware: env!("CARGO_PKG_VERSION").into(),
            ..DeviceIdentity::default()
        };
        let sensor = Sensor {
            name: "camera".into(),
            identity,
            depth: self.camera(),
            depth_scale: DEPTH_SCALE,
            color: Some(self.camera()),
            color_from_depth: Rigid::identity(),
            rig_from_depth: Rigid::identity(),
            fps: self.settings.fps,
        };
        Rig { sensors: vec![sensor] }
    }

    /// Poses of the joints in the subject's frame at rest (without sway).
    pub fn joint_positions(&self) -> Vec<Point3<f64>> {
        self.pose.joint_positions(&self.skeleton)
    }

    /// Where the camera is for the subject at frame `index`.
    pub fn subject_from_camera(&self, index: usize) -> Rigid {
        self.moments[index].subject_from_camera(&self.room_from_camera)
    }

    /// What frame `index` shows: true depth and shaded colour, row by row.
    pub fn look(&self, index: usize) -> (TrueImage, Vec<[u8; 3]>) {
        self.look_through(&self.camera(), index)
    }

    /// What frame `index` shows through another lens in the camera's place.
    pub fn look_through(&self, lens: &PinholeCamera, index: usize) -> (TrueImage, Vec<[u8; 3]>) {
        let moment = &self.moments[index];
        let camera_from_room = self.room_from_camera.inverse();
        let turn = UnitQuaternion::from_scaled_axis(Vector3::y() * moment.angle);
        let bent = Mesh {
            positions: self.bend.apply(&self.surface.mesh.positions, moment),
            triangles: self.surface.mesh.triangles.clone(),
            ..Mesh::default()
        };
        let camera =
            |room_from_thing: Rigid| Camera { lens: *lens, camera_from_world: camera_from_room * room_from_thing };
        let turned = Isometry3::from_parts(nalgebra::Translation3::identity(), turn);
        let mut seen = vec![
            Seen { raster: rasterize(&bent, &camera(turned)), mesh: &self.surface.mesh, turn: turn.cast() },
            Seen { raster: rasterize(&self.disk, &camera(turned)), mesh: &self.disk, turn: turn.cast() },
        ];
        if let Some(room) = &self.room {
            let raster = rasterize(room, &camera(Rigid::identity()));
            seen.push(Seen { raster, mesh: room, turn: UnitQuaternion::identity() });
        }
        self.compose(&seen, lens, index)
    }

    fn compose(&self, seen: &[Seen], lens: &PinholeCamera, index: usize) -> (TrueImage, Vec<[u8; 3]>) {
        let rays = lens.rays();
        let room_from_camera = self.room_from_camera.rotation.cast::<f32>();
        let lights = Lights::over_the_shoulder(Vector3::x(), Vector3::y(), Vector3::z());
        let pixels: Vec<(f32, f32, f32, [u8; 3])> = (0..rays.len())
            .into_par_iter()
            .map(|i| {
                let nearest = seen
                    .iter()
                    .filter(|s| s.raster.depth[i] > 0.0)
                    .min_by(|a, b| a.raster.depth[i].total_cmp(&b.raster.depth[i]));
                let grain = 1.5 * normal_at(self.noise_seed ^ 0xc0, index as u64, i as u64) as f32;
                let Some((s, (normal, albedo))) = nearest.and_then(|s| Some((s, s.surface(i)?))) else {
                    return (0.0, 0.0, 0.0, DARK.map(|c| (f32::from(c) + grain).clamp(0.0, 255.0) as u8));
                };
                let ray = room_from_camera * Vector3::new(rays[i][0], rays[i][1], 1.0).normalize();
                let cosine = -normal.dot(&ray);
                let facing = if cosine < 0.0 { -normal } else { normal };
                let brightness = lights.brightness(&facing);
                let color = srgb(albedo.map(|a| a * brightness));
                let grainy = color.map(|c| (f32::from(c) + grain).clamp(0.0, 255.0) as u8);
                (s.raster.depth[i], cosine.abs(), albedo.iter().sum::<f32>() / 3.0, grainy)
            })
            .collect();
        let truth = TrueImage {
            depth: pixels.iter().map(|p| p.0).collect(),
            cosine: pixels.iter().map(|p| p.1).collect(),
            albedo: pixels.iter().map(|p| p.2).collect(),
        };
        (truth, pixels.into_iter().map(|p| p.3).collect())
    }

    /// Frame `index` as the virtual device gives it.
    ///
    /// # Errors
    /// [`SyntheticError::Encode`] where the colour cannot be encoded.
    pub fn frame(&self, index: usize) -> Result<Frame, SyntheticError> {
        let (truth, pixels) = self.look(index);
        let lens = self.camera();
        let noise = NoiseSeed { seed: self.noise_seed, frame: index as u64 };
        let values = if self.settings.noise {
            sensor::measure(self.settings.sensor, &truth, noise)
        } else {
            sensor::exact(&truth)
        };
        let color = RgbImage { width: lens.width, height: lens.height, pixels };
        let jpeg = encode_jpeg(&color, self.settings.jpeg_quality)
            .map_err(|reason| SyntheticError::Encode { index, reason })?;
        let time = self.moments[index].time_ns;
        Ok(Frame {
            sensor: 0,
            index: index as u64,
            device_frame: index as u64,
            lost_before: 0,
            device_time_ns: time,
            host_time_ns: time + LATENCY_NS,
            depth: Some(Arc::new(DepthImage { width: lens.width, height: lens.height, values })),
            color: Some(ColorImage::Jpeg(jpeg.into())),
        })
    }
}

/// One rasterised mesh of the scene.
struct Seen<'a> {
    raster: Raster,
    mesh: &'a Mesh,
    /// Rotation of room from the mesh's frame.
    turn: UnitQuaternion<f32>,
}

impl Seen<'_> {
    /// Unit normal in the room and linear albedo at a pixel.
    fn surface(&self, pixel: usize) -> Option<(Vector3<f32>, [f32; 3])> {
        let (t, w) = self.raster.hit(pixel)?;
        let mut normal = Vector3::zeros();
        let mut albedo = [0.0; 3];
        for (v, w) in self.mesh.triangles[t].into_iter().zip(w) {
            normal += self.mesh.normals[v as usize] * w;
            let color = linear(self.mesh.colors[v as usize]);
            (0..3).for_each(|k| albedo[k] += color[k] * w);
        }
        Some((self.turn * normal.try_normalize(1e-6)?, albedo))
    }
}

impl Surface {
    /// Joins posed layers; `posed` and `posed_0` hold the skin and then each garment.
    fn new(subject: &Subject, posed: &[Vec<Point3<f32>>], posed_0: &[Vec<Point3<f32>>]) -> Self {
        let person = &subject.person;
        let garments = subject.garments.iter().map(|g| &g.worn.mesh);
        let mut out =
            Self { mesh: Mesh::default(), in_take_0: posed_0.concat(), layer: Vec::new(), region: Vec::new() };
        for (n, (layer, positions)) in std::iter::once(&person.skin.mesh).chain(garments).zip(posed).enumerate() {
            let first = out.mesh.positions.len() as u32;
            out.mesh.positions.extend(positions);
            out.mesh.colors.extend(&layer.colors);
            for t in &layer.triangles {
                out.mesh.triangles.push(t.map(|v| v + first));
                out.layer.push(n as u8);
                out.region.push(if n == 0 { region_code(person.skin_regions[t[0] as usize]) } else { 255 });
            }
        }
        out.mesh.recompute_normals();
        out
    }
}

fn region_code(region: Region) -> u8 {
    match region {
        Region::Torso => 0,
        Region::LeftArm | Region::RightArm => 1,
        Region::LeftLeg | Region::RightLeg => 2,
        _ => 3,
    }
}

fn with_normals(mut mesh: Mesh) -> Mesh {
    mesh.recompute_normals();
    mesh
}

/// The camera looks along −z of the room, tilted and turned a little as a tripod by hand is.
fn camera_stand(settings: &SyntheticSettings) -> Rigid {
    let mut random = Random::new(settings.seed, "camera");
    let (tilt, yaw) = (random.range(-1.5, 1.5).to_radians(), random.range(-1.5, 1.5).to_radians());
    let level = Matrix3::new(1.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, -1.0);
    let level = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(level));
    let aim = UnitQuaternion::from_euler_angles(tilt, yaw, 0.0);
    let distance = settings.distance_m.unwrap_or_else(|| settings.sensor.usual_distance());
    let place = Vector3::new(random.range(-0.03, 0.03), settings.height_m, distance);
    Rigid::from_parts(place.into(), aim * level)
}

fn encode_jpeg(image: &RgbImage, quality: u8) -> Result<Vec<u8>, String> {
    let mut bytes = Vec::new();
    let encoder = jpeg_encoder::Encoder::new(&mut bytes, quality);
    let flat: Vec<u8> = image.pixels.iter().flatten().copied().collect();
    let (width, height) = (image.width as u16, image.height as u16);
    encoder.encode(&flat, width, height, jpeg_encoder::ColorType::Rgb).map_err(|e| e.to_string())?;
    Ok(bytes)
}
