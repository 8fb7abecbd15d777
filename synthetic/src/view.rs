//! Person, disk and room as a camera sees them.

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use rayon::prelude::*;
use toile_geometry::{Mesh, Rigid, camera::PinholeCamera};
use toile_render::{
    Camera, Raster, rasterize,
    shade::{Lights, linear, srgb},
};

use crate::{random::normal_at, room, sensor::TrueImage};

/// Colour where nothing is in view.
const DARK: [u8; 3] = [13, 13, 15];
/// Standard deviation of the colour's grain, steps of 1/255.
const GRAIN: f32 = 1.5;

/// The surroundings of the person.
#[derive(Debug, Clone)]
pub(crate) struct Scene {
    disk: Mesh,
    room: Option<Mesh>,
    /// The room in the frame of the disk, whose axis may lean.
    leaning: Rigid,
    noise_seed: u64,
}

/// Where the camera stands, and how far the disk has turned.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Viewpoint {
    pub room_from_camera: Rigid,
    /// Radians around +Y.
    pub angle: f64,
    /// Index of the frame: grain differs from frame to frame.
    pub frame: usize,
}

impl Scene {
    /// Disk, and where there is a room its floor, with a wall or without.
    pub fn new(with_wall: Option<bool>, leaning: Rigid, noise_seed: u64) -> Self {
        Self {
            disk: with_normals(room::disk()),
            room: with_wall.map(|wall| with_normals(room::floor_and_wall(wall))),
            leaning,
            noise_seed,
        }
    }

    /// True depth and shaded colour, row by row, of a person whose vertices are at `positions` now.
    pub fn look(
        &self,
        person: &Mesh,
        positions: Vec<Point3<f32>>,
        lens: &PinholeCamera,
        from: &Viewpoint,
    ) -> (TrueImage, Vec<[u8; 3]>) {
        let camera_from_room = from.room_from_camera.inverse();
        let turn = UnitQuaternion::from_scaled_axis(Vector3::y() * from.angle);
        let bent = Mesh { positions, triangles: person.triangles.clone(), ..Mesh::default() };
        let camera =
            |room_from_thing: Rigid| Camera { lens: *lens, camera_from_world: camera_from_room * room_from_thing };
        let turned = Isometry3::from_parts(Translation3::identity(), turn);
        let mut seen = vec![
            Faces { raster: rasterize(&bent, &camera(turned)), mesh: person, turn: turn.cast() },
            Faces { raster: rasterize(&self.disk, &camera(turned)), mesh: &self.disk, turn: turn.cast() },
        ];
        if let Some(room) = &self.room {
            let raster = rasterize(room, &camera(self.leaning));
            seen.push(Faces { raster, mesh: room, turn: self.leaning.rotation.cast() });
        }
        self.compose(&seen, lens, from)
    }

    fn compose(&self, seen: &[Faces], lens: &PinholeCamera, from: &Viewpoint) -> (TrueImage, Vec<[u8; 3]>) {
        let rays = lens.rays();
        let room_from_camera = from.room_from_camera.rotation.cast::<f32>();
        let lights = Lights::over_the_shoulder(Vector3::x(), Vector3::y(), Vector3::z());
        let pixels: Vec<Pixel> = (0..rays.len())
            .into_par_iter()
            .map(|i| {
                let grain = GRAIN * normal_at(self.noise_seed ^ 0xc0, from.frame as u64, i as u64) as f32;
                let ray = room_from_camera * Vector3::new(rays[i][0], rays[i][1], 1.0).normalize();
                Pixel::of(seen, i, &ray, &lights, grain)
            })
            .collect();
        let truth = TrueImage {
            depth: pixels.iter().map(|p| p.depth).collect(),
            cosine: pixels.iter().map(|p| p.cosine).collect(),
            albedo: pixels.iter().map(|p| p.albedo).collect(),
        };
        (truth, pixels.into_iter().map(|p| p.color).collect())
    }
}

fn with_normals(mut mesh: Mesh) -> Mesh {
    mesh.recompute_normals();
    mesh
}

/// One pixel of the true image.
struct Pixel {
    depth: f32,
    cosine: f32,
    albedo: f32,
    color: [u8; 3],
}

impl Pixel {
    fn of(seen: &[Faces], i: usize, ray: &Vector3<f32>, lights: &Lights, grain: f32) -> Self {
        let nearest = seen
            .iter()
            .filter(|s| s.raster.depth[i] > 0.0)
            .min_by(|a, b| a.raster.depth[i].total_cmp(&b.raster.depth[i]));
        let grainy = |color: [u8; 3]| color.map(|c| (f32::from(c) + grain).clamp(0.0, 255.0) as u8);
        let Some((s, (normal, albedo))) = nearest.and_then(|s| Some((s, s.surface(i)?))) else {
            return Self { depth: 0.0, cosine: 0.0, albedo: 0.0, color: grainy(DARK) };
        };
        let cosine = -normal.dot(ray);
        let towards_camera = if cosine < 0.0 { -normal } else { normal };
        let brightness = lights.brightness(&towards_camera);
        let color = grainy(srgb(albedo.map(|a| a * brightness)));
        Self { depth: s.raster.depth[i], cosine: cosine.abs(), albedo: albedo.iter().sum::<f32>() / 3.0, color }
    }
}

/// One rasterised mesh of the scene.
struct Faces<'a> {
    raster: Raster,
    mesh: &'a Mesh,
    /// Rotation of room from the mesh's frame.
    turn: UnitQuaternion<f32>,
}

impl Faces<'_> {
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
