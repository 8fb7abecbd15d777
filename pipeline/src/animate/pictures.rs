//! A motion as pictures: a film that goes round, and where the cloth stretches and leaves its skinned place.

use std::{
    f64::consts::{FRAC_PI_2, PI},
    path::Path,
};

use nalgebra::Point3;
use toile_avatar::Avatar;
use toile_character::{Motion, Pose, Skeleton, SkinWeights};
use toile_geometry::Mesh;
use toile_render::{Drawn, RenderError, RgbImage, View, film, picture, png, sheet};

use super::{caches::Cached, inputs::Baking, report::AnimationReport};
use crate::PipelineError;

/// Pictures of the film at most, and milliseconds that each is shown at least.
const PICTURES: usize = 48;
const SHORTEST: f64 = 80.0;
/// Size of a picture of the film and of a still, pixels.
const FILM: (u32, u32) = (240, 320);
const STILL: (u32, u32) = (300, 400);
/// Bytes of a film at most.
pub(super) const FILM_LIMIT: usize = 3_000_000;
/// Directions from which a still is seen, radians around +Y.
const HEADINGS: [(f64, &str); 5] =
    [(0.0, "front"), (0.8, "left front"), (FRAC_PI_2, "left"), (PI, "back"), (-0.8, "right front")];
/// What is shown around the hips as shares of the person's height: half the width, how far below them, and the whole height.
const WIDTH: f32 = 0.36;
const BELOW: f32 = 0.58;
const HEIGHT: f32 = 1.12;
/// Names and ranges of the colour maps.
const STRETCH: (&str, (f32, f32)) = ("stretch", (1.0, 1.5));
const AWAY: (&str, (f32, f32)) = ("from_skinned_mm", (0.0, 60.0));

/// A motion's layers, to be drawn.
pub(super) struct Pictures<'a> {
    pub avatar: &'a Avatar,
    pub motion: &'a Motion,
    pub cached: &'a mut [Cached],
    /// The motion's folder, for messages.
    pub folder: &'a Path,
}

impl Pictures<'_> {
    /// `film.gif`, and `stills.png`: five viewpoints of the frame in which the layers stretch most, with colour maps of their stretch and of
    /// their distance from where skinning alone would take them.
    pub fn files(&mut self, report: &AnimationReport) -> Result<[(&'static str, Vec<u8>); 2], PipelineError> {
        Ok([("film.gif", self.film()?), ("stills.png", self.stills(report.most_stretched())?)])
    }

    fn film(&mut self) -> Result<Vec<u8>, PipelineError> {
        let wrong = of_folder(self.folder);
        let (shown, milliseconds) = film_frames(self.motion);
        let mut pictures = Vec::new();
        for frame in shown {
            let layers = self.layers(frame)?;
            let drawn: Vec<Drawn> = layers.iter().map(Drawn::colored).collect();
            pictures.push(drawn_from(&drawn, &self.view(frame, HEADINGS[1].0), FILM).map_err(wrong)?);
        }
        film::gif(&pictures, milliseconds, FILM_LIMIT).map_err(wrong)
    }

    fn stills(&mut self, frame: usize) -> Result<Vec<u8>, PipelineError> {
        let wrong = of_folder(self.folder);
        let mut layers = self.layers(frame)?;
        let skinned = self.skinned(frame);
        for ((mesh, rest), skinned) in layers.iter_mut().zip(&self.avatar.layers).zip(&skinned) {
            let away = mesh.positions.iter().zip(skinned).map(|(a, b)| 1e3 * (a - b).norm()).collect();
            mesh.attributes.insert(AWAY.0.into(), away);
            let stretched = stretch(&rest.mesh, &mesh.positions);
            mesh.attributes.insert(STRETCH.0.into(), stretched);
        }
        let mut tiles = Vec::new();
        for (heading, name) in HEADINGS {
            let drawn: Vec<Drawn> = layers.iter().map(Drawn::colored).collect();
            tiles.push((name.to_string(), drawn_from(&drawn, &self.view(frame, heading), STILL).map_err(wrong)?));
        }
        for ((attribute, range), name, unit) in [(STRETCH, "stretch", ""), (AWAY, "from skinned place", "mm")] {
            let drawn: Vec<Drawn> = layers.iter().map(|mesh| Drawn::attribute(mesh, attribute, range)).collect();
            let still = drawn_from(&drawn, &self.view(frame, HEADINGS[1].0), STILL).map_err(wrong)?;
            tiles.push((name.to_string(), sheet::scale_bar(&still, range, unit)));
        }
        let sheet = sheet::contact_sheet(&tiles, tiles.len()).map_err(wrong)?;
        png::encode(&sheet).map_err(wrong)
    }

    /// The layers in a frame, with normals.
    fn layers(&mut self, frame: usize) -> Result<Vec<Mesh>, PipelineError> {
        let of = |(cached, layer): (&mut Cached, &toile_avatar::AvatarLayer)| {
            let mut mesh = Mesh { positions: cached.frame(frame)?, normals: Vec::new(), ..layer.mesh.clone() };
            mesh.recompute_normals();
            Ok(mesh)
        };
        self.cached.iter_mut().zip(&self.avatar.layers).map(of).collect()
    }

    /// Where skinning alone takes the layers' vertices.
    fn skinned(&self, frame: usize) -> Vec<Vec<Point3<f32>>> {
        let moved = self.motion.poses[frame].transforms_from(&self.avatar.pose0, &self.avatar.skeleton);
        let of = |mesh: &Mesh, weights: &SkinWeights| toile_character::skinning::skin(&mesh.positions, weights, &moved);
        self.avatar.layers.iter().map(|l| of(&l.mesh, &l.weights)).collect()
    }

    fn view(&self, frame: usize, heading: f64) -> View {
        view(&self.avatar.skeleton, &self.motion.poses[frame], heading)
    }
}

/// The frames of a motion that its film shows, and milliseconds that each is shown.
pub(super) fn film_frames(motion: &Motion) -> (Vec<usize>, u32) {
    let count = motion.poses.len();
    let frame_time = 1e3 * motion.frame_time;
    let every = (SHORTEST / frame_time).ceil().max((count as f64 / PICTURES as f64).ceil()).max(1.0);
    ((0..count).step_by(every as usize).collect(), (frame_time * every).round() as u32)
}

/// The layers at `positions`, which are theirs in a frame, as a picture of the film.
pub(super) fn portrait(
    baking: &Baking,
    positions: &[Vec<Point3<f32>>],
    frame: usize,
) -> Result<RgbImage, PipelineError> {
    let mesh = |(layer, positions): (&toile_avatar::AvatarLayer, &Vec<Point3<f32>>)| {
        let mut mesh = Mesh { positions: positions.clone(), normals: Vec::new(), ..layer.mesh.clone() };
        mesh.recompute_normals();
        mesh
    };
    let layers: Vec<Mesh> = baking.avatar.layers.iter().zip(positions).map(mesh).collect();
    let drawn: Vec<Drawn> = layers.iter().map(Drawn::colored).collect();
    let view = view(&baking.avatar.skeleton, &baking.motion.poses[frame], HEADINGS[1].0);
    drawn_from(&drawn, &view, FILM).map_err(of_folder(baking.folder))
}

/// The view from a heading that follows the hips over the ground.
fn view(skeleton: &Skeleton, pose: &Pose, heading: f64) -> View {
    let height = |pose: &Pose| pose.joint_positions(skeleton).iter().map(|p| p.y as f32).fold(f32::MIN, f32::max);
    let tall = height(&Pose::identity()).max(0.5);
    let hips = pose.joint_positions(skeleton)[0].cast::<f32>();
    let low = Point3::new(hips.x - WIDTH * tall, hips.y - BELOW * tall, hips.z - WIDTH * tall);
    let high = Point3::new(hips.x + WIDTH * tall, low.y + HEIGHT * tall, hips.z + WIDTH * tall);
    View::around(heading, 0.08).fitted((low, high))
}

fn of_folder(folder: &Path) -> impl Fn(RenderError) -> PipelineError + Copy + '_ {
    move |e| PipelineError::stage(folder, e)
}

fn drawn_from(drawn: &[Drawn], view: &View, size: (u32, u32)) -> Result<RgbImage, RenderError> {
    picture(drawn, view, size.0, size.1)
}

/// How many times as long as in the scan the longest-drawn edge at each vertex is.
fn stretch(rest: &Mesh, now: &[Point3<f32>]) -> Vec<f32> {
    let mut most = vec![1.0f32; now.len()];
    for triangle in &rest.triangles {
        for k in 0..3 {
            let [a, b] = [triangle[k] as usize, triangle[(k + 1) % 3] as usize];
            let ratio = (now[a] - now[b]).norm() / (rest.positions[a] - rest.positions[b]).norm().max(2e-4);
            most[a] = most[a].max(ratio);
            most[b] = most[b].max(ratio);
        }
    }
    most
}
